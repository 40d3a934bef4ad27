//! The constraints of an evaluation: their Jacobian, the Schur complement S = G M⁻¹ Gᵀ, and the multipliers.

use super::{Bias, Kernel, dot};
use crate::arithmetic::Real;
use crate::dynamics::constraint::ConstraintArguments;
use crate::dynamics::schur::{self, NEAR};
use crate::dynamics::tree::{self, size};
use crate::dynamics::{Mechanism, Time};

impl<T: Real> Kernel<T> {
    /// The share of `R` rows (any number where `R` is 0): expects free accelerations in `load` and the
    /// factors of M.
    #[inline(always)]
    pub(super) fn constrain<const N: usize, const R: usize>(
        &mut self,
        mechanism: &Mechanism,
        t: Time,
        phi: &[T],
        omega: &[T],
        bias: Bias,
    ) {
        let (n, rows) = (size::<N>(mechanism.tree.coordinates), size::<R>(mechanism.constraints.len()));
        if let Some(vibration) = &mechanism.vibration {
            self.vibrate::<N>(mechanism, vibration);
        }
        let is_biased = bias != Bias::default();
        let configuration = ConstraintArguments { phi, z: &self.z[..n], omega };
        let (all, multiplier, correction) =
            (&mut self.jacobian[..rows * n], &mut self.multiplier[..rows], &mut self.correction[..rows]);
        let load = &mut self.load[..n];
        for r in 0..rows {
            let (row, jacobian) = (&mechanism.constraints[r], &mut all[r * n..(r + 1) * n]);
            for k in 0..n {
                jacobian[k] = T::ZERO;
            }
            // Only a bias asks for C.
            let here = if is_biased {
                row.linearise(t, configuration, jacobian)
            } else {
                row.differentiate(t, configuration, jacobian)
            };
            multiplier[r] = dot(jacobian, load) + here.convective;
            correction[r] = T::ZERO;
            if is_biased {
                correction[r] =
                    (dot(jacobian, omega) + here.drive).scale(bias.rate) + here.position.scale(bias.position);
                multiplier[r] += correction[r];
            }
            self.rows[r] = here;
        }
        self.schur_complement::<N, R>(n, rows);
        tree::solve::<T, R>(rows, &self.schur, &self.schur_pivot, &mut self.multiplier);
        if is_biased {
            tree::solve::<T, R>(rows, &self.schur, &self.schur_pivot, &mut self.correction);
        }
        let (minv_jt, load) = (&self.minv_jt[..rows * n], &mut self.load[..n]);
        for r in 0..rows {
            for k in 0..n {
                load[k] -= minv_jt[r * n + k] * self.multiplier[r];
            }
        }
    }

    /// C, G, C_t, gamma of every row, and the factors of S = G M⁻¹ Gᵀ; expects the factors of M.
    pub fn linearise<const N: usize>(&mut self, mechanism: &Mechanism, t: Time, phi: &[T], omega: &[T]) {
        self.rows_at(mechanism, t, phi, omega);
        if let Some(bodywise) = &mut self.bodywise {
            self.weakest = bodywise.factor_constraints();
        } else {
            self.schur_complement::<N, 0>(size::<N>(mechanism.tree.coordinates), mechanism.constraints.len());
        }
        self.linearise_exactly(mechanism, t, phi, omega);
    }

    /// The same at other coordinates than the last: elements, M and its factors first.
    pub fn linearise_at<const N: usize>(&mut self, mechanism: &Mechanism, t: Time, phi: &[T], omega: &[T]) {
        self.unit_vectors::<N>(mechanism, phi);
        self.mass_matrix::<N>(mechanism);
        self.factor::<N>(mechanism, omega);
        self.linearise::<N>(mechanism, t, phi, omega);
    }

    /// C, G, C_t, gamma of every row, and nothing else.
    pub fn rows_at(&mut self, mechanism: &Mechanism, t: Time, phi: &[T], omega: &[T]) {
        let n = mechanism.tree.coordinates;
        let configuration = ConstraintArguments { phi, z: &self.z, omega };
        if let Some(bodywise) = &mut self.bodywise {
            bodywise.rows_at(mechanism, t, configuration, &mut self.rows);
            return;
        }
        self.jacobian.fill(T::ZERO);
        for (r, row) in mechanism.constraints.iter().enumerate() {
            self.rows[r] = row.linearise(t, configuration, &mut self.jacobian[r * n..(r + 1) * n]);
        }
    }

