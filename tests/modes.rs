//! Equilibria and modes against closed forms, and against runs of a period.

use driftless::arithmetic::{DoubleDouble, Scalar};
use driftless::dynamics::{Mechanism, Motion};
use driftless::run::modes::{Equilibrium, Modes, ModesError, Stability, modes, periodic};
use driftless::run::{Limits, MethodId, Plan, Request, Run, Running};
use driftless::scene::{Scene, parse_scene, read_scene};
use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::sync::Arc;

fn example(name: &str) -> Scene {
    read_scene(format!("examples/scenes/{name}.json").as_ref(), &[]).expect("a shipped scene")
}

fn parsed(text: &str) -> Scene {
    parse_scene(text, "scene.json", &[]).unwrap_or_else(|error| panic!("{error}"))
}

fn found(scene: &Scene, starts: usize) -> Modes {
    let mechanism = Arc::new(Mechanism::new(scene).expect("equations"));
    modes(scene, &mechanism, starts).unwrap_or_else(|error| panic!("{}: {error}", scene.name))
}

fn lowest(found: &Modes) -> &Equilibrium {
    found.equilibria.first().expect("an equilibrium")
}

#[test]
fn a_double_pendulum_has_four_with_the_roots_of_a_quadratic() {
    let scene = example("free");
    let found = found(&scene, 64);
    assert_eq!((found.degrees_of_freedom, found.equilibria.len()), (2, 4));
    let [first, second] = [&scene.bars[0], &scene.bars[1]];
    let g = scene.gravity[0].hypot(scene.gravity[1]);
    let down = scene.gravity[1].atan2(scene.gravity[0]);
    let l = first.length;
    let (c1, c2) = (first.centre[0], second.centre[0]);
    let (m1, m2) = (first.mass, second.mass);
    for one in &found.equilibria {
        // Along gravity or against it.
        let side: Vec<f64> = one.phi.iter().map(|phi| (phi - down).cos().round()).collect();
        for (phi, side) in one.phi.iter().zip(&side) {
            assert!(((phi - down).cos() - side).abs() < 1e-14 && (phi - down).sin().abs() < 1e-13, "{one:?}");
        }
        let mass = [
            [first.inertia + m1 * c1 * c1 + m2 * l * l, m2 * l * c2 * side[0] * side[1]],
            [m2 * l * c2 * side[0] * side[1], second.inertia + m2 * c2 * c2],
        ];
        let stiffness = [(m1 * c1 + m2 * l) * g * side[0], m2 * c2 * g * side[1]];
        // det(K - x M) = 0, x = -s².
        let a = mass[0][0] * mass[1][1] - mass[0][1] * mass[1][0];
        let b = -(stiffness[0] * mass[1][1] + stiffness[1] * mass[0][0]);
        let c = stiffness[0] * stiffness[1];
        let root = (b * b - 4.0 * a * c).sqrt();
        for square in [(-b - root) / (2.0 * a), (-b + root) / (2.0 * a)] {
            let near = |mode: &&driftless::run::modes::Mode| {
                (mode.frequency - square.abs().sqrt()).abs() < 1e-12 * square.abs().sqrt()
            };
            let of: Vec<_> = one.modes.iter().filter(near).collect();
            assert_eq!(of.len(), if square > 0.0 { 1 } else { 2 }, "{square} {one:?}");
            assert!(of.iter().all(|mode| (mode.eigenvalue[1] != 0.0) == (square > 0.0)));
        }
        let is_lowest = side == [1.0, 1.0];
        assert_eq!(one.stability, if is_lowest { Stability::Stable } else { Stability::Unstable });
    }
    assert!((lowest(&found).phi[0] - down).abs() < 1e-12 && lowest(&found).from_start);
}

/// A hanging chain of uniform bars, 1 m long in all.
fn chain(n: usize) -> Scene {
    let l = 1.0 / n as f64;
    let (mut bars, mut hinges, mut start) = (String::new(), String::new(), String::new());
    for k in 0..n {
        let comma = if k == 0 { "" } else { "," };
        let _ = write!(
            bars,
            r#"{comma}{{"name": "b{k}", "mass": {l}, "centre": [{}, 0], "inertia": {}, "length": {l}}}"#,
            l / 2.0,
            l * l * l / 12.0
        );
        let to = if k == 0 {
            r#"{"body": "ground", "point": [0, 0]}"#.to_owned()
        } else {
            format!(r#"{{"body": "b{}", "point": [{l}, 0]}}"#, k - 1)
        };
        let _ = write!(
            hinges,
            r#"{comma}{{"name": "h{k}", "between": [{to}, {{"body": "b{k}", "point": [0, 0]}}]}}"#
        );
        let _ = write!(start, r#"{comma}"b{k}": {{"phi": {}, "omega": 0}}"#, -1.4 - 0.01 * k as f64);
    }
    parsed(&format!(
        r#"{{"name": "chain", "gravity": [0, -9.81], "bars": [{bars}], "hinges": [{hinges}], "start": {{{start}}}, "until": 1, "every": 1}}"#
    ))
}

#[test]
fn a_chain_tends_to_the_zeros_of_bessels_function() {
    let zeros = [2.404_825_557_695_773, 5.520_078_110_286_311, 8.653_727_912_911_013];
    let error = |n: usize| {
        let all = found(&chain(n), 0);
        let one = lowest(&all);
        assert_eq!(one.stability, Stability::Stable);
        assert_eq!(one.modes.len(), n);
        [0, 1, 2].map(|k| {
            let expected = 0.5 * zeros[k] * 9.81_f64.sqrt();
            (one.modes[k].frequency - expected) / expected
        })
    };
    let errors = [16, 32, 64].map(error);
    let extrapolated = |k: usize, i: usize| (4.0 * errors[i + 1][k] - errors[i][k]) / 3.0;
    for k in 0..3 {
        let orders = [0, 1].map(|i| (errors[i][k] / errors[i + 1][k]).log2());
        assert!((orders[1] - 2.0).abs() < 0.2, "mode {k}: {errors:?} {orders:?}");
        // Extrapolated, of order 4.
        let limits = [extrapolated(k, 0), extrapolated(k, 1)];
        assert!((limits[0] / limits[1]).log2() > 3.0, "mode {k}: {limits:?}");
        assert!(limits[1].abs() < 3e-4, "mode {k}: {limits:?}");
    }
}

#[test]
fn dampers_give_the_roots_of_their_quadratic() {
    let (inertia, weight, stiffness) = (0.2 + 2.0 * 0.25, 2.0 * 9.81 * 0.5, 3.0);
    for damping in [0.4, 2.0, 40.0] {
        let scene = parsed(&format!(
            r#"{{"name": "swing", "gravity": [0, -9.81],
            "bars": [{{"name": "bar", "mass": 2, "centre": [0.5, 0], "inertia": 0.2}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}}],
            "torsion_springs": [{{"name": "T", "body": "bar", "stiffness": {stiffness}, "free_angle": {}, "damping": {damping}}}],
            "start": {{"bar": {{"phi": -1, "omega": 0}}}}, "until": 1, "every": 1}}"#,
            -PI / 2.0
        ));
        let all = found(&scene, 16);
        let one = lowest(&all);
        assert!((one.phi[0] + PI / 2.0).abs() < 1e-12);
        assert_eq!(one.stability, Stability::AsymptoticallyStable);
        let (b, c) = (damping / inertia, (weight + stiffness) / inertia);
        let root = b * b - 4.0 * c;
        if root < 0.0 {
            let mode = &one.modes[0];
            assert_eq!(one.modes.len(), 1);
            assert!((mode.eigenvalue[0] + b / 2.0).abs() < 1e-12 * b, "{mode:?}");
            assert!((mode.eigenvalue[1] - (-root).sqrt() / 2.0).abs() < 1e-12 * c, "{mode:?}");
            assert!((mode.damping_ratio - b / (2.0 * c.sqrt())).abs() < 1e-12);
        } else {
            let slow = (-b + root.sqrt()) / 2.0;
            assert!((one.modes[0].eigenvalue[0] - slow).abs() < 1e-11 * b, "{one:?}");
            assert!((one.modes[1].eigenvalue[0] - (-b - slow)).abs() < 1e-11 * b, "{one:?}");
        }
    }
}

