//! What chains, ladders and long runs of them cost: one evaluation by matrices and body by body, and a
//! hanging chain integrated.
//!
//! `cargo bench --no-default-features --bench chains [-- evaluations | hanging | ladders]`: alternating
//! blocks in one process, minimum and median. Chains are 1 m and 1 kg in all, their links thin rods; ladders
//! are the four-bars of `examples/four_bars.rs`.

#[allow(dead_code)]
#[path = "../examples/four_bars.rs"]
mod four_bars;
#[allow(dead_code)]
#[path = "../examples/chain.rs"]
mod links;

use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::{Form, Mechanism, Motion, OdeSystem, Time};
use driftless::run::{MethodId, Request, Stabilization, simulate};
use driftless::scene::{Scene, Start};
use driftless::stabilization::Projected;
use driftless::stepping::{Dop853, Dp8, Integrator, Reached, Seen, Statistics, Taylor, Tolerance};
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
    let straight = links::chain(links, angle.unwrap_or(0.0));
    if angle.is_some() {
        return straight;
    }
    Scene {
        start: (0..links)
            .map(|k| Start { phi: (0.37 * k as f64).sin(), omega: (0.71 * k as f64).cos() })
            .collect(),
        ..straight
    }
}

/// Four-bars side by side, a little past upright.
fn ladder(n: usize) -> Scene {
    let mut scene = four_bars::scene(n);
    scene.start[..=n].fill(Start { phi: FRAC_PI_2 - 0.4, omega: -1.0 });
    scene
}

/// A form and its state, timed block by block.
struct Candidate {
    field: Box<dyn OdeSystem>,
    y: Vec<f64>,
    rate: Vec<f64>,
    count: usize,
    times: Vec<f64>,
}

