//! Radau IIA on stiff scenes: reference results, what stiffness costs, constraints, impacts, output times,
//! and the same bits again.

use crate::common;

use common::{run, shipped};
use driftless::run::{MethodId, Outcome, Request, Stabilization};
use driftless::scene::Scene;
use driftless::stepping::Cause;

const RADAU: [MethodId; 2] = [MethodId::Radau(3), MethodId::Radau(5)];

/// The pendulum on its spring with another stiffness \[times the source's\] and damping \[N·s/m\], from where
/// the spring has its free length.
fn sprung(factor: f64, damping: f64) -> Scene {
    let mut scene = shipped("spring", &[]);
    (scene.springs[0].stiffness, scene.springs[0].damping) = (7.394_287_5 * factor, damping);
    (scene.start[0].phi, scene.start[1].phi) = (1.955_193_101_290_539_7, std::f64::consts::FRAC_PI_2);
    (scene.until, scene.every) = (1.0, 1.0);
    scene
}

/// Damped by c = sqrt(k m), more or less: the fast mode dies within a period.
fn damped(factor: f64) -> Scene {
    sprung(factor, 0.6675 * factor.sqrt())
}

fn request(method: MethodId, rtol: f64) -> Request {
    Request { method: Some(method), rtol: Some(rtol), ..Request::default() }
}

fn finished(scene: &Scene, request: &Request) -> Outcome {
    let outcome = run(scene, request);
    assert_eq!(outcome.stop, None, "{request:?}");
    outcome
}

/// The largest error of angles, and of rates over one where they are larger.
fn error(outcome: &Outcome, reference: [f64; 4]) -> f64 {
    let last = &outcome.last;
    let found = [last.phi[0], last.phi[1], last.omega[0], last.omega[1]];
    found.iter().zip(reference).fold(0.0, |most: f64, (found, expected)| {
        most.max((found - expected).abs() / expected.abs().max(1.0))
    })
}

/// Ends at t = 1 s by quadruple-precision power series of another program.
#[test]
fn damped_stiff_springs_and_stiff_dampers_end_where_they_should() {
    let mut overdamped = sprung(1.0, 1e4);
    overdamped.start[0].phi = std::f64::consts::FRAC_PI_2;
    let cases = [
        (
            "1e4",
            sprung(1e4, 66.75),
            [1.95511613966919, -0.817363854844559, -0.000721351944509091, 5.78719418763749],
        ),
        (
            "1e8",
            sprung(1e8, 6675.0),
            [1.95519309352313, -0.816910259568464, -7.274967776876e-08, 5.78924947979239],
        ),
        ("1e12", sprung(1e12, 667_500.0), [1.95519310129054, -0.816910213412392, 0.0, 5.78924968619113]),
        (
            "overdamped",
            overdamped,
            [1.57025959897675, -0.816185285177676, -0.000803989894191429, 5.78831618540318],
        ),
    ];
    for (name, scene, reference) in cases {
        for (method, tolerance, bound) in
            [(RADAU[0], 1e-6, 2e-6), (RADAU[0], 1e-9, 1e-9), (RADAU[1], 1e-6, 2e-6), (RADAU[1], 1e-9, 1e-10)]
        {
            let outcome = finished(&scene, &request(method, tolerance));
            let (error, statistics) = (error(&outcome, reference), outcome.statistics);
            println!("{name} {method} {tolerance:e}: {error:.1e}, {statistics:?}");
            assert!(error < bound, "{name} {method} {tolerance:e}: {error:e}");
            assert!(
                outcome.drift.energy.max < 100.0 * tolerance,
                "{name} {method}: {:e}",
                outcome.drift.energy.max
            );
        }
    }
}

/// Without forces from stretches in double-double their rounding would drive the steps down from 1e8 on.
#[test]
fn nine_orders_of_stiffness_do_not_cost_twice_the_evaluations() {
    for method in RADAU {
        let costs: Vec<u64> = (3..=12)
            .map(|power| finished(&damped(10f64.powi(power)), &request(method, 1e-6)).statistics.evaluations)
            .collect();
        println!("{method}: {costs:?}");
        assert!(costs.iter().all(|&cost| cost <= 2 * costs[0]), "{method}: {costs:?}");
    }
    let explicit = run(&damped(1e6), &request(MethodId::Dop853, 1e-6)).statistics.evaluations;
    assert!(
        explicit > 10 * finished(&damped(1e6), &request(RADAU[0], 1e-6)).statistics.evaluations,
        "{explicit}"
    );
}

