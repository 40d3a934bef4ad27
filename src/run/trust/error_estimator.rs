//! The reference solution of a run: the same motion by a finer series, looked at together with the run.
//!
//! Looks are a mean step of the reference solution apart, a half of it in the beginning and near the horizon:
//! neither output times nor rests have a say in when they are.  A run that is read off polynomials inside its
//! steps, which are less accurate than their ends, is looked at there, too, as long as its steps are few.

use super::budget::{DOUBLE_DOUBLE, FLOW, FULL_GRACE, FULL_SHARE, Prices, SHARE, grace};
use super::finer;
use super::growth::Nature;
use super::measured::{Apart, LAST_DIGIT, TrustMeasurement};
use super::reference_run::{ReferenceRun, SavedReferenceRun, WorkBudget};
use super::tangent::TangentFlow;
use super::torques::Torques;
use super::{CUT, DistanceMetric, HORIZON, LOST, Level, Trust};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::clock::{Clock, still};
use crate::run::methods::{MethodId, Stabilization};
use crate::run::monitor::Monitor;
use crate::run::plan::Plan;
use crate::run::saltation::Side;
use crate::stepping::{Statistics, StepError};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::Duration;

/// An error \[rad\] near the horizon.
const NEAR: f64 = 0.03 * HORIZON;
/// Growth \[ln\] beyond which the exponent is known well enough.
const ENOUGH: f64 = 2000.0;
/// The first look, in units of time of the mechanism, where the run is not short.
const FIRST: f64 = 1e-3;
/// The time to the next look over the reference solution's mean step: in the beginning, usually, near the
/// horizon, and where the run is lost.
const GAPS: [f64; 4] = [0.5, 1.0, 0.5, 4.0];
/// Looks that belong to the beginning.
const BEGINNING: u64 = 128;
/// The time to the next look over the mean step of a run that is read off polynomials, and the looks of a run
/// that are made so at most.
const INSIDE: f64 = 0.05;
const LOOKS_INSIDE: f64 = 200.0;
/// What the reference solution is off by itself over what was measured, at most.
const MOST_OWN_ERROR: f64 = 2.0;
/// Share of the budget for double-double, after which doubles go on, of runs near rounding.
const NEAR_ROUNDING: f64 = 0.5;
/// What an event's function may be off zero where it ends a run, over its rate, in units of time.
const AT_ZERO: f64 = 1e-4;

/// A reference solution, and what it has measured so far.
pub(in crate::run) struct ErrorEstimator {
    mechanism: Arc<Mechanism>,
    metric: DistanceMetric,
    prices: Prices,
    measured: TrustMeasurement,
    reference_run: Option<ReferenceRun>,
    /// Why it waits where it is: the run's maximum of evaluations, which may be raised, is used up.
    cut: Option<String>,
    /// The run's plan.
    run: Plan,
    /// Impacts and lasting contacts of the run.
    events: u64,
    torques: Option<Torques>,
    /// Time spent since this was last asked for.
    wall: Duration,
    /// What that is taken from.
    pub(in crate::run) clock: Clock,
}

/// All that the rest of it depends on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(in crate::run) struct SavedEstimator {
    measured: TrustMeasurement,
    reference_run: Option<SavedReferenceRun>,
    cut: Option<String>,
}

impl SavedEstimator {
    /// Goes on where the run's maximum of evaluations, which is raised now, had been used up.
    pub(in crate::run) fn allow(&mut self) {
        if self.cut.take().is_some() {
            self.measured.is_cut = false;
        }
    }

    /// On the way to a later horizon \[s\].
    pub(in crate::run) fn extend(&mut self, until: f64) {
        if let Some(reference_run) = &mut self.reference_run {
            reference_run.extend(until);
        }
    }

    /// Whether its parts go together.
    pub(in crate::run) fn is_sound(&self) -> bool {
        self.measured.is_sound() && self.reference_run.as_ref().is_none_or(SavedReferenceRun::is_sound)
    }
}

/// What a reference solution shares with its run, so that it cannot tell where that is wrong.
fn shared(mechanism: &Mechanism, run: &Plan, error_estimator: &Plan) -> Vec<String> {
    let has_walls = !mechanism.contacts.is_empty();
    let finds_likewise = (run.method == MethodId::Taylor) == (error_estimator.method == MethodId::Taylor);
    let has_motors = mechanism.constraints.iter().any(|row| row.law.is_some());
    let eliminated = |plan: &Plan| has_motors && plan.stabilization == Stabilization::Elimination;
    let leaps = mechanism.has_closed_loops() && run.method == MethodId::Taylor;
    let has_friction = !mechanism.frictions.is_empty();
    let words = [
        (has_walls, "impact law"),
        (has_walls && finds_likewise, "contact detection"),
        (has_friction, "laws of friction"),
        (has_friction && finds_likewise, "transitions of friction"),
        (leaps, "leaps through singular positions"),
        (eliminated(run) && eliminated(error_estimator), "elimination of motors"),
        (true, "compilation"),
    ];
    words.into_iter().filter(|(is_shared, _)| *is_shared).map(|(_, word)| word.to_owned()).collect()
}

