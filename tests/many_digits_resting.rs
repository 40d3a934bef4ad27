//! Points that stay on walls in many digits: against closed forms in integer arithmetic, runs with other digits and
//! runs in doubles.

use super::common;
use super::many_digits::{
    begun, cosine, fixed, near, number, one, over, pi, proved, resumed, root, source, times,
};
use driftless::arithmetic::Real;
use driftless::run::Request;
use driftless::run::digits::{LongEvent, LongHold, ShownRow};
use driftless::scene::parse_scene;
use num_bigint::BigInt;

/// The last row of a run of a scene, and the times that points stayed on walls.
struct Ran {
    row: ShownRow,
    holds: Vec<LongHold>,
    events: Vec<LongEvent>,
}

#[track_caller]
fn ran(text: &str, until: &str, digits: usize) -> Ran {
    let mut run = begun(&source(text, &[], until, until), digits);
    let last = run.last_row();
    let row = run.row(last, &mut || false).unwrap_or_else(|stop| panic!("{stop}")).expect("no pause");
    let allowed = 10.0_f64.powi(3 - digits as i32);
    assert!(row.drift.abs() < allowed, "{:e}", row.drift);
    Ran { row, holds: run.holds(), events: run.events() }
}

impl Ran {
    /// Of the first body: what is at these places among angle, rate, position and velocity.
    #[track_caller]
    fn has(&self, expected: &[(usize, BigInt)], places: u32) {
        expected.iter().for_each(|(what, value)| near(&number(self.row.bodies[0][*what]), value, places));
    }

    #[track_caller]
    fn held(&self, expected: &[(&str, BigInt, Option<BigInt>)], places: u32) {
        let told: Vec<_> = self.holds.iter().map(|hold| (&hold.wall, hold.t, hold.until)).collect();
        assert_eq!(self.holds.len(), expected.len(), "{told:?}");
        for (hold, (wall, t, until)) in self.holds.iter().zip(expected) {
            assert_eq!(hold.wall, *wall);
            near(&number(hold.t), t, places);
            match (hold.until, until) {
                (Some(found), Some(expected)) => near(&number(found), expected, places),
                (found, expected) => assert_eq!(found.is_some(), expected.is_some(), "{told:?}"),
            }
        }
    }
}

/// A ball of 2 kg above a floor, and what else there is.
fn ball(restitution: &str, start: &str, more: &str) -> String {
    format!(
        r#"{{"name": "ball", "gravity": [0, -9.81], "bars": [{{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 0.3}}],
        "points": [{{"name": "p", "body": "ball", "point": [0, 0]}}],
        "walls": [{{"name": "floor", "body": "ball", "point": [0, 0], "restitution": {restitution},
            "line": {{"through": [0, 0], "normal": [0, 1]}}}}{more},
        "start": {{"ball": {{"phi": 0, "omega": 0.7, {start}}}}}, "until": 9, "every": 9}}"#
    )
}

