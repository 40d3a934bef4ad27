//! Dry friction: against closed forms, and against equations in absolute coordinates written here.

use super::formulas::{adaptive, run, scene};
use driftless::Mechanism;
use driftless::run::{Limits, MethodId, Outcome, Plan, Request, Run, Running, integrate};
use driftless::scene::Scene;
use driftless::stepping::Cause;
use nalgebra::{DMatrix, DVector, Vector2};
use std::f64::consts::PI;
use std::sync::Arc;

const G: f64 = 9.81;
/// How far a run may be from the truth, and its balance from zero.
const CLOSE: f64 = 1e-10;

fn methods() -> [Request; 5] {
    [
        adaptive(MethodId::Taylor, 1e-14),
        adaptive(MethodId::Dp5, 1e-14),
        adaptive(MethodId::Dp8, 1e-14),
        adaptive(MethodId::Radau(3), 1e-13),
        adaptive(MethodId::Radau(5), 1e-13),
    ]
}

/// Runs a scene by all methods; the energy balance must close, friction included.
pub fn runs(text: &str) -> Vec<Outcome> {
    let scene = scene(text);
    methods()
        .into_iter()
        .map(|request| {
            let outcome = run(&scene, &request);
            assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
            assert!(outcome.drift.energy.max < CLOSE, "{:?}: {:e}", request.method, outcome.drift.energy.max);
            outcome
        })
        .collect()
}

pub fn near(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() < CLOSE, "{what}: {found} and not {expected}");
}

/// A block of 2 kg on a rail at an angle, where asked for on a spring that is at rest at 0.
fn block(angle: f64, start: [f64; 2], stiffness: f64, friction: &str, until: f64) -> String {
    let (sin, cos) = angle.sin_cos();
    let at = |along: f64| [along * cos, along * sin];
    let ([x, y], [vx, vy], [ax, ay]) = (at(start[0]), at(start[1]), at(-1.0));
    let spring = format!(
        r#"{{"name": "k", "between": [{{"body": "ground", "point": [{ax}, {ay}]}}, {{"body": "block", "point": [0, 0]}}],
            "stiffness": {stiffness}, "free_length": 1}}"#
    );
    let spring = if stiffness > 0.0 { spring } else { String::new() };
    format!(
        r#"{{"name": "block", "gravity": [0, -{G}],
        "bars": [{{"name": "block", "mass": 2, "centre": [0, 0], "inertia": 0.01, "length": 0.2}}],
        "sliders": [{{"name": "S", "point": {{"body": "block", "point": [0, 0]}}, "angle": "locked",
            "rail": {{"body": "ground", "point": [0, 0], "direction": [{cos}, {sin}]}}, "friction": {friction}}}],
        "springs": [{spring}],
        "start": {{"block": {{"phi": 0, "omega": 0, "origin": [{x}, {y}], "velocity": [{vx}, {vy}]}}}},
        "until": {until}, "every": {until}}}"#
    )
}

#[test]
fn an_oscillator_loses_the_same_amplitude_every_half_turn_and_sticks() {
    // x'' + 25 x = -sign(x') mu g: every half turn takes 2 mu g / 25 off the amplitude, until the spring is too weak.
    let (mu, mu0, half) = (0.2, 0.3, PI / 5.0);
    let step = mu * G / 25.0;
    let mut places = vec![0.5_f64];
    while 25.0 * places[places.len() - 1].abs() > mu0 * G {
        let last = places[places.len() - 1];
        places.push(-last.signum() * (last.abs() - 2.0 * step));
    }
    let path: f64 = places.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
    for outcome in runs(&block(0.0, [0.5, 0.0], 50.0, r#"{"kinetic": 0.2, "static": 0.3}"#, 5.0)) {
        near(outcome.last.phi[1], places[places.len() - 1], "rests at");
        assert!(outcome.last.omega[1].abs() < 1e-15);
        near(outcome.last.friction, mu * 2.0 * G * path, "lost");
        let stuck = outcome.frictions.last().expect("it sticks");
        assert_eq!((stuck.mode.as_str(), stuck.name.as_str()), ("sticks", "S"));
        near(stuck.t, (places.len() - 1) as f64 * half, "sticks at");
        // It slides from the start on, turns where the spring is strong enough, and sticks where it is not.
        assert_eq!(outcome.friction_count, 2);
    }
}

/// A bar turned by a motor on a hinge with friction: at 5.7 rad/s its weight and its inertia nearly cancel once a turn,
/// and the force of the hinge, a root, has its singularities next to that moment.
#[test]
fn a_driven_bar_loses_what_its_hinge_carries() {
    for rate in [4.0, 5.7, 6.0] {
        let text = format!(
            r#"{{"name": "driven", "gravity": [0, -{G}],
            "bars": [{{"name": "b", "mass": 1, "centre": [0.3, 0], "inertia": 0.05, "length": 0.6}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}],
                "friction": {{"radius": 0.05, "kinetic": 0.3}}}}],
            "motors": [{{"name": "M", "body": "b", "law": {{"start": 0, "rate": {rate}}}}}],
            "start": {{}}, "until": 3, "every": 3}}"#
        );
        let force = |t: f64| {
            let (s, c) = (rate * t).sin_cos();
            let inertia = 0.3 * rate * rate;
            (inertia * c).hypot(G - inertia * s)
        };
        let (steps, mut sum) = (300_000, 0.0);
        for k in 0..steps {
            // The rule of the midpoints.
            sum += force(3.0 * (f64::from(k) + 0.5) / f64::from(steps));
        }
        let lost = 0.3 * 0.05 * rate * sum * 3.0 / f64::from(steps);
        for outcome in runs(&text) {
            near(outcome.last.friction, lost, "lost");
        }
    }
}

/// A disc on a shaft that turns at 0.5 rad/s, held back by a torsion spring, without weight: it begins to slide with
/// no force to tell which way, and swings by 0.5 sin(w t)/w.
#[test]
fn without_a_load_there_is_no_friction() {
    let text = std::fs::read_to_string("examples/scenes/stick_slip.json").expect("a shipped scene");
    let text = text.replace(r#""until": 12"#, r#""until": 1.7"#);
    for gravity in ["0", "-1e-30", "-1e-9"] {
        for outcome in runs(&text.replace("-9.81", gravity)) {
            let w = 10.0_f64.sqrt();
            near(outcome.last.phi[1], 0.5 * (w * 1.7).sin() / w, "angle");
            assert!(outcome.last.friction < 1e-8 && outcome.friction_count <= 2, "{:?}", outcome.frictions);
        }
    }
}

#[test]
fn a_block_on_a_slope_stays_up_to_the_angle_of_friction() {
    let friction = r#"{"kinetic": 0.3, "static": 0.4}"#;
    let angle = 0.4_f64.atan();
    for outcome in runs(&block(angle - 1e-6, [0.0, 0.0], 0.0, friction, 2.0)) {
        assert!(outcome.last.omega.iter().all(|rate| rate.abs() < 1e-15));
        assert_eq!(outcome.last.friction, 0.0);
    }
    let angle = angle + 1e-6;
    let a = G * (0.3 * angle.cos() - angle.sin());
    for outcome in runs(&block(angle, [0.0, 0.0], 0.0, friction, 2.0)) {
        near(outcome.last.phi[1], 2.0 * a * angle.cos(), "x");
        near(outcome.last.friction, 0.3 * 2.0 * G * angle.cos() * 2.0 * -a, "lost");
    }
    // Pushed uphill it comes to rest and stays, or slides back.
    for (angle, stays) in [(0.35_f64, true), (0.45, false)] {
        let (sin, cos) = angle.sin_cos();
        let (up, down) = (G * (sin + 0.3 * cos), G * (sin - 0.3 * cos));
        let (top, rest) = (1.0 / up, 0.5 / up);
        let x = if stays { rest } else { rest - 0.5 * down * (2.0 - top) * (2.0 - top) };
        for outcome in runs(&block(angle, [0.0, 1.0], 0.0, friction, 2.0)) {
            near(outcome.last.phi[1], x * cos, "x");
        }
    }
}

/// A disc of 2 kg on a shaft that turns at 0.5 rad/s, held back by a torsion spring to the ground.
const DISC: &str = r#"{"name": "disc", "gravity": [0, -9.81],
    "bars": [{"name": "shaft", "mass": 1, "centre": [0, 0], "inertia": 0.1},
             {"name": "disc", "mass": 2, "centre": [0, 0], "inertia": 0.3}],
    "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "shaft", "point": [0, 0]}]},
               {"name": "B", "between": [{"body": "shaft", "point": [0, 0]}, {"body": "disc", "point": [0, 0]}],
                "friction": {"radius": 0.1, "kinetic": 0.4, "static": 0.7}}],
    "motors": [{"name": "m", "body": "shaft", "law": {"start": 0, "rate": 0.5}}],
    "torsion_springs": [{"name": "k", "body": "disc", "stiffness": 3, "free_angle": 0}],
    "start": {"disc": {"phi": 0, "omega": 0.5}}, "until": 12, "every": 12}"#;

