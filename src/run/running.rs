//! The loop: from output time to output time, with limits watched; a run can pause in it, be taken down and
//! go on elsewhere.

mod outcome;
mod prepared;
mod snapshot;
mod stops;

pub use self::outcome::{Outcome, RunError};
pub use self::prepared::Run;
use self::snapshot::moment;
pub use self::snapshot::{ResumeError, Snapshot};
pub(super) use self::stops::without_value;
use self::stops::{
    advised, came_apart, drift_stop, foreign, is_at_rounding, missed, not_finite, not_given, uncounted,
};
use super::clock::{Clock, still};
use super::contact::ContactDriver;
use super::drift::{Drift, Limits};
use super::driver::Pause;
use super::event::{Event, EventDetector, EventMark, foreign_event, marks};
use super::extremes::ExtremesDetector;
use super::flip::FlipDetector;
use super::monitor::Monitor;
use super::observer::{Observer, ObserverAdapter, StepsOf};
use super::plan::{Plan, Request};
use super::sample::Sample;
use super::trust::ErrorEstimator;
use super::turns::Turns;
use crate::arithmetic::shown::estimate;
use crate::dynamics::{Mechanism, Motion};
use crate::scene::Scene;
use crate::stepping::{Statistics, StepError};
use std::cell::{Cell, RefCell};
use std::sync::Arc;

/// A scene from its start to its horizon in one call: compiles, plans, integrates.
///
/// # Errors
/// Whatever keeps it from beginning, and what the observer failed with; a stop on the way is part of the
/// [`Outcome`].
pub fn simulate(
    scene: &Scene,
    request: &Request,
    observer: &mut dyn FnMut(&Sample) -> std::io::Result<()>,
) -> Result<Outcome, RunError> {
    let mechanism = Arc::new(Mechanism::new(scene)?);
    let plan = Plan::new(scene, &mechanism, request)?;
    let start = mechanism.start(scene);
    integrate(Run::new(mechanism, plan, Limits::default(), &start)?, observer)
}

/// Integrates a run to its horizon, shows every sample to `observer`, and tells how it ended.
///
/// A stop of the method is part of the [`Outcome`]; everything up to it has been shown.
///
/// # Errors
/// What the observer failed with.
pub fn integrate(
    run: Run,
    observer: &mut dyn FnMut(&Sample) -> std::io::Result<()>,
) -> Result<Outcome, RunError> {
    let mut running = Running::new(run);
    running.go(observer, &mut || false)?;
    Ok(running.finish())
}

/// A run under way.
///
/// ```
/// use driftless::dynamics::Mechanism;
/// use driftless::run::{Limits, Plan, Request, Run, Running};
/// use driftless::scene::read_scene;
/// use std::sync::Arc;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let scene = read_scene("examples/scenes/free.json".as_ref(), &[])?;
/// let mechanism = Arc::new(Mechanism::new(&scene)?);
/// let start = mechanism.start(&scene);
/// let plan = Plan::new(&scene, &mechanism, &Request { until: Some(2.0), ..Request::default() })?;
/// let mut running = Running::new(Run::new(mechanism.clone(), plan, Limits::default(), &start)?);
/// let mut steps = 0;
/// let is_over = running.go(&mut |_| Ok(()), &mut || {
///     steps += 1;
///     steps >= 100
/// })?;
/// assert!(!is_over);
/// // As bytes, in another process, on another day: the rest of the run comes out the same, bit for bit.
/// let mut rest = Running::resume(mechanism, &start, running.snapshot())?;
/// assert!(rest.go(&mut |_| Ok(()), &mut || false)?);
/// assert_eq!(rest.finish().last.t, 2.0);
/// # Ok(())
/// # }
/// ```
pub struct Running {
    limits: Limits,
    contact_driver: ContactDriver,
    outcome: Outcome,
    turns: Turns,
    /// For runs of an ensemble: whether they end with the first flip.
    ensemble: Option<bool>,
    error_estimator: Option<ErrorEstimator>,
    /// The output row it is on the way to.
    row: u64,
    /// What keeps it from leaving its start.
    resting: Option<StepError>,
    is_over: bool,
    /// The mechanism and the motion it began with.
    compiled: Arc<Mechanism>,
    start: Motion,
    /// The events from outside that the run before a snapshot looked for, until they are given again.
    awaited: Vec<EventMark>,
    clock: Clock,
}

