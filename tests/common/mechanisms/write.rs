//! The text of a scene: keys that may be left out are left out at times, and bodies stand in any order.

use super::{Model, Uniform};
use driftless::scene::{Bar, Given, Law, Place, Slider};
use serde_json::{Map, Value, json};

fn law(law: &Law) -> Value {
    let mut made = Map::new();
    made.insert("start".into(), json!(law.start));
    if law.rate != 0.0 {
        made.insert("rate".into(), json!(law.rate));
    }
    if law.acceleration != 0.0 {
        made.insert("acceleration".into(), json!(law.acceleration));
    }
    if !law.sines.is_empty() {
        let sines = law.sines.iter().map(
            |sine| json!({"amplitude": sine.amplitude, "frequency": sine.frequency, "phase": sine.phase}),
        );
        made.insert("sines".into(), sines.collect());
    }
    Value::Object(made)
}

fn bar(bar: &Bar, uniform: &Option<Uniform>) -> Value {
    match uniform {
        Some(Uniform { width, thickness, density, inertia }) => {
            let mut made = json!({"name": bar.name, "length": bar.length, "width": width, "thickness": thickness, "density": density});
            if let Some(inertia) = inertia {
                made["inertia"] = json!(inertia);
            }
            made
        }
        None => {
            json!({"name": bar.name, "mass": bar.mass, "centre": bar.centre, "inertia": bar.inertia, "length": bar.length})
        }
    }
}

impl Model {
    fn name(&self, bar: Option<usize>) -> &str {
        bar.map_or("ground", |bar| &self.bars[bar].name)
    }

    fn written(&self, place: &Place) -> Value {
        json!({"body": self.name(place.bar), "point": place.point})
    }

    fn both(&self, between: &[Place; 2]) -> Value {
        json!([self.written(&between[0]), self.written(&between[1])])
    }

    /// True for each body that hinges and welds tie to the ground.
    fn hung(&self) -> Vec<bool> {
        let mut hung = vec![false; self.bars.len()];
        let is_hung = |hung: &[bool], place: &Place| place.bar.is_none_or(|bar| hung[bar]);
        for _ in 0..self.bars.len() {
            for between in self
                .hinges
                .iter()
                .map(|hinge| &hinge.between)
                .chain(self.welds.iter().map(|weld| &weld.between))
            {
                if between.iter().any(|place| is_hung(&hung, place)) {
                    between.iter().filter_map(|place| place.bar).for_each(|bar| hung[bar] = true);
                }
            }
        }
        hung
    }

    fn slider(&self, slider: &Slider, length: f64) -> Value {
        let direction = slider.rail.direction.map(|x| x * length);
        let rail = json!({"body": self.name(slider.rail.place.bar), "point": slider.rail.place.point, "direction": direction});
        let mut made = json!({"name": slider.name, "point": self.written(&slider.point), "rail": rail});
        if slider.locked {
            made["angle"] = json!("locked");
        }
        made
    }

    /// With the key `relative_to`, or at times `ground` there, or none.
    fn relative(&mut self, mut made: Value, relative_to: Option<usize>) -> Value {
        if relative_to.is_some() || self.dice.chance(0.1) {
            made["relative_to"] = json!(self.name(relative_to));
        }
        made
    }

