//! Impacts at several walls at once, with dry friction and without: against closed forms.

use super::contact::watched;
use super::formulas::{adaptive, run, scene};
use driftless::Mechanism;
use driftless::run::{MethodId, Outcome, Sample};

const G: f64 = 9.81;

fn runs(text: &str) -> Vec<Outcome> {
    let scene = scene(text);
    [(MethodId::Taylor, 1e-13), (MethodId::Dp5, 1e-12), (MethodId::Dp8, 1e-12), (MethodId::Radau(5), 1e-12)]
        .map(|(method, tolerance)| {
            let outcome = run(&scene, &adaptive(method, tolerance));
            assert!(outcome.stop.is_none(), "{method}: {:?}", outcome.stop);
            assert!(outcome.drift.energy.max < 1e-10, "{method}: {:e}", outcome.drift.energy.max);
            outcome
        })
        .into()
}

/// A number from 0 to 1 for a case, another one for each salt.
pub fn share(case: u32, salt: u32) -> f64 {
    f64::from(case.wrapping_mul(2_654_435_761).wrapping_mul(2 * salt + 1) >> 8) / f64::from(1_u32 << 24)
}

fn near(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() < 1e-10, "{what}: {found} and not {expected}");
}

/// A body of 2 kg that slides along a rough floor under a wall that leans over it.
#[test]
fn a_sliding_body_jams_under_a_wall_that_leans_over() {
    let (mass, mu, lean, from, speed) = (2.0, 0.3, 0.5_f64, 0.5, 2.2_f64);
    let (sin, cos) = lean.sin_cos();
    // On the way there it loses mu g.
    let u = (speed * speed - 2.0 * mu * G * from).sqrt();
    let met = (speed - u) / (mu * G);
    for e in [0.0, 0.5, 0.8] {
        for law in ["poisson", "newton"] {
            let text = format!(
                r#"{{"name": "wedge", "gravity": [0, -{G}], "bars": [{{"name": "b", "mass": {mass}, "centre": [0, 0], "inertia": 0.1}}],
                "walls": [{{"name": "floor", "body": "b", "point": [0, 0], "line": {{"through": [0, 0], "normal": [0, 1]}},
                        "restitution": 0.4, "friction": {{"kinetic": {mu}, "impact": "{law}"}}}},
                    {{"name": "roof", "body": "b", "point": [0, 0], "line": {{"through": [0, 0], "normal": [{}, {}]}}, "restitution": {e}}}],
                "start": {{"b": {{"phi": 0, "omega": 0, "origin": [-{from}, 0], "velocity": [{speed}, 0]}}}}, "until": 1, "every": 1}}"#,
                -cos, -sin
            );
            // The roof gives n along its normal, the floor n sin upwards and mu n sin against the sliding: ahead
            // until that ends, then back.
            let (back, impulse) = if law == "poisson" {
                let compression = mass * u / (cos + mu * sin);
                (e * compression * (cos - mu * sin) / mass, (1.0 + e) * compression)
            } else {
                (e * u, (1.0 + e) * mass * u / (cos - mu * sin))
            };
            let impulse = if e == 0.0 { mass * u / (cos + mu * sin) } else { impulse };
            let rest = 1.0 - met;
            let x = if back > mu * G * rest {
                -back * rest + 0.5 * mu * G * rest * rest
            } else {
                -0.5 * back * back / (mu * G)
            };
            for outcome in runs(&text) {
                near(outcome.last.phi[1], x, "x");
                near(outcome.last.phi[2], 0.0, "y");
                let roof = outcome.impacts.iter().find(|hit| hit.wall == "roof").expect("an impact");
                let floor = outcome.impacts.iter().find(|hit| hit.wall == "floor").expect("an impact");
                near(roof.t, met, "meets");
                near(roof.approach, -u * cos, "approach");
                near(roof.impulse, impulse, "impulse of the roof");
                near(floor.impulse, impulse * sin, "impulse of the floor");
                near(roof.energy_lost + floor.energy_lost, 0.5 * mass * (u * u - back * back), "lost");
            }
        }
    }
}

