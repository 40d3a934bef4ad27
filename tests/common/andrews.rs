//! Andrews' squeezing mechanism: its state at 0.03 s in quadruple precision, and how well a run keeps its
//! rows.

#![allow(dead_code)]

use driftless::dynamics::kernel::Kernel;
use driftless::dynamics::{Mechanism, Motion};
use std::f64::consts::FRAC_PI_2;

/// Angles \[rad\] and rates \[rad/s\] of OF, FE, BED, GE, AG, HE, AH, from the test set's relative ones.
pub fn reference() -> [[f64; 7]; 2] {
    let file: serde_json::Value =
        serde_json::from_str(include_str!("../data/andrews_squeezer.json")).expect("valid JSON");
    [("angles", FRAC_PI_2), ("velocities", 0.0)].map(|(what, quarter)| {
        let of = |name: &str| {
            let text = file["reference_high_precision"][what][name].as_str().expect("a number as text");
            text.parse::<f64>().expect("a number")
        };
        let (beta, theta, delta, epsilon) = (of("beta"), of("theta"), of("delta"), of("epsilon"));
        let pi = 2.0 * quarter;
        [
            beta,
            beta + theta + pi,
            of("gamma"),
            of("phi") + delta - quarter,
            delta,
            of("omega") + epsilon,
            epsilon - quarter,
        ]
    })
}

/// Largest distance of the angles from the reference \[rad\].
pub fn error(end: &Motion) -> f64 {
    reference()[0].iter().enumerate().map(|(k, exact)| (end.unwrapped(k) - exact).abs()).fold(0.0, f64::max)
}

/// The largest violation of a row, relative to 0.1 m, about the mechanism's size, and to 0.1 m times the
/// fastest rate.
pub fn violation(mechanism: &Mechanism, kernel: &mut Kernel<f64>, motion: &Motion) -> f64 {
    let plain =
        |numbers: &[driftless::arithmetic::DoubleDouble]| numbers.iter().map(|x| x.hi).collect::<Vec<f64>>();
    let (phi, omega) = (plain(&motion.phi), plain(&motion.omega));
    kernel.unit_vectors::<0>(mechanism, &phi);
    kernel.rows_at(mechanism, motion.time, &phi, &omega);
    let fastest = omega.iter().fold(1.0, |most: f64, omega| most.max(omega.abs()));
    (0..mechanism.constraints.len()).fold(0.0, |worst: f64, r| {
        worst.max(kernel.rows[r].position.abs() / 0.1).max(kernel.row_rate(r, &omega).abs() / (0.1 * fastest))
    })
}
