//! A motor's law of time, evaluated so that its phase stays exact over long horizons.
//!
//! `start + rate·t` at 1e5 s carries an error of 1e-10 rad in a plain double.  Time is a pair, and whole
//! turns are taken off before any sine: in double-double for references and monitors, and for the inner loops
//! by one exact product and a quarter turn in three parts,
//!
//! ```text
//! rate·t + start = q π/2 + x + y,    |x| <= π/4,    π/2 = P1 + P2 + P3,   q P1 and q P2 exact
//! ```
//!
//! Source of the latter: W. J. Cody, W. Waite, *Software Manual for the Elementary Functions* (1980), chapter
//! 8.

use super::Time;
use crate::arithmetic::sum::{WHOLE, fast_two_sum, nearest, two_sum};
use crate::arithmetic::{Complex, DoubleDouble, Real, Scalar};
pub use crate::scene::{Law, Sine};
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

/// A law at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Phase<T> {
    /// The angle less whole turns, about [-π, π] \[rad\].
    pub angle: T,
    /// Its unit vector.
    pub unit: Complex<T>,
    /// First derivative \[rad/s\].
    pub rate: T,
    /// Second derivative \[rad/s²\].
    pub acceleration: T,
}

impl<T: Real> Phase<T> {
    /// The same turned the other way where `sign` is -1.
    #[inline(always)]
    pub fn times(self, sign: f64) -> Self {
        if sign > 0.0 {
            return self;
        }
        Self {
            angle: -self.angle,
            unit: self.unit.conj(),
            rate: -self.rate,
            acceleration: -self.acceleration,
        }
    }
}

impl Law {
    /// The angle \[rad\] in full, turns included.
    pub fn angle(&self, t: Time) -> DoubleDouble {
        let polynomial =
            DoubleDouble::of(self.start) + t.scale(self.rate) + (t * t).scale(0.5 * self.acceleration);
        let sum = self
            .sines
            .iter()
            .fold(polynomial, |sum, sine| sum + sine.argument(t).sin_cos().0.scale(sine.amplitude));
        self.profile.iter().fold(sum, |sum, profile| sum + profile.at(t)[0])
    }

    /// The same angle for ever \[rad\].
    pub fn constant(start: f64) -> Self {
        Self { start, ..Self::default() }
    }

    /// True where nothing moves.
    pub fn is_constant(&self) -> bool {
        self.rate == 0.0 && self.is_steady()
    }

    /// True where the rate never changes.
    pub fn is_steady(&self) -> bool {
        self.acceleration == 0.0 && self.sines.is_empty() && self.profile.is_none()
    }

    /// True where it is evaluated in plain doubles without loss.
    #[inline(always)]
    fn is_plain(&self) -> bool {
        self.acceleration == 0.0 && self.profile.is_none()
    }

    /// The angle less whole turns, its unit vector and derivatives.
    #[inline(always)]
    pub fn at<T: Real>(&self, t: Time) -> Phase<T> {
        if T::IS_PLAIN && self.is_plain() {
            let Phase { angle, unit, rate, acceleration } = self.plain(t);
            return Phase {
                angle: T::of(angle),
                unit: Complex::of(unit),
                rate: T::of(rate),
                acceleration: T::of(acceleration),
            };
        }
        let ([angle, rate, acceleration], rest, _) = self.exact::<T>(t);
        // What a plain double cannot hold of the angle turns the unit vector by a first-order rotation.
        let unit = Complex::unit(angle);
        Phase { angle, unit: unit + unit.left().times(rest), rate, acceleration }
    }

    /// The angle less whole turns and its derivatives, without the unit vector.
    #[inline(always)]
    pub fn angles<T: Real>(&self, t: Time) -> [T; 3] {
        if T::IS_PLAIN && self.is_plain() {
            let phase = self.plain(t);
            return [phase.angle, phase.rate, phase.acceleration].map(T::of);
        }
        self.exact(t).0
    }

    /// The angle less so many whole turns \[rad\], its rate \[rad/s\], and the turns.
    pub fn winding(&self, t: Time) -> (DoubleDouble, DoubleDouble, f64) {
        let ([angle, rate, _], _, turns) = self.exact::<DoubleDouble>(t);
        (angle, rate, turns)
    }

