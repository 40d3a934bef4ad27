//! Angles kept in [-π, π] beside a count of whole turns.
//!
//! A winding angle loses its last digits as it grows, and with them the run its energy: the motor scene
//! drifts 1900 times more without this.  2π is taken off as a double-double, so wrapping costs no accuracy in
//! a (hi, lo) state and half an ulp in a plain one.

use super::sum::nearest;
use super::{DoubleDouble, Real, Scalar};

/// The angle that spreads its multiples evenly over a turn \[rad\]: no fraction of one.
pub const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// Wraps one angle \[rad\] kept as `hi + lo`; returns the turns taken off.
#[inline(always)]
pub fn wrap(hi: &mut f64, lo: &mut f64) -> i64 {
    if hi.abs() <= std::f64::consts::PI {
        return 0;
    }
    wrap_far(hi, lo)
}

#[cold]
fn wrap_far(hi: &mut f64, lo: &mut f64) -> i64 {
    let (angle, turns) = DoubleDouble::sum(*hi, *lo).reduced();
    (*hi, *lo) = (angle.hi, angle.lo);
    turns as i64
}

/// The difference of two angles \[rad\], in [-π, π].
#[inline]
pub fn difference<T: Real>(a: T, b: T) -> T {
    let raw = a - b;
    let turns = nearest(raw.value() / std::f64::consts::TAU);
    if turns == 0.0 { raw } else { raw - T::split(DoubleDouble::TAU.scale(turns)).0 }
}

/// Whole turns that are to be taken off an angle \[rad\] for it to be in [-π, π].
pub fn whole_turns(angle: f64) -> f64 {
    if angle.abs() <= std::f64::consts::PI { 0.0 } else { (angle / std::f64::consts::TAU).round() }
}

/// The winding angle \[rad\]: the wrapped one and its turns.
pub fn unwrapped(angle: DoubleDouble, turns: i64) -> f64 {
    (angle + DoubleDouble::TAU.scale(turns as f64)).hi
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapping_a_million_turns_keeps_the_angle() {
        let start = DoubleDouble::TAU * DoubleDouble::of(1e6) + DoubleDouble::of(0.25);
        let (mut hi, mut lo) = (start.hi, start.lo);
        assert_eq!(wrap(&mut hi, &mut lo), 1_000_000);
        assert!((hi - 0.25).abs() < 1e-16 && lo.abs() < 1e-16);
        assert_eq!(unwrapped(DoubleDouble::sum(hi, lo), 1_000_000), start.hi);
    }

    #[test]
    fn a_difference_never_exceeds_half_a_turn() {
        assert!((difference(3.1, -3.1) - (6.2 - std::f64::consts::TAU)).abs() < 1e-15);
        assert_eq!(difference(0.5, 0.25), 0.25);
    }
}
