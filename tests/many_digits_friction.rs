//! Dry friction in many digits: against closed forms in integer arithmetic, runs with other digits and runs in doubles.

use super::common;
use super::forces_at_points::{SLOPES, on_a_slope};
use super::friction::{any_scene, rod};
use super::friction_shared::linkage;
use super::many_digits::{
    begun, cosine, fixed, near, number, one, over, pi, proved, resumed, root, shipped, source, square, times,
};
use driftless::Mechanism;
use driftless::arithmetic::Real;
use driftless::run::digits::{LongTurn, Precision, ShownRow, long_run};
use driftless::run::{MethodId, Outcome, Request};
use driftless::scene::parse_scene;
use driftless::stepping::StepError;
use num_bigint::BigInt;

fn sine(x: &BigInt) -> BigInt {
    cosine(&(pi() / 2 - x))
}

/// The last row of a run of a scene, and its transitions.
struct Ran {
    row: ShownRow,
    turns: Vec<LongTurn>,
    impacts: u64,
}

fn tried(text: &str, until: &str, digits: usize) -> Result<Ran, StepError> {
    let mut run = begun(&source(text, &[], until, until), digits);
    let row = run.row(run.last_row(), &mut || false)?.expect("no pause");
    Ok(Ran { row, turns: run.turns(), impacts: run.counts()[1] })
}

/// True where a run in many digits comes to its end.
pub fn goes_on(text: &str, until: &str) -> bool {
    tried(text, until, 30).is_ok()
}

#[track_caller]
fn ran(text: &str, until: &str, digits: usize) -> Ran {
    let ran = tried(text, until, digits).unwrap_or_else(|stop| panic!("{stop}\n{text}"));
    let allowed = 10.0_f64.powi(5 - digits as i32);
    assert!(ran.row.drift.abs() < allowed, "{:e}", ran.row.drift);
    ran
}

impl Ran {
    /// Of the first body: what is at these places among angle, rate, position and velocity.
    #[track_caller]
    fn has(&self, expected: &[(usize, BigInt)], places: u32) {
        expected.iter().for_each(|(what, value)| near(&number(self.row.bodies[0][*what]), value, places));
    }

    /// The energy lost in friction.
    #[track_caller]
    fn lost(&self, expected: &BigInt, places: u32) {
        near(&number(self.row.friction.expect("friction")), expected, places);
    }

    #[track_caller]
    fn turned(&self, expected: &[(&str, &str, BigInt)], places: u32) {
        let told: Vec<_> = self.turns.iter().map(|turn| (&turn.name, turn.does, turn.t)).collect();
        assert_eq!(told.len(), expected.len(), "{told:?}");
        for (turn, (name, does, t)) in self.turns.iter().zip(expected) {
            assert_eq!((&turn.name[..], turn.does), (*name, *does), "{told:?}");
            near(&number(turn.t), t, places);
        }
    }
}

/// A block of 2 kg on a rail, and what else there is.
fn block(along: [&str; 2], friction: &str, [x, y, vx, vy]: [&str; 4], more: &str) -> String {
    format!(
        r#"{{"name": "block", "gravity": [0, -9.81],
        "bars": [{{"name": "block", "mass": 2, "centre": [0, 0], "inertia": 0.01, "length": 0.2}}],
        "sliders": [{{"name": "S", "point": {{"body": "block", "point": [0, 0]}}, "angle": "locked",
            "rail": {{"body": "ground", "point": [0, 0], "direction": [{}, {}]}}, "friction": {friction}}}]{more},
        "start": {{"block": {{"phi": 0, "omega": 0, "origin": [{x}, {y}], "velocity": [{vx}, {vy}]}}}},
        "until": 9, "every": 9}}"#,
        along[0], along[1]
    )
}

