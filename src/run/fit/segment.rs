//! One part of the data: the motion through it, the outputs at its times, and where it ends, with
//! derivatives.

use super::super::build::build;
use super::super::contact::ContactDriver;
use super::super::running::Outcome;
use super::super::sensitivity::{Derived, Look, Study, Variation, outputs};
use crate::dynamics::Motion;
use crate::run::driver::Pause;
use crate::stepping::{Cause, StepError};
use nalgebra::DMatrix;
use std::sync::Arc;

/// A state: coordinates and rates.
pub(super) type Place = [Vec<f64>; 2];

/// Why there is no motion over the data, or nothing to be found from it.
#[derive(Clone, Debug, thiserror::Error)]
pub(super) enum Lost {
    /// It was paused.
    #[error("interrupted")]
    Interrupted,
    /// It takes more than so many steps.
    #[error("a run takes more than {0} steps")]
    TooLong(u64),
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
pub(super) struct SegmentOutcome {
    /// Outputs at its times, with their slopes by the parameters, then by the directions of its start.
    pub rows: Vec<Derived>,
    /// Where it ends.
    pub end: Place,
    /// The columns there.
    pub columns: Vec<Vec<f64>>,
    /// Expansions of the motion, or steps of the columns, whichever are more.
    pub effort: u64,
}

/// The local coordinates of a start: directions that the constraints leave at the base of these, orthonormal
/// in the units of the coordinates.
#[derive(Clone, Copy)]
pub(super) struct Frame<'a> {
    pub tangent: &'a DMatrix<f64>,
    pub unit: &'a [f64],
}

impl Frame<'_> {
    /// One for each local coordinate: of positions, then of rates.
    fn directions(&self) -> Vec<Vec<f64>> {
        let (n, f) = self.tangent.shape();
        let direction = |j: usize| {
            let mut column = vec![0.0; 2 * n];
            let from = if j < f { 0 } else { n };
            (0..n).for_each(|i| column[from + i] = self.tangent[(i, j % f)] * self.unit[i]);
            column
        };
        (0..2 * f).map(direction).collect()
    }

    /// Makes of columns on the constraints, the last of which are their directions, the derivatives of the
    /// start by the numbers with all local coordinates kept, then by these.
    fn turn(&self, columns: &mut [Vec<f64>]) -> Option<()> {
        let (n, f) = self.tangent.shape();
        let count = columns.len() - 2 * f;
        let all = DMatrix::from_fn(2 * n, columns.len(), |i, c| columns[c][i]);
        let local = DMatrix::from_fn(2 * f, columns.len(), |j, c| {
            let half = (j / f) * n;
            (0..n).map(|i| self.tangent[(i, j % f)] * all[(half + i, c)] / self.unit[i]).sum::<f64>()
        });
        let own = all.columns(count, 2 * f) * local.columns(count, 2 * f).into_owned().try_inverse()?;
        let kept = all.columns(0, count) - &own * local.columns(0, count);
        for (column, found) in columns.iter_mut().zip(kept.column_iter().chain(own.column_iter())) {
            column.copy_from_slice(found.as_slice());
        }
        Some(())
    }
}

/// Integrates from `from` (time, state and its local coordinates; from the scene's start where there is none)
/// to `until` \[s\], looking at `times`, with columns for the numbers of a study and then for the local
/// coordinates; one of several parts is to leave nothing but a state.  More than `most` expansions of the
/// motion, or steps of the columns, are refused.
///
/// # Errors
/// Why there is no such motion, or no derivatives.
pub(super) fn pass(
    study: &Study,
    from: Option<(f64, &Place, Frame)>,
    (times, until): (&[f64], f64),
    (is_one_of_several, most): (bool, u64),
    pause: &mut Pause,
) -> Result<SegmentOutcome, Lost> {
    let stopped = |stop: StepError| match stop.cause {
        Cause::EffortExhausted => Lost::TooLong(most),
        _ => stop.what.into(),
    };
    let mut plan = study.plan.clone();
    (plan.until, plan.every) = (until, until);
    let start = match from {
        Some((t, [phi, omega], _)) => Motion::of_doubles(t, [phi, omega]),
        None => study.start.clone(),
    };
    let drives = study.mechanism.laws.as_ref().is_some_and(|laws| laws.formulas.drives());
    if from.is_some() && drives && !matches!(study.mechanism.on_branches_of(&start), Ok(None)) {
        let what = "the law of a motor or wall is on another branch, or piece of a table, than at the \
                    start, and does not go on from a place alone: leave --segments out";
        return Err(what.into());
    }
    let mut outcome = Outcome::begun(&study.mechanism, plan.clone());
    let mut driver = build(&study.mechanism, &mut plan, &start).map_err(stopped)?;
    driver.allow(most);
    let mut driver = ContactDriver::new(Arc::clone(&study.mechanism), driver);
    let directions = from.map_or_else(Vec::new, |(_, _, frame)| frame.directions());
    let mut variation = study.variation(directions.len()).map_err(|error| error.to_string())?;
    variation.most = most;
    driver.jumps = Some(variation.jumps.clone());
    driver.meet(&mut outcome).map_err(stopped)?;
    if from.is_some() {
        variation.columns.iter_mut().for_each(|column| column.fill(0.0));
    }
    variation.add(&directions);
    let begin = driver.motion();
    variation.begin(&begin);
    if let Some((_, _, frame)) = from {
        frame.turn(&mut variation.columns).ok_or("a part begins at a singular position")?;
    }
    let mut sampler = SegmentSampler { times, next: 0, until, rows: Vec::new(), end: None };
    if from.map_or(0.0, |(t, ..)| t) == until {
        sampler.end = Some(begin.clone());
    }
    if sampler.next() == Some(begin.time.hi) {
        sampler.at(&mut variation, &begin, begin.time.hi);
    }
    if begin.time.hi < until
        && !variation.go(&mut driver, until, &mut outcome, &mut sampler, pause).map_err(stopped)?
    {
        return Err(Lost::Interrupted);
    }
    if let Some(lost) = variation.lost {
        return Err(if variation.tried >= most { Lost::TooLong(most) } else { lost.into() });
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
    let effort = driver.statistics().evaluations.max(variation.tried);
    Ok(SegmentOutcome { rows: sampler.rows, end: place, columns: variation.columns, effort })
}

struct SegmentSampler<'a> {
    times: &'a [f64],
    next: usize,
    until: f64,
    rows: Vec<Derived>,
    end: Option<Motion>,
}

impl Look for SegmentSampler<'_> {
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
