//! Natural coordinates against the angle form, and what RATTLE promises: order, constraints, energy, time
//! symmetry, restart.

use crate::common;
use crate::natural_solve::{accelerations, residual};

use common::{Inertia, ONE_TURN, compile, double_pendulum, free, motor, spring};
use driftless::arithmetic::{Complex, DoubleDouble};
use driftless::dynamics::kernel::{Bias, Kernel};
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::natural::{Natural, NaturalError};
use driftless::dynamics::{Form, Motion, OdeSystem, State, Time};
use driftless::run::{MethodId, Plan, Request};
use driftless::scene::{Bar, Hinge, Law, Motor, Place, Scene, Sine, Start, Wall};
use driftless::stepping::composition::Composition;
use driftless::stepping::rattle::Rattle;
use driftless::stepping::{Cause, Integrator, Reached, Seen, Statistics, StepError};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, TAU};

// ----------------------------------------------------------------------------------------------------------------
// scenes

fn gentle() -> Scene {
    double_pendulum(Inertia::Full, [(0.2, 0.0), (-0.1, 0.0)])
}

/// A double pendulum that swings far without turning over: nonlinear, and tame enough to measure an order on.
fn swinging() -> Scene {
    double_pendulum(Inertia::Full, [(1.2, 0.0), (0.7, -1.0)])
}

fn motor_sine() -> Scene {
    let mut scene = motor(Inertia::Slender, ONE_TURN);
    scene.motors[0].law.sines.push(Sine { amplitude: 0.3, frequency: 5.0, phase: 0.4 });
    start_with_motors(&mut scene);
    scene
}

/// The second bar is driven against the first, which swings free.
fn relative_motor() -> Scene {
    let mut scene = double_pendulum(Inertia::Full, [(0.8, 0.5), (0.0, 0.0)]);
    let sines = vec![Sine { amplitude: 0.6, frequency: 3.0, phase: 0.2 }];
    let law = Law { start: 0.4, rate: -0.5, acceleration: 0.2, sines, profile: None };
    scene.motors.push(Motor { name: "elbow".into(), bar: 1, relative_to: Some(0), law });
    start_with_motors(&mut scene);
    scene
}

fn place(bar: Option<usize>, point: [f64; 2]) -> Place {
    Place { bar, point }
}

fn bar(k: usize, mass: f64, centre: [f64; 2], inertia: f64) -> Bar {
    Bar { name: format!("bar{}", k + 1), length: 0.5, mass, centre, inertia }
}

/// Eight equal bars in a row, let go from a bent configuration.
fn chain() -> Scene {
    let mut scene = free();
    let point = |k: usize| if k == 0 { place(None, [0.0, 0.0]) } else { place(Some(k - 1), [0.5, 0.0]) };
    scene.bars = (0..8).map(|k| bar(k, 0.1, [0.25, 0.0], 0.1 * 0.25 / 12.0)).collect();
    scene.hinges = (0..8)
        .map(|k| Hinge { name: format!("h{k}"), between: [point(k), place(Some(k), [0.0, 0.0])] })
        .collect();
    scene.start = (0..8).map(|k| Start { phi: 0.1 * k as f64, omega: 0.0 }).collect();
    scene
}

/// A trunk with two arms, hinges and centres of mass off the bars' axes, and a spring between the arms.
fn branch() -> Scene {
    let mut scene = free();
    scene.bars = vec![
        bar(0, 0.3, [0.2, 0.05], 0.01),
        bar(1, 0.1, [0.15, -0.04], 0.002),
        bar(2, 0.2, [0.25, 0.03], 0.004),
    ];
    scene.hinges = vec![
        Hinge { name: "root".into(), between: [place(None, [0.1, 0.2]), place(Some(0), [0.0, 0.02])] },
        Hinge { name: "left".into(), between: [place(Some(0), [0.5, 0.1]), place(Some(1), [0.0, 0.0])] },
        Hinge { name: "right".into(), between: [place(Some(0), [0.4, -0.1]), place(Some(2), [0.02, 0.0])] },
    ];
    scene.springs = vec![driftless::scene::Spring {
        between: [place(Some(1), [0.4, 0.0]), place(Some(2), [0.3, 0.0])],
        ..spring(0.0)
    }];
    scene.start = vec![
        Start { phi: 0.4, omega: 1.0 },
        Start { phi: 0.9, omega: 0.0 },
        Start { phi: -0.5, omega: -2.0 },
    ];
    scene
}