#[test]
fn a_disc_on_a_turning_shaft_sticks_and_slips_in_turns() {
    let (inertia, k, rate, weight) = (0.3, 3.0, 0.5, 2.0 * G * 0.1);
    let [slipping, sticking] = [0.4 * weight, 0.7 * weight];
    let omega = f64::sqrt(k / inertia);
    // It sticks up to k phi = sticking, then swings about slipping/k until it is as fast as the shaft again.
    let (high, middle) = (sticking / k, slipping / k);
    let phase = (rate / omega).atan2(high - middle);
    // It is as fast as the shaft again at the mirrored place.
    let (slip_time, low) = ((PI + 2.0 * phase) / omega, 2.0 * middle - high);
    let (mut t, mut phi) = (0.0, 0.0);
    let mut events = vec![];
    let end = loop {
        let break_at = t + (high - phi) / rate;
        if break_at > 12.0 {
            break (phi + rate * (12.0 - t), rate);
        }
        events.push((break_at, "slides"));
        if break_at + slip_time > 12.0 {
            let s = 12.0 - break_at;
            let (sin, cos) = (omega * s).sin_cos();
            break (
                middle + (high - middle) * cos + rate / omega * sin,
                rate * cos - omega * (high - middle) * sin,
            );
        }
        t = break_at + slip_time;
        events.push((t, "sticks"));
        phi = low;
    };
    // The error falls with the tolerance, whatever sticks and slips on the way.
    for method in [MethodId::Dp5, MethodId::Dp8, MethodId::Radau(3), MethodId::Radau(5)] {
        let errors: Vec<[f64; 2]> = (5..12)
            .map(|power| {
                let outcome = run(&scene(DISC), &adaptive(method, 10_f64.powi(-power)));
                [-f64::from(power), (outcome.last.phi[1] - end.0).abs().max(1e-14).log10()]
            })
            .collect();
        let slope = slope(&errors);
        println!("{method}: error as tolerance^{slope:.2}, {:.1e} at 1e-11", 10_f64.powf(errors[6][1]));
        assert!((slope - 1.0).abs() < 0.35, "{method}: {slope} {errors:?}");
    }
    for outcome in runs(DISC) {
        near(outcome.last.phi[1], end.0, "phi");
        near(outcome.last.omega[1], end.1, "omega");
        let found: Vec<_> = outcome.frictions.iter().skip(1).collect();
        assert_eq!(found.len(), events.len(), "{found:?} {events:?}");
        for (found, (t, mode)) in found.iter().zip(&events) {
            assert_eq!(found.mode, *mode);
            near(found.t, *t, mode);
        }
    }
}

/// A block on a rail under a force across it that swings: |N| has corners that are no transitions.
#[test]
fn a_force_across_a_rail_that_changes_its_sign_brakes_by_its_size() {
    let (mass, mu, force, rate, speed) = (2.0, 0.2, 30.0, 3.0, 5.0);
    let text = format!(
        r#"{{"name": "block", "gravity": [0, 0],
        "bars": [{{"name": "block", "mass": {mass}, "centre": [0, 0], "inertia": 0.01, "length": 0.2}}],
        "sliders": [{{"name": "S", "point": {{"body": "block", "point": [0, 0]}}, "angle": "locked",
            "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}, "friction": {{"kinetic": {mu}}}}}],
        "forces": [{{"name": "across", "body": "block", "point": [0, 0], "force": ["0", "{force}*cos({rate}*t)"]}}],
        "start": {{"block": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [{speed}, 0]}}}}, "until": 2.3, "every": 2.3}}"#
    );
    // After k half turns beyond the first quarter, the integral of |cos| is 2 k + 1 and what is left.
    let turned: f64 = rate * 2.3;
    let halves = ((turned + PI / 2.0) / PI).floor();
    let swept = 2.0 * halves + (turned - halves * PI).sin();
    let expected = speed - mu * force / mass / rate * swept;
    for (method, within) in [(MethodId::Taylor, 1e-12), (MethodId::Dp8, 1e-8)] {
        let outcome = run(&scene(&text), &adaptive(method, 1e-13));
        assert!(outcome.stop.is_none(), "{method}: {:?}", outcome.stop);
        let found = outcome.last.omega[1];
        assert!((found - expected).abs() < within, "{method}: {found} and not {expected}");
        assert!((outcome.last.friction - mass * (speed * speed - expected * expected) / 2.0).abs() < 1e-7);
    }
}

/// A cart on a rail with a bar that whirls under it, and at times lifts it more than it weighs:
/// (M + m) x'' - m l sin(phi) phi'' = m l cos(phi) phi'² - mu |N|,  N = (M + m) g + m l (cos(phi) phi'' - sin(phi) phi'²).
#[test]
fn a_whirling_bar_presses_the_rail_of_its_cart_from_both_sides() {
    let (cart, bar, arm, mu) = (0.5, 1.0, 0.25, 0.2);
    let inertia = bar * arm * arm / 3.0;
    let text = format!(
        r#"{{"name": "whirl", "gravity": [0, -{G}], "bars": [
            {{"name": "b", "mass": {cart}, "centre": [0, 0], "inertia": 0.01, "length": 0.2}},
            {{"name": "c", "mass": {bar}, "centre": [{arm}, 0], "inertia": {inertia}, "length": 0.5}}],
        "hinges": [{{"name": "A", "between": [{{"body": "b", "point": [0, 0]}}, {{"body": "c", "point": [0, 0]}}]}}],
        "sliders": [{{"name": "S", "point": {{"body": "b", "point": [0, 0]}}, "angle": "locked",
            "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}, "friction": {{"kinetic": {mu}}}}}],
        "start": {{"b": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [20, 0]}}, "c": {{"phi": -1.5, "omega": 15.12}}}},
        "until": 1, "every": 0.05}}"#
    );
    let (mass, lever) = (cart + bar, bar * arm);
    let rate = |[_, v, phi, omega]: [f64; 4]| {
        let (sin, cos) = phi.sin_cos();
        let of_side = |side: f64| {
            let [a, b, c] = [mass, lever * (side * mu * cos - sin), -lever * sin];
            let d = inertia + lever * arm;
            let right = lever * cos * omega * omega - side * mu * (mass * G - lever * sin * omega * omega);
            let (first, second) = (right, -bar * G * arm * cos);
            let det = a * d - b * c;
            let turn = (a * second - c * first) / det;
            let normal = mass * G + lever * (cos * turn - sin * omega * omega);
            (normal * side, [v, (first * d - b * second) / det, omega, turn])
        };
        let (pressed, found) = of_side(1.0);
        if pressed >= 0.0 { found } else { of_side(-1.0).1 }
    };
    let (steps, mut y) = (200_000, [0.0, 20.0, -1.5, 15.12]);
    let h = 1.0 / f64::from(steps);
    let ahead = |y: [f64; 4], by: f64, k: [f64; 4]| std::array::from_fn(|i| y[i] + by * k[i]);
    for _ in 0..steps {
        let a = rate(y);
        let b = rate(ahead(y, 0.5 * h, a));
        let c = rate(ahead(y, 0.5 * h, b));
        let d = rate(ahead(y, h, c));
        y = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
    }
    for outcome in runs(&text) {
        for (found, expected) in [(outcome.last.phi[1], y[2]), (outcome.last.omega[1], y[3])] {
            let method = outcome.plan.method;
            assert!((found - expected).abs() < 1e-7, "{method}: {found} and not {expected}");
        }
    }
}

