//! Outputs against time, a panel for each unit, their extremes over the whole run marked.

use super::axis::Axis;
use super::file::Picture;
use super::grid::{label_room, stacked};
use super::labels::Occupied;
use super::lines::Point;
use super::names::shortened_apart;
use super::palette::{MarkStyle, WHITE, marks, readable};
use super::panel::Panel;
use super::sheet::Sheet;
use super::ticks::figure;
use super::{ChartError, PAGE};

/// One output.
#[derive(Clone, Debug, Default)]
pub struct OutputSeries {
    /// Name, with markup.
    pub name: String,
    /// Unit; outputs of one unit share a panel.
    pub unit: String,
    /// Times \[s\], or what else the chart is drawn over, ascending.
    pub time: Vec<f64>,
    /// Its values at these times.
    pub value: Vec<f64>,
    /// Values and times of its least and its largest value over the whole run.
    pub extremes: Vec<[f64; 2]>,
}

impl OutputSeries {
    /// Whether its values differ by rounding at most, so that none of them is an extreme.
    fn is_constant(&self) -> bool {
        let all =
            || self.value.iter().copied().chain(self.extremes.iter().map(|e| e[0])).filter(|v| v.is_finite());
        let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
        high - low <= 16.0 * f64::EPSILON * low.abs().max(high.abs())
    }

    /// Its largest magnitude.
    fn size(&self) -> f64 {
        let all = self.value.iter().chain(self.extremes.iter().map(|extreme| &extreme[0]));
        all.map(|value| value.abs()).filter(|value| value.is_finite()).fold(0.0, f64::max)
    }

    /// Whether it has extremes to mark.
    fn has_extremes(&self) -> bool {
        !self.extremes.is_empty() && !self.is_constant()
    }
}

/// Several outputs.
#[derive(Clone, Debug, Default)]
pub struct OutputsChart {
    /// Title, with markup.
    pub title: String,
    /// Parts of the caption, with markup; what is drawn is added.
    pub caption: Vec<String>,
    /// The outputs.
    pub outputs: Vec<OutputSeries>,
    /// What a panel of several outputs shows; that of their unit where there is none.
    pub quantity: Option<String>,
    /// Name and unit of what it is drawn over; time in seconds where there is none.
    pub over: Option<[String; 2]>,
    /// True where too much happens between the times for curves through the values.
    pub is_coarse: bool,
    /// The time from which on the curves are pale: the horizon up to which they can be trusted \[s\].
    pub horizon: Option<f64>,
    /// The time from which on the values choose the ranges of the upright axes; what leaves them before is
    /// cut at the frame \[s\].
    pub settled_from: Option<f64>,
}

/// An output and what is drawn of it.
type Line<'a> = (&'a OutputSeries, Vec<Point>);

/// Height of the end of a line \[pt\], words, mark.
type End = (f64, String, MarkStyle);

/// Height of the page beyond its panels, and of each of these \[pt\].
const HEIGHTS: [f64; 2] = [80.0, 110.0];
/// Panels at most: further outputs are left to the table.
const PANELS: usize = 6;
/// Outputs of no unit, or of one that is not known, need not be of one kind: those larger than others so many
/// times have a panel of their own.
const SIZES: f64 = 30.0;
/// Outputs in a panel that have their extremes ringed; of more, only the largest is.
const RINGED: usize = 3;