/// Sets angles and rates of driven bars to their laws at t = 0; motors must come in the order of their bars.
fn start_with_motors(scene: &mut Scene) {
    for motor in scene.motors.clone() {
        let base = motor.relative_to.map_or(Start { phi: 0.0, omega: 0.0 }, |base| scene.start[base]);
        let rate = motor.law.at::<DoubleDouble>(Time::default()).rate.hi;
        scene.start[motor.bar] =
            Start { phi: base.phi + motor.law.angle(Time::default()).hi, omega: base.omega + rate };
    }
}

// ---------------------------------------------------------------------------------------------------------------
// helpers

/// A scene on its way.
struct Run {
    natural: Natural,
    method: Rattle,
    state: State,
    statistics: Statistics,
    kernel: Kernel<DoubleDouble>,
}

impl Run {
    fn new(scene: &Scene, composition: Composition, step: f64) -> Self {
        let mechanism = compile(scene);
        let natural = Natural::new(mechanism.clone()).expect("a scene with a natural form");
        let state = natural.state(&mechanism.start(scene));
        let kernel = Kernel::without_rows(&mechanism);
        Self {
            natural,
            method: Rattle::new(composition, step),
            state,
            statistics: Statistics::default(),
            kernel,
        }
    }

    fn to(&mut self, until: f64) -> Result<Reached, StepError> {
        self.method.advance(
            &mut self.natural,
            &mut self.state,
            Time::from(until),
            &mut self.statistics,
            &mut |_, _| Ok(Seen::Kept),
        )
    }

    fn motion(&mut self) -> Motion {
        let mut motion = Motion::default();
        self.natural.read(&self.state, &mut motion);
        motion
    }

    /// Energy less work, over the energy scale.
    fn balance(&mut self) -> DoubleDouble {
        let motion = self.motion();
        let mechanism = self.natural.mechanism();
        let energy = mechanism.energy(&mut self.kernel, &motion.phi, &motion.omega).total();
        (energy - motion.work) / DoubleDouble::from(mechanism.energy_scale)
    }
}

/// Largest difference of winding angles and rates.
fn distance(a: &Motion, b: &Motion) -> f64 {
    let angles = (0..a.phi.len()).map(|k| (a.unwrapped(k) - b.unwrapped(k)).abs());
    let rates = a.omega.iter().zip(&b.omega).map(|(a, b)| (*a - *b).hi.abs());
    angles.chain(rates).fold(0.0, f64::max)
}

/// The classical Runge–Kutta method in angles and multipliers: nothing in common with RATTLE but the scene.
fn runge_kutta(scene: &Scene, until: f64, steps: u32) -> Motion {
    let mechanism = compile(scene);
    let mut field = Multiplier::<0, true>::new(mechanism.clone());
    let mut state = field.state(&mechanism.start(scene));
    let n = state.y.len();
    let h = until / f64::from(steps);
    let mut k = vec![vec![0.0; n]; 4];
    let mut y = vec![0.0; n];
    for step in 0..steps {
        let t = Time::from(h) * Time::from(f64::from(step));
        for (i, part) in [0.0, 0.5, 0.5, 1.0].into_iter().enumerate() {
            for j in 0..n {
                y[j] = state.y[j] + if i == 0 { 0.0 } else { part * h * k[i - 1][j] };
            }
            field.rhs(t + Time::from(part * h), &y, &mut k[i]);
        }
        for (j, (hi, lo)) in state.y.iter_mut().zip(&mut state.low).enumerate() {
            let sum = DoubleDouble::sum(*hi, *lo) + h / 6.0 * (k[0][j] + 2.0 * (k[1][j] + k[2][j]) + k[3][j]);
            (*hi, *lo) = (sum.hi, sum.lo);
        }
        state.wrap();
    }
    state.time = Time::from(until);
    let mut motion = Motion::default();
    field.read(&state, &mut motion);
    motion
}

