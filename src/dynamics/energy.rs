//! Kinetic and potential energy, their sum, and the scale drift is measured against.
//!
//! Written over the scalar trait and used in double-double by the monitors: at 1e-15 of the scale an energy evaluated in plain doubles shows
//! its own rounding.

use super::kernel::{Kernel, dot};
use super::{Mechanism, Motion, tree};
#[cfg(target_arch = "x86_64")]
use crate::arithmetic::lanes;
use crate::arithmetic::{DoubleDouble, Real, Scalar};
use crate::scene::Scene;

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

/// The one place where the monitors' code for the processor at hand is entered.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx,fma")]
fn fused_energy(mechanism: &Mechanism, kernel: &mut Kernel<DoubleDouble>, motion: &Motion) -> Energy<DoubleDouble> {
    mechanism.energy(kernel, &motion.phi, &motion.omega)
}

impl Mechanism {
    /// The scene's start as a motion; angles are reduced from the very doubles given.
    pub fn start(&self, scene: &Scene) -> Motion {
        let mut motion = Motion::default();
        for start in &scene.start {
            let (phi, turns) = DoubleDouble::of(start.phi).reduced();
            motion.phi.push(phi);
            motion.turns.push(turns as i64);
            motion.omega.push(DoubleDouble::of(start.omega));
        }
        motion
    }

    /// Energies of a motion in double-double, by the processor's fused multiply-add where it has one; overwrites `kernel`.
    ///
    /// The bits are those of [`Mechanism::energy`]: a fused multiply-add is rounded once, whoever computes it.
    pub fn exact_energy(&self, kernel: &mut Kernel<DoubleDouble>, motion: &Motion) -> Energy<DoubleDouble> {
        #[cfg(target_arch = "x86_64")]
        if lanes::available() {
            // SAFETY: the processor has been asked.
            #[allow(unsafe_code)]
            return unsafe { fused_energy(self, kernel, motion) };
        }
        self.energy(kernel, &motion.phi, &motion.omega)
    }

    /// Energies of a motion; overwrites `kernel`.
    #[inline(always)]
    pub fn energy<T: Real>(&self, kernel: &mut Kernel<T>, phi: &[T], omega: &[T]) -> Energy<T> {
        kernel.face::<0>(phi);
        self.energy_facing::<T, 0>(kernel, omega)
    }

    /// Energies at the unit vectors in `kernel`, which holds M and its twist afterwards; for `N` bodies (any number where `N` is 0).
    #[inline(always)]
    pub fn energy_facing<T: Real, const N: usize>(&self, kernel: &mut Kernel<T>, omega: &[T]) -> Energy<T> {
        let n = tree::size::<N>(self.bodies.len());
        self.tree.couple::<T, N>(&kernel.z, &mut kernel.mass, &mut kernel.twist);
        tree::multiply::<T, N>(n, &kernel.mass, omega, &mut kernel.load);
        let ground = self.bodies.iter().fold(0.0, |sum, body| sum - body.mass * self.gravity.dot(body.centre.root));
        let gravity = self.tree.gravity_energy(&kernel.z) + T::of(ground);
        Energy {
            kinetic: dot(omega, &kernel.load).scale(0.5),
            potential: self.springs.iter().fold(gravity, |sum, spring| sum + spring.energy(&kernel.z)),
        }
    }

    /// Work of gravity from hanging to horizontal, Σ |weight_k|, plus kinetic and spring energy at the start \[J\]; 1 J where all of these are zero.
    pub fn scale_of_energy(&self, start: &Motion) -> f64 {
        let mut kernel = Kernel::<DoubleDouble>::new(self.bodies.len(), 0);
        let kinetic = self.energy(&mut kernel, &start.phi, &start.omega).kinetic.hi;
        let springs: f64 = self.springs.iter().map(|spring| spring.energy(&kernel.z).hi).sum();
        let gravity: f64 = self.tree.weight.iter().map(|weight| weight.norm_squared().sqrt()).sum();
        let scale = gravity + kinetic + springs;
        if scale > 0.0 { scale } else { 1.0 }
    }
}