    /// X = M⁻¹ Gᵀ and the factors of S = G X.
    #[inline(always)]
    fn schur_complement<const N: usize, const R: usize>(&mut self, n: usize, rows: usize) {
        let (jacobian, minv_jt, schur) =
            (&self.jacobian[..rows * n], &mut self.minv_jt[..rows * n], &mut self.schur[..rows * rows]);
        for r in 0..rows {
            let row = &mut minv_jt[r * n..(r + 1) * n];
            for k in 0..n {
                row[k] = jacobian[r * n + k];
            }
            tree::solve::<T, N>(n, &self.mass, &self.pivot, row);
        }
        for r in 0..rows {
            for s in r..rows {
                schur[r * rows + s] = dot(&jacobian[r * n..(r + 1) * n], &minv_jt[s * n..(s + 1) * n]);
            }
        }
        self.weakest = schur::factor::<T, R>(rows, schur, &mut self.schur_pivot, &self.scale);
        if self.weakest.share < NEAR {
            self.weakest = schur::look_closer(
                &self.metric,
                &self.scale,
                self.weakest,
                [jacobian, minv_jt],
                schur,
                &mut self.schur_pivot,
            );
        }
    }

    /// Replaces what is in `multiplier` by S⁻¹ of it; after [`Kernel::linearise`].
    pub fn solve_rows(&mut self) {
        if self.is_exact {
            return self.solve_rows_exactly();
        }
        match &mut self.bodywise {
            Some(bodywise) => bodywise.solve_rows(&mut self.multiplier),
            None => tree::solve::<T, 0>(
                self.multiplier.len(),
                &self.schur,
                &self.schur_pivot,
                &mut self.multiplier,
            ),
        }
    }

    /// Writes M⁻¹ Gᵀ of what is in `multiplier` to `load`; after [`Kernel::linearise`].
    pub fn multiplier_accelerations(&mut self) {
        if self.is_exact {
            return self.lift_exactly();
        }
        if let Some(bodywise) = &mut self.bodywise {
            return bodywise.multiplier_accelerations(&self.multiplier, &mut self.load);
        }
        let (n, rows) = (self.z.len(), self.multiplier.len());
        for k in 0..n {
            self.load[k] =
                (0..rows).fold(T::ZERO, |sum, r| sum + self.minv_jt[r * n + k] * self.multiplier[r]);
        }
    }

    /// True where row `r` was left out, its pivot lost; after [`Kernel::linearise`].
    pub fn is_left_out(&self, r: usize) -> bool {
        if let Some(exact) = self.exact.as_ref().filter(|_| self.is_exact) {
            return exact.is_left_out(r);
        }
        match &self.bodywise {
            Some(bodywise) => bodywise.is_left_out(r),
            None => self.schur_pivot[r] == T::ZERO,
        }
    }

    /// Folds the entries of G in row `r` that may not be zero, with their coordinates.
    #[inline(always)]
    pub fn fold_gradient<S>(&self, r: usize, start: S, mut fold: impl FnMut(S, usize, T) -> S) -> S {
        if let Some(bodywise) = &self.bodywise {
            return bodywise.gradient(r).fold(start, |sum, (k, g)| fold(sum, k, g));
        }
        let n = self.z.len();
        self.jacobian[r * n..(r + 1) * n].iter().enumerate().fold(start, |sum, (k, &g)| fold(sum, k, g))
    }

    /// G w of row `r` \[rad/s or m/s\], after an evaluation.
    #[inline(always)]
    pub fn row_speed(&self, r: usize, omega: &[T]) -> T {
        self.fold_gradient(r, T::ZERO, |sum, k, g| sum + g * omega[k])
    }

    /// C' of row `r` \[rad/s or m/s\], after [`Kernel::linearise`].
    pub fn row_rate(&self, r: usize, omega: &[T]) -> T {
        self.row_speed(r, omega) + self.rows[r].drive
    }
}
