//! One side of what happens at a moment: a state, its accelerations, and derivatives along columns there.

use super::Column;
use crate::arithmetic::DoubleDouble;
use crate::dynamics::constraint::Posture;
use crate::dynamics::kernel::{Bias, Kernel, dot};
use crate::dynamics::{Mechanism, Motion};

/// Half of the longest difference, over the size of what it changes.
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

/// The largest entry over the size of what it changes.
fn size(of: &[f64], from: &[f64]) -> f64 {
    of.iter().zip(from).fold(0.0, |most: f64, (x, y)| most.max(x.abs() / (1.0 + y.abs())))
}

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
    pub fn slope(
        &self,
        column: &[f64],
        late: f64,
        share: f64,
        value: &mut dyn FnMut(&Motion) -> Option<Vec<f64>>,
    ) -> Option<Vec<f64>> {
        let n = self.phi.len();
        let most = size(&column[..n], &self.phi).max(size(&column[n..], &self.omega)).max(late.abs());
        let h = if most > 0.0 { DIFFERENCE.min(share) / most } else { 1.0 };
        let mut sum: Vec<f64> = Vec::new();
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
            sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight / h * value);
        }
        Some(sum)
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
