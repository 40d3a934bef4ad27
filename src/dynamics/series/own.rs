//! Laws of time in numbers that are constants too: of many digits, or with derivatives.
//!
//! What such a law is comes from its numbers by plain arithmetic.  Angles that grow with time are made by
//! `grown(rate, start)`, which knows the time and how to keep its digits.

use super::factors::{Factored, Scale};
use super::tape::FactorTape;
use crate::arithmetic::{Complex, Over};
use crate::dynamics::law::{Law, Phase};
use crate::scene::{Decimal, Profile};

/// A law at a time \[s\].
pub fn phase<T: Over<T> + Decimal>(law: &Law<T>, t: T, grown: impl Fn(T, T) -> T) -> Phase<T> {
    let mut rate = law.rate + law.acceleration * t;
    let mut acceleration = law.acceleration;
    for sine in &law.sines {
        let (sin, cos) = grown(sine.frequency, sine.phase).sin_cos();
        rate += sine.amplitude * sine.frequency * cos;
        acceleration -= sine.amplitude * sine.frequency * sine.frequency * sin;
    }
    if let Some(profile) = &law.profile {
        let [_, more_rate, more_acceleration] = profile.at(t);
        rate += more_rate;
        acceleration += more_acceleration;
    }
    let angle = value(law, t, grown);
    Phase { angle, unit: Complex::unit(angle), rate, acceleration }
}

/// What a law comes to at a time \[s\].
pub fn value<T: Over<T> + Decimal>(law: &Law<T>, t: T, grown: impl Fn(T, T) -> T) -> T {
    let polynomial = grown(law.rate, law.start) + (law.acceleration * t * t).scale(0.5);
    let profile = law.profile.iter().fold(polynomial, |sum, profile| sum + profile.at(t)[0]);
    law.sines
        .iter()
        .fold(profile, |sum, sine| sum + sine.amplitude * grown(sine.frequency, sine.phase).sin_cos().0)
}

/// Adds the series of a law's rate: see `drive.rs`.
pub fn add<T: Factored + Over<T> + Decimal>(
    law: &Law<T>,
    sign: f64,
    t: T,
    grown: impl Fn(T, T) -> T,
    (series, first, stride): (&mut [T], usize, usize),
) {
    series[first] += phase(law, t, &grown).rate.scale(sign);
    series[first + stride] += law.acceleration.scale(sign);
    if let Some(profile) = &law.profile {
        // Power m of the rate is m + 1 times power m + 1 of the law; power 0 is there already.
        let count = (series.len() - first).div_ceil(stride);
        let powers = profile_powers(profile, t, count);
        for (m, power) in series[first..].iter_mut().step_by(stride).enumerate().skip(1) {
            *power += powers[m + 1].scale(sign * (m + 1) as f64);
        }
    }
    for sine in &law.sines {
        let (sin, cos) = grown(sine.frequency, sine.phase).sin_cos();
        // The m-th derivative of A f cos is A f^(m+1) cos, -sin, -cos, sin; power 0 is there already.
        let turns = [cos, -sin, -cos, sin];
        let mut factor = (sine.amplitude * sine.frequency).scale(sign);
        for (m, power) in series[first..].iter_mut().step_by(stride).enumerate().skip(1) {
            factor = factor * sine.frequency / T::of(m as f64);
            *power += turns[m % 4] * factor;
        }
    }
}

/// Powers 0 … `order` of a law by a formula about a time \[u/s^m\].
fn profile_powers<T: Factored + Decimal>(profile: &Profile<T>, t: T, order: usize) -> Vec<T> {
    let (tape, law, numbers) = profile.parts();
    let mut series = FactorTape::new(tape, order, |input| input > 0);
    for m in 0..=order {
        series.advance(tape, m, &Scale::<T>::default(), |input| match (input.checked_sub(1), m) {
            (None, 0) => t,
            (None, 1) => T::ONE,
            (Some(number), 0) => numbers[number as usize],
            _ => T::ZERO,
        });
    }
    (0..=order).map(|m| series.power(law, m)).collect()
}
