//! Very stiff springs taken for rods, with what their vibration does on average, against the vibration
//! resolved.

use crate::common;

use common::spring;
use driftless::dynamics::Mechanism;
use driftless::run::trust::Level;
use driftless::run::{Limits, MethodId, Plan, Request, Run, simulate};
use driftless::scene::{Given, Scene, Spring, Start};
use std::sync::Arc;

/// The double pendulum on a spring so many times stiffer than the source's, whose length starts off by what
/// gives it `energy` \[J\].
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
    Request {
        method: Some(method),
        rtol: Some(tolerance),
        until: Some(2.0),
        every: Some(0.02),
        ..Request::default()
    }
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
        let request =
            Request { method: Some(method), until: Some(1.0), every: Some(0.01), ..Request::default() };
        *path(&rod, &request).last().expect("a sample")
    };
    let expected = end(MethodId::Taylor);
    for method in [MethodId::Dp8, MethodId::Dop853, MethodId::Gauss(8), "rattle8".parse().expect("a method")]
    {
        assert!((end(method) - expected).abs() < 1e-7, "{method}: {:e}", end(method) - expected);
    }
}

/// Two bars in the plane without gravity, tied by a spring between their ends that starts with `energy` \[J\]
/// of stretch and lengthens at `rate` \[m/s\].
fn floating(stiffness: f64, energy: f64, rate: f64, model: &str) -> Scene {
    let unit = |angle: f64| [libm::cos(angle), libm::sin(angle)];
    let (b, c, along) = (unit(0.8), unit(2.0), unit(0.3));
    let length = 0.5 + (2.0 * energy / stiffness).sqrt();
    let origin = [0, 1].map(|i| b[i] + length * along[i] - 0.9 * c[i]);
    // Bar b turns at 1 rad/s about its resting origin, bar c at -0.5 rad/s.
    let between = [-0.5 * 0.9 * -c[1] + b[1], -0.5 * 0.9 * c[0] - b[0]];
    let missing = rate - (between[0] * along[0] + between[1] * along[1]);
    let text = format!(
        r#"{{"name": "floating", "gravity": [0, 0],
        "bars": [{{"name": "b", "mass": 1, "centre": [0.5, 0], "inertia": 0.08, "length": 1}},
                 {{"name": "c", "mass": 2, "centre": [0.5, 0], "inertia": 0.2, "length": 1}}],
        "springs": [{{"name": "rod", "between": [{{"body": "b", "point": [1, 0]}}, {{"body": "c", "point": [0.9, 0]}}],
                     "stiffness": {stiffness:?}, "free_length": 0.5, "model": "{model}"}}],
        "start": {{"b": {{"phi": 0.8, "omega": 1, "origin": [0, 0], "velocity": [0, 0]}},
                  "c": {{"phi": 2, "omega": -0.5, "origin": {origin:?}, "velocity": {velocity:?}}}}},
        "until": 1, "every": 0.05}}"#,
        velocity = [missing * along[0], missing * along[1]],
    );
    driftless::scene::parse_scene(&text, "floating.json", &[]).expect("a scene")
}

/// All angles and positions, at all output times.
fn whole_path(scene: &Scene, method: MethodId, tolerance: f64) -> Vec<f64> {
    let request = Request { method: Some(method), rtol: Some(tolerance), ..Request::default() };
    let mut path = Vec::new();
    let outcome = simulate(scene, &request, &mut |sample| {
        path.extend_from_slice(&sample.phi);
        Ok(())
    });
    assert_eq!(outcome.expect("a run").stop, None);
    path
}

