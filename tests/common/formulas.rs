//! Random formulas: what comes of a text, and whether value, derivative, series and methods agree on it.

use super::random::Draw;
use driftless::arithmetic::{DoubleDouble, Dual, Scalar};
use driftless::run::{Limits, MethodId, Plan, Request, Run, Running};
use driftless::scene::formula::Formula;
use driftless::scene::parse_scene;
use driftless::{Mechanism, Sample};
use std::sync::Arc;

/// Names that a law may have, and values for them.
const NAMES: [(&str, f64); 5] =
    [("bar.phi", 0.7), ("bar.omega", -1.3), ("t", 0.4), ("bar.cos", 0.764_842), ("bar.sin", 0.644_217)];

/// A formula whose value and derivatives are of moderate size wherever its names are: of angles alone where it
/// is to be a potential, and without `corners` smooth.
pub fn expression(draw: &mut Draw, depth: usize, corners: bool, potential: bool) -> String {
    let number = 0.1 + (300.0 * draw.share()).round() / 100.0;
    if depth == 0 || draw.chance(15) {
        return match (draw.below(4), potential) {
            (0, _) => format!("{number:.2}"),
            (1, false) => format!("{number:.2}*t"),
            (2, false) => format!("{number:.2}*bar.omega"),
            (1, true) => format!("{number:.2}*bar.sin"),
            (2, true) => format!("{number:.2}*bar.cos"),
            _ => "bar.phi".to_owned(),
        };
    }
    let kind = draw.below(if corners { 15 } else { 12 });
    let a = expression(draw, depth - 1, corners, potential);
    let b = expression(draw, depth - 1, corners, potential);
    match kind {
        0 => format!("({a} + {b})"),
        1 => format!("({a} - {b})"),
        2 => format!("sin({a})*tanh({b})"),
        3 => format!("({a})/(2 + cos({b}))"),
        4 => format!("atan2({a}, 2 + sin({b}))"),
        5 => format!("exp(tanh({a}))"),
        6 => format!("log(1.5 + tanh({a}))"),
        7 => format!("sqrt(2 + sin({a}))"),
        8 => format!("(2 + cos({a}))^{number:.2}"),
        9 => format!("tanh({a})^3"),
        10 => format!("-tan(0.5*tanh({a}))"),
        11 => format!("sin({a})"),
        12 => format!("abs({a})"),
        13 => format!("min({a}, {b})"),
        _ => format!("max({a}, {b})"),
    }
}

/// Asserts that a formula has the same value in doubles and in double-double, and the derivatives that
/// differences in double-double show.
pub fn is_consistent(text: &str) {
    let formula = Formula::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"));
    let values: Vec<f64> = formula
        .names()
        .map(|name| NAMES.iter().find(|known| known.0 == name).expect("a known name").1)
        .collect();
    let mut conditions = Vec::new();
    // A condition may contain what another one chooses.
    let mut bits = vec![false; formula.conditions()];
    for _ in 0..=bits.len() {
        conditions.clear();
        formula.condition_values(&values, &bits, &mut conditions);
        bits = conditions.iter().map(|&value: &f64| value > 0.0).collect();
    }
    let value = formula.evaluate(&values, &bits);
    assert_eq!(value.to_bits(), formula.value(&values).to_bits(), "{text}");
    let exact: Vec<DoubleDouble> = values.iter().map(|&value| DoubleDouble::of(value)).collect();
    let fine = formula.evaluate(&exact, &bits);
    assert!((fine.hi - value).abs() < 1e-10 * (1.0 + value.abs()), "{text}: {value} and {}", fine.hi);
    for k in 0..values.len() {
        let duals: Vec<Dual<1>> = (values.iter().enumerate())
            .map(|(j, &value)| if j == k { Dual::unknown(value, 0) } else { Dual::constant(value) })
            .collect();
        let slope = formula.evaluate(&duals, &bits).slope[0];
        let shifted = |by: f64| {
            let mut shifted = exact.clone();
            shifted[k] += DoubleDouble::of(by);
            formula.evaluate(&shifted, &bits)
        };
        let h = 1e-8;
        let difference = (shifted(h) - shifted(-h)).hi / (2.0 * h);
        assert!((slope - difference).abs() < 1e-7 * (1.0 + slope.abs()), "{text}: {slope} and {difference}");
    }
}

/// The mechanisms that laws act in, and what they act by.
const MECHANISMS: usize = 3;
const LAWS: usize = 3;

