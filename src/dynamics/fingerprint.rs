//! What tells one mechanism from another: what it does at a moment, to the bit.

use super::constraint::ConstraintArguments;
use super::kernel::{Bias, Kernel};
use super::{Mechanism, Motion};

/// The start and the factor of the hash FNV-1a of 64 bits.
const FNV: [u64; 2] = [0xcbf2_9ce4_8422_2325, 0x0000_0100_0000_01b3];

/// A hash of numbers, by their bits; all that are not numbers count alike.
fn hash(numbers: impl Iterator<Item = f64>) -> u64 {
    let bytes = numbers.flat_map(|x| if x.is_nan() { f64::NAN } else { x }.to_bits().to_le_bytes());
    bytes.fold(FNV[0], |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(FNV[1]))
}

impl Mechanism {
    /// A hash of its energies, accelerations, multipliers and formulas' forces at a motion.
    ///
    /// Another one is all but certain where anything that acts there is another.
    pub(crate) fn fingerprint(&self, motion: &Motion) -> u64 {
        let [phi, omega] = motion.rounded();
        let mut kernel = Kernel::<f64>::new(self);
        let energy = self.energy(&mut kernel, &phi, &omega);
        kernel.accelerations(self, motion.time, &phi, &omega, Bias::default());
        let z = self.elements(&phi);
        let at = ConstraintArguments { phi: &phi, z: &z, omega: &omega };
        let forces = self.with_all_parts().forces.iter();
        let forces = forces.flat_map(|force| force.magnitudes(motion.time.hi, at));
        let solved = kernel.load[..phi.len()].iter().chain(&kernel.multiplier).copied();
        hash([energy.kinetic, energy.potential].into_iter().chain(solved).chain(forces))
    }
}
