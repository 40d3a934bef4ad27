//! What watches the steps of a point in its lane: the extremes of the scene's outputs, and the events that
//! end it.
//!
//! Both see steps in lanes as the watchers of a single run do, and are lent to the loop of a single run where
//! the point goes on alone.  Events are looked for before a step is made, by the series it is made of: one
//! with an event in it is left to that loop.

use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::event::{EventDetector, EventMemory};
use crate::run::extremes::{Extremes, ExtremesDetector};
use crate::run::observer::{Inside, StepWatcher};
use crate::run::plan::Plan;
use crate::stepping::taylor::batch::TakenStep;
use std::sync::Arc;

/// Share of the largest value of an event function up to which it may be on the other side once the end of a
/// step is put back onto the constraints.
const BESIDE: f64 = 1e-6;

/// The watchers of a trajectory.
#[derive(Default)]
pub(super) struct Watching {
    pub extremes: Option<ExtremesDetector>,
    pub events: Option<EventDetector>,
    /// True where an event has ended it.
    pub has_ended: bool,
    /// What was known of events before the step last looked ahead at, until that is made.
    before: EventMemory,
    is_ahead: bool,
    /// Room for a motion inside a step.
    motion: Motion,
}

impl Watching {
    /// Those a scene asks for; events that end nothing leave no trace in a sweep.
    pub fn of(mechanism: &Arc<Mechanism>, plan: &Plan) -> Self {
        let (whole, off) = mechanism.whole.clone().unwrap_or_else(|| (Arc::clone(mechanism), Vec::new()));
        let mut events = mechanism.has_stops().then(|| EventDetector::of_scene(&whole)).flatten();
        if let Some(events) = &mut events {
            events.suit(plan.tolerance.map(|tolerance| tolerance.relative));
            events.rest(&off);
        }
        Self { extremes: ExtremesDetector::new(mechanism), events, ..Self::default() }
    }

    /// Shown the step that comes next; true where an event is in it, or may be where it ends.
    pub fn ahead(&mut self, passage: &TakenStep) -> bool {
        let Self { events: Some(events), before, is_ahead, motion, .. } = self else { return false };
        before.clone_from(&events.memory);
        *is_ahead = true;
        let is_cut = events.step(&mut Within { passage, motion }).is_some();
        events.take_found(&mut Vec::new());
        passage.motion(passage.step, motion);
        is_cut || events.is_beside_zero(motion, BESIDE)
    }

    /// Shows a step that a lane has made.
    pub fn step(&mut self, passage: &TakenStep) {
        let Self { extremes, motion, is_ahead, .. } = self;
        *is_ahead = false;
        if let Some(extremes) = extremes {
            extremes.step(&mut Within { passage, motion });
        }
    }

    /// Forgets what was looked ahead at: the trajectory stands where that step begins.
    pub fn go_back(&mut self) {
        let Self { events: Some(events), before, is_ahead, .. } = self else { return };
        if std::mem::take(is_ahead) {
            events.memory.clone_from(before);
        }
    }

    /// What the outputs came to.
    pub fn extremes(&self) -> Vec<Extremes> {
        self.extremes.as_ref().map_or_else(Vec::new, ExtremesDetector::extremes)
    }
}

/// The inside of a step in a lane.
struct Within<'a, 'b> {
    passage: &'a TakenStep<'b>,
    motion: &'a mut Motion,
}

impl Inside for Within<'_, '_> {
    fn span(&self) -> (Time, Time) {
        (self.passage.from, self.passage.from + self.passage.step)
    }

    fn at(&mut self, time: Time) -> &Motion {
        let after = (time - self.passage.from).hi.clamp(0.0, self.passage.step);
        self.passage.motion(after, self.motion);
        self.motion
    }

    fn roughly_at(&mut self, time: Time) -> &Motion {
        self.at(time)
    }
}
