//! Constraint equations in the series: the multipliers are solved for with every order.
//!
//! ```text
//! linear in elements:   C = c + Σ g_k·e_k - s,
//!     J_k = g_k·(i z_k,0),   J a_m = s''_m - Σ g_k·u_k,m     force lambda g_k on e_k
//! bilinear in them:     C = Re(conj(e_j) h e_k),    products of the powers of e_j and e_k,
//!     force lambda conj(h) e_j on e_k
//! less an aim f:           - f(t, q) in C, see [`aim`](super::aim)
//! a given angle:        C = q_a - q_b - theta,      J = (1, -1),
//!     J a_m = theta''_m          torque lambda
//! M_0 a_m + Jᵀ lambda_m = load_m:   S = J M_0⁻¹ Jᵀ,   S lambda_m = J M_0⁻¹ load_m - (J a)_m
//! ```
//!
//! S is factored once a step; where the mechanism is evaluated body by body, in its envelope.  The products
//! of earlier multipliers with later powers of z enter through the loads like those of any force.

mod bordered;
mod measures;

pub use self::measures::RowMeasures;
use self::measures::{growing, in_force, measures};
use super::aim::AimSeries;
use super::coefficient::{SeriesNumber, Terms};
use super::factors::Scale;
use super::polynomial::{copy, zeros};
use super::user::PowersAt;
use crate::arithmetic::{Complex, DoubleDouble, Over, Real};
use crate::dynamics::constraint::{ConstraintEquation, RowMeasure};
use crate::dynamics::law::Law;
use crate::dynamics::partition::CoordinatePartition;
use crate::dynamics::quadratic::Quadratic;
use crate::dynamics::rank::Metric;
use crate::dynamics::recursive::Evaluation;
use crate::dynamics::schur::{self, NEAR, Weakest};
use crate::dynamics::tree;

/// Rows in force and their multipliers.
#[derive(Clone, Debug)]
pub struct RowSeries<T: SeriesNumber> {
    kinds: Vec<Kind<T>>,
    coordinates: usize,
    /// J by coordinates, and M_0⁻¹ Jᵀ (r × f).
    jacobian: Vec<T>,
    minv_jt: Vec<T>,
    schur: Vec<T>,
    pivot: Vec<T>,
    /// What pivots are measured against (r), where rows may be left out.
    scale: Vec<f64>,
    /// What the rank of the rows is measured with.
    metric: Metric,
    /// The row nearest to being left out at the start.
    weakest: Weakest,
    /// The inverse of [`border_inverse`](Self::border_inverse) (r + f by as many) and a right side of it, for
    /// numbers that have it.
    border: Vec<T>,
    right: Vec<T>,
    found: Vec<T>,
    /// Which rows do work, for these numbers.
    works: Vec<bool>,
    /// The coordinates whose magnitudes a row's rounding grows with, for these numbers: angles with all their
    /// turns, and places.
    growing: Vec<Vec<usize>>,
    /// Where rows are to be put back to, see [`face`](Self::face).
    goals: Vec<Complex<T>>,
    /// lambda: powers 0…P-1 (P × r).
    multiplier: Vec<T>,
}

/// A row as the series sees it.
#[derive(Clone, Debug)]
enum Kind<T: SeriesNumber> {
    /// The function, the powers of s', and an aim that is taken off it.
    Place {
        place: Quadratic<T::Constant>,
        law: Option<Law<T::Constant>>,
        drive: Vec<T>,
        aim: Option<Box<AimSeries<T>>>,
    },
    /// The bodies a and b, and the powers of theta' and of its own rate w_a - w_b.
    Angle { body: usize, base: Option<usize>, law: Law<T::Constant>, drive: Vec<T>, speed: Vec<T> },
}

impl<T: SeriesNumber> Kind<T> {
    /// Parts of dC/dq, coordinate by coordinate; a coordinate may come up more than once.
    #[inline(always)]
    fn slopes(&self, z: &[Complex<T>], mut each: impl FnMut(usize, T)) {
        match self {
            Self::Place { place, aim, .. } => {
                place.slopes(z, &mut each);
                aim.iter().for_each(|aim| aim.slopes(|k, slope| each(k, -slope)));
            }
            Self::Angle { body, base, .. } => {
                each(*body, T::ONE);
                base.iter().for_each(|&base| each(base, -T::ONE));
            }
        }
    }

    /// `free`, and what else there is of power m of the second derivative, less that of its law.
    #[inline(always)]
    fn known(&self, m: usize, z: &[Complex<T>], bend: &[Complex<T>], free: T) -> T {
        match self {
            Self::Place { place, drive, aim, .. } => {
                let mut known = free + bent(place, m, z, bend);
                if let Some(aim) = aim {
                    known -= aim.known;
                }
                drive.get(m + 1).map_or(known, |&drive| known - drive.scale((m + 1) as f64))
            }
            Self::Angle { drive, .. } => free - drive[m + 1].scale((m + 1) as f64),
        }
    }
}

