//! Walls that move by formulas of where the mechanism is: followers, carts that push each other, curved ground;
//! against closed forms.

use super::formulas::{adaptive, run, scene};
use super::mechanisms::{Dice, Kind, scene_with};
use super::relations;
use driftless::Simulation;
use driftless::run::{MethodId, Outcome, Request};
use driftless::scene::{Output, Scene, parse_scene};
use serde_json::{Value, json};
use std::collections::BTreeMap;

const G: f64 = 9.81;

fn methods() -> [Request; 6] {
    [
        adaptive(MethodId::Dp5, 1e-11),
        adaptive(MethodId::Dp8, 1e-12),
        adaptive(MethodId::Taylor, 1e-13),
        adaptive(MethodId::Radau(3), 1e-10),
        adaptive(MethodId::Radau(5), 1e-12),
        Request { extended: true, ..adaptive(MethodId::Taylor, 1e-17) },
    ]
}

fn near(found: f64, expected: f64, most: f64, what: &str) {
    assert!((found - expected).abs() < most, "{what}: {found} and not {expected}");
}

fn finished(scene: &Scene, request: &Request) -> Outcome {
    let outcome = run(scene, request);
    assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
    assert!(outcome.drift.energy.max < 1e-8, "{:?}: {:e}", request.method, outcome.drift.energy.max);
    outcome
}

