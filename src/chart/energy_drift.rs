//! Energy drift: the largest relative error so far against time, one line a method.
//!
//! A running maximum never plunges, so its line can be followed over many decades.  With a logarithmic time
//! axis dashed guides show the two laws of long runs: rounding errors that cancel grow like √t, a bias grows
//! like t (Brouwer, "On the accumulation of errors in numerical integration", Astronomical Journal 46, 1937).

use super::axis::{Axis, Scale};
use super::file::Picture;
use super::grid::{label_room, stacked};
use super::labels::Occupied;
use super::lines::{Point, clip, running_maximum};
use super::names::shortened_apart;
use super::palette::{GREY, GUIDE, MarkStyle, marks, readable};
use super::panel::{Panel, TURNS};
use super::sheet::{NOTE, Pen, Sheet, note};
use super::text::{Align, Lettering, TextLevel};
use super::{ChartError, PAGE};

/// Errors of one run.
#[derive(Clone, Debug, Default)]
pub struct DriftSeries {
    /// Method or stabilization; chooses the colour.  An unknown one gets a free colour.
    pub method: String,
    /// Label, with markup.
    pub name: String,
    /// Times \[s\], ascending.
    pub time: Vec<f64>,
    /// Errors at these times, of any sign; those that are not numbers are skipped.
    pub error: Vec<f64>,
}

/// Energy drift of one or several runs.
#[derive(Clone, Debug, Default)]
pub struct EnergyDrift {
    /// Title, with markup.
    pub title: String,
    /// Parts of the caption, with markup.
    pub caption: Vec<String>,
    /// What drifts: `energy` or `energy minus work`.
    pub quantity: String,
    /// The runs.
    pub series: Vec<DriftSeries>,
    /// Logarithmic time, with guides.
    pub log_time: bool,
}

/// Draws the largest relative error so far against time.
///
/// # Errors
/// [`ChartError`] if the resolution is out of range or drawing fails.
pub fn energy_drift(chart: &EnergyDrift, px_per_pt: f64) -> Result<Picture, ChartError> {
    let sheet = Sheet::new(PAGE, px_per_pt)?;
    let under = sheet.heading(&chart.title, &chart.caption)?;
    let lines: Vec<Vec<Point>> =
        chart.series.iter().map(|series| running_maximum(&series.time, &series.error)).collect();
    let marks = marks(chart.series.iter().map(|series| series.method.as_str()));
    let labels = labels(&sheet, chart.series.iter().map(|series| series.name.as_str()).zip(&lines));

    let times = || lines.iter().flatten().map(|p| p[0]);
    let x =
        if chart.log_time { Axis::log_tight("time [s]", times()) } else { Axis::tight("time [s]", times()) };
    let name = format!("largest relative error of {}", chart.quantity);
    let y = with_rounding_unit(drift_axis(
        &name,
        lines.iter().flatten().map(|p| p[1]),
        lines.iter().any(|line| is_zero(line)),
    ));
    let right = label_room(&sheet, labels.iter().map(String::as_str), false);
    let panels = stacked(&sheet, under, &x, vec![y], right)?;
    let panel = &panels[0];

    let (mut occupied, mut ends) = (Occupied::default(), Vec::new());
    if shows(panel, f64::EPSILON) {
        panel.level(f64::EPSILON)?;
    }
    for line in &lines {
        for piece in clip(line.iter().map(|&[t, v]| [panel.x.fraction(t), panel.y.fraction(v)])) {
            occupied.line(&piece.into_iter().map(|p| panel.page(p)).collect::<Vec<_>>());
        }
    }
    if chart.log_time {
        for (power, words) in [(1.0, "∝ *t*"), (0.5, "∝ √*t*")] {
            guide(&sheet, panel, power, words, &mut occupied)?;
        }
    }
    for ((line, mark), words) in lines.iter().zip(&marks).zip(labels) {
        if let Some(end) = draw(&sheet, panel, line, mark)? {
            ends.push((end, words, *mark));
        }
    }
    if shows(panel, f64::EPSILON) {
        rounding_unit(&sheet, panel, &mut occupied)?;
    }
    if ends.is_empty() {
        panel.empty("no data")?;
    }
    panel.end_labels(&ends, false)?;
    Ok(sheet.picture(&chart.title, &chart.caption))
}

