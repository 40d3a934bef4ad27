//! Gears and cams by RATTLE: against equations of one coordinate integrated in the test, and against the form in
//! angles.

use super::couplings::{beyond_a_corner, geared, integrated};
use super::formulas::{run, scene};
use crate::common::compile;
use crate::natural_solve::accelerations;
use driftless::arithmetic::Complex;
use driftless::dynamics::kernel::{Bias, Kernel};
use driftless::dynamics::natural::Natural;
use driftless::dynamics::{Form, Motion, Time};
use driftless::run::{MethodId, Outcome, Request};
use driftless::scene::Scene;
use driftless::stepping::composition::Composition;
use driftless::stepping::rattle::Rattle;
use driftless::stepping::{Integrator, Seen, Statistics};

const G: f64 = 9.81;

fn stepped(scene: &Scene, method: &str, steps: u32) -> Outcome {
    let method = Some(method.parse::<MethodId>().expect("a method"));
    let outcome = run(scene, &Request { method, step: Some(1.0 / f64::from(steps)), ..Request::default() });
    assert!(outcome.stop.is_none(), "{method:?}: {:?}", outcome.stop);
    outcome
}

fn near(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found - expected).abs() < tolerance, "{what}: {found} and not {expected}");
}

/// Slope of log error by log steps; no error may be rounding.
fn order(points: &[(u32, f64)]) -> f64 {
    assert!(points.iter().all(|point| point.1 > 5e-14), "rounding in {points:?}");
    let points: Vec<[f64; 2]> =
        points.iter().map(|&(steps, error)| [f64::from(steps).ln(), error.ln()]).collect();
    let mean = |i: usize| points.iter().map(|point| point[i]).sum::<f64>() / points.len() as f64;
    let [x, y] = [mean(0), mean(1)];
    let both: f64 = points.iter().map(|point| (point[0] - x) * (point[1] - y)).sum();
    -both / points.iter().map(|point| (point[0] - x).powi(2)).sum::<f64>()
}

const METHODS: [(&str, f64, [u32; 4]); 4] = [
    ("rattle2", 2.0, [128, 192, 256, 384]),
    ("rattle4", 4.0, [64, 96, 128, 192]),
    ("rattle6", 6.0, [48, 64, 96, 128]),
    ("rattle8", 8.0, [32, 40, 48, 64]),
];

/// A follower of mass m on a cam, y = 0.1 (1 - cos 2 phi), held by a spring; no gravity.
fn cam(until: f64) -> Scene {
    scene(&format!(
        r#"{{"name": "cam", "gravity": [0, 0],
        "bars": [{{"name": "cam", "mass": 1, "centre": [0, 0], "inertia": 0.4}},
            {{"name": "follower", "mass": 1.5, "centre": [0, 0], "inertia": 0.1, "length": 0.1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "cam", "point": [0, 0]}}]}}],
        "sliders": [{{"name": "guide", "point": {{"body": "follower", "point": [0, 0]}},
            "rail": {{"body": "ground", "point": [0, 0.3], "direction": [0, 1]}}, "angle": "locked"}}],
        "springs": [{{"name": "k", "between": [{{"body": "ground", "point": [0, 1.3]}}, {{"body": "follower", "point": [0, 0]}}],
            "stiffness": 80, "free_length": 0}}],
        "motors": [{{"name": "profile", "slider": "guide", "law": "0.1*(1 - cos(2*cam.phi))"}}],
        "start": {{"cam": {{"phi": 0.2, "omega": 6}}, "follower": {{"phi": 0}}}}, "until": {until}, "every": {until}}}"#
    ))
}

/// (J + m y'²) phi'' = -(m y' y'' phi'² + k (y - 1) y'), derivatives by phi.
fn cam_acceleration(_: f64, phi: f64, omega: f64) -> f64 {
    let (s, c) = (2.0 * phi).sin_cos();
    let [y, slope, bend] = [0.1 * (1.0 - c), 0.2 * s, 0.4 * c];
    -(1.5 * slope * bend * omega * omega + 80.0 * (y - 1.0) * slope) / (0.4 + 1.5 * slope * slope)
}

