//! Stiff and extreme scenes: right, refused or stopped, and never wrong.

use crate::common;

use common::spring;
use driftless::dynamics::Mechanism;
use driftless::run::stress::{Case, Expected, Stress, Verdict, cell, shipped, stability, stress};
use driftless::run::{MethodId, Request, simulate};
use driftless::scene::{Place, Start, parse_scene};
use driftless::stepping::Cause;

fn method(name: &str) -> MethodId {
    name.parse().expect("a method")
}

fn case(name: &str) -> Case {
    shipped().into_iter().find(|case| case.name == name).expect("a shipped case")
}

#[test]
fn the_shipped_set_is_whole() {
    let cases = shipped();
    assert!(cases.len() >= 50);
    for case in &cases {
        let scene = parse_scene(&case.text, &case.origin, &[]).map_err(|error| error.to_string());
        match (&case.expected, scene) {
            (Expected::Refusal, scene) => {
                let refusal = scene
                    .and_then(|scene| Mechanism::new(&scene).map_err(|error| error.to_string()))
                    .expect_err(&case.name);
                assert!(refusal.len() > 20, "{}: {refusal}", case.name);
            }
            (expected, scene) => {
                let scene = scene.unwrap_or_else(|error| panic!("{error}"));
                assert_eq!(scene.name, case.name);
                assert!(Mechanism::new(&scene).is_ok(), "{}", case.name);
                if let Expected::End { angles, rates } = expected {
                    assert!(
                        angles.len() <= scene.bars.len() && (rates.is_empty() || rates.len() == angles.len()),
                        "{}",
                        case.name
                    );
                }
            }
        }
    }
}

#[test]
fn no_answer_is_wrong() {
    // The whole set by one method of each kind; `driftless stress` has them all.
    let methods: Vec<MethodId> = ["dp8", "taylor", "gauss16", "rattle4"].map(method).into();
    let plan = Stress { methods, max_evaluations: 200_000, ..Stress::default() };
    let lines = stress(&plan, &mut |_| true);
    assert_eq!(lines.len(), plan.cases.len());
    let cells = || lines.iter().flat_map(|line| line.cells.iter().map(move |cell| (line, cell)));
    for (line, cell) in cells() {
        assert_ne!(cell.verdict, Verdict::Wrong, "{} {cell:?}", line.scene);
        assert!(cell.evaluations < 2 * plan.max_evaluations, "{} {cell:?}", line.scene);
        if let Some(stop) = &cell.stop {
            assert!(
                !stop.what.is_empty() && !stop.hint.is_empty() && stop.t.is_finite(),
                "{} {cell:?}",
                line.scene
            );
        }
    }
    let right = |name: &str| {
        cells().filter(|(_, cell)| cell.method == name && cell.verdict == Verdict::Right).count()
    };
    let found = ["dp8", "taylor", "gauss16", "rattle4"].map(right);
    assert!(
        found[0] >= 48 && found[1] >= 48 && found[2] >= 32 && found[3] >= 20,
        "{found:?} of {}",
        lines.len()
    );
}

#[test]
fn a_wrong_answer_would_be_seen() {
    let mut lying = case("spring_1");
    if let Expected::End { angles, .. } = &mut lying.expected {
        angles[0] += 1e-3;
    }
    let seen = cell(&lying, method("dp8"), 100_000);
    assert_eq!(seen.verdict, Verdict::Wrong, "{seen:?}");
    assert!((seen.error.expect("an error") - 1e-3).abs() < 1e-6);
    // A success where there is no such motion is one, too.
    let impossible = Case { expected: Expected::Refusal, ..case("spring_1") };
    assert_eq!(cell(&impossible, method("dp8"), 100_000).verdict, Verdict::Wrong);
}

#[test]
fn cells_do_not_depend_on_the_number_of_threads() {
    let cases: Vec<Case> = ["spring_1", "spring_zero_length", "massless_bar", "motor_1"].map(case).into();
    let methods: Vec<MethodId> = ["dp5", "radau5", "gauss8", "rattle2"].map(method).into();
    let plan =
        |threads| Stress { cases: cases.clone(), methods: methods.clone(), max_evaluations: 20_000, threads };
    assert_eq!(stress(&plan(1), &mut |_| true), stress(&plan(3), &mut |_| true));
}

