//! Zeros of event functions in a step: they are interpolated at Chebyshev points, by as high a degree as they
//! ask for, and searched by the same root finding as walls and flips ([`search`](crate::stepping)); a zero is
//! then polished on the dense output itself.  Of functions that no interpolant resolves, as those with
//! corners and jumps, the changes of sign between the nodes are bisected.

use super::detector::{EventDetector, EventMemory, Owner, SAME};
use crate::dynamics::Time;
use crate::run::friction::FrictionWatch;
use crate::run::halvings::turns;
use crate::run::observer::Inside;
use crate::stepping::search::{
    Chebyshev, Curve, Interpolants, Nodes, ROUNDING, interpolated, oscillates, root, sign,
};

/// Degrees of the interpolants.
const DEGREES: [usize; 3] = [8, 16, 32];
/// What the last coefficients of an interpolant may be over the largest value: so much, or the given share of
/// the relative tolerance, by which the dense output of a step is not smooth itself.
const RESOLVED: f64 = 1e-11;
const SHARE: f64 = 0.1;
/// What the last coefficients of an interpolant may be over the least magnitude it can have: the function has
/// no zero there, whatever its other digits are.
pub(super) const CERTAIN: f64 = 1e-3;
/// Halvings of a step whose event functions no interpolant resolves; of parts with many turns or
/// oscillations there are more, and of those with a place beyond which a function has no value.
pub(super) const HALVINGS: u32 = 4;
const BORDERS: u32 = 20;
/// Turns of a part of a step that is not searched beyond what cuts the step short before it, and of which
/// small shares are straight.
pub(super) const MANY_TURNS: f64 = 8.0;
/// Share of a step in which an event function leaves zero that was kept there by a joint.
const LEAVES: f64 = 1e-5;
/// Share of the largest value, of a condition within the step, of an event so far, up to which a function is
/// at its zero.
pub(super) const NO_VALUE: f64 = 1e-12;
/// What the value of a condition must be over what its interpolant may be off by, for its sign to tell a
/// side, and the part of a step within which that is looked for: at a zero of a higher order it takes a
/// while.
pub(super) const CLEAR: f64 = 10.0;
const SOON: f64 = 1e-2;
/// Share of a step up to which a zero behind its end is at its end.
const NEAR: f64 = 1e-6;
/// How many times later it is looked again where that may take the whole step.
const LATER: f64 = 1.25;
/// Share of a step after which a function has left a corner that began it, and share of its largest value
/// there that tells a side.
const AFTER: f64 = 1e-6;
const BEYOND: f64 = 1e-4;
/// Steps of this share of the time are rounding.
const INSTANT: f64 = 8.0 * f64::EPSILON;

/// A passage of an event function.
#[derive(Clone)]
pub(super) struct Passage {
    pub t: Time,
    /// The length of the part of the step it was found in \[s\].
    pub part: f64,
    pub event: usize,
    pub rises: bool,
    /// True where the function jumps past zero.
    pub jumps: bool,
}

/// A function in a part of a step.
pub(super) struct StepPart<'a> {
    pub begin: Time,
    /// How long it lasts \[s\].
    pub span: f64,
    /// Its interpolant.
    pub curve: &'a Chebyshev,
    /// Its values at the nodes, from the last to the first, and where these are, in shares of the part.
    pub values: &'a [f64],
    pub places: &'a [f64],
    /// True where the interpolant is as good as the function.
    is_resolved: bool,
    /// True where the step ends with it.
    is_last: bool,
}

impl StepPart<'_> {
    /// A passage in it, of a function that does not jump.
    pub fn passage(&self, t: Time, event: usize, rises: bool) -> Passage {
        Passage { t, part: self.span, event, rises, jumps: false }
    }

    /// The largest magnitude the function can have, where it has values.
    pub fn most(&self) -> f64 {
        let most = self.curve.most();
        let finite = self.values.iter().map(|value| value.abs()).filter(|value| value.is_finite());
        if most.is_finite() { most } else { finite.fold(0.0, f64::max) }
    }

    /// What its interpolant may be off by, beside a method of this tolerance.
    pub fn off(&self, tolerance: f64) -> f64 {
        resolved(tolerance).max(NO_VALUE) * self.curve.most()
    }

    /// The values at the first two nodes.
    fn first(&self) -> [f64; 2] {
        [self.values[self.values.len() - 1], self.values[self.values.len() - 2]]
    }
}

/// What the last coefficients of an interpolant may be over its largest value, beside a method of this
/// tolerance.
pub(super) fn resolved(tolerance: f64) -> f64 {
    RESOLVED.max(SHARE * tolerance)
}

