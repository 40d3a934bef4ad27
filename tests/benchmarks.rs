//! The double pendulum's instants: accelerations, joint forces, motor and guide multipliers at given
//! positions, to twelve digits.
//!
//! Numbers and their public source: `data/tudelft_double_pendulum_instants.json`.  Its sign rule: the force
//! on bar 1 is minus the multiplier at A and minus the multiplier at B.

use crate::common;

use common::{Inertia, double_pendulum, spring};
use driftless::arithmetic::DoubleDouble;
use driftless::dynamics::kernel::{Bias, Kernel};
use driftless::dynamics::series::Series;
use driftless::dynamics::{Coordinates, Mechanism};
use driftless::scene::{Law, Motor, Place, Rail, Slider};
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

/// Every number of a case against the equations.
fn check(case: &Value) {
    let name = case["case"].as_str().expect("a name");
    let start: Vec<Vec<f64>> = case["start"].as_array().expect("a list").iter().map(numbers).collect();
    let mut scene =
        double_pendulum(Inertia::Slender, [(start[0][0], start[0][1]), (start[1][0], start[1][1])]);
    for bar in &mut scene.bars {
        bar.inertia = case["inertia"].as_f64().expect("a number");
    }
    if case["spring"] == true {
        scene.springs.push(spring(0.0));
    }
    if let Some(rate) = case["motor"].as_f64() {
        let law = Law { start: start[0][0], rate, acceleration: 0.0, sines: vec![], profile: None };
        scene.motors.push(Motor { name: "motor".into(), bar: 0, relative_to: None, law });
    }
    if let Some(line) = case["guide"].as_object() {
        let (normal, point) = (numbers(&line["normal"]), numbers(&line["point"]));
        assert_eq!(line["offset"].as_f64(), Some(0.0));
        // The normal lies to the left of the rail.
        let rail = Rail { place: Place { bar: None, point: [0.0, 0.0] }, direction: [normal[1], -normal[0]] };
        let point = Place { bar: Some(1), point: [point[0], point[1]] };
        scene.sliders.push(Slider { name: "guide".into(), point, rail, locked: false });
    }
    let mechanism = Mechanism::new(&scene).expect("a valid scene");
    let (phi, omega) = ([start[0][0], start[1][0]], [start[0][1], start[1][1]]);
    let mut kernel = Kernel::<f64>::new(&mechanism);
    kernel.accelerations(&mechanism, Default::default(), &phi, &omega, Bias::default());
    let mut accelerations = Vec::new();
    for k in 0..mechanism.bodies.len() {
        let centre = mechanism.centre(k).acceleration(&kernel.z, &omega, &kernel.load);
        accelerations.extend([centre.re, centre.im, kernel.load[k]]);
    }
    let forces = mechanism.hinge_forces(Default::default(), &kernel, &phi, &omega);
    // Hinge A: of the ground on bar 1; hinge B: of bar 1 on bar 2.
    let mut multipliers = vec![-forces[0].re, -forces[0].im, forces[1].re, forces[1].im];
    multipliers.extend(&kernel.multiplier);
    // The first orders of the series are the same instants.
    let mut series = Series::<f64>::new(&mechanism, Coordinates::All, 8);
    series.expand(&mechanism, Default::default(), &phi, &[0.0; 2], &omega);
    for (found, expected) in
        series.rate[2..4].iter().zip(&kernel.load).chain(series.multipliers(0).iter().zip(&kernel.multiplier))
    {
        assert!(
            (found - expected).abs() <= 1e-12 * expected.abs().max(1.0),
            "{name}: {found} is not {expected} in the series"
        );
    }
    for (what, found, expected) in [
        ("acceleration", accelerations, numbers(&case["accelerations"])),
        ("multiplier", multipliers, numbers(&case["multipliers"])),
    ] {
        assert_eq!(found.len(), expected.len(), "{name}");
        for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert!(
                (found - expected).abs() <= 1e-12 * expected.abs().max(1.0),
                "{name}: {what} {i}: {found} is not {expected}"
            );
        }
    }
}

fn cases(guided: bool) -> Vec<Value> {
    let file: Value =
        serde_json::from_str(include_str!("data/tudelft_double_pendulum_instants.json")).expect("valid JSON");
    let all = file["cases"].as_array().expect("a list").clone();
    all.into_iter().filter(|case| case["guide"].is_object() == guided).collect()
}

#[test]
fn six_instants_with_hinges_spring_and_motor() {
    let cases = cases(false);
    assert_eq!(cases.len(), 6);
    cases.iter().for_each(check);
}

/// HW2e and HW2f, and the shipped scene, which starts as the latter.
#[test]
fn two_instants_with_a_guided_end() {
    let cases = cases(true);
    assert_eq!(cases.len(), 2);
    cases.iter().for_each(check);
    let scene = common::shipped("guided", &[]);
    let mechanism = Mechanism::new(&scene).expect("a valid scene");
    let start = mechanism.start(&scene);
    let plain = |exact: &[DoubleDouble]| exact.iter().map(|x| x.hi).collect::<Vec<f64>>();
    let mut kernel = Kernel::<f64>::new(&mechanism);
    kernel.accelerations(&mechanism, start.time, &plain(&start.phi), &plain(&start.omega), Bias::default());
    let expected = numbers(&cases[1]["accelerations"]);
    assert!(
        (kernel.load[0] - expected[2]).abs() < 1e-11 && (kernel.load[1] - expected[5]).abs() < 1e-11,
        "{:?}",
        kernel.load
    );
    assert!((kernel.multiplier[0] - 0.14788575).abs() < 1e-13);
}
