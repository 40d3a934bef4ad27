//! Whole turns of angles that matter only once a part acts that does not at the start; against closed forms.

use super::formulas::{adaptive, rotor, run, scene};
use super::sensitivity::{assert_near, derived, template};
use driftless::run::{MethodId, Request};

fn methods() -> [Request; 6] {
    [
        adaptive(MethodId::Dp5, 1e-11),
        adaptive(MethodId::Dp8, 1e-12),
        adaptive(MethodId::Taylor, 1e-13),
        adaptive(MethodId::Radau(5), 1e-12),
        Request { method: Some(MethodId::Gauss(8)), step: Some(0.005), ..Request::default() },
        Request { method: Some(MethodId::Gauss(4)), step: Some(0.0005), ..Request::default() },
    ]
}

/// A disc that a motor turns at 30 rad/s from -0.4 rad, and one of 2 kg m² on an axis of its own that a torque of
/// 1.8 N·m/rad draws after it from 0.3 s on.
fn follower(torque: &str) -> String {
    format!(
        r#"{{"name": "follower", "gravity": [0, 0], "bars": [
            {{"name": "driver", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 1}},
            {{"name": "follower", "mass": 1, "centre": [0, 0], "inertia": 2, "length": 1}}],
        "hinges": [
            {{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "driver", "point": [0, 0]}}]}},
            {{"name": "B", "between": [
                {{"body": "ground", "point": [2, 0]}}, {{"body": "follower", "point": [0, 0]}}]}}],
        "motors": [{{"name": "motor", "body": "driver", "law": {{"start": -0.4, "rate": 30}}}}],
        {torque}, "start": {{"follower": {{"phi": 0.2, "omega": 0.5}}}}, "until": 1, "every": 1}}"#
    )
}

