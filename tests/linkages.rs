//! Published problems of linkages, and other mechanisms with a closed form, by every method that fits.

use crate::andrews;
use crate::common;
#[allow(dead_code)]
#[path = "../examples/four_bars.rs"]
mod four_bars;

use common::{run, shipped};
use driftless::run::{MethodId, Outcome, Request, Stabilization};
use driftless::scene::Scene;
use driftless::stepping::Cause;
use serde_json::Value;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn data(text: &str) -> Value {
    serde_json::from_str(text).expect("valid JSON")
}

fn number(value: &Value) -> f64 {
    value.as_f64().or_else(|| value.as_str()?.parse().ok()).expect("a number")
}

fn by(method: &str, rtol: f64) -> Request {
    Request { method: Some(method.parse().expect("a method")), rtol: Some(rtol), ..Request::default() }
}

fn steps(method: &str, step: f64) -> Request {
    Request { method: Some(method.parse().expect("a method")), step: Some(step), ..Request::default() }
}

fn finished(scene: &Scene, request: &Request) -> Outcome {
    let outcome = run(scene, request);
    assert_eq!(outcome.stop, None, "{}", scene.name);
    outcome
}

/// Largest violation of any constraint of a run, at both levels.
fn violations(outcome: &Outcome) -> [f64; 2] {
    let of = |level: usize| {
        outcome.drift.constraints.iter().map(|(_, monitors)| monitors[level].max).fold(0.0, f64::max)
    };
    [of(0), of(1)]
}

