//! What functions of the motion change by: the magnitude of those that stay at zero, and their rounding.

use crate::arithmetic::DoubleDouble;
use crate::dynamics::{Mechanism, Motion};

/// Part of a unit by which coordinates and rates are moved.
const BESIDE: f64 = 1.0 / 1024.0;

/// What each of some functions changes by where one coordinate or rate moves by a unit, at most; as if it did
/// so evenly.
pub(super) fn changes(
    mechanism: &Mechanism,
    motion: &Motion,
    mut values: impl FnMut(&Motion) -> Vec<f64>,
) -> Vec<f64> {
    let (angles, units) = (mechanism.bodies.len(), mechanism.units);
    let here = values(motion);
    let mut changes = vec![0.0_f64; here.len()];
    for k in 0..motion.phi.len() {
        let unit = if k < angles { 1.0 } else { units.length };
        for (is_rate, unit) in [(false, unit), (true, unit / units.time)] {
            let mut beside = motion.clone();
            let number = if is_rate { &mut beside.omega[k] } else { &mut beside.phi[k] };
            *number += DoubleDouble::from(BESIDE * unit);
            for ((change, here), there) in changes.iter_mut().zip(&here).zip(values(&beside)) {
                *change = change.max(((there - here) / BESIDE).abs());
            }
        }
    }
    changes
}

/// Units in the last place by which coordinates and rates are moved.
const DIGITS: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];

/// What the last digit of each coordinate and rate does to some functions, at most: their rounding, where
/// large numbers cancel as well.
pub(super) fn last_digits(motion: &Motion, mut values: impl FnMut(&Motion) -> Vec<f64>) -> Vec<f64> {
    let here = values(motion);
    let mut changes = vec![0.0_f64; here.len()];
    for k in 0..motion.phi.len() {
        for (digits, is_rate) in DIGITS.iter().flat_map(|digits| [(digits, false), (digits, true)]) {
            let mut beside = motion.clone();
            let number = if is_rate { &mut beside.omega[k] } else { &mut beside.phi[k] };
            *number += DoubleDouble::from(digits * f64::EPSILON * number.hi);
            for ((change, here), there) in changes.iter_mut().zip(&here).zip(values(&beside)) {
                *change = change.max((there - here).abs());
            }
        }
    }
    changes
}