/// Shares of a step at which it is looked whether a curve has left its zero, closer at the beginning.
fn ahead() -> impl Iterator<Item = f64> {
    std::iter::successors(Some(0.0), |&step| Some(if step == 0.0 { SAME } else { 4.0 * step }))
}

/// Where a curve has left what it may be `off` by about its zero, from `share` on; `None` where that is not
/// soon.
pub(super) fn clear(curve: &Chebyshev, share: f64, off: f64) -> Option<f64> {
    let is_clear = |at: &f64| *at >= 1.0 || curve.at(*at)[0].abs() > CLEAR * off;
    ahead().take_while(|&step| step < SOON).map(|step| share + step).find(is_clear)
}

/// Where in a step a curve is beyond a magnitude first.
fn beyond(curve: &Chebyshev, least: f64) -> Option<f64> {
    let late = std::iter::successors(Some(SOON), |&share| Some(LATER * share));
    let shares = ahead().take_while(|&share| share < SOON).chain(late.take_while(|&share| share < 1.0));
    shares.chain([1.0]).find(|&share| curve.at(share)[0].abs() > least)
}

/// Where a curve that begins near zero has left it: it may be back before the next node.
fn left(part: &StepPart, tolerance: f64) -> Option<f64> {
    clear(part.curve, 0.0, part.off(tolerance).max(part.first()[0].abs()))
}

impl EventDetector {
    /// Passages in a part of a step, in no order.
    pub(super) fn passages(
        &mut self,
        inside: &mut dyn Inside,
        begin: Time,
        span: f64,
        depth: u32,
        all: &mut Vec<Passage>,
    ) {
        if depth == 0 && self.is_far(inside, (begin, span)) {
            return;
        }
        self.friction.iter().for_each(FrictionWatch::search);
        let at = |share: f64, row: &mut Vec<f64>| self.append_values(inside.at(begin + share * span), row);
        let (resolved, largest) = (resolved(self.tolerance), &self.memory.largest[..self.before_friction()]);
        let is_enough = |event: usize, curve: &Chebyshev| {
            let (off, most) = (curve.tail(), curve.most());
            let stays_at_zero = largest.get(event).is_some_and(|largest| most <= NO_VALUE * largest);
            off <= resolved * most || off <= CERTAIN * curve.least() || stays_at_zero
        };
        let Interpolants { curves, values, nodes: Nodes { places, .. }, .. } =
            interpolated(&DEGREES, at, |event, curve, _| is_enough(event, curve));
        let has_values = |event: usize| {
            let is_of_scene = matches!(self.owner(event), Owner::Scene(..));
            is_of_scene && values[event].iter().any(|value| value.is_finite())
        };
        let is_resolved = |(event, curve): (usize, &Chebyshev)| match curve.most().is_finite() {
            true => is_enough(event, curve),
            false => !has_values(event),
        };
        let are_resolved: Vec<bool> = curves.iter().enumerate().map(is_resolved).collect();
        let (angles, part, first) = (self.mechanism.bodies.len(), (begin, span), self.before_friction());
        let unresolved = || (0..curves.len()).filter(|&event| !are_resolved[event]);
        let oscillate = || {
            let size = |event: usize| {
                let of_parts = self.friction.iter().map(|watch| watch.size(event.wrapping_sub(first)));
                of_parts.fold(self.memory.largest[event].max(curves[event].most()), f64::max)
            };
            unresolved().any(|event| oscillates(&values[event], size(event)))
        };
        let has_border = unresolved().any(|event| !curves[event].most().is_finite());
        let depths = [depth, if has_border { BORDERS } else { HALVINGS }];
        if unresolved().next().is_some()
            && (self.halvings.asks(inside, angles, part, depths) || oscillate() && self.halvings.go_on())
        {
            let (half, middle, before) = (0.5 * span, begin + 0.5 * span, all.len());
            self.passages(inside, begin, half, depth + 1, all);
            if !self.is_cut_before(inside, (middle, half), &all[before..]) {
                self.passages(inside, middle, half, depth + 1, all);
            }
            return;
        }
        let is_last = (inside.span().1 - (begin + span)).hi <= SAME * span;
        for (event, curve) in curves.iter().enumerate() {
            if self.memory.resting.contains(&event) {
                continue;
            }
            if let Owner::Outside(number) = self.owner(event)
                && values[event].iter().any(|value| value.is_nan())
            {
                self.undefined.get_or_insert(number);
                continue;
            }
            let (is_resolved, is_finite) = (are_resolved[event], curve.most().is_finite());
            if is_resolved && !is_finite && matches!(self.owner(event), Owner::Scene(..)) {
                // It has no value here.
                self.memory.sides[event] = 0;
                continue;
            }
            let part = StepPart { begin, span, curve, values: &values[event], places, is_resolved, is_last };
            let mode = match self.owner(event) {
                Owner::Condition(laws, number) => Some(laws.modes[number]),
                Owner::Friction(..) => Some(true),
                _ => None,
            };
            match mode {
                // Within the rounding of time a condition is on both sides.
                Some(_) if span <= INSTANT * begin.hi.abs() => {}
                Some(mode) => self.of_condition(&part, event, mode, all),
                None => self.of_event(inside, &part, event, all),
            }
        }
    }

