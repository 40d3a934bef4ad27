//! Scratch space of a step: what is summed, committed and judged by.

use super::super::sums::sum_of;
use super::super::tableau::{GaussTableau, lane};
use super::super::{LARGEST_REST, LEAST_ANGLE};
use super::GaussScratch;
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::Lanes;
use crate::arithmetic::sum::larger;
use crate::arithmetic::{DoubleDouble, Scalar};
use crate::dynamics::{State, Time};

impl GaussScratch {
    /// Forms what depends on the step alone.
    pub fn scale(&mut self, tableau: &GaussTableau, step: f64) {
        let (s, d) = (tableau.nodes.len(), self.points.y.len());
        self.step = step;
        self.span = Octet::default();
        self.offset = [Time::of(0.5 * step); LANES];
        self.points.used = [false; LANES];
        for i in 0..s {
            self.span.0[lane(i, s)] = tableau.weights[i].scale(step).hi;
            self.offset[lane(i, s)] = tableau.nodes[i].scale(step);
            self.points.used[lane(i, s)] = true;
        }
        self.increment.resize(d, Octet::default());
        self.increment_low.resize(d, Octet::default());
        for vector in [&mut self.change, &mut self.least, &mut self.rest, &mut self.size] {
            vector.resize(d, 0.0);
        }
        self.total.resize(d, DoubleDouble::ZERO);
    }

    /// Σ L_j with what each leaves out, mirror images first.
    #[inline(always)]
    pub(super) fn sum_exactly<L: Lanes>(&mut self) {
        for ((total, increment), low) in self.total.iter_mut().zip(&self.increment).zip(&self.increment_low) {
            let ([first, second], low) = (increment.halves::<L>(), low.halves::<L>());
            let (sums, error) = first.two_sum(second);
            let (high, low) = sum_of(sums, error.add(low[0].add(low[1])));
            *total = DoubleDouble::sum(high, low);
        }
    }

    /// Moves a state from the beginning of the step to a share of it, by the collocation polynomial.
    pub fn carry(&self, tableau: &GaussTableau, share: f64, state: &mut State) {
        let s = tableau.nodes.len();
        for (j, reached) in tableau.reached(share).into_iter().enumerate() {
            for (y, increment) in state.y.iter_mut().zip(&self.increment) {
                *y += reached * increment.0[lane(j, s)];
            }
        }
    }

    /// Writes the new state of a method of s stages.
    pub(super) fn commit(&self, state: &mut State, s: usize) {
        for (k, &total) in self.total.iter().enumerate() {
            let y = DoubleDouble { hi: state.y[k], lo: state.low[k] } + total;
            (state.y[k], state.low[k]) = (y.hi, y.lo);
        }
        state.time = state.time + self.step;
        state.wrap();
        state.memory.clear();
        state.memory.push(self.step);
        state
            .memory
            .extend(self.increment.iter().flat_map(|increment| (0..s).map(|i| increment.0[lane(i, s)])));
        if self.newton_left > 0.0 {
            state.memory.push(self.newton_left);
        }
    }

    /// True where some unknown changed less than ever before in this step; no change at all may be an
    /// accident and is not counted.
    pub(super) fn falls(&mut self) -> bool {
        let mut falls = false;
        for (&change, least) in self.change.iter().zip(&mut self.least) {
            if change != 0.0 && change < *least {
                *least = change;
                falls = true;
            }
        }
        falls
    }

    /// True where no unknown moved by more than this share of its size.
    pub(super) fn is_within(&self, share: f64) -> bool {
        self.change
            .iter()
            .zip(&self.points.y)
            .all(|(&change, stage)| change == 0.0 || change <= share * stage.size())
    }

    /// The largest change of the last iteration among the unknowns that tell; not a number where one is.
    pub(super) fn size_of_change(&self) -> f64 {
        self.change[..self.judged].iter().fold(0.0, |size, &change| larger(change, size))
    }

    /// True where the last changes are too large for the end of an iteration, which is to go on: earlier ones
    /// were small by accident, as from next to rest, where coordinates and momenta take turns at it.
    #[cold]
    pub(super) fn goes_on(&mut self, angles: usize) -> bool {
        self.judge();
        let is_open = self.unsettled(angles).is_some();
        if is_open {
            self.least.copy_from_slice(&self.change);
        }
        is_open
    }

    /// Keeps what convergence is judged by.
    pub(super) fn judge(&mut self) {
        self.rest.copy_from_slice(&self.change);
        for (size, stage) in self.size.iter_mut().zip(&self.points.y) {
            *size = stage.size();
        }
    }

    /// The first unknown whose change did not come down, where the first so many are angles.
    pub(in crate::stepping::gauss) fn unsettled(&self, angles: usize) -> Option<usize> {
        (0..self.judged).find(|&k| {
            let floor = if k < angles { LEAST_ANGLE } else { 0.0 };
            self.rest[k].is_nan() || self.rest[k] > LARGEST_REST * self.size[k].max(floor)
        })
    }
}
