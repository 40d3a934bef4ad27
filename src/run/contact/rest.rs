//! How infinitely many bounces end, told from the last of them.
//!
//! ```text
//! v_k = e^k v      v: rebound where the search for impacts ends,  a: acceleration towards the wall
//! end      Σ 2 v_k / a = 2 v / (a (1 - e))
//! impulse  what all bounces give, less what the wall gives from now on to their end:  -v / a_nn, friction with it
//! ```
//!
//! Holding the point at once with that impulse leaves the rates where all bounces would, and the place to the
//! height of the last one, where nothing depends on the pressure of the wall but what is on it.  Dry friction in
//! joints does, and takes no part in impulses: until the end it is that of a flight, and what it would do beside
//! a point held at once is taken back.
//!
//! ```text
//! Δw = (a_flight - a_held) T, the constraints kept,   Δq = -T Δw / 2        T: how long all bounces last
//! ```

use super::super::running::Outcome;
use super::super::saltation::plain;
use super::{ContactDriver, NO_SPEED, in_modes};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::constraint::Posture;
use crate::dynamics::contact::metric::Gradient;
use crate::dynamics::friction::{Mode, Normal};
use crate::dynamics::kernel::{Bias, Kernel, dot};
use crate::dynamics::{Mechanism, Motion};

/// A motion between bounces that are left out.
pub(super) struct Flight {
    /// How long all of them last \[s\].
    pub last: f64,
    /// How it goes on from the first.
    course: Course,
}

/// Accelerations of all coordinates, power \[W\], and power that friction takes \[W\].
struct Course {
    accelerations: Vec<f64>,
    power: f64,
    lost: f64,
}

impl Course {
    fn of(mechanism: &Mechanism, motion: &Motion) -> Self {
        let [phi, omega] = plain(motion);
        let mut kernel = Kernel::<f64>::new(mechanism);
        kernel.accelerate::<0>(mechanism, motion.time, &phi, &omega, Bias::default());
        let (power, _) = kernel.powers(mechanism, motion.time, &phi, &omega);
        let lost = kernel.friction_power(&omega);
        Self { accelerations: kernel.load[..phi.len()].to_vec(), power, lost }
    }
}

impl ContactDriver {
    /// The bounces of a point that are left out, of a wall that is to be held beside `contacts`, with the
    /// places with friction in these modes.
    pub(super) fn flight(
        &self,
        contact: usize,
        contacts: &[usize],
        modes: &[Mode],
        motion: &Motion,
    ) -> Option<Flight> {
        let [phi, omega] = plain(motion);
        let z = self.free.elements(&phi);
        let wall = &self.free.contacts[contact];
        let speed = wall.gap_rate(motion.time, &phi, &z, &omega);
        if speed <= NO_SPEED * wall.step_size(&omega) || wall.restitution >= 1.0 {
            return None;
        }
        let others: Vec<usize> = contacts.iter().copied().filter(|&other| other != contact).collect();
        let mut modes = modes.to_vec();
        for (friction, mode) in self.free.frictions.iter().zip(&mut modes) {
            if friction.normal == Normal::Contact(contact) {
                *mode = Mode::Open;
            }
        }
        let flying = in_modes(&self.free, &others, &modes);
        let course = Course::of(&flying, motion);
        let Gradient { row, along } =
            Gradient::of(&wall.row, motion.time, Posture { phi: &phi, z: &z, omega: &omega });
        let inward = -(dot(&along, &course.accelerations) + row.convective);
        let last = 2.0 * speed / (inward * (1.0 - wall.restitution));
        (inward > 0.0 && last.is_finite()).then_some(Flight { last, course })
    }

    /// Takes back what friction in joints would do beside points that are held before their bounces have ended, in
    /// the mechanism that holds them: rates are on the constraints afterwards.
    pub(super) fn fly<'a>(&self, flights: impl Iterator<Item = &'a Flight>, motion: &mut Motion) {
        let mechanism = &self.mechanism;
        let [phi, omega] = plain(motion);
        let close = |omega: &[f64]| mechanism.without_normal_rates(motion.time, &phi, omega);
        let (Some(closed), held) = (close(&omega), Course::of(mechanism, motion)) else { return };
        let n = omega.len();
        let (mut turned, mut rates) = (vec![0.0; n], closed.clone());
        for Flight { last, course } in flights {
            let change = |k: usize| (course.accelerations[k] - held.accelerations[k]) * last;
            let Some(flown) = close(&(0..n).map(|k| omega[k] + change(k)).collect::<Vec<_>>()) else {
                return;
            };
            for k in 0..n {
                rates[k] += flown[k] - closed[k];
                turned[k] -= 0.5 * last * (flown[k] - closed[k]);
            }
            motion.work += DoubleDouble::from((course.power - held.power) * last);
            motion.friction += (course.lost - held.lost) * last;
        }
        for k in 0..n {
            motion.phi[k] += DoubleDouble::from(turned[k]);
            motion.omega[k] = DoubleDouble::from(rates[k]);
        }
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
