//! Shared by the tests: the source problem's scenes and small helpers.
#![allow(dead_code)]

use driftless::arithmetic::DoubleDouble;
use driftless::dynamics::{Mechanism, Motion, State};
use driftless::run::{Limits, Outcome, Plan, Problem, Request, Run, integrate};
use driftless::scene::{Bar, Hinge, Law, Motor, Place, Scene, Spring, Start};
use driftless::stepping::{Integrator, Reached, Seen, Statistics};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

/// Which moment of inertia the source uses.
#[derive(Clone, Copy)]
pub enum Inertia {
    Full,
    Slender,
}

/// Length of a bar \[m\].
pub const LENGTH: f64 = 0.6;
/// Mass of a bar \[kg\].
pub const MASS: f64 = 0.0603;

/// The source problem's two bars under gravity along +x.
pub fn double_pendulum(inertia: Inertia, start: [(f64, f64); 2]) -> Scene {
    let width = match inertia {
        Inertia::Full => 0.05,
        Inertia::Slender => 0.0,
    };
    let bar = |name: &str| Bar {
        name: name.into(),
        length: LENGTH,
        mass: MASS,
        centre: [LENGTH / 2.0, 0.0],
        inertia: MASS * (LENGTH * LENGTH + width * width) / 12.0,
    };
    Scene {
        name: "free".into(),
        description: String::new(),
        gravity: [9.81, 0.0],
        bars: vec![bar("bar1"), bar("bar2")],
        hinges: vec![
            Hinge {
                name: "A".into(),
                between: [Place { bar: None, point: [0.0, 0.0] }, Place { bar: Some(0), point: [0.0, 0.0] }],
            },
            Hinge {
                name: "B".into(),
                between: [
                    Place { bar: Some(0), point: [LENGTH, 0.0] },
                    Place { bar: Some(1), point: [0.0, 0.0] },
                ],
            },
        ],
        start: start.iter().map(|&(phi, omega)| Start { phi, omega }).collect(),
        until: 10.0,
        every: 0.01,
        ..Scene::default()
    }
}

/// Both bars horizontal, at rest.
pub fn free() -> Scene {
    double_pendulum(Inertia::Full, [(FRAC_PI_2, 0.0), (FRAC_PI_2, 0.0)])
}

/// The spring of case d.
pub fn spring(damping: f64) -> Spring {
    Spring {
        name: "spring".into(),
        between: [
            Place { bar: None, point: [-LENGTH / 2.0, 0.0] },
            Place { bar: Some(0), point: [2.0 * LENGTH / 3.0, 0.0] },
        ],
        stiffness: 7.394_287_5,
        free_length: 0.4,
        damping,
        rigid: false,
    }
}

/// Case e with motor rate `rate` \[rad/s\].
pub fn motor(inertia: Inertia, rate: f64) -> Scene {
    let mut scene = double_pendulum(inertia, [(FRAC_PI_2, rate), (FRAC_PI_2, rate)]);
    let law = Law { start: FRAC_PI_2, rate, acceleration: 0.0, sines: vec![], profile: None };
    scene.motors.push(Motor { name: "motor".into(), bar: 0, relative_to: None, law });
    scene
}

/// One turn a second.
pub const ONE_TURN: f64 = TAU;

/// The equations of a scene.
pub fn compile(scene: &Scene) -> Arc<Mechanism> {
    Arc::new(Mechanism::new(scene).expect("a valid scene"))
}

/// A scene of `examples/scenes/`, with `PATH=VALUE` overrides.
pub fn shipped(name: &str, overrides: &[&str]) -> Scene {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/scenes/{name}.json"));
    let overrides: Vec<_> = overrides.iter().map(|text| text.parse().expect("an override")).collect();
    driftless::scene::read_scene(&path, &overrides).expect("a shipped scene")
}

/// A run of a scene by what was asked for, to its end or its stop.
pub fn run(scene: &Scene, request: &Request) -> Outcome {
    run_limited(scene, request, Limits::default())
}

