//! Gauss methods on stiff scenes: Newton's method where sweeps contract slowly, the published stiff double
//! pendulum, typed stops and refusals, and what is said of stiffness.

use crate::common;

use common::{compile, run, shipped};
use driftless::arithmetic::Complex;
use driftless::dynamics::Stiffness;
use driftless::run::{MethodId, Outcome, Plan, Request};
use driftless::scene::{Bar, Hinge, Place, Scene, Spring, Start, TorsionSpring, parse_scene};
use driftless::stepping::Cause;
use serde_json::{Value, json};

/// Two point masses of 1 kg on massless rods of 1 m, with the energy C² theta²/2 between them: the stiff
/// double pendulum of M. Antoñana, J. Makazaga, A. Murua, Numer. Algorithms 78 (2018), section 5.
fn stiff_pendulum(c: f64, until: f64) -> Scene {
    let bar =
        |name: &str| Bar { name: name.into(), length: 1.0, mass: 1.0, centre: [1.0, 0.0], inertia: 0.0 };
    let hinge = |name: &str, inner: Place, outer: usize| Hinge {
        name: name.into(),
        between: [inner, Place { bar: Some(outer), point: [0.0, 0.0] }],
    };
    let mut scene = Scene {
        name: "stiff_pendulum".into(),
        gravity: [9.8, 0.0],
        bars: vec![bar("bar1"), bar("bar2")],
        hinges: vec![
            hinge("A", Place { bar: None, point: [0.0, 0.0] }, 0),
            hinge("B", Place { bar: Some(0), point: [1.0, 0.0] }, 1),
        ],
        start: vec![
            Start { phi: 1.1, omega: -2.774587705400123 },
            Start { phi: 1.0982812520980798, omega: 5.5491836072042 },
        ],
        until,
        every: until / 64.0,
        ..Scene::default()
    };
    if c > 0.0 {
        scene.torsion_springs.push(TorsionSpring {
            name: "spring".into(),
            bar: 1,
            relative_to: Some(0),
            stiffness: c * c,
            free_angle: 0.0,
            damping: 0.0,
        });
    }
    scene
}

const STEP: f64 = 1.0 / 128.0;

fn gauss(stages: usize, step: f64) -> Request {
    Request { method: Some(MethodId::Gauss(stages)), step: Some(step), ..Request::default() }
}

/// The largest energy error over the energy at the start, as published, and the run.
fn energy_error(c: f64, stages: usize, step: f64, until: f64) -> (f64, Outcome) {
    let scene = stiff_pendulum(c, until);
    let mechanism = compile(&scene);
    let outcome = run(&scene, &gauss(stages, step));
    assert_eq!(outcome.stop, None, "C = {c}");
    let start = mechanism.start(&scene);
    let mut kernel = driftless::dynamics::kernel::Kernel::without_rows(&mechanism);
    let energy = mechanism.energy(&mut kernel, &start.phi, &start.omega).total().hi;
    let error = outcome.drift.energy.max * mechanism.energy_scale / energy.abs();
    println!(
        "C = {c}, s = {stages}, h = {step}: {error:.2e} of {energy} J, {:?}, {:?}",
        outcome.statistics, outcome.wall
    );
    (error, outcome)
}

#[test]
fn the_published_stiff_pendulum_keeps_its_energy() {
    for (c, stages, bound) in [(0.0, 6, 1e-15), (32.0, 6, 8e-14), (64.0, 6, 3e-11), (64.0, 8, 4e-13)] {
        let (error, _) = energy_error(c, stages, STEP, 32.0);
        assert!(error < bound, "C = {c}, s = {stages}: {error:e}");
    }
}

/// Published for 4096 s and s = 6: 8.4e-16, 7.0e-14 and 2.9e-11.
#[test]
#[ignore = "a minute and more"]
fn the_published_stiff_pendulum_keeps_its_energy_for_4096_seconds() {
    for (c, stages, bound) in [(0.0, 6, 3e-15), (32.0, 6, 8e-14), (64.0, 6, 3e-11), (64.0, 8, 4e-13)] {
        let (error, _) = energy_error(c, stages, STEP, 4096.0);
        assert!(error <= bound, "C = {c}, s = {stages}: {error:e}");
    }
}

