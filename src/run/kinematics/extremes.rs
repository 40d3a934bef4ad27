//! Extremes over a range, at positions and between them.

use super::Limit;
use super::walk::{DriveWalk, SolvedPosition};
use crate::stepping::search::golden_sections;

/// Least values of the positions beside which a column's least value is looked for, and golden sections
/// there.
const LOOKED_AT: usize = 8;
const SECTIONS: usize = 40;
/// Values that differ by less, over the column's largest one, are the same: as near as sections come to a
/// corner.
const SAME: f64 = 1e-9;

impl DriveWalk {
    /// The least value of a column, times a sign, over positions and between them, and the drive's value at
    /// the first of them; nothing where it has none.
    ///
    /// Between positions it is looked for on both sides of every one that is not above its neighbours, of
    /// many those that may hide most.
    pub fn least(&mut self, all: &[SolvedPosition], column: usize, sign: f64) -> Option<[f64; 2]> {
        let values: Vec<f64> = all.iter().map(|one| sign * one.position.column(column)).collect();
        let size =
            values.iter().filter(|value| value.is_finite()).fold(0.0, |most: f64, v| most.max(v.abs()));
        let beside = |k: usize| [k.saturating_sub(1), (k + 1).min(all.len() - 1)];
        // As far below a position as a neighbour is above it, at most.
        let hidden =
            |k: usize| values[k] - beside(k).map(|j| values[j] - values[k]).into_iter().fold(0.0, f64::max);
        let is_low = |k: &usize| {
            let is_above = |j: usize| values[j] >= values[*k] || values[j].is_nan();
            values[*k].is_finite() && beside(*k).into_iter().all(is_above)
        };
        let mut low: Vec<usize> = (0..all.len()).filter(is_low).collect();
        low.sort_by(|&a, &b| hidden(a).total_cmp(&hidden(b)));
        low.truncate(LOOKED_AT);
        low.sort_unstable();
        let mut found: Option<[f64; 2]> = None;
        for k in low {
            let mut here = [values[k], all[k].position.drive];
            let [from, to] = beside(k).map(|j| &all[j]);
            let look = |t: f64| {
                self.restore(from);
                self.go(t)?;
                let value = sign * self.column(column);
                if value < here[0] {
                    here = [value, self.drive()];
                }
                Ok::<_, Limit>(value)
            };
            // Where there is no way to a place between them, what was found stands.
            let _ = golden_sections(look, [from.state.time.hi, to.state.time.hi], SECTIONS);
            // Of several that are the same to rounding the first.
            if found.is_none_or(|[least, _]| here[0] < least - SAME * size) {
                found = Some(here);
            }
        }
        found
    }
}
