//! Scenes from plain JSON, by what the schema says of them and nothing else.

use super::double_double::{Dd, Vec2};
use serde_json::Value;
use std::collections::BTreeMap;

/// What the auditor judges of a scene: lists of parts with their keys, and plain keys.
const PARTS: [(&str, &[&str]); 10] = [
    ("bars", &["mass", "centre", "inertia", "length", "width", "thickness", "density"]),
    ("hinges", &["between"]),
    ("welds", &["between"]),
    ("sliders", &["point", "rail", "angle"]),
    ("locks", &["body", "relative_to", "angle"]),
    ("motors", &["body", "relative_to", "slider", "law"]),
    ("springs", &["between", "stiffness", "free_length", "damping", "model"]),
    ("torsion_springs", &["body", "relative_to", "stiffness", "free_angle", "damping"]),
    ("forces", &["body", "point", "force", "frame", "law"]),
    ("torques", &["body", "relative_to", "torque", "law"]),
];
/// Those of walls.
const WALL: [&str; 4] = ["body", "point", "line", "restitution"];
/// Keys that change nothing of the motion.
const ASIDE: [&str; 11] = [
    "name",
    "description",
    "gravity",
    "start",
    "until",
    "every",
    "rows",
    "points",
    "outputs",
    "method",
    "walls",
];

/// What of a scene the auditor does not judge, by name: keys it does not know, as `events` or
/// `walls.floor.friction`, and formulas, as `springs.s.tension`.  It must be nothing where a scene is read.
pub fn unjudged(scene: &Value) -> Vec<String> {
    let mut found = Vec::new();
    for (key, value) in scene.as_object().into_iter().flatten() {
        let known = PARTS.iter().find(|(list, _)| list == key).map(|(_, keys)| *keys);
        let Some(known) = known.or((key == "walls").then_some(&WALL[..])) else {
            match ASIDE.contains(&key.as_str()) {
                true if holds_formula(value)
                    && ["start", "gravity", "until", "every"].contains(&key.as_str()) =>
                {
                    found.push(key.clone());
                }
                true => {}
                false => found.push(key.clone()),
            }
            continue;
        };
        for part in value.as_array().into_iter().flatten() {
            for (inner, value) in part.as_object().into_iter().flatten() {
                let is_own =
                    known.contains(&inner.as_str()) || ["name", "description"].contains(&inner.as_str());
                // Numbers alone; what stands in words there are names of bodies, frames and models.
                let is_formula = !WORDS.contains(&inner.as_str()) && holds_formula(value);
                let turns = key == "walls" && inner == "line" && value.get("body").is_some();
                if !is_own || is_formula || turns {
                    found.push(format!("{key}.{}.{inner}", part["name"].as_str().unwrap_or("?")));
                }
            }
        }
    }
    found.sort();
    found
}

/// Keys whose text is none of a formula.
const WORDS: [&str; 9] =
    ["name", "description", "body", "relative_to", "slider", "angle", "frame", "model", "inertia"];

/// True where a number is given as text, in whatever depth.
fn holds_formula(value: &Value) -> bool {
    match value {
        Value::String(_) => true,
        Value::Array(list) => list.iter().any(holds_formula),
        Value::Object(object) => {
            object.iter().any(|(key, value)| !WORDS.contains(&key.as_str()) && holds_formula(value))
        }
        _ => false,
    }
}

/// A scene as the auditor understands it.  Points of bodies are measured from their centres of mass.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    pub gravity: Vec2,
    pub bodies: Vec<Body>,
    pub joints: Vec<Joint>,
    pub springs: Vec<Spring>,
    pub coils: Vec<Coil>,
    pub pushes: Vec<Push>,
    pub walls: Vec<Wall>,
    pub until: f64,
    pub every: f64,
    /// A length about the size of the mechanism \[m\].
    pub size: f64,
}

#[derive(Clone, Debug)]
pub struct Body {
    pub name: String,
    pub mass: Dd,
    pub inertia: Dd,
    /// The centre of mass from the origin, in the body's frame.
    pub centre: Vec2,
    pub given: Given,
}

