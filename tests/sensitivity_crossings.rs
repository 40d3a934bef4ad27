//! Sensitivities through dry friction, points that rest, numbers that events set, moving walls and several walls
//! at once, against closed forms and against differences of references.

use crate::friction_impacts::cart_below_a_block;
use crate::mechanisms::Dice;
use crate::sensitivity::{assert_near, compared, derived, example, template};
use crate::switched::{scene, scene_of_numbers};
use std::collections::BTreeMap;

/// Derivatives of one output by numbers of a scene, against closed forms.
fn assert_slopes(text: &str, of: &str, at: f64, expected: &[(&str, f64)]) {
    let to: Vec<&str> = expected.iter().map(|(path, _)| *path).collect();
    let found = derived(&template(text), &[of], &to, at);
    assert_eq!(found.lost, None);
    for (slope, (path, expected)) in found.measures[0].slopes.iter().zip(expected) {
        assert_near(*slope, *expected, 1e-9, path);
    }
}

const BLOCK: &str = r#""bars": [{"name": "block", "mass": 2, "centre": [0, 0], "inertia": 1, "length": 1}],
    "sliders": [{"name": "rail", "point": {"body": "block", "point": [0, 0]}, "friction": {"kinetic": 0.2, "static": 0.35},
                 "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "angle": "locked"}]"#;

/// A block of speed v comes v²/(2 mu g) far.
#[test]
fn a_block_that_stops_is_derived_by_its_friction() {
    let scene = format!(
        r#"{{"name": "block", "gravity": [0, -10], "until": 1, "every": 0.1, {BLOCK},
        "start": {{"block": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [1.2, 0]}}}}}}"#
    );
    let (v, mu, g) = (1.2, 0.2, 10.0);
    assert_slopes(
        &scene,
        "block.x",
        1.0,
        &[
            ("start.block.velocity[0]", v / (mu * g)),
            ("sliders.rail.friction.kinetic", -v * v / (2.0 * mu * mu * g)),
            ("gravity[1]", v * v / (2.0 * mu * g * g)),
            ("bars.block.mass", 0.0),
        ],
    );
}

/// Without a load a joint with dry friction turns freely: the angle at T moves by T for each rad/s at the start,
/// whatever its friction is.
#[test]
fn what_rests_without_a_load_is_derived_by_its_start_rate() {
    let scene = |with: &str| {
        format!(
            r#"{{"name": "flywheel", "gravity": [0, 0], "until": 2, "every": 2,
            "bars": [{{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.25, "length": 1}},
                {{"name": "d", "mass": 1.5, "centre": [0.3, 0], "inertia": 0.1, "length": 1}}],
            "hinges": [
                {{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}],
                  "friction": {{"radius": 0.03, "kinetic": 0.2, "static": 0.5}}}},
                {{"name": "D", "between": [{{"body": "ground", "point": [2, 0]}}, {{"body": "d", "point": [0, 0]}}]}}],
            "start": {{"b": {{"phi": 0.5, "omega": 0}}, "d": {{"phi": -2, "omega": -2.25}}}}{with}}}"#
        )
    };
    let numbers: [(&str, f64); 3] =
        [("start.b.omega", 2.0), ("start.b.phi", 1.0), ("hinges.A.friction.kinetic", 0.0)];
    assert_slopes(&scene(""), "b.phi", 2.0, &numbers);
    // A load that comes later holds the neighbours where they have come to.
    let push =
        r#", "forces": [{"name": "push", "body": "b", "point": [0, 0], "force": ["if(t < 1, 0, 3)", 0]}]"#;
    let held = derived(&template(&scene(push)), &["b.phi"], &["start.b.omega"], 2.0);
    let lost = held.lost.expect("it is loaded");
    assert!(lost.contains("A sticks") && lost.contains("until it has a load"), "{lost}");
    assert!(held.measures[0].slopes.is_empty());
}

