//! Published accelerations, torque and power of the source problem (TU Delft ME41055, homework 4) and its
//! neighbours.

use crate::common;

use common::{Inertia, ONE_TURN, compile, double_pendulum, free, motor, shipped, spring};
use driftless::arithmetic::Complex;
use driftless::dynamics::Mechanism;
use driftless::dynamics::kernel::{Bias, Kernel};
use driftless::scene::Scene;
use std::f64::consts::{FRAC_PI_2, PI};

/// Accelerations (x, y, phi) of both centres, multipliers, hinge forces.
fn solve(scene: &Scene) -> ([f64; 6], Vec<f64>, Vec<Complex<f64>>) {
    let mechanism: &Mechanism = &compile(scene);
    let phi: Vec<f64> = scene.start.iter().map(|start| start.phi).collect();
    let omega: Vec<f64> = scene.start.iter().map(|start| start.omega).collect();
    let mut kernel = Kernel::<f64>::new(mechanism);
    kernel.accelerations(mechanism, Default::default(), &phi, &omega, Bias::default());
    let mut found = [0.0; 6];
    for k in 0..mechanism.bodies.len() {
        let centre = mechanism.centre(k).acceleration(&kernel.z, &omega, &kernel.load);
        found[3 * k..3 * k + 3].copy_from_slice(&[centre.re, centre.im, kernel.load[k]]);
    }
    (found, kernel.multiplier.clone(), mechanism.hinge_forces(Default::default(), &kernel, &phi, &omega))
}

/// Every digit printed in the source.
fn assert_digits(found: &[f64], printed: &[f64], last_digit: f64) {
    for (found, printed) in found.iter().zip(printed) {
        assert!((found - printed).abs() <= 0.5000001 * last_digit, "{found} is not {printed}");
    }
}

/// Hinge forces by Newton–Euler: of the ground on bar 1 at A, of bar 1 on bar 2 at B.
fn assert_hinges(scene: &Scene, printed: [f64; 4]) {
    let forces = solve(scene).2;
    assert_digits(&[forces[0].re, forces[0].im, forces[1].re, forces[1].im], &printed, 1e-4);
}

fn with_spring(inertia: Inertia) -> Scene {
    let mut scene = double_pendulum(inertia, [(FRAC_PI_2, 0.0), (FRAC_PI_2, 0.0)]);
    scene.springs.push(spring(0.0));
    scene
}

#[test]
fn case_c_i_both_horizontal_at_rest() {
    assert_digits(&solve(&free()).0, &[6.2971, 0.0, -20.9903, 10.5097, 0.0, 6.9483], 1e-4);
}

#[test]
fn case_c_ii_both_hanging_at_rest() {
    for inertia in [Inertia::Full, Inertia::Slender] {
        assert_digits(&solve(&double_pendulum(inertia, [(0.0, 0.0), (0.0, 0.0)])).0, &[0.0; 6], 1e-12);
    }
}

#[test]
fn case_c_iii_both_hanging_and_turning() {
    for inertia in [Inertia::Full, Inertia::Slender] {
        let found = solve(&double_pendulum(inertia, [(0.0, PI), (0.0, PI)])).0;
        assert_digits(&found, &[-2.9609, 0.0, 0.0, -8.8826, 0.0, 0.0], 1e-4);
    }
}

#[test]
fn case_d_with_the_spring() {
    assert_digits(
        &solve(&with_spring(Inertia::Full)).0,
        &[2.1063, 0.0, -7.0210, 8.4034, 0.0, -13.9693],
        1e-4,
    );
}

#[test]
fn case_e_with_the_motor() {
    for rate in [ONE_TURN, -ONE_TURN] {
        let (found, multiplier, _) = solve(&motor(Inertia::Slender, rate));
        assert_digits(&found, &[0.0, -11.8435, 0.0, 7.3575, -35.5306, -24.5250], 1e-4);
        assert_digits(&multiplier, &[-0.2662], 1e-4);
        assert_digits(&[-multiplier[0] * rate], &[1.6725 * rate.signum()], 1e-4);
    }
}

/// The source's own formula, power = torque · rate, for both directions: its printed power is that of +2 pi,
/// its printed rate is -2 pi.
#[test]
fn case_e_the_motor_gives_and_takes_the_same_power() {
    for rate in [ONE_TURN, -ONE_TURN] {
        let scene = motor(Inertia::Slender, rate);
        let mechanism = compile(&scene);
        let mut sampler = driftless::run::Sampler::new(mechanism.clone());
        let sample = sampler.take(&mechanism.start(&scene));
        let [torque, power] = sample.motors[0];
        assert_digits(&[torque, power], &[0.2662, 1.6725 * rate.signum()], 1e-4);
        assert!((power - torque * rate).abs() < 1e-15);
    }
}