/// A box whose lower corners meet a rough floor at the same moment: (mass, width, height of the centre, inertia).
const BOX: [f64; 4] = [1.5, 0.8, 0.2, 0.3];
const FALL: f64 = 0.4;

fn falling_box(slide: f64, mu: f64, e: f64, law: &str, after: f64) -> Vec<Outcome> {
    let [mass, width, height, inertia] = BOX;
    let corner = |name: &str, x: f64| {
        format!(
            r#"{{"name": "{name}", "body": "box", "point": [{x}, -{height}], "line": {{"through": [0, 0], "normal": [0, 1]}},
            "restitution": {e}, "friction": {{"kinetic": {mu}, "impact": "{law}"}}}}"#
        )
    };
    let until = (2.0 * FALL / G).sqrt() + after;
    runs(&format!(
        r#"{{"name": "box", "gravity": [0, -{G}], "bars": [{{"name": "box", "mass": {mass}, "centre": [0, 0], "inertia": {inertia}}}],
        "walls": [{}, {}], "start": {{"box": {{"phi": 0, "omega": 0, "origin": [0, {}], "velocity": [{slide}, 0]}}}},
        "until": {until}, "every": {until}}}"#,
        corner("left", -0.5 * width),
        corner("right", 0.5 * width),
        height + FALL,
    ))
}

fn leaves(outcome: &Outcome, [x, y, spin]: [f64; 3]) {
    near(outcome.last.omega[1], x, "velocity along the floor");
    near(outcome.last.omega[2], y - 0.05 * G, "velocity upwards");
    near(outcome.last.omega[0], spin, "spin");
}

#[test]
fn a_box_that_lands_flat_and_slides_stays_flat() {
    let [mass, width, height, _] = BOX;
    let v = (2.0 * G * FALL).sqrt();
    for (e, mu) in [(0.5, 0.4), (0.8, 1.2)] {
        for law in ["poisson", "newton"] {
            let normal = (1.0 + e) * mass * v;
            for outcome in falling_box(20.0, mu, e, law, 0.05) {
                leaves(&outcome, [20.0 - mu * normal / mass, e * v, 0.0]);
                let share = |sign: f64| normal * (0.5 + sign * mu * height / width);
                for (name, expected) in [("left", share(-1.0)), ("right", share(1.0))] {
                    let hit = outcome.impacts.iter().find(|hit| hit.wall == name).expect("an impact");
                    near(hit.impulse, expected, name);
                    near(hit.friction_impulse, -mu * expected, name);
                }
            }
        }
    }
}

/// Where friction would tip it the rear corner gets nothing, and leaves the floor.
#[test]
fn a_box_that_lands_flat_and_tips_turns_about_its_front_corner() {
    let [mass, width, height, inertia] = BOX;
    let (v, mu, e, x) = ((2.0 * G * FALL).sqrt(), 2.6, 0.5, 0.5 * width);
    let response = 1.0 / mass + x * (x - mu * height) / inertia;
    let normal = (1.0 + e) * v / response;
    let spin = normal * (x - mu * height) / inertia;
    assert!(spin < 0.0 && -v + normal / mass - x * spin > 0.0);
    for outcome in falling_box(30.0, mu, e, "poisson", 0.05) {
        assert_eq!(outcome.impacts.len(), 1, "{:?}", outcome.impacts);
        near(outcome.impacts[0].impulse, normal, "impulse");
        leaves(&outcome, [30.0 - mu * normal / mass, -v + normal / mass, spin]);
    }
}

/// Both corners stop within the compression; what was pressed unevenly expands unevenly, and turns the box
/// about a point above corners that stick.
#[test]
fn a_box_that_lands_flat_and_sticks_rebounds_with_a_spin() {
    let [mass, _, height, inertia] = BOX;
    let (v, u, e) = ((2.0 * G * FALL).sqrt(), 0.5, 0.6);
    let spin = e * height * mass * u / (inertia + mass * height * height);
    for outcome in falling_box(u, 0.9, e, "poisson", 0.05) {
        leaves(&outcome, [-height * spin, e * v, spin]);
        let along: f64 = outcome.impacts.iter().map(|hit| hit.friction_impulse).sum();
        near(along, -mass * (u + height * spin), "friction of both");
    }
}

