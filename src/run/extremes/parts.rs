//! Parts of a step between the corners and jumps of the outputs.
//!
//! A formula with `if`, `min`, `max`, `abs`, `sign` or a table is smooth as long as none of its conditions
//! changes sign.  The conditions are evaluated on the branches that hold where a part begins, interpolated as
//! outputs are, and the first of their zeros ends the part; within it the outputs are evaluated on these
//! branches up to both ends.

use super::super::inside::Inside;
use super::super::magnitude::changes;
use super::{DEGREES, ExtremesDetector, RESOLVED, ROUNDING};
use crate::dynamics::{Motion, Time};
use crate::stepping::search::{Chebyshev, Curve, Interpolants, interpolated, root};
use std::sync::Arc;

/// Parts of a step looked at; what is left then is looked at with the branches that hold at each place.
const PARTS: usize = 1000;
/// Share of a step after its beginning, or a change, at which the branches of a part are taken.
const LATER: f64 = 1e-6;
/// What the last coefficients of an interpolant may be over the least magnitude it can have: it has no zero.
const CERTAIN: f64 = 1e-3;
/// What a condition must be over what its interpolant may be off by for its sign to be known, and the share
/// of a part within which that is looked for where it begins near zero.
const CLEAR: f64 = 10.0;
const SOON: f64 = 1e-2;
/// Halvings of a part in which no interpolant resolves a condition, and of the bracket of its zero.
const HALVINGS: u32 = 6;
const ROUNDS: usize = 48;

impl ExtremesDetector {
    /// How many conditions choose the branches of the formulas.
    pub(super) fn condition_count(&self) -> usize {
        self.mechanism.outputs.as_ref().map_or(0, |outputs| outputs.condition_count())
    }

    /// Looks at a step, or a part of it.
    pub(super) fn look_at(&mut self, inside: &mut dyn Inside, begin: Time, span: f64) {
        if span > 0.0 && !self.passes(inside, begin, span) {
            self.look(inside, begin, span, 0);
        }
    }

    /// Looks at a step, part by part.
    pub(super) fn look_at_parts(&mut self, inside: &mut dyn Inside, begin: Time, span: f64) {
        let mut from = if span > 0.0 { 0.0 } else { 1.0 };
        for _ in 0..PARTS {
            if from >= 1.0 {
                break;
            }
            let first = f64::min(from + LATER, 1.0);
            self.take_branches(inside.at(begin + first * span));
            if self.memory.still.is_empty() {
                self.memory.still = self.rounding_of_conditions(inside.at(begin));
            }
            let to = self.change(inside, (begin, span), first).unwrap_or(1.0);
            self.look_at(inside, begin + from * span, (to - from) * span);
            from = to;
        }
        self.branches.clear();
        self.look_at(inside, begin + from * span, (1.0 - from) * span);
    }

    /// Takes the branches that hold at a motion.
    fn take_branches(&mut self, motion: &Motion) {
        self.branches =
            self.with_outputs(motion, |outputs, moment, scratch| outputs.branches(moment, scratch));
    }

    /// The outputs at the end and at the beginning of a part, where it is on given branches, on those that
    /// hold there.
    pub(super) fn true_ends(
        &mut self,
        inside: &mut dyn Inside,
        begin: Time,
        span: f64,
    ) -> Option<[Vec<f64>; 2]> {
        let branches = Some(std::mem::take(&mut self.branches)).filter(|branches| !branches.is_empty())?;
        let ends = [begin + span, begin].map(|time| self.values_at(inside.at(time)));
        self.branches = branches;
        Some(ends)
    }

    fn conditions(&mut self, motion: &Motion) -> Vec<f64> {
        let branches = std::mem::take(&mut self.branches);
        let found = self
            .with_outputs(motion, |outputs, moment, scratch| outputs.conditions(moment, scratch, &branches));
        self.branches = branches;
        found
    }

    /// Magnitudes of the conditions that are rounding.
    fn rounding_of_conditions(&mut self, motion: &Motion) -> Vec<f64> {
        let changes = changes(&Arc::clone(&self.mechanism), motion, |motion| self.conditions(motion));
        changes.into_iter().map(|x| if x.is_finite() { ROUNDING * x } else { 0.0 }).collect()
    }

    /// The share of a step, from `first` on, at which a condition changes sign first.
    fn change(&mut self, inside: &mut dyn Inside, (begin, span): (Time, f64), first: f64) -> Option<f64> {
        let mut parts = vec![(first, 1.0, 0)];
        while let Some((low, high, depth)) = parts.pop() {
            let place = |share: f64| low + share * (high - low);
            let still = self.memory.still.clone();
            let mut at = |share: f64| self.conditions(inside.at(begin + place(share) * span));
            let is_known = |k: usize, curve: &Chebyshev| {
                let (off, most) = (curve.tail(), curve.most());
                off <= (RESOLVED * most).max(still[k]) || off <= CERTAIN * curve.least() || !most.is_finite()
            };
            let Interpolants { curves, nodes, values, is_resolved } =
                interpolated(&DEGREES, |share, row| row.extend(at(share)), |k, curve, _| is_known(k, curve));
            if !is_resolved && depth < HALVINGS {
                let middle = 0.5 * (low + high);
                parts.extend([(middle, high, depth + 1), (low, middle, depth + 1)]);
                continue;
            }
            let mut earliest: Option<f64> = None;
            for (k, curve) in curves.iter().enumerate() {
                let most = curve.most();
                if !most.is_finite() || most <= still[k] {
                    continue;
                }
                let sign = if self.branches[k] { 1.0 } else { -1.0 };
                let mut at = |share: f64| self.conditions(inside.at(begin + place(share) * span))[k];
                let found = match is_known(k, curve) {
                    true => passage(curve, sign).map(|share| polished(curve, share, at(share))),
                    false => between(&mut |share| sign * at(share), &values[k], &nodes.places, sign),
                };
                earliest = earliest.into_iter().chain(found).reduce(f64::min);
            }
            if let Some(share) = earliest {
                return Some(place(share));
            }
        }
        None
    }
}

/// Where a curve that times `sign` is positive, or zero, becomes negative.
fn passage(curve: &Chebyshev, sign: f64) -> Option<f64> {
    let off = CLEAR * curve.tail().max(4.0 * f64::EPSILON * curve.most());
    let ahead = std::iter::successors(Some(0.0), |&at| Some(if at == 0.0 { 0.1 * LATER } else { 4.0 * at }));
    let start = ahead.take_while(|&at| at < SOON).find(|&at| curve.at(at)[0].abs() > off).unwrap_or(SOON);
    if sign * curve.at(start)[0] < 0.0 { Some(start) } else { root(curve, 0.0, start, 1.0) }
}

/// The zero next to a place at which the function has this value.
fn polished(curve: &Chebyshev, share: f64, value: f64) -> f64 {
    let moved = share - value / curve.at(share)[1];
    if (moved - share).abs() < LATER { moved.clamp(0.0, 1.0) } else { share }
}

/// The same between nodes, from the last to the first, by bisection of the function times `sign` itself.
fn between(at: &mut dyn FnMut(f64) -> f64, values: &[f64], places: &[f64], sign: f64) -> Option<f64> {
    let after = (0..values.len()).rev().find(|&i| sign * values[i] < 0.0)?;
    let Some(&before) = places.get(after + 1) else { return Some(places[after]) };
    let (mut low, mut high) = (before, places[after]);
    for _ in 0..ROUNDS {
        let middle = 0.5 * (low + high);
        if at(middle) < 0.0 { high = middle } else { low = middle }
    }
    Some(high)
}
