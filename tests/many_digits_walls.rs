//! Impacts at several walls at one moment in many digits, against closed forms in integer arithmetic.

use super::many_digits::{fixed, last, near, number, one, source, times};
use driftless::run::digits::Row;
use num_bigint::BigInt;

const DIGITS: usize = 60;
const PLACES: u32 = 57;
/// Of the box: mass, moment of inertia, height of its centre, and how far it falls.
const BOX: [&str; 4] = ["1.5", "0.11", "0.3", "0.49"];

fn over(a: &BigInt, b: &BigInt) -> BigInt {
    a * one() / b
}

/// A box that lands flat on corners at these places beside its centre of mass, with these restitutions.
fn landed(corners: [(&str, &str); 2], until: &str) -> Row {
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
fn leaves(row: &Row, [up, spin]: [BigInt; 2], until: &str) {
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
