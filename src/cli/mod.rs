//! The program: its commands, each a few lines around the rooms that do the work.
//!
//! Data go to stdout or into files, progress and messages to stderr.  Exit codes are in [`failure::Exit`].

#[cfg(feature = "charts")]
mod charts;
mod check;
mod compare;
#[cfg(feature = "digits")]
mod digits;
#[doc(hidden)]
pub mod failure;
mod fit;
#[doc(hidden)]
pub mod flags;
mod inspect;
mod interrupt;
mod kinematics;
mod merge;
mod modes;
mod output;
mod progress;
mod resume;
mod sensitivity;
mod simulate;
mod stress;
mod study;
mod sweep;
#[cfg(feature = "charts")]
mod view;

pub use failure::Failure;
pub use flags::{Flags, parse};

use crate::dynamics::{CompileError, Mechanism};
use crate::report;
use crate::report::page::counted;
use crate::scene::{self, Override, Scene, Template};
use clap::CommandFactory;
use failure::Exit;
use flags::{Command, SceneFlags};
use output::{print, print_object};
use std::sync::Arc;

/// Does what the flags ask for.
///
/// # Errors
/// Anything that keeps it from being done, with its exit code.
pub fn run(flags: &Flags) -> Result<(), Failure> {
    #[cfg(unix)]
    interrupt::survive_size_limits()?;
    match &flags.command {
        Command::Check(flags) => check::run(flags),
        Command::Inspect(flags) => inspect::run(flags),
        Command::Run(given) => simulate::run(given, &flags.arguments),
        Command::Sweep(given) => sweep::run(given, &flags.arguments),
        Command::Kinematics(flags) => kinematics::run(flags),
        Command::Modes(flags) => modes::run(flags),
        Command::Sensitivity(flags) => sensitivity::run(flags),
        Command::Fit(flags) => fit::run(flags),
        Command::Compare(flags) => compare::run(flags),
        Command::Resume(flags) => resume::run(flags),
        Command::Merge(flags) => merge::run(flags),
        #[cfg(feature = "charts")]
        Command::View(flags) => view::run(flags),
        Command::Stress(flags) => stress::run(flags),
        Command::Methods { json: true } => print_object(&report::methods::object()),
        Command::Methods { json: false } => print(&report::methods::text()),
        Command::Schema => print_object(&scene::schema()),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Flags::command(), "driftless", &mut script);
            print(&String::from_utf8_lossy(&script))
        }
    }
}

/// Reads the scene with its numbers left open, once it is known to have equations.
fn load_template(flags: &SceneFlags) -> Result<Template, Failure> {
    let text = scene::read_text(&flags.scene)?;
    compile(flags, &text)?;
    let template = flags.template(&text);
    let outputs = flags.output.iter().map(|text| scene::Output::parse(text)).collect();
    Ok(template.with_outputs(outputs))
}

/// Reads and compiles the scene.
fn load(flags: &SceneFlags) -> Result<(Scene, Arc<Mechanism>), Failure> {
    compile(flags, &scene::read_text(&flags.scene)?)
}

/// Compiles the scene of this text.
fn compile(flags: &SceneFlags, text: &str) -> Result<(Scene, Arc<Mechanism>), Failure> {
    let scene = flags.template(text).scene()?;
    let scene = with_outputs(scene, &flags.output)?;
    flags.remark(&format!(
        "read {}: scene {}, {}",
        scene::source_name(&flags.scene),
        scene.name,
        counted(scene.bars.len() as u64, "body", "bodies")
    ));
    for set in &flags.set {
        flags.remark(&format!("set {} to {}", set.path, set.value));
    }
    let mechanism =
        Arc::new(Mechanism::of_sound(&scene, Vec::new()).map_err(|error| placed(flags, text, &error))?);
    settle(flags, &mechanism)?;
    if !flags.tell.quiet {
        let doubts = scene.doubts().into_iter();
        doubts.chain(stays(flags, text, &scene)).for_each(|note| output::message(&format!("note: {note}")));
    }
    Ok((scene, mechanism))
}

/// Why the scene of this text has no equations, and where the part at fault is written.
fn placed(flags: &SceneFlags, text: &str, error: &CompileError) -> Failure {
    let template = flags.template(text);
    let place = error.part().and_then(|(lists, name)| template.place_of(lists, name));
    let place = place.map_or_else(|| format!("{}: ", scene::source_name(&flags.scene)), |place| place + ": ");
    Failure::new(Exit::Scene, format!("{place}{error}"))
}

/// The scene with the outputs of the command line beside its own, or in place of those of the same names.
fn with_outputs(mut scene: Scene, outputs: &[String]) -> Result<Scene, Failure> {
    let names = scene::OutputNames::of(&scene);
    for text in outputs {
        let output = scene::Output::parse(text);
        if let Err(error) = names.bind(&output) {
            let text = format!("--output {text}: {}\nhint: {}", error.problem, error.hint);
            return Err(Failure::new(Exit::Usage, text));
        }
        output.put(&mut scene.outputs);
    }
    Ok(scene)
}

/// What lengths that are set leave where it is.
fn stays(flags: &SceneFlags, text: &str, scene: &Scene) -> Vec<String> {
    if flags.set.is_empty() {
        return Vec::new();
    }
    let template = flags.template(text);
    let note = |set: &Override| {
        let path = template.variable(&set.path).ok()?.path;
        scene::points_that_stay(scene, &path, set.number())
    };
    flags.set.iter().filter_map(note).collect()
}

/// Tells how the start differs from what the scene gives, or refuses it.
fn settle(flags: &SceneFlags, mechanism: &Mechanism) -> Result<(), Failure> {
    let changes = &mechanism.assembly.changes;
    if flags.strict && !changes.is_empty() {
        return Err(Failure::changed(changes));
    }
    if !flags.tell.quiet {
        changes.iter().for_each(|change| output::message(&format!("note: {change}")));
    }
    Ok(())
}
