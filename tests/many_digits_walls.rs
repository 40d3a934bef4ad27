//! Impacts at several walls at one moment in many digits, against closed forms in integer arithmetic.

use super::many_digits::{begun, fixed, last, near, number, one, over, pi, source, times};
use driftless::arithmetic::Real;
use driftless::run::digits::{DigitsPair, LongError, PairProgress, Precision, ShownRow, forecast};
use driftless::stepping::StepError;
use num_bigint::BigInt;

const DIGITS: usize = 60;
const PLACES: u32 = 57;
/// Of the box: mass, moment of inertia, height of its centre, and how far it falls.
const BOX: [&str; 4] = ["1.5", "0.11", "0.3", "0.49"];

/// A box that lands flat on corners at these places beside its centre of mass, with these restitutions.
fn landed(corners: [(&str, &str); 2], until: &str) -> ShownRow {
    let [mass, inertia, height, _] = BOX;
    let wall = |(name, (x, e)): (&str, (&str, &str))| {
        format!(
            r#"{{"name": "{name}", "body": "box", "point": [{x}, -{height}], "line": {{"through": [0, 0], "normal": [0, 1]}}, "restitution": {e}}}"#
        )
    };
    let walls: Vec<String> = ["a", "b"].into_iter().zip(corners).map(wall).collect();
    let text = format!(
        r#"{{"name": "box", "gravity": [0, -9.81], "bars": [{{"name": "box", "mass": {mass}, "centre": [0, 0], "inertia": {inertia}}}],
        "walls": [{}], "start": {{"box": {{"phi": 0, "omega": 0, "origin": [0, 0.79], "velocity": [3, 0]}}}},
        "until": {until}, "every": {until}}}"#,
        walls.join(", ")
    );
    last(&source(&text, &[], until, until), DIGITS)
}

/// Time of fall and speed of landing.
fn fall() -> [BigInt; 2] {
    let g = fixed("9.81");
    let time = (over(&(fixed(BOX[3]) * 2), &g) * one()).sqrt();
    [time.clone(), times(&g, &time)]
}

/// The row after a landing that gives the box this velocity upwards and this spin.
fn leaves(row: &ShownRow, [up, spin]: [BigInt; 2], until: &str) {
    let [time, _] = fall();
    let after = fixed(until) - time;
    let drop = times(&fixed("9.81"), &times(&after, &after)) / 2;
    near(&number(row.bodies[0][0]), &times(&spin, &after), PLACES);
    near(&number(row.bodies[0][1]), &spin, PLACES);
    near(&number(row.bodies[0][2]), &(fixed("3") * 2 / 5), PLACES);
    near(&number(row.bodies[0][3]), &(fixed(BOX[2]) + times(&up, &after) - drop), PLACES);
    near(&number(row.bodies[0][5]), &(up - times(&fixed("9.81"), &after)), PLACES);
    assert!(row.drift.abs() < 1e-57, "{:e}", row.drift);
}

/// Both corners are pressed alike, and expand as their walls let them.
#[test]
fn a_box_that_lands_flat_turns_by_the_difference_of_its_restitutions() {
    let [_, v] = fall();
    for [left, right] in [["0.5", "0.5"], ["0.7", "0.6"]] {
        let row = landed([("-0.4", left), ("0.4", right)], "0.4");
        let (left, right) = (fixed(left), fixed(right));
        let up = times(&(&left + &right), &v) / 2;
        let twist = times(&times(&(right - left), &fixed("1.5")), &times(&v, &fixed("0.4"))) / 2;
        leaves(&row, [up, over(&twist, &fixed("0.11"))], "0.4");
    }
}

