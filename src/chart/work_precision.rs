//! Error against run time, or against evaluations: a marker for each setting of each method; lower is more
//! accurate, further left is cheaper.
//!
//! Methods that have a setting on the Pareto front, which no other setting beats in both, are drawn in full;
//! the others are thinner and paler.

use super::axis::{Axis, Scale};
use super::file::Picture;
use super::grid::stacked;
use super::labels::{Occupied, place};
use super::lines::{Point, clip};
use super::names::shortened_apart;
use super::palette::{Colour, GREY, INK, MarkStyle, ORANGE, WHITE, marks, mix, readable};
use super::panel::{Panel, TURNS};
use super::sheet::{NOTE, Pen, Sheet, note};
use super::text::{Align, Lettering, TextLevel};
use super::{ChartError, PAGE};
use crate::run::compare::front;

/// Widths of the band under the Pareto front and of lines with markers \[pt\].
const FRONT: f64 = 9.0;
const LINE: f64 = 1.6;
/// The width of lines that have no part in the front \[pt\], and how far they are mixed towards white.
const OTHER: f64 = 1.0;
const PALE: f64 = 0.45;
/// Share of the least error from which on a floor is shown.
const NEAR: f64 = 1e-2;
/// Lines beyond which a page is a little higher \[pt\].
const CROWD: usize = 6;
const HIGHER: f64 = 60.0;

/// Rings around a point on the lower edge in which there may be words.
const STACKED: u32 = 32;

/// One method at several settings.
#[derive(Clone, Debug, Default)]
pub struct WorkSeries {
    /// Method; chooses colour and shape.
    pub method: String,
    /// Label, with markup.
    pub name: String,
    /// Cost (run time \[s\], or a number) and error of each setting, from the coarsest to the finest.
    pub points: Vec<[f64; 2]>,
}

/// What errors are drawn against.
#[derive(Clone, Debug, PartialEq)]
pub enum Cost {
    /// Run times, under this name, which gets a unit.
    Time(String),
    /// Numbers of something, under this name.
    Count(String),
}

impl Default for Cost {
    fn default() -> Self {
        Self::Time("run time".to_owned())
    }
}

impl Cost {
    /// The name of the axis and what costs up to the largest are multiplied by on it.
    fn axis(&self, largest: f64) -> (String, f64) {
        match self {
            Self::Time(name) if largest < 0.02 => (format!("{name} [µs]"), 1e6),
            Self::Time(name) if largest < 20.0 => (format!("{name} [ms]"), 1e3),
            Self::Time(name) => (format!("{name} [s]"), 1.0),
            Self::Count(name) => (name.clone(), 1.0),
        }
    }
}

/// Error of several methods against what they cost.
#[derive(Clone, Debug, Default)]
pub struct WorkPrecision {
    /// Title, with markup.
    pub title: String,
    /// Parts of the caption, with markup.
    pub caption: Vec<String>,
    /// What it costs.
    pub cost: Cost,
    /// Name of the error with its unit in brackets.
    pub error_name: String,
    /// The methods.
    pub series: Vec<WorkSeries>,
    /// An error beyond which a result says nothing: such settings have no part in the front, and lie on the
    /// upper edge.
    pub lost: Option<f64>,
    /// An error below which nothing can be said, and why.
    pub floor: Option<(f64, String)>,
}