#[test]
fn a_spring_that_swings_is_followed_where_the_tolerance_asks_for_it_and_its_loss_is_announced() {
    let reference = [1.95510450394041, -0.817385613970845, -0.0267617107153523, 5.75079011960739];
    for method in RADAU {
        let outcome = finished(&sprung(1e4, 0.0), &request(method, 1e-8));
        assert!(error(&outcome, reference) < 1e-4, "{method}: {:e}", error(&outcome, reference));
        let mut excited = sprung(1e6, 0.0);
        excited.start[0].phi += 1e-3;
        let notes = finished(&excited, &Request { until: Some(0.01), ..request(method, 1e-4) }).plan.notes;
        assert!(notes.iter().any(|note| note.contains("takes its energy away")), "{notes:?}");
    }
}

#[test]
fn loops_motors_and_every_stabilization_agree_with_the_power_series() {
    for (name, until, kinds) in [
        (
            "four_bar_motor",
            0.5,
            &[Stabilization::Projection, Stabilization::None, Stabilization::Baumgarte][..],
        ),
        (
            "motor_sine",
            1.0,
            &[Stabilization::Elimination, Stabilization::Projection, Stabilization::Baumgarte],
        ),
        ("cart_pole", 1.0, &[Stabilization::Projection]),
    ] {
        let scene = shipped(name, &[]);
        let ask = |method, rtol, stabilize| Request {
            until: Some(until),
            every: Some(until),
            stabilize,
            ..request(method, rtol)
        };
        let reference = finished(&scene, &ask(MethodId::Taylor, 1e-13, None));
        for method in RADAU {
            for &kind in kinds {
                let outcome = finished(&scene, &ask(method, 1e-9, Some(kind)));
                let apart = outcome
                    .last
                    .phi
                    .iter()
                    .zip(&reference.last.phi)
                    .fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
                assert!(apart < 3e-7, "{name} {method} {kind}: {apart:e}");
                if kind == Stabilization::Projection {
                    let kept = outcome
                        .drift
                        .constraints
                        .iter()
                        .all(|(_, levels)| levels[0].max < 1e-12 && levels[1].max < 1e-10);
                    assert!(kept, "{name} {method}: {:?}", outcome.drift.constraints);
                }
            }
        }
    }
}

#[test]
fn impacts_are_located_inside_its_steps() {
    let scene = shipped("wall", &[]);
    let ask = |method, rtol| Request { until: Some(1.0), every: Some(0.25), ..request(method, rtol) };
    let reference = finished(&scene, &ask(MethodId::Taylor, 1e-13));
    for method in RADAU {
        let outcome = finished(&scene, &ask(method, 1e-10));
        assert_eq!(outcome.impact_count, reference.impact_count, "{method}");
        for (found, expected) in outcome.impacts.iter().zip(&reference.impacts) {
            assert!((found.t - expected.t).abs() < 1e-6, "{method}: {} {}", found.t, expected.t);
        }
    }
}

/// Rows are read off the polynomial of a step and do not cut it; the same run twice has the same bits.
#[test]
fn looking_more_often_changes_nothing_of_the_motion() {
    for method in RADAU {
        let scene = damped(1e6);
        let ends = [1.0, 0.01, 0.01]
            .map(|every| finished(&scene, &Request { every: Some(every), ..request(method, 1e-7) }));
        let [once, often, again] = &ends;
        assert_eq!(
            (&once.last.phi, &once.last.omega, once.statistics),
            (&often.last.phi, &often.last.omega, often.statistics),
            "{method}"
        );
        assert_eq!((&often.last, &often.drift), (&again.last, &again.drift), "{method}");
        // In between the polynomial is as good as the tolerance.
        let half = |every| {
            finished(&scene, &Request { until: Some(0.5), every: Some(every), ..request(method, 1e-7) })
                .last
                .phi[1]
        };
        let middle = {
            let mut middle = f64::NAN;
            let ask = Request { every: Some(0.5), ..request(method, 1e-7) };
            driftless::run::simulate(&scene, &ask, &mut |sample| {
                if sample.t == 0.5 {
                    middle = sample.phi[1];
                }
                Ok(())
            })
            .expect("a run");
            middle
        };
        assert!((half(0.5) - middle).abs() < 1e-5, "{method}: {} {middle}", half(0.5));
    }
}

/// A pendulum's velocity has no direction where it turns round: no constraint and no stabilizer is to blame.
#[test]
fn a_formula_without_a_derivative_is_told_of() {
    let text = r#"{"name": "turns", "gravity": [0, -9.81],
        "bars": [{"name": "a", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}],
        "hinges": [{"name": "H", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]}],
        "points": [{"name": "P", "body": "a", "point": [0.5, 0]}], "integrals": {"I": "atan2(P.vy, P.vx)"},
        "start": {"a": {"phi": -0.5, "omega": 0.3}}, "until": 1, "every": 1}"#;
    let scene = driftless::scene::parse_scene(text, "turns", &[]).expect("a scene");
    let stops: Vec<_> = RADAU.iter().filter_map(|&method| run(&scene, &request(method, 1e-9)).stop).collect();
    assert!(!stops.is_empty());
    for stop in stops {
        assert_eq!(stop.cause, Cause::NotFinite, "{stop}");
        assert!(stop.what.contains("a derivative") && stop.hint.contains("atan2"), "{stop}");
    }
}

