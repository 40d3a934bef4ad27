//! Work takes part in step-size control, the limits on the energy follow the tolerance, and nothing of the
//! motion before an impact is remembered after it.
//!
//! References are closed forms: of one driven bar, of a driven Scotch yoke, and of a bar on a torsion spring
//! with a damper between elastic impacts.

use crate::common;
use crate::random;
use crate::trees;

use common::{compile, run, shipped};
use driftless::arithmetic::DoubleDouble;
use driftless::dynamics::canonical::Canonical;
use driftless::dynamics::elimination::Elimination;
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::natural::Natural;
use driftless::dynamics::{Form, Mechanism, Motion};
use driftless::run::{Drift, Limits, METHODS, MethodId, Outcome, Plan, Problem, Request, Sample};
use driftless::scene::{Scene, parse_scene};
use driftless::stabilization::{Projected, SymmetricGauss};
use driftless::stepping::composition::Composition;
use driftless::stepping::gauss::Gauss;
use driftless::stepping::rattle::Rattle;
use driftless::stepping::{
    Cause, Dop853, Dopri5, Dp5, Dp8, Integrator, Radau, Seen, Statistics, Taylor, Tolerance,
};
use std::sync::Arc;
use trees::{Dice, tree};

const TOLERANCES: [f64; 3] = [1e-6, 1e-9, 1e-12];

