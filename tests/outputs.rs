//! Outputs by name, and their extremes over a run: against the Newton–Euler balance of every body, against
//! inverse dynamics of another formulation, and against closed forms.

use crate::formulas::{adaptive, run, scene};
use driftless::dynamics::Mechanism;
use driftless::run::{
    Extremes, Limits, MethodId, Plan, Request, Run, Running, Sample, Stabilization, integrate, simulate,
};
use driftless::scene::{Output, Place, Scene, parse_scene, read_scene};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};
use std::sync::Arc;

fn with(mut scene: Scene, outputs: &[&str]) -> Scene {
    scene.outputs.extend(outputs.iter().map(|text| Output::parse(text)));
    scene
}

fn found<'a>(extremes: &'a [Extremes], name: &str) -> &'a Extremes {
    extremes.iter().find(|one| one.name == name).unwrap_or_else(|| panic!("no output {name}"))
}

fn example(name: &str) -> Scene {
    read_scene(format!("examples/scenes/{name}.json").as_ref(), &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// What acts on the bodies of a scene at a moment.
struct Balance<'a> {
    scene: &'a Scene,
    sample: &'a Sample,
    force: Vec<[f64; 2]>,
    torque: Vec<f64>,
    /// Sum of all magnitudes.
    size: f64,
}

impl Balance<'_> {
    fn value(&self, name: &str) -> f64 {
        let number = self.scene.outputs.iter().position(|output| output.name == name);
        self.sample.outputs[number.unwrap_or_else(|| panic!("no output {name}"))]
    }

    fn position(&self, place: &Place) -> [f64; 2] {
        let Some(bar) = place.bar else { return place.point };
        let (s, c) = self.sample.phi[bar].sin_cos();
        let centre = self.scene.bars[bar].centre;
        let [x, y] = [place.point[0] - centre[0], place.point[1] - centre[1]];
        let [x0, y0] = self.sample.centre[bar];
        [x0 + c * x - s * y, y0 + s * x + c * y]
    }

    fn push(&mut self, bar: Option<usize>, at: [f64; 2], [x, y]: [f64; 2]) {
        let Some(bar) = bar else { return };
        let [x0, y0] = self.sample.centre[bar];
        self.force[bar][0] += x;
        self.force[bar][1] += y;
        self.torque[bar] += (at[0] - x0) * y - (at[1] - y0) * x;
        self.size += x.abs() + y.abs();
    }

    fn turn(&mut self, bar: Option<usize>, torque: f64) {
        let Some(bar) = bar else { return };
        self.torque[bar] += torque;
        self.size += torque.abs();
    }

    /// A force on the second of two places, and its opposite on the first.
    fn between(&mut self, [first, second]: [Option<usize>; 2], at: [f64; 2], [x, y]: [f64; 2]) {
        self.push(second, at, [x, y]);
        self.push(first, at, [-x, -y]);
    }

    fn joints(&mut self) {
        let scene = self.scene;
        for hinge in &scene.hinges[..scene.own_hinges()] {
            let at = self.position(&hinge.between[0]);
            let force = ["fx", "fy"].map(|axis| self.value(&format!("{}.{axis}", hinge.name)));
            let size = self.value(&format!("{}.force", hinge.name));
            assert!((size - force[0].hypot(force[1])).abs() <= 1e-15 * size);
            self.between([hinge.between[0].bar, hinge.between[1].bar], at, force);
        }
        for slider in &scene.sliders {
            let at = self.position(&slider.point);
            let (on, from) = (slider.point.bar, slider.rail.place.bar);
            let force = ["fx", "fy"].map(|axis| self.value(&format!("{}.{axis}", slider.name)));
            self.between([from, on], at, force);
            if slider.locked {
                let torque = self.value(&format!("{}.torque", slider.name));
                let [on, from] = if on.is_none() { [from, on] } else { [on, from] };
                self.turn(on, torque);
                self.turn(from, -torque);
            }
            for drive in scene.drives.iter().filter(|drive| scene.sliders[drive.slider].name == slider.name) {
                let force = self.value(&format!("{}.force", drive.name));
                let [x, y] = slider.rail.direction;
                let (s, c) = from.map_or((0.0, 1.0), |bar| self.sample.phi[bar].sin_cos());
                self.between([from, on], at, [force * (c * x - s * y), force * (s * x + c * y)]);
            }
        }
        for weld in &scene.welds {
            let at = self.position(&weld.between[0]);
            let force = ["fx", "fy"].map(|axis| self.value(&format!("{}.{axis}", weld.name)));
            let [first, second] = [weld.between[0].bar, weld.between[1].bar];
            self.between([first, second], at, force);
            let torque = self.value(&format!("{}.torque", weld.name));
            let [on, from] = if second.is_none() { [first, second] } else { [second, first] };
            self.turn(on, torque);
            self.turn(from, -torque);
        }
        let motors = scene.motors.iter().map(|motor| (&motor.name, motor.bar, motor.relative_to));
        for (name, bar, base) in
            motors.chain(scene.locks.iter().map(|lock| (&lock.name, lock.bar, lock.relative_to)))
        {
            let torque = self.value(&format!("{name}.torque"));
            self.turn(Some(bar), torque);
            self.turn(base, -torque);
        }
    }

    fn loads(&mut self) {
        let (scene, t) = (self.scene, self.sample.t);
        for spring in &scene.springs {
            let [a, b] = spring.between.each_ref().map(|place| self.position(place));
            let [x, y] = [b[0] - a[0], b[1] - a[1]];
            let length = x.hypot(y);
            let [tension, told, rate] = ["force", "length", "rate"]
                .map(|quantity| self.value(&format!("{}.{quantity}", spring.name)));
            assert!((told - length).abs() < 1e-14 * (1.0 + length));
            if !spring.rigid {
                let law = spring.stiffness * (length - spring.free_length) + spring.damping * rate;
                assert!((tension - law).abs() < 1e-12 * (1.0 + spring.stiffness * length), "{tension} {law}");
            }
            let pull = [tension * x / length, tension * y / length];
            self.push(spring.between[0].bar, a, pull);
            self.push(spring.between[1].bar, b, [-pull[0], -pull[1]]);
        }
        for spring in &scene.torsion_springs {
            let [torque, angle, rate] = ["torque", "angle", "rate"]
                .map(|quantity| self.value(&format!("{}.{quantity}", spring.name)));
            let law = -spring.stiffness * (angle - spring.free_angle) - spring.damping * rate;
            assert!((torque - law).abs() < 1e-12 * (1.0 + law.abs()), "{torque} {law}");
            self.turn(Some(spring.bar), torque);
            self.turn(spring.relative_to, -torque);
        }
        let factor =
            |law: &Option<driftless::scene::Law>| law.as_ref().map_or(1.0, |law| law.value::<f64>(t.into()));
        for force in &scene.forces {
            let at = self.position(&Place { bar: Some(force.bar), point: force.point });
            let (s, c) = if force.follows { self.sample.phi[force.bar].sin_cos() } else { (0.0, 1.0) };
            let ([x, y], factor) = (force.force, factor(&force.law));
            self.push(Some(force.bar), at, [factor * (c * x - s * y), factor * (s * x + c * y)]);
        }
        for torque in &scene.torques {
            let value = torque.torque * factor(&torque.law);
            self.turn(Some(torque.bar), value);
            self.turn(torque.relative_to, -value);
        }
        for wall in &scene.walls {
            let force = self.value(&format!("{}.force", wall.name));
            let at = self.position(&Place { bar: Some(wall.bar), point: wall.point });
            let [x, y] = wall.normal;
            let moved = wall.law.as_ref().map_or(0.0, |law| law.value::<f64>(t.into()));
            let gap = x * (at[0] - wall.through[0]) + y * (at[1] - wall.through[1]) - moved;
            assert!((self.value(&format!("{}.gap", wall.name)) - gap).abs() < 1e-13 * (1.0 + gap.abs()));
            self.push(Some(wall.bar), at, [force * x, force * y]);
        }
    }

    /// The largest rest of m a = F and I alpha = M, over the size of the forces.
    fn rest(mut self) -> f64 {
        self.joints();
        self.loads();
        let scene = self.scene;
        let mut most = 0.0_f64;
        for (k, bar) in scene.bars[..scene.own_bars()].iter().enumerate() {
            let [ax, ay, alpha] =
                ["ax", "ay", "alpha"].map(|quantity| self.value(&format!("{}.{quantity}", bar.name)));
            let needed = [bar.mass * (ax - scene.gravity[0]), bar.mass * (ay - scene.gravity[1])];
            self.size += needed[0].abs() + needed[1].abs() + (bar.inertia * alpha).abs();
            let rests = [
                needed[0] - self.force[k][0],
                needed[1] - self.force[k][1],
                bar.inertia * alpha - self.torque[k],
            ];
            most = rests.iter().fold(most, |most, rest| most.max(rest.abs()));
        }
        most / self.size.max(f64::MIN_POSITIVE)
    }
}

