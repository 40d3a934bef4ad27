//! One part of the data: the motion through it, the outputs at its times, and where it ends, with
//! derivatives.

use super::super::build::build;
use super::super::contact::ContactDriver;
use super::super::running::Outcome;
use super::super::sensitivity::{Derived, Look, Study, Variation, outputs};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::{Motion, Time};
use crate::run::driver::Pause;
use std::sync::Arc;

/// A state: coordinates and rates.
pub(super) type Place = [Vec<f64>; 2];

/// Why there is no motion over the data, or nothing to be found from it.
#[derive(Clone, Debug, thiserror::Error)]
pub(super) enum Lost {
    /// It was paused.
    #[error("interrupted")]
    Interrupted,
    /// It cannot be computed.
    #[error("{0}")]
    Why(String),
}

impl<T: Into<String>> From<T> for Lost {
    fn from(why: T) -> Self {
        Self::Why(why.into())
    }
}

/// What came of a part.
pub(super) struct Passed {
    /// Outputs at its times, with their slopes by the parameters, then by the directions of its start.
    pub rows: Vec<Derived>,
    /// Where it ends.
    pub end: Place,
    /// The columns there.
    pub columns: Vec<Vec<f64>>,
}

/// Integrates from `from` (time and state; from the scene's start where there is none) to `until` \[s\],
/// looking at `times`, with columns for the numbers of a study and then for these directions of the start;
/// one of several parts is to leave nothing but a state.
///
/// # Errors
/// Why there is no such motion, or no derivatives.
pub(super) fn pass(
    study: &Study,
    from: Option<(f64, &Place)>,
    directions: &[Vec<f64>],
    (times, until): (&[f64], f64),
    is_one_of_several: bool,
    pause: &mut Pause,
) -> Result<Passed, Lost> {
    let mut plan = study.plan.clone();
    (plan.until, plan.every) = (until, until);
    let start = match from {
        Some((t, [phi, omega])) => {
            let all = |from: &[f64]| from.iter().map(|&x| DoubleDouble::from(x)).collect::<Vec<_>>();
            let turns = vec![0; phi.len()];
            Motion { time: Time::from(t), phi: all(phi), omega: all(omega), turns, ..Motion::default() }
        }
        None => study.start.clone(),
    };
    let mut outcome = Outcome::begun(&study.mechanism, plan.clone());
    let driver = build(&study.mechanism, &mut plan, &start).map_err(|stop| stop.what)?;
    let mut driver = ContactDriver::new(Arc::clone(&study.mechanism), driver);
    let mut variation = study.variation(directions.len()).map_err(|error| error.to_string())?;
    driver.jumps = Some(variation.jumps.clone());
    driver.meet(&mut outcome).map_err(|stop| stop.what)?;
    if from.is_some() {
        variation.columns.iter_mut().for_each(|column| column.fill(0.0));
    }
    variation.add(directions);
    let begin = driver.motion();
    variation.begin(&begin);
    let mut sampler = Sampler { times, next: 0, until, rows: Vec::new(), end: None };
    if from.map_or(0.0, |(t, _)| t) == until {
        sampler.end = Some(begin.clone());
    }
    if sampler.next() == Some(begin.time.hi) {
        sampler.at(&mut variation, &begin, begin.time.hi);
    }
    if begin.time.hi < until
        && !variation.go(&mut driver, until, &mut outcome, &mut sampler, pause).map_err(|stop| stop.what)?
    {
        return Err(Lost::Interrupted);
    }
    if let Some(lost) = variation.lost {
        return Err(lost.into());
    }
    let events = study.mechanism.laws.iter().flat_map(|laws| &laws.formulas.events);
    let mut changes = events.filter(|event| event.changes_what_acts());
    let is_known = variation.mechanism.frictions.is_empty()
        && variation.mechanism.held.is_empty()
        && !changes.any(|event| outcome.events.iter().any(|happened| happened.name == event.name));
    if is_one_of_several && !is_known {
        let what = "what sticks, rests on a wall, or is switched or set by events, does not go on from a \
            place alone: leave --segments out";
        return Err(what.into());
    }
    let end = sampler.end.ok_or("the motion ends before the data")?;
    let place = [
        (0..end.phi.len()).map(|k| end.unwrapped(k)).collect(),
        end.omega.iter().map(|omega| omega.hi).collect(),
    ];
    Ok(Passed { rows: sampler.rows, end: place, columns: variation.columns })
}

struct Sampler<'a> {
    times: &'a [f64],
    next: usize,
    until: f64,
    rows: Vec<Derived>,
    end: Option<Motion>,
}

impl Look for Sampler<'_> {
    fn next(&self) -> Option<f64> {
        self.times.get(self.next).copied()
    }

    fn at(&mut self, variation: &mut Variation, motion: &Motion, _time: f64) {
        self.next += 1;
        self.rows.push(outputs(variation, motion));
    }

    fn crossed(&mut self, variation: &mut Variation, motion: &Motion, time: f64) {
        // At the time of an event a row has what comes after it, as those of a run.
        let seen = self.next.checked_sub(1).and_then(|last| self.times.get(last));
        if let Some(row) = self.rows.last_mut().filter(|_| seen == Some(&time)) {
            *row = outputs(variation, motion);
        }
        self.stepped(variation, motion, time);
    }

    fn stepped(&mut self, _variation: &mut Variation, motion: &Motion, time: f64) {
        if time >= self.until {
            self.end = Some(motion.clone());
        }
    }
}
