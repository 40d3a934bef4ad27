//! Kinetic and potential energy, their sum, and the scale drift is measured against.
//!
//! Written over the scalar trait and used in double-double by the monitors: at 1e-15 of the scale an energy
//! evaluated in plain doubles shows its own rounding.

use super::compile::CompileError;
use super::constraint::ConstraintArguments;
use super::force::UserForce;
use super::force::action::Applied;
use super::kernel::{Kernel, dot};
use super::{Mechanism, Motion, Time, tree};
use crate::arithmetic::lanes::{self, Code, Lanes};
use crate::arithmetic::{Complex, DoubleDouble, Dual, Real, Scalar};
use crate::scene::{Integral, Scene};

/// Share of the energy that gravity on free bodies and applied forces can bring below which what is there at
/// the start does not count.
const LEAST_SCALE: f64 = 1e-3;

/// Energies at one moment \[J\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy<T> {
    /// Kinetic.
    pub kinetic: T,
    /// Of gravity (zero where all centres of mass lie level with the origin) and springs.
    pub potential: T,
}

impl<T: Scalar> Energy<T> {
    /// Kinetic plus potential \[J\].
    pub fn total(&self) -> T {
        self.kinetic + self.potential
    }
}

/// Energies of a motion, by the processor's fused multiply-add where it has one.
struct ExactEnergy<'a> {
    mechanism: &'a Mechanism,
    kernel: &'a mut Kernel<DoubleDouble>,
    motion: &'a Motion,
}

impl Code for ExactEnergy<'_> {
    type Output = Energy<DoubleDouble>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Energy<DoubleDouble> {
        self.mechanism.energy(self.kernel, &self.motion.phi, &self.motion.omega)
    }
}

/// A time as a number of some kind.
#[inline(always)]
pub(super) fn moment<T: Real>(t: Time) -> T {
    T::split(t).0
}

impl Mechanism {
    /// Magnitudes of the forces from outside at a motion, times `size` \[m\], and of their torques \[J\].
    pub(super) fn forces_at_start(&self, start: &Motion, size: f64) -> f64 {
        let [phi, omega] = start.rounded();
        let z = self.elements(&phi);
        let magnitudes = self.forces.iter().map(|force| {
            force.magnitudes(start.time.hi, ConstraintArguments { phi: &phi, z: &z, omega: &omega })
        });
        magnitudes.map(|[force, torque]| force * size + torque).sum()
    }

    /// Refuses forces of formulas that have no finite value at the start.
    pub(super) fn check_forces(&self, scene: &Scene, start: &Motion) -> Result<(), CompileError> {
        let [phi, omega] = start.rounded();
        let z = self.elements(&phi);
        // Springs of no length stop with a message of their own.
        let acting = |force: &&UserForce| force.span.is_none() && !scene.is_inactive(&force.name);
        for force in self.forces.iter().filter(acting) {
            let at = ConstraintArguments { phi: &phi, z: &z, omega: &omega };
            let value = force.magnitudes(start.time.hi, at).into_iter().find(|value| !value.is_finite());
            if let Some(value) = value {
                return Err(CompileError::NotFinite { force: force.name.clone(), value });
            }
        }
        Ok(())
    }

    /// Kinetic energy of the rotors that carry integrals \[J\], and the work of their torques: no energy of
    /// the scene.
    pub fn energy_of_integrals<T: Real>(&self, omega: &[T]) -> T {
        let half = T::of(0.5 * Integral::INERTIA);
        self.integrals().fold(T::ZERO, |sum, (_, rotor)| sum + half * omega[rotor] * omega[rotor])
    }

    /// The scene's start as a motion: found from the rows where a part of it can be, else as given.
    pub fn start(&self, scene: &Scene) -> Motion {
        self.assembly.start.clone().unwrap_or_else(|| self.start_as_given(scene))
    }

    /// The start as given, with guesses; angles are reduced from the very doubles given.
    pub(super) fn start_as_given(&self, scene: &Scene) -> Motion {
        let mut motion = Motion::default();
        for start in &scene.start {
            let full = DoubleDouble::of(start.phi);
            let (phi, turns) = if self.is_winding() { (full, 0.0) } else { full.reduced() };
            motion.phi.push(phi);
            motion.turns.push(turns as i64);
            motion.omega.push(DoubleDouble::of(start.omega));
        }
        self.put_translations(scene, &mut motion);
        motion
    }

