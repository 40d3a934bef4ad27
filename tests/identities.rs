//! Identities of the equations of motion on random trees: one to six bodies, branches, off-axis centres and
//! hinges, springs, dampers, motors.

use crate::common;
use crate::trees;

use driftless::arithmetic::{Complex, DoubleDouble, Scalar};
use driftless::dynamics::canonical::Canonical;
use driftless::dynamics::elimination::Elimination;
use driftless::dynamics::kernel::{Bias, Kernel};
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::{Form, Mechanism, Motion, OdeSystem, State, Time, tree};
use driftless::run::{Plan, Request};
use driftless::scene::Scene;
use proptest::prelude::*;
use std::sync::Arc;
use trees::{any_tree, redundant};

/// Rounding of an evaluation, against the largest number in it; the worst of these trees has a mass matrix of
/// condition 1e4.
const ROUNDING: f64 = 1e-11;

/// The scene's equations and a time to look at them.
fn at_a_time(scene: &Scene) -> (Arc<Mechanism>, Time) {
    (common::compile(scene), Time::from(0.37))
}

/// A motion at time `t` that fulfils every motor: the independent angles and rates are the scene's, the
/// others follow from the laws.
fn consistent(scene: &Scene, mechanism: &Arc<Mechanism>, t: Time) -> Motion {
    let free = &mechanism.partition.independent;
    let mut unknowns: Vec<DoubleDouble> =
        free.iter().map(|&k| DoubleDouble::from(scene.start[k].phi)).collect();
    unknowns.extend(free.iter().map(|&k| DoubleDouble::from(scene.start[k].omega)));
    unknowns.push(DoubleDouble::ZERO);
    let mut state = State::new(&unknowns, free.len());
    state.time = t;
    let mut motion = Motion::default();
    Elimination::<0>::new(Arc::clone(mechanism)).read(&state, &mut motion);
    motion
}

fn plain(numbers: &[DoubleDouble]) -> Vec<f64> {
    numbers.iter().map(|x| x.hi).collect()
}

fn largest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    numbers.into_iter().fold(1.0, |most: f64, x| most.max(x.abs()))
}

/// The f64 kernel after an evaluation at a motion.
fn evaluate(mechanism: &Mechanism, motion: &Motion) -> Kernel<f64> {
    let mut kernel = Kernel::new(mechanism);
    kernel.accelerations(mechanism, motion.time, &plain(&motion.phi), &plain(&motion.omega), Bias::default());
    kernel
}

/// The same in double-double.
fn evaluate_exactly(mechanism: &Mechanism, motion: &Motion) -> Kernel<DoubleDouble> {
    let mut kernel = Kernel::new(mechanism);
    kernel.accelerate::<0>(mechanism, motion.time, &motion.phi, &motion.omega, Bias::default());
    kernel
}

/// The motion `dt` later to second order in the angles and first in the rates, which is all a central
/// difference sees.
fn moved(motion: &Motion, alpha: &[DoubleDouble], power: f64, dt: f64) -> Motion {
    let mut later = motion.clone();
    let dt = DoubleDouble::from(dt);
    later.time = motion.time + dt;
    for (k, &alpha) in alpha.iter().enumerate() {
        later.phi[k] = motion.phi[k] + motion.omega[k] * dt + (alpha * dt * dt).scale(0.5);
        later.omega[k] = motion.omega[k] + alpha * dt;
    }
    later.work = motion.work + dt.scale(power);
    later
}

/// y' of a form at a motion.
fn rate_of<F: OdeSystem + Form>(form: &mut F, motion: &Motion) -> Vec<f64> {
    let state = form.state(motion);
    let mut rate = vec![0.0; form.dimension()];
    form.rhs(state.time, &state.y, &mut rate);
    rate
}

/// y' of the multiplier form, the elimination form and the canonical form for `N` bodies.
fn rates<const N: usize>(mechanism: &Arc<Mechanism>, motion: &Motion) -> [Vec<f64>; 3] {
    let accounts = !mechanism.constraints.is_empty() || mechanism.is_damped();
    let shared = || Arc::clone(mechanism);
    [
        if accounts {
            rate_of(&mut Multiplier::<N, true>::new(shared()), motion)
        } else {
            rate_of(&mut Multiplier::<N, false>::new(shared()), motion)
        },
        rate_of(&mut Elimination::<N>::new(shared()), motion),
        if accounts {
            rate_of(&mut Canonical::<N, true>::new(shared()), motion)
        } else {
            rate_of(&mut Canonical::<N, false>::new(shared()), motion)
        },
    ]
}

