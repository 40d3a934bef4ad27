//! The program from outside: exit codes, what goes to stdout, stderr and files, and the names scripts rely
//! on.
#![cfg(feature = "cli")]

use crate::program;

use program::Program;
use serde_json::{Value, json};
use std::f64::consts::TAU;

#[track_caller]
fn near(found: &Value, expected: f64, within: f64) {
    let number = found.as_f64().unwrap_or_else(|| panic!("{found} is no number"));
    assert!((number - expected).abs() <= within, "{number} is not {expected}");
}

fn keys(object: &Value) -> Vec<&str> {
    object.as_object().expect("an object").keys().map(String::as_str).collect()
}

#[track_caller]
fn has_keys(object: &Value, expected: &[&str]) {
    for key in expected {
        assert!(object.get(key).is_some(), "no `{key}` in {object}");
    }
}

// What the program says of itself.

#[test]
fn help_lists_the_commands_and_fits_a_terminal() {
    let program = Program::new();
    let commands = ["check", "inspect", "run", "sweep", "compare", "methods", "schema", "completions"];
    program.run("--help").exits(0).shows(&commands).shows(&["Exit codes"]);
    program.run("--version").exits(0).shows(&["driftless "]);
    for command in commands {
        program.run(&format!("{command} --help")).exits(0).shows(&["Usage: driftless"]);
    }
    let options = [
        "--method",
        "--step",
        "--rtol",
        "--atol",
        "--until",
        "--every",
        "--stabilize",
        "--set",
        "--out",
        "--json",
        "--force",
    ];
    program.run("run --help").exits(0).shows(&options);
}

#[test]
fn methods_as_text_and_as_an_object() {
    let program = Program::new();
    program.run("methods").exits(0).shows(&["dopri5", "dp8", "gauss16", "rattle8"]);
    let methods = program.run("methods --json").exits(0).object();
    let list = methods["methods"].as_array().expect("a list");
    assert!(
        list.iter().any(|method| method["name"] == "gauss16"
            && method["order"] == 16
            && method["symplectic"] == true)
    );
}

#[test]
fn the_schema_is_an_object() {
    let schema = Program::new().run("schema").exits(0).object();
    assert!(schema["properties"]["bars"].is_object());
}

#[test]
fn completions_know_the_options() {
    let program = Program::new();
    for shell in ["bash", "zsh", "fish"] {
        program.run(&format!("completions {shell}")).exits(0).shows(&["stabilize", "gauss16"]);
    }
    program.run("completions tcl").exits(2);
}

// Usage.

#[test]
fn mistakes_on_the_command_line_are_explained_and_exit_2() {
    let program = Program::with_scenes(&["free"]);
    for (arguments, words) in [
        ("", vec!["Usage"]),
        ("runs free.json", vec!["'run'"]),
        ("run", vec!["<SCENE>"]),
        ("run free.json --metod dp8", vec!["--method"]),
        ("run free.json --method gauss15", vec!["gauss16"]),
        ("run free.json --step ten", vec!["--step", "1/64"]),
        ("run free.json --step -1", vec!["--step", "positive"]),
        ("run free.json --until nan", vec!["--until"]),
        ("run free.json --every 0", vec!["--every"]),
        ("run free.json --rtol 2", vec!["--rtol", "1e-9"]),
        ("run free.json --until 1e12 --every 1e-3", vec!["rows"]),
        ("run free.json --max-energy-drift -1", vec!["--max-energy-drift"]),
        ("run free.json --set bars", vec!["PATH=VALUE"]),
        ("run free.json --time-constant 0.1", vec!["baumgarte"]),
        ("run free.json --method gauss8 --rtol 1e-9", vec!["destroys what it is for", "hint: "]),
        ("run free.json --method dp8 --step 0.01", vec!["finds its own step", "hint: "]),
        ("run free.json --step 20", vec!["longer than the horizon"]),
        ("inspect free.json --method dp8", vec!["--method"]),
    ] {
        let ran = program.run(arguments).exits(2).says(&words);
        assert!(ran.stdout.is_empty(), "{arguments}: {ran:?}");
    }
    assert_eq!(program.files(), ["free.json"], "nothing was written");
}

