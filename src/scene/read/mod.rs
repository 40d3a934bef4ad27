//! JSON to [`Scene`], or one precise refusal.
//!
//! Every value is judged where it stands, against the tables of `format`; then the parts against each other
//! in `fit`. The first fault found is the one reported.

mod at;
mod bars;
mod events;
mod friction;
mod joints;
mod judge;
mod laws;
mod loads;
mod names;
mod outputs;
mod resolve;
mod start;
mod tables;

pub(super) use at::{At, Fields};
pub(crate) use at::{is_name, listed, nearest};
pub(super) use start::GivenStart;
pub use tables::{TableFiles, table_files};

use super::error::SceneError;
use super::fit;
use super::format::{LONGEST_FILE, SCENE};
use super::locate::{Located, Text, Texts};
use super::set::{Override, put};
use super::{Coupling, Drive, Motor, Scene};
use crate::arithmetic::shown::plain;
use laws::LoadedParts;
use loads::AnyMotor;
use names::{BarNames, check_constraint_names, named};
use resolve::{FormulaConstants, Resolved};
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

/// Reads the scene in the file `path`, with `overrides` put in from left to right before anything is judged.
///
/// # Errors
/// The file cannot be read ([`SceneError::is_io`]), or what it says is no scene: the error names line,
/// column, field, value, what is allowed, and a hint.
pub fn read_scene(path: &Path, overrides: &[Override]) -> Result<Scene, SceneError> {
    parse_scene(&read_text(path)?, &source_name(path), overrides)
}

/// Reads the text of the scene file `path`, or of standard input where that is `-`.
///
/// # Errors
/// The file cannot be read ([`SceneError::is_io`]), is too long, or is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, SceneError> {
    let file = source_name(path);
    let mut bytes = Vec::new();
    let read = if is_stdin(path) {
        std::io::stdin().lock().take(LONGEST_FILE + 1).read_to_end(&mut bytes)
    } else {
        std::fs::File::open(path).and_then(|opened| opened.take(LONGEST_FILE + 1).read_to_end(&mut bytes))
    };
    read.map_err(|error| SceneError::unreadable(&file, &error))?;
    if bytes.len() as u64 > LONGEST_FILE {
        let hint = "a scene of 10 000 bars fits well into this; is this the right file?";
        return Err(SceneError::whole_file(&file, "is too long", "must be at most 16 MiB", hint));
    }
    String::from_utf8(bytes).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let json = String::from_utf8_lossy(error.as_bytes()).into_owned();
        let texts = vec![Text { set: None, json: without_mark(&json).to_owned() }];
        let source = Texts { file, texts, tables: TableFiles::default() };
        let good = good.saturating_sub(json.len() - source.texts[0].json.len());
        let span = source.span(0, good, good + char::REPLACEMENT_CHARACTER.len_utf8());
        let hint = "save the file as UTF-8; names of bars and hinges are plain ASCII anyway";
        source.refusal(span, "", "not UTF-8", "must be text in UTF-8", hint)
    })
}

/// What messages call the scene file `path`.
pub fn source_name(path: &Path) -> String {
    if is_stdin(path) { "standard input".to_owned() } else { path.display().to_string() }
}

fn is_stdin(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Reads the scene in `text`; `source` is the name of its file in messages.
///
/// # Errors
/// As [`read_scene`], never an I/O error.
pub fn parse_scene(text: &str, source: &str, overrides: &[Override]) -> Result<Scene, SceneError> {
    parse_beside(text, source, overrides, &TableFiles::default())
}

/// The same where files of its tables were read before.
pub(super) fn parse_beside(
    text: &str,
    source: &str,
    overrides: &[Override],
    tables: &TableFiles,
) -> Result<Scene, SceneError> {
    if text.len() as u64 > LONGEST_FILE {
        let hint = "a scene of 10 000 bars fits well into this; is this the right file?";
        return Err(SceneError::whole_file(source, "is too long", "must be at most 16 MiB", hint));
    }
    let (mut source, mut tree) = put_together(text, source, overrides)?;
    source.tables = Arc::clone(tables);
    let resolved = resolve::resolve(&source, &mut tree)?;
    scene(&At { source: &source, node: &tree, path: String::new() }, resolved, fit::fitted)
}

/// Judges a written scene as one that is read, but for its start.
pub(super) fn judge_parts(written: &str) -> Result<(), SceneError> {
    let (source, mut tree) = put_together(written, "", &[])?;
    let resolved = resolve::resolve(&source, &mut tree)?;
    let root = At { source: &source, node: &tree, path: String::new() };
    scene(&root, resolved, |scene, _, _| Ok(scene)).map(|_| ())
}

/// The tree of a scene's text with overrides put in, not judged yet.
pub(super) fn put_together(
    text: &str,
    source: &str,
    overrides: &[Override],
) -> Result<(Texts, Located), SceneError> {
    let mut texts = vec![Text { set: None, json: without_mark(text).to_owned() }];
    texts.extend(overrides.iter().map(Override::text));
    let source = Texts { file: source.to_owned(), texts, tables: TableFiles::default() };
    let mut tree = source.tree(0)?;
    for (number, set) in overrides.iter().enumerate() {
        put(&source, &mut tree, set, source.tree(number + 1)?)?;
    }
    Ok((source, tree))
}

/// Editors on some systems put a byte order mark first; it says nothing about the scene.
fn without_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}

