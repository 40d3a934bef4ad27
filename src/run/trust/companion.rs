//! The companion of a run: the same motion by a finer series, looked at where the run is.

use super::budget::{FULL_GRACE, FULL_SHARE, GRACE, Prices, SHARE};
use super::tangent::{self, Path, Tangent};
use super::{CAUTION, CUT, HORIZON, How, LEAST, LOST, Level, Ruler, Trust};
use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::contact::{Course, Station};
use crate::run::march::build;
use crate::run::methods::MethodId;
use crate::run::plan::Plan;
use crate::run::running::Outcome;
use crate::stepping::composition::Composition;
use crate::stepping::{StepError, Tally, Taylor, Tolerance};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The companion's tolerance over the run's.
const FINER: f64 = 100.0;
/// Tolerance \[rad/s\] of companions in doubles whose run is near rounding, and from which tolerance of a run on that is so.
const FINEST: f64 = 1e-16;
const NEAR_ROUNDING: f64 = 1e-10;
/// Tolerance \[rad/s\] of all others, at most.
const FINE: f64 = 1e-14;
/// Tolerance \[rad/s\] with the first orders in double-double.
const EXTENDED: f64 = 1e-20;
/// An error \[rad\] near the horizon.
const NEAR: f64 = 0.03 * HORIZON;
/// Times at which the estimate is kept.
const KEPT: usize = 512;
/// Growth within the second half of the time \[ln\] up to which a motion is regular.
const REGULAR: f64 = 2.0;
/// Growth \[ln\] beyond which the exponent is known well enough.
const ENOUGH: f64 = 2000.0;
/// Powers of time with which the error of a regular motion grows.
const POWERS: [f64; 2] = [1.0, 2.0];
/// What the last digit of the scene's numbers moves them by, in units of their size; fitted.
const LAST_DIGIT: f64 = 2.5 * 1.1e-16;

/// What is measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Measured {
    level: Level,
    /// The companion, in words.
    name: String,
    /// The time reached \[s\], and E there.
    until: f64,
    error: f64,
    record: Vec<[f64; 2]>,
    stride: u64,
    seen: u64,
    horizon: Option<f64>,
    lost: Option<f64>,
    /// What the last digit of the inputs came to at the horizon.
    input_error: Option<f64>,
    /// Why it went no further.
    why: Option<String>,
    /// Growth of small differences against time, once the companion has ended.
    history: Vec<[f64; 2]>,
    /// Work spent.
    spent: f64,
}

/// A companion under way.
struct Shadow {
    course: Course,
    outcome: Outcome,
    motion: Motion,
    tangent: Option<Tangent>,
    /// True where its own rounding counts: the run is as near it.
    is_rounded: bool,
    last: Tally,
}

/// A companion, and what it has measured so far.
pub(in crate::run) struct Companion {
    ruler: Ruler,
    prices: Prices,
    measured: Measured,
    shadow: Option<Shadow>,
}

/// All that the rest of it depends on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(in crate::run) struct Kept {
    measured: Measured,
    shadow: Option<KeptShadow>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct KeptShadow {
    station: Station,
    outcome: Outcome,
    path: Option<Path>,
    last: Tally,
}

impl Kept {
    /// On the way to a later horizon \[s\].
    pub(in crate::run) fn extend(&mut self, until: f64) {
        if let Some(shadow) = &mut self.shadow {
            (shadow.outcome.plan.until, shadow.outcome.plan.every) = (until, until);
        }
    }

    /// Whether its parts go together.
    pub(in crate::run) fn is_sound(&self) -> bool {
        let sound = |shadow: &KeptShadow| {
            let Outcome { plan, holds, .. } = &shadow.outcome;
            plan.is_sound() && Course::names_holds(&shadow.station) <= holds.len()
        };
        self.measured.stride > 0 && self.shadow.as_ref().is_none_or(sound)
    }
}

