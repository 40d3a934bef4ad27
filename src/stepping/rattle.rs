//! RATTLE, order 2, and its symmetric compositions of order 4, 6 and 8; fixed step.
//!
//! Keeps: every constraint at position and velocity level to rounding; symplectic and time-symmetric, so
//! energy (with motors: energy less work) oscillates with an amplitude of the method's order and has no
//! drift.  Choose it for long horizons of constrained or driven scenes where a cheap step counts; for few
//! bodies and the last digits Gauss and Taylor are better.  Asks for the [`Natural`] form: forces that depend
//! on positions only.
//!
//! ```text
//! v½ = v0 + h/2 W (F(z0) - g(z0,t0) mu),     z1 = z0 + h v½,     C(z1, t1) = 0             gives mu
//! v1 = v½ + h/2 W (F(z1) - g(z1,t1) mu'),    g(z1,t1)·v1 + C_t(z1,t1) = 0                  gives mu'
//! p_t -= h/2 (mu·C_t(z0,t0) + mu'·C_t(z1,t1))                                              driven scenes
//! ```
//!
//! W has the linear rows in it, and both levels are put back onto them at the beginning of every substep:
//! what rounding leaves of them is never seen by the other rows, and pins would drift in time.  Mechanisms
//! pass singular positions as long as the step lands far enough from them (module `newton`); where a row
//! cannot be kept to 1e-10, the method stops and names it.
//!
//! Source: H. C. Andersen, *Rattle: a "velocity" version of the Shake algorithm*, J. Comput. Phys. 52 (1983);
//! B. Leimkuhler, R. D. Skeel, *Symplectic numerical integrators in constrained Hamiltonian systems*, J.
//! Comput. Phys. 112 (1994), for its symplecticity; E. Hairer, C. Lubich, G. Wanner, *Geometric Numerical
//! Integration*, 2nd ed. (2006), section VII.1.4.  p_t makes time a coordinate, so that a driven scene is one
//! without drive. Compositions: [`composition`](super::composition).
//!
//! Rounding: positions, velocities, p_t and time are pairs, and the last Newton iteration forms C(z1, t1)
//! from them.  What is left is the rounding of h W F, 1e-16 of a *kick*, not of the state.

mod newton;
mod substep;

use self::substep::{SubstepFailure, SubstepScratch};
use super::composition::Composition;
use super::{Cause, Integrator, Statistics, StepError};
use crate::arithmetic::Scalar;
use crate::arithmetic::shown::estimate;
use crate::dynamics::natural::Natural;
use crate::dynamics::{State, Time};

/// Part of a step that a remaining time may differ from whole steps.
const WHOLE: f64 = 1e-9;

/// The method: a composition and its step.
#[derive(Clone, Debug)]
pub struct Rattle {
    composition: Composition,
    step: f64,
    substeps: Vec<f64>,
    /// Time from the start of the step to the end of each substep \[s\].
    ends: Vec<Time>,
    work: SubstepScratch,
    /// Makes shorter steps, once one is asked for.
    spare: Option<Box<Rattle>>,
    /// True where the state was changed since the last step.
    is_stale: bool,
}

impl Rattle {
    /// RATTLE with a fixed step \[s\], finite and not zero; a negative step runs back in time.
    pub fn new(composition: Composition, step: f64) -> Self {
        let substeps = composition.substeps(step);
        let end = |sum: &mut Time, substep: &f64| {
            *sum += Time::of(*substep);
            Some(*sum)
        };
        let mut ends: Vec<Time> = substeps.iter().scan(Time::default(), end).collect();
        // Where a step ends the next begins, to the last bit.
        if let Some(last) = ends.last_mut() {
            *last = Time::of(step);
        }
        Self {
            composition,
            step,
            substeps,
            ends,
            work: SubstepScratch::default(),
            spare: None,
            is_stale: false,
        }
    }
}

/// Calls a method for the numbers of bodies compiled in, and whether there are guides or translational
/// coordinates: `by_bodies!(problem, state, receiver.method(arguments))`.
macro_rules! by_bodies {
    ($problem:expr, $state:expr, $object:ident $(. $part:ident)+ ($($argument:expr),*)) => {{
        let turns = $state.turns.len();
        let (is_plain, bodies) = ($problem.guides().is_empty() && $problem.elements() == turns,
            if $problem.elements() == turns { turns } else { 0 });
        match (bodies, is_plain) {
            (1, true) => $object $(. $part)+::<1, false>($($argument),*),
            (2, true) => $object $(. $part)+::<2, false>($($argument),*),
            (3, true) => $object $(. $part)+::<3, false>($($argument),*),
            (4, true) => $object $(. $part)+::<4, false>($($argument),*),
            (_, true) => $object $(. $part)+::<0, false>($($argument),*),
            (2, false) => $object $(. $part)+::<2, true>($($argument),*),
            (_, false) => $object $(. $part)+::<0, true>($($argument),*),
        }
    }};
}

