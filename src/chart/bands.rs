//! Curves over time with bands of uncertainty, and measured values as dots, a panel each.

use super::axis::Axis;
use super::file::Picture;
use super::grid::stacked;
use super::lines::Point;
use super::palette::{BLUE, VERMILLION, WHITE, mix};
use super::sheet::{Pen, Sheet};
use super::{ChartError, PAGE};

/// Height of the page beyond its panels, and of each of these \[pt\].
const HEIGHTS: [f64; 2] = [80.0, 110.0];
/// Panels at most.
const PANELS: usize = 6;

/// One curve.
#[derive(Clone, Debug, Default)]
pub struct Band {
    /// Name with its unit in brackets, with markup.
    pub name: String,
    /// Times \[s\], ascending.
    pub time: Vec<f64>,
    /// Values; none where only dots are drawn.
    pub value: Vec<f64>,
    /// Half widths of the band about it; none where there is none.
    pub half_width: Vec<f64>,
    /// Measured values: times and values.
    pub dots: Vec<Point>,
    /// A dotted line at zero.
    pub zero: bool,
}

/// Several of them.
#[derive(Clone, Debug, Default)]
pub struct Bands {
    /// Title, with markup.
    pub title: String,
    /// Parts of the caption, with markup.
    pub caption: Vec<String>,
    /// The curves.
    pub bands: Vec<Band>,
}

/// Draws them, bands pale behind their curves, dots in red.
///
/// # Errors
/// [`ChartError`] if the resolution is out of range or drawing fails.
pub fn bands(chart: &Bands, px_per_pt: f64) -> Result<Picture, ChartError> {
    let shown = &chart.bands[..chart.bands.len().min(PANELS)];
    let mut caption = chart.caption.clone();
    if shown.len() < chart.bands.len() {
        caption.push(format!("{} more in the table", chart.bands.len() - shown.len()));
    }
    let size = [PAGE[0], HEIGHTS[0] + HEIGHTS[1] * shown.len().max(2) as f64];
    let sheet = Sheet::new(size, px_per_pt)?;
    let under = sheet.heading(&chart.title, &caption)?;
    let edge = |band: &Band, sign: f64| -> Vec<Point> {
        let width = |k: usize| band.half_width.get(k).copied().unwrap_or(0.0);
        (0..band.value.len().min(band.time.len()))
            .map(|k| [band.time[k], band.value[k] + sign * width(k)])
            .filter(|point| point[1].is_finite())
            .collect()
    };
    let all = |band: &Band| -> Vec<Point> { [edge(band, -1.0), edge(band, 1.0), band.dots.clone()].concat() };
    let times = shown.iter().flat_map(|band| all(band).into_iter().map(|point| point[0]));
    let x = Axis::tight("time [s]", times);
    let y = |band: &Band| Axis::fit(&band.name, all(band).into_iter().map(|point| point[1]));
    let panels = stacked(&sheet, under, &x, shown.iter().map(y).collect(), 20.0)?;
    for (panel, band) in panels.iter().zip(shown) {
        let (low, high) = (edge(band, -1.0), edge(band, 1.0));
        if !band.half_width.is_empty() && low.len() > 1 {
            let ring = low.iter().chain(high.iter().rev()).map(|&point| panel.at(point));
            sheet.polygon(&ring.collect::<Vec<Point>>(), mix(BLUE, WHITE, 0.75))?;
        }
        if band.zero {
            panel.level(0.0)?;
        }
        panel.series(&edge(band, 0.0), &Pen::new(BLUE, 1.4))?;
        for &dot in &band.dots {
            let at = panel.at(dot);
            if at.iter().all(|c| c.is_finite()) {
                sheet.disc(at, if band.dots.len() > 200 { 1.0 } else { 1.7 }, VERMILLION)?;
            }
        }
        if low.is_empty() && band.dots.is_empty() {
            panel.empty("no data")?;
        }
    }
    Ok(sheet.picture(&chart.title, &caption))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_bands_and_dots_are_drawn_and_nothing_at_all_too() {
        let time = vec![0.0, 0.5, 1.0];
        let band = Band {
            name: "*φ* [rad]".into(),
            value: vec![0.0, 1.0, -1.0],
            half_width: vec![0.1, 0.3, 2.0],
            dots: vec![[0.25, 0.7]],
            time,
            zero: true,
        };
        for all in [vec![], vec![Band::default()], vec![band.clone()], vec![band; 9]] {
            let has_any = all.iter().any(|band| !band.dots.is_empty());
            let picture = bands(&Bands { bands: all, ..Bands::default() }, 1.0).expect("a picture");
            let red = picture.rgb.as_chunks::<3>().0.iter().any(|&[red, _, blue]| red > 180 && blue < 60);
            assert_eq!(red, has_any);
        }
    }
}
