//! Events whose functions pass zero in a jump: of an impact, or of a joint that closes; against closed forms.

use crate::formulas::{adaptive, run, scene};
use crate::sensitivity::{assert_near, derived, template};
use driftless::run::{MethodId, Outcome, Request, Stabilization};

fn methods() -> [Request; 4] {
    [
        adaptive(MethodId::Dp5, 1e-11),
        adaptive(MethodId::Dp8, 1e-12),
        adaptive(MethodId::Taylor, 1e-13),
        adaptive(MethodId::Radau(5), 1e-12),
    ]
}

/// A ball that is dropped from 1 m at 10 m/s², with 0.6 of its speed left after each impact.
fn ball(events: &str) -> String {
    format!(
        r#"{{"name": "ball", "gravity": [0, -10],
        "bars": [{{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 1}}],
        "points": [{{"name": "p", "body": "ball", "point": [0, 0]}}],
        "walls": [{{"name": "floor", "body": "ball", "point": [0, 0], "restitution": 0.6,
                   "line": {{"through": [0, 0], "normal": [0, 1]}}}}],
        "events": [{events}], "until": 1.4, "every": 1.4,
        "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [0, 1], "velocity": [0, 0]}}}}}}"#
    )
}

fn times(outcome: &Outcome, name: &str) -> Vec<f64> {
    outcome.events.iter().filter(|event| event.name == name).map(|event| event.t).collect()
}

/// It flies 2 e v/g after an impact of speed v, and is highest half-way.
#[test]
fn a_ball_turns_around_at_its_impacts_and_between_them() {
    let (fall, e) = (0.2_f64.sqrt(), 0.6);
    let flights = [2.0 * e * fall, 2.0 * e * e * fall];
    let text = ball(
        r#"{"name": "up", "when": "p.vy", "direction": "rising"},
        {"name": "down", "when": "p.vy", "direction": "falling"},
        {"name": "fast", "when": "p.vy - 2", "direction": "rising"}"#,
    );
    for request in methods() {
        let outcome = run(&scene(&text), &request);
        assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
        let ups = [fall, fall + flights[0], fall + flights[0] + flights[1]];
        let downs = [fall + 0.5 * flights[0], ups[1] + 0.5 * flights[1]];
        // The second impact leaves 1.6 m/s.
        for (name, expected) in [("up", &ups[..]), ("down", &downs), ("fast", &ups[..1])] {
            let found = times(&outcome, name);
            assert_eq!(found.len(), expected.len(), "{:?}: {name} at {found:?}", request.method);
            found.iter().zip(expected).for_each(|(t, expected)| assert_near(*t, *expected, 1e-9, name));
        }
    }
}

