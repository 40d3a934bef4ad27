//! What there is to know of a moment: positions, energies, constraints, motors.
//!
//! Energies and constraints are evaluated in double-double, so that what is reported is the run's drift and
//! not the rounding of its measurement.

use crate::arithmetic::{Complex, DoubleDouble, Scalar};
use crate::dynamics::constraint::{ConstraintArguments, ConstraintEquation};
use crate::dynamics::energy::Energy;
use crate::dynamics::kernel::{Bias, Kernel};
use crate::dynamics::output::{Moment, OutputScratch};
use crate::dynamics::{Mechanism, Motion};
use std::sync::Arc;

/// Share of the weakest row below which singular values are formed.
const WATCHED: f64 = 0.1;

/// One moment of a run.
#[derive(Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Sample {
    /// Time \[s\].
    pub t: f64,
    /// Winding angles of all bodies \[rad\], then positions of translational coordinates \[m\].
    pub phi: Vec<f64>,
    /// Rates \[rad/s, m/s\].
    pub omega: Vec<f64>,
    /// Centres of mass (x, y) \[m\].
    pub centre: Vec<[f64; 2]>,
    /// Their velocities \[m/s\].
    pub velocity: Vec<[f64; 2]>,
    /// Kinetic and potential energy \[J\].
    pub kinetic: f64,
    /// Potential energy \[J\].
    pub potential: f64,
    /// Work of motors and dampers since the start \[J\].
    pub work: f64,
    /// Energy the stabilizer has put in \[J\].
    pub stabilizer: f64,
    /// Energy lost in dry friction since the start \[J\], which the work has as well.
    pub friction: f64,
    /// (Energy - energy at the start - work - energy of impacts) / energy scale.
    pub imbalance: f64,
    /// Violation of each row, C and C'.
    pub constraints: Vec<[f64; 2]>,
    /// The least singular value of the rows' Jacobian over the largest, where it is small.
    pub singular: Option<f64>,
    /// The row that loses its hold there.
    pub weakest: usize,
    /// Torque \[N·m\] on the driven body, or force \[N\] along the rail on the point that slides, and power
    /// \[W\] of each row that a motor, lock or weld keeps at a law; zeros for others.
    pub motors: Vec<[f64; 2]>,
    /// Values of the scene's outputs, in their order.
    pub outputs: Vec<f64>,
}

impl Clone for Sample {
    fn clone(&self) -> Self {
        let mut sample = Self::default();
        sample.clone_from(self);
        sample
    }

    /// Allocates nothing where there is room: copies are made every row.
    fn clone_from(&mut self, other: &Self) {
        self.thin_from(other);
        self.centre.clone_from(&other.centre);
        self.velocity.clone_from(&other.velocity);
    }
}

impl Sample {
    /// Copies all but positions and velocities of the centres, which follow from the angles.
    pub(super) fn thin_from(&mut self, other: &Self) {
        let Self { t, kinetic, potential, work, stabilizer, friction, imbalance, .. } = *other;
        (self.singular, self.weakest) = (other.singular, other.weakest);
        self.friction = friction;
        (self.t, self.kinetic, self.potential) = (t, kinetic, potential);
        (self.work, self.stabilizer, self.imbalance) = (work, stabilizer, imbalance);
        self.phi.clone_from(&other.phi);
        self.omega.clone_from(&other.omega);
        self.constraints.clone_from(&other.constraints);
        self.motors.clone_from(&other.motors);
        self.outputs.clone_from(&other.outputs);
    }

    /// False where any number of it is not finite; nothing after that means anything.
    pub fn is_finite(&self) -> bool {
        let scalars = [self.t, self.kinetic, self.potential, self.work, self.stabilizer, self.imbalance];
        // Motors have no value at singular positions.
        let vectors = [&self.centre, &self.velocity, &self.constraints];
        scalars
            .iter()
            .chain(&self.phi)
            .chain(&self.omega)
            .chain(vectors.into_iter().flatten().flatten())
            .all(|x| x.is_finite())
    }
}

/// Takes samples.
#[derive(Clone, Debug)]
pub struct Sampler {
    mechanism: Arc<Mechanism>,
    /// The mechanism with the contacts held at the moment: forces are those of its rows.
    holding: Arc<Mechanism>,
    plain: Kernel<f64>,
    exact: Kernel<DoubleDouble>,
    jacobian: Vec<DoubleDouble>,
    phi: Vec<f64>,
    omega: Vec<f64>,
    /// Translational coordinates of all bodies, and their velocities.
    translations: [Vec<Complex<f64>>; 2],
    /// Energy less work at the start, in full; impacts shift it.
    reference: Option<DoubleDouble>,
    sample: Sample,
    scratch: OutputScratch,
    /// True where the last sample was of a singular position.
    pub was_singular: bool,
}

impl Sampler {
    /// A sampler; the first sample it takes is the reference of the energy balance.
    pub fn new(mechanism: Arc<Mechanism>) -> Self {
        let (n, bars, rows) = (mechanism.coordinates(), mechanism.bodies.len(), mechanism.constraints.len());
        Self {
            plain: Kernel::new(&mechanism),
            exact: Kernel::without_rows(&mechanism),
            translations: [vec![Complex::ZERO; bars], vec![Complex::ZERO; bars]],
            jacobian: vec![DoubleDouble::ZERO; n],
            phi: vec![0.0; n],
            omega: vec![0.0; n],
            reference: None,
            sample: Sample {
                phi: vec![0.0; n],
                omega: vec![0.0; n],
                centre: vec![[0.0; 2]; bars],
                velocity: vec![[0.0; 2]; bars],
                constraints: vec![[0.0; 2]; rows],
                motors: vec![[0.0; 2]; rows],
                ..Sample::default()
            },
            scratch: OutputScratch::default(),
            was_singular: false,
            holding: Arc::clone(&mechanism),
            mechanism,
        }
    }

