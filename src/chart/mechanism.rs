//! A mechanism in its pose, with the paths of chosen points.

use super::annotations::legend;
use super::file::Picture;
use super::grid::AIR;
use super::labels::Occupied;
use super::panel::{Panel, WrittenParts, left_room, pale};
use super::sheet::{EDGE, Sheet};
use super::sketch::{Pencil, Pose, Sketch, sides_of_supports, symbol_size, trail_colour};
use super::view::View;
use super::{ChartError, PAGE};

/// Most earlier poses drawn.
const GHOSTS: usize = 8;
/// Height of the legend \[pt\].
const LEGEND: f64 = 14.0;

/// A mechanism and where it has been.
#[derive(Clone, Debug, Default)]
pub struct MechanismChart {
    /// Title, with markup.
    pub title: String,
    /// Parts of the caption, with markup.
    pub caption: Vec<String>,
    /// The mechanism.
    pub sketch: Sketch,
    /// Poses: the last is drawn in full, up to eight before it as pale ghosts, oldest first.
    pub poses: Vec<Pose>,
    /// Paths of the sketch's points (x, y) \[m\], oldest place first; points that are not numbers break a
    /// path.
    pub trails: Vec<Vec<[f64; 2]>>,
    /// Names of the paths, with markup, for a legend where there are several.
    pub names: Vec<String>,
    /// The point of the paths from which on they are pale: beyond the horizon up to which they can be
    /// trusted.
    pub horizon: Option<usize>,
}

/// Draws the mechanism with gravity pointing down the page and equal scales.
///
/// # Errors
/// [`ChartError`] if the resolution is out of range or drawing fails.
pub fn mechanism(chart: &MechanismChart, px_per_pt: f64) -> Result<Picture, ChartError> {
    let ghosts = chart.poses.len().saturating_sub(GHOSTS + 1);
    let poses = &chart.poses[ghosts..];
    let has_legend = chart.trails.len() > 1 && chart.names.len() == chart.trails.len();
    let told = Sheet::new(PAGE, 0.5)?.heading(&chart.title, &chart.caption)?;
    let under = told + if has_legend { LEGEND } else { 0.0 };
    let view = View::around(&chart.sketch, poses, &chart.trails);
    let right = 20.0;
    let fitted = |left: f64| {
        let width = PAGE[0] - left - right;
        let height = (width * view.aspect()).clamp(200.0, 330.0);
        (width, height, view.clone().fitted(width, height))
    };
    // Wide labels of the upright axis push the panel to the right.
    let (_, height, first) = fitted(62.0);
    let left = (EDGE + left_room(&Sheet::new(PAGE, 0.5)?, &first.axes().1, height)).max(62.0);
    let (width, height, view) = fitted(left);

    let sheet = Sheet::new([PAGE[0], under + AIR + height + 44.0], px_per_pt)?;
    sheet.heading(&chart.title, &chart.caption)?;
    if has_legend {
        legend(&sheet, &chart.names, [EDGE, told + 0.8 * LEGEND])?;
    }
    let (x, y) = view.axes();
    let top = under + AIR;
    let panel = Panel::new(&sheet, [left, top, left + width, top + height], x, y).equal_steps();
    panel.frame(WrittenParts { x: true, y_name_at: panel.name_place() })?;

    let mut occupied = Occupied::default();
    let size = poses.last().map_or(1.0, |pose| symbol_size(pose, view.scale(width)));
    let shown = poses.last().map_or(&[][..], std::slice::from_ref);
    let sides = sides_of_supports(&chart.sketch, shown, &view);
    let pencil = Pencil { sheet: &sheet, panel: &panel, view, size, sides };
    if let Some((last, before)) = poses.split_last() {
        for (k, pose) in before.iter().enumerate() {
            pencil.ghost(pose, 1.0 - k as f64 / before.len() as f64)?;
        }
        // Over the ghosts, or they would erase the hatching.
        pencil.walls(&chart.sketch.walls, &mut occupied)?;
        pencil.rails(&last.sliders, &mut occupied)?;
        for (k, trail) in chart.trails.iter().enumerate() {
            let trusted = chart.horizon.map_or(trail.len(), |horizon| horizon.min(trail.len()));
            pencil.trail(&trail[trusted.saturating_sub(1)..], pale(trail_colour(k)), 160, &mut occupied)?;
            pencil.trail(&trail[..trusted], trail_colour(k), 160, &mut occupied)?;
        }
        pencil.pose(&chart.sketch, last, &mut occupied)?;
        pencil.compass(&mut occupied)?;
        pencil.scale_bar(&mut occupied)?;
        pencil.names(&chart.sketch, last, &mut occupied)?;
    } else {
        panel.empty("no data")?;
    }
    Ok(sheet.picture(&chart.title, &chart.caption))
}