/// On a slope of 3 in 4: g sin and g cos of it are 5.886 and 7.848.
#[test]
fn a_block_slides_up_a_slope_and_turns_or_stays() {
    let start = ["0", "0", "1.6", "1.2"];
    for digits in [30, 60] {
        let places = digits as u32 - 3;
        // 2 m/s; up with 5.886 + 0.2 · 7.848, down with 5.886 - 0.2 · 7.848.
        let turns = ran(&block(["0.8", "0.6"], r#"{"kinetic": 0.2, "static": 0.3}"#, start, ""), "2", digits);
        let (up, down) = (fixed("7.4556"), fixed("4.3164"));
        let (stops, top) = (over(&fixed("2"), &up), over(&fixed("2"), &up));
        let left = fixed("2") - &stops;
        let back = times(&down, &square(&left)) / 2;
        let way = &top - &back;
        turns.has(&[(2, times(&way, &fixed("0.8"))), (3, times(&way, &fixed("0.6")))], places);
        turns.has(&[(4, -times(&times(&down, &left), &fixed("0.8")))], places);
        turns.lost(&times(&fixed("3.1392"), &(&top + &back)), places);
        turns.turned(&[("S", "slides", BigInt::ZERO)], places);
        // 0.8 is above the tangent of the slope.
        let stays = ran(&block(["4", "3"], r#"{"kinetic": 0.5, "static": 0.8}"#, start, ""), "2", digits);
        let (up, force) = (fixed("9.81"), fixed("7.848"));
        let stops = over(&fixed("2"), &up);
        stays.has(&[(2, times(&stops, &fixed("0.8"))), (4, BigInt::ZERO), (5, BigInt::ZERO)], places);
        stays.lost(&times(&force, &stops), places);
        stays.turned(&[("S", "slides", BigInt::ZERO), ("S", "sticks", stops)], places);
    }
}

/// k = 50, so that ω = 5, and 2 mu N/k = 0.15696: every half period takes that off the amplitude, until the spring is
/// below 0.25 N.
#[test]
fn a_block_on_a_spring_loses_the_same_amplitude_every_half_period_and_sticks() {
    let spring = r#", "springs": [{"name": "k", "between": [{"body": "ground", "point": [-1, 0]}, {"body": "block", "point": [0, 0]}],
        "stiffness": 50, "free_length": 1}]"#;
    let text = block(["1", "0"], r#"{"kinetic": 0.2, "static": 0.25}"#, ["1", "0", "0", "0"], spring);
    for digits in [30, 60] {
        let places = digits as u32 - 3;
        let found = ran(&text, "4", digits);
        let end: BigInt = one() - fixed("0.15696") * 6;
        found.has(&[(2, end.clone()), (4, BigInt::ZERO)], places);
        found.lost(&((one() - square(&end)) * 25), places);
        found.turned(&[("S", "slides", BigInt::ZERO), ("S", "sticks", pi() * 6 / 5)], places);
        // In the second half period it swings about -mu N/k.
        let found = ran(&text, "1", digits);
        let swing = one() - fixed("0.07848") * 3;
        found.has(&[(2, -fixed("0.07848") + times(&swing, &cosine(&fixed("5"))))], places);
    }
}

/// A bar turned by a motor: the force of its hinge is a root, and converges later than the motion.
#[test]
fn what_a_driven_bar_loses_does_not_hang_on_digits() {
    let text = r#"{"name": "driven", "gravity": [0, -9.81],
        "bars": [{"name": "b", "mass": 1, "centre": [0.3, 0], "inertia": 0.05, "length": 0.6}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}],
            "friction": {"radius": 0.05, "kinetic": 0.3}}],
        "motors": [{"name": "M", "body": "b", "law": {"start": 0, "rate": 6}}], "start": {}, "until": 9, "every": 9}"#;
    let [few, many] = [25, 40].map(|digits| ran(text, "3", digits).row.friction.expect("friction"));
    near(&number(few), &number(many), 20);
    assert!((many.value() - 3.507_451_6).abs() < 1e-6, "{}", many.value());
}

/// A disc on a shaft that turns at 0.5 rad/s, held back by a torsion spring, without weight: 0.5 sin(w t)/w.
#[test]
fn without_a_load_there_is_no_friction() {
    let text = shipped("stick_slip").replace("-9.81", "0");
    let found = ran(&text, "1.7", 30);
    let w = root(&fixed("10"));
    near(&number(found.row.bodies[1][0]), &(over(&sine(&times(&w, &fixed("1.7"))), &w) / 2), 27);
    found.lost(&fixed("0"), 30);
}

/// A box that falls carries its wheel, or a bar hinged on it anywhere, without a force between both: what is at rest on
/// it stays so, and what turns about its own centre of mass goes on.
#[test]
fn what_falls_freely_has_no_friction() {
    let text = |[centre, point]: [&str; 2], spin: &str| {
        format!(
            r#"{{"name": "falls", "gravity": [0, -9.81], "bars": [{{"name": "bar", "mass": 0.9, "centre": {centre}, "inertia": 0.011}},
                {{"name": "box", "mass": 2, "centre": [0.07, -0.05], "inertia": 0.11}}],
            "hinges": [{{"name": "A", "between": [{{"body": "box", "point": {point}}}, {{"body": "bar", "point": [0, 0]}}],
                "friction": {{"radius": 0.05, "kinetic": 0.3}}}}],
            "start": {{"box": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [1, 0]}},
                "bar": {{"phi": -0.55, "omega": {spin}}}}}, "until": 9, "every": 9}}"#
        )
    };
    let bar = ["[0.29, 0.03]", "[0, 0.1]"];
    let wheel = ["[0, 0]", "[0, 0.1]"];
    for (digits, at, spin, angle) in [
        (30, bar, "0", "-0.55"),
        (60, bar, "0", "-0.55"),
        (30, wheel, "4", "0.25"),
        (60, wheel, "-4", "-1.35"),
    ] {
        let found = ran(&text(at, spin), "0.2", digits);
        let expected = [(0, angle), (1, spin), (4, "1"), (5, "-1.962")];
        found.has(&expected.map(|(what, value)| (what, fixed(value))), digits as u32 - 3);
        found.lost(&BigInt::ZERO, digits as u32 - 3);
    }
}

/// The hinge carries 19.62 N at 0.05 m, which holds 0.2943 N m: loose at 0.73575 s, against 0.1962 N m from then on.
#[test]
fn a_disc_breaks_loose_where_the_torque_is_what_friction_holds() {
    let text = r#"{"name": "ramp", "gravity": [0, -9.81], "bars": [{"name": "disc", "mass": 2, "centre": [0, 0], "inertia": 0.3}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "disc", "point": [0, 0]}],
            "friction": {"radius": 0.05, "kinetic": 0.2, "static": 0.3}}],
        "torques": [{"name": "T", "body": "disc", "torque": "0.4*t"}],
        "start": {"disc": {"phi": 0.3, "omega": 0}}, "until": 9, "every": 9}"#;
    for (sign, digits) in [(1, 30), (1, 60), (-1, 40)] {
        let places = digits as u32 - 3;
        let text = if sign < 0 { text.replace("0.4*t", "-0.4*t") } else { text.to_owned() };
        let found = ran(&text, "2", digits);
        let loose = fixed("0.73575");
        let t = fixed("2");
        let power = |t: &BigInt, n: u32| (1..n).fold(t.clone(), |product, _| times(&product, t));
        let rate = |t: &BigInt| over(&(power(t, 2) / 5 - times(&fixed("0.1962"), t)), &fixed("0.3"));
        let way =
            |t: &BigInt| over(&(power(t, 3) / 15 - times(&fixed("0.1962"), &power(t, 2)) / 2), &fixed("0.3"));
        let turned = way(&t) - way(&loose) - times(&rate(&loose), &(&t - &loose));
        found.has(&[(0, fixed("0.3") + &turned * sign), (1, (rate(&t) - rate(&loose)) * sign)], places);
        found.lost(&times(&fixed("0.1962"), &turned), places);
        found.turned(&[("A", "sticks", BigInt::ZERO), ("A", "slides", loose)], places);
    }
}

