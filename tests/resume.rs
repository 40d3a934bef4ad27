//! A run that is taken down and goes on elsewhere comes out as if nothing had been: bit for bit, wherever it paused and how often.

mod common;

use common::shipped;
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::{Form, Mechanism};
use driftless::run::{Limits, METHODS, MethodId, Outcome, Plan, Request, Run, Running, Sample, Snapshot, Stabilization};
use driftless::scene::Scene;
use driftless::stepping::{Cause, Dp8, Method, Reached, Seen, Tally, Taylor, Tolerance};
use std::sync::Arc;
use std::time::Duration;

/// A run of a scene, begun.
fn begun(scene: &Scene, request: &Request) -> Result<Running, String> {
    let mechanism = Arc::new(Mechanism::new(scene).map_err(|error| error.to_string())?);
    let plan = Plan::new(scene, &mechanism, request).map_err(|refusal| refusal.to_string())?;
    let run = Run::new(Arc::clone(&mechanism), plan, Limits::default(), &mechanism.start(scene)).map_err(|stop| stop.to_string())?;
    Ok(Running::new(run))
}

/// Everything a run shows and leaves, to the bit: `{:?}` of a double reads back to the same one.
fn told(samples: &[Sample], mut outcome: Outcome) -> String {
    outcome.wall = Duration::ZERO;
    format!("{samples:?} {outcome:?}")
}

fn uninterrupted(scene: &Scene, request: &Request) -> Result<String, String> {
    let mut running = begun(scene, request)?;
    let mut samples = Vec::new();
    let keep = &mut |sample: &Sample| {
        samples.push(sample.clone());
        Ok(())
    };
    assert!(running.go(keep, &mut || false).expect("samples are kept"));
    Ok(told(&samples, running.finish()))
}

/// The same, paused where `pause` says so; at every pause all goes through bytes into a new run.
fn interrupted(scene: &Scene, request: &Request, pause: &mut dyn FnMut() -> bool) -> (String, u32) {
    let mut running = begun(scene, request).expect("it began before");
    let (mut samples, mut pauses) = (Vec::new(), 0);
    loop {
        let keep = &mut |sample: &Sample| {
            samples.push(sample.clone());
            Ok(())
        };
        if running.go(keep, pause).expect("samples are kept") {
            return (told(&samples, running.finish()), pauses);
        }
        pauses += 1;
        let bytes = postcard::to_stdvec(&running.snapshot()).expect("bytes");
        let snapshot: Snapshot = postcard::from_bytes(&bytes).expect("a snapshot");
        let mechanism = Arc::new(Mechanism::new(scene).expect("equations"));
        let start = mechanism.start(scene);
        running = Running::resume(mechanism, &start, snapshot).expect("it fits");
    }
}

/// True at about one of `every` calls.
fn now_and_then(seed: u64, every: u64) -> impl FnMut() -> bool {
    let mut random = seed;
    move || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33).is_multiple_of(every)
    }
}

#[track_caller]
fn check(scene: &Scene, request: &Request) -> bool {
    let Ok(whole) = uninterrupted(scene, request) else { return false };
    for (seed, every) in [(1, 1), (2, 11)] {
        let (pieces, pauses) = interrupted(scene, request, &mut now_and_then(seed, every));
        assert!(pieces == whole, "{} {request:?}: differs after {pauses} pauses, one in {every}", scene.name);
        assert!(pauses > 0, "{} {request:?}", scene.name);
    }
    true
}

fn request(method: MethodId, stabilize: Option<Stabilization>) -> Request {
    let (until, every) = (Some(1.0), Some(0.25));
    Request { method: Some(method), stabilize, until, every, rtol: method.is_adaptive().then_some(1e-8), ..Request::default() }
}

#[test]
fn every_method_goes_on_bit_for_bit() {
    for info in METHODS {
        for (name, until) in [("free", 1.0), ("spring", 1.0), ("chain8", 0.3)] {
            let request = Request { until: Some(until), ..request(info.id, None) };
            assert!(check(&shipped(name, &[]), &request), "{} {name}", info.name);
        }
    }
}

#[test]
fn so_does_every_stabilization() {
    let mut pairs = 0;
    for info in METHODS {
        for stabilization in Stabilization::ALL {
            let mut scene = shipped("motor_sine", &[]);
            // Off its motor's row, so that there is something to stabilize.
            scene.start[1].omega += 1.0;
            pairs += u32::from(check(&scene, &request(info.id, Some(stabilization))));
        }
    }
    assert!(pairs >= 4 * 5 + 7, "{pairs} pairs");
}

