//! Symmetric matrices whose rows begin late: L D Lᵀ inside the envelope, where there is no fill-in beyond it.
//!
//! ```text
//! row i holds columns first_i … i:   g_ij = a_ij - Σ_k g_ik l_jk,   l_ij = g_ij / d_j,
//!     d_i = a_ii - Σ_j g_ij l_ij
//! ```
//!
//! Source: A. Jennings, *A compact storage scheme for the solution of symmetric linear simultaneous
//! equations*, Comput. J. 9 (1966); the order of the rows: E. Cuthill, J. McKee, *Reducing the bandwidth of
//! sparse symmetric matrices*, Proc. 24th ACM Conf. (1969), reversed after A. George.

use super::schur::Weakest;
use crate::arithmetic::{Real, Scalar};

/// The shape of a symmetric matrix below and on its diagonal.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Envelope {
    /// First column of each row, and where in memory it is.
    rows: Vec<(usize, usize)>,
    entries: usize,
}

impl Envelope {
    /// A matrix whose rows begin at these columns, none beyond the diagonal.
    pub fn new(first: &[usize]) -> Self {
        let (mut rows, mut entries) = (Vec::with_capacity(first.len()), 0);
        for (i, &first) in first.iter().enumerate() {
            rows.push((first, entries));
            entries += i + 1 - first;
        }
        Self { rows, entries }
    }

    /// Numbers in memory.
    pub fn entries(&self) -> usize {
        self.entries
    }

    /// Multiplications of a factorization.
    pub fn cost(&self) -> usize {
        let overlap = |i: usize, j: usize| j - self.rows[i].0.max(self.rows[j].0).min(j);
        (0..self.rows.len()).map(|i| (self.rows[i].0..i).map(|j| overlap(i, j) + 2).sum::<usize>()).sum()
    }

    /// The first column of row `i`, and where the row is.
    #[inline(always)]
    fn row(&self, i: usize) -> (usize, std::ops::Range<usize>) {
        let (first, at) = self.rows[i];
        (first, at..at + i + 1 - first)
    }

    /// Adds to entry (i, j), j <= i, which must lie inside.
    #[inline(always)]
    pub fn add<T: Scalar>(&self, matrix: &mut [T], i: usize, j: usize, value: T) {
        let (first, at) = self.rows[i];
        matrix[at + j - first] += value;
    }

    /// Both halves of a symmetric matrix, row by row.
    pub fn full<T: Scalar>(&self, matrix: &[T]) -> Vec<T> {
        let n = self.rows.len();
        let mut full = vec![T::ZERO; n * n];
        for i in 0..n {
            let (first, here) = self.row(i);
            for (j, &entry) in (first..=i).zip(&matrix[here]) {
                (full[i * n + j], full[j * n + i]) = (entry, entry);
            }
        }
        full
    }

    /// Replaces a matrix by its factors, and writes the reciprocal pivots: zero for rows left out, whose
    /// pivot is less than a share [`DROPPED`](super::schur::DROPPED) of their scale.  Tells the row whose
    /// pivot is the smallest share.
    #[inline]
    pub fn factor<T: Real>(&self, matrix: &mut [T], pivot: &mut [T], scale: &[f64]) -> Weakest {
        let mut weakest = Weakest::NONE;
        self.factor_by(matrix, pivot, |i, diagonal| weakest.reciprocal(i, diagonal, scale[i]));
        weakest
    }

    /// The same, `reciprocal` telling the reciprocal of a row's pivot, or zero where the row is left out.
    #[inline]
    pub fn factor_by<T: Real>(
        &self,
        matrix: &mut [T],
        pivot: &mut [T],
        mut reciprocal: impl FnMut(usize, T) -> T,
    ) {
        for i in 0..self.rows.len() {
            let (first, here) = self.row(i);
            let (done, row) = matrix.split_at_mut(here.start);
            let row = &mut row[..here.len()];
            for j in first..i {
                let (other_first, other) = self.row(j);
                let other = &done[other];
                let from = first.max(other_first);
                let (g, l) = (&row[from - first..j - first], &other[from - other_first..j - other_first]);
                let sum = g.iter().zip(l).fold(row[j - first], |sum, (&g, &l)| sum - g * l);
                row[j - first] = sum;
            }
            let mut diagonal = row[i - first];
            for j in first..i {
                let g = row[j - first];
                let l = g * pivot[j];
                diagonal -= g * l;
                row[j - first] = l;
            }
            pivot[i] = reciprocal(i, diagonal);
        }
    }

