//! Very stiff springs taken for rods, with what their vibration does on average, against the vibration resolved.

mod common;

use common::spring;
use driftless::dynamics::Mechanism;
use driftless::run::{MethodId, Plan, Request, simulate};
use driftless::scene::{Scene, Spring, Start};

/// The double pendulum on a spring so many times stiffer than the source's, whose length starts off by what gives it `energy` \[J\].
fn scene(factor: f64, energy: f64, rigid: bool) -> Scene {
    let mut scene = common::free();
    let soft = spring(0.0);
    let stiffness = factor * soft.stiffness;
    let length = soft.free_length + (2.0 * energy / stiffness).sqrt();
    // From (-0.3, 0) to 0.4 m along bar 1: L² = 0.25 + 0.24 cos phi.
    let phi = libm::acos((length * length - 0.25) / 0.24);
    scene.start = vec![Start { phi, omega: 0.0 }, Start { phi: 1.2, omega: 0.0 }];
    scene.springs = vec![Spring { stiffness, rigid, ..soft }];
    scene
}

fn request(method: MethodId, tolerance: f64) -> Request {
    Request { method: Some(method), rtol: Some(tolerance), until: Some(2.0), every: Some(0.02), ..Request::default() }
}

/// Angles of the second bar.
fn path(scene: &Scene, request: &Request) -> Vec<f64> {
    let mut path = Vec::new();
    let outcome = simulate(scene, request, &mut |sample| {
        path.push(sample.phi[1]);
        Ok(())
    });
    assert_eq!(outcome.expect("a run").stop, None);
    path
}

/// The largest difference between the second bars of a rod and of the spring itself.
fn error(factor: f64, energy: f64) -> f64 {
    let elastic = path(&scene(factor, energy, false), &request(MethodId::Taylor, 1e-12));
    let rigid = path(&scene(factor, energy, true), &request(MethodId::Dp8, 1e-9));
    elastic.iter().zip(&rigid).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn the_error_falls_with_the_frequency() {
    // Figures for the slow motion over 2 s: a rod alone is 0.1 rad and 2.2 rad off with these energies.
    let errors = [error(1e6, 0.01), error(1e8, 0.01), error(1e6, 0.35), error(1e8, 0.35)];
    let bounds = [8e-4, 8e-5, 5e-3, 5e-4];
    for (error, bound) in errors.iter().zip(bounds) {
        assert!(*error < bound && *error > 0.1 * bound, "{error:e} {bound:e}");
    }
    let falls = [errors[0] / errors[1], errors[2] / errors[3]];
    assert!(falls.iter().all(|fall| (7.0..14.0).contains(fall)), "{falls:?}");
}

#[test]
fn a_spring_that_does_not_vibrate_is_a_rod_to_its_stretch() {
    let errors = [error(1e6, 0.0), error(1e8, 0.0)];
    assert!(errors[0] < 1e-5 && errors[1] < 1e-7 && errors[0] > 50.0 * errors[1], "{errors:?}");
    // Then every method takes it.
    let rod = scene(1e6, 0.0, true);
    let end = |method| {
        let request = Request { method: Some(method), until: Some(1.0), every: Some(0.01), ..Request::default() };
        *path(&rod, &request).last().expect("a sample")
    };
    let expected = end(MethodId::Taylor);
    for method in [MethodId::Dp8, MethodId::Dop853, MethodId::Gauss(8), "rattle8".parse().expect("a method")] {
        assert!((end(method) - expected).abs() < 1e-7, "{method}: {:e}", end(method) - expected);
    }
}

#[test]
fn the_energy_with_its_potential_is_kept() {
    let outcome = simulate(&scene(1e6, 0.35, true), &request(MethodId::Dp8, 1e-12), &mut |_| Ok(())).expect("a run");
    assert!(outcome.drift.energy.max < 1e-12, "{:e}", outcome.drift.energy.max);
    assert!(outcome.plan.notes.iter().any(|note| note.contains("of vibration")), "{:?}", outcome.plan.notes);
    // The potential is a good part of it.
    let mechanism = Mechanism::new(&scene(1e6, 0.35, true)).expect("a mechanism");
    let vibration = mechanism.vibration.expect("a vibration");
    assert!((vibration.energy - 0.35).abs() < 1e-6, "{}", vibration.energy);
}

#[test]
fn what_the_mean_force_is_not_known_for_is_refused() {
    let refusal = |scene: &Scene, method| {
        let mechanism = Mechanism::new(scene).map_err(|error| error.to_string())?;
        Plan::new(scene, &mechanism, &Request { method, ..Request::default() }).map_err(|refusal| refusal.to_string())
    };
    let fast = scene(1e6, 0.35, true);
    assert!(refusal(&fast, None).is_ok());
    for method in [MethodId::Taylor, MethodId::Gauss(8), "rattle8".parse().expect("a method")] {
        let text = refusal(&fast, Some(method)).expect_err("a refusal");
        assert!(text.contains("rigid spring `spring`") && text.contains("dp8"), "{text}");
    }
    let soft = refusal(&scene(1e4, 0.35, true), None).expect_err("a refusal");
    assert!(soft.contains("not 100 times as fast"), "{soft}");
    let mut two = scene(1e6, 0.35, true);
    two.springs.push(Spring { name: "other".into(), ..two.springs[0].clone() });
    two.springs[1].between[1].point = [0.5, 0.0];
    two.springs[1].free_length = 0.4 + 0.07;
    let text = refusal(&two, None).expect_err("a refusal");
    assert!(text.contains("no other constraint") || text.contains("no start fits"), "{text}");
}

#[test]
fn a_damped_or_slack_spring_is_no_rod() {
    let text = include_str!("../examples/scenes/spring.json");
    let rigid = |fields: &str| {
        let text = text.replace("\"damping\": 0", fields);
        driftless::scene::parse_scene(&text, "spring.json", &[]).map(|scene| scene.springs[0].rigid).map_err(|error| error.to_string())
    };
    assert_eq!(rigid("\"model\": \"rigid\""), Ok(true));
    assert_eq!(rigid("\"model\": \"elastic\", \"damping\": 1"), Ok(false));
    let damped = rigid("\"model\": \"rigid\", \"damping\": 1").expect_err("an error");
    assert!(damped.contains("springs[0].damping") && damped.contains("decays"), "{damped}");
}