impl<T: SeriesNumber> RowSeries<T> {
    /// Room for the rows that `partition` do not fulfil already: all but the motors' where these are
    /// eliminated. Without matrices where `is_dense` is false.
    pub fn new(
        terms: &Terms<T::Constant>,
        partition: &CoordinatePartition<T::Constant>,
        order: usize,
        is_dense: bool,
    ) -> Self {
        let mechanism = terms.structure;
        let kind = |row: &ConstraintEquation<T::Constant>| match (&row.measure, &row.law) {
            (RowMeasure::Angle { .. }, _) if partition.driven() => None,
            (&RowMeasure::Angle { body, base }, law) => {
                let law = law.clone().unwrap_or_default();
                Some(Kind::Angle { body, base, law, drive: zeros(order + 1), speed: zeros(order + 1) })
            }
            (RowMeasure::Place(place), law) => Some(Kind::Place {
                place: place.clone(),
                law: law.clone(),
                drive: zeros(if law.is_some() { order + 1 } else { 0 }),
                aim: (row.aim.as_ref())
                    .map(|aim| Box::new(AimSeries::new(aim, mechanism.bodies.len(), order))),
            }),
        };
        let in_force = in_force(&mechanism.constraints, partition);
        let works = in_force.iter().map(|row| row.is_motor()).collect();
        let growing = growing(&in_force);
        // Where each lane has its own, whoever looks at the pivots has them.
        let (scale, metric) =
            if T::HAS_BORDER { Default::default() } else { measures(mechanism, partition, &in_force) };
        let kinds: Vec<Kind<T>> = terms.constraints.iter().filter_map(kind).collect();
        let (r, f) = (kinds.len(), partition.count());
        let matrix = |size: usize| zeros(if is_dense { size } else { 0 });
        Self {
            kinds,
            coordinates: f,
            jacobian: matrix(r * f),
            minv_jt: matrix(r * f),
            schur: matrix(r * r),
            pivot: matrix(r),
            scale,
            metric,
            weakest: Weakest::NONE,
            border: zeros(if T::HAS_BORDER { (r + f) * (r + f) } else { 0 }),
            right: zeros(if T::HAS_BORDER { r + f } else { 0 }),
            found: zeros(if T::HAS_BORDER { r + f } else { 0 }),
            goals: Vec::new(),
            works,
            growing,
            multiplier: zeros(order * r),
        }
    }

    /// True where no row is in force.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// The row in force nearest to being left out at the start of the series.
    pub fn weakest(&self) -> Weakest {
        self.weakest
    }

    /// Marks S as delicate where M is.
    #[inline(always)]
    pub fn mark(&mut self, is_deep: bool) {
        self.weakest.is_delicate |= is_deep;
    }

    /// Power `m` of the multipliers of the rows in force \[N, N·m over s^m\].
    pub fn multipliers(&self, m: usize) -> &[T] {
        let rows = self.kinds.len();
        &self.multiplier[m * rows..(m + 1) * rows]
    }

    /// The laws' series at time `t`.
    #[inline(always)]
    pub fn begin(&mut self, t: T::Time) {
        for kind in &mut self.kinds {
            if let Kind::Angle { law, drive, .. } | Kind::Place { law: Some(law), drive, .. } = kind {
                drive.fill(T::ZERO);
                T::add_law(law, 1.0, t, drive, 0, 1);
            }
        }
    }

    /// Power m of the aims, and what multipliers below that power exert on the coordinates by them into
    /// `load`.
    #[inline(always)]
    pub fn advance_aims(&mut self, m: usize, at: PowersAt<T>, scale: &Scale<T>, load: &mut [T]) {
        let r = self.kinds.len();
        for (i, kind) in self.kinds.iter_mut().enumerate() {
            if let Kind::Place { aim: Some(aim), .. } = kind {
                aim.advance(m, at, scale);
                aim.turning_terms(m, |l| self.multiplier[l * r + i], load);
            }
        }
    }

