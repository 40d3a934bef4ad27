//! Impacts that press several walls at once, with dry friction, in many digits: against closed forms in integer
//! arithmetic, runs with other digits and runs in doubles.

use super::common;
use super::friction::Dice;
use super::many_digits::{
    begun, fixed, near, number, one, over, proved, resumed, root, source, square, times,
};
use driftless::arithmetic::Real;
use driftless::run::digits::{LongHold, LongTurn, ShownRow};
use driftless::run::{MethodId, Outcome, Request};
use driftless::scene::parse_scene;
use driftless::stepping::StepError;
use num_bigint::BigInt;

/// An angle or a coordinate, its rate, and so on in a row of a body.
const ANGLE: usize = 0;
const SPIN: usize = 1;
const X: usize = 2;
const Y: usize = 3;
const VX: usize = 4;
const VY: usize = 5;

/// A run, at its end.
struct Ran {
    row: ShownRow,
    /// Kinetic and potential energy at the start [J].
    begins: f64,
    turns: Vec<LongTurn>,
    holds: Vec<LongHold>,
    impacts: u64,
    places: u32,
}

fn tried(text: &str, until: &str, digits: usize) -> Result<Ran, StepError> {
    let mut run = begun(&source(text, &[], until, until), digits);
    let first = run.row(0, &mut || false)?.expect("no pause");
    let row = run.row(run.last_row(), &mut || false)?.expect("no pause");
    let begins = (first.energy[0] + first.energy[1]).value();
    let (turns, holds, impacts) = (run.turns(), run.holds(), run.counts()[1]);
    Ok(Ran { row, begins, turns, holds, impacts, places: digits as u32 - 3 })
}

#[track_caller]
fn ran(text: &str, until: &str, digits: usize) -> Ran {
    let ran = tried(text, until, digits).unwrap_or_else(|stop| panic!("{stop}\n{text}"));
    let allowed = 10.0_f64.powi(4 - digits as i32);
    assert!(ran.row.drift.abs() < allowed, "{:e}", ran.row.drift);
    ran
}

impl Ran {
    /// What is at these places of a body.
    #[track_caller]
    fn has(&self, body: usize, expected: &[(usize, BigInt)]) {
        for (what, value) in expected {
            near(&number(self.row.bodies[body][*what]), value, self.places);
        }
    }

    /// Work [J], of which friction took this.
    #[track_caller]
    fn worked(&self, work: &BigInt, friction: &BigInt) {
        near(&number(self.row.energy[2]), work, self.places);
        near(&number(self.row.friction.expect("friction")), friction, self.places);
    }

    #[track_caller]
    fn turned(&self, expected: &[(&str, &str, BigInt)]) {
        let told: Vec<_> = self.turns.iter().map(|turn| (&turn.name[..], turn.does)).collect();
        let known: Vec<_> = expected.iter().map(|(name, does, _)| (*name, *does)).collect();
        assert_eq!(told, known);
        for (turn, (_, _, t)) in self.turns.iter().zip(expected) {
            near(&number(turn.t), t, self.places);
        }
    }
}

