//! Extremes and means of the scene's outputs over a whole run, located between its rows on the dense output
//! of every step.
//!
//! The outputs are interpolated at Chebyshev points of every step, by as high a degree as they ask for; the
//! zeros of the interpolants' slopes are the extremes, their integrals the means.  Where all of them lie well
//! between the extremes known so far, as in most steps of a long run, one low degree serves, and the cheapest
//! interpolation of the motion.  Steps in which an output has a corner or jumps are taken apart there.

mod found;
mod irregular;
mod limits;
mod parts;
mod poles;
mod singular;

use self::found::Found;
pub(in crate::run) use self::limits::{OutputNear, SideLimit, weighted};
use self::singular::PassageMemory;
pub(in crate::run) use self::singular::{SMALL, USELESS};
use super::drift::Singular;
use super::halvings::Halvings;
use super::observer::{Inside, StepWatcher};
use super::rounding::changes;
use crate::arithmetic::DoubleDouble;
use crate::dynamics::kernel::{Bias, Kernel};
use crate::dynamics::output::{Moment, OutputScratch, Outputs};
use crate::dynamics::{Mechanism, Motion, Time};
use crate::stepping::search::{Chebyshev, Curve, Interpolants, interpolated};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Degrees of the interpolants, and what the last coefficients may be over the largest value.
const DEGREES: [usize; 3] = [8, 16, 32];
const RESOLVED: f64 = 1e-10;
/// Degrees by which a step is judged before anything else is done: short steps, as between close rows, by the
/// lower one first.
const FIRST: [usize; 2] = [6, 12];
/// Below this share of the largest value, last coefficients that [stay](Chebyshev::stays) with twice the
/// degree are what the dense output is off, where its pieces join: neither a higher degree nor halves have
/// less.
const NOISE: f64 = 1e-6;
/// What an output may be beside its interpolant, over the largest value, for a step to be passed over, and
/// what the last coefficients may be there.
const MARGIN: f64 = 1e-6;
const PASSED: f64 = 1e-8;
/// Part of what an output changes by in one unit of a coordinate or rate that is rounding: what is no more
/// stays at zero.
const ROUNDING: f64 = 1e-13;
/// What the last digits of coordinates and rates do to an output, so many times, is rounding as well.
const DIGITS: f64 = 16.0;
/// Variation up to which an output is constant, over its size.
const CONSTANT: f64 = 1e-14;
/// Steps until the next one is tried to be passed over, after one that was not.
const WAITS: u8 = 1;
/// Halvings of a step that no interpolant resolves: an output may have corners.  Of parts with many turns
/// there are more.
const HALVINGS: u32 = 6;
/// Of these the first ones, in whose halves it is asked whether it may be rounding instead.
const DOUBTS: u32 = 2;
/// Halvings of the bracket of an extreme, and golden sections of one beside a corner.
const ROUNDS: usize = 48;

/// What an output came to over a run: infinite where it grows without bound at a singular position, not a
/// number where its limit there is not known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Extremes {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The least value, and when it was taken \[s\].
    pub min: [f64; 2],
    /// The largest value, and when \[s\].
    pub max: [f64; 2],
    /// Mean over time.
    pub mean: f64,
    /// Root of the mean square over time.
    pub rms: f64,
}

impl Extremes {
    /// Least and largest value, mean and rms: what a sweep keeps of it.
    pub(super) fn figures(&self) -> [f64; 4] {
        [self.min[0], self.max[0], self.mean, self.rms]
    }

    /// The value of the largest magnitude, and when it was taken \[s\].
    pub fn peak(&self) -> [f64; 2] {
        if self.min[0].abs() > self.max[0].abs() { self.min } else { self.max }
    }
}

/// What is remembered between steps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct ExtremesMemory {
    /// Time looked at \[s\].
    span: DoubleDouble,
    found: Vec<Found>,
    /// Steps that are not tried to be passed over, as one before them was not.
    waits: u8,
    /// True where the lower degree was enough for the last step that was tried.
    is_short: bool,
    /// Magnitudes of the outputs that are rounding.
    rounding: Vec<f64>,
    /// The same of the conditions that choose their branches.
    still: Vec<f64>,
    /// Short parts, one after the other, in which no interpolant has resolved each output.
    unresolved: Vec<u8>,
    /// The singular position that is near.
    passage: Option<PassageMemory>,
    /// The nearest to one it came on the way through.
    singular: Option<Singular>,
}