/// The series that accompanies a run: its plan, and what it is in words.
fn planned(mechanism: &Mechanism, plan: &Plan, level: Level) -> (Plan, String) {
    let finer = plan.tolerance.map(|tolerance| tolerance.relative.min(tolerance.absolute) / FINER);
    let is_near_rounding = match (plan.method, finer) {
        (MethodId::Gauss(stages), _) => stages > 2,
        (MethodId::Rattle(composition), _) => !matches!(composition, Composition::Single | Composition::Suzuki5),
        (_, finer) => finer.is_some_and(|finer| finer * FINER < NEAR_ROUNDING),
    };
    // Rows kept by projection are kept in doubles; two bodies under gravity have a kernel in double-double.
    let may_extend = !mechanism.has_multipliers() && mechanism.contacts.is_empty();
    let is_extended = may_extend && (level == Level::Full || (is_near_rounding && Taylor::has_lanes(mechanism, true)));
    let tolerance = match finer {
        Some(finer) if is_extended => finer.min(EXTENDED),
        None if is_extended => EXTENDED,
        // Steps that end at every output time are often far better than their tolerance, and a finer series costs little.
        Some(finer) if !is_near_rounding => finer.min(FINE),
        _ => FINEST,
    };
    let tolerance = Tolerance { relative: tolerance, absolute: tolerance };
    let mut series = Plan::of_series(mechanism, tolerance, plan.until);
    series.extended = is_extended;
    let orders = if is_extended { ", first orders in double-double" } else { "" };
    (series, format!("taylor at {:.0e}{orders}", tolerance.relative))
}

impl Companion {
    /// One for a run by a plan from a motion; where none can begin it says so in its figures.
    pub(in crate::run) fn new(mechanism: &Arc<Mechanism>, plan: &Plan, start: &Motion, level: Level) -> Self {
        let (mut series, name) = planned(mechanism, plan, level);
        let prices = Prices::new(mechanism, &series, plan);
        let mut measured = Measured {
            level,
            name,
            until: 0.0,
            error: 0.0,
            record: Vec::new(),
            stride: 1,
            seen: 0,
            horizon: None,
            lost: None,
            input_error: None,
            why: None,
            history: Vec::new(),
            spent: 0.0,
        };
        let shadow = match begun(mechanism, &mut series, start) {
            Ok(shadow) => Some(shadow),
            Err(stop) => {
                measured.why = Some(stop);
                None
            }
        };
        Self { ruler: Ruler::new(mechanism), prices, measured, shadow }
    }

    /// Goes on from what was kept; `None` where it cannot be of this mechanism.
    pub(in crate::run) fn resume(
        mechanism: &Arc<Mechanism>,
        plan: &Plan,
        start: &Motion,
        kept: Kept,
        horizon: Time,
    ) -> Result<Option<Self>, StepError> {
        let Kept { measured, shadow } = kept;
        let ruler = Ruler::new(mechanism);
        let Some(KeptShadow { station, outcome, path, last }) = shadow else {
            let prices = Prices::new(mechanism, plan, plan);
            return Ok(Some(Self { ruler, prices, measured, shadow: None }));
        };
        let Some(course) = Course::resume(Arc::clone(mechanism), &outcome.plan, start, station, horizon)? else { return Ok(None) };
        let tangent = match path {
            None => None,
            Some(path) => match Tangent::resume(mechanism, path) {
                None => return Ok(None),
                tangent => tangent,
            },
        };
        let (prices, is_rounded) = (Prices::new(mechanism, &outcome.plan, plan), is_rounded(&outcome.plan));
        let shadow = Shadow { course, outcome, motion: Motion::default(), tangent, is_rounded, last };
        Ok(Some(Self { ruler, prices, measured, shadow: Some(shadow) }))
    }

    /// All that the rest of it depends on.
    pub(in crate::run) fn kept(&self) -> Kept {
        let shadow = self.shadow.as_ref().map(|shadow| KeptShadow {
            station: shadow.course.station(),
            outcome: shadow.outcome.clone(),
            path: shadow.tangent.as_ref().map(|tangent| tangent.path().clone()),
            last: shadow.last,
        });
        Kept { measured: self.measured.clone(), shadow }
    }

