//! The motion as a power series in time, order by order, with the solve inside.
//!
//! ```text
//! z_k(t) = Σ z_k,m t^m, w_k(t) = Σ w_k,m t^m (not wrapped, t from the step's start), with z' = i w z:
//! known z_0…z_{m+1}, w_0…w_m:
//!   f_m+1 = Σ_{j=0..m} w_j z_{m+1-j},  u_m = (m+1) i f_m+1      z'' without its newest term i a_m z_0
//!   R_m  = Σ_j H_kj u_j,m - F_k,m                               forces F: gravity (m = 0 only), springs, dampers, rows
//!   M_0 a_m = -Σ_{l=0..m} Im(conj(z_l) R_{m-l})                 one factorization of M_0 for all orders
//!   w_{m+1} = a_m/(m+1),  z_{m+2} = i (f_m+1 + w_{m+1} z_0)/(m+2),  R_m += H i a_m z_0
//! ```
//!
//! Nothing but Cauchy products: four real ones a body, no sine beyond the first.  Driven angles enter with
//! the known series of their laws: the coordinates are those of [`elimination`](super::elimination), q = S u +
//! s(t), and the solve is with Sᵀ M_0 S.  What the rows of driven bodies lack of balance is the motors'
//! torque, whose power is integrated with the rest.  Rows that are not eliminated border M_0 with their
//! Jacobian (module `rows`).
//!
//! Loops run over `N` bodies where `N > 0`, so that small sizes are unrolled, to the same bits as `N = 0` for
//! any number.  Mechanisms that are evaluated body by body are expanded body by body: H u and M_0⁻¹ by passes
//! over the trees ([`recursive`](super::recursive)), rows by their ways to the ground, and Cauchy products
//! component by component, so that an order costs O(n) beside them.
//!
//! Source: Jorba & Zou, *A software package for the numerical integration of ODEs by means of high-order
//! Taylor methods*, Experimental Mathematics 14 (2005), for the products; the in-series solve with constant
//! couplings is ours.

mod action;
mod aim;
mod bodywise;
mod coefficient;
mod doubles;
mod drive;
mod factors;
mod friction;
#[cfg(feature = "digits")]
mod long;
mod own;
pub mod polynomial;
mod rows;
mod spring;
mod tape;
mod user;
mod varied;
mod work_integral;

use self::action::ActionSeries;
use self::bodywise::Bodywise;
pub use self::coefficient::{Coefficient, Constants, SeriesNumber, Terms};
pub use self::drive::powers;
use self::factors::{Factors, Scale};
use self::friction::FrictionSeries;
use self::polynomial::{Fractions, UNROLLED, convolve, width, zeros};
use self::rows::RowSeries;
use self::spring::SpringSeries;
use self::user::{At, UserSeries};
use super::Coordinates;
use super::partition::CoordinatePartition;
use super::schur::{self, Weakest};
use super::tree::{self, Tree, size};
use crate::arithmetic::Complex;

