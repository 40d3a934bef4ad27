//! The tangent flow along a motion: how small differences grow.
//!
//! ```text
//! V' = (dq', dw') = (dw, da),    da = A_q dq + A_w dw        columns of V marched by the classical Runge–Kutta method
//! Phi(t + h, t) = V with V(t) = 1,    Phi(t, 0) = product of these
//! P <- Phi (P + Q_a) Phiᵀ + Q_b                              covariance of what rounding left
//! ```
//!
//! The motion is known at the beginning, middle and end of each step h, whatever made it; h follows the steepest pull J met in a step, `h sqrt(J) = 0.45`.  Few
//! coordinates carry the whole matrix, with da by the Jacobian; more of them two vectors, whose growth stands for that of the matrix, with da by differences,
//! (a(q + e dq, w + e dw) - a(q, w)) / e.

use super::Ruler;
use crate::dynamics::kernel::Kernel;
use crate::dynamics::{Coordinates, Mechanism, Motion, State, Time};
use crate::run::march::{Problem, tangent_form};
use crate::stabilization::projection::project;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Coordinates up to which the whole matrix is carried.
const WHOLE: usize = 3;
/// Vectors carried for more of them.
const VECTORS: usize = 2;
/// Step over the fastest rate, squared rates being the entries of da/dq: beside runs, and where the whole matrix is asked for.
const REACH: [f64; 2] = [0.45, 0.3];
/// The difference taken, relative to 1 rad and the fastest rate.
const DIFFERENCE: f64 = 1e-7;
/// Of half a unit in the last place of 1, what a step of the series leaves: its state is a pair, and so are its constants.
const ROUNDED: f64 = 0.1 * 1.1e-16;
/// Times at which the growth is kept.
const KEPT: usize = 256;
/// Growth \[ln\] within the second half of the time from which on a motion counts as chaotic; a regular one's is that of a power of the time.
const CHAOTIC: f64 = 4.0;
/// Blocks the uncertainty of the exponent is taken from.
const BLOCKS: usize = 8;

/// The flow, on the way.
pub struct Tangent {
    problem: Box<dyn Problem>,
    weights: Vec<f64>,
    path: Path,
    /// Rate at the beginning of the step, in its middle, and at its end.
    rates: [Vec<f64>; 3],
    scratch: Scratch,
}

/// Room for a step.
#[derive(Default)]
struct Scratch {
    /// A point beside another, and the rate there.
    moved: Vec<f64>,
    beside: Vec<f64>,
    from: Vec<f64>,
    slopes: [Vec<f64>; 4],
    /// Columns of the step's own matrix.
    step: Vec<Vec<f64>>,
    half: Vec<f64>,
    /// dy'/dy at the beginning of the step, in its middle, and at its end (d × d each); and whether the first one is there.
    jacobians: [Vec<f64>; 3],
    knows_first: bool,
}

/// All that what follows depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Path {
    /// Beginning of the step under way \[s\], its length, and the unknowns there and in its middle.
    time: f64,
    step: f64,
    start: Vec<f64>,
    middle: Vec<f64>,
    /// About the fastest rate \[rad/s\]: what rates are divided by to be compared with angles; and the step over it.
    rate: f64,
    span: f64,
    /// Columns of Phi(t, 0) over exp(log), those of rates times `rate`; or the vectors.
    columns: Vec<Vec<f64>>,
    log: f64,
    /// Covariance of rounding, row by row; empty where there is no matrix.
    covariance: Vec<f64>,
    steps: u64,
    /// Times and the logarithm of the growth, thinned out.
    growth: Vec<[f64; 2]>,
    stride: u64,
    seen: u64,
    /// The largest norm of the rows of positions of Phi so far.
    reach: f64,
}

impl Tangent {
    /// The flow from a motion; `None` for mechanisms with walls, and those too large for matrices.
    pub fn new(mechanism: &Arc<Mechanism>, motion: &Motion, until: f64) -> Option<Self> {
        Self::of(mechanism, motion, until, WHOLE, REACH[0])
    }

