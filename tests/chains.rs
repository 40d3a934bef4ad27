//! The equations body by body: against the matrices on random mechanisms, and on chains too long for
//! matrices.

#[allow(dead_code)]
#[path = "../examples/chain.rs"]
mod hanging;
use crate::trees;

use driftless::arithmetic::{Complex, DoubleDouble, Real, Scalar};
use driftless::dynamics::constraint::{line_equation, slot_equation};
use driftless::dynamics::kernel::{Bias, Kernel};
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::series::{Coefficient, Series};
use driftless::dynamics::{Coordinates, Form, Mechanism, OdeSystem, Time};
use driftless::run::{MethodId, Plan, Request, Stabilization, simulate};

use driftless::scene::{Force, Given, Place, Scene, Start, Torque, TorsionSpring};
use driftless::stabilization::projection::project;
use proptest::prelude::*;
use std::sync::Arc;
use trees::{Dice, tree};

/// Whole multiples of 1/256, so that masses times squares of lengths are exact and both forms have the same
/// constants.
fn shorten(scene: &mut Scene) {
    let short = |x: &mut f64| *x = (*x * 256.0).round() / 256.0;
    scene.gravity.iter_mut().for_each(short);
    for bar in &mut scene.bars {
        bar.centre.iter_mut().for_each(short);
        short(&mut bar.mass);
        short(&mut bar.inertia);
    }
    let hinges = scene.hinges.iter_mut().flat_map(|hinge| &mut hinge.between);
    let springs = scene.springs.iter_mut().flat_map(|spring| &mut spring.between);
    hinges.chain(springs).for_each(|place| place.point.iter_mut().for_each(short));
}

/// A tree, or two of which one hangs on nothing, with motors and loads where the dice say so, then loops,
/// rails and slots.
///
/// The rows are added to the compiled mechanism, whose start need not close them.
fn mechanism(n: usize, seed: u64) -> (Scene, Mechanism) {
    let mut dice = Dice::new(seed);
    let motors = dice.pick(2) == 1;
    let mut scene = tree(n, motors, &mut dice);
    if dice.pick(2) == 1 && !motors {
        let cut = scene.hinges.remove(dice.pick(n));
        scene.given = vec![Given { phi: true, omega: true, origin: None, velocity: None }; n];
        for place in cut.between {
            if let Some(bar) = place.bar {
                (scene.given[bar].origin, scene.given[bar].velocity) =
                    (Some([0.5, -0.25]), Some([0.75, 1.0]));
                break;
            }
        }
    }
    let point = |dice: &mut Dice| [dice.within(-0.5, 0.5), dice.within(-0.5, 0.5)];
    let body = |dice: &mut Dice| Some(dice.pick(n + 1)).filter(|&bar| bar < n);
    if dice.pick(2) == 1 {
        let relative_to = body(&mut dice).filter(|&bar| bar != 0);
        scene.torsion_springs.push(TorsionSpring {
            name: "coil".into(),
            bar: 0,
            relative_to,
            stiffness: 2.0,
            free_angle: 0.5,
            damping: 0.25,
        });
        scene.forces.push(Force {
            name: "f".into(),
            bar: n - 1,
            point: point(&mut dice),
            force: [1.0, -2.0],
            follows: true,
            law: None,
        });
        scene.torques.push(Torque { name: "m".into(), bar: 0, relative_to, torque: 0.75, law: None });
    }
    shorten(&mut scene);
    // A tree cut in two may leave a part that nothing was given of.
    let Ok(mut mechanism) = Mechanism::new(&scene) else {
        return self::mechanism(n, seed.wrapping_add(0x1234_5678));
    };
    let site = |mechanism: &Mechanism, bar: Option<usize>, point: [f64; 2]| {
        let point = point.map(|x| (x * 256.0).round() / 256.0);
        mechanism.forest.site(&Place { bar, point })
    };
    let free = |mechanism: &Mechanism| mechanism.coordinates() > mechanism.constraints.len() + 2;
    for k in 0..dice.pick(3) {
        let (bar, rail) = (dice.pick(n), body(&mut dice));
        let (at, on) = (point(&mut dice), point(&mut dice));
        if rail != Some(bar) && free(&mechanism) {
            let (at, on) = (site(&mechanism, Some(bar), at), site(&mechanism, rail, on));
            let (name, direction) = (format!("slider{k}"), Complex::new(0.6, 0.8));
            mechanism.constraints.push(match rail {
                Some(rail) => slot_equation(&name, &at, rail, &on, direction, None, n),
                None => line_equation(&name, &at, direction, 0.25, None, n),
            });
        }
    }
    for k in 0..dice.pick(3) {
        let (a, b) = (dice.pick(n), body(&mut dice));
        let (at, on) = (point(&mut dice), point(&mut dice));
        if b != Some(a) && free(&mechanism) {
            let (at, on) = (site(&mechanism, Some(a), at), site(&mechanism, b, on));
            mechanism = mechanism.pinned(&format!("loop{k}"), &at, &on);
        }
    }
    (scene, mechanism)
}

