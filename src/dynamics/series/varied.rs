//! Series of numbers with derivatives by the numbers of a scene: all that is constant has derivatives too.
//!
//! Products are sums of `a' b + a b'` in all directions at once, over values and derivatives that are kept
//! apart, in the processor's vectors.

use super::factors::CauchyFactor;
use super::{Constants, Series, SeriesNumber, Terms, bodywise, own};
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::wide::{EightLanes, Vectors, WideCode};
use crate::arithmetic::{Complex, DoubleDouble, Scalar, Varied};
use crate::dynamics::Time;
use crate::dynamics::law::{Law, Phase};
use std::ops::RangeInclusive;

/// Eight directions.
pub type Number = Varied<LANES>;

/// rate·t + start, of which the value is less whole turns where `is_turned`.
#[inline]
fn grown(t: Time, is_turned: bool) -> impl Fn(Number, Number) -> Number {
    move |rate: Number, start: Number| {
        let exact = DoubleDouble::of(start.value) + t.scale(rate.value);
        let value = if is_turned { exact.reduced().0 } else { exact };
        let slope = std::array::from_fn(|lane| start.slope[lane] + rate.slope[lane] * t.hi);
        Number::new(value.hi, slope)
    }
}

impl Constants for Number {
    type Constant = Self;
    type Time = Time;

    fn moment(t: Time) -> Self {
        Self::constant(t.hi)
    }

    fn phase(law: &Law<Self>, t: Time) -> Phase<Self> {
        own::phase(law, Self::moment(t), grown(t, true))
    }

    fn law_value(law: &Law<Self>, t: Time) -> Self {
        own::value(law, Self::moment(t), grown(t, false))
    }

    fn add_law(law: &Law<Self>, sign: f64, t: Time, series: &mut [Self], first: usize, stride: usize) {
        own::add(law, sign, Self::moment(t), grown(t, true), (series, first, stride));
    }
}

/// Values and derivatives of the powers of a series.
#[derive(Clone, Debug)]
pub struct VariedFactor {
    values: Vec<f64>,
    slopes: Vec<Octet>,
    /// How many there are so far.
    count: usize,
}

/// Powers of a series, values and derivatives.
#[derive(Clone, Copy)]
struct Powers<'a>(&'a [f64], &'a [Octet]);

impl Powers<'_> {
    /// The first ones, so many.
    #[inline(always)]
    fn first(self, count: usize) -> Self {
        Self(&self.0[..count], &self.1[..count])
    }
}

/// A sum of products on its way: its value, Σ a' b and Σ a b'.
#[derive(Clone, Copy)]
struct Sum<W> {
    value: f64,
    by_a: W,
    by_b: W,
}

impl<W: EightLanes> Sum<W> {
    const ZERO: Self = Self { value: 0.0, by_a: W::ZERO, by_b: W::ZERO };

    /// Adds the product of power j of a and power k of b.
    #[inline(always)]
    fn add(&mut self, a: Powers, j: usize, b: Powers, k: usize) {
        let (x, y) = (a.0[j], b.0[k]);
        self.value += x * y;
        self.by_a = W::of(&a.1[j].0).mul_add(W::splat(y), self.by_a);
        self.by_b = W::of(&b.1[k].0).mul_add(W::splat(x), self.by_b);
    }

    #[inline(always)]
    fn found(self) -> Number {
        Number::new(self.value, self.by_a.add(self.by_b).array())
    }
}

// Iterators and closures are left out of these loops: they are not compiled into code for the vectors.

/// `Σ_j a_j b_{m-j}`.
struct Product<'a>(Powers<'a>, Powers<'a>);

impl WideCode for Product<'_> {
    type Output = Number;

    #[inline(always)]
    fn run<W: EightLanes>(self) -> Number {
        let count = self.0.0.len();
        let (a, b) = (self.0.first(count), self.1.first(count));
        let mut sum = Sum::<W>::ZERO;
        let mut j = 0;
        while j < count {
            sum.add(a, j, b, count - 1 - j);
            j += 1;
        }
        sum.found()
    }
}

/// The same of two series a with one series b.
struct Products<'a>([Powers<'a>; 2], Powers<'a>);

impl WideCode for Products<'_> {
    type Output = [Number; 2];

    #[inline(always)]
    fn run<W: EightLanes>(self) -> [Number; 2] {
        let Self([a, c], b) = self;
        let count = a.0.len();
        let (a, b, c) = (a.first(count), b.first(count), c.first(count));
        let (mut first, mut second) = (Sum::<W>::ZERO, Sum::<W>::ZERO);
        let mut j = 0;
        while j < count {
            first.add(a, j, b, count - 1 - j);
            second.add(c, j, b, count - 1 - j);
            j += 1;
        }
        [first.found(), second.found()]
    }
}

/// The product of the first two series, and `sign` times that of the last two.
struct TwoProducts<'a>([[Powers<'a>; 2]; 2], f64);

impl WideCode for TwoProducts<'_> {
    type Output = Number;

    #[inline(always)]
    fn run<W: EightLanes>(self) -> Number {
        let Self([[a, b], [c, d]], sign) = self;
        let count = a.0.len();
        let (a, b, c, d) = (a.first(count), b.first(count), c.first(count), d.first(count));
        let (mut first, mut second) = (Sum::<W>::ZERO, Sum::<W>::ZERO);
        let mut j = 0;
        while j < count {
            first.add(a, j, b, count - 1 - j);
            second.add(c, j, d, count - 1 - j);
            j += 1;
        }
        first.found() + second.found().scale(sign)
    }
}