/// Two carts of 1 and 4 kg on one rail, with their starts; the point of the first stays right of `law`.
fn carts(law: &str, e: f64, [a, b]: [[f64; 2]; 2], until: f64, more: &str) -> Scene {
    scene(&format!(
        r#"{{"name": "carts", "gravity": [0, -{G}],
        "bars": [{{"name": "a", "mass": 1, "centre": [0, 0], "inertia": 0.1}}, {{"name": "b", "mass": 4, "centre": [0, 0], "inertia": 0.1}}],
        "sliders": [
            {{"name": "A", "point": {{"body": "a", "point": [0, 0]}}, "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}, "angle": "locked"}},
            {{"name": "B", "point": {{"body": "b", "point": [0, 0]}}, "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}, "angle": "locked"}}],
        "points": [{{"name": "pa", "body": "a", "point": [0, 0]}}, {{"name": "pb", "body": "b", "point": [0, 0]}}],
        "walls": [{{"name": "gear", "body": "a", "point": [0, 0], "restitution": {e},
            "line": {{"through": [0, 0], "normal": [1, 0]}}, "law": "{law}"}}],
        "start": {{"a": {{"phi": 0, "omega": 0, "origin": [{}, 0], "velocity": [{}, 0]}},
            "b": {{"phi": 0, "omega": 0, "origin": [{}, 0], "velocity": [{}, 0]}}}},
        "until": {until}, "every": {until}{more}}}"#,
        a[0], a[1], b[0], b[1]
    ))
}

#[test]
fn carts_exchange_momentum_through_a_gear() {
    // xa >= r xb:  p (1, -r) changes the momenta, and the rate of the gap is reversed with e.
    let (r, e) = (0.5, 0.6);
    let ([xa, va], [xb, vb]) = ([1.0, -0.7], [-2.0, 0.9]);
    let (gap, rate) = (xa - r * xb, va - r * vb);
    let met = -gap / rate;
    let impulse = -(1.0 + e) * rate / (1.0 + r * r / 4.0);
    let (ua, ub) = (va + impulse, vb - r * impulse / 4.0);
    for request in methods() {
        let outcome = finished(&carts("0.5*pb.x", e, [[xa, va], [xb, vb]], 4.0, ""), &request);
        let [impact] = &outcome.impacts[..] else { panic!("{:?}", outcome.impacts) };
        near(impact.t, met, 1e-10, "time");
        near(impact.approach, rate, 1e-10, "approach");
        near(impact.impulse, impulse, 1e-10, "impulse");
        let lost = 0.5 * (1.0 - e * e) * rate * rate / (1.0 + r * r / 4.0);
        near(impact.energy_lost, lost, 1e-10, "energy lost");
        near(outcome.last.omega[2], ua, 1e-10, "velocity of a");
        near(outcome.last.omega[4], ub, 1e-10, "velocity of b");
        near(outcome.last.phi[2], xa + met * va + (4.0 - met) * ua, 1e-9, "a");
        near(outcome.last.phi[4], xb + met * vb + (4.0 - met) * ub, 1e-9, "b");
    }
}

#[test]
fn carts_go_on_together_until_a_force_parts_them() {
    // After a plastic impact xa = r xb, under -F on a that grows back past zero: (1 + 4/r²) xa'' = f(t).
    let (r, k) = (0.5, 3.0);
    let forces = r#", "forces": [{"name": "pull", "body": "a", "point": [0, 0], "force": ["k*(t - 2)", 0]}], "parameters": {"k": 3}"#;
    let scene = carts("0.5*pb.x", 0.0, [[0.0, 0.0], [0.0, 0.0]], 3.0, forces);
    let mass = 1.0 + 4.0 / (r * r);
    // Held while f < 0: until t = 2, with f integrated once and twice.
    let (speed, way) = (k * (2.0 - 4.0) / mass, k * (8.0 / 6.0 - 4.0) / mass);
    for request in methods() {
        let outcome = finished(&scene, &request);
        let [hold] = &outcome.holds[..] else { panic!("{:?}", outcome.holds) };
        near(hold.t, 0.0, 1e-12, "held from");
        near(hold.until.expect("it parts"), 2.0, 1e-7, "held until");
        // From then on each by itself.
        near(outcome.last.omega[2], speed + 0.5 * k, 1e-8, "velocity of a");
        near(outcome.last.phi[2], way + speed + k / 6.0, 1e-8, "a");
        near(outcome.last.omega[4], speed / r, 1e-8, "velocity of b");
        near(outcome.last.phi[4], way / r + speed / r, 1e-8, "b");
    }
}

/// A ball of 1 kg above a wall with normal +y and this law of its place, at a place and velocity.
fn ball(law: &str, e: f64, [x, y]: [f64; 2], [u, v]: [f64; 2], until: f64, more: &str) -> Scene {
    scene(&format!(
        r#"{{"name": "ball", "gravity": [0, -{G}],
        "bars": [{{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.1}}],
        "points": [{{"name": "p", "body": "ball", "point": [0, 0]}}],
        "walls": [{{"name": "ground", "body": "ball", "point": [0, 0], "restitution": {e},
            "line": {{"through": [0, 0], "normal": [0, 1]}}, "law": "{law}"}}],
        "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [{x}, {y}], "velocity": [{u}, {v}]}}}},
        "until": {until}, "every": {until}{more}}}"#
    ))
}

#[test]
fn a_ball_bounces_in_a_bowl() {
    // On y = x²/2, by parabolas and bisection: the velocity along the normal (-x, 1) is reversed with e.
    let (e, until, start) = (0.8, 2.0, [[0.6, 0.7], [0.3, 0.1]]);
    let ([mut x, mut y], [mut u, mut v]) = (start[0], start[1]);
    let (mut t, mut expected) = (0.0, Vec::new());
    loop {
        let gap = |s: f64| y + s * (v - 0.5 * G * s) - 0.5 * (x + s * u) * (x + s * u);
        let mut end = 1e-3;
        while gap(end) > 0.0 {
            end += 1e-3;
        }
        let (mut low, mut high) = (end - 1e-3, end);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if gap(middle) > 0.0 { low = middle } else { high = middle }
        }
        if t + high > until {
            let s = until - t;
            (x, y, v) = (x + s * u, y + s * (v - 0.5 * G * s), v - G * s);
            break;
        }
        (t, x, y, v) = (t + high, x + high * u, y + high * (v - 0.5 * G * high), v - G * high);
        let rate = v - x * u;
        let impulse = -(1.0 + e) * rate / (1.0 + x * x);
        (u, v) = (u - x * impulse, v + impulse);
        expected.push((t, rate));
    }
    assert!(expected.len() > 3);
    for request in methods() {
        let outcome = finished(&ball("p.x^2/2", e, start[0], start[1], until, ""), &request);
        assert_eq!(outcome.impacts.len(), expected.len(), "{:?}", request.method);
        for (impact, (t, rate)) in outcome.impacts.iter().zip(&expected) {
            near(impact.t, *t, 1e-8, "time of an impact");
            near(impact.approach, *rate, 1e-7, "approach");
        }
        for (found, expected) in [(&outcome.last.phi, [x, y]), (&outcome.last.omega, [u, v])] {
            near(found[1], expected[0], 1e-7, "x");
            near(found[2], expected[1], 1e-7, "y");
        }
    }
}

