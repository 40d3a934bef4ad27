//! The series of a step as polynomials: how far they reach, and their values inside the step.

use super::motion::{DigitsMotion, LongState};
use crate::arithmetic::Complex;
use crate::arithmetic::Scalar;
use crate::arithmetic::digits::{Digits, sum_of_products};
use crate::arithmetic::sum::larger;
use crate::dynamics::friction::FrictionMode;
use crate::dynamics::impact::Contact;

/// log2 of the part of the tolerance, over the energy scale, that work may be off by in a step.
const WORK: f64 = 10.0;
/// Powers the step is taken from: by symmetry some of them may vanish.
pub(super) const JUDGES: usize = 5;
/// log2 of how many times larger terms may be than what they sum up to, where zeros are told in doubles.
pub(super) const CANCELS: f64 = 12.0;
/// The first power of a gap that constant accelerations do not have.
const BENDS: usize = 3;

impl<const W: usize> DigitsMotion<W> {
    /// log2 of the largest of power k of the rates.
    fn size(&self, k: usize) -> f64 {
        let f = self.state.u.len();
        let sizes = self.series.rate[k * f..(k + 1) * f].iter().map(Digits::log2);
        sizes.fold(f64::NEG_INFINITY, larger)
    }

    /// The step at which the last powers fall below the tolerance \[s\].
    pub(super) fn wanted(&self) -> f64 {
        let (order, first) = (self.precision.order, self.size(0).max(0.0));
        let mut least = f64::INFINITY;
        for k in order + 1 - JUDGES..=order {
            let size = self.size(k);
            if size.is_nan() {
                return f64::NAN;
            }
            least = least.min((self.precision.tolerance() + first - size) / k as f64);
        }
        // The work of a force is a product, and may converge later than its factors; a force of friction has
        // the root of a normal force in it.
        let allowed = self.precision.tolerance() + WORK + libm::log2(self.mechanism.structure.energy_scale);
        let allows = |least: f64, powers: &[Digits<W>]| {
            let last = powers.iter().enumerate().skip(order - JUDGES);
            last.fold(least, |least, (k, power)| least.min((allowed - power.log2()) / (k + 1) as f64))
        };
        if self.mechanism.structure.has_work_integral() {
            least = allows(least, &self.series.power);
        }
        libm::exp2(allows(least, self.series.lost()).min(self.holds_allow()).min(self.gaps_allow()))
    }

    /// log2 of the step at which the last powers of the gaps of walls fall below the tolerance, over the
    /// lengths of their contacts, and in which their terms do not cancel.  Where rates do not depend on
    /// angles, as in free flight, gaps alone tell how fast bodies turn; so do they of the laws that walls
    /// move by.
    fn gaps_allow(&self) -> f64 {
        let allows = |(powers, contact): (&Vec<Digits<W>>, &Contact)| {
            let unit = libm::log2(contact.length);
            let last = powers.len().saturating_sub(JUDGES);
            let allowed = |(k, power): (usize, &Digits<W>)| {
                let tolerance = if k < last { CANCELS } else { self.precision.tolerance() };
                (tolerance + unit - power.log2()) / k as f64
            };
            let least = powers.iter().enumerate().skip(BENDS).map(allowed);
            least.filter(|least| !least.is_nan()).fold(f64::INFINITY, f64::min)
        };
        self.gaps.iter().zip(&self.mechanism.structure.contacts).map(allows).fold(f64::INFINITY, f64::min)
    }

