//! The loop over steps: a problem, its method and its state, from one output time to the next.
//!
//! A step is made, springs and walls are checked, flips are looked for, and monitors are shown the motion.
//! [`contact`](super::contact) takes a driver through impacts, [`running`](super::running) to output times.

mod inside;
pub(super) mod limit;

use self::limit::{Limited, StepLimit};
use super::flip::{self, FlipDetector};
use super::monitor::Monitor;
use super::observer::StepWatcher;
use super::spring_guard::SpringGuard;
use super::wall_guard::WallGuard;
use crate::arithmetic::Scalar;
use crate::dynamics::{BodyAngles, Form, Motion, State, Time};
use crate::stepping::{Cause, Integrator, Statistics, StepError, interruption};

/// Turns that a state may have at most: all that doubles count.
pub(super) const MOST_TURNS: u64 = 1 << 53;

/// Why a run ends at more turns than [`MOST_TURNS`], and what to do about it.
pub(super) const TOO_OFTEN: [&str; 2] = [
    "a body has turned more often than doubles can count",
    "look for rates far out of proportion, or shorten the horizon",
];

/// The stop of a method, with its cause where a number is not finite at angles that doubles do not count.
fn turned_too_often(stop: StepError, state: &State) -> StepError {
    let is_counted = state.turns.iter().all(|turns| turns.unsigned_abs() <= MOST_TURNS);
    if stop.cause != Cause::NotFinite || is_counted {
        return stop;
    }
    let [what, hint] = TOO_OFTEN.map(str::to_owned);
    StepError { what, hint, ..stop }
}

/// Where a driver halts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Halt {
    /// At the output time asked for.
    Until,
    /// At a contact's event, just before it takes effect.
    Contact(usize),
    /// Where what watches its steps has cut one short.
    Cut,
    /// At the end of a step, since a pause was asked for.
    Pause,
}

/// What looks at a driver's steps.
#[derive(Default)]
pub(super) struct StepWatch<'a> {
    /// Looks for bars that turn over.
    pub flips: Option<&'a mut FlipDetector>,
    /// Is shown the motion when it is due.
    pub monitor: Option<&'a mut dyn Monitor>,
    /// Is shown every step, and may cut it short.
    pub steps: Option<&'a mut dyn StepWatcher>,
}

/// A problem, its method and its state.
pub(super) trait Driver: Send {
    /// To the output time `until`, on the way to `horizon`; what is read then is the motion there.  Pauses
    /// after a step where `pause` is true.  What happens at the double of `until` comes before it.
    fn advance(
        &mut self,
        until: Time,
        horizon: Time,
        watch: StepWatch,
        pause: &mut Pause,
    ) -> Result<Halt, StepError>;
    fn read(&mut self, motion: &mut Motion);
    /// Goes on from another motion: of what the method remembers with the step alone.
    fn jump(&mut self, motion: &Motion);
    fn statistics(&self) -> Statistics;
    /// Bounds the evaluations.
    fn allow(&mut self, max_evaluations: u64);
    /// What the method carries from step to step.
    fn memory(&self) -> &[f64];
    /// Makes the method choose its step anew.
    fn forget(&mut self);
    /// Goes on counting, and with the steps, where another left off.
    fn follow(&mut self, other: &dyn Driver);
    /// Counts this gap, over the length of its contact, as zero where it looks for walls that were passed.
    fn guard(&mut self, closed: f64);
    /// Everything it needs to go on.
    fn place(&self) -> DriverState;
    /// Goes on from a place, which was reached on the way to `horizon`; false where it cannot be one of this
    /// problem and method.
    fn resume(&mut self, place: DriverState, horizon: Time) -> Result<bool, StepError>;
}

/// Asked after every step and every row whether the run shall pause.
pub type Pause<'a> = dyn FnMut() -> bool + 'a;

/// Where a driver is, with all that its next step depends on.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct DriverState {
    pub(super) state: State,
    statistics: Statistics,
    /// Where a dense method began its last step; without unknowns where it made none.
    pub(super) from: State,
    ahead: Option<usize>,
    /// True where it was cut short.
    is_cut: bool,
    /// False where the state is not the end of that step.
    goes_on: bool,
    /// What the method knows beside.
    known: Vec<f64>,
    /// How long its steps may be.
    limit: StepLimit,
}