/// What the scene says of a body at the start.
#[derive(Clone, Copy, Debug, Default)]
pub struct Given {
    pub phi: Option<f64>,
    pub omega: Option<f64>,
    pub origin: Option<[f64; 2]>,
    pub velocity: Option<[f64; 2]>,
}

/// A point of a body, from its centre of mass, or of the ground (`None`).
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub body: Option<usize>,
    pub point: Vec2,
}

/// One scalar equation that positions must keep.
#[derive(Clone, Debug)]
pub enum Measure {
    /// The difference of two points, along x or y of the ground.
    Difference { places: [Place; 2], axis: Vec2 },
    /// The place of a point relative to another, along a direction that turns with the other's body.
    Along { point: Place, rail: Place, direction: Vec2 },
    /// The angle of a body, from that of another or from +x.
    Angle { body: Option<usize>, base: Option<usize> },
}

/// An equation, and what it belongs to.
#[derive(Clone, Debug)]
pub struct Joint {
    pub name: String,
    pub kind: &'static str,
    pub measure: Measure,
    pub target: Target,
}

impl Joint {
    pub fn is_angle(&self) -> bool {
        matches!(self.measure, Measure::Angle { .. })
    }
}

/// What a measure is to be.
#[derive(Clone, Debug)]
pub enum Target {
    /// What it is at the start.
    AsAtStart,
    Law(Law),
}

#[derive(Clone, Debug, Default)]
pub struct Law {
    pub start: Dd,
    pub rate: Dd,
    pub acceleration: Dd,
    /// Amplitude, frequency, phase.
    pub sines: Vec<[Dd; 3]>,
}

#[derive(Clone, Debug)]
pub struct Spring {
    pub places: [Place; 2],
    pub stiffness: Dd,
    pub free_length: Dd,
    pub damping: Dd,
    /// True where the program takes it for a rod; here it is the spring that it is.
    pub is_rigid: bool,
}

/// A torsion spring.
#[derive(Clone, Debug)]
pub struct Coil {
    pub body: usize,
    pub base: Option<usize>,
    pub stiffness: Dd,
    pub free_angle: Dd,
    pub damping: Dd,
}

/// An applied force or torque.
#[derive(Clone, Debug)]
pub enum Push {
    Force { place: Place, force: Vec2, turns: bool, law: Option<Law> },
    Torque { body: usize, base: Option<usize>, torque: Dd, law: Option<Law> },
}

#[derive(Clone, Debug)]
pub struct Wall {
    pub name: String,
    pub place: Place,
    pub through: Vec2,
    pub normal: Vec2,
    pub restitution: Dd,
}

type Names = BTreeMap<String, usize>;

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} in {value}"))
}

fn exact(value: &Value, key: &str) -> Dd {
    value[key].as_f64().unwrap_or(0.0).into()
}

fn pair(value: &Value) -> [f64; 2] {
    [0, 1].map(|i| value[i].as_f64().unwrap_or_else(|| panic!("{value}")))
}

fn unit(value: &Value) -> Vec2 {
    let vector = Vec2::of(pair(value));
    vector.times(Dd::ONE / vector.length())
}

fn list<'a>(scene: &'a Value, key: &str) -> impl Iterator<Item = &'a Value> {
    scene[key].as_array().into_iter().flatten()
}

fn name(value: &Value) -> String {
    value["name"].as_str().expect("a name").to_owned()
}

fn law(value: &Value) -> Option<Law> {
    let law = value.get("law")?;
    let sines = list(law, "sines")
        .map(|sine| ["amplitude", "frequency", "phase"].map(|key| exact(sine, key)))
        .collect();
    Some(Law {
        start: exact(law, "start"),
        rate: exact(law, "rate"),
        acceleration: exact(law, "acceleration"),
        sines,
    })
}

impl Law {
    /// Value, rate and acceleration.
    pub fn at(&self, t: Dd) -> [Dd; 3] {
        let mut found = [
            self.start + self.rate * t + (self.acceleration * t * t).scale(0.5),
            self.rate + self.acceleration * t,
            self.acceleration,
        ];
        for &[amplitude, frequency, phase] in &self.sines {
            let (sine, cosine) = (frequency * t + phase).sin_cos();
            found[0] += amplitude * sine;
            found[1] += amplitude * frequency * cosine;
            found[2] -= amplitude * frequency * frequency * sine;
        }
        found
    }
}

