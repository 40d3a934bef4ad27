//! Fractions of small whole numbers that are not a drift, and what else the kernels share.
//!
//! A double such as 1/3 has an error of one sign; multiplied into every step it adds up.  So a fraction of a low order is in two terms, and what the double
//! leaves out joins *before* the rounding, since afterwards it is below half a unit in the last place and changes nothing.

use super::pace::RECIPROCAL_REST;
use crate::arithmetic::lanes::Lanes;

/// Signs that turn swapped pairs to the left.
pub const LEFT: [f64; 4] = [-1.0, 1.0, -1.0, 1.0];

/// What is left out of 1/k, for a constant k known after inlining; zero where it does not matter.
#[inline(always)]
pub const fn rest(k: usize) -> f64 {
    if k < RECIPROCAL_REST.len() { RECIPROCAL_REST[k] } else { 0.0 }
}

/// x/k, rounded once.
#[inline(always)]
pub fn over<L: Lanes>(x: L, k: usize) -> L {
    let r = L::splat(1.0 / k as f64);
    if rest(k) == 0.0 { x.mul(r) } else { x.mul_add(r, x.mul(L::splat(rest(k)))) }
}

/// `a - x/k` likewise.
#[inline(always)]
pub fn less_over<L: Lanes>(a: L, x: L, k: usize) -> L {
    if rest(k) == 0.0 { x.neg_mul_add(L::splat(1.0 / k as f64), a) } else { a.sub(over(x, k)) }
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
