//! Error against run time: a marker for each setting of each method; lower is more accurate, further left is faster.

use super::axis::{Axis, Scale};
use super::file::Picture;
use super::grid::{shortened, stacked};
use super::labels::{Occupied, place};
use super::lines::{Point, clip};
use super::palette::{Colour, GREY, INK, Mark, ORANGE, WHITE, marks, mix, readable};
use super::panel::{Panel, TURNS};
use super::sheet::{NOTE, Pen, Sheet, note};
use super::text::{Align, Lettering, Level};
use super::{ChartError, PAGE};

/// Widths of the band under the Pareto front and of lines with markers \[pt\].
const FRONT: f64 = 9.0;
const LINE: f64 = 1.6;

/// One method at several settings.
#[derive(Clone, Debug, Default)]
pub struct WorkSeries {
    /// Method; chooses colour and shape.
    pub method: String,
    /// Label, with markup.
    pub name: String,
    /// Run time \[s\] and error of each setting, from the coarsest to the finest.
    pub points: Vec<[f64; 2]>,
}

/// Error against run time of several methods.
#[derive(Clone, Debug, Default)]
pub struct WorkPrecision {
    /// Title, with markup.
    pub title: String,
    /// Parts of the caption, with markup.
    pub caption: Vec<String>,
    /// Name of the run time, without unit: `run time per simulated second`.
    pub time_name: String,
    /// Name of the error with its unit in brackets.
    pub error_name: String,
    /// The methods.
    pub series: Vec<WorkSeries>,
    /// An error below which nothing can be said, and why.
    pub floor: Option<(f64, String)>,
}

/// Draws error against run time, both logarithmic, with the Pareto front as a pale band.
///
/// Settings without an error lie on the lower edge; those without a time are left out.
///
/// # Errors
/// [`ChartError`] if the resolution is out of range or drawing fails.
pub fn work_precision(chart: &WorkPrecision, px_per_pt: f64) -> Result<Picture, ChartError> {
    let sheet = Sheet::new(PAGE, px_per_pt)?;
    let under = sheet.heading(&chart.title, &chart.caption)?;
    let usable = |p: &&[f64; 2]| p[0] > 0.0 && p[0] <= 1e300 && p[1] >= 0.0 && p[1] <= 1e300;
    let longest = chart.series.iter().flat_map(|s| &s.points).filter(usable).map(|p| p[0]).fold(0.0, f64::max);
    let (unit, per_second) = if longest < 0.02 {
        ("µs", 1e6)
    } else if longest < 20.0 {
        ("ms", 1e3)
    } else {
        ("s", 1.0)
    };
    let points: Vec<Vec<Point>> =
        chart.series.iter().map(|s| s.points.iter().filter(usable).map(|p| [p[0] * per_second, p[1]]).collect()).collect();
    let all = || points.iter().flatten();

    let x = roomy(&format!("{} [{unit}]", chart.time_name), all().map(|p| p[0]));
    let floor = chart.floor.as_ref().map(|floor| floor.0).filter(|&value| value > 0.0 && value.is_finite());
    let y = Axis::decades(&chart.error_name, all().map(|p| p[1]).chain(floor));
    let panels = stacked(&sheet, under, &x, vec![y], 28.0)?;
    let panel = &panels[0];
    // An error of exactly zero is shown at the lower edge.
    let at = |p: &Point| if p[1] > 0.0 { panel.at(*p) } else { panel.page([panel.x.fraction(p[0]), 0.0]) };

    let mut occupied = Occupied::default();
    let band: Vec<Point> = front(all()).iter().map(at).collect();
    sheet.line(&band, &Pen::new(mix(ORANGE, WHITE, 0.72), FRONT))?;
    for side in [-4.0, 0.0, 4.0] {
        occupied.line(&band.iter().map(|p| [p[0] + side, p[1] + side]).collect::<Vec<_>>());
    }
    if let [only] = band[..] {
        sheet.disc(only, 0.5 * FRONT, mix(ORANGE, WHITE, 0.72))?;
    }
    if let Some(value) = floor {
        panel.level(value)?;
        occupied.line(&[panel.at([panel.x.from, value]), panel.at([panel.x.to, value])]);
    }
    let marks = marks(chart.series.iter().map(|series| series.method.as_str()));
    for (points, mark) in points.iter().zip(&marks) {
        curve(&sheet, panel, &points.iter().map(at).collect::<Vec<_>>(), mark, &mut occupied)?;
    }
    for ((series, points), mark) in chart.series.iter().zip(&points).zip(&marks) {
        let Some(last) = points.last() else { continue };
        let zero = if points.iter().all(|p| p[1] == 0.0) { ": exactly 0" } else { "" };
        let label = shortened(&sheet, &format!("{}{zero}", series.name));
        beside(&sheet, panel, at(last), &label, readable(mark.colour), &mut occupied)?;
    }
    if let (Some((value, words)), Some(_)) = (&chart.floor, floor) {
        let right = panel.bounds[2];
        beside(
            &sheet,
            panel,
            [right - 0.5 * sheet.width(words, NOTE, false), panel.at([panel.x.to, *value])[1]],
            words,
            GREY,
            &mut occupied,
        )?;
    }
    if band.len() > 1 {
        beside(&sheet, panel, band[0], "Pareto front", readable(mix(ORANGE, INK, 0.4)), &mut occupied)?;
    }
    if all().next().is_none() {
        panel.empty("no data")?;
    }
    Ok(sheet.picture(&chart.title, &chart.caption))
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

/// The settings that no other beats in both time and error, fastest first.
fn front<'a>(points: impl Iterator<Item = &'a Point>) -> Vec<Point> {
    let mut sorted: Vec<Point> = points.copied().collect();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut least = f64::INFINITY;
    sorted.retain(|p| {
        let better = p[1] < least;
        least = least.min(p[1]);
        better
    });
    sorted
}

fn curve(sheet: &Sheet, panel: &Panel, points: &[Point], mark: &Mark, occupied: &mut Occupied) -> Result<(), ChartError> {
    let [left, top, right, bottom] = panel.bounds;
    let pen = Pen::new(mark.colour, LINE).dashed(TURNS[mark.turn % TURNS.len()]);
    for piece in clip(points.iter().map(|p| [(p[0] - left) / (right - left), (bottom - p[1]) / (bottom - top)])) {
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

/// Words beside a place, which may reach over the right edge of the panel.
fn beside(sheet: &Sheet, panel: &Panel, at: Point, words: &str, colour: Colour, occupied: &mut Occupied) -> Result<(), ChartError> {
    let size = [sheet.width(words, NOTE, false), 0.8 * NOTE];
    let [left, top, right, bottom] = panel.bounds;
    let (bounds, _) = place(at, 6.5, size, [left, top, right + 20.0, bottom], &[], occupied);
    occupied.block(bounds);
    let lettering = Lettering { halo: true, ..note(colour, Align::Left, Level::Middle) };
    sheet.words(words, lettering, [bounds[0], 0.5 * (bounds[1] + bounds[3])])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let points = [[1.0, 1e-3], [2.0, 1e-2], [3.0, 1e-9], [3.0, 1e-8], [4.0, 1e-9], [5.0, 0.0]];
        assert_eq!(front(points.iter()), [[1.0, 1e-3], [3.0, 1e-9], [5.0, 0.0]]);
    }

    #[test]
    fn axes_of_run_time_end_at_round_values() {
        let axis = roomy("", [14.0, 2500.0].into_iter());
        assert_eq!((axis.from, axis.to), (10.0, 5000.0));
    }
}
