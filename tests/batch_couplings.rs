//! Gears, cams and bodies that float on rails in lanes: against double-double one by one and closed forms, on
//! their constraints after every step, and independent of who integrates beside whom.

use crate::batch_loops::{agree_with_double_double, at, members, started};
use crate::common;

use common::shipped;
use driftless::arithmetic::{Complex, DoubleDouble};
use driftless::dynamics::constraint::ConstraintArguments;
use driftless::dynamics::{Mechanism, State, Time};
use driftless::scene::{Override, parse_scene};
use driftless::stepping::taylor::ExpansionKernel;
use driftless::stepping::taylor::batch::{Batch, Going};
use std::sync::Arc;

const GEAR_AND_CAM: &str = include_str!("laws/gear_and_cam.json");

/// A pendulum that drives a wheel by a law with three parameters.
const COUPLED: &str = r#"{"name": "coupled", "gravity": [0, -9.81],
    "parameters": {"a": 2.3, "b": 0.4, "c": 0.3},
    "bars": [{"name": "bar", "mass": 2, "length": 1, "centre": [0.5, 0], "inertia": 0.2},
        {"name": "wheel", "mass": 1, "centre": [0.01, 0], "inertia": 0.03}],
    "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]},
        {"name": "B", "between": [{"body": "ground", "point": [1, 0]}, {"body": "wheel", "point": [0, 0]}]}],
    "motors": [{"name": "gear", "body": "wheel", "law": "LAW"}],
    "start": {"bar": {"phi": 0.4, "omega": 9}}, "until": 2, "every": 2}"#;

/// Laws of it: a gear, one that runs ahead with time, a cam in lines and curves, and one that may be flat.
const LAWS: [&str; 4] = [
    "a*bar.phi - b",
    "bar.phi + 3*t + b*bar.sin*t^2/(1 s)^2 + c*sin(a*t/(1 s))",
    "b*sin(2*bar.phi + c)/(1 + b^2 + bar.cos^2) + sqrt(a + bar.sin)*c",
    "b*tanh(a*sin(bar.phi) + c) + exp(-c*bar.sin)",
];

type All = Vec<(Arc<Mechanism>, State)>;

/// Eleven of a scene, with other values each.
fn variants(text: &str, varied: &[(&str, f64, f64)]) -> All {
    let at = |i: usize| {
        let set = |(path, from, by): &(&str, f64, f64)| format!("{path}={}", from + by * i as f64);
        let sets: Vec<Override> =
            varied.iter().map(|varied| set(varied).parse().expect("an override")).collect();
        started(&parse_scene(text, "scene", &sets).expect("a scene"))
    };
    (0..11).map(at).collect()
}

/// Each with numbers of its own, and each with a start of its own, up to when \[s\].
fn scenes() -> Vec<(String, All, f64)> {
    let mut all = Vec::new();
    for law in LAWS {
        let text = COUPLED.replace("LAW", law);
        let start = [("start.bar.omega", 7.0, 0.2)];
        let numbers = [("parameters.a", 1.5, 0.1), ("parameters.c", 0.2, 0.02), ("bars.bar.mass", 1.5, 0.1)];
        all.push((law.to_owned(), variants(&text, &start), 1.0));
        all.push((law.to_owned(), variants(&text, &numbers), 1.0));
    }
    let start = [("start.shaft.omega", 3.0, 0.4)];
    let numbers =
        [("start.shaft.omega", 3.0, 0.4), ("bars.follower.mass", 0.4, 0.02), ("gravity[1]", -9.9, 0.1)];
    all.push(("gear and cam".into(), variants(GEAR_AND_CAM, &start), 0.8));
    all.push(("gear and cam".into(), variants(GEAR_AND_CAM, &numbers), 0.8));
    let cart = |i: usize| {
        let sets = [
            format!("start.pole.phi={}", 0.3 + 0.1 * i as f64),
            format!("bars.cart.mass={}", 0.5 + 0.1 * i as f64),
        ];
        started(&shipped("cart_pole", &sets.each_ref().map(String::as_str)))
    };
    all.push(("cart_pole".into(), (0..11).map(cart).collect(), 1.0));
    all
}

#[test]
fn gears_and_cams_agree_with_double_double_whoever_is_beside_them() {
    for (name, all, until) in scenes() {
        assert!(all.iter().all(|(mechanism, _)| Batch::takes_alike(mechanism)), "{name}");
        agree_with_double_double(&name, &all, until);
    }
}