#[test]
fn with_json_an_error_is_one_object_on_stdout() {
    let program = Program::with_scenes(&["free", "wall"]);
    program.write("broken.json", "{\"name\": \"broken\",}");
    for (arguments, code, kind) in [
        ("run free.json --json --bogus", 2, "usage"),
        ("run free.json --json --step -1", 2, "usage"),
        ("check broken.json --json", 3, "scene"),
        ("run wall.json --json --method gauss16", 3, "scene"),
        ("inspect nowhere.json --json", 6, "io"),
    ] {
        let ran = program.run(arguments).exits(code);
        let error = &ran.object()["error"];
        assert_eq!(
            (&error["kind"], &error["exit_code"]),
            (&Value::from(kind), &Value::from(code)),
            "{arguments}"
        );
        let message = error["message"].as_str().expect("a message");
        assert!(!message.is_empty() && ran.stderr.contains(message), "{ran:?}");
    }
    let object = program.run("check broken.json --json").object();
    assert_eq!(object["error"]["details"]["line"], 1);
}

// Scenes.

#[test]
fn scenes_that_are_none_exit_3_with_their_place() {
    let program = Program::new();
    let text = std::fs::read_to_string(program::shipped("free")).expect("a scene").replacen("670", "-670", 1);
    program.write("light.json", &text);
    for command in ["check", "inspect", "run"] {
        program.run(&format!("{command} light.json")).exits(3).says(&[
            "light.json:6:",
            "density",
            "-670",
            "hint",
        ]);
    }
    assert_eq!(program.files(), ["light.json"]);
}

#[test]
fn a_missing_scene_exits_6() {
    let program = Program::new();
    for command in ["check", "inspect", "run"] {
        program.run(&format!("{command} nowhere.json")).exits(6).says(&["nowhere.json", "cannot be read"]);
    }
}

#[test]
fn pairings_without_sense_exit_3_with_reason_and_alternative() {
    let program = Program::with_scenes(&["wall", "motor", "spring"]);
    for (arguments, words) in [
        ("wall.json --method gauss8", ["walls", "--method dp8"]),
        ("wall.json --method dop853", ["inside its steps", "--method dp8"]),
        ("motor.json --method gauss8 --stabilize projection", ["momenta", "--stabilize elimination"]),
        ("motor.json --method rattle4 --stabilize baumgarte", ["own projection", "leave --stabilize out"]),
        ("motor.json --method dop853 --stabilize projection", ["ode_solvers owns its loop", "--method dp8"]),
        ("spring.json --method rattle4 --set springs.spring.damping=0.1", ["damper", "--method dop853"]),
    ] {
        program.run(&format!("run {arguments}")).exits(3).says(&words).says(&["hint: "]);
        program.run(&format!("check {arguments}")).exits(3).says(&words);
    }
}

#[test]
fn set_changes_the_scene_and_a_wrong_path_is_refused() {
    let program = Program::with_scenes(&["free"]);
    let energy = |set: &str| {
        program.run(&format!("inspect free.json --json {set}")).exits(0).object()["bodies"]["bar1"]["x"]
            .clone()
    };
    near(&energy("--set gravity[0]=0"), 0.0, 0.0);
    near(&energy("--set gravity[0]=19.62"), 2.0 * 6.2971, 2e-4);
    near(&energy("--set gravity[0]=0 --set gravity[0]=9.81"), 6.2971, 1e-4);
    program
        .run("check free.json --set bars.bar3.length=1")
        .exits(3)
        .says(&["--set bars.bar3.length=1", "did you mean"]);
}

// check.