#[test]
fn a_bead_slides_to_and_fro_in_a_bowl() {
    // (1 + x²) x'²/2 + g x²/2 = g a²/2:  a quarter of a period is ∫ sqrt((1 + a² sin² s)/g) ds over a right angle.
    let a: f64 = 0.8;
    let parts = 64;
    let quarter = (0..parts)
        .map(|i| {
            let s = std::f64::consts::FRAC_PI_2 * (f64::from(i) + 0.5) / f64::from(parts);
            ((1.0 + a * a * s.sin().powi(2)) / G).sqrt()
        })
        .sum::<f64>()
        * std::f64::consts::FRAC_PI_2
        / f64::from(parts);
    for request in methods() {
        for (periods, x, u) in [(0.25, 0.0, -a * G.sqrt()), (0.5, -a, 0.0), (2.0, a, 0.0)] {
            let scene = ball("p.x^2/2", 0.5, [a, 0.5 * a * a], [0.0, 0.0], 4.0 * periods * quarter, "");
            let outcome = finished(&scene, &request);
            assert!(outcome.impacts.is_empty() && outcome.holds.len() == 1, "{:?}", outcome.holds);
            near(outcome.last.phi[1], x, 1e-7, "x");
            near(outcome.last.omega[1], u, 1e-7, "velocity");
            near(outcome.last.phi[2], 0.5 * x * x, 1e-9, "on the bowl");
        }
    }
}

#[test]
fn a_bead_leaves_a_circle_where_two_thirds_of_the_height_are_left() {
    // cos = 2/3 + v²/(3 g) with the velocity v at the top; from there a parabola.
    let v: f64 = 0.5;
    let cos = 2.0 / 3.0 + v * v / (3.0 * G);
    let sin = (1.0 - cos * cos).sqrt();
    let speed = (v * v + 2.0 * G * (1.0 - cos)).sqrt();
    for request in methods() {
        let mut scene = ball("sqrt(1 - p.x^2) - 1", 0.0, [0.0, 0.0], [v, 0.0], 0.9, "");
        scene.every = 0.01;
        let outcome = finished(&scene, &request);
        let left = outcome.holds[0].until.expect("it leaves");
        let s = 0.9 - left;
        near(outcome.last.omega[1], speed * cos, 1e-7, "velocity along x");
        near(outcome.last.phi[1], sin + s * speed * cos, 1e-7, "x");
        near(outcome.last.phi[2], cos - 1.0 - s * (speed * sin + 0.5 * G * s), 1e-6, "y");
    }
}

