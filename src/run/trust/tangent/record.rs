//! The size of the columns, and what is kept of it along the way.

use super::{Path, TangentFlow};

/// Times at which the growth is kept.
const KEPT: usize = 256;

impl TangentFlow {
    /// Standard deviation of the largest coordinate that rounding has left \[rad\].
    pub fn rounding(&self) -> f64 {
        let (f, Path { covariance, columns, .. }) = (self.weights.len(), &self.path);
        if !self.path.is_whole {
            let share =
                |i: usize| columns.iter().map(|column| (column[i] * self.weights[i]).powi(2)).sum::<f64>();
            return (covariance.first().copied().unwrap_or(0.0) * (0..f).map(share).fold(0.0, f64::max))
                .sqrt();
        }
        (0..f).map(|i| covariance[i * 2 * f + i].sqrt() * self.weights[i]).fold(0.0, f64::max)
    }

    /// What a relative change of 1 in every force and number of the start comes to in a position at most, up
    /// to a time \[s\].
    pub fn reach(&self, t: f64) -> f64 {
        let Path { growth, reach, .. } = &self.path;
        match growth.iter().position(|point| point[0] >= t) {
            None => *reach,
            Some(0) => libm::exp(growth[0][2]),
            Some(after) => {
                let ([t0, _, r0], [t1, _, r1]) = (growth[after - 1], growth[after]);
                let share = ((t - t0) / (t1 - t0)).clamp(0.0, 1.0);
                libm::exp(if r0.is_finite() { r0 + share * (r1 - r0) } else { r1 })
            }
        }
    }

    /// The same up to the end of a run, which may lie in the step under way \[s\].
    pub fn reach_ahead(&self, end: f64) -> f64 {
        self.path.reach.max(self.moved((end - self.path.state.time.hi).max(0.0)))
    }

    /// What it comes to so much later \[s\] than the time reached.
    fn moved(&self, later: f64) -> f64 {
        let (f, Path { inputs, input_log, .. }) = (self.weights.len(), &self.path);
        let square = |column: &Vec<f64>| {
            (0..f).map(|i| ((column[i] + later * column[f + i]) * self.weights[i]).powi(2)).sum::<f64>()
        };
        (inputs.iter().map(square).sum::<f64>() / inputs.len() as f64).sqrt()
            * libm::exp(input_log.min(700.0))
    }

    /// Natural logarithm of the growth so far.
    pub fn growth(&self) -> f64 {
        self.path.log
    }

    /// True where it comes from Jacobians.
    pub(in super::super) fn is_plain(&self) -> bool {
        self.path.is_plain
    }

    /// Degrees of freedom at the start.
    pub(in super::super) fn freedom(&self) -> usize {
        self.path.freedom
    }

    /// About the fastest rate \[rad/s\].
    pub(in super::super) fn rate(&self) -> f64 {
        self.path.rate
    }

    /// The time reached \[s\], and the natural logarithm of the growth there.
    pub(in super::super) fn now(&self) -> [f64; 2] {
        [self.path.state.time.hi, self.path.log]
    }

    /// Growth \[ln\] against time, thinned out; the last one is that of now.
    pub(in super::super) fn history(&self) -> Vec<[f64; 2]> {
        let mut history: Vec<[f64; 2]> = self.path.growth.iter().map(|&[t, log, _]| [t, log]).collect();
        if history.last().is_some_and(|last| last[0] < self.path.state.time.hi) {
            history.push(self.now());
        }
        history
    }

    /// Size of columns: positions, and rates over the fastest one.
    pub(super) fn norm(&self, columns: &[Vec<f64>]) -> f64 {
        columns.iter().map(|column| self.square(column)).sum::<f64>().sqrt()
    }

    fn square(&self, column: &[f64]) -> f64 {
        let f = self.weights.len();
        let square = |i: usize| {
            (column[i] * self.weights[i]).powi(2) + (column[f + i] * self.weights[i] / self.path.rate).powi(2)
        };
        (0..f).map(square).sum()
    }

    /// Makes the columns' size one again; false where that cannot be.
    pub(super) fn normalise(&mut self) -> bool {
        let norm = self.norm(&self.path.columns);
        if !(norm > 0.0 && norm.is_finite()) {
            self.lose(if norm == 0.0 {
                "neighbouring motions have become the same"
            } else {
                "small differences are beyond all numbers"
            });
            return false;
        }
        self.path.columns.iter_mut().flatten().for_each(|entry| *entry /= norm);
        self.path.log += libm::log(norm);
        let most = self.norm(&self.path.inputs);
        if most > 1e100 {
            self.path.inputs.iter_mut().flatten().for_each(|entry| *entry /= most);
            self.path.input_log += libm::log(most);
        }
        true
    }

    /// Keeps the growth at this time.
    pub(super) fn record(&mut self) {
        self.path.reach = self.path.reach.max(self.moved(0.0));
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
        self.path.growth.push([self.path.state.time.hi, self.path.log, libm::log(self.path.reach)]);
    }
}
