//! Series of numbers of many digits: constants and time have as many, and laws are evaluated in them.

use super::factors::CauchyFactor;
use super::tape::LongTape;
use super::{Constants, Series, SeriesNumber, Terms, bodywise};
use crate::arithmetic::digits::{Digits, Factor, Scale};
use crate::arithmetic::{Complex, Over, Scalar};
use crate::dynamics::law::{Law, Phase, Sine};
use crate::scene::Profile;
use std::ops::RangeInclusive;

impl<const W: usize> Constants for Digits<W> {
    type Constant = Self;
    type Time = Self;

    fn moment(t: Self) -> Self {
        t
    }

    fn phase(law: &Law<Self>, t: Self) -> Phase<Self> {
        let mut rate = law.rate + law.acceleration * t;
        let mut acceleration = law.acceleration;
        for sine in &law.sines {
            let (sin, cos) = argument(sine, t).sin_cos();
            rate += sine.amplitude * sine.frequency * cos;
            acceleration -= sine.amplitude * sine.frequency * sine.frequency * sin;
        }
        if let Some(profile) = &law.profile {
            let [_, more_rate, more_acceleration] = profile.at(t);
            rate += more_rate;
            acceleration += more_acceleration;
        }
        let angle = Self::law_value(law, t);
        Phase { angle, unit: Complex::unit(angle), rate, acceleration }
    }

    fn law_value(law: &Law<Self>, t: Self) -> Self {
        let polynomial = law.start + law.rate * t + (law.acceleration * t * t).ldexp(-1);
        let profile = law.profile.iter().fold(polynomial, |sum, profile| sum + profile.at(t)[0]);
        law.sines.iter().fold(profile, |sum, sine| sum + sine.amplitude * argument(sine, t).sin_cos().0)
    }

    fn add_law(law: &Law<Self>, sign: f64, t: Self, series: &mut [Self], first: usize, stride: usize) {
        series[first] += Self::phase(law, t).rate.scale(sign);
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
            let (sin, cos) = argument(sine, t).sin_cos();
            // The m-th derivative of A f cos is A f^(m+1) cos, -sin, -cos, sin; power 0 is there already.
            let turns = [cos, -sin, -cos, sin];
            let mut factor = (sine.amplitude * sine.frequency).scale(sign);
            for (m, power) in series[first..].iter_mut().step_by(stride).enumerate().skip(1) {
                factor = factor.by(sine.frequency) / Self::whole(m as u64);
                *power += turns[m % 4] * factor;
            }
        }
    }
}

/// Powers 0 … `order` of a law by a formula about a time \[u/s^m\].
fn profile_powers<const W: usize>(
    profile: &Profile<Digits<W>>,
    t: Digits<W>,
    order: usize,
) -> Vec<Digits<W>> {
    let (tape, law, numbers) = profile.parts();
    let mut series = LongTape::new(tape, order, |input| input > 0);
    for m in 0..=order {
        series.advance(tape, m, &Scale::default(), |input| match (input.checked_sub(1), m) {
            (None, 0) => t,
            (None, 1) => Digits::ONE,
            (Some(number), 0) => numbers[number as usize],
            _ => Digits::ZERO,
        });
    }
    (0..=order).map(|m| series.power(law, m)).collect()
}

fn argument<const W: usize>(sine: &Sine<Digits<W>>, t: Digits<W>) -> Digits<W> {
    sine.frequency * t + sine.phase
}

impl<const W: usize> CauchyFactor<Digits<W>> for Factor<W> {
    type Scale = Scale;

    fn new(order: usize) -> Self {
        Self::new(order)
    }

    fn restart(&mut self, scale: &Scale) {
        self.restart(scale);
    }

    fn push(&mut self, scale: &Scale, power: Digits<W>) {
        self.push(scale, power);
    }

    fn product(&self, other: &Self, scale: &Scale, total: usize, of: RangeInclusive<usize>) -> Digits<W> {
        self.product(other, scale, total, of)
    }

    fn is_sound(&self) -> bool {
        self.is_sound()
    }
}

impl<const W: usize> SeriesNumber for Digits<W> {
    type Factor = Factor<W>;

    fn begin(series: &mut Series<Self>, t: Self, u: &[Self], u_rest: &[Self], u_rate: &[Self]) {
        series.begin(t, u, u_rest, u_rate);
    }

    fn orders(series: &mut Series<Self>, terms: &Terms<Self>, first: usize) {
        series.orders::<0>(terms, first);
    }

    fn kept(self, limbs: usize) -> Self {
        self.shortened(limbs.min(self.limbs()))
    }

    fn products(n: usize, a: &[Complex<Self>], b: &[Complex<Self>], sums: &mut [Complex<Self>]) {
        bodywise::products(n, a, b, sums);
    }
}
