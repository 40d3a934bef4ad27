//! `driftless inspect`: everything of a moment.

use super::failure::{Exit, Failure};
use super::flags::{InspectFlags, PlanFlags};
use super::load;
use super::output::{print, print_object};
use crate::dynamics::Mechanism;
use crate::report::inspect::{self, Inspection};
use crate::run::{Limits, Plan, Request, Run, Running};
use crate::scene::{Scene, number};
use std::sync::Arc;

/// Shows a moment of a scene's motion.
///
/// # Errors
/// The scene, or a run that does not reach that moment.
pub fn run(flags: &InspectFlags) -> Result<(), Failure> {
    let (scene, mechanism) = load(&flags.scene)?;
    let inspection = match &flags.at {
        None if flags.plan != PlanFlags::default() => {
            let text =
                "--method, --until and the like: only with --at\nhint: the start is inspected as it is";
            return Err(Failure::new(Exit::Usage, text));
        }
        None => inspect::inspect(&scene, &mechanism),
        Some(at) => moment(flags, &scene, &mechanism, at)?,
    };
    if flags.scene.tell.json {
        print_object(&inspection.object(&scene))
    } else {
        print(&inspection.text(&scene))
    }
}

/// Runs a scene up to a time or the first event of a name, and looks at the motion there.
fn moment(
    flags: &InspectFlags,
    scene: &Scene,
    mechanism: &Arc<Mechanism>,
    at: &str,
) -> Result<Inspection, Failure> {
    let [request] = &flags.plan.requests()[..] else {
        return Err(Failure::new(Exit::Usage, "--stabilize: one for --at\nhint: leave all but one out"));
    };
    let run = |until: f64| {
        let request = Request { until: Some(until), every: Some(until), ..request.clone() };
        let (plan, start) = (Plan::new(scene, mechanism, &request)?, mechanism.start(scene));
        let mut running = Running::new(Run::new(Arc::clone(mechanism), plan, Limits::default(), &start)?);
        running.go(&mut |_| Ok(()), &mut || false)?;
        Ok::<_, Failure>(running)
    };
    let until = match number(at) {
        Some(t) if t > 0.0 => t,
        Some(0.0) => return Ok(inspect::inspect(scene, mechanism)),
        Some(_) => {
            return Err(Failure::new(
                Exit::Usage,
                "--at: must be 0 or later\nhint: times count from the start",
            ));
        }
        None => {
            let names = mechanism.event_names();
            if !names.contains(&at) {
                let known = if names.is_empty() { "it has none".into() } else { names.join(", ") };
                let text = format!("--at {at}: neither a time in s nor an event of the scene\nhint: {known}");
                return Err(Failure::new(Exit::Usage, text));
            }
            let outcome = run(flags.plan.until.unwrap_or(scene.until))?.finish();
            match outcome.events.iter().find(|event| event.name == at) {
                Some(event) => event.t,
                None => {
                    let reached = outcome.last.t;
                    let text =
                        format!("--at {at}: the event does not happen up to {reached} s\nhint: --until");
                    return Err(outcome.stop.map_or(Failure::new(Exit::Usage, text), Failure::from));
                }
            }
        }
    };
    let running = run(until)?;
    let inspection = inspect::inspect_at(running.mechanism(), running.motion());
    let outcome = running.finish();
    match (outcome.stop, outcome.ended_by) {
        (Some(stop), _) => Err(stop.into()),
        (None, Some(event)) if outcome.last.t < until * (1.0 - 1e-9) => {
            let reached = outcome.last.t;
            let text = format!(
                "--at {at}: the event {event} ends the motion at t = {reached} s\nhint: --at {event}, or an \
                    earlier time"
            );
            Err(Failure::new(Exit::Usage, text))
        }
        (None, _) => Ok(inspection),
    }
}
