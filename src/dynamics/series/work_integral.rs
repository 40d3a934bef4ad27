//! The account of work in the series.

use super::coefficient::Coefficient;
use super::{Series, action};
use crate::dynamics::Mechanism;

impl<T: Coefficient> Series<T> {
    /// Torques of the driven bodies and the power of motors and dampers at this order.
    #[inline(always)]
    pub(super) fn work_integral(&mut self, mechanism: &Mechanism, m: usize) {
        let n = self.elements;
        let mut power = T::ZERO;
        if self.is_tied {
            for (i, _) in self
                .partition
                .bodies
                .iter()
                .enumerate()
                .filter(|(_, dependent_angle)| !dependent_angle.laws.is_empty())
            {
                let mut torque =
                    (self.omega[(m + 1) * n + i] * T::of((m + 1) as f64)).scale(mechanism.tree.diagonal[i]);
                for (z, &rest) in
                    self.z[i..].iter().step_by(n).zip(self.rest[..=m * n + i].iter().rev().step_by(n))
                {
                    torque += z.cross(rest);
                }
                torque -= self.applied[m * n + i];
                self.torque[m * n + i] = torque;
                for (&torque, &drive) in
                    self.torque[i..].iter().step_by(n).zip(self.drive[..=m * n + i].iter().rev().step_by(n))
                {
                    power += torque * drive;
                }
            }
        }
        if !self.rows.is_empty() {
            power += self.rows.power(m, &self.omega[m * n..(m + 1) * n]);
        }
        for (spring, series) in
            mechanism.springs.iter().zip(&self.springs).filter(|(spring, _)| spring.damping != 0.0)
        {
            power += series.loss(spring, m);
        }
        for torsion in mechanism.torsions.iter().filter(|torsion| torsion.damping != 0.0) {
            power += action::loss(torsion, m, &self.omega, n);
        }
        for (action, series) in mechanism.actions.iter().zip(&mut self.actions) {
            power += series.power(action, m, &self.omega[m * n..(m + 1) * n]);
        }
        for (force, series) in mechanism.forces.iter().zip(&self.forces) {
            power += series.power(force, m);
        }
        self.power[m] = power;
    }
}
