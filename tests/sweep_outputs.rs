//! Sweeps of scenes with outputs: extremes, means and rms of points in lanes against single runs and closed
//! forms, and with the same bits whoever is beside whom.

use crate::sweep::points;
use crate::sweep_loops::{by_taylor, shipped};
use driftless::run::{Outcome, Request, Status, Sweep, SweepPoint, simulate};
use driftless::scene::{Output, Template};
use driftless::stepping::taylor::batch::Batch;
use std::f64::consts::PI;

pub fn with_outputs(template: Template, outputs: &[&str]) -> Template {
    template.with_outputs(outputs.iter().copied().map(Output::parse).collect())
}

fn planned(template: &Template, vary: &[&str], request: &Request) -> Sweep {
    let vary = vary.iter().map(|vary| vary.parse().expect("a range")).collect();
    let plan = Sweep::new(template, vary, request).expect("a sweep");
    let mechanism = plan.mechanism();
    assert!(Batch::takes(mechanism) || Batch::takes_alike(mechanism));
    plan
}

/// How far the outputs of a point are from those of a single run, over their largest magnitudes.
pub fn off(point: &SweepPoint, outcome: &Outcome) -> f64 {
    assert_eq!(point.extremes.len(), outcome.extremes.len());
    point.extremes.iter().zip(&outcome.extremes).fold(0.0, |most: f64, (found, alone)| {
        let size = alone.min[0].abs().max(alone.max[0].abs()).max(1e-4);
        let alone = [alone.min[0], alone.max[0], alone.mean, alone.rms];
        found.iter().zip(alone).fold(most, |most, (found, alone)| most.max((found - alone).abs() / size))
    })
}

/// The points of a sweep, none of them a single run, and how far they are from these at most.
fn against_single_runs(template: &Template, vary: &[&str], request: &Request) -> (Vec<SweepPoint>, f64) {
    let plan = planned(template, vary, request);
    let (found, mut most) = (points(&plan, 1), 0.0);
    for point in &found {
        let alone = template.filled(plan.variables(), &point.values).expect("a scene");
        let outcome = simulate(&alone, request, &mut |_| Ok(())).expect("a run");
        assert_eq!((&point.status, outcome.stop.as_ref()), (&Status::Done, None), "{vary:?}");
        // Points that run one by one have the bits and the steps of the single run.
        let bits = (&outcome.last.phi, &outcome.last.omega, outcome.statistics.steps);
        assert!((&point.phi, &point.omega, point.steps) != bits, "{vary:?}: {point:?}");
        most = off(point, &outcome).max(most);
    }
    (found, most)
}