/// Power series of a motion about one time; nothing is allocated after [`Series::new`].
#[derive(Clone, Debug)]
pub struct Series<T: SeriesNumber> {
    /// Highest power P of the rates.
    order: usize,
    /// Number of elements n, of which so many are unit vectors; the others are translational coordinates, at
    /// the places of their x.
    elements: usize,
    angles: usize,
    partition: CoordinatePartition<T::Constant>,
    /// False where the coordinates are the bodies' angles themselves.
    is_tied: bool,
    fractions: Fractions<T>,
    /// z: powers 0…P+1, element by element ((P+2) × n).
    pub z: Vec<Complex<T>>,
    /// w: powers 0…P ((P+1) × n) \[rad/s^(m+1)\].
    pub omega: Vec<T>,
    /// Rate of the coordinates u' (powers 0…P) ((P+1) × f).
    pub rate: Vec<T>,
    /// Power of motors and dampers (powers 0…P-1) \[W/s^m\].
    pub power: Vec<T>,
    /// R (P × n) \[N·m/s^m\].
    rest: Vec<Complex<T>>,
    /// s' (powers 0…P) ((P+1) × n).
    drive: Vec<T>,
    /// Torque on each driven body (P × n).
    torque: Vec<T>,
    /// Torques applied to the bodies (P × n).
    applied: Vec<T>,
    /// Angles at the start (n), where torsion springs ask for them.
    phi: Vec<T>,
    springs: Vec<SpringSeries<T>>,
    actions: Vec<ActionSeries<T>>,
    forces: Vec<UserSeries<T>>,
    /// The time at the start \[s\].
    time: T,
    rows: RowSeries<T>,
    /// What slides with dry friction.
    friction: Option<Box<FrictionSeries<T>>>,
    turned: Vec<Complex<T>>,
    bend: Vec<Complex<T>>,
    load: Vec<T>,
    mass: Vec<T>,
    twist: Vec<T>,
    reduced: Vec<T>,
    pivot: Vec<T>,
    solution: Vec<T>,
    /// What stands in place of the matrices where the mechanism is evaluated body by body; they are empty
    /// then.
    bodywise: Option<Box<Bodywise<T>>>,
    /// The bodies' series as factors, where series are multiplied so.
    factors: Factors<T>,
    /// Limbs that powers of the rates are kept to; none where numbers have none.
    limbs: Vec<usize>,
}

impl<T: SeriesNumber> Series<T> {
    /// Room for series of the terms of a mechanism in some coordinates up to this power of the rates, at least
    /// 2.
    pub fn of_terms(terms: &Terms<T::Constant>, coordinates: Coordinates, order: usize) -> Self {
        let mechanism = terms.structure;
        let n = mechanism.coordinates();
        let partition = if coordinates == Coordinates::Independent {
            terms.partition.clone()
        } else {
            CoordinatePartition::free(mechanism)
        };
        let f = partition.count();
        let is_bodywise = !T::HAS_CONSTANTS && !partition.driven();
        let bodywise = is_bodywise.then(|| Bodywise::new(mechanism, order)).flatten().map(Box::new);
        let matrix = |size: usize| zeros(if bodywise.is_some() { 0 } else { size });
        Self {
            order,
            elements: n,
            angles: mechanism.bodies.len(),
            is_tied: partition.driven(),
            fractions: Fractions::new(order + 2),
            z: vec![Complex::ZERO; (order + 2) * n],
            omega: zeros((order + 1) * n),
            rate: zeros((order + 1) * f),
            power: zeros(order),
            rest: vec![Complex::ZERO; order * n],
            drive: zeros((order + 1) * n),
            torque: zeros(order * n),
            applied: zeros(order * n),
            phi: zeros(n),
            actions: terms.actions.iter().map(|action| ActionSeries::new(action, order)).collect(),
            forces: terms.forces.iter().map(|force| UserSeries::new(force, order)).collect(),
            time: T::ZERO,
            springs: terms.springs.iter().map(|spring| SpringSeries::new(spring, order)).collect(),
            rows: RowSeries::new(terms, &partition, order, bodywise.is_none()),
            friction: FrictionSeries::new(mechanism, order).map(Box::new),
            turned: vec![Complex::ZERO; n],
            bend: vec![Complex::ZERO; n],
            load: zeros(n),
            mass: matrix(n * n),
            twist: matrix(n * n),
            reduced: matrix(f * f),
            pivot: matrix(f.max(n)),
            solution: zeros(f),
            bodywise,
            factors: Factors::new(mechanism.bodies.len(), partition.driven(), order),
            limbs: Vec::new(),
            partition,
        }
    }

    /// Keeps coefficients of long numbers to so many limbs each, power by power of the rates.
    pub fn keep(&mut self, limbs: Vec<usize>) {
        self.limbs = limbs;
    }