#[test]
fn what_an_impact_makes_happen_ends_the_run_and_is_derived_with_it() {
    let text = ball(r#"{"name": "up", "when": "p.vy", "direction": "rising", "action": "stop"}"#);
    let fall = 0.2_f64.sqrt();
    for request in methods() {
        let outcome = run(&scene(&text), &request);
        assert_eq!(outcome.ended_by.as_deref(), Some("up"), "{:?}", request.method);
        assert_near(outcome.last.t, fall, 1e-9, "end");
        assert_near(outcome.events[0].omega[0], 0.0, 1e-12, "rate");
    }
    let text = ball(r#"{"name": "up", "when": "p.vy - 1", "direction": "rising"}"#);
    let to = ["start.ball.origin[1]", "gravity[1]", "walls.floor.restitution"];
    let found = derived(&template(&text), &["event:up", "impact:floor"], &to, 1.0);
    assert_eq!(found.lost, None);
    let expected = [0.5 * fall, 0.05 * fall, 0.0];
    for measure in &found.measures {
        assert_near(measure.value, fall, 1e-10, &measure.name);
        let slopes = measure.slopes.iter().zip(expected);
        slopes.for_each(|(found, expected)| assert_near(*found, expected, 1e-9, &measure.name));
    }
}

/// Rotors of 2 and 3 kg·m² at 4 and -1 rad/s turn at 1 rad/s together.
#[test]
fn a_clutch_makes_events_happen_when_it_closes() {
    let text = r#"{"name": "clutch", "gravity": [0, 0], "parameters": {"when": 0.5},
        "bars": [{"name": "a", "mass": 1, "centre": [0, 0], "inertia": 2}, {"name": "b", "mass": 1, "centre": [0, 0], "inertia": 3}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
            {"name": "B", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}]}],
        "locks": [{"name": "clutch", "body": "b", "relative_to": "a"}], "inactive": ["clutch"],
        "events": [{"name": "in", "when": "t - when", "on": ["clutch"]},
            {"name": "turned", "when": "b.omega", "direction": "rising"},
            {"name": "slow", "when": "a.omega - 2", "direction": "falling"},
            {"name": "faster", "when": "a.omega - 3", "direction": "rising"}],
        "start": {"a": {"phi": 0, "omega": 4}, "b": {"phi": 1, "omega": -1}}, "until": 2, "every": 2}"#;
    for request in methods() {
        let outcome = run(&scene(text), &request);
        assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
        let found: Vec<_> = outcome.events.iter().map(|event| (event.name.as_str(), event.t)).collect();
        assert_eq!(found, [("in", 0.5), ("turned", 0.5), ("slow", 0.5)], "{:?}", request.method);
    }
    let found = derived(&template(text), &["event:turned", "a.phi"], &["parameters.when"], 1.0);
    assert_eq!(found.lost, None);
    assert_near(found.measures[0].slopes[0], 1.0, 1e-12, "turned");
    assert_near(found.measures[1].slopes[0], 3.0, 1e-9, "a.phi");
}

/// A rotor of 1 kg m² whose torque has a corner where an event sets its parameter: w² grows by twice the torque over
/// half a turn, and over half of that at both ends.
#[test]
fn an_event_sets_a_parameter_where_a_formula_has_its_corner() {
    let text = r#"{"name": "rotor", "gravity": [0, 0], "parameters": {"k": 1},
        "bars": [{"name": "bar", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
        "torques": [{"name": "drive", "body": "bar", "torque": "1*k*if(bar.sin > 0, 1, 2)"}],
        "events": [{"name": "next", "when": "bar.sin", "direction": "rising", "set": {"k": "k + 1"}},
            {"name": "end", "when": "bar.phi - 2.5*pi", "action": "stop"}],
        "start": {"bar": {"phi": "-pi/2", "omega": 1}}, "until": 9, "every": 9}"#;
    for request in methods() {
        let outcome = run(&scene(text), &request);
        assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
        assert_eq!(outcome.ended_by.as_deref(), Some("end"));
        let turned = std::f64::consts::PI * (2.0 + 4.0 + 8.0 + 3.0);
        assert_near(outcome.last.omega[0], (1.0 + turned).sqrt(), 1e-9, "rate");
        assert_eq!(times(&outcome, "next").len(), 2);
    }
}

/// A motor that rests for half a second, kept beside a spring with a corner: the sine of its angle is rounding, and
/// no event comes of that.
#[test]
fn a_function_that_stays_at_zero_makes_no_events() {
    let text = r#"{"name": "rests", "gravity": [0, -9.81], "parameters": {"k": 1},
        "bars": [{"name": "a", "mass": 1, "centre": [0.3, 0], "inertia": 0.1, "length": 0.77},
                 {"name": "b", "mass": 1, "centre": [0.25, 0], "inertia": 0.1, "length": 0.5}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
                   {"name": "B", "between": [{"body": "a", "point": [0.77, 0]}, {"body": "b", "point": [0, 0]}]}],
        "motors": [{"name": "m", "body": "a", "law": "if(t < 0.5, 0, (t - 0.5)^2)*(1 s^-2)"}],
        "torques": [{"name": "tk", "body": "a", "torque": "1*k*sin(a.phi)"}],
        "events": [{"name": "es", "when": "a.sin", "direction": "falling", "set": {"k": "k + 1"}}],
        "start": {"b": {"phi": -1, "omega": 4}}, "until": 1.5, "every": 1.5}"#;
    for request in methods() {
        let request = Request { stabilize: Some(Stabilization::Projection), ..request };
        let outcome = run(&scene(text), &request);
        assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
        assert_eq!(times(&outcome, "es"), [0.0; 0], "{:?}", request.method);
        assert_near(outcome.last.phi[0], 1.0, 1e-10, "angle");
    }
}

