//! The stages of a step by simplified Newton: Jacobian, factors, starting values, iteration.

use super::{KEPT, Radau, RadauScratch};
use crate::arithmetic::Complex;
use crate::arithmetic::sum::{fast_two_sum, two_sum};
use crate::dynamics::{OdeSystem, State};
use crate::stepping::Statistics;
use crate::stepping::linear::LuFactors;

/// Contraction from which the iteration counts as diverging.
const DIVERGING: f64 = 0.99;

/// How an iteration ended.
pub enum NewtonEnd {
    /// Its contraction, and the iterations taken.
    Converged(f64, usize),
    /// It would take too long: a factor for the step.
    Slow(f64),
    NotFinite,
}

impl Radau {
    /// The Jacobian and the factors for a step of `h` \[s\], anew where those at hand do not serve; false
    /// where the field has none.
    pub(super) fn linearise<F: OdeSystem + ?Sized>(
        &mut self,
        field: &mut F,
        state: &State,
        h: f64,
        may_renew: bool,
        statistics: &mut Statistics,
    ) -> bool {
        let is_fresh = may_renew && !(self.work.place.0 == state.time && self.work.place.1 == state.y);
        if (is_fresh || self.work.jacobian.is_empty())
            && !self.differentiate(field, is_fresh.then_some(state), statistics)
        {
            return false;
        }
        if self.work.factored != h {
            self.factor(h, state.y.len());
        }
        true
    }

    /// The Jacobian at the state, or again where it was taken before.
    pub(super) fn differentiate<F: OdeSystem + ?Sized>(
        &mut self,
        field: &mut F,
        state: Option<&State>,
        statistics: &mut Statistics,
    ) -> bool {
        let work = &mut self.work;
        if let Some(state) = state {
            work.place.0 = state.time;
            work.place.1.clone_from(&state.y);
            statistics.jacobians += 1;
        }
        let d = work.place.1.len();
        work.jacobian.resize(d * d, 0.0);
        (work.factored, work.longest) = (0.0, None);
        field.jacobian(work.place.0, &work.place.1, &mut work.jacobian)
    }

    /// Factors for steps of `h`.
    pub(super) fn factor(&mut self, h: f64, dimension: usize) {
        let Self { tableau, work, .. } = self;
        work.real.of_shifted(h * tableau.real.value, &work.jacobian, dimension);
        work.pairs.resize_with(tableau.pairs.len(), LuFactors::default);
        for (factors, mode) in work.pairs.iter_mut().zip(tableau.pairs) {
            factors.of_shifted(mode.value.times(h), &work.jacobian, dimension);
        }
        work.factored = h;
    }

    /// Starting values from the polynomial of the last step, of `length`, or from that of the step just made,
    /// `from_start`, which is to be repeated.
    pub(super) fn predict(&mut self, h: f64, length: f64, from_start: bool) {
        let Self { tableau, work, .. } = self;
        let (s, d) = (tableau.stages(), work.stage.len());
        if length == 0.0 {
            work.z.fill(0.0);
            return;
        }
        // The changes are not needed before the first residual.
        work.change.copy_from_slice(if from_start { &work.z } else { &work.last });
        let polynomial = &work.change;
        for i in 0..s {
            let share = tableau.nodes[i].hi * h / length;
            tableau.lagrange(if from_start { share } else { 1.0 + share }, &mut work.weights);
            for k in 0..d {
                let base = if from_start { 0.0 } else { polynomial[(s - 1) * d + k] };
                work.z[i * d + k] =
                    (0..s).fold(-base, |sum, j| sum + work.weights[j] * polynomial[j * d + k]);
            }
        }
    }

