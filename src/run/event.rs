//! Events from outside the crate: conditions on the motion, located on the dense output of every step, and
//! what happens there.
//!
//! The event functions of a step are interpolated at Chebyshev points, by as high a degree as they ask for,
//! and searched by the same root finding as walls and flips ([`search`](crate::stepping)); the zero is then
//! polished on the dense output itself.

use super::inside::{Inside, StepWatcher};
use crate::dynamics::configuration::{Configuration, Values};
use crate::dynamics::{Mechanism, Motion, Time};
use crate::stepping::search::{Chebyshev, Curve, root};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Degrees of the interpolants, and what the last coefficients may be over the largest value.
const DEGREES: [usize; 3] = [8, 16, 32];
const RESOLVED: f64 = 1e-11;
/// Halvings of a step whose event functions no interpolant resolves.
const HALVINGS: u32 = 4;
/// Steps of the secant method at most.
const ROUNDS: usize = 6;
/// Share of a step within which the event that began it does not happen again.
const SAME: f64 = 1e-9;
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

/// Passages of an event function through zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Direction {
    /// Both.
    #[default]
    Either,
    /// From negative to positive.
    Rising,
    /// From positive to negative.
    Falling,
}

/// What happens at an event.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Action {
    /// Nothing beside the record.
    #[default]
    Record,
    /// The run ends here; its outcome is kept.
    Stop,
    /// The motion goes on changed.  Fixed-step methods refuse that: their steps would no longer end on the
    /// output times.
    Change(Change),
}

/// A change of the motion or of the scene's parts at an event.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// The motion after it, where that is another one.
    pub(super) motion: Option<Motion>,
    /// Springs, torsion springs and forces by name, and whether they act from now on.
    pub(super) switches: Vec<(String, bool)>,
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
}

/// Looks for the events of a run.
pub(super) struct EventDetector {
    events: Vec<Box<dyn Event>>,
    mechanism: Arc<Mechanism>,
    pub memory: Memory,
    /// Events since somebody last took them.
    found: Vec<EventRecord>,
    count: u64,
}

/// A passage of an event function.
struct Passage {
    t: Time,
    event: usize,
    rises: bool,
}

impl EventDetector {
    pub fn new(mechanism: Arc<Mechanism>, events: Vec<Box<dyn Event>>) -> Self {
        let memory = Memory { sides: vec![0; events.len()], ..Memory::default() };
        Self { events, mechanism, memory, found: Vec::new(), count: 0 }
    }

    /// Goes on with what another one remembered; false where that was one of other events.
    pub fn restore(&mut self, memory: Memory) -> bool {
        let fits = memory.sides.len() == self.events.len()
            && memory.last.is_none_or(|(event, _)| event < self.events.len())
            && memory.pending.as_ref().is_none_or(|(event, _)| *event < self.events.len());
        if fits {
            self.memory = memory;
        }
        fits
    }

    /// The name of an event.
    pub fn name(&self, event: usize) -> &str {
        self.events[event].name()
    }

    /// Moves what was found to a list, which keeps so many; returns how many there were.
    pub fn take_found(&mut self, list: &mut Vec<EventRecord>) -> u64 {
        let room = KEPT.saturating_sub(list.len());
        list.extend(self.found.drain(..).take(room));
        std::mem::take(&mut self.count)
    }

    /// Values of all event functions at a motion.
    fn values(&self, motion: &Motion) -> Vec<f64> {
        with(&self.mechanism, motion, |at| self.events.iter().map(|event| event.value(at)).collect())
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
        let mut curves: Vec<Chebyshev> = Vec::new();
        let mut nearest = Vec::new();
        for degree in DEGREES {
            let nodes: Vec<Vec<f64>> =
                Chebyshev::nodes(degree).map(|node| self.values(inside.at(begin + node * span))).collect();
            curves = (0..self.events.len())
                .map(|event| {
                    Chebyshev::through(&nodes.iter().map(|values| values[event]).collect::<Vec<_>>())
                })
                .collect();
            // From the last node to the first.
            nearest = nodes.into_iter().rev().take(2).collect();
            if curves.iter().all(|curve| curve.tail() <= RESOLVED * curve.most()) {
                break;
            }
        }
        let is_resolved =
            curves.iter().all(|curve| curve.tail() <= RESOLVED * curve.most() || !curve.most().is_finite());
        if !is_resolved && depth < HALVINGS {
            self.passages(inside, begin, 0.5 * span, depth + 1, all);
            return self.passages(inside, begin + 0.5 * span, 0.5 * span, depth + 1, all);
        }
        for (event, curve) in curves.iter().enumerate() {
            let sign = |value: f64| if value > 0.0 { 1 } else { -i8::from(value < 0.0) };
            let [first, next] = [nearest[0][event], nearest[1][event]];
            let side = &mut self.memory.sides[event];
            if first == 0.0 && *side != 0 && sign(next) == -*side {
                all.push(Passage { t: begin, event, rises: *side < 0 });
            }
            *side = if first == 0.0 || self.memory.last == Some((event, begin)) {
                sign(next)
            } else {
                sign(first)
            };
            let mut share = 0.0;
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
        t
    }
}

impl StepWatcher for EventDetector {
    fn step(&mut self, inside: &mut dyn Inside) -> Option<Time> {
        let (begin, end) = inside.span();
        let span = (end - begin).hi;
        if span <= 0.0 || self.events.is_empty() {
            return None;
        }
        let mut passages = Vec::new();
        self.passages(inside, begin, span, 0, &mut passages);
        passages.sort_by(|a, b| (a.t - b.t).hi.total_cmp(&0.0).then(a.event.cmp(&b.event)));
        for Passage { t, event, rises } in passages {
            let counts = match self.events[event].direction() {
                Direction::Either => true,
                Direction::Rising => rises,
                Direction::Falling => !rises,
            };
            let is_same = self
                .memory
                .last
                .is_some_and(|(last, before)| last == event && (t - before).hi <= SAME * span);
            if !counts || is_same {
                continue;
            }
            let t = self.polished(inside, event, t);
            let motion = inside.at(t).clone();
            self.memory.last = Some((event, t));
            self.count += 1;
            self.found.push(EventRecord {
                name: self.events[event].name().into(),
                t: t.hi,
                phi: (0..motion.phi.len()).map(|k| motion.unwrapped(k)).collect(),
                omega: motion.omega.iter().map(|omega| omega.hi).collect(),
            });
            let Self { events, mechanism, .. } = self;
            let action = with(mechanism, &motion, |at| events[event].action(at, &motion));
            if action != Action::Record {
                self.memory.pending = Some((event, action));
                return Some(t);
            }
        }
        None
    }
}

/// Calls `then` with the configuration of a motion.
fn with<R>(mechanism: &Mechanism, motion: &Motion, then: impl FnOnce(&Configuration<f64>) -> R) -> R {
    let phi: Vec<f64> = motion.phi.iter().map(|phi| phi.hi).collect();
    let omega: Vec<f64> = motion.omega.iter().map(|omega| omega.hi).collect();
    let z = mechanism.elements(&phi);
    let phi: Vec<f64> = (0..phi.len()).map(|k| motion.unwrapped(k)).collect();
    then(&Configuration::new(&Values { time: motion.time.hi, phi: &phi, z: &z, omega: &omega }))
}
