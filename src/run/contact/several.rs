//! Impacts at several walls at one moment: their impulses are found together, as the order of impacts
//! matters.

use super::super::impact_monitor;
use super::super::running::Outcome;
use super::impacts::PresentState;
use super::{ContactDriver, ImpactRecord, NO_SPEED, in_modes};
use crate::dynamics::Mechanism;
use crate::dynamics::friction::FrictionMode;
use crate::dynamics::impact::Impact;
use crate::stepping::{Cause, StepError};

/// Impulse, over that of an impact, or approach after it, over that before, from which on it presses a point.
const LEAST_PRESS: f64 = 1e-9;

impl ContactDriver {
    /// The walls whose points touch at the impact of one of them.
    pub(super) fn touching_with(&mut self, contact: usize) -> Vec<usize> {
        let PresentState { t, z, phi, .. } = self.present_state();
        let touches = |&other: &usize| {
            other == contact
                || self.mechanism.held.contains(&other)
                || self.free.contacts[other].touches(t, &phi, &z)
        };
        (0..self.free.contacts.len()).filter(touches).collect()
    }

    /// The walls that touch, where several of them are met at once.
    pub(super) fn met_together(&mut self, contact: usize) -> Option<Vec<usize>> {
        if self.free.contacts.len() < 2 {
            return None;
        }
        let touching = self.touching_with(contact);
        let PresentState { t, z, phi, omega } = self.present_state();
        let approach = |number: usize| -self.free.contacts[number].gap_rate(t, &phi, &z, &omega);
        let hardest = approach(contact);
        let is_met = |&&number: &&usize| {
            let least = self.no_speed(number, &omega).max(NO_SPEED * hardest);
            !self.mechanism.held.contains(&number) && approach(number) > least
        };
        (touching.iter().filter(is_met).count() > 1).then_some(touching)
    }

    /// The walls that touch, where an impact at one of them presses a point that rests on another one, and
    /// there is dry friction at one of both: a point that touches without a force is pressed as one that is
    /// held, and one that is `flying` is not.
    pub(super) fn pressed_together(
        &mut self,
        contact: usize,
        flying: &[usize],
        impact: &Impact,
        striking: &Mechanism,
    ) -> Option<Vec<usize>> {
        if self.free.frictions.is_empty() || self.free.contacts.len() < 2 {
            return None;
        }
        let touching = self.touching_with(contact);
        let pressed = striking.held.iter().zip(&impact.row_impulses[striking.standing_rows()..]);
        let mut pressed = pressed.filter(|(_, impulse)| -**impulse > LEAST_PRESS * impact.impulse);
        if pressed.any(|(&held, _)| striking.friction_at(held).is_some()) {
            return Some(touching);
        }
        let PresentState { t, z, phi, omega } = self.present_state();
        let rubs = |other: usize| [contact, other].iter().any(|&at| striking.friction_at(at).is_some());
        let is_pressed = |&other: &usize| {
            let wall = &self.free.contacts[other];
            let rate = |omega: &[f64]| wall.gap_rate(t, &phi, &z, omega);
            other != contact
                && !flying.contains(&other)
                && rubs(other)
                && !striking.held.contains(&other)
                && rate(&omega) <= self.no_speed(other, &omega)
                && rate(&impact.omega) < LEAST_PRESS * impact.approach
        };
        touching.iter().any(is_pressed).then_some(touching)
    }

    /// Lets the impact at these walls take effect at once, and returns the hardest approach \[m/s\].
    pub(super) fn impact_at_several(
        &mut self,
        contacts: &[usize],
        outcome: &mut Outcome,
    ) -> Result<f64, StepError> {
        let PresentState { t, phi, omega, .. } = self.present_state();
        let modes = vec![FrictionMode::Open; self.free.frictions.len()];
        let striking = in_modes(&self.free, &[], &modes);
        let Some(impacts) = striking.impact_at_several(contacts, t, &phi, &omega) else {
            let what =
                format!("no impulses fit the laws of impact and friction at walls {}", self.names(contacts));
            return Err(self.paradox(outcome, what));
        };
        let (last, after, energy_lost) = self.jump_to(&impacts.omega, impacts.motor_work);
        let tolerance = outcome.plan.tolerance.unwrap_or_default().relative;
        let is_slow =
            impacts.blows.iter().all(|blow| -blow.normal_rates[0] <= self.no_speed(blow.contact, &omega));
        let check = || {
            let both = [&last, &after];
            impact_monitor::check_several(&striking, tolerance, both, &impacts.blows, energy_lost)
        };
        if let Err(what) = if is_slow { Ok(()) } else { check() } {
            let what = format!("impact at walls {}: {what}", self.names(contacts));
            let stop = self.stopped(&outcome.plan, what, "tighten the tolerance, or use --method dp8");
            return Err(StepError { cause: Cause::ImpactCheckFailed, ..stop });
        }
        let t = last.time.hi;
        let together = if impacts.blows.len() > 1 { contacts } else { &[] };
        self.tell_impact(contacts.first().copied(), together, [last, after]);
        outcome.impact_loss += energy_lost;
        let mut hardest = 0.0_f64;
        for blow in &impacts.blows {
            hardest = hardest.max(-blow.normal_rates[0]);
            outcome.record_impact(|| ImpactRecord {
                t,
                wall: self.name(blow.contact).into(),
                impulse: blow.impulse,
                friction_impulse: blow.tangential,
                approach: blow.normal_rates[0],
                energy_lost: blow.energy_lost(),
            });
        }
        Ok(hardest)
    }
}
