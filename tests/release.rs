//! Hinges and motors that events release: against parabolas, and against equations in absolute coordinates.

use super::formulas::{adaptive, rotor, run, scene};
use super::friction::{Absolute, pin};
use driftless::run::{Limits, METHODS, MethodId, Plan, Request, Run, Running};
use driftless::{Mechanism, read_scene};
use nalgebra::DVector;
use std::f64::consts::PI;
use std::sync::Arc;

const G: f64 = 9.81;

fn methods() -> [Request; 5] {
    [
        adaptive(MethodId::Dp5, 1e-14),
        adaptive(MethodId::Dp8, 1e-14),
        adaptive(MethodId::Dop853, 1e-14),
        adaptive(MethodId::Taylor, 1e-15),
        adaptive(MethodId::Radau(5), 1e-13),
    ]
}

fn near(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() < 1e-10, "{what}: {found} and not {expected}");
}

/// A pendulum that is let go at an angle.
const PENDULUM: &str = r#"{"name": "release", "gravity": [0, -9.81],
    "bars": [{"name": "bar", "mass": 2, "length": 1, "centre": [0.5, 0], "inertia": 0.2}],
    "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0.3, 1]}, {"body": "bar", "point": [0, 0]}]}],
    "events": [{"name": "let_go", "when": "bar.phi + 0.6", "direction": "falling", "off": ["A"]}],
    "start": {"bar": {"phi": 0, "omega": -1}}, "until": 1, "every": 1}"#;

#[test]
fn a_pendulum_that_is_let_go_flies_on_a_parabola_and_spins_on() {
    // Energy at the release, about the hinge: (I + m c²) w²/2 + m g c sin phi.
    let (inertia, angle) = (0.2 + 2.0 * 0.25, -0.6_f64);
    let rate = -(1.0 - 2.0 * 2.0 * G * 0.5 * angle.sin() / inertia).sqrt();
    for request in methods() {
        let outcome = run(&scene(PENDULUM), &request);
        assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
        assert!(outcome.drift.energy.max < 1e-8 && outcome.event_energy.abs() < 1e-8);
        let [event] = &outcome.events[..] else { panic!("{:?}", outcome.events) };
        near(event.phi[0], angle, "angle at the release");
        near(event.omega[0], rate, "rate at the release");
        let (flight, sample) = (1.0 - event.t, &outcome.last);
        let (sin, cos) = angle.sin_cos();
        near(sample.phi[0], angle + rate * flight, "angle");
        near(sample.omega[0], rate, "rate");
        near(sample.centre[0][0], 0.3 + 0.5 * cos - 0.5 * sin * rate * flight, "x");
        near(
            sample.centre[0][1],
            1.0 + 0.5 * sin + 0.5 * cos * rate * flight - 0.5 * G * flight * flight,
            "y",
        );
    }
}

#[test]
fn a_trebuchet_throws_as_far_as_in_absolute_coordinates() {
    let mut throwing = read_scene("examples/scenes/trebuchet.json".as_ref(), &[]).expect("a scene");
    throwing.every = throwing.until;
    let absolute = Absolute {
        mass: vec![[20.0, 60.0], [400.0, 20.0], [0.5, 0.375], [5.0, 0.02]],
        pins: vec![
            pin([None, Some(0)], [[0.0, 6.0], [-0.3, 0.0]], 0.0),
            pin([Some(0), Some(1)], [[-1.5, 0.0], [-0.5, 0.0]], 0.0),
            pin([Some(0), Some(2)], [[4.5, 0.0], [-1.5, 0.0]], 0.0),
            pin([Some(2), Some(3)], [[1.5, 0.0], [0.0, 0.0]], 0.0),
        ],
        rails: vec![],
    };
    let [beam, weight, sling] = [0, 1, 2].map(|k| throwing.start[k].phi);
    let on = |[x, y]: [f64; 2], angle: f64, reach: f64| [x + reach * angle.cos(), y + reach * angle.sin()];
    let centre = on([0.0, 6.0], beam, 0.3);
    let hung = on(on(centre, beam, -1.5), weight, 0.5);
    let end = on(centre, beam, 4.5);
    let (middle, stone) = (on(end, sling, 1.5), on(end, sling, 3.0));
    let mut q = DVector::from_row_slice(&[
        centre[0], centre[1], beam, hung[0], hung[1], weight, middle[0], middle[1], sling, stone[0],
        stone[1], 0.0,
    ]);
    let (mut v, mut t) = (DVector::zeros(12), 0.0);
    let angle: f64 =
        throwing.events[0].when.rsplit(' ').next().and_then(|angle| angle.parse().ok()).expect("an angle");
    let left = |q: &DVector<f64>| q[8] - q[2] - angle;
    // The last step ends at the release, by bisection of its length.
    let h = 1e-4;
    loop {
        let (next_q, next_v, _) = absolute.step(&q, &v, h);
        if left(&next_q) < 0.0 {
            (q, v, t) = (next_q, next_v, t + h);
            continue;
        }
        let (mut low, mut high) = (0.0, h);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if left(&absolute.step(&q, &v, middle).0) < 0.0 { low = middle } else { high = middle }
        }
        let (at_q, at_v, _) = absolute.step(&q, &v, high);
        (q, v, t) = (at_q, at_v, t + high);
        break;
    }
    let (x, y, vx, vy) = (q[9], q[10], v[9], v[10]);
    let flight = (vy + (vy * vy + 2.0 * G * y).sqrt()) / G;
    println!("released at {t} s, lands at {} m after {} s", x + vx * flight, t + flight);
    for request in methods() {
        let outcome = run(&throwing, &request);
        assert_eq!(outcome.ended_by.as_deref(), Some("landing"), "{:?}", outcome.stop);
        assert!(outcome.drift.energy.max < 1e-8, "{:?}: {:e}", request.method, outcome.drift.energy.max);
        near(outcome.events[0].t, t, "release");
        near(outcome.last.t, t + flight, "landing");
        // Of a hundred metres.
        near(outcome.last.centre[3][0] / 100.0, (x + vx * flight) / 100.0, "distance");
        near(outcome.last.omega[3], v[11], "spin");
    }
}

