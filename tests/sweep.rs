//! Sweeps: each point is the run it stands for, the table does not depend on the threads, bad points end
//! nothing, flips are where they are.

#[cfg(feature = "cli")]
use crate::program;

use driftless::dynamics::{Mechanism, Time};
use driftless::run::sweep::table::{SweepLayout, columns, numbers};
use driftless::run::trust::Level;
use driftless::run::{
    Flip, Limits, MethodId, Outcome, PointObserver, Request, Shard, Stabilization, Status, Sweep, SweepError,
    SweepPoint, SweepTable, Vary, reference, simulate, sweep,
};
use driftless::scene::{Output, Override, Template};
use driftless::stepping::{Cause, taylor::batch::Batch};
use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

fn template(name: &str) -> Template {
    Template::read(format!("examples/scenes/{name}.json").as_ref(), &[]).expect("a shipped scene")
}

fn prepared(scene: &str, vary: &[&str], request: &Request) -> Sweep {
    let vary: Vec<Vary> = vary.iter().map(|vary| vary.parse().expect("a range")).collect();
    Sweep::new(&template(scene), vary, request).expect("a sweep")
}

pub fn points(plan: &Sweep, threads: usize) -> Vec<SweepPoint> {
    let mut points = Vec::new();
    sweep(plan, threads, &mut |point: &SweepPoint| {
        points.push(point.clone());
        Ok(())
    })
    .expect("all points");
    points
}

fn request(method: &str, until: f64) -> Request {
    Request { method: Some(method.parse().expect("a method")), until: Some(until), ..Request::default() }
}

#[test]
fn every_point_is_the_run_it_stands_for() {
    for (scene, method, vary, stabilize) in [
        ("free", "dop853", ["bar1.phi=0.5..2:2", "bar2.omega=-1..1:2"], None),
        ("free", "gauss8", ["bar1.phi=0.5..2:2", "bars.bar2.density=500..900:2"], None),
        ("free", "rattle4", ["bar1.phi=0.5..2:2", "gravity[0]=1..9.81:2"], None),
        ("spring", "dp8", ["bar1.phi=0.5..2:2", "spring.stiffness=5..10:2"], None),
        ("one_sided_spring", "taylor", ["bar.omega=0..1:2", "bars.bar.inertia=0.015..0.02:2"], None),
        ("motor", "dp8", ["bar2.phi=0.5..2:2", "bar2.omega=0..3:2"], Some(Stabilization::Projection)),
        ("motor", "dop853", ["bar2.phi=0.5..2:2", "bar2.omega=0..3:2"], Some(Stabilization::Baumgarte)),
        ("wall", "dp8", ["wall.restitution=0.2..0.8:2", "gravity[0]=5..9:2"], None),
    ] {
        let request = Request { stabilize, every: Some(0.25), ..request(method, 2.0) };
        let plan = prepared(scene, &vary, &request);
        for point in points(&plan, 1) {
            let alone = template(scene).filled(plan.variables(), &point.values).expect("a scene");
            let outcome = simulate(&alone, &request, &mut |_| Ok(())).expect("a run");
            assert_eq!(point.status, outcome.stop.clone().map_or(Status::Done, Status::Stopped));
            assert_eq!(
                (point.t, &point.phi, &point.omega),
                (outcome.last.t, &outcome.last.phi, &outcome.last.omega),
                "{scene} {method}"
            );
            assert_eq!(
                (point.energy, point.steps),
                (outcome.drift.energy.max, outcome.statistics.steps),
                "{scene} {method}"
            );
            let defects = outcome.drift.constraints.first().map(|(_, levels)| [levels[0].max, levels[1].max]);
            assert_eq!(point.constraint, defects);
        }
    }
}

/// The run alone of a point that is integrated over a second, with which it agrees.
fn agreed(scene: &str, plan: &Sweep, point: &SweepPoint, request: &Request) -> Outcome {
    let alone = template(scene).filled(plan.variables(), &point.values).expect("a scene");
    let outcome = simulate(&alone, request, &mut |_| Ok(())).expect("a run");
    assert_eq!((&point.status, point.t), (&Status::Done, 1.0));
    for (found, exact) in
        point.phi.iter().chain(&point.omega).zip(outcome.last.phi.iter().chain(&outcome.last.omega))
    {
        assert!((found - exact).abs() < 1e-9, "{scene}: {point:?} {outcome:?}");
    }
    assert!(point.energy < 1e-12, "{scene}: {point:?}");
    outcome
}

#[test]
fn points_in_lanes_agree_with_single_runs() {
    let request = Request { rtol: Some(1e-12), ..request("taylor", 1.0) };
    for (scene, vary) in [
        ("free", ["bar1.phi=-3..3:5", "bar2.density=300..900:3"]),
        ("motor", ["motor.rate=-9..9:5", "bar2.phi=-3..3:3"]),
        ("spring", ["bar1.phi=-3..3:5", "spring.free_length=0.2..0.5:3"]),
        ("motor_sine", ["motors.motor.law.sines[0].amplitude=-1..1:5", "motors.motor.law.rate=-4..9:3"]),
    ] {
        let plan = prepared(scene, &vary, &request);
        for point in points(&plan, 1) {
            let outcome = agreed(scene, &plan, &point, &request);
            let defects = outcome.drift.constraints.first().map(|(_, levels)| [levels[0].max, levels[1].max]);
            for (found, alone) in point.constraint.into_iter().flatten().zip(defects.into_iter().flatten()) {
                assert!(found < 1e-14 && alone < 1e-14, "{scene}: {found:e} {alone:e}");
            }
            assert_eq!(point.constraint.is_some(), scene.starts_with("motor"));
        }
    }
}

/// Any tree where starts differ, all points or those that follow one another.
#[test]
fn points_of_one_tree_agree_with_single_runs() {
    let request = Request { rtol: Some(1e-12), every: Some(0.5), ..request("taylor", 1.0) };
    for (scene, vary) in [
        ("branch", ["bar1.phi=-3..3:5", "plate.omega=-1..1:3"]),
        ("branch", ["gravity[0]=8..9.81:2", "bar1.phi=1..2:9"]),
    ] {
        let plan = prepared(scene, &vary, &request);
        for point in points(&plan, 1) {
            agreed(scene, &plan, &point, &request);
            assert_eq!(plan.point(point.index).as_ref(), Some(&point));
        }
    }
}

/// Forces and laws by formulas, among them one that is flat to the last digit where the first step begins.
#[test]
fn points_with_formulas_agree_with_single_runs() {
    let request = Request { rtol: Some(1e-12), every: Some(0.5), ..request("taylor", 1.0) };
    for (scene, vary) in [
        ("duffing", ["parameters.k3=0.5..1:2", "bar.phi=-1..1:9"]),
        ("drag", ["bar2.phi=-0.5..0.5:3", "bar1.phi=-1..1:3"]),
        ("duffing", ["bar.phi=-1..1:2", "parameters.amplitude=0.1..0.4:9"]),
        ("branch", ["bar1.phi=1..2:2", "bars.plate.mass=0.05..0.1:9"]),
    ] {
        let plan = prepared(scene, &vary, &request);
        for point in points(&plan, 1) {
            agreed(scene, &plan, &point, &request);
            assert_eq!(plan.point(point.index).as_ref(), Some(&point));
        }
    }
}

