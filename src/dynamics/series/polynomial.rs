//! Sums, integrals and products of power series.

use crate::arithmetic::{Complex, Real, Scalar};
use crate::dynamics::tree::size;

/// The largest number of bodies whose loops are unrolled.
pub const UNROLLED: usize = 6;

/// How many bodies are worked on at once: all of them where their number `N` is known, else one after
/// another.
#[inline(always)]
pub const fn width<const N: usize>() -> usize {
    if N == 0 { 1 } else { N }
}

/// `Σ_{j=0..m} term(a_j, b_{m-j})` over series of `n` bodies with m+1 powers each, for the [`width`] bodies
/// from `first` on.
///
/// From the middle outwards in two chains, so that the newest coefficients come last and nothing waits for
/// them.
#[inline(always)]
pub fn convolve<const N: usize, A, B, S>(
    n: usize,
    first: usize,
    a: &[A],
    b: &[B],
    term: impl Fn(A, B) -> S,
) -> [S; UNROLLED]
where
    A: Copy,
    B: Copy,
    S: Copy + Default + std::ops::AddAssign,
{
    let n = size::<N>(n);
    let middle = a.len() / n / 2 * n;
    let (mut inner, mut outer) = ([S::default(); UNROLLED], [S::default(); UNROLLED]);
    let (a_low, a_high) = a.split_at(middle);
    let (b_low, b_high) = b.split_at(b.len() - middle);
    for (a, b) in a_low.chunks_exact(n).rev().zip(b_high.chunks_exact(n)) {
        for i in 0..width::<N>() {
            inner[i] += term(a[first + i], b[first + i]);
        }
    }
    for (a, b) in a_high.chunks_exact(n).zip(b_low.chunks_exact(n).rev()) {
        for i in 0..width::<N>() {
            outer[i] += term(a[first + i], b[first + i]);
        }
    }
    for i in 0..width::<N>() {
        inner[i] += outer[i];
    }
    inner
}

/// The same for a single series.
#[inline(always)]
pub fn product<A, B, S>(a: &[A], b: &[B], term: impl Fn(A, B) -> S) -> S
where
    A: Copy,
    B: Copy,
    S: Copy + Default + std::ops::AddAssign,
{
    convolve::<1, A, B, S>(1, 0, a, b, term)[0]
}

/// The fractions 1/k.
#[derive(Clone, Debug)]
pub struct Fractions<T>(Vec<T>);

impl<T: Real> Fractions<T> {
    /// Up to 1/`most`.
    pub fn new(most: usize) -> Self {
        Self((0..=most).map(|k| T::ONE / T::of(k.max(1) as f64)).collect())
    }

    /// x/k.  A fraction that is rounded once and used in every step is a drift: in plain doubles low orders,
    /// which carry the weight, are divided.
    #[inline(always)]
    pub fn over(&self, x: T, k: usize) -> T {
        x.divided(k, self.0[k])
    }

    /// The same for a vector.
    #[inline(always)]
    pub fn vector_over(&self, x: Complex<T>, k: usize) -> Complex<T> {
        Complex::new(self.over(x.re, k), self.over(x.im, k))
    }
}

/// Σ_{m>=skip} a_m h^m of a series of stride `stride` from `first`.
pub fn tail<T: Real>(series: &[T], first: usize, stride: usize, skip: usize, h: T) -> T {
    let count = (series.len() - first).div_ceil(stride);
    let mut sum = T::ZERO;
    for m in (skip..count).rev() {
        sum = sum * h + series[first + m * stride];
    }
    (0..skip).fold(sum, |sum, _| sum * h)
}

/// Σ_{m>=skip} a_m h^(m+1)/(m+1): the integral of such a sum.
pub fn integral<T: Real>(series: &[T], first: usize, stride: usize, skip: usize, h: T) -> T {
    let count = (series.len() - first).div_ceil(stride);
    let mut sum = T::ZERO;
    for m in (skip..count).rev() {
        sum = sum * h + series[first + m * stride] / T::of((m + 1) as f64);
    }
    (0..skip + 1).fold(sum, |sum, _| sum * h)
}

/// Rounds the numbers of one kind to those of another.
pub fn copy<T: Real, U: Real>(to: &mut [T], from: &[U]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = T::split(from.double_double()).0;
    }
}

/// The same for vectors.
pub fn copy_vectors<T: Real, U: Real>(to: &mut [Complex<T>], from: &[Complex<U>]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = Complex::new(T::split(from.re.double_double()).0, T::split(from.im.double_double()).0);
    }
}

/// Zeros.
pub fn zeros<T: Scalar>(count: usize) -> Vec<T> {
    vec![T::ZERO; count]
}
