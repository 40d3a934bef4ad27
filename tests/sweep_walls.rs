//! Sweeps of scenes with walls: points leave their lanes for impacts and come back, against closed forms and
//! single runs.

use driftless::dynamics::Mechanism;
use driftless::run::trust::Level;
use driftless::run::{Request, Status, Sweep, SweepPoint, simulate, sweep};
use driftless::scene::Template;
use driftless::stepping::taylor::batch::Batch;
use std::f64::consts::PI;

fn points(template: &Template, vary: &[&str], request: &Request, trust: Level) -> Vec<SweepPoint> {
    let mechanism = Mechanism::new(&template.scene().expect("a scene")).expect("a mechanism");
    assert!(!mechanism.contacts.is_empty() && Batch::takes_alike(&mechanism));
    let vary = vary.iter().map(|vary| vary.parse().expect("a range")).collect();
    let plan = Sweep::new(template, vary, request).expect("a sweep").trusted(trust);
    let mut points = Vec::new();
    sweep(&plan, 1, &mut |point: &SweepPoint| {
        points.push(point.clone());
        Ok(())
    })
    .expect("all points");
    // Each by itself has the bits it has beside the others.
    for point in &points {
        assert_eq!(plan.point(point.index).as_ref(), Some(point));
    }
    points
}

fn by_taylor(until: f64, rtol: f64) -> Request {
    Request {
        method: Some("taylor".parse().expect("a method")),
        until: Some(until),
        rtol: Some(rtol),
        ..Request::default()
    }
}