/// Angles cos(t) of a rotor on a spring: functions that jump past zero at a corner, of their own or of a signal, are
/// at zero there, with the torque of the signal or without.
#[test]
fn a_function_with_a_corner_passes_zero_in_a_jump() {
    use std::f64::consts::PI;
    let text = |torque: &str| {
        format!(
            r#"{{"name": "rotor", "gravity": [0, 0],
        "bars": [{{"name": "rotor", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "rotor", "point": [0, 0]}}]}}],
        "torsion_springs": [{{"name": "coil", "body": "rotor", "stiffness": 1, "free_angle": 0}}],
        "signals": {{"side": "sign(rotor.phi - 0.5)"}},
        "torques": [{{"name": "none", "body": "rotor", "torque": "{torque}"}}],
        "events": [{{"name": "own", "when": "3*sign(rotor.phi - 0.5) - 1"}}, {{"name": "signal", "when": "side*(2 + t)"}},
                   {{"name": "rising", "when": "if(rotor.phi > 0.5, 1, -t)", "direction": "rising"}},
                   {{"name": "start", "when": "sign(-rotor.omega)"}},
                   {{"name": "kink", "when": "abs(rotor.phi - 0.5) - 0.5"}}],
        "start": {{"rotor": {{"phi": 1, "omega": 0}}}}, "until": 9, "every": 4.5}}"#
        )
    };
    let passes = [PI / 3.0, 5.0 * PI / 3.0, 7.0 * PI / 3.0];
    let starts = [PI, 2.0 * PI];
    let kinks = [PI / 2.0, 1.5 * PI, 2.0 * PI, 2.5 * PI];
    for torque in ["0*side", "1e-30*side"] {
        let fixed = [MethodId::Gauss(4), MethodId::Gauss(8)].map(|method| Request {
            method: Some(method),
            step: Some(0.02),
            ..Request::default()
        });
        for request in methods().into_iter().chain([adaptive(MethodId::Dopri5, 1e-11)]).chain(fixed) {
            let outcome = run(&scene(&text(torque)), &request);
            assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
            for (name, expected) in
                [("own", &passes[..]), ("signal", &passes), ("rising", &passes[1..2]), ("start", &starts)]
            {
                let found = times(&outcome, name);
                assert_eq!(found.len(), expected.len(), "{:?}: {name} at {found:?}", request.method);
                found.iter().zip(expected).for_each(|(t, expected)| assert_near(*t, *expected, 1e-9, name));
            }
            // It begins at zero, and touches it at 2 π.
            let found = times(&outcome, "kink");
            let turns = |t: &&f64| (**t - kinks[2]).abs() > 1e-3 && **t > 1e-3;
            let found: Vec<f64> = found.iter().filter(turns).copied().collect();
            assert_eq!(found.len(), 3, "{:?}: {found:?}", request.method);
            let sure = [kinks[0], kinks[1], kinks[3]];
            found.iter().zip(sure).for_each(|(t, expected)| assert_near(*t, expected, 1e-9, "kink"));
        }
    }
}