/// A ball that falls 0.5 m with its centre on a floor with friction.
fn ball(vx: &str, e: &str, friction: &str, point: &str) -> String {
    format!(
        r#"{{"name": "ball", "gravity": [0, -9.81], "bars": [{{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 0.1}}],
        "walls": [{{"name": "floor", "body": "ball", "point": {point}, "line": {{"through": [0, 0], "normal": [0, 1]}},
            "restitution": {e}, "friction": {friction}}}],
        "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [0, 0.5], "velocity": [{vx}, 0]}}}}, "until": 9, "every": 9}}"#
    )
}

/// Every bounce takes mu (1+e) v off the sliding velocity; bounces end at (1+e)/(1-e) times the time of the fall, then
/// mu g decelerates.
#[test]
fn a_ball_bounces_to_rest_and_slides_to_a_stop() {
    let [g, mu, u] = ["9.81", "0.2", "2.5"].map(fixed);
    let v = root(&g);
    for (law, digits) in [("poisson", 30), ("poisson", 60), ("newton", 30)] {
        let places = digits as u32 - 3;
        let text = ball("2.5", "0.5", &format!(r#"{{"kinetic": 0.2, "impact": "{law}"}}"#), "[0, 0]");
        let fall = over(&v, &g);
        // mu (1+e) v, and all of these impulses.
        let once = times(&mu, &v) * 3 / 2;
        let after = ran(&text, "0.4", digits);
        after.has(&[(4, &u - &once), (5, &v / 2 - times(&g, &(fixed("0.4") - &fall)))], places);
        assert_eq!(after.impacts, 1);
        let slides = &u - &once * 2;
        let flown = times(&fall, &(&slides * 2 + &once * 4 / 3));
        let ends = &fall * 3;
        let stops = &ends + over(&slides, &times(&mu, &g));
        let x = times(&u, &fall) + flown + over(&square(&slides), &(times(&mu, &g) * 2));
        let rests = ran(&text, "2", digits);
        rests.has(&[(2, x), (3, BigInt::ZERO), (4, BigInt::ZERO), (5, BigInt::ZERO)], places);
        rests.turned(&[("floor", "slides", ends), ("floor", "sticks", stops)], places);
        // What is left to slide is lost in friction, and not in impacts.
        rests.lost(&square(&slides), places);
    }
}

/// Struck aside of its centre by its point at (0.2, -0.1): A = 1/m + r²/I of velocities by impulses.
#[test]
fn a_ball_that_sticks_in_an_impact_turns_as_the_impulses_say() {
    let (inertia, e) = (fixed("0.1"), fixed("0.5"));
    let v = root(&times(&fixed("19.62"), &fixed("0.4")));
    let response = |a: &str, b: &str| over(&times(&fixed(a), &fixed(b)), &inertia);
    let across = one() / 2 + response("-0.1", "-0.1");
    let both = -response("-0.1", "0.2");
    let normal = one() / 2 + response("0.2", "0.2");
    let compressed = over(&v, &(&normal - over(&square(&both), &across)));
    let along_normal = times(&compressed, &(one() + &e));
    let along_wall = -times(&over(&both, &across), &along_normal);
    let omega = over(&(times(&fixed("0.2"), &along_normal) - times(&-fixed("0.1"), &along_wall)), &inertia);
    for digits in [30, 60] {
        let places = digits as u32 - 3;
        let found = ran(&ball("0", "0.5", r#"{"kinetic": 0.5}"#, "[0.2, -0.1]"), "0.3", digits);
        let fell = root(&over(&fixed("0.8"), &fixed("9.81")));
        let left = fixed("0.3") - &fell;
        assert_eq!(found.impacts, 1);
        let vy = &along_normal / 2 - &v - times(&fixed("9.81"), &left);
        found.has(&[(1, omega.clone()), (0, times(&omega, &left))], places);
        found.has(&[(4, &along_wall / 2), (5, vy)], places);
        // With less friction it slides through: 0.2 times the normal impulse.
        let slips = ran(&ball("0", "0.5", r#"{"kinetic": 0.02}"#, "[0.2, -0.1]"), "0.3", digits);
        let pushed = over(&times(&v, &(one() + &e)), &(&normal - &both / 50));
        slips.has(&[(4, -&pushed / 100)], places);
    }
}

/// A bar on a hinge with and without friction falls on a rough wall, whose impulses stop it at once: its tip stays at
/// (0.14, -0.48).
#[test]
fn a_hinged_bar_stays_where_a_rough_wall_stops_it() {
    for (normal, mu) in [("0.1", "0.5"), ("-0.09", "0.443"), ("-0.15", "0.25"), ("-0.25", "0.7")] {
        for friction in ["", r#", "friction": {"radius": 0.044, "kinetic": 0.243}"#] {
            let text = format!(
                r#"{{"name": "rest", "gravity": [0, -9.81],
                "bars": [{{"name": "b", "mass": 1, "centre": [0.25, 0], "inertia": 0.03, "length": 0.5}}],
                "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}]{friction}}}],
                "walls": [{{"name": "W", "body": "b", "point": [0.5, 0], "restitution": 0, "friction": {{"kinetic": {mu}}},
                    "line": {{"through": [0.14, -0.48], "normal": [{normal}, 1]}}}}],
                "start": {{"b": {{"phi": -0.3, "omega": 0}}}}, "until": 9, "every": 9}}"#
            );
            for digits in [25, 30, 60] {
                let places = digits as u32 - 3;
                let found = ran(&text, "1", digits);
                assert_eq!(found.impacts, 1, "{text}");
                found.has(&[(1, BigInt::ZERO)], places);
                near(&cosine(&number(found.row.bodies[0][0])), &fixed("0.28"), places);
            }
        }
    }
}

/// A spring of 50 N/m whose other end moves with 0.3 m/s: loose at 0.4 N / (k v), then a swing about 0.2 N/k behind it.
#[test]
fn a_motor_that_drags_a_block_by_a_spring_pulls_it_loose() {
    let more = r#", "springs": [{"name": "k", "between": [{"body": "cart", "point": [0, 0]}, {"body": "block", "point": [0, 0]}],
        "stiffness": 50, "free_length": 1}], "motors": [{"name": "m", "slider": "D", "law": {"start": 1, "rate": 0.3}}]"#;
    let text = block(["1", "0"], r#"{"kinetic": 0.2, "static": 0.4}"#, ["0", "0", "0", "0"], more)
        .replace(
            r#""inertia": 0.01, "length": 0.2}]"#,
            r#""inertia": 0.01, "length": 0.2}, {"name": "cart", "mass": 1, "centre": [0, 0], "inertia": 0.01}]"#,
        )
        .replace(
            r#"0.4}}]"#,
            r#"0.4}}, {"name": "D", "point": {"body": "cart", "point": [0, 0]}, "angle": "locked",
            "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}}]"#,
        )
        .replace(r#""start": {"#, r#""start": {"cart": {"phi": 0, "omega": 0}, "#);
    for digits in [30, 60] {
        let places = digits as u32 - 3;
        let loose = over(&fixed("0.15696"), &fixed("0.3"));
        let until = fixed("1");
        let angle = (&until - &loose) * 5;
        let found = ran(&text, "1", digits);
        let behind = times(&fixed("0.07848"), &cosine(&angle)) + times(&fixed("0.06"), &sine(&angle));
        let rate = times(&fixed("0.3"), &cosine(&angle)) - times(&fixed("0.3924"), &sine(&angle));
        let x = times(&fixed("0.3"), &until) - behind - fixed("0.07848");
        found.has(&[(2, x.clone()), (4, fixed("0.3") - rate)], places);
        found.lost(&times(&fixed("3.924"), &x), places);
        found.turned(&[("S", "sticks", BigInt::ZERO), ("S", "slides", loose)], places);
    }
}

/// Two blocks on one line share what is put on them, up to 28.5 N, and 19 N while they slide; 10 t is put on.
#[test]
fn two_rails_hold_what_they_can_hold_together() {
    let rail = |name: &str, body: &str, friction: &str| {
        format!(
            r#"{{"name": "{name}", "point": {{"body": "{body}", "point": [0, 0]}}, "angle": "locked",
            "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}, "friction": {friction}}}"#
        )
    };
    let text = format!(
        r#"{{"name": "blocks", "gravity": [0, -10], "bars": [{{"name": "one", "mass": 2, "centre": [0, 0], "inertia": 0.1}},
            {{"name": "two", "mass": 3, "centre": [0, 0], "inertia": 0.1}}, {{"name": "rod", "mass": 1, "centre": [0.5, 0], "inertia": 0.1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "one", "point": [0, 0]}}, {{"body": "rod", "point": [0, 0]}}]}},
            {{"name": "B", "between": [{{"body": "rod", "point": [1, 0]}}, {{"body": "two", "point": [0, 0]}}]}}],
        "sliders": [{}, {}], "forces": [{{"name": "F", "body": "one", "point": [0, 0], "force": ["10*t", 0]}}],
        "start": {{"one": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}}, "rod": {{"phi": 0, "omega": 0}},
            "two": {{"phi": 0, "omega": 0}}}}, "until": 9, "every": 9}}"#,
        rail("first", "one", r#"{"kinetic": 0.2, "static": 0.3}"#),
        rail("second", "two", r#"{"kinetic": 0.4, "static": 0.6}"#)
    );
    let found = ran(&text, "4", 30);
    let (loose, by) = (fixed("2.85"), fixed("1.15"));
    let way = times(&(fixed("28.5") - fixed("19")), &square(&by)) / 12 + times(&by, &square(&by)) * 10 / 36;
    found.has(&[(2, way)], 27);
    let expected = [("first", "sticks", BigInt::ZERO), ("second", "sticks", BigInt::ZERO)];
    let later = [("first", "slides", loose.clone()), ("second", "slides", loose)];
    found.turned(&[expected, later].concat(), 27);
}

