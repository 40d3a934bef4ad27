//! Scenes that describe the same motion as another, and how to read the one's motion as the other's.
#![allow(dead_code)]

use crate::mechanisms::Dice;
use driftless::run::Sample;
use driftless::scene::{Bar, Friction, FrictionPlace, Given, Law, Place, Scene, Sine, Start, Weld};
use std::f64::consts::PI;

/// A scene that has the same motion as another, seen otherwise.
pub struct Related {
    pub scene: Scene,
    pub back: Back,
}

/// How a motion of the related scene reads as one of the first: scales are taken off first, then shift, turn
/// and mirror.
#[derive(Clone, Debug)]
pub struct Back {
    /// The number in the related scene of each body of the first.
    pub bodies: Vec<usize>,
    /// x and -x are exchanged.
    pub mirrored: bool,
    /// \[rad\]
    pub turn: f64,
    /// \[m\]
    pub shift: [f64; 2],
    pub mass: f64,
    pub length: f64,
    pub time: f64,
    /// A body that was cut in two, the number of its other part, and the share of the mass that is left with
    /// the first.
    pub cut: Option<(usize, usize, f64)>,
}

impl Back {
    fn same(scene: &Scene) -> Self {
        let bodies = (0..scene.bars.len()).collect();
        Self {
            bodies,
            mirrored: false,
            turn: 0.0,
            shift: [0.0; 2],
            mass: 1.0,
            length: 1.0,
            time: 1.0,
            cut: None,
        }
    }

    /// Angle and rate of a body of the first scene.
    pub fn angle(&self, body: usize, sample: &Sample) -> [f64; 2] {
        let k = self.bodies[body];
        let (phi, omega) = (sample.phi[k] - self.turn, sample.omega[k] * self.time);
        if self.mirrored { [PI - phi, -omega] } else { [phi, omega] }
    }

    /// Centre and velocity of a body of the first scene.
    pub fn centre(&self, body: usize, sample: &Sample) -> [[f64; 2]; 2] {
        let k = self.bodies[body];
        let whole = |vectors: &[[f64; 2]]| match self.cut {
            Some((whole, part, share)) if whole == body => {
                [0, 1].map(|i| share * vectors[k][i] + (1.0 - share) * vectors[part][i])
            }
            _ => vectors[k],
        };
        let [x, y] = whole(&sample.centre);
        let (x, y) = (x / self.length - self.shift[0], y / self.length - self.shift[1]);
        let velocity = whole(&sample.velocity).map(|v| v / self.length * self.time);
        [self.vector([x, y]), self.vector(velocity)]
    }

    fn vector(&self, vector: [f64; 2]) -> [f64; 2] {
        let [x, y] = rotated(vector, -self.turn);
        if self.mirrored { [-x, y] } else { [x, y] }
    }

    pub fn energy(&self) -> f64 {
        self.mass * self.length * self.length / (self.time * self.time)
    }

    /// What torque and power of a motor on an angle, or force and power of one on a slider, are to be divided
    /// by.
    pub fn of_motor(&self, is_angle: bool) -> [f64; 2] {
        let (energy, sign) = (self.energy(), if self.mirrored { -1.0 } else { 1.0 });
        [if is_angle { sign * energy } else { energy / self.length }, energy / self.time]
    }
}

