//! What events do to a run: it stops, its motion is changed, parts of the scene begin or cease
//! to act.

use super::build::build;
use super::closing;
use super::contact::{ContactDriver, Jump, Switch, in_modes};
use super::event::{Action, Change, EventDetector, SwitchFunction};
use super::monitor::Monitor;
use super::plan::Plan;
use super::running::Outcome;
use crate::arithmetic::shown::about;
use crate::dynamics::compile::Laws;
use crate::dynamics::constraint::ConstraintEquation;
use crate::dynamics::kernel::Kernel;
use crate::dynamics::{Mechanism, Motion};
use crate::stepping::{Cause, StepError};
use std::sync::Arc;

/// Violation of a constraint, angles in rad and lengths in sizes of the mechanism, and its rate in units of
/// the mechanism, up to which a changed motion satisfies it.
const SATISFIED: f64 = 1e-8;
/// Violation after a change over the one before it that counts as the same: of a method without projection
/// constraints have drifted.
const DRIFTED: f64 = 2.0;

impl ContactDriver {
    /// Takes the events found in the last steps into the outcome.
    pub(super) fn record_events(&mut self, outcome: &mut Outcome) {
        if let Some(events) = &mut self.events {
            outcome.event_count += events.take_found(&mut outcome.events);
        }
    }

    /// Lets the event at which the last step was cut short take effect.
    pub(super) fn act(
        &mut self,
        outcome: &mut Outcome,
        monitor: Option<&mut dyn Monitor>,
    ) -> Result<(), StepError> {
        self.check_search(&outcome.plan)?;
        let Some(events) = &mut self.events else { return Ok(()) };
        let Some((event, action)) = events.memory.pending.take() else { return Ok(()) };
        if let Some(function) = events.friction_function(event) {
            return self.friction_event(function, outcome);
        }
        let name = events.name(event).to_owned();
        let (is_from_outside, at) = (events.is_from_outside(event), events.switch_function(event));
        if std::mem::take(&mut events.memory.slides) {
            let hint = "sliding along such a surface is not integrated: let the law pass zero smoothly, as \
                tanh(x/0.01) instead of sign(x)";
            return Err(StepError {
                cause: Cause::Sliding,
                method: outcome.plan.method.to_string(),
                t: self.motion().time.hi,
                step: 0.0,
                what: format!(
                    "a formula of `{name}` changes its branch here, and on both branches the motion is \
                        driven back"
                ),
                hint: hint.into(),
            });
        }
        match action {
            Action::Record => Ok(()),
            Action::Stop => {
                let motion = self.motion();
                if let Some(extremes) = &mut self.extremes {
                    extremes.end(&motion);
                }
                self.ended_by = Some(name);
                Ok(())
            }
            Action::Change(change) => {
                if let Some(monitor) = monitor.filter(|_| is_from_outside) {
                    monitor.end(&format!("event `{name}` changed the run, which nothing beside it follows"));
                }
                let is_moved = is_from_outside && change.motion.is_some();
                self.change((&name, at), change, outcome)?;
                if is_moved {
                    let motion = self.motion();
                    self.events.iter_mut().for_each(|events| events.leave(event, &motion));
                }
                Ok(())
            }
        }
    }

    /// Stops where events of the last step could not be told.
    fn check_search(&mut self, plan: &Plan) -> Result<(), StepError> {
        let too_many = [
            self.events.as_ref().is_some_and(|events| events.halvings.is_too_much()),
            self.extremes.as_ref().is_some_and(|extremes| extremes.halvings.is_too_much()),
        ];
        if too_many.contains(&true) {
            return Err(StepError {
                cause: Cause::Unresolved,
                method: plan.method.to_string(),
                t: self.motion().time.hi,
                step: 0.0,
                what: "in the step that ends here a body turns, or a formula oscillates, too often for \
                    events and outputs to be looked for each time"
                    .into(),
                hint: "end the run earlier with --until, or leave its events and outputs out".into(),
            });
        }
        let Some(events) = &mut self.events else { return Ok(()) };
        if let Some(what) = events.take_undefined() {
            return Err(StepError {
                cause: Cause::NotFinite,
                method: plan.method.to_string(),
                t: self.motion().time.hi,
                step: 0.0,
                what,
                hint: "let its value be a number wherever the motion may come to, of bodies that are there"
                    .into(),
            });
        }
        if let Some(name) = events.take_lost() {
            return Err(self.stopped(
                plan,
                format!("event `{name}` comes true again too soon after its change to be told from it"),
                "events that accumulate end here: let its action stop the run, or state it as a wall of the \
                    scene, whose bounces end",
            ));
        }
        Ok(())
    }

