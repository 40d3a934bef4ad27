//! Springs whose laws are formulas of length and rate in the lanes of `taylor`: against the series of any
//! mechanism, which has the tape of their points, and against that in double-double.

use super::common::shipped;
use super::formulas::scene;
use super::taylor::{distance, end, on};
use driftless::scene::Scene;
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
