//! Impacts at walls, and points that stay on them.

use super::super::build::build;
use super::super::impact_monitor;
use super::super::impact_monitor::Claim;
use super::super::methods::Stabilization;
use super::super::running::Outcome;
use super::rest::{Flight, come_to_rest};
use super::{
    ContactDriver, DRIVEN, HOLDS_MOST, Held, ImpactRecord, Jump, KEPT, NO_SPEED, PersistentContact, ROUNDS,
    tighter,
};
use crate::arithmetic::{Complex, DoubleDouble};
use crate::dynamics::friction::{CompiledFriction, FrictionMode, Normal, Transition};
use crate::dynamics::impact::Impact;
use crate::dynamics::kernel::Kernel;
use crate::dynamics::multiplier::Multiplier;
use crate::dynamics::{Form, Mechanism, Motion, Time};
use crate::stabilization::projection::project;
use crate::stepping::{Cause, StepError};
use std::sync::Arc;

impl Outcome {
    /// Counts an impact, and keeps what it was among the first ones.
    pub(super) fn record_impact(&mut self, impact: impl FnOnce() -> ImpactRecord) {
        self.impact_count += 1;
        if self.impacts.len() < KEPT {
            self.impacts.push(impact());
        }
    }
}

impl ContactDriver {
    /// Strikes every point that touches a wall and moves into it, then holds those that stay.
    pub(in crate::run) fn meet(&mut self, outcome: &mut Outcome) -> Result<(), StepError> {
        self.meet_after(None, 0.0, outcome)
    }

    /// The same after an impact of a contact, at this approach \[m/s\].
    pub(super) fn meet_after(
        &mut self,
        struck: Option<usize>,
        mut hardest: f64,
        outcome: &mut Outcome,
    ) -> Result<(), StepError> {
        for _ in 0..ROUNDS {
            let mut quiet = true;
            for number in 0..self.free.contacts.len() {
                let configuration = self.present_state();
                let contact = &self.free.contacts[number];
                let approach = -contact.gap_rate(
                    configuration.t,
                    &configuration.phi,
                    &configuration.z,
                    &configuration.omega,
                );
                let is_met = contact.touches(configuration.t, &configuration.phi, &configuration.z)
                    && approach > self.no_speed(number, &configuration.omega).max(NO_SPEED * hardest);
                if is_met && !self.mechanism.held.contains(&number) {
                    hardest = hardest.max(self.impact_at(number, &[], outcome)?);
                    quiet = false;
                }
            }
            if quiet {
                break;
            }
        }
        self.settle(struck, None, outcome)
    }

    /// Normal velocity \[m/s\] up to which a point does not move along its normal.
    pub(super) fn no_speed(&self, contact: usize, omega: &[f64]) -> f64 {
        let contact = &self.free.contacts[contact];
        NO_SPEED * contact.step_size(omega).max(contact.length / self.free.units.time)
    }

