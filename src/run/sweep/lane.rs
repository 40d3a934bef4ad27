//! A point of a sweep that is integrated in a lane.

use super::point::{Ready, Status, SweepPoint};
use crate::arithmetic::shown::{about, estimate};
use crate::arithmetic::sum::larger;
use crate::arithmetic::{Complex, DoubleDouble, Scalar};
use crate::dynamics::constraint::ConstraintArguments;
use crate::dynamics::kernel::Kernel;
use crate::dynamics::{BodyAngles, Mechanism, Motion};
use crate::run::allowance::{Allowance, AllowanceMoment, EnergyLimit};
use crate::run::driver::{MOST_TURNS, TOO_OFTEN};
use crate::run::flip;
use crate::run::plan::Plan;
use crate::run::running::without_value;
use crate::stepping::taylor::batch::{BatchMember, TakenStep, read};
use crate::stepping::{Cause, StepError};
use std::f64::consts::PI;

/// A point integrated in a lane.
pub(super) struct Lane {
    pub point: SweepPoint,
    /// Energy at the start \[J\].
    reference: DoubleDouble,
    scale: f64,
    /// Both ends of a step.
    seen: [BodyAngles; 2],
    /// What the tolerance explains of the energy's imbalance, and the limit that follows from it.
    allowance: Option<Allowance>,
    limit: EnergyLimit,
}

impl Lane {
    /// For a point about to start, with its energy there \[J\].
    pub(super) fn new(ready: &Ready, reference: DoubleDouble) -> Self {
        Self {
            point: ready.point.clone(),
            reference,
            scale: ready.scale,
            seen: [BodyAngles::default(), BodyAngles::default()],
            allowance: Allowance::new(&ready.mechanism, &ready.plan),
            limit: EnergyLimit::default(),
        }
    }

    /// Looks for a bar that turns over in a step.
    pub(super) fn look(&mut self, bodies: usize, passage: &TakenStep) {
        if !(0..bodies).any(|bar| flip::may_pass(passage.ends(bar), passage.step)) {
            return;
        }
        let body_angles = |after: f64, body_angles: &mut BodyAngles| {
            body_angles.phi.clear();
            body_angles.turns.clear();
            body_angles.omega.clear();
            for bar in 0..bodies {
                let (winding, omega) = passage.at(bar, after);
                // As states are wrapped: an angle of exactly π has not passed it.
                let turns = if winding.abs() <= PI { 0.0 } else { (winding / (2.0 * PI)).round() };
                body_angles.phi.push(winding - 2.0 * PI * turns);
                body_angles.turns.push(turns as i64);
                body_angles.omega.push(omega);
            }
        };
        body_angles(0.0, &mut self.seen[0]);
        body_angles(passage.step, &mut self.seen[1]);
        let [a, b] = &self.seen;
        if flip::can_pass(a, b, passage.step) {
            self.point.flip = flip::search(passage.from.hi, passage.step, &self.seen, &mut |after| {
                let mut there = BodyAngles::default();
                body_angles(after, &mut there);
                there
            });
        }
    }

    /// Takes what a member has come to, whose energy impacts have moved so far \[J\]; false where the point
    /// goes no further.
    pub(super) fn measure(
        &mut self,
        member: &BatchMember,
        moved: DoubleDouble,
        motion: &mut Motion,
        kernel: &mut Kernel<DoubleDouble>,
        stated: Option<f64>,
        plan: &Plan,
    ) -> bool {
        let (bodies, state) = (member.mechanism.bodies.len(), &member.state);
        let coordinates = read(member.mechanism, state, motion);
        let is_counted = 2 * coordinates < state.y.len();
        let work = if is_counted { state.unknown(2 * coordinates) } else { DoubleDouble::ZERO };
        let point = &mut self.point;
        let energy = member.mechanism.energy(kernel, &motion.phi, &motion.omega).total() - work;
        let imbalance = ((energy - self.reference - moved).hi / self.scale).abs();
        point.energy = larger(imbalance, point.energy);
        point.t = state.time.hi;
        point.phi = (0..motion.phi.len()).map(|k| motion.unwrapped(k)).collect();
        point.omega = motion.omega.iter().map(|omega| omega.hi).collect();
        point.steps = member.statistics.steps;
        point.constraint = violation(member.mechanism, motion, &kernel.z, point.constraint);
        if let Some(allowance) = &self.allowance {
            let moment = AllowanceMoment {
                omega: &point.omega,
                translations: &point.phi[bodies..],
                work: work.hi,
                largest: self.scale.max(work.hi.abs()),
                steps: point.steps,
            };
            self.limit.see(allowance, &moment);
        }
        let limit = stated.unwrap_or(self.limit.most);
        let stop = |cause, what: String, hint: &str| StepError {
            cause,
            method: plan.method.to_string(),
            t: point.t,
            step: 0.0,
            what,
            hint: hint.into(),
        };
        let stopped = match &member.stopped {
            Some(stopped) => {
                let named = without_value(stopped, motion, member.mechanism, &[]);
                Some(named.unwrap_or_else(|| stopped.clone()))
            }
            None if point.energy.is_nan() => Some(stop(
                Cause::NotFinite,
                "the energy is not finite".into(),
                "look for rates far out of proportion",
            )),
            None if state.turns.iter().any(|turns| turns.unsigned_abs() > MOST_TURNS) => {
                let [what, hint] = TOO_OFTEN;
                Some(stop(Cause::NotFinite, what.into(), hint))
            }
            None if point.energy > limit => {
                let what = format!(
                    "energy is off by {} of the scale, the limit is {}",
                    about(point.energy),
                    estimate(limit)
                );
                Some(stop(Cause::DriftLimit, what, "tighten the tolerance"))
            }
            None => None,
        };
        if let Some(stopped) = stopped {
            point.status = Status::Stopped(stopped);
            return false;
        }
        true
    }
}

/// The largest violation of any constraint so far, at position and velocity level, at the motion's unit
/// vectors.
fn violation(
    mechanism: &Mechanism,
    motion: &Motion,
    z: &[Complex<DoubleDouble>],
    before: Option<[f64; 2]>,
) -> Option<[f64; 2]> {
    let mut jacobian = vec![DoubleDouble::ZERO; motion.phi.len()];
    mechanism.constraints.iter().fold(before, |most, row| {
        jacobian.fill(DoubleDouble::ZERO);
        let at = ConstraintArguments { phi: &motion.phi, z, omega: &motion.omega };
        let here = row.linearise(motion.time, at, &mut jacobian);
        let rate = jacobian.iter().zip(&motion.omega).fold(here.drive, |rate, (&g, &w)| rate + g * w);
        let [position, velocity] = most.unwrap_or_default();
        Some([larger(here.position.hi.abs(), position), larger(rate.hi.abs(), velocity)])
    })
}
