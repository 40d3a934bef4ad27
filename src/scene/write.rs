//! A resolved scene as an input scene.

use super::fit::written_starts;
use super::format::GROUND;
use super::{Force, Given, Place, Scene, Slider, Torque};
use serde::Serialize;
use serde_json::{Map, Value, json};

impl Scene {
    /// The scene in the input format, every bar by its mass and every default written out; it reads back to
    /// the same scene, bit for bit.
    pub fn to_input(&self) -> Value {
        let body = |bar: Option<usize>| bar.map_or(GROUND, |bar| self.bars[bar].name.as_str());
        let place = |place: &Place| json!({"body": body(place.bar), "point": place.point});
        let bars: Vec<_> = (self.bars.iter())
            .map(|bar| json!({"name": bar.name, "mass": bar.mass, "centre": bar.centre, "inertia": bar.inertia, "length": bar.length}))
            .collect();
        let hinges: Vec<_> = self
            .hinges
            .iter()
            .map(|hinge| json!({"name": hinge.name, "between": hinge.between.each_ref().map(place)}))
            .collect();
        let sliders: Vec<_> = (self.sliders.iter())
            .map(|Slider { name, point, rail, locked }| {
                json!({
                    "name": name,
                    "point": place(point),
                    "rail": {"body": body(rail.place.bar), "point": rail.place.point, "direction": rail.direction},
                    "angle": if *locked { "locked" } else { "free" },
                })
            })
            .collect();
        let welds: Vec<_> = self
            .welds
            .iter()
            .map(|weld| json!({"name": weld.name, "between": weld.between.each_ref().map(place)}))
            .collect();
        let locks: Vec<_> = (self.locks.iter())
            .map(|lock| {
                let said = json!({"name": lock.name, "body": body(Some(lock.bar)), "relative_to": body(lock.relative_to)});
                with(said, "angle", &lock.angle)
            })
            .collect();
        let springs: Vec<_> = (self.springs.iter())
            .map(|spring| {
                json!({
                    "name": spring.name,
                    "between": spring.between.each_ref().map(place),
                    "stiffness": spring.stiffness,
                    "free_length": spring.free_length,
                    "damping": spring.damping,
                    "model": if spring.rigid { "rigid" } else { "elastic" },
                })
            })
            .collect();
        let torsion_springs: Vec<_> = (self.torsion_springs.iter())
            .map(|spring| {
                json!({
                    "name": spring.name,
                    "body": body(Some(spring.bar)),
                    "relative_to": body(spring.relative_to),
                    "stiffness": spring.stiffness,
                    "free_angle": spring.free_angle,
                    "damping": spring.damping,
                })
            })
            .collect();
        let forces: Vec<_> = (self.forces.iter())
            .map(|Force { name, bar, point, force, follows, law }| {
                let frame = if *follows { "body" } else { "ground" };
                let said = json!({"name": name, "body": body(Some(*bar)), "point": point, "force": force, "frame": frame});
                with(said, "law", law)
            })
            .collect();
        let torques: Vec<_> = (self.torques.iter())
            .map(|Torque { name, bar, relative_to, torque, law }| {
                let said = json!({"name": name, "body": body(Some(*bar)), "relative_to": body(*relative_to), "torque": torque});
                with(said, "law", law)
            })
            .collect();
        let motors: Vec<_> = (self.motors.iter())
            .map(|motor| json!({"name": motor.name, "body": body(Some(motor.bar)), "relative_to": body(motor.relative_to), "law": motor.law}))
            .chain(self.drives.iter().map(|drive| json!({"name": drive.name, "slider": self.sliders[drive.slider].name, "law": drive.law})))
            .collect();
        let walls: Vec<_> = (self.walls.iter())
            .map(|wall| {
                json!({
                    "name": wall.name,
                    "body": body(Some(wall.bar)),
                    "point": wall.point,
                    "line": {"through": wall.through, "normal": wall.normal},
                    "restitution": wall.restitution,
                })
            })
            .collect();
        json!({
            "name": self.name,
            "description": self.description,
            "gravity": self.gravity,
            "bars": bars,
            "hinges": hinges,
            "sliders": sliders,
            "welds": welds,
            "locks": locks,
            "springs": springs,
            "torsion_springs": torsion_springs,
            "forces": forces,
            "torques": torques,
            "motors": motors,
            "walls": walls,
            "start": self.start_as_given(),
            "until": self.until,
            "every": self.every,
        })
    }

    /// What of the start must be written so that all of it reads back to the same bits, by bar name.
    fn start_as_given(&self) -> Map<String, Value> {
        let starts = self.bars.iter().zip(&self.start);
        if self.has_whole_start() {
            let written = starts.zip(written_starts(self)).filter(|(_, written)| *written);
            return written.map(|((bar, start), _)| (bar.name.clone(), json!(start))).collect();
        }
        let given = self.given.iter().chain(std::iter::repeat(&Given::ANGLE_AND_RATE));
        let entries = starts.zip(given).map(|((bar, start), given)| {
            let entry = with(json!({}), "phi", &given.phi.then_some(start.phi));
            let entry = with(entry, "omega", &given.omega.then_some(start.omega));
            (bar.name.clone(), with(with(entry, "origin", &given.origin), "velocity", &given.velocity))
        });
        entries.filter(|(_, entry)| *entry != json!({})).collect()
    }
}

/// An object with one key more, where that has a value.
fn with(mut object: Value, key: &str, value: &Option<impl Serialize>) -> Value {
    if let (Value::Object(members), Some(value)) = (&mut object, value) {
        members.insert(key.to_owned(), json!(value));
    }
    object
}
