//! Springs whose laws are formulas of length and rate in the lanes of `taylor`: against the series of any
//! mechanism, which has the tape of their points, and against that in double-double.

use super::common::shipped;
use super::formulas::scene;
use super::taylor::{distance, end, on};
use driftless::Simulation;
use driftless::run::{MethodId, Request, Status, Sweep, SweepPoint, sweep};
use driftless::scene::{Scene, Template};
use driftless::stepping::Taylor;
use driftless::stepping::taylor::ExpansionKernel;

/// The double pendulum of `spring` with its spring under this law, another law from one bar to the other,
/// and a built-in damper beside.
fn sprung(law: &str, other: &str) -> Scene {
    let mut input = shipped("spring", &["until=2"]).to_input();
    let between = input["springs"][0]["between"].clone();
    let across = r#"[{"body": "bar1", "point": [0.2, 0.05]}, {"body": "bar2", "point": [0.5, 0]}]"#;
    input["springs"] = format!(
        r#"[{{"name": "own", "between": {between}, {law}}}, {{"name": "across", "between": {across}, {other}}},
        {{"name": "damper", "between": {between}, "stiffness": 0, "free_length": 0, "damping": 0.05}}]"#
    )
    .parse()
    .expect("JSON");
    input["parameters"] = r#"{"k": 7.4}"#.parse().expect("JSON");
    input["signals"] = r#"{"far": "1 + 0"}"#.parse().expect("JSON");
    scene(&input.to_string())
}

