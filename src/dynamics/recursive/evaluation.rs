//! One evaluation of the equations body by body, in place of the dense matrices of
//! [`Kernel`](crate::dynamics::kernel::Kernel).

use super::load::{InwardRequest, Passes};
use super::rows::{RecursiveRows, Ways};
use super::{Links, Recursive};
use crate::arithmetic::{Complex, Real};
use crate::dynamics::compile::Body;
use crate::dynamics::constraint::{ConstraintArguments, ConstraintEquation, Linearised};
use crate::dynamics::forest::Forest;
use crate::dynamics::kernel::Bias;
use crate::dynamics::rank::{Metric, RankVerdict};
use crate::dynamics::schur::Weakest;
use crate::dynamics::{Mechanism, Time};
use std::sync::Arc;

/// How much sooner the recursive form must be done to be taken.
const MARGIN: f64 = 1.3;

/// The constants of the recursive form.
#[derive(Clone, Debug, PartialEq)]
pub struct Recursion {
    /// The hinge trees.
    pub links: Links,
    /// The rows on them.
    pub ways: Ways,
}

impl Recursion {
    /// The trees and rows of a mechanism.
    pub fn new(bodies: &[Body], forest: &Forest, rows: &[ConstraintEquation], gravity: Complex<f64>) -> Self {
        let links = Links::new(bodies, forest, gravity);
        let touched: Vec<_> = rows.iter().map(ConstraintEquation::coordinates).collect();
        let ways = Ways::new(&links, &touched);
        Self { links, ways }
    }

    /// True where this form takes clearly less time than the matrices, by the operations of both.
    ///
    /// The weights are nanoseconds of `benches/chains.rs` on the machine of `benches/RESULTS.md`; of other
    /// machines they are wrong alike.
    pub fn pays(&self) -> bool {
        let (n, r) = (self.links.coordinates() as f64, self.ways.rows() as f64);
        let matrices = n * (24.0 + n * (2.0 + 0.25 * n)) + 1.7 * r * (n * n + 0.5 * r * n + r * r / 6.0);
        let bodies = 20.0 + 27.0 * n + 1.6 * self.ways.cost() as f64;
        MARGIN * bodies < matrices
    }
}

/// Scratch space of the recursive form; nothing is allocated after [`Evaluation::new`].
#[derive(Clone, Debug)]
pub struct Evaluation<T> {
    recursion: Arc<Recursion>,
    trees: Recursive<T>,
    rows: RecursiveRows<T>,
    /// One row's Jacobian on its way (n), zero in between.
    jacobian: Vec<T>,
}

impl<T: Real> Evaluation<T> {
    /// Scratch space for these constants and the [scales](ConstraintEquation::scale) of their rows, and what
    /// their rank is measured with.
    pub fn new(recursion: &Arc<Recursion>, scales: &[f64], metric: Metric) -> Self {
        Self {
            trees: Recursive::new(&recursion.links),
            rows: RecursiveRows::new(&recursion.ways, scales, metric),
            jacobian: vec![T::ZERO; recursion.links.coordinates()],
            recursion: Arc::clone(recursion),
        }
    }

    /// Elements at these coordinates \[rad, m\].
    #[inline]
    pub fn unit_vectors(&self, phi: &[T], z: &mut [Complex<T>]) {
        let angles = self.recursion.links.bodies();
        T::units(&phi[..angles], &mut z[..angles]);
        for x in (angles..phi.len()).step_by(2) {
            z[x] = Complex::new(phi[x], phi[x + 1]);
        }
    }

    /// The factors of M at the elements `z`, and what is left of velocity terms and gravity.
    pub fn factor(&mut self, z: &[Complex<T>], omega: &[T]) {
        self.trees.convect(&self.recursion.links, z, omega);
        self.trees.inward_pass(&self.recursion.links);
    }

    /// Writes the reciprocal pivots of M.
    pub fn pivots(&self, pivots: &mut [T]) {
        self.trees.pivots(pivots);
    }

    /// The factors of M, and what is left of all forces, springs by their stretches where these are known;
    /// overwrites `load`.  Returns the power of the laws among them \[W\].
    #[inline]
    pub fn inward_pass(
        &mut self,
        mechanism: &Mechanism,
        t: Time,
        at: ConstraintArguments<T>,
        stretch: &[T],
        load: &mut [T],
    ) -> T {
        self.trees.convect(&self.recursion.links, at.z, at.omega);
        let mut law_power = T::ZERO;
        if mechanism.is_forced() {
            load.fill(T::ZERO);
            law_power = mechanism.add_applied_forces(t, at, stretch, load);
            self.trees.burden(&self.recursion.links, load);
        }
        self.trees.inward_pass(&self.recursion.links);
        law_power
    }

    /// Writes the accelerations \[rad/s², m/s²\].
    #[inline]
    pub fn outward_pass(&mut self, alpha: &mut [T]) {
        self.trees.outward_pass(&self.recursion.links, alpha);
    }

