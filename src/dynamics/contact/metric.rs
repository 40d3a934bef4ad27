//! Constraints and contacts of one moment in coordinates in which the mass matrix is one.
//!
//! ```text
//! T M T = L Lᵀ,  T_ii = M_ii^(-1/2)
//!     v = Lᵀ T⁻¹ w,   c = L⁻¹ T gᵀ of a row g:   g w = c·v,  g M⁻¹ hᵀ = c·d,  wᵀ M w = v·v
//! columns of several rows:  C = Q R           Q: orthonormal;  R: upper triangular
//! least v with Cᵀ v = b:  Q R⁻ᵀ b             what the rows leave of c:  c - Q Qᵀ c
//! ```
//!
//! Masses, lengths and times of any unit come out the same, but for rounding, and no matrix is squared.  Rows
//! that say nothing new are left out by their geometry alone, masses aside: see `new_rows`.  Source: Å.
//! Björck, *Numerical Methods for Least Squares Problems* (1996), sections 2.4.5 (orthogonalized twice) and
//! 2.7.3.

use crate::dynamics::constraint::{ConstraintArguments, ConstraintEquation, Linearised, RowMeasure};
use crate::dynamics::kernel::Kernel;
use crate::dynamics::{Mechanism, Time};
use nalgebra::{DMatrix, DVector};

/// Part of a row, over its own size, that must be new for it to count.
const NEW: f64 = 1e-7;

/// A row and its Jacobian at one moment.
pub struct MetricRow {
    /// Drive and what is left of C'' at zero acceleration.
    pub row: Linearised<f64>,
    /// The Jacobian (n).
    pub along: Vec<f64>,
}

/// A mechanism at one moment, its constraints among themselves.
pub struct ContactMetric {
    lower: DMatrix<f64>,
    scale: DVector<f64>,
    /// b \[N·m, N\].
    load: Vec<f64>,
    /// The mechanism's rows, contacts that are held included.
    pub rows: Vec<MetricRow>,
    /// How many rows say something new by their geometry alone.
    rank: usize,
    /// The rows that count, in the order of the columns of `basis`.
    counting: Vec<usize>,
    basis: Basis,
}

impl ContactMetric {
    /// At these coordinates \[rad, m\] and rates; `None` where the mass matrix is not positive definite.
    pub fn at(mechanism: &Mechanism, t: Time, phi: &[f64], omega: &[f64]) -> Option<Self> {
        let n = mechanism.coordinates();
        let mut kernel = Kernel::<f64>::dense_without_rows(mechanism);
        kernel.unit_vectors::<0>(mechanism, phi);
        kernel.assemble::<0>(mechanism, t, phi, omega);
        let scale = DVector::from_fn(n, |i, _| kernel.mass[i * n + i].sqrt().recip());
        let mass = DMatrix::from_fn(n, n, |i, j| kernel.mass[i.min(j) * n + i.max(j)] * scale[i] * scale[j]);
        let lower = mass.cholesky()?.unpack();
        let at = ConstraintArguments { phi, z: &kernel.z, omega };
        let rows: Vec<MetricRow> =
            mechanism.constraints.iter().map(|row| MetricRow::of(row, t, at)).collect();
        let counting = new_rows(mechanism, &mechanism.constraints.iter().zip(&rows).collect::<Vec<_>>());
        let (load, rank) = (kernel.load, counting.len());
        let mut metric = Self { lower, scale, load, rows, rank, counting: Vec::new(), basis: Basis::new(n) };
        metric.counting = counting
            .into_iter()
            .filter(|&r| metric.basis.push(&metric.column(&metric.rows[r].along)))
            .collect();
        Some(metric)
    }

    /// c of a row's Jacobian, or of generalized forces the acceleration they cause.
    pub fn column(&self, row: &[f64]) -> DVector<f64> {
        let mut column = DVector::from_column_slice(row).component_mul(&self.scale);
        self.lower.solve_lower_triangular_mut(&mut column);
        column
    }

    /// v of rates.
    pub fn velocity(&self, omega: &[f64]) -> DVector<f64> {
        self.lower.tr_mul(&DVector::from_column_slice(omega).component_div(&self.scale))
    }

    /// The rates of v.
    pub fn rates(&self, v: &DVector<f64>) -> Vec<f64> {
        let mut omega = v.clone();
        self.lower.tr_solve_lower_triangular_mut(&mut omega);
        omega.component_mul(&self.scale).iter().copied().collect()
    }

    /// The rows that count, by their numbers.
    pub fn counting(&self) -> &[usize] {
        &self.counting
    }

    /// True where the constraints of the mechanism leave nothing of a row, by their geometry alone.
    pub fn has(&self, mechanism: &Mechanism, row: &ConstraintEquation, gradient: &MetricRow) -> bool {
        let mut rows: Vec<(&ConstraintEquation, &MetricRow)> =
            mechanism.constraints.iter().zip(&self.rows).collect();
        rows.push((row, gradient));
        new_rows(mechanism, &rows).len() == self.rank
    }

    /// What the constraints leave of a column.
    pub fn free(&self, column: &DVector<f64>) -> DVector<f64> {
        self.basis.rest(column)
    }

    /// The velocity nearest to `v` that keeps the constraints.
    pub fn kept(&self, v: &DVector<f64>) -> DVector<f64> {
        self.nearest(v, |row| row.drive)
    }

    /// The acceleration that forces alone would cause.
    pub fn unconstrained(&self) -> DVector<f64> {
        self.column(&self.load)
    }