/// A motor that dwells: friction begins when it moves, and takes 0.2 N m times the angle.
#[test]
fn what_a_motor_holds_slides_as_soon_as_it_is_moved() {
    for (law, until, turned) in [
        ("if(t < 1, 0, (t - 1)^4/2)", "2", fixed("0.5")),
        ("0.3*t", "2", fixed("0.6")),
        ("0.3", "2", BigInt::ZERO),
        ("sin(pi*t)^3/2", "1.5", fixed("1")),
    ] {
        let text = format!(
            r#"{{"name": "wheel", "gravity": [0, -10], "bars": [{{"name": "wheel", "mass": 2, "centre": [0, 0], "inertia": 0.3}}],
            "hinges": [{{"name": "shaft", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "wheel", "point": [0, 0]}}],
                "friction": {{"radius": 0.05, "kinetic": 0.2, "static": 0.3}}}}],
            "motors": [{{"name": "motor", "body": "wheel", "law": "{law}"}}], "start": {{}}, "until": 9, "every": 9}}"#
        );
        let turned = if until == "1.5" { fixed("1.5") } else { turned };
        ran(&text, until, 30).lost(&(turned / 5), 26);
    }
}

fn in_doubles(text: &str, until: &str) -> Outcome {
    let (until, method) = (until.parse().ok(), Some(MethodId::Taylor));
    let request = Request { until, every: until, rtol: Some(1e-12), method, ..Request::default() };
    common::run(&parse_scene(text, "test", &[]).expect("a scene"), &request)
}

