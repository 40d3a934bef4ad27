//! The power series of the motion: against Dormand–Prince, against itself in double-double, at symmetric releases.

mod common;

use common::{compile, shipped};
use driftless::arithmetic::DoubleDouble;
use driftless::dynamics::elimination::Elimination;
use driftless::dynamics::{Form, Motion, Time};
use driftless::scene::Scene;
use driftless::stepping::{Dp8, Method, Seen, Taylor, Tolerance};

fn end<M: Method<Elimination<0>>>(scene: &Scene, mut method: M, until: f64) -> Motion {
    let mechanism = compile(scene);
    let mut problem = Elimination::<0>::new(mechanism.clone());
    let mut state = problem.state(&mechanism.start(scene));
    let mut tally = Default::default();
    method.advance(&mut problem, &mut state, Time::from(until), &mut tally, &mut |_, _| Ok(Seen::Kept)).expect("an end");
    let mut motion = Motion::default();
    problem.read(&state, &mut motion);
    motion
}

fn distance(a: &Motion, b: &Motion) -> f64 {
    let parts = |m: &Motion| (0..m.phi.len()).flat_map(|k| [m.phi[k], m.omega[k]]).collect::<Vec<_>>();
    let angles = parts(a).into_iter().zip(parts(b)).map(|(a, b)| (a - b).hi.abs()).fold(0.0, f64::max);
    angles.max((a.work - b.work).hi.abs())
}

#[test]
fn the_series_agrees_with_dormand_prince() {
    let damped = ["springs.spring.damping=0.3"];
    let cases: [(&str, &[&str], f64); 7] = [
        ("free", &[], 3.0),
        ("gentle", &[], 5.0),
        ("spring", &[], 3.0),
        ("spring", &damped, 3.0),
        ("motor", &[], 3.0),
        ("motor_sine", &[], 3.0),
        ("branch", &[], 1.0),
    ];
    for (name, overrides, until) in cases {
        let scene = shipped(name, overrides);
        let series = end(&scene, Taylor::new(Tolerance { relative: 1e-16, absolute: 1e-16 }), until);
        let explicit = end(&scene, Dp8::new(Tolerance { relative: 1e-14, absolute: 1e-14 }), until);
        let apart = distance(&series, &explicit);
        assert!(apart < 1e-10, "{name}: {apart:e}");
    }
}

#[test]
fn double_double_agrees_with_itself_at_another_order() {
    for name in ["free", "motor_sine", "spring"] {
        let scene = shipped(name, &[]);
        let reference = end(&scene, Taylor::reference(), 2.0);
        let other = end(&scene, Taylor::<DoubleDouble>::with_order(1e-33, 36), 2.0);
        let plain = end(&scene, Taylor::new(Tolerance { relative: 1e-17, absolute: 1e-17 }), 2.0);
        assert!(distance(&reference, &other) < 1e-26, "{name}: {:e}", distance(&reference, &other));
        assert!(distance(&reference, &plain) < 1e-12, "{name}: {:e}", distance(&reference, &plain));
    }
}