    /// Positions and velocities of translational coordinates, from those given for the origin of some bar of
    /// each group.
    pub(super) fn put_translations(&self, scene: &Scene, motion: &mut Motion) {
        let bars = self.bodies.len();
        if bars == self.coordinates() {
            return;
        }
        motion.resize(self.coordinates());
        let mut kernel = Kernel::<DoubleDouble>::without_rows(self);
        kernel.unit_vectors::<0>(self, &motion.phi);
        for x in (bars..self.coordinates()).step_by(2) {
            let is_carried =
                |&k: &usize| self.end(k, 0).point.shifts.first().is_some_and(|shift| shift.0 == x);
            let group: Vec<usize> = (0..bars).filter(is_carried).collect();
            let given = |k: &usize| scene.given.get(*k);
            let origin = group.iter().find_map(|k| Some((*k, given(k)?.origin?)));
            if let Some((k, [at_x, at_y])) = origin {
                // Counted from the origin, wherever that was.
                kernel.z[x] = Complex::ZERO;
                let reach = self.end(k, 0).point.position(&kernel.z);
                (motion.phi[x], motion.phi[x + 1]) =
                    (DoubleDouble::of(at_x) - reach.re, DoubleDouble::of(at_y) - reach.im);
            }
            let velocity = group.iter().find_map(|k| Some((*k, given(k)?.velocity?)));
            if let Some((k, [v_x, v_y])) = velocity {
                (motion.omega[x], motion.omega[x + 1]) = (DoubleDouble::ZERO, DoubleDouble::ZERO);
                let swing = self.end(k, 0).point.velocity(&kernel.z, &motion.omega);
                (motion.omega[x], motion.omega[x + 1]) =
                    (DoubleDouble::of(v_x) - swing.re, DoubleDouble::of(v_y) - swing.im);
            }
        }
    }

    /// Energies of a motion in double-double, by the processor's fused multiply-add where it has one;
    /// overwrites `kernel`.
    ///
    /// The bits are those of [`Mechanism::energy`]: a fused multiply-add is rounded once, whoever computes
    /// it.
    pub fn exact_energy(&self, kernel: &mut Kernel<DoubleDouble>, motion: &Motion) -> Energy<DoubleDouble> {
        lanes::run(ExactEnergy { mechanism: self, kernel, motion }, false)
    }

    /// Energies of a motion; overwrites `kernel`.
    #[inline(always)]
    pub fn energy<T: Real>(&self, kernel: &mut Kernel<T>, phi: &[T], omega: &[T]) -> Energy<T> {
        kernel.unit_vectors::<0>(self, phi);
        self.energy_facing::<T, 0>(kernel, phi, omega)
    }

    /// Energies at the elements in `kernel` and the coordinates they stand for; it holds M and its twist
    /// afterwards; for `N` bodies (any number where `N` is 0).
    #[inline(always)]
    pub fn energy_facing<T: Real, const N: usize>(
        &self,
        kernel: &mut Kernel<T>,
        phi: &[T],
        omega: &[T],
    ) -> Energy<T> {
        if N == 0 && !kernel.translations[0].is_empty() {
            return self.energy_bodywise(kernel, phi, omega);
        }
        let n = tree::size::<N>(self.coordinates());
        self.tree.mass_matrix::<T, N>(&kernel.z, &mut kernel.mass, &mut kernel.twist);
        tree::multiply::<T, N>(n, &kernel.mass, omega, &mut kernel.load);
        let gravity = self.tree.gravity_energy(&kernel.z) + T::of(self.ground_energy);
        let springs = self.springs.iter().fold(gravity, |sum, spring| sum + spring.energy(&kernel.z));
        let vibration = self.vibration.as_ref().map(|vibration| vibration.potential(&kernel.z, &kernel.mass));
        let elastic = vibration.map_or(springs, |potential| springs + potential);
        Energy {
            kinetic: dot(omega, &kernel.load).scale(0.5),
            potential: self.other_energy(
                &kernel.z,
                phi,
                self.torsions.iter().fold(elastic, |sum, torsion| sum + torsion.energy(phi)),
            ),
        }
    }

    /// The same body by body, from the motion of every centre of mass.
    #[inline(always)]
    fn energy_bodywise<T: Real>(&self, kernel: &mut Kernel<T>, phi: &[T], omega: &[T]) -> Energy<T> {
        let gravity = Complex::of(self.gravity);
        let (mut kinetic, mut potential) = (T::ZERO, T::ZERO);
        self.forest.each_centre(
            &self.bodies,
            (&kernel.z, omega),
            &mut kernel.translations,
            |k, centre, velocity| {
                let body = &self.bodies[k];
                kinetic += velocity.norm_squared().scale(0.5 * body.mass)
                    + (omega[k] * omega[k]).scale(0.5 * body.inertia);
                potential -= gravity.dot(centre).scale(body.mass);
            },
        );
        Energy { kinetic, potential: potential + self.elastic_energy(&kernel.z, phi) }
    }

    /// Energy of springs and torsion springs \[J\].
    #[inline(always)]
    fn elastic_energy<T: Real>(&self, z: &[Complex<T>], phi: &[T]) -> T {
        let springs = self.springs.iter().fold(T::ZERO, |sum, spring| sum + spring.energy(z));
        self.other_energy(
            z,
            phi,
            self.torsions.iter().fold(springs, |sum, torsion| sum + torsion.energy(phi)),
        )
    }

    /// Adds the potentials of forces from outside \[J\] to a sum.
    #[inline(always)]
    fn other_energy<T: Real>(&self, z: &[Complex<T>], phi: &[T], sum: T) -> T {
        self.forces
            .iter()
            .fold(sum, |sum, force| sum + force.energy(T::ZERO, ConstraintArguments { phi, z, omega: &[] }))
    }

