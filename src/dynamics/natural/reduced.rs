//! The constant part of the natural form: the inverse of the mass matrix, with the linear rows removed from
//! it once per scene.
//!
//! ```text
//! D x + Cᵀ lambda = y,  C x = 0:    x = W y,  lambda = Rᵀ y
//! R = D⁻¹ Cᵀ (C D⁻¹ Cᵀ)⁻¹,
//!     W = D⁻¹ - R C D⁻¹,       x - R (C x + c)  puts the rows back, by the shortest way in the metric of D
//! ```
//!
//! Rows are orthonormalised in the metric of D⁻¹ one after another; one of which less than [`DEPENDENT`] is
//! left depends on those before it and is left out, its multiplier zero.  All of it is formed in
//! double-double and rounded once: a rounded W is the exact inverse of some mass matrix 1e-16 away, so it
//! shifts energies by 1e-16 of themselves but makes none.  W is symmetric to the last bit.
//!
//! Source of the elimination: E. Eich-Soellner, C. Führer, *Numerical Methods in Multibody Dynamics* (1998),
//! section 1.4; that linear rows may be removed once for all is special to natural coordinates.

use crate::arithmetic::{Complex, DoubleDouble, Scalar};
use crate::dynamics::Mechanism;
use crate::dynamics::quadratic::Quadratic;

/// What is left of a dependent row, against itself.
const DEPENDENT: f64 = 1e-10;

/// A 2 × 2 block of W: xx, xy, yx, yy.
pub type Block = [f64; 4];

/// A linear row with constant coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearRow {
    /// Its number in the mechanism.
    pub row: usize,
    /// C, without bilinear terms.
    pub place: Quadratic,
}

/// The matrices.
#[derive(Clone, Debug, PartialEq)]
pub struct ReducedMatrices {
    /// Number of elements n.
    elements: usize,
    /// W, block by block (n × n) \[1/(kg·m²)\].
    pub inverse: Vec<Block>,
    /// Largest entry of D⁻¹ on the diagonal of each element (n): what pivots are measured against.
    pub free: Vec<f64>,
    /// The linear rows that are not dependent on others.
    pub rows: Vec<LinearRow>,
    /// R, row by row of C (rows × n).
    pub back: Vec<Complex<f64>>,
}

/// Product of a block with a vector.
#[inline(always)]
pub fn times(block: &Block, x: Complex<f64>) -> Complex<f64> {
    Complex::new(block[0] * x.re + block[1] * x.im, block[2] * x.re + block[3] * x.im)
}

type Vectors = Vec<Vec<Complex<DoubleDouble>>>;

/// Linear rows made orthonormal in the metric of D⁻¹: C = T Q.
#[derive(Default)]
struct OrthonormalRows {
    /// Those that do not depend on the ones before them.
    rows: Vec<LinearRow>,
    /// D⁻¹ q of each row q of Q.
    spreads: Vectors,
    /// The rows of T, each up to its diagonal.
    shares: Vec<Vec<DoubleDouble>>,
}

