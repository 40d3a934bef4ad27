//! Scenes: those shipped read and round-trip; everything else is refused at the right place, with a hint.

use driftless::scene::{Override, Scene, SceneError, parse_scene, read_scene, schema};
use proptest::prelude::*;
use serde_json::Value;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::{Path, PathBuf};

/// Two bars, a spring, a motor and a wall; every refusal below is this scene with one thing changed.
const GOOD: &str = r#"{
  "name": "good",
  "description": "Täglich 1 Prüfung.",
  "gravity": [9.81, 0],
  "bars": [
    {"name": "bar1", "length": 0.6, "width": 0.05, "thickness": 0.003, "density": 670},
    {"name": "bar2", "length": 0.5, "width": 0.04, "thickness": 0.003, "density": 680, "inertia": "slender"},
    {"name": "disc", "mass": 0.1, "centre": [0, 0.1], "inertia": 0.001}
  ],
  "hinges": [
    {"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar1", "point": [0, 0]}]},
    {"name": "B", "between": [{"body": "bar2", "point": [0, 0]}, {"body": "bar1", "point": [0.6, 0]}]},
    {"name": "C", "between": [{"body": "bar2", "point": [0.5, 0]}, {"body": "disc", "point": [0, 0]}]}
  ],
  "springs": [
    {"name": "spring", "between": [{"body": "ground", "point": [-0.3, 0]}, {"body": "bar1", "point": [0.4, 0]}], "stiffness": 7, "free_length": 0.4}
  ],
  "motors": [
    {"name": "motor", "body": "bar1", "law": {"start": 0.5, "rate": 2, "sines": [{"amplitude": 0.25, "frequency": 4}]}}
  ],
  "walls": [
    {"name": "wall", "body": "bar2", "point": [0.5, 0], "line": {"through": [-2, 0], "normal": [3, 4]}, "restitution": 0.5}
  ],
  "start": {
    "bar1": {"phi": 0.5, "omega": 3},
    "bar2": {"phi": 0.25, "omega": 0},
    "disc": {"phi": -0.125, "omega": 1}
  },
  "until": 10,
  "every": 0.01
}
"#;

fn parsed(text: &str) -> Result<Scene, SceneError> {
    parse_scene(text, "good.json", &[])
}

fn refused(text: &str) -> SceneError {
    match parsed(text) {
        Ok(_) => panic!("accepted: {text}"),
        Err(error) => error,
    }
}

fn with(set: &[&str]) -> Result<Scene, SceneError> {
    let overrides: Vec<Override> = set.iter().map(|set| set.parse().expect("PATH=VALUE")).collect();
    parse_scene(GOOD, "good.json", &overrides)
}

/// GOOD with the first `old` replaced.
fn changed(old: &str, new: &str) -> String {
    assert!(GOOD.contains(old), "not in the good scene: {old}");
    GOOD.replacen(old, new, 1)
}

/// Line and column of a byte, counted the slow way.
fn place(text: &str, byte: usize) -> (usize, usize) {
    let (mut line, mut column) = (1, 1);
    for character in text[..byte].chars() {
        if character == '\n' {
            (line, column) = (line + 1, 1);
        } else {
            column += 1;
        }
    }
    (line, column)
}

fn shipped() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes");
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .expect("folder of scenes")
        .map(|entry| entry.expect("entry").path())
        .collect();
    files.retain(|file| file.extension().is_some_and(|end| end == "json"));
    files.sort();
    files
}

