//! The account of work in the series.

use super::coefficient::{SeriesNumber, Terms};
use super::factors::{BodyFactors, CauchyFactor};
use super::{Series, action};
use crate::arithmetic::Scalar;

impl<T: SeriesNumber> Series<T> {
    /// Torques of the driven bodies and the power of motors and dampers at this order.
    #[inline(always)]
    pub(super) fn work_integral(&mut self, terms: &Terms<T::Constant>, m: usize) {
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
                    (self.omega[(m + 1) * n + i] * T::of((m + 1) as f64)).by(terms.tree.diagonal[i]);
                let BodyFactors { scale, z, rest, .. } = &self.factors;
                if T::HAS_CONSTANTS {
                    torque += z[i].cross(&rest[i], scale, m, 0..=m);
                } else {
                    let rest = self.rest[..=m * n + i].iter().rev().step_by(n);
                    let pairs = self.z[i..].iter().step_by(n).zip(rest);
                    pairs.for_each(|(z, &rest)| torque += z.cross(rest));
                }
                torque -= self.applied[m * n + i];
                self.torque[m * n + i] = torque;
                if T::HAS_CONSTANTS {
                    let BodyFactors { scale, drive, torque: torques, .. } = &mut self.factors;
                    torques[i].push(scale, torque);
                    power += torques[i].product(&drive[i], scale, m, 0..=m);
                } else {
                    let drive = self.drive[..=m * n + i].iter().rev().step_by(n);
                    let pairs = self.torque[i..].iter().step_by(n).zip(drive);
                    pairs.for_each(|(&torque, &drive)| power += torque * drive);
                }
            }
        }
        if !self.rows.is_empty() {
            power += self.rows.power(m, &self.omega[m * n..(m + 1) * n]);
        }
        for (spring, series) in
            terms.springs.iter().zip(&self.springs).filter(|(spring, _)| spring.damping != T::Constant::ZERO)
        {
            power += series.loss(spring, m, &self.factors.scale);
        }
        for torsion in terms.torsions.iter().filter(|torsion| torsion.damping != T::Constant::ZERO) {
            power += action::loss(torsion, m, &self.omega, n);
        }
        for (action, series) in terms.actions.iter().zip(&mut self.actions) {
            let omega = &self.omega[m * n..(m + 1) * n];
            power += series.power(action, m, omega, &self.factors.scale);
        }
        for (force, series) in terms.forces.iter().zip(&self.forces) {
            power += series.power(force, m);
        }
        if let Some(friction) = &mut self.friction {
            power -= friction.lose(m, &self.z, &self.omega[m * n..(m + 1) * n]);
        }
        self.power[m] = power;
    }
}