const LAWS: [[&str; 2]; 4] = [
    [r#""tension": "k*(length - 0.4)""#, r#""potential": "k*(length - 0.3)^2/2""#],
    [r#""potential": "k*(length - 0.4)^2/2 + 30*length^4""#, r#""tension": "0.3*rate + rate^3/50""#],
    [
        r#""tension": "3*sin(4*length) + 0.01*rate^2""#,
        r#""potential": "1*length^3", "tension": "0.1*length*rate + 1*log(1 + 1*length)""#,
    ],
    [
        r#""potential": "1*length^2", "tension": "far*(length - 0.4)*cos(1*length)""#,
        r#""tension": "0.2*cos(1*rate)""#,
    ],
];

/// With roots and angles, whose steps the equations confirm, not in lanes.
const CONFIRMED: [[&str; 2]; 2] = [
    [
        r#""tension": "3*sin(4*length) + 1*sqrt(1 + rate^2)""#,
        r#""potential": "1*length^3", "tension": "0.1*length*rate""#,
    ],
    [
        r#""potential": "1*length^2", "tension": "far*(length - 0.4) + 1*atan2(length, 2 - length)""#,
        r#""tension": "0.2*cos(1*rate)""#,
    ],
];

#[test]
fn laws_with_roots_and_angles_are_those_of_the_series() {
    for [law, other] in CONFIRMED {
        let scene = sprung(law, other);
        let fast = end(&scene, on(ExpansionKernel::Fastest, 1e-17, 20), 2.0);
        assert_eq!(fast, end(&scene, on(ExpansionKernel::Series, 1e-17, 20), 2.0), "{law}");
        let error = distance(&end(&scene, Taylor::reference(), 2.0), &fast);
        assert!(error < 1e-12, "{law}: {error:e}");
    }
}

#[test]
fn laws_in_lanes_agree_with_the_series_and_with_double_double() {
    for [law, other] in LAWS {
        let scene = sprung(law, other);
        let exact = end(&scene, Taylor::reference(), 2.0);
        for order in [16, 20, 24] {
            let series = end(&scene, on(ExpansionKernel::Series, 1e-17, order), 2.0);
            let fast = end(&scene, on(ExpansionKernel::Fastest, 1e-17, order), 2.0);
            assert_ne!(series, fast, "{law}: the lanes were not entered");
            let (apart, error) = (distance(&series, &fast), distance(&exact, &fast));
            assert!(apart < 1e-12 && error < 1e-12, "{law}, order {order}: {apart:e}, {error:e}");
            let portable = end(&scene, on(ExpansionKernel::Portable, 1e-17, order), 2.0);
            assert_eq!(fast, portable, "{law}, order {order}");
        }
    }
}

#[test]
fn the_error_falls_with_the_tolerance() {
    for [law, other] in LAWS.into_iter().chain(CONFIRMED) {
        let scene = sprung(law, other);
        let exact = end(&scene, Taylor::reference(), 2.0);
        let error = |kernel, tolerance| distance(&exact, &end(&scene, on(kernel, tolerance, 20), 2.0));
        let tolerances = [1e-6, 1e-9, 1e-12];
        let errors = tolerances.map(|tolerance| error(ExpansionKernel::Fastest, tolerance));
        let series = tolerances.map(|tolerance| error(ExpansionKernel::Series, tolerance));
        assert!(errors[0] > 30.0 * errors[1] && errors[1] > 30.0 * errors[2], "{law}: {errors:?}");
        let is_near = errors.iter().zip(&series).all(|(error, series)| *error < 10.0 * series + 1e-12);
        assert!(is_near, "{law}: {errors:?}, by the series of any mechanism {series:?}");
    }
}

/// A step from rest near equilibrium has no term to go by but what the stiffness of the law says.
#[test]
fn small_oscillations_about_equilibrium_keep_their_steps() {
    let text = |law: &str| {
        scene(&format!(
            r#"{{"name": "still", "gravity": [0, 0],
            "bars": [{{"name": "a", "length": 1, "mass": 1, "centre": [0.5, 0], "inertia": 0.1}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}}],
            "springs": [{{"name": "s", "between": [{{"body": "ground", "point": [1, -1]}}, {{"body": "a", "point": [1, 0]}}], {law}}}],
            "start": {{"a": {{"phi": 1e-7, "omega": 0}}}}, "until": 20, "every": 20}}"#
        ))
    };
    let own = text(r#""stiffness": 1e4, "free_length": 1, "damping": 0"#);
    let law = text(r#""tension": "1e4*(length - 1)""#);
    let exact = end(&own, Taylor::reference(), 20.0);
    for scene in [own, law] {
        let found = distance(&exact, &end(&scene, on(ExpansionKernel::Fastest, 1e-9, 20), 20.0));
        // The frequency is about 169 rad/s, the rate 1.7e-5 rad/s.
        assert!(found < 1e-6, "{found:e}");
    }
}

/// A cart on a rail that runs past the other end of its spring at a distance.
fn passing(spring: &str, distance: f64) -> String {
    format!(
        r#"{{"name": "passing", "gravity": [0, 0], "until": 1, "every": 0.25,
        "bars": [{{"name": "cart", "mass": 2, "centre": [0, 0], "inertia": 0.1, "length": 0.3}}],
        "sliders": [{{"name": "s", "point": {{"body": "cart", "point": [0, 0]}},
            "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}, "angle": "locked"}}],
        "springs": [{{"name": "S", "between": [{{"body": "ground", "point": [-1, {distance}]}},
            {{"body": "cart", "point": [0, 0]}}], {spring}}}],
        "start": {{"cart": {{"phi": 0, "omega": 0, "origin": [0.3, 0], "velocity": [-3, 0]}}}}}}"#
    )
}

/// The pull T = k (L - 0.9) alone, until the ends meet and from there on the other side.
const PULLS: [&str; 3] = [
    r#""tension": "2.7*(length-0.9)""#,
    r#""potential": "1.35*(length-0.9)^2""#,
    r#""stiffness": 2.7, "free_length": 0.9"#,
];

/// The time the ends would meet at, and the place of the cart at 1 s.
fn passed() -> (f64, f64) {
    let (w, free) = ((2.7_f64 / 2.0).sqrt(), 0.9);
    let length = |t: f64| free + 0.4 * (w * t).cos() - 3.0 / w * (w * t).sin();
    let speed = |t: f64| 0.4 * w * (w * t).sin() + 3.0 * (w * t).cos();
    let met = (0..8).fold(0.4, |t, _| t + length(t) / speed(t));
    let left = 1.0 - met;
    (met, -1.0 - (free - free * (w * left).cos() + speed(met) / w * (w * left).sin()))
}

#[test]
fn springs_whose_ends_nearly_meet_turn_their_pull_round() {
    let (_, expected) = passed();
    for pull in PULLS {
        let outcome = Simulation::new(&scene(&passing(pull, 1e-6))).expect("equations").run().expect("a run");
        assert_eq!(outcome.stop, None, "{pull}");
        let x = outcome.last.centre[0][0];
        assert!((x - expected).abs() < 2e-5, "{pull}: {x} for {expected}");
    }
}

#[test]
fn laws_whose_ends_meet_stop_where_a_spring_does() {
    let (met, _) = passed();
    for pull in PULLS {
        let outcome = Simulation::new(&scene(&passing(pull, 0.0))).expect("equations").run().expect("a run");
        let stop = outcome.stop.unwrap_or_else(|| panic!("{pull}: it went through"));
        assert_eq!(stop.cause.word(), "spring_without_length", "{pull}: {stop}");
        assert!((stop.t - met).abs() < 1e-6, "{pull}: {} for {met}", stop.t);
    }
}

#[test]
fn points_of_a_sweep_whose_ends_nearly_meet_are_runs() {
    let (met, expected) = passed();
    for pull in PULLS {
        let swept = |distance: f64| {
            let template = Template::new(passing(pull, distance), "passing".into(), &[]);
            let vary = vec!["bars.cart.inertia=0.1..0.2:3".parse().expect("a range")];
            let request = Request { method: Some(MethodId::Taylor), ..Request::default() };
            let (mut points, plan) = (Vec::new(), Sweep::new(&template, vary, &request).expect("a sweep"));
            sweep(&plan, 1, &mut |point: &SweepPoint| {
                points.push(point.clone());
                Ok(())
            })
            .expect("all points");
            points
        };
        for point in swept(1e-6) {
            let x = point.centres[0][0][0];
            assert!((x - expected).abs() < 2e-5, "{pull}: {x} for {expected}, {point:?}");
        }
        for point in swept(0.0) {
            let Status::Stopped(stop) = &point.status else { panic!("{pull}: {point:?}") };
            assert_eq!(stop.cause.word(), "spring_without_length", "{pull}: {stop}");
            assert!((stop.t - met).abs() < 1e-6, "{pull}: {} for {met}", stop.t);
        }
    }
}