/// Erratum: the source changes from the full to the slender moment of inertia between cases d and e without a
/// word.  What each case would have been with the other one; the full one of case e is in the design notes,
/// the slender ones of c i and d are HW1b and HW3a of the same course.
#[test]
fn erratum_the_other_moment_of_inertia() {
    let (found, multiplier, _) = solve(&motor(Inertia::Full, ONE_TURN));
    assert_digits(&[found[5]], &[-24.4825], 1e-4);
    assert_digits(&multiplier, &[-0.26666], 1e-5);
    assert_digits(&[-multiplier[0] * ONE_TURN], &[1.6754], 1e-4);
    let slender = double_pendulum(Inertia::Slender, [(FRAC_PI_2, 0.0), (FRAC_PI_2, 0.0)]);
    assert_digits(&solve(&slender).0, &[6.3064, 0.0, -21.0214, 10.5107, 0.0, 7.0071], 1e-4);
    assert_digits(
        &solve(&with_spring(Inertia::Slender)).0,
        &[2.1021, 0.0, -7.0071, 8.4086, 0.0, -14.0143],
        1e-4,
    );
}

/// Erratum: the source's text drops bar 1's weight from the right-hand side; its numbers contain it.  Without
/// it the first equation of case c i, 4/3 + 1/2 with the small width term, would give another pair.
#[test]
fn erratum_the_weight_of_bar_1_is_in_the_numbers() {
    let (m, l, g) = (common::MASS, common::LENGTH, 9.81);
    let inertia = m * (l * l + 0.05 * 0.05) / 12.0;
    let [m11, m12, m22] = [1.25 * m * l * l + inertia, 0.5 * m * l * l, 0.25 * m * l * l + inertia];
    let solve_by_hand = |b1: f64, b2: f64| {
        let determinant = m11 * m22 - m12 * m12;
        [(m22 * b1 - m12 * b2) / determinant, (m11 * b2 - m12 * b1) / determinant]
    };
    let found = solve(&free()).0;
    let with_it = solve_by_hand(-1.5 * m * g * l, -0.5 * m * g * l);
    assert!((found[2] - with_it[0]).abs() < 1e-12 && (found[5] - with_it[1]).abs() < 1e-12);
    let without_it = solve_by_hand(-m * g * l, -0.5 * m * g * l);
    assert!((found[2] - without_it[0]).abs() > 5.0);
}

/// Case f, which the source leaves unsolved.  With both bars at pi/2 the coupling is at its largest, M = m l²
/// [4/3 1/2; 1/2 1/3], and the end C has J = -l (1, 1).  J M⁻¹ Jᵀ = 24/(7 m), J v⁻ = -4 pi l, so rho = -(1+e)
/// (7/6) pi m l and v⁺ = (2 pi + (1+e) pi, 2 pi - 5 (1+e) pi).
#[test]
fn case_f_the_impact_at_three_restitutions() {
    let (m, l) = (common::MASS, common::LENGTH);
    for e in [0.0, 0.5, 1.0] {
        let scene = shipped("wall", &[&format!("walls.wall.restitution={e}")]);
        let mechanism = compile(&scene);
        let phi: Vec<f64> = scene.start.iter().map(|start| start.phi).collect();
        let omega: Vec<f64> = scene.start.iter().map(|start| start.omega).collect();
        assert_eq!((phi.as_slice(), omega.as_slice()), (&[FRAC_PI_2; 2][..], &[2.0 * PI; 2][..]));
        let impact = mechanism.impact_at(0, Default::default(), &phi, &omega).expect("a rebound");
        let gain = (1.0 + e) * PI;
        let expected = [2.0 * PI + gain, 2.0 * PI - 5.0 * gain];
        for k in 0..2 {
            assert!(
                (impact.omega[k] - expected[k]).abs() < 1e-12,
                "e = {e}: {:?} is not {expected:?}",
                impact.omega
            );
        }
        let approach = -4.0 * PI * l;
        let rho = -(1.0 + e) * 7.0 / 6.0 * PI * m * l;
        assert!((impact.approach - approach).abs() < 1e-12);
        assert!((impact.impulse + rho).abs() < 1e-13);
        // The energy an impact takes, from the impulse and from the rates.
        assert!((impact.energy_change + 0.5 * rho * (1.0 - e) * approach).abs() < 1e-13);
        let kinetic =
            |v: [f64; 2]| m * l * l * (2.0 / 3.0 * v[0] * v[0] + 0.5 * v[0] * v[1] + v[1] * v[1] / 6.0);
        assert!((impact.energy_change - (kinetic(expected) - kinetic([2.0 * PI; 2]))).abs() < 1e-13);
        assert!(impact.energy_change <= 1e-14 && impact.motor_work == 0.0);
    }
}

/// Case g: the hinge forces of the independent coordinates, as printed for the pinned form (HW2b, HW2d
/// corrected, HW3a, HW3b of the course).  The force at B is the one on bar 2.
#[test]
fn case_g_hinge_forces() {
    assert_hinges(
        &double_pendulum(Inertia::Slender, [(FRAC_PI_2, 0.0), (FRAC_PI_2, 0.0)]),
        [-0.1690, 0.0, 0.0423, 0.0],
    );
    assert_hinges(&double_pendulum(Inertia::Slender, [(0.0, PI), (0.0, PI)]), [-1.8973, 0.0, -1.1272, 0.0]);
    assert_hinges(&with_spring(Inertia::Slender), [-0.1056, 0.5915, -0.0845, 0.0]);
    assert_hinges(&motor(Inertia::Slender, -ONE_TURN), [-0.7394, -2.8567, -0.1479, -2.1425]);
}
