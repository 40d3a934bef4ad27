//! Singular positions are a matter of geometry: light members and long levers make none, and those there are
//! are passed on the right branch.
//!
//! Random linkages are checked by the singular values of their loop equations, scaled to unit columns, so
//! that they are known to be regular without the program; their accelerations by the equations of Newton and
//! Euler for every body by itself, joints as constraints, in double-double.

use crate::common;

use common::run;
use driftless::arithmetic::{DoubleDouble, Scalar};
use driftless::dynamics::kernel::{Bias, Kernel};
use driftless::dynamics::looped::Looped;
use driftless::dynamics::{Form, Mechanism, OdeSystem, Time};
use driftless::run::{Outcome, Request, Status, Sweep};
use driftless::scene::{Scene, Template, parse_scene};
use driftless::stepping::Cause;
use serde_json::{Value, json};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

fn by(method: &str, rtol: f64) -> Request {
    Request { method: Some(method.parse().expect("a method")), rtol: Some(rtol), ..Request::default() }
}

fn parsed(text: &str) -> Scene {
    parse_scene(text, "scene", &[]).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Random numbers that are the same on every machine.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * self.next()
    }

    /// A ratio down to 1e-9 now and then, else one.
    fn ratio(&mut self) -> f64 {
        if self.next() < 0.5 { 1.0 } else { 10_f64.powf(-9.0 * self.next()) }
    }
}

/// Solves a linear system: rows and columns scaled to one, the largest pivot of all first.
fn solve(mut matrix: Vec<Vec<DoubleDouble>>) -> Vec<f64> {
    let n = matrix.len();
    let mut column = vec![1.0; n];
    for _ in 0..4 {
        for row in &mut matrix {
            let most = row[..n].iter().map(|x| x.hi.abs()).fold(0.0, f64::max);
            // Powers of two round nothing.
            let factor = most.log2().round().exp2().recip();
            row.iter_mut().for_each(|x| *x = x.ldexp(factor));
        }
        for (k, column) in column.iter_mut().enumerate() {
            let most = matrix.iter().map(|row| row[k].hi.abs()).fold(0.0, f64::max);
            let factor = most.log2().round().exp2().recip();
            matrix.iter_mut().for_each(|row| row[k] = row[k].ldexp(factor));
            *column *= factor;
        }
    }
    let mut order: Vec<usize> = (0..n).collect();
    for p in 0..n {
        let all = (p..n).flat_map(|i| (p..n).map(move |k| (i, k)));
        let size = |&(i, k): &(usize, usize)| matrix[i][k].hi.abs();
        let (i, k) = all.max_by(|a, b| size(a).total_cmp(&size(b))).expect("a pivot");
        matrix.swap(p, i);
        matrix.iter_mut().for_each(|row| row.swap(p, k));
        order.swap(p, k);
        let pivot = matrix[p].clone();
        for row in &mut matrix[p + 1..] {
            let factor = row[p] / pivot[p];
            row.iter_mut().zip(&pivot).skip(p).for_each(|(x, &pivot)| *x -= factor * pivot);
        }
    }
    let mut x = vec![DoubleDouble::ZERO; n];
    for p in (0..n).rev() {
        let rest = (p + 1..n).fold(matrix[p][n], |rest, k| rest - matrix[p][k] * x[k]);
        x[p] = rest / matrix[p][p];
    }
    let mut found = vec![0.0; n];
    for (p, x) in order.into_iter().zip(x) {
        found[p] = x.hi * column[p];
    }
    found
}