/// Andrews' squeezing mechanism against its quadruple-precision state.  The mechanism is 0.1 m across.
#[test]
fn andrews_squeezing_mechanism() {
    let [angles, rates] = andrews::reference();
    let scene = Scene { every: 0.01, ..shipped("andrews", &[]) };
    // Start angles are in doubles, which alone is 1e-12 at the end.
    for (request, most) in [
        (by("taylor", 1e-9), 1e-8),
        (by("taylor", 1e-11), 1e-9),
        (by("taylor", 1e-14), 1e-11),
        (by("dp8", 1e-9), 1e-8),
        (by("dp8", 1e-10), 1e-9),
        (by("dp8", 1e-13), 1e-11),
        (by("dp5", 1e-11), 1e-8),
        (by("dop853", 1e-11), 1e-9),
        (steps("gauss16", 2.5e-5), 1e-9),
        (steps("rattle8", 1e-4 / 8.0), 1e-9),
    ] {
        let outcome = finished(&scene, &request);
        let apart = |found: &[f64], expected: &[f64]| {
            found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let (error, slip) = (apart(&outcome.last.phi, &angles), apart(&outcome.last.omega, &rates));
        let method = outcome.plan.method;
        assert!(error < most, "{method}: {error:.1e} rad");
        assert!(slip < 1e5 * most, "{method}: {slip:.1e} rad/s");
        let [position, velocity] = violations(&outcome);
        let is_kept = outcome.plan.stabilization == Stabilization::Projection;
        // Rates are of the order 1e3 rad/s.
        assert!(
            !is_kept || (position < 1e-14 && velocity < 1e-14 * 1e3),
            "{method}: {position:.1e} m, {velocity:.1e} m/s"
        );
        assert!(outcome.drift.energy.max < 1e-8, "{method}: {:.1e}", outcome.drift.energy.max);
    }
}

#[test]
fn iftomm_a01_pendulum() {
    let file = data(include_str!("data/iftomm_a01_pendulum.json"));
    let scene = shipped("iftomm_pendulum", &[]);
    for sample in file["reference"]["samples"].as_array().expect("a list") {
        let until = number(&sample["t"]);
        let outcome = finished(&Scene { until, every: until, ..scene.clone() }, &by("taylor", 1e-14));
        let (phi, omega) = (outcome.last.phi[0], outcome.last.omega[0]);
        let found = [phi.cos(), phi.sin(), -omega * phi.sin(), omega * phi.cos()];
        for (found, key) in found.iter().zip(["x", "y", "vx", "vy"]) {
            assert!((found - number(&sample[key])).abs() < 1e-12, "{until} s: {key} {found}");
        }
    }
}

/// Through twenty positions in which all links lie in line: every method is on the branch, or stops and says
/// so.
#[test]
fn iftomm_a02_four_bars_pass_singular_positions() {
    let file = data(include_str!("data/iftomm_a02_fourbar_n2.json"));
    let last = file["reference"]["samples"].as_array().expect("a list").last().expect("a sample").clone();
    let scene = Scene { every: 0.5, ..shipped("four_bars", &[]) };
    let (mut arrived, mut lost) = (Vec::new(), Vec::new());
    let adaptive = ["taylor", "dp8", "dp5", "dop853", "dopri5"]
        .map(|method| (-14..=-6).map(move |p| by(method, 10_f64.powi(p))));
    let fixed = ["gauss8", "gauss16", "rattle4", "rattle6"]
        .map(|method| (5..=9).map(move |p| steps(method, 0.5_f64.powi(p))));
    for request in adaptive.into_iter().flatten().chain(fixed.into_iter().flatten()) {
        let outcome = run(&scene, &request);
        let name = format!("{} {:?} {:?}", outcome.plan.method, outcome.plan.step, request.rtol);
        if let Some(stop) = &outcome.stop {
            let typed = [
                Cause::BranchLost,
                Cause::ProjectionFailed,
                Cause::NotConverged,
                Cause::StepTooSmall,
                Cause::EffortExhausted,
            ];
            assert!(typed.contains(&stop.cause), "{name}: {stop}");
            lost.push(name);
            continue;
        }
        let phi = outcome.last.phi[0];
        let off = (phi.cos() - number(&last["x"])).hypot(phi.sin() - number(&last["y"]));
        let apart = (1..3).map(|k| (outcome.last.phi[k] - phi).abs()).fold(0.0, f64::max);
        // On the other branch of a four-bar nothing is parallel any more.
        let most = request.rtol.map_or(0.1, |rtol| (1e3 * rtol).max(1e-6));
        assert!(
            off < most && apart < 1e-6,
            "{name}: {off:.1e} m from the closed form, links {apart:.1e} rad apart"
        );
        arrived.push((name, off));
    }
    for (method, most) in [("taylor", 1e-8), ("dp8", 3e-8), ("dp5", 3e-8)] {
        let of_method: Vec<_> =
            arrived.iter().filter(|(name, _)| name.starts_with(&format!("{method} "))).collect();
        assert_eq!(of_method.len(), 9, "{method}: {lost:?}");
        let best = of_method.iter().map(|(_, off)| *off).fold(f64::INFINITY, f64::min);
        assert!(best < most, "{method}: {best:.1e}");
    }
    assert!(arrived.iter().any(|(name, off)| name.starts_with("rattle") && *off < 1e-5), "{arrived:?}");
}

/// Forty four-bars side by side, parallel all the time.
#[test]
fn forty_four_bars() {
    let scene = Scene { until: 20.0, every: 20.0, ..four_bars::scene(40) };
    let outcome = finished(&scene, &by("taylor", 1e-8));
    // (N + (N+1)/3) theta'' = (N + (N+1)/2) g sin theta, from the vertical.
    let ratio = (40.0 + 41.0 / 2.0) / (40.0 + 41.0 / 3.0) * 9.81;
    let (mut theta, mut rate, h) = (0.0_f64, 1.0_f64, 1e-4);
    for _ in 0..200_000 {
        // Fourth-order composition of the leapfrog.
        for part in [1.351_207_191_959_657_8, -1.702_414_383_919_315_3, 1.351_207_191_959_657_8] {
            theta += 0.5 * h * part * rate;
            rate += h * part * ratio * theta.sin();
            theta += 0.5 * h * part * rate;
        }
    }
    let off = (outcome.last.phi[0] - (FRAC_PI_2 - theta)).abs();
    assert!(off < 1e-5, "{off:.1e} rad");
}

#[test]
fn driven_slider_crank() {
    let scene = shipped("slider_crank_driven", &[]);
    for request in [by("taylor", 1e-10), by("dp8", 1e-10), steps("gauss16", 5e-4), steps("rattle8", 1.25e-4)]
    {
        let outcome = finished(&scene, &request);
        let (last, name) = (&outcome.last, outcome.plan.method);
        for (what, found, expected, most) in [
            ("rod angle", last.phi[1], -0.331_163_913_464_838_2, 1e-10),
            ("rod rate", last.omega[1], 60.250_322_145_936_65, 1e-7),
            ("slider position", last.centre[2][0], 0.169_746_176_502_319_04, 1e-10),
            ("slider velocity", last.velocity[2][0], -8.754_468_624_977_382, 1e-7),
            ("torque", last.motors[0][0], -25.014_657_779_961_57, 1e-5),
        ] {
            assert!((found - expected).abs() < most, "{name}: {what} {found}");
        }
    }
}

#[test]
fn slider_crank_under_torque() {
    let file = data(include_str!("data/slider_crank_rigid_torque.json"));
    let last = file["reference"]["samples"].as_array().expect("a list").last().expect("a sample").clone();
    let scene = Scene { every: 0.25, ..shipped("slider_crank_torque", &[]) };
    for (request, most) in [
        (by("taylor", 1e-12), 1e-9),
        (by("dp8", 1e-12), 1e-9),
        (by("dop853", 1e-12), 1e-7),
        (steps("gauss16", 1.0 / 512.0), 1e-9),
        (steps("rattle8", 1.0 / 1024.0), 1e-6),
    ] {
        let outcome = finished(&scene, &request);
        let found = [
            outcome.last.phi[0],
            outcome.last.omega[0],
            outcome.last.phi[1],
            outcome.last.centre[2][0],
            outcome.last.velocity[2][0],
        ];
        for (found, key) in
            found.iter().zip(["crank_angle", "crank_rate", "rod_angle", "slider_x", "slider_velocity"])
        {
            let expected = number(&last[key]);
            assert!(
                (found - expected).abs() < most * expected.abs().max(1.0),
                "{}: {key} {found} is not {expected}",
                outcome.plan.method
            );
        }
    }
}

/// Nothing pushes a cart along its rail: the momentum along it and the energy stay what they are.
#[test]
fn cart_and_pole() {
    let scene = shipped("cart_pole", &[]);
    let momentum = |outcome: &Outcome| -> f64 {
        scene.bars.iter().zip(&outcome.last.velocity).map(|(bar, v)| bar.mass * v[0]).sum()
    };
    for request in [
        by("taylor", 1e-12),
        by("dp8", 1e-12),
        by("dop853", 1e-12),
        steps("gauss16", 1.0 / 128.0),
        steps("rattle6", 1.0 / 512.0),
    ] {
        let begun = finished(&Scene { until: scene.every, ..scene.clone() }, &request);
        let outcome = finished(&scene, &request);
        let name = outcome.plan.method;
        assert!(
            (momentum(&outcome) - momentum(&begun)).abs() < 1e-11,
            "{name}: {} {}",
            momentum(&outcome),
            momentum(&begun)
        );
        assert!(outcome.drift.energy.max < 1e-9, "{name}: {:.1e}", outcome.drift.energy.max);
        assert!((outcome.last.centre[0][1]).abs() < 1e-12 && outcome.last.phi[0].abs() < 1e-12, "{name}");
    }
}

/// The rocker of a driven four-bar by the law of cosines.
#[test]
fn four_bar_with_a_motor() {
    let scene = shipped("four_bar_motor", &[]);
    let [a, b, c, d] = [0.3, 0.9, 0.7, 1.0_f64];
    for until in [1.0 / 3.0, 7.3] {
        let crank = FRAC_PI_2 + TAU * until;
        let (x, y) = (d - a * crank.cos(), -a * crank.sin());
        let span = x.hypot(y);
        // Seen from the origin of the rocker, the crank pin is at this angle, and the rocker that much to its
        // right.
        let rocker = (-y).atan2(-x) - ((c * c + span * span - b * b) / (2.0 * c * span)).acos();
        for request in [
            by("taylor", 1e-11),
            by("dp8", 1e-11),
            steps("gauss16", until / 1024.0),
            steps("rattle8", until / 8192.0),
        ] {
            let outcome = finished(&Scene { until, every: until, ..scene.clone() }, &request);
            let off = (outcome.last.phi[2] - rocker + PI).rem_euclid(TAU) - PI;
            assert!(off.abs() < 1e-9, "{}: {off:.1e} rad", outcome.plan.method);
            assert!(
                outcome.drift.energy.max < 1e-8,
                "{}: {:.1e}",
                outcome.plan.method,
                outcome.drift.energy.max
            );
        }
    }
}

/// The rocker points at the crank pin, whatever moves it.
#[test]
fn quick_return_mechanism() {
    let scene = shipped("quick_return", &[]);
    for until in [0.4, 3.7] {
        let crank = TAU * until;
        let rocker = (0.1 * crank.sin() + 0.25).atan2(0.1 * crank.cos());
        for request in [
            by("taylor", 1e-11),
            by("dp8", 1e-11),
            by("dop853", 1e-11),
            steps("gauss16", until / 2048.0),
            steps("rattle8", until / 8192.0),
        ] {
            let outcome = finished(&Scene { until, every: until, ..scene.clone() }, &request);
            let off = (outcome.last.phi[1] - rocker).abs();
            assert!(off < 1e-9, "{}: {off:.1e} rad", outcome.plan.method);
            let ram = 0.5 * rocker.cos() - (0.2_f64.powi(2) - (0.5 * rocker.sin() - 0.45).powi(2)).sqrt();
            assert!(
                (outcome.last.centre[3][0] - ram).abs() < 1e-9
                    && (outcome.last.centre[3][1] - 0.2).abs() < 1e-9,
                "{}",
                outcome.plan.method
            );
            assert!(
                outcome.drift.energy.max < 1e-8,
                "{}: {:.1e}",
                outcome.plan.method,
                outcome.drift.energy.max
            );
        }
    }
}

/// A kite folds, and a slider-crank with equal arms turns over the point below its slider: two more singular
/// positions.  Whoever arrives, arrives at the same place.
#[test]
fn singular_positions_that_are_no_ladders() {
    for (name, until) in [("kite", 2.0), ("slider_crank_equal", 5.0)] {
        let scene = Scene { until, every: 0.25, ..shipped(name, &[]) };
        let reference = finished(&scene, &by("taylor", 1e-11));
        let mut arrived = 0;
        let adaptive = ["taylor", "dp8", "dp5", "dop853"]
            .map(|method| (-13..=-8).map(move |p| by(method, 10_f64.powi(p))));
        for request in adaptive.into_iter().flatten() {
            let outcome = run(&scene, &request);
            if outcome.stop.is_some() {
                continue;
            }
            arrived += usize::from(outcome.plan.stabilization == Stabilization::Projection);
            let off = outcome
                .last
                .phi
                .iter()
                .zip(&reference.last.phi)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            assert!(off < 1e-3, "{name}, {} at {:?}: {off:.1e} rad", outcome.plan.method, request.rtol);
        }
        assert!(arrived >= 12, "{name}: {arrived} of 18 arrived");
        assert!(matches!(reference.plan.method, MethodId::Taylor));
    }
}

fn parsed(text: &str) -> Scene {
    driftless::scene::parse_scene(text, "scene", &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// A body that hangs on nothing: its centre flies a parabola, and it turns as it was thrown.
#[test]
fn a_free_body_flies_a_parabola() {
    let scene = parsed(
        r#"{"name": "thrown", "gravity": [0, -10], "until": 2, "every": 2,
            "bars": [{"name": "stick", "mass": 2, "centre": [0.3, 0.1], "inertia": 0.05, "length": 0.6}],
            "start": {"stick": {"phi": 0.5, "omega": 7, "origin": [1, 2], "velocity": [3, 4]}}}"#,
    );
    let (cos, sin) = (0.5_f64.cos(), 0.5_f64.sin());
    let arm = [0.3 * cos - 0.1 * sin, 0.3 * sin + 0.1 * cos];
    let expected = [
        1.0 + arm[0] + (3.0 - 7.0 * arm[1]) * 2.0,
        2.0 + arm[1] + (4.0 + 7.0 * arm[0]) * 2.0 - 0.5 * 10.0 * 4.0,
    ];
    for request in [
        by("taylor", 1e-12),
        by("dp8", 1e-12),
        by("dop853", 1e-12),
        steps("gauss16", 0.125),
        steps("rattle8", 1.0 / 256.0),
    ] {
        let outcome = finished(&scene, &request);
        let (last, name) = (&outcome.last, outcome.plan.method);
        assert!((last.phi[0] - 14.5).abs() < 1e-9, "{name}: {}", last.phi[0]);
        for (found, expected) in last.centre[0].iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{name}: {found} is not {expected}");
        }
    }
}

/// A block on an inclined rail, driven along it: the motor's force is what Newton asks for, and its work is
/// what the block gains.
#[test]
fn a_motor_on_a_slider_pushes_with_the_force_newton_asks_for() {
    let scene = parsed(
        r#"{"name": "driven_slider", "gravity": [0, -10], "until": 1.25, "every": 0.25,
            "bars": [{"name": "block", "mass": 3, "centre": [0, 0], "inertia": 0.2, "length": 0.1}],
            "sliders": [{"name": "rail", "point": {"body": "block", "point": [0, 0]},
                         "rail": {"body": "ground", "point": [1, 2], "direction": [4, 3]}, "angle": "locked"}],
            "motors": [{"name": "push", "slider": "rail", "law": {"start": 0.2, "rate": 0.5, "sines": [{"amplitude": 0.1, "frequency": 4}]}}],
            "start": {"block": {"phi": 0}}}"#,
    );
    let t = 1.25_f64;
    let travel = 0.2 + 0.5 * t + 0.1 * (4.0 * t).sin();
    let force = 3.0 * (-1.6 * (4.0 * t).sin() + 10.0 * 0.6);
    for request in
        [by("taylor", 1e-11), by("dp8", 1e-11), steps("gauss16", 1.0 / 64.0), steps("rattle8", 1.0 / 512.0)]
    {
        let outcome = finished(&scene, &request);
        let (last, name) = (&outcome.last, outcome.plan.method);
        assert!((last.centre[0][0] - (1.0 + 0.8 * travel)).abs() < 1e-10, "{name}: {:?}", last.centre[0]);
        let row =
            outcome.drift.constraints.iter().position(|(name, _)| name == "push").expect("the motor's row");
        assert!(
            (last.motors[row][0] - force).abs() < 1e-8,
            "{name}: {} N is not {force} N",
            last.motors[row][0]
        );
        // The work is a product of two series, and no step is judged by it.
        assert!(outcome.drift.energy.max < 1e-7, "{name}: {:.1e}", outcome.drift.energy.max);
    }
}

