//! The motion as a power series in time, order by order, with the solve inside.
//!
//! ```text
//! z_k(t) = Σ z_k,m t^m, w_k(t) = Σ w_k,m t^m (not wrapped, t from the step's start), with z' = i w z:
//! known z_0…z_{m+1}, w_0…w_m:
//!   f_m+1 = Σ_{j=0..m} w_j z_{m+1-j},  u_m = (m+1) i f_m+1      z'' without its newest term i a_m z_0
//!   R_m  = Σ_j H_kj u_j,m - F_k,m
//!       forces F: gravity (m = 0 only), springs, dampers, rows
//!   M_0 a_m = -Σ_{l=0..m} Im(conj(z_l) R_{m-l})                 one factorization of M_0 for all orders
//!   w_{m+1} = a_m/(m+1),  z_{m+2} = i (f_m+1 + w_{m+1} z_0)/(m+2),  R_m += H i a_m z_0
//! ```
//!
//! Nothing but Cauchy products: four real ones a body, no sine beyond the first.  Driven angles enter with
//! the known series of their laws: the coordinates are those of [`elimination`](super::elimination), q = S u
//! + s(t), and the solve is with Sᵀ M_0 S.  What the rows of driven bodies lack of balance is the motors'
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
pub mod columns;
mod doubles;
mod drive;
mod factors;
mod friction;
pub mod lanes;
#[cfg(feature = "digits")]
mod long;
mod order;
mod own;
pub mod polynomial;
mod products;
mod rows;
mod slots;
mod spring;
mod tangent;
mod tape;
mod user;
pub mod varied;
mod work_integral;

use self::action::ActionSeries;
use self::aim::AimSeries;
use self::bodywise::Bodywise;
pub use self::coefficient::{Coefficient, Constants, FrictionTerms, SeriesNumber, Terms};
pub use self::drive::powers;
use self::factors::{BodyFactors, Scale};
use self::friction::FrictionSeries;
pub use self::friction::Slides;
use self::polynomial::{Fractions, zeros};
use self::rows::RowSeries;
use self::spring::SpringSeries;
pub use self::user::FormulaSeries;
use self::user::{PowersAt, UserSeries};
use super::Coordinates;
use super::constraint::Aim;
use super::force::UserForce;
use super::partition::CoordinatePartition;
use super::schur::Weakest;
use super::tree::size;
use crate::arithmetic::Complex;
use std::sync::Arc;

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
    /// R (P × n) \[N·m/s^m\]; of numbers whose series are factors the present power alone.
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
    /// M_0⁻¹ (f × f) and the right side it is multiplied with, for numbers that have it.
    inverse: Vec<T>,
    right: Vec<T>,
    /// What stands in place of the matrices where the mechanism is evaluated body by body; they are empty
    /// then.
    bodywise: Option<Box<Bodywise<T>>>,
    /// The bodies' series as factors, where series are multiplied so.
    factors: BodyFactors<T>,
    /// Limbs that powers of the rates are kept to; none where numbers have none.
    limbs: Vec<usize>,
}

impl<T: SeriesNumber> Series<T> {
    /// The powers of a formula in the motion this is of, from a time and angles on.
    pub fn formula<'a>(
        &self,
        formula: &UserForce<T::Constant>,
        series: &'a mut FormulaSeries<T>,
        (time, phi): (T, &[T]),
    ) -> &'a [T] {
        let at = PowersAt { time, phi, z: &self.z, omega: &self.omega, n: self.elements };
        series.values(formula, self.order, at)
    }

    /// The powers of a formula of time and place in that motion, to that of the unit vectors.
    pub fn aim(&self, aim: &Arc<Aim<T::Constant>>) -> Vec<T> {
        let n = self.elements.max(1);
        let order = (self.z.len() / n).saturating_sub(1);
        let at = PowersAt { time: self.time, phi: &self.phi, z: &self.z, omega: &self.omega, n };
        AimSeries::new(aim, self.angles, order).values(order, at).to_vec()
    }

    /// Room for series of the terms of a mechanism in some coordinates up to this power of the rates, at
    /// least
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
        let mut factors = BodyFactors::new(mechanism.bodies.len(), partition.driven(), order);
        factors.couple(terms.tree);
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
            rest: vec![Complex::ZERO; if T::HAS_CONSTANTS { n } else { order * n }],
            drive: zeros((order + 1) * n),
            torque: zeros(order * n),
            applied: zeros(order * n),
            phi: zeros(n),
            actions: terms.actions.iter().map(|action| ActionSeries::new(action, order)).collect(),
            forces: terms.forces.iter().map(|force| UserSeries::new(force, order)).collect(),
            time: T::ZERO,
            springs: terms.springs.iter().map(|spring| SpringSeries::new(spring, order)).collect(),
            rows: RowSeries::new(terms, &partition, order, bodywise.is_none()),
            friction: FrictionSeries::new(terms, order).map(Box::new),
            turned: vec![Complex::ZERO; n],
            bend: vec![Complex::ZERO; n],
            load: zeros(n),
            mass: matrix(n * n),
            twist: matrix(n * n),
            reduced: matrix(f * f),
            pivot: matrix(f.max(n)),
            solution: zeros(f),
            inverse: zeros(if T::HAS_INVERSE { f * f } else { 0 }),
            right: zeros(if T::HAS_INVERSE { f } else { 0 }),
            bodywise,
            factors,
            limbs: Vec::new(),
            partition,
        }
    }

    /// Takes the constants of other terms of the same structure.
    pub fn renew(&mut self, terms: &Terms<T::Constant>) {
        if self.is_tied {
            self.partition.clone_from(terms.partition);
        }
        self.factors.couple(terms.tree);
        self.forces = terms.forces.iter().map(|force| UserSeries::new(force, self.order)).collect();
        self.rows.renew(terms, &self.partition);
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

    /// Expands up to another power of the rates from here on, at most the one there is room for.
    pub fn expand_up_to(&mut self, order: usize) {
        self.order = order.min(self.omega.len() / self.elements - 1);
    }

    /// Number of elements n.
    pub fn elements(&self) -> usize {
        self.elements
    }

    /// Number of coordinates f.
    pub fn coordinates(&self) -> usize {
        self.partition.count()
    }

    /// Expands the motion of terms through coordinates `u` \[rad\] (leading part and rest) and rates `u_rate`
    /// \[rad/s\] at time `t`.
    #[inline(always)]
    pub fn expand_terms(
        &mut self,
        terms: &Terms<T::Constant>,
        t: T::Time,
        u: &[T],
        u_rest: &[T],
        u_rate: &[T],
    ) {
        self.law_series(terms, t);
        // A loop, and not the same twice: what is compiled here is large.
        let mut has_reversals = false;
        loop {
            T::begin(self, t, u, u_rest, u_rate);
            T::orders(self, terms, 0);
            if has_reversals {
                return self.forget_reversals();
            }
            has_reversals = self.find_reversals(terms.structure.units.time);
            if !has_reversals {
                return;
            }
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
    #[inline(always)]
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
        let at = PowersAt { time: self.time, phi: &self.phi, z: &self.z, omega: &self.omega, n };
        self.rows.advance_aims(0, at, &self.factors.scale, &mut self.load);
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
                if T::HAS_CONSTANTS {
                    self.push_factors(m);
                }
            }
            if T::HAS_WORK {
                self.work_integral(terms, m);
            }
        }
    }
}

#[cfg(test)]
mod tests;
