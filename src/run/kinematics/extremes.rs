//! Extremes over a range, at positions and between them, at limits and at singular positions.

use super::Limit;
use super::walk::{DriveWalk, LimitApproach, SingularPosition, SolvedPosition};
use crate::stepping::search::golden_sections;
use std::ops::Range;

/// Least values of the positions beside which a column's least value is looked for, and golden sections
/// there.
const LOOKED_AT: usize = 8;
const SECTIONS: usize = 40;
/// Values that differ by less, over the column's usual size, are the same: as near as sections come to a
/// corner.
const SAME: f64 = 1e-9;

/// What was solved of the range of a drive.
pub(super) struct SolvedRange {
    /// In ascending order of the drive, those on the way to limits as well.
    pub positions: Vec<SolvedPosition>,
    /// Which of them were asked for.
    pub rows: Range<usize>,
    /// The limits that end it, below and above.
    pub limits: [Option<LimitApproach>; 2],
    /// The singular positions it leads through.
    pub singular: Vec<SingularPosition>,
}

impl SolvedRange {
    /// From what was solved on the two sides of the start, outwards, and beyond at limits.
    pub fn new(sides: [Vec<SolvedPosition>; 2], mut limits: [Option<LimitApproach>; 2]) -> Self {
        let count = sides.iter().map(Vec::len).sum::<usize>();
        let [below, above] = sides;
        let [before, after] =
            limits.each_mut().map(|limit| limit.as_mut().map(|one| std::mem::take(&mut one.positions)));
        let before = before.unwrap_or_default();
        let rows = before.len()..before.len() + count;
        let positions = before.into_iter().rev().chain(below.into_iter().rev()).chain(above);
        let positions = positions.chain(after.unwrap_or_default()).collect();
        Self { positions, rows, limits, singular: Vec::new() }
    }

    /// The positions but those beside limits that rounding hides.
    fn exact(&self, is_rounded: impl Fn(&SolvedPosition) -> bool) -> &[SolvedPosition] {
        let [is_limit_below, is_limit_above] = self.limits.each_ref().map(Option::is_some);
        let all = &self.positions[..];
        let first = all.iter().position(|one| !(is_limit_below && is_rounded(one)));
        let last = all.iter().rposition(|one| !(is_limit_above && is_rounded(one)));
        first.zip(last).map_or(all, |(first, last)| all.get(first..=last).unwrap_or(all))
    }

    /// A column at a value of the drive where the state tells `plain`: beside singular positions what
    /// polynomials tell.
    fn value(&self, column: usize, drive: f64, plain: f64) -> f64 {
        self.singular.iter().fold(plain, |value, one| one.value(column, drive, value))
    }
}

impl DriveWalk {
    /// The least value of a column, times a sign, over positions, between them and at limits, and the drive's
    /// value at the first of them; nothing where it has none, NaN where a singular position leaves it open.
    ///
    /// Between positions it is looked for on both sides of every one that is not above its neighbours, of
    /// many those that may hide most.
    pub fn least(&mut self, range: &SolvedRange, column: usize, sign: f64) -> Option<[f64; 2]> {
        if range.singular.iter().any(|one| one.is_unknown(column)) {
            return Some([f64::NAN; 2]);
        }
        let all = range.exact(|one| self.is_rounded(one));
        let value = |drive: f64, plain: f64| sign * range.value(column, drive, plain);
        let at = |one: &SolvedPosition| value(one.position.drive, one.position.column(column));
        let values: Vec<f64> = all.iter().map(at).collect();
        let rows = &range.positions[range.rows.clone()];
        let size = usual_size(&rows.iter().map(at).collect::<Vec<f64>>());
        let beside = |k: usize| [k.saturating_sub(1), (k + 1).min(all.len() - 1)];
        // As far below a position as a neighbour is above it, at most.
        let hidden =
            |k: usize| values[k] - beside(k).map(|j| values[j] - values[k]).into_iter().fold(0.0, f64::max);
        let at_limits = range.limits.each_ref().map(|limit| {
            let at = limit.as_ref().and_then(|limit| Some([sign * limit.column(column)?, limit.drive]));
            at.filter(|at| at[0] < f64::INFINITY)
        });
        let [at_lower, at_upper] = at_limits;
        let at_singular = range.singular.iter().flat_map(|one| one.unbounded(column));
        let at_singular = at_singular.map(|[value, drive]| [sign * value, drive]);
        let mut ends = at_lower.into_iter().chain(at_singular).chain(at_upper);
        if let Some(unbounded) = ends.find(|at| at[0] == f64::NEG_INFINITY) {
            return Some(unbounded);
        }
        let is_low = |k: &usize| {
            let is_above = |j: usize| values[j] >= values[*k] || values[j].is_nan();
            let is_under = |at: Option<[f64; 2]>| at.is_some_and(|at| at[0] < values[*k]);
            let to_limit = *k == 0 && is_under(at_lower) || *k + 1 == all.len() && is_under(at_upper);
            values[*k].is_finite() && !to_limit && beside(*k).into_iter().all(is_above)
        };
        let mut low: Vec<usize> = (0..all.len()).filter(is_low).collect();
        low.sort_by(|&a, &b| hidden(a).total_cmp(&hidden(b)));
        low.truncate(LOOKED_AT);
        low.sort_unstable();
        let mut found = at_lower;
        // Of several that are the same to rounding the first.
        let mut take = |here: [f64; 2]| {
            if found.is_none_or(|[least, _]| here[0] < least - SAME * size) {
                found = Some(here);
            }
        };
        for k in low {
            let mut here = [values[k], all[k].position.drive];
            let [from, to] = beside(k).map(|j| &all[j]);
            let look = |t: f64| {
                self.restore(from);
                self.go(t)?;
                let value = value(self.drive(), self.column(column));
                if value < here[0] {
                    here = [value, self.drive()];
                }
                Ok::<_, Limit>(value)
            };
            // Where there is no way to a place between them, what was found stands.
            let _ = golden_sections(look, [from.state.time.hi, to.state.time.hi], SECTIONS);
            take(here);
        }
        at_upper.into_iter().for_each(take);
        found
    }
}

/// How large a column is but where it grows without bound: its upper quartile.
fn usual_size(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values.iter().map(|value| value.abs()).filter(|v| v.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(3 * sizes.len() / 4).copied().unwrap_or(0.0)
}
