//! What rows whose aims speak of points push the bodies there with: gears, cams, walls that follow.
//!
//! ```text
//! power m of the force that a body needs against a row:  Σ_{l=0..m} F_m-l lambda_l,    F = -df/dP
//! ```

use super::super::coefficient::{SeriesNumber, Terms};
use super::super::factors::Scale;
use super::super::rows::RowSeries;
use super::super::user::{PowersAt, UserSeries};
use crate::arithmetic::Complex;
use crate::dynamics::force::UserForce;

/// The series of F of all rows that have one.
#[derive(Clone, Debug)]
pub struct PointForces<T: SeriesNumber>(Vec<(usize, UserSeries<T>)>);

/// F of a row.
fn of_row<'a, C>(terms: &Terms<'a, C>, row: usize) -> Option<&'a UserForce<C>> {
    terms.constraints[row].aim.as_ref().and_then(|aim| aim.at_points.as_deref())
}

impl<T: SeriesNumber> PointForces<T> {
    /// Room for powers up to `order`.
    pub fn new(terms: &Terms<T::Constant>, order: usize) -> Self {
        let series = |row| of_row(terms, row).map(|force| (row, UserSeries::new(force, order)));
        Self((0..terms.constraints.len()).filter_map(series).collect())
    }

    /// Finds power m of F, from the powers up to m of the motion's elements.
    pub fn advance(&mut self, terms: &Terms<T::Constant>, m: usize, at: PowersAt<T>, scale: &Scale<T>) {
        for (row, series) in &mut self.0 {
            if let Some(force) = of_row(terms, *row) {
                series.advance(force, m, at, scale);
            }
        }
    }

    /// Adds power m of what the bodies need against all rows with these multipliers.
    pub fn add(&self, terms: &Terms<T::Constant>, m: usize, rows: &RowSeries<T>, needed: &mut [Complex<T>]) {
        for (row, series) in &self.0 {
            let Some(force) = of_row(terms, *row) else { continue };
            for l in 0..=m {
                let multiplier = rows.multipliers(l)[*row];
                series.forces(force, m - l, |body, force| needed[body] += force.times(multiplier));
            }
        }
    }
}
