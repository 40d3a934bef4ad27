//! A mechanism with all masses, lengths or times multiplied by a number is the same mechanism in other units:
//! every method does the same with it, or refuses and stops at the same place for the same reason.

#[allow(dead_code)]
use crate::scaled;

use crate::formulas::run as outcome;
use driftless::dynamics::{Mechanism, Units};
use driftless::run::{METHODS, MethodId, MethodInfo, Request, RunError, simulate};
use driftless::scene::{Scene, parse_scene, read_scene};
use driftless::stepping::Cause;
use scaled::{Scale, scaled};
use std::path::Path;

/// What came of a run, in the units of the scene as it was.
struct Run {
    /// The method and why it ended, or why it did not begin: the words before the first number.
    end: String,
    stopped: Option<(Cause, f64)>,
    steps: u64,
    /// t, then angles and positions over the length of the mechanism, at every output time.
    rows: Vec<(f64, Vec<f64>)>,
    /// Energy, work, strongest torque of a motor; relative to the energy scale.
    energy: Vec<f64>,
}

fn run(scene: &Scene, request: &Request, by: Scale) -> Run {
    let scene = scaled(scene, by);
    let mut request = request.clone();
    request.step = request.step.map(|step| step * by.time);
    request.until = request.until.map(|until| until * by.time);
    request.every = request.every.map(|every| every * by.time);
    let (bars, mut rows, mut energy) = (scene.bars.len(), Vec::new(), Vec::new());
    let result = simulate(&scene, &request, &mut |sample| {
        let at = |(k, x): (usize, &f64)| if k < bars { *x } else { x / by.length };
        let rates = sample
            .omega
            .iter()
            .enumerate()
            .map(|(k, x)| x * by.time / if k < bars { 1.0 } else { by.length });
        rows.push((sample.t / by.time, sample.phi.iter().enumerate().map(at).chain(rates).collect()));
        energy.extend([sample.kinetic, sample.work].map(|x| x / by.energy()));
        Ok(())
    });
    let plain = |text: String| text.split(|c: char| c.is_ascii_digit()).next().unwrap_or_default().to_owned();
    match result {
        Ok(outcome) => Run {
            end: outcome.plan.method.to_string(),
            stopped: outcome.stop.as_ref().map(|stop| (stop.cause, stop.t / by.time)),
            steps: outcome.statistics.steps,
            rows,
            energy,
        },
        Err(RunError::Observer(error)) => panic!("{error}"),
        Err(error) => Run { end: plain(error.to_string()), stopped: None, steps: 0, rows, energy },
    }
}

/// What tells two runs apart, if anything: `close` for the motion (relative to 1 rad, the rates and the
/// energy), `share` for the number of steps.
fn difference(name: &str, one: &Run, other: &Run, close: f64, share: f64) -> Option<String> {
    if one.end != other.end {
        return Some(format!("`{}` and `{}`", one.end, other.end));
    }
    if one.stopped.map(|stop| stop.0) != other.stopped.map(|stop| stop.0) {
        return Some(format!("{:?} and {:?}", one.stopped, other.stopped));
    }
    if one.rows.len() != other.rows.len() {
        return Some(format!("{} and {} rows", one.rows.len(), other.rows.len()));
    }
    let most = |values: &[f64]| values.iter().fold(1.0, |most: f64, x| most.max(x.abs()));
    for ((t, row), (_, beside)) in one.rows.iter().zip(&other.rows) {
        let apart = row.iter().zip(beside).fold(0.0, |far: f64, (a, b)| far.max((a - b).abs()));
        let is_close = apart <= close * most(row);
        if !is_close {
            return Some(format!(
                "{apart:.1e} apart at t = {t:.4} s, {} and {} steps",
                one.steps, other.steps
            ));
        }
    }
    let scale = one.energy.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let apart = one.energy.iter().zip(&other.energy).fold(0.0, |far: f64, (a, b)| far.max((a - b).abs()));
    if apart > close * scale {
        return Some(format!("energies {apart:.1e} of {scale:.1e} J apart"));
    }
    let steps = [one.steps as f64, other.steps as f64];
    // Which steps beside a singular position are rejected is rounding's to say.
    let share = if comes_in_line(name) { 0.25 } else { share };
    let is_alike = (steps[0] - steps[1]).abs() <= share * steps[0].max(steps[1]) + 3.0;
    (!is_alike).then(|| format!("{} and {} steps", one.steps, other.steps))
}

/// Masses, lengths and times multiplied, each by itself.
fn each(factors: &[f64]) -> Vec<Scale> {
    let one = Scale::ONE;
    let by = |&factor: &f64| {
        [Scale { mass: factor, ..one }, Scale { length: factor, ..one }, Scale { time: factor, ..one }]
    };
    factors.iter().flat_map(by).collect()
}

fn shipped(folder: &str) -> Vec<(String, Scene)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(folder);
    let mut files: Vec<_> =
        std::fs::read_dir(folder).expect("a folder").map(|file| file.expect("a file").path()).collect();
    files.sort();
    let read = |path: std::path::PathBuf| {
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        (name, read_scene(&path, &[]).expect("a scene"))
    };
    // Texts of formulas are not scaled.
    files
        .into_iter()
        .map(read)
        .filter(|(_, scene)| scene.laws.is_empty() && scene.events.is_empty())
        .collect()
}