/// A run that stops where a stated drift limit is exceeded.
pub fn run_limited(scene: &Scene, request: &Request, limits: Limits) -> Outcome {
    let mechanism = compile(scene);
    let start = mechanism.start(scene);
    run_from(scene, &mechanism, request, limits, &start)
}

/// A run from another motion than the scene's start.
pub fn run_from(
    scene: &Scene,
    mechanism: &Arc<Mechanism>,
    request: &Request,
    limits: Limits,
    start: &Motion,
) -> Outcome {
    let plan = Plan::new(scene, mechanism, request).expect("a sensible pairing");
    let run = Run::new(Arc::clone(mechanism), plan, limits, start).expect("a beginning");
    integrate(run, &mut |_| Ok(())).expect("no observer fails")
}

/// A single uniform slender bar of length 1 m and mass 1 kg on a ground hinge, hanging down at phi = 0 under
/// 10 m/s²: a physical pendulum with squared frequency 15 /s².
pub fn pendulum(phi: f64, omega: f64) -> Scene {
    Scene {
        name: "pendulum".into(),
        description: String::new(),
        gravity: [10.0, 0.0],
        bars: vec![Bar {
            name: "bar".into(),
            length: 1.0,
            mass: 1.0,
            centre: [0.5, 0.0],
            inertia: 1.0 / 12.0,
        }],
        hinges: vec![Hinge {
            name: "A".into(),
            between: [Place { bar: None, point: [0.0, 0.0] }, Place { bar: Some(0), point: [0.0, 0.0] }],
        }],
        start: vec![Start { phi, omega }],
        until: 10.0,
        every: 0.1,
        ..Scene::default()
    }
}

/// Squared frequency of small swings of [`pendulum`] \[1/s²\].
pub const PENDULUM_SQUARED: f64 = 15.0;

/// A quarter of the period of [`pendulum`] from rest at `amplitude` \[s\]: K(sin(amplitude/2)) / omega_0 by
/// the arithmetic-geometric mean.
pub fn quarter_period(amplitude: f64) -> f64 {
    let (mut a, mut g) = (1.0, (amplitude / 2.0).cos());
    while (a - g).abs() > 1e-15 {
        (a, g) = (0.5 * (a + g), (a * g).sqrt());
    }
    FRAC_PI_2 / (0.5 * (a + g)) / PENDULUM_SQUARED.sqrt()
}

/// Least-squares slope of log error on log step; points outside (floor, ceiling) are dropped, and at least
/// three must be left.
pub fn order(points: &[(f64, f64)], floor: f64, ceiling: f64) -> f64 {
    let kept: Vec<(f64, f64)> = points
        .iter()
        .filter(|(_, error)| *error > floor && *error < ceiling)
        .map(|(h, error)| (h.ln(), error.ln()))
        .collect();
    assert!(kept.len() >= 3, "too few points above round-off: {points:?}");
    let count = kept.len() as f64;
    let (x, y) = kept.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / count, y + p.1 / count));
    let (above, below) =
        kept.iter().fold((0.0, 0.0), |(a, b), p| (a + (p.0 - x) * (p.1 - y), b + (p.0 - x) * (p.0 - x)));
    above / below
}

/// Integrates a problem from one output time to the next, `every` \[s\] apart, and asserts that nothing stops
/// it.
pub fn go(
    method: &mut dyn Integrator<dyn Problem>,
    problem: &mut (dyn Problem + 'static),
    state: &mut State,
    every: f64,
    rows: std::ops::RangeInclusive<u64>,
) -> Statistics {
    let mut statistics = Statistics::default();
    for row in rows {
        let until = DoubleDouble::product(every, row as f64);
        let reached = method.advance(problem, state, until, &mut statistics, &mut |_, _| Ok(Seen::Kept));
        assert_eq!(reached, Ok(Reached::Until));
    }
    statistics
}

/// A shipped scene's equations and its start.
pub fn started(name: &str) -> (Arc<Mechanism>, Motion) {
    let scene = shipped(name, &[]);
    let mechanism = compile(&scene);
    let start = mechanism.start(&scene);
    (mechanism, start)
}
