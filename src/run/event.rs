//! Events of scenes and from outside the crate: conditions on the motion, located on the dense output of every
//! step, and what happens there.
//!
//! The event functions of a step are interpolated at Chebyshev points, by as high a degree as they ask for,
//! and searched by the same root finding as walls and flips ([`search`](crate::stepping)); the zero is then
//! polished on the dense output itself.

use super::friction::FrictionWatch;
use super::inside::{Inside, StepWatcher};
use crate::dynamics::compile::Laws;
use crate::dynamics::configuration::Configuration;
use crate::dynamics::{Mechanism, Motion, Time};
pub use crate::scene::Direction;
use crate::stepping::search::{Chebyshev, Curve, Interpolants, interpolated, root};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Degrees of the interpolants, and what the last coefficients may be over the largest value: so much, or this
/// share of the relative tolerance, by which the dense output of a step is not smooth itself.
const DEGREES: [usize; 3] = [8, 16, 32];
const RESOLVED: f64 = 1e-11;
const SHARE: f64 = 0.1;
/// Halvings of a step whose event functions no interpolant resolves.
const HALVINGS: u32 = 4;
/// Steps of the secant method at most.
const ROUNDS: usize = 6;
/// Share of a step over which the slope of an event function is taken, and which corrections of its zero keep to.
const SLOPE: f64 = 1e-3;
/// Share of a step within which the event that began it does not happen again.
const SAME: f64 = 1e-9;
/// Share of a step in which an event function leaves zero that was kept there by a joint.
const LEAVES: f64 = 1e-5;
/// Share of the largest value within a step up to which a condition is at its zero where the step begins.
const NO_VALUE: f64 = 1e-12;
/// Steps of this share of the time are rounding.
const INSTANT: f64 = 8.0 * f64::EPSILON;
/// Events kept; more are counted.
const KEPT: usize = 100_000;

/// A condition on the motion, and what happens where it comes true.
///
/// ```
/// use driftless::run::{Action, Change, Event};
/// use driftless::{Configuration, MethodId, Motion, Simulation, Site, read_scene};
///
/// /// Stops when a point comes to a height from below.
/// struct Reaches {
///     tip: Site,
///     height: f64,
/// }
///
/// impl Event for Reaches {
///     fn name(&self) -> &str {
///         "reaches"
///     }
///
///     fn value(&self, at: &Configuration<f64>) -> f64 {
///         at.position(&self.tip)[1] - self.height
///     }
///
///     fn action(&mut self, _at: &Configuration<f64>, _motion: &Motion) -> Action {
///         Action::Stop
///     }
/// }
///
/// # fn main() -> Result<(), driftless::Error> {
/// let scene = read_scene("examples/scenes/free.json".as_ref(), &[])?;
/// let simulation = Simulation::new(&scene)?;
/// let tip = simulation.site("bar2", [0.6, 0.0])?;
/// let outcome = simulation.event(Reaches { tip, height: 0.5 }).method(MethodId::Taylor).run()?;
/// assert_eq!(outcome.ended_by.as_deref(), Some("reaches"));
/// assert_eq!(outcome.events[0].t, outcome.last.t);
/// # Ok(())
/// # }
/// ```
pub trait Event: Send + Sync {
    /// Name in records.
    fn name(&self) -> &str;

    /// The event function: a smooth function of time, positions and rates, whose zero is the event.
    fn value(&self, at: &Configuration<f64>) -> f64;

    /// Which passages count; both unless said otherwise.
    fn direction(&self) -> Direction {
        Direction::Either
    }

    /// What happens there; it is recorded in any case.
    fn action(&mut self, _at: &Configuration<f64>, _motion: &Motion) -> Action {
        Action::Record
    }
}

/// What happens at an event.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Action {
    /// Nothing beside the record.
    #[default]
    Record,
    /// The run ends here; its outcome is kept.
    Stop,
    /// The motion goes on changed.  A fixed step that is cut short there is followed by one that ends on the next
    /// output time.
    Change(Change),
}

/// A change of the motion or of the scene's parts at an event.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// The motion after it, where that is another one.
    pub(super) motion: Option<Motion>,
    /// Springs, torsion springs and forces by name, and whether they act from now on.
    pub(super) switches: Vec<(String, bool)>,
    /// Values of the scene's parameters from now on, where they change.
    pub(super) parameters: Option<Vec<f64>>,
    /// The condition of the scene's laws that changes its sign.
    pub(super) flips: Option<usize>,
}

impl Change {
    /// Goes on from another motion: positions and rates, which must satisfy the constraints; the change of
    /// energy is booked as that of an impact.
    #[must_use]
    pub fn to(mut self, motion: Motion) -> Self {
        self.motion = Some(motion);
        self
    }

