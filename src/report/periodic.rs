//! Periodic motions with their Floquet multipliers, as a page, a JSON object and charts.

#[cfg(feature = "charts")]
use super::drawing::MechanismDrawing;
#[cfg(feature = "charts")]
use super::modes::Charts;
use super::modes::{by_coordinate, rounded, row, search, starts};
use super::page::{Page, counted, figure};
#[cfg(feature = "charts")]
use crate::chart::{self, ChartError, FILE_RESOLUTION, MechanismChart, MotionGif, Multipliers, plain};
use crate::run::modes::{PeriodicMotion, PeriodicMotions, Stability};
use serde_json::{Value, json};
use std::f64::consts::TAU;

/// Multipliers that the page lists of one motion, and motions that it tells; the record has all.
const LISTED: usize = 12;
const TOLD: usize = 4;
/// Frames of one period, poses of a chart, and places of a path.
#[cfg(feature = "charts")]
const FRAMES: usize = 60;
#[cfg(feature = "charts")]
const POSES: usize = 8;
#[cfg(feature = "charts")]
const PLACES: usize = 240;

/// One object: `period`, `periodic_motions`, each with its start, stability and multipliers.
pub fn object(found: &PeriodicMotions) -> Value {
    let motion = |one: &PeriodicMotion| {
        json!({
            "coordinates": by_coordinate(&found.mechanism, &one.phi),
            "rates": by_coordinate(&found.mechanism, &one.omega),
            "turns": one.turns,
            "residual": one.residual,
            "stability": one.stability,
            "from_start": one.from_start,
            "is_family": one.is_family,
            "is_on_corner": one.is_on_corner,
            "multipliers": one.multipliers,
            "multiplier_rounding": one.multiplier_rounding,
        })
    };
    let mut starts = starts(found.starts, found.asked);
    starts["unstable"] = json!(found.unstable);
    starts["at_rest"] = json!(found.at_rest.unwrap_or(0));
    json!({
        "scene": found.scene.name,
        "degrees_of_freedom": found.degrees_of_freedom,
        "period": found.period,
        "starts": starts,
        "periodic_motions": found.motions.iter().map(motion).collect::<Vec<_>>(),
        "left_out": found.left_out,
    })
}

/// What becomes of a small disturbance, in words.
fn words(one: &PeriodicMotion) -> String {
    let stability = match one.stability {
        Stability::AsymptoticallyStable => "stable, disturbances die away",
        Stability::Unstable => "unstable",
        Stability::Undecided => "stays on a corner or a jump of a law, and no linearization holds",
        Stability::Stable => "stable to first order",
    };
    let family = if one.is_family { "; neighbours may be periodic too" } else { "" };
    format!("{stability}{family}")
}

/// A row of the table of multipliers: of one that is rounding its bounds alone, of others what digits they
/// have.
fn multiplier(k: usize, [re, im]: [f64; 2], rounding: f64, period: f64) -> Vec<String> {
    let size = re.hypot(im);
    if size < rounding {
        let [bound, growth] = [rounding, libm::log(rounding) / period].map(|x| format!("< {}", figure(x)));
        let [number, unknown] = [(k + 1).to_string(), "-".to_owned()];
        return vec![number, unknown.clone(), unknown.clone(), bound, growth, unknown];
    }
    // Beyond nine digits there is nothing but rounding, and sooner where it is small.
    let nine = |x: f64| (x * 1e9).round() / 1e9;
    let least = libm::exp10((libm::log10(rounding / size) - 0.01).ceil()).max(1e-9);
    let growth = (libm::log(size) / least).round() * least / period;
    row(k, &[re, im, nine(size), growth, libm::atan2(im, re) / TAU])
}