#[test]
fn a_ball_that_meets_a_ramp_at_its_corner_keeps_what_goes_along_it() {
    // On the flat at 2 m/s to the corner: the velocity along (-0.75, 1) is lost, or reversed with e.
    for request in methods() {
        let outcome = finished(&ball("max(0, 0.75*p.x)", 0.0, [-1.0, 0.0], [2.0, 0.0], 0.6, ""), &request);
        let along = 2.0 * 0.8;
        let (s, a) = (0.1, -G * 0.6);
        near(outcome.last.phi[1], 0.8 * s * (along + 0.5 * a * s), 1e-8, "up the ramp");
        near(outcome.last.phi[2], 0.6 * s * (along + 0.5 * a * s), 1e-8, "up the ramp");
        near(outcome.last.omega[1], 0.8 * (along + a * s), 1e-8, "up the ramp");
        let [impact] = &outcome.impacts[..] else { panic!("{:?}", outcome.impacts) };
        near(impact.energy_lost, 0.5 * (2.0 * 0.6_f64).powi(2), 1e-8, "energy lost");
        let outcome = finished(&ball("max(0, 0.75*p.x)", 0.5, [-1.0, 0.0], [2.0, 0.0], 0.6, ""), &request);
        // 1.2 m/s into the ramp come back as 0.6.
        let (u, v) = (along * 0.8 - 0.6 * 0.6, along * 0.6 + 0.6 * 0.8);
        near(outcome.last.phi[1], s * u, 1e-8, "thrown");
        near(outcome.last.phi[2], s * (v - 0.5 * G * s), 1e-8, "thrown");
    }
}

#[test]
fn a_table_that_starts_to_rise_strikes_what_lies_on_it() {
    for request in methods() {
        for (e, leaves, s) in [(0.0, 0.2, 0.05), (0.5, 0.3, 0.02)] {
            let outcome =
                finished(&ball("0.2*max(t - 0.9, 0)", e, [0.0, 0.0], [0.0, 0.0], 0.9 + s, ""), &request);
            let [impact] = &outcome.impacts[..] else { panic!("{:?}", outcome.impacts) };
            near(impact.t, 0.9, 1e-9, "time");
            near(impact.approach, -0.2, 1e-9, "approach");
            let fall = if e == 0.0 { 0.0 } else { G };
            near(outcome.last.phi[2], s * (leaves - 0.5 * s * fall), 1e-9, "height");
        }
        // One that begins to sink leaves the ball behind.
        let outcome =
            finished(&ball("-0.2*max(t - 0.9, 0)", 0.0, [0.0, 0.0], [0.0, 0.0], 0.92, ""), &request);
        near(outcome.last.phi[2], -0.5 * G * 0.02 * 0.02, 1e-9, "height");
    }
}

/// A table of the place of its ball, which a number makes rise at u from 0.2 s on; until then it does no work.
#[test]
fn a_table_that_an_event_makes_rise_works_from_then_on() {
    let (g, h, u, e, until) = (G, 1.0, 0.5, 0.5, 0.6);
    let more =
        r#", "parameters": {"u": 0}, "events": [{"name": "go", "when": "t - 0.2", "set": {"u": 0.5}}]"#;
    let scene = ball("u*t*cos(ball.phi)", e, [0.0, h], [0.0, 0.0], until, more);
    let met = ((u * u + 2.0 * g * h).sqrt() - u) / g;
    let (leaves, s) = (u + e * (u + g * met), until - met);
    for request in methods() {
        let outcome = finished(&scene, &request);
        near(outcome.last.phi[2], u * met + s * (leaves - 0.5 * g * s), 1e-8, "height");
        let lost = 0.5 * (1.0 - e * e) * (u + g * met) * (u + g * met);
        near(outcome.impacts[0].energy_lost, lost, 1e-8, "energy");
    }
}

/// A follower of 1 kg on a rail along y, over a cam on a shaft, whose lift is `law`; more of the shaft.
fn follower(law: &str, e: f64, until: f64, more: &str) -> Scene {
    scene(&format!(
        r#"{{"name": "cam", "gravity": [0, -{G}],
        "bars": [{{"name": "cam", "mass": 2, "centre": [0, 0], "inertia": 0.5}}, {{"name": "rod", "mass": 1, "centre": [0, 0], "inertia": 0.1}}],
        "hinges": [{{"name": "shaft", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "cam", "point": [0, 0]}}]}}],
        "sliders": [{{"name": "guide", "point": {{"body": "rod", "point": [0, 0]}}, "rail": {{"body": "ground", "point": [0, 0], "direction": [0, 1]}}, "angle": "locked"}}],
        "walls": [{{"name": "lift", "body": "rod", "point": [0, 0], "restitution": {e},
            "line": {{"through": [0, 0], "normal": [0, 1]}}, "law": "{law}"}}],
        "start": {{"cam": {{"phi": 0.3, "omega": 20}}, "rod": {{"phi": 0, "omega": 0, "origin": [0, 0.3], "velocity": [0, 0]}}}},
        "until": {until}, "every": {until}{more}}}"#
    ))
}

