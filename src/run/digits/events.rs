//! Events of a scene in many digits: the zeros of their formulas, by Newton's iteration on the formulas'
//! series.
//!
//! A step ends at the first event that changes what acts.
//!
//! That there is a zero, and where about, is told in doubles ([`search`](crate::stepping::search)), as it is
//! for walls: two zeros within 1e-9 of a step are one, or none.  Steps are so short that the series of the
//! formulas converge in them, too.

use super::functions::{Functions, LEAVES, SAME, magnitude};
use super::motion::DigitsMotion;
use super::wall::{in_shares, refined};
use crate::arithmetic::digits::Digits;
use crate::arithmetic::{Real, Scalar};
use crate::dynamics::compile::exact::{ExactEvent, ExactMechanism};
use crate::run::event::KEPT;
use crate::scene::Direction;
use crate::stepping::search::{Curve, PowerSeries, root, sign};

/// Share of the largest value within a step up to which a formula is at its zero.
const NO_VALUE: f64 = 1e-12;
/// Part of the digits in which a function that is kept at zero is zero.
const SURE: f64 = 0.75;

/// An event that has happened.
#[derive(Clone, Debug)]
pub struct Happened<const W: usize> {
    /// Its number.
    pub event: usize,
    /// Time \[s\].
    pub t: Digits<W>,
    /// Angles, then positions of origins \[rad, m\].
    pub phi: Vec<Digits<W>>,
    /// Their rates \[rad/s, m/s\].
    pub omega: Vec<Digits<W>>,
}

/// Watches the events of a motion.
#[derive(Clone, Debug, Default)]
pub struct EventWatch<const W: usize> {
    pub functions: Functions<W>,
    /// What is in the step that is next, and the sides of zero the formulas are on at its end.
    ahead: Vec<EventAhead<W>>,
    ends: Vec<i8>,
    /// The sides they were on at the end of the last one: -1, 1, or 0 where that is not known.
    pub sides: Vec<i8>,
    /// Events of the moment at which another one has changed what acts, and whether their functions rise:
    /// they happen where the next step begins; and those of the end of the step that is next.
    pub due: Vec<(usize, bool)>,
    put_off: Vec<(usize, bool)>,
    /// What happened before.
    pub happened: Vec<Happened<W>>,
}

/// An event in the step that is next.
#[derive(Clone, Copy, Debug)]
struct EventAhead<const W: usize> {
    event: usize,
    /// How long after the step's begin \[s\].
    after: Digits<W>,
    rises: bool,
}

impl<const W: usize> EventWatch<W> {
    /// For the events of a mechanism.
    pub fn new(mechanism: &ExactMechanism<Digits<W>>, order: usize) -> Self {
        let functions = Functions::new(&mechanism.functions, order);
        Self { functions, sides: vec![0; mechanism.events.len()], ..Self::default() }
    }

    /// The same where another mechanism acts than before: functions of parameters that are others now may
    /// have jumped, which is no passage; at a corner of their own it is one.
    pub fn renewed(self, [before, now]: [&ExactMechanism<Digits<W>>; 2], order: usize) -> Self {
        let functions = Functions::new(&now.functions, order);
        let keeps = before.acting.parameters == now.acting.parameters;
        let functions_of = before.functions.iter().zip(&now.functions);
        let is_same = functions_of.map(|(before, now)| keeps || before == now);
        let sides = self.sides.iter().zip(is_same).map(|(&side, is_same)| if is_same { side } else { 0 });
        Self { functions, sides: sides.collect(), due: self.due, happened: self.happened, ..Self::default() }
    }

    /// Looks for what happens in a step of so many seconds, of those for which the series is made; where an
    /// event changes what acts, the step is to end there, after so many seconds.  A function that is zero
    /// where the step `ends_at_corner` of a formula may only touch zero: that is told by the next step.
    pub fn look(
        &mut self,
        motion: &DigitsMotion<W>,
        [step, made]: [f64; 2],
        ends_at_corner: bool,
    ) -> Option<Digits<W>> {
        (self.ahead, self.ends) = self.passing(motion, [step, made], ends_at_corner);
        let due = self.due.iter().map(|&(event, rises)| EventAhead { event, after: Digits::ZERO, rises });
        self.ahead.splice(0..0, due);
        self.put_off.clear();
        let is_last = |ahead: &EventAhead<W>| {
            let event = &motion.mechanism.events[ahead.event];
            event.stop || event.changes
        };
        let end = self.ahead.iter().position(is_last)?;
        let later = self.ahead.split_off(end + 1);
        let last = self.ahead[end];
        if !motion.mechanism.events[last.event].changes {
            return None;
        }
        // What happens at this moment as well is left to the next step.
        let is_now = |ahead: &&EventAhead<W>| (ahead.after - last.after).value() <= SAME * made;
        self.put_off = later.iter().filter(is_now).map(|ahead| (ahead.event, ahead.rises)).collect();
        self.put_off.retain(|(event, _)| *event != last.event);
        let (passing, ends) = self.passing(motion, [last.after.value(), made], false);
        self.ends = ends;
        for (event, side) in self.ends.iter_mut().enumerate() {
            let of_event = |ahead: &&EventAhead<W>| ahead.event == event;
            let kept = self.ahead.iter().filter(of_event).count();
            let seen = passing.iter().filter(of_event).count();
            let of = if seen > kept { &passing } else { &self.ahead };
            let rises = of.iter().rfind(of_event).is_some_and(|last| last.rises);
            if seen != kept {
                *side = if rises == (seen < kept) { 1 } else { -1 };
            }
        }
        for &(event, rises) in &self.put_off {
            self.ends[event] = if rises { 1 } else { -1 };
        }
        Some(last.after)
    }

