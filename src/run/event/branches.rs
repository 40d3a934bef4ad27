//! The branches of laws where an event changes the run.

use super::detector::EventDetector;
use super::search::NO_VALUE;
use crate::dynamics::Motion;
use crate::dynamics::compile::Laws;

impl EventDetector {
    /// Magnitudes that the conditions of laws have had.
    fn magnitudes(&self) -> impl Iterator<Item = f64> {
        self.memory.largest.iter().skip(self.before_conditions()).copied()
    }

    /// Which conditions are at their zeros, to rounding, before and after the motion changes and parameters
    /// are set.
    pub fn conditions_at_zero(&self, [before, after]: [&Motion; 2], set: &[f64]) -> Vec<bool> {
        let Some(Laws { formulas, parameters, modes }) = &self.laws else { return Vec::new() };
        let values = |motion: &Motion, parameters: &[f64]| {
            self.mechanism.seen(motion, |at| formulas.condition_values(at, parameters, modes))
        };
        let values = values(before, parameters).into_iter().zip(values(after, set));
        values
            .zip(self.magnitudes())
            .map(|((a, b), largest)| a.abs().max(b.abs()) <= NO_VALUE * largest)
            .collect()
    }

    /// Takes a condition to its other branch, and with it those that jump across zero there, as that of
    /// `abs(if(x < 0, y, -1))` does with x.
    pub fn flip(&self, condition: usize, motion: &Motion, modes: &mut [bool]) {
        let Some(Laws { formulas, parameters, .. }) = &self.laws else { return };
        let values = |modes: &[bool]| {
            self.mechanism.seen(motion, |at| formulas.condition_values(at, parameters, modes))
        };
        let mut before = values(modes);
        let mut next: Vec<usize> = vec![condition];
        // Each changes once.
        let mut changed = vec![false; modes.len()];
        while !next.is_empty() {
            for &condition in &next {
                (modes[condition], changed[condition]) = (!modes[condition], true);
            }
            let after = values(modes);
            let is_carried = |(number, magnitude): (usize, f64)| {
                let (from, to) = (before[number], after[number]);
                let is_clear = from.abs().min(to.abs()) > NO_VALUE * magnitude;
                let jumps = is_clear && (from > 0.0) == modes[number] && (to > 0.0) != modes[number];
                (jumps && !changed[number]).then_some(number)
            };
            next = self.magnitudes().take(modes.len()).enumerate().filter_map(is_carried).collect();
            before = after;
        }
    }
}
