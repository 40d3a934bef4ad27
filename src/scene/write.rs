//! A resolved scene as an input scene.

use super::fit::written_starts;
use super::format::GROUND;
use super::friction::FrictionPart;
use super::{
    Coupled, Coupling, Force, Friction, FrictionPlace, Given, Hinge, Law, Load, LoadLaw, NamedPoint, Place,
    Scene, SceneEvent, Slider, Torque, Wall,
};
use serde::ser::{Serialize, SerializeStruct, Serializer};
use serde_json::{Map, Value, json};

impl Scene {
    /// The scene in the input format, every bar by its mass and every default written out; it reads back to
    /// the same scene, bit for bit.
    pub fn to_input(&self) -> Value {
        self.with_start(self.start_as_given())
    }

    /// The same with this start.
    pub(super) fn with_start(&self, start: Map<String, Value>) -> Value {
        let mut said = json!({
            "name": self.name,
            "description": self.description,
            "gravity": self.gravity,
            "bars": objects(&self.bars[..self.own_bars()], |bar| {
                json!({"name": bar.name, "mass": bar.mass, "centre": bar.centre,
                "inertia": bar.inertia, "length": bar.length})
            }),
            "hinges": self.hinge_objects(),
            "sliders": self.slider_objects(),
            "welds": objects(&self.welds, |weld| {
                json!({"name": weld.name, "between": weld.between.each_ref().map(|place| self.place(place))})
            }),
            "locks": objects(&self.locks, |lock| {
                let said = json!({"name": lock.name, "body": self.body(Some(lock.bar)),
                    "relative_to": self.body(lock.relative_to)});
                with(said, "angle", &lock.angle)
            }),
            "springs": objects(&self.springs, |spring| {
                json!({
                    "name": spring.name,
                    "between": spring.between.each_ref().map(|place| self.place(place)),
                    "stiffness": spring.stiffness,
                    "free_length": spring.free_length,
                    "damping": spring.damping,
                    "model": if spring.rigid { "rigid" } else { "elastic" },
                })
            }),
            "torsion_springs": objects(&self.torsion_springs, |spring| {
                json!({
                    "name": spring.name,
                    "body": self.body(Some(spring.bar)),
                    "relative_to": self.body(spring.relative_to),
                    "stiffness": spring.stiffness,
                    "free_angle": spring.free_angle,
                    "damping": spring.damping,
                })
            }),
            "forces": objects(&self.forces, |Force { name, bar, point, force, follows, law }| {
                let frame = if *follows { "body" } else { "ground" };
                let said = json!({"name": name, "body": self.body(Some(*bar)), "point": point,
                    "force": force, "frame": frame});
                with(said, "law", law)
            }),
            "torques": objects(&self.torques, |Torque { name, bar, relative_to, torque, law }| {
                let said = json!({"name": name, "body": self.body(Some(*bar)),
                    "relative_to": self.body(*relative_to), "torque": torque});
                with(said, "law", law)
            }),
            "motors": self.motor_objects(),
            "walls": self.wall_objects(),
            "start": start,
            "until": self.until,
            "every": self.every,
        });
        self.add_formulas(&mut said);
        said
    }

    /// The name of a bar, or of the ground.
    fn body(&self, bar: Option<usize>) -> &str {
        bar.map_or(GROUND, |bar| self.bars[bar].name.as_str())
    }

    /// A point of a bar or of the ground.
    fn place(&self, place: &Place) -> Value {
        json!({"body": self.body(place.bar), "point": place.point})
    }

    /// The hinges with their friction.
    fn hinge_objects(&self) -> Vec<Value> {
        let hinges = self.hinges[..self.own_hinges()].iter().enumerate();
        let object = |(i, hinge): (usize, &Hinge)| {
            let between = hinge.between.each_ref().map(|place| self.place(place));
            let said = json!({"name": hinge.name, "between": between});
            with(said, "friction", &self.friction((FrictionPart::Hinge, i)))
        };
        hinges.map(object).collect()
    }

