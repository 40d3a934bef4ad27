//! Springs, forces, torques and walls.

use super::{Kind, Model, dot, minus, norm};
use driftless::scene::{Force, Law, Place, Sine, Spring, Torque, TorsionSpring, Wall};

impl Model {
    pub(super) fn load(&mut self) {
        self.springs_of_all_kinds();
        self.coils();
        self.push();
        self.twist();
    }

    fn springs_of_all_kinds(&mut self) {
        let between_bodies = self.takes(Kind::BodySpring, 0.08) && self.bars.len() > 1;
        let is_zero = self.takes(Kind::ZeroLengthSpring, 0.04);
        let is_damper = self.takes(Kind::DamperAlone, 0.03);
        let is_damped = self.takes(Kind::Damper, 0.03);
        if between_bodies {
            let is_so = is_damped && self.dice.chance(0.5);
            self.spring(0.0, false, is_so);
        }
        if is_zero {
            let damping = is_damped && self.dice.chance(0.3);
            self.spring(0.5, true, damping);
        }
        if self.takes(Kind::Spring, 0.12) || (is_damped && !self.kinds.contains(&Kind::Damper)) {
            self.spring(1.0, false, is_damped);
        }
        if is_damper && let Some(between) = self.apart(0.5) {
            let damping = self.scales.mass / self.scales.time * self.dice.size(0.1, 1.0);
            let free_length = if self.dice.chance(0.5) { 0.0 } else { self.scales.length };
            self.add_spring(Spring {
                name: String::new(),
                between,
                stiffness: 0.0,
                free_length,
                damping,
                rigid: false,
            });
            self.kinds.insert(Kind::DamperAlone);
        }
    }

    /// Ends that are a good distance apart.
    fn apart(&mut self, ground: f64) -> Option<[Place; 2]> {
        (0..20).find_map(|_| {
            let ends = self.ends(ground);
            (norm(minus(self.at(&ends[0]), self.at(&ends[1]))) > 0.3 * self.scales.length).then_some(ends)
        })
    }

    fn spring(&mut self, ground: f64, zero: bool, damped: bool) {
        let Some(between) = self.apart(ground) else {
            return;
        };
        let length = norm(minus(self.at(&between[0]), self.at(&between[1])));
        let free_length = if zero { 0.0 } else { length * self.dice.within(0.4, 1.3) };
        let stiffness = self.scales.force / self.scales.length * self.dice.size(1.0, 20.0);
        let damping =
            if damped { self.scales.mass / self.scales.time * self.dice.size(0.1, 1.0) } else { 0.0 };
        let is_grounded = between.iter().any(|place| place.bar.is_none());
        self.kinds.insert(if is_grounded { Kind::Spring } else { Kind::BodySpring });
        if zero {
            self.kinds.insert(Kind::ZeroLengthSpring);
        }
        if damped {
            self.kinds.insert(Kind::Damper);
        }
        self.add_spring(Spring {
            name: String::new(),
            between,
            stiffness,
            free_length,
            damping,
            rigid: false,
        });
    }

    fn add_spring(&mut self, spring: Spring) {
        self.focus.extend(spring.between.iter().filter_map(|place| place.bar));
        self.springs.push(Spring { name: format!("spring{}", self.springs.len()), ..spring });
    }

    fn coils(&mut self) {
        let is_damped = self.takes(Kind::TorsionDamper, 0.03);
        let relative = self.takes(Kind::RelativeTorsionSpring, 0.06) && self.bars.len() > 1;
        if relative {
            let is_so = is_damped && self.dice.chance(0.5);
            self.coil(true, is_so);
        }
        if self.takes(Kind::TorsionSpring, 0.08) || (is_damped && !self.kinds.contains(&Kind::TorsionDamper))
        {
            self.coil(false, is_damped);
        }
    }

    fn coil(&mut self, relative: bool, damped: bool) {
        let bar = self.some_body();
        let relative_to = if relative { self.another(bar, 0.0) } else { None };
        let angle = self.start[bar].phi - relative_to.map_or(0.0, |base| self.start[base].phi);
        let unit = self.scales.force * self.scales.length;
        let is_damper_alone = damped && self.dice.chance(0.2);
        let stiffness = if is_damper_alone { 0.0 } else { unit * self.dice.size(0.2, 4.0) };
        let damping = if damped { unit * self.scales.time * self.dice.size(0.03, 0.5) } else { 0.0 };
        let free_angle = angle + self.dice.within(-1.5, 1.5);
        let name = format!("coil{}", self.torsion_springs.len());
        self.torsion_springs.push(TorsionSpring { name, bar, relative_to, stiffness, free_angle, damping });
        self.kinds.insert(if relative_to.is_some() {
            Kind::RelativeTorsionSpring
        } else {
            Kind::TorsionSpring
        });
        if damped {
            self.kinds.insert(Kind::TorsionDamper);
        }
        self.focus.push(bar);
    }

    fn push(&mut self) {
        let has_law = self.takes(Kind::ForceLaw, 0.03);
        if self.takes(Kind::Force, 0.05) {
            let is_so = has_law && self.dice.chance(0.5);
            self.force(false, is_so);
        }
        if self.takes(Kind::BodyForce, 0.05) || (has_law && !self.kinds.contains(&Kind::ForceLaw)) {
            let follows = self.takes(Kind::BodyForce, 0.5);
            self.force(follows, has_law);
        }
    }

