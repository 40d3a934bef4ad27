//! Numbers of many digits: floating point in radix 2⁶⁴, of a fixed room of `W` limbs.
//!
//! ```text
//! x = ± Σ_{i<n} d_i 2^(64 (e-1-i)),   d_0 ≠ 0,   n <= W        n limbs carry 64 (n-1) to 64 n bits
//! x y: the columns i + j <= n of the product;   x + y: the limbs down to e - n of the larger
//! ```
//!
//! Exponents count limbs, so that nothing is ever shifted by bits and products fall into the columns of a sum
//! as they are: Σ a b is accumulated in double width, and rounded once (`convolution.rs`).  A number carries
//! how many limbs it was asked for, and a result has those of its shorter operand: coefficients of high
//! powers, which contribute little, are kept short, and whatever is computed from them is short by itself.
//! Results are cut off, not rounded; a limb below the digits wanted takes that.  All is integer arithmetic,
//! so that bits are the same on every machine.

mod convolution;
mod decimal;
mod elementary;
mod factor;
mod operators;
mod quotient;

use super::{Real, Scalar};
use std::cmp::Ordering;

pub use self::convolution::sum_of_products;
pub use self::decimal::{decimal_places, limbs_for};
pub use self::elementary::pi;
pub use self::factor::{Factor, TimeScale};

/// Exponents beyond this many limbs count as infinite.
const FARTHEST: i32 = 1 << 28;

/// Room that is small enough to be copied limb by limb.
const FEW: usize = 8;

/// A number of up to `W` limbs; `W` is at least 3.
#[derive(Clone, Copy)]
pub struct Digits<const W: usize> {
    /// Magnitude below 2^(64 exponent).
    exponent: i32,
    /// Limbs asked for; those beyond are zero.
    limbs: u32,
    /// Sign and kind.
    kind: DigitsKind,
    /// The first one is the most significant.
    limb: [u64; W],
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum DigitsKind {
    Zero,
    Positive,
    Negative,
    NotFinite,
}

impl<const W: usize> Digits<W> {
    const NAN: Self = Self { exponent: 0, limbs: W as u32, kind: DigitsKind::NotFinite, limb: [0; W] };

    /// The same kept to so many limbs: the rest is cut off, and what is computed from it has no more.
    #[must_use]
    pub fn shortened(mut self, limbs: usize) -> Self {
        let limbs = limbs.clamp(2, W);
        if limbs < self.limbs as usize {
            self.limb[limbs..].fill(0);
        }
        self.limbs = limbs as u32;
        self
    }

    /// The same in other room: with fewer limbs where it has not so many.
    pub fn resized<const V: usize>(self) -> Digits<V> {
        let mut limb = [0; V];
        let count = V.min(self.limbs());
        limb[..count].copy_from_slice(&self.limb[..count]);
        Digits { exponent: self.exponent, limbs: count as u32, kind: self.kind, limb }
    }

    /// The quotient by a whole number above zero.
    #[must_use]
    pub fn over_whole(self, by: u64) -> Self {
        elementary::over(self, by)
    }

    /// Limbs asked for.
    pub fn limbs(&self) -> usize {
        self.limbs as usize
    }

    /// True for all but infinities and NaN.
    pub fn is_finite(&self) -> bool {
        self.kind != DigitsKind::NotFinite
    }

    /// True for zero.
    #[inline(always)]
    pub fn is_zero(&self) -> bool {
        self.kind == DigitsKind::Zero
    }

    /// log2 of the magnitude, to a few digits; -∞ of zero, NaN of what is not finite.
    pub fn log2(&self) -> f64 {
        match self.kind {
            DigitsKind::Zero => f64::NEG_INFINITY,
            DigitsKind::NotFinite => f64::NAN,
            _ => {
                let top = self.limb[0] as f64 + self.limb[1] as f64 / TWO_64;
                libm::log2(top) + 64.0 * f64::from(self.exponent - 1)
            }
        }
    }

