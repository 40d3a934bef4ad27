//! What `kinematics` found, as a page, a JSON object, a table and charts.

#[cfg(feature = "charts")]
use super::drawing::{MechanismDrawing, names_of};
use super::outputs::{note_unknown, told};
use super::page::{Page, counted, figure};
#[cfg(feature = "charts")]
use crate::chart::{
    self, ChartError, FILE_RESOLUTION, MechanismChart, OutputSeries, OutputsChart, Picture, Pose, plain,
};
use crate::run::Kinematics;
#[cfg(feature = "files")]
use crate::run::kinematics::Position;
use crate::run::kinematics::{DeadCentre, Limit, Range};
#[cfg(feature = "files")]
use crate::run::table::put_number;
use serde_json::{Value, json};
#[cfg(feature = "files")]
use std::fmt::Write;

/// Other assemblies that are listed; more are counted.
const LISTED: usize = 8;

/// One object: `drive`, `positions` (their number), `limits`, `dead_centres`, `change_points`, `extremes`,
/// `assemblies`, `left_out`.  The value of an extreme that is without bound or not known is null.
pub fn object(found: &Kinematics) -> Value {
    let range = [found.positions.first(), found.positions.last()].map(|at| at.map(|at| at.drive));
    let extremes = found.ranges.iter().map(|Range { name, unit, min, max }| {
        let [min, max] = [min, max].map(|[value, drive]| json!({"value": value, "drive": drive}));
        (name.clone(), json!({"unit": unit, "min": min, "max": max}))
    });
    let names = names(found);
    let branch = |at: &Vec<f64>| -> Value {
        names
            .iter()
            .zip(at)
            .map(|((name, _), value)| (name.clone(), json!(value)))
            .collect::<serde_json::Map<_, _>>()
            .into()
    };
    json!({
        "scene": found.scene.name,
        "drive": {
            "name": found.drive, "unit": found.unit, "rate": found.rate, "from": range[0], "to": range[1],
            "is_turn": found.is_turn, "closes": found.is_closed,
        },
        "positions": found.positions.len(),
        "limits": found.limits,
        "dead_centres": found.dead_centres,
        "change_points": found.change_points,
        "extremes": extremes.collect::<serde_json::Map<_, _>>(),
        "assemblies": 1 + found.branches.len(),
        "other_assemblies": found.branches.iter().map(branch).collect::<Vec<_>>(),
        "least_norm": !found.mechanism.redundant().is_empty(),
        "left_out": found.left_out,
    })
}

/// Names and units of the coordinates that are the scene's own.
fn names(found: &Kinematics) -> Vec<(String, &'static str)> {
    let mechanism = &found.mechanism;
    let bodies = mechanism.own_bodies().iter().map(|body| (format!("{}.phi", body.name), "rad"));
    let more = (mechanism.bodies.len()..mechanism.coordinates()).map(|k| (mechanism.coordinate_name(k), "m"));
    bodies.chain(more).collect()
}

/// The page.
pub fn text(found: &Kinematics) -> String {
    let mut page = Page::new(&found.scene.name, &found.scene.description);
    let unit = found.unit;
    let ends = [found.positions.first(), found.positions.last()].map(|at| at.map_or(f64::NAN, |at| at.drive));
    let turn = if found.is_turn && found.limits.is_empty() { ", one turn" } else { "" };
    page.entry(
        "drive",
        &format!(
            "{} from {} to {} {unit}{turn}, at {} {unit}/s",
            found.drive,
            figure(ends[0]),
            figure(ends[1]),
            figure(found.rate)
        ),
    );
    page.entry("positions", &counted(found.positions.len() as u64, "position", "positions"));
    if found.is_turn && found.limits.is_empty() && !found.is_closed {
        page.entry(
            "",
            "after the turn the mechanism is not where it was: it needs more turns, or has \
            changed its branch",
        );
    }
    for Limit { drive, in_line, is_fold } in &found.limits {
        let kind = if *is_fold { "the range ends" } else { "no way on was found" };
        page.entry("limit", &format!("{kind} at {} {unit}{}", figure(*drive), lined(in_line)));
    }
    for DeadCentre { drive, name, value, in_line } in &found.dead_centres {
        let text = format!(
            "{name} turns back at {}, with {} at {} {unit}{}",
            figure(*value),
            found.drive,
            figure(*drive),
            lined(in_line)
        );
        page.entry("dead centre", &text);
    }
    for drive in &found.change_points {
        page.entry(
            "change point",
            &format!("ways of motion cross at {} {unit}; the way straight on was taken", figure(*drive)),
        );
    }
    let rows: Vec<Vec<String>> = (found.ranges.iter())
        .map(|Range { name, unit, min, max }| {
            let numbers = [min[0], min[1], max[0], max[1]];
            std::iter::once(format!("{name} [{unit}]")).chain(numbers.into_iter().map(told)).collect()
        })
        .collect();
    let at = format!("at [{unit}]");
    page.entry("extremes", "over the whole range, between positions as well");
    page.table(&["column", "least", &at, "largest", &at], &rows);
    note_unknown(&mut page, &rows);
    if !found.mechanism.redundant().is_empty() {
        page.entry(
            "",
            "constraints are redundant: forces that rigid bodies leave open are those of least norm",
        );
    }
    assemblies(&mut page, found);
    if !found.left_out.is_empty() {
        page.entry("left out", &found.left_out.join(", "));
    }
    page.into_text()
}