/// A cart that falls along a rail, and a ball in flight, fall on a floor and stay, or bounce until they do: after
/// (1 + e)/(1 - e) times the time of the fall.
#[test]
fn what_falls_on_a_floor_stays_there_when_its_bounces_have_ended() {
    let cart = |e: &str| {
        format!(
            r#"{{"name": "cart", "gravity": [0, -9.81], "bars": [{{"name": "cart", "mass": 2, "centre": [0, 0], "inertia": 0.3}}],
            "sliders": [{{"name": "rail", "point": {{"body": "cart", "point": [0, 0]}}, "angle": "locked",
                "rail": {{"body": "ground", "point": [0, 0], "direction": [0, 1]}}}}],
            "walls": [{{"name": "floor", "body": "cart", "point": [0, 0], "restitution": {e},
                "line": {{"through": [0, 0], "normal": [0, 1]}}}}],
            "start": {{"cart": {{"phi": 0, "omega": 0, "origin": [0, 0.7], "velocity": [0, 0]}}}}, "until": 9, "every": 9}}"#
        )
    };
    for digits in [30, 60] {
        for e in ["0", "0.5", "0.8"] {
            let places = digits as u32 - 2;
            let fall = root(&over(&fixed("1.4"), &fixed("9.81")));
            let end = over(&times(&fall, &(one() + fixed(e))), &(one() - fixed(e)));
            let flies = ran(&ball(e, r#""origin": [0, 0.7], "velocity": [0.3, 0]"#, "]"), "6", digits);
            flies.held(&[("floor", end.clone(), None)], places);
            flies.has(&[(0, fixed("4.2")), (1, fixed("0.7")), (2, fixed("1.8")), (3, BigInt::ZERO)], places);
            flies.has(&[(4, fixed("0.3")), (5, BigInt::ZERO)], places);
            let falls = ran(&cart(e), "6", digits);
            falls.held(&[("floor", end, None)], places);
            falls.has(&[(2, BigInt::ZERO), (3, BigInt::ZERO), (5, BigInt::ZERO)], places);
            assert!(falls.row.residual[0] < 1e-30, "{:?}", falls.row.residual);
        }
    }
}

/// F = k t² lifts the ball when it is its weight.
#[test]
fn a_force_that_grows_lifts_what_rests_where_it_is_the_weight() {
    let lift = r#"], "forces": [{"name": "lift", "body": "ball", "point": [0, 0], "force": [0, "7.3*t^2"]}]"#;
    for (start, since) in [
        (r#""origin": [0, 0], "velocity": [0.3, 0]"#, BigInt::ZERO),
        // Nearly at rest: it falls and stays, and is lifted all the same.
        (r#""origin": [0, 0], "velocity": [0.3, -1]"#, BigInt::ZERO),
    ] {
        let found = ran(&ball("0", start, lift), "3", 50);
        let lifted = root(&over(&fixed("19.62"), &fixed("7.3")));
        found.held(&[("floor", since, Some(lifted.clone()))], 47);
        // 2 y'' = 7.3 t² - 19.62 from rest at that time.
        let power = |t: &BigInt, n: u32| (0..n).fold(one(), |product, _| times(&product, t));
        let t = fixed("3");
        let speed = |t: &BigInt| times(&fixed("7.3"), &power(t, 3)) / 6 - times(&fixed("9.81"), t);
        let place =
            |t: &BigInt| times(&fixed("7.3"), &power(t, 4)) / 24 - times(&fixed("9.81"), &power(t, 2)) / 2;
        let (v0, y0) = (speed(&lifted), place(&lifted));
        found.has(&[(5, speed(&t) - &v0), (3, place(&t) - y0 - times(&v0, &(&t - &lifted)))], 45);
    }
}

/// A pendulum falls on a wall at sin phi = 0.6 and stays until a torque k t is m g l cos phi.
#[test]
fn a_pendulum_is_turned_off_its_wall_by_a_torque() {
    let text = r#"{"name": "arm", "gravity": [0, -9.81],
        "bars": [{"name": "arm", "mass": 1.3, "centre": [0.25, 0], "inertia": 0.04, "length": 0.5}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "arm", "point": [0, 0]}]}],
        "walls": [{"name": "stop", "body": "arm", "point": [0.5, 0], "restitution": 0,
            "line": {"through": [0, 0.3], "normal": [0, 1]}}],
        "torques": [{"name": "turns", "body": "arm", "torque": "1.1*t"}],
        "start": {"arm": {"phi": 0.7, "omega": 0}}, "until": 9, "every": 9}"#;
    for digits in [30, 60] {
        let found = ran(text, "2.5", digits);
        let [hold] = &found.holds[..] else { panic!("{:?}", found.holds) };
        let expected = over(&times(&fixed("12.753"), &fixed("0.2")), &fixed("1.1"));
        near(&number(hold.until.expect("an end")), &expected, digits as u32 - 2);
        // Before that it is where it fell: sine and height of the centre.
        let before = ran(text, "2.3", digits);
        before.has(&[(1, BigInt::ZERO), (2, fixed("0.2")), (3, fixed("0.15"))], digits as u32 - 2);
        assert!(found.row.bodies[0][0].value() > before.row.bodies[0][0].value());
    }
}

