//! Sensitivities against closed forms, against differences of reference motions in double-double, and the sums
//! of Lyapunov spectra.

use crate::mechanisms::{Dice, scene as random_scene};
use crate::outputs::EQUAL_SLIDER_CRANK;
use driftless::dynamics::{Mechanism, Time};
use driftless::run::reference;
use driftless::scene::Output;
use driftless::{Measure, Regime, Sensitivity, SensitivityRequest, Template, lyapunov, sensitivity};
use std::collections::BTreeMap;
use std::sync::Arc;

pub fn template(text: &str) -> Template {
    Template::new(text.into(), "scene.json".into(), &[])
}

pub fn example(name: &str) -> Template {
    Template::read(format!("examples/scenes/{name}.json").as_ref(), &[]).expect("a shipped scene")
}

pub fn derived(template: &Template, of: &[&str], to: &[&str], at: f64) -> Sensitivity {
    let request = SensitivityRequest {
        of: of.iter().map(|text| text.parse::<Measure>().expect("a measure")).collect(),
        to: to.iter().map(|path| (*path).to_owned()).collect(),
        at: Some(at),
        ..SensitivityRequest::default()
    };
    sensitivity(template, &request, &mut || false).unwrap_or_else(|error| panic!("{error}"))
}

pub fn assert_near(found: f64, expected: f64, tolerance: f64, what: &str) {
    let size = expected.abs().max(1e-3);
    assert!((found - expected).abs() <= tolerance * size, "{what}: {found:e} instead of {expected:e}");
}

/// Values of measures, and their derivatives by two numbers to a tolerance.
fn assert_measures(found: &Sensitivity, expected: &[(f64, [f64; 2])], tolerance: f64) {
    for (measure, (value, slopes)) in found.measures.iter().zip(expected) {
        assert_near(measure.value, *value, 1e-9, &measure.name);
        assert_eq!(measure.slopes.len(), 2, "{}: {:?}", measure.name, measure.why);
        let slopes = measure.slopes.iter().zip(slopes);
        slopes.for_each(|(found, expected)| assert_near(*found, *expected, tolerance, &measure.name));
    }
}

/// K and E of modulus k, by the arithmetic-geometric mean.
fn elliptic(k: f64) -> [f64; 2] {
    let (mut a, mut b, mut sum, mut power) = (1.0_f64, (1.0 - k * k).sqrt(), 0.5 * k * k, 0.5);
    for _ in 0..12 {
        let c = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        power *= 2.0;
        sum += power * c * c;
    }
    let complete = std::f64::consts::FRAC_PI_2 / a;
    [complete, complete * (1.0 - sum)]
}

#[test]
fn an_oscillation_is_derived_by_all_its_numbers() {
    let scene = template(
        r#"{"name": "oscillator", "gravity": [0, 0],
            "bars": [{"name": "bar", "mass": 2, "centre": [0, 0], "inertia": 0.5, "length": 0.6}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
            "torsion_springs": [{"name": "s", "body": "bar", "stiffness": 3, "free_angle": 0.2}],
            "start": {"bar": {"phi": 0.7, "omega": -0.4}}, "until": 5, "every": 0.1}"#,
    );
    let to = ["bar.phi", "bar.omega", "s.stiffness", "s.free_angle", "bars.bar.inertia", "bars.bar.mass"];
    let t = 4.3;
    let found = derived(&scene, &["bar.phi", "bar.omega", "bar.alpha"], &to, t);
    assert!(found.by_series);
    let (k, inertia, x, v) = (3.0_f64, 0.5_f64, 0.5, -0.4);
    let w = (k / inertia).sqrt();
    let (s, c) = ((w * t).sin(), (w * t).cos());
    let by_w = -x * t * s + v * t * c / w - v * s / (w * w);
    let expected = [c, s / w, by_w * 0.5 * w / k, 1.0 - c, -by_w * 0.5 * w / inertia, 0.0];
    for (j, expected) in expected.into_iter().enumerate() {
        assert_near(found.measures[0].slopes[j], expected, 1e-10, to[j]);
    }
    assert_near(found.measures[1].slopes[0], -w * s, 1e-10, "rate by angle");
    assert_near(found.measures[2].slopes[0], -w * w * c, 1e-10, "acceleration by angle");
}

#[test]
fn the_quarter_period_of_a_pendulum_is_derived_by_amplitude_and_gravity() {
    let scene = template(
        r#"{"name": "pendulum", "gravity": [9.81, 0],
            "bars": [{"name": "bar", "mass": 2, "centre": [0.5, 0], "inertia": 0, "length": 0.5}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
            "events": [{"name": "bottom", "when": "bar.phi"}],
            "start": {"bar": {"phi": 1.9, "omega": 0}}, "until": 2, "every": 0.1}"#,
    );
    let found = derived(&scene, &["event:bottom", "min:bar.omega"], &["bar.phi", "gravity[0]"], 1.0);
    assert!(found.by_series);
    let (k, rate) = ((0.95_f64).sin(), (9.81_f64 / 0.5).sqrt());
    let [complete, second] = elliptic(k);
    assert_near(found.measures[0].value, complete / rate, 1e-12, "quarter period");
    let by_k = (second - (1.0 - k * k) * complete) / (k * (1.0 - k * k));
    assert_near(found.measures[0].slopes[0], by_k * 0.5 * 0.95_f64.cos() / rate, 1e-10, "by amplitude");
    assert_near(found.measures[0].slopes[1], -0.5 * complete / rate / 9.81, 1e-10, "by gravity");
    // The fastest rate is that at the bottom: w² = 2 g (1 - cos a)/l.
    let fastest = -(2.0 * 9.81 * (1.0 - 1.9_f64.cos()) / 0.5).sqrt();
    assert_near(found.measures[1].value, fastest, 1e-10, "fastest");
    assert_near(
        found.measures[1].slopes[0],
        9.81 * 1.9_f64.sin() / 0.5 / fastest,
        1e-9,
        "fastest by amplitude",
    );
}

#[test]
fn a_ball_is_derived_through_its_impact() {
    let scene = template(
        r#"{"name": "ball", "gravity": [0, -9.81],
            "bars": [{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 0.2}],
            "walls": [{"name": "floor", "body": "ball", "point": [0, 0], "line": {"through": [0, 0.1], "normal": [0, 1]}, "restitution": 0.7}],
            "start": {"ball": {"phi": 0, "omega": 0, "origin": [0, 1.3], "velocity": [0, 0]}}, "until": 1, "every": 0.1}"#,
    );
    let to = ["start.ball.origin[1]", "gravity[1]", "floor.restitution", "walls.floor.line.through[1]"];
    let t = 0.8;
    let found = derived(&scene, &["ball.y", "ball.vy", "impact:floor"], &to, t);
    assert!(found.by_series);
    let (g, h, e) = (9.81_f64, 1.2_f64, 0.7);
    let (fall, speed) = ((2.0 * h / g).sqrt(), (2.0 * g * h).sqrt());
    let (after, rate) = (t - fall, e * speed - g * (t - fall));
    let by_height = e * g / speed * after - rate / speed;
    let by_gravity = e * h / speed * after - 0.5 * after * after + rate * 0.5 * fall / g;
    let expected = [by_height, -by_gravity, speed * after, 1.0 - by_height];
    for (j, expected) in expected.into_iter().enumerate() {
        assert_near(found.measures[0].slopes[j], expected, 1e-9, to[j]);
    }
    assert_near(found.measures[1].slopes[0], e * g / speed + g / speed, 1e-9, "rate by height");
    assert_near(found.measures[2].value, fall, 1e-12, "impact");
    assert_near(found.measures[2].slopes[0], 1.0 / speed, 1e-9, "impact by height");
    assert_near(found.measures[2].slopes[1], 0.5 * fall / g, 1e-9, "impact by gravity");
}

/// A torque with a corner has no series across it: the columns are integrated by collocation.
#[test]
fn an_oscillation_that_is_let_go_is_derived_through_the_corner() {
    let scene = template(
        r#"{"name": "let_go", "gravity": [0, 0],
            "bars": [{"name": "bar", "mass": 2, "centre": [0, 0], "inertia": 0.5, "length": 0.6}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
            "parameters": {"k": 3},
            "torques": [{"name": "t", "body": "bar", "torque": "-k*max(bar.phi, 0)"}],
            "start": {"bar": {"phi": 0.7, "omega": -0.4}}, "until": 5, "every": 0.1}"#,
    );
    let t = 2.0;
    let found = derived(&scene, &["bar.phi", "bar.omega"], &["bar.phi", "bar.omega", "k"], t);
    assert!(!found.by_series);
    // x = A cos(w t + d) until x = 0 at t1, then -A w (t - t1).
    let (k, inertia, x, v) = (3.0_f64, 0.5_f64, 0.7_f64, -0.4_f64);
    let w = (k / inertia).sqrt();
    let (size, phase) = (x.hypot(v / w), (-v / w).atan2(x));
    let met = (std::f64::consts::FRAC_PI_2 - phase) / w;
    let square = size * size;
    for (j, [by_size, by_phase, by_w]) in [
        [x / size, v / w / square, 0.0],
        [v / (w * w) / size, -x / w / square, 0.0],
        [-v * v / w.powi(3) / size, x * v / (w * w) / square, 1.0],
    ]
    .into_iter()
    .enumerate()
    {
        let share = if j == 2 { 0.5 * w / k } else { 1.0 };
        let rate = -(by_size * w + size * by_w) * share;
        let later = (-by_phase / w - met / w * by_w) * share;
        assert_near(found.measures[0].slopes[j], rate * (t - met) + size * w * later, 1e-9, "angle");
        assert_near(found.measures[1].slopes[j], rate, 1e-9, "rate");
    }
}

