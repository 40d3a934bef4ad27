//! `driftless check`: whether a scene fits together, what would run it, and how it starts.

use super::failure::Failure;
use super::flags::CheckFlags;
use super::output::{self, print};
use super::{compile, report};
use crate::run::{Plan, Run};
use crate::scene;
use std::sync::Arc;

/// Validates a scene, and draws its start where wanted.
///
/// # Errors
/// The scene, the plan, or the file of the chart.
pub fn run(flags: &CheckFlags) -> Result<(), Failure> {
    let text = scene::read_text(&flags.scene.scene)?;
    let compiled = compile(&flags.scene, &text);
    #[cfg(feature = "charts")]
    if let Some(file) = &flags.chart {
        draw(flags, &text, file)?;
    }
    let (scene, mechanism) = compiled?;
    let mut plans = Vec::new();
    for request in flags.plan.requests() {
        let plan = Plan::new(&scene, &mechanism, &request)?;
        // That the method can begin is part of the check; measuring Baumgarte's time constant is not.
        let trial = Plan { time_constant: plan.time_constant.or(Some(1.0)), ..plan.clone() };
        Run::new(Arc::clone(&mechanism), trial, Default::default(), &mechanism.start(&scene))?;
        plans.push(plan);
    }
    if flags.scene.tell.json {
        return output::print_objects(
            plans.iter().map(|plan| report::check::object(&scene, &mechanism, plan)).collect(),
        );
    }
    let pages: Vec<String> = plans.iter().map(|plan| report::check::text(&scene, &mechanism, plan)).collect();
    if flags.scene.tell.quiet { Ok(()) } else { print(&pages.join("\n")) }
}

/// Draws the start, or what comes closest to it; nothing where the scene is wrong in another way.
#[cfg(feature = "charts")]
fn draw(flags: &CheckFlags, text: &str, file: &std::path::Path) -> Result<(), Failure> {
    use crate::dynamics::{CompileError, Mechanism};
    let source = scene::source_name(&flags.scene.scene);
    let Ok(scene) = scene::parse_scene(text, &source, &flags.scene.set) else { return Ok(()) };
    let picture = match Mechanism::new(&scene) {
        Ok(mechanism) => report::start::chart(&scene, &mechanism)?,
        Err(CompileError::Impossible { closest, .. }) => report::start::closest(&scene, &closest)?,
        Err(_) => return Ok(()),
    };
    picture.write(file)?;
    if !flags.scene.tell.quiet {
        output::message(&format!("note: drawn in {}", file.display()));
    }
    Ok(())
}
