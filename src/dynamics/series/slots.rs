//! Numbers with derivatives in the processor's registers: the arithmetic of those in memory, products fused.

use super::varied::Number;
use crate::arithmetic::lanes::wide::Slots;
use crate::arithmetic::{DoubleDouble, Over, Real, Scalar};
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number whose derivatives are in slots.
#[derive(Clone, Copy, Debug)]
pub struct InSlots<S> {
    pub(super) slope: S,
    pub(super) value: f64,
}

impl<S: Slots> InSlots<S> {
    /// From its value and its derivatives.
    #[inline(always)]
    pub(super) fn new(value: f64, slope: S) -> Self {
        Self { slope, value }
    }

    /// From memory.
    #[inline(always)]
    pub fn load(number: &Number) -> Self {
        Self::new(number.value, S::of(&number.slope))
    }

    /// To memory.
    #[inline(always)]
    pub fn store(self) -> Number {
        Number::new(self.value, self.slope.array())
    }

    /// f(a) where f' is known.
    #[inline(always)]
    fn map(self, value: f64, derivative: f64) -> Self {
        Self::new(value, self.slope.mul(S::splat(derivative)))
    }

    /// A function that is seldom asked for.
    #[inline(never)]
    fn seldom(self, f: impl Fn(Number) -> Number) -> Self {
        Self::load(&f(self.store()))
    }
}

impl<S: Slots> Default for InSlots<S> {
    #[inline(always)]
    fn default() -> Self {
        Self::ZERO
    }
}

impl<S: Slots> Scalar for InSlots<S> {
    const ZERO: Self = Self { slope: S::ZERO, value: 0.0 };
    const ONE: Self = Self { slope: S::ZERO, value: 1.0 };

    #[inline(always)]
    fn of(value: f64) -> Self {
        Self::new(value, S::ZERO)
    }

    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        self.map(self.value * factor, factor)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.map(root, 0.5 / root)
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = Scalar::sin_cos(self.value);
        (self.map(sin, cos), self.map(cos, -sin))
    }

    fn exp(self) -> Self {
        self.seldom(Scalar::exp)
    }

    fn ln(self) -> Self {
        self.seldom(Scalar::ln)
    }

    fn tanh(self) -> Self {
        self.seldom(Scalar::tanh)
    }

    fn atan2(self, x: Self) -> Self {
        let x = x.store();
        self.seldom(|y| y.atan2(x))
    }

    fn power_above_zero(self, exponent: Self) -> Self {
        let exponent = exponent.store();
        self.seldom(|base| base.power_above_zero(exponent))
    }
}

impl<S: Slots> Real for InSlots<S> {
    const IS_PLAIN: bool = false;
    const HAS_CONSTANTS: bool = true;

    #[inline(always)]
    fn value(self) -> f64 {
        self.value
    }

    #[inline(always)]
    fn times_fraction(self, fraction: Self) -> Self {
        self.scale(fraction.value)
    }

    #[inline(always)]
    fn split(value: DoubleDouble) -> (Self, Self) {
        (Self::of(value.hi), Self::of(value.lo))
    }

    #[inline(always)]
    fn double_double(self) -> DoubleDouble {
        DoubleDouble::of(self.value)
    }
}

impl<S: Slots> Over<Number> for InSlots<S> {
    #[inline(always)]
    fn constant(value: Number) -> Self {
        Self::load(&value)
    }

    #[inline(always)]
    fn by(self, factor: Number) -> Self {
        self * Self::load(&factor)
    }
}

/// As numbers in memory are compared.
impl<S: Slots> PartialEq for InSlots<S> {
    #[inline(always)]
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value && self.slope.array() == other.slope.array()
    }
}

impl<S: Slots> PartialOrd for InSlots<S> {
    #[inline(always)]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        let order = self.value.partial_cmp(&other.value);
        order.filter(|order| order.is_ne() || self == other)
    }
}

impl<S: Slots> Add for InSlots<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.value + other.value, self.slope.add(other.slope))
    }
}

impl<S: Slots> Sub for InSlots<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.value - other.value, self.slope.sub(other.slope))
    }
}

impl<S: Slots> Mul for InSlots<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let half = other.slope.mul(S::splat(self.value));
        Self::new(self.value * other.value, self.slope.mul_add(S::splat(other.value), half))
    }
}

impl<S: Slots> Div for InSlots<S> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let (quotient, reciprocal) = (self.value / other.value, 1.0 / other.value);
        let slope = other.slope.neg_mul_add(S::splat(quotient), self.slope);
        Self::new(quotient, slope.mul(S::splat(reciprocal)))
    }
}

impl<S: Slots> Neg for InSlots<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.value, S::ZERO.sub(self.slope))
    }
}

crate::arithmetic::assign_by_operators!([S: Slots] InSlots<S>);