#[test]
fn a_four_bar_swings_about_the_least_of_its_potential() {
    // The crank-rocker without its motor: the angles of a closed loop and their rates by the crank's.
    let text = std::fs::read_to_string("examples/scenes/crank_rocker.json").expect("a shipped scene");
    let mut scene: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let keys = scene.as_object_mut().expect("an object");
    keys.retain(|key, _| !["motors", "outputs", "parameters"].contains(&key.as_str()));
    scene["start"]["crank"] = serde_json::json!({"phi": 0.3, "omega": 0});
    let all = found(&parsed(&scene.to_string()), 200);
    assert_eq!(all.degrees_of_freedom, 1);
    let lengths = [0.1, 0.3, 0.25];
    let closed = |crank: f64, side: f64| {
        let (x, y) = (0.1 * crank.cos(), 0.1 * crank.sin());
        let (dx, dy) = (0.32 - x, -y);
        let distance = dx.hypot(dy);
        let along = (0.09 - 0.0625 + distance * distance) / (2.0 * distance);
        let up = side * (0.09 - along * along).sqrt();
        let (bx, by) = (x + (along * dx - up * dy) / distance, y + (along * dy + up * dx) / distance);
        [crank, (by - y).atan2(bx - x), by.atan2(bx - 0.32)]
    };
    let mass = |k: usize| lengths[k] * 0.02 * 0.01 * 7850.0;
    let potential = |[crank, coupler, rocker]: [f64; 3]| {
        9.81 * (mass(0) * 0.05 * crank.sin()
            + mass(1) * (0.1 * crank.sin() + 0.15 * coupler.sin())
            + mass(2) * 0.125 * rocker.sin())
    };
    assert!(all.equilibria.len() >= 4, "{}", all.equilibria.len());
    for one in &all.equilibria {
        let side = (one.phi[1] - closed(one.phi[0], 1.0)[1]).sin().abs() < 1e-9;
        let side = if side { 1.0 } else { -1.0 };
        let h = 1e-4;
        let at = |x: f64| closed(one.phi[0] + x, side);
        let v = |x: f64| potential(at(x));
        let slope = (v(-2.0 * h) - 8.0 * v(-h) + 8.0 * v(h) - v(2.0 * h)) / (12.0 * h);
        assert!(slope.abs() < 1e-9, "{one:?} {slope}");
        let bend = (-v(-2.0 * h) + 16.0 * v(-h) - 30.0 * v(0.0) + 16.0 * v(h) - v(2.0 * h)) / (12.0 * h * h);
        let rate =
            |k: usize| (at(-2.0 * h)[k] - 8.0 * at(-h)[k] + 8.0 * at(h)[k] - at(2.0 * h)[k]) / (12.0 * h);
        let rates = [1.0, rate(1), rate(2)];
        let about = |k: usize| mass(k) * (lengths[k] * lengths[k] + 4e-4) / 12.0;
        let (coupler, crank) = (at(0.0)[1], at(0.0)[0]);
        let centre = [
            -0.1 * crank.sin() - 0.15 * coupler.sin() * rates[1],
            0.1 * crank.cos() + 0.15 * coupler.cos() * rates[1],
        ];
        let inertia = about(0)
            + mass(0) * 0.0025
            + about(1) * rates[1] * rates[1]
            + mass(1) * (centre[0] * centre[0] + centre[1] * centre[1])
            + (about(2) + mass(2) * 0.015_625) * rates[2] * rates[2];
        let expected = (bend / inertia).abs().sqrt();
        assert!((one.modes[0].frequency - expected).abs() < 1e-6 * expected, "{one:?} {expected}");
        assert_eq!(one.stability == Stability::Stable, bend > 0.0);
    }
}