/// The complete elliptic integral of the second kind of a complementary modulus, by the arithmetic-geometric mean.
fn complete_elliptic(complement: f64) -> f64 {
    let (mut a, mut b, mut weight) = (1.0, complement, 0.5);
    let mut sum = weight * (1.0 - complement * complement);
    for _ in 0..8 {
        let c = 0.5 * (a - b);
        (a, b, weight) = (0.5 * (a + b), (a * b).sqrt(), 2.0 * weight);
        sum += weight * c * c;
    }
    0.5 * PI / a * (1.0 - sum)
}

/// A bar with its centre at c from a hinge with friction, which a motor turns n times at a rate w: the hinge carries
/// |N| = m |(A + g)² - 4 A g sin²(w t/2 + π/4)|^(1/2), A = c w², which nearly vanishes at the top, and loses
/// 4 n μ r m (A + g) E, whatever the motor adds to it.
#[test]
fn the_loss_beside_a_motor_is_as_accurate_as_the_tolerance() {
    let (m, c, mu, r, g, turns) = (2.0, 0.5, 0.25, 0.0625, 9.8125, 4.0);
    for rate in [4.4375, 4.43] {
        let until = 2.0 * PI * turns / rate;
        let scene = scene(&format!(
            r#"{{"name": "turned", "gravity": [0, -{g}],
            "bars": [{{"name": "b", "mass": {m}, "centre": [{c}, 0], "inertia": 0.1}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}],
                "friction": {{"radius": {r}, "kinetic": {mu}}}}}],
            "motors": [{{"name": "M", "body": "b", "law": {{"start": 0, "rate": {rate}}}}}],
            "start": {{}}, "until": {until}, "every": {until}}}"#
        ));
        let a = c * rate * rate;
        let lost = 4.0 * turns * mu * r * m * (a + g) * complete_elliptic((a - g).abs() / (a + g));
        for (method, tolerance) in [
            (MethodId::Taylor, 1e-6),
            (MethodId::Taylor, 1e-9),
            (MethodId::Taylor, 1e-12),
            (MethodId::Dp8, 1e-6),
            (MethodId::Dp8, 1e-10),
            (MethodId::Dp5, 1e-7),
        ] {
            let outcome = run(&scene, &adaptive(method, tolerance));
            let error = outcome.last.friction - lost;
            println!("{method:?} {tolerance:e} rate {rate}: {:.1} tolerances", error / lost / tolerance);
            assert!(
                error.abs() < 20.0 * tolerance * lost,
                "{method:?} {tolerance:e} at {rate} rad/s: {error:e} J"
            );
        }
    }
}

/// A hinge at a bar's centre of mass carries nothing, and has no friction.
#[test]
fn a_hinge_without_a_load_has_no_friction() {
    let text = r#"{"name": "idle", "gravity": [0, 0],
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}],
            "friction": {"radius": 0.05, "kinetic": 0.2}}],
        "start": {"b": {"phi": 0, "omega": 1}}, "until": 2, "every": 0.5}"#;
    for outcome in runs(text) {
        near(outcome.last.phi[0], 2.0, "angle");
        near(outcome.last.omega[0], 1.0, "rate");
    }
}

/// A bar that turns without weight is slowed as -k omega², wherever on it the hinge and the origin of its frame are:
/// N = m d sqrt(omega⁴ + alpha²), J alpha = -mu r N.
#[test]
fn a_hinge_anywhere_on_a_bar_slows_it_as_the_square_of_its_rate() {
    let (mass, inertia, lever, rate, until) = (2.0, 0.2, 0.05 * 0.4, 3.0, 2.0);
    // Of masses only what they are of one another counts, of however large forces friction is.
    for ([x, y], times) in [([0.0, 0.0], 1.0), ([0.2, 0.1], 1.0), ([-0.3, 0.25], 1.0), ([0.2, 0.1], 1e12)] {
        let text = format!(
            r#"{{"name": "turning", "gravity": [0, 0],
            "bars": [{{"name": "b", "mass": {}, "centre": [0.5, 0.1], "inertia": {}, "length": 1}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0.3, -1]}}, {{"body": "b", "point": [{x}, {y}]}}],
                "friction": {{"radius": 0.05, "kinetic": 0.4}}}}],
            "start": {{"b": {{"phi": 0.3, "omega": {rate}}}}}, "until": {until}, "every": 0.5}}"#,
            times * mass,
            times * inertia
        );
        let arm = f64::hypot(0.5 - x, 0.1 - y);
        let q = lever * mass * arm / (inertia + mass * arm * arm);
        let k = q / (1.0 - q * q).sqrt();
        for outcome in runs(&text) {
            near(outcome.last.omega[0], rate / (1.0 + k * rate * until), "rate");
            near(outcome.last.phi[0], 0.3 + (1.0 + k * rate * until).ln() / k, "angle");
        }
    }
}

/// A torque of t N·m turns a bar from rest, without weight: the force in its hinge begins with the first power
/// of time.
#[test]
fn a_force_in_a_hinge_may_begin_at_zero() {
    let (mass, centre, inertia, lever) = (1.0, 0.4, 0.1, 0.05 * 0.2);
    let text = format!(
        r#"{{"name": "spun_up", "gravity": [0, 0],
        "bars": [{{"name": "b", "mass": {mass}, "centre": [{centre}, 0], "inertia": {inertia}, "length": 1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}],
            "friction": {{"radius": 0.05, "kinetic": 0.2}}}}],
        "torques": [{{"name": "T", "body": "b", "torque": 1, "law": {{"start": 0, "rate": 1}}}}],
        "start": {{"b": {{"phi": 0, "omega": 0}}}}, "until": 2, "every": 0.5}}"#
    );
    // I alpha = t - lever m c sqrt(alpha² + omega⁴), by the classic Runge-Kutta method.
    let about = inertia + mass * centre * centre;
    let acceleration = |t: f64, omega: f64| {
        (0..14).fold(t / about, |alpha, _| (t - lever * mass * centre * alpha.hypot(omega * omega)) / about)
    };
    let (steps, mut phi, mut omega) = (20_000, 0.0, 0.0);
    let h = 2.0 / f64::from(steps);
    for step in 0..steps {
        let t = h * f64::from(step);
        let a = acceleration(t, omega);
        let b = acceleration(t + 0.5 * h, omega + 0.5 * h * a);
        let c = acceleration(t + 0.5 * h, omega + 0.5 * h * b);
        let d = acceleration(t + h, omega + h * c);
        phi += h * omega + h * h * (a + b + c) / 6.0;
        omega += h * (a + 2.0 * b + 2.0 * c + d) / 6.0;
    }
    for outcome in runs(&text) {
        near(outcome.last.phi[0], phi, "angle");
        near(outcome.last.omega[0], omega, "rate");
    }
}

/// Slope of the least-squares line.
fn slope(points: &[[f64; 2]]) -> f64 {
    let n = points.len() as f64;
    let mean = [0, 1].map(|i| points.iter().map(|p| p[i]).sum::<f64>() / n);
    let both: f64 = points.iter().map(|p| (p[0] - mean[0]) * (p[1] - mean[1])).sum();
    both / points.iter().map(|p| (p[0] - mean[0]).powi(2)).sum::<f64>()
}

/// A ball that bounces and slides: its centre meets the floor.
fn ball(impact: &str, e: f64, velocity: [f64; 2], until: f64) -> String {
    format!(
        r#"{{"name": "ball", "gravity": [0, -{G}], "bars": [{{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 0.1}}],
        "walls": [{{"name": "floor", "body": "ball", "point": [0, 0], "line": {{"through": [0, 0], "normal": [0, 1]}},
            "restitution": {e}, "friction": {{"kinetic": 0.2, "impact": "{impact}"}}}}],
        "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [{}, {}]}}}}, "until": {until}, "every": {until}}}"#,
        velocity[0], velocity[1]
    )
}

