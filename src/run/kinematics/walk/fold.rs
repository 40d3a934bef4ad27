//! Positions so near a limit that projection leaves a row out: as many rows as coordinates are solved as they
//! are.
//!
//! ```text
//! G dq = -C  repeated until C stops falling,   G q' = -C_t,   G q'' = -gamma,   M q'' = b - Gᵀ lambda
//! ```
//!
//! With a share of 1e-8 left of a row, q is known to 1e-12 and its rates to 1e-8.  Where ways of motion cross
//! it is otherwise: rates are no larger there than elsewhere, and what projection keeps of them is better.

use super::DriveWalk;
use crate::dynamics::kernel::Bias;
use crate::run::kinematics::independence::{jacobian, size};
use nalgebra::{DMatrix, DVector};

/// Beside a limit the largest rate is about the drive's over the least singular value of G; of that, more
/// than this share.
const FAST: f64 = 1e-3;
/// Iterations to solve the rows.
const ITERATIONS: usize = 12;

impl DriveWalk {
    /// True where rates are as large as beside a limit, that near to a singular position.
    pub(super) fn is_as_fast_as_beside_limit(&self) -> bool {
        let least = jacobian(&self.mechanism, &self.kernel).singular_values().min();
        self.fastest_of_jacobian() * least > FAST * self.drive_rate()
    }

    /// Brings a position beside a limit onto all rows, with its rates, accelerations and multipliers; false,
    /// and nothing done, of any other.
    pub(super) fn solve_beside_limit(&mut self) -> bool {
        let (n, mechanism) = (self.alpha.len(), &*self.mechanism);
        let rows = mechanism.constraints.len();
        if rows != n || !(0..rows).any(|r| self.kernel.is_left_out(r)) {
            return false;
        }
        let (time, drive_rate) = (self.state.time, self.drive_rate());
        let (mut phi, mut omega) = (self.state.y[..n].to_vec(), self.state.y[n..2 * n].to_vec());
        let (kernel, mut last) = (&mut self.beside, f64::INFINITY);
        for _ in 0..ITERATIONS {
            kernel.place(mechanism, &phi);
            kernel.rows_at(mechanism, time, &phi, &omega);
            let left = DVector::from_fn(n, |r, _| kernel.rows[r].position);
            if left.amax() >= 0.5 * last || left.amax() == 0.0 {
                break;
            }
            last = left.amax();
            let Some(step) = jacobian(mechanism, kernel).lu().solve(&left) else { return false };
            phi.iter_mut()
                .zip(&step)
                .enumerate()
                .for_each(|(k, (phi, step))| *phi -= step * size(mechanism, k));
        }
        let gradients = jacobian(mechanism, kernel);
        let (least, factors) = (gradients.singular_values().min(), gradients.lu());
        let drive = DVector::from_fn(n, |r, _| -kernel.rows[r].drive);
        let Some(rates) = factors.solve(&drive) else { return false };
        if rates.amax().is_nan() || rates.amax() * least <= FAST * drive_rate {
            return false;
        }
        (0..n).for_each(|k| omega[k] = rates[k] * size(mechanism, k));
        self.kernel.accelerations(mechanism, time, &phi, &omega, Bias::default());
        kernel.accelerate_free::<0>(mechanism, time, &phi, &omega);
        kernel.rows_at(mechanism, time, &phi, &omega);
        let convective = DVector::from_fn(n, |r, _| -kernel.rows[r].convective);
        let Some(alpha) = factors.solve(&convective) else { return false };
        let mut given_way = DMatrix::zeros(n, n);
        for r in 0..n {
            self.kernel.multiplier.fill(0.0);
            self.kernel.multiplier[r] = 1.0;
            self.kernel.multiplier_accelerations();
            (0..n).for_each(|k| given_way[(k, r)] = self.kernel.load[k]);
        }
        (0..n).for_each(|k| self.alpha[k] = alpha[k] * size(mechanism, k));
        let lost = DVector::from_fn(n, |k, _| kernel.load[k] - self.alpha[k]);
        if let Some(multipliers) = given_way.lu().solve(&lost) {
            self.kernel.multiplier.copy_from_slice(multipliers.as_slice());
        }
        // Outputs are evaluated from it.
        self.kernel.load.copy_from_slice(&self.alpha);
        self.state.y[..n].copy_from_slice(&phi);
        self.state.y[n..2 * n].copy_from_slice(&omega);
        self.state.low[..2 * n].fill(0.0);
        true
    }
}