/// The kernel after an evaluation.
fn evaluate<T: Real>(mechanism: &Mechanism, phi: &[T], omega: &[T], bias: Bias) -> Kernel<T> {
    let mut kernel = Kernel::new(mechanism);
    kernel.accelerate::<0>(mechanism, Time::from(0.375), phi, omega, bias);
    kernel
}

/// The largest difference, over the largest number or one.
fn difference<T: Real>(found: &[T], expected: &[T]) -> f64 {
    let largest = expected.iter().fold(1.0, |most: f64, x| most.max(x.value().abs()));
    found.iter().zip(expected).fold(0.0, |most: f64, (&a, &b)| most.max((a - b).value().abs() / largest))
}

/// Both forms in double-double and the recursive one in double: differences of accelerations and multipliers,
/// and the pivots' smallest share.
fn compare((scene, mechanism): &(Scene, Mechanism)) -> Option<([f64; 4], usize)> {
    let (dense, bodywise) = (mechanism.by_matrices()?, mechanism.body_by_body());
    let start = mechanism.start(scene);
    let bias = Bias { rate: 3.0, position: 5.0 };
    let exact = evaluate(&dense, &start.phi, &start.omega, bias);
    // Rows that depend on one another, or nearly so, are a question of their own.
    if exact.weakest.share < 1e-4 {
        return None;
    }
    let fine = evaluate(&bodywise, &start.phi, &start.omega, bias);
    let plain = |x: &[DoubleDouble]| x.iter().map(|x| x.hi).collect::<Vec<_>>();
    let coarse = evaluate(&bodywise, &plain(&start.phi), &plain(&start.omega), bias);
    let corrections = difference(&fine.correction, &exact.correction);
    Some((
        [
            difference(&fine.load, &exact.load),
            difference(&fine.multiplier, &exact.multiplier).max(corrections),
            difference(&coarse.load, &plain(&exact.load)),
            difference(&coarse.multiplier, &plain(&exact.multiplier)),
        ],
        mechanism.constraints.len(),
    ))
}

proptest! {
    /// Trees of all shapes, bodies that hang on nothing, loops, sliders and slots, motors and every load.
    #[test]
    fn accelerations_and_multipliers_are_those_of_the_matrices(n in 1..=9usize, seed in any::<u64>()) {
        if let Some(([fine, fine_rows, coarse, coarse_rows], _)) = compare(&mechanism(n, seed)) {
            prop_assert!(fine < 1e-25 && fine_rows < 1e-25, "{fine:e} {fine_rows:e}");
            prop_assert!(coarse < 1e-8 && coarse_rows < 1e-8, "{coarse:e} {coarse_rows:e}");
        }
    }
}

