//! The noise of columns for which nobody says: found from the residuals, where these tell it.
//!
//! ```text
//! σ_c² = Σ r_i² / (n_c - Σ h_ii)      i of column c,  H = J (JᵀJ)⁻¹ Jᵀ of weighted rows,  until it stays
//! F_cd = Σ R_ij²      i of column c, j of column d,  R = I - H
//! f_c = 1/(F⁻¹)_cc    degrees of freedom that tell σ_c, whatever the noise of the others is
//! ```
//!
//! F/2 is the information on the logarithms of the variances (restricted maximum likelihood): of a single
//! column F is its degrees of freedom.  Where F is singular, the estimates above hold for a whole range of
//! noises: two columns with one row each that tell one number have a single residual, which any ratio of
//! their noises explains.
//!
//! Source: H. D. Patterson, R. Thompson, *Recovery of inter-block information when block sizes are unequal*,
//! Biometrika 58 (1971).

use super::super::extremes::ExtremesDetector;
use super::super::sensitivity::Study;
use super::FittedColumn;
use nalgebra::{DMatrix, SymmetricEigen};

/// Share of a column's spread taken for its noise where nobody says, to begin with and at least.
const SPREAD: [f64; 2] = [1e-2, 1e-10];
/// Least spread a column counts with, over what it changes by in one unit of a coordinate or rate.
const KEPT: f64 = 1e-3;
/// What noise changes by once it stays.
const STEADY: f64 = 1e-3;
/// Rows of a column that are left beside the numbers it tells, at least.
const LEFT: f64 = 1e-3;
/// Degrees of freedom that tell the noise of a column, at least: a single row beside many of another column
/// has a little less than one.
const TELLING: f64 = 0.5;
/// Eigenvalues up to this share of the largest are rounding.
const ROUNDING: f64 = 1e-12;

/// What the noise of columns is measured by: their spread, or where constraints keep them in one place, for
/// the rounding of values there not to outweigh all others, a part of what a unit of a coordinate changes.
pub(super) fn sizes(study: &Study, indices: &[usize], columns: &[FittedColumn]) -> Vec<f64> {
    let detector = ExtremesDetector::new(&study.mechanism);
    let changes = detector.map(|mut detector| detector.changes(&study.start)).unwrap_or_default();
    let change = |index: &usize| changes.get(*index).copied().filter(|change| change.is_finite());
    let size = |(index, column): (&usize, &FittedColumn)| {
        let size = spread(&column.measured).max(KEPT * change(index).unwrap_or_default());
        if size > 0.0 { size } else { 1.0 }
    };
    indices.iter().zip(columns).map(size).collect()
}

/// Begins with a share of the spread.
pub(super) fn guess(columns: &mut [FittedColumn], sizes: &[f64]) {
    for (column, size) in columns.iter_mut().zip(sizes).filter(|(column, _)| !column.is_given) {
        column.sigma = if column.count() == 0 { f64::NAN } else { SPREAD[0] * size };
    }
}

/// True of a column whose noise the residuals are to tell.
fn is_open(column: &FittedColumn) -> bool {
    !column.is_given && column.count() > 0
}

/// Finds the noise of columns for which nobody says, from what the residuals leave beside the numbers that
/// they tell; returns those whose noise is not yet what the fit was weighted with.
pub(super) fn estimate(columns: &mut [FittedColumn], sizes: &[f64], told: &[DMatrix<f64>]) -> Vec<String> {
    let mut moving = Vec::new();
    for ((column, size), told) in columns.iter_mut().zip(sizes).zip(told).filter(|((c, _), _)| is_open(c)) {
        let squares = column.residuals().map(|residual| residual * residual).sum::<f64>();
        let left = (column.count() as f64 - told.trace()).max(LEFT);
        let sigma = (squares / left).sqrt().max(SPREAD[1] * size);
        if (sigma / column.sigma - 1.0).abs() > STEADY {
            moving.push(column.name.clone());
        }
        column.sigma = sigma;
    }
    moving
}

/// The columns whose noise the residuals do not tell.
pub(super) fn untold(columns: &[FittedColumn], told: &[DMatrix<f64>]) -> Vec<String> {
    let open: Vec<usize> = (0..columns.len()).filter(|&k| is_open(&columns[k])).collect();
    if open.is_empty() {
        return Vec::new();
    }
    let information = DMatrix::from_fn(open.len(), open.len(), |i, j| {
        let (a, b) = (&told[open[i]], &told[open[j]]);
        let own = if i == j { columns[open[i]].count() as f64 - 2.0 * a.trace() } else { 0.0 };
        own + a.dot(b)
    });
    let SymmetricEigen { eigenvalues, eigenvectors } = information.symmetric_eigen();
    let least = ROUNDING * eigenvalues.amax().max(1.0);
    let variance = |i: usize| {
        let shares = (0..open.len()).map(|k| eigenvectors[(i, k)].powi(2) / eigenvalues[k].max(least));
        shares.sum::<f64>()
    };
    // As many noises as degrees of freedom are solved for like unknowns of equations, with nothing left to
    // average over, and the solution may be a noise of zero: where there are several, one more is needed.
    let rows: f64 = columns.iter().map(|column| column.count() as f64).sum();
    let freedom = rows - told.iter().map(DMatrix::trace).sum::<f64>();
    let needed = open.len() + usize::from(open.len() > 1);
    let is_short = freedom < needed as f64 - TELLING;
    let is_untold = |i: &usize| is_short || variance(*i) * TELLING > 1.0;
    (0..open.len()).filter(is_untold).map(|i| columns[open[i]].name.clone()).collect()
}

/// Root mean square about the mean.
pub(super) fn spread(values: &[Option<f64>]) -> f64 {
    let count = values.iter().flatten().count().max(1) as f64;
    let mean = values.iter().flatten().sum::<f64>() / count;
    (values.iter().flatten().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
}