#[test]
fn so_do_impacts_and_points_that_stay_on_their_walls() {
    for method in [MethodId::Dp5, MethodId::Dp8, MethodId::Taylor] {
        for sets in [&[][..], &["walls.wall.restitution=0.3"], &["walls.wall.restitution=0"]] {
            let mut request = request(method, None);
            (request.until, request.every) = (Some(4.0), Some(1.0));
            assert!(check(&shipped("wall", sets), &request), "{method} {sets:?}");
        }
    }
}

#[test]
fn so_do_the_first_orders_in_double_double() {
    for name in ["free", "spring", "motor_sine"] {
        for stabilize in [None, Some(Stabilization::Projection)] {
            let request = Request { extended: true, rtol: Some(1e-20), ..request(MethodId::Taylor, stabilize) };
            let has_rows = name == "motor_sine";
            assert!(check(&shipped(name, &[]), &request) || (stabilize.is_some() && !has_rows), "{name}");
        }
    }
}

/// Steps far longer than the output interval: what is shown lies inside steps that began before the pause.
#[test]
fn so_do_rows_inside_one_step() {
    for name in ["gentle", "hanging", "motor"] {
        let mut request = request(MethodId::Taylor, None);
        (request.until, request.every) = (Some(0.5), Some(0.001));
        assert!(check(&shipped(name, &[]), &request), "{name}");
    }
}

/// A method that stops after so many steps stops after as many where it was cut short on the way.
#[test]
fn a_budget_of_steps_is_not_given_anew() {
    fn stops_at<M: Method<Multiplier<2, false>>>(mut method: M, seen: Seen) -> f64 {
        let (mechanism, start) = common::started("free");
        let mut form = Multiplier::<2, false>::new(mechanism);
        let mut state = form.state(&start);
        loop {
            match method.advance(&mut form, &mut state, 1e3.into(), &mut Tally::default(), &mut |_, _| Ok(seen)) {
                Ok(reached) => assert_eq!(reached, Reached::Pause),
                Err(stop) => {
                    assert_eq!(stop.cause, Cause::TooManySteps);
                    return stop.t;
                }
            }
        }
    }
    let tolerance = Tolerance { relative: 1e-6, absolute: 1e-6 };
    let (mut explicit, mut series) = (Dp8::new(tolerance), Taylor::new(tolerance));
    (explicit.max_steps, series.max_steps) = (40, 40);
    assert_eq!(stops_at(explicit.clone(), Seen::Kept), stops_at(explicit, Seen::Enough));
    assert_eq!(stops_at(series.clone(), Seen::Kept), stops_at(series, Seen::Enough));
}

#[test]
fn the_horizon_can_be_put_off() {
    let trajectory = |told: &str| told.split("] Outcome").next().unwrap_or_default().to_owned();
    for method in [MethodId::Dp8, MethodId::Gauss(4), MethodId::Taylor, MethodId::Dop853] {
        let scene = shipped("free", &[]);
        // A step of its own: the one that is chosen unasked depends on the horizon.
        let short = Request { step: (!method.is_adaptive()).then_some(1.0 / 64.0), ..request(method, None) };
        let long = Request { until: Some(3.1), ..short.clone() };
        let whole = uninterrupted(&scene, &long).expect("a run");
        let mut running = begun(&scene, &short).expect("a run");
        let mut samples = Vec::new();
        let mut calls = 0;
        let mut keep = |sample: &Sample| {
            samples.push(sample.clone());
            Ok(())
        };
        let is_over = running.go(&mut keep, &mut || {
            calls += 1;
            calls == 5
        });
        assert!(!is_over.expect("kept"), "{method}");
        let mut snapshot = running.snapshot();
        assert!(!snapshot.clone().extend(0.5) && !snapshot.clone().extend(1e300) && snapshot.extend(3.1));
        let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
        let start = mechanism.start(&scene);
        let mut running = Running::resume(mechanism, &start, snapshot).expect("it fits");
        assert!(running.go(&mut keep, &mut || false).expect("kept"));
        let outcome = running.finish();
        assert_eq!(outcome.last.t, 3.1);
        assert!(trajectory(&told(&samples, outcome)) == trajectory(&whole), "{method}");
    }
}
