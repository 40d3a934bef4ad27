//! The first step, and how long steps may be where something grows.
//!
//! ```text
//! |R(h lambda)| -> 0 as h |lambda| -> infinity, for Re lambda > 0 too:    h |lambda| <= 1/(2 mu_0)
//!     for every eigenvalue lambda of J with Re lambda > |lambda|/10;      1/mu_0 is the real pole of R
//! det(1 - h mu_0 J) < 0 where an odd number of real eigenvalues are beyond that pole
//! ```
//!
//! Beyond the poles of R a step damps what grows, and the filter of the error estimate hides that it does.

use super::{QUOTIENT, Radau, SAFE};
use crate::dynamics::{OdeSystem, State};
use crate::stepping::{Cause, NOT_FINITE, StepError};
use nalgebra::linalg::Schur;
use nalgebra::{DMatrix, linalg::balancing::balance_parlett_reinsch};

/// Share of its size by which an eigenvalue grows that is to be resolved: others oscillate.
const GROWS: f64 = 0.1;
/// Eigenvalues below this share of the largest are rounding.
const ROUNDING: f64 = 1e-7;

impl Radau {
    /// A first step from the sizes of unknowns and rates; the error estimate corrects it.
    pub(super) fn first_step(&self, state: &State, span: f64, short: f64) -> f64 {
        let norm = |x: &[f64]| {
            x.iter().zip(&self.work.scale).map(|(x, scale)| (x / scale) * (x / scale)).sum::<f64>().sqrt()
        };
        let guess = 0.01 * norm(&state.y) / norm(&self.work.start);
        if guess.is_finite() && guess > 0.0 { guess.min(span) } else { span.min(short) }
    }

    /// The exponent of the error, and what that divides the next step by after so many iterations.
    pub(super) fn quotient(&self, error: f64, sweeps: usize) -> (f64, f64) {
        let exponent = 1.0 / (self.tableau.stages() as f64 + 1.0);
        let most = if self.tableau.stages() == 3 { 7.0 } else { 12.0 };
        let factor = SAFE.min(SAFE * (1.0 + 2.0 * most) / (sweeps as f64 + 2.0 * most));
        (exponent, (libm::pow(error, exponent) / factor).clamp(QUOTIENT[0], QUOTIENT[1]))
    }

    /// Why no shorter step is tried: the last ones were not finite, or their errors were too large.
    pub(super) fn too_short<F: OdeSystem + ?Sized>(
        &self,
        field: &F,
        state: &State,
        h: f64,
        is_cut: bool,
    ) -> StepError {
        if is_cut {
            let what = format!("{} is not finite", self.culprit(field));
            return self.stop(Cause::NotFinite, state, h, what, NOT_FINITE);
        }
        let what = format!("{} asks for ever smaller steps", self.culprit(field));
        let hint = "loosen the tolerance: forces of stiff springs have a rounding of their own";
        self.stop(Cause::StepTooSmall, state, h, what, hint)
    }

    /// The step to take \[s\] where `h` is too long for what grows. All eigenvalues are computed where forces
    /// may feed modes by their rates, elsewhere only where the factors tell that one is beyond the pole.
    pub(super) fn shortened_by_growth(&mut self, may_grow_by_rates: bool, h: f64) -> Option<f64> {
        let Self { tableau, work, .. } = self;
        let is_stiff = || h * size(&work.jacobian) * tableau.real.value > 0.5;
        if !(work.real.is_negative() || may_grow_by_rates && is_stiff()) {
            return None;
        }
        let longest = *work.longest.get_or_insert_with(|| {
            0.5 / (tableau.real.value * fastest_growth(&work.jacobian, work.mode.len()))
        });
        (h > longest * (1.0 + 1e-9)).then_some(longest)
    }
}

/// Bound of the eigenvalues of a matrix.
fn size(matrix: &[f64]) -> f64 {
    matrix.iter().map(|entry| entry * entry).sum::<f64>().sqrt()
}

/// The largest of the eigenvalues that grow of a matrix (d × d, row by row); zero where none does.
fn fastest_growth(matrix: &[f64], d: usize) -> f64 {
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return 0.0;
    }
    let mut matrix = DMatrix::from_row_slice(d, d, matrix);
    balance_parlett_reinsch(&mut matrix);
    let Some(schur) = Schur::try_new(matrix, f64::EPSILON, 10_000) else { return 0.0 };
    let sizes = schur.complex_eigenvalues().map(|value| [value.re, libm::hypot(value.re, value.im)]);
    let least = ROUNDING * sizes.iter().fold(0.0, |most: f64, [_, size]| most.max(*size));
    let grows = sizes.iter().filter(|[growth, size]| *growth > GROWS * size && *size > least);
    grows.fold(0.0, |most: f64, [_, size]| most.max(*size))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// J of x'' = a x + b x' in two copies that share nothing, with a work integral beside them.
    fn of_modes(modes: [[f64; 2]; 2]) -> Vec<f64> {
        let mut matrix = vec![0.0; 25];
        for (k, [a, b]) in modes.into_iter().enumerate() {
            matrix[5 * k + 2 + k] = 1.0;
            (matrix[5 * (2 + k) + k], matrix[5 * (2 + k) + 2 + k]) = (a, b);
            matrix[20 + 2 + k] = 1e3;
        }
        matrix
    }

    /// lambda² = a + b lambda by hand.
    #[test]
    fn what_grows_is_found_beside_what_decays_and_oscillates() {
        for (modes, expected) in [
            // Fed, beside a stiff damper; twice, where no determinant changes its sign.
            ([[0.0, 3e8], [0.0, -1e10]], 3e8),
            ([[0.0, 3e8], [0.0, 3e8]], 3e8),
            // A saddle, and a pair that grows while it oscillates: |lambda|² = 1e8.
            ([[4e6, 0.0], [-9.0, -1.0]], 2e3),
            ([[-1e8, 1e4], [-1e6, -1e3]], 1e4),
            // Nothing grows, or by less than a tenth of its size.
            ([[-1e16, -1e4], [-10.0, 0.0]], 0.0),
            ([[-1e8, 1e2], [0.0, -1e6]], 0.0),
        ] {
            let found = fastest_growth(&of_modes(modes), 5);
            assert!((found - expected).abs() <= 1e-6 * expected, "{modes:?}: {found}");
        }
    }
}
