//! The rank of constraints: a property of their Jacobian, whatever the masses are.
//!
//! ```text
//! A = G D Gᵀ = L P Lᵀ,   share of constraint r:  P_r / Σ_k b_rk d_k,   |g_rk|² <= b_rk
//!     D: d_k = 1 / max_r b_rk / max_j (b_rj d_j)
//! ```
//!
//! Pivots of S = G M⁻¹ Gᵀ are small where constraints lose their independence, and where members are light or
//! levers long.  Those of A know no masses, and D takes out units and lengths: the bounds b of the entries of
//! G are scaled to one, column by column and row by row.  The share is about the square of the distance from
//! a singular position.  Pivots are taken in the order of S, so that the constraints that A finds dependent
//! are those that have no pivot in S.

use super::Mechanism;
use super::constraint::{ConstraintEquation, ForceDirection, RowMeasure};
use super::schur::{DROPPED, NEAR, Weakest};
use crate::arithmetic::Real;

/// Rounds of the scaling.
const ROUNDS: usize = 4;
/// Pivots of S below this part of those of A owe it to masses and levers: so many digits are lost to them.
const LOSS: f64 = 1e-3;

/// Share above which a position is far from any singular one.
const WIDE: f64 = 0.3;

/// Squared bounds of a constraint's derivatives by the coordinates; a coordinate may come up more than once.
pub type Levers = Vec<(usize, f64)>;

/// What the rank of constraints is measured with.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metric {
    /// D, a number a column of G.
    pub columns: Vec<f64>,
    /// What pivots of A are measured against.
    pub rows: Vec<f64>,
    /// Number of constraints that depend on others everywhere.
    redundant: usize,
}

/// Which constraints depend on others at one position.
#[derive(Clone, Debug, PartialEq)]
pub struct RankVerdict {
    /// The least share, in the order of A.
    weakest: Weakest,
    /// The least share of those that are kept.
    kept: f64,
    /// The dependent ones.
    pub is_left_out: Vec<bool>,
}

impl Metric {
    /// Of constraints with these levers in so many columns.
    pub fn new(levers: &[Levers], columns: usize, redundant: usize) -> Self {
        let inverse = |most: f64| if most > 0.0 { 1.0 / most } else { 1.0 };
        let most =
            |levers: &Levers, d: &[f64]| levers.iter().fold(0.0, |most: f64, &(k, b)| most.max(b * d[k]));
        let mut d = vec![1.0; columns];
        for _ in 0..ROUNDS {
            let mut largest = vec![0.0_f64; columns];
            for levers in levers {
                let e = inverse(most(levers, &d));
                levers.iter().for_each(|&(k, b)| largest[k] = largest[k].max(e * b));
            }
            d = largest.into_iter().map(inverse).collect();
        }
        let rows = levers.iter().map(|levers| levers.iter().map(|&(k, b)| b * d[k]).sum()).collect();
        Self { columns: d, rows, redundant }
    }

    /// The verdict on constraints with this Jacobian (r × columns).
    pub fn judge<T: Real>(&self, jacobian: &[T]) -> RankVerdict {
        let (r, n) = (self.rows.len(), self.columns.len());
        let row = |i: usize| &jacobian[i * n..(i + 1) * n];
        let mut a = vec![0.0; r * r];
        for i in 0..r {
            for j in i..r {
                let products = row(i).iter().zip(row(j)).zip(&self.columns);
                a[i * r + j] = products.map(|((x, y), d)| x.value() * y.value() * d).sum();
            }
        }
        let mut shares = vec![0.0; r];
        for k in (0..r).rev() {
            let pivot = a[k * r + k];
            shares[k] = pivot / self.rows[k];
            if is_dependent(shares[k]) {
                continue;
            }
            for i in 0..k {
                let l = a[i * r + k] / pivot;
                for j in 0..=i {
                    a[j * r + i] -= l * a[j * r + k];
                }
            }
        }
        self.verdict(&shares)
    }