/// Without restitution it stays on the floor, slides to a stop and sticks at both corners.
#[test]
fn a_box_that_lands_flat_slides_to_a_stop() {
    let (v, mu, u) = ((2.0 * G * FALL).sqrt(), 0.4, 3.0);
    let (falls, slides) = (v / G, u - mu * v);
    let stops = slides / (mu * G);
    for outcome in falling_box(u, mu, 0.0, "poisson", 1.0) {
        near(outcome.last.phi[1], u * falls + 0.5 * slides * stops, "x");
        near(outcome.last.phi[2], BOX[2], "y");
        near(outcome.last.friction, 0.5 * BOX[0] * slides * slides, "lost in sliding");
        let last: Vec<_> = outcome.frictions.iter().rev().take(2).collect();
        for transition in last {
            assert_eq!(transition.mode, "sticks");
            near(transition.t, falls + stops, "sticks at");
        }
    }
}

/// On a smooth floor both corners are pressed alike, and expand as their walls let them: without a spin only
/// where these are equal.
#[test]
fn a_box_that_lands_flat_on_a_smooth_floor_turns_by_the_difference_of_its_restitutions() {
    let [mass, width, height, inertia] = BOX;
    let (v, x) = ((2.0 * G * FALL).sqrt(), 0.5 * width);
    for [left, right] in [[0.5, 0.5], [0.0, 0.0], [0.7, 0.6]] {
        let corner = |name: &str, x: f64, e: f64| {
            format!(
                r#"{{"name": "{name}", "body": "box", "point": [{x}, -{height}], "line": {{"through": [0, 0], "normal": [0, 1]}}, "restitution": {e}}}"#
            )
        };
        let until = (2.0 * FALL / G).sqrt() + 0.05;
        let text = format!(
            r#"{{"name": "box", "gravity": [0, -{G}], "bars": [{{"name": "box", "mass": {mass}, "centre": [0, 0], "inertia": {inertia}}}],
            "walls": [{}, {}], "start": {{"box": {{"phi": 0, "omega": 0, "origin": [0, {}], "velocity": [3, 0]}}}},
            "until": {until}, "every": {until}}}"#,
            corner("left", -x, left),
            corner("right", x, right),
            height + FALL,
        );
        let [back, spin] = [0.5 * (left + right) * v, 0.5 * (right - left) * mass * v * x / inertia];
        assert!(back - x * spin.abs() >= 0.0);
        for outcome in runs(&text) {
            near(outcome.last.omega[0], spin, "spin");
            near(outcome.last.omega[1], 3.0, "velocity along the floor");
            // What rests there is carried.
            near(outcome.last.omega[2], if back > 0.0 { back - 0.05 * G } else { 0.0 }, "velocity upwards");
            for (name, e) in [("left", left), ("right", right)] {
                let hit = outcome.impacts.iter().find(|hit| hit.wall == name).expect("an impact");
                near(hit.impulse, 0.5 * (1.0 + e) * mass * v, name);
            }
        }
    }
}

/// Runs of a ball of 2 kg that falls straight into a corner of two equal walls, which lean so far to both sides
/// and have these further keys.
fn ball_in_a_corner(lean: f64, e: f64, more: &str) -> Vec<Outcome> {
    let (sin, cos) = lean.sin_cos();
    let wall = |name: &str, side: f64| {
        format!(
            r#"{{"name": "{name}", "body": "ball", "point": [0, 0], "line": {{"through": [0, 0], "normal": [{}, {cos}]}},
            "restitution": {e}{more}}}"#,
            side * sin
        )
    };
    let until = (2.0 * FALL / G).sqrt() + 0.05;
    runs(&format!(
        r#"{{"name": "corner", "gravity": [0, -{G}], "bars": [{{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 0.1}}],
        "walls": [{}, {}], "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [0, {FALL}], "velocity": [0, 0]}}}},
        "until": {until}, "every": {until}}}"#,
        wall("left", 1.0),
        wall("right", -1.0)
    ))
}