/// Two discs of 1 kg m² at -10 and 1 rad/s go on at -4.5 rad/s once they are locked to each other, whatever number
/// the event sets beside that.
#[test]
fn a_joint_that_closes_makes_events_where_a_number_is_set_too() {
    for set in ["", r#", "set": {"k": 2}"#, r#", "set": {"k": 1}"#] {
        let text = format!(
            r#"{{"name": "discs", "gravity": [0, 0], "parameters": {{"k": 1}}, "bars": [
                {{"name": "a", "mass": 1, "centre": [0, 0], "inertia": 1}},
                {{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1}}],
            "hinges": [
                {{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}},
                {{"name": "B", "between": [{{"body": "ground", "point": [3, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
            "locks": [{{"name": "lock", "body": "b", "relative_to": "a"}}], "inactive": ["lock"],
            "events": [{{"name": "back", "when": "b.omega + 2"}},
                {{"name": "late", "when": "b.omega + 2.25*k"}},
                {{"name": "closes", "when": "t - 0.2", "on": ["lock"]{set}}}],
            "start": {{"a": {{"phi": 0, "omega": -10}}, "b": {{"phi": 0, "omega": 1}}}}, "until": 1, "every": 1}}"#
        );
        for request in methods() {
            let outcome = run(&scene(&text), &request);
            assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
            assert_near(outcome.last.omega[1], -4.5, 1e-12, "rate");
            for name in ["closes", "back"] {
                let found = times(&outcome, name);
                assert_eq!(found.len(), 1, "{:?}{set}: {name} at {found:?}", request.method);
                assert_near(found[0], 0.2, 1e-12, name);
            }
            // With k = 2 its function jumps to zero, and stays there.
            assert_eq!(
                times(&outcome, "late").len(),
                usize::from(!set.contains('2')),
                "{:?}{set}",
                request.method
            );
        }
    }
}

/// A rotor at rest on a torque with a corner at the very start: its rate, 3 t² - 2 t, is zero there, which is no
/// event, and passes zero once, at 2/3.
#[test]
fn a_corner_at_the_start_makes_no_event_of_what_is_zero_there() {
    for torque in ["6*max(t, 0) - 2", "3*(t + abs(t)) - 2"] {
        for phi in [0.0, 0.1, -0.5, 0.3, 1.1] {
            let text = format!(
                r#"{{"name": "rotor", "gravity": [0, 0], "until": 1, "every": 1,
                "bars": [{{"name": "r", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 1}}],
                "hinges": [{{"name": "A", "between": [
                    {{"body": "ground", "point": [0, 0]}}, {{"body": "r", "point": [0, 0]}}]}}],
                "torques": [{{"name": "drive", "body": "r", "torque": "{torque}"}}],
                "events": [{{"name": "turn", "when": "r.omega"}}],
                "start": {{"r": {{"phi": {phi}, "omega": 0}}}}}}"#
            );
            for request in methods() {
                let outcome = run(&scene(&text), &request);
                let found = times(&outcome, "turn");
                assert_eq!(found.len(), 1, "{torque}, {phi}, {:?}: {found:?}", request.method);
                assert_near(found[0], 2.0 / 3.0, 1e-9, torque);
            }
        }
    }
}

/// A point comes to its wall at every impact, whatever rounding makes of its height there.
#[test]
fn what_is_zero_at_an_impact_happens_with_it() {
    let fall = 0.2_f64.sqrt();
    let more = r#", "events": [{"name": "down", "when": "p.y"}, {"name": "falls", "when": "p.y", "direction": "falling"}]"#;
    for (e, flights) in [(0.0, &[][..]), (0.6, &[1.2, 0.72][..]), (1.0, &[2.0][..])] {
        let mut expected = vec![fall];
        for flight in flights {
            expected.push(expected[expected.len() - 1] + flight * fall);
        }
        // One that turns meets its wall by a point beside its centre.
        for (omega, point) in [(0.0, 0.0), (0.0, 0.3)] {
            let text = format!(
                r#"{{"name": "ball", "gravity": [0, -10],
                "bars": [{{"name": "ball", "mass": 2, "centre": [{point}, 0], "inertia": 1}}],
                "points": [{{"name": "p", "body": "ball", "point": [{point}, 0]}}],
                "walls": [{{"name": "floor", "body": "ball", "point": [{point}, 0], "restitution": {e},
                           "line": {{"through": [0, 0], "normal": [0, 1]}}}}]{more}, "until": 1.4, "every": 1.4,
                "start": {{"ball": {{"phi": 0.7, "omega": {omega}, "origin": [0.1, {}], "velocity": [0, 0]}}}}}}"#,
                1.0 - point * 0.7_f64.sin()
            );
            for request in methods() {
                let outcome = run(&scene(&text), &request);
                for name in ["down", "falls"] {
                    let found = times(&outcome, name);
                    assert_eq!(found.len(), expected.len(), "{:?}, {e}: {name} at {found:?}", request.method);
                    found
                        .iter()
                        .zip(&expected)
                        .for_each(|(t, expected)| assert_near(*t, *expected, 1e-9, name));
                }
            }
        }
    }
}