/// Both corners are on one side of the centre of mass: only the nearer one is pressed, whichever comes first.
#[test]
fn a_box_that_lands_beside_its_corners_is_pressed_by_the_nearer_one() {
    let [_, v] = fall();
    for corners in [[("0.5", "0.5"), ("0.1", "0.5")], [("0.1", "0.5"), ("0.5", "0.5")]] {
        let row = landed(corners, "0.4");
        // n = (1 + e) v / (1/m + x²/I)
        let freedom = over(&one(), &fixed("1.5")) + over(&fixed("0.01"), &fixed("0.11"));
        let impulse = over(&times(&fixed("1.5"), &v), &freedom);
        let up = over(&impulse, &fixed("1.5")) - &v;
        leaves(&row, [up, over(&times(&impulse, &fixed("0.1")), &fixed("0.11"))], "0.4");
    }
}

/// Out of a corner it comes the way it went in: v⁺ = -e v⁻, whatever the angle, where both walls are approached.
#[test]
fn a_ball_in_a_corner_rebounds_the_way_it_came() {
    for normal in ["3, 4", "12, 5"] {
        let wall = |name: &str, sign: &str| {
            format!(
                r#"{{"name": "{name}", "body": "ball", "point": [0, 0], "line": {{"through": [0, 0], "normal": [{sign}{normal}]}}, "restitution": 0.6}}"#
            )
        };
        let text = format!(
            r#"{{"name": "corner", "gravity": [0, 0], "bars": [{{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 0.1, "length": 0.1}}],
            "walls": [{}, {}], "start": {{"ball": {{"phi": 0, "omega": 0.7, "origin": [-0.1, 0.9], "velocity": [0.2, -1.8]}}}},
            "until": 0.8, "every": 0.8}}"#,
            wall("right", ""),
            wall("left", "-")
        );
        let row = last(&source(&text, &[], "0.8", "0.8"), DIGITS);
        let body = row.bodies[0].map(number);
        for (found, expected) in [(&body[4], "-0.12"), (&body[5], "1.08"), (&body[1], "0.7")] {
            near(found, &fixed(expected), PLACES);
        }
        for (found, expected) in [(&body[2], "-0.036"), (&body[3], "0.324")] {
            near(found, &fixed(expected), PLACES);
        }
    }
}

/// A parallelogram whose crank, 0.1 rad up, a motor turns: in the crank's frame the tip of the rocker sinks by
/// 2 m sin(phi), and the crank carries a line below it.
fn parallelogram(law: &str, height: &str, wall: &str) -> String {
    let hinge = |name: &str, a: &str, b: &str| {
        let end = |end: &str| {
            let (body, at) = end.split_once('@').expect("a body and a point");
            format!(r#"{{"body": "{body}", "point": [{at}, 0]}}"#)
        };
        format!(r#"{{"name": "{name}", "between": [{}, {}]}}"#, end(a), end(b))
    };
    format!(
        r#"{{"name": "parallelogram", "gravity": [0, 0], "bars": [
            {{"name": "crank", "mass": 1, "centre": [0.4, 0.1], "inertia": 0.1, "length": 1}},
            {{"name": "coupler", "mass": 1.5, "centre": [1.1, 0], "inertia": 0.3, "length": 2}},
            {{"name": "rocker", "mass": 0.7, "centre": [0.5, 0.03], "inertia": 0.07, "length": 1}}],
        "hinges": [{}, {}, {}, {}], "motors": [{{"name": "drive", "body": "crank", "law": {{"start": 0.1, {law}}}}}],
        "walls": [{{"name": "line", "body": "rocker", "point": [1, 0], {wall},
            "line": {{"body": "crank", "through": [0, {height}], "normal": [0, 1]}}}}],
        "start": {{"coupler": {{"phi": 0}}, "rocker": {{"phi": 0.1}}}}, "until": 10, "every": 10}}"#,
        hinge("A", "ground@0", "crank@0"),
        hinge("B", "crank@1", "coupler@0"),
        hinge("C", "ground@2", "rocker@0"),
        hinge("D", "coupler@2", "rocker@1")
    )
}