/// Out of a smooth corner it comes the way it went in, whatever the angle.
#[test]
fn a_ball_in_a_smooth_corner_rebounds_the_way_it_came() {
    let (v, e) = ((2.0 * G * FALL).sqrt(), 0.6);
    for lean in [0.2, 0.7, 1.3] {
        for outcome in ball_in_a_corner(lean, e, "") {
            near(outcome.last.omega[1], 0.0, "aside");
            near(outcome.last.omega[2], e * v - 0.05 * G, "upwards");
            assert_eq!(outcome.impact_count, 2);
        }
    }
}

/// Out of a rough one too, slower.
#[test]
fn a_ball_in_a_corner_rebounds_the_way_it_came() {
    let (v, e, mu, lean) = ((2.0 * G * FALL).sqrt(), 0.6, 0.3, 0.7_f64);
    let (sin, cos) = lean.sin_cos();
    // Friction brakes the way in as well as the way out.
    let back = e * v * (cos - mu * sin) / (cos + mu * sin);
    for outcome in ball_in_a_corner(lean, e, &format!(r#", "friction": {{"kinetic": {mu}}}"#)) {
        near(outcome.last.omega[1], 0.0, "aside");
        near(outcome.last.omega[2], back - 0.05 * G, "upwards");
        assert_eq!(outcome.impact_count, 2);
        near(outcome.impact_loss, v * v - back * back, "lost");
    }
}

/// At one wall the complementarity problem gives what Routh's method gives, which follows the impulse as it grows,
/// wherever the sliding does not turn.
#[test]
fn one_wall_alone_is_met_as_by_rouths_method() {
    let (mut slid, mut stuck) = (0, 0);
    for k in 0..240_u32 {
        let of = |salt: u32| share(k, salt);
        let (angle, spin, slide, mu, e) =
            (0.2 + 2.6 * of(1), 4.0 * of(2) - 2.0, 6.0 * of(3) - 3.0, 0.9 * of(4), of(5));
        let text = format!(
            r#"{{"name": "rod", "gravity": [0, -{G}], "bars": [{{"name": "rod", "mass": 1, "centre": [0.5, 0], "inertia": 0.08333333333333333}}],
            "walls": [{{"name": "floor", "body": "rod", "point": [0, 0], "line": {{"through": [0, 0], "normal": [0, 1]}},
                "restitution": {e}, "friction": {{"kinetic": {mu}, "static": {}}}}}],
            "start": {{"rod": {{"phi": {angle}, "omega": {spin}, "origin": [0, 0], "velocity": [{slide}, -2]}}}}, "until": 1, "every": 1}}"#,
            1.3 * mu
        );
        let mechanism = Mechanism::new(&scene(&text)).expect("equations");
        let (phi, omega) = ([angle, 0.0, 0.0], [spin, slide, -2.0]);
        let single = mechanism.impact_at(0, Default::default(), &phi, &omega).expect("an end");
        let turned = single.omega[1] * slide < -1e-9;
        if turned {
            continue;
        }
        let several = mechanism.impact_at_several(&[0], Default::default(), &phi, &omega).expect("impulses");
        for (one, other) in single.omega.iter().zip(&several.omega) {
            near(*other, *one, "rate");
        }
        near(several.blows[0].impulse, single.impulse, "impulse");
        near(several.blows[0].tangential, single.tangential, "friction");
        if single.omega[1].abs() < 1e-9 { stuck += 1 } else { slid += 1 }
    }
    assert!(slid > 30 && stuck > 30, "{slid} slide on, {stuck} stick");
}

