//! Shared by the tests: the source problem's scenes and small helpers.
#![allow(dead_code)]

use driftless::dynamics::Mechanism;
use driftless::scene::{Bar, Hinge, Law, Motor, Place, Scene, Spring, Start};
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
            Hinge { name: "A".into(), between: [Place { bar: None, point: [0.0, 0.0] }, Place { bar: Some(0), point: [0.0, 0.0] }] },
            Hinge { name: "B".into(), between: [Place { bar: Some(0), point: [LENGTH, 0.0] }, Place { bar: Some(1), point: [0.0, 0.0] }] },
        ],
        springs: vec![],
        motors: vec![],
        walls: vec![],
        start: start.iter().map(|&(phi, omega)| Start { phi, omega }).collect(),
        until: 10.0,
        every: 0.01,
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
        between: [Place { bar: None, point: [-LENGTH / 2.0, 0.0] }, Place { bar: Some(0), point: [2.0 * LENGTH / 3.0, 0.0] }],
        stiffness: 7.394_287_5,
        free_length: 0.4,
        damping,
    }
}

/// Case e with motor rate `rate` \[rad/s\].
pub fn motor(inertia: Inertia, rate: f64) -> Scene {
    let mut scene = double_pendulum(inertia, [(FRAC_PI_2, rate), (FRAC_PI_2, rate)]);
    let law = Law { start: FRAC_PI_2, rate, acceleration: 0.0, sines: vec![] };
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