#[test]
fn what_is_not_finite_ends_in_a_typed_stop() {
    // The spring passes through length zero, where its force has no direction.
    let mut scene = shipped("spring", &[]);
    scene.springs[0].between[0].point = [0.4, 0.0];
    (scene.springs[0].stiffness, scene.springs[0].free_length) = (20.0, 0.1);
    (scene.start[0].phi, scene.start[0].omega) = (0.5, -4.0);
    (scene.start[1].phi, scene.start[1].omega) = (0.3, 0.0);
    for method in RADAU {
        let outcome = run(&scene, &Request { until: Some(0.2), every: Some(0.01), ..request(method, 1e-8) });
        let stop = outcome.stop.expect("a stop");
        assert_eq!(stop.cause, Cause::SpringWithoutLength, "{stop}");
        assert!((stop.t - 0.0953).abs() < 1e-3, "{stop}");
    }
    assert!(driftless::stepping::Radau::new(4, Default::default()).is_none());
}

/// A bar about its end, and another the same, each with a torque that feeds its rate:
/// omega' = lambda omega, lambda = torque/inertia about the pin.
fn fed(lambda: f64, until: f64) -> Scene {
    let bar = |name: &str| {
        format!(r#"{{"name": "{name}", "mass": 3, "centre": [0.5, 0], "inertia": 0.25, "length": 1}}"#)
    };
    let hinge = |name: &str| {
        format!(
            r#"{{"name": "of_{name}", "between": [{{"body": "ground", "point": [0, 0]}},
                {{"body": "{name}", "point": [0, 0]}}]}}"#
        )
    };
    let torque = |name: &str| {
        format!(r#"{{"name": "feeds_{name}", "body": "{name}", "torque": "{lambda}*{name}.omega"}}"#)
    };
    let two = |each: &dyn Fn(&str) -> String| [each("a"), each("b")].join(", ");
    let text = format!(
        r#"{{"name": "fed", "gravity": [0, 0], "bars": [{}], "hinges": [{}], "torques": [{}],
            "start": {{"a": {{"phi": 0.3, "omega": 1e-6}}, "b": {{"phi": 1, "omega": 2e-6}}}},
            "until": {until}, "every": {until}}}"#,
        two(&bar),
        two(&hinge),
        two(&torque)
    );
    driftless::scene::parse_scene(&text, "fed.json", &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// What grows is resolved though steps far longer than 1/lambda would damp it, and their error estimate with
/// it: omega = omega(0) exp(lambda t).
#[test]
fn a_fast_mode_that_grows_is_not_damped() {
    for (method, rtol) in [(RADAU[0], 1e-6), (RADAU[1], 1e-6), (RADAU[1], 1e-9)] {
        let outcome = finished(&fed(3e8, 6e-8), &request(method, rtol));
        for (omega, start) in outcome.last.omega.iter().zip([1e-6, 2e-6]) {
            let share = omega / (start * 18.0_f64.exp());
            assert!((share - 1.0).abs() < 1e-2, "{method} at {rtol:e}: {omega}, {share} of it");
        }
        // Up to 0.5 s it grows beyond all numbers, and no run comes to an end.
        let few = Request { max_evaluations: Some(3000), ..request(method, rtol) };
        let stop = run(&fed(3e8, 0.5), &few).stop.expect("a stop");
        assert!(stop.t < 3e-6 && !stop.to_string().contains("0.0000"), "{stop}");
    }
}

/// The words are those of growth, and no spring is called rigid where there is none.
#[test]
fn growth_is_told_as_growth() {
    let plan = |method, until| {
        let scene = fed(3e8, until);
        driftless::run::Plan::new(&scene, &common::compile(&scene), &request(method, 1e-9))
    };
    let told = plan(RADAU[0], 0.1).expect("a plan").notes.join("; ");
    assert!(told.contains("grows at 3e8 /s at the start; radau5 takes short steps"), "{told}");
    for method in [MethodId::Taylor, RADAU[1]] {
        let refusal = plan(method, 0.5).expect_err("a refusal").to_string();
        assert!(refusal.contains("it grows at 3e8 /s at the start"), "{refusal}");
        assert!(!refusal.contains("rigid") && !refusal.contains("oscillates"), "{refusal}");
    }
}
