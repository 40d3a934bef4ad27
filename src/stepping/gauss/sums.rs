//! Sums over the stages in pairs of doubles, a stage a lane.

use crate::arithmetic::lanes::Lanes;

/// Four columns as vectors: written out, since a closure that is not inlined calls each operation.
#[inline(always)]
pub(super) fn columns<L: Lanes>(of: &[[f64; 4]; 4]) -> [L; 4] {
    [L::of(of[0]), L::of(of[1]), L::of(of[2]), L::of(of[3])]
}

/// `middle + (across + up)` in pairs, the first by far the largest.
#[inline(always)]
pub(super) fn shifted<L: Lanes>(middle: (L, L), across: (L, L), up: (L, L)) -> (L, L) {
    let (offset, error) = across.0.two_sum(up.0);
    let (high, more) = middle.0.two_sum(offset);
    let low = more.add(error.add(across.1.add(up.1)).add(middle.1));
    high.fast_two_sum(low)
}

/// The largest magnitude of all lanes.
#[inline(always)]
pub(super) fn largest<L: Lanes>(change: [L; 2]) -> f64 {
    let change = change[0].abs().max(change[1].abs());
    let change = change.max(change.swap_halves());
    change.max(change.swap_pairs()).array()[0]
}

/// Σ_j column_j x_j in pairs.
#[inline(always)]
pub(super) fn combine<L: Lanes>(columns: &[L; 4], x: [f64; 4], low: [f64; 4]) -> (L, L) {
    let mut sum = columns[0].mul(L::splat(x[0]));
    let mut rest = columns[0].mul_add(L::splat(low[0]), columns[0].mul_add(L::splat(x[0]), sum.neg()));
    for j in 1..4 {
        let factor = L::splat(x[j]);
        let product = columns[j].mul(factor);
        let error = columns[j].mul_add(L::splat(low[j]), columns[j].mul_add(factor, product.neg()));
        let (next, more) = sum.two_sum(product);
        (sum, rest) = (next, rest.add(error.add(more)));
    }
    (sum, rest)
}

/// The sum of four pairs, and what it leaves out.
#[inline(always)]
pub(super) fn sum_of<L: Lanes>(high: L, low: L) -> (f64, f64) {
    let (sum, error) = high.two_sum(high.swap_halves());
    let (sum, more) = sum.two_sum(sum.swap_pairs());
    let low = low.add(low.swap_halves()).add(error);
    (sum.array()[0], low.add(low.swap_pairs()).add(more).array()[0])
}
