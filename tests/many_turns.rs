//! Events, branches and extremes of bodies that turn often within one step, against closed forms.

use crate::common::run;
use driftless::run::{MethodId, Outcome, Request};
use driftless::scene::{Scene, parse_scene};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Start of the wheel \[rad\].
const START: f64 = -1.0;

/// A wheel that turns freely about its centre, and a point at 1 m from that.
fn wheel(rate: f64, until: f64, more: &str) -> Scene {
    let text = format!(
        r#"{{"name": "wheel", "gravity": [0, 0], "until": {until:?}, "every": {until:?},
        "bars": [{{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.125, "length": 1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
        "points": [{{"name": "P", "body": "b", "point": [1, 0]}}],
        "start": {{"b": {{"phi": {START:?}, "omega": {rate:?}}}}}, {more}}}"#
    );
    parse_scene(&text, "wheel", &[]).unwrap_or_else(|error| panic!("{error}"))
}

fn requests() -> Vec<Request> {
    let by = |method| Request { method: Some(method), ..Request::default() };
    vec![
        Request::default(),
        by(MethodId::Taylor),
        by(MethodId::Dp8),
        by(MethodId::Radau(5)),
        Request { extended: true, ..Request::default() },
    ]
}

fn through(scene: &Scene, request: &Request) -> Outcome {
    let outcome = run(scene, request);
    assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
    outcome
}

#[test]
fn an_event_of_every_turn_is_found_however_many_a_step_has() {
    let event = |name: &str, direction: &str| {
        format!(r#"{{"name": "{name}", "when": "P.y - 0.25", "direction": "{direction}"}}"#)
    };
    let events = format!(r#""events": [{}, {}]"#, event("up", "rising"), event("down", "falling"));
    for (rate, until) in [(150.0, 8.0), (-1000.0, 2.0), (3e4, 0.2)] {
        let scene = wheel(rate, until, &events);
        // The first angles at which it passes in the sense of the turning.
        let (rises, falls) = (0.25_f64.asin(), PI - 0.25_f64.asin());
        let first = |angle: f64| {
            let way = if rate > 0.0 { angle - START } else { START - angle };
            way.rem_euclid(TAU) / rate.abs()
        };
        let [up, down] = if rate > 0.0 { [rises, falls] } else { [falls, rises] }.map(first);
        for request in requests() {
            let outcome = through(&scene, &request);
            for (name, first) in [("up", up), ("down", down)] {
                let found = outcome.events.iter().filter(|event| event.name == name);
                let times: Vec<f64> = found.map(|event| event.t).collect();
                let count = 1 + ((until - first) * rate.abs() / TAU) as usize;
                assert_eq!(times.len(), count, "{name} at {rate} rad/s by {:?}", request.method);
                for (k, t) in times.iter().enumerate() {
                    let expected = first + k as f64 * TAU / rate.abs();
                    assert!(
                        (t - expected).abs() < 1e-13 * until + 1e-12 / rate.abs(),
                        "{name} at {rate} rad/s by {:?}: {t:?} instead of {expected:?}",
                        request.method
                    );
                }
            }
        }
    }
}

#[test]
fn an_event_that_stops_the_run_is_the_first_one() {
    let events =
        r#""events": [{"name": "e", "when": "P.y - 0.25", "direction": "rising", "action": "stop"}]"#;
    for rate in [1e3, 1e5] {
        for request in requests() {
            let outcome = through(&wheel(rate, 8.0, events), &request);
            let t = (0.25_f64.asin() - START) / rate;
            assert_eq!((outcome.ended_by.as_deref(), outcome.event_count), (Some("e"), 1));
            assert!((outcome.last.t - t).abs() < 1e-14, "{:?}: {}", request.method, outcome.last.t);
        }
    }
}

/// A torque drives it while its sine is above 0.25, and else brakes it: what the sine was below more than
/// above in radians is half of what the square of the rate has lost, for 0.125 N·m on 0.125 kg m².
#[test]
fn a_torque_with_branches_in_every_turn_does_its_work() {
    let torques = r#""torques": [{"name": "q", "body": "b", "torque": "if(b.sin > 0.25, 1, -1)*0.125"}]"#;
    let (rate, until) = (3e3_f64, 0.2);
    let edge = 0.25_f64.asin();
    // The way up to an angle from 0 on with the sine above 0.25.
    let above = |angle: f64| {
        let (turns, rest) = (angle.div_euclid(TAU), angle.rem_euclid(TAU));
        turns * (PI - 2.0 * edge) + (rest - edge).clamp(0.0, PI - 2.0 * edge)
    };
    for method in [MethodId::Taylor, MethodId::Dp8] {
        let request = Request { method: Some(method), ..Request::default() };
        let outcome = through(&wheel(rate, until, torques), &request);
        let (phi, omega) = (outcome.last.phi[0], outcome.last.omega[0]);
        let ahead = above(phi) - above(START);
        let gained = 2.0 * (2.0 * ahead - (phi - START));
        let expected = (rate * rate + gained).sqrt();
        assert!((omega - expected).abs() < 1e-9, "{method}: {omega:?} instead of {expected:?}");
        assert!((phi - START - rate * until).abs() < 1.0, "{method}: {phi}");
    }
}

#[test]
fn extremes_and_means_of_every_turn_count() {
    let (rate, turns) = (1e3, 1000.0);
    let until = turns * TAU / rate;
    let middle = 0.4 * until;
    let outputs = format!(
        r#""outputs": {{"swell": "P.y*(1 - (t - {middle:?})^2/20)", "size": "abs(P.y)", "part": "max(P.y, 0.25)"}}"#
    );
    // At the crest nearest to the middle, but for the square of (t - middle)/10 over the rate.
    let crest = ((middle * rate + START - FRAC_PI_2) / TAU).round() * TAU + FRAC_PI_2 - START;
    let most = 1.0 - (crest / rate - middle).powi(2) / 20.0;
    let edge = 0.25_f64.asin();
    let part = (2.0 * edge.cos() + 0.25 * (PI + 2.0 * edge)) / TAU;
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Radau(5)] {
        let request = Request { method: Some(method), ..Request::default() };
        let outcome = through(&wheel(rate, until, &outputs), &request);
        let found = |name: &str| outcome.extremes.iter().find(|found| found.name == name).expect("an output");
        let [swell, size, other] = ["swell", "size", "part"].map(found);
        assert!((swell.max[0] - most).abs() < 1e-11, "{method}: {:?} instead of {most:?}", swell.max);
        assert!((swell.max[1] - crest / rate).abs() < 1e-8, "{method}: {:?}", swell.max);
        assert!((size.mean - 2.0 / PI).abs() < 1e-11 && size.max[0] > 1.0 - 1e-13, "{method}: {size:?}");
        assert!((other.mean - part).abs() < 1e-11 && other.min[0] == 0.25, "{method}: {other:?} {part:?}");
    }
}

/// An encoder gives 50 lines a turn: its formula oscillates in a step while the wheel hardly turns.
#[test]
fn an_event_of_a_formula_that_oscillates_is_found_in_every_period() {
    let (lines, rate, until) = (50.0, TAU, 10.0);
    let events = format!(r#""events": [{{"name": "e", "when": "sin({lines:?}*b.phi)"}}]"#);
    let scene = wheel(rate, until, &events);
    let first = ((START * lines / PI).ceil() * PI / lines - START) / rate;
    for request in requests() {
        let outcome = through(&scene, &request);
        let times: Vec<f64> = outcome.events.iter().map(|event| event.t).collect();
        assert_eq!(times.len(), 1000, "{:?}", request.method);
        for (k, t) in times.iter().enumerate() {
            let expected = first + k as f64 * PI / (lines * rate);
            assert!((t - expected).abs() < 1e-12, "{:?}: {t:?} and not {expected:?}", request.method);
        }
    }
}

/// A torque that acts on every other tooth gives the work of the teeth that have passed, and never drives back.
#[test]
fn a_law_that_is_switched_in_every_period_does_the_work_of_each() {
    let (teeth, torque, inertia) = (100.0, 0.02, 0.125);
    for (formula, share) in [("if(sin(100*b.phi) > 0, 1, 0)", 0.5), ("max(0, sin(100*b.phi))", 1.0 / PI)] {
        let torques = format!(r#""torques": [{{"name": "q", "body": "b", "torque": "{torque}*{formula}"}}]"#);
        let scene = wheel(TAU, 1.0, &torques);
        for request in requests().into_iter().take(3) {
            let outcome = through(&scene, &request);
            let (phi, omega) = (outcome.last.phi[0], outcome.last.omega[0]);
            // From the middle of a gap on: whole pitches, and what has passed of the last one.
            let done = |phi: f64| {
                let pitch = TAU / teeth;
                let (whole, rest) = ((phi / pitch).floor(), phi.rem_euclid(pitch));
                let part = match share {
                    0.5 => rest.min(0.5 * pitch),
                    _ => (1.0 - (teeth * rest.min(0.5 * pitch)).cos()) / teeth,
                };
                whole * share * pitch + part
            };
            let expected = (TAU * TAU + 2.0 * torque * (done(phi) - done(START)) / inertia).sqrt();
            assert!(
                (omega - expected).abs() < 1e-6,
                "{formula} by {:?}: {omega:?} and not {expected:?}",
                request.method
            );
        }
    }
}

/// Where a formula has no value nothing happens; its zeros are those of what it is written with.
#[test]
fn events_of_formulas_without_a_value_somewhere_are_those_of_the_rest() {
    let rate = 3.0;
    let formulas = [
        ("sqrt(b.phi) - 0.1", vec![(0.01 - START) / rate]),
        ("sqrt(0.25 - b.phi^2) - 0.4", vec![(-0.3 - START) / rate, (0.3 - START) / rate]),
        ("log(t/(1 s)) + 1", vec![(-1.0_f64).exp()]),
        ("1/(t/(1 s)) - 4", vec![0.25]),
        ("1/(b.phi - 0.5)", vec![]),
        ("tan(b.phi)", vec![-START / rate]),
    ];
    for (formula, expected) in formulas {
        let scene = wheel(rate, 0.9, &format!(r#""events": [{{"name": "e", "when": "{formula}"}}]"#));
        for request in requests() {
            let outcome = through(&scene, &request);
            let times: Vec<f64> = outcome.events.iter().map(|event| event.t).collect();
            assert_eq!(times.len(), expected.len(), "{formula} by {:?}: {times:?}", request.method);
            for (t, expected) in times.iter().zip(&expected) {
                assert!((t - expected).abs() < 1e-10, "{formula} by {:?}: {t:?}", request.method);
            }
        }
    }
}