/// The scene with its start, which `fitted` gives it.
fn scene(
    root: &At,
    Resolved { parameters, tables }: Resolved,
    fitted: impl FnOnce(Scene, &fit::Places, &[Option<GivenStart>]) -> Result<Scene, SceneError>,
) -> Result<Scene, SceneError> {
    let fields = root.object(&SCENE)?;
    let name = fields.name("name")?;
    let description = fields.text_or_empty("description")?;
    let gravity = fields.pair("gravity")?;
    let (bars, bar_places) = named(&fields, "bars", bars::bar)?;
    let known = BarNames::of(&bars);
    let (hinges, hinge_places) =
        named(&fields, "hinges", |fields, name| joints::hinge(fields, name, &known))?;
    let (sliders, slider_places) =
        named(&fields, "sliders", |fields, name| joints::slider(fields, name, &known))?;
    let (welds, _) = named(&fields, "welds", |fields, name| joints::weld(fields, name, &known))?;
    let (locks, lock_places) = named(&fields, "locks", |fields, name| joints::lock(fields, name, &known))?;
    let (points, _) = named(&fields, "points", |fields, name| laws::point(fields, name, &known))?;
    let LoadedParts { springs, spring_places, torsion_springs, forces, torques, mut laws } =
        laws::loaded_parts(&fields, &known)?;
    let (potentials, _) = named(&fields, "potentials", laws::potential)?;
    let (events, _) = named(&fields, "events", events::event)?;
    let signals = laws::signals(&fields, &parameters)?;
    let integrals = laws::integrals(&fields, &parameters, &signals, &known)?;
    laws.extend(potentials);
    let constants = FormulaConstants::new(&parameters, &tables);
    let (any, _) =
        named(&fields, "motors", |fields, name| loads::motor(fields, name, &known, &sliders, &constants))?;
    let (motors, motor_places, drives, couplings) = sorted(any);
    let (walls, wall_places) =
        named(&fields, "walls", |fields, name| joints::wall(fields, name, &known, &constants))?;
    check_constraint_names(&fields)?;
    let given = start::starts(&fields, &known)?;
    let [until, every] = times(&fields)?;
    let scene = Scene {
        name,
        description,
        gravity,
        hinges,
        sliders,
        welds,
        locks,
        springs,
        torsion_springs,
        forces,
        torques,
        motors,
        drives,
        couplings,
        walls,
        frictions: friction::all(&hinge_places, &slider_places, &wall_places)?,
        parameters: parameters.iter().map(Into::into).collect(),
        points,
        tables,
        signals,
        integrals,
        laws,
        events,
        outputs: outputs::outputs(&fields)?,
        inactive: fields.optional("inactive").map_or(Ok(Vec::new()), |at| events::names(&at))?,
        until,
        every,
        ..Scene::default()
    };
    let places = fit::Places {
        root,
        bars: &bar_places,
        locks: &lock_places,
        springs: &spring_places,
        motors: &motor_places,
        walls: &wall_places,
    };
    let scene = Scene { bars, ..scene };
    laws::check(root, &scene, &parameters)?;
    outputs::check(root, &scene)?;
    fitted(scene, &places, &given).map(Scene::with_rotors)
}

/// The motors on angles with their places, those on sliders, and those whose aims depend on the mechanism.
fn sorted(any: Vec<AnyMotor>) -> (Vec<Motor>, Vec<At>, Vec<Drive>, Vec<Coupling>) {
    let (mut motors, mut places, mut drives, mut couplings) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for one in any {
        match one {
            AnyMotor::Angle(motor, at) => {
                motors.push(motor);
                places.push(at);
            }
            AnyMotor::Travel(drive) => drives.push(drive),
            AnyMotor::Coupled(coupling) => couplings.push(coupling),
        }
    }
    (motors, places, drives, couplings)
}

/// More outputs than this have no distinct times k·every in doubles.
const MOST_OUTPUTS: f64 = 9_007_199_254_740_992.0;

/// Horizon and output interval.
fn times(scene: &Fields) -> Result<[f64; 2], SceneError> {
    let until = scene.number("until")?;
    let every = scene.number("every")?;
    let every_at = scene.required("every")?;
    if every > until {
        let allowed = format!("must be at most the horizon `until`, {} s", plain(until));
        return Err(every_at.refuse_value(&allowed, "shorten the output interval or lengthen the horizon"));
    }
    if until / every > MOST_OUTPUTS {
        let allowed =
            format!("must be at least {} s: 2⁵³ outputs up to the horizon", plain(until / MOST_OUTPUTS));
        return Err(every_at.refuse_value(&allowed, "beyond that the output times are no longer distinct"));
    }
    Ok([until, every])
}