#[test]
fn a_cam_on_a_driven_shaft_lifts_as_the_same_law_of_time() {
    let motor = r#", "motors": [{"name": "m", "body": "cam", "law": {"start": 0.3, "rate": 20}}]"#;
    for request in methods() {
        for (e, until) in [(0.6, 1.0), (0.0, 0.7)] {
            let [one, other] = ["20 mm*sin(cam.phi)*sin(2*cam.phi)", "20 mm*sin(0.3 + 20*t)*sin(0.6 + 40*t)"]
                .map(|law| finished(&follower(law, e, until, motor), &request));
            assert_eq!(one.impacts.len(), other.impacts.len());
            assert_eq!(one.holds.len(), other.holds.len());
            near(one.last.phi[3], other.last.phi[3], 1e-7, "height");
            near(one.last.omega[3], other.last.omega[3], 1e-6, "velocity");
            // The motor does what the wall does there.
            near(one.last.work, other.last.work, 1e-6, "work");
        }
    }
}

#[test]
fn a_free_shaft_gives_the_follower_what_it_loses() {
    // Energy in all of it is kept, elastically; the methods agree.
    let outcomes = methods().map(|request| finished(&follower("20 mm*sin(cam.phi)", 1.0, 1.5, ""), &request));
    for outcome in &outcomes {
        assert!(outcome.impacts.len() > 1, "{:?}", outcome.impacts);
        near(outcome.last.phi[0], outcomes[5].last.phi[0], 1e-6, "shaft");
        near(outcome.last.phi[3], outcomes[5].last.phi[3], 1e-6, "follower");
        near(outcome.last.omega[0], outcomes[5].last.omega[0], 1e-5, "rate of the shaft");
    }
    assert!((outcomes[0].last.omega[0] - 20.0).abs() > 0.01);
}

/// A follower that starts on its cam, to rounding, has no length of its own: what it lifts by is not measured
/// in that rounding.  Impacts are where `taylor` finds them, the follower is never below its cam, and while
/// it rests its height is the law of the angle.
#[test]
fn a_follower_that_starts_on_its_cam_strikes_it_where_it_meets_it() {
    let lift = |phi: f64| 0.061 * (1.0 - (2.0 * phi).cos());
    let of = |until: f64| {
        scene(&format!(
            r#"{{"name": "cam", "gravity": [0, -{G}],
            "bars": [{{"name": "cam", "mass": 1, "centre": [0, 0], "inertia": 0.05, "length": 0.2}},
                {{"name": "rod", "mass": 0.7, "centre": [0, 0], "inertia": 0.02, "length": 0.2}}],
            "hinges": [{{"name": "shaft", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "cam", "point": [0, 0]}}]}}],
            "sliders": [{{"name": "guide", "point": {{"body": "rod", "point": [0, 0]}}, "angle": "locked",
                "rail": {{"body": "ground", "point": [0, 0], "direction": [0, 1]}}}}],
            "walls": [{{"name": "lift", "body": "rod", "point": [0, 0], "restitution": 0,
                "line": {{"through": [0, 0], "normal": [0, 1]}}, "law": "0.061*(1-cos(2*cam.phi))"}}],
            "torques": [{{"name": "drive", "body": "cam", "torque": 3, "law": {{"start": 0, "sines": [{{"amplitude": 1, "frequency": 3}}]}}}}],
            "start": {{"cam": {{"phi": -2.875, "omega": 0}}, "rod": {{"phi": 0, "omega": 0, "origin": [0, {}], "velocity": [0, 0]}}}},
            "until": {until}, "every": {until}}}"#,
            0.008467262553147226
        ))
    };
    let times = |outcome: &Outcome| -> Vec<f64> { outcome.impacts.iter().map(|impact| impact.t).collect() };
    let expected = times(&finished(&of(4.0), &adaptive(MethodId::Taylor, 1e-13)));
    assert_eq!(expected.len(), 9);
    near(expected[2], 1.586_396_424_1, 1e-9, "the third");
    let others = [(MethodId::Dp5, 1e-8), (MethodId::Dp8, 1e-6), (MethodId::Dp8, 1e-9)];
    let implicit = [(MethodId::Radau(3), 1e-8), (MethodId::Radau(5), 1e-7)];
    for (method, tolerance) in others.into_iter().chain(implicit) {
        let outcome = run(&of(4.0), &adaptive(method, tolerance));
        assert!(outcome.stop.is_none(), "{method} {tolerance:e}: {:?}", outcome.stop);
        let found = times(&outcome);
        assert_eq!(found.len(), expected.len(), "{method} {tolerance:e}");
        for (found, expected) in found.iter().zip(&expected) {
            near(*found, *expected, 1e4 * tolerance, &format!("{method} {tolerance:e}"));
        }
        // In the middle of its first rest.
        let hold = &outcome.holds[0];
        let last =
            run(&of(0.5 * (hold.t + hold.until.expect("a release"))), &adaptive(method, tolerance)).last;
        near(last.phi[3], lift(last.phi[0]), 1e-10, "height at rest");
    }
}