    fn force(&mut self, follows: bool, has_law: bool) {
        let bar = self.some_body();
        let point = self.spot(bar).point;
        let (direction, size) = (self.dice.direction(), self.scales.force * self.dice.size(0.2, 1.5));
        let law = if has_law { Some(self.factor()) } else { None };
        let name = format!("force{}", self.forces.len());
        self.forces.push(Force { name, bar, point, force: direction.map(|x| x * size), follows, law });
        self.kinds.insert(if follows { Kind::BodyForce } else { Kind::Force });
        if has_law {
            self.kinds.insert(Kind::ForceLaw);
        }
        self.focus.push(bar);
    }

    fn twist(&mut self) {
        let has_law = self.takes(Kind::TorqueLaw, 0.03);
        let relative = self.takes(Kind::RelativeTorque, 0.04) && self.bars.len() > 1;
        if relative {
            let is_so = has_law && self.dice.chance(0.5);
            self.torque(true, is_so);
        }
        if self.takes(Kind::Torque, 0.05) || (has_law && !self.kinds.contains(&Kind::TorqueLaw)) {
            self.torque(false, has_law);
        }
    }

    fn torque(&mut self, relative: bool, has_law: bool) {
        let bar = self.some_body();
        let relative_to = if relative { self.another(bar, 0.0) } else { None };
        let torque = self.scales.force * self.scales.length * self.dice.signed(0.1, 0.8);
        let law = if has_law { Some(self.factor()) } else { None };
        let name = format!("torque{}", self.torques.len());
        self.torques.push(Torque { name, bar, relative_to, torque, law });
        self.kinds.insert(if relative_to.is_some() { Kind::RelativeTorque } else { Kind::Torque });
        if has_law {
            self.kinds.insert(Kind::TorqueLaw);
        }
        self.focus.push(bar);
    }

    /// A factor of about one as a function of time.
    fn factor(&mut self) -> Law {
        let time = self.scales.time;
        let mut law = Law {
            start: self.dice.within(-1.0, 1.0),
            rate: 0.0,
            acceleration: 0.0,
            sines: Vec::new(),
            profile: None,
        };
        if self.dice.chance(0.4) {
            law.rate = self.dice.signed(0.1, 0.5) / time;
        }
        if self.dice.chance(0.2) {
            law.acceleration = self.dice.signed(0.05, 0.3) / (time * time);
        }
        for _ in 0..self.dice.one(&[0, 1, 1, 2]) {
            let frequency = self.dice.size(0.5, 4.0) / time;
            law.sines.push(Sine {
                amplitude: self.dice.signed(0.3, 1.2),
                frequency,
                phase: self.dice.within(-3.0, 3.0),
            });
        }
        law
    }

    /// Walls in the way of points that move, or are about to.
    pub(super) fn wall(&mut self) {
        let touching = self.takes(Kind::TouchingWall, 0.02);
        let kinds = [
            (Kind::PlasticWall, 0.0),
            (Kind::Wall, self.dice.one(&[0.3, 0.5, 0.9])),
            (Kind::ElasticWall, 1.0),
        ];
        let mut some = false;
        for (kind, restitution) in kinds {
            if self.takes(kind, 0.05) {
                self.one_wall(kind, restitution, false);
                some = true;
            }
        }
        if touching {
            let (kind, restitution) = self.dice.one(&kinds);
            self.one_wall(kind, restitution, true);
            self.kinds.insert(Kind::TouchingWall);
        }
        if some && self.dice.chance(0.25) {
            let (kind, restitution) = self.dice.one(&kinds);
            self.one_wall(kind, restitution, false);
        }
    }

    fn one_wall(&mut self, kind: Kind, restitution: f64, touching: bool) {
        let bar = self.some_body();
        let place = self.spot(bar);
        let (at, velocity) = (self.at(&place), self.velocity_at(&place));
        let (size, time) = (self.scales.length, self.scales.time);
        // Where it will be in a while if nothing held it.
        let speed = norm(velocity);
        let is_moving = speed > 0.05 * size / time;
        let ahead = [0, 1].map(|i| velocity[i] * time + 0.3 * self.gravity[i] * time * time);
        let way = if is_moving || norm(ahead) > 0.05 * size {
            ahead
        } else {
            self.dice.direction().map(|x| x * size)
        };
        let turn: f64 = self.dice.within(-0.9, 0.9);
        let (s, c) = turn.sin_cos();
        let heading = way.map(|x| x / norm(way));
        let towards = [c * heading[0] - s * heading[1], s * heading[0] + c * heading[1]];
        let gap = if touching { 0.0 } else { size * self.dice.size(0.02, 0.4) };
        let normal = towards.map(|x| -x);
        let along = size * self.dice.within(-1.0, 1.0);
        let through =
            [at[0] + gap * towards[0] - along * towards[1], at[1] + gap * towards[1] + along * towards[0]];
        debug_assert!(dot(minus(at, through), normal) >= -1e-12 * size);
        let name = format!("wall{}", self.walls.len());
        self.walls.push(Wall {
            name,
            bar,
            point: place.point,
            on: None,
            through,
            normal,
            law: None,
            aim: None,
            restitution,
        });
        self.kinds.insert(kind);
    }
}
