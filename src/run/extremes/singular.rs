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
//! the equations count as the polynomials tell, and are not known where two degrees differ.  Where they
//! do, or an output is without bound, that is so in the core only, where constraints are nearly left out;
//! around it outputs are searched as everywhere.
//!
//! A mechanism that all but reaches a singular position turns back there: rates jump, and forces have peaks
//! that no polynomial tells.

use super::limits::{OutputNear, Point, both_limits, weighted};
use super::{ExtremesDetector, Found};
use crate::dynamics::schur::{NEAR, SINGULAR};
use crate::dynamics::{Motion, Time};
use crate::run::drift::Singular;
use crate::run::observer::Inside;
use crate::stepping::search::golden_sections;
use serde::{Deserialize, Serialize};
use std::convert::Infallible;

/// Places of a step that are looked at, those on either side of the least share, so many in an octave, golden
/// sections beside it, and outputs that are remembered at most.
const PLACES: usize = 64;
const BESIDE: i32 = 32;
const IN_OCTAVE: i32 = 4;
const ROUNDS: usize = 48;
const MOST: usize = 4096;
/// Share of the core, in which a least one is looked for.
pub(in crate::run) const SMALL: f64 = 1e-4;
/// Share below which outputs are too inaccurate for polynomials.
pub(in crate::run) const USELESS: f64 = 1e-6;
/// Part of the largest rate by which one jumps where the motion turns back.
const JUMP: f64 = 1e-3;

/// What is remembered near a singular position.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PassageMemory {
    /// From and to these times \[s\] it is near, so far.
    begin: f64,
    end: f64,
    /// What was known before it; that and what is known of it outside of the core, and of that before it.
    before: Vec<Found>,
    outside: Vec<Found>,
    until_core: Vec<Found>,
    /// From and to these times \[s\] the core is.
    core: Option<[f64; 2]>,
    samples: Vec<NearSample>,
    /// The least share, when \[s\], and the least singular value there.
    least: [f64; 3],
    /// The constraint that is weakest there.
    weakest: usize,
    /// True where it stays near for too long.
    is_long: bool,
}

