//! Constrained linear systems: `M x = f + Gᵀ λ`, `G x = c`, with M diagonal and any of its entries zero, by
//! elimination with full pivoting.
//!
//! Rows of G that depend on the others are dropped (their λ is 0), and every λ that this leaves open is
//! marked.

use super::double_double::Dd;

/// A row of G: coordinates and entries; a coordinate may come up more than once.
pub type Row = Vec<(usize, Dd)>;

/// Pivot over the largest below which what is left of the scaled matrix counts as zero.
const DEPENDENT: f64 = 1e-26;

/// x and λ.
pub struct Solution {
    pub x: Vec<Dd>,
    pub multipliers: Vec<Dd>,
    /// True for each multiplier that redundant rows leave open.
    pub is_open: Vec<bool>,
    /// Least pivot kept over the largest, of the scaled matrix.
    pub least_pivot: f64,
    /// True where a coordinate without mass is held by nothing: there is no unique x.
    pub is_loose: bool,
}

pub fn row_times(row: &Row, x: &[Dd]) -> Dd {
    row.iter().fold(Dd::ZERO, |sum, &(k, g)| sum + g * x[k])
}

/// Solves the system.
pub fn solve(mass: &[Dd], rows: &[Row], f: &[Dd], c: &[Dd]) -> Solution {
    // Coordinates with mass are eliminated by hand: x = (f + Gᵀ λ) / m.  What is left has one unknown for
    // each coordinate without mass and each λ.
    let massless: Vec<usize> = (0..mass.len()).filter(|&k| mass[k].hi == 0.0).collect();
    let place = |k: usize| massless.iter().position(|&z| z == k);
    let (zeros, size) = (massless.len(), massless.len() + rows.len());
    let mut matrix = vec![vec![Dd::ZERO; size]; size];
    let mut right = vec![Dd::ZERO; size];
    let mut dense = vec![vec![Dd::ZERO; mass.len()]; rows.len()];
    for (dense, row) in dense.iter_mut().zip(rows) {
        row.iter().for_each(|&(k, g)| dense[k] += g);
    }
    for (z, &k) in massless.iter().enumerate() {
        right[z] = -f[k];
    }
    for (r, row) in dense.iter().enumerate() {
        right[zeros + r] = c[r];
        for (k, &g) in row.iter().enumerate().filter(|(_, g)| g.hi != 0.0) {
            if let Some(z) = place(k) {
                matrix[zeros + r][z] = g;
                matrix[z][zeros + r] = g;
            } else {
                let share = g / mass[k];
                right[zeros + r] -= share * f[k];
                for (s, other) in dense.iter().enumerate().filter(|(_, other)| other[k].hi != 0.0) {
                    matrix[zeros + r][zeros + s] += share * other[k];
                }
            }
        }
    }
    let reduced = eliminate(matrix, right);
    let multipliers = reduced.unknowns[zeros..].to_vec();
    let mut x: Vec<Dd> = (0..mass.len())
        .map(|k| {
            let pull = dense.iter().zip(&multipliers).fold(f[k], |sum, (row, &lambda)| sum + row[k] * lambda);
            if mass[k].hi == 0.0 { Dd::ZERO } else { pull / mass[k] }
        })
        .collect();
    massless.iter().enumerate().for_each(|(z, &k)| x[k] = reduced.unknowns[z]);
    let is_loose = reduced.is_open[..zeros].contains(&true);
    Solution {
        x,
        multipliers,
        is_open: reduced.is_open[zeros..].to_vec(),
        least_pivot: reduced.least_pivot,
        is_loose,
    }
}

struct Eliminated {
    unknowns: Vec<Dd>,
    is_open: Vec<bool>,
    least_pivot: f64,
}

