//! The rows of a window, handed out one by one.

use super::super::{Statistics, StepError};
use super::{Integrate, Stepper, part};
use crate::dynamics::{OdeSystem, State, Time};

/// The rows of a window.
#[derive(Clone, Debug, Default)]
pub struct WindowRows {
    /// Where it began, with the first step it was given \[s\], and where it was to end.
    pub(super) start: State,
    pub(super) until: Time,
    /// Times after its beginning \[s\], and the unknowns then, over their units and followed by the time.
    pub(super) after: Vec<f64>,
    pub(super) y: Vec<f64>,
    pub(super) unit: Vec<f64>,
    /// The row handed out last.
    pub(super) last: usize,
    /// The step passed on to the next window \[s\].
    pub(super) next: f64,
    /// Evaluations it was allowed.
    pub(super) allowed: f64,
    /// Why the window ends with them, where it failed: told once all are handed out, since whoever looks at
    /// them may change the motion before.
    pub(super) failure: Option<StepError>,
    /// True where they are integrated to the end though the process was asked to stop: whoever watches a step
    /// that is made has to see all of it.
    pub(super) finishes: bool,
}

impl WindowRows {
    /// True where rows are left on the way to `until`.
    pub(super) fn has_more(&self, until: Time) -> bool {
        self.until == until && self.last + 1 < self.after.len()
    }

    /// Forgets them.
    pub(super) fn clear(&mut self) {
        self.after.clear();
        self.failure = None;
    }

    /// What a state in the middle of a window remembers: the step passed on, the row it is, the evaluations
    /// allowed, and where the window began.
    pub(super) fn remember(&self, memory: &mut Vec<f64>) {
        let Self { start, until, next, allowed, .. } = self;
        let first = start.memory.first().copied().unwrap_or_default();
        memory.clear();
        memory.extend([*next, self.last as f64, *allowed, first]);
        memory.extend([start.time.hi, start.time.lo, until.hi, until.lo]);
        memory.extend(start.y.iter().copied().chain(start.turns.iter().map(|&turns| turns as f64)));
    }

    /// The beginning of the window that a state on the way to `until` is in the middle of, which of its rows
    /// it is, and the evaluations the window was allowed.
    pub(super) fn recall(state: &State, until: Time) -> Option<(State, usize, f64)> {
        let (&[_, row, allowed, first, time, low, end, end_low], rest) = state.memory.split_first_chunk()?;
        let (y, turns) = rest.split_at_checked(state.y.len())?;
        if [end, end_low] != [until.hi, until.lo] || turns.len() != state.turns.len() {
            return None;
        }
        let mut start =
            State { time: Time { hi: time, lo: low }, y: y.to_vec(), memory: vec![first], ..state.clone() };
        start.low.fill(0.0);
        start.turns = turns.iter().map(|&turns| turns as i64).collect();
        Some((start, row as usize, allowed))
    }

    /// Writes row `last` to a state.
    pub(super) fn hand_out(&self, state: &mut State) {
        let n = state.y.len();
        let row = &self.y[self.last * (n + 1)..];
        state.y.iter_mut().zip(row).zip(&self.unit).for_each(|((y, row), unit)| *y = row * unit);
        state.low.fill(0.0);
        state.turns.clone_from(&self.start.turns);
        let (is_last, after) = (self.last + 1 == self.after.len(), self.after[self.last]);
        let is_end = is_last && after >= (self.until - self.start.time).hi * (1.0 - 1e-12);
        state.time = if is_end { self.until } else { self.start.time + after };
        state.wrap();
        if is_last && self.failure.is_none() {
            state.memory.clear();
            state.memory.push(self.next);
        } else {
            self.remember(&mut state.memory);
        }
    }
}

/// Takes up a state in the middle of a window, or at the beginning of one.
pub(super) fn begin<F: OdeSystem + ?Sized>(
    rows: &mut WindowRows,
    stepper: &Stepper,
    integrate: &mut Integrate,
    field: &mut F,
    state: &mut State,
    until: Time,
) -> Result<(), StepError> {
    super::super::refuse_the_past(stepper.name, state, until, field.time_unit())?;
    if let Some((start, row, allowed)) = WindowRows::recall(state, until) {
        let is_known =
            rows.start == start && rows.until == until && rows.allowed == allowed && row < rows.after.len();
        if !is_known {
            // As often evaluated as before, it comes to the same rows.
            let mut statistics = Statistics { max_evaluations: allowed as u64, ..Statistics::default() };
            part(rows, stepper, integrate, field, &start, until, &mut statistics)?;
            if rows.after.is_empty() {
                // Interrupted: nothing was done.
                return Ok(());
            }
        }
        if row < rows.after.len() {
            let mut there = state.clone();
            rows.last = row;
            rows.hand_out(&mut there);
            if there == *state {
                return Ok(());
            }
        }
        // It is no row of that window: a new one begins with it.
        state.memory.truncate(1);
    }
    rows.clear();
    Ok(())
}