    /// What the products of factors have in common.
    pub fn rescale(&mut self, scale: Scale<T>) {
        self.factors.scale = scale;
    }

    /// False where powers grow by more than scaled products are made for.
    pub fn is_sound(&self) -> bool {
        self.factors.are_sound()
            && self.springs.iter().all(SpringSeries::is_sound)
            && self.actions.iter().all(ActionSeries::is_sound)
            && self.forces.iter().all(UserSeries::is_sound)
    }

    /// Highest power of the rates.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Number of coordinates f.
    pub fn coordinates(&self) -> usize {
        self.partition.count()
    }

    /// Expands the motion of terms through coordinates `u` \[rad\] (leading part and rest) and rates `u_rate`
    /// \[rad/s\] at time `t`.
    pub fn expand_terms(
        &mut self,
        terms: &Terms<T::Constant>,
        t: T::Time,
        u: &[T],
        u_rest: &[T],
        u_rate: &[T],
    ) {
        self.law_series(terms, t);
        T::begin(self, t, u, u_rest, u_rate);
        T::orders(self, terms, 0);
        if self.turn_rails(terms.structure.units.time) {
            T::begin(self, t, u, u_rest, u_rate);
            T::orders(self, terms, 0);
            self.turn_back();
        }
    }

    /// The row in force nearest to being left out at the start.
    pub fn weakest(&self) -> Weakest {
        self.rows.weakest()
    }

    /// The series of what forces are multiplied by.
    fn law_series(&mut self, terms: &Terms<T::Constant>, t: T::Time) {
        for (series, action) in self.actions.iter_mut().zip(terms.actions) {
            series.begin(action, t);
        }
        self.time = T::moment(t);
    }

    /// Power `m`, below the order, of the multipliers of the rows in force \[N, N·m over s^m\]: all rows, or
    /// all but the motors' where these are eliminated.
    pub fn multipliers(&self, m: usize) -> &[T] {
        self.rows.multipliers(m)
    }

    /// Power zero, and the laws' series.
    fn begin(&mut self, t: T::Time, u: &[T], u_rest: &[T], u_rate: &[T]) {
        let (n, angles) = (self.elements, self.angles);
        self.rate[..u.len()].copy_from_slice(u_rate);
        if self.is_tied {
            self.drive.fill(T::ZERO);
        }
        for (i, dependent_angle) in self.partition.bodies[..angles].iter().enumerate() {
            let mut z = Complex::new(T::ONE, T::ZERO);
            self.omega[i] = T::ZERO;
            if let Some(base) = dependent_angle.base {
                self.phi[i] = u[base];
                let unit = Complex::unit(u[base]);
                // What the leading part leaves out of the angle turns the vector by a first-order rotation.
                z = unit + unit.left().times(u_rest[base]);
                self.omega[i] = u_rate[base];
            }
            for (sign, law) in &dependent_angle.laws {
                let phase = T::phase(law, t);
                z = z * if *sign > 0.0 { phase.unit } else { phase.unit.conj() };
                T::add_law(law, *sign, t, &mut self.drive, i, n);
            }
            self.omega[i] += self.drive[i];
            self.z[i] = z;
        }
        self.partition.translations(u, &mut self.z);
        for (i, dependent_angle) in self.partition.bodies.iter().enumerate().skip(angles) {
            self.omega[i] = dependent_angle.base.map_or(T::ZERO, |base| u_rate[base]);
        }
        self.rows.begin(t);
        let at = At { time: self.time, phi: &self.phi, z: &self.z, omega: &self.omega, n };
        self.rows.advance_aims(0, at, &mut self.load);
    }

