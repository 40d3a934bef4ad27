//! The mechanism in (q, w), with one multiplier per row.
//!
//! Unknowns: coordinates (n), rates (n) and, where the scene has rows or forces that do work, the work of
//! motors, dampers and applied forces and the energy the stabilizer puts in \[J\], then the energy lost in
//! dry friction where there is any.  With `WORK = false` neither rows nor accounts exist in the code.

use super::gap::turning;
use super::jacobian::Jacobian;
use super::kernel::{Bias, Kernel};
use super::stiffness::Stiffness;
use super::tree::size;
use super::{Along, BodyAngles, Coordinates, Form, Mechanism, Motion, OdeSystem, State, Time};
use crate::arithmetic::{Complex, DoubleDouble};
use std::sync::Arc;

/// Equations in angles and rates, for `N` bodies (any number where `N` is 0).
#[derive(Clone, Debug)]
pub struct Multiplier<const N: usize, const WORK: bool> {
    mechanism: Arc<Mechanism>,
    kernel: Kernel<f64>,
    /// Made when first asked for.
    jacobian: Option<Box<Jacobian>>,
}

impl<const N: usize, const WORK: bool> Multiplier<N, WORK> {
    /// The form of a mechanism; `N` must be its number of bodies or 0, `WORK` true where it has rows or
    /// dampers.
    pub fn new(mechanism: Arc<Mechanism>) -> Self {
        debug_assert!(N == 0 || N == mechanism.size());
        debug_assert!(WORK || !mechanism.has_work_integral());
        let kernel = Kernel::new(&mechanism);
        Self { mechanism, kernel, jacobian: None }
    }

    /// True where friction has an account of its own.
    fn has_friction(&self) -> bool {
        !self.mechanism.frictions.is_empty()
    }

    /// y' with a stabilizer's bias in every row; compiled once for all who ask.
    #[inline(never)]
    pub fn biased_rate(&mut self, t: Time, y: &[f64], rate: &mut [f64], bias: Bias) {
        let n = size::<N>(self.mechanism.coordinates());
        let (phi, omega) = (&y[..n], &y[n..2 * n]);
        if WORK {
            self.kernel.accelerate::<N>(&self.mechanism, t, phi, omega, bias);
        } else {
            self.kernel.accelerate_free::<N>(&self.mechanism, t, phi, omega);
        }
        let (load, rates) = (&self.kernel.load[..n], &mut rate[..2 * n]);
        for k in 0..n {
            (rates[k], rates[n + k]) = (omega[k], load[k]);
        }
        if WORK {
            (rate[2 * n], rate[2 * n + 1]) = self.kernel.powers(&self.mechanism, t, phi, omega);
            if let Some(lost) = rate.get_mut(2 * n + 2) {
                *lost = self.kernel.friction_power(omega);
            }
        }
    }

    /// [`OdeSystem::fine_rate`] with a stabilizer's bias in every row.
    pub fn fine_biased_rate(&mut self, t: Time, y: &[f64], low: &[f64], rate: &mut [f64], bias: Bias) {
        self.kernel.measure(&self.mechanism, y, low);
        self.biased_rate(t, y, rate, bias);
        self.kernel.stretch.clear();
    }

    /// dy'/dy with a stabilizer's bias in every row.
    pub fn biased_jacobian(&mut self, t: Time, y: &[f64], y_by_y: &mut [f64], bias: Bias) {
        let (n, d) = (self.mechanism.coordinates(), self.dimension());
        let jacobian = self.jacobian.get_or_insert_with(|| Box::new(Jacobian::new(&self.mechanism)));
        jacobian.evaluate(&self.mechanism, t, &y[..n], &y[n..2 * n], bias);
        jacobian.fill(d, y_by_y);
    }
}

impl<const N: usize, const WORK: bool> OdeSystem for Multiplier<N, WORK> {
    fn dimension(&self) -> usize {
        2 * self.mechanism.coordinates() + if WORK { 2 + usize::from(self.has_friction()) } else { 0 }
    }

    fn angles(&self) -> usize {
        self.mechanism.bodies.len()
    }

    #[inline]
    fn rhs(&mut self, t: Time, y: &[f64], rate: &mut [f64]) {
        self.biased_rate(t, y, rate, Bias::default());
    }

    fn fine_rate(&mut self, t: Time, y: &[f64], low: &[f64], rate: &mut [f64]) {
        self.fine_biased_rate(t, y, low, rate, Bias::default());
    }

