//! Factors of small dense matrices, real or complex, for the Newton iterations of implicit methods; nothing
//! is allocated after the first of a size.
//!
//! ```text
//! P A = L U,   rows exchanged so that |l| <= 1
//! ```
//!
//! Source: G. H. Golub, C. F. Van Loan, *Matrix Computations*, 4th ed. (2013), section 3.4.

use crate::arithmetic::{Complex, Scalar};
use std::ops::{Mul, Sub};

/// An entry of a matrix.
pub trait MatrixEntry: Copy + Mul<Output = Self> + Sub<Output = Self> {
    /// Zero.
    const ZERO: Self;

    /// A plain number.
    fn of(value: f64) -> Self;

    /// What pivots are chosen by.
    fn size(self) -> f64;

    /// One over it.
    fn reciprocal(self) -> Self;

    /// Product with a plain number.
    fn times(self, factor: f64) -> Self;
}

impl MatrixEntry for f64 {
    const ZERO: Self = 0.0;

    fn of(value: f64) -> Self {
        value
    }

    fn size(self) -> f64 {
        self.abs()
    }

    fn reciprocal(self) -> Self {
        1.0 / self
    }

    fn times(self, factor: f64) -> Self {
        self * factor
    }
}

impl MatrixEntry for Complex<f64> {
    const ZERO: Self = Complex { re: 0.0, im: 0.0 };

    fn of(value: f64) -> Self {
        Complex { re: value, im: 0.0 }
    }

    fn size(self) -> f64 {
        self.re.abs() + self.im.abs()
    }

    fn reciprocal(self) -> Self {
        // By the larger part, so that no square overflows (R. L. Smith, CACM 5 (1962)).
        if self.re.abs() >= self.im.abs() {
            let share = self.im / self.re;
            let whole = 1.0 / (self.re + self.im * share);
            Complex { re: whole, im: -share * whole }
        } else {
            let share = self.re / self.im;
            let whole = 1.0 / (self.re * share + self.im);
            Complex { re: share * whole, im: -whole }
        }
    }

    fn times(self, factor: f64) -> Self {
        Complex { re: self.re.scale(factor), im: self.im.scale(factor) }
    }
}

/// L and U of one matrix (d × d).
#[derive(Clone, Debug, Default)]
pub struct LuFactors<T> {
    entries: Vec<T>,
    /// The reciprocals of U's diagonal (d).
    pivot: Vec<T>,
    /// The row each step took its pivot from (d).
    exchange: Vec<usize>,
}

impl<T: MatrixEntry> LuFactors<T> {
    /// The factors of 1 - factor · matrix, row by row; what is singular solves to what is not finite.
    pub fn of_shifted(&mut self, factor: T, matrix: &[f64], dimension: usize) {
        let d = dimension;
        self.entries.clear();
        self.entries.extend(matrix.iter().map(|&entry| T::ZERO - factor.times(entry)));
        for k in 0..d {
            self.entries[k * d + k] = T::of(1.0) - factor.times(matrix[k * d + k]);
        }
        self.pivot.resize(d, T::ZERO);
        self.exchange.resize(d, 0);
        for k in 0..d {
            let mut best = k;
            for i in k + 1..d {
                if self.entries[i * d + k].size() > self.entries[best * d + k].size() {
                    best = i;
                }
            }
            self.exchange[k] = best;
            if best != k {
                for j in 0..d {
                    self.entries.swap(k * d + j, best * d + j);
                }
            }
            self.pivot[k] = self.entries[k * d + k].reciprocal();
            let (above, below) = self.entries.split_at_mut((k + 1) * d);
            let upper = &above[k * d..];
            for row in below.chunks_exact_mut(d) {
                let l = row[k] * self.pivot[k];
                row[k] = l;
                for j in k + 1..d {
                    row[j] = row[j] - l * upper[j];
                }
            }
        }
    }

    /// Solves in place.
    pub fn solve(&self, x: &mut [T]) {
        let d = x.len();
        for k in 0..d {
            x.swap(k, self.exchange[k]);
        }
        substitute(d, &self.entries, &self.pivot, x);
    }
}

impl LuFactors<f64> {
    /// Whether the determinant of the matrix is negative.
    pub fn is_negative(&self) -> bool {
        let exchanges = self.exchange.iter().enumerate().filter(|&(k, &row)| k != row).count();
        let negative = self.pivot.iter().filter(|&&pivot| pivot < 0.0).count();
        (exchanges + negative) % 2 == 1
    }
}

/// Solves L U x = load in place, with reciprocal pivots.
#[inline(always)]
pub fn substitute<T: MatrixEntry>(rows: usize, factors: &[T], pivot: &[T], load: &mut [T]) {
    let (factors, pivot, load) = (&factors[..rows * rows], &pivot[..rows], &mut load[..rows]);
    for i in 1..rows {
        for k in 0..i {
            load[i] = load[i] - factors[i * rows + k] * load[k];
        }
    }
    for i in (0..rows).rev() {
        for k in i + 1..rows {
            load[i] = load[i] - factors[i * rows + k] * load[k];
        }
        load[i] = load[i] * pivot[i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factors_solve_what_the_product_makes() {
        // Without an exchange of rows the first pivot would be zero.
        let matrix = [1.0, 2.0, -1.0, 3.0, 0.5, 4.0, -2.0, 1.0, 7.0];
        let x = [1.0, -2.0, 0.5].map(|re| Complex { re, im: 0.25 * re + 1.0 });
        for factor in
            [Complex { re: 1.0, im: 0.0 }, Complex { re: 0.3, im: -0.8 }, Complex { re: 1e9, im: 2e9 }]
        {
            let mut product: Vec<_> = (0..3)
                .map(|i| (0..3).fold(x[i], |sum, j| sum - factor.times(matrix[3 * i + j]) * x[j]))
                .collect();
            let mut factors = LuFactors::default();
            factors.of_shifted(factor, &matrix, 3);
            factors.solve(&mut product);
            for (found, expected) in product.iter().zip(x) {
                assert!((*found - expected).size() < 1e-13, "{found:?} {expected:?}");
            }
        }
        let mut factors = LuFactors::default();
        factors.of_shifted(1.0, &matrix, 3);
        let mut product: Vec<f64> =
            (0..3).map(|i| (0..3).fold(x[i].re, |sum, j| sum - matrix[3 * i + j] * x[j].re)).collect();
        factors.solve(&mut product);
        assert!(product.iter().zip(x).all(|(found, expected)| (found - expected.re).abs() < 1e-14));
    }
}
