//! The program's own choices lie on its own Pareto front: no setting beats the chosen one by far in time at
//! no worse drift and error.
//!
//! Run times are compared within this process, the least of several runs of each, and a choice is beaten only
//! where it is so three times over: what loads the machine for a while does not decide.

use driftless::{Level, MethodId, Outcome, Request, Simulation, read_scene};
use std::time::{Duration, Instant};

/// Drift of the energy, and error of an angle \[rad\], below which nothing is left to be gained.
const NO_DRIFT: f64 = 1e-13;
const NO_ERROR: f64 = 1e-9;
/// How many times faster a setting must be; two is what is aimed at, the rest is the noise of short runs.
const FASTER: f64 = 3.0;
/// Runs that are over sooner leave nothing to be gained.
const SOON: Duration = Duration::from_millis(1);
/// Runs of the program's choice that take longer are left to `compare`.
const LONGEST: Duration = Duration::from_millis(250);
/// Runs to that horizon \[s\] have a path that is known.
const SHORT: f64 = 2.0;

fn alternatives() -> Vec<(&'static str, Request)> {
    let adaptive = |method, rtol| Request {
        method: Some(method),
        rtol: Some(rtol),
        atol: Some(rtol),
        ..Request::default()
    };
    vec![
        ("taylor 1e-9", adaptive(MethodId::Taylor, 1e-9)),
        ("taylor 1e-12", adaptive(MethodId::Taylor, 1e-12)),
        ("taylor 1e-15", adaptive(MethodId::Taylor, 1e-15)),
        ("taylor extended", Request { method: Some(MethodId::Taylor), extended: true, ..Request::default() }),
        ("dp8 1e-9", adaptive(MethodId::Dp8, 1e-9)),
        ("dp8 1e-12", adaptive(MethodId::Dp8, 1e-12)),
        ("dop853 1e-10", adaptive(MethodId::Dop853, 1e-10)),
        ("radau9 1e-9", adaptive(MethodId::Radau(5), 1e-9)),
        ("gauss16", Request { method: Some(MethodId::Gauss(8)), ..Request::default() }),
    ]
}

/// The outcome of a run, and the least time it took; `None` where it is refused or stops.
fn timed(scene: &driftless::Scene, request: &Request, runs: usize) -> Option<(Outcome, Duration)> {
    let mut best: Option<(Outcome, Duration)> = None;
    for _ in 0..runs {
        let run = Simulation::new(scene).ok()?.options(request.clone()).trust(Level::Off).prepare().ok()?;
        let begin = Instant::now();
        let outcome = driftless::run::integrate(run, &mut |_| Ok(())).ok()?;
        let taken = begin.elapsed();
        if outcome.stop.is_some() {
            return None;
        }
        if best.as_ref().is_none_or(|(_, least)| taken < *least) {
            best = Some((outcome, taken));
        }
    }
    best
}

fn apart(a: &Outcome, b: &Outcome) -> f64 {
    a.last.phi.iter().zip(&b.last.phi).fold(0.0, |most, (a, b)| f64::max(most, (a - b).abs()))
}

/// What beats the choice for a scene and a horizon, told with figures; `None` where the run stops, or takes too long for a test.
fn beaten(scene: &driftless::Scene, until: f64) -> Option<Vec<String>> {
    let horizon = |request: Request| Request { until: Some(until), every: Some(until), ..request };
    let (chosen, time) = timed(scene, &horizon(Request::default()), 1)?;
    if time > LONGEST {
        return None;
    }
    // Of runs as short as these the least of several counts.
    let (chosen, time) = timed(scene, &horizon(Request::default()), 2)
        .map_or((chosen, time), |(again, least)| (again, least.min(time)));
    if time <= SOON {
        return Some(Vec::new());
    }
    // The tightest of another kind stands for the truth.
    let tight = horizon(Request { method: Some(MethodId::Taylor), extended: true, ..Request::default() });
    let truth = (until <= SHORT).then(|| timed(scene, &tight, 1)).flatten().map(|(outcome, _)| outcome);
    let error = |outcome: &Outcome| truth.as_ref().map_or(0.0, |truth| apart(outcome, truth));
    let mut found = Vec::new();
    for (name, request) in alternatives() {
        let request = Request {
            max_evaluations: Some(12 * chosen.statistics.evaluations + 10_000),
            ..horizon(request)
        };
        let Some((other, least)) = timed(scene, &request, 1) else { continue };
        let is_faster = least.as_secs_f64() * FASTER < time.as_secs_f64();
        let drifts_less = other.drift.energy.max <= chosen.drift.energy.max.max(NO_DRIFT);
        if is_faster && drifts_less && error(&other) <= error(&chosen).max(NO_ERROR) {
            found.push(format!(
                "{} to {until} s: {} takes {time:?} for {:e} and {:e}, {name} {least:?} for {:e} and {:e}",
                scene.name,
                chosen.plan.method,
                chosen.drift.energy.max,
                error(&chosen),
                other.drift.energy.max,
                error(&other)
            ));
        }
    }
    Some(found)
}