#[test]
fn check_says_what_is_active_and_what_is_left_out() {
    let program = Program::with_scenes(&["free", "motor", "wall", "branch"]);
    let check = |arguments: &str| program.run(&format!("check {arguments} --json")).exits(0).object();
    let free = check("free.json");
    assert_eq!((&free["method"], &free["degrees_of_freedom"]), (&"taylor".into(), &2.into()));
    let left_out = free["left_out"].to_string();
    for what in ["motors", "springs", "multipliers", "projection", "impacts", "off-axis"] {
        assert!(left_out.contains(what), "{left_out}");
    }
    let motor = check("motor.json");
    assert_eq!((&motor["method"], &motor["degrees_of_freedom"]), (&"taylor".into(), &1.into()));
    assert!(motor["why"].as_str().is_some_and(|why| why.contains("rounding")));
    let multiplier = check("motor.json --method dp8 --stabilize none");
    assert!(!multiplier["left_out"].to_string().contains("multipliers") && multiplier["why"].is_null());
    assert_eq!(check("wall.json")["method"], "dp8");
    assert_eq!(check("branch.json")["off_axis"], true);
    program.run("check motor.json").exits(0).shows(&[
        "taylor",
        "1 degree: 2 coordinates less 1 constraint",
        "left out",
        "elimination",
    ]);
    program.run("check motor.json -q").exits(0).stays_silent();
    program.run("check motor.json --stabilize baumgarte").exits(0).shows(&["five mean steps"]);
}

/// Every kind of part a scene has is told in the text and the JSON, and none of them is among what is left out.
#[test]
fn check_tells_every_kind_of_part() {
    let program = Program::with_scenes(&["slider_crank_torque", "slider_crank_driven", "latch"]);
    let coil = r#"{"name": "tors", "gravity": [0, -9.81],
        "bars": [{"name": "a", "mass": 1, "centre": [0.3, 0], "inertia": 0.02, "length": 0.6}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]}],
        "torsion_springs": [{"name": "coil", "body": "a", "stiffness": 3, "free_angle": 0, "damping": 0.1}],
        "torques": [{"name": "drive", "body": "a", "torque": 0.5}],
        "forces": [{"name": "push", "body": "a", "point": [0.6, 0], "force": [0.2, 0]}],
        "start": {"a": {"phi": 0.5, "omega": 1}}, "until": 1, "every": 0.1}"#;
    program.write("coil.json", coil);
    let check = |scene: &str| program.run(&format!("check {scene} --json")).exits(0).object();
    let found = check("coil.json");
    for (key, name) in
        [("torsion_springs", "coil"), ("torques", "drive"), ("forces", "push"), ("dampers", "coil")]
    {
        assert_eq!(found[key], serde_json::json!([name]), "{key}");
    }
    assert!(!found["left_out"].to_string().contains("springs"), "{}", found["left_out"]);
    assert_eq!(found["sliders"], serde_json::json!([]));
    program.run("check coil.json").exits(0).shows(&["torsion", "1 (coil)", "1 (push)", "1 (drive)"]);
    let torque = check("slider_crank_torque.json");
    assert!(torque["left_out"].to_string().contains("motors") && torque["torques"].to_string().len() > 4);
    let driven = check("slider_crank_driven.json");
    assert!(driven["motors"].to_string().len() > 4 && !driven["left_out"].to_string().contains("motors"));
    assert!(driven["sliders"].to_string().len() > 4, "{driven}");
    program.run("check latch.json").exits(0).shows(&["steps", "where events switch parts"]);
}

// inspect: the published numbers.

#[test]
fn inspect_gives_the_published_accelerations() {
    let program = Program::with_scenes(&["free", "hanging", "spinning", "spring", "motor"]);
    for (scene, expected) in [
        ("free", [6.2971, 0.0, -20.9903, 10.5097, 0.0, 6.9483]),
        ("hanging", [0.0; 6]),
        ("spinning", [-2.9609, 0.0, 0.0, -8.8826, 0.0, 0.0]),
        ("spring", [2.1063, 0.0, -7.0210, 8.4034, 0.0, -13.9693]),
        ("motor", [0.0, -11.8435, 0.0, 7.3575, -35.5306, -24.5250]),
    ] {
        let object = program.run(&format!("inspect {scene}.json --json")).exits(0).object();
        assert_eq!(keys(&object["bodies"]), ["bar1", "bar2"]);
        for (number, expected) in expected.into_iter().enumerate() {
            near(
                &object["bodies"][["bar1", "bar2"][number / 3]][["x", "y", "phi"][number % 3]],
                expected,
                0.5001e-4,
            );
        }
    }
}

