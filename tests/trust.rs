//! How far results may be trusted: references, error estimates, horizons.

mod common;

use common::{compile, run, shipped};
use driftless::dynamics::Time;
use driftless::run::{MethodId, Request, reference};

/// Every shipped scene.
const SCENES: &[&str] = &[
    "andrews",
    "branch",
    "cart_pole",
    "chain8",
    "four_bar_motor",
    "four_bars",
    "free",
    "gentle",
    "guided",
    "hanging",
    "iftomm_pendulum",
    "kite",
    "motor",
    "motor_sine",
    "quick_return",
    "slider_crank_driven",
    "slider_crank_equal",
    "slider_crank_torque",
    "spinning",
    "spring",
    "wall",
];

#[test]
fn every_shipped_scene_has_a_reference_that_runs_come_near() {
    for name in SCENES {
        let scene = shipped(name, &[]);
        let mechanism = compile(&scene);
        let t = scene.until.min(1.0);
        let times = [Time::from(0.5 * t), Time::from(t)];
        let found = reference(&mechanism, &mechanism.start(&scene), &times).expect("a reference");
        assert_eq!(found.motions.iter().map(|motion| motion.time).collect::<Vec<_>>(), times, "{name}");
        // `kite` passes a singular position, `wall` is struck at a moment found in doubles.
        let known_to = if ["kite", "wall"].contains(name) { 1e-12 } else { 1e-20 };
        assert!(found.accuracy.iter().all(|&off| off < known_to), "{name}: {:?}", found.accuracy);
        let request = Request { method: Some(MethodId::Taylor), rtol: Some(1e-13), until: Some(t), every: Some(t), ..Request::default() };
        let last = run(&scene, &request).last;
        let exact = &found.motions[1];
        let off = (0..last.phi.len()).map(|k| (last.phi[k] - exact.unwrapped(k)).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9, "{name}: {off:e}");
    }
}

#[test]
fn a_reference_refuses_times_in_the_past() {
    let (mechanism, start) = common::started("free");
    assert!(reference(&mechanism, &start, &[Time::from(1.0), Time::from(0.5)]).is_err());
}
