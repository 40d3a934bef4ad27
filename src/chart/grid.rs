//! Panels on a page: one, stacked, or side by side.

use super::ChartError;
use super::axis::Axis;
use super::panel::{LEADER, Panel, WrittenParts, left_room, right_room};
use super::sheet::{EDGE, NOTE, Sheet};

/// Below the lowest panel: tick labels and the name of the axis \[pt\].
const BOTTOM: f64 = 44.0;
/// Between the caption and the panels \[pt\].
pub(crate) const AIR: f64 = 14.0;
/// Between two stacked panels \[pt\].
const BETWEEN: f64 = 16.0;
/// Usual distance of a panel from the left edge \[pt\].
const LEFT: f64 = 58.0;

/// Labels that every panel has room for.
const MANY: usize = 4;

/// What stands for labels there is no room for.
pub(crate) fn more_labels(count: usize) -> String {
    format!("and {count} more")
}

/// Room for labels at the ends of lines, at most a third of the page \[pt\].
pub(crate) fn label_room<'a>(sheet: &Sheet, labels: impl Iterator<Item = &'a str>, markers: bool) -> f64 {
    let (mut count, mut widest) = (0, 0.0_f64);
    for label in labels {
        count += 1;
        widest = widest.max(sheet.width(label, NOTE, false));
    }
    // Of many the last line may say how many more there are.
    if count > MANY {
        widest = widest.max(sheet.width(&more_labels(count), NOTE, false));
    }
    if widest == 0.0 {
        20.0
    } else {
        (widest + LEADER + if markers { 8.0 } else { 0.0 } + 8.0).clamp(20.0, sheet.size[0] / 3.0)
    }
}

/// Panels above each other with one time axis, frames drawn; `under` is the lowest line of the heading,
/// `right` the room beside them.
pub(crate) fn stacked<'a>(
    sheet: &'a Sheet,
    under: f64,
    x: &Axis,
    ys: Vec<Axis>,
    right: f64,
) -> Result<Vec<Panel<'a>>, ChartError> {
    let (top, bottom) = (under + AIR, sheet.size[1] - BOTTOM);
    let count = ys.len().max(1) as f64;
    let height = (bottom - top - (count - 1.0) * BETWEEN) / count;
    let left = ys.iter().map(|y| left_room(sheet, y, height) + EDGE).fold(LEFT, f64::max);
    let right = right.max(right_room(sheet, x, sheet.size[0] - left - right) + 6.0);
    let panels: Vec<Panel> = ys
        .into_iter()
        .enumerate()
        .map(|(k, y)| {
            let top = top + k as f64 * (height + BETWEEN);
            Panel::new(sheet, [left, top, sheet.size[0] - right, top + height], x.clone(), y)
        })
        .collect();
    let y_name_at = panels.iter().map(Panel::name_place).fold(f64::INFINITY, f64::min);
    for (k, panel) in panels.iter().enumerate() {
        panel.frame(WrittenParts { x: k + 1 == panels.len(), y_name_at })?;
    }
    Ok(panels)
}

/// Rows of panels side by side, row by row from above, each panel with its own axes, frames drawn.
pub(crate) fn rows<'a>(
    sheet: &'a Sheet,
    under: f64,
    rows: Vec<Vec<(Axis, Axis)>>,
    right: f64,
) -> Result<Vec<Panel<'a>>, ChartError> {
    let (top, bottom) = (under + AIR, sheet.size[1]);
    let pitch = (bottom - top) / rows.len().max(1) as f64;
    let height = pitch - BOTTOM;
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let left_of = |column: usize| {
        let rooms = rows.iter().filter_map(|row| row.get(column)).map(|(_, y)| left_room(sheet, y, height));
        rooms.fold(0.0, f64::max)
    };
    let lefts: Vec<f64> = (0..columns).map(left_of).collect();
    let between = 16.0;
    let width =
        (sheet.size[0] - EDGE - right - lefts.iter().sum::<f64>() - (columns.max(1) as f64 - 1.0) * between)
            / columns.max(1) as f64;
    let mut panels = Vec::new();
    for (k, row) in rows.into_iter().enumerate() {
        let top = top + k as f64 * pitch;
        let mut left = EDGE;
        for ((x, y), room) in row.into_iter().zip(&lefts) {
            left += room;
            let panel = Panel::new(sheet, [left, top, left + width.max(20.0), top + height], x, y);
            panel.frame(WrittenParts { x: true, y_name_at: panel.name_place() })?;
            left += width + between;
            panels.push(panel);
        }
    }
    Ok(panels)
}