/// The kite folds at half a turn of its crank: no state tells forces there.
#[test]
fn inspect_tells_no_forces_at_a_singular_position() {
    let program = Program::with_scenes(&["kite"]);
    let asked = "inspect kite.json --output F=B.force --output x=crank.x";
    let at = |t: &str| program.run(&format!("{asked} --at {t} --json")).exits(0).object();
    let (fold, beside) = (at("0.220568"), at("0.21"));
    assert!(fold["outputs"]["F"]["value"].is_null() && fold["outputs"]["x"]["value"].is_number());
    assert_eq!(fold["hinges"]["A"]["determinate"], false);
    assert!(beside["outputs"]["F"]["value"].is_number() && beside["bodies"]["crank"]["phi"].is_number());
}

#[test]
fn inspect_gives_multiplier_torque_power_and_hinge_forces() {
    let program = Program::with_scenes(&["motor", "free"]);
    let motor = program.run("inspect motor.json --json").exits(0).object();
    near(&motor["constraints"]["motor"]["multiplier"], -0.2662, 0.5001e-4);
    near(&motor["constraints"]["motor"]["position"], 0.0, 1e-15);
    near(&motor["constraints"]["motor"]["velocity"], 0.0, 1e-15);
    near(&motor["motors"]["motor"]["torque"], 0.2662, 0.5001e-4);
    near(&motor["motors"]["motor"]["power"], 1.6725, 0.5001e-4);
    // What hinge B carries moves bar 2; what A carries, less that, moves bar 1.
    let (mass, gravity) = (0.0603, 9.81);
    for (axis, (name, weight)) in [("x", mass * gravity), ("y", 0.0)].into_iter().enumerate() {
        let acceleration = |bar: &str| motor["bodies"][bar][name].as_f64().expect("a number");
        near(&motor["hinges"]["B"]["force"][axis], mass * acceleration("bar2") - weight, 1e-12);
        near(
            &motor["hinges"]["A"]["force"][axis],
            mass * (acceleration("bar1") + acceleration("bar2")) - 2.0 * weight,
            1e-12,
        );
    }
    assert_eq!(
        (&motor["hinges"]["B"]["on"], &motor["hinges"]["B"]["from"]),
        (&"bar2".into(), &"bar1".into())
    );
    assert_eq!(motor["hinges"]["A"]["from"], "ground");
    let free = program.run("inspect free.json --json").exits(0).object();
    assert!(keys(&free["motors"]).is_empty() && keys(&free["constraints"]).is_empty());
    has_keys(&free["energy"], &["kinetic", "potential", "total"]);
    program.run("inspect motor.json").exits(0).shows(&["torque", "0.266194", "ground"]);
}

#[test]
fn inspect_gives_the_impact_of_case_f() {
    let program = Program::with_scenes(&["wall"]);
    for e in [0.0, 0.5, 1.0] {
        let object = program
            .run(&format!("inspect wall.json --json --set walls.wall.restitution={e}"))
            .exits(0)
            .object();
        let impact = &object["walls"]["wall"]["impact"];
        // By hand: M⁻¹Jᵀ is along (1, -5) and J M⁻¹ Jᵀ = 24/7 l²/(m l²).
        near(&impact["omega_after"]["bar1"], TAU * (1.0 + 0.5 * (1.0 + e)), 1e-12);
        near(&impact["omega_after"]["bar2"], TAU * (1.0 - 2.5 * (1.0 + e)), 1e-12);
        let impulse = (1.0 + e) * 2.0 * TAU * 0.6 * 0.0603 * 7.0 / 24.0;
        near(&impact["impulse"], impulse, 1e-12);
        near(&impact["energy_lost"], 0.5 * (1.0 - e) * impulse * 2.0 * TAU * 0.6, 1e-12);
    }
}

// run.

