//! The tangent flow along a motion: how small differences grow.
//!
//! ```text
//! V' = (dq', dw') = (dw, da),    da = A_q dq + A_w dw
//!     columns of V expanded beside the motion on dual numbers (module `beside`)
//! G dq = 0,  (G w + C_t)' (dq, dw) = 0                       kept after every step (module `ground`)
//! Phi(t, 0) = product of the steps' matrices
//!     through impacts by the saltation matrix (module `impact`)
//! P <- Phi (P + Q_a) Phiᵀ + Q_b                              covariance of what rounding left
//! s <- Phi s + h (σ a)
//!     what a relative change of every force by 1, of random sign, and of the start comes to
//! ```
//!
//! The motion is that of the reference solution at the flow's own times, the ends of its steps.  Up to three
//! coordinates that nothing ties carry the whole matrix, few degrees of freedom a basis of the directions
//! tangent to the constraints, more of them vectors of random directions, whose growth stands for that of the
//! matrix.
//!
//! Where neighbours do not go the same way there is no such flow: where a wall is grazed, and in singular
//! positions.  From there on it is absent.

mod begin;
mod beside;
mod gauss;
mod ground;
mod impact;
mod numbers;
mod record;
mod rounding;
mod start;

use self::beside::ColumnsBeside;
use self::gauss::TangentGauss;
pub(in crate::run) use self::gauss::eliminate;
pub(in crate::run) use self::ground::Ground;
use self::numbers::{ParameterEffects, ParameterPowers};
use self::start::{Dice, unit};
use super::budget::FRICTION;
use crate::dynamics::schur::NEAR;
use crate::dynamics::{Coordinates, Mechanism, Motion, State, Time};
use crate::run::build::Problem;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Coordinates up to which the whole matrix is carried.
const WHOLE: usize = 3;
/// Vectors carried for more of them, and directions of changed inputs.
const VECTORS: usize = 3;
const INPUTS: [usize; 2] = [4, 1];
/// The longest step over the slowest of the rates it is measured by.
const LONGEST: f64 = 10.0;
/// Of half a unit in the last place of 1, what a step of the series leaves: its state is a pair, and so are
/// its constants.
const ROUNDED: f64 = 0.1 * 1.1e-16;
/// The shortest step, over the time of the fastest rate.
const SHORTEST: f64 = 1e-7;

/// The flow, on the way.
pub struct TangentFlow {
    /// The mechanism with the contacts held at the moment, and its unknowns.
    mechanism: Arc<Mechanism>,
    problem: Box<dyn Problem>,
    coordinates: Coordinates,
    weights: Vec<f64>,
    series: Vec<(usize, Box<dyn ColumnsBeside>)>,
    gauss: TangentGauss,
    ground: Option<Ground>,
    /// The parameters that events set, and what those do in which neighbours differ.
    set: Vec<usize>,
    parameters: Vec<ParameterPowers>,
    /// The columns the series are of.
    seeds: Vec<Vec<f64>>,
    rates: Vec<f64>,
    /// Room for a Jacobian, and for a column.
    jacobian: Vec<f64>,
    column: Vec<f64>,
    path: Path,
}

