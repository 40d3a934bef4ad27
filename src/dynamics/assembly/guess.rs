//! Where the search for a start begins.

use super::AssemblyProblem;
use crate::arithmetic::{DoubleDouble, Scalar};
use crate::scene::Scene;

impl AssemblyProblem<'_> {
    /// Other guesses that are tried.
    pub(super) fn guesses(&self) -> usize {
        match self.coordinates() {
            0..=20 => 24,
            21..=60 => 8,
            _ => 2,
        }
    }

    /// The start as the scene has it, with guesses where it has none.
    pub(super) fn guess(&self, scene: &Scene) -> Vec<DoubleDouble> {
        let mut q = self.mechanism.start_as_given(scene).phi;
        for (q, start) in q.iter_mut().zip(&scene.start) {
            *q = DoubleDouble::of(start.phi);
        }
        q
    }

    /// The same with other guesses: the k-th of a fixed set.
    pub(super) fn other_guess(
        &self,
        guess: &[DoubleDouble],
        missing: &[usize],
        k: usize,
    ) -> Vec<DoubleDouble> {
        let mut other = guess.to_vec();
        for &j in missing {
            let spread = if j < self.mechanism.bodies.len() { std::f64::consts::PI } else { 2.0 * self.size };
            other[j] += DoubleDouble::of(spread * shuffled(k, j));
        }
        other
    }

    /// Angles on the turn next to a guess.
    pub(super) fn to_turns_of(&self, q: &mut [DoubleDouble], guess: &[DoubleDouble]) {
        if self.mechanism.is_winding() {
            return;
        }
        for (q, guess) in q.iter_mut().zip(guess).take(self.mechanism.bodies.len()) {
            *q -= DoubleDouble::TAU.scale(((*q - *guess).hi / std::f64::consts::TAU).round());
        }
    }
}

/// Numbers in [-1, 1] without a pattern, the same ones always.
pub(super) fn shuffled(k: usize, j: usize) -> f64 {
    let mut bits = (k as u64) << 32 | j as u64;
    // SplitMix64 (G. L. Steele, D. Lea, C. H. Flood, OOPSLA 2014).
    bits = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^= bits >> 31;
    (bits >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}