impl OrthonormalRows {
    /// Of all linear rows, with D⁻¹ (n × n).
    fn of(linear: Vec<LinearRow>, inverse: &[Complex<DoubleDouble>], n: usize) -> Self {
        let spread = |x: &[Complex<DoubleDouble>]| -> Vec<Complex<DoubleDouble>> {
            inverse
                .chunks(n)
                .map(|row| row.iter().zip(x).fold(Complex::ZERO, |sum, (&w, &x)| sum + w * x))
                .collect()
        };
        let (mut found, mut basis) = (Self::default(), Vectors::new());
        for row in linear {
            let mut rest = vec![Complex::<DoubleDouble>::ZERO; n];
            for &(k, g) in &row.place.linear {
                rest[k] += Complex::of(g);
            }
            let whole = dot(&rest, &spread(&rest)).hi;
            let mut share = vec![DoubleDouble::ZERO; basis.len()];
            // Twice, so that what rounding leaves of the first round goes.
            for _ in 0..2 {
                for ((q, minv_jt), share) in basis.iter().zip(&found.spreads).zip(&mut share) {
                    let part = dot(minv_jt, &rest);
                    *share += part;
                    for (rest, &q) in rest.iter_mut().zip(q) {
                        *rest -= q.times(part);
                    }
                }
            }
            let minv_jt = spread(&rest);
            let square = dot(&rest, &minv_jt);
            let is_independent = square.hi > DEPENDENT * DEPENDENT * whole;
            if !is_independent {
                continue;
            }
            let length = square.sqrt();
            let unit = |x: &[Complex<DoubleDouble>]| {
                x.iter().map(|x| x.times(DoubleDouble::ONE / length)).collect::<Vec<_>>()
            };
            share.push(length);
            basis.push(unit(&rest));
            found.spreads.push(unit(&minv_jt));
            found.shares.push(share);
            found.rows.push(row);
        }
        found
    }
}

impl ReducedMatrices {
    /// Of a mechanism and its linear rows; the error is the body whose pivot vanishes.
    pub fn new(mechanism: &Mechanism, linear: Vec<LinearRow>) -> Result<Self, usize> {
        let n = mechanism.coordinates();
        let inverse = invert(mechanism)?;
        let OrthonormalRows { rows, spreads, shares } = OrthonormalRows::of(linear, &inverse, n);
        let back = put_back(spreads.clone(), &shares);
        let blocks = reduce(&inverse, &spreads, n);
        let plain = |x: &Complex<DoubleDouble>| Complex::new(x.re.hi, x.im.hi);
        Ok(Self {
            elements: n,
            inverse: blocks,
            free: (0..n).map(|k| inverse[k * n + k].re.hi).collect(),
            rows,
            back: back.iter().flatten().map(plain).collect(),
        })
    }

    /// Puts elements back onto the linear rows; `change` is scratch space (n).
    pub fn project_back(&self, z: &mut [Complex<DoubleDouble>], change: &mut [Complex<f64>]) {
        self.put(z, change, |place, z| place.value(z));
    }

    /// The same for their rates.
    pub fn project_rates_back(&self, rate: &mut [Complex<DoubleDouble>], change: &mut [Complex<f64>]) {
        self.put(rate, change, slip);
    }

    fn put(
        &self,
        x: &mut [Complex<DoubleDouble>],
        change: &mut [Complex<f64>],
        violation: fn(&Quadratic, &[Complex<DoubleDouble>]) -> DoubleDouble,
    ) {
        if self.rows.is_empty() {
            return;
        }
        change.fill(Complex::ZERO);
        for (row, back) in self.rows.iter().zip(self.back.chunks(self.elements)) {
            let left = violation(&row.place, x).hi;
            for (change, back) in change.iter_mut().zip(back) {
                *change += back.times(left);
            }
        }
        for (x, change) in x.iter_mut().zip(change.iter()) {
            *x = Complex::new(x.re + -change.re, x.im + -change.im);
        }
    }
}

/// R = (D⁻¹ Qᵀ) T⁻¹ from D⁻¹ Qᵀ and T, from the last column to the first.
fn put_back(mut back: Vectors, shares: &[Vec<DoubleDouble>]) -> Vectors {
    for j in (0..shares.len()).rev() {
        let divisor = DoubleDouble::ONE / shares[j][j];
        for entry in &mut back[j] {
            *entry = entry.times(divisor);
        }
        for i in 0..j {
            for k in 0..back[j].len() {
                let part = back[j][k].times(shares[j][i]);
                back[i][k] -= part;
            }
        }
    }
    back
}

