//! Scenes with loops, sliders, welds, locks, free bodies, loads and starts given in part: read, written and
//! refused.

use driftless::scene::{Given, Override, Scene, SceneError, StartValue, Template, parse_scene, schema};
use proptest::prelude::*;
use serde_json::{Value, json};

/// A four-bar with a welded arm, a cart with a locked slider that a motor drives, and one of every load.
const WHOLE: &str = r#"{
  "name": "whole",
  "gravity": [0, -9.81],
  "bars": [
    {"name": "crank", "mass": 1, "centre": [0.2, 0], "inertia": 0.1},
    {"name": "coupler", "mass": 1, "centre": [0.5, 0], "inertia": 0.1},
    {"name": "rocker", "mass": 1, "centre": [0.4, 0], "inertia": 0.1},
    {"name": "arm", "mass": 0.1, "centre": [0.1, 0], "inertia": 0.01},
    {"name": "cart", "mass": 2, "centre": [0, 0], "inertia": 0.2},
    {"name": "disc", "mass": 3, "centre": [0, 0], "inertia": 0.3}
  ],
  "hinges": [
    {"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "crank", "point": [0, 0]}]},
    {"name": "B", "between": [{"body": "crank", "point": [0.4, 0]}, {"body": "coupler", "point": [0, 0]}]},
    {"name": "C", "between": [{"body": "coupler", "point": [1, 0]}, {"body": "rocker", "point": [0.8, 0]}]},
    {"name": "D", "between": [{"body": "ground", "point": [1.2, 0]}, {"body": "rocker", "point": [0, 0]}]},
    {"name": "wheel", "between": [{"body": "cart", "point": [0, 0]}, {"body": "disc", "point": [0, 0]}]}
  ],
  "sliders": [
    {"name": "track", "point": {"body": "cart", "point": [0, 0]}, "rail": {"body": "ground", "point": [0, -1], "direction": [3, 4]}, "angle": "locked"},
    {"name": "slot", "point": {"body": "arm", "point": [0.3, 0]}, "rail": {"body": "disc", "point": [0, 0.1], "direction": [1, 0]}}
  ],
  "welds": [
    {"name": "joint", "between": [{"body": "coupler", "point": [1, 0]}, {"body": "arm", "point": [0, 0]}]}
  ],
  "locks": [
    {"name": "still", "body": "rocker", "relative_to": "ground", "angle": 1.25},
    {"name": "same", "body": "arm", "relative_to": "coupler"}
  ],
  "torsion_springs": [
    {"name": "coil", "body": "crank", "relative_to": "coupler", "stiffness": 2, "free_angle": -0.5}
  ],
  "forces": [
    {"name": "push", "body": "arm", "point": [0.1, 0], "force": [1, 2], "frame": "body", "law": {"start": 0, "sines": [{"amplitude": 2, "frequency": 3}]}},
    {"name": "weight", "body": "crank", "point": [0, 0], "force": [0, -1]}
  ],
  "torques": [
    {"name": "twist", "body": "disc", "relative_to": "cart", "torque": 0.5, "law": {"start": 1, "rate": -0.1}}
  ],
  "motors": [
    {"name": "turn", "body": "crank", "law": {"start": 0.5, "rate": 2}},
    {"name": "travel", "slider": "track", "law": {"start": 0.1, "sines": [{"amplitude": 0.05, "frequency": 6}]}}
  ],
  "start": {
    "coupler": {"phi": 0.25},
    "disc": {"omega": 3, "origin": [0.06, -0.92], "velocity": [0, 0]},
    "arm": {"phi": 0.5, "omega": 0}
  },
  "until": 10,
  "every": 0.01
}
"#;

fn parsed(text: &str) -> Result<Scene, SceneError> {
    parse_scene(text, "whole.json", &[])
}