    /// The powers from `first` on, by the code for this number of bodies where there is one: in double-double
    /// the arithmetic outweighs the loops.
    fn sized_orders(&mut self, terms: &Terms<T::Constant>, first: usize) {
        if !T::IS_PLAIN {
            return self.orders::<0>(terms, first);
        }
        match if self.angles == self.elements && self.bodywise.is_none() { self.angles } else { 0 } {
            1 => self.orders::<1>(terms, first),
            2 => self.orders::<2>(terms, first),
            3 => self.orders::<3>(terms, first),
            4 => self.orders::<4>(terms, first),
            5 => self.orders::<5>(terms, first),
            6 => self.orders::<6>(terms, first),
            _ => self.orders::<0>(terms, first),
        }
    }

    /// The factors of M_0, and the powers from `first` on.
    #[inline(never)]
    fn orders<const N: usize>(&mut self, terms: &Terms<T::Constant>, first: usize) {
        self.orders_here::<N>(terms, first);
    }

    /// The same, compiled as the place is it is called from.
    #[inline(always)]
    fn orders_here<const N: usize>(&mut self, terms: &Terms<T::Constant>, first: usize) {
        let n = size::<N>(self.elements);
        let angles = size::<N>(self.angles);
        self.factor::<N>(terms);
        if first == 0 {
            // The first power of z needs only rates.
            for i in 0..angles {
                self.z[n + i] = self.z[i].left().times(self.omega[i]);
            }
            for x in (angles..n).step_by(2) {
                self.z[n + x] = Complex::new(self.omega[x], self.omega[x + 1]);
            }
        }
        if let Some(bodywise) = &mut self.bodywise {
            bodywise.begin(&self.omega[..(first + 1) * n], &self.rest[..first * n]);
        }
        if T::HAS_CONSTANTS {
            self.factors.begin(n, &self.z, &self.omega, &self.drive);
        }
        for m in first..self.order {
            if N == 0 && self.bodywise.is_some() {
                self.advance_bodywise(terms, m);
            } else {
                self.bend::<N>(m);
                self.balance::<N>(terms, m);
                self.slide::<N>(terms, m);
            }
            self.work_integral(terms, m);
        }
    }

    /// The factors of M_0, and those of the rows.
    #[inline(always)]
    fn factor<const N: usize>(&mut self, terms: &Terms<T::Constant>) {
        let (n, f) = (size::<N>(self.elements), self.partition.count());
        if N == 0
            && let Some(bodywise) = &mut self.bodywise
        {
            bodywise.factor(&self.z[..n], &self.omega[..n]);
            self.rows.prepare_bodywise(&mut bodywise.evaluation, &self.z[..n]);
            return;
        }
        terms.tree.mass_matrix::<T, N>(&self.z[..n], &mut self.mass, &mut self.twist);
        if self.is_tied {
            self.partition.reduce(&self.mass, &mut self.reduced);
            tree::factor::<T, 0>(f, &mut self.reduced, &mut self.pivot);
        } else {
            self.reduced.copy_from_slice(&self.mass);
            tree::factor::<T, N>(n, &mut self.reduced, &mut self.pivot);
        }
        if !self.rows.is_empty() {
            self.rows.prepare(&self.partition, &self.z[..n], &self.reduced, &self.pivot);
            let diagonal = &terms.structure.tree.diagonal;
            let diagonal = self.partition.independent.iter().map(|&body| diagonal[body]);
            self.rows.mark(schur::is_deep(&self.pivot[..f], diagonal));
        }
    }

    /// f_{m+1} into `turned` and u_m into `bend`; the driven part of a_m, where there is one, is in it.
    #[inline(always)]
    fn bend<const N: usize>(&mut self, m: usize) {
        let (n, angles) = (size::<N>(self.elements), size::<N>(self.angles));
        let (omega, z) = (&self.omega[..(m + 1) * n], &self.z[n..(m + 2) * n]);
        let (turned, bend) = (&mut self.turned[..n], &mut self.bend[..n]);
        let factor = T::of((m + 1) as f64);
        bend[angles..].fill(Complex::ZERO);
        if T::HAS_CONSTANTS {
            let Factors { scale, z, omega, .. } = &self.factors;
            for i in 0..angles {
                let sum = z[i].times(&omega[i], scale, m + 1, 1..=m + 1);
                let left = sum.left();
                let times = |x: T| x.scale((m + 1) as f64);
                (turned[i], bend[i]) = (sum, Complex::new(times(left.re), times(left.im)));
            }
            return;
        }
        let mut first = 0;
        while first < angles {
            let sums = convolve::<N, _, _, _>(n, first, omega, z, |w, z| z.times(w));
            for i in 0..width::<N>() {
                turned[first + i] = sums[i];
                bend[first + i] = sums[i].left().times(factor);
            }
            first += width::<N>();
        }
    }

