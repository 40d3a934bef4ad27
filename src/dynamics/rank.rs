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
//! are those that have no pivot in S.  Of redundant constraints those that are kept so may be singular among
//! themselves at a position where all together are not: there the largest share is the next pivot, and what A
//! finds dependent is left out of S.
//!
//! Bounds of slopes of gears and cams are what they come to over a turn, and those of sliders the size of the
//! parts; where the mechanism goes far beyond them, they are what is found there.  Ratios of gears couple
//! parts of a mechanism by numbers of any size: with such constraints D begins at the d that make all
//! e_r b_rk d_k as nearly equal as they can be, in the least squares of their logarithms.  Source: A. R.
//! Curtis, J. K. Reid, IMA J. Appl. Math. 10 (1972).

use super::Mechanism;
use super::constraint::{ConstraintEquation, ForceDirection, RowMeasure};
use super::schur::{DROPPED, NEAR, Weakest};
use crate::arithmetic::Real;
use std::borrow::Cow;

/// Shares below this are rounding: such a constraint depends on others for as long as it acts, as those of
/// places that stick side by side do, and says nothing of what is ahead.
const PERMANENT: f64 = 1e-13;
/// Rounds of the scaling.
const ROUNDS: usize = 4;
/// Pivots of S below this part of those of A owe it to masses and levers: so many digits are lost to them.
const LOSS: f64 = 1e-3;

/// Rounds of the scaling it begins with where ratios couple the columns.
const EVEN_ROUNDS: usize = 32;
/// What is known of a derivative's square may be exceeded so many times before it is replaced.
const BEYOND: f64 = 100.0;

/// Number of constraints up to which those that are kept of redundant ones are chosen by position.
const PIVOTED: usize = 100;

/// Share above which a position is far from any singular one.
const WIDE: f64 = 0.3;

/// Squared bounds of a constraint's derivatives by the coordinates; a coordinate may come up more than once.
pub type Levers = Vec<(usize, f64)>;

/// The levers of all constraints.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bounds {
    levers: Vec<Levers>,
    /// The constraints whose derivatives are not bounded by their levers.
    open: Vec<usize>,
    /// True where some are gears or cams.
    has_ratios: bool,
}

/// What the rank of constraints is measured with.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metric {
    bounds: Bounds,
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
    /// True where the largest pivots tell them, and not the order.
    is_pivoted: bool,
    /// True where some are dependent everywhere.
    has_redundant: bool,
}

impl Metric {
    /// Of constraints with these bounds in so many columns.
    pub fn new(bounds: Bounds, columns: usize, redundant: usize) -> Self {
        let most =
            |levers: &Levers, d: &[f64]| levers.iter().fold(0.0, |most: f64, &(k, b)| most.max(b * d[k]));
        let mut d = if bounds.has_ratios { bounds.even(columns) } else { vec![1.0; columns] };
        for _ in 0..ROUNDS {
            let mut largest = vec![0.0_f64; columns];
            for levers in &bounds.levers {
                let e = inverse(most(levers, &d));
                levers.iter().for_each(|&(k, b)| largest[k] = largest[k].max(e * b));
            }
            d = largest.into_iter().map(inverse).collect();
        }
        let rows = bounds.levers.iter().map(|levers| levers.iter().map(|&(k, b)| b * d[k]).sum()).collect();
        Self { bounds, columns: d, rows, redundant }
    }