fn whole() -> Scene {
    parsed(WHOLE).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(text: &str) -> SceneError {
    match parsed(text) {
        Ok(_) => panic!("accepted: {text}"),
        Err(error) => error,
    }
}

/// WHOLE with the first `old` replaced.
fn changed(old: &str, new: &str) -> String {
    assert!(WHOLE.contains(old), "not in the scene: {old}");
    WHOLE.replacen(old, new, 1)
}

fn set(options: &[&str]) -> Result<Scene, SceneError> {
    let overrides: Vec<Override> = options.iter().map(|set| set.parse().expect("PATH=VALUE")).collect();
    parse_scene(WHOLE, "whole.json", &overrides)
}

#[test]
fn every_part_is_read() {
    let scene = whole();
    assert_eq!(scene.hinges.len(), 5, "loops are kept, and so is the hinge of two free bodies");
    let [track, slot] = &scene.sliders[..] else { panic!("two sliders") };
    assert_eq!((track.point.bar, track.rail.place.bar, track.rail.place.point), (Some(4), None, [0.0, -1.0]));
    assert_eq!((track.rail.direction, track.locked), ([0.6, 0.8], true), "a direction is a unit vector");
    assert_eq!(
        (slot.point.point, slot.rail.place.bar, slot.locked),
        ([0.3, 0.0], Some(5), false),
        "free if nothing is said"
    );
    assert_eq!(scene.welds[0].between.map(|place| place.bar), [Some(1), Some(3)]);
    assert_eq!((scene.locks[0].bar, scene.locks[0].relative_to, scene.locks[0].angle), (2, None, Some(1.25)));
    assert_eq!((scene.locks[1].relative_to, scene.locks[1].angle), (Some(1), None));
    let coil = &scene.torsion_springs[0];
    assert_eq!(
        (coil.bar, coil.relative_to, coil.stiffness, coil.free_angle, coil.damping),
        (0, Some(1), 2.0, -0.5, 0.0)
    );
    assert_eq!((scene.forces[0].force, scene.forces[0].follows), ([1.0, 2.0], true));
    assert_eq!(scene.forces[0].law.as_ref().map(|law| (law.start, law.sines[0].amplitude)), Some((0.0, 2.0)));
    assert!(!scene.forces[1].follows && scene.forces[1].law.is_none());
    assert_eq!((scene.torques[0].relative_to, scene.torques[0].torque), (Some(4), 0.5));
    assert_eq!(scene.torques[0].law.as_ref().map(|law| law.rate), Some(-0.1));
    assert_eq!((scene.motors.len(), scene.drives.len()), (1, 1), "one list of motors, two kinds");
    assert_eq!((scene.drives[0].slider, scene.drives[0].law.sines[0].frequency), (0, 6.0));
}

#[test]
fn what_is_given_of_the_start_is_told_from_what_is_guessed() {
    let scene = whole();
    let nothing = Given { phi: false, omega: false, origin: None, velocity: None };
    let disc = Given { omega: true, origin: Some([0.06, -0.92]), velocity: Some([0.0, 0.0]), ..nothing };
    let expected = [nothing, Given { phi: true, ..nothing }, nothing, Given::ANGLE_AND_RATE, nothing, disc];
    assert_eq!(scene.given, expected);
    let start: Vec<_> = scene.start.iter().map(|start| (start.phi, start.omega)).collect();
    // Motors and locks tell their own; the rest is 0.
    assert_eq!(start, [(0.5, 2.0), (0.25, 0.0), (1.25, 0.0), (0.5, 0.0), (0.0, 0.0), (0.0, 3.0)]);
    // Relative motors carry a guess on, part by part.
    let scene = set(&[
        r#"motors[0]={"name": "turn", "body": "crank", "relative_to": "coupler", "law": {"start": 0.5, "rate": 2}}"#,
    ]);
    let scene = scene.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((scene.start[0].phi, scene.start[0].omega), (0.75, 2.0));
    // No bar of a scene with loops must be given.
    let scene = set(&["start={}"]).unwrap_or_else(|error| panic!("{error}"));
    assert!(scene.given.iter().all(|given| *given == nothing) && scene.given.len() == 6);
    // A loop whose bars are all given leaves nothing to say.
    let mut loops: Value = serde_json::from_str(WHOLE).expect("JSON");
    for key in ["sliders", "welds", "locks", "motors", "torques"] {
        loops.as_object_mut().expect("an object").remove(key);
    }
    let entry = json!({"phi": 0.5, "omega": 0});
    loops["start"] = json!({"crank": entry, "coupler": entry, "rocker": entry, "arm": entry, "cart": entry, "disc": entry});
    let scene = parsed(&loops.to_string()).unwrap_or_else(|error| panic!("{error}"));
    assert!(scene.given.is_empty(), "bars beyond the list's end have angle and rate");
}

#[test]
fn trees_of_hinges_still_need_every_start() {
    let tree = |locks: Value, start: Value| {
        let place = |body: &str| json!({"body": body, "point": [0, 0]});
        json!({
            "name": "tree", "gravity": [0, 0],
            "bars": [
                {"name": "one", "mass": 1, "centre": [1, 0], "inertia": 0},
                {"name": "two", "mass": 1, "centre": [1, 0], "inertia": 0}
            ],
            "hinges": [
                {"name": "A", "between": [place("ground"), place("one")]},
                {"name": "B", "between": [place("ground"), place("two")]}
            ],
            "locks": locks, "start": start, "until": 1, "every": 1
        })
        .to_string()
    };
    let one = json!({"phi": 0.5, "omega": 1});
    let error = refused(&tree(json!([]), json!({"one": one})));
    assert_eq!(
        (error.refusal().path.as_str(), error.refusal().problem.as_str()),
        ("start.two", "is missing")
    );
    let error = refused(&tree(json!([]), json!({"one": one, "two": {"phi": 0}})));
    assert_eq!(
        (error.refusal().path.as_str(), error.refusal().problem.as_str()),
        ("start.two.omega", "is missing")
    );
    // All that is missing is named at once.
    let error = refused(&tree(json!([]), json!({"one": {"phi": 0.5}})));
    assert_eq!(error.refusal().path, "start.one.omega");
    let hint = &error.refusal().hint;
    assert!(hint.contains(r#""start": {"one": {"omega": 0}, "two": {"phi": 0, "omega": 0}}"#), "{hint}");
    // A lock with an angle gives the start as a motor does.
    let lock = json!([{"name": "l", "body": "two", "relative_to": "one", "angle": 0.25}]);
    let scene = parsed(&tree(lock.clone(), json!({"one": one}))).unwrap_or_else(|error| panic!("{error}"));
    assert!(scene.has_whole_start() && scene.given.is_empty());
    assert_eq!((scene.start[1].phi, scene.start[1].omega), (0.75, 1.0));
    assert_eq!(parsed(&scene.to_input().to_string()), Ok(scene));
    let error = refused(&tree(lock, json!({"one": one, "two": {"phi": 0.7, "omega": 1}})));
    assert!(error.to_string().contains("start.two.phi = 0.7: must be 0.75 rad, by lock `l`"), "{error}");
    // One without takes its angle from the start, and the rest may be found.
    let scene = parsed(&tree(json!([{"name": "l", "body": "two"}]), json!({"one": one})))
        .unwrap_or_else(|error| panic!("{error}"));
    assert!(!scene.has_whole_start() && !scene.given[1].phi);
}

/// What to change, into what, the path, and a part of the message.
const REFUSALS: &[(&str, &str, &str, &str)] = &[
    ("[3, 4]", "[0, 0]", "sliders[0].rail.direction", "must be longer than 1e-30"),
    ("\"locked\"", "\"lock\"", "sliders[0].angle", "must be \"free\" or \"locked\""),
    ("\"locked\"", "\"loked\"", "sliders[0].angle", "did you mean \"locked\"?"),
    (
        "\"angle\": \"locked\"",
        "\"angle\": true",
        "sliders[0].angle",
        "= true: must be \"free\" or \"locked\"",
    ),
    ("\"rail\": {\"body\": \"disc\"", "\"rail\": {\"body\": \"arm\"", "sliders[1]", "joins `arm` to itself"),
    (
        "\"rail\": {\"body\": \"disc\"",
        "\"rail\": {\"body\": \"disk\"",
        "sliders[1].rail.body",
        "did you mean \"disc\"?",
    ),
    (
        "\"direction\": [1, 0]",
        "\"dir\": [1, 0]",
        "sliders[1].rail.dir",
        "a rail has the keys body, point, direction",
    ),
    ("\"name\": \"slot\"", "\"name\": \"track\"", "sliders[1].name", "sliders[0].name is the same"),
    (
        "{\"body\": \"arm\", \"point\": [0, 0]}",
        "{\"body\": \"coupler\", \"point\": [0, 0]}",
        "welds[0].between",
        "joins `coupler` to itself",
    ),
    (
        "\"body\": \"rocker\", \"relative_to\"",
        "\"body\": \"ground\", \"relative_to\"",
        "locks[0].body",
        "the ground does not turn",
    ),
    (
        "\"body\": \"arm\", \"relative_to\": \"coupler\"",
        "\"body\": \"arm\", \"relative_to\": \"arm\"",
        "locks[1].relative_to",
        "another bar",
    ),
    ("\"angle\": 1.25", "\"angle\": 1e14", "locks[0].angle", "take off whole turns"),
    ("\"stiffness\": 2", "\"stiffness\": -2", "torsion_springs[0].stiffness", "from 0 to 1e30 N·m/rad"),
    (
        "\"free_angle\": -0.5",
        "\"free_angel\": -0.5",
        "torsion_springs[0].free_angel",
        "did you mean `free_angle`?",
    ),
    ("\"frame\": \"body\"", "\"frame\": \"bar\"", "forces[0].frame", "must be \"ground\" or \"body\""),
    (
        "\"force\": [1, 2]",
        "\"force\": [1, 2, 3]",
        "forces[0].force",
        "two numbers [x, y], each from -1e30 to 1e30 N",
    ),
    (
        "\"law\": {\"start\": 0, \"sines\"",
        "\"law\": {\"sines\"",
        "forces[0].law.start",
        "is missing: must be a number from -1e30 to 1e30",
    ),
    (
        "\"body\": \"arm\", \"point\": [0.1, 0]",
        "\"body\": \"ground\", \"point\": [0.1, 0]",
        "forces[0].body",
        "moves nothing",
    ),
    ("\"torque\": 0.5", "\"torque\": \"0.5\"", "torques[0].torque", "without quotes: 0.5"),
    ("\"rate\": -0.1", "\"rate\": 1e31", "torques[0].law.rate", "from -1e30 to 1e30 1/s"),
    ("\"slider\": \"track\"", "\"slider\": \"trak\"", "motors[1].slider", "did you mean \"track\"?"),
    ("\"slider\": \"track\"", "\"slider\": 1", "motors[1].slider", "must be the name of a slider"),
    (
        "\"slider\": \"track\"",
        "\"slider\": \"track\", \"body\": \"cart\"",
        "motors[1].body",
        "a motor on a slider has the keys name, slider, law",
    ),
    ("\"amplitude\": 0.05", "\"amplitude\": 1e31", "motors[1].law.sines[0].amplitude", "to 1e30 m"),
    ("\"name\": \"travel\"", "\"name\": \"turn\"", "motors[1].name", "motors[0].name is the same"),
    (
        "\"body\": \"crank\", \"law\"",
        "\"body\": \"rocker\", \"law\"",
        "locks[0]",
        "(lock `still`) holds an angle that is given already",
    ),
    (
        "\"coupler\": {\"phi\": 0.25}",
        "\"crank\": {\"phi\": 0.25}",
        "start.crank.phi",
        "must be 0.5 rad, by the law of motor `turn`",
    ),
    (
        "\"coupler\": {\"phi\": 0.25}",
        "\"rocker\": {\"omega\": 0.25}",
        "start.rocker.omega",
        "must be 0.0 rad/s, by lock `still`",
    ),
    ("\"phi\": 0.25", "\"origin\": [0, 0]", "start.coupler.origin", "bar `coupler` hangs on the ground"),
    ("\"origin\": [0.06, -0.92]", "\"origin\": [0.06]", "start.disc.origin", "each from -1e30 to 1e30 m"),
    ("\"omega\": 3", "\"omgea\": 3", "start.disc.omgea", "did you mean `omega`?"),
];

#[test]
fn every_refusal_names_its_place() {
    for (old, new, path, message) in REFUSALS {
        let text = changed(old, new);
        let error = refused(&text);
        let refusal = error.refusal();
        assert_eq!(refusal.path, *path, "path of\n{error}");
        assert!(error.to_string().contains(message), "no `{message}` in\n{error}");
        assert!(!refusal.hint.is_empty() && !refusal.allowed.is_empty(), "hint of\n{error}");
        assert!(refusal.line.is_some_and(|line| line > 4), "{error}");
    }
}

#[test]
fn a_free_point_mass_has_no_angle() {
    let scene = |more: Value| {
        let mut scene = json!({
            "name": "point", "gravity": [0, 0],
            "bars": [{"name": "point", "mass": 1, "centre": [0, 0], "inertia": 0}],
            "until": 1, "every": 1
        });
        scene.as_object_mut().expect("an object").extend(more.as_object().expect("an object").clone());
        scene.to_string()
    };
    let error = refused(&scene(json!({})));
    assert_eq!(error.refusal().path, "bars[0]", "{error}");
    assert!(
        parsed(&changed("\"inertia\": 0.3", "\"inertia\": 0")).is_ok(),
        "a slot turns a body without inertia"
    );
    assert!(parsed(&scene(json!({"locks": [{"name": "l", "body": "point", "angle": 0}]}))).is_ok());
    let body = scene(json!({})).replace("\"inertia\":0", "\"inertia\":0.5");
    let free = parsed(&body).unwrap_or_else(|error| panic!("{error}"));
    assert!(free.hinges.is_empty() && !free.has_whole_start(), "a body may fly free");
}

#[test]
fn new_numbers_can_be_set_and_varied() {
    let scene = set(&[
        "sliders.track.rail.direction=[0, 2]",
        "forces.push.force[1]=7",
        "torques.twist.law.rate=1",
        "locks.still.angle=1",
    ]);
    let scene = scene.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((scene.sliders[0].rail.direction, scene.forces[0].force), ([0.0, 1.0], [1.0, 7.0]));
    assert_eq!(set(&["start.disc.velocity[0]=2"]).map(|scene| scene.given[5].velocity), Ok(Some([2.0, 0.0])));
    let template = Template::new(WHOLE.to_owned(), "whole.json".to_owned(), &[]);
    for (name, path, unit) in [
        ("coupler.phi", "start.coupler.phi", "rad"),
        ("disc.origin[0]", "start.disc.origin[0]", "m"),
        ("disc.velocity[1]", "start.disc.velocity[1]", "m/s"),
        ("track.rail.point[1]", "sliders.track.rail.point[1]", "m"),
        ("still.angle", "locks.still.angle", "rad"),
        ("coil.free_angle", "torsion_springs.coil.free_angle", "rad"),
        ("coil.damping", "torsion_springs.coil.damping", "N·m·s/rad"),
        ("push.force[0]", "forces.push.force[0]", "N"),
        ("push.law.rate", "forces.push.law.rate", "1/s"),
        ("twist.torque", "torques.twist.torque", "N·m"),
        ("turn.rate", "motors.turn.law.rate", "rad/s"),
        ("travel.rate", "motors.travel.law.rate", "m/s"),
        ("motors.travel.law.sines[0].amplitude", "motors.travel.law.sines[0].amplitude", "m"),
    ] {
        let variable = template.variable(name).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((variable.path.as_str(), variable.unit, variable.start), (path, unit, None));
    }
    assert!(template.variable("sliders.track.angle").is_err() && template.variable("disc.origin").is_err());
    // Only a tree's start can be changed without reading the scene again.
    let free = Template::read("examples/scenes/free.json".as_ref(), &[]).expect("a shipped scene");
    assert_eq!(free.variable("bar1.omega").map(|variable| variable.start), Ok(Some((0, StartValue::Omega))));
}

#[test]
fn the_schema_has_units_and_words() {
    let schema = schema();
    let items = |list: &str| schema["properties"][list]["items"]["properties"].clone();
    assert_eq!(items("sliders")["angle"]["enum"], json!(["free", "locked"]));
    let coils = &schema["properties"]["torsion_springs"]["items"]["oneOf"];
    assert_eq!(coils[0]["properties"]["stiffness"]["description"], "Stiffness. [N·m/rad]");
    let motors = &schema["properties"]["motors"]["items"]["oneOf"];
    assert_eq!(
        motors[0]["properties"]["law"]["properties"]["rate"]["description"],
        "Rate; 0 if absent. [rad/s]"
    );
    assert_eq!(
        motors[1]["properties"]["law"]["properties"]["rate"]["description"],
        "Rate; 0 if absent. [m/s]"
    );
    let start = &schema["properties"]["start"]["additionalProperties"];
    assert_eq!(
        (start["required"].clone(), start["properties"]["velocity"]["description"].clone()),
        (json!([]), json!("Velocity of the bar's origin. [m/s]"))
    );
    assert!(!schema["required"].as_array().expect("a list").contains(&json!("hinges")));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_scene_reads_back_as_written_out(
        numbers in proptest::collection::vec(-50.0..50.0_f64, 16),
        sizes in proptest::collection::vec(1e-3..1e3_f64, 4),
        flags in proptest::collection::vec(any::<bool>(), 16),
    ) {
        let mut scene: Value = serde_json::from_str(WHOLE).expect("JSON");
        scene["sliders"][0]["rail"]["direction"] = json!([numbers[0], sizes[0]]);
        scene["sliders"][1]["angle"] = json!(if flags[0] { "free" } else { "locked" });
        scene["torsion_springs"][0]["stiffness"] = sizes[1].into();
        scene["forces"][0]["frame"] = json!(if flags[1] { "body" } else { "ground" });
        scene["forces"][0]["law"]["sines"][0]["amplitude"] = numbers[1].into();
        scene["torques"][0]["law"]["rate"] = numbers[2].into();
        let mut law = json!({"start": numbers[3], "rate": numbers[4], "sines": [{"amplitude": numbers[5], "frequency": sizes[2], "phase": numbers[6]}]});
        scene["motors"][1]["law"] = law.take();
        // A chain of motors and a lock, tied to the ground or not.
        scene["locks"] = json!([{"name": "l", "body": "disc", "relative_to": "arm", "angle": numbers[7]}, {"name": "k", "body": "cart"}]);
        scene["motors"][0] = json!({"name": "m", "body": "arm", "relative_to": if flags[2] { "coupler" } else { "ground" }, "law": {"start": numbers[8], "rate": numbers[9]}});
        let mut start = serde_json::Map::new();
        for (k, name) in ["crank", "coupler", "rocker", "cart"].into_iter().enumerate() {
            let mut entry = serde_json::Map::new();
            if flags[3 + k] {
                entry.insert("phi".to_owned(), numbers[10 + k].into());
            }
            if flags[7 + k] {
                entry.insert("omega".to_owned(), numbers[11 + k].into());
            }
            if flags[11 + k] && name == "cart" {
                entry.insert("origin".to_owned(), json!([numbers[1], numbers[2]]));
            }
            start.insert(name.to_owned(), entry.into());
        }
        scene["start"] = start.into();
        let read = parsed(&scene.to_string()).map_err(|error| TestCaseError::fail(error.to_string()))?;
        prop_assert_eq!(read.given[1].phi, flags[4]);
        prop_assert!((read.start[5].phi - (read.start[3].phi + numbers[7])).abs() < 1e-13);
        prop_assert_eq!(parsed(&read.to_input().to_string()), Ok(read));
    }
}

#[test]
fn what_is_likely_not_meant_is_told() {
    let scene = |length: f64, point: [f64; 2], phi: f64| {
        parsed(
            &json!({
                "name": "doubtful", "gravity": [0, -9.81],
                "bars": [
                    {"name": "one", "mass": 1, "centre": [length / 2.0, 0], "inertia": 0.1, "length": length},
                    {"name": "two", "mass": 1, "centre": [0.3, 0], "inertia": 0.1, "length": 0.6}
                ],
                "hinges": [
                    {"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "one", "point": [0, 0]}]},
                    {"name": "B", "between": [{"body": "one", "point": point}, {"body": "two", "point": [0, 0]}]}
                ],
                "start": {"one": {"phi": phi, "omega": 0}, "two": {"phi": 0, "omega": 0}},
                "until": 1, "every": 1
            })
            .to_string(),
        )
        .unwrap_or_else(|error| panic!("{error}"))
    };
    assert!(scene(0.6, [0.6, 0.0], 1.5).doubts().is_empty());
    for (doubtful, words) in [
        (scene(0.6, [0.6, 0.0], 90.0), ["start.one.phi is 90 rad", "90*pi/180"]),
        (scene(600.0, [600.0, 0.0], 1.5), ["bar one is 600 m long", "600 mm are 0.6"]),
        (scene(0.6, [0.7, 0.0], 1.5), ["hinges.B.between[0].point = [0.7, 0] lies off bar one", "[0.6, 0]"]),
        (scene(0.6, [0.3, 0.9], 1.5), ["hinges.B.between[0].point = [0.3, 0.9]", "off bar one"]),
    ] {
        let doubts = doubtful.doubts();
        assert!(doubts.len() == 1 && words.iter().all(|word| doubts[0].contains(word)), "{doubts:?}");
    }
    // Nothing of what is shipped is doubtful.
    for file in std::fs::read_dir("examples/scenes").expect("a folder").flatten() {
        if file.path().extension().is_some_and(|end| end == "json") {
            let scene = driftless::scene::read_scene(&file.path(), &[]).expect("a shipped scene");
            assert!(scene.doubts().is_empty(), "{:?}: {:?}", file.path(), scene.doubts());
        }
    }
}