/// How far a run is from that in doubles: angles and positions.
fn apart(found: &Ran, plain: &Outcome) -> f64 {
    let phi = &plain.last.phi;
    let angles = found.row.bodies.iter().zip(phi).map(|(body, phi)| (body[0].value() - phi).abs());
    angles.fold(0.0, f64::max)
}

#[test]
fn shipped_scenes_move_as_in_doubles() {
    for (name, until, transitions) in
        [("friction_pendulum", "1.5", 2), ("stick_slip", "6", 4), ("sliding_ball", "2", 2)]
    {
        let text = shipped(name);
        let (found, plain) = (ran(&text, until, 30), in_doubles(&text, until));
        assert!(apart(&found, &plain) < 1e-9, "{name}: {:e}", apart(&found, &plain));
        for (body, centre) in found.row.bodies.iter().zip(&plain.last.centre) {
            assert!((body[2].value() - centre[0]).abs() < 1e-9, "{name}");
        }
        assert_eq!(found.turns.len(), plain.frictions.len(), "{name}: {:?}", found.turns);
        assert!(found.turns.len() >= transitions);
        for (turn, expected) in found.turns.iter().zip(&plain.frictions) {
            assert_eq!((&turn.name[..], turn.does), (&expected.name[..], &expected.mode[..]), "{name}");
            // Bounces end in doubles where they are too low to be told.
            assert!((turn.t.value() - expected.t).abs() < 1e-5, "{name}: {turn:?} {expected:?}");
        }
    }
}

/// A four-bar whose third bar another one follows in parallel: a constraint too many leaves the forces in the hinges
/// open, as in doubles.
#[test]
fn friction_in_redundant_joints_is_refused() {
    let bar = |name: &str, length: &str| {
        format!(r#"{{"name": "{name}", "mass": 1, "centre": [0.2, 0], "inertia": 0.02, "length": {length}}}"#)
    };
    let hinge = |name: &str, a: &str, x: &str, b: &str, y: &str, more: &str| {
        format!(
            r#"{{"name": "{name}", "between": [{{"body": "{a}", "point": [{x}, 0]}}, {{"body": "{b}", "point": [{y}, 0]}}]{more}}}"#
        )
    };
    let rubs = r#", "friction": {"radius": 0.01, "kinetic": 0.1}"#;
    let text = format!(
        r#"{{"name": "parallel", "gravity": [0, -9.81], "bars": [{}, {}, {}, {}], "hinges": [{}, {}, {}, {}, {}, {}],
        "start": {{"a": {{"phi": 1, "omega": 0}}, "b": {{"phi": 1}}, "c": {{"phi": 1}}, "d": {{"phi": 0}}}}, "until": 1, "every": 1}}"#,
        bar("a", "0.4"),
        bar("b", "0.4"),
        bar("c", "0.4"),
        bar("d", "1"),
        hinge("A", "ground", "0", "a", "0", rubs),
        hinge("B", "ground", "0.5", "b", "0", ""),
        hinge("C", "ground", "1", "c", "0", ""),
        hinge("P", "a", "0.4", "d", "0", ""),
        hinge("Q", "b", "0.4", "d", "0.5", ""),
        hinge("R", "c", "0.4", "d", "1", "")
    );
    let refusal = long_run(&source(&text, &[], "1", "1"), Precision::new(30, true)).err().expect("a refusal");
    assert!(refusal.to_string().contains("constraints are redundant"), "{refusal}");
}

