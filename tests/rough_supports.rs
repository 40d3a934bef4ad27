//! Supports with dry friction of more than one part: what sticks, what rests at its limit, what grazes its wall, and
//! the work of walls that move, against closed forms, the same scene stated otherwise, and many digits.

use super::breaking_away::done;
use super::formulas::adaptive;
use super::laws::rk4;
#[cfg(feature = "digits")]
use super::many_digits::bodies_at_end;
use driftless::run::{MethodId, Request};

/// Methods at tight tolerances.
fn requests() -> [Request; 3] {
    [(MethodId::Taylor, 1e-12), (MethodId::Dp8, 1e-11), (MethodId::Radau(5), 1e-11)]
        .map(|(method, tolerance)| adaptive(method, tolerance))
}

/// A block that slides on a carriage, which sticks to the ground and is pulled back: where the block comes to rest on
/// it, the carriage stays, since it is not loaded to its static limit, and the block slides back:
/// x = v²/2a - a'(T - v/a)²/2,  a = F + mu g,  a' = F - mu g.
#[test]
fn what_sticks_stays_where_another_place_comes_to_rest_on_it() {
    let slider = |name: &str, body: &str, rail: &str, friction: &str| {
        format!(
            r#"{{"name": "{name}", "point": {{"body": "{body}", "point": [0, 0]}}, "angle": "locked",
            "rail": {{"body": {rail}, "direction": [1, 0]}}, "friction": {{{friction}}}}}"#
        )
    };
    let on_carriage = slider("upper", "block", r#""carriage", "point": [0, 0.1]"#, r#""kinetic": 0.55"#);
    let on_ground =
        slider("lower", "carriage", r#""ground", "point": [0, 0]"#, r#""kinetic": 0.2, "static": 0.35"#);
    let (back, forth) = (6.0 + 0.55 * 9.81, 6.0 - 0.55 * 9.81);
    let expected = 0.125 / back - 0.5 * forth * (0.5 - 0.5_f64 / back).powi(2);
    for sliders in [[&on_carriage, &on_ground], [&on_ground, &on_carriage]] {
        let body = |name: &str| {
            format!(r#"{{"name": "{name}", "mass": 1, "centre": [0, 0], "inertia": 0.01, "length": 0.3}}"#)
        };
        let text = format!(
            r#"{{"name": "blocks", "gravity": [0, -9.81], "bars": [{}, {}], "sliders": [{}, {}],
            "forces": [{{"name": "pull", "body": "block", "point": [0, 0], "force": [-6, 0]}}],
            "start": {{"carriage": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}},
                "block": {{"phi": 0, "omega": 0, "origin": [0, 0.1], "velocity": [0.5, 0]}}}},
            "until": 0.5, "every": 0.5}}"#,
            body("carriage"),
            body("block"),
            sliders[0],
            sliders[1]
        );
        for request in requests() {
            let last = done(&text, &request).last;
            let [carriage, block] = [last.phi[2], last.phi[4]];
            assert!(carriage.abs() < 1e-12, "{request:?}: {carriage:e}");
            assert!((block - expected).abs() < 1e-11, "{request:?}: {block} for {expected}");
        }
        #[cfg(feature = "digits")]
        assert!((bodies_at_end(&text, "0.5", 22)[1][2] - expected).abs() < 1e-12);
    }
}

/// A rod on the floor is pushed against a rough wall; its load falls and pulls it off once it passes the friction of
/// the one rough end.  Until then its supports share the load in more ways than one, and in each of them one or the
/// other comes to its limit.
#[test]
fn a_rod_between_floor_and_wall_rests_until_its_load_pulls_it_off() {
    let wall = |name: &str, x: f64, line: &str, friction: &str| {
        format!(
            r#"{{"name": "{name}", "body": "rod", "point": [{x}, 0], "line": {{{line}}}, "restitution": 0{friction}}}"#
        )
    };
    let (floor, rough) = (r#""through": [0, 0], "normal": [0, 1]"#, r#", "friction": {"kinetic": 0.4}"#);
    let text = format!(
        r#"{{"name": "rod", "gravity": [0, -9.81], "bars": [{{"name": "rod", "mass": 1, "centre": [0.2, 0], "inertia": 0.0133, "length": 0.4}}],
        "walls": [{}, {}, {}], "forces": [{{"name": "push", "body": "rod", "point": [0.2, 0], "force": ["20-40*t", 0]}}],
        "start": {{"rod": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}}}}, "until": 1, "every": 1}}"#,
        wall("left", 0.0, floor, rough),
        wall("right", 0.4, floor, ""),
        wall("side", 0.4, r#""through": [0.4, 0], "normal": [-1, 0]"#, rough)
    );
    // Half of the weight is on the rough end.
    let breaks = (20.0 + 0.4 * 0.5 * 9.81) / 40.0;
    let expected = -40.0 * (1.0_f64 - breaks).powi(3) / 6.0;
    for request in requests() {
        let x = done(&text, &request).last.phi[1];
        assert!((x - expected).abs() < 1e-11, "{request:?}: {x} for {expected}");
    }
    #[cfg(feature = "digits")]
    assert!((bodies_at_end(&text, "1", 22)[0][2] - 0.2 - expected).abs() < 1e-12);
}