/// Free bodies, by formulas and by a spring: a planet on its ellipses, and a dumbbell that is thrown.
#[test]
fn points_of_floating_bodies_are_in_lanes() {
    let start = |of: &str| format!("start.{of}");
    let request = Request { rtol: Some(1e-12), every: Some(0.5), ..request("taylor", 4.0) };
    let thrown = r#"{"name": "thrown", "gravity": [0, -9.81],
        "bars": [{"name": "a", "mass": 1, "centre": [0.1, 0.02], "inertia": 0.02, "length": 0.4},
            {"name": "b", "mass": 2, "centre": [-0.1, 0], "inertia": 0.03, "length": 0.4}],
        "springs": [{"name": "s", "between": [{"body": "a", "point": [0.3, 0]}, {"body": "b", "point": [0, 0.1]}],
            "stiffness": 40, "free_length": 0.5, "damping": 0.3}],
        "start": {"a": {"phi": 0.3, "omega": 2, "origin": [0, 0], "velocity": [1, 5]},
            "b": {"phi": -1, "omega": -1, "origin": [1, 0.2], "velocity": [0, 4]}}, "until": 4, "every": 1}"#;
    let thrown = Template::new(thrown.into(), "thrown".into(), &[]);
    for (template, vary) in [
        (template("kepler"), vec!["parameters.m2=0.3..0.6:2".to_owned(), start("planet.omega=0..1:9")]),
        (template("kepler"), vec!["parameters.G=0.8..1.2:9".to_owned()]),
        (thrown, vec!["bars.b.mass=1..2:3".to_owned(), start("a.omega=-3..3:5")]),
    ] {
        let vary = vary.iter().map(|vary| vary.parse().expect("a range")).collect();
        let plan = Sweep::new(&template, vary, &request).expect("a sweep");
        assert!(Batch::takes_alike(plan.mechanism()));
        for point in points(&plan, 1) {
            let alone = template.filled(plan.variables(), &point.values).expect("a scene");
            let outcome = simulate(&alone, &request, &mut |_| Ok(())).expect("a run");
            assert_eq!((&point.status, point.phi.len()), (&Status::Done, 6));
            let both = point.phi.iter().chain(&point.omega);
            for (found, exact) in both.zip(outcome.last.phi.iter().chain(&outcome.last.omega)) {
                assert!((found - exact).abs() < 1e-8, "{point:?} {:?}", outcome.last);
            }
            assert!(point.energy < 1e-10, "{point:?}");
            assert_eq!(plan.point(point.index).as_ref(), Some(&point));
        }
    }
}

/// A rotor, and what its formulas make of it in closed form.
/// A thrown bar that spins: its centre flies a parabola, in lanes and alone, and the table has where it ends.
#[test]
fn where_a_free_bar_ends_is_in_the_table() {
    let text = r#"{"name": "thrown", "gravity": [0, -9.81],
        "bars": [{"name": "bar", "mass": 1, "centre": [0.1, 0.05], "inertia": 0.02, "length": 0.5}],
        "start": {"bar": {"phi": 0.3, "omega": 3, "origin": [0.2, 0], "velocity": [1, 2]}}, "until": 1, "every": 1}"#;
    let template = Template::new(text.into(), "thrown.json".into(), &[]);
    let t = 1.0;
    for method in ["taylor", "dp8"] {
        let vary = vec!["start.bar.velocity[0]=-1..1:9".parse().expect("a range")];
        let plan = Sweep::new(&template, vary, &request(method, t)).expect("a sweep");
        let names = columns(&plan);
        assert_eq!(
            names[2..8].join(" "),
            "bar.phi [rad] bar.omega [rad/s] bar.x [m] bar.y [m] bar.vx [m/s] \
            bar.vy [m/s]"
        );
        for point in points(&plan, 1) {
            let numbers = numbers(&point, SweepLayout::of(&plan));
            assert_eq!(numbers.len(), names.len() - 3, "all but words");
            let (sin, cos) = 0.3_f64.sin_cos();
            let arm = [0.1 * cos - 0.05 * sin, 0.1 * sin + 0.05 * cos];
            let velocity = [point.values[0] - 3.0 * arm[1], 2.0 + 3.0 * arm[0]];
            let expected = [
                0.3 + 3.0 * t,
                3.0,
                0.2 + arm[0] + velocity[0] * t,
                arm[1] + velocity[1] * t - 0.5 * 9.81 * t * t,
                velocity[0],
                velocity[1] - 9.81 * t,
            ];
            for (name, (found, expected)) in names[2..].iter().zip(numbers[2..].iter().zip(expected)) {
                assert!((found - expected).abs() < 1e-8, "{method} {name}: {found} {expected}");
            }
        }
    }
    // A point that never begins has as many numbers, none of which is one.
    let vary = vec!["bars.bar.mass=-1..1:2".parse().expect("a range")];
    let plan = Sweep::new(&template, vary, &request("dp8", t)).expect("a sweep");
    let refused = numbers(&points(&plan, 1)[0], SweepLayout::of(&plan));
    assert!(refused.len() == columns(&plan).len() - 3 && refused[1..].iter().all(|x| x.is_nan()));
}

fn rotor(more: &str) -> Template {
    let text = format!(
        r#"{{"name": "rotor", "gravity": [0, 0], {more},
            "bars": [{{"name": "rotor", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 1}}],
            "hinges": [{{"name": "A", "between": [
                {{"body": "ground", "point": [0, 0]}}, {{"body": "rotor", "point": [0, 0]}}]}}],
            "start": {{"rotor": {{"phi": 0, "omega": 0}}}}, "until": 4, "every": 4}}"#
    );
    Template::new(text, "rotor".into(), &[])
}

#[test]
fn points_with_formulas_are_those_of_closed_forms() {
    let swept = |more: &str| {
        let mechanism = Mechanism::new(&rotor(more).scene().expect("a scene")).expect("a mechanism");
        assert!(Batch::takes_alike(&mechanism));
        let vary = ["rotor.phi=-2..2:5", "rotor.omega=-1..1:3"].map(|vary| vary.parse().expect("a range"));
        let plan = Sweep::new(&rotor(more), vary.into(), &request("taylor", 4.0)).expect("a sweep");
        points(&plan, 1)
    };
    // A spring by its potential: w = 2, to all points their cosines.
    let spring = r#""torsion_springs": [{"name": "s", "body": "rotor", "potential": "1*(angle^2)"}]"#;
    for point in swept(spring) {
        let ([phi, omega], (sin, cos)) = ([point.values[0], point.values[1]], 8f64.sin_cos());
        assert!((point.phi[0] - (phi * cos + 0.5 * omega * sin)).abs() < 1e-8, "{point:?}");
        assert!((point.omega[0] - (omega * cos - 2.0 * phi * sin)).abs() < 1e-8, "{point:?}");
        assert!(point.energy < 1e-8, "{point:?}");
    }
    // A torque that sets in after 3 s within some hundredths, and is flat to the last digit before:
    // ∫ (1 + tanh(200 (t - 3))) dt = (t - 3) + ln(2 cosh(200 (t - 3)))/200.
    let late = r#""torques": [{"name": "p", "body": "rotor", "torque": "0.5*(1 + tanh(200*(1*t - 3)))"}]"#;
    for point in swept(late) {
        let omega = point.values[1] + 2.0;
        assert!((point.omega[0] - omega).abs() < 1e-8, "{point:?}");
    }
}

