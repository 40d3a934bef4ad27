//! What chains, ladders and long runs of them cost: one evaluation by matrices and body by body, and a hanging chain marched.
//!
//! `cargo bench --no-default-features --bench chains`: alternating blocks in one process, minimum and median.  Chains are 1 m and 1 kg in all,
//! their links thin rods; ladders are the four-bars of `examples/four_bars.rs`.

#[allow(dead_code)]
#[path = "../examples/four_bars.rs"]
mod four_bars;
#[allow(dead_code)]
#[path = "../examples/chain.rs"]
mod hanging;

use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::{Field, Form, Mechanism, Time};
use driftless::run::{MethodId, Request, Stabilization, simulate};
use driftless::scene::{Scene, Start};
use std::f64::consts::FRAC_PI_2;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

/// Blocks of each candidate, and seconds a block takes about.
const BLOCKS: usize = 40;
const BLOCK: f64 = 2e-3;
/// Largest number of bodies for which matrices are tried.
const MOST_DENSE: usize = 128;

/// A chain let go straight at an angle \[rad\] from the vertical, or bent and in motion.
fn chain(links: usize, angle: Option<f64>) -> Scene {
    let straight = hanging::chain(links, angle.unwrap_or(0.0));
    if angle.is_some() {
        return straight;
    }
    Scene { start: (0..links).map(|k| Start { phi: (0.37 * k as f64).sin(), omega: (0.71 * k as f64).cos() }).collect(), ..straight }
}

/// Four-bars side by side, a little past upright.
fn ladder(n: usize) -> Scene {
    let mut scene = four_bars::scene(n);
    scene.start[..=n].fill(Start { phi: FRAC_PI_2 - 0.4, omega: -1.0 });
    scene
}

/// A form and its state, timed block by block.
struct Candidate {
    field: Box<dyn Field>,
    y: Vec<f64>,
    rate: Vec<f64>,
    count: usize,
    times: Vec<f64>,
}

impl Candidate {
    fn new(mechanism: Mechanism, scene: &Scene) -> Self {
        let mechanism = Arc::new(mechanism);
        let start = mechanism.start(scene);
        let mut made = if mechanism.keeps_account() {
            let form = Multiplier::<0, true>::new(mechanism);
            Self { y: form.state(&start).y, field: Box::new(form), rate: Vec::new(), count: 1, times: Vec::new() }
        } else {
            let form = Multiplier::<0, false>::new(mechanism);
            Self { y: form.state(&start).y, field: Box::new(form), rate: Vec::new(), count: 1, times: Vec::new() }
        };
        made.rate = vec![0.0; made.y.len()];
        made.block();
        made.count = (BLOCK * 1e6 / made.times[0]).ceil() as usize;
        made.times.clear();
        made
    }

    fn block(&mut self) {
        let begin = Instant::now();
        for _ in 0..self.count {
            self.field.rate(Time::default(), black_box(&self.y), &mut self.rate);
            // A little further each time, so that nothing can be hoisted out.
            self.y[0] += 1e-13 * self.rate[self.rate.len() / 2];
        }
        self.times.push(begin.elapsed().as_secs_f64() * 1e6 / self.count as f64);
    }

    /// Minimum and median \[us\].
    fn result(&mut self) -> (f64, f64) {
        self.times.sort_by(f64::total_cmp);
        (self.times[0], self.times[self.times.len() / 2])
    }
}

/// One line of the table of evaluations.
fn compare(name: &str, scene: &Scene) {
    let mechanism = Mechanism::new(scene).expect("equations");
    let bodies = scene.bars.len();
    let mut bodywise = Candidate::new(mechanism.body_by_body(), scene);
    let mut dense = mechanism.by_matrices().filter(|_| bodies <= MOST_DENSE).map(|dense| Candidate::new(dense, scene));
    for _ in 0..BLOCKS {
        bodywise.block();
        if let Some(dense) = &mut dense {
            dense.block();
        }
    }
    let (least, usual) = bodywise.result();
    let per_body = least * 1e3 / bodies as f64;
    let chosen = if mechanism.recursion.is_some() { "bodies" } else { "matrices" };
    let (dense, ratio) = dense.map_or(("–".into(), "–".into()), |mut dense| {
        let (dense_least, dense_usual) = dense.result();
        (format!("{dense_least:.3} {dense_usual:.3}"), format!("{:.2}", dense_usual / usual))
    });
    println!("{name:>10} {bodies:>6} {least:>9.3} {usual:>9.3} {per_body:>8.1} {dense:>20} {ratio:>8} {chosen:>9}");
}

/// Seconds this thread has computed, where the system tells; elapsed ones elsewhere.
fn computed(begin: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|told| told.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or(begin.elapsed().as_secs_f64(), |nanoseconds| nanoseconds * 1e-9)
}

/// CPU seconds per simulated second of a run by the program's own loop, samples and all.
fn march(name: &str, scene: &Scene, request: &Request) {
    let (mut times, mut tally) = (Vec::new(), None);
    for _ in 0..5 {
        let clock = Instant::now();
        let begin = computed(clock);
        let outcome = simulate(scene, request, &mut |_| Ok(()));
        times.push((computed(clock) - begin) / request.until.unwrap_or(scene.until));
        match outcome {
            Ok(outcome) => tally = Some((outcome.tally.evaluations, outcome.drift.energy.max)),
            Err(error) => return println!("{name:>24}: {error}"),
        }
    }
    times.sort_by(f64::total_cmp);
    let (evaluations, energy) = tally.unwrap_or_default();
    println!("{name:>24} {:>9.4} {:>9.4} {evaluations:>9} {energy:>9.1e}", times[0], times[2]);
}

fn main() {
    println!(
        "{:>10} {:>6} {:>9} {:>9} {:>8} {:>20} {:>8} {:>9}",
        "one", "bodies", "min us", "median", "ns/body", "matrices", "ratio", "chosen"
    );
    for links in [2, 4, 5, 6, 7, 8, 10, 12, 16, 32, 64, 128, 512, 2000, 10_000] {
        compare("chain", &chain(links, None));
    }
    for n in [2, 3, 4, 6, 10, 20, 40] {
        compare("ladder", &ladder(n));
    }
    println!("\n{:>24} {:>9} {:>9} {:>9} {:>9}", "one simulated second", "CPU s", "median s", "evaluat.", "energy");
    for (name, angle) in [("128 links, 0.2 rad", 0.2), ("128 links, 0.5 rad", 0.5), ("128 links, horizontal", FRAC_PI_2)] {
        let request = Request { method: Some(MethodId::Dop853), rtol: Some(1e-6), ..Request::default() };
        march(name, &chain(128, Some(angle)), &request);
    }
    let kept = Request {
        method: Some(MethodId::Dp8),
        rtol: Some(1e-6),
        stabilize: Some(Stabilization::Projection),
        until: Some(0.25),
        ..Request::default()
    };
    march("ladder of 40, dp8", &ladder(40), &kept);
}