/// The rate of what sticks passes zero as it comes to rest, and not again as it breaks away in the same direction
/// as it would have gone on.
#[test]
fn what_breaks_away_makes_events_of_its_direction_alone() {
    for size in [0.3, 0.5, 0.7] {
        let text = format!(
            r#"{{"name": "sticks", "gravity": [0, -9.81], "until": 1.75, "every": 0.25,
            "bars": [{{"name": "b", "mass": 1, "centre": [0.3, 0], "inertia": 0.05, "length": 0.6}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}],
                        "friction": {{"radius": 0.1, "kinetic": 0.5, "static": 0.5}}}}],
            "torques": [{{"name": "T", "body": "b", "torque": "{size}*sin(3*t)"}}],
            "events": [{{"name": "falls", "when": "b.omega", "direction": "falling"}},
                       {{"name": "either", "when": "b.omega"}}],
            "start": {{"b": {{"phi": -1.5, "omega": -2}}}}}}"#
        );
        for request in methods() {
            let outcome = run(&scene(&text), &request);
            // It rises to zero, falls to it where it comes to rest, and goes on below.
            let found = ["falls", "either"].map(|name| times(&outcome, name).len());
            assert_eq!(found, [1, 2], "{size}, {:?}: {:?}", request.method, outcome.events);
        }
    }
}

/// A body meets the floor off its centre; a lock that closes with its rebound takes its spin back, with which a rotor's
/// torque has begun.
#[test]
fn what_an_impact_makes_happen_is_not_taken_back_by_what_happens_with_it() {
    let events = [
        r#"{"name": "brake", "when": "p.vy", "direction": "rising", "on": ["lock"]}"#,
        r#"{"name": "begin", "when": "a.omega - 0.1", "direction": "rising", "set": {"k": 1}}"#,
    ];
    let (met, until) = (0.2_f64.sqrt(), 0.6);
    for [one, other] in [[0, 1], [1, 0]] {
        let text = format!(
            r#"{{"name": "spin", "gravity": [0, -10], "parameters": {{"k": 0}}, "until": {until}, "every": {until},
            "bars": [{{"name": "a", "mass": 1, "centre": [0, 0], "inertia": 0.1}},
                {{"name": "rotor", "mass": 1, "centre": [0, 0], "inertia": 2}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [3, 0]}}, {{"body": "rotor", "point": [0, 0]}}]}}],
            "points": [{{"name": "p", "body": "a", "point": [0.3, 0]}}],
            "torques": [{{"name": "T", "body": "rotor", "torque": "k"}}],
            "walls": [{{"name": "floor", "body": "a", "point": [0.3, 0], "restitution": 0.5,
                "line": {{"through": [0, 0], "normal": [0, 1]}}}}],
            "locks": [{{"name": "lock", "body": "a"}}], "inactive": ["lock"],
            "events": [{}, {}],
            "start": {{"a": {{"phi": 0, "omega": 0, "origin": [0, 1], "velocity": [0, 0]}}, "rotor": {{"phi": 0, "omega": 0}}}}}}"#,
            events[one], events[other]
        );
        let found = scene(&text);
        let rotor = found.bars.iter().position(|bar| bar.name == "rotor").expect("a rotor");
        for request in methods() {
            let outcome = run(&found, &request);
            assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
            for name in ["brake", "begin"] {
                let happened = times(&outcome, name);
                assert_eq!(happened.len(), 1, "{:?}: {name} at {happened:?}", request.method);
                assert_near(happened[0], met, 1e-9, name);
            }
            assert_near(
                outcome.last.phi[rotor],
                0.25 * (until - met) * (until - met),
                1e-9,
                "angle of the rotor",
            );
        }
    }
}