/// Integrals are columns of their own: numbers, and no bodies that turn over.
#[test]
fn integrals_are_columns_of_a_sweep() {
    let more = r#""integrals": {"sum": "rotor.phi + rotor.phi"}"#;
    for (method, trust) in [("taylor", Level::Auto), ("dp8", Level::Off)] {
        let vary = vec!["rotor.omega=-1..1:11".parse().expect("a range")];
        let plan = Sweep::new(&rotor(more), vary, &request(method, 4.0)).expect("a sweep").trusted(trust);
        let (columns, layout) = (columns(&plan), SweepLayout::of(&plan));
        assert!(columns.contains(&"sum".to_owned()) && !columns.iter().any(|name| name.starts_with("sum.")));
        let at = columns.iter().position(|name| name == "sum").expect("a column");
        for point in points(&plan, 1) {
            let row = numbers(&point, layout);
            assert_eq!(row.len() + 3, columns.len());
            assert!((row[at] - 16.0 * point.values[0]).abs() < 1e-7, "{method}: {row:?}");
            assert!(point.flip.is_none_or(|flip| flip.bar == 0), "{point:?}");
            assert_eq!(point.flip.is_some(), point.values[0].abs() * 4.0 > PI, "{point:?}");
        }
    }
    // Of an angle over time: radians count as 1.
    let template =
        rotor(more).with_outputs(vec!["S=sum", "W=rotor.omega"].into_iter().map(Output::parse).collect());
    let vary = vec!["rotor.omega=-1..1:2".parse().expect("a range")];
    let plan = Sweep::new(&template, vary, &request("taylor", 4.0)).expect("a sweep");
    for head in ["max:S [s]", "max:W [rad/s]"] {
        assert!(columns(&plan).iter().any(|name| name == head), "{:?}", columns(&plan));
    }
}

/// A parallelogram with three cranks, one constraint too many, that a torque turns: J phi'' = M exactly.
#[test]
fn loops_with_redundant_constraints_are_in_lanes() {
    let crank = |name: &str| {
        format!(r#"{{"name": "{name}", "mass": 1, "centre": [0.1, 0], "inertia": 0.02, "length": 0.2}}"#)
    };
    let hinge = |name: &str, x: f64| {
        format!(
            r#"{{"name": "A{name}", "between": [
                {{"body": "ground", "point": [{x}, 0]}}, {{"body": "{name}", "point": [0, 0]}}]}},
            {{"name": "B{name}", "between": [
                {{"body": "{name}", "point": [0.2, 0]}}, {{"body": "bar", "point": [{x}, 0]}}]}}"#
        )
    };
    for torque in ["0.03", r#""0.03 + 0*cos(a.phi)""#] {
        let text = format!(
            r#"{{"name": "cranks", "gravity": [0, 0],
                "bars": [{}, {}, {}, {{"name": "bar", "mass": 2, "centre": [0.5, 0], "inertia": 0.3, "length": 1}}],
                "hinges": [{}, {}, {}], "torques": [{{"name": "M", "body": "a", "torque": {torque}}}],
                "start": {{"a": {{"phi": 0.5, "omega": 0}}, "b": {{"phi": 0.5}},
                    "c": {{"phi": 0.5}}, "bar": {{"phi": 0}}}}, "until": 1, "every": 1}}"#,
            crank("a"),
            crank("b"),
            crank("c"),
            hinge("a", 0.0),
            hinge("b", 0.5),
            hinge("c", 1.0)
        );
        // Starts, and the mass of the bar.
        let vary = |range: &str| vec![range.parse().expect("a range")];
        for (vary, masses) in [(vary("a.omega=0..1:11"), false), (vary("bars.bar.mass=1..3:11"), true)] {
            let template = Template::new(text.clone(), "cranks".into(), &[]);
            let plan = Sweep::new(&template, vary, &request("taylor", 1.0)).expect("a sweep");
            assert_eq!(plan.mechanism().redundant().len(), 1);
            assert!(Batch::takes_alike(plan.mechanism()));
            for point in points(&plan, 1) {
                let (omega, mass) = if masses { (0.0, point.values[0]) } else { (point.values[0], 2.0) };
                let inertia = 3.0 * (0.02 + 0.01) + mass * 0.04;
                let (phi, rate) = (0.5 + omega + 0.015 / inertia, omega + 0.03 / inertia);
                for k in 0..3 {
                    assert!(
                        (point.phi[k] - phi).abs() < 1e-10 && (point.omega[k] - rate).abs() < 1e-10,
                        "{point:?}"
                    );
                }
                let [position, rate] = point.constraint.expect("constraints");
                assert!(point.energy < 1e-12 && position < 1e-15 && rate < 1e-14, "{point:?}");
            }
        }
    }
}

/// An event that ends a run ends the points of a sweep too, and one that changes what acts changes it there.
#[test]
fn events_act_on_the_points_of_a_sweep() {
    let stop = r#""events": [{"name": "e", "when": "rotor.phi - 1", "action": "stop"}]"#;
    let vary: Vec<Vary> = vec!["rotor.omega=0.5..2:7".parse().expect("a range")];
    let plan = Sweep::new(&rotor(stop), vary, &request("taylor", 4.0)).expect("a sweep");
    for point in points(&plan, 1) {
        assert!((point.t - 1.0 / point.values[0]).abs() < 1e-12 && (point.phi[0] - 1.0).abs() < 1e-12);
    }
    // The spring is off from a quarter of its period on.
    let off = r#""torsion_springs": [{"name": "t", "body": "rotor", "stiffness": 2, "free_angle": 0, "damping": 0}],
        "events": [{"name": "e", "when": "rotor.phi", "off": ["t"]}]"#;
    let vary: Vec<Vary> = vec!["rotor.phi=0.5..2:7".parse().expect("a range")];
    let plan = Sweep::new(&rotor(off), vary, &request("taylor", 4.0)).expect("a sweep");
    for point in points(&plan, 1) {
        assert!((point.omega[0] + 2.0 * point.values[0]).abs() < 1e-9, "{point:?}");
    }
}

/// Closed loops and sliders where starts differ, through singular positions too, where points go alone.
#[test]
fn points_of_one_loop_agree_with_single_runs() {
    for (scene, vary, until, near) in [
        ("andrews", "OF.omega=-50..50:9", 0.01, 1e-8),
        ("slider_crank_torque", "crank.omega=-1..1:9", 0.6, 1e-9),
        ("four_bar_motor", "coupler.phi=0.42..0.44:9", 0.7, 1e-9),
        ("kite", "crank.omega=7..8:9", 1.0, 1e-6),
        ("four_bars", "U0.omega=-1.5..-1:9", 3.0, 1e-6),
    ] {
        let request = Request { rtol: Some(1e-12), every: Some(0.5 * until), ..request("taylor", until) };
        let plan = prepared(scene, &[vary], &request);
        // Points with a limit on their constraints are run one by one.
        let limits = Limits { constraint: Some(1e-2), ..Limits::default() };
        let alone = points(&prepared(scene, &[vary], &request).with_limits(limits), 1);
        for (point, alone) in points(&plan, 1).iter().zip(&alone) {
            assert_eq!((&point.status, point.t), (&Status::Done, until), "{scene}");
            let fastest = point.omega.iter().fold(1.0, |most: f64, omega| most.max(omega.abs()));
            for (found, exact) in point.phi.iter().zip(&alone.phi) {
                assert!((found - exact).abs() < near, "{scene}: {point:?} {alone:?}");
            }
            for (found, exact) in point.omega.iter().zip(&alone.omega) {
                assert!((found - exact).abs() < near * fastest, "{scene}: {point:?} {alone:?}");
            }
            // Bars that turn over in one moment, as they fold, are told in any order.
            let flips = [point, alone].map(|point| point.flip.as_ref().map_or(f64::INFINITY, |flip| flip.t));
            assert!(
                flips[0] == flips[1] || (flips[0] - flips[1]).abs() < near,
                "{scene}: {point:?} {alone:?}"
            );
            let [position, rate] = point.constraint.expect("constraints");
            assert!(position < 1e-15 && rate < 1e-14 * fastest, "{scene}: {point:?}");
            assert!(point != alone, "{scene}: {point:?}");
            assert_eq!(plan.point(point.index).as_ref(), Some(point));
        }
    }
}

