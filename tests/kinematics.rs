//! Kinematics against closed forms that share nothing with the solver: circles that meet, statics of three
//! bodies as nine equations, power, limits and dead centres by the law of cosines.

use driftless::dynamics::Mechanism;
use driftless::run::kinematics::{KinematicDrive, Kinematics, KinematicsError, Position, kinematics};
use driftless::scene::{Output, Scene, parse_scene, read_scene};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn example(name: &str) -> Scene {
    read_scene(format!("examples/scenes/{name}.json").as_ref(), &[]).expect("a shipped scene")
}

fn drive(text: &str) -> KinematicDrive {
    text.parse().expect("a drive")
}

fn over(scene: &Scene, text: &str, count: usize) -> Kinematics {
    kinematics(scene, &drive(text), count).unwrap_or_else(|error| panic!("{text}: {error}"))
}

/// Lengths of the crank-rocker: crank, coupler, rocker, ground.
const A: f64 = 0.1;
const B: f64 = 0.3;
const C: f64 = 0.25;
const D: f64 = 0.32;

/// Angles of coupler and rocker from that of the crank, where the circles about A and C meet above.
fn closed(crank: f64) -> [f64; 2] {
    let (x, y) = (A * crank.cos(), A * crank.sin());
    let (dx, dy) = (D - x, -y);
    let distance = dx.hypot(dy);
    let along = (B * B - C * C + distance * distance) / (2.0 * distance);
    let up = (B * B - along * along).sqrt();
    let (bx, by) = (x + (along * dx - up * dy) / distance, y + (along * dy + up * dx) / distance);
    [(by - y).atan2(bx - x), by.atan2(bx - D)]
}

/// The same with first and second derivatives by the crank's angle, from the loop's equations.
fn derived(crank: f64) -> [[f64; 3]; 2] {
    let [f, r] = closed(crank);
    let det = B * C * (f - r).sin();
    // A e^(i crank) + B e^(i f) = D + C e^(i r), differentiated once and twice.
    let solve =
        |x: f64, y: f64| [-C * (x * r.cos() + y * r.sin()) / det, -B * (x * f.cos() + y * f.sin()) / det];
    let [df, dr] = solve(A * crank.sin(), -A * crank.cos());
    let [ddf, ddr] = solve(
        A * crank.cos() + B * f.cos() * df * df - C * r.cos() * dr * dr,
        A * crank.sin() + B * f.sin() * df * df - C * r.sin() * dr * dr,
    );
    [[f, df, ddf], [r, dr, ddr]]
}

#[test]
fn positions_rates_and_accelerations_are_those_of_circles_that_meet() {
    let scene = example("crank_rocker");
    let found = over(&scene, "motor", 720);
    assert!(found.is_turn && found.is_closed && found.limits.is_empty() && found.change_points.is_empty());
    assert_eq!(found.positions.len(), 721);
    assert_eq!(found.branches.len(), 1, "{:?}", found.branches);
    let w = 10.0 * PI;
    for Position { drive, phi, omega, alpha, .. } in &found.positions {
        for (k, [value, first, second]) in derived(*drive).into_iter().enumerate() {
            assert!((phi[k + 1] - value).abs() < 1e-12, "{drive}: {phi:?} {value}");
            assert!((omega[k + 1] - w * first).abs() < 1e-11 * w, "{drive}: {omega:?} {first}");
            assert!((alpha[k + 1] - w * w * second).abs() < 1e-10 * w * w, "{drive}: {alpha:?} {second}");
        }
    }
    // The other assembly is the mirror image.
    let (start, other) = (&found.positions[0].phi, &found.branches[0]);
    assert!((start[1] + other[1]).abs() < 1e-12 && (start[2] + other[2]).abs() < 1e-12);
}

#[test]
fn limits_and_dead_centres_are_where_the_law_of_cosines_has_them() {
    let scene = example("crank_rocker");
    // Where crank and coupler are in line.
    let folded = |length: f64| PI - ((C * C + D * D - length * length) / (2.0 * C * D)).acos();
    let ends = [folded(A + B).min(folded(B - A)), folded(A + B).max(folded(B - A))];
    let turned = over(&scene, "motor", 100);
    let mut of_rocker: Vec<f64> =
        turned.dead_centres.iter().filter(|at| at.name == "rocker").map(|at| at.value).collect();
    of_rocker.sort_by(f64::total_cmp);
    assert_eq!(of_rocker.len(), 2);
    for (found, end) in of_rocker.iter().zip(ends) {
        assert!((found - end).abs() < 1e-12, "{found} {end}");
    }
    for at in turned.dead_centres.iter().filter(|at| at.name == "rocker") {
        assert_eq!(at.in_line, ["A"]);
    }
    // The rocker as the drive cannot pass them.
    let swung = over(&scene, "rocker=0..3", 300);
    let limits: Vec<f64> = swung.limits.iter().map(|limit| limit.drive).collect();
    assert_eq!(limits.len(), 2);
    for (limit, end) in limits.iter().zip(ends) {
        assert!((limit - end).abs() < 1e-12, "{limit} {end}");
    }
    assert!(swung.limits.iter().all(|limit| limit.is_fold && limit.in_line == ["A"]), "{:?}", swung.limits);
    assert!(swung.positions.iter().all(|at| at.drive > ends[0] && at.drive < ends[1]));
    // A motor at the rocker does not depend on how fast it goes, nor the limits on how many positions.
    let slowly = kinematics(&scene, &KinematicDrive { rate: Some(1e-3), ..drive("rocker=0..3") }, 7)
        .expect("kinematics");
    for (slow, limit) in slowly.limits.iter().zip(&limits) {
        assert!((slow.drive - limit).abs() < 1e-11, "{slow:?} {limit}");
    }
    // Least transmission angle: where the diagonal is shortest.
    let least = ((B * B + C * C - (D - A) * (D - A)) / (2.0 * B * C)).acos();
    let range =
        turned.ranges.iter().find(|range| range.name == "transmission.B").expect("a transmission angle");
    assert!((range.min[0] - least).abs() < 1e-12 && (range.max[0] - FRAC_PI_2).abs() < 1e-6, "{range:?}");
}