#[test]
fn the_random_mechanisms_have_rows_and_differ_by_rounding() {
    let (mut rows, mut compared, mut worst) = (0, 0, [0.0_f64; 4]);
    for seed in 0..300 {
        let Some((found, r)) = compare(&mechanism(3 + seed as usize % 12, seed)) else { continue };
        rows += r;
        compared += 1;
        for (worst, found) in worst.iter_mut().zip(found) {
            *worst = worst.max(found);
        }
    }
    assert!(compared > 200 && rows > 300, "{compared} {rows}");
    assert!(worst[0] < 1e-26 && worst[1] < 1e-26 && worst[2] < 1e-9 && worst[3] < 1e-9, "{worst:?}");
}

/// The power series of a mechanism at a start: rates, elements, multipliers and power, power by power.
fn expand<T: Coefficient>(mechanism: &Mechanism, scene: &Scene, order: usize) -> Vec<Vec<T>> {
    let (start, n) = (mechanism.start(scene), mechanism.coordinates());
    let round = |x: &[DoubleDouble]| x.iter().map(|&x| T::split(x).0).collect::<Vec<_>>();
    let mut series = Series::<T>::new(mechanism, Coordinates::All, order);
    series.expand(mechanism, Time::from(0.375), &round(&start.phi), &vec![T::ZERO; n], &round(&start.omega));
    (0..order)
        .map(|m| {
            let elements = series.z[(m + 2) * n..(m + 3) * n].iter().flat_map(|z| [z.re, z.im]);
            let rates = &series.rate[(m + 1) * n..(m + 2) * n];
            elements
                .chain(rates.iter().chain(series.multipliers(m)).copied())
                .chain([series.power[m]])
                .collect()
        })
        .collect()
}

/// The largest difference of any power, over the largest number of that power.
fn part<T: Real>(found: &[Vec<T>], expected: &[Vec<T>]) -> f64 {
    let of_power = |(found, expected): (&Vec<T>, &Vec<T>)| {
        let largest = expected.iter().fold(1e-3, |most: f64, x| most.max(x.value().abs()));
        found.iter().zip(expected).fold(0.0, |most: f64, (&a, &b)| most.max((a - b).value().abs() / largest))
    };
    found.iter().zip(expected).map(of_power).fold(0.0, f64::max)
}

/// With every kind of row and load, translational coordinates, and more and fewer bodies than lanes: in
/// double-double the same to its rounding, in double to that.
#[test]
fn series_body_by_body_are_those_of_the_matrices() {
    let (mut compared, mut rows, mut worst) = (0, 0, [0.0_f64; 2]);
    for seed in 0..200 {
        let (scene, mechanism) = mechanism(2 + seed as usize % 13, seed);
        let (Some(dense), bodywise) = (mechanism.by_matrices(), mechanism.body_by_body()) else { continue };
        let start = mechanism.start(&scene);
        if evaluate(&dense, &start.phi, &start.omega, Bias::default()).weakest.share < 1e-3 {
            continue;
        }
        compared += 1;
        rows += mechanism.constraints.len();
        let exact = expand::<DoubleDouble>(&dense, &scene, 9);
        worst[0] = worst[0].max(part(&expand::<DoubleDouble>(&bodywise, &scene, 9), &exact));
        let plain: Vec<Vec<f64>> = exact.iter().map(|power| power.iter().map(|x| x.hi).collect()).collect();
        worst[1] = worst[1].max(part(&expand::<f64>(&bodywise, &scene, 9), &plain));
    }
    assert!(compared > 100 && rows > 100, "{compared} {rows}");
    assert!(worst[0] < 1e-24 && worst[1] < 1e-8, "{worst:?}");
}

/// A chain of `n` links, bent and in motion.
fn chain(n: usize) -> Scene {
    let start = (0..n)
        .map(|k| Start { phi: (0.03 * k as f64).sin(), omega: 2.0 * (0.07 * k as f64).cos() })
        .collect();
    Scene { start, until: 0.01, every: 0.01, ..hanging::chain(n, 0.0) }
}

