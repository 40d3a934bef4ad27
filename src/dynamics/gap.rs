//! Gaps of walls, over the length of their contact, along a motion: value, slope, and a bound of the second
//! derivative from bounds of the unknowns' own.
//!
//! ```text
//! g = c + Σ Re(conj(g_k) e^(i phi_k)) + Σ Re(conj(g_f) zeta_f) - s(t)
//! |g''| <= Σ |g_k| (|phi_k''| + phi_k'²) + Σ |g_f| |zeta_f''| + |s''|
//! ```
//!
//! Walls of bodies have products of elements beside, of which value and slope are known, and no bound; of
//! walls that move by a formula of places the value alone is known here.
//!
//! Derivatives may be by time or by anything that grows in proportion with it.

use super::Along;
use super::constraint::RowMeasure;
use super::impact::{AWAY, Contact};
use super::law::Law;
use crate::arithmetic::Complex;

/// An angle or an origin, and its derivative.
pub type Moving = [Complex<f64>; 2];

/// A unit vector that turns at a rate.
pub fn turning(unit: Complex<f64>, rate: f64) -> Moving {
    [unit, unit.left().times(rate)]
}

impl Contact {
    /// Gap, slope and the magnitude gaps are rounded to, where elements and their derivatives are
    /// `element(k)`, and time goes by at `step_size` \[s\]; `None` for what is no sum of elements.
    pub fn gap_along(&self, at: &Along, mut element: impl FnMut(usize) -> Moving) -> Option<[f64; 3]> {
        let RowMeasure::Place(place) = &self.row.measure else { return None };
        if self.is_off {
            return Some([AWAY, 0.0, AWAY]);
        }
        if self.row.aim.is_some() {
            return None;
        }
        let mut found = place.linear.iter().fold(
            [place.constant, 0.0, place.constant.abs()],
            |[gap, slope, size], &(k, g)| {
                let [here, rate] = element(k);
                [
                    gap + g.dot(here),
                    slope + g.dot(rate),
                    size + (g.re * here.re).abs() + (g.im * here.im).abs(),
                ]
            },
        );
        for &(j, k, h) in &place.bilinear {
            let ([one, one_rate], [other, other_rate]) = (element(j), element(k).map(|x| h * x));
            found[0] += one.dot(other);
            found[1] += one_rate.dot(other) + one.dot(other_rate);
            found[2] += (one.re * other.re).abs() + (one.im * other.im).abs();
        }
        if let Some(law) = &self.row.law {
            let moved = law.value::<f64>(at.time);
            found[0] -= moved;
            found[1] -= at.step_size * law.rates::<f64>(at.time).0;
            found[2] += moved.abs();
        }
        Some(found.map(|x| x / self.length))
    }

    /// A bound of the second derivative of the gap, where those of coordinate k and its square first
    /// derivative are at most `most(k)`, up to the time `t` \[s\] that goes by at `step_size`.
    pub fn gap_bend(&self, t: f64, step_size: f64, mut most: impl FnMut(usize) -> [f64; 2]) -> f64 {
        let RowMeasure::Place(place) = &self.row.measure else { return f64::INFINITY };
        if self.is_off {
            return 0.0;
        }
        if !place.bilinear.is_empty() || self.row.aim.is_some() {
            return f64::INFINITY;
        }
        let bend = place.linear.iter().fold(0.0, |sum, &(k, g)| {
            let bend = if k < place.angles {
                let [second, first] = most(k);
                second + first * first
            } else {
                libm::hypot(most(k)[0], most(k + 1)[0])
            };
            sum + g.norm_squared().sqrt() * bend
        });
        match &self.row.law {
            None => bend / self.length,
            Some(law) => (bend + step_size * step_size * law.bounds(t)[1]) / self.length,
        }
    }
}

impl Law {
    /// Bounds of its first and second derivative up to the time `t` \[rad/s, rad/s²\]; a profile has none.
    pub fn bounds(&self, t: f64) -> [f64; 2] {
        if self.profile.is_some() {
            return [f64::INFINITY; 2];
        }
        let start = [self.rate.abs() + self.acceleration.abs() * t.abs(), self.acceleration.abs()];
        self.sines.iter().fold(start, |[rate, acceleration], sine| {
            let swing = (sine.amplitude * sine.frequency).abs();
            [rate + swing, acceleration + swing * sine.frequency.abs()]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::Time;
    use crate::dynamics::constraint::ConstraintEquation;
    use crate::dynamics::point::Point;
    use crate::dynamics::quadratic::Quadratic;
    use crate::scene::Sine;

    #[test]
    fn slopes_are_derivatives_and_bounds_are_bounds() {
        let normal = Complex::unit(0.7);
        let point = Point::floating(2).along(0, Complex::new(0.6, 0.1)).along(1, Complex::new(0.2, -0.4));
        let measure = RowMeasure::Place(Quadratic::along(&point, normal, 2));
        let row = ConstraintEquation { name: "wall".into(), measure, law: None, push: None, aim: None };
        let contact = Contact { point, length: 0.5, ..Contact::new(row, normal, 1.0) };
        // Two angles and an origin, each a parabola in t.
        let powers = [[0.3, 2.0, -1.5], [-1.0, -4.0, 0.4], [0.1, 0.5, 2.0], [0.7, -0.3, -1.0]];
        let at = |k: usize, t: f64| {
            [powers[k][0] + t * (powers[k][1] + t * powers[k][2]), powers[k][1] + 2.0 * t * powers[k][2]]
        };
        let gap = |t: f64| {
            let element = |k: usize| match k < 2 {
                true => turning(Complex::unit(at(k, t)[0]), at(k, t)[1]),
                false => [Complex::new(at(2, t)[0], at(3, t)[0]), Complex::new(at(2, t)[1], at(3, t)[1])],
            };
            let at = Along { time: Time::from(t), step_size: 1.0, y: &[], slope: &[] };
            contact.gap_along(&at, element).expect("a sum of elements")
        };
        let most = |k: usize| [2.0 * powers[k][2].abs(), powers[k][1].abs() + 2.0 * powers[k][2].abs()];
        let (bound, h) = (contact.gap_bend(1.0, 1.0, most), 1e-5);
        let mut steepest = 0.0_f64;
        for share in 0..=50 {
            let t = f64::from(share) / 50.0;
            let [before, here, after] = [gap(t - h), gap(t), gap(t + h)];
            let slope = (after[0] - before[0]) / (2.0 * h);
            assert!((here[1] - slope).abs() < 1e-7, "{t}: {} {slope}", here[1]);
            assert!(here[2] * (1.0 + 1e-15) >= here[0].abs(), "{t}: {here:?}");
            steepest = steepest.max(((after[1] - before[1]) / (2.0 * h)).abs());
        }
        assert!(steepest <= bound && bound < 20.0 * steepest, "{steepest} {bound}");
    }

    #[test]
    fn no_law_is_faster_than_its_bounds() {
        let law = Law {
            start: 0.3,
            rate: -2.0,
            acceleration: 0.5,
            sines: vec![Sine { amplitude: 0.4, frequency: 7.0, phase: 0.1 }],
            profile: None,
        };
        let [rate, acceleration] = law.bounds(2.0);
        for step in 0..=200 {
            let [_, v, a] = law.angles::<f64>(crate::dynamics::Time::from(f64::from(step) * 0.01));
            assert!(v.abs() <= rate && a.abs() <= acceleration);
        }
    }
}
