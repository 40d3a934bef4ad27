//! Small mechanisms with loops: the natural solve inside adaptive methods, and the power series in natural
//! coordinates.
//!
//! Andrews' squeezing mechanism (W. Giles, 1978; D. Manning, 1981) with the data of the Test Set for IVP
//! Solvers; its end state is from an extrapolation method of order 16 in quadruple precision with projection,
//! which agrees with the Test Set's own to the digits that hold there.

use crate::andrews;
use crate::common;
use crate::natural_solve::{accelerations, residual};

use andrews::{error, reference};
use common::started;
use driftless::arithmetic::{Complex, DoubleDouble, Scalar};
use driftless::dynamics::kernel::Kernel as Rows;
use driftless::dynamics::looped::Looped;
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::natural::Natural;
use driftless::dynamics::schur::NEAR;
use driftless::dynamics::{Form, Mechanism, Motion, OdeSystem, State, Time};
use driftless::run::Problem;
use driftless::stabilization::Projected;
use driftless::stepping::composition::Composition;
use driftless::stepping::rattle::Rattle;
use driftless::stepping::taylor::ExpansionKernel;
use driftless::stepping::{Dp8, Integrator, Reached, Seen, Statistics, Taylor, Tolerance};
use std::sync::Arc;

fn both(tolerance: f64) -> Tolerance {
    Tolerance { relative: tolerance, absolute: tolerance }
}

fn taylor(tolerance: f64, kernel: ExpansionKernel) -> Taylor<f64> {
    let mut taylor = Taylor::<f64>::new(both(tolerance));
    taylor.kernel = kernel;
    taylor
}

fn looped(mechanism: &Arc<Mechanism>) -> Looped {
    Looped::new(Arc::clone(mechanism)).expect("a small mechanism with loops")
}

/// The same without its type.
fn problem(mechanism: &Arc<Mechanism>) -> Box<dyn Problem> {
    Box::new(looped(mechanism))
}

/// A run to a time: the motion there, the steps, and the largest violation of a row after any of them,
/// relative to 0.1 m and to 0.1 m times the fastest rate.
fn run<P: Form + ?Sized>(
    problem: &mut P,
    start: &Motion,
    method: &mut dyn Integrator<P>,
    until: f64,
) -> (Motion, Statistics, f64) {
    let mut state = problem.state(start);
    let mut statistics = Statistics::default();
    let mechanism = problem.mechanism().clone();
    let mut kernel = Rows::<f64>::new(&mechanism);
    let (mut motion, mut worst) = (Motion::default(), 0.0f64);
    let reached = method.advance(
        problem,
        &mut state,
        Time::from(until),
        &mut statistics,
        &mut |problem: &mut P, state: &mut State| {
            problem.read(state, &mut motion);
            worst = worst.max(andrews::violation(&mechanism, &mut kernel, &motion));
            Ok(Seen::Kept)
        },
    );
    assert_eq!(reached, Ok(Reached::Until));
    let mut end = Motion::default();
    problem.read(&state, &mut end);
    (end, statistics, worst)
}

fn distance(a: &Motion, b: &Motion) -> f64 {
    let turns = (0..a.phi.len()).map(|k| (a.unwrapped(k) - b.unwrapped(k)).abs());
    let rates = a.omega.iter().zip(&b.omega).map(|(a, b)| (*a - *b).hi.abs());
    turns.chain(rates).fold(0.0, f64::max)
}

