//! The linear solves of RATTLE's iterations.
//!
//! In ordinary positions the Newton matrix is close to S, which is positive definite: it is factored once a
//! substep, without exchanges.  Near a singular position its weak value changes sign across the point, and
//! iterations with a frozen matrix diverge: there the true matrix of every iteration is factored with full
//! pivoting, and rows whose pivot is lost get no change.

use super::super::linear::substitute;
use crate::arithmetic::Complex;
use crate::dynamics::tree::size;

/// Pivot, against the rows' scale, below which the matrix is factored with exchanges.
const WEAK: f64 = 1e-4;
/// Pivot, against the rows' scale, below which a row is lost: it depends on others for ever, or at this
/// position.
const LOST: f64 = 1e-11;

/// A matrix with a row and column per row in the loop, then its factors.
#[derive(Clone, Debug, Default)]
pub struct LoopMatrix {
    /// Entries, row by row (R × R).
    pub entries: Vec<f64>,
    /// Reciprocal pivots (R), zero for rows that are lost.
    pub pivot: Vec<f64>,
    /// 1/√ of what pivots are measured against (R).
    weight: Vec<f64>,
    /// Which row and column each pivot was taken from, where there are exchanges.
    order: Vec<[usize; 2]>,
    is_exchanged: bool,
    scratch: Vec<f64>,
}

impl LoopMatrix {
    /// Room for rows of these scales.
    pub fn resize(&mut self, scales: &[f64]) {
        let rows = scales.len();
        self.entries.resize(rows * rows, 0.0);
        self.order.resize(rows, [0; 2]);
        self.weight.clear();
        self.weight.extend(scales.iter().map(|scale| 1.0 / scale.sqrt()));
        for column in [&mut self.pivot, &mut self.scratch] {
            column.resize(rows, 0.0);
        }
    }

    /// L U in place, without exchanges; false where a pivot is weak, and the entries are spoilt.
    #[inline(always)]
    pub fn factor<const R: usize>(&mut self) -> bool {
        self.is_exchanged = false;
        let rows = size::<R>(self.pivot.len());
        let (matrix, pivot, weight) =
            (&mut self.entries[..rows * rows], &mut self.pivot[..rows], &self.weight[..rows]);
        let mut is_sound = true;
        for k in 0..rows {
            let diagonal = matrix[k * rows + k];
            is_sound &= diagonal.abs() * (weight[k] * weight[k]) > WEAK;
            pivot[k] = 1.0 / diagonal;
            for i in k + 1..rows {
                let l = matrix[i * rows + k] * pivot[k];
                matrix[i * rows + k] = l;
                for j in k + 1..rows {
                    matrix[i * rows + j] -= l * matrix[k * rows + j];
                }
            }
        }
        is_sound
    }

    /// L U in place with full pivoting; what is lost is left out.
    #[cold]
    pub fn factor_exchanged(&mut self) {
        self.is_exchanged = true;
        let rows = self.pivot.len();
        for i in 0..rows {
            for j in 0..rows {
                self.entries[i * rows + j] *= self.weight[i] * self.weight[j];
            }
            self.order[i] = [i, i];
        }
        for k in 0..rows {
            let (mut best, mut largest) = ([k, k], 0.0);
            for i in k..rows {
                for j in k..rows {
                    let size = self.entries[i * rows + j].abs();
                    if size > largest {
                        (best, largest) = ([i, j], size);
                    }
                }
            }
            let [row, column] = best;
            for j in 0..rows {
                self.entries.swap(k * rows + j, row * rows + j);
            }
            for i in 0..rows {
                self.entries.swap(i * rows + k, i * rows + column);
            }
            let (a, b) = (self.order[row][0], self.order[column][1]);
            (self.order[row][0], self.order[column][1]) = (self.order[k][0], self.order[k][1]);
            self.order[k] = [a, b];
            self.pivot[k] = if largest > LOST { 1.0 / self.entries[k * rows + k] } else { 0.0 };
            for i in k + 1..rows {
                let l = self.entries[i * rows + k] * self.pivot[k];
                self.entries[i * rows + k] = l;
                for j in k + 1..rows {
                    self.entries[i * rows + j] -= l * self.entries[k * rows + j];
                }
            }
        }
    }

