//! The events of a run: which functions there are, what they belong to, and what is done at their zeros.

mod named;
mod returns;
mod shortened;

use super::search::{NO_VALUE, Passage};
use super::{Action, Change, Direction, Event, EventRecord, value};
use crate::dynamics::compile::Laws;
use crate::dynamics::configuration::Configuration;
use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::friction::FrictionWatch;
use crate::run::halvings::Halvings;
use crate::run::observer::{Inside, StepWatcher};
use crate::run::rounding::changes;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Share of a step within which the event that began it does not happen again.
pub(super) const SAME: f64 = 1e-9;
/// Records of a kind kept: events, of which more are counted, and in many digits holds and transitions too.
pub const KEPT: usize = 100_000;

/// What a detector remembers between steps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::run) struct EventMemory {
    /// The side of zero each function was on last: -1, 1, or 0 where that is not known.
    pub(super) sides: Vec<i8>,
    /// The largest magnitude of each function so far, or what it changes by in one unit of a coordinate or
    /// rate where it was seen first.
    pub(super) largest: Vec<f64>,
    /// The events of the moment at which one happened last.
    pub(super) last: Vec<(usize, Time)>,
    /// Events of that moment which are still to happen, and whether their functions rise: the step was cut
    /// short by another one, or a jump of the rates has carried the function across zero.
    pub(super) due: Vec<(usize, bool)>,
    /// What is to be done at the end of the step.
    pub pending: Option<(usize, Action)>,
    /// Conditions that changed sign last, and when.
    pub(super) flipped: Vec<(usize, Time)>,
    /// Events of the scene that close a joint which is closed: they rest, as their functions do at zero.
    pub(super) resting: Vec<usize>,
    /// Those that rested until the last step.
    pub(super) woken: Vec<usize>,
    /// Those whose functions were at zero throughout the last part of a step, as rates are of what sticks or
    /// lies on a wall.
    pub(super) still: Vec<usize>,
    /// The event from outside that has just changed the motion, and the side of zero its function goes to.
    pub(super) leaving: Option<(usize, i8)>,
    /// True where what is to be done cannot be: the motion is driven back onto that condition from both
    /// sides.
    pub slides: bool,
}

impl EventMemory {
    /// True for an event of the moment at which one happened last.
    fn has_happened(&self, event: usize) -> bool {
        self.last.iter().any(|(last, _)| *last == event)
    }
}

/// Detects the events of a run: those of the scene, those from outside, then the zeros of the conditions
/// that choose the branches of the scene's laws.
pub(in crate::run) struct EventDetector {
    events: Vec<Box<dyn Event>>,
    /// The scene's formulas on their present branches.
    pub(super) laws: Option<Laws>,
    pub(super) mechanism: Arc<Mechanism>,
    /// Where places stick and slide.
    pub friction: Option<FrictionWatch>,
    pub memory: EventMemory,
    /// Events of the scene that close joints and locks, and these.
    closers: Vec<(usize, Vec<String>)>,
    /// The relative tolerance of the method, zero where it has none.
    pub(super) tolerance: f64,
    /// The event from outside whose function was not a number in the last step.
    pub(super) undefined: Option<usize>,
    /// The event from outside whose action asked for a body that is not there.
    foreign: Option<usize>,
    /// The event from outside whose function left zero to a side, and is on the other one soon in this step.
    pub(super) returning: Option<(usize, i8)>,
    /// The event from outside that came true again before that could be told.
    pub(super) lost: Option<usize>,
    /// Parts of the last step that were halved.
    pub halvings: Halvings,
    /// Events since somebody last took them.
    found: Vec<EventRecord>,
    count: u64,
}