/// Without a method named, springs are in lanes unless one of them is so stiff that a method was chosen for it.
#[test]
fn stiff_springs_stay_with_the_method_chosen_for_them() {
    let sets = [&[][..], &["spring.stiffness=1e9", "spring.damping=1e5"]];
    let request = Request { until: Some(0.1), ..Request::default() };
    let vary: Vec<Vary> = vec!["bar2.phi=1..2:3".parse().expect("a range")];
    let chosen = sets.map(|sets| {
        let sets: Vec<Override> = sets.iter().map(|set| set.parse().expect("a number")).collect();
        let template =
            Template::read("examples/scenes/spring.json".as_ref(), &sets).expect("a shipped scene");
        let plan = Sweep::new(&template, vary.clone(), &request).expect("a sweep");
        assert!(points(&plan, 1).iter().all(|point| point.status == Status::Done));
        plan.plan().method
    });
    assert!(chosen[0] == MethodId::Taylor && matches!(chosen[1], MethodId::Radau(_)), "{chosen:?}");
}

/// The scene as it stands is one for `taylor`, which knows no vibration of rods: points that have one get the
/// method of a run alone.
#[test]
fn points_that_the_chosen_method_does_not_suit_get_their_own() {
    let text = r#"{"name": "rod", "gravity": [0, -9.81],
        "bars": [{"name": "b1", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1},
                 {"name": "b2", "mass": 0.7, "centre": [0.3, 0], "inertia": 0.03, "length": 0.6}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b1", "point": [0, 0]}]},
                   {"name": "B", "between": [{"body": "b1", "point": [1, 0]}, {"body": "b2", "point": [0, 0]}]}],
        "springs": [{"name": "S", "between": [{"body": "ground", "point": [1.6, 0.4]}, {"body": "b2", "point": [0.6, 0]}],
                     "stiffness": 1e9, "free_length": 0.1817576075152637, "model": "rigid"}],
        "start": {"b1": {"phi": 0.1, "omega": 1}, "b2": {"phi": 0.2}}, "until": 0.2, "every": 0.1}"#;
    let template = |set: &[Override]| Template::new(text.to_owned(), "rod.json".into(), set);
    let sweep = |request: &Request| {
        let vary = vec!["S.free_length=0.178..0.184:3".parse().expect("a range")];
        Sweep::new(&template(&[]), vary, request).expect("a sweep")
    };
    let plan = sweep(&Request::default());
    assert_eq!(plan.plan().method, MethodId::Taylor);
    for point in points(&plan, 1) {
        assert_eq!(point.status, Status::Done);
        let set = format!("S.free_length={:?}", point.values[0]).parse().expect("a number");
        let scene = template(&[set]).scene().expect("a scene");
        let alone = simulate(&scene, &Request::default(), &mut |_| Ok(())).expect("a run");
        assert!(alone.last.phi == point.phi, "{point:?}");
        let (_, _, shown) = plan.run_of(point.index, 10.0).expect("a plan");
        assert_ne!(shown.method, MethodId::Taylor);
    }
    let asked = points(&sweep(&request("taylor", 0.2)), 1);
    assert!(asked.iter().all(|point| matches!(point.status, Status::Refused(_))), "{asked:?}");
}

/// In lanes and one by one: no point changes, and errors are those against the motion in double-double.
#[test]
fn estimates_of_points_are_near_the_truth() {
    for (scene, method, tolerance, until) in [
        ("free", "taylor", 1e-8, 6.0),
        ("free", "dp8", 1e-7, 6.0),
        ("gentle", "taylor", 1e-5, 8.0),
        ("motor", "taylor", 1e-8, 6.0),
        ("spring", "taylor", 1e-8, 6.0),
    ] {
        let request = Request { rtol: Some(tolerance), every: Some(0.5), ..request(method, until) };
        let angle = if scene == "motor" { "motor.rate=4..9:4" } else { "bar1.phi=-2.5..2.5:4" };
        let vary = [angle, "bar2.phi=0.3..2.9:3"];
        let bare = points(&prepared(scene, &vary, &request), 1);
        let plan = prepared(scene, &vary, &request).trusted(Level::Auto);
        let judged = points(&plan, 1);
        let (mut inside, mut count, mut lost) = (0, 0, 0);
        for (mut point, bare) in judged.into_iter().zip(bare) {
            let trust = point.trust.take().expect("asked for");
            assert_eq!(point, bare, "{scene} by {method}");
            let alone = template(scene).filled(plan.variables(), &point.values).expect("a scene");
            let mechanism = std::sync::Arc::new(Mechanism::new(&alone).expect("equations"));
            let exact =
                reference(&mechanism, &mechanism.start(&alone), &[Time::from(until)]).expect("a reference");
            let off = (0..point.phi.len())
                .map(|k| (point.phi[k] - exact.motions[0].unwrapped(k)).abs())
                .fold(0.0, f64::max);
            if off > 2e-3 {
                assert!(trust.is_doubtful(), "{scene} by {method}: {trust:?} for {off:e}");
                lost += 1;
            } else if off > 1e-13 && off < 5e-4 {
                let ratio = trust.error.expect("a figure") / off;
                count += 1;
                // The largest error may have been before the end.
                inside += usize::from((1.0 / 3.0..=30.0).contains(&ratio));
            }
        }
        assert!(count + lost >= 6 && inside + 1 >= count, "{scene} by {method}: {inside} of {count}");
    }
}

#[test]
fn the_number_of_threads_and_the_chunks_change_nothing() {
    for (scene, method) in [("free", "taylor"), ("free", "dp5"), ("motor", "taylor")] {
        let vary = if scene == "free" { "bar1.phi=-pi..pi:23" } else { "motor.rate=-8..8:23" };
        let plan = prepared(
            scene,
            &[vary, "bar2.phi=-pi..pi:9"],
            &Request { every: Some(0.5), ..request(method, 1.5) },
        );
        let one = points(&plan, 1);
        assert_eq!(one.len(), 207);
        assert!(one.iter().enumerate().all(|(number, point)| point.index == number as u64));
        assert!(one.iter().any(|point| point.flip.is_some()), "{scene}: none of them flips");
        for threads in [2, 3, 5] {
            assert_eq!(points(&plan, threads), one, "{scene}, {method}, {threads} threads");
        }
        assert_eq!(plan.point(100).as_ref(), Some(&one[100]), "by itself");
        assert_eq!(plan.point(207), None);
    }
}

