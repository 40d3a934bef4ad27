//! What joints carry of gears, cams and walls whose laws speak of points: against closed forms, and against the same
//! mechanism with a rod, or a straight wall, in their place.

use super::formulas::{adaptive, run, scene};
use driftless::run::{MethodId, Outcome, Request};
use driftless::scene::Scene;

const G: f64 = 9.81;

fn methods() -> [Request; 4] {
    [
        adaptive(MethodId::Taylor, 1e-12),
        adaptive(MethodId::Dp8, 1e-12),
        adaptive(MethodId::Dp5, 1e-11),
        adaptive(MethodId::Radau(5), 1e-12),
    ]
}

fn near(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() < 1e-7 * (1.0 + expected.abs()), "{what}: {found} and not {expected}");
}

fn finished(scene: &Scene, request: &Request) -> Outcome {
    let outcome = run(scene, request);
    assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
    outcome
}

/// A crank on the ground, and a cart on a rail beside it that `coupling` ties to the crank's tip; the cart's start.
fn crank(coupling: &str, friction: &str, outputs: &str, cart: &str) -> Scene {
    scene(&format!(
        r#"{{"name": "crank", "gravity": [0, -{G}],
        "bars": [{{"name": "crank", "mass": 2, "length": 1, "centre": [0.4, 0.1], "inertia": 0.3}},
            {{"name": "cart", "mass": 1.5, "centre": [0, 0], "inertia": 0.1, "length": 0.1}}],
        "points": [{{"name": "tip", "body": "crank", "point": [1, 0]}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "crank", "point": [0, 0]}}]{friction}}}],
        "sliders": [{{"name": "rail", "point": {{"body": "cart", "point": [0, 0]}},
            "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}, "angle": "locked"}}],
        {coupling}, "outputs": [{outputs}],
        "start": {{"crank": {{"phi": 0.7, "omega": 3}}, "cart": {{"phi": 0{cart}}}}}, "until": 1.3, "every": 0.01}}"#
    ))
}

#[test]
fn a_hinge_carries_what_a_gear_pushes_its_bar_with() {
    // The cart is at half the height of the tip: a force S on it is one of -S/2 on the tip.
    let coupled = r#""motors": [{"name": "gear", "slider": "rail", "law": "0.5*tip.y"}]"#;
    let outputs = r#""A.fx", "A.fy", "gear.force", "crank.alpha""#;
    for request in methods() {
        let outcome = finished(&crank(coupled, "", outputs, ""), &request);
        let (phi, omega) = (outcome.last.phi[0], outcome.last.omega[0]);
        let [fx, fy, force, alpha] = [0, 1, 2, 3].map(|number| outcome.last.outputs[number]);
        // About A, and along the rail: alpha and S alone.
        let (s, c) = phi.sin_cos();
        let (inertia, [x, y]) = (0.3 + 2.0 * (0.16 + 0.01), [0.4 * c - 0.1 * s, 0.4 * s + 0.1 * c]);
        let expected = (-2.0 * G * x + 1.5 * 0.25 * c * s * omega * omega) / (inertia + 1.5 * 0.25 * c * c);
        let push = 1.5 * 0.5 * (c * expected - s * omega * omega);
        near(alpha, expected, "acceleration");
        near(force, push, "force of the gear");
        let centre = [-y * expected - x * omega * omega, x * expected - y * omega * omega];
        near(fx, 2.0 * centre[0], "x of the hinge");
        near(fy, 2.0 * (centre[1] + G) + 0.5 * push, "y of the hinge");
    }
}

#[test]
fn a_formula_for_a_rod_loads_the_hinge_as_the_rod() {
    // From the tip to the cart: 2.5 m.
    let rod = r#""springs": [{"name": "rod", "between": [{"body": "crank", "point": [1, 0]}, {"body": "cart", "point": [0, 0]}],
        "stiffness": 1e9, "free_length": 2.5, "model": "rigid"}]"#;
    let law = r#""motors": [{"name": "rod", "slider": "rail", "law": "tip.x + sqrt(6.25 - tip.y^2)"}]"#;
    let (s, c) = 0.7_f64.sin_cos();
    let along = (6.25 - s * s).sqrt();
    let cart =
        format!(r#", "origin": [{:?}, 0], "velocity": [{:?}, 0]"#, c + along, -3.0 * s * (1.0 + c / along));
    for friction in ["", r#", "friction": {"kinetic": 0.2, "radius": 0.1}"#] {
        let outputs =
            if friction.is_empty() { r#""A.fx", "A.fy""# } else { r#""A.fx", "A.fy", "A.friction""# };
        let mut least = f64::INFINITY;
        for request in methods() {
            let [one, other] =
                [rod, law].map(|how| finished(&crank(how, friction, outputs, &cart), &request));
            near(one.last.phi[0], other.last.phi[0], "angle");
            near(one.last.omega[0], other.last.omega[0], "rate");
            near(one.last.friction, other.last.friction, "loss");
            assert_eq!(one.frictions.len(), other.frictions.len());
            for (one, other) in one.last.outputs.iter().zip(&other.last.outputs) {
                near(*one, *other, "force");
                least = least.min(one.abs());
            }
        }
        assert!(least > 0.01, "{least}");
    }
}

/// Two bars in a chain whose end drags along a slope of 3 : 4.
pub fn on_a_slope(wall: &str, friction: &str, outputs: &str) -> String {
    format!(
        r#"{{"name": "slope", "gravity": [0, -{G}],
        "bars": [{{"name": "upper", "mass": 2, "length": 1, "centre": [0.5, 0], "inertia": 0.2}},
            {{"name": "lower", "mass": 1, "length": 1, "centre": [0.4, 0.05], "inertia": 0.1}}],
        "points": [{{"name": "end", "body": "lower", "point": [1, 0]}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 1.2]}}, {{"body": "upper", "point": [0, 0]}}]{friction}}},
            {{"name": "B", "between": [{{"body": "upper", "point": [1, 0]}}, {{"body": "lower", "point": [0, 0]}}]{friction}}}],
        "walls": [{{"name": "slope", "body": "lower", "point": [1, 0], "restitution": 0, {wall}}}], "outputs": [{outputs}],
        "start": {{"upper": {{"phi": -0.4, "omega": 0}}, "lower": {{"phi": -1.0, "omega": 0}}}}, "until": 0.3, "every": 0.01}}"#
    )
}

/// The slope as a line, and as a curve over another line.
pub const SLOPES: [&str; 2] = [
    r#""line": {"through": [0, -1.2], "normal": [-0.6, 0.8]}"#,
    r#""line": {"through": [0, -1.2], "normal": [0, 1]}, "law": "0.75*end.x""#,
];

#[test]
fn a_slope_written_as_a_curve_loads_hinges_as_the_slope() {
    for friction in ["", r#", "friction": {"kinetic": 0.3, "radius": 0.1}"#] {
        let outputs = r#""A.fx", "A.fy", "B.fx", "B.fy""#;
        for request in methods() {
            let [one, other] =
                SLOPES.map(|wall| finished(&scene(&on_a_slope(wall, friction, outputs)), &request));
            assert!(one.holds.last().is_some_and(|held| held.until.is_none()), "{:?}", one.holds);
            near(one.last.phi[0], other.last.phi[0], "angle");
            near(one.last.friction, other.last.friction, "loss");
            for (one, other) in one.last.outputs.iter().zip(&other.last.outputs) {
                near(*one, *other, "force");
            }
        }
    }
}
