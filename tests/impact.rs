//! Walls: located strikes, the motion after them, and the stops where the motors leave no freedom.
//!
//! A single bar against a wall has closed forms: it swings to the wall in a quarter period of the pendulum of
//! its amplitude, which the arithmetic- geometric mean gives to rounding, and rebounds with -e times its
//! rate.

use crate::common;

use common::{PENDULUM_SQUARED, compile, pendulum, quarter_period, run, shipped};
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::{Mechanism, State, Time};
use driftless::run::{MethodId, Outcome, Plan, Problem, Request};
use driftless::scene::{Law, Motor, Scene, Wall};
use driftless::stepping::{Cause, Dp8, Integrator, Reached, Seen, Statistics, Tolerance};
use std::f64::consts::PI;
use std::sync::Arc;

/// A bar that hangs down at `angle` against a wall through its hinge, on the side of smaller angles.
fn bouncing(angle: f64, start: f64, restitution: f64) -> Scene {
    let mut scene = pendulum(start, 0.0);
    scene.walls.push(wall("wall", angle, restitution));
    scene
}

fn wall(name: &str, angle: f64, restitution: f64) -> Wall {
    let normal = [-angle.sin(), angle.cos()];
    Wall {
        name: name.into(),
        bar: 0,
        point: [1.0, 0.0],
        on: None,
        through: [0.0, 0.0],
        normal,
        law: None,
        aim: None,
        restitution,
    }
}

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

fn energy_drift(outcome: &Outcome) -> f64 {
    outcome.drift.energy.max
}

#[test]
fn the_first_impact_at_the_very_start_is_case_f() {
    for method in LOCATED {
        for e in [0.0, 0.5, 1.0] {
            let outcome = run(
                &shipped("wall", &[&format!("walls.wall.restitution={e}")]),
                &by(method, 0.005, 0.001, 1e-12),
            );
            assert_eq!(outcome.stop, None, "e = {e}");
            let first = &outcome.impacts[0];
            // Rates from the hand-written solution of tests/published.rs.
            assert_eq!((first.t, first.wall.as_str()), (0.0, "wall"));
            assert!(
                (first.impulse - (1.0 + e) * 7.0 / 6.0 * PI * common::MASS * common::LENGTH).abs() < 1e-13
            );
            assert!(
                (first.energy_lost - 0.5 * first.impulse * (1.0 - e) * 4.0 * PI * common::LENGTH).abs()
                    < 1e-13
            );
            assert!(energy_drift(&outcome) < 1e-11, "{:e}", energy_drift(&outcome));
        }
    }
}

#[test]
fn strikes_come_at_the_quarter_periods_and_an_elastic_wall_keeps_the_energy() {
    for method in LOCATED {
        // Hanging at phi = 0 against the wall, let go at 1 rad: strikes at T/4, 3T/4, 5T/4 ….
        let quarter = quarter_period(1.0);
        let outcome = run(&bouncing(0.0, 1.0, 1.0), &by(method, 200.5 * quarter, 0.1, 1e-12));
        assert_eq!(outcome.stop, None);
        assert_eq!(outcome.impact_count, 100);
        let speed = (2.0 * PENDULUM_SQUARED * (1.0 - 1f64.cos())).sqrt();
        for (j, strike) in outcome.impacts.iter().enumerate() {
            let expected = (2 * j + 1) as f64 * quarter;
            assert!(
                (strike.t - expected).abs() < 1e-9,
                "strike {j} at {} s instead of {expected} s",
                strike.t
            );
            assert!(
                (strike.approach + speed).abs() < 1e-9 && (strike.impulse - 2.0 * speed / 3.0).abs() < 1e-9
            );
            assert!(strike.energy_lost.abs() < 1e-14);
        }
        assert!(energy_drift(&outcome) < 1e-10, "{:e}", energy_drift(&outcome));
    }
}