fn stopped(text: &str, digits: usize) -> StepError {
    let mut run = begun(&source(text, &[], "1", "1"), digits);
    run.row(1, &mut || false).expect_err("no way on")
}

/// What the rows of a loop leave of a point that a motor drives is rounding, never exactly zero: no impulse turns it
/// back, with friction at the wall or without, and no force holds it.
#[test]
fn a_loop_that_a_motor_drives_into_a_wall_stops() {
    let time = std::f64::consts::FRAC_PI_6 - 0.1;
    for (wall, digits) in [
        (r#""restitution": 0.755"#, 25),
        (r#""restitution": 0.755"#, 60),
        (r#""restitution": 0"#, 40),
        (r#""restitution": 0.5, "friction": {"kinetic": 0.2}"#, 25),
    ] {
        let stop = stopped(&parallelogram(r#""rate": 1"#, "-1", wall), digits);
        assert!((stop.t - time).abs() < 1e-15, "{stop}");
        assert_eq!(stop.cause.word(), "resting_contact", "{stop}");
        assert!(stop.what.contains("meets wall line no way back"), "{stop}");
    }
    // It begins on the line, 2 sin(0.1) m below, and is pressed into it from rest.
    let below = "-0.199666833293656304556921638396431165519618379306";
    let stop = stopped(&parallelogram(r#""acceleration": 1"#, below, r#""restitution": 0.5"#), 30);
    assert_eq!((stop.cause.word(), stop.t), ("resting_contact", 0.0), "{stop}");
    assert!(stop.what.contains("rests on wall line and the constraints leave it no freedom"), "{stop}");
}

/// The two motions that a forecast measures the growth of errors on stop there as well.
#[test]
fn a_forecast_of_a_loop_that_a_motor_drives_into_a_wall_stops() {
    let text = parallelogram(r#""rate": 1"#, "-1", r#""restitution": 0.755"#);
    let found = forecast(&source(&text, &[], "10", "10"), 1e-3, true, &mut || false);
    let Err(LongError::Step(stop)) = found else { panic!("{found:?}") };
    assert!(stop.what.contains("no way back"), "{stop}");
}

/// Of runs side by side that stop, those rows are kept that both have, that of the last state among them.
#[test]
fn runs_side_by_side_keep_their_rows_up_to_a_stop() {
    let text = parallelogram(r#""rate": 1"#, "-1", r#""restitution": 0.755"#);
    let precisions = [25, 40].map(|digits| Precision::new(digits, true));
    let mut pair = DigitsPair::new(&source(&text, &[], "1", "0.25"), &precisions).expect("two runs");
    let mut rows = Vec::new();
    let stop = loop {
        match pair.go(&|| false) {
            Ok(PairProgress::Rows(more)) => rows.extend(more),
            Ok(_) => panic!("no stop"),
            Err(stop) => break stop,
        }
    };
    assert!(stop.what.contains("no way back"), "{stop}");
    rows.extend(pair.up_to_stop());
    let times: Vec<f64> = rows.iter().map(|(row, _)| row.time()).collect();
    assert_eq!(times[..2], [0.0, 0.25]);
    assert!(times.len() == 3 && (times[2] - (std::f64::consts::FRAC_PI_6 - 0.1)).abs() < 1e-15, "{times:?}");
    assert!(rows.iter().all(|(_, digits)| digits.is_some_and(|digits| digits > 22.0)), "{rows:?}");
    assert!(pair.up_to_stop().is_empty());
}

/// A flywheel, whose rates do not depend on its angle, between a stop at -pi/6 and the same at 7 pi/6.
fn flywheel(omega: &str, spring: &str) -> String {
    format!(
        r#"{{"name": "flywheel", "gravity": [0, 0], "bars": [{{"name": "wheel", "mass": 1, "centre": [0, 0], "inertia": 0.25, "length": 1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "wheel", "point": [0, 0]}}]}}],
        {spring} "walls": [{{"name": "stop", "body": "wheel", "point": [1, 0], "line": {{"through": [0, -0.5], "normal": [0, 1]}}, "restitution": 1}}],
        "start": {{"wheel": {{"phi": 0.5, "omega": {omega}}}}}, "until": 4, "every": 4}}"#
    )
}

/// From stop to stop it turns by 4 pi/3.
#[test]
fn a_free_flywheel_meets_its_stop_on_both_sides() {
    for (omega, digits) in [("5", 30), ("25", 30), ("25", 60)] {
        let mut run = begun(&source(&flywheel(omega, ""), &[], "3", "3"), digits);
        let row = run.row(1, &mut || false).expect("a row").expect("no pause");
        let (stop, way) = (pi() / 6, pi() * 4 / 3);
        let turned = fixed("0.5") + &stop + fixed(omega) * 3;
        let met = &turned / &way;
        let beyond = &turned - &met * &way;
        let is_back = &met % 2 == BigInt::from(1);
        let phi = if is_back { way - beyond } else { beyond } - stop;
        let places = digits as u32 - 3;
        near(&number(row.bodies[0][0]), &phi, places);
        near(&number(row.bodies[0][1]), &if is_back { -fixed(omega) } else { fixed(omega) }, places);
        assert_eq!(BigInt::from(run.counts()[1]), met);
    }
}

/// phi = R cos(w t - d), w² = 20, goes back where it is -pi/6.
#[test]
fn a_flywheel_on_a_torsion_spring_goes_back_at_its_stop() {
    let spring = r#""torsion_springs": [{"name": "s", "body": "wheel", "stiffness": 5, "free_angle": 0}],"#;
    let w = 20_f64.sqrt();
    for (omega, digits) in [(3.0, 30), (5.0, 30), (7.0, 60), (3.0, 120)] {
        let (size, late) = (f64::hypot(0.5, omega / w), f64::atan2(omega / w, 0.5));
        let turn = (-std::f64::consts::FRAC_PI_6 / size).acos();
        let (first, period) = ((late + turn) / w, 2.0 * turn / w);
        let met = ((4.0 - first) / period).floor();
        let phi = size * (w * (4.0 - first - met * period) - turn).cos();
        let mut run = begun(&source(&flywheel(&omega.to_string(), spring), &[], "4", "4"), digits);
        let row = run.row(1, &mut || false).expect("a row").expect("no pause");
        assert_eq!(run.counts()[1], met as u64 + 1);
        let found = row.bodies[0][0].value();
        assert!((found - phi).abs() < 1e-13, "{found} and not {phi} of {omega} rad/s");
    }
}

/// A ball comes down at 0.5 m/s, and is met by a wall that moves by 0.6 sin(40 t) m just before its ninth peak.
#[test]
fn a_wall_that_moves_fast_meets_a_ball_where_its_law_says() {
    let met = (8.25 * std::f64::consts::TAU - 0.3) / 40.0;
    let height = 0.6 * (40.0 * met).sin();
    let speed = 48.0 * (40.0 * met).cos() + 0.5;
    let text = format!(
        r#"{{"name": "ball", "gravity": [0, 0], "bars": [{{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 1}}],
        "walls": [{{"name": "wall", "body": "ball", "point": [0, 0], "line": {{"through": [0, 0], "normal": [0, 1]}}, "restitution": 1,
            "law": {{"start": 0, "rate": 0, "sines": [{{"amplitude": 0.6, "frequency": 40, "phase": 0}}]}}}}],
        "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [0, {}], "velocity": [0, -0.5]}}}}, "until": 9, "every": 9}}"#,
        height + 0.5 * met
    );
    for digits in [30, 60] {
        let row = last(&source(&text, &[], "2", "2"), digits);
        let [y, v] = [3, 5].map(|k| row.bodies[0][k].value());
        assert!((v - speed).abs() < 1e-11, "{v} and not {speed}");
        assert!((y - height - speed * (2.0 - met)).abs() < 1e-11, "{y}");
    }
}
