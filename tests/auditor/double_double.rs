//! Numbers of 106 bits as unevaluated sums of two doubles.
//!
//! Source: T. J. Dekker, *A floating-point technique for extending the available precision*, Numer. Math. 18
//! (1971), with its splitting into halves instead of a fused multiply-add; Y. Hida, X. S. Li, D. H. Bailey,
//! *Library for double-double and quad-double arithmetic* (2007).

use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
use std::sync::LazyLock;

/// A number of 106 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dd {
    pub hi: f64,
    pub lo: f64,
}

/// `a + b` and its rounding error.
#[inline]
fn two_sum(a: f64, b: f64) -> Dd {
    let hi = a + b;
    let b_part = hi - a;
    Dd { hi, lo: (a - (hi - b_part)) + (b - b_part) }
}

/// The same where |a| >= |b|.
#[inline]
fn quick_two_sum(a: f64, b: f64) -> Dd {
    let hi = a + b;
    Dd { hi, lo: b - (hi - a) }
}

/// A double as a sum of two with 26 bits each.
#[inline]
fn halves(a: f64) -> (f64, f64) {
    let scaled = 134_217_729.0 * a;
    let upper = scaled - (scaled - a);
    (upper, a - upper)
}

/// `a * b` and its rounding error.
#[inline]
fn two_product(a: f64, b: f64) -> Dd {
    let hi = a * b;
    let ((a1, a2), (b1, b2)) = (halves(a), halves(b));
    Dd { hi, lo: ((a1 * b1 - hi) + a1 * b2 + a2 * b1) + a2 * b2 }
}

/// π/2 as a sum of three doubles.
const HALF_PI: [f64; 3] =
    [std::f64::consts::FRAC_PI_2, 6.123_233_995_736_766e-17, -1.497_384_904_859_169_8e-33];

/// 1/n! for n up to 24.
static INVERSE_FACTORIALS: LazyLock<[Dd; 25]> = LazyLock::new(|| {
    let mut table = [Dd::ONE; 25];
    for n in 1..25 {
        table[n] = table[n - 1] / Dd::from(n as f64);
    }
    table
});

impl Dd {
    pub const ZERO: Self = Self { hi: 0.0, lo: 0.0 };
    pub const ONE: Self = Self { hi: 1.0, lo: 0.0 };
    pub const PI: Self = Self { hi: std::f64::consts::PI, lo: 2.0 * HALF_PI[1] };

    pub fn abs(self) -> Self {
        if self.hi < 0.0 { -self } else { self }
    }

    /// Exact for powers of two.
    pub fn scale(self, factor: f64) -> Self {
        let product = two_product(self.hi, factor);
        quick_two_sum(product.hi, product.lo + self.lo * factor)
    }

    pub fn sqrt(self) -> Self {
        if self.hi <= 0.0 {
            return Self::ZERO;
        }
        // One step of Newton's method doubles the digits.
        let root = Self::from(self.hi.sqrt());
        root + (self - root * root) / (root + root)
    }

    /// Sine and cosine.
    pub fn sin_cos(self) -> (Self, Self) {
        let quarter = (self.hi / HALF_PI[0]).round();
        let rest = HALF_PI.iter().fold(self, |rest, &part| rest - two_product(part, quarter));
        // An eighth of the rest has a sine of few terms; the double angle is taken three times.
        let x = rest.scale(0.125);
        let square = x * x;
        let mut sine = Self::ZERO;
        for n in (1..=19).rev().step_by(2) {
            sine = INVERSE_FACTORIALS[n] - square * sine;
        }
        sine = sine * x;
        let mut cosine = (Self::ONE - sine * sine).sqrt();
        for _ in 0..3 {
            (sine, cosine) = ((sine * cosine).scale(2.0), Self::ONE - (sine * sine).scale(2.0));
        }
        match quarter.rem_euclid(4.0) as u8 {
            0 => (sine, cosine),
            1 => (cosine, -sine),
            2 => (-sine, -cosine),
            _ => (-cosine, sine),
        }
    }
}

impl From<f64> for Dd {
    fn from(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }
}

impl Add for Dd {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        let (high, low) = (two_sum(self.hi, other.hi), two_sum(self.lo, other.lo));
        let sum = quick_two_sum(high.hi, high.lo + low.hi);
        quick_two_sum(sum.hi, sum.lo + low.lo)
    }
}

impl Neg for Dd {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo }
    }
}

impl Sub for Dd {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Dd {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        let product = two_product(self.hi, other.hi);
        quick_two_sum(product.hi, product.lo + (self.hi * other.lo + self.lo * other.hi))
    }
}

