//! The inside of accepted steps, for what watches a run: events, observers, trajectories.

use super::event::EventDetector;
use super::extremes::ExtremesDetector;
use super::sample::Sample;
use crate::dynamics::{Motion, MotionPowers, Time};
use std::cell::RefCell;
use std::ops::ControlFlow;

/// An accepted step and the motion inside it.
pub(super) trait Inside {
    /// Its beginning and its end.
    fn span(&self) -> (Time, Time);

    /// The motion at a time inside it; times outside count as the nearer end.
    fn at(&mut self, time: Time) -> &Motion;

    /// The same to nearly its accuracy, where that is cheaper.
    fn roughly_at(&mut self, time: Time) -> &Motion;

    /// The same to a lower order, where [`at`](Inside::at) is dear: it makes a shorter step.
    fn coarsely_at(&mut self, _time: Time) -> Option<&Motion> {
        None
    }

    /// The same to the accuracy of the end of a step, where [`at`](Inside::at) is less accurate than that.
    fn landed(&mut self, _time: Time) -> Option<&Motion> {
        None
    }

    /// Writes the powers of the motion about the beginning, where the method has them.
    fn powers(&self, _powers: &mut MotionPowers) -> bool {
        false
    }
}

/// Shown every accepted step; may cut it short.
pub(super) trait StepWatcher {
    /// The time the step is to end at, where that is earlier: what watches has something to do there.
    fn step(&mut self, inside: &mut dyn Inside) -> Option<Time>;
}

/// An accepted step, as an [`Observer`] sees it.
pub struct Step<'a>(&'a mut dyn Inside);

impl Step<'_> {
    /// Its beginning \[s\].
    pub fn begin(&self) -> f64 {
        self.0.span().0.hi
    }

    /// Its end \[s\].
    pub fn end(&self) -> f64 {
        self.0.span().1.hi
    }

    /// The motion at a time inside it \[s\], by the method's dense output, or a shorter step of fixed-step
    /// methods and `ode_solvers`.  Times outside count as the nearer end, NaN as the beginning.
    pub fn at(&mut self, time: f64) -> &Motion {
        let time = if time.is_nan() { self.begin() } else { time };
        self.0.at(Time::from(time))
    }

    /// Its beginning, and its length \[s\].
    pub(super) fn span(&self) -> (Time, f64) {
        let (begin, end) = self.0.span();
        (begin, (end - begin).hi)
    }

    /// Its beginning and its end with the digits beyond a double.
    pub(super) fn ends(&self) -> (Time, Time) {
        self.0.span()
    }

    /// The motion at a time with the digits beyond a double: in doubles the time of a short step late in a
    /// run has lost so many that the motion at it is no polynomial.
    pub(super) fn at_time(&mut self, time: Time) -> &Motion {
        self.0.at(time)
    }

    /// Writes the powers of the motion about its beginning, where the method has them.
    pub(super) fn powers(&self, powers: &mut MotionPowers) -> bool {
        self.0.powers(powers)
    }
}

/// Sees a run from outside, and may end it; what it was up to there is kept.
///
/// Closures that take a [`Sample`] are observers.
///
/// ```
/// use driftless::{Sample, Simulation, read_scene};
/// use std::ops::ControlFlow;
///
/// # fn main() -> Result<(), driftless::Error> {
/// let scene = read_scene("examples/scenes/free.json".as_ref(), &[])?;
/// let mut fastest = 0.0;
/// let mut observer = |sample: &Sample| {
///     fastest = sample.omega.iter().fold(fastest, |most: f64, omega| most.max(omega.abs()));
///     if fastest > 10.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
/// };
/// let outcome = Simulation::new(&scene)?.run_observed(&mut observer)?;
/// assert!(fastest > 10.0 && outcome.last.t < scene.until);
/// assert_eq!(outcome.ended_by.as_deref(), Some("observer"));
/// # Ok(())
/// # }
/// ```
pub trait Observer {
    /// Shown every accepted step.  A run asks only those observers that [want](Observer::wants_steps) it.
    fn step(&mut self, _step: &mut Step) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Shown the sample of every output time.
    fn sample(&mut self, _sample: &Sample) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Whether it is to be shown steps.
    fn wants_steps(&self) -> bool {
        true
    }
}

impl<F: FnMut(&Sample) -> ControlFlow<()>> Observer for F {
    fn sample(&mut self, sample: &Sample) -> ControlFlow<()> {
        self(sample)
    }

    fn wants_steps(&self) -> bool {
        false
    }
}

/// An observer as a watcher of steps.
pub(super) struct ObserverAdapter<'a, 'b> {
    pub observer: &'a mut (dyn Observer + 'b),
    /// True once it wanted to stop.
    pub has_enough: bool,
}

impl StepWatcher for ObserverAdapter<'_, '_> {
    fn step(&mut self, inside: &mut dyn Inside) -> Option<Time> {
        let end = inside.span().1;
        self.has_enough |= self.observer.step(&mut Step(inside)).is_break();
        self.has_enough.then_some(end)
    }
}

/// The events of a run, the extremes of its outputs and an observer, one after the other.
pub(super) struct Watchers<'a, 'b, 'c> {
    pub events: Option<&'a mut EventDetector>,
    pub extremes: Option<&'a mut ExtremesDetector>,
    pub observer: Option<&'a mut ObserverAdapter<'b, 'c>>,
}

impl Watchers<'_, '_, '_> {
    /// True where anybody looks at steps.
    pub fn is_asked(&self) -> bool {
        self.events.is_some()
            || self.extremes.is_some()
            || self.observer.as_ref().is_some_and(|watching| watching.observer.wants_steps())
    }
}

impl StepWatcher for Watchers<'_, '_, '_> {
    fn step(&mut self, inside: &mut dyn Inside) -> Option<Time> {
        let cut = self.events.as_mut().and_then(|events| events.step(inside));
        let cut = match (&mut self.extremes, cut) {
            (Some(extremes), Some(end)) => extremes.step(&mut Shortened { inside, end }).or(cut),
            (Some(extremes), None) => extremes.step(inside),
            (None, cut) => cut,
        };
        let Some(observer) = self.observer.as_mut().filter(|watching| watching.observer.wants_steps()) else {
            return cut;
        };
        match cut {
            Some(end) => observer.step(&mut Shortened { inside, end }).or(cut),
            None => observer.step(inside),
        }
    }
}

/// A step up to an earlier end.
struct Shortened<'a> {
    inside: &'a mut dyn Inside,
    end: Time,
}

impl Inside for Shortened<'_> {
    fn span(&self) -> (Time, Time) {
        (self.inside.span().0, self.end)
    }

    fn at(&mut self, time: Time) -> &Motion {
        self.inside.at(if time > self.end { self.end } else { time })
    }

    fn roughly_at(&mut self, time: Time) -> &Motion {
        self.inside.roughly_at(if time > self.end { self.end } else { time })
    }

    fn powers(&self, powers: &mut MotionPowers) -> bool {
        self.inside.powers(powers)
    }
}

/// The steps of an observer, who is lent out for samples as well.
pub(super) struct StepsOf<'a, 'b>(pub &'a RefCell<&'b mut dyn Observer>);

impl Observer for StepsOf<'_, '_> {
    fn step(&mut self, step: &mut Step) -> ControlFlow<()> {
        self.0.borrow_mut().step(step)
    }
}
