//! The three charts of a comparison.

use super::{has_letters, sorted};
use crate::chart::{self, ChartError, Cost, FILE_RESOLUTION, Picture, WorkPrecision, WorkSeries, plain};
use crate::dynamics::Mechanism;
use crate::report::page::figure;
use crate::run::Drift;
use crate::run::compare::{Comparison, Entry, Fate, LOST, ROUNDING};
use crate::scene::Scene;

/// A chart of a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CompareChart {
    /// Error against run time.
    ErrorTime,
    /// Energy drift against run time.
    EnergyTime,
    /// Error against evaluations.
    ErrorEvaluations,
}

impl CompareChart {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::ErrorTime, Self::EnergyTime, Self::ErrorEvaluations];

    /// Name of its file, without the ending.
    pub fn name(self) -> &'static str {
        match self {
            Self::ErrorTime => "error_against_run_time",
            Self::EnergyTime => "energy_drift_against_run_time",
            Self::ErrorEvaluations => "error_against_evaluations",
        }
    }
}

/// Draws one chart.
///
/// # Errors
/// Drawing fails.
pub fn draw(
    kind: CompareChart,
    scene: &Scene,
    mechanism: &Mechanism,
    comparison: &Comparison,
) -> Result<Picture, ChartError> {
    chart::work_precision(&chart_data(kind, scene, mechanism, comparison), FILE_RESOLUTION)
}

/// The data of one chart.
pub fn chart_data(
    kind: CompareChart,
    scene: &Scene,
    mechanism: &Mechanism,
    comparison: &Comparison,
) -> WorkPrecision {
    let of_energy = kind == CompareChart::EnergyTime;
    let truth = &comparison.truth;
    let point = |entry: &Entry| {
        let found = entry.found.as_ref().filter(|_| entry.fate == Fate::Done)?;
        let cost = if kind == CompareChart::ErrorEvaluations {
            found.statistics.evaluations as f64
        } else {
            entry.median()?
        };
        Some([cost, if of_energy { found.energy } else { entry.error()? }])
    };
    let mut series: Vec<WorkSeries> = Vec::new();
    let several = has_letters(comparison);
    for (_, entry) in sorted(comparison) {
        let name = if several { entry.name() } else { Entry { stabilization: None, ..entry.clone() }.name() };
        if series.last().is_none_or(|last| last.name != name) {
            series.push(WorkSeries { method: entry.method.info().name.to_owned(), name, points: Vec::new() });
        }
        if let Some(series) = series.last_mut() {
            series.points.extend(point(entry));
        }
    }
    series.retain(|series| !series.points.is_empty());
    let until = format!("{} s", figure(comparison.until));
    let drifting = Drift::new(mechanism, comparison.until).kind;
    let mut caption = vec![format!("scene {}", plain(&scene.name)), format!("runs of {until}")];
    if of_energy {
        caption.push("largest value on the way, over the energy scale".into());
    } else {
        caption.push(format!(
            "largest error at {} times up to *t* = {} s, against {}",
            truth.times(),
            figure(truth.until),
            plain(&truth.how)
        ));
    }
    if kind != CompareChart::ErrorEvaluations {
        caption.push("medians on one core".into());
    }
    let cost = match kind {
        CompareChart::ErrorEvaluations => {
            Cost::Count("evaluations of the equations (of taylor: expansions)".into())
        }
        _ => Cost::Time(format!("run time of {until}")),
    };
    let (title, error_name) = match kind {
        CompareChart::ErrorTime => ("Error against run time", "largest error of angles [rad]".to_owned()),
        CompareChart::ErrorEvaluations => {
            ("Error against evaluations", "largest error of angles [rad]".to_owned())
        }
        CompareChart::EnergyTime => {
            ("Energy drift against run time", format!("relative drift of {drifting}"))
        }
    };
    let lost = if of_energy { None } else { Some(LOST) };
    // Energies are measured in double-double: there is no such floor among doubles.
    let floor = if of_energy {
        None
    } else {
        let accuracy = truth.accuracy.max(ROUNDING);
        let words = if truth.accuracy > ROUNDING { "accuracy of the reference" } else { "rounding" };
        Some((accuracy, words.to_owned()))
    };
    WorkPrecision { title: title.into(), caption, cost, error_name, series, lost, floor }
}