impl ErrorEstimator {
    /// One for a run by a plan from a motion; where none can begin it says so in its figures.
    pub(in crate::run) fn new(mechanism: &Arc<Mechanism>, plan: &Plan, start: &Motion, level: Level) -> Self {
        let finer::Finer { plan: mut series, name } = finer::first(mechanism, plan, level);
        let prices = Prices::new(mechanism, &series, plan);
        let mut measured = TrustMeasurement::new(level, name, shared(mechanism, plan, &series));
        let mut reference_run =
            ReferenceRun::new(mechanism, &mut series, start).map_err(|why| measured.why = Some(why)).ok();
        if let Some(reference_run) = &mut reference_run {
            measured.no_growth = reference_run.no_growth.take();
            measured.nature = reference_run
                .tangent
                .as_ref()
                .map_or(Nature::default(), |tangent| Nature::new(mechanism, tangent));
        }
        measured.is_bound = finer::is_bound(&series, plan);
        Self::with(mechanism, plan, prices, measured, reference_run)
    }

    fn with(
        mechanism: &Arc<Mechanism>,
        run: &Plan,
        prices: Prices,
        measured: TrustMeasurement,
        reference_run: Option<ReferenceRun>,
    ) -> Self {
        Self {
            mechanism: Arc::clone(mechanism),
            metric: DistanceMetric::new(mechanism),
            prices,
            measured,
            reference_run,
            cut: None,
            run: run.clone(),
            events: 0,
            torques: Torques::new(mechanism),
            wall: Duration::ZERO,
            clock: still,
        }
    }

    /// Goes on from what was kept; `None` where it cannot be of this mechanism.
    pub(in crate::run) fn resume(
        mechanism: &Arc<Mechanism>,
        plan: &Plan,
        start: &Motion,
        kept: SavedEstimator,
        horizon: Time,
    ) -> Result<Option<Self>, StepError> {
        let SavedEstimator { measured, reference_run, cut } = kept;
        let Some(reference_run) = reference_run else {
            return Ok(Some(Self::with(mechanism, plan, Prices::new(mechanism, plan, plan), measured, None)));
        };
        let Some(reference_run) = ReferenceRun::resume(mechanism, start, reference_run, horizon)? else {
            return Ok(None);
        };
        let prices = Prices::new(mechanism, reference_run.plan(), plan);
        let resumed = Self::with(mechanism, plan, prices, measured, Some(reference_run));
        Ok(Some(Self { cut, ..resumed }))
    }

    /// All that the rest of it depends on.
    pub(in crate::run) fn kept(&self) -> SavedEstimator {
        SavedEstimator {
            measured: self.measured.clone(),
            reference_run: self.reference_run.as_ref().map(ReferenceRun::kept),
            cut: self.cut.clone(),
        }
    }

    /// The time spent since this was last asked for.
    pub(in crate::run) fn take_wall(&mut self) -> Duration {
        std::mem::take(&mut self.wall)
    }

    /// True where no more would be allowed unless the run itself were: the estimate waits there.
    fn waits(&self, statistics: Statistics) -> bool {
        self.measured.level == Level::Full && self.budget(statistics) >= self.most()
    }

    /// What as many evaluations cost as the run is allowed itself.
    fn most(&self) -> f64 {
        self.run.max_evaluations as f64 * self.prices.series[0]
    }

    /// What it may cost after so much work of the run.
    fn budget(&self, statistics: Statistics) -> f64 {
        let run = self.prices.run(self.run.method, statistics);
        let whole = match self.measured.level {
            Level::Auto => grace(&self.mechanism, &self.run) + SHARE * run,
            // No more evaluations than the run is allowed itself.
            Level::Off | Level::Full => (FULL_GRACE + FULL_SHARE * run).min(self.most()),
        };
        let is_wide =
            self.reference_run.as_ref().is_some_and(|reference_run| reference_run.plan().in_double_double);
        if !is_wide || self.measured.level == Level::Full {
            return whole;
        }
        match finer::is_near_rounding(&self.run) {
            true => NEAR_ROUNDING * whole,
            false => DOUBLE_DOUBLE[0] * run + DOUBLE_DOUBLE[1],
        }
    }