/// Three events at the end of the run: the second one changes what the third sees.
#[test]
fn all_events_at_the_end_of_a_run_happen() {
    let text = |until: f64| {
        format!(
            r#"{{"name": "end", "gravity": [0, 0], "parameters": {{"k": 1}}, "until": {until}, "every": 0.25,
            "bars": [{{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
            "torques": [{{"name": "T", "body": "b", "torque": "k"}}, {{"name": "T0", "body": "b", "torque": 2}}],
            "events": [{{"name": "e0", "when": "t - 1", "set": {{"k": 5}}}}, {{"name": "e1", "when": "1*t - 1", "off": ["T0"]}},
                {{"name": "e2", "when": "2*t - 2"}}],
            "outputs": {{"a": "b.alpha"}}, "start": {{"b": {{"phi": 0, "omega": 0}}}}}}"#
        )
    };
    for request in methods() {
        for until in [1.0, 1.5] {
            let outcome = run(&scene(&text(until)), &request);
            assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
            let names: Vec<&str> = outcome.events.iter().map(|event| event.name.as_str()).collect();
            assert_eq!(names, ["e0", "e1", "e2"], "{:?} to {until}", request.method);
            // 3 rad/s² for a second, then 5.
            let rest = until - 1.0;
            assert_near(outcome.last.omega[0], 3.0 + 5.0 * rest, 1e-9, "rate");
            assert_near(outcome.last.phi[0], 1.5 + 3.0 * rest + 2.5 * rest * rest, 1e-9, "angle");
            assert_near(outcome.last.outputs[0], 5.0, 1e-9, "acceleration");
        }
    }
}

/// Constraints of a method without projection have drifted before an event that changes no rates, and are no
/// reason to stop there.
#[test]
fn an_event_is_not_blamed_for_the_drift_before_it() {
    let text = r#"{"name": "press", "gravity": [0, -9.81],
        "bars": [{"name": "crank", "length": 0.2, "width": 0.02, "thickness": 0.01, "density": 2700},
            {"name": "rod", "length": 0.5, "width": 0.02, "thickness": 0.01, "density": 2700}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "crank", "point": [0, 0]}]},
            {"name": "B", "between": [{"body": "crank", "point": [0.2, 0]}, {"body": "rod", "point": [0, 0]}]}],
        "sliders": [{"name": "piston", "point": {"body": "rod", "point": [0.5, 0]},
            "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}}],
        "torques": [{"name": "T", "body": "crank", "torque": 0.05}],
        "events": [{"name": "cut", "when": "t-1.3", "off": ["T"]}],
        "start": {"crank": {"phi": 1, "omega": 10}, "rod": {"phi": -0.3434}}, "until": 2, "every": 0.1}"#;
    let expected = run(&scene(text), &adaptive(MethodId::Dp8, 1e-12));
    for (method, rtol) in [(MethodId::Dopri5, 1e-6), (MethodId::Dop853, 1e-6)] {
        let outcome = run(&scene(text), &adaptive(method, rtol));
        assert!(outcome.stop.is_none() && times(&outcome, "cut").len() == 1, "{method}: {:?}", outcome.stop);
        assert!(outcome.drift.constraints.iter().any(|(_, [position, _])| position.max > 1e-8), "{method}");
        let off = outcome.last.phi[0] - expected.last.phi[0];
        assert!(off.abs() < 1e-2, "{method}: {off:e}");
    }
}
