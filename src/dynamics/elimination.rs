//! The mechanism with its driven angles eliminated: coordinates u with q = S u + s(t).
//!
//! ```text
//! Sᵀ M S u'' = Sᵀ (b - M s''),      (Gᵀ lambda)_i = b_i - Σ M_ij a_j,
//!     power of all motors = -(b - M a)·s'
//! ```
//!
//! Unknowns: u (f), u' (f), work of motors, dampers and applied forces \[J\].  The rows hold exactly,
//! whatever the method.

use super::constraint::ConstraintArguments;
use super::gap::turning;
use super::jacobian::Jacobian;
use super::kernel::{Bias, Kernel};
use super::tree::{self, size};
use super::{Along, BodyAngles, Coordinates, Form, Mechanism, Motion, OdeSystem, State, Time};
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
        let (n, f) = (mechanism.coordinates(), mechanism.partition.count());
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
            is_steady: mechanism.partition.is_steady(),
            jacobian: None,
            mechanism,
        }
    }

    /// [`OdeSystem::rhs`] for `F` coordinates (any number where `F` is 0).
    #[inline(always)]
    fn rate_sized<const F: usize>(&mut self, t: Time, y: &[f64], rate: &mut [f64]) {
        let mechanism = &*self.mechanism;
        let (n, f) = (size::<N>(mechanism.coordinates()), size::<F>(mechanism.partition.count()));
        let angles = size::<N>(mechanism.partition.angles);
        let (u, u_rate, rate) = (&y[..f], &y[f..2 * f], &mut rate[..2 * f + 1]);
        let partition = &mechanism.partition.bodies[..n];
        let kernel = &mut self.kernel;
        let (drive_rate, drive_acceleration, omega) =
            (&mut self.drive_rate[..n], &mut self.drive_acceleration[..n], &mut self.omega[..n]);
        for k in 0..angles {
            let placed = partition[k].place(t, u);
            (kernel.z[k], drive_rate[k], drive_acceleration[k]) =
                (placed.unit, placed.rate, placed.acceleration);
            omega[k] = drive_rate[k] + partition[k].base.map_or(0.0, |base| u_rate[base]);
            self.phi[k] = placed.angle;
        }
        mechanism.partition.translations(u, &mut kernel.z);
        for k in angles..n {
            omega[k] = partition[k].base.map_or(0.0, |base| u_rate[base]);
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
            let Some(a) = partition[i].base else { continue };
            acceleration[a] += load[i];
            reduced[a * f + a] += mass[i * n + i];
            for j in i + 1..n {
                let Some(b) = partition[j].base else { continue };
                let twice = if a == b { 2.0 } else { 1.0 };
                reduced[a.min(b) * f + a.max(b)] += twice * mass[i * n + j];
            }
        }
        tree::factor::<f64, F>(f, reduced, &mut self.pivot);
        tree::solve::<f64, F>(f, reduced, &self.pivot, acceleration);
        let share = &mut self.share[..n];
        for k in 0..n {
            share[k] = partition[k].base.map_or(0.0, |base| acceleration[base]);
        }
        tree::multiply::<f64, N>(n, mass, share, given);
        let mut power = 0.0;
        for k in 0..n {
            power -= (load[k] - given[k]) * drive_rate[k];
        }
        let at = ConstraintArguments { phi: &self.phi, z: &kernel.z, omega };
        power += mechanism.force_power_beside(t, at, kernel.law_power);
        rate[..f].copy_from_slice(&u_rate[..f]);
        rate[f..2 * f].copy_from_slice(&acceleration[..f]);
        rate[2 * f] = power;
    }
}

impl<const N: usize> OdeSystem for Elimination<N> {
    fn dimension(&self) -> usize {
        2 * self.mechanism.partition.count() + 1
    }

    fn angles(&self) -> usize {
        self.mechanism.partition.turning()
    }

    fn rhs(&mut self, t: Time, y: &[f64], rate: &mut [f64]) {
        match self.mechanism.partition.count() {
            1 => self.rate_sized::<1>(t, y, rate),
            2 => self.rate_sized::<2>(t, y, rate),
            _ => self.rate_sized::<0>(t, y, rate),
        }
    }

    fn fine_rate(&mut self, t: Time, y: &[f64], low: &[f64], rate: &mut [f64]) {
        let partition = &self.mechanism.partition;
        for (k, dependent_angle) in partition.bodies.iter().enumerate() {
            self.phi[k] = dependent_angle.place(t, y).angle;
            self.low[k] = dependent_angle.base.map_or(0.0, |base| low[base]);
        }
        self.kernel.measure(&self.mechanism, &self.phi, &self.low);
        self.rhs(t, y, rate);
        self.kernel.stretch.clear();
    }

