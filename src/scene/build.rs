//! Scenes made in Rust, without a file: the same keys, the same checks and the same messages as for scenes in
//! JSON.

use super::{Refusal, Scene, SceneError, parse_scene};
use serde_json::{Map, Value, json};

/// A point of the ground \[m\], for [`SceneBuilder`].
pub fn ground(at: [f64; 2]) -> Value {
    on("ground", at)
}

/// A point of a bar in its frame \[m\], for [`SceneBuilder`].
pub fn on(bar: &str, point: [f64; 2]) -> Value {
    json!({"body": bar, "point": point})
}

/// Makes a [`Scene`] part by part.
///
/// Every method takes what its part must have; [`with`](Self::with) sets any other key of the part added
/// last, by its name in scene files. Nothing is checked before [`build`](Self::build), which refuses what a
/// file with the same content would be refused for.
///
/// ```
/// use driftless::scene::{SceneBuilder, ground, on};
///
/// # fn main() -> Result<(), driftless::scene::SceneError> {
/// let scene = SceneBuilder::new("double_pendulum")
///     .gravity([0.0, -9.81])
///     .bar("upper", 0.6, 0.5)
///     .bar("lower", 0.6, 0.5)
///     .hinge("A", ground([0.0, 0.0]), on("upper", [0.0, 0.0]))
///     .hinge("B", on("upper", [0.6, 0.0]), on("lower", [0.0, 0.0]))
///     .spring("s", on("lower", [0.6, 0.0]), ground([1.0, 0.0]), 8.0, 0.5)
///     .with("damping", 0.1)
///     .start("upper", 0.0, 0.0)
///     .start("lower", 1.0, 0.0)
///     .until(10.0, 0.01)
///     .build()?;
/// assert_eq!(scene.bars.len(), 2);
/// // A name that is not there: the message says which, and what there is.
/// let wrong = SceneBuilder::new("wrong")
///     .bar("upper", 0.6, 0.5)
///     .hinge("A", ground([0.0, 0.0]), on("uper", [0.0, 0.0]))
///     .build();
/// assert!(wrong.unwrap_err().to_string().contains("upper"));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct SceneBuilder {
    scene: Map<String, Value>,
    /// The list or table that the last part went into, and its key where that is a table.
    last: Option<(&'static str, Option<String>)>,
    /// The first part or key that has no place in the scene: where, and what is there.
    misplaced: Option<(String, &'static str)>,
}

impl SceneBuilder {
    /// An empty scene of this name, without gravity.
    pub fn new(name: &str) -> Self {
        let mut scene = Map::new();
        scene.insert("name".into(), name.into());
        scene.insert("gravity".into(), json!([0.0, 0.0]));
        Self { scene, last: None, misplaced: None }
    }

    /// Gravitational acceleration (x, y) \[m/s²\].
    #[must_use]
    pub fn gravity(self, gravity: [f64; 2]) -> Self {
        self.set("gravity", json!(gravity))
    }

    /// One sentence for reports and charts.
    #[must_use]
    pub fn description(self, text: &str) -> Self {
        self.set("description", text.into())
    }

    /// A slender uniform bar of this length \[m\] and mass \[kg\].
    #[must_use]
    pub fn bar(self, name: &str, length: f64, mass: f64) -> Self {
        let (centre, inertia) = ([0.5 * length, 0.0], mass * length * length / 12.0);
        self.add(
            "bars",
            json!({"name": name, "length": length, "mass": mass, "centre": centre, "inertia": inertia}),
        )
    }

    /// A rigid body of any mass distribution: mass \[kg\], centre of mass in its frame \[m\], moment of
    /// inertia about that \[kg·m²\], and the length it is drawn with \[m\].
    #[must_use]
    pub fn body(self, name: &str, mass: f64, centre: [f64; 2], inertia: f64, length: f64) -> Self {
        self.add(
            "bars",
            json!({"name": name, "length": length, "mass": mass, "centre": centre, "inertia": inertia}),
        )
    }

    /// A hinge: two points that coincide.
    #[must_use]
    pub fn hinge(self, name: &str, one: Value, other: Value) -> Self {
        self.add("hinges", json!({"name": name, "between": [one, other]}))
    }

    /// A weld: two points that coincide, of bodies that keep their angle.
    #[must_use]
    pub fn weld(self, name: &str, one: Value, other: Value) -> Self {
        self.add("welds", json!({"name": name, "between": [one, other]}))
    }

    /// A point that slides along a line through another point in a direction.
    #[must_use]
    pub fn slider(self, name: &str, point: Value, rail: Value, direction: [f64; 2]) -> Self {
        let mut rail = rail;
        // What is no object is refused for what it is.
        if let Some(rail) = rail.as_object_mut() {
            rail.insert("direction".into(), json!(direction));
        }
        self.add("sliders", json!({"name": name, "point": point, "rail": rail}))
    }

    /// A linear spring of this stiffness \[N/m\] and free length \[m\]; `damping` by [`with`](Self::with).
    #[must_use]
    pub fn spring(self, name: &str, one: Value, other: Value, stiffness: f64, free_length: f64) -> Self {
        let part = json!({
            "name": name, "between": [one, other], "stiffness": stiffness, "free_length": free_length
        });
        self.add("springs", part)
    }

    /// A motor that turns a bar: angle at t = 0 \[rad\] and rate \[rad/s\]; other laws by
    /// [`with`](Self::with) `"law"`.
    #[must_use]
    pub fn motor(self, name: &str, bar: &str, start: f64, rate: f64) -> Self {
        self.add("motors", json!({"name": name, "body": bar, "law": {"start": start, "rate": rate}}))
    }

    /// A wall that a point of a bar cannot pass: a point of its line \[m\], its normal, and the coefficient
    /// of restitution.
    #[must_use]
    pub fn wall(
        self,
        name: &str,
        bar: &str,
        point: [f64; 2],
        through: [f64; 2],
        normal: [f64; 2],
        restitution: f64,
    ) -> Self {
        let line = json!({"through": through, "normal": normal});
        self.add(
            "walls",
            json!({"name": name, "body": bar, "point": point, "line": line, "restitution": restitution}),
        )
    }

    /// A part of any kind, by the name of its list and the keys it has in scene files.
    #[must_use]
    pub fn part(self, list: &'static str, part: Value) -> Self {
        self.add(list, part)
    }

    /// Angle \[rad\] and rate \[rad/s\] of a bar at t = 0.
    #[must_use]
    pub fn start(mut self, bar: &str, phi: f64, omega: f64) -> Self {
        match self.scene.entry("start").or_insert_with(|| json!({})).as_object_mut() {
            Some(start) => drop(start.insert(bar.into(), json!({"phi": phi, "omega": omega}))),
            None => self.misplace(format!("start.{bar}"), "start is no object"),
        }
        self.last = Some(("start", Some(bar.into())));
        self
    }

    /// Horizon \[s\] and output interval \[s\].
    #[must_use]
    pub fn until(self, until: f64, every: f64) -> Self {
        self.set("until", json!(until)).set("every", json!(every))
    }

    /// Sets a key of the part added last, by its name in scene files; before any part, a key of the scene.
    #[must_use]
    pub fn with(mut self, key: &str, value: impl Into<Value>) -> Self {
        let part = match &self.last {
            None => return self.set(key, value.into()),
            Some((table, Some(name))) => {
                self.scene.get_mut(*table).and_then(|table| table.get_mut(name.as_str()))
            }
            Some((list, None)) => self.scene.get_mut(*list).and_then(|list| list.as_array_mut()?.last_mut()),
        };
        match part.and_then(Value::as_object_mut) {
            Some(part) => drop(part.insert(key.into(), value.into())),
            None => self.misplace(key.into(), "the part before it is no object"),
        }
        self
    }

    /// Checks the scene.
    ///
    /// # Errors
    /// What a file with this content is refused for, by its line in the scene as [`text`](Self::text) writes
    /// it.
    pub fn build(&self) -> Result<Scene, SceneError> {
        let name = self.scene.get("name").and_then(Value::as_str).unwrap_or_default();
        let source = format!("scene {name} as built");
        if let Some((path, problem)) = &self.misplaced {
            return Err(SceneError::from(Refusal {
                file: source,
                path: path.clone(),
                problem: format!("has no place: {problem}"),
                allowed: "must be a part of a list, or a key of an object".into(),
                hint:
                    "what is no list, as `parameters`, is one value: set it whole by `with` before any part"
                        .into(),
                ..Refusal::default()
            }));
        }
        parse_scene(&self.text(), &source, &[])
    }

    /// The scene as the text of a scene file.
    pub fn text(&self) -> String {
        // Writing a tree of plain values cannot fail.
        serde_json::to_string_pretty(&self.scene).unwrap_or_default()
    }

    fn set(mut self, key: &str, value: Value) -> Self {
        self.scene.insert(key.into(), value);
        self
    }

    fn add(mut self, list: &'static str, part: Value) -> Self {
        match self.scene.entry(list).or_insert_with(|| json!([])).as_array_mut() {
            Some(parts) => parts.push(part),
            None => self.misplace(list.into(), "it is there and is no list"),
        }
        self.last = Some((list, None));
        self
    }

    fn misplace(&mut self, path: String, problem: &'static str) {
        self.misplaced.get_or_insert((path, problem));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_part_is_what_a_scene_file_says_with_the_same_keys() {
        let scene = SceneBuilder::new("all")
            .description("Every kind of part.")
            .gravity([0.0, -9.81])
            .bar("crank", 0.2, 0.3)
            .bar("rod", 0.6, 0.4)
            .body("block", 0.5, [0.0, 0.0], 0.01, 0.1)
            .bar("plate", 0.3, 0.2)
            .bar("free", 0.3, 0.2)
            .hinge("A", ground([0.0, 0.0]), on("crank", [0.0, 0.0]))
            .hinge("B", on("crank", [0.2, 0.0]), on("rod", [0.0, 0.0]))
            .hinge("C", on("rod", [0.6, 0.0]), on("block", [0.0, 0.0]))
            .slider("guide", on("block", [0.0, 0.0]), ground([0.0, 0.0]), [1.0, 0.0])
            .with("angle", "locked")
            .weld("W", on("rod", [0.3, 0.0]), on("plate", [0.0, 0.0]))
            .spring("s", on("block", [0.0, 0.0]), ground([1.5, 0.0]), 20.0, 0.5)
            .with("damping", 0.3)
            .motor("m", "crank", 0.3, 5.0)
            .wall("floor", "free", [0.3, 0.0], [0.0, -3.0], [0.0, 1.0], 0.5)
            .part("torques", json!({"name": "t", "body": "free", "torque": 0.1}))
            .start("free", 0.1, 0.0)
            .with("origin", vec![3.0, 0.0])
            .with("velocity", vec![0.0, 0.0])
            .until(1.0, 0.1)
            .build()
            .expect("a scene");
        let counts = [scene.bars.len(), scene.hinges.len(), scene.sliders.len(), scene.welds.len()];
        assert_eq!(counts, [5, 3, 1, 1]);
        let counts = [scene.springs.len(), scene.motors.len(), scene.walls.len(), scene.torques.len()];
        assert_eq!(counts, [1, 1, 1, 1]);
        assert_eq!((scene.springs[0].damping, scene.sliders[0].locked, scene.until), (0.3, true, 1.0));
        let inertia = scene.bars[0].inertia - 0.3 * 0.2 * 0.2 / 12.0;
        assert!(inertia.abs() < 1e-18 && scene.fault().is_none());
    }

    /// What has no place in a scene is refused by the path it would have, and nothing of it is lost.
    #[test]
    fn what_has_no_place_is_refused_at_the_end() {
        let new = || SceneBuilder::new("odd").bar("a", 0.6, 0.5).until(1.0, 0.1);
        let empty = || SceneBuilder::new("odd");
        let one = json!({"k": 1});
        let cases = [
            (new().slider("s", on("a", [0.0; 2]), json!([0, 0]), [1.0, 0.0]), "sliders[0].rail"),
            (empty().with("start", 3).start("a", 0.0, 0.0), "start.a"),
            (empty().with("parameters", one.clone()).part("parameters", json!({"m": 2})), "parameters"),
            (new().part("springs", json!(3)).with("damping", 0.1), "damping"),
        ];
        for (builder, path) in cases {
            let refused = builder.build().expect_err(path);
            assert_eq!(refused.refusal().path, path, "{refused}");
        }
        let set = empty().with("parameters", one).bar("a", 0.6, 0.5).until(1.0, 0.1);
        assert_eq!(set.start("a", 0.0, 0.0).build().expect("a scene").parameters.len(), 1);
    }
}
