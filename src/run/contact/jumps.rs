//! What happens between two steps, for those who follow a motion from outside.

use crate::dynamics::{Mechanism, Motion};
use crate::run::event::SwitchFunction;
use std::sync::{Arc, Mutex, PoisonError};

/// What happened between two steps: an impact, points held or released, or a change by an event.
#[derive(Clone, Debug)]
pub(in crate::run) struct Jump {
    /// The contact of an impact, the first of several.
    pub contact: Option<usize>,
    /// The contacts that touch where several walls take part in it, which neighbouring motions meet one after
    /// the other.
    pub together: Vec<usize>,
    /// The change by an event.
    pub switch: Option<Switch>,
    /// The place with friction that begins to stick or to slide, at the zero of its event function.
    pub friction: Option<usize>,
    /// The motion on both sides.
    pub before: Motion,
    pub after: Motion,
    /// The mechanism with the contacts held from then on.
    pub mechanism: Arc<Mechanism>,
}

/// A change by an event.
#[derive(Clone, Debug)]
pub(in crate::run) struct Switch {
    /// The function whose zero it is at.
    pub at: SwitchFunction,
    /// Whether the motion and the parameters are the same after it, and only parts and branches are others.
    pub keeps_motion: bool,
    pub keeps_parameters: bool,
    /// Parts that do not act from then on.
    pub off: Vec<String>,
}

/// Jumps since somebody last took them, where somebody asks.
#[derive(Clone, Debug, Default)]
pub(in crate::run) struct JumpLog {
    list: Arc<Mutex<Vec<Jump>>>,
    /// Whether changes by events are wanted.
    has_switches: bool,
}

impl JumpLog {
    /// One that takes changes by events too.
    pub fn with_switches() -> Self {
        Self { has_switches: true, ..Self::default() }
    }

    pub fn push(&self, jump: Jump) {
        if jump.switch.is_none() || self.has_switches {
            self.list.lock().unwrap_or_else(PoisonError::into_inner).push(jump);
        }
    }

    /// Tells that the last one is a transition of a place with friction.
    pub fn at_friction(&self, place: usize) {
        if let Some(last) = self.list.lock().unwrap_or_else(PoisonError::into_inner).last_mut() {
            last.friction = Some(place);
        }
    }

    /// Takes them out.
    pub fn take(&self) -> Vec<Jump> {
        std::mem::take(&mut *self.list.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
