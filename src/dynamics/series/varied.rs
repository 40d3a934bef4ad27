//! Series of numbers with derivatives by the numbers of a scene: all that is constant has derivatives too.
//!
//! Products are sums of `a' b + a b'` in all directions at once, over values and derivatives that are kept
//! apart, in the processor's vectors.

use super::factors::CauchyFactor;
use super::{Constants, Series, SeriesNumber, Terms, bodywise, own};
use crate::arithmetic::lanes::{self, Code, Hardware, Lanes, Portable};
use crate::arithmetic::{Complex, DoubleDouble, Scalar, Varied};
use crate::dynamics::Time;
use crate::dynamics::law::{Law, Phase};
use std::ops::RangeInclusive;

/// rate·t + start, of which the value is less whole turns where `is_turned`.
#[inline]
fn grown<const D: usize>(t: Time, is_turned: bool) -> impl Fn(Varied<D>, Varied<D>) -> Varied<D> {
    move |rate, start| {
        let exact = DoubleDouble::of(start.value) + t.scale(rate.value);
        let value = if is_turned { exact.reduced().0 } else { exact };
        let slope = std::array::from_fn(|lane| start.slope[lane] + rate.slope[lane] * t.hi);
        Varied::new(value.hi, slope)
    }
}

impl<const D: usize> Constants for Varied<D> {
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
pub struct VariedFactor<const D: usize> {
    values: Vec<f64>,
    slopes: Vec<[f64; D]>,
    /// How many there are so far.
    count: usize,
}

/// The processor's vectors, where it has them.
#[derive(Clone, Debug)]
pub struct Vectors(Option<Hardware>);

impl Default for Vectors {
    fn default() -> Self {
        Self(lanes::hardware())
    }
}

/// The most vectors of four lanes.
const MOST: usize = 2;

/// Powers of a series, values and derivatives.
#[derive(Clone, Copy)]
struct Powers<'a, const D: usize>(&'a [f64], &'a [[f64; D]]);

impl<'a, const D: usize> Powers<'a, D> {
    /// The first ones, so many.
    #[inline(always)]
    fn first(self, count: usize) -> Self {
        Self(&self.0[..count], &self.1[..count])
    }
}

/// A sum of products on its way: its value, Σ a' b and Σ a b'.
#[derive(Clone, Copy)]
struct Sum<L> {
    value: f64,
    by_a: [L; MOST],
    by_b: [L; MOST],
}

impl<L: Lanes> Sum<L> {
    const ZERO: Self = Self { value: 0.0, by_a: [L::ZERO; MOST], by_b: [L::ZERO; MOST] };

    /// Adds `sign` times the product of power j of a and power k of b.
    #[inline(always)]
    fn add<const D: usize>(&mut self, a: Powers<D>, j: usize, b: Powers<D>, k: usize, sign: f64) {
        let (x, y) = (sign * a.0[j], sign * b.0[k]);
        self.value += x * b.0[k];
        let (x, y) = (L::splat(x), L::splat(y));
        let mut part = 0;
        while part < D / 4 {
            self.by_a[part] = four::<L, D>(&a.1[j], part).mul_add(y, self.by_a[part]);
            self.by_b[part] = four::<L, D>(&b.1[k], part).mul_add(x, self.by_b[part]);
            part += 1;
        }
    }

    #[inline(always)]
    fn found<const D: usize>(self) -> Varied<D> {
        let mut slope = [0.0; D];
        let mut part = 0;
        while part < D / 4 {
            let four = self.by_a[part].add(self.by_b[part]).array();
            slope[4 * part] = four[0];
            slope[4 * part + 1] = four[1];
            slope[4 * part + 2] = four[2];
            slope[4 * part + 3] = four[3];
            part += 1;
        }
        Varied::new(self.value, slope)
    }
}

/// Four lanes of a derivative.
#[inline(always)]
fn four<L: Lanes, const D: usize>(slope: &[f64; D], part: usize) -> L {
    L::of([slope[4 * part], slope[4 * part + 1], slope[4 * part + 2], slope[4 * part + 3]])
}

// Iterators and closures are left out of these loops: they are not compiled into code for the vectors.

/// `Σ_j a_j b_{m-j}`.
struct Product<'a, const D: usize>(Powers<'a, D>, Powers<'a, D>);

impl<const D: usize> Code for Product<'_, D> {
    type Output = Varied<D>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Varied<D> {
        let count = self.0.0.len();
        let (a, b) = (self.0.first(count), self.1.first(count));
        let mut sum = Sum::<L>::ZERO;
        let mut j = 0;
        while j < count {
            sum.add(a, j, b, count - 1 - j, 1.0);
            j += 1;
        }
        sum.found()
    }
}

/// The same of two series a with one series b.
struct Products<'a, const D: usize>([Powers<'a, D>; 2], Powers<'a, D>);

impl<const D: usize> Code for Products<'_, D> {
    type Output = [Varied<D>; 2];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [Varied<D>; 2] {
        let Self([a, c], b) = self;
        let count = a.0.len();
        let (a, b, c) = (a.first(count), b.first(count), c.first(count));
        let (mut first, mut second) = (Sum::<L>::ZERO, Sum::<L>::ZERO);
        let mut j = 0;
        while j < count {
            first.add(a, j, b, count - 1 - j, 1.0);
            second.add(c, j, b, count - 1 - j, 1.0);
            j += 1;
        }
        [first.found(), second.found()]
    }
}

/// The product of the first two series, and `sign` times that of the last two.
struct TwoProducts<'a, const D: usize>([[Powers<'a, D>; 2]; 2], f64);