/// Every kind of lanes: free bodies with springs and without, one or two of them driven, trees, formulas,
/// integrals, bodies that float, loops with singular positions and without, gears and cams, walls.
#[test]
fn outputs_in_lanes_are_those_of_single_runs() {
    let gear = Template::new(include_str!("laws/gear_and_cam.json").into(), "gear and cam".into(), &[]);
    let mut text: serde_json::Value =
        serde_json::from_str(include_str!("../examples/scenes/free.json")).expect("JSON");
    text["integrals"] = serde_json::json!({"sum": "bar2.omega*bar1.cos"});
    let summed = Template::new(text.to_string(), "summed".into(), &[]);
    for (template, vary, outputs, until, near) in [
        (
            shipped("free"),
            vec!["bar1.phi=-3..3:3", "bar2.density=300..900:3"],
            vec!["A.force", "bar2.y"],
            1.0,
            1e-9,
        ),
        (shipped("spring"), vec!["spring.stiffness=5..9:9"], vec!["spring.force", "bar2.alpha"], 1.0, 1e-9),
        (shipped("motor"), vec!["motor.rate=-9..9:9"], vec!["motor.torque", "bar2.phi", "B.fx"], 1.0, 1e-9),
        (shipped("motor_sine"), vec!["bar2.phi=-2..2:9"], vec!["motor.power", "bar2.vx"], 1.0, 1e-9),
        (
            shipped("branch"),
            vec!["plate.omega=-1..1:9"],
            vec!["plate.ax", "sqrt(plate.x^2 + plate.y^2)"],
            1.0,
            1e-9,
        ),
        (shipped("duffing"), vec!["bar.omega=-1..1:9"], vec!["bar.alpha", "t*bar.phi"], 3.0, 1e-9),
        (shipped("kite"), vec!["crank.omega=6..8:9"], vec!["coupler.vy", "rocker.x"], 1.0, 1e-6),
        (shipped("andrews"), vec!["springs.spring.stiffness=4000..5000:9"], vec!["spring.force"], 0.01, 1e-9),
        (shipped("four_bar_motor"), vec!["motors.motor.law.rate=5..7:9"], vec!["motor.torque"], 0.7, 1e-9),
        (shipped("cart_pole"), vec!["pole.phi=0.3..1.4:9"], vec!["cart.x", "pole.alpha"], 1.0, 1e-9),
        (summed, vec!["bar1.phi=-3..3:9"], vec!["sum", "S=sum^2 - bar2.x"], 1.0, 1e-9),
        (gear, vec!["shaft.omega=3..8:9"], vec!["gear.torque", "cam.force"], 0.8, 1e-9),
        (shipped("wall"), vec!["bar1.phi=0.5..1.4:9"], vec!["wall.gap", "bar2.y", "A.fy"], 1.2, 1e-9),
    ] {
        let template = with_outputs(template, &outputs);
        let request = by_taylor(until, 1e-12);
        let (found, most) = against_single_runs(&template, &vary, &request);
        println!("{vary:?}: {most:.1e}");
        assert!(most < near, "{vary:?}: {most:e}");
        let plan = planned(&template, &vary, &request);
        for point in found.iter().step_by(4) {
            assert_eq!(plan.point(point.index).as_ref(), Some(point), "{vary:?}");
        }
        assert_eq!(points(&plan, 2), found, "{vary:?}");
    }
}

/// Extremes are located inside the steps, whatever the output times; a plate that is thrown and spins.
#[test]
fn extremes_in_lanes_are_those_of_closed_forms() {
    let text = r#"{"name": "thrown", "gravity": [0, -10],
        "bars": [{"name": "plate", "mass": 2, "centre": [0, 0], "inertia": 0.1, "length": 1}],
        "points": [{"name": "tip", "body": "plate", "point": [0.5, 0]}],
        "outputs": {"height": "plate.y", "across": "tip.x - plate.x",
            "rate": "plate.omega", "fall": "plate.ay"},
        "start": {"plate": {"phi": 0, "omega": 3, "origin": [0, 1], "velocity": [1, 6]}},
        "until": 4, "every": 4}"#;
    let template = Template::new(text.into(), "thrown".into(), &[]);
    for every in [4.0, 0.37] {
        let request = Request { every: Some(every), ..by_taylor(4.0, 1e-12) };
        for point in points(&planned(&template, &["plate.omega=2..6:12"], &request), 1) {
            let [height, across, rate, fall] = point.extremes[..] else { panic!("{point:?}") };
            let omega = point.values[0];
            // 1 + 6 t - 5 t² and its mean.
            let exact = [1.0 + 24.0 - 80.0, 1.0 + 36.0 / 20.0, 1.0 + 12.0 - 80.0 / 3.0];
            for (found, exact) in height.iter().zip(exact) {
                assert!((found - exact).abs() < 1e-12, "{point:?}: {exact}");
            }
            let least = if omega * 4.0 > PI { -0.5 } else { 0.5 * (4.0 * omega).cos() };
            let mean = 0.5 * (4.0 * omega).sin() / (4.0 * omega);
            for (found, exact) in across.iter().zip([least, 0.5, mean]) {
                assert!((found - exact).abs() < 1e-12, "{point:?}: {exact}");
            }
            assert!(rate.iter().all(|value| (value - omega).abs() < 1e-13 * omega), "{point:?}");
            assert!(fall[..3].iter().all(|value| (value + 10.0).abs() < 1e-12), "{point:?}");
        }
    }
}