#[test]
fn a_screw_counts_the_turns_of_its_shaft() {
    // The rod is struck at t = 0 and rests on the screw from then on, which it brakes: (1 + I/s²) y'' = -g.
    let (s, inertia, until) = (0.05, 0.5, 1.6);
    let impulse = s * 20.0 / (1.0 + s * s / inertia);
    let height = until * (impulse - 0.5 * until * G / (1.0 + inertia / (s * s)));
    for request in methods() {
        let outcome = finished(&follower("0.285 + 50 mm*cam.phi", 0.0, until, ""), &request);
        near(outcome.impacts[0].impulse, impulse, 1e-10, "impulse");
        near(outcome.last.phi[3], 0.3 + height, 1e-8, "height");
        near(outcome.last.phi[0], 0.3 + height / s, 1e-7, "turns of the shaft");
    }
}

#[test]
fn runs_end_in_the_same_bits_however_sampled() {
    for method in [MethodId::Dp8, MethodId::Taylor, MethodId::Radau(5)] {
        let ends = [2.0, 0.01].map(|every| {
            let mut scene = ball("p.x^2/2", 0.7, [0.6, 0.7], [0.3, 0.1], 2.0, "");
            scene.every = every;
            run(&scene, &adaptive(method, 1e-10)).last.phi
        });
        assert_eq!(ends[0], ends[1], "{method}");
    }
}

