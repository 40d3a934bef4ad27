//! The mechanism in (q, w), with one multiplier per row.
//!
//! Unknowns: angles (n), rates (n) and, where the scene has motors or dampers, the work of motors and dampers and the energy
//! the stabilizer puts in \[J\].  With `ACCOUNT = false` neither rows nor accounts exist in the code.

use super::kernel::{Bias, Kernel, dot};
use super::row::Row;
use super::tree::size;
use super::{Coordinates, Field, Form, Glance, Mechanism, Motion, State, Time};
use crate::arithmetic::DoubleDouble;
use std::sync::Arc;

/// Equations in angles and rates, for `N` bodies (any number where `N` is 0).
#[derive(Clone, Debug)]
pub struct Multiplier<const N: usize, const ACCOUNT: bool> {
    mechanism: Arc<Mechanism>,
    kernel: Kernel<f64>,
}

impl<const N: usize, const ACCOUNT: bool> Multiplier<N, ACCOUNT> {
    /// The form of a mechanism; `N` must be its number of bodies or 0, `ACCOUNT` true where it has rows or dampers.
    pub fn new(mechanism: Arc<Mechanism>) -> Self {
        debug_assert!(N == 0 || N == mechanism.bodies.len());
        debug_assert!(ACCOUNT || !mechanism.keeps_account());
        let kernel = Kernel::new(mechanism.bodies.len(), mechanism.rows.len());
        Self { mechanism, kernel }
    }

    /// y' with a stabilizer's bias in every row.
    #[inline(always)]
    pub fn biased_rate(&mut self, t: Time, y: &[f64], rate: &mut [f64], bias: Bias) {
        let n = size::<N>(self.mechanism.bodies.len());
        let (phi, omega) = (&y[..n], &y[n..2 * n]);
        if ACCOUNT {
            self.kernel.accelerate::<N>(&self.mechanism, t, phi, omega, bias);
        } else {
            self.kernel.accelerate_free::<N>(&self.mechanism, phi, omega);
        }
        let (load, rates) = (&self.kernel.load[..n], &mut rate[..2 * n]);
        for k in 0..n {
            (rates[k], rates[n + k]) = (omega[k], load[k]);
        }
        if ACCOUNT {
            (rate[2 * n], rate[2 * n + 1]) = self.powers(n, omega);
        }
    }

    /// Power of motors and dampers, and power of the stabilizer's share of the multipliers \[W\].
    #[inline(always)]
    fn powers(&self, n: usize, omega: &[f64]) -> (f64, f64) {
        let (mut work, mut stabilizer) = (0.0, 0.0);
        for (r, row) in self.mechanism.rows.iter().enumerate() {
            // A wall stands still, a pin moves both its points alike: they do no work.
            if !matches!(row, Row::Angle(_)) {
                continue;
            }
            let speed = dot(&self.kernel.jacobian[r * n..(r + 1) * n], omega);
            work -= (self.kernel.multiplier[r] - self.kernel.correction[r]) * speed;
            stabilizer -= self.kernel.correction[r] * speed;
        }
        for spring in self.mechanism.springs.iter().filter(|spring| spring.damping != 0.0) {
            work += spring.drag_power(&self.kernel.z, omega);
        }
        (work, stabilizer)
    }
}

impl<const N: usize, const ACCOUNT: bool> Field for Multiplier<N, ACCOUNT> {
    fn dimension(&self) -> usize {
        2 * self.mechanism.bodies.len() + if ACCOUNT { 2 } else { 0 }
    }

    fn angles(&self) -> usize {
        self.mechanism.bodies.len()
    }

    #[inline]
    fn rate(&mut self, t: Time, y: &[f64], rate: &mut [f64]) {
        self.biased_rate(t, y, rate, Bias::default());
    }

    fn label(&self, i: usize) -> String {
        let n = self.mechanism.bodies.len();
        match i {
            i if i < n => format!("phi of {}", self.mechanism.bodies[i].name),
            i if i < 2 * n => format!("omega of {}", self.mechanism.bodies[i - n].name),
            i if i == 2 * n => "work of motors and dampers".into(),
            _ => "energy put in by the stabilizer".into(),
        }
    }

    fn events(&self) -> usize {
        self.mechanism.contacts.len()
    }

    fn gaps(&mut self, t: Time, y: &[f64], gaps: &mut [f64]) {
        let mechanism = &*self.mechanism;
        let n = size::<N>(mechanism.bodies.len());
        self.kernel.face::<N>(&y[..n]);
        for (gap, contact) in gaps.iter_mut().zip(&mechanism.contacts) {
            *gap = contact.row.gap(&self.kernel.z);
        }
        if !mechanism.held.is_empty() {
            self.kernel.accelerate::<N>(mechanism, t, &y[..n], &y[n..2 * n], Bias::default());
        }
        // What is held ends where the wall would have to pull.
        for (&contact, multiplier) in mechanism.held.iter().zip(&self.kernel.multiplier[mechanism.motor_rows()..]) {
            gaps[contact] = -multiplier / mechanism.energy_scale;
        }
    }
}

impl<const N: usize, const ACCOUNT: bool> Form for Multiplier<N, ACCOUNT> {
    fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::All
    }

    fn state(&self, motion: &Motion) -> State {
        let n = self.mechanism.bodies.len();
        let mut unknowns: Vec<DoubleDouble> = motion.phi.iter().chain(&motion.omega).copied().collect();
        if ACCOUNT {
            unknowns.extend([motion.work, DoubleDouble::from(motion.stabilizer)]);
        }
        let mut state = State::new(&unknowns, n);
        state.time = motion.time;
        for (turns, before) in state.turns.iter_mut().zip(&motion.turns) {
            *turns += before;
        }
        state
    }

    fn read(&mut self, state: &State, motion: &mut Motion) {
        let n = self.mechanism.bodies.len();
        motion.resize(n);
        motion.time = state.time;
        motion.turns.copy_from_slice(&state.turns);
        for k in 0..n {
            motion.phi[k] = state.unknown(k);
            motion.omega[k] = state.unknown(n + k);
        }
        if ACCOUNT {
            motion.work = state.unknown(2 * n);
            motion.stabilizer = state.y[2 * n + 1];
        }
    }

    fn glance(&mut self, state: &State, glance: &mut Glance) {
        glance.take_leading(state, self.mechanism.bodies.len());
    }
}