/// The end of a pendulum that just touches the floor with its lowest point passes it: what rounding and the error of
/// a step make of its gap is no impact, which would stop it there.
#[test]
fn what_touches_a_wall_at_its_dead_centre_passes() {
    let text = |walls: &str| {
        format!(
            r#"{{"name": "graze", "gravity": [0, -9.81], "bars": [{{"name": "bar", "mass": 1, "centre": [0.15, 0], "inertia": 0.0075, "length": 0.3}}],
            "hinges": [{{"name": "pivot", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}}],
            "walls": [{walls}], "start": {{"bar": {{"phi": -1, "omega": -1}}}}, "until": 0.5, "every": 0.5}}"#
        )
    };
    let free = text("");
    for (restitution, friction) in [(0.0, ""), (0.5, ""), (0.5, r#", "friction": {"kinetic": 0.3}"#)] {
        let grazing = text(&format!(
            r#"{{"name": "floor", "body": "bar", "point": [0.3, 0], "restitution": {restitution},
            "line": {{"through": [0, -0.3], "normal": [0, 1]}}{friction}}}"#
        ));
        for (method, tolerance) in [
            (MethodId::Taylor, 1e-9),
            (MethodId::Taylor, 1e-12),
            (MethodId::Dp5, 1e-9),
            (MethodId::Dp8, 1e-9),
            (MethodId::Dp8, 1e-11),
            (MethodId::Radau(5), 1e-11),
        ] {
            let request = adaptive(method, tolerance);
            let [here, there] = [&grazing, &free].map(|text| done(text, &request).last.phi[0]);
            assert!((here - there).abs() < 1e-8, "{method} {tolerance:e}: {here} for {there}");
        }
        #[cfg(feature = "digits")]
        {
            let [here, there] = [&grazing, &free].map(|text| bodies_at_end(text, "0.5", 22)[0][0]);
            assert!((here - there).abs() < 1e-15, "{here} for {there}");
        }
    }
}

/// An impact by Newton's law that pulls a point off the wall it rests on has no impulses with that point held; in many
/// digits it is let go as in doubles.
#[cfg(feature = "digits")]
#[test]
fn an_impact_by_newtons_law_lets_a_resting_point_go_in_many_digits() {
    let bar = |name: &str| {
        format!(r#"{{"name": "{name}", "mass": 1, "centre": [0.15, 0], "inertia": 0.0075, "length": 0.3}}"#)
    };
    let text = format!(
        r#"{{"name": "elbow", "gravity": [0, -9.81], "bars": [{}, {}],
        "hinges": [{{"name": "shoulder", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "upper", "point": [0, 0]}}]}},
            {{"name": "elbow", "between": [{{"body": "upper", "point": [0.3, 0]}}, {{"body": "lower", "point": [0, 0]}}]}}],
        "walls": [{{"name": "slope", "body": "lower", "point": [0.3, 0], "restitution": 0.8,
                "line": {{"through": [0.201221, -0.539248], "normal": [-0.06994284733753277, 0.9975510002532796]}},
                "friction": {{"kinetic": 0.64, "impact": "newton"}}}},
            {{"name": "floor", "body": "upper", "point": [0.3, 0], "restitution": 0.8,
                "line": {{"through": [0, -0.24], "normal": [0, 1]}}, "friction": {{"kinetic": 0.569}}}}],
        "start": {{"upper": {{"phi": "-atan2(4,3)", "omega": 0}}, "lower": {{"phi": -1.9, "omega": 3}}}},
        "until": 0.5, "every": 0.5}}"#,
        bar("upper"),
        bar("lower")
    );
    let exact = bodies_at_end(&text, "0.5", 22);
    for request in requests() {
        let last = done(&text, &request).last;
        for (body, [phi, ..]) in exact.iter().enumerate() {
            assert!((last.phi[body] - phi).abs() < 1e-9, "{request:?}: {} for {phi}", last.phi[body]);
        }
    }
}