#[test]
fn what_has_no_meaning_is_refused_with_its_place() {
    // A start behind a wall whose place depends on the start itself.
    let arm = scene(
        r#"{"name": "arm", "gravity": [0, -9.81], "bars": [{"name": "arm", "mass": 1, "length": 1, "centre": [0.5, 0], "inertia": 0.1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "arm", "point": [0, 0]}]}],
        "walls": [{"name": "stop", "body": "arm", "point": [1, 0], "restitution": 0.5,
            "line": {"through": [-0.3, 0], "normal": [1, 0]}, "law": "0.1*sin(arm.phi)"}],
        "start": {"arm": {"phi": 2.4, "omega": 0}}, "until": 1, "every": 1}"#,
    );
    let error = driftless::Mechanism::new(&arm).expect_err("behind").to_string();
    assert!(
        error.contains("wall `stop` has its point") && error.contains("behind it at the start"),
        "{error}"
    );
    let refused = |law: &str, more: &str| {
        let text = format!(
            r#"{{"name": "ball", "gravity": [0, -{G}], "bars": [{{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.1}}],
            "points": [{{"name": "p", "body": "ball", "point": [0, 0]}}],
            "walls": [{{"name": "ground", "body": "ball", "point": [0, 0], {more}"restitution": 0, "line": {{"through": [0, 0], "normal": [0, 1]}}, "law": "{law}"}}],
            "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [0, 1], "velocity": [0, 0]}}}}, "until": 1, "every": 1}}"#
        );
        match parse_scene(&text, "test", &[]) {
            Err(error) => error.to_string(),
            Ok(scene) => Simulation::new(&scene).map(|_| ()).expect_err("no mechanism").to_string(),
        }
    };
    for (law, words) in [
        ("0.1 m*s*ball.omega", "depends on ball.omega"),
        ("p.y*1 s", "not m"),
        ("q.x", "q.x"),
        ("p.x + 2", "behind it at the start"),
    ] {
        let said = refused(law, "");
        assert!(said.contains(words), "{law}: {said}");
    }
    let said = refused("p.x", r#""friction": {"kinetic": 0.1}, "#);
    assert!(said.contains("it is a curve"), "{said}");
}

/// The same scene with every wall written as a formula of its own point's place: with a normal turned by 0.4 rad
/// and a travel that leaves `d + d³/size²` of the gap d, whose zeros and whose gradient there are those of the
/// line.
fn as_formulas(text: &str, size: f64) -> String {
    let mut scene: Value = serde_json::from_str(text).expect("JSON");
    let (mut points, walls) = (Vec::new(), scene["walls"].as_array_mut().expect("walls"));
    for (i, wall) in walls.iter_mut().enumerate() {
        let pair = |value: &Value| [0, 1].map(|k| value[k].as_f64().expect("a number"));
        let ([x, y], [u, v]) = (pair(&wall["line"]["through"]), pair(&wall["line"]["normal"]));
        let (u, v) = (u / u.hypot(v), v / u.hypot(v));
        let (s, c) = 0.4_f64.sin_cos();
        let turned = [c * u - s * v, s * u + c * v];
        let along = |[a, b]: [f64; 2]| format!("(({a:?})*(w{i}.x - ({x:?})) + ({b:?})*(w{i}.y - ({y:?})))");
        let (gap, other) = (along([u, v]), along(turned));
        wall["law"] = json!(format!("{other} - {gap} - {gap}^3/{:?}", size * size));
        wall["line"]["normal"] = json!(turned);
        points.push(json!({"name": format!("w{i}"), "body": wall["body"], "point": wall["point"]}));
    }
    scene["points"] = json!(points);
    scene.to_string()
}