/// Two bodies that never turn: their ends are those of Kepler's equation, in positions and velocities.
#[test]
fn ends_of_bodies_that_only_translate_are_judged() {
    let text = std::fs::read_to_string("examples/scenes/kepler.json").expect("a shipped scene");
    let origin = "kepler.json".to_owned();
    let case = Case { name: "kepler".into(), origin, text, tolerance: 1e-4, expected: Expected::Unknown };
    let scene = parse_scene(&case.text, &case.origin, &[]).expect("a scene");
    let methods: Vec<MethodId> = ["rattle2", "rattle4", "dp5", "taylor"].map(method).into();
    let plan = Stress { cases: vec![case], methods: methods.clone(), max_evaluations: 100_000, threads: 1 };
    let lines = stress(&plan, &mut |_| true);
    // Relative motion from the far apsis; the centre of mass rests at a third.
    let (mu, far, speed) = (1.5_f64, 1.0_f64, 0.9_f64);
    let a = 1.0 / (2.0 / far - speed * speed / mu);
    let e = far / a - 1.0;
    let (b, n) = (a * (1.0 - e * e).sqrt(), (mu / a.powi(3)).sqrt());
    let mean = std::f64::consts::PI + n * scene.until;
    let anomaly = (0..50).fold(mean, |x, _| x - (x - e * x.sin() - mean) / (1.0 - e * x.cos()));
    let turning = n / (1.0 - e * anomaly.cos());
    let apart = [-a * (anomaly.cos() - e), -b * anomaly.sin()];
    let parting = [a * anomaly.sin() * turning, -b * anomaly.cos() * turning];
    let size = 0.1;
    for (cell, method) in lines[0].cells.iter().zip(methods) {
        assert!(matches!(cell.verdict, Verdict::Right | Verdict::Stopped), "{cell:?}");
        let setting = cell.setting.as_ref().expect("a setting");
        let number: f64 = setting.split(' ').nth(1).expect("a number").parse().expect("a number");
        let request = Request {
            method: Some(method),
            every: Some(scene.until / 100.0),
            step: setting.starts_with("--step").then_some(number),
            rtol: setting.starts_with("--rtol").then_some(number),
            ..Request::default()
        };
        let end = simulate(&scene, &request, &mut |_| Ok(())).expect("a run").last;
        let mut off = 0.0_f64;
        for (body, share) in [(0, -1.0 / 3.0), (1, 2.0 / 3.0)] {
            for axis in [0, 1] {
                let place = [1.0 / 3.0, 0.0][axis] + share * apart[axis];
                let velocity = share * parting[axis];
                let fast = (velocity / size).abs().max(1.0);
                off = off.max((end.centre[body][axis] - place).abs() / size);
                off = off.max((end.velocity[body][axis] - velocity).abs() / size / fast);
            }
        }
        let error = cell.error.expect("an error");
        println!("{method} {setting}: {:?}, {error:e}, by Kepler's equation {off:e}", cell.verdict);
        assert!((error - off).abs() < 1e-9 + 1e-3 * off, "{cell:?} {off:e}");
        assert_eq!(cell.verdict == Verdict::Right, off <= 1e-4 && cell.stop.is_none(), "{cell:?} {off:e}");
    }
}

#[test]
fn an_unconfirmed_end_is_a_stop() {
    // A chaotic scene beyond what doubles can tell.
    let mut unsure = case("aligned_horizontal");
    unsure.text = unsure.text.replace("\"until\": 2", "\"until\": 200");
    unsure.expected = Expected::Unknown;
    let seen = cell(&unsure, method("dp8"), 2_000_000);
    assert_eq!(seen.verdict, Verdict::Stopped, "{seen:?}");
    assert!(seen.stop.expect("a stop").what.contains("was asked for"));
}

#[test]
fn a_scene_without_a_known_end_gets_one() {
    let unknown = Case { expected: Expected::Unknown, ..case("spring_1") };
    let plan =
        Stress { cases: vec![unknown], methods: vec![method("dp8")], max_evaluations: 100_000, threads: 1 };
    let lines = stress(&plan, &mut |_| true);
    let found = lines[0].cells[0].error.expect("an error");
    let known = cell(&case("spring_1"), method("dp8"), 100_000).error.expect("an error");
    assert!((found - known).abs() < 1e-12, "{found:e} {known:e}");
}

