//! What light members and long levers ask for beyond doubles, and the rank of the constraints, which knows no
//! masses.
//!
//! A body of a billionth of the others' mass gives way a billion times more easily: S = G M⁻¹ Gᵀ is the sum
//! of what is left of it and of numbers a billion times larger, and its pivots have lost nine digits.  In
//! double-double they are evaluated anew, and rounded.

use super::{Bias, Kernel};
use crate::arithmetic::sum::larger;
use crate::arithmetic::{DoubleDouble, Real};
use crate::dynamics::rank::RankVerdict;
use crate::dynamics::{Mechanism, Time, schur};

impl<T: Real> Kernel<T> {
    /// True where doubles have too few digits for S, or with it for M.
    #[inline(always)]
    pub(super) fn is_delicate(&self, mechanism: &Mechanism) -> bool {
        let is_deep = || {
            self.bodywise.is_none() && schur::is_deep(&self.pivot, mechanism.tree.diagonal.iter().copied())
        };
        T::IS_PLAIN && !mechanism.constraints.is_empty() && (self.weakest.is_delicate || is_deep())
    }

    /// Writes accelerations and multipliers of the evaluation in double-double.
    #[cold]
    pub(super) fn accelerate_exactly(
        &mut self,
        mechanism: &Mechanism,
        t: Time,
        phi: &[T],
        omega: &[T],
        bias: Bias,
    ) {
        let exact = self.exact.get_or_insert_with(|| Box::new(Kernel::new(mechanism)));
        let wide = |x: &[T]| -> Vec<DoubleDouble> { x.iter().map(|x| x.double_double()).collect() };
        exact.stretch = wide(&self.stretch);
        exact.accelerate::<0>(mechanism, t, &wide(phi), &wide(omega), bias);
        let pairs = [
            (&mut self.load, &exact.load),
            (&mut self.multiplier, &exact.multiplier),
            (&mut self.correction, &exact.correction),
        ];
        for (rounded, exact) in pairs {
            round(rounded, exact);
        }
        round(&mut self.friction, &exact.friction);
        self.regularity = exact.regularity;
    }

    /// The factors in double-double, where those in doubles have too few digits.
    pub(super) fn linearise_exactly(&mut self, mechanism: &Mechanism, t: Time, phi: &[T], omega: &[T]) {
        self.is_exact = self.is_delicate(mechanism);
        if self.is_exact {
            let exact = self.exact.get_or_insert_with(|| Box::new(Kernel::new(mechanism)));
            let wide = |x: &[T]| -> Vec<DoubleDouble> { x.iter().map(|x| x.double_double()).collect() };
            exact.linearise_at::<0>(mechanism, t, &wide(phi), &wide(omega));
        }
    }

    /// [`Kernel::solve_rows`] with the factors in double-double.
    #[cold]
    pub(super) fn solve_rows_exactly(&mut self) {
        let Some(exact) = &mut self.exact else { return };
        exact.multiplier.iter_mut().zip(&self.multiplier).for_each(|(exact, x)| *exact = x.double_double());
        exact.solve_rows();
        round(&mut self.multiplier, &exact.multiplier);
    }

    /// [`Kernel::multiplier_accelerations`] with the factors in double-double.
    #[cold]
    pub(super) fn lift_exactly(&mut self) {
        let Some(exact) = &mut self.exact else { return };
        // What has just been solved for keeps its digits.
        for (exact, x) in exact.multiplier.iter_mut().zip(&self.multiplier) {
            if exact.hi != x.value() {
                *exact = x.double_double();
            }
        }
        exact.multiplier_accelerations();
        round(&mut self.load, &exact.load);
    }

    /// How independent the constraints are at other coordinates than the last, whatever the masses are; and
    /// all of [`Kernel::rows_at`].
    pub fn independence_at(&mut self, mechanism: &Mechanism, t: Time, phi: &[T], omega: &[T]) -> RankVerdict {
        self.unit_vectors::<0>(mechanism, phi);
        self.rows_at(mechanism, t, phi, omega);
        match &self.bodywise {
            Some(bodywise) => bodywise.judge(),
            None => self.metric.judge(&self.jacobian),
        }
    }

    /// How independent the first constraints are among themselves, so many of them, in the last evaluation.
    pub fn judge_first(&self, rows: usize) -> RankVerdict {
        let metric = self.metric.first(rows);
        match &self.bodywise {
            Some(bodywise) => metric.judge(&bodywise.jacobian(rows, metric.columns.len())),
            None => metric.judge(&self.jacobian[..rows * metric.columns.len()]),
        }
    }

    /// The largest C of the last evaluation, angles in rad and lengths in sizes of the mechanism.
    pub fn violation(&self, mechanism: &Mechanism) -> f64 {
        let size = mechanism.size_of_parts();
        mechanism.constraints.iter().zip(&self.rows).fold(0.0, |most, (row, here)| {
            let off = here.position.value().abs() / if row.is_angle() { 1.0 } else { size };
            larger(off, most)
        })
    }
}

/// Rounds numbers.
fn round<T: Real>(rounded: &mut [T], exact: &[DoubleDouble]) {
    for (rounded, &exact) in rounded.iter_mut().zip(exact) {
        *rounded = T::split(exact).0;
    }
}