/// By a branch of a formula, a parameter that is set, and parts that an event switches on.
fn torques() -> [String; 4] {
    let torque =
        |law: &str| format!(r#""torques": [{{"name": "k", "body": "follower", "torque": "{law}"}}]"#);
    let spring = |of: &str| {
        format!(
            r#""torsion_springs": [{{"name": "k", "body": "follower", "relative_to": "driver", {of}}}],
            "inactive": ["k"], "events": [{{"name": "on", "when": "t - 0.3", "on": ["k"]}}]"#
        )
    };
    [
        torque("if(t < 0.3, 0, 1.8*(driver.phi - follower.phi))"),
        format!(
            r#""parameters": {{"k": 0}}, "events": [{{"name": "on", "when": "t - 0.3", "set": {{"k": 1.8}}}}], {}"#,
            torque("k*(driver.phi - follower.phi)")
        ),
        spring(r#""stiffness": 1.8, "free_angle": 0"#),
        spring(r#""potential": "0.9*angle^2""#),
    ]
}

/// Angle and rate of the follower at 1 s: about the driver it swings with √0.9 rad/s.
fn followed() -> [f64; 2] {
    let (rate, time) = (0.9_f64.sqrt(), 0.7);
    let (behind, speed) = (0.35 - 8.6, 0.5 - 30.0);
    let (sin, cos) = (rate * time).sin_cos();
    [29.6 + behind * cos + speed / rate * sin, 30.0 + speed * cos - behind * rate * sin]
}

#[test]
fn a_body_is_drawn_after_one_that_has_turned_before() {
    let [phi, omega] = followed();
    for torque in torques() {
        for request in methods() {
            let outcome = run(&scene(&follower(&torque)), &request);
            assert!(outcome.stop.is_none(), "{:?} {torque}: {:?}", request.method, outcome.stop);
            let off = [outcome.last.phi[1] - phi, outcome.last.omega[1] - omega];
            assert!(off.iter().all(|off| off.abs() < 1e-8), "{:?} {torque}: {off:?}", request.method);
            let drift = outcome.drift.energy.max;
            assert!(drift < 1e-9, "{:?} {torque}: {drift:e}", request.method);
        }
    }
}

#[cfg(feature = "digits")]
#[test]
fn so_it_is_in_many_digits() {
    use super::many_digits::{last, source};
    use driftless::arithmetic::Real;

    let [phi, omega] = followed();
    for torque in torques() {
        let row = last(&source(&follower(&torque), &[], "1", "1"), 30);
        let off = [row.bodies[1][0].value() - phi, row.bodies[1][1].value() - omega];
        assert!(off.iter().all(|off| off.abs() < 1e-13), "{torque}: {off:?}");
        assert!(row.drift.abs() < 1e-26, "{torque}: {:e}", row.drift);
    }
}

/// A rotor of 1.5 kg m² makes two and a half turns at 40 rad/s before a spring of 6 N·m/rad gets hold of it, which
/// then has 768 J.
#[test]
fn a_spring_gets_hold_of_what_has_turned() {
    let springs = [r#""stiffness": 6, "free_angle": 0"#, r#""potential": "3*angle^2""#];
    for spring in springs {
        let text = rotor(
            [0.0, 40.0],
            1.0,
            &format!(
                r#""torsion_springs": [{{"name": "k", "body": "bar", {spring}}}], "inactive": ["k"],
                "events": [{{"name": "on", "when": "t - 0.4", "on": ["k"]}}]"#
            ),
        );
        let (sin, cos) = 1.2_f64.sin_cos();
        for request in methods() {
            let outcome = run(&scene(&text), &request);
            assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
            let off = outcome.last.phi[0] - (16.0 * cos + 20.0 * sin);
            assert!(off.abs() < 1e-8, "{:?}: {off:e}", request.method);
            let energy = outcome.event_energy - 768.0;
            assert!(energy.abs() < 1e-8, "{:?}: {energy:e}", request.method);
            assert!(outcome.drift.energy.max < 1e-9, "{:?}: {:e}", request.method, outcome.drift.energy.max);
        }
    }
}

/// A chain that whirls, and a spring that would count the turns of its last body but is never switched on.
#[test]
fn what_never_acts_changes_nothing() {
    for bodies in 1..=5_usize {
        let text = |spring: &str| {
            let bars: Vec<String> = (0..bodies)
                .map(|k| {
                    format!(
                        r#"{{"name": "b{k}", "mass": 1, "centre": [0.15, 0], "inertia": 0.01, "length": 0.3}}"#
                    )
                })
                .collect();
            let on = |k: usize| match k.checked_sub(1) {
                None => r#"{"body": "ground", "point": [0, 0]}"#.to_owned(),
                Some(before) => format!(r#"{{"body": "b{before}", "point": [0.3, 0]}}"#),
            };
            let hinges: Vec<String> = (0..bodies)
                .map(|k| {
                    format!(
                        r#"{{"name": "h{k}", "between": [{}, {{"body": "b{k}", "point": [0, 0]}}]}}"#,
                        on(k)
                    )
                })
                .collect();
            let start: Vec<String> =
                (0..bodies).map(|k| format!(r#""b{k}": {{"phi": {k}, "omega": 20}}"#)).collect();
            format!(
                r#"{{"name": "chain", "gravity": [0, -9.81], "bars": [{}], "hinges": [{}], {spring}
                "start": {{{}}}, "until": 1, "every": 1}}"#,
                bars.join(", "),
                hinges.join(", "),
                start.join(", ")
            )
        };
        let never = format!(
            r#""torsion_springs": [{{"name": "k", "body": "b{}", "stiffness": 6, "free_angle": 0}}],
            "inactive": ["k"], "events": [{{"name": "on", "when": "t - 9", "on": ["k"]}}],"#,
            bodies - 1
        );
        for request in methods() {
            let [with, without] = [&never[..], ""].map(|spring| run(&scene(&text(spring)), &request));
            assert!(with.stop.is_none() && with.drift.energy.max < 1e-7, "{bodies} {:?}", request.method);
            for (a, b) in with.last.phi.iter().zip(&without.last.phi) {
                assert!((a - b).abs() < 1e-5, "{bodies} bodies by {:?}: {a} and {b}", request.method);
            }
        }
    }
}

/// A rotor of 2 kg m² that turns by itself, and a part whose number is zero: d phi/dk = -∫∫ phi/I, whole turns
/// counted.
#[test]
fn a_law_that_is_zero_is_derived_by_its_number_after_whole_turns() {
    let (phi, omega, inertia, t) = (0.4, 9.0, 2.0, 2.0);
    let expected = -(0.5 * phi * t * t + omega * t * t * t / 6.0) / inertia;
    for part in [
        r#""torques": [{"name": "t", "body": "r", "torque": "-k*r.phi"}]"#,
        r#""signals": {"far": "k*r.phi"}, "torques": [{"name": "t", "body": "r", "torque": "-far"}]"#,
        r#""torsion_springs": [{"name": "t", "body": "r", "potential": "0.5*k*angle^2"}]"#,
        r#""torsion_springs": [{"name": "t", "body": "r", "torque": "k*angle"}]"#,
    ] {
        let scene = format!(
            r#"{{"name": "rotor", "gravity": [0, 0], "parameters": {{"k": 0}}, {part},
            "bars": [{{"name": "r", "mass": 1, "centre": [0, 0], "inertia": {inertia}, "length": 1}}],
            "hinges": [{{"name": "A", "between": [
                {{"body": "ground", "point": [0, 0]}}, {{"body": "r", "point": [0, 0]}}]}}],
            "start": {{"r": {{"phi": {phi}, "omega": {omega}}}}}, "until": {t}, "every": 0.5}}"#
        );
        let found = derived(&template(&scene), &["r.phi"], &["k"], t);
        assert_near(found.measures[0].slopes[0], expected, 1e-9, part);
    }
}
