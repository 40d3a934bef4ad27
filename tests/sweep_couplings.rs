//! Sweeps over gears, cams and carts: against single runs and closed forms, and with the same bits whoever is
//! beside whom.

use crate::sweep::points;
use crate::sweep_loops::{by_taylor, planned, same_whoever_is_beside, shipped};
use driftless::run::trust::Level;
use driftless::run::{Status, simulate};
use driftless::scene::Template;

/// A shaft under a torque that drives a wheel by a gear and lifts a follower by a cam, with parameters for
/// both.
fn gear_and_cam() -> Template {
    let text = include_str!("laws/gear_and_cam.json")
        .replace(r#""bars": ["#, r#""parameters": {"ratio": 2, "lift": "20 mm"}, "bars": ["#)
        .replace("-2*shaft.phi", "-ratio*shaft.phi")
        .replace("20 mm*(1", "lift*(1")
        .replace(r#""outputs": ["gear.torque", "cam.force"],"#, "");
    Template::new(text, "gear and cam".into(), &[])
}

#[test]
fn points_of_gears_and_cams_agree_with_single_runs() {
    for (template, vary, until) in [
        (gear_and_cam(), vec!["parameters.ratio=-2..3:11"], 0.8),
        (gear_and_cam(), vec!["parameters.lift=0.01..0.03:3", "shaft.omega=3..5:4"], 0.8),
        (gear_and_cam(), vec!["bars.follower.mass=0.2..0.6:11"], 0.8),
        (shipped("cart_pole"), vec!["bars.cart.mass=0.5..2:11"], 1.5),
        (shipped("cart_pole"), vec!["pole.phi=0.3..1.4:11"], 1.5),
    ] {
        let request = by_taylor(until, 1e-12);
        let plan = planned(&template, &vary, &request);
        let mut are_others = false;
        for point in points(&plan, 1) {
            let alone = template.filled(plan.variables(), &point.values).expect("a scene");
            let outcome = simulate(&alone, &request, &mut |_| Ok(())).expect("a run");
            assert_eq!((&point.status, point.t), (&Status::Done, until), "{vary:?}");
            let fastest = point.omega.iter().fold(1.0, |most: f64, omega| most.max(omega.abs()));
            let [position, rate] = point.constraint.expect("constraints");
            assert!(position < 5e-15 && rate < 1e-14 * fastest, "{vary:?}: {point:?}");
            assert!(point.energy < 1e-9, "{vary:?}: {point:?}");
            are_others |= (point.steps, point.energy) != (outcome.statistics.steps, outcome.drift.energy.max);
            are_others |= (&point.phi, &point.omega) != (&outcome.last.phi, &outcome.last.omega);
            assert_eq!(point.phi.len(), outcome.last.phi.len());
            for (found, exact) in point.phi.iter().zip(&outcome.last.phi) {
                assert!((found - exact).abs() < 1e-9, "{vary:?}: {point:?} {outcome:?}");
            }
            for (found, exact) in point.omega.iter().zip(&outcome.last.omega) {
                assert!((found - exact).abs() < 1e-9 * fastest, "{vary:?}: {point:?} {outcome:?}");
            }
        }
        // Points that run one by one have the bits and the steps of the single run.
        assert!(are_others, "{vary:?}");
    }
}

/// Alone, with others beside, in another order, in parts and on threads.
#[test]
fn neighbours_make_no_difference_to_points_of_gears_and_cams() {
    for (template, name, until) in [
        // Through a ratio of zero, which has another structure.
        (gear_and_cam(), "parameters.ratio=-2..5:29", 0.8),
        (gear_and_cam(), "parameters.lift=0.01..0.03:29", 0.8),
        (shipped("cart_pole"), "bars.cart.mass=0.5..2:29", 1.5),
    ] {
        let request = by_taylor(until, 1e-9);
        let whole = same_whoever_is_beside(&template, name, &request);
        let judged = points(&planned(&template, &[name], &request).trusted(Level::Auto), 1);
        for (mut point, bare) in judged.into_iter().zip(&whole) {
            let error = point.trust.take().and_then(|trust| trust.error).expect("an error");
            assert!(error < 1e-6, "{point:?}: {error:e}");
            assert_eq!(point, *bare);
        }
    }
}

/// A wheel that a shaft turns by a gear of ratio n, by a torque T and against gravity on neither: the angle is
/// that of the inertia I + n² J, and the wheel's is n times as large, many turns on.
#[test]
fn a_geared_shaft_is_one_of_more_inertia() {
    let text = r#"{"name": "gear", "gravity": [0, -9.81], "parameters": {"ratio": 2},
        "bars": [{"name": "shaft", "mass": 1, "centre": [0, 0], "inertia": 0.5},
            {"name": "wheel", "mass": 1, "centre": [0, 0], "inertia": 0.03}],
        "hinges": [
            {"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "shaft", "point": [0, 0]}]},
            {"name": "B", "between": [{"body": "ground", "point": [1, 0]}, {"body": "wheel", "point": [0, 0]}]}],
        "motors": [{"name": "gear", "body": "wheel", "law": "-ratio*shaft.phi"}],
        "torques": [{"name": "drive", "body": "shaft", "torque": 1.5}],
        "start": {"shaft": {"phi": 0.3, "omega": 20}}, "until": 20, "every": 20}"#;
    let template = Template::new(text.into(), "gear".into(), &[]);
    for point in points(&planned(&template, &["parameters.ratio=1..3:16"], &by_taylor(20.0, 1e-12)), 1) {
        let ratio = point.values[0];
        let bend = 1.5 / (0.5 + ratio * ratio * 0.03);
        let [phi, omega] = [0.3 + 400.0 + 200.0 * bend, 20.0 + 20.0 * bend];
        for (found, exact) in [
            (point.phi[0], phi),
            (point.phi[1], -ratio * phi),
            (point.omega[0], omega),
            (point.omega[1], -ratio * omega),
        ] {
            assert!((found - exact).abs() < 1e-13 * exact.abs(), "{point:?}: {exact}");
        }
    }
}
