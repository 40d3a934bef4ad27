//! The canonical form: coordinates u and momenta p, in which Gauss methods are symplectic (in (q, w) they are not).
//!
//! ```text
//! q = S u + s(t),  w = S u' + s',   p = Sᵀ M w:      Sᵀ M S u' = p - Sᵀ M s'
//! p' = Sᵀ d(T-V)/dq,        p_t' = dL/dt = d(T-V)/dq · s' + (M w)·s''
//! H = T + V - (M w)·s',     K = H + p_t is a first integral
//! ```
//!
//! Source: H. Goldstein, *Classical Mechanics*, 2nd ed. (1980), sections 8-1 and 8-2, for a time-dependent change of coordinates.
//!
//! Unknowns: u (f), p (f) \[kg·m²/s\] and, where angles are driven or dampers present, p_t \[J\], started at (M w)·s' so that the work done
//! is (M w)·s' - p_t at any time, without a quadrature.  Dampers add their generalized force to p' and take their power out of p_t'.

use super::kernel::{Kernel, dot};
use super::tree::{self, size};
use super::{Field, Form, Mechanism, Motion, State, Time};
use crate::arithmetic::{DoubleDouble, Real, Scalar};
use std::sync::Arc;

/// Equations in coordinates and momenta, for `N` bodies (any number where `N` is 0); `ACCOUNT` carries p_t.
#[derive(Clone, Debug)]
pub struct Canonical<const N: usize, const ACCOUNT: bool> {
    mechanism: Arc<Mechanism>,
    work: Scratch<f64>,
    exact: Scratch<DoubleDouble>,
}

/// Scratch space of one evaluation.
#[derive(Clone, Debug)]
struct Scratch<T> {
    kernel: Kernel<T>,
    phi: Vec<T>,
    omega: Vec<T>,
    drive_rate: Vec<T>,
    drive_acceleration: Vec<T>,
    momentum: Vec<T>,
    reduced: Vec<T>,
    pivot: Vec<T>,
    u_rate: Vec<T>,
}

impl<T: Real> Scratch<T> {
    fn new(mechanism: &Mechanism) -> Self {
        let (n, f) = (mechanism.bodies.len(), mechanism.ties.count());
        let zeros = || vec![T::ZERO; n];
        Self {
            kernel: Kernel::new(n, 0),
            phi: zeros(),
            omega: zeros(),
            drive_rate: zeros(),
            drive_acceleration: zeros(),
            momentum: zeros(),
            reduced: vec![T::ZERO; f * f],
            pivot: vec![T::ZERO; f],
            u_rate: vec![T::ZERO; f],
        }
    }

    /// From u and p to unit vectors, twist and all rates: `u_rate`, `omega`.
    #[inline(always)]
    fn velocities<const N: usize, const ACCOUNT: bool>(&mut self, mechanism: &Mechanism, t: Time, u: &[T], p: &[T]) {
        let n = size::<N>(mechanism.bodies.len());
        if !ACCOUNT {
            self.kernel.face::<N>(u);
            mechanism.tree.couple::<T, N>(&self.kernel.z, &mut self.kernel.mass, &mut self.kernel.twist);
            tree::factor::<T, N>(n, &mut self.kernel.mass, &mut self.kernel.pivot);
            self.omega[..n].copy_from_slice(&p[..n]);
            tree::solve::<T, N>(n, &self.kernel.mass, &self.kernel.pivot, &mut self.omega);
            return;
        }
        let f = u.len();
        mechanism.ties.expand(t, u, &mut self.phi, &mut self.kernel.z, &mut self.drive_rate, &mut self.drive_acceleration);
        mechanism.tree.couple::<T, N>(&self.kernel.z, &mut self.kernel.mass, &mut self.kernel.twist);
        tree::multiply::<T, N>(n, &self.kernel.mass, &self.drive_rate, &mut self.momentum);
        mechanism.ties.gather(&self.momentum, &mut self.u_rate);
        for (rate, &p) in self.u_rate.iter_mut().zip(p) {
            *rate = p - *rate;
        }
        mechanism.ties.reduce(&self.kernel.mass, &mut self.reduced);
        tree::factor::<T, 0>(f, &mut self.reduced, &mut self.pivot);
        tree::solve::<T, 0>(f, &self.reduced, &self.pivot, &mut self.u_rate);
        self.omega.copy_from_slice(&self.drive_rate);
        mechanism.ties.spread(&self.u_rate, &mut self.omega);
        tree::multiply::<T, N>(n, &self.kernel.mass, &self.omega, &mut self.momentum);
    }
}

impl<const N: usize, const ACCOUNT: bool> Canonical<N, ACCOUNT> {
    /// The form of a mechanism; `N` must be its number of bodies or 0, `ACCOUNT` true where it has rows or dampers.
    pub fn new(mechanism: Arc<Mechanism>) -> Self {
        debug_assert!(N == 0 || N == mechanism.bodies.len());
        debug_assert!(ACCOUNT || !mechanism.keeps_account());
        Self { work: Scratch::new(&mechanism), exact: Scratch::new(&mechanism), mechanism }
    }
}

