//! Extremes: each ends in a right answer or in a typed stop with a time in it; nothing hangs.

use crate::common;

use common::{compile, pendulum, quarter_period, run, run_limited, shipped};
use driftless::run::{Limits, MethodId, Outcome, Request, Stabilization};
use driftless::scene::{Place, Scene, Spring, parse_scene};
use driftless::stepping::Cause;
use driftless::stepping::composition::Composition;
use std::f64::consts::{FRAC_PI_2, PI};

const EXPLICIT: [MethodId; 4] = [MethodId::Dopri5, MethodId::Dop853, MethodId::Dp5, MethodId::Dp8];

fn request(method: MethodId, rtol: f64, until: f64) -> Request {
    Request {
        method: Some(method),
        rtol: Some(rtol),
        until: Some(until),
        every: Some(until / 10.0),
        ..Request::default()
    }
}

/// Runs to the end with the energy within `bound`.
fn assert_sound(scene: &Scene, request: &Request, bound: f64) -> Outcome {
    let outcome = run(scene, request);
    assert_eq!(outcome.stop, None, "{} by {}", scene.name, outcome.plan.method);
    let drift = outcome.drift.energy.max;
    assert!(drift < bound, "{} by {}: {drift:e}", scene.name, outcome.plan.method);
    outcome
}

#[test]
fn a_spring_a_million_times_stiffer() {
    // Frequency about 5e3 rad/s: steps of 1e-4 s, and the everyday methods go through.
    let mut scene = shipped("spring", &[]);
    scene.springs[0].stiffness *= 1e6;
    // At rest at its free length, so that the stiffness is felt and not its energy.
    scene.springs[0].free_length = 0.5;
    for method in [MethodId::Dop853, MethodId::Dp8] {
        assert_sound(&scene, &request(method, 1e-8, 0.5), 1e-4);
    }
}

#[test]
fn a_motor_at_rest_told_to_run_at_speed_is_refused() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/motor.json");
    let at_rest = ["start.bar1={\"phi\": 1.5707963267948966, \"omega\": 0}".parse().expect("an override")];
    let refusal = driftless::scene::read_scene(&path, &at_rest).expect_err("a contradiction").to_string();
    assert!(refusal.contains("bar1") && refusal.contains("omega") && refusal.contains("motor"), "{refusal}");
}

#[test]
fn without_gravity_a_bar_turns_steadily() {
    let mut scene = pendulum(1.0, 3.0);
    scene.gravity = [0.0, 0.0];
    for method in EXPLICIT {
        let outcome = assert_sound(&scene, &request(method, 1e-10, 100.0), 1e-12);
        assert!((outcome.last.phi[0] - 301.0).abs() < 1e-10, "{method}: {}", outcome.last.phi[0]);
    }
    let fixed = Request {
        method: Some(MethodId::Gauss(8)),
        step: Some(0.125),
        until: Some(100.0),
        every: Some(1.0),
        ..Request::default()
    };
    assert!((assert_sound(&scene, &fixed, 1e-15).last.phi[0] - 301.0).abs() < 1e-13);
    // At rest without gravity nothing has a scale, and nothing moves.
    scene.start[0].omega = 0.0;
    for method in EXPLICIT {
        assert_eq!(assert_sound(&scene, &request(method, 1e-10, 10.0), 1e-300).last.phi, [1.0]);
    }
}

/// Gravity 1e6 times larger makes the same motion 1e3 times faster.
#[test]
fn gravity_sets_the_clock() {
    let slow = shipped("free", &[]);
    let mut fast = slow.clone();
    fast.gravity[0] *= 1e6;
    for method in [MethodId::Dop853, MethodId::Dp8] {
        let (slow, fast) =
            (run(&slow, &request(method, 1e-12, 3.0)), run(&fast, &request(method, 1e-12, 3e-3)));
        for k in 0..2 {
            assert!((slow.last.phi[k] - fast.last.phi[k]).abs() < 1e-7, "{method}");
            assert!((slow.last.omega[k] - fast.last.omega[k] / 1e3).abs() < 1e-6, "{method}");
        }
    }
}