#[test]
fn a_list_of_the_points_of_a_grid_is_the_grid() {
    let names = ["bar1.phi", "spring.stiffness"].map(str::to_owned);
    let request = request("taylor", 2.0);
    let grid = prepared("spring", &["bar1.phi=0.5..2:4", "spring.stiffness=5..10:3"], &request);
    let values: Vec<f64> = (0..grid.count()).flat_map(|index| grid.grid().values(index)).collect();
    let list = Sweep::listed(&template("spring"), &names, values.clone(), &request).expect("a list");
    assert_eq!(points(&list, 2), points(&grid, 1));
    // The parts of either are the whole.
    let part = |number| {
        let list = Sweep::listed(&template("spring"), &names, values.clone(), &request).expect("a list");
        points(&list.sharded(Shard::new(number, 5)), 1)
    };
    assert_eq!((1..=5).flat_map(part).collect::<Vec<_>>(), points(&grid, 2));
    for (names, values, why) in [
        (&names[..], vec![0.5], "as many"),
        (&names[..], vec![], "no points"),
        (&names[..], vec![0.5, f64::NAN], "finite"),
        (&[names[0].clone(), "start.bar1.phi".to_owned()][..], vec![0.5, 0.5], "twice"),
        (&["bar7.phi".to_owned()][..], vec![0.5], "bar7"),
    ] {
        let refused = Sweep::listed(&template("spring"), names, values, &request).err().expect(why);
        assert!(refused.to_string().contains(why), "{refused}");
    }
}

#[test]
fn bad_points_say_so_and_end_nothing() {
    // A spring of no length, negative stiffness, and a good one between.
    let plan = prepared("spring", &["spring.stiffness=-1..9:3"], &request("dp8", 0.5));
    let found = points(&plan, 2);
    assert!(
        matches!(&found[0].status, Status::Refused(reason) if reason.contains("--set springs.spring.stiffness=-1")),
        "{found:?}"
    );
    assert_eq!((&found[1].status, &found[2].status), (&Status::Done, &Status::Done));
    assert!(found[0].phi.is_empty() && found[1].phi.len() == 2);
    // A rate beyond what a step can follow stops, its neighbours go on; one out of range is refused although
    // starts need no reading.
    for method in ["taylor", "dp8"] {
        let found = points(&prepared("free", &["bar1.omega=0..2e30:3"], &request(method, 0.5)), 1);
        assert_eq!(found[0].status, Status::Done);
        assert!(matches!(&found[1].status, Status::Stopped(_)), "{method}: {:?}", found[1]);
        assert!(
            matches!(&found[2].status, Status::Refused(reason) if reason.contains("rad/s")),
            "{:?}",
            found[2]
        );
    }
    let limits = Limits { energy: Some(1e-9), constraint: None };
    for method in ["dp5", "taylor"] {
        let request = Request { rtol: Some(1e-2), ..request(method, 5.0) };
        let found = points(&prepared("free", &["bar1.phi=0..2:2"], &request).with_limits(limits), 1);
        let stopped = |point: &SweepPoint| matches!(&point.status, Status::Stopped(stop) if stop.cause == Cause::DriftLimit);
        assert!(stopped(&found[1]), "{method}: {found:?}");
    }
}

/// The first flip among samples a short time apart.
fn sampled(plan: &Sweep, values: &[f64], request: &Request) -> Option<(f64, usize)> {
    let alone = template("free").filled(plan.variables(), values).expect("a scene");
    let turn = |phi: f64| ((phi + PI) / (2.0 * PI)).floor();
    let mut first = None;
    let mut last: Option<Vec<f64>> = None;
    simulate(&alone, &Request { every: Some(1e-3), ..request.clone() }, &mut |sample| {
        if let (None, Some(last)) = (first, &last) {
            first = (0..2).find(|&bar| turn(last[bar]) != turn(sample.phi[bar])).map(|bar| (sample.t, bar));
        }
        last = Some(sample.phi.clone());
        Ok(())
    })
    .expect("a run");
    first
}

#[test]
fn flips_are_those_of_finely_sampled_runs() {
    for method in ["taylor", "dop853", "dp8", "gauss8", "rattle6"] {
        let request =
            Request { step: method.starts_with(['g', 'r']).then_some(1e-3), ..request(method, 3.0) };
        let plan = prepared("free", &["bar1.phi=0.2..3.1:5", "bar2.phi=-3..3:5"], &request);
        let found = points(&plan, 2);
        let mut flips = 0;
        for point in &found {
            let fine = sampled(&plan, &point.values, &request);
            assert_eq!(point.flip.is_some(), fine.is_some(), "{method}: {point:?} {fine:?}");
            if let (Some(Flip { t, bar }), Some((after, which))) = (point.flip, fine) {
                assert!(
                    bar == which && t <= after + 1e-9 && t > after - 1.001e-3,
                    "{method}: {point:?} {fine:?}"
                );
                flips += 1;
            }
        }
        assert!(flips > 8, "{method}: {flips} flips");
    }
}

#[test]
fn a_flip_is_as_accurate_as_its_run() {
    let times = |method: &str, rtol: Option<f64>, step: Option<f64>| -> Vec<f64> {
        let plan = prepared("free", &["bar1.phi=2..3:4"], &Request { rtol, step, ..request(method, 2.0) });
        points(&plan, 1).iter().map(|point| point.flip.map_or(f64::NAN, |flip| flip.t)).collect()
    };
    let exact = times("taylor", Some(1e-14), None);
    assert!(exact.iter().any(|t| t.is_finite()), "{exact:?}");
    for (method, rtol, step) in [
        ("taylor", Some(1e-11), None),
        ("dp8", Some(1e-11), None),
        ("dop853", Some(1e-11), None),
        ("gauss16", None, Some(0.01)),
    ] {
        for (found, exact) in times(method, rtol, step).iter().zip(&exact) {
            assert!(
                (found - exact).abs() < 1e-9 || (found.is_nan() && exact.is_nan()),
                "{method}: {found} {exact}"
            );
        }
    }
}

#[test]
fn a_bar_that_starts_upright_turns_over_where_it_falls_outwards() {
    let times = |method: &str| -> Vec<Option<f64>> {
        let plan = prepared("free", &["bar1.phi=-pi..pi:2", "bar2.phi=-2..2:2"], &request(method, 0.2));
        points(&plan, 1).iter().map(|point| point.flip.map(|flip| flip.t)).collect()
    };
    let found = times("taylor");
    assert_eq!(found.iter().flatten().count(), 2, "two fall outwards and two back: {found:?}");
    for (lane, single) in found.iter().zip(times("dp8")) {
        assert_eq!(lane.is_some(), single.is_some(), "{found:?}");
        assert!(lane.is_none_or(|t| t < 1e-6) && single.is_none_or(|t| t < 1e-6), "{lane:?} {single:?}");
    }
}

