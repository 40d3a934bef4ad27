//! Methods: how a state is integrated from one time to another.
//!
//! A method is configuration and scratch space; the [`State`] belongs to the caller and holds everything a
//! restart needs.  The problem is a type parameter: Dormand–Prince, Radau and Gauss are `Integrator<F:
//! OdeSystem>`, RATTLE is `Integrator<Natural>`, so a wrong pairing does not compile.

#[doc(hidden)]
pub mod composition;
#[doc(hidden)]
pub mod dp5;
#[doc(hidden)]
pub mod dp8;
mod event;
#[doc(hidden)]
pub mod explicit;
#[doc(hidden)]
pub mod gauss;
#[doc(hidden)]
pub mod interruption;
mod linear;
#[doc(hidden)]
pub mod radau;
#[doc(hidden)]
pub mod rattle;
pub(crate) mod search;
mod stops;
#[doc(hidden)]
pub mod taylor;
#[doc(hidden)]
pub mod windows;

pub use dp5::Dp5;
pub use dp8::Dp8;
pub use explicit::Tolerance;
pub use radau::Radau;
use stops::at_rest;
pub(crate) use stops::without_length;
pub use taylor::Taylor;
pub use windows::{Dop853, Dopri5};

use crate::arithmetic::shown::{figure, tried};
use crate::dynamics::{MotionPowers, OdeSystem, State, Time};

/// Counts of one run, and the effort it is allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Statistics {
    /// Accepted steps.
    pub steps: u64,
    /// Evaluations of the equations; a series is expanded at the price of one.
    pub evaluations: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Evaluations of the Jacobian, by the methods that ask for it.
    pub jacobians: u64,
    /// Steps whose stages were found by Newton's method, of the methods that usually sweep.
    pub newton_steps: u64,
    /// Evaluations allowed: no step begins after so many.
    pub max_evaluations: u64,
}

impl Default for Statistics {
    /// Nothing done, and no bound on what may be.
    fn default() -> Self {
        Self {
            steps: 0,
            evaluations: 0,
            rejected: 0,
            jacobians: 0,
            newton_steps: 0,
            max_evaluations: u64::MAX,
        }
    }
}

impl Statistics {
    /// Whether another step may be tried, from `t` on and of `step` \[s\].
    ///
    /// # Errors
    /// The effort allowed is used up.
    #[inline]
    pub fn check(&self, method: &str, t: f64, step: f64) -> Result<(), StepError> {
        if self.evaluations < self.max_evaluations { Ok(()) } else { Err(self.exhausted(method, t, step)) }
    }

    #[cold]
    fn exhausted(&self, method: &str, t: f64, step: f64) -> StepError {
        StepError {
            cause: Cause::EffortExhausted,
            method: method.into(),
            t,
            step,
            what: format!("the maximum of {} evaluations is used up", self.max_evaluations),
            hint: "loosen the tolerance or lengthen the step, shorten the horizon, or allow more with \
                --max-evaluations (of `resume` too)"
                .into(),
        }
    }
}

/// Where [`Integrator::advance`] stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reached {
    /// At the time asked for.
    Until,
    /// At event number i, located; the state is the one just before it takes effect.
    Event(usize),
    /// At the end of a step after which the watcher had [`Seen::Enough`].
    Pause,
}

/// What a watcher did to the state it was shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// Nothing.
    Kept,
    /// It changed the unknowns (projection): what the method knows of the rate there is stale.
    Changed,
    /// Nothing, and it is enough for now: the method stops here, with all it needs to go on in the state's
    /// memory.
    Enough,
    /// It changed the unknowns, and that is enough for now.
    ChangedEnough,
}

impl Seen {
    /// True where the unknowns are no longer the method's own.
    pub fn is_changed(self) -> bool {
        matches!(self, Self::Changed | Self::ChangedEnough)
    }

