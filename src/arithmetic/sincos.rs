//! Sine and cosine of independent angles in lanes, at most one unit in the last place off; and of pairs,
//! to about 66 bits.
//!
//! ```text
//! phi = q π/2 + r + low, |r| <= π/4;   cos r = 1 - r²/2 + r⁴ C(r²),   sin r = r + r³ S(r²)
//! m = q - 4 [q/4] = -2…2:   cos phi = (1 - |m|) cos r - m (2 - |m|) sin r,
//!     sin phi = (1 - |m|) sin r + m (2 - |m|) cos r
//! ```
//!
//! π/2 is taken off in three parts.  The first product loses nothing: its difference to phi is a multiple of
//! 2⁻⁵² (2⁻⁵³ below 1) less than 1.  The second is exact as a pair, the third rounds at 2⁻¹⁵⁰.  That serves
//! angles up to [`RANGE`]; a vector with an angle beyond is handed to `libm`, lane by lane.
//!
//! Both series are Taylor's to r¹⁸ and r¹⁷ (for pairs r²² and r²¹), whose next terms are below 4e-21 and
//! 1e-19 (5e-24 and 2e-25): no fitted constants, no bias.  Whatever is rounded on the way to the leading
//! terms is kept and joins the correction.
//!
//! Source of the reduction: W. J. Cody, W. Waite, *Software Manual for the Elementary Functions* (1980),
//! section 8, with a fused multiply-add.

use super::lanes::{self, Code, Lanes, Signed};
use super::sum::WHOLE;
use super::{Complex, DoubleDouble, Scalar};
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

/// Largest magnitude of an angle that is reduced in lanes \[rad\].
pub const RANGE: f64 = 1e6;

/// What the leading double leaves out of π/2, and what that leaves.
const MIDDLE: f64 = 6.123_233_995_736_766e-17;
const LEAST: f64 = -1.497_384_904_859_169_8e-33;

/// ±1/k! for k = 4, 6, … 22 and k = 3, 5, … 21; plain doubles take the first eight.
const COS: [f64; 10] = factors(4);
const SIN: [f64; 10] = factors(3);
/// What 1/3!, … 1/6! leave out.
const THIRD_REST: f64 = 9.251_858_538_542_97e-18;
const FOURTH_REST: f64 = 2.312_964_634_635_742_7e-18;
const FIFTH_REST: f64 = 1.156_482_317_317_871_4e-19;
const SIXTH_REST: f64 = -5.300_543_954_373_577e-20;

const fn factors(first: usize) -> [f64; 10] {
    let mut factors = [0.0; 10];
    let (mut i, mut k, mut factorial) = (0, 3, 2.0);
    while i < 10 {
        // Exact up to 22!.
        factorial *= k as f64;
        if k >= first && (k - first).is_multiple_of(2) {
            let sign = if (k / 2).is_multiple_of(2) { 1.0 } else { -1.0 };
            factors[i] = sign / factorial;
            i += 1;
        }
        k += 1;
    }
    factors
}

/// An angle as quarter turns and the rest.
struct QuarterTurns<L> {
    /// r and what it leaves out.
    r: L,
    low: L,
    /// 1 - |m| and m (2 - |m|).
    along: L,
    across: L,
}

#[inline(always)]
fn reduce<L: Signed>(angle: L, rest: L) -> QuarterTurns<L> {
    let shift = L::splat(WHOLE);
    let q = angle.mul_add(L::splat(FRAC_2_PI), shift).sub(shift);
    let long = q.neg_mul_add(L::splat(FRAC_PI_2), angle);
    let tail = q.mul(L::splat(MIDDLE));
    let tail_rest = q.mul_add(L::splat(LEAST), q.mul_add(L::splat(MIDDLE), tail.neg()));
    // Two-sum: near a quarter turn the tail may be the larger.
    let near = long.sub(tail);
    let part = near.sub(long);
    let error = long.sub(near.sub(part)).sub(tail.add(part));
    let small = error.add(rest.sub(tail_rest));
    let r = near.add(small);
    let low = near.sub(r).add(small);
    let m = L::splat(4.0).neg_mul_add(q.mul_add(L::splat(0.25), shift).sub(shift), q);
    let size = m.abs();
    QuarterTurns { r, low, along: L::ONE.sub(size), across: m.mul(L::splat(2.0).sub(size)) }
}

impl<L: Signed> QuarterTurns<L> {
    /// Back to the quadrant: sums of one number and a zero.
    #[inline(always)]
    fn turn(&self, sin: L, cos: L) -> (L, L) {
        (self.across.mul_add(cos, self.along.mul(sin)), self.across.neg_mul_add(sin, self.along.mul(cos)))
    }
}

