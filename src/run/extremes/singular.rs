//! Forces and accelerations at singular positions that the motion goes through.
//!
//! Within d of one the state tells them to about ε/d³, and nearer than 1e-4 constraints are left out.  What
//! they are there is the limit along the motion, of polynomials fitted to either side of the time t*:
//!
//! ```text
//! f = p(t - t*)            over both sides, or over one
//! f = p(t - t*) / |t - t*|,   p(0) ≠ 0      without bound
//! ```
//!
//! While a singular position is near, the outputs are remembered; once it is passed, those that follow from
//! the equations count as the polynomials tell, and are not known where two degrees differ.

use super::{ExtremesDetector, Found};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::schur::{NEAR, SINGULAR};
use crate::dynamics::{Motion, Time};
use crate::run::drift::Singular;
use crate::run::observer::Inside;
use crate::stepping::search::{golden_sections, value};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::convert::Infallible;

/// Places of a step that are looked at, those on either side of the least share, so many in an octave, golden
/// sections beside it, and outputs that are remembered at most.
const PLACES: usize = 64;
const BESIDE: i32 = 32;
const IN_OCTAVE: i32 = 4;
const ROUNDS: usize = 48;
const MOST: usize = 4096;
/// Share below which a least one is looked for, and outputs are too inaccurate to be of use.
const SMALL: f64 = 1e-4;
const USELESS: f64 = 1e-6;
/// Shares of the way to the farther end on which a limit is looked for, and halvings of the rest.
const SHARES: [f64; 5] = [1.0, 0.5, 0.25, 0.125, 0.0625];
const HALVINGS: u32 = 3;
/// Degrees of polynomials over both sides and over one, and how much lower that of the other one is.
const BOTH: usize = 8;
const ONE: usize = 6;
const LOWER: usize = 2;
/// Two polynomials tell what differs by no more over the largest value, or over magnitudes of rounding.
const ALIKE: f64 = 1e-5;
const ROUNDING: f64 = 1e5;
/// p(0) over the largest |p| above which an output is without bound.
const POLE: f64 = 1e-3;
/// The length of one side over that of both below which the other one's polynomial serves for it.
const SHORT: f64 = 0.1;
/// Intervals in which a polynomial is looked at; an even number.
const INTERVALS: u32 = 256;

/// What is remembered near a singular position.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PassageMemory {
    /// From and to these times \[s\] it is near, so far.
    begin: f64,
    end: f64,
    /// What was known before it.
    before: Vec<Found>,
    /// Times, shares of the weakest constraint, and outputs.
    samples: Vec<(f64, f64, Vec<f64>)>,
    /// The least share, when \[s\], and the least singular value there.
    least: [f64; 3],
    /// The constraint that is weakest there.
    weakest: usize,
    /// True where it stays near for too long.
    is_long: bool,
}

/// What an output comes to on one side.
#[derive(Clone)]
enum SideLimit {
    /// Coefficients of a polynomial, and up to which share of the way to the farther end it is that.
    Curve(Vec<f64>, f64),
    /// Without bound, in this sense.
    Unbounded(f64),
    Unknown,
}

/// Time from the singular position over the longest one, output, and weight.
type Point = [f64; 3];

impl ExtremesDetector {
    /// Looks for singular positions after a step has been looked at, with what had been found before it.
    pub(super) fn watch_singular(&mut self, inside: &mut dyn Inside, before: Vec<Found>) {
        let is_open = match &self.memory.passage {
            None => false,
            Some(passage) if passage.is_long => {
                if self.least >= NEAR {
                    self.memory.passage = None;
                }
                return;
            }
            Some(_) => true,
        };
        let (begin, end) = inside.span();
        let span = (end - begin).hi;
        if !is_open && self.least >= NEAR || span <= 0.0 {
            return;
        }
        let place = |i: usize| begin + span * (i as f64 / PLACES as f64);
        let is_near: Vec<bool> = (0..=PLACES).map(|i| self.share(inside.at(place(i))) < NEAR).collect();
        let Some(first) = is_near.iter().position(|&is_near| is_near) else {
            return self.close(inside, begin);
        };
        let last = is_near.iter().rposition(|&is_near| is_near).unwrap_or(PLACES);
        let to = place(PLACES.min(last + 1));
        let from = if is_open { begin } else { place(first.saturating_sub(1)) };
        if !is_open {
            self.open(inside, (begin, from), before);
        }
        self.remember(inside, (from, to));
        if last < PLACES {
            self.close(inside, to);
        }
    }