    /// The same with the whole matrix to two digits and more, whatever that costs.
    pub fn whole(mechanism: &Arc<Mechanism>, motion: &Motion, until: f64) -> Option<Self> {
        Self::of(mechanism, motion, until, usize::MAX, REACH[1])
    }

    fn of(mechanism: &Arc<Mechanism>, motion: &Motion, until: f64, whole: usize, span: f64) -> Option<Self> {
        let mut tangent = Self::bare(mechanism)?;
        let f = tangent.weights.len();
        let state = tangent.problem.state(motion);
        let time = motion.time.hi;
        tangent.problem.rate(motion.time, &state.y, &mut tangent.rates[0]);
        tangent.path.rate = 1.0;
        let mut most = 0.0_f64;
        let mut found = vec![0.0; 2 * f];
        for j in 0..f {
            let column: Vec<f64> = (0..2 * f).map(|i| f64::from(i == j)).collect();
            tangent.derivative(0, motion.time, &state.y, &column, &mut found);
            // Positions count over the mechanism's size, as they do in the estimate.
            most = (0..f).fold(most, |most, i| most.max((found[f + i] * tangent.weights[i] / tangent.weights[j]).abs()));
        }
        // At the start there may be no force to be felt yet.
        let rates = state.y[f..2 * f].iter().zip(&tangent.weights);
        let turning = rates.fold(0.0, |most: f64, (rate, weight)| most.max((rate * weight).abs()));
        let rate = most.sqrt().max(turning).max(mechanism.tree.fastest_rate(&[])).max(10.0 / until.max(f64::MIN_POSITIVE));
        let columns = if mechanism.has_multipliers() {
            (0..VECTORS).map(|k| tangent.slide(mechanism, &state, k, rate)).collect()
        } else if f > whole {
            (0..VECTORS).map(|k| scattered(2 * f, k)).map(|column| scaled(column, f, rate)).collect()
        } else {
            (0..2 * f).map(|j| unit(j, f, rate)).collect::<Vec<_>>()
        };
        let covariance = if columns.len() == 2 * f { vec![0.0; 4 * f * f] } else { Vec::new() };
        tangent.path = Path {
            time,
            step: (span / rate).min(until / 16.0),
            span,
            start: state.y,
            middle: Vec::new(),
            rate,
            columns,
            log: 0.0,
            covariance,
            steps: 0,
            growth: vec![[time, 0.0]],
            stride: 1,
            seen: 0,
            reach: 0.0,
        };
        let norm = tangent.norm();
        tangent.path.columns.iter_mut().flatten().for_each(|entry| *entry /= norm);
        tangent.path.log = libm::log(norm);
        tangent.path.growth[0][1] = tangent.path.log;
        Some(tangent)
    }

    /// Without a path.
    fn bare(mechanism: &Arc<Mechanism>) -> Option<Self> {
        if !mechanism.contacts.is_empty() || !mechanism.tree.is_dense() {
            return None;
        }
        let problem = tangent_form(mechanism);
        let ruler = Ruler::new(mechanism);
        let weights: Vec<f64> = match problem.coordinates() {
            Coordinates::Independent => mechanism.ties.independent.iter().map(|&k| ruler.weight(k)).collect(),
            _ => (0..mechanism.coordinates()).map(|k| ruler.weight(k)).collect(),
        };
        let rates = std::array::from_fn(|_| vec![0.0; problem.dimension()]);
        let path = Path {
            time: 0.0,
            step: 0.0,
            start: Vec::new(),
            middle: Vec::new(),
            rate: 1.0,
            span: REACH[0],
            columns: Vec::new(),
            log: 0.0,
            covariance: Vec::new(),
            steps: 0,
            growth: Vec::new(),
            stride: 1,
            seen: 0,
            reach: 0.0,
        };
        let room = || vec![0.0; 2 * weights.len()];
        let scratch =
            Scratch { beside: vec![0.0; problem.dimension()], from: room(), slopes: std::array::from_fn(|_| room()), ..Scratch::default() };
        (!weights.is_empty()).then(|| Self { rates, scratch, weights, problem, path })
    }

