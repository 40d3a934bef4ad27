//! Eight lanes of high and low parts: a quick double-double whose rounding errors are a few 2⁻¹⁰⁵ of the
//! operands.
//!
//! Quicker than [`DoubleDouble`] and less exact where leading parts cancel, and its sine and cosine carry
//! about 66 bits: enough for what doubles drop at the last evaluations of an implicit step, not for
//! references.
//!
//! Source: T. J. Dekker, *A floating-point technique for extending the available precision*, Numer. Math. 18
//! (1971), add2, mul2, div2, sqrt2, with fused multiply-adds.

use super::eight::{Eight, Lanewise, Octet};
use super::lanes::Lanes;
use super::{DoubleDouble, Scalar, sincos};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// `high + low` in eight lanes.
#[derive(Clone, Copy, Debug)]
pub struct Pairs<L> {
    /// Leading parts.
    pub high: Eight<L>,
    /// What they leave out.
    pub low: Eight<L>,
}

impl<L: Lanes> Pairs<L> {
    /// `high + low` where `|high| >= |low|`, normalized.
    #[inline(always)]
    fn quick(high: Eight<L>, low: Eight<L>) -> Self {
        let (high, low) = high.fast_two_sum(low);
        Self { high, low }
    }

    /// A function of every lane and that of another number by itself.
    fn each(self, other: Self, f: impl Fn(DoubleDouble, DoubleDouble) -> DoubleDouble) -> Self {
        let memory = |x: Self| {
            let (mut high, mut low) = (Octet::default(), Octet::default());
            x.store(&mut high, &mut low);
            std::array::from_fn::<_, { super::eight::LANES }, _>(|lane| {
                DoubleDouble::sum(high.0[lane], low.0[lane])
            })
        };
        let (a, b) = (memory(self), memory(other));
        let found = std::array::from_fn::<_, { super::eight::LANES }, _>(|lane| f(a[lane], b[lane]));
        Self::load(&Octet(found.map(|x| x.hi)), &Octet(found.map(|x| x.lo)))
    }
}

impl<L: Lanes> Default for Pairs<L> {
    fn default() -> Self {
        Self::ZERO
    }
}

impl<L: Lanes> Lanewise for Pairs<L> {
    #[inline(always)]
    fn load(high: &Octet, low: &Octet) -> Self {
        Self { high: Eight(high.halves()), low: Eight(low.halves()) }
    }

    #[inline(always)]
    fn store(self, high: &mut Octet, low: &mut Octet) {
        (*high, *low) = (Octet::of(self.high.0), Octet::of(self.low.0));
    }
}

impl<L: Lanes> Scalar for Pairs<L> {
    const ZERO: Self = Self { high: Eight::ZERO, low: Eight::ZERO };
    const ONE: Self = Self { high: Eight::ONE, low: Eight::ZERO };

    #[inline(always)]
    fn of(value: f64) -> Self {
        Self { high: Eight::of(value), low: Eight::ZERO }
    }

    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        let factor = Eight::of(factor);
        let product = self.high * factor;
        Self::quick(product, self.low.mul_add(factor, self.high.mul_add(factor, -product)))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.high.sqrt();
        let rest = root.neg_mul_add(root, self.high) + self.low;
        Self::quick(root, rest / (root + root))
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sin0, cos0) = sincos::sin_cos_pair([self.high.0[0], self.low.0[0]]);
        let (sin1, cos1) = sincos::sin_cos_pair([self.high.0[1], self.low.0[1]]);
        let join = |a: [L; 2], b: [L; 2]| Self { high: Eight([a[0], b[0]]), low: Eight([a[1], b[1]]) };
        (join(sin0, sin1), join(cos0, cos1))
    }

    fn exp(self) -> Self {
        self.each(self, |x, _| x.exp())
    }

    fn ln(self) -> Self {
        self.each(self, |x, _| x.ln())
    }

    fn tanh(self) -> Self {
        self.each(self, |x, _| x.tanh())
    }

    fn atan2(self, x: Self) -> Self {
        self.each(x, DoubleDouble::atan2)
    }

    fn power_above_zero(self, exponent: Self) -> Self {
        self.each(exponent, DoubleDouble::power_above_zero)
    }
}

impl<L: Lanes> Add for Pairs<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (sum, error) = self.high.two_sum(other.high);
        Self::quick(sum, error + (self.low + other.low))
    }
}

impl<L: Lanes> Sub for Pairs<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl<L: Lanes> Mul for Pairs<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let product = self.high * other.high;
        let error = self.high.mul_add(other.high, -product);
        Self::quick(product, self.low.mul_add(other.high, self.high.mul_add(other.low, error)))
    }
}

impl<L: Lanes> Div for Pairs<L> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let quotient = self.high / other.high;
        let rest = quotient.neg_mul_add(other.high, self.high) + quotient.neg_mul_add(other.low, self.low);
        Self::quick(quotient, rest / other.high)
    }
}

impl<L: Lanes> Neg for Pairs<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

crate::arithmetic::assign_by_operators!([L: Lanes] Pairs<L>);
