//! Joints, locks and motors that events release and close, and events whose functions have corners, in many digits:
//! against closed forms in integer arithmetic.

use super::many_digits::{begun, cosine, fixed, last, near, number, pi, shipped, source};
use driftless::arithmetic::Real;
use driftless::run::digits::{Precision, ShownRow, long_run};
use driftless::stepping::Cause;
use num_bigint::BigInt;

const DIGITS: usize = 60;
const PLACES: u32 = 56;

fn holds(row: &ShownRow, body: usize, expected: &[(usize, BigInt)]) {
    expected.iter().for_each(|(what, value)| near(&number(row.bodies[body][*what]), value, PLACES));
    assert!(row.drift.abs() < 1e-56, "{:e}", row.drift);
}

/// Discs of 1 and 2 kg m² about one axis.
fn discs(parts: &str) -> String {
    let disc = |name: &str, inertia: u32| {
        format!(r#"{{"name": "{name}", "mass": 1, "centre": [0, 0], "inertia": {inertia}, "length": 1}}"#)
    };
    let hinge = |name: &str, body: &str| {
        format!(
            r#"{{"name": "{name}", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "{body}", "point": [0, 0]}}]}}"#
        )
    };
    format!(
        r#"{{"name": "discs", "gravity": [0, 0], "bars": [{}, {}], "hinges": [{}, {}], {parts},
        "start": {{"a": {{"phi": 0, "omega": 3}}, "b": {{"phi": 0.2, "omega": 0}}}}, "until": 9, "every": 9}}"#,
        disc("a", 1),
        disc("b", 2),
        hinge("A", "a"),
        hinge("B", "b")
    )
}

/// A clutch closes at 1 s and opens at 3 s, a motor of 2 rad/s takes hold at 4 s, the clutch again at 5 s: momentum
/// is kept, but for the impulses of the motor, 1 and 2 N m s, which do 2 and 4 J of work.
#[test]
fn a_clutch_and_a_motor_take_hold_where_they_are() {
    let text = discs(
        r#""locks": [{"name": "clutch", "body": "b", "relative_to": "a"}],
        "motors": [{"name": "drive", "body": "a", "law": {"start": 0.7, "rate": 2}}],
        "inactive": ["clutch", "drive"], "events": [
            {"name": "grips", "when": "t - 1", "on": ["clutch"]}, {"name": "opens", "when": "t - 3", "off": ["clutch"]},
            {"name": "drives", "when": "t - 4", "on": ["drive"]}, {"name": "again", "when": "t - 5", "on": ["clutch"]}]"#,
    );
    for (until, a, b, work) in [
        ("2.5", ["4.5", "1"], ["1.7", "1"], "0"),
        ("3.5", ["5.5", "1"], ["2.7", "1"], "0"),
        ("4.5", ["7", "2"], ["3.7", "1"], "2"),
        ("6", ["10", "2"], ["6.2", "2"], "6"),
    ] {
        let row = last(&source(&text, &[], until, until), DIGITS);
        for (body, values) in [a, b].iter().enumerate() {
            holds(&row, body, &[(0, fixed(values[0])), (1, fixed(values[1]))]);
        }
        near(&number(row.energy[2]), &fixed(work), PLACES);
    }
}