#[test]
fn run_writes_whole_files_and_one_object() {
    let program = Program::with_scenes(&["motor"]);
    let ran = program.run("run motor.json --until 1 --json --no-charts").exits(0);
    let object = ran.object();
    has_keys(
        &object,
        &[
            "scene",
            "method",
            "settings",
            "until",
            "steps",
            "evaluations",
            "rejected",
            "wall_s",
            "final",
            "energy",
        ],
    );
    has_keys(&object, &["constraints", "trust", "files", "stop", "notes", "why", "stabilizer", "impacts"]);
    has_keys(&object["energy"], &["kind", "max_relative", "scale", "slope"]);
    has_keys(&object["constraints"]["motor"], &["position_max", "velocity_max"]);
    has_keys(&object["trust"], &["error_estimate", "horizon_s", "how"]);
    for bar in ["bar1", "bar2"] {
        assert_eq!(keys(&object["final"]["bodies"][bar]), ["phi", "omega", "x", "y", "vx", "vy"]);
    }
    assert_eq!((&object["energy"]["kind"], &object["until"]), (&"energy minus work".into(), &1.0.into()));
    // One turn a second for one second: unwrapped, not back at the start.
    near(&object["final"]["bodies"]["bar1"]["phi"], 1.25 * TAU, 1e-12);
    near(&object["final"]["t"], 1.0, 0.0);
    near(&object["constraints"]["motor"]["position_max"], 0.0, 0.0);
    assert_eq!(object["stop"], Value::Null);

    let folder = "output/motor/taylor-1e-9-elimination";
    let files = [format!("{folder}/run.json"), format!("{folder}/trajectory.csv")];
    assert_eq!(program.files(), [&["motor.json".to_owned()], &files[..]].concat());
    let mut listed: Vec<&str> =
        object["files"].as_array().expect("a list").iter().filter_map(Value::as_str).collect();
    listed.sort_unstable();
    assert_eq!(listed, files);

    let table = program.read(&files[1]);
    let lines: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(&lines[0][..3], ["t [s]", "bar1.phi [rad]", "bar1.omega [rad/s]"]);
    assert_eq!(lines.len(), 52, "a header and 51 rows");
    assert!(lines.iter().all(|line| line.len() == lines[0].len()));
    let last: f64 = lines[51][1].parse().expect("a number");
    assert_eq!(Some(last), object["final"]["bodies"]["bar1"]["phi"].as_f64(), "digits read back");
}

#[test]
fn the_record_holds_the_scene_and_repeats_bit_for_bit() {
    let program = Program::with_scenes(&["motor"]);
    let record = |out: &str| {
        program
            .run(&format!("run motor.json --until 1 -q --no-charts --out {out} --set motors.motor.law.rate=6 --set start.bar2.omega=6"))
            .exits(0);
        serde_json::from_str::<Value>(&program.read(&format!("{out}/motor/taylor-1e-9-elimination/run.json")))
            .expect("JSON")
    };
    let (mut one, mut two) = (record("one"), record("two"));
    assert_eq!(one["resolved_scene"]["motors"][0]["law"]["rate"], 6.0);
    assert_eq!(one["versions"]["driftless"], env!("CARGO_PKG_VERSION"));
    assert_eq!(one["hashes"]["scene_sha256"].as_str().map(str::len), Some(64));
    let timings = [&mut one, &mut two].map(|record| record["timings"].take());
    assert!(["wall_s", "trust_wall_s"].iter().all(|name| timings[0][name].is_f64()));
    assert_eq!(one, two, "all that differs stands in the timings");
    // The resolved scene is a scene, and the same one.
    program.write("again.json", &one["resolved_scene"].to_string());
    program.run("run again.json --until 1 -q --no-charts --out three").exits(0);
    let three: Value =
        serde_json::from_str(&program.read("three/motor/taylor-1e-9-elimination/run.json")).expect("JSON");
    assert_eq!(three["hashes"], one["hashes"]);
}

#[test]
fn a_run_is_not_overwritten_unasked() {
    let program = Program::with_scenes(&["free"]);
    let trajectory = "o/free/taylor-1e-9/trajectory.csv";
    program.run("run free.json --until 1 --no-charts --out o").exits(0);
    let before = program.read(trajectory);
    program
        .run("run free.json --until 2 --no-charts --out o")
        .exits(6)
        .says(&["holds results already", "--force"]);
    assert_eq!(program.read(trajectory), before);
    program.write("o/free/taylor-1e-9/notes.txt", "mine");
    program.write("o/free/taylor-1e-9/torque_power.png", "of an older run");
    program.write("o/free/taylor-1e-9/.unfinished-abctrajectory.csv", "half");
    program.run("run free.json --until 2 --no-charts --out o --force").exits(0);
    assert!(
        program.read(trajectory).starts_with(&before[..1000])
            && program.read(trajectory).len() > before.len()
    );
    let files: Vec<String> = program.files().into_iter().filter(|file| file.starts_with("o/")).collect();
    assert_eq!(
        files,
        ["notes.txt", "run.json", "trajectory.csv"].map(|name| format!("o/free/taylor-1e-9/{name}"))
    );
}

