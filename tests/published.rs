//! Published accelerations, torque and power of the source problem (TU Delft ME41055, homework 4) and its neighbours.

mod common;

use common::{Inertia, ONE_TURN, compile, double_pendulum, free, motor, spring};
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
    let mut kernel = Kernel::<f64>::new(2, mechanism.rows.len());
    kernel.accelerate::<0>(mechanism, Default::default(), &phi, &omega, Bias::default());
    let mut found = [0.0; 6];
    for (k, body) in mechanism.bodies.iter().enumerate() {
        let centre = body.centre.acceleration(&kernel.z, &omega, &kernel.load);
        found[3 * k..3 * k + 3].copy_from_slice(&[centre.re, centre.im, kernel.load[k]]);
    }
    (found, kernel.multiplier.clone(), mechanism.hinge_forces(&kernel.z, &omega, &kernel.load))
}

/// Every digit printed in the source.
fn assert_digits(found: &[f64], printed: &[f64], last_digit: f64) {
    for (found, printed) in found.iter().zip(printed) {
        assert!((found - printed).abs() <= 0.5000001 * last_digit, "{found} is not {printed}");
    }
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
    assert_digits(&solve(&with_spring(Inertia::Full)).0, &[2.1063, 0.0, -7.0210, 8.4034, 0.0, -13.9693], 1e-4);
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
