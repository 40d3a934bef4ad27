//! Factors of S = G M⁻¹ Gᵀ that survive singular positions and redundant rows.
//!
//! ```text
//! S = L D Lᵀ,   share of row r:  D_r / Σ_k |g_rk|²/d_k
//!     about the square of how far the mechanism is from a singular position
//! ```
//!
//! Where a mechanism has all its links in line, rows lose their independence: pivots fall with the square of
//! the distance, and the multipliers of what is left are rounding divided by it.  Light members and long
//! levers make pivots small as well: below [`NEAR`] the [`rank`](super::rank) of the rows decides, which
//! knows no masses.  A row whose share there is below [`DROPPED`] is left out, in accelerations and
//! projections alike, and its multiplier is zero.  Against the row's constant scale, because whole rows
//! vanish together: a pivot over the present diagonal would not see it. Rows that depend on others for ever
//! are left out in the same way.

use super::Mechanism;
use super::constraint::{ConstraintEquation, RowMeasure};
use super::kernel::{Kernel, dot};
use super::rank::Metric;
use super::tree::{self, Tree, size};
use crate::arithmetic::Real;

/// Share below which a row is left out.
pub const DROPPED: f64 = f64::DROPPED;
/// Share below which a position counts as near a singular one.
pub const NEAR: f64 = 1e-2;

/// Share below which forces and accelerations are those of a singular position: rounding, or of rows that are
/// left out.
pub const SINGULAR: f64 = 1e-7;

/// The row whose pivot is the smallest share of its scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weakest {
    /// The share, about 1 or less; rounding may make it negative.
    pub share: f64,
    /// The row.
    pub row: usize,
    /// True where light members or long levers cost S more digits than the position does.
    pub is_delicate: bool,
    /// True of a position that may be near a singular one, with some room.
    pub is_near: bool,
}

impl Weakest {
    /// Before any row has been looked at.
    pub const NONE: Self = Self { share: f64::INFINITY, row: 0, is_delicate: false, is_near: false };

    /// Looks at the pivot of a row against its scale: its reciprocal, or zero where the row is left out.
    #[inline(always)]
    pub fn reciprocal<T: Real>(&mut self, row: usize, pivot: T, scale: f64) -> T {
        let share = pivot.value() / scale;
        if share < self.share {
            *self = Self { share, row, is_delicate: false, is_near: false };
        }
        if share < T::DROPPED || scale == 0.0 { T::ZERO } else { T::ONE / pivot }
    }

    /// The same where it is known whether the row is left out.
    pub fn reciprocal_kept<T: Real>(&mut self, row: usize, pivot: T, scale: f64, is_left_out: bool) -> T {
        if is_left_out {
            return T::ZERO;
        }
        let share = pivot.value() / scale;
        if share.is_nan() || share < self.share {
            *self = Self { share, row, is_delicate: false, is_near: false };
        }
        // Where rounding has eaten it, more digits are needed.
        if pivot.value() > 0.0 { T::ONE / pivot } else { T::ZERO }
    }
}

/// Diagonal of M over its pivots from which on so many digits are lost in M⁻¹ that S is delicate.
const DEEP: f64 = 1e4;

/// True where light members carry heavy ones in line: reciprocal pivots of M against its diagonal.
#[inline(always)]
pub fn is_deep<T: Real>(pivot: &[T], diagonal: impl Iterator<Item = f64>) -> bool {
    pivot.iter().zip(diagonal).any(|(pivot, diagonal)| pivot.value() * diagonal > DEEP)
}

impl RowMeasure {
    /// Σ |g_k|² `free`_k: what S has at most on a row's place without other rows, up to a factor of the
    /// number of bodies \[1/kg, 1/(kg·m²)\], where element k alone would give way by `free`(k) to a force of
    /// one.
    pub fn scale(&self, free: impl Fn(usize) -> f64) -> f64 {
        match self {
            Self::Angle { body, base } => free(*body) + base.map_or(0.0, free),
            Self::Place(place) => {
                let linear: f64 = place.linear.iter().map(|&(k, g)| g.norm_squared() * free(k)).sum();
                // Of the two elements of a product one is a unit vector; an origin is not bounded, so that
                // the other counts alone.
                let other = |j: usize, k: usize| if k < place.angles { free(j) } else { 0.0 };
                linear
                    + place
                        .bilinear
                        .iter()
                        .map(|&(j, k, h)| h.norm_squared() * (free(k) + other(j, k)))
                        .sum::<f64>()
            }
        }
    }
}

impl ConstraintEquation {
    /// What pivots of this row are measured against: its measure's scale with the diagonal of M \[1/kg,
    /// 1/(kg·m²)\].
    pub fn scale(&self, tree: &Tree) -> f64 {
        let own = self.aim.iter().flat_map(|aim| &aim.angles).map(|&k| 1.0 / tree.diagonal[k]);
        own.fold(self.measure.scale(|k| 1.0 / tree.diagonal[k]), |sum, angle| sum + angle)
    }
}