    /// True where the method is to stop.
    pub fn is_enough(self) -> bool {
        matches!(self, Self::Enough | Self::ChangedEnough)
    }
}

/// Shown the state after every accepted step; may change it, or stop the run.
pub type Watch<'a, P> = dyn FnMut(&mut P, &mut State) -> Result<Seen, StepError> + 'a;

/// Integrates a problem `P`, one accepted step after the other.
///
/// The contract: [`begin`](Integrator::begin) takes up a state, [`step`](Integrator::step) makes one accepted
/// step from it, [`interpolate`](Integrator::interpolate) is the solution inside that step, and
/// [`save`](Integrator::save) leaves in the state what `begin` needs to go on to the same bits.  A method has
/// no loop of its own over steps: that is [`advance`](Integrator::advance), or the caller's.
pub trait Integrator<P: ?Sized> {
    /// Name in reports: which code made a result.
    fn name(&self) -> &'static str;

    /// Order of the error of one run in the step.
    fn order(&self) -> u32;

    /// Takes up a state, on the way to `until` \[s\]: what was remembered of the steps before is in its
    /// memory.  Called before the first step, and wherever the state is not the end of the step made last.
    ///
    /// # Errors
    /// The method cannot integrate this problem, or not in this direction.
    fn begin(&mut self, problem: &mut P, state: &mut State, until: Time) -> Result<(), StepError>;