    /// Solves in place with the factors.
    #[inline]
    pub fn solve<T: Scalar>(&self, factors: &[T], pivot: &[T], x: &mut [T]) {
        for i in 0..self.rows.len() {
            let (first, here) = self.row(i);
            x[i] = factors[here].iter().zip(&x[first..i]).fold(x[i], |sum, (&l, &x)| sum - l * x);
        }
        for (x, &pivot) in x.iter_mut().zip(pivot) {
            *x = *x * pivot;
        }
        for i in (0..self.rows.len()).rev() {
            let (first, here) = self.row(i);
            let last = x[i];
            for (x, &l) in x[first..i].iter_mut().zip(&factors[here]) {
                *x -= l * last;
            }
        }
    }
}

/// An order of rows that keeps the envelope small, where rows are coupled that share one of their groups: for
/// each row its place.
pub fn compact_order(groups: &[Vec<usize>]) -> Vec<usize> {
    let count = groups.iter().flatten().max().map_or(0, |&most| most + 1);
    let mut members = vec![Vec::new(); count];
    for (row, groups) in groups.iter().enumerate() {
        for &group in groups {
            members[group].push(row);
        }
    }
    let degree: Vec<usize> =
        groups.iter().map(|groups| groups.iter().map(|&group| members[group].len()).sum()).collect();
    let mut starts: Vec<usize> = (0..groups.len()).collect();
    starts.sort_by_key(|&row| degree[row]);
    let (mut order, mut seen) = (Vec::with_capacity(groups.len()), vec![false; groups.len()]);
    for start in starts {
        if seen[start] {
            continue;
        }
        seen[start] = true;
        let mut next = order.len();
        order.push(start);
        while next < order.len() {
            let begin = order.len();
            for &group in &groups[order[next]] {
                // A group is gone through once.
                for row in std::mem::take(&mut members[group]) {
                    if !std::mem::replace(&mut seen[row], true) {
                        order.push(row);
                    }
                }
            }
            order[begin..].sort_by_key(|&row| degree[row]);
            next += 1;
        }
    }
    let mut place = vec![0; groups.len()];
    for (at, &row) in order.iter().rev().enumerate() {
        place[row] = at;
    }
    place
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factors_solve_what_the_product_makes() {
        // Rows that begin at 0, 0, 2, 1, 0.
        let first = [0, 0, 2, 1, 0];
        let envelope = Envelope::new(&first);
        let entry = |i: usize, j: usize| {
            let (i, j) = (i.max(j), i.min(j));
            match i == j {
                true => 9.0 + i as f64,
                false if j >= first[i] => 1.0 / (1.0 + i as f64 + 2.0 * j as f64),
                false => 0.0,
            }
        };
        let mut matrix = vec![0.0; envelope.entries()];
        for i in 0..5 {
            for j in first[i]..=i {
                envelope.add(&mut matrix, i, j, entry(i, j));
            }
        }
        let x = [1.0, -2.0, 0.5, 3.0, -0.25];
        let mut right: Vec<f64> = (0..5).map(|i| (0..5).map(|j| entry(i, j) * x[j]).sum()).collect();
        let mut pivot = [0.0; 5];
        envelope.factor(&mut matrix, &mut pivot, &[1.0; 5]);
        envelope.solve(&matrix, &pivot, &mut right);
        for i in 0..5 {
            assert!((right[i] - x[i]).abs() < 1e-15, "{right:?}");
        }
        assert_eq!(envelope.entries(), 1 + 2 + 1 + 3 + 5);
    }

    #[test]
    fn a_row_that_depends_on_others_gets_no_multiplier() {
        // The third row is the sum of the first two.
        let envelope = Envelope::new(&[0; 3]);
        let (full, mut pivot) = ([2.0, 0.5, 3.0, 2.5, 3.5, 6.0], [0.0; 3]);
        let mut factors = full;
        let weakest = envelope.factor(&mut factors, &mut pivot, &[2.0, 3.0, 6.0]);
        assert!(weakest.share.abs() < 1e-15 && weakest.row == 2);
        // S times (1, -2, 0).
        let mut found = [1.0, -5.5, -4.5];
        envelope.solve(&factors, &pivot, &mut found);
        assert!((found[0] - 1.0).abs() + (found[1] + 2.0).abs() < 1e-14 && found[2] == 0.0, "{found:?}");
    }

    /// Rows along a line, two a joint, given out of order.
    #[test]
    fn the_order_follows_a_line() {
        let joints = 40;
        let shuffled = |k: usize| (k * 27) % (2 * joints);
        let groups: Vec<Vec<usize>> =
            (0..2 * joints).map(|k| vec![shuffled(k) / 2, shuffled(k) / 2 + 1]).collect();
        let place = compact_order(&groups);
        let mut seen = place.clone();
        seen.sort_unstable();
        assert!(seen.iter().copied().eq(0..2 * joints));
        for (a, first) in groups.iter().enumerate() {
            for (b, second) in groups.iter().enumerate() {
                if first.iter().any(|group| second.contains(group)) {
                    assert!(place[a].abs_diff(place[b]) <= 3);
                }
            }
        }
    }
}
