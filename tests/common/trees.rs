//! Random trees of bodies, and their equations of motion derived another way: three coordinates a body, every
//! hinge a pin, one dense solve.
#![allow(dead_code)]

use driftless::arithmetic::Complex;
use driftless::scene::{Bar, Hinge, Law, Motor, Place, Scene, Sine, Spring, Start};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

type C = Complex<f64>;

/// SplitMix64 (S. Vigna): one seed makes one scene.
pub struct Dice(u64);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [low, high).
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// One of 0 … count - 1.
    pub fn pick(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    fn flip(&mut self) -> bool {
        self.next() & 1 == 1
    }

    fn point(&mut self, size: f64) -> [f64; 2] {
        [self.within(-size, size), self.within(-size, size)]
    }
}

/// A tree of `n` bodies with off-axis centres and hinges, up to two springs with or without dampers, and with
/// motors where asked for.
pub fn tree(n: usize, motors: bool, dice: &mut Dice) -> Scene {
    let backwards = dice.flip();
    // Bodies may stand in the scene in the order of the tree or against it.
    let number = |k: usize| if backwards { n - 1 - k } else { k };
    let mut bars: Vec<Option<Bar>> = vec![None; n];
    let (mut hinges, mut parents) = (Vec::new(), vec![None; n]);
    for k in 0..n {
        let (bar, parent) = (number(k), dice.pick(k + 1));
        let parent = if parent == k { None } else { Some(number(parent)) };
        parents[bar] = parent;
        let name = format!("bar{bar}");
        bars[bar] = Some(Bar {
            name,
            length: 0.5,
            mass: dice.within(0.2, 2.0),
            centre: dice.point(0.4),
            inertia: dice.within(0.02, 0.1),
        });
        let mut between =
            [Place { bar: parent, point: dice.point(0.5) }, Place { bar: Some(bar), point: dice.point(0.3) }];
        if dice.flip() {
            between.reverse();
        }
        hinges.push(Hinge { name: format!("hinge{k}"), between });
    }
    let springs = (0..dice.pick(3))
        .map(|s| {
            let on = dice.pick(n);
            let other = (dice.pick(n) + 1..)
                .find(|&other| other != on + 1)
                .map(|other| if other > n { None } else { Some(other - 1) });
            Spring {
                name: format!("spring{s}"),
                between: [
                    Place { bar: Some(on), point: dice.point(0.5) },
                    Place { bar: other.flatten(), point: [dice.within(1.0, 2.0), dice.within(1.0, 2.0)] },
                ],
                stiffness: dice.within(1.0, 20.0),
                free_length: if dice.flip() { dice.within(0.1, 1.0) } else { 0.0 },
                damping: if dice.flip() { dice.within(0.1, 1.0) } else { 0.0 },
                rigid: false,
            }
        })
        .collect();
    let mut driven = Vec::new();
    if motors {
        for (bar, &parent) in parents.iter().enumerate() {
            // At most one motor a body, measured from the ground or from what carries it: never a
            // contradiction; at least one.
            if dice.pick(3) == 0 || (bar + 1 == n && driven.is_empty()) {
                let sine = Sine {
                    amplitude: dice.within(0.1, 0.5),
                    frequency: dice.within(1.0, 5.0),
                    phase: dice.within(-3.0, 3.0),
                };
                let sines = if dice.flip() { vec![sine] } else { vec![] };
                let law = Law {
                    start: dice.within(-3.0, 3.0),
                    rate: dice.within(-4.0, 4.0),
                    acceleration: dice.within(-1.0, 1.0),
                    sines,
                    profile: None,
                };
                let relative_to = if dice.flip() { parent } else { None };
                driven.push(Motor { name: format!("motor{bar}"), bar, relative_to, law });
            }
        }
    }
    Scene {
        name: "tree".into(),
        description: String::new(),
        gravity: [dice.within(-10.0, 10.0), dice.within(-10.0, 10.0)],
        bars: bars.into_iter().flatten().collect(),
        hinges,
        springs,
        motors: driven,
        start: (0..n).map(|_| Start { phi: dice.within(-3.0, 3.0), omega: dice.within(-3.0, 3.0) }).collect(),
        until: 1.0,
        every: 0.1,
        ..Scene::default()
    }
}

/// Trees of one to six bodies.
pub fn any_tree(motors: bool) -> impl Strategy<Value = (Scene, u64)> {
    (1..=6usize, any::<u64>()).prop_map(move |(n, seed)| (tree(n, motors, &mut Dice::new(seed)), seed))
}

/// What the redundant derivation finds.
pub struct Redundant {
    /// Angular accelerations \[rad/s²\].
    pub alpha: Vec<f64>,
    /// Accelerations of the centres of mass \[m/s²\].
    pub centre: Vec<C>,
    /// Force of each hinge's first body on its second \[N\].
    pub hinges: Vec<C>,
    /// Multipliers of the motors \[N·m\].
    pub motors: Vec<f64>,
    /// Kinetic and potential energy \[J\], the latter zero where all centres lie level with the origin and
    /// springs are unstretched.
    pub kinetic: f64,
    pub potential: f64,
}

/// Positions and velocities of the centres of mass from the scene alone, hinge by hinge.
struct Frames {
    centre: Vec<C>,
    velocity: Vec<C>,
    unit: Vec<C>,
}