#[test]
fn free_bodies_feel_the_mean_force_of_their_spring() {
    let error = |stiffness: f64| {
        let elastic = whole_path(&floating(stiffness, 0.5, 1.0, "elastic"), MethodId::Taylor, 1e-11);
        let rigid = whole_path(&floating(stiffness, 0.5, 1.0, "rigid"), MethodId::Dp8, 1e-9);
        elastic.iter().zip(&rigid).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let errors = [1e6, 1e7, 1e8].map(error);
    // A rod alone, or one whose start keeps the rate along the spring, is tenths of a radian off at every
    // stiffness.
    assert!(errors[0] < 1e-2 && errors[2] < 1e-3, "{errors:?}");
    let falls = [errors[0] / errors[1], errors[1] / errors[2]];
    assert!(falls.iter().all(|fall| (2.0..5.0).contains(fall)), "as 1/sqrt(k), by 3.2 each: {errors:?}");
}

#[test]
fn a_rate_along_the_spring_is_its_vibration() {
    // Bar 1 turns at 2 rad/s, which its spring lets it do for a moment; the slow motion begins without it.
    let moving = |factor: f64, rigid: bool| {
        let mut scene = scene(factor, 0.0, rigid);
        (scene.start[0].omega, scene.start[1].omega) = (2.0, 1.0);
        scene
    };
    let error = |factor: f64| {
        let elastic = path(&moving(factor, false), &request(MethodId::Taylor, 1e-12));
        let rigid = path(&moving(factor, true), &request(MethodId::Dp8, 1e-9));
        elastic.iter().zip(&rigid).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let errors = [error(1e6), error(1e8)];
    assert!(errors[1] < 1e-3 && (6.0..16.0).contains(&(errors[0] / errors[1])), "{errors:?}");
}

#[test]
fn a_start_given_in_part_vibrates_as_the_whole_one() {
    let mut partial = scene(1e7, 0.35, true);
    partial.given = vec![Given::ANGLE_AND_RATE, Given { omega: false, ..Given::ANGLE_AND_RATE }];
    let elastic = path(&scene(1e7, 0.35, false), &request(MethodId::Taylor, 1e-12));
    let rigid = path(&partial, &request(MethodId::Dp8, 1e-9));
    let error = elastic.iter().zip(&rigid).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(error < 3e-3, "{error:e}");
}

#[test]
fn the_model_is_no_better_than_it_says() {
    for (stiffness, energy, rate) in [(1e6, 0.5, 1.0), (1e7, 0.0, 0.0)] {
        let scene = floating(stiffness, energy, rate, "rigid");
        let mechanism = Arc::new(Mechanism::new(&scene).expect("a mechanism"));
        let start = mechanism.start(&scene);
        let plan =
            Plan::new(&scene, &mechanism, &Request { method: Some(MethodId::Dp8), ..Request::default() })
                .expect("a plan");
        let said = plan.model_error.expect("an error of the model");
        assert!(plan.notes.iter().any(|note| note.contains("are a model")), "{:?}", plan.notes);
        let run =
            Run::new(mechanism, plan, Limits::default(), &start).expect("a run").trusted(Level::Auto, &start);
        let trust =
            driftless::run::integrate(run, &mut |_| Ok(())).expect("an outcome").trust.expect("asked for");
        assert!(
            trust.model_error == Some(said) && trust.error_estimate.is_none_or(|estimate| estimate >= said),
            "{trust:?}"
        );
        let elastic = whole_path(&floating(stiffness, energy, rate, "elastic"), MethodId::Taylor, 1e-11);
        let rigid = whole_path(&scene, MethodId::Dp8, 1e-9);
        let error = elastic.iter().zip(&rigid).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 5.0 * said && error > 1e-3 * said, "{error:e} of {said:e}");
    }
}

/// A ball of 1 kg on a rope of 1 m and so many N/m, let go beside the point it hangs from, which is drawn at
/// a height \[m\].
fn rope(stiffness: f64, height: f64, model: &str) -> Scene {
    let text = format!(
        r#"{{"name": "rope", "gravity": [0, -9.81],
        "bars": [{{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.01, "length": 1}}],
        "springs": [{{"name": "rope", "between": [{{"body": "ground", "point": [0, {height:?}]}},
                                                 {{"body": "ball", "point": [0, 0]}}],
                     "stiffness": {stiffness:?}, "free_length": 1, "model": "{model}"}}],
        "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [1, {height:?}], "velocity": [0, 0]}}}},
        "until": 1.5, "every": 0.05}}"#
    );
    driftless::scene::parse_scene(&text, "rope.json", &[]).expect("a scene")
}

fn planned(scene: &Scene, method: &str) -> Result<Plan, driftless::run::RequestRefusal> {
    let request = Request { method: Some(method.parse().expect("a method")), ..Request::default() };
    Plan::new(scene, &Mechanism::new(scene).expect("a mechanism"), &request)
}

#[test]
fn where_a_rope_is_drawn_does_not_matter() {
    // At the bottom the rope carries 3 m g, and is longer by 3 m g / k.
    for (stiffness, stretch) in [(1e4, 2.943e-3), (1e6, 2.943e-5), (1e8, 2.943e-7)] {
        for height in [-1000.0, -10.0, 0.0, 1.0, 10.0, 1000.0] {
            let scene = rope(stiffness, height, "rigid");
            let said = planned(&scene, "taylor").expect("a plan").model_error.expect("an error of the model");
            assert!((0.5..3.0).contains(&(said / stretch)), "{height} m: {said:e} of {stretch:e}");
            let step = |scene: &Scene| planned(scene, "gauss6").expect("a plan").step;
            assert_eq!(step(&scene), step(&rope(stiffness, 0.0, "rigid")), "{height} m");
        }
    }
}