    /// The acceleration that forces and constraints cause.
    pub fn acceleration(&self) -> DVector<f64> {
        self.nearest(&self.unconstrained(), |row| row.convective)
    }

    fn nearest(&self, v: &DVector<f64>, given: impl Fn(&Linearised<f64>) -> f64) -> DVector<f64> {
        let off = |&r: &usize| -given(&self.rows[r].row) - self.column(&self.rows[r].along).dot(v);
        v + self.basis.least(&self.counting.iter().map(off).collect::<Vec<_>>())
    }

    /// Multipliers of the rows, which together make `push`; zero of those that do not count.
    pub fn multipliers(&self, push: &DVector<f64>) -> Vec<f64> {
        let mut found = vec![0.0; self.rows.len()];
        for (&r, multiplier) in self.counting.iter().zip(self.basis.shares(push)) {
            found[r] = multiplier;
        }
        found
    }
}

impl MetricRow {
    /// That of a row.
    pub fn of(row: &ConstraintEquation, t: Time, at: ConstraintArguments<f64>) -> Self {
        let mut along = vec![0.0; at.phi.len()];
        Self { row: row.differentiate(t, at, &mut along), along }
    }
}

/// The rows that say something new, those that say most first: angles in rad, lengths in sizes of the
/// mechanism, each row over the most it could say.
fn new_rows(mechanism: &Mechanism, rows: &[(&ConstraintEquation, &MetricRow)]) -> Vec<usize> {
    let (size, angles) = (mechanism.size_of_parts(), mechanism.bodies.len());
    let scaled = |(row, gradient): &(&ConstraintEquation, &MetricRow)| {
        let along = DVector::from_fn(gradient.along.len(), |k, _| {
            gradient.along[k] * if k < angles { 1.0 } else { size }
        });
        let most = along.norm().max(reach(&row.measure, size));
        along / most
    };
    let mut left: Vec<DVector<f64>> = rows.iter().map(scaled).collect();
    let (mut found, mut basis) = (Vec::new(), Basis::new(mechanism.coordinates()));
    while found.len() < left.len() {
        let most = (0..left.len())
            .filter(|r| !found.contains(r))
            .max_by(|&a, &b| left[a].norm_squared().total_cmp(&left[b].norm_squared()));
        let Some(most) = most.filter(|&r| left[r].norm() > NEW) else { break };
        found.push(most);
        basis.push(&left[most]);
        for (_, row) in left.iter_mut().enumerate().filter(|(r, _)| !found.contains(r)) {
            *row = basis.rest(row);
        }
    }
    found
}

/// The most a row changes by where one element moves by rad or the size of the mechanism, products with
/// translational coordinates aside.
fn reach(measure: &RowMeasure, size: f64) -> f64 {
    let RowMeasure::Place(place) = measure else { return 1.0 };
    let unit = |k: usize| if k < place.angles { 1.0 } else { size };
    let linear = place.linear.iter().map(|&(k, g)| g.norm_squared().sqrt() * unit(k));
    let bilinear = place.bilinear.iter().map(|&(_, k, h)| h.norm_squared().sqrt() * unit(k));
    linear.chain(bilinear).fold(0.0, f64::max)
}

/// Q and R of columns, one after another.
#[derive(Clone, Debug)]
pub struct Basis {
    dimension: usize,
    directions: Vec<DVector<f64>>,
    /// Columns of R.
    parts: Vec<Vec<f64>>,
}

impl Basis {
    /// No columns yet, of so many numbers each.
    pub fn new(dimension: usize) -> Self {
        Self { dimension, directions: Vec::new(), parts: Vec::new() }
    }

    /// Another column; false, and nothing changed, where it is nothing new.
    pub fn push(&mut self, column: &DVector<f64>) -> bool {
        let mut part = vec![0.0; self.directions.len()];
        let mut rest = column.clone();
        for _ in 0..2 {
            for (direction, part) in self.directions.iter().zip(&mut part) {
                let along = direction.dot(&rest);
                rest.axpy(-along, direction, 1.0);
                *part += along;
            }
        }
        let norm = rest.norm();
        let is_new = norm > 0.0 && norm.is_finite();
        if is_new {
            part.push(norm);
            self.directions.push(rest / norm);
            self.parts.push(part);
        }
        is_new
    }

    /// What is left of a column.
    pub fn rest(&self, column: &DVector<f64>) -> DVector<f64> {
        let mut rest = column.clone();
        for direction in self.directions.iter().chain(&self.directions) {
            let along = direction.dot(&rest);
            rest.axpy(-along, direction, 1.0);
        }
        rest
    }

    /// The least v with these products with the columns: Q R⁻ᵀ b.
    pub fn least(&self, products: &[f64]) -> DVector<f64> {
        let mut y: Vec<f64> = Vec::with_capacity(products.len());
        let mut v = DVector::zeros(self.dimension);
        for ((part, direction), product) in self.parts.iter().zip(&self.directions).zip(products) {
            let known: f64 = part.iter().zip(&y).map(|(r, y)| r * y).sum();
            let share = (product - known) / part[y.len()];
            v.axpy(share, direction, 1.0);
            y.push(share);
        }
        v
    }

    /// The factors with which the columns make `v`, or come nearest to it: R⁻¹ Qᵀ v.
    pub fn shares(&self, v: &DVector<f64>) -> Vec<f64> {
        let mut shares: Vec<f64> = self.directions.iter().map(|direction| direction.dot(v)).collect();
        for j in (0..shares.len()).rev() {
            shares[j] /= self.parts[j][j];
            for i in 0..j {
                shares[i] -= self.parts[j][i] * shares[j];
            }
        }
        shares
    }
}