/// Slope of log error over log step, by least squares; errors below `floor` are dropped, at least three must
/// be left.
fn fitted_order(points: &[(f64, f64)], floor: f64) -> f64 {
    let kept: Vec<(f64, f64)> =
        points.iter().filter(|(_, error)| *error > floor).map(|&(h, error)| (h.ln(), error.ln())).collect();
    assert!(kept.len() >= 3, "too few points above the floor: {points:?}");
    let mean = |of: fn(&(f64, f64)) -> f64| kept.iter().map(of).sum::<f64>() / kept.len() as f64;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    kept.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>()
        / kept.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

// -------------------------------------------------------------------------------------------------------------
// equations

/// Numbers in [0, 1) for one random tree.
fn random_tree(n: usize, mut next: impl FnMut() -> f64) -> (Scene, Time) {
    let mut scene = free();
    let gravity = TAU * next();
    scene.gravity = [9.81 * gravity.cos(), 9.81 * gravity.sin()];
    scene.bars = (0..n)
        .map(|k| bar(k, 0.2 + next(), [0.5 * next(), 0.4 * next() - 0.2], 0.01 + 0.05 * next()))
        .collect();
    scene.hinges = (0..n)
        .map(|k| {
            let inner = (next() * (k + 1) as f64) as usize;
            let inner = place(inner.checked_sub(1), [0.6 * next(), 0.4 * next() - 0.2]);
            Hinge { name: format!("h{k}"), between: [inner, place(Some(k), [0.1 * next(), 0.1 * next()])] }
        })
        .collect();
    scene.start = (0..n).map(|_| Start { phi: TAU * next() - 3.0, omega: 6.0 * next() - 3.0 }).collect();
    if next() > 0.5 {
        let ends = [place(None, [1.0 + next(), -1.0]), place(Some((next() * n as f64) as usize), [0.3, 0.1])];
        scene.springs = vec![driftless::scene::Spring { between: ends, ..spring(0.0) }];
    }
    let time = Time::from(3.0 * next());
    scene.motors = (0..n)
        .filter_map(|bar| {
            let (chosen, base) = (next() > 0.6, (next() * (bar + 1) as f64) as usize);
            let sines = vec![Sine { amplitude: next(), frequency: 5.0 * next(), phase: next() }];
            let law = Law {
                start: next(),
                rate: 4.0 * next() - 2.0,
                acceleration: next() - 0.5,
                sines,
                profile: None,
            };
            chosen.then(|| Motor { name: format!("m{bar}"), bar, relative_to: base.checked_sub(1), law })
        })
        .collect();
    for motor in &scene.motors {
        let base = motor.relative_to.map_or(Start { phi: 0.0, omega: 0.0 }, |base| scene.start[base]);
        let phase = motor.law.at::<f64>(time);
        scene.start[motor.bar] = Start { phi: base.phi + phase.angle, omega: base.omega + phase.rate };
    }
    (scene, time)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Two derivations of the same physics, without a common line: accelerations, motor torques.
    #[test]
    fn natural_coordinates_and_angles_tell_the_same_accelerations(n in 1usize..7, seed in any::<u64>()) {
        let mut seed = seed;
        let (scene, time) = random_tree(n, || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        });
        let mechanism = compile(&scene);
        let phi: Vec<f64> = scene.start.iter().map(|start| start.phi).collect();
        let omega: Vec<f64> = scene.start.iter().map(|start| start.omega).collect();
        let mut kernel = Kernel::<f64>::new(&mechanism);
        kernel.accelerations(&mechanism, time, &phi, &omega, Bias::default());
        let natural = Natural::new(mechanism.clone()).unwrap();
        let z: Vec<Complex<f64>> = phi.iter().map(|&phi| Complex::unit(phi)).collect();
        let rate: Vec<Complex<f64>> = z.iter().zip(&omega).map(|(z, &omega)| z.left().times(omega)).collect();
        let (acceleration, multiplier) = accelerations(&natural, time, (&z, &vec![0; n]), &rate);
        let largest = |values: &[f64]| values.iter().fold(1.0f64, |largest, value| largest.max(value.abs()));
        let (fastest, strongest) = (largest(&kernel.load), largest(&kernel.multiplier));
        for k in 0..n {
            let alpha = z[k].cross(acceleration[k]);
            prop_assert!((alpha - kernel.load[k]).abs() < 1e-11 * fastest, "{alpha} {} of {fastest}", kernel.load[k]);
            // Along the vector there is nothing but the centripetal acceleration.
            prop_assert!((z[k].dot(acceleration[k]) + omega[k] * omega[k]).abs() < 1e-11 * fastest);
        }
        for (found, exact) in multiplier.iter().zip(&kernel.multiplier) {
            prop_assert!((found - exact).abs() < 1e-11 * strongest, "{found} {exact} of {strongest}");
        }
    }
}