/// A table A sin(w t) that the ball begins with lets it go where A w² sin(w t) = g: here at w t = π/6.
#[test]
fn a_table_that_falls_away_lets_go_where_its_acceleration_is_that_of_gravity() {
    let text = ball("0", r#""origin": [0, 0], "velocity": [0, 4.905]"#, "]").replace(
        r#""restitution": 0,"#,
        r#""restitution": 0, "law": {"start": 0, "sines": [{"amplitude": 1.22625, "frequency": 4}]},"#,
    );
    // g/(A w²) = 9.81/(1.22625 · 16) = 1/2, A w = 4.905.
    for digits in [30, 60] {
        let places = digits as u32 - 3;
        let found = ran(&text, "0.4", digits);
        let released: BigInt = pi() / 24;
        found.held(&[("floor", BigInt::ZERO, Some(released.clone()))], places);
        let after = fixed("0.4") - released;
        let speed = times(&fixed("4.905"), &cosine(&(pi() / 6)));
        let drop = times(&fixed("9.81"), &times(&after, &after)) / 2;
        found.has(&[(3, fixed("0.613125") + times(&speed, &after) - drop)], places);
        found.has(&[(5, speed - times(&fixed("9.81"), &after))], places);
    }
}

/// A box of 2 kg on corners 0.8 m apart that lies on a floor.
fn box_on_corners(start: &str, more: &str) -> String {
    let wall = |name: &str, x: &str| {
        format!(
            r#"{{"name": "{name}", "body": "box", "point": [{x}, -0.3], "line": {{"through": [0, 0], "normal": [0, 1]}}, "restitution": 0}}"#
        )
    };
    format!(
        r#"{{"name": "box", "gravity": [0, -9.81], "bars": [{{"name": "box", "mass": 2, "centre": [0, 0], "inertia": 0.3}}],
        "walls": [{}, {}, {}], "start": {{"box": {{"phi": 0, "omega": 0, {start}}}}}{more}, "until": 9, "every": 9}}"#,
        wall("left", "-0.4"),
        wall("middle", "0"),
        wall("right", "0.4")
    )
}