fn read_shipped(name: &str) -> Scene {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/scenes/{name}.json"));
    read_scene(&file, &[]).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_shipped_scene_reads() {
    let files = shipped();
    assert_eq!(files.len(), 36);
    for file in files {
        match read_scene(&file, &[]) {
            Ok(scene) => {
                assert_eq!(Some(scene.name.as_str()), file.file_stem().and_then(|stem| stem.to_str()));
                assert_eq!(scene.description.matches('.').count(), 1, "one sentence: {}", scene.description);
            }
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn shipped_scenes_are_the_source_problem() {
    let free = read_shipped("free");
    let mass = 670.0 * 0.6 * 0.05 * 0.003;
    assert_eq!(free.gravity, [9.81, 0.0]);
    assert_eq!((free.until, free.every), (10.0, 0.01));
    for (bar, start) in free.bars.iter().zip(&free.start) {
        assert!((bar.mass - 0.0603).abs() < 1e-16);
        assert_eq!((bar.mass, bar.centre, bar.length), (mass, [0.3, 0.0], 0.6));
        assert!((bar.inertia / (mass * (0.36 + 0.0025) / 12.0) - 1.0).abs() < 1e-15);
        assert_eq!((start.phi, start.omega), (FRAC_PI_2, 0.0));
    }
    let spinning = read_shipped("spinning");
    assert!(spinning.start.iter().all(|start| (start.phi, start.omega) == (0.0, PI)));
    let spring = read_shipped("spring");
    assert!((spring.springs[0].stiffness - 7.5 * 0.0603 * 9.81 / 0.6).abs() < 1e-12);
    assert_eq!(spring.springs[0].between.map(|end| end.point), [[-0.3, 0.0], [0.4, 0.0]]);
    let motor = read_shipped("motor");
    assert!((motor.bars[0].inertia / (mass * 0.36 / 12.0) - 1.0).abs() < 1e-15);
    assert!(motor.start.iter().all(|start| (start.phi, start.omega) == (FRAC_PI_2, TAU)));
    let sine = read_shipped("motor_sine");
    assert!(sine.start.iter().all(|start| (start.phi, start.omega) == (FRAC_PI_2, TAU + 1.0)));
    let wall = read_shipped("wall");
    assert!(wall.start.iter().all(|start| (start.phi, start.omega) == (FRAC_PI_2, TAU)));
    assert_eq!((wall.walls[0].bar, wall.walls[0].point, wall.walls[0].normal), (1, [0.6, 0.0], [1.0, 0.0]));
    assert_eq!(read_shipped("chain8").bars.len(), 8);
}

#[test]
fn every_shipped_scene_reads_back_as_written_out() {
    for file in shipped() {
        let scene = read_scene(&file, &[]).unwrap_or_else(|error| panic!("{error}"));
        let text = scene.to_input().to_string();
        assert_eq!(parsed(&text).unwrap_or_else(|error| panic!("{error}")), scene);
    }
    let scene = parsed(GOOD).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(parsed(&scene.to_input().to_string()), Ok(scene));
}

#[test]
fn the_good_scene_resolves() {
    let scene = parsed(GOOD).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.description, "Täglich 1 Prüfung.");
    assert_eq!(scene.bars[2].length, 0.2);
    assert_eq!(scene.hinges[1].between.map(|place| place.bar), [Some(1), Some(0)]);
    assert_eq!(scene.springs[0].damping, 0.0);
    assert_eq!(scene.walls[0].normal, [0.6, 0.8]);
    assert_eq!((scene.start[0].phi, scene.start[0].omega), (0.5, 3.0));
    assert_eq!(
        (scene.motors[0].relative_to, scene.motors[0].law.acceleration, scene.motors[0].law.sines[0].phase),
        (None, 0.0, 0.0)
    );
}

/// What to change, into what, the text the error must point at, the path, and a part of the message.
const REFUSALS: &[(&str, &str, &str, &str, &str)] = &[
    // Kinds and ranges.
    (
        "\"density\": 670",
        "\"density\": -670",
        "-670",
        "bars[0].density",
        "= -670: must be a number from 1e-30 to 1e30 kg/m³",
    ),
    ("\"density\": 670", "\"density\": 0", "0}", "bars[0].density", "kg/m³"),
    ("\"density\": 670", "\"density\": 1e999", "1e999", "bars[0].density", "= 1e999: must be"),
    ("\"density\": 670", "\"density\": \"670\"", "\"670\"", "bars[0].density", "without quotes: 670"),
    ("\"density\": 670", "\"density\": null", "null", "bars[0].density", "= null"),
    ("\"density\": 670", "\"density\": [670]", "[670]", "bars[0].density", "= [670]"),
    ("\"length\": 0.6", "\"length\": -0.6", "-0.6", "bars[0].length", "from 1e-30 to 1e30 m"),
    ("\"length\": 0.6", "\"length\": 1e-31", "1e-31", "bars[0].length", "from 1e-30 to 1e30 m"),
    ("\"density\": 670", "\"density\": 1e-30", "{\"name\": \"bar1\"", "bars[0]", "comes to a mass of"),
    (
        "\"inertia\": \"slender\"",
        "\"inertia\": \"slim\"",
        "\"slim\"",
        "bars[1].inertia",
        "must be \"full\", \"slender\" or a number",
    ),
    (
        "\"inertia\": \"slender\"",
        "\"inertia\": \"slendr\"",
        "\"slendr\"",
        "bars[1].inertia",
        "did you mean \"slender\"?",
    ),
    ("\"inertia\": \"slender\"", "\"inertia\": -1", "-1}", "bars[1].inertia", "kg·m²"),
    ("\"mass\": 0.1", "\"mass\": 0", "0, \"centre\"", "bars[2].mass", "from 1e-30 to 1e30 kg"),
    ("\"mass\": 0.1, ", "", "{\"name\": \"disc\"", "bars[2].mass", "is missing: must be a number"),
    ("\"mass\": 0.1", "\"mass\": 0.1, \"width\": 1", "\"width\": 1", "bars[2].width", "is not a known key"),
    ("[0, 0.1]", "[0, 0.1, 0]", "[0, 0.1, 0]", "bars[2].centre", "two numbers [x, y]"),
    ("[0, 0.1]", "[0, true]", "true]", "bars[2].centre[1]", "= true"),
    ("[9.81, 0]", "9.81", "9.81", "gravity", "two numbers [x, y], each from -1e30 to 1e30 m/s²"),
    ("[9.81, 0]", "[9.81, -1e31]", "-1e31", "gravity[1]", "m/s²"),
    ("\"stiffness\": 7", "\"stiffness\": -7", "-7", "springs[0].stiffness", "from 0 to 1e30 N/m"),
    ("\"free_length\": 0.4", "\"free_length\": -0.4", "-0.4", "springs[0].free_length", "from 0 to 1e30 m"),
    ("\"free_length\": 0.4", "\"free_length\": 0.4, \"damping\": -1", "-1}", "springs[0].damping", "N·s/m"),
    (
        "\"restitution\": 0.5",
        "\"restitution\": 1.5",
        "1.5",
        "walls[0].restitution",
        "must be a number from 0 to 1\n",
    ),
    ("\"restitution\": 0.5", "\"restitution\": -0.1", "-0.1", "walls[0].restitution", "from 0 to 1"),
    (
        "\"normal\": [3, 4]",
        "\"normal\": [0, 0]",
        "[0, 0]}, \"restitution\"",
        "walls[0].line.normal",
        "must be longer",
    ),
    ("\"phi\": 0.25", "\"phi\": 1e15", "1e15", "start.bar2.phi", "take off whole turns"),
    ("\"until\": 10", "\"until\": 0", "0,\n  \"every\"", "until", "from 1e-30 to 1e12 s"),
    ("\"until\": 10", "\"until\": -10", "-10", "until", "from 1e-30 to 1e12 s"),
    ("\"every\": 0.01", "\"every\": 0", "0\n}", "every", "from 1e-30 to 1e12 s"),
    ("\"every\": 0.01", "\"every\": 11", "11\n", "every", "at most the horizon `until`, 10 s"),
    ("\"every\": 0.01", "\"every\": 1e-20", "1e-20", "every", "2⁵³"),
    ("\"name\": \"good\"", "\"name\": \"-good\"", "\"-good\"", "name", "not starting with -"),
    (
        "\"name\": \"good\"",
        "\"name\": \"../good\"",
        "\"../good\"",
        "name",
        "letters a to z or A to Z, digits",
    ),
    ("\"name\": \"good\"", "\"name\": \"\"", "\"\",", "name", "1 to 64"),
    ("\"name\": \"good\"", "\"name\": 7", "7,", "name", "double quotes"),
    ("Täglich", "Täg\\nlich", "\"Täg", "description", "one line"),
    ("\"start\": {\n", "\"start\": [], \"x\": {\n", "\"x\"", "x", "is not a known key"),
    ("{\"phi\": 0.25, \"omega\": 0}", "0.25", "0.25,\n", "start.bar2", "must be an object"),
    // Keys and names.
    ("\"density\": 670", "\"densty\": 670", "\"densty\"", "bars[0].densty", "did you mean `density`?"),
    ("\"until\": 10", "\"until\": 10, \"until\": 11", "\"until\": 11", "until", "appears twice"),
    (
        "\"phi\": 0.25",
        "\"phi\": 0.25, \"ph\\u0069\": 1",
        "\"ph\\u0069\"",
        "start.bar2.ph\\u0069",
        "appears twice",
    ),
    (
        "\"density\": 670",
        "\"density\": 670, \"density\": 670",
        "\"density\": 670}",
        "bars[0].density",
        "appears twice",
    ),
    ("\"gravity\": [9.81, 0],", "", "{\n", "gravity", "is missing"),
    ("\"rate\": 2", "\"speed\": 2", "\"speed\"", "motors[0].law.speed", "a law has the keys start, rate"),
    ("{\"start\": 0.5, ", "{", "{\"rate\"", "motors[0].law.start", "is missing"),
    (
        "\"amplitude\": 0.25",
        "\"amplitud\": 0.25",
        "\"amplitud\"",
        "motors[0].law.sines[0].amplitud",
        "did you mean `amplitude`?",
    ),
    (
        "\"name\": \"bar2\"",
        "\"name\": \"bar1\"",
        "\"bar1\", \"length\": 0.5",
        "bars[1].name",
        "must be unique; bars[0].name is the same",
    ),
    ("\"name\": \"bar2\"", "\"name\": \"ground\"", "\"ground\", \"length\"", "bars[1].name", "another name"),
    ("\"name\": \"bar2\"", "\"name\": \"bar 2\"", "\"bar 2\"", "bars[1].name", "for example \"bar_2\""),
    (
        "\"name\": \"B\"",
        "\"name\": \"A\"",
        "\"A\", \"between\": [{\"body\": \"bar2\"",
        "hinges[1].name",
        "hinges[0].name is the same",
    ),
    // Bodies that are not there, and hinges that join nothing.
    (
        "\"body\": \"bar2\", \"point\": [0, 0]",
        "\"body\": \"bar3\", \"point\": [0, 0]",
        "\"bar3\"",
        "hinges[1].between[0].body",
        "known bars: bar1, bar2, disc",
    ),
    (
        "\"body\": \"bar1\", \"law\"",
        "\"body\": \"disk\", \"law\"",
        "\"disk\"",
        "motors[0].body",
        "did you mean \"disc\"?",
    ),
    (
        "\"body\": \"bar1\", \"law\"",
        "\"body\": \"ground\", \"law\"",
        "\"ground\", \"law\"",
        "motors[0].body",
        "must be the name of a bar",
    ),
    (
        "\"body\": \"bar2\", \"point\": [0.5, 0], \"line\"",
        "\"body\": \"ground\", \"point\": [0.5, 0], \"line\"",
        "\"ground\", \"point\": [0.5",
        "walls[0].body",
        "must be the name of a bar",
    ),
    (
        "\"body\": \"bar1\", \"point\": [0.4, 0]",
        "\"body\": \"bra1\", \"point\": [0.4, 0]",
        "\"bra1\"",
        "springs[0].between[1].body",
        "did you mean \"bar1\"?",
    ),
    (
        "\"body\": \"ground\", \"point\": [-0.3, 0]",
        "\"body\": \"bar1\", \"point\": [-0.3, 0]",
        "[{\"body\": \"bar1\"",
        "springs[0].between",
        "joins `bar1` to itself",
    ),
    (
        "\"body\": \"bar1\", \"point\": [0, 0]",
        "\"body\": \"ground\", \"point\": [0, 0]",
        "[{\"body\": \"ground\"",
        "hinges[0].between",
        "joins the ground to itself",
    ),
    (
        ", {\"body\": \"disc\", \"point\": [0, 0]}",
        "",
        "[{\"body\": \"bar2\", \"point\": [0.5, 0]}]",
        "hinges[2].between",
        "does not have two places",
    ),
    ("\"bar2\": {\"phi\"", "\"bar\": {\"phi\"", "\"bar\"", "start.bar", "names no bar"),
    // Parts that do not fit.
    ("\"bar2\": {\"phi\": 0.25, \"omega\": 0},", "", "{\n    \"bar1\"", "start.bar2", "is missing"),
    ("\"phi\": 0.25, ", "", "{\"omega\": 0}", "start.bar2.phi", "is missing: must be a number"),
    (
        "\"omega\": 0}",
        "\"velocity\": [0, 0]}",
        "[0, 0]},\n    \"disc",
        "start.bar2.velocity",
        "is given, but bar `bar2` hangs on the ground",
    ),
    (
        "\"phi\": 0.5",
        "\"phi\": 0.6",
        "0.6, \"omega\": 3",
        "start.bar1.phi",
        "must be 0.5 rad, by the law of motor `motor`",
    ),
    ("\"omega\": 3", "\"omega\": 2", "2}", "start.bar1.omega", "must be 3.0 rad/s"),
    (
        "\"body\": \"bar1\", \"law\"",
        "\"body\": \"bar1\", \"relative_to\": \"bar1\", \"law\"",
        "\"bar1\", \"law\"",
        "motors[0].relative_to",
        "another bar",
    ),
    ("\"free_length\": 0.4", "\"free_length\": 0.4, \"k\": 1", "\"k\"", "springs[0].k", "is not a known key"),
    (
        "[-0.3, 0]}, {\"body\": \"bar1\", \"point\": [0.4, 0]",
        "[0, 0]}, {\"body\": \"bar1\", \"point\": [0, 0]",
        "{\"name\": \"spring\"",
        "springs[0]",
        "starts with length 0 and has the free length",
    ),
    (
        "[-0.3, 0]}, {\"body\": \"bar1\", \"point\": [0.4, 0]}], \"stiffness\": 7, \"free_length\": 0.4",
        "[0, 0]}, {\"body\": \"bar1\", \"point\": [0, 0]}], \"stiffness\": 7, \"free_length\": 0, \"damping\": 0.1",
        "{\"name\": \"spring\"",
        "springs[0]",
        "starts with length 0 and has the damping",
    ),
    (
        "\"normal\": [3, 4]",
        "\"normal\": [-3, -4]",
        "{\"name\": \"wall\"",
        "walls[0]",
        "behind it at the start",
    ),
    (
        "\"centre\": [0, 0.1], \"inertia\": 0.001",
        "\"centre\": [0, 0], \"inertia\": 0",
        "{\"name\": \"disc\"",
        "bars[2]",
        "point mass on its own hinge",
    ),
];

#[test]
fn every_refusal_names_its_place() {
    for (old, new, needle, path, message) in REFUSALS {
        let text = changed(old, new);
        let error = refused(&text);
        let refusal = error.refusal();
        let (line, column) = place(&text, text.find(needle).expect("the text pointed at"));
        assert_eq!((refusal.line, refusal.column), (Some(line), Some(column)), "place of\n{error}");
        assert_eq!(refusal.path, *path, "path of\n{error}");
        assert!(error.to_string().contains(message), "no `{message}` in\n{error}");
        assert!(!refusal.hint.is_empty() && !refusal.allowed.is_empty(), "hint of\n{error}");
        assert!(
            error.to_string().starts_with(&format!("good.json:{line}:{column}: {path} ")),
            "first line of\n{error}"
        );
        assert!(!error.is_io());
    }
}

#[test]
fn a_refusal_reads_like_this() {
    let error = refused(&changed("\"density\": 670", "\"density\": -670"));
    let shown = "good.json:6:83: bars[0].density = -670: must be a number from 1e-30 to 1e30 kg/m³
  6 |     {\"name\": \"bar1\", \"length\": 0.6, \"width\": 0.05, \"thickness\": 0.003, \"density\": -670},
    |                                                                                   ^^^^
  hint: for example \"density\": 670";
    assert_eq!(error.to_string(), shown);
    let json = serde_json::to_value(&error).expect("an error serializes");
    let keys = ["file", "set", "line", "column", "path", "value", "problem", "allowed", "hint"];
    assert_eq!(json.as_object().expect("an object").keys().collect::<Vec<_>>(), keys);
    assert_eq!(
        (&json["line"], &json["column"], &json["value"]),
        (&Value::from(6), &Value::from(83), &Value::from("-670"))
    );
}

#[test]
fn the_marks_stand_under_the_value_in_long_lines_too() {
    let padding = " ".repeat(500);
    for text in [
        changed("\"omega\": 3", "\"omega\": [1]"),
        changed("\"omega\": 3", &format!("{padding}\"omega\": [1]{padding}")),
    ] {
        let shown = refused(&text).to_string();
        let lines: Vec<Vec<char>> = shown.lines().map(|line| line.chars().collect()).collect();
        assert!(lines[1].len() < 110, "{shown}");
        let marks: String = lines[1]
            .iter()
            .zip(&lines[2])
            .filter(|(_, mark)| **mark == '^')
            .map(|(letter, _)| letter)
            .collect();
        assert_eq!(marks, "[1]", "{shown}");
    }
}

/// GOOD with these motors and this start.
fn driven(motors: &str, start: &str) -> String {
    let mut scene: Value = serde_json::from_str(GOOD).expect("JSON");
    scene["motors"] = serde_json::from_str(motors).expect("motors");
    scene["start"] = serde_json::from_str(start).expect("start");
    scene.to_string()
}

#[test]
fn a_start_that_a_motor_gives_may_be_left_out() {
    let absolute = r#"{"name": "m", "body": "bar1", "law": {"start": 0.5, "rate": 2, "sines": [{"amplitude": 0.3, "frequency": 4, "phase": 0.7}]}}"#;
    let relative =
        r#"{"name": "r", "body": "bar2", "relative_to": "disc", "law": {"start": 0.1, "rate": -1}}"#;
    let both = format!("[{absolute}, {relative}]");
    let law = (0.5 + 0.3 * libm::sin(0.7), 2.0 + 0.3 * 4.0 * libm::cos(0.7));
    let disc = r#"{"disc": {"phi": 0.7, "omega": 0.2}}"#;
    let scene = parsed(&driven(&both, disc)).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((scene.start[0].phi, scene.start[0].omega), law);
    assert_eq!((scene.start[1].phi, scene.start[1].omega), (0.7 + 0.1, 0.2 - 1.0));

    // The other way round, and both with the last place off: the same bits.
    let bar2 = r#"{"bar2": {"phi": 0.7999999999999999, "omega": -0.8}}"#;
    let scene = parsed(&driven(&both, bar2)).unwrap_or_else(|error| panic!("{error}"));
    assert!((scene.start[2].phi - 0.7).abs() < 1e-15);
    assert_eq!(parsed(&scene.to_input().to_string()), Ok(scene));
    let nearly =
        r#"{"disc": {"phi": 0.7, "omega": 0.2}, "bar2": {"phi": 0.8000000000000003, "omega": -0.8}}"#;
    let scene = parsed(&driven(&both, nearly)).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.start[1].phi, 0.7 + 0.1);

    let apart = r#"{"disc": {"phi": 0.7, "omega": 0.2}, "bar2": {"phi": 0.80000000001, "omega": -0.8}}"#;
    let error = refused(&driven(&both, apart));
    assert_eq!(error.refusal().path, "start.bar2.phi", "{error}");
    assert!(
        error.refusal().allowed.contains("must be 0.79999999")
            && error.refusal().hint.contains("leave the bar out"),
        "{error}"
    );
    let turned = format!(
        r#"{{"disc": {{"phi": 0, "omega": 0}}, "bar1": {{"phi": {}, "omega": {}}}}}"#,
        law.0 + 2.0 * TAU,
        law.1
    );
    assert!(refused(&driven(&both, &turned)).refusal().hint.contains("2 turns off"), "whole turns are told");
    let neither = refused(&driven(&both, "{}"));
    assert_eq!(neither.refusal().path, "start.disc");
    assert!(neither.refusal().hint.contains("tie it to other bars"), "{neither}");
}

#[test]
fn a_start_on_the_edge_is_no_fault() {
    let ends =
        r#"springs.spring.between=[{"body": "ground", "point": [0, 0]}, {"body": "bar1", "point": [0, 0]}]"#;
    assert!(with(&[ends]).is_err());
    assert!(
        with(&[ends, "springs.spring.free_length=0"]).is_ok(),
        "without a free length the force is zero there"
    );
    assert!(with(&["start.bar2.phi=8.7e12"]).is_ok());
    assert!(with(&["bars.disc.inertia=0"]).is_ok(), "a point mass away from its hinge");
    assert!(with(&[r#"bars.disc.centre=[0, 0]"#]).is_ok(), "a wheel on its hinge");
    assert_eq!(with(&["bars.disc.centre=[0, 0]"]).map(|scene| scene.bars[2].length), Ok(0.2));
    assert!(with(&["gravity=[0, 0]", "every=10"]).is_ok());
}

#[test]
fn two_motors_may_not_drive_the_same_angle() {
    let law = r#""law": {"start": 0}"#;
    let start = r#"{"disc": {"phi": 0, "omega": 0}}"#;
    let twice =
        format!(r#"[{{"name": "a", "body": "bar1", {law}}}, {{"name": "b", "body": "bar1", {law}}}]"#);
    assert_eq!(refused(&driven(&twice, start)).refusal().path, "motors[1]");
    let round = format!(
        r#"[{{"name": "a", "body": "bar1", {law}}}, {{"name": "b", "body": "bar2", {law}}}, {{"name": "c", "body": "bar2", "relative_to": "bar1", {law}}}]"#
    );
    let error = refused(&driven(&round, start));
    assert_eq!(error.refusal().path, "motors[2]");
    assert!(error.to_string().contains("(motor `c`) drives an angle that is given already"), "{error}");
    let far = r#"[{"name": "a", "body": "bar1", "law": {"start": 8e12, "sines": [{"amplitude": 8e12, "frequency": 1, "phase": 1.5}]}}]"#;
    assert!(
        refused(&driven(far, r#"{"disc": {"phi": 0, "omega": 0}, "bar2": {"phi": 0, "omega": 0}}"#))
            .to_string()
            .contains("take off whole turns")
    );
}

#[test]
fn text_that_is_not_json_is_refused_where_it_ceases_to_be() {
    for (text, at, hint) in [
        ("{\"name\": \"x\",}", (1, 14), "comma"),
        ("{\"näme\": nan}", (1, 10), "finite"),
        ("{\"name\":\r\n  \"x\" \"y\"}", (2, 7), "missing"),
        ("{\"name\": // no\n 1}", (1, 10), "comments"),
        ("{\"name\": .5}", (1, 10), "0.5"),
        ("{\"name\": [1, 2", (1, 15), "close"),
        ("{} {}", (1, 4), ""),
        ("{\"a\": \"\\ud800\"}", (1, 7), "surrogate"),
        ("", (1, 1), "examples/scenes"),
        (" \n", (1, 1), "examples/scenes"),
        ("[1]", (1, 1), "examples/scenes"),
        ("7", (1, 1), "examples/scenes"),
    ] {
        let error = refused(text);
        let refusal = error.refusal();
        assert_eq!((refusal.line, refusal.column), (Some(at.0), Some(at.1)), "{text:?}\n{error}");
        assert!(refusal.hint.contains(hint) && !refusal.hint.is_empty(), "{text:?}\n{error}");
    }
    let deep = refused(&("{\"a\":[".repeat(100_000) + &"]}".repeat(100_000)));
    assert!(deep.to_string().contains("nested too deeply"), "{deep}");
}

#[test]
fn line_ends_and_marks_of_other_systems_do_not_move_the_place() {
    let bad = changed("\"omega\": 3", "\"omega\": true");
    let place = |text: &str| (refused(text).refusal().line, refused(text).refusal().column);
    assert_eq!(place(&bad), (Some(25), Some(35)));
    assert_eq!(place(&bad.replace('\n', "\r\n")), (Some(25), Some(35)));
    assert_eq!(place(&format!("\u{feff}{bad}")), (Some(25), Some(35)));
    assert!(!refused(&bad.replace('\n', "\r\n")).to_string().contains('\r'));
    assert!(parsed(&format!("\u{feff}{}", GOOD.replace('\n', "\r\n"))).is_ok());
    let wide = GOOD.replace('\n', " ").replace("\"omega\": 3", "\"omega\": true");
    let (line, column) = self::place(&wide, wide.find("true").expect("the value"));
    assert_eq!(place(&wide), (Some(line), Some(column)));
}

#[test]
fn files_that_cannot_be_read_are_told_from_bad_ones() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("a file");
        path
    };
    let missing = read_scene(&folder.path().join("none.json"), &[]).expect_err("no such file");
    assert!(missing.is_io() && missing.refusal().line.is_none(), "{missing}");
    assert!(
        missing.to_string().contains("none.json: cannot be read") && missing.to_string().contains("hint: "),
        "{missing}"
    );
    assert!(read_scene(folder.path(), &[]).expect_err("a folder").is_io());

    let empty = read_scene(&file("empty.json", b""), &[]).expect_err("empty");
    assert!(!empty.is_io() && empty.to_string().contains("the file is empty"), "{empty}");
    let latin =
        read_scene(&file("latin.json", b"{\n \"name\": \"\xc3\xa4\xe4\"}"), &[]).expect_err("Latin-1");
    assert_eq!((latin.refusal().line, latin.refusal().column), (Some(2), Some(12)), "{latin}");
    assert!(!latin.is_io() && latin.to_string().contains("UTF-8"));
    let long = read_scene(&file("long.json", &vec![b' '; (16 << 20) + 1]), &[]).expect_err("long");
    assert!(!long.is_io() && long.to_string().contains("16 MiB"), "{long}");
    let just = read_scene(&file("just.json", (" ".repeat((16 << 20) - GOOD.len()) + GOOD).as_bytes()), &[]);
    assert!(just.is_ok());
}

#[test]
fn ten_thousand_bars_are_read_and_one_more_is_not() {
    let chain = |count: usize| {
        let bars: Vec<_> =
            (0..count).map(|i| format!(r#"{{"name":"b{i}","mass":1,"centre":[1,0],"inertia":0}}"#)).collect();
        let hinges: Vec<_> = (0..count)
            .map(|i| {
                let parent = if i == 0 { "ground".to_owned() } else { format!("b{}", i - 1) };
                format!(r#"{{"name":"h{i}","between":[{{"body":"b{i}","point":[0,0]}},{{"body":"{parent}","point":[1,0]}}]}}"#)
            })
            .collect();
        let start: Vec<_> = (0..count).map(|i| format!(r#""b{i}":{{"phi":0,"omega":0}}"#)).collect();
        format!(
            r#"{{"name":"long","gravity":[0,0],"bars":[{}],"hinges":[{}],"start":{{{}}},"until":1,"every":1}}"#,
            bars.join(","),
            hinges.join(","),
            start.join(",")
        )
    };
    assert_eq!(parsed(&chain(10_000)).map(|scene| scene.bars.len()), Ok(10_000));
    let error = refused(&chain(10_001));
    assert!(
        error.to_string().contains("bars has 10001 elements: must be a list of 1 to 10000 objects"),
        "{error}"
    );
    assert!(refused(&chain(0)).to_string().contains("bars has 0 elements"));
}

#[test]
fn values_can_be_set_from_outside() {
    let set = |options: &[&str]| with(options).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(set(&["walls.wall.restitution=0.75"]).walls[0].restitution, 0.75);
    assert_eq!(set(&["start.bar2.phi=0.3", "until = 100", "gravity[0]=1.62"]).start[1].phi, 0.3);
    assert_eq!(set(&["gravity[0]=1.62", "gravity=[0, -9.81]"]).gravity, [0.0, -9.81]);
    assert_eq!(set(&["bars[0].length=0.5"]).bars[0].length, set(&["bars.bar1.length=0.5"]).bars[0].length);
    assert_eq!(
        set(&["springs.spring.damping=0.2"]).springs[0].damping,
        0.2,
        "a key with a default may be new"
    );
    assert_eq!(set(&["description=Other words."]).description, "Other words.");
    assert_eq!(set(&["start.bar1.omega=4", "motors.motor.law.rate=3"]).start[0].omega, 4.0);
    assert_eq!(set(&["motors.motor.law.sines[0].phase=0", "until=20"]).until, 20.0);

    for (option, path, message) in [
        ("walls.wall.restitution=2", "walls[0].restitution", "must be a number from 0 to 1\n"),
        ("walls.wal.restitution=1", "walls.wal", "did you mean `wall`?"),
        ("walls.wall.restitutoin=1", "walls[0].restitutoin", "did you mean `restitution`?"),
        ("wals.wall.restitution=1", "wals", "did you mean `walls`?"),
        ("start.pendulum.phi=1", "start.pendulum", "there are: bar1, bar2, disc"),
        ("gravity[2]=1", "gravity[2]", "gravity has 2 elements"),
        ("gravity.x=1", "gravity.x", "use an index"),
        ("until.x=1", "until", "has no `x` to set"),
        ("until[0]=1", "until", "only lists have indices"),
        ("until=soon", "until", "= \"soon\": unknown name soon: must be a number"),
        ("until=1e999", "until", "must be a number"),
        ("start.bar1.phi=0.3", "start.bar1.phi", "must be 0.5 rad"),
        ("bars[0]={\"name\":\"bar1\",\"length\":true}", "bars[0].length", "= true"),
    ] {
        let error = with(&[option]).expect_err(option);
        let refusal = error.refusal();
        assert_eq!(
            (refusal.path.as_str(), refusal.line, refusal.column),
            (path, None, None),
            "{option}\n{error}"
        );
        let place = format!("good.json with --set {}=", option.split('=').next().unwrap_or(""));
        assert!(
            error.to_string().starts_with(&place) && error.to_string().contains(message),
            "{option}\n{error}"
        );
        assert!(!refusal.hint.is_empty(), "{option}");
    }
    // A fault of the file that an option brings to light stands in the file.
    let error = with(&["motors.motor.law.rate=3"]).expect_err("the start no longer agrees");
    assert_eq!(
        (error.refusal().path.as_str(), error.refusal().line),
        ("start.bar1.omega", Some(25)),
        "{error}"
    );
    for bad in
        ["until", "=3", ".until=3", "bars[x].length=1", "bars[0=1", "bars[0]x=1", "bars[-1]=1", "[0]=1"]
    {
        assert!(bad.parse::<Override>().is_err(), "{bad}");
    }
}

#[test]
fn the_schema_knows_every_key_of_every_shipped_scene() {
    /// Fails where `value` does not match `schema`, for the few words our schema uses.
    fn check(value: &Value, schema: &Value, path: &str) -> Result<(), String> {
        let kinds = schema["oneOf"].as_array().or(schema["anyOf"].as_array());
        if let Some(kinds) = kinds {
            let matching = kinds.iter().filter(|kind| check(value, kind, path).is_ok()).count();
            return if matching == 1 || matching > 1 && schema["oneOf"].is_null() {
                Ok(())
            } else {
                Err(format!("{path}: {matching} kinds match {value}"))
            };
        }
        let may_be = |kind: &str| {
            schema["type"] == kind
                || schema["type"].as_array().is_some_and(|kinds| kinds.contains(&kind.into()))
        };
        match value {
            Value::Object(members) => {
                for key in schema["required"].as_array().into_iter().flatten() {
                    value.get(key.as_str().expect("a key")).ok_or(format!("{path}: no {key}"))?;
                }
                members.iter().try_for_each(|(key, member)| {
                    let known = schema["properties"]
                        .get(key)
                        .or(Some(&schema["additionalProperties"]).filter(|any| any.is_object()));
                    check(
                        member,
                        known.ok_or(format!("{path}.{key} is not in the schema"))?,
                        &format!("{path}.{key}"),
                    )
                })
            }
            Value::Array(items) if schema["type"] == "array" => {
                items.iter().try_for_each(|item| check(item, &schema["items"], path))
            }
            Value::Number(number) if may_be("number") => {
                let (number, least, most) =
                    (number.as_f64(), schema["minimum"].as_f64(), schema["maximum"].as_f64());
                if least <= number && (most.is_none() || number <= most) {
                    Ok(())
                } else {
                    Err(format!("{path}: {number:?}"))
                }
            }
            Value::String(_) if may_be("string") => Ok(()),
            _ if schema["enum"].as_array().is_some_and(|words| words.contains(value)) => Ok(()),
            _ => Err(format!("{path}: {value} does not match {schema}")),
        }
    }
    let schema = schema();
    for file in shipped() {
        let text = std::fs::read_to_string(&file).expect("a file");
        let scene: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(check(&scene, &schema, "scene"), Ok(()), "{}", file.display());
        let written = parsed(&text).expect("a scene").to_input();
        assert_eq!(check(&written, &schema, "scene"), Ok(()), "{}", file.display());
    }
    let unknown = serde_json::from_str(&changed("\"density\"", "\"densty\"")).expect("JSON");
    assert!(check(&unknown, &schema, "scene").is_err());
    let density = &schema["properties"]["bars"]["items"]["oneOf"][0]["properties"]["density"];
    assert_eq!(density["description"], "Density. [kg/m³]");
    assert_eq!((density["minimum"].as_f64(), density["maximum"].as_f64()), (Some(1e-30), Some(1e30)));
    assert_eq!(density["examples"][0], 670);
    assert_eq!(schema["additionalProperties"], false);
}

/// What any text must end in: a scene that reads back the same, or an error with a place inside the text and
/// a hint.
fn sound(text: &str, overrides: &[Override]) -> Result<(), TestCaseError> {
    match parse_scene(text, "any.json", overrides) {
        Ok(scene) => {
            prop_assert_eq!(parse_scene(&scene.to_input().to_string(), "again.json", &[]), Ok(scene))
        }
        Err(error) => {
            let refusal = error.refusal();
            prop_assert!(
                !refusal.hint.is_empty() && !refusal.allowed.is_empty() && !refusal.problem.is_empty()
            );
            prop_assert!(!error.is_io() && error.to_string().lines().count() <= 4, "{}", error);
            if refusal.set.is_none() {
                let line = refusal.line.expect("a line");
                prop_assert!((1..=text.split('\n').count()).contains(&line));
                let length = text.split('\n').nth(line - 1).expect("that line").chars().count();
                prop_assert!((1..=length + 1).contains(&refusal.column.expect("a column")), "{}", error);
            }
        }
    }
    Ok(())
}

/// Pieces that mean something to the reader.
const PIECES: &[&str] = &[
    "{",
    "}",
    "[",
    "]",
    ",",
    ":",
    "\"",
    "\\",
    "-",
    "1e308",
    "1e-308",
    "1e999",
    "0",
    "null",
    "\"ground\"",
    "\"bar1\"",
    "\"bar2\"",
    "\"disc\"",
    "ä",
    "\u{feff}",
    "\r",
    "\n",
    "\t",
    "\"mass\": 1,",
    "\"phi\": 0,",
    "\\ud800",
    "NaN",
    "\u{1f600}",
    "\u{7f}",
    "//",
    "[]",
    "{}",
    "true",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_bytes_bring_the_reader_down(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        sound(&String::from_utf8_lossy(&bytes), &[])?;
    }

    #[test]
    fn no_change_of_a_good_scene_brings_the_reader_down(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), 0..12_usize, 0..PIECES.len() + 1), 1..4)
    ) {
        let mut letters: Vec<char> = GOOD.chars().collect();
        for (at, removed, piece) in changes {
            let at = at.index(letters.len());
            let end = (at + removed).min(letters.len());
            letters.splice(at..end, PIECES.get(piece).copied().unwrap_or("").chars());
        }
        sound(&letters.into_iter().collect::<String>(), &[])?;
    }

    #[test]
    fn no_option_brings_the_reader_down(option in "[a-z0-9\\[\\].]{0,12}=.{0,8}", path in 0..8_usize, value in any::<f64>()) {
        let known = ["until", "gravity[1]", "bars.bar1.density", "walls[0].point[0]", "motors.motor.law.rate", "start.bar1", "hinges[0].name", "bars"];
        let set = Override { path: known[path].to_owned(), value: serde_json::json!(value) };
        sound(GOOD, std::slice::from_ref(&set))?;
        if let Ok(random) = option.parse() {
            sound(GOOD, &[random, set])?;
        }
    }

    #[test]
    fn any_scene_reads_back_as_written_out(
        numbers in proptest::collection::vec(-50.0..50.0_f64, 12),
        sizes in proptest::collection::vec(1e-3..1e3_f64, 8),
        given in 0..3_usize,
    ) {
        let mut scene: Value = serde_json::from_str(GOOD).expect("JSON");
        scene["bars"][0]["length"] = sizes[0].into();
        scene["bars"][1]["density"] = sizes[1].into();
        scene["bars"][2]["mass"] = sizes[2].into();
        scene["bars"][2]["centre"] = vec![numbers[0], numbers[1]].into();
        scene["springs"][0]["stiffness"] = sizes[3].into();
        scene["gravity"] = vec![numbers[2], numbers[3]].into();
        scene["walls"][0]["line"]["normal"] = vec![numbers[4], 1.0 + sizes[6]].into();
        scene["walls"][0]["line"]["through"] = vec![-1e6 * numbers[4], -1e6 * (1.0 + sizes[6])].into();
        scene["motors"] = serde_json::json!([
            {"name": "a", "body": "bar2", "relative_to": "disc", "law": {"start": numbers[6], "rate": numbers[7]}},
            {"name": "b", "body": "bar1", "relative_to": "bar2", "law": {"start": numbers[8], "sines": [{"amplitude": sizes[4], "frequency": sizes[5], "phase": numbers[9]}]}}
        ]);
        let names = ["bar1", "bar2", "disc"];
        scene["start"] = serde_json::json!({names[given]: {"phi": numbers[10], "omega": numbers[11]}});
        let read = parsed(&scene.to_string()).map_err(|error| TestCaseError::fail(error.to_string()))?;
        prop_assert_eq!((read.start[given].phi, read.start[given].omega), (numbers[10], numbers[11]));
        prop_assert!((read.walls[0].normal[0].hypot(read.walls[0].normal[1]) - 1.0).abs() < 1e-15);
        prop_assert_eq!(parsed(&read.to_input().to_string()), Ok(read));
    }
}
