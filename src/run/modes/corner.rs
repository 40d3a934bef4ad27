//! Corners and jumps of forces at an equilibrium, where no linearization holds.
//!
//! ```text
//! f(d) = T' a(q0 + T y, T v),  d = (y, v)       on the branches that the laws have there
//! r(d, h) = |f(h d) - f(0) - h (T' A_q T y + T' A_w T v)| / h
//! smooth forces:  r(d, h) = O(h)                corner:  r tends to a constant,  jump:  r = O(1/h)
//! ```
//!
//! The accelerations themselves are asked, on both sides of the equilibrium, in every coordinate and rate
//! that the constraints leave, and in mixed directions: a corner is found whatever function has it.

use super::local::{Local, moving};
use super::search::EquilibriumSearch;
use crate::arithmetic::angle::GOLDEN_ANGLE;
use nalgebra::{DMatrix, DVector};

/// The distances h, of coordinates \[rad, units of length\] and of rates \[1/s of these\]: corners nearer
/// than the second are at the equilibrium.
const DISTANCES: [f64; 2] = [1e-5, 1e-6];
/// What is left at the second distance over what is at the first: a tenth of it where forces are smooth, as
/// much beside a corner.
const KEPT: f64 = 0.5;
/// What is left over the largest derivatives and accelerations where it may be what constraints are off by.
const NOTICED: f64 = 1e-5;
/// Mixed directions.
const MIXED: usize = 8;

impl EquilibriumSearch<'_> {
    /// True where the accelerations have a corner or a jump at an equilibrium, or derivatives that are not
    /// finite.  `linear`: T' A_q T and T' A_w T there, evaluated last.
    pub(super) fn is_on_corner(
        &mut self,
        phi: &[f64],
        tangent: &DMatrix<f64>,
        linear: &[DMatrix<f64>; 2],
    ) -> bool {
        let steepest = self.steepest();
        if !steepest.is_finite() || linear.iter().flat_map(DMatrix::iter).any(|entry| !entry.is_finite()) {
            return true;
        }
        let mechanism = self.local.mechanism;
        // What has no formula is smooth, but for dampers whose ends meet: their line has no direction there.
        if mechanism.laws.is_none() && mechanism.forces.is_empty() && !self.has_meeting_ends(phi) {
            return false;
        }
        let f = tangent.ncols();
        let least = NOTICED * (steepest + self.usual);
        let here = tangent.transpose() * self.local.pull(phi, 0.0);
        let mut left = |direction: &DVector<f64>, h: f64| {
            let [y, v] = [direction.rows(0, f) * h, direction.rows(f, f) * h];
            let there = self.pull_beside(phi, tangent, [&y, &v])?;
            Some(((there - &here - &linear[0] * y - &linear[1] * v) / h).amax())
        };
        directions(2 * f).iter().any(|direction| {
            let [Some(wide), Some(narrow)] = DISTANCES.map(|h| left(direction, h)) else { return false };
            !narrow.is_finite() || (narrow > least && narrow > KEPT * wide)
        })
    }

    /// True where the ends of a damper are nearer to each other than the first distance.
    fn has_meeting_ends(&mut self, phi: &[f64]) -> bool {
        let Local { mechanism, kernel, .. } = &mut self.local;
        kernel.unit_vectors::<0>(mechanism, phi);
        let near = (DISTANCES[0] * mechanism.units.length).powi(2);
        let mut dampers = mechanism.springs.iter().filter(|spring| spring.damping != 0.0);
        dampers.any(|spring| spring.span.position(&kernel.z).norm_squared() < near)
    }

    /// Accelerations along the directions of `tangent` at local coordinates and rates, with the laws on their
    /// branches there; `None` where the constraints cannot be kept.
    fn pull_beside(
        &mut self,
        phi: &[f64],
        tangent: &DMatrix<f64>,
        [y, v]: [&DVector<f64>; 2],
    ) -> Option<DVector<f64>> {
        let still = vec![0.0; phi.len()];
        let state = [self.local.moved(phi, tangent, y), self.local.moved(&still, tangent, v)];
        match self.local.mechanism.on_branches_of(&moving(&state, 0.0)).ok()? {
            Some(other) => self.on(&other).pull_moving(&state, tangent),
            None => self.pull_moving(&state, tangent),
        }
    }

    fn pull_moving(&mut self, state: &[Vec<f64>; 2], tangent: &DMatrix<f64>) -> Option<DVector<f64>> {
        let [phi, omega] = self.local.projected_moving(state)?;
        Some(tangent.transpose() * self.local.pull_moving([&phi, &omega], self.local.time))
    }
}

/// Every axis of a space and mixed directions in it, both ways, the largest entry of each at most 1.
fn directions(size: usize) -> Vec<DVector<f64>> {
    let axis = |j: usize| DVector::from_fn(size, |i, _| f64::from(u8::from(i == j)));
    let mixed =
        |k: usize| DVector::from_fn(size, |i, _| libm::sin(GOLDEN_ANGLE * ((k + 1) * (i + 1)) as f64));
    let all = (0..size).map(axis).chain((0..MIXED).map(mixed));
    all.flat_map(|direction| [-&direction, direction]).collect()
}
