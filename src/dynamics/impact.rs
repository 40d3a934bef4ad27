//! The jump of the rates when a point meets a wall.
//!
//! ```text
//! M (w⁺ - w⁻) + Jᵀ rho + Gᵀ sigma = 0,    J w⁺ = -e J w⁻,    G w⁺ + C_t = 0
//! ```
//!
//! The impulse on the point along the wall's normal is -rho, never negative.  Without motors the energy changes by `-rho (1-e) J w⁻ / 2`.
//! Source: F. Pfeiffer, C. Glocker, *Multibody Dynamics with Unilateral Contacts* (1996), section 8.2 (Newton's law of impact).

use super::kernel::{Kernel, dot};
use super::point::Point;
use super::row::{Posture, Row};
use super::{Mechanism, Time, tree};
use crate::arithmetic::Complex;
use nalgebra::{DMatrix, DVector};

/// A wall as the mechanism meets it.
#[derive(Clone, Debug, PartialEq)]
pub struct Contact {
    /// The gap and its Jacobian.
    pub row: Row,
    /// The point.
    pub point: Point,
    /// Unit normal of the wall.
    pub normal: Complex<f64>,
    /// Restitution e.
    pub restitution: f64,
    /// What gaps are divided by \[m\], a power of two: see [`contact::scale`](super::contact::scale).
    pub length: f64,
    /// What forces of the wall are divided by \[N\], a power of two.
    pub force: f64,
}

impl Contact {
    /// The gap over the length of the contact: the event function of a point that may meet its wall.
    pub fn gap(&self, z: &[Complex<f64>]) -> f64 {
        self.row.gap(z) / self.length
    }

    /// The force of the wall over the force of the contact: the event function of a point that is held.
    pub fn pressure(&self, multiplier: f64) -> f64 {
        -multiplier / self.force
    }
}

/// What an impact did.
#[derive(Clone, Debug, PartialEq)]
pub struct Impact {
    /// Rates of all bodies after it \[rad/s\].
    pub omega: Vec<f64>,
    /// Normal velocity of the point before it \[m/s\], negative.
    pub approach: f64,
    /// Impulse on the point along the wall's normal \[N·s\].
    pub impulse: f64,
    /// Impulses of the rows \[N·m·s or N·s\]: of a contact that is held, positive where it would have to pull.
    pub row_impulses: Vec<f64>,
    /// Energy after less energy before \[J\].
    pub energy_change: f64,
    /// Impulsive work of the motors, which hold their rates \[J\].
    pub motor_work: f64,
}

impl Mechanism {
    /// The jump at contact `contact`, or `None` where the motors leave the point no freedom to rebound.
    ///
    /// Angles \[rad\] and rates \[rad/s\] of all bodies at the moment of impact; a point that is not approaching keeps its rates.
    pub fn strike(&self, contact: usize, t: Time, phi: &[f64], omega: &[f64]) -> Option<Impact> {
        let Contact { row, restitution, .. } = &self.contacts[contact];
        let n = self.coordinates();
        let mut kernel = Kernel::<f64>::dense_without_rows(self);
        kernel.face::<0>(self, phi);
        self.tree.couple::<f64, 0>(&kernel.z, &mut kernel.mass, &mut kernel.twist);
        let mut jacobian = vec![0.0; n];
        row.differentiate(t, Posture { phi, z: &kernel.z, omega }, &mut jacobian);
        let approach = dot(&jacobian, omega);
        if approach >= 0.0 {
            let row_impulses = vec![0.0; self.rows.len()];
            return Some(Impact { omega: omega.to_vec(), approach, impulse: 0.0, row_impulses, energy_change: 0.0, motor_work: 0.0 });
        }
        let mut momentum = vec![0.0; n];
        tree::multiply::<f64, 0>(n, &kernel.mass, omega, &mut momentum);
        let size = n + 1 + self.rows.len();
        let (mut matrix, mut right) = (DMatrix::<f64>::zeros(size, size), DVector::<f64>::zeros(size));
        for i in 0..n {
            for j in i..n {
                matrix[(i, j)] = kernel.mass[i * n + j];
                matrix[(j, i)] = kernel.mass[i * n + j];
            }
            right[i] = momentum[i];
        }
        let mut drives = Vec::new();
        let mut border = |at: usize, jacobian: &[f64]| {
            for k in 0..n {
                matrix[(at, k)] = jacobian[k];
                matrix[(k, at)] = jacobian[k];
            }
        };
        border(n, &jacobian);
        right[n] = -restitution * approach;
        for (r, row) in self.rows.iter().enumerate() {
            let mut given = vec![0.0; n];
            let drive = row.linearise(t, Posture { phi, z: &kernel.z, omega }, &mut given).drive;
            border(n + 1 + r, &given);
            right[n + 1 + r] = -drive;
            drives.push(drive);
        }
        // Rows scaled by the masses would be nicer to the pivots; full pivoting does as well at this size.
        let solution = matrix.full_piv_lu().solve(&right).filter(|x| x.iter().all(|x| x.is_finite()))?;
        let after: Vec<f64> = solution.iter().take(n).copied().collect();
        if (dot(&jacobian, &after) + restitution * approach).abs() > 1e-9 * approach.abs() {
            return None;
        }
        let mut momentum_after = vec![0.0; n];
        tree::multiply::<f64, 0>(n, &kernel.mass, &after, &mut momentum_after);
        let motor_work = drives.iter().enumerate().map(|(r, drive)| solution[n + 1 + r] * drive).sum();
        Some(Impact {
            approach,
            impulse: -solution[n],
            row_impulses: solution.iter().skip(n + 1).copied().collect(),
            energy_change: 0.5 * (dot(&momentum_after, &after) - dot(&momentum, omega)),
            motor_work,
            omega: after,
        })
    }
}
