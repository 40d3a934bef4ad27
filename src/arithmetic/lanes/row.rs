//! Numbers of a kind in several vectors: one for each body, spring or row of a mechanism.

use super::Lanes;

/// Four numbers a vector, `B` vectors.
pub type Row<const B: usize> = [[f64; 4]; B];

/// How many numbers `blocks` vectors hold.
pub const fn room(blocks: usize) -> usize {
    4 * blocks
}

/// Number i.
#[inline(always)]
pub fn at<const B: usize>(row: &Row<B>, i: usize) -> f64 {
    row[i / 4][i % 4]
}

/// From memory.
#[inline(always)]
pub fn load<L: Lanes, const B: usize>(row: &Row<B>) -> [L; B] {
    let mut lanes = [L::ZERO; B];
    for b in 0..B {
        lanes[b] = L::of(row[b]);
    }
    lanes
}

/// To memory.
#[inline(always)]
pub fn store<L: Lanes, const B: usize>(lanes: [L; B]) -> Row<B> {
    let mut row = [[0.0; 4]; B];
    for b in 0..B {
        row[b] = lanes[b].array();
    }
    row
}