/// Angular accelerations \[rad/s²\] of bodies on hinges and ground rails: m x'' = F + Jᵀ λ for every body by
/// itself.
fn reference(scene: &Value, phi: &[f64], omega: &[f64]) -> Vec<f64> {
    let bars = scene["bars"].as_array().expect("bars");
    let of = |value: &Value| DoubleDouble::of(value.as_f64().expect("a number"));
    let vector = |value: &Value| [of(&value[0]), of(&value[1])];
    let number = |name: &Value| bars.iter().position(|bar| bar["name"] == *name);
    let turn = |k: usize, [x, y]: [DoubleDouble; 2]| {
        let (sin, cos) = DoubleDouble::of(phi[k]).sin_cos();
        [cos * x - sin * y, sin * x + cos * y]
    };
    // Rows: constraint derivatives by (x, y, phi) of the centres, and what they are to come to.
    let (n, mut rows) = (3 * bars.len(), Vec::new());
    let mut add = |directions: &[[DoubleDouble; 2]], ends: [&Value; 2]| {
        for direction in directions {
            let mut row = vec![DoubleDouble::ZERO; n + 1];
            for (end, sign) in ends.iter().zip([DoubleDouble::ONE, -DoubleDouble::ONE]) {
                let Some(k) = number(&end["body"]) else { continue };
                let (point, centre, w) =
                    (vector(&end["point"]), vector(&bars[k]["centre"]), DoubleDouble::of(omega[k]));
                let arm = turn(k, [point[0] - centre[0], point[1] - centre[1]]);
                row[3 * k] += sign * direction[0];
                row[3 * k + 1] += sign * direction[1];
                row[3 * k + 2] += sign * (direction[1] * arm[0] - direction[0] * arm[1]);
                row[n] += sign * (w * w) * (direction[0] * arm[0] + direction[1] * arm[1]);
            }
            rows.push(row);
        }
    };
    let axes = [[DoubleDouble::ONE, DoubleDouble::ZERO], [DoubleDouble::ZERO, DoubleDouble::ONE]];
    for hinge in scene["hinges"].as_array().expect("hinges") {
        add(&axes, [&hinge["between"][0], &hinge["between"][1]]);
    }
    for slider in scene["sliders"].as_array().into_iter().flatten() {
        let [x, y] = vector(&slider["rail"]["direction"]);
        add(&[[-y, x]], [&slider["point"], &json!({"body": "ground"})]);
    }
    let size = n + rows.len();
    let mut matrix = vec![vec![DoubleDouble::ZERO; size + 1]; size];
    for (k, bar) in bars.iter().enumerate() {
        let mass = of(&bar["mass"]);
        for (axis, inertia) in [mass, mass, of(&bar["inertia"])].into_iter().enumerate() {
            matrix[3 * k + axis][3 * k + axis] = inertia;
        }
        for axis in 0..2 {
            matrix[3 * k + axis][size] = mass * of(&scene["gravity"][axis]);
        }
    }
    for (r, row) in rows.iter().enumerate() {
        for (k, &entry) in row[..n].iter().enumerate() {
            (matrix[n + r][k], matrix[k][n + r]) = (entry, entry);
        }
        matrix[n + r][size] = row[n];
    }
    let found = solve(matrix);
    (0..bars.len()).map(|k| found[3 * k + 2]).collect()
}

/// Kinds of linkages: their links from the ground to the ground, or to a rail.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    FourBar,
    SliderCrank,
    /// A slider-crank with a block of its own on the rail.
    Block,
    FiveBar,
}

/// The least singular value of the loop's equations at these angles, links of length one: how far they are
/// from a singular position.
fn regularity(kind: Kind, phi: &[f64]) -> f64 {
    if matches!(kind, Kind::SliderCrank | Kind::Block) {
        return phi[0].cos().hypot(phi[1].cos()) / 2.0_f64.sqrt();
    }
    // Singular values of the 2 × n matrix of unit vectors: (n ± |Σ e^{2 i phi}|) / 2, over their mean.
    let n = phi.len() as f64;
    let (sin, cos) =
        phi.iter().fold((0.0, 0.0), |(s, c), phi| (s + (2.0 * phi).sin(), c + (2.0 * phi).cos()));
    (1.0 - sin.hypot(cos) / n).max(0.0).sqrt()
}