#[test]
fn a_motion_survives_the_way_into_natural_coordinates_and_back() {
    let mut scene = relative_motor();
    for phi in [0.3, 3.0, -3.1, std::f64::consts::PI, -std::f64::consts::PI, 100.0, -41.0] {
        scene.motors.clear();
        scene.start[0] = Start { phi, omega: -7.0 };
        let mechanism = compile(&scene);
        let mut natural = Natural::new(mechanism.clone()).unwrap();
        let start = mechanism.start(&scene);
        let mut motion = Motion::default();
        natural.read(&natural.state(&start), &mut motion);
        assert_eq!(motion.unwrapped(0), phi);
        assert!(
            (motion.phi[0] + DoubleDouble::TAU.scale_by(motion.turns[0] - start.turns[0]) - start.phi[0])
                .hi
                .abs()
                < 1e-30
        );
        assert!((motion.omega[0] - start.omega[0]).hi.abs() < 1e-29);
    }
}

trait ScaleBy {
    fn scale_by(self, turns: i64) -> Self;
}

impl ScaleBy for DoubleDouble {
    fn scale_by(self, turns: i64) -> Self {
        self * DoubleDouble::from(turns as f64)
    }
}

#[test]
fn scenes_without_a_natural_form_are_refused_by_name() {
    let refused = |scene: &Scene| Natural::new(compile(scene)).unwrap_err();
    let mut damped = free();
    damped.springs.push(spring(0.1));
    assert_eq!(refused(&damped), NaturalError::Damped("spring".into()));
    let mut walled = free();
    let wall = Wall {
        name: "wall".into(),
        bar: 1,
        point: [0.6, 0.0],
        through: [0.0, 0.0],
        on: None,
        law: None,
        aim: None,
        normal: [1.0, 0.0],
        restitution: 0.5,
    };
    walled.walls.push(wall);
    assert_eq!(refused(&walled), NaturalError::Wall("wall".into()));
    // The first bar has no inertia at all: a point mass in its hinge.  In angles the second one's mass still
    // gives it some.
    let mut thin = free();
    thin.bars[0] = bar(0, 0.1, [0.0, 0.0], 0.0);
    thin.bars[1].inertia = 0.0;
    thin.start[1].phi = 0.0;
    assert_eq!(refused(&thin), NaturalError::Singular("bar2".into()));
}

/// A force of a formula that acts on some of its branches only is judged before the first step.
#[test]
fn laws_are_judged_on_all_branches() {
    let refusal = |more: &str| {
        let scene = crate::formulas::scene(&format!(
            r#"{{"name": "stopper", "gravity": [0, -9.81], "bars": [{{"name": "bar", "mass": 1, "centre": [0.5, 0], "inertia": 0.1}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}}],
            "points": [{{"name": "tip", "body": "bar", "point": [1, 0]}}],
            "start": {{"bar": {{"phi": -0.3, "omega": 0}}}}, "until": 3, "every": 1, {more}}}"#
        ));
        let method = Some(MethodId::Rattle(Composition::Single));
        let request = Request { method, step: Some(0.0025), ..Request::default() };
        Plan::new(&scene, &compile(&scene), &request).err().map(|refusal| refusal.to_string())
    };
    let many: Vec<String> = (0..10).map(|k| format!("max(0, tip.x - {k})")).collect();
    for law in [
        "if(tip.y < -0.8, 500*(-0.8 - tip.y), 0)",
        "if(tip.y < -0.8, if(t > 1, 5, 0), 0)",
        "-100*max(0, -0.9 - tip.y)",
        &format!("if(tip.y < -2, 1, 0)*({})", many.join(" + ")),
    ] {
        let force = format!(
            r#""forces": [{{"name": "floor", "body": "bar", "point": [1, 0], "force": [0, "{law}"]}}]"#
        );
        let told = refusal(&force).unwrap_or_else(|| panic!("{law} is taken"));
        assert!(told.contains("`floor`"), "{told}");
    }
    let of_place = r#""potentials": [{"name": "floor", "energy": "250*max(0, -0.8 - tip.y)^2"}]"#;
    assert_eq!(refusal(of_place), None);
    let of_turns = r#""potentials": [{"name": "floor", "energy": "1*max(0, -0.8 - tip.y)^2*bar.phi"}]"#;
    assert!(refusal(of_turns).is_some_and(|told| told.contains("`floor`")));
}

