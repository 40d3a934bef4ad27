//! What changes a mechanism with time, and its period.
//!
//! Laws and formulas are asked whether time is in them, on whichever branches: looked at at some times only,
//! a sine of 50 Hz stands still, and a torque that begins at 5 s is none.

use super::ModesError;
use super::local::{Local, moving as moving_at};
use crate::arithmetic::angle::GOLDEN_ANGLE;
use crate::arithmetic::{Complex, Scalar};
use crate::dynamics::constraint::{ConstraintArguments, ConstraintEquation, RowMeasure};
use crate::dynamics::force::UserForce;
use crate::dynamics::{Mechanism, Time};
use crate::scene::{Law, Profile, Sine};
use nalgebra::DVector;
use std::borrow::Cow;
use std::f64::consts::TAU;

/// Most periods of one motor among which those of all have a common multiple.
const MULTIPLES: u32 = 64;
/// Relative difference below which two laws are the same a period later; it grows with the number of periods.
const SAME: f64 = 1e-9;
/// Times at which they are compared, over the period: none at which a square wave may jump.
const LOOKED_AT: [f64; 7] = [0.0137, 0.1291, 0.2873, 0.4159, 0.5713, 0.7331, 0.8917];
/// How many periods later they are compared; the end of the scene's run is one more.
const LATER: [f64; 18] =
    [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 13.0, 21.0, 34.0, 55.0, 89.0, 144.0, 233.0, 377.0, 610.0, 987.0];
/// Most periods after which laws are compared.
const LATEST: f64 = 1e5;
/// States in motion in which forces are compared, beside the start at rest.
const IN_MOTION: usize = 3;

/// The frequencies of the sines of a law \[rad/s\].
fn frequencies(law: &Law) -> impl Iterator<Item = f64> {
    let oscillates = |sine: &&Sine| sine.amplitude != 0.0 && sine.frequency != 0.0;
    law.sines.iter().filter(oscillates).map(|sine| sine.frequency)
}

/// True where a law is not the same at all times, on its branches.
fn changes(law: &Law) -> bool {
    law.rate != 0.0
        || law.acceleration != 0.0
        || frequencies(law).next().is_some()
        || law.profile.as_ref().is_some_and(Profile::depends_on_time)
}

/// The names of parts that may depend on time on other branches than those that hold.
fn timed_on_branches(mechanism: &Mechanism) -> Vec<&str> {
    mechanism.laws.as_ref().map_or_else(Vec::new, |laws| laws.formulas.timed_on_branches())
}

/// Those of some constraint equations that time moves.
fn moved_by_time<'a>(
    mechanism: &'a Mechanism,
    rows: impl Iterator<Item = &'a ConstraintEquation>,
) -> impl Iterator<Item = &'a ConstraintEquation> {
    let timed = timed_on_branches(mechanism);
    rows.filter(|row| row.moves()).filter(move |row| {
        row.law.as_ref().is_some_and(changes)
            || row.aim.as_ref().is_some_and(|aim| aim.is_timed)
            || timed.contains(&row.name())
    })
}

/// The equations of the walls that act.
fn walls(mechanism: &Mechanism) -> impl Iterator<Item = &ConstraintEquation> {
    mechanism.contacts.iter().filter(|contact| !contact.is_off).map(|contact| &contact.row)
}

/// A motor or a wall that moves with time, if there is one.
pub(super) fn moving(mechanism: &Mechanism) -> Option<&str> {
    let rows = mechanism.constraints.iter().chain(walls(mechanism));
    moved_by_time(mechanism, rows).next().map(ConstraintEquation::name)
}

/// True where forces or torques change with time.
pub(super) fn is_forced(mechanism: &Mechanism) -> bool {
    let timed = timed_on_branches(mechanism);
    mechanism.actions.iter().any(|action| action.law.as_ref().is_some_and(changes))
        || mechanism.forces.iter().any(UserForce::depends_on_time)
        || mechanism.forces.iter().any(|force| timed.contains(&force.name.as_str()))
}

/// True where anything changes with time.
pub(super) fn is_driven(mechanism: &Mechanism) -> bool {
    moving(mechanism).is_some() || is_forced(mechanism)
}

/// The least common period of the drives, of moving walls and of forces that are laws of time \[s\].
pub(super) fn common_period(mechanism: &Mechanism) -> Result<f64, ModesError> {
    let unknown = |name: &str| ModesError::PeriodUnknown(name.to_owned());
    let mut rates: Vec<f64> = Vec::new();
    for row in moved_by_time(mechanism, mechanism.constraints.iter().chain(walls(mechanism))) {
        let of_sum = |law: &&Law| law.acceleration == 0.0 && law.profile.is_none();
        let is_known = |law: &&Law| law.rate == 0.0 || row.is_angle();
        let Some(law) = row.law.as_ref().filter(of_sum).filter(is_known) else {
            return Err(unknown(&format!("`{}`", row.name())));
        };
        rates.extend(frequencies(law).chain((law.rate != 0.0).then_some(law.rate)));
    }
    // A law with more in it than sines is looked at by `check_period`.
    let actions = mechanism.actions.iter().filter_map(|action| action.law.as_ref());
    rates.extend(actions.flat_map(frequencies));
    let periods: Vec<f64> = rates.into_iter().map(|rate| TAU / rate.abs()).collect();
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

/// A mechanism at a time, with its laws on their branches in a state there.
struct MechanismAtTime<'a> {
    mechanism: Cow<'a, Mechanism>,
    time: Time,
}