/// The page.
pub fn text(found: &PeriodicMotions) -> String {
    let mut page = Page::new(&found.scene.name, &found.scene.description);
    page.entry("freedom", &counted(found.degrees_of_freedom as u64, "degree", "degrees"));
    page.entry("period", &format!("{} s", figure(found.period)));
    let motions = counted(found.motions.len() as u64, "periodic motion", "periodic motions");
    search(&mut page, found.starts, &motions, found.asked);
    let is_told = |k: usize, one: &PeriodicMotion| k < TOLD || one.from_start;
    for (k, one) in found.motions.iter().enumerate().filter(|(k, one)| is_told(*k, one)) {
        let start = if one.from_start { ", next to the start" } else { "" };
        page.entry("motion", &format!("{}: {}{start}", k + 1, words(one)));
        let name = |k: usize| found.mechanism.coordinate_name(k);
        let places = one.phi.iter().zip(&one.omega).enumerate();
        let places: Vec<String> = places
            .map(|(k, (phi, omega))| {
                let unit = if k < found.mechanism.bodies.len() { "rad" } else { "m" };
                format!("{} {} {unit} at {} {unit}/s", name(k), rounded(*phi), rounded(*omega))
            })
            .collect();
        page.entry("", &format!("begins at {}", places.join(", ")));
        page.entry("", &format!("closes to {:.1e}", one.residual));
        let rows: Vec<Vec<String>> = (one.multipliers.iter().take(LISTED).enumerate())
            .map(|(k, value)| multiplier(k, *value, one.multiplier_rounding, found.period))
            .collect();
        if !rows.is_empty() {
            page.table(&["multiplier", "Re", "Im", "magnitude", "growth [1/s]", "turns a period"], &rows);
        }
        if one.multipliers.len() > LISTED {
            page.entry("", &format!("{} more multipliers in the record", one.multipliers.len() - LISTED));
        }
    }
    let untold = found.motions.iter().enumerate().filter(|(k, one)| !is_told(*k, one)).count();
    if untold > 0 {
        page.entry("more", &format!("{} in the record", counted(untold as u64, "motion", "motions")));
    }
    if found.motions.is_empty() {
        let advice = match found.at_rest {
            None => "more --starts, or a multiple of the --period, may find one",
            Some(_) => "nothing drives the scene, so that the --period must be a motion's own, to ten digits",
        };
        page.entry("", &format!("no periodic motion was found: {advice}"));
    }
    if let Some(count) = found.at_rest.filter(|count| *count > 0) {
        let starts = counted(count as u64, "start", "starts");
        let how = "came to an equilibrium; `driftless modes` without --period lists these";
        page.entry("", &format!("{starts} {how}"));
    }
    if found.unstable > 0 {
        let growth = "small differences grow more than ten thousandfold within a period";
        page.entry("", &format!("{} left: {growth}", counted(found.unstable as u64, "start", "starts")));
    }
    if !found.left_out.is_empty() {
        page.entry("left out", &found.left_out.join(", "));
    }
    page.into_text()
}

/// The motion next to the start, or else the most stable one, over a period, and its multipliers.
///
/// # Errors
/// Drawing or encoding fails.
#[cfg(feature = "charts")]
pub fn charts(found: &PeriodicMotions) -> Result<Charts, ChartError> {
    let first = found.motions.iter().find(|one| one.from_start).or(found.motions.first());
    let Some(one) = first else { return Ok(Default::default()) };
    let drawing = MechanismDrawing { scene: &found.scene, mechanism: &found.mechanism };
    let mut states = found.course(one, PLACES).unwrap_or_default();
    states.extend(states.first().cloned());
    let pose = |[phi, omega]: &[Vec<f64>; 2]| drawing.pose(phi, omega);
    let trails: Vec<Vec<[f64; 2]>> = (drawing.traced().iter())
        .map(|place| states.iter().map(|[phi, _]| drawing.place(place, phi)).collect())
        .collect();
    let caption = vec![
        format!("scene {}", plain(&found.scene.name)),
        format!("period {} s", figure(found.period)),
        words(one),
    ];
    let every = |count: usize| states.iter().take(PLACES).step_by(PLACES / count);
    let mut poses: Vec<_> = every(POSES).map(pose).collect();
    // The start is the one drawn in full.
    poses.rotate_left(1);
    let title = "Periodic motion".to_owned();
    let picture = MechanismChart {
        title: title.clone(),
        caption: caption.clone(),
        sketch: drawing.sketch(),
        poses,
        trails: trails.clone(),
        names: drawing.names(),
        horizon: None,
    };
    let plane =
        Multipliers { title: "Floquet multipliers".to_owned(), caption, values: one.multipliers.clone() };
    let mut pictures = vec![("motion", chart::mechanism(&picture, FILE_RESOLUTION)?)];
    if !plane.values.is_empty() {
        pictures.push(("multipliers", chart::multipliers(&plane, FILE_RESOLUTION)?));
    }
    let motion = MotionGif {
        title,
        sketch: drawing.sketch(),
        poses: every(FRAMES).map(pose).collect(),
        time: (0..FRAMES).map(|k| found.period * k as f64 / FRAMES as f64).collect(),
        trails,
        delay: 4,
        horizon: None,
    };
    Ok((pictures, vec![("motion", motion)]))
}
