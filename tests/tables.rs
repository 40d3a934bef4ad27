//! Tables of many points in laws, against the polynomial that they are points of.

use crate::formulas::{adaptive, run, scene};
use driftless::run::{MethodId, Outcome};
use driftless::scene::parse_scene;
use std::fmt::Write as _;

/// A rotor whose torque is level at -1 and 1, 3 x - x³ = what a spline through any of its points is.
fn rotor(torque: &str, tables: &str) -> String {
    format!(
        r#"{{"name": "rotor", "gravity": [0, 0], {tables}
        "bars": [{{"name": "bar", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}}],
        "torques": [{{"name": "T", "body": "bar", "torque": "{torque}"}}],
        "start": {{"bar": {{"phi": 0.6, "omega": 0}}}}, "until": 3, "every": 0.5}}"#
    )
}

/// So many points of 3 x - x³ from -1 to 1, not evenly apart.
fn table(count: usize) -> String {
    let mut text = String::from(r#""tables": {"f": ["#);
    for k in 0..count {
        let x = -1.0 + 2.0 * k as f64 / (count - 1) as f64;
        let x = x + 0.2 * (1.0 - x * x);
        let comma = if k == 0 { "" } else { ", " };
        write!(text, "{comma}[{x:?}, {:?}]", x * (3.0 - x * x)).expect("room");
    }
    text + "]},"
}

fn end(text: &str, method: MethodId) -> Outcome {
    let outcome = run(&scene(text), &adaptive(method, 1e-11));
    assert!(outcome.stop.is_none(), "{method:?}: {:?}", outcome.stop);
    outcome
}

/// Back and forth over the knots: every switch there and back is the neighbouring piece.
#[test]
fn a_table_of_an_angle_is_the_cubic_that_its_points_are_of() {
    let plain = rotor("-2*(3*bar.phi - bar.phi^3)", "");
    for count in [2, 3, 17, 300] {
        let tabled = rotor("-2*f(bar.phi)", &table(count));
        for method in [MethodId::Dp8, MethodId::Taylor, MethodId::Radau(5)] {
            let (found, known) = (end(&tabled, method), end(&plain, method));
            let off = |a: &[f64], b: &[f64]| (a[0] - b[0]).abs();
            let apart = off(&found.last.phi, &known.last.phi).max(off(&found.last.omega, &known.last.omega));
            assert!(apart < 2e-8, "{count} points, {method:?}: {apart:e}");
        }
    }
}

/// A step ends at every knot that is passed and at no other: what has not been reached costs nothing.
#[test]
fn points_that_are_not_passed_cost_no_steps() {
    let far = |count: usize| {
        let mut text = String::from(r#""tables": {"f": [[-2, 1], [2, 1]"#);
        (0..count).for_each(|k| write!(text, ", [{}, 1]", 3 + k).expect("room"));
        rotor("1*(f(bar.phi) - 1 - bar.phi)", &(text + "]},"))
    };
    let [few, many] = [1, 100_000].map(|count| end(&far(count), MethodId::Dp8));
    assert_eq!(few.last.phi[0].to_bits(), many.last.phi[0].to_bits());
    assert_eq!(few.statistics.steps, many.statistics.steps);
    let refusal = parse_scene(&far(1_000_000), "test", &[]).expect_err("too many").to_string();
    assert!(refusal.contains("1000002 points") && refusal.contains("2 to 1000000"), "{refusal}");
    assert!(refusal.contains("thin it out"), "{refusal}");
}

/// A table needs two points, in the scene or in a file: no hint to have fewer of them.
#[test]
fn too_few_points_are_to_become_more() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("none.csv"), "").expect("a file");
    let file = folder.path().join("scene.json").display().to_string();
    for (points, says) in [
        ("[]", "tables.f has 0 points:"),
        ("[[1, 2]]", "tables.f has 1 point:"),
        ("\"none.csv\"", "tables.f has 0 points in "),
    ] {
        let text = rotor("1*f(bar.phi)", &format!("\"tables\": {{\"f\": {points}}},"));
        let refusal = parse_scene(&text, &file, &[]).expect_err("too few").to_string();
        assert!(refusal.contains(says) && refusal.contains("add points"), "{refusal}");
        assert!(!refusal.contains("thin it out"), "{refusal}");
    }
}
