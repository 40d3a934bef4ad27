//! Floquet multipliers in the complex plane, with the unit circle inside which disturbances die away.

use super::axis::Axis;
use super::file::Picture;
use super::grid::AIR;
use super::labels::Occupied;
use super::lines::Point;
use super::palette::{BLUE, GREY, GUIDE, VERMILLION, readable};
use super::panel::{Panel, WrittenParts};
use super::sheet::{Pen, Sheet};
use super::ticks::figure;
use super::{ChartError, PAGE};
use std::f64::consts::TAU;

/// Side of the panel \[pt\].
const SIDE: f64 = 260.0;
/// A multiplier beyond the circle by more grows.
const OUTSIDE: f64 = 1e-4;
/// Sizes that far from 1 are told in three digits.
const NEAR: f64 = 0.1;
/// Points of the circle.
const POINTS: usize = 240;

/// Multipliers of one motion.
#[derive(Clone, Debug, Default)]
pub struct Multipliers {
    /// Title, with markup.
    pub title: String,
    /// Parts of the caption, with markup.
    pub caption: Vec<String>,
    /// Real and imaginary parts.
    pub values: Vec<[f64; 2]>,
}

/// Draws them, those outside the unit circle in red, with their magnitudes.
///
/// # Errors
/// [`ChartError`] if the resolution is out of range or drawing fails.
pub fn multipliers(chart: &Multipliers, px_per_pt: f64) -> Result<Picture, ChartError> {
    let under = Sheet::new(PAGE, 0.5)?.heading(&chart.title, &chart.caption)?;
    let sheet = Sheet::new([PAGE[0], under + AIR + SIDE + 44.0], px_per_pt)?;
    sheet.heading(&chart.title, &chart.caption)?;
    let farthest = chart.values.iter().flatten().map(|x| x.abs()).filter(|x| x.is_finite());
    let reach = 1.15 * farthest.fold(1.0, f64::max);
    let [x, y] = ["real part", "imaginary part"].map(|name| Axis::linear(name, -reach, reach));
    let left = 0.5 * (PAGE[0] - SIDE);
    let top = under + AIR;
    let panel = Panel::new(&sheet, [left, top, left + SIDE, top + SIDE], x, y).equal_steps();
    panel.frame(WrittenParts { x: true, y_name_at: panel.name_place() })?;
    let mut occupied = Occupied::default();
    let circle: Vec<Point> = (0..=POINTS)
        .map(|k| {
            let (sin, cos) = (TAU * k as f64 / POINTS as f64).sin_cos();
            [cos, sin]
        })
        .collect();
    for piece in panel.series(&circle, &Pen::new(GUIDE, 1.0))? {
        occupied.line(&piece);
    }
    for value in &chart.values {
        let at = panel.at(*value);
        occupied.block([at[0] - 4.0, at[1] - 4.0, at[0] + 4.0, at[1] + 4.0]);
    }
    for [re, im] in &chart.values {
        let size = re.hypot(*im);
        let colour = if size > 1.0 + OUTSIDE { VERMILLION } else { BLUE };
        let at = panel.at([*re, *im]);
        sheet.disc(at, 3.2, colour)?;
        // Of a pair one figure is enough.
        if *im >= 0.0 {
            // About 1 the digits after it matter.
            let size = if (size - 1.0).abs() < NEAR { format!("{size:.4}") } else { figure(size) };
            let words = format!("|*λ*| = {size}");
            panel.note_beside(at, &words, readable(colour), &mut occupied)?;
        }
    }
    let side = std::f64::consts::FRAC_1_SQRT_2;
    panel.note_beside(panel.at([side, -side]), "unit circle", GREY, &mut occupied)?;
    Ok(sheet.picture(&chart.title, &chart.caption))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multipliers_outside_the_circle_are_red() {
        for (values, grows) in
            [(vec![[0.6, 0.8], [0.6, -0.8]], false), (vec![[-2.5, 0.0], [-0.4, 0.0]], true)]
        {
            let chart = Multipliers { values, ..Multipliers::default() };
            let picture = multipliers(&chart, 1.0).expect("a picture");
            let red = picture.rgb.as_chunks::<3>().0.iter().any(|&[red, _, blue]| red > 180 && blue < 60);
            assert_eq!(red, grows);
        }
    }
}