    /// Begins to remember, where a singular position comes near in a step.
    fn open(&mut self, inside: &mut dyn Inside, (begin, from): (Time, Time), before: Vec<Found>) {
        let kept = self.memory.clone();
        self.memory.found = before;
        self.look_over(inside, begin, (from - begin).hi);
        let before = std::mem::replace(&mut self.memory, kept).found;
        self.memory.passage = Some(PassageMemory {
            begin: from.hi,
            end: from.hi,
            before,
            samples: Vec::new(),
            least: [f64::INFINITY, from.hi, f64::NAN],
            weakest: 0,
            is_long: false,
        });
    }

    /// Remembers a part of a step.
    fn remember(&mut self, inside: &mut dyn Inside, (from, to): (Time, Time)) {
        let Some(mut passage) = self.memory.passage.take() else { return };
        let span = (to - from).hi;
        let place = |at: f64| from + span * (at / PLACES as f64);
        let mut shares = Vec::new();
        for i in 0..=PLACES {
            shares.push(self.remember_at(inside, place(i as f64), &mut passage));
        }
        let nearest = (0..=PLACES).min_by(|&a, &b| shares[a].total_cmp(&shares[b])).unwrap_or(0);
        if shares[nearest] < SMALL {
            let mut least = (shares[nearest], place(nearest as f64));
            let bracket = [nearest.saturating_sub(1), PLACES.min(nearest + 1)].map(|i| i as f64);
            let at = |at: f64| {
                let share = self.share(inside.at(place(at)));
                if share < least.0 {
                    least = (share, place(at));
                }
                Ok::<f64, Infallible>(share)
            };
            let Ok(()) = golden_sections(at, bracket, ROUNDS);
            if least.0 < passage.least[0] {
                self.share(inside.at(least.1));
                passage.least = [least.0, least.1.hi, self.mechanism.conditioning(&self.kernel)];
                passage.weakest = self.mechanism.standing_weakest(&self.kernel).row;
            }
            for after in (0..BESIDE).map(|i| span * f64::from(-i).exp2().powf(1.0 / f64::from(IN_OCTAVE))) {
                for t in [least.1 + -after, least.1 + after].into_iter().filter(|t| *t > from && *t < to) {
                    self.remember_at(inside, t, &mut passage);
                }
            }
        }
        passage.end = to.hi;
        passage.is_long = passage.samples.len() > MOST;
        if passage.is_long && passage.is_singular() {
            let follows = self.mechanism.outputs.iter().flat_map(|outputs| outputs.follows_equations());
            let found = self.memory.found.iter_mut().zip(follows);
            found.filter(|(_, follows)| **follows).for_each(|(found, _)| found.forget());
        }
        self.memory.passage = Some(passage);
    }

    /// Remembers the outputs at a time where they are of use; returns the share of the weakest constraint.
    fn remember_at(&mut self, inside: &mut dyn Inside, t: Time, passage: &mut PassageMemory) -> f64 {
        let values = self.values_at(inside.at(t));
        let share = self.mechanism.standing_share(&self.kernel);
        if share >= USELESS && share.is_finite() {
            passage.samples.push((t.hi, share, values));
        }
        share
    }

    /// Counts what is remembered up to a time of a step, where a singular position was passed.
    fn close(&mut self, inside: &mut dyn Inside, to: Time) {
        let Some(mut passage) = self.memory.passage.take().filter(PassageMemory::is_singular) else {
            return;
        };
        passage.end = to.hi;
        let kept = self.memory.clone();
        self.memory.found = passage.found(&self.memory.rounding);
        let end = inside.span().1;
        self.look_over(inside, to, (end - to).hi);
        let found = std::mem::replace(&mut self.memory, kept).found;
        self.memory.singular = self.nearer(&passage);
        self.memory.found = self.chosen(found);
    }

    /// Those of outputs that follow from the equations, all others as they are known.
    fn chosen(&self, found: Vec<Found>) -> Vec<Found> {
        let follows = self.mechanism.outputs.iter().flat_map(|outputs| outputs.follows_equations());
        let pairs = self.memory.found.iter().zip(found).zip(follows);
        pairs.map(|((known, found), &follows)| if follows { found } else { *known }).collect()
    }

