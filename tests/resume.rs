//! A run that is taken down and goes on elsewhere comes out as if nothing had been: bit for bit, wherever it
//! paused and how often.

use crate::common;
#[cfg(feature = "cli")]
use crate::program;

use common::shipped;
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::{Form, Mechanism};
use driftless::run::trust::Level;
use driftless::run::{
    Limits, METHODS, MethodId, Outcome, Plan, Problem, Request, Run, Running, Sample, Snapshot, Stabilization,
};
use driftless::scene::{Scene, parse_scene};
use driftless::stepping::composition::Composition::Single;
use driftless::stepping::{Cause, Dp8, Integrator, Reached, Seen, Statistics, Taylor, Tolerance};
use std::sync::Arc;
use std::time::Duration;

/// A run of a scene, begun.
fn begun(scene: &Scene, request: &Request) -> Result<Running, String> {
    let mechanism = Arc::new(Mechanism::new(scene).map_err(|error| error.to_string())?);
    let plan = Plan::new(scene, &mechanism, request).map_err(|refusal| refusal.to_string())?;
    let run = Run::new(Arc::clone(&mechanism), plan, Limits::default(), &mechanism.start(scene))
        .map_err(|stop| stop.to_string())?;
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

fn simulated(scene: &Scene, request: &Request) -> Outcome {
    let mut running = begun(scene, request).expect("a run");
    assert!(running.go(&mut |_| Ok(()), &mut || false).expect("samples are kept"));
    running.finish()
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
    Request {
        method: Some(method),
        stabilize,
        until,
        every,
        rtol: method.is_adaptive().then_some(1e-8),
        ..Request::default()
    }
}

#[test]
fn a_pause_between_two_rows_is_at_the_time_of_the_state() {
    let scene = shipped("free", &[]);
    let request = Request { every: Some(1.0), ..request(MethodId::Dp8, None) };
    let mut running = begun(&scene, &request).expect("begun");
    let mut left = 5;
    let mut pause = || {
        left -= 1;
        left == 0
    };
    assert!(!running.go(&mut |_| Ok(()), &mut pause).expect("samples are kept"));
    assert_eq!(running.time(), 0.0);
    assert!(running.reached() > 0.0 && running.reached() < 1.0, "{}", running.reached());
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
fn so_do_loops_and_sliders() {
    let mut pairs = 0;
    for info in METHODS {
        for name in ["four_bars", "cart_pole", "slider_crank_torque", "four_bar_motor"] {
            let request = Request { until: Some(0.25), every: Some(0.0625), ..request(info.id, None) };
            pairs += u32::from(check(&shipped(name, &[]), &request));
        }
    }
    assert!(pairs >= 4 * 12, "{pairs} pairs");
}

/// With whatever is watched near them, and where the motion leaves its branch.
#[test]
fn so_do_singular_positions() {
    for method in [MethodId::Taylor, MethodId::Dp8] {
        for name in ["four_bars", "kite", "slider_crank_equal"] {
            let request = Request { until: Some(4.0), every: Some(1.0), ..request(method, None) };
            assert!(check(&shipped(name, &[]), &request), "{method} {name}");
        }
    }
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
            let request =
                Request { extended: true, rtol: Some(1e-20), ..request(MethodId::Taylor, stabilize) };
            let has_rows = name == "motor_sine";
            assert!(check(&shipped(name, &[]), &request) || (stabilize.is_some() && !has_rows), "{name}");
        }
    }
}

