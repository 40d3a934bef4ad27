//! The recurrence against itself, with and without sizes known to the compiler.

use super::*;
use crate::arithmetic::DoubleDouble;
use crate::dynamics::{Mechanism, Time};
use crate::scene::read_scene;

fn mechanism(name: &str) -> (Mechanism, Vec<f64>, Vec<f64>) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/scenes/{name}.json"));
    let scene = read_scene(&path, &[]).expect("a shipped scene");
    let (phi, omega) = scene.start.iter().map(|start| (start.phi, start.omega)).unzip();
    (Mechanism::new(&scene).expect("a valid scene"), phi, omega)
}

#[test]
fn sizes_known_to_the_compiler_give_the_same_bits() {
    for name in ["spring", "motor_sine", "wall"] {
        let (mechanism, phi, omega) = mechanism(name);
        for coordinates in [Coordinates::All, Coordinates::Independent] {
            let mut series = Series::<f64>::new(&mechanism, coordinates, 20);
            let f = series.coordinates();
            let from = 2 - f;
            series.begin(Time::default(), &phi[from..], &[0.0; 2][from..], &omega[from..]);
            let mut other = series.clone();
            series.orders::<2>(&mechanism.terms(), 0);
            other.orders::<0>(&mechanism.terms(), 0);
            assert!(
                series.z == other.z && series.omega == other.omega && series.power == other.power,
                "{name}"
            );
        }
    }
}

#[test]
fn powers_after_exact_ones_are_those_of_a_plain_expansion() {
    for name in ["spring", "motor_sine", "branch"] {
        let (mechanism, phi, omega) = mechanism(name);
        let exact = |x: &[f64]| x.iter().map(|&x| DoubleDouble::from(x)).collect::<Vec<_>>();
        let none = vec![0.0; phi.len()];
        let mut plain = Series::<f64>::new(&mechanism, Coordinates::All, 16);
        plain.expand(&mechanism, Time::default(), &phi, &none, &omega);
        let mut first = Series::<DoubleDouble>::new(&mechanism, Coordinates::All, 6);
        first.expand(&mechanism, Time::default(), &exact(&phi), &exact(&none), &exact(&omega));
        let mut extended = plain.clone();
        extended.carry_on(&mechanism, Time::default(), &phi, &none, &omega, &first);
        for (found, expected) in [(&extended.omega, &plain.omega), (&extended.power, &plain.power)] {
            let largest = expected.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            assert!(
                found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9 * largest.max(1e-9)),
                "{name}"
            );
        }
        assert_ne!(extended.omega, plain.omega);
    }
}