#[test]
fn bars_of_very_unequal_mass_and_length() {
    for (mass, length) in [(1e6, 1.0), (1e-6, 1.0), (1.0, 1e3), (1.0, 1e-3), (1e6, 1e-3), (1e-6, 1e3)] {
        let mut scene = shipped("free", &[]);
        scene.name = format!("ratio-{mass:e}-{length:e}");
        let bar = &mut scene.bars[1];
        (bar.mass, bar.length, bar.centre[0]) =
            (bar.mass * mass, bar.length * length, bar.centre[0] * length);
        bar.inertia *= mass * length * length;
        assert_sound(&scene, &request(MethodId::Dp8, 1e-11, 1.0), 1e-7);
        assert_sound(&scene, &request(MethodId::Dop853, 1e-11, 1.0), 1e-7);
    }
    // A second bar of no weight leaves the first to swing as a pendulum.
    let mut scene = shipped("free", &[]);
    (scene.bars[1].mass, scene.bars[1].inertia) = (scene.bars[1].mass * 1e-12, scene.bars[1].inertia * 1e-12);
    let mut single = scene.clone();
    single.bars.pop();
    single.hinges.pop();
    single.start.pop();
    let both = run(&scene, &request(MethodId::Dp8, 1e-12, 1.0)).last;
    let one = run(&single, &request(MethodId::Dp8, 1e-12, 1.0)).last;
    assert!((both.phi[0] - one.phi[0]).abs() < 1e-9);
}

#[test]
fn both_bars_in_line_turning_together() {
    // Aligned and at one rate under no gravity: the pair turns as one rigid bar for ever.
    let mut scene = shipped("spinning", &[]);
    scene.gravity = [0.0, 0.0];
    let outcome = assert_sound(&scene, &request(MethodId::Dp8, 1e-12, 5.0), 1e-11);
    assert!(outcome.last.phi.iter().all(|phi| (phi - 5.0 * PI).abs() < 1e-8), "{:?}", outcome.last.phi);
    // And with it, folded back onto one another.
    let mut scene = shipped("free", &[]);
    scene.start[1].phi = -FRAC_PI_2;
    assert_sound(&scene, &request(MethodId::Dp8, 1e-11, 5.0), 1e-8);
}

#[test]
fn hanging_at_rest_stays_exactly_there() {
    let scene = shipped("hanging", &[]);
    for method in EXPLICIT {
        let last = assert_sound(&scene, &request(method, 1e-9, 50.0), 1e-300).last;
        assert_eq!((last.phi, last.omega), (vec![0.0; 2], vec![0.0; 2]));
    }
    for stages in [2, 5, 8] {
        let fixed = Request {
            method: Some(MethodId::Gauss(stages)),
            step: Some(0.1),
            until: Some(50.0),
            every: Some(5.0),
            ..Request::default()
        };
        let last = assert_sound(&scene, &fixed, 1e-300).last;
        assert_eq!((last.phi, last.omega), (vec![0.0; 2], vec![0.0; 2]));
    }
}

/// Balanced upside down to the last bit of pi: sin(pi) is 1.2e-16, not 0, and the fall begins from there:
/// delta grows as 1.2e-16 cosh(sqrt(15) t), give or take what rounding the angle in the first steps adds,
/// which are long: no tolerance sees so little.
#[test]
fn upside_down_it_falls_as_slowly_as_its_last_bit_says() {
    let outcome = run(&pendulum(PI, 0.0), &request(MethodId::Dp8, 1e-12, 8.0));
    assert_eq!(outcome.stop, None);
    let early = &outcome.trace.head[5];
    let expected = 1.224_646_799_147_353_2e-16 * (15f64.sqrt() * early.t).cosh();
    println!(
        "{:?} {expected:e}",
        outcome.trace.head.iter().map(|sample| PI - sample.phi[0]).collect::<Vec<_>>()
    );
    let fallen = PI - early.phi[0];
    assert!((0.1 * expected..10.0 * expected).contains(&fallen), "{fallen:e} of {expected:e}");
    assert!(outcome.drift.energy.max < 1e-10);
}