/// A body of 2 kg slides over a rough floor under a roof of 4 in 3, which presses it on the floor: with n of the roof
/// the floor gives 0.6 n and 0.6 mu n.
#[test]
fn a_sliding_body_jams_under_a_roof() {
    let [mu, g, sin, cos] = ["0.3", "9.81", "0.6", "0.8"].map(fixed);
    let slows = times(&mu, &g);
    let u = root(&(square(&fixed("2.2")) - &slows));
    let met = over(&(fixed("2.2") - &u), &slows);
    let rough = times(&mu, &sin);
    for (e, law, digits) in [
        ("0", "poisson", 30),
        ("0.5", "poisson", 60),
        ("0.8", "poisson", 30),
        ("0", "newton", 30),
        ("0.5", "newton", 60),
    ] {
        let text = format!(
            r#"{{"name": "wedge", "gravity": [0, -9.81], "bars": [{{"name": "b", "mass": 2, "centre": [0, 0], "inertia": 0.1}}],
            "walls": [{{"name": "floor", "body": "b", "point": [0, 0], "line": {{"through": [0, 0], "normal": [0, 1]}},
                    "restitution": 0.4, "friction": {{"kinetic": 0.3, "impact": "{law}"}}}},
                {{"name": "roof", "body": "b", "point": [0, 0], "line": {{"through": [0, 0], "normal": [-4, -3]}}, "restitution": {e}}}],
            "start": {{"b": {{"phi": 0, "omega": 0, "origin": [-0.5, 0], "velocity": [2.2, 0]}}}}, "until": 9, "every": 9}}"#
        );
        // Poisson: of compression a part expands, against friction.  Newton: the velocity comes back.
        let back = match law {
            "poisson" => times(&over(&times(&fixed(e), &u), &(&cos + &rough)), &(&cos - &rough)),
            _ => times(&fixed(e), &u),
        };
        let (stops, way) = (&met + over(&back, &slows), over(&square(&back), &slows) / 2);
        let found = ran(&text, "1", digits);
        found.has(
            0,
            &[(X, -&way), (Y, BigInt::ZERO), (VX, BigInt::ZERO), (VY, BigInt::ZERO), (SPIN, BigInt::ZERO)],
        );
        let lost = times(&slows, &(fixed("0.5") + &way)) * 2;
        found.worked(&-&lost, &lost);
        found.turned(&[("floor", "slides", BigInt::ZERO), ("floor", "sticks", stops)]);
        assert_eq!(found.impacts, 2, "both walls");
        let held: Vec<_> = found.holds.iter().map(|hold| (&hold.wall[..], hold.until.is_some())).collect();
        assert_eq!(held, [("floor", false)]);
    }
}

/// A ball of 2 kg falls 0.35 m, from 3 m/s to 4 m/s, onto a block of 3 kg that rests on a floor: the floor gives the
/// impulse that the ball gets, 12 N s, and 3.6 N s of friction between both is less or more than it holds.
fn ball_on_block(u: &str, upper: &str, lower: &str) -> String {
    format!(
        r#"{{"name": "pile", "gravity": [0, -10], "bars": [{{"name": "block", "mass": 3, "centre": [0, 0], "inertia": 0.1}},
            {{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 0.1}}],
        "walls": [{{"name": "floor", "body": "block", "point": [0, 0], "line": {{"through": [0, 0], "normal": [0, 1]}},
                "restitution": 0.7, "friction": {{"kinetic": {lower}}}}},
            {{"name": "top", "body": "ball", "point": [0, 0], "line": {{"body": "block", "through": [0, 0], "normal": [0, 1]}},
                "restitution": 0.5, "friction": {{"kinetic": {upper}}}}}],
        "start": {{"block": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}},
            "ball": {{"phi": 0, "omega": 0, "origin": [-{u}e-1, 0.35], "velocity": [{u}, -3]}}}}, "until": 9, "every": 9}}"#
    )
}

#[test]
fn a_ball_that_falls_on_a_block_presses_it_on_its_floor() {
    for digits in [30, 60] {
        let rises = [(Y, fixed("0.15")), (VY, fixed("-1")), (SPIN, BigInt::ZERO)];
        // The block stays.
        let found = ran(&ball_on_block("5", "0.3", "0.5"), "0.4", digits);
        found.has(0, &[(X, BigInt::ZERO), (VX, BigInt::ZERO), (Y, BigInt::ZERO), (ANGLE, BigInt::ZERO)]);
        found.has(1, &[(X, fixed("0.96")), (VX, fixed("3.2"))]);
        found.has(1, &rises);
        found.worked(&BigInt::ZERO, &BigInt::ZERO);
        found.turned(&[("floor", "sticks", BigInt::ZERO)]);
        assert_eq!((found.impacts, found.holds.len()), (2, 1));
        // The floor holds 1.2 N s of it: 0.8 m/s, from which it slides for 0.3 s.
        let found = ran(&ball_on_block("5", "0.3", "0.1"), "0.4", digits);
        found.has(0, &[(X, fixed("0.195")), (VX, fixed("0.5")), (Y, BigInt::ZERO), (ANGLE, BigInt::ZERO)]);
        found.has(1, &[(X, fixed("0.96")), (VX, fixed("3.2"))]);
        found.has(1, &rises);
        found.worked(&fixed("-0.585"), &fixed("0.585"));
        found.turned(&[("floor", "sticks", BigInt::ZERO), ("floor", "slides", fixed("0.1"))]);
        // Both hold: the ball goes straight up.
        let found = ran(&ball_on_block("5", "2", "3"), "0.4", digits);
        found.has(0, &[(X, BigInt::ZERO), (VX, BigInt::ZERO)]);
        found.has(1, &[(X, BigInt::ZERO), (VX, BigInt::ZERO)]);
        found.has(1, &rises);
    }
}