impl<const N: usize, const ACCOUNT: bool> Field for Canonical<N, ACCOUNT> {
    fn dimension(&self) -> usize {
        2 * self.mechanism.ties.count() + usize::from(ACCOUNT)
    }

    fn angles(&self) -> usize {
        self.mechanism.ties.count()
    }

    #[inline]
    fn rate(&mut self, t: Time, y: &[f64], rate: &mut [f64]) {
        let mechanism = &*self.mechanism;
        let n = size::<N>(mechanism.bodies.len());
        let f = if ACCOUNT { mechanism.ties.count() } else { n };
        let scratch = &mut self.work;
        scratch.velocities::<N, ACCOUNT>(mechanism, t, &y[..f], &y[f..2 * f]);
        let kernel = &mut scratch.kernel;
        mechanism.tree.pull::<f64, N>(&kernel.z, &scratch.omega, &kernel.twist, &mut kernel.load);
        for spring in &mechanism.springs {
            spring.span.pull(spring.elastic(&kernel.z), &kernel.z, &mut kernel.load);
        }
        if !ACCOUNT {
            rate[..n].copy_from_slice(&scratch.omega[..n]);
            rate[n..2 * n].copy_from_slice(&kernel.load[..n]);
            return;
        }
        rate[2 * f] = dot(&kernel.load, &scratch.drive_rate) + dot(&scratch.momentum, &scratch.drive_acceleration);
        let (u_part, p_part) = rate[..2 * f].split_at_mut(f);
        u_part.copy_from_slice(&scratch.u_rate);
        mechanism.ties.gather(&kernel.load, p_part);
        if mechanism.is_damped() {
            kernel.load.fill(0.0);
            for spring in mechanism.springs.iter().filter(|spring| spring.damping != 0.0) {
                spring.span.pull(spring.drag(&kernel.z, &scratch.omega), &kernel.z, &mut kernel.load);
            }
            mechanism.ties.gather(&kernel.load, &mut scratch.pivot);
            for (p, &drag) in p_part.iter_mut().zip(&scratch.pivot) {
                *p += drag;
            }
            rate[2 * f] -= dot(&scratch.pivot, &scratch.u_rate);
        }
    }

    fn label(&self, i: usize) -> String {
        let ties = &self.mechanism.ties;
        let f = ties.count();
        match i {
            i if i < f => format!("phi of {}", self.mechanism.bodies[ties.independent[i]].name),
            i if i < 2 * f => format!("momentum of {}", self.mechanism.bodies[ties.independent[i - f]].name),
            _ => "momentum conjugate to time".into(),
        }
    }
}

impl<const N: usize, const ACCOUNT: bool> Form for Canonical<N, ACCOUNT> {
    fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    fn state(&self, motion: &Motion) -> State {
        let (n, ties) = (self.mechanism.bodies.len(), &self.mechanism.ties);
        let mut scratch = self.exact.clone();
        scratch.kernel.face::<0>(&motion.phi);
        let kernel = &mut scratch.kernel;
        self.mechanism.tree.couple::<DoubleDouble, 0>(&kernel.z, &mut kernel.mass, &mut kernel.twist);
        tree::multiply::<DoubleDouble, 0>(n, &kernel.mass, &motion.omega, &mut scratch.momentum);
        let mut unknowns: Vec<DoubleDouble> = ties.independent.iter().map(|&body| motion.phi[body]).collect();
        let mut p = vec![DoubleDouble::ZERO; ties.count()];
        ties.gather(&scratch.momentum, &mut p);
        unknowns.extend(p);
        if ACCOUNT {
            let u: Vec<DoubleDouble> = unknowns[..ties.count()].to_vec();
            ties.expand(motion.time, &u, &mut scratch.phi, &mut scratch.kernel.z, &mut scratch.drive_rate, &mut scratch.drive_acceleration);
            unknowns.push(dot(&scratch.momentum, &scratch.drive_rate) - motion.work);
        }
        ties.state(motion, &unknowns)
    }

    fn read(&mut self, state: &State, motion: &mut Motion) {
        let ties = &self.mechanism.ties;
        let f = ties.count();
        ties.read_angles(state, motion);
        let unknowns: Vec<DoubleDouble> = (0..state.y.len()).map(|i| state.unknown(i)).collect();
        let scratch = &mut self.exact;
        scratch.velocities::<0, ACCOUNT>(&self.mechanism, state.time, &unknowns[..f], &unknowns[f..2 * f]);
        motion.omega.copy_from_slice(&scratch.omega);
        if ACCOUNT {
            motion.work = dot(&scratch.momentum, &scratch.drive_rate) - unknowns[2 * f];
        }
    }
}
