//! Double-double in lanes: unevaluated sums `hi + lo`.
//!
//! The operations are those of [`DoubleDouble`], less care for the last place: each is good to about 1e-31 of
//! its larger operand.

use crate::arithmetic::lanes::{Arithmetic, Lanes};
use crate::arithmetic::sum::WHOLE;
use crate::arithmetic::{DoubleDouble, Scalar};
use std::sync::LazyLock;

/// Leading parts, and what they leave out.
#[derive(Clone, Copy, Debug)]
pub struct Wide<L> {
    pub hi: L,
    pub lo: L,
}

impl<L: Arithmetic> Wide<L> {
    /// The numbers themselves.
    #[inline(always)]
    pub fn of(hi: L) -> Self {
        Self { hi, lo: L::splat(0.0) }
    }

    /// `hi + lo` where `hi` is the larger, brought into form.
    #[inline(always)]
    fn quick(hi: L, lo: L) -> Self {
        let (hi, lo) = hi.fast_two_sum(lo);
        Self { hi, lo }
    }

    /// `a + b` exactly.
    #[inline(always)]
    fn sum(a: L, b: L) -> Self {
        let (hi, lo) = a.two_sum(b);
        Self { hi, lo }
    }

    /// Sum.
    #[inline(always)]
    pub fn add(self, other: Self) -> Self {
        let sum = Self::sum(self.hi, other.hi);
        Self::quick(sum.hi, sum.lo.add(self.lo.add(other.lo)))
    }

    /// The number with the other sign.
    #[inline(always)]
    pub fn minus(self) -> Self {
        Self { hi: L::splat(0.0).sub(self.hi), lo: L::splat(0.0).sub(self.lo) }
    }

    /// Product with plain numbers.
    #[inline(always)]
    pub fn scale(self, factor: L) -> Self {
        let product = self.hi.mul(factor);
        let lost = self.hi.neg_mul_add(factor, product);
        Self::quick(product, self.lo.mul(factor).sub(lost))
    }

    /// Product.
    #[inline(always)]
    pub fn mul(self, other: Self) -> Self {
        let product = self.hi.mul(other.hi);
        let lost = self.hi.neg_mul_add(other.hi, product);
        Self::quick(product, self.hi.mul_add(other.lo, self.lo.mul(other.hi)).sub(lost))
    }

    /// `self + a b`, to be brought into form by [`Wide::formed`] after the last one.
    #[inline(always)]
    pub fn with(self, a: Self, b: Self) -> Self {
        let product = a.hi.mul(b.hi);
        let lost = a.hi.neg_mul_add(b.hi, product);
        let sum = Self::sum(self.hi, product);
        let low = a.lo.mul_add(b.hi, a.hi.mul_add(b.lo, self.lo));
        Self { hi: sum.hi, lo: low.add(sum.lo.sub(lost)) }
    }

    /// Brought into form.
    #[inline(always)]
    pub fn formed(self) -> Self {
        Self::quick(self.hi, self.lo)
    }
}

impl<L: Lanes> Wide<L> {
    /// From arrays of both parts.
    #[inline(always)]
    pub fn from(hi: [f64; 4], lo: [f64; 4]) -> Self {
        Self { hi: L::of(hi), lo: L::of(lo) }
    }

    /// One over the first number, in every lane.
    #[inline(always)]
    pub fn reciprocal(self) -> Self {
        let first = L::of([1.0 / self.hi.array()[0]; 4]);
        let rest = self.lo.neg_mul_add(first, self.hi.neg_mul_add(first, L::splat(1.0)));
        Self::quick(first, first.mul(rest))
    }

    /// `[1, 0, 3, 2]`.
    #[inline(always)]
    pub fn swap_pairs(self) -> Self {
        Self { hi: self.hi.swap_pairs(), lo: self.lo.swap_pairs() }
    }

    /// `[2, 3, 0, 1]`.
    #[inline(always)]
    pub fn swap_halves(self) -> Self {
        Self { hi: self.hi.swap_halves(), lo: self.lo.swap_halves() }
    }

    /// Sums within pairs, in both lanes of each.
    #[inline(always)]
    pub fn pair_sum(self) -> Self {
        self.add(self.swap_pairs())
    }
}

/// Parts of the circle whose unit vectors are tabulated.
const PARTS: usize = 256;

/// cos, sin, and what both leave out, at every part.
static CIRCLE: LazyLock<[[f64; 4]; PARTS]> = LazyLock::new(|| {
    let mut circle = [[0.0; 4]; PARTS];
    for (k, entry) in circle.iter_mut().enumerate() {
        let (sin, cos) = DoubleDouble::TAU.ldexp(1.0 / PARTS as f64).scale(k as f64).sin_cos();
        *entry = [cos.hi, sin.hi, cos.lo, sin.lo];
    }
    circle
});

/// A 256th of a turn.
const PART: DoubleDouble =
    DoubleDouble { hi: DoubleDouble::TAU.hi / PARTS as f64, lo: DoubleDouble::TAU.lo / PARTS as f64 };