struct StepLoop<P: ?Sized, M> {
    problem: Box<P>,
    method: M,
    state: State,
    statistics: Statistics,
    /// Where the last step began.
    from: State,
    /// The motion at an output time inside that step, while it is the one to be read.
    inside: State,
    is_inside: bool,
    /// The motion last shown to a monitor, kept for its room.
    observed: Motion,
    /// The event the last step ended with, where output times came first.
    ahead: Option<usize>,
    /// True where it was cut short, and nobody has been told.
    is_cut: bool,
    /// True where the state is the end of the method's last step, so that it goes on from there.
    goes_on: bool,
    /// True where output times are read off steps as long as the method likes; the steps of others end on
    /// them.
    is_dense: bool,
    /// Watches the walls, where there are any.
    guard: Option<WallGuard>,
    /// Watches the springs, where any can lose its length.
    springs: Option<SpringGuard>,
    /// Limits the steps, where formulas ask for it.
    limited: Option<Limited>,
}

impl<P: Form + Send + ?Sized, M: Integrator<P> + Send> Driver for StepLoop<P, M> {
    fn advance(
        &mut self,
        until: Time,
        horizon: Time,
        watch: StepWatch,
        pause: &mut Pause,
    ) -> Result<Halt, StepError> {
        let StepWatch { flips, mut monitor, mut steps } = watch;
        let mut flips = flips.filter(|flips| flips.flip.is_none());
        let (is_dense, target) = (self.is_dense, if self.is_dense { horizon } else { until });
        let is_there = |own: &Self| match is_dense {
            true if own.is_cut || own.ahead.is_some() => own.state.time.hi > until.hi,
            true => own.state.time >= until,
            false => own.method.is_at(&own.state, until),
        };
        let mut idle = 0;
        self.is_inside = false;
        self.begin(target, flips.as_deref_mut())?;
        while !is_there(self) {
            if self.is_cut {
                return Ok(self.tell_cut());
            }
            if let Some(event) = self.ahead.take() {
                return Ok(Halt::Contact(event));
            }
            self.method.save(&mut self.state);
            self.from.clone_from(&self.state);
            let mut event = self.make_step(target).map_err(|stop| turned_too_often(stop, &self.state))?;
            if event.is_none() && self.state.time <= self.from.time {
                // Interrupted: nothing was done.
                if pause() {
                    return Ok(Halt::Pause);
                }
                idle += 1;
                interruption::check(Integrator::<P>::name(&self.method), self.state.time.hi, idle)?;
                continue;
            }
            self.check_springs()?;
            self.check_walls()?;
            if let Some(steps) = &mut steps
                && self.is_cut_by(*steps)
            {
                event = None;
            }
            if let Some(flips) = &mut flips {
                self.look_for_flips(flips);
            }
            if let Some(monitor) = &mut monitor {
                self.show(*monitor);
            }
            if let Some(event) = event
                && self.state.time.hi <= until.hi
            {
                return Ok(Halt::Contact(event));
            }
            self.ahead = event;
            if self.is_cut && self.state.time.hi <= until.hi {
                return Ok(self.tell_cut());
            }
            if pause() && self.state.time < until {
                return Ok(Halt::Pause);
            }
        }
        if self.state.time.hi > until.hi && is_dense {
            self.method.interpolate(&mut self.problem, &self.from, until, &mut self.inside);
            self.is_inside = true;
        }
        Ok(Halt::Until)
    }

    fn read(&mut self, motion: &mut Motion) {
        self.problem.read(if self.is_inside { &self.inside } else { &self.state }, motion);
    }

    fn jump(&mut self, motion: &Motion) {
        let memory = std::mem::take(&mut self.state.memory);
        self.state = State { memory, ..self.problem.state(motion) };
        self.method.reset(&mut self.state);
        self.goes_on = false;
    }

    fn statistics(&self) -> Statistics {
        self.statistics
    }

