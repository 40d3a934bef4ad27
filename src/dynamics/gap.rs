//! Gaps of walls, over the length of their contact, along a motion: value, slope, and a bound of the second derivative from bounds of the unknowns' own.
//!
//! ```text
//! g = c + Σ Re(conj(g_k) e^(i phi_k)) + Σ Re(conj(g_f) zeta_f)
//! |g''| <= Σ |g_k| (|phi_k''| + phi_k'²) + Σ |g_f| |zeta_f''|
//! ```
//!
//! Derivatives may be by time or by anything that grows in proportion with it.

use super::impact::Contact;
use super::law::Law;
use super::row::Measure;
use crate::arithmetic::Complex;

/// An angle or a foot, and its derivative.
pub type Moving = [Complex<f64>; 2];

/// A unit vector that turns at a rate.
pub fn turning(unit: Complex<f64>, rate: f64) -> Moving {
    [unit, unit.left().times(rate)]
}

impl Contact {
    /// Gap, slope and the magnitude gaps are rounded to, where elements and their derivatives are `element(k)`; `None` for what is no sum of elements.
    pub fn gap_along(&self, mut element: impl FnMut(usize) -> Moving) -> Option<[f64; 3]> {
        let Measure::Place(place) = &self.row.measure else { return None };
        if !place.bilinear.is_empty() {
            return None;
        }
        let found = place.linear.iter().fold([place.constant, 0.0, place.constant.abs()], |[gap, slope, size], &(k, g)| {
            let [here, rate] = element(k);
            [gap + g.dot(here), slope + g.dot(rate), size + (g.re * here.re).abs() + (g.im * here.im).abs()]
        });
        Some(found.map(|x| x / self.length))
    }

    /// A bound of the second derivative of the gap, where those of coordinate k and its square first derivative are at most `most(k)`.
    pub fn gap_bend(&self, mut most: impl FnMut(usize) -> [f64; 2]) -> f64 {
        let Measure::Place(place) = &self.row.measure else { return f64::INFINITY };
        let bend = place.linear.iter().fold(0.0, |sum, &(k, g)| {
            let bend = if k < place.angles {
                let [second, first] = most(k);
                second + first * first
            } else {
                libm::hypot(most(k)[0], most(k + 1)[0])
            };
            sum + g.norm_squared().sqrt() * bend
        });
        bend / self.length
    }
}

impl Law {
    /// Bounds of its first and second derivative up to the time `t` \[rad/s, rad/s²\].
    pub fn bounds(&self, t: f64) -> [f64; 2] {
        let start = [self.rate.abs() + self.acceleration.abs() * t.abs(), self.acceleration.abs()];
        self.sines.iter().fold(start, |[rate, acceleration], sine| {
            let swing = (sine.amplitude * sine.frequency).abs();
            [rate + swing, acceleration + swing * sine.frequency.abs()]
        })
    }
}
