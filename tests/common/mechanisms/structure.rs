//! The bodies and how they hang: every joint here places a body that was not placed before.

use super::{Kind, Model, Uniform};
use driftless::scene::{Bar, Hinge, Place, Rail, Slider, Start, Weld};
use std::f64::consts::{PI, TAU};

/// How a new body is joined to what is there.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Joint {
    Hinge,
    SharedHinge,
    Floating,
    GroundSlider,
    BodySlider,
    Weld,
}

impl Model {
    /// Bodies, each joined to the ground or to one before it.
    pub(super) fn build(&mut self) {
        let joints = self.joints();
        let mut hung = true;
        for joint in joints {
            hung &= matches!(joint, Joint::Hinge | Joint::SharedHinge);
            self.add_bar(hung);
            match joint {
                Joint::Hinge => self.hang(false),
                Joint::SharedHinge => self.hang(true),
                Joint::Floating => self.float(),
                Joint::GroundSlider => self.put_on_rail(true),
                Joint::BodySlider => self.put_on_rail(false),
                Joint::Weld => self.weld(),
            }
        }
    }

    /// How each body is joined: wanted ways first come in any order after the first body.
    fn joints(&mut self) -> Vec<Joint> {
        let mut joints = Vec::new();
        let ways = [
            (Kind::SharedHinge, Joint::SharedHinge),
            (Kind::GroundSlider, Joint::GroundSlider),
            (Kind::BodySlider, Joint::BodySlider),
            (Kind::Weld, Joint::Weld),
            (Kind::FloatingBody, Joint::Floating),
            (Kind::FloatingGroup, Joint::Floating),
        ];
        joints.extend(ways.into_iter().filter(|(kind, _)| self.wants(*kind)).map(|(_, joint)| joint));
        let sliding = joints.iter().any(|joint| matches!(joint, Joint::GroundSlider | Joint::BodySlider));
        if (self.wants(Kind::LockedSlider) || self.wants(Kind::SliderMotor)) && !sliding {
            joints.push(if self.dice.chance(0.5) { Joint::GroundSlider } else { Joint::BodySlider });
        }
        let needs = |kind| match kind {
            Kind::Loop => 3,
            Kind::SharedHinge | Kind::FloatingGroup | Kind::RelativeLock | Kind::RigidSpring => 2,
            Kind::BodySpring
            | Kind::RelativeTorsionSpring
            | Kind::RelativeTorque
            | Kind::RelativeMotor
            | Kind::Lock => 2,
            _ => 1,
        };
        let least = self.wanted.iter().map(|&kind| needs(kind)).max().unwrap_or(1);
        let count = (joints.len() + usize::from(self.wants(Kind::FloatingGroup))).max(least)
            + self.dice.one(&[0, 0, 0, 1, 1, 2]);
        while joints.len() < count.max(1) {
            let joint = self.dice.one(&[
                Joint::Hinge,
                Joint::Hinge,
                Joint::Hinge,
                Joint::Hinge,
                Joint::Hinge,
                Joint::SharedHinge,
                Joint::Floating,
                Joint::GroundSlider,
                Joint::BodySlider,
                Joint::Weld,
            ]);
            let is_plain = self.dice.chance(0.7);
            joints.push(if is_plain { Joint::Hinge } else { joint });
        }
        let order = self.dice.order(joints.len());
        let mut joints: Vec<Joint> = order.into_iter().map(|k| joints[k]).collect();
        if self.wants(Kind::PointMass) {
            joints.insert(0, Joint::Hinge);
        }
        joints
    }

    /// A bar; it may be a point mass only where it is `hung` on the ground by hinges, which give it an
    /// inertia.
    fn add_bar(&mut self, hung: bool) {
        let k = self.bars.len();
        let length = self.scales.length * self.dice.size(0.6, 1.5);
        let mut mass = self.scales.mass * self.dice.size(0.4, 2.5);
        let is_light = self.takes(Kind::LightBody, 0.02) && !self.kinds.contains(&Kind::LightBody);
        if is_light {
            mass *= self.dice.size(1e-4, 1e-2);
            self.kinds.insert(Kind::LightBody);
        }
        let is_off_axis = self.takes(Kind::OffAxis, 0.3);
        let is_point = hung && self.wants(Kind::PointMass) && !self.kinds.contains(&Kind::PointMass);
        let name = format!("b{k}");
        if !is_off_axis && !is_point && self.dice.chance(0.5) {
            let (width, thickness) = (length * self.dice.size(0.05, 0.3), length * self.dice.size(0.01, 0.1));
            let inertia = self.dice.one(&[None, Some("full"), Some("slender")]);
            self.uniform.push(Some(Uniform {
                width,
                thickness,
                density: mass / (length * width * thickness),
                inertia,
            }));
            self.bars.push(Bar {
                name,
                length,
                mass,
                centre: [0.5 * length, 0.0],
                inertia: mass * length * length / 12.0,
            });
        } else {
            let aside = if is_off_axis { self.dice.signed(0.05, 0.3) } else { 0.0 };
            let along = self.dice.within(0.25, 0.75);
            let inertia = if is_point { 0.0 } else { mass * length * length * self.dice.size(0.03, 0.2) };
            if is_off_axis {
                self.kinds.insert(Kind::OffAxis);
            }
            if is_point {
                self.kinds.insert(Kind::PointMass);
            }
            self.uniform.push(None);
            self.bars.push(Bar { name, length, mass, centre: [along * length, aside * length], inertia });
        }
        let turns = if self.dice.chance(0.06) { TAU * self.dice.one(&[-2.0, -1.0, 1.0, 3.0]) } else { 0.0 };
        self.start.push(Start { phi: self.dice.within(-PI, PI) + turns, omega: 0.0 });
        self.origin.push([0.0; 2]);
        self.velocity.push([0.0; 2]);
    }

