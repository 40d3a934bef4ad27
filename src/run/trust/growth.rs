//! Whether small differences grow exponentially or as a power of time.
//!
//! Exponential growth, and with it an exponent, is told where two halves of the time agree on it: about the
//! same rate in both, in the second more than any power up to the third would give, and a straight line
//! against time fits better than one against its logarithm.  Motions of one degree of freedom that nothing
//! drives are regular whatever they look like for a while: their paths cannot cross in the plane of their
//! states.
//!
//! Source: M. Sandri, *Numerical calculation of Lyapunov exponents*, The Mathematica Journal 6 (1996), for
//! exponents from growth; the test is ours.

use super::{Lyapunov, TangentFlow};
use crate::dynamics::Mechanism;
use crate::dynamics::constraint::ConstraintEquation;
use crate::dynamics::force::UserForce;
use serde::{Deserialize, Serialize};

/// Growth \[ln\] within the second half of the time from which on a motion may be chaotic: that of the third
/// power is 2.1, and sizes vary by as much again.
const CHAOTIC: f64 = 4.0;
/// How far the rates of both halves may be apart.
const ALIKE: f64 = 4.0;
/// The largest power of a regular motion, with some room: that of a family of tori is one.
const REGULAR: f64 = 2.5;
/// Radians of the fastest rate below which a motion has shown nothing yet.
const SHORT: f64 = 30.0;
/// Blocks the uncertainty of the exponent is taken from.
const BLOCKS: usize = 8;

/// What growth a motion may have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Nature {
    /// True where it cannot be chaotic.
    is_planar: bool,
    /// About the fastest rate \[rad/s\].
    rate: f64,
}

/// What growth it has.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Growth {
    /// Exponential.
    pub lyapunov: Option<Lyapunov>,
    /// By a power of time.
    pub power: Option<f64>,
    /// Why it is neither.
    pub why: Option<&'static str>,
}

/// What is said of runs that end before a motion has shown what it is like.
pub(in crate::run) const TOO_SHORT: &str = "the run is too short to tell";
const NEITHER: &str = "it is neither exponential in both halves of the run nor a power of time";
const NEAR_UNSTABLE: &str = "it does not follow a power of time in this run, and a single degree of freedom \
    that nothing drives is not chaotic";

impl Nature {
    /// Of a mechanism whose flow has begun.
    pub fn new(mechanism: &Mechanism, tangent: &TangentFlow) -> Self {
        Self { is_planar: cannot_be_chaotic(mechanism, tangent.freedom()), rate: tangent.rate() }
    }

    /// True where a motion has shown what it is like by this time \[s\].
    pub fn has_shown(self, t: f64) -> bool {
        self.rate * t >= SHORT
    }

    /// The growth that a history of times \[s\] and logarithms shows.
    pub fn judge(self, history: &[[f64; 2]]) -> Growth {
        let mut growth = Growth::default();
        let (Some(&[begin, first]), Some(&[end, last])) = (history.first(), history.last()) else {
            return Growth { why: Some("it was not followed"), ..growth };
        };
        if history.len() < 2 * BLOCKS || !last.is_finite() {
            let why = if last.is_finite() { TOO_SHORT } else { "it came out not finite" };
            return Growth { why: Some(why), ..growth };
        }
        let at = |share: f64| interpolated(history, begin + share * (end - begin));
        let [early, late] = [at(0.5) - first, last - at(0.5)];
        let [line, power] = [|t: f64| t, |t: f64| libm::log(t)].map(|scale| {
            fit(history
                .iter()
                .filter(|point| point[0] - begin >= 0.1 * (end - begin))
                .map(|point| [scale(point[0] - begin), point[1]]))
        });
        let grows =
            late >= CHAOTIC && late <= ALIKE * early && early <= ALIKE * late && line.rest < power.rest;
        if grows && !self.is_planar {
            growth.lyapunov = Some(exponent(history, at));
        } else if self.has_shown(end - begin) && power.slope < REGULAR && (self.is_planar || late < CHAOTIC) {
            // Where growth is slow both lines fit.
            let is_steady = power.slope < 0.5 || power.rest <= line.rest;
            growth.power = (is_steady && power.slope.is_finite()).then_some(power.slope.max(0.0));
        }
        if growth.lyapunov.is_none() && growth.power.is_none() {
            let has_shown = grows || self.has_shown(end - begin);
            growth.why = Some(match self.is_planar {
                _ if !has_shown => TOO_SHORT,
                true => NEAR_UNSTABLE,
                false => NEITHER,
            });
        }
        growth
    }
}

