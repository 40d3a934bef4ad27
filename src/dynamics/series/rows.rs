//! Constraint rows in the series: the multipliers are solved for with every order.
//!
//! ```text
//! linear in unit vectors:  C = c + Σ g_k·z_k,      J_k = g_k·(i z_k,0),   J a_m = -Σ g_k·u_k,m        force lambda g_k on z_k
//! a given angle:           C = q_a - q_b - theta,  J = (1, -1),           J a_m = theta''_m           torque lambda
//! M_0 a_m + Jᵀ lambda_m = load_m:   S = J M_0⁻¹ Jᵀ,   S lambda_m = J M_0⁻¹ load_m - (J a)_m
//! ```
//!
//! S is factored once a step.  The products of earlier multipliers with later powers of z enter through the loads like those of any force.

use super::drive;
use super::polynomial::{copy, zeros};
use crate::arithmetic::{Complex, Real};
use crate::dynamics::kernel::dot;
use crate::dynamics::law::Law;
use crate::dynamics::point::Point;
use crate::dynamics::row::Row;
use crate::dynamics::ties::Ties;
use crate::dynamics::{Mechanism, Time, tree};

/// Rows in force and their multipliers.
#[derive(Clone, Debug)]
pub struct RowSeries<T> {
    kinds: Vec<Kind<T>>,
    coordinates: usize,
    /// J by coordinates, and M_0⁻¹ Jᵀ (r × f).
    jacobian: Vec<T>,
    lifted: Vec<T>,
    schur: Vec<T>,
    pivot: Vec<T>,
    /// lambda: powers 0…P-1 (P × r).
    multiplier: Vec<T>,
}

/// A row as the series sees it.
#[derive(Clone, Debug)]
enum Kind<T> {
    /// The g_k.
    Linear(Vec<(usize, Complex<f64>)>),
    /// The bodies a and b, and the powers of theta' and of its own rate w_a - w_b.
    Angle { body: usize, base: Option<usize>, law: Law, drive: Vec<T>, speed: Vec<T> },
}

impl<T: Real> RowSeries<T> {
    /// Room for the rows that `ties` do not fulfil already: all but the motors' where these are eliminated.
    pub fn new(mechanism: &Mechanism, ties: &Ties, order: usize) -> Self {
        let linear = |point: &Point, direction: Complex<f64>| {
            Kind::Linear(point.terms.iter().map(|&(k, gamma)| (k, gamma.conj() * direction)).collect())
        };
        let kind = |row: &Row| match row {
            Row::Angle(_) if ties.driven() => None,
            Row::Angle(row) => {
                Some(Kind::Angle { body: row.body, base: row.base, law: row.law.clone(), drive: zeros(order + 1), speed: zeros(order + 1) })
            }
            Row::Line(row) => Some(linear(&row.point, row.normal)),
            Row::Pin(row) => Some(linear(&row.span, row.axis)),
        };
        let kinds: Vec<Kind<T>> = mechanism.rows.iter().filter_map(kind).collect();
        let (r, f) = (kinds.len(), ties.count());
        Self {
            kinds,
            coordinates: f,
            jacobian: zeros(r * f),
            lifted: zeros(r * f),
            schur: zeros(r * r),
            pivot: zeros(r),
            multiplier: zeros(order * r),
        }
    }

    /// True where no row is in force.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// Power `m` of the multiplier of the `r`-th row in force, counted from the last \[N, N·m over s^m\].
    pub fn multiplier_from_last(&self, r: usize, m: usize) -> T {
        let rows = self.kinds.len();
        self.multiplier[m * rows + rows - 1 - r]
    }

    /// The laws' series at time `t`.
    pub fn begin(&mut self, t: Time) {
        for kind in &mut self.kinds {
            if let Kind::Angle { law, drive, .. } = kind {
                drive.fill(T::ZERO);
                drive::add(law, 1.0, t, drive.iter_mut());
            }
        }
    }