/// A box that ends bouncing on a floor that moves: the impulses of the bounces that are left out do work with it, as
/// in many digits, which leave none out.  Energy less work changes by impacts alone, with friction as well, where an
/// impact at one corner makes the other one rebound that rests.
#[test]
fn bounces_that_end_on_a_floor_that_moves_take_its_work() {
    let floor = |name: &str, x: f64, friction: &str| {
        format!(
            r#"{{"name": "{name}", "body": "box", "point": [{x}, -0.1], "restitution": 0.3, "law": "0.0116*sin(7.4*t)",
            "line": {{"through": [0, 0], "normal": [0, 1]}}{friction}}}"#
        )
    };
    let text = |frictions: [&str; 2]| {
        format!(
            r#"{{"name": "box", "gravity": [0, -9.81], "bars": [{{"name": "box", "mass": 0.81, "centre": [0, 0], "inertia": 0.0126, "length": 0.3}}],
            "walls": [{}, {}], "start": {{"box": {{"phi": 0.1, "omega": 0, "origin": [0, 0.3], "velocity": [-0.3, 0]}}}},
            "until": 0.34, "every": 0.34}}"#,
            floor("left", -0.15, frictions[0]),
            floor("right", 0.15, frictions[1])
        )
    };
    let rough = [
        r#", "friction": {"kinetic": 0.22, "static": 0.22}"#,
        r#", "friction": {"kinetic": 0.668, "static": 0.8684}"#,
    ];
    for request in requests() {
        let last = done(&text(rough), &request).last;
        assert!(last.imbalance.abs() < 1e-11, "{request:?}: {:e}", last.imbalance);
        #[cfg(feature = "digits")]
        {
            use super::many_digits::{last, source};
            use driftless::arithmetic::Real;
            let smooth = text(["", ""]);
            let row = last(&source(&smooth, &[], "0.34", "0.34"), 22);
            let (work, expected) = (done(&smooth, &request).last.work, row.energy[2].value());
            assert!((work - expected).abs() < 1e-11, "{request:?}: {work} J for {expected} J");
        }
    }
}

/// Two links below a carriage hit the ground in turn, ever more slowly: what rounding leaves of an approach is no
/// impact, which would have to balance and have a way back.
#[test]
fn impacts_that_die_away_at_two_points_end_in_rest() {
    let text = r#"{"name": "links", "gravity": [0, -9.81], "bars": [
            {"name": "carriage", "mass": 1.51, "centre": [0, 0], "inertia": 0.01, "length": 0.2},
            {"name": "upper", "mass": 1.29, "centre": [0.2, 0], "inertia": 0.0172, "length": 0.4},
            {"name": "lower", "mass": 0.97, "centre": [0.15, 0], "inertia": 0.007275, "length": 0.3}],
        "hinges": [{"name": "hip", "between": [{"body": "carriage", "point": [0, 0]}, {"body": "upper", "point": [0, 0]}]},
            {"name": "knee", "between": [{"body": "upper", "point": [0.4, 0]}, {"body": "lower", "point": [0, 0]}]}],
        "sliders": [{"name": "rail", "point": {"body": "carriage", "point": [0, 0]}, "angle": "locked",
            "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "friction": {"kinetic": 0.1, "static": 0.35}}],
        "walls": [{"name": "step", "body": "upper", "point": [0.4, 0], "restitution": 0,
                "line": {"through": [0, -0.3187], "normal": [0, 1]}, "friction": {"kinetic": 0.561}},
            {"name": "floor", "body": "lower", "point": [0.3, 0], "restitution": 0,
                "line": {"through": [0, -0.605], "normal": [0, 1]}, "friction": {"kinetic": 0.087}}],
        "forces": [{"name": "push", "body": "upper", "point": [0.4, 0], "force": ["6.01*sin(2.04*t+3.37)", 0]}],
        "start": {"carriage": {"phi": 0, "origin": [0, 0], "velocity": [-0.12, 0]}, "upper": {"phi": -0.74, "omega": -0.58},
            "lower": {"phi": -1.05, "omega": 0.73}},
        "until": 0.6, "every": 0.6}"#;
    let ends = requests().map(|request| done(text, &request).last.phi);
    for (one, other) in ends[0].iter().zip(&ends[1]).chain(ends[0].iter().zip(&ends[2])) {
        assert!((one - other).abs() < 1e-7, "{ends:?}");
    }
}

