//! Events in many digits, against closed forms in integer arithmetic and against runs in doubles.

use super::many_digits::{fixed, near, number, one, pi, shipped, source, times};
use driftless::run::Request;
use driftless::run::digits::{
    DigitsPair, DigitsSource, LongEvent, LongRun, PairProgress, Precision, long_run,
};
use driftless::{MethodId, Simulation, scene::parse_scene};
use num_bigint::BigInt;

const DIGITS: usize = 60;
const PLACES: u32 = 56;

fn begun(source: &DigitsSource) -> Box<dyn LongRun> {
    long_run(source, Precision::new(DIGITS, false)).expect("a run")
}

/// A run to its end, row by row.
fn ended(source: &DigitsSource) -> Box<dyn LongRun> {
    let mut run = begun(source);
    let mut number = 0;
    while number <= run.last_row() {
        run.row(number, &mut || false).expect("no stop").expect("no pause");
        number += 1;
    }
    run
}

fn agree(events: &[LongEvent], expected: &[(&str, BigInt)]) {
    let names: Vec<_> = events.iter().map(|event| event.name.as_str()).collect();
    let wanted: Vec<_> = expected.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, wanted);
    for (event, (_, t)) in events.iter().zip(expected) {
        near(&number(event.t), t, PLACES);
    }
}

