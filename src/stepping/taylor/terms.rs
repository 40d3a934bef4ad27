//! Fractions of small whole numbers that are not a drift, and what else the kernels share.
//!
//! A double such as 1/3 has an error of one sign; multiplied into every step it adds up.  So a fraction of a
//! low order is in two terms, and what the double leaves out joins *before* the rounding, since afterwards it
//! is below half a unit in the last place and changes nothing.

use crate::arithmetic::lanes::{Arithmetic, Lanes};

/// Signs that turn swapped pairs to the left.
pub const LEFT: [f64; 4] = [-1.0, 1.0, -1.0, 1.0];

/// What the double 1/k leaves out, for k below 13: further up the terms are too small for it to matter.
const REST: [f64; 13] = [
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

/// 1/k and what it leaves out: a table, so that loops that are not unrolled do not divide.
const RECIPROCAL: [(f64, f64); 26] = {
    let mut table = [(f64::INFINITY, 0.0); 26];
    let mut k = 1;
    while k < table.len() {
        table[k] = (1.0 / k as f64, if k < REST.len() { REST[k] } else { 0.0 });
        k += 1;
    }
    table
};

/// 1/k in two terms, for k from 1 to 25; the second is zero where it does not matter.
#[inline(always)]
pub const fn reciprocal(k: usize) -> (f64, f64) {
    RECIPROCAL[k]
}

/// x/k, rounded once.
#[inline(always)]
pub fn over<A: Arithmetic>(x: A, k: usize) -> A {
    let (r, rest) = reciprocal(k);
    if rest == 0.0 { x.mul(A::splat(r)) } else { x.mul_add(A::splat(r), x.mul(A::splat(rest))) }
}

/// `a - x/k` likewise.
#[inline(always)]
pub fn less_over<L: Lanes>(a: L, x: L, k: usize) -> L {
    let (r, rest) = reciprocal(k);
    if rest == 0.0 { x.neg_mul_add(L::splat(r), a) } else { a.sub(over(x, k)) }
}

/// left(x)/k likewise.
#[inline(always)]
pub fn left_over<L: Lanes>(x: L, k: usize) -> L {
    let (r, rest) = reciprocal(k);
    let (swapped, r) = (x.swap_pairs(), L::of([-r, r, -r, r]));
    if rest == 0.0 {
        swapped.mul(r)
    } else {
        swapped.mul_add(r, swapped.mul(L::of([-rest, rest, -rest, rest])))
    }
}

/// `[x/k, x, …]` likewise.
#[inline(always)]
pub fn over_first<L: Lanes>(x: L, k: usize) -> L {
    let (r, rest) = reciprocal(k);
    let factor = L::of([r, 1.0, r, 1.0]);
    if rest == 0.0 { x.mul(factor) } else { x.mul_add(factor, x.mul(L::of([rest, 0.0, rest, 0.0]))) }
}

/// `[high, low] + increment + rest` as pairs: a two-sum, then the low parts, then a quick two-sum.
#[inline(always)]
pub fn add_to<A: Arithmetic>([high, low]: [A; 2], increment: A, rest: A) -> [A; 2] {
    let (sum, error) = high.two_sum(increment);
    let (high, low) = sum.fast_two_sum(error.add(low.add(rest)));
    [high, low]
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
        for (k, &rest) in REST.iter().enumerate().skip(1) {
            let whole = (DoubleDouble::from(1.0 / k as f64) + rest) * DoubleDouble::from(k as f64);
            assert!((whole + -1.0).hi.abs() < 1e-30, "{k}");
        }
    }
}
