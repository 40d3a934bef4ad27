//! The page of a comparison: work-precision charts whose points tell their settings, and a table.

use crate::chart::unmarked;
use crate::dynamics::Mechanism;
use crate::html::Document;
use crate::report::compare::{self, CompareChart, has_letters, object, options, short, sorted};
use crate::run::Comparison;
use crate::scene::Scene;
use serde_json::{Value, json};

/// The page: every setting is a row, and a point of each chart that has figures of it.
/// `given` is the scene as the commands of the rows name it.
pub fn compared(scene: &Scene, mechanism: &Mechanism, comparison: &Comparison, given: &Value) -> Document {
    let told = object(scene, mechanism, comparison);
    let letters = has_letters(comparison);
    let scene_words = super::words::given_scene(given, &scene.name);
    let rows: Vec<Value> = sorted(comparison)
        .into_iter()
        .map(|(number, entry)| {
            let mut row = told["rows"][number].clone();
            row["series"] = json!(if letters { entry.name() } else { entry.method.to_string() });
            row["label"] = json!(short(entry, letters));
            row["command"] = json!(options(entry).map(|options| {
                format!("driftless run {scene_words} {options} --until {}", comparison.until)
            }));
            row["why"] = json!(row["stop"]["what"].as_str().or(row["refusal"]["reason"].as_str()));
            row
        })
        .collect();
    let charts: Vec<Value> = [
        (CompareChart::ErrorTime, "wall_s", "error"),
        (CompareChart::EnergyTime, "wall_s", "energy_drift"),
        (CompareChart::ErrorEvaluations, "evaluations", "error"),
    ]
    .into_iter()
    .map(|(kind, x, y)| {
        let chart = compare::chart_data(kind, scene, mechanism, comparison);
        let caption: Vec<String> = chart.caption.iter().map(|words| unmarked(words)).collect();
        json!({
            "title": unmarked(&chart.title),
            "caption": caption.join(", "),
            "x": x,
            "y": y,
            "x_name": if x == "wall_s" { "run time [s]" } else { "evaluations" },
            "y_name": unmarked(&chart.error_name),
            "floor": chart.floor,
            "lost": chart.lost,
        })
    })
    .collect();
    Document {
        title: format!("{}: methods compared", scene.name),
        data: json!({
            "kind": "compare",
            "scene": scene.name,
            "description": scene.description,
            "caption": format!("{} settings compared over {} s", rows.len(), comparison.until),
            "charts": charts,
            "rows": rows,
            "advice": told["recommendations"].as_array().map(|all| {
                all.iter().map(|advice| advice["sentence"].clone()).collect::<Vec<_>>()
            }),
            "text": compare::text(scene, mechanism, comparison),
        }),
        tables: Vec::new(),
    }
}
