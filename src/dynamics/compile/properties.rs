//! What a mechanism has and has not, for those that choose forms and methods.

use super::{Body, Joint, Mechanism};
use crate::arithmetic::DoubleDouble;
use crate::arithmetic::tape::Tape;
use crate::dynamics::constraint::{Aim, Site};
use crate::dynamics::force::UserForce;
use crate::dynamics::forest::{BodyOrigin, Hang};
use crate::dynamics::point::Point;
use crate::dynamics::{State, Time};
use std::borrow::Cow;
use std::ops::Range;

impl Mechanism {
    /// Number of coordinates: the bodies' angles, and two for every origin that moves freely.
    pub fn coordinates(&self) -> usize {
        self.tree.coordinates
    }

    /// The number of bodies where angles are all there is and matrices are used, as code made for a size asks
    /// for; else 0, any number.
    pub fn size(&self) -> usize {
        if self.coordinates() == self.bodies.len() && self.recursion.is_none() {
            self.bodies.len()
        } else {
            0
        }
    }

    /// True where origins of bodies move freely, so that angles alone do not tell where bodies are.
    pub fn has_translations(&self) -> bool {
        self.coordinates() > self.bodies.len()
    }

    /// Centre of mass of a body as a point.
    pub fn centre(&self, body: usize) -> Point {
        self.forest.walk(body, self.bodies[body].centre)
    }

    /// The first or second end of a bar.
    pub fn end(&self, body: usize, end: usize) -> Site {
        Site { body: Some(body), point: self.forest.walk(body, self.bodies[body].ends[end]) }
    }

    /// What coordinate `k` is: `phi of bar1`, `x of cart`.
    pub fn coordinate_name(&self, k: usize) -> String {
        let name = |body: usize| &self.bodies[body].name;
        match k.checked_sub(self.bodies.len()) {
            None => format!("phi of {}", name(k)),
            Some(rest) => {
                let origin_point = |hang: &Hang| hang.origin_point == BodyOrigin::Free(k - rest % 2);
                let body = self.forest.hangs.iter().position(origin_point).unwrap_or(0);
                format!("{} of {}", if rest % 2 == 0 { "x" } else { "y" }, name(body))
            }
        }
    }

    /// The same for its rate.
    pub fn rate_name(&self, k: usize) -> String {
        let name = self.coordinate_name(k);
        match name.strip_prefix("phi") {
            Some(rest) => format!("omega{rest}"),
            None => format!("v{name}"),
        }
    }

    /// The bodies of the scene itself: the rotors of integrals come after them.
    pub fn own_bodies(&self) -> &[Body] {
        &self.bodies[..self.bodies.len() - self.integrals]
    }

    /// The hinges and welds of the scene itself.
    pub fn own_joints(&self) -> impl Iterator<Item = &Joint> {
        let own = self.own_bodies().len();
        self.joints.iter().filter(move |joint| joint.outer.is_none_or(|body| body < own))
    }

    /// True where a joint was released, so that rows constrain nothing.
    pub fn has_released(&self) -> bool {
        self.constraints.iter().any(|row| row.coordinates().is_empty())
    }

    /// Names of the rows in force that follow from others.
    pub fn redundant(&self) -> Vec<&str> {
        let in_force = self.constraints.iter().filter(|row| !row.coordinates().is_empty());
        in_force
            .map(|row| row.name.as_str())
            .filter(|name| self.assembly.redundant.iter().any(|of| of == name))
            .collect()
    }

    /// True where motors or walls have aims that depend on the mechanism.
    pub fn has_aims(&self) -> bool {
        self.aims().next().is_some()
    }

    /// Those aims.
    pub(super) fn aims(&self) -> impl Iterator<Item = &Aim> {
        let walls = self.contacts.iter().map(|contact| &contact.row);
        self.constraints.iter().chain(walls).filter_map(|row| row.aim.as_deref())
    }

    /// The rotors that carry integrals, by number, as bodies and as coordinates.
    pub fn rotors(&self) -> Range<usize> {
        self.own_bodies().len()..self.bodies.len()
    }

    /// True for the coordinate of a rotor that carries an integral.
    pub fn is_integral(&self, coordinate: usize) -> bool {
        self.rotors().contains(&coordinate)
    }

    /// Names of the scene's integrals, and the coordinates whose rates they are.
    pub fn integrals(&self) -> impl Iterator<Item = (&str, usize)> {
        self.rotors().map(|k| (self.bodies[k].name.as_str(), k))
    }

    /// Names of the scene's events.
    pub fn event_names(&self) -> Vec<&str> {
        let events = self.laws.as_ref().map_or(&[][..], |laws| &laws.formulas.events);
        events.iter().map(|event| event.name.as_str()).collect()
    }

    /// True where the powers of a law at one place may say nothing of it at another: see
    /// [`Tape::needs_confirmation`](crate::arithmetic::tape::Tape::needs_confirmation).
    pub fn needs_confirmation(&self) -> bool {
        self.forces.iter().any(|force| force.needs_confirmation)
            || self.aims().any(|aim| aim.tape.needs_confirmation())
    }

    /// True where laws have fractional powers of what branches hold at zero or above.
    pub fn has_powers_above_zero(&self) -> bool {
        let forces = self.forces.iter().flat_map(|force| &force.parts).map(|part| &part.tape);
        forces.chain(self.aims().map(|aim| &aim.tape)).any(Tape::has_powers_above_zero)
    }

