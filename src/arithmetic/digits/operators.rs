//! Operators, order, and what every scalar has.

use super::convolution::{product, sum_of_products, times_whole};
use super::quotient::{quotient, square_root};
use super::{Digits, DigitsKind, TWO_64, decimal_places, elementary};
use crate::arithmetic::{DoubleDouble, Over, Real, Scalar};
use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

impl<const W: usize> std::fmt::Debug for Digits<W> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        formatter.write_str(&self.to_decimal(decimal_places(self.limbs())))
    }
}

impl<const W: usize> Default for Digits<W> {
    fn default() -> Self {
        Self::ZERO
    }
}

impl<const W: usize> PartialEq for Digits<W> {
    fn eq(&self, other: &Self) -> bool {
        self.partial_cmp(other) == Some(Ordering::Equal)
    }
}

impl<const W: usize> PartialOrd for Digits<W> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        let rank = |kind| match kind {
            DigitsKind::Negative => -1,
            DigitsKind::Zero => 0,
            _ => 1,
        };
        match (self.kind, other.kind) {
            (DigitsKind::NotFinite, _) | (_, DigitsKind::NotFinite) => None,
            (DigitsKind::Positive, DigitsKind::Positive) => Some(self.cmp_magnitude(other)),
            (DigitsKind::Negative, DigitsKind::Negative) => Some(other.cmp_magnitude(self)),
            (a, b) => Some(rank(a).cmp(&rank(b))),
        }
    }
}

impl<const W: usize> Add for Digits<W> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::sum(&self, &other, false)
    }
}

impl<const W: usize> Sub for Digits<W> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::sum(&self, &other, true)
    }
}

impl<const W: usize> Mul for Digits<W> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        product(&self, &other)
    }
}

impl<const W: usize> Div for Digits<W> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        quotient(self, other)
    }
}

impl<const W: usize> Neg for Digits<W> {
    type Output = Self;
    fn neg(mut self) -> Self {
        self.kind = match self.kind {
            DigitsKind::Positive => DigitsKind::Negative,
            DigitsKind::Negative => DigitsKind::Positive,
            kind => kind,
        };
        self
    }
}

impl<const W: usize> AddAssign for Digits<W> {
    fn add_assign(&mut self, other: Self) {
        *self = Self::sum(self, &other, false);
    }
}

impl<const W: usize> SubAssign for Digits<W> {
    fn sub_assign(&mut self, other: Self) {
        *self = Self::sum(self, &other, true);
    }
}

impl<const W: usize> Scalar for Digits<W> {
    const ZERO: Self = Self { exponent: 0, limbs: W as u32, kind: DigitsKind::Zero, limb: [0; W] };
    const ONE: Self = {
        let mut limb = [0; W];
        limb[0] = 1;
        Self { exponent: 1, limbs: W as u32, kind: DigitsKind::Positive, limb }
    };

    fn of(value: f64) -> Self {
        if !value.is_finite() {
            return Self::NAN;
        }
        let (fraction, power) = libm::frexp(value.abs());
        let whole = Self::whole((fraction * 9_007_199_254_740_992.0) as u64).ldexp(power - 53);
        if value < 0.0 { -whole } else { whole }
    }

    fn scale(self, factor: f64) -> Self {
        // Most factors are 1, 2, 1/2 or small whole numbers.
        if factor.fract() == 0.0 && factor.abs() < 9e15 {
            let scaled = times_whole(&self, factor.abs() as u64);
            return if factor < 0.0 { -scaled } else { scaled };
        }
        self * Self::of(factor)
    }

    fn sqrt(self) -> Self {
        square_root(self)
    }

    fn sin_cos(self) -> (Self, Self) {
        elementary::sin_cos(self)
    }

    fn exp(self) -> Self {
        elementary::exp(self)
    }

    fn ln(self) -> Self {
        elementary::ln(self)
    }

    fn tanh(self) -> Self {
        elementary::tanh(self)
    }

    fn atan2(self, x: Self) -> Self {
        elementary::atan2(self, x)
    }

    fn powf(self, exponent: f64) -> Self {
        (self.ln() * Self::of(exponent)).exp()
    }

    fn power_above_zero(self, exponent: Self) -> Self {
        crate::arithmetic::power_above_zero(self, exponent)
    }
}

impl<const W: usize> Over<Digits<W>> for Digits<W> {
    #[inline(always)]
    fn constant(value: Self) -> Self {
        value
    }

    #[inline(always)]
    fn by(self, factor: Self) -> Self {
        self * factor
    }
}

/// Part of the bits in which a base is told from rounding.
const SURE: f64 = 0.75;

impl<const W: usize> Real for Digits<W> {
    const IS_PLAIN: bool = false;
    const HAS_CONSTANTS: bool = true;
    /// Rounding leaves far less of a pivot that is zero.
    const DROPPED: f64 = 1e-40;

    fn is_steep(self, rate: Self) -> bool {
        let bits = 64.0 * (self.limbs() - 1) as f64;
        rate.log2() - self.log2() > SURE * bits
    }

    fn value(self) -> f64 {
        if self.kind == DigitsKind::NotFinite {
            return f64::NAN;
        }
        let top: f64 = self.limb.iter().take(3).rev().fold(0.0, |sum, &limb| sum / TWO_64 + limb as f64);
        let power = 64 * (self.exponent - 1).clamp(-40, 40);
        let size = libm::ldexp(top, power);
        if self.is_negative() { -size } else { size }
    }

    fn split(value: DoubleDouble) -> (Self, Self) {
        (Self::of(value.hi) + Self::of(value.lo), Self::ZERO)
    }

    fn double_double(self) -> DoubleDouble {
        let hi = self.value();
        if !hi.is_finite() {
            DoubleDouble::of(hi)
        } else {
            DoubleDouble::sum(hi, (self - Self::of(hi)).value())
        }
    }

    fn abs(self) -> Self {
        if self.is_negative() { -self } else { self }
    }

    fn sum_of_products<'a>(terms: impl Iterator<Item = (&'a Self, &'a Self)> + Clone) -> Self {
        sum_of_products(terms)
    }
}