// -----------------------------------------------------------------------------------------------------------------
// order

/// `smooth` coarsens the steps of order 8, whose error would be rounding otherwise.
fn assert_orders(scene: &Scene, until: f64, smooth: f64) {
    let mut reference = Run::new(scene, Composition::KahanLi17, 1.0 / 1024.0);
    reference.to(until).unwrap();
    let reference = reference.motion();
    for (composition, coarsest) in [
        (Composition::Single, 64.0),
        (Composition::Suzuki5, 32.0),
        (Composition::KahanLi9, 24.0),
        (Composition::KahanLi17, 32.0 / smooth),
    ] {
        let points: Vec<(f64, f64)> = [1.0, 1.5, 2.0, 3.0, 4.0]
            .iter()
            .map(|finer| {
                let h = 1.0 / (coarsest * finer);
                let mut run = Run::new(scene, composition, h);
                run.to(until).unwrap();
                assert!((run.state.time.hi - until).abs() < 1e-12);
                (h, distance(&run.motion(), &reference))
            })
            .collect();
        let order = fitted_order(&points, 1e-13);
        assert!(
            (order - f64::from(composition.order())).abs() < 0.35,
            "{composition:?} measured {order}: {points:?}"
        );
    }
}

#[test]
fn the_order_is_the_stated_one_on_a_double_pendulum() {
    assert_orders(&swinging(), 1.5, 1.0);
}

#[test]
fn the_order_is_the_stated_one_with_a_driven_bar() {
    assert_orders(&motor_sine(), 1.0, 1.0);
}

#[test]
fn the_order_is_the_stated_one_with_a_driven_relative_angle() {
    assert_orders(&relative_motor(), 1.5, 4.0);
}

#[test]
fn the_solution_is_that_of_a_method_with_nothing_in_common() {
    for (name, scene) in [
        ("free", free()),
        ("motor", motor(Inertia::Slender, ONE_TURN)),
        ("motor_sine", motor_sine()),
        ("relative", relative_motor()),
        ("chain", chain()),
        ("branch", branch()),
    ] {
        let mut run = Run::new(&scene, Composition::KahanLi17, 1.0 / 512.0);
        run.to(1.0).unwrap();
        let (found, other) = (run.motion(), runge_kutta(&scene, 1.0, 10_000));
        assert!(distance(&found, &other) < 2e-11, "{name}: {:e}", distance(&found, &other));
        assert_eq!(found.turns, other.turns);
        assert!(
            (found.work - other.work).hi.abs() < 2e-11,
            "{name}: work {:e}",
            (found.work - other.work).hi
        );
    }
}

// ----------------------------------------------------------------------------------------------------------
// long horizon

/// Largest excursion of the balance in each tenth of the run, and its mean there; the constraints are checked
/// all along.
fn tenths(scene: &Scene, composition: Composition, step: f64, until: f64) -> ([f64; 10], [f64; 10]) {
    let mut run = Run::new(scene, composition, step);
    let start = run.balance();
    let (mut largest, mut mean) = ([0.0f64; 10], [0.0; 10]);
    const SAMPLES: usize = 400;
    for tenth in 0..10 {
        for sample in 1..=SAMPLES {
            run.to(until * (tenth as f64 + sample as f64 / SAMPLES as f64) / 10.0).unwrap();
            let excursion = (run.balance() - start).hi;
            largest[tenth] = largest[tenth].max(excursion.abs());
            mean[tenth] += excursion / SAMPLES as f64;
            let [position, velocity] = residual(&run.natural, &run.state);
            assert!(position < 1e-15 && velocity < 1e-13, "{composition:?}: {position:e} {velocity:e}");
        }
    }
    (largest, mean)
}

/// What rounding alone may wander over such a run \[J\]: a walk of 1e-17 a step over 1e4 steps.
const WALK: f64 = 1e-15;

/// Bound on the excursion, and no climb: the balance oscillates about the same value in both halves, with
/// excursions of one size within what the whirls of a chaotic scene make of it.
fn assert_no_drift(name: &str, scene: &Scene, composition: Composition, step: f64, until: f64, bound: f64) {
    let (largest, mean) = tenths(scene, composition, step, until);
    assert!(largest.iter().all(|&largest| largest < bound), "{name} {composition:?}: {largest:?}");
    let worst = |part: &[f64]| part.iter().copied().fold(0.0, f64::max);
    let middle = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let (first, second) = (worst(&largest[..5]), worst(&largest[5..]));
    assert!(second < 4.0 * first + WALK, "{name} {composition:?} climbs: {largest:?}");
    let shift = (middle(&mean[5..]) - middle(&mean[..5])).abs();
    assert!(shift < 0.25 * first + WALK, "{name} {composition:?} climbs: {mean:?}");
}

