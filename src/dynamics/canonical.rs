//! The canonical form: coordinates u and momenta p, in which Gauss methods are symplectic (in (q, w) they are
//! not).
//!
//! ```text
//! q = S u + s(t),  w = S u' + s',   p = Sᵀ M w:      Sᵀ M S u' = p - Sᵀ M s'
//! p' = Sᵀ d(T-V)/dq,        p_t' = dL/dt = d(T-V)/dq · s' + (M w)·s''
//! H = T + V - (M w)·s',     K = H + p_t is a first integral
//! ```
//!
//! Source: H. Goldstein, *Classical Mechanics*, 2nd ed. (1980), sections 8-1 and 8-2, for a time-dependent
//! change of coordinates.
//!
//! Unknowns: u (f), p (f) \[kg·m²/s\] and, where angles are driven or dampers present, p_t \[J\], started at
//! (M w)·s' so that the work done is (M w)·s' - p_t at any time, without a quadrature.  Dampers add their
//! generalized force to p' and take their power out of p_t'.

mod stages;

use super::constraint::ConstraintArguments;
use super::energy::moment;
use super::jacobian::{LANES, Slopes};
use super::kernel::{Kernel, dot};
use super::law::Phase;
use super::stiffness::Stiffness;
use super::tree::{self, size};
use super::{Form, Mechanism, Motion, OdeSystem, Points, State, Time};
use crate::arithmetic::{DoubleDouble, Real, Scalar};
use stages::LaneStages;
use std::sync::Arc;

/// Equations in coordinates and momenta, for `N` bodies (any number where `N` is 0); `WORK` carries p_t.
#[derive(Clone, Debug)]
pub struct Canonical<const N: usize, const WORK: bool> {
    mechanism: Arc<Mechanism>,
    work: CanonicalScratch<f64>,
    exact: CanonicalScratch<DoubleDouble>,
    stages: LaneStages,
    /// For the Jacobian; made when first asked for.
    slopes: Option<Box<CanonicalScratch<Slopes>>>,
}

/// Scratch space of one evaluation.
#[derive(Clone, Debug)]
struct CanonicalScratch<T> {
    kernel: Kernel<T>,
    /// The known part of every angle at the time of the evaluation (n); not looked at without an account.
    drive: Vec<Phase<T>>,
    drive_rate: Vec<T>,
    drive_acceleration: Vec<T>,
    /// What applied forces are multiplied by at that time.
    factor: Vec<T>,
    /// That time \[s\], where forces from outside ask for it.
    time: T,
    omega: Vec<T>,
    momentum: Vec<T>,
    reduced: Vec<T>,
    pivot: Vec<T>,
    u_rate: Vec<T>,
}

impl<T: Scalar> CanonicalScratch<T> {
    fn new(mechanism: &Mechanism) -> Self {
        let (n, f) = (mechanism.coordinates(), mechanism.partition.count());
        let zeros = || vec![T::ZERO; n];
        Self {
            kernel: Kernel::dense_without_rows(mechanism),
            factor: vec![T::ONE; mechanism.actions.len()],
            time: T::ZERO,
            drive: vec![Phase::default(); n],
            drive_rate: zeros(),
            drive_acceleration: zeros(),
            omega: zeros(),
            momentum: zeros(),
            reduced: vec![T::ZERO; f * f],
            pivot: vec![T::ZERO; f],
            u_rate: vec![T::ZERO; f],
        }
    }

    /// Takes the known part of body `k`'s angle.
    #[inline(always)]
    fn drive(&mut self, k: usize, phase: Phase<T>) {
        (self.drive_rate[k], self.drive_acceleration[k], self.drive[k]) =
            (phase.rate, phase.acceleration, phase);
    }

    /// From u and p to unit vectors, twist and all rates: `u_rate`, `omega`.
    #[inline(always)]
    fn velocities<const N: usize>(
        &mut self,
        mechanism: &Mechanism,
        has_work_integral: bool,
        u: &[T],
        p: &[T],
    ) {
        let n = size::<N>(mechanism.coordinates());
        if !has_work_integral {
            self.kernel.unit_vectors::<N>(mechanism, u);
            mechanism.tree.mass_matrix::<T, N>(&self.kernel.z, &mut self.kernel.mass, &mut self.kernel.twist);
            tree::factor::<T, N>(n, &mut self.kernel.mass, &mut self.kernel.pivot);
            self.omega[..n].copy_from_slice(&p[..n]);
            tree::solve::<T, N>(n, &self.kernel.mass, &self.kernel.pivot, &mut self.omega);
            return;
        }
        let f = u.len();
        for (k, dependent_angle) in
            mechanism.partition.bodies[..mechanism.partition.angles].iter().enumerate()
        {
            self.kernel.z[k] = dependent_angle.unit_vectors(u, &self.drive[k]);
        }
        mechanism.partition.translations(u, &mut self.kernel.z);
        mechanism.tree.mass_matrix::<T, N>(&self.kernel.z, &mut self.kernel.mass, &mut self.kernel.twist);
        tree::multiply::<T, N>(n, &self.kernel.mass, &self.drive_rate, &mut self.momentum);
        mechanism.partition.gather(&self.momentum, &mut self.u_rate);
        for (rate, &p) in self.u_rate.iter_mut().zip(p) {
            *rate = p - *rate;
        }
        mechanism.partition.reduce(&self.kernel.mass, &mut self.reduced);
        tree::factor::<T, 0>(f, &mut self.reduced, &mut self.pivot);
        tree::solve::<T, 0>(f, &self.reduced, &self.pivot, &mut self.u_rate);
        self.omega.copy_from_slice(&self.drive_rate);
        mechanism.partition.spread(&self.u_rate, &mut self.omega);
        tree::multiply::<T, N>(n, &self.kernel.mass, &self.omega, &mut self.momentum);
    }

