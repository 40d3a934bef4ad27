//! Functions of a motion in many digits, as series: those of events, and the conditions of formulas.

use super::motion::DigitsMotion;
use super::polynomial::{CANCELS, JUDGES};
use super::wall::in_shares;
use crate::arithmetic::digits::Digits;
use crate::dynamics::force::UserForce;
use crate::dynamics::series::FormulaSeries;
use crate::stepping::search::{Curve, PowerSeries};

/// Share of a step within which zeros are not told apart in doubles, and what began it does not happen again.
pub(super) const SAME: f64 = 1e-9;
/// Share of a step after which a function that was at its zero has left it.
pub(super) const LEAVES: f64 = 1e-3;
/// Times within a step at which its largest value is looked for.
const LOOKS: usize = 8;
/// Rounds in which a step is shortened, at most.
const ROUNDS: usize = 20;

/// Functions, and their powers in the step that is next.
#[derive(Clone, Debug, Default)]
pub struct Functions<const W: usize> {
    series: Vec<FormulaSeries<Digits<W>>>,
    /// The powers, function by function.
    pub powers: Vec<Vec<Digits<W>>>,
}

impl<const W: usize> Functions<W> {
    /// Room for some functions, each recorded as a torque.
    pub fn new(functions: &[UserForce<Digits<W>>], order: usize) -> Self {
        let series = functions.iter().map(|function| FormulaSeries::new(function, order)).collect();
        Self { series, powers: Vec::new() }
    }

    /// Expands them where the motion is expanded.
    pub fn expand(&mut self, motion: &DigitsMotion<W>, functions: &[UserForce<Digits<W>>]) {
        self.powers.clear();
        if self.series.is_empty() {
            return;
        }
        let coordinates = motion.state_coordinates();
        for (function, series) in functions.iter().zip(&mut self.series) {
            let from = (motion.state().t, &coordinates.phi[..]);
            self.powers.push(motion.series.formula(function, series, from).to_vec());
        }
    }

    /// The part of a step \[s\] within which they converge as far as log2 of the tolerance says, and their
    /// terms do not cancel.
    pub fn allows(&self, wanted: f64, tolerance: f64) -> f64 {
        if wanted.is_nan() {
            return wanted;
        }
        let shortened = |mut step: f64, powers: &Vec<Digits<W>>| {
            let Some((terms, last)) = powers.len().checked_sub(JUDGES).map(|first| powers.split_at(first))
            else {
                return step;
            };
            // A shorter step has smaller terms.
            for _ in 0..ROUNDS {
                let weight = |(k, power): (usize, &Digits<W>)| power.log2() + k as f64 * libm::log2(step);
                let size = terms.iter().enumerate().map(weight).fold(f64::NEG_INFINITY, f64::max);
                let allowed = |(j, power): (usize, &Digits<W>)| {
                    libm::exp2((tolerance + size - power.log2()) / (terms.len() + j) as f64)
                };
                let least = last.iter().enumerate().map(allowed).filter(|step| !step.is_nan());
                let least = least.fold(step, f64::min);
                if size == f64::NEG_INFINITY || least > 0.99 * step {
                    break;
                }
                step = least;
            }
            sums_up(powers, step)
        };
        self.powers.iter().fold(wanted, shortened)
    }
}

/// The part of a step in which the terms of a function do not cancel.
fn sums_up<const W: usize>(powers: &[Digits<W>], mut step: f64) -> f64 {
    for _ in 0..ROUNDS {
        let shares = in_shares(powers, 1.0, step);
        let largest = shares.iter().fold(0.0, |most: f64, share| most.max(share.abs()));
        if !step.is_finite() || largest <= libm::exp2(CANCELS) * magnitude(&shares) {
            break;
        }
        step *= 0.75;
    }
    step
}

/// About the largest magnitude of a function whose powers are in shares of a step.
pub(super) fn magnitude(shares: &[f64]) -> f64 {
    let curve = PowerSeries { powers: shares, end: 1.0 };
    (0..=LOOKS).map(|k| curve.at(k as f64 / LOOKS as f64)[0].abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::Scalar;

    /// sin(60 t) to many digits converges far beyond where doubles know what its terms sum up to.
    #[test]
    fn a_step_is_no_longer_than_doubles_can_sum_a_function_up() {
        let mut power = Digits::<8>::ONE;
        let powers = (0..900_u64).map(|m| {
            if m > 0 {
                power = (power * Digits::whole(60)).over_whole(m);
            }
            [Digits::ZERO, power, Digits::ZERO, -power][m as usize % 4]
        });
        let functions = Functions { series: Vec::new(), powers: vec![powers.collect()] };
        let step = functions.allows(10.0, -2700.0);
        assert!(step > 0.1, "{step}");
        let shares = in_shares(&functions.powers[0], 1.0, step);
        let curve = PowerSeries { powers: &shares, end: 1.0 };
        for share in [0.25, 0.5, 0.75, 1.0] {
            let off = curve.at(share)[0] - libm::sin(60.0 * share * step);
            assert!(off.abs() < 1e-11, "{off:e} at {share} of {step} s");
        }
    }
}