/// A linkage with light members, a short crank and a long lever, at a regular position.
fn linkage(random: &mut Random) -> (Kind, Value) {
    let kind =
        [Kind::FourBar, Kind::SliderCrank, Kind::Block, Kind::FiveBar][(4.0 * random.next()) as usize % 4];
    let names: &[&str] = match kind {
        Kind::FourBar => &["a", "k", "c"],
        Kind::SliderCrank => &["a", "k"],
        Kind::Block => &["a", "k", "b"],
        Kind::FiveBar => &["a", "k", "l", "c"],
    };
    let phi = loop {
        let phi: Vec<f64> = names.iter().map(|_| random.between(-3.1, 3.1)).collect();
        if regularity(kind, &phi) > 0.5 {
            break phi;
        }
    };
    let short = random.ratio();
    let length: Vec<f64> =
        (0..names.len()).map(|i| random.between(0.5, 1.5) * if i == 0 { short } else { 1.0 }).collect();
    let heavy = (random.next() * names.len() as f64) as usize;
    let mut bars = Vec::new();
    for (i, name) in names.iter().enumerate() {
        let mass = if i == heavy { 1.0 } else { random.ratio() };
        // The lever of a body is how far its joint is from its centre, in radii of gyration.
        let radius = random.between(0.2, 0.6) * if random.next() < 0.3 { random.ratio().sqrt() } else { 1.0 };
        let is_block = kind == Kind::Block && i == 2;
        let centre = if is_block {
            [0.0, 0.0]
        } else {
            [length[i] * random.between(0.2, 0.8), length[i] * random.between(-0.2, 0.2)]
        };
        bars.push(
            json!({"name": name, "mass": mass, "centre": centre, "inertia": mass * (length[i] * radius).powi(2), "length": length[i]}),
        );
    }
    let place = |name: &str, x: f64, y: f64| json!({"body": name, "point": [x, y]});
    let mut hinges = vec![json!({"name": "O", "between": [place("ground", 0.0, 0.0), place("a", 0.0, 0.0)]})];
    let is_sliding = matches!(kind, Kind::SliderCrank | Kind::Block);
    let links = if is_sliding { names.len() } else { names.len() - 1 };
    for i in 1..links {
        hinges.push(json!({"name": format!("h{i}"), "between": [place(names[i - 1], length[i - 1], 0.0), place(names[i], 0.0, 0.0)]}));
    }
    let tip = (0..if kind == Kind::Block { 2 } else { links })
        .fold([0.0, 0.0], |[x, y], i| [x + length[i] * phi[i].cos(), y + length[i] * phi[i].sin()]);
    let mut sliders = Vec::new();
    if is_sliding {
        let rail = json!({"body": "ground", "point": [0.0, tip[1]], "direction": [1.0, 0.0]});
        let point = if kind == Kind::Block { place("b", 0.0, 0.0) } else { place("k", length[1], 0.0) };
        sliders.push(json!({"name": "s", "point": point, "rail": rail}));
    } else {
        let last = names.len() - 1;
        let origin_point = [tip[0] - length[last] * phi[last].cos(), tip[1] - length[last] * phi[last].sin()];
        hinges.push(json!({"name": "tip", "between": [place(names[last - 1], length[last - 1], 0.0), place("c", length[last], 0.0)]}));
        hinges.push(json!({"name": "C", "between": [place("ground", origin_point[0], origin_point[1]), place("c", 0.0, 0.0)]}));
    }
    let mut start = serde_json::Map::new();
    for (i, name) in names.iter().enumerate() {
        start.insert((*name).into(), json!({"phi": phi[i]}));
    }
    let spin = random.between(-2.0, 2.0);
    start["a"]["omega"] = spin.into();
    if kind == Kind::Block {
        start["b"]["omega"] = 0.3.into();
    }
    if kind == Kind::FiveBar {
        start["c"]["omega"] = random.between(-2.0, 2.0).into();
    }
    let scene = json!({"name": "regular", "gravity": [0.0, -9.81], "bars": bars, "hinges": hinges, "sliders": sliders, "start": start,
        "until": 1.0, "every": 0.1});
    (kind, scene)
}

/// Accelerations at a position, by the angle form and where it fits by natural coordinates; true if no
/// constraint is left out or called singular.
fn accelerations(mechanism: &Arc<Mechanism>, phi: &[f64], omega: &[f64]) -> (Vec<Vec<f64>>, bool) {
    let mut kernel = Kernel::<f64>::new(mechanism);
    kernel.accelerations(mechanism, Time::default(), phi, omega, Bias::default());
    let rows = mechanism.constraints.len();
    let is_sound = (0..rows).all(|r| !kernel.is_left_out(r)) && kernel.weakest.share > 1e-2;
    let mut found = vec![kernel.load.clone()];
    if let Some(mut looped) = Looped::new(Arc::clone(mechanism)) {
        let n = phi.len();
        let mut y: Vec<f64> = phi.iter().chain(omega).copied().collect();
        y.resize(looped.dimension(), 0.0);
        let mut rate = y.clone();
        looped.rhs(Time::default(), &y, &mut rate);
        assert_eq!(looped.mechanism().coordinates(), n);
        found.push(rate[n..2 * n].to_vec());
    }
    (found, is_sound)
}

/// The largest difference of accelerations, over the largest of those, and of squared rates, of links of that
/// length.
fn difference(scene: &Value, found: &[f64], expected: &[f64], omega: &[f64]) -> f64 {
    let lengths =
        scene["bars"].as_array().expect("bars").iter().map(|bar| bar["length"].as_f64().expect("a length"));
    let of = |a: &[f64], k: usize, length: f64| a[k].abs() * length;
    let lengths: Vec<f64> = lengths.collect();
    let most = lengths
        .iter()
        .enumerate()
        .map(|(k, &length)| of(expected, k, length) + omega[k] * omega[k] * length)
        .fold(0.0, f64::max);
    let off = lengths
        .iter()
        .enumerate()
        .map(|(k, &length)| (found[k] - expected[k]).abs() * length)
        .fold(0.0, f64::max);
    off / most
}