/// A bar that turns at 1 rad/s is level at every multiple of π, and upright half-way.
#[test]
fn a_turning_bar_passes_its_angles_at_multiples_of_pi() {
    let scene = |action: &str| {
        format!(
            r#"{{"name": "bar", "gravity": [0, 0],
            "bars": [{{"name": "bar", "mass": 1, "centre": [0, 0], "inertia": 1}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}}],
            "events": [{{"name": "level", "when": "bar.sin"}},
                {{"name": "up", "when": "bar.cos", "direction": "falling"}},
                {{"name": "turned", "when": "bar.phi - 3.2*pi"{action}}}],
            "start": {{"bar": {{"phi": 0, "omega": 1}}}}, "until": 11, "every": 0.5}}"#
        )
    };
    let half = pi() / 2;
    let turned = ("turned", pi() * 16 / 5);
    let run = ended(&source(&scene(""), &[], "11", "0.5"));
    let passed = [("up", 1), ("level", 2), ("level", 4), ("up", 5), ("level", 6)];
    let mut expected: Vec<_> = passed.iter().map(|&(name, count)| (name, &half * count)).collect();
    expected.push(turned);
    agree(&run.events(), &expected);
    assert_eq!((run.ended_by(), run.last_row()), (None, 22));

    let run = ended(&source(&scene(r#", "action": "stop""#), &[], "11", "0.5"));
    agree(&run.events(), &expected);
    assert_eq!((run.ended_by(), run.last_row()), (Some("turned"), 21));
    assert!((run.last_time() - 3.2 * std::f64::consts::PI).abs() < 1e-14);
}

/// Of a zero of third order a third of the digits are known.
#[test]
fn a_formula_may_be_flat_where_it_passes_zero() {
    let text = r#"{"name": "bar", "gravity": [0, 0],
        "bars": [{"name": "bar", "mass": 1, "centre": [0, 0], "inertia": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
        "events": [{"name": "level", "when": "bar.sin^3"}],
        "start": {"bar": {"phi": 0, "omega": 1}}, "until": 7, "every": 7}"#;
    let events = ended(&source(text, &[], "7", "7")).events();
    assert_eq!(events.len(), 2);
    for (event, count) in events.iter().zip(1..) {
        near(&number(event.t), &(pi() * count), PLACES / 3);
    }
}

/// A ball that is dropped from 1 m at 10 m/s², with 0.6 of its speed left after each impact: it flies 2 e v/g,
/// is highest half-way, and turns around at its impacts.
#[test]
fn a_ball_turns_around_at_its_impacts_and_between_them() {
    let text = r#"{"name": "ball", "gravity": [0, -10],
        "bars": [{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 1}],
        "points": [{"name": "p", "body": "ball", "point": [0, 0]}],
        "walls": [{"name": "floor", "body": "ball", "point": [0, 0], "restitution": 0.6,
                   "line": {"through": [0, 0], "normal": [0, 1]}}],
        "events": [{"name": "up", "when": "p.vy", "direction": "rising"},
            {"name": "down", "when": "p.vy", "direction": "falling"},
            {"name": "floor", "when": "p.y"}, {"name": "half", "when": "p.y - 1/2"}, {"name": "fast", "when": "p.vy - 2", "direction": "rising"}],
        "start": {"ball": {"phi": 0, "omega": 0, "origin": [0, 1], "velocity": [0, 0]}}, "until": 1.4, "every": 0.7}"#;
    let long = source(text, &[], "1.4", "0.7");
    let run = ended(&long);
    let e = fixed("0.6");
    let fall = (fixed("0.2") * one()).sqrt();
    let flights = [times(&e, &fall) * 2, times(&times(&e, &e), &fall) * 2];
    let ups = [fall.clone(), &fall + &flights[0], &fall + &flights[0] + &flights[1]];
    let expected = [
        ("half", (fixed("0.1") * one()).sqrt()),
        ("floor", ups[0].clone()),
        ("up", ups[0].clone()),
        ("fast", ups[0].clone()),
        ("down", &fall + &flights[0] / 2),
        ("floor", ups[1].clone()),
        ("up", ups[1].clone()),
        ("down", &ups[1] + &flights[1] / 2),
        ("floor", ups[2].clone()),
        ("up", ups[2].clone()),
    ];
    agree(&run.events(), &expected);
    let up = &run.events()[2];
    near(&number(up.omega[2]), &(times(&fall, &fixed("10")) * 6 / 10), PLACES);

    // Interrupted after its second row it comes to the same events, to the last bit.
    let mut first = begun(&long);
    for row in 0..2 {
        first.row(row, &mut || false).expect("no stop").expect("no pause");
    }
    let mut second = begun(&long);
    assert!(second.resume(&first.save()));
    second.row(2, &mut || false).expect("no stop").expect("no pause");
    let numbers = |events: &[LongEvent]| events.iter().map(|event| event.t).collect::<Vec<_>>();
    assert!(numbers(&second.events()) == numbers(&run.events()));
}

/// Formulas of every kind, on a double pendulum, and on closed loops.
#[test]
fn events_are_those_of_runs_in_doubles() {
    for (name, events) in [
        (
            "free",
            r#"{"name": "a", "when": "bar2.phi - bar1.phi"}, {"name": "b", "when": "bar1.omega*bar2.omega - 1 s^-2*sin(3*t)", "direction": "rising"},
            {"name": "c", "when": "1/(1.2 + bar2.cos) - 2"}, {"name": "d", "when": "sqrt(1.05 + bar1.sin) - 0.4", "direction": "falling"}"#,
        ),
        ("four_bars", r#"{"name": "a", "when": "U0.omega + 3"}, {"name": "b", "when": "exp(U0.sin) - 1.5"}"#),
    ] {
        let text = shipped(name);
        let text = text.trim_end().strip_suffix('}').expect("an object").to_owned()
            + &format!(r#", "events": [{events}]}}"#);
        let scene = parse_scene(&text, "test", &[]).unwrap_or_else(|error| panic!("{name}: {error}"));
        let request = Request {
            method: Some(MethodId::Taylor),
            rtol: Some(1e-14),
            until: Some(6.0),
            every: Some(6.0),
            ..Request::default()
        };
        let simulation = Simulation::new(&scene).expect("equations").options(request);
        let outcome = simulation.run().expect("a run");
        let events = ended(&source(&text, &[], "6", "6")).events();
        assert!(events.len() > 4, "{name}: {} events", events.len());
        assert_eq!(events.len(), outcome.events.len(), "{name}");
        for (long, plain) in events.iter().zip(&outcome.events) {
            let t: f64 = format!("{:?}", long.t).parse().expect("a number");
            assert!(long.name == plain.name && (t - plain.t).abs() < 1e-8, "{name}: {t} and {plain:?}");
        }
    }
}

/// A checkpoint after the last row holds what happened in the step that row is in, and what has ended the run.
#[test]
fn a_pair_resumed_at_its_end_has_all_events() {
    let long = |action: &str| {
        let text = format!(
            r#"{{"name": "bar", "gravity": [0, 0],
            "bars": [{{"name": "bar", "mass": 1, "centre": [0, 0], "inertia": 1}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}}],
            "events": [{{"name": "level", "when": "bar.sin"{action}}}],
            "start": {{"bar": {{"phi": 0, "omega": 1}}}}, "until": 3.2, "every": 0.5}}"#
        );
        source(&text, &[], "3.2", "0.5")
    };
    for (action, ended_by) in [("", None), (r#", "action": "stop""#, Some("level"))] {
        let long = long(action);
        let precisions = [Precision::new(DIGITS, false), Precision::new(DIGITS + 10, false)];
        let begun = || DigitsPair::new(&long, &precisions).expect("two runs");
        let mut pair = begun();
        while !matches!(pair.go(&|| false).expect("no stop"), PairProgress::Over) {}
        let (saved, next) = pair.save();
        let mut other = begun();
        assert!(other.resume(saved, next));
        assert!(matches!(other.go(&|| false).expect("no stop"), PairProgress::Over));
        for pair in [&pair, &other] {
            let events = pair.events();
            assert_eq!(events.len(), 1, "{action}");
            near(&number(events[0].0.t), &pi(), PLACES);
            assert!(events[0].1.expect("an agreement") > 50.0);
            assert!(pair.runs().iter().all(|run| run.ended_by() == ended_by));
        }
    }
}

/// Events of one moment all happen, whichever changes what acts: a rotor of 1 rad/s passes 1, 2 and 3 rad.
#[test]
fn events_of_the_moment_at_which_one_sets_a_parameter_happen() {
    for (one, two) in [("set", "plain"), ("plain", "set")] {
        let event = |name: &str| {
            let set = if name == "set" { r#", "set": {"k": "k + 1"}"# } else { "" };
            format!(r#"{{"name": "{name}", "when": "(rotor.phi - 1)*(rotor.phi - 2)*(rotor.phi - 3)"{set}}}"#)
        };
        let text = format!(
            r#"{{"name": "rotor", "gravity": [0, 0], "parameters": {{"k": 0}},
            "bars": [{{"name": "rotor", "mass": 1, "centre": [0, 0], "inertia": 1}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "rotor", "point": [0, 0]}}]}}],
            "torques": [{{"name": "none", "body": "rotor", "torque": "0*k*rotor.phi"}}],
            "events": [{}, {}], "start": {{"rotor": {{"phi": 0.5, "omega": 1}}}}, "until": 3, "every": 3}}"#,
            event(one),
            event(two)
        );
        let run = ended(&source(&text, &[], "3", "3"));
        let at = |whole: &str| fixed(whole);
        let times = [at("0.5"), at("1.5"), at("2.5")];
        let expected: Vec<_> = times.iter().flat_map(|t| [(one, t.clone()), (two, t.clone())]).collect();
        agree(&run.events(), &expected);
    }
}