    fn allow(&mut self, max_evaluations: u64) {
        self.statistics.max_evaluations = max_evaluations;
    }

    fn memory(&self) -> &[f64] {
        &self.state.memory
    }

    fn forget(&mut self) {
        self.state.memory.clear();
        self.goes_on = false;
    }

    fn follow(&mut self, other: &dyn Driver) {
        self.statistics = other.statistics();
        self.state.memory = other.memory().to_vec();
        self.method.reset(&mut self.state);
        self.goes_on = false;
    }

    fn guard(&mut self, closed: f64) {
        self.guard = (!self.problem.mechanism().contacts.is_empty()).then(|| WallGuard::new(closed));
    }

    fn place(&self) -> DriverState {
        let mut state = self.state.clone();
        self.method.save(&mut state);
        DriverState {
            state,
            statistics: self.statistics,
            from: self.from.clone(),
            ahead: self.ahead,
            is_cut: self.is_cut,
            goes_on: self.goes_on,
            known: self.method.internal_state(),
            limit: self.limited.as_ref().map(|limited| limited.limit).unwrap_or_default(),
        }
    }

    fn resume(&mut self, place: DriverState, horizon: Time) -> Result<bool, StepError> {
        let shape = |state: &State| (state.y.len(), state.low.len(), state.turns.len(), state.is_winding);
        let alike = |state: &State| {
            shape(state) == shape(&self.state)
                && state.turns.iter().all(|turns| turns.unsigned_abs() < MOST_TURNS)
        };
        let steps_back =
            self.is_dense && place.goes_on && !place.from.y.is_empty() && place.from.time < place.state.time;
        let counts = [place.statistics.steps, place.statistics.evaluations, place.statistics.rejected];
        if counts.iter().any(|&count| count >= MOST_TURNS)
            || !alike(&place.state)
            || (steps_back && !alike(&place.from))
            || place.ahead.is_some_and(|event| event >= self.problem.mechanism().contacts.len())
        {
            return Ok(false);
        }
        if steps_back {
            // What the method knows of the inside of its last step it finds again by repeating it.
            let mut state = place.from.clone();
            self.method.begin(&mut self.problem, &mut state, horizon)?;
            let until = place.limit.until.unwrap_or(horizon);
            self.method.step(&mut self.problem, &mut state, until, &mut Statistics::default())?;
        }
        (self.state, self.statistics, self.from) = (place.state, place.statistics, place.from);
        (self.ahead, self.goes_on, self.is_cut) = (place.ahead, steps_back, place.is_cut);
        if let Some(limited) = &mut self.limited {
            limited.limit = place.limit;
        }
        Ok(self.method.restore_internal_state(&place.known))
    }
}

impl<P: Form + Send + ?Sized, M: Integrator<P> + Send> StepLoop<P, M> {
    /// The motion at a time in the last step, as a method writes it.
    fn observe(&mut self, time: Time, write: fn(&mut M, &mut P, &State, Time, &mut State)) -> &Motion {
        let Self { problem, method, state, from, inside, observed, .. } = self;
        if time >= state.time {
            problem.read(state, observed);
        } else if time <= from.time {
            problem.read(from, observed);
        } else {
            write(method, problem, from, time, inside);
            problem.read(inside, observed);
        }
        observed
    }

    /// Makes everything ready for a step from the present state.
    fn begin(&mut self, target: Time, flips: Option<&mut FlipDetector>) -> Result<(), StepError> {
        let Self { problem, method, state, guard, springs, .. } = self;
        if !std::mem::replace(&mut self.goes_on, self.is_dense) {
            method.begin(problem, state, target)?;
        }
        if let Some(flips) = flips {
            flips.begin(&mut **problem, state);
        }
        if let Some(springs) = springs {
            problem.body_angles(state, &mut springs.before);
        }
        if let Some(guard) = guard {
            let body_angles = seen(&mut **problem, state);
            guard.begin(problem.mechanism(), state.time, &body_angles);
        }
        Ok(())
    }