    /// True where the run is to be looked at at this output time \[s\]: errors change with the motion, so that between the points where the tangent flow asks
    /// for it there is little to be seen but near the horizon.
    pub(in crate::run) fn is_due(&self, t: f64) -> bool {
        let tangent = self.shadow.as_ref().and_then(|shadow| shadow.tangent.as_ref());
        let is_near = self.measured.error > NEAR && self.measured.lost.is_none();
        self.measured.seen == 0 || is_near || tangent.is_none_or(|tangent| tangent.next() <= t)
    }

    /// Looks at the run at an output time, after so much work of its own.
    pub(in crate::run) fn see(&mut self, motion: &Motion, plan: &Plan, tally: Tally, rows: u64) {
        let Self { ruler, prices, measured, shadow: Some(shadow) } = self else { return };
        if measured.seen > 0 && motion.time.hi <= measured.until {
            return;
        }
        let budget = match measured.level {
            Level::Auto => GRACE + SHARE * prices.run(plan, tally, rows),
            // No more evaluations than the run is allowed itself.
            Level::Off | Level::Full => {
                (FULL_GRACE + FULL_SHARE * prices.run(plan, tally, rows)).min(plan.effort as f64 * prices.series[0])
            }
        };
        let before = shadow.tangent.as_ref().map(Tangent::now);
        // The last step of a fixed-step run may end beyond the horizon by rounding.
        let horizon = Time::from(shadow.outcome.plan.until);
        let time = if motion.time > horizon { horizon } else { motion.time };
        if let Err(stop) = shadow.go(time, prices, &mut measured.spent, budget) {
            let why = stop.unwrap_or_else(|| match measured.level {
                Level::Full => {
                    let expansions = shadow.course.tally().evaluations;
                    format!("{CUT} was used up after t = {} s, by {expansions} expansions and the tangent flow along them", measured.until)
                }
                Level::Off | Level::Auto => "more would have taken too large a share of the run".into(),
            });
            return self.end(&why);
        }
        if measured.lost.is_some() {
            let growth = shadow.tangent.as_ref().map_or(f64::INFINITY, Tangent::growth);
            if growth > ENOUGH {
                self.end("the exponent is known");
            }
            return;
        }
        let apart = ruler.apart(motion, &shadow.motion);
        let rounding = shadow.tangent.as_ref().filter(|_| shadow.is_rounded).map_or(0.0, Tangent::rounding);
        let error = apart.hypot(rounding);
        if !error.is_finite() {
            return self.end("what small differences come to is beyond all numbers");
        }
        let (t, last) = (motion.time.hi, measured.error.max(LEAST));
        if error > HORIZON && measured.horizon.is_none() {
            let grown = before
                .map(|[_, log]| [measured.until, log])
                .into_iter()
                .chain(shadow.tangent.as_ref().map(Tangent::history).into_iter().flatten());
            measured.horizon = Some(crossing([measured.until, last], [t, error], grown));
            measured.input_error = shadow.tangent.as_ref().map(|tangent| LAST_DIGIT * tangent.reach());
        }
        (measured.until, measured.error) = (t, measured.error.max(error));
        measured.keep();
        if error > LOST {
            measured.lost = Some(t);
            if shadow.tangent.is_none() {
                self.end("the run and its companion have parted");
            }
        }
    }

    /// Ends it, for a reason.
    fn end(&mut self, why: &str) {
        if let Some(tangent) = self.shadow.take().and_then(|shadow| shadow.tangent) {
            self.measured.history = tangent.history();
            if self.measured.input_error.is_none() {
                self.measured.input_error = Some(LAST_DIGIT * tangent.reach());
            }
        }
        if self.measured.lost.is_none() {
            self.measured.why = Some(why.into());
        }
    }

