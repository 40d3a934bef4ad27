//! Andrews' squeezing mechanism over its 0.03 s: run time, error and evaluations of every method.
//!
//! `cargo bench --no-default-features --bench mechanisms`: alternating blocks in one process, minimum and
//! median over the blocks; the error is the largest of any angle against a quadruple-precision state
//! (`tests/looped.rs` says whose), the residual the largest violation of a row after any step, over 0.1 m,
//! the size of the mechanism.

#[path = "../tests/common/andrews.rs"]
mod andrews;

use driftless::dynamics::kernel::Kernel;
use driftless::dynamics::looped::Looped;
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::natural::Natural;
use driftless::dynamics::{Form, Mechanism, Motion, OdeSystem, State, Time};
use driftless::scene::read_scene;
use driftless::stabilization::{Projected, SymmetricGauss};
use driftless::stepping::composition::Composition;
use driftless::stepping::gauss::Gauss;
use driftless::stepping::rattle::Rattle;
use driftless::stepping::taylor::ExpansionKernel;
use driftless::stepping::{Dop853, Dp5, Dp8, Integrator, Seen, Statistics, Taylor, Tolerance};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Runs of each candidate.
const BLOCKS: usize = 30;
/// Evaluations a block.
const EVALUATIONS: usize = 2000;

/// What a run comes to.
struct Ran {
    seconds: f64,
    error: f64,
    residual: f64,
    statistics: Statistics,
}

fn integrate<P: Form + ?Sized>(
    problem: &mut P,
    start: &Motion,
    mut method: impl Integrator<P>,
    watched: bool,
) -> Ran {
    let mut state = problem.state(start);
    let mut statistics = Statistics::default();
    let mechanism = problem.mechanism().clone();
    let mut kernel = Kernel::<f64>::new(&mechanism);
    let (mut motion, mut residual) = (Motion::default(), 0.0f64);
    let begin = Instant::now();
    let ended = method.advance(
        problem,
        &mut state,
        Time::from(0.03),
        &mut statistics,
        &mut |problem: &mut P, state: &mut State| {
            if watched {
                problem.read(state, &mut motion);
                residual = residual.max(andrews::violation(&mechanism, &mut kernel, &motion));
            }
            Ok(Seen::Kept)
        },
    );
    let seconds = begin.elapsed().as_secs_f64();
    if let Err(stop) = ended {
        println!("stopped: {stop}");
    }
    let mut end = Motion::default();
    problem.read(&state, &mut end);
    Ran { seconds, error: andrews::error(&end), residual, statistics }
}

/// A name and what runs it.
type Candidate<'a> = (String, Box<dyn Fn(bool) -> Ran + 'a>);

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Nanoseconds of an evaluation, of each form in turn.
fn evaluations(mechanism: &Arc<Mechanism>, start: &Motion) {
    let mut looped = Looped::new(Arc::clone(mechanism)).expect("a mechanism with loops");
    let mut angles = Multiplier::<0, true>::new(Arc::clone(mechanism));
    let state = looped.state(start);
    let mut rate = vec![0.0; state.y.len()];
    let (mut first, mut second) = (Vec::new(), Vec::new());
    for _ in 0..200 {
        let begin = Instant::now();
        (0..EVALUATIONS).for_each(|_| looped.rhs(Time::default(), std::hint::black_box(&state.y), &mut rate));
        first.push(begin.elapsed().as_secs_f64() * 1e9 / EVALUATIONS as f64);
        let begin = Instant::now();
        (0..EVALUATIONS).for_each(|_| angles.rhs(Time::default(), std::hint::black_box(&state.y), &mut rate));
        second.push(begin.elapsed().as_secs_f64() * 1e9 / EVALUATIONS as f64);
    }
    for (name, mut times) in [("natural solve", first), ("angles and multipliers", second)] {
        let least = times.iter().copied().fold(f64::INFINITY, f64::min);
        println!("one evaluation, {name:24} {least:7.1} ns, median {:7.1}", median(&mut times));
    }
}

/// What all candidates integrate.
#[derive(Clone, Copy)]
struct Problem<'a> {
    mechanism: &'a Arc<Mechanism>,
    start: &'a Motion,
}

fn both(relative: f64) -> Tolerance {
    Tolerance { relative, absolute: relative }
}

impl<'a> Problem<'a> {
    /// In the form for loops.
    fn looped(self, method: impl Integrator<Looped>, watched: bool) -> Ran {
        let mut form = Looped::new(Arc::clone(self.mechanism)).expect("a mechanism with loops");
        integrate(&mut form, self.start, method, watched)
    }

    /// In angles, with multipliers.
    fn in_angles(self, method: impl Integrator<Multiplier<0, true>>, watched: bool) -> Ran {
        integrate(&mut Multiplier::<0, true>::new(Arc::clone(self.mechanism)), self.start, method, watched)
    }

