//! Motors whose aims depend on where the mechanism is, gears and cams: against closed forms and against equations
//! of one coordinate integrated in the test.

use super::formulas::{adaptive, run, scene};
use driftless::Mechanism;
use driftless::run::{MethodId, Outcome, Plan, Request};
use driftless::scene::{Scene, parse_scene, read_scene};

const G: f64 = 9.81;

fn methods() -> [Request; 6] {
    [
        adaptive(MethodId::Taylor, 1e-12),
        adaptive(MethodId::Dp5, 1e-11),
        adaptive(MethodId::Dp8, 1e-12),
        adaptive(MethodId::Dop853, 1e-12),
        adaptive(MethodId::Radau(3), 1e-10),
        adaptive(MethodId::Radau(5), 1e-12),
    ]
}

fn near(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() < 3e-8, "{what}: {found} and not {expected}");
}

fn finished(scene: &Scene, request: &Request) -> Outcome {
    let outcome = run(scene, request);
    assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
    assert!(outcome.drift.energy.max < 1e-8, "{:?}: {:e}", request.method, outcome.drift.energy.max);
    outcome
}

/// A Runge–Kutta method of order 4 for y'' = f(t, y, y'), in so many steps.
pub fn integrated(
    f: impl Fn(f64, f64, f64) -> f64,
    [mut y, mut v]: [f64; 2],
    until: f64,
    steps: usize,
) -> [f64; 2] {
    let h = until / steps as f64;
    for step in 0..steps {
        let t = step as f64 * h;
        let (k1, l1) = (v, f(t, y, v));
        let (k2, l2) = (v + 0.5 * h * l1, f(t + 0.5 * h, y + 0.5 * h * k1, v + 0.5 * h * l1));
        let (k3, l3) = (v + 0.5 * h * l2, f(t + 0.5 * h, y + 0.5 * h * k2, v + 0.5 * h * l2));
        let (k4, l4) = (v + h * l3, f(t + h, y + h * k3, v + h * l3));
        y += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        v += h / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
    }
    [y, v]
}

/// A pendulum that turns a flywheel by a gear of this law.
pub fn geared(law: &str, start: &str, until: f64) -> Scene {
    scene(&format!(
        r#"{{"name": "geared", "gravity": [0, -{G}],
        "bars": [{{"name": "bar", "mass": 2, "length": 1, "centre": [0.5, 0], "inertia": 0.2}},
            {{"name": "wheel", "mass": 1, "centre": [0, 0], "inertia": 0.03}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}},
            {{"name": "B", "between": [{{"body": "ground", "point": [1, 0]}}, {{"body": "wheel", "point": [0, 0]}}]}}],
        "motors": [{{"name": "gear", "body": "wheel", "law": "{law}"}}],
        "start": {{"bar": {start}}}, "until": {until}, "every": {until}}}"#
    ))
}

#[test]
fn a_pendulum_with_a_geared_flywheel_is_one_of_more_inertia() {
    // (I + m c² + n² J) phi'' = -m g c cos phi, over several turns, at a ratio that is no whole number, and from a
    // start at which the wheel has turned more than once.
    for begin in [0.4, -4.1] {
        geared_pendulum(begin);
    }
}