    /// By double-double: the angle less whole turns and its derivatives, what `T` leaves out of the angle,
    /// and the turns.
    fn exact<T: Real>(&self, t: Time) -> ([T; 3], T, f64) {
        let mut angle = DoubleDouble::of(self.start) + t.scale(self.rate);
        let mut rate = T::of(self.rate);
        let mut acceleration = T::ZERO;
        if self.acceleration != 0.0 {
            angle += (t * t).scale(0.5 * self.acceleration);
            rate += T::split(t.scale(self.acceleration)).0;
            acceleration = T::of(self.acceleration);
        }
        if let Some(profile) = &self.profile {
            let [more, more_rate, more_acceleration] = profile.at(t);
            angle += more;
            rate += T::split(more_rate).0;
            acceleration += T::split(more_acceleration).0;
        }
        let (angle, turns) = angle.reduced();
        let mut sines = T::ZERO;
        for sine in &self.sines {
            let (sin, cos) = T::split(sine.argument(t).reduced().0).0.sin_cos();
            sines += sin.scale(sine.amplitude);
            rate += cos.scale(sine.amplitude * sine.frequency);
            acceleration -= sin.scale(sine.amplitude * sine.frequency * sine.frequency);
        }
        let (angle, rest) = T::split(angle + sines.double_double());
        ([angle, rate, acceleration], rest, turns)
    }

    /// The angle \[rad\], turns included, as near as the scalar holds it.
    #[inline(always)]
    pub fn value<T: Real>(&self, t: Time) -> T {
        T::split(self.angle(t)).0
    }

    /// The same in plain doubles, for a law without acceleration.
    #[inline(always)]
    fn plain(&self, t: Time) -> Phase<f64> {
        let base = ReducedAngle::new(t, self.rate, self.start);
        if self.sines.is_empty() {
            return Phase { angle: base.angle(), unit: base.unit(), rate: self.rate, acceleration: 0.0 };
        }
        let sum_of_sines = self.sum_of_sines(t);
        let whole = base.plus(sum_of_sines.angle);
        Phase {
            angle: whole.angle(),
            unit: whole.unit(),
            rate: self.rate + sum_of_sines.rate,
            acceleration: sum_of_sines.acceleration,
        }
    }

    /// Sum of the sines and its derivatives; the unit vector is left out.
    fn sum_of_sines(&self, t: Time) -> Phase<f64> {
        self.sines.iter().fold(Phase::default(), |sum, sine| {
            let Complex { re: cos, im: sin } = ReducedAngle::new(t, sine.frequency, sine.phase).unit();
            Phase {
                angle: sum.angle + sin * sine.amplitude,
                unit: sum.unit,
                rate: sum.rate + cos * (sine.amplitude * sine.frequency),
                acceleration: sum.acceleration - sin * (sine.amplitude * sine.frequency * sine.frequency),
            }
        })
    }

    /// First and second derivative \[rad/s, rad/s²\], without the angle.
    #[inline]
    pub fn rates<T: Real>(&self, t: Time) -> (T, T) {
        if self.is_steady() {
            return (T::of(self.rate), T::ZERO);
        }
        if T::IS_PLAIN && self.is_plain() {
            let sum_of_sines = self.sum_of_sines(t);
            return (T::of(self.rate + sum_of_sines.rate), T::of(sum_of_sines.acceleration));
        }
        let [_, rate, acceleration] = self.angles(t);
        (rate, acceleration)
    }
}

/// An angle in quarter turns: q π/2 + x + y.
#[derive(Clone, Copy)]
struct ReducedAngle {
    /// q modulo 4.
    quarter: u64,
    /// x \[rad\].
    high: f64,
    /// y: what x leaves out \[rad\].
    low: f64,
}

impl ReducedAngle {
    /// rate·t + start \[rad\].
    #[inline(always)]
    fn new(t: Time, rate: f64, start: f64) -> Self {
        let product = t.hi * rate;
        let (sum, sum_rest) = two_sum(product, start);
        Self::of(sum, sum_rest + (product_rest(t.hi, rate, product) + t.lo * rate))
    }