/// The canonical form's rates against differences of its state along the multiplier form's motion.
fn check_canonical<const WORK: bool>(
    mechanism: &Arc<Mechanism>,
    motion: &Motion,
    alpha: &[DoubleDouble],
    power: f64,
) -> Result<(), TestCaseError> {
    const DT: f64 = 1e-8;
    let mut form = Canonical::<0, WORK>::new(Arc::clone(mechanism));
    let (before, after) =
        (form.state(&moved(motion, alpha, power, -DT)), form.state(&moved(motion, alpha, power, DT)));
    let rate = rate_of(&mut form, motion);
    let scale = largest(rate.iter().copied());
    for (i, &rate) in rate.iter().enumerate().skip(mechanism.partition.count()) {
        let difference = ((after.unknown(i) - before.unknown(i)) / DoubleDouble::from(2.0 * DT)).hi;
        prop_assert!(
            (difference - rate).abs() < 1e-9 * scale,
            "{}: {difference} is not {rate}",
            form.label(i)
        );
    }
    for (i, &body) in mechanism.partition.independent.iter().enumerate() {
        prop_assert!((rate[i] - motion.omega[body].hi).abs() < ROUNDING * scale, "{}", form.label(i));
    }
    // And back: the state stands for the very motion it was made from.
    let mut again = Motion::default();
    form.read(&form.state(motion), &mut again);
    for k in 0..alpha.len() {
        prop_assert!((again.phi[k] - motion.phi[k]).hi.abs() < 1e-25 && again.turns[k] == motion.turns[k]);
        prop_assert!((again.omega[k] - motion.omega[k]).hi.abs() < 1e-25 * scale);
    }
    prop_assert!((again.work - motion.work).hi.abs() < 1e-25 * scale);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_mass_matrix_is_that_of_the_kinetic_energy_and_positive((scene, _) in any_tree(false)) {
        let (mechanism, _) = at_a_time(&scene);
        let n = mechanism.bodies.len();
        let motion = mechanism.start(&scene);
        let (phi, omega) = (plain(&motion.phi), plain(&motion.omega));
        let mut kernel = Kernel::<f64>::without_rows(&mechanism);
        let energy = mechanism.energy(&mut kernel, &phi, &omega);
        let other = redundant(&scene, 0.0, &phi, &omega);
        prop_assert!((energy.kinetic - other.kinetic).abs() < ROUNDING * largest([other.kinetic]));
        prop_assert!((energy.potential - other.potential).abs() < ROUNDING * largest([other.potential]));
        let bodywise: f64 = mechanism.bodies.iter().enumerate().map(|(k, body)| {
            0.5 * body.mass * mechanism.centre(k).velocity(&kernel.z, &omega).norm_squared() + 0.5 * body.inertia * omega[k] * omega[k]
        }).sum();
        prop_assert!((energy.kinetic - bodywise).abs() < ROUNDING * largest([bodywise]));
        // Entry by entry from the velocities that unit rates make; the other triangle is the mirror image by
        // construction.
        for i in 0..n {
            for j in i..n {
                let unit = |k: usize| { let mut rates = vec![0.0; n]; rates[k] = 1.0; rates };
                let entry: f64 = mechanism.bodies.iter().enumerate().map(|(k, body)| {
                    body.mass * mechanism.centre(k).velocity(&kernel.z, &unit(i)).dot(mechanism.centre(k).velocity(&kernel.z, &unit(j)))
                }).sum();
                let expected = entry + if i == j { mechanism.bodies[i].inertia } else { 0.0 };
                prop_assert!((kernel.mass[i * n + j] - expected).abs() < ROUNDING);
            }
        }
        tree::factor::<f64, 0>(n, &mut kernel.mass, &mut kernel.pivot);
        prop_assert!(kernel.pivot.iter().all(|&pivot| pivot > 0.0 && pivot.is_finite()));
    }

    #[test]
    fn accelerations_multipliers_and_hinge_forces_are_those_of_the_pinned_form((scene, seed) in any_tree(true), motors in any::<bool>()) {
        let scene = if motors { scene } else { Scene { motors: vec![], ..scene } };
        let (mechanism, t) = at_a_time(&scene);
        let motion = consistent(&scene, &mechanism, t);
        let (phi, omega) = (plain(&motion.phi), plain(&motion.omega));
        let kernel = evaluate(&mechanism, &motion);
        let other = redundant(&scene, t.hi, &phi, &omega);
        let forces = mechanism.hinge_forces(motion.time, &kernel, &phi, &omega);
        let scale = largest(other.alpha.iter().chain(&other.motors).copied().chain(other.hinges.iter().flat_map(|f| [f.re, f.im])));
        let close = |a: f64, b: f64| (a - b).abs() < 1e-10 * scale;
        for k in 0..mechanism.bodies.len() {
            prop_assert!(close(kernel.load[k], other.alpha[k]), "seed {seed}: alpha {k}: {} is not {}", kernel.load[k], other.alpha[k]);
            let apart: Complex<f64> = mechanism.centre(k).acceleration(&kernel.z, &omega, &kernel.load) - other.centre[k];
            prop_assert!(close(apart.re, 0.0) && close(apart.im, 0.0), "seed {seed}: centre {k}");
        }
        for (found, expected) in kernel.multiplier.iter().zip(&other.motors) {
            prop_assert!(close(*found, *expected), "seed {seed}: multiplier {found} is not {expected}");
        }
        for (found, expected) in forces.iter().zip(&other.hinges) {
            prop_assert!(close(found.re, expected.re) && close(found.im, expected.im), "seed {seed}: hinge {found:?} is not {expected:?}");
        }
    }

    #[test]
    fn energy_changes_by_the_power_of_motors_and_dampers((scene, _) in any_tree(true)) {
        const DT: f64 = 1e-8;
        let (mechanism, t) = at_a_time(&scene);
        let motion = consistent(&scene, &mechanism, t);
        let exact = evaluate_exactly(&mechanism, &motion);
        let mut scratch = Kernel::<DoubleDouble>::without_rows(&mechanism);
        let mut energy = |dt: f64| {
            let motion = moved(&motion, &exact.load, 0.0, dt);
            mechanism.energy(&mut scratch, &motion.phi, &motion.omega).total()
        };
        let change = ((energy(DT) - energy(-DT)) / DoubleDouble::from(2.0 * DT)).hi;
        // A motor's power is its torque, minus the multiplier, times the rate its law asks for.
        let motors: f64 = mechanism.constraints.iter().zip(&exact.multiplier).map(|(row, multiplier)| {
            row.law.as_ref().map_or(0.0, |law| -multiplier.hi * law.at::<f64>(t).rate)
        }).sum();
        let dampers: f64 = mechanism.springs.iter().map(|spring| spring.drag_power(&exact.z, &motion.omega).hi).sum();
        prop_assert!(dampers <= 0.0);
        let scale = largest([change, motors, dampers]);
        prop_assert!((change - motors - dampers).abs() < 1e-9 * scale, "{change} is not {motors} + {dampers}");
        let [multiplier, elimination, _] = rates::<0>(&mechanism, &motion);
        let n = mechanism.bodies.len();
        prop_assert!((multiplier[2 * n] - change).abs() < 1e-9 * scale);
        prop_assert!((elimination[elimination.len() - 1] - change).abs() < 1e-9 * scale);
        prop_assert_eq!(multiplier[2 * n + 1], 0.0);
    }

    #[test]
    fn elimination_gives_the_accelerations_of_the_multiplier_form((scene, seed) in any_tree(true)) {
        let (mechanism, t) = at_a_time(&scene);
        let motion = consistent(&scene, &mechanism, t);
        let kernel = evaluate(&mechanism, &motion);
        let [_, elimination, _] = rates::<0>(&mechanism, &motion);
        let scale = largest(kernel.load.iter().copied());
        let f = mechanism.partition.count();
        for (i, &body) in mechanism.partition.independent.iter().enumerate() {
            prop_assert!((elimination[f + i] - kernel.load[body]).abs() < ROUNDING * scale, "seed {seed}");
        }
    }

    #[test]
    fn the_canonical_form_moves_as_the_multiplier_form((scene, _) in any_tree(true), motors in any::<bool>(), dampers in any::<bool>()) {
        let mut scene = if motors { scene } else { Scene { motors: vec![], ..scene } };
        if !dampers {
            scene.springs.iter_mut().for_each(|spring| spring.damping = 0.0);
        }
        let (mechanism, t) = at_a_time(&scene);
        let motion = consistent(&scene, &mechanism, t);
        let alpha = evaluate_exactly(&mechanism, &motion).load;
        let [_, elimination, _] = rates::<0>(&mechanism, &motion);
        let power = elimination[elimination.len() - 1];
        if mechanism.constraints.is_empty() && !mechanism.is_damped() {
            check_canonical::<false>(&mechanism, &motion, &alpha, power)?;
        } else {
            check_canonical::<true>(&mechanism, &motion, &alpha, power)?;
        }
    }

    #[test]
    fn doubles_are_the_leading_parts_of_double_doubles((scene, seed) in any_tree(true)) {
        let (mechanism, t) = at_a_time(&scene);
        let mut motion = consistent(&scene, &mechanism, t);
        for x in motion.phi.iter_mut().chain(&mut motion.omega) {
            x.lo = 0.0;
        }
        let (kernel, exact) = (evaluate(&mechanism, &motion), evaluate_exactly(&mechanism, &motion));
        let scale = largest(kernel.load.iter().chain(&kernel.multiplier).copied());
        for (found, expected) in kernel.load.iter().chain(&kernel.multiplier).zip(exact.load.iter().chain(&exact.multiplier)) {
            prop_assert!((found - expected.hi).abs() < 1e-13 * scale, "seed {seed}: {:e} of {scale}", found - expected.hi);
        }
    }

    #[test]
    fn a_size_known_to_the_compiler_gives_the_same_bits((scene, _) in any_tree(true), motors in any::<bool>()) {
        let scene = if motors { scene } else { Scene { motors: vec![], ..scene } };
        let (mechanism, t) = at_a_time(&scene);
        let motion = consistent(&scene, &mechanism, t);
        let fixed = match mechanism.bodies.len() {
            1 => rates::<1>(&mechanism, &motion),
            2 => rates::<2>(&mechanism, &motion),
            3 => rates::<3>(&mechanism, &motion),
            4 => rates::<4>(&mechanism, &motion),
            5 => rates::<5>(&mechanism, &motion),
            _ => rates::<6>(&mechanism, &motion),
        };
        prop_assert_eq!(fixed, rates::<0>(&mechanism, &motion));
    }

    #[test]
    fn without_motor_there_are_no_rows_and_no_multipliers((scene, _) in any_tree(false)) {
        let mut scene = scene;
        scene.springs.iter_mut().for_each(|spring| spring.damping = 0.0);
        let (mechanism, _) = at_a_time(&scene);
        let motion = mechanism.start(&scene);
        let n = mechanism.bodies.len();
        // Neither rows nor accounts are unknowns, and the rate is the plain solve, bit for bit.
        let mut form = Multiplier::<0, false>::new(Arc::clone(&mechanism));
        prop_assert_eq!(form.dimension(), 2 * n);
        prop_assert!(mechanism.constraints.is_empty() && !mechanism.partition.driven() && mechanism.partition.count() == n);
        let rate = rate_of(&mut form, &motion);
        let mut kernel = Kernel::<f64>::without_rows(&mechanism);
        kernel.accelerate_free::<0>(&mechanism, motion.time, &plain(&motion.phi), &plain(&motion.omega));
        prop_assert_eq!(&rate[n..], &kernel.load[..]);
        prop_assert_eq!(kernel.jacobian.len() + kernel.schur.len() + kernel.multiplier.len(), 0);
        let plan = Plan::new(&scene, &mechanism, &Request::default()).expect("a plan");
        prop_assert_eq!(plan.stabilization, driftless::run::Stabilization::None);
    }
}
