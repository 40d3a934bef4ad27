//! Constraint drift under the four stabilizations.
//!
//! The constant-speed motor's row is linear, so every Runge–Kutta method keeps it to rounding from a
//! consistent start and a test on that proves nothing: starts here are 1e-6 rad/s off, or the law has a sine
//! in it.

use crate::common;

use common::{run, run_from, shipped};
use driftless::dynamics::constraint::angle_equation;
use driftless::dynamics::kernel::Kernel;
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::{Form, Mechanism, Motion, State, Time};
use driftless::run::{Limits, MethodId, Outcome, Problem, Request, Stabilization};
use driftless::scene::{Law, Scene};
use driftless::stabilization::{Projected, projection};
use driftless::stepping::{Cause, Dp8, Integrator, Reached, Seen, Statistics, Tolerance};
use std::sync::Arc;

/// How far off the start is \[rad/s\].
const OFF: f64 = 1e-6;

fn request(stabilize: Stabilization, until: f64) -> Request {
    Request {
        method: Some(MethodId::Dp8),
        stabilize: Some(stabilize),
        rtol: Some(1e-10),
        until: Some(until),
        every: Some(0.1),
        ..Request::default()
    }
}

/// A run whose driven body starts off its law.
fn off_start(scene: &Scene, request: &Request) -> Outcome {
    let mechanism = common::compile(scene);
    let mut start = mechanism.start(scene);
    start.omega[0] = start.omega[0] + OFF;
    let outcome = run_from(scene, &mechanism, request, Limits::default(), &start);
    assert_eq!(outcome.stop, None);
    outcome
}

/// Largest violations at both levels from time `after` \[s\] on.
fn violation_after(outcome: &Outcome, after: f64) -> [f64; 2] {
    let late = outcome.trace.head.iter().filter(|sample| sample.t >= after);
    late.fold([0.0; 2], |most: [f64; 2], sample| {
        [0, 1].map(|level| most[level].max(sample.constraints[0][level].abs()))
    })
}

#[test]
fn from_a_bad_start_the_plain_run_drifts_and_the_stabilized_ones_return() {
    let scene = shipped("motor", &[]);
    let plain = off_start(&scene, &request(Stabilization::None, 100.0));
    // C' stays at 1e-6 rad/s, so C is 1e-4 rad after 100 s: a straight line.
    let [position, velocity] = &plain.drift.constraints[0].1;
    assert!((position.max - 1e-4).abs() < 1e-8 && (velocity.max - OFF).abs() < 1e-10);
    assert!((position.slope() - OFF).abs() < 0.01 * OFF);
    assert_eq!(plain.drift.stabilizer, 0.0);

    let pulled = off_start(&scene, &request(Stabilization::Baumgarte, 100.0));
    let time_constant = pulled.plan.time_constant.expect("a time constant");
    assert!(pulled.plan.notes.iter().any(|note| note.contains("Baumgarte")), "it is reported");
    let [position, velocity] = violation_after(&pulled, 40.0 * time_constant);
    println!("Baumgarte T {time_constant:e}: {position:e} {velocity:e}");
    assert!(position <= 1e-8 && velocity <= 1e-8, "{position:e} {velocity:e}");

    let projected = off_start(&scene, &request(Stabilization::Projection, 100.0));
    let [position, velocity] = violation_after(&projected, 0.1);
    println!("projection: {position:e} {velocity:e}");
    assert!(position <= 1e-13 && velocity <= 1e-13, "{position:e} {velocity:e}");
    // From the first output on nothing grows; the one excursion at t = 0 pulls the fitted slope down, never
    // up.
    assert!(projected.drift.constraints[0].1.iter().all(|level| level.slope() <= 1e-17));

    // Elimination has no such unknown: the start's error is not even seen.
    let eliminated = off_start(&scene, &request(Stabilization::Elimination, 100.0));
    assert!(eliminated.drift.constraints[0].1.iter().all(|level| level.max == 0.0));
}

/// The motor with a sine over `until` seconds by all four.
fn sine(until: f64) {
    let scene = shipped("motor_sine", &[]);
    for stabilize in Stabilization::ALL {
        let outcome = run(&scene, &request(stabilize, until));
        assert_eq!(outcome.stop, None);
        let levels = &outcome.drift.constraints[0].1;
        let [position, velocity] = [levels[0].max, levels[1].max];
        let [position_climb, velocity_climb] = [levels[0].slope() * until, levels[1].slope() * until];
        println!(
            "{stabilize}: {position:.1e} {velocity:.1e}, climbs {position_climb:.1e} {velocity_climb:.1e}"
        );
        match stabilize {
            // Measured 2.4e-12 rad at 100 s: what the tolerance leaves; it may wander.
            Stabilization::None => assert!(position < 1e-9 && velocity < 1e-9, "{position:e} {velocity:e}"),
            // Measured 1.9e-10 and 1.6e-9, with a time constant of five steps that no output time cuts short:
            // the law's sine is what it follows with a lag, so it is worse than none here, but stands.
            Stabilization::Baumgarte => {
                assert!(position < 1e-9 && velocity < 5e-9, "{position:e} {velocity:e}");
                assert!(position_climb.abs() < 0.5 * position && velocity_climb.abs() < 0.5 * velocity);
                assert!(outcome.plan.time_constant.is_some());
            }
            Stabilization::Projection => {
                assert!(position < 1e-12 && velocity < 1e-12, "{position:e} {velocity:e}");
                assert!(
                    position_climb.abs() < 1e-14 && velocity_climb.abs() < 1e-14,
                    "{position_climb:e} {velocity_climb:e}"
                );
            }
            Stabilization::Elimination => assert_eq!((position, velocity), (0.0, 0.0)),
        }
    }
}

