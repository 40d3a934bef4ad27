//! The generator of random scenes that other tests compare motions on: every scene is accepted, and begins as
//! it says.

use crate::mechanisms;

use driftless::dynamics::Mechanism;
use driftless::run::{Limits, Plan, Request, Run, Sample, integrate};
use driftless::scene::parse_scene;
use mechanisms::{Generated, Kind};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Seeds where nobody says how many: `SEEDS=10000 cargo test --test physics -- mechanisms:: --nocapture`.
fn seeds(usual: u64) -> u64 {
    std::env::var("SEEDS").ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// What is wrong with the beginning of a run of a scene.
fn fault(made: &Generated) -> Option<String> {
    let scene = match parse_scene(&made.text, "random.json", &[]) {
        Ok(scene) => scene,
        Err(error) => return Some(format!("is not read: {error}")),
    };
    let mechanism = match Mechanism::new(&scene) {
        Ok(mechanism) => Arc::new(mechanism),
        Err(error) => return Some(format!("has no equations: {error}")),
    };
    if let Some(change) = mechanism.assembly.changes.first() {
        return Some(format!("has its start changed: {change}"));
    }
    let every = 1e-3 * made.scales.time;
    let request = Request { until: Some(every), every: Some(every), ..Request::default() };
    let plan = match Plan::new(&scene, &mechanism, &request) {
        Ok(plan) => plan,
        Err(refusal) => return Some(format!("has no plan: {refusal}")),
    };
    let start = mechanism.start(&scene);
    let run = match Run::new(Arc::clone(&mechanism), plan, Limits::default(), &start) {
        Ok(run) => run,
        Err(stop) => return Some(format!("does not begin: {stop}")),
    };
    let mut first: Option<Sample> = None;
    let outcome = integrate(run, &mut |sample| {
        first.get_or_insert_with(|| sample.clone());
        Ok(())
    });
    let outcome = outcome.expect("no observer fails");
    let Some(first) = first else { return Some(format!("has no rows: {:?}", outcome.stop)) };
    // Impacts at t = 0 change rates before the first row.
    let struck = outcome.impacts.iter().any(|strike| strike.t == 0.0)
        || outcome.holds.iter().any(|hold| hold.t == 0.0);
    let written: serde_json::Value = serde_json::from_str(&made.text).expect("JSON");
    for (k, bar) in scene.bars.iter().enumerate() {
        let given = &written["start"][&bar.name];
        let number = |value: &serde_json::Value| value.as_f64().expect("a number");
        let near = |a: f64, b: f64, scale: f64| (a - b).abs() <= 1e-12 * (scale + b.abs());
        if !near(first.phi[k], number(&given["phi"]), 1.0) {
            return Some(format!("begins with {} at {} rad", bar.name, first.phi[k]));
        }
        if !struck && !near(first.omega[k], number(&given["omega"]), 1.0 / made.scales.time) {
            return Some(format!("begins with {} at {} rad/s", bar.name, first.omega[k]));
        }
        if let Some(origin) = given["origin"].as_array() {
            let (s, c) = first.phi[k].sin_cos();
            let arm = [c * bar.centre[0] - s * bar.centre[1], s * bar.centre[0] + c * bar.centre[1]];
            let off = [0, 1].map(|i| first.centre[k][i] - arm[i] - number(&origin[i]));
            if off[0].hypot(off[1]) > 1e-12 * made.scales.length * (1.0 + number(&origin[0]).abs()) {
                return Some(format!("begins with {} off by {off:?} m", bar.name));
            }
        }
    }
    None
}

#[test]
fn every_scene_is_read_and_begins_as_it_says() {
    let count = seeds(1000);
    let (mut of_kind, mut faults): (BTreeMap<Kind, u64>, Vec<String>) = (BTreeMap::new(), Vec::new());
    let (mut missed, mut bodies): (BTreeMap<Kind, u64>, BTreeMap<usize, u64>) =
        (BTreeMap::new(), BTreeMap::new());
    for seed in 0..count {
        let made = mechanisms::scene(seed);
        assert_eq!(made.text, mechanisms::scene(seed).text);
        made.kinds.iter().for_each(|&kind| *of_kind.entry(kind).or_default() += 1);
        made.wanted
            .iter()
            .filter(|kind| !made.kinds.contains(kind))
            .for_each(|&kind| *missed.entry(kind).or_default() += 1);
        *bodies.entry(made.text.matches("\"omega\"").count()).or_default() += 1;
        if let Some(fault) = fault(&made) {
            faults.push(format!("seed {seed} ({:?}) {fault}\n{}", made.kinds, made.text));
        }
    }
    faults.iter().for_each(|fault| println!("{}", fault.lines().next().unwrap_or_default()));
    println!("{count} scenes by number of bodies: {bodies:?}");
    for kind in Kind::ALL {
        let [has, misses] = [&of_kind, &missed].map(|map| map.get(&kind).copied().unwrap_or(0));
        println!("{:24} in {has:5}, wanted in vain {misses}", kind.name());
    }
    assert!(
        faults.is_empty(),
        "{} faults, of which\n{}",
        faults.len(),
        faults[..faults.len().min(4)].join("\n\n")
    );
    assert!(
        count < 500 || Kind::ALL.iter().all(|kind| of_kind.get(kind).is_some_and(|&some| some > count / 100))
    );
}