    /// From here on the forces are those of `mechanism`, the sampler's own one with other contacts held.
    pub fn hold(&mut self, mechanism: Arc<Mechanism>) {
        self.plain = Kernel::new(&mechanism);
        self.holding = mechanism;
    }

    /// From here on energies are those of `free`, the same mechanism with other parts that act, and forces
    /// those of `holding`.
    pub fn exchange(&mut self, free: Arc<Mechanism>, holding: Arc<Mechanism>) {
        self.mechanism = free;
        self.hold(holding);
    }

    /// Energy less work at the start, shifted by impacts \[J\]; `None` before the first sample.
    pub fn reference(&self) -> Option<DoubleDouble> {
        self.reference
    }

    /// Takes another sampler's reference.
    pub fn refer(&mut self, reference: Option<DoubleDouble>) {
        self.reference = reference;
    }

    /// Shifts the reference by the energy an impact changed \[J\].
    pub fn shift(&mut self, energy: DoubleDouble) {
        if let Some(reference) = &mut self.reference {
            *reference += energy;
        }
    }

    /// Energy less work of a motion \[J\], in full.
    pub fn balance(&mut self, motion: &Motion) -> DoubleDouble {
        self.mechanism.exact_energy(&mut self.exact, motion).total() - motion.work
    }

    /// Samples a motion.
    pub fn take(&mut self, motion: &Motion) -> &Sample {
        let mechanism = &*self.mechanism;
        let Energy { kinetic, potential } = mechanism.exact_energy(&mut self.exact, motion);
        let balance = kinetic + potential - motion.work;
        let reference = *self.reference.get_or_insert(balance);
        for k in 0..mechanism.coordinates() {
            (self.phi[k], self.omega[k]) = (motion.phi[k].hi, motion.omega[k].hi);
        }
        if self.holding.constraints.is_empty() && mechanism.outputs.is_none() {
            self.plain.unit_vectors::<0>(mechanism, &self.phi);
        } else {
            self.plain.accelerations(&self.holding, motion.time, &self.phi, &self.omega, Bias::default());
        }
        if mechanism.constraints.iter().any(ConstraintEquation::moves) {
            self.holding.share_multipliers(motion.time, &mut self.plain, &self.phi, &self.omega);
        }
        // Places that rest or stick side by side may depend on each other: no singular position.
        let weakest = self.plain.weakest;
        let is_standing = weakest.row < self.holding.standing_rows();
        let is_watched = weakest.share < WATCHED && is_standing && self.holding.has_closed_loops();
        let sample = &mut self.sample;
        sample.singular = is_watched.then(|| self.holding.conditioning(&self.plain));
        sample.weakest = weakest.row;
        sample.t = motion.time.hi;
        let of_integrals = mechanism.energy_of_integrals(&motion.omega);
        sample.kinetic = (kinetic - of_integrals).hi;
        sample.potential = potential.hi;
        sample.work = (motion.work - of_integrals).hi;
        sample.stabilizer = motion.stabilizer;
        sample.friction = motion.friction;
        sample.imbalance = (balance - reference).hi / mechanism.energy_scale;
        let both = |vector: Complex<f64>| [vector.re, vector.im];
        for k in 0..mechanism.coordinates() {
            sample.phi[k] = motion.unwrapped(k);
        }
        sample.omega.copy_from_slice(&self.omega);
        let at = (&self.plain.z[..], &self.omega[..]);
        mechanism.forest.each_centre(&mechanism.bodies, at, &mut self.translations, |k, centre, velocity| {
            (sample.centre[k], sample.velocity[k]) = (both(centre), both(velocity));
        });
        for (r, row) in mechanism.constraints.iter().enumerate() {
            self.jacobian.fill(DoubleDouble::ZERO);
            let configuration =
                ConstraintArguments { phi: &motion.phi, z: &self.exact.z, omega: &motion.omega };
            let here = row.linearise(motion.time, configuration, &mut self.jacobian);
            let rate = self.jacobian.iter().zip(&motion.omega).fold(here.drive, |sum, (&g, &w)| sum + g * w);
            sample.constraints[r] = [here.position.hi, rate.hi];
            let force = -self.plain.multiplier[r];
            sample.motors[r] = if row.moves() { [force, -force * here.drive.hi] } else { [0.0, 0.0] };
        }
        // Where it stays at a singular position no limit is hidden.
        let is_singular = self.holding.hides_forces(&self.plain);
        let is_hidden = is_singular && !self.was_singular;
        self.was_singular = is_singular;
        if is_hidden {
            let moving = mechanism.constraints.iter().zip(&mut sample.motors).filter(|(row, _)| row.moves());
            moving.for_each(|(_, motor)| *motor = [f64::NAN; 2]);
        }
        if let Some(outputs) = &mechanism.outputs {
            let moment = Moment {
                mechanism: &self.holding,
                time: motion.time,
                phi: &self.phi,
                winding: &sample.phi,
                omega: &self.omega,
                kernel: &self.plain,
            };
            sample.outputs.clear();
            outputs.evaluate(&moment, &mut self.scratch, &[], &mut sample.outputs);
            if is_hidden {
                outputs.withhold(&mut sample.outputs);
            }
        }
        sample
    }
}