/// All that what follows depends on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Path {
    /// The beginning of the step under way, its length \[s\], and the contacts held.
    state: State,
    step: f64,
    held: Vec<usize>,
    /// Motors and locks that engaged on the way, by row.
    engaged: Vec<usize>,
    /// Degrees of freedom at the start.
    freedom: usize,
    /// About the fastest rate \[rad/s\]: what rates are divided by to be compared with angles.
    rate: f64,
    /// Columns of Phi(t, 0) over exp(log), those of rates times `rate`; or the vectors.  Behind the rates are
    /// the parameters that events set.
    columns: Vec<Vec<f64>>,
    log: f64,
    /// True where the columns are those of the whole matrix, and where the step's own comes from Jacobians
    /// (module `gauss`).
    is_whole: bool,
    is_plain: bool,
    /// Accelerations by coordinates and rates at the nodes so far, one after the other.
    nodes: Vec<f64>,
    /// Highest power of the series on dual numbers.
    order: usize,
    /// What changed inputs come to, over exp(input_log).
    inputs: Vec<Vec<f64>>,
    input_log: f64,
    /// Covariance of rounding, row by row; where there is no matrix, one variance.
    covariance: Vec<f64>,
    steps: u64,
    /// Times, the logarithm of the growth, and that of what changed inputs came to at most, thinned out.
    growth: Vec<[f64; 3]>,
    stride: u64,
    seen: u64,
    reach: f64,
    /// When columns were taken through something last, and how much later \[s\] each comes to it: while that
    /// moment lasts, and no checkpoint is within one.
    #[serde(skip)]
    moment: Option<(Time, Vec<f64>)>,
    /// Why the flow ended.
    lost: Option<String>,
}

impl TangentFlow {
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The next time \[s\] at which it asks for the motion.
    pub fn next(&self) -> f64 {
        let Path { state, step, is_plain, .. } = &self.path;
        let share = if *is_plain { self.gauss.nodes.get(self.node()).copied().unwrap_or(1.0) } else { 1.0 };
        (state.time + share * step).hi
    }

    /// The same, or `until`, where that comes before: the flow of a plain mechanism has no shorter steps than
    /// those under way.
    pub(super) fn next_within(&mut self, until: f64) -> f64 {
        let Path { state, step, nodes, is_plain, .. } = &mut self.path;
        if *is_plain && nodes.is_empty() {
            *step = step.min((Time::from(until) - state.time).hi);
        }
        self.next().min(until)
    }

    /// Why the flow has ended, where it has.
    pub fn lost(&self) -> Option<&str> {
        self.path.lost.as_deref()
    }

    /// Takes the motion at [`TangentFlow::next`], to which `steps` steps in doubles have led so far (none
    /// where their rounding does not count).
    pub fn take(&mut self, motion: &Motion, steps: u64) {
        if self.path.is_plain && !self.take_node(motion) {
            return;
        }
        let state = self.problem.state(motion);
        let taken = steps.saturating_sub(self.path.steps) as f64;
        self.path.steps = steps;
        match self.path.is_plain {
            // The last node is near enough to the end for what else is asked of it.
            true => self.step(
                self.path.step,
                State { time: self.path.state.time + self.path.step, ..state },
                taken,
            ),
            false => self.advance(motion.time, Some(state), taken),
        }
    }

    /// To [`TangentFlow::next`] along the motion of its own series.
    pub(super) fn go_alone(&mut self) {
        self.advance(Time::from(self.next()), None, 0.0);
    }

    /// The number of the next node.
    fn node(&self) -> usize {
        self.path.nodes.len() / (2 * self.weights.len().pow(2))
    }

    /// Takes the Jacobian at a node; true with the last one, which tells the length of the next step.
    fn take_node(&mut self, motion: &Motion) -> bool {
        let (f, node) = (self.weights.len(), self.node());
        let Self { mechanism, problem, path, weights, gauss, jacobian, column, .. } = self;
        let dimension = problem.dimension();
        column.clear();
        column.resize(dimension, 0.0);
        for (i, &k) in mechanism.partition.independent.iter().enumerate() {
            (column[i], column[f + i]) = (motion.phi[k].hi, motion.omega[k].hi);
        }
        jacobian.resize(dimension * dimension, 0.0);
        problem.jacobian(motion.time, column, jacobian);
        for row in jacobian.chunks_exact(dimension).skip(f).take(f) {
            path.nodes.extend(&row[..2 * f]);
        }
        let is_last = node + 1 == gauss::STAGES;
        if is_last {
            let reach = gauss::reach(f, weights, &path.nodes[node * 2 * f * f..], &column[f..]);
            gauss.next = reach.clamp(0.5 * path.step, 2.0 * path.step).min(LONGEST / path.rate);
        }
        is_last
    }

