//! Formulas with corners, events that change what acts, and walls that move, in many digits: against closed forms
//! in integer arithmetic.

use super::many_digits::{cosine, fixed, last, near, number, one, over, pi, root, source, text, times};
use driftless::arithmetic::Real;
use driftless::run::digits::{
    DigitsPair, DigitsSource, LongRun, PairProgress, Precision, SavedDigits, long_run,
};
use driftless::stepping::Cause;
use num_bigint::BigInt;

const DIGITS: usize = 60;
const PLACES: u32 = 56;

/// A rotor of moment of inertia 1 kg m², with what acts on it.
fn rotor(parts: &str, phi: &str, omega: &str) -> String {
    format!(
        r#"{{"name": "rotor", "gravity": [0, 0],
        "bars": [{{"name": "rotor", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "rotor", "point": [0, 0]}}]}}],
        {parts}, "start": {{"rotor": {{"phi": {phi}, "omega": {omega}}}}}, "until": 9, "every": 9}}"#
    )
}

fn at(parts: &str, [phi, omega]: [&str; 2], until: &str) -> [BigInt; 2] {
    let row = last(&source(&rotor(parts, phi, omega), &[], until, until), DIGITS);
    assert!(row.drift.abs() < 1e-56, "{parts}: {:e}", row.drift);
    [number(row.bodies[0][0]), number(row.bodies[0][1])]
}

fn begun(source: &DigitsSource) -> Box<dyn LongRun> {
    long_run(source, Precision::new(DIGITS, false)).expect("a run")
}

