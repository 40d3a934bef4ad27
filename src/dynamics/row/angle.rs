//! A given angle, absolute or relative: a motor, or a lock where the law is a constant.
//!
//! ```text
//! C = q_a - q_b - theta(t),   G_a = 1, G_b = -1,   C_t = -theta',   gamma = -theta''
//! ```
//!
//! The multiplier is minus the torque on body a; the motor's power is torque · theta'.

use super::{Linearised, Posture};
use crate::arithmetic::{Real, angle};
use crate::dynamics::Time;
use crate::dynamics::law::Law;

/// A row that gives an angle.
#[derive(Clone, Debug, PartialEq)]
pub struct AngleRow {
    /// Name of the motor.
    pub name: String,
    /// The driven body a.
    pub body: usize,
    /// The body b its angle is measured from; `None`: from +x.
    pub base: Option<usize>,
    /// theta(t).
    pub law: Law,
}

impl AngleRow {
    /// See [`Row::linearise`](super::Row::linearise); C is taken modulo whole turns.
    #[inline]
    pub fn linearise<T: Real>(&self, t: Time, at: Posture<T>, jacobian: &mut [T]) -> Linearised<T> {
        self.jacobian(jacobian);
        let [theta, rate, acceleration] = self.law.angles::<T>(t);
        let mut given = at.phi[self.body];
        if let Some(base) = self.base {
            given = angle::difference(given, at.phi[base]);
        }
        Linearised { position: angle::difference(given, theta), drive: -rate, convective: -acceleration }
    }

    /// Adds G to `jacobian`.
    #[inline]
    fn jacobian<T: Real>(&self, jacobian: &mut [T]) {
        jacobian[self.body] += T::ONE;
        if let Some(base) = self.base {
            jacobian[base] -= T::ONE;
        }
    }

    /// See [`Row::differentiate`](super::Row::differentiate).
    #[inline]
    pub fn differentiate<T: Real>(&self, t: Time, jacobian: &mut [T]) -> Linearised<T> {
        self.jacobian(jacobian);
        let (rate, acceleration) = self.law.rates::<T>(t);
        Linearised { position: T::ZERO, drive: -rate, convective: -acceleration }
    }
}