impl Running {
    /// Begins a run: whatever touches and moves into its wall at the start is struck.
    pub fn new(run: Run) -> Self {
        let Run { mechanism, plan, limits, driver, turns, ensemble, error_estimator, events, clock, begun } =
            run;
        let mut outcome = Outcome::begun(&mechanism, plan);
        let foreign = foreign_event(&mechanism, &begun, &events).map(|event| foreign(&outcome.plan, event));
        let mut contact_driver = ContactDriver::new(Arc::clone(&mechanism), driver);
        if !events.is_empty() && foreign.is_none() {
            contact_driver.events = Some(EventDetector::new(Arc::clone(contact_driver.whole()), events));
        }
        contact_driver.extremes = ExtremesDetector::new(contact_driver.holding());
        contact_driver.flips = ensemble.map(|_| FlipDetector::default());
        // The reference of the energy is what impacts at the start leave.
        let resting = contact_driver.meet(&mut outcome).err().or(foreign);
        Self {
            limits,
            contact_driver,
            outcome,
            turns,
            ensemble,
            error_estimator,
            row: 0,
            resting,
            is_over: false,
            compiled: mechanism,
            start: begun,
            awaited: Vec::new(),
            clock: still,
        }
        .timed(clock)
    }

    /// Goes on from a snapshot of a run of the same mechanism and start.
    ///
    /// # Errors
    /// The snapshot is one of another mechanism, or of a program whose numbers differ.
    pub fn resume(
        mechanism: Arc<Mechanism>,
        start: &Motion,
        snapshot: Snapshot,
    ) -> Result<Self, ResumeError> {
        if !snapshot.fits(&mechanism, start) {
            return Err(ResumeError::Misfit);
        }
        let Snapshot { limits, contact_state, mut outcome, row, resting, horizon, .. } = snapshot;
        let (error_estimator, awaited) = (snapshot.error_estimator, snapshot.events);
        outcome.drift.kind = Drift::new(&mechanism, outcome.plan.until).kind;
        let error_estimator = match error_estimator {
            Some(kept) => Some(
                ErrorEstimator::resume(&mechanism, &outcome.plan, start, kept, horizon.into())?
                    .ok_or(ResumeError::Misfit)?,
            ),
            None => None,
        };
        let turns = Turns::new(&mechanism, &outcome.plan, start);
        let contact_driver =
            ContactDriver::resume(mechanism.clone(), &outcome.plan, start, contact_state, horizon.into())?
                .ok_or(ResumeError::Misfit)?;
        Ok(Self {
            limits,
            contact_driver,
            outcome,
            turns,
            ensemble: None,
            error_estimator,
            row,
            resting,
            is_over: false,
            compiled: mechanism,
            start: start.clone(),
            awaited,
            clock: still,
        })
    }

    /// Timed by a clock from now on.
    #[must_use]
    pub fn timed(mut self, clock: Clock) -> Self {
        self.clock = clock;
        if let Some(error_estimator) = &mut self.error_estimator {
            error_estimator.clock = clock;
        }
        self
    }

    /// With samples of a window of time for charts \[s\].
    #[must_use]
    pub fn windowed(mut self, window: Option<[f64; 2]>) -> Self {
        self.outcome.trace.window = window;
        self
    }

    /// Goes on looking for the events that the run before the snapshot looked for; without them such a run
    /// stops where it is.
    ///
    /// # Errors
    /// They are others: by their number, names or directions, or by the values of their functions at the last
    /// output time.
    pub fn with_events(mut self, events: Vec<Box<dyn Event>>) -> Result<Self, ResumeError> {
        let other = |what: String| Err(ResumeError::OtherEvents(what));
        let moment = moment(&self.outcome.last).unwrap_or_else(|| self.start.clone());
        if let Some(event) = foreign_event(&self.compiled, &moment, &events) {
            return other(format!("event `{event}` names a body that is not there"));
        }
        let awaited = std::mem::take(&mut self.awaited);
        let given = marks(&self.compiled, &moment, &events);
        if awaited.len() != given.len() {
            return other(format!("it has {}, and {} are given", awaited.len(), given.len()));
        }
        if let Some((before, _)) = awaited.iter().zip(&given).find(|(before, given)| before != given) {
            return other(format!("event `{}` was another one", before.name));
        }
        let detector = EventDetector::new(Arc::clone(self.contact_driver.whole()), events);
        if self.contact_driver.watch_for(detector) { Ok(self) } else { Err(ResumeError::Misfit) }
    }