impl<'a> MechanismAtTime<'a> {
    fn new(mechanism: &'a Mechanism, state: &[Vec<f64>; 2], t: f64) -> Self {
        let there = mechanism.on_branches_of(&moving_at(state, t)).ok().flatten();
        Self { mechanism: there.map_or(Cow::Borrowed(mechanism), Cow::Owned), time: Time::of(t) }
    }

    /// Accelerations, in the units of the coordinates.
    fn pull(&self, [phi, omega]: &[Vec<f64>; 2]) -> DVector<f64> {
        Local::new(&self.mechanism).pull_moving([phi, omega], self.time)
    }

    fn rows(&self) -> impl Iterator<Item = &ConstraintEquation> {
        self.mechanism.constraints.iter().chain(walls(&self.mechanism))
    }
}

/// How far the law or the aim of a row, as it is at two moments, goes between them, and its rates at both.
fn travel(rows: [&ConstraintEquation; 2], times: [Time; 2], [phi, omega]: &[Vec<f64>; 2]) -> (f64, [f64; 2]) {
    let z: Vec<Complex<f64>> = phi.iter().map(|&phi| Complex::unit(phi)).collect();
    let [now, then] = [0, 1].map(|k| {
        let (law, aim) = (rows[k].law.as_ref(), rows[k].aim.as_ref());
        let place = law.map_or(Time::default(), |law| law.angle(times[k]));
        let rate = law.map_or(0.0, |law| law.rates::<f64>(times[k]).0);
        aim.map_or((place, rate), |aim| {
            let at = ConstraintArguments { phi, z: &z, omega };
            (place + Time::of(aim.value(times[k], phi, &z)), rate + aim.drive(times[k], at))
        })
    });
    ((then.0 - now.0).hi, [now.1, then.1])
}

/// True where a row is the same at two moments so many periods apart, but for whole turns that nothing
/// feels.
fn is_same(
    local: &Local,
    rows: [&ConstraintEquation; 2],
    times: [Time; 2],
    state: &[Vec<f64>; 2],
    [period, later]: [f64; 2],
) -> bool {
    let (mut travel, [rate, then]) = travel(rows, times, state);
    let of_aim = |angles: &[usize]| {
        let [body, base] = [0, 1].map(|k| angles.get(k).copied());
        body.is_some_and(|body| local.turns.is_of_row(&RowMeasure::Angle { body, base }))
    };
    let is_turning = local.turns.is_of_row(&rows[0].measure)
        || rows[0].aim.as_ref().is_some_and(|aim| of_aim(&aim.angles));
    if is_turning {
        travel -= TAU * (travel / TAU).round();
    }
    let unit = if rows[0].is_in_radians() { 1.0 } else { local.mechanism.units.length };
    let within = SAME * later * rate.abs().max(then.abs()).max(unit * TAU / period);
    // Where a law has no value it is not compared.
    !((rate - then).abs() > within || travel.abs() > within * period)
}

/// The start at rest, and states in motion in which forces of place and rates act as well.
fn states(local: &Local, phi: &[f64]) -> Vec<[Vec<f64>; 2]> {
    let spread =
        |number: usize, k: usize| local.unit[k] * libm::sin(GOLDEN_ANGLE * (number * (k + 1)) as f64);
    let still = [phi.to_vec(), vec![0.0; phi.len()]];
    let in_motion = (1..=IN_MOTION).map(|number| {
        let rate = |k: usize| spread(number + IN_MOTION, k) / local.mechanism.units.time;
        [
            phi.iter().enumerate().map(|(k, phi)| phi + spread(number, k)).collect(),
            (0..phi.len()).map(rate).collect(),
        ]
    });
    std::iter::once(still).chain(in_motion).collect()
}

/// What the drives, the walls and the forces are after periods, also after those of the scene's run, is what
/// they were; forces are compared at the positions of a start and beside it.
pub(super) fn check_period(
    mechanism: &Mechanism,
    local: &Local,
    phi: &[f64],
    period: f64,
    until: f64,
) -> Result<(), ModesError> {
    let differs = |what: String| ModesError::NotPeriodic { period, what };
    let last = (until / period).floor().min(LATEST);
    let laters: Vec<f64> = LATER.into_iter().chain((last >= 1.0).then_some(last)).collect();
    for state in states(local, phi) {
        let (mut largest, mut apart) = (0.0_f64, 0.0_f64);
        for share in LOOKED_AT {
            let now = MechanismAtTime::new(mechanism, &state, share * period);
            let pull = now.pull(&state);
            for &later in &laters {
                let then = MechanismAtTime::new(mechanism, &state, (share + later) * period);
                let times = [now.time, then.time];
                for (row, after) in now.rows().zip(then.rows()) {
                    if !is_same(local, [row, after], times, &state, [period, later]) {
                        return Err(differs(format!("`{}`", row.name())));
                    }
                }
                let after = then.pull(&state);
                // Where formulas have no value nothing is compared.
                if pull.iter().chain(after.iter()).all(|pull| pull.is_finite()) {
                    largest = largest.max(pull.amax()).max(after.amax());
                    apart = apart.max((after - &pull).amax() / later);
                }
            }
        }
        // At one time all may be zero.
        if apart > SAME * largest {
            return Err(differs("the scene's forces".into()));
        }
    }
    Ok(())
}
