//! Constraint rows, one file a kind.
//!
//! A row knows its violation C, its Jacobian G, its drive C_t and what is left of C'' at zero acceleration.  Sign rule everywhere:
//! `M a + Gᵀ lambda = b`, `G a = -gamma`, `C' = G w + C_t`.

pub mod angle;
pub mod line;
pub mod pin;

pub use angle::AngleRow;
pub use line::LineRow;
pub use pin::PinRow;

use super::Time;
use crate::arithmetic::{Complex, Real};

/// Angles, their unit vectors and rates at one moment.
#[derive(Clone, Copy, Debug)]
pub struct Posture<'a, T> {
    /// Angles in [-π, π] \[rad\].
    pub phi: &'a [T],
    /// Unit vectors.
    pub z: &'a [Complex<T>],
    /// Rates \[rad/s\].
    pub omega: &'a [T],
}

/// A row at one moment; the Jacobian is written aside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linearised<T> {
    /// C \[rad or m\].
    pub position: T,
    /// C_t \[rad/s or m/s\].
    pub drive: T,
    /// C'' at zero acceleration \[rad/s² or m/s²\].
    pub convective: T,
}

/// A row of the mechanism.
#[derive(Clone, Debug, PartialEq)]
pub enum Row {
    /// A given angle: motors.
    Angle(AngleRow),
    /// A point on a line of the ground: walls while they hold or push.
    Line(LineRow),
    /// Two points that coincide, along one axis: closed loops.
    Pin(PinRow),
}

impl Row {
    /// Name in the scene.
    pub fn name(&self) -> &str {
        match self {
            Row::Angle(row) => &row.name,
            Row::Line(row) => &row.name,
            Row::Pin(row) => &row.name,
        }
    }

    /// Unit of C: `rad` or `m`.
    pub fn unit(&self) -> &'static str {
        match self {
            Row::Angle(_) => "rad",
            Row::Line(_) | Row::Pin(_) => "m",
        }
    }

    /// Adds the row's Jacobian to `jacobian` (n, zero on entry) and returns the rest.
    #[inline]
    pub fn linearise<T: Real>(&self, t: Time, at: Posture<T>, jacobian: &mut [T]) -> Linearised<T> {
        match self {
            Row::Angle(row) => row.linearise(t, at, jacobian),
            Row::Line(row) => row.linearise(at, jacobian),
            Row::Pin(row) => row.linearise(at, jacobian),
        }
    }

    /// The same without C, which is written as zero: accelerations do not ask for it.
    #[inline]
    pub fn differentiate<T: Real>(&self, t: Time, at: Posture<T>, jacobian: &mut [T]) -> Linearised<T> {
        match self {
            Row::Angle(row) => row.differentiate(t, jacobian),
            Row::Line(row) => row.differentiate(at, jacobian),
            Row::Pin(row) => row.differentiate(at, jacobian),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::{DoubleDouble, Scalar};
    use crate::dynamics::point::Point;
    use crate::scene::{Law, Sine};

    /// Every kind of row against differences of its own C along a motion.
    #[test]
    fn jacobian_drive_and_convective_term_are_derivatives_of_the_position() {
        let law = Law { start: 0.1, rate: 2.0, acceleration: 0.3, sines: vec![Sine { amplitude: 0.2, frequency: 3.0, phase: 0.5 }] };
        let rows = [
            Row::Angle(AngleRow { name: "absolute".into(), body: 0, base: None, law: law.clone() }),
            Row::Angle(AngleRow { name: "relative".into(), body: 1, base: Some(0), law }),
            Row::Line(LineRow {
                name: "wall".into(),
                point: Point::ground([0.1, 0.0]).along(0, Complex::new(0.6, 0.0)).along(1, Complex::new(0.5, 0.2)),
                normal: Complex::new(0.6, 0.8),
                offset: 0.3,
            }),
        ];
        let (a, b) =
            (Point::ground([0.1, 0.0]).along(0, Complex::new(0.6, 0.0)), Point::ground([0.2, 0.3]).along(1, Complex::new(0.5, 0.2)));
        let pins = PinRow::pair("pin", &a, &b).map(Row::Pin);
        let of = DoubleDouble::of;
        let (start, rate, acceleration) = ([of(0.4), of(-0.9)], [of(1.5), of(-0.7)], [of(0.3), of(2.0)]);
        for row in rows.into_iter().chain(pins) {
            let at = |t: DoubleDouble, jacobian: &mut [DoubleDouble]| {
                let phi: Vec<_> = (0..2).map(|k| start[k] + rate[k] * t + (acceleration[k] * t * t).scale(0.5)).collect();
                let omega: Vec<_> = (0..2).map(|k| rate[k] + acceleration[k] * t).collect();
                let z: Vec<_> = phi.iter().map(|&phi| Complex::unit(phi)).collect();
                jacobian.fill(DoubleDouble::ZERO);
                row.linearise(t, Posture { phi: &phi, z: &z, omega: &omega }, jacobian)
            };
            let (mut g, mut other) = ([DoubleDouble::ZERO; 2], [DoubleDouble::ZERO; 2]);
            let (t, h) = (of(0.2), of(1e-8));
            let (before, now, after) = (at(t - h, &mut other), at(t, &mut g), at(t + h, &mut other));
            let omega: Vec<_> = (0..2).map(|k| rate[k] + acceleration[k] * t).collect();
            let first = ((after.position - before.position) / h).scale(0.5);
            let second = (after.position + before.position - now.position - now.position) / (h * h);
            let (mut c_rate, mut c_rate_rate) = (now.drive, now.convective);
            for k in 0..2 {
                c_rate += g[k] * omega[k];
                c_rate_rate += g[k] * acceleration[k];
            }
            assert!((first - c_rate).hi.abs() < 1e-12, "{} rate {first:?} {c_rate:?}", row.name());
            assert!((second - c_rate_rate).hi.abs() < 1e-12, "{} second {second:?} {c_rate_rate:?}", row.name());
        }
    }
}