    /// An angle and what it leaves out \[rad\], to 1e-18 rad up to 2³² quarter turns and by double-double
    /// beyond.
    #[inline(always)]
    fn of(angle: f64, rest: f64) -> Self {
        /// π/2 in parts of 21, 21 and 53 bits.
        const PARTS: [f64; 3] = [1.570_796_012_878_418, 3.139_164_164_167_596e-7, 6.223_372_171_896_613e-14];
        let shifted = angle * FRAC_2_PI + WHOLE;
        let quarters = shifted - WHOLE;
        // Not a number is not within the bound either.
        let is_near = angle.abs() <= 6.7e9;
        if !is_near {
            return Self::far(angle, rest);
        }
        // Exact: from the first quarter turn on all are multiples of 2⁻⁵³, and the difference is below one.
        let x = (angle - quarters * PARTS[0]) - quarters * PARTS[1];
        let (high, low) = fast_two_sum(x, rest - quarters * PARTS[2]);
        Self { quarter: shifted.to_bits() & 3, high, low }
    }

    #[cold]
    fn far(angle: f64, rest: f64) -> Self {
        let (angle, _) = DoubleDouble::sum(angle, rest).reduced();
        let quarter = nearest(angle.hi * FRAC_2_PI);
        let rest = angle - DoubleDouble::PI.ldexp(0.5).scale(quarter);
        Self { quarter: quarter as i64 as u64 & 3, high: rest.hi, low: rest.lo }
    }

    /// This and another angle \[rad\].
    fn plus(self, angle: f64) -> Self {
        let (sum, rest) = two_sum(self.high, angle);
        let sum = Self::of(sum, rest + self.low);
        Self { quarter: (self.quarter + sum.quarter) & 3, ..sum }
    }

    /// In [-π, π] \[rad\].
    #[inline(always)]
    fn angle(self) -> f64 {
        let quarter = match self.quarter {
            3 => -1.0,
            2 if self.high > 0.0 => -2.0,
            quarter => quarter as f64,
        };
        let (sum, rest) = two_sum(quarter * FRAC_PI_2, self.high);
        sum + (rest + (self.low + quarter * FRAC_PI_2_REST))
    }

    /// Its unit vector, to 0.8 units in the last place: the polynomials of fdlibm's `k_sin.c` and `k_cos.c`
    /// (Sun Microsystems, 1993).
    #[inline(always)]
    fn unit(self) -> Complex<f64> {
        let (x, y) = (self.high, self.low);
        let z = x * x;
        let w = z * z;
        let r = (8.333_333_333_322_489_46e-3
            + z * (-1.984_126_982_985_794_93e-4 + z * 2.755_731_370_707_006_77e-6))
            + z * w * (-2.505_076_025_340_686_34e-8 + z * 1.589_690_995_211_550_10e-10);
        let v = z * x;
        let sin = x - ((z * (0.5 * y - v * r) - y) - v * -1.666_666_666_666_663_24e-1);
        let r = z
            * (4.166_666_666_666_660_19e-2
                + z * (-1.388_888_888_887_410_96e-3 + z * 2.480_158_728_947_672_94e-5))
            + w * w
                * (-2.755_731_435_139_066_33e-7
                    + z * (2.087_572_321_298_174_83e-9 + z * -1.135_964_755_778_819_48e-11));
        let half = 0.5 * z;
        let w = 1.0 - half;
        let cos = w + (((1.0 - w) - half) + (z * r - x * y));
        let (re, im) = if self.quarter & 1 == 0 { (cos, sin) } else { (-sin, cos) };
        if self.quarter & 2 == 0 { Complex::new(re, im) } else { Complex::new(-re, -im) }
    }
}

/// a b less its rounded value, to the last bit or the one before (T. J. Dekker, Numer. Math. 18 (1971), with
/// halves cut off instead of rounded): cheaper than a fused multiply-add where the processor cannot be
/// counted on to have one.
#[inline(always)]
fn product_rest(a: f64, b: f64, product: f64) -> f64 {
    let half = |x: f64| f64::from_bits(x.to_bits() & !0x7ff_ffff);
    let (a_high, b_high) = (half(a), half(b));
    let (a_low, b_low) = (a - a_high, b - b_high);
    ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
}

/// π/2 less its leading double.
const FRAC_PI_2_REST: f64 = 6.123_233_995_736_766e-17;

