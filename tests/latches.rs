//! Joints, locks and motors that events switch on: momentum and energy of plastic impacts, against closed forms.

use super::formulas::{adaptive, rotor, run, scene};
use driftless::run::{MethodId, Outcome, Request};
use driftless::scene::Scene;

fn methods() -> [Request; 5] {
    [
        adaptive(MethodId::Dp5, 1e-11),
        adaptive(MethodId::Dp8, 1e-12),
        adaptive(MethodId::Dop853, 1e-12),
        adaptive(MethodId::Taylor, 1e-13),
        adaptive(MethodId::Radau(5), 1e-12),
    ]
}

fn near(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() < 2e-8, "{what}: {found} and not {expected}");
}

fn finished(scene: &Scene, request: &Request) -> Outcome {
    let outcome = run(scene, request);
    assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
    assert!(outcome.drift.energy.max < 1e-8, "{:?}: {:e}", request.method, outcome.drift.energy.max);
    outcome
}

#[test]
fn a_brake_stops_a_rotor_where_it_is_and_lets_it_go_again() {
    // Turns at 2 rad/s, is held from 1 s to 2 s, then a spring of 6 N m/rad takes it from there.
    let text = rotor(
        [0.0, 2.0],
        3.0,
        r#""locks": [{"name": "brake", "body": "bar"}], "inactive": ["brake", "k"],
        "torsion_springs": [{"name": "k", "body": "bar", "stiffness": 6, "free_angle": 0}],
        "events": [{"name": "in", "when": "t - 1", "on": ["brake"]},
            {"name": "out", "when": "t - 2", "off": ["brake"], "on": ["k"]}]"#,
    );
    let (sin, cos) = 2.0_f64.sin_cos();
    for request in methods() {
        let outcome = finished(&scene(&text), &request);
        near(outcome.events[1].phi[0], 2.0, "angle it is held at");
        near(outcome.events[1].omega[0], 0.0, "rate it is held at");
        near(outcome.event_energy, -0.5 * 1.5 * 4.0 + 0.5 * 6.0 * 4.0, "energy of both events");
        near(outcome.last.phi[0], 2.0 * cos, "angle");
        near(outcome.last.omega[0], -4.0 * sin, "rate");
    }
}

#[test]
fn a_clutch_shares_the_momentum_of_two_rotors() {
    let text = r#"{"name": "clutch", "gravity": [0, 0],
        "bars": [{"name": "a", "mass": 1, "centre": [0, 0], "inertia": 2}, {"name": "b", "mass": 1, "centre": [0, 0], "inertia": 3}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
            {"name": "B", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}]}],
        "locks": [{"name": "clutch", "body": "b", "relative_to": "a"}], "inactive": ["clutch"],
        "events": [{"name": "in", "when": "t - 0.5", "on": ["clutch"]}],
        "start": {"a": {"phi": 0, "omega": 4}, "b": {"phi": 1, "omega": -1}}, "until": 2, "every": 2}"#;
    for request in methods() {
        let outcome = finished(&scene(text), &request);
        // (2·4 - 3·1) / 5, and half the reduced inertia times the difference squared.
        near(outcome.last.omega[0], 1.0, "rate");
        near(outcome.last.phi[0], 2.0 + 1.5, "angle");
        near(outcome.last.phi[1], 1.0 - 0.5 + 1.5, "angle of the other");
        near(outcome.event_energy, -0.5 * 1.2 * 25.0, "energy lost");
    }
}

#[test]
fn a_motor_engages_where_its_rotor_is() {
    let text = rotor(
        [0.3, 0.5],
        3.0,
        r#""motors": [{"name": "drive", "body": "bar", "law": {"start": 0, "rate": 2}}], "inactive": ["drive"],
        "events": [{"name": "in", "when": "t - 1", "on": ["drive"]}, {"name": "out", "when": "t - 2", "off": ["drive"]},
            {"name": "again", "when": "t - 2.5", "on": ["drive"]}]"#,
    );
    for request in methods() {
        let outcome = finished(&scene(&text), &request);
        near(outcome.last.phi[0], 0.3 + 0.5 + 2.0 * 2.0, "angle");
        near(outcome.last.omega[0], 2.0, "rate");
        // The motor's impulse 1.5 (2 - 0.5) at 2 rad/s, of which the clutch loses half of 1.5 (2 - 0.5)².
        near(outcome.last.work, 1.5 * 1.5 * 2.0, "work of the motor");
        near(outcome.event_energy, -0.5 * 1.5 * 1.5 * 1.5, "energy lost");
    }
}