#[test]
fn a_folder_that_cannot_be_made_exits_6() {
    let program = Program::with_scenes(&["free"]);
    program.write("file", "");
    program.run("run free.json --out file").exits(6).says(&["cannot make the folder", "file"]);
    assert_eq!(program.files(), ["file", "free.json"]);
}

#[test]
fn quiet_stays_silent_and_the_rest_is_not() {
    let program = Program::with_scenes(&["free"]);
    program.run("run free.json --until 1 --no-charts -q").exits(0).stays_silent();
    let ran = program.run("run free.json --until 1 --no-charts --out b").exits(0).shows(&[
        "taylor",
        "energy drift",
        "trust",
        "trajectory.csv",
    ]);
    assert!(ran.stdout.lines().all(|line| line.chars().count() <= 80), "{}", ran.stdout);
    let ran = program.run("run free.json --until 1 --no-charts --out c -v").exits(0);
    ran.says(&["free.json", "trajectory.csv"]);
    program.run("run free.json --out c -q -v").exits(2);
}

#[test]
fn a_stop_exits_4_and_keeps_what_was_reached() {
    let program = Program::with_scenes(&["spinning"]);
    // A step of 2 s against a turn a second: the stages do not converge.
    let ran = program
        .run("run spinning.json --method gauss4 --step 2 --until 10 --no-charts --json")
        .exits(4)
        .says(&["stopped at t ="]);
    let object = ran.object();
    has_keys(&object["stop"], &["cause", "t", "what", "hint", "step", "method"]);
    assert_eq!((&object["error"]["kind"], &object["error"]["exit_code"]), (&"stopped".into(), &4.into()));
    assert_eq!(program.files().len(), 3, "scene, trajectory and record");
    program
        .run("run spinning.json --method gauss4 --step 2 --until 10 --no-charts --force")
        .exits(4)
        .shows(&["stopped"]);
}

#[test]
fn stated_limits_exit_5() {
    let program = Program::with_scenes(&["free", "motor_sine"]);
    let ran = program
        .run("run free.json --rtol 1e-3 --max-energy-drift 1e-9 --no-charts --json")
        .exits(5)
        .says(&["1e-9"]);
    let object = ran.object();
    assert_eq!(object["stop"]["cause"], "drift_limit");
    let t = object["final"]["t"].as_f64().expect("a number");
    assert!(t > 0.0 && t < 10.0, "it stopped there, not at the end: {t}");
    let table = program.read("output/free/taylor-1e-3/trajectory.csv");
    assert!(
        table.lines().last().is_some_and(|line| line.starts_with(&format!("{t:?},"))),
        "kept up to the stop"
    );
    program
        .run("run motor_sine.json --until 10 --method dp5 --rtol 1e-3 --stabilize none --max-constraint-drift 1e-12 --no-charts -q")
        .exits(5)
        .says(&["constraint motor"]);
    program
        .run("run motor_sine.json --until 10 --stabilize elimination --max-constraint-drift 0 --no-charts -q")
        .exits(0)
        .stays_silent();
}

#[test]
fn impacts_are_counted_and_lose_what_they_should() {
    let program = Program::with_scenes(&["wall"]);
    for e in [0.0, 0.5, 1.0] {
        let command = format!("run wall.json --set walls.wall.restitution={e} --no-charts --json --out o{e}");
        let object = program.run(&command).exits(0).object();
        assert_eq!(object["stop"], Value::Null);
        // Without any rebound the point stays on the wall for a while.
        has_keys(&object["holds"], &["count", "time_s", "first"]);
        assert!(
            e > 0.0 || object["holds"]["count"].as_u64().is_some_and(|count| count >= 1),
            "{}",
            object["holds"]
        );
        let impacts = &object["impacts"];
        let lost = impacts["energy_lost_j"].as_f64().expect("a number");
        assert!(impacts["count"].as_u64().is_some_and(|count| count >= 1), "{impacts}");
        assert!(if e == 1.0 { lost.abs() < 1e-12 } else { lost > 0.3 }, "e = {e}: {impacts}");
        near(&impacts["first"][0]["t"], 0.0, 0.0);
        assert!(
            object["energy"]["max_relative"].as_f64().is_some_and(|drift| drift < 1e-7),
            "{}",
            object["energy"]
        );
    }
}