/// A start of v slides by |v| v/(2 mu g), which has no slope at 0; beside a force that moves it from rest one of
/// -v loses (F - mu m g)/(F + mu m g) of what one of v gains.
#[test]
fn what_slides_off_from_rest_has_no_derivative_by_its_start_rate() {
    let scene = |force: f64| {
        format!(
            r#"{{"name": "block", "gravity": [0, -10], "until": 1, "every": 1, {BLOCK},
            "forces": [{{"name": "pull", "body": "block", "point": [0, 0], "force": [{force}, 0]}}],
            "start": {{"block": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}}}}}}"#
        )
    };
    assert_slopes(&scene(0.0), "block.x", 1.0, &[("start.block.velocity[0]", 0.0)]);
    let found = derived(&template(&scene(10.0)), &["block.x"], &["start.block.velocity[0]"], 1.0);
    let why = found.measures[0].why.clone().expect("there is none");
    assert!(
        why.contains("no derivative by start.block.velocity[0]: rail is at rest under dry friction"),
        "{why}"
    );
    for force in [0.0, 10.0] {
        let others = ["bars.block.mass", "start.block.origin[0]", "sliders.rail.friction.kinetic"];
        assert_eq!(derived(&template(&scene(force)), &["block.x"], &others, 1.0).lost, None);
    }
}

/// A block of 2 kg that sticks to a cart of 3 kg which rolls freely: friction stops it there whatever its sense,
/// and both share its momentum.
#[test]
fn what_sticks_stops_neighbouring_starts() {
    let slider = |name: &str, body: &str, on: &str, friction: &str| {
        format!(
            r#"{{"name": "{name}", "point": {{"body": "{body}", "point": [0, 0]}}, "angle": "locked"{friction},
            "rail": {{"body": "{on}", "point": [0, 0], "direction": [1, 0]}}}}"#
        )
    };
    for force in [0.0, 1.5] {
        let scene = format!(
            r#"{{"name": "cart", "gravity": [0, -10], "until": 2, "every": 2,
            "bars": [{{"name": "cart", "mass": 3, "centre": [0, 0], "inertia": 1, "length": 1}},
                {{"name": "block", "mass": 2, "centre": [0, 0], "inertia": 1, "length": 1}}],
            "sliders": [{}, {}],
            "forces": [{{"name": "pull", "body": "block", "point": [0, 0], "force": [{force}, 0]}}],
            "start": {{"cart": {{"phi": 0, "origin": [0, 0], "velocity": [0.5, 0]}},
                "block": {{"phi": 0, "origin": [0, 0], "velocity": [0.5, 0]}}}}}}"#,
            slider("rail", "cart", "ground", ""),
            slider("bed", "block", "cart", r#", "friction": {"kinetic": 0.2, "static": 0.3}"#),
        );
        for body in ["cart", "block"] {
            let numbers =
                [("start.block.velocity[0]", 2.0 * 2.0 / 5.0), ("start.cart.velocity[0]", 2.0 * 3.0 / 5.0)];
            assert_slopes(&scene, &format!("{body}.x"), 2.0, &numbers);
        }
    }
}

/// A force c t moves a block at rest from t1 = mu0 m g/c on: x = (mu0 - mu) g s²/2 + c s³/(6 m), s = t - t1.
#[test]
fn a_block_that_breaks_away_is_derived_by_both_coefficients() {
    let scene = format!(
        r#"{{"name": "block", "gravity": [0, -10], "until": 2, "every": 0.1, {BLOCK},
        "parameters": {{"c": 8}},
        "forces": [{{"name": "pull", "body": "block", "point": [0, 0], "force": ["c*t", 0]}}],
        "start": {{"block": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}}}}}}"#
    );
    let (m, c, g, mu, most) = (2.0_f64, 8.0, 10.0, 0.2, 0.35);
    let t = 1.7;
    let s: f64 = t - most * m * g / c;
    let speed = (most - mu) * g * s + c * s * s / (2.0 * m);
    let x = (most - mu) * g * s * s / 2.0 + c * s.powi(3) / (6.0 * m);
    assert!((derived(&template(&scene), &["block.x"], &["c"], t).measures[0].value - x).abs() < 1e-10);
    assert_slopes(
        &scene,
        "block.x",
        t,
        &[
            ("sliders.rail.friction.static", g * s * s / 2.0 - speed * m * g / c),
            ("sliders.rail.friction.kinetic", -g * s * s / 2.0),
            ("c", s.powi(3) / (6.0 * m) + speed * most * m * g / (c * c)),
            ("bars.block.mass", -c * s.powi(3) / (6.0 * m * m) - speed * most * g / c),
        ],
    );
}