/// Outputs near a singular position.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct NearSample {
    t: f64,
    /// Share of the weakest constraint.
    share: f64,
    outputs: Vec<f64>,
    /// Rates, those of translational coordinates over the size of the mechanism \[rad/s, 1/s\].
    rates: Vec<f64>,
}

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
        let mut passage = PassageMemory {
            begin: from.hi,
            end: from.hi,
            before: Vec::new(),
            outside: before,
            until_core: Vec::new(),
            core: None,
            samples: Vec::new(),
            least: [f64::INFINITY, from.hi, f64::NAN],
            weakest: 0,
            is_long: false,
        };
        self.look_outside(inside, (begin, from), &mut passage);
        passage.before.clone_from(&passage.outside);
        passage.until_core.clone_from(&passage.outside);
        self.memory.passage = Some(passage);
    }

    /// Looks for extremes in a part of a step outside of the core.
    fn look_outside(
        &mut self,
        inside: &mut dyn Inside,
        (from, to): (Time, Time),
        passage: &mut PassageMemory,
    ) {
        let kept = self.memory.clone();
        self.memory.found = std::mem::take(&mut passage.outside);
        self.look_over(inside, from, (to - from).hi);
        passage.outside = std::mem::replace(&mut self.memory, kept).found;
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
        let is_core = |i: &usize| shares[*i] < SMALL;
        if let (Some(first), Some(last)) = ((0..=PLACES).find(is_core), (0..=PLACES).rfind(is_core)) {
            let ends = [first.saturating_sub(1), PLACES.min(last + 1)].map(|i| place(i as f64));
            match &mut passage.core {
                Some([_, end]) => {
                    // What lies between is a part of the core.
                    *end = ends[1].hi;
                    passage.outside.clone_from(&passage.until_core);
                }
                None => {
                    passage.core = Some(ends.map(|end| end.hi));
                    self.look_outside(inside, (from, ends[0]), &mut passage);
                    passage.until_core.clone_from(&passage.outside);
                }
            }
            self.look_outside(inside, (ends[1], to), &mut passage);
        } else {
            self.look_outside(inside, (from, to), &mut passage);
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
        let outputs = self.values_at(inside.at(t));
        let share = self.mechanism.standing_share(&self.kernel);
        if share >= SINGULAR && share.is_finite() {
            let (angles, size) = (self.mechanism.bodies.len(), self.mechanism.size_of_parts());
            let omega = self.coordinates[2].iter().enumerate();
            let rates = omega.map(|(k, omega)| if k < angles { *omega } else { omega / size }).collect();
            passage.samples.push(NearSample { t: t.hi, share, outputs, rates });
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
        let rates = self.samples.first().map_or(0, |sample| sample.rates.len());
        let is_one = |sample: &NearSample| sample.outputs.len() == count && sample.rates.len() == rates;
        [&self.before, &self.outside, &self.until_core].into_iter().all(|known| known.len() == count)
            && self.samples.iter().all(is_one)
    }

    /// True where the motion goes, or went, through a singular position and away from it.
    fn is_singular(&self) -> bool {
        self.least[0] < SINGULAR && !self.samples.is_empty()
    }

    /// What is known with what outputs come to here.
    fn found(&self, rounding: &[f64]) -> Vec<Found> {
        let (centre, reach) = (self.least[1], self.reach());
        let over_reach = |ends: [f64; 2]| ends.map(|end| (end - centre) / reach);
        let [ends, core] = [[self.begin, self.end], self.core.unwrap_or([centre; 2])].map(over_reach);
        let is_passed = !self.turns_back();
        let found = |k: usize| {
            let rounding = rounding.get(k).copied().unwrap_or_default();
            let points = self.points(|sample| sample.outputs[k]);
            let nearest = [-1.0, 1.0].map(|sign| {
                let side = self.samples.iter().map(|sample| [(sample.t - centre) / reach, sample.outputs[k]]);
                let side = side.filter(|[at, y]| sign * at > 0.0 && y.is_finite());
                side.min_by(|[a, _], [b, _]| a.abs().total_cmp(&b.abs()))
            });
            let output = OutputNear { centre, reach, ends, rounding, points, nearest };
            let [mut all, mut outside] = [self.before[k], self.outside[k]];
            output.count(&mut all, ends, is_passed);
            output.count(&mut outside, core, is_passed);
            // What polynomials tell everywhere has less rounding in it.
            if all.min[0].is_finite() && all.max[0].is_finite() { all } else { outside }
        };
        (0..self.outside.len()).map(found).collect()
    }

    /// True where rates jump: it is no singular position that is passed.
    fn turns_back(&self) -> bool {
        let count = self.samples.first().map_or(0, |sample| sample.rates.len());
        let rates = self.samples.iter().flat_map(|sample| &sample.rates);
        let most = rates.fold(0.0, |most: f64, rate| most.max(rate.abs()));
        let jumps = |k: usize| {
            let limits = both_limits(&self.points(|sample| sample.rates[k]));
            limits.is_some_and(|[before, after]| (after - before).abs() > JUMP * most)
        };
        (0..count).any(jumps)
    }

    /// What is remembered, over time and with weights.
    fn points(&self, of: impl Fn(&NearSample) -> f64) -> Vec<Point> {
        let (centre, reach) = (self.least[1], self.reach());
        let point = |sample: &NearSample| weighted([(sample.t - centre) / reach, of(sample)], sample.share);
        let useful = self.samples.iter().filter(|sample| sample.share >= USELESS);
        useful.map(point).filter(|point| point[1].is_finite()).collect()
    }

    /// The time from the singular position to the farther end \[s\].
    fn reach(&self) -> f64 {
        (self.least[1] - self.begin).max(self.end - self.least[1])
    }
}