/// A spring of 4 N·m/rad on one side of zero and of 1 N·m/rad on the other: half a period of π/2, and one of π, by
/// corners of every kind, and by events.
#[test]
fn an_oscillator_with_two_stiffnesses_returns_after_both_of_its_half_periods() {
    let torque =
        |law: &str| format!(r#""torques": [{{"name": "spring", "body": "rotor", "torque": "{law}"}}]"#);
    let cases = [
        torque("-if(rotor.phi > 0, 4, 1)*rotor.phi"),
        torque("-max(4*rotor.phi, 1*rotor.phi)"),
        torque("-2.5*rotor.phi - 1.5*abs(rotor.phi)"),
        format!(r#""signals": {{"k": "2.5 + 1.5*sign(rotor.phi)"}}, {}"#, torque("-k*rotor.phi")),
        r#""torsion_springs": [{"name": "spring", "body": "rotor", "potential": "if(angle > 0, 2, 0.5)*angle^2"}]"#
            .to_owned(),
        r#""parameters": {"k": 4}, "events": [{"name": "through", "when": "rotor.phi", "set": {"k": "5 - k"}}],
           "torsion_springs": [{"name": "spring", "body": "rotor", "potential": "k/2*angle^2"}]"#
            .to_owned(),
        r#""torsion_springs": [{"name": "hard", "body": "rotor", "stiffness": 4, "free_angle": 0},
                               {"name": "soft", "body": "rotor", "stiffness": 1, "free_angle": 0}],
           "inactive": ["soft"], "events": [
               {"name": "down", "when": "rotor.phi", "direction": "falling", "off": ["hard"], "on": ["soft"]},
               {"name": "up", "when": "rotor.phi", "direction": "rising", "off": ["soft"], "on": ["hard"]}]"#
            .to_owned(),
    ];
    let until = text(&(pi() * 3));
    for parts in &cases {
        let [phi, omega] = at(parts, ["0", "1"], &until);
        near(&phi, &BigInt::ZERO, PLACES);
        near(&omega, &one(), PLACES);
    }
}

/// A torque of constant size against the angle: parabolas of two seconds.
#[test]
fn a_torque_with_the_sign_of_the_angle_makes_parabolas() {
    let torque = r#""torques": [{"name": "sign", "body": "rotor", "torque": "-1*sign(rotor.phi)"}]"#;
    let [phi, omega] = at(torque, ["0", "1"], "7.25");
    // 1.25 s into the fourth half: -(1.25 - 1.25²/2).
    near(&phi, &-fixed("0.46875"), PLACES);
    near(&omega, &fixed("0.25"), PLACES);
}

/// Where both branches drive the motion back, there is none.
#[test]
fn a_law_that_holds_the_motion_at_its_corner_stops_the_run() {
    let torque = r#""torques": [{"name": "brake", "body": "rotor", "torque": "-0.3*sign(rotor.omega)"}]"#;
    let mut run = begun(&source(&rotor(torque, "0", "1"), &[], "9", "9"));
    let stop = run.row(1, &mut || false).expect_err("no motion beyond");
    assert_eq!(stop.cause, Cause::Sliding);
    assert!(stop.what.contains("`brake`") && (stop.t - 1.0 / 0.3).abs() < 1e-14, "{stop:?}");
}

/// A spring of 4 N·m/rad that is let go where it turns back, and acts again from 3 s on: what it stored is gone.
#[test]
fn a_spring_that_events_switch_leaves_the_rotor_where_it_is() {
    let parts = r#""torsion_springs": [{"name": "spring", "body": "rotor", "stiffness": 4, "free_angle": 0}],
        "events": [{"name": "back", "when": "rotor.omega", "direction": "falling", "off": ["spring"]},
                   {"name": "again", "when": "t - 3", "on": ["spring"]}]"#;
    let [phi, omega] = at(parts, ["0", "1"], "2.9");
    near(&phi, &fixed("0.5"), PLACES);
    near(&omega, &BigInt::ZERO, PLACES);
    let [phi, _] = at(parts, ["0", "1"], "3.7");
    near(&phi, &(cosine(&fixed("1.4")) / 2), PLACES);
}

/// A motor that begins to turn after 1 s, evenly accelerated; one that jumps is refused.
#[test]
fn a_motor_keeps_its_law_through_a_corner() {
    let motor = |law: &str| {
        rotor(&format!(r#""motors": [{{"name": "motor", "body": "rotor", "law": "{law}"}}]"#), "0", "0")
            .replace(r#""start": {"rotor": {"phi": 0, "omega": 0}}, "#, "")
    };
    let row = last(&source(&motor("if(t > 1, 0.3*(t - 1)^2, 0)"), &[], "2.5", "2.5"), DIGITS);
    near(&number(row.bodies[0][0]), &fixed("0.675"), PLACES);
    near(&number(row.bodies[0][1]), &fixed("0.9"), PLACES);
    let mut run = begun(&source(&motor("if(t > 1, 0.3, 0)"), &[], "2.5", "2.5"));
    let stop = run.row(1, &mut || false).expect_err("a jump");
    assert!(stop.what.contains("jumps") && stop.cause == Cause::Unsuited, "{stop:?}");
}

/// Three points of a table, and the slope of its spline at the second one.
struct Spline {
    points: [[BigInt; 2]; 3],
    slope: BigInt,
}

impl Spline {
    fn new(points: [[&str; 2]; 3]) -> Self {
        let points = points.map(|point| point.map(fixed));
        let (before, after) = (&points[1][0] - &points[0][0], &points[2][0] - &points[1][0]);
        let chord =
            |k: usize| over(&(&points[k + 1][1] - &points[k][1]), &(&points[k + 1][0] - &points[k][0]));
        // 2 (h0 + h1) s = 3 (h1 m0 + h0 m1), level at both ends
        let sum = times(&after, &chord(0)) + times(&before, &chord(1));
        let slope = over(&(sum * 3), &((before + after) * 2));
        Self { points, slope }
    }

    /// The integral over the pieces between the points.
    fn integral(&self) -> BigInt {
        let piece = |k: usize, [from, to]: [&BigInt; 2]| {
            let h = &self.points[k + 1][0] - &self.points[k][0];
            let mean = (&self.points[k][1] + &self.points[k + 1][1]) / 2;
            times(&h, &mean) + times(&times(&h, &h), &(from - to)) / 12
        };
        piece(0, [&BigInt::ZERO, &self.slope]) + piece(1, [&self.slope, &BigInt::ZERO])
    }

    /// In the middle of the second piece: value and slope.
    fn middle(&self) -> [BigInt; 2] {
        let [_, [a, u], [b, v]] = &self.points;
        let h = b - a;
        [(u + v) / 2 + times(&h, &self.slope) / 8, over(&((v - u) * 3), &h) / 2 - &self.slope / 4]
    }
}

/// Splines through points that are no doubles: the work of a torque over an angle, its impulse over time, and the
/// angle of a motor.
#[test]
fn tables_are_splines_through_their_points_as_written() {
    let points = [["0.1", "0.3"], ["1.3", "2.7"], ["2.2", "-0.4"]];
    let spline = Spline::new(points);
    let table = format!(r#""tables": {{"f": [{}]}}"#, points.map(|[x, y]| format!("[{x}, {y}]")).join(", "));
    let acting = |what: &str| {
        let torque = r#"[{"name": "law", "body": "rotor", "torque": "1*s"}]"#;
        format!(r#"{table}, "signals": {{"s": "{what}"}}, "torques": {torque}"#)
    };
    // Before the first point 0.3 over 0.1 s, after the last one -0.4 over 0.3 s.
    let [_, omega] = at(&acting("f(t)"), ["0", "1"], "2.5");
    near(&omega, &(one() + fixed("0.03") + spline.integral() - fixed("0.12")), PLACES - 1);
    // From an angle of 0 to one of 2.5.
    let parts = format!(
        r#"{}, "events": [{{"name": "there", "when": "rotor.phi - 2.5", "action": "stop"}}]"#,
        acting("f(rotor.phi)")
    );
    let mut run = begun(&source(&rotor(&parts, "0", "1"), &[], "9", "9"));
    run.row(1, &mut || false).expect("no stop").expect("no pause");
    let omega = number(run.events()[0].omega[0]);
    let twice = (fixed("0.03") + spline.integral() - fixed("0.12")) * 2;
    near(&times(&omega, &omega), &(one() + twice), PLACES - 1);
    // 1.75 s is in the middle of the second piece.
    let parts = format!(r#"{table}, "motors": [{{"name": "motor", "body": "rotor", "law": "f(t)"}}]"#);
    let motor = rotor(&parts, "0", "0").replace(r#""start": {"rotor": {"phi": 0, "omega": 0}}, "#, "");
    let row = last(&source(&motor, &[], "1.75", "1.75"), DIGITS);
    let [angle, rate] = spline.middle();
    near(&number(row.bodies[0][0]), &angle, PLACES);
    near(&number(row.bodies[0][1]), &rate, PLACES - 1);
}

/// A ball of 2 kg.
fn ball(parts: &str) -> String {
    format!(
        r#"{{"name": "ball", "gravity": [0, -10],
        "bars": [{{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 1}}],
        "points": [{{"name": "p", "body": "ball", "point": [0, 0]}}], {parts},
        "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [0, 1], "velocity": [0, 0]}}}}, "until": 1, "every": 1}}"#
    )
}

fn floor(law: &str) -> String {
    format!(
        r#""walls": [{{"name": "floor", "body": "ball", "point": [0, 0], "restitution": 0.6{law},
                       "line": {{"through": [0, 0], "normal": [0, 1]}}}}]"#
    )
}

/// A drag of 3 N against the velocity changes its sign at the impact, as the velocity does.
#[test]
fn a_formula_comes_to_its_corner_by_an_impact() {
    let drag =
        r#""forces": [{"name": "drag", "body": "ball", "point": [0, 0], "force": [0, "-3*sign(p.vy)"]}]"#;
    let text = ball(&format!("{}, {drag}", floor("")));
    let row = last(&source(&text, &[], "0.75", "0.75"), DIGITS);
    let fall = root(&over(&fixed("2"), &fixed("8.5")));
    let (after, speed) = (fixed("0.75") - &fall, times(&fixed("5.1"), &fall));
    // Up to its top, and down again.
    let rise = over(&speed, &fixed("11.5"));
    assert!(rise < after);
    let sink = &after - &rise;
    let top = times(&speed, &rise) / 2;
    near(&number(row.bodies[0][3]), &(top - times(&fixed("4.25"), &times(&sink, &sink))), PLACES);
    near(&number(row.bodies[0][5]), &-times(&fixed("8.5"), &sink), PLACES);
    assert!(row.drift.abs() < 1e-57, "{:e}", row.drift);
}

/// From a floor that is evenly accelerated upwards the ball falls faster and bounces as from one that rests; the
/// work of the floor is in the balance.
#[test]
fn a_ball_bounces_on_a_floor_that_moves_as_seen_from_it() {
    let law = r#", "law": {"start": -0.1, "rate": 0.5, "acceleration": 2}"#;
    let long = source(&ball(&floor(law)), &[], "0.8", "0.8");
    let row = last(&long, DIGITS);
    // 1.1 - t/2 - 6 t² = 0
    let t = (root(&fixed("26.65")) - fixed("0.5")) / 12;
    let after = fixed("0.8") - &t;
    let up = times(&fixed("0.6"), &(fixed("0.5") + times(&fixed("12"), &t)));
    let above = times(&up, &after) - times(&fixed("6"), &times(&after, &after));
    assert!(above > BigInt::ZERO);
    let travel = fixed("-0.1") + fixed("0.4") + fixed("0.64");
    near(&number(row.bodies[0][3]), &(above + travel), PLACES);
    let speed = up - times(&fixed("12"), &after) + fixed("0.5") + fixed("1.6");
    near(&number(row.bodies[0][5]), &speed, PLACES);
    assert!(row.drift.abs() < 1e-57 && row.energy[2].value() > 1.0, "{:e} {:?}", row.drift, row.energy[2]);
}

/// A motor that drives a point into a wall.
#[test]
fn a_point_that_a_motor_drives_into_a_wall_has_no_way_back() {
    let parts = r#""motors": [{"name": "motor", "body": "rotor", "law": "2*t/(1 s)"}],
        "walls": [{"name": "stop", "body": "rotor", "point": [1, 0], "restitution": 0.6,
                   "line": {"through": [0, 0], "normal": [1, 0]}}]"#;
    let text = rotor(parts, "0", "0").replace(r#""start": {"rotor": {"phi": 0, "omega": 0}}, "#, "");
    let mut run = begun(&source(&text, &[], "9", "9"));
    let stop = run.row(1, &mut || false).expect_err("no way back");
    assert!(stop.what.contains("no way back") && stop.what.contains("stop"), "{stop:?}");
    assert!((stop.t - 0.25 * std::f64::consts::PI).abs() < 1e-14, "{stop:?}");
}

/// Two balls on a line, of which one carries the wall: momentum is kept, and 0.6 of their approach comes back.
#[test]
fn a_wall_on_a_body_is_pushed_back() {
    let text = r#"{"name": "two", "gravity": [0, 0],
        "bars": [{"name": "a", "mass": 2, "centre": [0, 0], "inertia": 1}, {"name": "b", "mass": 3, "centre": [0, 0], "inertia": 1}],
        "walls": [{"name": "buffer", "body": "a", "point": [0, 0], "restitution": 0.6,
                   "line": {"body": "b", "through": [0, 0], "normal": [1, 0]}}],
        "start": {"a": {"phi": 0, "omega": 0, "origin": [1, 0], "velocity": [-1, 0]},
                  "b": {"phi": 0, "omega": 0, "origin": [-1, 0], "velocity": [0.7, 0]}}, "until": 2, "every": 2}"#;
    let row = last(&source(text, &[], "2", "2"), DIGITS);
    // They meet after 2/1.7 s; the impulse is 1.6·1.7·6/5.
    let after = fixed("2") - over(&fixed("2"), &fixed("1.7"));
    let place = over(&fixed("2"), &fixed("1.7"));
    for (body, change, before, from) in [(0, "1.632", "-1", "1"), (1, "-1.088", "0.7", "-1")] {
        let speed = fixed(before) + fixed(change);
        near(&number(row.bodies[body][4]), &speed, PLACES);
        let at = fixed(from) + times(&fixed(before), &place) + times(&speed, &after);
        near(&number(row.bodies[body][2]), &at, PLACES);
    }
    assert!(row.drift.abs() < 1e-57, "{:e}", row.drift);
}

/// A run that is interrupted after corners and events comes to the same bits.
#[test]
fn a_run_goes_on_with_what_acts() {
    let parts = r#""parameters": {"k": 4}, "events": [{"name": "through", "when": "rotor.phi - 0.1", "set": {"k": "5 - k"}},
            {"name": "free", "when": "t - 3.1", "off": ["coil"]}],
        "torques": [{"name": "spring", "body": "rotor", "torque": "-k*rotor.phi - 0.1*sign(rotor.omega)"}],
        "torsion_springs": [{"name": "coil", "body": "rotor", "stiffness": 1, "free_angle": 0.2}]"#;
    let long = source(&rotor(parts, "0", "1"), &[], "6", "0.5");
    let mut whole = begun(&long);
    let mut row_of = |number: u64| whole.row(number, &mut || false).expect("no stop").expect("no pause");
    let rows: Vec<_> = (0..=12).map(&mut row_of).collect();
    for interrupted in [1, 4, 7, 9] {
        let mut first = begun(&long);
        for number in 0..=interrupted {
            first.row(number, &mut || false).expect("no stop").expect("no pause");
        }
        let mut second = begun(&long);
        assert!(second.resume(&first.save()));
        for number in interrupted + 1..=12 {
            let row = second.row(number, &mut || false).expect("no stop").expect("no pause");
            assert!(row.bodies == rows[number as usize].bodies, "{interrupted}: row {number}");
        }
    }
    assert!(rows[12].drift.abs() < 1e-56, "{:e}", rows[12].drift);
}

/// A wall that is switched on in front of which a point is not: where a ball has fallen to 4 m below the floor.
#[test]
fn a_wall_is_not_switched_on_in_front_of_its_point() {
    let parts = format!(
        r#"{}, "inactive": ["floor"], "events": [{{"name": "late", "when": "t - 1", "on": ["floor"]}}]"#,
        floor("")
    );
    let mut run = begun(&source(&ball(&parts), &[], "2", "2"));
    let stop = run.row(1, &mut || false).expect_err("a wall in front of its point");
    assert!(stop.what.contains("floor") && stop.what.contains("behind") && stop.t == 1.0, "{stop:?}");
}

/// Runs that are interrupted again and again on their way to a row come to it all the same, to the same bits.
#[test]
fn a_pair_goes_on_from_the_middle_of_a_row() {
    let parts =
        r#""torques": [{"name": "spring", "body": "rotor", "torque": "-if(rotor.phi > 0, 9, 5)*rotor.phi"}]"#;
    let long = source(&rotor(parts, "0", "1"), &[], "8", "8");
    let precisions = [Precision::new(DIGITS, false), Precision::new(DIGITS + 10, false)];
    let begun = || DigitsPair::new(&long, &precisions).expect("two runs");
    let rows = |pair: &mut DigitsPair, pause: &(dyn Fn() -> bool + Sync)| {
        let mut rows = Vec::new();
        loop {
            match pair.go(pause).expect("no stop") {
                PairProgress::Rows(more) => rows.extend(more.into_iter().map(|(row, _)| row.bodies)),
                PairProgress::Over => return (rows, true),
                PairProgress::Paused => return (rows, false),
            }
        }
    };
    let (expected, _) = rows(&mut begun(), &|| false);
    let mut saved: Option<Vec<SavedDigits>> = None;
    let (mut next, mut found) = (0, Vec::new());
    for _ in 0..100 {
        // Each step is followed by a pause, and by a new process.
        let mut pair = begun();
        if let Some(saved) = &saved {
            assert!(pair.resume(saved, next));
        }
        let (more, is_over) = rows(&mut pair, &|| true);
        found.extend(more);
        if is_over {
            break;
        }
        let (states, number) = pair.save();
        (saved, next) = (Some(states.to_vec()), number);
    }
    assert!(found == expected, "{} rows instead of {}", found.len(), expected.len());
}

/// Two pendulums of which the second follows the first by a gear or a cam, with corners on the way.
fn followed(law: &str, parts: &str, gravity: f64, omega: f64) -> String {
    let bar = |name| {
        format!(r#"{{"name": "{name}", "mass": 1, "centre": [0.2, 0], "inertia": 0.0133, "length": 0.4}}"#)
    };
    format!(
        r#"{{"name": "followed", "gravity": [0, {gravity}], "bars": [{}, {}], "hinges": [
            {{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}},
            {{"name": "B", "between": [{{"body": "ground", "point": [1, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
        "motors": [{{"name": "m", "body": "b", "law": "{law}"}}], {parts}
        "start": {{"a": {{"phi": -1, "omega": {omega}}}}}, "until": 9, "every": 9}}"#,
        bar("a"),
        bar("b")
    )
}

/// Steps keep the digits of the run, however many more its numbers carry: that is what laws of motors have to meet
/// at their corners, and conditions to be zero in.
#[test]
fn what_follows_passes_its_corners_in_any_number_of_digits() {
    let table = r#""torques": [{"name": "T", "body": "a", "torque": "0.3*tb(a.sin)"}],
        "tables": {"tb": [[-0.5, 0.3], [0, 0], [0.3, 1], [0.6, 0.2]]},"#;
    let mut cases = Vec::new();
    for omega in [10.0, 10.168, 10.5] {
        cases.push((followed("abs(a.sin)*a.sin", "", -9.81, omega), "1"));
    }
    cases.push((followed("-0.5*a.phi", table, -1.0, 9.0), "2"));
    for (text, until) in &cases {
        let source = source(text, &[], until, until);
        let [few, many] = [20, 45].map(|digits| last(&source, digits));
        for what in 0..2 {
            let off = number(few.bodies[0][what]) - number(many.bodies[0][what]);
            assert!(off.magnitude() < fixed("1e-16").magnitude(), "{text}: {off}");
        }
        assert!(few.drift.abs() < 1e-17 && many.drift.abs() < 1e-42, "{:e} {:e}", few.drift, many.drift);
    }
}
