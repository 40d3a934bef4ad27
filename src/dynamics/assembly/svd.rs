//! Singular values of small dense matrices, by rotating pairs of columns until all are orthogonal.
//!
//! Square roots are the only functions it asks for, so that its bits are the same on every machine.  Source:
//! M. R. Hestenes, J. SIAM 6 (1958); J. Demmel, K. Veselić, SIAM J. Matrix Anal. Appl. 13 (1992), on its
//! accuracy.

/// A matrix row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RowMatrix {
    pub rows: usize,
    pub columns: usize,
    /// rows × columns.
    pub entries: Vec<f64>,
}

/// A = Σ σ u vᵀ, without the zero ones.
#[derive(Clone, Debug)]
pub struct Svd {
    /// σ, u (one a row of A), v (one a column of A).
    triples: Vec<(f64, Vec<f64>, Vec<f64>)>,
}

/// Sweeps over all pairs; eight are enough in practice.
const SWEEPS: usize = 40;

impl RowMatrix {
    /// All zero.
    pub fn zero(rows: usize, columns: usize) -> Self {
        Self { rows, columns, entries: vec![0.0; rows * columns] }
    }

    /// A row.
    pub fn row(&self, row: usize) -> &[f64] {
        &self.entries[row * self.columns..][..self.columns]
    }

    /// A row, to write.
    pub fn row_mut(&mut self, row: usize) -> &mut [f64] {
        &mut self.entries[row * self.columns..][..self.columns]
    }

    /// Its singular values and vectors.
    pub fn svd(&self) -> Svd {
        let (upright, mut long) = self.long();
        let few = long.len();
        let mut short: Vec<Vec<f64>> =
            (0..few).map(|i| (0..few).map(|k| if i == k { 1.0 } else { 0.0 }).collect()).collect();
        orthogonalise(&mut long, dot, |i, j, cos, sin| rotate(&mut short, i, j, cos, sin));
        let triples = (long.into_iter().zip(short))
            .filter_map(|(mut long, short)| {
                let sigma = dot(&long, &long).sqrt();
                if sigma == 0.0 {
                    return None;
                }
                long.iter_mut().for_each(|x| *x /= sigma);
                Some(if upright { (sigma, long, short) } else { (sigma, short, long) })
            })
            .collect();
        Svd { triples }
    }

    /// Its singular values alone, those that are not exactly zero, in no order: for a third of the time, and
    /// in other last digits.
    pub fn values(&self) -> Vec<f64> {
        let (_, mut long) = self.long();
        orthogonalise(&mut long, fast_dot, |_, _, _, _| {});
        long.iter().map(|long| fast_dot(long, long).sqrt()).filter(|&sigma| sigma != 0.0).collect()
    }

    /// The vectors along the longer side, which are to be rotated until they are orthogonal, and whether
    /// these are the columns.
    fn long(&self) -> (bool, Vec<Vec<f64>>) {
        let upright = self.columns <= self.rows;
        let (few, many) = if upright { (self.columns, self.rows) } else { (self.rows, self.columns) };
        let entry = |i: usize, k: usize| {
            self.entries[if upright { k * self.columns + i } else { i * self.columns + k }]
        };
        (upright, (0..few).map(|i| (0..many).map(|k| entry(i, k)).collect()).collect())
    }

    /// True where a column is that of another matrix, to rounding.
    pub fn has_same_column(&self, other: &Self, column: usize) -> bool {
        (0..self.rows).all(|i| {
            let [here, there] = [self, other].map(|matrix| matrix.row(i)[column]);
            (here - there).abs() <= 1e-12 * here.abs()
        })
    }
}