/// At a loose tolerance steps end far from the constraints, and are brought back onto them.
#[test]
fn trajectories_of_gears_and_cams_end_on_their_constraints_whoever_is_beside_them() {
    for (name, all, until) in scenes() {
        for tolerance in [1e-3, 1e-9, 1e-15] {
            let integrated = |batch: &Batch, few: &[(Arc<Mechanism>, State)]| -> Vec<State> {
                let mut members = members(few);
                batch.integrate(&mut members, Time::from(until), &mut |_, _| Going::On);
                members.into_iter().map(|member| member.state).collect()
            };
            let together = integrated(&at(tolerance), &all);
            assert_eq!(
                integrated(&at(tolerance).with_kernel(ExpansionKernel::Portable), &all),
                together,
                "{name}"
            );
            for (i, (mechanism, _)) in all.iter().enumerate() {
                assert_eq!(integrated(&at(tolerance), &all[i..=i])[0], together[i], "{name} {i}");
                let [position, rate] = violation(mechanism, &together[i]);
                assert!(position < 1e-15 && rate < 2e-15, "{name} {i}: {position:e} {rate:e}");
            }
        }
    }
}

/// The largest violation of a constraint at both levels, over the largest angle and over the fastest rate.
fn violation(mechanism: &Mechanism, state: &State) -> [f64; 2] {
    let (n, angles) = (mechanism.coordinates(), mechanism.bodies.len());
    let all: Vec<DoubleDouble> = (0..2 * n).map(|k| state.unknown(k)).collect();
    let (phi, omega) = all.split_at(n);
    let mut z: Vec<_> = phi[..angles].iter().map(|&phi| Complex::unit(phi)).collect();
    z.extend((angles..n).map(|k| match (k - angles) % 2 {
        0 => Complex::new(phi[k], phi[k + 1]),
        _ => Complex::default(),
    }));
    let largest = |of: &[DoubleDouble]| of.iter().fold(1.0, |most: f64, x| most.max(x.hi.abs()));
    let (farthest, fastest) = (largest(phi), largest(omega));
    mechanism.constraints.iter().fold([0.0, 0.0], |[position, rate], row| {
        let mut jacobian = vec![DoubleDouble::default(); n];
        let here = row.linearise(state.time, ConstraintArguments { phi, z: &z, omega }, &mut jacobian);
        let slip = jacobian.iter().zip(omega).fold(here.drive, |sum, (&g, &w)| sum + g * w);
        [position.max(here.position.hi.abs() / farthest), rate.max(slip.hi.abs() / fastest)]
    })
}

/// With inertias of shaft I and wheel J at a ratio n, without gravity, under a torque T on the shaft:
/// (I + n² J) phi'' = T, for many turns.
#[test]
fn a_gear_under_a_torque_accelerates_as_its_inertias_say() {
    let text = r#"{"name": "gear", "gravity": [0, 0], "parameters": {"ratio": 2},
        "bars": [{"name": "shaft", "mass": 1, "centre": [0, 0], "inertia": 0.5},
            {"name": "wheel", "mass": 1, "centre": [0, 0], "inertia": 0.03}],
        "hinges": [
            {"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "shaft", "point": [0, 0]}]},
            {"name": "B", "between": [{"body": "ground", "point": [1, 0]}, {"body": "wheel", "point": [0, 0]}]}],
        "motors": [{"name": "gear", "body": "wheel", "law": "-ratio*shaft.phi + 0.2"}],
        "torques": [{"name": "drive", "body": "shaft", "torque": 1.5}],
        "start": {"shaft": {"phi": 0.3, "omega": 20}}, "until": 1, "every": 1}"#;
    let (from, by, until) = (1.5, 0.125, 40.0);
    let all = variants(text, &[("parameters.ratio", from, by)]);
    let mut members = members(&all);
    at(1e-13).integrate(&mut members, Time::from(until), &mut |_, _| Going::On);
    for (i, member) in members.iter().enumerate() {
        assert!(!member.has_left && member.stopped.is_none(), "{member:?}");
        let ratio = from + by * i as f64;
        let bend = 1.5 / (0.5 + ratio * ratio * 0.03);
        let [phi, omega] = [0.3 + 20.0 * until + 0.5 * bend * until * until, 20.0 + bend * until];
        let (y, turns) = (&member.state.y, &member.state.turns);
        let angle = |k: usize| y[k] + std::f64::consts::TAU * turns[k] as f64;
        assert!((angle(0) - phi).abs() < 1e-14 * phi, "{i}: {} {phi}", angle(0));
        assert!((angle(1) - 0.2 + ratio * phi).abs() < 1e-14 * ratio * phi, "{i}: {}", angle(1));
        assert!((y[2] - omega).abs() < 1e-14 * omega, "{i}: {} {omega}", y[2]);
        assert!((y[3] + ratio * omega).abs() < 1e-14 * ratio * omega, "{i}: {}", y[3]);
    }
}
