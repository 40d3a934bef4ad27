//! The equations of motion in maximal coordinates: x, y of the centre of mass and the angle of every body.
//!
//! ```text
//! M a = f + Gᵀ λ,     G a = -γ,     C = measure(q) - target(t),   C' = G v - target',   γ = what is left of C'' where a = 0
//! ```
//!
//! λ of a point's equation is a force on the first body listed, of an angle's a torque on the body whose
//! angle it is.

use super::double_double::{Dd, Vec2};
use super::linear::{self, Row, Solution};
use super::reader::{Law, Measure, Place, Push, Scene, Target};
use std::cell::OnceCell;

/// Positions and rates, three numbers for each body: x, y \[m\], angle \[rad\], whole turns counted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    pub t: Dd,
    pub q: Vec<Dd>,
    pub v: Vec<Dd>,
    /// Work of motors, dampers and applied forces since the start \[J\].
    pub work: Dd,
}

/// An equation at a state.
pub struct Equation {
    /// C \[m or rad\].
    pub off: Dd,
    /// C' \[m/s or rad/s\].
    pub rate: Dd,
    pub row: Row,
    /// γ.
    pub bend: Dd,
}

/// A scene with the targets of all equations known.
#[derive(Clone, Debug)]
pub struct Model {
    pub scene: Scene,
    pub mass: Vec<Dd>,
    pub targets: Vec<Law>,
}

/// Where a place is, how it moves, and what its coordinates do to it.
struct Spot {
    body: Option<usize>,
    at: Vec2,
    velocity: Vec2,
    /// From the centre of mass.
    arm: Vec2,
    /// Towards the centre of mass: -ω² arm.
    bend: Vec2,
}

/// A state with the sines and cosines of its angles, each computed once.
struct Pose<'a> {
    state: &'a State,
    turns: Vec<OnceCell<(Dd, Dd)>>,
}

impl<'a> Pose<'a> {
    fn new(state: &'a State) -> Self {
        Self { state, turns: vec![OnceCell::new(); state.q.len() / 3] }
    }

    /// Sine and cosine of a body's angle; of zero for the ground.
    fn turn(&self, body: Option<usize>) -> (Dd, Dd) {
        body.map_or((Dd::ZERO, Dd::ONE), |k| *self.turns[k].get_or_init(|| self.state.q[3 * k + 2].sin_cos()))
    }
}

/// Accelerations and what goes with them.
pub struct Accelerations {
    pub solution: Solution,
    /// Power of motors, dampers and applied forces \[W\].
    pub power: Dd,
    /// Of each joint, the power of its target's motion \[W\].
    pub motor_power: Vec<Dd>,
}

impl Model {
    pub fn new(scene: Scene) -> Self {
        let mass = scene.bodies.iter().flat_map(|body| [body.mass, body.mass, body.inertia]).collect();
        let targets = scene
            .joints
            .iter()
            .map(|joint| if let Target::Law(law) = &joint.target { law.clone() } else { Law::default() });
        Self { targets: targets.collect(), mass, scene }
    }

    fn spot(&self, place: &Place, pose: &Pose) -> Spot {
        let state = pose.state;
        let Some(k) = place.body else {
            return Spot {
                body: None,
                at: place.point,
                velocity: Vec2::default(),
                arm: Vec2::default(),
                bend: Vec2::default(),
            };
        };
        let [x, y] = [0, 1].map(|i| state.q[3 * k + i]);
        let [vx, vy, omega] = [0, 1, 2].map(|i| state.v[3 * k + i]);
        let arm = place.point.turned(pose.turn(Some(k)));
        let velocity = Vec2 { x: vx, y: vy } + arm.left().times(omega);
        Spot { body: Some(k), at: Vec2 { x, y } + arm, velocity, arm, bend: arm.times(-(omega * omega)) }
    }

