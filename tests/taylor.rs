//! The power series of the motion: against Dormand–Prince, against itself in double-double, at symmetric releases.

mod common;

use common::{compile, shipped};
use driftless::arithmetic::DoubleDouble;
use driftless::dynamics::State;
use driftless::dynamics::elimination::Elimination;
use driftless::dynamics::kernel::Kernel as Energies;
use driftless::dynamics::{Form, Motion, Time};
use driftless::scene::Scene;
use driftless::stepping::taylor::Kernel;
use driftless::stepping::{Dp8, Method, Seen, Tally, Taylor, Tolerance};

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

/// The method at a tolerance and order on one kind of code.
fn on(kernel: Kernel, tolerance: f64, order: usize) -> Taylor<f64> {
    let mut method = Taylor::with_order(tolerance, order);
    method.kernel = kernel;
    method
}

/// The method with its first orders in double-double.
fn extended(kernel: Kernel, tolerance: f64) -> Taylor<f64> {
    let mut method = on(kernel, tolerance, 24);
    method.extended = true;
    method
}

/// Scenes whose first orders have a kernel in double-double.
fn extended_scenes() -> Vec<(&'static str, Scene)> {
    fast_scenes().into_iter().filter(|(name, _)| ["free", "gentle", "spinning", "sideways", "single"].contains(name)).collect()
}

/// Scenes the fast kernels take.
fn fast_scenes() -> Vec<(&'static str, Scene)> {
    let mut sideways = shipped("free", &[]);
    sideways.gravity = [3.0, -9.0];
    let mut second = shipped("motor", &[]);
    second.motors[0].bar = 1;
    let mut backwards = shipped("motor", &[]);
    backwards.motors[0].law.rate = -4.0;
    backwards.start[0].omega = -4.0;
    backwards.gravity = [3.0, -9.0];
    let mut three = shipped("chain8", &[]);
    let (mut single, mut six) = (three.clone(), three.clone());
    for (scene, count) in [(&mut single, 1), (&mut three, 3), (&mut six, 6)] {
        scene.bars.truncate(count);
        scene.hinges.truncate(count);
        scene.start.truncate(count);
    }
    let names = ["free", "gentle", "spinning", "motor", "chain8"];
    let others = [("sideways", sideways), ("second", second), ("backwards", backwards), ("single", single), ("three", three), ("six", six)];
    names.map(|name| (name, shipped(name, &[]))).into_iter().chain(others).collect()
}

#[test]
fn fast_kernels_agree_with_the_series_and_with_double_double() {
    for (name, scene) in fast_scenes() {
        let exact = end(&scene, Taylor::reference(), 2.0);
        for order in [16, 20, 24] {
            let series = end(&scene, on(Kernel::Series, 1e-17, order), 2.0);
            let fast = end(&scene, on(Kernel::Fastest, 1e-17, order), 2.0);
            assert_ne!(series, fast, "{name}: the fast kernel was not entered");
            let (apart, error) = (distance(&series, &fast), distance(&exact, &fast));
            assert!(apart < 2e-13 && error < 1e-13, "{name}, order {order}: {apart:e}, {error:e}");
        }
    }
}

#[test]
fn the_error_falls_with_the_tolerance() {
    for (name, scene) in fast_scenes() {
        let exact = end(&scene, Taylor::reference(), 3.0);
        let error = |tolerance| distance(&exact, &end(&scene, on(Kernel::Fastest, tolerance, 20), 3.0));
        let errors = [error(1e-6), error(1e-9), error(1e-12)];
        assert!(errors[0] > 1e-9 && errors[0] < 1e-3 && errors[1] < 1e-5 && errors[2] < 1e-9, "{name}: {errors:?}");
    }
}

#[test]
fn portable_lanes_and_hardware_have_the_same_bits() {
    for (name, scene) in fast_scenes() {
        for order in [16, 20, 24] {
            let (fast, portable) =
                (end(&scene, on(Kernel::Fastest, 1e-13, order), 2.0), end(&scene, on(Kernel::Portable, 1e-13, order), 2.0));
            assert_eq!(fast, portable, "{name}, order {order}");
        }
    }
}

#[test]
fn orders_in_double_double_leave_only_what_later_ones_round() {
    for (name, scene) in extended_scenes() {
        let exact = end(&scene, Taylor::reference(), 2.0);
        let plain = distance(&exact, &end(&scene, on(Kernel::Fastest, 1e-22, 24), 2.0));
        let found = end(&scene, extended(Kernel::Fastest, 1e-22), 2.0);
        let error = distance(&exact, &found);
        assert!(error < 1e-17 && error < plain / 30.0, "{name}: {error:e}, plain {plain:e}");
        assert_eq!(found, end(&scene, extended(Kernel::Portable, 1e-22), 2.0), "{name}: lanes");
    }
}