#[test]
fn a_million_turns_at_the_start_change_nothing() {
    let mut wound = shipped("free", &[]);
    wound.start[0].phi += 1e6 * 2.0 * PI;
    wound.start[1].phi -= 1e6 * 2.0 * PI;
    let start = compile(&wound).start(&wound);
    assert_eq!(start.turns, [1_000_000, -1_000_000]);
    let mut plain = wound.clone();
    for k in 0..2 {
        plain.start[k].phi = start.phi[k].hi;
    }
    for method in EXPLICIT {
        let (wound, plain) =
            (run(&wound, &request(method, 1e-9, 2.0)).last, run(&plain, &request(method, 1e-9, 2.0)).last);
        for k in 0..2 {
            let turns = [1e6, -1e6][k] * 2.0 * PI;
            // The winding angle is a double near 6e6 rad: its last place is 1e-9.
            assert!((wound.phi[k] - turns - plain.phi[k]).abs() < 3e-9, "{method}");
            assert!((wound.omega[k] - plain.omega[k]).abs() < 1e-12, "{method}");
        }
    }
}

/// A bar's point on the very anchor of its spring: there the force has no direction.
#[test]
fn a_spring_of_no_length_is_a_typed_stop() {
    let mut scene = pendulum(0.0, 0.0);
    scene.springs.push(Spring {
        name: "spring".into(),
        between: [Place { bar: None, point: [0.5, 0.0] }, Place { bar: Some(0), point: [0.5, 0.0] }],
        stiffness: 10.0,
        free_length: 0.2,
        damping: 0.0,
        rigid: false,
    });
    for method in EXPLICIT {
        let stop = run(&scene, &request(method, 1e-9, 1.0)).stop.expect("a stop");
        assert_eq!((stop.cause, stop.t), (Cause::NotFinite, 0.0), "{stop}");
        assert!(stop.what.contains("bar") && stop.hint.contains("spring"), "{stop}");
    }
    let fixed = Request {
        method: Some(MethodId::Gauss(4)),
        step: Some(0.01),
        until: Some(1.0),
        every: Some(0.1),
        ..Request::default()
    };
    let stop = run(&scene, &fixed).stop.expect("a stop");
    assert_eq!((stop.cause, stop.t), (Cause::NotFinite, 0.0), "{stop}");
    // Passing through the anchor at speed the force flips in no time: through with the energy kept, or a
    // typed stop before it.
    scene.start[0] = driftless::scene::Start { phi: 1.0, omega: -8.0 };
    for method in EXPLICIT {
        let outcome = run(&scene, &request(method, 1e-9, 1.0));
        match &outcome.stop {
            None => assert!(outcome.drift.energy.max < 1e-5, "{method}: {:e}", outcome.drift.energy.max),
            Some(stop) => {
                assert!(
                    matches!(stop.cause, Cause::NotFinite | Cause::StepTooSmall | Cause::SpringWithoutLength),
                    "{stop}"
                );
                assert!(stop.t > 0.1 && stop.t < 0.2, "{stop}");
            }
        }
    }
}