/// Coefficients of (cos r - 1)/r² and (sin r - r)/r³ in powers of r², and what the first ones leave out.
const COEFFICIENTS: [[f64; 4]; 5] = {
    let mut coefficients = [[0.0; 4]; 5];
    let (mut k, mut factorial, mut sign) = (0, 1.0, -1.0);
    while k < 5 {
        let even = factorial * (2 * k + 2) as f64;
        factorial = even * (2 * k + 3) as f64;
        coefficients[k] = [sign / even, sign / factorial, sign / even, sign / factorial];
        sign = -sign;
        k += 1;
    }
    coefficients
};
const SIXTH_REST: f64 = -9.251_858_538_542_97e-18;

/// `[cos, sin, cos, sin]` of angles `[a, a, b, b]` \[rad\] in [-π, π], to 1e-25.
#[inline(always)]
pub fn unit<L: Lanes>(angle: Wide<L>) -> Wide<L> {
    let shift = L::splat(WHOLE);
    let k = angle.hi.mul_add(L::splat(PARTS as f64 / std::f64::consts::TAU), shift).sub(shift);
    let [a, _, b, _] = k.array();
    // Not a number lands somewhere and stays what it is in the remainder.
    let entry = |k: f64| CIRCLE[(k as i64).rem_euclid(PARTS as i64) as usize];
    let ([ca, sa, ca_low, sa_low], [cb, sb, cb_low, sb_low]) = (entry(a), entry(b));
    let r = angle.add(Wide::from([PART.hi; 4], [PART.lo; 4]).scale(k).minus());
    // [1, r] + r² [1, r] q.
    let z = r.mul(r);
    let base = Wide {
        hi: r.hi.mul_add(L::of([0.0, 1.0, 0.0, 1.0]), L::of([1.0, 0.0, 1.0, 0.0])),
        lo: r.lo.mul(L::of([0.0, 1.0, 0.0, 1.0])),
    };
    let [first, second, third, fourth, fifth] = COEFFICIENTS;
    let tail = L::of(fifth)
        .mul_add(z.hi, L::of(fourth))
        .mul_add(z.hi, L::of(third))
        .mul_add(z.hi, L::of(second))
        .mul(z.hi);
    let q = Wide::from(first, [0.0, SIXTH_REST, 0.0, SIXTH_REST]).add(Wide::of(tail));
    let turned = base.add(z.mul(base).mul(q));
    let (cosine, sine) = (
        Wide::from([ca, ca, cb, cb], [ca_low, ca_low, cb_low, cb_low]),
        Wide::from([-sa, sa, -sb, sb], [-sa_low, sa_low, -sb_low, sb_low]),
    );
    cosine.mul(turned).with(sine, turned.swap_pairs()).formed()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::lanes::{Arithmetic, Portable};
    use proptest::prelude::*;

    fn wide(value: DoubleDouble) -> Wide<Portable> {
        Wide { hi: Portable::splat(value.hi), lo: Portable::splat(value.lo) }
    }

    fn narrow(value: Wide<Portable>, lane: usize) -> DoubleDouble {
        DoubleDouble::sum(value.hi.array()[lane], value.lo.array()[lane])
    }

    fn pair() -> impl Strategy<Value = DoubleDouble> {
        (-3.0..3.0f64, -1.0..1.0f64).prop_map(|(hi, part)| DoubleDouble::sum(hi, part * hi.abs() * 1e-16))
    }

    proptest! {
        #[test]
        fn lanes_compute_as_double_double_does(a in pair(), b in pair(), c in pair()) {
            let close = |found: Wide<Portable>, exact: DoubleDouble,
            size: f64| (narrow(found, 2) - exact).hi.abs() <= 1e-30 * size;
            prop_assert!(close(wide(a).add(wide(b)), a + b, 6.0));
            prop_assert!(close(wide(a).mul(wide(b)), a * b, 9.0));
            prop_assert!(close(wide(a).with(wide(b), wide(c)).formed(), a + b * c, 12.0));
            prop_assert!(close(wide(a).scale(Portable::splat(b.hi)), a.scale(b.hi), 9.0));
            prop_assume!(a.hi.abs() > 1e-3);
            prop_assert!(close(wide(a).reciprocal(), DoubleDouble::ONE / a, 1.0 / a.hi.abs()));
        }

        #[test]
        fn unit_vectors_have_twenty_four_digits(a in pair()) {
            let found = unit(wide(a));
            let (sin, cos) = a.sin_cos();
            for (lane, exact) in [cos, sin, cos, sin].into_iter().enumerate() {
                let error = (narrow(found, lane) - exact).hi.abs();
                prop_assert!(error < 1e-24, "{a:?}: {error:e}");
            }
        }
    }

    #[test]
    fn the_ends_of_the_range_and_not_a_number() {
        for angle in [DoubleDouble::PI, -DoubleDouble::PI, DoubleDouble::ZERO] {
            let (sin, cos) = angle.sin_cos();
            let found = unit(wide(angle));
            assert!((narrow(found, 0) - cos).hi.abs() < 1e-24 && (narrow(found, 1) - sin).hi.abs() < 1e-24);
        }
        assert!(unit(wide(DoubleDouble::of(f64::NAN))).hi.array().iter().all(|x| x.is_nan()));
    }
}