    /// R_m, and the load -Σ Im(conj(z) R) of this order into `load`.
    #[inline(always)]
    fn balance<const N: usize>(&mut self, terms: &Terms<T::Constant>, m: usize) {
        let (n, angles) = (size::<N>(self.elements), size::<N>(self.angles));
        self.load[..n].fill(T::ZERO);
        if self.is_tied {
            // The known part of a_m: s'' of this order.
            for i in 0..angles {
                let given = self.drive[(m + 1) * n + i] * T::of((m + 1) as f64);
                self.load[i] = -given.by(terms.tree.diagonal[i]);
                self.bend[i] += self.z[i].left().times(given);
            }
        }
        self.gravity_forces(terms, m);
        mass_terms::<T, N>(terms.tree, &self.bend, &mut self.rest[m * n..(m + 1) * n]);
        self.force(terms, m);
        let (before, rest) = self.rest.split_at_mut(m * n);
        let rest = &mut rest[..n];
        let (z, load) = (&self.z[..(m + 1) * n], &mut self.load[..n]);
        for x in (angles..n).step_by(2) {
            load[x] -= rest[x].re;
            load[x + 1] -= rest[x].im;
        }
        if T::HAS_CONSTANTS {
            // Of l = 0 only, R is not complete yet.
            let Factors { scale, z: factors, rest: known, .. } = &self.factors;
            for k in 0..angles {
                let sum = factors[k].cross(&known[k], scale, m, 1..=m);
                load[k] -= sum + z[k].cross(rest[k]);
            }
            return;
        }
        let mut first = 0;
        while first < angles {
            // Of l = 0 only, R is not complete yet.
            let sums: [T; UNROLLED] =
                convolve::<N, _, _, _>(n, first, &z[n..], before, |z, rest| z.cross(rest));
            for i in 0..width::<N>() {
                let k = first + i;
                load[k] -= sums[i] + z[k].cross(rest[k]);
            }
            first += width::<N>();
        }
    }

    /// Gravity in R_m, and nothing else.
    #[inline(always)]
    fn gravity_forces(&mut self, terms: &Terms<T::Constant>, m: usize) {
        for (rest, &weight) in self.rest[m * self.elements..].iter_mut().zip(&terms.tree.weight) {
            *rest = if m == 0 { -Complex::of(weight) } else { Complex::ZERO };
        }
    }

