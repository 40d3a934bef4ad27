//! Numbers: the scalar trait the physics is written over, and the exact building blocks of long sums.
//!
//! Every formula of [`dynamics`](crate::dynamics) is written once over [`Scalar`] and evaluated on `f64`
//! (inner loops), on [`DoubleDouble`] (monitors, references), on [`Dual`] numbers (Jacobians), on
//! [`Eight`](eight::Eight) lanes and their [`Pairs`](pairs::Pairs) (stages of implicit methods), on
//! numbers of any number of digits (module `digits`), and on [`Varied`] ones, beside which the constants
//! of a scene are such numbers as well: [`Over`].
//!
//! Two rules keep the bits the same on every machine: trigonometry comes from pure Rust (the `libm` crate, or
//! our own series in lanes and in double-double), and a fused multiply-add is written as one wherever it is
//! used ([`sum::fused`], [`lanes`]), never left to the compiler: it is rounded once by definition, so it
//! makes no difference to the bits whether the processor has the instruction.

#[doc(hidden)]
pub mod angle;
#[doc(hidden)]
pub mod complex;
#[cfg(feature = "digits")]
#[doc(hidden)]
pub mod digits;
#[doc(hidden)]
pub mod double_double;
#[doc(hidden)]
pub mod dual;
#[doc(hidden)]
pub mod eight;
mod elementary;
#[doc(hidden)]
pub mod lanes;
#[doc(hidden)]
pub mod pairs;
pub(crate) mod scratch;
pub(crate) mod shown;
#[doc(hidden)]
pub mod sincos;
#[doc(hidden)]
pub mod sum;
#[doc(hidden)]
pub mod tape;

pub use complex::Complex;
pub use double_double::DoubleDouble;
pub use dual::{Dual, Varied};

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Assignments of a number by its operators.
macro_rules! assign_by_operators {
    ([$($generics:tt)*] $number:ty) => {
        impl<$($generics)*> std::ops::AddAssign for $number {
            #[inline(always)]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }

        impl<$($generics)*> std::ops::SubAssign for $number {
            #[inline(always)]
            fn sub_assign(&mut self, other: Self) {
                *self = *self - other;
            }
        }
    };
}
pub(crate) use assign_by_operators;

/// A number the equations of motion can be evaluated on.
///
/// No comparison is asked for, so that vectors of lanes can be scalars; what needs an order asks for
/// [`Real`].
pub trait Scalar:
    Copy
    + Debug
    + Default
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;

    /// The number itself, exactly.
    fn of(value: f64) -> Self;

    /// Product with a plain number (cheaper than a full product in double-double).
    fn scale(self, factor: f64) -> Self;

    /// Square root; not a number below zero.
    fn sqrt(self) -> Self;

    /// Sine and cosine of an angle \[rad\], in this order.
    fn sin_cos(self) -> (Self, Self);

    /// e to this power.
    fn exp(self) -> Self;

    /// Natural logarithm; NaN below zero.
    fn ln(self) -> Self;

    /// Hyperbolic tangent.
    fn tanh(self) -> Self;

    /// The angle \[rad\] of the vector (`x`, `self`), in (-π, π].
    fn atan2(self, x: Self) -> Self;

    /// Tangent of an angle \[rad\].
    fn tan(self) -> Self {
        let (sin, cos) = self.sin_cos();
        sin / cos
    }

    /// A whole power, by squaring.
    fn powi(self, exponent: i32) -> Self {
        let (mut power, mut factor, mut left) = (Self::ONE, self, exponent.unsigned_abs());
        while left > 0 {
            if left % 2 == 1 {
                power = power * factor;
            }
            left /= 2;
            if left > 0 {
                factor = factor * factor;
            }
        }
        if exponent < 0 { Self::ONE / power } else { power }
    }

    /// Any power of a positive number.
    fn powf(self, exponent: f64) -> Self {
        self.ln().scale(exponent).exp()
    }

    /// The same of a base that conditions hold at zero or above, whatever rounding and trial steps make of
    /// it: zero at zero and below.  The exponent does not change with time.
    fn power_above_zero(self, exponent: Self) -> Self {
        (self.ln() * exponent).exp()
    }
}

