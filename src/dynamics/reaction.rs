//! Hinge forces by Newton–Euler: what a hinge carries is what everything beyond it needs.
//!
//! ```text
//! F = Σ over the subtree  m (a_c - g) - applied forces
//! ```
//!
//! No unknowns are added for it; it equals the multipliers of the pinned form.

use super::Mechanism;
use crate::arithmetic::Complex;

impl Mechanism {
    /// Force \[N\] of the first body of each hinge on the second (in the scene's order), given rates \[rad/s\] and accelerations \[rad/s²\].
    pub fn hinge_forces(&self, z: &[Complex<f64>], omega: &[f64], alpha: &[f64]) -> Vec<Complex<f64>> {
        let mut needed: Vec<Complex<f64>> =
            self.bodies.iter().map(|body| (body.centre.acceleration(z, omega, alpha) - self.gravity).times(body.mass)).collect();
        for spring in &self.springs {
            let force = spring.force(z, omega);
            for (end, force) in spring.bodies.iter().zip([force, -force]) {
                if let Some(body) = *end {
                    needed[body] -= force;
                }
            }
        }
        let mut carried = vec![Complex::ZERO; self.bodies.len()];
        for (body, &force) in needed.iter().enumerate() {
            let mut on = Some(body);
            while let Some(outer) = on {
                carried[outer] += force;
                on = self.bodies[outer].parent;
            }
        }
        self.joints
            .iter()
            .map(|joint| if joint.between[1] == Some(joint.outer) { carried[joint.outer] } else { -carried[joint.outer] })
            .collect()
    }
}
