//! Constraint drift: how far each constraint is off, at the level of positions and of velocities, side by
//! side; angles and lengths in rows of their own.

use super::axis::Axis;
use super::energy_drift::{DriftSeries, draw, drift_axis, is_zero, labels};
use super::file::Picture;
use super::grid::{label_room, rows};
use super::lines::{Point, running_maximum};
use super::palette::{GREY, WHITE, marks, mix};
use super::panel::Panel;
use super::sheet::{NOTE, Sheet, note};
use super::text::{Align, Lettering, TextLevel};
use super::{ChartError, PAGE};

/// One level of the constraints, with its unit.
#[derive(Clone, Debug, Default)]
pub struct ResidualPanel {
    /// Name of the y axis with its unit in brackets, with markup: `|*C*| [rad]`.
    pub name: String,
    /// A line for each stabilization or each constraint; the same names in the same order in both panels of a
    /// row.
    pub series: Vec<DriftSeries>,
}

/// Defects of constraints against time.
#[derive(Clone, Debug, Default)]
pub struct ConstraintDrift {
    /// Title, with markup.
    pub title: String,
    /// Parts of the caption, with markup; what is drawn is added.
    pub caption: Vec<String>,
    /// Panels from left to right, position level and velocity level; then those of constraints of another
    /// unit, below.
    pub panels: Vec<ResidualPanel>,
    /// Logarithmic time.
    pub log_time: bool,
}

/// Violations \[rad, m\] below which the axis does not go.
const NOTHING: f64 = 1e-20;

/// Panels beside each other.
const COLUMNS: usize = 2;
/// Height of the page for each row of panels after the first \[pt\].
const ROW: f64 = 170.0;

/// Draws the samples as light dots and their running maximum as a line.
///
/// A series without any defect is drawn as markers on the lower edge and labelled as exactly 0.
///
/// # Errors
/// [`ChartError`] if the resolution is out of range or drawing fails.
pub fn constraint_drift(chart: &ConstraintDrift, px_per_pt: f64) -> Result<Picture, ChartError> {
    let more = chart.panels.len().div_ceil(COLUMNS).saturating_sub(1);
    let sheet = Sheet::new([PAGE[0], PAGE[1] + more as f64 * ROW], px_per_pt)?;
    let mut caption = chart.caption.clone();
    caption.push("dots: samples, lines: largest so far".to_owned());
    let under = sheet.heading(&chart.title, &caption)?;
    let lines = |panel: &ResidualPanel| -> Vec<Vec<Point>> {
        panel.series.iter().map(|s| running_maximum(&s.time, &s.error)).collect()
    };
    let all: Vec<Vec<Vec<Point>>> = chart.panels.iter().map(lines).collect();
    let axes = chart.panels.iter().zip(&all).map(|(panel, lines)| {
        let times = || lines.iter().flatten().map(|p| p[0]);
        let x = if chart.log_time {
            Axis::log_tight("time [s]", times())
        } else {
            Axis::tight("time [s]", times())
        };
        // The lowest samples decide how far down the axis goes, but a few near zero do not stretch it over
        // the page.
        let highest = lines.iter().flatten().map(|p| p[1]).filter(|v| v.is_finite()).fold(0.0, f64::max);
        let starts = lines
            .iter()
            .filter_map(|line| line.iter().map(|p| p[1]).find(|&v| v > 0.0))
            .fold(highest, f64::min);
        // What is far below the rounding of a double is none of the run's doing.
        let starts = starts.max(NOTHING.min(highest));
        let samples = panel
            .series
            .iter()
            .flat_map(|s| &s.error)
            .map(|e| e.abs())
            .filter(|&e| e > 0.03 * starts && e <= highest);
        (x, drift_axis(&panel.name, samples.chain([starts]), lines.iter().any(|line| is_zero(line))))
    });
    let words: Vec<Vec<String>> = (chart.panels.iter().zip(&all))
        .map(|(panel, lines)| {
            labels(&sheet, panel.series.iter().map(|series| series.name.as_str()).zip(lines))
        })
        .collect();
    let right = label_room(&sheet, words.iter().flatten().map(String::as_str), true);
    let axes: Vec<(Axis, Axis)> = axes.collect();
    let panels = rows(&sheet, under, axes.chunks(COLUMNS).map(<[_]>::to_vec).collect(), right)?;
    for (k, (panel, (data, lines))) in panels.iter().zip(chart.panels.iter().zip(&all)).enumerate() {
        let marks = marks(data.series.iter().map(|series| series.method.as_str()));
        for (series, mark) in data.series.iter().zip(&marks) {
            let samples: Vec<Point> =
                series.time.iter().zip(&series.error).map(|(&t, &e)| [t, e.abs()]).collect();
            // More dots than can be told apart would only fill the panel.
            let step = samples.len().div_ceil(400).max(1);
            let light: Vec<Point> = samples.into_iter().step_by(step).filter(|p| p[1] > 0.0).collect();
            panel.dots(&light, mix(mark.colour, WHITE, 0.66))?;
        }
        let mut ends = Vec::new();
        for ((line, mark), words) in lines.iter().zip(&marks).zip(&words[k]) {
            if let Some(end) = draw(&sheet, panel, line, mark)? {
                if end < panel.bounds[3] {
                    sheet.marker([panel.bounds[2], end], mark.shape, mark.colour)?;
                }
                ends.push((end, words.clone(), *mark));
            }
        }
        if ends.is_empty() {
            panel.empty("no data")?;
        }
        if k % COLUMNS == COLUMNS - 1 || k + 1 == panels.len() {
            panel.end_labels(&ends, true)?;
        } else {
            zeros(&sheet, panel, data, lines)?;
        }
    }
    if panels.is_empty() {
        sheet.words(
            "no data",
            note(GREY, Align::Centre, TextLevel::Middle),
            [0.5 * PAGE[0], 0.5 * PAGE[1]],
        )?;
    }
    Ok(sheet.picture(&chart.title, &caption))
}

/// Says above the lower edge of a panel without end labels whose markers lie on it.
fn zeros(sheet: &Sheet, panel: &Panel, data: &ResidualPanel, lines: &[Vec<Point>]) -> Result<(), ChartError> {
    let names: Vec<&str> = data
        .series
        .iter()
        .zip(lines)
        .filter(|(_, line)| is_zero(line))
        .map(|(series, _)| series.name.as_str())
        .collect();
    if names.is_empty() {
        return Ok(());
    }
    let [left, _, right, bottom] = panel.bounds;
    let full = format!("{}: exactly 0", names.join(", "));
    let words = if sheet.width(&full, NOTE, false) < right - left - 6.0 {
        full.as_str()
    } else {
        "markers: exactly 0"
    };
    let lettering = Lettering { halo: true, ..note(GREY, Align::Right, TextLevel::Baseline) };
    sheet.words(words, lettering, [right - 3.0, bottom - 6.0])
}