/// A disc on a torsion spring swings harmonically, through more than a turn; damped, its energy goes where
/// the damper's work says.
#[test]
fn a_torsion_pendulum_counts_its_turns() {
    let scene = |damping: f64| {
        parsed(&format!(
            r#"{{"name": "torsion", "gravity": [0, 0], "until": 3, "every": 0.5,
                "bars": [{{"name": "disc", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 0.2}}],
                "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "disc", "point": [0, 0]}}]}}],
                "torsion_springs": [{{"name": "coil", "body": "disc", "stiffness": 2, "free_angle": 1, "damping": {damping}}}],
                "start": {{"disc": {{"phi": 11, "omega": 0}}}}}}"#
        ))
    };
    for request in [by("taylor", 1e-12), by("dp8", 1e-12), by("dop853", 1e-12), steps("gauss16", 1.0 / 32.0)]
    {
        let (free, damped) = (finished(&scene(0.0), &request), finished(&scene(0.4), &request));
        let name = free.plan.method;
        assert!(
            (free.last.phi[0] - (1.0 + 10.0 * 6.0_f64.cos())).abs() < 1e-9,
            "{name}: {}",
            free.last.phi[0]
        );
        // exp(-0.4 t) with the frequency sqrt(4 - 0.16).
        let w = 3.84_f64.sqrt();
        let swing = 10.0 * (-1.2_f64).exp() * ((3.0 * w).cos() + 0.4 / w * (3.0 * w).sin());
        assert!((damped.last.phi[0] - (1.0 + swing)).abs() < 1e-9, "{name}: {}", damped.last.phi[0]);
        assert!(free.drift.energy.max < 1e-10 && damped.drift.energy.max < 1e-9, "{name}");
    }
}

