//! Poles of outputs, and ends of their roots: what they come to there.
//!
//! Next to the zero of a denominator, or of what a root or a logarithm is taken of, the output with exactly
//! this zero is the limit of the side, where the output itself goes there: towards a bound, or on without
//! one.  Of `sin(x)/x` it does not.

use super::{ExtremesDetector, Found};
use crate::dynamics::Time;
use crate::run::observer::Inside;

/// Shares of a part, from its end, at which it is looked where the output goes.
const TOWARDS: [f64; 3] = [1e-3, 1e-3 / 31.622_776_601_683_793, 1e-6];
/// What is so small over what it is at the nearest of these is zero.
const ZERO: f64 = 1e-3;
/// What a change towards a pole is over the one before it at least, 1 for a logarithm, and over the value.
const ON: f64 = 0.5;
const MORE: f64 = 1e-6;
/// Powers of the distance with which an output grows, from which on its integral and that of its square are
/// without bound; a little less for what is beside the leading power.
const UNBOUNDED: [f64; 2] = [0.97, 0.47];

impl ExtremesDetector {
    /// Looks at the poles at both ends of a part, and at new extremes within it: what a denominator touches
    /// zero at without a change of its sign is such a one.
    pub(super) fn look_at_poles(
        &mut self,
        inside: &mut dyn Inside,
        (begin, span): (Time, f64),
        before: &[Found],
    ) {
        let are_poles = self.mechanism.outputs.as_ref().map(|outputs| outputs.are_poles());
        let Some(are_poles) = are_poles.filter(|poles| poles.contains(&true) && span > 0.0) else { return };
        let mut places = vec![(begin, span), (begin + span, -span)];
        for (found, before) in self.memory.found.iter().zip(before) {
            for (new, known) in [(found.min, before.min), (found.max, before.max)] {
                let from = (Time::from(new[1]) - begin).hi;
                let reach = from.min(span - from);
                if new != known && reach > TOWARDS[2] * span && new[0].is_finite() {
                    places.extend([(begin + from, reach), (begin + from, -reach)]);
                }
            }
        }
        for (time, reach) in places {
            self.look_towards_pole(inside, (time, reach), &are_poles);
        }
    }

    /// Counts the limits of one side of a time, at which there may be poles.
    fn look_towards_pole(&mut self, inside: &mut dyn Inside, (time, reach): (Time, f64), are_poles: &[bool]) {
        let here = self.conditions(inside.at(time));
        let beside = self.conditions(inside.at(time + TOWARDS[2] * reach));
        let least = |k: usize| (ZERO * beside[k].abs()).max(self.memory.still.get(k).copied().unwrap_or(0.0));
        let is_zero = |k: &usize| are_poles[*k] && beside[*k] != 0.0 && here[*k].abs() <= least(*k);
        let zeros: Vec<usize> = (0..here.len()).filter(is_zero).collect();
        if zeros.is_empty() {
            return;
        }
        let rows = TOWARDS.map(|share| self.values_at(inside.at(time + share * reach)));
        let plain = self.values_at(inside.at(time));
        for pole in zeros {
            let zero = f64::copysign(0.0, beside[pole]);
            let branches = std::mem::take(&mut self.branches);
            let limits = self.with_outputs(inside.at(time), |outputs, moment, scratch| {
                outputs.at_pole(moment, scratch, &branches, (pole, zero))
            });
            self.branches = branches;
            let is_other = |(k, limit): &(usize, &f64)| limit.is_infinite() || **limit != plain[*k];
            for (k, &limit) in limits.iter().enumerate().filter(is_other) {
                count(&mut self.memory.found[k], limit, rows.each_ref().map(|row| row[k]), time.hi);
            }
        }
    }
}

/// Counts a limit where what is next to it, the farthest first, goes there.
fn count(found: &mut Found, limit: f64, beside: [f64; 3], t: f64) {
    let [first, second] = [beside[1] - beside[0], beside[2] - beside[1]];
    if limit.is_finite() {
        let [far, nearer, near] = beside.map(|value| (limit - value).abs());
        if near <= nearer && nearer <= far {
            found.see(limit, t);
        }
    } else if second * limit > 0.0 && second.abs() >= (ON * first.abs()).max(MORE * beside[2].abs()) {
        found.see(limit, t);
        let power = (second / first).abs().ln() / (TOWARDS[0] / TOWARDS[1]).ln();
        for (sum, unbounded) in [&mut found.integral, &mut found.square].into_iter().zip(UNBOUNDED) {
            if power.is_nan() || power < unbounded {
                *sum = f64::NAN.into();
            }
        }
    }
}