/// Whether there are samples and all of them are exactly zero.
pub(crate) fn is_zero(line: &[Point]) -> bool {
    !line.is_empty() && line.iter().all(|p| p[1] == 0.0)
}

/// The names, and what a logarithmic axis cannot show.
pub(crate) fn labels<'a>(
    sheet: &Sheet,
    series: impl Iterator<Item = (&'a str, &'a Vec<Point>)>,
) -> Vec<String> {
    let label = |(name, line): (&str, &Vec<Point>)| {
        let is_infinite = line.last().is_some_and(|p| p[1].is_infinite());
        let remark = match (is_zero(line), is_infinite) {
            (true, _) => ": exactly 0",
            (_, true) => ": infinite",
            _ => "",
        };
        format!("{name}{remark}")
    };
    let whole: Vec<String> = series.map(label).collect();
    shortened_apart(sheet, whole.iter().map(String::as_str))
}

/// Draws a running maximum; exact zeros become dots on the lower edge.  Returns the height of its end \[pt\],
/// if it has any point.
pub(crate) fn draw(
    sheet: &Sheet,
    panel: &Panel,
    line: &[Point],
    mark: &MarkStyle,
) -> Result<Option<f64>, ChartError> {
    let Some(last) = line.last() else { return Ok(None) };
    let infinite = last[1].is_infinite();
    if is_zero(line) {
        let edge = panel.bounds[3];
        for k in 0..=8 {
            sheet.marker([panel.page([f64::from(k) / 8.0, 0.0])[0], edge], mark.shape, mark.colour)?;
        }
        return Ok(Some(edge));
    }
    let pieces = panel.series(line, &Pen::new(mark.colour, 1.8).dashed(TURNS[mark.turn % TURNS.len()]))?;
    if pieces.is_empty() {
        // A single sample makes no line.
        for &point in line.iter().filter(|p| p[1] > 0.0) {
            let place = panel.at(point);
            if place.iter().all(|c| c.is_finite()) {
                sheet.marker(place, mark.shape, mark.colour)?;
            }
        }
    }
    let end = pieces.last().and_then(|piece| piece.last()).map_or_else(|| panel.at(*last)[1], |p| p[1]);
    Ok(Some(if end.is_finite() && !infinite {
        end.clamp(panel.bounds[1], panel.bounds[3])
    } else {
        panel.bounds[1]
    }))
}

/// Decades around the drifts; without any, those around the rounding unit.
///
/// Where a series among them is exactly zero, the lower edge is kept free for its markers.
pub(crate) fn drift_axis(name: &str, values: impl Iterator<Item = f64>, zeros: bool) -> Axis {
    let values: Vec<f64> = values.filter(|&v| v > 0.0 && v.is_finite()).collect();
    if values.is_empty() {
        return Axis::decades(name, [1e-17, 3e-15].into_iter());
    }
    let axis = Axis::decades(name, values.into_iter());
    let below = if zeros { (0.12 * (axis.to / axis.from).log10()).ceil() } else { 0.0 };
    Axis { from: (axis.from * 10_f64.powf(-below)).max(1e-320), ..axis }
}

/// The axis, widened to the rounding unit if the data come near it.
pub(crate) fn with_rounding_unit(y: Axis) -> Axis {
    let (low, high) = y.ends();
    if low > 0.999e-16 && low < 1e-12 { Axis { from: 1e-16, to: high, ..y } } else { y }
}

fn shows(panel: &Panel, value: f64) -> bool {
    let (low, high) = panel.y.ends();
    value > low && value < high
}