/// Draws every output, with rings at the extremes, or only at the largest one of a panel of many, and a
/// figure there.
///
/// # Errors
/// [`ChartError`] if the resolution is out of range or drawing fails.
pub fn outputs(chart: &OutputsChart, px_per_pt: f64) -> Result<Picture, ChartError> {
    let mut groups = groups(&chart.outputs);
    let left_out: usize = groups.iter().skip(PANELS).map(Vec::len).sum();
    groups.truncate(PANELS);
    let line = |output: &OutputSeries| -> Vec<Point> {
        let points = output.time.iter().zip(&output.value).map(|(&t, &v)| [t, v]);
        let mut points: Vec<Point> = points.chain(output.extremes.iter().map(|&[v, t]| [t, v])).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        points
    };
    let rows: Vec<(&str, Vec<Line>)> = (groups.iter())
        .map(|group| (&*group[0].unit, group.iter().map(|&output| (output, line(output))).collect()))
        .collect();
    let size = [PAGE[0], HEIGHTS[0] + HEIGHTS[1] * rows.len().max(2) as f64];
    let sheet = Sheet::new(size, px_per_pt)?;
    let marks = marks(chart.outputs.iter().map(|output| output.name.as_str()));
    let number = |output: &OutputSeries| {
        chart.outputs.iter().position(|other| std::ptr::eq(other, output)).unwrap_or_default()
    };
    let mark = |output: &OutputSeries| marks[number(output)];
    let labels = shortened_apart(&sheet, chart.outputs.iter().map(|output| output.name.as_str()));
    let [over, over_unit] = chart.over.clone().unwrap_or_else(|| ["time".to_owned(), "s".to_owned()]);
    let x = Axis::tight(
        &format!("{over} [{over_unit}]"),
        rows.iter().flat_map(|row| &row.1).flat_map(|one| &one.1).map(|p| p[0]),
    );
    let y = |(unit, lines): &(&str, Vec<Line>)| {
        let name = match &lines[..] {
            [(output, _)] => format!("{} [{unit}]", output.name),
            several => {
                let names: Vec<&str> = several.iter().map(|(output, _)| output.name.as_str()).collect();
                named(chart.quantity.as_deref().unwrap_or_else(|| quantity(unit, &names)), unit)
            }
        };
        let points = || lines.iter().flat_map(|one| &one.1);
        match chart.settled_from {
            None => Axis::fit(&name, points().map(|p| p[1])),
            Some(from) => {
                Axis::fit(&name, settled(points().filter(|p| p[0] >= from).map(|p| p[1])).into_iter())
            }
        }
    };
    let mut caption = chart.caption.clone();
    if chart.outputs.iter().any(OutputSeries::has_extremes) {
        let whole = if chart.over.is_some() { "range" } else { "run" };
        caption.push(format!("extremes of the whole {whole} marked"));
    }
    if left_out > 0 {
        caption.push(format!("{left_out} more outputs in the table"));
    }
    let under = sheet.heading(&chart.title, &caption)?;
    let several = rows.iter().any(|row| row.1.len() > 1);
    let right = if several { label_room(&sheet, labels.iter().map(String::as_str), false) } else { 20.0 };
    let panels = stacked(&sheet, under, &x, rows.iter().map(y).collect(), right)?;
    let label = chart.horizon.map(|horizon| format!("{} s", figure(horizon)));
    for (k, (panel, (unit, lines))) in panels.iter().zip(&rows).enumerate() {
        let (mut occupied, mut ends) = (Occupied::default(), Vec::new());
        for (output, line) in lines {
            let is_coarse = chart.is_coarse && !panel.crowded(line);
            let pieces = panel.trusted_rows(line, (mark(output).colour, 1.6), chart.horizon, is_coarse)?;
            pieces.iter().for_each(|piece| occupied.line(piece));
            if let Some(end) = pieces.last().and_then(|piece| piece.last()) {
                ends.push((largest_of(line), (end[1], labels[number(output)].clone(), mark(output))));
            }
        }
        extremes(&sheet, panel, (lines, unit, &over_unit), &mark, &mut occupied)?;
        panel.horizon(chart.horizon, label.as_deref().filter(|_| k == 0))?;
        if lines.iter().flat_map(|one| &one.1).all(|p| !p[1].is_finite()) {
            panel.empty("no data")?;
        }
        if lines.len() > 1 {
            panel.end_labels(&named_first(ends, panel), false)?;
        }
    }
    Ok(sheet.picture(&chart.title, &caption))
}

/// The outputs of each panel: those of one unit, and where that says nothing of their kind, of one size.
fn groups(outputs: &[OutputSeries]) -> Vec<Vec<&OutputSeries>> {
    let mut groups: Vec<Vec<&OutputSeries>> = Vec::new();
    for output in outputs {
        let is_alike = |other: &&OutputSeries| {
            let [a, b] = [output.size(), other.size()];
            !matches!(&*output.unit, "" | "1" | "?") || a.max(b) <= SIZES * a.min(b) || a.min(b) == 0.0
        };
        let belongs =
            |group: &&mut Vec<&OutputSeries>| group[0].unit == output.unit && group.iter().all(is_alike);
        match groups.iter_mut().find(belongs) {
            Some(group) => group.push(output),
            None => groups.push(vec![output]),
        }
    }
    // Panels of one unit stand together, in the order of their first outputs.
    let first = |group: &Vec<&OutputSeries>| outputs.iter().position(|output| output.unit == group[0].unit);
    groups.sort_by_key(first);
    groups
}