    /// The sliders with their friction.
    fn slider_objects(&self) -> Vec<Value> {
        let object = |(i, Slider { name, point, rail, locked }): (usize, &Slider)| {
            let said = json!({
                "name": name,
                "point": self.place(point),
                "rail": {"body": self.body(rail.place.bar), "point": rail.place.point,
                    "direction": rail.direction},
                "angle": if *locked { "locked" } else { "free" },
            });
            with(said, "friction", &self.friction((FrictionPart::Slider, i)))
        };
        self.sliders.iter().enumerate().map(object).collect()
    }

    /// The motors on angles, on sliders, and those whose aims depend on the mechanism.
    fn motor_objects(&self) -> Vec<Value> {
        let on_angles = self.motors.iter().map(|motor| {
            json!({"name": motor.name, "body": self.body(Some(motor.bar)),
                "relative_to": self.body(motor.relative_to), "law": motor.law})
        });
        let on_sliders = self.drives.iter().map(
            |drive| json!({"name": drive.name, "slider": self.sliders[drive.slider].name, "law": drive.law}),
        );
        let coupled = self.couplings.iter().map(|Coupling { name, coupled, aim }| match coupled {
            Coupled::Angle { bar, relative_to } => json!({"name": name, "body": self.body(Some(*bar)),
                "relative_to": self.body(*relative_to), "law": aim}),
            Coupled::Travel(slider) => {
                json!({"name": name, "slider": self.sliders[*slider].name, "law": aim})
            }
        });
        on_angles.chain(on_sliders).chain(coupled).collect()
    }

    /// The walls with their laws and their friction.
    fn wall_objects(&self) -> Vec<Value> {
        let object = |(i, wall): (usize, &Wall)| {
            let line = json!({"through": wall.through, "normal": wall.normal});
            let said = json!({
                "name": wall.name,
                "body": self.body(Some(wall.bar)),
                "point": wall.point,
                "line": with(line, "body", &wall.on.map(|bar| self.body(Some(bar)))),
                "restitution": wall.restitution,
            });
            let said = with(said, "law", &wall.law);
            let said = with(said, "law", &wall.aim);
            with(said, "friction", &self.friction((FrictionPart::Wall, i)))
        };
        self.walls.iter().enumerate().map(object).collect()
    }

    /// Adds what is said in formulas, where there is any.
    fn add_formulas(&self, said: &mut Value) {
        let Value::Object(scene) = said else { return };
        let mut put = |key: &str, value: Value, is_any: bool| {
            if is_any {
                scene.insert(key.to_owned(), value);
            }
        };
        let parameters: Map<String, Value> =
            self.parameters.iter().map(|one| (one.name.clone(), json!(one.value))).collect();
        put("parameters", Value::Object(parameters), !self.parameters.is_empty());
        let points: Vec<Value> = (self.points.iter())
            .map(|NamedPoint { name, place }| {
                json!({"name": name, "body": self.body(place.bar), "point": place.point})
            })
            .collect();
        put("points", points.into(), !self.points.is_empty());
        let tables: Map<String, Value> =
            self.tables.iter().map(|one| (one.name.clone(), json!(one.points))).collect();
        put("tables", Value::Object(tables), !self.tables.is_empty());
        let signals: Map<String, Value> =
            self.signals.iter().map(|one| (one.name.clone(), json!(one.formula))).collect();
        put("signals", Value::Object(signals), !self.signals.is_empty());
        let integrals: Map<String, Value> =
            self.integrals.iter().map(|one| (one.name.clone(), json!(one.formula))).collect();
        put("integrals", Value::Object(integrals), !self.integrals.is_empty());
        put("events", self.events.iter().map(event).collect::<Vec<_>>().into(), !self.events.is_empty());
        let outputs: Map<String, Value> =
            self.outputs.iter().map(|one| (one.name.clone(), json!(one.formula))).collect();
        put("outputs", Value::Object(outputs), !self.outputs.is_empty());
        put("inactive", json!(self.inactive), !self.inactive.is_empty());
        for LoadLaw { name, load } in self.acting_laws() {
            let (list, law) = match load {
                Load::Force { bar, point, force, follows } => {
                    let frame = if *follows { "body" } else { "ground" };
                    let law = json!({"name": name, "body": self.body(Some(*bar)), "point": point,
                        "force": force, "frame": frame});
                    ("forces", law)
                }
                Load::Torque { bar, relative_to, torque } => {
                    let law = json!({"name": name, "body": self.body(Some(*bar)),
                        "relative_to": self.body(*relative_to), "torque": torque});
                    ("torques", law)
                }
                Load::Spring { between, potential, tension } => {
                    let law =
                        json!({"name": name, "between": between.each_ref().map(|place| self.place(place))});
                    ("springs", with(with(law, "potential", potential), "tension", tension))
                }
                Load::TorsionSpring { bar, relative_to, potential, torque } => {
                    let law = json!({"name": name, "body": self.body(Some(*bar)),
                        "relative_to": self.body(*relative_to)});
                    ("torsion_springs", with(with(law, "potential", potential), "torque", torque))
                }
                Load::Potential { energy } => ("potentials", json!({"name": name, "energy": energy})),
            };
            if let Value::Array(all) = scene.entry(list).or_insert_with(|| json!([])) {
                all.push(law);
            }
        }
    }

