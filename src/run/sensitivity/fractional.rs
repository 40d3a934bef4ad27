//! Steps of columns next to the zero of a fractional power in a force, as a root has.
//!
//! ```text
//! force k x^p, p < 1, x = 0 at an end of the step:   A_q ~ x^(p-1) g gᵀ,   g = dx/dq
//! (dq, dw) = s (w, a) + ρ,   s = g·dq/g·w at that end:    A_q ρ_q ~ x^p
//! ```
//!
//! No polynomial follows x^(p-1).  The motion's own change (w, a) is a solution of the variational equation,
//! known at both ends; what is left without it meets the zero when the motion does, and its equation has no
//! pole there.  The steps of the motion end at such zeros, as branches of formulas change there.  Where the
//! motion hardly moves, s and what (w, a) is off by are larger than the column, and it is not used.

use super::collocation::{ColumnLimits, STAGES, Tails};
use super::variation::{LIMIT, Variation, plain};
use crate::dynamics::kernel::{Bias, Kernel, dot};
use crate::dynamics::{Motion, Time};
use crate::run::observer::Step;
use crate::run::saltation::Side;

/// What a step may leave, over the rates of a column.
pub(super) const RESOLVED: f64 = 1e-12;
/// How exactly the motion's own change is known.
const EXACT: f64 = 1e-12;
/// Share of what a step of (dq, dw) leaves that one of ρ may leave to be worth it, where it is not resolved.
const BETTER: f64 = 0.5;
/// Such a step is divided as one with a tail of so many times the limit, unless it is below this share of
/// that of the motion.
const DIVIDE: f64 = 1e5;
const SHORTEST: f64 = 1e-5;

impl Variation {
    /// A step of ρ by collocation where one of the columns has such tails; its last Legendre coefficient, or
    /// one of a step to be divided.  `None` where ρ has no smaller tail, time itself acts, or no formula has
    /// branches.
    pub(super) fn fractional_step(
        &mut self,
        step: &mut Step,
        h: f64,
        (limits, tails): (&[ColumnLimits], Tails),
    ) -> Option<f64> {
        let laws = self.mechanism.laws.as_ref();
        if !laws.is_some_and(|laws| laws.formulas.switches()) {
            return None;
        }
        let (n, unit) = (self.mechanism.coordinates(), self.mechanism.units.time);
        let size = |row: &[f64]| row[..n].iter().fold(0.0, |most: f64, entry| most.max(entry.abs()));
        let rows = self.pull.chunks_exact(2 * n).enumerate();
        let (index, row) = rows.max_by(|(_, one), (_, other)| size(one).total_cmp(&size(other)))?;
        let after = if index / n < STAGES / 2 { 0.0 } else { h };
        // At the ends of the motion's own step to all digits, as what happens there is taken at: x^p is far
        // from zero where x is the last digit of a time.
        let (first, last) = step.ends();
        let exactly = |time: f64| match time {
            time if time == first.hi => first,
            time if time == last.hi => last,
            time => Time::from(time),
        };
        let sides = [self.now, self.now + h].map(|time| {
            let side = Side::new(&self.mechanism, step.at_time(exactly(time)));
            (side.ahead(), if exactly(time) == Time::from(time) { size(&side.phi) } else { 0.0 })
        });
        let [(begin, _), (end, _)] = &sides;
        let speed = dot(&row[..n], &if after == 0.0 { begin } else { end }[..n]);
        if speed == 0.0 || self.is_timed(step.at(self.now + 0.5 * h), h) {
            self.rough = self.rough.max(tails.rough);
            return None;
        }
        let (mut columns, mut shares, mut sizes) = (self.columns.clone(), Vec::new(), limits.to_vec());
        // How much larger than a column is what is taken off it.
        let mut larger = 0.0_f64;
        for (column, whole) in columns.iter_mut().zip(&mut sizes) {
            let share = (0..n).map(|k| row[k] * (column[k] + after * column[n + k])).sum::<f64>() / speed;
            whole.floor += size(&column[n..]).max(size(column) / unit);
            larger = larger.max((share / whole.floor).abs() * size(&begin[n..]).max(size(begin) / unit));
            column.iter_mut().zip(begin).for_each(|(entry, ahead)| *entry -= share * ahead);
            shares.push(share);
        }
        let found = self.method.solve((h, unit), &self.pull, &columns, (&self.forcing, &sizes));
        let found = found.filter(|found| found.rough.max(larger * EXACT) <= BETTER * tails.rough);
        let resolved = found.filter(|found| found.rough <= RESOLVED && found.last <= LIMIT);
        let Some(found) = resolved else {
            // The solution that was tried first.
            let _ = self.method.solve((h, unit), &self.pull, &self.columns, (&self.forcing, limits));
            let is_long = h > SHORTEST * (step.end() - step.begin());
            if found.is_some() && !is_long {
                self.rough = self.rough.max(tails.rough);
            }
            return found.filter(|_| is_long).map(|_| DIVIDE * LIMIT);
        };
        // The last digit of the coordinates where such a step meets one of another kind.
        let nodes = self.pull.chunks_exact(2 * n * n);
        let steepest = |node: &[f64]| node.chunks_exact(2 * n).map(size).fold(0.0, f64::max);
        let off = [nodes.clone().next(), nodes.last()].into_iter().flatten().map(steepest).zip(&sides);
        let off = off.map(|(steepest, (_, phi))| f64::EPSILON * phi * steepest).fold(0.0, f64::max);
        let each = shares.iter().zip(&sizes).map(|(share, whole)| (share * off).abs() / whole.floor);
        self.rough += each.filter(|each| each.is_finite()).fold(found.rough, f64::max);
        self.method.take(h, &mut columns);
        for (column, share) in columns.iter_mut().zip(shares) {
            column.iter_mut().zip(end).for_each(|(entry, ahead)| *entry += share * ahead);
        }
        self.columns = columns;
        Some(found.last)
    }

    /// True where the accelerations of a state are others so much later \[s\].
    fn is_timed(&self, motion: &Motion, later: f64) -> bool {
        let ((t, phi, omega), mut kernel) = (plain(motion), Kernel::<f64>::new(&self.mechanism));
        let [now, then] = [t, t + later].map(|t| {
            kernel.accelerations(&self.mechanism, t, &phi, &omega, Bias::default());
            kernel.load.clone()
        });
        now != then
    }
}
