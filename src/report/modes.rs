//! Equilibria and modes, as a page, a JSON object and charts.

#[cfg(feature = "charts")]
use super::drawing::MechanismDrawing;
use super::page::{Page, counted, figure};
#[cfg(feature = "charts")]
use crate::chart::{self, ChartError, FILE_RESOLUTION, MechanismChart, MotionGif, Picture, plain};
use crate::dynamics::Mechanism;
use crate::run::Modes;
use crate::run::modes::{Equilibrium, Mode, Stability};
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::f64::consts::TAU;

/// Modes that the page lists of one equilibrium; the record has all.
const LISTED: usize = 12;
/// Equilibria that it lists, beside the one next to the start.
const TOLD: usize = 6;
#[cfg(feature = "charts")]
const DRAWN: [&str; 4] = ["mode1", "mode2", "mode3", "mode4"];
/// Names of pictures and of motions, and what they show.
#[cfg(feature = "charts")]
pub type Charts = (Vec<(&'static str, Picture)>, Vec<(&'static str, MotionGif)>);
/// Amplitude of what is drawn \[rad, or sizes of the mechanism\].
#[cfg(feature = "charts")]
const AMPLITUDE: f64 = 0.3;
/// Frames of one period.
#[cfg(feature = "charts")]
const FRAMES: usize = 48;

/// One object: `equilibria`, each with its coordinates, stability and modes; `degrees_of_freedom`, `starts`.
pub fn object(found: &Modes) -> Value {
    let mode = |mode: &Mode| {
        json!({
            "eigenvalue": mode.eigenvalue,
            "frequency": mode.frequency,
            "hertz": mode.eigenvalue[1] / TAU,
            "damping_ratio": mode.damping_ratio,
            "shape": by_coordinate(&found.mechanism, &mode.shape),
        })
    };
    let equilibrium = |one: &Equilibrium| {
        json!({
            "coordinates": by_coordinate(&found.mechanism, &one.phi),
            "potential": one.potential,
            "stability": one.stability,
            "from_start": one.from_start,
            "is_family": one.is_family,
            "is_on_corner": one.is_on_corner,
            "modes": one.modes.iter().map(mode).collect::<Vec<_>>(),
        })
    };
    json!({
        "scene": found.scene.name,
        "degrees_of_freedom": found.degrees_of_freedom,
        "starts": starts(found.starts, found.asked),
        "equilibria": found.equilibria.iter().map(equilibrium).collect::<Vec<_>>(),
        "left_out": found.left_out,
    })
}

/// What became of the starts of a search, and of the other positions asked for.
pub(super) fn starts([tried, settled]: [usize; 2], [asked, unassembled, repeated]: [usize; 3]) -> Value {
    json!({
        "tried": tried,
        "settled": settled,
        "asked": asked,
        "unassembled": unassembled,
        "repeated": repeated,
    })
}

/// Values by the names of their coordinates.
pub(super) fn by_coordinate<T: Serialize>(mechanism: &Mechanism, values: &[T]) -> Value {
    let named = values.iter().enumerate().map(|(k, value)| (mechanism.coordinate_name(k), json!(value)));
    named.collect::<Map<String, Value>>().into()
}

/// How many starts of a search were tried and settled, and at how many of what; and what became of the other
/// positions asked for that are no starts.
pub(super) fn search(
    page: &mut Page,
    [tried, settled]: [usize; 2],
    found: &str,
    [asked, unassembled, repeated]: [usize; 3],
) {
    page.entry("search", &format!("{settled} of {tried} starts settled, at {found}"));
    let mut left = Vec::new();
    if unassembled > 0 {
        left.push(format!("{unassembled} could not be assembled"));
    }
    if repeated > 0 {
        left.push(format!("{repeated} came to a position among the starts"));
    }
    if !left.is_empty() {
        let positions = counted(asked as u64, "other position", "other positions");
        page.entry("", &format!("of {positions} asked for {}", left.join(", ")));
    }
}

/// A numbered row of a table; numbers that are none are left out.
pub(super) fn row(k: usize, numbers: &[f64]) -> Vec<String> {
    let shown = |x: &f64| if x.is_finite() { figure(*x) } else { "-".to_owned() };
    std::iter::once((k + 1).to_string()).chain(numbers.iter().map(shown)).collect()
}

/// Without what rounding leaves of zero.
pub(super) fn rounded(x: f64) -> String {
    figure((x * 1e12).round() / 1e12)
}

fn words(one: &Equilibrium) -> String {
    let stability = match one.stability {
        Stability::AsymptoticallyStable => "stable, disturbances die away",
        Stability::Stable => "stable to first order, without damping",
        Stability::Unstable => "unstable",
        Stability::Undecided if one.is_on_corner => {
            "forces have a corner or a jump here, and no linearization holds"
        }
        Stability::Undecided => "ways of motion cross here, and no linearization holds",
    };
    let family = if one.is_family { "; neighbours are equilibria too" } else { "" };
    format!("{stability}{family}")
}

