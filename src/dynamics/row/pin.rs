//! Two points that coincide: a hinge that closes a loop, as two rows, one along each axis.
//!
//! ```text
//! C = Re(conj(n) D),  D = P_a - P_b,   G_k = Re(conj(n) i gamma_k z_k),   C_t = 0,   gamma = Re(conj(n) Pi_D),   n = 1, i
//! ```
//!
//! The force on the first point is -lambda n, on the second lambda n.

use super::{Linearised, Posture};
use crate::arithmetic::{Complex, Real};
use crate::dynamics::point::Point;

/// One of the two rows of a pin.
#[derive(Clone, Debug, PartialEq)]
pub struct PinRow {
    /// Name of the pin and its axis.
    pub name: String,
    /// D.
    pub span: Point,
    /// Unit vector n of the axis.
    pub axis: Complex<f64>,
}

impl PinRow {
    /// Both rows that keep `a` on `b`.
    pub fn pair(name: &str, a: &Point, b: &Point) -> [Self; 2] {
        [("x", Complex::new(1.0, 0.0)), ("y", Complex::new(0.0, 1.0))].map(|(letter, axis)| Self {
            name: format!("{name}.{letter}"),
            span: a.minus(b),
            axis,
        })
    }

    /// See [`Row::linearise`](super::Row::linearise).
    #[inline]
    pub fn linearise<T: Real>(&self, at: Posture<T>, jacobian: &mut [T]) -> Linearised<T> {
        let position = Complex::<T>::of(self.axis).dot(self.span.position(at.z));
        Linearised { position, ..self.differentiate(at, jacobian) }
    }

    /// See [`Row::differentiate`](super::Row::differentiate).
    #[inline]
    pub fn differentiate<T: Real>(&self, at: Posture<T>, jacobian: &mut [T]) -> Linearised<T> {
        let axis = Complex::<T>::of(self.axis);
        for &(k, gamma) in &self.span.terms {
            jacobian[k] += axis.dot(at.z[k].turn(gamma).left());
        }
        Linearised { position: T::ZERO, drive: T::ZERO, convective: axis.dot(self.span.convective(at.z, at.omega)) }
    }
}