    /// The plan as it is carried out.
    pub fn plan(&self) -> &Plan {
        &self.outcome.plan
    }

    /// The last output time reached \[s\].
    pub fn time(&self) -> f64 {
        self.outcome.last.t
    }

    /// The time up to which it has integrated, where a checkpoint goes on \[s\].
    pub fn reached(&self) -> f64 {
        self.contact_driver.driver.place().state.time.hi.max(self.time())
    }

    /// Integrates on until it is over (true), or `pause`, asked after every step and every row, wants it to
    /// pause (false).
    ///
    /// `dopri5` and `dop853` show no steps but the ends of their windows, which are the output times.  Where
    /// it paused changes nothing of what follows.
    ///
    /// # Errors
    /// What the observer failed with; the run cannot go on then.
    pub fn go(
        &mut self,
        observer: &mut dyn FnMut(&Sample) -> std::io::Result<()>,
        pause: &mut Pause,
    ) -> Result<bool, RunError> {
        let (begin, before) = ((self.clock)(), self.outcome.trust_wall);
        let is_over = self.rows(observer, None, pause);
        self.outcome.wall += ((self.clock)() - begin).saturating_sub(self.outcome.trust_wall - before);
        is_over
    }

    /// The same for an [`Observer`], which sees steps and samples and may end the run: its outcome is kept,
    /// and says so.
    pub fn go_observed(&mut self, observer: &mut dyn Observer, pause: &mut Pause) -> bool {
        let (begin, before) = ((self.clock)(), self.outcome.trust_wall);
        let wants_steps = observer.wants_steps();
        let observer = RefCell::new(observer);
        let mut steps = StepsOf(&observer);
        let mut watching = ObserverAdapter { observer: &mut steps, has_enough: false };
        let watching = if wants_steps { Some(&mut watching) } else { None };
        let is_enough = Cell::new(false);
        let gone = self.rows(
            &mut |sample| {
                is_enough.set(is_enough.get() || observer.borrow_mut().sample(sample).is_break());
                Ok(())
            },
            watching,
            &mut || is_enough.get() || pause(),
        );
        self.outcome.wall += ((self.clock)() - begin).saturating_sub(self.outcome.trust_wall - before);
        if is_enough.get() && !self.is_over {
            self.outcome.ended_by = Some("observer".into());
            self.is_over = true;
        }
        self.is_over || gone.unwrap_or(true)
    }