    /// What of the start must be written so that all of it reads back to the same bits, by bar name.
    fn start_as_given(&self) -> Map<String, Value> {
        let starts = self.bars[..self.own_bars()].iter().zip(&self.start);
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

/// An event, with what is not its default.
fn event(event: &SceneEvent) -> Value {
    let SceneEvent { name, when, direction, stop, on, off, set } = event;
    let set: Map<String, Value> = set.iter().map(|(name, formula)| (name.clone(), json!(formula))).collect();
    let said = json!({"name": name, "when": when, "direction": direction});
    let said = with(said, "action", &stop.then_some("stop"));
    let said =
        with(with(said, "on", &(!on.is_empty()).then_some(on)), "off", &(!off.is_empty()).then_some(off));
    with(said, "set", &(!set.is_empty()).then_some(set))
}

impl Scene {
    /// The friction of a part, as the input says it.
    fn friction(&self, part: (FrictionPart, usize)) -> Option<Value> {
        let Friction { at, kinetic, stiction } =
            self.frictions.iter().find(|friction| friction.at.part() == part)?;
        let mut said = json!({"kinetic": kinetic, "static": stiction});
        match at {
            FrictionPlace::Hinge { radius, .. } => said["radius"] = json!(radius),
            FrictionPlace::Wall { is_newton, .. } => {
                said["impact"] = json!(if *is_newton { "newton" } else { "poisson" });
            }
            FrictionPlace::Slider(_) => {}
        }
        Some(said)
    }
}

/// The objects of a list of parts.
fn objects<T>(parts: &[T], object: impl Fn(&T) -> Value) -> Vec<Value> {
    parts.iter().map(object).collect()
}

/// An object with one key more, where that has a value.
fn with(mut object: Value, key: &str, value: &Option<impl Serialize>) -> Value {
    if let (Value::Object(members), Some(value)) = (&mut object, value) {
        members.insert(key.to_owned(), json!(value));
    }
    object
}

impl<C: Serialize> Serialize for Law<C> {
    /// As a scene has it: the object of its terms, or the formula it is.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if let Some(profile) = &self.profile {
            return serializer.serialize_str(profile.text());
        }
        let mut terms = serializer.serialize_struct("Law", 4)?;
        terms.serialize_field("start", &self.start)?;
        terms.serialize_field("rate", &self.rate)?;
        terms.serialize_field("acceleration", &self.acceleration)?;
        terms.serialize_field("sines", &self.sines)?;
        terms.end()
    }
}
