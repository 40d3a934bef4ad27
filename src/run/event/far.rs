//! Steps in which no event function comes near zero: known from a motion of lower order inside them, of
//! methods that make a shorter step for every time that is looked at.

use super::detector::{EventDetector, Owner};
use super::search::CERTAIN;
use crate::dynamics::Time;
use crate::run::observer::Inside;
use crate::stepping::search::{Curve, interpolated};

/// Degree of the interpolants.
const DEGREE: usize = 8;
/// What a function may vary by in the step, over the least magnitude it can have: a motion of lower order is
/// off by far less than it moves.
const VARIES: f64 = 0.1;

impl EventDetector {
    /// True where all functions stay on their sides far from zero throughout a step.
    pub(super) fn is_far(&mut self, inside: &mut dyn Inside, (begin, span): (Time, f64)) -> bool {
        let memory = &self.memory;
        let lists = [&memory.still, &memory.woken, &memory.resting];
        let is_waiting = !lists.iter().all(|list| list.is_empty()) || !memory.due.is_empty();
        if is_waiting || memory.leaving.is_some() || self.friction.is_some() || memory.sides.contains(&0) {
            return false;
        }
        if inside.coarsely_at(begin + 0.5 * span).is_none() {
            return false;
        }
        let at = |share: f64, row: &mut Vec<f64>| {
            if let Some(motion) = inside.coarsely_at(begin + share * span) {
                self.append_values(motion, row);
            }
        };
        let curves = interpolated(&[DEGREE], at, |_, _, _| true).curves;
        let is_there = |event: usize, is_positive: bool| match self.owner(event) {
            Owner::Condition(laws, number) => laws.modes[number] == is_positive,
            _ => self.memory.sides[event] == if is_positive { 1 } else { -1 },
        };
        let mut all = curves.iter().enumerate();
        let are_far = curves.len() == self.memory.sides.len()
            && all.all(|(event, curve)| {
                let is_far = curve.spread() <= VARIES * curve.least();
                is_far && curve.tail() <= CERTAIN * curve.least() && is_there(event, curve.at(0.0)[0] > 0.0)
            });
        if are_far {
            for (largest, curve) in self.memory.largest.iter_mut().zip(&curves) {
                *largest = largest.max(curve.most());
            }
        }
        are_far
    }
}