/// A number that stands at several places, and one that is asked for twice.
#[test]
fn a_parameter_moves_every_formula_it_is_in() {
    let scene = template(
        r#"{"name": "twice", "gravity": [0, 0],
            "bars": [{"name": "bar", "mass": 2, "centre": [0, 0], "inertia": "a^2", "length": 0.6}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
            "parameters": {"a": 0.8},
            "torques": [{"name": "t", "body": "bar", "torque": "-a*bar.phi"}],
            "start": {"bar": {"phi": 0.7, "omega": 0}}, "until": 5, "every": 0.1}"#,
    );
    let t = 3.1;
    let found = derived(&scene, &["bar.phi"], &["a", "bar.phi", "a"], t);
    assert!(found.by_series);
    // x = x0 cos(w t), w² = a/a².
    let w = 0.8_f64.powf(-0.5);
    let expected = 0.7 * t * (w * t).sin() * 0.5 * w / 0.8;
    for (slope, expected) in found.measures[0].slopes.iter().zip([expected, (w * t).cos(), expected]) {
        assert_near(*slope, expected, 1e-10, "parameter");
    }
}

/// 0.5 kg·m² on a spring: a number that an event sets, and rows at the very time of the event.
#[test]
fn a_number_that_an_event_sets_is_derived_and_rows_there_show_what_comes_after() {
    let scene = template(
        r#"{"name": "set", "gravity": [0, 0], "parameters": {"k": 2},
            "bars": [{"name": "bar", "mass": 2, "centre": [0, 0], "inertia": 0.5, "length": 0.6}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
            "torques": [{"name": "t", "body": "bar", "torque": "-k*bar.phi"}],
            "locks": [{"name": "brake", "body": "bar"}], "inactive": ["brake"],
            "events": [{"name": "e", "when": "t - 1", "set": {"k": 3}}, {"name": "on", "when": "t - 2", "on": ["brake"]}],
            "start": {"bar": {"phi": 0.7, "omega": 0.2}}, "until": 3, "every": 0.5}"#,
    );
    let moved = |k: f64, [x, v]: [f64; 2], t: f64| {
        let w = (k / 0.5_f64).sqrt();
        let (sin, cos) = (w * t).sin_cos();
        [x * cos + v / w * sin, v * cos - x * w * sin]
    };
    let motion = |set: f64, t: f64| moved(set, moved(2.0, [0.7, 0.2], 1.0), t - 1.0);
    let by_set = |t: f64| [0, 1].map(|k| (motion(3.0 + 1e-5, t)[k] - motion(3.0 - 1e-5, t)[k]) / 2e-5);
    let found = derived(&scene, &["bar.phi", "bar.omega"], &["events.e.set.k"], 1.7);
    for k in [0, 1] {
        assert_near(found.measures[k].value, motion(3.0, 1.7)[k], 1e-12, "value");
        assert_near(found.measures[k].slopes[0], by_set(1.7)[k], 1e-8, "slope");
    }
    // At the event the torque is the new one, and from the brake on there is no rate.
    let there = derived(&scene, &["bar.alpha"], &["events.e.set.k"], 1.0);
    let angle = moved(2.0, [0.7, 0.2], 1.0)[0];
    assert_near(there.measures[0].value, -3.0 * angle / 0.5, 1e-12, "acceleration");
    assert_near(there.measures[0].slopes[0], -angle / 0.5, 1e-9, "its slope");
    for at in [2.0, 2.4] {
        let braked = derived(&scene, &["bar.phi", "bar.omega"], &["events.e.set.k"], at);
        assert_near(braked.measures[0].slopes[0], by_set(2.0)[0], 1e-8, "angle");
        assert_eq!(
            [braked.measures[1].value, braked.measures[1].slopes[0]].map(|x| x.abs() < 1e-12),
            [true; 2]
        );
    }
}

/// A weak torsion spring over hundreds of turns: the place of a point by the start rate, in closed form.
#[test]
fn outputs_are_derived_after_many_turns() {
    let scene = template(
        r#"{"name": "spun", "gravity": [0, 0],
            "bars": [{"name": "bar", "mass": 0.5, "centre": [0.3, 0], "inertia": 0.015, "length": 0.6}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
            "points": [{"name": "tip", "body": "bar", "point": [0.6, 0]}],
            "torsion_springs": [{"name": "k", "body": "bar", "stiffness": 1e-6, "free_angle": 0}],
            "start": {"bar": {"phi": 0, "omega": 100}}, "until": 10, "every": 1}"#,
    );
    let w = (1e-6_f64 / (0.015 + 0.5 * 0.3 * 0.3)).sqrt();
    for rate in [30.0, 100.0, 1000.0] {
        let found = derived(
            &scene.with_values(&[scene.variable("bar.omega").expect("a number")], &[rate]),
            &["tip.x"],
            &["bar.omega"],
            10.0,
        );
        let angle = rate * (w * 10.0).sin() / w;
        assert_near(found.measures[0].slopes[0], -0.6 * angle.sin() * (w * 10.0).sin() / w, 1e-8, "place");
    }
}

/// A ball that falls onto a table that vibrates fast: its end by the height it fell from, in closed form.
#[test]
fn impacts_at_a_fast_wall_are_derived() {
    for (frequency, amplitude) in [(400.0_f64, 1e-3_f64), (2e3, 1e-3), (2e4, 1e-4)] {
        let scene = template(&format!(
            r#"{{"name": "table", "gravity": [0, -9.81],
            "bars": [{{"name": "b", "mass": 0.5, "centre": [0, 0], "inertia": 0.015, "length": 0.6}}],
            "sliders": [{{"name": "S", "point": {{"body": "b", "point": [0, 0]}},
                "rail": {{"body": "ground", "point": [0, 0], "direction": [0, 1]}}, "angle": "locked"}}],
            "points": [{{"name": "p", "body": "b", "point": [0, 0]}}],
            "walls": [{{"name": "W", "body": "b", "point": [0, 0], "line": {{"through": [0, 0], "normal": [0, 1]}},
                "restitution": 0.8, "law": {{"start": 0, "sines": [{{"amplitude": {amplitude}, "frequency": {frequency}}}]}}}}],
            "start": {{"b": {{"phi": 0, "origin": [0, 1], "velocity": [0, 0]}}}}, "until": 0.5, "every": 0.1}}"#
        ));
        let (g, e, end) = (9.81, 0.8, 0.5);
        let closing = |t: f64| g * t + amplitude * frequency * (frequency * t).cos();
        let met = (0..60)
            .fold(0.45, |t, _| t + (1.0 - 0.5 * g * t * t - amplitude * (frequency * t).sin()) / closing(t));
        let wall = amplitude * frequency * (frequency * met).cos();
        let (after, left) = (e * g * met + (1.0 + e) * wall, end - met);
        let by_time = e * g - (1.0 + e) * amplitude * frequency * frequency * (frequency * met).sin();
        let expected = [by_time + g, wall + by_time * left - after + g * left].map(|x| x / closing(met));
        let found = derived(&scene, &["p.vy", "p.y"], &["b.origin[1]"], end);
        for (measured, expected) in found.measures.iter().zip(expected) {
            assert_near(
                measured.slopes[0],
                expected,
                1e-7,
                &format!("{} at {frequency} rad/s", measured.name),
            );
        }
    }
}

/// 0.5 kg·m² on a spring of 2 N·m, pulled by a signal, an integral over time and a table, each by a number.
#[test]
fn numbers_of_signals_integrals_and_tables_are_derived() {
    let scene = template(
        r#"{"name": "numbers", "gravity": [0, 0],
            "bars": [{"name": "bar", "mass": 2, "centre": [0, 0], "inertia": 0.5, "length": 0.6}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
            "signals": {"sig": 0.35}, "integrals": {"sum": 0.25},
            "tables": {"gust": [[0, 0.1], [1, 0.5], [2, 0.2], [4, 0.3]]},
            "torques": [{"name": "t", "body": "bar", "torque": "-2*bar.phi + sig + 0.1*sum + gust(t)"}],
            "start": {"bar": {"phi": 0.7, "omega": 0.2}}, "until": 3, "every": 0.5}"#,
    );
    let t = 2.3;
    let to = ["signals.sig", "integrals.sum", "tables.gust[1][1]", "tables.gust[2][0]"];
    let found = derived(&scene, &["bar.phi"], &to, t);
    let w = 2.0_f64;
    let closed = [(1.0 - (w * t).cos()) / 2.0, 0.1 * (t - (w * t).sin() / w) / 2.0];
    for (slope, expected) in found.measures[0].slopes.iter().zip(closed) {
        assert_near(*slope, expected, 1e-9, "closed form");
    }
    for (j, value) in [(2, 0.5), (3, 2.0)] {
        let expected = differences(&scene, to[j], value, t, 1e-4).expect("a difference")[0];
        assert_near(found.measures[0].slopes[j], expected, 1e-6, to[j]);
    }
}

