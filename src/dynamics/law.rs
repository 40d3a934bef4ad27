//! A motor's law of time, evaluated so that its phase stays exact over long horizons.
//!
//! `start + rate·t` at 1e5 s carries an error of 1e-10 rad in a plain double.  Time is a pair, the polynomial part is formed in
//! double-double, and whole turns are taken off before any sine.

use super::Time;
use crate::arithmetic::{Complex, DoubleDouble, Real, Scalar};
pub use crate::scene::{Law, Sine};

/// A law at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Phase<T> {
    /// The angle less whole turns, about [-π, π] \[rad\].
    pub angle: T,
    /// Its unit vector.
    pub unit: Complex<T>,
    /// First derivative \[rad/s\].
    pub rate: T,
    /// Second derivative \[rad/s²\].
    pub acceleration: T,
}

impl Law {
    /// The angle \[rad\] in full, turns included.
    pub fn angle(&self, t: Time) -> DoubleDouble {
        let polynomial = DoubleDouble::of(self.start) + t.scale(self.rate) + (t * t).scale(0.5 * self.acceleration);
        self.sines.iter().fold(polynomial, |sum, sine| sum + sine.argument(t).sin_cos().0.scale(sine.amplitude))
    }

    /// The angle less whole turns, its unit vector and derivatives.
    #[inline]
    pub fn at<T: Real>(&self, t: Time) -> Phase<T> {
        let mut angle = DoubleDouble::of(self.start) + t.scale(self.rate);
        let mut rate = T::of(self.rate);
        let mut acceleration = T::ZERO;
        if self.acceleration != 0.0 {
            angle += (t * t).scale(0.5 * self.acceleration);
            rate += T::split(t.scale(self.acceleration)).0;
            acceleration = T::of(self.acceleration);
        }
        let (angle, _) = angle.reduced();
        let mut sines = T::ZERO;
        for sine in &self.sines {
            let (sin, cos) = T::split(sine.argument(t).reduced().0).0.sin_cos();
            sines += sin.scale(sine.amplitude);
            rate += cos.scale(sine.amplitude * sine.frequency);
            acceleration -= sin.scale(sine.amplitude * sine.frequency * sine.frequency);
        }
        let (angle, rest) = T::split(angle + sines.double_double());
        // What a plain double cannot hold of the angle turns the unit vector by a first-order rotation.
        let unit = Complex::unit(angle);
        Phase { angle, unit: unit + unit.left().times(rest), rate, acceleration }
    }
}

impl Sine {
    /// frequency·t + phase \[rad\].
    fn argument(&self, t: Time) -> DoubleDouble {
        t.scale(self.frequency) + self.phase
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law() -> Law {
        Law { start: 0.3, rate: 6.25, acceleration: -0.5, sines: vec![Sine { amplitude: 0.2, frequency: 11.0, phase: 0.4 }] }
    }

    #[test]
    fn derivatives_are_those_of_the_angle() {
        let (t, h) = (Time::of(1.7), Time::of(1e-4));
        let law = law();
        let (before, now, after) = (law.angle(t - h), law.angle(t), law.angle(t + h));
        let phase = law.at::<DoubleDouble>(t);
        assert!((((after - before) / h).scale(0.5) - phase.rate).hi.abs() < 3e-6);
        assert!(((after + before - now - now) / (h * h) - phase.acceleration).hi.abs() < 3e-5);
    }

    #[test]
    fn the_phase_keeps_sixteen_digits_at_a_million_seconds() {
        let t = Time::of(1e6);
        let (law, exact) = (law(), law().angle(t).sin_cos());
        let plain = law.at::<f64>(t);
        assert!((plain.unit.re - exact.1.hi).abs() < 3e-16 && (plain.unit.im - exact.0.hi).abs() < 3e-16);
        assert!((law.at::<DoubleDouble>(t).unit.re - exact.1).hi.abs() < 1e-19);
    }
}