/// Moments about every centre of mass and forces on it, from the hinge forces and accelerations found.
#[test]
fn every_link_of_a_very_long_chain_is_in_balance() {
    let n = 10_000;
    let scene = chain(n);
    let mechanism = Mechanism::new(&scene).expect("equations");
    assert!(mechanism.by_matrices().is_none());
    let start = mechanism.start(&scene);
    let plain = |x: &[DoubleDouble]| x.iter().map(|x| x.hi).collect::<Vec<_>>();
    let (phi, omega) = (plain(&start.phi), plain(&start.omega));
    let kernel = evaluate(&mechanism, &phi, &omega, Bias::default());
    assert!(kernel.load.iter().all(|alpha| alpha.is_finite()));
    let forces = mechanism.hinge_forces(start.time, &kernel, &phi, &omega);
    let largest = forces.iter().fold(0.0, |most: f64, force| most.max(force.norm_squared().sqrt()));
    let mut worst = 0.0_f64;
    for (k, body) in mechanism.bodies.iter().enumerate() {
        let half = kernel.z[k].times(body.centre.re);
        let beyond = forces.get(k + 1).copied().unwrap_or(Complex::ZERO);
        let moment = (-half).cross(forces[k]) - half.cross(beyond);
        worst = worst.max((body.inertia * kernel.load[k] - moment).abs() / (largest * body.centre.re));
    }
    // Each force is a sum over what hangs below.
    assert!(worst < 1e-11, "{worst:e}");
}

/// What a hinge carries is what the two rows of a pin in its place do.
#[test]
fn hinge_forces_are_the_multipliers_of_pins() {
    let mut scene = chain(12);
    let hung = Mechanism::new(&scene).expect("equations").body_by_body();
    // The lower half hangs on nothing but a loop's rows: its first link comes before the hinge that would
    // carry it.
    let cut = 6;
    let between = scene.hinges[cut].between;
    scene.hinges.remove(cut);
    scene.given = vec![Given { phi: true, omega: true, origin: None, velocity: None }; 12];
    (scene.given[cut].origin, scene.given[cut].velocity) = (Some([0.5, 0.0]), Some([0.0, 0.0]));
    let start = hung.start(&scene);
    let plain = |x: &[DoubleDouble]| x.iter().map(|x| x.hi).collect::<Vec<_>>();
    let kernel = evaluate(&hung, &plain(&start.phi), &plain(&start.omega), Bias::default());
    let carried = hung.hinge_forces(start.time, &kernel, &plain(&start.phi), &plain(&start.omega))[cut];
    let loose = Mechanism::new(&scene).expect("equations");
    let sites = between.map(|place| loose.forest.site(&place));
    let pinned = loose.pinned("cut", &sites[0], &sites[1]).body_by_body();
    let (n, x) = (pinned.coordinates(), pinned.bodies.len());
    assert_eq!((n, pinned.constraints.len()), (14, 2));
    let (mut phi, mut omega) = (plain(&start.phi), plain(&start.omega));
    // The origin is where the link above ends, and moves with it.
    let above = &sites[0].point;
    phi.resize(n, 0.0);
    omega.resize(n, 0.0);
    let (at, speed) = (above.position(&kernel.z), above.velocity(&kernel.z, &omega));
    (phi[x], phi[x + 1], omega[x], omega[x + 1]) = (at.re, at.im, speed.re, speed.im);
    let again = evaluate(&pinned, &phi, &omega, Bias::default());
    assert!(difference(&again.load[..12], &kernel.load) < 1e-12);
    assert!((carried - Complex::new(again.multiplier[0], again.multiplier[1])).norm_squared().sqrt() < 1e-12);
}