/// 0.64 kg·m² on a spring of 0.8 N·m: x = x0 cos(w t), w² = k/I.
/// There are no coordinates left to integrate.
#[test]
fn what_is_driven_is_derived_by_its_law() {
    let text = r#"{"name": "driven", "gravity": [9.81, 0],
        "bars": [{"name": "bar", "length": 0.6, "width": 0.05, "thickness": 0.003, "density": 670}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
        "motors": [{"name": "motor", "body": "bar", "law": {"start": 0.5, "rate": 2.0}}],
        "until": 3, "every": 0.5}"#;
    let found =
        derived(&template(text), &["bar.phi"], &["motors.motor.law.rate", "motors.motor.law.start"], 1.5);
    assert_near(found.measures[0].slopes[0], 1.5, 1e-11, "rate");
    assert_near(found.measures[0].slopes[1], 1.0, 1e-11, "start");
}

/// What only the motor of a slider-crank feels leaves its motion alone: dT/dk = (s - s0) ds/dphi by virtual work.
#[test]
fn a_driven_linkage_is_derived_by_what_only_its_motor_feels() {
    let scene = template(
        r#"{"name": "press", "gravity": [0, -3],
            "bars": [{"name": "crank", "mass": 0.7, "centre": [0.15, 0], "inertia": 0.01, "length": 0.3},
                {"name": "rod", "mass": 1.4, "centre": [0.4, 0], "inertia": 0.08, "length": 0.8}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "crank", "point": [0, 0]}]},
                {"name": "B", "between": [{"body": "crank", "point": [0.3, 0]}, {"body": "rod", "point": [0, 0]}]}],
            "sliders": [{"name": "S", "point": {"body": "rod", "point": [0.8, 0]},
                "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}}],
            "springs": [{"name": "spring", "between": [{"body": "ground", "point": [2, 0]}, {"body": "rod", "point": [0.8, 0]}],
                "stiffness": 38, "free_length": 0.7}],
            "motors": [{"name": "motor", "body": "crank", "law": {"start": 0.5, "rate": 1.5}}],
            "start": {"rod": {"phi": -0.18}}, "until": 2, "every": 0.1}"#,
    );
    let found = derived(&scene, &["motor.torque", "rod.phi", "rod.omega"], &["spring.stiffness"], 2.0);
    let (phi, r, l) = (3.5_f64, 0.3, 0.8);
    let along = (l * l - r * r * phi.sin().powi(2)).sqrt();
    let (x, by_phi) = (r * phi.cos() + along, -r * phi.sin() - r * r * phi.sin() * phi.cos() / along);
    assert_near(found.measures[0].slopes[0], -(2.0 - x - 0.7) * by_phi, 1e-9, "torque by stiffness");
    for measure in &found.measures[1..] {
        assert!(measure.slopes[0].abs() < 1e-12, "{}: {:e}", measure.name, measure.slopes[0]);
    }
}

#[test]
fn numbers_with_units_are_numbers() {
    let scene = template(
        r#"{"name": "units", "gravity": [0, 0], "parameters": {"k": "800 N*mm", "soft": "k/2"},
            "bars": [{"name": "bar", "mass": 2, "centre": [0, 0], "inertia": 0.64, "length": 0.6}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
            "torques": [{"name": "t", "body": "bar", "torque": "-2*soft*bar.phi"}],
            "start": {"bar": {"phi": "40 deg", "omega": 0}}, "until": 5, "every": 0.1}"#,
    );
    let (t, start, w) = (3.1, 40.0_f64.to_radians(), 1.25_f64.sqrt());
    let found = derived(&scene, &["bar.phi"], &["k", "bar.phi"], t);
    let expected = [-start * t * (w * t).sin() * 0.5 * w / 0.8, (w * t).cos()];
    for (slope, expected) in found.measures[0].slopes.iter().zip(expected) {
        assert_near(*slope, expected, 1e-10, "number with a unit");
    }
    let units: Vec<&str> = found.inputs.iter().map(|input| input.unit.as_str()).collect();
    assert_eq!(units, ["J", "rad"]);
    for (written, unit) in [("60 cm", "m"), ("30 deg", "rad"), ("-10 rpm", "1/s"), ("2 N*s/m", "kg/s")] {
        let parts = format!(
            r#"{{"name": "p", "gravity": [0, 0], "parameters": {{"k": "{written}"}},
            "bars": [{{"name": "bar", "mass": 2, "centre": [0, 0], "inertia": 0.64}}],
            "start": {{"bar": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}}}},
            "until": 5, "every": 0.1}}"#
        );
        assert_eq!(template(&parts).unit("k").expect("a unit"), unit, "{written}");
    }
    let request = SensitivityRequest {
        of: vec!["bar.phi".parse().expect("a measure")],
        to: vec!["soft".into()],
        ..SensitivityRequest::default()
    };
    let error = sensitivity(&scene, &request, &mut || false).expect_err("a formula").to_string();
    assert!(error.contains("parameters.soft is not a number written in the scene"), "{error}");
}

/// Angles and rates at a time of the reference motion with another value of a number.
fn reference_at(template: &Template, path: &str, value: f64, at: f64) -> Option<Vec<f64>> {
    let variable = template.variable(path).ok()?;
    let scene = template.filled(&[variable], &[value]).ok()?;
    let mechanism = Arc::new(Mechanism::new(&scene).ok()?);
    let found = reference(&mechanism, &mechanism.start(&scene), &[Time::from(at)]).ok()?;
    let bodies = scene.bars.len();
    let motion = found.motions.first()?;
    Some((0..bodies).map(|k| motion.unwrapped(k)).chain((0..bodies).map(|k| motion.omega[k].hi)).collect())
}

/// Differences of the sixth order of reference motions, with their own uncertainty: none where neighbours stop.
fn differences(template: &Template, path: &str, value: f64, at: f64, share: f64) -> Option<Vec<f64>> {
    // Of numbers near zero the unit is what neighbours differ by.
    let h = share * if value.abs() < 1e-9 { 1.0 } else { value.abs() };
    let mut sum: Vec<f64> = Vec::new();
    for (k, weight) in [(1.0, 0.75), (2.0, -0.15), (3.0, 1.0 / 60.0)] {
        let more = reference_at(template, path, value + k * h, at)?;
        let less = reference_at(template, path, value - k * h, at)?;
        sum.resize(more.len(), 0.0);
        for (sum, (more, less)) in sum.iter_mut().zip(more.iter().zip(&less)) {
            *sum += weight * (more - less) / h;
        }
    }
    Some(sum)
}

/// The largest relative difference of derivatives of all angles and rates from differences of references, and
/// how far these themselves are known; none where there are none.
pub fn compared(template: &Template, paths: &[&str], at: f64) -> Result<Vec<(String, f64, f64)>, String> {
    let scene = template.scene().map_err(|error| error.to_string())?;
    let names: Vec<String> = ["phi", "omega"]
        .iter()
        .flat_map(|what| scene.bars.iter().map(move |bar| format!("{}.{what}", bar.name)))
        .collect();
    let request = SensitivityRequest {
        of: names.iter().map(|name| name.parse().expect("a measure")).collect(),
        to: paths.iter().map(|path| (*path).to_owned()).collect(),
        at: Some(at),
        ..SensitivityRequest::default()
    };
    let found = sensitivity(template, &request, &mut || false).map_err(|error| error.to_string())?;
    if let Some(lost) = &found.lost {
        return Err(lost.clone());
    }
    let mut all = Vec::new();
    for (j, input) in found.inputs.iter().enumerate() {
        let own: Vec<f64> = found.measures.iter().map(|measured| measured.slopes[j]).collect();
        let size = own.iter().fold(0.0, |most: f64, slope| most.max(slope.abs()));
        // Angles and rates of which none moves by more than rounding.
        if size * input.value.abs().max(1e-3) < 1e-8 {
            continue;
        }
        let by = |share: f64| differences(template, &input.path, input.value, at, share);
        let apart = |a: &[f64], b: &[f64]| {
            a.iter().zip(b).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) / size
        };
        let mut best: Option<(f64, f64)> = None;
        let mut before: Option<Vec<f64>> = None;
        for share in [3e-3, 5e-4, 1e-4, 2e-5, 4e-6] {
            let now = by(share);
            if let (Some(before), Some(now)) = (&before, &now) {
                let doubt = apart(before, now);
                if best.is_none_or(|(least, _)| doubt < least) {
                    best = Some((doubt, apart(now, &own)));
                }
            }
            before = now;
        }
        if let Some((doubt, off)) = best {
            all.push((input.path.clone(), off, doubt));
        }
    }
    Ok(all)
}