/// Rotates pairs of vectors until all are orthogonal, and tells every rotation.
fn orthogonalise(
    long: &mut [Vec<f64>],
    dot: fn(&[f64], &[f64]) -> f64,
    mut each: impl FnMut(usize, usize, f64, f64),
) {
    let few = long.len();
    let mut squares: Vec<f64> = long.iter().map(|long| dot(long, long)).collect();
    for _ in 0..SWEEPS {
        let mut rotated = false;
        for i in 0..few {
            for j in i + 1..few {
                let (a, b, c) = (squares[i], squares[j], dot(&long[i], &long[j]));
                if c == 0.0 || c.abs() <= 1e-16 * (a * b).sqrt() {
                    continue;
                }
                rotated = true;
                let zeta = (b - a) / (2.0 * c);
                let t = zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
                let cos = 1.0 / (1.0 + t * t).sqrt();
                rotate(long, i, j, cos, cos * t);
                each(i, j, cos, cos * t);
                (squares[i], squares[j]) = (dot(&long[i], &long[i]), dot(&long[j], &long[j]));
            }
        }
        if !rotated {
            break;
        }
    }
}

/// The shortest x for which A x is nearest to b.
#[derive(Clone, Debug)]
pub enum Solver<'a> {
    /// By singular values, those below a share of the largest counting as zero; and the number of columns.
    Small(Svd, usize, f64),
    /// By the factors of A Aᵀ or Aᵀ A with a little on the diagonal: steps that are repeated.
    Large(&'a RowMatrix, RowMatrix),
}

/// The longest shorter side that is taken apart.
const SMALL: usize = 100;

impl RowMatrix {
    /// Prepares solutions.
    pub fn solver(&self, share: f64) -> Solver<'_> {
        if self.rows.min(self.columns) <= SMALL {
            Solver::Small(self.svd(), self.columns, share)
        } else {
            self.squared()
        }
    }

    fn squared(&self) -> Solver<'_> {
        let few = self.rows.min(self.columns);
        let is_wide = self.rows <= self.columns;
        let mut square = RowMatrix::zero(few, few);
        if is_wide {
            for i in 0..few {
                for j in 0..=i {
                    square.entries[i * few + j] = dot(self.row(i), self.row(j));
                }
            }
        } else {
            for row in self.entries.chunks_exact(self.columns) {
                for (i, a) in row.iter().enumerate().filter(|(_, a)| **a != 0.0) {
                    square.row_mut(i)[..=i].iter_mut().zip(row).for_each(|(sum, b)| *sum += a * b);
                }
            }
        }
        let most = (0..few).fold(0.0, |most: f64, i| most.max(square.entries[i * few + i]));
        // Cholesky's factor, row by row.
        for i in 0..few {
            for j in 0..=i {
                let sum = square.entries[i * few + j] - dot(&square.row(i)[..j], &square.row(j)[..j]);
                square.entries[i * few + j] = if i == j {
                    (sum + 1e-14 * most).max(1e-14 * most).sqrt()
                } else {
                    sum / square.entries[j * few + j]
                };
            }
        }
        Solver::Large(self, square)
    }
}

impl Solver<'_> {
    /// Solves.
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        let (matrix, factor) = match self {
            Self::Small(svd, columns, share) => return svd.solve(b, *columns, *share),
            Self::Large(matrix, factor) => (matrix, factor),
        };
        let transposed = |b: &[f64]| {
            let mut x = vec![0.0; matrix.columns];
            for (i, b) in b.iter().enumerate() {
                x.iter_mut().zip(matrix.row(i)).for_each(|(x, a)| *x += a * b);
            }
            x
        };
        let is_wide = matrix.rows <= matrix.columns;
        let mut y = if is_wide { b.to_vec() } else { transposed(b) };
        let few = factor.rows;
        for i in 0..few {
            y[i] = (y[i] - dot(&factor.row(i)[..i], &y[..i])) / factor.row(i)[i];
        }
        for i in (0..few).rev() {
            y[i] /= factor.row(i)[i];
            let (before, here) = y.split_at_mut(i);
            before.iter_mut().zip(factor.row(i)).for_each(|(y, l)| *y -= l * here[0]);
        }
        if is_wide { transposed(&y) } else { y }
    }
}

impl Svd {
    /// The largest singular value.
    fn largest(&self) -> f64 {
        self.triples.iter().fold(0.0, |most, triple| triple.0.max(most))
    }