/// Random mechanisms of all kinds with walls, some with dry friction in hinges: whoever writes the walls as curves
/// gets the same motion, and the same forces in hinges.
/// `SEEDS=2000 cargo test --test physics -- state_walls::random --nocapture`
#[test]
fn random_walls_written_as_curves_are_the_same_walls() {
    let count = std::env::var("SEEDS").ok().and_then(|text| text.parse().ok()).unwrap_or(48);
    let (mut kinds, mut impacts, mut holds, mut worst) = (BTreeMap::new(), 0, 0, 0.0_f64);
    let (mut compared, mut stopped, mut lost) = (0, 0, 0);
    let (mut sliding, mut loads) = (0, [0; 2]);
    for seed in 0..count {
        let kind = [Kind::Wall, Kind::PlasticWall, Kind::ElasticWall, Kind::TouchingWall][seed as usize % 4];
        let other = Kind::ALL[seed as usize / 4 % Kind::ALL.len()];
        let wanted = if kind.goes_with(other) { vec![kind, other] } else { vec![kind] };
        let made = scene_with(seed, &wanted);
        let horizon = 4.0 * made.scales.time;
        let ended = |text: &str, method: MethodId, tolerance: f64| {
            let mut scene =
                parse_scene(text, "random", &[]).unwrap_or_else(|error| panic!("{seed}: {error}\n{text}"));
            (scene.until, scene.every) = (horizon, horizon);
            let mut dice = Dice::new(seed ^ 0x00f1_1c00);
            if dice.chance(0.4) {
                relations::with_friction(&mut scene, &mut dice, made.scales.length);
            }
            let hinges = scene.hinges[..scene.own_hinges()].iter();
            let forces = hinges.flat_map(|hinge| ["fx", "fy"].map(|axis| format!("{}.{axis}", hinge.name)));
            scene.outputs = forces.map(|name| Output::parse(&name)).collect();
            run(&scene, &adaptive(method, tolerance))
        };
        let method = [MethodId::Dp8, MethodId::Taylor, MethodId::Radau(5)][seed as usize / 3 % 3];
        let [loose, tight] = [1e-8, 1e-10].map(|tolerance| ended(&made.text, method, tolerance));
        let curves = ended(&as_formulas(&made.text, made.scales.length), method, 1e-10);
        if tight.stop.is_some() || loose.stop.is_some() {
            stopped += 1;
            continue;
        }
        assert!(curves.stop.is_none(), "{seed} {method}: {:?}\n{}", curves.stop, made.text);
        let off = |one: &Outcome, other: &Outcome| {
            let ends = one
                .last
                .phi
                .iter()
                .chain(&one.last.omega)
                .zip(other.last.phi.iter().chain(&other.last.omega));
            ends.map(|(a, b)| (a - b).abs()).fold(0.0_f64, f64::max)
        };
        // Where the motion has lost all accuracy there is nothing to compare.
        let own = off(&loose, &tight);
        if own > 1e-3 {
            lost += 1;
            continue;
        }
        compared += 1;
        let (here, most) = (off(&curves, &tight), 10.0 * own + 1e-8);
        worst = worst.max(here / most);
        assert!(here < most, "{seed} {method}: {here:e} {most:e}\n{}", made.text);
        // How many bounces there are before a point stays depends on the unit of its gap, and so does whether
        // a point that hangs at its wall strikes it.
        if tight.holds.is_empty() && curves.holds.is_empty() {
            let least = 1e-3 * made.scales.length / made.scales.time;
            let struck = |outcome: &Outcome| outcome.impacts.iter().filter(|it| -it.approach > least).count();
            let [one, other] = [&curves, &tight].map(struck);
            assert_eq!(one, other, "{seed} {method} {:?} {:?}\n{}", curves.impacts, tight.impacts, made.text);
        }
        sliding += usize::from(tight.last.friction > 0.0);
        let apart = |one: &Outcome| {
            let pairs = one.last.outputs.iter().zip(&tight.last.outputs);
            pairs.map(|(one, other)| (one - other).abs() / made.scales.force).fold(0.0_f64, f64::max)
        };
        if apart(&loose) < 1e-4 {
            let is_held = tight.holds.iter().any(|held| held.until.is_none());
            loads[usize::from(is_held)] += 1;
            let (here, most) = (apart(&curves), 10.0 * apart(&loose) + 1e-5);
            assert!(here < most, "{seed} {method}: forces {here:e} {most:e}\n{}", made.text);
        }
        let lost = (curves.impact_loss - tight.impact_loss).abs();
        let energy = made.scales.force * made.scales.length;
        assert!(lost < most.sqrt() * energy, "{seed} {method}: {lost:e} J\n{}", made.text);
        impacts += tight.impact_count;
        holds += tight.persistent_contact_count;
        for kind in made.kinds {
            *kinds.entry(format!("{kind:?}")).or_insert(0) += 1;
        }
    }
    println!(
        "{compared} compared, {stopped} stopped, {lost} lost; {impacts} impacts, {holds} holds, {worst:.2} of the bound; {kinds:?}"
    );
    println!("{sliding} with friction; forces of {loads:?}, the latter on walls");
    assert!(compared > count * 2 / 3 && impacts > count / 2 && sliding > 5 && loads[1] > 5);
}