impl VariedFactor {
    #[inline(always)]
    fn powers(&self, (first, last): (usize, usize)) -> Powers<'_> {
        Powers(&self.values[first..=last], &self.slopes[first..=last])
    }
}

impl CauchyFactor<Number> for VariedFactor {
    type Scale = Vectors;

    fn new(order: usize) -> Self {
        Self { values: vec![0.0; order + 1], slopes: vec![Octet::splat(0.0); order + 1], count: 0 }
    }

    #[inline(always)]
    fn restart(&mut self, _scale: &Vectors) {
        self.count = 0;
    }

    #[inline(always)]
    fn push(&mut self, _scale: &Vectors, power: Number) {
        self.values[self.count] = power.value;
        self.slopes[self.count] = Octet(power.slope);
        self.count += 1;
    }

    #[inline(always)]
    fn product(&self, other: &Self, scale: &Vectors, total: usize, of: RangeInclusive<usize>) -> Number {
        let (first, last) = of.into_inner();
        if first > last {
            return Number::ZERO;
        }
        let others = (total - last, total - first);
        scale.run(Product(self.powers((first, last)), other.powers(others)))
    }

    #[inline(always)]
    fn products(
        pair: [&Self; 2],
        other: &Self,
        scale: &Vectors,
        total: usize,
        of: RangeInclusive<usize>,
    ) -> [Number; 2] {
        let (first, last) = of.into_inner();
        if first > last {
            return [Number::ZERO; 2];
        }
        let others = (total - last, total - first);
        let [a, c] = pair;
        let pair = [a.powers((first, last)), c.powers((first, last))];
        scale.run(Products(pair, other.powers(others)))
    }

    #[inline(always)]
    fn sum_of_products(
        pairs: [[&Self; 2]; 2],
        sign: f64,
        scale: &Vectors,
        total: usize,
        of: RangeInclusive<usize>,
    ) -> Number {
        let (first, last) = of.into_inner();
        if first > last {
            return Number::ZERO;
        }
        let others = (total - last, total - first);
        let [[a, b], [c, d]] = pairs;
        let of = (first, last);
        let powers = [[a.powers(of), b.powers(others)], [c.powers(of), d.powers(others)]];
        scale.run(TwoProducts(powers, sign))
    }

    fn is_sound(&self) -> bool {
        true
    }
}

/// All orders, compiled for the processor's vectors.
struct Orders<'a, 'b> {
    series: &'a mut Series<Number>,
    terms: &'a Terms<'b, Number>,
    first: usize,
}

impl WideCode for Orders<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<W: EightLanes>(self) {
        let Self { series, terms, first } = self;
        match if series.angles == series.elements { series.angles } else { 0 } {
            1 => series.orders_here::<1>(terms, first),
            2 => series.orders_here::<2>(terms, first),
            _ => series.orders_here::<0>(terms, first),
        }
    }
}

impl SeriesNumber for Number {
    type Factor = VariedFactor;

    fn begin(series: &mut Series<Self>, t: Time, u: &[Self], u_rest: &[Self], u_rate: &[Self]) {
        series.begin(t, u, u_rest, u_rate);
    }

    fn orders(series: &mut Series<Self>, terms: &Terms<Self>, first: usize) {
        series.factors.scale.run(Orders { series, terms, first });
    }

    fn products(n: usize, a: &[Complex<Self>], b: &[Complex<Self>], sums: &mut [Complex<Self>]) {
        bodywise::products(n, a, b, sums);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNT: usize = 7;

    fn number(k: usize) -> Number {
        let of = |i: usize| libm::sin(1.0 + 2.3 * k as f64 + 0.7 * i as f64);
        Number::new(of(100), std::array::from_fn(of))
    }

    fn factor(from: usize) -> VariedFactor {
        let mut factor = VariedFactor::new(COUNT - 1);
        (0..COUNT).for_each(|k| factor.push(&Vectors::default(), number(from + k)));
        factor
    }

    /// A product, two with one factor, and a difference of two.
    fn all(scale: &Vectors) -> [Number; 4] {
        let [a, b, c, d]: [VariedFactor; 4] = std::array::from_fn(|series| factor(COUNT * series));
        let [first, second] = CauchyFactor::products([&a, &c], &b, scale, 6, 2..=5);
        let cross = CauchyFactor::sum_of_products([[&a, &b], [&c, &d]], -1.0, scale, 6, 2..=5);
        [a.product(&b, scale, 6, 2..=5), first, second, cross]
    }

    #[test]
    fn products_of_factors_are_sums_of_products() {
        let sum = |first: usize, second: usize| {
            (2..=5)
                .fold(Number::ZERO, |sum, j| sum + number(COUNT * first + j) * number(COUNT * second + 6 - j))
        };
        let found = all(&Vectors::default());
        for (found, expected) in found.iter().zip([sum(0, 1), sum(0, 1), sum(2, 1), sum(0, 1) - sum(2, 3)]) {
            let slopes = found.slope.iter().zip(&expected.slope);
            let apart =
                slopes.fold((found.value - expected.value).abs(), |most, (a, b)| most.max((a - b).abs()));
            assert!(apart < 1e-14, "{found:?} {expected:?}");
        }
        // Without the processor's vectors the bits are the same.
        for (plain, vector) in all(&Vectors::Portable).into_iter().zip(found) {
            assert!(plain.value.to_bits() == vector.value.to_bits());
            assert_eq!(plain.slope.map(f64::to_bits), vector.slope.map(f64::to_bits));
        }
    }
}
