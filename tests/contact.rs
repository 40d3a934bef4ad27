//! Contacts that last: points that rest on walls, slide along them, and leave them where the wall would have
//! to pull.
//!
//! References: energies of a single bar in closed form, the double pendulum whose end slides along a floor
//! written out by hand for this file, and, under a motor, the same equations read backwards from a motion
//! that is known.

use crate::common;

use common::{LENGTH, MASS, PENDULUM_SQUARED, compile, double_pendulum, pendulum, run, shipped};
use driftless::arithmetic::Complex;
use driftless::dynamics::Mechanism;
use driftless::dynamics::kernel::{Bias, Kernel};
use driftless::run::{Limits, MethodId, Outcome, Plan, Request, Run, Sample, Stabilization, integrate};
use driftless::scene::{Law, Motor, Scene, Sine, Start, Wall};
use driftless::stepping::Cause;
use std::sync::Arc;

const G: f64 = 9.81;

/// The methods that locate impacts to all digits.
const LOCATED: [MethodId; 2] = [MethodId::Dp8, MethodId::Taylor];

fn by(method: MethodId, until: f64, every: f64, rtol: f64) -> Request {
    Request {
        method: Some(method),
        until: Some(until),
        every: Some(every),
        rtol: Some(rtol),
        ..Request::default()
    }
}

/// A run, and all its samples.
pub fn watched(scene: &Scene, request: &Request) -> (Outcome, Vec<Sample>) {
    let mechanism = compile(scene);
    let plan = Plan::new(scene, &mechanism, request).expect("a sensible pairing");
    let start = mechanism.start(scene);
    let mut samples = Vec::new();
    let run = Run::new(mechanism, plan, Limits::default(), &start).expect("a beginning");
    let outcome = integrate(run, &mut |sample| {
        samples.push(sample.clone());
        Ok(())
    });
    (outcome.expect("no observer fails"), samples)
}

fn gap(mechanism: &Mechanism, wall: usize, phi: &[f64]) -> f64 {
    let z: Vec<_> = phi.iter().map(|&phi| Complex::unit(phi)).collect();
    mechanism.contacts[wall].row.gap(&z)
}

/// Largest gap at the samples at which a contact is held.
fn worst_gap(scene: &Scene, outcome: &Outcome, samples: &[Sample]) -> f64 {
    let mechanism = compile(scene);
    let mut worst = 0.0f64;
    for hold in &outcome.holds {
        let wall = scene.walls.iter().position(|wall| wall.name == hold.wall).expect("a wall");
        for sample in
            samples.iter().filter(|sample| sample.t >= hold.t && sample.t <= hold.until.unwrap_or(f64::MAX))
        {
            worst = worst.max(gap(&mechanism, wall, &sample.phi).abs());
        }
    }
    worst
}

/// A bar through whose hinge a wall runs at `angle`, on the side of smaller angles.
fn against(angle: f64, start: f64, restitution: f64) -> Scene {
    let mut scene = pendulum(start, 0.0);
    let normal = [-angle.sin(), angle.cos()];
    scene.walls.push(Wall {
        name: "wall".into(),
        bar: 0,
        point: [1.0, 0.0],
        through: [0.0, 0.0],
        on: None,
        law: None,
        aim: None,
        normal,
        restitution,
    });
    scene
}

/// Two slender bars, the end of the second on a floor at x = `depth`, gravity downwards along +x.
fn on_a_floor(depth: f64, phi: [f64; 2], omega: [f64; 2]) -> Scene {
    let mut scene = double_pendulum(common::Inertia::Slender, [(phi[0], omega[0]), (phi[1], omega[1])]);
    let normal = [-1.0, 0.0];
    scene.walls.push(Wall {
        name: "floor".into(),
        bar: 1,
        point: [LENGTH, 0.0],
        through: [depth, 0.0],
        on: None,
        law: None,
        aim: None,
        normal,
        restitution: 0.0,
    });
    scene
}

/// Both sides of the hand-written equations: `M a + gyroscopic + weight`, all over m l², without the floor.
fn needed(phi: [f64; 2], omega: [f64; 2], alpha: [f64; 2]) -> [f64; 2] {
    let (c, s) = ((phi[0] - phi[1]).cos(), (phi[0] - phi[1]).sin());
    [
        4.0 / 3.0 * alpha[0]
            + 0.5 * c * alpha[1]
            + 0.5 * s * omega[1] * omega[1]
            + 1.5 * G / LENGTH * phi[0].sin(),
        0.5 * c * alpha[0] + alpha[1] / 3.0 - 0.5 * s * omega[0] * omega[0] + 0.5 * G / LENGTH * phi[1].sin(),
    ]
}

