//! How a run went.

use super::check::{describe, start_changes};
use super::page::{Page, counted, figure, magnitude};
use crate::dynamics::Mechanism;
#[cfg(feature = "files")]
use crate::run::Plan;
#[cfg(feature = "files")]
use crate::run::files::sha256;
use crate::run::{Drift, Outcome, Sample};
use crate::scene::Scene;
use serde_json::{Map, Value, json};
use std::borrow::Cow;
use std::path::Path;

/// The report as one JSON object; `wall_s` \[s\] is the time from the first output row to the last without
/// the reference solution's, which is `trust_wall_s`.
pub fn object(scene: &Scene, mechanism: &Mechanism, outcome: &Outcome) -> Value {
    let Outcome { plan, statistics, drift, .. } = outcome;
    let constraints: Map<String, Value> =
        (drift.constraints.iter().zip(&mechanism.with_all_parts().constraints))
            .map(|((name, [position, velocity]), row)| {
                let levels = json!({
                    "position_max": position.max,
                    "velocity_max": velocity.max,
                    "position_slope": position.slope(),
                    "velocity_slope": velocity.slope(),
                    "unit": row.unit(),
                });
                (name.clone(), levels)
            })
            .collect();
    let stabilizer = (!mechanism.constraints.is_empty())
        .then(|| json!({"energy_j": drift.stabilizer, "max_j": drift.stabilizer_max}));
    let impacts = (!mechanism.contacts.is_empty()).then(|| {
        json!({"count": outcome.impact_count, "energy_lost_j": outcome.impact_loss,
            "first": outcome.impacts})
    });
    let holds = (!mechanism.contacts.is_empty()).then(|| {
        json!({"count": outcome.persistent_contact_count, "time_s": outcome.persistent_contact_time,
            "first": outcome.holds})
    });
    let (trend, trend_error) = drift.energy.trend();
    let mut object = json!({
        "scene": scene.name,
        "method": plan.method.info().name,
        "why": plan.why,
        "settings": super::settings(plan),
        "until": plan.until,
        "steps": statistics.steps,
        "evaluations": statistics.evaluations,
        "rejected": statistics.rejected,
        "jacobians": statistics.jacobians,
        "newton_steps": statistics.newton_steps,
        "wall_s": outcome.wall.as_secs_f64(),
        "trust_wall_s": outcome.trust_wall.as_secs_f64(),
        "final": moment(mechanism, &outcome.last),
        "energy": {
            "kind": drift.kind,
            "max_relative": drift.energy.max,
            "scale": mechanism.energy_scale,
            "slope": drift.energy.slope(),
            "trend": trend,
            "trend_error": trend_error,
        },
        "constraints": constraints,
        "assembly": super::check::assembly(mechanism),
        "singular": drift.singular,
        "stabilizer": stabilizer,
        "impacts": impacts,
        "holds": holds,
        "trust": super::trust::object(outcome.trust.as_ref()),
        "stiffness": plan.stiffness,
        "notes": plan.notes,
        "stop": outcome.stop,
    });
    if let (Value::Object(members), Some(events)) = (&mut object, super::events::object(mechanism, outcome)) {
        members.insert("events".to_owned(), events);
    }
    if let (Value::Object(members), Some(friction)) =
        (&mut object, super::friction::object(mechanism, outcome))
    {
        members.insert("friction".to_owned(), friction);
    }
    if let (Value::Object(members), Some(outputs)) = (&mut object, super::outputs::object(mechanism, outcome))
    {
        members.insert("outputs".to_owned(), outputs);
    }
    object
}