    /// A measure at a state, before any target is taken off.
    fn measured(&self, measure: &Measure, pose: &Pose) -> Equation {
        let state = pose.state;
        match measure {
            Measure::Difference { places, axis } => {
                let [a, b] = places.each_ref().map(|place| self.spot(place, pose));
                let mut row = Row::new();
                a.push(&mut row, *axis);
                b.push(&mut row, Vec2::default() - *axis);
                let [off, rate, bend] = [a.at - b.at, a.velocity - b.velocity, a.bend - b.bend]
                    .map(|difference| axis.dot(difference));
                Equation { off, rate, row, bend }
            }
            Measure::Along { point, rail, direction } => {
                let [a, b] = [point, rail].map(|place| self.spot(place, pose));
                let omega = rail.body.map_or(Dd::ZERO, |k| state.v[3 * k + 2]);
                let along = direction.turned(pose.turn(rail.body));
                let (span, speed) = (a.at - b.at, a.velocity - b.velocity);
                let mut row = Row::new();
                a.push(&mut row, along);
                b.push(&mut row, Vec2::default() - along);
                if let Some(k) = rail.body {
                    row.push((3 * k + 2, along.left().dot(span)));
                }
                let rate = along.dot(speed) + omega * along.left().dot(span);
                let bend = along.dot(a.bend - b.bend) + (omega * along.left().dot(speed)).scale(2.0)
                    - omega * omega * along.dot(span);
                Equation { off: along.dot(span), rate, row, bend }
            }
            Measure::Angle { body, base } => {
                let mut equation =
                    Equation { off: Dd::ZERO, rate: Dd::ZERO, row: Row::new(), bend: Dd::ZERO };
                for (k, sign) in body.iter().map(|k| (k, Dd::ONE)).chain(base.iter().map(|k| (k, -Dd::ONE))) {
                    equation.off += sign * state.q[3 * k + 2];
                    equation.rate += sign * state.v[3 * k + 2];
                    equation.row.push((3 * k + 2, sign));
                }
                equation
            }
        }
    }

    /// Every joint's measure, the value that [`Target::AsAtStart`] keeps.
    pub fn measures(&self, state: &State) -> Vec<Dd> {
        let pose = Pose::new(state);
        self.scene.joints.iter().map(|joint| self.measured(&joint.measure, &pose).off).collect()
    }

    /// All equations of joints at a state.
    pub fn equations(&self, state: &State) -> Vec<Equation> {
        self.equations_at(&Pose::new(state))
    }

    fn equations_at(&self, pose: &Pose) -> Vec<Equation> {
        let one = |(joint, target): (&super::reader::Joint, &Law)| {
            let mut equation = self.measured(&joint.measure, pose);
            let [value, rate, acceleration] = target.at(pose.state.t);
            equation.off -= value;
            equation.rate -= rate;
            equation.bend -= acceleration;
            if matches!(joint.measure, Measure::Angle { .. }) {
                // Whole turns are the same angle.
                let turns = (equation.off.hi / std::f64::consts::TAU).round();
                equation.off -= Dd::PI.scale(2.0 * turns);
            }
            equation
        };
        self.scene.joints.iter().zip(&self.targets).map(one).collect()
    }

    /// The distance of a wall's point from its wall, as an equation.
    pub fn gap(&self, wall: usize, state: &State) -> Equation {
        let wall = &self.scene.walls[wall];
        let spot = self.spot(&wall.place, &Pose::new(state));
        let mut row = Row::new();
        spot.push(&mut row, wall.normal);
        let off = wall.normal.dot(spot.at - wall.through);
        Equation { off, rate: wall.normal.dot(spot.velocity), row, bend: wall.normal.dot(spot.bend) }
    }