    /// The metric of a position with these derivatives, constraint by constraint, where they are far beyond
    /// their bounds.
    pub fn beyond<I: Iterator<Item = (usize, f64)>>(&self, gradient: impl Fn(usize) -> I) -> Cow<'_, Self> {
        let mut bounds = Cow::Borrowed(&self.bounds);
        for &r in &self.bounds.open {
            for (k, g) in gradient(r) {
                let known = self.bounds.levers[r].iter().filter(|lever| lever.0 == k);
                let most = known.fold(0.0, |most: f64, lever| most.max(lever.1));
                if g * g > BEYOND * most && (g * g).is_finite() {
                    bounds.to_mut().levers[r].push((k, g * g));
                }
            }
        }
        match bounds {
            Cow::Borrowed(_) => Cow::Borrowed(self),
            Cow::Owned(bounds) => Cow::Owned(Self::new(bounds, self.columns.len(), self.redundant)),
        }
    }

    /// The metric of the first constraints alone, so many of them.
    pub fn first(&self, rows: usize) -> Self {
        let mut metric = self.clone();
        metric.bounds.levers.truncate(rows);
        metric.bounds.open.retain(|&row| row < rows);
        metric.rows.truncate(rows);
        metric
    }

    /// The verdict on constraints with this Jacobian (r × columns).
    pub fn judge<T: Real>(&self, jacobian: &[T]) -> RankVerdict {
        let (r, n) = (self.rows.len(), self.columns.len());
        let row = |i: usize| &jacobian[i * n..(i + 1) * n];
        let metric = self.beyond(|i| row(i).iter().map(|g| g.value()).enumerate());
        let mut a = vec![0.0; r * r];
        for i in 0..r {
            for j in i..r {
                let products = row(i).iter().zip(row(j)).zip(&metric.columns);
                a[i * r + j] = products.map(|((x, y), d)| x.value() * y.value() * d).sum();
                a[j * r + i] = a[i * r + j];
            }
        }
        if self.redundant == 0 {
            return self.verdict(&shares(a, &metric.rows, false));
        }
        let verdict = self.verdict(&shares(a.clone(), &metric.rows, false));
        if self.is_open(&verdict) { self.pivoted(a, &metric.rows) } else { verdict }
    }

    /// True of a verdict in the order of S that leaves open whether the position is near a singular one:
    /// other constraints could be kept.
    pub fn is_open(&self, verdict: &RankVerdict) -> bool {
        self.redundant > 0 && verdict.kept < NEAR && self.rows.len() <= PIVOTED
    }

    /// The verdict on constraints with this A, both its halves, whose pivots are measured against `rows`, by
    /// the largest pivots.
    pub fn pivoted(&self, a: Vec<f64>, rows: &[f64]) -> RankVerdict {
        RankVerdict { is_pivoted: true, ..self.verdict(&shares(a, rows, true)) }
    }

    /// The verdict on constraints with these shares.
    pub fn verdict(&self, shares: &[f64]) -> RankVerdict {
        let least = |weakest: Weakest, (row, &share): (usize, &f64)| {
            if share < weakest.share { Weakest { share, row, ..weakest } } else { weakest }
        };
        let is_left_out: Vec<bool> = shares.iter().map(|&share| is_dependent(share)).collect();
        let is_kept = |(row, _): &(usize, &f64)| !is_left_out[*row];
        let kept = shares.iter().enumerate().filter(is_kept).fold(Weakest::NONE, least);
        // Constraints that are redundant everywhere say nothing of the position: their shares are the least.
        let is_singular = is_left_out.iter().filter(|&&is_left_out| is_left_out).count() > self.redundant;
        let weakest = match is_singular {
            true => {
                let size = |&row: &usize| if shares[row].is_nan() { f64::INFINITY } else { shares[row] };
                let mut rows: Vec<usize> = (0..shares.len()).collect();
                rows.sort_by(|one, other| size(one).total_cmp(&size(other)));
                rows.get(self.redundant).map_or(kept, |row| least(Weakest::NONE, (*row, &shares[*row])))
            }
            false => kept,
        };
        let has_redundant = self.redundant > 0;
        RankVerdict { weakest, kept: kept.share, is_left_out, is_pivoted: false, has_redundant }
    }
}

/// The shares of constraints with this A, both its halves, whose pivots are measured against `rows`; the next
/// pivot is that of the largest share, or the last one.
fn shares(mut a: Vec<f64>, rows: &[f64], is_pivoted: bool) -> Vec<f64> {
    let r = rows.len();
    let mut shares = vec![0.0; r];
    let mut left: Vec<usize> = (0..r).collect();
    while !left.is_empty() {
        let share = |i: usize| a[i * r + i] / rows[i];
        let size = |at: usize| share(left[at]).max(0.0);
        let largest = || (0..left.len()).max_by(|&i, &j| size(i).total_cmp(&size(j))).unwrap_or(0);
        let at = if is_pivoted { largest() } else { left.len() - 1 };
        let k = left.remove(at);
        shares[k] = a[k * r + k] / rows[k];
        if is_dependent(shares[k]) {
            continue;
        }
        for (place, &i) in left.iter().enumerate() {
            let l = a[k * r + i] / a[k * r + k];
            for &j in &left[..=place] {
                a[j * r + i] -= l * a[j * r + k];
                a[i * r + j] = a[j * r + i];
            }
        }
    }
    shares
}