    /// Makes one accepted step from the state taken up, or from the end of the last one, and not beyond
    /// `until` \[s\], which lies ahead; the number of the event located at its end, if there is one.  The
    /// state is then the one just before that takes effect.
    ///
    /// # Errors
    /// A typed stop with time, step, culprit and suggestion; the state is unchanged.
    fn step(
        &mut self,
        problem: &mut P,
        state: &mut State,
        until: Time,
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError>;

    /// True where no step is left before `until`: adaptive methods land on it, fixed-step methods to the
    /// rounding of whole steps, or by a shorter one where an event came between.
    fn is_at(&self, state: &State, until: Time) -> bool {
        (until - state.time).hi <= 0.0
    }

    /// Called where the unknowns of the state were changed a little after a step (projection): what the
    /// method knows of the rate there is stale.
    fn changed(&mut self, _state: &mut State) {}

    /// Leaves in the state's memory all that [`begin`](Integrator::begin) needs to go on as if nothing had
    /// been between.
    fn save(&self, _state: &mut State) {}

    /// Integrates `state` to `until` \[s\], or to the first event before it: the loop over steps for all
    /// methods.
    ///
    /// The same call from the same state gives the same bits, and where a watcher had enough on the way, so
    /// does calling again from there.
    ///
    /// # Errors
    /// A typed stop; the state is then the last accepted one.
    fn advance(
        &mut self,
        problem: &mut P,
        state: &mut State,
        until: Time,
        statistics: &mut Statistics,
        watch: &mut Watch<P>,
    ) -> Result<Reached, StepError> {
        self.begin(problem, state, until)?;
        while !self.is_at(state, until) {
            let event = self.step(problem, state, until, statistics)?;
            let seen = watch(problem, state)?;
            if seen.is_changed() {
                self.changed(state);
            }
            if let Some(event) = event {
                return Ok(Reached::Event(event));
            }
            if seen.is_enough() && !self.is_at(state, until) {
                self.save(state);
                return Ok(Reached::Pause);
            }
        }
        Ok(Reached::Until)
    }

    /// True where output times are read off its steps by [`Integrator::interpolate`]; the steps of all others
    /// end on output times.
    fn is_dense(&self) -> bool {
        false
    }

    /// Writes the state at `time` \[s\] inside the last step, which began at `from`, to the accuracy of the
    /// step.
    ///
    /// Nothing of the method or of the integration changes by it.  Methods that have no polynomial of that
    /// accuracy make a shorter step from `from`.  What writes nothing, as here, is given such a step by a
    /// run, where it is not [dense](Integrator::is_dense).
    fn interpolate(&mut self, _problem: &mut P, _from: &State, _time: Time, _inside: &mut State) {}

    /// The same where a cheaper polynomial of nearly that accuracy serves, and constraints need not be kept
    /// as well as at the step's end.
    #[doc(hidden)]
    fn interpolate_roughly(&mut self, problem: &mut P, from: &State, time: Time, inside: &mut State) {
        self.interpolate(problem, from, time, inside);
    }

    /// Writes the same to a lower order, by a polynomial that costs next to nothing; false, and nothing
    /// written, where the method has none beside [`interpolate`](Integrator::interpolate).
    #[doc(hidden)]
    fn interpolate_coarsely(&mut self, _from: &State, _time: Time, _inside: &mut State) -> bool {
        false
    }

    /// Writes the same to the accuracy of the *end* of a step, by a step that ends there; false, and nothing
    /// written, where [`interpolate`](Integrator::interpolate) is as accurate, or no such step can be made.
    fn land(&mut self, _problem: &mut P, _from: &State, _time: Time, _inside: &mut State) -> bool {
        false
    }

    /// Takes back part of the last step, which began at `from`, where it ends far closer to a singular
    /// position than it began, so that it ends on the way there; false, and nothing changed, where it does
    /// not, or where the method knows none.
    #[doc(hidden)]
    fn shorten(&mut self, _problem: &mut P, _from: &State, _state: &mut State) -> bool {
        false
    }

    /// Writes the powers of the motion about the beginning of the last step; false, and nothing written,
    /// where the method has none of a hinge tree.
    #[doc(hidden)]
    fn powers(&self, _powers: &mut MotionPowers) -> bool {
        false
    }

    /// Called where the state was changed from outside at once: an impact, or a contact that begins or ends.
    /// Forgets all that depends on the motion before it: predictors, Jacobians, rates, the history of errors.
    /// Of the state's memory only the step remains, as a proposal.
    fn reset(&mut self, state: &mut State) {
        state.memory.clear();
    }

    /// What a method knows beside the state that has a say in what follows; nothing unless said otherwise.
    fn internal_state(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Takes over what another one of its kind knew at the same state; false where it can be no such thing.
    fn restore_internal_state(&mut self, known: &[f64]) -> bool {
        known.is_empty()
    }
}

/// The state at `time` \[s\], by as short a step of `method` from `from`, of which nothing but the motion is
/// known; where that fails, what it came to.
pub(crate) fn shortened<P: ?Sized, M: Integrator<P> + ?Sized>(
    method: &mut M,
    problem: &mut P,
    from: &State,
    time: Time,
    inside: &mut State,
) {
    let memory = std::mem::take(&mut inside.memory);
    inside.clone_from(from);
    inside.memory = memory;
    inside.memory.clear();
    let mut statistics = Statistics::default();
    let _ = method.begin(problem, inside, time).and_then(|()| {
        while !method.is_at(inside, time) {
            method.step(problem, inside, time, &mut statistics)?;
        }
        Ok(())
    });
}

/// Why a method stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// The rate, a stage or an error estimate came out not finite.
    NotFinite,
    /// The step fell below the resolution of time.
    StepTooSmall,
    /// The number of evaluations allowed was used up.
    EffortExhausted,
    /// An implicit step did not converge.
    NotConverged,
    /// The step is too long for a fast mode that has a part in the motion.
    Unresolved,
    /// The projection onto the constraints did not converge.
    ProjectionFailed,
    /// Energy jumped at a singular position: the motion left on another branch.
    BranchLost,
    /// A spring with a free length lost its length, and its force its direction.
    SpringWithoutLength,
    /// A law with corners drives the motion back onto a corner from both sides.
    Sliding,
    /// No motion, or more than one, fits the laws of dry friction: Painlevé's paradox.
    Friction,
    /// A point came to rest on a wall, and it could not be held there or the constraints leave it no freedom.
    RestingContact,
    /// A point was found behind a wall, or away from the wall it is held at: an impact was missed.
    WallPassed,
    /// An impact was not what the law of impact makes of the motion before it, or the first sample is not the
    /// start.
    ImpactCheckFailed,
    /// The method does not fit the mechanism.
    Unsuited,
    /// A drift limit was exceeded, stated or not.
    DriftLimit,
}

impl Cause {
    /// One word for tables, as in JSON: `not_finite`.
    pub fn word(self) -> &'static str {
        match self {
            Self::NotFinite => "not_finite",
            Self::StepTooSmall => "step_too_small",
            Self::EffortExhausted => "effort_exhausted",
            Self::NotConverged => "not_converged",
            Self::Unresolved => "unresolved",
            Self::ProjectionFailed => "projection_failed",
            Self::BranchLost => "branch_lost",
            Self::SpringWithoutLength => "spring_without_length",
            Self::Sliding => "sliding",
            Self::Friction => "friction",
            Self::RestingContact => "resting_contact",
            Self::WallPassed => "wall_passed",
            Self::ImpactCheckFailed => "impact_check_failed",
            Self::Unsuited => "unsuited",
            Self::DriftLimit => "drift_limit",
        }
    }
}

