//! Outputs that no interpolant resolves, at corners or everywhere.
//!
//! A corner is in one short part of a step, and the parts beside it are resolved.  Where many such parts come
//! one after the other an output is irregular: what is left of forces near singular positions is noise, of
//! which halves have as much as the whole.  Such an output asks for no more halves until it is resolved
//! again, and of its extremes and means no more is known than its values at the nodes.

use super::super::halvings::turns;
use super::super::observer::Inside;
use super::{ExtremesDetector, Found, HALVINGS, ROUNDS};
use crate::dynamics::Time;
use crate::stepping::search::golden_sections;
use std::convert::Infallible;

/// Short parts, one after the other, from which on what no interpolant resolves is irregular.
const IRREGULAR: u8 = 4;
/// Turns in a part up to which it is short: of several corners in each turn few are in parts side by side.
const SHORT: f64 = 0.1;

impl ExtremesDetector {
    /// Begins a step, or a part of it: what was irregular before it is so again from the first short part on.
    pub(super) fn begin_part(&mut self) {
        self.memory.unresolved.resize(self.memory.found.len(), 0);
        for number in &mut self.memory.unresolved {
            *number = (*number).min(IRREGULAR - 1);
        }
    }

    /// True where all of these outputs are irregular, or were so in the part before.
    pub(super) fn were_irregular(&self, is_open: &[bool]) -> bool {
        let mut numbers = self.memory.unresolved.iter().zip(is_open).filter(|(_, is_open)| **is_open);
        numbers.all(|(&number, _)| number + 1 >= IRREGULAR)
    }

    /// True where an output is irregular.
    pub(super) fn is_irregular(&self, k: usize) -> bool {
        self.memory.unresolved.get(k).is_some_and(|&number| number >= IRREGULAR)
    }

    /// Counts a part that comes of so many halvings, in which these outputs are not resolved.
    pub(super) fn count_unresolved(
        &mut self,
        inside: &mut dyn Inside,
        part: (Time, f64),
        depth: u32,
        is_open: &[bool],
    ) {
        let is_short = depth == HALVINGS
            && is_open.contains(&true)
            && turns(inside, self.mechanism.bodies.len(), part) < SHORT;
        for (number, &is_open) in self.memory.unresolved.iter_mut().zip(is_open) {
            *number = match (is_open, depth) {
                (true, _) => (*number + u8::from(is_short)).min(IRREGULAR),
                // Between two singular positions a whole step may be resolved.
                (false, 0) => number.saturating_sub(1),
                (false, _) => 0,
            };
        }
    }

    /// Looks for the extremes of an output next to its least and its largest value at nodes, by golden
    /// sections of the output itself: beside a corner the interpolant does not tell where they are.
    pub(super) fn look_beside_nodes(
        &mut self,
        inside: &mut dyn Inside,
        (begin, span): (Time, f64),
        k: usize,
        (values, places): (&[f64], &[f64]),
    ) {
        for sign in [1.0, -1.0] {
            let signed = |i: usize| sign * values[i];
            let Some(least) = (0..values.len()).min_by(|&a, &b| signed(a).total_cmp(&signed(b))) else {
                return;
            };
            let beside = [(least + 1).min(values.len() - 1), least.saturating_sub(1)];
            let rise = beside.iter().fold(0.0, |rise: f64, &i| rise.max(signed(i) - signed(least)));
            let Found { min: [min, _], max: [max, _], .. } = self.memory.found[k];
            if signed(least) - rise >= if sign > 0.0 { min } else { -max } {
                continue;
            }
            let mut row = Vec::new();
            let at = |share: f64| {
                let t = begin + share * span;
                row.clear();
                self.values(inside.at(t), &mut row);
                self.memory.found[k].see(row[k], t.hi);
                Ok::<f64, Infallible>(sign * row[k])
            };
            // Nodes go from 1 to 0.
            let Ok(()) = golden_sections(at, beside.map(|i| places[i]), ROUNDS);
        }
    }
}
