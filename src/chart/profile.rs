//! A value over one other: a line through points, with dots where they are few, and grey ones on the upper
//! edge where there is no value.

use super::axis::{Axis, Scale};
use super::file::Picture;
use super::grid::stacked;
use super::lines::Point;
use super::palette::{BLUE, GUIDE};
use super::sheet::{Pen, Sheet};
use super::{ChartError, PAGE};
use std::f64::consts::PI;

/// Up to so many points are marked one by one.
const FEW: usize = 60;

/// A value at many others.
#[derive(Clone, Debug, Default)]
pub struct ProfileChart {
    /// Title, with markup.
    pub title: String,
    /// Parts of the caption, with markup.
    pub caption: Vec<String>,
    /// Name of what is varied with its unit in brackets, with markup.
    pub x_name: String,
    /// Name of the value with its unit in brackets, with markup.
    pub y_name: String,
    /// What is varied, ascending or descending.
    pub x: Vec<f64>,
    /// The values; those that are not numbers leave a gap and are marked on the upper edge.
    pub y: Vec<f64>,
    /// Values on a logarithmic axis; zeros then leave a gap.
    pub log: bool,
}

/// Draws the values, joined where they are neighbours.
///
/// # Errors
/// [`ChartError`] if the resolution is out of range or drawing fails.
pub fn profile(chart: &ProfileChart, px_per_pt: f64) -> Result<Picture, ChartError> {
    let sheet = Sheet::new(PAGE, px_per_pt)?;
    let under = sheet.heading(&chart.title, &chart.caption)?;
    let points: Vec<Point> = chart.x.iter().zip(&chart.y).map(|(&x, &y)| [x, y]).collect();
    let mut x = Axis::tight(&chart.x_name, chart.x.iter().copied());
    let (low, high) = x.ends();
    if chart.x_name.contains("[rad]") && high - low > 0.75 * PI && low.abs().max(high) < 1e4 * PI {
        x.scale = Scale::Pi;
        (x.from, x.to) = chart
            .x
            .iter()
            .filter(|x| x.is_finite())
            .fold((high, low), |(from, to), &x| (x.min(from), x.max(to)));
    }
    let values = || chart.y.iter().copied();
    let y = if chart.log && spans_decades(&chart.y) {
        Axis::decades(&chart.y_name, values())
    } else {
        Axis::fit(&chart.y_name, values())
    };
    let panels = stacked(&sheet, under, &x, vec![y], 20.0)?;
    let panel = &panels[0];
    let pieces = panel.series(&points, &Pen::new(BLUE, if points.len() > 400 { 1.0 } else { 1.6 }))?;
    if points.len() <= FEW {
        for place in
            points.iter().map(|&point| panel.at(point)).filter(|place| place.iter().all(|c| c.is_finite()))
        {
            sheet.disc(place, 2.0, BLUE)?;
        }
    } else {
        // A value between two gaps makes no line.
        let alone = |k: usize| {
            let gap = |k: Option<usize>| k.and_then(|k| chart.y.get(k)).is_none_or(|y| !y.is_finite());
            gap(k.checked_sub(1)) && gap(Some(k + 1))
        };
        let lonely: Vec<Point> = (0..points.len()).filter(|&k| alone(k)).map(|k| points[k]).collect();
        panel.dots(&lonely, BLUE)?;
    }
    let absent = points
        .iter()
        .filter(|point| !point[1].is_finite())
        .map(|point| panel.at([point[0], panel.y.from])[0]);
    for x in absent.filter(|x| x.is_finite()) {
        sheet.disc([x, panel.bounds[1]], 1.2, GUIDE)?;
    }
    if pieces.is_empty() && points.iter().all(|point| !point[1].is_finite()) {
        panel.empty("no data")?;
    }
    Ok(sheet.picture(&chart.title, &chart.caption))
}

/// Whether a logarithmic axis shows values better: within a decade or so a linear one shows as much and
/// wastes less.
pub(crate) fn spans_decades(values: &[f64]) -> bool {
    let finite = values.iter().filter(|value| value.is_finite());
    let (least, most) = finite.fold((f64::INFINITY, 0.0_f64), |(low, high), &y| (low.min(y), high.max(y)));
    most > 20.0 * least
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_dots_and_nothing_at_all_can_be_drawn() {
        for count in [0, 1, 30, 500] {
            for log in [false, true] {
                let x: Vec<f64> = (0..count).map(|k| f64::from(k) * 0.02 - 3.0).collect();
                let y = x.iter().map(|x| if x.abs() < 1.0 { f64::NAN } else { x * x }).collect();
                let chart = ProfileChart {
                    x,
                    y,
                    log,
                    x_name: "*φ* [rad]".into(),
                    y_name: "time [s]".into(),
                    ..ProfileChart::default()
                };
                let picture = profile(&chart, 1.0).expect("a picture");
                let blue =
                    picture.rgb.as_chunks::<3>().0.iter().any(|&[red, _, blue]| red < 60 && blue > 150);
                assert_eq!(blue, count > 0, "{count} {log}");
            }
        }
    }
}