/// A typed stop.
#[derive(Clone, Debug, PartialEq, thiserror::Error, serde::Serialize, serde::Deserialize)]
#[error("{method} stopped at t = {} s{}: {what}; {hint}", figure(*t), tried(*step))]
pub struct StepError {
    /// Why.
    pub cause: Cause,
    /// The method's name.
    pub method: String,
    /// Time of the last accepted state \[s\].
    pub t: f64,
    /// The step tried \[s\].
    pub step: f64,
    /// What happened, naming the component at fault.
    pub what: String,
    /// One suggestion.
    pub hint: String,
}

/// Writes the units the unknowns of a field are measured in.
fn units<F: OdeSystem + ?Sized>(field: &F, count: usize, units: &mut Vec<f64>) {
    units.clear();
    units.extend((0..count).map(|i| field.unit(i)));
}

/// The tolerance of every unknown: what errors and changes of unknowns are divided by.
fn scales(tolerance: Tolerance, y: &[f64], units: &[f64], scale: &mut [f64]) {
    for ((scale, y), unit) in scale.iter_mut().zip(y).zip(units) {
        *scale = tolerance.absolute * unit + tolerance.relative * y.abs();
    }
}

/// The step \[s\] of a method that wants `wanted` with `left` to go, and whether it goes all the way: two
/// halves rather than a step and a sliver.
fn reach(wanted: f64, left: f64) -> (f64, bool) {
    if wanted >= left * (1.0 - 1e-12) {
        return (left, true);
    }
    (if wanted > 0.5 * left { 0.5 * left } else { wanted }, false)
}

/// Steps \[s\] below this are lost in the resolution of time, or in the first thousandth of the unit of time.
fn finest(state: &State, time_unit: f64) -> f64 {
    1e-14 * state.time.hi.abs().max(1e-3 * time_unit)
}

/// What to do about a stop where something is not finite.
pub(crate) const NOT_FINITE: &str = "look for a spring of length zero, a position without inertia, or a \
    formula without a value or a derivative here, as atan2(0, 0)";

/// The adaptive methods integrate forwards only; a time behind by no more than rounding has been reached.
fn refuse_the_past(method: &str, state: &State, until: Time, time_unit: f64) -> Result<(), StepError> {
    let left = (until - state.time).hi;
    if left >= -1e-9 * state.time.hi.abs().max(1e-3 * time_unit) {
        return Ok(());
    }
    Err(StepError {
        cause: Cause::Unsuited,
        method: method.into(),
        t: state.time.hi,
        step: left,
        what: format!("t = {} s lies behind", figure(until.hi)),
        hint: "turn the rates round and integrate forwards, or use a Gauss method".into(),
    })
}