    /// A body among those before the last, or the ground.
    fn parent(&mut self, ground: f64) -> Option<usize> {
        let before = self.bars.len() - 1;
        if before == 0 || self.dice.chance(ground) {
            None
        } else {
            Some(if self.dice.chance(0.6) { before - 1 } else { self.dice.pick(before) })
        }
    }

    /// A point of a body, or of the ground near by.
    fn spot_of(&mut self, bar: Option<usize>) -> Place {
        match bar {
            Some(bar) => self.spot(bar),
            None => {
                let size = self.scales.length;
                let point = if self.dice.chance(0.4) {
                    [0.0; 2]
                } else {
                    [0, 1].map(|_| size * self.dice.within(-1.5, 1.5))
                };
                Place { bar: None, point }
            }
        }
    }

    /// A point of the last body where it is held.
    fn own_point(&mut self) -> [f64; 2] {
        let (last, length) = (self.bars.len() - 1, self.bars[self.bars.len() - 1].length);
        // A point mass must move when its body turns.
        let is_plain = self.bars[last].inertia == 0.0 || self.dice.chance(0.7);
        if is_plain {
            [0.0; 2]
        } else {
            [length * self.dice.within(-0.1, 0.3), length * self.dice.within(-0.2, 0.2)]
        }
    }

    /// Moves the last body so that its point is at a place of the world.
    fn bring(&mut self, point: [f64; 2], to: [f64; 2]) {
        let last = self.bars.len() - 1;
        let arm = self.turned(last, point);
        self.origin[last] = [to[0] - arm[0], to[1] - arm[1]];
    }

    fn hang(&mut self, shared: bool) {
        let last = self.bars.len() - 1;
        let existing = if shared && !self.hinges.is_empty() {
            let hinge = self.dice.pick(self.hinges.len());
            self.kinds.insert(Kind::SharedHinge);
            self.focus.push(last);
            Some(self.hinges[hinge].between[self.dice.pick(2)])
        } else {
            None
        };
        let there = match existing {
            Some(place) => place,
            None => {
                let parent = self.parent(0.25);
                self.spot_of(parent)
            }
        };
        let own = self.own_point();
        self.bring(own, self.at(&there));
        let mut between = [there, Place { bar: Some(last), point: own }];
        if self.dice.chance(0.4) {
            between.reverse();
        }
        self.hinges.push(Hinge { name: format!("hinge{}", self.hinges.len()), between });
    }

    fn float(&mut self) {
        let last = self.bars.len() - 1;
        let size = self.scales.length;
        let at = [0, 1].map(|_| size * self.dice.within(-2.0, 2.0));
        self.bring([0.0; 2], at);
        self.focus.push(last);
        if self.wants(Kind::FloatingGroup) && !self.kinds.contains(&Kind::FloatingGroup) {
            self.kinds.insert(Kind::FloatingGroup);
            // Another body hangs on this one.
            self.add_bar(false);
            let there = self.spot(last);
            let own = self.own_point();
            self.bring(own, self.at(&there));
            let between = [there, Place { bar: Some(last + 1), point: own }];
            self.hinges.push(Hinge { name: format!("hinge{}", self.hinges.len()), between });
            self.focus.push(last + 1);
        } else {
            self.kinds.insert(Kind::FloatingBody);
        }
    }

    fn put_on_rail(&mut self, ground: bool) {
        let last = self.bars.len() - 1;
        let parent = if ground { None } else { self.parent(0.0) };
        let travel = self.scales.length * self.dice.signed(0.05, 0.8);
        let direction = self.dice.direction();
        let is_own_rail = !ground && self.dice.chance(0.4);
        let (point, place);
        if is_own_rail {
            // A point of the parent, or of the ground, in a slot of the new body.
            point = self.spot_of(parent);
            let origin_point = self.own_point();
            place = Place { bar: Some(last), point: origin_point };
            self.bring(
                [origin_point[0] + travel * direction[0], origin_point[1] + travel * direction[1]],
                self.at(&point),
            );
        } else {
            let own = self.own_point();
            point = Place { bar: Some(last), point: own };
            place = self.spot_of(parent);
            let (origin_point, along) =
                (self.at(&place), parent.map_or(direction, |bar| self.turned(bar, direction)));
            self.bring(own, [origin_point[0] + travel * along[0], origin_point[1] + travel * along[1]]);
        }
        let locked = self.takes(Kind::LockedSlider, 0.25);
        self.add_slider(Slider { name: String::new(), point, rail: Rail { place, direction }, locked });
    }

    pub(super) fn add_slider(&mut self, slider: Slider) {
        self.kinds.insert(if slider.rail.place.bar.is_some() {
            Kind::BodySlider
        } else {
            Kind::GroundSlider
        });
        if slider.locked {
            self.kinds.insert(Kind::LockedSlider);
        }
        self.focus.extend(slider.point.bar);
        self.focus.extend(slider.rail.place.bar);
        self.sliders.push(Slider { name: format!("slider{}", self.sliders.len()), ..slider });
    }

    fn weld(&mut self) {
        let last = self.bars.len() - 1;
        let parent = self.parent(0.05);
        let there = self.spot_of(parent);
        let own = self.own_point();
        self.bring(own, self.at(&there));
        let mut between = [there, Place { bar: Some(last), point: own }];
        if self.dice.chance(0.4) {
            between.reverse();
        }
        self.kinds.insert(Kind::Weld);
        self.focus.push(last);
        self.welds.push(Weld { name: format!("weld{}", self.welds.len()), between });
    }
}