/// The rocker as the drive goes to where crank and coupler are in line; there the crank is infinitely fast, and
/// the pen where the law of cosines has it.
#[test]
fn extremes_reach_up_to_the_limits_however_many_positions_there_are() {
    let mut scene = example("crank_rocker");
    scene.outputs.retain(|output| ["pen.x", "pen_speed"].contains(&output.name.as_str()));
    let pen = |crank: f64, f: f64| A * crank.cos() + 0.15 * f.cos() - 0.12 * f.sin();
    // The angle at the ground of the triangle of ground, rocker and the line of crank and coupler.
    let angle = |line: f64| ((D * D + line * line - C * C) / (2.0 * D * line)).acos();
    let [stretched, folded] = [A + B, B - A].map(angle);
    let most = [pen(folded + PI, folded), pen(stretched, stretched)];
    for count in [7, 36] {
        let swung = kinematics(&scene, &KinematicDrive { rate: Some(1.0), ..drive("rocker=0..3") }, count)
            .expect("kinematics");
        let [upper, lower] = [1, 0].map(|k| swung.limits[k].drive);
        let range = |name: &str| swung.ranges.iter().find(|range| range.name == name).expect("a column");
        let x = range("pen.x");
        assert!((x.max[0] - most[1]).abs() < 1e-7 && x.max[1] == lower, "{count}: {x:?} {most:?}");
        assert!((x.min[0] - most[0]).abs() < 1e-7 && x.min[1] == upper, "{count}: {x:?} {most:?}");
        assert_eq!(range("motor.torque").min, [f64::NEG_INFINITY, lower], "{count}");
        assert_eq!(range("motor.torque").max, [f64::INFINITY, upper], "{count}");
        let speed = range("pen_speed");
        assert!((speed.min[0] - 0.24418).abs() < 1e-5 && speed.max[0].is_infinite(), "{count}: {speed:?}");
        assert!(range("transmission.A").min[0].abs() < 1e-7, "{count}: {:?}", range("transmission.A"));
        let object = driftless::report::kinematics::object(&swung);
        let told = &object["extremes"]["motor.torque"]["max"];
        assert!(told["value"].is_null() && told["drive"].as_f64() == Some(upper), "{told}");
        assert!(driftless::report::kinematics::text(&swung).contains("unbounded"));
    }
}

/// The rocker as the drive from beside its limit, where the crank is fast: it stays on its side of the dead centre.
#[test]
fn no_branch_is_left_for_another_beside_a_limit() {
    let text = std::fs::read_to_string("examples/scenes/crank_rocker.json").expect("a shipped scene");
    let dead = ((D * D + (A + B) * (A + B) - C * C) / (2.0 * D * (A + B))).acos();
    for beside in [0.01, 0.003, 0.001, -0.003, -0.01] {
        let crank = dead + beside;
        let [coupler, rocker] = closed(crank);
        let text = text
            .replace("\"speed*t\"", &format!("\"{crank:?} + speed*t\""))
            .replace("0.9}", &format!("{coupler:?}}}, \"rocker\": {{\"phi\": {rocker:?}}}"));
        let scene = parse_scene(&text, "beside", &[]).expect("a scene");
        for count in 2..60 {
            let found = over(&scene, &format!("rocker={rocker:?}..{:?}", rocker + 0.6), count);
            for Position { drive, phi, .. } in &found.positions {
                let turned = (phi[0] - dead) * beside.signum();
                assert!(turned > 0.0 && turned < PI, "{beside} {count}: crank {} at {drive}", phi[0]);
                assert!((closed(phi[0])[1] - drive).abs() < 1e-9, "{beside} {count}: {drive}");
            }
        }
    }
}