    /// Lets the impact at a wall take effect, and returns the approach \[m/s\]; points that the others would
    /// have to pull are let go, and those that are `flying` take no part.
    pub(super) fn impact_at(
        &mut self,
        contact: usize,
        flying: &[usize],
        outcome: &mut Outcome,
    ) -> Result<f64, StepError> {
        if let Some(touching) = self.met_together(contact) {
            return self.impact_at_several(&touching, outcome);
        }
        let t = self.motion().time;
        let PresentState { phi, omega, z, .. } = self.present_state();
        let slow = self.no_speed(contact, &omega);
        let (impact, striking) = loop {
            // Friction in hinges and sliders takes no part in impacts.
            let modes = vec![FrictionMode::Open; self.free.frictions.len()];
            let striking = match modes == self.mechanism.modes {
                true => Arc::clone(&self.mechanism),
                false => in_modes(&self.free, &self.mechanism.held, &modes),
            };
            let Some(impact) = striking.impact_at(contact, t, &phi, &omega) else {
                if let Some(pulled) = striking.pulled_without_way_back(contact, t, &phi, &omega) {
                    self.release(pulled, outcome)?;
                    continue;
                }
                if self.free.contacts[contact].gap_rate(t, &phi, &z, &omega) >= -slow {
                    return Ok(0.0);
                }
                let what = format!(
                    "the constraints leave a point that meets wall {} no way back",
                    self.name(contact)
                );
                return Err(self.stopped(&outcome.plan, what, DRIVEN));
            };
            match striking.pulled(&impact.row_impulses, 1e-12 * impact.impulse) {
                Some(pulled) => self.release(pulled, outcome)?,
                None => break (impact, striking),
            }
        };
        if impact.approach >= 0.0 {
            return Ok(0.0);
        }
        if let Some(touching) = self.pressed_together(contact, flying, &impact, &striking) {
            return self.impact_at_several(&touching, outcome);
        }
        // Letting others go may have moved it by rounding.
        let (last, after, energy_lost) = self.jump_to(&impact.omega, impact.motor_work);
        let Impact { impulse, tangential, .. } = impact;
        let claim = Claim { contact, impulse, tangential, energy_lost };
        let tolerance = outcome.plan.tolerance.unwrap_or_default().relative;
        let is_slow = -impact.approach <= slow;
        let check = || impact_monitor::check(&striking, tolerance, &last, &after, &claim);
        if let Err(what) = if is_slow { Ok(()) } else { check() } {
            let (cause, what) =
                (Cause::ImpactCheckFailed, format!("impact at wall {}: {what}", self.name(contact)));
            return Err(StepError {
                cause,
                ..self.stopped(&outcome.plan, what, tighter(&outcome.plan.method.to_string()))
            });
        }
        let t = last.time.hi;
        self.tell_impact(Some(contact), &[], [last, after]);
        outcome.impact_loss += energy_lost;
        // A point that hangs at its wall without a force is carried to and fro by rounding: that is taken off
        // it, and is no impact.
        if is_slow {
            return Ok(-impact.approach);
        }
        outcome.record_impact(|| ImpactRecord {
            t,
            wall: self.name(contact).into(),
            impulse,
            friction_impulse: tangential,
            approach: impact.approach,
            energy_lost,
        });
        Ok(-impact.approach)
    }

    /// Gives the motion these rates \[rad/s, m/s\], with this impulsive work of motors \[J\]: the motion on
    /// both sides, and the energy lost \[J\].
    pub(super) fn jump_to(&mut self, omega: &[f64], motor_work: f64) -> (Motion, Motion, f64) {
        let last = self.motion();
        let (mut motion, before) = (last.clone(), self.sampler.balance(&last));
        motion.omega = omega.iter().map(|&omega| DoubleDouble::from(omega)).collect();
        motion.work = motion.work + motor_work;
        self.driver.jump(&motion);
        let change = self.sampler.balance(&motion) - before;
        self.sampler.shift(change);
        (last, self.motion(), -change.hi)
    }

    /// Tells of an impact where somebody asks, and of the contacts that touch where several take part in it.
    pub(super) fn tell_impact(
        &mut self,
        contact: Option<usize>,
        together: &[usize],
        [before, after]: [Motion; 2],
    ) {
        if let Some(events) = &mut self.events {
            events.jump([&before, &after]);
        }
        if let Some(jumps) = &self.jumps {
            let (together, mechanism) = (together.to_vec(), Arc::clone(&self.mechanism));
            jumps.push(Jump { contact, together, switch: None, friction: None, before, after, mechanism });
        }
    }

    /// Holds the points that touch and stay, and lets the others go; `struck` touches, wherever a projection
    /// has put it, and `released` goes in any case.
    pub(super) fn settle(
        &mut self,
        struck: Option<usize>,
        released: Option<usize>,
        outcome: &mut Outcome,
    ) -> Result<(), StepError> {
        self.settle_at(struck, released, Transition::default(), outcome)
    }

    /// The same where a place with friction begins to stick or to slide.
    fn settle_at(
        &mut self,
        struck: Option<usize>,
        released: Option<usize>,
        transition: Transition,
        outcome: &mut Outcome,
    ) -> Result<(), StepError> {
        let motion = self.motion();
        let PresentState { z, phi, omega, .. } = self.present_state();
        let touches = |contact: &usize| {
            Some(*contact) == struck
                || self.mechanism.held.contains(contact)
                || self.free.contacts[*contact].touches(motion.time, &phi, &z)
        };
        let touching: Vec<usize> = (0..self.free.contacts.len())
            .filter(|contact| Some(*contact) != released && touches(contact))
            .collect();
        if touching.is_empty() && self.mechanism.held.is_empty() && self.free.frictions.is_empty() {
            return Ok(());
        }
        let staying = self.free.staying(&touching, motion.time, [&phi, &omega], self.rest_height);
        let Some(staying) = staying else {
            let what = format!(
                "a point rests on wall {} and the constraints leave it no freedom",
                self.names(&touching)
            );
            return Err(self.stopped(&outcome.plan, what, DRIVEN));
        };
        let mut still: Vec<usize> = (touching.iter().copied())
            .filter(|&contact| {
                let touching = &self.free.contacts[contact];
                let speed = touching.gap_rate(motion.time, &phi, &z, &omega);
                staying.contains(&contact) || speed.abs() <= self.no_speed(contact, &omega)
            })
            .collect();
        let (staying, modes) = loop {
            let (staying, modes) = self.friction_modes(staying.clone(), &still, transition, outcome)?;
            match self.pressed_by_friction(&touching, &still, (&staying, &modes)) {
                Some(contact) => still.insert(still.partition_point(|&other| other < contact), contact),
                None => break (staying, modes),
            }
        };
        let is_same = staying == self.mechanism.held && modes == self.mechanism.modes;
        if is_same && !staying.iter().any(|&contact| self.rebounds(contact, &motion)) {
            return Ok(());
        }
        self.switch(staying, modes, outcome)?;
        let place = transition.arrived.or(transition.breaks.map(|(place, _)| place));
        if let (Some(jumps), Some(place)) = (&self.jumps, place) {
            jumps.at_friction(place);
        }
        Ok(())
    }