/// Every shipped scene of a folder by the methods wanted, over times short enough that neighbouring motions
/// stay neighbours; what differs.
fn compared(
    folder: &str,
    ways: &dyn Fn(usize) -> Vec<(Option<MethodId>, Vec<Scale>)>,
    close: f64,
    share: f64,
) -> Vec<String> {
    let mut differences = Vec::new();
    for (number, (name, scene)) in shipped(folder).into_iter().enumerate() {
        for (method, scales) in ways(number) {
            let until = scene.until.min(1.0).max(scene.every);
            let rtol = method.filter(|method| method.is_adaptive()).map(|_| 1e-6);
            let request = Request {
                method,
                rtol,
                until: Some(until),
                every: Some(until / 10.0),
                max_evaluations: Some(500_000),
                ..Request::default()
            };
            let plain = run(&scene, &request, Scale::ONE);
            for &by in &scales {
                let label = method.map_or("default".to_owned(), |method| method.to_string());
                if is_left_out(&name, method) {
                    continue;
                }
                if let Some(what) = difference(&name, &plain, &run(&scene, &request, by), close, share) {
                    differences.push(format!("{name} by {label}, {by:?}: {what}"));
                }
            }
        }
    }
    differences
}

/// Fixed steps stop near where links come to lie in line, or pass, and which of both is rounding's to say.
fn is_left_out(name: &str, method: Option<MethodId>) -> bool {
    method.is_some_and(|method| !method.is_adaptive()) && comes_in_line(name)
}

/// Scenes that pass singular positions, or come near one.
fn comes_in_line(name: &str) -> bool {
    ["four_bars", "kite", "guided"].contains(&name)
}

fn fails(found: &[String]) -> String {
    format!("{} differ:\n{}", found.len(), found.join("\n"))
}

/// The units of a mechanism are powers of 1024, so that only the order of roundings is left.  Each method takes
/// one of the three powers in each scene, in turn; the default takes all.
#[test]
fn powers_of_1024_change_nothing_but_rounding() {
    let up = each(&[1024.0]);
    let ways = |scene: usize| {
        let turn =
            |(number, info): (usize, &MethodInfo)| (Some(info.id), vec![up[(number + scene) % up.len()]]);
        let each_method = METHODS.iter().enumerate().map(turn);
        each_method.chain([(None, each(&[1024.0, 1.0 / 1024.0, 1024.0 * 1024.0]))]).collect()
    };
    let found = compared("scenes", &ways, 1e-6, 0.03);
    assert!(found.is_empty(), "{}", fails(&found));
}

#[test]
fn powers_of_ten_change_no_more_than_tolerances_allow() {
    let names = ["dp8", "taylor", "radau5", "gauss8", "rattle4"];
    let ways = |_| {
        let each_method = names.iter().map(|name| (name.parse().ok(), each(&[1e3, 1e-6])));
        each_method.chain([(None, each(&[1e3, 1e-3, 1e6, 1e-6]))]).collect()
    };
    let found = compared("scenes", &ways, 1e-4, 0.05);
    assert!(found.is_empty(), "{}", fails(&found));
}

/// A double slider of heavy parts and a four-bar with a long crank: what a Gauss method leaves of the
/// multipliers is rounding at every mass.
#[test]
fn gauss_methods_keep_loops_at_every_mass() {
    for name in ["quick_return", "four_bar_motor"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/scenes/{name}.json"));
        let scene = read_scene(&path, &[]).expect("a shipped scene");
        for stages in [2, 4, 8] {
            for mass in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
                let request = Request {
                    method: Some(MethodId::Gauss(stages)),
                    until: Some(scene.until.min(1.0)),
                    ..Request::default()
                };
                let found = run(&scene, &request, Scale { mass, ..Scale::ONE });
                assert_eq!(found.stopped, None, "{name} by gauss{} at masses times {mass:e}", 2 * stages);
            }
        }
    }
}

/// The error of a pendulum that swings slowly or fast is what it is at 1 s, and so is its estimate.
#[test]
fn estimates_of_slow_and_fast_mechanisms_are_those_of_ordinary_ones() {
    let text = r#"{"name": "slow", "gravity": [0, -9.81],
        "bars": [{"name": "a", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}],
        "hinges": [{"name": "H", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]}],
        "start": {"a": {"phi": 0.3, "omega": 0}}, "until": 2, "every": 0.02}"#;
    let scene = parse_scene(text, "slow", &[]).expect("a scene");
    let estimate = |method, time: f64| {
        let scene = scaled(&scene, Scale { time, ..Scale::ONE });
        let (until, every) = (Some(2.0 * time), Some(0.02 * time));
        let outcome = outcome(&scene, &Request { method: Some(method), until, every, ..Request::default() });
        outcome.trust.and_then(|trust| trust.error_estimate).expect("an estimate")
    };
    for method in [MethodId::Dp8, MethodId::Radau(5)] {
        let ordinary = estimate(method, 1.0);
        for time in [1024.0 * 1024.0, 1e6, 1e-6] {
            let found = estimate(method, time);
            println!("{method} {time:e}: {found:e} {ordinary:e}");
            assert!((0.3..3.0).contains(&(found / ordinary)), "{method} {time:e}: {found:e} {ordinary:e}");
        }
    }
}

#[test]
fn mechanisms_of_human_size_keep_metres_and_seconds() {
    let other: Vec<String> = (shipped("scenes").into_iter())
        .filter(|(_, scene)| Mechanism::new(scene).expect("a mechanism").units != Units::default())
        .map(|(name, _)| name)
        .collect();
    assert!(other.is_empty(), "{other:?}");
}