/// The bodies that places and joints name.
struct Known<'a> {
    bodies: &'a [Body],
    names: Names,
}

impl<'a> Known<'a> {
    fn new(bodies: &'a [Body]) -> Self {
        let names = bodies.iter().enumerate().map(|(k, body)| (body.name.clone(), k)).collect();
        Self { bodies, names }
    }

    fn index(&self, value: &Value) -> Option<usize> {
        value.as_str().filter(|&name| name != "ground").map(|name| self.names[name])
    }

    fn place(&self, value: &Value) -> Place {
        let (body, point) = (self.index(&value["body"]), Vec2::of(pair(&value["point"])));
        Place { body, point: body.map_or(point, |k| point - self.bodies[k].centre) }
    }

    fn places(&self, value: &Value) -> [Place; 2] {
        [self.place(&value["between"][0]), self.place(&value["between"][1])]
    }

    /// Hinges, welds, sliders with their motors, locks, motors.
    fn joints(&self, json: &Value) -> Vec<Joint> {
        let mut joints = Vec::new();
        let mut add =
            |name: String, kind, measure, target| joints.push(Joint { name, kind, measure, target });
        let axes = [("x", [1.0, 0.0]), ("y", [0.0, 1.0])];
        for hinge in list(json, "hinges") {
            for (letter, axis) in axes {
                let measure = Measure::Difference { places: self.places(hinge), axis: Vec2::of(axis) };
                add(format!("{}.{letter}", name(hinge)), "hinge", measure, Target::Law(Law::default()));
            }
        }
        for weld in list(json, "welds") {
            let places = self.places(weld);
            for (letter, axis) in axes {
                let measure = Measure::Difference { places, axis: Vec2::of(axis) };
                add(format!("{}.{letter}", name(weld)), "weld", measure, Target::Law(Law::default()));
            }
            let measure = Measure::Angle { body: places[1].body, base: places[0].body };
            add(format!("{}.angle", name(weld)), "weld", measure, Target::AsAtStart);
        }
        for slider in list(json, "sliders") {
            let (point, rail, direction) = (
                self.place(&slider["point"]),
                self.place(&slider["rail"]),
                unit(&slider["rail"]["direction"]),
            );
            let measure = Measure::Along { point, rail, direction: direction.left() };
            add(name(slider), "slider", measure, Target::Law(Law::default()));
            if slider["angle"] == "locked" {
                let measure = Measure::Angle { body: point.body, base: rail.body };
                add(format!("{}.angle", name(slider)), "slider", measure, Target::AsAtStart);
            }
            for drive in list(json, "motors").filter(|motor| motor["slider"] == slider["name"]) {
                let measure = Measure::Along { point, rail, direction };
                add(name(drive), "slider motor", measure, Target::Law(law(drive).expect("a law")));
            }
        }
        for lock in list(json, "locks") {
            let measure =
                Measure::Angle { body: self.index(&lock["body"]), base: self.index(&lock["relative_to"]) };
            let target = match lock["angle"].as_f64() {
                Some(angle) => Target::Law(Law { start: angle.into(), ..Law::default() }),
                None => Target::AsAtStart,
            };
            add(name(lock), "lock", measure, target);
        }
        for motor in list(json, "motors").filter(|motor| motor.get("body").is_some()) {
            let measure =
                Measure::Angle { body: self.index(&motor["body"]), base: self.index(&motor["relative_to"]) };
            add(name(motor), "motor", measure, Target::Law(law(motor).expect("a law")));
        }
        joints
    }
}