    /// What it has come to at the end of the run, `t` \[s\].
    pub(in crate::run) fn trust(mut self, t: f64) -> Trust {
        let is_whole = self.shadow.is_some();
        if is_whole {
            self.end("");
        }
        let Measured { name, until, error, mut record, horizon, lost, input_error, why, history, .. } = self.measured;
        if record.last().is_some_and(|last| last[0] < until) {
            record.push([until, error]);
        }
        let lyapunov = tangent::exponent(&history);
        let mut trust = Trust {
            how: How::None,
            error_estimate: None,
            at: t,
            horizon,
            lost,
            lyapunov,
            input_error,
            model_error: None,
            companion: Some(name),
            covered: until,
            why: if is_whole { None } else { why },
            record,
        };
        let printed = |error: f64| (CAUTION * error).max(LEAST);
        if let Some(horizon) = trust.horizon {
            trust.how = How::Companion;
            (trust.error_estimate, trust.at) = (Some(printed(HORIZON)), horizon);
        } else if until >= t && trust.record.len() > 1 || t == 0.0 {
            (trust.how, trust.error_estimate) = (How::Companion, Some(printed(error)));
        } else if let Some(power) = power(&trust.record, &history) {
            trust.how = How::Extrapolated(until);
            let ahead = error.max(LEAST) * libm::pow(t / until, power);
            if ahead > HORIZON {
                let at = until * libm::pow(HORIZON / error.max(LEAST), 1.0 / power);
                (trust.horizon, trust.at) = (Some(at), at);
            }
            if ahead > LOST {
                trust.lost = Some(until * libm::pow(LOST / error.max(LEAST), 1.0 / power));
            }
            trust.error_estimate = Some(printed(ahead.min(HORIZON)));
        }
        trust
    }
}

impl Measured {
    /// Keeps the estimate of this time.
    fn keep(&mut self) {
        if self.record.len() == KEPT {
            // The first one stays.
            let mut keep = false;
            self.record.retain(|_| {
                keep = !keep;
                keep
            });
            self.stride *= 2;
        }
        if self.seen.is_multiple_of(self.stride) {
            self.record.push([self.until, self.error]);
        }
        self.seen += 1;
    }
}

/// Whether a companion's own rounding counts.
fn is_rounded(series: &Plan) -> bool {
    !series.extended && series.tolerance.unwrap_or_default().relative <= FINEST
}

/// A companion at its start.
fn begun(mechanism: &Arc<Mechanism>, series: &mut Plan, start: &Motion) -> Result<Shadow, String> {
    if !mechanism.tree.is_dense() {
        return Err("a series takes the matrices of the tree, which are too large here".into());
    }
    let marcher = build(mechanism, series, start).map_err(|stop| stop.what)?;
    let mut outcome = Outcome::begun(mechanism, series.clone());
    let mut course = Course::new(Arc::clone(mechanism), marcher);
    course.meet(&mut outcome).map_err(|stop| stop.what)?;
    let tangent = Tangent::new(mechanism, start, series.until);
    let is_rounded = is_rounded(series);
    Ok(Shadow { course, outcome, motion: Motion::default(), tangent, is_rounded, last: Tally::default() })
}

impl Shadow {
    /// To a time, with the motion there in `motion`; what it cost is added to `spent`, which must not pass the budget.
    ///
    /// # Errors
    /// Why the companion stopped, or `None` where the budget was used up.
    fn go(&mut self, until: Time, prices: &Prices, spent: &mut f64, budget: f64) -> Result<(), Option<String>> {
        while let Some(next) = self.tangent.as_ref().map(Tangent::next).filter(|&next| next <= until.hi) {
            self.march(Time::from(next), prices, spent, budget)?;
            let steps = if self.is_rounded { self.last.steps } else { 0 };
            if let Some(tangent) = &mut self.tangent {
                tangent.take(&self.motion, steps);
                *spent += 0.5 * tangent.evaluations() as f64 * prices.evaluation;
            }
        }
        self.march(until, prices, spent, budget)
    }

    /// The same without the tangent flow.
    fn march(&mut self, until: Time, prices: &Prices, spent: &mut f64, budget: f64) -> Result<(), Option<String>> {
        let mut left = ((budget - *spent) / prices.series[0]) as u64;
        let mut is_spent = || {
            left = left.saturating_sub(1);
            left == 0
        };
        let arrived = self.course.go(until, &mut self.outcome, &mut is_spent);
        if !arrived.map_err(|stop| Some(format!("the companion stopped at t = {} s: {}", stop.t, stop.what)))? || *spent > budget {
            return Err(None);
        }
        self.course.look(&mut self.motion);
        let tally = self.course.tally();
        *spent += (tally.evaluations - self.last.evaluations) as f64 * prices.series[0] + prices.look;
        self.last = tally;
        Ok(())
    }
}