/// Each step goes on from how far the one before was limited.
#[test]
fn so_do_steps_that_narrow_pulses_limit() {
    let text = r#"{"name": "pulse", "gravity": [0, -9.81], "until": 1, "every": 1,
        "bars": [{"name": "b", "mass": 1, "centre": [0.5, 0], "inertia": 0.1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}]}],
        "torques": [{"name": "k", "body": "b", "torque": "9*exp(-((t - 0.4)/0.01)^2) + 1*tanh(40*(b.phi + 1))"}],
        "start": {"b": {"phi": 0, "omega": 1}}}"#;
    let scene = parse_scene(text, "pulse", &[]).expect("a scene");
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Dopri5, MethodId::Radau(5)] {
        assert!(check(&scene, &request(method, None)), "{method}");
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

/// A method whose effort is used up stops at the same place where it was cut short on the way.
#[test]
fn effort_is_not_allowed_anew() {
    fn stops_at(mut method: impl Integrator<dyn Problem>, seen: Seen) -> f64 {
        let (mechanism, start) = common::started("free");
        let mut form = Multiplier::<2, false>::new(mechanism);
        let mut state = form.state(&start);
        let mut statistics = Statistics { max_evaluations: 400, ..Statistics::default() };
        loop {
            match method.advance(&mut form, &mut state, 1e3.into(), &mut statistics, &mut |_, _| Ok(seen)) {
                Ok(reached) => assert_eq!(reached, Reached::Pause),
                Err(stop) => {
                    assert_eq!(stop.cause, Cause::EffortExhausted);
                    return stop.t;
                }
            }
        }
    }
    let tolerance = Tolerance { relative: 1e-6, absolute: 1e-6 };
    let (explicit, series) = (Dp8::new(tolerance), Taylor::new(tolerance));
    assert_eq!(stops_at(explicit.clone(), Seen::Kept), stops_at(explicit, Seen::Enough));
    assert_eq!(stops_at(series.clone(), Seen::Kept), stops_at(series, Seen::Enough));
}

/// One window that ends on the maximum of evaluations, paused at every row: the same rows and the same stop;
/// with more allowed, it goes on to where a run that was never cut comes to.
#[test]
fn a_window_cut_by_the_maximum_of_evaluations_goes_on() {
    let scene = shipped("free", &[]);
    for method in [MethodId::Dopri5, MethodId::Dop853] {
        let whole = Request { every: Some(1.0), ..request(method, None) };
        let cut = Request { max_evaluations: Some(200), ..whole.clone() };
        // Bounded, so that a run that makes no step ends.
        let mut calls = 0;
        let at_every_row = &mut || {
            calls += 1;
            assert!(calls < 1000, "{method}: no step is made");
            true
        };
        let (pieces, pauses) = interrupted(&scene, &cut, at_every_row);
        assert!(pieces == uninterrupted(&scene, &cut).expect("a run"), "{method}");
        assert!(pieces.contains("EffortExhausted") && pauses > 5, "{method}: {pauses} pauses");

        let expected = simulated(&scene, &whole);
        // From its third row, and from its last one.
        for rows in [3, pauses] {
            let mut running = begun(&scene, &cut).expect("a run");
            let mut left = rows;
            let mut pause = || {
                left = left.saturating_sub(1);
                left == 0
            };
            assert!(!running.go(&mut |_| Ok(()), &mut pause).expect("kept"), "{method}");
            let mut snapshot = running.snapshot();
            snapshot.allow(10_000_000);
            let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
            let start = mechanism.start(&scene);
            let mut running = Running::resume(mechanism, &start, snapshot).expect("it fits");
            assert!(running.go(&mut |_| Ok(()), &mut || false).expect("kept"));
            let outcome = running.finish();
            assert!(outcome.stop.is_none(), "{method}: {:?}", outcome.stop);
            let off = (outcome.last.phi[1] - expected.last.phi[1]).abs();
            assert!(off < 1e-6, "{method} from row {rows}: off by {off:e}");
        }
    }
}

/// The error estimate is allowed no more evaluations than its run, and goes on where more are allowed.
#[test]
fn an_estimate_cut_by_the_maximum_of_evaluations_goes_on() {
    let scene = shipped("four_bars", &[]);
    let estimated = |most: u64| {
        let request = Request { max_evaluations: Some(most), ..request(MethodId::Taylor, None) };
        let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
        let (plan, start) =
            (Plan::new(&scene, &mechanism, &request).expect("a plan"), mechanism.start(&scene));
        let run = Run::new(mechanism, plan, Limits::default(), &start).expect("a run");
        Running::new(run.trusted(Level::Full, &start))
    };
    let finished = |mut running: Running| {
        assert!(running.go(&mut |_| Ok(()), &mut || false).expect("samples are kept"));
        running.finish()
    };
    let told = |outcome: Outcome| {
        let trust = outcome.trust.expect("an estimate was asked for");
        assert_eq!(trust.why, None);
        trust.error_estimate.expect("an estimate")
    };
    let expected = told(finished(estimated(1_000_000)));
    let why = finished(estimated(10)).trust.expect("an estimate was asked for").why;
    assert!(why.as_deref().is_some_and(|why| why.contains("work limit")), "{why:?}");
    let mut running = estimated(10);
    let mut last = running.snapshot();
    while !running.go(&mut |_| Ok(()), &mut || true).expect("kept") {
        last = running.snapshot();
    }
    last.allow(1_000_000);
    let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
    let start = mechanism.start(&scene);
    let found = told(finished(Running::resume(mechanism, &start, last).expect("it fits")));
    assert!((0.5..2.0).contains(&(found / expected)), "{found:e} for {expected:e}");
}

#[test]
fn the_horizon_can_be_put_off() {
    let trajectory = |told: &str| told.split("] Outcome").next().unwrap_or_default().to_owned();
    for method in [MethodId::Dp8, MethodId::Gauss(4), MethodId::Taylor, MethodId::Dop853] {
        let scene = shipped("free", &[]);
        // A step of its own: the one that is chosen unasked depends on the horizon.
        let short = Request { step: (!method.is_adaptive()).then_some(1.0 / 64.0), ..request(method, None) };
        let until = if method.is_adaptive() { 3.1 } else { 3.0 };
        let long = Request { until: Some(until), ..short.clone() };
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
            calls == 3
        });
        assert!(!is_over.expect("kept"), "{method}");
        let mut snapshot = running.snapshot();
        assert!(!snapshot.clone().extend(0.5) && !snapshot.clone().extend(1e300) && snapshot.extend(until));
        // Fixed steps are whole to the end.
        assert_eq!(snapshot.clone().extend(3.1005), method.is_adaptive());
        let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
        let start = mechanism.start(&scene);
        let mut running = Running::resume(mechanism, &start, snapshot).expect("it fits");
        assert!(running.go(&mut keep, &mut || false).expect("kept"));
        let outcome = running.finish();
        assert_eq!(outcome.last.t, until);
        assert!(trajectory(&told(&samples, outcome)) == trajectory(&whole), "{method}");
    }
}