    /// Adds what all other forces leave in R_m, and torques to the load.
    #[inline(always)]
    fn force(&mut self, terms: &Terms<T::Constant>, m: usize) {
        let n = self.elements;
        let rest = &mut self.rest[m * n..(m + 1) * n];
        let mut on_bodies = self.friction.as_mut().map(|friction| &mut friction.applied[..]);
        if let Some(on_bodies) = &mut on_bodies {
            on_bodies.fill(Complex::ZERO);
        }
        for (spring, series) in terms.springs.iter().zip(&mut self.springs) {
            let force = series.force(spring, m, &self.z, n, &self.factors.scale);
            spring.span.spread(force, |k, force| rest[k] -= force);
            if let Some(on_bodies) = &mut on_bodies {
                let ends = spring.bodies.iter().zip([force, -force]);
                ends.for_each(|(body, force)| body.iter().for_each(|&body| on_bodies[body] += force));
            }
        }
        if !terms.torsions.is_empty() || !self.actions.is_empty() || !self.forces.is_empty() {
            let applied = &mut self.applied[m * n..(m + 1) * n];
            applied.fill(T::ZERO);
            for torsion in terms.torsions {
                torsion.pull(action::twist(torsion, m, &self.phi, &self.omega, n), applied);
            }
            for (action, series) in terms.actions.iter().zip(&mut self.actions) {
                series.act(action, m, &self.z, n, (rest, applied), &self.factors.scale);
                if let Some(on_bodies) = &mut on_bodies {
                    on_bodies[action.body] += series.force(m);
                }
            }
            let at = At { time: self.time, phi: &self.phi, z: &self.z, omega: &self.omega, n };
            for (force, series) in terms.forces.iter().zip(&mut self.forces) {
                series.act(force, m, at, (&mut *rest, &mut *applied), &self.factors.scale);
                if let Some(on_bodies) = &mut on_bodies {
                    series.forces(force, m, |body, force| on_bodies[body] += force);
                }
            }
            for (load, &applied) in self.load.iter_mut().zip(applied.iter()) {
                *load += applied;
            }
        }
        self.rows.geometric_terms(m, &self.z, n, rest);
        if m > 0 {
            let at = At { time: self.time, phi: &self.phi, z: &self.z, omega: &self.omega, n };
            self.rows.advance_aims(m, at, &mut self.load);
        }
        if let Some(friction) = &self.friction {
            friction.geometric_terms(m, &self.z, n, rest);
        }
    }

    /// a_m from the loads, the newest powers of w and z, and R_m completed.
    #[inline(always)]
    fn solve<const N: usize>(&mut self, terms: &Terms<T::Constant>, m: usize) {
        let (n, f) = (size::<N>(self.elements), self.partition.count());
        let angles = size::<N>(self.angles);
        let rest = &mut self.rest[m * n..(m + 1) * n];
        if self.is_tied {
            self.partition.gather(&self.load, &mut self.solution);
            tree::solve::<T, 0>(f, &self.reduced, &self.pivot, &mut self.solution);
        } else {
            self.solution[..n].copy_from_slice(&self.load[..n]);
            tree::solve::<T, N>(n, &self.reduced, &self.pivot, &mut self.solution);
        }
        if !self.rows.is_empty() {
            self.rows.solve(m, &self.z, &self.bend, &mut self.solution);
            self.rows.push(m, &self.z[..n], rest);
        }
        if let Some(&limbs) = self.limbs.get(m + 1) {
            self.solution.iter_mut().for_each(|x| *x = x.kept(limbs));
            self.turned.iter_mut().for_each(|x| *x = Complex::new(x.re.kept(limbs), x.im.kept(limbs)));
        }
        for c in 0..f {
            self.rate[(m + 1) * f + c] = self.fractions.over(self.solution[c], m + 1);
        }
        let (known, newest) = self.z.split_at_mut((m + 2) * n);
        let (z, newest) = (&known[..n], &mut newest[..n]);
        let omega = &mut self.omega[(m + 1) * n..(m + 2) * n];
        if self.is_tied {
            for (i, dependent_angle) in self.partition.bodies.iter().enumerate() {
                let (solved, rate) = dependent_angle
                    .base
                    .map_or((T::ZERO, T::ZERO), |base| (self.solution[base], self.rate[(m + 1) * f + base]));
                omega[i] = rate + self.drive[(m + 1) * n + i];
                self.bend[i] =
                    if i < angles { z[i].left().times(solved) } else { Complex::new(solved, T::ZERO) };
            }
            for x in (angles..n).step_by(2) {
                self.bend[x].im = self.bend[x + 1].re;
            }
        } else {
            omega.copy_from_slice(&self.rate[(m + 1) * n..(m + 2) * n]);
            for i in 0..angles {
                self.bend[i] = z[i].left().times(self.solution[i]);
            }
            for x in (angles..n).step_by(2) {
                self.bend[x] = Complex::new(self.solution[x], self.solution[x + 1]);
            }
        }
        for x in (angles..n).step_by(2) {
            newest[x] = self.fractions.vector_over(Complex::new(omega[x], omega[x + 1]), m + 2);
        }
        for i in 0..angles {
            newest[i] = self.fractions.vector_over((self.turned[i] + z[i].times(omega[i])).left(), m + 2);
        }
        mass_terms::<T, N>(terms.tree, &self.bend, rest);
        if T::HAS_CONSTANTS {
            self.factors.push(newest, omega, rest);
        }
    }
}

