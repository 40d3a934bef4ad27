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

/// Where a rotor is after a while under a torque by this formula; `None` where a method stops.
fn moved(text: &str, method: MethodId, potential: bool) -> Option<[f64; 3]> {
    let law = if potential {
        format!(r#""potentials": [{{"name": "V", "energy": "1*({text})"}}]"#)
    } else {
        format!(r#""torques": [{{"name": "T", "body": "bar", "torque": "1*({text})"}}]"#)
    };
    let scene = format!(
        r#"{{"name": "r", "gravity": [0, -9.81], "bars": [{{"name": "bar", "mass": 0.5, "centre": [0.3, 0], "inertia": 0.2}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}}],
        "start": {{"bar": {{"phi": 0.7, "omega": -1.3}}}}, "until": 0.4, "every": 0.4, {law}}}"#
    );
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
    outcome.stop.is_none().then(|| [outcome.last.phi[0], outcome.last.omega[0], outcome.drift.energy.max])
}

/// Asserts that the series and Dormand–Prince move a rotor alike under a torque by a formula, with its work
/// accounted for.
pub fn moves_alike(text: &str, potential: bool) -> bool {
    let (Some(a), Some(b)) =
        (moved(text, MethodId::Taylor, potential), moved(text, MethodId::Dp8, potential))
    else {
        return false;
    };
    let apart = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
    assert!(apart < 1e-7 * (1.0 + a[1].abs()), "{text}: {a:?} and {b:?}");
    // Of the energy at the start, which a law that feeds the motion leaves far below.
    assert!(a[2].max(b[2]) < 1e-7 * (1.0 + a[1] * a[1]), "{text}: drift {:e} and {:e}", a[2], b[2]);
    true
}