/// A bar on a hinge comes to rest on a rough wall, along which it cannot slide: the speed with which it came moves it
/// along, and is gone. A bar hung on it swings about a fixed pivot from then on.
#[test]
fn a_hinged_bar_comes_to_rest_on_a_rough_wall() {
    let scene = scene(
        r#"{"name": "rest", "gravity": [0, -9.81], "bars": [
            {"name": "a", "mass": 0.7, "centre": [0.3, 0], "inertia": 0.02, "length": 0.6},
            {"name": "b", "mass": 0.6, "centre": [0.2, 0.1], "inertia": 0.014, "length": 0.5}],
            "hinges": [
            {"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
            {"name": "B", "between": [{"body": "a", "point": [0.4, 0]}, {"body": "b", "point": [0, 0]}]}],
            "walls": [{"name": "floor", "body": "a", "point": [0.6, 0.02], "restitution": 0.4, "friction": {"kinetic": 0.3},
                       "line": {"through": [0, -0.25], "normal": [0.1, 1]}}],
            "start": {"a": {"phi": 0.1, "omega": 0}, "b": {"phi": -1, "omega": -1.5}},
            "until": 0.9, "every": 0.1}"#,
    );
    let energy = |sample: &Sample| {
        let height = 0.2 * sample.phi[1].sin() + 0.1 * sample.phi[1].cos();
        0.5 * (0.014 + 0.6 * 0.05) * sample.omega[1].powi(2) + 0.6 * G * height
    };
    let mut ends: Vec<f64> = Vec::new();
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Radau(5)] {
        for tolerance in [1e-9, 1e-11, 1e-13] {
            let (outcome, samples) = watched(&scene, &adaptive(method, tolerance));
            assert!(outcome.stop.is_none(), "{method} {tolerance:e}: {:?}", outcome.stop);
            let resting: Vec<&Sample> = samples.iter().filter(|sample| sample.t > 0.45).collect();
            for sample in &resting {
                let left = [sample.omega[0], energy(sample) - energy(resting[0])];
                assert!(
                    left.iter().all(|left| left.abs() < tolerance.max(1e-12)),
                    "{method} {tolerance:e}: {left:?}"
                );
            }
            ends.push(resting[4].phi[1]);
        }
    }
    assert!(ends.iter().all(|end| (end - ends[2]).abs() < 2e-9), "{ends:?}");
}

/// A block above a cart on a rough rail of the ground, of these masses, at a height and with the speed of the cart.
pub fn cart_below_a_block(
    [cart, block]: [f64; 2],
    mu: f64,
    e: f64,
    [height, speed]: [f64; 2],
    until: f64,
) -> String {
    format!(
        r#"{{"name": "cart", "gravity": [0, -{G}], "until": {until}, "every": {until},
        "bars": [{{"name": "cart", "mass": {cart}, "centre": [0, 0], "inertia": 0.1}},
            {{"name": "block", "mass": {block}, "centre": [0, 0], "inertia": 0.1}}],
        "sliders": [{{"name": "rail", "point": {{"body": "cart", "point": [0, 0]}},
                "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}, "angle": "locked", "friction": {{"kinetic": {mu}}}}},
            {{"name": "post", "point": {{"body": "block", "point": [0, 0]}},
                "rail": {{"body": "cart", "point": [0, 0], "direction": [0, 1]}}, "angle": "locked"}}],
        "walls": [{{"name": "deck", "body": "block", "point": [0, 0], "restitution": {e},
            "line": {{"body": "cart", "through": [0, 0], "normal": [0, 1]}}}}],
        "outputs": {{"x": "block.x"}},
        "start": {{"cart": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [{speed}, 0]}},
            "block": {{"phi": 0, "omega": 0, "origin": [0, {height}], "velocity": [{speed}, 0]}}}}}}"#
    )
}