#[test]
fn a_rope_too_soft_for_a_rod_is_refused() {
    for stiffness in [0.05, 1.0, 20.0] {
        let refusal = planned(&rope(stiffness, 0.0, "rigid"), "taylor").expect_err("a rope that gives way");
        assert!(refusal.to_string().contains("the rigid spring `rope`"), "{refusal}");
    }
    assert!(planned(&rope(1e3, 0.0, "rigid"), "taylor").is_ok());
}

#[test]
fn the_error_of_the_model_grows_with_the_motion() {
    for stiffness in [1e5, 1e6, 1e7] {
        let scene = rope(stiffness, 0.0, "rigid");
        let mechanism = Arc::new(Mechanism::new(&scene).expect("a mechanism"));
        let (start, plan) = (mechanism.start(&scene), planned(&scene, "taylor").expect("a plan"));
        let run = Run::new(mechanism, plan, Limits::default(), &start).expect("a run");
        let run = run.trusted(Level::Auto, &start);
        let trust =
            driftless::run::integrate(run, &mut |_| Ok(())).expect("an outcome").trust.expect("asked for");
        let elastic = whole_path(&rope(stiffness, 0.0, "elastic"), MethodId::Taylor, 1e-12);
        let rigid = whole_path(&scene, MethodId::Taylor, 1e-12);
        let error = elastic.iter().zip(&rigid).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let said = trust.error_estimate.expect("an estimate");
        assert!((1.0 / 3.0..10.0).contains(&(said / error)), "{said:e} of {error:e}");
    }
}

#[test]
fn the_energy_with_its_potential_is_kept() {
    let outcome =
        simulate(&scene(1e6, 0.35, true), &request(MethodId::Dp8, 1e-12), &mut |_| Ok(())).expect("a run");
    // Measured 5.4e-12 with steps as long as the tolerance allows.
    assert!(outcome.drift.energy.max < 2e-11, "{:e}", outcome.drift.energy.max);
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
        Plan::new(scene, &mechanism, &Request { method, ..Request::default() })
            .map_err(|refusal| refusal.to_string())
    };
    let fast = scene(1e6, 0.35, true);
    assert!(refusal(&fast, None).is_ok());
    for method in [MethodId::Taylor, MethodId::Gauss(8), "rattle8".parse().expect("a method")] {
        let text = refusal(&fast, Some(method)).expect_err("a refusal");
        assert!(text.contains("rigid spring `spring`") && text.contains("dp8"), "{text}");
    }
    let soft = refusal(&scene(1e4, 0.35, true), None).expect_err("a refusal");
    assert!(soft.contains("not 100 times as fast"), "{soft}");
    // A damper elsewhere takes the vibration's energy away, too.
    let mut damped = scene(1e6, 0.35, true);
    damped.springs.push(Spring {
        name: "damper".into(),
        rigid: false,
        damping: 0.1,
        stiffness: 1.0,
        ..damped.springs[0].clone()
    });
    let text = refusal(&damped, None).expect_err("a refusal");
    assert!(text.contains("wall or damper"), "{text}");
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
        driftless::scene::parse_scene(&text, "spring.json", &[])
            .map(|scene| scene.springs[0].rigid)
            .map_err(|error| error.to_string())
    };
    assert_eq!(rigid("\"model\": \"rigid\""), Ok(true));
    assert_eq!(rigid("\"model\": \"elastic\", \"damping\": 1"), Ok(false));
    let damped = rigid("\"model\": \"rigid\", \"damping\": 1").expect_err("an error");
    assert!(damped.contains("springs[0].damping") && damped.contains("decays"), "{damped}");
}

/// A mass let go from the horizontal on a rod, which carries m g + 2 m g at the lowest point.
#[test]
fn the_force_of_a_rod_is_an_output_by_itself() {
    let text = r#"{"name": "rod", "gravity": [0, -9.81],
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.01, "length": 0.1}],
        "springs": [{"name": "S", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}],
                     "stiffness": 1e12, "free_length": 1, "model": "rigid"}],
        "start": {"b": {"phi": 0, "omega": 0, "origin": [1, 0], "velocity": [0, 0]}},
        "until": 1, "every": 0.1, "outputs": {"f": "S.force"}}"#;
    let scene = driftless::scene::parse_scene(text, "rod.json", &[]).expect("a scene");
    let outcome = simulate(&scene, &request(MethodId::Dp8, 1e-11), &mut |_| Ok(())).expect("a run");
    assert_eq!(outcome.stop, None);
    let most = outcome.extremes[0].max[0];
    assert!((most - 3.0 * 9.81).abs() < 1e-6, "{most}");
}