/// The page.
pub fn text(found: &Modes) -> String {
    let mut page = Page::new(&found.scene.name, &found.scene.description);
    page.entry("freedom", &counted(found.degrees_of_freedom as u64, "degree", "degrees"));
    let equilibria = counted(found.equilibria.len() as u64, "equilibrium", "equilibria");
    search(&mut page, found.starts, &equilibria, found.asked);
    let is_told = |k: usize, one: &Equilibrium| k < TOLD || one.from_start;
    for (k, one) in found.equilibria.iter().enumerate().filter(|(k, one)| is_told(*k, one)) {
        let start = if one.from_start { ", next to the start" } else { "" };
        page.entry("equilibrium", &format!("{}: {}{start}", k + 1, words(one)));
        let places: Vec<String> = (one.phi.iter().enumerate())
            .map(|(k, phi)| format!("{} {}", found.mechanism.coordinate_name(k), rounded(*phi)))
            .collect();
        page.entry("", &places.join(", "));
        page.entry("", &format!("potential energy {} J", figure(one.potential)));
        let rows: Vec<Vec<String>> = (one.modes.iter().take(LISTED).enumerate())
            .map(|(k, mode)| {
                let [re, im] = mode.eigenvalue;
                row(k, &[im / TAU, TAU / im, mode.damping_ratio, re, im])
            })
            .collect();
        if !rows.is_empty() {
            page.table(&["mode", "f [Hz]", "period [s]", "damping ratio", "Re [1/s]", "Im [rad/s]"], &rows);
        }
        if one.modes.len() > LISTED {
            page.entry("", &format!("{} more modes in the record", one.modes.len() - LISTED));
        }
    }
    let untold = found.equilibria.iter().enumerate().filter(|(k, one)| !is_told(*k, one)).count();
    if untold > 0 {
        page.entry("more", &format!("{} in the record", counted(untold as u64, "equilibrium", "equilibria")));
    }
    if found.equilibria.is_empty() {
        page.entry(
            "",
            "no equilibrium was found: forces of the scene may have none, or it moves away for ever",
        );
    }
    if !found.left_out.is_empty() {
        page.entry("left out", &found.left_out.join(", "));
    }
    page.into_text()
}

/// The first modes of the equilibrium found from the start, or else of the lowest: names of files and their
/// content, animations where wanted.
///
/// # Errors
/// Drawing or encoding fails.
#[cfg(feature = "charts")]
pub fn charts(found: &Modes) -> Result<Charts, ChartError> {
    let first = found.equilibria.iter().find(|one| one.from_start).or(found.equilibria.first());
    let Some(one) = first else { return Ok(Default::default()) };
    let drawing = MechanismDrawing { scene: &found.scene, mechanism: &found.mechanism };
    let still = vec![0.0; one.phi.len()];
    let (mut pictures, mut motions) = (Vec::new(), Vec::new());
    for (k, mode) in one.modes.iter().enumerate().take(DRAWN.len()) {
        let at = |phase: f64| found.displaced(one, mode, phase, AMPLITUDE);
        let pose = |phase: f64| drawing.pose(&at(phase), &still);
        let traced = drawing.traced();
        let trails: Vec<Vec<[f64; 2]>> = traced
            .iter()
            .map(|place| {
                (0..=4 * FRAMES)
                    .map(|j| drawing.place(place, &at(TAU * j as f64 / (4 * FRAMES) as f64)))
                    .collect()
            })
            .collect();
        let rate = match mode.eigenvalue {
            [_, im] if im > 0.0 => format!("at {} Hz", figure(im / TAU)),
            [0.0, _] => "without frequency or damping".to_owned(),
            [re, _] => format!("at {} 1/s", figure(re)),
        };
        let title = format!("Mode {} {rate}", k + 1);
        let chart = MechanismChart {
            title: title.clone(),
            caption: vec![
                format!("scene {}", plain(&found.scene.name)),
                format!("damping ratio {}", figure(mode.damping_ratio)),
                "drawn at its largest, pale at rest and on the other side".to_owned(),
            ],
            sketch: drawing.sketch(),
            poses: vec![pose(TAU / 2.0), drawing.pose(&one.phi, &still), pose(0.0)],
            trails: Vec::new(),
            names: Vec::new(),
            horizon: None,
        };
        pictures.push((DRAWN[k], chart::mechanism(&chart, FILE_RESOLUTION)?));
        let motion = MotionGif {
            title,
            sketch: drawing.sketch(),
            poses: (0..FRAMES).map(|j| pose(TAU * j as f64 / FRAMES as f64)).collect(),
            time: Vec::new(),
            trails,
            delay: 4,
            horizon: None,
        };
        motions.push((DRAWN[k], motion));
    }
    Ok((pictures, motions))
}
