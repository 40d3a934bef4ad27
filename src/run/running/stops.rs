//! Why a run ends before its horizon, beside the stops of its method.

use super::super::contact::ContactDriver;
use super::super::drift::Drift;
use super::super::driver::{MOST_TURNS, TOO_OFTEN};
use super::super::event::EventMark;
use super::super::methods::{MethodId, Stabilization};
use super::super::plan::Plan;
use super::super::sample::Sample;
use super::Outcome;
use crate::arithmetic::Scalar;
use crate::arithmetic::shown::estimate;
use crate::dynamics::compile::quoted;
use crate::dynamics::friction::paradox::{HINT, JAMS};
use crate::dynamics::{CompileError, Mechanism, Motion};
use crate::stepping::{Cause, StepError};

/// Relative tolerance from which on rounding is what a run in doubles errs by.
const ROUNDING: f64 = 1e-14;
/// Share of the output interval by which a row may be beside its time.
const BESIDE: f64 = 1e-6;

/// Time before and after a stop, over the mechanism's unit, and how much larger than at both a formula is
/// that grows without bound.
const NEAR: f64 = 1e-3;
const GROWN: f64 = 1e3;
const NO_VALUE: &str = "it divides by zero, or takes a root, logarithm or power of a number that has none: \
    change it, or end the run before by an event";

/// Steps that shrink where surfaces jam, or near singular positions, have another cause than a stiff spring.
pub(super) fn advised(stop: StepError, at: &mut ContactDriver) -> StepError {
    let shrinks = stop.cause == Cause::StepTooSmall;
    if (shrinks || stop.cause == Cause::NotFinite) && at.jams() {
        return StepError { cause: Cause::Friction, what: JAMS.into(), hint: HINT.into(), ..stop };
    }
    let here = at.motion();
    if let Some(stop) = without_value(&stop, &here, &at.whole, &at.off) {
        return stop;
    }
    if !shrinks || !at.has_closed_loops() {
        return stop;
    }
    let hint =
        if stop.method == "taylor" { "--method dp8 with --stabilize projection" } else { "--method taylor" };
    StepError {
        hint: format!("a singular position of the constraints may be near: {hint}, or another tolerance"),
        ..stop
    }
}

/// The same stop with the part whose formula has no finite value there, where it comes of one.
pub(in crate::run) fn without_value(
    stop: &StepError,
    here: &Motion,
    mechanism: &Mechanism,
    off: &[String],
) -> Option<StepError> {
    if !matches!(stop.cause, Cause::StepTooSmall | Cause::NotFinite) {
        return None;
    }
    let part = breaking_formula(here, mechanism, off, stop.step)?;
    let what = format!("the formula of `{part}` has no finite value here");
    Some(StepError { what, hint: NO_VALUE.into(), ..stop.clone() })
}

/// The part whose formula has no finite value where the run has stopped, or within a step of it, or grows
/// without bound there.
fn breaking_formula(here: &Motion, mechanism: &Mechanism, off: &[String], step: f64) -> Option<String> {
    let laws = mechanism.laws.as_ref()?;
    let unit = mechanism.units.time;
    let values = |seconds: f64| {
        let mut motion = here.clone();
        motion.time = motion.time + seconds;
        for (phi, omega) in motion.phi.iter_mut().zip(&here.omega) {
            *phi += omega.scale(seconds);
        }
        mechanism.seen(&motion, |at| {
            let all = laws.formulas.values_by_part(at, &laws.parameters).into_iter();
            all.map(|(name, value)| (name.to_owned(), value)).collect::<Vec<_>>()
        })
    };
    let acts = |name: &String| !off.contains(name);
    let steps = (-14..=-4).map(|decade| 10_f64.powi(decade) * unit).chain([step, 10.0 * step]);
    let lost = std::iter::once(0.0).chain(steps).find_map(|seconds| {
        values(seconds).into_iter().find(|(name, value)| acts(name) && !value.is_finite())
    });
    let grown = || {
        let [before, now, after] = [-NEAR * unit, 0.0, NEAR * unit].map(values);
        let largest = |k: usize| before[k].1.abs().max(after[k].1.abs());
        let grows = |&k: &usize| acts(&now[k].0) && now[k].1.abs() > GROWN * largest(k);
        (0..now.len()).find(grows).map(|k| now[k].0.clone())
    };
    lost.map(|(name, _)| name).or_else(grown)
}