/// Draws error against cost, both logarithmic, with the Pareto front as a pale band.
///
/// Settings without an error lie on the lower edge; those without a cost are left out.
///
/// # Errors
/// [`ChartError`] if the resolution is out of range or drawing fails.
pub fn work_precision(chart: &WorkPrecision, px_per_pt: f64) -> Result<Picture, ChartError> {
    let higher = if chart.series.len() > CROWD { HIGHER } else { 0.0 };
    let sheet = Sheet::new([PAGE[0], PAGE[1] + higher], px_per_pt)?;
    let under = sheet.heading(&chart.title, &chart.caption)?;
    let usable = |p: &&[f64; 2]| p[0] > 0.0 && p[0] <= 1e300 && p[1] >= 0.0 && p[1] <= 1e300;
    let largest =
        chart.series.iter().flat_map(|s| &s.points).filter(usable).map(|p| p[0]).fold(0.0, f64::max);
    let (name, scale) = chart.cost.axis(largest);
    let lost = chart.lost.filter(|&value| value > 0.0 && value < 1e299);
    let most = lost.map_or(f64::INFINITY, |lost| 10.0 * lost);
    let points: Vec<Vec<Point>> = chart
        .series
        .iter()
        .map(|s| s.points.iter().filter(usable).map(|p| [p[0] * scale, p[1].min(most)]).collect())
        .collect();
    let all: Vec<Point> = points.concat();

    let x = roomy(&name, all.iter().map(|p| p[0]));
    // A floor far below all data would only stretch the page.
    let lowest = all.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
    let floor =
        chart.floor.as_ref().map(|floor| floor.0).filter(|&value| value > NEAR * lowest && value.is_finite());
    let mut y = Axis::decades(&chart.error_name, all.iter().map(|p| p[1]).chain(floor));
    // Whatever is lost lies on the edge itself.
    y.to = y.to.min(most.max(10.0 * y.from));
    let panels = stacked(&sheet, under, &x, vec![y], 28.0)?;
    let panel = &panels[0];
    // An error of exactly zero is shown at the lower edge.
    let at = |p: &Point| if p[1] > 0.0 { panel.at(*p) } else { panel.page([panel.x.fraction(p[0]), 0.0]) };

    let mut occupied = Occupied::default();
    let kept: Vec<Point> = all.iter().filter(|p| lost.is_none_or(|lost| p[1] <= lost)).copied().collect();
    // What is below the floor is not better than what is at it.
    let told: Vec<Point> = kept.iter().map(|p| [p[0], p[1].max(floor.unwrap_or(0.0))]).collect();
    let best: Vec<Point> = front(&told).into_iter().map(|number| kept[number]).collect();
    let band: Vec<Point> = best.iter().map(at).collect();
    sheet.line(&band, &Pen::new(mix(ORANGE, WHITE, 0.72), FRONT))?;
    for side in [-4.0, 0.0, 4.0] {
        occupied.line(&band.iter().map(|p| [p[0] + side, p[1] + side]).collect::<Vec<_>>());
    }
    if let [only] = band[..] {
        sheet.disc(only, 0.5 * FRONT, mix(ORANGE, WHITE, 0.72))?;
    }
    let is_seen = |value: &f64| *value > panel.y.from && *value < panel.y.to;
    let above = lost.filter(is_seen).map(|value| (value, "paths are lost above"));
    let below =
        chart.floor.as_ref().filter(|_| floor.is_some()).map(|(value, words)| (*value, words.as_str()));
    let levels: Vec<(f64, &str)> = above.into_iter().chain(below).collect();
    for (value, _) in &levels {
        panel.level(*value)?;
        occupied.line(&[panel.at([panel.x.from, *value]), panel.at([panel.x.to, *value])]);
    }
    // Lines on the front are drawn last, and get their labels first.
    let marks = marks(chart.series.iter().map(|series| series.method.as_str()));
    let is_best: Vec<bool> = points.iter().map(|points| points.iter().any(|p| best.contains(p))).collect();
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by_key(|&k| is_best[k]);
    for &k in &order {
        let pale = if is_best[k] { 0.0 } else { PALE };
        let mark = MarkStyle { colour: mix(marks[k].colour, WHITE, pale), ..marks[k] };
        let pen = Pen::new(mark.colour, if is_best[k] { LINE } else { OTHER });
        curve(&sheet, panel, &points[k].iter().map(at).collect::<Vec<_>>(), &mark, pen, &mut occupied)?;
    }
    let labels = labels(&sheet, chart.series.iter().zip(&points));
    for &k in order.iter().rev() {
        along(
            &sheet,
            panel,
            &points[k].iter().map(at).collect::<Vec<_>>(),
            &labels[k],
            readable(marks[k].colour),
            &mut occupied,
        )?;
    }
    for (value, words) in levels {
        let right = panel.bounds[2];
        let middle = [right - 0.5 * sheet.width(words, NOTE, false), panel.at([panel.x.to, value])[1]];
        along(&sheet, panel, &[middle], words, GREY, &mut occupied)?;
    }
    if band.len() > 1 {
        along(&sheet, panel, &band, "Pareto front", readable(mix(ORANGE, INK, 0.4)), &mut occupied)?;
    }
    if all.is_empty() {
        panel.empty("no data")?;
    }
    Ok(sheet.picture(&chart.title, &chart.caption))
}