    /// The passage, or the one before that came nearer.
    fn nearer(&self, passage: &PassageMemory) -> Option<Singular> {
        let [_, t, smallest] = passage.least;
        let is_nearer = self.memory.singular.as_ref().is_none_or(|known| smallest < known.smallest);
        if !is_nearer || smallest.is_nan() {
            return self.memory.singular.clone();
        }
        let name = |row: &crate::dynamics::constraint::ConstraintEquation| row.name().to_owned();
        let constraint = self.mechanism.constraints.get(passage.weakest).map_or_else(String::new, name);
        Some(Singular { smallest, t, constraint })
    }

    /// What is known where the run ends here.
    pub(super) fn found_at_end(&self) -> Vec<Found> {
        match self.memory.passage.as_ref().filter(|passage| passage.is_singular() && !passage.is_long) {
            Some(passage) => self.chosen(passage.found(&self.memory.rounding)),
            None => self.memory.found.clone(),
        }
    }

    /// The nearest to a singular position it came on the way through.
    pub fn singular(&self) -> Option<Singular> {
        let passage = self.memory.passage.as_ref().filter(|passage| passage.is_singular());
        passage.map_or_else(|| self.memory.singular.clone(), |passage| self.nearer(passage))
    }

    /// The share of the weakest constraint at a motion.
    fn share(&mut self, motion: &Motion) -> f64 {
        self.with_outputs(motion, |_, _, _| ());
        self.mechanism.standing_share(&self.kernel)
    }
}

impl PassageMemory {
    /// Whether it is one of so many outputs.
    pub fn fits(&self, count: usize) -> bool {
        self.before.len() == count && self.samples.iter().all(|(_, _, values)| values.len() == count)
    }

    /// True where the motion goes, or went, through a singular position and away from it.
    fn is_singular(&self) -> bool {
        self.least[0] < SINGULAR && !self.samples.is_empty()
    }

    /// What is known with what outputs come to here.
    fn found(&self, rounding: &[f64]) -> Vec<Found> {
        let mut found = self.before.clone();
        let (centre, reach) = (self.least[1], self.reach());
        for (k, found) in found.iter_mut().enumerate() {
            let rounding = rounding.get(k).copied().unwrap_or_default();
            let point = |(t, share, values): &(f64, f64, Vec<f64>)| {
                [(t - centre) / reach, values[k], share.powf(1.5)]
            };
            let all: Vec<Point> =
                self.samples.iter().map(point).filter(|point| point[1].is_finite()).collect();
            let sides = [-1.0, 1.0].map(|sign| within(&all, |at| sign * at > 0.0));
            let limits = self.limits(&all, &sides, rounding);
            for ((end, side), limit) in [self.begin, self.end].into_iter().zip(&sides).zip(limits) {
                self.count(found, (end - centre) / reach, side, limit, rounding);
            }
        }
        found
    }

    /// The time from the singular position to the farther end \[s\].
    fn reach(&self) -> f64 {
        (self.least[1] - self.begin).max(self.end - self.least[1])
    }

    /// What an output comes to on both sides.
    fn limits(&self, all: &[Point], sides: &[Vec<Point>; 2], rounding: f64) -> [SideLimit; 2] {
        let is_zero = true;
        for share in SHARES {
            let is_in = |at: f64| at.abs() <= share;
            if sides.iter().all(|side| within(side, is_in).len() > ONE)
                && let Some(curve) = alike(&within(all, is_in), BOTH, rounding, is_zero)
            {
                return [SideLimit::Curve(curve.clone(), share), SideLimit::Curve(curve, share)];
            }
        }
        let limit = |side: &Vec<Point>| {
            let told = |share: f64| {
                let near = within(side, |at| at.abs() <= share);
                if let Some(curve) = alike(&near, ONE, rounding, is_zero) {
                    return Some(SideLimit::Curve(curve, share));
                }
                let times: Vec<Point> =
                    near.iter().map(|[at, y, weight]| [*at, y * at.abs(), *weight]).collect();
                let most = times.iter().fold(0.0, |most: f64, point| most.max(point[1].abs()));
                let curve = alike(&times, ONE, rounding, is_zero)?;
                (curve[0].abs() > POLE * most).then_some(SideLimit::Unbounded(curve[0]))
            };
            SHARES.into_iter().find_map(told).unwrap_or(SideLimit::Unknown)
        };
        let mut found = sides.each_ref().map(limit);
        for (side, end) in [self.begin, self.end].into_iter().enumerate() {
            let is_short = (end - self.least[1]).abs() < SHORT * self.reach();
            if is_short && matches!(found[side], SideLimit::Unknown) {
                found[side] = found[1 - side].clone();
            }
        }
        found
    }

