//! What an estimate of the error costs: runs with their trajectories written, with and without a reference
//! solution.
//!
//! `cargo bench --bench trust`: alternating rounds in one process at the scenes' own output intervals; what
//! the reference solution adds, in percent of the run without it (minimum over minimum, and the median of the
//! rounds' ratios).

use driftless::dynamics::Mechanism;
use driftless::run::files::TRAJECTORY;
use driftless::run::table::Table;
use driftless::run::trust::Level;
use driftless::run::{Folder, Limits, Plan, Request, Run, integrate};
use driftless::scene::read_scene;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Rounds of each candidate.
const ROUNDS: usize = 15;

/// Scenes, methods where others than the chosen one are of interest, tolerances, and the longest horizon
/// \[s\].
const CASES: &[(&str, &str, f64)] = &[
    ("free", "", 0.0),
    ("free", "dopri5", 1e-4),
    ("free", "taylor", 1e-9),
    ("free", "taylor", 1e-13),
    ("free", "gauss16", 0.0),
    ("gentle", "gauss4", 0.0),
    ("spring", "", 0.0),
    ("spring", "taylor", 1e-12),
    ("motor", "", 0.0),
    ("motor_sine", "", 0.0),
    ("motor_sine", "taylor", 1e-9),
    ("wall", "", 0.0),
    ("branch", "", 0.0),
    ("chain8", "", 0.0),
    ("chain8", "taylor", 1e-9),
    ("cart_pole", "", 0.0),
    ("four_bars", "", 0.0),
    ("kite", "", 0.0),
    ("quick_return", "", 0.0),
    ("slider_crank_torque", "", 0.0),
    ("andrews", "", 0.0),
];

fn main() {
    let place = std::env::temp_dir().join(format!("driftless-trust-{}", std::process::id()));
    println!("{:34} {:>10} {:>8} {:>8} {:>14}", "run", "us/row", "min", "median", "how");
    for &(name, method, rtol) in CASES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/scenes/{name}.json"));
        let scene = read_scene(&path, &[]).expect("a shipped scene");
        let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
        let (method, rtol) = (method.parse().ok(), (rtol > 0.0).then_some(rtol));
        let request = Request { method, rtol, until: Some(scene.until.min(50.0)), ..Request::default() };
        let plan = Plan::new(&scene, &mechanism, &request).expect("a sensible pairing");
        let start = mechanism.start(&scene);
        let run = |level: Level| {
            // Some file systems write a file out before they let another take its name: every round begins in
            // a fresh folder.
            let _ = std::fs::remove_dir_all(&place);
            let begin = Instant::now();
            let mut folder = Folder::open(&place, false).expect("a folder");
            let mut table =
                Table::new(&mechanism, folder.begin(TRAJECTORY).expect("a file")).expect("a header");
            let run = Run::new(Arc::clone(&mechanism), plan.clone(), Limits::default(), &start)
                .expect("a beginning");
            let outcome =
                integrate(run.trusted(level, &start), &mut |sample| table.write(sample)).expect("a run");
            folder.keep(table.finish().expect("written")).expect("kept");
            (begin.elapsed().as_secs_f64(), outcome.trust.map_or("", |trust| trust.how.word()))
        };
        let mut rounds: Vec<[f64; 2]> = Vec::new();
        let mut how = "";
        for _ in 0..ROUNDS {
            let plain = run(Level::Off).0;
            let (trusted, word) = run(Level::Auto);
            how = word;
            rounds.push([plain, trusted]);
        }
        let least = [0, 1].map(|k| rounds.iter().map(|round| round[k]).fold(f64::INFINITY, f64::min));
        let mut ratios: Vec<f64> = rounds.iter().map(|[plain, trusted]| trusted / plain).collect();
        ratios.sort_by(f64::total_cmp);
        let percent = |ratio: f64| 100.0 * (ratio - 1.0);
        let label = format!("{name}, {}", driftless::report::setting(&plan));
        let row = 1e6 * least[0] / plan.rows as f64;
        println!(
            "{label:34} {row:10.2} {:7.1}% {:7.1}% {how:>14}",
            percent(least[1] / least[0]),
            percent(ratios[ROUNDS / 2])
        );
    }
    let _ = std::fs::remove_dir_all(&place);
}