    /// log2 of the step at which the last powers fall below the tolerance of the forces that hold: on points
    /// at walls, and of what sticks with its normal force.  Their zeros and limits let go, and at rest they
    /// alone change.
    fn holds_allow(&self) -> f64 {
        let (structure, LongState { acting, .. }) = (&self.mechanism.structure, &self.state);
        let walls = acting.held.iter().map(|&wall| structure.contacts[wall].force);
        let sticks = |(_, mode): &(usize, &FrictionMode<_>)| matches!(mode, FrictionMode::Stick(_));
        let sticks = acting.sliding.iter().enumerate().filter(sticks);
        let units = walls.chain(sticks.map(|(place, _)| self.friction_unit(place)));
        let units: Vec<f64> = units.map(libm::log2).collect();
        if units.is_empty() {
            return f64::INFINITY;
        }
        let (order, own) =
            (self.precision.order, libm::log2(structure.energy_scale / structure.size_of_parts()));
        let allows = |k: usize| {
            // Their rows are the last ones.
            let forces = self.series.multipliers(k).iter().rev().zip(units.iter().rev());
            let normals = self.series.sticks().filter_map(|normal| {
                let [first, last] = [normal.first()?, normal.get(k)?];
                let size = |force: &Complex<Digits<W>>| larger(force.re.log2(), force.im.log2());
                Some(size(last) - larger(size(first), own))
            });
            let sizes = forces.map(|(force, unit)| force.log2() - unit).chain(normals);
            (self.precision.tolerance() - sizes.fold(f64::NEG_INFINITY, larger)) / k as f64
        };
        (order - JUDGES..order).map(allows).filter(|least| !least.is_nan()).fold(f64::INFINITY, f64::min)
    }

    /// True where no power was kept to fewer limbs than it weighs in a step of this length.
    pub(super) fn is_enough(&self, step: f64) -> bool {
        let (kept, first) = (&self.kept, self.size(0).max(0.0));
        let log_step = libm::log2(step);
        let far = |m: usize, size: f64| {
            let weight = size + m as f64 * log_step;
            weight - 64.0 * (kept[m] - 1) as f64 > self.precision.tolerance()
        };
        let far_gap = |(powers, contact): (&Vec<Digits<W>>, &Contact)| {
            let unit = libm::log2(contact.length);
            powers.iter().enumerate().skip(1).any(|(m, power)| far(m, power.log2() - unit))
        };
        !(0..=self.precision.order).any(|m| far(m, self.size(m) - first))
            && !self.gaps.iter().zip(&self.mechanism.structure.contacts).any(far_gap)
    }

    /// Coordinates, rates, and the work done and the energy lost in friction since the state's time at a time
    /// after that.
    pub(super) fn evaluate(&self, h: Digits<W>) -> (Vec<Digits<W>>, Vec<Digits<W>>, [Digits<W>; 2]) {
        let f = self.state.u.len();
        let [powers, integrals] = self.powers_of(h);
        let rates: Vec<_> = (0..f).map(|c| self.sum(&self.series.rate[c..], f, &powers)).collect();
        let moved = |(c, &u): (usize, &Digits<W>)| u + self.sum(&self.series.rate[c..], f, &integrals);
        let u = self.state.u.iter().enumerate().map(moved).collect();
        let work = if self.mechanism.structure.has_work_integral() {
            self.sum(&self.series.power, 1, &integrals)
        } else {
            Digits::ZERO
        };
        (u, rates, [work, self.sum(self.series.lost(), 1, &integrals)])
    }

    /// h^m and h^(m+1)/(m+1), with as many limbs as power m is kept to.
    fn powers_of(&self, h: Digits<W>) -> [Vec<Digits<W>>; 2] {
        let (mut powers, mut integrals) = (Vec::new(), Vec::new());
        let mut power = Digits::ONE;
        for (m, &kept) in self.kept.iter().enumerate() {
            power = power.shortened(kept.min(self.precision.limbs));
            let next = power * h;
            powers.push(power);
            integrals.push(next.over_whole(m as u64 + 1));
            power = next;
        }
        [powers, integrals]
    }

    /// Σ a_m b_m of every `stride`-th number of a series: powers that are kept to as many limbs are summed
    /// up together.
    fn sum(&self, series: &[Digits<W>], stride: usize, factors: &[Digits<W>]) -> Digits<W> {
        let (mut sum, mut last) = (Digits::ZERO, series.len().div_ceil(stride));
        for alike in factors[..last].chunk_by(|a, b| a.limbs() == b.limbs()).rev() {
            let first = last - alike.len();
            // A sum has the limbs of its shortest term.
            let limbs = alike[0].limbs();
            let powers: Vec<_> = series[first * stride..]
                .iter()
                .step_by(stride)
                .zip(alike)
                .map(|(a, _)| a.shortened(limbs))
                .collect();
            let part = sum_of_products(powers.iter().zip(alike)).shortened(self.precision.limbs);
            (sum, last) = (part + sum.shortened(self.precision.limbs), first);
        }
        sum
    }
}
