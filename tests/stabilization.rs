//! The same scene under every stabilization, by every method that takes it.

use crate::common;

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