/// A cart of 2 kg at 3 m/s that picks up a bar of 1 kg, hung up at 0.4 m from its centre, where it comes by.
const HOOK: &str = r#"{"name": "hook", "gravity": [0, 0], "inactive": ["hook"],
    "bars": [{"name": "cart", "mass": 2, "centre": [0, 0], "inertia": 0.1, "length": 0.1},
        {"name": "bar", "mass": 1, "centre": [0.4, 0], "inertia": 0.05, "length": 0.8}],
    "sliders": [{"name": "rail", "point": {"body": "cart", "point": [0, 0]},
        "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "angle": "locked"}],
    "hinges": [{"name": "hook", "between": [{"body": "cart", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
    "points": [{"name": "c", "body": "cart", "point": [0, 0]}, {"name": "b", "body": "bar", "point": [0, 0]}],
    "events": [{"name": "catch", "when": "b.x - c.x", "direction": "falling", "on": ["hook"]},
        {"name": "drop", "when": "t - 1.1", "off": ["hook"]}],
    "start": {"cart": {"phi": 0, "origin": [0, 0], "velocity": [3, 0]},
        "bar": {"phi": "-90 deg", "omega": 0, "origin": [1.5, 0], "velocity": [0, 0]}},
    "until": 1.5, "every": 0.5}"#;

#[test]
fn a_hook_closes_with_the_momentum_of_both() {
    // An impulse P on both: v - P/M = P (1/m + d²/I), d = 0.4 m; half P v is lost.
    let impulse = 3.0 / (0.5 + 1.0 + 0.16 / 0.05);
    for request in methods() {
        let mut until_catch = scene(HOOK);
        // The catch is within the run whatever the rounding.
        (until_catch.until, until_catch.every) = (0.5 + 1e-9, 0.5 + 1e-9);
        let caught = finished(&until_catch, &request);
        near(caught.events[0].t, 0.5, "time of the catch");
        near(caught.event_energy, -0.5 * 3.0 * impulse, "energy lost");
        near(caught.last.omega[0], 0.0, "rate of the cart");
        near(caught.last.omega[1], -impulse * 0.4 / 0.05, "rate of the bar");
        near(caught.last.velocity[0][0], 3.0 - impulse / 2.0, "velocity of the cart");
        near(caught.last.velocity[1][0], impulse, "velocity of the bar's centre");
        let outcome = finished(&scene(HOOK), &request);
        assert_eq!(outcome.events.len(), 2, "{:?}", outcome.events);
        near(2.0 * outcome.last.velocity[0][0] + outcome.last.velocity[1][0], 6.0, "momentum along the rail");
        // Dropped, the bar spins on about its centre.
        let dropped = &outcome.events[1];
        near(outcome.last.omega[1], dropped.omega[1], "rate after the drop");
        near(outcome.event_energy, -0.5 * 3.0 * impulse, "energy lost in all");
        let kept: f64 = outcome.last.kinetic;
        near(kept, 9.0 - 0.5 * 3.0 * impulse, "kinetic energy");
    }
}

#[test]
fn what_does_not_meet_does_not_close() {
    let apart = HOOK.replace("b.x - c.x\"", "b.x - c.x - 0.2\"");
    for request in methods() {
        let outcome = run(&scene(&apart), &request);
        let stop = outcome.stop.expect("they do not meet");
        assert!(stop.what.contains("closes hook") && stop.what.contains("2.000e-1 m"), "{stop}");
        assert!(stop.hint.contains("where it meets"), "{stop}");
    }
}

#[test]
fn a_latch_at_an_angle_closes_there_and_nowhere_else() {
    // A pendulum that is caught upright.
    let text = r#"{"name": "catch", "gravity": [0, -9.81],
        "bars": [{"name": "bar", "mass": 2, "length": 1, "centre": [0.5, 0], "inertia": 0.2}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
        "locks": [{"name": "latch", "body": "bar", "angle": "90 deg"}], "inactive": ["latch"],
        "events": [{"name": "caught", "when": "bar.phi - AT", "on": ["latch"]}],
        "start": {"bar": {"phi": "-90 deg", "omega": 9}}, "until": 2, "every": 2}"#;
    let left = 0.5 * 0.7 * 81.0 - 2.0 * 9.81 * 1.0;
    for request in methods() {
        let outcome = finished(&scene(&text.replace("AT", "90 deg")), &request);
        near(outcome.last.phi[0], std::f64::consts::FRAC_PI_2, "angle");
        near(outcome.last.omega[0], 0.0, "rate");
        near(outcome.event_energy, -left, "energy lost");
        let stop = run(&scene(&text.replace("AT", "60 deg")), &request).stop.expect("it is elsewhere");
        assert!(stop.what.contains("closes latch") && stop.what.contains("rad"), "{stop}");
    }
}