/// What went wrong in random regular linkages.
#[derive(Debug, Default)]
struct Count {
    linkages: usize,
    left_out: usize,
    stopped: Vec<String>,
    apart: Vec<String>,
    accelerations: f64,
}

fn regular_linkages(wanted: usize, seed: u64) -> Count {
    let (mut random, mut count) = (Random(seed), Count::default());
    while count.linkages < wanted {
        let (kind, mut scene) = linkage(&mut random);
        let parsed_scene = parsed(&scene.to_string());
        let mechanism = Arc::new(Mechanism::new(&parsed_scene).expect("a mechanism"));
        let start = mechanism.start(&parsed_scene);
        let phi: Vec<f64> = start.phi.iter().map(|phi| phi.hi).collect();
        let omega: Vec<f64> = start.omega.iter().map(|omega| omega.hi).collect();
        let expected = reference(&scene, &phi, &omega);
        let (found, is_sound) = accelerations(&mechanism, &phi, &omega);
        // About as long as the fastest link needs for half a turn.
        let step_size =
            expected.iter().zip(&omega).fold(1.0, |most: f64, (a, w)| most.max(a.abs().sqrt()).max(w.abs()));
        let until = 1.5 / step_size;
        (scene["until"], scene["every"]) = (until.into(), (until / 16.0).into());
        let scene_run = parsed(&scene.to_string());
        let mut least = f64::INFINITY;
        let outcomes = [("taylor", 1e-11), ("dp8", 1e-11)].map(|(method, rtol)| {
            let plan = by(method, rtol);
            let outcome = common::run_from(&scene_run, &mechanism, &plan, Default::default(), &start);
            least = least.min(regularity(kind, &outcome.last.phi));
            outcome
        });
        // The way there may lead through a singular position by itself: that is for another test.
        let middle =
            run(&Scene { until: 0.5 * until, every: 0.5 * until, ..scene_run.clone() }, &by("dp8", 1e-9));
        if least.min(regularity(kind, &middle.last.phi)) < 0.2 {
            continue;
        }
        count.linkages += 1;
        count.left_out += usize::from(!is_sound);
        for found in &found {
            let off = difference(&scene, found, &expected, &omega);
            count.accelerations = count.accelerations.max(if off.is_nan() { f64::INFINITY } else { off });
        }
        for outcome in &outcomes {
            if let Some(stop) = &outcome.stop {
                count.stopped.push(format!("{kind:?} {stop}\n{scene}"));
            }
            if outcome.drift.energy.max.is_nan() || outcome.drift.energy.max >= 1e-7 {
                count.apart.push(format!(
                    "{kind:?} energy {:.1e} by {}\n{scene}",
                    outcome.drift.energy.max, outcome.plan.method
                ));
            }
        }
        let [one, other] = &outcomes;
        if one.stop.is_none() && other.stop.is_none() {
            let length = |k: usize| scene["bars"][k]["length"].as_f64().expect("a length");
            // Rounding of the other links' angles turns a crank of a millionth of their length by its
            // inverse: of that one it is known where its end is.
            let weight = |k: usize| if length(k) < 1e-6 { length(k) } else { 1.0 };
            let off = (0..one.last.phi.len())
                .map(|k| (one.last.phi[k] - other.last.phi[k]).abs() * weight(k))
                .fold(0.0, f64::max);
            if off.is_nan() || off >= 1e-7 {
                count.apart.push(format!("{kind:?} {off:.1e} rad\n{scene}"));
            }
        }
    }
    count
}

fn assert_regular(count: &Count) {
    println!(
        "{} regular linkages: {} with a constraint left out or a false singular position, {} stopped, {} disagree, accelerations {:.1e} off at most",
        count.linkages,
        count.left_out,
        count.stopped.len(),
        count.apart.len(),
        count.accelerations
    );
    assert_eq!(count.left_out, 0);
    assert!(count.stopped.is_empty(), "{}", count.stopped.join("\n"));
    assert!(count.apart.is_empty(), "{}", count.apart.join("\n"));
    assert!(count.accelerations < 1e-8, "{:.1e}", count.accelerations);
}