/// A spring's periods, and the steps that follow them, go with the horizon.
#[test]
fn a_later_horizon_has_as_many_more_periods() {
    let scene = shipped("spring", &["spring.stiffness=1e6", "spring.damping=0"]);
    let mode = |plan: &Plan| plan.stiffness.clone().expect("a mode");
    let short = begun(&scene, &request(MethodId::Dp8, None)).expect("a run");
    let mut snapshot = short.snapshot();
    assert!(snapshot.extend(3.0));
    let later = Request { until: Some(3.0), ..request(MethodId::Dp8, None) };
    let (extended, whole) = (mode(snapshot.plan()), mode(begun(&scene, &later).expect("a run").plan()));
    assert!(whole.periods > 300.0 && whole.steps > 300.0, "{whole:?}");
    for [extended, whole] in [[extended.periods, whole.periods], [extended.steps, whole.steps]] {
        assert!((extended / whole - 1.0).abs() < 1e-12, "{extended} and {whole}");
    }
}

/// Whatever bytes a snapshot is made of, it is refused or integrated; nothing panics, and nothing takes for
/// ever.
mod bytes {
    use super::*;
    use proptest::prelude::*;
    use std::sync::LazyLock;

    type Sound = (Scene, Arc<Mechanism>, Vec<u8>);