/// Angles, rates, centres of mass of all bodies at one moment.
fn moment(mechanism: &Mechanism, sample: &Sample) -> Value {
    let bodies: Map<String, Value> = (mechanism.own_bodies().iter().enumerate())
        .map(|(k, body)| {
            let ([x, y], [vx, vy]) = (sample.centre[k], sample.velocity[k]);
            (
                body.name.clone(),
                json!({"phi": sample.phi[k], "omega": sample.omega[k], "x": x, "y": y, "vx": vx, "vy": vy}),
            )
        })
        .collect();
    let mut moment = json!({"t": sample.t, "bodies": bodies});
    for (name, k) in mechanism.integrals() {
        moment["integrals"][name] = json!(sample.omega[k]);
    }
    moment
}

/// What `run.json` holds: the report, the resolved scene, versions, hashes; what differs from run to run
/// stands in `timings` alone.
#[cfg(feature = "files")]
pub fn record(scene: &Scene, mechanism: &Mechanism, outcome: &Outcome, trajectory_sha256: &str) -> Value {
    let plan = &outcome.plan;
    let mut report = object(scene, mechanism, outcome);
    let wall = report.as_object_mut().and_then(|members| members.shift_remove("wall_s"));
    let trust_wall = report.as_object_mut().and_then(|members| members.shift_remove("trust_wall_s"));
    let input = as_run(scene, plan).to_input();
    json!({
        "format": 1,
        "versions": {"driftless": env!("CARGO_PKG_VERSION"), "target": target()},
        "hashes": {"scene_sha256": sha256(&input.to_string()), "trajectory_sha256": trajectory_sha256},
        "result": report,
        "resolved_scene": input,
        "timings": {"wall_s": wall, "trust_wall_s": trust_wall},
    })
}

/// The scene with the horizon and the output interval it was run with.
#[cfg(feature = "files")]
pub(super) fn as_run(scene: &Scene, plan: &Plan) -> Scene {
    Scene { until: plan.until, every: plan.every, ..scene.clone() }
}

/// The platform the program was compiled for: `x86_64-linux-gnu`.
#[cfg(feature = "files")]
pub(super) fn target() -> String {
    let environment = match () {
        () if cfg!(target_env = "gnu") => "-gnu",
        () if cfg!(target_env = "musl") => "-musl",
        () if cfg!(target_env = "msvc") => "-msvc",
        () => "",
    };
    format!("{}-{}{environment}", std::env::consts::ARCH, std::env::consts::OS)
}