impl Div for Dd {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = self.hi / other.hi;
        let rest = self - other.scale(first);
        let second = rest.hi / other.hi;
        let rest = rest - other.scale(second);
        quick_two_sum(first, second) + Self::from(rest.hi / other.hi)
    }
}

impl AddAssign for Dd {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Dd {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl PartialOrd for Dd {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.hi
            .partial_cmp(&other.hi)
            .map(|order| order.then(self.lo.partial_cmp(&other.lo).unwrap_or(Ordering::Equal)))
    }
}

/// A vector of the plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vec2 {
    pub x: Dd,
    pub y: Dd,
}

impl Vec2 {
    pub fn of(pair: [f64; 2]) -> Self {
        Self { x: pair[0].into(), y: pair[1].into() }
    }

    pub fn dot(self, other: Self) -> Dd {
        self.x * other.x + self.y * other.y
    }

    /// Turned by a quarter counter-clockwise.
    pub fn left(self) -> Self {
        Self { x: -self.y, y: self.x }
    }

    pub fn times(self, factor: Dd) -> Self {
        Self { x: self.x * factor, y: self.y * factor }
    }

    /// Turned by the angle with this sine and cosine.
    pub fn turned(self, (sine, cosine): (Dd, Dd)) -> Self {
        Self { x: cosine * self.x - sine * self.y, y: sine * self.x + cosine * self.y }
    }

    pub fn length(self) -> Dd {
        // The larger part first, so that tiny and huge vectors have a length too.
        let most = self.x.abs().hi.max(self.y.abs().hi);
        if most == 0.0 {
            return Dd::ZERO;
        }
        let unit = self.times(Dd::ONE / Dd::from(most));
        unit.dot(unit).sqrt().scale(most)
    }
}

impl Add for Vec2 {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y }
    }
}

impl Sub for Vec2 {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(found: Dd, expected: Dd, bound: f64) {
        assert!((found - expected).hi.abs() < bound, "{found:?} {expected:?}");
    }

    /// Constants to 32 digits, written as a double and the rest.
    #[test]
    fn constants_come_out_to_thirty_one_digits() {
        let root = Dd { hi: std::f64::consts::SQRT_2, lo: -9.667_293_313_452_913e-17 };
        assert_near(Dd::from(2.0).sqrt(), root, 1e-31);
        // 1 / 3 in two doubles: the second is a third of an ulp of the first.
        assert_near((Dd::ONE / Dd::from(3.0)).scale(3.0), Dd::ONE, 1e-31);
        // sin 1 and cos 1 (OEIS A049469, A049470).
        let (sine, cosine) = Dd::ONE.sin_cos();
        assert_near(sine, digits("0.84147098480789650665250232163029899962256306079837"), 1e-31);
        assert_near(cosine, digits("0.54030230586813971740093660744297660373231042061792"), 1e-31);
        // e^0 … by the factorials: e (OEIS A001113).
        let e = INVERSE_FACTORIALS.iter().fold(Dd::ZERO, |sum, &term| sum + term);
        assert_near(e, digits("2.71828182845904523536028747135266249775724709369995"), 1e-24);
        assert_near(Dd::PI, digits("3.14159265358979323846264338327950288419716939937510"), 4e-31);
    }

    #[test]
    fn sines_keep_to_the_identities() {
        for k in -40..40 {
            let x = Dd::from(0.37 * f64::from(k)) + Dd::from(1e-18);
            let ((s, c), (s2, c2), (s3, _)) = (x.sin_cos(), x.scale(2.0).sin_cos(), (x + Dd::PI).sin_cos());
            assert_near(s * s + c * c, Dd::ONE, 1e-30);
            assert_near(s2, (s * c).scale(2.0), 1e-30);
            assert_near(c2, Dd::ONE - (s * s).scale(2.0), 1e-30);
            assert_near(s3, -s, 1e-29);
        }
        // A million turns: the reduction keeps the digits the angle has.
        let turns = Dd::PI.scale(2e6);
        assert_near((turns + Dd::from(0.5)).sin_cos().0, Dd::from(0.5).sin_cos().0, 1e-25);
    }

    /// A decimal fraction, digit by digit.
    fn digits(text: &str) -> Dd {
        let mut unit = Dd::ONE;
        let mut value = Dd::ZERO;
        for letter in text.chars().filter(char::is_ascii_digit) {
            value += unit * Dd::from(f64::from(letter.to_digit(10).expect("a digit")));
            unit = unit / Dd::from(10.0);
        }
        value
    }
}