    /// Unknowns' rates at the beginning of the step.
    fn evaluate(&mut self) {
        let Self { problem, rates, path, .. } = self;
        problem.rhs(path.state.time, &path.state.y, rates);
    }

    /// What taking a motion costs in evaluations of the equations, about, by counted instructions; of a
    /// Jacobian four columns come to five.
    pub fn evaluations(&self) -> u64 {
        if self.path.is_plain {
            return 1 + 5 * self.path.columns.len().div_ceil(4) as u64;
        }
        // Of the prices of `budget`: the series at this order, and the columns beside it, which are worked on
        // by vectors.
        let (n, rows) = (self.mechanism.coordinates() as f64, self.mechanism.constraints.len() as f64);
        let forces = (self.mechanism.springs.len()
            + self.mechanism.torsions.len()
            + self.mechanism.actions.len()
            + self.mechanism.forces.len()) as f64;
        let friction = FRICTION.map(|price| price * self.mechanism.frictions.len() as f64);
        let series = 700.0 + 400.0 * n + 150.0 * n * n + 700.0 * (rows + forces) + friction[1];
        let evaluation = 15.0 + 20.0 * n + 4.0 * n * n + 60.0 * rows + 20.0 * forces + friction[0];
        (0.2 * series * (1.0 + 0.75 * self.seeds.len() as f64) / evaluation) as u64
    }

    /// Phi(t, 0) column by column, in all coordinates and rates as they are \[rad, m, rad/s, m/s\]; of a
    /// basis or of vectors only, where there is no matrix.
    pub fn columns(&self) -> Vec<Vec<f64>> {
        let f = self.weights.len();
        let grown = libm::exp(self.path.log);
        let size = |j: usize| if self.path.is_whole && j >= f { grown / self.path.rate } else { grown };
        let scaled = |(j, column): (usize, &Vec<f64>)| {
            self.spread(column).into_iter().map(|entry| entry * size(j)).collect()
        };
        self.path.columns.iter().enumerate().map(scaled).collect()
    }

    /// Room for the series of all columns.
    fn make_room(&mut self) {
        let Path { columns, inputs, is_whole, .. } = &self.path;
        let count = if *is_whole { columns.len() } else { columns.len() + inputs.len() };
        self.seeds = vec![vec![0.0; 2 * self.weights.len()]; count];
        if self.path.is_plain {
            return;
        }
        self.series = beside::room(&self.mechanism, self.coordinates, self.path.order, count);
    }

    /// Expands the columns about the present state, and chooses the step.
    fn prepare(&mut self) {
        if self.path.is_plain {
            return;
        }
        let Self { path, seeds, mechanism, weights, parameters, .. } = self;
        let f = weights.len();
        for (j, seed) in seeds.iter_mut().enumerate() {
            match path.is_whole {
                true => seed.copy_from_slice(&unit(j, f, path.rate)),
                false => {
                    let column = path.columns.get(j).unwrap_or_else(|| &path.inputs[j - path.columns.len()]);
                    seed.copy_from_slice(&column[..2 * f]);
                }
            }
        }
        let push = ParameterEffects::at(parameters, path, 2 * f);
        let mut first = 0;
        let (mut reach, mut is_near, mut rest) = (LONGEST / path.rate, false, &seeds[..]);
        for (count, series) in &mut self.series {
            let (now, later) = rest.split_at(*count);
            series.expand(mechanism, &path.state, now);
            push.add(first, *count, series.as_mut());
            first += *count;
            is_near = self.ground.is_some() && series.weakest() < NEAR;
            let here = series.reach(weights, is_near);
            reach = if here.is_nan() || reach.is_nan() { f64::NAN } else { reach.min(here) };
            rest = later;
        }
        path.step = reach;
        if reach.is_nan() || reach * self.path.rate < SHORTEST {
            self.lose(match is_near {
                true => "a singular position is too near to tell which way neighbouring motions go",
                false => "small differences are beyond all numbers",
            });
        }
    }