/// A block that bounces on a cart, which slides along a rough rail of the ground: until the bounces have ended the
/// rail carries the cart alone.
#[test]
fn a_joint_rubs_as_in_flight_until_infinitely_many_bounces_have_ended() {
    let (cart, block, mu, height, speed, until) = (1.0, 9.0, 0.5, 0.1_f64, 10.0, 2.0);
    let total = cart + block;
    for e in [0.5_f64, 0.8, 0.85] {
        let text = cart_below_a_block([cart, block], mu, e, [height, speed], until);
        let end = (2.0 * height / G).sqrt() * (1.0 + e) / (1.0 - e);
        let (flying, held) = (mu * G * cart / total, mu * G);
        let left = until - end;
        let met = speed - flying * end;
        let v = met - held * left;
        let x = 0.5 * (speed + met) * end + 0.5 * (met + v) * left;
        let lost = 0.5 * total * (speed * speed - v * v);
        for outcome in runs(&text) {
            near(0.1 * outcome.last.omega[2], 0.1 * v, "rate of the cart");
            near(0.1 * outcome.last.phi[2], 0.1 * x, "place of the cart");
            near(1e-3 * outcome.last.friction, 1e-3 * lost, "energy lost in friction");
            near(1e-2 * outcome.impact_loss, 1e-2 * block * G * height, "energy lost in impacts");
            near(0.1 * outcome.holds[0].t, 0.1 * end, "end of the bounces");
        }
    }
}