/// The motion of small vibrations in a mode comes back after a period, and a decayed one where damping says.
fn comes_back(scene: &Scene, within: f64) -> usize {
    let all = found(scene, 24);
    let mut count = 0;
    for one in all.equilibria.iter().filter(|one| one.stability != Stability::Unstable) {
        for mode in one.modes.iter().filter(|mode| {
            mode.eigenvalue[1] > 1e-3 * mode.frequency && mode.shape.iter().all(|shape| shape[1].abs() < 1e-6)
        }) {
            let share = 1e-5;
            let phi = all.displaced(one, mode, 0.0, share);
            let start = Motion {
                phi: phi.iter().map(|&phi| DoubleDouble::of(phi)).collect(),
                turns: vec![0; phi.len()],
                omega: vec![DoubleDouble::ZERO; phi.len()],
                ..Motion::default()
            };
            let request = Request {
                method: Some(MethodId::Dp8),
                until: Some(TAU / mode.eigenvalue[1]),
                every: Some(TAU / mode.eigenvalue[1]),
                rtol: Some(1e-13),
                atol: Some(1e-15),
                ..Request::default()
            };
            let plan = Plan::new(scene, &all.mechanism, &request).expect("a plan");
            let run = Run::new(Arc::clone(&all.mechanism), plan, Limits::default(), &start).expect("a run");
            let mut running = Running::new(run);
            running.go(&mut |_| Ok(()), &mut || false).expect("an end");
            let decay = (TAU * mode.eigenvalue[0] / mode.eigenvalue[1]).exp();
            for (k, (end, rest)) in running.finish().last.phi.iter().zip(&one.phi).enumerate() {
                let apart = end - rest - TAU * ((end - rest) / TAU).round();
                let begun = phi[k] - rest - TAU * ((phi[k] - rest) / TAU).round();
                assert!(
                    (apart - decay * begun).abs() < within * share,
                    "{} {k}: {apart:e} {begun:e} {mode:?}",
                    scene.name
                );
            }
            count += 1;
        }
    }
    count
}

#[test]
fn small_vibrations_of_the_examples_come_back_after_their_period() {
    let mut count = 0;
    for name in [
        "free",
        "spring",
        "hanging",
        "andrews",
        "four_bars",
        "slider_crank_torque",
        "one_sided_spring",
        "parameters",
        "gentle",
        "guided",
    ] {
        let scene = example(name);
        let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
        if let Err(error) = modes(&scene, &mechanism, 0) {
            println!("{name}: {error}");
            continue;
        }
        let of = comes_back(&scene, 1e-3);
        println!("{name}: {of} modes");
        count += of;
    }
    assert!(count >= 12, "{count}");
}

#[test]
fn what_has_no_equilibrium_says_why() {
    let of = |name: &str| {
        let scene = example(name);
        let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
        modes(&scene, &mechanism, 8)
    };
    assert!(matches!(of("motor"), Err(ModesError::Moving(_))));
    assert!(matches!(of("duffing"), Err(ModesError::Forced)));
    assert!(matches!(of("pid"), Err(ModesError::Integrals)));
    let mut held = example("crank_rocker");
    held.motors[0].law = driftless::scene::Law::default();
    let mechanism = Arc::new(Mechanism::new(&held).expect("equations"));
    assert!(matches!(modes(&held, &mechanism, 8), Err(ModesError::Rigid)));
    let later = parsed(
        r#"{"name": "later", "gravity": [0, -9.81],
            "bars": [{"name": "a", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]}],
            "torques": [{"name": "T", "body": "a", "torque": "1*if(t > 0.3, 2, 0)"}],
            "start": {"a": {"phi": 0.1, "omega": 0}}, "until": 1, "every": 0.1}"#,
    );
    let mechanism = Arc::new(Mechanism::new(&later).expect("equations"));
    assert!(matches!(modes(&later, &mechanism, 8), Err(ModesError::Forced)));
    // Two bodies that attract one another find no rest.
    assert!(of("kepler").expect("a search").equilibria.is_empty());
    // A cart may stand anywhere: one of a family, not dozens.
    let cart = of("cart_pole").expect("a search");
    assert_eq!(cart.equilibria.len(), 2);
    assert!(cart.equilibria.iter().all(|one| one.is_family));
}