    /// The flow ends at the present time.
    fn lose(&mut self, why: &str) {
        self.path.step = f64::INFINITY;
        self.path.lost = Some(format!("{why}, at t = {} s", self.path.state.time.hi));
    }

    /// On to a time at which the state is known, or follows from the series.
    fn advance(&mut self, until: Time, mut arrived: Option<State>, taken: f64) {
        while self.path.lost.is_none() {
            let left = (until - self.path.state.time).hi;
            if left <= 0.0 {
                break;
            }
            let is_last = self.path.step >= left * (1.0 - 1e-9);
            let h = if is_last { left } else { self.path.step };
            let mut state = self.path.state.clone();
            match arrived.take_if(|_| is_last) {
                Some(arrived) => state = arrived,
                None => self.series[0].1.carry(h, &mut state),
            }
            if is_last {
                state.time = until;
            }
            self.step(h, state, taken * h / left);
        }
    }

    /// A step that ends in a state.
    fn step(&mut self, h: f64, state: State, taken: f64) {
        let mut rest = &mut self.seeds[..];
        for (count, series) in &self.series {
            let (now, later) = rest.split_at_mut(*count);
            series.go(h, now);
            rest = later;
        }
        if self.path.is_plain && !self.collocate(h) {
            return self.lose("small differences are beyond all numbers");
        }
        if self.path.is_whole {
            self.round(h, taken);
            self.multiply();
        } else {
            let before = self.norm(&self.path.columns);
            for (column, seed) in self.path.columns.iter_mut().chain(&mut self.path.inputs).zip(&self.seeds) {
                column[..seed.len()].copy_from_slice(seed);
            }
            self.scatter(h, taken, before);
        }
        self.path.state = state;
        self.keep();
        self.evaluate();
        self.kick(h);
        if self.normalise() {
            self.record();
            self.prepare();
        }
    }

    /// The step's own matrix from the Jacobians at its nodes, and the next step.
    fn collocate(&mut self, h: f64) -> bool {
        let f = self.weights.len();
        let Self { path, seeds, gauss, .. } = self;
        let is_possible = gauss.step(f, h, path.rate, &path.nodes, seeds);
        path.nodes.clear();
        path.step = gauss.next;
        is_possible
    }

    /// Puts the columns back onto the constraints.
    fn keep(&mut self) {
        let Self { mechanism, ground: Some(ground), path: Path { state, columns, inputs, .. }, .. } = self
        else {
            return;
        };
        ground.stand(mechanism, state);
        ground.keep(mechanism, state, columns.iter_mut().chain(inputs));
    }

    /// What changed forces have done in a step.
    fn kick(&mut self, h: f64) {
        let f = self.weights.len();
        let Self { rates, path, .. } = self;
        let size = h * libm::exp(-path.input_log);
        for (k, column) in path.inputs.iter_mut().enumerate() {
            let mut dice = Dice(k as u64 + 100);
            for i in 0..f {
                column[f + i] += dice.sign() * size * rates[f + i];
            }
        }
        let Self { mechanism, ground: Some(ground), path: Path { state, inputs, .. }, .. } = self else {
            return;
        };
        ground.keep(mechanism, state, inputs.iter_mut());
    }

    /// Phi(t, 0) after a step, from Phi of the step.
    fn multiply(&mut self) {
        let f = self.weights.len();
        let Self { path: Path { columns, inputs, rate, .. }, seeds, column: from, .. } = self;
        for column in columns.iter_mut().chain(inputs) {
            from.clear();
            from.append(column);
            column.resize(2 * f, 0.0);
            for (j, part) in seeds.iter().enumerate() {
                // Columns of rates are those of `rate` times 1.
                let share = if j < f { from[j] } else { from[j] / *rate };
                for i in 0..2 * f {
                    column[i] += share * part[i];
                }
            }
        }
    }
}
