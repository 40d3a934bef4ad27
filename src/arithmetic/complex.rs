//! Complex numbers as plane vectors: `e = exp(i phi)` is a body's direction, `i e` its left normal.
//!
//! Own, because it has to work over every [`Scalar`]; the few operations the equations use.

use super::{Over, Scalar};
use std::ops::{Add, Mul, Neg, Sub};

/// `re + i im`; as a vector of the plane `(x, y)`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Complex<T> {
    /// x component.
    pub re: T,
    /// y component.
    pub im: T,
}

impl<T: Scalar> Complex<T> {
    /// The zero vector.
    pub const ZERO: Self = Self { re: T::ZERO, im: T::ZERO };

    /// From components.
    #[inline(always)]
    pub fn new(re: T, im: T) -> Self {
        Self { re, im }
    }

    /// From constant components, exactly.
    #[inline(always)]
    pub fn of<C>(value: Complex<C>) -> Self
    where
        T: Over<C>,
    {
        Self { re: T::constant(value.re), im: T::constant(value.im) }
    }

    /// The unit vector at an angle \[rad\].
    #[inline(always)]
    pub fn unit(angle: T) -> Self {
        let (sin, cos) = angle.sin_cos();
        Self { re: cos, im: sin }
    }

    /// Mirror image at the x axis.
    #[inline(always)]
    pub fn conj(self) -> Self {
        Self { re: self.re, im: -self.im }
    }

    /// The vector turned left by a right angle, `i z`.
    #[inline(always)]
    pub fn left(self) -> Self {
        Self { re: -self.im, im: self.re }
    }

    /// Product with a scalar.
    #[inline(always)]
    pub fn times(self, factor: T) -> Self {
        Self { re: self.re * factor, im: self.im * factor }
    }

    /// Product with a complex constant.
    #[inline(always)]
    pub fn turn<C: Copy>(self, by: Complex<C>) -> Self
    where
        T: Over<C>,
    {
        Self { re: self.re.by(by.re) - self.im.by(by.im), im: self.re.by(by.im) + self.im.by(by.re) }
    }

    /// Dot product of two vectors, `Re(conj(a) b)`.
    #[inline(always)]
    pub fn dot(self, other: Self) -> T {
        self.re * other.re + self.im * other.im
    }

    /// Cross product of two vectors, `Im(conj(a) b)`: positive where `b` lies to the left of `a`.
    #[inline(always)]
    pub fn cross(self, other: Self) -> T {
        self.re * other.im - self.im * other.re
    }

    /// Squared length.
    #[inline(always)]
    pub fn norm_squared(self) -> T {
        self.dot(self)
    }
}

impl<T: Scalar> Add for Complex<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { re: self.re + other.re, im: self.im + other.im }
    }
}

impl<T: Scalar> Sub for Complex<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { re: self.re - other.re, im: self.im - other.im }
    }
}

impl<T: Scalar> Mul for Complex<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { re: self.re * other.re - self.im * other.im, im: self.re * other.im + self.im * other.re }
    }
}

impl<T: Scalar> Neg for Complex<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { re: -self.re, im: -self.im }
    }
}

crate::arithmetic::assign_by_operators!([T: Scalar] Complex<T>);
