//! A run at its walls: impacts, points that come to rest there and stay, and their release.
//!
//! A point stays where its wall presses it and it does not move along the normal, or would rebound to less
//! than [`REST_HEIGHT`](crate::dynamics::contact::REST_HEIGHT): bounces that accumulate end so, see `rest`.
//! What is left of its normal velocity is taken off it and booked as lost in impacts.  From then on the wall
//! is a row kept by projection, until its force would have to pull.

mod impacts;
mod jumps;
mod rest;
mod several;
mod state;

pub(super) use impacts::in_modes;
pub(super) use jumps::{Jump, JumpLog, Switch};
pub(super) use rest::{Flight, come_to_rest};
pub(super) use state::ContactDriverState;

use super::build::build;
use super::driver::{Driver, Halt, Pause, StepWatch};
use super::event::{EventDetector, EventMemory};
use super::extremes::ExtremesDetector;
use super::flip::FlipDetector;
use super::impact_monitor;
use super::methods::{MethodId, Stabilization};
use super::monitor::{Monitor, lent};
use super::observer::{ObserverAdapter, StepWatcher, Watchers};
use super::plan::Plan;
use super::running::Outcome;
use super::sample::{Sample, Sampler};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::contact::REST_HEIGHT;
use crate::dynamics::{Mechanism, Motion, Time};
use crate::stepping::{Cause, Statistics, StepError};
use std::sync::Arc;

/// One impact of a run.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ImpactRecord {
    /// Time \[s\].
    pub t: f64,
    /// Name of the wall.
    pub wall: String,
    /// Impulse on the point along the wall's normal \[N·s\].
    pub impulse: f64,
    /// Impulse of friction on the point along the wall, the normal turned clockwise \[N·s\].
    pub friction_impulse: f64,
    /// Normal velocity before it \[m/s\].
    pub approach: f64,
    /// Energy lost \[J\].
    pub energy_lost: f64,
}

/// A time a point stayed on its wall.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PersistentContact {
    /// Beginning \[s\]: after bounces that accumulate, the time at which infinitely many of them have ended.
    pub t: f64,
    /// Name of the wall.
    pub wall: String,
    /// End \[s\], no earlier than the beginning; `None`: held to the end of the run.
    pub until: Option<f64>,
}

/// Impacts, and holds, kept by name; the rest are counted.
const KEPT: usize = 1000;
/// Impacts and releases between two output times beyond which a run goes nowhere; a point that is squeezed
/// between two walls meets them hundreds of times at one moment.
const EVENTS_MOST: usize = 10_000;
/// Holds between two output times beyond which a point chatters.
const HOLDS_MOST: usize = 1000;
/// Height at which a reference solution ends bounces, over that of a run: errors of what is left out grow
/// with the height or its square root, and differ by one to three times that of the run.
const SOONER: f64 = 4.0;
/// Rounds of impacts at one moment after which what is left of the approach is left to the holds.
const ROUNDS: usize = 100;
/// Normal velocity, over those of the point's parts or the hardest approach of the moment, that rounding
/// leaves where an impact took it off.
const NO_SPEED: f64 = 1e-13;

/// What is to be done where constraints leave a point at a wall no freedom.
pub(super) const DRIVEN: &str =
    "change what drives it there, as a motor, or friction that leaves it one way, or end the run before";

/// What is to be done where a method misses what a wall does.
pub(super) fn tighter(method: &str) -> &'static str {
    match method.parse() {
        Ok(MethodId::Taylor) => "tighten the tolerance",
        Ok(MethodId::Custom) | Err(_) => {
            "an integrator from outside has to locate impacts: its `step` ends where one of \
             `OdeSystem::gaps` passes zero and returns its number; or take a method of the crate"
        }
        Ok(_) => "tighten the tolerance, or use --method taylor",
    }
}

/// A contact that is held.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
struct Held {
    contact: usize,
    since: f64,
    /// Where it stands among the holds kept by name.
    kept: Option<usize>,
}

