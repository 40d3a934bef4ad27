//! What the record and the page say of a scene's outputs.

use super::page::{Page, figure};
use crate::dynamics::{Mechanism, Time};
use crate::run::{Extremes, Outcome};
use serde_json::{Map, Value, json};

/// An output that changes by less over its size does so by rounding.
const CONSTANT: f64 = 1e-12;
const CONSTANT_TOLD: &str = "constant";
const UNKNOWN: &str = "not known";
const LIMITS: &str = "what is not known: limits of forces or accelerations at singular positions on the way";

/// Which outputs have forces in them that are those of least norm among what rigid bodies leave open.
fn left_open(mechanism: &Mechanism, outcome: &Outcome) -> Vec<bool> {
    let last = &outcome.last;
    mechanism.open_outputs(Time::from(last.t), &last.phi, &last.omega)
}

/// A figure of an output.
pub(super) fn told(x: f64) -> String {
    match x {
        _ if x.is_nan() => UNKNOWN.into(),
        _ if x.is_infinite() => "unbounded".into(),
        _ => figure(x),
    }
}

/// What the record of a run says; nothing for a scene without outputs.
pub(super) fn object(mechanism: &Mechanism, outcome: &Outcome) -> Option<Value> {
    let outputs = mechanism.outputs.as_ref()?;
    let is_open = left_open(mechanism, outcome);
    let of = |(k, (name, unit)): (usize, (&str, &str))| {
        let mut told = json!({"unit": unit, "final": outcome.last.outputs.get(k)});
        if let Some(Extremes { min, max, mean, rms, .. }) = outcome.extremes.get(k) {
            told["min"] = json!({"value": min[0], "t": min[1]});
            told["max"] = json!({"value": max[0], "t": max[1]});
            told["mean"] = json!(mean);
            told["rms"] = json!(rms);
        }
        if is_open[k] {
            told["least_norm"] = json!(true);
        }
        (name.to_owned(), told)
    };
    Some(Value::Object(outputs.heads().enumerate().map(of).collect::<Map<String, Value>>()))
}

/// Says what is not known, where some cells are.
pub(super) fn note_unknown(page: &mut Page, rows: &[Vec<String>]) {
    if rows.iter().flatten().any(|cell| cell == UNKNOWN) {
        page.entry("", LIMITS);
    }
}

/// What the page of a run says.
pub(super) fn describe(page: &mut Page, mechanism: &Mechanism, outcome: &Outcome) {
    if outcome.extremes.is_empty() {
        return;
    }
    page.entry("outputs", "over the whole run, between its rows as well");
    let rows: Vec<Vec<String>> = (outcome.extremes.iter())
        .map(|Extremes { name, unit, min, max, mean, rms }| {
            let head = format!("{name} [{unit}]");
            let numbers = [min[0], min[1], max[0], max[1], *mean, *rms];
            let mut cells: Vec<String> = std::iter::once(head).chain(numbers.into_iter().map(told)).collect();
            // Of a constant the times of both extremes are those of rounding.
            let is_bounded = min[0].is_finite() && max[0].is_finite();
            if is_bounded
                && cells[1] == cells[3]
                && max[0] - min[0] <= CONSTANT * max[0].abs().max(min[0].abs())
            {
                (cells[2], cells[4]) = (CONSTANT_TOLD.into(), CONSTANT_TOLD.into());
            }
            cells
        })
        .collect();
    page.table(&["output", "least", "at t [s]", "largest", "at t [s]", "mean", "rms"], &rows);
    let follows = mechanism.outputs.iter().flat_map(|outputs| outputs.follows_equations());
    let is_unknown = |cells: &Vec<String>| cells.iter().any(|cell| cell == UNKNOWN);
    let is_limit = |follows: &bool| *follows && outcome.drift.singular.is_some();
    let limits: Vec<bool> = rows
        .iter()
        .zip(follows)
        .filter(|(cells, _)| is_unknown(cells))
        .map(|(_, follows)| is_limit(follows))
        .collect();
    if limits.contains(&true) {
        page.entry("", LIMITS);
    }
    if limits.contains(&false) {
        page.entry("", "what is not known: the formula has no value at some times");
    }
    if left_open(mechanism, outcome).contains(&true) {
        page.entry(
            "",
            "constraints are redundant: forces that rigid bodies leave open are those of least norm",
        );
    }
}
