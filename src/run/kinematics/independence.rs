//! How far other ways of motion are: det G and its rate along the motion.
//!
//! ```text
//! D = det G,   or det(Gᵀ G)^(1/2) with rows that depend on others;   D' = dD/dq q'
//! step:        h |D'| <= |D| / 4 at its beginning,  h |D'| <= |D| at its end, of the same sign
//! ```
//!
//! Branches that come near one another differ in the sign of D, and D falls in proportion to the distance
//! from where they would meet; from before to behind that no step goes at once, unless it is so short that
//! what is between the branches counts as nothing.  Source: the radius of convergence of Newton's method,
//! J. M. Ortega, W. C. Rheinboldt, *Iterative Solution of Nonlinear Equations in Several Variables* (1970),
//! section 12.6.

use crate::dynamics::kernel::Kernel;
use crate::dynamics::{Mechanism, Time};
use nalgebra::DMatrix;

/// From as far as this a crossing is passed in one step \[rad, units of length\].
pub(super) const ACROSS: f64 = 4e-4;
/// Share of the distance to where D would be zero that a step goes.
const SHARE: f64 = 0.25;
/// How far on the motion D is evaluated for its rate \[rad, units of length\].
const AHEAD: f64 = 1e-5;
/// Up to so many coordinates D is watched.
const WATCHED: usize = 40;

/// D at a position.
#[derive(Clone, Copy, Debug)]
pub(super) struct Independence {
    value: f64,
    /// D' \[1/s\].
    rate: f64,
}

impl Independence {
    /// From D at a position, the largest rate there, and D at times beside it on the tangent.
    pub fn new(value: f64, fastest: f64, mut beside: impl FnMut(f64) -> Option<f64>) -> Option<Self> {
        let ahead = AHEAD / fastest;
        if !ahead.is_finite() {
            return None;
        }
        let [before, after] = [beside(-ahead)?, beside(ahead)?];
        Some(Self { value, rate: (after - before) / (2.0 * ahead) })
    }

    /// The longest step from here, with the largest rate there is.
    pub fn reach(&self, fastest: f64) -> f64 {
        let (distance, near) = ((self.value / self.rate).abs(), ACROSS / fastest);
        // From beside a crossing to as far behind it, past where rows are left out.
        if distance < near { near.max(2.0 * distance) } else { near.max(SHARE * distance) }
    }

    /// True where D kept its sign on a step of `h` from another position, and has not been zero by its slope.
    pub fn follows(&self, before: &Self, h: f64) -> bool {
        self.value * before.value > 0.0 && (h * self.rate).abs() <= self.value.abs()
    }
}

/// The unit of coordinate `k` \[rad, m\].
pub(super) fn size(mechanism: &Mechanism, k: usize) -> f64 {
    if k < mechanism.bodies.len() { 1.0 } else { mechanism.units.length }
}

/// G of the rows that were evaluated last, in units of the coordinates.
pub(super) fn jacobian(mechanism: &Mechanism, kernel: &Kernel<f64>) -> DMatrix<f64> {
    let (n, rows) = (mechanism.coordinates(), mechanism.constraints.len());
    let mut matrix = DMatrix::<f64>::zeros(rows, n);
    for r in 0..rows {
        kernel.fold_gradient(r, (), |(), k, g| matrix[(r, k)] = g * size(mechanism, k));
    }
    matrix
}

/// Places at which G is compared, so far from a position \[rad, units of length\].
const PLACES: [f64; 2] = [0.3, -1.1];
/// Share of an entry of G that is rounding.
const SAME: f64 = 1e-12;

/// Which coordinates G depends on by any of its entries, or is not known not to; those of gears and racks
/// alone it does not.
pub(super) fn in_jacobian(mechanism: &Mechanism, kernel: &mut Kernel<f64>, phi: &[f64]) -> Vec<bool> {
    let n = mechanism.coordinates();
    let omega = vec![0.0; n];
    let mut at = |phi: &[f64]| {
        kernel.place(mechanism, phi);
        kernel.rows_at(mechanism, Time::default(), phi, &omega);
        jacobian(mechanism, kernel)
    };
    let here = at(phi);
    let is_in = |k: usize| {
        PLACES.iter().any(|place| {
            let mut beside = phi.to_vec();
            beside[k] += place * size(mechanism, k);
            let there = at(&beside);
            !here.iter().zip(there.iter()).all(|(a, b)| (a - b).abs() <= SAME * a.abs())
        })
    };
    (0..n).map(is_in).collect()
}

/// D of the rows that were evaluated last; none of too many coordinates, or of fewer rows.
pub(super) fn determinant(mechanism: &Mechanism, kernel: &Kernel<f64>) -> Option<f64> {
    let (n, rows) = (mechanism.coordinates(), mechanism.constraints.len());
    if rows < n || n > WATCHED {
        return None;
    }
    let matrix = jacobian(mechanism, kernel);
    if rows == n {
        return Some(matrix.lu().determinant());
    }
    Some((matrix.transpose() * matrix).lu().determinant().max(0.0).sqrt())
}