    /// y' at the drives taken last; `has_work_integral`: y ends with p_t.
    #[inline(always)]
    fn rate<const N: usize>(
        &mut self,
        mechanism: &Mechanism,
        has_work_integral: bool,
        y: &[T],
        rate: &mut [T],
    ) {
        let n = size::<N>(mechanism.coordinates());
        let f = if has_work_integral { mechanism.partition.count() } else { n };
        self.velocities::<N>(mechanism, has_work_integral, &y[..f], &y[f..2 * f]);
        let kernel = &mut self.kernel;
        mechanism.tree.lagrangian_forces::<T, N>(&kernel.z, &self.omega, &kernel.twist, &mut kernel.load);
        for spring in &mechanism.springs {
            spring.span.pull(spring.elastic(&kernel.z), &kernel.z, &mut kernel.load);
        }
        for torsion in &mechanism.torsions {
            torsion.pull(torsion.elastic(y), &mut kernel.load);
        }
        for force in &mechanism.forces {
            force.pull_by_potential(
                self.time,
                ConstraintArguments { phi: y, z: &kernel.z, omega: &self.omega },
                &mut kernel.load,
            );
        }
        if !has_work_integral {
            rate[..n].copy_from_slice(&self.omega[..n]);
            rate[n..2 * n].copy_from_slice(&kernel.load[..n]);
            return;
        }
        rate[2 * f] = dot(&kernel.load, &self.drive_rate) + dot(&self.momentum, &self.drive_acceleration);
        let (u_part, p_part) = rate[..2 * f].split_at_mut(f);
        u_part.copy_from_slice(&self.u_rate);
        mechanism.partition.gather(&kernel.load, p_part);
        if mechanism.is_worked_on() {
            kernel.load.fill(T::ZERO);
            for spring in mechanism.springs.iter().filter(|spring| spring.damping != 0.0) {
                spring.span.pull(spring.drag(&kernel.z, &self.omega), &kernel.z, &mut kernel.load);
            }
            for torsion in mechanism.torsions.iter().filter(|torsion| torsion.damping != 0.0) {
                torsion.pull(torsion.drag(&self.omega), &mut kernel.load);
            }
            for (action, &factor) in mechanism.actions.iter().zip(&self.factor) {
                action.pull(factor, &kernel.z, &mut kernel.load);
            }
            for force in &mechanism.forces {
                force.pull_applied(
                    self.time,
                    ConstraintArguments { phi: y, z: &kernel.z, omega: &self.omega },
                    &mut kernel.load,
                );
            }
            mechanism.partition.gather(&kernel.load, &mut self.pivot);
            for (p, &force) in p_part.iter_mut().zip(&self.pivot) {
                *p += force;
            }
            rate[2 * f] -= dot(&self.pivot, &self.u_rate);
        }
    }
}

impl<T: Real> CanonicalScratch<T> {
    /// Takes the known parts of all angles at one time.
    #[inline]
    fn drive_at(&mut self, mechanism: &Mechanism, t: Time) {
        for (k, dependent_angle) in mechanism.partition.bodies.iter().enumerate() {
            self.drive(k, dependent_angle.drive(t));
        }
        for (factor, action) in self.factor.iter_mut().zip(&mechanism.actions) {
            *factor = action.factor(t);
        }
        self.time = moment(t);
    }
}

impl<const N: usize, const WORK: bool> Canonical<N, WORK> {
    /// The form of a mechanism; `N` must be its number of bodies or 0, `WORK` true where it has rows or
    /// dampers.
    pub fn new(mechanism: Arc<Mechanism>) -> Self {
        Self::with_lanes(mechanism, false)
    }

    /// The same; with `portable`, without the processor's vector instructions, to the same bits.
    pub fn with_lanes(mechanism: Arc<Mechanism>, portable: bool) -> Self {
        debug_assert!(N == 0 || N == mechanism.size());
        debug_assert!(WORK || !mechanism.has_work_integral());
        let (work, exact) = (CanonicalScratch::new(&mechanism), CanonicalScratch::new(&mechanism));
        Self { work, exact, stages: LaneStages::new(&mechanism, portable), slopes: None, mechanism }
    }
}

