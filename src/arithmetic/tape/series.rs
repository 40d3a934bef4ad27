//! A tape on power series in time, order by order.
//!
//! ```text
//! c = a b:      c_m = Σ_{j=0..m} a_j b_{m-j}
//!     c = a / b:   c_m = (a_m - Σ_{j=1..m} b_j c_{m-j}) / b_0
//! c = sqrt a:   c_m = (a_m - Σ_{j=1..m-1} c_j c_{m-j}) / (2 c_0)
//! c = exp a:    m c_m = Σ_{j=1..m} j a_j c_{m-j}
//!     c = ln a:    c_m = (a_m - Σ_{j=1..m-1} j c_j a_{m-j} / m) / a_0
//! s = sin a:    m s_m = Σ_{j=1..m} j a_j k_{m-j},  k = cos a:  m k_m = -Σ_{j=1..m} j a_j s_{m-j}
//! c = tanh a:   m c_m = Σ_{j=1..m} j a_j v_{m-j},  v = 1 - c²
//! c = atan2(y, x):  m r_0 c_m = Σ_{j=1..m} j (y_j x_{m-j} - x_j y_{m-j}) - Σ_{j=1..m-1} j c_j r_{m-j},
//!     r = x² + y²
//! c = a^p:      m a_0 c_m = Σ_{j=1..m} (p j - (m - j)) a_j c_{m-j}
//! ```
//!
//! Source: A. Jorba, M. Zou, Experimental Mathematics 14 (2005) 99, proposition 2.1; A. Griewank, A. Walther,
//! *Evaluating Derivatives*, table 13.2.

use super::{Operation, Slot, Tape, has_no_powers};
use crate::arithmetic::{DoubleDouble, Real};

/// Powers 0 … P of all results of a tape.
#[derive(Clone, Debug)]
pub struct TapeSeries<T> {
    powers: Vec<T>,
    /// P + 1.
    stride: usize,
}

impl<T: Real> TapeSeries<T> {
    /// Room for powers up to `order`.
    pub fn new(tape: &Tape, order: usize) -> Self {
        Self { powers: vec![T::ZERO; tape.len() * (order + 1)], stride: order + 1 }
    }

    /// Powers 0, 1, … of a result.
    pub fn of(&self, slot: Slot) -> &[T] {
        &self.powers[slot as usize * self.stride..(slot as usize + 1) * self.stride]
    }

    /// The first powers from a series in more digits.
    pub fn take(&mut self, other: &TapeSeries<DoubleDouble>) {
        let count = self.stride.min(other.stride);
        for (to, from) in
            self.powers.chunks_exact_mut(self.stride).zip(other.powers.chunks_exact(other.stride))
        {
            for (to, from) in to.iter_mut().zip(&from[..count]) {
                *to = T::split(*from).0;
            }
        }
    }

    /// Finds power `m` of all results, from that of the inputs and from all powers before.
    pub fn advance(&mut self, tape: &Tape, m: usize, input: &dyn Fn(u32) -> T) {
        for (i, operation) in tape.operations.iter().enumerate() {
            let (before, rest) = self.powers.split_at_mut(i * self.stride);
            let (own, after) = rest.split_at_mut(self.stride);
            let of = |slot: Slot| &before[slot as usize * self.stride..][..=m];
            own[m] = match *operation {
                Operation::Input(number) => input(number),
                Operation::Constant(value) => T::of(if m == 0 { value } else { 0.0 }),
                Operation::Add(a, b) => of(a)[m] + of(b)[m],
                Operation::Subtract(a, b) => of(a)[m] - of(b)[m],
                Operation::Negate(a) => -of(a)[m],
                Operation::Scale(a, factor) => of(a)[m].scale(factor),
                Operation::Multiply(a, b) => sum(0..=m, |j| of(a)[j] * of(b)[m - j]),
                Operation::Divide(a, b) => (of(a)[m] - sum(1..=m, |j| of(b)[j] * own[m - j])) / of(b)[0],
                Operation::Root(a) if m == 0 => of(a)[0].sqrt(),
                Operation::Root(a) => {
                    (of(a)[m] - sum(1..=m - 1, |j| own[j] * own[m - j])) / (own[0] + own[0])
                }
                Operation::Exponential(a) if m == 0 => of(a)[0].exp(),
                Operation::Exponential(a) => over(sum(1..=m, |j| (of(a)[j] * own[m - j]).scale(j as f64)), m),
                Operation::Logarithm(a) if m == 0 => of(a)[0].ln(),
                Operation::Logarithm(a) => {
                    (of(a)[m] - over(sum(1..=m - 1, |j| (own[j] * of(a)[m - j]).scale(j as f64)), m))
                        / of(a)[0]
                }
                Operation::Sine(a) => {
                    let cosine = &mut after[..self.stride];
                    let (sin, cos) = match m {
                        0 => of(a)[0].sin_cos(),
                        _ => (
                            over(sum(1..=m, |j| (of(a)[j] * cosine[m - j]).scale(j as f64)), m),
                            -over(sum(1..=m, |j| (of(a)[j] * own[m - j]).scale(j as f64)), m),
                        ),
                    };
                    cosine[m] = cos;
                    sin
                }
                Operation::HyperbolicTangent(a) => {
                    let slope = &mut after[..self.stride];
                    let tangent = match m {
                        0 => of(a)[0].tanh(),
                        _ => over(sum(1..=m, |j| (of(a)[j] * slope[m - j]).scale(j as f64)), m),
                    };
                    own[m] = tangent;
                    slope[m] = T::of(if m == 0 { 1.0 } else { 0.0 }) - sum(0..=m, |j| own[j] * own[m - j]);
                    tangent
                }
                Operation::Angle(y, x, _) if m == 0 => of(y)[0].atan2(of(x)[0]),
                Operation::Angle(y, x, square) => {
                    let turning =
                        sum(1..=m, |j| (of(y)[j] * of(x)[m - j] - of(x)[j] * of(y)[m - j]).scale(j as f64));
                    let known = sum(1..=m - 1, |j| (own[j] * of(square)[m - j]).scale(j as f64));
                    over((turning - known) / of(square)[0], m)
                }
                Operation::Power(a, b) if m == 0 => of(a)[0].power_above_zero(of(b)[0]),
                Operation::Power(a, _) if has_no_powers(of(a)[0], of(a)[1]) => T::ZERO,
                Operation::Power(a, b) => {
                    let factor = |j: usize| of(b)[0].scale(j as f64) - T::of((m - j) as f64);
                    over(sum(1..=m, |j| factor(j) * of(a)[j] * own[m - j]) / of(a)[0], m)
                }
                Operation::Beside => continue,
            };
        }
    }
}

/// Sum of the terms, from zero: a loop over numbers below an end is compiled with its terms, while a fold
/// over an inclusive range calls each of them.
#[inline(always)]
fn sum<T: Real>(range: std::ops::RangeInclusive<usize>, term: impl Fn(usize) -> T) -> T {
    let mut sum = T::ZERO;
    for j in *range.start()..*range.end() + 1 {
        sum += term(j);
    }
    sum
}

/// x / m; a reciprocal that is rounded once and used in every step would be a drift.
#[inline(always)]
fn over<T: Real>(x: T, m: usize) -> T {
    x / T::of(m as f64)
}
