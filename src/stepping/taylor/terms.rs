//! Fractions of small whole numbers that are not a drift, and what else the kernels share.
//!
//! A double such as 1/3 has an error of one sign; multiplied into every step it adds up.  So a fraction of a low order is in two terms, and what the double
//! leaves out joins *before* the rounding, since afterwards it is below half a unit in the last place and changes nothing.

use crate::arithmetic::lanes::Lanes;

/// What the double 1/k leaves out, for k below 13: further up the terms are too small for it to matter.
pub const RECIPROCAL_REST: [f64; 13] = [
    0.0,
    0.0,
    0.0,
    1.850_371_707_708_594e-17,
    0.0,
    -1.110_223_024_625_156_6e-17,
    9.251_858_538_542_97e-18,
    7.930_164_461_608_26e-18,
    0.0,
    6.167_905_692_361_98e-18,
    -5.551_115_123_125_783e-18,
    -2.523_234_146_875_356e-18,
    4.625_929_269_271_485e-18,
];

/// Signs that turn swapped pairs to the left.
pub const LEFT: [f64; 4] = [-1.0, 1.0, -1.0, 1.0];

/// What is left out of 1/k, for a constant k known after inlining; zero where it does not matter.
#[inline(always)]
const fn rest(k: usize) -> f64 {
    if k < RECIPROCAL_REST.len() { RECIPROCAL_REST[k] } else { 0.0 }
}

/// x/k, rounded once.
#[inline(always)]
pub fn over<L: Lanes>(x: L, k: usize) -> L {
    let r = L::splat(1.0 / k as f64);
    if rest(k) == 0.0 { x.mul(r) } else { x.mul_add(r, x.mul(L::splat(rest(k)))) }
}

/// left(x)/k likewise.
#[inline(always)]
pub fn left_over<L: Lanes>(x: L, k: usize) -> L {
    let swapped = x.swap_pairs();
    let r = L::of(LEFT.map(|sign| sign / k as f64));
    if rest(k) == 0.0 { swapped.mul(r) } else { swapped.mul_add(r, swapped.mul(L::of(LEFT.map(|sign| sign * rest(k))))) }
}

/// `[x/k, x, …]` likewise.
#[inline(always)]
pub fn over_first<L: Lanes>(x: L, k: usize) -> L {
    let r = 1.0 / k as f64;
    let r = L::of([r, 1.0, r, 1.0]);
    if rest(k) == 0.0 { x.mul(r) } else { x.mul_add(r, x.mul(L::of([rest(k), 0.0, rest(k), 0.0]))) }
}

/// Sums within pairs, in both lanes of each.
#[inline(always)]
pub fn pair_sum<L: Lanes>(x: L) -> L {
    x.add(x.swap_pairs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::DoubleDouble;

    #[test]
    fn fractions_are_whole_in_two_terms() {
        for (k, &rest) in RECIPROCAL_REST.iter().enumerate().skip(1) {
            let whole = (DoubleDouble::from(1.0 / k as f64) + rest) * DoubleDouble::from(k as f64);
            assert!((whole + -1.0).hi.abs() < 1e-30, "{k}");
        }
    }
}