/// The files written, as the last entry of the page.
pub fn files(folder: &Path, names: &[Cow<'static, str>]) -> String {
    let mut page = Page::default();
    page.entry("files", &format!("{}:", folder.display()));
    page.entry("", &names.join(", "));
    page.into_text()
}

/// Bodies and constraints that the page lists; the record has all.
const LISTED: usize = 24;

/// How many of so many are in the record alone.
fn more(page: &mut Page, count: usize, [one, many]: [&str; 2]) {
    if count > LISTED {
        let others = counted((count - LISTED) as u64, &format!("more {one}"), &format!("more {many}"));
        page.entry("", &format!("{others} in run.json"));
    }
}

/// An energy lost \[J\], without what rounding leaves of nothing.
pub(super) fn loss(lost: f64, scale: f64) -> String {
    if lost.abs() <= 1e-12 * scale { "0".into() } else { figure(lost) }
}

/// The report as a page.
pub fn text(scene: &Scene, mechanism: &Mechanism, outcome: &Outcome) -> String {
    let Outcome { plan, statistics, drift, last, .. } = outcome;
    let mut page = Page::new(&scene.name, &scene.description);
    describe(&mut page, mechanism, plan);
    start_changes(&mut page, mechanism);
    page.entry(
        "cost",
        &format!(
            "{}, {}, {} rejected, {:.3} s",
            counted(statistics.steps, "step", "steps"),
            counted(statistics.evaluations, "evaluation", "evaluations"),
            statistics.rejected,
            outcome.wall.as_secs_f64()
        ),
    );
    if let Some(stop) = &outcome.stop {
        page.entry("stopped", &format!("at t = {} s: {}", figure(stop.t), stop.what));
    }
    final_state(&mut page, mechanism, last);
    drifts(&mut page, mechanism, drift);
    if !mechanism.contacts.is_empty() {
        impacts(&mut page, mechanism, outcome);
    }
    super::outputs::describe(&mut page, mechanism, outcome);
    super::friction::describe(&mut page, mechanism, outcome);
    super::events::describe(&mut page, mechanism, outcome);
    super::trust::describe(&mut page, mechanism, outcome);
    page.into_text()
}

/// Time, angles and rates at the end, with centres of mass and integrals.
fn final_state(page: &mut Page, mechanism: &Mechanism, last: &Sample) {
    page.entry("final state", &format!("t = {} s", figure(last.t)));
    let rows: Vec<Vec<String>> = (mechanism.own_bodies().iter().enumerate().take(LISTED))
        .map(|(k, body)| {
            let ([x, y], [vx, vy]) = (last.centre[k], last.velocity[k]);
            let numbers = [last.phi[k], last.omega[k], x, y, vx, vy];
            std::iter::once(body.name.clone()).chain(numbers.into_iter().map(figure)).collect()
        })
        .collect();
    page.table(&["body", "phi [rad]", "omega [rad/s]", "x [m]", "y [m]", "vx [m/s]", "vy [m/s]"], &rows);
    more(page, mechanism.own_bodies().len(), ["body", "bodies"]);
    for (number, (name, k)) in mechanism.integrals().enumerate() {
        let label = if number == 0 { "integrals" } else { "" };
        page.entry(label, &format!("{name} = {}", figure(last.omega[k])));
    }
}

/// Drift of the energy and of the constraints, and what a stabilizer did about it.
fn drifts(page: &mut Page, mechanism: &Mechanism, drift: &Drift) {
    page.entry(
        "energy drift",
        &format!(
            "{} of {} J at most, slope {} /s",
            magnitude(drift.energy.max),
            figure(mechanism.energy_scale),
            magnitude(drift.energy.slope())
        ),
    );
    if drift.kind != "energy" {
        page.entry("", &format!("measured on {}", drift.kind));
    }
    for ((name, [position, velocity]), row) in
        drift.constraints.iter().zip(&mechanism.with_all_parts().constraints).take(LISTED)
    {
        let unit = row.unit();
        page.entry(
            "constraint",
            &format!(
                "{name}: {} {unit} and {} {unit}/s at most",
                magnitude(position.max),
                magnitude(velocity.max)
            ),
        );
    }
    more(page, drift.constraints.len(), ["constraint", "constraints"]);
    if let Some(singular) = &drift.singular {
        let (smallest, constraint) = (magnitude(singular.smallest), &singular.constraint);
        page.entry(
            "singular values",
            &format!("down to {smallest} of the largest at t = {} s, at {constraint}", figure(singular.t)),
        );
    }
    if drift.stabilizer_max > 0.0 {
        let (now, most) = (magnitude(drift.stabilizer), magnitude(drift.stabilizer_max));
        page.entry("stabilizer", &format!("put in {now} J, {most} J at most"));
    }
}

/// Impacts and lasting contacts.
fn impacts(page: &mut Page, mechanism: &Mechanism, outcome: &Outcome) {
    page.entry(
        "impacts",
        &format!(
            "{}, {} J lost in them",
            outcome.impact_count,
            loss(outcome.impact_loss, mechanism.energy_scale)
        ),
    );
    if outcome.persistent_contact_count > 0 {
        let still = outcome
            .holds
            .iter()
            .filter(|hold| hold.until.is_none())
            .map(|hold| hold.wall.as_str())
            .collect::<Vec<_>>();
        let still =
            if still.is_empty() { String::new() } else { format!(", to the end on {}", still.join(", ")) };
        page.entry(
            "stays on walls",
            &format!(
                "{}, {} s in all{still}",
                outcome.persistent_contact_count,
                figure(outcome.persistent_contact_time)
            ),
        );
    }
}