#[test]
fn energy_of_the_gentle_scene_does_not_drift() {
    assert_no_drift("gentle", &gentle(), Composition::Single, 1.0 / 256.0, 400.0, 5e-6);
    assert_no_drift("gentle", &gentle(), Composition::Suzuki5, 1.0 / 256.0, 400.0, 2e-10);
    assert_no_drift("gentle", &gentle(), Composition::KahanLi9, 1.0 / 256.0, 400.0, 5e-14);
    assert_no_drift("gentle", &gentle(), Composition::KahanLi17, 1.0 / 128.0, 400.0, 5e-16);
}

/// A constant part of 1e-16 in anything a step does shows here as a slope: 6e-19 a second was seen while
/// position and velocity were moved by changes rounded separately.
#[test]
fn energy_of_the_gentle_scene_has_no_slope_far_below_rounding() {
    let (_, mean) = tenths(&gentle(), Composition::KahanLi17, 1.0 / 128.0, 1000.0);
    let slope = (mean[9] + mean[8] - mean[1] - mean[0]) / 2.0 / 800.0;
    assert!(slope.abs() < 2e-19, "{slope:e} of the energy per second");
}

#[test]
fn energy_less_work_of_driven_scenes_does_not_drift() {
    // Without the growing drive, which spins the scene up: its energy error grows with its energy.
    let mut steady = relative_motor();
    steady.motors[0].law = Law {
        start: 0.4,
        rate: 0.0,
        acceleration: 0.0,
        sines: vec![Sine { amplitude: 0.3, frequency: 1.3, phase: 0.2 }],
        profile: None,
    };
    start_with_motors(&mut steady);
    for (name, scene) in
        [("motor", motor(Inertia::Slender, ONE_TURN)), ("motor_sine", motor_sine()), ("relative", steady)]
    {
        assert_no_drift(name, &scene, Composition::Single, 1.0 / 256.0, 200.0, 2e-2);
        assert_no_drift(name, &scene, Composition::Suzuki5, 1.0 / 256.0, 200.0, 2e-5);
        assert_no_drift(name, &scene, Composition::KahanLi9, 1.0 / 256.0, 100.0, 2e-7);
        assert_no_drift(name, &scene, Composition::KahanLi17, 1.0 / 256.0, 100.0, 1e-9);
    }
}

#[test]
fn chains_and_branches_keep_energy_and_constraints() {
    assert_no_drift("chain", &chain(), Composition::Suzuki5, 1.0 / 512.0, 20.0, 1e-10);
    assert_no_drift("branch", &branch(), Composition::KahanLi9, 1.0 / 256.0, 50.0, 1e-6);
}

#[test]
fn a_motor_is_followed_to_the_last_bit_and_its_turns_counted() {
    let mut run = Run::new(&motor(Inertia::Slender, ONE_TURN), Composition::Suzuki5, 1.0 / 128.0);
    for seconds in [1.0, 10.25, 100.5] {
        run.to(seconds).unwrap();
        let law = Law { start: FRAC_PI_2, rate: ONE_TURN, acceleration: 0.0, sines: vec![], profile: None };
        assert_eq!(run.motion().unwrapped(0), law.angle(run.state.time).hi);
        assert_eq!(run.motion().omega[0].hi, ONE_TURN);
    }
}

// ------------------------------------------------------------------------------------------------- symmetry
// and restart

#[test]
fn a_run_back_in_time_arrives_at_the_start() {
    for (name, scene) in [("free", free()), ("motor_sine", motor_sine()), ("branch", branch())] {
        for composition in Composition::ALL {
            let mut run = Run::new(&scene, composition, 1.0 / 128.0);
            let start = run.motion();
            run.to(3.0).unwrap();
            assert!(distance(&run.motion(), &start) > 0.1);
            run.method = Rattle::new(composition, -1.0 / 128.0);
            run.to(0.0).unwrap();
            let back = run.motion();
            assert!(distance(&back, &start) < 1e-11, "{name} {composition:?}: {:e}", distance(&back, &start));
            assert!((back.work - start.work).hi.abs() < 1e-11);
            assert_eq!(back.turns, start.turns);
        }
    }
}