/// Every quantity that the balance asks for.
fn all_outputs(scene: &Scene) -> Vec<String> {
    let mut all = Vec::new();
    let mut add = |name: &String, quantities: &[&str]| {
        all.extend(quantities.iter().map(|quantity| format!("{name}.{quantity}")));
    };
    scene.bars[..scene.own_bars()].iter().for_each(|bar| add(&bar.name, &["ax", "ay", "alpha"]));
    scene.hinges[..scene.own_hinges()].iter().for_each(|hinge| add(&hinge.name, &["fx", "fy", "force"]));
    for slider in &scene.sliders {
        add(&slider.name, if slider.locked { &["fx", "fy", "torque"] } else { &["fx", "fy"] });
    }
    scene.welds.iter().for_each(|weld| add(&weld.name, &["fx", "fy", "torque"]));
    scene.motors.iter().for_each(|motor| add(&motor.name, &["torque"]));
    scene.locks.iter().for_each(|lock| add(&lock.name, &["torque"]));
    scene.drives.iter().for_each(|drive| add(&drive.name, &["force"]));
    scene.springs.iter().for_each(|spring| add(&spring.name, &["force", "length", "rate"]));
    scene.torsion_springs.iter().for_each(|spring| add(&spring.name, &["torque", "angle", "rate"]));
    scene.walls.iter().for_each(|wall| add(&wall.name, &["force", "gap"]));
    all
}

fn assert_balanced(scene: Scene) -> usize {
    let outputs = all_outputs(&scene);
    let names: Vec<&str> = outputs.iter().map(String::as_str).collect();
    let until = scene.until.min(1.0);
    let scene = with(scene, &names);
    let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
    let request = Request { until: Some(until), every: Some(until / 4.0), ..Request::default() };
    let plan = Plan::new(&scene, &mechanism, &request).expect("a plan");
    let start = mechanism.start(&scene);
    let run = Run::new(mechanism, plan, Limits::default(), &start).expect("a run");
    let mut looked = 0;
    integrate(run, &mut |sample| {
        let (force, torque) = (vec![[0.0; 2]; scene.bars.len()], vec![0.0; scene.bars.len()]);
        let rest = Balance { scene: &scene, sample, force, torque, size: 0.0 }.rest();
        assert!(rest < 1e-12, "{} at {} s: {rest:e}", scene.name, sample.t);
        looked += 1;
        Ok(())
    })
    .expect("samples");
    looked
}

#[test]
fn forces_balance_the_accelerations_of_every_body_of_every_example() {
    let mut covered = Vec::new();
    for entry in std::fs::read_dir("examples/scenes").expect("a folder") {
        let path = entry.expect("an entry").path();
        let Ok(scene) = read_scene(&path, &[]) else { continue };
        // Loads by formulas and friction are no outputs.
        let is_said = scene.laws.is_empty() && scene.frictions.is_empty();
        let is_rigid = scene.springs.iter().any(|spring| spring.rigid);
        if is_said && !is_rigid && scene.events.is_empty() {
            assert!(assert_balanced(scene.clone()) >= 2, "{}", scene.name);
            covered.push(scene.name);
        }
    }
    println!("balanced: {}", covered.join(", "));
    assert!(covered.len() >= 20, "{covered:?}");
}