impl<const D: usize> Code for TwoProducts<'_, D> {
    type Output = Varied<D>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Varied<D> {
        let Self([[a, b], [c, d]], sign) = self;
        let count = a.0.len();
        let (a, b, c, d) = (a.first(count), b.first(count), c.first(count), d.first(count));
        let mut sum = Sum::<L>::ZERO;
        let mut j = 0;
        while j < count {
            sum.add(a, j, b, count - 1 - j, 1.0);
            sum.add(c, j, d, count - 1 - j, sign);
            j += 1;
        }
        sum.found()
    }
}

impl Vectors {
    #[inline(always)]
    fn run<C: Code>(&self, code: C) -> C::Output {
        match self.0 {
            Some(hardware) => hardware.run(code),
            None => code.run::<Portable>(),
        }
    }
}

impl<const D: usize> VariedFactor<D> {
    #[inline(always)]
    fn powers(&self, (first, last): (usize, usize)) -> Powers<'_, D> {
        Powers(&self.values[first..=last], &self.slopes[first..=last])
    }
}

impl<const D: usize> CauchyFactor<Varied<D>> for VariedFactor<D> {
    type Scale = Vectors;

    fn new(order: usize) -> Self {
        Self { values: vec![0.0; order + 1], slopes: vec![[0.0; D]; order + 1], count: 0 }
    }

    fn restart(&mut self, _scale: &Vectors) {
        self.count = 0;
    }

    #[inline(always)]
    fn push(&mut self, _scale: &Vectors, power: Varied<D>) {
        let slope = &mut self.slopes[self.count];
        let mut lane = 0;
        while lane < D {
            slope[lane] = power.slope[lane];
            lane += 1;
        }
        self.values[self.count] = power.value;
        self.count += 1;
    }

    #[inline(always)]
    fn product(&self, other: &Self, scale: &Vectors, total: usize, of: RangeInclusive<usize>) -> Varied<D> {
        let (first, last) = of.into_inner();
        if first > last {
            return Varied::ZERO;
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
    ) -> [Varied<D>; 2] {
        let (first, last) = of.into_inner();
        if first > last {
            return [Varied::ZERO; 2];
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
    ) -> Varied<D> {
        let (first, last) = of.into_inner();
        if first > last {
            return Varied::ZERO;
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
struct Orders<'a, 'b, const D: usize> {
    series: &'a mut Series<Varied<D>>,
    terms: &'a Terms<'b, Varied<D>>,
    first: usize,
}

impl<const D: usize> Code for Orders<'_, '_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { series, terms, first } = self;
        match if series.angles == series.elements { series.angles } else { 0 } {
            1 => series.orders_here::<1>(terms, first),
            2 => series.orders_here::<2>(terms, first),
            _ => series.orders_here::<0>(terms, first),
        }
    }
}

impl<const D: usize> SeriesNumber for Varied<D> {
    type Factor = VariedFactor<D>;

    fn begin(series: &mut Series<Self>, t: Time, u: &[Self], u_rest: &[Self], u_rate: &[Self]) {
        series.begin(t, u, u_rest, u_rate);
    }

    fn orders(series: &mut Series<Self>, terms: &Terms<Self>, first: usize) {
        lanes::run(Orders { series, terms, first }, false);
    }

    fn products(n: usize, a: &[Complex<Self>], b: &[Complex<Self>], sums: &mut [Complex<Self>]) {
        bodywise::products(n, a, b, sums);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNT: usize = 7;

    fn number<const D: usize>(k: usize) -> Varied<D> {
        let of = |i: usize| libm::sin(1.0 + 2.3 * k as f64 + 0.7 * i as f64);
        Varied::new(of(100), std::array::from_fn(of))
    }

    fn factor<const D: usize>(from: usize) -> VariedFactor<D> {
        let mut factor = VariedFactor::new(COUNT - 1);
        (0..COUNT).for_each(|k| factor.push(&Vectors::default(), number(from + k)));
        factor
    }

    fn products_are_sums_of_products<const D: usize>() {
        let all: [VariedFactor<D>; 4] = std::array::from_fn(|series| factor(COUNT * series));
        let [a, b, c, d] = &all;
        let sum = |first: usize, second: usize| {
            (2..=5).fold(Varied::<D>::ZERO, |sum, j| {
                sum + number::<D>(COUNT * first + j) * number(COUNT * second + 6 - j)
            })
        };
        let near = |found: Varied<D>, expected: Varied<D>| {
            let slopes = found.slope.iter().zip(&expected.slope);
            let apart =
                slopes.fold((found.value - expected.value).abs(), |most, (a, b)| most.max((a - b).abs()));
            assert!(apart < 1e-14, "{found:?} {expected:?}");
        };
        let found = |scale: &Vectors| {
            let [first, second] = CauchyFactor::products([a, c], b, scale, 6, 2..=5);
            let cross = CauchyFactor::sum_of_products([[a, b], [c, d]], -1.0, scale, 6, 2..=5);
            [a.product(b, scale, 6, 2..=5), first, second, cross]
        };
        let [one, first, second, cross] = found(&Vectors::default());
        near(one, sum(0, 1));
        near(first, sum(0, 1));
        near(second, sum(2, 1));
        near(cross, sum(0, 1) - sum(2, 3));
        // Without the processor's vectors the bits are the same.
        for (plain, vector) in found(&Vectors(None)).into_iter().zip([one, first, second, cross]) {
            assert!(plain.value.to_bits() == vector.value.to_bits());
            assert_eq!(plain.slope.map(f64::to_bits), vector.slope.map(f64::to_bits));
        }
    }

    #[test]
    fn products_of_factors_are_sums_of_products() {
        products_are_sums_of_products::<4>();
        products_are_sums_of_products::<8>();
    }
}
