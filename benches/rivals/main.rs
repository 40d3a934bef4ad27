//! Time at equal true error: this crate beside `ode_solvers` and `differential-equations`, in one process.
//!
//! `cargo bench --bench rivals [SCENE…]`: sixteen starts within half a milliradian of the scene's own (a
//! chaotic scene judged by one start is judged by luck); every candidate walks down a ladder of tolerances
//! until the geometric mean of its errors at the end is below the target; then all are timed in alternating
//! blocks. Errors are the largest difference in an angle \[rad\] or a rate \[rad/s\] from a double-double run
//! that shares the constants and the starts to the bit; times are microseconds per simulated second and
//! trajectory, minimum and median of the blocks.
//!
//! With `--angles` rates are not judged: those of fast bars are ten times and more as far off.
//!
//! `cargo bench --bench rivals -- --serve` answers the script in `benches/peers` line by line instead.

mod by_hand;
mod candidates;
mod problem;
mod serve;

use candidates::Candidate;
use problem::Problem;
use std::time::Instant;

/// Blocks of each candidate.
const BLOCKS: usize = 25;

/// The loosest rung of the ladder that reaches the target, with its error.
fn setting(candidate: &mut Candidate, problem: &Problem, target: f64) -> Option<(f64, f64)> {
    (12..=80).map(|rung| 10f64.powf(-f64::from(rung) / 4.0)).find_map(|tolerance| {
        let error = problem.error(&(candidate.run)(tolerance));
        (error <= target).then_some((tolerance, error))
    })
}

fn main() {
    if std::env::args().any(|word| word == "--serve") {
        return serve::serve();
    }
    let wanted: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let cases: [(&str, &[f64]); 7] = [
        ("free", &[1e-6, 1e-9]),
        ("gentle", &[1e-12]),
        ("spring", &[1e-9]),
        ("motor", &[1e-9]),
        ("motor_sine", &[1e-9]),
        ("chain3", &[1e-7]),
        ("chain6", &[1e-8]),
    ];
    println!(
        "{:10} {:>6}  {:36} {:>8} {:>8} {:>9} {:>9}",
        "scene", "target", "code", "setting", "error", "min us/s", "median"
    );
    for (name, targets) in cases {
        if !wanted.is_empty() && !wanted.iter().any(|word| word == name) {
            continue;
        }
        let mut problem = Problem::named(name).expect("a scene of this bench");
        problem.with_rates = std::env::args().all(|word| word != "--angles");
        let mut candidates = candidates::all(&problem);
        for &target in targets {
            let settings: Vec<_> =
                candidates.iter_mut().map(|candidate| setting(candidate, &problem, target)).collect();
            let mut times = vec![Vec::new(); candidates.len()];
            for _ in 0..BLOCKS {
                for ((candidate, setting), times) in candidates.iter_mut().zip(&settings).zip(&mut times) {
                    if let Some((tolerance, _)) = *setting {
                        times.push(timed(candidate, &problem, tolerance));
                    }
                }
            }
            for ((candidate, setting), times) in candidates.iter().zip(&settings).zip(&mut times) {
                times.sort_by(f64::total_cmp);
                match setting {
                    Some((tolerance, error)) => {
                        let (least, middle) = (times[0], times[times.len() / 2]);
                        println!(
                            "{name:10} {target:6.0e}  {:36} {tolerance:8.1e} {error:8.1e} {least:9.2} {middle:9.2}",
                            candidate.name
                        );
                    }
                    None => println!("{name:10} {target:6.0e}  {:36} does not reach it", candidate.name),
                }
            }
        }
    }
}

/// Microseconds per simulated second and trajectory of one run over all starts.
fn timed(candidate: &mut Candidate, problem: &Problem, tolerance: f64) -> f64 {
    let clock = Instant::now();
    std::hint::black_box((candidate.run)(tolerance));
    clock.elapsed().as_secs_f64() * 1e6 / (problem.until * problem.starts.len() as f64)
}