fn rotated([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
    let (s, c) = angle.sin_cos();
    [c * x - s * y, s * x + c * y]
}

/// Every place of a scene.
fn places(scene: &mut Scene) -> Vec<&mut Place> {
    let hinges = scene.hinges.iter_mut().flat_map(|hinge| &mut hinge.between);
    let welds = scene.welds.iter_mut().flat_map(|weld| &mut weld.between);
    let springs = scene.springs.iter_mut().flat_map(|spring| &mut spring.between);
    let sliders = scene.sliders.iter_mut().flat_map(|slider| [&mut slider.point, &mut slider.rail.place]);
    hinges.chain(welds).chain(springs).chain(sliders).collect()
}

/// What is said of the start of every body.
fn with_all_given(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.given.resize(scene.bars.len(), Given::ANGLE_AND_RATE);
    scene
}

/// The bodies in another order, and all lists backwards.
pub fn reordered(scene: &Scene, dice: &mut Dice) -> Related {
    let mut scene = with_all_given(scene);
    let order = dice.order(scene.bars.len());
    let mut back = Back::same(&scene);
    order.iter().enumerate().for_each(|(new, &old)| back.bodies[old] = new);
    let place_of = &back.bodies;
    let mut number = |bar: &mut usize| *bar = place_of[*bar];
    for place in places(&mut scene) {
        place.bar.iter_mut().for_each(&mut number);
    }
    for lock in &mut scene.locks {
        number(&mut lock.bar);
        lock.relative_to.iter_mut().for_each(&mut number);
    }
    for coil in &mut scene.torsion_springs {
        number(&mut coil.bar);
        coil.relative_to.iter_mut().for_each(&mut number);
    }
    for torque in &mut scene.torques {
        number(&mut torque.bar);
        torque.relative_to.iter_mut().for_each(&mut number);
    }
    for motor in &mut scene.motors {
        number(&mut motor.bar);
        motor.relative_to.iter_mut().for_each(&mut number);
    }
    scene.forces.iter_mut().for_each(|force| number(&mut force.bar));
    scene.walls.iter_mut().for_each(|wall| number(&mut wall.bar));
    scene.bars = order.iter().map(|&old| scene.bars[old].clone()).collect();
    scene.start = order.iter().map(|&old| scene.start[old]).collect();
    scene.given = order.iter().map(|&old| scene.given[old]).collect();
    let last = scene.sliders.len().wrapping_sub(1);
    scene.drives.iter_mut().for_each(|drive| drive.slider = last - drive.slider);
    let last_hinge = scene.hinges.len().wrapping_sub(1);
    for friction in &mut scene.frictions {
        if let FrictionPlace::Hinge { hinge, .. } = &mut friction.at {
            *hinge = last_hinge - *hinge;
        }
    }
    scene.hinges.reverse();
    scene.sliders.reverse();
    scene.welds.reverse();
    scene.locks.reverse();
    scene.springs.reverse();
    scene.torsion_springs.reverse();
    scene.forces.reverse();
    scene.torques.reverse();
    scene.motors.reverse();
    scene.drives.reverse();
    scene.walls.reverse();
    Related { scene, back }
}

/// Bodies and joints with names whose alphabetical order is another.
pub fn renamed(scene: &Scene) -> Related {
    let mut scene = scene.clone();
    let back = Back::same(&scene);
    let bars = scene.bars.iter_mut().map(|bar| &mut bar.name);
    let hinges = scene.hinges.iter_mut().map(|hinge| &mut hinge.name);
    let sliders = scene.sliders.iter_mut().map(|slider| &mut slider.name);
    let springs = scene.springs.iter_mut().map(|spring| &mut spring.name);
    for (number, name) in bars.chain(hinges).chain(sliders).chain(springs).enumerate() {
        *name = format!("{}-{name}-Z", (b'z' - (number % 26) as u8) as char);
    }
    Related { scene, back }
}

/// The two places of hinges, welds and springs exchanged.
pub fn swapped(scene: &Scene) -> Related {
    let mut scene = scene.clone();
    let back = Back::same(&scene);
    scene.hinges.iter_mut().for_each(|hinge| hinge.between.reverse());
    scene.welds.iter_mut().for_each(|weld| weld.between.reverse());
    scene.springs.iter_mut().for_each(|spring| spring.between.reverse());
    Related { scene, back }
}

fn negated(law: &mut Law) {
    (law.start, law.rate, law.acceleration) = (-law.start, -law.rate, -law.acceleration);
    law.sines.iter_mut().for_each(|sine| sine.amplitude = -sine.amplitude);
}

/// Seen in a mirror: x becomes -x, an angle phi becomes pi - phi, and y changes its sign in the frames of
/// bodies.
pub fn mirrored(scene: &Scene) -> Related {
    let mut scene = with_all_given(scene);
    let back = Back { mirrored: true, ..Back::same(&scene) };
    let in_world = |vector: &mut [f64; 2]| vector[0] = -vector[0];
    let in_body = |vector: &mut [f64; 2]| vector[1] = -vector[1];
    in_world(&mut scene.gravity);
    scene.bars.iter_mut().for_each(|bar| in_body(&mut bar.centre));
    for place in places(&mut scene) {
        if place.bar.is_some() { in_body(&mut place.point) } else { in_world(&mut place.point) }
    }
    for slider in &mut scene.sliders {
        let direction = &mut slider.rail.direction;
        if slider.rail.place.bar.is_some() { in_body(direction) } else { in_world(direction) }
    }
    let angle =
        |relative_to: Option<usize>, angle: f64| if relative_to.is_some() { -angle } else { PI - angle };
    for lock in &mut scene.locks {
        lock.angle = lock.angle.map(|own| angle(lock.relative_to, own));
    }
    for coil in &mut scene.torsion_springs {
        coil.free_angle = angle(coil.relative_to, coil.free_angle);
    }
    for motor in &mut scene.motors {
        negated(&mut motor.law);
        if motor.relative_to.is_none() {
            motor.law.start += PI;
        }
    }
    for force in &mut scene.forces {
        in_body(&mut force.point);
        if force.follows { in_body(&mut force.force) } else { in_world(&mut force.force) }
    }
    scene.torques.iter_mut().for_each(|torque| torque.torque = -torque.torque);
    for wall in &mut scene.walls {
        in_body(&mut wall.point);
        in_world(&mut wall.through);
        in_world(&mut wall.normal);
    }
    for start in &mut scene.start {
        *start = Start { phi: PI - start.phi, omega: -start.omega };
    }
    for given in &mut scene.given {
        given.origin.iter_mut().for_each(in_world);
        given.velocity.iter_mut().for_each(in_world);
    }
    Related { scene, back }
}

/// Turned together with gravity.
pub fn turned(scene: &Scene, turn: f64) -> Related {
    let mut scene = with_all_given(scene);
    let back = Back { turn, ..Back::same(&scene) };
    let rotate = |vector: &mut [f64; 2]| *vector = rotated(*vector, turn);
    rotate(&mut scene.gravity);
    places(&mut scene)
        .into_iter()
        .filter(|place| place.bar.is_none())
        .for_each(|place| rotate(&mut place.point));
    for slider in scene.sliders.iter_mut().filter(|slider| slider.rail.place.bar.is_none()) {
        rotate(&mut slider.rail.direction);
    }
    for lock in scene.locks.iter_mut().filter(|lock| lock.relative_to.is_none()) {
        lock.angle = lock.angle.map(|angle| angle + turn);
    }
    for coil in scene.torsion_springs.iter_mut().filter(|coil| coil.relative_to.is_none()) {
        coil.free_angle += turn;
    }
    for motor in scene.motors.iter_mut().filter(|motor| motor.relative_to.is_none()) {
        motor.law.start += turn;
    }
    for force in scene.forces.iter_mut().filter(|force| !force.follows) {
        rotate(&mut force.force);
    }
    for wall in &mut scene.walls {
        rotate(&mut wall.through);
        rotate(&mut wall.normal);
    }
    scene.start.iter_mut().for_each(|start| start.phi += turn);
    for given in &mut scene.given {
        given.origin.iter_mut().for_each(rotate);
        given.velocity.iter_mut().for_each(rotate);
    }
    Related { scene, back }
}

/// The frames of bodies with other origins.
pub fn reframed(scene: &Scene, dice: &mut Dice, length: f64) -> Related {
    let mut scene = with_all_given(scene);
    let shifts: Vec<[f64; 2]> =
        scene.bars.iter().map(|_| [0, 1].map(|_| length * dice.within(-0.5, 0.5))).collect();
    let move_by = |point: &mut [f64; 2], shift: [f64; 2]| *point = [point[0] + shift[0], point[1] + shift[1]];
    for place in places(&mut scene) {
        if let Some(bar) = place.bar {
            move_by(&mut place.point, shifts[bar]);
        }
    }
    scene.bars.iter_mut().zip(&shifts).for_each(|(bar, &shift)| move_by(&mut bar.centre, shift));
    scene.forces.iter_mut().for_each(|force| move_by(&mut force.point, shifts[force.bar]));
    scene.walls.iter_mut().for_each(|wall| move_by(&mut wall.point, shifts[wall.bar]));
    for ((given, start), &shift) in scene.given.iter_mut().zip(&scene.start).zip(&shifts) {
        let arm = rotated(shift, start.phi);
        given.origin.iter_mut().for_each(|origin| move_by(origin, arm.map(|x| -x)));
        let turning = [start.omega * arm[1], -start.omega * arm[0]];
        given.velocity.iter_mut().for_each(|velocity| move_by(velocity, turning));
    }
    Related { back: Back::same(&scene), scene }
}

/// Dry friction in some of the hinges.
pub fn with_friction(scene: &mut Scene, dice: &mut Dice, length: f64) {
    for hinge in 0..scene.hinges.len() {
        if dice.chance(0.5) {
            let at = FrictionPlace::Hinge { hinge, radius: length * dice.within(0.02, 0.1) };
            scene.frictions.push(Friction { at, kinetic: 0.2, stiction: 0.3 });
        }
    }
}

/// Everything elsewhere.
pub fn shifted(scene: &Scene, shift: [f64; 2]) -> Related {
    let mut scene = with_all_given(scene);
    let back = Back { shift, ..Back::same(&scene) };
    let move_it = |point: &mut [f64; 2]| *point = [point[0] + shift[0], point[1] + shift[1]];
    places(&mut scene)
        .into_iter()
        .filter(|place| place.bar.is_none())
        .for_each(|place| move_it(&mut place.point));
    scene.walls.iter_mut().for_each(|wall| move_it(&mut wall.through));
    for given in &mut scene.given {
        given.origin.iter_mut().for_each(move_it);
    }
    Related { scene, back }
}

/// The same in other units of mass, length and time.
pub fn scaled(scene: &Scene, [mass, length, time]: [f64; 3]) -> Related {
    let mut scene = with_all_given(scene);
    let back = Back { mass, length, time, ..Back::same(&scene) };
    let force = mass * length / (time * time);
    let point = |point: &mut [f64; 2]| point.iter_mut().for_each(|x| *x *= length);
    let in_time = |law: &mut Law, size: f64| {
        law.start *= size;
        law.rate *= size / time;
        law.acceleration *= size / (time * time);
        for sine in &mut law.sines {
            *sine = Sine {
                amplitude: sine.amplitude * size,
                frequency: sine.frequency / time,
                phase: sine.phase,
            };
        }
    };
    scene.gravity.iter_mut().for_each(|g| *g *= length / (time * time));
    for bar in &mut scene.bars {
        bar.length *= length;
        bar.mass *= mass;
        bar.inertia *= mass * length * length;
        point(&mut bar.centre);
    }
    places(&mut scene).into_iter().for_each(|place| point(&mut place.point));
    for spring in &mut scene.springs {
        spring.stiffness *= force / length;
        spring.free_length *= length;
        spring.damping *= force / length * time;
    }
    for coil in &mut scene.torsion_springs {
        coil.stiffness *= force * length;
        coil.damping *= force * length * time;
    }
    for push in &mut scene.forces {
        point(&mut push.point);
        push.force.iter_mut().for_each(|f| *f *= force);
        push.law.iter_mut().for_each(|law| in_time(law, 1.0));
    }
    for torque in &mut scene.torques {
        torque.torque *= force * length;
        torque.law.iter_mut().for_each(|law| in_time(law, 1.0));
    }
    scene.motors.iter_mut().for_each(|motor| in_time(&mut motor.law, 1.0));
    scene.drives.iter_mut().for_each(|drive| in_time(&mut drive.law, length));
    for wall in &mut scene.walls {
        point(&mut wall.point);
        point(&mut wall.through);
    }
    for friction in &mut scene.frictions {
        if let FrictionPlace::Hinge { radius, .. } = &mut friction.at {
            *radius *= length;
        }
    }
    scene.start.iter_mut().for_each(|start| start.omega /= time);
    for given in &mut scene.given {
        given.origin.iter_mut().for_each(point);
        given.velocity.iter_mut().flatten().for_each(|v| *v *= length / time);
    }
    scene.until *= time;
    scene.every *= time;
    Related { scene, back }
}

/// One body made of two that are welded, with what was joined to the one now joined to either; `None` where
/// no body can be split.
pub fn split(scene: &Scene, dice: &mut Dice) -> Option<Related> {
    let mut scene = with_all_given(scene);
    let (whole, part) = (dice.pick(scene.bars.len()), scene.bars.len());
    let bar = scene.bars[whole].clone();
    if bar.inertia == 0.0 {
        return None;
    }
    let share = dice.within(0.3, 0.7);
    let back = Back { cut: Some((whole, part, share)), ..Back::same(&scene) };
    let between = dice.within(0.1, 0.7) * bar.inertia;
    let apart = (between / (bar.mass * share * (1.0 - share))).sqrt();
    let direction = dice.direction();
    let moved = |by: f64| [0, 1].map(|i| bar.centre[i] + by * apart * direction[i]);
    let of_rest = dice.within(0.3, 0.7);
    let piece = |name: String, share: f64, by: f64, of_rest: f64| Bar {
        name,
        length: bar.length,
        mass: share * bar.mass,
        centre: moved(by),
        inertia: of_rest * (bar.inertia - between),
    };
    scene.bars[whole] = piece(bar.name.clone(), share, 1.0 - share, of_rest);
    scene.bars.push(piece(format!("{}-part", bar.name), 1.0 - share, -share, 1.0 - of_rest));
    scene.start.push(scene.start[whole]);
    scene.given.push(scene.given[whole]);
    let mut other = |bar: &mut usize| {
        if *bar == whole && dice.chance(0.5) {
            *bar = part;
        }
    };
    for place in places(&mut scene) {
        place.bar.iter_mut().for_each(&mut other);
    }
    scene.locks.iter_mut().for_each(|lock| other(&mut lock.bar));
    scene.torsion_springs.iter_mut().for_each(|coil| other(&mut coil.bar));
    scene.torques.iter_mut().for_each(|torque| other(&mut torque.bar));
    scene.forces.iter_mut().for_each(|force| other(&mut force.bar));
    scene.walls.iter_mut().for_each(|wall| other(&mut wall.bar));
    let point = [0, 1].map(|_| bar.length * dice.within(-0.3, 1.0));
    let mut between = [Place { bar: Some(whole), point }, Place { bar: Some(part), point }];
    if dice.chance(0.5) {
        between.reverse();
    }
    scene.welds.push(Weld { name: "seam".into(), between });
    Some(Related { scene, back })
}

/// law(until - t).
fn backwards_in_time(law: &mut Law, until: f64) {
    law.start += law.rate * until + 0.5 * law.acceleration * until * until;
    law.rate = -(law.rate + law.acceleration * until);
    for sine in &mut law.sines {
        *sine = Sine {
            amplitude: sine.amplitude,
            frequency: -sine.frequency,
            phase: sine.phase + sine.frequency * until,
        };
    }
}

/// From the end of a run back in time.
pub fn backwards(scene: &Scene, end: &Sample) -> Scene {
    let mut scene = with_all_given(scene);
    for (k, bar) in scene.bars.iter().enumerate() {
        let (phi, omega) = (end.phi[k], -end.omega[k]);
        scene.start[k] = Start { phi, omega };
        let arm = rotated(bar.centre, phi);
        if let Some(origin) = &mut scene.given[k].origin {
            *origin = [end.centre[k][0] - arm[0], end.centre[k][1] - arm[1]];
        }
        if let Some(velocity) = &mut scene.given[k].velocity {
            *velocity = [-end.velocity[k][0] + omega * arm[1], -end.velocity[k][1] - omega * arm[0]];
        }
    }
    let until = end.t;
    scene.motors.iter_mut().for_each(|motor| backwards_in_time(&mut motor.law, until));
    scene.drives.iter_mut().for_each(|drive| backwards_in_time(&mut drive.law, until));
    scene
        .forces
        .iter_mut()
        .filter_map(|force| force.law.as_mut())
        .for_each(|law| backwards_in_time(law, until));
    scene
        .torques
        .iter_mut()
        .filter_map(|torque| torque.law.as_mut())
        .for_each(|law| backwards_in_time(law, until));
    scene
}

/// True where nothing tells the direction of time.
pub fn is_reversible(scene: &Scene) -> bool {
    scene.frictions.is_empty()
        && scene.springs.iter().all(|spring| spring.damping == 0.0)
        && scene.torsion_springs.iter().all(|coil| coil.damping == 0.0)
        && scene.walls.iter().all(|wall| wall.restitution == 1.0)
}