#[test]
fn the_four_stabilizations_have_folders_of_their_own() {
    let program = Program::with_scenes(&["motor_sine"]);
    for kind in ["none", "baumgarte", "projection", "elimination"] {
        let ran = program
            .run(&format!("run motor_sine.json --until 2 --method dp8 --stabilize {kind} --no-charts --json"))
            .exits(0);
        let object = ran.object();
        assert_eq!(object["settings"]["stabilize"], kind);
        assert_eq!(object["settings"]["time_constant"].is_number(), kind == "baumgarte");
        has_keys(&object["stabilizer"], &["energy_j", "max_j"]);
        assert!(program.path(&format!("output/motor_sine/dp8-1e-9-{kind}/run.json")).exists());
    }
}

#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_is_no_failure() {
    use std::io::Read;
    use std::process::Stdio;
    let program = Program::new();
    let mut child = program
        .command("completions zsh")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program");
    drop(child.stdout.take());
    let mut stderr = String::new();
    child.stderr.take().expect("a pipe").read_to_string(&mut stderr).expect("text");
    assert_eq!((child.wait().expect("ended").code(), stderr.as_str()), (Some(0), ""));
}

// Charts.

#[cfg(feature = "charts")]
#[test]
fn charts_are_drawn_for_what_the_scene_has() {
    let program = Program::with_scenes(&["free", "motor"]);
    program.run("run free.json --until 1 -q --out a").exits(0).stays_silent();
    program.run("run motor.json --until 1 -q --out b --gif").exits(0);
    program.run("run motor.json --until 1 -q --out c --no-charts").exits(0);
    let pictures = |out: &str| -> Vec<String> {
        let name = |file: String| file.rsplit('/').next().unwrap_or_default().to_owned();
        program
            .files()
            .into_iter()
            .filter(|file| file.starts_with(out))
            .map(name)
            .filter(|name| name.ends_with("g") || name.ends_with("gif"))
            .collect()
    };
    assert_eq!(pictures("a/"), ["angles.png", "energy_drift.png", "mechanism.png"]);
    assert_eq!(
        pictures("b/"),
        ["angles.png", "energy_drift.png", "mechanism.gif", "mechanism.png", "torque_power.png"]
    );
    assert!(pictures("c/").is_empty());
    let read = |file: &str| {
        std::fs::read(program.path(&format!("b/motor/taylor-1e-9-elimination/{file}"))).expect("a picture")
    };
    let picture = read("angles.png");
    assert_eq!(&picture[..8], b"\x89PNG\r\n\x1a\n");
    let width = u32::from_be_bytes([picture[16], picture[17], picture[18], picture[19]]);
    assert!(width >= 1600, "{width} px wide");
    assert!(read("mechanism.gif").starts_with(b"GIF89a"));
}

/// Of a body that turns 80 times between two rows beside one that does not there is no path, and rows alone
/// are those of the whole run.
#[test]
fn rows_too_far_apart_are_told_beside_a_slow_body() {
    let program = Program::new();
    let text = r#"{"name": "ff", "gravity": [0, -9.81],
        "bars": [{"name": "a", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1},
            {"name": "b", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}],
        "start": {"a": {"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [1e-9, 0]},
            "b": {"phi": 0, "omega": 1000, "origin": [0, 1], "velocity": [0, 0]}}, "until": 5, "every": 0.5}"#;
    std::fs::write(program.path("ff.json"), text).expect("a file");
    program.run("run ff.json -q --out a --trust off --chart-format svg --method taylor --rtol 1e-9").exits(0);
    let words = |file: &str| {
        let path = program.path(&format!("a/ff/taylor-1e-9/{file}"));
        std::fs::read_to_string(path).expect("a picture")
    };
    let [mechanism, angles] = ["mechanism.svg", "angles.svg"].map(words);
    assert!(mechanism.contains("too far apart for one") && !mechanism.contains("last 0 s"), "{mechanism}");
    assert!(angles.contains("rows alone") && !angles.contains("first 0.5 s"), "{angles}");
}

