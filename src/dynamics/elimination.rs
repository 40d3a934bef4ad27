//! The mechanism with its driven angles eliminated: coordinates u with q = S u + s(t).
//!
//! ```text
//! Sᵀ M S u'' = Sᵀ (b - M s''),      (Gᵀ lambda)_i = b_i - Σ M_ij a_j,      power of all motors = -(b - M a)·s'
//! ```
//!
//! Unknowns: u (f), u' (f), work of motors, dampers and applied forces \[J\].  The rows hold exactly, whatever the method.

use super::gap::turning;
use super::jacobian::Jacobian;
use super::kernel::{Bias, Kernel};
use super::row::Posture;
use super::tree::{self, size};
use super::{Along, Coordinates, Field, Form, Glance, Mechanism, Motion, State, Time};
use crate::arithmetic::{Complex, DoubleDouble};
use std::sync::Arc;

/// Equations in the independent coordinates, for `N` bodies (any number where `N` is 0).
#[derive(Clone, Debug)]
pub struct Elimination<const N: usize> {
    mechanism: Arc<Mechanism>,
    kernel: Kernel<f64>,
    /// True where no driven angle accelerates.
    is_steady: bool,
    phi: Vec<f64>,
    low: Vec<f64>,
    omega: Vec<f64>,
    drive_acceleration: Vec<f64>,
    drive_rate: Vec<f64>,
    given: Vec<f64>,
    share: Vec<f64>,
    reduced: Vec<f64>,
    pivot: Vec<f64>,
    coordinate_acceleration: Vec<f64>,
    /// Made when first asked for.
    jacobian: Option<Box<Jacobian>>,
}

impl<const N: usize> Elimination<N> {
    /// The form of a mechanism; `N` must be its number of bodies or 0.
    pub fn new(mechanism: Arc<Mechanism>) -> Self {
        debug_assert!(N == 0 || N == mechanism.size());
        let (n, f) = (mechanism.coordinates(), mechanism.ties.count());
        let zeros = || vec![0.0; n];
        Self {
            kernel: Kernel::dense_without_rows(&mechanism),
            phi: zeros(),
            low: zeros(),
            share: zeros(),
            omega: zeros(),
            drive_acceleration: zeros(),
            drive_rate: zeros(),
            given: zeros(),
            reduced: vec![0.0; f * f],
            pivot: vec![0.0; f],
            coordinate_acceleration: vec![0.0; f],
            is_steady: mechanism.ties.is_steady(),
            jacobian: None,
            mechanism,
        }
    }

    /// [`Field::rate`] for `F` coordinates (any number where `F` is 0).
    #[inline(always)]
    fn rate_sized<const F: usize>(&mut self, t: Time, y: &[f64], rate: &mut [f64]) {
        let mechanism = &*self.mechanism;
        let (n, f) = (size::<N>(mechanism.coordinates()), size::<F>(mechanism.ties.count()));
        let angles = size::<N>(mechanism.ties.angles);
        let (u, u_rate, rate) = (&y[..f], &y[f..2 * f], &mut rate[..2 * f + 1]);
        let ties = &mechanism.ties.bodies[..n];
        let kernel = &mut self.kernel;
        let (drive_rate, drive_acceleration, omega) = (&mut self.drive_rate[..n], &mut self.drive_acceleration[..n], &mut self.omega[..n]);
        for k in 0..angles {
            let placed = ties[k].place(t, u);
            (kernel.z[k], drive_rate[k], drive_acceleration[k]) = (placed.unit, placed.rate, placed.acceleration);
            omega[k] = drive_rate[k] + ties[k].base.map_or(0.0, |base| u_rate[base]);
            self.phi[k] = placed.angle;
        }
        mechanism.ties.feet(u, &mut kernel.z);
        for k in angles..n {
            omega[k] = ties[k].base.map_or(0.0, |base| u_rate[base]);
        }
        kernel.assemble::<N>(mechanism, t, &self.phi, omega);
        let (mass, load, given) = (&kernel.mass[..n * n], &mut kernel.load[..n], &mut self.given[..n]);
        // b - M s''; what of it the coordinates do not feel is the motors' share.
        if !self.is_steady {
            tree::multiply::<f64, N>(n, mass, drive_acceleration, given);
            for k in 0..n {
                load[k] -= given[k];
            }
        }
        let (reduced, acceleration) = (&mut self.reduced[..f * f], &mut self.coordinate_acceleration[..f]);
        for a in 0..f {
            acceleration[a] = 0.0;
            for b in a..f {
                reduced[a * f + b] = 0.0;
            }
        }
        for i in 0..n {
            let Some(a) = ties[i].base else { continue };
            acceleration[a] += load[i];
            reduced[a * f + a] += mass[i * n + i];
            for j in i + 1..n {
                let Some(b) = ties[j].base else { continue };
                let twice = if a == b { 2.0 } else { 1.0 };
                reduced[a.min(b) * f + a.max(b)] += twice * mass[i * n + j];
            }
        }
        tree::factor::<f64, F>(f, reduced, &mut self.pivot);
        tree::solve::<f64, F>(f, reduced, &self.pivot, acceleration);
        let share = &mut self.share[..n];
        for k in 0..n {
            share[k] = ties[k].base.map_or(0.0, |base| acceleration[base]);
        }
        tree::multiply::<f64, N>(n, mass, share, given);
        let mut power = 0.0;
        for k in 0..n {
            power -= (load[k] - given[k]) * drive_rate[k];
        }
        power += mechanism.force_power(t, Posture { phi: &self.phi, z: &kernel.z, omega });
        rate[..f].copy_from_slice(&u_rate[..f]);
        rate[f..2 * f].copy_from_slice(&acceleration[..f]);
        rate[2 * f] = power;
    }
}