impl Sine {
    /// frequency·t + phase \[rad\].
    pub(super) fn argument(&self, t: Time) -> DoubleDouble {
        t.scale(self.frequency) + self.phase
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn law() -> Law {
        Law {
            start: 0.3,
            rate: 6.25,
            acceleration: -0.5,
            sines: vec![Sine { amplitude: 0.2, frequency: 11.0, phase: 0.4 }],
            profile: None,
        }
    }

    #[test]
    fn derivatives_are_those_of_the_angle() {
        let (t, h) = (Time::of(1.7), Time::of(1e-4));
        let law = law();
        let (before, now, after) = (law.angle(t - h), law.angle(t), law.angle(t + h));
        let phase = law.at::<DoubleDouble>(t);
        assert!((((after - before) / h).scale(0.5) - phase.rate).hi.abs() < 3e-6);
        assert!(((after + before - now - now) / (h * h) - phase.acceleration).hi.abs() < 3e-5);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        #[test]
        fn plain_phases_are_those_in_double_double_at_every_time(
            hi in prop_oneof![-1e9..1e9f64, -1e3..1e3f64, Just(0.0)],
            part in -0.5..0.5f64,
            rate in prop_oneof![-30.0..30.0f64, Just(std::f64::consts::TAU), Just(0.0)],
            start in prop_oneof![-10.0..10.0f64, Just(FRAC_PI_2)],
            amplitude in prop_oneof![Just(0.0), -4.0..4.0f64],
        ) {
            let t = Time::sum(hi, part * f64::EPSILON * hi.abs());
            let sines = vec![Sine { amplitude, frequency: 0.7 * rate + 1.0, phase: start }];
            let sines = if amplitude == 0.0 { Vec::new() } else { sines };
            let law = Law { start, rate, acceleration: 0.0, sines, profile: None };
            let exact = law.at::<DoubleDouble>(t);
            let plain = law.at::<f64>(t);
            // The sine itself is rounded.
            let slack = 4e-16 * amplitude.abs();
            let off = |found: f64, exact: DoubleDouble| (exact - DoubleDouble::of(found)).hi.abs();
            prop_assert!(off(plain.unit.re, exact.unit.re) < 0.9e-16 + slack, "{plain:?} {exact:?}");
            prop_assert!(off(plain.unit.im, exact.unit.im) < 0.9e-16 + slack, "{plain:?} {exact:?}");
            let turned = (exact.angle - DoubleDouble::of(plain.angle)).reduced().0.hi;
            prop_assert!(turned.abs() < 2.3e-16 + slack, "{plain:?} {exact:?}");
            prop_assert!(plain.angle.abs() < std::f64::consts::PI * (1.0 + 1e-15), "{plain:?} {exact:?}");
            prop_assert!(off(plain.rate, exact.rate) <= 1e-14 * (1.0 + rate.abs()));
            prop_assert_eq!(law.rates::<f64>(t), (plain.rate, plain.acceleration));
        }

        #[test]
        fn a_plain_phase_in_full_does_not_lose_digits_with_time(
            hi in prop_oneof![-1e8..1e8f64, -1e13..1e13f64],
            part in -0.5..0.5f64,
            rate in -40.0..40.0f64,
        ) {
            let t = Time::sum(hi, part * f64::EPSILON * hi.abs());
            let found = ReducedAngle::new(t, rate, 0.3);
            let exact = DoubleDouble::of(0.3) + t.scale(rate);
            let quarters = DoubleDouble::PI.ldexp(0.5).scale(found.quarter as f64);
            let whole = quarters + DoubleDouble::sum(found.high, found.low);
            let error = (exact - whole).reduced().0.hi.abs();
            // Far away the reference itself has so many digits only: 1e-31 of 4e14 rad.
            let bound = if exact.hi.abs() < 6e9 { 1e-18 } else { 1e-16 };
            prop_assert!(error < bound, "{error:e}");
        }
    }

    #[test]
    fn what_is_not_finite_has_no_phase() {
        for t in [f64::NAN, f64::INFINITY] {
            let phase = law().at::<f64>(Time::of(t));
            assert!(phase.angle.is_nan() && phase.unit.re.is_nan() && phase.unit.im.is_nan());
        }
    }

    #[test]
    fn the_phase_keeps_sixteen_digits_at_a_million_seconds() {
        let t = Time::of(1e6);
        let (law, exact) = (law(), law().angle(t).sin_cos());
        let plain = law.at::<f64>(t);
        assert!((plain.unit.re - exact.1.hi).abs() < 3e-16 && (plain.unit.im - exact.0.hi).abs() < 3e-16);
        assert!((law.at::<DoubleDouble>(t).unit.re - exact.1).hi.abs() < 1e-19);
    }
}