    /// Goes on from a path; `None` where it cannot be one of this mechanism.
    pub(super) fn resume(mechanism: &Arc<Mechanism>, path: Path) -> Option<Self> {
        let tangent = Self::bare(mechanism)?;
        let (f, dimension) = (tangent.weights.len(), tangent.problem.dimension());
        let count = path.columns.len();
        let fits = path.start.len() == dimension
            && (path.middle.is_empty() || path.middle.len() == dimension)
            && count > 0
            && path.columns.iter().all(|column| column.len() == 2 * f)
            && path.covariance.len() == if count == 2 * f { 4 * f * f } else { 0 }
            && path.step > 0.0
            && path.span > 0.0
            && path.stride > 0
            && !path.growth.is_empty();
        fits.then_some(Self { path, ..tangent })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The next time \[s\] at which it asks for the motion.
    pub fn next(&self) -> f64 {
        let Path { time, step, middle, .. } = &self.path;
        time + if middle.is_empty() { 0.5 * step } else { *step }
    }

    /// Takes the motion at [`Tangent::next`], to which `steps` steps in doubles have led so far (none where their rounding does not count).
    pub fn take(&mut self, motion: &Motion, steps: u64) {
        let State { y, .. } = self.problem.state(motion);
        if self.path.middle.is_empty() {
            self.path.middle = y;
        } else {
            self.step(y, steps);
        }
    }

    /// True where the whole matrix is carried.
    fn is_whole(&self) -> bool {
        self.path.columns.len() == 2 * self.weights.len()
    }

    /// What a step costs in evaluations of the equations, about; of a Jacobian four columns come to five.
    pub fn evaluations(&self) -> u64 {
        let columns = self.path.columns.len() as u64;
        if self.is_whole() { 1 + 10 * columns.div_ceil(4) } else { 3 + 4 * columns }
    }

    /// Phi(t, 0) column by column, in unknowns as they are \[rad, rad/s\]; of two vectors only, where there is no matrix.
    pub fn columns(&self) -> Vec<Vec<f64>> {
        let f = self.weights.len();
        let grown = libm::exp(self.path.log);
        let is_whole = self.is_whole();
        let size = |j: usize| if is_whole && j >= f { grown / self.path.rate } else { grown };
        self.path.columns.iter().enumerate().map(|(j, column)| column.iter().map(|entry| entry * size(j)).collect()).collect()
    }

    /// Standard deviation of the largest coordinate that rounding has left \[rad\]; zero where there is no matrix to tell it.
    pub fn rounding(&self) -> f64 {
        let (f, covariance) = (self.weights.len(), &self.path.covariance);
        let deviation = |i: usize| covariance[i * 2 * f + i].sqrt() * self.weights[i];
        if covariance.is_empty() { 0.0 } else { (0..f).map(deviation).fold(0.0, f64::max) }
    }

    /// What a change of 1 in every constant and start comes to in a position, about: the largest norm of the rows of positions of Phi(t, 0) so far.
    pub fn reach(&self) -> f64 {
        self.path.reach
    }

    /// Natural logarithm of the growth so far.
    pub fn growth(&self) -> f64 {
        self.path.log
    }

    /// The time reached \[s\], and the natural logarithm of the growth there.
    pub(super) fn now(&self) -> [f64; 2] {
        [self.path.time, self.path.log]
    }

    /// Growth \[ln\] against time, thinned out; the last one is that of now.
    pub(super) fn history(&self) -> Vec<[f64; 2]> {
        let mut history = self.path.growth.clone();
        if history.last().is_some_and(|last| last[0] < self.path.time) {
            history.push(self.now());
        }
        history
    }

    /// V' in `found`: `at` 0…2 says which of the rates and Jacobians kept belongs to (t, y).
    fn derivative(&mut self, at: usize, t: Time, y: &[f64], column: &[f64], found: &mut [f64]) {
        let f = self.weights.len();
        found[..f].copy_from_slice(&column[f..2 * f]);
        if self.is_whole() {
            let rows = self.scratch.jacobians[at].chunks_exact(y.len()).skip(f);
            for (found, row) in found[f..].iter_mut().zip(rows) {
                *found = row.iter().zip(column).fold(0.0, |sum, (slope, entry)| sum + slope * entry);
            }
            return;
        }
        let largest = (0..f).fold(0.0, |most: f64, i| {
            most.max(column[i].abs() * self.weights[i]).max(column[f + i].abs() * self.weights[i] / self.path.rate)
        });
        if largest == 0.0 || !largest.is_finite() {
            found.fill(if largest == 0.0 { 0.0 } else { f64::NAN });
            return;
        }
        let small = DIFFERENCE / largest;
        let Self { scratch: Scratch { moved, beside, .. }, rates, problem, .. } = self;
        moved.clear();
        moved.extend_from_slice(y);
        for i in 0..2 * f {
            moved[i] += small * column[i];
        }
        problem.rate(t, moved, beside);
        for i in f..2 * f {
            found[i] = (beside[i] - rates[at][i]) / small;
        }
    }

    /// What [`Tangent::derivative`] asks for at the three points of a step.
    fn prepare(&mut self, times: [Time; 3], points: &[Vec<f64>; 3]) {
        let is_whole = self.is_whole();
        let Self { problem, rates, scratch: Scratch { jacobians, knows_first, .. }, .. } = self;
        problem.rate(times[0], &points[0], &mut rates[0]);
        if !is_whole {
            (1..3).for_each(|k| problem.rate(times[k], &points[k], &mut rates[k]));
            return;
        }
        jacobians.swap(0, 2);
        for k in usize::from(*knows_first)..3 {
            jacobians[k].resize(points[k].len() * points[k].len(), 0.0);
            problem.jacobian(times[k], &points[k], &mut jacobians[k]);
        }
        *knows_first = true;
    }

    /// A step that ends with the unknowns `end`.
    fn step(&mut self, end: Vec<f64>, steps: u64) {
        let f = self.weights.len();
        let (h, t) = (self.path.step, self.path.time);
        let times = [t, t + 0.5 * h, t + h].map(Time::from);
        let points = [std::mem::take(&mut self.path.start), std::mem::take(&mut self.path.middle), end];
        self.prepare(times, &points);
        let is_whole = self.is_whole();
        let rate = self.path.rate;
        let mut steepest = 0.0_f64;
        let size = |column: &[f64]| column.iter().fold(0.0, |most: f64, entry| most.max(entry.abs()));
        let mut moved = std::mem::take(&mut self.scratch.step);
        moved.resize_with(self.path.columns.len(), || vec![0.0; 2 * f]);
        let (mut from, mut slopes) = (std::mem::take(&mut self.scratch.from), std::mem::take(&mut self.scratch.slopes));
        for (j, column) in moved.iter_mut().enumerate() {
            if is_whole {
                column.fill(0.0);
                column[j] = if j < f { 1.0 } else { rate };
            } else {
                column.copy_from_slice(&self.path.columns[j]);
            }
            from.copy_from_slice(column);
            for (k, (point, ahead)) in [(0, 0.0), (1, 0.5 * h), (1, 0.5 * h), (2, h)].into_iter().enumerate() {
                let (before, rest) = slopes.split_at_mut(k);
                if let Some(before) = before.last() {
                    for i in 0..2 * f {
                        column[i] = from[i] + ahead * before[i];
                    }
                }
                self.derivative(point, times[point], &points[point], column, &mut rest[0]);
                steepest = steepest.max(size(&rest[0][f..]) / size(&column[..f]).max(size(&column[f..]) / rate));
            }
            for i in 0..2 * f {
                column[i] = from[i] + h / 6.0 * (slopes[0][i] + 2.0 * (slopes[1][i] + slopes[2][i]) + slopes[3][i]);
            }
        }
        (self.scratch.from, self.scratch.slopes) = (from, slopes);
        let taken = steps.saturating_sub(self.path.steps) as f64;
        self.path.steps = steps;
        if is_whole {
            self.round(&moved, &points[0][f..2 * f], h, taken);
            self.multiply(&moved);
        } else {
            std::mem::swap(&mut self.path.columns, &mut moved);
        }
        self.scratch.step = moved;
        let norm = self.norm();
        self.path.columns.iter_mut().flatten().for_each(|entry| *entry /= norm);
        self.path.log += libm::log(norm);
        let [_, _, end] = points;
        self.path.start = end;
        self.path.time = t + h;
        let wanted = self.path.span / steepest.sqrt();
        self.path.step = if wanted.is_nan() { h } else { wanted.clamp(0.5 * h, 2.0 * h).min(2.0 * self.path.span / rate) };
        self.keep();
    }

    /// Phi(t, 0) after a step, from Phi of the step.
    fn multiply(&mut self, step: &[Vec<f64>]) {
        let f = self.weights.len();
        let rate = self.path.rate;
        let from = &mut self.scratch.from;
        for column in &mut self.path.columns {
            from.copy_from_slice(column);
            column.fill(0.0);
            for (j, part) in step.iter().enumerate() {
                // Columns of rates are those of `rate` times 1.
                let share = if j < f { from[j] } else { from[j] / rate };
                for i in 0..2 * f {
                    column[i] += share * part[i];
                }
            }
        }
    }

    /// The covariance after a step of `h` \[s\], in which the series took `taken` steps.
    fn round(&mut self, step: &[Vec<f64>], v: &[f64], h: f64, taken: f64) {
        let f = self.weights.len();
        let n = 2 * f;
        let rate = self.path.rate;
        let phi = |i: usize, j: usize| if j < f { step[j][i] } else { step[j][i] / rate };
        let mut before = std::mem::take(&mut self.path.covariance);
        for i in 0..f {
            before[i * n + i] += taken * (0.35 * ROUNDED).powi(2);
        }
        let half = &mut self.scratch.half;
        half.resize(n * n, 0.0);
        for i in 0..n {
            for j in 0..n {
                half[i * n + j] = (0..n).map(|k| phi(i, k) * before[k * n + j]).sum();
            }
        }
        for i in 0..n {
            for j in 0..n {
                before[i * n + j] = (0..n).map(|k| half[i * n + k] * phi(j, k)).sum();
            }
        }
        // Of the series' steps, of which there are this many in `h`.
        let each = if taken > 0.0 { h / taken } else { 0.0 };
        for i in 0..f {
            let pulls: f64 = (0..f).map(|j| (phi(f + i, j) / h).abs()).sum();
            let acceleration = self.rates[0][f + i].abs();
            let span = each.min(2.0 / pulls.sqrt().max(f64::MIN_POSITIVE));
            before[i * n + i] += taken * (0.175 * ROUNDED * each * v[i]).powi(2);
            let (force, sum) = (0.035 * ROUNDED * span * (pulls + acceleration), 0.05 * ROUNDED * span * acceleration);
            before[(f + i) * n + f + i] += taken * (force * force + sum * sum);
        }
        self.path.covariance = before;
    }

    /// Size of the columns: positions, and rates over the fastest one.
    fn norm(&self) -> f64 {
        let f = self.weights.len();
        let Path { columns, rate, .. } = &self.path;
        let squares = columns.iter().map(|column| {
            (0..f).map(|i| ((column[i] * self.weights[i]).powi(2)) + (column[f + i] * self.weights[i] / rate).powi(2)).sum::<f64>()
        });
        squares.sum::<f64>().sqrt()
    }

    /// Keeps the growth at this time.
    fn keep(&mut self) {
        let f = self.weights.len();
        let is_whole = self.is_whole();
        let size = |j: usize, column: &Vec<f64>| {
            let share = if is_whole && j >= f { 1.0 / self.path.rate } else { 1.0 };
            (0..f).map(|i| (share * column[i] * self.weights[i]).powi(2)).sum::<f64>()
        };
        let positions = self.path.columns.iter().enumerate().map(|(j, column)| size(j, column)).sum::<f64>().sqrt();
        self.path.reach = self.path.reach.max(positions * libm::exp(self.path.log.min(700.0)));
        self.path.seen += 1;
        if !self.path.seen.is_multiple_of(self.path.stride) {
            return;
        }
        if self.path.growth.len() == KEPT {
            let mut keep = false;
            self.path.growth.retain(|_| {
                keep = !keep;
                keep
            });
            self.path.stride *= 2;
            if !self.path.seen.is_multiple_of(self.path.stride) {
                return;
            }
        }
        self.path.growth.push([self.path.time, self.path.log]);
    }

    /// A small displacement along the rows: of a vector put back onto them.
    fn slide(&mut self, mechanism: &Mechanism, state: &State, k: usize, rate: f64) -> Vec<f64> {
        let f = self.weights.len();
        let column = scaled(scattered(2 * f, k), f, rate);
        let small = 1e-6;
        let mut kernel = Kernel::new(mechanism);
        let (mut moved, mut still) = (state.clone(), state.clone());
        for i in 0..2 * f {
            moved.y[i] += small * column[i];
        }
        let done = [&mut moved, &mut still].map(|state| project(mechanism, &mut kernel, state, 1e-9).is_ok());
        if done != [true; 2] {
            return column;
        }
        let slid: Vec<f64> = (0..2 * f).map(|i| (moved.unknown(i) - still.unknown(i)).hi / small).collect();
        if slid.iter().any(|&entry| entry != 0.0) { slid } else { column }
    }
}

/// The largest exponent \[1/s\] from the growth against time, its standard error and the time it is of \[s\]; `None` where that is the growth of a regular motion.
pub(super) fn exponent(history: &[[f64; 2]]) -> Option<super::Lyapunov> {
    let ([begin, first], [end, last]) = (*history.first()?, *history.last()?);
    let at = |t: f64| {
        let after = history.partition_point(|point| point[0] < t).clamp(1, history.len() - 1);
        let ([t0, g0], [t1, g1]) = (history[after - 1], history[after]);
        g0 + (g1 - g0) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0)
    };
    if history.len() < 2 * BLOCKS || !last.is_finite() || last - at(0.5 * (begin + end)) < CHAOTIC {
        return None;
    }
    let span = (end - begin) / BLOCKS as f64;
    let rates: Vec<f64> = (0..BLOCKS).map(|k| (at(begin + (k + 1) as f64 * span) - at(begin + k as f64 * span)) / span).collect();
    let exponent = (last - first) / (end - begin);
    let spread = rates.iter().map(|rate| (rate - exponent).powi(2)).sum::<f64>() / (BLOCKS - 1) as f64;
    Some(super::Lyapunov { exponent, uncertainty: (spread / BLOCKS as f64).sqrt(), until: end })
}

/// 1 in coordinate `j`, or `rate` in a rate.
fn unit(j: usize, f: usize, rate: f64) -> Vec<f64> {
    let size = if j < f { 1.0 } else { rate };
    (0..2 * f).map(|i| if i == j { size } else { 0.0 }).collect()
}

/// A vector of no particular direction.
fn scattered(length: usize, k: usize) -> Vec<f64> {
    (0..length).map(|i| 0.5 + (0.618_033_988_749_895 * (i + 1) as f64 + 0.414_213_562_373_095 * (k * (i + 2)) as f64).fract()).collect()
}

/// With its rates scaled.
fn scaled(mut column: Vec<f64>, f: usize, rate: f64) -> Vec<f64> {
    column[f..].iter_mut().for_each(|entry| *entry *= rate);
    column
}
