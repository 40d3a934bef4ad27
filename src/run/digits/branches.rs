//! The branches of formulas in many digits: which hold where a step begins, and where they change.
//!
//! A formula with corners is recorded on the branches that its conditions choose.  A step ends at the first
//! zero of a condition, by Newton's iteration on its series; the next one begins on the other branch.  A
//! condition is zero where it is rounding to three quarters of the digits; which side it is on then is told
//! by its value a little later.  That there is a zero inside a step is told in doubles
//! ([`search`](crate::stepping::search)), as it is for events.

use super::functions::{Functions, LEAVES, SAME, magnitude};
use super::motion::DigitsMotion;
use super::wall::{in_shares, refined};
use crate::arithmetic::digits::Digits;
use crate::arithmetic::{Real, Scalar};
use crate::stepping::search::{Curve, PowerSeries, root, sign};
use crate::stepping::{Cause, StepError};

/// Part of the digits that a condition has to be zero in.
const SURE: f64 = 0.75;
/// Changes at one moment beyond as many as there are conditions.
const CHANGES: usize = 8;

/// The conditions of a mechanism's formulas.
#[derive(Clone, Debug, Default)]
pub struct BranchConditions<const W: usize> {
    pub functions: Functions<W>,
}

/// A condition in a step.
struct Condition {
    /// Its powers in shares of the step.
    shares: Vec<f64>,
    /// The side it is on as the step begins: -1, 1, or 0 where it is zero throughout.
    side: i8,
    /// True where it begins at zero.
    is_at_zero: bool,
}

impl Condition {
    fn new<const W: usize>(powers: &[Digits<W>], step: f64, rounding: f64) -> Self {
        let shares = in_shares(powers, 1.0, step);
        let first = powers.first().map_or(f64::NEG_INFINITY, Digits::log2);
        let is_at_zero = first <= libm::log2(magnitude(&shares)) + rounding;
        let begin = || powers.first().map_or(0, |first| sign(first.value()));
        let left = || sign(PowerSeries { powers: &shares, end: 1.0 }.at(LEAVES)[0]);
        let side = if is_at_zero { left() } else { begin() };
        Self { side, is_at_zero, shares }
    }

    /// Where it first changes its side, as a share of the step.
    fn change(&self) -> Option<f64> {
        let curve = PowerSeries { powers: &self.shares, end: 1.0 };
        let after = |share: f64| sign(curve.at(share)[0]);
        if self.side == 0 {
            return None;
        }
        if !self.is_at_zero && after(SAME) == -self.side {
            return Some(0.0);
        }
        let mut share = SAME;
        while let Some(zero) = root(&curve, 0.0, share, 1.0) {
            share = zero + SAME;
            if share >= 1.0 {
                return None;
            }
            if after(share) == -self.side {
                return Some(zero);
            }
        }
        None
    }
}

impl<const W: usize> BranchConditions<W> {
    /// For the conditions of a mechanism.
    pub fn new(functions: Functions<W>) -> Self {
        Self { functions }
    }

    /// The branches as a step of so many seconds begins, where they are others than the motion is on.
    pub fn others(&self, motion: &DigitsMotion<W>, step: f64) -> Option<Vec<bool>> {
        let known = &motion.mechanism.acting.modes;
        let rounding = motion.precision.rounding(SURE);
        let conditions = self.functions.powers.iter().map(|powers| Condition::new(powers, step, rounding));
        let conditions: Vec<Condition> = conditions.collect();
        // Those that are not at their zeros first: what the others do next depends on them.
        let is_other = |(condition, &mode): (&Condition, &bool)| {
            !condition.is_at_zero && condition.side != 0 && mode != (condition.side > 0)
        };
        let has_clear = conditions.iter().zip(known).any(is_other);
        let mode = |(condition, &mode): (&Condition, &bool)| match condition.side {
            0 => mode,
            _ if has_clear && condition.is_at_zero => mode,
            side => side > 0,
        };
        let modes: Vec<bool> = conditions.iter().zip(known).map(mode).collect();
        (modes != known[..modes.len()]).then_some(modes)
    }

    /// The time after which a condition first changes its side within a step of so many seconds \[s\].
    pub fn change(&self, motion: &DigitsMotion<W>, step: f64) -> Option<Digits<W>> {
        let rounding = motion.precision.rounding(SURE);
        let change = |powers: &Vec<Digits<W>>| {
            let share = Condition::new(powers, step, rounding).change()?;
            Some(refined(motion, powers, Digits::of(share * step)))
        };
        self.functions.powers.iter().filter_map(change).reduce(|a, b| if b < a { b } else { a })
    }

    /// As many changes of branches as there may be at one moment.
    pub fn most(motion: &DigitsMotion<W>) -> usize {
        motion.mechanism.conditions.len() + CHANGES
    }

    /// An error where the branches that the motion is on and these drive it back to each other.
    pub fn slides(motion: &DigitsMotion<W>, modes: &[bool]) -> StepError {
        let known = motion.mechanism.acting.modes.iter().zip(modes);
        let changing = known.zip(&motion.mechanism.conditions).find(|((known, mode), _)| known != mode);
        let name = changing.map_or("a law", |(_, condition)| &condition.name);
        let what = format!(
            "a formula of `{name}` changes its branch here, and on both branches the motion is driven back"
        );
        let hint = "sliding along such a surface is not integrated: let the law pass zero smoothly, as \
            tanh(x/0.01) instead of sign(x)";
        motion.stop(Cause::Sliding, 0.0, &what, hint)
    }
}
