//! The way back of a few bodies onto all their rows, in natural coordinates and in lanes.
//!
//! ```text
//! linear rows:   x -= R (C x + c),   v -= R C v                             constant, once for all
//! unit lengths:  x -= V S⁻¹ (|z|² - 1)/2,   v -= V S⁻¹ z·v
//!     V_j = W_·j z_j,  S_kj = z_k·V_kj,  which leaves the linear rows kept
//! ```
//!
//! The shortest way in the metric of the mass matrix, as that of the angle form to first order; with one set
//! of factors for both levels.

use super::columns::{self, LaneColumns};
use super::reduced::{self, ReducedMatrices};
use crate::arithmetic::Complex;
use crate::arithmetic::lanes::Lanes;
use crate::arithmetic::lanes::row::{Row, at, load, store};

/// Sweeps onto the unit lengths, at most.
const SWEEPS: usize = 6;
/// Violation of the lengths that one iteration is enough for.
pub const CLOSE: f64 = 1e-9;

/// Constants of the mechanism, and its matrices at a configuration; lanes beyond the last body are zero.
#[derive(Clone, Debug)]
pub struct LaneProjection<const B: usize> {
    /// W.
    pub columns: LaneColumns<B>,
    /// The linear rows.
    rows: Vec<LinearTerms<B>>,
    /// S, then S⁻¹, column by column.
    pub schur: Vec<Row<B>>,
    /// V: x and y, column by column.
    pub minv_jt: Vec<[Row<B>; 2]>,
}

/// Elements and gradients of a row, its constant, and its column of R.
#[derive(Clone, Debug)]
struct LinearTerms<const B: usize> {
    terms: Vec<(usize, Complex<f64>)>,
    constant: f64,
    back: [Row<B>; 2],
}

/// What putting back came to.
#[derive(Clone, Copy, Debug)]
pub struct Moved<const B: usize> {
    /// What was taken off the elements, x and y.
    pub change: [Row<B>; 2],
    /// The least share of a pivot of S.
    pub least: f64,
    /// The violations of the lengths that were found last, added up; what is left is about their square.
    pub left: f64,
}

impl<const B: usize> LaneProjection<B> {
    /// Of a mechanism's matrices; there must be room, and no translational coordinates.
    pub fn new(reduced: &ReducedMatrices) -> Self {
        let n = reduced.free.len();
        let zero = [[0.0; 4]; B];
        let row = |(row, back): (&reduced::LinearRow, &[Complex<f64>])| {
            let mut lanes = [zero; 2];
            for (i, back) in back.iter().enumerate() {
                (lanes[0][i / 4][i % 4], lanes[1][i / 4][i % 4]) = (back.re, back.im);
            }
            LinearTerms { terms: row.place.linear.clone(), constant: row.place.constant, back: lanes }
        };
        Self {
            columns: LaneColumns::new(reduced),
            rows: reduced.rows.iter().zip(reduced.back.chunks(n.max(1))).map(row).collect(),
            schur: vec![zero; n],
            minv_jt: vec![[zero; 2]; n],
        }
    }

    /// V and S⁻¹ at unit vectors; the least share of a pivot.
    #[inline(always)]
    pub fn unit_vectors<L: Lanes>(&mut self, z: &[Row<B>; 2]) -> f64 {
        let (c, s): ([L; B], [L; B]) = (load(&z[0]), load(&z[1]));
        for (j, block) in self.columns.blocks.iter().enumerate() {
            let [x, y] = columns::turned::<L, B>(block, at(&z[0], j), at(&z[1], j));
            for b in 0..B {
                self.schur[j][b] = c[b].mul_add(x[b], s[b].mul(y[b])).array();
            }
            self.minv_jt[j] = [store(x), store(y)];
        }
        columns::invert::<L, B>(&mut self.schur, &self.columns.scale)
    }