/// What [`Scalar::power_above_zero`] is for numbers with an order; roots by their own function.
pub(crate) fn power_above_zero<T: Real>(base: T, exponent: T) -> T {
    let half = T::of(0.5);
    if base <= T::ZERO {
        T::ZERO
    } else if exponent == half {
        base.sqrt()
    } else if exponent == -half {
        T::ONE / base.sqrt()
    } else {
        (base.ln() * exponent).exp()
    }
}

/// A scalar that constants of the kind `C` go with: doubles with every scalar, numbers of many digits with
/// their own.
pub trait Over<C>: Scalar {
    /// The constant itself.
    fn constant(value: C) -> Self;

    /// The product with a constant.
    fn by(self, factor: C) -> Self;
}

impl<T: Scalar> Over<f64> for T {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        T::of(value)
    }

    #[inline(always)]
    fn by(self, factor: f64) -> Self {
        self.scale(factor)
    }
}

/// The largest rate of a base in doubles, over itself \[1/s\], whose fractional powers are expanded.
const STEEPEST: f64 = 1e10;

/// A scalar with an order and a nearest `f64`.
pub trait Real: Scalar + PartialOrd {
    /// True for `f64` itself, for which there are kernels of lanes.
    const IS_PLAIN: bool;
    /// True for numbers whose series are multiplied as factors: those that constants of a scene are too, of
    /// many digits or with derivatives, and lanes of several motions.
    const HAS_CONSTANTS: bool = false;
    /// Share of its scale below which the pivot of a constraint counts as zero.
    const DROPPED: f64 = 1e-8;

    /// The nearest `f64`.
    fn value(self) -> f64;

    /// True for a base so near above zero, beside its rate, that its fractional powers are not expanded:
    /// their series leave the range of exponents, or the base is rounding.
    #[inline(always)]
    fn is_steep(self, rate: Self) -> bool {
        rate.value().abs() > STEEPEST * self.value()
    }

    /// A double-double in this type: the nearest value, and what that leaves over.
    fn split(value: DoubleDouble) -> (Self, Self);

    /// The number as a double-double, exactly.
    fn double_double(self) -> DoubleDouble;

    /// The product with a number that is the same whatever a scene says.
    #[inline(always)]
    fn times_fraction(self, fraction: Self) -> Self {
        self * fraction
    }

    /// The quotient by a whole number whose reciprocal is `fraction`.
    #[inline(always)]
    fn divided(self, k: usize, fraction: Self) -> Self {
        if Self::IS_PLAIN && k < 13 { self / Self::of(k as f64) } else { self.times_fraction(fraction) }
    }

    /// Σ a b.
    #[inline]
    fn sum_of_products<'a>(terms: impl Iterator<Item = (&'a Self, &'a Self)> + Clone) -> Self {
        terms.fold(Self::ZERO, |sum, (&a, &b)| sum + a * b)
    }

    /// Magnitude.
    fn abs(self) -> Self {
        if self < Self::ZERO { -self } else { self }
    }

    /// Writes the unit vectors at many angles \[rad\]; plain doubles are taken four at a time.
    fn units(angles: &[Self], units: &mut [Complex<Self>]) {
        for (unit, &angle) in units.iter_mut().zip(angles) {
            *unit = Complex::unit(angle);
        }
    }
}

impl Scalar for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        self * factor
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        libm::sincos(self)
    }

    #[inline(always)]
    fn exp(self) -> Self {
        libm::exp(self)
    }

    #[inline(always)]
    fn ln(self) -> Self {
        libm::log(self)
    }

    #[inline(always)]
    fn tanh(self) -> Self {
        libm::tanh(self)
    }

    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        libm::atan2(self, x)
    }

    fn power_above_zero(self, exponent: Self) -> Self {
        power_above_zero(self, exponent)
    }
}

impl Real for f64 {
    const IS_PLAIN: bool = true;

    #[inline(always)]
    fn value(self) -> f64 {
        self
    }

    #[inline(always)]
    fn split(value: DoubleDouble) -> (Self, Self) {
        (value.hi, value.lo)
    }

    #[inline(always)]
    fn double_double(self) -> DoubleDouble {
        DoubleDouble::of(self)
    }

    fn units(angles: &[Self], units: &mut [Complex<Self>]) {
        sincos::units(angles, units);
    }
}
