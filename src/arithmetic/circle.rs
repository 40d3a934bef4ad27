//! Sine and cosine to about 1e-25 at a tenth of the cost of the full double-double series.
//!
//! A driven angle that is only right to 1e-16 shakes the driven body by as much in every step, and its velocity by that over the step.
//! Twenty-five digits are plenty, and one table entry and five terms of a series give them:
//!
//! ```text
//! x = angle - k 2π/256, |x| <= 2π/512:    exp(i angle) = exp(2πi k/256) (1 - x²/2 + x⁴/24 - ... + i (x - x³/6 + x⁵/120 - ...))
//! ```
//!
//! The terms in x² and x³ are formed in double-double, those behind them, below 1e-9, in plain doubles.

use super::{Complex, DoubleDouble, Scalar};

/// Parts of the circle.
const PARTS: usize = 256;

/// 1/6.
const SIXTH: DoubleDouble = DoubleDouble { hi: 1.0 / 6.0, lo: 9.251_858_538_542_97e-18 };

/// Unit vectors at the 256th parts of a turn.
#[derive(Clone, Debug)]
pub struct Circle {
    units: Vec<Complex<DoubleDouble>>,
}

impl Default for Circle {
    fn default() -> Self {
        let part = |k: usize| Complex::unit(DoubleDouble::TAU.ldexp(1.0 / PARTS as f64).scale(k as f64));
        Self { units: (0..PARTS).map(part).collect() }
    }
}

impl Circle {
    /// The unit vector at an angle \[rad\] of at most 2⁴⁰ turns.
    #[inline]
    pub fn unit(&self, angle: DoubleDouble) -> Complex<DoubleDouble> {
        let part = DoubleDouble::TAU.ldexp(1.0 / PARTS as f64);
        let k = (angle.hi / part.hi).round();
        let x = angle - part * DoubleDouble::of(k);
        let square = x * x;
        let q = square.hi;
        let cos_tail = q * q * (1.0 / 24.0 - q * (1.0 / 720.0 - q * (1.0 / 40_320.0 - q / 3_628_800.0)));
        let sin_tail = x.hi * q * q * (1.0 / 120.0 - q * (1.0 / 5_040.0 - q / 362_880.0));
        let cos = -square.ldexp(0.5) + cos_tail + 1.0;
        let sin = x - x * square * SIXTH + sin_tail;
        // Not a number lands in the first entry and stays what it is.
        self.units[(k as i64).rem_euclid(PARTS as i64) as usize] * Complex::new(cos, sin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn units_are_those_of_the_full_series(angle in -1e3..1e3f64, low in -1e-14..1e-14f64) {
            let angle = DoubleDouble::sum(angle, low);
            let (found, exact) = (Circle::default().unit(angle), Complex::unit(angle));
            prop_assert!((found.re - exact.re).hi.abs() < 1e-24, "{:e}", (found.re - exact.re).hi);
            prop_assert!((found.im - exact.im).hi.abs() < 1e-24, "{:e}", (found.im - exact.im).hi);
        }
    }

    #[test]
    fn not_a_number_stays_one() {
        assert!(Circle::default().unit(DoubleDouble::of(f64::NAN)).re.hi.is_nan());
    }
}