/// Of a box: mass, height of its centre, inertia, and how far it falls.
const BOX: [&str; 4] = ["1.5", "0.2", "0.3", "0.4"];

/// A box that lands flat with this velocity along a floor, with corners at these places beside its centre, their
/// restitution and friction.
fn landed(u: &str, corners: [(&str, &str, &str); 2], law: &str, until: &str, digits: usize) -> Ran {
    let [mass, height, inertia, _] = BOX;
    let wall = |(name, (x, e, mu)): (&str, (&str, &str, &str))| {
        format!(
            r#"{{"name": "{name}", "body": "box", "point": [{x}, -{height}], "line": {{"through": [0, 0], "normal": [0, 1]}},
            "restitution": {e}, "friction": {{"kinetic": {mu}, "impact": "{law}"}}}}"#
        )
    };
    let walls: Vec<String> = ["left", "right"].into_iter().zip(corners).map(wall).collect();
    let text = format!(
        r#"{{"name": "box", "gravity": [0, -9.81], "bars": [{{"name": "box", "mass": {mass}, "centre": [0, 0], "inertia": {inertia}}}],
        "walls": [{}], "start": {{"box": {{"phi": 0, "omega": 0, "origin": [0, 0.6], "velocity": [{u}, 0]}}}},
        "until": 9, "every": 9}}"#,
        walls.join(", ")
    );
    ran(&text, until, digits)
}

/// Time of the fall and the velocity at its end.
fn fall() -> [BigInt; 2] {
    let g = fixed("9.81");
    let time = root(&over(&(fixed(BOX[3]) * 2), &g));
    [time.clone(), times(&g, &time)]
}

/// It leaves the floor at these velocities along it and upwards, and with this spin.
#[track_caller]
fn leaves(found: &Ran, u: &str, [along, up, spin]: [&BigInt; 3], until: &str) {
    let [time, _] = fall();
    let after = fixed(until) - &time;
    let fallen = times(&fixed("9.81"), &after);
    found.has(
        0,
        &[(ANGLE, times(spin, &after)), (SPIN, spin.clone()), (VX, along.clone()), (VY, up - &fallen)],
    );
    let y = fixed(BOX[1]) + times(up, &after) - times(&fallen, &after) / 2;
    found.has(0, &[(X, times(&fixed(u), &time) + times(along, &after)), (Y, y)]);
    found.worked(&BigInt::ZERO, &BigInt::ZERO);
}

/// Pressed so that it does not turn: n (x - mu h) of both corners are opposite, and n of both m v.
#[test]
fn a_box_that_lands_flat_and_slides_does_not_turn() {
    let [_, v] = fall();
    for (law, digits) in [("poisson", 60), ("newton", 30)] {
        for ([a, b], e, [mu, other]) in
            [(["0.4", "0.4"], "0.8", ["1.2", "1.2"]), (["0.5", "0.3"], "0.5", ["0.4", "0.2"])]
        {
            let corners = [(&format!("-{a}")[..], e, mu), (b, e, other)];
            let found = landed("20", corners, law, "0.33", digits);
            let levers = [-fixed(a), fixed(b)]
                .into_iter()
                .zip([mu, other])
                .map(|(x, mu)| x - times(&fixed(mu), &fixed(BOX[1])))
                .collect::<Vec<_>>();
            let width = &levers[1] - &levers[0];
            // Shares of the impulse.
            let [left, right] = [over(&levers[1], &width), over(&-&levers[0], &width)];
            let rough = times(&fixed(mu), &left) + times(&fixed(other), &right);
            let along = fixed("20") - times(&times(&(one() + fixed(e)), &v), &rough);
            leaves(&found, "20", [&along, &times(&fixed(e), &v), &BigInt::ZERO], "0.33");
            assert_eq!(found.impacts, 2);
        }
    }
}