/// Mass ratios, short cranks and levers to 1e-9.
#[test]
fn a_thousand_linkages_with_light_members_and_long_levers_have_no_singular_position() {
    assert_regular(&regular_linkages(1000, 2));
}

/// A four-bar with a coupler of a billionth of the other masses has the accelerations of the limit without
/// its mass, worked out by hand: the coupler is a rod.
#[test]
fn a_light_coupler_is_a_rod_without_mass() {
    let text = include_str!("data/light_coupler.json");
    let value: Value = serde_json::from_str(text).expect("valid JSON");
    let scene = parsed(text);
    let mechanism = Arc::new(Mechanism::new(&scene).expect("a mechanism"));
    let start = mechanism.start(&scene);
    let phi: Vec<f64> = start.phi.iter().map(|phi| phi.hi).collect();
    let omega: Vec<f64> = start.omega.iter().map(|omega| omega.hi).collect();
    let expected = reference(&value, &phi, &omega);
    assert!((expected[0] + 9.754_882).abs() < 1e-5, "{expected:?}");
    let (found, is_sound) = accelerations(&mechanism, &phi, &omega);
    assert!(is_sound);
    for found in found {
        assert!(difference(&value, &found, &expected, &omega) < 1e-12, "{found:?} {expected:?}");
    }
    // One equation for the angle of the crank: the energy of crank and rocker, the rocker's angle by the
    // loop.
    let outcomes = ["taylor", "dp8"].map(|method| run(&scene, &by(method, 1e-11)));
    for outcome in &outcomes {
        assert_eq!(outcome.stop, None);
        assert!(outcome.drift.energy.max < 1e-9);
        assert!((outcome.last.phi[0] - outcomes[0].last.phi[0]).abs() < 1e-8);
    }
}

/// Two linkages in which a power series saw singular positions that are none, against Dormand and Prince's
/// method, which takes ordinary steps.
#[test]
fn a_series_does_not_leap_where_nothing_is_singular() {
    for text in [include_str!("data/coupled_plates.json"), include_str!("data/light_sliders.json")] {
        let scene = parsed(text);
        let expected = run(&scene, &by("dp8", 1e-12));
        assert_eq!(expected.stop, None);
        for rtol in [1e-7, 1e-9, 1e-11] {
            let outcome = run(&scene, &by("taylor", rtol));
            assert_eq!(outcome.stop, None, "{rtol:e}");
            let off = outcome
                .last
                .phi
                .iter()
                .zip(&expected.last.phi)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            assert!(off < 100.0 * rtol, "{rtol:e}: {off:.1e} rad off");
        }
    }
}

/// A four-bar with two links together as long as the others, on its way to the position with all links in
/// line, and whether it is a parallelogram; `None` where the lengths do not close.
fn change_point(random: &mut Random) -> Option<(bool, Value)> {
    let (a, k) = (random.between(0.3, 1.0), random.between(0.5, 1.5));
    // A parallelogram now and then, of which the coupler stays parallel; else the sum of two links is that of
    // the others.
    let is_parallelogram = random.next() < 0.3;
    let c = if is_parallelogram { a } else { random.between(0.4, 1.4) };
    let ground = if is_parallelogram {
        k
    } else {
        [a + k - c, c + k - a, a + c - k][(3.0 * random.next()) as usize % 3]
    };
    let bar = |name: &str, length: f64, mass: f64| json!({"name": name, "mass": mass, "centre": [0.5 * length, 0.0], "inertia": mass * length * length / 12.0, "length": length});
    let bars = [
        bar("a", a, random.between(0.2, 2.0)),
        bar("k", k, random.between(0.2, 2.0)),
        bar("c", c, random.between(0.2, 2.0)),
    ];
    let (angle, side) = (
        random.between(0.6, 2.4) * if random.next() < 0.5 { 1.0 } else { -1.0 },
        if random.next() < 0.5 { 1.0 } else { -1.0 },
    );
    let (x, y) = (ground - a * angle.cos(), -a * angle.sin());
    let distance = x.hypot(y);
    let bend = ((k * k + distance * distance - c * c) / (2.0 * k * distance)).clamp(-2.0, 2.0).acos();
    let coupler = if is_parallelogram { 0.0 } else { y.atan2(x) + side * bend };
    let end = [a * angle.cos() + k * coupler.cos() - ground, a * angle.sin() + k * coupler.sin()];
    let place = |name: &str, x: f64| json!({"body": name, "point": [x, 0.0]});
    let hinges = json!([
        {"name": "O", "between": [place("ground", 0.0), place("a", 0.0)]},
        {"name": "A", "between": [place("a", a), place("k", 0.0)]},
        {"name": "B", "between": [place("k", k), place("c", c)]},
        {"name": "C", "between": [place("ground", ground), place("c", 0.0)]},
    ]);
    let start = json!({"a": {"phi": angle, "omega": random.between(1.0, 4.0) * -angle.signum()}, "k": {"phi": coupler}, "c": {"phi": end[1].atan2(end[0])}});
    let scene = json!({"name": "change_point", "gravity": [0.0, 0.0], "bars": bars, "hinges": hinges, "start": start, "until": 4.0, "every": 0.05});
    (ground > 0.1 && (is_parallelogram || bend.is_finite())).then_some((is_parallelogram, scene))
}