impl Candidate {
    fn new(mechanism: Mechanism, scene: &Scene) -> Self {
        let mechanism = Arc::new(mechanism);
        let start = mechanism.start(scene);
        let mut made = if mechanism.has_work_integral() {
            let form = Multiplier::<0, true>::new(mechanism);
            Self {
                y: form.state(&start).y,
                field: Box::new(form),
                rate: Vec::new(),
                count: 1,
                times: Vec::new(),
            }
        } else {
            let form = Multiplier::<0, false>::new(mechanism);
            Self {
                y: form.state(&start).y,
                field: Box::new(form),
                rate: Vec::new(),
                count: 1,
                times: Vec::new(),
            }
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
            self.field.rhs(Time::default(), black_box(&self.y), &mut self.rate);
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
    let mut dense =
        mechanism.by_matrices().filter(|_| bodies <= MOST_DENSE).map(|dense| Candidate::new(dense, scene));
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
    println!(
        "{name:>10} {bodies:>6} {least:>9.3} {usual:>9.3} {per_body:>8.1} {dense:>20} {ratio:>8} {chosen:>9}"
    );
}

/// Seconds this thread has computed, where the system tells; elapsed ones elsewhere.
fn computed(begin: Instant) -> f64 {
    // Which brings the system's count up to date.
    std::thread::yield_now();
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|told| told.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or(begin.elapsed().as_secs_f64(), |nanoseconds| nanoseconds * 1e-9)
}

/// CPU seconds per simulated second of a run by the program's own loop, samples and all.
fn integrate(name: &str, scene: &Scene, request: &Request) {
    let (mut times, mut statistics) = (Vec::new(), None);
    for _ in 0..5 {
        let clock = Instant::now();
        let begin = computed(clock);
        let outcome = simulate(scene, request, &mut |_| Ok(()));
        times.push((computed(clock) - begin) / request.until.unwrap_or(scene.until));
        match outcome {
            Ok(outcome) => statistics = Some((outcome.statistics.evaluations, outcome.drift.energy.max)),
            Err(error) => return println!("{name:>24}: {error}"),
        }
    }
    times.sort_by(f64::total_cmp);
    let (evaluations, energy) = statistics.unwrap_or_default();
    println!("{name:>24} {:>9.4} {:>9.4} {evaluations:>9} {energy:>9.1e}", times[0], times[2]);
}

/// Angle \[rad\] of the uprights of N four-bars, by the pendulum they make together: (N + (N+1)/3) theta'' =
/// (N + (N+1)/2) g sin theta from the vertical.
fn upright(n: usize, until: f64) -> f64 {
    let n = n as f64;
    let ratio = (n + (n + 1.0) / 2.0) / (n + (n + 1.0) / 3.0) * 9.81;
    let (mut theta, mut rate, h) = (0.0_f64, 1.0_f64, 1e-4);
    for _ in 0..(until / h).round() as usize {
        // Fourth-order composition of the leapfrog.
        for part in [1.351_207_191_959_657_8, -1.702_414_383_919_315_3, 1.351_207_191_959_657_8] {
            theta += 0.5 * h * part * rate;
            rate += h * part * ratio * theta.sin();
            theta += 0.5 * h * part * rate;
        }
    }
    FRAC_PI_2 - theta
}

/// Runs of each tolerance in the table of ladders.
const RUNS: usize = 9;

/// N four-bars over 20 s, through all their singular positions: time and error of the power series, tolerance
/// by tolerance.
fn ladders(n: usize) {
    let scene = Scene { until: 20.0, every: 20.0, ..four_bars::scene(n) };
    let expected = upright(n, scene.until);
    let tolerances = [1e-5, 1e-6, 1e-7, 1e-8, 1e-9];
    let mut times = vec![Vec::new(); tolerances.len()];
    let mut found = vec![(0, 0.0); tolerances.len()];
    for _ in 0..RUNS {
        for ((&tolerance, times), found) in tolerances.iter().zip(&mut times).zip(&mut found) {
            let request =
                Request { method: Some(MethodId::Taylor), rtol: Some(tolerance), ..Request::default() };
            let clock = Instant::now();
            let begin = computed(clock);
            let outcome = simulate(&scene, &request, &mut |_| Ok(()));
            times.push((computed(clock) - begin) * 1e3);
            match outcome {
                Ok(outcome) => *found = (outcome.statistics.steps, (outcome.last.phi[0] - expected).abs()),
                Err(error) => println!("{tolerance:.0e}: {error}"),
            }
        }
    }
    println!(
        "\n{n:>3} four-bars, 20 s, taylor {:>9} {:>9} {:>9} {:>9}",
        "min ms", "median", "steps", "error"
    );
    for ((tolerance, times), (steps, error)) in tolerances.iter().zip(&mut times).zip(found) {
        times.sort_by(f64::total_cmp);
        println!("{tolerance:>26.0e} {:>9.2} {:>9.2} {steps:>9} {error:>9.1e}", times[0], times[RUNS / 2]);
    }
}

/// One tolerance of that table by the method alone, body by body and by matrices in turn.
fn forms(n: usize) {
    let scene = Scene { until: 20.0, ..four_bars::scene(n) };
    let bodywise = Mechanism::new(&scene).expect("equations");
    let dense = bodywise.by_matrices().expect("matrices");
    let forms = [("body by body", Arc::new(bodywise)), ("matrices", Arc::new(dense))];
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..RUNS {
        for ((_, mechanism), times) in forms.iter().zip(&mut times) {
            let mut method = Projected::new(Taylor::<f64>::with_order(1e-7, 16));
            times.push(alone(mechanism, &scene, &mut method).1);
        }
    }
    for ((name, _), times) in forms.iter().zip(&mut times) {
        times.sort_by(f64::total_cmp);
        println!("{name:>26} {:>9.2} {:>9.2}", times[0], times[RUNS / 2]);
    }
}

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let is_asked = |part: &str| asked.is_empty() || asked.iter().any(|word| word == part);
    if is_asked("evaluations") {
        evaluations();
    }
    if is_asked("hanging") {
        hanging();
    }
    if is_asked("ladders") {
        [2, 10, 40].into_iter().for_each(ladders);
        forms(40);
    }
}

fn evaluations() {
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
}

/// A form in angles and rates.
type Angles = Multiplier<0, true>;

/// The method alone, without the program's loop and monitors: angles \[rad\] at the end, milliseconds,
/// evaluations or expansions.
fn alone(
    mechanism: &Arc<Mechanism>,
    scene: &Scene,
    method: &mut dyn Integrator<Angles>,
) -> (Vec<f64>, f64, u64) {
    let mut form = Angles::new(Arc::clone(mechanism));
    let mut state = form.state(&mechanism.start(scene));
    let mut statistics = Statistics::default();
    let clock = Instant::now();
    let begin = computed(clock);
    let reached =
        method.advance(&mut form, &mut state, Time::from(scene.until), &mut statistics, &mut |_, _| {
            Ok(Seen::Kept)
        });
    let elapsed = (computed(clock) - begin) * 1e3;
    assert_eq!(reached, Ok(Reached::Until));
    let mut end = Motion::default();
    form.read(&state, &mut end);
    ((0..scene.bars.len()).map(|k| end.unwrapped(k)).collect(), elapsed, statistics.evaluations)
}

/// Chains let go at 0.2 rad: one simulated second by the methods alone, in turn, with the largest error of an
/// angle against the tightest of them.
fn methods(links: usize) {
    let scene = Scene { until: 1.0, ..chain(links, Some(0.2)) };
    let both = |relative| Tolerance { relative, absolute: relative };
    let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
    let exact = alone(&mechanism, &scene, &mut Taylor::<f64>::with_order(1e-14, 24)).0;
    type Candidate = (String, Box<dyn Fn() -> Box<dyn Integrator<Angles>>>);
    let mut candidates: Vec<Candidate> = Vec::new();
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
        candidates.push((
            format!("dop853 {tolerance:.0e}"),
            Box::new(move || Box::new(Dop853::new(both(tolerance)))),
        ));
        candidates
            .push((format!("dp8 {tolerance:.0e}"), Box::new(move || Box::new(Dp8::new(both(tolerance))))));
        for order in [16, 20, 24, 28] {
            let series =
                move || Box::new(Taylor::<f64>::with_order(tolerance, order)) as Box<dyn Integrator<_>>;
            candidates.push((format!("taylor {tolerance:.0e}, order {order}"), Box::new(series)));
        }
    }
    let mut times = vec![Vec::new(); candidates.len()];
    let mut found = vec![(0.0, 0); candidates.len()];
    for _ in 0..RUNS {
        for ((candidate, times), found) in candidates.iter().zip(&mut times).zip(&mut found) {
            let (end, elapsed, evaluations) = alone(&mechanism, &scene, &mut *candidate.1());
            times.push(elapsed);
            *found =
                (end.iter().zip(&exact).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())), evaluations);
        }
    }
    println!(
        "\n{links:>4} links, 1 s, methods alone {:>9} {:>9} {:>9} {:>9}",
        "min ms", "median", "evaluat.", "error"
    );
    for ((candidate, times), (error, evaluations)) in candidates.iter().zip(&mut times).zip(found) {
        times.sort_by(f64::total_cmp);
        println!(
            "{:>30} {:>9.2} {:>9.2} {evaluations:>9} {error:>9.1e}",
            candidate.0,
            times[0],
            times[RUNS / 2]
        );
    }
}

fn hanging() {
    [16, 128].into_iter().for_each(methods);
    println!(
        "\n{:>24} {:>9} {:>9} {:>9} {:>9}",
        "one simulated second", "CPU s", "median s", "evaluat.", "energy"
    );
    for (name, angle) in [("0.2 rad", 0.2), ("0.5 rad", 0.5), ("horizontal", FRAC_PI_2)] {
        for (method, tolerance) in
            [(MethodId::Dop853, 1e-6), (MethodId::Taylor, 1e-6), (MethodId::Taylor, 1e-8)]
        {
            let request = Request { method: Some(method), rtol: Some(tolerance), ..Request::default() };
            integrate(&format!("{name}, {method} {tolerance:.0e}"), &chain(128, Some(angle)), &request);
        }
    }
    let kept = Request {
        method: Some(MethodId::Dp8),
        rtol: Some(1e-6),
        stabilize: Some(Stabilization::Projection),
        until: Some(0.25),
        ..Request::default()
    };
    integrate("ladder of 40, dp8", &ladder(40), &kept);
}