    /// A whole number, exactly.
    pub fn whole(value: u64) -> Self {
        if value == 0 {
            return Self::ZERO;
        }
        let mut limb = [0; W];
        limb[0] = value;
        Self { exponent: 1, limbs: W as u32, kind: DigitsKind::Positive, limb }
    }

    /// The exact product with a power of two.
    #[must_use]
    pub fn ldexp(self, power: i32) -> Self {
        let (limbs, bits) = (power.div_euclid(64), power.rem_euclid(64));
        let shifted = if bits == 0 { self } else { convolution::times_whole(&self, 1 << bits) };
        Self { exponent: shifted.exponent + limbs, ..shifted }
    }

    /// Whole bits and limbs of a checkpoint.
    pub fn to_words(&self) -> Vec<u64> {
        let kind = match self.kind {
            DigitsKind::Zero => 0,
            DigitsKind::Positive => 1,
            DigitsKind::Negative => 2,
            DigitsKind::NotFinite => 3,
        };
        let mut words = vec![kind, i64::from(self.exponent) as u64, u64::from(self.limbs)];
        words.extend_from_slice(&self.limb[..self.limbs()]);
        words
    }

    /// Back from [`to_words`](Self::to_words); `None` where they are those of no such number.
    pub fn from_words(words: &[u64]) -> Option<Self> {
        let (&[kind, exponent, limbs], digits) = words.split_first_chunk::<3>()?;
        let kind = match kind {
            0 => DigitsKind::Zero,
            1 => DigitsKind::Positive,
            2 => DigitsKind::Negative,
            _ => return None,
        };
        let exponent = i32::try_from(exponent as i64).ok().filter(|exponent| exponent.abs() < FARTHEST)?;
        let is_sound = (2..=W as u64).contains(&limbs) && digits.len() as u64 == limbs;
        if !is_sound || (kind == DigitsKind::Zero) != (digits[0] == 0) {
            return None;
        }
        let mut limb = [0; W];
        limb[..digits.len()].copy_from_slice(digits);
        Some(Self { exponent, limbs: limbs as u32, kind, limb })
    }

    /// From limbs above the point of `exponent`, the first of which may be zero.
    #[inline]
    fn normalized(is_negative: bool, exponent: i32, limbs: usize, found: &[u64]) -> Self {
        let Some(first) = found.iter().position(|&limb| limb != 0) else { return Self::ZERO };
        let exponent = exponent - first as i32;
        if exponent >= FARTHEST {
            return Self::NAN;
        }
        if exponent <= -FARTHEST {
            return Self::ZERO;
        }
        let mut limb = [0; W];
        let count = limbs.min(found.len() - first);
        if W <= FEW {
            // One by one: to call for so few to be copied takes longer.
            for (i, limb) in limb.iter_mut().enumerate().filter(|(i, _)| *i < count) {
                *limb = found[first + i];
            }
        } else {
            limb[..count].copy_from_slice(&found[first..first + count]);
        }
        let kind = if is_negative { DigitsKind::Negative } else { DigitsKind::Positive };
        Self { exponent, limbs: limbs as u32, kind, limb }
    }

    #[inline(always)]
    fn is_negative(&self) -> bool {
        self.kind == DigitsKind::Negative
    }

    /// Order of the magnitudes of two numbers that are neither zero nor infinite.
    fn cmp_magnitude(&self, other: &Self) -> Ordering {
        self.exponent.cmp(&other.exponent).then_with(|| self.limb.cmp(&other.limb))
    }