/// A driver on its way through impacts and holds.
pub(super) struct ContactDriver {
    /// The mechanism with all its parts, and those that do not act at the moment.
    pub(super) whole: Arc<Mechanism>,
    pub(super) off: Vec<String>,
    /// How much further its motors and locks go on than the scene says, by row \[rad, m\].
    pub(super) shifts: Vec<(usize, f64)>,
    /// The mechanism without holds.
    pub(super) free: Arc<Mechanism>,
    /// The mechanism with the contacts held at the moment.
    pub(super) mechanism: Arc<Mechanism>,
    pub(super) driver: Box<dyn Driver>,
    pub(super) sampler: Sampler,
    /// The motion last sampled, kept for its room.
    shown: Motion,
    held: Vec<Held>,
    /// Height of a rebound, over the length of the contact, below which a pressed point stays.
    rest_height: f64,
    /// Holds, and impacts and releases, since the last output time.
    holds_in_row: usize,
    events_in_row: usize,
    /// True where it paused on the way to an output time.
    is_between: bool,
    /// Looks for bars that turn over, where somebody asked.
    pub(super) flips: Option<FlipDetector>,
    /// Looks for events from outside, where there are any.
    pub(super) events: Option<EventDetector>,
    /// What such a detector remembered, until there is one again.
    remembered: Option<EventMemory>,
    /// Looks for the extremes of outputs, where there are any.
    pub(super) extremes: Option<ExtremesDetector>,
    /// How often an event has changed the motion, the parts that act or the branches of laws.
    pub(super) changes: u64,
    /// The event that has ended the run.
    pub(super) ended_by: Option<String>,
    /// Energy stabilizers put in before the present driver \[J\].
    pub(super) stabilizer: f64,
    /// Impacts, holds, releases and changes by events, where somebody asks.
    pub(super) jumps: Option<JumpLog>,
    /// What steps go no further than where it [pauses at impacts](Self::pause_at_impacts).
    horizon: Option<Time>,
}

impl ContactDriver {
    /// A run's beginning: whatever touches and moves into its wall is struck, and what is pressed is held.
    pub(super) fn new(mechanism: Arc<Mechanism>, driver: Box<dyn Driver>) -> Self {
        let (whole, off) = mechanism.whole.clone().unwrap_or_else(|| (Arc::clone(&mechanism), Vec::new()));
        Self {
            sampler: Sampler::new(Arc::clone(&mechanism)),
            events: EventDetector::of_scene(&whole),
            whole,
            off,
            shifts: Vec::new(),
            free: Arc::clone(&mechanism),
            mechanism,
            driver,
            extremes: None,
            changes: 0,
            remembered: None,
            ended_by: None,
            shown: Motion::default(),
            held: Vec::new(),
            rest_height: REST_HEIGHT,
            holds_in_row: 0,
            events_in_row: 0,
            is_between: false,
            flips: None,
            stabilizer: 0.0,
            jumps: None,
            horizon: None,
        }
    }

    /// The same, with bounces that end sooner: an error that leaving them out makes, another run has as well.
    pub(super) fn ends_bounces_sooner(self) -> Self {
        Self { rest_height: SOONER * REST_HEIGHT, ..self }
    }

    /// The mechanism with the contacts held at the moment.
    pub(super) fn holding(&self) -> &Arc<Mechanism> {
        &self.mechanism
    }

    /// Goes on by another plan from the motion that is read at present, with the parts that act there.
    pub(super) fn go_on_by(&mut self, plan: &mut Plan, motion: &Motion) -> Result<(), StepError> {
        if self.mechanism.constraints.len() > self.free.constraints.len() {
            plan.stabilization = Stabilization::Projection;
        }
        self.driver = build(&self.mechanism, plan, motion)?;
        if self.events.as_ref().is_some_and(|events| events.memory.pending.is_some()) {
            // The event at the end of the last step is still to come, and is found anew.
            self.events = EventDetector::of_scene(&self.whole);
            if let Some(events) = &mut self.events {
                events.watch_friction(&self.mechanism);
            }
        }
        Ok(())
    }

    /// The mechanism with all its parts and no holds.
    pub(super) fn whole(&self) -> &Arc<Mechanism> {
        &self.whole
    }

