//! Comparisons: errors are true ones, nothing vanishes, advice follows from the figures, and what was
//! measured survives an interruption.

use crate::common;
#[cfg(feature = "cli")]
use crate::program;

use common::{compile, shipped};
use driftless::run::compare::{Asked, Comparison, Fate, compare};
use driftless::run::{Limits, MethodId, Plan, Request, Run, Running, Stabilization, simulate};
use std::cell::Cell;
use std::time::{Duration, Instant};

/// Compares methods on a shipped scene to `until` \[s\], timing each setting twice.
fn compared(
    name: &str,
    overrides: &[&str],
    methods: &[&str],
    stabilize: &[Stabilization],
    until: f64,
) -> Comparison {
    let begin = Instant::now();
    compared_by(&|| begin.elapsed(), 100.0, name, overrides, methods, stabilize, until)
}

/// The same by a clock within a budget \[s\].
fn compared_by(
    clock: &dyn Fn() -> Duration,
    budget: f64,
    name: &str,
    overrides: &[&str],
    methods: &[&str],
    stabilize: &[Stabilization],
    until: f64,
) -> Comparison {
    let scene = shipped(name, overrides);
    let asked = Asked {
        methods: methods.iter().map(|name| name.parse().expect("a method")).collect(),
        stabilize: stabilize.to_vec(),
        until: Some(until),
        budget: Duration::from_secs_f64(budget),
        blocks: 2,
    };
    compare(&scene, &compile(&scene), &asked, clock, &mut |_| {}, &|| false).expect("a horizon")
}