/// A pendulum, on the ground, on another one or on a cart on a rail, under a law by this formula: a potential,
/// or a torque, a force at a point or the tension of a spring.
fn acted_on(text: &str, potential: bool, kind: usize) -> String {
    let law = match (potential, kind / MECHANISMS) {
        (true, _) => format!(r#""potentials": [{{"name": "V", "energy": "1*({text})"}}]"#),
        (_, 0) => format!(r#""torques": [{{"name": "T", "body": "bar", "torque": "1*({text})"}}]"#),
        (_, 1) => format!(
            r#""forces": [{{"name": "F", "body": "bar", "point": [0.4, 0.1], "force": ["0.7*({text})", "-1*({text})"]}}]"#
        ),
        _ => format!(
            r#""springs": [{{"name": "S", "between": [{{"body": "ground", "point": [0.2, -1.1]}}, {{"body": "bar", "point": [0.5, 0]}}],
            "tension": "1*({text}) + 3*rate + 5*(length - 0.6)"}}]"#
        ),
    };
    let bar = r#"{"name": "bar", "mass": 0.5, "centre": [0.3, 0], "inertia": 0.2}"#;
    let hinge = |name: &str, below: &str, x: f64, above: &str| {
        format!(
            r#"{{"name": "{name}", "between": [{{"body": "{below}", "point": [{x}, 0]}}, {{"body": "{above}", "point": [0, 0]}}]}}"#
        )
    };
    let start = r#""bar": {"phi": 0.7, "omega": -1.3}"#;
    let (bars, hinges, more, starts) = match kind % MECHANISMS {
        0 => (bar.to_owned(), hinge("A", "ground", 0.0, "bar"), "", start.to_owned()),
        1 => (
            format!(r#"{{"name": "first", "mass": 1, "centre": [0.2, 0.1], "inertia": 0.1}}, {bar}"#),
            [hinge("A", "ground", 0.0, "first"), hinge("B", "first", 0.4, "bar")].join(", "),
            "",
            format!(r#""first": {{"phi": -1.1, "omega": 0.4}}, {start}"#),
        ),
        _ => (
            format!(r#"{{"name": "cart", "mass": 1, "centre": [0, 0], "inertia": 0.1}}, {bar}"#),
            hinge("B", "cart", 0.0, "bar"),
            r#""sliders": [{"name": "R", "point": {"body": "cart", "point": [0, 0]}, "angle": "locked",
                "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0.2]}}],"#,
            format!(r#""cart": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0.5, 0.1]}}, {start}"#),
        ),
    };
    format!(
        r#"{{"name": "r", "gravity": [0, -9.81], "bars": [{bars}], "hinges": [{hinges}], {more}
        "start": {{{starts}}}, "until": 0.4, "every": 0.4, {law}}}"#
    )
}

/// Where it is after a while; `None` where a method stops.
fn moved(text: &str, method: MethodId, potential: bool, kind: usize) -> Option<[f64; 3]> {
    let scene = acted_on(text, potential, kind);
    let scene = parse_scene(&scene, "random", &[]).unwrap_or_else(|error| panic!("{error}"));
    let mechanism = Arc::new(Mechanism::new(&scene).unwrap_or_else(|error| panic!("{text}: {error}")));
    let request = Request {
        method: Some(method),
        rtol: Some(1e-11),
        max_evaluations: Some(20_000),
        ..Request::default()
    };
    let plan = Plan::new(&scene, &mechanism, &request).ok()?;
    let start = mechanism.start(&scene);
    let mut running = Running::new(Run::new(mechanism, plan, Limits::default(), &start).expect("a run"));
    running.go(&mut |_: &Sample| Ok(()), &mut || false).expect("samples");
    let outcome = running.finish();
    let bar = scene.bars.iter().position(|bar| bar.name == "bar")?;
    outcome.stop.is_none().then(|| [outcome.last.phi[bar], outcome.last.omega[bar], outcome.drift.energy.max])
}

/// Asserts that the series, Dormand–Prince, which takes values alone, and Radau, which takes the Jacobian, move a
/// mechanism alike under a law by a formula, with its work accounted for; false where one of them stops.
pub fn moves_alike(text: &str, potential: bool, draw: &mut Draw) -> bool {
    let kind = draw.below(MECHANISMS * LAWS);
    let [Some(a), Some(b), Some(c)] = [MethodId::Taylor, MethodId::Dp8, MethodId::Radau(5)]
        .map(|method| moved(text, method, potential, kind))
    else {
        return false;
    };
    for other in [b, c] {
        let apart = (a[0] - other[0]).abs().max((a[1] - other[1]).abs());
        assert!(apart < 1e-7 * (1.0 + a[1].abs()), "{text} ({kind}): {a:?} and {other:?}");
    }
    // Of the energy at the start, which a law that feeds the motion leaves far below.
    let drift = a[2].max(b[2]).max(c[2]);
    assert!(drift < 1e-7 * (1.0 + a[1] * a[1]), "{text} ({kind}): drift {drift:e}");
    true
}
