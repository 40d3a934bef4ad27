//! The series of a law of time.

use crate::arithmetic::{Real, Scalar};
use crate::dynamics::Time;
use crate::dynamics::law::Law;

/// Adds `sign` times the powers 0, 1, … of a law's rate about time `t` to a series.
pub fn add<'a, T: Real>(law: &Law, sign: f64, t: Time, series: impl Iterator<Item = &'a mut T>) {
    let rate = law.at::<T>(t).rate;
    let sines: Vec<(T, T)> =
        law.sines.iter().map(|sine| T::split((t.scale(sine.frequency) + sine.phase).reduced().0).0.sin_cos()).collect();
    let mut factors: Vec<T> = law.sines.iter().map(|sine| T::of(sine.amplitude).scale(sign * sine.frequency)).collect();
    for (m, power) in series.enumerate() {
        match m {
            0 => {
                *power += rate.scale(sign);
                continue;
            }
            1 => *power += T::of(law.acceleration).scale(sign),
            _ => {}
        }
        // The m-th derivative of A f cos is A f^(m+1) cos, -sin, -cos, sin.
        for ((sine, factor), &(sin, cos)) in law.sines.iter().zip(&mut factors).zip(&sines) {
            *factor = factor.scale(sine.frequency) / T::of(m as f64);
            let turned = match m % 4 {
                0 => cos,
                1 => -sin,
                2 => -cos,
                _ => sin,
            };
            *power += turned * *factor;
        }
    }
}
