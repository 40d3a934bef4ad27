//! Hinge forces by Newton–Euler: what a hinge carries is what everything beyond it needs.
//!
//! ```text
//! F = Σ over the subtree  m (a_c - g) - applied forces - forces of rows
//! ```
//!
//! No unknowns are added for it; it equals the multipliers of the pinned form.  A hinge that closes a loop
//! carries the force of its own rows.
//!
//! Signs: the force of a hinge or weld is the one its first body, in the scene's order, exerts on its second,
//! whichever of the two is the ground.

use super::compile::Joint;
use super::constraint::Posture;
use super::forest::turning_acceleration;
use super::kernel::Kernel;
use super::{Mechanism, Time};
use crate::arithmetic::Complex;

impl Mechanism {
    /// Accelerations \[m/s²\] of the centres of mass.
    pub fn centre_accelerations(
        &self,
        z: &[Complex<f64>],
        omega: &[f64],
        alpha: &[f64],
    ) -> Vec<Complex<f64>> {
        let mut found = vec![Complex::ZERO; self.bodies.len()];
        self.forest.origin_accelerations(z, omega, alpha, &mut found);
        for (k, (found, body)) in found.iter_mut().zip(&self.bodies).enumerate() {
            *found += turning_acceleration(z[k].turn(body.centre), omega[k], alpha[k]);
        }
        found
    }

    /// Force \[N\] of the first body of each hinge on the second (in the scene's order), from an evaluation
    /// of the equations at these angles \[rad\] and rates \[rad/s\]: its `load` must hold the accelerations,
    /// its `multiplier` those of all rows.
    pub fn hinge_forces(
        &self,
        t: Time,
        kernel: &Kernel<f64>,
        phi: &[f64],
        omega: &[f64],
    ) -> Vec<Complex<f64>> {
        let (z, alpha) = (&kernel.z, &kernel.load);
        let mut needed = self.centre_accelerations(z, omega, alpha);
        for (needed, body) in needed.iter_mut().zip(&self.bodies) {
            *needed = (*needed - self.gravity).times(body.mass);
        }
        for spring in &self.springs {
            let force = spring.force(z, omega);
            for (end, force) in spring.bodies.iter().zip([force, -force]) {
                if let Some(body) = *end {
                    needed[body] -= force;
                }
            }
        }
        for action in &self.actions {
            needed[action.body] -= action.force(action.factor(t), z);
        }
        for user in &self.forces {
            user.forces(t.hi, Posture { phi, z, omega }, |body, force| needed[body] -= force);
        }
        self.transmitted(z, &kernel.multiplier, needed)
    }

    /// The forces of the hinges and welds under which each body gets the force \[N\] it needs, less what rows
    /// with these multipliers push it with.
    pub(super) fn transmitted(
        &self,
        z: &[Complex<f64>],
        multipliers: &[f64],
        mut needed: Vec<Complex<f64>>,
    ) -> Vec<Complex<f64>> {
        for (row, &multiplier) in self.constraints.iter().zip(multipliers) {
            let Some(push) = &row.push else { continue };
            let direction = push.direction(z);
            for (body, sign) in [(push.on, 1.0), (push.from, -1.0)] {
                if let Some(body) = body {
                    needed[body] += direction.times(sign * multiplier);
                }
            }
        }
        let mut carried = needed;
        for &body in self.forest.order.iter().rev() {
            if let Some(parent) = self.forest.hangs[body].origin_point.parent() {
                let force = carried[body];
                carried[parent] += force;
            }
        }
        let force = |joint: &Joint| match (joint.outer, joint.row) {
            (Some(outer), _) if joint.between[1] == Some(outer) => carried[outer],
            (Some(outer), _) => -carried[outer],
            // The rows push the first body by -lambda, and the second by lambda.
            (None, Some(row)) => Complex::new(multipliers[row], multipliers[row + 1]),
            (None, None) => Complex::ZERO,
        };
        self.joints.iter().map(force).collect()
    }
}