/// The branch a run is on: energy and constraints, and of a parallelogram the coupler.
fn keeps_its_branch(outcome: &Outcome, is_parallelogram: bool, last: &[f64]) -> bool {
    let apart = outcome.drift.constraints.iter().map(|(_, monitors)| monitors[0].max).fold(0.0, f64::max);
    let off = outcome.last.phi.iter().zip(last).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    outcome.drift.energy.max < 1e-5
        && apart < 1e-6
        && off < 1e-4
        && (!is_parallelogram || outcome.last.phi[1].abs() < 1e-5)
}

fn change_points(wanted: usize, seed: u64) {
    let mut random = Random(seed);
    let (mut passed, mut stopped, mut seen, mut near) = (0, 0, 0, 0);
    while seen < wanted {
        let Some((is_parallelogram, scene)) = change_point(&mut random) else { continue };
        let scene = parsed(&scene.to_string());
        if Mechanism::new(&scene).is_err() {
            continue;
        }
        seen += 1;
        let finest = run(&scene, &by("taylor", 1e-12));
        near += usize::from(finest.drift.singular.is_some());
        for (method, rtol) in [("taylor", 1e-9), ("taylor", 1e-11), ("dp8", 1e-10)] {
            let outcome = run(&scene, &by(method, rtol));
            if let Some(stop) = &outcome.stop {
                let typed = [Cause::BranchLost, Cause::ProjectionFailed, Cause::StepTooSmall];
                assert!(typed.contains(&stop.cause), "{stop}\n{scene:?}");
                assert!(!(method == "taylor" && stop.to_string().contains("--method taylor")), "{stop}");
                stopped += 1;
            } else if finest.stop.is_none() {
                assert!(
                    keeps_its_branch(&outcome, is_parallelogram, &finest.last.phi),
                    "{method} {rtol:e}: {:?}\n{:?}\n{scene:?}",
                    outcome.last.phi,
                    finest.last.phi
                );
                passed += 1;
            }
        }
    }
    println!(
        "{seen} change points, {near} near a singular position: {passed} runs passed, {stopped} stopped"
    );
    assert!(stopped * 20 < passed, "{passed} passed, {stopped} stopped");
}

#[test]
fn two_hundred_change_points_are_passed_on_the_right_branch() {
    change_points(200, 4);
}

/// Generalized mass and potential energy of the kite at an angle of its crank, from the place of the hinge
/// between coupler and rocker on the branch that is smooth where it folds.
fn kite_at(crank: f64) -> (f64, f64) {
    let (sine, cosine) = crank.sin_cos();
    // From the crank's end to the ground pivot at (2, 0): squared, and the way to the hinge along and across.
    let square = 5.0 - 4.0 * cosine;
    let slope = 4.0 * sine;
    let (along, across) = (0.5 - 1.5 / square, 2.0 * sine / square);
    let along_slope = 1.5 * slope / (square * square);
    let across_slope = (2.0 * cosine - across * slope) / square;
    let coupler = [along * (2.0 - cosine) + across * sine, -along * sine + across * (2.0 - cosine)];
    let coupler_slope = [
        along_slope * (2.0 - cosine) + along * sine + across_slope * sine + across * cosine,
        -along_slope * sine - along * cosine + across_slope * (2.0 - cosine) + across * sine,
    ];
    let rocker = [0.5 * (cosine + coupler[0] - 2.0), 0.5 * (sine + coupler[1])];
    let rocker_slope = [0.5 * (coupler_slope[0] - sine), 0.5 * (coupler_slope[1] + cosine)];
    let turned = |at: [f64; 2], slope: [f64; 2]| at[0] * slope[1] - at[1] * slope[0];
    let (coupler_rate, rocker_rate) = (turned(coupler, coupler_slope), turned(rocker, rocker_slope));
    let middle = [0.5 * coupler_slope[0] - sine, 0.5 * coupler_slope[1] + cosine];
    let mass = 1.0 / 3.0
        + coupler_rate * coupler_rate / 12.0
        + middle[0] * middle[0]
        + middle[1] * middle[1]
        + rocker_rate * rocker_rate * 8.0 / 3.0;
    let potential = 9.81 * (1.5 * sine + 0.5 * coupler[1] + 2.0 * rocker[1]);
    (mass, potential)
}

