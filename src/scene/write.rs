//! A resolved scene as an input scene.

use super::assemble::written_starts;
use super::format::GROUND;
use super::{Place, Scene};
use serde_json::{Map, Value, json};

impl Scene {
    /// The scene in the input format, every bar by its mass and every default written out; it reads back to the same scene, bit for bit.
    pub fn to_input(&self) -> Value {
        let body = |bar: Option<usize>| bar.map_or(GROUND, |bar| self.bars[bar].name.as_str());
        let place = |place: &Place| json!({"body": body(place.bar), "point": place.point});
        let bars: Vec<_> = (self.bars.iter())
            .map(|bar| json!({"name": bar.name, "mass": bar.mass, "centre": bar.centre, "inertia": bar.inertia, "length": bar.length}))
            .collect();
        let hinges: Vec<_> =
            self.hinges.iter().map(|hinge| json!({"name": hinge.name, "between": hinge.between.each_ref().map(place)})).collect();
        let springs: Vec<_> = (self.springs.iter())
            .map(|spring| {
                json!({
                    "name": spring.name,
                    "between": spring.between.each_ref().map(place),
                    "stiffness": spring.stiffness,
                    "free_length": spring.free_length,
                    "damping": spring.damping,
                })
            })
            .collect();
        let motors: Vec<_> = (self.motors.iter())
            .map(|motor| json!({"name": motor.name, "body": body(Some(motor.bar)), "relative_to": body(motor.relative_to), "law": motor.law}))
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
        let start: Map<String, Value> = (self.bars.iter().zip(&self.start))
            .zip(written_starts(&self.motors, &self.start))
            .filter(|(_, written)| *written)
            .map(|((bar, start), _)| (bar.name.clone(), json!(start)))
            .collect();
        json!({
            "name": self.name,
            "description": self.description,
            "gravity": self.gravity,
            "bars": bars,
            "hinges": hinges,
            "springs": springs,
            "motors": motors,
            "walls": walls,
            "start": start,
            "until": self.until,
            "every": self.every,
        })
    }
}