#[test]
fn the_motor_with_a_sine_keeps_its_constraint() {
    sine(100.0);
}

#[test]
#[ignore = "half a minute: 1e3 s by all four"]
fn long_the_motor_with_a_sine_keeps_its_constraint() {
    sine(1000.0);
}

/// The energy projection moves is booked: it is the difference between the projected and the plain end of the
/// first step.
#[test]
fn the_stabilizers_energy_is_the_jump_it_makes() {
    let scene = shipped("motor", &[]);
    let mechanism = common::compile(&scene);
    let mut start = mechanism.start(&scene);
    start.omega[0] = start.omega[0] + OFF;
    let end = |method: &mut dyn Integrator<dyn Problem>| {
        let mut form = Multiplier::<2, true>::new(Arc::clone(&mechanism));
        let mut state = form.state(&start);
        state.memory = vec![1e-3];
        let mut statistics = Statistics::default();
        let reached =
            method.advance(&mut form, &mut state, Time::from(1e-3), &mut statistics, &mut |_, _| {
                Ok(Seen::Kept)
            });
        assert_eq!((reached, statistics.steps), (Ok(Reached::Until), 1));
        let mut motion = Motion::default();
        form.read(&state, &mut motion);
        let mut kernel = Kernel::without_rows(&mechanism);
        (mechanism.energy(&mut kernel, &motion.phi, &motion.omega).total(), motion.stabilizer)
    };
    let loose = Tolerance { relative: 1e-6, absolute: 1e-6 };
    let (plain, none) = end(&mut Dp8::new(loose));
    let (projected, booked) = end(&mut Projected::new(Dp8::new(loose)));
    let jump = (projected - plain).hi;
    println!("jump {jump:e}, booked {booked:e}");
    // About (M w)_1 · 1e-6, which is 2.5e-7 J times the mass ratio that stays with bar 1.
    assert_eq!(none, 0.0);
    assert!(jump.abs() > 1e-8 && (booked - jump).abs() < 1e-14, "{booked:e} is not {jump:e}");

    // And in a whole run the figure stays about what the first projection made it; energy less work less this
    // closes.
    let outcome = off_start(&scene, &request(Stabilization::Projection, 10.0));
    let relative = outcome.last.imbalance - outcome.last.stabilizer / mechanism.energy_scale;
    println!("run: booked {:e}, rest {relative:e}", outcome.drift.stabilizer);
    // Its first step is not the one above, so the bars stand a little elsewhere.
    assert!((outcome.drift.stabilizer - booked).abs() < 0.15 * booked.abs());
    assert!(relative.abs() < 1e-8, "{relative:e}");
    let pulled = off_start(&scene, &request(Stabilization::Baumgarte, 10.0));
    assert!(pulled.drift.stabilizer_max > 1e-9, "Baumgarte's energy is booked too");
    let relative = pulled.last.imbalance - pulled.last.stabilizer / mechanism.energy_scale;
    assert!(relative.abs() < 1e-8, "{relative:e}");
}

#[test]
fn a_relative_motor_is_kept_too() {
    let mut scene = shipped("motor_sine", &[]);
    (scene.motors[0].bar, scene.motors[0].relative_to) = (1, Some(0));
    (scene.motors[0].law.start, scene.motors[0].law.rate) = (0.0, 1.0);
    scene.start[0].omega = 0.0;
    (scene.start[1].phi, scene.start[1].omega) = (scene.start[0].phi, 2.0);
    let ends: Vec<f64> = Stabilization::ALL
        .into_iter()
        .map(|stabilize| {
            let outcome = run(&scene, &request(stabilize, 20.0));
            assert_eq!(outcome.stop, None);
            let [position, velocity] = &outcome.drift.constraints[0].1;
            let bound = if matches!(stabilize, Stabilization::None | Stabilization::Baumgarte) {
                1e-7
            } else {
                1e-12
            };
            assert!(
                position.max < bound && velocity.max < bound,
                "{stabilize}: {:e} {:e}",
                position.max,
                velocity.max
            );
            outcome.trace.head[20].phi[0]
        })
        .collect();
    assert!(ends.iter().all(|phi| (phi - ends[3]).abs() < 1e-6), "{ends:?}");
}

/// Projection that cannot succeed says so: two rows that contradict one another have no solution at all.
#[test]
fn a_failed_projection_is_a_typed_stop() {
    let scene = shipped("motor_sine", &[]);
    let mechanism = common::compile(&scene);
    let start = mechanism.start(&scene);
    let mut contradictory: Mechanism = (*mechanism).clone();
    contradictory.constraints.push(angle_equation("lock", 0, None, Law::constant(0.5)));
    let contradictory = Arc::new(contradictory);
    let form: &mut dyn Problem = &mut Multiplier::<2, true>::new(Arc::clone(&contradictory));
    let mut state = form.state(&start);
    let mut method = Projected::new(Dp8::new(Tolerance::default()));
    let stop = method
        .advance(form, &mut state, Time::from(1.0), &mut Statistics::default(), &mut |_, _| Ok(Seen::Kept));
    let stop = stop.expect_err("a stop");
    assert_eq!(stop.cause, Cause::ProjectionFailed);
    assert!(stop.what.contains("motor") || stop.what.contains("lock"), "{stop}");

    let mut kernel = Kernel::new(&contradictory);
    let mut state: State = form.state(&start);
    let (row, _) =
        projection::project(&contradictory, &mut kernel, &mut state, 1e-13).expect_err("a failure");
    assert!(row == "motor" || row == "lock");
}