/// The kite's crank after `until` \[s\], from a quarter turn and a rate: its energy alone, by the classical
/// Runge-Kutta method.
fn kite_after(rate: f64, until: f64) -> f64 {
    let (mass, potential) = kite_at(std::f64::consts::FRAC_PI_2);
    let energy = 0.5 * mass * rate * rate + potential;
    let rate = |crank: f64| {
        let (mass, potential) = kite_at(crank);
        (2.0 * (energy - potential) / mass).sqrt()
    };
    let steps = 20_000;
    let h = until / f64::from(steps);
    (0..steps).fold(std::f64::consts::FRAC_PI_2, |crank, _| {
        let k1 = rate(crank);
        let k2 = rate(crank + 0.5 * h * k1);
        let k3 = rate(crank + 0.5 * h * k2);
        let k4 = rate(crank + h * k3);
        crank + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    })
}

/// Steps that would end just where the kite folds end before it, in runs and where points of a sweep are alone.
#[test]
fn no_step_ends_where_the_kite_folds() {
    let text = std::fs::read_to_string("examples/scenes/kite.json").expect("a shipped scene");
    let scene = |rate: f64, until: f64| {
        let mut scene: Value = serde_json::from_str(&text).expect("a scene");
        scene["start"]["crank"]["omega"] = json!(rate);
        Scene { until, every: until, ..parsed(&scene.to_string()) }
    };
    for rate in [7.499_659, 6.755_904, 8.049_233] {
        let outcome = run(&scene(rate, 3.0), &by("taylor", 1e-9));
        let off = (outcome.last.phi[0] - kite_after(rate, 3.0)).abs();
        assert!(outcome.stop.is_none() && off < 1e-7, "{rate}: off by {off:.1e} rad, {:?}", outcome.stop);
    }
    let vary = ["crank.omega=6..10:9".parse().expect("a range")].to_vec();
    let template = Template::read("examples/scenes/kite.json".as_ref(), &[]).expect("a shipped scene");
    let request = Request { until: Some(2.0), every: Some(0.25), ..by("taylor", 1e-9) };
    let plan = Sweep::new(&template, vary, &request).expect("a sweep");
    for index in 0..9 {
        let point = plan.point(index).expect("a point");
        let off = (point.phi[0] - kite_after(point.values[0], 2.0)).abs();
        assert!(point.status == Status::Done && off < 1e-7, "off by {off:.1e} rad, {point:?}");
    }
}

/// Two wheels with two coupling rods a quarter turn apart, the first wheel turned steadily, a load on the
/// second: one constraint is redundant, each rod's loop is singular twice a turn, and both together never
/// are.
fn coupled_wheels() -> Scene {
    let bar = |name: &str, mass: f64, centre: f64, inertia: f64, length: f64| json!({"name": name, "mass": mass, "centre": [centre, 0], "inertia": inertia, "length": length});
    let hinge = |name: &str, a: (&str, [f64; 2]), b: (&str, [f64; 2])| {
        let at = |(body, point): (&str, [f64; 2])| json!({"body": body, "point": point});
        json!({"name": name, "between": [at(a), at(b)]})
    };
    let (zero, rod) = ([0.0, 0.0], [0.5, 0.0]);
    parsed(
        &json!({
            "name": "coupled_wheels", "gravity": [0, -9.81],
            "bars": [bar("a", 1.0, 0.0, 0.02, 0.2), bar("c", 1.0, 0.0, 0.02, 0.2),
                     bar("b1", 2.0, 0.25, 0.05, 0.5), bar("b2", 2.0, 0.25, 0.05, 0.5)],
            "hinges": [hinge("O", ("ground", zero), ("a", zero)), hinge("C", ("ground", rod), ("c", zero)),
                       hinge("A1", ("a", [0.2, 0.0]), ("b1", zero)),
                       hinge("B1", ("b1", rod), ("c", [0.2, 0.0])),
                       hinge("A2", ("a", [0.0, 0.2]), ("b2", zero)),
                       hinge("B2", ("b2", rod), ("c", [0.0, 0.2]))],
            "motors": [{"name": "M", "body": "a", "law": {"start": 0.3, "rate": 5.0}}],
            "torques": [{"name": "load", "body": "c", "torque": "-3 - 0.1*c.omega"}],
            "outputs": {"T": "M.torque"},
            "start": {"a": {"phi": 0.3}, "c": {"phi": 0.3}, "b1": {"phi": 0}, "b2": {"phi": 0}},
            "until": 1.3, "every": 0.1,
        })
        .to_string(),
    )
}