    /// True where loops or sliders have to be kept.
    pub(super) fn has_closed_loops(&self) -> bool {
        self.free.has_closed_loops()
    }

    /// The sample of the present moment.
    pub(super) fn sample(&mut self) -> &Sample {
        // A form writes only what it keeps.
        (self.shown.work, self.shown.stabilizer) = (DoubleDouble::default(), 0.0);
        self.driver.read(&mut self.shown);
        self.shown.stabilizer += self.stabilizer;
        self.sampler.take(&self.shown)
    }

    /// The motion last sampled.
    pub(super) fn shown(&self) -> &Motion {
        &self.shown
    }

    /// From now on what a trajectory is left alone for: steps up to a time, with a pause after every impact.
    pub(super) fn pause_at_impacts(&mut self, until: Time) {
        if self.horizon != Some(until) {
            self.is_between = false;
        }
        self.horizon = Some(until);
    }

    /// Counts of all drivers so far.
    pub(super) fn statistics(&self) -> Statistics {
        self.driver.statistics()
    }

    /// Looks for these events from now on; false where what is remembered of events is of others.
    pub(super) fn watch_for(&mut self, mut detector: EventDetector) -> bool {
        detector.watch_friction(&self.mechanism);
        let fits = self.remembered.take().is_none_or(|memory| detector.restore(memory));
        self.events = Some(detector);
        fits
    }

    /// Advances to an output time, through impacts and holds; false where it paused on the way.
    pub(super) fn go(
        &mut self,
        until: Time,
        outcome: &mut Outcome,
        pause: &mut Pause,
    ) -> Result<bool, StepError> {
        self.go_watched(until, outcome, None, None, pause)
    }

    /// The same, looked at on the way by a monitor.
    pub(super) fn go_watched(
        &mut self,
        until: Time,
        outcome: &mut Outcome,
        mut monitor: Option<&mut dyn Monitor>,
        mut observer: Option<&mut ObserverAdapter>,
        pause: &mut Pause,
    ) -> Result<bool, StepError> {
        if !std::mem::take(&mut self.is_between) {
            (self.holds_in_row, self.events_in_row) = (0, 0);
        }
        if let Some(events) = &mut self.events {
            events.suit(outcome.plan.tolerance.map(|tolerance| tolerance.relative));
        }
        while self.events_in_row < EVENTS_MOST {
            if let Some(events) = &mut self.events {
                events.rest(&self.off);
            }
            if let Some(monitor) = &mut monitor {
                monitor.count_events(outcome.impact_count + outcome.persistent_contact_count);
            }
            let horizon = self.horizon.unwrap_or_else(|| outcome.plan.time(outcome.plan.rows));
            if let Some(extremes) = &mut self.extremes {
                extremes.hold(&self.mechanism);
            }
            let mut watchers = Watchers {
                events: self.events.as_mut(),
                extremes: self.extremes.as_mut(),
                observer: observer.as_deref_mut(),
            };
            let steps = watchers.is_asked().then_some(&mut watchers as &mut dyn StepWatcher);
            let watch = StepWatch { flips: self.flips.as_mut(), monitor: lent(&mut monitor), steps };
            let halt = self.driver.advance(until, horizon, watch, pause);
            self.record_events(outcome);
            let impacts_before = outcome.impact_count;
            match halt {
                Ok(Halt::Until) if until == horizon && self.are_due(outcome) => {
                    self.act(outcome, lent(&mut monitor))?;
                    if self.ended_by.is_some() {
                        return Ok(true);
                    }
                }
                Ok(Halt::Until) => return Ok(true),
                Ok(Halt::Cut) => {
                    self.act(outcome, lent(&mut monitor))?;
                    if observer.as_ref().is_some_and(|observer| observer.has_enough) {
                        self.ended_by = Some("observer".into());
                    }
                    if self.ended_by.is_some() {
                        return Ok(true);
                    }
                }
                Ok(Halt::Pause) => {
                    self.is_between = true;
                    return Ok(false);
                }
                Ok(Halt::Contact(contact)) if self.mechanism.held.contains(&contact) => {
                    self.pressure_ends(contact, outcome)?
                }
                Ok(Halt::Contact(contact)) if self.is_passed_by(contact) => {}
                Ok(Halt::Contact(contact)) => {
                    let flying = self.take_up_bounces(outcome)?;
                    let approach = self.impact_at(contact, &flying, outcome)?;
                    self.meet_after(Some(contact), approach, outcome)?;
                }
                Err(stop) if stop.cause == Cause::RestingContact => {
                    let before = (outcome.impact_count, self.mechanism.held.clone());
                    self.meet(outcome)?;
                    if before == (outcome.impact_count, self.mechanism.held.clone()) {
                        return Err(stop);
                    }
                    // The steps that closed in on the wall are too short to see the point leave it.
                    self.driver.forget();
                }
                Err(stop) => return Err(stop),
            }
            self.events_in_row += 1.max((outcome.impact_count - impacts_before) as usize);
            if self.horizon.is_some() && self.events_in_row < EVENTS_MOST {
                self.is_between = true;
                return Ok(false);
            }
        }
        Err(self.too_many_events(outcome))
    }