    /// True for a part of a step with many turns or oscillations before which one of these passages cuts the
    /// step short.
    fn is_cut_before(&self, inside: &mut dyn Inside, part: (Time, f64), all: &[Passage]) -> bool {
        let (begin, end) = inside.span();
        let same = SAME * (end - begin).hi;
        let has_just_happened = |passage: &Passage| {
            let mut last = self.memory.last.iter();
            last.any(|(event, t)| *event == passage.event && (passage.t - *t).hi <= same)
        };
        let cuts = |passage: &Passage| {
            let is_before = (part.0 - passage.t).hi > 2.0 * same;
            is_before && self.counts(passage.event, passage.rises) && self.changes_run(passage.event)
        };
        (self.halvings.are_many() || turns(inside, self.mechanism.bodies.len(), part) > MANY_TURNS)
            && all.iter().any(|passage| cuts(passage) && !has_just_happened(passage))
    }

    /// Passages of a condition that is in this mode.
    fn of_condition(&mut self, part: &StepPart, event: usize, mode: bool, all: &mut Vec<Passage>) {
        let (curve, [first, next], most) = (part.curve, part.first(), part.curve.most());
        let is_of_laws = matches!(self.owner(event), Owner::Condition(..));
        if is_of_laws && most <= NO_VALUE * self.memory.largest[event].max(most) {
            return;
        }
        // It lies on the side its laws are recorded for, and leaves it at once where it turns away.  An
        // impact may have carried it across.
        let other = if mode { -1 } else { 1 };
        let is_there = first.abs() <= NO_VALUE * most || sign(first) == other;
        let mut left = is_there.then(|| left(part, self.tolerance)).flatten();
        // What slides from rest may begin against its sense, by what the method leaves open: with equal
        // coefficients its velocity grows with the square of time.
        if let Owner::Friction(watch, function) = self.owner(event)
            && is_there
            && let off = watch.at_rest(function, self.tolerance)
            && off > 0.0
            && first.abs() <= CLEAR * off
        {
            let least = CLEAR * off.max(first.abs()).max(part.off(self.tolerance));
            left = beyond(curve, least);
            if left.is_none() {
                return;
            }
        }
        if is_there && sign(left.map_or(next, |share| curve.at(share)[0])) == other {
            all.push(part.passage(part.begin, event, !mode));
        }
        let EventMemory { sides, largest, last, .. } = &mut self.memory;
        largest[event] = largest[event].max(most);
        let is_behind = first == 0.0 || last.contains(&(event, part.begin));
        sides[event] = if is_behind { sign(next) } else { sign(first) };
        let off = is_of_laws.then_some(resolved(self.tolerance) * most);
        // Of what begins to slide, whose velocity is zero there, rounding is no passage.
        let from = left.filter(|_| !is_of_laws).unwrap_or(0.0);
        self.zeros(part, event, (from, off), all);
    }