/// What a function belongs to: an event or condition by its number, with the scene's laws.
pub(super) enum Owner<'a> {
    Scene(&'a Laws, usize),
    Outside(usize),
    Condition(&'a Laws, usize),
    Friction(&'a FrictionWatch, usize),
}

/// The function at whose zero an event changed the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::run) enum SwitchFunction {
    /// That of an event of the scene, by its number.
    Event(usize),
    /// A condition of the scene's laws.
    Condition(usize),
    /// One that only the run itself knows.
    Other,
}

impl EventDetector {
    /// One for a mechanism with all its parts, with events from outside.
    pub fn new(mechanism: Arc<Mechanism>, events: Vec<Box<dyn Event>>) -> Self {
        let laws = mechanism.laws.clone();
        let friction = FrictionWatch::new(&mechanism);
        let (memory, found, closers) = (EventMemory::default(), Vec::new(), Vec::new());
        let mut detector = Self {
            events,
            laws,
            mechanism,
            friction,
            memory,
            closers,
            tolerance: 0.0,
            undefined: None,
            foreign: None,
            returning: None,
            lost: None,
            halvings: Halvings::default(),
            found,
            count: 0,
        };
        detector.closers = detector.closing();
        detector.memory.sides = vec![0; detector.functions()];
        detector.memory.largest = vec![0.0; detector.functions()];
        detector
    }

    /// One for what the scene itself asks for; `None` where that is nothing.
    pub fn of_scene(mechanism: &Arc<Mechanism>) -> Option<Self> {
        let detector = Self::new(Arc::clone(mechanism), Vec::new());
        (detector.functions() > 0).then_some(detector)
    }

    /// The events of the scene that close joints and locks, and these.
    fn closing(&self) -> Vec<(usize, Vec<String>)> {
        let mechanism = &self.mechanism;
        let events = self.laws.iter().flat_map(|laws| laws.formulas.events.iter().enumerate());
        events
            .map(|(number, event)| {
                (number, event.on.iter().filter(|part| mechanism.is_joint(part)).cloned().collect())
            })
            .filter(|(_, joints): &(usize, Vec<String>)| !joints.is_empty())
            .collect()
    }

    /// Lets events rest whose joints are closed, where these parts do not act.
    pub fn rest(&mut self, off: &[String]) {
        let Self { closers, memory, .. } = self;
        for (event, joints) in closers.iter() {
            let (rests, rested) =
                (joints.iter().any(|joint| !off.contains(joint)), memory.resting.contains(event));
            if rests && !rested {
                memory.resting.push(*event);
                memory.sides[*event] = 0;
            } else if rested && !rests {
                memory.resting.retain(|resting| resting != event);
                memory.woken.push(*event);
            }
        }
    }

    /// How many events are the scene's.
    fn of_the_scene(&self) -> usize {
        self.laws.as_ref().map_or(0, |laws| laws.formulas.events.len())
    }

    /// How many belong to the scene's events, those from outside and the conditions of laws.
    pub(super) fn before_friction(&self) -> usize {
        self.before_conditions() + self.laws.as_ref().map_or(0, |laws| laws.modes.len())
    }

    /// How many belong to the scene's events and those from outside.
    pub(super) fn before_conditions(&self) -> usize {
        self.of_the_scene() + self.events.len()
    }

    /// How many functions there are.
    fn functions(&self) -> usize {
        self.before_friction() + self.friction.as_ref().map_or(0, FrictionWatch::functions)
    }

    /// The number of an event's function among those of friction, where it is one.
    pub fn friction_function(&self, event: usize) -> Option<usize> {
        event.checked_sub(self.before_friction())
    }

    /// Looks at the steps of a method of this relative tolerance from now on.
    pub fn suit(&mut self, tolerance: Option<f64>) {
        self.tolerance = tolerance.unwrap_or_default();
    }

    /// Goes on with the places with friction in the modes of a mechanism.
    pub fn watch_friction(&mut self, mechanism: &Arc<Mechanism>) {
        self.friction = FrictionWatch::new(mechanism);
    }

    /// What a function belongs to.
    pub(super) fn owner(&self, function: usize) -> Owner<'_> {
        let (scene, conditions) = (self.of_the_scene(), self.before_conditions());
        if let (Some(watch), Some(number)) = (&self.friction, self.friction_function(function)) {
            return Owner::Friction(watch, number);
        }
        match &self.laws {
            Some(laws) if function < scene => Owner::Scene(laws, function),
            Some(laws) if function >= conditions => Owner::Condition(laws, function - conditions),
            _ => Owner::Outside(function - scene),
        }
    }

    /// The function of an event.
    pub fn switch_function(&self, event: usize) -> SwitchFunction {
        match self.owner(event) {
            Owner::Scene(_, number) => SwitchFunction::Event(number),
            Owner::Condition(_, number) => SwitchFunction::Condition(number),
            _ => SwitchFunction::Other,
        }
    }

    /// Goes on with the laws of a mechanism on their present branches.
    pub fn exchange(&mut self, mechanism: Arc<Mechanism>) {
        self.laws.clone_from(&mechanism.laws);
        self.mechanism = mechanism;
    }

    /// Goes on with what another one remembered; false where that was one of other events.
    pub fn restore(&mut self, memory: EventMemory) -> bool {
        let functions = self.functions();
        let fits = memory.sides.len() == functions
            && memory.largest.len() == functions
            && memory.last.iter().all(|(event, _)| *event < functions)
            && memory.due.iter().map(|due| &due.0).chain(&memory.still).all(|event| *event < functions)
            && memory.leaving.is_none_or(|(event, _)| event < functions)
            && memory.pending.as_ref().is_none_or(|(event, _)| *event < functions);
        if fits {
            self.memory = memory;
        }
        fits
    }

    /// Which passages of an event count; of a condition those that leave its present side.
    pub(super) fn counts(&self, event: usize, rises: bool) -> bool {
        let direction = match self.owner(event) {
            Owner::Scene(laws, number) => laws.formulas.events[number].direction,
            Owner::Condition(laws, number) => return laws.modes[number] != rises,
            Owner::Friction(..) => return !rises,
            Owner::Outside(number) => self.events[number].direction(),
        };
        match direction {
            Direction::Either => true,
            Direction::Rising => rises,
            Direction::Falling => !rises,
        }
    }

    /// What happens at an event.
    fn action(&mut self, event: usize, motion: &Motion) -> Action {
        match self.owner(event) {
            Owner::Condition(_, number) => {
                Action::Change(Change { flips: Some(number), ..Change::default() })
            }
            Owner::Scene(laws, number) => {
                let said = &laws.formulas.events[number];
                if said.stop {
                    return Action::Stop;
                }
                let after =
                    self.mechanism.seen(motion, |at| laws.formulas.set_by(number, at, &laws.parameters));
                let off = said.off.iter().map(|part| (part.clone(), false));
                let switches: Vec<_> = off.chain(said.on.iter().map(|part| (part.clone(), true))).collect();
                // Neighbouring motions are given the same values, even where the motion itself keeps its own.
                let parameters = said.parameters().next().is_some().then_some(after);
                if switches.is_empty() && parameters.is_none() {
                    return Action::Record;
                }
                Action::Change(Change { switches, parameters, ..Change::default() })
            }
            Owner::Friction(..) => Action::Record,
            Owner::Outside(number) => {
                let Self { events, mechanism, .. } = self;
                let act = |at: &Configuration<f64>| events[number].action(at, motion);
                let (action, is_foreign) = mechanism.seen(motion, |at| mechanism.checked(at, act));
                if !is_foreign {
                    return action;
                }
                self.foreign = Some(number);
                Action::Stop
            }
        }
    }

    /// Records an event, and tells what is to be done.
    fn happen(&mut self, event: usize, t: Time, motion: &Motion) -> Action {
        self.count += 1;
        self.found.push(EventRecord {
            name: self.name(event).into(),
            t: t.hi,
            phi: (0..motion.phi.len()).map(|k| motion.unwrapped(k)).collect(),
            omega: motion.omega.iter().map(|omega| omega.hi).collect(),
        });
        self.action(event, motion)
    }

    /// Moves what was found to a list, which keeps so many; returns how many there were.
    pub fn take_found(&mut self, list: &mut Vec<EventRecord>) -> u64 {
        let room = KEPT.saturating_sub(list.len());
        list.extend(self.found.drain(..).take(room));
        std::mem::take(&mut self.count)
    }

    /// Appends the values of the functions of events, the scene's and those from outside.
    fn append_event_values(&self, at: &Configuration<f64>, all: &mut Vec<f64>) {
        if let Some(Laws { formulas, parameters, .. }) = &self.laws {
            formulas.append_event_values(at, parameters, all);
        }
        all.extend(self.events.iter().map(|event| value(&self.mechanism, event.as_ref(), at)));
    }

    /// Remembers the events whose functions a jump of the rates has carried across zero: they happen where
    /// the next step begins, unless another jump at this moment carries them back before any of them has
    /// happened.
    pub fn jump(&mut self, [before, after]: [&Motion; 2]) {
        let has_begun = self.memory.last.iter().any(|(_, t)| *t == after.time);
        let [before, after] = [before, after].map(|motion| {
            let mut values = Vec::new();
            self.mechanism.seen(motion, |at| self.append_event_values(at, &mut values));
            values
        });
        let EventMemory { largest, resting, due, .. } = &mut self.memory;
        for (event, (before, after)) in before.into_iter().zip(after).enumerate() {
            let is_clear = before.abs().min(after.abs()) > NO_VALUE * largest[event];
            if !is_clear || (before > 0.0) == (after > 0.0) || resting.contains(&event) {
                continue;
            }
            let rises = after > 0.0;
            match due.iter().position(|due| *due == (event, !rises)) {
                Some(_) if has_begun => {}
                Some(place) => drop(due.remove(place)),
                None => due.push((event, rises)),
            }
        }
    }

    /// Takes what functions change by in one unit of a coordinate or rate for their magnitude, those not seen
    /// before: one that stays at zero has no other.
    fn measure(&mut self, motion: &Motion) {
        let changes = changes(&self.mechanism, motion, |motion| self.values(motion));
        let count = self.before_friction();
        for (largest, change) in self.memory.largest.iter_mut().zip(changes).take(count) {
            if *largest == 0.0 && change.is_finite() {
                *largest = change;
            }
        }
    }

    /// Values of all functions at a motion.
    pub(super) fn values(&self, motion: &Motion) -> Vec<f64> {
        let mut values = Vec::with_capacity(self.functions());
        self.append_values(motion, &mut values);
        values
    }

    /// Appends them.
    pub(super) fn append_values(&self, motion: &Motion, values: &mut Vec<f64>) {
        self.mechanism.seen(motion, |at| {
            self.append_event_values(at, values);
            if let Some(Laws { formulas, parameters, modes }) = &self.laws {
                formulas.append_condition_values(at, parameters, modes, values);
            }
        });
        values.extend(self.friction.iter().flat_map(|watch| watch.values(motion)));
    }
}

