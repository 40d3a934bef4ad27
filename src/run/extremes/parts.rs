//! Parts of a step between the corners and jumps of the outputs.
//!
//! A formula with `if`, `min`, `max`, `abs`, `sign` or a table is smooth as long as none of its conditions
//! changes sign, and quotients, roots and logarithms between the zeros of what they are taken of, which are
//! conditions as well.  The conditions are evaluated on the branches that hold where a part begins,
//! interpolated as outputs are, and the first of their zeros ends the part; within it the outputs are
//! evaluated on these branches up to both ends.

use super::super::halvings::turns;
use super::super::observer::Inside;
use super::super::rounding::{changes, last_digits};
use super::{DEGREES, DOUBTS, ExtremesDetector, MARGIN, RESOLVED, has_grown, rounding_of};
use crate::dynamics::{Motion, Time};
use crate::stepping::search::{Chebyshev, Curve, Interpolants, interpolated, root};
use std::sync::Arc;

/// Parts of a step looked at, in each turn of it where that is more, and changes in it of conditions that no
/// interpolant resolves; what is left then is looked at with the branches that hold at each place.
const PARTS: usize = 10_000;
const IN_A_TURN: usize = 64;
const UNRESOLVED: usize = 32;
/// Share of a step, or of as much of it as so many turns take, after its beginning, or a change, at which the
/// branches of a part are taken.
const LATER: f64 = 1e-6;
const TURNS: f64 = 16.0;
/// Shares of a part by which its ends are moved inwards, until all outputs are finite there: beyond a change
/// a root may have no value.
const INWARDS: [f64; 7] = [0.0, 1e-15, 1e-13, 1e-11, 1e-9, 1e-7, 1e-5];
/// Shares of a part next to its ends between which outputs change as they do up to these: by no more than so
/// many times as much, where they do not jump.
const NEXT: [f64; 2] = [1e-7, 1e-4];
const STEEPER: f64 = 8.0;
/// What the last coefficients of an interpolant may be over the least magnitude it can have: it has no zero.
const CERTAIN: f64 = 1e-3;
/// What a condition must be over what its interpolant may be off by for its sign to be known, and the share
/// of a part within which that is looked for where it begins near zero.
const CLEAR: f64 = 10.0;
const SOON: f64 = 1e-2;
/// Halvings of a part in which no interpolant resolves a condition, and of the bracket of its zero.
const HALVINGS: u32 = 10;
const ROUNDS: usize = 48;
/// Changes that are looked for before one beyond which conditions have no value, and the share by which the
/// search ends before it; shorter parts are rounding.
const BEFORE: usize = 8;
const SHORT: f64 = 1e-9;

/// A step, and what of it is still to be searched: shares from and to, and halvings, the next one last.
struct PendingStep {
    begin: Time,
    span: f64,
    parts: Vec<(f64, f64, u32)>,
    /// The share at which the branches of the present part are taken, and the conditions that are zero in it.
    first: f64,
    zeros: Vec<bool>,
    /// Changes left of conditions that no interpolant resolves.
    unresolved: usize,
}

impl PendingStep {
    fn time(&self, share: f64) -> Time {
        self.begin + share * self.span
    }
}

/// What a part of a step has.
enum PartZeros {
    /// Conditions that ask for halves.
    TooMuch,
    /// Conditions that were taken for positive, and are zero.
    Still,
    /// The first change, if there is any; true where conditions have no values somewhere.
    Change(Option<f64>, bool),
}

impl ExtremesDetector {
    /// How many conditions choose the branches of the formulas.
    pub(super) fn condition_count(&self) -> usize {
        self.mechanism.outputs.as_ref().map_or(0, |outputs| outputs.condition_count())
    }

    /// Looks at a step, or a part of it.
    pub(super) fn look_at(&mut self, inside: &mut dyn Inside, begin: Time, span: f64) {
        if span > 0.0 && !self.passes(inside, begin, span) {
            self.begin_part();
            self.look(inside, begin, span, 0);
        }
    }