/// `Σ c_k z^k` by two Horner chains in z².
#[inline(always)]
fn series<L: Signed>(factors: &[f64], z: L, zz: L) -> L {
    let n = factors.len();
    let (mut even, mut odd) = (L::splat(factors[n - 2]), L::splat(factors[n - 1]));
    let mut k = n - 2;
    while k > 0 {
        k -= 2;
        even = even.mul_add(zz, L::splat(factors[k]));
        odd = odd.mul_add(zz, L::splat(factors[k + 1]));
    }
    odd.mul_add(z, even)
}

/// Sine and cosine, in this order, of `angle + rest` \[rad\], where `rest` is what the angles leave out: at
/// most half an ulp of them.
///
/// At most 0.8 units in the last place off for angles up to [`RANGE`], at most 1 beyond; not a number where
/// an angle is not finite.
#[inline(always)]
pub fn sin_cos<L: Signed>(angle: L, rest: L) -> (L, L) {
    if !angle.are_within(RANGE) {
        return far(angle);
    }
    let reduced = reduce(angle, rest);
    let (r, low) = (reduced.r, reduced.low);
    let z = r.mul(r);
    let (z_rest, zz) = (r.mul_add(r, z.neg()), z.mul(z));
    let half = L::splat(-0.5);
    let lead = z.mul_add(half, L::ONE);
    let dropped = z.mul_add(half, L::ONE.sub(lead));
    let small = r.neg_mul_add(low, z_rest.mul_add(half, dropped));
    let small = zz.mul_add(L::splat(FOURTH_REST), small);
    let cos = lead.add(zz.mul_add(series(&COS[..8], z, zz), small));
    let cube = z.mul(r);
    let small = cube.mul_add(L::splat(-THIRD_REST), low.mul(lead));
    let sin = r.add(cube.mul_add(series(&SIN[..8], z, zz), small));
    reduced.turn(sin, cos)
}

/// Writes the unit vectors at these angles \[rad\], four at a time.
pub fn units(angles: &[f64], units: &mut [Complex<f64>]) {
    lanes::run(UnitVectors { angles, units }, false);
}

struct UnitVectors<'a> {
    angles: &'a [f64],
    units: &'a mut [Complex<f64>],
}

impl Code for UnitVectors<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        units_in::<L>(self.angles, self.units);
    }
}

#[inline(always)]
fn units_in<L: Lanes>(angles: &[f64], units: &mut [Complex<f64>]) {
    let n = angles.len().min(units.len());
    for at in (0..n).step_by(4) {
        let count = 4.min(n - at);
        let mut four = [0.0; 4];
        four[..count].copy_from_slice(&angles[at..at + count]);
        let (sin, cos) = sin_cos(L::of(four), L::ZERO);
        let (sin, cos) = (sin.array(), cos.array());
        for k in 0..count {
            units[at + k] = Complex { re: cos[k], im: sin[k] };
        }
    }
}

/// A number and what it leaves out, in lanes.
type Pair<L> = [L; 2];

#[inline(always)]
fn quick<L: Signed>(high: L, low: L) -> Pair<L> {
    let (high, low) = high.fast_two_sum(low);
    [high, low]
}

/// a + b where |a| >= |b|.
#[inline(always)]
fn sum<L: Signed>(a: Pair<L>, b: Pair<L>) -> Pair<L> {
    let [high, low] = quick(a[0], b[0]);
    quick(high, low.add(a[1].add(b[1])))
}

#[inline(always)]
fn product<L: Signed>(a: Pair<L>, b: Pair<L>) -> Pair<L> {
    let high = a[0].mul(b[0]);
    quick(high, a[1].mul_add(b[0], a[0].mul_add(b[1], a[0].mul_add(b[0], high.neg()))))
}

/// `c_0 + c_1 z + z² Σ c_k z^(k-2)`, its first two terms in pairs.
#[inline(always)]
fn series_pair<L: Signed>(factors: &[f64; 10], rests: [f64; 2], z: Pair<L>, zz: L) -> Pair<L> {
    let constant = |k: usize| [L::splat(factors[k]), L::splat(rests[k])];
    let steep = sum(constant(1), [z[0].mul(series(&factors[2..], z[0], zz)), L::ZERO]);
    sum(constant(0), product(z, steep))
}

/// Sine and cosine of pairs `[angle, rest]`, each as a pair that is off by less than 1e-20.
///
/// An angle beyond [`RANGE`] sends the vector to [`DoubleDouble`], lane by lane.
#[inline(always)]
pub fn sin_cos_pair<L: Signed>(angle: Pair<L>) -> (Pair<L>, Pair<L>) {
    if !angle[0].are_within(RANGE) {
        return far_pair(angle);
    }
    let reduced = reduce(angle[0], angle[1]);
    let r = [reduced.r, reduced.low];
    let z = product(r, r);
    let zz = z[0].mul(z[0]);
    let sin = sum(r, product(product(r, z), series_pair(&SIN, [-THIRD_REST, FIFTH_REST], z, zz)));
    let half = [z[0].mul(L::splat(-0.5)), z[1].mul(L::splat(-0.5))];
    let bend = sum(half, product(product(z, z), series_pair(&COS, [FOURTH_REST, -SIXTH_REST], z, zz)));
    let cos = sum([L::ONE, L::ZERO], bend);
    let (sin_high, cos_high) = reduced.turn(sin[0], cos[0]);
    let (sin_low, cos_low) = reduced.turn(sin[1], cos[1]);
    ([sin_high, sin_low], [cos_high, cos_low])
}

