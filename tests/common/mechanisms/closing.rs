//! Constraints between bodies that are placed already, and motors.

use super::constraints::Basis;
use super::{Kind, Model, minus, norm};
use driftless::scene::{Drive, Hinge, Law, Lock, Motor, Place, Rail, Sine, Slider, Spring};

/// Trials to find where a constraint that is wanted can be added.
const TRIALS: usize = 12;

impl Model {
    /// Loops, closing sliders, rigid springs and locks, as long as something is left to move.
    pub(super) fn close(&mut self, basis: &mut Basis) {
        if self.takes(Kind::Loop, 0.12) && self.try_hard(basis, Self::close_loop) {
            self.kinds.insert(Kind::Loop);
            self.is_coupled = true;
        }
        let wants_slider = self.wants(Kind::GroundSlider) || self.wants(Kind::BodySlider);
        let chance = if wants_slider { 0.3 } else { 0.06 };
        if self.dice.chance(chance) && self.try_hard(basis, Self::close_slider) {
            self.is_coupled = true;
        }
        if self.takes(Kind::RigidSpring, 0.04) && self.try_hard(basis, Self::stiffen) {
            self.kinds.insert(Kind::RigidSpring);
            self.is_coupled = true;
        }
        if self.takes(Kind::Lock, 0.04) && self.try_hard(basis, |model, basis| model.lock(basis, false)) {
            self.kinds.insert(Kind::Lock);
        }
        if self.takes(Kind::RelativeLock, 0.04)
            && self.try_hard(basis, |model, basis| model.lock(basis, true))
        {
            self.kinds.insert(Kind::RelativeLock);
        }
        self.is_coupled |= !self.sliders.is_empty();
    }

    fn try_hard(&mut self, basis: &mut Basis, once: impl Fn(&mut Self, &mut Basis) -> bool) -> bool {
        (0..TRIALS).any(|_| once(self, basis))
    }

    /// Adds rows where at least one degree of freedom is left.
    fn takes_rows(basis: &mut Basis, rows: &[Vec<f64>]) -> bool {
        basis.freedom() > rows.len() && basis.add(rows)
    }

    fn close_loop(&mut self, basis: &mut Basis) -> bool {
        let a = self.dice.pick(self.bars.len());
        let b = self.another(a, 0.5);
        let here = self.spot(a);
        let there = self.place(b, self.at(&here));
        if b.is_some() && norm(there.point) > 2.5 * self.scales.length {
            return false;
        }
        let mut between = [here, there];
        if self.dice.chance(0.5) {
            between.reverse();
        }
        if !Self::takes_rows(basis, &self.pin(&between)) {
            return false;
        }
        self.focus.push(a);
        self.focus.extend(b);
        self.hinges.push(Hinge { name: format!("hinge{}", self.hinges.len()), between });
        true
    }

    fn close_slider(&mut self, basis: &mut Basis) -> bool {
        let a = self.dice.pick(self.bars.len());
        let wants_body = self.wants(Kind::BodySlider);
        let b = self.another(a, if wants_body { 0.1 } else { 0.7 });
        let point = self.spot(a);
        let (at, along) = (self.at(&point), self.dice.direction());
        let travel = self.scales.length * self.dice.signed(0.05, 0.8);
        let place = self.place(b, [at[0] - travel * along[0], at[1] - travel * along[1]]);
        if b.is_some() && norm(place.point) > 2.0 * self.scales.length {
            return false;
        }
        let direction = b.map_or(along, |bar| {
            let (s, c) = self.start[bar].phi.sin_cos();
            [c * along[0] + s * along[1], c * along[1] - s * along[0]]
        });
        let slider = Slider { name: String::new(), point, rail: Rail { place, direction }, locked: false };
        if !Self::takes_rows(basis, &self.slide(&slider)) {
            return false;
        }
        self.add_slider(slider);
        true
    }

    /// A rigid spring of its present length: a rod.
    fn stiffen(&mut self, basis: &mut Basis) -> bool {
        let between = self.ends(0.5);
        let length = norm(minus(self.at(&between[0]), self.at(&between[1])));
        let is_near = (0.3..2.0).contains(&(length / self.scales.length));
        if !is_near || !Self::takes_rows(basis, &[self.rod(&between)]) {
            return false;
        }
        self.focus.extend(between.iter().filter_map(|place| place.bar));
        let stiffness = self.scales.force / self.scales.length * self.dice.size(1e5, 1e8);
        let name = format!("rod{}", self.springs.len());
        self.springs.push(Spring {
            name,
            between,
            stiffness,
            free_length: length,
            damping: 0.0,
            rigid: true,
        });
        true
    }

    fn lock(&mut self, basis: &mut Basis, relative: bool) -> bool {
        let bar = self.some_body();
        let relative_to = if relative { self.another(bar, 0.0) } else { None };
        if relative != relative_to.is_some()
            || !Self::takes_rows(basis, &[self.angle(Some(bar), relative_to)])
        {
            return false;
        }
        self.focus.push(bar);
        let angle = self.start[bar].phi - relative_to.map_or(0.0, |base| self.start[base].phi);
        let angle = self.dice.chance(0.5).then_some(angle);
        self.locks.push(Lock { name: format!("lock{}", self.locks.len()), bar, relative_to, angle });
        true
    }