#[test]
fn a_rotor_coasts_once_its_motor_is_off() {
    // Driven at 2 rad/s to t = 1 s, then on a torsion spring: phi'' = -k phi / I.
    let text = rotor(
        [0.0, 2.0],
        3.0,
        r#""motors": [{"name": "drive", "body": "bar", "law": {"start": 0, "rate": 2}}],
        "torsion_springs": [{"name": "k", "body": "bar", "stiffness": 6, "free_angle": 0}],
        "events": [{"name": "out", "when": "t - 1", "off": ["drive"]}]"#,
    );
    let text = text.replace(r#""start": {"bar": {"phi": 0, "omega": 2}}"#, r#""start": {}"#);
    let (sin, cos) = f64::sin_cos(2.0 * 2.0);
    for request in methods() {
        let outcome = run(&scene(&text), &request);
        assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
        assert!(outcome.drift.energy.max < 1e-8, "{:?}: {:e}", request.method, outcome.drift.energy.max);
        near(outcome.last.phi[0], 2.0 * cos + sin, "angle");
        near(outcome.last.omega[0], 2.0 * (cos - 2.0 * sin), "rate");
        near(outcome.last.work, 0.5 * 6.0 * 4.0, "work of the motor");
        assert_eq!(outcome.last.motors[0], [0.0; 2]);
    }
}

/// Fixed steps are laid from the event on, which is at no multiple of them.
#[test]
fn every_method_is_at_its_output_times_after_an_event_between_steps() {
    let law = r#""parameters": {"k": 2}, "events": [{"name": "E", "when": "t - 0.777", "set": {"k": 3}}],"#;
    let tree = format!(
        r#"{{"name": "tree", "gravity": [0, -{G}], {law}
        "bars": [{{"name": "a", "mass": 1, "length": 1, "centre": [0.5, 0], "inertia": 0.1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}}],
        "torsion_springs": [{{"name": "s", "body": "a", "stiffness": "k", "free_angle": 0}}],
        "start": {{"a": {{"phi": 0, "omega": 1}}}}, "until": 2, "every": 0.5}}"#
    );
    let rail = r#""sliders": [{"name": "S", "point": {"body": "a", "point": [1, 0]},
        "rail": {"body": "ground", "point": [0, 0], "direction": [1, 1]}}], "start": {"a": {"phi": 0.5, "omega": 1, "origin": [-0.4, 0], "velocity": [0, 0]}}"#;
    let hinge = tree.find("\"hinges\"").zip(tree.find("\"torsion_springs\"")).expect("both are there");
    let start = tree.find("\"start\"").zip(tree.find(", \"until\"")).expect("both are there");
    let on_rail = format!("{}{}{rail}{}", &tree[..hinge.0], &tree[hinge.1..start.0], &tree[start.1..]);
    let mut compared = 0;
    for text in [&tree, &on_rail] {
        let scene = scene(text);
        let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
        let (until, expected) = (scene.until, run(&scene, &adaptive(MethodId::Taylor, 1e-14)));
        for info in METHODS {
            let request = Request { method: Some(info.id), ..Request::default() };
            if Plan::new(&scene, &mechanism, &request).is_err() {
                continue;
            }
            let outcome = run(&scene, &request);
            assert!(outcome.stop.is_none(), "{}: {:?}", info.name, outcome.stop);
            let late = (outcome.last.t - until).abs();
            let off = (outcome.last.phi[0] - expected.last.phi[0]).abs();
            println!("{}: {late:e} s late, off by {off:e}", info.name);
            assert!(late < 1e-12, "{}: {late:e} s late", info.name);
            assert!(off < 1e-4, "{}: off by {off:e}", info.name);
            compared += 1;
        }
    }
    assert!(compared >= 28, "{compared} compared");
}