#[cold]
#[inline(never)]
fn far<L: Signed>(angle: L) -> (L, L) {
    let of = |[angle, _]: [f64; 2]| libm::sincos(angle).into();
    L::each([angle; 2], of).into()
}

#[cold]
#[inline(never)]
fn far_pair<L: Signed>([angle, rest]: Pair<L>) -> (Pair<L>, Pair<L>) {
    let of = |[angle, rest, ..]: [f64; 4]| {
        let (sin, cos) = DoubleDouble::sum(angle, rest).sin_cos();
        [sin.hi, sin.lo, cos.hi, cos.lo]
    };
    let [sin, sin_rest, cos, cos_rest] = L::each([angle, rest, angle, rest], of);
    ([sin, sin_rest], [cos, cos_rest])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::lanes::{Arithmetic, Portable};
    use std::f64::consts::{PI, TAU};

    /// Sine and cosine in double-double; quarter turns are taken off in three parts first, which
    /// [`DoubleDouble`] does in two.
    fn exact(angle: f64, rest: f64) -> (DoubleDouble, DoubleDouble) {
        let q = (angle / FRAC_PI_2).round();
        let r = DoubleDouble::of(angle)
            - DoubleDouble::product(q, FRAC_PI_2)
            - DoubleDouble::product(q, MIDDLE)
            - DoubleDouble::product(q, LEAST);
        let (sin, cos) = (r + rest).sin_cos();
        match (q as i64).rem_euclid(4) {
            0 => (sin, cos),
            1 => (cos, -sin),
            2 => (-sin, -cos),
            _ => (-cos, sin),
        }
    }

    /// Errors of sine and cosine in units of the last place of the exact value, and of the pair, absolute.
    fn errors(angle: f64, rest: f64) -> (f64, f64) {
        let (sin, cos) = sin_cos(Portable::splat(angle), Portable::splat(rest));
        let (sin_pair, cos_pair) = sin_cos_pair([Portable::splat(angle), Portable::splat(rest)]);
        let exact = exact(angle, rest);
        let mut worst = (0f64, 0f64);
        for (found, pair, exact) in [(sin, sin_pair, exact.0), (cos, cos_pair, exact.1)] {
            let exponent = (exact.hi.abs().to_bits() >> 52) as i32 - 1023;
            let unit = 2f64.powi((exponent - 52).max(-1074));
            let found = found.array()[0];
            worst.0 = worst.0.max((exact - DoubleDouble::of(found)).hi.abs() / unit);
            worst.1 =
                worst.1.max((exact - DoubleDouble::sum(pair[0].array()[0], pair[1].array()[0])).hi.abs());
        }
        worst
    }

    /// The worst errors over these angles; fails beyond the bounds promised.
    fn check(angles: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
        let mut worst = (0f64, 0f64);
        for (angle, rest) in angles {
            let found = errors(angle, rest);
            assert!(
                found.0 <= 0.8 && found.1 < 1e-20,
                "{angle:e} + {rest:e}: {} ulp, pair {:e}",
                found.0,
                found.1
            );
            worst = (worst.0.max(found.0), worst.1.max(found.1));
        }
        worst
    }

    /// Uniform in [0, 1), the same in every run.
    fn uniform(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = *seed;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 * 2f64.powi(-53)
    }

    /// Angles of one spread: uniform ones, with a rest of up to half a unit in the last place.
    fn random(count: usize, spread: f64, seed: u64) -> impl Iterator<Item = (f64, f64)> {
        let mut seed = seed;
        (0..count).map(move |_| {
            let angle = (2.0 * uniform(&mut seed) - 1.0) * spread;
            (angle, (uniform(&mut seed) - 0.5) * f64::EPSILON * angle.abs() * 0.5)
        })
    }

    /// Angles spread evenly over the exponents from 2^-40 to the range.
    fn of_every_binade(each: usize) -> impl Iterator<Item = (f64, f64)> {
        let mut seed = 7;
        (-40..20).flat_map(move |k| (0..each).map(move |i| (k, i))).map(move |(k, i)| {
            let size = (2f64.powi(k) * (1.0 + uniform(&mut seed))).min(RANGE);
            (if i % 2 == 0 { size } else { -size }, 0.0)
        })
    }

    /// The doubles next to multiples of π/4, where reduction cancels or the quadrant changes.
    fn near_quarters(turns: i64) -> impl Iterator<Item = (f64, f64)> {
        (-turns..=turns).flat_map(|k| {
            let centre = (DoubleDouble::PI.ldexp(0.25) * DoubleDouble::of(k as f64)).hi;
            (-3i64..=3)
                .map(move |step| (f64::from_bits(centre.to_bits().saturating_add_signed(step)), 0.0))
                .filter(|(a, _)| a.abs() <= RANGE)
        })
    }

    #[test]
    fn at_most_eight_tenths_of_a_unit_off() {
        println!("wrapped: {:?}", check(random(150_000, PI, 1)));
        println!("winding: {:?}", check(random(50_000, RANGE, 2)));
        println!("small: {:?}", check(random(30_000, 0.01, 3)));
        println!("binades: {:?}", check(of_every_binade(1_000)));
        println!("quarters: {:?}", check(near_quarters(20_000)));
    }

    #[test]
    #[ignore = "a minute; many millions of angles"]
    fn at_most_eight_tenths_of_a_unit_off_for_millions() {
        for seed in 0..8 {
            println!("wrapped: {:?}", check(random(5_000_000, PI, 100 + seed)));
        }
        println!("quarter: {:?}", check(random(10_000_000, PI / 4.0, 200)));
        println!("winding: {:?}", check(random(5_000_000, RANGE, 201)));
        println!("binades: {:?}", check(of_every_binade(100_000)));
        println!("quarters: {:?}", check(near_quarters((RANGE / (PI / 4.0)) as i64 + 1)));
        // Every double of a stretch: neighbours share all but their last bits.
        for start in [0.5, PI / 4.0, 1.0, PI / 2.0, 2.0, 3.0] {
            let every = (0..1_000_000u64).map(|k| (f64::from_bits((start - 1e-10).to_bits() + k), 0.0));
            println!("every double from {start}: {:?}", check(every));
        }
    }

    /// The hardest of all doubles to reduce lies far beyond the range; within it, the continued fraction of
    /// π/2 gives the hardest.
    #[test]
    fn angles_nearest_to_quarter_turns() {
        // Convergents p/q of π/2 and their multiples: p is the integer nearest to q π/2.
        for p in [
            3.0, 11.0, 22.0, 344.0, 355.0, 710.0, 51_819.0, 52_174.0, 103_993.0, 104_348.0, 208_341.0,
            312_689.0, 573_204.0, 833_719.0,
        ] {
            for power in 0..30 {
                let angle = p * 2f64.powi(-power);
                check([(angle, 0.0), (-angle, 0.0)].into_iter());
            }
        }
    }

    #[test]
    fn many_unit_vectors_are_those_of_each() {
        let angles: Vec<f64> = (0..11).map(|k| 0.7 * f64::from(k) - 3.0).chain([RANGE.next_up()]).collect();
        for n in [0, 1, 3, 4, 12] {
            let mut several = vec![Complex::ZERO; n];
            units(&angles[..n], &mut several);
            for (unit, &angle) in several.iter().zip(&angles) {
                let (sin, cos) = sin_cos(Portable::splat(angle), Portable::ZERO);
                assert_eq!((unit.re, unit.im), (cos.array()[0], sin.array()[0]));
            }
        }
    }

    #[test]
    fn ends_and_what_is_not_finite() {
        let at = |angle: f64| {
            let (sin, cos) = sin_cos(Portable::splat(angle), Portable::ZERO);
            (sin.array()[0], cos.array()[0])
        };
        assert_eq!(at(0.0), (0.0, 1.0));
        for tiny in [5e-324, 1e-310, f64::MIN_POSITIVE, 1e-200, 1e-9] {
            assert_eq!((at(tiny), at(-tiny)), ((tiny, 1.0), (-tiny, 1.0)));
        }
        assert_eq!(at(PI / 2.0), (1.0, 6.123_233_995_736_766e-17));
        assert_eq!(at(PI), (1.224_646_799_147_353_2e-16, -1.0));
        check([(RANGE, 0.0), (-RANGE, 0.0), (TAU, 0.0)].into_iter());
        for beyond in [RANGE.next_up(), 1e10, -1e22, 1e300, f64::MAX] {
            assert_eq!(at(beyond), libm::sincos(beyond));
        }
        for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(at(odd).0.is_nan() && at(odd).1.is_nan());
            // One such lane leaves its neighbours right.
            let (sin, _) = sin_cos(Portable::of([0.5, odd, 1.0, 2.0]), Portable::ZERO);
            assert!((sin.array()[0] - libm::sin(0.5)).abs() < 2e-16 && sin.array()[1].is_nan());
        }
    }
}