/// The names, and what a logarithmic axis cannot show.
fn labels<'a>(sheet: &Sheet, series: impl Iterator<Item = (&'a WorkSeries, &'a Vec<Point>)>) -> Vec<String> {
    let label = |(series, points): (&WorkSeries, &Vec<Point>)| {
        let zero = if points.iter().all(|p| p[1] == 0.0) { ": exactly 0" } else { "" };
        format!("{}{zero}", series.name)
    };
    let whole: Vec<String> = series.map(label).collect();
    shortened_apart(sheet, whole.iter().map(String::as_str))
}

/// A logarithmic axis with air on both sides, ending at 1, 2 or 5 times a power of ten.
fn roomy(name: &str, values: impl Iterator<Item = f64>) -> Axis {
    let tight = Axis::log_tight(name, values);
    let nice = |value: f64, up: bool| {
        let power = super::ticks::ten(value.log10().floor() as i32);
        let mut candidates = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter();
        if up { candidates.find(|&c| c >= value) } else { candidates.rfind(|&c| c <= value) }.unwrap_or(value)
    };
    Axis { from: nice(0.85 * tight.from, false), to: nice(1.25 * tight.to, true), scale: Scale::Log, ..tight }
}

fn curve(
    sheet: &Sheet,
    panel: &Panel,
    points: &[Point],
    mark: &MarkStyle,
    pen: Pen,
    occupied: &mut Occupied,
) -> Result<(), ChartError> {
    let [left, top, right, bottom] = panel.bounds;
    let pen = pen.dashed(TURNS[mark.turn % TURNS.len()]);
    for piece in
        clip(points.iter().map(|p| [(p[0] - left) / (right - left), (bottom - p[1]) / (bottom - top)]))
    {
        let piece: Vec<Point> = piece.into_iter().map(|p| panel.page(p)).collect();
        occupied.line(&piece);
        sheet.line(&piece, &pen)?;
    }
    for &at in points {
        sheet.marker(at, mark.shape, mark.colour)?;
        occupied.block([at[0] - 3.0, at[1] - 3.0, at[0] + 3.0, at[1] + 3.0]);
    }
    Ok(())
}

/// Words beside that point of a line where they cover least, rather its ends than its middle; they may reach
/// over the right edge of the panel.
fn along(
    sheet: &Sheet,
    panel: &Panel,
    points: &[Point],
    words: &str,
    colour: Colour,
    occupied: &mut Occupied,
) -> Result<(), ChartError> {
    let size = [sheet.width(words, NOTE, false), 0.8 * NOTE];
    let [left, top, right, bottom] = panel.bounds;
    let room = [left, top, right + 20.0, bottom - 3.0];
    let count = points.len();
    // Lines along the lower edge lie on one another: their words are stacked above it.
    let rings = if points.iter().all(|at| at[1] >= bottom) { STACKED } else { 2 };
    // The finest setting, then the coarsest, then what is between.
    let ranks = points.iter().enumerate().map(|(k, at)| {
        (
            if k + 1 == count {
                0.0
            } else if k == 0 {
                1.5
            } else {
                3.0
            },
            at,
        )
    });
    let places = ranks.map(|(rank, &at)| {
        let (bounds, cost) = place(at, 6.5, rings, size, room, &[], occupied);
        (bounds, cost + rank)
    });
    let Some((bounds, _)) = places.min_by(|a, b| a.1.total_cmp(&b.1)) else { return Ok(()) };
    occupied.block(bounds);
    let lettering = Lettering { halo: true, ..note(colour, Align::Left, TextLevel::Middle) };
    sheet.words(words, lettering, [bounds[0], 0.5 * (bounds[1] + bounds[3])])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_of_run_time_end_at_round_values() {
        let axis = roomy("", [14.0, 2500.0].into_iter());
        assert_eq!((axis.from, axis.to), (10.0, 5000.0));
    }
}