impl Scene {
    /// Reads a scene that the program accepts, of which nothing is [`unjudged`].
    pub fn read(text: &str) -> Self {
        let json: Value = serde_json::from_str(text).expect("JSON");
        let unjudged = unjudged(&json);
        assert!(unjudged.is_empty(), "the auditor does not judge {}", unjudged.join(", "));
        let mut scene = Self { gravity: Vec2::of(pair(&json["gravity"])), ..Self::default() };
        scene.bodies = list(&json, "bars").map(|bar| body(bar, &json["start"])).collect();
        let known = Known::new(&scene.bodies);
        scene.joints = known.joints(&json);
        scene.springs = (list(&json, "springs"))
            .map(|spring| Spring {
                places: known.places(spring),
                stiffness: exact(spring, "stiffness"),
                free_length: exact(spring, "free_length"),
                damping: exact(spring, "damping"),
                is_rigid: spring["model"] == "rigid",
            })
            .collect();
        scene.coils = (list(&json, "torsion_springs"))
            .map(|coil| Coil {
                body: known.index(&coil["body"]).expect("a bar"),
                base: known.index(&coil["relative_to"]),
                stiffness: exact(coil, "stiffness"),
                free_angle: exact(coil, "free_angle"),
                damping: exact(coil, "damping"),
            })
            .collect();
        scene.pushes.extend(list(&json, "forces").map(|force| {
            let turns = force["frame"] == "body";
            Push::Force {
                place: known.place(force),
                force: Vec2::of(pair(&force["force"])),
                turns,
                law: law(force),
            }
        }));
        scene.pushes.extend(list(&json, "torques").map(|torque| {
            let (body, base) =
                (known.index(&torque["body"]).expect("a bar"), known.index(&torque["relative_to"]));
            Push::Torque { body, base, torque: exact(torque, "torque"), law: law(torque) }
        }));
        scene.walls = (list(&json, "walls"))
            .map(|wall| Wall {
                name: name(wall),
                place: known.place(wall),
                through: Vec2::of(pair(&wall["line"]["through"])),
                normal: unit(&wall["line"]["normal"]),
                restitution: exact(wall, "restitution"),
            })
            .collect();
        (scene.until, scene.every) = (number(&json, "until"), number(&json, "every"));
        scene.size = scene.reach();
        scene
    }

    /// The longest lever or body.
    fn reach(&self) -> f64 {
        let bodies = self.bodies.iter().map(|body| {
            let gyration = (body.inertia.hi / body.mass.hi).sqrt();
            body.centre.length().hi.max(gyration)
        });
        let levers = self.joints.iter().flat_map(|joint| match &joint.measure {
            Measure::Difference { places: [a, b], .. } | Measure::Along { point: a, rail: b, .. } => {
                vec![*a, *b]
            }
            Measure::Angle { .. } => Vec::new(),
        });
        let others = self
            .walls
            .iter()
            .map(|wall| wall.place)
            .chain(self.springs.iter().flat_map(|spring| spring.places));
        let levers =
            levers.chain(others).filter(|place| place.body.is_some()).map(|place| place.point.length().hi);
        let most = bodies.chain(levers).fold(0.0, f64::max);
        if most > 0.0 { most } else { 1.0 }
    }
}

fn body(bar: &Value, start: &Value) -> Body {
    let start = &start[name(bar)];
    let given = Given {
        phi: start["phi"].as_f64(),
        omega: start["omega"].as_f64(),
        origin: start.get("origin").map(pair),
        velocity: start.get("velocity").map(pair),
    };
    let (mass, centre, inertia) = if bar.get("mass").is_some() {
        (exact(bar, "mass"), Vec2::of(pair(&bar["centre"])), exact(bar, "inertia"))
    } else {
        let [length, width, thickness] = ["length", "width", "thickness"].map(|key| exact(bar, key));
        let mass = exact(bar, "density") * length * width * thickness;
        let slender = mass * length * length / Dd::from(12.0);
        let inertia = match &bar["inertia"] {
            Value::Number(inertia) => inertia.as_f64().expect("a number").into(),
            Value::String(word) if word == "slender" => slender,
            _ => slender + mass * width * width / Dd::from(12.0),
        };
        (mass, Vec2 { x: length.scale(0.5), y: Dd::ZERO }, inertia)
    };
    Body { name: name(bar), mass, inertia, centre, given }
}