impl StepWatcher for EventDetector {
    fn step(&mut self, inside: &mut dyn Inside) -> Option<Time> {
        let (begin, end) = inside.span();
        let span = (end - begin).hi;
        if span <= 0.0 || self.functions() == 0 {
            return None;
        }
        if self.memory.largest[..self.before_friction()].contains(&0.0) {
            self.measure(inside.at(begin));
        }
        let (mut passages, before) = (Vec::new(), (self.memory.sides.clone(), self.memory.still.clone()));
        self.halvings.begin();
        self.passages(inside, begin, span, 0, &mut passages);
        if self.undefined.is_some() || self.halvings.is_too_much() {
            return Some(end);
        }
        self.memory.woken.clear();
        // In the order of their times for each function.
        let all = passages.clone();
        passages.retain(|passage| self.counts(passage.event, passage.rises));
        for passage in passages.iter_mut().filter(|passage| passage.t > begin && !passage.jumps) {
            passage.t = self.polished(inside, passage);
        }
        if self.look_for_return((begin, end), &passages) {
            return Some(begin);
        }
        let due = std::mem::take(&mut self.memory.due).into_iter();
        let due = due.filter(|&(event, rises)| self.counts(event, rises));
        let (part, jumps) = (span, true);
        passages.extend(due.map(|(event, rises)| Passage { t: begin, part, event, rises, jumps }));
        passages.sort_by(|a, b| (a.t - b.t).hi.total_cmp(&0.0).then(a.event.cmp(&b.event)));
        for (number, &Passage { t, event, .. }) in passages.iter().enumerate() {
            let is_friction = matches!(self.owner(event), Owner::Friction(..));
            let is_condition = is_friction || matches!(self.owner(event), Owner::Condition(..));
            // What was found near the beginning may be the zero that the last step ended with.
            self.memory.last.retain(|(_, before)| (t - *before).hi <= SAME * span);
            if self.memory.has_happened(event) && !is_condition {
                continue;
            }
            let landed = inside.landed(t).cloned();
            let motion = landed.unwrap_or_else(|| inside.at(t).clone());
            self.memory.last.retain(|(last, _)| *last != event);
            self.memory.last.push((event, t));
            if is_condition {
                self.memory.flipped.retain(|(_, before)| (t - *before).hi <= SAME * span);
                if !is_friction {
                    self.memory.slides = self.memory.flipped.iter().any(|(flipped, _)| *flipped == event);
                    self.memory.flipped.push((event, t));
                }
                self.memory.pending = Some((event, self.action(event, &motion)));
                self.put_off(&passages[number + 1..], t, span);
                self.cut(&all, t, (begin, span), &before);
                return Some(t);
            }
            let action = self.happen(event, t, &motion);
            if action != Action::Record {
                // What acts from then on may drive a motion back that has just flipped a condition.
                self.memory.flipped.clear();
                self.memory.pending = Some((event, action));
                self.put_off(&passages[number + 1..], t, span);
                self.cut(&all, t, (begin, span), &before);
                return Some(t);
            }
        }
        None
    }
}