/// Friction at the front corner tips it: the other one gets nothing.
#[test]
fn a_box_that_lands_flat_and_tips_turns_about_its_front_corner() {
    let [_, v] = fall();
    let [mass, height, inertia, _] = BOX.map(fixed);
    let (mu, e, x) = (fixed("2.6"), fixed("0.5"), fixed("0.4"));
    let lever = &x - times(&mu, &height);
    let response = over(&one(), &mass) + over(&times(&x, &lever), &inertia);
    let normal = over(&times(&(one() + &e), &v), &response);
    let spin = over(&times(&normal, &lever), &inertia);
    let [along, up] = [fixed("30") - over(&times(&mu, &normal), &mass), over(&normal, &mass) - &v];
    for digits in [30, 60] {
        let corners = [("-0.4", "0.5", "2.6"), ("0.4", "0.5", "2.6")];
        let found = landed("30", corners, "poisson", "0.33", digits);
        leaves(&found, "30", [&along, &up, &spin], "0.33");
        assert_eq!(found.impacts, 1);
    }
}

/// Both corners stop in the compression, and share what holds them in any way: the box turns about a point of the
/// floor's height, with what the unequal compression gives back.
#[test]
fn a_box_that_lands_flat_and_sticks_rebounds_with_a_spin() {
    let [_, v] = fall();
    let [mass, height, inertia, _] = BOX.map(fixed);
    let moment = &inertia + times(&mass, &square(&height));
    let given = times(&times(&fixed("0.6"), &height), &times(&mass, &fixed("0.5")));
    let spin = over(&given, &moment);
    for digits in [30, 60] {
        let corners = [("-0.4", "0.6", "0.9"), ("0.4", "0.6", "0.9")];
        let found = landed("0.5", corners, "poisson", "0.33", digits);
        leaves(&found, "0.5", [&-times(&height, &spin), &times(&fixed("0.6"), &v), &spin], "0.33");
    }
}

/// Without restitution it stays on the floor, and slides to a stop at both corners.
#[test]
fn a_box_that_lands_flat_and_stays_slides_to_a_stop() {
    let [time, v] = fall();
    let slows = times(&fixed("0.4"), &fixed("9.81"));
    let slides = fixed("3") - times(&fixed("0.4"), &v);
    let stops = &time + over(&slides, &slows);
    let x: BigInt = times(&fixed("3"), &time) + over(&square(&slides), &slows) / 2;
    let lost = times(&fixed(BOX[0]), &square(&slides)) / 2;
    for digits in [30, 60] {
        let found = landed("3", [("-0.4", "0", "0.4"), ("0.4", "0", "0.4")], "poisson", "1.3", digits);
        found.has(0, &[(X, x.clone()), (Y, fixed(BOX[1])), (ANGLE, BigInt::ZERO), (VX, BigInt::ZERO)]);
        found.worked(&-&lost, &lost);
        let both = |does, t: &BigInt| [("left", does, t.clone()), ("right", does, t.clone())];
        found.turned(&[both("slides", &time), both("sticks", &stops)].concat());
        assert_eq!((found.impacts, found.holds.len()), (2, 2));
        found.holds.iter().for_each(|hold| near(&number(hold.t), &time, found.places));
    }
}

/// Out of a corner of two equal walls it comes the way it went in, slower.
#[test]
fn a_ball_in_a_rough_corner_rebounds_the_way_it_came() {
    let [time, v] = fall();
    for ([x, y], mu, digits) in [(["3", "4"], "0.3", 60), (["5", "12"], "0.5", 30)] {
        let wall = |name: &str, sign: &str| {
            format!(
                r#"{{"name": "{name}", "body": "ball", "point": [0, 0], "line": {{"through": [0, 0], "normal": [{sign}{x}, {y}]}},
                "restitution": 0.6, "friction": {{"kinetic": {mu}}}}}"#
            )
        };
        let text = format!(
            r#"{{"name": "corner", "gravity": [0, -9.81], "bars": [{{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 0.1}}],
            "walls": [{}, {}], "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [0, 0.4], "velocity": [0, 0]}}}}, "until": 9, "every": 9}}"#,
            wall("left", ""),
            wall("right", "-")
        );
        let [aside, down] = [times(&fixed(mu), &fixed(x)), fixed(y)];
        let up = over(&times(&times(&fixed("0.6"), &v), &(&down - &aside)), &(&down + &aside));
        let after = fixed("0.33") - &time;
        let found = ran(&text, "0.33", digits);
        let y = times(&up, &after) - times(&fixed("9.81"), &square(&after)) / 2;
        found.has(0, &[(X, BigInt::ZERO), (VX, BigInt::ZERO), (Y, y), (SPIN, BigInt::ZERO)]);
        assert_eq!(found.impacts, 2);
    }
}