/// Loops of redundant constraints, welds, locks, slots on moving bars, a driven cart, a rigid spring.
#[test]
fn forces_balance_in_parts_that_the_examples_have_not() {
    let bar = |name: &str| {
        format!(r#"{{"name": "{name}", "mass": 1.5, "centre": [0.4, 0.1], "inertia": 0.2, "length": 1}}"#)
    };
    let place = |body: &str, x: f64, y: f64| format!(r#"{{"body": "{body}", "point": [{x}, {y}]}}"#);
    let hinge = |name: &str, a: String, b: String| format!(r#"{{"name": "{name}", "between": [{a}, {b}]}}"#);
    let ground = |x: f64, y: f64| place("ground", x, y);
    let scenes = [
        // A parallelogram with a third crank: one constraint too many.
        format!(
            r#""bars": [{}, {}, {}, {}], "hinges": [{}, {}, {}, {}, {}, {}],
            "start": {{"a": {{"phi": 1, "omega": 1}}, "b": {{"phi": 1, "omega": 1}}, "c": {{"phi": 1, "omega": 1}}, "r": {{"phi": 0, "omega": 0}}}}"#,
            bar("a"),
            bar("b"),
            bar("c"),
            bar("r"),
            hinge("A", ground(0.0, 0.0), place("a", 0.0, 0.0)),
            hinge("B", ground(1.0, 0.0), place("b", 0.0, 0.0)),
            hinge("C", ground(0.5, 0.0), place("c", 0.0, 0.0)),
            hinge("P", place("a", 1.0, 0.0), place("r", 0.0, 0.0)),
            hinge("Q", place("b", 1.0, 0.0), place("r", 1.0, 0.0)),
            hinge("R", place("c", 1.0, 0.0), place("r", 0.5, 0.0)),
        ),
        // A weld, a lock, a torsion spring, a torque between two bars, a force that follows.
        format!(
            r#""bars": [{}, {}, {}], "hinges": [{}, {}], "welds": [{}], "locks": [{{"name": "L", "body": "c", "relative_to": "a"}}],
            "torsion_springs": [{{"name": "T", "body": "a", "stiffness": 3, "free_angle": 0.2, "damping": 0.1}}],
            "torques": [{{"name": "M", "body": "c", "relative_to": "b", "torque": 0.7}}],
            "forces": [{{"name": "F", "body": "b", "point": [0.3, 0.2], "force": [1, -2], "frame": "body"}}],
            "start": {{"a": {{"phi": 1, "omega": 1}}, "b": {{"phi": 0.3}}, "c": {{"phi": -0.5}}}}"#,
            bar("a"),
            bar("b"),
            bar("c"),
            hinge("A", ground(0.0, 0.0), place("a", 0.0, 0.0)),
            hinge("C", place("b", 1.0, 0.0), place("c", 0.0, 0.0)),
            hinge("W", place("a", 1.0, 0.0), place("b", 0.0, 0.0)),
        ),
        // A slot on a turning bar, a driven cart, and a rod.
        format!(
            r#""bars": [{}, {}, {}], "hinges": [{}, {}],
            "sliders": [{{"name": "S", "point": {}, "rail": {{"body": "a", "point": [0.2, 0.1], "direction": [1, 0]}}}},
                        {{"name": "R", "point": {}, "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}, "angle": "locked"}}],
            "motors": [{{"name": "D", "slider": "R", "law": {{"start": 1.5, "rate": 0.2, "sines": [{{"amplitude": 0.1, "frequency": 3}}]}}}}],
            "springs": [{{"name": "K", "between": [{}, {}], "stiffness": 8, "free_length": 0.5, "damping": 0.3}}],
            "start": {{"a": {{"phi": 0.8, "omega": 0.5}}, "b": {{"phi": 1.6}}, "c": {{"phi": 0}}}}"#,
            bar("a"),
            bar("b"),
            bar("c"),
            hinge("A", ground(0.0, 0.0), place("a", 0.0, 0.0)),
            hinge("B", place("c", 0.0, 0.0), place("b", 0.0, 0.0)),
            place("b", 1.0, 0.0),
            place("c", 0.0, 0.0),
            place("a", 0.9, 0.0),
            place("c", 0.1, 0.2),
        ),
    ];
    for (number, text) in scenes.into_iter().enumerate() {
        let text =
            format!(r#"{{"name": "s{number}", "gravity": [0, -9.81], {text}, "until": 0.5, "every": 0.1}}"#);
        assert_eq!(assert_balanced(scene(&text)), 5, "{number}");
    }
}

/// The forces of a four-bar whose crank turns steadily: positions by circles, derivatives of the closed loop, and
/// nine equations for eight hinge forces and a torque.
fn four_bar(scene: &Scene, t: f64) -> [f64; 5] {
    let [a, b, c, d] = [0.3, 0.9, 0.7, 1.0];
    let theta = 0.5 * PI + TAU * t;
    let unit = |angle: f64| [angle.cos(), angle.sin()];
    let [cx, cy] = unit(theta).map(|x| a * x);
    // Where circles about A and C meet, above.
    let [ux, uy] = [d - cx, -cy];
    let span = ux.hypot(uy);
    let along = (b * b - c * c + span * span) / (2.0 * span);
    let up = (b * b - along * along).sqrt();
    let meeting = [cx + (along * ux - up * uy) / span, cy + (along * uy + up * ux) / span];
    let beta = (meeting[1] - cy).atan2(meeting[0] - cx);
    let gamma = meeting[1].atan2(meeting[0] - d);
    let angles = [theta, beta, gamma];
    let lengths = [a, b, -c];
    // a e^(i theta) + b e^(i beta) - c e^(i gamma) = d, differentiated once and twice.
    let solve = |known: [f64; 2]| {
        let m = [[-b * beta.sin(), c * gamma.sin()], [b * beta.cos(), -c * gamma.cos()]];
        let det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
        [(known[0] * m[1][1] - m[0][1] * known[1]) / det, (m[0][0] * known[1] - m[1][0] * known[0]) / det]
    };
    let [wb, wc] = solve([a * TAU * theta.sin(), -a * TAU * theta.cos()]);
    let rates = [TAU, wb, wc];
    let pull =
        |axis: usize| (0..3).map(|k| lengths[k] * rates[k] * rates[k] * unit(angles[k])[axis]).sum::<f64>();
    let [ab, ac] = solve([pull(0), pull(1)]);
    let alphas = [0.0, ab, ac];
    let arm = |k: usize, s: f64| unit(angles[k]).map(|x| s * x);
    let turned = |k: usize, s: f64| {
        let ([x, y], w, alpha) = (arm(k, s), rates[k], alphas[k]);
        [-alpha * y - w * w * x, alpha * x - w * w * y]
    };
    let half = |k: usize| scene.bars[k].centre[0];
    let at_a = turned(0, a);
    let centres = [turned(0, half(0)), turned(1, half(1)), turned(2, half(2))];
    let accelerations = [centres[0], [centres[1][0] + at_a[0], centres[1][1] + at_a[1]], centres[2]];
    // Unknowns: O on crank, A on coupler, B on rocker, C on rocker (x, y each), torque.
    let (mut m, mut right) = (DMatrix::zeros(9, 9), DVector::zeros(9));
    let ends = [[(0, 1.0, 0.0), (2, -1.0, a)], [(2, 1.0, 0.0), (4, -1.0, b)], [(6, 1.0, 0.0), (4, 1.0, c)]];
    for (k, ends) in ends.iter().enumerate() {
        for &(force, sign, s) in ends {
            let [x, y] = arm(k, s - half(k));
            m[(3 * k, force)] += sign;
            m[(3 * k + 1, force + 1)] += sign;
            m[(3 * k + 2, force)] -= sign * y;
            m[(3 * k + 2, force + 1)] += sign * x;
        }
        let bar = &scene.bars[k];
        right[3 * k] = bar.mass * accelerations[k][0];
        right[3 * k + 1] = bar.mass * (accelerations[k][1] + 9.81);
        right[3 * k + 2] = bar.inertia * alphas[k];
    }
    m[(2, 8)] = 1.0;
    let f = m.lu().solve(&right).expect("a regular system");
    [f[0].hypot(f[1]), f[2].hypot(f[3]), f[4].hypot(f[5]), f[6].hypot(f[7]), f[8]]
}

#[test]
fn peaks_of_a_crank_rocker_are_those_of_inverse_dynamics() {
    let names = ["O.force", "A.force", "B.force", "C.force", "motor.torque"];
    let scene = with(example("four_bar_motor"), &names);
    // Peaks on a fine grid, and between its points by a parabola.
    let n = 20_000;
    let grid: Vec<[f64; 5]> = (0..=n).map(|i| four_bar(&scene, f64::from(i) / f64::from(n))).collect();
    for request in [
        adaptive(MethodId::Taylor, 1e-13),
        adaptive(MethodId::Dp8, 1e-12),
        Request { stabilize: Some(Stabilization::Projection), ..adaptive(MethodId::Radau(5), 1e-11) },
    ] {
        let request = Request { until: Some(1.0), every: Some(1.0), ..request };
        let outcome = run(&scene, &request);
        for (k, name) in names.iter().enumerate() {
            let extremes = found(&outcome.extremes, name);
            for (sign, [value, t]) in [(1.0, extremes.max), (-1.0, extremes.min)] {
                let best =
                    (0..=n as usize).max_by(|&i, &j| (sign * grid[i][k]).total_cmp(&(sign * grid[j][k])));
                let i = best.expect("a grid").clamp(1, n as usize - 1);
                let [y0, y1, y2] = [grid[i - 1][k], grid[i][k], grid[i + 1][k]];
                let shift = 0.5 * (y0 - y2) / (y0 - 2.0 * y1 + y2);
                let peak = y1 - 0.25 * (y0 - y2) * shift;
                assert!((value - peak).abs() < 1e-7 * (1.0 + peak.abs()), "{name}: {value} {peak}");
                // The turn of a steady crank begins and ends alike.
                let off = (t - (i as f64 + shift) / f64::from(n)).rem_euclid(1.0);
                assert!(off.min(1.0 - off) < 1e-5, "{name}: {t} {off}");
            }
            let mean = grid[1..].iter().map(|row| row[k]).sum::<f64>() / f64::from(n);
            let square = grid[1..].iter().map(|row| row[k] * row[k]).sum::<f64>() / f64::from(n);
            assert!(
                (extremes.mean - mean).abs() < 1e-8 * (1.0 + mean.abs()),
                "{name}: {} {mean}",
                extremes.mean
            );
            assert!((extremes.rms - square.sqrt()).abs() < 1e-8 * square.sqrt(), "{name}: {}", extremes.rms);
        }
    }
}

/// A block of 2 kg pushed up a rail by a crank and a rod of negligible mass, slowly.
fn lifted(rate: f64) -> Scene {
    scene(&format!(
        r#"{{"name": "lifted", "gravity": [-9.81, 0],
        "bars": [
            {{"name": "crank", "mass": 1e-9, "centre": [0.075, 0], "inertia": 1e-12, "length": 0.15}},
            {{"name": "rod", "mass": 1e-9, "centre": [0.15, 0], "inertia": 1e-12, "length": 0.3}},
            {{"name": "block", "mass": 2, "centre": [0, 0], "inertia": 1, "length": 0.05}}],
        "hinges": [
            {{"name": "O", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "crank", "point": [0, 0]}}]}},
            {{"name": "A", "between": [{{"body": "crank", "point": [0.15, 0]}}, {{"body": "rod", "point": [0, 0]}}]}},
            {{"name": "B", "between": [{{"body": "rod", "point": [0.3, 0]}}, {{"body": "block", "point": [0, 0]}}]}}],
        "sliders": [{{"name": "rail", "point": {{"body": "block", "point": [0, 0]}}, "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}}, "angle": "locked"}}],
        "motors": [{{"name": "motor", "body": "crank", "law": {{"start": 0, "rate": {rate}}}}}],
        "outputs": ["O.force", "A.force", "B.force", "rail.force", "motor.torque"],
        "start": {{"rod": {{"phi": 0}}, "block": {{"phi": 0}}}}, "until": {}, "every": {}}}"#,
        TAU / rate,
        TAU / rate,
    ))
}

/// As the speed goes to zero the peaks are those of statics, and what is left falls with its square: a weight W on a
/// rod at the angle β to the rail presses it by W / cos β and the rail by W tan β.
#[test]
fn peaks_of_a_slow_slider_crank_are_those_of_statics() {
    let (r, l, weight) = (0.15, 0.3, 2.0 * 9.81);
    let sin = r / l;
    let cos = f64::sqrt(1.0 - sin * sin);
    // Torque by virtual work: W dx/dφ with x = r cos φ + √(l² - r² sin² φ), largest by a golden search.
    let torque = |phi: f64| {
        let root = (l * l - (r * phi.sin()).powi(2)).sqrt();
        weight * (r * phi.sin() + r * r * phi.sin() * phi.cos() / root)
    };
    let most = (0..=200_000).map(|k| torque(PI * f64::from(k) / 200_000.0)).fold(0.0, f64::max);
    let statics = [weight / cos, weight / cos, weight / cos, weight * sin / cos, most];
    let errors = |rate: f64| -> Vec<f64> {
        let scene = lifted(rate);
        let outcome = run(&scene, &adaptive(MethodId::Taylor, 1e-12));
        let names = ["O.force", "A.force", "B.force", "rail.force", "motor.torque"];
        let peaks = names.iter().map(|name| found(&outcome.extremes, name).peak()[0].abs());
        peaks.zip(statics).map(|(peak, known)| (peak - known).abs() / known).collect()
    };
    let slow = [0.8, 0.4, 0.2].map(errors);
    for k in 0..statics.len() {
        assert!(slow[2][k] < 2e-3, "output {k}: {:?}", slow.map(|errors| errors[k]));
        for pair in slow.windows(2) {
            let order = (pair[0][k] / pair[1][k]).log2();
            // Where the static torque W x'(φ) is largest, x'' and with it the inertia of the block vanish.
            let expected = if k == 4 { 4.0 } else { 2.0 };
            assert!((order - expected).abs() < 0.1, "output {k} falls with order {order}");
        }
    }
}

/// A bar of moment 0.5 kg·m² about its hinge turns to and fro as A sin w t: its torque is known at every time.
fn swinging(every: f64) -> Scene {
    scene(&format!(
        r#"{{"name": "swing", "gravity": [0, 0], "bars": [{{"name": "bar", "mass": 2, "centre": [0.5, 0], "inertia": 0}}],
        "hinges": [{{"name": "O", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}}],
        "motors": [{{"name": "M", "body": "bar", "law": "0.3*sin(2*pi*t)"}}],
        "points": [{{"name": "tip", "body": "bar", "point": [1.5, 0]}}],
        "parameters": {{"radius": 1.5}}, "signals": {{"speed": "sqrt(tip.vx^2 + tip.vy^2)"}},
        "outputs": {{"torque": "M.torque", "power": "M.power", "speed": "speed", "along": "tip.ax*bar.cos + tip.ay*bar.sin",
                     "lever": "M.torque/radius", "pull": "-(O.fx*bar.cos + O.fy*bar.sin)"}},
        "until": 3, "every": {every}}}"#
    ))
}

#[test]
fn what_is_made_of_torques_has_their_unit() {
    let outputs = ["size=abs(M.torque)", "less=-M.torque", "both=max(M.torque, -M.torque)"];
    let scene = with(with(swinging(0.1), &outputs), &["turned=M.torque*bar.phi"]);
    let request = Request { until: Some(0.1), ..adaptive(MethodId::Taylor, 1e-9) };
    let outcome = run(&scene, &request);
    let unit = |name: &str| found(&outcome.extremes, name).unit.clone();
    assert_eq!(["size", "less", "both"].map(unit), ["N m", "N m", "N m"]);
    assert_eq!(["turned", "power"].map(unit), ["J", "W"]);
}

#[test]
fn extremes_and_means_are_located_between_rows() {
    let outcome = run(&swinging(3.0), &adaptive(MethodId::Taylor, 1e-14));
    let (inertia, w, amplitude) = (0.5, TAU, 0.3);
    let torque = found(&outcome.extremes, "torque");
    let peak = inertia * amplitude * w * w;
    assert!((torque.max[0] - peak).abs() < 1e-12 && (torque.min[0] + peak).abs() < 1e-12, "{torque:?}");
    assert!(
        (torque.max[1].fract() - 0.75).abs() < 1e-7 && (torque.min[1].fract() - 0.25).abs() < 1e-7,
        "{torque:?}"
    );
    assert!(torque.mean.abs() < 1e-12 && (torque.rms - peak * FRAC_1_SQRT_2).abs() < 1e-10, "{torque:?}");
    assert_eq!(torque.unit, "N m");
    let speed = found(&outcome.extremes, "speed");
    // Where it comes down to zero it has a corner.
    assert!((speed.max[0] - 1.5 * amplitude * w).abs() < 1e-12 && speed.min[0] < 1e-9, "{speed:?}");
    assert!(((2.0 * speed.min[1]).fract() - 0.5).abs() < 1e-9, "{speed:?}");
    assert_eq!(speed.unit, "m/s");
    // The mean of |cos| is 2/π; it has corners.
    assert!((speed.mean - 1.5 * amplitude * w * 2.0 / PI).abs() < 1e-4, "{speed:?}");
    let power = found(&outcome.extremes, "power");
    assert!((power.max[0] - 0.5 * peak * amplitude * w).abs() < 1e-11, "{power:?}");
    // Towards the hinge, 1.5 m and 0.5 m from it.
    let square = (amplitude * w).powi(2);
    let [along, pull] = ["along", "pull"].map(|name| found(&outcome.extremes, name));
    assert!((along.min[0] + 1.5 * square).abs() < 1e-11 && along.max[0].abs() < 1e-9, "{along:?}");
    assert!((pull.max[0] - 2.0 * 0.5 * square).abs() < 1e-11, "{pull:?}");
    // A plain number may have any dimension.
    assert_eq!(found(&outcome.extremes, "lever").unit, "?");
}

#[test]
fn extremes_do_not_depend_on_rows_or_pauses() {
    for method in [MethodId::Dp8, MethodId::Taylor, MethodId::Radau(5)] {
        let scene = with(example("four_bar_motor"), &["O.force", "motor.torque", "coupler.ay"]);
        let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
        let start = mechanism.start(&scene);
        let running = |every: f64| {
            let request = Request { until: Some(2.0), every: Some(every), ..adaptive(method, 1e-10) };
            let plan = Plan::new(&scene, &mechanism, &request).expect("a plan");
            Running::new(Run::new(Arc::clone(&mechanism), plan, Limits::default(), &start).expect("a run"))
        };
        let whole = |every: f64| {
            let mut running = running(every);
            running.go(&mut |_| Ok(()), &mut || false).expect("rows");
            running.finish().extremes
        };
        let (coarse, fine) = (whole(2.0), whole(0.01));
        assert_eq!(coarse, fine, "{method}");
        let (mut first, mut steps) = (running(0.01), 0);
        let is_over = first.go(&mut |_| Ok(()), &mut || {
            steps += 1;
            steps > 40
        });
        assert!(!is_over.expect("rows"));
        let mut rest = Running::resume(Arc::clone(&mechanism), &start, first.snapshot()).expect("a rest");
        rest.go(&mut |_| Ok(()), &mut || false).expect("rows");
        assert_eq!(rest.finish().extremes, fine, "{method}");
    }
}

#[test]
fn walls_and_dry_friction_have_their_forces() {
    let scene = with(example("sliding_ball"), &["floor.force", "floor.friction", "floor.gap"]);
    let outcome = run(&scene, &adaptive(MethodId::Radau(5), 1e-10));
    // At rest on the floor in the end: its weight, and no friction.
    let weight = 2.0 * 9.81;
    assert!((outcome.last.outputs[0] - weight).abs() < 1e-11, "{:?}", outcome.last.outputs);
    assert!(outcome.last.outputs[1].abs() < 1e-11 && outcome.last.outputs[2].abs() < 1e-12);
    let friction = found(&outcome.extremes, "floor.friction");
    assert!((friction.min[0] + 0.2 * weight).abs() < 1e-11 && friction.max[0].abs() < 1e-11, "{friction:?}");
}

/// A ball falls from 5 m in 1 s, comes off at half its speed, and that event ends the run: no step follows in
/// which the outputs after the impact are seen.
#[test]
fn extremes_have_the_jump_that_ends_a_run() {
    let text = r#"{"name": "ball", "gravity": [0, -10], "until": 3, "every": 0.1,
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 1}],
        "points": [{"name": "p", "body": "b", "point": [0, 0]}],
        "walls": [{"name": "W", "body": "b", "point": [0, 0], "restitution": 0.5,
         "line": {"through": [0, 0], "normal": [0, 1]}}],
        "events": [{"name": "up", "when": "p.vy", "direction": "rising", "action": "stop"}],
        "outputs": {"v": "p.vy", "k": "p.vy^2"},
        "start": {"b": {"phi": 0, "omega": 0, "origin": [0, 5], "velocity": [0, 0]}}}"#;
    let scene = parse_scene(text, "ball", &[]).expect("a scene");
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Radau(5)] {
        let outcome = run(&scene, &adaptive(method, 1e-10));
        assert_eq!(outcome.ended_by.as_deref(), Some("up"), "{method}");
        let v = found(&outcome.extremes, "v");
        assert!((v.max[0] - 5.0).abs() < 1e-7 && (v.min[0] + 10.0).abs() < 1e-7, "{method}: {v:?}");
        assert!(v.max[1] == outcome.last.t && (v.max[1] - 1.0).abs() < 1e-7, "{method}: {v:?}");
        // Over 1 s: -10 t and (10 t)².
        assert!((v.mean + 5.0).abs() < 1e-7, "{method}: {v:?}");
        assert!((found(&outcome.extremes, "k").mean - 100.0 / 3.0).abs() < 1e-6, "{method}");
    }
}