    static SOUND: LazyLock<Vec<Sound>> = LazyLock::new(|| {
        let methods = [
            ("free", MethodId::Dp8),
            ("free", MethodId::Taylor),
            ("wall", MethodId::Dp5),
            ("motor_sine", MethodId::Rattle(Single)),
        ];
        let of = |&(name, method): &(&str, MethodId)| {
            let scene = shipped(name, &[]);
            let mut running = begun(&scene, &request(method, None)).expect("a run");
            assert!(!running.go(&mut |_| Ok(()), &mut now_and_then(1, 5)).expect("nobody fails"));
            let bytes = postcard::to_stdvec(&running.snapshot()).expect("bytes");
            let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
            (scene, mechanism, bytes)
        };
        methods.iter().map(of).collect()
    });

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        #[test]
        fn no_snapshot_makes_a_run_panic(which in 0..4_usize, changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4)) {
            let (scene, mechanism, bytes) = &SOUND[which];
            let mut bytes = bytes.clone();
            for (place, byte) in changes {
                let place = place.index(bytes.len());
                bytes[place] = byte;
            }
            if let Ok(mut snapshot) = postcard::from_bytes::<Snapshot>(&bytes)
                && let Ok(mut running) = Running::resume(Arc::clone(mechanism), &mechanism.start(scene), {
                    snapshot.allow(20_000);
                    snapshot
                })
            {
                let mut calls = 0;
                let mut pause = || {
                    calls += 1;
                    calls >= 20
                };
                if running.go(&mut |_| Ok(()), &mut pause).expect("nobody fails") {
                    running.finish();
                }
            }
        }
    }
}

/// The program, whatever ends it.
#[cfg(all(unix, feature = "cli"))]
mod command {
    use super::program::{Program, Ran};
    use serde_json::Value;
    use std::path::Path;
    use std::process::{Child, Command, Stdio};
    use std::time::Duration;

    /// A run of about a second, twenty thousand rows.
    const RUN: &str =
        "run free.json --method taylor --rtol 1e-9 --until 2e4 --every 1 --no-charts --checkpoint-every 0.01";
    const FOLDER: &str = "output/free/taylor-1e-9";

