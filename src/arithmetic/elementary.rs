//! Exponential, logarithm, hyperbolic tangent and the angle of a vector in double-double.
//!
//! ```text
//! exp x = 2^k (1 + p)^512,   x = k ln 2 + 512 r,   p = exp r - 1 by its series;    (1 + p)² - 1 = 2 p + p²
//! ln x = y + x exp(-y) - 1,  y = ln of the leading part
//!     one Newton step: 1e-16 becomes 1e-32
//! tanh x = p / (p + 2),      p = exp(2 x) - 1
//! atan2(y, x) = a + (y cos a - x sin a) / (x cos a + y sin a),  a = that of the leading parts
//! ```
//!
//! Source: D. H. Bailey's arithmetic as described in Y. Hida, X. S. Li, D. H. Bailey, *Algorithms for
//! quad-double precision floating point arithmetic*, ARITH-15 (2001), section 4.

use super::{DoubleDouble, Scalar};

const LN_2: DoubleDouble = DoubleDouble { hi: std::f64::consts::LN_2, lo: 2.319_046_813_846_299_6e-17 };
/// Halvings of the argument of the exponential.
const HALVINGS: i32 = 9;
/// Terms of its series: (ln 2 / 1024)^11 / 11! is below 1e-41.
const TERMS: i32 = 10;

/// exp x - 1 of an argument below ln 2 in magnitude.
fn reduced_exp_minus_one(x: DoubleDouble) -> DoubleDouble {
    let r = x.ldexp(1.0 / f64::from(1 << HALVINGS));
    let mut sum = DoubleDouble::ONE;
    for k in (2..=TERMS).rev() {
        sum = DoubleDouble::ONE + r * sum / DoubleDouble::of(f64::from(k));
    }
    let mut p = r * sum;
    for _ in 0..HALVINGS {
        p = p.ldexp(2.0) + p * p;
    }
    p
}

/// e to the power x.
pub(super) fn exp(x: DoubleDouble) -> DoubleDouble {
    let plain = libm::exp(x.hi);
    // Beyond the range of doubles, and where the low part could no longer be represented.
    if x.hi.is_nan() || x.hi.abs() >= 650.0 {
        return DoubleDouble::of(plain);
    }
    let k = (x.hi / LN_2.hi).round();
    let p = reduced_exp_minus_one(x - LN_2.scale(k));
    (p + DoubleDouble::ONE).ldexp(libm::exp2(k))
}

/// Natural logarithm; NaN below zero.
pub(super) fn ln(x: DoubleDouble) -> DoubleDouble {
    let y = libm::log(x.hi);
    if !y.is_finite() {
        return DoubleDouble::of(y);
    }
    // Taken from the mantissa, so that exp(-y) stays within range.
    let k = libm::log2(x.hi).round();
    let (half, rest) = (libm::exp2(-(k / 2.0).trunc()), libm::exp2(-(k - (k / 2.0).trunc())));
    let mantissa = x.ldexp(half).ldexp(rest);
    let y = DoubleDouble::of(libm::log(mantissa.hi));
    y + (mantissa * exp(-y) - DoubleDouble::ONE) + LN_2.scale(k)
}

/// Hyperbolic tangent.
pub(super) fn tanh(x: DoubleDouble) -> DoubleDouble {
    if x.hi.is_nan() || x.hi.abs() >= 40.0 {
        return DoubleDouble::of(libm::tanh(x.hi));
    }
    let twice = x.ldexp(2.0);
    let p = if twice.hi.abs() < 0.5 { reduced_exp_minus_one(twice) } else { exp(twice) - DoubleDouble::ONE };
    p / (p + DoubleDouble::of(2.0))
}

/// The angle of the vector (x, y) in (-π, π].
pub(super) fn atan2(y: DoubleDouble, x: DoubleDouble) -> DoubleDouble {
    let angle = DoubleDouble::of(libm::atan2(y.hi, x.hi));
    let (sin, cos) = angle.sin_cos();
    let along = x * cos + y * sin;
    if along.hi > 0.0 && along.hi.is_finite() { angle + (y * cos - x * sin) / along } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pair() -> impl Strategy<Value = DoubleDouble> {
        (-30.0..30.0f64, -1.0..1.0f64).prop_map(|(hi, part)| DoubleDouble::sum(hi, part * hi.abs() * 1e-16))
    }

    fn digits(whole: f64, text: &str) -> DoubleDouble {
        let tenth = DoubleDouble::ONE / DoubleDouble::of(10.0);
        let part =
            text.bytes().rev().fold(DoubleDouble::ZERO, |sum, digit| (sum + f64::from(digit - b'0')) * tenth);
        part + whole
    }

    #[test]
    fn published_constants_have_thirty_digits() {
        // OEIS A001113, A002162, A073744 and A000796.
        let near = |found: DoubleDouble, expected: DoubleDouble| {
            assert!((found - expected).hi.abs() < 3e-31 * expected.hi, "{found:?}")
        };
        near(exp(DoubleDouble::ONE), digits(2.0, "71828182845904523536028747135266249"));
        near(ln(DoubleDouble::of(2.0)), digits(0.0, "69314718055994530941723212145817656"));
        near(tanh(DoubleDouble::ONE), digits(0.0, "76159415595576488811945828260479359"));
        near(
            atan2(DoubleDouble::ZERO, DoubleDouble::of(-1.0)),
            digits(3.0, "14159265358979323846264338327950288"),
        );
    }

    proptest! {
        #[test]
        fn exponential_and_logarithm_undo_each_other_and_exponents_add(a in pair(), b in pair()) {
            prop_assert!((ln(exp(a)) - a).hi.abs() < 1e-30 * (1.0 + a.hi.abs()));
            let (product, sum) = (exp(a) * exp(b), exp(a + b));
            prop_assert!(((product - sum) / sum).hi.abs() < 1e-29);
        }

        #[test]
        fn the_tangent_is_that_of_the_exponentials_and_odd(a in pair()) {
            let (plus, minus) = (exp(a), exp(-a));
            prop_assert!((tanh(a) - (plus - minus) / (plus + minus)).hi.abs() < 1e-30);
            prop_assert!((tanh(a) + tanh(-a)).hi.abs() < 1e-30 * tanh(a).hi.abs().max(1e-300));
        }

        #[test]
        fn the_angle_is_that_of_sine_and_cosine(a in -3.1..3.1f64, r in 0.01..100.0f64) {
            let (sin, cos) = DoubleDouble::of(a).sin_cos();
            prop_assert!((atan2(sin.scale(r), cos.scale(r)) - DoubleDouble::of(a)).hi.abs() < 1e-30);
        }
    }
}