    /// J and S, from the factors of the mass matrix of the coordinates.
    #[inline(always)]
    pub fn prepare(
        &mut self,
        partition: &CoordinatePartition<T::Constant>,
        z: &[Complex<T>],
        mass: &[T],
        pivot: &[T],
    ) {
        let (r, f) = (self.kinds.len(), self.coordinates);
        self.jacobian.fill(T::ZERO);
        for (kind, jacobian) in self.kinds.iter().zip(self.jacobian.chunks_exact_mut(f.max(1))) {
            kind.slopes(z, |body, entry| {
                if let Some(base) = partition.bodies[body].base {
                    jacobian[base] += entry;
                }
            });
        }
        self.minv_jt.copy_from_slice(&self.jacobian);
        for minv_jt in self.minv_jt.chunks_exact_mut(f.max(1)) {
            tree::solve::<T, 0>(f, mass, pivot, minv_jt);
        }
        schur::product(r, &self.jacobian, &self.minv_jt, &mut self.schur);
        self.weakest = schur::factor::<T, 0>(r, &mut self.schur, &mut self.pivot, &self.scale);
        if self.weakest.share < NEAR && T::DROPPED == schur::DROPPED {
            let rows = [&self.jacobian[..], &self.minv_jt[..]];
            self.weakest = schur::look_closer(
                &self.metric,
                &self.scale,
                self.weakest,
                rows,
                &mut self.schur,
                &mut self.pivot,
            );
        }
    }

    /// The same body by body, where all coordinates are free.
    pub fn prepare_bodywise(&mut self, evaluation: &mut Evaluation<T>, z: &[Complex<T>]) {
        if self.is_empty() {
            return;
        }
        for (r, kind) in self.kinds.iter().enumerate() {
            evaluation.take(r, |jacobian| kind.slopes(z, |coordinate, entry| jacobian[coordinate] += entry));
        }
        self.weakest = evaluation.factor_constraints();
    }

    /// What is known of power m of every row's second derivative, less that of its law: where its multipliers
    /// will be.
    #[inline(always)]
    pub fn known(&mut self, m: usize, z: &[Complex<T>], bend: &[Complex<T>]) -> &mut [T] {
        let r = self.kinds.len();
        let multiplier = &mut self.multiplier[m * r..(m + 1) * r];
        for (multiplier, kind) in multiplier.iter_mut().zip(&self.kinds) {
            *multiplier = kind.known(m, z, bend, T::ZERO);
        }
        multiplier
    }

    /// Multipliers of power m from the free accelerations of the coordinates, which become the constrained
    /// ones.
    #[inline(always)]
    pub fn solve(&mut self, m: usize, z: &[Complex<T>], bend: &[Complex<T>], solution: &mut [T]) {
        let (r, f) = (self.kinds.len(), self.coordinates);
        let multiplier = &mut self.multiplier[m * r..(m + 1) * r];
        for (i, kind) in self.kinds.iter().enumerate() {
            let mut free = T::ZERO;
            for c in 0..f {
                free += self.jacobian[i * f + c] * solution[c];
            }
            multiplier[i] = kind.known(m, z, bend, free);
        }
        tree::solve::<T, 0>(r, &self.schur, &self.pivot, multiplier);
        for (i, &multiplier) in multiplier.iter().enumerate() {
            for c in 0..f {
                solution[c] -= self.minv_jt[i * f + c] * multiplier;
            }
        }
    }

    /// Adds what the multipliers of power m put on the unit vectors to `rest`.
    #[inline(always)]
    pub fn push(&self, m: usize, z: &[Complex<T>], rest: &mut [Complex<T>]) {
        let r = self.kinds.len();
        for (kind, &multiplier) in self.kinds.iter().zip(&self.multiplier[m * r..]) {
            let Kind::Place { place, .. } = kind else { continue };
            for &(k, g) in &place.linear {
                rest[k] += Complex::of(g).times(multiplier);
            }
            for &(j, k, h) in &place.bilinear {
                rest[k] += z[j].turn(h.conj()).times(multiplier);
                rest[j] += z[k].turn(h).times(multiplier);
            }
        }
    }

    /// Adds what the multipliers below power m put on the elements as these turn to `rest`: only gradients
    /// that are not constant.
    #[inline(always)]
    pub fn geometric_terms(&self, m: usize, z: &[Complex<T>], n: usize, rest: &mut [Complex<T>]) {
        let r = self.kinds.len();
        for (i, kind) in self.kinds.iter().enumerate() {
            let Kind::Place { place, .. } = kind else { continue };
            turning_terms(place, m, z, n, |l| self.multiplier[l * r + i], rest);
        }
    }

    /// Power m of the motors' power \[W/s^m\]; what stands still does no work.
    #[inline(always)]
    pub fn power(&mut self, m: usize, omega: &[T]) -> T {
        if T::HAS_BORDER { self.power_of_motors(m, omega) } else { self.power_of_rows(m, omega) }
    }

