//! What the equations cost: one evaluation beside a right-hand side written by hand for exactly the two bars
//! at hand, and what an evaluation costs inside a run by `dp8`, its steps included, with the motor's row kept
//! in every way beside the free scene.
//!
//! `cargo bench --bench equations`: alternating blocks in one process; the figures are nanoseconds (minimum
//! and median over the blocks) and the ratio of the minima and of the medians to the first line.

use driftless::dynamics::canonical::Canonical;
use driftless::dynamics::elimination::Elimination;
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::{Form, Mechanism, Motion, OdeSystem, Time};
use driftless::scene::read_scene;
use driftless::stabilization::{Baumgarte, Projected};
use driftless::stepping::{Dp8, Integrator, Reached, Seen, Statistics, Tolerance};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Evaluations a block.
const BLOCK: usize = 2_000;
/// Blocks of each candidate.
const BLOCKS: usize = 600;

/// The source problem's two bars, nothing else: the smallest code we could write, with the same sine and
/// cosine.
struct ByHand {
    inner: f64,
    coupling: f64,
    outer: f64,
    weight: [f64; 2],
}

impl OdeSystem for ByHand {
    fn dimension(&self) -> usize {
        4
    }

    fn angles(&self) -> usize {
        2
    }

    fn rhs(&mut self, _t: Time, y: &[f64], rate: &mut [f64]) {
        let &[phi1, phi2, w1, w2] = y else { return };
        let ((s1, c1), (s2, c2)) = (libm::sincos(phi1), libm::sincos(phi2));
        let (cos, sin) = (c1 * c2 + s1 * s2, s1 * c2 - c1 * s2);
        let m12 = self.coupling * cos;
        let b1 = -self.coupling * sin * w2 * w2 - self.weight[0] * s1;
        let b2 = self.coupling * sin * w1 * w1 - self.weight[1] * s2;
        let det = self.inner * self.outer - m12 * m12;
        rate.copy_from_slice(&[
            w1,
            w2,
            (self.outer * b1 - m12 * b2) / det,
            (self.inner * b2 - m12 * b1) / det,
        ]);
    }

    fn label(&self, i: usize) -> String {
        i.to_string()
    }
}

/// Nanoseconds an evaluation over one block; the state moves a little each time, so that nothing can be
/// hoisted out.
fn block(field: &mut dyn OdeSystem, y: &mut [f64], rate: &mut [f64]) -> f64 {
    let begin = Instant::now();
    for _ in 0..BLOCK {
        field.rhs(Time::default(), black_box(y), rate);
        y[0] += 1e-9 * rate[2];
    }
    begin.elapsed().as_secs_f64() * 1e9 / BLOCK as f64
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() {
    let scene = |name: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/scenes/{name}.json"));
        let scene = read_scene(&path, &[]).expect("a shipped scene");
        let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
        let start = mechanism.start(&scene);
        (mechanism, start)
    };
    let (free, start) = scene("free");
    let (motor, motor_start) = scene("motor");
    let tree = &free.tree;
    let hand = ByHand {
        inner: tree.diagonal[0],
        coupling: tree.coupling[1].re,
        outer: tree.diagonal[1],
        weight: [tree.weight[0].re, tree.weight[1].re],
    };
    let multiplier = Multiplier::<2, false>::new(Arc::clone(&free));
    let any_size = Multiplier::<0, false>::new(Arc::clone(&free));
    let canonical = Canonical::<2, false>::new(Arc::clone(&free));
    let rows = Multiplier::<2, true>::new(Arc::clone(&motor));
    let eliminated = Elimination::<2>::new(Arc::clone(&motor));
    let y = multiplier.state(&start).y;
    let momenta = canonical.state(&start).y;
    let (with_rows, without) = (rows.state(&motor_start).y, eliminated.state(&motor_start).y);
    let mut candidates: Vec<(&str, Box<dyn OdeSystem>, Vec<f64>)> = vec![
        ("written by hand (free)", Box::new(hand), y.clone()),
        ("driftless, free", Box::new(multiplier), y.clone()),
        ("driftless, free, size at run time", Box::new(any_size), y),
        ("driftless, free, canonical form", Box::new(canonical), momenta),
        ("driftless, motor, multiplier", Box::new(rows), with_rows),
        ("driftless, motor, eliminated", Box::new(eliminated), without),
    ];
    let mut times = vec![Vec::new(); candidates.len()];
    for _ in 0..BLOCKS {
        for ((_, field, y), times) in candidates.iter_mut().zip(&mut times) {
            let mut rate = vec![0.0; y.len()];
            times.push(block(&mut **field, &mut y.clone(), &mut rate));
        }
    }
    println!("{:36} {:>8} {:>8} {:>8} {:>8}", "one evaluation", "min ns", "ratio", "median", "ratio");
    let names = candidates.iter().map(|(name, ..)| *name);
    table(names.zip(&mut times));
    println!();
    steps((&free, &start), (&motor, &motor_start));
}