/// Functions that touch zero at their corners pass it nowhere, and those that go through it do so once, whatever
/// their slope: a rotor of 1 rad/s, in many digits and in doubles.
#[test]
fn what_touches_zero_at_a_corner_has_not_passed_it() {
    let event = |name: &str, when: &str| format!(r#"{{"name": "{name}", "when": "{when}"}}"#);
    let events = [
        event("touches", "abs(rotor.phi)"),
        event("ends", "max(rotor.phi, 0)"),
        event("bends", "if(rotor.phi > 0, rotor.phi, -2*rotor.phi)"),
        event("begins", "max(rotor.phi, 0.3) - 0.3"),
        event("goes", "abs(rotor.phi)*rotor.phi"),
        event("jumps", "sign(rotor.phi - 0.5)"),
    ]
    .join(", ");
    let text = format!(
        r#"{{"name": "rotor", "gravity": [0, 0], "events": [{events}],
        "bars": [{{"name": "rotor", "mass": 1, "centre": [0, 0], "inertia": 1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "rotor", "point": [0, 0]}}]}}],
        "start": {{"rotor": {{"phi": -0.75, "omega": 1}}}}, "until": 2, "every": 2}}"#
    );
    agree(
        &ended(&source(&text, &[], "2", "2")).events(),
        &[("goes", fixed("0.75")), ("jumps", fixed("1.25"))],
    );
    let scene = parse_scene(&text, "rotor", &[]).expect("a scene");
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Radau(5)] {
        let outcome = Simulation::new(&scene).expect("equations").method(method).run().expect("a run");
        let names: Vec<_> = outcome.events.iter().map(|event| event.name.as_str()).collect();
        assert_eq!(names, ["goes", "jumps"], "{method}");
    }
}