#[test]
fn extremes_are_the_same_wherever_a_turn_begins_and_however_many_positions_it_has() {
    let mut scene = example("crank_rocker");
    let output = |name: &str| Output { name: name.replace('.', "_"), formula: name.to_owned() };
    scene.outputs = vec![output("rocker.omega"), output("rocker.alpha")];
    let w = 10.0 * PI;
    let of = |crank: f64| {
        let [_, [_, first, second]] = derived(crank);
        [w * first, w * w * second]
    };
    let dense: Vec<[f64; 2]> = (0..200_000).map(|k| of(TAU * f64::from(k) / 200_000.0)).collect();
    for (count, shifts) in [(360, 40), (48, 25), (24, 13)] {
        for shift in 0..shifts {
            let from = -TAU * f64::from(shift) / f64::from(shifts);
            let turn = KinematicDrive { range: Some([from, from + TAU]), ..drive("motor") };
            let found = kinematics(&scene, &turn, count).expect("kinematics");
            for (k, name) in ["rocker_omega", "rocker_alpha"].into_iter().enumerate() {
                let range = found.ranges.iter().find(|range| range.name == name).expect("an output");
                let least = dense.iter().map(|values| values[k]).fold(f64::INFINITY, f64::min);
                let most = dense.iter().map(|values| values[k]).fold(f64::NEG_INFINITY, f64::max);
                for (end, exact) in [(range.min, least), (range.max, most)] {
                    assert!(
                        (end[0] - exact).abs() < 1e-8 * exact.abs(),
                        "{name} {count} {from}: {end:?} {exact}"
                    );
                    assert!(
                        (of(end[1])[k] - exact).abs() < 1e-8 * exact.abs(),
                        "{name} {count} {from}: {end:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_range_of_too_many_turns_is_refused() {
    let far = kinematics(&example("crank_rocker"), &drive("motor=0..2e6"), 3);
    let error = far.expect_err("too far").to_string();
    assert!(
        error.contains("`motor` would go from 0 to 2e6 rad") && error.contains("at most 1e6 rad"),
        "{error}"
    );
}

/// Torque and the forces at O, A, B and C on crank, coupler and rocker, from the nine equations of three bodies.
fn balanced(crank: f64, w: f64, gravity: f64) -> [f64; 5] {
    let bodies = [A, B, C].map(|length| {
        let mass = length * 0.02 * 0.01 * 7850.0;
        (length, mass, mass * (length * length + 0.02 * 0.02) / 12.0)
    });
    let [[f, df, ddf], [r, dr, ddr]] = derived(crank);
    let motions = [[crank, w, 0.0], [f, df * w, ddf * w * w], [r, dr * w, ddr * w * w]];
    // Acceleration of a point at a distance along a body from its origin, which is at (origin).
    let swing = |[phi, rate, pull]: [f64; 3], length: f64| {
        [
            length * (-pull * phi.sin() - rate * rate * phi.cos()),
            length * (pull * phi.cos() - rate * rate * phi.sin()),
        ]
    };
    let end = swing(motions[0], A);
    let centre = |k: usize| {
        let own = swing(motions[k], bodies[k].0 / 2.0);
        if k == 1 { [own[0] + end[0], own[1] + end[1]] } else { own }
    };
    // Unknowns: O, A, B, C as forces of the first body on the next, and the torque.
    let (mut m, mut b) = (DMatrix::<f64>::zeros(9, 9), DVector::<f64>::zeros(9));
    for k in 0..3 {
        let (length, mass, inertia) = bodies[k];
        let [phi, _, pull] = motions[k];
        let half = [0.5 * length * phi.cos(), 0.5 * length * phi.sin()];
        let a = centre(k);
        // (unknown, sign, arm): crank has O at its origin and -A at its end; coupler A and -B; rocker C and B.
        let forces = match k {
            0 => [(0, 1.0, -1.0), (2, -1.0, 1.0)],
            1 => [(2, 1.0, -1.0), (4, -1.0, 1.0)],
            _ => [(6, 1.0, -1.0), (4, 1.0, 1.0)],
        };
        for (column, sign, arm) in forces {
            m[(3 * k, column)] += sign;
            m[(3 * k + 1, column + 1)] += sign;
            m[(3 * k + 2, column)] -= sign * arm * half[1];
            m[(3 * k + 2, column + 1)] += sign * arm * half[0];
        }
        b[3 * k] = mass * a[0];
        b[3 * k + 1] = mass * (a[1] - gravity);
        b[3 * k + 2] = inertia * pull;
    }
    m[(2, 8)] = 1.0;
    let x = m.lu().solve(&b).expect("regular");
    [x[8], x[0].hypot(x[1]), x[2].hypot(x[3]), x[4].hypot(x[5]), x[6].hypot(x[7])]
}

#[test]
fn loads_are_those_of_nine_equations_at_speed_and_at_rest() {
    let mut scene = example("crank_rocker");
    scene.outputs.retain(|output| ["O", "A", "B", "C"].contains(&output.name.as_str()));
    for rate in [10.0 * PI, 1.0, 1e-4] {
        let found = kinematics(&scene, &KinematicDrive { rate: Some(rate), ..drive("motor") }, 180)
            .expect("kinematics");
        let names: Vec<String> = found.ranges.iter().map(|range| range.name.clone()).collect();
        assert_eq!(names[..5], ["motor.torque", "O", "A", "B", "C"]);
        let mut peaks = [0.0_f64; 5];
        for at in &found.positions {
            let expected = balanced(at.drive, rate, -9.81);
            let scale = expected[1..].iter().copied().fold(0.0, f64::max);
            assert!((at.force - expected[0]).abs() < 1e-11 * scale, "{} {expected:?}", at.force);
            for (value, expected) in at.outputs.iter().zip(&expected[1..]) {
                assert!((value - expected).abs() < 1e-11 * scale, "{rate}: {value} {expected}");
            }
            peaks.iter_mut().zip(expected).for_each(|(peak, value)| *peak = peak.max(value));
        }
        for (range, peak) in found.ranges.iter().zip(peaks) {
            assert!(range.max[0] >= peak - 1e-12 && range.max[0] < peak * 1.002, "{range:?} {peak}");
            let there = balanced(range.max[1], rate, -9.81);
            assert!(there.iter().any(|value| (value - range.max[0]).abs() < 1e-9 * peak), "{range:?}");
        }
    }
}

/// A rocker that swings through half a turn, and further with more turns behind it: what its spring asks of the
/// motor is k (b - b0) db/da, whatever turns `b` has.
#[test]
fn a_torsion_spring_counts_the_turns_of_its_body() {
    let (r, d, free) = (0.24_f64, 0.9, 0.7);
    for turns in [0.0, 2.0] {
        let scene = |stiffness: f64| {
            let text = format!(
                r#"{{"name": "rocker", "gravity": [0, 0],
                "bars": [{{"name": "crank", "mass": 1, "centre": [0.1, 0], "inertia": 0.02, "length": {r}}},
                    {{"name": "rocker", "mass": 1.4, "centre": [0.7, 0.04], "inertia": 0.07, "length": 1.4}}],
                "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "crank", "point": [0, 0]}}]}},
                    {{"name": "B", "between": [{{"body": "ground", "point": [{d}, 0]}}, {{"body": "rocker", "point": [0, 0]}}]}}],
                "sliders": [{{"name": "S", "point": {{"body": "crank", "point": [{r}, 0]}},
                    "rail": {{"body": "rocker", "point": [0, 0], "direction": [1, 0]}}}}],
                "torsion_springs": [{{"name": "spring", "body": "rocker", "stiffness": {stiffness}, "free_angle": {free}}}],
                "motors": [{{"name": "motor", "body": "crank", "law": {{"start": 0.3, "rate": 2}}}}],
                "start": {{"rocker": {{"phi": {}}}}}, "until": 1, "every": 1}}"#,
                3.04 + TAU * turns
            );
            parse_scene(&text, "rocker", &[]).expect("a scene")
        };
        let [stiff, soft] = [3.0, 1.0].map(|stiffness| over(&scene(stiffness), "motor=0.3..7", 60));
        for (stiff, soft) in stiff.positions.iter().zip(&soft.positions) {
            let a = stiff.drive;
            let b = PI + (-r * a.sin()).atan2(d - r * a.cos()) + TAU * turns;
            let by_a = (r * r - r * d * a.cos()) / (r * r + d * d - 2.0 * r * d * a.cos());
            assert!((stiff.phi[1] - b).abs() < 1e-12, "{a}: {} {b}", stiff.phi[1]);
            let (found, expected) = (stiff.force - soft.force, 2.0 * (b - free) * by_a);
            assert!((found - expected).abs() < 1e-10, "{a}: {found} instead of {expected}");
        }
    }
}

#[test]
fn a_slider_crank_goes_as_far_as_crank_and_rod_reach() {
    // Its own start is a dead centre of the block.
    let set = ["motors.motor.law.start=1".parse().expect("an override")];
    let scene = read_scene("examples/scenes/slider_crank_driven.json".as_ref(), &set).expect("a scene");
    let lengths = [scene.bars[0].length, scene.bars[1].length];
    let slider = scene.sliders[0].name.clone();
    let found = over(&scene, &format!("{slider}=0..10"), 400);
    let ends: Vec<f64> = found.limits.iter().map(|limit| limit.drive).collect();
    let reach = [lengths[1] - lengths[0], lengths[0] + lengths[1]];
    assert!(ends.iter().any(|end| (end - reach[1]).abs() < 1e-12), "{ends:?} {reach:?}");
    assert_eq!(found.unit, "m");
    // And back: where the motor turns, the block turns back there.
    let turned = over(&scene, "motor", 360);
    assert!(turned.is_closed);
    for at in &turned.positions {
        let rod = (-lengths[0] / lengths[1] * at.drive.sin()).asin();
        assert!((at.phi[1] - rod).abs() < 1e-12, "{} {}", at.phi[1], rod);
    }
    let block: Vec<[f64; 2]> =
        turned.dead_centres.iter().filter(|at| at.name == slider).map(|at| [at.drive, at.value]).collect();
    assert_eq!(block.len(), 2, "{:?}", turned.dead_centres);
    for (found, expected) in block.iter().zip([[PI, lengths[0] - lengths[1]], [TAU, reach[1]]]) {
        let expected = [expected[0], expected[1].abs()];
        assert!((found[0] - expected[0]).abs() < 1e-9 && (found[1] - expected[1]).abs() < 1e-12, "{found:?}");
    }
    assert!(turned.dead_centres.iter().any(|at| at.name == slider && at.in_line == ["A"]));
}

/// A crank r and a rod l with the centres of mass in their middles, and a massless pin on a rail along x.
fn slider_crank(r: f64, l: f64, motors: &str) -> Scene {
    let text = format!(
        r#"{{"name": "sd", "gravity": [0, -9.81],
        "bars": [{{"name": "a", "mass": 1, "centre": [{}, 0], "inertia": 0.01, "length": {r}}},
            {{"name": "b", "mass": 2, "centre": [{}, 0], "inertia": 0.05, "length": {l}}}],
        "hinges": [{{"name": "O", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}},
            {{"name": "A", "between": [{{"body": "a", "point": [{r}, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
        "sliders": [{{"name": "S", "point": {{"body": "b", "point": [{l}, 0]}},
            "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}}}],
        "start": {{"a": {{"phi": 1.3}}, "b": {{"phi": {}}}}}, {motors} "until": 1, "every": 1}}"#,
        0.5 * r,
        0.5 * l,
        -(r * 1.3_f64.sin() / l).asin()
    );
    parse_scene(&text, "sd", &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// What moves a slider is the force along its rail, not that of the rail: it does the work against gravity.
#[test]
fn the_force_that_drives_a_slider_is_that_of_virtual_work() {
    let (r, l) = (0.2, 0.5);
    let motor = r#""motors": [{"name": "M", "slider": "S", "law": {"start": 0.5, "rate": 1e-6}}],"#;
    for (motors, name) in [("", "S"), (motor, "M")] {
        let scene = slider_crank(r, l, motors);
        let drive = KinematicDrive { rate: Some(1e-6), ..drive(&format!("{name}=0.32..0.65")) };
        let found = kinematics(&scene, &drive, 40).expect("kinematics");
        for at in &found.positions {
            let x = at.drive;
            let cosine = (x * x + r * r - l * l) / (2.0 * r * x);
            let slope = (x * x - r * r + l * l) / (2.0 * r * x * x);
            // Of V = g (m r/2 + M r/2) sin(angle of the crank), the rod's centre being half as high as its end.
            let expected = -9.81 * 1.5 * r * cosine * slope / (1.0 - cosine * cosine).sqrt();
            assert!((at.force - expected).abs() < 1e-8, "{name} at {x}: {} for {expected}", at.force);
        }
    }
}

/// The ram of a shaper turns back where its rocker does, and the pin in the slot where the crank lies along it.
#[test]
fn rams_and_pins_in_slots_turn_back_at_the_ends_of_their_ways() {
    let found = over(&example("quick_return"), "motor", 360);
    let drives = |name: &str| -> Vec<f64> {
        found.dead_centres.iter().filter(|at| at.name == name).map(|at| at.drive).collect()
    };
    // Crank 0.1 m at the origin, rocker's hinge 0.25 m below: along the slot at 0.25 m above and below.
    let slot: Vec<f64> =
        found.dead_centres.iter().filter(|at| at.name == "slot").map(|at| at.value).collect();
    assert_eq!(slot.len(), 2, "{:?}", found.dead_centres);
    for value in [0.15, 0.35] {
        assert!(slot.iter().any(|at| (at - value).abs() < 1e-9), "{slot:?}");
    }
    let (ram, rocker) = (drives("guide"), drives("rocker"));
    assert_eq!((ram.len(), rocker.len()), (2, 2), "{:?}", found.dead_centres);
    assert!(ram.iter().zip(&rocker).all(|(a, b)| (a - b).abs() < 0.3), "{ram:?} {rocker:?}");
}

#[test]
fn ways_of_motion_that_cross_are_passed_straight_and_named() {
    let found = over(&example("kite"), "crank", 359);
    assert_eq!(found.change_points.len(), 2, "{:?}", found.change_points);
    for (point, expected) in found.change_points.iter().zip([PI, TAU]) {
        assert!((point - expected).abs() < 1e-6, "{point}");
    }
    // With rows of the same crank and another count of positions it is the same way.
    let other = over(&example("kite"), "crank", 97);
    let last = |found: &Kinematics| found.positions.last().map(|at| at.phi.clone()).expect("positions");
    for (a, b) in last(&found).iter().zip(last(&other)) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
}

/// A crank as long as its rod, the rod's angle -theta: at pi/2 and 3 pi/2 the pin may turn about the crank's hinge.
/// The torque is that of virtual power, g r (m/2 + 3 M/2) there, the rod does not accelerate; gravity g along the
/// rail has a moment about the crank pin that no bounded force of the rail balances.
#[test]
fn forces_at_change_points_are_limits_along_the_motion() {
    let (r, w, g) = (0.5, 4.0, 1.3);
    let motor = r#""motors": [{"name": "M", "body": "a", "law": {"start": 1.3, "rate": 4}}],
        "outputs": {"rail": "S.force", "A.y": "A.fy", "A.x": "A.fx", "b.alpha": "b.alpha"},"#;
    let mut scene = slider_crank(r, r, motor);
    let range = |found: &Kinematics, name: &str| -> [[f64; 2]; 2] {
        let range = found.ranges.iter().find(|range| range.name == name).expect("a column");
        [range.min, range.max]
    };
    for (count, text) in [(360, "M=0..6.283185307179586"), (500, "M")] {
        scene.gravity = [g, -9.81];
        let found = over(&scene, text, count);
        assert_eq!(found.change_points.len(), 2, "{:?}", found.change_points);
        let torque = |at: f64| {
            let (sine, cosine) = at.sin_cos();
            let (weight, along) = (9.81 * r * 1.5 * cosine, g * r * 3.5 * sine);
            weight + along + w * w * 4.0 * r * r * sine * cosine
        };
        let most = (0..100_000).map(|k| torque(TAU * f64::from(k) / 1e5)).fold(f64::MIN, f64::max);
        assert!(
            (range(&found, "M.torque")[1][0] - most).abs() < 1e-8,
            "{:?} {most}",
            range(&found, "M.torque")
        );
        let [min, max] = range(&found, "A.y");
        assert_eq!([min[0], max[0]], [f64::NEG_INFINITY, f64::INFINITY]);
        assert!(found.change_points.contains(&min[1]) && found.change_points.contains(&max[1]));
        assert!(range(&found, "b.alpha").as_flattened().iter().step_by(2).all(|alpha| alpha.abs() < 1e-8));
        let page = driftless::report::kinematics::text(&found);
        assert!(page.contains("unbounded") && !page.contains("not known"), "{page}");
        let mut hidden = 0;
        for at in &found.positions {
            if at.force.is_nan() {
                assert!(at.outputs.iter().chain(&at.alpha).all(|value| value.is_nan()), "{at:?}");
                assert!(at.drive.cos().abs() < 1e-3, "{at:?}");
                hidden += 1;
            } else {
                assert!((at.force - torque(at.drive)).abs() < 1e-8, "{at:?} {}", torque(at.drive));
            }
        }
        assert_eq!(hidden, if count == 360 { 2 } else { 0 });
        // Without gravity along the rail the rod leans on it with M (9.81 - 2 r w^2 sin(theta)) / 2 and hangs on the
        // crank with M (9.81 + r w^2 sin(theta)) / 2.
        scene.gravity = [0.0, -9.81];
        let found = over(&scene, text, count);
        let mut pin = range(&found, "A.y").map(|[value, at]| [value.abs(), at]);
        pin.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let [back, front] = [3.0 * FRAC_PI_2, FRAC_PI_2];
        let expected = [[9.81 - 8.0, back], [9.81 + 8.0, front], [9.81 + w * w, back]];
        for (found, [value, at]) in [pin[0], pin[1], range(&found, "rail")[1]].iter().zip(expected) {
            assert!(
                (found[0] - value).abs() < 1e-8 && (found[1] - at).abs() < 1e-4,
                "{found:?} {value} {at}"
            );
        }
    }
}

#[test]
fn torques_at_change_points_of_parallelograms_are_those_of_virtual_work() {
    let bar = |name: &str, length: f64| {
        let centre = 0.5 * length;
        format!(
            r#"{{"name": "{name}", "mass": 1, "centre": [{centre}, 0], "inertia": 0.1, "length": {length}}}"#
        )
    };
    let hinge = |at: usize, [a, x]: [&str; 2], [b, y]: [&str; 2]| {
        let end = |body: &str, x: &str| format!(r#"{{"body": "{body}", "point": [{x}, 0]}}"#);
        format!(r#"{{"name": "H{at}", "between": [{}, {}]}}"#, end(a, x), end(b, y))
    };
    let ground = |at, x, crank| hinge(at, ["ground", x], [crank, "0"]);
    let cranks = ["a", "c", "e"].map(|name| bar(name, 1.0)).to_vec();
    let first = vec![
        ground(0, "0", "a"),
        ground(1, "1.7", "c"),
        ground(2, "2.9", "e"),
        hinge(3, ["a", "1"], ["b", "0"]),
    ];
    let two = [
        hinge(4, ["b", "1.7"], ["c", "1"]),
        hinge(5, ["c", "1"], ["d", "0"]),
        hinge(6, ["d", "1.2"], ["e", "1"]),
    ];
    let one = [hinge(4, ["b", "1.7"], ["c", "1"]), hinge(5, ["b", "2.9"], ["e", "1"])];
    let couplings =
        [(vec![bar("b", 1.7), bar("d", 1.2)], two.to_vec(), 3.5), (vec![bar("b", 2.9)], one.to_vec(), 2.5)];
    for (rods, joints, amplitude) in couplings {
        let text = format!(
            r#"{{"name": "p", "gravity": [0, -9.81], "until": 1, "every": 1, "bars": [{}], "hinges": [{}],
                "motors": [{{"name": "M", "body": "a", "law": {{"start": 0.37, "rate": 4}}}}],
                "outputs": {{"along": "H3.fx", "b.alpha": "b.alpha"}},
                "start": {{"a": {{"phi": 0.37}}, "b": {{"phi": 0}}, "c": {{"phi": 0.37}}, "e": {{"phi": 0.37}}}}}}"#,
            [cranks.clone(), rods].concat().join(", "),
            [first.clone(), joints].concat().join(", ")
        );
        let scene = parse_scene(&text, "p", &[]).unwrap_or_else(|error| panic!("{error}"));
        let found = over(&scene, "M", 120);
        assert_eq!(found.change_points.len(), 2, "{amplitude}: {:?}", found.change_points);
        for (point, expected) in found.change_points.iter().zip([PI, TAU]) {
            assert!((point - expected).abs() < 1e-6, "{amplitude}: {point}");
        }
        let [torque, along, alpha] = [&found.ranges[0], &found.ranges[1], &found.ranges[2]];
        let most = 9.81 * amplitude;
        assert!(
            (torque.min[0] + most).abs() < 1e-8 && (torque.max[0] - most).abs() < 1e-8,
            "{torque:?} {most}"
        );
        assert_eq!(
            [along.min[0], along.max[0]],
            [f64::NEG_INFINITY, f64::INFINITY],
            "{amplitude}: {along:?}"
        );
        assert!(alpha.min[0].abs() < 1e-8 && alpha.max[0].abs() < 1e-8, "{alpha:?}");
    }
}

#[test]
fn andrews_mechanism_goes_round_on_its_branch() {
    let scene = example("andrews");
    let found = over(&scene, "OF", 4096);
    assert!(found.is_closed && found.limits.is_empty() && found.change_points.is_empty());
    assert_eq!(found.positions.len(), 4097);
    // Every position keeps every loop: tips of the bars that meet coincide.
    let mechanism = Mechanism::new(&scene).expect("equations");
    assert_eq!(mechanism.coordinates(), found.positions[0].phi.len());
    let place =
        |at: &Position, place: &driftless::scene::Place, fixed: &dyn Fn(usize) -> [f64; 2]| match place.bar {
            None => place.point,
            Some(bar) => {
                let ([x, y], [u, v], (s, c)) = (fixed(bar), place.point, at.phi[bar].sin_cos());
                [x + c * u - s * v, y + s * u + c * v]
            }
        };
    for at in found.positions.iter().step_by(37) {
        // Origins outwards from the ground, by the first hinge that reaches a bar.
        let mut origins = vec![None::<[f64; 2]>; scene.bars.len()];
        for _ in 0..scene.bars.len() {
            for hinge in &scene.hinges {
                for [from, to] in [hinge.between, [hinge.between[1], hinge.between[0]]] {
                    let Some(bar) = to.bar.filter(|&bar| origins[bar].is_none()) else { continue };
                    if from.bar.is_none_or(|bar| origins[bar].is_some()) {
                        let known = |bar: usize| origins[bar].unwrap_or_default();
                        let [x, y] = place(at, &from, &known);
                        let zero = |_: usize| [0.0; 2];
                        let [u, v] = place(at, &to, &zero);
                        origins[bar] = Some([x - u, y - v]);
                    }
                }
            }
        }
        let known = |bar: usize| origins[bar].unwrap_or_default();
        for hinge in &scene.hinges {
            let [a, b] = hinge.between.map(|end| place(at, &end, &known));
            assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-15, "{}: {a:?} {b:?}", hinge.name);
        }
    }
}

#[test]
fn what_cannot_be_driven_is_refused_by_name() {
    let of = |name: &str, text: &str| kinematics(&example(name), &drive(text), 10).expect_err("refused");
    assert!(matches!(of("free", "bar1"), KinematicsError::Free { left: 1, .. }));
    assert!(matches!(of("crank_rocker", "crnk"), KinematicsError::Unknown { .. }));
    let none = kinematics(&example("free"), &KinematicDrive::default(), 10).expect_err("refused");
    assert!(matches!(none, KinematicsError::NoDrive(_)));
    let slider = example("slider_crank_driven").sliders[0].name.clone();
    assert!(matches!(of("slider_crank_driven", &slider), KinematicsError::NoRange(_)));
    for text in ["", "=1..2", "crank=1", "crank=2..1", "crank=a..b", "crank=0..inf"] {
        assert!(text.parse::<KinematicDrive>().is_err(), "{text}");
    }
    assert_eq!(drive("crank.phi=-pi..pi/2"), drive("crank=-pi..0.5pi"));
    // An output that is not asked for is none.
    let mut scene = example("crank_rocker");
    scene.outputs = vec![Output { name: "x".to_owned(), formula: "pen.x".to_owned() }];
    assert_eq!(over(&scene, "motor", 4).positions[0].outputs.len(), 1);
}

#[test]
fn the_rate_of_a_turn_follows_the_motor_and_other_motors_follow_time() {
    let scene = parse_scene(
        r#"{"name": "two", "gravity": [0, 0], "bars": [{"name": "a", "mass": 1, "centre": [0.5, 0], "inertia": 0.1}, {"name": "b", "mass": 1, "centre": [0.5, 0], "inertia": 0.1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
                   {"name": "B", "between": [{"body": "a", "point": [1, 0]}, {"body": "b", "point": [0, 0]}]}],
        "motors": [{"name": "M", "body": "a", "law": {"start": 0.3, "rate": 2}}, {"name": "N", "body": "b", "law": "0.5*sin(3*t)"}],
        "until": 1, "every": 0.1}"#,
        "two.json",
        &[],
    )
    .expect("a scene");
    let found = over(&scene, "M", 50);
    assert_eq!(found.rate, 2.0);
    for at in &found.positions {
        let t = (at.drive - 0.3) / 2.0;
        assert!((at.t - t).abs() < 1e-14 && (at.phi[1] - 0.5 * (3.0 * t).sin()).abs() < 1e-14, "{at:?}");
        assert!((at.omega[1] - 1.5 * (3.0 * t).cos()).abs() < 1e-13, "{at:?}");
    }
}

/// Laws of force are on their branches at every position: a motor holds a torque of three pieces, one of them off
/// where the mechanism starts, and a cam's second piece moves what it moves.
#[test]
fn loads_are_those_of_the_branches_at_each_position() {
    let scene = parse_scene(
        r#"{"name": "branches", "gravity": [0, 0],
            "bars": [{"name": "a", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1},
                     {"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.2, "length": 1}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
                       {"name": "B", "between": [{"body": "ground", "point": [2, 0]}, {"body": "b", "point": [0, 0]}]}],
            "torques": [{"name": "T", "body": "a", "torque": "1*if(a.phi > 1.5, 7, if(a.phi > 0.7, -a.phi, 3*a.phi))"}],
            "motors": [{"name": "m", "body": "a", "law": {"start": 0, "rate": 1}},
                       {"name": "cam", "body": "b", "law": "if(a.phi > 2, 4*(a.phi-2)^3, 0)"}],
            "until": 3, "every": 0.25}"#,
        "scene.json",
        &[],
    )
    .unwrap_or_else(|error| panic!("{error}"));
    let found = over(&scene, "m=0..3", 25);
    let mut beyond = 0;
    for Position { drive, phi, alpha, force, .. } in &found.positions {
        let a = *drive;
        let torque = if a > 1.5 {
            7.0
        } else if a > 0.7 {
            -a
        } else {
            3.0 * a
        };
        let past = (a - 2.0).max(0.0);
        let [angle, rate, bend] = [4.0 * past.powi(3), 12.0 * past * past, 24.0 * past];
        assert!((phi[1] - angle).abs() < 1e-9 && (alpha[1] - bend).abs() < 1e-8, "{a}: {phi:?} {alpha:?}");
        // The cam's torque on b comes from a: power is kept.
        let expected = 0.2 * bend * rate - torque;
        assert!((force - expected).abs() < 1e-7, "{a}: {force} and not {expected}");
        beyond += usize::from(a > 2.0);
    }
    assert!(beyond > 5 && found.limits.is_empty());
}

/// A crank that turns the first bar of the crank-rocker by a law, with a wheel geared to it by a ratio.
fn driven_by_law(law: &str, ratio: f64) -> Scene {
    let text = format!(
        r#"{{"name": "driven_by_law", "gravity": [0, 0],
            "bars": [{{"name": "a", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 1}},
                     {{"name": "wheel", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 1}},
                     {{"name": "crank", "length": {A}, "mass": 1, "centre": [0, 0], "inertia": 0.1}},
                     {{"name": "coupler", "length": {B}, "mass": 1, "centre": [0, 0], "inertia": 0.1}},
                     {{"name": "rocker", "length": {C}, "mass": 1, "centre": [0, 0], "inertia": 0.1}}],
            "hinges": [{{"name": "O", "between": [{{"body": "ground", "point": [2, 0]}}, {{"body": "a", "point": [0, 0]}}]}},
                       {{"name": "W", "between": [{{"body": "ground", "point": [3, 0]}}, {{"body": "wheel", "point": [0, 0]}}]}},
                       {{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "crank", "point": [0, 0]}}]}},
                       {{"name": "B", "between": [{{"body": "crank", "point": [{A}, 0]}}, {{"body": "coupler", "point": [0, 0]}}]}},
                       {{"name": "C", "between": [{{"body": "coupler", "point": [{B}, 0]}}, {{"body": "rocker", "point": [{C}, 0]}}]}},
                       {{"name": "D", "between": [{{"body": "ground", "point": [{D}, 0]}}, {{"body": "rocker", "point": [0, 0]}}]}}],
            "motors": [{{"name": "cam", "body": "crank", "law": "{law}"}},
                       {{"name": "gear", "body": "wheel", "law": "{ratio}*a.phi"}}],
            "start": {{"a": {{"phi": 0}}, "coupler": {{"phi": 0.6}}, "rocker": {{"phi": 1.9}}}},
            "until": 1, "every": 1}}"#
    );
    parse_scene(&text, "scene.json", &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// At a corner of a law rates jump and motion goes on, wherever positions lie.
#[test]
fn corners_of_laws_are_no_limits() {
    for (k, depth, count) in [(3, 0.45, 12), (5, 0.45, 100), (7, 0.45, 100), (9, 0.2, 12), (2, 0.3, 7)] {
        let scene = driven_by_law(&format!("0.9 - {depth}*abs(sin({k}*a.phi))"), 1.0);
        let found = over(&scene, "a", count);
        assert!(found.limits.is_empty(), "{k}: {:?}", found.limits);
        assert_eq!(found.positions.len(), count + 1);
        for Position { drive, phi, .. } in &found.positions {
            let crank = 0.9 - depth * (f64::from(k) * drive).sin().abs();
            let [coupler, rocker] = closed(crank);
            let off = [phi[2] - crank, phi[3] - coupler, phi[4] - rocker].map(f64::abs);
            assert!(off.iter().all(|off| *off < 1e-9), "{k}: {drive} {off:?}");
        }
    }
}

/// A wheel geared to the drive goes round thousands of times while the mechanism goes through its range.
#[test]
fn wheels_of_large_ratios_go_with_the_rest() {
    let found = over(&driven_by_law("a.phi", 1e4), "a", 24);
    assert!(found.limits.is_empty() && found.positions.len() == 25);
    for Position { drive, phi, omega, .. } in &found.positions {
        let [coupler, rocker] = closed(*drive);
        assert!(
            (phi[1] - 1e4 * drive).abs() < 1e-7 && (omega[1] - 1e4 * omega[0]).abs() < 1e-7 * omega[1].abs()
        );
        assert!((phi[3] - coupler).abs() < 1e-9 && (phi[4] - rocker).abs() < 1e-9, "{drive}: {phi:?}");
    }
}

/// Other ways to assemble a mechanism have geared wheels where the gear has them: a scene that starts there is
/// taken as it is.
#[test]
fn other_assemblies_have_geared_wheels_where_their_gears_have_them() {
    let text = |start: &str| {
        format!(
            r#"{{"name": "geared", "gravity": [0, 0],
            "bars": [{{"name": "wheel", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 1}},
                     {{"name": "crank", "length": {A}, "mass": 1, "centre": [0, 0], "inertia": 0.1}},
                     {{"name": "coupler", "length": {B}, "mass": 1, "centre": [0, 0], "inertia": 0.1}},
                     {{"name": "rocker", "length": {C}, "mass": 1, "centre": [0, 0], "inertia": 0.1}}],
            "hinges": [{{"name": "W", "between": [{{"body": "ground", "point": [3, 0]}}, {{"body": "wheel", "point": [0, 0]}}]}},
                       {{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "crank", "point": [0, 0]}}]}},
                       {{"name": "B", "between": [{{"body": "crank", "point": [{A}, 0]}}, {{"body": "coupler", "point": [0, 0]}}]}},
                       {{"name": "C", "between": [{{"body": "coupler", "point": [{B}, 0]}}, {{"body": "rocker", "point": [{C}, 0]}}]}},
                       {{"name": "D", "between": [{{"body": "ground", "point": [{D}, 0]}}, {{"body": "rocker", "point": [0, 0]}}]}}],
            "motors": [{{"name": "M", "body": "crank", "law": {{"start": 0.4, "rate": 1}}}},
                       {{"name": "gear", "body": "wheel", "law": "-1.5*rocker.phi"}}],
            "start": {{{start}}}, "until": 1, "every": 1}}"#
        )
    };
    let scene = |start: &str| parse_scene(&text(start), "scene.json", &[]);
    let [coupler, rocker] = closed(0.4);
    let first = scene(&format!(r#""coupler": {{"phi": {coupler:?}}}, "rocker": {{"phi": {rocker:?}}}"#))
        .unwrap_or_else(|error| panic!("{error}"));
    let others = over(&first, "M", 4).branches;
    assert!(!others.is_empty());
    for phi in &others {
        assert!((phi[0] + 1.5 * phi[3]).abs() < 1e-12, "{phi:?}");
        let start = format!(
            r#""wheel": {{"phi": {:?}}}, "coupler": {{"phi": {:?}}}, "rocker": {{"phi": {:?}}}"#,
            phi[0], phi[2], phi[3]
        );
        let there = scene(&start).unwrap_or_else(|error| panic!("{error}"));
        let mechanism = Mechanism::new(&there).unwrap_or_else(|error| panic!("{start}: {error}"));
        assert!(mechanism.assembly.changes.is_empty(), "{:?}", mechanism.assembly.changes);
    }
}

/// Towards the limit of a crank, d before it, accelerations grow as d^(-3/2), also where projection leaves a row
/// out: outputs are those of the position, and have no bound.
#[test]
fn accelerations_have_no_bound_at_a_limit() {
    let [a, b, c, d]: [f64; 4] = [0.3, 0.35, 0.25, 0.5];
    let scene = parse_scene(
        &format!(
            r#"{{"name": "limited", "gravity": [0, -9.81],
            "bars": [{{"name": "a", "length": {a}, "mass": 1, "centre": [0.15, 0], "inertia": 0.01}},
                     {{"name": "b", "length": {b}, "mass": 2, "centre": [0.12, 0], "inertia": 0.03}},
                     {{"name": "c", "length": {c}, "mass": 1.5, "centre": [0.125, 0], "inertia": 0.02}}],
            "hinges": [{{"name": "O", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}},
                       {{"name": "A", "between": [{{"body": "a", "point": [{a}, 0]}}, {{"body": "b", "point": [0, 0]}}]}},
                       {{"name": "B", "between": [{{"body": "b", "point": [{b}, 0]}}, {{"body": "c", "point": [{c}, 0]}}]}},
                       {{"name": "C", "between": [{{"body": "ground", "point": [{d}, 0]}}, {{"body": "c", "point": [0, 0]}}]}}],
            "motors": [{{"name": "M", "body": "a", "law": {{"start": 0.5, "rate": 3}}}}],
            "outputs": {{"ac": "c.alpha", "ab": "b.alpha"}},
            "start": {{"b": {{"phi": 0.25}}, "c": {{"phi": 1.15}}}}, "until": 1, "every": 1}}"#
        ),
        "limited.json",
        &[],
    )
    .unwrap_or_else(|error| panic!("{error}"));
    let limit = ((a * a + d * d - (b + c) * (b + c)) / (2.0 * a * d)).acos();
    let found = over(&scene, "M=-3..3", 36);
    let range = |name: &str| found.ranges.iter().find(|range| range.name == name).expect("a column");
    assert!(
        range("ac").max[0] == f64::INFINITY && range("ab").min[0] == f64::NEG_INFINITY,
        "{:?}",
        found.ranges
    );
    let beside = |left: f64| {
        let to = KinematicDrive { range: Some([0.5, limit - left]), ..drive("M") };
        let found = kinematics(&scene, &to, 12).expect("kinematics");
        let last = found.positions.last().expect("a position").clone();
        assert_eq!(last.outputs, [last.alpha[2], last.alpha[1]]);
        assert!(
            found.ranges.iter().find(|range| range.name == "ac").expect("a column").max[0] >= last.outputs[0]
        );
        last.outputs[0]
    };
    let ratio = beside(1e-10) / beside(4e-10);
    assert!((ratio - 8.0).abs() < 1e-3, "{ratio}");
}

/// Both ends of the rod of an elliptic trammel turn back at the ends of their ways, the one whose place is a
/// coordinate and the other.
#[test]
fn both_sliders_of_a_trammel_turn_back() {
    let scene = parse_scene(
        r#"{"name": "trammel", "gravity": [0, -9.81],
            "bars": [{"name": "rod", "mass": 1.5, "centre": [0.4, 0], "inertia": 0.08, "length": 0.8}],
            "sliders": [{"name": "sx", "point": {"body": "rod", "point": [0, 0]},
                    "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}},
                {"name": "sy", "point": {"body": "rod", "point": [0.8, 0]},
                    "rail": {"body": "ground", "point": [0, 0], "direction": [0, 1]}}],
            "motors": [{"name": "M", "body": "rod", "law": {"start": 0.2, "rate": 6}}],
            "start": {"rod": {"phi": 0.2}}, "until": 1, "every": 0.1}"#,
        "trammel.json",
        &[],
    )
    .expect("a scene");
    let found = over(&scene, "M", 90).dead_centres;
    let expected = [(FRAC_PI_2, 0.8), (PI, 0.8), (3.0 * FRAC_PI_2, -0.8), (TAU, -0.8)];
    assert_eq!(found.len(), 4, "{found:?}");
    for (at, (angle, value)) in found.iter().zip(expected) {
        assert!((at.drive - angle).abs() < 1e-9 && (at.value - value).abs() < 1e-12, "{at:?}");
        assert_eq!(at.name == "sy", at.drive.cos().abs() < 0.5, "{at:?}");
    }
}

/// What a motor drives goes at the motor's rate, whichever of the two is named; refusals name what was asked for
/// and the motor that drives it.
#[test]
fn what_a_motor_drives_goes_at_its_rate() {
    let rate = |scene: &Scene, text: &str| over(scene, text, 4).rate;
    assert_eq!(rate(&example("crank_rocker"), "crank"), rate(&example("crank_rocker"), "motor"));
    assert_eq!(rate(&example("crank_rocker"), "rocker=1.7..2"), 1.0);
    let scene = parse_scene(
        r#"{"name": "lift", "gravity": [0, -9.81],
            "bars": [{"name": "boom", "mass": 100, "centre": [1, 0], "inertia": 30, "length": 2},
                {"name": "cylinder", "mass": 10, "centre": [0.3, 0], "inertia": 0.5, "length": 0.6},
                {"name": "rod", "mass": 8, "centre": [-0.4, 0], "inertia": 0.4, "length": 0.8}],
            "hinges": [{"name": "O", "between": [{"body": "ground", "point": [0, 0]}, {"body": "boom", "point": [0, 0]}]},
                {"name": "C", "between": [{"body": "ground", "point": [0.5, -0.3]}, {"body": "cylinder", "point": [0, 0]}]},
                {"name": "R", "between": [{"body": "boom", "point": [1, -0.1]}, {"body": "rod", "point": [0, 0]}]}],
            "sliders": [{"name": "s", "point": {"body": "rod", "point": [0, 0]}, "angle": "locked",
                "rail": {"body": "cylinder", "point": [0, 0], "direction": [1, 0]}}],
            "motors": [{"name": "H", "slider": "s", "law": {"start": 0.7, "rate": 0.1}}],
            "outputs": {"F": "H.force"},
            "start": {"boom": {"phi": 0.3}, "cylinder": {"phi": 0.8}, "rod": {"phi": 0.8}}, "until": 1, "every": 1}"#,
        "lift.json",
        &[],
    )
    .expect("a scene");
    assert_eq!([rate(&scene, "s=0.6..1.2"), rate(&scene, "H=0.6..1.2")], [0.1; 2]);
    let refused = kinematics(&scene, &drive("boom=0..1"), 4).expect_err("no force of a turning motor");
    assert!(refused.to_string().starts_with("with motor `H` driving `boom`: "), "{refused}");
}