#[test]
fn a_ball_bounces_to_rest_and_slides_to_a_stop_in_closed_form() {
    // Every bounce takes mu (1+e) v off the sliding velocity; bounces end at t = 2 v / (g (1-e)), then mu g decelerates.
    let (e, v, u, mu) = (0.5, 1.0, 2.5, 0.2);
    for law in ["poisson", "newton"] {
        let ends = 2.0 * v / (G * (1.0 - e));
        // At the start it leaves the floor: the first impact is at e^0 v.
        let slides = u - mu * (1.0 + e) * v / (1.0 - e);
        let mut x = 0.0;
        let (mut speed, mut rate) = (v, u);
        for _ in 0..60 {
            x += rate * 2.0 * speed / G;
            rate -= mu * (1.0 + e) * speed;
            speed *= e;
        }
        assert!(slides > 0.0 && (rate - slides).abs() < 1e-12);
        let stops = ends + slides / (mu * G);
        x += 0.5 * slides * slides / (mu * G);
        for outcome in runs(&ball(law, e, [u, v], stops + 0.5)) {
            assert!((outcome.last.phi[1] - x).abs() < 1e-10, "{} {x}", outcome.last.phi[1]);
            assert!(outcome.last.omega.iter().all(|rate| rate.abs() < 1e-15));
            let last = outcome.frictions.last().expect("it sticks");
            assert!(last.mode == "sticks" && (last.t - stops).abs() < 1e-10, "{last:?} {stops}");
            let lost = outcome.last.friction + outcome.impact_loss;
            assert!((lost - (u * u + v * v)).abs() < 1e-8, "{lost}");
        }
    }
}

/// A rod of 1 m and 1 kg with its lower end on the floor.
pub fn rod(angle: f64, omega: f64, slide: f64, mu: f64, until: f64) -> String {
    format!(
        r#"{{"name": "rod", "gravity": [0, -{G}], "bars": [{{"name": "rod", "mass": 1, "centre": [0.5, 0], "inertia": 0.08333333333333333, "length": 1}}],
        "walls": [{{"name": "floor", "body": "rod", "point": [0, 0], "line": {{"through": [0, 0], "normal": [0, 1]}},
            "restitution": 0, "friction": {{"kinetic": {mu}}}}}],
        "start": {{"rod": {{"phi": {angle}, "omega": {omega}, "origin": [0, 0], "velocity": [{slide}, 0]}}}}, "until": {until}, "every": {until}}}"#
    )
}

/// N and the accelerations of a rod whose lower end slides: (x'', phi'', N).
pub fn sliding_rod(phi: f64, omega: f64, slide: f64, mu: f64) -> [f64; 3] {
    let (sin, cos) = phi.sin_cos();
    let inertia = 1.0 / 12.0;
    // Centre: (x + cos/2, sin/2).  Forces on the tip: (-s mu N, N); torque about the centre.
    let s = slide.signum();
    let lever = -0.5 * cos - s * mu * 0.5 * sin;
    // y_c'' = (cos phi'' - sin omega²)/2 = N - g,   I phi'' = N lever.
    let n = (G - 0.5 * sin * omega * omega) / (1.0 - 0.5 * cos * lever / inertia);
    let alpha = n * lever / inertia;
    [-s * mu * n + 0.5 * (sin * alpha + cos * omega * omega), alpha, n]
}

/// Integrates x, phi and their rates for `time` by the classical method of order four.
pub fn integrated(mut y: [f64; 4], time: f64, accelerations: impl Fn([f64; 4]) -> [f64; 2]) -> [f64; 4] {
    let h = time / 20_000.0;
    let rate = |y: [f64; 4]| {
        let [x, alpha] = accelerations(y);
        [y[2], y[3], x, alpha]
    };
    let add = |y: [f64; 4], k: [f64; 4], h: f64| std::array::from_fn(|i| y[i] + h * k[i]);
    for _ in 0..20_000 {
        let a = rate(y);
        let b = rate(add(y, a, 0.5 * h));
        let c = rate(add(y, b, 0.5 * h));
        let d = rate(add(y, c, h));
        y = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
    }
    y
}

/// A table that goes down as -3 t³ leaves a ball where 18 t = g, and that falls freely from then on: on a rail,
/// which leaves friction nothing to do, by itself, and while it slides.
#[test]
fn a_table_that_falls_away_lets_a_ball_with_friction_go() {
    let rail = r#""sliders": [{"name": "rail", "point": {"body": "ball", "point": [0, 0]},
        "rail": {"body": "ground", "point": [0, 0], "direction": [0, 1]}}],"#;
    let left = G / 18.0;
    let s = 1.0 - left;
    let y = -3.0 * left.powi(3) - 9.0 * left * left * s - 0.5 * G * s * s;
    for (rail, along) in [(rail, 0.0), ("", 0.0), ("", 4.0)] {
        let text = format!(
            r#"{{"name": "ball", "gravity": [0, -{G}], {rail}
            "bars": [{{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 0.2}}],
            "walls": [{{"name": "table", "body": "ball", "point": [0, 0], "line": {{"through": [0, 0], "normal": [0, 1]}},
                "restitution": 0, "friction": {{"kinetic": 0.3}}, "law": "-3*t^3"}}],
            "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [{along}, 0]}}}},
            "until": 1, "every": 1}}"#
        );
        for outcome in runs(&text) {
            near(outcome.last.phi[2], y, "falls to");
            let gone = outcome.frictions.last().expect("it is let go");
            assert_eq!(gone.mode, "apart");
            assert!((gone.t - left).abs() < 1e-7, "{} {left}", gone.t);
        }
    }
}

#[test]
fn a_rod_slides_on_its_end_as_lagrange_says() {
    let (mu, until) = (0.3, 0.25);
    let y = integrated([0.0, 1.1, 3.0, 0.4], until, |y| {
        let [x, alpha, n] = sliding_rod(y[1], y[3], y[2], mu);
        assert!(n > 0.0);
        [x, alpha]
    });
    for outcome in runs(&rod(1.1, 0.4, 3.0, mu, until)) {
        near(outcome.last.phi[0], y[1], "phi");
        near(outcome.last.phi[1], y[0], "x");
        near(outcome.last.omega[1], y[2], "slides");
    }
}

#[test]
fn painleves_paradox_is_named() {
    // A = 1 + 3 cos² - 3 mu sin cos < 0 where the tip is pushed into the rod: it moves to the left of what leans left.
    let (phi, mu) = (PI - 1.1_f64, 2.0);
    let (sin, cos) = phi.sin_cos();
    assert!(1.0 + 3.0 * cos * cos + 3.0 * mu * sin * cos < 0.0);
    // At rest it is pressed: no force fits.  Fast it would leave without a force: two motions fit.
    for (omega, words) in [(0.0, "inconsistent"), (8.0, "indeterminate")] {
        for request in methods() {
            let outcome = run(&scene(&rod(phi, omega, 1.0, mu, 0.2)), &request);
            let stop = outcome.stop.expect("no motion");
            assert_eq!(stop.cause.word(), "friction");
            assert!(stop.what.contains(words), "{omega}: {stop}");
        }
    }
    // The other way friction pulls the tip out of the rod's way: nothing is wrong.
    for outcome in runs(&rod(phi, 0.0, -1.0, mu, 0.01)) {
        assert!(outcome.last.friction > 0.0);
    }
}

