//! Cauchy products of series of numbers with derivatives in slots: sums of `a' b + a b'`, over values and
//! derivatives that are kept apart.

use super::factors::CauchyFactor;
use super::slots::InSlots;
use crate::arithmetic::Scalar;
use crate::arithmetic::lanes::wide::Slots;
use std::ops::RangeInclusive;

/// Values and derivatives of the powers of a series.
#[derive(Clone, Debug)]
pub struct VariedFactor<S> {
    values: Vec<f64>,
    slopes: Vec<S>,
    /// How many there are so far.
    count: usize,
}

/// Powers of a series, values and derivatives.
#[derive(Clone, Copy)]
struct SeriesPowers<'a, S>(&'a [f64], &'a [S]);

impl<S> SeriesPowers<'_, S> {
    /// The first ones, so many.
    #[inline(always)]
    fn first(self, count: usize) -> Self {
        Self(&self.0[..count], &self.1[..count])
    }
}

impl<S: Slots> SeriesPowers<'_, S> {
    /// One of them.
    #[inline(always)]
    fn at(self, m: usize) -> InSlots<S> {
        InSlots::new(self.0[m], self.1[m])
    }
}

/// A sum of products on its way: its value, Σ a' b and Σ a b'.
#[derive(Clone, Copy, Debug)]
struct Sum<S> {
    value: f64,
    by_a: S,
    by_b: S,
}

impl<S: Slots> Sum<S> {
    const ZERO: Self = Self { value: 0.0, by_a: S::ZERO, by_b: S::ZERO };

    /// Adds the product of power j of a and power k of b.
    #[inline(always)]
    fn add(&mut self, a: SeriesPowers<S>, j: usize, b: SeriesPowers<S>, k: usize) {
        let (x, y) = (a.0[j], b.0[k]);
        self.value += x * y;
        self.by_a = a.1[j].mul_add(S::splat(y), self.by_a);
        self.by_b = b.1[k].mul_add(S::splat(x), self.by_b);
    }

    /// Adds the product of two numbers.
    #[inline(always)]
    fn add_numbers(&mut self, a: InSlots<S>, b: InSlots<S>) {
        self.value += a.value * b.value;
        self.by_a = a.slope.mul_add(S::splat(b.value), self.by_a);
        self.by_b = b.slope.mul_add(S::splat(a.value), self.by_b);
    }

    #[inline(always)]
    fn found(self) -> InSlots<S> {
        InSlots::new(self.value, self.by_a.add(self.by_b))
    }
}

// Iterators and closures are left out of these loops: they are not compiled into code for the vectors.

/// `Σ_j a_j b_{m-j}`, and `Σ_j c_j d_{m-j}`.
#[inline(always)]
fn two_sums<S: Slots>([[a, b], [c, d]]: [[SeriesPowers<S>; 2]; 2]) -> [InSlots<S>; 2] {
    let count = a.0.len();
    let (a, b, c, d) = (a.first(count), b.first(count), c.first(count), d.first(count));
    let (mut first, mut second) = (Sum::<S>::ZERO, Sum::<S>::ZERO);
    let mut j = 0;
    while j < count {
        first.add(a, j, b, count - 1 - j);
        second.add(c, j, d, count - 1 - j);
        j += 1;
    }
    [first.found(), second.found()]
}

impl<S: Slots> VariedFactor<S> {
    #[inline(always)]
    fn powers(&self, (first, last): (usize, usize)) -> SeriesPowers<'_, S> {
        SeriesPowers(&self.values[first..=last], &self.slopes[first..=last])
    }
}

/// Sums of the next order on their way: of the two components of z w, and of the two terms of z × R.
#[derive(Clone, Copy, Debug)]
pub struct SumsAhead<S> {
    turned: [Sum<S>; 2],
    crossed: [Sum<S>; 2],
}

impl<S: Slots> Default for SumsAhead<S> {
    fn default() -> Self {
        Self { turned: [Sum::ZERO; 2], crossed: [Sum::ZERO; 2] }
    }
}

impl<S: Slots> CauchyFactor<InSlots<S>> for VariedFactor<S> {
    type Scale = ();
    type Ahead = SumsAhead<S>;

    fn new(order: usize) -> Self {
        Self { values: vec![0.0; order + 1], slopes: vec![S::ZERO; order + 1], count: 0 }
    }

    #[inline(always)]
    fn restart(&mut self, _scale: &()) {
        self.count = 0;
    }

    #[inline(always)]
    fn push(&mut self, _scale: &(), power: InSlots<S>) {
        self.values[self.count] = power.value;
        self.slopes[self.count] = power.slope;
        self.count += 1;
    }

