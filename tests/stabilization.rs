//! The same scene under every stabilization, by every method that takes it.

use crate::common;

use crate::formulas::{adaptive, scene};
use common::shipped;
use driftless::run::{Limits, MethodId, Outcome, Plan, Request, Run, Stabilization, integrate};
use driftless::stepping::Cause;
use std::sync::Arc;

fn run(scene: &str, request: &Request) -> Outcome {
    let scene = shipped(scene, &[]);
    let mechanism = common::compile(&scene);
    let plan = Plan::new(&scene, &mechanism, request).expect("a sensible pairing");
    let start = mechanism.start(&scene);
    let run = Run::new(Arc::clone(&mechanism), plan, Limits::default(), &start).expect("a beginning");
    let outcome = integrate(run, &mut |_| Ok(())).expect("no observer fails");
    assert_eq!(outcome.stop, None);
    outcome
}

fn request(method: MethodId, stabilize: Stabilization) -> Request {
    Request {
        method: Some(method),
        stabilize: Some(stabilize),
        until: Some(3.0),
        every: Some(0.1),
        ..Request::default()
    }
}

/// The pilot run goes through corners of laws and bounces as the run does: Baumgarte's time constant is five mean
/// steps of the run without stabilization.
#[test]
fn a_pilot_run_makes_the_steps_of_the_run() {
    let text = |wall: &str| {
        format!(
            r#"{{"name": "corners", "gravity": [0, 0],
        "bars": [{{"name": "a", "mass": 1, "centre": [0.3, 0], "inertia": 0.03, "length": 0.6}},
            {{"name": "b", "mass": 1, "centre": [0.3, 0], "inertia": 0.03, "length": 0.6}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}},
            {{"name": "B", "between": [{{"body": "a", "point": [0.6, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
        "motors": [{{"name": "M", "body": "a", "law": {{"start": 0, "rate": 0.1}}}}],
        "torques": [{{"name": "T", "body": "b", "torque": "if(b.phi < 0.5, 2+40*b.phi^3, -3)-0.3*b.omega"}}]{wall},
        "start": {{"b": {{"phi": 0.3, "omega": 0}}}}, "until": 2, "every": 0.1}}"#
        )
    };
    let wall = r#", "walls": [{"name": "W", "body": "b", "point": [0.6, 0], "restitution": 0.8,
        "line": {"through": [0, 0.35], "normal": [0, -1]}}]"#;
    for text in [text(""), text(wall)] {
        let by = |stabilize| {
            let request = Request { stabilize: Some(stabilize), ..adaptive(MethodId::Dp8, 1e-9) };
            crate::formulas::run(&scene(&text), &request)
        };
        let (plain, pulled) = (by(Stabilization::None), by(Stabilization::Baumgarte));
        let mean = 2.0 / plain.statistics.steps as f64;
        let constant = pulled.plan.time_constant.expect("it was measured");
        assert!((constant / (5.0 * mean) - 1.0).abs() < 1e-12, "{constant} {mean}");
        assert!(pulled.statistics.steps < 2 * plain.statistics.steps, "{:?}", pulled.statistics);
    }
}

/// The pilot run that measures Baumgarte's time constant is allowed no more than the run: what stops it stops
/// the run itself, with all that was reached by then.
#[test]
fn a_pilot_run_that_stops_keeps_no_run_from_beginning() {
    let scene = shipped("motor", &[]);
    let mechanism = common::compile(&scene);
    // Not one step, and a few.
    for most in [1, 40] {
        let request =
            Request { max_evaluations: Some(most), ..request(MethodId::Dp8, Stabilization::Baumgarte) };
        let plan = Plan::new(&scene, &mechanism, &request).expect("a sensible pairing");
        let start = mechanism.start(&scene);
        let run = Run::new(Arc::clone(&mechanism), plan, Limits::default(), &start).expect("a beginning");
        let outcome = integrate(run, &mut |_| Ok(())).expect("no observer fails");
        assert_eq!(outcome.stop.expect("the maximum is used up").cause, Cause::EffortExhausted);
        let constant = outcome.plan.time_constant.expect("it was measured");
        assert!((1e-4..1.0).contains(&constant), "{most} evaluations: {constant} s");
    }
}

#[test]
fn the_same_scene_run_all_four_ways_agrees() {
    for scene in ["motor", "motor_sine"] {
        let reference =
            run(scene, &Request { rtol: Some(1e-13), ..request(MethodId::Dp8, Stabilization::Elimination) })
                .last;
        for method in [MethodId::Dp8, MethodId::Dp5, MethodId::Dop853, MethodId::Dopri5, MethodId::Taylor] {
            for stabilize in Stabilization::ALL {
                if stabilize == Stabilization::Projection
                    && matches!(method, MethodId::Dop853 | MethodId::Dopri5)
                {
                    continue;
                }
                if (method, stabilize) == (MethodId::Taylor, Stabilization::Baumgarte) {
                    continue;
                }
                let outcome = run(scene, &Request { rtol: Some(1e-9), ..request(method, stabilize) });
                for k in 0..2 {
                    let error = (outcome.last.phi[k] - reference.phi[k]).abs();

                    assert!(error < 1e-6, "{scene} {method} {stabilize}: {error:e}");
                }
            }
        }
    }
}

/// What is left of rates by factors of a place 1e-8 rad behind is taken off as well: coarse steps of linkages
/// stopped at 1e-12 of a constraint.
#[test]
fn coarse_steps_of_linkages_are_put_back_to_rounding() {
    for (scene, method, rtol, end) in [
        ("crank_rocker", MethodId::Dp5, 1e-4, None),
        ("crank_rocker", MethodId::Dp8, 1e-3, None),
        ("quick_return", MethodId::Radau(5), 1e-3, Some(0.5)),
    ] {
        let request = Request {
            method: Some(method),
            rtol: Some(rtol),
            stabilize: Some(Stabilization::Projection),
            until: end,
            ..Request::default()
        };
        let outcome = run(scene, &request);
        assert!(outcome.stop.is_none(), "{scene} by {method}: {:?}", outcome.stop);
        for (name, [position, rate]) in &outcome.drift.constraints {
            assert!(position.max < 1e-12 && rate.max < 1e-11, "{scene} by {method}: {name}");
        }
    }
}