fn geared_pendulum(begin: f64) {
    let ratio = 2.3;
    let inertia = 0.2 + 2.0 * 0.25 + ratio * ratio * 0.03;
    let f = |_: f64, phi: f64, _: f64| -2.0 * G * 0.5 * phi.cos() / inertia;
    let [phi, omega] = integrated(f, [begin, 9.0], 2.0, 20_000);
    let start = format!(r#"{{"phi": {begin}, "omega": 9}}"#);
    for request in methods() {
        let outcome = finished(&geared("2.3*bar.phi - 0.5", &start, 2.0), &request);
        near(outcome.last.phi[0], phi, "angle");
        near(outcome.last.omega[0], omega, "rate");
        near(outcome.last.phi[1], ratio * phi - 0.5, "angle of the wheel");
        near(outcome.last.omega[1], ratio * omega, "rate of the wheel");
        let torque = 0.03 * ratio * f(0.0, phi, 0.0);
        near(outcome.last.motors[0][0], torque, "torque of the gear");
        assert!(outcome.last.work.abs() < 1e-12, "a gear does no work");
    }
    // The symmetric projection of fixed steps keeps it as well.
    let fixed = Request { method: Some(MethodId::Gauss(4)), step: Some(1.0 / 128.0), ..Request::default() };
    let outcome = finished(&geared("2.3*bar.phi - 0.5", &start, 2.0), &fixed);
    near(outcome.last.phi[0], phi, "angle by gauss8");
    near(outcome.last.phi[1], ratio * phi - 0.5, "angle of the wheel by gauss8");
}

#[test]
fn a_cam_moves_its_follower_as_its_formula_says() {
    // y = 0.1 (1 - cos 2 phi) of a follower of mass m on a spring; cam of inertia J, no gravity:
    // (J + m y'²) phi'' = -(m y' y'' phi'² + k y y'), derivatives by phi.
    let text = r#"{"name": "cam", "gravity": [0, 0],
        "bars": [{"name": "cam", "mass": 1, "centre": [0, 0], "inertia": 0.4},
            {"name": "follower", "mass": 1.5, "centre": [0, 0], "inertia": 0.1, "length": 0.1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "cam", "point": [0, 0]}]}],
        "sliders": [{"name": "guide", "point": {"body": "follower", "point": [0, 0]},
            "rail": {"body": "ground", "point": [0, 0.3], "direction": [0, 1]}, "angle": "locked"}],
        "springs": [{"name": "k", "between": [{"body": "ground", "point": [0, 1.3]}, {"body": "follower", "point": [0, 0]}],
            "stiffness": 80, "free_length": 0}],
        "motors": [{"name": "profile", "slider": "guide", "law": "0.1*(1 - cos(2*cam.phi))"}],
        "start": {"cam": {"phi": 0.2, "omega": 6}, "follower": {"phi": 0}}, "until": 1.5, "every": 1.5}"#;
    let f = |_: f64, phi: f64, omega: f64| {
        let (s, c) = (2.0 * phi).sin_cos();
        let [y, slope, bend] = [0.1 * (1.0 - c), 0.2 * s, 0.4 * c];
        -(1.5 * slope * bend * omega * omega + 80.0 * (y - 1.0) * slope) / (0.4 + 1.5 * slope * slope)
    };
    let [phi, omega] = integrated(f, [0.2, 6.0], 1.5, 40_000);
    for request in methods() {
        let outcome = finished(&scene(text), &request);
        near(outcome.last.phi[0], phi, "angle of the cam");
        near(outcome.last.omega[0], omega, "its rate");
        near(outcome.last.centre[1][1], 0.3 + 0.1 * (1.0 - (2.0 * phi).cos()), "height of the follower");
        near(outcome.last.velocity[1][1], 0.2 * (2.0 * phi).sin() * omega, "its velocity");
    }
}

#[test]
fn angles_of_gears_are_met_to_their_rounding() {
    // Over 300 turns; energy tells of the motion, and the ratio of the constraint.
    for request in [adaptive(MethodId::Dp8, 1e-12), adaptive(MethodId::Taylor, 1e-12)] {
        let outcome = finished(&geared("2.3*bar.phi - 0.5", r#"{"phi": 0.4, "omega": 100}"#, 20.0), &request);
        let [phi, wheel] = [outcome.last.phi[0], outcome.last.phi[1]];
        assert!((phi - 2000.0).abs() < 20.0, "{phi}");
        near(wheel, 2.3 * phi - 0.5, "angle of the wheel");
    }
}

#[test]
fn rails_are_kept_to_the_rounding_of_places_far_away() {
    // s = -g t² sin(slope) / 2 down a rail of direction (4, 3), 10 km in a minute.
    let text = r#"{"name": "slope", "gravity": [0, -9.8125],
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.25, "length": 0.5}],
        "sliders": [{"name": "s", "point": {"body": "b", "point": [0, 0]},
            "rail": {"body": "ground", "point": [0, 0], "direction": [4, 3]}, "angle": "locked"}],
        "start": {"b": {"phi": 0, "origin": [0, 0]}}, "until": 60, "every": 60}"#;
    let s = 0.5 * 9.8125 * 0.6 * 3600.0;
    for request in methods() {
        let outcome = finished(&scene(text), &request);
        for (found, share) in outcome.last.centre[0].into_iter().zip([0.8, 0.6]) {
            assert!((found / (-share * s) - 1.0).abs() < 1e-9, "{found} and not {}", -share * s);
        }
    }
}

