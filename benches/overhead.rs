//! What rows cost: the method alone, the library's loop with its monitors, the same with the trajectory
//! written, and the program as a whole process.
//!
//! `cargo bench --bench overhead`: alternating rounds in one process, all to the same output times;
//! microseconds per output row (minimum and median over the rounds), and ratios of the minima to the method
//! alone and to the library's loop.

use driftless::dynamics::canonical::Canonical;
use driftless::dynamics::elimination::Elimination;
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::{Form, Mechanism, State};
use driftless::run::async_writer::AsyncWriter;
use driftless::run::files::TRAJECTORY;
use driftless::run::table::Table;
use driftless::run::{Folder, Limits, MethodId, Plan, Request, Run, integrate};
use driftless::scene::{Scene, read_scene};
use driftless::stepping::gauss::Gauss;
use driftless::stepping::{Dop853, Integrator, Seen, Statistics, Taylor};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::Instant;

/// Rounds of each candidate.
const ROUNDS: usize = 25;

struct Case {
    scene: &'static str,
    method: MethodId,
    until: f64,
    every: f64,
}

const CASES: [Case; 6] = [
    Case { scene: "free", method: MethodId::Dop853, until: 200.0, every: 0.02 },
    Case { scene: "free", method: MethodId::Dop853, until: 1000.0, every: 0.1 },
    Case { scene: "free", method: MethodId::Taylor, until: 1600.0, every: 0.02 },
    Case { scene: "free", method: MethodId::Taylor, until: 10_000.0, every: 1.0 },
    Case { scene: "motor", method: MethodId::Dop853, until: 200.0, every: 0.02 },
    Case { scene: "gentle", method: MethodId::Gauss(8), until: 400.0, every: 0.1 },
];

fn path(scene: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/scenes/{scene}.json"))
}

/// The method alone, to every output time.
fn bare<P: Form, M: Integrator<P>>(problem: &mut P, method: &mut M, mut state: State, plan: &Plan) {
    let (mut statistics, horizon) = (Statistics::default(), plan.time(plan.rows));
    let (mut from, mut inside) = (State::default(), State::default());
    for row in 1..=plan.rows {
        let until = plan.time(row);
        if !method.is_dense() {
            method
                .advance(problem, &mut state, until, &mut statistics, &mut |_, _| Ok(Seen::Kept))
                .expect("a step");
            continue;
        }
        while state.time < until {
            from.clone_from(&state);
            let watch = &mut |_: &mut P, state: &mut State| {
                let passed = state.time >= until;
                if !passed {
                    from.clone_from(state);
                }
                Ok(if passed { Seen::Enough } else { Seen::Kept })
            };
            method.advance(problem, &mut state, horizon, &mut statistics, watch).expect("a step");
        }
        if state.time > until {
            method.interpolate(problem, &from, until, &mut inside);
        }
    }
}

fn alone(case: &Case, scene: &Scene, mechanism: &Arc<Mechanism>, plan: &Plan) {
    let (start, tolerance) = (mechanism.start(scene), plan.tolerance.unwrap_or_default());
    let shared = || Arc::clone(mechanism);
    match (case.method, mechanism.constraints.is_empty()) {
        (MethodId::Dop853, true) => {
            let mut problem = Multiplier::<2, false>::new(shared());
            let state = problem.state(&start);
            bare(&mut problem, &mut Dop853::new(tolerance), state, plan);
        }
        (MethodId::Dop853, false) => {
            let mut problem = Elimination::<2>::new(shared());
            let state = problem.state(&start);
            bare(&mut problem, &mut Dop853::new(tolerance), state, plan);
        }
        (MethodId::Taylor, _) => {
            let mut problem = Elimination::<2>::new(shared());
            let state = problem.state(&start);
            bare(&mut problem, &mut Taylor::new(tolerance), state, plan);
        }
        _ => {
            let mut problem = Canonical::<2, false>::new(shared());
            let state = problem.state(&start);
            let mut gauss = Gauss::new(8, plan.step.expect("a step")).expect("eight stages");
            bare(&mut problem, &mut gauss, state, plan);
        }
    }
}

/// A name, and one run.
type Candidate<'a> = (&'a str, Box<dyn Fn() + 'a>);

fn main() {
    let place = std::env::temp_dir().join(format!("driftless-overhead-{}", std::process::id()));
    println!("{:44} {:>8} {:>8} {:>9} {:>8}", "one output row", "min us", "median", "to method", "to loop");
    for case in &CASES {
        let scene = read_scene(&path(case.scene), &[]).expect("a shipped scene");
        let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
        let request = Request {
            method: Some(case.method),
            until: Some(case.until),
            every: Some(case.every),
            ..Request::default()
        };
        let plan = Plan::new(&scene, &mechanism, &request).expect("a sensible pairing");
        let run = || {
            Run::new(Arc::clone(&mechanism), plan.clone(), Limits::default(), &mechanism.start(&scene))
                .expect("a beginning")
        };
        let with_files = || {
            let mut folder = Folder::open(&place, false).expect("a folder");
            let table = Table::new(&mechanism, folder.begin(TRAJECTORY).expect("a file")).expect("a header");
            let mut writer = AsyncWriter::new(table);
            integrate(run(), &mut |sample| writer.write(sample).map(drop)).expect("a run");
            folder.keep(writer.finish().expect("written")).expect("kept");
        };
        let program = || {
            let mut command = Command::new(env!("CARGO_BIN_EXE_driftless"));
            // An error estimate is a run of its own: the bench `trust` tells what it takes.
            command.arg("run").arg(path(case.scene)).args(["--quiet", "--trust", "off", "--out"]).arg(&place);
            if cfg!(feature = "charts") {
                command.arg("--no-charts");
            }
            command.args(["--method", &case.method.to_string()]);
            command.args(["--until", &case.until.to_string(), "--every", &case.every.to_string()]);
            assert!(command.stdout(Stdio::null()).status().expect("the program").success());
        };
        let candidates: [Candidate; 4] = [
            ("method alone", Box::new(|| alone(case, &scene, &mechanism, &plan))),
            (
                "library loop with monitors",
                Box::new(|| drop(integrate(run(), &mut |_| Ok(())).expect("a run"))),
            ),
            ("the same, trajectory written", Box::new(with_files)),
            ("driftless run, whole process", Box::new(program)),
        ];
        let mut times = [const { Vec::<f64>::new() }; 4];
        for _ in 0..ROUNDS {
            for ((_, candidate), times) in candidates.iter().zip(&mut times) {
                // Some file systems write a file out before they let another take its name: every round
                // begins in a fresh folder.
                let _ = std::fs::remove_dir_all(&place);
                let begin = Instant::now();
                candidate();
                times.push(begin.elapsed().as_secs_f64() * 1e6 / plan.rows as f64);
            }
        }
        for times in &mut times {
            times.sort_by(f64::total_cmp);
        }
        let [method, looped, ..] = times.each_ref().map(|times| times[0]);
        println!("{} by {}, {} rows of {} s", case.scene, case.method, plan.rows, plan.every);
        for ((name, _), times) in candidates.iter().zip(&times) {
            let (min, median) = (times[0], times[ROUNDS / 2]);
            println!("  {name:42} {min:8.2} {median:8.2} {:9.2} {:8.2}", min / method, min / looped);
        }
    }
    let _ = std::fs::remove_dir_all(&place);
}
