//! The velocity level of a projection.

use super::shift;
use super::sizes::{is_rate_kept, size, step_size};
use crate::arithmetic::sum::larger;
use crate::dynamics::kernel::Kernel;
use crate::dynamics::schur::DROPPED;
use crate::dynamics::{Mechanism, State, tree};

/// Takes off the rates of `N` bodies (any number where `N` is 0) what violates a row, by the factors and rows
/// that `kernel` has; returns by how much they changed, over the largest of them, where they did.
///
/// One solution brings them to rounding where M and S are those of the place.  What these are behind it, up
/// to the turns that need no new ones, leaves as much of the violation: a second one takes that off.
///
/// # Errors
/// Name of the worst row and its violation where it cannot be brought below `tolerance`.
pub(super) fn project_rates<const N: usize>(
    mechanism: &Mechanism,
    kernel: &mut Kernel<f64>,
    state: &mut State,
    tolerance: f64,
) -> Result<Option<f64>, (String, f64)> {
    let n = tree::size::<N>(mechanism.coordinates());
    let (mut last, mut enough) = (f64::INFINITY, 2.0 * f64::EPSILON);
    let mut changed = None;
    loop {
        let mut fast = 0.0;
        for r in 0..mechanism.constraints.len() {
            let omega = &state.y[n..2 * n];
            kernel.multiplier[r] = kernel.row_rate(r, omega);
            if !kernel.is_left_out(r) {
                fast = larger(fast, kernel.multiplier[r].abs() / step_size(mechanism, kernel, omega, r));
            }
        }
        // Of what is not finite one solution says so.
        if fast <= enough || fast >= 0.5 * last || last.is_nan() {
            break;
        }
        (last, enough) = (fast, tolerance / kernel.weakest.share.clamp(DROPPED, 1.0).sqrt());
        kernel.solve_rows();
        let change = shift(mechanism, kernel, state, n, -1.0);
        let rates = state.y[n..2 * n].iter().enumerate();
        let most = rates.fold(1.0 / mechanism.units.time, |most: f64, (k, omega)| {
            most.max(omega.abs() / size(mechanism, k))
        });
        changed = Some(larger(changed.unwrap_or(0.0), change / most));
    }
    if changed.is_some() {
        is_rate_kept(mechanism, kernel, state, tolerance)?;
    }
    Ok(changed)
}