/// A bar passes the boundary and comes back within a step, and later steps before the next look hold no
/// passage, or one: the first counts.
#[test]
fn there_and_back_within_a_step_is_not_forgotten() {
    let light = r#"{"name": "light", "gravity": [0, -9.81],
        "bars": [{"name": "upper", "mass": 2.245e-10, "centre": [0.1235, 0], "inertia": 2.535e-12},
            {"name": "lower", "mass": 1.1837e-7, "centre": [0.2656, 0], "inertia": 2.871e-9}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "upper", "point": [0, 0]}]},
            {"name": "B", "between": [{"body": "upper", "point": [0.3721, 0]}, {"body": "lower", "point": [0, 0]}]}],
        "springs": [{"name": "spring", "between": [{"body": "ground", "point": [-1.0615, -0.40277]}, {"body": "lower", "point": [0.50185, 0]}],
            "stiffness": 1.8143e-5, "free_length": 0.4375}],
        "start": {"upper": {"phi": 0.05, "omega": 2.0299}, "lower": {"phi": -3.1133, "omega": -5.3381}}, "until": 0.58, "every": 0.029}"#;
    let coil = r#"{"name": "coil", "gravity": [0, -9.81], "bars": [{"name": "bar", "mass": 1.085, "centre": [0.335, -0.26], "inertia": 0.1664}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
        "torsion_springs": [{"name": "coil", "body": "bar", "stiffness": 15.6, "free_angle": 2.668, "damping": 0.6965}],
        "torques": [{"name": "torque", "body": "bar", "torque": -6.794,
            "law": {"start": 0.3463, "sines": [{"amplitude": 0.3419, "frequency": 4.23, "phase": -0.2008}]}}],
        "start": {"bar": {"phi": 1.4718, "omega": -5.403}}, "until": 1.48, "every": 0.074}"#;
    for (text, vary, rtol) in
        [(light, "upper.phi=0.05..0.05:1", 1e-4), (coil, "bar.omega=-5.4..-5.0:41", 1e-9)]
    {
        let template = Template::new(text.into(), "there.json".into(), &[]);
        let flips = |method: &str, rtol: f64| -> Vec<Option<f64>> {
            let request =
                Request { rtol: Some(rtol), ..request(method, template.scene().expect("a scene").until) };
            let plan =
                Sweep::new(&template, vec![vary.parse().expect("a range")], &request).expect("a sweep");
            points(&plan, 1).iter().map(|point| point.flip.map(|flip| flip.t)).collect()
        };
        let (found, right) = (flips("taylor", rtol), flips("dp8", 1e-12));
        for (found, right) in found.iter().zip(&right) {
            let differ = found
                .zip(*right)
                .map_or(found.is_some() != right.is_some(), |(found, right)| (found - right).abs() > 1e-4);
            assert!(!differ, "{found:?} s and not {right:?} s, {vary}");
        }
        assert!(right.iter().any(Option::is_some));
    }
}

/// Bodies that float have two coordinates more than angles, which are no columns.
#[test]
fn points_of_floating_bodies_are_rows_of_as_many_columns() {
    let text = r#"{"name": "float", "gravity": [0, -9.81], "bars": [{"name": "plate", "mass": 2, "centre": [0.1, 0], "inertia": 0.3}],
        "start": {"plate": {"phi": 1, "omega": 2, "origin": [3, 4], "velocity": [5, 6]}}, "until": 0.5, "every": 0.1}"#;
    let template = Template::new(text.into(), "float.json".into(), &[]);
    let plan =
        Sweep::new(&template, vec!["plate.omega=1..2:2".parse().expect("a range")], &Request::default())
            .expect("a sweep");
    let mut table = SweepTable::new(&plan, Vec::new()).expect("room");
    sweep(&plan, 1, &mut |point: &SweepPoint| Ok(table.write(point)?)).expect("all points");
    let text = String::from_utf8(table.finish().expect("room")).expect("text");
    let rows: Vec<Vec<&str>> = text.lines().map(|row| row.split(',').collect()).collect();
    assert!(rows.len() == 3 && rows.iter().all(|row| row.len() == rows[0].len()), "{text}");
    // phi = 1 + omega t of a body that nothing turns.
    for (row, omega) in rows[1..].iter().zip([1.0, 2.0]) {
        let phi: f64 = row[2].parse().expect("an angle");
        assert!((phi - (1.0 + 0.5 * omega)).abs() < 1e-9 && row[rows[0].len() - 2] == "done", "{text}");
    }
}

#[test]
fn points_end_at_flips_and_are_left_out_where_asked() {
    for method in ["taylor", "dp8"] {
        let request = Request { every: Some(0.1), ..request(method, 5.0) };
        let whole = points(&prepared("free", &["bar1.phi=0.1..3.1:7"], &request), 1);
        let plan = prepared("free", &["bar1.phi=0.1..3.1:7"], &request)
            .ending_at_flips()
            .without(|values| values[0] > 3.0);
        let ended = points(&plan, 2);
        assert_eq!(ended[6].status, Status::Skipped);
        assert!(ended.iter().any(|point| point.flip.is_some()));
        for (point, whole) in ended.iter().zip(&whole).take(6) {
            assert_eq!((point.flip, &point.status), (whole.flip, &Status::Done), "{method}");
            match point.flip {
                Some(flip) => {
                    assert!(flip.t <= point.t && point.t < flip.t + 0.1 + 1e-9, "{method}: {point:?}")
                }
                None => assert_eq!(point.t, 5.0),
            }
        }
    }
}

/// Fails at its fifth point.
#[derive(Default)]
struct Fussy {
    seen: u64,
}

impl PointObserver for Fussy {
    fn see(&mut self, _: &SweepPoint) -> std::io::Result<()> {
        self.seen += 1;
        if self.seen == 5 { Err(std::io::Error::other("enough")) } else { Ok(()) }
    }
}

#[test]
fn an_observer_can_end_a_huge_sweep() {
    // A thousand million points: nothing of it may be computed or allocated in advance.
    let plan = prepared("free", &["bar1.phi=0..1:31622", "bar2.phi=0..1:31622"], &request("dp5", 0.01));
    for threads in [1, 3] {
        let mut fussy = Fussy::default();
        let error = sweep(&plan, threads, &mut fussy).expect_err("the observer's");
        assert!(matches!(error, SweepError::Observer(_)) && fussy.seen == 5, "{error}");
    }
}

#[test]
fn a_range_of_points_is_that_part_of_all_in_lanes_or_not() {
    for method in [None, Some("dp8")] {
        let request =
            Request { until: Some(2.0), ..method.map_or(Request::default(), |name| request(name, 2.0)) };
        let plan = || prepared("free", &["bar1.phi=-3..3:40"], &request);
        let all = points(&plan(), 2);
        assert_eq!(points(&plan().within(7..31), 2), all[7..31]);
        assert_eq!(points(&plan().within(30..1000), 1), all[30..]);
        assert!(points(&plan().within(50..60), 1).is_empty());
        let second = plan().sharded(Shard::new(2, 4)).within(5..12);
        assert_eq!(points(&second, 1), all[10..12], "of a part, what is in both");
    }
}

#[test]
fn one_flag_ends_all_sweeps_that_are_given_it() {
    let flag = Arc::new(AtomicBool::new(false));
    let ended = || {
        let request = Request { every: Some(1e5), ..request("gauss8", 1e5) };
        let plan = prepared("free", &["bar1.phi=-3..3:1000"], &request).stopped_by(Arc::clone(&flag));
        sweep(&plan, 2, &mut |_: &SweepPoint| Ok(()))
    };
    std::thread::scope(|scope| {
        let sweeps = [scope.spawn(ended), scope.spawn(ended)];
        std::thread::sleep(std::time::Duration::from_millis(100));
        flag.store(true, Ordering::Relaxed);
        for sweep in sweeps {
            let ended = sweep.join().expect("no panic");
            let is_interrupted = |error: &std::io::Error| error.kind() == std::io::ErrorKind::Interrupted;
            assert!(matches!(&ended, Err(SweepError::Observer(error)) if is_interrupted(error)), "{ended:?}");
        }
    });
}

#[test]
fn runs_and_sweeps_move_between_threads() {
    fn is_send<T: Send>() {}
    is_send::<driftless::run::Running>();
    is_send::<Sweep>();
}