    /// Looks at a step, part by part.
    pub(super) fn look_at_parts(&mut self, inside: &mut dyn Inside, begin: Time, span: f64) {
        let (parts, zeros) = (vec![(0.0, 1.0, 0)], vec![false; self.condition_count()]);
        let mut ahead = PendingStep { begin, span, parts, first: 0.0, zeros, unresolved: UNRESOLVED };
        let mut from = if span > 0.0 { 0.0 } else { 1.0 };
        let turns = turns(inside, self.mechanism.bodies.len(), (begin, span));
        let later = LATER / (turns / TURNS).max(1.0);
        for _ in 0..PARTS.max(IN_A_TURN.saturating_mul(turns as usize)) {
            if from >= 1.0 || ahead.unresolved == 0 {
                break;
            }
            ahead.first = f64::min(from + later, 1.0);
            ahead.zeros.fill(false);
            self.take_branches(inside, &ahead);
            if self.memory.still.is_empty() {
                self.memory.still = self.rounding_of_conditions(inside.at(begin));
            }
            let to = self.change(inside, &mut ahead);
            self.look_at_part(inside, &ahead, [from, to]);
            from = to;
        }
        self.branches.clear();
        self.look_at(inside, ahead.time(from), (1.0 - from) * span);
    }

    /// Takes the branches of the present part.
    fn take_branches(&mut self, inside: &mut dyn Inside, ahead: &PendingStep) {
        let motion = inside.at(ahead.time(ahead.first));
        self.branches = self
            .with_outputs(motion, |outputs, moment, scratch| outputs.branches(moment, scratch, &ahead.zeros));
    }

    /// Looks at a part, up to as near its ends as all outputs are finite.
    fn look_at_part(&mut self, inside: &mut dyn Inside, ahead: &PendingStep, [from, to]: [f64; 2]) {
        let (begin, span) = (ahead.time(from), (to - from) * ahead.span);
        // What rounding has led beyond the end of a root at an impact is no part of its own.
        let is_known = |values: Vec<f64>| values.into_iter().all(f64::is_finite);
        if to - from <= SHORT && !is_known(self.values_at(inside.at(begin + 0.5 * span))) {
            return;
        }
        let [first, last] = self.inwards(inside, begin, span).unwrap_or_default();
        let before = self.memory.found.clone();
        self.look_at(inside, begin + first * span, span - (first + last) * span);
        self.look_at_poles(inside, (begin, span), &before);
    }

    /// By which shares of a span its beginning and its end are to be moved inwards, until as many outputs are
    /// finite there as in the middle; `None` where no share is enough.
    fn inwards(&mut self, inside: &mut dyn Inside, begin: Time, span: f64) -> Option<[f64; 2]> {
        let mut finite = |after: f64| {
            let values = self.values_at(inside.at(begin + after));
            values.iter().filter(|value| value.is_finite()).count()
        };
        let most = finite(0.5 * span);
        let first = INWARDS.into_iter().find(|by| finite(by * span) >= most)?;
        let last = INWARDS.into_iter().find(|by| finite(span - by * span) >= most)?;
        Some([first, last])
    }

    /// The same until no output jumps between its ends and what is next to them, on the branches given:
    /// where both arguments of `atan2` are zero, rounding leads beyond that to angles that are half a turn
    /// or more off.
    fn inwards_of_jumps(&mut self, inside: &mut dyn Inside, begin: Time, span: f64) -> Option<[f64; 2]> {
        let mut of_end = |is_last: bool| {
            let mut at = |by: f64| {
                let share = if is_last { 1.0 - by } else { by };
                self.values_at(inside.at(begin + share * span))
            };
            let [next, later] = NEXT.map(&mut at);
            let mut leads_on = |by: f64| {
                at(by).iter().zip(next.iter().zip(&later)).all(|(end, (next, later))| {
                    let most = STEEPER * (later - next).abs() + MARGIN * end.abs().max(next.abs());
                    (end - next).abs() <= most || !(end - next).is_finite()
                })
            };
            INWARDS.into_iter().find(|&by| leads_on(by))
        };
        Some([of_end(false)?, of_end(true)?])
    }