#[test]
fn an_absolute_value_of_zero_has_no_sign() {
    let scene = with(crate::common::free(), &["abs(bar1.vx)", "-abs(bar2.omega)"]);
    let mut first = None;
    simulate(&scene, &adaptive(MethodId::Dp8, 1e-9), &mut |sample| {
        first.get_or_insert_with(|| sample.outputs.clone());
        Ok(())
    })
    .expect("a run");
    assert_eq!(first.map(|outputs| format!("{outputs:?}")).as_deref(), Some("[0.0, 0.0]"));
}

#[test]
fn outputs_are_read_written_and_refused_by_name() {
    let text = |outputs: &str| {
        format!(
            r#"{{"name": "o", "gravity": [0, -9.81], "bars": [{{"name": "bar", "mass": 2, "centre": [0.5, 0], "inertia": 0.1}}],
            "hinges": [{{"name": "O", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}}],
            "start": {{"bar": {{"phi": 0, "omega": 0}}}}, "until": 1, "every": 1, "outputs": {outputs}}}"#
        )
    };
    let list = scene(&text(r#"["O.force", "bar.x*2"]"#));
    assert_eq!(
        list.outputs.iter().map(|output| output.name.as_str()).collect::<Vec<_>>(),
        ["O.force", "bar.x*2"]
    );
    assert_eq!(
        parse_scene(&list.to_input().to_string(), "again", &[]).expect("a scene").outputs,
        list.outputs
    );
    // A bar let go at the horizontal: the hinge carries m g (1 - m c²/I).
    let outcome = run(&list, &adaptive(MethodId::Taylor, 1e-12));
    assert_eq!(found(&outcome.extremes, "O.force").unit, "N");
    let first = 2.0 * 9.81 * (1.0 - 2.0 * 0.25 / 0.6);
    assert!(found(&outcome.extremes, "O.force").min[0] <= first + 1e-12);
    for (outputs, part) in [
        (r#"["O.forse"]"#, "unknown name O.forse"),
        (r#"{"a": "O.force + bar.phi*1 m"}"#, "puts N and m together"),
        (r#"{"a": 3}"#, "must be a formula in quotes"),
        (r#"["O.fx", "O.fx"]"#, "is there twice"),
        (r#"{"a,b": "O.fx"}"#, "has a name that no column can have"),
        (r#"{"bar.phi": "O.fx"}"#, "the name bar.phi is that of another column"),
        (r#"{"imbalance": "O.fx"}"#, "the name imbalance is that of another column"),
        (r#"3"#, "must be {name: formula in quotes}, or a list"),
    ] {
        let error = parse_scene(&text(outputs), "test", &[]).expect_err("no scene").to_string();
        assert!(error.contains(part) && error.contains("outputs"), "{outputs}: {error}");
    }
}

/// Torsion springs by formulas have the quantities of those by numbers, in closed form of angle and rate.
#[test]
fn torsion_springs_by_formulas_have_angle_rate_and_torque() {
    for (law, torque) in [
        (r#""torque": "0.5*angle + 0.2*rate""#, (|x, v| -0.5 * x - 0.2 * v) as fn(f64, f64) -> f64),
        (r#""potential": "1*angle^4", "torque": "0.1*rate""#, |x, v| -4.0 * x * x * x - 0.1 * v),
    ] {
        let scene = with(
            scene(&format!(
                r#"{{"name": "coil", "gravity": [0, -9.81],
                "bars": [{{"name": "a", "mass": 1, "centre": [0.25, 0], "inertia": 0.02, "length": 0.5}},
                    {{"name": "b", "mass": 1, "centre": [0.25, 0], "inertia": 0.02, "length": 0.5}}],
                "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}},
                    {{"name": "B", "between": [{{"body": "a", "point": [0.5, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
                "torsion_springs": [{{"name": "coil", "body": "b", "relative_to": "a", {law}}}],
                "start": {{"a": {{"phi": 0.3, "omega": 0}}, "b": {{"phi": 0.9, "omega": 1}}}}, "until": 2, "every": 0.1}}"#
            )),
            &["coil.angle", "coil.rate", "coil.torque"],
        );
        let mut rows = 0;
        let request = adaptive(MethodId::Taylor, 1e-12);
        simulate(&scene, &request, &mut |sample| {
            let [angle, rate] = [&sample.phi, &sample.omega].map(|values| values[1] - values[0]);
            let expected = [angle, rate, torque(angle, rate)];
            let off = sample.outputs.iter().zip(expected).map(|(found, expected)| (found - expected).abs());
            assert!(off.fold(0.0, f64::max) < 1e-13, "{law} {:?} {expected:?}", sample.outputs);
            rows += 1;
            Ok(())
        })
        .expect("a run");
        assert_eq!(rows, 21);
    }
}

/// A body that turns evenly: shares of a turn, areas and jumps of less than a thousandth of a step are known in
/// closed form, by methods whose steps differ.
#[test]
fn corners_and_jumps_between_rows_count_to_the_last_digits() {
    let (rate, until) = (3.0, 20.0);
    let text = format!(
        r#"{{"name": "turning", "gravity": [0, 0],
        "bars": [{{"name": "a", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}}],
        "points": [{{"name": "tip", "body": "a", "point": [1, 0]}}],
        "signals": {{"up": "max(tip.y, 0)"}},
        "outputs": {{"near": "if(tip.x > 0.99999, 1, 0)", "blink": "if(t > 0.5001, if(t < 0.5003, 1, 0), 0)",
            "up": "up", "size": "abs(tip.y)", "more": "if(tip.x > 0.5, 1 + tip.x, 0)", "clock": "min(t, 7.3)^2"}},
        "start": {{"a": {{"phi": 0, "omega": {rate}}}}}, "until": {until}, "every": 5}}"#
    );
    let end = rate * until;
    // Angles from 0 to the end at which |sin| or the cosine lies above something.
    let within = |angle: f64| {
        let (turns, left) = ((end / TAU).floor(), end % TAU);
        2.0 * angle * turns + left.min(angle) + (left - (TAU - angle)).max(0.0)
    };
    let sine_up_to = |left: f64| if left < PI { 1.0 - left.cos() } else { 2.0 };
    let (turns, left) = ((end / TAU).floor(), end % TAU);
    let up = 2.0 * turns + sine_up_to(left);
    let size = 4.0 * turns + sine_up_to(left) + if left > PI { 1.0 + left.cos() } else { 0.0 };
    let cone = f64::acos(0.5);
    let sines = |from: f64, to: f64| if to > from { to.sin() - from.sin() } else { 0.0 };
    let more = within(cone) + 2.0 * cone.sin() * turns + sines(0.0, left.min(cone)) + sines(TAU - cone, left);
    let squares = 7.3_f64.powi(3) / 3.0 + 7.3_f64.powi(2) * (until - 7.3);
    let expected = [
        ("near", within(f64::acos(0.99999)) / end, [0.0, 1.0]),
        ("blink", 2e-4 / until, [0.0, 1.0]),
        ("up", up / end, [0.0, 1.0]),
        ("size", size / end, [0.0, 1.0]),
        ("more", more / end, [0.0, 2.0]),
        ("clock", squares / until, [0.0, 7.3_f64.powi(2)]),
    ];
    for request in [
        adaptive(MethodId::Taylor, 1e-13),
        adaptive(MethodId::Dp8, 1e-12),
        adaptive(MethodId::Dp5, 1e-11),
        adaptive(MethodId::Radau(5), 1e-12),
    ] {
        let outcome = run(&scene(&text), &request);
        for (name, mean, [min, max]) in expected {
            let one = found(&outcome.extremes, name);
            println!("{:?} {name}: {} {mean} {:?} {:?}", request.method, one.mean, one.min, one.max);
            assert!(
                (one.mean - mean).abs() < 1e-9 * mean,
                "{:?} {name}: {} {mean}",
                request.method,
                one.mean
            );
            assert!((one.min[0] - min).abs() < 1e-9 && (one.max[0] - max).abs() < 1e-9, "{name}: {one:?}");
        }
        assert_eq!(found(&outcome.extremes, "up").min[0], 0.0);
    }
}

/// A ball thrown up: roots that have no value beyond a corner, and conditions that have none on the other branch,
/// against midpoints of the parabola.
#[test]
fn roots_that_end_at_a_corner_have_their_means() {
    let text = r#"{"name": "thrown", "gravity": [0, -9.81],
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1}],
        "points": [{"name": "p", "body": "b", "point": [0, 0]}],
        "start": {"b": {"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [1, 4]}},
        "outputs": {"nested": "if(p.y > 0.1, if(sqrt(p.y - 0.1) > 0.4, 1, 2), 3)",
            "larger": "if(p.y > 0.1, max(sqrt(p.y - 0.1), 0.4), 3)", "root": "if(p.y > 0.1, sqrt(p.y - 0.1), 0.3)",
            "kept": "sqrt(max(p.y - 0.1, 0))", "sized": "sqrt(abs(p.y - 0.1))"},
        "until": 1, "every": 1}"#;
    let over = |t: f64| t * (4.0 - 0.5 * 9.81 * t) - 0.1;
    let nested = |y: f64| if y <= 0.0 { 3.0 } else { 2.0 - f64::from(y.sqrt() > 0.4) };
    let larger = |y: f64| if y <= 0.0 { 3.0 } else { y.sqrt().max(0.4) };
    let root = |y: f64| if y > 0.0 { y.sqrt() } else { 0.3 };
    let expected: [(&str, &dyn Fn(f64) -> f64); 5] = [
        ("nested", &nested),
        ("larger", &larger),
        ("root", &root),
        ("kept", &|y| y.max(0.0).sqrt()),
        ("sized", &|y| y.abs().sqrt()),
    ];
    let count = 1_000_000;
    let places: Vec<f64> = (0..count).map(|k| over((f64::from(k) + 0.5) / f64::from(count))).collect();
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Dp5, MethodId::Radau(5)] {
        let outcome = run(&scene(text), &adaptive(method, 1e-11));
        for (name, of) in &expected {
            let one = found(&outcome.extremes, name);
            let values = places.iter().map(|&y| of(y));
            let mean = values.clone().sum::<f64>() / f64::from(count);
            let [min, max] =
                values.fold([f64::INFINITY, 0.0], |[min, max]: [f64; 2], x| [min.min(x), max.max(x)]);
            println!("{method:?} {name}: {} {mean}", one.mean);
            assert!((one.mean - mean).abs() < 5e-6, "{method:?} {name}: {} {mean}", one.mean);
            assert!((one.min[0] - min).abs() < 2e-3 && (one.max[0] - max).abs() < 1e-5, "{name}: {one:?}");
        }
    }
}

/// Where both arguments of an angle pass zero it jumps by half a turn, and a pendulum's velocity turns round
/// at the largest angle: closed forms of one that turns evenly and of the energy of one that swings.
#[test]
fn angles_that_jump_where_both_arguments_are_zero_stay_within_half_a_turn() {
    let with = |gravity: f64, rest: &str| {
        scene(&format!(
            r#"{{"name": "angles", "gravity": [0, -{gravity}],
            "bars": [{{"name": "a", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}}],
            "hinges": [{{"name": "H", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}}],
            {rest}, "every": 1}}"#
        ))
    };
    let turning = with(
        0.0,
        r#""start": {"a": {"phi": 0.1, "omega": 1}}, "until": 7,
        "outputs": {"one": "atan2(a.cos - 0.2, 0.2 - a.cos)", "other": "atan2(a.sin*(t - 1 s), 1 s - t)"}"#,
    );
    let swinging = with(
        9.81,
        r#""start": {"a": {"phi": -0.5, "omega": 0.3}}, "until": 5,
        "outputs": {"way": "atan2(a.vy, a.vx)", "turned": "atan2(a.vx, -a.vy)"}"#,
    );
    // From 0.1 rad to 7.1 rad the cosine is below 0.2 between the angle of that and what it is on the other side.
    let below = TAU - 2.0 * f64::acos(0.2);
    let mean = 0.75 * PI - PI * below / 7.0;
    // (m s² + I) ω²/2 - m g s cos is -m g s cos of the amplitude, with angles from the lowest place.
    let amplitude = f64::acos(0.5_f64.sin() - 0.35 * 0.09 / (2.0 * 9.81 * 0.5));
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Radau(5)] {
        let outcome = run(&turning, &adaptive(method, 1e-10));
        let [one, other] = ["one", "other"].map(|name| found(&outcome.extremes, name));
        println!("{method:?}: {one:?} {mean} {other:?}");
        assert!((one.min[0] + 0.25 * PI).abs() < 1e-12 && (one.max[0] - 0.75 * PI).abs() < 1e-12, "{one:?}");
        assert!((one.mean - mean).abs() < 1e-9, "{method:?}: {one:?} {mean}");
        assert!(other.min[0] >= -PI - 1e-9 && other.max[0] <= PI + 1e-9, "{other:?}");
        let outcome = run(&swinging, &adaptive(method, 1e-10));
        let [way, turned] = ["way", "turned"].map(|name| found(&outcome.extremes, name));
        println!("{method:?}: {way:?} {turned:?} {amplitude}");
        assert!((way.min[0] + PI).abs() < 1e-9 && (way.max[0] - PI).abs() < 1e-9, "{way:?}");
        let most = 0.5 * PI + amplitude;
        assert!((turned.min[0] + most).abs() < 1e-6 && (turned.max[0] - most).abs() < 1e-6, "{turned:?}");
    }
}

#[test]
fn roots_of_what_rounding_leaves_have_their_means() {
    let scene_until = |until: f64, output: &str| {
        scene(&format!(
            r#"{{"name": "ball", "gravity": [0, -9.81],
            "bars": [{{"name": "b", "mass": 1.5, "centre": [0, 0], "inertia": 0.05, "length": 0.4}}],
            "walls": [{{"name": "W", "body": "b", "point": [0, 0],
                "line": {{"through": [0, 0], "normal": [0, 1]}}, "restitution": 0.5}}],
            "start": {{"b": {{"phi": 0.2, "omega": 0, "origin": [0, 0.5], "velocity": [0, 0]}}}},
            "outputs": {{"root": "{output}"}}, "until": {until}, "every": 0.1}}"#
        ))
    };
    // The integral of the root over a flight of T seconds is √(g/2) π T²/8, over the fall of F seconds the
    // same with (2 F)²/2, and flights last F, F/2, …
    let (unit, fall) = (f64::sqrt(0.5 * 9.81) * PI, f64::sqrt(2.0 * 0.5 / 9.81));
    for method in [MethodId::Taylor, MethodId::Dp8] {
        for output in ["sqrt(abs(W.gap/(1 m)))", "sqrt(max(0, W.gap/(1 m)))"] {
            let outcome = run(&scene_until(1.6, output), &adaptive(method, 1e-10));
            let one = found(&outcome.extremes, "root");
            let mean = unit * fall * fall * 5.0 / 12.0 / 1.6;
            println!("{method:?} {output}: {} {mean} {:?}", one.mean, one.min);
            assert!((one.mean - mean).abs() < 1e-6, "{method:?} {output}: {} {mean}", one.mean);
        }
        // Up to the top of the first flight; at the impact the gap may be -1e-16.
        let outcome = run(&scene_until(1.5 * fall, "sqrt(W.gap/(1 m))"), &adaptive(method, 1e-10));
        let (one, mean) = (found(&outcome.extremes, "root"), unit * fall * 5.0 / 16.0 / 1.5);
        println!("{method:?}: {} {mean} {:?}", one.mean, one.min);
        assert!((one.mean - mean).abs() < 1e-6 && one.min[0] < 1e-5, "{method:?}: {one:?} {mean}");
    }
}

#[test]
fn conditions_of_conditions_take_what_sticks_as_at_rest() {
    let text = r#"{"name": "stuck", "gravity": [0, -9.81],
        "bars": [{"name": "w", "mass": 3, "centre": [0, 0], "inertia": 0.1, "length": 0.2},
            {"name": "p", "mass": 0.7, "centre": [0.4, 0], "inertia": 0.03, "length": 0.8}],
        "hinges": [{"name": "P", "between": [{"body": "w", "point": [0, 0]}, {"body": "p", "point": [0, 0]}]}],
        "sliders": [{"name": "R", "point": {"body": "w", "point": [0, 0]}, "angle": "locked",
            "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0.2]},
            "friction": {"kinetic": 0.3, "static": 0.8}}],
        "start": {"w": {"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [1, 0.2]},
            "p": {"phi": -1, "omega": 0}},
        "outputs": {"nested": "if(sign(w.vx) < 0, 1, w.x/(1 m))", "slides": "if(w.vx > 0, 1, 0)",
            "way": "if(w.vx > 0, w.x/(1 m), 0)"}, "until": 2, "every": 0.01}"#;
    for method in [MethodId::Taylor, MethodId::Dp8] {
        let outcome = run(&scene(text), &adaptive(method, 1e-10));
        let [nested, slides, way] =
            ["nested", "slides", "way"].map(|name| found(&outcome.extremes, name).mean);
        // It sticks from 0.2176 s on.
        println!("{method:?}: {nested} {slides} {way}");
        assert!((slides - 0.108_8).abs() < 1e-4, "{method:?}: {slides}");
        assert!((nested - (1.0 - slides + way)).abs() < 1e-9, "{method:?}: {nested} {slides} {way}");
    }
}

/// A slider-crank whose links are both 0.3 m long, turned by a motor from 0.3 rad at 5 rad/s.
pub const EQUAL_SLIDER_CRANK: &str = r#"{"name": "s", "gravity": [0, -9.81], "bars": [
    {"name": "a", "mass": 1, "centre": [0.15, 0], "inertia": 0.01, "length": 0.3},
    {"name": "b", "mass": 1, "centre": [0.15, 0], "inertia": 0.01, "length": 0.3},
    {"name": "p", "mass": 2, "centre": [0, 0], "inertia": 0.01}], "hinges": [
    {"name": "O", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
    {"name": "A", "between": [{"body": "a", "point": [0.3, 0]}, {"body": "b", "point": [0, 0]}]},
    {"name": "B", "between": [{"body": "b", "point": [0.3, 0]}, {"body": "p", "point": [0, 0]}]}],
    "sliders": [{"name": "s", "point": {"body": "p", "point": [0, 0]}, "angle": "locked",
        "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}}],
    "motors": [{"name": "M", "body": "a", "law": {"start": 0.3, "rate": 5.0}}],
    "outputs": {"T": "M.torque", "S": "s.force", "FB": "B.force", "x": "p.x"},
    "start": {"a": {"phi": 0.3}, "b": {"phi": -0.3}, "p": {"phi": 0}}, "until": 1, "every": 0.01}"#;

/// Statics of an equal slider-crank, which passes its singular position at a quarter and at three quarters of
/// a turn: forces there are the limits along the motion, whatever the method's last digits are.
#[test]
fn forces_at_singular_positions_are_limits_along_the_motion() {
    let (g, rate, length) = (9.81, 5.0_f64, 0.3);
    let forces = |t: f64| {
        let (sin, cos) = (0.3 + rate * t).sin_cos();
        let along = -4.0 * length * rate.powi(2);
        let moment = 0.15 * (g - rate.powi(2) * 0.15 * sin) - 0.15 * sin * 0.45 * rate.powi(2);
        let across = -(moment + length * sin * along) / length;
        let normal = (2.0 * g - across).abs();
        let twice = if 0.3 + rate * t < 1.55 { normal } else { 2.0 * normal };
        [normal, (along * cos).hypot(across), twice, (along * cos).abs()]
    };
    let steps = 100_000;
    let rows: Vec<[f64; 4]> = (0..=steps).map(|i| forces(f64::from(i) / f64::from(steps))).collect();
    let more = r#""outputs": {"jump": "if(a.phi < 1.55, 1, 2)*s.force", "size": "abs(B.fx)","#;
    let text = EQUAL_SLIDER_CRANK.replace(r#""outputs": {"#, more);
    let scene = parse_scene(&text, "scene", &[]).expect("a scene");
    for (method, rtol) in [(MethodId::Taylor, 1e-9), (MethodId::Radau(5), 1e-9), (MethodId::Dp8, 1e-11)] {
        let outcome = run(&scene, &adaptive(method, rtol));
        assert!(found(&outcome.extremes, "size").min[0] >= 0.0, "{method:?}");
        for (k, name) in ["S", "FB", "jump", "size"].into_iter().enumerate() {
            let told = found(&outcome.extremes, name);
            let values = || rows.iter().map(|row| row[k]);
            let mean = values().sum::<f64>() / f64::from(steps);
            for (value, expected) in [
                (told.min[0], values().fold(f64::INFINITY, f64::min)),
                (told.max[0], values().fold(0.0, f64::max)),
                (told.mean, mean - 0.5 * (rows[0][k] + rows[steps as usize][k]) / f64::from(steps)),
            ] {
                // The least magnitude is a zero between two of the times; beside a singular position the dense
                // output of Radau's method has few digits.
                let most = if name == "jump" && method == MethodId::Radau(5) { 0.05 } else { 4e-4 };
                assert!((value - expected).abs() < most, "{method:?} {name}: {value} for {expected}");
            }
        }
        let nearest = outcome.drift.singular.as_ref().expect("a singular position");
        let t = (nearest.t - (0.5 * PI - 0.3) / rate).abs().min((nearest.t - (1.5 * PI - 0.3) / rate).abs());
        assert!(nearest.smallest < 1e-9 && t < 1e-6, "{nearest:?}");
    }
}

/// A parallelogram's torque is 5.886 cos θ; the forces in its hinges are without bound where it folds, and a
/// row there does not tell them.
#[test]
fn forces_without_bound_at_singular_positions_are_told() {
    let text = r#"{"name": "p", "gravity": [0, -9.81], "bars": [
        {"name": "a", "mass": 1, "centre": [0.1, 0], "inertia": 0.004, "length": 0.2},
        {"name": "b", "mass": 2, "centre": [0.25, 0.1], "inertia": 0.05, "length": 0.5},
        {"name": "c", "mass": 1, "centre": [0.1, 0], "inertia": 0.004, "length": 0.2}], "hinges": [
        {"name": "O", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
        {"name": "A", "between": [{"body": "a", "point": [0.2, 0]}, {"body": "b", "point": [0, 0]}]},
        {"name": "B", "between": [{"body": "b", "point": [0.5, 0]}, {"body": "c", "point": [0.2, 0]}]},
        {"name": "C", "between": [{"body": "ground", "point": [0.5, 0]}, {"body": "c", "point": [0, 0]}]}],
        "motors": [{"name": "M", "body": "a", "law": {"start": 0.3, "rate": 5.0}}],
        "outputs": {"T": "M.torque", "FB": "B.force", "x": "b.x", "y": "B.fx"},
        "start": {"a": {"phi": 0.3}, "b": {"phi": 0}, "c": {"phi": 0.3}}, "until": 1, "every": 0.01}"#;
    let fold = (PI - 0.3) / 5.0;
    let resting = [
        r#"{"name": "box", "mass": 1, "centre": [0, 0], "inertia": 0.1}, {"name": "a","#,
        r#""walls": [{"name": "w", "body": "box", "point": [0, 0], "restitution": 0,
            "line": {"through": [0, 0], "normal": [0, 1]}}],
           "start": {"box": {"phi": 0, "omega": 0, "origin": [9, 0], "velocity": [0, 0]},"#,
    ];
    let resting = text.replace(r#"{"name": "a","#, resting[0]).replace(r#""start": {"#, resting[1]);
    // A bar on two pins: one of the four constraints depends on the others.
    let pinned = [
        r#"{"name": "d", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}, {"name": "a","#,
        r#""hinges": [{"name": "Y", "between": [{"body": "ground", "point": [9, 0]},
            {"body": "d", "point": [0, 0]}]},
           {"name": "Z", "between": [{"body": "ground", "point": [10, 0]}, {"body": "d", "point": [1, 0]}]},"#,
        r#""start": {"d": {"phi": 0},"#,
    ];
    let pinned = (text.replace(r#"{"name": "a","#, pinned[0]))
        .replace(r#""hinges": ["#, pinned[1])
        .replace(r#""start": {"#, pinned[2]);
    for (text, until) in [text, &resting, &pinned]
        .into_iter()
        .flat_map(|text| [(text, 1.0), (text, fold), (text, fold + 1e-3)])
    {
        let mut scene = parse_scene(text, "scene", &[]).expect("a scene");
        (scene.until, scene.every) = (until, until);
        let outcome = run(&scene, &adaptive(MethodId::Taylor, 1e-9));
        let [torque, force] = ["T", "FB"].map(|name| found(&outcome.extremes, name));
        assert!((torque.min[0] + 5.886).abs() < 1e-6 && (torque.min[1] - fold).abs() < 1e-6, "{torque:?}");
        assert!(force.max[0] == f64::INFINITY && (force.max[1] - fold).abs() < 1e-6, "{force:?}");
        assert!(force.mean == f64::INFINITY && force.rms == f64::INFINITY && force.min[0] > 0.0, "{force:?}");
        // Along the coupler it changes its sense.
        let along = found(&outcome.extremes, "y");
        let is_passed = along.min[0] == f64::NEG_INFINITY && along.max[0] == f64::INFINITY;
        assert!(is_passed || until == fold, "{along:?}");
        let is_known = outcome.last.outputs.iter().map(|value| value.is_finite()).collect::<Vec<_>>();
        let is_beside = until != fold;
        assert_eq!(is_known, [is_beside, is_beside, true, is_beside]);
    }
}

/// A rod that is longer than its crank by 6e-9 m turns back within 2e-4 rad of the singular position, where
/// forces have peaks of thousands of N: those of the way through are no answer.
#[test]
fn forces_of_a_near_miss_are_not_those_of_a_singular_position() {
    let longer = 0.300_000_006;
    let rod = -(0.3 * 0.3_f64.sin() / longer).asin();
    let text = EQUAL_SLIDER_CRANK
        .replace(
            r#"{"body": "b", "point": [0.3, 0]}"#,
            &format!(r#"{{"body": "b", "point": [{longer}, 0]}}"#),
        )
        .replace(r#""b": {"phi": -0.3}"#, &format!(r#""b": {{"phi": {rod}}}"#))
        .replace(r#""until": 1"#, r#""until": 0.5"#);
    let outcome = run(&parse_scene(&text, "scene", &[]).expect("a scene"), &adaptive(MethodId::Taylor, 1e-9));
    for name in ["T", "S", "FB"] {
        let told = found(&outcome.extremes, name);
        assert!(told.min[0].is_nan() && told.max[0].is_nan() && told.rms.is_nan(), "{told:?}");
    }
    assert!(found(&outcome.extremes, "x").max[0] < 0.6);
}

/// The least force in a hinge lies 0.007 rad beside the position where it is without bound; rows tell it.
#[test]
fn extremes_beside_a_pole_are_found() {
    let text = EQUAL_SLIDER_CRANK
        .replace(r#""gravity": [0, -9.81]"#, r#""gravity": [0, 0]"#)
        .replace(
            r#"{"name": "b", "mass": 1, "centre": [0.15, 0]"#,
            r#"{"name": "b", "mass": 1, "centre": [0.15, 0.01]"#,
        )
        .replace(r#""T": "M.torque""#, r#""FA": "A.force""#)
        .replace(r#""until": 1"#, r#""until": 0.3"#);
    let scene = parse_scene(&text, "scene", &[]).expect("a scene");
    let outcome = run(&scene, &adaptive(MethodId::Taylor, 1e-9));
    let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
    let request = Request { every: Some(2e-5), ..Request::default() };
    let plan = Plan::new(&scene, &mechanism, &request).expect("a plan");
    let rows = Run::new(Arc::clone(&mechanism), plan, Limits::default(), &mechanism.start(&scene));
    let mut least = f64::INFINITY;
    integrate(rows.expect("a run"), &mut |sample| {
        least = least.min(sample.outputs[0]);
        Ok(())
    })
    .expect("samples");
    let told = found(&outcome.extremes, "FA");
    assert!(
        (least - 5e-3..=least).contains(&told.min[0]) && told.max[0] == f64::INFINITY,
        "{told:?} {least}"
    );
}

/// A bar that turns evenly through zero: its angle t - 0.7 tells what is without bound there and what is not.
#[test]
fn poles_and_ends_of_roots_have_their_limits() {
    let text = r#"{"name": "poles", "gravity": [0, 0],
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1}],
        "hinges": [{"name": "H", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}]}],
        "signals": {"x": "b.phi - 0.2"},
        "outputs": {"inverse": "1/b.phi", "faint": "5 + 1e-9/b.phi", "tan": "tan(b.phi + pi/2)", "square": "1/x^2",
            "touch": "1/(1 - b.cos)", "root": "1/sqrt(abs(b.phi))", "log": "log(b.phi)", "end": "1 + sqrt(0.2 - b.phi)",
            "whole": "b.sin/b.phi", "chosen": "if(b.phi > 0.1, 1/b.phi, 3)"},
        "start": {"b": {"phi": -0.7, "omega": 1}}, "until": 2, "every": 2}"#;
    let (inf, free) = (f64::INFINITY, f64::NAN);
    // Least and largest value, when, mean and rms; what is not a number here is not looked at.
    let expected = [
        ("inverse", [-inf, inf], [0.7, 0.7], [f64::NAN, inf]),
        ("faint", [-inf, inf], [0.7, 0.7], [f64::NAN, inf]),
        ("tan", [-inf, inf], [0.7, 0.7], [f64::NAN, inf]),
        ("square", [1.0 / 1.1_f64.powi(2), inf], [2.0, 0.9], [inf, inf]),
        ("touch", [1.0 / (1.0 - 1.3_f64.cos()), inf], [2.0, 0.7], [inf, inf]),
        ("root", [1.0 / 1.3_f64.sqrt(), inf], [2.0, 0.7], [f64::NAN, inf]),
        ("log", [-inf, 1.3_f64.ln()], [0.7, 2.0], [f64::NAN; 2]),
        ("end", [1.0, 1.0 + 0.9_f64.sqrt()], [0.9, 0.0], [f64::NAN; 2]),
        ("whole", [1.3_f64.sin() / 1.3, 1.0], [2.0, free], [free; 2]),
        ("chosen", [1.0 / 1.3, 10.0], [2.0, 0.8], [free; 2]),
    ];
    let is_near = |told: f64, expected: f64| told == expected || (told - expected).abs() < 1e-9;
    for method in [MethodId::Taylor, MethodId::Dp8] {
        let outcome = run(&scene(text), &adaptive(method, 1e-12));
        for (name, values, times, means) in expected {
            let one = found(&outcome.extremes, name);
            for (told, (value, time)) in [one.min, one.max].into_iter().zip(values.into_iter().zip(times)) {
                assert!(is_near(told[0], value), "{method:?} {name}: {one:?}");
                assert!(time.is_nan() || is_near(told[1], time), "{method:?} {name}: {one:?}");
            }
            let is_like = |told: f64, mean: f64| told.is_nan() && mean.is_nan() || told == mean;
            let is_known = name != "whole" && name != "chosen";
            let like = is_like(one.mean, means[0]) && is_like(one.rms, means[1]);
            assert_eq!(like, is_known, "{method:?} {name}: {one:?}");
        }
        // The integral of sin(x)/x up to 0.7 and 1.3, by its series, and of 1/x.
        let series = |x: f64| {
            (0..12).fold((0.0, x), |(sum, term), k| {
                let n = f64::from(2 * k + 1);
                (sum + term / n, -term * x * x / ((n + 1.0) * (n + 2.0)))
            })
        };
        let [whole, chosen] = ["whole", "chosen"].map(|name| found(&outcome.extremes, name).mean);
        // Next to a pole of another output a share of 1e-7 of the part is left out.
        assert!((whole - 0.5 * (series(0.7).0 + series(1.3).0)).abs() < 1e-7, "{whole}");
        assert!((chosen - 0.5 * (2.4 + 13.0_f64.ln())).abs() < 1e-6, "{chosen}");
    }
}

/// A root of what becomes negative has no mean.
#[test]
fn what_has_no_value_at_some_times_has_no_mean() {
    let text =
        EQUAL_SLIDER_CRANK.replace(r#""T": "M.torque""#, r#""T": "sqrt(0.5 s - t)", "N": "sqrt(-1 s - t)""#);
    let outcome = run(&parse_scene(&text, "scene", &[]).expect("a scene"), &adaptive(MethodId::Taylor, 1e-9));
    let [later, never] = ["T", "N"].map(|name| found(&outcome.extremes, name));
    assert!(later.mean.is_nan() && later.rms.is_nan() && later.max[0] > 0.7, "{later:?}");
    assert!([never.min[0], never.max[0], never.mean, never.rms].into_iter().all(f64::is_nan), "{never:?}");
}

/// A ball dropped by h comes to rest after h, and (1 + e)/(1 - e) times as long, and weighs on its floor from then on.
#[test]
fn a_ball_does_not_weigh_on_its_floor_before_its_bounces_end() {
    for e in [0.5, 0.9, 0.99] {
        let text = format!(
            r#"{{"name": "ball", "gravity": [0, -10], "bars": [{{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1}}],
            "walls": [{{"name": "W", "body": "b", "point": [0, 0], "restitution": {e},
                "line": {{"through": [0, 0], "normal": [0, 1]}}}}],
            "outputs": {{"F": "W.force"}}, "start": {{"b": {{"phi": 0, "origin": [0, 0.00005]}}}}, "until": 0.7, "every": 0.1}}"#
        );
        let end = (2.0 * 0.00005 / 10.0_f64).sqrt() * (1.0 + e) / (1.0 - e);
        for (method, tolerance) in
            [(MethodId::Taylor, 1e-12), (MethodId::Dp8, 1e-10), (MethodId::Radau(5), 1e-10)]
        {
            let outcome = run(&scene(&text), &adaptive(method, tolerance));
            let [force] = outcome.extremes.as_slice() else { panic!("{:?}", outcome.extremes) };
            let share = (0.7 - end) / 0.7;
            assert!(
                (force.mean - 10.0 * share).abs() < 1e-9,
                "{method} {e}: {} {}",
                force.mean,
                10.0 * share
            );
            assert!((force.rms - 10.0 * share.sqrt()).abs() < 1e-9, "{method} {e}: {}", force.rms);
        }
    }
}