    /// The verdict on constraints with these shares.
    pub fn verdict(&self, shares: &[f64]) -> RankVerdict {
        let least = |weakest: Weakest, (row, &share): (usize, &f64)| {
            if share < weakest.share { Weakest { share, row, ..weakest } } else { weakest }
        };
        let is_left_out: Vec<bool> = shares.iter().map(|&share| is_dependent(share)).collect();
        let is_kept = |(row, _): &(usize, &f64)| !is_left_out[*row];
        let kept = shares.iter().enumerate().filter(is_kept).fold(Weakest::NONE, least);
        // Constraints that are redundant everywhere say nothing of the position.
        let is_singular = is_left_out.iter().filter(|&&is_left_out| is_left_out).count() > self.redundant;
        let weakest = if is_singular { shares.iter().enumerate().fold(Weakest::NONE, least) } else { kept };
        RankVerdict { weakest, kept: kept.share, is_left_out }
    }
}

/// True of a share that is too small, or no number.
fn is_dependent(share: f64) -> bool {
    share.is_nan() || share < DROPPED
}

impl RankVerdict {
    /// The least share.
    pub fn share(&self) -> f64 {
        self.weakest.share
    }

    /// The weakest constraint where S has been factored with `mass` as its own and these reciprocal pivots
    /// and scales; `again` factors it anew, without the constraints that are to be left out or, with none, as
    /// it was, and tells the least share of a pivot.
    ///
    /// Where masses do not matter much the position alone makes pivots small, and what was left out stays so.
    pub fn settle(
        &self,
        mass: Weakest,
        [pivot, scale]: [&[f64]; 2],
        mut again: impl FnMut(Option<&[bool]>) -> f64,
    ) -> Weakest {
        let is_right =
            pivot.iter().zip(&self.is_left_out).all(|(&pivot, &is_left_out)| (pivot == 0.0) == is_left_out);
        let kept = || {
            pivot
                .iter()
                .zip(scale)
                .filter(|(pivot, _)| **pivot != 0.0)
                .map(|(pivot, scale)| 1.0 / (pivot * scale))
        };
        let share =
            if is_right { kept().fold(f64::INFINITY, f64::min) } else { again(Some(&self.is_left_out)) };
        let is_delicate = share.is_nan() || share < LOSS * self.kept;
        let is_near = self.weakest.share < WIDE;
        if is_delicate || self.weakest.share >= NEAR {
            return Weakest { is_delicate, is_near, ..self.weakest };
        }
        if !is_right {
            again(None);
        }
        Weakest { is_near, ..mass }
    }
}

impl ConstraintEquation {
    /// Its levers, angles in rad; `size` \[m\] bounds what nothing else does.
    pub fn levers(&self, size: f64) -> Levers {
        let square = size * size;
        if let Some(ForceDirection::Span(span, _)) = self.push.as_ref().map(|push| &push.way) {
            let carried =
                span.shifts.iter().flat_map(|&(x, share)| [(x, share * share), (x + 1, share * share)]);
            return span.terms.iter().map(|&(k, gamma)| (k, gamma.norm_squared())).chain(carried).collect();
        }
        let place = match &self.measure {
            RowMeasure::Angle { body, base } => {
                return std::iter::once(*body).chain(*base).map(|k| (k, 1.0)).collect();
            }
            RowMeasure::Place(place) => place,
        };
        let mut levers: Levers =
            self.aim.iter().flat_map(|aim| aim.coordinates()).map(|k| (k, 1.0)).collect();
        for &(k, g) in &place.linear {
            match k < place.angles {
                true => levers.push((k, g.norm_squared())),
                false => levers.extend([(k, g.re * g.re), (k + 1, g.im * g.im)]),
            }
        }
        for &(j, k, h) in &place.bilinear {
            let h = h.norm_squared();
            for (one, other) in [(j, k), (k, j)] {
                let bound = if other < place.angles { h } else { h * square };
                levers.push((one, bound));
                levers.extend((one >= place.angles).then_some((one + 1, bound)));
            }
        }
        levers
    }
}

impl Mechanism {
    /// What the rank of its constraints is measured with.
    pub fn rank_metric(&self) -> Metric {
        let size = self.size_of_parts();
        let levers: Vec<Levers> = self.constraints.iter().map(|row| row.levers(size)).collect();
        Metric::new(&levers, self.coordinates(), self.assembly.redundant.len())
    }
}