/// On a rail, which pulls as well as it presses, no force fits from the same coefficient on, whichever sign it is
/// given: N (1 + 3 cos² - 3 mu sin |cos|) = m g with friction by N > 0, and + with that by N < 0.
#[test]
fn on_a_rail_the_paradox_is_named_as_well() {
    for phi in [1.1_f64, 0.9, 1.35] {
        let critical = (1.0 + 3.0 * phi.cos().powi(2)) / (3.0 * phi.sin() * phi.cos());
        for (share, speed) in [(1.0 - 1e-7, -1.0), (1.0 + 1e-7, -1.0), (1.5, -1.0), (1.5, 1.0)] {
            let mu = critical * share;
            let text = format!(
                r#"{{"name": "rod", "gravity": [0, -{G}],
                "bars": [{{"name": "rod", "mass": 1, "centre": [0.5, 0], "inertia": {}, "length": 1}}],
                "sliders": [{{"name": "s", "point": {{"body": "rod", "point": [0, 0]}}, "friction": {{"kinetic": {mu}}},
                    "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}}}],
                "start": {{"rod": {{"phi": {phi}, "omega": 0, "origin": [0, 0], "velocity": [{speed}, 0]}}}},
                "until": 1e-12, "every": 1e-12}}"#,
                1.0 / 12.0
            );
            let is_paradox = speed < 0.0 && share > 1.0;
            for request in methods() {
                let said = run(&scene(&text), &request).stop.map(|stop| stop.what);
                let is_named = said.as_ref().is_some_and(|said| said.contains("inconsistent"));
                assert_eq!((is_named, said.is_none()), (is_paradox, !is_paradox), "{phi} {share}: {said:?}");
            }
            #[cfg(feature = "digits")]
            assert_eq!(super::many_digits_friction::goes_on(&text, "1e-12"), !is_paradox, "{phi} {share}");
        }
    }
}

/// Where 1 + 3 cos² = 3 mu sin |cos| the pressure on a uniform rod that is pushed over the floor grows without
/// bound; the least such coefficient is 4/3, where tan phi = 2.
#[test]
fn the_paradox_begins_at_the_published_coefficient() {
    let critical = |phi: f64| (1.0 + 3.0 * phi.cos().powi(2)) / (3.0 * phi.sin() * phi.cos().abs());
    let steepest = PI - 2.0_f64.atan();
    assert!((critical(steepest) - 4.0 / 3.0).abs() < 1e-15);
    // Beyond omega² sin phi = 2 g the tip would lift off without a force.
    let lifts = (2.0 * G / steepest.sin()).sqrt();
    for phi in [steepest, PI - 0.9, PI - 1.35] {
        for (share, omega) in [(1.0 - 1e-7, 0.0), (1.0 + 1e-7, 0.0), (1.0 + 1e-7, 1.5 * lifts)] {
            for request in methods() {
                let outcome = run(&scene(&rod(phi, omega, 1.0, critical(phi) * share, 1e-12)), &request);
                let said = outcome.stop.map(|stop| stop.what);
                match (share > 1.0, omega > 0.0) {
                    (false, _) => assert_eq!(said, None, "{phi}"),
                    (_, false) => assert!(
                        said.as_ref().is_some_and(|said| said.contains("inconsistent")),
                        "{phi}: {said:?}"
                    ),
                    (_, true) => assert!(
                        said.as_ref().is_some_and(|said| said.contains("indeterminate")),
                        "{phi}: {said:?}"
                    ),
                }
            }
        }
    }
    // Below 4/3 no angle has it.
    for step in 1..60 {
        let phi = PI * (0.5 + f64::from(step) / 120.0);
        let outcome = run(&scene(&rod(phi, 0.0, 1.0, 4.0 / 3.0 * (1.0 - 1e-7), 1e-12)), &methods()[0]);
        assert!(outcome.stop.is_none(), "{phi}: {:?}", outcome.stop);
    }
}

/// A mechanism in absolute coordinates (x, y, phi of every centre), its joints by multipliers.
pub struct Absolute {
    pub mass: Vec<[f64; 2]>,
    pub pins: Vec<Pin>,
    pub rails: Vec<Rail>,
}

/// A point of one body on a point of another or of the ground, with mu r.
pub struct Pin {
    bodies: [Option<usize>; 2],
    points: [Vector2<f64>; 2],
    friction: f64,
}

/// A point of a body on a line of another, with mu.
pub struct Rail {
    body: usize,
    point: Vector2<f64>,
    rail: usize,
    origin: Vector2<f64>,
    direction: Vector2<f64>,
    friction: f64,
}

fn turned(v: Vector2<f64>, phi: f64) -> Vector2<f64> {
    let (sin, cos) = phi.sin_cos();
    Vector2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y)
}

fn left(v: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-v.y, v.x)
}

impl Absolute {
    /// Jacobian (rows × 3n), what is left of C'' at rest, and the directions along the rails.
    fn linearised(
        &self,
        q: &DVector<f64>,
        v: &DVector<f64>,
    ) -> (DMatrix<f64>, DVector<f64>, Vec<DVector<f64>>) {
        let n = self.mass.len();
        let rows = 2 * self.pins.len() + self.rails.len();
        let mut g = DMatrix::zeros(rows, 3 * n);
        let mut gamma = DVector::zeros(rows);
        // Arm, velocity and centripetal acceleration of a point.
        let point = |k: usize, p: Vector2<f64>| {
            let arm = turned(p, q[3 * k + 2]);
            let w = v[3 * k + 2];
            let place = Vector2::new(q[3 * k], q[3 * k + 1]) + arm;
            (place, arm, Vector2::new(v[3 * k], v[3 * k + 1]) + left(arm) * w, -arm * w * w)
        };
        for (i, pin) in self.pins.iter().enumerate() {
            for (side, sign) in [(0, -1.0), (1, 1.0)] {
                let Some(k) = pin.bodies[side] else { continue };
                let (_, arm, _, centripetal) = point(k, pin.points[side]);
                g[(2 * i, 3 * k)] += sign;
                g[(2 * i + 1, 3 * k + 1)] += sign;
                g[(2 * i, 3 * k + 2)] += sign * left(arm).x;
                g[(2 * i + 1, 3 * k + 2)] += sign * left(arm).y;
                gamma[2 * i] += sign * centripetal.x;
                gamma[2 * i + 1] += sign * centripetal.y;
            }
        }
        let mut along = Vec::new();
        for (i, rail) in self.rails.iter().enumerate() {
            let row = 2 * self.pins.len() + i;
            let (at, arm, speed, centripetal) = point(rail.body, rail.point);
            let (from, base, base_speed, base_centripetal) = point(rail.rail, rail.origin);
            let (d, w) = (turned(rail.direction, q[3 * rail.rail + 2]), v[3 * rail.rail + 2]);
            let (normal, span, relative) = (left(d), at - from, speed - base_speed);
            let mut tangent = DVector::zeros(3 * n);
            for (direction, to_row) in [(normal, true), (d, false)] {
                let mut put = |column: usize, value: f64| match to_row {
                    true => g[(row, column)] += value,
                    false => tangent[column] += value,
                };
                put(3 * rail.body, direction.x);
                put(3 * rail.body + 1, direction.y);
                put(3 * rail.body + 2, direction.dot(&left(arm)));
                put(3 * rail.rail, -direction.x);
                put(3 * rail.rail + 1, -direction.y);
                put(3 * rail.rail + 2, -direction.dot(&left(base)) + left(direction).dot(&span));
            }
            gamma[row] = normal.dot(&(centripetal - base_centripetal))
                + 2.0 * w * left(normal).dot(&relative)
                - w * w * normal.dot(&span);
            along.push(tangent);
        }
        (g, gamma, along)
    }

    /// The forces of friction by the multipliers.
    fn friction(&self, v: &DVector<f64>, multipliers: &DVector<f64>, along: &[DVector<f64>]) -> DVector<f64> {
        let mut next = DVector::zeros(v.len());
        for (i, pin) in self.pins.iter().enumerate() {
            let force = multipliers[2 * i].hypot(multipliers[2 * i + 1]);
            let rate = |body: Option<usize>| body.map_or(0.0, |k| v[3 * k + 2]);
            let spin = rate(pin.bodies[1]) - rate(pin.bodies[0]);
            for (side, sign) in [(0, 1.0), (1, -1.0)] {
                if let Some(k) = pin.bodies[side] {
                    next[3 * k + 2] += sign * spin.signum() * pin.friction * force;
                }
            }
        }
        for (i, (rail, tangent)) in self.rails.iter().zip(along).enumerate() {
            let force = multipliers[2 * self.pins.len() + i].abs();
            next -= tangent * (tangent.dot(v).signum() * rail.friction * force);
        }
        next
    }