    /// Iterates the stages of a step of `h`; the factors for it are in place.
    pub(super) fn solve<F: OdeSystem + ?Sized>(
        &mut self,
        field: &mut F,
        state: &State,
        h: f64,
        contraction: &mut f64,
        statistics: &mut Statistics,
    ) -> NewtonEnd {
        let (s, d) = (self.tableau.stages(), state.y.len());
        let most = if s == 3 { 7 } else { 12 };
        let relative = self.tolerance.relative;
        let enough = (10.0 * f64::EPSILON / relative).max(relative.sqrt().min(0.03));
        let (mut before, mut ratio_before, mut theta) = (f64::NAN, f64::NAN, KEPT);
        *contraction = libm::pow(contraction.max(f64::EPSILON), 0.8);
        for sweep in 1..=most {
            self.residual(field, state, h, statistics);
            self.correct(d);
            let work = &mut self.work;
            let mut sum = 0.0;
            for (i, (z, change)) in work.z.iter_mut().zip(&work.change).enumerate() {
                sum += (change / work.scale[i % d]) * (change / work.scale[i % d]);
                *z += change;
            }
            let size = (sum / (s * d) as f64).sqrt();
            if !size.is_finite() {
                return NewtonEnd::NotFinite;
            }
            if sweep > 1 {
                let ratio = size / before;
                theta = if sweep == 2 { ratio } else { (ratio * ratio_before).sqrt() };
                ratio_before = ratio;
                let converges = theta < DIVERGING;
                if !converges {
                    return if size <= enough * 1e-2 {
                        NewtonEnd::Converged(theta, sweep)
                    } else {
                        NewtonEnd::Slow(0.5)
                    };
                }
                *contraction = theta / (1.0 - theta);
            }
            if *contraction * size <= enough {
                return NewtonEnd::Converged(theta, sweep);
            }
            if sweep > 1 {
                let left = most as f64 - 1.0 - sweep as f64;
                let forecast = *contraction * size * libm::pow(theta, left) / enough;
                if forecast >= 1.0 {
                    return NewtonEnd::Slow(0.8 * libm::pow(forecast.clamp(1e-4, 20.0), -1.0 / (4.0 + left)));
                }
            }
            before = size.max(f64::EPSILON);
        }
        NewtonEnd::Slow(0.5)
    }

    /// h A F - Z into `change`.
    fn residual<F: OdeSystem + ?Sized>(
        &mut self,
        field: &mut F,
        state: &State,
        h: f64,
        statistics: &mut Statistics,
    ) {
        let Self { tableau, work, .. } = self;
        let (s, d) = (tableau.stages(), state.y.len());
        for (i, rates) in work.rates.chunks_exact_mut(d).enumerate() {
            for (k, stage) in work.stage.iter_mut().enumerate() {
                let (sum, rest) = two_sum(state.y[k], work.z[i * d + k]);
                (*stage, work.low[k]) = fast_two_sum(sum, rest + state.low[k]);
            }
            field.fine_rate(state.time + tableau.nodes[i].hi * h, &work.stage, &work.low, rates);
        }
        statistics.evaluations += s as u64;
        for i in 0..s {
            for k in 0..d {
                let sum = (0..s).fold(0.0, |sum, j| sum + tableau.a[i * s + j] * work.rates[j * d + k]);
                work.change[i * d + k] = h * sum - work.z[i * d + k];
            }
        }
    }

    /// The residual in `change` becomes the correction.
    fn correct(&mut self, d: usize) {
        let Self { tableau, work, .. } = self;
        let RadauScratch { change, rates: corrections, mode, wide, real, pairs, .. } = work;
        // The rates have served; their room takes the sum over the modes.
        for k in 0..d {
            mode[k] =
                tableau.real.left.iter().enumerate().fold(0.0, |sum, (i, l)| sum + l * change[i * d + k]);
        }
        real.solve(mode);
        for (i, right) in tableau.real.right.iter().enumerate() {
            for k in 0..d {
                corrections[i * d + k] = right * mode[k];
            }
        }
        for (factors, pair) in pairs.iter().zip(tableau.pairs) {
            for k in 0..d {
                wide[k] = pair
                    .left
                    .iter()
                    .enumerate()
                    .fold(Complex::ZERO, |sum, (i, &l)| sum + l.times(change[i * d + k]));
            }
            factors.solve(wide);
            for (i, right) in pair.right.iter().enumerate() {
                for k in 0..d {
                    corrections[i * d + k] += 2.0 * (right.re * wide[k].re - right.im * wide[k].im);
                }
            }
        }
        std::mem::swap(change, corrections);
    }
}
