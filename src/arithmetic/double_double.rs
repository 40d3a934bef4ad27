//! Double-double arithmetic: an unevaluated sum `hi + lo`, about 32 decimal digits.
//!
//! Source: Y. Hida, X. S. Li, D. H. Bailey, *Library for Double-Double and Quad-Double Arithmetic* (2007),
//! sections 3.2-3.4; the bounds are those of M. Joldes, J.-M. Muller, V. Popescu, *Tight and rigorous error
//! bounds for basic building blocks of double-word arithmetic*, ACM TOMS 44 (2017): sums to 3 u², products to
//! 5 u², quotients to 10 u² with u = 2⁻⁵³.

use super::sum::{fast_two_sum, nearest, two_product, two_sum};
use super::{Real, Scalar, elementary};
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::sync::LazyLock;

/// `hi + lo` with `|lo|` at most half a unit in the last place of `hi`.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct DoubleDouble {
    /// The nearest double.
    pub hi: f64,
    /// What is left.
    pub lo: f64,
}

impl DoubleDouble {
    /// π.
    pub const PI: Self = Self { hi: std::f64::consts::PI, lo: 1.224_646_799_147_353_2e-16 };
    /// 2π.
    pub const TAU: Self = Self { hi: std::f64::consts::TAU, lo: 2.449_293_598_294_706_4e-16 };

    /// The exact sum of two doubles.
    #[inline(always)]
    pub fn sum(a: f64, b: f64) -> Self {
        let (hi, lo) = two_sum(a, b);
        Self { hi, lo }
    }

    /// The exact product of two doubles.
    #[inline(always)]
    pub fn product(a: f64, b: f64) -> Self {
        let (hi, lo) = two_product(a, b);
        Self { hi, lo }
    }

    /// Exact product with a power of two.
    #[inline(always)]
    pub fn ldexp(self, power_of_two: f64) -> Self {
        Self { hi: self.hi * power_of_two, lo: self.lo * power_of_two }
    }

    /// True where both parts are finite.
    pub fn is_finite(self) -> bool {
        self.hi.is_finite() && self.lo.is_finite()
    }

    /// The angle less whole turns, in [-π, π], and the turns taken off; exact to the last place of the pair
    /// for up to 2⁵³ turns.
    pub fn reduced(self) -> (Self, f64) {
        let turns = nearest(self.hi / Self::TAU.hi);
        if turns == 0.0 {
            return (self, 0.0);
        }
        (self - Self::TAU * Self::of(turns), turns)
    }

    /// sin and cos of an angle in [-π/4, π/4] by their Taylor series; the first term left out is below 1e-32.
    fn sin_cos_series(self) -> (Self, Self) {
        let square = self * self;
        let (mut sin, mut cos) = (Self::ZERO, Self::ZERO);
        // Horner from the highest power: 1/3!, 1/5!, … with alternating signs, and 1/4!, 1/6!, … likewise.
        for pair in INVERSE_FACTORIAL.chunks_exact(2).rev() {
            sin = pair[0] - square * sin;
            cos = pair[1] - square * cos;
        }
        (self - self * square * sin, Self::ONE - square.ldexp(0.5) + square * square * cos)
    }

    /// The same for an angle in [-π/256, π/256]: powers from the seventh on weigh less than 1e-17 and are
    /// summed in plain doubles.
    #[inline]
    fn sin_cos_tiny(self) -> (Self, Self) {
        let square = self * self;
        let q = square.hi;
        let [third, fourth, fifth, sixth, ..] = INVERSE_FACTORIAL;
        let sin_rest = q * q * (1.0 / 5_040.0 - q * (1.0 / 362_880.0 - q / 39_916_800.0));
        let cos_rest = q * (1.0 / 40_320.0 - q * (1.0 / 3_628_800.0 - q / 479_001_600.0));
        let sin = third - square * fifth + sin_rest;
        let cos = fourth - square * (sixth + -cos_rest);
        (self - self * square * sin, Self::ONE - square.ldexp(0.5) + square * square * cos)
    }
}

/// Parts of the circle whose sine and cosine are tabulated.
const PARTS: i64 = 256;

/// sin and cos at the 256th parts of a turn, formed once by the series.
static CIRCLE: LazyLock<Vec<(DoubleDouble, DoubleDouble)>> = LazyLock::new(|| {
    let part = |k: i64| {
        let quarter = (k + PARTS / 8) / (PARTS / 4);
        let rest = DoubleDouble::TAU.ldexp(1.0 / PARTS as f64).scale((k - quarter * PARTS / 4) as f64);
        let (sin, cos) = rest.sin_cos_series();
        match quarter % 4 {
            0 => (sin, cos),
            1 => (cos, -sin),
            2 => (-sin, -cos),
            _ => (-cos, sin),
        }
    };
    (0..PARTS).map(part).collect()
});