#[test]
fn a_geared_pendulum_has_the_order_of_the_method() {
    // Over several turns, at a ratio that is no whole number.
    let (ratio, until) = (2.3, 1.5);
    let inertia = 0.2 + 2.0 * 0.25 + ratio * ratio * 0.03;
    let f = |_: f64, phi: f64, _: f64| -2.0 * G * 0.5 * phi.cos() / inertia;
    let [phi, omega] = integrated(f, [0.4, 9.0], until, 20_000);
    let scene = geared("2.3*bar.phi - 0.5", r#"{"phi": 0.4, "omega": 9}"#, until);
    for (name, nominal, steps) in METHODS {
        let errors = steps.map(|steps| {
            let last = stepped(&scene, name, steps).last;
            near(last.phi[1], ratio * last.phi[0] - 0.5, 1e-13, "angle of the wheel");
            near(last.omega[1], ratio * last.omega[0], 1e-12, "rate of the wheel");
            assert!(last.work.abs() < 1e-12, "a gear does no work");
            (steps, (last.phi[0] - phi).hypot((last.omega[0] - omega) / 9.0))
        });
        let found = order(&errors);
        assert!((found - nominal).abs() < 0.35, "{name}: order {found}, {errors:?}");
    }
    let last = stepped(&scene, "rattle8", 256).last;
    near(last.phi[0], phi, 1e-11, "angle");
    near(last.omega[0], omega, 1e-11, "rate");
    near(last.motors[0][0], 0.03 * ratio * f(0.0, phi, 0.0), 1e-10, "torque of the gear");
}

#[test]
fn a_cam_has_the_order_of_the_method() {
    let [phi, omega] = integrated(cam_acceleration, [0.2, 6.0], 1.0, 40_000);
    let scene = cam(1.0);
    for (name, nominal, steps) in METHODS {
        let errors = steps.map(|steps| {
            let last = stepped(&scene, name, 2 * steps).last;
            near(last.centre[1][1], 0.3 + 0.1 * (1.0 - (2.0 * last.phi[0]).cos()), 1e-14, "height");
            near(last.velocity[1][1], 0.2 * (2.0 * last.phi[0]).sin() * last.omega[0], 1e-13, "its rate");
            (2 * steps, (last.phi[0] - phi).hypot((last.omega[0] - omega) / 6.0))
        });
        let found = order(&errors);
        assert!((found - nominal).abs() < 0.35, "{name}: order {found}, {errors:?}");
    }
    let last = stepped(&scene, "rattle8", 512).last;
    near(last.phi[0], phi, 1e-11, "angle");
    near(last.omega[0], omega, 1e-10, "rate");
}

#[test]
fn an_aim_of_time_and_place_does_work() {
    // The wheel runs ahead of the bar: psi = phi + 3 t + 0.2 sin phi.
    let f = |_: f64, phi: f64, omega: f64| {
        let (s, c) = phi.sin_cos();
        let slope = 1.0 + 0.2 * c;
        (-2.0 * G * 0.5 * c + 0.03 * slope * 0.2 * s * omega * omega) / (0.7 + 0.03 * slope * slope)
    };
    let [phi, omega] = integrated(f, [-1.0, 0.5], 2.0, 20_000);
    let last =
        stepped(&geared("bar.phi + 3*t + 0.2*bar.sin", r#"{"phi": -1, "omega": 0.5}"#, 2.0), "rattle8", 128)
            .last;
    near(last.phi[0], phi, 1e-11, "angle");
    near(last.omega[0], omega, 1e-11, "rate");
    let psi = |phi: f64, omega: f64| omega * (1.0 + 0.2 * phi.cos()) + 3.0;
    let energy = |phi: f64, omega: f64| {
        0.35 * omega * omega + 0.015 * psi(phi, omega).powi(2) + 2.0 * G * 0.5 * phi.sin()
    };
    near(last.work, energy(phi, omega) - energy(-1.0, 0.5), 1e-10, "work of the motor");
}

#[test]
fn corners_of_a_cam_are_switches() {
    let until = 0.6;
    let [phi, omega] = beyond_a_corner(until);
    let last =
        stepped(&geared("max(bar.phi - 1, 0)^2", r#"{"phi": 0, "omega": 5}"#, until), "rattle8", 128).last;
    near(last.phi[0], phi, 3e-9, "angle");
    near(last.omega[0], omega, 3e-9, "rate");
    near(last.phi[1], (phi - 1.0).powi(2), 3e-9, "angle of the wheel");
}

#[test]
fn energy_of_gears_and_cams_does_not_drift() {
    for (scene, bound) in
        [(geared("2.3*bar.phi - 0.5", r#"{"phi": 0.4, "omega": 1}"#, 1.0), 1e-7), (cam(1.0), 1e-6)]
    {
        let [first, all] = [100.0, 200.0].map(|until| {
            let scene = Scene { until, every: 0.05, ..scene.clone() };
            stepped(&scene, "rattle4", 256).drift.energy.max
        });
        assert!(first < bound && all < 1.2 * first, "{first:e} {all:e}");
    }
}

/// A free body whose tip drives a wheel, a driven wheel with a cam of its whole angle, and a gear that runs ahead.
fn coupled(seed: u64) -> Scene {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(1);
    let mut number = |most: f64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0) * most
    };
    let [a, b, c, d, e] = [number(2.0), number(0.7), number(3.0), number(1.0), number(0.5)];
    let [x, y, u, v] = [number(1.0), number(1.0), number(2.0), number(2.0)];
    let [p, q, w, z] = [number(3.0), number(3.0), number(4.0), number(4.0)];
    scene(&format!(
        r#"{{"name": "coupled", "gravity": [1.5, -{G}],
        "bars": [{{"name": "free", "mass": 1.2, "length": 1, "centre": [0.4, 0.1], "inertia": 0.2}},
            {{"name": "crank", "mass": 0.7, "length": 0.5, "centre": [0.2, -0.05], "inertia": 0.03}},
            {{"name": "wheel", "mass": 1, "centre": [0.03, 0.02], "inertia": 0.04}},
            {{"name": "rider", "mass": 0.5, "centre": [0.05, 0], "inertia": 0.02, "length": 0.3}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "crank", "point": [0, 0]}}]}},
            {{"name": "B", "between": [{{"body": "ground", "point": [1, 0]}}, {{"body": "wheel", "point": [0, 0]}}]}},
            {{"name": "C", "between": [{{"body": "crank", "point": [0.5, 0]}}, {{"body": "rider", "point": [0, 0]}}]}}],
        "points": [{{"name": "tip", "body": "free", "point": [0.9, 0.2]}},
            {{"name": "end", "body": "rider", "point": [0.3, 0]}}],
        "springs": [{{"name": "k", "between": [{{"body": "free", "point": [0, 0]}}, {{"body": "rider", "point": [0.3, 0]}}],
            "stiffness": 12, "free_length": 0.3}}],
        "motors": [{{"name": "by_place", "body": "wheel", "law": "{a}*tip.x*crank.cos + {b}*end.y^2 + {c}*t"}},
            {{"name": "by_angle", "body": "rider", "relative_to": "crank", "law": "{d}*crank.phi^2 + {e}*sin(free.phi + 1*t)"}}],
        "start": {{"free": {{"phi": {p}, "omega": {w}, "origin": [{x}, {y}], "velocity": [{u}, {v}]}},
            "crank": {{"phi": {q}, "omega": {z}}}}}, "until": 0.4, "every": 0.4}}"#
    ))
}