    /// Elements onto the linear rows, then onto the unit lengths, with the S of the position at hand: one
    /// iteration, unless they were far off.
    #[inline(always)]
    pub fn project_back<L: Lanes>(&mut self, z: &mut [Row<B>; 2]) -> Moved<B> {
        let mut moved = self.onto_rows::<L>(z, |row| row.constant);
        subtract::<L, B>(z, &moved);
        let (mut least, mut left) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..SWEEPS {
            least = self.unit_vectors::<L>(z);
            let mut far = [L::ZERO; B];
            for b in 0..B {
                let (x, y) = (L::of(z[0][b]), L::of(z[1][b]));
                far[b] = x.mul_add(x, y.mul(y)).sub(L::ONE).mul(L::splat(0.5));
            }
            let far = store(far);
            let change = self.onto_lengths::<L>(&far);
            subtract::<L, B>(z, &change);
            sum::<L, B>(&mut moved, &change);
            left = far.as_flattened()[..self.schur.len()].iter().map(|far| far.abs()).sum();
            // What a iteration leaves is about the square of what it found.
            if left <= CLOSE {
                break;
            }
        }
        Moved { change: moved.map(store), least, left }
    }

    /// The same of rates, after the elements `z`; what was taken off them.
    #[inline(always)]
    pub fn project_rates_back<L: Lanes>(&self, z: &[Row<B>; 2], v: &mut [Row<B>; 2]) -> [Row<B>; 2] {
        let mut moved = self.onto_rows::<L>(v, |_| 0.0);
        subtract::<L, B>(v, &moved);
        let mut fast = [L::ZERO; B];
        for b in 0..B {
            fast[b] = L::of(z[0][b]).mul_add(L::of(v[0][b]), L::of(z[1][b]).mul(L::of(v[1][b])));
        }
        let change = self.onto_lengths::<L>(&store(fast));
        subtract::<L, B>(v, &change);
        sum::<L, B>(&mut moved, &change);
        moved.map(store)
    }

    /// R (C x + c).
    #[inline(always)]
    fn onto_rows<L: Lanes>(&self, x: &[Row<B>; 2], constant: impl Fn(&LinearTerms<B>) -> f64) -> [[L; B]; 2] {
        let mut change = [[L::ZERO; B]; 2];
        for row in &self.rows {
            let far = row
                .terms
                .iter()
                .fold(constant(row), |far, &(k, g)| far + (g.re * at(&x[0], k) + g.im * at(&x[1], k)));
            add::<L, B>(&mut change, &row.back, far);
        }
        change
    }

    /// V S⁻¹ violation.
    #[inline(always)]
    fn onto_lengths<L: Lanes>(&self, violation: &Row<B>) -> [[L; B]; 2] {
        let mut factors = [L::ZERO; B];
        for (j, column) in self.schur.iter().enumerate() {
            let violation = L::splat(at(violation, j));
            for b in 0..B {
                factors[b] = L::of(column[b]).mul_add(violation, factors[b]);
            }
        }
        let factors = store(factors);
        let mut change = [[L::ZERO; B]; 2];
        for (j, column) in self.minv_jt.iter().enumerate() {
            add::<L, B>(&mut change, column, at(&factors, j));
        }
        change
    }
}

/// Adds a column times a factor.
#[inline(always)]
fn add<L: Lanes, const B: usize>(change: &mut [[L; B]; 2], column: &[Row<B>; 2], factor: f64) {
    let factor = L::splat(factor);
    for b in 0..B {
        change[0][b] = L::of(column[0][b]).mul_add(factor, change[0][b]);
        change[1][b] = L::of(column[1][b]).mul_add(factor, change[1][b]);
    }
}

#[inline(always)]
fn sum<L: Lanes, const B: usize>(change: &mut [[L; B]; 2], more: &[[L; B]; 2]) {
    for b in 0..B {
        change[0][b] = change[0][b].add(more[0][b]);
        change[1][b] = change[1][b].add(more[1][b]);
    }
}

#[inline(always)]
fn subtract<L: Lanes, const B: usize>(x: &mut [Row<B>; 2], change: &[[L; B]; 2]) {
    for b in 0..B {
        x[0][b] = L::of(x[0][b]).sub(change[0][b]).array();
        x[1][b] = L::of(x[1][b]).sub(change[1][b]).array();
    }
}