/// Two bodies on pins; of the second, the wheel, these motors are.
fn worm(motors: &str, until: f64) -> Scene {
    scene(&format!(
        r#"{{"name": "worm", "gravity": [0, 0],
        "bars": [{{"name": "arm", "mass": 1, "centre": [0, 0], "inertia": 0.1}},
            {{"name": "wheel", "mass": 1, "centre": [0, 0], "inertia": 0.1}}],
        "hinges": [{{"name": "O", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "arm", "point": [0, 0]}}]}},
            {{"name": "W", "between": [{{"body": "ground", "point": [0, -1]}}, {{"body": "wheel", "point": [0, 0]}}]}}],
        "motors": [{motors}], "start": {{"arm": {{"phi": 0}}}}, "until": {until}, "every": {until}}}"#
    ))
}

#[test]
fn constraints_of_small_ratios_are_independent() {
    // The wheel turns by 0.001 t²/2, the arm 10000 times as far, whatever way the gear is written.
    for law in [
        r#""body": "wheel", "law": "0.0001*arm.phi""#,
        r#""body": "arm", "law": "10000*wheel.phi""#,
        r#""body": "wheel", "law": "1e-6*arm.phi + 0.0099*sin(0.01*arm.phi)""#,
    ] {
        let motors = format!(
            r#"{{"name": "m0", "body": "wheel", "law": {{"start": 0, "rate": 0, "acceleration": 0.001}}}},
            {{"name": "m1", {law}}}"#
        );
        // The last: wheel = 0.0001 arm to the third power of the arm's angle.
        let (until, most) = if law.contains("sin") { (0.05, 1e-6) } else { (0.25, 1e-8) };
        for request in methods() {
            let outcome = finished(&worm(&motors, until), &request);
            let phi = 5.0 * until * until;
            assert!((outcome.last.phi[0] - phi).abs() < most, "{law}: {:?}", outcome.last.phi);
            assert!((outcome.last.omega[0] - 10.0 * until).abs() < 1e-6, "{law}: {:?}", outcome.last.omega);
        }
    }
}

#[test]
fn a_block_far_out_on_an_arm_that_a_gear_turns_keeps_its_rail() {
    // omega = 5 by a gear of ratio 0.001, r = 0.5 cosh 5 t: 180 m on an arm of 1 m.
    let text = r#"{"name": "centrifuge", "gravity": [0, 0],
        "bars": [{"name": "arm", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 1},
            {"name": "block", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 0.2},
            {"name": "wheel", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 0.2}],
        "hinges": [{"name": "O", "between": [{"body": "ground", "point": [0, 0]}, {"body": "arm", "point": [0, 0]}]},
            {"name": "W", "between": [{"body": "ground", "point": [0, -1]}, {"body": "wheel", "point": [0, 0]}]}],
        "sliders": [{"name": "s", "point": {"body": "block", "point": [0, 0]},
            "rail": {"body": "arm", "point": [0, 0], "direction": [1, 0]}, "angle": "locked"}],
        "motors": [{"name": "m0", "body": "wheel", "law": {"start": 0, "rate": 0.005}},
            {"name": "m1", "body": "wheel", "law": "0.001*block.phi"}],
        "start": {"arm": {"phi": 0, "omega": 5}, "block": {"phi": 0, "omega": 5, "origin": [0.5, 0], "velocity": [0, 2.5]}},
        "until": 1.2, "every": 1.2}"#;
    let r = 0.5 * 6f64.cosh();
    for request in methods() {
        let outcome = run(&scene(text), &request);
        assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
        let [x, y] = outcome.last.centre[1];
        let (sin, cos) = 6f64.sin_cos();
        assert!((x / r - cos).abs() + (y / r - sin).abs() < 1e-6, "{:?}: {x} {y}", request.method);
        assert!((outcome.last.omega[0] - 5.0).abs() < 1e-6, "{:?}: {:?}", request.method, outcome.last.omega);
    }
}