    /// Lets a spring, a torsion spring, or an applied force or torque act from now on, or no longer; the
    /// energy it stores is booked likewise.
    #[must_use]
    pub fn switch(mut self, part: &str, on: bool) -> Self {
        self.switches.push((part.into(), on));
        self
    }
}

/// An event that happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EventRecord {
    /// Its name.
    pub name: String,
    /// Time \[s\].
    pub t: f64,
    /// Winding angles of all bodies \[rad\], then translational coordinates \[m\].
    pub phi: Vec<f64>,
    /// Rates \[rad/s, m/s\].
    pub omega: Vec<f64>,
}

/// What a detector remembers between steps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Memory {
    /// The side of zero each function was on last: -1, 1, or 0 where that is not known.
    sides: Vec<i8>,
    /// The event that happened last, and when.
    last: Option<(usize, Time)>,
    /// What is to be done at the end of the step.
    pub pending: Option<(usize, Action)>,
    /// Conditions that changed sign last, and when.
    flipped: Vec<(usize, Time)>,
    /// Events of the scene that close a joint which is closed: they rest, as their functions do at zero.
    resting: Vec<usize>,
    /// Those that rested until the last step.
    woken: Vec<usize>,
    /// True where what is to be done cannot be: the motion is driven back onto that condition from both sides.
    pub slides: bool,
}

/// Looks for the events of a run: those of the scene, those from outside, then the zeros of the conditions
/// that choose the branches of the scene's laws.
pub(super) struct EventDetector {
    events: Vec<Box<dyn Event>>,
    /// The scene's formulas on their present branches.
    laws: Option<Laws>,
    mechanism: Arc<Mechanism>,
    /// Where places stick and slide.
    pub friction: Option<FrictionWatch>,
    pub memory: Memory,
    /// Events of the scene that close joints and locks, and these.
    closers: Vec<(usize, Vec<String>)>,
    /// What the last coefficients of an interpolant may be over its largest value.
    resolved: f64,
    /// Events since somebody last took them.
    found: Vec<EventRecord>,
    count: u64,
}