/// Forces of every kind on a bar about its centre, against the angular momentum they give it.
#[test]
fn forces_and_torques_turn_a_bar_as_their_moments_say() {
    let scene = parsed(
        r#"{"name": "forced", "gravity": [0, 0], "until": 2, "every": 1,
            "bars": [{"name": "bar", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 1}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
            "forces": [{"name": "jet", "body": "bar", "point": [0.5, 0], "force": [9, 2], "frame": "body", "law": {"start": 1, "rate": -0.5}},
                       {"name": "wind", "body": "bar", "point": [0, 0], "force": [3, 4]}],
            "torques": [{"name": "twist", "body": "bar", "torque": 0.25}],
            "start": {"bar": {"phi": 0.3, "omega": 1}}}"#,
    );
    // 0.5 w' = 0.5·2 (1 - t/2) + 0.25.
    let rate = 1.0 + 2.0 * (2.0 - 1.0) + 0.5 * 2.0;
    let angle = 0.3 + 2.0 + (4.0 - 8.0 / 6.0) + 0.25 * 4.0;
    for request in [by("taylor", 1e-12), by("dp8", 1e-12), by("dop853", 1e-12), steps("gauss16", 1.0 / 32.0)]
    {
        let outcome = finished(&scene, &request);
        let name = outcome.plan.method;
        assert!((outcome.last.omega[0] - rate).abs() < 1e-10, "{name}: {}", outcome.last.omega[0]);
        assert!((outcome.last.phi[0] - angle).abs() < 1e-10, "{name}: {}", outcome.last.phi[0]);
        assert!(outcome.drift.energy.max < 1e-10, "{name}: {:.1e}", outcome.drift.energy.max);
    }
}

