//! Gears, cams and walls that follow the mechanism in many digits: against closed forms in integer arithmetic.

use super::many_digits::{fixed, last, near, number, one, source};
use driftless::arithmetic::Real;
use driftless::run::Request;
use driftless::run::digits::{Precision, ShownRow, long_run};
use num_bigint::BigInt;

const DIGITS: usize = 60;
const PLACES: u32 = 56;

fn holds(row: &ShownRow, body: usize, expected: &[(usize, BigInt)]) {
    expected.iter().for_each(|(what, value)| near(&number(row.bodies[body][*what]), value, PLACES));
    assert!(row.drift.abs() < 1e-56 && row.residual[0] < 1e-56, "{:e}, {:?}", row.drift, row.residual);
}

/// Discs of 1 and 2 kg m² about two axes.
fn discs(parts: &str, start: &str) -> String {
    format!(
        r#"{{"name": "discs", "gravity": [0, 0], "bars": [
            {{"name": "a", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 1}},
            {{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 2, "length": 1}}],
        "hinges": [
            {{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}},
            {{"name": "B", "between": [{{"body": "ground", "point": [2, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
        {parts}, "start": {{{start}}}, "until": 9, "every": 9}}"#
    )
}

/// A gear of ratio 0.3, whose moment of inertia as seen from the first axis is 1.18 kg m².
#[test]
fn a_gear_turns_in_its_ratio_as_written() {
    let text = discs(
        r#""parameters": {"ratio": 0.3}, "motors": [{"name": "gear", "body": "b", "law": "ratio*a.phi"}],
        "torques": [{"name": "torque", "body": "a", "torque": 2.36}]"#,
        r#""a": {"phi": 0, "omega": 0}"#,
    );
    let row = last(&source(&text, &[], "3", "3"), DIGITS);
    holds(&row, 0, &[(0, fixed("9")), (1, fixed("6"))]);
    holds(&row, 1, &[(0, fixed("2.7")), (1, fixed("1.8"))]);
}

/// The motors of a scene stand in one list, in any order: each keeps its own law.
#[test]
fn motors_and_gears_keep_their_laws_in_any_order() {
    let time = [
        r#"{"name": "m", "body": "a", "law": "3*t - 1"}"#,
        r#"{"name": "m", "body": "a", "law": {"start": -1, "rate": 3}}"#,
    ];
    let gear = r#"{"name": "gear", "body": "b", "law": "0.5*a.phi"}"#;
    for time in time {
        for [first, second] in [[time, gear], [gear, time]] {
            let text = discs(&format!(r#""motors": [{first}, {second}]"#), "");
            let row = last(&source(&text, &[], "1", "1"), DIGITS);
            holds(&row, 0, &[(0, fixed("2")), (1, fixed("3"))]);
            holds(&row, 1, &[(0, fixed("1")), (1, fixed("1.5"))]);
        }
    }
}

/// A cam of the square of an angle that a motor drives evenly, and a follower that moves by itself with time.
#[test]
fn a_cam_and_a_follower_in_time_take_their_work() {
    let motors = |law: &str| {
        let text = format!(
            r#""motors": [{{"name": "drive", "body": "a", "law": {{"start": 0, "rate": 0.7}}}}, {{"name": "cam", "body": "b", "law": "{law}"}}]"#
        );
        last(&source(&discs(&text, ""), &[], "2", "2"), DIGITS)
    };
    let row = motors("0.1*a.phi^2");
    holds(&row, 0, &[(0, fixed("1.4"))]);
    holds(&row, 1, &[(0, fixed("0.196")), (1, fixed("0.196"))]);
    let row = motors("0.1*a.phi^2 + 0.2*t^3*(1 s^-3)");
    holds(&row, 1, &[(0, fixed("1.796")), (1, fixed("2.596"))]);
    near(&number(row.energy[2]), &(fixed("2.596") * fixed("2.596") / one()), PLACES);
}

/// A ball of 2 kg falls 5 m in 1 s onto a floor that a disc of 1 kg m² raises by 0.1 m a radian: the impulse is
/// (1 + e) 10.1/(1/2 + 0.01) N s and turns the disc back.
#[test]
fn a_wall_that_a_body_moves_pushes_it_back() {
    let text = r#"{"name": "stop", "gravity": [0, -10], "bars": [
            {"name": "disc", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 1},
            {"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 1, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [3, 0]}, {"body": "disc", "point": [0, 0]}]}],
        "walls": [{"name": "floor", "body": "ball", "point": [0, 0], "restitution": 0.5, "law": "0.1*disc.phi*(1 m)",
            "line": {"through": [0, 0], "normal": [0, 1]}}],
        "start": {"disc": {"phi": 0, "omega": 1}, "ball": {"phi": 0, "omega": 0, "origin": [0, 5.1], "velocity": [0, 0]}},
        "until": 9, "every": 9}"#;
    let row = last(&source(text, &[], "1.2", "1.2"), DIGITS);
    let impulse = fixed("15.15") * one() / fixed("0.51");
    let (speed, rate) = (&impulse / 2 - fixed("10"), one() - &impulse / 10);
    holds(&row, 0, &[(0, one() + &rate / 5), (1, rate)]);
    holds(&row, 1, &[(3, fixed("0.1") + &speed / 5 - fixed("0.2")), (5, speed - fixed("2"))]);
}

/// A slider whose travel follows a crank, beside a loop, a corner of the law and a parameter that an event sets:
/// as runs in doubles have it.
#[test]
fn a_follower_with_a_corner_is_that_of_runs_in_doubles() {
    let text = r#"{"name": "follower", "gravity": [0, -9.81], "parameters": {"lift": 0.2}, "bars": [
            {"name": "crank", "length": 0.3, "mass": 1, "centre": [0.1, 0.02], "inertia": 0.05},
            {"name": "block", "length": 0.1, "mass": 0.5, "centre": [0, 0], "inertia": 0.01},
            {"name": "arm", "length": 0.4, "mass": 0.3, "centre": [0.2, 0], "inertia": 0.01}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "crank", "point": [0, 0]}]},
                   {"name": "B", "between": [{"body": "block", "point": [0, 0]}, {"body": "arm", "point": [0, 0]}]}],
        "sliders": [{"name": "S", "point": {"body": "block", "point": [0, 0]}, "rail": {"body": "ground", "point": [0, -0.5], "direction": [1, 0.1]}, "angle": "locked"}],
        "motors": [{"name": "cam", "slider": "S", "law": "lift*max(crank.sin + 0.2, 0)^2*(1 m)"}],
        "events": [{"name": "more", "when": "crank.cos - 0.5", "direction": "falling", "set": {"lift": "lift"}},
                   {"name": "pull", "when": "t - 0.7"}],
        "start": {"crank": {"phi": 0.3, "omega": 7}, "arm": {"phi": -1, "omega": 0}, "block": {"phi": 0}}, "until": 1.5, "every": 1.5}"#;
    let source = self::source(text, &[], "1.5", "1.5");
    let many = last(&source, 30);
    let request = Request { rtol: Some(1e-13), ..Request::default() };
    let plain = crate::common::run(&source.scene, &request);
    assert!(plain.stop.is_none(), "{:?}", plain.stop);
    for (k, body) in many.bodies.iter().enumerate() {
        let off = [body[2].value() - plain.last.centre[k][0], body[1].value() - plain.last.omega[k]];
        assert!(off.iter().all(|off| off.abs() < 1e-9), "body {k}: {off:?}");
    }
    // Where the law has a corner at which its rate jumps, there is no motion beyond.
    let text = text.replace("max(crank.sin + 0.2, 0)^2", "max(crank.sin, -0.2)^2");
    let jumping = self::source(&text, &[], "1.5", "1.5");
    let mut run = long_run(&jumping, Precision::new(30, true)).expect("a run");
    let stop = run.row(1, &mut || false).expect_err("a jump");
    assert!(stop.what.contains("jumps") && (stop.t - 0.477234).abs() < 1e-5, "{stop:?}");
    assert!(many.drift.abs() < 1e-26 && many.residual[0] < 1e-28, "{:e}, {:?}", many.drift, many.residual);
}

/// A motor whose law is a signal of time alone.
#[test]
fn a_motor_may_follow_a_signal_of_time() {
    let parts = r#""signals": {"turn": "0.3 + 2*t"}, "motors": [{"name": "m", "body": "a", "law": "turn"}]"#;
    let row = last(&source(&discs(parts, r#""b": {"phi": 0.1, "omega": 1}"#), &[], "2", "2"), DIGITS);
    holds(&row, 0, &[(0, fixed("4.3"))]);
}