/// Three points that lie on a floor, of which two suffice; lifted at one corner, the box turns about the other one
/// from half its weight on.
#[test]
fn of_two_points_that_are_held_one_is_let_go_first() {
    for (start, since) in [
        (r#""origin": [0, 0.3], "velocity": [0.2, 0]"#, BigInt::ZERO),
        (r#""origin": [0, 0.51], "velocity": [0.2, 0]"#, root(&over(&fixed("0.42"), &fixed("9.81")))),
    ] {
        let force = r#", "forces": [{"name": "lift", "body": "box", "point": [0.4, -0.3], "force": [0, "4*max(t - 1, 0)"]}]"#;
        let found = ran(&box_on_corners(start, force), "3.7", 40);
        let lifted = one() + over(&fixed("9.81"), &fixed("4"));
        let ends: Vec<_> = found.holds.iter().filter_map(|hold| hold.until).collect();
        let told: Vec<_> = found.holds.iter().map(|hold| (&hold.wall, hold.t, hold.until)).collect();
        found.holds.iter().for_each(|hold| near(&number(hold.t), &since, 37));
        assert_eq!(ends.len(), 1, "{told:?}");
        near(&number(ends[0]), &lifted, 37);
        // It is turned from then on, and its left corner stays down.
        let [phi, _, x, y, ..] = found.row.bodies[0].map(|number| number.value());
        assert!(phi > 0.01 && (y - 0.4 * phi.sin() - 0.3 * phi.cos()).abs() < 1e-15, "{phi} {x} {y}");
    }
}

/// Both corners of a box bounce together until infinitely many bounces have ended.
#[test]
fn corners_that_bounce_together_stay_from_the_same_time_on() {
    for digits in [30, 60] {
        let start = r#""origin": [0, 0.51], "velocity": [0.2, 0]"#;
        let text = box_on_corners(start, "").replace(r#""restitution": 0"#, r#""restitution": 0.5"#);
        let found = ran(&text, "1.5", digits);
        let end = root(&over(&fixed("0.42"), &fixed("9.81"))) * 3;
        assert!(!found.holds.is_empty());
        for hold in &found.holds {
            near(&number(hold.t), &end, digits as u32 - 2);
            assert!(hold.until.is_none(), "{hold:?}");
        }
        found.has(&[(0, BigInt::ZERO), (2, fixed("0.3")), (3, fixed("0.3"))], digits as u32 - 2);
    }
}

/// A ball that slides along the floor meets a wall of restitution 1/2, and rebounds along the floor.
#[test]
fn a_second_wall_is_met_while_a_point_is_held() {
    let wall = r#", {"name": "end", "body": "ball", "point": [0, 0], "restitution": 0.5, "line": {"through": [1, 0], "normal": [-1, 0]}}]"#;
    let found = ran(&ball("0", r#""origin": [0, 0], "velocity": [0.8, 0]"#, wall), "2", 40);
    found.held(&[("floor", BigInt::ZERO, None)], 38);
    found.has(&[(2, fixed("0.7")), (4, fixed("-0.4")), (3, BigInt::ZERO), (0, fixed("1.4"))], 37);
    // A slope that is met drives it up, and off the floor: v⁺ = v - (1 + e) (n·v) n.
    let slope = wall.replace(r#""normal": [-1, 0]"#, r#""normal": [-4, 3]"#);
    let found = ran(&ball("0", r#""origin": [0, 0], "velocity": [0.8, 0]"#, &slope), "1.3", 40);
    // n = (-0.8, 0.6), n·v = -0.64: v⁺ = (0.8 - 0.768, 0.576).
    let after = fixed("0.05");
    let drop = times(&fixed("9.81"), &times(&after, &after)) / 2;
    found.held(&[("floor", BigInt::ZERO, Some(fixed("1.25")))], 38);
    found.has(&[(4, fixed("0.032")), (2, fixed("1.0016")), (3, times(&fixed("0.576"), &after) - drop)], 37);
    found.has(&[(5, fixed("0.576") - times(&fixed("9.81"), &after))], 37);
}

/// An event that switches the floor off lets the ball fall; one that puts it down catches it again.
#[test]
fn events_switch_walls_that_hold_a_point() {
    let events = r#"], "events": [{"name": "opens", "when": "t - 0.3", "off": ["floor"]}, {"name": "low", "when": "p.y + 0.2"}]"#;
    let found = ran(&ball("0", r#""origin": [0, 0], "velocity": [0.8, 0]"#, events), "1", 40);
    found.held(&[("floor", BigInt::ZERO, Some(fixed("0.3")))], 38);
    found.has(&[(3, -times(&fixed("9.81"), &fixed("0.49")) / 2), (2, fixed("0.8"))], 37);
    let [_, low] = &found.events[..] else { panic!("{:?}", found.events) };
    near(&number(low.t), &(fixed("0.3") + root(&over(&fixed("0.4"), &fixed("9.81")))), 37);
    // A parameter of the wall's law: it sinks from under the point, which falls down to it and stays.
    let text = ball(
        "0",
        r#""origin": [0, 0], "velocity": [0.8, 0]"#,
        r#"], "parameters": {"level": 0},
        "events": [{"name": "sinks", "when": "t - 0.3", "set": {"level": "-0.1"}}]"#,
    )
    .replace(r#""restitution": 0,"#, r#""restitution": 0, "law": "level","#);
    let found = ran(&text, "1", 40);
    let lands = fixed("0.3") + root(&over(&fixed("0.2"), &fixed("9.81")));
    found.held(&[("floor", BigInt::ZERO, Some(fixed("0.3"))), ("floor", lands, None)], 37);
    found.has(&[(3, fixed("-0.1")), (5, BigInt::ZERO)], 37);
    // A force that an event switches on, more than the weight, lifts it at once; switched off, it falls back.
    let force = r#"], "forces": [{"name": "lift", "body": "ball", "point": [0, 0], "force": [0, 29.62]}], "inactive": ["lift"],
        "events": [{"name": "on", "when": "t - 0.3", "on": ["lift"]}, {"name": "off", "when": "t - 0.5", "off": ["lift"]}]"#;
    let found = ran(&ball("0", r#""origin": [0, 0], "velocity": [0.8, 0]"#, force), "1.5", 40);
    // 5 m/s² for 0.2 s: 0.1 m and 1 m/s.
    let flies = over(&(one() + root(&(one() + fixed("1.962")))), &fixed("9.81"));
    found.held(&[("floor", BigInt::ZERO, Some(fixed("0.3"))), ("floor", fixed("0.5") + flies, None)], 37);
}

/// Two carts and a wall that is half the other's place: they go on together, 1 + 4/r² kg under the force k (t - 2),
/// until that pulls.
#[test]
fn a_wall_that_follows_the_state_holds_and_lets_go() {
    let cart = |name: &str, mass: u32| {
        format!(r#"{{"name": "{name}", "mass": {mass}, "centre": [0, 0], "inertia": 0.1}}"#)
    };
    let rail = |name: &str, body: &str| {
        format!(
            r#"{{"name": "{name}", "point": {{"body": "{body}", "point": [0, 0]}}, "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}, "angle": "locked"}}"#
        )
    };
    let text = format!(
        r#"{{"name": "carts", "gravity": [0, -9.81], "bars": [{}, {}], "sliders": [{}, {}],
        "points": [{{"name": "pb", "body": "b", "point": [0, 0]}}],
        "walls": [{{"name": "gear", "body": "a", "point": [0, 0], "restitution": 0, "line": {{"through": [0, 0], "normal": [1, 0]}}, "law": "0.5*pb.x"}}],
        "forces": [{{"name": "pull", "body": "a", "point": [0, 0], "force": ["3*(t - 2)", 0]}}],
        "start": {{"a": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}}, "b": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}}}},
        "until": 9, "every": 9}}"#,
        cart("a", 1),
        cart("b", 4),
        rail("A", "a"),
        rail("B", "b")
    );
    let found = ran(&text, "3", 40);
    found.held(&[("gear", BigInt::ZERO, Some(fixed("2")))], 37);
    // 17 v = 3 (t²/2 - 2 t), 17 x = 3 (t³/6 - t²) at 2 s: -6 and -8.
    let (speed, way) = (-fixed("6") / 17, -fixed("8") / 17);
    found.has(&[(4, &speed + fixed("1.5")), (2, &way + &speed + fixed("0.5"))], 37);
    near(&number(found.row.bodies[1][4]), &(&speed * 2), 37);
    near(&number(found.row.bodies[1][2]), &(&way * 2 + &speed * 2), 37);
}

/// A rod whose end falls on a floor, drawn along it by a spring, with a motor and a loop or without.
fn scenes() -> Vec<(String, &'static str)> {
    let bar = |name: &str, mass: &str| {
        format!(r#"{{"name": "{name}", "mass": {mass}, "centre": [0.3, 0], "inertia": 0.03, "length": 0.6}}"#)
    };
    let hinges = r#""hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "one", "point": [0, 0]}]},
        {"name": "B", "between": [{"body": "one", "point": [0.6, 0]}, {"body": "two", "point": [0, 0]}]}]"#;
    let wall = |name: &str, e: &str, place: &str| {
        format!(
            r#"{{"name": "{name}", "body": "two", "point": [0.6, 0], "restitution": {e}, "line": {place}}}"#
        )
    };
    let floor = wall("floor", "0", r#"{"through": [0, -0.7], "normal": [0.1, 1]}"#);
    let soft = wall("floor", "0.4", r#"{"through": [0, -0.7], "normal": [0, 1]}"#);
    let end = wall("end", "0.6", r#"{"through": [1.19, 0], "normal": [-1, 0.05]}"#);
    let knee = r#"{"name": "knee", "body": "one", "point": [0.6, 0], "restitution": 0, "line": {"through": [0, -0.5], "normal": [0, 1]}}"#;
    let shelf = r#"{"name": "shelf", "body": "one", "point": [0.6, 0], "restitution": 0.3, "line": {"through": [0, -0.05], "normal": [0.1, 1]}}"#;
    let scene = |walls: &[&str], start: [&str; 2], more: &str| {
        format!(
            r#"{{"name": "rods", "gravity": [0, -9.81], "bars": [{}, {}], {hinges}, "walls": [{}],
            "start": {{{}"two": {{"phi": {}, "omega": 0.4}}}}{more}, "until": 9, "every": 9}}"#,
            bar("one", "1"),
            bar("two", "0.7"),
            walls.join(", "),
            start[0],
            start[1]
        )
    };
    let spring = r#", "springs": [{"name": "coil", "between": [{"body": "ground", "point": [1.1, -0.4]}, {"body": "two", "point": [0.6, 0]}], "stiffness": 12, "free_length": 0.2, "damping": 0.3}]"#;
    let motor = r#", "motors": [{"name": "drive", "body": "one", "law": {"start": -0.6, "sines": [{"amplitude": 0.3, "frequency": 3}]}}]"#;
    let loop_of_bars = r#", "springs": [{"name": "coil", "between": [{"body": "ground", "point": [0, 0.5]}, {"body": "one", "point": [0.6, 0]}], "stiffness": 9, "free_length": 0.2, "damping": 0.1}],
        "torques": [{"name": "turns", "body": "two", "torque": "9*sin(5*t)"}],
        "sliders": [{"name": "guide", "point": {"body": "two", "point": [0.3, 0]}, "rail": {"body": "ground", "point": [0.85, 0], "direction": [0, 1]}}]"#;
    vec![
        (scene(&[&floor], [r#""one": {"phi": -0.5, "omega": 0},"#, "-0.9"], ""), "2.5"),
        (scene(&[&soft, &end], [r#""one": {"phi": -0.3, "omega": 0},"#, "-0.2"], ""), "1.5"),
        (scene(&[&soft, knee, &end], [r#""one": {"phi": -0.2, "omega": 0},"#, "-0.7"], spring), "1.6"),
        (scene(&[&floor, &end], ["", "-0.8"], motor), "2"),
        (scene(&[&soft], ["", "-0.1"], motor), "2.2"),
        (
            scene(&[shelf], [r#""one": {"phi": 0.2, "omega": 0},"#, "0.5"], loop_of_bars)
                .replace(r#""phi": 0.5, "omega": 0.4"#, r#""phi": 0.5"#),
            "1.5",
        ),
    ]
}

#[test]
fn runs_in_doubles_and_runs_of_other_digits_hold_at_the_same_times() {
    for (number_of, (text, until)) in scenes().iter().enumerate() {
        let source = source(text, &[], until, until);
        let (few, many) = (ran(text, until, 30), ran(text, until, 50));
        let request = Request {
            until: until.parse().ok(),
            every: until.parse().ok(),
            rtol: Some(1e-13),
            ..Request::default()
        };
        let plain = common::run(&parse_scene(text, "test", &[]).expect("a scene"), &request);
        assert!(plain.stop.is_none(), "{number_of}: {:?}", plain.stop);
        assert!(!plain.holds.is_empty(), "{number_of} holds nothing");
        println!("{number_of}: {} impacts, {:?}", plain.impact_count, plain.holds);
        for (k, (few, many)) in few.row.bodies.iter().zip(&many.row.bodies).enumerate() {
            few.iter().zip(many).for_each(|(&few, &many)| near(&number(few), &number(many), 26));
            let phi = source.mechanism.bodies.len();
            assert!(k < phi && (many[0].value() - plain.last.phi[k]).abs() < 1e-7, "{number_of}");
            assert!((many[1].value() - plain.last.omega[k]).abs() < 1e-6, "{number_of}");
        }
        let told = |holds: &[LongHold]| {
            holds
                .iter()
                .map(|hold| (hold.wall.clone(), hold.t.value(), hold.until.map(|t| t.value())))
                .collect::<Vec<_>>()
        };
        let holds = told(&many.holds);
        assert_eq!(holds.len(), plain.holds.len(), "{number_of}: {holds:?} and {:?}", plain.holds);
        assert_eq!(few.holds.len(), many.holds.len());
        for ((found, few), expected) in many.holds.iter().zip(&few.holds).zip(&plain.holds) {
            assert_eq!((&found.wall, found.until.is_some()), (&expected.wall, expected.until.is_some()));
            near(&number(few.t), &number(found.t), 25);
            // Bounces end in doubles where they are too low to be told.
            assert!((found.t.value() - expected.t).abs() < 1e-5, "{} and {}", found.t.value(), expected.t);
            if let (Some(few), Some(found), Some(expected)) = (few.until, found.until, expected.until) {
                near(&number(few), &number(found), 25);
                assert!((found.value() - expected).abs() < 1e-6, "{} and {expected}", found.value());
            }
        }
    }
}

#[test]
fn a_run_goes_on_to_the_last_bit_while_points_are_held() {
    let scenes = scenes();
    for (text, _) in [&scenes[0], &scenes[2], &scenes[3]] {
        let source = source(text, &[], "1.2", "0.1");
        assert!(!resumed(&source).holds().is_empty());
    }
}

#[test]
fn a_horizon_beyond_a_hold_is_forecast_and_proved() {
    let source = source(&scenes()[0].0, &[], "2", "0.5");
    let pair = proved(&source);
    assert!(
        !pair.holds().is_empty() && pair.holds().iter().all(|(_, digits)| digits.expect("two runs") > 15.0)
    );
}

/// An arm that lies on its stop has no freedom downwards, and a wall that rises under it takes it off: its middle goes on
/// with 1.5 m/s, 3 rad/s of 0.4 kg m².
#[test]
fn a_wall_that_rises_takes_an_arm_off_its_stop() {
    let text = r#"{"name": "lift", "gravity": [0, -10], "bars": [{"name": "arm", "mass": 1.2, "centre": [0.5, 0], "inertia": 0.1, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "arm", "point": [0, 0]}]}],
        "walls": [
            {"name": "stop", "body": "arm", "point": [1, 0], "restitution": 0, "line": {"through": [0, 0], "normal": [0, 1]}},
            {"name": "lifter", "body": "arm", "point": [0.5, 0], "restitution": 0.5, "line": {"through": [0, -0.25], "normal": [0, 1]},
                "law": {"start": 0, "rate": 1}}],
        "start": {"arm": {"phi": 0, "omega": 0}}, "until": 9, "every": 9}"#;
    let lifted = ran(text, "0.3", 40);
    lifted.held(&[("stop", BigInt::ZERO, Some(fixed("0.25")))], 37);
    near(&(number(lifted.row.energy[0]) + number(lifted.row.energy[1])), &fixed("1.8"), 37);
}

/// An arm that lies on a stop is coupled to a disc that turns: upwards it is taken along, as the stop cannot pull, and
/// downwards the disc is stopped at once.
#[test]
fn a_clutch_that_closes_takes_an_arm_off_its_stop_or_is_stopped() {
    let text = |speed: &str| {
        format!(
            r#"{{"name": "clutch", "gravity": [0, -9.81], "bars": [
                {{"name": "arm", "mass": 1.3, "centre": [0.25, 0], "inertia": 0.04, "length": 0.5}},
                {{"name": "disc", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 1}}],
            "hinges": [
                {{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "arm", "point": [0, 0]}}]}},
                {{"name": "B", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "disc", "point": [0, 0]}}]}}],
            "walls": [{{"name": "stop", "body": "arm", "point": [0.5, 0], "restitution": 0, "line": {{"through": [0, 0], "normal": [0, 1]}}}}],
            "locks": [{{"name": "clutch", "body": "arm", "relative_to": "disc"}}], "inactive": ["clutch"],
            "events": [{{"name": "grips", "when": "t - 1", "on": ["clutch"]}}],
            "start": {{"arm": {{"phi": 0, "omega": 0}}, "disc": {{"phi": 0, "omega": {speed}}}}}, "until": 9, "every": 9}}"#
        )
    };
    let down = ran(&text("-2"), "1.25", 40);
    down.held(&[("stop", BigInt::ZERO, None)], 38);
    near(&number(down.row.bodies[1][0]), &fixed("-2"), 37);
    near(&number(down.row.bodies[1][1]), &BigInt::ZERO, 37);
    let up = ran(&text("2"), "1.25", 40);
    up.held(&[("stop", BigInt::ZERO, Some(one()))], 37);
    // I_b ω = (I_a + I_b) ω⁺, I_a = 0.04 + 1.3/16.
    let energy = over(&fixed("0.5"), &fixed("0.62125"));
    near(&(number(up.row.energy[0]) + number(up.row.energy[1])), &energy, 37);
}