/// A bar on two smooth steps whose ends strike in turn, at ever smaller speeds, while it slides at half a metre a
/// second: the rounding of that speed in an impact at 1e-8 m/s is none of the law of impact.
#[cfg(feature = "digits")]
#[test]
fn ends_that_strike_in_turn_come_to_rest_while_the_bar_slides() {
    use super::many_digits::bodies_at_end;
    let text = r#"{"name": "rocking", "gravity": [0, -4.28],
        "bars": [{"name": "b", "mass": 2.186, "centre": [0.15, 0], "inertia": 0.01099, "length": 0.3}],
        "torques": [{"name": "turn", "body": "b", "torque": 0.52}],
        "walls": [{"name": "low", "body": "b", "point": [0.3, 0], "restitution": 0.02,
                "line": {"through": [0.925, 0.06], "normal": [0, 1]}},
            {"name": "high", "body": "b", "point": [0, 0], "restitution": 0,
                "line": {"through": [1.2, 0.16], "normal": [0, 1]}}],
        "start": {"b": {"phi": -3.06, "omega": -2.9, "origin": [1.2, 0.2], "velocity": [0.51, -0.5]}},
        "until": 0.75, "every": 0.75}"#;
    let [expected] = bodies_at_end(text, "0.75", 22)[..] else { panic!("one body") };
    for method in [MethodId::Taylor, MethodId::Dp8] {
        let outcome = done(text, &adaptive(method, 1e-11));
        let off = [outcome.last.phi[0] - expected[0], outcome.last.omega[0] - expected[1]];
        println!("{method}: {off:?}");
        assert!(off.iter().all(|off| off.abs() < 1e-9), "{method}: {off:?}");
    }
}

/// A box on two supports with friction that carries a pendulum stays where it is, and the pendulum is that of the
/// ground.  Both supports say that the box does not move along: that they depend on each other is no singular
/// position ahead.
#[test]
fn supports_that_stick_side_by_side_are_no_singular_position() {
    let support = |x: f64| format!(r#""point": {{"body": "box", "point": [{x}, -0.08]}}, "#);
    let rail =
        r#""rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "friction": {"kinetic": 0.5}"#;
    let wall = |name: &str, x: f64| {
        format!(
            r#"{{"name": "{name}", "body": "box", "point": [{x}, -0.08], "line": {{"through": [0, 0], "normal": [0, 1]}},
            "restitution": 0, "friction": {{"kinetic": 0.5}}}}"#
        )
    };
    let walls = format!(r#""walls": [{}, {}]"#, wall("A", -0.25), wall("B", 0.25));
    let [left, right] = [-0.25, 0.25].map(support);
    let rails = format!(r#""sliders": [{{"name": "A", {left}{rail}}}, {{"name": "B", {right}{rail}}}]"#);
    // Of the pendulum about its hinge: 2 kg at 0.3 m.
    let inertia = 0.04 + 2.0 * 0.3 * 0.3;
    let swings = |_: f64, y: &[f64; 2]| [y[1], -2.0 * 9.81 * 0.3 * y[0].cos() / inertia];
    for (supports, until) in [(&walls, 2.0), (&rails, 2.0), (&walls, 8.0)] {
        let text = format!(
            r#"{{"name": "box", "gravity": [0, -9.81], "bars": [
            {{"name": "box", "mass": 3, "centre": [0, 0], "inertia": 0.07, "length": 0.5}},
            {{"name": "pendulum", "mass": 2, "centre": [0.3, 0], "inertia": 0.04, "length": 0.8}}],
            "hinges": [{{"name": "H", "between": [{{"body": "box", "point": [0, 0.08]}},
                {{"body": "pendulum", "point": [0, 0]}}]}}], {supports},
            "start": {{"box": {{"phi": 0, "omega": 0, "origin": [0, 0.08], "velocity": [0, 0]}},
                "pendulum": {{"phi": -1, "omega": 1.5}}}}, "until": {until}, "every": {until}}}"#
        );
        let [phi, _] = rk4([-1.0, 1.5], until, (1e4 * until) as u32, swings);
        for tolerance in [1e-9, 1e-11, 1e-13] {
            let outcome = done(&text, &adaptive(MethodId::Taylor, tolerance));
            let off = (outcome.last.phi[1] - phi).abs();
            assert!(off < (10.0 * tolerance * until).max(1e-11), "{tolerance:e} to {until} s: {off:e}");
            assert!(outcome.drift.singular.is_none(), "{:?}", outcome.drift.singular);
        }
    }
}