/// Two halves welded together are one bar.
#[test]
fn welded_halves_swing_as_the_whole() {
    let bars = |halves: bool| {
        let (bars, welds) = if halves {
            (
                r#"{"name": "bar", "mass": 0.5, "centre": [0.25, 0], "inertia": 0.0104166666666666667, "length": 0.5},
                   {"name": "rest", "mass": 0.5, "centre": [0.25, 0], "inertia": 0.0104166666666666667, "length": 0.5}"#,
                r#""welds": [{"name": "joint", "between": [{"body": "bar", "point": [0.5, 0]}, {"body": "rest", "point": [0, 0]}]}],"#,
            )
        } else {
            (
                r#"{"name": "bar", "mass": 1, "centre": [0.5, 0], "inertia": 0.0833333333333333333, "length": 1}"#,
                "",
            )
        };
        let rest = if halves { r#", "rest": {"phi": 1.2, "omega": 0}"# } else { "" };
        parsed(&format!(
            r#"{{"name": "bar", "gravity": [9.81, 0], "until": 3, "every": 1, "bars": [{bars}], {welds}
                "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}}],
                "start": {{"bar": {{"phi": 1.2, "omega": 0}}{rest}}}}}"#
        ))
    };
    let whole = finished(&bars(false), &by("taylor", 1e-13)).last.phi[0];
    for request in
        [by("taylor", 1e-12), by("dp8", 1e-12), steps("gauss16", 1.0 / 32.0), steps("rattle8", 1.0 / 256.0)]
    {
        let outcome = finished(&bars(true), &request);
        for phi in &outcome.last.phi {
            assert!((phi - whole).abs() < 1e-9, "{}: {phi} is not {whole}", outcome.plan.method);
        }
    }
}