/// Time in a law or a formula is told by what is written, on whichever branch: a torque of 50 Hz, one that begins
/// at 5 s, one that is zero where the scene starts.  One whose amplitude is zero is none.
#[test]
fn laws_that_time_is_in_leave_no_equilibrium_whenever_they_act() {
    let of = |parts: &str| {
        let driven = if parts.contains("motors") { "" } else { r#""b": {"phi": 0, "omega": 0}, "# };
        let scene = parsed(&format!(
            r#"{{"name": "timed", "gravity": [0, -9.81], "parameters": {{"none": 0}}, {parts},
            "bars": [{{"name": "b", "mass": 1, "centre": [0.3, 0], "inertia": 0.03, "length": 0.6}},
                     {{"name": "c", "mass": 1, "centre": [0.3, 0], "inertia": 0.03, "length": 0.6}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}]}},
                       {{"name": "B", "between": [{{"body": "b", "point": [0.6, 0]}}, {{"body": "c", "point": [0, 0]}}]}}],
            "start": {{{driven}"c": {{"phi": 0, "omega": 0}}}}, "until": 20, "every": 0.1}}"#
        ));
        let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
        modes(&scene, &mechanism, 4)
    };
    let torque = |torque: &str| format!(r#""torques": [{{"name": "t", "body": "b", "torque": "{torque}"}}]"#);
    let sine = |amplitude: f64, more: &str| {
        let sine = format!(r#"{{"amplitude": {amplitude}, "frequency": "100*pi"}}"#);
        format!(r#"{{"name": "t", "body": "b", {more} "law": {{"start": 0.2, "sines": [{sine}]}}}}"#)
    };
    let [table, signal] = [
        (torque("gust(t)"), r#""tables": {"gust": [[0, 1], [10, 1], [20, 5]]}"#),
        (torque("1*on"), r#""signals": {"late": "t - 5", "on": "if(late < 0, 0, 1)"}"#),
    ]
    .map(|(torque, more)| format!("{torque}, {more}"));
    for parts in [
        torque("-(3 + 2.5*cos(9.6*t))*b.sin"),
        torque("-(0.2 + 2*sin(9.6*t))*b.omega"),
        torque("0.5*sin(2*pi*50*t)"),
        torque("1*if(t < 5, 1, 0)"),
        torque("max(0 s, t - 5)*1 N*m/s"),
        torque("if(b.phi < 1, 0, 1*cos(1*t))"),
        format!(r#""torques": [{}]"#, sine(1.0, r#""torque": 1,"#)),
        table,
        signal,
    ] {
        assert!(matches!(of(&parts), Err(ModesError::Forced)), "{parts}");
    }
    let late = r#""motors": [{"name": "m", "body": "b", "law": "if(t < 5, 0.5, 0.5 + 0.1*(t - 5)^2)"}]"#;
    let fast = format!(r#""motors": [{}]"#, sine(1e-3, ""));
    for parts in [late, &fast] {
        assert!(matches!(of(parts), Err(ModesError::Moving(_))), "{parts}");
    }
    for parts in [
        torque("none*cos(1*t)"),
        torque("1*abs(b.sin)"),
        format!(r#""torques": [{}]"#, sine(0.0, r#""torque": 1,"#)),
        format!(r#""motors": [{}]"#, sine(0.0, "")),
    ] {
        assert!(of(&parts).is_ok_and(|found| !found.equilibria.is_empty()), "{parts}");
    }
}

/// A flywheel on a pendulum, hinged at its own centre of mass: nothing brings it back, and its angle counts in
/// the torque on the pendulum.  J φ'' = -W cos φ + a cos φ sin ψ - d φ', whatever ψ is and whatever the units.
#[test]
fn what_nothing_brings_back_has_an_eigenvalue_of_zero_in_all_units() {
    for (time, length, damping) in
        [(1.0, 1.0, 0.0), (1.0, 1.0, 0.3), (1e3, 1.0, 0.3), (1e-3, 1e-3, 0.0), (1e-3, 1e3, 4.0)]
    {
        let (area, torque) = (length * length, length * length / (time * time));
        let (gravity, a) = (9.81 * length / (time * time), 1.5 * torque);
        let scene = parsed(&format!(
            r#"{{"name": "flywheel", "gravity": [0, {}], "parameters": {{"a": {a}}},
            "bars": [{{"name": "arm", "mass": 1.2, "centre": [{}, 0], "inertia": {}, "length": {}}},
                     {{"name": "wheel", "mass": 0.7, "centre": [0, 0], "inertia": {}, "length": {}}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "arm", "point": [0, 0]}}]}},
                       {{"name": "B", "between": [{{"body": "arm", "point": [{}, 0]}}, {{"body": "wheel", "point": [0, 0]}}]}}],
            "torsion_springs": [{{"name": "D", "body": "arm", "stiffness": 0, "free_angle": 0, "damping": {}}}],
            "torques": [{{"name": "T", "body": "arm", "torque": "a*arm.cos*wheel.sin"}}],
            "start": {{"arm": {{"phi": -1, "omega": 0}}, "wheel": {{"phi": 0.4, "omega": 0}}}}, "until": 1, "every": 1}}"#,
            -gravity,
            0.25 * length,
            0.02 * area,
            0.5 * length,
            0.01 * area,
            0.2 * length,
            0.4 * length,
            damping * area / time,
        ));
        let found = found(&scene, 24);
        assert!(found.starts[1] > 20, "{:?}", found.starts);
        let inertia = (0.02 + 1.2 * 0.0625 + 0.7 * 0.16) * area;
        let weight = (1.2 * 0.25 + 0.7 * 0.4) * length * gravity;
        let resistance = damping * area / time;
        for one in &found.equilibria {
            // Down below it comes back, up above it falls: s² J + s d + (W - a sin ψ) sin φ = 0, φ = ∓π/2.
            let stiffness = -(weight - a * one.phi[1].sin()) * one.phi[0].sin();
            let is_below = stiffness > 0.0;
            assert!(one.phi[0].cos().abs() < 1e-7 && one.is_family, "{one:?}");
            let expected = if is_below { Stability::Stable } else { Stability::Unstable };
            assert_eq!((one.stability, one.modes[0].eigenvalue), (expected, [0.0, 0.0]), "{one:?}");
            assert!(one.modes[0].shape[0][0].abs() < 1e-6 && one.modes[0].shape[1][0] == 1.0, "{one:?}");
            let square = (resistance / inertia).powi(2) / 4.0 - stiffness / inertia;
            let re = -0.5 * resistance / inertia;
            let roots = if square < 0.0 {
                vec![[re, (-square).sqrt()]]
            } else {
                vec![[re + square.sqrt(), 0.0], [re - square.sqrt(), 0.0]]
            };
            assert_eq!(one.modes.len(), 1 + roots.len(), "{one:?}");
            for root in roots {
                let apart = |at: &[f64; 2]| (at[0] - root[0]).hypot(at[1] - root[1]);
                let nearest = one.modes[1..].iter().map(|mode| apart(&mode.eigenvalue));
                let size = root[0].hypot(root[1]);
                assert!(nearest.fold(f64::INFINITY, f64::min) < 1e-6 * size, "{root:?} {one:?}");
            }
        }
    }
}

#[test]
fn where_nothing_acts_all_places_are_equilibria_damped_or_not() {
    for damping in [0.0, 0.2] {
        let scene = parsed(&format!(
            r#"{{"name": "adrift", "gravity": [0, 0],
            "bars": [{{"name": "a", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}},
                     {{"name": "b", "mass": 2, "centre": [0.2, 0], "inertia": 0.1, "length": 0.5}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}},
                       {{"name": "B", "between": [{{"body": "a", "point": [1, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
            "torsion_springs": [{{"name": "D", "body": "a", "stiffness": 0, "free_angle": 0, "damping": {damping}}}],
            "start": {{"a": {{"phi": 0.3, "omega": 0}}, "b": {{"phi": 1, "omega": 0}}}}, "until": 1, "every": 1}}"#
        ));
        let found = found(&scene, 8);
        assert_eq!(found.starts[0], found.starts[1]);
        for one in &found.equilibria {
            assert!(one.is_family && one.stability == Stability::Stable, "{one:?}");
            assert!(one.modes[..2].iter().all(|mode| mode.eigenvalue == [0.0, 0.0]), "{one:?}");
            assert_eq!(one.modes.len(), if damping > 0.0 { 3 } else { 2 }, "{one:?}");
        }
    }
}

/// Where a torsion spring counts turns, positions a turn apart are two: all roots of the balance of torques are
/// found, each as it is.
#[test]
fn turns_of_a_torsion_spring_are_kept() {
    let [k, free, moment] = [1.2, 0.4, 9.81 * 0.5];
    let scene = parsed(
        r#"{"name": "wound", "gravity": [0, -9.81],
            "bars": [{"name": "bar", "mass": 1, "centre": [0.5, 0], "inertia": 0.0833333333333333, "length": 1}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
            "torsion_springs": [{"name": "coil", "body": "bar", "stiffness": 1.2, "free_angle": 0.4}],
            "start": {"bar": {"phi": 0, "omega": 0}}, "until": 1, "every": 0.1}"#,
    );
    let torque = |phi: f64| moment * phi.cos() + k * (phi - free);
    let root = |mut a: f64, mut b: f64| {
        for _ in 0..60 {
            let middle = 0.5 * (a + b);
            if torque(a) * torque(middle) > 0.0 { a = middle } else { b = middle }
        }
        a
    };
    let ends = (-500..500).map(|i| [0.01 * f64::from(i), 0.01 * f64::from(i + 1)]);
    let roots: Vec<f64> =
        ends.filter(|[a, b]| torque(*a) * torque(*b) < 0.0).map(|[a, b]| root(a, b)).collect();
    assert!(roots.len() == 3 && roots[2] > PI, "{roots:?}");
    let mut found: Vec<_> = found(&scene, 64).equilibria;
    found.sort_by(|a, b| a.phi[0].total_cmp(&b.phi[0]));
    assert_eq!(found.len(), roots.len(), "{found:?}");
    for (one, root) in found.iter().zip(roots) {
        assert!((one.phi[0] - root).abs() < 1e-12, "{one:?} {root}");
        let square = (k - moment * root.sin()) / (0.0833333333333333 + 0.25);
        assert_eq!(one.stability, if square > 0.0 { Stability::Stable } else { Stability::Unstable });
        assert!((one.modes[0].frequency - square.abs().sqrt()).abs() < 1e-10 * square.abs().sqrt());
    }
}

/// A motor, a lock or a weld counts whole turns: where it holds two bodies and a torsion spring acts on the second, a place
/// in which they are a turn off is none of theirs.  One angle is left: V = g (0.6 sin a + 0.1 sin b) + k b²/2, b = a + c.
#[test]
fn whole_turns_between_bodies_held_to_each_other_are_kept() {
    let given = 0.7;
    let held = [
        r#""motors": [{"name": "m", "body": "b", "relative_to": "a", "law": {"start": 0.7}}]"#,
        r#""motors": [{"name": "m", "body": "a", "relative_to": "b", "law": {"start": -0.7}}]"#,
        r#""locks": [{"name": "m", "body": "b", "relative_to": "a", "angle": 0.7}]"#,
        r#""welds": [{"name": "m", "between": [{"body": "a", "point": [0.4, 0]}, {"body": "b", "point": [0, 0]}]}]"#,
    ];
    for (held, stiffness) in held.iter().flat_map(|held| [0.3, 1.0, 1.9].map(|k| (held, k))) {
        let is_weld = held.contains("welds");
        let hinge = r#", {"name": "B", "between": [{"body": "a", "point": [0.4, 0]}, {"body": "b", "point": [0, 0]}]}"#;
        let (hinge, b) = if is_weld { ("", r#", "b": {"phi": 1.0, "omega": 0}"#) } else { (hinge, "") };
        let scene = parsed(&format!(
            r#"{{"name": "held", "gravity": [0, -9.81],
                "bars": [{{"name": "a", "mass": 1, "centre": [0.2, 0], "inertia": 0.02, "length": 0.4}},
                    {{"name": "b", "mass": 1, "centre": [0.1, 0], "inertia": 0.02, "length": 0.3}}],
                "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}}{hinge}],
                {held},
                "torsion_springs": [{{"name": "coil", "body": "b", "stiffness": {stiffness}, "free_angle": 0}}],
                "start": {{"a": {{"phi": 0.3, "omega": 0}}{b}}}, "until": 1, "every": 0.1}}"#
        ));
        let torque = |a: f64| 9.81 * (0.6 * a.cos() + 0.1 * (a + given).cos()) + stiffness * (a + given);
        let found = found(&scene, 64).equilibria;
        for one in &found {
            let [a, b] = [one.phi[0], one.phi[1]];
            assert!((b - a - given).abs() < 1e-12 && torque(a).abs() < 1e-10, "{held} {stiffness}: {one:?}");
        }
        // At most half a turn of the first one away: all that there are; the search need not wind springs up.
        let ends = (-3000..3000).map(|i| [PI / 3e3 * f64::from(i), PI / 3e3 * f64::from(i + 1)]);
        let roots = ends.filter(|[a, b]| torque(*a) * torque(*b) < 0.0).count();
        let near = found.iter().filter(|one| one.phi[0].abs() < PI).count();
        assert!(roots >= 1 && near == roots, "{held} {stiffness}: {near} of {roots}");
    }
}

/// Two bars geared 2:3 stand beside each other in as many ways as in two turns of the first: all equilibria
/// of V = g (0.3 sin a - 0.1 sin 1.5 a) in them, each once, with the second where the gear has it.
#[test]
fn geared_bars_have_the_equilibria_of_all_their_turns() {
    let scene = parsed(
        r#"{"name": "geared", "gravity": [0, -9.81],
            "bars": [{"name": "a", "mass": 1, "centre": [0.3, 0], "inertia": 0.02, "length": 0.6},
                {"name": "b", "mass": 1, "centre": [0.1, 0], "inertia": 0.02, "length": 0.3}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
                {"name": "B", "between": [{"body": "ground", "point": [1, 0]}, {"body": "b", "point": [0, 0]}]}],
            "motors": [{"name": "gear", "body": "b", "law": "-1.5*a.phi"}],
            "start": {"a": {"phi": 0.5, "omega": 0}, "b": {"phi": -0.75}}, "until": 1, "every": 0.1}"#,
    );
    let slope = |a: f64| 9.81 * (0.3 * a.cos() - 0.15 * (1.5 * a).cos());
    let ends = (0..4000).map(|i| [PI / 1e3 * (f64::from(i) + 0.3), PI / 1e3 * (f64::from(i) + 1.3)]);
    let roots: Vec<f64> = ends.filter(|[a, b]| slope(*a) * slope(*b) < 0.0).map(|[a, _]| a).collect();
    let found = found(&scene, 64).equilibria;
    assert!(roots.len() == 4 && found.len() == 4, "{roots:?} {found:?}");
    for one in &found {
        let [a, b] = [one.phi[0], one.phi[1]];
        assert!((b + 1.5 * a).abs() < 1e-12 && slope(a).abs() < 1e-10, "{one:?}");
        let potential = 9.81 * (0.3 * a.sin() - 0.1 * (1.5 * a).sin());
        assert!((one.potential - potential).abs() < 1e-12, "{one:?}");
        let near = roots.iter().filter(|root| (a.rem_euclid(2.0 * TAU) - **root).abs() < 0.01).count();
        assert_eq!(near, 1, "{one:?}");
    }
}

/// A spring with a free length that has none pushes in no direction: the top of its cone is no equilibrium.
#[test]
fn no_equilibrium_is_where_a_spring_has_no_length() {
    let scene = parsed(
        r#"{"name": "apex", "gravity": [0, -3],
            "bars": [{"name": "a", "mass": 1.073, "centre": [0.289, 0], "inertia": 0.056, "length": 0.579},
                     {"name": "b", "mass": 1.788, "centre": [0.455, 0], "inertia": 0.081, "length": 0.909}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
                       {"name": "B", "between": [{"body": "a", "point": [0.579, 0]}, {"body": "b", "point": [0, 0]}]}],
            "springs": [{"name": "s", "between": [{"body": "ground", "point": [0.437, 0.797]}, {"body": "b", "point": [0.909, 0]}],
                         "stiffness": 7.252, "free_length": 0.271, "damping": 0.326}],
            "start": {"a": {"phi": -1.49, "omega": 0}, "b": {"phi": 1.536, "omega": 0}}, "until": 1, "every": 0.1}"#,
    );
    let potential = |a: f64, b: f64| {
        let tip = [0.579 * a.cos() + 0.909 * b.cos(), 0.579 * a.sin() + 0.909 * b.sin()];
        let stretch = (tip[0] - 0.437).hypot(tip[1] - 0.797) - 0.271;
        let height = [0.289 * a.sin(), 0.579 * a.sin() + 0.455 * b.sin()];
        3.0 * (1.073 * height[0] + 1.788 * height[1]) + 0.5 * 7.252 * stretch * stretch
    };
    let found = found(&scene, 64).equilibria;
    assert!(found.len() >= 4, "{found:?}");
    for one in found {
        let [a, b, here] = [one.phi[0], one.phi[1], potential(one.phi[0], one.phi[1])];
        // On either side: at the top of a cone differences over both are none.
        for h in [1e-6, -1e-6] {
            let slope = [potential(a + h, b) - here, potential(a, b + h) - here];
            assert!(slope.iter().all(|slope| (slope / h).abs() < 1e-3), "{slope:?} {one:?}");
        }
    }
}

/// A drive that winds a spring up does not do the same in every period; one that takes along what it is coiled
/// to does.
#[test]
fn a_wound_spring_is_not_periodic() {
    let scene = |spring: &str| {
        parsed(&format!(
            r#"{{"name": "winch", "gravity": [0, -9.81],
                "bars": [{{"name": "a", "mass": 1, "centre": [0.2, 0], "inertia": 0.1, "length": 0.4}},
                         {{"name": "b", "mass": 1, "centre": [0.2, 0], "inertia": 0.1, "length": 0.4}}],
                "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}},
                           {{"name": "B", "between": [{{"body": "ground", "point": [1, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
                "torsion_springs": [{spring}],
                "motors": [{{"name": "m", "body": "a", "law": {{"start": 0, "rate": 4}}}}],
                "start": {{"b": {{"phi": -1.5, "omega": 0}}}}, "until": 1, "every": 0.1}}"#
        ))
    };
    let found =
        |scene: &Scene| periodic(scene, &Arc::new(Mechanism::new(scene).expect("equations")), 2, None);
    let coil =
        |ends: &str| format!(r#"{{"name": "coil", {ends}, "stiffness": 30, "free_angle": 0, "damping": 1}}"#);
    match found(&scene(&coil(r#""body": "a""#))) {
        Err(ModesError::NotPeriodic { what, .. }) => assert!(what.contains('m'), "{what}"),
        other => panic!("{:?}", other.map(|found| found.motions)),
    }
    let cases = [(r#""body": "b""#, [1, 0]), (r#""body": "a", "relative_to": "b""#, [1, 1])];
    for (ends, turns) in cases {
        let found = found(&scene(&coil(ends))).expect("a motor that turns");
        assert!(found.motions.iter().any(|motion| motion.turns == turns), "{:?}", found.motions);
    }
}

/// Laws of force are on the branches of the positions looked at, not on those of the start.
#[test]
fn equilibria_are_found_on_every_branch_of_a_law() {
    let scene = parsed(
        r#"{"name": "branches", "gravity": [0, 0],
            "bars": [{"name": "a", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 1}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]}],
            "torsion_springs": [{"name": "coil", "body": "a", "stiffness": 2, "free_angle": 0}],
            "torques": [{"name": "T", "body": "a", "torque": "1*if(a.phi > 0.6, 2 - a.phi, if(a.phi < -1, -4, 0))"}],
            "start": {"a": {"phi": 0.1, "omega": 0}}, "until": 1, "every": 0.1}"#,
    );
    let mut found = found(&scene, 32).equilibria;
    found.sort_by(|a, b| a.phi[0].total_cmp(&b.phi[0]));
    let expected = [(-2.0, 2.0), (0.0, 2.0), (2.0 / 3.0, 3.0)];
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (one, (phi, stiffness)) in found.iter().zip(expected) {
        assert!((one.phi[0] - phi).abs() < 1e-12, "{one:?}");
        assert!((one.modes[0].frequency - (stiffness / 0.5_f64).sqrt()).abs() < 1e-12, "{one:?}");
    }
    // Beyond four radians the torque is off: a turn on is another position there.
    let scene = parsed(
        r#"{"name": "off", "gravity": [0, -9.81],
            "bars": [{"name": "a", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]}],
            "torques": [{"name": "T", "body": "a", "torque": "1*if(a.phi > 4, 0, 1)"}],
            "start": {"a": {"phi": 4.3, "omega": 0}}, "until": 1, "every": 0.1}"#,
    );
    let found = self::found(&scene, 32).equilibria;
    for one in &found {
        let phi = one.phi[0];
        let torque = if phi > 4.0 { 0.0 } else { 1.0 };
        assert!((torque - 4.905 * phi.cos()).abs() < 1e-9, "{one:?}");
    }
    let at = |phi: f64| found.iter().any(|one| (one.phi[0] - phi).abs() < 1e-9);
    assert!(at(1.5 * PI) && at((1.0_f64 / 4.905).acos()) && at(-(1.0_f64 / 4.905).acos()), "{found:?}");
}

/// A platform on three equal parallel cranks moves by its redundance; in other assemblies nothing can.
#[test]
fn assemblies_that_nothing_moves_are_left() {
    let crank = |name: &str| {
        format!(r#"{{"name": "{name}", "mass": 1, "centre": [0.15, 0], "inertia": 0.01, "length": 0.3}}"#)
    };
    let [c0, c1, c2] = ["c0", "c1", "c2"].map(crank);
    let hinges: Vec<String> = [("c0", "0, 0"), ("c1", "1, 0"), ("c2", "0.5, 0.1")]
        .iter()
        .flat_map(|(name, at)| {
            [
                format!(r#"{{"name": "A{name}", "between": [{{"body": "ground", "point": [{at}]}}, {{"body": "{name}", "point": [0, 0]}}]}}"#),
                format!(r#"{{"name": "B{name}", "between": [{{"body": "{name}", "point": [0.3, 0]}}, {{"body": "cp", "point": [{at}]}}]}}"#),
            ]
        })
        .collect();
    let scene = parsed(&format!(
        r#"{{"name": "cranks", "gravity": [0, -10],
        "bars": [{{"name": "cp", "mass": 1, "centre": [0.4, 0], "inertia": 0.05, "length": 1}}, {c0}, {c1}, {c2}],
        "hinges": [{}],
        "start": {{"cp": {{"phi": 0}}, "c0": {{"phi": 1.2}}, "c1": {{"phi": 1.2}}, "c2": {{"phi": 1.2}}}},
        "until": 1, "every": 0.1}}"#,
        hinges.join(", ")
    ));
    let found = found(&scene, 64);
    assert_eq!(found.degrees_of_freedom, 1);
    // Down and up, as one pendulum: (J3 + m3 c² + m l²) w² = (3 m c + m l) g.
    let [m, c, l] = [1.0, 0.15, 0.3];
    let square = (3.0 * m * c + m * l) * 10.0 / (3.0 * (0.01 + m * c * c) + m * l * l);
    let down = lowest(&found);
    assert!((down.modes[0].frequency / f64::sqrt(square) - 1.0).abs() < 1e-9, "{down:?} {square}");
}

/// A bar that hangs along x in gravity g, with more parts.
fn hanging(gravity: f64, parts: &str) -> Scene {
    parsed(&format!(
        r#"{{"name": "hanging", "gravity": [{gravity}, 0],
        "bars": [{{"name": "a", "mass": 2, "centre": [0.5, 0], "inertia": 0.2, "length": 1}}],
        "hinges": [{{"name": "A", "between":
            [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}}],
        {parts},
        "start": {{"a": {{"phi": 0.02, "omega": 0}}}}, "until": 3, "every": 0.05}}"#
    ))
}

fn coil(torque: &str) -> String {
    format!(r#""torsion_springs": [{{"name": "c", "body": "a", "torque": "{torque}"}}]"#)
}

/// The equilibrium at which the bar hangs down.
fn down(scene: &Scene) -> Equilibrium {
    let near = |one: &Equilibrium| one.phi[0].abs() < 0.2;
    found(scene, 16).equilibria.into_iter().find(near).unwrap_or_else(|| panic!("{scene:?}"))
}

/// Where the slopes of a torque differ on both sides of an equilibrium, in the angle or in the rate, or are
/// none, there are no modes.
#[test]
fn an_equilibrium_on_a_corner_has_no_modes() {
    for torque in [
        "if(angle < 0, 0, 5*angle)",
        "max(0, 5*angle)",
        "max(5*angle, 4*angle)",
        "3*angle + 0.1*sign(rate)",
        "3*angle + 0.2*abs(rate)",
        "2*angle*sign(rate)",
        "3*angle + 0.1*sqrt(rate*rate)",
        "max(1*angle, 1*rate)",
    ] {
        let one = down(&hanging(9.81, &coil(torque)));
        assert!(one.is_on_corner && one.modes.is_empty() && !one.is_family, "{torque}: {one:?}");
        assert_eq!(one.stability, Stability::Undecided, "{torque}");
    }
    // An infinite slope, found from where it is.
    let mut steep = hanging(9.81, &coil("3*sign(angle)*sqrt(abs(angle))"));
    steep.start[0].phi = 0.0;
    let one = down(&steep);
    assert!(one.is_on_corner && one.modes.is_empty() && one.stability == Stability::Undecided, "{one:?}");
    // A rope at its free length: 80 N/m where the bar turns away from its end, and none where it turns to it.
    let rope = r#""springs": [{"name": "s", "tension": "max(0, 80*(length - 1))",
        "between": [{"body": "ground", "point": [1, 1]}, {"body": "a", "point": [1, 0]}]}]"#;
    assert!(down(&hanging(9.81, rope)).is_on_corner);
    // A jump in the angle holds the bar between two branches, each of which has its equilibrium beyond it.
    let held = found(&hanging(9.81, &coil("0.5*sign(angle)")), 16);
    assert!(held.equilibria.iter().all(|one| one.phi[0].abs() > 1.0), "{:?}", held.equilibria);
    assert!(held.left_out.contains(&"positions held by jumps of forces"), "{:?}", held.left_out);
}

/// The same torques with equal slopes, and with the corner next to the equilibrium, have the modes of these.
#[test]
fn an_equilibrium_beside_a_corner_has_its_modes() {
    let inertia = 0.2 + 2.0 * 0.25;
    for (torque, stiffness, damping) in [
        ("2*angle*abs(angle)", 0.0, 0.0),
        ("2*angle*abs(1*rate)", 0.0, 0.0),
        ("max(5*angle, 4*angle - 1e-4)", 5.0, 0.0),
        ("if(angle < 1e-5, 3*angle, 5*angle - 2e-5)", 3.0, 0.0),
        ("3*angle + 1e-4*tanh(rate/1e-4)", 3.0, 1.0),
        ("1*sin(3*angle) + 0.1*rate", 3.0, 0.1),
    ] {
        let one = down(&hanging(9.81, &coil(torque)));
        assert!(!one.is_on_corner, "{torque}: {one:?}");
        let (b, c) = (damping / inertia, (9.81 + stiffness) / inertia);
        let [re, im] = one.modes[0].eigenvalue;
        assert!(
            (re + b / 2.0).abs() < 1e-6 && (im - (c - b * b / 4.0).sqrt()).abs() < 1e-6,
            "{torque}: {one:?}"
        );
    }
    // Without gravity the bar is at rest wherever the torque is none; on its corner alone there are no modes.
    let all = found(&hanging(0.0, &coil("max(0, 5*angle)")), 16).equilibria;
    let free = all.iter().find(|one| one.phi[0] < -1e-3).expect("free");
    assert!(free.is_family && !free.is_on_corner && free.stability == Stability::Stable, "{free:?}");
}

/// m r'' = -k r - c (r' r) r / r^2: linear on a line, m s^2 + c s + k = 0, and of no derivative in the plane, where
/// the damper acts along the way the ends part.  Without a damper the spring is as smooth in the plane.
#[test]
fn a_damper_whose_ends_meet_is_on_a_corner_in_the_plane() {
    let of = |rail: &str, damping: f64| {
        let scene = parsed(&format!(
            r#"{{"name": "meeting", "gravity": [0, 0], {rail}
            "bars": [{{"name": "b", "mass": 2, "centre": [0, 0], "inertia": 0.1, "length": 0.2}}],
            "springs": [{{"name": "s", "stiffness": 50, "free_length": 0, "damping": {damping},
                "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
            "torsion_springs": [{{"name": "t", "body": "b", "stiffness": 2, "free_angle": 0}}],
            "start": {{"b": {{"phi": 0, "omega": 0, "origin": [0, -0.2], "velocity": [0, 0]}}}},
            "until": 20, "every": 0.1}}"#
        ));
        let all = found(&scene, 8).equilibria;
        assert_eq!(all.len(), 1, "{all:?}");
        all.into_iter().next().expect("one")
    };
    let rail = r#""sliders": [{"name": "r", "point": {"body": "b", "point": [0, 0]}, "angle": "locked",
        "rail": {"body": "ground", "point": [0, 0], "direction": [0, 1]}}],"#;
    let one = of("", 1.0);
    assert!(one.is_on_corner && one.modes.is_empty() && one.stability == Stability::Undecided, "{one:?}");
    let one = of("", 0.0);
    let frequencies: Vec<f64> = one.modes.iter().map(|mode| mode.frequency).collect();
    let expected = [20.0_f64.sqrt(), 5.0, 5.0];
    let is_near = |(have, want): (&f64, &f64)| (have - want).abs() < 1e-9;
    assert!(frequencies.len() == 3 && frequencies.iter().zip(&expected).all(is_near), "{one:?}");
    let one = of(rail, 1.0);
    let [re, im] = one.modes[0].eigenvalue;
    assert!((re + 0.25).abs() < 1e-9 && (im - (25.0 - 0.0625_f64).sqrt()).abs() < 1e-9, "{one:?}");
}

/// A closed loop with a torque of the angle of its follower.
#[test]
fn corners_are_found_along_constraints() {
    let hinge = |name: &str, bodies: [&str; 2], along: [f64; 2]| {
        let end = |k: usize| format!(r#"{{"body": "{}", "point": [{}, 0]}}"#, bodies[k], along[k]);
        format!(r#"{{"name": "{name}", "between": [{}, {}]}}"#, end(0), end(1))
    };
    let text = |torque: &str| {
        format!(
            r#"{{"name": "loop", "gravity": [0, -9.81],
            "bars": [{{"name": "a", "mass": 1, "centre": [0.2, 0], "inertia": 0.02, "length": 0.4}},
                     {{"name": "b", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}},
                     {{"name": "c", "mass": 1, "centre": [0.4, 0], "inertia": 0.06, "length": 0.8}}],
            "hinges": [{}, {}, {}, {}],
            "torques": [{{"name": "T", "body": "c", "torque": "{torque}"}}],
            "start": {{"a": {{"phi": -1.9, "omega": 0}}, "b": {{"phi": 1.13}}, "c": {{"phi": 2.42}}}},
            "until": 1, "every": 0.1}}"#,
            hinge("A", ["ground", "a"], [0.0, 0.0]),
            hinge("B", ["a", "b"], [0.4, 0.0]),
            hinge("C", ["b", "c"], [1.0, 0.8]),
            hinge("D", ["ground", "c"], [0.9, 0.0]),
        )
    };
    let free = found(&parsed(&text("0*c.phi")), 16);
    assert!(free.equilibria.iter().all(|one| !one.is_on_corner), "{:?}", free.equilibria);
    let (angle, slowest) = (lowest(&free).phi[2], lowest(&free).modes[0].frequency);
    let lower = |law: &str| {
        let all = found(&parsed(&text(law)), 16).equilibria;
        let at = |one: &Equilibrium| (one.phi[2] - angle).abs() < 1e-6;
        all.into_iter().find(at).unwrap_or_else(|| panic!("{law}"))
    };
    for law in [
        format!("-min(0, 2*(c.phi - {angle:?}))"),
        format!("-1*abs(c.phi - {angle:?})"),
        "-0.1*abs(c.omega)".to_owned(),
    ] {
        assert!(lower(&law).is_on_corner, "{law}");
    }
    let smooth = lower(&format!("-2*(c.phi - {angle:?})*abs(c.phi - {angle:?})"));
    assert!(!smooth.is_on_corner && (smooth.modes[0].frequency - slowest).abs() < 1e-6, "{smooth:?}");
}

/// A weak torsion spring leaves equilibria over several turns: m g c cos a + k (a - a0) = 0 has all of them where
/// |a - a0| <= m g c / k, about two turns to either side.
#[test]
fn equilibria_are_found_over_several_turns() {
    let [mass, centre, stiffness, free] = [2.0, 0.5, 0.9, -0.4];
    for own in [0.2, 0.2 + TAU] {
        let scene = parsed(&format!(
            r#"{{"name": "coil", "gravity": [0, -9.81],
                "bars": [{{"name": "b", "mass": {mass}, "centre": [{centre}, 0], "inertia": 0.1, "length": 1}}],
                "hinges": [{{"name": "O", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
                "torsion_springs": [{{"name": "s", "body": "b", "stiffness": {stiffness}, "free_angle": {free}}}],
                "start": {{"b": {{"phi": {own}, "omega": 0}}}}, "until": 1, "every": 0.1}}"#
        ));
        let torque = |a: f64| mass * 9.81 * centre * f64::cos(a) + stiffness * (a - free);
        let places = (-13_000..13_000).map(|i| [1e-3 * f64::from(i), 1e-3 * f64::from(i + 1)]);
        let roots: Vec<f64> =
            places.filter(|[a, b]| torque(*a) * torque(*b) < 0.0).map(|[a, b]| 0.5 * (a + b)).collect();
        assert_eq!(roots.len(), 7, "{roots:?}");
        let mut found = found(&scene, 64).equilibria;
        found.sort_by(|a, b| a.phi[0].total_cmp(&b.phi[0]));
        assert_eq!(found.len(), roots.len(), "{found:?}");
        for (k, (one, root)) in found.iter().zip(&roots).enumerate() {
            assert!((one.phi[0] - root).abs() < 1e-3 && torque(one.phi[0]).abs() < 1e-11, "{one:?} {root}");
            assert_eq!(one.stability == Stability::Stable, k % 2 == 0, "{one:?}");
        }
    }
}
