//! Angles of bars against time.

use super::axis::Axis;
use super::file::Picture;
use super::grid::{label_room, shortened, stacked};
use super::lines::Point;
use super::palette::marks;
use super::sheet::Sheet;
use super::ticks::figure;
use super::{ChartError, PAGE};
use std::f64::consts::{PI, TAU};

/// From this spread on angles are told in turns \[rad\].
const TURNS_FROM: f64 = 40.0 * PI;

/// The angle of one bar.
#[derive(Clone, Debug, Default)]
pub struct AngleSeries {
    /// Name, with markup: `*φ*_{1}`.
    pub name: String,
    /// Unwrapped angles \[rad\] at the chart's times.
    pub angle: Vec<f64>,
}

/// Angles of bars.
#[derive(Clone, Debug, Default)]
pub struct Angles {
    /// Title, with markup.
    pub title: String,
    /// Parts of the caption, with markup; what is drawn is added where it is not plain.
    pub caption: Vec<String>,
    /// Times \[s\], ascending.
    pub time: Vec<f64>,
    /// The bars.
    pub series: Vec<AngleSeries>,
    /// The time from which on the angles are pale: the horizon up to which they can be trusted \[s\].
    pub horizon: Option<f64>,
}

/// Draws up to three bars in panels of their own, more of them in one panel.
///
/// Ticks are multiples of π, or turns when a bar winds up.  Where an angle oscillates faster than paper
/// shows, the band between its extremes is drawn and the caption says so.
///
/// # Errors
/// [`ChartError`] if the resolution is out of range or drawing fails.
pub fn angles(chart: &Angles, px_per_pt: f64) -> Result<Picture, ChartError> {
    let apart = (1..=3).contains(&chart.series.len());
    let size = [PAGE[0], if chart.series.len() == 3 { 380.0 } else { PAGE[1] }];
    let spread = |lines: &[&AngleSeries]| {
        let finite = || lines.iter().flat_map(|s| &s.angle).copied().filter(|a| a.abs() <= 1e300);
        finite().fold(f64::NEG_INFINITY, f64::max) - finite().fold(f64::INFINITY, f64::min)
    };
    let groups: Vec<Vec<&AngleSeries>> = if apart {
        chart.series.iter().map(|s| vec![s]).collect()
    } else {
        vec![chart.series.iter().collect()]
    };
    let units: Vec<f64> =
        groups.iter().map(|group| if spread(group) > TURNS_FROM { TAU } else { 1.0 }).collect();
    let line = |series: &AngleSeries, unit: f64| -> Vec<Point> {
        chart.time.iter().zip(&series.angle).map(|(&t, &a)| [t, a / unit]).collect()
    };
    let lines: Vec<Vec<Vec<Point>>> = groups
        .iter()
        .zip(&units)
        .map(|(group, &unit)| group.iter().map(|s| line(s, unit)).collect())
        .collect();

    let x = Axis::tight("time [s]", chart.time.iter().copied());
    let ys = || -> Vec<Axis> {
        let name = |k: usize| if apart { groups[k][0].name.clone() } else { "angle".to_owned() };
        let values = |k: usize| lines[k].iter().flatten().map(|p| p[1]);
        (0..groups.len())
            .map(|k| {
                if units[k] == 1.0 {
                    Axis::angle(&format!("{} [rad]", name(k)), values(k))
                } else {
                    Axis::fit(&format!("{} [turns]", name(k)), values(k))
                }
            })
            .collect()
    };
    let mut caption = chart.caption.clone();
    let crowded = {
        let trial = Sheet::new(size, 0.5)?;
        let panels = stacked(&trial, 40.0, &x, ys(), 20.0)?;
        panels.iter().zip(&lines).any(|(panel, lines)| lines.iter().any(|line| panel.crowded(line)))
    };
    if crowded {
        caption.push("bands between the extremes where the angle oscillates too fast to be drawn".to_owned());
    }
    let sheet = Sheet::new(size, px_per_pt)?;
    let under = sheet.heading(&chart.title, &caption)?;
    let labels: Vec<String> = chart.series.iter().map(|series| shortened(&sheet, &series.name)).collect();
    let right = if apart { 20.0 } else { label_room(&sheet, labels.iter().map(String::as_str), false) };
    let marks = marks(chart.series.iter().map(|series| series.name.as_str()));
    let panels = stacked(&sheet, under, &x, ys(), right)?;
    let label = chart.horizon.map(|horizon| format!("{} s", figure(horizon)));
    for (k, (panel, lines)) in panels.iter().zip(&lines).enumerate() {
        let mut ends = Vec::new();
        for (i, line) in lines.iter().enumerate() {
            let mark = marks[if apart { k } else { i }];
            let pieces =
                panel.trusted(line, mark.colour, if lines.len() > 3 { 1.4 } else { 1.6 }, chart.horizon)?;
            if let (false, Some(end)) = (apart, pieces.last().and_then(|piece| piece.last())) {
                ends.push((end[1], labels[i].clone(), mark));
            }
        }
        if lines.iter().flatten().all(|p| !p[1].is_finite() || !p[0].is_finite()) {
            panel.empty("no data")?;
        }
        panel.end_labels(&ends, false)?;
        panel.horizon(chart.horizon, label.as_deref().filter(|_| k == 0))?;
    }
    Ok(sheet.picture(&chart.title, &caption))
}