impl Mechanism {
    /// The share of the weakest constraint after an evaluation; where points rest or places stick, of the
    /// scene's own ones: with the others, constraints may depend on each other without a singular position.
    pub fn standing_share(&self, kernel: &Kernel<f64>) -> f64 {
        self.standing_weakest(kernel).share
    }

    /// The constraint of that share.
    pub fn standing_weakest(&self, kernel: &Kernel<f64>) -> Weakest {
        let (standing, weakest) = (self.standing_rows(), kernel.weakest);
        // Among fewer constraints no pivot is smaller.
        let is_own = standing == self.constraints.len() || weakest.share >= NEAR;
        if is_own { weakest } else { kernel.judge_first(standing).weakest() }
    }

    /// True after an evaluation at a singular position of the way: what constraints exert there is the limit
    /// along the motion, which the state alone does not tell.  At a start there it is that of least norm.
    pub fn hides_forces(&self, kernel: &Kernel<f64>) -> bool {
        self.assembly.singular.is_empty() && self.standing_share(kernel) < SINGULAR
    }

    /// The scale of every row, see [`ConstraintEquation::scale`].
    pub fn row_scales(&self) -> Vec<f64> {
        self.constraints.iter().map(|row| row.scale(&self.tree)).collect()
    }
}

/// S = L D Lᵀ in place above the diagonal, from the last row to the first, and the reciprocal pivots: zero
/// for rows left out.
///
/// Solved with [`tree::solve`](super::tree::solve), which then gives these rows no multiplier.
#[inline(always)]
pub fn factor<T: Real, const R: usize>(
    rows: usize,
    schur: &mut [T],
    pivot: &mut [T],
    scale: &[f64],
) -> Weakest {
    let scale = &scale[..size::<R>(rows)];
    let mut weakest = Weakest::NONE;
    tree::factor_by::<T, R>(rows, schur, pivot, |k, pivot| weakest.reciprocal(k, pivot, scale[k]));
    weakest
}

/// S of rows J and M⁻¹ Jᵀ (each r × n), above and on its diagonal.
#[inline(always)]
pub fn product<T: Real>(rows: usize, jacobian: &[T], minv_jt: &[T], schur: &mut [T]) {
    let n = jacobian.len() / rows.max(1);
    for r in 0..rows {
        for s in r..rows {
            schur[r * rows + s] = dot(&jacobian[r * n..(r + 1) * n], &minv_jt[s * n..(s + 1) * n]);
        }
    }
}

/// What there is to do where a factored S has small pivots: the rank of the rows is looked at, and S factored
/// again where other rows are to be left out.
#[cold]
pub fn look_closer<T: Real>(
    metric: &Metric,
    scale: &[f64],
    mass: Weakest,
    [jacobian, minv_jt]: [&[T]; 2],
    schur: &mut [T],
    pivot: &mut [T],
) -> Weakest {
    let rows = scale.len();
    let before: Vec<f64> = pivot[..rows].iter().map(|pivot| pivot.value()).collect();
    metric.judge(jacobian).settle(mass, [&before, scale], |is_left_out| {
        product(rows, jacobian, minv_jt, schur);
        let Some(is_left_out) = is_left_out else { return factor::<T, 0>(rows, schur, pivot, scale).share };
        let mut weakest = Weakest::NONE;
        tree::factor_by::<T, 0>(rows, schur, pivot, |k, pivot| {
            weakest.reciprocal_kept(k, pivot, scale[k], is_left_out[k])
        });
        weakest.share
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_that_depends_on_others_gets_no_multiplier_and_changes_nothing() {
        // The third row is the sum of the first two.
        let full = [2.0, 0.5, 2.5, 0.0, 3.0, 3.5, 0.0, 0.0, 6.0];
        let (mut schur, mut pivot) = (full, [0.0; 3]);
        let weakest = factor::<f64, 0>(3, &mut schur, &mut pivot, &[2.0, 3.0, 6.0]);
        assert!(weakest.share.abs() < 1e-15 && weakest.row == 0);
        // A right side in the range of S: S times (1, -2, 0).
        let mut found = [1.0, -5.5, -4.5];
        tree::solve::<f64, 0>(3, &schur, &pivot, &mut found);
        assert_eq!(found[0], 0.0);
        for (i, expected) in [1.0, -5.5, -4.5].into_iter().enumerate() {
            let sum: f64 = (0..3).map(|j| full[i.min(j) * 3 + i.max(j)] * found[j]).sum();
            assert!((sum - expected).abs() < 1e-13);
        }
    }

    #[test]
    fn independent_rows_are_factored_as_any_matrix() {
        let full = [2.0, 0.5, 0.25, 0.0, 3.0, -1.0, 0.0, 0.0, 6.0];
        let (mut schur, mut pivot) = (full, [0.0; 3]);
        let (mut other, mut other_pivot) = (full, [0.0; 3]);
        factor::<f64, 3>(3, &mut schur, &mut pivot, &[1.0; 3]);
        tree::factor::<f64, 3>(3, &mut other, &mut other_pivot);
        assert_eq!((schur, pivot), (other, other_pivot));
    }
}