#[test]
fn a_restart_gives_the_same_bits() {
    for scene in [free(), motor_sine(), chain()] {
        let mut whole = Run::new(&scene, Composition::KahanLi9, 0.01);
        whole.to(2.0).unwrap();
        let mut first = Run::new(&scene, Composition::KahanLi9, 0.01);
        first.to(0.73).unwrap();
        let mut second = Run::new(&scene, Composition::KahanLi9, 0.01);
        second.state = first.state.clone();
        second.to(2.0).unwrap();
        assert_eq!(second.state, whole.state);
    }
}

// --------------------------------------------------------------------------------------------------------------
// extremes

#[test]
fn a_step_far_too_large_is_a_typed_stop_at_the_last_good_state() {
    for (scene, step) in [(free(), 0.5), (motor_sine(), 0.3), (chain(), 0.5), (branch(), 1.0)] {
        for composition in Composition::ALL {
            let mut run = Run::new(&scene, composition, step);
            let error = run.to(20.0).expect_err("a step far too large");
            assert_eq!(error.cause, Cause::NotConverged, "{error}");
            assert_eq!(error.t, run.state.time.hi);
            let [position, velocity] = residual(&run.natural, &run.state);
            assert!(position < 1e-12 && velocity < 1e-10, "{position:e} {velocity:e}");
        }
    }
}

#[test]
fn a_spring_a_million_times_too_stiff_for_the_step_is_a_typed_stop() {
    let mut scene = free();
    scene.springs.push(driftless::scene::Spring { stiffness: 7.4e6, ..spring(0.0) });
    let error = Run::new(&scene, Composition::Suzuki5, 0.01).to(10.0).expect_err("an unstable step");
    assert_eq!(error.cause, Cause::NotConverged, "{error}");
}

#[test]
fn not_a_number_is_named() {
    let mut scene = free();
    // Both ends in one place at the start: the spring has no direction.
    scene.start[0].phi = 0.0;
    scene.springs.push(driftless::scene::Spring {
        between: [place(None, [0.3, 0.0]), place(Some(0), [0.3, 0.0])],
        ..spring(0.0)
    });
    let error = Run::new(&scene, Composition::Single, 0.01).to(1.0).expect_err("no direction");
    assert_eq!((error.cause, error.t), (Cause::NotFinite, 0.0), "{error}");
    for step in [0.0, f64::NAN, f64::INFINITY] {
        assert_eq!(
            Run::new(&free(), Composition::Suzuki5, step).to(1.0).expect_err("no step").cause,
            Cause::StepTooSmall
        );
    }
}

#[test]
fn bars_at_rest_without_gravity_stay_and_count() {
    let mut scene = free();
    scene.gravity = [0.0, 0.0];
    let mut run = Run::new(&scene, Composition::KahanLi9, 0.01);
    let start = run.motion();
    run.to(1.0).unwrap();
    assert!(distance(&run.motion(), &start) < 1e-30);
    assert_eq!(run.statistics, Statistics { steps: 100, evaluations: 900, ..Statistics::default() });
}

/// What is told of a formula is true of it: it has no potential, or it depends on rates.
#[test]
fn formulas_that_rattle_does_not_take_are_told_by_what_they_are() {
    let with = |torque: &str| {
        let text = format!(
            r#"{{"name": "r", "gravity": [0, 0], "bars": [{{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
            "torques": [{{"name": "T", "body": "b", "torque": "{torque}"}}],
            "start": {{"b": {{"phi": 0.3, "omega": 0}}}}, "until": 1, "every": 1}}"#
        );
        let scene = driftless::scene::parse_scene(&text, "r", &[]).unwrap_or_else(|error| panic!("{error}"));
        let method = MethodId::Rattle(Composition::Suzuki5);
        let request = Request { method: Some(method), step: Some(0.01), ..Request::default() };
        Plan::new(&scene, &compile(&scene), &request).expect_err("a refusal").to_string()
    };
    let of_place = with("-1*sin(b.phi)");
    assert!(of_place.contains("`T` is not given by a potential"), "{of_place}");
    let of_rates = with("-0.1*b.omega");
    assert!(of_rates.contains("with force or torque T") && !of_rates.contains("damper"), "{of_rates}");
}
