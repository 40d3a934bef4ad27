//! What is known of an output up to a time.

use super::{CONSTANT, MARGIN, PASSED};
use crate::arithmetic::DoubleDouble;
use crate::stepping::search::{Chebyshev, Nodes};
use serde::{Deserialize, Serialize};

/// What is known of one output so far.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Found {
    pub min: [f64; 2],
    pub max: [f64; 2],
    pub integral: DoubleDouble,
    pub square: DoubleDouble,
}

impl Default for Found {
    fn default() -> Self {
        Self {
            min: [f64::INFINITY, 0.0],
            max: [f64::NEG_INFINITY, 0.0],
            integral: DoubleDouble::default(),
            square: DoubleDouble::default(),
        }
    }
}

impl Found {
    /// True where a curve that is known well enough stays well between the extremes, or is `rounding` as they
    /// are.
    pub fn holds(&self, curve: &Chebyshev, rounding: f64) -> bool {
        let ([lowest, highest], size) = (curve.range(), curve.most());
        if self.min[0].is_nan() {
            return true;
        }
        if size <= rounding && self.min[0] <= rounding && self.max[0] >= -rounding {
            return true;
        }
        let is_constant = highest - lowest <= CONSTANT * size;
        // The value of a constant is known to its last digits only.
        let margin = if is_constant { -4.0 * CONSTANT } else { MARGIN } * size;
        curve.tail() <= PASSED * size && lowest - margin > self.min[0] && highest + margin < self.max[0]
    }

    /// Adds the integrals over a step of an interpolant and of its square.
    pub fn sum_up(&mut self, curve: &Chebyshev, nodes: &Nodes, values: &[f64], span: f64) {
        self.integral += DoubleDouble::product(curve.integral(), span);
        let square = nodes.integral(values.iter().map(|value| value * value));
        self.square += DoubleDouble::product(square, span);
    }

    /// Takes a value at a time.
    pub fn see(&mut self, value: f64, t: f64) {
        if value < self.min[0] {
            self.min = [value, t];
        }
        if value > self.max[0] {
            self.max = [value, t];
        }
    }

    /// What it comes to is not known any more.
    pub fn forget(&mut self) {
        (self.min, self.max) = ([f64::NAN; 2], [f64::NAN; 2]);
    }

    /// Mean and root of the mean square over so long a time \[s\].
    pub fn means(&self, span: f64) -> [f64; 2] {
        let known = [self.integral.hi / span, (self.square.hi / span).clamp(0.0, f64::INFINITY).sqrt()];
        let [mean, rms] = match [self.min[0], self.max[0]].map(f64::is_finite) {
            [true, true] => known,
            [true, false] if self.max[0] > 0.0 => [f64::INFINITY; 2],
            [false, true] if self.min[0] < 0.0 => [f64::NEG_INFINITY, f64::INFINITY],
            _ if self.min[0].is_nan() => [f64::NAN; 2],
            _ => [f64::NAN, f64::INFINITY],
        };
        // Where an integral over what is without bound may be finite, it is not known.
        [if known[0].is_nan() { f64::NAN } else { mean }, if known[1].is_nan() { f64::NAN } else { rms }]
    }
}