/// Looks at the outputs of every step.
pub(super) struct ExtremesDetector {
    mechanism: Arc<Mechanism>,
    kernel: Kernel<f64>,
    coordinates: [Vec<f64>; 3],
    scratch: OutputScratch,
    /// The branches their formulas are evaluated on; none: those that hold at each place.
    branches: Vec<bool>,
    /// The least share of a constraint in the step so far.
    least: f64,
    pub halvings: Halvings,
    pub memory: ExtremesMemory,
}

impl ExtremesDetector {
    /// One for a mechanism; `None` where its scene has no outputs.
    pub fn new(mechanism: &Arc<Mechanism>) -> Option<Self> {
        let count = mechanism.outputs.as_ref()?.heads().count();
        Some(Self {
            kernel: Kernel::new(mechanism),
            mechanism: Arc::clone(mechanism),
            coordinates: Default::default(),
            scratch: OutputScratch::default(),
            branches: Vec::new(),
            least: f64::INFINITY,
            halvings: Halvings::default(),
            memory: ExtremesMemory { found: vec![Found::default(); count], ..ExtremesMemory::default() },
        })
    }

    /// From here on the outputs are those of this mechanism: the same with other contacts held, or other
    /// parts that act.
    pub fn hold(&mut self, mechanism: &Arc<Mechanism>) {
        if !Arc::ptr_eq(mechanism, &self.mechanism) {
            self.kernel = Kernel::new(mechanism);
            self.mechanism = Arc::clone(mechanism);
        }
    }

    /// Counts in means, for so long a time \[s\] from a motion on, the outputs of another mechanism in place
    /// of those of the present one.
    pub fn exchange_for(&mut self, other: &Arc<Mechanism>, motion: &Motion, span: f64) {
        let held = Arc::clone(&self.mechanism);
        let [mut counted, mut instead] = [Vec::new(), Vec::new()];
        self.values(motion, &mut counted);
        self.hold(other);
        self.values(motion, &mut instead);
        self.hold(&held);
        for (found, (counted, instead)) in self.memory.found.iter_mut().zip(counted.iter().zip(&instead)) {
            found.integral += DoubleDouble::product(instead - counted, span);
            found.square += DoubleDouble::product(instead * instead - counted * counted, span);
        }
    }

    /// Takes what a run before remembered; false where it is of other outputs.
    pub fn restore(&mut self, memory: ExtremesMemory) -> bool {
        let count = self.memory.found.len();
        let conditions = self.condition_count();
        let fits = memory.found.len() == count
            && [0, count].contains(&memory.rounding.len())
            && [0, conditions].contains(&memory.still.len())
            && [0, count].contains(&memory.unresolved.len())
            && memory.passage.as_ref().is_none_or(|passage| passage.fits(count));
        if fits {
            self.memory = memory;
        }
        fits
    }

    /// What the outputs came to; nothing before the first step.
    pub fn extremes(&self) -> Vec<Extremes> {
        let span = self.memory.span.hi;
        let Some(outputs) = self.mechanism.outputs.as_ref().filter(|_| span > 0.0) else { return Vec::new() };
        let extremes = |((name, unit), mut found): ((&str, &str), Found)| {
            // It has had no value at all.
            if found.min[0] > found.max[0] {
                found.forget();
            }
            let [mean, rms] = found.means(span);
            Extremes {
                name: name.to_owned(),
                unit: unit.to_owned(),
                min: found.min,
                max: found.max,
                mean,
                rms,
            }
        };
        outputs.heads().zip(self.found_at_end()).map(extremes).collect()
    }

    /// Appends the outputs at a motion.
    fn values(&mut self, motion: &Motion, values: &mut Vec<f64>) {
        let branches = std::mem::take(&mut self.branches);
        self.with_outputs(motion, |outputs, moment, scratch| {
            outputs.evaluate(moment, scratch, &branches, values)
        });
        self.branches = branches;
    }

    /// Shows the outputs a motion.
    fn with_outputs<R: Default>(
        &mut self,
        motion: &Motion,
        what: impl FnOnce(&Outputs, &Moment, &mut OutputScratch) -> R,
    ) -> R {
        let Self { mechanism, kernel, coordinates: [phi, winding, omega], scratch, .. } = self;
        for (to, from) in [(&mut *phi, &motion.phi), (&mut *omega, &motion.omega)] {
            to.clear();
            to.extend(from.iter().map(|value| value.hi));
        }
        winding.clear();
        winding.extend((0..phi.len()).map(|k| motion.unwrapped(k)));
        let Some(outputs) = &mechanism.outputs else { return R::default() };
        if outputs.needs_equations() {
            kernel.accelerations(mechanism, motion.time, phi, omega, Bias::default());
            self.least = self.least.min(mechanism.standing_share(kernel));
        } else {
            kernel.place(mechanism, phi);
        }
        what(outputs, &Moment { mechanism, time: motion.time, phi, winding, omega, kernel }, scratch)
    }