/// Minimum, median and their ratios to the first line.
fn table<'a>(lines: impl Iterator<Item = (&'a str, &'a mut Vec<f64>)>) {
    let mut first = None;
    for (name, times) in lines {
        let middle = median(times);
        let (least, usual) = *first.get_or_insert((times[0], middle));
        println!("{name:36} {:8.1} {:8.2} {middle:8.1} {:8.2}", times[0], times[0] / least, middle / usual);
    }
}

/// A scene on its way, integrated block by block.
struct Traveller {
    name: &'static str,
    advance: Box<dyn FnMut(f64) -> u64>,
    per_evaluation: Vec<f64>,
    per_second: Vec<f64>,
}

impl Traveller {
    fn new<P: Form + 'static, M: Integrator<P> + 'static>(
        name: &'static str,
        mut problem: P,
        mut method: M,
        start: &Motion,
    ) -> Self {
        let mut state = problem.state(start);
        let advance = move |span: f64| {
            let (mut statistics, until) = (Statistics::default(), state.time + span);
            let reached =
                method.advance(&mut problem, &mut state, until, &mut statistics, &mut |_, _| Ok(Seen::Kept));
            assert_eq!(reached, Ok(Reached::Until));
            statistics.evaluations
        };
        Self { name, advance: Box::new(advance), per_evaluation: Vec::new(), per_second: Vec::new() }
    }
}

/// One evaluation with its share of the steps of `dp8`, and one simulated second, at equal tolerance.
fn steps((free, start): (&Arc<Mechanism>, &Motion), (motor, motor_start): (&Arc<Mechanism>, &Motion)) {
    const SPAN: f64 = 1.0;
    let dp8 = || Dp8::new(Tolerance { relative: 1e-9, absolute: 1e-9 });
    let rows = || Multiplier::<2, true>::new(Arc::clone(motor));
    let mut travellers = [
        Traveller::new("free", Multiplier::<2, false>::new(Arc::clone(free)), dp8(), start),
        Traveller::new("motor, eliminated", Elimination::<2>::new(Arc::clone(motor)), dp8(), motor_start),
        Traveller::new("motor, multiplier", rows(), dp8(), motor_start),
        Traveller::new("motor, multiplier and Baumgarte", Baumgarte::new(rows(), 0.1), dp8(), motor_start),
        Traveller::new("motor, multiplier and projection", rows(), Projected::new(dp8()), motor_start),
    ];
    for _ in 0..BLOCKS {
        for traveller in &mut travellers {
            let begin = Instant::now();
            let evaluations = (traveller.advance)(SPAN);
            let spent = begin.elapsed().as_secs_f64() * 1e9;
            traveller.per_evaluation.push(spent / evaluations as f64);
            traveller.per_second.push(spent * 1e-3 / SPAN);
        }
    }
    println!(
        "{:36} {:>8} {:>8} {:>8} {:>8}",
        "one evaluation, dp8 at 1e-9", "min ns", "ratio", "median", "ratio"
    );
    table(travellers.iter_mut().map(|traveller| (traveller.name, &mut traveller.per_evaluation)));
    println!("\n{:36} {:>8} {:>8} {:>8} {:>8}", "one simulated second", "min us", "ratio", "median", "ratio");
    table(travellers.iter_mut().map(|traveller| (traveller.name, &mut traveller.per_second)));
}