    /// Halts where the last step was cut short: what follows begins a step of its own.
    fn tell_cut(&mut self) -> Halt {
        (self.is_cut, self.goes_on) = (false, false);
        Halt::Cut
    }

    /// Shows the last step, which ends earlier where the watcher wants that.
    fn is_cut_by(&mut self, watcher: &mut dyn StepWatcher) -> bool {
        let Some(time) = watcher.step(self) else { return false };
        if time < self.state.time {
            let memory = std::mem::take(&mut self.state.memory);
            let Self { problem, method, from, inside, .. } = self;
            if !method.land(problem, from, time, inside) {
                method.interpolate(problem, from, time, inside);
            }
            self.state.clone_from(&self.inside);
            self.state.time = time;
            self.state.memory = memory;
        }
        self.is_cut = true;
        true
    }

    /// Looks whether a spring has lost its length in the last step, which is then taken back.
    fn check_springs(&mut self) -> Result<(), StepError> {
        let Self { problem, method, state, springs: Some(springs), from, inside, .. } = self else {
            return Ok(());
        };
        let span = (state.time - from.time).hi;
        problem.body_angles(state, &mut springs.now);
        let mut at = |seconds: f64| {
            method.interpolate(problem, from, from.time + seconds, inside);
            seen(&mut **problem, inside)
        };
        let Some(lost) = springs.step(span, &mut at) else { return Ok(()) };
        state.clone_from(from);
        Err(lost.stop(Integrator::<P>::name(method), from.time.hi, span))
    }

    /// Looks whether the last step has passed a wall.
    fn check_walls(&mut self) -> Result<(), StepError> {
        let Self { problem, method, state, guard: Some(guard), from, inside, .. } = self else {
            return Ok(());
        };
        let (name, body_angles) = (Integrator::<P>::name(method), seen(&mut **problem, state));
        let candidate =
            guard.step(problem.mechanism(), state.time, &body_angles).map_err(|passed| passed.stop(name))?;
        let Some(contact) = candidate.filter(|_| self.is_dense) else { return Ok(()) };
        let (span, mechanism) = (state.time - from.time, problem.mechanism().clone());
        let mut at = |share: f64| {
            method.interpolate(problem, from, from.time + span.scale(share), inside);
            (inside.time, seen(&mut **problem, inside))
        };
        guard.search(&mechanism, contact, &mut at).map_err(|passed| passed.stop(name))
    }

    /// Looks for the first bar that turns over in the last step.
    fn look_for_flips(&mut self, flips: &mut FlipDetector) {
        let span = (self.state.time - self.from.time).hi;
        let Some(ends) = flips.step(&mut *self.problem, &self.state, span) else { return };
        let start = self.from.time.hi;
        let Self { problem, method, from, inside, .. } = self;
        let found = flip::search(start, span, &ends, &mut |seconds| {
            method.interpolate(problem, from, from.time + seconds, inside);
            let mut body_angles = BodyAngles::default();
            flip::look(&mut **problem, inside, &mut body_angles);
            body_angles
        });
        flips.conclude(start + span, &ends, found);
    }
}

/// The loop for a problem in some form and a method, from a motion on.
pub(super) fn driver<P: Form + Send + ?Sized + 'static, M: Integrator<P> + Send + 'static>(
    problem: Box<P>,
    method: M,
    start: &Motion,
) -> Box<dyn Driver> {
    let (state, is_dense) = (problem.state(start), method.is_dense());
    let (springs, idle) = (SpringGuard::new(problem.mechanism()), State::default);
    let limited = Limited::of(problem.mechanism()).filter(|_| is_dense);
    Box::new(StepLoop {
        problem,
        method,
        state,
        statistics: Statistics::default(),
        from: idle(),
        inside: idle(),
        is_inside: false,
        observed: Motion::default(),
        ahead: None,
        is_cut: false,
        goes_on: false,
        is_dense,
        guard: None,
        springs,
        limited,
    })
}

/// What there is to see of a state.
fn seen<P: Form + ?Sized>(problem: &mut P, state: &State) -> BodyAngles {
    let mut body_angles = BodyAngles::default();
    problem.body_angles(state, &mut body_angles);
    body_angles
}