    /// The outputs at a motion.
    fn values_at(&mut self, motion: &Motion) -> Vec<f64> {
        let mut values = Vec::new();
        self.values(motion, &mut values);
        values
    }

    /// What the outputs change by where one coordinate or rate moves by a unit, at most.
    pub fn changes(&mut self, motion: &Motion) -> Vec<f64> {
        changes(&Arc::clone(&self.mechanism), motion, |motion| self.values_at(motion))
    }

    /// True where no output comes near a new extreme, as the interpolants of a low degree tell, of which the
    /// means are taken then.
    fn passes(&mut self, inside: &mut dyn Inside, begin: Time, span: f64) -> bool {
        if self.memory.waits > 0 {
            self.memory.waits -= 1;
            return false;
        }
        let degrees = if self.memory.is_short { &FIRST[..] } else { &FIRST[1..] };
        let rounding = self.memory.rounding.clone();
        let at = |share: f64, row: &mut Vec<f64>| self.known(inside.roughly_at(begin + share * span), row);
        let is_known = |k: usize, curve: &Chebyshev, _: Option<&Chebyshev>| {
            curve.tail() <= (PASSED * curve.most()).max(rounding[k])
        };
        let Interpolants { curves, nodes, values, .. } = interpolated(degrees, at, is_known);
        let is_short = |(curve, &rounding): (&Chebyshev, &f64)| {
            curve.tail_of(FIRST[0]) <= (PASSED * curve.most()).max(rounding)
        };
        self.memory.is_short = curves.iter().zip(&rounding).all(is_short);
        let found = &mut self.memory.found;
        let holds = |((curve, found), &rounding): ((&Chebyshev, &Found), &f64)| found.holds(curve, rounding);
        if !curves.iter().zip(&*found).zip(&rounding).all(holds) {
            self.memory.waits = WAITS;
            return false;
        }
        self.memory.span += DoubleDouble::from(span);
        found.iter_mut().zip(curves.iter().zip(&values)).for_each(|(found, (curve, values))| {
            found.sum_up(curve, nodes, values, span);
        });
        true
    }

    /// Looks at a step, or the beginning or end of one.
    fn look_over(&mut self, inside: &mut dyn Inside, begin: Time, span: f64) {
        match self.condition_count() {
            0 => self.look_at(inside, begin, span),
            _ => self.look_at_parts(inside, begin, span),
        }
    }

    /// Takes the outputs at the end of a run, where a jump has made the event that ends it happen: no step
    /// follows.
    pub fn end(&mut self, motion: &Motion) {
        self.branches.clear();
        let values = self.values_at(motion);
        for (found, value) in self.memory.found.iter_mut().zip(values) {
            found.see(value, motion.time.hi);
        }
    }

