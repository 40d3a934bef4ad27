//! The dense output of a step, for the search for events in it.

use super::super::Statistics;
use super::super::event::{Dense, SearchScratch, Stride};
use super::Radau;
use super::newton::NewtonEnd;
use crate::dynamics::{OdeSystem, State};

impl<F: OdeSystem + ?Sized> Stride<F> for Radau {
    /// Its powers, and what it may be off: it has not the slope of the solution at the start, but at the
    /// stages.
    fn dense(&mut self, field: &mut F, state: &State, h: f64, dense: &mut Dense, _tally: &mut Statistics) {
        let (s, d) = (self.tableau.stages(), state.y.len());
        dense.begin(field.watched(), s + 1, state);
        for (k, (powers, off)) in dense.each().enumerate() {
            for (m, power) in powers[1..].iter_mut().enumerate() {
                *power =
                    (0..s).fold(0.0, |sum, j| sum + self.tableau.powers[j * s + m] * self.work.z[j * d + k]);
            }
            *off = self.tableau.off * (h * self.work.start[k] - powers[1]).abs();
        }
    }

    /// As s (1-s)² over its largest value.
    fn off(share: f64) -> f64 {
        6.75 * share * (1.0 - share) * (1.0 - share)
    }

    fn repeat(&mut self, field: &mut F, state: &State, h: f64, statistics: &mut Statistics) -> bool {
        let length = self.work.factored;
        self.predict(h, length, true);
        self.factor(h, state.y.len());
        let mut contraction = 1.0;
        let has_converged =
            matches!(self.solve(field, state, h, &mut contraction, statistics), NewtonEnd::Converged(..));
        self.close(state);
        field.rhs(state.time + h, &self.work.next, &mut self.work.next_rate);
        statistics.evaluations += 1;
        has_converged
    }

    fn end(&self) -> (&[f64], &[f64]) {
        (&self.work.next, &self.work.next_rate)
    }

    fn search(&mut self) -> &mut SearchScratch {
        &mut self.work.search
    }
}