/// A ball that falls by h onto a table which comes up at u: h - g t1²/2 = u t1, and goes on at u + e (u + g t1).
#[test]
fn a_ball_is_derived_through_its_impact_at_a_moving_wall() {
    let scene = r#"{"name": "ball", "gravity": [0, -10], "parameters": {"u": 0.6},
        "bars": [{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 0.2}],
        "walls": [{"name": "table", "body": "ball", "point": [0, 0], "line": {"through": [0, 0], "normal": [0, 1]},
                   "restitution": 0.7, "law": "u*t"}],
        "start": {"ball": {"phi": 0, "omega": 0, "origin": [0, 1.3], "velocity": [0, 0]}}, "until": 1, "every": 0.1}"#;
    let (g, h, e, u, t) = (10.0_f64, 1.3_f64, 0.7, 0.6_f64, 0.8);
    let root = (u * u + 2.0 * g * h).sqrt();
    let met = (root - u) / g;
    let after = u + e * (u + g * met);
    let s = t - met;
    // y = u t1 + v⁺ s - g s²/2, v⁺ = u + e (u + g t1) = u + e root, s = t - t1.
    let by = |met_by: f64, root_by: f64, direct: f64| {
        u * met_by + e * root_by * s - (after - g * s) * met_by + direct
    };
    assert_slopes(
        scene,
        "ball.y",
        t,
        &[
            ("start.ball.origin[1]", by(1.0 / root, g / root, 0.0)),
            ("u", by((u / root - 1.0) / g, u / root, met + s)),
            ("table.restitution", root * s),
        ],
    );
}

/// A ball without restitution stays on a table that rises as c t²/2, and moves with it whatever it came with.
#[test]
fn a_ball_that_rests_is_derived_by_the_law_of_its_table() {
    let scene = r#"{"name": "ball", "gravity": [0, -10], "parameters": {"c": 0.6},
        "bars": [{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 0.2}],
        "walls": [{"name": "table", "body": "ball", "point": [0, 0], "line": {"through": [0, 0], "normal": [0, 1]},
                   "restitution": 0, "law": "c*t^2/2"}],
        "start": {"ball": {"phi": 0, "omega": 0, "origin": [0, 0.4], "velocity": [0, 0]}}, "until": 1, "every": 0.1}"#;
    let t = 0.9;
    assert_slopes(scene, "ball.y", t, &[("start.ball.origin[1]", 0.0), ("c", t * t / 2.0)]);
    assert_slopes(scene, "ball.vy", t, &[("start.ball.origin[1]", 0.0), ("c", t), ("gravity[1]", 0.0)]);
}

