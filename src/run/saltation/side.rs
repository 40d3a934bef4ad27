//! One side of what happens at a moment: a state, its accelerations, and derivatives along columns there.

use super::Delta;
use super::finer::{Difference, agreeing};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::constraint::ConstraintArguments;
use crate::dynamics::kernel::{Bias, Kernel, dot};
use crate::dynamics::{Mechanism, Motion};

/// Angle by which the fastest coordinate turns until a rate that is zero has a size \[rad\].
const SOON: f64 = 0.01;
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
    /// Rotors of integrals, whose angles nothing depends on.
    rotors: std::ops::Range<usize>,
}

/// Finer differences are each by this factor shorter than the one before, as many at most.
const FINER: f64 = 1.0 / 8.0;
const LEVELS: usize = 6;

impl Side {
    pub fn new(mechanism: &Mechanism, motion: &Motion) -> Self {
        let mut side = Self::resting(mechanism, motion);
        let mut kernel = Kernel::<f64>::new(mechanism);
        kernel.accelerations(mechanism, motion.time, &side.phi, &side.omega, Bias::default());
        side.acceleration = kernel.load;
        side
    }

    /// The same without accelerations.
    pub fn resting(mechanism: &Mechanism, motion: &Motion) -> Self {
        let [phi, omega] = motion.rounded();
        Self { motion: motion.clone(), acceleration: Vec::new(), phi, omega, rotors: mechanism.rotors() }
    }

    /// The motion itself as a column: rates, then accelerations.
    pub fn ahead(&self) -> Vec<f64> {
        [&self.omega[..], &self.acceleration[..]].concat()
    }

    /// The derivative of a function of the motion along a column, and so much time \[s\] with it, by
    /// differences of at most `share` that become finer [until two agree](agreeing); `None` where there is no
    /// such function.
    pub fn slope(
        &self,
        column: &[f64],
        late: f64,
        share: f64,
        value: &mut dyn FnMut(&Motion) -> Option<Vec<f64>>,
    ) -> Option<Vec<f64>> {
        let (along, rates) = column.split_at(self.phi.len());
        let largest = |most: f64, x: f64| most.max(x.abs());
        // A rate that passes through zero is as large as it soon becomes beside the fastest one.
        let own = |k: &usize| !self.rotors.contains(k);
        let fastest = (0..self.omega.len()).filter(own).map(|k| self.omega[k]).fold(1.0, largest);
        let by = self.acceleration.iter().map(|by| SOON * by.abs() / fastest).chain(std::iter::repeat(0.0));
        let sizes = self.omega.iter().zip(by).map(|(rate, by)| 1.0 + rate.abs() + by);
        let rates = rates.iter().zip(sizes).map(|(x, size)| x / size);
        let angles = (0..along.len()).filter(own).map(|k| along[k]);
        let most = angles.chain(rates).fold(late.abs(), largest);
        let longest = if most > 0.0 { DIFFERENCE.min(share) / most } else { 1.0 };
        // What it is to move along, over the size of what moves: that is rounded too.
        let far = self.phi.iter().copied().fold(self.motion.time.hi.abs(), largest);
        let place = if most > 0.0 { far / most } else { 0.0 };
        agreeing(LEVELS, |level| {
            let h = longest * f64::powi(FINER, level as i32);
            Some(Difference::of(self.beside(column, late, h, value)?, &[], place / h))
        })
        .map(|agreed| agreed.slopes)
    }

    /// Values at the places of a difference of a length, with their weights.
    fn beside(
        &self,
        column: &[f64],
        late: f64,
        h: f64,
        value: &mut dyn FnMut(&Motion) -> Option<Vec<f64>>,
    ) -> Option<Vec<(f64, Vec<f64>)>> {
        let n = self.phi.len();
        let mut beside = self.motion.clone();
        let mut at = |[offset, weight]: [f64; 2]| {
            let moved = |to: &mut [DoubleDouble], from: &[f64], by: &[f64]| {
                for (to, (x, y)) in to.iter_mut().zip(from.iter().zip(by)) {
                    *to = DoubleDouble::from(x + offset * h * y);
                }
            };
            moved(&mut beside.phi, &self.phi, &column[..n]);
            moved(&mut beside.omega, &self.omega, &column[n..]);
            beside.time = self.motion.time + offset * h * late;
            Some((weight / h, value(&beside)?))
        };
        STENCIL.into_iter().map(&mut at).collect()
    }

    /// The rate of the gap of a wall \[m/s\], and its derivatives by the coordinates, zero on entry.
    pub(in crate::run) fn gap_rate(
        &self,
        mechanism: &Mechanism,
        contact: usize,
        gradient: &mut [f64],
    ) -> f64 {
        let z = mechanism.elements(&self.phi);
        let at = ConstraintArguments { phi: &self.phi, z: &z, omega: &self.omega };
        let here = mechanism.contacts[contact].row.linearise(self.motion.time, at, gradient);
        dot(gradient, &self.omega) + here.drive
    }

    /// How much later \[s\] a column meets a wall whose gap has these derivatives by the coordinates and by
    /// time.
    pub(in crate::run) fn late(
        &self,
        mechanism: &Mechanism,
        contact: usize,
        (gradient, rate): (&[f64], f64),
        column: &Delta,
    ) -> f64 {
        let gap = |mechanism: &Mechanism| {
            let z = mechanism.elements(&self.phi);
            mechanism.contacts[contact].distance(self.motion.time, &self.phi, &z)
        };
        let mut change = dot(gradient, &column.entries[..self.phi.len()]);
        if let Some(moved) = column.moved(&[gap(mechanism)], |neighbour| Some(vec![gap(neighbour)])) {
            change += moved[0];
        }
        -change / rate
    }
}