/// The motor's torque by the power of the load and of the rods' weight.
fn torque_of_coupled_wheels(angle: f64) -> f64 {
    3.5 + 2.0 * 9.81 * 0.2 * (angle.cos() - angle.sin())
}

/// Which of redundant constraints are kept is a matter of the position: no choice is independent over a turn.
#[test]
fn redundant_constraints_are_independent_wherever_the_linkage_is_regular() {
    let scene = coupled_wheels();
    let by_matrices = Mechanism::new(&scene).expect("a mechanism");
    for mechanism in [by_matrices.body_by_body(), by_matrices] {
        let mut kernel = Kernel::<f64>::new(&mechanism);
        for quarter in 0..4 {
            for off in [0.3, 1e-2, -1e-3, 1.2e-4, -1e-4, 1e-5, 1e-6, 1e-8, 0.0] {
                let angle = FRAC_PI_2 * f64::from(quarter) + off;
                let (phi, omega) = ([angle, angle, 0.0, 0.0], [5.0, 5.0, 0.0, 0.0]);
                kernel.accelerations(&mechanism, Time::default(), &phi, &omega, Bias::default());
                let torque = -kernel.multiplier[0];
                let error = (torque - torque_of_coupled_wheels(angle)).abs();
                assert!(error < 1e-12, "{quarter} quarters and {off:e}: torque off by {error:.1e} N·m");
                let left_out = (0..mechanism.constraints.len()).filter(|&r| kernel.is_left_out(r)).count();
                assert!(left_out == 1 && kernel.weakest.share > 1e-2, "{left_out}, {:?}", kernel.weakest);
            }
        }
    }
    for rtol in [1e-9, 1e-12, 1e-15] {
        let outcome = run(&scene, &by("taylor", rtol));
        let off = outcome.last.outputs[0] - torque_of_coupled_wheels(outcome.last.phi[0]);
        assert!(outcome.stop.is_none() && off.abs() < 1e-12, "{rtol:e}: {off:.1e}, {:?}", outcome.stop);
        let [steps, drift] = [outcome.statistics.steps as f64, outcome.drift.energy.max];
        assert!(steps < 40.0 && drift < 30.0 * rtol.max(1e-15), "{rtol:e}: {steps} steps, {drift:.1e}");
    }
}

/// Methods that do not leap make the same way in steps that leave constraints out: what these would have given
/// the links comes from the motor, too.
#[test]
fn a_driven_linkage_keeps_its_energy_balance_where_constraints_are_left_out() {
    let scene = Scene { until: 1.0, ..parsed(include_str!("data/driven_parallelogram.json")) };
    let exact = run(&scene, &by("taylor", 1e-12)).last;
    for (method, rtol) in [("dp5", 1e-10), ("dp8", 1e-12), ("radau5", 1e-9), ("radau9", 1e-12)] {
        let outcome = run(&scene, &by(method, rtol));
        assert_eq!(outcome.stop, None, "{method}");
        let (drift, scale) = (outcome.drift.energy.max, exact.kinetic.max(exact.work.abs()));
        let off = (outcome.last.work - exact.work).abs() / scale;
        assert!(drift < 1e-7 && off < 1e-7, "{method}: {drift:.1e}, work off by {off:.1e}");
    }
}

/// A crank driven steadily through positions with all links in line: the work of its motor is that of the
/// weights, whose energy the passages keep as well as other steps do.
#[test]
fn a_driven_linkage_keeps_its_energy_balance_through_singular_positions() {
    let texts =
        [include_str!("data/driven_parallelogram.json"), include_str!("data/driven_slider_crank.json")];
    for text in texts {
        let scene = Scene { until: 3.0, ..parsed(text) };
        for rtol in [1e-9, 1e-12, 1e-15] {
            let outcome = run(&scene, &by("taylor", rtol));
            assert_eq!(outcome.stop, None, "{}: {rtol:e}", scene.name);
            let drift = outcome.drift.energy.max;
            assert!(drift < 3e-9, "{}: {rtol:e}: {drift:.1e}", scene.name);
        }
    }
}