/// Accelerations, and the force of the floor over m l, of the sliding double pendulum: the two equations and
/// sin q1 a1 + sin q2 a2 = -Σ cos q w².
fn sliding(phi: [f64; 2], omega: [f64; 2]) -> ([f64; 2], f64) {
    let c = (phi[0] - phi[1]).cos();
    let rest = needed(phi, omega, [0.0; 2]);
    let (s1, s2) = (phi[0].sin(), phi[1].sin());
    let matrix = nalgebra::Matrix3::new(4.0 / 3.0, 0.5 * c, -s1, 0.5 * c, 1.0 / 3.0, -s2, s1, s2, 0.0);
    let turning = -phi[0].cos() * omega[0].powi(2) - phi[1].cos() * omega[1].powi(2);
    let found =
        matrix.lu().solve(&nalgebra::Vector3::new(-rest[0], -rest[1], turning)).expect("no dead centre");
    ([found[0], found[1]], found[2])
}

/// A step of the classical Runge–Kutta method for the sliding double pendulum.
fn slide(y: [f64; 4], h: f64) -> [f64; 4] {
    let rate = |y: [f64; 4]| {
        let (alpha, _) = sliding([y[0], y[1]], [y[2], y[3]]);
        [y[2], y[3], alpha[0], alpha[1]]
    };
    let moved = |k: [f64; 4], h: f64| std::array::from_fn(|i| y[i] + h * k[i]);
    let k1 = rate(y);
    let k2 = rate(moved(k1, h / 2.0));
    let k3 = rate(moved(k2, h / 2.0));
    let k4 = rate(moved(k3, h));
    std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

/// Force of the wall on a held point over the energy scale \[1/m\].
fn pressure(scene: &Scene, sample: &Sample) -> f64 {
    let mechanism = compile(scene).holding(&[0]);
    let mut kernel = Kernel::<f64>::new(&mechanism);
    kernel.accelerations(&mechanism, sample.t.into(), &sample.phi, &sample.omega, Bias::default());
    -kernel.multiplier[mechanism.standing_rows()] / mechanism.energy_scale
}

#[test]
fn case_f_without_restitution_goes_on_to_its_horizon() {
    for method in LOCATED {
        let scene = shipped("wall", &["walls.wall.restitution=0"]);
        let (outcome, samples) = watched(&scene, &by(method, 10.0, 1e-3, 1e-10));
        assert_eq!(outcome.stop, None);
        assert!(
            outcome.persistent_contact_count > 0
                && outcome.persistent_contact_count as usize == outcome.holds.len()
        );
        let total: f64 = outcome.holds.iter().map(|hold| hold.until.unwrap_or(10.0) - hold.t).sum();
        assert!((outcome.persistent_contact_time - total).abs() < 1e-12);
        assert!(outcome.drift.energy.max < 2e-9, "{:e}", outcome.drift.energy.max);
        let worst = worst_gap(&scene, &outcome, &samples);
        assert!(worst < 1e-12, "{worst:e} m");
        let through =
            samples.iter().map(|sample| gap(&compile(&scene), 0, &sample.phi)).fold(f64::MAX, f64::min);
        assert!(through > -1e-11, "{through:e} m");
    }
}

#[test]
fn every_release_of_case_f_is_where_the_force_is_zero() {
    for method in LOCATED {
        let scene = shipped("wall", &["walls.wall.restitution=0"]);
        let whole = run(&scene, &by(method, 3.0, 0.01, 1e-10));
        for until in whole.holds.iter().filter_map(|hold| hold.until) {
            // The same run cut at the release: its last moment is the release.
            let outcome = run(&scene, &by(method, until, 0.01, 1e-10));
            let force = pressure(&scene, &outcome.last);
            assert!(force.abs() < 1e-9, "{force:e} /m at {until} s");
        }
    }
}

#[test]
fn a_bar_that_falls_on_a_wall_comes_to_rest_there_for_good() {
    for method in LOCATED {
        for restitution in [0.0, 0.3, 0.5, 0.8] {
            let scene = against(0.5, 1.0, restitution);
            let (outcome, samples) = watched(&scene, &by(method, 20.0, 0.01, 1e-10));
            assert_eq!(outcome.stop, None, "e = {restitution}");
            assert_eq!((outcome.holds.len(), outcome.holds[0].until), (1, None));
            assert!(
                (outcome.last.phi[0] - 0.5).abs() < 1e-14 && outcome.last.omega[0].abs() < 1e-14,
                "{:?}",
                outcome.last
            );
            // All the height it had is lost: m g l / 2 (cos 0.5 - cos 1).
            let lost = 5.0 * (0.5f64.cos() - 1f64.cos());
            assert!(
                (outcome.impact_loss - lost).abs() < 1e-9,
                "{} J instead of {lost} J",
                outcome.impact_loss
            );
            assert!(outcome.drift.energy.max < 1e-9, "{:e}", outcome.drift.energy.max);
            assert!(worst_gap(&scene, &outcome, &samples) < 1e-15);
            // Small bounces are a geometric series under the angular acceleration 15 sin 0.5.
            if restitution > 0.0 {
                let small = outcome
                    .impacts
                    .iter()
                    .find(|strike| strike.approach.abs() < 1e-3)
                    .expect("small bounces");
                let rebound = -small.approach * restitution;
                let rest = small.t + 2.0 * rebound / (PENDULUM_SQUARED * 0.5f64.sin()) / (1.0 - restitution);
                let from = outcome.holds[0].t;
                assert!((from - rest).abs() < 1e-9, "held from {from} s, at rest at {rest} s");
            }
        }
    }
}

#[test]
fn an_end_that_slides_along_a_floor_leaves_it_when_the_force_is_zero() {
    let angle = 0.6f64.acos();
    let (phi, omega) = ([-angle, angle], [2.0, 2.0]);
    let (mut y, mut t) = ([phi[0], phi[1], omega[0], omega[1]], 0.0);
    let h = 1e-4;
    let force = |y: [f64; 4]| sliding([y[0], y[1]], [y[2], y[3]]).1;
    assert!(force(y) > 1.0);
    let mut middle = y;
    while force(slide(y, h)) > 0.0 {
        y = slide(y, h);
        t += h;
        if t < 0.3 {
            middle = y;
        }
    }
    let (mut low, mut high) = (0.0, h);
    while high - low > 1e-15 {
        let half = 0.5 * (low + high);
        if force(slide(y, half)) > 0.0 { low = half } else { high = half }
    }
    let release = t + high;
    let scene = on_a_floor(2.0 * LENGTH * 0.6, phi, omega);
    for method in [MethodId::Dp8, MethodId::Dp5, MethodId::Taylor] {
        let (outcome, samples) = watched(&scene, &by(method, 1.0, 1e-2, 1e-11));
        assert_eq!(outcome.stop, None);
        let first = &outcome.holds[0];
        assert_eq!((first.t, first.wall.as_str()), (0.0, "floor"));
        let until = first.until.expect("a release");
        assert!((until - release).abs() < 1e-8, "released at {until} s instead of {release} s");
        // Half way, at 0.3 s.
        for k in 0..2 {
            assert!(
                (samples[30].phi[k] - middle[k]).abs() < 1e-4
                    && (samples[30].omega[k] - middle[2 + k]).abs() < 1e-2
            );
        }
        assert!(outcome.drift.energy.max < 1e-9, "{:e}", outcome.drift.energy.max);
        assert!(worst_gap(&scene, &outcome, &samples) < 1e-12);
        // Then it is free: the end rises from the floor.
        let after = samples.iter().find(|sample| sample.t > until + 0.05).expect("a sample");
        assert!(gap(&compile(&scene), 0, &after.phi) > 1e-6);
    }
}

#[test]
fn the_sliding_motion_is_that_of_the_constrained_equation() {
    for method in LOCATED {
        let angle = 0.6f64.acos();
        let scene = on_a_floor(2.0 * LENGTH * 0.6, [-angle, angle], [2.0, 2.0]);
        let (h, steps) = (1e-4, 5000);
        let y = (0..steps).fold([-angle, angle, 2.0, 2.0], |y, _| slide(y, h));
        let outcome = run(&scene, &by(method, h * f64::from(steps), 0.1, 1e-12));
        for k in 0..2 {
            assert!((outcome.last.phi[k] - y[k]).abs() < 1e-9, "{} {}", outcome.last.phi[k], y[k]);
            assert!(
                (outcome.last.omega[k] - y[2 + k]).abs() < 1e-9,
                "{} {}",
                outcome.last.omega[k],
                y[2 + k]
            );
        }
    }
}

/// The first bar driven to and fro, the end of the second dragged along the floor: everything follows from
/// the law, the motor's torque included.
#[test]
fn a_motor_drags_an_end_along_a_floor() {
    for method in LOCATED {
        let (depth, start, amplitude, frequency) = (1.5 * LENGTH, 0.4, 0.2, 3.0);
        let at = |t: f64| {
            let phase = frequency * t;
            let (q, w) = (start + amplitude * phase.sin(), amplitude * frequency * phase.cos());
            let a = -amplitude * frequency * frequency * phase.sin();
            let other = (depth / LENGTH - q.cos()).acos();
            let w_other = -q.sin() * w / other.sin();
            let turning = -q.cos() * w * w - other.cos() * w_other * w_other;
            let a_other = (turning - q.sin() * a) / other.sin();
            ([q, other], [w, w_other], [a, a_other])
        };
        let (phi, omega, _) = at(0.0);
        let mut scene = on_a_floor(depth, phi, omega);
        let sines = vec![Sine { amplitude, frequency, phase: 0.0 }];
        scene.motors.push(Motor {
            name: "motor".into(),
            bar: 0,
            relative_to: None,
            law: Law { start, rate: 0.0, acceleration: 0.0, sines, profile: None },
        });
        for stabilize in [
            Stabilization::Elimination,
            Stabilization::Projection,
            Stabilization::Baumgarte,
            Stabilization::None,
        ] {
            if (method, stabilize) == (MethodId::Taylor, Stabilization::Baumgarte) {
                continue;
            }
            let request = Request { stabilize: Some(stabilize), ..by(method, 10.0, 0.01, 1e-11) };
            let (outcome, samples) = watched(&scene, &request);
            assert_eq!(outcome.stop, None, "{stabilize}");
            assert_eq!(
                (outcome.holds.len(), outcome.holds[0].t, outcome.holds[0].until),
                (1, 0.0, None),
                "{stabilize}"
            );
            for sample in &samples {
                let (phi, omega, alpha) = at(sample.t);
                assert!(
                    (sample.phi[1] - phi[1]).abs() < 1e-11 && (sample.omega[1] - omega[1]).abs() < 1e-10,
                    "{stabilize} at {} s",
                    sample.t
                );
                let [first, second] = needed(phi, omega, alpha);
                let force = second / phi[1].sin();
                let torque = MASS * LENGTH * LENGTH * (first - force * phi[0].sin());
                let [found, power] = sample.motors[0];
                assert!(
                    (found - torque).abs() < 1e-9 && (power - torque * omega[0]).abs() < 1e-9,
                    "{found} N m, not {torque} N m"
                );
                assert!(force > 0.0);
            }
            assert_eq!(samples[0].constraints.len(), 1);
            assert!(outcome.drift.energy.max < 1e-9, "{stabilize}: {:e}", outcome.drift.energy.max);
            let noted = outcome.plan.notes.iter().any(|note| note.contains("kept by projection"));
            assert_eq!(noted, stabilize != Stabilization::Projection);
        }
    }
}

/// The motor throws the end off its floor, and it falls back on it; the motor's account of work goes through
/// hold, release and impacts.
#[test]
fn the_account_of_work_goes_through_holds_and_releases() {
    for method in LOCATED {
        let other = (1.5 - 0.4f64.cos()).acos();
        let rate = 0.4 * 14.0;
        let mut scene = on_a_floor(1.5 * LENGTH, [0.4, other], [rate, -0.4f64.sin() * rate / other.sin()]);
        let sines = vec![Sine { amplitude: 0.4, frequency: 14.0, phase: 0.0 }];
        let law = Law { start: 0.4, rate: 0.0, acceleration: 0.0, sines, profile: None };
        scene.motors.push(Motor { name: "motor".into(), bar: 0, relative_to: None, law });
        scene.walls[0].restitution = 0.3;
        let mut finals = Vec::new();
        for stabilize in [Stabilization::Elimination, Stabilization::Projection] {
            let request = Request { stabilize: Some(stabilize), ..by(method, 1.5, 0.01, 1e-11) };
            let (outcome, samples) = watched(&scene, &request);
            assert_eq!(outcome.stop, None, "{stabilize}");
            assert!(
                outcome.holds[0].until.is_some() && outcome.impact_count > 1,
                "{:?} {:?}",
                outcome.holds,
                outcome.impact_count
            );
            assert!(outcome.drift.energy.max < 1e-9, "{stabilize}: {:e}", outcome.drift.energy.max);
            assert!(worst_gap(&scene, &outcome, &samples) < 1e-12);
            finals.push((outcome.last.phi[1], outcome.last.work, outcome.persistent_contact_count));
        }
        assert_eq!(finals[0].2, finals[1].2);
        assert!(
            (finals[0].0 - finals[1].0).abs() < 1e-6 && (finals[0].1 - finals[1].1).abs() < 1e-6,
            "{finals:?}"
        );
    }
}

#[test]
fn two_points_are_held_at_once() {
    for method in LOCATED {
        // Two bars on hinges of their own, each against a wall of its own: one falls a little further than
        // the other.
        let mut scene = against(0.5, 1.0, 0.4);
        let mut twin = scene.bars[0].clone();
        twin.name = "twin".into();
        scene.bars.push(twin);
        let mut hinge = scene.hinges[0].clone();
        (hinge.name, hinge.between[1].bar) = ("B".into(), Some(1));
        scene.hinges.push(hinge);
        scene.start.push(Start { phi: 1.3, omega: 0.0 });
        scene.walls.push(Wall { name: "other".into(), bar: 1, ..scene.walls[0].clone() });
        let outcome = run(&scene, &by(method, 10.0, 0.1, 1e-10));
        assert_eq!((outcome.stop.as_ref(), outcome.persistent_contact_count), (None, 2));
        assert!(
            outcome.holds.iter().all(|hold| hold.until.is_none()) && outcome.holds[0].t < outcome.holds[1].t
        );
        assert!(
            outcome.last.phi.iter().all(|phi| (phi - 0.5).abs() < 1e-14)
                && outcome.last.omega.iter().all(|omega| omega.abs() < 1e-14)
        );
        let lost = 5.0 * (2.0 * 0.5f64.cos() - 1f64.cos() - 1.3f64.cos());
        assert!((outcome.impact_loss - lost).abs() < 1e-9);
    }
}

/// Two walls of which one alone keeps a bar: its end touches both, and only as many rows as it has freedom
/// are in force.
#[test]
fn points_that_touch_without_being_needed_are_not_held() {
    for method in LOCATED {
        let mut scene = against(0.5, 0.5, 0.5);
        scene.walls.push(Wall { name: "same".into(), point: [0.5, 0.0], ..scene.walls[0].clone() });
        let outcome = run(&scene, &by(method, 5.0, 0.1, 1e-10));
        assert_eq!(
            (outcome.stop.as_ref(), outcome.impact_count, outcome.persistent_contact_count),
            (None, 0, 1)
        );
        assert!((outcome.last.phi[0] - 0.5).abs() < 1e-14 && outcome.last.omega[0] == 0.0);
    }
}

#[test]
fn a_motor_that_leaves_no_freedom_is_a_typed_stop() {
    for method in LOCATED {
        // At rest on the wall, driven into it with growing speed.
        let mut scene = against(0.5, 0.5, 0.5);
        let law = Law { start: 0.5, rate: 0.0, acceleration: -1.0, sines: vec![], profile: None };
        scene.motors.push(Motor { name: "motor".into(), bar: 0, relative_to: None, law });
        let stop = run(&scene, &by(method, 5.0, 0.1, 1e-10)).stop.expect("a stop");
        assert_eq!((stop.cause, stop.t), (Cause::RestingContact, 0.0));
        assert!(stop.what.contains("wall") && stop.hint.contains("motor"), "{stop}");
    }
}

#[test]
fn the_same_run_gives_the_same_bits() {
    for method in LOCATED {
        for restitution in [0.0, 0.5] {
            let scene = shipped("wall", &[&format!("walls.wall.restitution={restitution}")]);
            let [first, second] = std::array::from_fn(|_| watched(&scene, &by(method, 4.0, 0.01, 1e-9)));
            assert_eq!(first.1, second.1);
            assert_eq!(
                (&first.0.impacts, &first.0.holds, first.0.statistics),
                (&second.0.impacts, &second.0.holds, second.0.statistics)
            );
            assert_eq!(first.0.persistent_contact_time.to_bits(), second.0.persistent_contact_time.to_bits());
        }
    }
}

#[test]
fn a_run_that_begins_at_rest_on_a_wall_stays_there() {
    for method in LOCATED {
        let mechanism: Arc<Mechanism> = compile(&against(0.5, 0.5, 1.0));
        assert_eq!(mechanism.staying(&[0], Default::default(), [&[0.5], &[0.0]], 1e-11), Some(vec![0]));
        assert_eq!(mechanism.staying(&[0], Default::default(), [&[0.5], &[1e-3]], 1e-11), Some(vec![]));
        let outcome = run(&against(0.5, 0.5, 1.0), &by(method, 5.0, 0.1, 1e-10));
        assert_eq!((outcome.stop, outcome.impact_count, outcome.persistent_contact_time), (None, 0, 5.0));
        assert_eq!(outcome.last.imbalance, 0.0);
    }
}