/// Every method ends where the effort it is allowed does, and says when and how to go further.
#[test]
fn effort_that_is_used_up_is_a_typed_stop() {
    const MAX_EVALUATIONS: u64 = 2000;
    let named = |name: &str, method: &str, stabilize: Option<Stabilization>| {
        let method: MethodId = method.parse().expect("a method");
        let step = (!method.is_adaptive()).then_some(1.0 / 256.0);
        let rtol = method.is_adaptive().then_some(1e-12);
        let time_constant = (stabilize == Some(Stabilization::Baumgarte)).then_some(0.05);
        let request = Request {
            method: Some(method),
            step,
            rtol,
            stabilize,
            time_constant,
            max_evaluations: Some(MAX_EVALUATIONS),
            ..Request::default()
        };
        (Scene { until: 1e4, every: 50.0, ..shipped(name, &[]) }, request)
    };
    let of_any = ["dopri5", "dop853", "dp5", "dp8", "taylor", "gauss4", "gauss16", "rattle2", "rattle8"]
        .map(|method| named("free", method, None));
    let others = [
        named("motor_sine", "dp8", Some(Stabilization::Projection)),
        named("motor_sine", "dp5", Some(Stabilization::Baumgarte)),
        named("chain8", "taylor", None),
        named("four_bars", "taylor", None),
        named("four_bars", "gauss8", None),
        named("wall", "dp8", None),
        named("wall", "taylor", None),
    ];
    for (scene, request) in of_any.into_iter().chain(others) {
        let outcome = run(&scene, &request);
        let stop = outcome.stop.unwrap_or_else(|| panic!("{}, {:?} ended", scene.name, request.method));
        assert_eq!(stop.cause, Cause::EffortExhausted, "{stop}");
        assert!(
            stop.t > 0.0
                && stop.t < 1e4
                && stop.hint.contains("--max-evaluations")
                && stop.what.contains("2000"),
            "{stop}"
        );
        // Steps that have begun are finished.
        assert!(
            (MAX_EVALUATIONS..MAX_EVALUATIONS + 1000).contains(&outcome.statistics.evaluations),
            "{stop} {:?}",
            outcome.statistics
        );
        let more = run(&scene, &Request { max_evaluations: Some(2 * MAX_EVALUATIONS), ..request })
            .stop
            .expect("a stop");
        assert!(
            more.t > stop.t
                || outcome.plan.method == MethodId::Dop853
                || outcome.plan.method == MethodId::Dopri5,
            "{more}"
        );
    }
}

/// Found by fuzzing: a place so far away that the length of its bar is rounded off it.  There is no
/// constraint to blame, and none is.
#[test]
fn places_beyond_rounding_are_refused_or_met() {
    for (length, origin) in [(1e-20, 1e25), (1.0, 1e30), (1e-30, 1.0), (1e20, 1e-20), (1e-3, 1e18)] {
        let text = format!(
            r#"{{"name": "far", "gravity": [9.81, 0], "bars": [{{"name": "bar", "mass": 1, "centre": [{length:e}, 0], "inertia": 1}}],
               "start": {{"bar": {{"phi": 1, "omega": 0, "origin": [{origin:e}, 0], "velocity": [0, 1]}}}}, "until": 1, "every": 1}}"#
        );
        let scene =
            driftless::scene::parse_scene(&text, "far.json", &[]).expect("valid as far as single values go");
        if let Err(error) = driftless::dynamics::Mechanism::new(&scene) {
            assert!(error.to_string().contains("start"), "{error}");
        }
    }
}

/// Found by fuzzing: whoever turns more often than doubles can count would be shown at another angle.
#[test]
fn turns_beyond_counting_are_a_typed_stop() {
    let text = r#"{"name": "fast", "gravity": [0, 0], "bars": [{"name": "bar", "mass": 1, "centre": [0, 0], "inertia": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
        "motors": [{"name": "motor", "body": "bar", "law": {"start": 0, "rate": 1e14}}], "until": 1e8, "every": 100}"#;
    let scene = driftless::scene::parse_scene(text, "fast.json", &[]).expect("a scene");
    for method in [MethodId::Dop853, MethodId::Dp8, MethodId::Taylor, MethodId::Gauss(8)] {
        let step = (!method.is_adaptive()).then_some(100.0);
        let outcome = run(&scene, &Request { method: Some(method), step, ..Request::default() });
        let stop = outcome.stop.expect("a stop");
        assert!(stop.cause == Cause::NotFinite && stop.what.contains("turned"), "{method}: {stop}");
        assert_eq!(outcome.last.t, 600.0, "{method}");
    }
}