#[test]
fn derivatives_of_every_kind_of_scene_agree_with_differences_of_references() {
    for (name, at, paths) in [
        ("spring", 2.0, &["spring.stiffness", "bar1.phi", "bars.bar2.density", "gravity[0]"][..]),
        ("motor_sine", 2.0, &["motors.motor.law.sines[0].frequency", "bar2.omega", "B.between[0].point[0]"]),
        ("four_bars", 0.8, &["gravity[1]"]),
        ("slider_crank_torque", 0.5, &["gravity[1]"]),
        ("wall", 0.8, &["wall.restitution", "bar1.omega"]),
    ] {
        let template = example(name);
        let paths: Vec<&str> = paths.iter().copied().filter(|path| template.variable(path).is_ok()).collect();
        let found = compared(&template, &paths, at).unwrap_or_else(|why| panic!("{name}: {why}"));
        for (path, off, doubt) in found {
            println!("{name} {path}: {off:.1e}, known to {doubt:.1e}");
            // Impacts of references are located in doubles.
            let known: f64 = if name == "wall" { 1e-6 } else { 1e-8 };
            assert!(off < known.max(3.0 * doubt) && doubt < 1e-5, "{name} {path}: {off:e} {doubt:e}");
        }
    }
}

/// Random scenes of every kind: `CASES` of them from seed `SEED` on; `FOUND` names a folder for the scenes of those
/// that are outside.
#[test]
fn derivatives_of_random_scenes_agree_with_differences_of_references() {
    let number =
        |name: &str, usual: u64| std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(usual);
    let (cases, seed) = (number("CASES", 3), number("SEED", 1));
    let (mut table, mut refused) = (BTreeMap::new(), BTreeMap::<String, usize>::new());
    let (mut worst, mut count, mut outside) = (0.0_f64, 0, 0);
    for case in 0..cases {
        let generated = random_scene(90_000 + seed * 1000 + case);
        let template = template(&generated.text);
        let numbers = template.written_numbers(&[]).expect("a scene");
        let mut dice = Dice::new(seed * 7919 + case);
        let paths: Vec<&str> = (0..3).map(|_| numbers[dice.pick(numbers.len())].path.as_str()).collect();
        let found = match compared(&template, &paths, 3.0 * generated.scales.time) {
            Ok(found) => found,
            Err(why) => {
                let why = why.split(", at t").next().unwrap_or_default().chars().take(90).collect();
                *refused.entry(why).or_default() += 1;
                continue;
            }
        };
        for (path, off, doubt) in found {
            let is_wall = generated.kinds.iter().any(|kind| kind.is_wall());
            let known: f64 = if is_wall { 1e-6 } else { 1e-8 };
            if doubt > 1e-3 * known.max(1e-7) && doubt > 1e-9 {
                continue;
            }
            count += 1;
            worst = worst.max(off);
            outside += usize::from(off > known);
            if off > known {
                println!("seed {case} {path}: {off:.1e}, known to {doubt:.1e}; {:?}", generated.kinds);
                if let Some(folder) = std::env::var_os("FOUND") {
                    let file = std::path::Path::new(&folder).join(format!("{seed}-{case}.json"));
                    std::fs::write(file, &generated.text).expect("a folder for scenes");
                }
            }
            for kind in &generated.kinds {
                let row: &mut (usize, f64) = table.entry(kind.name()).or_default();
                *row = (row.0 + 1, row.1.max(off));
            }
        }
    }
    for (kind, (count, worst)) in &table {
        println!("{kind:28} {count:5} {worst:9.1e}");
    }
    println!("{count} derivatives, {outside} outside, worst {worst:.1e}; refused: {refused:?}");
    assert!(outside * 100 <= count, "{outside} of {count} outside");
}