    /// Applied forces at a state, and the power of those that have no potential energy.
    fn forces(&self, pose: &Pose) -> (Vec<Dd>, Dd) {
        let (scene, state) = (&self.scene, pose.state);
        let mut f = vec![Dd::ZERO; self.mass.len()];
        let mut power = Dd::ZERO;
        for (k, body) in scene.bodies.iter().enumerate() {
            f[3 * k] += body.mass * scene.gravity.x;
            f[3 * k + 1] += body.mass * scene.gravity.y;
        }
        for spring in &scene.springs {
            let [a, b] = spring.places.each_ref().map(|place| self.spot(place, pose));
            let span = a.at - b.at;
            let length = span.length();
            // A spring without free length pulls along its span however short; a damper has a direction only
            // where there is one.
            let unit = if length.hi > 0.0 { span.times(Dd::ONE / length) } else { Vec2::default() };
            let lengthening = unit.dot(a.velocity - b.velocity);
            let damping = spring.damping * lengthening;
            let pull = unit.times(spring.stiffness * (length - spring.free_length) + damping);
            a.press(&mut f, Vec2::default() - pull);
            b.press(&mut f, pull);
            power -= damping * lengthening;
        }
        for coil in &scene.coils {
            let difference = |x: &[Dd]| x[3 * coil.body + 2] - coil.base.map_or(Dd::ZERO, |k| x[3 * k + 2]);
            let turning = difference(&state.v);
            let damping = coil.damping * turning;
            let torque = -(coil.stiffness * (difference(&state.q) - coil.free_angle) + damping);
            turn(&mut f, coil.body, coil.base, torque);
            power -= damping * turning;
        }
        for push in &scene.pushes {
            let factor = |law: &Option<Law>| law.as_ref().map_or(Dd::ONE, |law| law.at(state.t)[0]);
            match push {
                Push::Force { place, force, turns, law } => {
                    let spot = self.spot(place, pose);
                    let force =
                        if *turns { force.turned(pose.turn(place.body)) } else { *force }.times(factor(law));
                    spot.press(&mut f, force);
                    power += force.dot(spot.velocity);
                }
                Push::Torque { body, base, torque, law } => {
                    let torque = *torque * factor(law);
                    turn(&mut f, *body, *base, torque);
                    power += torque * (state.v[3 * body + 2] - base.map_or(Dd::ZERO, |k| state.v[3 * k + 2]));
                }
            }
        }
        (f, power)
    }

    /// Accelerations, with the points of the walls `held` kept on them; their multipliers come after those of
    /// the joints.
    pub fn accelerations(&self, state: &State, held: &[usize]) -> Accelerations {
        let pose = Pose::new(state);
        let (f, mut power) = self.forces(&pose);
        let mut equations = self.equations_at(&pose);
        equations.extend(held.iter().map(|&wall| self.gap(wall, state)));
        let right: Vec<Dd> = equations.iter().map(|equation| -equation.bend).collect();
        let rows: Vec<Row> = equations.into_iter().map(|equation| equation.row).collect();
        let solution = linear::solve(&self.mass, &rows, &f, &right);
        let motor_power: Vec<Dd> = self
            .targets
            .iter()
            .zip(&solution.multipliers)
            .map(|(law, &lambda)| law.at(state.t)[1] * lambda)
            .collect();
        power = motor_power.iter().fold(power, |sum, &one| sum + one);
        Accelerations { solution, power, motor_power }
    }

    /// Kinetic energy, and potential energy of gravity and springs \[J\].
    pub fn energy(&self, state: &State) -> [Dd; 2] {
        let kinetic = (0..self.mass.len())
            .fold(Dd::ZERO, |sum, i| sum + (self.mass[i] * state.v[i] * state.v[i]).scale(0.5));
        let pose = Pose::new(state);
        let mut potential = Dd::ZERO;
        for (k, body) in self.scene.bodies.iter().enumerate() {
            potential -= body.mass
                * (self.scene.gravity.x * state.q[3 * k] + self.scene.gravity.y * state.q[3 * k + 1]);
        }
        for spring in &self.scene.springs {
            let [a, b] = spring.places.each_ref().map(|place| self.spot(place, &pose).at);
            let stretch = (a - b).length() - spring.free_length;
            potential += (spring.stiffness * stretch * stretch).scale(0.5);
        }
        for coil in &self.scene.coils {
            let twist = state.q[3 * coil.body + 2]
                - coil.base.map_or(Dd::ZERO, |k| state.q[3 * k + 2])
                - coil.free_angle;
            potential += (coil.stiffness * twist * twist).scale(0.5);
        }
        [kinetic, potential]
    }
}

impl Spot {
    /// Adds to a row what a displacement of the body does to the spot along `axis`.
    fn push(&self, row: &mut Row, axis: Vec2) {
        if let Some(k) = self.body {
            row.extend([(3 * k, axis.x), (3 * k + 1, axis.y), (3 * k + 2, axis.dot(self.arm.left()))]);
        }
    }

    /// Adds a force at the spot to those on its body.
    fn press(&self, f: &mut [Dd], force: Vec2) {
        if let Some(k) = self.body {
            f[3 * k] += force.x;
            f[3 * k + 1] += force.y;
            f[3 * k + 2] += self.arm.left().dot(force);
        }
    }
}

/// Adds a torque on a body and its opposite on another.
fn turn(f: &mut [Dd], body: usize, base: Option<usize>, torque: Dd) {
    f[3 * body + 2] += torque;
    if let Some(base) = base {
        f[3 * base + 2] -= torque;
    }
}