#[test]
fn no_choice_is_beaten_by_another_setting() {
    let mut scenes: Vec<_> = std::fs::read_dir("examples/scenes")
        .expect("scenes")
        .map(|file| file.expect("a file").path())
        .collect();
    scenes.sort();
    let mut covered = 0;
    let mut all = Vec::new();
    for path in scenes.iter().filter(|path| path.extension().is_some_and(|extension| extension == "json")) {
        let scene = read_scene(path, &[]).expect("a valid scene");
        for until in [SHORT, 150.0] {
            // Andrews' mechanism turns a thousand times a second.
            let until = if scene.until < 1.0 { until * scene.until } else { until };
            let mut last = Vec::new();
            let mut is_measured = false;
            let is_beaten = (0..3).all(|_| {
                let found = beaten(&scene, until);
                is_measured |= found.is_some();
                last = found.unwrap_or_default();
                !last.is_empty()
            });
            covered += usize::from(is_measured);
            if is_beaten {
                all.append(&mut last);
            }
        }
    }
    assert!(all.is_empty(), "{}", all.join("\n"));
    assert!(covered >= 25, "{covered} scenes and horizons");
}

#[test]
fn long_horizons_leave_rounding_as_what_drifts_unless_a_tolerance_is_named() {
    for name in ["free", "motor", "spring"] {
        let scene = read_scene(format!("examples/scenes/{name}.json").as_ref(), &[]).expect("a scene");
        for method in [None, Some(MethodId::Taylor), Some(MethodId::Dp8), Some(MethodId::Dop853)] {
            let request = Request { method, until: Some(100.0), every: Some(1.0), ..Request::default() };
            let outcome = Simulation::new(&scene).expect("equations").options(request).run().expect("a run");
            let drift = outcome.drift.energy.max;
            let bound = if matches!(method, None | Some(MethodId::Taylor)) { 2e-14 } else { 1e-11 };
            assert!(drift < bound, "{name} by {:?}: {drift:e}", outcome.plan.method);
        }
    }
}

#[test]
fn tolerances_reach_what_each_method_makes_use_of() {
    let scene = read_scene("examples/scenes/free.json".as_ref(), &[]).expect("a scene");
    let asked = |method, rtol, extended| {
        let request = Request {
            method: Some(method),
            rtol: Some(rtol),
            atol: Some(rtol),
            extended,
            until: Some(1.0),
            ..Request::default()
        };
        Simulation::new(&scene)
            .expect("equations")
            .options(request)
            .prepare()
            .map(|run| run.plan().tolerance.expect("a tolerance").relative)
    };
    assert_eq!(asked(MethodId::Taylor, 1e-19, false).ok(), Some(1e-19));
    assert_eq!(asked(MethodId::Taylor, 1e-25, true).ok(), Some(1e-25));
    assert_eq!(asked(MethodId::Dp8, 1e-15, false).ok(), Some(1e-15));
    for (method, rtol, extended) in
        [(MethodId::Taylor, 1e-20, false), (MethodId::Taylor, 1e-26, true), (MethodId::Dp8, 1e-16, false)]
    {
        let refused = asked(method, rtol, extended).expect_err("a refusal").to_string();
        assert!(refused.contains("--rtol") && refused.contains(&method.to_string()), "{refused}");
    }
}

/// At 1e-15, the finest default of shorter runs, truncation alone comes to 4e-13 here.
#[test]
fn ten_thousand_seconds_leave_rounding_as_what_drifts() {
    let scene = read_scene("examples/scenes/free.json".as_ref(), &[]).expect("a scene");
    let request = Request {
        method: Some(MethodId::Taylor),
        until: Some(1e4),
        every: Some(100.0),
        ..Request::default()
    };
    let run = Simulation::new(&scene)
        .expect("equations")
        .options(request)
        .trust(Level::Off)
        .prepare()
        .expect("a plan");
    assert_eq!(run.plan().tolerance.expect("a tolerance").relative, 1e-17);
    let outcome = driftless::run::integrate(run, &mut |_| Ok(())).expect("a run");
    assert!(outcome.drift.energy.max < 1e-13, "{:e}", outcome.drift.energy.max);
}