    /// Adds what an output comes to between the singular position and one end, times over the longest one.
    fn count(&self, found: &mut Found, end: f64, side: &[Point], limit: SideLimit, rounding: f64) {
        match limit {
            SideLimit::Curve(curve, share) => {
                let to = end.clamp(-share, share);
                self.count_curve(found, &curve, [0.0, to]);
                if to != end {
                    self.count_rest(found, side, [to, end], rounding, HALVINGS);
                }
            }
            SideLimit::Unbounded(sense) => {
                let centre = self.least[1];
                let seen = side.iter().filter(|point| point[2] >= SMALL.powf(1.5));
                seen.for_each(|[at, y, _]| found.see(*y, centre + at * self.reach()));
                found.see(f64::INFINITY.copysign(sense), centre);
            }
            SideLimit::Unknown if end != 0.0 => found.forget(),
            SideLimit::Unknown => {}
        }
    }

    /// Adds what an output comes to in a part of a side, by polynomials.
    fn count_rest(
        &self,
        found: &mut Found,
        side: &[Point],
        [from, to]: [f64; 2],
        rounding: f64,
        halvings: u32,
    ) {
        let (low, high) = (from.min(to), from.max(to));
        let part = within(side, |at| (low..=high).contains(&at));
        let middle = 0.5 * (from + to);
        match alike(&part, ONE, rounding, false) {
            Some(curve) => self.count_curve(found, &curve, [from, to]),
            None if halvings == 0 => found.forget(),
            None => {
                self.count_rest(found, side, [from, middle], rounding, halvings - 1);
                self.count_rest(found, side, [middle, to], rounding, halvings - 1);
            }
        }
    }

    /// Adds what a polynomial comes to in a part of a side.
    fn count_curve(&self, found: &mut Found, curve: &[f64], [from, to]: [f64; 2]) {
        let (centre, reach) = (self.least[1], self.reach());
        let (mut integral, mut square) = (0.0, 0.0);
        for i in 0..=INTERVALS {
            let at = from + (to - from) * (f64::from(i) / f64::from(INTERVALS));
            let [value, _] = value(curve, at);
            found.see(value, centre + at * reach);
            // Simpson's rule.
            let weight = match i {
                0 | INTERVALS => 1.0,
                _ => 2.0 + 2.0 * f64::from(i % 2),
            };
            integral += weight * value;
            square += weight * value * value;
        }
        let share = (to - from).abs() * reach / (3.0 * f64::from(INTERVALS));
        found.integral += DoubleDouble::product(integral, share);
        found.square += DoubleDouble::product(square, share);
    }
}

/// The points at such times.
fn within(points: &[Point], is_in: impl Fn(f64) -> bool) -> Vec<Point> {
    points.iter().copied().filter(|point| is_in(point[0])).collect()
}

/// The polynomial of a degree through points, in the least squares, where one of a lower degree is like it:
/// at the points, and at zero where that is asked.
fn alike(points: &[Point], degree: usize, rounding: f64, is_zero: bool) -> Option<Vec<f64>> {
    let (curve, lower) = (fitted(points, degree)?, fitted(points, degree - LOWER)?);
    let most = points.iter().fold(0.0, |most: f64, point| most.max(point[1].abs()));
    let apart = |at: f64| (value(&curve, at)[0] - value(&lower, at)[0]).abs();
    let is_alike = |at: f64| apart(at) <= (ALIKE * most).max(ROUNDING * rounding);
    ((!is_zero || is_alike(0.0)) && points.iter().all(|point| is_alike(point[0]))).then_some(curve)
}

/// The polynomial of a degree through points, in the least squares; `None` of too few of them.
fn fitted(points: &[Point], degree: usize) -> Option<Vec<f64>> {
    if points.len() <= degree {
        return None;
    }
    let weight = |i: usize| points[i][2];
    let powers = DMatrix::from_fn(points.len(), degree + 1, |i, k| weight(i) * points[i][0].powi(k as i32));
    let values = DVector::from_fn(points.len(), |i, _| weight(i) * points[i][1]);
    let qr = powers.qr();
    let found = qr.r().solve_upper_triangular(&(qr.q().transpose() * values))?;
    found.iter().all(|x| x.is_finite()).then(|| found.iter().copied().collect())
}