/// A disc in a hinge on a carriage that is pushed to and fro: the hinge carries 10 |cos 4t| N, which passes zero at
/// π/8 and 3π/8, and friction takes 0.15 |cos 4t| N m.
#[test]
fn a_force_in_a_hinge_that_passes_zero_brakes_by_its_size() {
    let text = r#"{"name": "carried", "gravity": [0, 0],
        "bars": [{"name": "disc", "mass": 0.8, "centre": [0, 0], "inertia": 0.02, "length": 0.1},
            {"name": "carriage", "mass": 1.2, "centre": [0, 0], "inertia": 0.01, "length": 0.1}],
        "hinges": [{"name": "A", "between": [{"body": "carriage", "point": [0, 0]}, {"body": "disc", "point": [0, 0]}],
            "friction": {"radius": 0.05, "kinetic": 0.3}}],
        "sliders": [{"name": "guide", "point": {"body": "carriage", "point": [0, 0]}, "angle": "locked",
            "rail": {"body": "ground", "point": [0, 0], "direction": [3, 4]}}],
        "forces": [{"name": "F", "body": "carriage", "point": [0, 0], "force": ["15*cos(4*t)", "20*cos(4*t)"]}],
        "start": {"carriage": {"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}, "disc": {"phi": 0, "omega": 40}},
        "until": 9, "every": 9}"#;
    for digits in [30, 60] {
        let lost = times(&fixed("1.875"), &(one() * 2 - sine(&fixed("4"))));
        ran(text, "1", digits).has(&[(1, fixed("40") - lost)], digits as u32 - 3);
    }
}

/// Rods, tables, belts, slots and stops.
#[test]
fn mechanisms_with_friction_agree_with_other_digits_and_with_doubles() {
    let table = r#"{"name": "ball", "gravity": [0, -9.81], "bars": [{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.1}],
        "walls": [{"name": "table", "body": "ball", "point": [0, 0], "line": {"through": [0, 0], "normal": [0, 1]},
            "restitution": 0, "friction": {"kinetic": 0.3}, "law": "-3*t^3"}],
        "start": {"ball": {"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [4, 0]}}, "until": 1, "every": 1}"#;
    let belt = r#"{"name": "belt", "gravity": [0, -9.81], "bars": [{"name": "belt", "mass": 3, "centre": [0, 0], "inertia": 0.1},
            {"name": "load", "mass": 1, "centre": [0, 0], "inertia": 0.1}],
        "sliders": [{"name": "guide", "point": {"body": "belt", "point": [0, 0]}, "angle": "locked",
            "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0.1]}}],
        "motors": [{"name": "drive", "slider": "guide", "law": "0.3*sin(3*t)"}],
        "walls": [{"name": "top", "body": "load", "point": [0, 0], "restitution": 0.2, "friction": {"kinetic": 0.15, "static": 0.2},
            "line": {"body": "belt", "through": [0, 0.1], "normal": [0.05, 1]}}],
        "start": {"belt": {"phi": 0, "omega": 0}, "load": {"phi": 0, "omega": 0, "origin": [0, 0.3], "velocity": [0.5, 0]}}, "until": 2, "every": 2}"#;
    let slot = r#"{"name": "slot", "gravity": [0, 0], "bars": [{"name": "crank", "mass": 1, "centre": [0, 0], "inertia": 0.2, "length": 0.2},
            {"name": "rocker", "mass": 2, "centre": [0, 0], "inertia": 0.1, "length": 0.8}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "crank", "point": [0, 0]}]},
            {"name": "B", "between": [{"body": "ground", "point": [0.5, 0]}, {"body": "rocker", "point": [0, 0]}]}],
        "sliders": [{"name": "pin", "point": {"body": "crank", "point": [0.2, 0]},
            "rail": {"body": "rocker", "point": [0, 0], "direction": [1, 0]}, "friction": {"kinetic": 0.2}}],
        "start": {"crank": {"phi": 0.3, "omega": 9}, "rocker": {"phi": 2.941}}, "until": 0.7, "every": 0.7}"#;
    let stop = r#"{"name": "block", "gravity": [0, -10], "bars": [{"name": "block", "mass": 2, "centre": [0, 0], "inertia": 0.1}],
        "sliders": [{"name": "rail", "point": {"body": "block", "point": [0, 0]}, "angle": "locked",
            "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "friction": {"kinetic": 0.4, "static": 0.6}}],
        "walls": [{"name": "wall", "body": "block", "point": [0, 0], "restitution": 0, "line": {"through": [0, 0], "normal": [1, 0]}}],
        "forces": [{"name": "F", "body": "block", "point": [0, 0], "force": ["-30*cos(1*t)", 0]}],
        "start": {"block": {"phi": 0, "omega": 0, "origin": [0.5, 0], "velocity": [-2, 0]}}, "until": 3, "every": 3}"#;
    let rough = r#"{"name": "rest", "gravity": [0, -9.81], "bars": [{"name": "a", "mass": 0.7, "centre": [0.3, 0], "inertia": 0.02, "length": 0.6},
            {"name": "b", "mass": 0.6, "centre": [0.2, 0.1], "inertia": 0.014, "length": 0.5}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0.1, 0]}], "friction": {"radius": 0.03, "kinetic": 0.2}},
            {"name": "B", "between": [{"body": "a", "point": [0.4, 0]}, {"body": "b", "point": [0, 0]}]}],
        "walls": [{"name": "floor", "body": "b", "point": [0.5, 0], "restitution": 0.4, "friction": {"kinetic": 0.3},
            "line": {"through": [0, -0.45], "normal": [0.1, 1]}}],
        "start": {"a": {"phi": 0.1, "omega": 0}, "b": {"phi": -0.5, "omega": -1.5}}, "until": 0.9, "every": 0.9}"#;
    let mut impacts = 0;
    for (text, until, turns) in [
        (&rod(1.1, 0.4, 3.0, 0.3, 0.25)[..], "0.25", 1),
        (table, "1", 2),
        (belt, "2", 3),
        (slot, "0.7", 1),
        (stop, "3", 2),
        (rough, "0.9", 1),
    ] {
        let found = compared(text, until).expect("no stop");
        assert!(found.turns.len() >= turns, "{:?}\n{text}", found.turns);
        impacts += found.impacts;
    }
    assert!(impacts > 3, "{impacts}");
}

/// How a random scene goes in few digits, in more and in doubles.
fn compared(text: &str, until: &str) -> Option<Ran> {
    let plain = in_doubles(text, until);
    let (few, many) = (tried(text, until, 30), tried(text, until, 45));
    let (few, many) = match (few, many, &plain.stop) {
        (Ok(few), Ok(many), None) => (few, many),
        (Err(few), Err(many), _) => {
            println!("stops: {few} | {:?}", plain.stop.as_ref().map(ToString::to_string));
            assert_eq!(few.cause, many.cause, "{few} {many}\n{text}");
            return None;
        }
        (few, many, plain) => panic!("{:?} {:?} {plain:?}\n{text}", few.err(), many.err()),
    };
    assert!(many.row.drift.abs() < 1e-36 && few.row.drift.abs() < 1e-24, "{:e}\n{text}", many.row.drift);
    for (few, many) in few.row.bodies.iter().zip(&many.row.bodies) {
        few.iter().zip(many).for_each(|(&few, &many)| near(&number(few), &number(many), 20));
    }
    assert_eq!(few.turns.len(), many.turns.len(), "{text}");
    assert!(apart(&many, &plain) < 1e-5, "{:e}\n{text}", apart(&many, &plain));
    Some(many)
}