    fn look(&mut self, inside: &mut dyn Inside, begin: Time, span: f64, depth: u32) {
        let rounding = self.memory.rounding.clone();
        let at = |share: f64, row: &mut Vec<f64>| self.known(inside.at(begin + share * span), row);
        let is_enough = |k: usize, curve: &Chebyshev, lower: Option<&Chebyshev>| {
            let (tail, size) = (curve.tail(), curve.most());
            tail <= (RESOLVED * size).max(rounding[k]) || tail <= NOISE * size && curve.stays(lower)
        };
        let Interpolants { curves, nodes, values, is_resolved } = interpolated(&DEGREES, at, is_enough);
        if depth == 0 && self.look_inwards(inside, (begin, span), &values, is_resolved) {
            return;
        }
        let is_open: Vec<bool> = (curves.iter().zip(&rounding))
            .map(|(curve, &rounding)| !is_resolved && curve.tail() > (RESOLVED * curve.most()).max(rounding))
            .collect();
        let doubts = depth <= DOUBTS && !is_resolved && !self.were_irregular(&is_open);
        if doubts && self.has_more_rounding(inside, begin + 0.5 * span) {
            return self.look(inside, begin, span, depth);
        }
        let (angles, part) = (self.mechanism.bodies.len(), (begin, span));
        let is_halved = (0..curves.len()).any(|k| is_open[k] && !self.is_irregular(k));
        if is_halved && self.halvings.asks(inside, angles, part, [depth, HALVINGS]) {
            self.look(inside, begin, 0.5 * span, depth + 1);
            return self.look(inside, begin + 0.5 * span, 0.5 * span, depth + 1);
        }
        self.count_unresolved(inside, part, depth, &is_open);
        self.memory.span += DoubleDouble::from(span);
        let ends = self.true_ends(inside, begin, span);
        let mut row = Vec::new();
        for (k, (curve, values)) in curves.iter().zip(&values).enumerate() {
            let found = &mut self.memory.found[k];
            found.sum_up(curve, nodes, values, span);
            for (i, (value, node)) in values.iter().zip(&nodes.places).enumerate() {
                let is_end = i == 0 || i + 1 == values.len();
                let seen =
                    ends.as_ref().filter(|_| is_end).map(|[to, from]| if i == 0 { to[k] } else { from[k] });
                // Beside a jump the limit counts.
                let seen = seen.filter(|seen| (seen - value).abs() <= MARGIN * curve.most());
                found.see(seen.unwrap_or(*value), (begin + node * span).hi);
            }
            if found.holds(curve, rounding[k]) {
                continue;
            }
            let known = [found.min[0], found.max[0]];
            if is_open[k] && !self.is_irregular(k) {
                self.look_beside_nodes(inside, (begin, span), k, (values, &nodes.places));
                continue;
            }
            for share in turns(curve, values, &nodes.places, known) {
                let t = begin + share * span;
                row.clear();
                self.values(inside.at(t), &mut row);
                self.memory.found[k].see(row[k], t.hi);
            }
        }
    }
}

/// Magnitudes that are rounding of functions that change so much.
pub(in crate::run) fn rounding_of(changes: &[f64]) -> Vec<f64> {
    changes.iter().map(|change| if change.is_finite() { ROUNDING * change } else { 0.0 }).collect()
}

/// Makes these magnitudes of rounding those of the last digits found where that is much more; tells if it is.
fn has_grown(rounding: &mut [f64], last_digits: &[f64]) -> bool {
    let mut is_more = false;
    for (rounding, found) in rounding.iter_mut().zip(last_digits) {
        let found = DIGITS * found;
        if found.is_finite() && found > 2.0 * *rounding {
            (*rounding, is_more) = (found, true);
        }
    }
    is_more
}

/// Where a curve turns round next to a node that may be beside a new extreme.
fn turns(curve: &Chebyshev, values: &[f64], nodes: &[f64], [least, most]: [f64; 2]) -> Vec<f64> {
    let mut turns = Vec::new();
    let slopes: Vec<f64> = nodes.iter().map(|&node| curve.at(node)[1]).collect();
    for i in 1..values.len() {
        // Nodes go from 1 to 0.
        let (mut low, mut high) = (nodes[i], nodes[i - 1]);
        let (first, last) = (slopes[i], slopes[i - 1]);
        if first == 0.0 || last == 0.0 || (first > 0.0) == (last > 0.0) {
            continue;
        }
        // It cannot rise further between the nodes than its slopes at them carry it.
        let reach = (high - low) * first.abs().max(last.abs());
        let is_near = if first > 0.0 {
            values[i].max(values[i - 1]) + reach >= most
        } else {
            values[i].min(values[i - 1]) - reach <= least
        };
        if !is_near {
            continue;
        }
        for _ in 0..ROUNDS {
            let middle = 0.5 * (low + high);
            if (curve.at(middle)[1] > 0.0) == (first > 0.0) { low = middle } else { high = middle }
        }
        turns.push(0.5 * (low + high));
    }
    turns
}

impl StepWatcher for ExtremesDetector {
    fn step(&mut self, inside: &mut dyn Inside) -> Option<Time> {
        let (begin, end) = inside.span();
        let span = (end - begin).hi;
        if self.memory.rounding.is_empty() {
            self.memory.rounding = rounding_of(&self.changes(inside.at(begin)));
        }
        self.halvings.begin();
        self.least = f64::INFINITY;
        let before = self.memory.found.clone();
        self.look_over(inside, begin, span);
        self.watch_singular(inside, before);
        self.halvings.is_too_much().then_some(end)
    }
}

#[cfg(test)]
mod tests;