    /// The lists of loads and motors.
    fn acting(&mut self) -> Map<String, Value> {
        let mut scene = Map::new();
        let springs = self.springs.iter().map(|spring| {
            let mut made = json!({"name": spring.name, "between": self.both(&spring.between), "stiffness": spring.stiffness, "free_length": spring.free_length});
            if spring.damping != 0.0 {
                made["damping"] = json!(spring.damping);
            }
            if spring.rigid {
                made["model"] = json!("rigid");
            }
            made
        });
        scene.insert("springs".into(), springs.collect());
        let mut coils = Vec::new();
        for coil in self.torsion_springs.clone() {
            let body = self.name(Some(coil.bar));
            let mut made = json!({"name": coil.name, "body": body, "stiffness": coil.stiffness, "free_angle": coil.free_angle});
            if coil.damping != 0.0 {
                made["damping"] = json!(coil.damping);
            }
            coils.push(self.relative(made, coil.relative_to));
        }
        scene.insert("torsion_springs".into(), json!(coils));
        let forces = self.forces.iter().map(|force| {
            let mut made = json!({"name": force.name, "body": self.name(Some(force.bar)), "point": force.point, "force": force.force});
            if force.follows {
                made["frame"] = json!("body");
            }
            if let Some(factor) = &force.law {
                made["law"] = law(factor);
            }
            made
        });
        scene.insert("forces".into(), forces.collect());
        let mut torques = Vec::new();
        for torque in self.torques.clone() {
            let mut made =
                json!({"name": torque.name, "body": self.name(Some(torque.bar)), "torque": torque.torque});
            if let Some(factor) = &torque.law {
                made["law"] = law(factor);
            }
            torques.push(self.relative(made, torque.relative_to));
        }
        scene.insert("torques".into(), json!(torques));
        let mut motors = Vec::new();
        for motor in self.motors.clone() {
            let made =
                json!({"name": motor.name, "body": self.name(Some(motor.bar)), "law": law(&motor.law)});
            motors.push(self.relative(made, motor.relative_to));
        }
        let drives = self.drives.iter();
        motors.extend(drives.map(|drive| json!({"name": drive.name, "slider": self.sliders[drive.slider].name, "law": law(&drive.law)})));
        scene.insert("motors".into(), json!(motors));
        let walls = self.walls.iter().map(|wall| {
            let line = json!({"through": wall.through, "normal": wall.normal});
            json!({"name": wall.name, "body": self.name(Some(wall.bar)), "point": wall.point, "line": line, "restitution": wall.restitution})
        });
        scene.insert("walls".into(), walls.collect());
        scene
    }

    /// The scene file.
    pub(super) fn text(&mut self) -> String {
        let mut scene = Map::new();
        scene.insert("name".into(), json!("random"));
        scene.insert("gravity".into(), json!(self.gravity));
        let order = self.dice.order(self.bars.len());
        scene.insert("bars".into(), order.iter().map(|&k| bar(&self.bars[k], &self.uniform[k])).collect());
        let hinges =
            self.hinges.iter().map(|hinge| json!({"name": hinge.name, "between": self.both(&hinge.between)}));
        scene.insert("hinges".into(), hinges.collect());
        let length = if self.dice.chance(0.5) { 1.0 } else { self.dice.size(0.1, 10.0) };
        scene.insert(
            "sliders".into(),
            self.sliders.iter().map(|slider| self.slider(slider, length)).collect(),
        );
        let welds =
            self.welds.iter().map(|weld| json!({"name": weld.name, "between": self.both(&weld.between)}));
        scene.insert("welds".into(), welds.collect());
        let mut locks = Vec::new();
        for lock in self.locks.clone() {
            let mut made = json!({"name": lock.name, "body": self.name(Some(lock.bar))});
            if let Some(angle) = lock.angle {
                made["angle"] = json!(angle);
            }
            locks.push(self.relative(made, lock.relative_to));
        }
        scene.insert("locks".into(), json!(locks));
        scene.extend(self.acting());
        scene.retain(|_, value| value.as_array().is_none_or(|list| !list.is_empty()));
        let hung = self.hung();
        let mut start = Map::new();
        for k in 0..self.bars.len() {
            let Given { origin, velocity, .. } = self.given(hung[k], k);
            let mut entry = json!({"phi": self.start[k].phi, "omega": self.start[k].omega});
            if let (Some(origin), Some(velocity)) = (origin, velocity) {
                entry["origin"] = json!(origin);
                entry["velocity"] = json!(velocity);
            }
            start.insert(self.bars[k].name.clone(), entry);
        }
        scene.insert("start".into(), Value::Object(start));
        let until = self.scales.time * self.dice.within(2.0, 4.0);
        scene.insert("until".into(), json!(until));
        scene.insert("every".into(), json!(until / 20.0));
        Value::Object(scene).to_string()
    }
}