    /// The left vectors of the largest singular values: `least` of them, and all above a share of the first.
    pub fn left(mut self, least: usize, share: f64) -> Vec<Vec<f64>> {
        self.triples.sort_by(|a, b| b.0.total_cmp(&a.0));
        let zero = share * self.largest();
        let counts = |(k, triple): &(usize, (f64, Vec<f64>, Vec<f64>))| *k < least || triple.0 > zero;
        self.triples.into_iter().enumerate().take_while(counts).map(|(_, (_, u, _))| u).collect()
    }

    /// The shortest x for which A x is nearest to `b`; singular values below `share` of the largest count as
    /// zero.
    pub fn solve(&self, b: &[f64], columns: usize, share: f64) -> Vec<f64> {
        let least = share * self.largest();
        let mut x = vec![0.0; columns];
        for (sigma, u, v) in self.triples.iter().filter(|triple| triple.0 > least) {
            let part = dot(u, b) / sigma;
            x.iter_mut().zip(v).for_each(|(x, v)| *x += part * v);
        }
        x
    }

    /// How much of each column's direction the rows leave open: 0 where they fix it, 1 where they do not
    /// touch it; singular values below `least` count as zero.
    pub fn open(&self, columns: usize, least: f64) -> Vec<f64> {
        let mut open = vec![1.0; columns];
        for (_, _, v) in self.triples.iter().filter(|triple| triple.0 > least) {
            open.iter_mut().zip(v).for_each(|(open, v)| *open -= v * v);
        }
        open
    }

    /// Of these columns as many as must be fixed for the rows to leave none of them open by more than `most`,
    /// each time the one that is most open: pivots of Cholesky's factor of the projector 1 - Σ v vᵀ onto
    /// the open directions.  Singular values below `least` count as zero.
    pub fn to_fix(&self, columns: usize, least: f64, among: &[usize], most: f64) -> Vec<usize> {
        let mut open = self.open(columns, least);
        // Unit vectors of what is fixed by the rows, and then by the columns found.
        let mut fixed: Vec<Vec<f64>> =
            self.triples.iter().filter(|triple| triple.0 > least).map(|triple| triple.2.clone()).collect();
        let mut found = Vec::new();
        for _ in among {
            let next = among.iter().copied().max_by(|&a, &b| open[a].total_cmp(&open[b]));
            let Some(k) = next.filter(|&k| open[k] > most) else { break };
            let mut unit = vec![0.0; columns];
            unit[k] = 1.0;
            for known in fixed.iter().filter(|known| known[k] != 0.0) {
                let share = known[k];
                unit.iter_mut().zip(known).for_each(|(x, known)| *x -= share * known);
            }
            let length = open[k].sqrt();
            unit.iter_mut().for_each(|x| *x /= length);
            open.iter_mut().zip(&unit).for_each(|(open, x)| *open -= x * x);
            fixed.push(unit);
            found.push(k);
        }
        found
    }
}

/// Which of the rows, from the first on, are no combination of those before; what is left of a row counts as
/// zero below `least`.
pub fn independent(matrix: &RowMatrix, least: f64) -> Vec<bool> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    (0..matrix.rows)
        .map(|row| {
            let mut rest = matrix.row(row).to_vec();
            // Twice is enough.
            for _ in 0..2 {
                for unit in &basis {
                    let share = dot(unit, &rest);
                    rest.iter_mut().zip(unit).for_each(|(x, unit)| *x -= share * unit);
                }
            }
            let length = dot(&rest, &rest).sqrt();
            let is_new = length > least;
            if is_new {
                rest.iter_mut().for_each(|x| *x /= length);
                basis.push(rest);
            }
            is_new
        })
        .collect()
}

pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The same in four sums, for which nothing waits.
fn fast_dot(a: &[f64], b: &[f64]) -> f64 {
    let (fours, others) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest = dot(fours.remainder(), others.remainder());
    let mut sums = [0.0; 4];
    for (a, b) in fours.zip(others) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

fn rotate(vectors: &mut [Vec<f64>], i: usize, j: usize, cos: f64, sin: f64) {
    let (head, tail) = vectors.split_at_mut(j);
    for (a, b) in head[i].iter_mut().zip(&mut tail[0]) {
        (*a, *b) = (cos * *a - sin * *b, sin * *a + cos * *b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Entries without a pattern.
    fn matrix(rows: usize, columns: usize) -> RowMatrix {
        let entries = (0..rows * columns).map(|k| libm::sin(1.0 + (k * k) as f64)).collect();
        RowMatrix { rows, columns, entries }
    }

    #[test]
    fn the_product_is_the_matrix_and_the_solution_is_the_shortest() {
        for (rows, columns) in [(4, 4), (3, 7), (7, 3), (1, 5), (5, 1)] {
            let a = matrix(rows, columns);
            let svd = a.svd();
            for i in 0..rows {
                for k in 0..columns {
                    let product: f64 = svd.triples.iter().map(|(sigma, u, v)| sigma * u[i] * v[k]).sum();
                    assert!((product - a.row(i)[k]).abs() < 1e-14);
                }
            }
            let b: Vec<f64> = (0..rows).map(|i| i as f64 + 0.5).collect();
            let x = svd.solve(&b, columns, 1e-12);
            let left: Vec<f64> = (0..rows).map(|i| dot(a.row(i), &x) - b[i]).collect();
            for k in 0..columns {
                let normal: f64 = (0..rows).map(|i| a.row(i)[k] * left[i]).sum();
                assert!(normal.abs() < 1e-12, "what is left is orthogonal to every column");
            }
            // The shortest has no part that the rows do not see.
            let along: f64 = svd.triples.iter().map(|(_, _, v)| dot(v, &x).powi(2)).sum();
            assert!((along - dot(&x, &x)).abs() < 1e-12 * dot(&x, &x));
        }
    }

    #[test]
    fn many_rows_and_columns_are_solved_by_their_squares() {
        for (rows, columns) in [(9, 14), (14, 9)] {
            let a = matrix(rows, columns);
            let b: Vec<f64> = (0..rows).map(|i| libm::cos(i as f64)).collect();
            let (small, solver) = (a.svd().solve(&b, columns, 1e-12), a.squared());
            let most = small.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            for (large, small) in solver.solve(&b).iter().zip(&small) {
                assert!((large - small).abs() < 1e-6 * most, "{large} {small}");
            }
        }
    }

    #[test]
    fn values_alone_are_those_of_the_vectors() {
        for (rows, columns) in [(4, 4), (3, 9), (7, 3), (1, 5)] {
            let a = matrix(rows, columns);
            let (mut alone, mut whole) =
                (a.values(), a.svd().triples.iter().map(|triple| triple.0).collect::<Vec<_>>());
            alone.sort_by(f64::total_cmp);
            whole.sort_by(f64::total_cmp);
            assert_eq!(alone.len(), rows.min(columns));
            assert!(
                alone.iter().zip(&whole).all(|(a, b)| (a - b).abs() < 1e-14 * b.max(1.0)),
                "{alone:?} {whole:?}"
            );
        }
    }

    #[test]
    fn dependent_rows_and_open_columns_are_found() {
        let mut a = matrix(3, 5);
        for k in 0..4 {
            a.row_mut(2)[k] = 2.0 * a.row(0)[k] - a.row(1)[k];
        }
        (0..3).for_each(|row| a.row_mut(row)[4] = 0.0);
        assert_eq!(independent(&a, 1e-9), [true, true, false]);
        let open = a.svd().open(5, 1e-9);
        assert_eq!(open[4], 1.0);
        assert!((open.iter().sum::<f64>() - 3.0).abs() < 1e-14, "5 columns less rank 2: {open:?}");
        // Each column asked for is the most open one beside the rows and those before.
        let fixed = a.svd().to_fix(5, 1e-9, &[0, 1, 2, 3, 4], 1e-6);
        assert_eq!((fixed.len(), fixed[0]), (3, 4), "{fixed:?}");
        for &k in &fixed {
            let open = a.svd().open(5, 1e-9);
            assert!(open.iter().all(|other| *other <= open[k] + 1e-13), "{open:?} {k}");
            a.entries.extend((0..5).map(|j| f64::from(u8::from(j == k))));
            a.rows += 1;
        }
        assert!(a.svd().open(5, 1e-9).iter().all(|open| open.abs() < 1e-13));
    }
}