#[test]
fn spectra_add_up_to_what_the_dissipation_says() {
    for (name, until) in [("free", 40.0), ("motor", 20.0), ("four_bars", 5.0), ("gentle", 40.0)] {
        let found = lyapunov(&example(name), Some(until), None, &mut || false)
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        println!("{name}: {:?}, sum {:e}, {:?} {:?}", found.exponents, found.sum, found.regime, found.lost);
        assert_eq!(found.expected_sum, 0.0);
        assert!(found.lost.is_some() || found.defect() < 1e-8, "{name}: {:e}", found.defect());
    }
    let set = ["springs.spring.damping=0.02".parse().expect("an override")];
    let damped = Template::read("examples/scenes/spring.json".as_ref(), &set).expect("a scene");
    let found = lyapunov(&damped, Some(20.0), None, &mut || false).expect("a spectrum");
    assert!(found.expected_sum < -1e-3 && found.defect() < 1e-8, "{} {}", found.sum, found.expected_sum);
    // Both belong to the same span where an event ends the run before its time.
    let text = std::fs::read_to_string("examples/scenes/spring.json").expect("a scene");
    let text =
        text.replacen('{', r#"{"events": [{"name": "low", "when": "bar1.phi - 1", "action": "stop"}],"#, 1);
    let found = lyapunov(&Template::new(text, "spring".into(), &set), Some(20.0), None, &mut || false);
    let found = found.expect("a spectrum");
    assert!(found.lost.as_ref().is_some_and(|lost| lost.contains("`low`")), "{:?}", found.lost);
    assert!(found.expected_sum < -1e-3 && found.defect() < 1e-8, "{} {}", found.sum, found.expected_sum);
}

/// Of phi'' = a sin(phi) at rest upright the exponents are √a and -√a, of phi'' = c phi' they are c and 0: both
/// grow for ever, and neither is chaos.
#[test]
fn a_single_degree_of_freedom_that_nothing_drives_is_not_chaotic() {
    let scene = |gravity: &str, more: &str, omega: f64| {
        template(&format!(
            r#"{{"name": "one", "gravity": {gravity}, {more}
            "bars": [{{"name": "b", "mass": 1, "centre": [0.3, 0], "inertia": 0.03, "length": 0.6}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
            "start": {{"b": {{"phi": 0, "omega": {omega}}}}}, "until": 12, "every": 12}}"#
        ))
    };
    let upright = scene("[-9.81, 0]", "", 0.0);
    let spun = scene("[0, 0]", r#""torques": [{"name": "t", "body": "b", "torque": "0.24*b.omega"}],"#, 1.0);
    for (scene, largest) in [(&upright, (9.81_f64 * 0.3 / 0.12).sqrt()), (&spun, 2.0)] {
        let found = lyapunov(scene, None, None, &mut || false).expect("a spectrum");
        assert_near(found.exponents[0], largest, 0.1 * largest, "largest exponent");
        assert_eq!(found.regime, Regime::Undecided);
        assert!(found.why.is_some_and(|why| why.contains("not chaotic")), "{:?}", found.why);
    }
    // 2⁵³ turns at about 19.6 s.
    let stop = lyapunov(&spun, Some(25.0), None, &mut || false).expect_err("too many turns").to_string();
    assert!(stop.contains("a body has turned more often than doubles can count"), "{stop}");
}

/// A force that jumps where a rate passes a value spreads or draws together what comes there.
#[test]
fn spectra_add_up_where_forces_jump_with_rates() {
    for more in [
        r#""torques": [{"name": "q", "body": "b", "torque": "0.8*if(b.omega > 1, 1, -0.5)"}]"#,
        r#""torques": [{"name": "q", "body": "b", "torque": 0.8}],
            "events": [{"name": "e", "when": "b.omega - 1", "off": ["q"]}]"#,
    ] {
        let text = format!(
            r#"{{"name": "jump", "gravity": [0, -9.81], {more},
            "bars": [{{"name": "b", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
            "start": {{"b": {{"phi": -0.5, "omega": 0.3}}}}, "until": 6, "every": 6}}"#
        );
        let found = lyapunov(&Template::new(text, "jump".into(), &[]), None, None, &mut || false);
        let found = found.expect("a spectrum");
        assert!(
            found.sum.abs() > 1e-3 && found.defect() < 1e-8,
            "{} {} {:?}",
            found.sum,
            found.expected_sum,
            found.lost
        );
    }
}

/// Neither a point that comes to rest on its wall nor a joint that opens leaves the directions there were.
#[test]
fn a_spectrum_ends_where_directions_come_or_go() {
    let ended = |more: &str, why: &str| {
        let text = format!(
            r#"{{"name": "two", "gravity": [0, -9.81], {more},
                "bars": [{{"name": "bar", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}},
                    {{"name": "other", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}}],
                "hinges": [
                    {{"name": "A", "between": [
                        {{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}},
                    {{"name": "B", "between": [
                        {{"body": "bar", "point": [1, 0]}}, {{"body": "other", "point": [0, 0]}}]}}],
                "torsion_springs": [
                    {{"name": "t", "body": "bar", "stiffness": 0, "free_angle": 0, "damping": 0.2}}],
                "start": {{"bar": {{"phi": 0.3, "omega": 0}}, "other": {{"phi": -1, "omega": 0}}}},
                "until": 5, "every": 1}}"#
        );
        let found = lyapunov(&Template::new(text, "two".into(), &[]), None, None, &mut || false);
        let found = found.expect("a spectrum");
        let time = format!("at t = {} s", found.until);
        let is_told = |lost: &String| lost.contains(why) && lost.ends_with(&time);
        assert!(found.lost.as_ref().is_some_and(is_told), "{:?} beside {time}", found.lost);
        assert!(found.until > 0.1 && found.expected_sum < -0.1, "{} {}", found.until, found.expected_sum);
        assert!(found.defect() < 1e-8, "{} {}", found.sum, found.expected_sum);
    };
    let wall = r#""walls": [{"name": "w", "body": "bar", "point": [1, 0], "restitution": 0.1,
        "line": {"through": [0, -0.5], "normal": [0, 1]}}]"#;
    ended(wall, "stays on its wall");
    let lock = r#""locks": [{"name": "lock", "body": "other", "relative_to": "bar"}]"#;
    ended(&format!(r#"{lock}, "events": [{{"name": "e", "when": "t - 0.5", "off": ["lock"]}}]"#), "opens");
    ended(
        &format!(
            r#"{lock}, "inactive": ["lock"], "events": [{{"name": "e", "when": "t - 0.5", "on": ["lock"]}}]"#
        ),
        "closes",
    );
}

/// A double pendulum beside a pendulum of its own that is damped (c/J = 4/3) and pushed at times has the exponents of
/// both: what rests in one of them leaves the columns of the other as they are.
#[test]
fn a_spectrum_is_that_of_its_independent_parts() {
    let bar = |name: &str| {
        format!(r#"{{"name": "{name}", "mass": 1, "centre": [0.5, 0], "inertia": 0.125, "length": 1}}"#)
    };
    let hinge = |name: &str, inner: &str, at: [f64; 2], outer: &str| {
        let inner = format!(r#"{{"body": "{inner}", "point": {at:?}}}"#);
        format!(r#"{{"name": "{name}", "between": [{inner}, {{"body": "{outer}", "point": [0, 0]}}]}}"#)
    };
    let text = format!(
        r#"{{"name": "parts", "gravity": [0, -9.8125], "bars": [{}, {}, {}], "hinges": [{}, {}, {}],
        "torsion_springs": [{{"name": "T", "body": "d", "stiffness": 1, "free_angle": 0, "damping": 0.5}}],
        "torques": [{{"name": "q", "body": "d", "torque": "if(t>0.7,2,-1)"}}],
        "start": {{"d": {{"phi": -1, "omega": 1}}, "a": {{"phi": 1, "omega": 0}}, "b": {{"phi": 0.5, "omega": 0}}}},
        "until": 80, "every": 1}}"#,
        bar("d"),
        bar("a"),
        bar("b"),
        hinge("D", "ground", [-3.0, 0.0], "d"),
        hinge("A", "ground", [0.0, 0.0], "a"),
        hinge("B", "a", [1.0, 0.0], "b"),
    );
    let found = lyapunov(&template(&text), None, None, &mut || false).expect("a spectrum");
    println!("{:?} {:e}", found.exponents, found.sum + 4.0 / 3.0);
    assert!((found.sum + 4.0 / 3.0).abs() < 1e-6, "{:e}", found.sum + 4.0 / 3.0);
    for exponent in &found.exponents[3..5] {
        assert!((exponent + 2.0 / 3.0).abs() < 0.08, "{:?}", found.exponents);
    }
    assert_eq!(found.regime, Regime::Chaotic);
}

/// An integral is one unknown, whose exponent is zero where nothing depends on it: angle and rate of the pendulum
/// keep theirs.
#[test]
fn an_integral_has_one_exponent() {
    let with = |more: &str| {
        let text = format!(
            r#"{{"name": "pendulum", "gravity": [0, -9.81], {more}
                "bars": [{{"name": "bar", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}}],
                "hinges": [{{"name": "A", "between": [
                    {{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}}],
                "torsion_springs": [{{"name": "t", "body": "bar", "stiffness": 0, "free_angle": 0, "damping": 0.2}}],
                "start": {{"bar": {{"phi": 0.3, "omega": 0}}}}, "until": 40, "every": 1}}"#
        );
        lyapunov(&Template::new(text, "pendulum".into(), &[]), None, None, &mut || false).expect("a spectrum")
    };
    let [plain, counted] = ["", r#""integrals": {"sum": "bar.phi"},"#].map(with);
    assert_eq!((plain.exponents.len(), counted.exponents.len()), (2, 3));
    // Damping c takes c/J off their sum.
    for found in [&plain, &counted] {
        assert!((found.sum + 0.2 / 0.35).abs() < 1e-9, "{:?}", found.exponents);
    }
    assert!(counted.exponents[0].abs() < 0.05, "{:?}", counted.exponents);
    for (found, alone) in counted.exponents[1..].iter().zip(&plain.exponents) {
        assert!((found - alone).abs() < 0.05, "{:?} {:?}", counted.exponents, plain.exponents);
    }
}

/// Over a thousand seconds; the divergence of the driven Duffing oscillator is -c/I = -0.2 /s everywhere.
#[test]
fn spectra_add_up_over_a_thousand_seconds() {
    let damped = Template::read(
        "examples/scenes/spring.json".as_ref(),
        &["springs.spring.damping=0.02".parse().expect("an override")],
    )
    .expect("a scene");
    for (template, sum) in [(example("free"), Some(0.0)), (example("duffing"), Some(-0.2)), (damped, None)] {
        let found = lyapunov(&template, Some(1000.0), None, &mut || false).expect("a spectrum");
        let sum = sum.unwrap_or(found.expected_sum);
        let largest = found.exponents.iter().fold(0.0, |most: f64, exponent| most.max(exponent.abs()));
        assert!(found.lost.is_none() && sum <= 0.0);
        assert!((found.sum - sum).abs() < 1e-11 * largest, "{} {sum} {:?}", found.sum, found.exponents);
    }
}

/// What a number near zero does shows in changes of its unit; over itself there is nothing but rounding.
#[test]
fn numbers_that_are_zero_but_for_rounding_have_the_derivatives_of_zero() {
    let at = |rate: &str| {
        let set = [format!("bar1.omega={rate}").parse().expect("an override")];
        let template = Template::read("examples/scenes/free.json".as_ref(), &set).expect("a scene");
        derived(&template, &["bar2.phi", "bar2.omega"], &["bar1.omega"], 1.0)
    };
    let (zero, tiny) = (at("0"), at("-1.7e-17"));
    for (zero, tiny) in zero.measures.iter().zip(&tiny.measures) {
        assert_near(tiny.slopes[0], zero.slopes[0], 1e-10, "beside zero");
    }
    // How fast a rail is travelled changes no angle: a frame that moves steadily is as good as any.
    let driven = template(
        r#"{"name": "driven", "gravity": [9.81, 0],
            "bars": [{"name": "b", "mass": 0.56, "centre": [0.52, 0], "inertia": 0.031, "length": 1.08}],
            "sliders": [{"name": "rail", "point": {"body": "b", "point": [0, 0]},
                         "rail": {"body": "ground", "point": [1.3, 1.4], "direction": [0.22, 0.17]}}],
            "torsion_springs": [{"name": "coil", "body": "b", "stiffness": 4.4, "free_angle": -2.5}],
            "motors": [{"name": "drive", "slider": "rail",
                        "law": {"start": 0.06, "rate": -1.7e-17, "sines": [{"amplitude": 0.08, "frequency": 3.6, "phase": 1.5707963267948966}]}}],
            "start": {"b": {"phi": -1.96, "omega": 0, "velocity": [0, 0]}}, "until": 1, "every": 0.1}"#,
    );
    let found = derived(&driven, &["b.phi", "b.omega"], &["motors.drive.law.rate"], 1.0);
    for measured in &found.measures {
        assert!(measured.slopes[0].abs() < 1e-11, "{:e}", measured.slopes[0]);
    }
}

#[test]
fn chaos_is_told_from_regular_motion() {
    let regime = |name: &str, until: f64| {
        lyapunov(&example(name), Some(until), Some(1e-10), &mut || false).expect("a spectrum").regime
    };
    assert_eq!(regime("free", 60.0), Regime::Chaotic);
    assert_eq!(regime("gentle", 60.0), Regime::Regular);
}

/// A motion shows nothing of the kind in its first turns, as chaotic ones do not; nor does growth that its own scatter
/// tells from a power: of an oscillator whose stiffness oscillates, by e in 9.64 s (Floquet).
#[test]
fn short_runs_and_slow_growth_are_undecided() {
    let regime = |template: &Template, until: f64| {
        lyapunov(template, Some(until), Some(1e-10), &mut || false).expect("a spectrum").regime
    };
    for (name, until) in [("free", 0.01), ("free", 1.0), ("free", 4.0), ("wall", 1.0), ("wall", 3.0)] {
        assert_eq!(regime(&example(name), until), Regime::Undecided, "{name} {until}");
    }
    for name in ["spring", "gentle", "hanging"] {
        assert_eq!(regime(&example(name), 10.0), Regime::Regular, "{name}");
    }
    // Chaotic at 0.4 /s by 200 s, of which a scatter as large as the mean shows nothing at 50 s.
    let sprung = template(
        r#"{"name": "sprung", "gravity": [0, -9.8125],
        "bars": [
            {"name": "b1", "mass": 1.125, "centre": [0.171875, 0.046875], "inertia": 0.13671875, "length": 0.5},
            {"name": "b2", "mass": 0.453125, "centre": [0.234375, 0], "inertia": 0.12109375, "length": 0.34375}],
        "hinges": [{"name": "H", "between": [{"body": "b1", "point": [0.5, 0]}, {"body": "b2", "point": [0, 0]}]}],
        "springs": [
            {"name": "S0", "between": [{"body": "ground", "point": [-0.671875, 1.453125]}, {"body": "b1", "point": [0, 0]}],
                "stiffness": 37.546875, "free_length": 0.671875, "damping": 1.65625},
            {"name": "S1", "between": [{"body": "ground", "point": [-0.984375, 1.890625]}, {"body": "b1", "point": [0.5, 0]}],
                "stiffness": 32.328125, "free_length": 0.515625, "damping": 0},
            {"name": "S2", "between": [{"body": "b1", "point": [0.5, 0]}, {"body": "b2", "point": [0.34375, 0]}],
                "stiffness": 19.484375, "free_length": 0.296875, "damping": 1.953125}],
        "torsion_springs": [{"name": "T", "body": "b2", "stiffness": 4.390625, "free_angle": -1.234375, "damping": 0}],
        "forces": [{"name": "F", "body": "b1", "point": [0.5, 0], "force": [3.015625, -3.921875], "frame": "body",
            "law": {"start": -0.703125, "sines": [{"amplitude": 1, "frequency": 7.015625}]}}],
        "start": {
            "b1": {"phi": 0.3125, "omega": 1.765625, "origin": [-0.0625, 0.484375], "velocity": [-0.59375, -0.546875]},
            "b2": {"phi": -2.046875, "omega": 2.78125}},
        "until": 50, "every": 50}"#,
    );
    assert_eq!(regime(&sprung, 50.0), Regime::Undecided);
    let rotor = r#"{"name": "rotor", "gravity": [0, 0],
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}]}],
        "torques": [{"name": "q", "body": "b", "torque": "TORQUE"}],
        "start": {"b": {"phi": 0, "omega": 0}}, "until": 50, "every": 1}"#;
    let mathieu = template(&rotor.replace("TORQUE", "-(2+1.5*cos(2*t))*b.phi"));
    assert_eq!(regime(&mathieu, 60.0), Regime::Undecided);
    // What nothing drives grows with the time itself.
    assert_eq!(regime(&template(&rotor.replace("\"TORQUE\"", "0")), 60.0), Regime::Regular);
}

