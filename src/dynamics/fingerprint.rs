//! What tells one mechanism from another: what it is made of, and what it does at a moment, to the bit.

use super::constraint::{ConstraintArguments, Site};
use super::force::UserForce;
use super::kernel::{Bias, Kernel};
use super::{Mechanism, Motion};
use crate::arithmetic::Complex;
use crate::arithmetic::tape::Tape;
use crate::scene::Scene;
use std::sync::Arc;

/// The start and the factor of the hash FNV-1a of 64 bits.
const FNV: [u64; 2] = [0xcbf2_9ce4_8422_2325, 0x0000_0100_0000_01b3];
/// Keys of a scene that are no part of its mechanism.
const OF_THE_RUN: [&str; 4] = ["name", "description", "until", "every"];

/// The scene of a mechanism; mechanisms are the same by their equations, from whatever scenes.
#[derive(Clone, Debug)]
pub(crate) struct CompiledScene(pub Arc<Scene>);

impl PartialEq for CompiledScene {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// A hash of bytes in their order, the same in every process.
pub(in crate::dynamics) struct Hash(u64);

impl Hash {
    fn bytes(&mut self, bytes: &[u8]) {
        self.0 = bytes.iter().fold(self.0, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(FNV[1]));
    }

    /// A text with its length: what follows is told from it.
    fn text(&mut self, text: &str) {
        self.count(text.len());
        self.bytes(text.as_bytes());
    }

    pub fn count(&mut self, count: usize) {
        self.bytes(&(count as u64).to_le_bytes());
    }

    /// A number by its bits; all that are not numbers count alike.
    pub fn number(&mut self, x: f64) {
        self.bytes(&if x.is_nan() { f64::NAN } else { x }.to_bits().to_le_bytes());
    }

    fn vector(&mut self, z: Complex<f64>) {
        self.number(z.re);
        self.number(z.im);
    }

    pub fn tape(&mut self, tape: &Tape) {
        self.count(tape.operations().len());
        for operation in tape.operations() {
            let (codes, number) = operation.signature();
            codes.iter().for_each(|&code| self.count(code as usize));
            self.number(number);
        }
    }

    fn site(&mut self, Site { body, point }: &Site) {
        self.count(body.map_or(0, |body| body + 1));
        self.vector(point.root);
        self.count(point.terms.len());
        for &(body, arm) in &point.terms {
            self.count(body);
            self.vector(arm);
        }
        for &(coordinate, times) in &point.shifts {
            self.count(coordinate);
            self.number(times);
        }
    }

    /// A force from outside: its tapes, what their inputs are, and on what their results act.
    fn force(&mut self, force: &UserForce) {
        self.text(&force.name);
        self.count(force.sites.len());
        force.sites.iter().for_each(|site| self.site(site));
        force.hash_tapes(self);
    }

    /// All parts of a scene and its start, as they are written.
    fn scene(&mut self, scene: &Scene) {
        let mut written = scene.to_input();
        if let Some(keys) = written.as_object_mut() {
            OF_THE_RUN.iter().for_each(|key| drop(keys.remove(*key)));
        }
        self.text(&written.to_string());
    }
}

impl Mechanism {
    /// A hash of its scene and of forces from outside, and of its energies, accelerations, multipliers and
    /// formulas' forces at a motion.
    ///
    /// Another one is all but certain where anything is another, whether it acts there or not.
    pub(crate) fn fingerprint(&self, motion: &Motion) -> u64 {
        let mut hash = Hash(FNV[0]);
        hash.scene(&self.origin.0);
        self.forces_from_outside().iter().for_each(|force| hash.force(force));
        let [phi, omega] = motion.rounded();
        let mut kernel = Kernel::<f64>::new(self);
        let energy = self.energy(&mut kernel, &phi, &omega);
        kernel.accelerations(self, motion.time, &phi, &omega, Bias::default());
        let z = self.elements(&phi);
        let at = ConstraintArguments { phi: &phi, z: &z, omega: &omega };
        let forces = self.with_all_parts().forces.iter();
        let forces = forces.flat_map(|force| force.magnitudes(motion.time.hi, at));
        let solved = kernel.load[..phi.len()].iter().chain(&kernel.multiplier).copied();
        let numbers = [energy.kinetic, energy.potential].into_iter().chain(solved).chain(forces);
        numbers.for_each(|x| hash.number(x));
        hash.0
    }
}