    /// Adds the generalized forces \[N·m, N\] of springs, dampers and applied forces; returns the power of
    /// those that are laws of their own \[W\], which their evaluation has at hand.
    #[inline(always)]
    pub fn add_applied_forces<T: Real>(
        &self,
        t: Time,
        at: ConstraintArguments<T>,
        stretch: &[T],
        load: &mut [T],
    ) -> T {
        for (s, spring) in self.springs.iter().enumerate() {
            let force = match stretch.get(s) {
                Some(&stretch) if spring.free_length > 0.0 => spring.stretched(stretch, at.z, at.omega),
                _ => spring.force(at.z, at.omega),
            };
            spring.span.pull(force, at.z, load);
        }
        for (s, torsion) in self.torsions.iter().enumerate() {
            let torque = match stretch.get(self.springs.len() + s) {
                Some(&stretch) => torsion.drag(at.omega) - stretch.scale(torsion.stiffness),
                None => torsion.torque(at.phi, at.omega),
            };
            torsion.pull(torque, load);
        }
        for action in &self.actions {
            action.pull(action.factor(t), at.z, load);
        }
        self.forces.iter().fold(T::ZERO, |power, force| power + force.pull(moment(t), at, load))
    }

    /// Derivatives of all applied forces by the rates, column by column \[N·m·s\].
    pub(crate) fn drag(&self, t: Time, phi: &[f64], omega: &[f64]) -> Vec<Vec<f64>> {
        let constant = |x: &[f64]| x.iter().map(|&x| Dual::<1>::constant(x)).collect::<Vec<_>>();
        let (phi, mut moved) = (constant(phi), constant(omega));
        let mut z = vec![Complex::ZERO; phi.len()];
        self.tree.unit_vectors::<Dual<1>, 0>(&phi, &mut z);
        let column = |k: usize| {
            moved[k].slope = [1.0];
            let mut load = vec![Dual::<1>::ZERO; phi.len()];
            self.add_applied_forces(
                t,
                ConstraintArguments { phi: &phi, z: &z, omega: &moved },
                &[],
                &mut load,
            );
            moved[k].slope = [0.0];
            load.iter().map(|load| load.slope[0]).collect()
        };
        (0..phi.len()).map(column).collect()
    }

    /// Power of dampers and applied forces on the bodies \[W\].
    pub fn force_power<T: Real>(&self, t: Time, at: ConstraintArguments<T>) -> T {
        let laws = self.forces.iter().fold(T::ZERO, |power, force| power + force.work_rate(moment(t), at));
        self.force_power_beside(t, at, laws)
    }

    /// The same where the power of the [laws](Self::add_applied_forces) is known.
    #[inline(always)]
    pub fn force_power_beside<T: Real>(
        &self,
        t: Time,
        ConstraintArguments { z, omega, .. }: ConstraintArguments<T>,
        laws: T,
    ) -> T {
        let mut power = T::ZERO;
        for spring in self.springs.iter().filter(|spring| spring.damping != 0.0) {
            power += spring.drag_power(z, omega);
        }
        for torsion in self.torsions.iter().filter(|torsion| torsion.damping != 0.0) {
            power += torsion.drag(omega) * torsion.between(omega);
        }
        for action in &self.actions {
            power += action.power(action.factor(t), z, omega);
        }
        power + laws
    }

    /// Work of gravity from hanging to horizontal, Σ |weight_k|, plus kinetic and spring energy at the start
    /// \[J\].  Where all of these are less than a thousandth of it, that of gravity on free bodies and of
    /// applied forces along the size of the mechanism, and of torques over 1 rad; 1 J where these are zero,
    /// too.
    pub fn scale_of_energy(&self, start: &Motion) -> f64 {
        let mut kernel = Kernel::<DoubleDouble>::without_rows(self);
        let kinetic = self.energy(&mut kernel, &start.phi, &start.omega).kinetic.hi;
        let springs: f64 = self.springs.iter().map(|spring| spring.energy(&kernel.z).hi).sum();
        let torsions: f64 = self.torsions.iter().map(|torsion| torsion.energy(&start.phi).hi).sum();
        let gravity: f64 =
            self.tree.weight[..self.bodies.len()].iter().map(|weight| weight.norm_squared().sqrt()).sum();
        let vibration = self.vibration.as_ref().map_or(0.0, |vibration| vibration.energy);
        let known = gravity + kinetic + springs + torsions + vibration;
        let size = self.size_of_parts();
        let falling: f64 =
            self.bodies.iter().map(|body| body.mass * self.gravity.norm_squared().sqrt() * size).sum();
        let applied = self.actions.iter().map(|action| match &action.kind {
            Applied::Force { force, .. } => force.norm_squared().sqrt() * size,
            Applied::Torque { torque, .. } => torque.abs(),
        });
        let moving = falling + applied.sum::<f64>() + self.forces_at_start(start, size);
        // A start almost at rest is one at rest.
        match (known > LEAST_SCALE * moving, moving > 0.0) {
            (true, _) => known,
            (false, true) => moving,
            (false, false) => 1.0,
        }
    }
}
