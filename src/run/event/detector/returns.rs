//! Events from outside that change the motion and come true again too soon to be told from themselves, as
//! those of a ball whose bounces accumulate.

use super::{EventDetector, Owner, SAME};
use crate::arithmetic::Scalar;
use crate::dynamics::{Motion, Time};
use crate::run::event::search::Passage;
use crate::run::event::value;
use crate::run::rounding::last_digits;
use crate::stepping::search::sign;

/// Part of the time in which a coordinate moves by its unit over which an event function is differenced.
const BESIDE: f64 = 1.0 / 1024.0;
/// What a rate must be over the error of its differences, and over what last digits make of them, to have a
/// sign.
const ERROR: f64 = 0.01;
const DIGITS: f64 = 8.0;
/// Share of its largest value within which a function is at its zero after a change.
const AT_ZERO: f64 = 1e-9;

impl EventDetector {
    /// Remembers to which side of zero an event from outside goes that has just changed the motion.
    pub fn leave(&mut self, event: usize, motion: &Motion) {
        let side = self.side_ahead(event, motion);
        self.memory.leaving = (side != 0).then_some((event, side));
    }

    /// The side of zero to which the rates take the function of an event from outside that is at its zero; 0
    /// where they take it nowhere.  Of a function of rates nothing is told.
    fn side_ahead(&self, event: usize, motion: &Motion) -> i8 {
        let Owner::Outside(number) = self.owner(event) else { return 0 };
        let (angles, units) = (self.mechanism.bodies.len(), self.mechanism.units);
        let rates = motion.omega.iter().enumerate();
        let fastest = rates
            .map(|(k, omega)| omega.hi.abs() / if k < angles { 1.0 } else { units.length })
            .fold(1.0 / units.time, f64::max);
        let span = BESIDE / fastest;
        let outside = self.events[number].as_ref();
        let value = |motion: &Motion| self.mechanism.seen(motion, |at| value(&self.mechanism, outside, at));
        let ahead = |ahead: f64| {
            let mut there = motion.clone();
            there.time = motion.time + ahead;
            for (phi, omega) in there.phi.iter_mut().zip(&motion.omega) {
                *phi += omega.scale(ahead);
            }
            there
        };
        let at = |time: f64| value(&ahead(time));
        let [fine, coarse] = [span, 2.0 * span].map(|span| (at(span) - at(-span)) / (2.0 * span));
        let rate = fine + (fine - coarse) / 3.0;
        let rounding = last_digits(&ahead(span), |motion| vec![value(motion)])[0];
        let off = ERROR * (fine - coarse).abs() + DIGITS * rounding / span;
        let is_at_zero = at(0.0).abs() <= AT_ZERO * self.memory.largest[event];
        if is_at_zero && rate.abs() > off { sign(rate) } else { 0 }
    }

    /// Looks whether the return of a function that left zero to a side, and is on the other one after it, is
    /// among the passages of a step, which are located; true where it is lost.
    pub(super) fn look_for_return(&mut self, (begin, end): (Time, Time), passages: &[Passage]) -> bool {
        let Some((event, side)) = self.returning.take() else { return false };
        let (rises, same) = (side < 0, SAME * (end - begin).hi);
        let is_the_last =
            |t: Time| self.memory.last.iter().any(|(last, at)| *last == event && (t - *at).hi <= same);
        let mut returns = passages.iter().filter(|passage| passage.event == event && passage.rises == rises);
        if self.counts(event, rises) && returns.all(|passage| is_the_last(passage.t)) {
            self.lost = Some(event);
        }
        self.lost.is_some()
    }

    /// The name of the event that came true again before that could be told.
    pub fn take_lost(&mut self) -> Option<String> {
        self.lost.take().map(|event| self.name(event).into())
    }
}