/// Adds H x to `rest`, without the diagonal.
#[inline(always)]
fn mass_terms<T: SeriesNumber, const N: usize>(
    tree: &Tree<T::Constant>,
    x: &[Complex<T>],
    rest: &mut [Complex<T>],
) {
    let n = size::<N>(tree.coordinates);
    let (coupling, x, rest) = (&tree.coupling[..n * n], &x[..n], &mut rest[..n]);
    for i in 0..n {
        for j in i + 1..n {
            let h = coupling[i * n + j];
            if tree.off_axis {
                rest[i] += x[j].turn(h);
                rest[j] += x[i].turn(h.conj());
            } else {
                rest[i] += Complex::new(x[j].re.by(h.re), x[j].im.by(h.re));
                rest[j] += Complex::new(x[i].re.by(h.re), x[i].im.by(h.re));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::DoubleDouble;
    use crate::dynamics::{Mechanism, Time};
    use crate::scene::read_scene;

    fn mechanism(name: &str) -> (Mechanism, Vec<f64>, Vec<f64>) {
        let path =
            std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/scenes/{name}.json"));
        let scene = read_scene(&path, &[]).expect("a shipped scene");
        let (phi, omega) = scene.start.iter().map(|start| (start.phi, start.omega)).unzip();
        (Mechanism::new(&scene).expect("a valid scene"), phi, omega)
    }

    #[test]
    fn sizes_known_to_the_compiler_give_the_same_bits() {
        for name in ["spring", "motor_sine", "wall"] {
            let (mechanism, phi, omega) = mechanism(name);
            for coordinates in [Coordinates::All, Coordinates::Independent] {
                let mut series = Series::<f64>::new(&mechanism, coordinates, 20);
                let f = series.coordinates();
                let from = 2 - f;
                series.begin(Time::default(), &phi[from..], &[0.0; 2][from..], &omega[from..]);
                let mut other = series.clone();
                series.orders::<2>(&mechanism.terms(), 0);
                other.orders::<0>(&mechanism.terms(), 0);
                assert!(
                    series.z == other.z && series.omega == other.omega && series.power == other.power,
                    "{name}"
                );
            }
        }
    }

    #[test]
    fn powers_after_exact_ones_are_those_of_a_plain_expansion() {
        for name in ["spring", "motor_sine", "branch"] {
            let (mechanism, phi, omega) = mechanism(name);
            let exact = |x: &[f64]| x.iter().map(|&x| DoubleDouble::from(x)).collect::<Vec<_>>();
            let none = vec![0.0; phi.len()];
            let mut plain = Series::<f64>::new(&mechanism, Coordinates::All, 16);
            plain.expand(&mechanism, Time::default(), &phi, &none, &omega);
            let mut first = Series::<DoubleDouble>::new(&mechanism, Coordinates::All, 6);
            first.expand(&mechanism, Time::default(), &exact(&phi), &exact(&none), &exact(&omega));
            let mut extended = plain.clone();
            extended.carry_on(&mechanism, Time::default(), &phi, &none, &omega, &first);
            for (found, expected) in [(&extended.omega, &plain.omega), (&extended.power, &plain.power)] {
                let largest = expected.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                assert!(
                    found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9 * largest.max(1e-9)),
                    "{name}"
                );
            }
            assert_ne!(extended.omega, plain.omega);
        }
    }
}