/// True where so many degrees of freedom are one that nothing drives, and no motion is chaotic.
pub(in crate::run) fn cannot_be_chaotic(mechanism: &Mechanism, freedom: usize) -> bool {
    let walls = mechanism.contacts.iter().map(|contact| &contact.row);
    let moves = mechanism.constraints.iter().chain(walls).any(ConstraintEquation::is_motor);
    let pushes = mechanism.actions.iter().any(|action| action.law.is_some())
        || mechanism.forces.iter().any(UserForce::depends_on_time);
    // Branches that laws stay on are states as well.
    let remembers = mechanism.laws.as_ref().is_some_and(|laws| laws.formulas.switches());
    freedom <= 1 && !moves && !pushes && !remembers
}

/// A straight line through points, by least squares.
struct StraightLine {
    slope: f64,
    /// Mean square of what it leaves.
    rest: f64,
}

fn fit(points: impl Iterator<Item = [f64; 2]> + Clone) -> StraightLine {
    let count = points.clone().count() as f64;
    let [x, y] = points.clone().fold([0.0; 2], |[x, y], point| [x + point[0] / count, y + point[1] / count]);
    let [xx, xy, yy] = points.fold([0.0; 3], |[xx, xy, yy], [a, b]| {
        let (a, b) = (a - x, b - y);
        [xx + a * a, xy + a * b, yy + b * b]
    });
    let slope = xy / xx;
    StraightLine { slope, rest: (yy - slope * xy) / count }
}

/// The growth at a time, on straight lines between those that are known.
fn interpolated(history: &[[f64; 2]], t: f64) -> f64 {
    let after = history.partition_point(|point| point[0] < t).clamp(1, history.len() - 1);
    let ([t0, g0], [t1, g1]) = (history[after - 1], history[after]);
    g0 + (g1 - g0) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0)
}

/// The largest exponent \[1/s\], its standard error and the time it is of \[s\], from the growth `at` shares
/// of that time.
fn exponent(history: &[[f64; 2]], at: impl Fn(f64) -> f64) -> Lyapunov {
    let span = history[history.len() - 1][0] - history[0][0];
    let share = |k: usize| k as f64 / BLOCKS as f64;
    let rates: Vec<f64> =
        (0..BLOCKS).map(|k| (at(share(k + 1)) - at(share(k))) / (span * share(1))).collect();
    let exponent = (at(1.0) - at(0.0)) / span;
    let spread = rates.iter().map(|rate| (rate - exponent).powi(2)).sum::<f64>() / (BLOCKS - 1) as f64;
    Lyapunov { exponent, uncertainty: (spread / BLOCKS as f64).sqrt(), until: history[history.len() - 1][0] }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(growth: impl Fn(f64) -> f64) -> Growth {
        let history: Vec<[f64; 2]> = (0..200).map(|i| 0.25 * f64::from(i)).map(|t| [t, growth(t)]).collect();
        Nature { is_planar: false, rate: 5.0 }.judge(&history)
    }

    #[test]
    fn exponents_are_told_of_exponential_growth_and_powers_of_all_other() {
        let chaotic = judged(|t| 1.5 * t + libm::sin(t));
        assert!(
            chaotic.power.is_none()
                && chaotic.lyapunov.is_some_and(|found| (found.exponent - 1.5).abs() < 0.05),
            "{chaotic:?}"
        );
        for power in [0.0, 1.0, 2.0] {
            let found = judged(|t| power * libm::log(1.0 + 3.0 * t) + 0.5 * libm::sin(2.0 * t));
            assert!(
                found.lyapunov.is_none() && found.power.is_some_and(|found| (found - power).abs() < 0.2),
                "{found:?}"
            );
        }
        // Away from a place of unsteady rest, once; and towards one of steady rest.
        assert_eq!(judged(|t| 8.0 * (0.5 * t).min(1.0)).lyapunov, None);
        assert_eq!(judged(|t| -t).power, Some(0.0));
    }

    #[test]
    fn a_plane_of_states_has_no_room_for_chaos() {
        let history: Vec<[f64; 2]> = (0..200).map(f64::from).map(|t| [t, t]).collect();
        assert!(Nature { is_planar: false, rate: 1.0 }.judge(&history).lyapunov.is_some());
        assert_eq!(Nature { is_planar: true, rate: 1.0 }.judge(&history).lyapunov, None);
    }
}