/// What a function belongs to: an event or condition by its number, with the scene's laws.
enum Owner<'a> {
    Scene(&'a Laws, usize),
    Outside(usize),
    Condition(&'a Laws, usize),
    Friction(&'a FrictionWatch, usize),
}

/// The function at whose zero an event changed the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SwitchFunction {
    /// That of an event of the scene, by its number.
    Event(usize),
    /// A condition of the scene's laws.
    Condition(usize),
    /// One that only the run itself knows.
    Other,
}

/// A passage of an event function.
struct Passage {
    t: Time,
    event: usize,
    rises: bool,
}

impl EventDetector {
    /// One for a mechanism with all its parts, with events from outside.
    pub fn new(mechanism: Arc<Mechanism>, events: Vec<Box<dyn Event>>) -> Self {
        let laws = mechanism.laws.clone();
        let friction = FrictionWatch::new(&mechanism);
        let (memory, found) = (Memory::default(), Vec::new());
        let mut detector = Self {
            events,
            laws,
            mechanism,
            friction,
            memory,
            closers: Vec::new(),
            resolved: RESOLVED,
            found,
            count: 0,
        };
        detector.closers = detector.closing();
        detector.memory.sides = vec![0; detector.functions()];
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
        let is_joint = |part: &String| {
            let row = mechanism.constraints.iter().position(|row| row.name == *part);
            mechanism.joints.iter().any(|joint| joint.name == *part)
                || row.is_some_and(|row| !mechanism.is_motor(row))
        };
        let events = self.laws.iter().flat_map(|laws| laws.formulas.events.iter().enumerate());
        events
            .map(|(number, event)| (number, event.on.iter().filter(|part| is_joint(part)).cloned().collect()))
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
    fn before_friction(&self) -> usize {
        let conditions = self.laws.as_ref().map_or(0, |laws| laws.modes.len());
        self.of_the_scene() + self.events.len() + conditions
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
        self.resolved = RESOLVED.max(SHARE * tolerance.unwrap_or_default());
    }

    /// Goes on with the places with friction in the modes of a mechanism.
    pub fn watch_friction(&mut self, mechanism: &Arc<Mechanism>) {
        self.friction = FrictionWatch::new(mechanism);
    }

    /// What a function belongs to.
    fn owner(&self, function: usize) -> Owner<'_> {
        let (scene, conditions) = (self.of_the_scene(), self.of_the_scene() + self.events.len());
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

    /// True for an event that is not the scene's own.
    pub fn is_from_outside(&self, event: usize) -> bool {
        matches!(self.owner(event), Owner::Outside(_))
    }

    /// Goes on with the laws of a mechanism on their present branches.
    pub fn exchange(&mut self, mechanism: Arc<Mechanism>) {
        self.laws.clone_from(&mechanism.laws);
        self.mechanism = mechanism;
    }

    /// Goes on with what another one remembered; false where that was one of other events.
    pub fn restore(&mut self, memory: Memory) -> bool {
        let functions = self.functions();
        let fits = memory.sides.len() == functions
            && memory.last.is_none_or(|(event, _)| event < functions)
            && memory.pending.as_ref().is_none_or(|(event, _)| *event < functions);
        if fits {
            self.memory = memory;
        }
        fits
    }

    /// The name of an event.
    pub fn name(&self, event: usize) -> &str {
        match self.owner(event) {
            Owner::Scene(laws, number) => &laws.formulas.events[number].name,
            Owner::Condition(laws, number) => &laws.formulas.conditions[number],
            Owner::Friction(watch, number) => watch.place(number).map_or("friction", |place| &place.name),
            Owner::Outside(number) => self.events[number].name(),
        }
    }

    /// Which passages of an event count; of a condition those that leave its present side.
    fn counts(&self, event: usize, rises: bool) -> bool {
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
                let parameters = (after != laws.parameters).then_some(after);
                if switches.is_empty() && parameters.is_none() {
                    return Action::Record;
                }
                Action::Change(Change { switches, parameters, ..Change::default() })
            }
            Owner::Friction(..) => Action::Record,
            Owner::Outside(number) => {
                let Self { events, mechanism, .. } = self;
                mechanism.seen(motion, |at| events[number].action(at, motion))
            }
        }
    }

    /// Moves what was found to a list, which keeps so many; returns how many there were.
    pub fn take_found(&mut self, list: &mut Vec<EventRecord>) -> u64 {
        let room = KEPT.saturating_sub(list.len());
        list.extend(self.found.drain(..).take(room));
        std::mem::take(&mut self.count)
    }

    /// Values of all event functions at a motion.
    fn values(&self, motion: &Motion) -> Vec<f64> {
        let mut values: Vec<f64> = self.mechanism.seen(motion, |at| {
            let from_outside = self.events.iter().map(|event| event.value(at));
            let Some(Laws { formulas, parameters, modes }) = &self.laws else {
                return from_outside.collect();
            };
            (0..formulas.events.len())
                .map(|event| formulas.event_value(event, at, parameters))
                .chain(from_outside)
                .chain(formulas.condition_values(at, parameters, modes))
                .collect()
        });
        values.extend(self.friction.iter().flat_map(|watch| watch.values(motion)));
        values
    }

    /// Passages in a part of a step, in no order.
    fn passages(
        &mut self,
        inside: &mut dyn Inside,
        begin: Time,
        span: f64,
        depth: u32,
        all: &mut Vec<Passage>,
    ) {
        let at = |share: f64, row: &mut Vec<f64>| row.extend(self.values(inside.at(begin + share * span)));
        let is_enough = |curve: &Chebyshev| curve.tail() <= self.resolved * curve.most();
        let Interpolants { curves, values, .. } = interpolated(&DEGREES, at, |_, curve, _| is_enough(curve));
        let is_resolved = curves.iter().all(|curve| is_enough(curve) || !curve.most().is_finite());
        if !is_resolved && depth < HALVINGS {
            self.passages(inside, begin, 0.5 * span, depth + 1, all);
            return self.passages(inside, begin + 0.5 * span, 0.5 * span, depth + 1, all);
        }
        for (event, curve) in curves.iter().enumerate() {
            if self.memory.resting.contains(&event) {
                continue;
            }
            let is_woken = self.memory.woken.contains(&event);
            let sign = |value: f64| if value > 0.0 { 1 } else { -i8::from(value < 0.0) };
            // From the last node to the first.
            let nodes = &values[event];
            let [first, next] = [nodes[nodes.len() - 1], nodes[nodes.len() - 2]];
            let mode = match self.owner(event) {
                Owner::Condition(laws, number) => Some(laws.modes[number]),
                Owner::Friction(..) => Some(true),
                _ => None,
            };
            // Within the rounding of time a condition is on both sides.
            if mode.is_some() && span <= INSTANT * begin.hi.abs() {
                continue;
            }
            if let Some(mode) = mode {
                // It lies on the side its laws are recorded for, and leaves it at once where it turns away.
                // An impact may have carried it across.
                let other = if mode { -1 } else { 1 };
                let is_there = first.abs() <= NO_VALUE * curve.most() || sign(first) == other;
                if is_there && sign(next) == other {
                    all.push(Passage { t: begin, event, rises: !mode });
                }
            }
            let side = &mut self.memory.sides[event];
            if mode.is_none() && first == 0.0 && *side != 0 && sign(next) == -*side {
                all.push(Passage { t: begin, event, rises: *side < 0 });
            }
            *side = if first == 0.0 || self.memory.last == Some((event, begin)) {
                sign(next)
            } else {
                sign(first)
            };
            // What has just left zero is not sent back by rounding.
            let mut share = if is_woken { LEAVES } else { 0.0 };
            if is_woken {
                *side = sign(curve.at(share)[0]);
            }
            while let Some(zero) = root(curve, 0.0, share, 1.0) {
                share = zero + SAME;
                let after = sign(curve.at(share.min(1.0))[0]);
                // At the very end of a step what follows is not known: it is on the other side.
                *side = if after == 0 || share >= 1.0 { -*side } else { after };
                all.push(Passage { t: begin + zero * span, event, rises: *side > 0 });
                if share >= 1.0 {
                    break;
                }
            }
        }
    }

    /// Where a passage near `near` is on the dense output, between the ends of the step.
    fn polished(&self, inside: &mut dyn Inside, event: usize, near: Time) -> Time {
        let (begin, end) = inside.span();
        let mut at = |t: Time| self.values(inside.at(t))[event];
        let shift = SAME * (end - begin).hi;
        let (mut before, mut t) =
            (if (near - begin).hi > shift { near + -shift } else { near + shift }, near);
        let (mut value_before, mut value) = (at(before), at(t));
        for _ in 0..ROUNDS {
            let change = value * (t - before).hi / (value - value_before);
            if value == 0.0 || !change.is_finite() || change.abs() > 1e-3 * (end - begin).hi {
                break;
            }
            (before, value_before) = (t, value);
            t = t + -change;
            t = if t < begin {
                begin
            } else if t > end {
                end
            } else {
                t
            };
            value = at(t);
            if change.abs() <= f64::EPSILON * t.hi.abs() {
                break;
            }
        }
        self.landed(inside, event, t)
    }

    /// The same of a method whose dense output is less accurate than its steps: by steps that end there, with
    /// the slope of the dense output.
    fn landed(&self, inside: &mut dyn Inside, event: usize, mut t: Time) -> Time {
        let (begin, end) = inside.span();
        let span = (end - begin).hi;
        let beside = if (t - begin).hi > SLOPE * span { t + -SLOPE * span } else { t + SLOPE * span };
        let mut slope = None;
        for _ in 0..ROUNDS {
            let Some(value) = inside.landed(t).map(|motion| self.values(motion)[event]) else { break };
            let slope = *slope.get_or_insert_with(|| {
                let [here, there] = [t, beside].map(|t| self.values(inside.at(t))[event]);
                (there - here) / (beside - t).hi
            });
            let change = value / slope;
            if !change.is_finite() || change.abs() > SLOPE * span {
                break;
            }
            let next = t + -change;
            if next <= begin || next >= end {
                break;
            }
            t = next;
            if change.abs() <= SAME * SAME.sqrt() * span {
                break;
            }
        }
        t
    }
}

