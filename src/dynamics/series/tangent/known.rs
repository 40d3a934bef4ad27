//! The constants of hinge trees and loops with their derivatives, in slots.

use crate::arithmetic::Complex;
use crate::arithmetic::lanes::wide::Slots;
use crate::dynamics::constraint::{ConstraintEquation, RowMeasure};
use crate::dynamics::series::Terms;
use crate::dynamics::series::varied::Number;
use crate::dynamics::tree::Tree;

/// An entry of H.
#[derive(Clone, Copy, Debug)]
pub struct CouplingEntry<S> {
    /// Its column.
    pub column: usize,
    /// Its value and derivatives.
    pub value: f64,
    pub slope: S,
}

/// Entries of H, row by row, and where rows begin and end.
#[derive(Debug)]
pub struct CouplingEntries<S> {
    /// Row by row.
    pub entries: Vec<CouplingEntry<S>>,
    rows: Vec<usize>,
}

/// What a row asks of a body, g.
#[derive(Clone, Copy, Debug)]
pub struct RowGradient<S> {
    /// The row and the body.
    pub row: usize,
    pub body: usize,
    /// Its value and derivatives.
    pub value: Complex<f64>,
    pub slope: [S; 2],
}

/// The constants and their derivatives.
#[derive(Debug)]
pub struct TangentConstants<S> {
    /// H beside the diagonal, and as a matrix.
    pub coupling: CouplingEntries<S>,
    pub matrix: Vec<f64>,
    /// Those entries that have derivatives.
    pub varied: CouplingEntries<S>,
    /// Derivatives of d_k and of gravity, body by body.
    pub diagonal: Vec<S>,
    pub weight: Vec<[S; 2]>,
    /// What rows ask of bodies.
    pub gradient: Vec<RowGradient<S>>,
}

/// g of a row, where it has nothing else.
fn gradient(row: &ConstraintEquation<Number>) -> Option<&[(usize, Complex<Number>)]> {
    match &row.measure {
        RowMeasure::Place(place) if place.bilinear.is_empty() && row.law.is_none() && row.aim.is_none() => {
            Some(&place.linear)
        }
        _ => None,
    }
}

impl<S: Slots> CouplingEntries<S> {
    /// Those beside the diagonal that are wanted.
    fn of(tree: &Tree<Number>, is_wanted: impl Fn(Number) -> bool) -> Self {
        let n = tree.coordinates;
        let (mut entries, mut rows) = (Vec::new(), vec![0]);
        for row in 0..n {
            for column in (0..n).filter(|&column| column != row) {
                let entry = tree.coupling[row.min(column) * n + row.max(column)].re;
                if is_wanted(entry) {
                    entries.push(CouplingEntry { column, value: entry.value, slope: S::of(&entry.slope) });
                }
            }
            rows.push(entries.len());
        }
        Self { entries, rows }
    }

    /// True where there are most of them.
    pub fn is_dense(&self) -> bool {
        let n = self.rows.len() - 1;
        n > 2 && 2 * self.entries.len() >= n * (n - 1)
    }

    /// Those of a row.
    #[inline(always)]
    pub fn row(&self, row: usize) -> &[CouplingEntry<S>] {
        &self.entries[self.rows[row]..self.rows[row + 1]]
    }

    /// Adds H x to power m of R.
    #[inline(always)]
    pub fn add(&self, [x_re, x_im]: &[Vec<S>; 2], [re, im]: &mut [Vec<S>; 2], room: usize, m: usize) {
        for row in 0..x_re.len() {
            let place = row * room + m;
            let (mut sum_re, mut sum_im) = (re[place], im[place]);
            for entry in self.row(row) {
                let value = S::splat(entry.value);
                sum_re = x_re[entry.column].mul_add(value, sum_re);
                sum_im = x_im[entry.column].mul_add(value, sum_im);
            }
            (re[place], im[place]) = (sum_re, sum_im);
        }
    }

    /// Products of the derivatives of a row with powers of z'', body by body, into those of R.
    #[inline(always)]
    pub fn products(
        &self,
        row: usize,
        [curve_re, curve_im]: &[Vec<f64>; 2],
        room: usize,
        order: usize,
        (re, im): (&mut [S], &mut [S]),
    ) {
        let entries = self.row(row);
        let mut m = 0;
        // Four powers at a time, up to three of them beyond the last.
        while m < order {
            let (mut a, mut b, mut c, mut d) = (S::ZERO, S::ZERO, S::ZERO, S::ZERO);
            let (mut p, mut q, mut s, mut t) = (S::ZERO, S::ZERO, S::ZERO, S::ZERO);
            let mut e = 0;
            while e < entries.len() {
                let CouplingEntry { column, slope, .. } = entries[e];
                let (x, y) = (&curve_re[column * room + m..][..4], &curve_im[column * room + m..][..4]);
                a = slope.mul_add(S::splat(x[0]), a);
                b = slope.mul_add(S::splat(x[1]), b);
                c = slope.mul_add(S::splat(x[2]), c);
                d = slope.mul_add(S::splat(x[3]), d);
                p = slope.mul_add(S::splat(y[0]), p);
                q = slope.mul_add(S::splat(y[1]), q);
                s = slope.mul_add(S::splat(y[2]), s);
                t = slope.mul_add(S::splat(y[3]), t);
                e += 1;
            }
            (re[m], re[m + 1], re[m + 2], re[m + 3]) = (a, b, c, d);
            (im[m], im[m + 1], im[m + 2], im[m + 3]) = (p, q, s, t);
            m += 4;
        }
    }
}

impl<S: Slots> TangentConstants<S> {
    /// Those of terms, where these have nothing else.
    pub fn of(terms: &Terms<Number>) -> Option<Self> {
        let (tree, structure) = (terms.tree, terms.structure);
        let acts = [terms.springs.len(), terms.torsions.len(), terms.actions.len(), terms.forces.len()];
        let is_forced = acts != [0; 4] || !structure.frictions.is_empty();
        let n = tree.coordinates;
        if is_forced || tree.off_axis || !tree.is_dense() || n != tree.angles || terms.partition.driven() {
            return None;
        }
        let coupling = CouplingEntries::of(tree, |entry| entry.value != 0.0);
        let mut matrix = vec![0.0; n * n];
        for (k, row) in matrix.chunks_exact_mut(n.max(1)).enumerate() {
            coupling.row(k).iter().for_each(|entry| row[entry.column] = entry.value);
        }
        let mut known = Self {
            coupling,
            matrix,
            varied: CouplingEntries::of(tree, |entry| entry != Number::constant(entry.value)),
            diagonal: tree.diagonal.iter().map(|number| S::of(&number.slope)).collect(),
            weight: tree.weight.iter().map(|w| [S::of(&w.re.slope), S::of(&w.im.slope)]).collect(),
            gradient: Vec::new(),
        };
        for (row, equation) in terms.constraints.iter().enumerate() {
            known.gradient.extend(gradient(equation)?.iter().map(|&(body, g)| RowGradient {
                row,
                body,
                value: Complex::new(g.re.value, g.im.value),
                slope: [S::of(&g.re.slope), S::of(&g.im.slope)],
            }));
        }
        Some(known)
    }
}