/// 1/k! for k = 3…28.
const INVERSE_FACTORIAL: [DoubleDouble; 26] = [
    DoubleDouble { hi: 0.16666666666666666, lo: 9.25185853854297e-18 },
    DoubleDouble { hi: 0.041666666666666664, lo: 2.3129646346357427e-18 },
    DoubleDouble { hi: 0.008333333333333333, lo: 1.1564823173178714e-19 },
    DoubleDouble { hi: 0.001388888888888889, lo: -5.300543954373577e-20 },
    DoubleDouble { hi: 0.0001984126984126984, lo: 1.7209558293420705e-22 },
    DoubleDouble { hi: 2.48015873015873e-05, lo: 2.1511947866775882e-23 },
    DoubleDouble { hi: 2.7557319223985893e-06, lo: -1.858393274046472e-22 },
    DoubleDouble { hi: 2.755731922398589e-07, lo: 2.3767714622250297e-23 },
    DoubleDouble { hi: 2.505210838544172e-08, lo: -1.448814070935912e-24 },
    DoubleDouble { hi: 2.08767569878681e-09, lo: -1.20734505911326e-25 },
    DoubleDouble { hi: 1.6059043836821613e-10, lo: 1.2585294588752098e-26 },
    DoubleDouble { hi: 1.1470745597729725e-11, lo: 2.0655512752830745e-28 },
    DoubleDouble { hi: 7.647163731819816e-13, lo: 7.03872877733453e-30 },
    DoubleDouble { hi: 4.779477332387385e-14, lo: 4.399205485834081e-31 },
    DoubleDouble { hi: 2.8114572543455206e-15, lo: 1.6508842730861433e-31 },
    DoubleDouble { hi: 1.5619206968586225e-16, lo: 1.1910679660273754e-32 },
    DoubleDouble { hi: 8.22063524662433e-18, lo: 2.2141894119604265e-34 },
    DoubleDouble { hi: 4.110317623312165e-19, lo: 1.4412973378659527e-36 },
    DoubleDouble { hi: 1.9572941063391263e-20, lo: -1.3643503830087908e-36 },
    DoubleDouble { hi: 8.896791392450574e-22, lo: -7.911402614872376e-38 },
    DoubleDouble { hi: 3.868170170630684e-23, lo: -8.843177655482344e-40 },
    DoubleDouble { hi: 1.6117375710961184e-24, lo: -3.6846573564509766e-41 },
    DoubleDouble { hi: 6.446950284384474e-26, lo: -1.9330404233703465e-42 },
    DoubleDouble { hi: 2.4795962632247976e-27, lo: -1.2953730964765229e-43 },
    DoubleDouble { hi: 9.183689863795546e-29, lo: 1.4303150396787322e-45 },
    DoubleDouble { hi: 3.279889237069838e-30, lo: 1.5117542744029879e-46 },
];

impl From<f64> for DoubleDouble {
    fn from(value: f64) -> Self {
        Self { hi: value, lo: 0.0 }
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (s, e) = two_sum(self.hi, other.hi);
        let (t, f) = two_sum(self.lo, other.lo);
        let (s, e) = fast_two_sum(s, e + t);
        let (hi, lo) = fast_two_sum(s, e + f);
        Self { hi, lo }
    }
}

impl Add<f64> for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: f64) -> Self {
        let (s, e) = two_sum(self.hi, other);
        let (hi, lo) = fast_two_sum(s, e + self.lo);
        Self { hi, lo }
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (p, e) = two_product(self.hi, other.hi);
        let (hi, lo) = fast_two_sum(p, e + (self.hi * other.lo + self.lo * other.hi));
        Self { hi, lo }
    }
}

impl Div for DoubleDouble {
    type Output = Self;
    /// Three quotient digits, each from the exact remainder of the last.
    #[inline]
    fn div(self, other: Self) -> Self {
        let first = self.hi / other.hi;
        let rest = self - other.scale(first);
        let second = rest.hi / other.hi;
        let rest = rest - other.scale(second);
        let third = rest.hi / other.hi;
        let (hi, lo) = fast_two_sum(first, second);
        Self { hi, lo } + third
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo }
    }
}

crate::arithmetic::assign_by_operators!([] DoubleDouble);

impl PartialOrd for DoubleDouble {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        match self.hi.partial_cmp(&other.hi) {
            Some(Ordering::Equal) => self.lo.partial_cmp(&other.lo),
            order => order,
        }
    }
}

impl Scalar for DoubleDouble {
    const ZERO: Self = Self { hi: 0.0, lo: 0.0 };
    const ONE: Self = Self { hi: 1.0, lo: 0.0 };