/// A rotor passes three events in every half turn at one and the same moment, each of which acts once.
#[test]
fn events_of_one_moment_act_once_each() {
    let more = r#""parameters": {"a": 1, "b": 1, "c": 1},
        "torques": [{"name": "T", "body": "bar", "torque": "1e-9*(a + b + c)"}],
        "events": [{"name": "A", "when": "bar.sin", "set": {"a": "-a"}},
            {"name": "B", "when": "bar.sin*(2 + bar.cos)", "set": {"b": "-b"}},
            {"name": "C", "when": "(1 + t)*bar.sin", "set": {"c": "-c"}}]"#;
    let (rate, until) = (1.7, 60.0);
    let scene = scene(&rotor([0.3, rate], until, more));
    let expected: Vec<f64> =
        (1..).map(|k| (f64::from(k) * PI - 0.3) / rate).take_while(|t| *t < until).collect();
    for method in [MethodId::Taylor, MethodId::Dp5, MethodId::Dp8, MethodId::Radau(5)] {
        for rtol in [1e-6, 1e-9, 1e-12] {
            let outcome = run(&scene, &adaptive(method, rtol));
            for name in ["A", "B", "C"] {
                let times: Vec<f64> =
                    outcome.events.iter().filter(|event| event.name == name).map(|event| event.t).collect();
                assert_eq!(times.len(), expected.len(), "{method} {rtol}, {name}: {times:?}");
                for (t, expected) in times.iter().zip(&expected) {
                    assert!(
                        (t - expected).abs() < 1e-4,
                        "{method} {rtol}, {name}: {t} instead of {expected}"
                    );
                }
            }
        }
    }
}

#[test]
fn released_runs_end_in_the_same_bits_however_sampled_and_resumed() {
    for request in [adaptive(MethodId::Taylor, 1e-12), adaptive(MethodId::Dp8, 1e-11)] {
        let whole = run(&scene(PENDULUM), &request);
        let mut fine = scene(PENDULUM);
        fine.every = 0.01;
        assert_eq!(run(&fine, &request).last.phi, whole.last.phi);
        let mechanism = Arc::new(Mechanism::new(&fine).expect("equations"));
        let start = mechanism.start(&fine);
        let plan = Plan::new(&fine, &mechanism, &request).expect("a plan");
        let run = Run::new(Arc::clone(&mechanism), plan, Limits::default(), &start).expect("a run");
        let (mut running, mut count, mut pauses) = (Running::new(run), 0, 0);
        loop {
            let mut pause = || {
                count += 1;
                count % 5 == 0
            };
            if running.go(&mut |_: &driftless::Sample| Ok(()), &mut pause).expect("samples") {
                break;
            }
            pauses += 1;
            let snapshot = serde_json::to_string(&running.snapshot()).expect("JSON");
            let snapshot = serde_json::from_str(&snapshot).expect("a snapshot");
            running = Running::resume(Arc::clone(&mechanism), &start, snapshot).expect("resumed");
        }
        assert!(pauses > 1);
        assert_eq!(running.finish().last.phi, whole.last.phi, "{:?}", request.method);
    }
}

#[test]
fn what_no_event_can_switch_is_refused_with_its_place() {
    let refused =
        |text: &str| driftless::scene::parse_scene(text, "test", &[]).expect_err("no scene").to_string();
    for list in ["on", "off"] {
        let said = refused(&PENDULUM.replace(r#""off": ["A"]"#, &format!(r#""{list}": ["B"]"#)));
        assert!(
            said.contains(&format!("events[0].{list}[0]")) && said.contains("hinge, motor, lock or wall"),
            "{said}"
        );
    }
}
