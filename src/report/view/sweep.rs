//! The page of a sweep: its map or profile, and the motions of some of its points.

use super::columns::Role;
use super::{ViewError, Viewed};
use crate::html::{Document, PackedColumn};
use crate::report::sweep::{SweepChart, text};
use crate::run::{Sweep, Totals};
use serde_json::{Value, json};

/// Most points of a page.
const MOST: u64 = 1 << 20;
/// Motions along each axis of a map, and along a profile; all where there are no more.
const ALONG: [u64; 2] = [6, 24];
/// Rows of a motion: as far apart as this \[s\], but so many at least and at most.
const EVERY: f64 = 0.03;
const ROWS: [f64; 2] = [600.0, 1200.0];
/// Steps in the range of what is shown, and of its decimal logarithms.
const STEPS: f64 = 65536.0;

/// Whether a page can hold the points of a sweep.
///
/// # Errors
/// It has too many.
pub fn holds(sweep: &Sweep) -> Result<(), ViewError> {
    let count = sweep.grid().count();
    if count > MOST { Err(ViewError::Points { count, most: MOST }) } else { Ok(()) }
}

/// The page: a click on a point shows its motion, or that of the nearest of which it is kept.
pub fn swept(sweep: &Sweep, curve: &SweepChart, totals: &Totals, given: &Value) -> Document {
    let labels = curve.labels(sweep, totals);
    let mut axes: Vec<Value> = (sweep.grid().axes().iter().zip(sweep.variables()))
        .map(|(axis, variable)| {
            json!({"name": variable.path, "unit": variable.unit, "from": axis.from, "to": axis.to,
                "count": axis.count})
        })
        .collect();
    let mut colours = Value::Null;
    if let Some(map) = curve.map(&labels) {
        let ([x, y, bar], ends) = map.scales();
        for (axis, scale) in axes.iter_mut().zip([x, y]) {
            axis["ticks"] = json!(scale.ticks);
        }
        let ends = ends.map(|end| logarithm(end, labels.is_log));
        // Where no point has a number colours mean nothing.
        let has_numbers = curve.values().iter().any(|value| value.is_finite());
        colours = if has_numbers {
            json!({"name": bar.name, "ticks": bar.ticks, "from": ends[0], "to": ends[1]})
        } else {
            Value::Null
        };
    }
    let rows = (sweep.plan().until / EVERY).clamp(ROWS[0], ROWS[1]);
    let mut cells = Vec::new();
    let mut runs = Vec::new();
    for index in chosen(&counts(sweep), curve.values()) {
        // A point that is no scene has no motion; the map says so.
        let Ok((scene, mechanism, plan)) = sweep.run_of(index, rows) else { continue };
        let label = format!("point {}", index + 1);
        if let Ok(run) = Viewed::integrated(&label, scene, mechanism, plan, is_kept, None) {
            cells.push(index);
            runs.push(run);
        }
    }
    let mut tables: Vec<Vec<PackedColumn>> = runs.iter().map(Viewed::table).collect();
    let values: Vec<f64> = curve.values().iter().map(|&value| logarithm(value, labels.is_log)).collect();
    tables.push(vec![
        column(&labels.value, values, labels.is_log),
        column("failed", flags(curve.failed().iter().copied()), false),
        column("zero", flags(curve.values().iter().map(|&value| labels.is_log && value == 0.0)), false),
    ]);
    let told = |run: &Viewed| {
        let mut told = run.data();
        // Their records would be most of the page.
        told["record"] = Value::Null;
        told
    };
    let caption: Vec<_> = labels.caption.iter().map(|words| crate::chart::unmarked(words)).collect();
    Document {
        title: format!("{}: {}", sweep.scene().name, crate::chart::unmarked(&labels.title)),
        data: json!({
            "kind": "sweep",
            "scene": sweep.scene().name,
            "description": sweep.scene().description,
            "title": crate::chart::unmarked(&labels.title),
            "caption": caption.join(" · "),
            "axes": axes,
            "colours": colours,
            "value": crate::chart::unmarked(&labels.value),
            "log": labels.is_log,
            "high_is_dark": labels.is_flip,
            "never": labels.never,
            "cells": cells,
            "runs": runs.iter().map(told).collect::<Vec<_>>(),
            "command": super::words::command_of_points(sweep, given),
            "text": text(sweep, totals),
        }),
        tables,
    }
}

/// What is kept of a motion: what moves, and how well it is known.
fn is_kept(role: Role) -> bool {
    matches!(role, Role::Time | Role::Angle | Role::Position | Role::Energy)
}

fn counts(sweep: &Sweep) -> Vec<u64> {
    sweep.grid().axes().iter().map(|axis| axis.count).collect()
}

/// Points whose motions are kept: evenly spaced ones along each axis with both ends, and those with the least
/// and the largest value.
fn chosen(counts: &[u64], values: &[f64]) -> Vec<u64> {
    let along = if counts.len() == 1 { ALONG[1] } else { ALONG[0] };
    let places = |count: u64| -> Vec<u64> {
        let kept = along.min(count);
        (0..kept)
            .map(|k| if kept == 1 { 0 } else { (k * (count - 1) + (kept - 1) / 2) / (kept - 1) })
            .collect()
    };
    let mut points = vec![0];
    for &count in counts {
        points = points
            .iter()
            .flat_map(|&point| places(count).into_iter().map(move |k| point * count + k))
            .collect();
    }
    let known = || values.iter().enumerate().filter(|(_, value)| value.is_finite());
    let least = known().min_by(|a, b| a.1.total_cmp(b.1));
    let largest = known().max_by(|a, b| a.1.total_cmp(b.1));
    points.extend([least, largest].into_iter().flatten().map(|(index, _)| index as u64));
    points.sort_unstable();
    points.dedup();
    points
}

/// 1 where something holds, else 0.
fn flags(values: impl Iterator<Item = bool>) -> Vec<f64> {
    values.map(|value| f64::from(u8::from(value))).collect()
}

fn logarithm(value: f64, is_log: bool) -> f64 {
    if is_log { libm::log10(value.abs()) } else { value }
}

fn column(name: &str, values: Vec<f64>, is_logarithm: bool) -> PackedColumn {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let [low, high] = finite().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
    PackedColumn {
        name: name.to_owned(),
        quantum: (high - low).max(0.0) / STEPS,
        values,
        is_logarithm,
        ..PackedColumn::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motions_are_kept_of_corners_and_extremes_and_of_all_points_where_these_are_few() {
        assert_eq!(chosen(&[3, 2], &[1.0; 6]), [0, 1, 2, 3, 4, 5]);
        assert_eq!(chosen(&[1], &[f64::NAN]), [0]);
        let mut values = vec![f64::NAN; 60 * 40];
        values[1234] = 0.5;
        values[77] = 9.0;
        let points = chosen(&[60, 40], &values);
        assert_eq!(points.len(), 38);
        for point in [0, 39, 59 * 40, 60 * 40 - 1, 77, 1234] {
            assert!(points.contains(&point), "{point}");
        }
        assert_eq!(chosen(&[1000], &vec![0.0; 1000]).len(), 24);
    }
}