    fn jacobian(&mut self, t: Time, y: &[f64], jacobian: &mut [f64]) -> bool {
        self.biased_jacobian(t, y, jacobian, Bias::default());
        true
    }

    fn may_grow_by_rates(&self) -> bool {
        self.mechanism.may_grow_by_rates()
    }

    fn stiffness(&mut self, t: Time, y: &[f64]) -> Option<Stiffness> {
        let n = self.mechanism.coordinates();
        Some(Stiffness::at(&self.mechanism, t, &y[..n], &y[n..2 * n]))
    }

    fn label(&self, i: usize) -> String {
        let n = self.mechanism.coordinates();
        match i {
            i if i < n => self.mechanism.coordinate_name(i),
            i if i < 2 * n => self.mechanism.rate_name(i - n),
            i if i == 2 * n => "work of motors and forces".into(),
            i if i == 2 * n + 2 => "energy lost in friction".into(),
            _ => "energy put in by the stabilizer".into(),
        }
    }

    fn unit(&self, i: usize) -> f64 {
        self.mechanism.unit_of(i, self.mechanism.coordinates(), self.mechanism.bodies.len())
    }

    fn time_unit(&self) -> f64 {
        self.mechanism.units.time
    }

    fn rough_quadrature(&self) -> Option<usize> {
        (WORK && self.has_friction()).then(|| 2 * self.mechanism.coordinates() + 2)
    }

    fn events(&self) -> usize {
        self.mechanism.contacts.len()
    }

    fn gaps(&mut self, t: Time, y: &[f64], gaps: &mut [f64]) {
        let mechanism = &*self.mechanism;
        let n = size::<N>(mechanism.coordinates());
        self.kernel.unit_vectors::<N>(mechanism, &y[..n]);
        for (gap, contact) in gaps.iter_mut().zip(&mechanism.contacts) {
            *gap = contact.gap(t, &y[..n], &self.kernel.z);
        }
        // What is held is a row.
        if WORK && !mechanism.held.is_empty() {
            self.kernel.accelerate::<N>(mechanism, t, &y[..n], &y[n..2 * n], Bias::default());
        }
        // What is held ends where the wall would have to pull.
        for (&contact, multiplier) in
            mechanism.held.iter().zip(&self.kernel.multiplier[mechanism.standing_rows()..])
        {
            gaps[contact] = mechanism.contacts[contact].pressure(*multiplier);
        }
    }

    fn watched(&self) -> usize {
        if self.mechanism.held.is_empty() { self.mechanism.coordinates() } else { self.dimension() }
    }

    fn gap(&self, event: usize, along: Along) -> Option<[f64; 3]> {
        let Along { y, slope, .. } = along;
        let bodies = self.mechanism.bodies.len();
        let of = |k: usize| match k < bodies {
            true => turning(Complex::unit(y[k]), slope[k]),
            false => [Complex::new(y[k], y[k + 1]), Complex::new(slope[k], slope[k + 1])],
        };
        match self.mechanism.held.contains(&event) {
            true => None,
            false => self.mechanism.contacts[event].gap_along(&along, of),
        }
    }

    fn gap_bend(&self, event: usize, t: f64, step_size: f64, first: &[f64], second: &[f64]) -> f64 {
        // Nothing bounds the force on a point that is held.
        if self.mechanism.held.contains(&event) {
            return f64::INFINITY;
        }
        self.mechanism.contacts[event].gap_bend(t, step_size, |k| [second[k], first[k]])
    }
}

impl<const N: usize, const WORK: bool> Form for Multiplier<N, WORK> {
    fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::All
    }

    fn state(&self, motion: &Motion) -> State {
        let mut unknowns: Vec<DoubleDouble> = motion.phi.iter().chain(&motion.omega).copied().collect();
        if WORK {
            unknowns.extend([motion.work, DoubleDouble::from(motion.stabilizer)]);
            if self.has_friction() {
                unknowns.push(DoubleDouble::from(motion.friction));
            }
        }
        self.mechanism.state(motion.time, &unknowns, &motion.turns[..self.mechanism.bodies.len()])
    }

    fn read(&mut self, state: &State, motion: &mut Motion) {
        let n = self.mechanism.coordinates();
        motion.follow(state, n);
        if WORK {
            motion.work = state.unknown(2 * n);
            motion.stabilizer = state.y[2 * n + 1];
            motion.friction = state.y.get(2 * n + 2).copied().unwrap_or_default();
        }
    }

    fn body_angles(&mut self, state: &State, body_angles: &mut BodyAngles) {
        body_angles.take_leading(state, self.mechanism.coordinates());
    }
}