    /// Lets a change by an event take effect.
    fn change(
        &mut self,
        (event, at): (&str, SwitchFunction),
        Change { motion, switches, parameters, flips }: Change,
        outcome: &mut Outcome,
    ) -> Result<(), StepError> {
        let before = self.motion();
        let refused = |(what, hint): ChangeRefusal| StepError {
            cause: Cause::Unsuited,
            method: outcome.plan.method.to_string(),
            t: before.time.hi,
            step: 0.0,
            what: match flips {
                Some(_) => format!("a formula of `{event}` changes its branch here, and {what}"),
                None => format!("event `{event}` {what}"),
            },
            hint: hint.into(),
        };
        let balance = self.sampler.balance(&before);
        let keeps_motion = motion.is_none();
        let mut after = changed_motion(&before, motion).map_err(refused)?;
        self.switch_parts(switches);
        let keeps_parameters = self.renew_laws(parameters, flips, [&before, &after]).map_err(refused)?;
        self.changes += 1;
        self.engage(&after);
        let (free, held) = self.acting_parts(&before, &mut after).map_err(refused)?;
        if !keeps_motion && let Some(what) = behind(&free, [&before, &after]) {
            return Err(refused((what, "move it to the side of the wall's normal")));
        }
        if held != self.mechanism.held {
            self.record(&held, after.time.hi, outcome);
        }
        let modes = closing::modes(&free, &self.mechanism.modes, &held);
        self.mechanism = in_modes(&free, &held, &modes);
        if let Some(events) = &mut self.events {
            // What joints do that close here, by the parameters that hold from here on.
            if keeps_motion {
                events.jump([&before, &after]);
            }
            events.watch_friction(&self.mechanism);
        }
        self.free = free;
        self.stabilizer += std::mem::take(&mut after.stabilizer);
        self.rebuild(&outcome.plan, &after)?;
        let change = self.sampler.balance(&after) - balance;
        self.sampler.shift(change);
        outcome.event_energy += change.hi;
        if let Some(jumps) = &self.jumps {
            let (mechanism, off) = (Arc::clone(&self.mechanism), self.off.clone());
            let switch = Some(Switch { at, keeps_motion, keeps_parameters, off });
            jumps.push(Jump {
                contact: None,
                together: Vec::new(),
                switch,
                friction: None,
                before,
                after,
                mechanism,
            });
        }
        self.meet(outcome)
    }

    /// Parts act from now on, or act no longer.
    fn switch_parts(&mut self, switches: Vec<(String, bool)>) {
        for (part, on) in switches {
            self.off.retain(|off| *off != part);
            // What cannot be switched is refused when the parts that act are put together, whichever way.
            if !on || !self.whole.may_be_switched(&part) {
                self.off.push(part);
            }
        }
    }

    /// Takes new parameters, and the branches of laws on which the changed motion is; true where the
    /// parameters stay.
    fn renew_laws(
        &mut self,
        parameters: Option<Vec<f64>>,
        flips: Option<usize>,
        [before, after]: [&Motion; 2],
    ) -> Result<bool, ChangeRefusal> {
        let Some(Laws { formulas, parameters: known, modes }) = &self.whole.laws else { return Ok(true) };
        let mut modes = modes.clone();
        let moved = after.phi != before.phi || after.omega != before.omega;
        let next = parameters.unwrap_or_else(|| known.clone());
        let keeps_parameters = next == *known;
        if moved || next != *known {
            let at_zero = |events: &EventDetector| events.conditions_at_zero([before, after], &next);
            let stays = self.events.as_ref().map(at_zero).unwrap_or_default();
            let there = self.whole.seen(after, |at| formulas.modes(at, &next));
            // Where a condition is zero, rounding does not choose its branch.
            for (number, (mode, there)) in modes.iter_mut().zip(there).enumerate() {
                if stays.get(number) != Some(&true) {
                    *mode = there;
                }
            }
        } else if let (Some(number), Some(events)) = (flips, &self.events) {
            events.flip(number, after, &mut modes);
        }
        match self.whole.on_branch(next, modes) {
            Ok(whole) => self.whole = Arc::new(whole),
            Err(error) => return Err((format!("cannot go on: {error}"), "look at that formula")),
        }
        if let Some(events) = &mut self.events {
            events.exchange(Arc::clone(&self.whole));
        }
        Ok(keeps_parameters)
    }

    /// The mechanism of the parts that act, without holds, and the contacts still held; closes joints.
    fn acting_parts(
        &self,
        before: &Motion,
        after: &mut Motion,
    ) -> Result<(Arc<Mechanism>, Vec<usize>), ChangeRefusal> {
        let free = match self.whole.without(&self.off) {
            Ok(free) => Arc::new(free),
            Err(part) => {
                return Err((
                    format!("switches `{part}`"),
                    "name a spring, torsion spring, force, torque, wall, or a hinge, motor or lock that the \
                        scene switches",
                ));
            }
        };
        let mut held = self.mechanism.held.clone();
        held.retain(|&contact| !free.contacts[contact].is_off && stays(&free, contact, after));
        closing::close([&self.free, &free], &mut held, after)?;
        if let Some(what) = broken([(&*self.free, before), (&*free, &*after)]) {
            let hint = match self.free.laws.as_ref().is_some_and(|laws| laws.formulas.drives()) {
                true => "the law of a motor must keep its value and its rate through its corners",
                false => "change rates along what the constraints allow",
            };
            return Err((what, hint));
        }
        Ok((free, held))
    }