#[test]
fn the_stiff_pendulum_ends_where_it_should() {
    let reference = [0.3767499754883, 0.431891520004729, 1.32220412587949, 4.0417614907693];
    let (_, outcome) = energy_error(64.0, 8, STEP, 8.0);
    let last = &outcome.last;
    for (found, expected) in last.phi.iter().chain(&last.omega).zip(reference) {
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }
}

/// At 2.24 rad of the fast mode a step sweeps take two to three times the evaluations; at 0.56 they are the
/// method.
#[test]
fn newtons_method_takes_over_where_sweeps_are_slow_and_says_so() {
    let (_, soft) = energy_error(32.0, 6, STEP, 4.0);
    assert_eq!(soft.statistics.newton_steps, 0, "{:?}", soft.statistics);
    let (error, stiff) = energy_error(128.0, 8, STEP, 4.0);
    assert!(
        stiff.statistics.newton_steps > stiff.statistics.steps / 2 && error < 1e-9,
        "{:?}, {error:e}",
        stiff.statistics
    );
    assert!(stiff.plan.notes.iter().any(|note| note.contains("Newton's method")), "{:?}", stiff.plan.notes);
    let again = run(&stiff_pendulum(128.0, 4.0), &gauss(8, STEP));
    assert_eq!((again.last, again.statistics), (stiff.last, stiff.statistics));
}

#[test]
fn a_step_too_long_for_an_excited_spring_stops_with_its_name_and_the_step_to_take() {
    for c in [256.0, 2048.0] {
        let outcome = run(&stiff_pendulum(c, 1.0), &gauss(8, STEP));
        let stop = outcome.stop.expect("a stop");
        println!("{stop}");
        assert_eq!(stop.cause, Cause::Unresolved, "{stop}");
        assert!(stop.what.contains("spring `spring`") && stop.hint.contains("a step of"), "{stop}");
    }
}

/// The pendulum on its spring with another stiffness, at its free length and at rest: next to no energy in
/// it.
fn sprung(factor: f64, until: f64) -> Scene {
    let mut scene = shipped("spring", &[]);
    scene.springs[0].stiffness = 7.394_287_5 * factor;
    (scene.start[0].phi, scene.start[1].phi) = (1.955_193_101_290_539_7, std::f64::consts::FRAC_PI_2);
    (scene.until, scene.every) = (until, until);
    scene
}

#[test]
fn a_fast_mode_without_energy_may_be_stepped_over() {
    let outcome = run(&sprung(1e8, 1.0), &gauss(8, 1.0 / 128.0));
    let reference = [1.95519309603616, -0.816910255945905];
    if let Some(stop) = &outcome.stop {
        assert_eq!(stop.cause, Cause::NotConverged, "{stop}");
        return;
    }
    for (found, expected) in outcome.last.phi.iter().zip(reference) {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}, {:?}", outcome.statistics);
    }
}

/// Steps far too long for an everyday spring: sweeps that "stop falling" far from convergence once returned
/// 1e10 rad with success.
#[test]
fn an_iteration_that_ends_far_from_convergence_is_a_stop() {
    for step in [0.25, 0.33, 0.5] {
        let outcome =
            run(&shipped("spring", &[]), &Request { until: Some(10.0), every: Some(5.0), ..gauss(2, step) });
        match &outcome.stop {
            Some(stop) => assert!(
                matches!(stop.cause, Cause::NotConverged | Cause::NotFinite | Cause::Unresolved),
                "{stop}"
            ),
            None => assert!(outcome.last.phi.iter().all(|phi| phi.abs() < 100.0), "{:?}", outcome.last.phi),
        }
    }
}