/// A driven linkage carries two points of its rods towards walls that leave less and less room between them:
/// each moment there is of hundreds of impacts, and all of them are counted.
#[test]
fn a_linkage_squeezed_between_walls_stops_soon() {
    let text = r#"{"name": "squeezed", "gravity": [0, 0],
        "bars": [{"name": "outer", "mass": 0.94, "centre": [0.47, 0], "inertia": 0.04, "length": 0.82},
            {"name": "middle", "mass": 2.12, "centre": [0.3, 0], "inertia": 0.12, "length": 0.55},
            {"name": "inner", "mass": 1.19, "centre": [0.15, 0.03], "inertia": 0.03, "length": 0.45}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "inner", "point": [0, 0]}]},
            {"name": "B", "between": [{"body": "inner", "point": [0.45, 0]}, {"body": "middle", "point": [0, 0]}]},
            {"name": "C", "between": [{"body": "middle", "point": [0.55, 0]}, {"body": "outer", "point": [0, 0]}]}],
        "motors": [{"name": "first", "body": "outer", "law": {"start": -2.41, "rate": -2.91, "acceleration": -0.66}},
            {"name": "second", "body": "outer", "relative_to": "middle",
                "law": {"start": -5.47, "rate": -2.75, "acceleration": -0.85}}],
        "walls": [{"name": "left", "body": "middle", "point": [0.21, 0], "restitution": 0.3,
                "line": {"through": [-0.48, 0.51], "normal": [-0.97, 0.25]}},
            {"name": "right", "body": "outer", "point": [0.82, 0], "restitution": 1,
                "line": {"through": [-1.58, -0.18], "normal": [0.93, -0.36]}}],
        "start": {"inner": {"phi": 2.54, "omega": -0.65}, "middle": {"phi": 3.06, "omega": -0.16},
            "outer": {"phi": -2.41, "omega": -2.91}}, "until": 2, "every": 0.1}"#;
    let scene = driftless::scene::parse_scene(text, "squeezed.json", &[]).expect("a scene");
    for method in [MethodId::Dp8, MethodId::Taylor] {
        let outcome = run(&scene, &Request { method: Some(method), ..Request::default() });
        let stop = outcome.stop.expect("a stop");
        assert!(stop.what.contains("impacts") && stop.hint.contains("between walls"), "{method}: {stop}");
        assert!((0.04..0.06).contains(&outcome.last.t), "{method}: {}", outcome.last.t);
        assert!((9_000..12_000).contains(&outcome.impact_count), "{method}: {}", outcome.impact_count);
    }
}

/// A scene of a few lines does not fill a disk unless it is told to.
#[test]
fn a_trajectory_of_gigabytes_has_to_be_asked_for() {
    use driftless::run::Plan;
    let scene = Scene { until: 1e6, every: 0.01, ..shipped("free", &[]) };
    let mechanism = compile(&scene);
    let refusal = Plan::new(&scene, &mechanism, &Request::default()).expect_err("a refusal");
    assert!(
        !refusal.is_usage && refusal.to_string().contains("34 GB") && refusal.to_string().contains("--every"),
        "{refusal}"
    );
    assert!(Plan::new(&scene, &mechanism, &Request { every: Some(0.01), ..Request::default() }).is_ok());
    assert!(Plan::new(&scene, &mechanism, &Request { every: Some(1e-4), ..Request::default() }).is_err());
}

/// A wall that bounces faster and faster, and a horizon that is never reached: the effort bounds both.
#[test]
fn nothing_takes_for_ever() {
    let bouncing = shipped("wall", &["walls.wall.restitution=1", "gravity=[9.81, 0]"]);
    for method in [MethodId::Dp5, MethodId::Dp8, MethodId::Taylor] {
        let request = Request {
            until: Some(1e9),
            every: Some(1e9),
            max_evaluations: Some(50_000),
            method: Some(method),
            ..Request::default()
        };
        let stop = run(&bouncing, &request).stop.expect("a stop");
        assert!(matches!(stop.cause, Cause::EffortExhausted | Cause::RestingContact), "{stop}");
    }
    // What nobody bounds is bounded all the same.
    let plan = run(&shipped("free", &[]), &Request { until: Some(1.0), ..Request::default() }).plan;
    assert_eq!(plan.max_evaluations, 110_000_000);
    // And not by the horizon alone: what cannot be reached is said beforehand.
    let (scene, most) =
        (shipped("free", &[]), [(MethodId::Dp8, 10_000_000_000), (MethodId::Taylor, 1_000_000_000)]);
    for (method, max_evaluations) in most {
        let request =
            Request { until: Some(1e9), every: Some(1e9), method: Some(method), ..Request::default() };
        let plan = driftless::run::Plan::new(&scene, &compile(&scene), &request).expect("a plan");
        assert_eq!(plan.max_evaluations, max_evaluations);
        assert!(
            plan.notes.iter().any(|note| note.contains("--max-evaluations") && note.contains("may stop")),
            "{:?}",
            plan.notes
        );
    }
}