#[test]
fn at_half_restitution_every_swing_has_a_quarter_of_the_height() {
    for method in LOCATED {
        let outcome = run(&bouncing(0.0, 1.0, 0.5), &by(method, 12.0, 0.01, 1e-12));
        assert_eq!(outcome.stop, None);
        let (mut t, mut height, energy) = (quarter_period(1.0), 1.0 - 1f64.cos(), 5.0);
        for strike in &outcome.impacts[..8] {
            assert!((strike.t - t).abs() < 1e-9, "at {} s instead of {t} s", strike.t);
            assert!((strike.energy_lost - 0.75 * energy * height).abs() < 1e-9);
            height *= 0.25;
            t += 2.0 * quarter_period((1.0 - height).acos());
        }
        // Energy lost is booked, so the balance goes on closing.
        assert!(energy_drift(&outcome) < 1e-10, "{:e}", energy_drift(&outcome));
        assert!(outcome.last.phi[0] >= -1e-14);
    }
}

#[test]
fn the_state_at_a_strike_lies_on_the_wall_to_rounding() {
    for (angle, start) in [(0.0, 1.0), (0.5, 2.0), (-0.7, 1.2)] {
        let scene = bouncing(angle, start, 1.0);
        let mechanism = compile(&scene);
        let form: &mut dyn Problem = &mut Multiplier::<1, false>::new(Arc::clone(&mechanism));
        let mut state: State = form.state(&mechanism.start(&scene));
        let mut method = Dp8::new(Tolerance { relative: 1e-8, absolute: 1e-8 });
        let reached =
            method.advance(form, &mut state, Time::from(10.0), &mut Statistics::default(), &mut |_, _| {
                Ok(Seen::Kept)
            });
        assert_eq!(reached, Ok(Reached::Event(0)));
        let gap = mechanism.contacts[0].row.gap(&[driftless::arithmetic::Complex::unit(state.y[0])]);
        assert!(gap.abs() < 1e-14, "{gap:e} m");
    }
}

/// Without restitution the end slides along the wall, is lifted off by its own weight and thrown back a
/// hundredth of a second later, now pressed. With c = cos and s = sin of the difference of the angles growing
/// at 6 pi /s, gap = 4.2 t² - 430 t³ …: back after about 0.0098 s.
#[test]
fn case_f_without_restitution_is_held_at_its_second_impact() {
    for method in LOCATED {
        let outcome = run(&shipped("wall", &["walls.wall.restitution=0"]), &by(method, 0.02, 0.001, 1e-12));
        assert_eq!(
            (outcome.stop.as_ref(), outcome.impact_count, outcome.persistent_contact_count),
            (None, 2, 1)
        );
        let (second, hold) = (&outcome.impacts[1], &outcome.holds[0]);
        assert!((second.t - 0.0098).abs() < 1e-3 && second.t == hold.t, "{second:?} {hold:?}");
    }
}

/// Two points that reach their walls at the same moment are both struck.
#[test]
fn points_that_touch_at_the_same_moment_are_both_struck() {
    for method in LOCATED {
        // Two equal bars on hinges of their own, mirror images of one another: each must do what one does
        // alone.
        let mut scene = bouncing(0.0, 1.0, 0.5);
        let mut twin = scene.bars[0].clone();
        twin.name = "twin".into();
        scene.bars.push(twin);
        let mut hinge = scene.hinges[0].clone();
        (hinge.name, hinge.between[1].bar) = ("B".into(), Some(1));
        scene.hinges.push(hinge);
        scene.start.push(driftless::scene::Start { phi: -1.0, omega: 0.0 });
        scene.walls.push(Wall {
            name: "other".into(),
            bar: 1,
            normal: [0.0, -1.0],
            ..scene.walls[0].clone()
        });
        let outcome = run(&scene, &by(method, 3.0, 0.1, 1e-10));
        let alone = run(&bouncing(0.0, 1.0, 0.5), &by(method, 3.0, 0.1, 1e-10));
        assert_eq!(outcome.stop, None);
        assert_eq!(outcome.impact_count, 2 * alone.impact_count);
        assert!(
            (outcome.last.phi[0] - alone.last.phi[0]).abs() < 1e-8
                && (outcome.last.phi[0] + outcome.last.phi[1]).abs() < 1e-12
        );
    }
}