#[test]
fn what_makes_no_sense_is_refused_before_the_first_point() {
    let refusal = |scene: &str, vary: &[&str], request: &Request| -> String {
        let vary: Vec<Vary> = vary.iter().map(|vary| vary.parse().expect("a range")).collect();
        Sweep::new(&template(scene), vary, request).err().map(|error| error.to_string()).unwrap_or_default()
    };
    for (scene, vary, method, words) in [
        ("free", vec!["start.bar3.phi=0..1:2"], None, "did you mean `bar1`"),
        ("free", vec!["bar1.phi=0..1:2", "start.bar1.phi=0..1:2"], None, "varied twice"),
        ("free", vec![], None, "nothing is varied"),
        ("free", vec!["bar1.phi=0..1:1000000", "bar2.phi=0..1:1000000"], None, "1000000 × 1000000 points"),
        ("wall", vec!["wall.restitution=0..1:2"], Some(MethodId::Gauss(4)), "a scene with walls"),
    ] {
        let said = refusal(scene, &vary, &Request { method, ..Request::default() });
        assert!(said.contains(words), "{vary:?}: {said}");
    }
}

#[cfg(feature = "cli")]
mod command {
    use super::program::Program;

    const GRID: &str = "--vary bar1.phi=-pi..pi:9 --vary bar2.phi=-2..2:4 --until 2";

    fn rows(table: &str) -> Vec<Vec<String>> {
        table.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
    }

    #[test]
    fn a_table_is_written_and_is_the_same_on_one_two_and_three_threads() {
        let program = Program::with_scenes(&["free"]);
        let mut tables = Vec::new();
        for threads in [1, 2, 3] {
            program
                .run(&format!("sweep free.json {GRID} --threads {threads} -q --force --no-charts"))
                .exits(0)
                .stays_silent();
            tables
                .push(program.read("output/free/sweep-start.bar1.phi-start.bar2.phi-taylor-1e-9/sweep.csv"));
        }
        assert!(tables[0] == tables[1] && tables[0] == tables[2]);
        let rows = rows(&tables[0]);
        assert_eq!(rows.len(), 37);
        assert_eq!(
            rows[0].join(","),
            "start.bar1.phi [rad],start.bar2.phi [rad],t [s],bar1.phi [rad],bar1.omega [rad/s],bar2.phi [rad],bar2.omega [rad/s],\
             energy_drift [1],constraint_drift [rad],constraint_rate_drift [rad/s],steps,flip_time [s],flip_bar,status,cause"
        );
        assert_eq!(
            (rows[1][0].as_str(), rows[1][1].as_str(), rows[4][0].as_str()),
            ("-3.141592653589793", "-2.0", "-3.141592653589793")
        );
        assert!(
            rows[1..].iter().all(|row| row.len() == rows[0].len() && row[13] == "done" && row[8].is_empty())
        );
        let energies: Vec<f64> = rows[1..].iter().map(|row| row[7].parse().expect("a number")).collect();
        assert!(energies.iter().all(|&energy| energy < 1e-8), "{energies:?}");
    }

    #[test]
    fn one_object_names_the_files_and_two_values_make_a_map() {
        let program = Program::with_scenes(&["free"]);
        let object = program.run(&format!("sweep free.json {GRID} --json --threads 2")).exits(0).object();
        for key in [
            "scene", "method", "settings", "until", "vary", "points", "done", "stopped", "refused",
            "flipped", "steps", "energy", "wall_s", "files",
        ] {
            assert!(object.get(key).is_some(), "no `{key}` in {object}");
        }
        assert_eq!(
            (&object["points"], &object["done"], &object["method"]),
            (&36.into(), &36.into(), &"taylor".into())
        );
        assert_eq!(object["vary"][1]["path"], "start.bar2.phi");
        let folder = "output/free/sweep-start.bar1.phi-start.bar2.phi-taylor-1e-9";
        let expected: Vec<String> =
            ["map.png", "sweep.csv", "sweep.json"].iter().map(|name| format!("{folder}/{name}")).collect();
        assert_eq!(program.files()[1..], expected);
        let picture = std::fs::read(program.path(&expected[0])).expect("a picture");
        assert!(picture.starts_with(b"\x89PNG") && picture.len() > 5000);
        // A second time only by force, and then without what the first left.
        program.run(&format!("sweep free.json {GRID}")).exits(6).says(&["--force"]);
        program
            .run(&format!("sweep free.json {GRID} --no-charts --force"))
            .exits(0)
            // Fast ones are so many that the line breaks.
            .shows(&["36 done", "points a"]);
        assert_eq!(program.files()[1..], expected[1..]);
    }

    #[test]
    fn one_value_makes_a_profile_and_other_columns_can_be_drawn() {
        let program = Program::with_scenes(&["motor"]);
        let sweep = "sweep motor.json --vary motor.rate=1..5:4 --until 1";
        program.run(&format!("{sweep} --vary x=1..2:2")).exits(3).says(&["x"]);
        program.run(&format!("{sweep} --map bar2.phy")).exits(2).says(&["bar2.phi"]);
        assert_eq!(program.files(), ["motor.json"], "nothing was written");
        program.run(&format!("{sweep} --map bar2.phi -q")).exits(0).stays_silent();
        assert!(program.files().iter().any(|file| file.ends_with("/profile.png")), "{:?}", program.files());
        let table =
            program.read(program.files().iter().find(|file| file.ends_with("sweep.csv")).expect("a table"));
        assert!(rows(&table)[1..].iter().all(|row| row[7] == "0.0" && row[12] == "done"), "{table}");
    }

