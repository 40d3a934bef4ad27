//! What became of the stiff and extreme scenes: a table, and charts.

use super::page::{Page, magnitude};
#[cfg(feature = "charts")]
use crate::chart::{self, ChartError, FILE_RESOLUTION, Map, MapAxis, OutcomeMatrix, Picture, plain};
#[cfg(feature = "charts")]
use crate::run::stress::StabilityMap;
use crate::run::stress::{Stress, StressCell, StressLine, Verdict};
use serde_json::{Value, json};

/// The report as one JSON object.
pub fn object(plan: &Stress, lines: &[StressLine]) -> Value {
    let count = |verdict| cells(lines).filter(|cell| cell.verdict == verdict).count();
    json!({
        "methods": names(plan),
        "effort": plan.max_evaluations,
        "right": count(Verdict::Right),
        "refused": count(Verdict::Refused),
        "stopped": count(Verdict::Stopped),
        "wrong": count(Verdict::Wrong),
        "scenes": lines,
    })
}

/// The cells as lines of comma-separated values.
pub fn csv(lines: &[StressLine]) -> String {
    let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:e}"));
    let mut text = "scene,method,verdict,tolerance [rad],setting,error [rad],estimate [rad],\
                    energy drift [1],evaluations,runs,cause\n"
        .to_owned();
    for line in lines {
        for cell in &line.cells {
            let cause = cell.stop.as_ref().map_or("", |stop| stop.cause.word());
            let setting = cell.setting.as_deref().unwrap_or_default();
            let [error, estimate, energy] = [cell.error, cell.estimate, cell.energy].map(number);
            text += &format!(
                "{},{},{},{:e},{setting},{error},{estimate},{energy},{},{},{cause}\n",
                line.scene,
                cell.method,
                word(cell.verdict),
                line.tolerance,
                cell.evaluations,
                cell.runs
            );
        }
    }
    text
}

/// The report as a page: a letter a cell, then what is wrong.
pub fn text(plan: &Stress, lines: &[StressLine]) -> String {
    let mut page = Page::new("stress", "Stiff and extreme scenes by every method.");
    for (number, name) in names(plan).iter().enumerate() {
        page.entry(if number == 0 { "methods" } else { "" }, &format!("{} {name}", letter(number)));
    }
    page.entry("effort", &format!("{} evaluations a scene and method", plan.max_evaluations));
    page.entry("letters", "+ right, - refused, . stopped, X wrong");
    let head: Vec<char> = (0..plan.methods.len()).map(letter).collect();
    let row = |name: &str, letters: Vec<char>| {
        vec![name.to_owned(), letters.iter().map(|letter| format!("{letter} ")).collect::<String>()]
    };
    let mut rows = vec![row("", head)];
    rows.extend(
        lines.iter().map(|line| row(&line.scene, line.cells.iter().map(|cell| mark(cell.verdict)).collect())),
    );
    page.table(&["scene", ""], &rows);
    let count = |verdict| cells(lines).filter(|cell| cell.verdict == verdict).count();
    let [right, refused, stopped, wrong] =
        [Verdict::Right, Verdict::Refused, Verdict::Stopped, Verdict::Wrong].map(count);
    page.entry("cells", &format!("{right} right, {refused} refused, {stopped} stopped, {wrong} wrong"));
    for line in lines {
        for cell in line.cells.iter().filter(|cell| cell.verdict == Verdict::Wrong) {
            let off = cell.error.map_or("an answer where there is none".to_owned(), |error| {
                format!("{} off", magnitude(error))
            });
            page.entry(
                "wrong",
                &format!("{} by {}: {off}, tolerance {}", line.scene, cell.method, magnitude(line.tolerance)),
            );
        }
    }
    page.into_text()
}

fn cells(lines: &[StressLine]) -> impl Iterator<Item = &StressCell> {
    lines.iter().flat_map(|line| &line.cells)
}

fn names(plan: &Stress) -> Vec<&'static str> {
    plan.methods.iter().map(|method| method.info().name).collect()
}

fn letter(number: usize) -> char {
    (b'a'..=b'z').chain(b'A'..=b'Z').nth(number).map_or('?', char::from)
}

fn mark(verdict: Verdict) -> char {
    match verdict {
        Verdict::Right => '+',
        Verdict::Refused => '-',
        Verdict::Stopped => '.',
        Verdict::Wrong => 'X',
    }
}

fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Right => "right",
        Verdict::Refused => "refused",
        Verdict::Stopped => "stopped",
        Verdict::Wrong => "wrong",
    }
}

/// The chart of the matrix.
///
/// # Errors
/// Drawing fails.
#[cfg(feature = "charts")]
pub fn matrix(plan: &Stress, lines: &[StressLine]) -> Result<Picture, ChartError> {
    let outcome = |cell: &StressCell| match cell.verdict {
        Verdict::Right => chart::CellOutcome::Right,
        Verdict::Refused => chart::CellOutcome::Refused,
        Verdict::Stopped => chart::CellOutcome::Stopped,
        Verdict::Wrong => chart::CellOutcome::Wrong,
    };
    let said = |cell: &StressCell| match (cell.error, cell.verdict) {
        (Some(error), Verdict::Right | Verdict::Wrong) => short(error),
        (None, Verdict::Right) if cell.refusal.is_some() => "refused".into(),
        (None, Verdict::Right) if cell.stop.is_some() => "stops".into(),
        _ => String::new(),
    };
    let chart = OutcomeMatrix {
        title: "Stiff and extreme scenes by every method".into(),
        caption: vec![
            "error at the end: angles in rad, rates relative".into(),
            format!("refined until confirmed, at most {} evaluations a cell", plan.max_evaluations),
        ],
        rows: lines.iter().map(|line| plain(&line.scene)).collect(),
        columns: names(plan).iter().map(|name| plain(name)).collect(),
        cells: cells(lines).map(|cell| (outcome(cell), said(cell))).collect(),
    };
    chart::matrix(&chart, FILE_RESOLUTION)
}

/// `3e-9`, or 0.
#[cfg(feature = "charts")]
fn short(error: f64) -> String {
    crate::arithmetic::shown::order(error)
}

/// The chart of steps and stiffnesses.
///
/// # Errors
/// Drawing fails.
#[cfg(feature = "charts")]
pub fn stability(map: &StabilityMap) -> Result<Picture, ChartError> {
    let ends = |value: fn(&crate::run::stress::StepStability) -> f64| {
        let of = |cell: Option<&crate::run::stress::StepStability>| cell.map_or(1.0, value);
        [of(map.cells.first()), of(map.cells.last())]
    };
    let [softest, stiffest] = ends(|cell| cell.stiffness);
    let [shortest, longest] = ends(|cell| cell.step);
    let chart = Map {
        title: format!("Error of {} by stiffness and step", map.method),
        caption: vec!["the double pendulum on its spring, released from the free length, after 0.5 s".into()],
        x: MapAxis {
            name: "stiffness [N/m]".into(),
            from: softest,
            to: stiffest,
            count: map.stiffnesses,
            log: true,
        },
        y: MapAxis { name: "step [s]".into(), from: shortest, to: longest, count: map.steps, log: true },
        cells: map
            .cells
            .iter()
            .map(|cell| cell.error.map_or(chart::Cell::Failed, chart::Cell::Value))
            .collect(),
        value: "error of the angles [rad]".into(),
        log: true,
        dark_high: false,
        range: Some([1e-12, 1.0]),
        words: [String::new(), String::new(), "stopped".into()],
    };
    chart::map(&chart, FILE_RESOLUTION)
}