/// Rings at the extremes of the lines of a panel, and a figure beside the largest of each that has rings.
fn extremes(
    sheet: &Sheet,
    panel: &Panel,
    (lines, unit, over_unit): (&[Line], &str, &str),
    mark: &dyn Fn(&OutputSeries) -> MarkStyle,
    occupied: &mut Occupied,
) -> Result<(), ChartError> {
    let largest = |output: &OutputSeries| output.extremes.iter().map(|e| e[0].abs()).fold(0.0, f64::max);
    let varied = || lines.iter().map(|one| one.0).filter(|one| one.has_extremes());
    let most = varied().map(largest).fold(0.0, f64::max);
    let shown = || varied().filter(|one| lines.len() <= RINGED || largest(one) == most);
    let peak = |output: &OutputSeries| {
        let peak = output.extremes.iter().max_by(|a, b| a[0].abs().total_cmp(&b[0].abs()));
        peak.copied().filter(|peak| peak[0].is_finite())
    };
    for output in shown() {
        let ringed = |e: &&[f64; 2]| e[0].is_finite() && (lines.len() <= RINGED || e[0].abs() == most);
        for &[value, t] in output.extremes.iter().filter(ringed) {
            let at = panel.at([t, value]);
            sheet.disc(at, 3.4, WHITE)?;
            sheet.ring(at, 2.4, mark(output).colour, 1.2)?;
            occupied.block([at[0] - 3.4, at[1] - 3.4, at[0] + 3.4, at[1] + 3.4]);
        }
    }
    // All rings have their places before the first figure.
    for (output, [value, t]) in shown().filter_map(|output| Some((output, peak(output)?))) {
        // A unit that nobody knows is told by the axis alone.
        let said =
            if matches!(unit, "" | "1" | "?") { figure(value) } else { format!("{} {unit}", figure(value)) };
        let note = format!("{said} at {} {over_unit}", figure(t));
        panel.note_beside(panel.at([t, value]), &note, readable(mark(output).colour), occupied)?;
    }
    Ok(())
}

/// What [`Panel::end_labels`] takes, the largest first where not all have a label.
fn named_first(mut ends: Vec<(f64, End)>, panel: &Panel) -> Vec<End> {
    if ends.len() > panel.labels_that_fit() {
        ends.sort_by(|a, b| b.0.total_cmp(&a.0));
    }
    ends.into_iter().map(|(_, end)| end).collect()
}

/// The largest magnitude of a line.
fn largest_of(line: &[Point]) -> f64 {
    line.iter().map(|p| p[1].abs()).filter(|value| value.is_finite()).fold(0.0, f64::max)
}

/// The ends of settled values with a fifth of their range of air, in which is seen how they settle.
fn settled(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let ends = |[low, high]: [f64; 2], value: f64| [low.min(value), high.max(value)];
    let [low, high] = values.filter(|value| value.is_finite()).fold([f64::INFINITY, f64::NEG_INFINITY], ends);
    let air = 0.2 * (high - low);
    [low - air, high + air]
}

/// What outputs of a unit are.
fn quantity(unit: &str, names: &[&str]) -> &'static str {
    match unit {
        "N" => "force",
        "N·m" => "torque",
        "W" => "power",
        "J" => "energy",
        "s" => "time",
        "m" if names.iter().all(|name| name.ends_with(".x") || name.ends_with(".y")) => "position",
        "m" => "length",
        "m/s" => "velocity",
        "m/s²" => "acceleration",
        "rad" => "angle",
        "rad/s" => "angular rate",
        "rad/s²" => "angular acceleration",
        _ => "value",
    }
}