    /// Ends the tangent flow where it has cost its share; where the reference solution's own rounding counts
    /// it is needed to the end.
    fn limit_flow(&mut self) {
        let Self { reference_run: Some(reference_run), measured, .. } = self else { return };
        let Some(tangent) = &reference_run.tangent else { return };
        let [share, grace] = FLOW[usize::from(!tangent.is_plain())];
        if measured.level == Level::Auto
            && !reference_run.is_rounded
            && measured.flow > share * measured.run + grace
        {
            measured.stop_growth(reference_run.end_flow().as_ref());
        }
    }

    /// Goes to a time beside the run, if need be by another series.
    ///
    /// # Errors
    /// Why it goes no further.
    fn accompany(&mut self, time: Time, statistics: Statistics) -> Result<(), String> {
        let (limit, waits) = (self.budget(statistics), self.waits(statistics));
        let Self { reference_run: Some(reference_run), prices, measured, .. } = self else { return Ok(()) };
        let mut budget = WorkBudget { prices, spent: &mut measured.spent, limit, flow: &mut measured.flow };
        let gone = reference_run.go(time, &mut budget);
        if let Some(why) = reference_run.tangent.as_ref().and_then(TangentFlow::lost) {
            measured.no_growth = Some(why.into());
            measured.conclude(reference_run.end_flow().as_ref());
        }
        let Err(stop) = gone else { return Ok(()) };
        let is_dear = reference_run.plan().in_double_double && !(waits && stop.is_none());
        let second = is_dear.then(|| finer::second(&self.mechanism, &self.run)).flatten();
        if let Some(finer::Finer { mut plan, name }) = second {
            let from = crate::arithmetic::shown::about(reference_run.motion.time.hi);
            (plan.until, plan.every) = (reference_run.plan().until, reference_run.plan().every);
            self.prices = Prices::new(&self.mechanism, &plan, &self.run);
            reference_run.change(plan)?;
            measured.is_bound |= finer::is_bound(reference_run.plan(), &self.run);
            measured.name = format!("{}, from {from} s on {name}", measured.name);
            return self.accompany(time, statistics);
        }
        measured.is_cut = stop.is_none();
        Err(stop.unwrap_or_else(|| match measured.level {
            Level::Full => {
                let expansions = reference_run.expansions();
                format!(
                    "{CUT} was used up after t = {} s, by {expansions} expansions and the tangent flow \
                    along them",
                    measured.until
                )
            }
            Level::Off | Level::Auto => "more would have taken too large a share of the run".into(),
        }))
    }

    /// Looks at the run.
    fn look(&mut self, motion: &Motion, statistics: Statistics) {
        let reference_run = self.reference_run.as_ref().filter(|_| self.cut.is_none());
        let Some(until) = reference_run.map(|run| run.plan().until) else { return };
        let t = motion.time.hi;
        if self.measured.seen > 0 && t <= self.measured.until {
            return;
        }
        // The last step of a fixed-step run may end beyond the horizon by rounding.
        let horizon = Time::from(until);
        if let Err(why) =
            self.accompany(if motion.time > horizon { horizon } else { motion.time }, statistics)
        {
            let waits = self.measured.is_cut && self.waits(statistics);
            return if waits { self.cut = Some(why) } else { self.end(&why) };
        }
        self.measured.run = self.prices.run(self.run.method, statistics);
        self.limit_flow();
        let Self { reference_run: Some(reference_run), measured, .. } = self else { return };
        if measured.lost.is_none() {
            self.measure(motion);
        } else if reference_run.tangent.as_ref().map_or(f64::INFINITY, TangentFlow::growth) > ENOUGH {
            self.end("");
        }
        let Self { reference_run: Some(reference_run), measured, .. } = self else { return };
        let [first, usual, near, lost] = GAPS;
        let share = match measured.lost {
            Some(_) => lost,
            None if measured.error > NEAR => near,
            None if measured.seen < BEGINNING => first,
            None => usual,
        };
        let mut gap = share * reference_run.mean_step(t);
        let is_polynomial = matches!(self.run.method, MethodId::Dp5 | MethodId::Dp8 | MethodId::Radau(_));
        if is_polynomial && measured.lost.is_none() {
            // Where an event may end the run, nobody knows how long it is.
            let length = if self.mechanism.has_stops() { t } else { until };
            gap = gap.min((INSIDE * t / statistics.steps.max(1) as f64).max(length / LOOKS_INSIDE));
        }
        // Units are powers of 1024: in those of slow mechanisms a whole run may be short.
        let first = (FIRST * self.mechanism.units.time).min(until / LOOKS_INSIDE);
        measured.due = (if t > 0.0 { t + gap } else { first }).max(t.next_up());
    }