    /// Passages of the function of an event.
    fn of_event(&mut self, inside: &mut dyn Inside, part: &StepPart, event: usize, all: &mut Vec<Passage>) {
        let (begin, [first, next], most) = (part.begin, part.first(), part.most());
        let is_woken = self.memory.woken.contains(&event);
        let is_now = |before: &Time| (begin - *before).hi <= SAME * part.span;
        let is_corner = self.memory.flipped.iter().any(|(_, flip)| is_now(flip));
        // A function that begins the run at a corner has not passed it there.
        let may_begin = self.memory.sides[event] == 0 && !part.is_resolved;
        let beyond =
            (is_corner || may_begin).then(|| self.values(inside.at(begin + AFTER * part.span))[event]);
        let EventMemory { sides, largest, last, due, still, leaving, .. } = &mut self.memory;
        let (side, largest) = (&mut sides[event], &mut largest[event]);
        *largest = largest.max(most);
        // A function that stays at zero, as that of a point at rest on a wall, passes it by rounding alone.
        if most <= NO_VALUE * *largest {
            if !still.contains(&event) {
                still.push(event);
            }
            return;
        }
        let was_still = still.contains(&event);
        still.retain(|other| *other != event);
        let goes_to = leaving.take_if(|(other, _)| *other == event).map(|(_, side)| side);
        let is_at_zero = first.abs() <= NO_VALUE * *largest;
        let came = *side;
        let passes = is_at_zero && came != 0 && sign(next) == -came;
        // What is flat about a zero ahead has not passed it yet.
        let is_ahead = passes
            && !(is_woken || was_still)
            && part.is_resolved
            && sign(first) == came
            && part.is_flat(0.0, self.tolerance);
        if passes && !is_ahead {
            all.push(part.passage(begin, event, came < 0));
        }
        let mut is_behind = due.iter().any(|(due, _)| *due == event)
            || last.iter().any(|(last, before)| *last == event && is_now(before));
        // A corner of a formula it asks for, at which the last step ended, may have carried it across.
        let beyond = beyond.filter(|value| value.abs() > BEYOND * most);
        if let Some(value) = beyond {
            if *side != 0 && sign(value) == -*side && !is_behind {
                all.push(Passage { jumps: true, ..part.passage(begin, event, *side < 0) });
            }
            is_behind = true;
        }
        let begins = is_at_zero && *side == 0;
        *side = if is_at_zero || last.contains(&(event, begin)) { sign(next) } else { sign(first) };
        if !part.is_resolved {
            if is_behind {
                *side = sign(beyond.unwrap_or(next));
            }
            return self.between(inside, part, (event, is_behind), all);
        }
        // What leaves the zero it begins at, or was kept at, is not sent back by rounding.
        let leaves = is_woken || begins || was_still && is_at_zero;
        let from = if leaves { left(part, self.tolerance).unwrap_or(0.0).max(LEAVES) } else { 0.0 };
        if leaves {
            *side = sign(part.curve.at(from)[0]);
        }
        let before = all.len();
        let came = if is_ahead { came } else { *side };
        self.zeros(part, event, (from, None), all);
        self.settle(inside, part, event, (from, came), before, all);
        // Where rounding has it on the other side of the zero it leaves.
        if goes_to.is_some_and(|side| all.get(before).is_some_and(|first| first.rises == (side > 0))) {
            all.remove(before);
        }
        if let Some(goes_to) = goes_to.filter(|goes_to| sign(next) == -goes_to) {
            self.returning = Some((event, goes_to));
        }
        if part.is_last {
            self.end_at_zero(part, event, inside.span().1, all);
        }
    }

    /// The passage of a function that comes to zero where the step ends, as the height of a point does on its
    /// wall: on which side rounding has it there does not matter.
    fn end_at_zero(&mut self, part: &StepPart, event: usize, end: Time, all: &mut Vec<Passage>) {
        let ([value, slope], side) = (part.curve.at(1.0), &mut self.memory.sides[event]);
        let off = part.off(self.tolerance);
        let is_near = value.abs() <= off.min(NEAR * slope.abs());
        if *side != 0 && is_near && sign(slope) == -*side {
            all.push(part.passage(end, event, *side < 0));
            *side = -*side;
        }
    }

    /// Zeros of an interpolant from a share of the part on; where it is `off` by so much about them, by
    /// rounding at least, the side behind one is told where it has left that.
    fn zeros(
        &mut self,
        part: &StepPart,
        event: usize,
        (mut share, off): (f64, Option<f64>),
        all: &mut Vec<Passage>,
    ) {
        let side = &mut self.memory.sides[event];
        while let Some(zero) = root(part.curve, 0.0, share, 1.0) {
            let next = zero + SAME;
            if next >= 1.0 && !part.is_last {
                // The part that follows tells.
                break;
            }
            share = match off {
                Some(off) => clear(part.curve, next, off).unwrap_or(next),
                None => clear(part.curve, next, ROUNDING * part.curve.most()).unwrap_or(next + SOON),
            };
            let after = sign(part.curve.at(share.min(1.0))[0]);
            // At the very end of a step what follows is not known: it is on the other side.
            *side = if after == 0 || share >= 1.0 { -*side } else { after };
            all.push(part.passage(part.begin + zero * part.span, event, *side > 0));
            if share >= 1.0 {
                break;
            }
        }
    }
}