/// A bar of 1 kg on a hinge whose tip meets a rough wall, alone or as a crank of a parallelogram whose coupler meets
/// it: one degree of freedom, with the moment of inertia by the angle of the bar.
fn one_freedom(is_looped: bool, through: [f64; 2], wall: &str, phi: f64) -> (String, f64) {
    let bar = |name: &str| {
        format!(r#"{{"name": "{name}", "mass": 1, "centre": [0.25, 0], "inertia": 0.03, "length": 0.5}}"#)
    };
    let hinge = |name: &str, one: &str, other: &str| {
        let side = |side: &str| {
            let (body, point) = side.split_once(' ').expect("a body and its point");
            format!(r#"{{"body": "{body}", "point": [{point}, 0]}}"#)
        };
        format!(r#"{{"name": "{name}", "between": [{}, {}]}}"#, side(one), side(other))
    };
    let (mut bars, mut hinges) = (vec![bar("a")], vec![hinge("A", "ground 0", "a 0")]);
    let mut start = format!(r#""a": {{"phi": {phi}, "omega": 0}}"#);
    if is_looped {
        bars.push(
            r#"{"name": "b", "mass": 0.7, "centre": [0.2, 0.1], "inertia": 0.05, "length": 0.8}"#.into(),
        );
        bars.push(bar("c"));
        let more = [("B", "a 0.5", "b 0"), ("C", "b 0.8", "c 0.5"), ("D", "ground 0.8", "c 0")];
        hinges.extend(more.map(|(name, one, other)| hinge(name, one, other)));
        start += &format!(r#", "b": {{"phi": 0, "omega": 0}}, "c": {{"phi": {phi}, "omega": 0}}"#);
    }
    let (on, at) = if is_looped { ("b", "0.3, -0.2") } else { ("a", "0.5, 0") };
    let [x, y] = through;
    let text = format!(
        r#"{{"name": "rest", "gravity": [0, -{G}], "bars": [{}], "hinges": [{}],
        "walls": [{{"name": "W", "body": "{on}", "point": [{at}], "line": {{"through": [{x}, {y}], {wall}}}],
        "start": {{{start}}}, "until": 0.6, "every": 0.1}}"#,
        bars.join(", "),
        hinges.join(", "),
    );
    let crank = 0.03 + 0.0625;
    (text, if is_looped { 2.0 * crank + 0.7 * 0.25 } else { crank })
}

/// What a wall whose normal is (x, 1) does to that mechanism, whose bar turns by `omega`: impulses of the wall and of
/// friction, and the rate after them.
///
/// The point moves by J_n and J_t of the rate, and both end together; then it sticks where J_n <= mu0 J_t, and
/// restitution moves nothing, else it slides back.
fn stopped_by(normal: f64, phi: f64, [inertia, omega, mu, e]: [f64; 4]) -> [f64; 3] {
    let size = normal.hypot(1.0);
    let [n, t] =
        [0.5 * (phi.cos() - normal * phi.sin()) / size, 0.5 * (-phi.sin() - normal * phi.cos()) / size];
    let compressed = inertia * omega.abs() / (n.abs() + mu * t.abs());
    let braked = -(t * omega).signum() * mu * compressed;
    let back = -(n * t).signum() * if n.abs() <= mu * t.abs() { (n / t).abs() } else { mu };
    let tangential = braked + back * e * compressed;
    let after = omega + (n * (1.0 + e) * compressed + t * tangential) / inertia;
    [(1.0 + e) * compressed, tangential, after]
}

/// What has one degree of freedom comes to rest on a rough wall, or rebounds, whichever of both velocities of its
/// point rounding lets end first.
#[test]
fn a_mechanism_of_one_freedom_is_stopped_by_a_rough_wall() {
    let (mut rests, mut rebounds) = (0, 0);
    for k in 0..800_u32 {
        let of = |salt: u32| share(k, salt);
        let (phi, normal, omega, mu) =
            (-1.5 * of(1), 4.0 * of(2) - 2.0, 6.0 * of(3) - 3.0, 0.1 + 0.8 * of(4));
        let (is_looped, e) = (k % 2 == 1, if k % 4 < 2 { 0.0 } else { 0.4 });
        let velocity = 0.5 * omega * (phi.cos() - normal * phi.sin());
        if velocity > -0.01 {
            continue;
        }
        let wall =
            format!(r#""normal": [{normal}, 1]}}, "restitution": {e}, "friction": {{"kinetic": {mu}}}"#);
        let (text, inertia) = one_freedom(is_looped, [0.0, -9.0], &wall, phi);
        let mechanism = Mechanism::new(&scene(&text)).expect("equations");
        let (angles, rates) = match is_looped {
            true => (vec![phi, 0.0, phi], vec![omega, 0.0, omega]),
            false => (vec![phi], vec![omega]),
        };
        let impact = mechanism.impact_at(0, Default::default(), &angles, &rates);
        let impact = impact.unwrap_or_else(|| panic!("no end: {text}"));
        let [impulse, tangential, after] = stopped_by(normal, phi, [inertia, omega, mu, e]);
        near(impact.impulse, impulse, "impulse");
        near(impact.tangential, tangential, "friction");
        near(impact.omega[0], after, "rate");
        if after.abs() < 1e-9 { rests += 1 } else { rebounds += 1 }
    }
    assert!(rests > 100 && rebounds > 30, "{rests} rest, {rebounds} rebound");
    // The tip falls to (0.3, -0.4), and stays there.
    for (normal, mu) in [(-0.1, 0.3), (-0.2, 0.45), (-0.3, 0.6), (-0.4, 0.3), (-0.5, 0.5), (-0.6, 0.2)] {
        let wall = format!(r#""normal": [{normal}, 1]}}, "restitution": 0, "friction": {{"kinetic": {mu}}}"#);
        let (text, inertia) = one_freedom(false, [0.3, -0.4], &wall, -0.3);
        let (phi, fell) = (-(0.8_f64.asin()), 0.25 * (0.8 - 0.3_f64.sin()));
        let omega = -(2.0 * G * fell / inertia).sqrt();
        let [impulse, tangential, _] = stopped_by(normal, phi, [inertia, omega, mu, 0.0]);
        for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Radau(5)] {
            for tolerance in [1e-9, 1e-11] {
                let outcome = run(&scene(&text), &adaptive(method, tolerance));
                assert!(outcome.stop.is_none(), "{method} {tolerance:e}: {:?}\n{text}", outcome.stop);
                let found = [outcome.impacts[0].impulse, outcome.impacts[0].friction_impulse];
                let last = [outcome.last.phi[0], outcome.last.omega[0]];
                for (found, expected) in found.into_iter().chain(last).zip([impulse, tangential, phi, 0.0]) {
                    assert!(
                        (found - expected).abs() < 1e3 * tolerance,
                        "{method}: {found} and not {expected}"
                    );
                }
                near(outcome.impact_count as f64, 1.0, "impacts");
            }
        }
    }
}