/// W, block by block: D⁻¹ less (D⁻¹ Qᵀ)(D⁻¹ Qᵀ)ᵀ.
fn reduce(inverse: &[Complex<DoubleDouble>], spreads: &[Vec<Complex<DoubleDouble>>], n: usize) -> Vec<Block> {
    let mut blocks = vec![[0.0; 4]; n * n];
    for i in 0..n {
        for j in i..n {
            let w = inverse[i * n + j];
            let mut block = [w.re, -w.im, w.im, w.re];
            for q in spreads {
                let (a, b) = (q[i], q[j]);
                let parts = [a.re * b.re, a.re * b.im, a.im * b.re, a.im * b.im];
                for (entry, part) in block.iter_mut().zip(parts) {
                    *entry -= part;
                }
            }
            let [xx, xy, yx, yy] = block.map(|entry| entry.hi);
            blocks[i * n + j] = [xx, xy, yx, yy];
            blocks[j * n + i] = [xx, yx, xy, yy];
        }
        blocks[i * n + i][2] = blocks[i * n + i][1];
    }
    blocks
}

/// Rate of a linear row.
fn slip(place: &Quadratic, rate: &[Complex<DoubleDouble>]) -> DoubleDouble {
    place.linear.iter().fold(DoubleDouble::ZERO, |sum, &(k, g)| sum + Complex::of(g).dot(rate[k]))
}

/// Real part of Σ conj(a_k) b_k.
fn dot(a: &[Complex<DoubleDouble>], b: &[Complex<DoubleDouble>]) -> DoubleDouble {
    a.iter().zip(b).fold(DoubleDouble::ZERO, |sum, (a, b)| sum + a.dot(*b))
}

/// D⁻¹ from D = L P Lᴴ (n × n); the places beside translational coordinates, which no element takes, are
/// zero.  The error is the body whose pivot vanishes.
fn invert(mechanism: &Mechanism) -> Result<Vec<Complex<DoubleDouble>>, usize> {
    let tree = &mechanism.tree;
    let n = tree.coordinates;
    let at = |i: usize, j: usize| i * n + j;
    let is_idle = |k: usize| k >= tree.angles && (k - tree.angles) % 2 == 1;
    // Below the diagonal D is the conjugate of what the tree stores above it.
    let mut lower: Vec<Complex<DoubleDouble>> = vec![Complex::ZERO; n * n];
    let mut pivot = vec![DoubleDouble::ZERO; n];
    for j in 0..n {
        for i in j..n {
            let mut entry = match i == j {
                true if is_idle(i) => Complex::new(DoubleDouble::ONE, DoubleDouble::ZERO),
                true => Complex::of(Complex::new(tree.diagonal[i], 0.0)),
                false => Complex::of(tree.coupling[at(j, i)].conj()),
            };
            for k in 0..j {
                entry -= (lower[at(i, k)] * lower[at(j, k)].conj()).times(pivot[k]);
            }
            if i == j {
                pivot[j] = entry.re;
                if pivot[j].hi <= 1e-13 * tree.diagonal[j] {
                    return Err(j);
                }
                lower[at(j, j)] = Complex::new(DoubleDouble::ONE, DoubleDouble::ZERO);
            } else {
                lower[at(i, j)] = entry.times(DoubleDouble::ONE / pivot[j]);
            }
        }
    }
    let mut inverse = vec![Complex::ZERO; n * n];
    let mut column = vec![Complex::<DoubleDouble>::ZERO; n];
    for j in (0..n).filter(|&j| !is_idle(j)) {
        column.fill(Complex::ZERO);
        column[j].re = DoubleDouble::ONE;
        for i in j..n {
            for k in j..i {
                let part = lower[at(i, k)] * column[k];
                column[i] -= part;
            }
        }
        for i in (j..n).rev() {
            column[i] = column[i].times(DoubleDouble::ONE / pivot[i]);
            for k in i + 1..n {
                let part = lower[at(k, i)].conj() * column[k];
                column[i] -= part;
            }
        }
        inverse[at(j, j)] = Complex::new(column[j].re, DoubleDouble::ZERO);
        for i in j + 1..n {
            inverse[at(i, j)] = column[i];
            inverse[at(j, i)] = column[i].conj();
        }
    }
    Ok(inverse)
}
