//! Time at equal true error: the Taylor method beside the Dormand–Prince methods of `ode_solvers`, in one process.
//!
//! `cargo bench --bench taylor`: every candidate walks down a ladder of tolerances until its error at the end (10 s; 3 s for the chain of six, which parts neighbours a millionfold in that time), measured against a double-double
//! run from the same constants and the same start, is below each target; the settings found are then timed in alternating blocks.  Errors
//! are the largest difference in an angle \[rad\] or a rate \[rad/s\]; times are microseconds per simulated second, minimum and median.
//!
//! First of all, what the first orders in double-double cost on `free` at the settings for long runs (`cargo bench --bench taylor extended` for this alone).

use driftless::dynamics::elimination::Elimination;
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::{Form, Mechanism, Motion, Time};
use driftless::scene::{Scene, read_scene};
use driftless::stepping::{Dop853, Method, Seen, Taylor, Tolerance};
use nalgebra::SVector;
use ode_solvers::dop_shared::{OutputType, System};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Blocks of each candidate.
const BLOCKS: usize = 25;
/// Seconds of run time a block takes at least.
const BLOCK: f64 = 2e-3;

type Runner = Box<dyn FnMut(f64) -> (Motion, u64)>;

/// A candidate: its name, and a run from the start to the end at a tolerance, which gives the end and the number of steps.
struct Candidate {
    name: String,
    run: Runner,
}

fn shipped(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/scenes/{name}.json"));
    read_scene(&path, &[]).expect("a shipped scene")
}

/// A chain of `n` bars like those of `free`, from π/2 - 0.1 i.
fn chain(n: usize) -> Scene {
    let mut scene = shipped("free");
    for i in 0..n {
        if i >= 2 {
            let mut bar = scene.bars[1].clone();
            bar.name = format!("bar{}", i + 1);
            scene.bars.push(bar);
            let mut hinge = scene.hinges[1].clone();
            hinge.name = format!("hinge{}", i + 1);
            hinge.between[0].bar = Some(i - 1);
            hinge.between[1].bar = Some(i);
            scene.hinges.push(hinge);
            scene.start.push(scene.start[1]);
        }
        scene.start[i].phi = std::f64::consts::FRAC_PI_2 - 0.1 * i as f64;
    }
    scene
}

fn taylor(mechanism: &Arc<Mechanism>, scene: &Scene, until: f64, order: Option<usize>) -> Runner {
    let (mechanism, start) = (Arc::clone(mechanism), mechanism.start(scene));
    let mut problem = Elimination::<0>::new(mechanism);
    let mut method = Taylor::new(Tolerance::default());
    let mut motion = Motion::default();
    Box::new(move |tolerance| {
        let wanted = order.unwrap_or_else(|| Taylor::new(Tolerance { relative: tolerance, absolute: tolerance }).order);
        if wanted != method.order {
            method = Taylor::with_order(tolerance, wanted);
        }
        method.tolerance = tolerance;
        let mut state = problem.state(&start);
        let mut tally = Default::default();
        method.advance(&mut problem, &mut state, Time::from(until), &mut tally, &mut |_, _| Ok(Seen::Kept)).expect("an end");
        problem.read(&state, &mut motion);
        (motion.clone(), tally.steps)
    })
}

/// `dop853` as the program runs it, one window to the end.
fn windowed(mechanism: &Arc<Mechanism>, scene: &Scene, until: f64) -> Runner {
    let start = mechanism.start(scene);
    let free = mechanism.rows.is_empty();
    let mut multiplier = Multiplier::<2, false>::new(Arc::clone(mechanism));
    let mut elimination = Elimination::<2>::new(Arc::clone(mechanism));
    Box::new(move |tolerance| {
        let mut method = Dop853::new(Tolerance { relative: tolerance, absolute: tolerance });
        let mut motion = Motion::default();
        let mut tally = Default::default();
        if free {
            let mut state = multiplier.state(&start);
            method.advance(&mut multiplier, &mut state, Time::from(until), &mut tally, &mut |_, _| Ok(Seen::Kept)).expect("an end");
            multiplier.read(&state, &mut motion);
        } else {
            let mut state = elimination.state(&start);
            method.advance(&mut elimination, &mut state, Time::from(until), &mut tally, &mut |_, _| Ok(Seen::Kept)).expect("an end");
            elimination.read(&state, &mut motion);
        }
        (motion, tally.steps)
    })
}