/// A light bar that floats at the end of another one, near the rate at which large torques cancel: accelerations
/// are small beside what they are sums of, and differences of them by a number noise.  The values are
/// differences of runs with thirty digits.
#[test]
fn what_cancels_in_accelerations_is_derived() {
    let text = r#"{"name": "cancelling", "gravity": [0, -9.8125],
        "bars": [{"name": "b1", "mass": 0.015625, "centre": [0.3125, 0], "inertia": 0.0009765625, "length": 0.453125},
                 {"name": "b2", "mass": 0.296875, "centre": [0.171875, -0.0625], "inertia": 0.08203125, "length": 0.5}],
        "hinges": [{"name": "H1", "between": [{"body": "b1", "point": [0.453125, 0]}, {"body": "b2", "point": [0, 0]}]}],
        "torques": [{"name": "Q0", "body": "b1", "torque": "-0.125*b1.omega*abs(b1.omega)"},
                    {"name": "QI", "body": "b1", "torque": "2*I-0.25*b1.omega"}],
        "integrals": {"I": "0.25-b1.sin"},
        "start": {"b1": {"phi": 0.09375, "omega": -1.0625, "origin": [-0.25, 0.34375], "velocity": [-0.125, -0.109375]},
                  "b2": {"phi": 0.734375, "omega": 0.125}}, "until": 3, "every": 3}"#;
    let [inertia, mass] = ["bars.b1.inertia", "bars.b1.mass"];
    for to in [&[inertia, mass][..], &[inertia], &[mass]] {
        let found = derived(&template(text), &["b2.phi"], to, 3.0);
        for (input, slope) in found.inputs.iter().zip(&found.measures[0].slopes) {
            let expected = if input.path == mass { -0.8896126338 } else { 0.0258955082 };
            assert_near(*slope, expected, 1e-8, &input.path);
        }
        // Steps divided by noise would be thousands.
        assert!(found.steps[1] < 2000, "{:?}", found.steps);
    }
}

/// Small differences of `free` grow tenfold in 1.54 s: those of the tolerance, 1e-14, are 1e-3 rad before 20 s.
#[test]
fn beyond_the_horizon_there_are_no_derivatives() {
    let request = SensitivityRequest {
        of: vec!["bar2.phi".parse().expect("a measure")],
        to: vec!["bars.bar1.length".into()],
        at: Some(40.0),
        every: Some(1.0),
        ..SensitivityRequest::default()
    };
    let found = sensitivity(&example("free"), &request, &mut || false).expect("sensitivities");
    let measure = &found.measures[0];
    let why = measure.why.as_ref().expect("a reason");
    assert!(why.contains("not known any more") && measure.slopes.is_empty(), "{why}");
    let last = found.rows.last().expect("rows").t;
    assert!((13.0..22.0).contains(&last), "the last row is at {last} s");
    assert!(found.lost.as_ref().is_some_and(|lost| lost.starts_with(&format!("at {} s", last + 1.0))));
}

#[test]
fn bands_and_covariances_follow_from_the_jacobian() {
    let request = SensitivityRequest {
        of: vec!["bar1.phi".parse().expect("a measure")],
        to: vec!["bar1.phi".into(), "gravity[0]".into()],
        at: Some(1.0),
        every: Some(0.25),
        ..SensitivityRequest::default()
    };
    let found = sensitivity(&example("spring"), &request, &mut || false).expect("sensitivities");
    assert_eq!(found.rows.iter().map(|row| row.t).collect::<Vec<_>>(), [0.0, 0.25, 0.5, 0.75, 1.0]);
    let bands = found.bands(&[0.01, 0.1]);
    assert_near(bands[0][0], 0.01, 1e-12, "at the start the band is that of the angle");
    let slopes = &found.measures[0].slopes;
    let expected = (0.01 * slopes[0]).hypot(0.1 * slopes[1]);
    assert_near(bands[4][0], expected, 1e-12, "at the end");
    let covariance = found.covariance(&nalgebra::DMatrix::from_diagonal(&nalgebra::dvector![1e-4, 1e-2]));
    assert_near(covariance[(0, 0)].sqrt(), expected, 1e-12, "covariance");
}

#[test]
fn what_makes_no_sense_is_told() {
    for (of, to, told) in [
        ("event:none", "bar1.phi", "no event is called `none`"),
        ("impact:none", "bar1.phi", "no wall is called `none`"),
        ("bar1.phi", "bar3.phi", "bar3"),
        ("bar1.fie", "bar1.phi", "unknown name bar1.fie"),
        ("bar1.phi", "springs.spring.model", "not a single number"),
    ] {
        let request = SensitivityRequest {
            of: vec![of.parse().expect("a measure")],
            to: vec![to.into()],
            ..SensitivityRequest::default()
        };
        let error = sensitivity(&example("spring"), &request, &mut || false).expect_err(of).to_string();
        assert!(error.contains(told), "{error}");
    }
    // How long a run is followed, and how often it is shown, is nothing of the mechanism.
    let set = ["until=1", "every=0.5"].map(|text| text.parse().expect("an override"));
    let spring = Template::read("examples/scenes/spring.json".as_ref(), &set).expect("a scene");
    for to in ["until", "every"] {
        let request = SensitivityRequest {
            of: vec!["bar2.phi".parse().expect("a measure")],
            to: vec![to.into()],
            ..SensitivityRequest::default()
        };
        let error = sensitivity(&spring, &request, &mut || false).expect_err(to).to_string();
        assert!(error.contains("no number of the mechanism"), "{error}");
    }
}

