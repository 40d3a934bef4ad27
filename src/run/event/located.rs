//! Where zeros of event functions are on the dense output: those of functions that no interpolant resolves
//! between its nodes, and others from near by.

use super::detector::{EventDetector, EventMemory, SAME};
use super::search::{HALVINGS, MANY_TURNS, NO_VALUE, Passage, StepPart, resolved};
use crate::dynamics::{Motion, Time};
use crate::run::halvings::turns;
use crate::run::observer::Inside;
use crate::stepping::search::sign;

/// Steps of the secant method at most.
const ROUNDS: usize = 6;
/// Share of a step over which the slope of an event function is taken, and which corrections of its zero
/// keep to.
const SLOPE: f64 = 1e-3;
/// What a function may be beside a change of its sign over its values near by: more is a pole.
const POLE: f64 = 1e3;

impl EventDetector {
    /// Passages of a function between the nodes, the first of which is left out where what it shows
    /// `is_behind`. Values that its interpolant may be off by tell no side.
    pub(super) fn between(
        &mut self,
        inside: &mut dyn Inside,
        part: &StepPart,
        (event, is_behind): (usize, bool),
        all: &mut Vec<Passage>,
    ) {
        let most = part.most();
        let off = resolved(self.tolerance).max(NO_VALUE) * most;
        let (mut side, mut before) = (self.memory.sides[event], 0.0);
        let nodes = part.places.iter().zip(part.values).rev().skip(usize::from(is_behind));
        for (&node, &value) in nodes {
            if !value.is_finite() {
                side = 0;
                continue;
            }
            if value.abs() <= off {
                continue;
            }
            let rises = value > 0.0;
            if side != 0 && rises != (side > 0) {
                let [from, to] = self.bisected(inside, part, event, [before, node], rises);
                let ends = [from, to].map(|share| self.value_at(inside, part, event, share).abs());
                let is_pole = !ends.iter().all(|end| *end <= POLE * most);
                let jumps = ends[0].min(ends[1]) > off;
                if !is_pole {
                    let passage = part.passage(part.begin + to * part.span, event, rises);
                    all.push(Passage { jumps, ..passage });
                }
            }
            (side, before) = (sign(value), node);
        }
        self.memory.sides[event] = side;
    }

    /// The value of a function at a share of a part.
    pub(super) fn value_at(&self, inside: &mut dyn Inside, part: &StepPart, event: usize, share: f64) -> f64 {
        self.values(inside.at(part.begin + share * part.span))[event]
    }

    /// Shares of a part, next to one another, between which a function that `rises` or falls from one to the
    /// other passes zero.
    pub(super) fn bisected(
        &self,
        inside: &mut dyn Inside,
        part: &StepPart,
        event: usize,
        [mut from, mut to]: [f64; 2],
        rises: bool,
    ) -> [f64; 2] {
        loop {
            let middle = 0.5 * (from + to);
            let is_instant = (to - from) * part.span <= f64::EPSILON * part.begin.hi.abs();
            if middle <= from || middle >= to || is_instant {
                return [from, to];
            }
            if (self.value_at(inside, part, event, middle) > 0.0) == rises {
                to = middle
            } else {
                from = middle
            }
        }
    }

    /// True where a function that is not kept at zero is within this share of its largest value from it.
    pub fn is_beside_zero(&self, motion: &Motion, share: f64) -> bool {
        let EventMemory { largest, still, .. } = &self.memory;
        let values = self.values(motion);
        let mut values = values.iter().zip(largest).enumerate();
        values.any(|(event, (value, largest))| value.abs() <= share * largest && !still.contains(&event))
    }

    /// The length of a step of which small shares are straight \[s\]: of a step with many turns as long as so
    /// many take, and no more than so many `part`s in which functions do not oscillate often.
    fn straight(&self, inside: &mut dyn Inside, part: f64) -> f64 {
        let (begin, end) = inside.span();
        let span = (end - begin).hi;
        let turning =
            span / (turns(inside, self.mechanism.bodies.len(), (begin, span)) / MANY_TURNS).max(1.0);
        turning.min(libm::ldexp(part, HALVINGS as i32))
    }

    /// Where a passage near `near` is on the dense output, between the ends of the step.
    pub(super) fn polished(&self, inside: &mut dyn Inside, passage: &Passage) -> Time {
        let &Passage { event, t: near, part, .. } = passage;
        let (begin, end) = inside.span();
        let span = self.straight(inside, part);
        let mut at = |t: Time| self.values(inside.at(t))[event];
        let shift = SAME * span;
        let (mut before, mut t) =
            (if (near - begin).hi > shift { near + -shift } else { near + shift }, near);
        let (mut value_before, mut value) = (at(before), at(t));
        for _ in 0..ROUNDS {
            let change = value * (t - before).hi / (value - value_before);
            if value == 0.0 || !change.is_finite() || change.abs() > SLOPE * span {
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
        let t = self.landed(inside, (event, part), t);
        // A function of the clock is zero as long as the time has one double: that very moment is the same by
        // every method.
        let moment = Time::from(t.hi);
        let is_of_clock = (begin..=end).contains(&moment)
            && [t, moment].iter().all(|&t| self.values(inside.at(t))[event] == 0.0);
        if is_of_clock { moment } else { t }
    }

    /// The same of a method whose dense output is less accurate than its steps: by steps that end there, with
    /// the slope of the dense output.
    fn landed(&self, inside: &mut dyn Inside, (event, part): (usize, f64), mut t: Time) -> Time {
        let (begin, end) = inside.span();
        let span = self.straight(inside, part);
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