    /// Lets the point of a wall go that ceases to press it, where no supports at their limits can press it in
    /// another way.
    pub(super) fn pressure_ends(&mut self, contact: usize, outcome: &mut Outcome) -> Result<(), StepError> {
        let is_at_limit = |mode: &FrictionMode| matches!(mode, FrictionMode::Strained(_));
        if self.mechanism.modes.iter().any(is_at_limit) && self.settles_anew(outcome)? {
            return Ok(());
        }
        self.settle(None, Some(contact), outcome)
    }

    /// Finds anew what holds the points that touch, and which places stick; false where that is as before.
    pub(in crate::run) fn settles_anew(&mut self, outcome: &mut Outcome) -> Result<bool, StepError> {
        self.settles_by(Transition::default(), outcome)
    }

    /// The same where a place with friction begins to stick or to slide.
    pub(in crate::run) fn settles_by(
        &mut self,
        transition: Transition,
        outcome: &mut Outcome,
    ) -> Result<bool, StepError> {
        let before = (self.mechanism.held.clone(), self.mechanism.modes.clone());
        self.settle_at(None, None, transition, outcome)?;
        Ok(before != (self.mechanism.held.clone(), self.mechanism.modes.clone()))
    }

    /// Lets the point of a wall go.
    pub(super) fn release(&mut self, pulled: usize, outcome: &mut Outcome) -> Result<(), StepError> {
        let rest = self.mechanism.held.iter().copied().filter(|&held| held != pulled).collect();
        let open = |(friction, &mode): (&CompiledFriction, &FrictionMode)| match friction.normal {
            Normal::Contact(contact) if contact == pulled => FrictionMode::Open,
            _ => mode,
        };
        let modes = self.mechanism.frictions.iter().zip(&self.mechanism.modes).map(open).collect();
        self.switch(rest, modes, outcome)
    }

    /// Goes on with these contacts held, and the places with friction in these modes.
    pub(super) fn switch(
        &mut self,
        contacts: Vec<usize>,
        modes: Vec<FrictionMode>,
        outcome: &mut Outcome,
    ) -> Result<(), StepError> {
        let mut motion = self.motion();
        let before = self.jumps.is_some().then(|| motion.clone());
        self.stabilizer += std::mem::take(&mut motion.stabilizer);
        let is_new =
            |&contact: &usize| !self.mechanism.held.contains(&contact) || self.rebounds(contact, &motion);
        let new: Vec<usize> = contacts.iter().copied().filter(is_new).collect();
        let next = in_modes(&self.free, &contacts, &modes);
        let flights = Flight::all(&next, &new, &motion);
        self.record(&contacts, motion.time.hi, outcome);
        for flight in &flights {
            self.begin_later(flight.contact, flight.last, outcome);
        }
        self.record_modes(&modes, motion.time.hi, outcome);
        let mut plan = outcome.plan.clone();
        self.mechanism = next;
        if self.mechanism.constraints.len() > self.free.constraints.len() {
            plan.stabilization = Stabilization::Projection;
            self.put_on(&mut motion, &new, &flights, outcome)?;
        }
        self.fly_in_means(&flights, &motion, outcome.plan.until);
        if let Some(events) = &mut self.events {
            events.watch_friction(&self.mechanism);
        }
        let next = build(&self.mechanism, &mut plan, &motion)?;
        let last = std::mem::replace(&mut self.driver, next);
        self.driver.follow(&*last);
        self.sampler.hold(Arc::clone(&self.mechanism));
        if let (Some(jumps), Some(before)) = (&self.jumps, before) {
            jumps.push(Jump {
                contact: None,
                together: Vec::new(),
                switch: None,
                friction: None,
                before,
                after: motion.clone(),
                mechanism: Arc::clone(&self.mechanism),
            });
        }
        if self.holds_in_row > HOLDS_MOST {
            let what = format!(
                "more than {HOLDS_MOST} holds before the next output time at wall {}",
                self.names(&contacts)
            );
            return Err(self.stopped(
                &outcome.plan,
                what,
                "shorten the output interval, or loosen the tolerance",
            ));
        }
        Ok(())
    }

