//! Cost of a step of Gauss with eight stages: the stages as lanes, beside the same stages evaluated one by
//! one.
//!
//! `cargo bench --no-default-features --bench gauss`: alternating blocks in one process; microseconds a step
//! (minimum and median over the blocks) and the ratio to the default block by block.

use driftless::dynamics::canonical::Canonical;
use driftless::dynamics::{Form, Mechanism, OdeSystem, State, Time};
use driftless::scene::{Scene, read_scene};
use driftless::stepping::gauss::Gauss;
use driftless::stepping::{Integrator, Seen, Statistics};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Steps a block.
const BLOCK: u32 = 100;
/// Blocks of each candidate.
const BLOCKS: usize = 300;

/// A field evaluated one point at a time, in plain doubles.
struct OneByOne<F>(F);

impl<F: OdeSystem> OdeSystem for OneByOne<F> {
    fn dimension(&self) -> usize {
        self.0.dimension()
    }

    fn angles(&self) -> usize {
        self.0.angles()
    }

    fn rhs(&mut self, t: Time, y: &[f64], rate: &mut [f64]) {
        self.0.rhs(t, y, rate);
    }

    fn label(&self, i: usize) -> String {
        self.0.label(i)
    }
}

/// A method on a field, and how far it has come.
struct Candidate {
    name: &'static str,
    field: Box<dyn OdeSystem>,
    method: Gauss,
    state: State,
    statistics: Statistics,
    times: Vec<f64>,
}

impl Candidate {
    fn block(&mut self) {
        let until = self.state.time + f64::from(BLOCK) * self.method.step();
        let begin = Instant::now();
        self.method
            .advance(&mut *self.field, &mut self.state, until, &mut self.statistics, &mut |_, _| {
                Ok(Seen::Kept)
            })
            .expect("an integration");
        self.times.push(begin.elapsed().as_secs_f64() * 1e6 / f64::from(BLOCK));
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn compare<const N: usize, const WORK: bool>(scene: &Scene, step: f64) {
    let mechanism = Arc::new(Mechanism::new(scene).expect("equations"));
    let form = || Canonical::<N, WORK>::new(Arc::clone(&mechanism));
    let start = form().state(&mechanism.start(scene));
    let gauss = || Gauss::new(8, step).expect("sound settings");
    let candidate = |name, field: Box<dyn OdeSystem>, method| {
        let (state, statistics) = (start.clone(), Statistics::default());
        Candidate { name, field, method, state, statistics, times: Vec::new() }
    };
    let mut candidates = [
        candidate("lanes", Box::new(form()), gauss()),
        candidate("lanes, plain", Box::new(form()), gauss().plain()),
        candidate("one by one, plain", Box::new(OneByOne(form())), gauss().plain()),
    ];
    for _ in 0..BLOCKS {
        for candidate in &mut candidates {
            candidate.block();
        }
    }
    let first = candidates[0].times.clone();
    for candidate in &mut candidates {
        let mut ratios: Vec<f64> =
            candidate.times.iter().zip(&first).map(|(time, first)| time / first).collect();
        let (least, middle) =
            (candidate.times.iter().copied().fold(f64::INFINITY, f64::min), median(&mut candidate.times));
        let evaluations = candidate.statistics.evaluations as f64 / candidate.statistics.steps as f64 / 8.0;
        println!(
            "{:10} {:18} {least:7.2} {middle:7.2} us a step, ratio {:5.2}, {evaluations:4.1} evaluations of all stages",
            scene.name,
            candidate.name,
            median(&mut ratios)
        );
    }
}

fn main() {
    let scene = |name: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/scenes/{name}.json"));
        read_scene(&path, &[]).expect("a shipped scene")
    };
    compare::<2, false>(&scene("free"), 1.0 / 128.0);
    compare::<2, false>(&scene("gentle"), 1.0 / 64.0);
    compare::<2, false>(&scene("gentle"), 1.0 / 16.0);
    compare::<2, true>(&scene("motor"), 1.0 / 128.0);
    compare::<2, true>(&scene("motor_sine"), 1.0 / 128.0);
    compare::<0, false>(&scene("chain8"), 1.0 / 256.0);
    let spring = scene("spring");
    let has_work_integral = Mechanism::new(&spring).expect("equations").has_work_integral();
    if has_work_integral {
        compare::<2, true>(&spring, 1.0 / 128.0)
    } else {
        compare::<2, false>(&spring, 1.0 / 128.0)
    }
}
