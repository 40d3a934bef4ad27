//! What functions of the motion change by: the magnitude of those that stay at zero, and their rounding.

use crate::arithmetic::DoubleDouble;
use crate::dynamics::{Mechanism, Motion};

/// Part of a unit by which coordinates and rates are moved.
const BESIDE: f64 = 1.0 / 1024.0;
/// Units in the last place by which they are moved.
const DIGITS: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];

/// What each of some functions changes by where one coordinate or rate moves by a unit, at most; as if it did
/// so evenly.
pub(super) fn changes(
    mechanism: &Mechanism,
    motion: &Motion,
    values: impl FnMut(&Motion) -> Vec<f64>,
) -> Vec<f64> {
    let (angles, units) = (mechanism.bodies.len(), mechanism.units);
    let shift = |k: usize, is_rate: bool, _| {
        let unit = if k < angles { 1.0 } else { units.length };
        [BESIDE * if is_rate { unit / units.time } else { unit }]
    };
    moved(motion, values, shift).into_iter().map(|change| change / BESIDE).collect()
}

/// What the last digit of each coordinate and rate does to some functions, at most: their rounding, where
/// large numbers cancel as well.
pub(super) fn last_digits(motion: &Motion, values: impl FnMut(&Motion) -> Vec<f64>) -> Vec<f64> {
    moved(motion, values, |_, _, number| DIGITS.map(|digits| digits * f64::EPSILON * number))
}

/// The largest change of each function where one coordinate or rate, by number, is moved by its shifts.
fn moved<const N: usize>(
    motion: &Motion,
    mut values: impl FnMut(&Motion) -> Vec<f64>,
    shifts: impl Fn(usize, bool, f64) -> [f64; N],
) -> Vec<f64> {
    let here = values(motion);
    let mut changes = vec![0.0_f64; here.len()];
    for (k, is_rate) in (0..motion.phi.len()).flat_map(|k| [(k, false), (k, true)]) {
        let number = if is_rate { motion.omega[k] } else { motion.phi[k] };
        for shift in shifts(k, is_rate, number.hi) {
            let mut beside = motion.clone();
            let place = if is_rate { &mut beside.omega[k] } else { &mut beside.phi[k] };
            *place += DoubleDouble::from(shift);
            for ((change, here), there) in changes.iter_mut().zip(&here).zip(values(&beside)) {
                *change = change.max((there - here).abs());
            }
        }
    }
    changes
}