/// The time at which the error passes the horizon between two output times, `[t, E]` each: as small differences grew meanwhile where that is known, else
/// exponentially.
fn crossing([t0, e0]: [f64; 2], [t1, e1]: [f64; 2], grown: impl Iterator<Item = [f64; 2]>) -> f64 {
    let grown: Vec<[f64; 2]> = grown.filter(|point| point[0] >= t0 && point[0] <= t1).collect();
    let span = libm::log(e1 / e0);
    let at = libm::log(HORIZON / e0) / span;
    let plain = t0 + (t1 - t0) * at;
    let (Some(first), Some(last)) = (grown.first(), grown.last()) else { return plain };
    // Where the error was lost on the way it grew further than it shows.
    let needed = if e1 > LOST { libm::log(HORIZON / e0) } else { at * (last[1] - first[1]).max(0.0) };
    match grown.windows(2).find(|pair| pair[1][1] - first[1] >= needed) {
        Some(pair) if pair[1][1] > pair[0][1] => {
            let share = ((first[1] + needed - pair[0][1]) / (pair[1][1] - pair[0][1])).clamp(0.0, 1.0);
            pair[0][0] + share * (pair[1][0] - pair[0][0])
        }
        _ => plain,
    }
}

/// The power of time with which the error of a regular motion grew over the last three quarters of the logarithm of time; `None` where it is not known to be regular.
fn power(record: &[[f64; 2]], history: &[[f64; 2]]) -> Option<f64> {
    let (last, end) = (history.last()?, record.last()?);
    let half = history.iter().rev().find(|point| point[0] <= 0.5 * last[0])?;
    if !last[1].is_finite() || last[1] - half[1] > REGULAR {
        return None;
    }
    let first = record.iter().find(|point| point[0] > 0.0)?;
    let from = first[0] * libm::pow(end[0] / first[0], 0.25);
    let points: Vec<[f64; 2]> =
        record.iter().filter(|point| point[0] >= from && point[1] > 0.0).map(|point| point.map(libm::log)).collect();
    let count = points.len() as f64;
    let mean = |k: usize| points.iter().map(|point| point[k]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let (above, below) = points
        .iter()
        .fold((0.0, 0.0), |(above, below), point| (above + (point[0] - x) * (point[1] - y), below + (point[0] - x) * (point[0] - x)));
    let slope = if below > 0.0 { above / below } else { POWERS[1] };
    Some(slope.clamp(POWERS[0], POWERS[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_horizon_lies_where_the_error_passes_it() {
        // Tenfold a second from 1e-6 at 0.
        let found = crossing([0.0, 1e-6], [5.0, 0.1], std::iter::empty());
        assert!((found - 3.0).abs() < 1e-12);
        // The same, but all the growth comes in the last second.
        let grown = [[0.0, 0.0], [4.0, 0.0], [5.0, libm::log(1e5)]];
        let found = crossing([0.0, 1e-6], [5.0, 0.1], grown.into_iter());
        assert!((found - 4.6).abs() < 1e-12, "{found}");
    }

    #[test]
    fn a_regular_error_is_carried_on_by_its_power_and_a_chaotic_one_is_not() {
        let times: Vec<f64> = (0..100).map(f64::from).collect();
        let record: Vec<[f64; 2]> = times.iter().map(|&t| [t, 1e-12 * t.powf(1.5)]).collect();
        let regular: Vec<[f64; 2]> = times.iter().map(|&t| [t, (1.0 + t).ln()]).collect();
        let chaotic: Vec<[f64; 2]> = times.iter().map(|&t| [t, t]).collect();
        assert!((power(&record, &regular).expect("regular") - 1.5).abs() < 1e-9);
        assert_eq!(power(&record, &chaotic), None);
    }
}