#[test]
fn natural_coordinates_and_angles_tell_the_same_accelerations() {
    for seed in 0..50 {
        let scene = coupled(seed);
        let mechanism = compile(&scene);
        let start = mechanism.start(&scene);
        let whole: Vec<f64> = (0..start.phi.len()).map(|k| start.unwrapped(k)).collect();
        let omega: Vec<f64> = start.omega.iter().map(|omega| omega.hi).collect();
        let mut kernel = Kernel::<f64>::new(&mechanism);
        kernel.accelerations(&mechanism, Time::default(), &whole, &omega, Bias::default());
        let natural = Natural::new(mechanism.clone()).expect("a natural form");
        let bodies = mechanism.bodies.len();
        let (mut z, mut rate) =
            (vec![Complex::default(); whole.len()], vec![Complex::default(); whole.len()]);
        for k in 0..bodies {
            z[k] = Complex::unit(whole[k]);
            rate[k] = z[k].left().times(omega[k]);
        }
        for x in (bodies..whole.len()).step_by(2) {
            (z[x], rate[x]) = (Complex::new(whole[x], whole[x + 1]), Complex::new(omega[x], omega[x + 1]));
        }
        let turns: Vec<i64> = start.turns[..bodies].to_vec();
        let (acceleration, multiplier) = accelerations(&natural, Time::default(), (&z, &turns), &rate);
        let most = kernel.load.iter().fold(1.0_f64, |most, x| most.max(x.abs()));
        for k in 0..bodies {
            near(z[k].cross(acceleration[k]), kernel.load[k], 1e-10 * most, "angular acceleration");
            near(z[k].dot(acceleration[k]), -omega[k] * omega[k], 1e-10 * most, "centripetal acceleration");
        }
        near(acceleration[bodies].re, kernel.load[bodies], 1e-10 * most, "acceleration along x");
        near(acceleration[bodies].im, kernel.load[bodies + 1], 1e-10 * most, "acceleration along y");
        let strongest = kernel.multiplier.iter().fold(1.0_f64, |most, x| most.max(x.abs()));
        for (found, expected) in multiplier.iter().zip(&kernel.multiplier) {
            near(*found, *expected, 1e-10 * strongest, "multiplier");
        }
    }
}