#[test]
fn orders_in_double_double_keep_energy_a_thousand_times_closer() {
    let scene = shipped("free", &[]);
    let mechanism = compile(&scene);
    let mut kernel = Energies::<DoubleDouble>::new(2, 0);
    let mut energy = |motion: &Motion| mechanism.energy(&mut kernel, &motion.phi, &motion.omega).total();
    let before = energy(&mechanism.start(&scene));
    let after = energy(&end(&scene, extended(Kernel::Fastest, 1e-20), 1000.0));
    let drift = (after - before).hi.abs() / mechanism.energy_scale;
    assert!(drift < 1e-17, "{drift:e}");
}

#[test]
fn a_symmetric_release_takes_no_step_too_long() {
    // From rest only every fourth coefficient of the rates is not zero; the first step alone must keep its accuracy.
    let scene = shipped("free", &[]);
    let mechanism = compile(&scene);
    for kernel in [Kernel::Fastest, Kernel::Series] {
        for order in [16, 20, 24] {
            let mut problem = Elimination::<0>::new(mechanism.clone());
            let mut state = problem.state(&mechanism.start(&scene));
            let mut times = Vec::new();
            let mut watch = |_: &mut Elimination<0>, state: &mut State| {
                times.push(state.time);
                Ok(Seen::Kept)
            };
            on(kernel, 1e-12, order).advance(&mut problem, &mut state, Time::from(1.0), &mut Tally::default(), &mut watch).expect("an end");
            let after_one = end(&scene, on(kernel, 1e-12, order), times[0].hi);
            let exact = end(&scene, Taylor::reference(), times[0].hi);
            assert!(times[0].hi > 0.01 && distance(&after_one, &exact) < 1e-11, "{:e}", distance(&after_one, &exact));
        }
    }
}

#[test]
fn hanging_at_rest_stays_to_the_last_bit() {
    let scene = shipped("hanging", &[]);
    let scene = Scene { springs: vec![], ..scene };
    let start = compile(&scene).start(&scene);
    let last = end(&scene, on(Kernel::Fastest, 1e-12, 20), 1e6);
    assert_eq!((last.phi, last.omega), (start.phi, start.omega));
}

#[test]
fn a_run_continued_from_a_stored_state_has_the_same_bits() {
    for (name, scene) in fast_scenes() {
        let mechanism = compile(&scene);
        let mut problem = Elimination::<0>::new(mechanism.clone());
        let march = |problem: &mut Elimination<0>, state: &mut State, method: &mut Taylor<f64>, until: f64| {
            method.advance(problem, state, Time::from(until), &mut Tally::default(), &mut |_, _| Ok(Seen::Kept)).expect("an end");
        };
        let mut method = on(Kernel::Fastest, 1e-15, 20);
        let mut whole = problem.state(&mechanism.start(&scene));
        march(&mut problem, &mut whole, &mut method, 3.0);
        let mut stored = whole.clone();
        march(&mut problem, &mut whole, &mut method, 7.0);
        march(&mut Elimination::<0>::new(mechanism.clone()), &mut stored, &mut on(Kernel::Fastest, 1e-15, 20), 7.0);
        assert_eq!(whole, stored, "{name}");
    }
}

#[test]
fn energy_stays_at_rounding_for_a_thousand_seconds() {
    for name in ["free", "gentle", "motor"] {
        let scene = shipped(name, &[]);
        let mechanism = compile(&scene);
        let mut kernel = Energies::<DoubleDouble>::new(2, 0);
        let mut balance = |motion: &Motion| (mechanism.energy(&mut kernel, &motion.phi, &motion.omega).total() - motion.work).hi;
        let before = balance(&mechanism.start(&scene));
        let after = balance(&end(&scene, on(Kernel::Fastest, 1e-19, 24), 1000.0));
        let drift = (after - before).abs() / mechanism.energy_scale;
        assert!(drift < 5e-14, "{name}: {drift:e}");
    }
}

#[test]
fn numbers_out_of_range_are_a_typed_stop() {
    let scene = shipped("free", &["start.bar1.omega=1e30"]);
    let mechanism = compile(&scene);
    let mut problem = Elimination::<0>::new(mechanism.clone());
    let mut state = problem.state(&mechanism.start(&scene));
    let stop = on(Kernel::Fastest, 1e-12, 20)
        .advance(&mut problem, &mut state, Time::from(1.0), &mut Tally::default(), &mut |_, _| Ok(Seen::Kept));
    assert!(stop.is_err());
}