/// A bar about the origin whose tip must not come below the x axis.
fn bar(gravity: f64, restitution: f64, more: &str) -> Template {
    let text = format!(
        r#"{{"name": "bar", "gravity": [0, {gravity}],
            "bars": [{{"name": "bar", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}}],
            "hinges": [{{"name": "A", "between": [
                {{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}}],
            "walls": [{{"name": "floor", "body": "bar", "point": [1, 0],
                "line": {{"through": [0, 0], "normal": [0, 1]}}, "restitution": {restitution} {more}}}],
            "start": {{"bar": {{"phi": "90 deg", "omega": 1}}}}, "until": 20, "every": 20}}"#
    );
    Template::new(text, "bar".into(), &[])
}

/// Without gravity the bar turns evenly to and fro between 0 and pi.
#[test]
fn bounces_are_those_of_the_closed_form() {
    for restitution in [1.0, 0.8] {
        let request = by_taylor(20.0, 1e-10);
        for point in points(&bar(0.0, restitution, ""), &["bar.omega=-3..3:12"], &request, Level::Off) {
            let (mut phi, mut omega, mut left) = (0.5 * PI, point.values[0], 20.0);
            loop {
                let way = if omega > 0.0 { PI - phi } else { phi };
                if way / omega.abs() > left {
                    break;
                }
                left -= way / omega.abs();
                phi = if omega > 0.0 { PI } else { 0.0 };
                omega *= -restitution;
            }
            let found = (point.phi[0], point.omega[0]);
            assert!((found.0 - (phi + omega * left)).abs() < 1e-9, "{point:?}");
            assert!((found.1 - omega).abs() < 1e-10, "{point:?}");
            assert!(point.energy < 1e-12 && point.status == Status::Done, "{point:?}");
        }
    }
}

/// Under gravity it comes to rest on the floor, the energy that the impact takes booked; until then its energy
/// gives the rate.
#[test]
fn what_comes_to_rest_stays_in_sweeps_too() {
    let request = by_taylor(3.0, 1e-10);
    for trust in [Level::Off, Level::Auto] {
        for point in points(&bar(-9.81, 0.0, ""), &["bar.omega=0.1..2:9"], &request, trust) {
            assert!((point.phi[0] - PI).abs() < 1e-10 && point.omega[0].abs() < 1e-10, "{point:?}");
            assert!(point.energy < 1e-9 && point.status == Status::Done, "{point:?}");
            let is_sure = point
                .trust
                .as_ref()
                .is_none_or(|trust| trust.horizon.is_none() && trust.error.is_some_and(|error| error < 1e-6));
            assert!(is_sure && point.trust.is_some() == (trust == Level::Auto), "{point:?}");
        }
    }
}

/// A floor that sinks below the bar at rest on it, evenly: sin(phi) = -v t, and the floor works.
#[test]
fn floors_that_move_are_followed() {
    let sinking = r#", "law": {"start": 0, "rate": -0.2}"#;
    let text = bar(-9.81, 0.0, sinking);
    let request = by_taylor(2.0, 1e-11);
    for point in points(&text, &["bar.omega=0.5..2:9"], &request, Level::Off) {
        assert!((point.phi[0].sin() + 0.4).abs() < 1e-9, "{point:?}");
        assert!((point.omega[0] * point.phi[0].cos() + 0.2).abs() < 1e-9, "{point:?}");
        assert!(point.energy < 1e-9, "{point:?}");
    }
}

/// Double pendulums at a wall, one of whose bars a motor turns, and a crank with a slider that a wall of another body meets.
#[test]
fn points_with_walls_agree_with_single_runs() {
    let shipped = |name: &str| {
        Template::read(format!("examples/scenes/{name}.json").as_ref(), &[]).expect("a shipped scene")
    };
    let slider = r#"{"name": "buffer", "gravity": [0, -9.81],
        "bars": [{"name": "crank", "mass": 1, "centre": [0.1, 0], "inertia": 0.01, "length": 0.2},
            {"name": "rod", "mass": 0.5, "centre": [0.25, 0], "inertia": 0.01, "length": 0.5},
            {"name": "flap", "mass": 0.3, "centre": [0.1, 0], "inertia": 0.002, "length": 0.2}],
        "hinges": [
            {"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "crank", "point": [0, 0]}]},
            {"name": "B", "between": [{"body": "crank", "point": [0.2, 0]}, {"body": "rod", "point": [0, 0]}]},
            {"name": "C", "between": [{"body": "rod", "point": [0.25, 0]}, {"body": "flap", "point": [0, 0]}]}],
        "sliders": [{"name": "S", "point": {"body": "rod", "point": [0.5, 0]},
            "rail": {"body": "ground", "point": [0, 0.02], "direction": [1, 0]}}],
        "torques": [{"name": "drag", "body": "crank", "torque": "-0.02*tanh(1*crank.omega)"}],
        "walls": [{"name": "stop", "body": "rod", "point": [0.5, 0], "restitution": 0.6,
                "line": {"through": [0.65, 0], "normal": [-1, 0]}},
            {"name": "hook", "body": "flap", "point": [0.2, 0], "restitution": 0.5,
                "line": {"body": "rod", "through": [0, 0.15], "normal": [0, -1]}}],
        "start": {"crank": {"phi": 2, "omega": 3}, "rod": {"phi": -0.3}, "flap": {"phi": -1.5, "omega": 0}},
        "until": 2, "every": 0.5}"#;
    let buffer = Template::new(slider.into(), "buffer".into(), &[]);
    let mut driven: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string("examples/scenes/motor.json").expect("a file"))
            .expect("JSON");
    driven["walls"] = serde_json::json!([{"name": "flap", "body": "bar2", "point": [0.6, 0], "restitution": 0.9,
        "line": {"body": "bar1", "through": [0.5, 0.1], "normal": [0, -1]}}]);
    driven["start"]["bar2"] = serde_json::json!({"phi": 1, "omega": 0});
    let driven = Template::new(driven.to_string(), "driven".into(), &[]);
    for (template, vary, until) in [
        (shipped("wall"), "bar1.phi=0.5..1.4:8", 1.2),
        (shipped("wall"), "bars.bar2.density=400..900:8", 1.2),
        (shipped("wall"), "walls.wall.restitution=0.4..0.9:8", 1.2),
        (driven, "bar2.omega=-2..2:8", 1.5),
        (buffer.clone(), "crank.omega=-4..4:8", 1.5),
        (buffer, "bars.rod.mass=0.3..0.7:8", 1.5),
    ] {
        let request = Request { every: Some(0.25), ..by_taylor(until, 1e-12) };
        let mut impacts = 0;
        for point in points(&template, &[vary], &request, Level::Off) {
            let name = vary.split('=').next().expect("a name");
            let variable = template.variable(name).expect("a value");
            let alone = template.filled(&[variable], &point.values).expect("a scene");
            let outcome = simulate(&alone, &request, &mut |_| Ok(())).expect("a run");
            impacts += outcome.impact_count;
            assert_eq!((&point.status, outcome.stop.as_ref()), (&Status::Done, None), "{vary}");
            for (found, exact) in
                point.phi.iter().chain(&point.omega).zip(outcome.last.phi.iter().chain(&outcome.last.omega))
            {
                assert!((found - exact).abs() < 1e-7, "{vary}: {point:?} {:?}", outcome.last);
            }
            assert!(point.energy < 1e-9, "{vary}: {point:?}");
        }
        assert!(impacts > 12, "{vary}: {impacts}");
        println!("{vary}: {impacts} impacts");
    }
}