fn rounding_unit(sheet: &Sheet, panel: &Panel, occupied: &mut Occupied) -> Result<(), ChartError> {
    let words = "*ε* = 2^{−52}";
    let width = sheet.width(words, NOTE, false);
    let height = panel.at([panel.x.to, f64::EPSILON])[1];
    let right = panel.bounds[2] - 3.0;
    let places =
        [-4.0, NOTE + 3.0].into_iter().flat_map(|dy| [0.0, 0.5, 0.25, 0.75, 0.9].map(|share| (dy, share)));
    let boxed = |(dy, share): (f64, f64)| {
        let right = right - share * (right - panel.bounds[0] - width - 3.0);
        [right - width, height + dy - 0.9 * NOTE, right, height + dy]
    };
    let inside = |b: &[f64; 4]| b[1] > panel.bounds[1] && b[3] < panel.bounds[3] - 1.0;
    let Some(best) =
        places.map(boxed).filter(inside).min_by(|a, b| occupied.cost(*a).total_cmp(&occupied.cost(*b)))
    else {
        return Ok(());
    };
    occupied.block(best);
    sheet.words(
        words,
        Lettering { halo: true, ..note(GREY, Align::Left, TextLevel::Baseline) },
        [best[0], best[3]],
    )
}

/// A dashed line of slope `power` where it meets few other lines, with its law written along it.
fn guide(
    sheet: &Sheet,
    panel: &Panel,
    power: f64,
    words: &str,
    occupied: &mut Occupied,
) -> Result<(), ChartError> {
    if panel.x.scale != Scale::Log {
        return Ok(());
    }
    let decades = |axis: &Axis| axis.to.log10() - axis.from.log10();
    let rise = power * decades(&panel.x) / decades(&panel.y);
    // A guide that crosses the whole panel within a fraction of its width says nothing.
    if !(0.02..=3.0).contains(&rise) || decades(&panel.x) < 1.0 {
        return Ok(());
    }
    let width = sheet.width(words, NOTE, false);
    let [left, top, right, bottom] = panel.bounds;
    let slope = rise * (bottom - top) / (right - left);
    let angle = slope.atan();
    let mut best: Option<(f64, Vec<Point>, Point)> = None;
    for k in 0..40 {
        let start = -0.6 * rise + (1.0 + 0.6 * rise) * (f64::from(k) + 0.5) / 40.0;
        let Some(piece) = clip([[0.0, start], [1.0, start + rise]]).pop() else { continue };
        let piece: Vec<Point> = piece.into_iter().map(|p| panel.page(p)).collect();
        let (from, to) = (piece[0], piece[piece.len() - 1]);
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        if length < 0.45 * (right - left) {
            continue;
        }
        let along = |s: f64| [from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1])];
        let met: usize = (0..=40).map(|i| occupied.near(along(f64::from(i) / 40.0), 7.0).min(6)).sum();
        for share in [0.65, 0.5, 0.35, 0.8, 0.2] {
            for side in [1.0, -1.0] {
                let middle = along(share);
                let off = side * 8.0;
                let centre = [middle[0] + off * angle.sin(), middle[1] + off * angle.cos()];
                let reach = [0.5 * width * angle.cos() + 3.0, 0.5 * width * angle.sin() + 5.0];
                let bounds =
                    [centre[0] - reach[0], centre[1] - reach[1], centre[0] + reach[0], centre[1] + reach[1]];
                let outside = bounds[0] < left || bounds[1] < top || bounds[2] > right || bounds[3] > bottom;
                let cost = met as f64 + 3.0 * occupied.cost(bounds) + if outside { 500.0 } else { 0.0 }
                    - 0.02 * length
                    + if side < 0.0 { 1.0 } else { 0.0 };
                if best.as_ref().is_none_or(|(least, ..)| cost < *least) {
                    best = Some((cost, piece.clone(), centre));
                }
            }
        }
    }
    let Some((_, piece, centre)) = best.filter(|best| best.0 < 150.0) else { return Ok(()) };
    sheet.line(&piece, &Pen::new(GUIDE, 0.9).dashed(&[4.0, 3.0]))?;
    occupied.line(&piece);
    let reach = [0.5 * width + 2.0, 0.5 * width * angle.sin() + 5.0];
    occupied.block([centre[0] - reach[0], centre[1] - reach[1], centre[0] + reach[0], centre[1] + reach[1]]);
    let lettering = Lettering { angle, halo: true, ..note(readable(GREY), Align::Centre, TextLevel::Middle) };
    sheet.words(words, lettering, centre)
}