    /// True where laws have corners, places stick and slide or events change what acts, so that steps end
    /// where a switch is.
    pub fn is_switched(&self) -> bool {
        !self.frictions.is_empty() || self.laws.as_ref().is_some_and(|laws| laws.formulas.switches())
    }

    /// True where events of the scene end a motion.
    pub fn has_stops(&self) -> bool {
        self.laws.as_ref().is_some_and(|laws| laws.formulas.events.iter().any(|event| event.stop))
    }

    /// True where power series are chosen and serve as references: not with the mean force of a vibration,
    /// which has none, nor with dry friction and aims that depend on the mechanism, which `taylor` takes
    /// where it is asked for; and it takes the matrices of the tree.
    pub fn has_series(&self) -> bool {
        self.has_series_between_switches() && self.frictions.is_empty() && !self.has_aims()
    }

    /// The same with dry friction, between whose transitions the motion is smooth, and with such aims.
    pub fn has_series_between_switches(&self) -> bool {
        self.vibration.is_none() && self.tree.is_dense()
    }

    /// True where the scene has a damper, or a force from outside that depends on rates.
    pub fn is_damped(&self) -> bool {
        self.may_grow_by_rates()
            || !self.frictions.is_empty()
            || self.springs.iter().any(|spring| spring.damping != 0.0)
            || self.torsions.iter().any(|torsion| torsion.damping != 0.0)
    }

    /// True where forces may feed modes by their rates, as formulas and forces from outside may.
    pub fn may_grow_by_rates(&self) -> bool {
        self.forces.iter().any(UserForce::depends_on_rates)
    }

    /// The forces that are no parts of the scene, whether they act or not.
    pub fn forces_from_outside(&self) -> &[UserForce] {
        let whole = self.with_all_parts();
        let own = whole.laws.as_ref().map_or(0, |laws| laws.formulas.force_count());
        &whole.forces[own..]
    }

    /// True where anything but gravity and rows acts.
    pub fn is_forced(&self) -> bool {
        !(self.springs.is_empty()
            && self.torsions.is_empty()
            && self.actions.is_empty()
            && self.forces.is_empty())
    }

    /// True where forces do work that no energy stands for: dampers, applied forces and torques.
    pub fn is_worked_on(&self) -> bool {
        self.keeps_work
            || self.is_damped()
            || !self.actions.is_empty()
            || self.forces.iter().any(UserForce::does_work)
    }

    /// True where motors, dampers or applied forces do work, so that a form must integrate it.
    pub fn has_work_integral(&self) -> bool {
        !self.constraints.is_empty() || self.is_worked_on()
    }

    /// True where only gravity and rows act on bodies that hang on the ground, and whole turns do not matter.
    pub fn is_plain(&self) -> bool {
        self.coordinates() == self.bodies.len() && !self.is_forced() && !self.is_winding()
    }

    /// True where whole turns matter, so that angles are not wrapped.
    pub fn is_winding(&self) -> bool {
        self.keeps_turns
            || !self.torsions.is_empty()
            || self.forces.iter().any(UserForce::counts_turns)
            || self.aims().any(|aim| aim.counted_angles().next().is_some())
    }

    /// The state of these unknowns, of which the first are angles that lack whole `turns`: a winding
    /// mechanism gets them back.
    pub(crate) fn state(&self, time: Time, unknowns: &[DoubleDouble], turns: &[i64]) -> State {
        let mut state = State::new(unknowns, turns.len());
        state.time = time;
        for (taken, before) in state.turns.iter_mut().zip(turns) {
            *taken = taken.saturating_add(*before);
        }
        if self.is_winding() {
            state.unwind();
        }
        state
    }

    /// True where row number `row` is that of a motor, on an angle or on a slider; not where it locks an
    /// angle.
    pub fn is_motor(&self, row: usize) -> bool {
        let of = &self.constraints[row];
        row < self.motors || (of.law.is_some() || of.aim.is_some()) && !of.is_angle()
    }

    /// The unit of what rows measure: `rad`, `m`, or `rad or m` where some measure angles and some lengths;
    /// none without rows.
    pub fn unit_of_rows(&self) -> Option<&'static str> {
        let [angles, lengths] =
            [true, false].map(|kind| self.constraints.iter().any(|row| row.is_angle() == kind));
        match (angles, lengths) {
            (true, true) => Some("rad or m"),
            (true, false) => Some("rad"),
            (false, true) => Some("m"),
            (false, false) => None,
        }
    }

    /// True where a row is left when the given angles are eliminated: loops, sliders, contacts that are held.
    pub fn has_closed_loops(&self) -> bool {
        self.constraints.iter().any(|row| !row.is_angle())
    }

    /// The mechanism without the rows that follow from the others.
    pub(crate) fn without_redundant_rows(&self) -> Cow<'_, Self> {
        if self.assembly.redundant.is_empty() {
            return Cow::Borrowed(self);
        }
        let mut mechanism = self.clone();
        mechanism.constraints.retain(|row| !self.assembly.redundant.contains(&row.name));
        mechanism.assembly.redundant.clear();
        Cow::Owned(mechanism)
    }

    /// True where rows cannot all be eliminated: those of loops and sliders, and given angles whose whole
    /// turns matter.
    pub fn has_multipliers(&self) -> bool {
        self.has_closed_loops()
            || (self.is_winding() && self.partition.driven())
            || self.constraints.iter().any(|row| self.may_be_off(&row.name))
    }
}