    /// In natural coordinates.
    fn natural(self, method: impl Integrator<Natural>, watched: bool) -> Ran {
        let mut form = Natural::new(Arc::clone(self.mechanism)).expect("a natural form");
        integrate(&mut form, self.start, method, watched)
    }

    /// The Dormand–Prince pairs at a tolerance.
    fn pairs(self, tolerance: f64) -> Vec<Candidate<'a>> {
        let name = |method: &str| format!("{method} {tolerance:.0e}");
        let mut candidates: Vec<Candidate> = Vec::new();
        if tolerance > 1e-9 {
            candidates.push((
                name("dp5, projected"),
                Box::new(move |w| self.looped(Projected::new(Dp5::new(both(tolerance))), w)),
            ));
        }
        candidates.push((
            name("dp8, projected"),
            Box::new(move |w| self.looped(Projected::new(Dp8::new(both(tolerance))), w)),
        ));
        candidates.push((
            name("dp8 in angles, projected"),
            Box::new(move |w| self.in_angles(Projected::new(Dp8::new(both(tolerance))), w)),
        ));
        candidates.push((name("dp8"), Box::new(move |w| self.looped(Dp8::new(both(tolerance)), w))));
        candidates.push((name("dop853"), Box::new(move |w| self.looped(Dop853::new(both(tolerance)), w))));
        candidates
    }

    /// The series at a tolerance.
    fn series(self, tolerance: f64) -> [Candidate<'a>; 3] {
        let name = |method: &str| format!("{method} {tolerance:.0e}");
        let taylor = move || Taylor::<f64>::new(both(tolerance));
        let series = move || {
            let mut series = taylor();
            series.kernel = ExpansionKernel::Series;
            series
        };
        [
            (name("taylor"), Box::new(move |w| self.looped(taylor(), w))),
            (name("taylor, projected"), Box::new(move |w| self.looped(Projected::new(taylor()), w))),
            (
                name("taylor in angles, projected"),
                Box::new(move |w| self.in_angles(Projected::new(series()), w)),
            ),
        ]
    }

    /// `gauss16` of so many steps.
    fn gauss(self, steps: f64) -> Candidate<'a> {
        let gauss = move || SymmetricGauss::new(Gauss::new(8, 0.03 / steps).expect("sound settings"));
        (format!("gauss16, projected 0.03/{steps}"), Box::new(move |w| self.looped(gauss(), w)))
    }

    /// RATTLE of so many steps.
    fn rattle(self, name: &str, composition: Composition, steps: f64) -> Candidate<'a> {
        let rattle = move || Rattle::new(composition, 0.03 / steps);
        (format!("{name} 0.03/{steps}"), Box::new(move |w| self.natural(rattle(), w)))
    }
}

fn main() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/andrews.json");
    let scene = read_scene(&path, &[]).expect("a shipped scene");
    let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
    let start = mechanism.start(&scene);
    evaluations(&mechanism, &start);
    let problem = Problem { mechanism: &mechanism, start: &start };
    let mut candidates: Vec<Candidate> = Vec::new();
    for tolerance in [1e-6, 1e-8, 1e-9, 1e-11, 1e-13] {
        candidates.extend(problem.pairs(tolerance));
    }
    for tolerance in [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-12] {
        candidates.extend(problem.series(tolerance));
    }
    candidates.extend([50.0, 100.0, 200.0].map(|steps| problem.gauss(steps)));
    let compositions = [
        ("rattle2", Composition::Single),
        ("rattle4", Composition::Suzuki5),
        ("rattle6", Composition::KahanLi9),
        ("rattle8", Composition::KahanLi17),
    ];
    for (name, composition) in compositions {
        candidates.extend([200.0, 400.0, 800.0].map(|steps| problem.rattle(name, composition, steps)));
    }
    let mut times = vec![Vec::new(); candidates.len()];
    for _ in 0..BLOCKS {
        for ((_, run), times) in candidates.iter().zip(&mut times) {
            times.push(run(false).seconds * 1e3);
        }
    }
    println!(
        "{:34} {:>8} {:>8} {:>9} {:>9} {:>6} {:>6}",
        "", "min ms", "median", "error", "residual", "steps", "evals"
    );
    for ((name, run), times) in candidates.iter().zip(&mut times) {
        let Ran { error, residual, statistics, .. } = run(true);
        let least = times.iter().copied().fold(f64::INFINITY, f64::min);
        println!(
            "{name:34} {least:8.3} {:8.3} {error:9.1e} {residual:9.1e} {:6} {:6}",
            median(times),
            statistics.steps,
            statistics.evaluations
        );
    }
}