    /// Takes off a motion what keeps it from its walls: gaps of rounding, and normal velocities too small to
    /// rebound with, at the walls that are held anew with the friction of their impulses, and after flights
    /// that are left out.
    fn put_on(
        &mut self,
        motion: &mut Motion,
        new: &[usize],
        flights: &[Flight],
        outcome: &mut Outcome,
    ) -> Result<(), StepError> {
        let before = self.sampler.balance(motion);
        // Where there are no such rates projection finds some.
        let _ = come_to_rest(&self.mechanism, new, flights, motion);
        let mut form = Multiplier::<0, true>::new(Arc::clone(&self.mechanism));
        let mut state = form.state(motion);
        let mut kernel = Kernel::new(&self.mechanism);
        if let Err((row, left)) = project(&self.mechanism, &mut kernel, &mut state, 1e-13) {
            let what =
                format!("{left:.1e} of constraint {row} is left where a point comes to rest on its wall");
            return Err(self.stopped(&outcome.plan, what, "raise the restitution, or end the run before"));
        }
        form.read(&state, motion);
        motion.stabilizer = 0.0;
        let change = self.sampler.balance(motion) - before;
        self.sampler.shift(change);
        outcome.impact_loss -= change.hi;
        Ok(())
    }

    /// Books the holds that end and those that begin.
    pub(in crate::run) fn record(&mut self, contacts: &[usize], t: f64, outcome: &mut Outcome) {
        self.held.retain(|held| {
            let stays = contacts.contains(&held.contact);
            if !stays {
                let until = t.max(held.since);
                outcome.persistent_contact_time += until - held.since;
                if let Some(kept) = held.kept {
                    outcome.holds[kept].until = Some(until);
                }
            }
            stays
        });
        for &contact in contacts {
            if self.held.iter().any(|held| held.contact == contact) {
                continue;
            }
            self.holds_in_row += 1;
            outcome.persistent_contact_count += 1;
            let kept = (outcome.holds.len() < KEPT).then_some(outcome.holds.len());
            if kept.is_some() {
                outcome.holds.push(PersistentContact { t, wall: self.name(contact).into(), until: None });
            }
            self.held.push(Held { contact, since: t, kept });
        }
        if !contacts.is_empty()
            && self.free.standing_rows() > 0
            && outcome.plan.stabilization != Stabilization::Projection
        {
            let note = "while a point stays on its wall, the motors' rows are kept by projection";
            if !outcome.plan.notes.iter().any(|before| before == note) {
                outcome.plan.notes.push(note.into());
            }
        }
    }

    /// Books the time of the holds that last to the end of the run, `t` \[s\].
    pub(in crate::run) fn end(&mut self, t: f64, outcome: &mut Outcome) {
        outcome.persistent_contact_time +=
            self.held.iter().map(|held| (t - held.since).max(0.0)).sum::<f64>();
    }

    /// The present motion in doubles.
    pub(super) fn present_state(&mut self) -> PresentState {
        let motion = self.motion();
        let [phi, omega] = motion.rounded();
        PresentState { t: motion.time, z: self.free.elements(&phi), omega, phi }
    }
}

/// The mechanism with these contacts held and in these modes; itself where that changes nothing.
pub(in crate::run) fn in_modes(
    free: &Arc<Mechanism>,
    contacts: &[usize],
    modes: &[FrictionMode],
) -> Arc<Mechanism> {
    if contacts.is_empty() && modes.iter().all(|mode| *mode == FrictionMode::Open) {
        return Arc::clone(free);
    }
    Arc::new(free.moving(contacts, modes))
}

/// Time, elements, coordinates \[rad, m\] and rates \[rad/s, m/s\] as doubles.
pub(super) struct PresentState {
    pub t: Time,
    pub z: Vec<Complex<f64>>,
    pub phi: Vec<f64>,
    pub omega: Vec<f64>,
}