    #[inline(always)]
    fn of(value: f64) -> Self {
        Self { hi: value, lo: 0.0 }
    }

    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        let (p, e) = two_product(self.hi, factor);
        let (hi, lo) = fast_two_sum(p, e + self.lo * factor);
        Self { hi, lo }
    }

    /// One Newton step from the double's own root.
    fn sqrt(self) -> Self {
        if self.hi <= 0.0 {
            return Self::of(self.hi.sqrt());
        }
        let root = self.hi.sqrt();
        let rest = self - Self::product(root, root);
        let (hi, lo) = fast_two_sum(root, rest.hi / (2.0 * root));
        let root = Self { hi, lo };
        // A second step in full: the first leaves about 1e-31 of the root.
        root + (self - root * root) / root.ldexp(2.0)
    }

    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        let part = Self::TAU.ldexp(1.0 / PARTS as f64);
        let k = nearest(self.hi / part.hi);
        let (sin, cos) = (self - part * Self::of(k)).sin_cos_tiny();
        // Not a number lands in the first entry and stays what it is.
        let (sin_k, cos_k) = CIRCLE[(k as i64).rem_euclid(PARTS) as usize];
        (sin_k * cos + cos_k * sin, cos_k * cos - sin_k * sin)
    }

    fn exp(self) -> Self {
        elementary::exp(self)
    }

    fn ln(self) -> Self {
        elementary::ln(self)
    }

    fn tanh(self) -> Self {
        elementary::tanh(self)
    }

    fn atan2(self, x: Self) -> Self {
        elementary::atan2(self, x)
    }

    fn power_above_zero(self, exponent: Self) -> Self {
        crate::arithmetic::power_above_zero(self, exponent)
    }
}

impl Real for DoubleDouble {
    const IS_PLAIN: bool = false;

    #[inline(always)]
    fn value(self) -> f64 {
        self.hi
    }

    #[inline(always)]
    fn split(value: DoubleDouble) -> (Self, Self) {
        (value, Self::ZERO)
    }

    #[inline(always)]
    fn double_double(self) -> DoubleDouble {
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TINY: f64 = 1e-30;

    fn pair() -> impl Strategy<Value = DoubleDouble> {
        (-1e3..1e3f64, -1.0..1.0f64).prop_map(|(hi, part)| DoubleDouble::sum(hi, part * hi.abs() * 1e-16))
    }

    proptest! {
        #[test]
        fn quotient_and_product_undo_each_other(a in pair(), b in pair()) {
            prop_assume!(b.hi.abs() > 1e-6);
            prop_assert!(((a / b * b - a).hi / a.hi).abs() < TINY);
        }

        #[test]
        fn root_squared_is_the_number(a in pair()) {
            let a = a.abs();
            prop_assume!(a.hi > 0.0);
            let root = a.sqrt();
            prop_assert!(((root * root - a).hi / a.hi).abs() < TINY);
        }

        #[test]
        fn sine_and_cosine_lie_on_the_circle_and_add(a in pair(), b in pair()) {
            let ((sa, ca), (sb, cb), (ss, cs)) = (a.sin_cos(), b.sin_cos(), (a + b).sin_cos());
            prop_assert!((sa * sa + ca * ca - DoubleDouble::ONE).hi.abs() < TINY);
            // The sum of angles is itself rounded: 1e3 rad carry 1e-29.
            prop_assert!((sa * cb + ca * sb - ss).hi.abs() < 1e-28);
            prop_assert!((ca * cb - sa * sb - cs).hi.abs() < 1e-28);
            prop_assert!((sa.hi - libm::sin(a.hi)).abs() < 3e-13);
        }
    }

    #[test]
    fn sine_of_one_has_thirty_two_digits() {
        // OEIS A049469 and A049470.
        let (sin, cos) = DoubleDouble::ONE.sin_cos();
        let tenth = DoubleDouble::ONE / DoubleDouble::of(10.0);
        let digits = |text: &str| {
            text.bytes().rev().fold(DoubleDouble::ZERO, |acc, digit| (acc + f64::from(digit - b'0')) * tenth)
        };
        assert!((sin - digits("84147098480789650665250232163029900")).hi.abs() < 1e-31);
        assert!((cos - digits("54030230586813971740093660744297661")).hi.abs() < 1e-31);
    }

    #[test]
    fn reduction_counts_turns() {
        let (angle, turns) = (DoubleDouble::TAU * DoubleDouble::of(1e9) + DoubleDouble::ONE).reduced();
        assert_eq!(turns, 1e9);
        assert!((angle - DoubleDouble::ONE).hi.abs() < 1e-21);
    }
}