    /// Solves with the factors, in place.
    #[inline(always)]
    pub fn solve<const R: usize>(&mut self, load: &mut [f64]) {
        if self.is_exchanged {
            return self.solve_exchanged(load);
        }
        let rows = size::<R>(self.pivot.len());
        substitute(rows, &self.entries, &self.pivot, load);
    }

    #[cold]
    fn solve_exchanged(&mut self, load: &mut [f64]) {
        let rows = self.pivot.len();
        let x = &mut self.scratch;
        for (x, &[row, _]) in x.iter_mut().zip(&self.order) {
            *x = load[row] * self.weight[row];
        }
        substitute(rows, &self.entries, &self.pivot, x);
        for (&x, &[_, column]) in x.iter().zip(&self.order) {
            load[column] = x * self.weight[column];
        }
    }
}

/// Gradients of the rows, the bodies' at `here`, against columns, into a matrix.
#[inline(always)]
pub fn project(
    n: usize,
    bodies: usize,
    rows: usize,
    here: &[Complex<f64>],
    gradient: &[Complex<f64>],
    minv_jt: &[Complex<f64>],
    matrix: &mut [f64],
) {
    for p in 0..bodies {
        for q in 0..rows {
            matrix[p * rows + q] = here[p].dot(minv_jt[q * n + p]);
        }
    }
    for p in bodies..rows {
        let gradient = &gradient[(p - bodies) * n..(p - bodies + 1) * n];
        for q in 0..rows {
            matrix[p * rows + q] =
                gradient.iter().zip(&minv_jt[q * n..(q + 1) * n]).map(|(g, minv_jt)| g.dot(*minv_jt)).sum();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(entries: &[f64], rows: usize) -> LoopMatrix {
        let mut matrix = LoopMatrix::default();
        matrix.resize(&vec![4.0; rows]);
        matrix.entries.copy_from_slice(entries);
        matrix
    }

    #[test]
    fn both_ways_solve_the_same_system() {
        let entries = [2.0, 0.5, -0.25, 0.25, 3.0, 1.0, 0.125, -1.0, 4.0];
        let load = [1.0, -2.0, 0.5];
        let (mut plain, mut exchanged) = (matrix(&entries, 3), matrix(&entries, 3));
        assert!(plain.factor::<3>());
        exchanged.factor_exchanged();
        let (mut a, mut b) = (load, load);
        plain.solve::<3>(&mut a);
        exchanged.solve::<0>(&mut b);
        for i in 0..3 {
            assert!((a[i] - b[i]).abs() < 1e-15);
            let product: f64 = (0..3).map(|j| entries[i * 3 + j] * a[j]).sum();
            assert!((product - load[i]).abs() < 1e-15);
        }
    }

    #[test]
    fn a_weak_pivot_is_told_and_exchanges_take_it() {
        let entries = [0.0, 1.0, 1.0, 0.0];
        assert!(!matrix(&entries, 2).factor::<0>());
        let mut exchanged = matrix(&entries, 2);
        exchanged.factor_exchanged();
        let mut load = [3.0, 5.0];
        exchanged.solve::<0>(&mut load);
        assert_eq!(load, [5.0, 3.0]);
    }

    #[test]
    fn a_dependent_row_gets_no_change() {
        // The third is the sum of the first two.
        let entries = [2.0, 0.5, 2.5, 0.5, 3.0, 3.5, 2.5, 3.5, 6.0];
        let mut exchanged = matrix(&entries, 3);
        exchanged.factor_exchanged();
        let mut load = [1.0, -5.5, -4.5];
        exchanged.solve::<0>(&mut load);
        assert_eq!(load.iter().filter(|change| **change == 0.0).count(), 1);
        for (i, expected) in [1.0, -5.5, -4.5].into_iter().enumerate() {
            let product: f64 = (0..3).map(|j| entries[i * 3 + j] * load[j]).sum();
            assert!((product - expected).abs() < 1e-14);
        }
    }
}
