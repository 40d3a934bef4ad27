//! Angles of bars against time.

use super::axis::Axis;
use super::file::Picture;
use super::grid::{label_room, stacked};
use super::lines::Point;
use super::names::shortened_apart;
use super::palette::marks;
use super::sheet::Sheet;
use super::ticks::figure;
use super::{ChartError, PAGE};
use std::f64::consts::{PI, TAU};

/// Bars that have panels of their own.
const APART: usize = 3;
/// How many times further a bar goes than the one that goes least, or than half a turn, if it winds up.
const RAMP: f64 = 8.0;
/// What a third and each further panel adds to the height of the page \[pt\].
const HIGHER: f64 = 80.0;
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

impl AngleSeries {
    /// Largest less least of its values.
    #[must_use]
    pub fn spread(&self) -> f64 {
        spread(&[self])
    }
}

/// Angles of bars, travels of sliders and positions of bodies on floating bases.
#[derive(Clone, Debug, Default)]
pub struct Angles {
    /// Title, with markup.
    pub title: String,
    /// Parts of the caption, with markup; what is drawn is added where it is not plain.
    pub caption: Vec<String>,
    /// Times \[s\], ascending.
    pub time: Vec<f64>,
    /// True where too much happens between the times for curves through the values.
    pub is_coarse: bool,
    /// The bars.
    pub series: Vec<AngleSeries>,
    /// Sliders, with their travels \[m\] in place of angles.
    pub travels: Vec<AngleSeries>,
    /// Coordinates of bodies on floating bases \[m\] in place of angles.
    pub positions: Vec<AngleSeries>,
    /// The time from which on the curves are pale: the horizon up to which they can be trusted \[s\].
    pub horizon: Option<f64>,
}

/// What one panel shows.
struct Group<'a> {
    series: Vec<&'a AngleSeries>,
    /// What its values are divided by, and the unit that makes.
    scale: f64,
    unit: &'static str,
    /// Name of its axis where it shows several.
    name: &'static str,
}

impl Group<'_> {
    fn axis(&self, lines: &[Vec<Point>]) -> Axis {
        let name = match &self.series[..] {
            [only] => format!("{} [{}]", only.name, self.unit),
            _ => format!("{} [{}]", self.name, self.unit),
        };
        let values = lines.iter().flatten().map(|p| p[1]);
        if self.unit == "rad" { Axis::angle(&name, values) } else { Axis::fit(&name, values) }
    }
}

/// Largest less least of all values.
fn spread(series: &[&AngleSeries]) -> f64 {
    let finite = || series.iter().flat_map(|s| &s.angle).copied().filter(|a| a.abs() <= 1e300);
    finite().fold(f64::NEG_INFINITY, f64::max) - finite().fold(f64::INFINITY, f64::min)
}

/// Up to three bars have panels of their own; of more, those that wind up do not flatten those that swing.
fn groups(chart: &Angles) -> Vec<Group<'_>> {
    let mut panels: Vec<Vec<&AngleSeries>> = match chart.series.len() {
        0 => Vec::new(),
        1..=APART => chart.series.iter().map(|series| vec![series]).collect(),
        _ => {
            let mut spreads: Vec<f64> = chart.series.iter().map(AngleSeries::spread).collect();
            spreads.sort_by(f64::total_cmp);
            let least = spreads[0].max(PI);
            let (winding, swinging): (Vec<_>, Vec<_>) =
                chart.series.iter().partition(|series| series.spread() > RAMP * least);
            [swinging, winding].into_iter().filter(|group| !group.is_empty()).collect()
        }
    };
    let lengths = [("travel", &chart.travels), ("position", &chart.positions)];
    if panels.is_empty() && lengths.iter().all(|(_, series)| series.is_empty()) {
        panels.push(Vec::new());
    }
    let angles = panels.into_iter().map(|series| {
        let (scale, unit) = if spread(&series) > TURNS_FROM { (TAU, "turns") } else { (1.0, "rad") };
        Group { series, scale, unit, name: "angle" }
    });
    let mut groups: Vec<Group> = angles.collect();
    for (name, series) in lengths.into_iter().filter(|(_, series)| !series.is_empty()) {
        groups.push(Group { series: series.iter().collect(), scale: 1.0, unit: "m", name });
    }
    groups
}

/// Draws up to three bars in panels of their own, more of them in one panel, or two where some wind up; and
/// travels below.
///
/// Ticks are multiples of π, or turns when a bar winds up.  Where a curve oscillates faster than paper
/// shows, the band between its extremes is drawn and the caption says so.
///
/// # Errors
/// [`ChartError`] if the resolution is out of range or drawing fails.
pub fn angles(chart: &Angles, px_per_pt: f64) -> Result<Picture, ChartError> {
    let groups = groups(chart);
    let size = [PAGE[0], PAGE[1] + HIGHER * groups.len().saturating_sub(2) as f64];
    let lines: Vec<Vec<Vec<Point>>> = (groups.iter())
        .map(|group| {
            let line = |series: &&AngleSeries| {
                chart.time.iter().zip(&series.angle).map(|(&t, &a)| [t, a / group.scale]).collect()
            };
            group.series.iter().map(line).collect()
        })
        .collect();
    let x = Axis::tight("time [s]", chart.time.iter().copied());
    let ys = || groups.iter().zip(&lines).map(|(group, lines)| group.axis(lines)).collect::<Vec<Axis>>();
    let mut caption = chart.caption.clone();
    let crowded = {
        let trial = Sheet::new(size, 0.5)?;
        let panels = stacked(&trial, 40.0, &x, ys(), 20.0)?;
        let mut all = panels.iter().zip(&lines);
        !chart.is_coarse && all.any(|(panel, lines)| lines.iter().any(|line| panel.crowded(line)))
    };
    if crowded {
        caption.push("bands between the extremes of what oscillates too fast to be drawn".to_owned());
    }
    let sheet = Sheet::new(size, px_per_pt)?;
    let under = sheet.heading(&chart.title, &caption)?;
    let shared = groups.iter().filter(|group| group.series.len() > 1);
    let shared = shared.flat_map(|group| &group.series).map(|series| series.name.as_str());
    let labels = shortened_apart(&sheet, shared);
    let right = label_room(&sheet, labels.iter().map(String::as_str), false);
    let names = groups.iter().flat_map(|group| &group.series).map(|series| series.name.as_str());
    let (mut marks, mut next_label) = (marks(names).into_iter(), labels.iter());
    let panels = stacked(&sheet, under, &x, ys(), right)?;
    let label = chart.horizon.map(|horizon| format!("{} s", figure(horizon)));
    for (k, (panel, lines)) in panels.iter().zip(&lines).enumerate() {
        let mut ends = Vec::new();
        for (line, mark) in lines.iter().zip(marks.by_ref()) {
            let width = if lines.len() > APART { 1.4 } else { 1.6 };
            let pieces = panel.trusted_rows(line, (mark.colour, width), chart.horizon, chart.is_coarse)?;
            let label = if lines.len() > 1 { next_label.next() } else { None };
            if let (Some(label), Some(end)) = (label, pieces.last().and_then(|piece| piece.last())) {
                ends.push((end[1], label.clone(), mark));
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