/// dE/dt is the power of nothing at all, and E - W stands still where motors work.
#[test]
fn the_power_of_a_form_is_the_rate_of_its_energy() {
    for seed in 0..40 {
        let (scene, mechanism) = mechanism(4 + seed as usize % 5, seed);
        let mechanism = Arc::new(mechanism.body_by_body());
        let start = mechanism.start(&scene);
        if evaluate(&mechanism, &start.phi, &start.omega, Bias::default()).weakest.share < 1e-3
            || mechanism.has_closed_loops()
        {
            continue;
        }
        let mut form = Multiplier::<0, true>::new(Arc::clone(&mechanism));
        let state = form.state(&start);
        let mut rate = vec![0.0; form.dimension()];
        form.rhs(Time::default(), &state.y, &mut rate);
        let n = mechanism.coordinates();
        let mut kernel = Kernel::<DoubleDouble>::without_rows(&mechanism);
        let h = DoubleDouble::of(1e-9);
        let mut at = |sign: f64| {
            let moved: Vec<DoubleDouble> =
                (0..2 * n).map(|i| state.unknown(i) + h.scale(sign * rate[i])).collect();
            mechanism.energy(&mut kernel, &moved[..n], &moved[n..]).total()
        };
        let power = ((at(1.0) - at(-1.0)) / h).scale(0.5).hi;
        // A motor off its law does work by its row's own rate; the account takes it as it is.
        assert!((power - rate[2 * n]).abs() < 1e-9 * power.abs().max(1.0), "{seed}: {power} {}", rate[2 * n]);
    }
}

#[test]
fn projection_lands_where_the_matrices_put_it() {
    let mut seen = 0;
    for seed in 0..300 {
        let (scene, mechanism) = mechanism(5 + seed as usize % 5, seed);
        let (Some(dense), bodywise) = (mechanism.by_matrices(), mechanism.body_by_body()) else { continue };
        let start = mechanism.start(&scene);
        if evaluate(&bodywise, &start.phi, &start.omega, Bias::default()).weakest.share < 1e-2 {
            continue;
        }
        let mut ends = [dense, bodywise].map(|mechanism| {
            let mechanism = Arc::new(mechanism);
            let mut state = Multiplier::<0, true>::new(Arc::clone(&mechanism)).state(&start);
            let ended = project(&mechanism, &mut Kernel::new(&mechanism), &mut state, 1e-12);
            ended.is_ok().then_some(state.y)
        });
        let [Some(dense), Some(bodywise)] = &mut ends else { continue };
        seen += usize::from(!mechanism.constraints.is_empty());
        // Energies put in by the stabilizer are sums of large numbers.
        dense.pop();
        bodywise.pop();

        assert!(difference(bodywise, dense) < 1e-8, "{seed}: {:e}", difference(bodywise, dense));
    }
    assert!(seen > 10, "{seen}");
}

#[test]
fn a_very_long_chain_runs_and_says_what_it_does_not_take() {
    let scene = Scene { until: 1e-5, every: 1e-5, ..chain(3_000) };
    let request = Request { method: Some(MethodId::Dop853), rtol: Some(1e-6), ..Request::default() };
    let outcome = simulate(&scene, &request, &mut |_| Ok(())).expect("a run");
    assert!(outcome.drift.energy.max < 1e-9, "{:e}", outcome.drift.energy.max);
    let mechanism = Mechanism::new(&scene).expect("equations");
    for method in [MethodId::Taylor, MethodId::Gauss(4)] {
        let refusal = Plan::new(&scene, &mechanism, &Request { method: Some(method), ..Request::default() })
            .expect_err("too large");
        assert!(
            refusal.to_string().contains("3000 coordinates") && refusal.alternative.contains("dop853"),
            "{refusal}"
        );
    }
    let plan = Plan::new(&scene, &mechanism, &Request::default()).expect("a plan");
    assert_eq!((plan.method, plan.stabilization), (MethodId::Dop853, Stabilization::None));
    // Where there are matrices the series does without them, too, and takes fewer steps.
    for n in [20, 200] {
        let scene = chain(n);
        let plan = Plan::new(&scene, &Mechanism::new(&scene).expect("equations"), &Request::default())
            .expect("a plan");
        assert_eq!(plan.method, MethodId::Taylor);
    }
}