    fn rows(
        &mut self,
        observer: &mut dyn FnMut(&Sample) -> std::io::Result<()>,
        mut steps: Option<&mut ObserverAdapter>,
        pause: &mut Pause,
    ) -> Result<bool, RunError> {
        self.ask_for_events();
        let Self { limits, contact_driver, outcome, ensemble, error_estimator, turns, .. } = self;
        while !self.is_over {
            let stopped = match self.resting.take() {
                Some(stop) => Err(stop),
                None if self.row == 0 => Ok(true),
                None => {
                    let monitor =
                        error_estimator.as_mut().map(|error_estimator| error_estimator as &mut dyn Monitor);
                    contact_driver.go_watched(
                        outcome.plan.time(self.row),
                        outcome,
                        monitor,
                        steps.as_deref_mut(),
                        pause,
                    )
                }
            };
            if let Some(error_estimator) = error_estimator {
                outcome.trust_wall += error_estimator.take_wall();
            }
            if stopped == Ok(false) {
                return Ok(false);
            }
            outcome.ended_by = contact_driver.ended_by.take();
            let stopped = stopped.map_err(|stop| advised(stop, contact_driver));
            let (has_closed_loops, steps_made) =
                (contact_driver.has_closed_loops(), contact_driver.statistics().steps);
            let is_first = self.row == 0;
            let moved = if is_first { contact_driver.begun_elsewhere(&self.start, outcome) } else { None };
            let present = Arc::clone(&contact_driver.mechanism);
            let sample = contact_driver.sample();
            // A stop before any progress leaves the state of the row before.
            if self.row == 0 || sample.t > outcome.last.t {
                observer(sample)?;
                if ensemble.is_none() {
                    outcome.trace.see(sample);
                }
            }
            let exceeded = outcome.drift.see(sample, limits, steps_made);
            let has_arrived = stopped == Ok(true) && outcome.ended_by.is_none();
            outcome.stop = stopped
                .err()
                .or(moved)
                .or_else(|| if has_arrived { missed(&outcome.plan, self.row, sample) } else { None })
                .or_else(|| (!sample.is_finite()).then(|| not_finite(&outcome.plan, sample.t)))
                .or_else(|| uncounted(&outcome.plan, sample))
                .or_else(|| turns.lost(&present, &outcome.plan, sample))
                .or_else(|| {
                    if has_closed_loops { came_apart(&outcome.plan, &outcome.drift, sample) } else { None }
                })
                .or_else(|| exceeded.err().map(|what| drift_stop(&outcome.plan, sample.t, what)));
            outcome.last.clone_from(sample);
            // A dense method is ahead of what it shows.
            let reached = outcome.last.t;
            outcome.flip =
                contact_driver.flips.as_ref().and_then(|flips| flips.flip).filter(|flip| flip.t <= reached);
            self.row += 1;
            let has_flipped = *ensemble == Some(true) && outcome.flip.is_some();
            self.is_over = outcome.stop.is_some()
                || outcome.ended_by.is_some()
                || has_flipped
                || self.row > outcome.plan.rows;
            if let Some(error_estimator) = error_estimator.as_mut().filter(|_| self.is_over || self.row == 1)
            {
                error_estimator.observe(contact_driver.shown(), contact_driver.statistics());
                if let (Some(name), Some(events)) = (&outcome.ended_by, &contact_driver.events) {
                    error_estimator.ended_at(contact_driver.shown(), &|motion| events.value_of(name, motion));
                }
                outcome.trust_wall += error_estimator.take_wall();
            }
            if !self.is_over && pause() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Integrates to the horizon without a look at what there is to see at the output times: all that the
    /// method itself costs.  False where it paused or stopped.
    pub(super) fn run_unsampled(&mut self, pause: &mut Pause) -> bool {
        let Self { contact_driver, outcome, resting, .. } = self;
        contact_driver.extremes = None;
        resting.is_none()
            && (1..=outcome.plan.rows)
                .all(|row| contact_driver.go(outcome.plan.time(row), outcome, pause) == Ok(true))
    }

    /// Stops at the next step where events from outside were not given again.
    fn ask_for_events(&mut self) {
        if !self.awaited.is_empty() && !self.is_over {
            self.resting = Some(not_given(&self.outcome, &self.awaited));
        }
    }

    /// What tells its events from outside from others, at this motion.
    fn marks(&self, moment: &Motion) -> Vec<EventMark> {
        match &self.contact_driver.events {
            Some(events) if self.awaited.is_empty() => marks(&self.compiled, moment, events.outside()),
            _ => self.awaited.clone(),
        }
    }

    /// The motion at the last output time, to the last digit.
    pub fn motion(&self) -> &Motion {
        self.contact_driver.shown()
    }

    /// The mechanism at that time: with the contacts that are held, on the branches its laws are on, with the
    /// parts that act.
    pub fn mechanism(&self) -> &Arc<Mechanism> {
        self.contact_driver.holding()
    }

    /// How it ended.
    pub fn finish(mut self) -> Outcome {
        self.contact_driver.end(self.outcome.last.t, &mut self.outcome);
        self.outcome.statistics = self.contact_driver.statistics();
        let extremes = self.contact_driver.extremes.as_ref();
        self.outcome.drift.take_passage(extremes.and_then(ExtremesDetector::singular));
        self.outcome.extremes = extremes.map_or_else(Vec::new, ExtremesDetector::extremes);
        let Statistics { steps, newton_steps, .. } = self.outcome.statistics;
        if newton_steps > 0 {
            let note = format!(
                "{newton_steps} of {steps} steps found their stages by Newton's method: fixed-point \
                    iteration converges slowly there"
            );
            self.outcome.plan.notes.push(note);
        }
        if self.outcome.drift.is_doubtful() {
            let how = match self.outcome.plan.step {
                Some(_) => "a shorter step",
                None if is_at_rounding(&self.outcome.plan) => "another method",
                None => "a tighter tolerance",
            };
            let off = self.outcome.drift.energy_share;
            self.outcome.plan.notes.push(format!(
                "the energy balance is off by {} of its scale, and the motion may be off by more: try \
                    {how}",
                estimate(off)
            ));
        }
        self.outcome.trust = self.error_estimator.take().map(|error_estimator| {
            error_estimator.trust(self.outcome.last.t).with_model(self.outcome.plan.model_error)
        });
        self.outcome
    }
}