impl Frames {
    fn new(scene: &Scene, phi: &[f64], omega: &[f64]) -> Self {
        let n = scene.bars.len();
        let unit: Vec<C> = phi.iter().map(|phi| C::new(phi.cos(), phi.sin())).collect();
        let mut frames = Self { centre: vec![C::ZERO; n], velocity: vec![C::ZERO; n], unit };
        let mut placed = vec![false; n];
        while placed.iter().any(|placed| !placed) {
            for hinge in &scene.hinges {
                for (near, far) in [(0, 1), (1, 0)] {
                    let (near, far) = (hinge.between[near], hinge.between[far]);
                    let Some(bar) = far.bar.filter(|&bar| !placed[bar]) else { continue };
                    if near.bar.is_some_and(|near| !placed[near]) {
                        continue;
                    }
                    let (at, velocity) = frames.at(scene, near, omega);
                    let arm = frames.arm(scene, far);
                    frames.centre[bar] = at - arm;
                    frames.velocity[bar] = velocity - arm.left().times(omega[bar]);
                    placed[bar] = true;
                }
            }
        }
        frames
    }

    /// From a bar's centre of mass to one of its points, in the world's directions.
    fn arm(&self, scene: &Scene, place: Place) -> C {
        place.bar.map_or(C::ZERO, |bar| {
            let centre = scene.bars[bar].centre;
            self.unit[bar] * C::new(place.point[0] - centre[0], place.point[1] - centre[1])
        })
    }

    /// Position and velocity of a place.
    fn at(&self, scene: &Scene, place: Place, omega: &[f64]) -> (C, C) {
        let arm = self.arm(scene, place);
        match place.bar {
            None => (C::new(place.point[0], place.point[1]), C::ZERO),
            Some(bar) => (self.centre[bar] + arm, self.velocity[bar] + arm.left().times(omega[bar])),
        }
    }
}

/// The scene's equations in (x, y, phi) of every body, with every hinge a pair of rows and every motor one:
/// `[M Jᵀ; J 0] [a; lambda] = [f; -gamma]` by a dense LU.
pub fn redundant(scene: &Scene, t: f64, phi: &[f64], omega: &[f64]) -> Redundant {
    let (n, pins) = (scene.bars.len(), scene.hinges.len());
    let size = 3 * n + 2 * pins + scene.motors.len();
    let frames = Frames::new(scene, phi, omega);
    let (mut matrix, mut right) = (DMatrix::<f64>::zeros(size, size), DVector::<f64>::zeros(size));
    let gravity = C::new(scene.gravity[0], scene.gravity[1]);
    let (mut kinetic, mut potential) = (0.0, 0.0);
    for (k, bar) in scene.bars.iter().enumerate() {
        for (offset, inertia) in [bar.mass, bar.mass, bar.inertia].into_iter().enumerate() {
            matrix[(3 * k + offset, 3 * k + offset)] = inertia;
        }
        right[3 * k] += bar.mass * gravity.re;
        right[3 * k + 1] += bar.mass * gravity.im;
        kinetic +=
            0.5 * bar.mass * frames.velocity[k].norm_squared() + 0.5 * bar.inertia * omega[k] * omega[k];
        potential -= bar.mass * gravity.dot(frames.centre[k]);
    }
    for spring in &scene.springs {
        let [(a, va), (b, vb)] = spring.between.map(|place| frames.at(scene, place, omega));
        let (span, closing) = (b - a, vb - va);
        let length = span.norm_squared().sqrt();
        let along = span.times(1.0 / length);
        let pull = spring.stiffness * (length - spring.free_length) + spring.damping * along.dot(closing);
        potential += 0.5 * spring.stiffness * (length - spring.free_length).powi(2);
        for (place, force) in spring.between.into_iter().zip([along.times(pull), along.times(-pull)]) {
            let Some(bar) = place.bar else { continue };
            right[3 * bar] += force.re;
            right[3 * bar + 1] += force.im;
            right[3 * bar + 2] += frames.arm(scene, place).cross(force);
        }
    }
    let mut border = |row: usize, column: usize, entry: f64| {
        matrix[(row, column)] += entry;
        matrix[(column, row)] += entry;
    };
    for (h, hinge) in scene.hinges.iter().enumerate() {
        let row = 3 * n + 2 * h;
        for (place, sign) in hinge.between.into_iter().zip([1.0, -1.0]) {
            let Some(bar) = place.bar else { continue };
            let arm = frames.arm(scene, place);
            let turned = arm.left();
            for (axis, lever) in [turned.re, turned.im].into_iter().enumerate() {
                border(row + axis, 3 * bar + axis, sign);
                border(row + axis, 3 * bar + 2, sign * lever);
            }
            right[row] += sign * arm.re * omega[bar] * omega[bar];
            right[row + 1] += sign * arm.im * omega[bar] * omega[bar];
        }
    }
    for (m, motor) in scene.motors.iter().enumerate() {
        let row = 3 * n + 2 * pins + m;
        border(row, 3 * motor.bar + 2, 1.0);
        if let Some(base) = motor.relative_to {
            border(row, 3 * base + 2, -1.0);
        }
        let swing =
            |sine: &Sine| sine.amplitude * sine.frequency.powi(2) * (sine.frequency * t + sine.phase).sin();
        right[row] = motor.law.acceleration - motor.law.sines.iter().map(swing).sum::<f64>();
    }
    let solution = matrix.lu().solve(&right).expect("a regular scene");
    Redundant {
        alpha: (0..n).map(|k| solution[3 * k + 2]).collect(),
        centre: (0..n).map(|k| C::new(solution[3 * k], solution[3 * k + 1])).collect(),
        hinges: (0..pins).map(|h| C::new(solution[3 * n + 2 * h], solution[3 * n + 2 * h + 1])).collect(),
        motors: (0..scene.motors.len()).map(|m| solution[3 * n + 2 * pins + m]).collect(),
        kinetic,
        potential,
    }
}
