//! Dual numbers: a value and its derivatives in `D` directions at once, exact to rounding.
//!
//! ```text
//! (a, a') + (b, b') = (a + b, a' + b'),     (a, a') (b, b') = (a b, a b' + a' b),
//!     f(a, a') = (f(a), f'(a) a')
//! ```
//!
//! The equations of motion evaluated on them are their own Jacobian.  There are two kinds, with the same
//! arithmetic: beside a [`Dual`] masses, lengths and all other numbers of a scene are doubles; beside a
//! [`Varied`] number these have derivatives themselves.
//!
//! Source: A. Griewank, A. Walther, *Evaluating Derivatives*, 2nd ed. (2008), section 3.1 (vector mode).

use super::{DoubleDouble, Over, Real, Scalar};
use std::cmp::Ordering;
use std::fmt::Debug;
use std::marker::PhantomData;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// What the constants beside a dual number are.
pub trait ConstantKind: Clone + Copy + Debug + 'static {
    /// True where they have derivatives as well.
    const IS_VARIED: bool;
}

/// Doubles.
#[derive(Clone, Copy, Debug)]
pub struct Fixed;

/// Dual numbers of the same kind.
#[derive(Clone, Copy, Debug)]
pub struct Own;

impl ConstantKind for Fixed {
    const IS_VARIED: bool = false;
}

impl ConstantKind for Own {
    const IS_VARIED: bool = true;
}

/// A value with its derivatives in `D` directions.
#[derive(Clone, Copy, Debug)]
pub struct DualNumber<const D: usize, K> {
    /// The value.
    pub value: f64,
    /// Its derivatives.
    pub slope: [f64; D],
    kind: PhantomData<K>,
}

/// A dual number beside constants that are doubles.
pub type Dual<const D: usize> = DualNumber<D, Fixed>;

/// A dual number beside constants that are such numbers too.
pub type Varied<const D: usize> = DualNumber<D, Own>;

impl<const D: usize, K: ConstantKind> DualNumber<D, K> {
    /// From its value and its derivatives.
    #[inline(always)]
    pub fn new(value: f64, slope: [f64; D]) -> Self {
        Self { value, slope, kind: PhantomData }
    }

    /// A constant.
    #[inline(always)]
    pub fn constant(value: f64) -> Self {
        Self::new(value, [0.0; D])
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
        let mut slope = self.slope;
        for slope in &mut slope {
            *slope *= derivative;
        }
        Self::new(value, slope)
    }

    /// (a b, a b' + a' b).
    #[inline(always)]
    fn product(self, other: Self) -> Self {
        self.join(other, self.value * other.value, |a, b| a * other.value + b * self.value)
    }

    /// Slopes joined one by one.
    #[inline(always)]
    fn join(self, other: Self, value: f64, slope: impl Fn(f64, f64) -> f64) -> Self {
        // Loops over lanes become vectors, which closures of `from_fn` do not.
        let mut joined = self.slope;
        for lane in 0..D {
            joined[lane] = slope(self.slope[lane], other.slope[lane]);
        }
        Self::new(value, joined)
    }
}

impl<const D: usize, K: ConstantKind> Default for DualNumber<D, K> {
    fn default() -> Self {
        Self::ZERO
    }
}

impl<const D: usize, K: ConstantKind> Scalar for DualNumber<D, K> {
    const ZERO: Self = Self { value: 0.0, slope: [0.0; D], kind: PhantomData };
    const ONE: Self = Self { value: 1.0, slope: [0.0; D], kind: PhantomData };

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

    fn power_above_zero(self, exponent: Self) -> Self {
        let (x, p) = (self.value, exponent.value);
        let power = x.power_above_zero(p);
        let slope = p * x.power_above_zero(p - 1.0);
        let by_exponent = if x > 0.0 { power * Scalar::ln(x) } else { 0.0 };
        self.join(exponent, power, |rate, p_rate| slope * rate + by_exponent * p_rate)
    }
}

impl<const D: usize, K: ConstantKind> Real for DualNumber<D, K> {
    const IS_PLAIN: bool = false;
    const HAS_CONSTANTS: bool = K::IS_VARIED;

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
        (Self::constant(value.hi), Self::constant(value.lo))
    }

    #[inline(always)]
    fn double_double(self) -> DoubleDouble {
        DoubleDouble::of(self.value)
    }
}

impl<const D: usize> Over<Varied<D>> for Varied<D> {
    #[inline(always)]
    fn constant(value: Self) -> Self {
        value
    }

    #[inline(always)]
    fn by(self, factor: Self) -> Self {
        self * factor
    }
}

/// Numbers are compared by their values; of those that are constants too, zero is what stays zero.
impl<const D: usize, K: ConstantKind> PartialEq for DualNumber<D, K> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value && (!K::IS_VARIED || self.slope == other.slope)
    }
}

impl<const D: usize, K: ConstantKind> PartialOrd for DualNumber<D, K> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        let order = self.value.partial_cmp(&other.value);
        order.filter(|order| order.is_ne() || self == other)
    }
}

impl<const D: usize, K: ConstantKind> Add for DualNumber<D, K> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.join(other, self.value + other.value, |a, b| a + b)
    }
}

impl<const D: usize, K: ConstantKind> Sub for DualNumber<D, K> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.join(other, self.value - other.value, |a, b| a - b)
    }
}

impl<const D: usize, K: ConstantKind> Mul for DualNumber<D, K> {
    type Output = Self;
    // The product rule is a sum.
    #[allow(clippy::suspicious_arithmetic_impl)]
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.product(other)
    }
}

impl<const D: usize, K: ConstantKind> Div for DualNumber<D, K> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let (quotient, reciprocal) = (self.value / other.value, 1.0 / other.value);
        self.join(other, quotient, |a, b| (a - quotient * b) * reciprocal)
    }
}

impl<const D: usize, K: ConstantKind> Neg for DualNumber<D, K> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(-self.value, -1.0)
    }
}

crate::arithmetic::assign_by_operators!([const D: usize, K: ConstantKind] DualNumber<D, K>);

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
    fn a_constant_that_changes_is_not_zero() {
        let changing = Varied::<1>::unknown(0.0, 0);
        assert!(changing != Varied::ZERO && changing == changing && Varied::<1>::of(0.0) == Varied::ZERO);
        assert_eq!(changing.partial_cmp(&Varied::ZERO), None);
        assert!(Dual::<1>::unknown(0.0, 0) == Dual::ZERO);
    }

    #[test]
    fn an_unknown_beyond_the_directions_is_a_constant() {
        assert_eq!(Dual::<1>::unknown(3.0, 1).slope, [0.0]);
    }
}