/// One over it, and 1 of nothing.
fn inverse(most: f64) -> f64 {
    if most > 0.0 { 1.0 / most } else { 1.0 }
}

impl Bounds {
    /// Of these constraints; `size` \[m\] bounds what nothing else does, and `column` tells where a
    /// coordinate is.
    pub fn new<'a>(
        rows: impl Iterator<Item = &'a ConstraintEquation>,
        size: f64,
        column: impl Fn(usize) -> Option<usize>,
    ) -> Self {
        let mut bounds = Self::default();
        for (r, row) in rows.enumerate() {
            let levers = row.levers(size).into_iter();
            bounds.levers.push(levers.filter_map(|(k, b)| Some((column(k)?, b))).collect());
            bounds.has_ratios |= row.aim.is_some();
            if !row.is_bounded() {
                bounds.open.push(r);
            }
        }
        bounds
    }

    /// D with which all entries are about one.
    fn even(&self, columns: usize) -> Vec<f64> {
        let logs: Vec<Levers> = (self.levers.iter())
            .map(|levers| {
                levers.iter().filter(|lever| lever.1 > 0.0).map(|&(k, b)| (k, libm::log2(b))).collect()
            })
            .collect();
        let mut d = vec![0.0; columns];
        for _ in 0..EVEN_ROUNDS {
            let mut sums = vec![(0.0, 0.0); columns];
            for levers in &logs {
                let sum: f64 = levers.iter().map(|&(k, b)| b + d[k]).sum();
                let e = sum / levers.len().max(1) as f64;
                for &(k, b) in levers {
                    sums[k].0 += e - b;
                    sums[k].1 += 1.0;
                }
            }
            d = sums.into_iter().map(|(sum, count): (f64, f64)| sum / count.max(1.0)).collect();
        }
        d.into_iter().map(libm::exp2).collect()
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

    /// The constraint of the least share.
    pub fn weakest(&self) -> Weakest {
        self.weakest
    }

    /// The least share of the constraints that are not left out.
    pub fn kept(&self) -> f64 {
        self.kept
    }

    /// The least share but for constraints that depended on others at the first position of a way already,
    /// and still do.
    pub fn share_since(&self, first: &Self) -> f64 {
        let is_as_ever = first.share() < PERMANENT && self.is_left_out == first.is_left_out;
        if is_as_ever { self.kept() } else { self.share() }
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
        if is_delicate || self.weakest.share >= NEAR || self.is_pivoted {
            return Weakest { is_delicate, is_near, ..self.weakest };
        }
        if !is_right {
            again(None);
        }
        // The least of all pivots may be that of a constraint that is redundant everywhere.
        Weakest { is_near, ..if self.has_redundant { self.weakest } else { mass } }
    }
}

impl ConstraintEquation {
    /// True where its derivatives are no larger than its levers wherever the mechanism goes.
    fn is_bounded(&self) -> bool {
        let RowMeasure::Place(place) = &self.measure else { return true };
        let is_rod = self.push.as_ref().is_some_and(|push| matches!(push.way, ForceDirection::Span(..)));
        let travels = place.bilinear.iter().any(|&(j, k, _)| j.max(k) >= place.angles);
        is_rod || (self.aim.is_none() && !travels)
    }

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
        let mut levers: Levers = self
            .aim
            .iter()
            .flat_map(|aim| aim.slope_sizes(size))
            .map(|(k, slope)| (k, slope * slope))
            .collect();
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
        let bounds = Bounds::new(self.constraints.iter(), size, Some);
        Metric::new(bounds, self.coordinates(), self.assembly.redundant.len())
    }
}