/// Along a run, where all rows are kept: accelerations of both forms, the same to rounding, and to the bit
/// without the processor's own instructions.
#[test]
fn the_natural_solve_gives_the_accelerations_of_the_angle_form() {
    for (name, until) in [("andrews", 0.03), ("four_bars", 3.0), ("kite", 0.5), ("slider_crank_torque", 1.0)]
    {
        let (mechanism, start) = started(name);
        let (mut form, mut portable) = (problem(&mechanism), looped(&mechanism).portable());
        let mut angles = Multiplier::<0, true>::new(Arc::clone(&mechanism));
        let mut state = form.state(&start);
        let mut method = Projected::new(Dp8::new(both(1e-9)));
        let (mut worst, mut rates) = (0.0f64, vec![vec![0.0; state.y.len()]; 3]);
        let (mut rows, n) = (Rows::<f64>::new(&mechanism), mechanism.bodies.len());
        let mut statistics = Statistics::default();
        let reached = method.advance(
            &mut *form,
            &mut state,
            Time::from(until),
            &mut statistics,
            &mut |form: &mut (dyn Problem + 'static), state: &mut State| {
                form.rhs(state.time, &state.y, &mut rates[0]);
                angles.rhs(state.time, &state.y, &mut rates[1]);
                portable.rhs(state.time, &state.y, &mut rates[2]);
                assert_eq!(rates[0], rates[2]);
                // Near singular positions both are noise over nothing.
                rows.linearise_at::<0>(&mechanism, state.time, &state.y[..n], &state.y[n..2 * n]);
                if rows.weakest.share < NEAR {
                    return Ok(Seen::Kept);
                }
                let most = rates[1].iter().fold(1.0f64, |most, rate| most.max(rate.abs()));
                worst = rates[0]
                    .iter()
                    .zip(&rates[1])
                    .fold(worst, |worst, (a, b)| worst.max((a - b).abs() / most));
                Ok(Seen::Kept)
            },
        );
        assert_eq!(reached, Ok(Reached::Until), "{name}");
        assert!(worst < 1e-12, "{name}: {worst:e} after {statistics:?}");
    }
}

/// From a little off the rows at both levels: both ways back are the shortest, the same to first order, and
/// both end on the rows.
#[test]
fn projection_in_natural_coordinates_lands_where_that_in_angles_does() {
    for name in ["andrews", "four_bars", "kite", "slider_crank_torque"] {
        let (mechanism, mut start) = started(name);
        let (n, off) = (mechanism.bodies.len(), 1e-6);
        for k in 0..n {
            start.phi[k] += DoubleDouble::of(off * (1.7 * k as f64).cos());
            start.omega[k] += DoubleDouble::of(off * (2.3 * k as f64).sin());
        }
        let angles: &mut dyn Problem = &mut Multiplier::<0, true>::new(Arc::clone(&mechanism));
        let mut ends = [angles.state(&start), angles.state(&start)];
        let method = || Projected::new(Dp8::new(both(1e-9)));
        let (mut statistics, until) = (Statistics::default(), Time::from(1e-9));
        assert_eq!(
            method().advance(angles, &mut ends[0], until, &mut statistics, &mut |_, _| Ok(Seen::Kept)),
            Ok(Reached::Until)
        );
        assert_eq!(
            method().advance(
                &mut *problem(&mechanism),
                &mut ends[1],
                until,
                &mut statistics,
                &mut |_, _| Ok(Seen::Kept)
            ),
            Ok(Reached::Until)
        );
        let moved =
            (0..2 * n).fold(0.0, |most: f64, i| most.max((ends[0].y[i] - angles.state(&start).y[i]).abs()));
        let apart = (0..2 * n).fold(0.0, |most: f64, i| most.max((ends[0].y[i] - ends[1].y[i]).abs()));
        assert!(moved > 0.1 * off && apart < 1e-3 * off, "{name}: {moved:e} {apart:e}");
        let [first, second] = ends.each_ref().map(|end| end.y[2 * n + 1]);
        assert!((first - second).abs() < 1e-3 * off * mechanism.energy_scale, "{name}: {first:e} {second:e}");
        let (mut motion, mut kernel) = (Motion::default(), Rows::<f64>::new(&mechanism));
        for end in &ends {
            angles.read(end, &mut motion);
            let violation = andrews::violation(&mechanism, &mut kernel, &motion);
            assert!(violation < 1e-14, "{name}: {violation:e}");
        }
    }
}