/// A rotor is pushed from the angle a on, by a torque that grows from the moment it comes there: phi = a + w s +
/// c s³/(6 I), s = t - t1, t1 = (a - phi0)/w.
#[test]
fn a_rotor_is_derived_through_the_moment_that_an_event_sets() {
    let scene = r#"{"name": "timed", "gravity": [0, 0], "until": 2, "every": 0.5,
        "bars": [{"name": "rotor", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "rotor", "point": [0, 0]}]}],
        "parameters": {"on": 0, "from": 0, "a": 0.9, "c": 1.2},
        "torques": [{"name": "push", "body": "rotor", "torque": "c*on*(t - from)"}],
        "events": [{"name": "there", "when": "rotor.phi - a", "set": {"on": 1, "from": "t"}}],
        "start": {"rotor": {"phi": 0.1, "omega": 1.6}}}"#;
    let (a, phi, w, c, inertia, t) = (0.9, 0.1, 1.6, 1.2, 0.5, 2.0);
    let early: f64 = (a - phi) / w;
    let s = t - early;
    let rate = w + 0.5 * c / inertia * s * s;
    assert_slopes(
        scene,
        "rotor.phi",
        t,
        &[
            ("a", 1.0 - rate / w),
            ("rotor.phi", rate / w),
            ("rotor.omega", s + rate * (a - phi) / (w * w)),
            ("c", s.powi(3) / (6.0 * inertia)),
            ("bars.rotor.inertia", -c * s.powi(3) / (6.0 * inertia * inertia)),
            // Before the event the torque is c on t.
            ("on", c / inertia * (early.powi(3) / 6.0 * rate / w + early * early / 2.0 * s)),
        ],
    );
}

/// A ball comes into a corner: each of its coordinates is reflected by itself, x = e (v t - x0).
#[test]
fn a_ball_is_derived_through_a_corner() {
    let scene = r#"{"name": "corner", "gravity": [0, 0],
        "bars": [{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 0.2}],
        "walls": [{"name": "left", "body": "ball", "point": [0, 0], "line": {"through": [0, 0], "normal": [1, 0]}, "restitution": 0.8},
                  {"name": "floor", "body": "ball", "point": [0, 0], "line": {"through": [0, 0], "normal": [0, 1]}, "restitution": 0.6}],
        "start": {"ball": {"phi": 0, "omega": 0, "origin": [1, 0.5], "velocity": [-2, -1]}}, "until": 1, "every": 0.1}"#;
    let to = ["start.ball.origin[0]", "start.ball.velocity[0]", "left.restitution", "start.ball.origin[1]"];
    let t = 0.9;
    let found = derived(&template(scene), &["ball.x", "ball.y", "impact:floor"], &to, t);
    assert_eq!(found.lost, None);
    for (measured, expected) in found.measures.iter().zip([
        [-0.8, -0.8 * t, 2.0 * t - 1.0, 0.0],
        [0.0, 0.0, 0.0, -0.6],
        [0.0, 0.0, 0.0, 1.0],
    ]) {
        for (slope, (path, expected)) in measured.slopes.iter().zip(to.iter().zip(expected)) {
            assert_near(*slope, expected, 1e-9, path);
        }
    }
}

#[test]
fn derivatives_of_shipped_scenes_with_switches_agree_with_differences_of_references() {
    for (name, at, paths) in [
        ("stick_slip", 4.0, &["hinges.B.friction.static", "spring.stiffness"][..]),
        ("friction_pendulum", 1.5, &["bar1.phi", "hinges.A.friction.kinetic"]),
        ("bang_bang", 2.0, &["bar.phi", "size"]),
        ("trebuchet", 0.4, &["gravity[1]"]),
        ("latch", 1.0, &["gravity[1]"]),
    ] {
        let template = example(name);
        let found = compared(&template, paths, at).unwrap_or_else(|why| panic!("{name}: {why}"));
        println!("{name}: {found:?}");
        assert!(!found.is_empty());
        for (path, off, doubt) in found {
            assert!(off < (1e-6_f64).max(3.0 * doubt) && doubt < 1e-4, "{name} {path}: {off:e} {doubt:e}");
        }
    }
}