    /// Measures how far the run and its reference solution are apart.
    fn measure(&mut self, motion: &Motion) {
        let Self { mechanism, metric, measured, events, torques, run, .. } = self;
        let Some(reference_run) = &self.reference_run else { return };
        let apart = metric.apart(motion, &reference_run.motion);
        let own = reference_run.own_error(motion.time.hi, run, measured);
        // It is there for differences that are small by chance.
        let angle = apart.hypot(own.min(MOST_OWN_ERROR * apart.max(measured.error)));
        let rate = (measured.tells_rates([*events, reference_run.events()]))
            .then(|| metric.rates_apart(motion, &reference_run.motion));
        let torque =
            torques.as_mut().map(|torques| torques.apart(mechanism, [motion, &reference_run.motion]));
        if !angle.is_finite() || rate.is_some_and(|rate| !rate.is_finite()) {
            return self.end("what small differences come to is beyond all numbers");
        }
        measured.farthest = measured.farthest.max(metric.reach(motion));
        measured.fastest = motion.omega.iter().fold(measured.fastest, |most, omega| most.max(omega.hi.abs()));
        measured.strongest = torque.map_or(measured.strongest, |[_, most]| measured.strongest.max(most));
        let t = motion.time.hi;
        if measured.take(t, Apart { angle, rate, torque: torque.map(|[apart, _]| apart) }) {
            let at = measured.horizon.unwrap_or(t);
            measured.input_error =
                reference_run.tangent.as_ref().map(|tangent| LAST_DIGIT * tangent.reach(at));
        }
        if angle > LOST {
            measured.lost = Some(t);
            if reference_run.tangent.is_none() {
                self.end("");
            } else {
                self.ease();
            }
        }
    }

    /// Told that an event has ended the run at a motion it was just shown, with its function: where no jump
    /// made it happen the reference solution, moved to where that is zero, tells how far off the end is.
    pub(in crate::run) fn ended_at(&mut self, motion: &Motion, function: &dyn Fn(&Motion) -> Option<f64>) {
        let Self { mechanism, metric, measured, events, reference_run: Some(reference_run), .. } = self
        else {
            return;
        };
        let reference = &reference_run.motion;
        if measured.lost.is_some() || reference.time != motion.time || *events != reference_run.events() {
            return;
        }
        let side = Side::new(mechanism, reference);
        let values = &mut |motion: &Motion| Some(vec![function(motion)?]);
        let rate = side.slope(&side.ahead(), 1.0, f64::INFINITY, values);
        let (Some(rate), Some(value), Some(own)) = (rate, function(reference), function(motion)) else {
            return;
        };
        let late = (own - value) / rate[0];
        if !late.is_finite() || own.abs() > AT_ZERO * mechanism.units.time * rate[0].abs() {
            return;
        }
        let mut there = reference.clone();
        for (k, (omega, acceleration)) in side.omega.iter().zip(&side.acceleration).enumerate() {
            there.phi[k] += DoubleDouble::from(late * omega);
            there.omega[k] += DoubleDouble::from(late * acceleration);
        }
        measured.error = measured.error.max(metric.apart(motion, &there));
        measured.rate = measured.rate.max(metric.rates_apart(motion, &there));
    }

    /// Goes on by a coarse series where only growth is still asked for: any motion nearby tells it.
    fn ease(&mut self) {
        let Self { mechanism, run, prices, reference_run: Some(reference_run), .. } = self else { return };
        if !mechanism.contacts.is_empty() || reference_run.plan().method != MethodId::Taylor {
            return;
        }
        let finer::Finer { mut plan, .. } = finer::coarse(mechanism, run);
        (plan.until, plan.every) = (reference_run.plan().until, reference_run.plan().every);
        *prices = Prices::new(mechanism, &plan, run);
        if let Err(why) = reference_run.change(plan) {
            self.end(&why);
        }
    }

    /// Ends it, for a reason where there is one to be told.
    fn end(&mut self, why: &str) {
        let cut = self.cut.take();
        let why = cut.as_deref().unwrap_or(why);
        if let Some(reference_run) = self.reference_run.take() {
            self.measured.conclude(reference_run.tangent.as_ref());
        }
        if self.measured.lost.is_none() && self.measured.why.is_none() && !why.is_empty() {
            self.measured.why = Some(why.into());
        }
    }

    /// What it has come to at the end of the run, `t` \[s\].
    pub(in crate::run) fn trust(mut self, t: f64) -> Trust {
        self.end("");
        self.measured.trust(t)
    }
}

impl Monitor for ErrorEstimator {
    fn due(&self) -> f64 {
        if self.reference_run.is_some() && self.cut.is_none() { self.measured.due } else { f64::INFINITY }
    }

    fn observe(&mut self, motion: &Motion, statistics: Statistics) {
        let begin = (self.clock)();
        self.look(motion, statistics);
        self.wall += (self.clock)() - begin;
    }

    fn count_events(&mut self, count: u64) {
        self.events = count;
    }

    fn end(&mut self, why: &str) {
        Self::end(self, why);
    }
}