/// The two bars' equations by hand, for the bare crate.
#[derive(Clone, Copy)]
struct ByHand {
    inner: f64,
    coupling: f64,
    outer: f64,
    weight: [f64; 2],
}

impl System<f64, SVector<f64, 4>> for ByHand {
    fn system(&self, _: f64, y: &SVector<f64, 4>, rate: &mut SVector<f64, 4>) {
        let (phi1, phi2, w1, w2) = (y[0], y[1], y[2], y[3]);
        let ((s1, c1), (s2, c2)) = (phi1.sin_cos(), phi2.sin_cos());
        let (cos, sin) = (c1 * c2 + s1 * s2, s1 * c2 - c1 * s2);
        let m12 = self.coupling * cos;
        let b1 = -self.coupling * sin * w2 * w2 - self.weight[0] * s1;
        let b2 = self.coupling * sin * w1 * w1 - self.weight[1] * s2;
        let det = self.inner * self.outer - m12 * m12;
        *rate = SVector::from([w1, w2, (self.outer * b1 - m12 * b2) / det, (self.inner * b2 - m12 * b1) / det]);
    }
}

/// The crate's Dop853 itself on equations written by hand.
fn bare(mechanism: &Arc<Mechanism>, scene: &Scene, until: f64) -> Runner {
    let tree = &mechanism.tree;
    let hand = ByHand {
        inner: tree.diagonal[0],
        coupling: tree.coupling[1].re,
        outer: tree.diagonal[1],
        weight: [tree.weight[0].re, tree.weight[1].re],
    };
    let start = mechanism.start(scene);
    Box::new(move |tolerance| {
        let y = SVector::from([start.phi[0].hi, start.phi[1].hi, start.omega[0].hi, start.omega[1].hi]);
        let mut stepper = ode_solvers::Dop853::from_param(
            hand,
            0.0,
            until,
            until,
            y,
            tolerance,
            tolerance,
            0.9,
            0.0,
            1.0 / 3.0,
            6.0,
            until,
            0.0,
            10_000_000,
            u32::MAX,
            OutputType::Sparse,
        );
        let stats = stepper.integrate().expect("an end");
        let last = stepper.y_out().last().copied().unwrap_or(y);
        let mut motion = Motion::default();
        motion.resize(2);
        for k in 0..2 {
            let (angle, turns) = Time::from(last[k]).reduced();
            (motion.phi[k], motion.turns[k], motion.omega[k]) = (angle, turns as i64, Time::from(last[2 + k]));
        }
        (motion, u64::from(stats.accepted_steps))
    })
}

fn reference(mechanism: &Arc<Mechanism>, scene: &Scene, until: f64) -> Motion {
    let mut problem = Elimination::<0>::new(Arc::clone(mechanism));
    let mut state = problem.state(&mechanism.start(scene));
    let mut tally = Default::default();
    let mut method = Taylor::reference();
    method.advance(&mut problem, &mut state, Time::from(until), &mut tally, &mut |_, _| Ok(Seen::Kept)).expect("an end");
    let mut motion = Motion::default();
    problem.read(&state, &mut motion);
    motion
}

fn error(a: &Motion, b: &Motion) -> f64 {
    (0..a.phi.len()).fold(0.0, |worst: f64, k| {
        let angle = (a.phi[k] - b.phi[k]).reduced().0.hi.abs();
        worst.max(angle).max((a.omega[k] - b.omega[k]).hi.abs())
    })
}

/// The loosest rung of the ladder whose error is at most the target, with the error and the number of steps.
fn setting(candidate: &mut Candidate, exact: &Motion, target: f64) -> Option<(f64, f64, u64)> {
    (10..=80).map(|rung| 10f64.powf(-f64::from(rung) / 4.0)).find_map(|tolerance| {
        let (end, steps) = (candidate.run)(tolerance);
        let found = error(&end, exact);
        (found <= target).then_some((tolerance, found, steps))
    })
}