    /// The multipliers and the bias's share of them after [`fold`](Self::inward_pass), the rows as they are,
    /// and what they leave of all forces; the weakest row.
    #[inline]
    pub fn constrain(
        &mut self,
        mechanism: &Mechanism,
        t: Time,
        at: ConstraintArguments<T>,
        bias: Bias,
        found: (&mut [Linearised<T>], &mut [T], &mut [T]),
    ) -> Weakest {
        let (rows, multiplier, correction) = found;
        let (ways, is_biased) = (&self.recursion.ways, bias != Bias::default());
        for (r, row) in mechanism.constraints.iter().enumerate() {
            let jacobian = &mut self.jacobian[..];
            // Only a bias asks for C.
            let here =
                if is_biased { row.linearise(t, at, jacobian) } else { row.differentiate(t, at, jacobian) };
            self.rows.take(ways, r, jacobian);
            (multiplier[r], correction[r]) = (here.convective, T::ZERO);
            if is_biased {
                correction[r] = (self.rows.along(ways, r, at.omega) + here.drive).scale(bias.rate)
                    + here.position.scale(bias.position);
                multiplier[r] += correction[r];
            }
            rows[r] = here;
        }
        let weakest = self.rows.factor_constraints(ways, &self.trees);
        self.settle(multiplier);
        if is_biased {
            self.solve_rows(correction);
        }
        weakest
    }

    /// Replaces the convective terms of all rows by their multipliers, after
    /// [`factor_constraints`](Self::factor_constraints), and takes these off the load.
    #[inline]
    pub fn settle(&mut self, multiplier: &mut [T]) {
        let ways = &self.recursion.ways;
        self.rows.project(ways, &self.trees, multiplier);
        self.rows.solve(ways, multiplier);
        self.rows.resist(ways, &mut self.trees, multiplier);
    }

    /// One row's Jacobian, as `add` adds it up.
    #[inline]
    pub fn take(&mut self, row: usize, add: impl FnOnce(&mut [T])) {
        add(&mut self.jacobian);
        self.rows.take(&self.recursion.ways, row, &mut self.jacobian);
    }

    /// Takes the factors of M at hand for the [passes](Passes) of a series.
    pub fn brace(&self, passes: &mut Passes<T>) {
        passes.unit_vectors(&self.recursion.links, &self.trees);
    }

    /// What is left of the load of one order of a series.
    #[inline]
    pub fn inward_loads(&mut self, passes: &mut Passes<T>, order: InwardRequest<T>) {
        passes.inward_loads(&self.recursion.links, &mut self.trees, order);
    }

    /// Writes the accelerations \[rad/s², m/s²\] of that order.
    #[inline]
    pub fn unfold_order(&self, passes: &mut Passes<T>, alpha: &mut [T]) {
        passes.outward_pass(&self.recursion.links, &self.trees, alpha);
    }

    /// Adds H x without its diagonal to `rest`, x all of that order.
    #[inline]
    pub fn close(&self, passes: &mut Passes<T>, x: &[Complex<T>], rest: &mut [Complex<T>]) {
        passes.close(&self.recursion.links, x, rest);
    }

    /// C, G, C_t, gamma of every row, and nothing else.
    pub fn rows_at(
        &mut self,
        mechanism: &Mechanism,
        t: Time,
        at: ConstraintArguments<T>,
        rows: &mut [Linearised<T>],
    ) {
        for (r, row) in mechanism.constraints.iter().enumerate() {
            rows[r] = row.linearise(t, at, &mut self.jacobian);
            self.rows.take(&self.recursion.ways, r, &mut self.jacobian);
        }
    }

    /// The factors of S, after [`rows_at`](Self::rows_at) and the factors of M.
    pub fn factor_constraints(&mut self) -> Weakest {
        self.rows.factor_constraints(&self.recursion.ways, &self.trees)
    }

    /// The rank of the rows, after [`rows_at`](Self::rows_at).
    pub fn judge(&self) -> RankVerdict {
        self.rows.judge(&self.recursion.ways)
    }

    /// The Jacobian of the first constraints by so many coordinates, after [`rows_at`](Self::rows_at).
    pub fn jacobian(&self, rows: usize, coordinates: usize) -> Vec<T> {
        let mut jacobian = vec![T::ZERO; rows * coordinates];
        for (row, entries) in (0..rows).zip(jacobian.chunks_exact_mut(coordinates)) {
            self.gradient(row).for_each(|(k, g)| entries[k] = g);
        }
        jacobian
    }

    /// Replaces x by S⁻¹ x.
    pub fn solve_rows(&mut self, x: &mut [T]) {
        self.rows.solve(&self.recursion.ways, x);
    }

    /// Writes M⁻¹ Gᵀ x; forgets the load.
    pub fn multiplier_accelerations(&mut self, x: &[T], minv_jt: &mut [T]) {
        let Recursion { links, ways } = &*self.recursion;
        self.trees.unburden();
        self.rows.resist(ways, &mut self.trees, x);
        self.trees.outward_pass(links, minv_jt);
        for entry in minv_jt {
            *entry = -*entry;
        }
    }

    /// True where a row was left out.
    pub fn is_left_out(&self, row: usize) -> bool {
        self.rows.is_left_out(&self.recursion.ways, row)
    }

    /// The coordinates a row depends on, and its Jacobian there.
    #[inline]
    pub fn gradient(&self, row: usize) -> impl Iterator<Item = (usize, T)> + '_ {
        self.rows.gradient(&self.recursion.ways, row)
    }
}