    /// J and S, from the factors of the mass matrix of the coordinates.
    pub fn prepare(&mut self, ties: &Ties, z: &[Complex<T>], mass: &[T], pivot: &[T]) {
        let (r, f) = (self.kinds.len(), self.coordinates);
        self.jacobian.fill(T::ZERO);
        for (kind, jacobian) in self.kinds.iter().zip(self.jacobian.chunks_exact_mut(f.max(1))) {
            let mut add = |body: usize, entry: T| {
                if let Some(base) = ties.bodies[body].base {
                    jacobian[base] += entry;
                }
            };
            match kind {
                Kind::Linear(terms) => terms.iter().for_each(|&(k, g)| add(k, Complex::of(g).dot(z[k].left()))),
                Kind::Angle { body, base, .. } => {
                    add(*body, T::ONE);
                    base.iter().for_each(|&base| add(base, -T::ONE));
                }
            }
        }
        self.lifted.copy_from_slice(&self.jacobian);
        for lifted in self.lifted.chunks_exact_mut(f.max(1)) {
            tree::solve::<T, 0>(f, mass, pivot, lifted);
        }
        for i in 0..r {
            for j in i..r {
                self.schur[i * r + j] = dot(&self.jacobian[i * f..(i + 1) * f], &self.lifted[j * f..(j + 1) * f]);
            }
        }
        tree::factor::<T, 0>(r, &mut self.schur, &mut self.pivot);
    }

    /// Multipliers of power m from the free accelerations of the coordinates, which become the constrained ones.
    pub fn solve(&mut self, m: usize, bend: &[Complex<T>], solution: &mut [T]) {
        let (r, f) = (self.kinds.len(), self.coordinates);
        let multiplier = &mut self.multiplier[m * r..(m + 1) * r];
        for (i, kind) in self.kinds.iter().enumerate() {
            let free = dot(&self.jacobian[i * f..(i + 1) * f], solution);
            multiplier[i] = match kind {
                Kind::Linear(terms) => terms.iter().fold(free, |sum, &(k, g)| sum + Complex::of(g).dot(bend[k])),
                Kind::Angle { drive, .. } => free - drive[m + 1].scale((m + 1) as f64),
            };
        }
        tree::solve::<T, 0>(r, &self.schur, &self.pivot, multiplier);
        for (i, &multiplier) in multiplier.iter().enumerate() {
            for c in 0..f {
                solution[c] -= self.lifted[i * f + c] * multiplier;
            }
        }
    }

    /// Adds what the multipliers of power m put on the unit vectors to `rest`.
    pub fn push(&self, m: usize, rest: &mut [Complex<T>]) {
        let r = self.kinds.len();
        for (kind, &multiplier) in self.kinds.iter().zip(&self.multiplier[m * r..]) {
            if let Kind::Linear(terms) = kind {
                for &(k, g) in terms {
                    rest[k] += Complex::of(g).times(multiplier);
                }
            }
        }
    }

    /// Power m of the motors' power \[W/s^m\]; what stands still does no work.
    pub fn power(&mut self, m: usize, omega: &[T]) -> T {
        let (r, mut power) = (self.kinds.len(), T::ZERO);
        for (i, kind) in self.kinds.iter_mut().enumerate() {
            if let Kind::Angle { body, base, speed, .. } = kind {
                speed[m] = base.map_or(omega[*body], |base| omega[*body] - omega[base]);
                let sum = (0..=m).fold(T::ZERO, |sum, l| sum + self.multiplier[l * r + i] * speed[m - l]);
                power -= sum;
            }
        }
        power
    }

    /// The first powers from another series.
    pub fn take<U: Real>(&mut self, other: &RowSeries<U>) {
        copy(&mut self.multiplier, &other.multiplier);
        for (kind, other) in self.kinds.iter_mut().zip(&other.kinds) {
            if let (Kind::Angle { speed, .. }, Kind::Angle { speed: other, .. }) = (kind, other) {
                copy(speed, other);
            }
        }
    }
}
