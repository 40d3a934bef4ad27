//! A point on a line of the ground with unit normal n: the contact row of a wall.
//!
//! ```text
//! C = Re(conj(n) P) - s,   G_k = Re(conj(n) i gamma_k z_k),   C_t = 0,   gamma = Re(conj(n) Pi)
//! ```
//!
//! C is the gap: positive on the side the normal points to.  The force on the point is -lambda n.

use super::{Linearised, Posture};
use crate::arithmetic::{Complex, Real, Scalar};
use crate::dynamics::point::Point;

/// A row that keeps a point on a line of the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct LineRow {
    /// Name of the wall.
    pub name: String,
    /// The point.
    pub point: Point,
    /// Unit normal n.
    pub normal: Complex<f64>,
    /// s: distance of the line from the origin along n \[m\].
    pub offset: f64,
}

impl LineRow {
    /// The gap C \[m\].
    pub fn gap<T: Scalar>(&self, z: &[Complex<T>]) -> T {
        Complex::of(self.normal).dot(self.point.position(z)) - T::of(self.offset)
    }

    /// Adds G \[m\] to `jacobian`.
    pub fn jacobian<T: Scalar>(&self, z: &[Complex<T>], jacobian: &mut [T]) {
        for &(k, gamma) in &self.point.terms {
            jacobian[k] += Complex::of(self.normal).dot(z[k].turn(gamma).left());
        }
    }

    /// See [`Row::linearise`](super::Row::linearise).
    #[inline]
    pub fn linearise<T: Real>(&self, at: Posture<T>, jacobian: &mut [T]) -> Linearised<T> {
        Linearised { position: self.gap(at.z), ..self.differentiate(at, jacobian) }
    }

    /// See [`Row::differentiate`](super::Row::differentiate).
    #[inline]
    pub fn differentiate<T: Real>(&self, at: Posture<T>, jacobian: &mut [T]) -> Linearised<T> {
        self.jacobian(at.z, jacobian);
        let convective = Complex::of(self.normal).dot(self.point.convective(at.z, at.omega));
        Linearised { position: T::ZERO, drive: T::ZERO, convective }
    }
}
