//! Zeros of a higher order, as those of a cube: a function is so flat about them that its interpolant passes
//! zero as often as rounding, or what it is off by, has it there.  Sides are told by the function itself, and
//! where these differ there is one passage.

use super::detector::{EventDetector, SAME};
use super::search::{CLEAR, Passage, StepPart, clear};
use crate::run::observer::Inside;
use crate::stepping::search::{Curve, ROUNDING, sign};

/// Share of a part within which a function that is no more than what its interpolant may be off by is flat.
const FLAT: f64 = 1e-6;

impl StepPart<'_> {
    /// True where its function is flat about a share of it, at which it is zero.
    pub fn is_flat(&self, share: f64, tolerance: f64) -> bool {
        let least = CLEAR * self.off(tolerance);
        [share - FLAT, share + FLAT].iter().all(|at| self.curve.at(at.clamp(0.0, 1.0))[0].abs() <= least)
    }
}

impl EventDetector {
    /// Puts right the passages of a function from number `first` on, which are those in a part of a step from
    /// a share on, where it comes from this side: about its flat zeros it passes where its own values do.
    pub(super) fn settle(
        &mut self,
        inside: &mut dyn Inside,
        part: &StepPart,
        event: usize,
        (from, came): (f64, i8),
        first: usize,
        all: &mut Vec<Passage>,
    ) {
        let is_flat = |share: f64| part.is_flat(share, self.tolerance);
        let share = |passage: &Passage| (passage.t - part.begin).hi / part.span;
        let begins = is_flat(from).then_some((from, None));
        let found: Vec<(f64, Option<Passage>)> =
            begins.into_iter().chain(all[first..].iter().map(|at| (share(at), Some(at.clone())))).collect();
        if came == 0 || !found.iter().any(|(share, _)| is_flat(*share)) {
            return;
        }
        all.truncate(first);
        let off = part.off(self.tolerance);
        let rounding = CLEAR * ROUNDING * part.curve.most();
        let (mut side, mut known) = (came, from);
        for (number, (share, passage)) in found.iter().enumerate() {
            let until = found.get(number + 1).map_or(1.0, |(next, _)| 0.5 * (share + next));
            if !is_flat(*share) {
                side = passage.as_ref().map_or(side, |passage| if passage.rises { 1 } else { -1 });
                known = (share + SAME).min(until);
                all.extend(passage.clone());
                continue;
            }
            let behind = clear(part.curve, share + SAME, off).unwrap_or(until).min(until);
            let value = self.value_at(inside, part, event, behind);
            if value.abs() <= rounding {
                continue;
            }
            if sign(value) == -side {
                let [_, zero] = self.bisected(inside, part, event, [known, behind], side < 0);
                all.push(part.passage(part.begin + zero * part.span, event, side < 0));
                side = -side;
            }
            known = behind;
        }
        self.memory.sides[event] = side;
    }
}