impl<const N: usize> Field for Elimination<N> {
    fn dimension(&self) -> usize {
        2 * self.mechanism.ties.count() + 1
    }

    fn angles(&self) -> usize {
        self.mechanism.ties.turning()
    }

    fn rate(&mut self, t: Time, y: &[f64], rate: &mut [f64]) {
        match self.mechanism.ties.count() {
            1 => self.rate_sized::<1>(t, y, rate),
            2 => self.rate_sized::<2>(t, y, rate),
            _ => self.rate_sized::<0>(t, y, rate),
        }
    }

    fn fine_rate(&mut self, t: Time, y: &[f64], low: &[f64], rate: &mut [f64]) {
        let ties = &self.mechanism.ties;
        for (k, tie) in ties.bodies.iter().enumerate() {
            self.phi[k] = tie.place(t, y).angle;
            self.low[k] = tie.base.map_or(0.0, |base| low[base]);
        }
        self.kernel.measure(&self.mechanism, &self.phi, &self.low);
        self.rate(t, y, rate);
        self.kernel.stretch.clear();
    }

    fn jacobian(&mut self, t: Time, y: &[f64], y_by_y: &mut [f64]) -> bool {
        let mechanism = &*self.mechanism;
        let ties = &mechanism.ties;
        let f = ties.count();
        for (k, tie) in ties.bodies.iter().enumerate() {
            let placed = tie.place(t, &y[..f]);
            self.phi[k] = placed.angle;
            self.omega[k] = placed.rate + tie.base.map_or(0.0, |base| y[f + base]);
        }
        let jacobian = self.jacobian.get_or_insert_with(|| Box::new(Jacobian::new(mechanism)));
        jacobian.evaluate(mechanism, t, &self.phi, &self.omega, Bias::default());
        jacobian.fill_independent(ties, y_by_y);
        true
    }

    fn label(&self, i: usize) -> String {
        let ties = &self.mechanism.ties;
        let f = ties.count();
        match i {
            i if i < f => self.mechanism.coordinate_name(ties.independent[i]),
            i if i < 2 * f => self.mechanism.rate_name(ties.independent[i - f]),
            _ => "work of motors and forces".into(),
        }
    }

    fn unit(&self, i: usize) -> f64 {
        self.mechanism.unit_of(i, self.mechanism.ties.count(), self.mechanism.ties.turning())
    }

    fn time_unit(&self) -> f64 {
        self.mechanism.units.time
    }

    fn events(&self) -> usize {
        self.mechanism.contacts.len()
    }

    fn gaps(&mut self, t: Time, y: &[f64], gaps: &mut [f64]) {
        let ties = &self.mechanism.ties;
        let kernel = &mut self.kernel;
        for (z, tie) in kernel.z.iter_mut().zip(&ties.bodies[..ties.angles]) {
            *z = tie.place(t, &y[..ties.count()]).unit;
        }
        ties.feet(y, &mut kernel.z);
        for (gap, contact) in gaps.iter_mut().zip(&self.mechanism.contacts) {
            *gap = contact.gap(&kernel.z);
        }
    }

    fn watched(&self) -> usize {
        self.mechanism.ties.count()
    }

    fn gap(&self, event: usize, along: Along) -> Option<[f64; 3]> {
        let Along { time, pace, y, slope } = along;
        let ties = &self.mechanism.ties;
        self.mechanism.contacts[event].gap_along(|k| {
            let tie = &ties.bodies[k];
            if k < ties.angles {
                let placed = tie.place(time, &y[..ties.count()]);
                return turning(placed.unit, pace * placed.rate + tie.base.map_or(0.0, |base| slope[base]));
            }
            tie.base.map_or([Complex::ZERO; 2], |x| [Complex::new(y[x], y[x + 1]), Complex::new(slope[x], slope[x + 1])])
        })
    }

    fn gap_bend(&self, event: usize, t: f64, pace: f64, first: &[f64], second: &[f64]) -> f64 {
        let ties = &self.mechanism.ties;
        let most = |k: usize| {
            let tie = &ties.bodies[k];
            let start = tie.base.map_or([0.0; 2], |base| [second[base], first[base]]);
            tie.laws.iter().fold(start, |[second, first], (_, law)| {
                let [rate, acceleration] = law.bounds(t);
                [second + pace * pace * acceleration, first + pace * rate]
            })
        };
        self.mechanism.contacts[event].gap_bend(most)
    }
}

impl<const N: usize> Form for Elimination<N> {
    fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::Independent
    }

    fn state(&self, motion: &Motion) -> State {
        let ties = &self.mechanism.ties;
        let mut unknowns: Vec<DoubleDouble> = ties.independent.iter().map(|&body| motion.phi[body]).collect();
        unknowns.extend(ties.coordinate_rates(motion));
        unknowns.push(motion.work);
        let mut state = ties.state(motion, &unknowns);
        if self.mechanism.is_winding() {
            state.unwind();
        }
        state
    }

    fn read(&mut self, state: &State, motion: &mut Motion) {
        let f = self.mechanism.ties.count();
        self.mechanism.ties.read_angles(state, motion);
        for (omega, tie) in motion.omega.iter_mut().zip(&self.mechanism.ties.bodies) {
            if let Some(base) = tie.base {
                *omega += state.unknown(f + base);
            }
        }
        motion.work = state.unknown(2 * f);
    }

    fn glance(&mut self, state: &State, glance: &mut Glance) {
        let n = self.mechanism.coordinates();
        // Where nothing is driven the coordinates are the angles, in the same order.
        if self.mechanism.ties.count() == n {
            return glance.take_leading(state, n);
        }
        let mut motion = Motion::default();
        self.read(state, &mut motion);
        glance.take(&motion);
    }
}
