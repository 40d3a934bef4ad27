//! Random scenes of every kind that the reader accepts, each with a start that satisfies all its constraints.
//!
//! A configuration is chosen first (angles, positions), the joints are derived from it, and the rates are
//! taken from the null space of the constraint Jacobian, formed here in maximal coordinates (x, y, phi of
//! every body) with nothing of the crate but the plain data of a scene. The laws of motors are chosen so that
//! their values and rates at t = 0 are those of the start.
//!
//! Two or three [`Kind`]s are chosen to be present first, so that every pair of kinds meets; the rest is
//! filled at random.
#![allow(dead_code)]

mod closing;
mod constraints;
mod dice;
mod kind;
mod loads;
mod structure;
mod write;

pub use dice::Dice;
pub use kind::Kind;

use driftless::scene::{
    Bar, Drive, Force, Given, Hinge, Lock, Motor, Place, Slider, Spring, Start, Torque, TorsionSpring, Wall,
    Weld,
};
use std::collections::BTreeSet;

/// A random scene.
#[derive(Clone, Debug)]
pub struct Generated {
    /// The seed it came from.
    pub seed: u64,
    /// The scene file.
    pub text: String,
    /// Every kind that is in it.
    pub kinds: BTreeSet<Kind>,
    /// The kinds that were chosen to be in it, as far as they could be.
    pub wanted: Vec<Kind>,
    /// Its natural scales.
    pub scales: Scales,
    /// Degrees of freedom that motors leave.
    pub freedom: usize,
}

/// Natural scales of a scene: typical values of what is in it.
#[derive(Clone, Copy, Debug)]
pub struct Scales {
    /// \[s\]
    pub time: f64,
    /// \[m\]
    pub length: f64,
    /// \[kg\]
    pub mass: f64,
    /// \[N\]
    pub force: f64,
}

/// How a bar is written: by its shape, or else by its mass.
#[derive(Clone, Copy, Debug)]
struct Uniform {
    width: f64,
    thickness: f64,
    density: f64,
    /// `full`, `slender`; `None`: left out.
    inertia: Option<&'static str>,
}

/// A scene in the making.
struct Model {
    dice: Dice,
    scales: Scales,
    wanted: Vec<Kind>,
    kinds: BTreeSet<Kind>,
    gravity: [f64; 2],
    bars: Vec<Bar>,
    uniform: Vec<Option<Uniform>>,
    start: Vec<Start>,
    /// Origins of the bodies \[m\] and their velocities \[m/s\].
    origin: Vec<[f64; 2]>,
    velocity: Vec<[f64; 2]>,
    hinges: Vec<Hinge>,
    sliders: Vec<Slider>,
    welds: Vec<Weld>,
    locks: Vec<Lock>,
    springs: Vec<Spring>,
    torsion_springs: Vec<TorsionSpring>,
    forces: Vec<Force>,
    torques: Vec<Torque>,
    motors: Vec<Motor>,
    drives: Vec<Drive>,
    walls: Vec<Wall>,
    /// Bodies that wanted kinds act on, so that other wanted kinds meet them.
    focus: Vec<usize>,
    /// True where a closed loop or a slider couples bodies: motors must not go far.
    is_coupled: bool,
}

/// The scene of a seed; the same on every machine.
pub fn scene(seed: u64) -> Generated {
    let mut dice = Dice::new(seed);
    let count = 2 + usize::from(dice.chance(0.35));
    let mut wanted = Vec::new();
    while wanted.len() < count {
        let kind = dice.one(&Kind::ALL);
        if wanted.iter().all(|&other| kind.goes_with(other)) {
            wanted.push(kind);
        }
    }
    scene_with(seed, &wanted)
}

/// A scene in which these kinds are present, as far as they go together.
pub fn scene_with(seed: u64, wanted: &[Kind]) -> Generated {
    let mut dice = Dice::new(seed ^ 0x5eed_0f5c_e9e5);
    loop {
        if let Some(made) = Model::new(Dice::new(dice.next()), wanted).made(seed) {
            return made;
        }
    }
}

impl Model {
    fn new(mut dice: Dice, wanted: &[Kind]) -> Self {
        let length = dice.size(0.3, 2.0);
        let is_weightless = wanted.contains(&Kind::NoGravity) || dice.chance(0.1);
        let strength = if dice.chance(0.6) { 9.81 } else { dice.size(1.0, 30.0) };
        let gravity = match dice.pick(4) {
            _ if is_weightless => [0.0, 0.0],
            0 | 1 => [0.0, -strength],
            2 => [strength, 0.0],
            _ => dice.direction().map(|x| x * strength),
        };
        let time = if is_weightless { dice.size(0.1, 0.6) } else { (length / strength).sqrt() };
        let mass = dice.size(0.2, 3.0);
        let scales = Scales { time, length, mass, force: mass * length / (time * time) };
        let mut kinds = BTreeSet::new();
        if is_weightless {
            kinds.insert(Kind::NoGravity);
        }
        Self {
            dice,
            scales,
            wanted: wanted.to_vec(),
            kinds,
            gravity,
            bars: Vec::new(),
            uniform: Vec::new(),
            start: Vec::new(),
            origin: Vec::new(),
            velocity: Vec::new(),
            hinges: Vec::new(),
            sliders: Vec::new(),
            welds: Vec::new(),
            locks: Vec::new(),
            springs: Vec::new(),
            torsion_springs: Vec::new(),
            forces: Vec::new(),
            torques: Vec::new(),
            motors: Vec::new(),
            drives: Vec::new(),
            walls: Vec::new(),
            focus: Vec::new(),
            is_coupled: false,
        }
    }