    /// Accelerations, and the power lost in friction.
    fn accelerations(&self, q: &DVector<f64>, v: &DVector<f64>) -> (DVector<f64>, f64) {
        let n = self.mass.len();
        let (g, gamma, along) = self.linearised(q, v);
        let rows = gamma.len();
        let mut kkt = DMatrix::zeros(3 * n + rows, 3 * n + rows);
        for (k, [mass, inertia]) in self.mass.iter().enumerate() {
            kkt[(3 * k, 3 * k)] = *mass;
            kkt[(3 * k + 1, 3 * k + 1)] = *mass;
            kkt[(3 * k + 2, 3 * k + 2)] = *inertia;
        }
        kkt.view_mut((3 * n, 0), (rows, 3 * n)).copy_from(&g);
        kkt.view_mut((0, 3 * n), (3 * n, rows)).copy_from(&g.transpose());
        let factors = kkt.lu();
        let mut right = DVector::zeros(3 * n + rows);
        for k in 0..n {
            right[3 * k + 1] = -self.mass[k][0] * G;
        }
        right.rows_mut(3 * n, rows).copy_from(&-&gamma);
        // Friction follows from the multipliers, these from friction: the iteration contracts.
        let mut friction = DVector::zeros(3 * n);
        let mut power = 0.0;
        for _ in 0..60 {
            let mut all = right.clone();
            for k in 0..3 * n {
                all[k] += friction[k];
            }
            let found = factors.solve(&all).expect("regular");
            let next = self.friction(v, &found.rows(3 * n, rows).into_owned(), &along);
            let change = (&next - &friction).amax();
            friction = next;
            power = -friction.dot(v);
            if change <= 1e-13 * friction.amax() {
                return (found.rows(0, 3 * n).into_owned(), power);
            }
        }
        (DVector::from_element(3 * n, f64::NAN), power)
    }

    /// One step of the classical Runge–Kutta method, with the energy lost in it.
    pub fn step(&self, q: &DVector<f64>, v: &DVector<f64>, h: f64) -> (DVector<f64>, DVector<f64>, f64) {
        let (a1, p1) = self.accelerations(q, v);
        let (q2, v2) = (q + v * (0.5 * h), v + &a1 * (0.5 * h));
        let (a2, p2) = self.accelerations(&q2, &v2);
        let (q3, v3) = (q + &v2 * (0.5 * h), v + &a2 * (0.5 * h));
        let (a3, p3) = self.accelerations(&q3, &v3);
        let (q4, v4) = (q + &v3 * h, v + &a3 * h);
        let (a4, p4) = self.accelerations(&q4, &v4);
        (
            q + (v + &v2 * 2.0 + &v3 * 2.0 + &v4) * (h / 6.0),
            v + (a1 + a2 * 2.0 + a3 * 2.0 + a4) * (h / 6.0),
            h / 6.0 * (p1 + 2.0 * p2 + 2.0 * p3 + p4),
        )
    }

    /// Coordinates, rates and the energy lost after so many steps.
    fn end(&self, q: &[f64], v: &[f64], until: f64, steps: usize) -> (DVector<f64>, DVector<f64>, f64) {
        let (mut q, mut v, mut lost) = (DVector::from_row_slice(q), DVector::from_row_slice(v), 0.0);
        for _ in 0..steps {
            let (next_q, next_v, more) = self.step(&q, &v, until / steps as f64);
            (q, v, lost) = (next_q, next_v, lost + more);
        }
        (q, v, lost)
    }
}

pub fn pin(bodies: [Option<usize>; 2], points: [[f64; 2]; 2], friction: f64) -> Pin {
    Pin { bodies, points: points.map(|p| Vector2::new(p[0], p[1])), friction }
}

#[test]
fn a_double_pendulum_with_friction_in_both_hinges_moves_as_in_absolute_coordinates() {
    let until = 0.25;
    let text = format!(
        r#"{{"name": "pair", "gravity": [0, -{G}],
        "bars": [{{"name": "one", "mass": 1.5, "centre": [0.4, 0.05], "inertia": 0.1}},
                 {{"name": "two", "mass": 0.8, "centre": [0.3, 0], "inertia": 0.05}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "one", "point": [0, 0]}}], "friction": {{"radius": 0.05, "kinetic": 0.4}}}},
                   {{"name": "B", "between": [{{"body": "one", "point": [0.9, 0]}}, {{"body": "two", "point": [0, 0]}}], "friction": {{"radius": 0.04, "kinetic": 0.5}}}}],
        "start": {{"one": {{"phi": 0.2, "omega": -2}}, "two": {{"phi": 1.0, "omega": 3}}}}, "until": {until}, "every": {until}}}"#
    );
    let absolute = Absolute {
        mass: vec![[1.5, 0.1], [0.8, 0.05]],
        pins: vec![
            pin([None, Some(0)], [[0.0; 2], [-0.4, -0.05]], 0.05 * 0.4),
            pin([Some(0), Some(1)], [[0.5, -0.05], [-0.3, 0.0]], 0.04 * 0.5),
        ],
        rails: vec![],
    };
    let (one, two) = (turned(Vector2::new(0.4, 0.05), 0.2), turned(Vector2::new(0.3, 0.0), 1.0));
    let joint = turned(Vector2::new(0.9, 0.0), 0.2);
    let (v_one, v_two) = (left(one) * -2.0, left(joint) * -2.0 + left(two) * 3.0);
    let c = joint + two;
    let (q, v, lost) = absolute.end(
        &[one.x, one.y, 0.2, c.x, c.y, 1.0],
        &[v_one.x, v_one.y, -2.0, v_two.x, v_two.y, 3.0],
        until,
        4000,
    );
    assert!(lost > 0.1);
    for outcome in runs(&text) {
        near(outcome.last.phi[0], q[2], "phi of one");
        near(outcome.last.phi[1], q[5], "phi of two");
        near(outcome.last.omega[1], v[5], "omega of two");
        near(outcome.last.friction, lost, "lost");
    }
}

#[test]
fn a_loop_with_a_rail_on_a_moving_body_moves_as_in_absolute_coordinates() {
    // A crank whose pin slides in a slot of a rocker, friction in every joint.
    let until = 0.15;
    let tip = Vector2::new(0.2 * 0.3_f64.cos(), 0.2 * 0.3_f64.sin() + 0.6);
    let rocker = tip.y.atan2(tip.x);
    let text = format!(
        r#"{{"name": "rocker", "gravity": [0, -{G}],
        "bars": [{{"name": "crank", "mass": 1, "centre": [0.1, 0], "inertia": 0.02}},
                 {{"name": "rocker", "mass": 2, "centre": [0.4, 0], "inertia": 0.2}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "crank", "point": [0, 0]}}], "friction": {{"radius": 0.02, "kinetic": 0.3}}}},
                   {{"name": "B", "between": [{{"body": "ground", "point": [0, -0.6]}}, {{"body": "rocker", "point": [0, 0]}}], "friction": {{"radius": 0.03, "kinetic": 0.3}}}}],
        "sliders": [{{"name": "slot", "point": {{"body": "crank", "point": [0.2, 0]}}, "rail": {{"body": "rocker", "point": [0, 0], "direction": [1, 0]}}, "friction": {{"kinetic": 0.15}}}}],
        "start": {{"crank": {{"phi": 0.3, "omega": 9}}, "rocker": {{"phi": {rocker}}}}}, "until": {until}, "every": {until}}}"#
    );
    let spin = left(Vector2::new(tip.x, tip.y - 0.6)) * 9.0;
    let rate = left(tip).dot(&spin) / tip.norm_squared();
    let absolute = Absolute {
        mass: vec![[1.0, 0.02], [2.0, 0.2]],
        pins: vec![
            pin([None, Some(0)], [[0.0; 2], [-0.1, 0.0]], 0.02 * 0.3),
            pin([None, Some(1)], [[0.0, -0.6], [-0.4, 0.0]], 0.03 * 0.3),
        ],
        rails: vec![Rail {
            body: 0,
            point: Vector2::new(0.1, 0.0),
            rail: 1,
            origin: Vector2::new(-0.4, 0.0),
            direction: Vector2::new(1.0, 0.0),
            friction: 0.15,
        }],
    };
    let (one, two) = (turned(Vector2::new(0.1, 0.0), 0.3), turned(Vector2::new(0.4, 0.0), rocker));
    let (v_one, v_two) = (left(one) * 9.0, left(two) * rate);
    let (q, v, lost) = absolute.end(
        &[one.x, one.y, 0.3, two.x, two.y - 0.6, rocker],
        &[v_one.x, v_one.y, 9.0, v_two.x, v_two.y, rate],
        until,
        4000,
    );
    assert!(lost > 0.01 && q[2] - 0.3 > 0.5, "{lost} {}", q[2]);
    for outcome in runs(&text) {
        near(outcome.last.phi[0], q[2], "crank");
        near(outcome.last.phi[1], q[5], "rocker");
        near(outcome.last.omega[1], v[5], "rate");
        near(outcome.last.friction, lost, "lost");
    }
}