    /// a + b, or a - b where `is_difference`.
    fn sum(a: &Self, b: &Self, is_difference: bool) -> Self {
        if a.kind == DigitsKind::NotFinite || b.kind == DigitsKind::NotFinite {
            return Self::NAN;
        }
        if b.is_zero() {
            return *a;
        }
        if a.is_zero() {
            return if is_difference { -*b } else { *b };
        }
        // Room on the stack is cleared every time: no more than there is use for.
        match a.limbs().min(b.limbs()) {
            2 => Self::sum_in::<4>(a, b, is_difference, 2),
            3 => Self::sum_in::<5>(a, b, is_difference, 3),
            4 => Self::sum_in::<6>(a, b, is_difference, 4),
            limbs @ ..=8 => Self::sum_in::<10>(a, b, is_difference, limbs),
            limbs @ ..=MIDDLE => Self::sum_in::<{ MIDDLE + 2 }>(a, b, is_difference, limbs),
            limbs => Self::sum_in::<{ MOST + 2 }>(a, b, is_difference, limbs),
        }
    }

    /// The same of two numbers that are neither zero nor infinite, in room for two more limbs than are asked
    /// for.
    #[inline(always)]
    fn sum_in<const ROOM: usize>(a: &Self, b: &Self, is_difference: bool, limbs: usize) -> Self {
        let b_negative = b.is_negative() != is_difference;
        let (large, small, is_negative) = match a.cmp_magnitude(b) {
            Ordering::Less => (b, a, b_negative),
            _ => (a, b, a.is_negative()),
        };
        let apart = (large.exponent - small.exponent) as usize;
        // One limb above for a carry, one below that only the larger may fill.
        let mut found = [0; ROOM];
        let count = limbs + 1;
        let top = count.min(W);
        found[1..=top].copy_from_slice(&large.limb[..top]);
        let is_sum = a.is_negative() == b_negative;
        if ROOM <= FEW {
            // All limbs, with no branch that depends on where the smaller one begins.
            let mut below = [0; ROOM];
            for (i, limb) in below[1..].iter_mut().enumerate() {
                *limb = i.checked_sub(apart).and_then(|i| small.limb.get(i)).copied().unwrap_or(0);
            }
            let _ = if is_sum { plus(&mut found, &below) } else { minus(&mut found, &below) };
        } else if apart < count {
            let (place, digits) = (&mut found[1 + apart..=count], &small.limb[..(count - apart).min(W)]);
            let place = &mut place[..digits.len()];
            let carry = if is_sum { plus(place, digits) } else { minus(place, digits) };
            if carry {
                match is_sum {
                    true => ripple_up(&mut found[..=apart]),
                    false => ripple_down(&mut found[..=apart]),
                }
            }
        }
        Self::normalized(is_negative, large.exponent + 1, limbs, &found[..=count])
    }
}

/// 2⁶⁴.
const TWO_64: f64 = 18_446_744_073_709_551_616.0;
/// Limbs at most.
pub const MOST: usize = 112;
/// Limbs of the size between few and [`MOST`].
pub const MIDDLE: usize = 24;

/// Adds digits, and tells the carry.
fn plus(place: &mut [u64], digits: &[u64]) -> bool {
    let mut carry = false;
    for (place, &digit) in place.iter_mut().zip(digits).rev() {
        let (sum, first) = place.overflowing_add(digit);
        let (sum, second) = sum.overflowing_add(u64::from(carry));
        (*place, carry) = (sum, first | second);
    }
    carry
}

/// Takes digits off, and tells the borrow.
fn minus(place: &mut [u64], digits: &[u64]) -> bool {
    let mut borrow = false;
    for (place, &digit) in place.iter_mut().zip(digits).rev() {
        let (difference, first) = place.overflowing_sub(digit);
        let (difference, second) = difference.overflowing_sub(u64::from(borrow));
        (*place, borrow) = (difference, first | second);
    }
    borrow
}

/// Adds one to the last limb.
fn ripple_up(place: &mut [u64]) {
    for limb in place.iter_mut().rev() {
        let (sum, carry) = limb.overflowing_add(1);
        *limb = sum;
        if !carry {
            return;
        }
    }
}

/// Takes one off the last limb.
fn ripple_down(place: &mut [u64]) {
    for limb in place.iter_mut().rev() {
        let (difference, borrow) = limb.overflowing_sub(1);
        *limb = difference;
        if !borrow {
            return;
        }
    }
}

#[cfg(test)]
mod tests;