/// Random chains with friction, corners, events and curved walls: `CASES` of them from seed `SEED` on.
#[test]
fn derivatives_through_random_crossings_agree_with_differences_of_references() {
    let number =
        |name: &str, usual: u64| std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(usual);
    let (cases, seed) = (number("CASES", 4), number("SEED", 1));
    let (mut table, mut refused) = (BTreeMap::new(), BTreeMap::<String, usize>::new());
    let (mut count, mut outside) = (0, 0);
    for case in 0..cases {
        let own = seed * 1000 + case / 2;
        let (text, kind) = if case % 2 == 0 { scene(own) } else { scene_of_numbers(own) };
        let template = template(&text);
        let numbers = template.written_numbers(&[]).expect("a scene");
        let mut dice = Dice::new(own ^ 0x7919);
        let paths: Vec<&str> = (0..3).map(|_| numbers[dice.pick(numbers.len())].path.as_str()).collect();
        let found = match compared(&template, &paths, 1.5) {
            Ok(found) => found,
            Err(why) => {
                let why = why.split(", at t").next().unwrap_or_default().chars().take(110).collect();
                *refused.entry(why).or_default() += 1;
                continue;
            }
        };
        for (path, off, doubt) in found.into_iter().filter(|(.., doubt)| *doubt < 1e-7) {
            count += 1;
            if off > 1e-6 {
                outside += 1;
                println!("seed {own} {kind} {path}: {off:.1e}, known to {doubt:.1e}");
            }
            let row: &mut (usize, f64) = table.entry(kind).or_default();
            *row = (row.0 + 1, row.1.max(off));
        }
    }
    for (kind, (count, worst)) in &table {
        println!("{kind:28} {count:5} {worst:9.1e}");
    }
    println!("{count} derivatives, {outside} outside; refused: {refused:?}");
    assert!(outside * 50 <= count, "{outside} of {count} outside");
}

