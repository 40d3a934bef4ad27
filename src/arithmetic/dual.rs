//! Dual numbers: a value and its derivatives in `D` directions at once, exact to rounding.
//!
//! ```text
//! (a, a') + (b, b') = (a + b, a' + b'),     (a, a') (b, b') = (a b, a b' + a' b),     f(a, a') = (f(a), f'(a) a')
//! ```
//!
//! The equations of motion evaluated on them are their own Jacobian.
//!
//! Source: A. Griewank, A. Walther, *Evaluating Derivatives*, 2nd ed. (2008), section 3.1 (vector mode).

use super::{DoubleDouble, Real, Scalar};
use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A value with its derivatives in `D` directions.
#[derive(Clone, Copy, Debug)]
pub struct Dual<const D: usize> {
    /// The value.
    pub value: f64,
    /// Its derivatives.
    pub slope: [f64; D],
}

impl<const D: usize> Dual<D> {
    /// A constant.
    #[inline(always)]
    pub fn constant(value: f64) -> Self {
        Self { value, slope: [0.0; D] }
    }

    /// The unknown that is moved in direction `lane`; a constant where there is no such direction.
    #[inline(always)]
    pub fn unknown(value: f64, lane: usize) -> Self {
        let mut dual = Self::constant(value);
        if let Some(slope) = dual.slope.get_mut(lane) {
            *slope = 1.0;
        }
        dual
    }

    /// f(a) where f' is known.
    #[inline(always)]
    fn map(self, value: f64, derivative: f64) -> Self {
        Self { value, slope: self.slope.map(|slope| slope * derivative) }
    }

    /// (a b, a b' + a' b).
    #[inline(always)]
    fn product(self, other: Self) -> Self {
        self.join(other, self.value * other.value, |a, b| a * other.value + b * self.value)
    }

    /// Slopes joined one by one.
    #[inline(always)]
    fn join(self, other: Self, value: f64, slope: impl Fn(f64, f64) -> f64) -> Self {
        Self { value, slope: std::array::from_fn(|lane| slope(self.slope[lane], other.slope[lane])) }
    }
}

impl<const D: usize> Default for Dual<D> {
    fn default() -> Self {
        Self::ZERO
    }
}

impl<const D: usize> Scalar for Dual<D> {
    const ZERO: Self = Self { value: 0.0, slope: [0.0; D] };
    const ONE: Self = Self { value: 1.0, slope: [0.0; D] };

    #[inline(always)]
    fn of(value: f64) -> Self {
        Self::constant(value)
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
        let value = Scalar::exp(self.value);
        self.map(value, value)
    }

    fn ln(self) -> Self {
        self.map(Scalar::ln(self.value), 1.0 / self.value)
    }

    fn tanh(self) -> Self {
        let value = Scalar::tanh(self.value);
        self.map(value, 1.0 - value * value)
    }

    fn atan2(self, x: Self) -> Self {
        let square = x.value * x.value + self.value * self.value;
        self.join(x, Scalar::atan2(self.value, x.value), |y_rate, x_rate| {
            (x.value * y_rate - self.value * x_rate) / square
        })
    }
}

impl<const D: usize> Real for Dual<D> {
    const IS_PLAIN: bool = false;

    #[inline(always)]
    fn value(self) -> f64 {
        self.value
    }

    #[inline(always)]
    fn split(value: DoubleDouble) -> (Self, Self) {
        (Self::constant(value.hi), Self::constant(value.lo))
    }

    #[inline(always)]
    fn double_double(self) -> DoubleDouble {
        DoubleDouble::of(self.value)
    }
}

/// Numbers are compared by their values.
impl<const D: usize> PartialEq for Dual<D> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl<const D: usize> PartialOrd for Dual<D> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl<const D: usize> Add for Dual<D> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.join(other, self.value + other.value, |a, b| a + b)
    }
}

impl<const D: usize> Sub for Dual<D> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.join(other, self.value - other.value, |a, b| a - b)
    }
}

impl<const D: usize> Mul for Dual<D> {
    type Output = Self;
    // The product rule is a sum.
    #[allow(clippy::suspicious_arithmetic_impl)]
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.product(other)
    }
}

impl<const D: usize> Div for Dual<D> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let (quotient, reciprocal) = (self.value / other.value, 1.0 / other.value);
        self.join(other, quotient, |a, b| (a - quotient * b) * reciprocal)
    }
}

impl<const D: usize> Neg for Dual<D> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(-self.value, -1.0)
    }
}

impl<const D: usize> AddAssign for Dual<D> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const D: usize> SubAssign for Dual<D> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every operation once.
    fn formula<T: Scalar>(x: T, y: T) -> T {
        let (sin, cos) = (x * y).sin_cos();
        let mut sum = -sin / (y + T::ONE) + cos.scale(0.75);
        sum += (x * x + y).sqrt();
        sum -= x / y;
        sum
    }

    #[test]
    fn derivatives_agree_with_differences_in_double_double() {
        let (x, y, h) = (0.7, 1.3, 1e-9);
        let dual = formula(Dual::<2>::unknown(x, 0), Dual::unknown(y, 1));
        assert!((dual.value - formula(x, y)).abs() < 1e-15);
        let at = |dx: f64, dy: f64| formula(DoubleDouble::sum(x, dx), DoubleDouble::sum(y, dy));
        let differences =
            [at(h, 0.0) - at(-h, 0.0), at(0.0, h) - at(0.0, -h)].map(|change| (change.scale(0.5 / h)).hi);
        for (slope, difference) in dual.slope.into_iter().zip(differences) {
            assert!((slope - difference).abs() < 1e-14, "{slope} {difference}");
        }
    }

    #[test]
    fn an_unknown_beyond_the_directions_is_a_constant() {
        assert_eq!(Dual::<1>::unknown(3.0, 1).slope, [0.0]);
    }
}