impl Integrator<Natural> for Rattle {
    fn name(&self) -> &'static str {
        match self.composition {
            Composition::Single => "rattle2",
            Composition::Suzuki5 => "rattle4",
            Composition::KahanLi9 => "rattle6",
            Composition::KahanLi17 => "rattle8",
        }
    }

    fn order(&self) -> u32 {
        self.composition.order()
    }

    fn begin(&mut self, problem: &mut Natural, state: &mut State, _until: Time) -> Result<(), StepError> {
        if self.step == 0.0 || !self.step.is_finite() {
            return Err(self.refuse(state.time.hi));
        }
        self.work.resize(problem);
        by_bodies!(problem, state, self.work.load(problem, state));
        self.is_stale = false;
        Ok(())
    }

    fn step(
        &mut self,
        problem: &mut Natural,
        state: &mut State,
        until: Time,
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError> {
        match self.rest(state, until) {
            Some(rest) => self.shorter_step(problem, state, (until, rest), statistics),
            None => self.whole_step(problem, state, statistics),
        }
    }

    fn is_at(&self, state: &State, until: Time) -> bool {
        self.left(state, until) <= self.least(until)
    }

    fn changed(&mut self, state: &mut State) {
        state.memory.clear();
        self.is_stale = true;
    }

    /// By a shorter step, which keeps the constraints as well.
    fn interpolate(&mut self, problem: &mut Natural, from: &State, time: Time, inside: &mut State) {
        let work = self.spare.take().map(|spare| spare.work).unwrap_or_default();
        let mut spare = Self { work, ..Self::new(self.composition, (time - from.time).hi) };
        super::shortened(&mut spare, problem, from, time, inside);
        self.spare = Some(Box::new(spare));
    }
}

impl Rattle {
    /// How far it is to `until` in the direction of the steps \[s\].
    fn left(&self, state: &State, until: Time) -> f64 {
        (until - state.time).hi * self.step.signum()
    }

    /// What is no distance on the way to `until` \[s\].
    fn least(&self, until: Time) -> f64 {
        WHOLE * self.step.abs() + 4.0 * f64::EPSILON * until.hi.abs()
    }

    /// What is left of the way to `until` \[s\] where that is less than a step, as where an event has cut one
    /// short.
    fn rest(&self, state: &State, until: Time) -> Option<f64> {
        let left = self.left(state, until);
        (left < self.step.abs() - self.least(until)).then(|| left.copysign(self.step))
    }

    /// One step of what is left, which ends at `until`.
    fn shorter_step(
        &mut self,
        problem: &mut Natural,
        state: &mut State,
        (until, rest): (Time, f64),
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError> {
        let mut shorter = Self::new(self.composition, rest);
        std::mem::swap(&mut shorter.work, &mut self.work);
        shorter.is_stale = std::mem::take(&mut self.is_stale);
        let made = shorter.whole_step(problem, state, statistics);
        std::mem::swap(&mut shorter.work, &mut self.work);
        self.is_stale = shorter.is_stale;
        state.time = until;
        made
    }

    fn whole_step(
        &mut self,
        problem: &mut Natural,
        state: &mut State,
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError> {
        statistics.check(Integrator::name(self), state.time.hi, self.step)?;
        if std::mem::take(&mut self.is_stale) {
            by_bodies!(problem, state, self.work.load(problem, state));
        }
        by_bodies!(problem, state, self.substeps(problem, state, statistics))?;
        state.time += Time::of(self.step);
        self.work.store(state);
        statistics.steps += 1;
        Ok(None)
    }

    /// All substeps of a step, for `N` bodies (any number where `N` is 0), with guides or translational
    /// coordinates where `GUIDED`.
    fn substeps<const N: usize, const GUIDED: bool>(
        &mut self,
        natural: &Natural,
        state: &State,
        statistics: &mut Statistics,
    ) -> Result<(), StepError> {
        for (&h, &end) in self.substeps.iter().zip(&self.ends) {
            if let Err(failure) = self.work.substep::<N, GUIDED>(natural, h, state.time + end) {
                return Err(self.explain(natural, state.time.hi, failure));
            }
            statistics.evaluations += 1;
        }
        Ok(())
    }

    fn refuse(&self, t: f64) -> StepError {
        StepError {
            cause: Cause::StepTooSmall,
            method: self.name().into(),
            t,
            step: self.step,
            what: "the step is zero or not finite".into(),
            hint: "give a step in seconds, such as 0.01".into(),
        }
    }

    fn explain(&self, natural: &Natural, t: f64, failure: SubstepFailure) -> StepError {
        let (cause, what) = match failure {
            SubstepFailure::NotFinite(element) => {
                (Cause::NotFinite, format!("the force on {} is not finite", natural.element_name(element)))
            }
            SubstepFailure::NotConverged(row) => {
                (Cause::NotConverged, format!("no multiplier found that keeps the {}", natural.row_name(row)))
            }
            SubstepFailure::TooFar(row) => (
                Cause::NotConverged,
                format!("a quarter turn or more in one substep of the {}", natural.row_name(row)),
            ),
        };
        let hint = match cause {
            Cause::NotFinite => "check springs that can shrink to length zero".into(),
            _ => format!("try a step of {} s", estimate(0.25 * self.step)),
        };
        StepError { cause, method: self.name().into(), t, step: self.step, what, hint }
    }
}
