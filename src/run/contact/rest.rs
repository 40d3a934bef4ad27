//! How infinitely many bounces end, told from the last of them.
//!
//! ```text
//! v_k = e^k v      v: rebound where the search for impacts ends,  a: acceleration towards the wall
//! end      Σ 2 v_k / a = 2 v / (a (1 - e))
//! impulse  what all bounces give, less what the wall gives from now on to their end:  -v / a_nn, friction with it
//! ```
//!
//! Holding the point at once with that impulse leaves the rates where all bounces would, and the place to the
//! height of the last one.

use super::super::running::Outcome;
use super::super::saltation::plain;
use super::{ContactDriver, NO_SPEED, in_modes};
use crate::dynamics::Motion;
use crate::dynamics::constraint::Posture;
use crate::dynamics::contact::metric::Gradient;
use crate::dynamics::friction::{Mode, Normal};
use crate::dynamics::kernel::{Bias, Kernel, dot};

impl ContactDriver {
    /// How long a point would go on bouncing \[s\], of a wall that is to be held beside `contacts`, with the
    /// places with friction in these modes.
    pub(super) fn bounces_last(
        &self,
        contact: usize,
        contacts: &[usize],
        modes: &[Mode],
        motion: &Motion,
    ) -> f64 {
        let [phi, omega] = plain(motion);
        let z = self.free.elements(&phi);
        let wall = &self.free.contacts[contact];
        let speed = wall.gap_rate(motion.time, &phi, &z, &omega);
        if speed <= NO_SPEED * wall.step_size(&omega) || wall.restitution >= 1.0 {
            return 0.0;
        }
        let others: Vec<usize> = contacts.iter().copied().filter(|&other| other != contact).collect();
        let mut modes = modes.to_vec();
        for (friction, mode) in self.free.frictions.iter().zip(&mut modes) {
            if friction.normal == Normal::Contact(contact) {
                *mode = Mode::Open;
            }
        }
        let flying = in_modes(&self.free, &others, &modes);
        let mut kernel = Kernel::<f64>::new(&flying);
        kernel.accelerate::<0>(&flying, motion.time, &phi, &omega, Bias::default());
        let Gradient { row, along } =
            Gradient::of(&wall.row, motion.time, Posture { phi: &phi, z: &z, omega: &omega });
        let inward = -(dot(&along, &kernel.load) + row.convective);
        let last = 2.0 * speed / (inward * (1.0 - wall.restitution));
        if inward > 0.0 && last.is_finite() { last } else { 0.0 }
    }

    /// Counts a hold from the end of the bounces before it on, so much later \[s\].
    pub(super) fn begin_later(&mut self, contact: usize, by: f64, outcome: &mut Outcome) {
        let Some(held) = self.held.iter_mut().find(|held| held.contact == contact) else { return };
        held.since += by;
        if let Some(kept) = held.kept {
            outcome.holds[kept].t += by;
        }
    }
}