    #[inline(always)]
    fn product(&self, other: &Self, _scale: &(), total: usize, of: RangeInclusive<usize>) -> InSlots<S> {
        let (first, last) = of.into_inner();
        if first > last {
            return InSlots::ZERO;
        }
        let (a, b) = (self.powers((first, last)), other.powers((total - last, total - first)));
        let count = a.0.len();
        let (a, b) = (a.first(count), b.first(count));
        let mut sum = Sum::<S>::ZERO;
        let mut j = 0;
        while j < count {
            sum.add(a, j, b, count - 1 - j);
            j += 1;
        }
        sum.found()
    }

    #[inline(always)]
    fn products(
        [a, c]: [&Self; 2],
        other: &Self,
        _scale: &(),
        total: usize,
        of: RangeInclusive<usize>,
    ) -> [InSlots<S>; 2] {
        let (first, last) = of.into_inner();
        if first > last {
            return [InSlots::ZERO; 2];
        }
        let b = other.powers((total - last, total - first));
        two_sums([[a.powers((first, last)), b], [c.powers((first, last)), b]])
    }

    #[inline(always)]
    fn sum_of_products(
        [[a, b], [c, d]]: [[&Self; 2]; 2],
        sign: f64,
        _scale: &(),
        total: usize,
        of: RangeInclusive<usize>,
    ) -> InSlots<S> {
        let (first, last) = of.into_inner();
        if first > last {
            return InSlots::ZERO;
        }
        let (of, others) = ((first, last), (total - last, total - first));
        let [one, two] = two_sums([[a.powers(of), b.powers(others)], [c.powers(of), d.powers(others)]]);
        if sign > 0.0 { one + two } else { one - two }
    }

    // An even order sums what is known of the next one too, so that each coefficient is loaded for both.
    #[inline(always)]
    fn turned(
        [re, im]: [&Self; 2],
        omega: &Self,
        _scale: &(),
        m: usize,
        ahead: &mut SumsAhead<S>,
    ) -> [InSlots<S>; 2] {
        let (x, y, w) = (re.powers((0, m + 1)), im.powers((0, m + 1)), omega.powers((0, m)));
        if m % 2 == 1 {
            for (sum, e) in ahead.turned.iter_mut().zip([x, y]) {
                sum.add_numbers(e.at(1), w.at(m));
                sum.add_numbers(e.at(m + 1), w.at(0));
            }
            return [ahead.turned[0].found(), ahead.turned[1].found()];
        }
        let (mut this, mut next) = ([Sum::<S>::ZERO; 2], [Sum::<S>::ZERO; 2]);
        let mut newer = w.at(m);
        this[0].add_numbers(x.at(1), newer);
        this[1].add_numbers(y.at(1), newer);
        let mut j = 2;
        while j <= m + 1 {
            let (c, s, w) = (x.at(j), y.at(j), w.at(m + 1 - j));
            this[0].add_numbers(c, w);
            this[1].add_numbers(s, w);
            next[0].add_numbers(c, newer);
            next[1].add_numbers(s, newer);
            newer = w;
            j += 1;
        }
        ahead.turned = next;
        [this[0].found(), this[1].found()]
    }

    #[inline(always)]
    fn crossed(
        [re, im]: [&Self; 2],
        [rest_re, rest_im]: [&Self; 2],
        _scale: &(),
        m: usize,
        ahead: &mut SumsAhead<S>,
    ) -> InSlots<S> {
        if m == 0 {
            ahead.crossed = [Sum::ZERO; 2];
            return InSlots::ZERO;
        }
        let (x, y) = (re.powers((0, m + 1)), im.powers((0, m + 1)));
        let (u, v) = (rest_re.powers((0, m - 1)), rest_im.powers((0, m - 1)));
        if m % 2 == 1 {
            let [first, second] = &mut ahead.crossed;
            first.add_numbers(x.at(1), v.at(m - 1));
            second.add_numbers(y.at(1), u.at(m - 1));
            return first.found() - second.found();
        }
        let (mut this, mut next) = ([Sum::<S>::ZERO; 2], [Sum::<S>::ZERO; 2]);
        let (mut c, mut s) = (x.at(m + 1), y.at(m + 1));
        let mut i = 0;
        while i < m {
            let (u, v) = (u.at(i), v.at(i));
            next[0].add_numbers(c, v);
            next[1].add_numbers(s, u);
            (c, s) = (x.at(m - i), y.at(m - i));
            this[0].add_numbers(c, v);
            this[1].add_numbers(s, u);
            i += 1;
        }
        ahead.crossed = next;
        this[0].found() - this[1].found()
    }

    fn is_sound(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests;