    #[test]
    fn starts_that_are_not_as_varied_are_told() {
        let program = Program::with_scenes(&["kite"]);
        let words = "start.crank.phi is not as varied at the start of 3 of 3 points, but up to 0.4";
        let sweep = "sweep kite.json --vary crank.phi=0.5..1:3 --until 0.05 --every 0.01 --force";
        let ran = program.run(&format!("{sweep} --html --map crank.phi --chart-format svg")).exits(0);
        let told = ran.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(told.contains(words), "{told}");
        let folder = "output/kite/sweep-start.crank.phi-taylor-1e-9-projection";
        let record: serde_json::Value =
            serde_json::from_str(&program.read(&format!("{folder}/sweep.json"))).expect("JSON");
        let notes = record["result"]["notes"].to_string();
        assert!(notes.contains(words), "{notes}");
        assert!(program.read(&format!("{folder}/sweep.html")).contains("off at the start"));
        assert!(program.read(&format!("{folder}/profile.svg")).contains("off at the start"));
        // Where what follows is not given, what is varied stays.
        let text =
            program.read("kite.json").replace(r#""rocker": {"phi": 2.214297435588181}"#, r#""rocker": {}"#);
        program.write("kite.json", &text);
        let ran = program.run(&sweep.replace("0.5..1", "0.8..1")).exits(0).shows(&["3 done"]);
        assert!(!ran.stdout.contains("not as varied"), "{}", ran.stdout);
    }

    #[test]
    fn estimates_are_two_columns_where_they_are_asked_for() {
        let program = Program::with_scenes(&["free"]);
        let ask = "sweep free.json --vary bar1.phi=-2..2:5 --until 12 --every 1 --no-charts --json";
        let bare = program.run(&format!("{ask} --out a")).exits(0).object();
        let judged = program.run(&format!("{ask} --out b --trust auto")).exits(0).object();
        assert!(bare["trust"].is_null());
        assert_eq!(judged["trust"]["judged"], 5);
        let columns = judged["columns"].as_array().expect("names").len();
        assert_eq!(columns, bare["columns"].as_array().expect("names").len() + 2);
        program
            .run(&format!("{} --out c --trust auto --map horizon", ask.replace(" --no-charts --json", "")))
            .exits(0)
            .shows(&["trust", "in doubt"]);
        program.run("sweep free.json --vary bar1.phi=-2..2:5 --until 0.1 --out d --trust maybe").exits(2);
        for twice in ["until=1..2:2 --until 0.5", "every=0.1..0.2:2 --every 0.1"] {
            let refused = program.run(&format!("sweep free.json --vary {twice} --out d"));
            refused.exits(2).says(&["it is varied, and"]);
        }
    }

    #[test]
    fn bad_points_are_rows_of_the_table() {
        let program = Program::with_scenes(&["spring"]);
        let ran = program.run("sweep spring.json --vary spring.stiffness=-1..9:3 --until 0.5 --json --no-charts --out there").exits(0);
        let object = ran.object();
        assert_eq!((&object["done"], &object["refused"]), (&2.into(), &1.into()));
        let table =
            program.read(program.files().iter().find(|file| file.ends_with("sweep.csv")).expect("a table"));
        assert!(
            table
                .lines()
                .nth(1)
                .is_some_and(|row| row.starts_with("-1.0,,,,,,,,,,,refused,") || row.contains(",refused,")),
            "{table}"
        );
    }

    #[test]
    fn mistakes_are_told_with_what_is_near_and_leave_nothing() {
        let program = Program::with_scenes(&["free", "wall"]);
        for (arguments, code, words) in [
            ("free.json", 2, vec!["--vary"]),
            ("free.json --vary bar1.phi=0..1", 2, vec!["COUNT"]),
            ("free.json --vary bar1.phi=0..1:0", 2, vec!["COUNT"]),
            ("free.json --vary bar1.phi=0..1:4 --threads 0", 2, vec!["--threads"]),
            ("free.json --vary bar1.phi=0..1:4 --stabilize none,projection", 2, vec!["--stabilize"]),
            ("free.json --vary bar1.phi=0..1:100000 --vary bar2.phi=0..1:100000", 2, vec!["points"]),
            ("free.json --vary start.bra1.phi=0..1:4", 3, vec!["start.bra1.phi", "`bar1`", "hint: "]),
            ("free.json --vary bar1.phy=0..1:4", 3, vec!["bar1.phy", "hint: "]),
            ("wall.json --vary wall.restitution=0..1:4 --method gauss8", 3, vec!["walls", "--method dp8"]),
            ("nowhere.json --vary bar1.phi=0..1:4", 6, vec!["nowhere.json"]),
        ] {
            program.run(&format!("sweep {arguments}")).exits(code).says(&words);
        }
        assert_eq!(program.files(), ["free.json", "wall.json"]);
    }
}

/// A body on a spring of no length in its centre turns evenly, to the last digit, and goes on an ellipse: what is off is
/// its position alone.
#[test]
fn estimates_of_points_in_lanes_count_positions() {
    let text = r#"{"name": "ellipse", "gravity": [0, 0], "until": 20, "every": 20,
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 2}],
        "springs": [{"name": "K", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}],
                     "stiffness": 36, "free_length": 0}],
        "start": {"b": {"phi": 0.3, "omega": 1, "origin": [1, 0], "velocity": [0, 3]}}}"#;
    let template = Template::new(text.into(), "ellipse".into(), &[]);
    for tolerance in [1e-4, 1e-7] {
        let request = Request {
            method: Some("taylor".parse().expect("a method")),
            rtol: Some(tolerance),
            ..Request::default()
        };
        let vary = vec!["bars.b.mass=1..4:8".parse().expect("a range")];
        let plan = Sweep::new(&template, vary, &request).expect("a sweep").trusted(Level::Auto);
        let mut count = 0;
        sweep(&plan, 1, &mut |point: &SweepPoint| {
            let w = f64::sqrt(36.0 / point.values[0]);
            let (s, c) = (w * 20.0).sin_cos();
            let off = (point.phi[1] - c).abs().max((point.phi[2] - 3.0 / w * s).abs()) / 2.0;
            let estimate = point.trust.as_ref().and_then(|trust| trust.error).expect("an estimate");
            println!("{tolerance:e}: off by {off:.1e}, estimate {estimate:.1e}");
            assert!(estimate > off / 3.0 && estimate < 10.0 * off + 1e-13, "{off:e}, {estimate:e}");
            count += 1;
            Ok(())
        })
        .expect("all points");
        assert_eq!(count, 8);
    }
}

/// A rod on a cart without gravity, at an angle of which doubles keep four digits behind the point: the sum of
/// both momenta along the rail stays what the start says.
#[test]
fn centres_do_not_suffer_from_whole_turns() {
    let text = r#"{"name": "place2",
        "gravity": [0, 0],
        "bars": [{"name": "cart", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 0.2}, {"name": "w", "mass": 1, "centre": [0.3, 0], "inertia": 0.02, "length": 0.6}],
        "hinges": [{"name": "A", "between": [{"body": "cart", "point": [0, 0]}, {"body": "w", "point": [0, 0]}]}],
        "sliders": [{"name": "S", "point": {"body": "cart", "point": [0, 0]}, "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "angle": "locked"}],
        "start": {"cart": {"phi": 0, "origin": [0, 0], "velocity": [0, 0]}, "w": {"phi": 1000000000000.0, "omega": 1}},
        "until": 3,
        "every": 1}"#;
    let template = Template::new(text.into(), "place".into(), &[]);
    for method in ["taylor", "dp8"] {
        let request = request(method, 3.0);
        let vary = vec!["w.omega=1..2:2".parse().expect("a range")];
        for point in points(&Sweep::new(&template, vary, &request).expect("a sweep"), 1) {
            let momentum = -0.3 * point.values[0] * f64::sin(1e12);
            let found: f64 = point.centres.iter().map(|[_, velocity]| velocity[0]).sum();
            assert!((found - momentum).abs() < 1e-9, "{method}: {found} and not {momentum}");
            let [cart, rod] = [0, 1].map(|k| point.centres[k][0]);
            let arm = (rod[0] - cart[0]).hypot(rod[1] - cart[1]);
            assert!((arm - 0.3).abs() < 1e-12, "{method}: {arm}");
        }
    }
}

/// 0.35 w' = 0.01 sqrt(a - t), which has no value beyond a: the last state is kept, in lanes as alone, and the
/// formula named.
#[test]
fn a_point_that_stops_tells_its_last_state() {
    let text = r#"{"name": "rotor", "gravity": [0, 0], "parameters": {"a": 1},
        "bars": [{"name": "bar", "mass": 1, "centre": [0.5, 0], "inertia": 0.1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
        "torques": [{"name": "T", "body": "bar", "torque": "0.01*sqrt(a - t)"}],
        "start": {"bar": {"phi": 0, "omega": 1}}, "until": 10, "every": 0.1}"#;
    let template = Template::new(text.into(), "rotor".into(), &[]);
    for method in ["taylor", "dp8"] {
        let vary = vec!["a=1..7:5".parse().expect("a range")];
        let plan = Sweep::new(&template, vary, &request(method, 10.0)).expect("a sweep");
        for point in points(&plan, 1) {
            let Status::Stopped(stop) = &point.status else { panic!("{method}: {point:?}") };
            assert!(stop.what.contains("`T`"), "{method}: {stop:?}");
            let a = point.values[0];
            assert!((point.t - a).abs() < 1e-3 && point.energy < 1e-6, "{method}: {point:?}");
            let rate = 1.0 + 0.01 / 0.35 * 2.0 / 3.0 * (a.powf(1.5) - (a - point.t).max(0.0).powf(1.5));
            let off = (point.omega[0] - rate).abs();
            assert!(off < 1e-6, "{method}: off by {off:e}");
        }
    }
}