#[test]
fn screws_of_fine_pitch_start_with_the_rates_of_their_tables() {
    // The table runs at 0.03 cos 3 t, the screw 2 pi / 0.05 mm as fast.
    let text = r#"{"name": "screw", "gravity": [0, 0],
        "bars": [{"name": "table", "mass": 2, "centre": [0, 0], "inertia": 0.01, "length": 0.2},
            {"name": "screw", "mass": 0.1, "centre": [0, 0], "inertia": 1e-6, "length": 0.02}],
        "hinges": [{"name": "O", "between": [{"body": "ground", "point": [0, 0.1]}, {"body": "screw", "point": [0, 0]}]}],
        "sliders": [{"name": "rail", "point": {"body": "table", "point": [0, 0]},
            "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "angle": "locked"}],
        "points": [{"name": "p", "body": "table", "point": [0, 0]}],
        "motors": [{"name": "drive", "slider": "rail", "law": {"start": 0, "rate": 0, "sines": [{"amplitude": 0.01, "frequency": 3}]}},
            {"name": "nut", "body": "screw", "law": "2*pi*p.x/(0.05 mm)"}],
        "start": {"table": {"phi": 0}, "screw": {"phi": 0}}, "until": 0.4, "every": 0.4}"#;
    let per = std::f64::consts::TAU / 5e-5;
    for request in methods() {
        let outcome = finished(&scene(text), &request);
        let (sin, cos) = 1.2f64.sin_cos();
        assert!((outcome.last.phi[1] / (per * 0.01 * sin) - 1.0).abs() < 1e-7, "{:?}", outcome.last.phi);
        assert!((outcome.last.omega[1] / (per * 0.03 * cos) - 1.0).abs() < 1e-7, "{:?}", outcome.last.omega);
    }
}

#[test]
fn an_aim_of_time_and_place_does_work() {
    // The wheel is to run ahead of the bar by 3 t + 0.2 sin(bar): psi = phi + 3 t + 0.2 sin phi.
    let law = "bar.phi + 3*t + 0.2*bar.sin";
    let f = |_: f64, phi: f64, omega: f64| {
        let (s, c) = phi.sin_cos();
        let slope = 1.0 + 0.2 * c;
        (-2.0 * G * 0.5 * c + 0.03 * slope * 0.2 * s * omega * omega) / (0.7 + 0.03 * slope * slope)
    };
    let [phi, omega] = integrated(f, [-1.0, 0.5], 2.0, 20_000);
    for request in methods() {
        let outcome = finished(&geared(law, r#"{"phi": -1, "omega": 0.5}"#, 2.0), &request);
        near(outcome.last.phi[0], phi, "angle");
        near(outcome.last.omega[0], omega, "rate");
        let psi = |phi: f64, omega: f64| omega * (1.0 + 0.2 * phi.cos()) + 3.0;
        let energy = |phi: f64, omega: f64| {
            0.35 * omega * omega + 0.015 * psi(phi, omega).powi(2) + 2.0 * G * 0.5 * phi.sin()
        };
        near(outcome.last.work, energy(phi, omega) - energy(-1.0, 0.5), "work of the motor");
    }
}

/// Angle and rate at `until` \[s\] of a cam that wheels freely from angle 0 at 5 rad/s and rises smoothly from
/// 1 rad on, theta = max(phi - 1, 0)².
pub fn beyond_a_corner(until: f64) -> [f64; 2] {
    let f = |_: f64, phi: f64, omega: f64| {
        let rise = (phi - 1.0).max(0.0);
        let bend = if phi > 1.0 { 2.0 } else { 0.0 };
        (-2.0 * G * 0.5 * phi.cos() - 0.03 * 2.0 * rise * bend * omega * omega)
            / (0.7 + 0.03 * 4.0 * rise * rise)
    };
    // To the corner and on from it.
    let (mut low, mut high) = (0.0, until);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if integrated(f, [0.0, 5.0], middle, 4000)[0] < 1.0 { low = middle } else { high = middle }
    }
    let there = integrated(f, [0.0, 5.0], high, 4000);
    integrated(f, [1.0, there[1]], until - high, 4000)
}

#[test]
fn corners_of_a_cam_are_switches() {
    let until = 0.6;
    let [phi, omega] = beyond_a_corner(until);
    for request in methods() {
        let outcome =
            finished(&geared("max(bar.phi - 1, 0)^2", r#"{"phi": 0, "omega": 5}"#, until), &request);
        near(outcome.last.phi[0], phi, "angle");
        near(outcome.last.omega[0], omega, "rate");
        near(outcome.last.phi[1], (phi - 1.0).powi(2), "angle of the wheel");
    }
}

#[test]
fn outputs_of_gears_and_cams_are_what_their_constraints_exert() {
    let scene = read_scene("tests/laws/gear_and_cam.json".as_ref(), &[]).expect("a scene");
    let mechanism = Mechanism::new(&scene).expect("equations");
    let [request, ..] = methods();
    let outcome = finished(&scene, &Request { until: Some(0.7), ..request });
    for (output, name) in ["gear", "cam"].into_iter().enumerate() {
        let row = mechanism.constraints.iter().position(|row| row.name == name).expect("a row");
        let (found, [force, power]) = (outcome.last.outputs[output], outcome.last.motors[row]);
        assert!(force.abs() > 1e-3 && found.to_bits() == force.to_bits(), "{name}: {found} {force}");
        assert_eq!(power, 0.0, "{name}: no law of time, no work");
    }
}

#[test]
fn what_aims_cannot_be_is_refused_with_what_to_do() {
    let refused = |law: &str| {
        let text = serde_json::to_string(&geared("2*bar.phi", r#"{"phi": 0, "omega": 1}"#, 1.0).to_input())
            .expect("JSON");
        assert!(text.contains("2*bar.phi"), "{text}");
        parse_scene(&text.replace("2*bar.phi", law), "test", &[]).expect_err("no scene").to_string()
    };
    let said = refused("bar.phi - 0.1*bar.omega");
    assert!(
        said.contains("motors[0].law") && said.contains("depends on bar.omega") && said.contains("torque"),
        "{said}"
    );
    let said = refused("bar.fi");
    assert!(said.contains("motors[0].law") && said.contains("bar has phi, omega"), "{said}");
    let said = refused("bar.phi*1 kg");
    assert!(said.contains("motors[0].law") && said.contains("not rad"), "{said}");
    let scene = geared("2*bar.phi", r#"{"phi": 0, "omega": 1}"#, 1.0);
    let mechanism = Mechanism::new(&scene).expect("equations");
    let plan = Plan::new(&scene, &mechanism, &Request::default()).expect("a plan by default");
    assert!(matches!(plan.method, MethodId::Dp8 | MethodId::Dop853 | MethodId::Radau(_)), "{}", plan.method);
}

/// Where the follower starts, and how fast, is what the cam's piece there says, whether the scene gives it or not.
#[test]
fn a_cam_starts_on_its_piece() {
    for (given, law) in
        [("", "if(a.phi > 1, 2*(a.phi-1)^3, 0)"), (r#", "b": {"phi": 2}"#, "if(a.phi < 1, 0, 2*(a.phi-1)^3)")]
    {
        let scene = scene(&format!(
            r#"{{"name": "cam", "gravity": [0, -9.81],
                "bars": [{{"name": "a", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}},
                         {{"name": "b", "mass": 1, "centre": [0.1, 0], "inertia": 0.2, "length": 1}}],
                "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}},
                           {{"name": "B", "between": [{{"body": "ground", "point": [2, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
                "motors": [{{"name": "cam", "body": "b", "law": "{law}"}}],
                "start": {{"a": {{"phi": 2, "omega": -0.5}}{given}}}, "until": 2, "every": 0.1}}"#
        ));
        let start = Mechanism::new(&scene).unwrap_or_else(|error| panic!("{error}")).start(&scene);
        near(start.phi[1].hi, 2.0, "angle of the follower");
        near(start.omega[1].hi, -3.0, "its rate");
        let outcome = run(&scene, &adaptive(MethodId::Dp8, 1e-12));
        assert!(outcome.stop.is_none(), "{law}: {:?}", outcome.stop);
        assert!(outcome.drift.energy.max < 1e-10, "{law}: {:e}", outcome.drift.energy.max);
    }
}

/// A free wheel with a rack between two walls: phi = w t from wall to wall, where the wheel turns round with the
/// restitution.
#[test]
fn racks_meet_walls_at_any_ratio_and_speed() {
    let mut impacts = 0;
    for (ratio, w, e) in [
        (0.07523960995800624, 2599.1302572411337, 0.627095128717303),
        (0.003062367797260521, 21.131589952241747, 0.9),
        (0.005326979462496898, 88.66785693047142, 0.8),
        (0.31, 1.7, 0.7),
        (0.019, 731.0, 0.95),
        (0.11, 316.0, 0.55),
    ] {
        let until = 118.0 / w;
        let (high, low) = (0.161 * ratio * w * until, -0.08 * ratio * w * until);
        let text = format!(
            r#"{{"name": "rack", "gravity": [0, 0],
            "bars": [{{"name": "w", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 0.5}},
                {{"name": "rk", "mass": 0.7, "centre": [0, 0], "inertia": 0.01, "length": 0.1}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "w", "point": [0, 0]}}]}}],
            "sliders": [{{"name": "s", "point": {{"body": "rk", "point": [0, 0]}}, "angle": "locked",
                "rail": {{"body": "ground", "point": [0, -1], "direction": [1, 0]}}}}],
            "motors": [{{"name": "r", "slider": "s", "law": "{ratio:?}*w.phi"}}],
            "walls": [{{"name": "hi", "body": "rk", "point": [0, 0], "restitution": {e:?},
                    "line": {{"through": [{high:?}, 0], "normal": [-1, 0]}}}},
                {{"name": "lo", "body": "rk", "point": [0, 0], "restitution": {e:?},
                    "line": {{"through": [{low:?}, 0], "normal": [1, 0]}}}}],
            "start": {{"w": {{"phi": 0, "omega": {w:?}}}, "rk": {{"phi": 0}}}}, "until": {until:?}, "every": {until:?}}}"#
        );
        let (mut phi, mut omega, mut t, mut expected) = (0.0, w, 0.0, Vec::new());
        loop {
            let wall = (if omega > 0.0 { high } else { low }) / ratio;
            t += (wall - phi) / omega;
            if t > until {
                break;
            }
            expected.push(t);
            (phi, omega) = (wall, -e * omega);
        }
        for request in [
            adaptive(MethodId::Taylor, 1e-9),
            adaptive(MethodId::Taylor, 1e-10),
            adaptive(MethodId::Dp8, 1e-9),
        ] {
            let outcome = finished(&scene(&text), &request);
            assert_eq!(outcome.impacts.len(), expected.len(), "{:?} at {ratio} {w}", request.method);
            for (impact, expected) in outcome.impacts.iter().zip(&expected) {
                assert!((impact.t / expected - 1.0).abs() < 1e-11, "{impact:?} and not {expected}");
            }
        }
        impacts += expected.len();
    }
    assert!(impacts > 15, "{impacts}");
}