#[test]
fn adaptive_methods_take_the_squeezing_mechanism_to_its_known_end() {
    let (mechanism, start) = started("andrews");
    for (tolerance, bound) in [(1e-9, 1e-8), (1e-13, 1e-11)] {
        let (end, _, residual) =
            run(&mut *problem(&mechanism), &start, &mut Projected::new(Dp8::new(both(tolerance))), 0.03);
        assert!(error(&end) < bound, "{tolerance:e}: {:e}", error(&end));
        assert!(residual < 1e-13, "{residual:e}");
        assert!((end.omega[0].hi - reference()[1][0]).abs() < 1e3 * bound);
    }
}

#[test]
fn the_series_takes_the_squeezing_mechanism_to_its_known_end() {
    let (mechanism, start) = started("andrews");
    for (tolerance, bound) in [(1e-3, 1e-3), (1e-6, 1e-6), (1e-9, 1e-9), (1e-12, 1e-12), (1e-15, 1e-12)] {
        for projected in [false, true] {
            let mut method = taylor(tolerance, ExpansionKernel::Fastest);
            let (end, _, residual) = if projected {
                run(&mut *problem(&mechanism), &start, &mut Projected::new(method), 0.03)
            } else {
                run(&mut *problem(&mechanism), &start, &mut method, 0.03)
            };
            let series = taylor(tolerance, ExpansionKernel::Series);
            let (other, ..) = run(&mut *problem(&mechanism), &start, &mut Projected::new(series), 0.03);
            assert!(error(&end) < bound, "{tolerance:e}: {:e}", error(&end));
            assert!(residual < 1e-13, "{residual:e}");
            assert!((end.work - other.work).hi.abs() < 10.0 * bound, "{:?} {:?}", end.work, other.work);
        }
    }
}

#[test]
fn the_series_has_the_same_bits_without_the_processors_instructions() {
    let (mechanism, start) = started("andrews");
    let end =
        |kernel: ExpansionKernel| run(&mut *problem(&mechanism), &start, &mut taylor(1e-9, kernel), 0.01).0;
    assert_eq!(end(ExpansionKernel::Fastest), end(ExpansionKernel::Portable));
}

/// Times inside a step, with turns: against steps that end there.
#[test]
fn the_series_is_its_own_dense_output() {
    let (mechanism, start) = started("andrews");
    let mut form = problem(&mechanism);
    let mut taylor = Taylor::<f64>::new(both(1e-10));
    let mut state = form.state(&start);
    let (mut from, mut statistics) = (state.clone(), Statistics::default());
    while state.time.hi < 0.02 {
        from.clone_from(&state);
        taylor
            .advance(&mut *form, &mut state, Time::from(0.03), &mut statistics, &mut |_, _| Ok(Seen::Enough))
            .expect("a step");
    }
    let middle = from.time + 0.4 * (state.time - from.time).hi;
    let mut inside = State::default();
    taylor.interpolate(&mut *form, &from, middle, &mut inside);
    let mut found = Motion::default();
    form.read(&inside, &mut found);
    let (exact, ..) = run(&mut *problem(&mechanism), &start, &mut Taylor::<f64>::new(both(1e-10)), middle.hi);
    assert!(distance(&found, &exact) < 1e-7, "{:e}", distance(&found, &exact));
    assert!(found.unwrapped(0) > 7.0);
}

/// Order by order; a composition of order 8 is at rounding with the finest of these steps.
#[test]
fn rattle_has_its_order_on_a_mechanism_with_loops() {
    let (mechanism, start) = started("andrews");
    let natural = || Natural::new(Arc::clone(&mechanism)).expect("a natural form");
    for (composition, coarsest) in [
        (Composition::Single, 2000.0),
        (Composition::Suzuki5, 500.0),
        (Composition::KahanLi9, 300.0),
        (Composition::KahanLi17, 150.0),
    ] {
        let points: Vec<(f64, f64)> = [1.0, 1.5, 2.0, 3.0]
            .iter()
            .map(|finer| {
                let h = 0.03 / (coarsest * finer);
                let (end, _, residual) = run(&mut natural(), &start, &mut Rattle::new(composition, h), 0.03);
                assert!(residual < 1e-13, "{composition:?}: {residual:e}");
                (h, error(&end))
            })
            .collect();
        let order = common::order(&points, 1e-14, 1.0);
        assert!(
            (order - f64::from(composition.order())).abs() < 0.35,
            "{composition:?} measured {order}: {points:?}"
        );
    }
}