    /// The scene, where nothing is near-singular and something can move.
    fn made(mut self, seed: u64) -> Option<Generated> {
        self.build();
        let mut basis = self.basis()?;
        self.close(&mut basis);
        if basis.freedom() == 0 {
            return None;
        }
        self.choose_rates(&basis);
        self.drive(&mut basis);
        self.load();
        self.wall();
        let is_driven = !self.motors.is_empty() || !self.drives.is_empty();
        if basis.freedom() == 0 && is_driven {
            self.kinds.insert(Kind::FullyDriven);
        }
        if self.wanted.contains(&Kind::FullyDriven) != self.kinds.contains(&Kind::FullyDriven) {
            return None;
        }
        let freedom = basis.freedom();
        Some(Generated {
            seed,
            text: self.text(),
            kinds: self.kinds,
            wanted: self.wanted,
            scales: self.scales,
            freedom,
        })
    }

    fn wants(&self, kind: Kind) -> bool {
        self.wanted.contains(&kind)
    }

    /// True where it is wanted, or by chance.
    fn takes(&mut self, kind: Kind, chance: f64) -> bool {
        self.wants(kind) || self.dice.chance(chance)
    }

    /// A point of a body in the world \[m\].
    fn at(&self, place: &Place) -> [f64; 2] {
        let Some(bar) = place.bar else {
            return place.point;
        };
        let arm = self.turned(bar, place.point);
        [self.origin[bar][0] + arm[0], self.origin[bar][1] + arm[1]]
    }

    /// Its velocity \[m/s\].
    fn velocity_at(&self, place: &Place) -> [f64; 2] {
        let Some(bar) = place.bar else {
            return [0.0; 2];
        };
        let (arm, omega) = (self.turned(bar, place.point), self.start[bar].omega);
        [self.velocity[bar][0] - omega * arm[1], self.velocity[bar][1] + omega * arm[0]]
    }

    /// A vector of a body's frame in the world.
    fn turned(&self, bar: usize, [x, y]: [f64; 2]) -> [f64; 2] {
        let (s, c) = self.start[bar].phi.sin_cos();
        [c * x - s * y, s * x + c * y]
    }

    /// A point of the world as a place on a body, or on the ground.
    fn place(&self, bar: Option<usize>, [x, y]: [f64; 2]) -> Place {
        let Some(k) = bar else {
            return Place { bar, point: [x, y] };
        };
        let (s, c) = self.start[k].phi.sin_cos();
        let (x, y) = (x - self.origin[k][0], y - self.origin[k][1]);
        Place { bar, point: [c * x + s * y, c * y - s * x] }
    }

    /// Some point of a body.
    fn spot(&mut self, bar: usize) -> Place {
        let length = self.bars[bar].length;
        let point = match self.dice.pick(4) {
            0 | 1 => [length, 0.0],
            2 => [length * self.dice.within(0.2, 1.0), 0.0],
            _ => [length * self.dice.within(0.2, 1.0), length * self.dice.within(-0.3, 0.3)],
        };
        Place { bar: Some(bar), point }
    }

    /// A body, rather one that wanted kinds act on.
    fn some_body(&mut self) -> usize {
        if !self.focus.is_empty() && self.dice.chance(0.65) {
            return self.dice.one(&self.focus.clone());
        }
        self.dice.pick(self.bars.len())
    }

    /// Another body than this one; the ground at times, and where there is no other.
    fn another(&mut self, bar: usize, ground: f64) -> Option<usize> {
        if self.bars.len() == 1 || self.dice.chance(ground) {
            return None;
        }
        let other = self.dice.pick(self.bars.len() - 1);
        Some(if other >= bar { other + 1 } else { other })
    }

    fn given(&self, is_hung: bool, bar: usize) -> Given {
        let free = |value| if is_hung { None } else { Some(value) };
        Given { phi: true, omega: true, origin: free(self.origin[bar]), velocity: free(self.velocity[bar]) }
    }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn norm(a: [f64; 2]) -> f64 {
    a[0].hypot(a[1])
}

fn left([x, y]: [f64; 2]) -> [f64; 2] {
    [-y, x]
}