/// A fall at constant speed that an event ends after half a second: what comes later is nobody's motion.
#[test]
fn a_motion_that_an_event_ends_is_compared_up_to_there() {
    let text = r#"{"name": "ends", "gravity": [0, 0],
        "bars": [{"name": "bar", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 1}],
        "hinges": [{"name": "A", "between": [
            {"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
        "torsion_springs": [{"name": "s", "body": "bar", "stiffness": 1, "free_angle": 0, "damping": 0}],
        "events": [{"name": "half", "when": "bar.phi - 1", "action": "stop"}],
        "start": {"bar": {"phi": 0, "omega": 2}}, "until": 10, "every": 0.1}"#;
    let scene = driftless::scene::parse_scene(text, "ends", &[]).expect("a scene");
    let asked = Asked {
        methods: vec!["dp8".parse().expect("a method"), "taylor".parse().expect("a method")],
        stabilize: Vec::new(),
        until: None,
        budget: Duration::from_secs(20),
        blocks: 2,
    };
    let begin = Instant::now();
    let found = compare(&scene, &compile(&scene), &asked, &|| begin.elapsed(), &mut |_| {}, &|| false);
    let found = found.expect("a horizon");
    // phi = 2 sin t passes 1 at pi/6.
    assert!(found.until > 0.51 && found.until < std::f64::consts::FRAC_PI_6, "{}", found.until);
    assert!(found.notes.iter().any(|note| note.contains("half")), "{:?}", found.notes);
    let measured: Vec<_> = found.entries.iter().filter_map(|entry| entry.found.as_ref()).collect();
    assert!(measured.len() > 10 && measured.iter().all(|found| found.error.is_finite()));
}

#[test]
fn the_error_is_the_distance_from_the_true_motion() {
    let found = compared("free", &[], &["dp8"], &[], 2.0);
    assert!(found.truth.accuracy < 1e-25 && found.truth.horizon.is_none(), "{:?}", found.truth.accuracy);
    // The same by other means: the ordinary run, and the series with its first orders in double-double.
    let scene = shipped("free", &[]);
    let angles = |request: Request| {
        let mut rows = Vec::new();
        let observer = &mut |sample: &driftless::run::Sample| {
            rows.push(sample.phi.clone());
            Ok(())
        };
        simulate(&scene, &request, observer).expect("a run");
        rows
    };
    let every = found.entries[0].plan.as_ref().expect("a plan").every;
    let asked = Request { until: Some(2.0), every: Some(every), ..Request::default() };
    let exact = angles(Request { method: Some(MethodId::Taylor), extended: true, ..asked.clone() });
    for entry in found.entries.iter().filter(|entry| entry.error().is_some_and(|error| error > 1e-12)) {
        let rtol = entry.plan.as_ref().and_then(|plan| plan.tolerance).expect("a tolerance").relative;
        let rows = angles(Request { method: Some(MethodId::Dp8), rtol: Some(rtol), ..asked.clone() });
        let distance =
            rows.iter().flatten().zip(exact.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let error = entry.error().expect("an error");
        assert!((error / distance - 1.0).abs() < 0.01, "{rtol:e}: {error:e}, {distance:e}");
    }
    let at = |rtol: f64| {
        found.entries.iter().find(|entry| {
            entry.plan.as_ref().and_then(|plan| plan.tolerance).is_some_and(|t| t.relative == rtol)
        })
    };
    let entry = at(1e-9).expect("an everyday tolerance");
    assert_eq!(entry.found.as_ref().map(|found| found.errors.len()), Some(found.truth.marks().count()));
    assert!(at(1e-5).and_then(|coarse| coarse.error()) > entry.error());
}

#[test]
fn a_method_that_lies_is_seen() {
    let found = compared("free", &[], &["taylor"], &[], 2.0);
    let last = found.truth.marks().last().expect("a reference");
    // An accurate run of a slightly different scene.
    let off = |overrides: &[&str]| {
        let scene = shipped("free", overrides);
        let mechanism = compile(&scene);
        let request = Request {
            method: Some(MethodId::Taylor),
            rtol: Some(1e-14),
            until: Some(last),
            every: Some(last),
            ..Request::default()
        };
        let plan = Plan::new(&scene, &mechanism, &request).expect("a plan");
        let mut running = Running::new(
            Run::new(mechanism.clone(), plan, Limits::default(), &mechanism.start(&scene)).expect("a run"),
        );
        assert!(running.go(&mut |_| Ok(()), &mut || false).expect("an end"));
        found.truth.error(running.motion()).expect("a time of the reference").0
    };
    let [honest, wrong] = [off(&[]), off(&["gravity[0]=9.810001"])];
    assert!(honest[0] < 1e-13 && honest[1] < 1e-12, "{honest:?}");
    assert!(wrong[0] > 1e-8 && wrong[0] < 1e-5 && wrong[1] > 1e-8, "{wrong:?}");
}

#[test]
fn every_method_gets_its_settings_and_errors_fall_with_them() {
    let found = compared("spring", &[], &["dopri5", "dop853", "taylor", "gauss8", "rattle4"], &[], 4.0);
    for method in ["dopri5", "dop853", "taylor", "gauss8", "rattle4"] {
        let errors: Vec<f64> = found
            .entries
            .iter()
            .filter(|entry| entry.method.info().name == method && !entry.extended)
            .filter_map(|entry| entry.error())
            .collect();
        let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(least < 1e-6, "{method}: {errors:?}");
        // A method may be at rounding with its first step.
        assert!(errors[0] > 100.0 * least || errors[0] < 1e-9, "{method}: {errors:?}");
    }
    assert!(
        found.entries.iter().any(|entry| entry.extended && entry.error().is_some_and(|error| error < 1e-14))
    );
    assert!(
        found.is_whole
            && found.entries.iter().all(|entry| entry.fate != Fate::Done || entry.spread().is_some())
    );
    // What is advised reaches what it is advised for.
    for advice in found.advice() {
        let error = advice
            .entry
            .and_then(|number| found.entries[number].error())
            .expect("within reach over a second");
        assert!(error <= advice.target);
    }
}

#[test]
fn chaos_ends_the_measurement_of_errors_and_not_the_runs() {
    let found = compared("free", &["start.bar1.phi=3"], &["gauss12"], &[], 60.0);
    let horizon = found.truth.horizon.expect("a chaotic scene");
    assert!(
        (10.0..40.0).contains(&horizon) && found.truth.until <= horizon && found.truth.until > 0.7 * horizon,
        "{horizon}"
    );
    let finest = found.entries.iter().rfind(|entry| entry.fate == Fate::Done).expect("an end");
    assert_eq!(finest.plan.as_ref().map(|plan| plan.until), Some(60.0));
    assert!(
        finest.error().is_some_and(|error| error < 1.0)
            && finest.found.as_ref().is_some_and(|found| found.energy < 1e-12)
    );
}

#[test]
fn what_is_refused_or_stops_stays_in_the_table() {
    let found = compared("wall", &[], &["dop853", "dp8", "gauss4", "rattle2"], &[], 1.0);
    for refused in ["dop853", "gauss4", "rattle2"] {
        let of = found.entries.iter().filter(|entry| entry.method.info().name == refused);
        assert!(
            of.clone().count() == 1
                && of
                    .clone()
                    .all(|entry| matches!(&entry.fate, Fate::Refused(why) if why.reason.contains("impact")))
        );
    }
    assert!(
        found.entries.iter().any(|entry| entry.error().is_some_and(|error| error < 1e-8)),
        "{:?}",
        found.entries
    );
    // Several stabilizations of one motor, one of which Gauss methods refuse.
    let both = [Stabilization::Elimination, Stabilization::Projection];
    let found = compared("motor", &[], &["gauss8", "dp8"], &both, 4.0);
    let kept = |method: &str, kind: Stabilization| {
        found
            .entries
            .iter()
            .filter(|entry| entry.method.info().name == method && entry.stabilization == Some(kind))
            .collect::<Vec<_>>()
    };
    assert!(
        kept("dp8", both[0]).len() > 5
            && kept("dp8", both[1]).len() > 5
            && !kept("gauss8", both[0]).is_empty()
    );
    assert!(matches!(kept("gauss8", both[1])[..], [entry] if matches!(entry.fate, Fate::Refused(_))));
    let drift = kept("dp8", both[0])[3].found.as_ref().and_then(|found| found.constraint);
    assert!(drift.is_some_and(|levels| levels.iter().all(|&level| level < 1e-12)));
}

#[test]
fn settings_there_is_no_time_for_say_so() {
    // By a clock that goes on whenever it is looked at, after every step that is.
    let ticks = Cell::new(0_u32);
    let clock = || {
        ticks.set(ticks.get() + 1);
        ticks.get() * Duration::from_micros(100)
    };
    let found = compared_by(&clock, 0.5, "free", &[], &["gauss4", "taylor"], &[], 5.0);
    assert!(found.entries.iter().any(|entry| matches!(entry.fate, Fate::Late(t) if t < 5.0)));
    assert!(
        found.entries.iter().all(|entry| !matches!(entry.fate, Fate::Late(_))
            || (entry.median().is_none() && entry.error().is_none()))
    );
}

#[test]
fn linkages_carts_and_chains_are_compared_too() {
    for (name, methods, until) in [
        ("four_bar_motor", &["dp8", "taylor", "rattle4"][..], 0.5),
        ("slider_crank_torque", &["dp8", "gauss8"], 0.2),
        ("cart_pole", &["dop853", "taylor"], 0.5),
        ("chain8", &["taylor"], 0.2),
    ] {
        let found = compared(name, &[], methods, &[], until);
        assert!(found.truth.until > 0.9 * until && found.truth.accuracy < 1e-20, "{name}: {:?}", found.notes);
        for method in methods {
            let errors = found
                .entries
                .iter()
                .filter(|entry| entry.method.info().name == *method)
                .filter_map(|entry| entry.error());
            let least = errors.fold(f64::INFINITY, f64::min);
            assert!(least < 1e-8, "{name}, {method}: {least:e}");
        }
    }
}

#[test]
fn it_can_be_given_up_at_any_time() {
    let scene = shipped("free", &[]);
    let asked = Asked {
        methods: Vec::new(),
        stabilize: Vec::new(),
        until: Some(2.0),
        budget: Duration::from_secs(60),
        blocks: 2,
    };
    let begin = Instant::now();
    let entries = Cell::new(0);
    let mut see = |_: &driftless::run::compare::Stage| entries.set(entries.get() + 1);
    let found =
        compare(&scene, &compile(&scene), &asked, &|| begin.elapsed(), &mut see, &|| entries.get() > 12)
            .expect("a horizon");
    assert!(!found.is_whole && (5..12).contains(&found.entries.len()), "{}", found.entries.len());
    assert!(found.entries.iter().all(|entry| entry.fate != Fate::Done || entry.median().is_some()));
}

#[cfg(feature = "cli")]
mod by_program {
    use super::program::Program;
    use serde_json::Value;

    const FEW: &str = "compare free.json --methods taylor,gauss12,rattle4 --until 1 --budget 2";

    #[test]
    fn the_object_has_the_names_scripts_rely_on() {
        let program = Program::with_scenes(&["free"]);
        let object = program.run(&format!("{FEW} --json -q")).exits(0).object();
        let rows = object["rows"].as_array().expect("rows");
        assert!(rows.len() > 15);
        for row in rows {
            for name in [
                "method",
                "setting",
                "error",
                "energy_drift",
                "constraint_drift",
                "wall_s",
                "wall_spread",
                "evaluations",
                "status",
            ] {
                assert!(row.get(name).is_some(), "{name} is missing in {row}");
            }
            assert!(row["status"] != "done" || row["wall_s"].as_f64() > Some(0.0), "{row}");
        }
        assert!(
            object["reference"]["accuracy"].as_f64() < Some(1e-25) && object["reference"]["until"] == 1.0
        );
        let advice = object["recommendations"].as_array().expect("advice");
        assert_eq!(
            advice.iter().filter_map(|advice| advice["error"].as_f64()).collect::<Vec<_>>(),
            [1e-3, 1e-6, 1e-9, 1e-12]
        );
        for advice in advice {
            let options = advice["options"].as_str().expect("within reach over a second");
            assert!(advice["sentence"].as_str().is_some_and(|sentence| sentence.contains(options)));
        }
        // What is advised is what `run` takes.
        let options = advice[3]["options"].as_str().unwrap_or_default();
        program.run(&format!("run free.json --until 1 --no-charts -q {options}")).exits(0);

        let mut expected = vec!["compare.csv", "compare.json"];
        if cfg!(feature = "charts") {
            expected.extend([
                "energy_drift_against_run_time.png",
                "error_against_evaluations.png",
                "error_against_run_time.png",
            ]);
        }
        let files: Vec<String> = program
            .files()
            .into_iter()
            .filter_map(|file| Some(file.strip_prefix("output/free/compare/")?.to_owned()))
            .collect();
        assert_eq!(files, expected);
        assert_eq!(program.read("output/free/compare/compare.csv").lines().count(), rows.len() + 1);
        let record: Value =
            serde_json::from_str(&program.read("output/free/compare/compare.json")).expect("JSON");
        assert_eq!(record["rows"], object["rows"]);
        program.run(&format!("{FEW} -q")).exits(6).says(&["--force"]);
    }

    #[test]
    fn the_page_is_eighty_columns_wide_and_says_what_to_choose() {
        let program = Program::with_scenes(&["motor"]);
        let ran = program.run("compare motor.json --methods dp8,gauss8 --stabilize elimination,baumgarte --until 4 --budget 4 --no-charts");
        let ran = ran.exits(0).shows(&[
            "For 1e-6 take --method",
            "errors         of angles in rad, largest at ",
            "dp8 b 1e-9",
            "gauss8 with baumgarte: refused",
            "double-double",
        ]);
        for line in ran.stdout.lines() {
            assert!(line.chars().count() <= 80, "{line}");
        }
    }

    #[test]
    fn requests_that_make_no_sense_are_refused() {
        let program = Program::with_scenes(&["free"]);
        program.run("compare free.json --methods rk4").exits(2);
        program.run("compare free.json --until -1").exits(2).says(&["--until"]);
        program.run("compare free.json --budget 0").exits(2).says(&["--budget"]);
        program.run("compare nothing.json").exits(6);
        assert_eq!(program.files(), ["free.json"]);
    }

    #[cfg(unix)]
    #[test]
    fn what_was_measured_survives_an_interruption() {
        use std::process::{Command, Stdio};
        let program = Program::with_scenes(&["motor"]);
        let command = "compare motor.json --until 100 --budget 300 --json";
        let child = program
            .command(command)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program");
        std::thread::sleep(std::time::Duration::from_millis(3000));
        assert!(
            Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill").success()
        );
        let output = child.wait_with_output().expect("it ends");
        assert_eq!(output.status.code(), Some(130), "{output:?}");
        let object: Value = serde_json::from_slice(&output.stdout).expect("one object");
        assert!(object["complete"] == false && object["rows"].is_array());
        let files = program.files();
        assert!(
            files.contains(&"output/motor/compare/compare.json".to_owned())
                && !files.iter().any(|file| file.contains("unfinished")),
            "{files:?}"
        );
    }
}