    /// The passages that count in a step of so many seconds, in the order of their times, and the sides of
    /// all functions at its end.
    fn passing(
        &self,
        motion: &DigitsMotion<W>,
        [step, made]: [f64; 2],
        ends_at_corner: bool,
    ) -> (Vec<EventAhead<W>>, Vec<i8>) {
        let (mut ahead, mut ends) = (Vec::new(), Vec::new());
        let off = &motion.mechanism.acting.off;
        for (event, powers) in self.functions.powers.iter().enumerate() {
            let ExactEvent { direction, joints, magnitude, .. } = &motion.mechanism.events[event];
            // What closes a joint that is closed rests, as its function does at zero.
            if joints.iter().any(|joint| !off.contains(joint)) {
                ends.push(0);
                continue;
            }
            let shares = in_shares(powers, 1.0, made);
            let counts =
                |rises: bool| *direction == Direction::Either || rises == (*direction == Direction::Rising);
            let began = (self.happened.iter().rev())
                .take_while(|last| (motion.state().t - last.t).value() <= SAME * made)
                .any(|last| last.event == event)
                || self.due.iter().any(|due| due.0 == event);
            let least = magnitude * libm::exp2(motion.precision.rounding(SURE));
            let span = (step / made, ends_at_corner);
            let (passages, end) = passages(&shares, span, least, (self.sides[event], began));
            ends.push(end);
            for (share, rises) in passages.into_iter().filter(|(_, rises)| counts(*rises)) {
                let near = Digits::of(share * made);
                let after = if share == 0.0 { Digits::ZERO } else { refined(motion, powers, near) };
                ahead.push(EventAhead { event, after, rises });
            }
        }
        ahead.sort_by(|a: &EventAhead<W>, b| {
            (a.after - b.after).value().total_cmp(&0.0).then(a.event.cmp(&b.event))
        });
        (ahead, ends)
    }

    /// The event of the step that is next which ends the run, and how much later \[s\].
    pub fn stop(&self, mechanism: &ExactMechanism<Digits<W>>) -> Option<(usize, Digits<W>)> {
        let last = self.ahead.last().filter(|last| mechanism.events[last.event].stop)?;
        Some((last.event, last.after))
    }

    /// The event at the end of the step that is next which changes what acts.
    pub fn change(&self, mechanism: &ExactMechanism<Digits<W>>) -> Option<usize> {
        let last = self.ahead.last().filter(|last| mechanism.events[last.event].changes)?;
        Some(last.event)
    }

    /// What happens in the step that is next, as far as there is room for it.
    fn happening(&self, motion: &DigitsMotion<W>) -> impl Iterator<Item = Happened<W>> {
        let happens = |&EventAhead { event, after, .. }: &EventAhead<W>| {
            let t = motion.state().t + after;
            let coordinates = motion.at(t);
            Happened { event, t, phi: coordinates.phi, omega: coordinates.omega }
        };
        self.ahead.iter().take(KEPT.saturating_sub(self.happened.len())).map(happens)
    }

    /// What has happened up to a time in the step that is next.
    pub fn until(&self, motion: &DigitsMotion<W>, t: Digits<W>) -> Vec<Happened<W>> {
        let ahead = self.happening(motion).filter(|event| event.t <= t);
        self.happened.iter().cloned().chain(ahead).collect()
    }

    /// Takes what is in the step that is next, which is made.
    pub fn pass(&mut self, motion: &DigitsMotion<W>) {
        let passed: Vec<_> = self.happening(motion).collect();
        self.happened.extend(passed);
        self.sides.clone_from(&self.ends);
        self.due = std::mem::take(&mut self.put_off);
        self.ahead.clear();
    }
}

/// Passages of a formula through zero up to `end`, in shares of what its series is made for, and whether it
/// rises, and its side there; `began` says that one of them ended the step before.  What nowhere is larger
/// than `least` is rounding, as of a point that is kept at rest.  Zeros at a corner at the end are left to
/// the next step.
fn passages(
    shares: &[f64],
    (end, ends_at_corner): (f64, bool),
    least: f64,
    (before, began): (i8, bool),
) -> (Vec<(f64, bool)>, i8) {
    let curve = PowerSeries { powers: shares, end: 1.0 };
    let at = |share: f64| curve.at(share)[0];
    let most = magnitude(shares);
    let mut all = Vec::new();
    if most <= least || !most.is_finite() {
        return (all, before);
    }
    let is_at_zero = at(0.0).abs() <= NO_VALUE * most;
    let mut side = if is_at_zero || began { sign(at(LEAVES)) } else { sign(at(0.0)) };
    // A jump of the rates may have carried it across.
    if before != 0 && side == -before && !began {
        all.push((0.0, side > 0));
    }
    let mut share = SAME;
    while share < end
        && let Some(zero) = root(&curve, 0.0, share, end)
    {
        share = zero + SAME;
        if ends_at_corner && share >= end {
            return (all, side);
        }
        let after = sign(at(share.min(end)));
        // At the very end of a step what follows is not known: it is on the other side.
        let next = if after == 0 || share >= end { -side } else { after };
        if next != side {
            all.push((zero, next > 0));
        }
        side = next;
        if share >= end {
            return (all, side);
        }
    }
    // A step may end at a zero, as one that ends on a wall does.
    let [value, slope] = curve.at(end);
    if !ends_at_corner && value.abs() <= NO_VALUE * most && sign(slope) == -side {
        all.push((end, slope > 0.0));
        side = -side;
    }
    (all, side)
}