/// Solves a symmetric system; unknowns that nothing determines are zero and marked, with those that depend on
/// them.
fn eliminate(mut a: Vec<Vec<Dd>>, mut b: Vec<Dd>) -> Eliminated {
    let n = b.len();
    // Powers of two bring the largest entry of every row and column near one, so that pivots can be compared
    // whatever the units.
    let mut scale = vec![1.0; n];
    for _ in 0..4 {
        let most: Vec<f64> = (0..n)
            .map(|i| (0..n).map(|j| a[i][j].hi.abs() * scale[i] * scale[j]).fold(0.0, f64::max))
            .collect();
        for i in (0..n).filter(|&i| most[i] > 0.0) {
            scale[i] *= (-0.5 * most[i].log2()).round().exp2();
        }
    }
    for i in 0..n {
        b[i] = b[i].scale(scale[i]);
        for j in 0..n {
            a[i][j] = a[i][j].scale(scale[i] * scale[j]);
        }
    }
    let mut columns: Vec<usize> = (0..n).collect();
    let (mut rank, mut first, mut least) = (0, 0.0, 1.0f64);
    for step in 0..n {
        let (mut row, mut column, mut most) = (step, step, 0.0);
        for i in step..n {
            for j in step..n {
                if a[i][j].hi.abs() > most {
                    (row, column, most) = (i, j, a[i][j].hi.abs());
                }
            }
        }
        if step == 0 {
            first = most;
        }
        if most <= DEPENDENT * first {
            break;
        }
        (least, rank) = (least.min(most / first), step + 1);
        a.swap(step, row);
        b.swap(step, row);
        columns.swap(step, column);
        a.iter_mut().for_each(|line| line.swap(step, column));
        for i in step + 1..n {
            if a[i][step].hi == 0.0 {
                continue;
            }
            let factor = a[i][step] / a[step][step];
            for j in step + 1..n {
                if a[step][j].hi != 0.0 {
                    let part = factor * a[step][j];
                    a[i][j] -= part;
                }
            }
            let part = factor * b[step];
            b[i] -= part;
        }
    }
    let mut unknowns = vec![Dd::ZERO; n];
    let mut is_open = vec![false; n];
    columns[rank..].iter().for_each(|&column| is_open[column] = true);
    let mut y = vec![Dd::ZERO; n];
    // What a unit of each open unknown would add to the others: where it adds nothing, they are determined.
    let mut null = vec![vec![Dd::ZERO; n]; n - rank];
    for (k, vector) in null.iter_mut().enumerate() {
        vector[rank + k] = Dd::ONE;
    }
    for i in (0..rank).rev() {
        let sum = (i + 1..rank).fold(b[i], |sum, j| sum - a[i][j] * y[j]);
        y[i] = sum / a[i][i];
        for vector in &mut null {
            let sum = (i + 1..n).fold(Dd::ZERO, |sum, j| sum - a[i][j] * vector[j]);
            vector[i] = sum / a[i][i];
            is_open[columns[i]] |= vector[i].hi.abs() > 1e-12;
        }
    }
    for i in 0..n {
        unknowns[columns[i]] = y[i].scale(scale[columns[i]]);
    }
    Eliminated { unknowns, is_open, least_pivot: least }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two masses on a rod, one row given twice and another at right angles, a coordinate without mass that
    /// follows the first.
    #[test]
    fn redundant_rows_and_coordinates_without_mass() {
        let of = |value: f64| Dd::from(value);
        let mass = [of(1.0), of(3.0), of(0.0)];
        let rows = vec![
            vec![(0, of(1.0)), (1, of(-1.0))],
            vec![(0, of(2.0)), (1, of(-2.0))],
            vec![(2, of(1.0)), (0, of(-1.0))],
        ];
        let solved = solve(&mass, &rows, &[of(8.0), of(0.0), of(0.0)], &[of(0.0); 3]);
        let near = |found: Dd, expected: f64| {
            assert!((found.hi - expected).abs() < 1e-28 && !solved.is_loose, "{found:?}")
        };
        near(solved.x[0], 2.0);
        near(solved.x[1], 2.0);
        near(solved.x[2], 2.0);
        assert_eq!(solved.is_open, [true, true, false]);
        near(solved.multipliers[0] + solved.multipliers[1].scale(2.0), -6.0);
        near(solved.multipliers[2], 0.0);
    }
}