fn scene(text: &str) -> Scene {
    parse_scene(&text.replacen('{', r#"{"name": "work", "#, 1), "work.json", &[]).expect("a scene")
}

fn adaptive() -> impl Iterator<Item = MethodId> {
    METHODS.iter().map(|method| method.id).filter(|method| method.is_adaptive())
}

fn at(method: MethodId, rtol: f64) -> Request {
    Request { method: Some(method), rtol: Some(rtol), ..Request::default() }
}

fn finished(scene: &Scene, request: &Request) -> Outcome {
    let outcome = run(scene, request);
    assert!(outcome.stop.is_none(), "{request:?}: {:?}", outcome.stop);
    outcome
}

/// One bar driven by a sine, and nothing left to integrate but the work: a bar of 1 kg, its centre 0.5 m off
/// the hinge, 0.083 kg·m² about it.
fn sine_bar() -> Scene {
    scene(
        r#"{"gravity": [0, -9.81], "until": 2, "every": 0.5, "start": {},
            "bars": [{"name": "bar", "mass": 1, "centre": [0.5, 0], "inertia": 0.083, "length": 1}],
            "hinges": [{"name": "O", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
            "motors": [{"name": "motor", "body": "bar", "law": {"start": 0.2, "sines": [{"amplitude": 0.3, "frequency": 2, "phase": 0.4}]}}]}"#,
    )
}

/// Its work from the start to `t` \[s\], T + V now less T + V then, and its torque I phi'' + m g c cos phi.
fn sine_bar_exact(t: f64) -> (f64, f64) {
    let (inertia, weight) = (0.083 + 0.25, 9.81 * 0.5);
    let phi = |t: f64| 0.2 + 0.3 * (2.0 * t + 0.4).sin();
    let energy = |t: f64| 0.5 * inertia * (0.6 * (2.0 * t + 0.4).cos()).powi(2) + weight * phi(t).sin();
    (energy(t) - energy(0.0), -1.2 * inertia * (2.0 * t + 0.4).sin() + weight * phi(t).cos())
}

#[test]
fn the_work_on_one_driven_bar_is_the_change_of_its_energy() {
    let scene = sine_bar();
    let (work, torque) = sine_bar_exact(2.0);
    for method in adaptive() {
        for rtol in TOLERANCES {
            let outcome = finished(&scene, &at(method, rtol));
            let off = (outcome.last.work - work).abs();
            assert!(off < 20.0 * rtol, "{method} at {rtol:e}: work off by {off:.1e} J");
            assert!(
                (outcome.last.motors[0][0] - torque).abs() < 1e-12 * torque.abs().max(1.0) * 10.0,
                "{method}"
            );
        }
    }
}

/// A motor turns a crank at 10 rad/s, whose pin carries a yoke of 2 kg to and fro: x = r cos 10 t, and the
/// work is the yoke's kinetic energy.
#[test]
fn the_work_on_a_scotch_yoke_is_its_kinetic_energy() {
    let scene = scene(
        r#"{"gravity": [0, 0], "until": 3, "every": 0.25, "start": {"yoke": {"phi": 0}},
            "bars": [{"name": "crank", "length": 0.1, "width": 0.02, "thickness": 0.01, "density": 7800},
                     {"name": "yoke", "mass": 2, "centre": [0, 0], "inertia": 0.01, "length": 0.3}],
            "hinges": [{"name": "O", "between": [{"body": "ground", "point": [0, 0]}, {"body": "crank", "point": [0, 0]}]}],
            "sliders": [{"name": "slot", "point": {"body": "crank", "point": [0.1, 0]},
                         "rail": {"body": "yoke", "point": [0, 0], "direction": [0, 1]}},
                        {"name": "guide", "point": {"body": "yoke", "point": [0, 0]},
                         "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "angle": "locked"}],
            "motors": [{"name": "motor", "body": "crank", "law": {"start": 0, "rate": 10}}]}"#,
    );
    let exact = 0.5 * 2.0 * (30.0_f64.sin()).powi(2);
    for method in adaptive() {
        for rtol in TOLERANCES {
            let outcome = run(&scene, &at(method, rtol));
            if let Some(stop) = &outcome.stop {
                // What nothing projects drifts off its rail, and says so.
                let is_loose = matches!(method, MethodId::Dopri5 | MethodId::Dop853) && rtol > 1e-9;
                assert!(is_loose && stop.cause == Cause::BranchLost, "{method} at {rtol:e}: {stop}");
                continue;
            }
            // Seventy half turns of the yoke, each with errors of its own.
            let (off, most) = ((outcome.last.work - exact).abs(), 200.0 * rtol + 1e-9);
            assert!(off < most, "{method} at {rtol:e}: work off by {off:.1e} J");
        }
    }
}

/// The torsion spring of [`bouncing`]: I phi'' = -k (phi - a) - c phi', a wall at sin phi = -0.4 with elastic
/// impacts.
struct Bounce {
    inertia: f64,
    stiffness: f64,
    free: f64,
    damping: f64,
}

impl Bounce {
    /// Angle and rate `t` \[s\] after another angle and rate.
    fn motion(&self, [phi, omega]: [f64; 2], t: f64) -> [f64; 2] {
        let decay = 0.5 * self.damping / self.inertia;
        let w = (self.stiffness / self.inertia - decay * decay).sqrt();
        let (x, (sin, cos), fade) = (phi - self.free, (w * t).sin_cos(), (-decay * t).exp());
        let b = (omega + decay * x) / w;
        [self.free + fade * (x * cos + b * sin), fade * (omega * cos - (w * x + decay * b) * sin)]
    }

    fn energy(&self, [phi, omega]: [f64; 2]) -> f64 {
        0.5 * self.inertia * omega * omega + 0.5 * self.stiffness * (phi - self.free).powi(2)
    }

    /// Angle and rate at time `t` \[s\], and the impacts until then.
    fn at(&self, start: [f64; 2], t: f64) -> ([f64; 2], u64) {
        let wall = -(0.4_f64.asin());
        let (mut state, mut left, mut impacts) = (start, t, 0);
        loop {
            // The first passage of the wall, on a grid far finer than the oscillation, then by bisection.
            let step = 1e-4;
            let first = (1..)
                .map(|i| f64::from(i) * step)
                .take_while(|s| s - step < left)
                .find(|&s| self.motion(state, s)[0] < wall);
            let Some(after) = first else { return (self.motion(state, left), impacts) };
            let (mut low, mut high) = (after - step, after);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if self.motion(state, middle)[0] < wall { high = middle } else { low = middle }
            }
            if high > left {
                return (self.motion(state, left), impacts);
            }
            let [_, omega] = self.motion(state, high);
            (state, left, impacts) = ([wall, -omega], left - high, impacts + 1);
        }
    }
}

#[test]
fn the_energy_of_a_damped_torsion_spring_is_kept_through_elastic_impacts() {
    let bounce = Bounce { inertia: 0.083 + 0.25, stiffness: 9.0, free: -1.2, damping: 0.6 };
    let scene = scene(
        r#"{"gravity": [0, 0], "until": 2.5, "every": 0.25, "start": {"bar": {"phi": 0.5, "omega": 0}},
            "bars": [{"name": "bar", "mass": 1, "centre": [0.5, 0], "inertia": 0.083, "length": 1}],
            "hinges": [{"name": "O", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
            "torsion_springs": [{"name": "spring", "body": "bar", "stiffness": 9, "free_angle": -1.2, "damping": 0.6}],
            "walls": [{"name": "floor", "body": "bar", "point": [0.5, 0], "line": {"through": [0, -0.2], "normal": [0, 1]}, "restitution": 1}]}"#,
    );
    let start = [0.5, 0.0];
    let ([phi, omega], impacts) = bounce.at(start, 2.5);
    let lost = bounce.energy([phi, omega]) - bounce.energy(start);
    assert!(impacts >= 4, "{impacts}");
    for method in [MethodId::Taylor, MethodId::Dp5, MethodId::Dp8, MethodId::Radau(3), MethodId::Radau(5)] {
        for rtol in TOLERANCES {
            let outcome = finished(&scene, &at(method, rtol));
            // Each of the impacts hands on the error of its time.
            let (last, most) = (&outcome.last, 1000.0 * rtol + 1e-11);
            assert_eq!(outcome.impact_count, impacts, "{method} at {rtol:e}");
            assert!(
                (last.work - lost).abs() < most,
                "{method} at {rtol:e}: work {:.1e} J off",
                last.work - lost
            );
            assert!(
                (last.phi[0] - phi).abs() < most,
                "{method} at {rtol:e}: {:.1e} rad off",
                last.phi[0] - phi
            );
            assert!(
                (last.omega[0] - omega).abs() < 10.0 * most,
                "{method} at {rtol:e}: {:.1e} rad/s off",
                last.omega[0] - omega
            );
        }
    }
}

/// The methods of fixed step have no control to take part in: their work is a quadrature of their own order.
#[test]
fn the_work_of_fixed_steps_has_the_order_of_the_method() {
    let scene = sine_bar();
    let (work, _) = sine_bar_exact(2.0);
    for (method, coarsest) in
        [(MethodId::Gauss(2), 0.1), (MethodId::Gauss(3), 0.25), (MethodId::Gauss(4), 0.5)].into_iter().chain(
            [(MethodId::Rattle(Composition::Single), 0.05), (MethodId::Rattle(Composition::Suzuki5), 0.05)],
        )
    {
        let points: Vec<(f64, f64)> = (0..4)
            .map(|halvings| coarsest / f64::from(1 << halvings))
            .map(|step| {
                let outcome =
                    run(&scene, &Request { method: Some(method), step: Some(step), ..Request::default() });
                (step, (outcome.last.work - work).abs())
            })
            .collect();
        let declared = f64::from(METHODS.iter().find(|known| known.id == method).expect("a method").order);
        let order = common::order(&points, 1e-14, 1e-1);
        assert!(order > declared - 0.35, "{method}: order {order:.2} of {declared}: {points:?}");
    }
}

/// A stiff spring in double-double keeps its energy to what is left of rounding there: no constant of it is
/// rounded to a double.
#[test]
fn extended_series_of_stiff_springs_keep_more_digits_than_plain_ones() {
    let scene = scene(
        r#"{"gravity": [0, -9.81], "until": 1, "every": 0.01,
            "bars": [{"name": "b1", "length": 0.62, "width": 0.04, "thickness": 0.014, "density": 6800},
                     {"name": "b2", "length": 0.24, "width": 0.027, "thickness": 0.012, "density": 3500}],
            "hinges": [{"name": "H1", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b1", "point": [0, 0]}]},
                       {"name": "H2", "between": [{"body": "b1", "point": [0.62, 0]}, {"body": "b2", "point": [0, 0]}]}],
            "start": {"b1": {"phi": -2.2, "omega": 0}, "b2": {"phi": -1.6, "omega": -0.2}},
            "springs": [{"name": "k", "between": [{"body": "ground", "point": [0.61, 0.33]}, {"body": "b1", "point": [0.43, 0]}],
                         "stiffness": 2.0e6, "free_length": 1.1}]}"#,
    );
    let plain = finished(&scene, &at(MethodId::Taylor, 1e-14)).drift.energy.max;
    let extended =
        finished(&scene, &Request { method: Some(MethodId::Taylor), extended: true, ..Request::default() })
            .drift
            .energy
            .max;
    assert!(extended < 0.1 * plain && extended < 1e-18, "extended {extended:.1e}, plain {plain:.1e}");
}

/// A sample with nothing but an imbalance, after so many steps at a tolerance.
fn judged(imbalance: f64, rtol: f64, steps: u64) -> Result<(), String> {
    let scene = sine_bar();
    let mechanism = compile(&scene);
    let plan = Plan::new(&scene, &mechanism, &at(MethodId::Taylor, rtol)).expect("a plan");
    let mut drift = Drift::of_plan(&mechanism, &plan);
    let sample = Sample {
        t: 1.0,
        phi: vec![0.3],
        omega: vec![0.5],
        centre: vec![[0.5, 0.0]],
        velocity: vec![[0.0; 2]],
        constraints: vec![[0.0; 2]],
        motors: vec![[0.0; 2]],
        imbalance,
        ..Sample::default()
    };
    drift.see(&sample, &Limits::default(), steps)
}

/// Energy that is off by more than errors at the tolerance explain is no success, however far below 1e-2;
/// loose tolerances and many steps have more room.
#[test]
fn the_limit_on_the_energy_follows_the_tolerance() {
    for (imbalance, rtol, steps, is_well) in [
        (1.4e-4, 1e-9, 3, false),
        (7e-4, 1e-9, 300, false),
        (1e-8, 1e-9, 3, true),
        (1e-5, 1e-6, 20, true),
        (1e-4, 1e-6, 20_000, true),
        (9e-3, 1e-3, 10, true),
        (1.1e-2, 1e-3, 1_000_000, false),
        (1e-10, 1e-15, 10, false),
        (1e-13, 1e-15, 10, true),
        (f64::NAN, 1e-3, 10, false),
    ] {
        let judged = judged(imbalance, rtol, steps);
        assert_eq!(judged.is_ok(), is_well, "{imbalance:e} at {rtol:e} after {steps} steps: {judged:?}");
    }
}

/// No shipped scene is taken for wrong by a limit that follows the tolerance, by any adaptive method.
#[test]
fn honest_runs_of_all_shipped_scenes_keep_the_limits() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes");
    let mut closest: f64 = 0.0;
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let name = entry.path().file_stem().and_then(|stem| stem.to_str()).expect("a name").to_owned();
        let scene = shipped(&name, &[]);
        let mechanism = compile(&scene);
        for method in adaptive() {
            for rtol in [1e-3, 1e-5, 1e-7, 1e-9, 1e-12] {
                let until = Some(scene.until.min(3.0));
                let request = Request {
                    until,
                    every: Some(scene.until.min(3.0) / 10.0),
                    max_evaluations: Some(200_000),
                    ..at(method, rtol)
                };
                if Plan::new(&scene, &mechanism, &request).is_err() {
                    continue;
                }
                let outcome = run(&scene, &request);
                let (off, limit) = (outcome.drift.energy_share, outcome.drift.energy_limit());
                let is_judged = limit < 1e-2;
                assert!(
                    !is_judged || off <= limit,
                    "{name} {method} {rtol:e}: off by {off:.1e}, the limit is {limit:.1e}: {:?}",
                    outcome.stop
                );
                closest = if is_judged { closest.max(off / limit) } else { closest };
            }
        }
    }
    println!("nearest to its limit: {closest:.1e} of it");
}

/// Integrates a method to `t` \[s\], has every rate jump there, and asserts that it goes on as another one
/// that knows nothing but the step proposed.
fn forgets<P: Form + ?Sized, M: Integrator<P>>(
    make: impl Fn() -> M,
    problem: &mut P,
    start: &Motion,
    t: f64,
    is_stepping: bool,
) {
    let mut used = make();
    let mut state = problem.state(start);
    let advance = |method: &mut M, problem: &mut P, state: &mut driftless::dynamics::State, until: f64| {
        let mut statistics = Statistics::default();
        let until = DoubleDouble::from(until);
        method.advance(problem, state, until, &mut statistics, &mut |_, _| Ok(Seen::Kept)).expect("no stop");
    };
    advance(&mut used, problem, &mut state, t);
    let mut motion = Motion::default();
    problem.read(&state, &mut motion);
    for omega in &mut motion.omega {
        *omega = DoubleDouble::from(-0.7 * omega.hi);
    }
    let proposed = state.memory.first().copied();
    let mut jumped = problem.state(&motion);
    jumped.memory = state.memory;
    used.reset(&mut jumped);
    let kept: Vec<f64> = proposed.filter(|_| is_stepping).into_iter().collect();
    assert_eq!(jumped.memory, kept, "{}", used.name());
    let mut other = jumped.clone();
    advance(&mut used, problem, &mut jumped, 2.0 * t);
    advance(&mut make(), problem, &mut other, 2.0 * t);
    assert!(
        jumped.y == other.y && jumped.low == other.low && jumped.memory == other.memory,
        "{}",
        used.name()
    );
}

#[test]
fn methods_forget_the_motion_before_a_jump_and_keep_the_step() {
    let tolerance = Tolerance { relative: 1e-9, absolute: 1e-9 };
    let of = |name: &str| {
        let scene = shipped(name, &[]);
        let mechanism: Arc<Mechanism> = compile(&scene);
        let start = mechanism.start(&scene);
        (mechanism, start)
    };
    let (mechanism, start) = of("spring");
    let form: &mut dyn Problem = &mut Elimination::<0>::new(Arc::clone(&mechanism));
    forgets(|| Dp5::new(tolerance), form, &start, 0.3, true);
    forgets(|| Dp8::new(tolerance), form, &start, 0.3, true);
    forgets(|| Dopri5::new(tolerance), form, &start, 0.3, true);
    forgets(|| Dop853::new(tolerance), form, &start, 0.3, true);
    forgets(|| Radau::new(3, tolerance).expect("a method"), form, &start, 0.3, true);
    forgets(|| Radau::new(5, tolerance).expect("a method"), form, &start, 0.3, true);
    forgets(|| Taylor::<f64>::new(tolerance), form, &start, 0.3, false);
    let form: &mut dyn Problem = &mut Canonical::<0, true>::new(Arc::clone(&mechanism));
    forgets(|| Gauss::new(3, 0.01).expect("a method"), form, &start, 0.3, false);
    let mut form = Natural::new(mechanism).expect("a form");
    forgets(|| Rattle::new(Composition::Single, 0.01), &mut form, &start, 0.3, false);
    let (mechanism, start) = of("andrews");
    let form: &mut dyn Problem = &mut Multiplier::<0, true>::new(mechanism);
    forgets(|| Projected::new(Dp8::new(tolerance)), form, &start, 0.003, true);
    forgets(|| Projected::new(Radau::new(3, tolerance).expect("a method")), form, &start, 0.003, true);
    forgets(|| SymmetricGauss::new(Gauss::new(2, 1e-4).expect("a method")), form, &start, 0.003, false);
}

/// Random trees, with and without motors, by every adaptive method at every tolerance: none is taken for
/// wrong.
#[test]
fn honest_runs_of_random_trees_keep_the_limits() {
    let (mut judged, mut closest) = (0, 0.0_f64);
    for seed in 0..number("WORK", 40) {
        let mut dice = Dice::new(seed);
        let mut scene = tree(1 + dice.pick(4), seed % 2 == 0, &mut dice);
        (scene.until, scene.every) = (2.0, 0.25);
        let mechanism = compile(&scene);
        for method in adaptive() {
            for rtol in [1e-3, 1e-5, 1e-7, 1e-9, 1e-12] {
                let request = Request { max_evaluations: Some(100_000), ..at(method, rtol) };
                if Plan::new(&scene, &mechanism, &request).is_err() {
                    continue;
                }
                let outcome = run(&scene, &request);
                let (off, limit) = (outcome.drift.energy_share, outcome.drift.energy_limit());
                assert!(
                    limit >= 1e-2 || off <= limit,
                    "{seed} {method} {rtol:e}: {off:.1e} of {limit:.1e}: {:?}",
                    outcome.stop
                );
                judged += usize::from(limit < 1e-2);
                closest = if limit < 1e-2 { closest.max(off / limit) } else { closest };
            }
        }
    }
    println!("{judged} runs judged by their tolerance, the nearest to its limit at {closest:.1e} of it");
}

/// Random scenes with numbers far out: runs that fail by their tolerance alone are few, and the motion of
/// those is wrong beyond the tolerance; `WORK=20000` has more.
#[test]
fn what_fails_by_its_tolerance_is_wrong() {
    let (mut judged, mut failed, mut harmless) = (0, 0, Vec::new());
    for index in 0..number("WORK", 40) * 10 {
        let bytes: Vec<u8> = (0..512).map(|place| (hash(index * 512 + place) >> 32) as u8).collect();
        let text = random::scene(&mut random::Draw::new(&bytes));
        let Ok(scene) = parse_scene(&text, "random.json", &[]) else { continue };
        let Ok(mechanism) = Mechanism::new(&scene) else { continue };
        let mechanism = Arc::new(mechanism);
        let start = mechanism.start(&scene);
        let method = adaptive().nth(hash(index) as usize % 7).expect("a method");
        let rtol = 10f64.powi(-3 - (hash(index + 7) % 10) as i32);
        let integrate = |request: &Request| -> Option<Outcome> {
            let plan = Plan::new(&scene, &mechanism, request).ok()?;
            let run =
                driftless::run::Run::new(Arc::clone(&mechanism), plan, Limits::default(), &start).ok()?;
            driftless::run::integrate(run, &mut |_| Ok(())).ok()
        };
        let Some(outcome) = integrate(&Request { max_evaluations: Some(20_000), ..at(method, rtol) }) else {
            continue;
        };
        let (off, limit) = (outcome.drift.energy_share, outcome.drift.energy_limit());
        judged += usize::from(limit < 1e-2 && outcome.stop.is_none());
        if limit >= 1e-2 || off <= limit || off.is_nan() {
            continue;
        }
        failed += 1;
        let t = outcome.last.t;
        let finer = Request {
            until: Some(t),
            every: Some(t),
            max_evaluations: Some(400_000),
            ..at(MethodId::Dp8, 1e-13)
        };
        let Some(reference) = integrate(&finer).filter(|reference| reference.stop.is_none()) else {
            println!("{index} {method} {rtol:.0e}: energy {off:.1e}, limit {limit:.1e}, no reference");
            continue;
        };
        let apart = outcome
            .last
            .phi
            .iter()
            .zip(&reference.last.phi)
            .fold(0.0, |most: f64, (a, b)| most.max((a - b).abs() / b.abs().max(1.0)));
        let work = (outcome.last.work - reference.last.work).abs() / mechanism.energy_scale;
        println!(
            "{index} {method} {rtol:.0e}: energy {off:.1e}, limit {limit:.1e}, {apart:.1e} rad and work {work:.1e} from the reference"
        );
        if apart.max(work) < 20.0 * rtol {
            harmless.push(index);
        }
    }
    println!(
        "{judged} runs judged by their tolerance, {failed} failed by it, {} of these without harm: {harmless:?}",
        harmless.len()
    );
    assert!(failed * 50 <= judged, "{failed} of {judged}");
}

fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// A number of many bits from a small one (SplitMix64).
fn hash(seed: u64) -> u64 {
    let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(0xd134_2543_de82_ef95);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