/// Friction in hinges that carry the force of a wall, which is a slope in one run and a curve in the other.
#[test]
fn a_slope_written_as_a_curve_brakes_hinges_as_the_slope() {
    let [line, curve] = SLOPES.map(|wall| {
        ran(&on_a_slope(wall, r#", "friction": {"kinetic": 0.3, "radius": 0.1}"#, ""), "0.8", 30)
    });
    for (line, curve) in line.row.bodies.iter().zip(&curve.row.bodies) {
        line.iter().zip(curve).for_each(|(&line, &curve)| near(&number(line), &number(curve), 26));
    }
    assert!(line.impacts > 0 && line.turns.len() == 2 && curve.turns.len() == 2, "{:?}", line.turns);
}

/// Chains, carts, motors, floors, and linkages with springs, torques, motors, dwells and stops: of those that move in
/// doubles, as many with impacts as without.
#[test]
fn random_mechanisms_agree_with_other_digits_and_with_doubles() {
    let count: u64 = std::env::var("FRICTION").ok().and_then(|count| count.parse().ok()).unwrap_or(3);
    let [mut held, mut turns, mut impacts] = [0_u64; 3];
    let mut left = [[count; 2]; 2];
    for seed in 0..40 * count {
        for (kind, text, until) in [(0, any_scene(seed), "0.8"), (1, linkage(seed), "0.7")] {
            let Ok(scene) = parse_scene(&text, "test", &[]) else { continue };
            if scene.frictions.is_empty() || Mechanism::new(&scene).is_err() {
                continue;
            }
            let plain = in_doubles(&text, until);
            let left = &mut left[kind][usize::from(plain.impact_count > 0)];
            if plain.stop.is_some() || *left == 0 {
                continue;
            }
            *left -= 1;
            println!("{seed} {}, {} impacts", scene.name, plain.impact_count);
            let Some(found) = compared(&text, until) else { continue };
            (held, turns, impacts) = (held + 1, turns + found.turns.len() as u64, impacts + found.impacts);
        }
    }
    println!("{held} compared, {turns} transitions, {impacts} impacts");
    assert!(held > 3 * count && turns > held && impacts > count, "{left:?}");
}

/// An event takes the force off that pulls a block, which slides to a stop; another one pulls it back.
#[test]
fn events_push_and_stop_what_slides() {
    let more = r#", "forces": [{"name": "pull", "body": "block", "point": [0, 0], "force": [9, 0]}, {"name": "back", "body": "block", "point": [0, 0], "force": [-9, 0]}],
        "inactive": ["back"],
        "events": [{"name": "ceases", "when": "t - 1", "off": ["pull"]}, {"name": "returns", "when": "t - 2.5", "on": ["back"]}]"#;
    let text = block(["1", "0"], r#"{"kinetic": 0.2, "static": 0.25}"#, ["0", "0", "0", "0"], more);
    let found = ran(&text, "3", 40);
    // (9 - 3.924)/2 for a second, 1.962 back to rest, and then (9 - 3.924)/2 the other way for half a second.
    let speed = fixed("2.538");
    let slowed = over(&speed, &fixed("1.962"));
    let stops = one() + &slowed;
    let x = &speed / 2 + times(&speed, &slowed) / 2 - &speed / 8;
    found.has(&[(2, x), (4, -&speed / 2)], 37);
    let turns = [("S", "slides", BigInt::ZERO), ("S", "sticks", stops), ("S", "slides", fixed("2.5"))];
    found.turned(&turns, 37);
}

/// A bar that hangs on a cart which sticks to its rail is braked at its lowest point, by a lock or a motor that comes
/// into force.  Dry friction takes no part in that impulse: the momentum of both is kept, and the cart slides to a stop.
#[test]
fn what_sticks_slides_after_an_impulse_of_what_closes() {
    let scene = |part: &str, switched: &str| {
        format!(
            r#"{{"name": "brake", "gravity": [0, -10], "bars": [
                {{"name": "cart", "mass": 1, "centre": [0, 0], "inertia": 0.1}},
                {{"name": "bar", "mass": 1, "centre": [0, -0.5], "inertia": 0.05, "length": 1}}],
            "sliders": [{{"name": "floor", "point": {{"body": "cart", "point": [0, 0]}}, "angle": "locked",
                "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}, "friction": {{"kinetic": 0.9}}}}],
            "hinges": [{{"name": "A", "between": [{{"body": "cart", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}}],
            {part}, "inactive": ["{switched}"], "events": [{{"name": "brake", "when": "bar.phi", "on": ["{switched}"]}}],
            "start": {{"cart": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}}, "bar": {{"phi": -0.3, "omega": 1}}}},
            "until": 9, "every": 9}}"#
        )
    };
    let lock = scene(r#""locks": [{"name": "lock", "body": "bar", "relative_to": "cart"}]"#, "lock");
    let motor = scene(
        r#""motors": [{"name": "motor", "body": "bar", "relative_to": "cart", "law": {"start": 0, "rate": 0}}]"#,
        "motor",
    );
    // w² = 1 + 2 m g l (1 - cos 0.3)/0.3 of the bar about its hinge, and 2 v = 0.5 w of both.
    let turning = one() + over(&(one() - cosine(&fixed("0.3"))), &fixed("0.03"));
    let v = root(&turning) / 4;
    for (text, digits) in [(&lock, 30), (&lock, 60), (&motor, 40)] {
        let found = ran(text, "1", digits);
        let places = digits as u32 - 3;
        found.has(&[(2, square(&v) / 18), (4, BigInt::ZERO)], places);
        found.lost(&square(&v), places);
        let does: Vec<_> = found.turns.iter().map(|turn| turn.does).collect();
        assert_eq!(does, ["sticks", "slides", "sticks"]);
        near(&(number(found.turns[2].t) - number(found.turns[1].t)), &(v.clone() / 9), places);
    }
}

/// What no impulse of it moves goes on to stick.
#[test]
fn what_sticks_does_so_beside_what_closes_elsewhere() {
    let disc = r#""hinges": [{"name": "H", "between": [{"body": "ground", "point": [5, 0]}, {"body": "disc", "point": [0, 0]}]}],
        "bars": [{"name": "disc", "mass": 1, "centre": [0, 0], "inertia": 2, "length": 1}, "#;
    let more = r#", "locks": [{"name": "lock", "body": "disc"}], "inactive": ["lock"],
        "events": [{"name": "brake", "when": "t - 0.5", "on": ["lock"]}]"#;
    let text = block(["0.8", "0.6"], r#"{"kinetic": 0.8, "static": 0.9}"#, ["0", "0", "0", "0"], more);
    let text = text.replacen(r#""bars": [{"#, &format!("{disc}{{"), 1);
    let text = text.replacen(r#""start": {"#, r#""start": {"disc": {"phi": 0, "omega": 1}, "#, 1);
    let found = ran(&text, "1", 30);
    near(&number(found.row.bodies[0][0]), &fixed("0.5"), 27);
    near(&number(found.row.bodies[0][1]), &BigInt::ZERO, 27);
    near(&number(found.row.bodies[1][2]), &BigInt::ZERO, 27);
    found.turned(&[("S", "sticks", BigInt::ZERO)], 27);
}

/// A lock closes, through a weld, beside a hinge with friction that comes to rest with it: there is none then, and
/// steps may be longer than the series of the hinge's force converges.
#[test]
fn what_is_locked_by_others_asks_nothing_of_the_force_in_its_hinge() {
    let text = r#"{"name": "locked", "gravity": [-0.097, -3.988],
        "bars": [{"name": "b0", "mass": 0.747, "centre": [0.115, 0.003], "inertia": 0.00498, "length": 0.315},
            {"name": "b1", "mass": 1.008, "centre": [0.235, 0.008], "inertia": 0.01494, "length": 0.457},
            {"name": "b2", "mass": 0.527, "centre": [0.159, -0.01], "inertia": 0.00802, "length": 0.324}],
        "hinges": [{"name": "h0", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b0", "point": [0, 0]}]},
            {"name": "h1", "between": [{"body": "b1", "point": [0.457, 0]}, {"body": "b2", "point": [0.001, -0.045]}],
                "friction": {"radius": 0.014, "kinetic": 0.269}}],
        "points": [{"name": "p", "body": "b1", "point": [0.457, -0.01]}],
        "welds": [{"name": "weld", "between": [{"body": "b0", "point": [0.315, 0]}, {"body": "b1", "point": [0.07, 0.047]}]}],
        "locks": [{"name": "lock", "body": "b2", "relative_to": "b0"}], "inactive": ["lock"],
        "events": [{"name": "closes", "when": "p.y - 0.253", "direction": "falling", "on": ["lock"]}],
        "start": {"b0": {"phi": -0.162, "omega": -1.187}, "b1": {"phi": 1.204, "omega": -1.187},
            "b2": {"phi": -1.539, "omega": -2.787}}, "until": 0.3, "every": 0.3}"#;
    for digits in [20, 25, 30, 35] {
        ran(text, "0.3", digits);
    }
    compared(text, "0.3").expect("a motion");
}

#[test]
fn a_run_goes_on_to_the_last_bit_while_places_stick_and_slide() {
    let spring = r#", "springs": [{"name": "k", "between": [{"body": "ground", "point": [-1, 0]}, {"body": "block", "point": [0, 0]}],
        "stiffness": 50, "free_length": 1}]"#;
    let text = block(["1", "0"], r#"{"kinetic": 0.2, "static": 0.25}"#, ["1", "0", "0", "0"], spring);
    for (text, until) in [(shipped("stick_slip"), "5"), (shipped("sliding_ball"), "1.8"), (text, "4")] {
        let source = source(&text, &[], until, "0.3");
        assert!(resumed(&source).turns().len() > 1);
    }
}

#[test]
fn a_horizon_beyond_transitions_is_forecast_and_proved() {
    let source = source(&shipped("stick_slip"), &[], "5", "0.5");
    let pair = proved(&source);
    let turns = pair.turns();
    assert!(turns.len() > 2 && turns.iter().all(|(_, digits)| digits.expect("two runs") > 15.0), "{turns:?}");
}

#[test]
fn painleves_paradox_is_named() {
    // A rod whose tip is pushed into it; at rest no force fits, turning fast two motions do.
    let phi = std::f64::consts::PI - 1.1;
    for (omega, words) in [(0.0, "inconsistent"), (8.0, "indeterminate")] {
        let stop = tried(&rod(phi, omega, 1.0, 2.0, 0.2), "0.2", 30).err().expect("no motion");
        assert_eq!(stop.cause.word(), "friction");
        assert!(stop.what.contains(words), "{stop}");
    }
    assert!(tried(&rod(phi, 0.0, -1.0, 2.0, 0.01), "0.01", 30).is_ok());
}