    fn jacobian(&mut self, t: Time, y: &[f64], y_by_y: &mut [f64]) -> bool {
        let mechanism = &*self.mechanism;
        let partition = &mechanism.partition;
        let f = partition.count();
        for (k, dependent_angle) in partition.bodies.iter().enumerate() {
            let placed = dependent_angle.place(t, &y[..f]);
            self.phi[k] = placed.angle;
            self.omega[k] = placed.rate + dependent_angle.base.map_or(0.0, |base| y[f + base]);
        }
        let jacobian = self.jacobian.get_or_insert_with(|| Box::new(Jacobian::new(mechanism)));
        jacobian.evaluate(mechanism, t, &self.phi, &self.omega, Bias::default());
        jacobian.fill_independent(partition, y_by_y);
        true
    }

    fn may_grow_by_rates(&self) -> bool {
        self.mechanism.may_grow_by_rates()
    }

    fn label(&self, i: usize) -> String {
        let partition = &self.mechanism.partition;
        let f = partition.count();
        match i {
            i if i < f => self.mechanism.coordinate_name(partition.independent[i]),
            i if i < 2 * f => self.mechanism.rate_name(partition.independent[i - f]),
            _ => "work of motors and forces".into(),
        }
    }

    fn unit(&self, i: usize) -> f64 {
        self.mechanism.unit_of(i, self.mechanism.partition.count(), self.mechanism.partition.turning())
    }

    fn time_unit(&self) -> f64 {
        self.mechanism.units.time
    }

    fn events(&self) -> usize {
        self.mechanism.contacts.len()
    }

    fn gaps(&mut self, t: Time, y: &[f64], gaps: &mut [f64]) {
        let partition = &self.mechanism.partition;
        let kernel = &mut self.kernel;
        for (z, dependent_angle) in kernel.z.iter_mut().zip(&partition.bodies[..partition.angles]) {
            *z = dependent_angle.place(t, &y[..partition.count()]).unit;
        }
        partition.translations(y, &mut kernel.z);
        for (phi, coordinate) in self.phi.iter_mut().zip(&partition.bodies) {
            *phi = coordinate.base.map_or(0.0, |base| y[base]);
        }
        for (gap, contact) in gaps.iter_mut().zip(&self.mechanism.contacts) {
            *gap = contact.gap(t, &self.phi, &kernel.z);
        }
    }

    fn watched(&self) -> usize {
        self.mechanism.partition.count()
    }

    fn gap(&self, event: usize, along: Along) -> Option<[f64; 3]> {
        let Along { time, step_size, y, slope } = along;
        let partition = &self.mechanism.partition;
        self.mechanism.contacts[event].gap_along(&along, |k| {
            let dependent_angle = &partition.bodies[k];
            if k < partition.angles {
                let placed = dependent_angle.place(time, &y[..partition.count()]);
                return turning(
                    placed.unit,
                    step_size * placed.rate + dependent_angle.base.map_or(0.0, |base| slope[base]),
                );
            }
            dependent_angle.base.map_or([Complex::ZERO; 2], |x| {
                [Complex::new(y[x], y[x + 1]), Complex::new(slope[x], slope[x + 1])]
            })
        })
    }

    fn gap_bend(&self, event: usize, t: f64, step_size: f64, first: &[f64], second: &[f64]) -> f64 {
        let partition = &self.mechanism.partition;
        let most = |k: usize| {
            let dependent_angle = &partition.bodies[k];
            let start = dependent_angle.base.map_or([0.0; 2], |base| [second[base], first[base]]);
            dependent_angle.laws.iter().fold(start, |[second, first], (_, law)| {
                let [rate, acceleration] = law.bounds(t);
                [second + step_size * step_size * acceleration, first + step_size * rate]
            })
        };
        self.mechanism.contacts[event].gap_bend(t, step_size, most)
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
        let partition = &self.mechanism.partition;
        let mut unknowns: Vec<DoubleDouble> =
            partition.independent.iter().map(|&body| motion.phi[body]).collect();
        unknowns.extend(partition.coordinate_rates(motion));
        unknowns.push(motion.work);
        self.mechanism.state(motion.time, &unknowns, &partition.turns(motion))
    }

    fn read(&mut self, state: &State, motion: &mut Motion) {
        let f = self.mechanism.partition.count();
        self.mechanism.partition.read(state, motion);
        motion.work = state.unknown(2 * f);
    }

    fn body_angles(&mut self, state: &State, body_angles: &mut BodyAngles) {
        let n = self.mechanism.coordinates();
        // Where nothing is driven the coordinates are the angles, in the same order.
        if self.mechanism.partition.count() == n {
            return body_angles.take_leading(state, n);
        }
        let mut motion = Motion::default();
        self.read(state, &mut motion);
        body_angles.take(&motion);
    }
}