/// Motors, slots and sliders: the work of the motor is known from p_t, and energy less work keeps.
#[test]
fn rattle_keeps_energy_less_work_of_driven_mechanisms() {
    for (name, until, step) in [
        ("quick_return", 4.0, 1.0 / 1024.0),
        ("slider_crank_driven", 2.0, 1.0 / 4096.0),
        ("four_bar_motor", 4.0, 1.0 / 1024.0),
    ] {
        let (mechanism, start) = started(name);
        let Ok(mut natural) = Natural::new(Arc::clone(&mechanism)) else {
            panic!("{name} has no natural form")
        };
        let mut kernel = Rows::without_rows(&mechanism);
        let mut balance = |motion: &Motion| {
            (mechanism.energy(&mut kernel, &motion.phi, &motion.omega).total() - motion.work).hi
                / mechanism.energy_scale
        };
        let before = balance(&start);
        let mut state = natural.state(&start);
        let mut worst = 0.0f64;
        let mut method = Rattle::new(Composition::Suzuki5, step);
        let mut motion = Motion::default();
        let reached = method.advance(
            &mut natural,
            &mut state,
            Time::from(until),
            &mut Statistics::default(),
            &mut |natural: &mut Natural, state: &mut State| {
                natural.read(state, &mut motion);
                worst = worst.max((balance(&motion) - before).abs());
                let [position, velocity] = residual(natural, state);
                assert!(position < 1e-14 && velocity < 1e-11, "{position:e} {velocity:e}");
                Ok(Seen::Kept)
            },
        );
        assert_eq!(reached, Ok(Reached::Until), "{name}");
        assert!(worst < 1e-6, "{name}: {worst:e}");
        let field: &mut dyn Problem = &mut Multiplier::<0, true>::new(Arc::clone(&mechanism));
        let (other, ..) = {
            let mut state = field.state(&start);
            let reached = Projected::new(Dp8::new(both(1e-11))).advance(
                field,
                &mut state,
                Time::from(until),
                &mut Statistics::default(),
                &mut |_, _| Ok(Seen::Kept),
            );
            assert_eq!(reached, Ok(Reached::Until), "{name}");
            let mut motion = Motion::default();
            field.read(&state, &mut motion);
            (motion,)
        };
        natural.read(&state, &mut motion);
        assert!(distance(&motion, &other) < 1e-5, "{name}: {:e}", distance(&motion, &other));
        assert!((motion.work - other.work).hi.abs() < 1e-6 * mechanism.energy_scale.max(1.0), "{name}");
    }
}

/// A mechanism that does not fit is left to the angle form.
#[test]
fn what_does_not_fit_is_left_to_the_angle_form() {
    for name in ["free", "motor", "quick_return", "cart_pole", "wall"] {
        assert!(Looped::new(started(name).0).is_none(), "{name}");
    }
    let (mechanism, start) = started("andrews");
    let z: Vec<Complex<f64>> = start.phi.iter().map(|phi| Complex::unit(phi.hi)).collect();
    let natural = Natural::new(mechanism).expect("a natural form");
    // The published accelerations of the crank and the coupler, and the first two multipliers.
    let (acceleration, multiplier) =
        accelerations(&natural, Time::default(), (&z, &[0; 7]), &[Complex::ZERO; 7]);
    assert!((z[0].cross(acceleration[0]) - 14_222.443_919_954_114).abs() < 1e-7);
    assert!((z[1].cross(acceleration[1]) - (14_222.443_919_954_114 - 10_666.832_939_965_545)).abs() < 1e-7);
    assert_eq!(multiplier.len(), 6);
}