/// A ball of 2 kg in the corner of a carriage that a motor moves at 0.5 m/s into it, without weight.  Compression:
/// n + mu s = 3 N s at the back and s + mu' n = 4 N s at the bottom; of it parts expand, against friction.
#[test]
fn a_motor_works_where_a_ball_meets_a_corner_of_its_carriage() {
    let text = |walls: &str| {
        format!(
            r#"{{"name": "carriage", "gravity": [0, 0], "bars": [{{"name": "carriage", "mass": 3, "centre": [0, 0], "inertia": 0.1}},
                {{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 0.1}}],
            "sliders": [{{"name": "guide", "point": {{"body": "carriage", "point": [0, 0]}}, "angle": "locked",
                "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}}}],
            "motors": [{{"name": "drive", "slider": "guide", "law": {{"start": 0, "rate": 0.5}}}}], "walls": [{walls}],
            "start": {{"carriage": {{"phi": 0, "omega": 0}}, "ball": {{"phi": 0, "omega": 0, "origin": [0.375, 0.5], "velocity": [-1, -2]}}}},
            "until": 9, "every": 9}}"#
        )
    };
    let wall = |name: &str, normal: &str, e: &str, friction: &str| {
        format!(
            r#"{{"name": "{name}", "body": "ball", "point": [0, 0], "line": {{"body": "carriage", "through": [0, 0], "normal": {normal}}},
            "restitution": {e}{friction}}}"#
        )
    };
    let (back, bottom) = (
        wall("back", "[1, 0]", "0.6", r#", "friction": {"kinetic": 0.25}"#),
        wall("bottom", "[0, 1]", "0.5", r#", "friction": {"kinetic": 0.4}"#),
    );
    let [mu, other] = ["0.4", "0.25"].map(fixed);
    let n = over(&(fixed("3") - times(&mu, &fixed("4"))), &(one() - times(&mu, &other)));
    let s = fixed("4") - times(&other, &n);
    let [n, s] = [times(&n, &fixed("0.6")), s / 2];
    let [along, up] = [(&n - times(&mu, &s)) / 2, (&s - times(&other, &n)) / 2];
    for digits in [30, 60] {
        let found = ran(&text(&format!("{back}, {bottom}")), "1", digits);
        let (x, vx) = (fixed("0.5") + times(&along, &fixed("0.75")), fixed("0.5") + &along);
        found.has(1, &[(X, x), (VX, vx.clone()), (Y, times(&up, &fixed("0.75"))), (VY, up.clone())]);
        // The motor gives what the ball gets along the rail.
        found.worked(&(vx + one()), &BigInt::ZERO);
        assert_eq!(found.impacts, 2);
        // At one wall, with friction and without: 1.6 times 3 N s.
        for friction in ["", r#", "friction": {"kinetic": 0.25}"#] {
            let found = ran(&text(&wall("back", "[1, 0]", "0.6", friction)), "0.5", digits);
            near(&number(found.row.energy[2]), &fixed("2.4"), found.places);
        }
    }
}

fn in_doubles(text: &str, until: &str) -> Outcome {
    let (until, method) = (until.parse().ok(), Some(MethodId::Taylor));
    let request = Request { until, every: until, rtol: Some(1e-13), method, ..Request::default() };
    common::run(&parse_scene(text, "test", &[]).expect("a scene"), &request)
}

/// Moments at which several walls take part in an impact in doubles, one of them with friction.
fn together(plain: &Outcome) -> usize {
    let hits = plain.impacts.chunk_by(|a, b| a.t == b.t);
    hits.filter(|hits| hits.len() > 1 && hits.iter().any(|hit| hit.friction_impulse != 0.0)).count()
}

/// A scene in few digits and in more, which agree with each other and with doubles.
fn compared(text: &str, until: &str, plain: &Outcome) -> Ran {
    let [few, many] = [30, 45].map(|digits| ran(text, until, digits));
    for (few, many) in few.row.bodies.iter().zip(&many.row.bodies) {
        few.iter().zip(many).for_each(|(&few, &many)| near(&number(few), &number(many), 22));
    }
    assert_eq!(few.turns.len(), many.turns.len(), "{text}");
    // Bounces end in doubles where they are too low to be told.
    let has_ended = plain.holds.iter().any(|hold| hold.t > 0.0);
    let (last, allowed) = (&plain.last, if has_ended { 1e-5 } else { 1e-8 });
    for (k, body) in many.row.bodies.iter().enumerate() {
        let expected = [last.phi[k], last.omega[k], last.centre[k][0], last.centre[k][1]];
        for (found, expected) in body.iter().zip(expected) {
            assert!((found.value() - expected).abs() < allowed, "{} {expected}\n{text}", found.value());
        }
    }
    // Books: work, friction, and what impacts took.
    let [kinetic, potential, work] = many.row.energy.map(Real::value);
    let lost = many.begins + work - kinetic - potential;
    let friction = many.row.friction.expect("friction").value();
    for (found, expected) in [(work, last.work), (friction, last.friction), (lost, plain.impact_loss)] {
        assert!((found - expected).abs() < allowed, "{found} {expected}\n{text}");
    }
    many
}

/// A box on two corners with an arm hinged on it, and a wheel on the box geared to the arm in some: it falls flat, or
/// slides over the floor until its arm strikes a wall.
fn any_machine(seed: u64) -> String {
    let mut dice = Dice(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) + 5);
    let (falls, has_wheel) = (seed.is_multiple_of(2), dice.is(0.4));
    let rough = |dice: &mut Dice, share: f64, more: &str| match dice.is(share) {
        true => {
            let kinetic = dice.within(0.05, 0.8);
            let stiction = kinetic * if dice.is(0.5) { 1.0 } else { dice.within(1.0, 1.5) };
            format!(r#", "friction": {{"kinetic": {kinetic:.3}, "static": {stiction:.3}{more}}}"#)
        }
        false => String::new(),
    };
    let e = |dice: &mut Dice| if dice.is(0.3) { 0.0 } else { dice.within(0.1, 0.9) };
    let law = if dice.is(0.3) { r#", "impact": "newton""# } else { "" };
    let (height, arm, phi) = (dice.within(0.1, 0.4), dice.within(0.4, 0.8), dice.within(-0.7, 0.7));
    let corner = |dice: &mut Dice, name: &str, x: f64, share: f64| {
        let (e, friction) = (e(dice), rough(dice, share, law));
        format!(
            r#"{{"name": "{name}", "body": "box", "point": [{x:.3}, {:.3}], "line": {{"through": [0, 0], "normal": [0, 1]}},
            "restitution": {e:.2}{friction}}}"#,
            -height
        )
    };
    let mut walls = vec![
        {
            let x = dice.within(-0.6, -0.3);
            corner(&mut dice, "left", x, 1.0)
        },
        {
            let x = dice.within(0.3, 0.6);
            corner(&mut dice, "right", x, 0.6)
        },
    ];
    let (e, friction) = (e(&mut dice), rough(&mut dice, 0.5, law));
    walls.push(format!(
        r#"{{"name": "side", "body": "arm", "point": [{arm:.3}, 0], "line": {{"through": [{:.3}, 0], "normal": [-1, 0.1]}},
        "restitution": {e:.2}{friction}}}"#,
        arm + dice.within(0.1, 0.3)
    ));
    let wheel = match has_wheel {
        true => [
            r#", {"name": "wheel", "mass": 0.3, "centre": [0, 0], "inertia": 0.01}"#,
            r#", {"name": "W", "between": [{"body": "box", "point": [-0.1, 0.1]}, {"body": "wheel", "point": [0, 0]}]}"#,
            r#""motors": [{"name": "gear", "body": "wheel", "law": "2*arm.phi - box.phi"}], "#,
        ],
        false => [""; 3],
    };
    let hinge = match dice.is(0.6) {
        true => format!(
            r#", "friction": {{"radius": {:.3}, "kinetic": {:.2}}}"#,
            dice.within(0.01, 0.05),
            dice.within(0.1, 0.4)
        ),
        false => String::new(),
    };
    let (drop, slide) = (if falls { dice.within(0.05, 0.3) } else { 0.0 }, dice.within(1.0, 4.0));
    format!(
        r#"{{"name": "machine", "gravity": [0, -9.81], "bars": [
            {{"name": "box", "mass": {:.2}, "centre": [{:.2}, {:.2}], "inertia": {:.2}}},
            {{"name": "arm", "mass": {:.2}, "centre": [{:.2}, 0], "inertia": {:.3}, "length": {arm:.3}}}{}],
        "hinges": [{{"name": "A", "between": [{{"body": "box", "point": [0, 0.1]}}, {{"body": "arm", "point": [0, 0]}}]{hinge}}}{}],
        {}"torsion_springs": [{{"name": "k", "body": "arm", "relative_to": "box", "stiffness": {:.1}, "free_angle": {phi:.2}}}],
        "springs": [{{"name": "s", "between": [{{"body": "arm", "point": [0.1, 0]}}, {{"body": "box", "point": [0, 0.3]}}],
            "stiffness": {:.1}, "free_length": {:.2}}}],
        "walls": [{}], "start": {{"box": {{"phi": 0, "omega": 0, "origin": [0, {:.3}], "velocity": [{slide:.2}, 0]}},
            "arm": {{"phi": {phi:.2}, "omega": 0}}}}, "until": 9, "every": 9}}"#,
        dice.within(1.0, 3.0),
        dice.within(-0.1, 0.1),
        dice.within(-0.05, 0.1),
        dice.within(0.05, 0.3),
        dice.within(0.2, 1.0),
        dice.within(0.1, 0.3),
        dice.within(0.01, 0.05),
        wheel[0],
        wheel[1],
        wheel[2],
        dice.within(0.0, 30.0),
        if falls { 0.0 } else { dice.within(0.0, 20.0) },
        dice.within(0.05, 0.3),
        walls.join(", "),
        height + drop,
    )
}

