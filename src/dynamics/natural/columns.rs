//! The natural form of a few bodies in lanes, one a body: what depends on the configuration, and the
//! solve with one row a body.
//!
//! ```text
//! u_j = W_·j z_j   (column j),    S_kj = z_k·u_kj,    T_kj = (i z_k)·u_kj
//! S mu = r,   a body whose pivot is less than a share DROPPED of its scale is left out, its multiplier zero
//! ```

use super::reduced::ReducedMatrices;
use crate::arithmetic::lanes::Lanes;
use crate::arithmetic::lanes::row::{Row, load};
use crate::dynamics::schur::DROPPED;

/// W column by column, in lanes over its rows; lanes beyond the last body are zero.
#[derive(Clone, Debug, PartialEq)]
pub struct LaneColumns<const B: usize> {
    /// xx, xy, yx, yy of every column \[1/(kg·m²)\].
    pub blocks: Vec<[Row<B>; 4]>,
    /// What the pivots of S are measured against.
    pub scale: Vec<f64>,
}

impl<const B: usize> LaneColumns<B> {
    /// Of a mechanism's matrices; there must be room, and no translational coordinates.
    pub fn new(reduced: &ReducedMatrices) -> Self {
        let n = reduced.free.len();
        let mut blocks = vec![[[[0.0; 4]; B]; 4]; n];
        for (i, row) in reduced.inverse.chunks(n.max(1)).enumerate() {
            for (column, block) in blocks.iter_mut().zip(row) {
                for (part, entry) in column.iter_mut().zip(block) {
                    part[i / 4][i % 4] = *entry;
                }
            }
        }
        Self { blocks, scale: reduced.free.clone() }
    }
}

/// Column j of W z: its x and y components.
#[inline(always)]
pub fn turned<L: Lanes, const B: usize>(block: &[Row<B>; 4], x: f64, y: f64) -> [[L; B]; 2] {
    let (x, y) = (L::splat(x), L::splat(y));
    let mut column = [[L::ZERO; B]; 2];
    for b in 0..B {
        column[0][b] = L::of(block[0][b]).mul_add(x, L::of(block[1][b]).mul(y));
        column[1][b] = L::of(block[2][b]).mul_add(x, L::of(block[3][b]).mul(y));
    }
    column
}

/// Solves S mu = r by Gauss–Jordan, in place of `right`; S is lost.  Returns the least share of a pivot.
#[inline(always)]
pub fn solve<L: Lanes, const B: usize>(schur: &mut [Row<B>], scale: &[f64], right: &mut Row<B>) -> f64 {
    let n = schur.len();
    let mut least = f64::INFINITY;
    let mut kept = [[0.0; 4]; B];
    for p in 0..n {
        let pivot = schur[p][p / 4][p % 4];
        let share = pivot / scale[p];
        least = if share < least { share } else { least };
        if share < DROPPED {
            continue;
        }
        let factor = 1.0 / pivot;
        kept[p / 4][p % 4] = factor;
        // Row p itself keeps its entries: it is divided by its pivot at the end.
        let mut away = schur[p];
        away[p / 4][p % 4] = 0.0;
        let away: [L; B] = load(&away);
        for q in p + 1..n {
            let part = L::splat(schur[q][p / 4][p % 4] * factor);
            for b in 0..B {
                schur[q][b] = away[b].neg_mul_add(part, L::of(schur[q][b])).array();
            }
        }
        let part = L::splat(right[p / 4][p % 4] * factor);
        for b in 0..B {
            right[b] = away[b].neg_mul_add(part, L::of(right[b])).array();
        }
    }
    for b in 0..B {
        right[b] = L::of(right[b]).mul(L::of(kept[b])).array();
    }
    least
}

/// S⁻¹ in place by Gauss–Jordan; rows and columns of bodies left out are zero.  Returns the least share of a
/// pivot.
#[inline(always)]
pub fn invert<L: Lanes, const B: usize>(schur: &mut [Row<B>], scale: &[f64]) -> f64 {
    let n = schur.len();
    let mut least = f64::INFINITY;
    let mut is_left_out = [false; 16];
    for p in 0..n {
        let pivot = schur[p][p / 4][p % 4];
        let share = pivot / scale[p];
        least = if share < least { share } else { least };
        if share < DROPPED {
            is_left_out[p] = true;
            continue;
        }
        let factor = 1.0 / pivot;
        let mut away = schur[p];
        away[p / 4][p % 4] = 0.0;
        let away: [L; B] = load(&away);
        for q in 0..n {
            if q == p {
                continue;
            }
            let part = schur[q][p / 4][p % 4] * factor;
            let lanes = L::splat(part);
            for b in 0..B {
                schur[q][b] = away[b].neg_mul_add(lanes, L::of(schur[q][b])).array();
            }
            schur[q][p / 4][p % 4] = part;
        }
        let minus = L::splat(-factor);
        for b in 0..B {
            schur[p][b] = away[b].mul(minus).array();
        }
        schur[p][p / 4][p % 4] = factor;
    }
    for p in (0..n).filter(|&p| is_left_out[p]) {
        schur[p] = [[0.0; 4]; B];
        for column in schur.iter_mut() {
            column[p / 4][p % 4] = 0.0;
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::lanes::Portable;

    /// A positive definite matrix of five rows, and its product with a vector.
    fn system() -> (Vec<Row<2>>, Row<2>, Vec<f64>) {
        let entry = |i: usize, j: usize| if i == j { 4.0 + i as f64 } else { 1.0 / (1 + i + j) as f64 };
        let x: Vec<f64> = (0..5).map(|i| i as f64 - 1.5).collect();
        let (mut schur, mut right) = (vec![[[0.0; 4]; 2]; 5], [[0.0; 4]; 2]);
        for i in 0..5 {
            for j in 0..5 {
                schur[j][i / 4][i % 4] = entry(i, j);
                right[i / 4][i % 4] += entry(i, j) * x[j];
            }
        }
        (schur, right, x)
    }

    #[test]
    fn solve_and_inverse_agree_with_the_product() {
        let (schur, right, x) = system();
        let (mut matrix, mut found) = (schur.clone(), right);
        let least = solve::<Portable, 2>(&mut matrix, &[4.0; 5], &mut found);
        assert!(least > 0.5 && least < 1.1);
        let mut inverse = schur;
        invert::<Portable, 2>(&mut inverse, &[4.0; 5]);
        for i in 0..5 {
            assert!((found[i / 4][i % 4] - x[i]).abs() < 1e-14);
            let product: f64 = (0..5).map(|j| inverse[j][i / 4][i % 4] * right[j / 4][j % 4]).sum();
            assert!((product - x[i]).abs() < 1e-14);
        }
    }

    #[test]
    fn a_body_without_a_pivot_is_left_out() {
        let (mut schur, mut right, _) = system();
        for i in 0..5 {
            schur[2][i / 4][i % 4] = 0.0;
            schur[i][0][2] = 0.0;
        }
        let mut inverse = schur.clone();
        let least = solve::<Portable, 2>(&mut schur, &[4.0; 5], &mut right);
        assert_eq!((right[0][2], least), (0.0, 0.0));
        invert::<Portable, 2>(&mut inverse, &[4.0; 5]);
        assert!(inverse[2].iter().flatten().all(|x| *x == 0.0) && inverse[0][0][0] != 0.0);
    }
}
