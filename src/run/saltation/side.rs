//! One side of what happens at a moment: a state, its accelerations, and derivatives along columns there.

use super::Column;
use crate::arithmetic::DoubleDouble;
use crate::dynamics::constraint::Posture;
use crate::dynamics::kernel::{Bias, Kernel, dot};
use crate::dynamics::{Mechanism, Motion};

/// Half of the longest difference: of a coordinate \[rad, m\], of a rate over its size, or of time \[s\].
const DIFFERENCE: f64 = 1e-3;
/// Offsets and weights of a derivative of the fourth order.
const STENCIL: [[f64; 2]; 4] = [[-2.0, 1.0 / 12.0], [-1.0, -2.0 / 3.0], [1.0, 2.0 / 3.0], [2.0, -1.0 / 12.0]];

/// A state in plain doubles, with its accelerations.
pub(in crate::run) struct Side {
    pub motion: Motion,
    pub phi: Vec<f64>,
    pub omega: Vec<f64>,
    pub acceleration: Vec<f64>,
}

/// Coordinates and rates in plain doubles.
pub(in crate::run) fn plain(motion: &Motion) -> [Vec<f64>; 2] {
    [&motion.phi, &motion.omega].map(|all| all.iter().map(|x| x.hi).collect())
}

/// Finer differences are each by this factor shorter than the one before, as many at most.
const FINER: f64 = 1.0 / 8.0;
const LEVELS: usize = 6;
/// Two differences agree where they are apart by less than this share of themselves, or by so many units in
/// the last place of the values they are of.
const AGREE: f64 = 1e-10;
const UNITS: f64 = 64.0;

impl Side {
    pub fn new(mechanism: &Mechanism, motion: &Motion) -> Self {
        let mut side = Self::resting(motion);
        let mut kernel = Kernel::<f64>::new(mechanism);
        kernel.accelerate::<0>(mechanism, motion.time, &side.phi, &side.omega, Bias::default());
        side.acceleration = kernel.load;
        side
    }

    /// The same without accelerations.
    pub fn resting(motion: &Motion) -> Self {
        let [phi, omega] = plain(motion);
        Self { motion: motion.clone(), acceleration: Vec::new(), phi, omega }
    }

    /// The motion itself as a column: rates, then accelerations.
    pub fn ahead(&self) -> Vec<f64> {
        [&self.omega[..], &self.acceleration[..]].concat()
    }

    /// The derivative of a function of the motion along a column, and so much time \[s\] with it, by
    /// differences of at most `share`; `None` where there is no such function.
    ///
    /// Where the function changes fast the differences become finer, until two of them agree; where no two
    /// do, the finer of the two that are nearest to each other is taken, value by value.
    pub fn slope(
        &self,
        column: &[f64],
        late: f64,
        share: f64,
        value: &mut dyn FnMut(&Motion) -> Option<Vec<f64>>,
    ) -> Option<Vec<f64>> {
        let (along, rates) = column.split_at(self.phi.len());
        let largest = |most: f64, x: f64| most.max(x.abs());
        let rates = rates.iter().zip(&self.omega).map(|(x, rate)| x / (1.0 + rate.abs()));
        let most = along.iter().copied().chain(rates).fold(late.abs(), largest);
        let mut h = if most > 0.0 { DIFFERENCE.min(share) / most } else { 1.0 };
        // What it is to move along, over the size of what moves: that is rounded too.
        let far = self.phi.iter().copied().fold(self.motion.time.hi.abs(), largest);
        let place = if most > 0.0 { far / most } else { 0.0 };
        let (mut before, _) = self.difference(column, late, h, value)?;
        let mut found = before.clone();
        // How far apart the nearest two differences of each value are that have none that agree.
        let mut apart = vec![Some(f64::INFINITY); found.len()];
        for _ in 1..LEVELS {
            h *= FINER;
            let (here, sizes) = self.difference(column, late, h, value)?;
            for (k, (&now, &last)) in here.iter().zip(&before).enumerate() {
                let Some(least) = apart[k] else { continue };
                let off = (now - last).abs();
                let rounding = UNITS * f64::EPSILON * (sizes[k] + last.abs() * place) / h;
                if off <= AGREE * last.abs() + rounding {
                    (found[k], apart[k]) = (last, None);
                } else if off < least {
                    (found[k], apart[k]) = (now, Some(off));
                }
            }
            if apart.iter().all(Option::is_none) {
                break;
            }
            before = here;
        }
        Some(found)
    }

    /// The same by one difference of a length, and the sizes of the values it is of.
    fn difference(
        &self,
        column: &[f64],
        late: f64,
        h: f64,
        value: &mut dyn FnMut(&Motion) -> Option<Vec<f64>>,
    ) -> Option<(Vec<f64>, Vec<f64>)> {
        let n = self.phi.len();
        let (mut sum, mut sizes): (Vec<f64>, Vec<f64>) = Default::default();
        let mut beside = self.motion.clone();
        for [offset, weight] in STENCIL {
            let moved = |to: &mut [DoubleDouble], from: &[f64], by: &[f64]| {
                for (to, (x, y)) in to.iter_mut().zip(from.iter().zip(by)) {
                    *to = DoubleDouble::from(x + offset * h * y);
                }
            };
            moved(&mut beside.phi, &self.phi, &column[..n]);
            moved(&mut beside.omega, &self.omega, &column[n..]);
            beside.time = self.motion.time + offset * h * late;
            let values = value(&beside)?;
            sum.resize(values.len(), 0.0);
            sizes.resize(values.len(), 0.0);
            for (k, value) in values.into_iter().enumerate() {
                sum[k] += weight / h * value;
                sizes[k] = sizes[k].max(value.abs());
            }
        }
        Some((sum, sizes))
    }

    /// The rate of the gap of a wall \[m/s\], and its derivatives by the coordinates, zero on entry.
    pub(super) fn gap_rate(&self, mechanism: &Mechanism, contact: usize, gradient: &mut [f64]) -> f64 {
        let z = mechanism.elements(&self.phi);
        let at = Posture { phi: &self.phi, z: &z, omega: &self.omega };
        let here = mechanism.contacts[contact].row.linearise(self.motion.time, at, gradient);
        dot(gradient, &self.omega) + here.drive
    }

    /// How much later \[s\] a column meets a wall whose gap has these derivatives by the coordinates and by
    /// time.
    pub(super) fn late(
        &self,
        mechanism: &Mechanism,
        contact: usize,
        (gradient, rate): (&[f64], f64),
        column: &Column,
    ) -> f64 {
        let gap = |mechanism: &Mechanism| {
            let z = mechanism.elements(&self.phi);
            mechanism.contacts[contact].distance(self.motion.time, &self.phi, &z)
        };
        let mut change = dot(gradient, &column.entries[..self.phi.len()]);
        if !column.neighbours.is_empty() {
            let here = gap(mechanism);
            let moved = |(weight, neighbour): &super::Weighted| weight * (gap(neighbour) - here);
            change += column.neighbours.iter().map(moved).sum::<f64>();
        }
        -change / rate
    }
}