/// A bar that comes to rest on a wall with the last of its rebounds left out, and a bar hung on it that feels how
/// the speed left is taken off.
#[test]
fn coming_to_rest_is_derived_with_the_speed_it_takes_off() {
    let text = |friction: &str| {
        format!(
            r#"{{"name": "rest", "gravity": [0, -9.81], "bars": [
                {{"name": "a", "mass": 0.7, "centre": [0.3, 0], "inertia": 0.02, "length": 0.6}},
                {{"name": "b", "mass": 0.6, "centre": [0.2, 0.1], "inertia": 0.014, "length": 0.5}}],
                "hinges": [
                {{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}},
                {{"name": "B", "between": [{{"body": "a", "point": [0.4, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
                "walls": [{{"name": "floor", "body": "a", "point": [0.6, 0.02], "restitution": 0.4{friction},
                            "line": {{"through": [0, -0.25], "normal": [0.1, 1]}}}}],
                "start": {{"a": {{"phi": 0.1, "omega": 0}}, "b": {{"phi": -1, "omega": -1.5}}}},
                "until": 1.2, "every": 0.1}}"#
        )
    };
    for friction in ["", r#", "friction": {"kinetic": 0.3}"#] {
        let template = template(&text(friction));
        let found = compared(&template, &["bars.b.mass", "a.phi"], 0.9).expect("derivatives");
        for (path, off, doubt) in found {
            println!("{path}: {off:.1e}, known to {doubt:.1e}");
            assert!(off < 2e-8 && doubt < 1e-8, "{friction} {path}: {off:e} {doubt:e}");
        }
    }
}

/// An impact that turns the sign of a drag makes it change at that very moment, and with the moment.
#[test]
fn what_an_impact_switches_is_derived_with_the_impact() {
    let template = template(
        r#"{"name": "drag", "gravity": [0, -9.81],
            "bars": [{"name": "a", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]}],
            "torsion_springs": [{"name": "drag", "body": "a", "torque": "0.4*rate*abs(rate)"}],
            "walls": [{"name": "floor", "body": "a", "point": [1, 0], "restitution": 0.7,
                       "line": {"through": [0, -0.5], "normal": [0, 1]}}],
            "start": {"a": {"phi": 0.3, "omega": -0.5}}, "until": 1, "every": 0.1}"#,
    );
    let found = compared(&template, &["a.phi", "a.omega", "bars.a.mass"], 0.7).expect("derivatives");
    assert_eq!(found.len(), 3);
    for (path, off, doubt) in found {
        assert!(off < 1e-8 && doubt < 1e-9, "{path}: {off:e} {doubt:e}");
    }
}

/// A block bounces on a cart on a rough rail, which carries the cart alone until T = s (1+e)/(1-e), s² = 2h/g:
/// dx/dT = (a_held - a_flight) (t - T).
#[test]
fn the_end_of_infinitely_many_bounces_beside_a_rough_rail_is_derived() {
    let (g, mu, height, speed, e, until) = (9.81, 0.5, 0.1_f64, 10.0, 0.8, 2.0);
    let scene = template(&cart_below_a_block([1.0, 9.0], mu, e, [height, speed], until));
    let to = ["walls.deck.restitution", "sliders.rail.friction.kinetic", "start.block.origin[1]"];
    let found = derived(&scene, &["x"], &to, until);
    let fall = (2.0 * height / g).sqrt();
    let end = fall * (1.0 + e) / (1.0 - e);
    let (flight, held, left) = (0.1 * mu * g, mu * g, until - end);
    let by_end = (held - flight) * left;
    let expected = [
        by_end * 2.0 * fall / (1.0 - e).powi(2),
        -(0.5 * flight * end * end + flight * end * left + 0.5 * held * left * left) / mu,
        by_end * end / (2.0 * height),
    ];
    let measured = &found.measures[0];
    let x = speed * until + mu * expected[1];
    assert_near(measured.value, x, 1e-10, "x");
    for ((path, expected), found) in to.iter().zip(expected).zip(&measured.slopes) {
        println!("{path}: {:.1e}", found / expected - 1.0);
        assert_near(*found, expected, 1e-8, path);
    }
}

/// Derivative of a function at a place.
fn slope(f: impl Fn(f64) -> f64, x: f64) -> f64 {
    let h = 1e-4;
    (8.0 * (f(x + h) - f(x - h)) - (f(x + 2.0 * h) - f(x - 2.0 * h))) / (12.0 * h)
}

#[test]
fn friction_with_little_weight_left_is_derived() {
    // v = v0 - mu (m g - F) t/m: the normal force is 1e-4 of the weight.
    let [m, g, mu, t] = [2.0, 9.81, 0.3, 1.0];
    let lift = m * g * (1.0 - 1e-4);
    let text = format!(
        r#"{{"name": "light", "gravity": [0, -{g}],
        "bars": [{{"name": "c", "mass": {m}, "centre": [0, 0], "inertia": 0.1, "length": 0.3}}],
        "sliders": [{{"name": "S", "point": {{"body": "c", "point": [0, 0]}}, "angle": "locked",
            "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}, "friction": {{"kinetic": {mu}}}}}],
        "forces": [{{"name": "F", "body": "c", "point": [0, 0], "force": [0, {lift}]}}],
        "start": {{"c": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [5, 0]}}}}, "until": {t}, "every": {t}}}"#
    );
    let by_mass = -mu * lift * t / (m * m);
    let expected = [
        ("bars.c.mass", by_mass),
        ("gravity[1]", mu * t),
        ("forces.F.force[1]", mu * t / m),
        ("sliders.S.friction.kinetic", -(m * g - lift) * t / m),
    ];
    assert_slopes(&text, "c.vx", t, &expected);
}

#[test]
fn an_impact_that_nearly_sticks_is_derived_by_its_friction() {
    // The impulse of friction leaves the ball a speed of 1e-4 m/s along the wall: v = v0 - mu (1 + e) w.
    let [e, mu, height, g] = [0.5, 0.3, 0.5, 9.81_f64];
    let fall = (2.0 * g * height).sqrt();
    let v = mu * (1.0 + e) * fall + 1e-4;
    let text = format!(
        r#"{{"name": "border", "gravity": [0, -{g}],
        "bars": [{{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 0.1, "length": 0.1}}],
        "walls": [{{"name": "floor", "body": "ball", "point": [0, 0],
            "line": {{"through": [0, 0], "normal": [0, 1]}}, "restitution": {e}, "friction": {{"kinetic": {mu}}}}}],
        "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [0, {height}], "velocity": [{v:?}, 0]}}}},
        "until": 0.5, "every": 0.5}}"#
    );
    let expected = [
        ("walls.floor.friction.kinetic", -(1.0 + e) * fall),
        ("walls.floor.restitution", -mu * fall),
        ("start.ball.velocity[0]", 1.0),
        ("gravity[1]", mu * (1.0 + e) * fall / (2.0 * g)),
    ];
    assert_slopes(&text, "ball.vx", 0.5, &expected);
}

