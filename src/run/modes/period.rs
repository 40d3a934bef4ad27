//! The period of what drives a mechanism.

use super::ModesError;
use super::local::Local;
use crate::arithmetic::Scalar;
use crate::dynamics::{Mechanism, Time};
use crate::scene::Law;
use std::f64::consts::TAU;

/// Most periods of one motor among which those of all have a common multiple.
const MULTIPLES: u32 = 64;
/// Relative difference below which two laws are the same a period later.
const SAME: f64 = 1e-9;
/// Times at which they are compared, over the period.
const LOOKED_AT: [f64; 7] = [0.0, 0.13, 0.29, 0.41, 0.57, 0.73, 0.89];

/// The least common period of the drives and of forces that are laws of time \[s\].
pub(super) fn common_period(mechanism: &Mechanism) -> Result<f64, ModesError> {
    let unknown = |name: &str| ModesError::PeriodUnknown(name.to_owned());
    let mut rates: Vec<f64> = Vec::new();
    for row in &mechanism.constraints {
        let Some(law) = row.law.as_ref().filter(|law| !law.is_constant()) else { continue };
        let is_unknown = law.acceleration != 0.0 || law.profile.is_some();
        if is_unknown || (law.rate != 0.0 && !row.is_angle()) {
            return Err(unknown(&format!("`{}`", row.name())));
        }
        rates.extend(law.sines.iter().map(|sine| sine.frequency).chain([law.rate]));
    }
    for action in &mechanism.actions {
        // A law with more in it than sines is looked at by `check_period`.
        rates.extend(action.law.iter().flat_map(|law| law.sines.iter().map(|sine| sine.frequency)));
    }
    let rates = rates.into_iter().filter(|rate| *rate != 0.0);
    let periods: Vec<f64> = rates.map(|rate| TAU / rate.abs()).collect();
    if periods.is_empty() {
        return Err(unknown("the scene's forces"));
    }
    let longest = periods.iter().copied().fold(0.0, f64::max);
    let is_whole = |share: f64| (share - share.round()).abs() < SAME * share;
    (1..=MULTIPLES)
        .map(|k| f64::from(k) * longest)
        .find(|period| periods.iter().all(|one| is_whole(period / one)))
        .ok_or_else(|| unknown("all drives together"))
}

/// What the drives and forces are after a period is what they were.
pub(super) fn check_period(
    mechanism: &Mechanism,
    local: &mut Local,
    phi: &[f64],
    period: f64,
) -> Result<(), ModesError> {
    let differs = |what: String| ModesError::NotPeriodic { period, what };
    let angle = |law: &Law, t: Time| law.angle(t);
    for row in &mechanism.constraints {
        let Some(law) = &row.law else { continue };
        for share in LOOKED_AT {
            let [now, then] = [share * period, (1.0 + share) * period].map(Time::of);
            let [rate, later] = [now, then].map(|t| law.rates::<f64>(t).0);
            let travel = (angle(law, then) - angle(law, now)).hi;
            let turns = if local.turns.is_of_row(&row.measure) { (travel / TAU).round() } else { 0.0 };
            let scale = rate.abs().max(later.abs()).max(TAU / period);
            if (rate - later).abs() > SAME * scale || (travel - turns * TAU).abs() > SAME * scale * period {
                return Err(differs(format!("`{}`", row.name())));
            }
        }
    }
    let pulls = LOOKED_AT
        .map(|share| [share * period, (1.0 + share) * period].map(|t| local.pull_on_branches(phi, t)));
    // At one time all may be zero.
    let largest = pulls.iter().flatten().fold(0.0, |most: f64, pull| most.max(pull.amax()));
    match pulls.iter().all(|[now, then]| (now - then).amax() <= SAME * largest) {
        true => Ok(()),
        false => Err(differs("the scene's forces".into())),
    }
}