    fn started(program: &Program, arguments: &str) -> Child {
        program.command(arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program")
    }

    /// Waits for a checkpoint other than the one there was.
    fn await_checkpoint(path: &Path, child: &mut Child) {
        let file = path.join("checkpoint");
        let before = std::fs::read(&file).ok();
        while std::fs::read(&file).ok().is_none_or(|now| Some(now) == before) {
            assert_eq!(child.try_wait().expect("a child"), None, "it ended before its checkpoint");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    fn signal(child: &Child, signal: &str) {
        assert!(
            Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill").success()
        );
    }

    fn ended(child: Child) -> Ran {
        let output = child.wait_with_output().expect("it ends");
        let stderr = String::from_utf8(output.stderr).expect("UTF-8");
        Ran { code: output.status.code().unwrap_or(-1), stdout: String::new(), stderr }
    }

    /// Table and record of a finished run, timings left out.
    fn results(program: &Program, folder: &str, table: &str, record: &str) -> (String, Value) {
        let mut record: Value =
            serde_json::from_str(&program.read(&format!("{folder}/{record}"))).expect("JSON");
        record.as_object_mut().expect("an object").remove("timings");
        (program.read(&format!("{folder}/{table}")), record)
    }

    fn run_results(program: &Program) -> (String, Value) {
        results(program, FOLDER, "trajectory.csv", "run.json")
    }

    fn uninterrupted() -> (String, Value) {
        let program = Program::with_scenes(&["free"]);
        program.run(&format!("{RUN} -q")).exits(0);
        assert_eq!(
            program.files(),
            ["free.json".to_owned(), format!("{FOLDER}/run.json"), format!("{FOLDER}/trajectory.csv")]
        );
        run_results(&program)
    }

    /// An interrupted run, with two checkpoints, and its folder.
    fn interrupted() -> Program {
        let program = Program::with_scenes(&["free"]);
        let mut child = started(&program, RUN);
        for _ in 0..2 {
            await_checkpoint(&program.path(FOLDER), &mut child);
        }
        signal(&child, "-TERM");
        ended(child).exits(130).says(&["interrupted at t = ", &format!("driftless resume {FOLDER}")]);
        program
    }

    #[test]
    fn asked_to_end_it_writes_a_checkpoint_and_goes_on_when_resumed() {
        let program = interrupted();
        let files = ["checkpoint", "checkpoint.previous", ".unfinished-trajectory.csv"]
            .map(|name| format!("{FOLDER}/{name}"));
        assert!(files.iter().all(|file| program.path(file).exists()), "{:?}", program.files());
        // Nothing but the folder is needed; a run into it is refused.
        program.run(&format!("{RUN} -q")).exits(6).says(&["interrupted run", "--force"]);
        std::fs::remove_file(program.path("free.json")).expect("removed");
        let mut child = started(&program, &format!("resume {FOLDER} --checkpoint-every 0"));
        std::thread::sleep(Duration::from_millis(100));
        signal(&child, "-INT");
        let ran = ended(child);
        assert!(ran.code == 130 || ran.code == 0, "{ran:?}");
        if ran.code == 130 {
            let ran = program.run(&format!("resume {FOLDER} --json")).exits(0);
            assert_eq!(ran.object()["final"]["t"], 2e4);
        }
        assert!(run_results(&program) == uninterrupted());
        assert_eq!(program.files(), [format!("{FOLDER}/run.json"), format!("{FOLDER}/trajectory.csv")]);
        program.run(&format!("resume {FOLDER}")).exits(6).says(&["finished"]);
        program.run("resume output/none").exits(6).says(&["no folder"]);
        child = started(&program, "resume output");
        ended(child).exits(6).says(&["no interrupted run"]);
    }

    /// The crate's methods end in the middle of a step where they are asked to; what watches the step before, for
    /// events and means of outputs, has to see all of it.
    #[test]
    fn interruptions_leave_no_trace_in_events_and_outputs() {
        let program = Program::with_scenes(&["gentle"]);
        let text = program.read("gentle.json").trim_end().strip_suffix('}').expect("an object").to_owned()
            + r#", "events": [{"name": "level", "when": "bar1.cos - 0.99"}]}"#;
        program.write("watched.json", &text);
        let run = "run watched.json --method dopri5 --rtol 1e-11 --until 150 --every 1 --output lean=bar2.sin \
                   --no-charts --trust off";
        let folder = "whole/gentle/dopri5-1e-11";
        program.run(&format!("{run} --out whole -q")).exits(0);
        let whole =
            ["events.csv", "trajectory.csv"].map(|table| results(&program, folder, table, "run.json"));
        let mut child = started(&program, run);
        let mut count = 0;
        loop {
            std::thread::sleep(Duration::from_millis(40));
            signal(&child, "-INT");
            let ran = ended(child);
            if ran.code == 0 {
                break;
            }
            ran.exits(130);
            count += 1;
            child = started(&program, "resume output");
        }
        assert!(count > 2, "{count} interruptions");
        let folder = folder.replace("whole", "output");
        for (table, whole) in ["events.csv", "trajectory.csv"].iter().zip(&whole) {
            assert!(
                results(&program, &folder, table, "run.json") == *whole,
                "{table}, {count} interruptions"
            );
        }
    }

    #[test]
    fn one_that_used_up_its_evaluations_goes_on_where_more_are_allowed() {
        let program = Program::with_scenes(&["free"]);
        program
            .run(&format!("{RUN} -q --max-evaluations 1000"))
            .exits(4)
            .says(&["--max-evaluations", "resume"]);
        let short = program.read(&format!("{FOLDER}/trajectory.csv"));
        program.run(&format!("resume {FOLDER} -q")).exits(4).says(&["maximum of 1000 evaluations"]);
        assert!(program.read(&format!("{FOLDER}/trajectory.csv")) == short);
        program.run(&format!("resume {FOLDER} -q --max-evaluations 100000000")).exits(0);
        let whole = Program::with_scenes(&["free"]);
        whole.run(&format!("{RUN} -q --max-evaluations 100000000")).exits(0);
        assert!(run_results(&program) == run_results(&whole));
        program.run(&format!("resume {FOLDER}")).exits(6).says(&["finished"]);
    }

    #[test]
    fn killed_again_and_again_it_comes_out_the_same() {
        let program = Program::with_scenes(&["free"]);
        let mut child = started(&program, RUN);
        for _ in 0..4 {
            await_checkpoint(&program.path(FOLDER), &mut child);
            child.kill().expect("killed");
            child.wait().expect("it ends");
            child = started(&program, "resume output --checkpoint-every 0.01");
        }
        ended(child).exits(0);
        assert!(run_results(&program) == uninterrupted());
    }

    /// A run that writes no checkpoint but the first, killed as soon as that is there.
    fn killed_at_once(program: &Program, command: &str, out: &str, folder: &str) {
        let mut child = started(program, &format!("{command} --checkpoint-every 600 --out {out}"));
        await_checkpoint(&program.path(&format!("{out}/{folder}")), &mut child);
        signal(&child, "-KILL");
        assert_eq!(ended(child).code, -1);
    }

    #[test]
    fn killed_before_its_first_step_it_goes_on_from_any_folder_above() {
        const LONG: &str = "run free.json --method taylor --rtol 1e-9 --until 2e4 --every 1 --no-charts";
        let program = Program::with_scenes(&["free"]);
        killed_at_once(&program, LONG, "output", "free/taylor-1e-9");
        std::fs::remove_file(program.path("free.json")).expect("removed");
        program.run("resume .").exits(0).says(&[FOLDER]);
        assert!(run_results(&program) == uninterrupted());
        program.run("resume output").exits(6).says(&["no interrupted run"]);
    }

    #[test]
    fn of_several_interrupted_ones_all_are_named() {
        const LONG: &str = "run free.json --method taylor --rtol 1e-9 --until 2e4 --every 1 --no-charts";
        const SWEEP: &str = "sweep free.json --vary bar1.phi=-pi..pi:60 --vary bar2.phi=-pi..pi:60 --rtol 1e-9 --until 100 --no-charts";
        let program = Program::with_scenes(&["free"]);
        let sweep = "free/sweep-start.bar1.phi-start.bar2.phi-taylor-1e-9";
        killed_at_once(&program, LONG, "out/a", "free/taylor-1e-9");
        killed_at_once(&program, SWEEP, "out/b", sweep);
        program.run("resume out").exits(6).says(&[
            "2 interrupted runs",
            "driftless resume out/a/free/taylor-1e-9",
            &format!("driftless resume out/b/{sweep}"),
        ]);
        program.run("resume out/b -q").exits(0).stays_silent();
        let whole = Program::with_scenes(&["free"]);
        whole.run(&format!("{SWEEP} -q")).exits(0);
        let table = |program: &Program, out: &str| program.read(&format!("{out}/{sweep}/sweep.csv"));
        assert!(table(&program, "out/b") == table(&whole, "output"));
        // What is left is the one, and what somebody is writing does not count.
        let mut child = started(&program, &format!("{SWEEP} --out out/c"));
        await_checkpoint(&program.path(&format!("out/c/{sweep}")), &mut child);
        program.run("resume out -q").exits(0);
        signal(&child, "-KILL");
        ended(child);
    }

    #[test]
    fn one_folder_takes_one_run_at_a_time() {
        let program = Program::with_scenes(&["free"]);
        let mut child = started(&program, RUN);
        await_checkpoint(&program.path(FOLDER), &mut child);
        for arguments in [RUN, &format!("{RUN} --force"), &format!("resume {FOLDER}")] {
            program.run(arguments).exits(6).says(&["another run is writing into"]);
        }
        ended(child).exits(0);
    }

    #[test]
    fn damaged_checkpoints_are_noticed_and_the_one_before_serves() {
        let program = interrupted();
        let path = |name: &str| program.path(&format!("{FOLDER}/{name}"));
        let resume = format!("resume {FOLDER} -q");
        let good = std::fs::read(path("checkpoint")).expect("there");
        let with = |bytes: &[u8]| std::fs::write(path("checkpoint"), bytes).expect("written");
        // Of another format, and whole: refused, though the one before it could be read.
        let mut other = good[..good.len() - 32].to_vec();
        other[21] = 99;
        let digest = <sha2::Sha256 as sha2::Digest>::digest(&other);
        other.extend_from_slice(&digest);
        with(&other);
        program.run(&resume).exits(3).says(&["format 99", "the version of driftless that wrote it"]);
        // A table that is not the one.
        with(&good);
        let table = path(".unfinished-trajectory.csv");
        let text = std::fs::read(&table).expect("there");
        for (bad, why) in [(&text[..100], "shorter"), (&[b"x", &text[1..]].concat(), "changed")] {
            std::fs::write(&table, bad).expect("written");
            program.run(&resume).exits(6).says(&[why]);
        }
        std::fs::write(&table, &text).expect("written");
        let previous = std::fs::read(path("checkpoint.previous")).expect("there");
        std::fs::write(path("checkpoint.previous"), &previous[..99]).expect("written");
        let mut flipped = good.clone();
        flipped[good.len() / 2] ^= 4;
        with(&flipped);
        program.run(&resume).exits(6).says(&["damaged", "checksum"]);
        std::fs::write(path("checkpoint.previous"), &previous).expect("written");
        program.run(&resume).exits(0).says(&["damaged", "going on from the checkpoint before it"]);
        assert!(run_results(&program) == uninterrupted());
    }

    #[test]
    fn the_horizon_can_be_put_off_but_not_brought_forward() {
        let program = interrupted();
        program.run(&format!("resume {FOLDER} --until 1e4")).exits(2).says(&["one beyond 20000 s"]);
        program.run(&format!("resume {FOLDER} --until 2.2e4 -q")).exits(0);
        let longer = Program::with_scenes(&["free"]);
        longer.run(&format!("{} -q", RUN.replace("2e4", "2.2e4"))).exits(0);
        let [(table, record), (whole, of_whole)] = [&program, &longer].map(run_results);
        assert!(table == whole && record["result"]["final"] == of_whole["result"]["final"]);
        assert_eq!(record["result"]["energy"]["max_relative"], of_whole["result"]["energy"]["max_relative"]);
    }

    #[test]
    fn a_full_disk_ends_it_and_room_lets_it_go_on() {
        let program = Program::with_scenes(&["free"]);
        // Files may have 4 MiB, which is less than the trajectory's.
        let limited = format!("ulimit -f 4096; exec {} {RUN} -q", env!("CARGO_BIN_EXE_driftless"));
        let folder = program.path("");
        let output = Command::new("bash").args(["-c", &limited]).current_dir(&folder).output().expect("bash");
        let text = String::from_utf8(output.stderr).expect("UTF-8");
        let ran = Ran { code: output.status.code().unwrap_or(-1), stdout: String::new(), stderr: text };
        ran.exits(6).says(&["cannot write", "is the disk full", &format!("driftless resume {FOLDER}")]);
        program.run(&format!("resume {FOLDER} -q")).exits(0);
        assert!(run_results(&program) == uninterrupted());
    }

    #[test]
    fn a_folder_that_is_taken_away_ends_it() {
        let program = Program::with_scenes(&["free"]);
        let mut child = started(&program, RUN);
        await_checkpoint(&program.path(FOLDER), &mut child);
        // It may be writing there at this very moment.
        while std::fs::remove_dir_all(program.path("output")).is_err() {}
        ended(child).exits(6).says(&["cannot write"]);
    }

    #[test]
    fn sweeps_go_on_too() {
        const SWEEP: &str = "sweep free.json --vary bar1.phi=-pi..pi:60 --vary bar2.phi=-pi..pi:60 --rtol 1e-9 --until 100 --checkpoint-every 0.01";
        const PLACE: &str = "output/free/sweep-start.bar1.phi-start.bar2.phi-taylor-1e-9";
        let of_sweep = |program: &Program| {
            (
                results(program, PLACE, "sweep.csv", "sweep.json"),
                std::fs::read(program.path(&format!("{PLACE}/map.png"))).ok(),
            )
        };
        let program = Program::with_scenes(&["free"]);
        let mut child = started(&program, SWEEP);
        for kill in ["-KILL", "-INT", "-KILL"] {
            await_checkpoint(&program.path(PLACE), &mut child);
            signal(&child, kill);
            let ran = ended(child);
            assert_eq!(ran.code, if kill == "-INT" { 130 } else { -1 }, "{ran:?}");
            child = started(&program, &format!("resume {PLACE} --checkpoint-every 0.01"));
        }
        ended(child).exits(0);
        let whole = Program::with_scenes(&["free"]);
        whole.run(&format!("{SWEEP} --threads 1 -q")).exits(0);
        assert!(of_sweep(&program) == of_sweep(&whole));

        // So does a part of one, and the parts together are the whole.
        let parts = Program::with_scenes(&["free"]);
        let first = format!("{PLACE}/shard-1-of-2");
        let mut child = started(&parts, &format!("{SWEEP} --shard 1/2"));
        await_checkpoint(&parts.path(&first), &mut child);
        signal(&child, "-KILL");
        ended(child);
        parts.run(&format!("{SWEEP} --shard 2/2 -q")).exits(0);
        parts.run(&format!("merge {PLACE}")).exits(6).says(&["not finished", "driftless resume"]);
        parts.run(&format!("resume {first} -q")).exits(0);
        parts.run(&format!("merge {PLACE} -q")).exits(0);
        assert!(of_sweep(&parts) == of_sweep(&whole));
    }

    /// The points of a CSV table are in checkpoints and parts of sweeps: the file may change or go meanwhile.
    #[test]
    fn files_of_tables_are_not_needed_again() {
        const BESIDE: &str = r#", "tables": {"gust": "gust.csv"},
            "torques": [{"name": "wind", "body": "bar1", "torque": "0.02*gust(t/(1 s))"}]}"#;
        let gusty = || {
            let program = Program::with_scenes(&["free"]);
            let text = program.read("free.json");
            let text = text.trim_end().strip_suffix('}').expect("an object").to_owned() + BESIDE;
            program.write("gusty.json", &text);
            program.write("gust.csv", "0,0\n0.7,0.3\n1.1,-0.2\n3000,0.1\n");
            program
        };
        let sweep =
            "sweep gusty.json --vary bar1.phi=-pi..pi:20 --vary bar2.phi=-pi..pi:20 --rtol 1e-9 --until 10";
        let place = "free/sweep-start.bar1.phi-start.bar2.phi-taylor-1e-9";
        let whole = gusty();
        for (command, folder, table, record) in [
            (
                "run gusty.json --method taylor --rtol 1e-9 --until 25 --every 0.1 --trust off",
                "free/taylor-1e-9",
                "trajectory.csv",
                "run.json",
            ),
            (
                "run gusty.json --digits 30 --until 20 --every 0.1",
                "free/taylor-digits-30",
                "trajectory.csv",
                "run.json",
            ),
            (sweep, place, "sweep.csv", "sweep.json"),
        ] {
            let program = gusty();
            let command = format!("{command} --no-charts --checkpoint-every 0.01");
            let mut child = started(&program, &command);
            await_checkpoint(&program.path(&format!("output/{folder}")), &mut child);
            signal(&child, "-KILL");
            ended(child);
            std::fs::remove_file(program.path("gust.csv")).expect("removed");
            program.run("resume output -q").exits(0);
            whole.run(&format!("{command} -q")).exits(0);
            let [resumed, whole] = [&program, &whole]
                .map(|program| results(program, &format!("output/{folder}"), table, record));
            assert!(resumed == whole, "{command}");
        }
        let parts = gusty();
        for number in 1..=2 {
            parts.run(&format!("{sweep} --no-charts --shard {number}/2 -q")).exits(0);
        }
        parts.write("gust.csv", "0,0\n1,5\n");
        parts.run("merge output --out merged -q").exits(0);
        let [merged, whole] = [(&parts, "merged".to_owned()), (&whole, format!("output/{place}"))]
            .map(|(program, folder)| results(program, &folder, "sweep.csv", "sweep.json"));
        assert!(merged == whole);
    }
}