#[test]
fn gentle_bounces_are_derived_by_the_direction_of_the_wall() {
    // The tenth bounce on an inclined wall approaches it with 5e-5 m/s.
    let ([e, height, g], [vx, vy], at) = ([0.3, 0.3, 9.81], [2.5, 2.0], 0.692_887_091);
    let text = format!(
        r#"{{"name": "bounces", "gravity": [0, -{g}],
        "bars": [{{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 0.1, "length": 0.1}}],
        "walls": [{{"name": "floor", "body": "ball", "point": [0, 0],
            "line": {{"through": [0, 0], "normal": [-0.2, 1]}}, "restitution": {e}}}],
        "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [0, {height}], "velocity": [{vx}, {vy}]}}}},
        "until": {at}, "every": {at}}}"#
    );
    // Along the wall and away from it.
    let exact = |normal: f64, count: i32| {
        let length = normal.hypot(1.0);
        let (c, s) = (1.0 / length, normal / length);
        let (away, pull) = (vx * s + vy * c, g * c);
        let approach = (away * away + 2.0 * pull * height * c).sqrt();
        let first = (away + approach) / pull;
        let bounces: f64 = (1..count).map(|k| 2.0 * approach * f64::powi(e, k) / pull).sum();
        let rate = approach * f64::powi(e, count) - pull * (at - first - bounces);
        let along = vx * c - vy * s + g * s * at;
        (along * c + rate * s, rate, approach * f64::powi(e, count))
    };
    let (_, rate, most) = exact(-0.2, 10);
    assert!(rate.abs() < most && most < 5e-5, "{rate} {most}: not within the tenth bounce");
    let expected = slope(|normal| exact(normal, 10).0, -0.2);
    assert_slopes(&text, "ball.vx", at, &[("walls.floor.line.normal[0]", expected)]);
}

#[test]
fn corners_near_a_number_are_not_reached_over() {
    let text = |beside: f64| {
        format!(
            r#"{{"name": "corner", "gravity": [0, -9.81], "parameters": {{"k": {:?}}},
            "bars": [{{"name": "c", "mass": 2, "centre": [0, 0], "inertia": 0.1, "length": 0.3}}],
            "sliders": [{{"name": "S", "point": {{"body": "c", "point": [0, 0]}}, "angle": "locked",
                "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}}}],
            "forces": [{{"name": "F", "body": "c", "point": [0, 0], "force": ["max(k-1,0)", 0]}}],
            "outputs": {{"o": "abs(k-1)*2"}},
            "start": {{"c": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [1, 0]}}}},
            "until": 1, "every": 1}}"#,
            1.0 + beside
        )
    };
    for beside in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5] {
        for (beside, expected) in [(beside, [2.0, 0.5]), (-beside, [-2.0, 0.0])] {
            let found = derived(&template(&text(beside)), &["o", "c.vx"], &["k"], 1.0);
            let error = found.inputs[0].error;
            assert!(error <= 1e-6, "{beside}: {error}");
            for (measure, expected) in found.measures.iter().zip(expected) {
                let off = (measure.slopes[0] - expected).abs();
                assert!(off <= 10.0 * error + 1e-11, "{beside}: {} by {off} of {error}", measure.name);
            }
        }
    }
}