/// Plain and extended runs of 10 s in alternating blocks.
fn cost_of_extended() {
    let scene = shipped("free");
    let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
    let mut problem = Elimination::<0>::new(Arc::clone(&mechanism));
    let start = problem.state(&mechanism.start(&scene));
    let mut methods = [(1e-19, false), (1e-20, true)].map(|(tolerance, extended)| {
        let mut method = Taylor::<f64>::with_order(tolerance, 24);
        method.extended = extended;
        method
    });
    let mut times = [const { Vec::new() }; 2];
    for _ in 0..4 * BLOCKS {
        for (method, times) in methods.iter_mut().zip(&mut times) {
            let mut state = start.clone();
            let begin = Instant::now();
            method
                .advance(&mut problem, &mut state, Time::from(10.0), &mut Default::default(), &mut |_, _| Ok(Seen::Kept))
                .expect("an end");
            times.push(begin.elapsed().as_secs_f64() * 1e5);
        }
    }
    for (name, times) in ["plain, 1e-19", "extended, 1e-20"].into_iter().zip(&mut times) {
        times.sort_by(f64::total_cmp);
        println!("free, {name:16} {:9.2} {:9.2} us/s, minimum and median", times[0], times[times.len() / 2]);
    }
}

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let cases: [(&str, Scene, f64, &[f64]); 5] = [
        ("free", shipped("free"), 10.0, &[1e-6, 1e-9]),
        ("gentle", shipped("gentle"), 10.0, &[1e-12]),
        ("motor", shipped("motor"), 10.0, &[1e-9]),
        ("chain of 3", chain(3), 10.0, &[1e-7]),
        ("chain of 6", chain(6), 3.0, &[1e-8]),
    ];
    if wanted.is_empty() || wanted.iter().any(|word| word == "extended") {
        cost_of_extended();
    }
    println!(
        "{:12} {:>6}  {:22} {:>8} {:>8} {:>6} {:>9} {:>9}",
        "scene", "target", "method", "setting", "error", "steps", "min us/s", "median"
    );
    for (name, scene, until, targets) in cases {
        if !wanted.is_empty() && !wanted.iter().any(|word| name.contains(word.as_str())) {
            continue;
        }
        let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
        let exact = reference(&mechanism, &scene, until);
        let mut candidates = vec![Candidate { name: "taylor".into(), run: taylor(&mechanism, &scene, until, None) }];
        for order in [16, 20, 24] {
            candidates.push(Candidate { name: format!("taylor, order {order}"), run: taylor(&mechanism, &scene, until, Some(order)) });
        }
        if mechanism.bodies.len() == 2 {
            candidates.push(Candidate { name: "dop853".into(), run: windowed(&mechanism, &scene, until) });
            if mechanism.rows.is_empty() {
                candidates.push(Candidate { name: "ode_solvers, by hand".into(), run: bare(&mechanism, &scene, until) });
            }
        }
        for &target in targets {
            let settings: Vec<_> = candidates.iter_mut().map(|candidate| setting(candidate, &exact, target)).collect();
            let mut times = vec![Vec::new(); candidates.len()];
            for _ in 0..BLOCKS {
                for ((candidate, setting), times) in candidates.iter_mut().zip(&settings).zip(&mut times) {
                    let Some((tolerance, ..)) = *setting else { continue };
                    let (begin, mut runs, mut shortest) = (Instant::now(), 0, f64::INFINITY);
                    while runs == 0 || begin.elapsed().as_secs_f64() < BLOCK {
                        let start = Instant::now();
                        std::hint::black_box((candidate.run)(tolerance));
                        shortest = shortest.min(start.elapsed().as_secs_f64());
                        runs += 1;
                    }
                    times.push(shortest * 1e6 / until);
                }
            }
            for ((candidate, setting), times) in candidates.iter().zip(&settings).zip(&mut times) {
                times.sort_by(f64::total_cmp);
                let Some((tolerance, error, steps)) = setting else {
                    println!("{name:12} {target:6.0e}  {:22} does not reach it", candidate.name);
                    continue;
                };
                let (least, middle) = (times[0], times[times.len() / 2]);
                println!("{name:12} {target:6.0e}  {:22} {tolerance:8.1e} {error:8.1e} {steps:6} {least:9.2} {middle:9.2}", candidate.name);
            }
        }
    }
}
