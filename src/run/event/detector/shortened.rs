//! Steps that an event cuts short: what of them has not happened, and what happens where the next one begins,
//! or would begin.

use super::{Action, EventDetector, Owner, SAME};
use crate::dynamics::{Motion, Time};
use crate::run::event::search::Passage;

impl EventDetector {
    /// Takes back what passes zero later than the step of so many seconds is cut short; where that is at its
    /// `begin`, functions are on the sides `before` and at zero as then, but those of events that happened:
    /// what the step shows is not what follows.
    pub(super) fn cut(
        &mut self,
        passages: &[Passage],
        t: Time,
        (begin, span): (Time, f64),
        before: &(Vec<i8>, Vec<usize>),
    ) {
        let (is_begin, now) = ((t - begin).hi <= SAME * span, t + SAME * span);
        let later = passages.iter().rev().filter(|passage| passage.t > t);
        for Passage { event, rises, t, .. } in later {
            // What has just happened was located to less than the others.
            if *t > now || !self.memory.has_happened(*event) {
                self.memory.sides[*event] = if *rises { -1 } else { 1 };
            }
        }
        if is_begin {
            self.memory.still.clone_from(&before.1);
        }
        let events = self.of_the_scene() + self.events.len();
        for (event, &side) in before.0.iter().enumerate().take(events).filter(|_| is_begin) {
            if !self.memory.has_happened(event) {
                self.memory.sides[event] = side;
            }
        }
        for &(event, rises) in &self.memory.due {
            self.memory.sides[event] = if rises { 1 } else { -1 };
        }
    }

    /// Remembers the events that happen at the very moment, too, at which another one cuts a step short:
    /// where the next one begins rounding may have them behind.  Conditions stay on their sides until they
    /// flip.
    pub(super) fn put_off(&mut self, later: &[Passage], t: Time, span: f64) {
        let is_now = |passage: &&Passage| (passage.t - t).hi <= SAME * span;
        for Passage { event, rises, .. } in later.iter().take_while(is_now) {
            let is_event = matches!(self.owner(*event), Owner::Scene(..) | Owner::Outside(_));
            if is_event && !self.memory.has_happened(*event) {
                self.memory.due.push((*event, *rises));
            }
        }
    }

    /// The events that are due at the end of a run, which no step follows, up to one at which something is to
    /// be done; false where there is none.
    pub fn happen_at_end(&mut self, motion: &Motion) -> bool {
        if self.memory.pending.is_some() {
            // Located behind the end by less than a bit of its time.
            return true;
        }
        self.memory.due.sort_by_key(|due| due.0);
        while !self.memory.due.is_empty() {
            let (event, rises) = self.memory.due.remove(0);
            if !self.counts(event, rises) {
                continue;
            }
            self.memory.last.push((event, motion.time));
            let action = self.happen(event, motion.time, motion);
            if action != Action::Record {
                self.memory.pending = Some((event, action));
                return true;
            }
        }
        false
    }
}