/// A rotor that a spring k (phi - 0.1)^p sends back: it returns at the speed it came with, and is in contact for a time
/// T ~ (J/k)^(1/(p+1)) w^((1-p)/(1+p)).
#[test]
fn a_spring_of_a_fractional_power_is_derived_through_its_zeros() {
    for (p, tolerance) in [(0.5, 1e-8), (0.25, 1e-6)] {
        let text = r#"{"name": "back", "gravity": [0, 0], "parameters": {"k": 30},
            "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 1}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}]}],
            "torsion_springs": [{"name": "t", "body": "b", "torque": "k*max(0, angle - 0.1)^POWER"}],
            "events": [{"name": "out", "when": "b.phi - 0.1", "direction": "falling"}],
            "start": {"b": {"phi": 0, "omega": 1.7}}, "until": 2, "every": 1}"#;
        let to = ["k", "b.omega", "b.phi"];
        let template = template(&text.replace("POWER", &p.to_string()));
        let found = derived(&template, &["event:out", "b.omega", "b.phi"], &to, 2.0);
        let (k, w) = (30.0, 1.7);
        let (out, contact) = (found.measures[0].value, found.measures[0].value - 0.1 / w);
        let by_k = -contact / (p + 1.0) / k;
        let by_w = -0.1 / (w * w) + (1.0 - p) / (1.0 + p) * contact / w;
        let expected = [[by_k, by_w, -1.0 / w], [0.0, -1.0, 0.0], [w * by_k, w * by_w - (2.0 - out), -1.0]];
        for (measure, expected) in found.measures.iter().zip(expected) {
            for ((slope, expected), to) in measure.slopes.iter().zip(expected).zip(to) {
                let off = (slope - expected).abs();
                assert!(off <= tolerance, "{p}: {} by {to}: {slope} for {expected}", measure.name);
            }
        }
        // The last digits of the angle count for more the smaller the power is.
        let told = found.inputs.iter().map(|input| input.error).fold(0.0, f64::max);
        assert!(told <= 1e-4 && (p > 0.4 || told >= 1e-7), "{p}: {told:e}");
    }
}

/// A kite folds into one line only while two of its sides are alike and two others; its start and its masses are free.
#[test]
fn numbers_of_a_loop_have_no_derivative_beyond_a_singular_position() {
    let kite = example("kite");
    let loops = ["hinges.A.between[1].point[0]", "hinges.A.between[1].point[1]"];
    let before = derived(&kite, &["crank.phi"], &loops, 0.2);
    assert!(before.lost.is_none() && before.measures[0].slopes.len() == 2, "{:?}", before.lost);
    for number in loops {
        let beyond = derived(&kite, &["crank.phi"], &[number], 0.5);
        let why = beyond.measures[0].why.as_deref().unwrap_or_default();
        assert!(why.contains("singular position") && why.contains(number), "{:?}", beyond.measures[0]);
    }
    let free = derived(&kite, &["crank.phi"], &["start.crank.omega", "bars.crank.mass"], 0.5);
    assert_eq!(free.measures[0].slopes.len(), 2, "{:?}", free.lost);
}

/// A point that flies at (2, 3) m/s up to x = 1: the largest y is the last one, 3/2, and moves with the end.
#[test]
fn an_extreme_as_an_event_ends_the_run_moves_with_the_event() {
    let text = r#"{"name": "ends", "gravity": [0, 0],
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1}],
        "points": [{"name": "p", "body": "b", "point": [0, 0]}], "outputs": {"y": "p.y"},
        "events": [{"name": "end", "when": "p.x - 1", "action": "stop"}],
        "start": {"b": {"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [2, 3]}}, "until": 5, "every": 5}"#;
    let to = ["b.velocity[0]", "b.velocity[1]"];
    let found = derived(&template(text), &["max:y", "min:y", "event:end"], &to, 5.0);
    for (measure, expected) in found.measures.iter().zip([[-0.75, 0.5], [0.0, 0.0], [-0.25, 0.0]]) {
        let slopes = measure.slopes.iter().zip(expected);
        slopes.for_each(|(found, expected)| assert_near(*found, expected, 1e-9, &measure.name));
    }
}

/// The velocity of a ball is least just before its impact, -√(2 g y), and largest just behind it: both move with the
/// time of the impact, whatever else is asked for.
#[test]
fn extremes_on_both_sides_of_an_impact_move_with_it() {
    let text = r#"{"name": "drop", "gravity": [0, -9.81],
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1}],
        "points": [{"name": "p", "body": "b", "point": [0, 0]}], "outputs": {"vy": "p.vy", "y": "p.y"},
        "walls": [{"name": "floor", "body": "b", "point": [0, 0], "restitution": 0.5,
                   "line": {"through": [0, 0], "normal": [0, 1]}}],
        "start": {"b": {"phi": 0, "omega": 0, "origin": [0, 1], "velocity": [0, 0]}}, "until": 0.6, "every": 0.6}"#;
    let slope = (9.81_f64 / 2.0).sqrt();
    for (of, expected) in
        [(&["min:vy"][..], -slope), (&["min:vy", "y"], -slope), (&["max:vy"], 0.5 * slope), (&["min:y"], 0.0)]
    {
        let found = derived(&template(text), of, &["b.origin[1]"], 0.6);
        assert_near(found.measures[0].slopes[0], expected, 1e-9, of[0]);
    }
}

/// A brake that closes at te under a torque k (2 - t): it holds -k (2 - te) most, from there on less; the speed k te
/// (2 - te/2) of the moment before is the largest one, at a corner of the curve.
#[test]
fn extremes_at_an_event_move_with_it() {
    let text = r#"{"name": "brake", "gravity": [0, 0], "parameters": {"k": 1.5, "te": 0.5},
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}]}],
        "torques": [{"name": "T", "body": "b", "torque": "k*(2 - t)"}],
        "locks": [{"name": "brake", "body": "b"}], "inactive": ["brake"],
        "events": [{"name": "closes", "when": "t - te", "on": ["brake"]}],
        "outputs": {"held": "brake.torque", "speed": "b.omega", "angle": "b.phi"},
        "start": {"b": {"phi": 0, "omega": 0}}, "until": 1, "every": 1}"#;
    let of = ["min:held", "max:speed", "max:angle"];
    let found = derived(&template(text), &of, &["parameters.k", "parameters.te"], 1.0);
    let (k, te) = (1.5, 0.5);
    let angle = te * te - te * te * te / 6.0;
    let expected = [
        (-k * (2.0 - te), [te - 2.0, k]),
        (k * te * (2.0 - te / 2.0), [te * (2.0 - te / 2.0), k * (2.0 - te)]),
        (k * angle, [angle, k * te * (2.0 - te / 2.0)]),
    ];
    assert_measures(&found, &expected, 1e-9);
}

/// The slider's largest force is the limit at a singular position, the least one of hinge B is elsewhere.
#[test]
fn extremes_of_forces_at_singular_positions_are_refused_as_such() {
    let found = derived(&template(EQUAL_SLIDER_CRANK), &["max:S", "min:FB"], &["bars.p.mass"], 1.0);
    let [force, other] = &found.measures[..] else { panic!("two measures") };
    assert!(force.why.as_ref().is_some_and(|why| why.contains("singular position")), "{:?}", force.why);
    assert!(other.why.is_none() && (other.slopes[0] - 14.9639).abs() < 1e-3, "{other:?}");
}

/// A torque that changes its sign at p0, from a to -a: outputs of the same signal jump there.  Up to then J w²/2 = a phi,
/// and a phi, a w, a are largest just before it; w is the same at -p0 on the way back, and a phi least at the end.
#[test]
fn extremes_are_derived_on_the_side_of_a_jump_that_has_them() {
    let text = r#"{"name": "shared", "gravity": [0, 0], "parameters": {"a": 1, "p0": 0.1},
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}]}],
        "signals": {"f": "if(b.phi < p0, a, -a)"}, "torques": [{"name": "q", "body": "b", "torque": "f"}],
        "outputs": {"y": "f*b.phi", "pw": "f*b.omega", "f1": "f"},
        "start": {"b": {"phi": 0, "omega": 0}}, "until": 0.9, "every": 0.1}"#;
    let found = derived(&template(text), &["max:y", "max:pw", "max:f1", "min:f1"], &["a", "p0"], 0.9);
    let (a, p) = (1.0_f64, 0.1_f64);
    let speed = (4.0 * a * p).sqrt();
    let expected = [
        (a * p, [p, a]),
        (a * speed, [1.5 * speed, 2.0 * a * a / speed]),
        (a, [1.0, 0.0]),
        (-a, [-1.0, 0.0]),
    ];
    assert_measures(&found, &expected, 1e-8);
}

/// The same of time: the torque rises to a tc and falls to -a tc there; and a ball that falls from rest at h, of which
/// -2 y - 5 counts as soon as it falls.
#[test]
fn extremes_are_derived_on_the_side_of_a_start_or_a_time_that_has_them() {
    let text = r#"{"name": "time", "gravity": [0, 0], "parameters": {"a": 1.5, "tc": 0.7},
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}]}],
        "torques": [{"name": "q", "body": "b", "torque": "if(t < tc, a*t, -a*t)"}],
        "outputs": {"tq": "if(t < tc, a*t, -a*t)"}, "start": {"b": {"phi": 0, "omega": 0}},
        "until": 1.5, "every": 0.1}"#;
    let found = derived(&template(text), &["max:tq"], &["a", "tc"], 1.5);
    assert_near(found.measures[0].value, 1.05, 1e-9, "value");
    assert_near(found.measures[0].slopes[0], 0.7, 1e-9, "by a");
    assert_near(found.measures[0].slopes[1], 1.5, 1e-9, "by tc");
    let text = r#"{"name": "falls", "gravity": [0, -9.81],
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 0.2}],
        "outputs": {"u": "if(b.vy < 0, -2*b.y - 5, b.vy)"},
        "start": {"b": {"phi": 0, "omega": 0, "origin": [0, 1], "velocity": [0, 0]}}, "until": 0.3, "every": 0.1}"#;
    let found = derived(&template(text), &["min:u"], &["start.b.origin[1]"], 0.3);
    assert_near(found.measures[0].value, -7.0, 1e-9, "value");
    assert_near(found.measures[0].slopes[0], -2.0, 1e-9, "by height");
}