/// The nearer of two walls is struck, in whichever order the scene names them.
#[test]
fn of_two_walls_in_one_step_the_nearer_is_struck() {
    for method in LOCATED {
        for names in [["near", "far"], ["far", "near"]] {
            let mut scene = pendulum(1.0, 0.0);
            scene.walls =
                names.map(|name| wall(name, if name == "near" { 0.0 } else { -1e-3 }, 1.0)).to_vec();
            let outcome = run(&scene, &by(method, 5.0, 0.1, 1e-9));
            assert_eq!(outcome.stop, None, "{names:?}");
            assert!(
                outcome.impact_count > 4 && outcome.impacts.iter().all(|strike| strike.wall == "near"),
                "{names:?}: {:?}",
                outcome.impacts
            );
        }
    }
}

#[test]
fn a_point_pressed_against_its_wall_is_held_there() {
    for method in LOCATED {
        // The wall stands at 0.5 rad, where gravity presses the bar into it.  Without restitution it rests at
        // the first strike; with it the strikes come closer and closer to a moment the small-bounce series
        // gives.
        let plastic = run(&bouncing(0.5, 1.0, 0.0), &by(method, 10.0, 0.01, 1e-10));
        assert_eq!(
            (plastic.stop.as_ref(), plastic.impact_count, plastic.persistent_contact_count),
            (None, 1, 1)
        );
        assert_eq!(plastic.holds[0].t, plastic.impacts[0].t);
        let lively = run(&bouncing(0.5, 1.0, 0.5), &by(method, 10.0, 0.01, 1e-10));
        assert_eq!((lively.stop.as_ref(), lively.persistent_contact_count), (None, 1));
        // Under the nearly constant angular acceleration 15 sin 0.5 a rebound at w takes 2 w / (15 sin 0.5),
        // and halves every time.
        let last =
            lively.impacts.iter().rev().find(|strike| strike.approach < -1e-4).expect("a small bounce");
        let rest = last.t + 2.0 * -last.approach / (PENDULUM_SQUARED * 0.5f64.sin());
        assert!((lively.holds[0].t - rest).abs() < 1e-9, "{:?}, not {rest} s", lively.holds[0]);
    }
}

#[test]
fn a_bar_that_comes_to_rest_where_nothing_presses_it_hangs_there() {
    for method in LOCATED {
        // Plastic wall at the lowest point: after the one strike the bar hangs at rest, in contact without
        // force.
        let outcome = run(&bouncing(0.0, 1.0, 0.0), &by(method, 5.0, 0.1, 1e-12));
        assert_eq!((outcome.stop.as_ref(), outcome.impact_count), (None, 1));
        assert!(outcome.last.phi[0].abs() < 1e-12 && outcome.last.omega[0].abs() < 1e-12);
    }
}

#[test]
fn a_motor_that_drives_a_point_into_a_wall_ends_in_a_typed_stop() {
    for method in LOCATED {
        let mut scene = bouncing(0.0, 1.0, 0.5);
        scene.motors.push(Motor {
            name: "motor".into(),
            bar: 0,
            relative_to: None,
            law: Law { start: 1.0, rate: -1.0, acceleration: 0.0, sines: vec![], profile: None },
        });
        scene.start[0].omega = -1.0;
        let stop = run(&scene, &by(method, 5.0, 0.1, 1e-10)).stop.expect("a stop");
        assert_eq!(stop.cause, Cause::RestingContact);
        assert!((stop.t - 1.0).abs() < 1e-9 && stop.what.contains("wall"), "{stop}");
    }
}

#[test]
fn walls_with_methods_that_cannot_locate_impacts_are_refused() {
    let scene = shipped("wall", &[]);
    let mechanism: Arc<Mechanism> = compile(&scene);
    for name in ["gauss16", "gauss4", "rattle4", "dopri5", "dop853"] {
        let request = Request { method: Some(name.parse().expect("a method")), ..Request::default() };
        let refusal = Plan::new(&scene, &mechanism, &request).expect_err(name);
        assert!(
            !refusal.is_usage && refusal.what.contains(name) && refusal.what.contains("walls"),
            "{refusal}"
        );
        assert!(refusal.reason.contains("impact") && refusal.alternative.contains("dp8"), "{refusal}");
    }
}
