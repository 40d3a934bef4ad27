//! Eight doubles as one scalar: the stages of an implicit step, evaluated together by the same formulas as a
//! single number.
//!
//! Each lane has the bits it would have alone: no operation mixes lanes.

use super::lanes::Lanes;
use super::{Scalar, sincos};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Lanes of an [`Octet`].
pub const LANES: usize = 8;

/// Eight doubles in memory, one a lane, on a line of the cache of their own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(64))]
pub struct Octet(pub [f64; LANES]);

impl Octet {
    /// The same number in every lane.
    pub fn splat(value: f64) -> Self {
        Self([value; LANES])
    }

    /// The largest magnitude of all lanes that are numbers.
    pub fn size(&self) -> f64 {
        self.0.iter().fold(0.0, |size, lane| lane.abs().max(size))
    }

    /// The two halves.
    #[inline(always)]
    pub fn halves<L: Lanes>(&self) -> [L; 2] {
        let [a, b, c, d, e, f, g, h] = self.0;
        [L::of([a, b, c, d]), L::of([e, f, g, h])]
    }

    /// Of two halves.
    #[inline(always)]
    pub fn of<L: Lanes>(halves: [L; 2]) -> Self {
        let ([a, b, c, d], [e, f, g, h]) = (halves[0].array(), halves[1].array());
        Self([a, b, c, d, e, f, g, h])
    }
}

/// A scalar of eight lanes, kept in memory as leading parts and what they leave out.
pub trait Lanewise: Scalar {
    /// From memory; a plain scalar does not look at `low`.
    fn load(high: &Octet, low: &Octet) -> Self;
    /// To memory; a plain scalar leaves `low` alone.
    fn store(self, high: &mut Octet, low: &mut Octet);
}

/// Eight doubles in two vectors.
#[derive(Clone, Copy, Debug)]
pub struct Eight<L>(pub [L; 2]);

impl<L: Lanes> Eight<L> {
    /// A function of every lane by itself.
    fn each(self, f: impl Fn(f64) -> f64) -> Self {
        Self(Octet(Octet::of(self.0).0.map(f)).halves())
    }

    /// `self · factor + addend`, rounded once.
    #[inline(always)]
    pub fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self([self.0[0].mul_add(factor.0[0], addend.0[0]), self.0[1].mul_add(factor.0[1], addend.0[1])])
    }

    /// `addend - self · factor`, rounded once.
    #[inline(always)]
    pub fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
        Self([
            self.0[0].neg_mul_add(factor.0[0], addend.0[0]),
            self.0[1].neg_mul_add(factor.0[1], addend.0[1]),
        ])
    }

    /// The sum and its error, exactly.
    #[inline(always)]
    pub fn two_sum(self, other: Self) -> (Self, Self) {
        let (first, second) = (self.0[0].two_sum(other.0[0]), self.0[1].two_sum(other.0[1]));
        (Self([first.0, second.0]), Self([first.1, second.1]))
    }

    /// The same where `|self| >= |other|`.
    #[inline(always)]
    pub fn fast_two_sum(self, other: Self) -> (Self, Self) {
        let (first, second) = (self.0[0].fast_two_sum(other.0[0]), self.0[1].fast_two_sum(other.0[1]));
        (Self([first.0, second.0]), Self([first.1, second.1]))
    }
}

impl<L: Lanes> Default for Eight<L> {
    fn default() -> Self {
        Self::ZERO
    }
}

impl<L: Lanes> Lanewise for Eight<L> {
    #[inline(always)]
    fn load(high: &Octet, _low: &Octet) -> Self {
        Self(high.halves())
    }

    #[inline(always)]
    fn store(self, high: &mut Octet, _low: &mut Octet) {
        *high = Octet::of(self.0);
    }
}

impl<L: Lanes> Scalar for Eight<L> {
    const ZERO: Self = Self([L::ZERO; 2]);
    const ONE: Self = Self([L::ONE; 2]);

    #[inline(always)]
    fn of(value: f64) -> Self {
        Self([L::splat(value); 2])
    }

    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        self * Self::of(factor)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self([self.0[0].sqrt(), self.0[1].sqrt()])
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let ((s0, c0), (s1, c1)) = (sincos::sin_cos(self.0[0], L::ZERO), sincos::sin_cos(self.0[1], L::ZERO));
        (Self([s0, s1]), Self([c0, c1]))
    }

    fn exp(self) -> Self {
        self.each(Scalar::exp)
    }

    fn ln(self) -> Self {
        self.each(Scalar::ln)
    }

    fn tanh(self) -> Self {
        self.each(Scalar::tanh)
    }

    fn atan2(self, x: Self) -> Self {
        let (Octet(y), Octet(x)) = (Octet::of(self.0), Octet::of(x.0));
        Self(Octet(std::array::from_fn(|lane| Scalar::atan2(y[lane], x[lane]))).halves())
    }

    fn power_above_zero(self, exponent: Self) -> Self {
        let (Octet(base), Octet(exponent)) = (Octet::of(self.0), Octet::of(exponent.0));
        Self(Octet(std::array::from_fn(|lane| base[lane].power_above_zero(exponent[lane]))).halves())
    }
}

impl<L: Lanes> Add for Eight<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self([self.0[0].add(other.0[0]), self.0[1].add(other.0[1])])
    }
}

impl<L: Lanes> Sub for Eight<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self([self.0[0].sub(other.0[0]), self.0[1].sub(other.0[1])])
    }
}

impl<L: Lanes> Mul for Eight<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self([self.0[0].mul(other.0[0]), self.0[1].mul(other.0[1])])
    }
}

impl<L: Lanes> Div for Eight<L> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self([self.0[0].div(other.0[0]), self.0[1].div(other.0[1])])
    }
}

impl<L: Lanes> Neg for Eight<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self([self.0[0].neg(), self.0[1].neg()])
    }
}

crate::arithmetic::assign_by_operators!([L: Lanes] Eight<L>);
