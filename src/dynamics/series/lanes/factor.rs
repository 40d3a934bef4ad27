//! Cauchy products of the series of eight motions.

use super::super::factors::CauchyFactor;
use super::number::InLanes;
use crate::arithmetic::Scalar;
use crate::arithmetic::lanes::wide::EightLanes;
use std::ops::RangeInclusive;

/// The powers of a series.
#[derive(Clone, Debug)]
pub struct FactorInLanes<W> {
    powers: Vec<W>,
    /// How many there are so far.
    count: usize,
}

/// Sums of the next order on their way: of the two components of z w, and of the two terms of z × R.
#[derive(Clone, Copy, Debug)]
pub struct LaneSumsAhead<W> {
    turned: [W; 2],
    crossed: [W; 2],
}

impl<W: EightLanes> Default for LaneSumsAhead<W> {
    fn default() -> Self {
        Self { turned: [W::ZERO; 2], crossed: [W::ZERO; 2] }
    }
}

// Iterators and closures are left out of these loops: they are not compiled into code for the vectors.

/// `Σ_j a_j b_{m-j}`, in two chains.
#[inline(always)]
fn sum<W: EightLanes>(a: &[W], b: &[W]) -> W {
    let count = a.len();
    let b = &b[..count];
    let (mut even, mut odd) = (W::ZERO, W::ZERO);
    let mut j = 0;
    while j + 1 < count {
        even = a[j].mul_add(b[count - 1 - j], even);
        odd = a[j + 1].mul_add(b[count - 2 - j], odd);
        j += 2;
    }
    if j < count {
        even = a[j].mul_add(b[count - 1 - j], even);
    }
    even.add(odd)
}

impl<W: EightLanes> FactorInLanes<W> {
    /// Powers so many to so many, which may be none.
    #[inline(always)]
    fn powers(&self, first: usize, last: usize) -> &[W] {
        &self.powers[first..=last]
    }
}

impl<W: EightLanes> CauchyFactor<InLanes<W>> for FactorInLanes<W> {
    type Scale = ();
    type Ahead = LaneSumsAhead<W>;

    fn new(order: usize) -> Self {
        Self { powers: vec![W::ZERO; order + 1], count: 0 }
    }

    #[inline(always)]
    fn restart(&mut self, _scale: &()) {
        self.count = 0;
    }

    #[inline(always)]
    fn push(&mut self, _scale: &(), power: InLanes<W>) {
        self.powers[self.count] = power.0;
        self.count += 1;
    }

    #[inline(always)]
    fn product(&self, other: &Self, _scale: &(), total: usize, of: RangeInclusive<usize>) -> InLanes<W> {
        let (first, last) = of.into_inner();
        if first > last {
            return InLanes::ZERO;
        }
        InLanes(sum(self.powers(first, last), other.powers(total - last, total - first)))
    }

    #[inline(always)]
    fn products(
        [a, b]: [&Self; 2],
        other: &Self,
        scale: &(),
        total: usize,
        of: RangeInclusive<usize>,
    ) -> [InLanes<W>; 2] {
        [a.product(other, scale, total, of.clone()), b.product(other, scale, total, of)]
    }

    #[inline(always)]
    fn sum_of_products(
        [[a, b], [c, d]]: [[&Self; 2]; 2],
        sign: f64,
        scale: &(),
        total: usize,
        of: RangeInclusive<usize>,
    ) -> InLanes<W> {
        let (one, two) = (a.product(b, scale, total, of.clone()), c.product(d, scale, total, of));
        if sign > 0.0 { one + two } else { one - two }
    }

    // An even order sums what is known of the next one too, so that each coefficient is loaded for both.
    #[inline(always)]
    fn turned(
        [re, im]: [&Self; 2],
        omega: &Self,
        _scale: &(),
        m: usize,
        ahead: &mut LaneSumsAhead<W>,
    ) -> [InLanes<W>; 2] {
        let (x, y, w) = (re.powers(0, m + 1), im.powers(0, m + 1), omega.powers(0, m));
        if m % 2 == 1 {
            let [c, s] = ahead.turned;
            let (c, s) = (x[1].mul_add(w[m], c), y[1].mul_add(w[m], s));
            return [InLanes(x[m + 1].mul_add(w[0], c)), InLanes(y[m + 1].mul_add(w[0], s))];
        }
        let (mut next_c, mut next_s) = (W::ZERO, W::ZERO);
        let mut newer = w[m];
        let (mut c, mut s) = (x[1].mul(newer), y[1].mul(newer));
        let mut j = 2;
        while j <= m + 1 {
            let (x, y, older) = (x[j], y[j], w[m + 1 - j]);
            (next_c, next_s) = (x.mul_add(newer, next_c), y.mul_add(newer, next_s));
            (c, s) = (x.mul_add(older, c), y.mul_add(older, s));
            newer = older;
            j += 1;
        }
        ahead.turned = [next_c, next_s];
        [InLanes(c), InLanes(s)]
    }

    #[inline(always)]
    fn crossed(
        [re, im]: [&Self; 2],
        [rest_re, rest_im]: [&Self; 2],
        _scale: &(),
        m: usize,
        ahead: &mut LaneSumsAhead<W>,
    ) -> InLanes<W> {
        if m == 0 {
            ahead.crossed = [W::ZERO; 2];
            return InLanes::ZERO;
        }
        let (x, y) = (re.powers(0, m + 1), im.powers(0, m + 1));
        let (u, v) = (rest_re.powers(0, m - 1), rest_im.powers(0, m - 1));
        if m % 2 == 1 {
            let [first, second] = ahead.crossed;
            let (first, second) = (x[1].mul_add(v[m - 1], first), y[1].mul_add(u[m - 1], second));
            return InLanes(first.sub(second));
        }
        let (mut first, mut second, mut next_first, mut next_second) = (W::ZERO, W::ZERO, W::ZERO, W::ZERO);
        let (mut c, mut s) = (x[m + 1], y[m + 1]);
        let mut i = 0;
        while i < m {
            let (u, v) = (u[i], v[i]);
            (next_first, next_second) = (c.mul_add(v, next_first), s.mul_add(u, next_second));
            (c, s) = (x[m - i], y[m - i]);
            (first, second) = (c.mul_add(v, first), s.mul_add(u, second));
            i += 1;
        }
        ahead.crossed = [next_first, next_second];
        InLanes(first.sub(second))
    }

    fn is_sound(&self) -> bool {
        true
    }
}