/// The name of an axis; numbers without a unit have none in it.
fn named(quantity: &str, unit: &str) -> String {
    if matches!(unit, "" | "1") { quantity.to_owned() } else { format!("{quantity} [{unit}]") }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight line that has its largest value at 1 s.
    fn series(name: &str, unit: &str) -> OutputSeries {
        OutputSeries {
            name: name.to_owned(),
            unit: unit.to_owned(),
            time: vec![0.0, 1.0, 2.0],
            value: vec![0.0, 1.0, 0.5],
            extremes: vec![[0.0, 0.0], [1.0, 1.0]],
        }
    }

    #[test]
    fn axes_of_several_outputs_name_their_quantity() {
        let words = |outputs: Vec<OutputSeries>, quantity: Option<String>| -> Vec<String> {
            let chart = OutputsChart { outputs, quantity, ..OutputsChart::default() };
            let picture = outputs_of(&chart);
            picture.texts.into_iter().map(|text| text.text).collect()
        };
        let has = |words: &[String], wanted: &str| words.iter().any(|word| word == wanted);
        let forces = words(vec![series("A", "N"), series("B", "N")], None);
        assert!(has(&forces, "force [N]"), "{forces:?}");
        let places = words(vec![series("tip.x", "m"), series("tip.y", "m")], None);
        assert!(has(&places, "position [m]"), "{places:?}");
        let lengths = words(vec![series("tip.x", "m"), series("spring", "m")], None);
        assert!(has(&lengths, "length [m]"), "{lengths:?}");
        let changes = words(vec![series("a", "rad"), series("b", "rad")], Some("change".to_owned()));
        assert!(has(&changes, "change [rad]"), "{changes:?}");
        let pure = words(vec![series("a", "1"), series("b", "1")], None);
        assert!(has(&pure, "value"), "{pure:?}");
        assert!(has(&words(vec![series("a", "1")], None), "a"), "a pure number has no unit");
    }

    #[test]
    fn outputs_of_unknown_units_and_other_sizes_have_panels_of_their_own() {
        let sized = |name: &str, unit: &str, size: f64| OutputSeries {
            value: vec![0.0, size, 0.5 * size],
            extremes: vec![[0.0, 0.0], [size, 1.0]],
            ..series(name, unit)
        };
        let names = |unit: &str| -> Vec<Vec<String>> {
            let sizes = [("spike", 1e4), ("jump", 1e6), ("zero", 0.0), ("mixed", 3e-12), ("near", 2e6)];
            let all: Vec<OutputSeries> = sizes.map(|(name, size)| sized(name, unit, size)).to_vec();
            let name = |output: &&OutputSeries| output.name.clone();
            groups(&all).iter().map(|group| group.iter().map(name).collect()).collect()
        };
        for unit in ["?", "1"] {
            assert_eq!(names(unit), [vec!["spike", "zero"], vec!["jump", "near"], vec!["mixed"]], "{unit}");
        }
        assert_eq!(names("N").len(), 1, "forces are compared on one axis");
    }

    #[test]
    fn rows_too_far_apart_are_dots() {
        let picture = |is_coarse: bool| {
            let chart =
                OutputsChart { outputs: vec![series("a", "N")], is_coarse, ..OutputsChart::default() };
            outputs_of(&chart).rgb
        };
        let painted = |rgb: Vec<u8>| rgb.as_chunks::<3>().0.iter().filter(|p| **p != [255; 3]).count();
        assert!(painted(picture(true)) < painted(picture(false)), "no line");
    }

    #[test]
    fn constants_have_no_extremes_and_unknown_units_stand_at_the_axis_alone() {
        let words = |value: Vec<f64>, extremes: Vec<[f64; 2]>| -> String {
            let outputs = vec![OutputSeries { value, extremes, ..series("a", "?") }];
            let picture = outputs_of(&OutputsChart { outputs, ..OutputsChart::default() });
            picture.texts.into_iter().map(|text| text.text + "|").collect()
        };
        let level = words(vec![3.0; 3], vec![[3.0, 0.0], [3.0, 1.23]]);
        assert!(!level.contains(" at ") && !level.contains("marked"), "{level}");
        let rising = words(vec![0.0, 1.0, 0.5], vec![[0.0, 0.0], [1.0, 1.0]]);
        assert!(
            rising.contains("|1.00 at 1.00 s|") && rising.contains("extremes of the whole run"),
            "{rising}"
        );
    }

    fn outputs_of(chart: &OutputsChart) -> Picture {
        outputs(chart, 1.0).expect("a picture")
    }
}