    /// Why a run stops that meets too many events before the next output time.
    fn too_many_events(&mut self, outcome: &Outcome) -> StepError {
        let (what, hint) = match outcome.events.last() {
            _ if !self.free.contacts.is_empty() => (
                "impacts and releases".to_owned(),
                "shorten the output interval, lower the restitution, or look for a point that motors \
                 squeeze between walls, or for an event that brings itself about",
            ),
            Some(event) => (
                format!("events, the last of them `{}`,", event.name),
                "look for an event that brings itself about, as by a parameter it sets, or shorten the \
                 output interval",
            ),
            None => (
                "changes between sticking and sliding".to_owned(),
                "shorten the output interval, or change the friction",
            ),
        };
        let what = format!("more than {EVENTS_MOST} {what} before the next output time");
        self.stopped(&outcome.plan, what, hint)
    }

    /// True where something is to be done at an event that is due at the end of the run.
    fn are_due(&mut self, outcome: &mut Outcome) -> bool {
        let motion = self.motion();
        let are_due = self.events.as_mut().is_some_and(|events| events.happen_at_end(&motion));
        self.record_events(outcome);
        are_due
    }

    /// The present motion.
    pub(super) fn motion(&mut self) -> Motion {
        let mut motion = Motion::default();
        self.look(&mut motion);
        motion
    }

    /// The same into a motion that is there already.
    pub(super) fn look(&mut self, motion: &mut Motion) {
        self.driver.read(motion);
    }

    /// Where the step began in which motions can be read.
    pub(super) fn step_begin(&self) -> Time {
        self.driver.place().from.time
    }

    /// Why the present moment cannot be the first one of a run with walls: its coordinates are not those of
    /// the start, or its rates are others without impacts.
    pub(super) fn begun_elsewhere(&mut self, start: &Motion, outcome: &Outcome) -> Option<StepError> {
        if self.free.contacts.is_empty() {
            return None;
        }
        let keeps_rates = outcome.impact_count == 0 && outcome.persistent_contact_count == 0;
        let first = self.motion();
        let what = impact_monitor::is_start(&self.free, start, &first, keeps_rates).err()?;
        let what = format!("the first sample is not the start: {what}");
        let stop = self.stopped(
            &outcome.plan,
            what,
            "state the walls and the start so that no point is behind its wall",
        );
        Some(StepError { cause: Cause::ImpactCheckFailed, ..stop })
    }

    fn name(&self, contact: usize) -> &str {
        &self.free.contacts[contact].row.name
    }

    fn names(&self, contacts: &[usize]) -> String {
        contacts.iter().map(|&contact| self.name(contact)).collect::<Vec<_>>().join(", ")
    }

    pub(super) fn stopped(&mut self, plan: &Plan, what: String, hint: &str) -> StepError {
        let t = self.motion().time.hi;
        StepError {
            cause: Cause::RestingContact,
            method: plan.method.to_string(),
            t,
            step: 0.0,
            what,
            hint: hint.into(),
        }
    }
}
