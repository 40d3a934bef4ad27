//! One setting of one method: how far off it is, and how long it takes.

use super::truth::{TimeLimit, Truth};
use crate::arithmetic::sum::larger;
use crate::dynamics::{Mechanism, Motion};
use crate::run::drift::Limits;
use crate::run::plan::Plan;
use crate::run::running::{Run, RunError, Running};
use crate::stepping::{Statistics, StepError};
use std::cell::Cell;
use std::sync::Arc;

/// What a run was found to be.
#[derive(Clone, Debug, PartialEq)]
pub struct RunMeasurement {
    /// Largest distance from the reference as far as that reaches: of an angle \[rad\], or a place over the
    /// mechanism's size.  Not a number where there is no reference.
    pub error: f64,
    /// The same of rates \[rad/s\].
    pub rate_error: f64,
    /// Both at the times the comparison names.
    pub errors: Vec<[f64; 2]>,
    /// Largest drift of energy, or energy minus work, over the energy scale.
    pub energy: f64,
    /// Largest violation of any constraint, at position \[rad or m\] and velocity level \[rad/s or m/s\],
    /// where there are any.
    pub constraint: Option<[f64; 2]>,
    /// Counts.
    pub statistics: Statistics,
}

/// How a measurement ended.
pub(super) enum MeasurementEnd {
    /// At the horizon, with the plan as it was carried out.
    Whole(RunMeasurement, Box<Plan>),
    /// The method stopped on the way.
    Stopped(RunMeasurement, StepError),
    /// Its time was over, at so many seconds of the motion.
    Late(f64),
    /// It was to be given up.
    Over,
}

/// Runs a plan and looks at it at its output times.
pub(super) fn measure(
    mechanism: &Arc<Mechanism>,
    start: &Motion,
    plan: Plan,
    truth: &Truth,
    room: TimeLimit,
    is_over: &dyn Fn() -> bool,
) -> Result<MeasurementEnd, StepError> {
    let mut running = Running::new(Run::new(Arc::clone(mechanism), plan, Limits::default(), start)?);
    let plan = running.plan().clone();
    let mut found = RunMeasurement {
        error: f64::NAN,
        rate_error: f64::NAN,
        errors: Vec::new(),
        energy: 0.0,
        constraint: None,
        statistics: Statistics::default(),
    };
    let is_late = room.runs_out(is_over);
    let is_row = Cell::new(false);
    loop {
        let mut observer = |_: &_| {
            is_row.set(true);
            Ok(())
        };
        let gone = running.go(&mut observer, &mut || is_row.get() || is_late());
        if is_row.take()
            && let Some(([error, rate_error], mark)) = truth.error(running.motion())
        {
            found.error = largest(found.error, error);
            found.rate_error = largest(found.rate_error, rate_error);
            found.errors.extend(mark.then_some([error, rate_error]));
        }
        match gone {
            Ok(true) => break,
            Ok(false) if is_over() => return Ok(MeasurementEnd::Over),
            Ok(false) if is_late() => return Ok(MeasurementEnd::Late(running.time())),
            Ok(false) => {}
            Err(RunError::Step(stop)) => return Err(stop),
            // Nothing observes that could fail.
            Err(_) => return Ok(MeasurementEnd::Over),
        }
    }
    let outcome = running.finish();
    let levels =
        outcome.drift.constraints.iter().map(|(_, [position, velocity])| [position.max, velocity.max]);
    found.constraint = levels.reduce(|a, b| [0, 1].map(|level| larger(a[level], b[level])));
    found.energy = outcome.drift.energy.max;
    found.statistics = outcome.statistics;
    Ok(match outcome.stop {
        None => MeasurementEnd::Whole(found, Box::new(plan)),
        Some(stop) => MeasurementEnd::Stopped(found, stop),
    })
}

/// The larger of what was there, if anything, and a distance; once that is not a number it is infinite.
fn largest(most: f64, value: f64) -> f64 {
    if value.is_nan() { f64::INFINITY } else { most.max(value) }
}

/// Mean time of a run \[s\] over as many repetitions as fill a quantum \[s\], without looking at anything on
/// the way; `None` where it was given up.
///
/// A run shorter than that is made once before the clock is looked at, so that the caches hold what is its
/// own.
pub(super) fn time(
    mechanism: &Arc<Mechanism>,
    start: &Motion,
    plan: &Plan,
    before: Option<f64>,
    room: TimeLimit,
    is_over: &dyn Fn() -> bool,
) -> Option<f64> {
    let once = || {
        let mut running =
            Running::new(Run::new(Arc::clone(mechanism), plan.clone(), Limits::default(), start).ok()?);
        let begin = (room.clock)();
        running.run_unsampled(&mut || is_over()).then(|| (room.clock)().saturating_sub(begin).as_secs_f64())
    };
    if before.is_none_or(|before| before < room.seconds) {
        let first = once()?;
        if first >= room.seconds {
            return Some(first);
        }
    }
    let (mut total, mut count) = (0.0, 0.0);
    while total < room.seconds {
        total += once()?;
        count += 1.0;
        if count >= MOST {
            break;
        }
    }
    Some(total / count)
}

/// Repetitions of a run that takes next to no time.
const MOST: f64 = 1e4;
