//! Integrators from outside the crate.

use super::build::Problem;
use crate::dynamics::{State, Time};
use crate::stepping::{Cause, Integrator, Statistics, StepError, shortened};
use std::cmp::Ordering;
use std::fmt;
use std::sync::Arc;

/// Makes an integrator of any mechanism: it is called for the run, for what is integrated again after
/// impacts, and where a run goes on.
type Make = dyn Fn() -> Box<dyn Integrator<dyn Problem> + Send> + Send + Sync;

/// An integrator from outside, as a plan holds it; two are the same where one is a clone of the other.
///
/// It is driven as the crate's own ones: events, monitors, projection after its steps, the error estimate,
/// pauses.  Impacts it has to locate itself: its [`step`](Integrator::step) ends where one of the
/// [gaps](crate::OdeSystem::gaps) passes zero, just before, and returns the number of that gap; the run then
/// carries out the impact, and stops with [`Cause::WallPassed`] where a wall was passed without.  One that is
/// [dense](Integrator::is_dense) takes steps as long as it likes; one that is not is asked for steps that end
/// on output times.
///
/// ```
/// use driftless::{Custom, Integrator, OdeSystem, Simulation, read_scene};
/// use driftless::{State, Statistics, StepError, Time};
///
/// /// Heun's method with a step of its own: order 2.
/// struct Heun {
///     step: f64,
/// }
///
/// impl<P: OdeSystem + ?Sized> Integrator<P> for Heun {
///     fn name(&self) -> &'static str {
///         "heun"
///     }
///
///     fn order(&self) -> u32 {
///         2
///     }
///
///     fn begin(&mut self, _: &mut P, _: &mut State, _: Time) -> Result<(), StepError> {
///         Ok(())
///     }
///
///     fn step(
///         &mut self,
///         problem: &mut P,
///         state: &mut State,
///         until: Time,
///         statistics: &mut Statistics,
///     ) -> Result<Option<usize>, StepError> {
///         let left = (until - state.time).hi;
///         let h = if left < 1.5 * self.step { left } else { self.step };
///         let (mut first, mut second) = (vec![0.0; state.y.len()], vec![0.0; state.y.len()]);
///         problem.rhs(state.time, &state.y, &mut first);
///         let there: Vec<f64> = state.y.iter().zip(&first).map(|(y, rate)| y + h * rate).collect();
///         problem.rhs(state.time + h, &there, &mut second);
///         for i in 0..there.len() {
///             state.y[i] += 0.5 * h * (first[i] + second[i]);
///         }
///         state.time = if h == left { until } else { state.time + h };
///         state.wrap();
///         (statistics.steps, statistics.evaluations) = (statistics.steps + 1, statistics.evaluations + 2);
///         Ok(None)
///     }
/// }
///
/// # fn main() -> Result<(), driftless::Error> {
/// let scene = read_scene("examples/scenes/free.json".as_ref(), &[])?;
/// let heun = Custom::new("heun", || Box::new(Heun { step: 1e-4 }));
/// let outcome = Simulation::new(&scene)?.until(1.0).integrator(heun).run()?;
/// assert!(outcome.stop.is_none() && outcome.drift.energy.max < 1e-5);
/// # Ok(())
/// # }
/// ```
#[derive(Clone)]
pub struct Custom {
    name: String,
    make: Arc<Make>,
}

impl Custom {
    /// Of a name, for messages, and what makes one.
    pub fn new(
        name: &str,
        make: impl Fn() -> Box<dyn Integrator<dyn Problem> + Send> + Send + Sync + 'static,
    ) -> Self {
        Self { name: name.into(), make: Arc::new(make) }
    }

    /// What it is called.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn make(&self) -> Outside {
        Outside { inner: (self.make)(), make: Arc::clone(&self.make), spare: None }
    }
}

/// One as the driver calls it.
pub(super) struct Outside {
    inner: Box<dyn Integrator<dyn Problem> + Send>,
    make: Arc<Make>,
    /// Makes shorter steps, once one is asked for.
    spare: Option<Box<dyn Integrator<dyn Problem> + Send>>,
}

impl Integrator<dyn Problem> for Outside {
    fn name(&self) -> &'static str {
        self.inner.name()
    }

    fn order(&self) -> u32 {
        self.inner.order()
    }

    fn begin(
        &mut self,
        problem: &mut (dyn Problem + 'static),
        state: &mut State,
        until: Time,
    ) -> Result<(), StepError> {
        self.inner.begin(problem, state, until)
    }

    fn step(
        &mut self,
        problem: &mut (dyn Problem + 'static),
        state: &mut State,
        until: Time,
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError> {
        let begin = state.time;
        let event = self.inner.step(problem, state, until, statistics)?;
        if event.is_none() && (state.time - begin).hi.partial_cmp(&0.0) != Some(Ordering::Greater) {
            return Err(StepError {
                cause: Cause::StepTooSmall,
                method: self.name().into(),
                t: begin.hi,
                step: 0.0,
                what: "its step has not moved the time on".into(),
                hint: "every call of `Integrator::step` is to end later than it begins".into(),
            });
        }
        Ok(event)
    }

    fn is_at(&self, state: &State, until: Time) -> bool {
        self.inner.is_at(state, until)
    }

    fn changed(&mut self, state: &mut State) {
        self.inner.changed(state);
    }

    fn save(&self, state: &mut State) {
        self.inner.save(state);
    }

    fn is_dense(&self) -> bool {
        self.inner.is_dense()
    }

    /// By a shorter step of another one of its kind, where it is not dense.
    fn interpolate(
        &mut self,
        problem: &mut (dyn Problem + 'static),
        from: &State,
        time: Time,
        inside: &mut State,
    ) {
        if self.inner.is_dense() {
            return self.inner.interpolate(problem, from, time, inside);
        }
        let make = &self.make;
        let spare = self.spare.get_or_insert_with(|| make());
        shortened(&mut **spare, problem, from, time, inside);
    }

    fn reset(&mut self, state: &mut State) {
        self.inner.reset(state);
    }

    fn land(
        &mut self,
        problem: &mut (dyn Problem + 'static),
        from: &State,
        time: Time,
        inside: &mut State,
    ) -> bool {
        self.inner.land(problem, from, time, inside)
    }

    fn internal_state(&self) -> Vec<f64> {
        self.inner.internal_state()
    }

    fn restore_internal_state(&mut self, known: &[f64]) -> bool {
        self.inner.restore_internal_state(known)
    }
}

impl fmt::Debug for Custom {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_tuple("Custom").field(&self.name).finish()
    }
}

impl PartialEq for Custom {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.make, &other.make)
    }
}