#[test]
fn a_step_far_too_long_is_a_typed_stop() {
    for stages in [2, 8] {
        let fixed = Request {
            method: Some(MethodId::Gauss(stages)),
            step: Some(5.0),
            until: Some(100.0),
            every: Some(5.0),
            ..Request::default()
        };
        let stop = run(&shipped("spinning", &[]), &fixed).stop.expect("a stop");
        assert!(matches!(stop.cause, Cause::NotConverged | Cause::NotFinite), "{stop}");
        assert!(stop.t < 100.0 && stop.hint.contains("step"), "{stop}");
    }
}

/// A step that is looked at again, because the ends of a spring come near one another in it, may be the last
/// before an output time; the run goes on all the same.
#[test]
fn a_look_at_a_spring_ends_no_run() {
    let text = r#"{"name": "near", "gravity": [25.9, 0], "bars": [{"name": "bar", "length": 0.92, "width": 0.092, "thickness": 0.01, "density": 575}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
        "springs": [{"name": "spring", "between": [{"body": "ground", "point": [0.92, 0]}, {"body": "bar", "point": [0.92, 0]}],
            "stiffness": 211, "free_length": 0.4}],
        "start": {"bar": {"phi": 1.57, "omega": 11.4}}, "until": 0.188, "every": 0.047}"#;
    let scene = parse_scene(text, "near", &[]).expect("a scene");
    for method in [MethodId::Gauss(2), MethodId::Gauss(8), MethodId::Dp8, MethodId::Taylor] {
        for parts in [4.0, 8.0, 64.0] {
            let step = (!method.is_adaptive()).then_some(scene.until / parts);
            let outcome = run(&scene, &Request { method: Some(method), step, ..Request::default() });
            assert!(
                outcome.stop.is_some() || outcome.last.t == scene.until,
                "{method}, {parts} steps: ended at {} s",
                outcome.last.t
            );
        }
    }
}

/// What turns on a circle is where it was after a whole turn, and a step over many of them would lose count.
#[test]
fn a_motor_that_turns_often_in_a_step_is_a_typed_stop() {
    let mut scene = shipped("motor", &[]);
    let rate = scene.motors[0].law.rate;
    scene.gravity = [0.0, 0.0];
    for turns in [1.0, 36.0] {
        let step = turns * std::f64::consts::TAU / rate.abs();
        let method = Some(MethodId::Rattle(Composition::Single));
        let request = Request {
            method,
            step: Some(step),
            until: Some(4.0 * step),
            every: Some(step),
            ..Request::default()
        };
        let outcome = run(&scene, &request);
        let stop = outcome.stop.expect("a stop");
        assert!(stop.cause == Cause::NotConverged && stop.t == 0.0 && stop.hint.contains("step"), "{stop}");
    }
}

/// Output far denser, or far sparser, than the steps gives the same motion.
#[test]
fn the_output_interval_does_not_matter() {
    let scene = shipped("gentle", &[]);
    for method in EXPLICIT {
        let at = |every: f64| {
            let outcome = run(&scene, &Request { every: Some(every), ..request(method, 1e-10, 1.0) });
            assert_eq!((outcome.stop, outcome.last.t), (None, 1.0));
            outcome.last.phi[1]
        };
        let (dense, usual, sparse) = (at(1e-4), at(0.01), at(1.0));
        assert!(
            (dense - usual).abs() < 1e-8 && (sparse - usual).abs() < 1e-8,
            "{method}: {dense} {usual} {sparse}"
        );
    }
    // Windows as short as time can tell apart near the start.
    let short = Request { every: Some(1e-9), ..request(MethodId::Dop853, 1e-9, 1e-6) };
    assert_sound(&scene, &short, 1e-12);
}