/// A bar that flies past a point of the ground sideways is caught there at 1 s, turns about it, and is let go at
/// 2.5 s: its moment of momentum about that point is kept.
#[test]
fn a_hinge_catches_a_bar_in_flight_and_lets_it_go() {
    let text = r#"{"name": "bar", "gravity": [0, 0],
        "bars": [{"name": "bar", "mass": 1, "centre": [0.5, 0], "inertia": 0.5, "length": 1}],
        "hinges": [{"name": "K", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
        "inactive": ["K"], "events": [
            {"name": "caught", "when": "t - 1", "on": ["K"]}, {"name": "free", "when": "t - 2.5", "off": ["K"]}],
        "start": {"bar": {"phi": 0, "omega": 0, "origin": [0, -1], "velocity": [0, 1]}}, "until": 9, "every": 9}"#;
    let third = |digits: &str| fixed(digits) / 3;
    let (cosine, sine) = (cosine(&fixed("1")), cosine(&(fixed("1") - pi() / 2)));
    let row = last(&source(text, &[], "2.5", "2.5"), DIGITS);
    holds(&row, 0, &[(0, fixed("1")), (1, third("2")), (2, &cosine / 2), (3, &sine / 2)]);
    let row = last(&source(text, &[], "4", "4"), DIGITS);
    let flown: [BigInt; 2] = [&cosine / 2 - &sine / 2, &sine / 2 + &cosine / 2];
    holds(&row, 0, &[(0, fixed("2")), (1, third("2")), (2, flown[0].clone()), (3, flown[1].clone())]);
    holds(&row, 0, &[(4, -&sine / 3), (5, &cosine / 3)]);
}

/// What closes has to meet: here it is off by 0.5 m.
#[test]
fn a_hinge_does_not_close_where_its_points_are_apart() {
    let text = r#"{"name": "bar", "gravity": [0, 0],
        "bars": [{"name": "bar", "mass": 1, "centre": [0.5, 0], "inertia": 0.5, "length": 1}],
        "hinges": [{"name": "K", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
        "inactive": ["K"], "events": [{"name": "late", "when": "t - 1.5", "on": ["K"]}],
        "start": {"bar": {"phi": 0, "omega": 0, "origin": [0, -1], "velocity": [0, 1]}}, "until": 9, "every": 9}"#;
    let mut run = long_run(&source(text, &[], "2", "2"), Precision::new(DIGITS, true)).expect("a run");
    let stop = run.row(1, &mut || false).expect_err("apart");
    assert!(stop.what.contains("closes K") && stop.what.contains("by -0.5 m"), "{stop:?}");
}

/// Functions of events with corners: of constant rate, a modulus passes 0.5 twice, and a sign jumps past zero,
/// also by way of a signal.
#[test]
fn events_pass_zero_at_corners_and_in_jumps() {
    let text = discs(
        r#""signals": {"side": "sign(a.phi - 3)"}, "events": [
            {"name": "near", "when": "abs(a.phi - 3) - 0.6"}, {"name": "jumps", "when": "sign(a.phi - 3)"},
            {"name": "side", "when": "1*side", "direction": "rising"},
            {"name": "never", "when": "1*side", "direction": "falling"},
            {"name": "touches", "when": "max(a.phi - 3, 0) + 1"}]"#,
    );
    let mut run = long_run(&source(&text, &[], "2", "2"), Precision::new(DIGITS, false)).expect("a run");
    run.row(1, &mut || false).expect("no stop").expect("no pause");
    let events = run.events();
    let names: Vec<&str> = events.iter().map(|event| event.name.as_str()).collect();
    assert_eq!(names, ["near", "jumps", "side", "near"]);
    for (event, time) in events.iter().zip(["0.8", "1", "1", "1.2"]) {
        near(&number(event.t), &fixed(time), PLACES);
    }
}

/// A disc that is locked has a rate that is rounding, which passes zero in no event; and an event at the corner of a
/// torque happens once.
#[test]
fn what_rests_makes_no_events_and_corners_none_twice() {
    let text = discs(
        r#""locks": [{"name": "lock", "body": "a"}], "inactive": ["lock"],
        "torques": [{"name": "ripple", "body": "a", "torque": "if(a.phi > 2, 0.1, -0.2)*sign(sin(20*t))"}],
        "events": [{"name": "corner", "when": "a.phi - 2"}, {"name": "grips", "when": "t - 1", "on": ["lock"]},
                   {"name": "rests", "when": "1*a.omega"}, {"name": "again", "when": "a.phi - b.phi - 1", "on": ["lock"]}]"#,
    );
    let text = text.replace(r#""phi": 0.2, "omega": 0"#, r#""phi": 5, "omega": 0"#);
    let mut run = long_run(&source(&text, &[], "2", "2"), Precision::new(DIGITS, true)).expect("a run");
    let row = run.row(1, &mut || false).expect("no stop").expect("no pause");
    assert!(row.drift.abs() < 1e-56 && row.residual[1] < 1e-56, "{:e}, {:?}", row.drift, row.residual);
    let events = run.events();
    let names: Vec<&str> = events.iter().map(|event| event.name.as_str()).collect();
    assert_eq!(names, ["corner", "grips"]);
}

/// A run that is interrupted after what closed comes to the same bits.
#[test]
fn a_run_goes_on_with_what_has_closed() {
    let text = discs(
        r#""locks": [{"name": "clutch", "body": "b", "relative_to": "a"}],
        "motors": [{"name": "drive", "body": "a", "law": {"start": 0, "sines": [{"amplitude": 0.3, "frequency": 2, "phase": 1}]}}],
        "torsion_springs": [{"name": "coil", "body": "b", "stiffness": 3, "free_angle": 0}],
        "inactive": ["clutch", "drive"], "events": [
            {"name": "grips", "when": "t - 1", "on": ["clutch"]}, {"name": "opens", "when": "t - 1.8", "off": ["clutch"]},
            {"name": "drives", "when": "b.omega", "on": ["drive"]}, {"name": "again", "when": "t - 3.1", "on": ["clutch"]}]"#,
    );
    let long = source(&text, &[], "4", "0.5");
    let begun = || long_run(&long, Precision::new(DIGITS, true)).expect("a run");
    let mut whole = begun();
    let mut row_of = |number: u64| whole.row(number, &mut || false).expect("no stop").expect("no pause");
    let rows: Vec<ShownRow> = (0..=8).map(&mut row_of).collect();
    for interrupted in [2, 3, 5, 7] {
        let mut first = begun();
        (0..=interrupted).for_each(|number| drop(first.row(number, &mut || false).expect("no stop")));
        let mut second = begun();
        assert!(second.resume(&first.save()));
        for number in interrupted + 1..=8 {
            let row = second.row(number, &mut || false).expect("no stop").expect("no pause");
            assert!(row.bodies == rows[number as usize].bodies, "{interrupted}: row {number}");
        }
    }
    assert!(rows[8].drift.abs() < 1e-55 && rows[8].residual[0] < 1e-55, "{:?}", rows[8]);
}

/// The shipped scenes of parts that are released and closed, against runs in doubles.
#[test]
fn shipped_scenes_are_those_of_runs_in_doubles() {
    for (name, until) in [("latch", "3"), ("trebuchet", "1.5")] {
        let source = source(&shipped(name), &[], until, until);
        let many = last(&source, 30);
        let request = driftless::run::Request {
            until: until.parse().ok(),
            every: until.parse().ok(),
            rtol: Some(1e-13),
            ..driftless::run::Request::default()
        };
        let plain = crate::common::run(&source.scene, &request);
        assert!(plain.stop.is_none() && plain.last.t > 1.0, "{name}: {:?}", plain.stop);
        for (k, body) in many.bodies.iter().enumerate() {
            let off = [body[2].value() - plain.last.centre[k][0], body[1].value() - plain.last.omega[k]];
            assert!(off.iter().all(|off| off.abs() < 1e-8), "{name}, body {k}: {off:?}");
        }
    }
}

/// Events of the moment at which a lock closes happen, though it keeps their functions at zero from then on: a disc
/// of 3 rad/s is caught at 1.5 rad, and the other one is pushed from there.
#[test]
fn events_of_the_moment_at_which_a_lock_closes_happen() {
    let parts = |second: &str| {
        discs(&format!(
            r#""locks": [{{"name": "catch", "body": "a", "angle": 1.5}}], "inactive": ["catch"], "parameters": {{"k": 0}},
            "torques": [{{"name": "push", "body": "b", "torque": "k"}}],
            "events": [{{"name": "caught", "when": "a.phi - 1.5", "on": ["catch"]}},
                       {{"name": "second", "when": "a.phi - 1.5"{second}}}]"#
        ))
    };
    for (second, end) in [("", "0.2"), (r#", "set": {"k": 1}"#, "1.2")] {
        let source = source(&parts(second), &[], "2.5", "2.5");
        holds(&last(&source, DIGITS), 1, &[(0, fixed(end))]);
    }
    let source = source(&parts(r#", "action": "stop""#), &[], "2.5", "0.1");
    let mut run = long_run(&source, Precision::new(DIGITS, false)).expect("a run");
    while run.ended_by().is_none() && run.last_row() > 5 {
        run.row(run.last_row().min(6), &mut || false).expect("no stop");
    }
    let names: Vec<_> = run.events().iter().map(|event| event.name.clone()).collect();
    assert_eq!((run.ended_by(), names), (Some("second"), vec!["caught".to_owned(), "second".into()]));
}

/// A lock that closes between two bars of a slider-crank whose crank a motor turns: no rates fit both, and the run
/// ends at the event, as it does in doubles.
#[test]
fn a_lock_that_holds_what_a_motor_drives_stops_the_run_at_once() {
    let text = r#"{"name": "press", "gravity": [0, -9.81],
        "bars": [{"name": "crank", "mass": 1, "centre": [0.1, 0], "inertia": 0.01, "length": 0.2},
            {"name": "rod", "mass": 1, "centre": [0.25, 0], "inertia": 0.03, "length": 0.5}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "crank", "point": [0, 0]}]},
            {"name": "B", "between": [{"body": "crank", "point": [0.2, 0]}, {"body": "rod", "point": [0, 0]}]}],
        "sliders": [{"name": "piston", "point": {"body": "rod", "point": [0.5, 0]},
            "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}}],
        "motors": [{"name": "M", "body": "crank", "law": {"start": 1, "rate": 2}}],
        "locks": [{"name": "brake", "body": "rod", "relative_to": "crank"}], "inactive": ["brake"],
        "events": [{"name": "grips", "when": "t - 0.3", "on": ["brake"]}],
        "start": {"rod": {"phi": -0.34}}, "until": 1, "every": 1}"#;
    let mut run = begun(&source(text, &[], "1", "1"), 22);
    let stop = run.row(1, &mut || false).expect_err("no rates fit");
    assert!(stop.what.contains("an event closes brake, and leaves constraint "), "{stop:?}");
    assert!((stop.t - 0.3).abs() < 1e-14 && stop.cause == Cause::Unsuited, "{stop:?}");
}