/// A loop with a stiff spring across it, kept by symmetric projection.
#[test]
fn loops_with_stiff_springs_end_right_or_stop() {
    let mut scene = shipped("four_bars", &[]);
    let loose = compile(&scene);
    let z: Vec<_> = loose.start(&scene).phi.iter().map(|phi| Complex::unit(phi.hi)).collect();
    // From a point of the ground to the end of the second bar, at its free length.
    let (ground, [_, end]) = ([-3.0, -2.0], [0, 1].map(|end| loose.end(1, end).point.position(&z)));
    let length = (end - Complex::new(ground[0], ground[1])).norm_squared().sqrt();
    let places =
        [Place { bar: None, point: ground }, Place { bar: Some(1), point: [scene.bars[1].length, 0.0] }];
    let spring = &shipped("spring", &[]).springs[0];
    scene.springs.push(Spring { between: places, stiffness: 1e7, free_length: length, ..spring.clone() });
    (scene.until, scene.every) = (0.1, 0.1);
    let mechanism = compile(&scene);
    let start = mechanism.start(&scene);
    let [phi, omega] =
        [&start.phi, &start.omega].map(|values| values.iter().map(|value| value.hi).collect::<Vec<_>>());
    let rate = Stiffness::at(&mechanism, start.time, &phi, &omega).fastest;
    let reference =
        run(&scene, &Request { method: Some(MethodId::Taylor), rtol: Some(1e-12), ..Request::default() });
    assert_eq!(reference.stop, None);
    for radians in [0.5, 3.0, 12.0] {
        let outcome = run(&scene, &gauss(8, (0.1 * rate / radians).ceil().recip() * 0.1));
        match &outcome.stop {
            Some(stop) => assert!(radians > 1.0, "{radians}: {stop}"),
            None => {
                let apart = outcome
                    .last
                    .phi
                    .iter()
                    .zip(&reference.last.phi)
                    .fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
                assert!(apart < 1e-4, "{radians} rad a step: {apart:e}, {:?}", outcome.statistics);
            }
        }
    }
}

#[test]
fn a_stiff_spring_is_resolved_and_its_periods_are_told() {
    let scene = sprung(1e8, 1.0);
    let mechanism = compile(&scene);
    let ask = |method, until| Request { method: Some(method), until: Some(until), ..Request::default() };
    let plan = Plan::new(&scene, &mechanism, &ask(MethodId::Taylor, 1.0)).expect("a plan");
    let mode = plan.stiffness.expect("a fast mode");
    assert!(
        (mode.rate / 6.2e4 - 1.0).abs() < 0.05
            && (mode.periods / 9.8e3 - 1.0).abs() < 0.05
            && mode.spring.is_some(),
        "{mode:?}"
    );
    let said = plan.notes.iter().any(|note| {
        note.contains("spring oscillates at 6")
            && !note.contains("e4 rad/s")
            && note.contains("periods until t = 1 s, about")
    });
    assert!(said, "{:?}", plan.notes);
    // 1e8 rad are 1600 s of it.
    let refusal =
        Plan::new(&scene, &mechanism, &ask(MethodId::Taylor, 2000.0)).expect_err("a refusal").to_string();
    assert!(
        ["periods", "rigid", "--until", "--max-evaluations"].iter().all(|word| refusal.contains(word)),
        "{refusal}"
    );
    let max_evaluations = Request { max_evaluations: Some(1_000_000), ..ask(MethodId::Taylor, 2000.0) };
    assert!(Plan::new(&scene, &mechanism, &max_evaluations).is_ok());
    // A soft spring is not worth a word.
    let soft = sprung(1.0, 1.0);
    let plan = Plan::new(&soft, &compile(&soft), &ask(MethodId::Taylor, 1.0)).expect("a plan");
    assert!(plan.notes.is_empty() && plan.stiffness.is_some(), "{:?}", plan.notes);
}

/// Stiff and swinging at 1e6 times the source's stiffness: an error of 1e-6 for far fewer evaluations than
/// the everyday method's.
#[test]
fn a_stiff_spring_that_swings_is_followed_to_six_digits() {
    let mut scene = sprung(1e6, 0.5);
    scene.start[0].phi = 1.956_193_101_290_539_6;
    let reference = [1.95578678738958, -1.21015389250257];
    for (method, rtol) in [(MethodId::Taylor, 1e-9), (MethodId::Dp8, 1e-9)] {
        let outcome = run(&scene, &Request { method: Some(method), rtol: Some(rtol), ..Request::default() });
        assert_eq!(outcome.stop, None);
        println!("{method}: {:?}, {:?}", outcome.statistics, outcome.wall);
        for (found, expected) in outcome.last.phi.iter().zip(reference) {
            assert!((found - expected).abs() < 1e-5, "{method}: {found} {expected}");
        }
    }
}

