//! Whole turns of given angles: rows measure an angle modulo turns, so that a step too long for what pulls at
//! a motor can lose some.

use super::methods::Stabilization;
use super::plan::Plan;
use super::sample::Sample;
use crate::dynamics::constraint::RowMeasure;
use crate::dynamics::{Mechanism, Motion, Time};
use crate::scene::Law;
use crate::stepping::{Cause, StepError};
use std::f64::consts::TAU;

/// The given angles that are rows, and how far they are from their laws.
#[derive(Clone, Debug)]
pub struct Turns(Vec<Angle>);

#[derive(Clone, Debug)]
struct Angle {
    name: String,
    body: usize,
    base: Option<usize>,
    /// Whole turns off at the start.
    off: f64,
}

impl Angle {
    /// Whole turns between a law and an angle at a time \[s\].
    fn off(&self, law: &Law, t: Time, phi: impl Fn(usize) -> f64) -> f64 {
        let (angle, _, turns) = law.winding(t);
        let given = phi(self.body) - self.base.map_or(0.0, phi);
        ((given - angle.hi) / TAU - turns).round()
    }
}

impl Turns {
    /// Those of a motion about to start; none where given angles are eliminated, which keep their laws to the
    /// last bit.
    pub fn new(mechanism: &Mechanism, plan: &Plan, start: &Motion) -> Self {
        let is_kept = plan.stabilization != Stabilization::Elimination;
        // A motor that may be switched off has no law any more then.
        let rows = mechanism.constraints.iter().filter(|row| is_kept && !mechanism.may_be_off(&row.name));
        let angles = rows.filter_map(|row| {
            let (RowMeasure::Angle { body, base }, Some(law)) = (&row.measure, &row.law) else { return None };
            let mut angle = Angle { name: row.name().into(), body: *body, base: *base, off: 0.0 };
            angle.off = angle.off(law, start.time, |k| start.unwrapped(k));
            Some(angle)
        });
        Self(angles.collect())
    }

    /// Why the run is no success where an angle has left its law by whole turns; the mechanism has its laws
    /// on the branches that hold at the sample.
    pub fn lost(&self, mechanism: &Mechanism, plan: &Plan, sample: &Sample) -> Option<StepError> {
        let lost = |angle: &&Angle| {
            let row = mechanism.constraints.iter().find(|row| row.name() == angle.name);
            let law = row.and_then(|row| row.law.as_ref());
            law.is_some_and(|law| angle.off(law, Time::from(sample.t), |k| sample.phi[k]) != angle.off)
        };
        self.0.iter().find(lost).map(|angle| StepError {
            cause: Cause::BranchLost,
            method: plan.method.to_string(),
            t: sample.t,
            step: plan.step.unwrap_or(0.0),
            what: format!(
                "constraint {} has lost whole turns: a step was too long for what pulls at it",
                angle.name
            ),
            hint: "a shorter --every with dop853, else a smaller --step or --rtol".into(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::{MethodId, Request};
    use crate::scene::read_scene;

    #[test]
    fn turns_lost_by_a_motor_are_seen_however_it_is_kept() {
        let scene = read_scene("examples/scenes/motor.json".as_ref(), &[]).expect("a scene");
        let mechanism = Mechanism::new(&scene).expect("equations");
        let start = mechanism.start(&scene);
        for stabilize in Stabilization::ALL {
            let request =
                Request { method: Some(MethodId::Dp8), stabilize: Some(stabilize), ..Request::default() };
            let plan = Plan::new(&scene, &mechanism, &request).expect("a sensible pairing");
            let turns = Turns::new(&mechanism, &plan, &start);
            let t = 0.7;
            let given = scene.motors[0].law.angle(t.into()).hi;
            let cause = |off: f64| {
                let sample = Sample { t, phi: vec![given + off, 0.3], ..Sample::default() };
                turns.lost(&mechanism, &plan, &sample).map(|stop| stop.cause)
            };
            assert_eq!((cause(0.0), cause(1e-3)), (None, None), "{stabilize}");
            // An eliminated angle is its law.
            let expected = (stabilize != Stabilization::Elimination).then_some(Cause::BranchLost);
            assert_eq!((cause(TAU), cause(-2.0 * TAU)), (expected, expected), "{stabilize}");
        }
    }
}