    #[inline(never)]
    fn power_of_rows(&mut self, m: usize, omega: &[T]) -> T {
        let (r, mut power) = (self.kinds.len(), T::ZERO);
        for (i, kind) in self.kinds.iter_mut().enumerate() {
            if let Kind::Angle { body, base, speed, .. } = kind {
                speed[m] = base.map_or(omega[*body], |base| omega[*body] - omega[base]);
                power -= with_rates(&self.multiplier[i..], r, &speed[..=m]);
            } else if let Kind::Place { drive, law: Some(_), .. } = kind {
                power -= with_rates(&self.multiplier[i..], r, &drive[..=m]);
            } else if let Kind::Place { aim: Some(aim), .. } = kind
                && let Some(drive) = aim.drive()
            {
                power -= match *drive {
                    [constant] => self.multiplier[i + m * r] * constant,
                    _ => with_rates(&self.multiplier[i..], r, &drive[..=m]),
                };
            }
        }
        power
    }

    /// The first powers from another series.
    pub fn take(&mut self, other: &RowSeries<DoubleDouble>) {
        copy(&mut self.multiplier, &other.multiplier);
        for (kind, other) in self.kinds.iter_mut().zip(&other.kinds) {
            if let (Kind::Angle { speed, .. }, Kind::Angle { speed: other, .. }) = (&mut *kind, other) {
                copy(speed, other);
            }
            if let (Kind::Place { aim: Some(aim), .. }, Kind::Place { aim: Some(other), .. }) = (kind, other)
            {
                aim.take(other);
            }
        }
    }
}

impl RowSeries<f64> {
    /// Borders M⁻¹, which is in the first rows and columns, with the rows: accelerations and multipliers of
    /// a right side b and of rows that ask for c are `[[A, B], [Bᵀ, -K]]` (b, c), with K = S⁻¹, B = M⁻¹ Jᵀ K,
    /// A = M⁻¹ - B J M⁻¹.
    pub fn border(&self, response: &mut [f64]) {
        let (r, f) = (self.kinds.len(), self.coordinates);
        let size = r + f;
        let (bodies, rows) = response.split_at_mut(f * size);
        for (s, row) in rows.chunks_exact_mut(size).enumerate() {
            let (b, k) = row.split_at_mut(f);
            k.fill(0.0);
            k[s] = 1.0;
            tree::solve::<f64, 0>(r, &self.schur, &self.pivot, k);
            b.fill(0.0);
            for (k, minv_jt) in k.iter_mut().zip(self.minv_jt.chunks_exact(f)) {
                for (b, minv_jt) in b.iter_mut().zip(minv_jt) {
                    *b += *k * minv_jt;
                }
                *k = -*k;
            }
            for (i, body) in bodies.chunks_exact_mut(size).enumerate() {
                body[f + s] = b[i];
                let minv_jt = self.minv_jt[s * f + i];
                for (a, b) in body.iter_mut().zip(b.iter()) {
                    *a -= minv_jt * b;
                }
            }
        }
    }
}

/// Adds what the multipliers of a function below power m put on the elements as these turn to `rest`.
#[inline(always)]
pub fn turning_terms<T: Over<C>, C: Real>(
    place: &Quadratic<C>,
    m: usize,
    z: &[Complex<T>],
    n: usize,
    multiplier: impl Fn(usize) -> T,
    rest: &mut [Complex<T>],
) {
    for &(j, k, h) in &place.bilinear {
        for l in 0..m {
            let (multiplier, z) = (multiplier(l), &z[(m - l) * n..(m - l + 1) * n]);
            rest[k] += z[j].turn(h.conj()).times(multiplier);
            rest[j] += z[k].turn(h).times(multiplier);
        }
    }
}

/// Power m of the product of a row's multiplier, every `rows`-th number, and a series of m + 1 powers.
fn with_rates<T: Real>(multiplier: &[T], rows: usize, rates: &[T]) -> T {
    let pairs = multiplier.iter().step_by(rows).zip(rates.iter().rev());
    if T::HAS_CONSTANTS {
        T::sum_of_products(pairs)
    } else {
        pairs.fold(T::ZERO, |sum, (&a, &b)| sum + a * b)
    }
}

/// Power m of a row's second derivative without the accelerations of power m: `bend` is what e'' has without
/// them.
#[inline(always)]
fn bent<T: Real + Over<C>, C: Real>(
    place: &Quadratic<C>,
    m: usize,
    z: &[Complex<T>],
    bend: &[Complex<T>],
) -> T {
    let n = bend.len();
    let mut sum = T::ZERO;
    for &(k, g) in &place.linear {
        sum += Complex::of(g).dot(bend[k]);
    }
    for &(j, k, h) in &place.bilinear {
        sum += z[j].turn(h.conj()).dot(bend[k]);
        sum += z[k].turn(h).dot(bend[j]);
    }
    let mut products = T::ZERO;
    for &(j, k, h) in &place.bilinear {
        for l in 1..=m + 1 {
            products += z[l * n + j].dot(z[(m + 2 - l) * n + k].turn(h));
        }
    }
    sum + products.scale(((m + 1) * (m + 2)) as f64)
}
