//! Where a tangent flow begins: its unit of rates, and directions to begin with.

use super::{TangentFlow, beside};
use crate::dynamics::Coordinates;

impl TangentFlow {
    /// About the fastest rate at the start \[rad/s\].
    pub(super) fn fastest(&mut self, until: f64) -> f64 {
        let f = self.weights.len();
        let mut dice = Dice(7);
        let mut columns: Vec<Vec<f64>> = (0..f.min(6)).map(|j| self.turned(j, &mut dice)).collect();
        self.path.rate = 1.0;
        let Self { mechanism, ground, weights, path, .. } = self;
        if let Some(ground) = ground {
            ground.keep(mechanism, &path.state, columns.iter_mut());
        }
        let mut squared = 0.0_f64;
        for (count, mut series) in beside::room(mechanism, self.coordinates, beside::ORDERS[0], columns.len())
        {
            let some: Vec<Vec<f64>> = columns.drain(..count).collect();
            series.expand(mechanism, &path.state, &some);
            squared = squared.max(series.pull(weights));
        }
        // At the start there may be no force to be felt yet.
        let rates = path.state.y[f..2 * f].iter().zip(&*weights);
        let turning = rates.fold(0.0, |most: f64, (rate, weight)| most.max((rate * weight).abs()));
        let fastest = squared.sqrt().max(turning).max(mechanism.tree.fastest_rate(&[]));
        let slowest = 1.0 / until.max(f64::MIN_POSITIVE);
        if fastest.is_finite() { fastest.max(slowest) } else { slowest }
    }

    /// A direction of positions only.
    fn turned(&self, j: usize, dice: &mut Dice) -> Vec<f64> {
        let f = self.weights.len();
        let entry = |i: usize, dice: &mut Dice| if f <= 6 { f64::from(i == j) } else { dice.normal() };
        (0..2 * f).map(|i| if i < f { entry(i, dice) / self.weights[i] } else { 0.0 }).collect()
    }

    /// So many directions tangent to the constraints, at right angles to each other.
    pub(super) fn basis(&mut self, count: usize, dice: &mut Dice) -> Vec<Vec<f64>> {
        let f = self.weights.len();
        let Self { mechanism, ground, path, weights, .. } = self;
        let size = |i: usize| if i < f { 1.0 / weights[i] } else { path.rate / weights[i - f] };
        let mut basis: Vec<Vec<f64>> =
            (0..count).map(|_| (0..2 * f).map(|i| dice.normal() * size(i)).collect()).collect();
        if let Some(ground) = ground {
            ground.keep(mechanism, &path.state, basis.iter_mut());
        }
        let scale = |i: usize| size(i).recip().powi(2);
        let product = |a: &[f64], b: &[f64]| (0..2 * f).map(|i| a[i] * b[i] * scale(i)).sum::<f64>();
        for j in 0..count {
            // Twice is enough.
            for k in (0..j).chain(0..j) {
                let (before, rest) = basis.split_at_mut(j);
                let share = product(&before[k], &rest[0]);
                rest[0].iter_mut().zip(&before[k]).for_each(|(entry, other)| *entry -= share * other);
            }
            let norm = product(&basis[j], &basis[j]).sqrt();
            basis[j].iter_mut().for_each(|entry| *entry /= norm);
        }
        basis
    }

    /// Relative changes of 1 in the numbers of the start, of random signs.
    pub(super) fn changes(&mut self, count: usize, dice: &mut Dice) -> Vec<Vec<f64>> {
        let f = self.weights.len();
        let Self { mechanism, ground, path, .. } = self;
        let mut columns: Vec<Vec<f64>> =
            (0..count).map(|_| path.state.y[..2 * f].iter().map(|y| dice.sign() * y).collect()).collect();
        if let Some(ground) = ground {
            ground.keep(mechanism, &path.state, columns.iter_mut());
        }
        columns
    }

    /// A column in all coordinates and rates.
    pub(super) fn spread(&self, column: &[f64]) -> Vec<f64> {
        let f = self.weights.len();
        if self.coordinates != Coordinates::Independent {
            return column[..2 * f].to_vec();
        }
        let partition = &self.mechanism.partition.bodies;
        let half = |from: usize| {
            partition
                .iter()
                .map(move |dependent_angle| dependent_angle.base.map_or(0.0, |base| column[from + base]))
        };
        half(0).chain(half(f)).collect()
    }
}

/// 1 in coordinate `j`, or `rate` in a rate.
pub(super) fn unit(j: usize, f: usize, rate: f64) -> Vec<f64> {
    let size = if j < f { 1.0 } else { rate };
    (0..2 * f).map(|i| if i == j { size } else { 0.0 }).collect()
}

/// Numbers of no particular kind, the same in every run.  Source: S. Vigna, *splitmix64*.
pub(super) struct Dice(pub u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// 1 or -1.
    pub fn sign(&mut self) -> f64 {
        if self.next() >> 63 == 0 { 1.0 } else { -1.0 }
    }

    /// About normally distributed.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| (self.next() >> 11) as f64 / (1_u64 << 53) as f64).sum::<f64>() - 6.0
    }
}