#[test]
fn couplings_of_every_kind_move_as_in_angles() {
    for seed in 0..4 {
        let scene = coupled(seed);
        let exact = run(&scene, &super::formulas::adaptive(MethodId::Dp8, 1e-13)).last;
        let last = stepped(&scene, "rattle8", 2048).last;
        for k in 0..4 {
            near(last.phi[k], exact.phi[k], 2e-9, "angle");
            near(last.omega[k], exact.omega[k], 2e-8, "rate");
            near(last.centre[k][0], exact.centre[k][0], 2e-9, "place");
        }
        near(last.work, exact.work, 2e-8, "work");
    }
}

#[test]
fn a_run_back_in_time_arrives_at_the_start_and_a_restart_gives_the_same_bits() {
    let scene = geared("2.3*bar.phi + 0.3*sin(bar.phi)", r#"{"phi": 0.4, "omega": 9}"#, 3.0);
    let mechanism = compile(&scene);
    for composition in Composition::ALL {
        let mut natural = Natural::new(mechanism.clone()).expect("a natural form");
        let start = natural.state(&mechanism.start(&scene));
        let mut to = |from: &driftless::dynamics::State, until: f64, step: f64| {
            let (mut state, mut method) = (from.clone(), Rattle::new(composition, step));
            let mut count = Statistics::default();
            method
                .advance(&mut natural, &mut state, Time::from(until), &mut count, &mut |_, _| Ok(Seen::Kept))
                .expect("a run");
            state
        };
        let there = to(&start, 3.0, 1.0 / 128.0);
        let middle = to(&start, 1.25, 1.0 / 128.0);
        assert_eq!(to(&middle, 3.0, 1.0 / 128.0), there);
        let back = to(&there, 0.0, -1.0 / 128.0);
        let mut motions = [Motion::default(), Motion::default()];
        natural.read(&start, &mut motions[0]);
        natural.read(&back, &mut motions[1]);
        for k in 0..2 {
            near(motions[1].unwrapped(k), motions[0].unwrapped(k), 1e-11, "angle");
        }
    }
}
