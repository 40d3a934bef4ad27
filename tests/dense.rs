//! The solution inside a step, and what follows from it: output times that have no say in the steps.

use crate::bernoulli::{Bernoulli, exact};
use crate::common;

use common::{compile, order, shipped};
use driftless::arithmetic::DoubleDouble;
use driftless::dynamics::{OdeSystem, State, Time};
use driftless::run::{Limits, MethodId, Outcome, Plan, Request, Run, Stabilization, integrate};
use driftless::scene::Scene;
use driftless::stepping::{Dp5, Dp8, Integrator, Radau, Statistics, Tolerance};

/// The largest error inside one step of `h` from an exact state, over several steps and places in them.
fn inside(method: &mut dyn Integrator<dyn OdeSystem>, h: f64) -> f64 {
    let mut worst = 0.0_f64;
    for begin in [0.2, 0.7, 1.3, 2.1] {
        let mut from = State::new(&[DoubleDouble::from(exact(begin))], 0);
        (from.time, from.memory) = (Time::from(begin), vec![h]);
        let (mut state, until) = (from.clone(), Time::from(begin + h));
        method.begin(&mut Bernoulli { level: None }, &mut state, until).expect("a beginning");
        method
            .step(&mut Bernoulli { level: None }, &mut state, until, &mut Statistics::default())
            .expect("a step");
        assert!((state.time - until).hi.abs() < 1e-15, "one step");
        let mut there = State::default();
        for share in [0.15, 0.4, 0.65, 0.9] {
            let time = Time::from(begin) + share * h;
            method.interpolate(&mut Bernoulli { level: None }, &from, time, &mut there);
            worst = worst.max((there.y[0] - exact(time.hi)).abs());
        }
    }
    worst
}

/// The pairs' own polynomials are of order 4 and 7, those through the stages of Radau IIA of order s: one
/// more in a single step.
#[test]
fn the_solution_inside_a_step_has_the_order_of_its_polynomial() {
    /// A method, its order, and its steps.
    type Case<'a> = (&'a mut dyn Integrator<dyn OdeSystem>, f64, &'a [f64]);
    const LOOSE: Tolerance = Tolerance { relative: 1e6, absolute: 1e6 };
    let radau = |stages, tolerance| Radau::new(stages, tolerance).expect("a method");
    // Newton's iteration of the implicit ones is as exact as their tolerance: a tight one, which a first step
    // proposed below the error keeps.
    let methods: [Case; 3] = [
        (&mut Dp5::new(LOOSE), 5.0, &[0.12, 0.1, 0.08, 0.06, 0.04, 0.03]),
        (&mut Dp8::new(LOOSE), 8.0, &[0.8, 0.6, 0.5, 0.4, 0.3]),
        (&mut radau(3, Tolerance { relative: 1e-7, absolute: 1e-7 }), 4.0, &[0.04, 0.03, 0.02, 0.015, 0.01]),
    ];
    for (method, expected, steps) in methods {
        let points: Vec<(f64, f64)> = steps.iter().map(|&h| (h, inside(method, h))).collect();
        let found = order(&points, 1e-14, 1e-1);
        println!("{} {found:.2} {points:?}", method.name());
        assert!((found - expected).abs() < 0.5, "{}: {found} {points:?}", method.name());
    }
}

/// A run by the program's own loop.
fn run(scene: &Scene, method: MethodId, stabilize: Option<Stabilization>, every: f64) -> Outcome {
    let mechanism = compile(scene);
    let request = Request {
        method: Some(method),
        stabilize,
        until: Some(2.0),
        every: Some(every),
        ..Request::default()
    };
    let plan = Plan::new(scene, &mechanism, &request).expect("a sensible pairing");
    let start = mechanism.start(scene);
    let run = Run::new(mechanism, plan, Limits::default(), &start).expect("a beginning");
    integrate(run, &mut |_| Ok(())).expect("no observer fails")
}

#[test]
fn output_times_change_the_steps_of_no_adaptive_method() {
    let methods = [MethodId::Dp5, MethodId::Dp8, MethodId::Radau(3), MethodId::Radau(5), MethodId::Taylor];
    let scenes = [
        ("free", None),
        ("spring", None),
        ("wall", None),
        ("motor_sine", Some(Stabilization::Projection)),
        ("four_bars", None),
    ];
    for (name, stabilize) in scenes {
        for method in methods {
            let [fine, odd, coarse] =
                [0.01, 0.37, 2.0].map(|every| run(&shipped(name, &[]), method, stabilize, every));
            assert_eq!(fine.stop, None, "{name}, {method}");
            for other in [odd, coarse] {
                assert_eq!(
                    (&fine.last, fine.statistics),
                    (&other.last, other.statistics),
                    "{name}, {method}"
                );
                assert_eq!(fine.impacts, other.impacts, "{name}, {method}");
            }
        }
    }
}