/// How many ways there are to assemble the mechanism at the start, with the coordinates of the others.
fn assemblies(page: &mut Page, found: &Kinematics) {
    let ways = ["way to assemble it at the start", "ways to assemble it at the start"];
    page.entry("assemblies", &counted(1 + found.branches.len() as u64, ways[0], ways[1]));
    let names = names(found);
    for (k, branch) in found.branches.iter().take(LISTED).enumerate() {
        let all: Vec<String> = names
            .iter()
            .zip(branch)
            .map(|((name, _), value)| {
                // Not of the rounding about zero.
                format!("{name} {}", figure((value * 1e12).round() / 1e12))
            })
            .collect();
        page.entry(if k == 0 { "others" } else { "" }, &all.join(", "));
    }
}

fn lined(in_line: &[String]) -> String {
    if in_line.is_empty() { String::new() } else { format!(", in line at {}", in_line.join(", ")) }
}

/// All positions as a table: drive, time, coordinates with rates and accelerations, force of the drive,
/// outputs, transmission angles.
#[cfg(feature = "files")]
pub fn table(found: &Kinematics) -> Vec<u8> {
    let unit = found.unit;
    let mut text = format!("{} [{unit}],t [s]", found.drive);
    let (names, bodies) = (names(found), found.mechanism.own_bodies().len());
    let skipped = found.mechanism.bodies.len() - bodies;
    let index = |k: usize| if k < bodies { k } else { k + skipped };
    for (name, unit) in &names {
        let [rate, acceleration] = if let Some(body) = name.strip_suffix(".phi") {
            [format!("{body}.omega"), format!("{body}.alpha")]
        } else {
            [format!("{name}'"), format!("{name}''")]
        };
        let _ = write!(text, ",{name} [{unit}],{rate} [{unit}/s],{acceleration} [{unit}/s²]");
    }
    let _ = write!(text, ",{} [{}]", found.name_of_force(), found.unit_of_force());
    for (name, unit) in found.mechanism.outputs.iter().flat_map(|outputs| outputs.heads()) {
        let _ = write!(text, ",{name} [{unit}]");
    }
    for one in &found.transmissions {
        let _ = write!(text, ",{} [rad]", one.name());
    }
    text.push('\n');
    let mut text = text.into_bytes();
    for Position { drive, t, phi, omega, alpha, force, transmission, outputs } in &found.positions {
        let mut put = |value: &f64| put_number(&mut text, *value);
        [drive, t].into_iter().for_each(&mut put);
        (0..names.len())
            .map(index)
            .for_each(|k| [&phi[k], &omega[k], &alpha[k]].into_iter().for_each(&mut put));
        std::iter::once(force).chain(outputs).chain(transmission).for_each(&mut put);
        text.pop();
        text.push(b'\n');
    }
    text
}

/// The mechanism with its coupler curves, and everything over the drive: names of files and their content.
///
/// # Errors
/// Drawing or encoding fails.
#[cfg(feature = "charts")]
pub fn charts(found: &Kinematics) -> Result<Vec<(&'static str, Picture)>, ChartError> {
    let drawing = MechanismDrawing { scene: &found.scene, mechanism: &found.mechanism };
    let mut caption = vec![format!("scene {}", plain(&found.scene.name))];
    if let (Some(first), Some(last)) = (found.positions.first(), found.positions.last()) {
        let [from, to] = [first, last].map(|at| figure(at.drive).replace('-', "−"));
        caption.push(format!("{} from {from} to {to} {}", plain(&found.drive), found.unit));
    }
    let traced = drawing.traced();
    let trail = |place| found.positions.iter().map(|at| drawing.place(place, &at.phi)).collect();
    let mechanism = MechanismChart {
        title: drawing.title().unwrap_or_else(|| "The mechanism over its range".to_owned()),
        caption: caption.clone(),
        sketch: drawing.sketch(),
        poses: poses(found, &drawing),
        trails: traced.iter().map(trail).collect(),
        names: drawing.names(),
        horizon: None,
    };
    let drives: Vec<f64> = found.positions.iter().map(|at| at.drive).collect();
    let outputs =
        found.ranges.iter().enumerate().map(|(column, Range { name, unit, min, max })| OutputSeries {
            name: plain(name),
            unit: unit.replace(' ', "·"),
            time: drives.clone(),
            value: found.positions.iter().map(|at| at.column(column)).collect(),
            extremes: [*min, *max].into_iter().filter(|extreme| extreme[0].is_finite()).collect(),
        });
    // An output may be what the table has as the force of the drive: one curve is enough.
    let mut outputs: Vec<OutputSeries> = outputs.collect();
    let force = outputs.first().cloned().unwrap_or_default();
    outputs.retain(|output| {
        output.name == force.name || output.unit != force.unit || !is_same(&output.value, &force.value)
    });
    let range = if found.is_turn && found.limits.is_empty() { "one turn" } else { "the range" };
    let outputs = OutputsChart {
        title: format!("{} over {range} of {}", names_of(&outputs), plain(&found.drive)),
        caption,
        outputs,
        quantity: None,
        over: Some([plain(&found.drive), found.unit.to_owned()]),
        is_coarse: false,
        horizon: None,
        settled_from: None,
    };
    Ok(vec![
        ("mechanism", chart::mechanism(&mechanism, FILE_RESOLUTION)?),
        ("kinematics", chart::outputs(&outputs, FILE_RESOLUTION)?),
    ])
}

/// Whether two curves cannot be told apart.
#[cfg(feature = "charts")]
fn is_same(a: &[f64], b: &[f64]) -> bool {
    let size = a.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-9 * size || a.is_nan() && b.is_nan())
}

/// Eight poses at equal distances, the first of the range last and in full.
#[cfg(feature = "charts")]
fn poses(found: &Kinematics, drawing: &MechanismDrawing<'_>) -> Vec<Pose> {
    let count = found.positions.len();
    let ghosts = (1..8).map(|k| k * count / 8).rev().chain([0]);
    ghosts.filter_map(|k| found.positions.get(k)).map(|at| drawing.pose(&at.phi, &at.omega)).collect()
}