/// The rocker of a crank-rocker as the drive turns evenly about a hinge of the ground: its acceleration is zero,
/// that of its points a cosine, up to limits at which crank and coupler are infinitely fast.
#[test]
fn what_stays_finite_at_a_limit_is_no_rounding() {
    let mut scene = example("crank_rocker");
    let output = |name: &str| Output { name: name.replace('.', "_"), formula: name.to_owned() };
    scene.outputs = vec![output("rocker.alpha"), output("rocker.ax"), output("crank.alpha")];
    let body = scene.bars.iter().find(|bar| bar.name == "rocker").expect("the rocker");
    let [x, y] = body.centre;
    for count in [24, 131] {
        let swung = kinematics(&scene, &KinematicDrive { rate: Some(1.0), ..drive("rocker=0..3") }, count)
            .expect("kinematics");
        let range = |name: &str| swung.ranges.iter().find(|range| range.name == name).expect("a column");
        let alpha = range("rocker_alpha");
        assert!(alpha.min[0].abs() < 1e-7 && alpha.max[0].abs() < 1e-7, "{count}: {alpha:?}");
        let ax = range("rocker_ax");
        let [low, high] = [0, 1].map(|k| swung.limits[k].drive);
        let at = |phi: f64| -(x * phi.cos() - y * phi.sin());
        let ends = [at(low), at(high)];
        let [least, most] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        assert!(
            (ax.min[0] - least).abs() < 1e-6 && (ax.max[0] - most).abs() < 1e-6,
            "{count}: {ax:?} {ends:?}"
        );
        assert!(range("crank_alpha").max[0].is_infinite(), "{count}: {:?}", range("crank_alpha"));
    }
}
