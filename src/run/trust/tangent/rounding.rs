//! What rounding of a series' steps leaves, carried along by the tangent flow.

use super::{Path, ROUNDED, TangentFlow};

/// The same of mechanisms without a matrix, whose series keep no pairs; fitted on chains of five and eight
/// bars.
const COARSE: f64 = 8.0 * ROUNDED;

impl TangentFlow {
    /// The covariance after a step of `h` \[s\], in which the series took `taken` steps; the columns of the
    /// step's own matrix are in `seeds`.
    pub(super) fn round(&mut self, h: f64, taken: f64) {
        let f = self.weights.len();
        let n = 2 * f;
        // Where the rounding of the series does not count there is none.
        if taken == 0.0 && self.path.covariance.iter().all(|&entry| entry == 0.0) {
            return;
        }
        let Self { seeds, rates, path: Path { rate, covariance, state, .. }, .. } = self;
        let phi = |i: usize, j: usize| if j < f { seeds[j][i] } else { seeds[j][i] / *rate };
        for i in 0..f {
            covariance[i * n + i] += taken * (0.35 * ROUNDED).powi(2);
        }
        let mut half = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..n {
                half[i * n + j] = (0..n).map(|k| phi(i, k) * covariance[k * n + j]).sum();
            }
        }
        for i in 0..n {
            for j in 0..n {
                covariance[i * n + j] = (0..n).map(|k| half[i * n + k] * phi(j, k)).sum();
            }
        }
        // Of the series' steps, of which there are this many in `h`.
        let each = if taken > 0.0 { h / taken } else { 0.0 };
        for i in 0..f {
            let pulls: f64 = (0..f).map(|j| (phi(f + i, j) / h).abs()).sum();
            let acceleration = rates[f + i].abs();
            let [turn, push] = left(ROUNDED, each, state.y[f + i], pulls, acceleration);
            covariance[i * n + i] += taken * turn;
            covariance[(f + i) * n + f + i] += taken * push;
        }
    }

    /// The same where there is no matrix: one variance of all positions, and rates over the fastest one,
    /// which grows as the columns, whose size was `before`.
    pub(super) fn scatter(&mut self, h: f64, taken: f64, before: f64) {
        let f = self.weights.len();
        let each = if taken > 0.0 { h / taken } else { 0.0 };
        let rate = self.path.rate;
        let mut added = 0.0;
        for i in 0..f {
            let acceleration = self.rates[f + i].abs();
            let [turn, push] =
                left(COARSE, each, self.path.state.y[f + i], rate * rate / self.weights[i], acceleration);
            added += self.weights[i].powi(2)
                * (turn + (0.35 * COARSE / self.weights[i]).powi(2) + push / (rate * rate));
        }
        let grown = self.norm(&self.path.columns) / before;
        self.path.covariance[0] = self.path.covariance[0] * grown * grown + taken * added;
    }
}

/// Variances of a position and a rate after one step, where 1 is rounded to `unit`.
fn left(unit: f64, each: f64, rate: f64, pulls: f64, acceleration: f64) -> [f64; 2] {
    let span = each.min(2.0 / pulls.sqrt().max(f64::MIN_POSITIVE));
    let (force, sum) = (0.035 * unit * span * (pulls + acceleration), 0.05 * unit * span * acceleration);
    [(0.175 * unit * each * rate).powi(2), force * force + sum * sum]
}
