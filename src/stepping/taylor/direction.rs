//! Unit vectors of two angles in four lanes, to three quarters of a unit in the last place.
//!
//! ```text
//! phi = q π/2 + r + rest, |r| <= π/4;   cos r = 1 - r²/2 + r⁴ C(r²),   sin r = r + r³ S(r²)
//! cos phi = (1 - |q|) cos r - q (2 - |q|) sin r,    sin phi = (1 - |q|) sin r + q (2 - |q|) cos r,
//!     q = -2…2
//! ```
//!
//! Both series are the Taylor series to r¹⁸ and r¹⁷, whose next terms are below 3e-21 and 1e-19: no fitted
//! constants, no bias.  Whatever is rounded on the way to the leading terms is kept and joins the correction,
//! and with it what the leading part leaves out of the angle.

use crate::arithmetic::lanes::Lanes;
use crate::arithmetic::sum::WHOLE;
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

/// π/2 less its leading double.
const FRAC_PI_2_REST: f64 = 6.123_233_995_736_766e-17;

/// ±1/k! for k = 4, 3; 6, 5; … 18, 17, as factors of cos and sin.
const FACTORS: [[f64; 4]; 8] = {
    let mut factors = [[0.0; 4]; 8];
    let (mut k, mut factorial, mut sign) = (0, 2.0, 1.0);
    while k < 8 {
        let odd = factorial * (2 * k + 3) as f64;
        factorial = odd * (2 * k + 4) as f64;
        factors[k] = [sign / factorial, -sign / odd, sign / factorial, -sign / odd];
        sign = -sign;
        k += 1;
    }
    factors
};
/// What 1/24 and -1/6 leave out.
const FIRST_REST: [f64; 4] = [
    2.312_964_634_635_743e-18,
    -9.251_858_538_542_97e-18,
    2.312_964_634_635_743e-18,
    -9.251_858_538_542_97e-18,
];

const COS: [f64; 4] = [1.0, 0.0, 1.0, 0.0];
const SIN: [f64; 4] = [0.0, 1.0, 0.0, 1.0];

/// `[cos, sin, cos, sin]` of angles `[a, a, b, b]` \[rad\] in [-π, π] and what they leave out.
#[inline(always)]
pub fn unit<L: Lanes>(angle: L, rest: L) -> L {
    let shift = L::splat(WHOLE);
    let q = angle.mul_add(L::splat(FRAC_2_PI), shift).sub(shift);
    // The first product is exact where it matters: q has two bits, and the difference cancels.
    let long = q.neg_mul_add(L::splat(FRAC_PI_2), angle);
    let tail = q.neg_mul_add(L::splat(FRAC_PI_2_REST), rest);
    let r = long.add(tail);
    let low = long.sub(r).add(tail);
    let (cos, sin) = (L::of(COS), L::of(SIN));
    let z = r.mul(r);
    let z_rest = r.mul_add(r, L::splat(0.0).sub(z));
    // Leading terms [1 - z/2, r] with what rounding drops.
    let half = cos.mul(L::splat(-0.5));
    let first = r.mul_add(sin, cos);
    let lead = z.mul_add(half, first);
    let dropped = z.mul_add(half, first.sub(lead));
    // The series by two Horner chains in z².
    let zz = z.mul(z);
    let (mut even, mut odd) = (L::of(FACTORS[6]), L::of(FACTORS[7]));
    let mut k = 6;
    while k > 0 {
        k -= 2;
        even = even.mul_add(zz, L::of(FACTORS[k]));
        odd = odd.mul_add(zz, L::of(FACTORS[k + 1]));
    }
    let series = odd.mul_add(z, even);
    let power = z.mul(z.mul_add(cos, r.mul(sin)));
    let slope = lead.swap_pairs().mul(L::of([-1.0, 1.0, -1.0, 1.0]));
    let small = z_rest.mul_add(half, dropped).add(low.mul(slope));
    let small = power.mul_add(L::of(FIRST_REST), small);
    let base = lead.add(power.mul_add(series, small));
    // Back to the quadrant, with factors 0 and ±1.
    let size = q.abs();
    let across = q.mul(L::splat(2.0).sub(size)).mul(L::of([-1.0, 1.0, -1.0, 1.0]));
    base.mul_add(L::splat(1.0).sub(size), base.swap_pairs().mul(across))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::lanes::{Arithmetic, Portable};
    use crate::arithmetic::{DoubleDouble, Scalar};
    use proptest::prelude::*;

    fn error(angle: f64, rest: f64) -> f64 {
        let found = unit(Portable::splat(angle), Portable::splat(rest)).array();
        let (sin, cos) = DoubleDouble::sum(angle, rest).sin_cos();
        assert_eq!(found[..2], found[2..]);
        let ulps = |found: f64, exact: DoubleDouble| {
            let unit = f64::EPSILON * 2f64.powi(exact.hi.abs().log2().floor() as i32);
            (exact - DoubleDouble::of(found)).hi.abs() / unit
        };
        ulps(found[0], cos).max(ulps(found[1], sin))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        #[test]
        fn unit_vectors_are_rounded_almost_correctly(angle in -std::f64::consts::PI..=std::f64::consts::PI,
            rest in -1e-17..1e-17f64) {
            prop_assert!(error(angle, rest) < 0.75, "{angle}: {} ulp", error(angle, rest));
        }
    }

    #[test]
    fn the_ends_of_the_range_and_not_a_number() {
        for angle in [
            0.0,
            1e-300,
            FRAC_PI_2,
            -FRAC_PI_2,
            std::f64::consts::PI,
            -std::f64::consts::PI,
            3.0 * FRAC_PI_2 / 2.0,
        ] {
            assert!(unit(Portable::splat(angle), Portable::splat(0.0)).array()[0].abs() <= 1.0);
        }
        assert_eq!(unit(Portable::splat(0.0), Portable::splat(0.0)).array(), [1.0, 0.0, 1.0, 0.0]);
        assert!(unit(Portable::splat(f64::NAN), Portable::splat(0.0)).array().iter().all(|x| x.is_nan()));
    }
}