    /// Looks at a step of outputs that have no value at its ends and do inside, as a root at an impact may,
    /// or at a part that no interpolant resolves as they jump there; false where they are not such.
    pub(super) fn look_inwards(
        &mut self,
        inside: &mut dyn Inside,
        (begin, span): (Time, f64),
        values: &[Vec<f64>],
        is_resolved: bool,
    ) -> bool {
        let is_blind = |values: &Vec<f64>| {
            let [first, .., last] = &values[..] else { return false };
            !(first + last).is_finite() && values[values.len() / 2].is_finite()
        };
        let by = match self.branches.is_empty() {
            true if values.iter().any(is_blind) => self.inwards(inside, begin, span),
            false if !is_resolved => self.inwards_of_jumps(inside, begin, span),
            _ => None,
        };
        let Some([first, last]) = by.filter(|by| *by != [0.0; 2]) else { return false };
        self.look(inside, begin + first * span, span - (first + last) * span, 1);
        true
    }

    /// The outputs at the end and at the beginning of a part, where it is on given branches, on those that
    /// hold there.
    pub(super) fn true_ends(
        &mut self,
        inside: &mut dyn Inside,
        begin: Time,
        span: f64,
    ) -> Option<[Vec<f64>; 2]> {
        let is_given = !self.branches.is_empty();
        is_given.then(|| [begin + span, begin].map(|time| self.true_values(inside.at(time))))
    }

    /// The outputs at a motion on the branches that hold there.
    fn true_values(&mut self, motion: &Motion) -> Vec<f64> {
        let branches = std::mem::take(&mut self.branches);
        let values = self.values_at(motion);
        self.branches = branches;
        values
    }

    /// Appends the outputs at a motion; on the branches that hold there where they have no value on those
    /// given, beyond which rounding has led: roots of what is nothing but rounding.
    pub(super) fn known(&mut self, motion: &Motion, values: &mut Vec<f64>) {
        let begin = values.len();
        self.values(motion, values);
        if !self.branches.is_empty() && values[begin..].iter().any(|value| !value.is_finite()) {
            let pairs = values[begin..].iter_mut().zip(self.true_values(motion));
            pairs.filter(|(value, _)| !value.is_finite()).for_each(|(value, here)| *value = here);
        }
    }

    /// Looks for what is rounding where no interpolant resolves the outputs; true where there is much more
    /// than was known.
    pub(super) fn has_more_rounding(&mut self, inside: &mut dyn Inside, t: Time) -> bool {
        let at = |motion: &Motion| {
            let mut values = Vec::new();
            self.known(motion, &mut values);
            values
        };
        let found = last_digits(inside.at(t), at);
        has_grown(&mut self.memory.rounding, &found)
    }

    pub(super) fn conditions(&mut self, motion: &Motion) -> Vec<f64> {
        let branches = std::mem::take(&mut self.branches);
        let found = self
            .with_outputs(motion, |outputs, moment, scratch| outputs.conditions(moment, scratch, &branches));
        self.branches = branches;
        found
    }

    /// Magnitudes of the conditions that are rounding.
    fn rounding_of_conditions(&mut self, motion: &Motion) -> Vec<f64> {
        rounding_of(&changes(&Arc::clone(&self.mechanism), motion, |motion| self.conditions(motion)))
    }

    /// Looks for what is rounding where no interpolant resolves the conditions; true where there is much more
    /// than was known.
    fn have_more_rounding(&mut self, motion: &Motion) -> bool {
        let found = last_digits(motion, |motion| self.conditions(motion));
        has_grown(&mut self.memory.still, &found)
    }