#[test]
fn what_cannot_be_is_refused_with_its_place() {
    let refused =
        |text: &str| driftless::scene::parse_scene(text, "test", &[]).expect_err("no scene").to_string();
    let text = block(0.0, [0.5, 0.0], 50.0, r#"{"kinetic": 0.3, "static": 0.2}"#, 5.0);
    let said = refused(&text);
    assert!(said.contains("sliders[0].friction.static") && said.contains("0.2"), "{said}");
    let said = refused(&text.replace("\"static\": 0.2", "\"radius\": 0.2"));
    assert!(said.contains("radius"), "{said}");
    let said = refused(&text.replace("0.3", "-0.3"));
    assert!(said.contains("-0.3"), "{said}");
    for method in ["dop853", "dopri5", "gauss8", "rattle4"] {
        let scene = scene(&text.replace("0.2", "0.4"));
        let mechanism = driftless::Mechanism::new(&scene).expect("a mechanism");
        let request = Request { method: Some(method.parse().expect("a method")), ..Request::default() };
        let refusal = driftless::run::Plan::new(&scene, &mechanism, &request).expect_err(method);
        assert!(refusal.to_string().contains("dry friction (slider S)"), "{refusal}");
    }
}

#[test]
fn runs_that_stick_and_slip_end_in_the_same_bits_however_sampled_and_resumed() {
    let methods = [(MethodId::Taylor, 1e-12), (MethodId::Dp8, 1e-11), (MethodId::Radau(5), 1e-10)];
    for request in methods.map(|(method, tolerance)| adaptive(method, tolerance)) {
        for text in [DISC.to_owned(), ball("poisson", 0.5, [2.5, 1.0], 3.0)] {
            let whole = run(&scene(&text), &request);
            assert!(whole.stop.is_none() && whole.friction_count > 1, "{:?}", whole.stop);
            let fine = Scene { every: 0.01, ..scene(&text) };
            let often = run(&fine, &request);
            assert_eq!(whole.last.phi, often.last.phi, "{:?}", request.method);
            assert_eq!(whole.last.friction.to_bits(), often.last.friction.to_bits());
            let mechanism = Arc::new(Mechanism::new(&fine).expect("equations"));
            let start = mechanism.start(&fine);
            let plan = Plan::new(&fine, &mechanism, &request).expect("a plan");
            let run = Run::new(Arc::clone(&mechanism), plan, Limits::default(), &start).expect("a run");
            let (mut running, mut count, mut pauses) = (Running::new(run), 0, 0);
            loop {
                let mut pause = || {
                    count += 1;
                    count % 7 == 0
                };
                if running.go(&mut |_: &driftless::Sample| Ok(()), &mut pause).expect("samples") {
                    break;
                }
                pauses += 1;
                let snapshot = serde_json::to_string(&running.snapshot()).expect("JSON");
                let snapshot = serde_json::from_str(&snapshot).expect("a snapshot");
                running = Running::resume(Arc::clone(&mechanism), &start, snapshot).expect("resumed");
            }
            let resumed = running.finish();
            assert!(pauses > 3);
            assert_eq!(resumed.last.phi, whole.last.phi, "{:?}", request.method);
            assert_eq!(resumed.last.friction.to_bits(), whole.last.friction.to_bits());
            assert_eq!(resumed.frictions, often.frictions);
        }
    }
}

#[test]
fn twins_stick_at_the_same_moment() {
    // Two equal pendulums beside each other, and one that mirrors them: three transitions at one time.
    let bar = |name: &str| {
        format!(r#"{{"name": "{name}", "mass": 2, "length": 1, "centre": [0.5, 0], "inertia": 0.2}}"#)
    };
    let hinge = |name: &str, x: f64| {
        format!(
            r#"{{"name": "H{name}", "between": [{{"body": "ground", "point": [{x}, 0]}}, {{"body": "{name}", "point": [0, 0]}}],
            "friction": {{"radius": 0.05, "kinetic": 0.2, "static": 0.3}}}}"#
        )
    };
    let scene_of = |names: &[(&str, f64)]| {
        let bars: Vec<_> = names.iter().map(|(name, _)| bar(name)).collect();
        let hinges: Vec<_> = names.iter().enumerate().map(|(i, (name, _))| hinge(name, i as f64)).collect();
        let starts: Vec<_> =
            names.iter().map(|(name, phi)| format!(r#""{name}": {{"phi": {phi}, "omega": 0}}"#)).collect();
        format!(
            r#"{{"name": "twins", "gravity": [0, -{G}], "bars": [{}], "hinges": [{}], "start": {{{}}}, "until": 40, "every": 40}}"#,
            bars.join(","),
            hinges.join(","),
            starts.join(",")
        )
    };
    let one = runs(&scene_of(&[("a", 0.0)]));
    let all = runs(&scene_of(&[("a", 0.0), ("b", 0.0), ("c", -PI)]));
    for (one, all) in one.iter().zip(&all) {
        assert!(one.friction_count > 1 && one.last.omega[0].abs() < 1e-12);
        assert_eq!(all.friction_count, 3 * one.friction_count);
        near(all.last.phi[0], one.last.phi[0], "the first");
        near(all.last.phi[1], one.last.phi[0], "its twin");
        near(all.last.phi[2], -PI - one.last.phi[0], "its mirror image");
        near(all.last.friction, 3.0 * one.last.friction, "lost");
    }
}

/// Numbers in [0, 1) of a linear congruential generator (Knuth, MMIX).
pub struct Dice(pub u64);

impl Dice {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    pub fn is(&mut self, share: f64) -> bool {
        self.next() < share
    }

    /// A bar of a length.
    pub fn bar(&mut self, name: &str, length: f64) -> String {
        format!(
            r#"{{"name": "{name}", "mass": {}, "centre": [{}, {}], "inertia": {}, "length": {length}}}"#,
            self.within(0.3, 2.0),
            0.5 * length,
            self.within(-0.05, 0.05),
            self.within(0.01, 0.1)
        )
    }

    fn coefficients(&mut self) -> String {
        let kinetic = self.within(0.05, 0.4);
        let stiction = kinetic * if self.is(0.5) { 1.0 } else { self.within(1.0, 2.0) };
        format!(r#""kinetic": {kinetic}, "static": {stiction}"#)
    }

    /// The friction of a slider or a wall, mostly.
    fn friction(&mut self) -> String {
        match self.is(0.7) {
            true => format!(r#", "friction": {{{}}}"#, self.coefficients()),
            false => String::new(),
        }
    }
}

/// A chain of one to three bars on the ground or on a cart, with friction here and there, springs, dampers,
/// motors and a floor or a side wall.
pub fn any_scene(seed: u64) -> String {
    let mut dice = Dice(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) + 1);
    let count = 1 + (dice.next() * 3.0) as usize;
    let has_cart = dice.is(0.3);
    let (mut bars, mut hinges, mut starts, mut more) = (vec![], vec![], vec![], String::new());
    if has_cart {
        bars.push(
            r#"{"name": "cart", "mass": 2, "centre": [0, 0], "inertia": 0.1, "length": 0.2}"#.to_owned(),
        );
        starts.push(format!(
            r#""cart": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [{}, 0]}}"#,
            dice.within(-1.0, 1.0)
        ));
        let friction = dice.friction();
        more += &format!(
            r#""sliders": [{{"name": "S", "point": {{"body": "cart", "point": [0, 0]}}, "angle": "locked",
            "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}{friction}}}],"#
        );
    }
    let mut inner = if has_cart { ("cart".to_owned(), 0.0) } else { ("ground".to_owned(), 0.0) };
    let motor = (!has_cart && count > 1 && dice.is(0.2)).then(|| dice.within(-3.0, 3.0));
    for k in 0..count {
        let name = format!("b{k}");
        let length = dice.within(0.3, 0.8);
        bars.push(dice.bar(&name, length));
        let friction = match dice.is(0.7) {
            true => {
                format!(r#", "friction": {{"radius": {}, {}}}"#, dice.within(0.01, 0.06), dice.coefficients())
            }
            false => String::new(),
        };
        hinges.push(format!(
            r#"{{"name": "H{k}", "between": [{{"body": "{}", "point": [{}, 0]}}, {{"body": "{name}", "point": [0, 0]}}]{friction}}}"#,
            inner.0, inner.1
        ));
        if k > 0 || motor.is_none() {
            let still = dice.is(0.3);
            let omega = if still { 0.0 } else { dice.within(-4.0, 4.0) };
            starts.push(format!(r#""{name}": {{"phi": {}, "omega": {omega}}}"#, dice.within(-2.5, -0.6)));
        }
        inner = (name, length);
    }
    if let Some(rate) = motor {
        more += &format!(
            r#""motors": [{{"name": "m", "body": "b0", "law": {{"start": -1.5, "rate": {rate}}}}}],"#
        );
    }
    if dice.is(0.4) {
        let last = count - 1;
        more += &format!(
            r#""torsion_springs": [{{"name": "k", "body": "b{last}", "stiffness": {}, "free_angle": -1.5, "damping": {}}}],"#,
            dice.within(0.0, 5.0),
            dice.within(0.0, 0.1)
        );
    }
    if dice.is(0.5) {
        let (x, y) = (dice.within(0.3, 0.7), -2.6);
        let (through, normal) =
            if dice.is(0.5) { ([x, 0.0], [-1.0, 0.0]) } else { ([0.0, y + 1.2], [0.1, 1.0]) };
        let friction = dice.friction();
        more += &format!(
            r#""walls": [{{"name": "W", "body": "{}", "point": [{}, 0], "line": {{"through": {through:?}, "normal": {normal:?}}},
            "restitution": {}{friction}}}],"#,
            inner.0,
            inner.1,
            if dice.is(0.3) { 0.0 } else { dice.within(0.1, 0.9) }
        );
    }
    format!(
        r#"{{"name": "any", "gravity": [0, -{G}], "bars": [{}], "hinges": [{}], {more} "start": {{{}}}, "until": 0.9, "every": 0.03}}"#,
        bars.join(","),
        hinges.join(","),
        starts.join(",")
    )
}

#[test]
fn random_scenes_agree_between_methods_and_lose_energy_as_coulomb_says() {
    let count: u64 = std::env::var("FRICTION").ok().and_then(|count| count.parse().ok()).unwrap_or(150);
    let [mut compared, mut behind, mut stopped, mut transitions, mut impacts, mut resting] = [0_u64; 6];
    let mut stops = std::collections::BTreeMap::<&str, u64>::new();
    for seed in 0..count {
        let text = any_scene(seed);
        let scene = match driftless::scene::parse_scene(&text, "test", &[]) {
            Err(error) if error.to_string().contains("behind") => {
                behind += 1;
                continue;
            }
            scene => scene.unwrap_or_else(|error| panic!("{error}")),
        };
        if scene.frictions.is_empty() {
            continue;
        }
        if Mechanism::new(&scene).is_err() {
            behind += 1;
            continue;
        }
        let methods = [MethodId::Dp8, MethodId::Radau(5), MethodId::Taylor];
        let [one, other, series] = methods.map(|method| adaptive(method, 1e-11)).map(|request| {
            let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
            let plan = Plan::new(&scene, &mechanism, &request).expect("a plan");
            let start = mechanism.start(&scene);
            let run = Run::new(mechanism, plan, Limits::default(), &start).expect("a run");
            let mut lost = 0.0_f64;
            let mut observer = |sample: &driftless::Sample| {
                assert!(sample.friction >= lost - 1e-12, "seed {seed}: friction gives energy");
                lost = sample.friction;
                Ok(())
            };
            driftless::run::integrate(run, &mut observer).expect("samples")
        });
        for outcome in [&one, &other, &series] {
            let drift = outcome.drift.energy.max;
            assert!(drift < 1e-7, "seed {seed}, {}: drift {drift:e}", outcome.plan.method);
        }
        if let (Some(stop), Some(second), Some(third)) = (&one.stop, &other.stop, &series.stop) {
            *stops.entry(stop.cause.word()).or_default() += 1;
            for second in [second, third] {
                assert_eq!(stop.cause, second.cause, "seed {seed}: {stop} {second}");
                assert!((stop.t - second.t).abs() < 1e-6, "seed {seed}: {stop} {second}");
            }
            stopped += 1;
            continue;
        }
        assert!(
            one.stop.is_none() && other.stop.is_none() && series.stop.is_none(),
            "seed {seed}: {:?} {:?} {:?} {text}",
            one.stop,
            other.stop,
            series.stop
        );
        for other in [&other, &series] {
            let apart =
                one.last.phi.iter().zip(&other.last.phi).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let method = other.plan.method;
            assert!(apart < 1e-6, "seed {seed}: {method} {apart:e} apart\n{text}");
        }
        compared += 1;
        transitions += one.friction_count;
        impacts += one.impact_count;
        resting += one.persistent_contact_count;
    }
    println!(
        "{compared} compared: {transitions} transitions, {impacts} impacts, {resting} points came to rest; {stopped} stopped {stops:?}; {behind} start behind a wall"
    );
    assert!(compared > count / 2 && transitions > count && impacts > count / 10 && resting > 0);
    assert!(!stops.contains_key(Cause::NotFinite.word()));
}

/// A crank-slider whose crank sticks: what else could slide has velocities that are rounding, which no
/// interpolant resolves and which do not oscillate.
#[test]
fn a_mechanism_held_at_rest_is_searched_once() {
    let scene = scene(
        r#"{"name": "crank",
        "gravity": [0, -9.81],
        "bars": [{"name": "a", "mass": 2.116, "centre": [0.0905, 0], "inertia": 0.0441, "length": 0.181},
            {"name": "b", "mass": 1.332, "centre": [0.3569, 0], "inertia": 0.0713, "length": 0.607}],
        "hinges": [{"name": "O", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}], "friction": {"radius": 0.095, "kinetic": 0.491, "static": 0.8347}},
            {"name": "A", "between": [{"body": "a", "point": [0.181, 0]}, {"body": "b", "point": [0, 0]}], "friction": {"radius": 0.105, "kinetic": 0.128}}],
        "sliders": [{"name": "P", "point": {"body": "b", "point": [0.607, 0]}, "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "friction": {"kinetic": 0.485, "static": 0.6305}}],
        "torsion_springs": [{"name": "ts_b", "body": "b", "stiffness": 5.5, "free_angle": -1.505, "damping": 0.376}],
        "start": {"a": {"phi": -0.356, "omega": 0.0}, "b": {"phi": 0.10411474894348223, "omega": 0.0}},
        "until": 2.0,
        "every": 1}"#,
    );
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Radau(3), MethodId::Radau(5)] {
        let mechanism = Arc::new(Mechanism::new(&scene).expect("a mechanism"));
        let plan = Plan::new(&scene, &mechanism, &Request { method: Some(method), ..Request::default() })
            .expect("a plan");
        let start = mechanism.start(&scene);
        let run = Run::new(mechanism, plan, Limits::default(), &start).expect("a run");
        let outcome = integrate(run, &mut |_| Ok(())).expect("samples");
        assert_eq!((outcome.stop, outcome.last.t), (None, 2.0), "{method}");
        let off =
            (0..2).map(|k| (outcome.last.phi[k] - start.unwrapped(k)).abs().max(outcome.last.omega[k].abs()));
        assert!(off.fold(0.0, f64::max) < 1e-12, "{method}: {:?}", outcome.last);
    }
}