/// Two cranks whose lengths differ by a third of a percent: a parallelogram but for that, which passes beside
/// its change points.
const NEAR_PARALLELOGRAM: &str = r#"{
    "name": "near_parallelogram", "gravity": [9.81, 0],
    "bars": [
      {"name": "bar1", "mass": 0.0603, "length": 0.3, "centre": [0.15, 0], "inertia": 0.0004648125},
      {"name": "bar2", "mass": 0.0603, "length": 0.6, "centre": [0.3, 0], "inertia": 0.0018215625},
      {"name": "bar3", "mass": 0.0603, "length": 0.301, "centre": [0.1505, 0], "inertia": 0.000467832525}
    ],
    "hinges": [
      {"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar1", "point": [0, 0]}]},
      {"name": "B", "between": [{"body": "bar1", "point": [0.3, 0]}, {"body": "bar2", "point": [0, 0]}]},
      {"name": "C", "between": [{"body": "bar2", "point": [0.6, 0]}, {"body": "bar3", "point": [0, 0]}]},
      {"name": "D", "between": [{"body": "ground", "point": [0, 0.6]}, {"body": "bar3", "point": [0.301, 0]}]}
    ],
    "start": {
      "bar1": {"phi": 0.3, "omega": 9.0},
      "bar2": {"phi": 1.5690515479909157, "omega": -0.00485609713747868},
      "bar3": {"phi": 3.4405619465492783, "omega": 8.967227686060262}
    },
    "until": 1, "every": 0.02
}"#;

/// Beside a singular position the shifts of both ends of a step come together slowly, which is no reason to
/// stop: the error that is left is that of the method.
#[test]
fn gauss_methods_pass_beside_singular_positions() {
    let scene =
        driftless::scene::parse_scene(NEAR_PARALLELOGRAM, "near_parallelogram.json", &[]).expect("a scene");
    let end = |request: &Request| {
        let outcome = finished(&scene, request);
        assert!(violations(&outcome)[0] < 1e-12, "{}", outcome.plan.method);
        outcome.last.phi
    };
    let exact = end(&by("taylor", 1e-13));
    // The step of a method by itself, and half and a quarter of it.
    for (method, step, most) in [
        ("gauss4", 1.25e-3, [1e-7, 1e-8, 1e-9]),
        ("gauss6", 1.25e-3, [1e-9, 1e-11, 1e-12]),
        ("gauss8", 2.5e-3, [1e-7, 1e-11, 1e-12]),
    ] {
        for (part, most) in most.into_iter().enumerate() {
            let found = end(&steps(method, step / f64::from(1 << part)));
            let error = found.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(error < most, "{method} with 1/{} of its step: {error:.1e}", 1 << part);
        }
    }
}