#[test]
fn chaos_keeps_its_energy() {
    let scene = shipped("free", &["start.bar1.phi=3", "start.bar2.phi=-3"]);
    assert_sound(&scene, &request(MethodId::Dp8, 1e-12, 100.0), 1e-8);
    assert_sound(&shipped("chain8", &[]), &request(MethodId::Dp8, 1e-10, 5.0), 1e-6);
    assert_sound(&shipped("branch", &[]), &request(MethodId::Dop853, 1e-10, 10.0), 1e-6);
}

/// A thousand periods of a pendulum arrive on time.
#[test]
fn a_thousand_periods_end_where_they_began() {
    let until = 4000.0 * quarter_period(1.0);
    let fixed = Request {
        method: Some(MethodId::Gauss(8)),
        step: Some(until / 32000.0),
        until: Some(until),
        every: Some(until),
        ..Request::default()
    };
    let outcome = assert_sound(&pendulum(1.0, 0.0), &fixed, 1e-14);
    assert!(
        (outcome.last.phi[0] - 1.0).abs() < 1e-11 && outcome.last.omega[0].abs() < 1e-10,
        "{:?}",
        outcome.last
    );
}

#[test]
fn every_body_driven_leaves_nothing_to_solve() {
    let mut scene = shipped("motor_sine", &[]);
    let mut second = scene.motors[0].clone();
    (second.name, second.bar, second.law.rate) = ("second".into(), 1, -3.0);
    scene.motors.push(second);
    (scene.start[1].phi, scene.start[1].omega) = (scene.motors[1].law.start, -2.0);
    for stabilize in Stabilization::ALL {
        for method in [MethodId::Dp8, MethodId::Dp5] {
            let outcome = assert_sound(
                &scene,
                &Request { stabilize: Some(stabilize), ..request(method, 1e-10, 3.0) },
                1e-6,
            );
            let expected = scene.motors[1].law.angle(3.0.into()).hi;
            assert!((outcome.last.phi[1] - expected).abs() < 1e-8, "{method} {stabilize}");
        }
    }
    let fixed = Request {
        method: Some(MethodId::Gauss(8)),
        step: Some(1.0 / 128.0),
        until: Some(3.0),
        every: Some(0.25),
        ..Request::default()
    };
    assert_sound(&scene, &fixed, 1e-13);
}

#[test]
fn a_stated_drift_limit_stops_the_run_with_its_time() {
    let limits = Limits { energy: Some(1e-9), constraint: None };
    let stop =
        run_limited(&shipped("free", &[]), &request(MethodId::Dp5, 1e-4, 10.0), limits).stop.expect("a stop");
    assert_eq!(stop.cause, Cause::DriftLimit);
    assert!(stop.t > 0.0 && stop.t <= 10.0 && stop.what.contains("limit"), "{stop}");
}

/// A torsion spring wound up by thousands of turns pulls at a motor that stands still: in a step of hours
/// what is rounded of it is worth several turns.
#[test]
fn whole_turns_a_motor_lost_are_no_success() {
    let text = r#"{"name": "wound", "gravity": [5e-5, 0],
        "bars": [{"name": "bar", "length": 0.0049, "width": 0.00049, "thickness": 0.01, "density": 438, "inertia": "slender"}],
        "hinges": [{"name": "h", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
        "torsion_springs": [{"name": "spring", "body": "bar", "stiffness": 1.1e-6, "free_angle": 30251, "damping": 0}],
        "motors": [{"name": "motor", "body": "bar", "law": {"start": 1.5707963267948966, "rate": 0}}],
        "start": {}, "until": 35716.24, "every": 35716.24}"#;
    let scene = parse_scene(text, "wound.json", &[]).expect("a scene");
    let whole = Request { every: Some(scene.until), ..request(MethodId::Taylor, 1e-13, scene.until) };
    let hours = run_limited(&scene, &whole, Limits::default());
    let off = (hours.last.phi[0] - scene.motors[0].law.start).abs();
    match hours.stop {
        Some(stop) => assert_eq!(stop.cause, Cause::BranchLost, "{stop}"),
        None => assert!(off < 1e-9, "{off}"),
    }
    let second = assert_sound(&scene, &request(MethodId::Taylor, 1e-13, 1.0), 1e-9);
    assert!((second.last.phi[0] - scene.motors[0].law.start).abs() < 1e-12);
}