    /// A new driver from the changed motion on, for the mechanism as it is now.
    fn rebuild(&mut self, plan: &Plan, after: &Motion) -> Result<(), StepError> {
        let mut plan = plan.clone();
        if self.mechanism.constraints.len() > self.free.constraints.len() {
            plan.stabilization = super::methods::Stabilization::Projection;
        }
        let next = build(&self.mechanism, &mut plan, after)?;
        let last = std::mem::replace(&mut self.driver, next);
        self.driver.follow(&*last);
        self.sampler.exchange(Arc::clone(&self.free), Arc::clone(&self.mechanism));
        Ok(())
    }
}

/// Why a change cannot be, and what to do.
type ChangeRefusal = (String, &'static str);

/// The motion after a change, by the one that is given.
fn changed_motion(before: &Motion, given: Option<Motion>) -> Result<Motion, ChangeRefusal> {
    let mut after = before.clone();
    if let Some(motion) = given {
        let n = before.phi.len();
        if (motion.phi.len(), motion.omega.len(), motion.turns.len()) != (n, n, before.turns.len()) {
            let hint = "change a clone of the motion it is shown";
            return Err(("gives a motion of other coordinates".into(), hint));
        }
        (after.phi, after.omega, after.turns) = (motion.phi, motion.omega, motion.turns);
    }
    Ok(after)
}

/// Whether a point that is held is on its wall and moves with it; no longer where a corner or a parameter of
/// the wall's law has moved it.
fn stays(free: &Mechanism, contact: usize, motion: &Motion) -> bool {
    let [phi, omega] = motion.rounded();
    let (contact, z) = (&free.contacts[contact], free.elements(&phi));
    if !contact.row.moves() {
        return true;
    }
    let speed = contact.step_size(&omega).max(contact.length / free.units.time);
    contact.gap(motion.time, &phi, &z).abs() <= SATISFIED
        && contact.gap_rate(motion.time, &phi, &z, &omega).abs() <= SATISFIED * speed
}

/// The wall behind which a changed motion is, by more than the one before was.
fn behind(mechanism: &Mechanism, [before, after]: [&Motion; 2]) -> Option<String> {
    let at = |motion: &Motion| {
        let [phi, _] = motion.rounded();
        (mechanism.elements(&phi), phi)
    };
    let [(z, phi), (next_z, next)] = [before, after].map(at);
    mechanism.contacts.iter().find_map(|contact| {
        let [was, gap] = [(&phi, &z), (&next, &next_z)].map(|(phi, z)| contact.gap(after.time, phi, z));
        let is_behind = gap < -SATISFIED.max(-DRIFTED * was);
        let name = &contact.row.name;
        is_behind
            .then(|| format!("puts the point of wall {name} {} m behind it", about(-gap * contact.length)))
    })
}

/// Violations of every constraint at both levels: over its unit and over the speeds of the motion, and as
/// they are \[rad or m, and that per s\].
fn violations(mechanism: &Mechanism, motion: &Motion) -> Vec<[[f64; 2]; 2]> {
    let [phi, omega] = motion.rounded();
    let mut kernel = Kernel::<f64>::new(mechanism);
    kernel.linearise_at::<0>(mechanism, motion.time, &phi, &omega);
    let (size, time) = (mechanism.size_of_parts(), mechanism.units.time);
    let step_size = omega.iter().fold(1.0, |most: f64, omega| most.max(omega.abs() * time));
    let of = |(r, row): (usize, &ConstraintEquation)| {
        let unit = if row.is_in_radians() { 1.0 } else { size };
        let [position, rate] = [kernel.rows[r].position.abs(), kernel.row_rate(r, &omega).abs()];
        [[position / unit, rate / unit * time / step_size], [position, rate]]
    };
    mechanism.constraints.iter().enumerate().map(of).collect()
}

/// The constraint that a motion does not satisfy, by more than the one before did, where it was there.
fn broken([(earlier, before), (mechanism, after)]: [(&Mechanism, &Motion); 2]) -> Option<String> {
    if after.phi.iter().chain(&after.omega).any(|x| !x.hi.is_finite()) {
        return Some("gives numbers that are not finite".into());
    }
    let drifted = violations(earlier, before);
    let before = |name: &str| earlier.constraints.iter().position(|row| row.name == name);
    mechanism.constraints.iter().zip(violations(mechanism, after)).find_map(|(row, [relative, own])| {
        let known = before(&row.name).map_or([0.0; 2], |r| drifted[r][0]);
        let [most, fastest] = known.map(|known| (DRIFTED * known).max(SATISFIED));
        (relative[0] > most || relative[1] > fastest).then(|| {
            let ([position, rate], unit) = (own.map(about), row.unit());
            format!("leaves constraint {} violated by {position} {unit} and {rate} {unit}/s", row.name)
        })
    })
}