/// A motion that an event ends is compared with the reference there, and at another time it is off by what
/// it does in between: a bar that turns freely at 2 rad/s reaches 1 rad at 0.5 s.
#[test]
fn a_motion_that_an_event_ends_is_judged_where_it_ends() {
    let text = r#"{"name": "stopped", "gravity": [0, -9.81], "until": 1, "every": 1,
        "bars": [{"name": "b", "mass": 1, "centre": [0.5, 0], "inertia": 0.1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}]}],
        "events": [{"name": "enough", "when": "t - 0.5", "action": "stop"}],
        "start": {"b": {"phi": 0.3, "omega": 0}}}"#;
    let case = |text: String| Case {
        name: "stopped".into(),
        origin: "stopped.json".into(),
        text,
        tolerance: 1e-6,
        expected: Expected::Unknown,
    };
    let turning = text
        .replace("-9.81", "0")
        .replace("t - 0.5", "b.phi - 1")
        .replace("\"phi\": 0.3, \"omega\": 0", "\"phi\": 0, \"omega\": 2");
    let cases = vec![case(text.to_owned()), case(turning.clone())];
    let methods: Vec<MethodId> = ["dp8", "taylor", "gauss8", "rattle4"].map(method).into();
    let plan = Stress { cases, methods, max_evaluations: 100_000, threads: 1 };
    for cell in stress(&plan, &mut |_| true).iter().flat_map(|line| &line.cells) {
        assert_eq!(cell.verdict, Verdict::Right, "{cell:?}");
        assert!(cell.error.is_some_and(|error| error < 1e-6), "{cell:?}");
    }
    // The same place half a millisecond later would be off by 2 rad/s times that.
    let (coordinates, rates) = (vec![1.0], vec![2.0]);
    let late = Expected::Motion { t: 0.5005, coordinates, rates };
    let seen = cell(&Case { expected: late, ..case(turning) }, method("dp8"), 100_000);
    let off = seen.error.expect("an error");
    assert!(seen.verdict == Verdict::Wrong && (off - 1e-3).abs() < 1e-9, "{seen:?}");
}

#[test]
fn a_spring_that_loses_its_length_stops_every_method_that_shows_its_steps() {
    for name in ["dp5", "dp8", "taylor", "radau5", "gauss4", "gauss16", "rattle2", "rattle8"] {
        let seen = cell(&case("spring_zero_length"), method(name), 100_000);
        let stop = seen.stop.unwrap_or_else(|| panic!("{name} did not stop: {:?}", seen.error));
        assert_eq!(stop.cause, Cause::SpringWithoutLength, "{name}: {stop}");
        assert!(stop.what.contains("`spring`") && (stop.t - 0.0953).abs() < 1e-3, "{name}: {stop}");
        // A tenth of a millimetre is a length.
        let near = cell(&case("spring_near_zero_length"), method(name), 50_000);
        assert!(near.stop.is_none_or(|stop| stop.cause != Cause::SpringWithoutLength), "{name}");
    }
}

#[test]
fn springs_whose_ends_cannot_meet_change_nothing() {
    // With its other end 1e-12 m too far away the spring is not looked after, and the motion is the same.
    let mut scene = common::free();
    scene.start = vec![Start { phi: 0.5, omega: 0.0 }, Start { phi: 0.2, omega: 0.0 }];
    let mut end = |x: f64| {
        let ground = Place { bar: None, point: [x, 0.0] };
        let bar = Place { bar: Some(0), point: [0.4, 0.0] };
        scene.springs = vec![driftless::scene::Spring { between: [ground, bar], ..spring(0.0) }];
        let request = Request { method: Some(method("taylor")), until: Some(1.0), ..Request::default() };
        simulate(&scene, &request, &mut |_| Ok(())).expect("a run")
    };
    let (watched, free) = (end(-0.4), end(-0.4 - 1e-8));
    assert_eq!(watched.statistics.steps, free.statistics.steps);
    assert!((watched.last.phi[0] - free.last.phi[0]).abs() < 1e-6);
}

#[test]
fn steps_too_long_for_a_stiff_spring_stop_or_say_so() {
    let map = stability(method("gauss4"), &mut |_, _| true).expect("a map");
    assert_eq!(map.cells.len(), map.steps * map.stiffnesses);
    let soft = &map.cells[..map.steps];
    assert!(soft[0].error.is_some_and(|error| error < 1e-10), "{:?}", soft[0]);
    // Order 4: halving the step takes the error to a sixteenth.
    let errors: Vec<f64> =
        soft.iter().filter_map(|cell| cell.error).filter(|error| (1e-9..1e-3).contains(error)).collect();
    assert!(errors.windows(2).all(|pair| (8.0..32.0).contains(&(pair[1] / pair[0]))), "{errors:?}");
}