impl<const N: usize, const WORK: bool> OdeSystem for Canonical<N, WORK> {
    fn dimension(&self) -> usize {
        2 * self.mechanism.partition.count() + usize::from(WORK)
    }

    fn angles(&self) -> usize {
        self.mechanism.partition.turning()
    }

    #[inline]
    fn rhs(&mut self, t: Time, y: &[f64], rate: &mut [f64]) {
        if WORK {
            self.work.drive_at(&self.mechanism, t);
        }
        self.work.rate::<N>(&self.mechanism, WORK, y, rate);
    }

    fn rates(&mut self, points: &mut Points) {
        self.stages.rates(WORK, false, &self.mechanism, points);
    }

    fn has_exact_rates(&self) -> bool {
        true
    }

    fn exact_rates(&mut self, points: &mut Points) {
        self.stages.rates(WORK, true, &self.mechanism, points);
    }

    fn jacobian(&mut self, t: Time, y: &[f64], y_by_y: &mut [f64]) -> bool {
        let scratch = self.slopes.get_or_insert_with(|| Box::new(CanonicalScratch::new(&self.mechanism)));
        slopes(scratch, WORK, &self.mechanism, t, y, y_by_y);
        true
    }

    fn stiffness(&mut self, t: Time, y: &[f64]) -> Option<Stiffness> {
        // Leaves the rates of all bodies behind.
        self.rhs(t, y, &mut vec![0.0; y.len()]);
        let phi: Vec<f64> = self
            .mechanism
            .partition
            .bodies
            .iter()
            .map(|dependent_angle| dependent_angle.place(t, y).angle)
            .collect();
        Some(Stiffness::at(&self.mechanism, t, &phi, &self.work.omega))
    }

    fn label(&self, i: usize) -> String {
        let partition = &self.mechanism.partition;
        let f = partition.count();
        match i {
            i if i < f => self.mechanism.coordinate_name(partition.independent[i]),
            i if i < 2 * f => {
                format!("momentum along {}", self.mechanism.coordinate_name(partition.independent[i - f]))
            }
            _ => "momentum conjugate to time".into(),
        }
    }
}

/// dy'/dy row by row (d × d); not generic, so that it is compiled once.
fn slopes(
    scratch: &mut CanonicalScratch<Slopes>,
    has_work_integral: bool,
    mechanism: &Mechanism,
    t: Time,
    y: &[f64],
    y_by_y: &mut [f64],
) {
    let d = y.len();
    let (mut point, mut rate) = (vec![Slopes::ZERO; d], vec![Slopes::ZERO; d]);
    if has_work_integral {
        scratch.drive_at(mechanism, t);
    }
    for first in (0..d).step_by(LANES) {
        for (k, (point, &y)) in point.iter_mut().zip(y).enumerate() {
            *point = Slopes::unknown(y, k.wrapping_sub(first));
        }
        scratch.rate::<0>(mechanism, has_work_integral, &point, &mut rate);
        for (row, rate) in y_by_y.chunks_exact_mut(d).zip(&rate) {
            for (entry, &slope) in row[first..].iter_mut().zip(&rate.slope) {
                *entry = slope;
            }
        }
    }
}

impl<const N: usize, const WORK: bool> Form for Canonical<N, WORK> {
    fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    fn state(&self, motion: &Motion) -> State {
        let (n, partition) = (self.mechanism.coordinates(), &self.mechanism.partition);
        let mut scratch = self.exact.clone();
        scratch.kernel.unit_vectors::<0>(&self.mechanism, &motion.phi);
        let kernel = &mut scratch.kernel;
        self.mechanism.tree.mass_matrix::<DoubleDouble, 0>(&kernel.z, &mut kernel.mass, &mut kernel.twist);
        tree::multiply::<DoubleDouble, 0>(n, &kernel.mass, &motion.omega, &mut scratch.momentum);
        let mut unknowns: Vec<DoubleDouble> =
            partition.independent.iter().map(|&body| motion.phi[body]).collect();
        let mut p = vec![DoubleDouble::ZERO; partition.count()];
        partition.gather(&scratch.momentum, &mut p);
        unknowns.extend(p);
        if WORK {
            scratch.drive_at(&self.mechanism, motion.time);
            unknowns.push(dot(&scratch.momentum, &scratch.drive_rate) - motion.work);
        }
        self.mechanism.state(motion.time, &unknowns, &partition.turns(motion))
    }

    fn read(&mut self, state: &State, motion: &mut Motion) {
        let partition = &self.mechanism.partition;
        let f = partition.count();
        partition.read_angles(state, motion);
        let unknowns: Vec<DoubleDouble> = (0..state.y.len()).map(|i| state.unknown(i)).collect();
        let scratch = &mut self.exact;
        if WORK {
            scratch.drive_at(&self.mechanism, state.time);
        }
        scratch.velocities::<0>(&self.mechanism, WORK, &unknowns[..f], &unknowns[f..2 * f]);
        motion.omega.copy_from_slice(&scratch.omega);
        if WORK {
            motion.work = dot(&scratch.momentum, &scratch.drive_rate) - unknowns[2 * f];
        }
    }
}