    /// The share of a step, in the present part, at which a condition changes sign first; 1 where none does.
    fn change(&mut self, inside: &mut dyn Inside, ahead: &mut PendingStep) -> f64 {
        while let Some((low, high, depth)) = ahead.parts.pop() {
            let low = low.max(ahead.first);
            if low >= high {
                continue;
            }
            match self.search(inside, ahead, [low, high], depth) {
                PartZeros::TooMuch => {
                    let middle = 0.5 * (low + high);
                    ahead.parts.extend([(middle, high, depth + 1), (low, middle, depth + 1)]);
                }
                PartZeros::Still => ahead.parts.push((low, high, depth)),
                PartZeros::Change(None, _) => {}
                PartZeros::Change(Some(mut share), mut is_blind) => {
                    for _ in 0..BEFORE {
                        let end = low + (share - low) * (1.0 - SHORT);
                        if !is_blind || end <= low {
                            break;
                        }
                        match self.search(inside, ahead, [low, end], HALVINGS) {
                            PartZeros::Change(Some(earlier), blind) => (share, is_blind) = (earlier, blind),
                            _ => break,
                        }
                    }
                    ahead.parts.push((share, high, depth));
                    return share;
                }
            }
        }
        1.0
    }

    /// Looks for the first change in a part.
    fn search(
        &mut self,
        inside: &mut dyn Inside,
        ahead: &mut PendingStep,
        [low, high]: [f64; 2],
        depth: u32,
    ) -> PartZeros {
        let place = |share: f64| low + share * (high - low);
        let still = self.memory.still.clone();
        let is_known = |k: usize, curve: &Chebyshev| {
            let (off, most) = (curve.tail(), curve.most());
            off <= (RESOLVED * most).max(still[k]) || off <= CERTAIN * curve.least() || !most.is_finite()
        };
        let mut at = |share: f64| self.conditions(inside.at(ahead.time(place(share))));
        let Interpolants { curves, nodes, values, is_resolved } =
            interpolated(&DEGREES, |share, row| row.extend(at(share)), |k, curve, _| is_known(k, curve));
        if !is_resolved && depth <= DOUBTS && self.have_more_rounding(inside.at(ahead.time(place(0.5)))) {
            return self.search(inside, ahead, [low, high], depth);
        }
        let (angles, part) = (self.mechanism.bodies.len(), (ahead.time(low), (high - low) * ahead.span));
        if !is_resolved && self.halvings.asks(inside, angles, part, [depth, HALVINGS]) {
            return PartZeros::TooMuch;
        }
        let is_zero = |k: usize| curves[k].most() <= still[k];
        if (0..curves.len()).any(|k| is_zero(k) && self.branches[k]) {
            // What depends on them is to be on the branches of zeros as well.
            (0..curves.len()).filter(|&k| is_zero(k)).for_each(|k| ahead.zeros[k] = true);
            self.take_branches(inside, ahead);
            return PartZeros::Still;
        }
        let (mut earliest, mut is_blind) = (None::<(f64, bool)>, false);
        for (k, curve) in curves.iter().enumerate().filter(|(k, _)| !is_zero(*k)) {
            if !curve.most().is_finite() {
                is_blind = true;
                continue;
            }
            let sign = if self.branches[k] { 1.0 } else { -1.0 };
            let mut at = |share: f64| self.conditions(inside.at(ahead.time(place(share))))[k];
            let known = is_known(k, curve);
            let found = match known {
                true => passage(curve, sign).map(|share| polished(curve, share, at(share))),
                false => between(&mut |share| sign * at(share), &values[k], &nodes.places, sign),
            };
            if let Some(share) = found.filter(|share| earliest.is_none_or(|(known, _)| *share < known)) {
                earliest = Some((share, known));
            }
        }
        if earliest.is_some_and(|(_, known)| !known) {
            ahead.unresolved = ahead.unresolved.saturating_sub(1);
        }
        PartZeros::Change(earliest.map(|(share, _)| place(share)), is_blind)
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