/// A flight at (2, 3) m/s: what `--output` adds is derived beside formulas that are asked for, and in place of an
/// output of the scene of the same name.
#[test]
fn outputs_that_are_added_are_derived() {
    let text = r#"{"name": "flight", "gravity": [0, 0],
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1}],
        "points": [{"name": "p", "body": "b", "point": [0, 0]}], "outputs": {"q": "p.x"},
        "start": {"b": {"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [2, 3]}}, "until": 5, "every": 5}"#;
    let without = text.replace(r#""outputs": {"q": "p.x"},"#, "");
    for text in [text, &without] {
        let template = template(text).with_outputs(vec![Output::parse("q=p.x^2")]);
        let found = derived(&template, &["q", "p.x*p.y", "max:q"], &["b.velocity[0]"], 3.0);
        for (measure, (value, slope)) in found.measures.iter().zip([(36.0, 36.0), (54.0, 27.0), (36.0, 36.0)])
        {
            assert_near(measure.value, value, 1e-9, &measure.name);
            assert_near(measure.slopes[0], slope, 1e-9, &measure.name);
        }
    }
}

/// A wheel, phi = w t - q t²/(2 J), beyond 0.25: the least (phi - 0.25)² is zero and smooth.  What is the smaller
/// one of a rising and of a falling line is largest at a corner.
#[test]
fn extremes_at_zero_are_smooth_and_corners_are_refused() {
    let text = r#"{"name": "wheel", "gravity": [0, 0],
        "bars": [{"name": "w", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 0.5}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "w", "point": [0, 0]}]}],
        "torques": [{"name": "q", "body": "w", "torque": -0.1}],
        "outputs": {"sq": "(w.phi-0.25)^2", "high": "7-(w.phi-0.25)^2", "roof": "min(w.phi-0.1, 1.2-3*w.phi)"},
        "start": {"w": {"phi": 0, "omega": 1}}, "until": 0.6, "every": 0.1}"#;
    let found = derived(&template(text), &["min:sq", "max:high", "max:roof"], &["w.omega", "q.torque"], 0.6);
    for (measure, value) in found.measures.iter().zip([0.0, 7.0]) {
        assert_near(measure.value, value, 1e-9, &measure.name);
        assert_eq!(measure.slopes.len(), 2, "{:?}", measure.why);
        measure.slopes.iter().for_each(|slope| assert_near(*slope, 0.0, 1e-6, &measure.name));
    }
    let why = found.measures[2].why.as_deref().unwrap_or_default();
    assert!(why.contains("corner"), "{:?}", found.measures[2]);
}

/// A wheel at 1e5 rad/s with a cam, y = a sin(phi): (J + m a² cos²(phi)) w² stays, and w is largest where the cam is
/// at rest.
#[test]
fn extremes_of_fast_wheels_keep_their_digits() {
    let text = r#"{"name": "cam", "gravity": [0, 0], "parameters": {"amp": 0.8},
        "bars": [{"name": "w", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 0.5},
            {"name": "f", "mass": 0.3, "centre": [0, 0], "inertia": 0.01, "length": 0.1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "w", "point": [0, 0]}]}],
        "sliders": [{"name": "s", "point": {"body": "f", "point": [0, 0]}, "angle": "locked",
            "rail": {"body": "ground", "point": [2, 0], "direction": [0, 1]}}],
        "motors": [{"name": "cam", "slider": "s", "law": "amp*sin(w.phi)"}],
        "start": {"w": {"phi": 0.2, "omega": 1e5}, "f": {"phi": 0}}, "until": 2e-4, "every": 2e-4}"#;
    let to = ["bars.w.inertia", "bars.f.mass", "parameters.amp", "w.phi", "w.omega"];
    let found = derived(&template(text), &["max:w.omega", "max:2*w.omega"], &to, 2e-4);
    let (j, m, a, phi, w): (f64, f64, f64, f64, f64) = (0.5, 0.3, 0.8, 0.2, 1e5);
    let c = phi.cos() * phi.cos();
    let most = w * (1.0 + m * a * a * c / j).sqrt();
    let by_square =
        [-m * a * a * c / (j * j), a * a * c / j, 2.0 * m * a * c / j, -m * a * a * (2.0 * phi).sin() / j];
    let half = 0.5 * w * w / most;
    let slopes: Vec<f64> = by_square.iter().map(|by| half * by).chain([most / w]).collect();
    for (measure, factor) in found.measures.iter().zip([1.0, 2.0]) {
        assert_near(measure.value, factor * most, 1e-12, &measure.name);
        for ((found, expected), by) in measure.slopes.iter().zip(&slopes).zip(to) {
            assert_near(*found, factor * expected, 1e-9, &format!("{} by {by}", measure.name));
        }
    }
}

/// A ball let fall from h above a floor, asked about at the impact itself, t = sqrt(2 h/g): before it dy/dh = 1 and
/// after it dy/dh = 1 + (1 + e), dv/dh = (1 + e) sqrt(g/(2 h)); sideways it has one derivative, v = 1.
#[test]
fn outputs_at_the_time_of_an_impact_have_two_derivatives() {
    let ball = template(
        r#"{"name": "at", "gravity": [0, -10],
            "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.1}],
            "walls": [{"name": "W", "body": "b", "point": [0, 0], "line": {"through": [0, 0], "normal": [0, 1]},
                       "restitution": 0.8}],
            "start": {"b": {"phi": 0, "omega": 0, "origin": [0, 1.25], "velocity": [1, 0]}}, "until": 0.5, "every": 0.5}"#,
    );
    let found = derived(&ball, &["b.y", "b.vy"], &["start.b.origin[1]"], 0.5);
    for measure in &found.measures {
        let why = measure.why.as_deref().unwrap_or_default();
        assert!(measure.slopes.is_empty() && why.contains("one derivative before"), "{measure:?}");
    }
    let beside = derived(&ball, &["b.y", "b.vy"], &["start.b.origin[1]"], 0.49);
    [1.0, 0.0]
        .iter()
        .zip(&beside.measures)
        .for_each(|(slope, measure)| assert_near(measure.slopes[0], *slope, 1e-9, "y"));
    // What does not move the impact has one.
    let sideways = derived(&ball, &["b.x"], &["start.b.velocity[0]"], 0.5);
    assert_near(sideways.measures[0].slopes[0], 0.5, 1e-9, "x");
}

/// A zero of the third order and a plateau are told as what they are.
#[test]
fn what_has_no_known_derivative_is_told() {
    let wheel = template(
        r#"{"name": "wheel", "gravity": [0, 0],
            "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}]}],
            "events": [{"name": "cubed", "when": "b.phi^3"}], "outputs": {"flat": "max(b.phi, 0.2)"},
            "start": {"b": {"phi": -0.5, "omega": 1}}, "until": 2, "every": 1}"#,
    );
    let found = derived(&wheel, &["event:cubed", "min:flat"], &["start.b.omega"], 2.0);
    let why = |k: usize| found.measures[k].why.as_deref().unwrap_or_default();
    assert!(why(0).contains("higher power"), "{:?}", found.measures[0]);
    assert!(why(1).contains("constant but for rounding"), "{:?}", found.measures[1]);
}

/// A slow pendulum whose angle does not depend on the integral beside it.
fn slow_pendulum(integrals: &str) -> Template {
    template(&format!(
        r#"{{"name": "slow", "gravity": [0, -9.81e-6],
        "bars": [{{"name": "bar", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}},
            {{"body": "bar", "point": [0, 0]}}]}}], "integrals": {{{integrals}}},
        "start": {{"bar": {{"phi": 0.3, "omega": 0}}}}, "until": 5000, "every": 5000}}"#
    ))
}

#[test]
fn an_integral_of_any_size_leaves_the_derivatives_of_the_motion_alone() {
    let slopes = |integrals: &str| {
        let to = ["bars.bar.mass", "start.bar.phi"];
        derived(&slow_pendulum(integrals), &["bar.phi"], &to, 5000.0).measures[0].slopes.clone()
    };
    let alone = slopes("");
    for integral in [r#""I": "1e6*(1+bar.sin^2)""#, r#""I": "1e9*(1+bar.sin^2)""#] {
        for (found, expected) in slopes(integral).iter().zip(&alone) {
            assert_near(*found, *expected, 1e-6, integral);
        }
    }
}