/// Loops and sliders that nothing projects let go at singular positions, and the motion goes on smoothly on
/// another branch: such a run is no success.
pub(super) fn came_apart(plan: &Plan, drift: &Drift, sample: &Sample) -> Option<StepError> {
    let is_loose = matches!(plan.stabilization, Stabilization::None | Stabilization::Baumgarte)
        && !matches!(plan.method, MethodId::Rattle(_));
    let off = sample.imbalance.abs();
    let weakest = drift.constraints.get(sample.weakest).map_or("", |(name, _)| name);
    (is_loose && off > drift.apart()).then(|| StepError {
        cause: Cause::BranchLost,
        method: plan.method.to_string(),
        t: sample.t,
        step: plan.step.unwrap_or(0.0),
        what: match drift.singular {
            Some(_) => format!(
                "the energy balance is off by {} of its scale: constraint {weakest} or its like has let \
                go",
                estimate(off)
            ),
            None => format!(
                "the energy balance is off by {} of its scale, and nothing puts loops and sliders back",
                estimate(off)
            ),
        },
        hint: "--method dp8 or taylor with --stabilize projection, or a tighter tolerance".into(),
    })
}

/// An event from outside asks for a body that is not there.
pub(super) fn foreign(plan: &Plan, event: &str) -> StepError {
    StepError {
        cause: Cause::Unsuited,
        method: plan.method.to_string(),
        t: 0.0,
        step: plan.step.unwrap_or(0.0),
        what: CompileError::ForeignEvent(event.into()).to_string(),
        hint: "take bodies and points from the mechanism of this run".into(),
    }
}

/// The events from outside that a run looked for are not there where it goes on.
pub(super) fn not_given(outcome: &Outcome, events: &[EventMark]) -> StepError {
    let names: Vec<String> = events.iter().map(|event| event.name.clone()).collect();
    let [does, was] = if names.len() == 1 { ["event", "is"] } else { ["events", "are"] };
    StepError {
        cause: Cause::Unsuited,
        method: outcome.plan.method.to_string(),
        t: outcome.last.t,
        step: outcome.plan.step.unwrap_or(0.0),
        what: format!("{does} {} {was} from outside the scene, and not given again", quoted(&names)),
        hint: "give them to `Running::with_events`".into(),
    }
}

/// A method that says it is at an output time and is not, beyond a part of the interval that no row shows:
/// what is written would be of another moment.
pub(super) fn missed(plan: &Plan, row: u64, sample: &Sample) -> Option<StepError> {
    let until = plan.time(row).hi;
    let allowed = BESIDE * plan.every + 16.0 * f64::EPSILON * until.abs();
    ((sample.t - until).abs() > allowed).then(|| StepError {
        cause: Cause::Unsuited,
        method: plan.method.to_string(),
        t: sample.t,
        step: plan.step.unwrap_or(0.0),
        what: format!("its steps end beside the output time {until} s"),
        hint: "let the last step before an output time be a shorter one".into(),
    })
}

/// Doubles do not count further turns: the angle shown would be another one.
pub(super) fn uncounted(plan: &Plan, sample: &Sample) -> Option<StepError> {
    let angles = &sample.phi[..sample.centre.len()];
    angles.iter().any(|phi| phi.abs() > MOST_TURNS as f64 * std::f64::consts::TAU).then(|| StepError {
        cause: Cause::NotFinite,
        method: plan.method.to_string(),
        t: sample.t,
        step: plan.step.unwrap_or(0.0),
        what: TOO_OFTEN[0].into(),
        hint: TOO_OFTEN[1].into(),
    })
}

pub(super) fn not_finite(plan: &Plan, t: f64) -> StepError {
    let what = "energies, torques or velocities are beyond the numbers a double holds".into();
    let hint = "look for masses, rates or stiffnesses far out of proportion".into();
    StepError {
        cause: Cause::NotFinite,
        method: plan.method.to_string(),
        t,
        step: plan.step.unwrap_or(0.0),
        what,
        hint,
    }
}

/// True where rounding, and not its tolerance, is what a run in doubles errs by.
pub(super) fn is_at_rounding(plan: &Plan) -> bool {
    !plan.extended && plan.tolerance.is_some_and(|tolerance| tolerance.relative <= ROUNDING)
}

pub(super) fn drift_stop(plan: &Plan, t: f64, what: String) -> StepError {
    let instead = "state another limit with --max-energy-drift or --max-constraint-drift";
    let hint = match plan.step {
        Some(_) => format!("shorten the step, or {instead}"),
        None if is_at_rounding(plan) => {
            format!("no tolerance is tighter: try another --method, or {instead}")
        }
        None => format!("tighten the tolerance, or {instead}"),
    };
    StepError {
        cause: Cause::DriftLimit,
        method: plan.method.to_string(),
        t,
        step: plan.step.unwrap_or(0.0),
        what,
        hint,
    }
}
