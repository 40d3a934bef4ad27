//! Extremes of outputs inside a smooth curve: whether they are such, and their derivatives where the time of
//! one is known to some digits only.
//!
//! ```text
//! y(t*, p), y'(t*, p) = 0:     t* = t - y'/y'',   dy*/dp = Y_p - Y'_p y'/y''      at a time t nearby
//! ```

use super::measure::outputs_at;
use super::neighbours::Neighbour;
use super::variation::{Variation, plain};
use crate::dynamics::kernel::Kernel;
use crate::dynamics::{Mechanism, Motion};
use crate::run::saltation::Side;

/// Slope of an output at an extreme that is none of a smooth curve, over what it would be where the curve
/// comes from one extreme of the run to the other with the curvature found.
const CORNER: f64 = 1e-4;
/// Variation of an output over its size below which it is constant: extremes are no more accurate.
const CONSTANT: f64 = 1e-10;

/// How an output turns round at an extreme.
pub(super) struct ExtremeTurn {
    /// Its second derivative by time.
    curvature: f64,
    /// Derivatives of its rate of change, column by column.
    slopes: Vec<f64>,
}

impl ExtremeTurn {
    /// Of an output, by number, beside a variation at a motion.
    pub fn of(variation: &mut Variation, motion: &Motion, output: usize) -> Self {
        let rate = |mechanism: &Mechanism, moved: &Motion| -> Option<Vec<f64>> {
            let (side, mut kernel) = (Side::new(mechanism, moved), Kernel::new(mechanism));
            let mut beside = |moved: &Motion| {
                let (t, phi, omega) = plain(moved);
                let values = outputs_at(mechanism, &mut kernel, motion, (t, &phi, &omega), &[]);
                values.get(output).map(|&y| vec![y])
            };
            side.slope(&side.ahead(), 1.0, f64::INFINITY, &mut beside)
        };
        let side = Side::new(&variation.mechanism, motion);
        let along = |column: &[f64], late: f64| {
            let mut beside = |moved: &Motion| rate(&variation.mechanism, moved);
            side.slope(column, late, f64::INFINITY, &mut beside).map_or(f64::NAN, |slopes| slopes[0])
        };
        let curvature = along(&side.ahead(), 1.0);
        let slopes = variation.columns.iter().zip(&mut variation.neighbours).map(|(column, neighbours)| {
            let of = |neighbour: &mut Neighbour| rate(&neighbour.mechanism, motion).unwrap_or_default();
            let moved = neighbours.as_mut().and_then(|neighbours| neighbours.derivative(of));
            along(column, 0.0) + moved.and_then(|moved| moved.first().copied()).unwrap_or_default()
        });
        Self { curvature, slopes: slopes.collect() }
    }

    /// Takes derivatives of an output that changes at this rate, and has this range over the run, to the
    /// extreme itself; false where the curve has a corner there.
    pub fn correct(&self, rate: f64, [min, max]: [f64; 2], slopes: &mut [f64]) -> bool {
        let range = max - min;
        if range <= CONSTANT * min.abs().max(max.abs()) || rate == 0.0 {
            return true;
        }
        let early = rate / self.curvature;
        slopes.iter_mut().zip(&self.slopes).for_each(|(slope, moved)| *slope -= early * moved);
        (rate * early).abs() <= CORNER * CORNER * range
    }
}