    /// Places a good distance apart on two bodies, or on a body and the ground.
    pub(super) fn ends(&mut self, ground: f64) -> [Place; 2] {
        let a = self.some_body();
        let b = self.another(a, ground);
        let here = self.spot(a);
        let there = match b {
            Some(b) => self.spot(b),
            None => {
                let (at, direction, far) =
                    (self.at(&here), self.dice.direction(), self.scales.length * self.dice.within(0.5, 1.4));
                Place { bar: None, point: [at[0] + far * direction[0], at[1] + far * direction[1]] }
            }
        };
        if self.dice.chance(0.5) { [here, there] } else { [there, here] }
    }

    pub(super) fn wants_motor(&self) -> bool {
        let motors = [
            Kind::Motor,
            Kind::RelativeMotor,
            Kind::SliderMotor,
            Kind::FullyDriven,
            Kind::SineLaw,
            Kind::AcceleratedLaw,
        ];
        motors.into_iter().any(|kind| self.wants(kind))
    }

    /// Motors whose laws agree with the start.
    pub(super) fn drive(&mut self, basis: &mut Basis) {
        let laws = self.wants(Kind::SineLaw) || self.wants(Kind::AcceleratedLaw);
        let named =
            self.wants(Kind::Motor) || self.wants(Kind::RelativeMotor) || self.wants(Kind::SliderMotor);
        if self.takes(Kind::Motor, if laws && !named { 1.0 } else { 0.08 }) {
            self.drive_one(basis, 0);
        }
        if self.takes(Kind::RelativeMotor, 0.03) {
            self.drive_one(basis, 1);
        }
        if self.takes(Kind::SliderMotor, 0.03) {
            self.drive_one(basis, 2);
        }
        if self.wants(Kind::FullyDriven) {
            for _ in 0..4 * TRIALS {
                let way = self.dice.pick(3);
                if basis.freedom() == 0 || basis.freedom() > 4 {
                    return;
                }
                self.drive_one(basis, way);
            }
        }
    }

    /// A motor on an angle (0), a relative angle (1) or a slider (2).
    fn drive_one(&mut self, basis: &mut Basis, way: usize) {
        for _ in 0..TRIALS {
            if basis.freedom() <= usize::from(!self.wants(Kind::FullyDriven)) {
                return;
            }
            if way == 2 {
                if self.sliders.is_empty() {
                    return;
                }
                let slider = self.dice.pick(self.sliders.len());
                if basis.add(&[self.travel_row(&self.sliders[slider])]) {
                    let at = self.travel(&self.sliders[slider]);
                    let law = self.law_through(at, self.scales.length);
                    let name = format!("drive{}", self.drives.len());
                    self.drives.push(Drive { name, slider, law });
                    self.kinds.insert(Kind::SliderMotor);
                    return;
                }
                continue;
            }
            let bar = self.some_body();
            let relative_to = if way == 1 { self.another(bar, 0.0) } else { None };
            if (way == 1) == relative_to.is_some() && basis.add(&[self.angle(Some(bar), relative_to)]) {
                let (own, base) = (self.start[bar], relative_to.map(|base| self.start[base]));
                let at = [
                    own.phi - base.map_or(0.0, |base| base.phi),
                    own.omega - base.map_or(0.0, |base| base.omega),
                ];
                let law = self.law_through(at, 1.0);
                let name = format!("motor{}", self.motors.len());
                self.motors.push(Motor { name, bar, relative_to, law });
                self.kinds.insert(if way == 1 { Kind::RelativeMotor } else { Kind::Motor });
                self.focus.push(bar);
                return;
            }
        }
    }

    /// A law with this value and rate at t = 0, in units of `size`; it does not go far where bodies are
    /// coupled.
    fn law_through(&mut self, [value, rate]: [f64; 2], size: f64) -> Law {
        let time = self.scales.time;
        let mut law = Law { start: value, rate, acceleration: 0.0, sines: Vec::new(), profile: None };
        let has_sine = self.takes(Kind::SineLaw, 0.25) || self.is_coupled;
        if has_sine {
            let (frequency, phase) = (self.dice.size(0.8, 3.0) / time, self.dice.within(-1.0, 1.0));
            let sine = if !self.is_coupled {
                Sine { amplitude: size * self.dice.signed(0.1, 0.5), frequency, phase }
            } else if rate == 0.0 {
                // At the end of its swing it is at rest, to rounding.
                Sine {
                    amplitude: size * self.dice.signed(0.05, 0.2),
                    frequency,
                    phase: std::f64::consts::FRAC_PI_2,
                }
            } else {
                Sine { amplitude: rate / (frequency * phase.cos()), frequency, phase }
            };
            law.start -= sine.amplitude * sine.phase.sin();
            law.rate -= sine.amplitude * frequency * sine.phase.cos();
            law.sines.push(sine);
            self.kinds.insert(Kind::SineLaw);
        }
        if self.takes(Kind::AcceleratedLaw, 0.1) {
            let strength = if self.is_coupled { 0.03 } else { 0.4 };
            law.acceleration = strength * size / (time * time) * self.dice.signed(0.3, 1.0);
            self.kinds.insert(Kind::AcceleratedLaw);
        }
        law
    }
}