impl StepWatcher for EventDetector {
    fn step(&mut self, inside: &mut dyn Inside) -> Option<Time> {
        let (begin, end) = inside.span();
        let span = (end - begin).hi;
        if span <= 0.0 || self.functions() == 0 {
            return None;
        }
        let mut passages = Vec::new();
        self.passages(inside, begin, span, 0, &mut passages);
        self.memory.woken.clear();
        passages.sort_by(|a, b| (a.t - b.t).hi.total_cmp(&0.0).then(a.event.cmp(&b.event)));
        for Passage { t, event, rises } in passages {
            let is_friction = matches!(self.owner(event), Owner::Friction(..));
            let is_condition = is_friction || matches!(self.owner(event), Owner::Condition(..));
            let is_same = self
                .memory
                .last
                .is_some_and(|(last, before)| last == event && (t - before).hi <= SAME * span);
            if !self.counts(event, rises) || is_same && !is_condition {
                continue;
            }
            let t = if t > begin { self.polished(inside, event, t) } else { t };
            let landed = inside.landed(t).cloned();
            let motion = landed.unwrap_or_else(|| inside.at(t).clone());
            self.memory.last = Some((event, t));
            if is_condition {
                self.memory.flipped.retain(|(_, before)| (t - *before).hi <= SAME * span);
                if !is_friction {
                    self.memory.slides = self.memory.flipped.iter().any(|(flipped, _)| *flipped == event);
                    self.memory.flipped.push((event, t));
                }
                self.memory.pending = Some((event, self.action(event, &motion)));
                return Some(t);
            }
            self.count += 1;
            self.found.push(EventRecord {
                name: self.name(event).into(),
                t: t.hi,
                phi: (0..motion.phi.len()).map(|k| motion.unwrapped(k)).collect(),
                omega: motion.omega.iter().map(|omega| omega.hi).collect(),
            });
            let action = self.action(event, &motion);
            if action != Action::Record {
                self.memory.pending = Some((event, action));
                return Some(t);
            }
        }
        None
    }
}
