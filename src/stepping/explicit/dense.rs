//! The dense output of a step, for the search for events in it.

use super::super::Statistics;
use super::super::event::{Dense, SearchScratch, Stride};
use super::{EmbeddedPair, Explicit, NESTED};
use crate::dynamics::{OdeSystem, State};

/// Shares of a step at which the rate of a quadrature is compared, not near nodes.
const CHECKED: [f64; 2] = [0.44, 0.72];

/// The largest value of what the last coefficient is that of: a polynomial that is zero, and smallest by far,
/// at both ends of the step.
pub(super) fn highest<P: EmbeddedPair>() -> f64 {
    let (low, high) = (P::DEGREE / 2, P::DEGREE.div_ceil(2));
    let [s, t] = [low, high].map(|power| power as f64 / P::DEGREE as f64);
    libm::pow(s, low as f64) * libm::pow(t, high as f64)
}

/// `c_1 + (1-s) (c_2 + s (c_3 + …))`.
pub(super) fn nest(nested: &[f64], s: f64) -> f64 {
    nested.iter().enumerate().rev().fold(0.0, |sum, (m, c)| c + if m % 2 == 0 { 1.0 - s } else { s } * sum)
}

/// Powers of `s (c_1 + (1-s) (c_2 + s (c_3 + …)))` after the constant one.
pub(super) fn expand(nested: &[f64], powers: &mut [f64]) {
    powers.fill(0.0);
    for (m, c) in nested.iter().enumerate().rev() {
        // c + (1-s) p, or c + s p.
        for k in (1..powers.len()).rev() {
            powers[k] = if m % 2 == 0 { powers[k] - powers[k - 1] } else { powers[k - 1] };
        }
        powers[0] = if m % 2 == 0 { powers[0] } else { 0.0 } + c;
    }
}

impl<P: EmbeddedPair> Explicit<P> {
    /// Coefficients of the interpolation of an unknown in the step just made.
    pub(super) fn nested_powers(&self, from: &State, h: f64, i: usize) -> [f64; NESTED] {
        let n = from.y.len();
        let change = (self.next[i] - from.y[i]) + (self.next_low[i] - from.low[i]);
        P::interpolate(h, change, &|stage| self.k[stage * n + i])
    }

    /// What the step just tried may be off by, over the tolerance.
    pub(super) fn error<F: OdeSystem + ?Sized>(
        &mut self,
        field: &mut F,
        state: &State,
        h: f64,
        statistics: &mut Statistics,
    ) -> f64 {
        let error = P::error(h, &self.k, &self.scale).sqrt();
        match field.rough_quadrature() {
            Some(i) if error <= 1.0 => error.max(self.quadrature_error(field, state, (h, i), statistics)),
            _ => error,
        }
    }

    /// What a quadrature may be off by in the step just tried, over its tolerance: its rate inside the step
    /// less the slope of its interpolation.  The rules of a pair may agree by chance on a rate with a corner.
    fn quadrature_error<F: OdeSystem + ?Sized>(
        &mut self,
        field: &mut F,
        state: &State,
        (h, i): (f64, usize),
        statistics: &mut Statistics,
    ) -> f64 {
        self.evaluate_extra_stages(field, state, h, statistics);
        let n = state.y.len();
        let all: Vec<_> = (0..n).map(|i| self.nested_powers(state, h, i)).collect();
        let mut powers = [0.0; NESTED];
        expand(&all[i][..P::DEGREE], &mut powers[..P::DEGREE]);
        let (mut inside, mut rate, mut error) = (vec![0.0; n], vec![0.0; n], 0.0_f64);
        for share in CHECKED {
            for ((inside, y), nested) in inside.iter_mut().zip(&state.y).zip(&all) {
                *inside = y + share * nest(&nested[..P::DEGREE], share);
            }
            field.rhs(state.time + share * h, &inside, &mut rate);
            let slope = powers.iter().enumerate().rev();
            let slope = slope.fold(0.0, |sum, (m, power)| sum * share + (m + 1) as f64 * power);
            error = error.max((slope - h * rate[i]).abs() / self.scale[i]);
        }
        statistics.evaluations += CHECKED.len() as u64;
        error
    }
}

impl<P: EmbeddedPair, F: OdeSystem + ?Sized> Stride<F> for Explicit<P> {
    fn dense(
        &mut self,
        field: &mut F,
        state: &State,
        h: f64,
        dense: &mut Dense,
        statistics: &mut Statistics,
    ) {
        self.evaluate_extra_stages(field, state, h, statistics);
        dense.begin(field.watched(), P::DEGREE + 1, state);
        let most = self.highest;
        for (i, (powers, off)) in dense.each().enumerate() {
            let nested = self.nested_powers(state, h, i);
            expand(&nested[..P::DEGREE], &mut powers[1..]);
            *off = most * nested[P::DEGREE - 1].abs();
        }
    }

    /// As s² (1-s)² over its largest value.
    fn off(share: f64) -> f64 {
        let bell = 4.0 * share * (1.0 - share);
        bell * bell
    }

    fn repeat(&mut self, field: &mut F, state: &State, h: f64, statistics: &mut Statistics) -> bool {
        self.attempt(field, state, h, statistics);
        true
    }

    fn end(&self) -> (&[f64], &[f64]) {
        let n = self.next.len();
        (&self.next, &self.k[P::STAGES * n..(P::STAGES + 1) * n])
    }

    fn search(&mut self) -> &mut SearchScratch {
        &mut self.search
    }
}
