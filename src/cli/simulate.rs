//! `driftless run`: march, and keep what came of it.

use super::failure::Failure;
use super::flags::RunFlags;
use super::output::{print, print_objects};
use super::progress::Progress;
use crate::dynamics::Mechanism;
use crate::report;
use crate::run::files::{RECORD, TRAJECTORY};
use crate::run::table::Table;
use crate::run::{Folder, Outcome, Plan, Run, RunError, Sample, march};
use crate::scene::Scene;
use serde_json::json;
use std::sync::Arc;

/// Every file a run may leave; those of an earlier run in the same folder go with it.
const FILES: &[&str] =
    &[TRAJECTORY, RECORD, "mechanism.png", "angles.png", "energy_drift.png", "constraint_drift.png", "torque_power.png", "mechanism.gif"];

/// A run that has ended.
struct Done {
    outcome: Outcome,
    folder: Folder,
    failure: Option<Failure>,
}

/// Runs a scene, once for each stabilization given.
///
/// # Errors
/// The scene, a plan, a folder, the method or a limit; files of what was reached are kept.
pub fn run(flags: &RunFlags) -> Result<(), Failure> {
    let (scene, mechanism) = super::load(&flags.scene)?;
    // All plans stand before the first run: a pairing that is refused costs nothing.
    let plans: Vec<Plan> = flags.plan.requests().iter().map(|request| Plan::new(&scene, &mechanism, request)).collect::<Result<_, _>>()?;
    let mut done = Vec::new();
    for plan in plans {
        done.push(run_plan(plan, &scene, &mechanism, flags)?);
    }
    overlay(&scene, &mechanism, &done, flags)?;
    tell(&scene, &mechanism, &done, flags)?;
    done.into_iter().find_map(|done| done.failure).map_or(Ok(()), |failure| Err(failure.told()))
}

/// Runs one plan in a folder of its own.
fn run_plan(plan: Plan, scene: &Scene, mechanism: &Arc<Mechanism>, flags: &RunFlags) -> Result<Done, Failure> {
    let run = Run::new(Arc::clone(mechanism), plan, flags.limits(), &mechanism.start(scene))?;
    let plan = run.plan();
    flags.scene.remark(&format!("{}; {}", report::setting(plan), plan.why.as_deref().unwrap_or("as asked for")));
    for note in &plan.notes {
        flags.scene.remark(note);
    }
    let path = flags.out.join(&scene.name).join(plan.folder(mechanism));
    let mut folder = Folder::open(&path, flags.force)?;
    let (outcome, trajectory_sha256) = record(run, scene, mechanism, &mut folder, flags)?;
    draw(scene, mechanism, &outcome, &mut folder, flags)?;
    let text = format!("{:#}\n", report::result::record(scene, mechanism, &outcome, &trajectory_sha256));
    folder.write(RECORD, text.as_bytes())?;
    let failure = outcome.stop.clone().map(Failure::from);
    Ok(Done { outcome, folder, failure })
}

/// Marches and writes the trajectory as it comes.
fn record(run: Run, scene: &Scene, mechanism: &Mechanism, folder: &mut Folder, flags: &RunFlags) -> Result<(Outcome, String), Failure> {
    let unwritten = |error: csv::Error| Failure::from(folder.failed(TRAJECTORY, error.into()));
    let mut table = Table::new(mechanism, folder.begin(TRAJECTORY)?).map_err(unwritten)?;
    let mut progress = Progress::new(&scene.name, run.plan().until, flags.scene.quiet);
    let outcome = march(run, &mut |sample: &Sample| {
        table.write(sample)?;
        progress.see(sample.t);
        Ok(())
    });
    progress.finish();
    let outcome = outcome.map_err(|error| match error {
        RunError::Observer(error) => Failure::from(folder.failed(TRAJECTORY, error)),
        error => error.into(),
    })?;
    let stream = table.finish().map_err(|error| folder.failed(TRAJECTORY, error))?;
    if flags.force {
        // Nothing of an older run may stand beside the new trajectory.
        folder.clear(&FILES[1..])?;
    }
    let hash = folder.keep(stream)?;
    flags.scene.remark(&format!("wrote {}", folder.path().join(TRAJECTORY).display()));
    Ok((outcome, hash))
}

#[cfg(feature = "charts")]
fn draw(scene: &Scene, mechanism: &Mechanism, outcome: &Outcome, folder: &mut Folder, flags: &RunFlags) -> Result<(), Failure> {
    for chart in report::charts::wanted(mechanism, !flags.no_charts, flags.gif) {
        let content = report::charts::draw(chart, scene, mechanism, outcome)?;
        folder.write(chart.file(), &content)?;
        flags.scene.remark(&format!("drew {}", folder.path().join(chart.file()).display()));
    }
    Ok(())
}

/// Constraint drift of several runs in one chart, beside their folders.
#[cfg(feature = "charts")]
fn overlay(scene: &Scene, mechanism: &Mechanism, done: &[Done], flags: &RunFlags) -> Result<(), Failure> {
    if done.len() < 2 || mechanism.rows.is_empty() || flags.no_charts {
        return Ok(());
    }
    let outcomes: Vec<&Outcome> = done.iter().map(|done| &done.outcome).collect();
    let content = report::charts::overlay(scene, mechanism, &outcomes)?;
    let mut folder = Folder::open(&flags.out.join(&scene.name), true)?;
    folder.write("constraint_drift.png", &content)?;
    flags.scene.remark(&format!("drew {}", folder.path().join("constraint_drift.png").display()));
    Ok(())
}

#[cfg(not(feature = "charts"))]
fn overlay(_: &Scene, _: &Mechanism, _: &[Done], _: &RunFlags) -> Result<(), Failure> {
    Ok(())
}

#[cfg(not(feature = "charts"))]
fn draw(_: &Scene, _: &Mechanism, _: &Outcome, _: &mut Folder, _: &RunFlags) -> Result<(), Failure> {
    Ok(())
}

/// Prints the results.
fn tell(scene: &Scene, mechanism: &Mechanism, done: &[Done], flags: &RunFlags) -> Result<(), Failure> {
    if flags.scene.json {
        let object = |Done { outcome, folder, failure }: &Done| {
            let mut object = report::result::object(scene, mechanism, outcome);
            object["folder"] = json!(folder.path().display().to_string());
            object["files"] = json!(folder.files().iter().map(|file| file.display().to_string()).collect::<Vec<_>>());
            if let Some(failure) = failure {
                object["error"] = failure.object();
            }
            object
        };
        return print_objects(done.iter().map(object).collect());
    }
    if flags.scene.quiet {
        return Ok(());
    }
    let page = |Done { outcome, folder, .. }: &Done| {
        report::result::text(scene, mechanism, outcome) + &report::result::files(folder.path(), folder.names())
    };
    print(&done.iter().map(page).collect::<Vec<_>>().join("\n"))
}