#[test]
fn several_stabilizations_are_run_one_after_another_and_overlaid() {
    let program = Program::with_scenes(&["motor_sine"]);
    let ran = program.run(
        "run motor_sine.json --method dp8 --until 1 --stabilize none,projection,elimination --json --out a",
    );
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let object: serde_json::Value = serde_json::from_str(&ran.stdout).expect("one object");
    let kinds: Vec<&str> = (object["runs"].as_array().expect("runs").iter())
        .filter_map(|run| run["settings"]["stabilize"].as_str())
        .collect();
    assert_eq!(kinds, ["none", "projection", "elimination"]);
    let files = program.files();
    assert!(files.iter().any(|file| file == "a/motor_sine/constraint_drift.png"), "{files:?}");
    for kind in kinds {
        assert!(
            files.iter().any(|file| file == &format!("a/motor_sine/dp8-1e-9-{kind}/run.json")),
            "{kind}: {files:?}"
        );
    }
    // One pairing that makes no sense, and nothing is run.
    program.run("run motor_sine.json --method gauss16 --stabilize elimination,projection --out b").exits(3);
    assert!(!program.path("b").exists());
}

// Starts that are found.

#[test]
fn the_program_tells_changes_and_refuses_them_where_asked() {
    let program = Program::with_scenes(&["four_bar_motor", "kite", "four_bars"]);
    let words = ["phi of coupler is 0.43082", "instead of 0.43 rad"];
    let shown = ["0 degrees: 3 coordinates less 3 constraints", "phi of coupler is 0.43082"];
    program.run("check four_bar_motor.json").exits(0).says(&words).shows(&shown);
    assert!(program.run("check four_bar_motor.json --quiet").exits(0).stderr.is_empty());
    for command in ["check", "inspect", "run", "sweep --vary bars.crank.density=2700..2800:2"] {
        let mut words_of = command.split_whitespace();
        let (verb, rest) = (words_of.next().expect("a command"), words_of.collect::<Vec<_>>().join(" "));
        program
            .run(&format!("{verb} four_bar_motor.json {rest} --strict"))
            .exits(3)
            .says(&words)
            .says(&["--strict"]);
    }
    let error = program.run("check four_bar_motor.json --strict --json").exits(3).object();
    assert_eq!(error["error"]["details"]["changes"][0]["body"], "coupler");
    let object = program.run("check four_bar_motor.json --json").exits(0).object();
    assert_eq!(
        (object["degrees_of_freedom"].as_u64(), object["assembly"]["changes"][0]["quantity"].as_str()),
        (Some(0), Some("phi"))
    );
    program.run("run four_bar_motor.json --until 0.02 --no-charts --quiet").exits(0);
    let record = program.files().into_iter().find(|file| file.ends_with("run.json")).expect("a record");
    let record: Value = serde_json::from_str(&program.read(&record)).expect("JSON");
    assert_eq!(record["result"]["assembly"]["changes"][0]["given"].as_f64(), Some(0.43));
    program.run("check kite.json --strict").exits(0).shows(&["1 degree: 3 coordinates less 2 constraints"]);
    program.run("check four_bar_motor.json --set start.coupler.phi=2.5 --set until=1").exits(3).says(&[
        "error: four_bar_motor.json:",
        ": hinges[",
        "no start fits",
        "hint: ",
    ]);
    program
        .run("check four_bar_motor.json --set start={}")
        .exits(3)
        .says(&["error: four_bar_motor.json: the start is ambiguous: `start.", "roughly is enough"]);
    // A wall that a loop swings its point behind.
    let mut scene: Value = serde_json::from_str(&program.read("kite.json")).expect("JSON");
    let bar = scene["bars"][0]["name"].clone();
    scene["walls"] = json!([{"name": "stop", "body": bar, "point": [0, 0], "restitution": 0.5,
        "line": {"through": [100, 0], "normal": [1, 0]}}]);
    program.write("behind.json", &serde_json::to_string_pretty(&scene).expect("text"));
    program.run("check behind.json").exits(3).says(&["behind.json:", ": walls[0]", "`stop`", "hint: "]);
}