/// Boxes that land or slide with an arm on them, springs, gears, and friction in hinges: as many of both, without those
/// whose bounces take long to die out.
#[test]
fn random_machines_agree_with_other_digits_and_with_doubles() {
    let count: usize = std::env::var("FRICTION").ok().and_then(|count| count.parse().ok()).unwrap_or(3);
    let [mut held, mut several, mut turns, mut geared, mut rough] = [0_usize; 5];
    let mut left = [count; 2];
    for seed in 0..20 * count as u64 {
        let text = any_machine(seed);
        let (plain, left) = (in_doubles(&text, "0.3"), &mut left[seed as usize % 2]);
        let together = together(&plain);
        if *left == 0 || plain.stop.is_some() || together == 0 || plain.impact_count > 12 {
            continue;
        }
        *left -= 1;
        println!("{seed}: {} impacts, {together} of them at several walls", plain.impact_count);
        let found = compared(&text, "0.3", &plain);
        (held, several, turns) = (held + 1, several + together, turns + found.turns.len());
        geared += usize::from(text.contains("gear"));
        rough += usize::from(text.contains("radius"));
    }
    println!("{held} compared, {several} impacts at several walls with friction, {turns} transitions");
    println!("{geared} with gears, {rough} with friction in the hinge");
    assert!(left == [0; 2] && geared > 0 && rough > 0 && turns > held, "{left:?}");
}

#[test]
fn a_run_goes_on_to_the_last_bit_through_such_impacts() {
    for text in [ball_on_block("5", "0.3", "0.1"), any_machine(2)] {
        let whole = resumed(&source(&text, &[], "0.3", "0.06"));
        assert!(whole.counts()[1] > 1);
    }
}

#[test]
fn a_horizon_beyond_such_impacts_is_forecast_and_proved() {
    let pair = proved(&source(&ball_on_block("5", "0.3", "0.1"), &[], "0.4", "0.1"));
    assert!(pair.turns().iter().all(|(_, digits)| digits.expect("two runs") > 15.0));
}