/// Masses \[kg\] on one upright rail, one above the other on springs and dampers \[N/m, N·s/m\], at rest in
/// the springs' free lengths.
fn stack(gravity: f64, masses: &[f64], springs: &[[f64; 2]], until: f64) -> Scene {
    let name = |k: usize| if k == 0 { "ground".to_owned() } else { format!("m{k}") };
    let place = |body: String| json!({"body": body, "point": [0, 0]});
    let each = |of: &dyn Fn(usize) -> Value| (1..=masses.len()).map(of).collect::<Vec<_>>();
    let rail = json!({"body": "ground", "point": [0, 0], "direction": [0, 1]});
    let start = |k: usize| (name(k), json!({"phi": 0, "origin": [0, k], "velocity": [0, 0]}));
    let scene = json!({
        "name": "stack", "gravity": [0, -gravity],
        "bars": each(&|k| json!({"name": name(k), "mass": masses[k - 1], "centre": [0, 0], "inertia": 1})),
        "sliders": each(&|k| {
            json!({"name": format!("s{k}"), "point": place(name(k)), "rail": rail, "angle": "locked"})
        }),
        "springs": each(&|k| {
            let [stiffness, damping] = springs[k - 1];
            json!({"name": format!("k{k}"), "between": [place(name(k - 1)), place(name(k))],
                   "stiffness": stiffness, "damping": damping, "free_length": 1})
        }),
        "start": (1..=masses.len()).map(start).collect::<serde_json::Map<_, _>>(),
        "until": until, "every": 0.1,
    });
    parse_scene(&scene.to_string(), "stack.json", &[]).expect("a scene")
}

/// A damped mode is stiff beside slower ones, over so long a run that an implicit method pays; it is not by
/// itself, nor beside modes nearly as fast.
#[test]
fn a_damped_mode_is_stiff_beside_slower_motion_only() {
    let chosen = |scene: &Scene| {
        let mechanism = compile(scene);
        let plan = Plan::new(scene, &mechanism, &Request::default()).expect("a plan");
        let found = Stiffness::at_start(&mechanism, &mechanism.start(scene)).expect("springs");
        (plan.method, plan.why.expect("a reason"), found)
    };
    // One mass: its two eigenvalues are as large as one another, or have the product k/m.
    let (k, m): (f64, f64) = (45.0, 2.0);
    for until in [8.0, 1000.0] {
        let (method, why, found) = chosen(&stack(0.0, &[m], &[[k, 5.0]], until));
        assert!(method == MethodId::Taylor && found.is_damped(), "{method}: {why}");
        let alone = (k / m).sqrt();
        assert!((found.fastest - alone).abs().max((found.slow - alone).abs()) < 1e-9 * alone, "{found:?}");
    }
    let (method, why, found) = chosen(&stack(0.0, &[m], &[[k, 1e4]], 8.0));
    assert!(method == MethodId::Radau(5) && why.contains("k1"), "{method}: {why}");
    assert!((found.fastest * m / 1e4 - 1.0).abs() < 1e-4, "{found:?}");
    // A quarter of a car: the product of all four eigenvalues is that of the stiffnesses over the masses'.
    let (masses, springs) = ([40.0, 300.0], [[180_000.0, 0.0], [18_000.0, 1500.0]]);
    for until in [2.5, 1000.0] {
        let (method, why, found) = chosen(&stack(9.81, &masses, &springs, until));
        assert!(method == MethodId::Taylor && found.is_damped(), "{method}: {why}");
        let product = (springs[0][0] * springs[1][0] / (masses[0] * masses[1])).sqrt();
        assert!((found.fastest * found.slow / product - 1.0).abs() < 1e-9, "{found:?}");
        assert!((found.ratio() - 9.0).abs() < 1.0, "{found:?}");
    }
    // Beside a motion that keeps its rate, as long as the mode has few periods to go through.
    let flying = |until: f64| {
        let mut scene = stack(9.81, &[1.0, 1.0], &[[0.0, 0.0], [100.0, 5.0]], until);
        scene.springs.remove(0);
        chosen(&scene)
    };
    let (method, why, _) = flying(2.0);
    assert!(method == MethodId::Taylor && !why.contains("undamped"), "{method}: {why}");
    assert_eq!(flying(1000.0).0, MethodId::Radau(5));
}
