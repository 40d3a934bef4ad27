//! Series of numbers of many digits: constants and time have as many, and laws are evaluated in them.

use super::factors::{CauchyFactor, Factored};
use super::{Constants, Series, SeriesNumber, Terms, bodywise, own};
use crate::arithmetic::Complex;
use crate::arithmetic::digits::{Digits, Factor, TimeScale};
use crate::dynamics::law::{Law, Phase};
use std::ops::RangeInclusive;

impl<const W: usize> Constants for Digits<W> {
    type Constant = Self;
    type Time = Self;

    fn moment(t: Self) -> Self {
        t
    }

    fn phase(law: &Law<Self>, t: Self) -> Phase<Self> {
        own::phase(law, t, |rate, start| rate * t + start)
    }

    fn law_value(law: &Law<Self>, t: Self) -> Self {
        own::value(law, t, |rate, start| rate * t + start)
    }

    fn add_law(law: &Law<Self>, sign: f64, t: Self, series: &mut [Self], first: usize, stride: usize) {
        own::add(law, sign, t, |rate, start| rate * t + start, (series, first, stride));
    }
}

impl<const W: usize> CauchyFactor<Digits<W>> for Factor<W> {
    type Scale = TimeScale;
    type Ahead = ();

    fn new(order: usize) -> Self {
        Self::new(order)
    }

    fn restart(&mut self, scale: &TimeScale) {
        self.restart(scale);
    }

    fn push(&mut self, scale: &TimeScale, power: Digits<W>) {
        self.push(scale, power);
    }

    fn product(&self, other: &Self, scale: &TimeScale, total: usize, of: RangeInclusive<usize>) -> Digits<W> {
        self.product(other, scale, total, of)
    }

    fn sum_of_products(
        [[a, b], [c, d]]: [[&Self; 2]; 2],
        sign: f64,
        scale: &TimeScale,
        total: usize,
        of: RangeInclusive<usize>,
    ) -> Digits<W> {
        let (first, second) = (a.product(b, scale, total, of.clone()), c.product(d, scale, total, of));
        if sign > 0.0 { first + second } else { first - second }
    }

    fn is_sound(&self) -> bool {
        self.is_sound()
    }
}

impl<const W: usize> Factored for Digits<W> {
    type Factor = Factor<W>;
}

impl<const W: usize> SeriesNumber for Digits<W> {
    fn begin(series: &mut Series<Self>, t: Self, u: &[Self], u_rest: &[Self], u_rate: &[Self]) {
        series.begin(t, u, u_rest, u_rate);
    }

    fn orders(series: &mut Series<Self>, terms: &Terms<Self>, first: usize) {
        series.orders::<0>(terms, first);
    }

    fn log2_size(self) -> f64 {
        self.log2()
    }

    fn kept(self, limbs: usize) -> Self {
        self.shortened(limbs.min(self.limbs()))
    }

    fn products(n: usize, a: &[Complex<Self>], b: &[Complex<Self>], sums: &mut [Complex<Self>]) {
        bodywise::products(n, a, b, sums);
    }
}
