//! What violations of constraints are measured against.
//!
//! ```text
//! position:  |C| <= tolerance · lever
//!            or the rounding of its terms,  16 ε (Σ |terms of Q| + Σ |f_k q_k|)
//! velocity:  |C'| <= tolerance · max |G_k w_k|
//! ```
//!
//! Angles of gears grow without bound, and so do places far from the origin: what is left of a row is
//! rounding of these, not of its levers.

use crate::arithmetic::Complex;
use crate::dynamics::constraint::{ConstraintArguments, RowMeasure};
use crate::dynamics::kernel::Kernel;
use crate::dynamics::schur::DROPPED;
use crate::dynamics::{Mechanism, State};

/// Violation, relative to levers and speeds, that a row left out may have.
const LEFT_OUT: f64 = 1e-6;
/// Violation over the sum of a row's terms that is their rounding.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// The unit of coordinate `k` \[rad, m\].
pub(in crate::stabilization) fn size(mechanism: &Mechanism, k: usize) -> f64 {
    if k < mechanism.bodies.len() { 1.0 } else { mechanism.units.length }
}

/// The unit of row `r` \[rad, m\].
pub(crate) fn unit(mechanism: &Mechanism, r: usize) -> f64 {
    if mechanism.constraints[r].is_angle() { 1.0 } else { mechanism.units.length }
}

/// The longest lever of row `r`, or its unit.
fn lever(mechanism: &Mechanism, kernel: &Kernel<f64>, r: usize) -> f64 {
    kernel.fold_gradient(r, unit(mechanism, r), |most: f64, k, g| most.max(g.abs() * size(mechanism, k)))
}

/// The sum of the magnitudes of row `r`'s terms at a state whose elements `kernel` has.
fn terms(mechanism: &Mechanism, kernel: &Kernel<f64>, state: &State, r: usize) -> f64 {
    let (n, row) = (mechanism.coordinates(), &mechanism.constraints[r]);
    let phi = &state.y[..n];
    let measured = match &row.measure {
        RowMeasure::Angle { body, base } => phi[*body].abs() + base.map_or(0.0, |base| phi[base].abs()),
        RowMeasure::Place(place) => {
            let length = |x: Complex<f64>| x.norm_squared().sqrt();
            let size = |k: usize| if k < place.angles { 1.0 } else { length(kernel.z[k]) };
            let linear = place.linear.iter().map(|&(k, g)| length(g) * size(k));
            let bilinear = place.bilinear.iter().map(|&(j, k, h)| length(h) * size(j) * size(k));
            place.constant.abs() + linear.chain(bilinear).sum::<f64>()
        }
    };
    let at = ConstraintArguments { phi, z: &kernel.z, omega: &state.y[n..2 * n] };
    row.aim.iter().fold(measured, |sum, aim| sum + aim.terms(state.time, at))
}

/// The largest part of the rate of row `r`, or its unit over that of time: a row's rate is a sum of G_k w_k,
/// and no smaller than their rounding.
pub(super) fn step_size(mechanism: &Mechanism, kernel: &Kernel<f64>, omega: &[f64], r: usize) -> f64 {
    let least = kernel.rows[r].drive.abs().max(unit(mechanism, r) / mechanism.units.time);
    kernel.fold_gradient(r, least, |most, k, g| most.max((g * omega[k]).abs()))
}

/// Every row must be kept at both levels, as [`Kernel::linearise`] found them at this state.
///
/// # Errors
/// Name of the first row that is not, and its violation.
pub(in crate::stabilization) fn is_kept(
    mechanism: &Mechanism,
    kernel: &Kernel<f64>,
    state: &State,
    tolerance: f64,
) -> Result<(), (String, f64)> {
    is_position_kept(mechanism, kernel, state, tolerance)?;
    is_rate_kept(mechanism, kernel, state, tolerance)
}

/// [`is_kept`] for positions.
pub(super) fn is_position_kept(
    mechanism: &Mechanism,
    kernel: &Kernel<f64>,
    state: &State,
    tolerance: f64,
) -> Result<(), (String, f64)> {
    check(mechanism, kernel, tolerance, |r| {
        let terms = move || terms(mechanism, kernel, state, r);
        (kernel.rows[r].position, lever(mechanism, kernel, r), terms)
    })
}

/// [`is_kept`] for rates.
pub(super) fn is_rate_kept(
    mechanism: &Mechanism,
    kernel: &Kernel<f64>,
    state: &State,
    tolerance: f64,
) -> Result<(), (String, f64)> {
    let omega = &state.y[mechanism.coordinates()..2 * mechanism.coordinates()];
    check(mechanism, kernel, tolerance, |r| {
        (kernel.row_rate(r, omega), step_size(mechanism, kernel, omega, r), || 0.0)
    })
}

/// The worst row must be below tolerance, each measured against its own size, or at the rounding of its
/// terms.  Near a singular position rounding grows with the inverse of the distance, of which the share of
/// the weakest row is about the square; rows left out there are not projected, and come back once it is past.
fn check<F: Fn() -> f64>(
    mechanism: &Mechanism,
    kernel: &Kernel<f64>,
    tolerance: f64,
    violation: impl Fn(usize) -> (f64, f64, F),
) -> Result<(), (String, f64)> {
    let near = kernel.weakest.share.clamp(DROPPED, 1.0).sqrt();
    for (r, row) in mechanism.constraints.iter().enumerate() {
        let tolerance = if kernel.is_left_out(r) { tolerance.max(LEFT_OUT) } else { tolerance / near };
        let (violation, size, terms) = violation(r);
        let violation = violation.abs();
        let is_small = violation <= tolerance * size || violation <= ROUNDING * terms() / near;
        if !is_small {
            return Err((row.name().into(), violation));
        }
    }
    Ok(())
}
