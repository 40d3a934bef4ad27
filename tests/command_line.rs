//! What people type, and what they are told: short names and numbers of `--set`, scenes from standard input,
//! folders, words and notes.
#![cfg(feature = "cli")]

use crate::program;

use program::{Program, Ran};
use serde_json::Value;
use std::f64::consts::FRAC_PI_2;
use std::io::Write;
use std::process::Stdio;

fn with_input(program: &Program, arguments: &str, input: &str) -> Ran {
    let mut child =
        (program.command(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()))
            .spawn()
            .expect("the program");
    child.stdin.take().expect("a pipe").write_all(input.as_bytes()).expect("taken");
    let output = child.wait_with_output().expect("it ends");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    Ran { code: output.status.code().unwrap_or(-1), stdout: text(output.stdout), stderr: text(output.stderr) }
}

fn record(program: &Program, path: &str) -> Value {
    serde_json::from_str(&program.read(path)).expect("JSON")
}

#[test]
fn a_value_is_set_by_the_names_and_numbers_that_vary_takes() {
    let program = Program::with_scenes(&["free", "spring", "motor"]);
    for (scene, short, long) in [
        ("free", "bar1.phi=pi/2", format!("start.bar1.phi={FRAC_PI_2}")),
        ("free", "bar1.phi=-0.5pi", format!("start.bar1.phi={}", -FRAC_PI_2)),
        ("free", "bar2.omega=1/4", "start.bar2.omega=0.25".to_owned()),
        ("spring", "spring.stiffness=2*pi", format!("springs.spring.stiffness={}", 4.0 * FRAC_PI_2)),
        ("motor", "motor.rate=pi", format!("motors.motor.law.rate={}", 2.0 * FRAC_PI_2)),
        ("free", "gravity[1]=1/8", "gravity[1]=0.125".to_owned()),
        ("free", "bar1.phi=1/2*pi", format!("start.bar1.phi={FRAC_PI_2}")),
        ("free", "bar1.phi=3*pi/4", format!("start.bar1.phi={}", 6.0 * FRAC_PI_2 / 4.0)),
        ("free", "bar1.phi=2pi/3", format!("start.bar1.phi={}", 4.0 * FRAC_PI_2 / 3.0)),
    ] {
        let inspected =
            |set: &str| program.run(&format!("inspect {scene}.json --json --set {set}")).exits(0).object();
        assert_eq!(inspected(short), inspected(&long), "{short}");
    }
    // Text stays text where text is meant, and a name that means nothing is told.
    let object = program.run("check free.json --json --set name=pi").exits(0).object();
    assert_eq!(object["scene"], "pi");
    program.run("check free.json --set bra1.phi=0").exits(3).says(&["bra1", "does not exist"]);
    program.run("check free.json --set bar1.phi=ten").exits(3).says(&["start.bar1.phi", "must be a number"]);
    // Half of pi, or one over a whole turn?
    program.run("check free.json --set bar1.phi=1/2pi").exits(3).says(&[
        "start.bar1.phi",
        "1/2pi",
        "write products with *",
    ]);
    program.run("sweep free.json --vary bar1.phi=0..1/2pi:3").exits(2).says(&["`1/2pi`", "1/2*pi"]);
    program.run("check free.json --until 1/2pi").exits(2).says(&["1/2pi", "1/2*pi"]);
    // Options take the same numbers.
    let until = program.run("check free.json --json --until pi").exits(0).object();
    assert_eq!(
        until["until"].as_f64().or(until["plan"]["until"].as_f64()),
        Some(2.0 * FRAC_PI_2),
        "{until:#}"
    );
}

#[test]
fn a_start_that_is_asked_for_can_be_added() {
    let program = Program::with_scenes(&["free"]);
    let whole = program.read("free.json");
    let mut scene: Value = serde_json::from_str(&whole).expect("JSON");
    scene["start"].as_object_mut().expect("starts").remove("bar2");
    program.write("part.json", &scene.to_string());
    program.run("check part.json").exits(3).says(&["start.bar2"]);
    scene.as_object_mut().expect("a scene").remove("start");
    program.write("none.json", &scene.to_string());
    let expected =
        program.run("inspect free.json --json --set bar1.phi=1 --set bar1.omega=0 --set bar2.phi=2 --set bar2.omega=3").exits(0).object();
    let bar1 = "--set bar1.phi=1 --set bar1.omega=0";
    for (name, sets) in [("part", bar1), ("none", bar1)] {
        let arguments =
            format!("inspect {name}.json --json {sets} --set start.bar2.phi=2 --set bar2.omega=3");
        assert_eq!(program.run(&arguments).exits(0).object(), expected, "{name}");
    }
    program.run("check none.json --set start.bar3.phi=0").exits(3).says(&[
        "start.bar3",
        "does not exist",
        "`bar1`",
    ]);
    program.run("check free.json --set walls.wall.restitution=0").exits(3).says(&["walls", "does not exist"]);
}

#[test]
fn a_scene_is_read_from_standard_input() {
    let program = Program::with_scenes(&["free"]);
    let text = program.read("free.json");
    let ran = with_input(&program, "run - --until 1 --json --no-charts --out piped", &text).exits(0);
    let file = program.run("run free.json --until 1 --json --no-charts --out file").exits(0);
    assert_eq!(
        (&ran.object()["scene"], &ran.object()["final"]),
        (&file.object()["scene"], &file.object()["final"])
    );
    with_input(&program, "inspect - --json", &text).exits(0);
    with_input(&program, "check -", "{\"name\": 3}").exits(3).says(&["standard input:1:"]);
}

#[test]
fn formulas_stand_in_scene_files_and_options() {
    let program = Program::with_scenes(&["free"]);
    let text = program.read("free.json");
    let scene = text.replacen("\"phi\": 1.5707963267948966", "\"phi\": \"pi/2\"", 1);
    assert_ne!(text, scene);
    program.write("formula.json", &scene);
    program.run("run free.json --until 1 --every 0.5 -q --no-charts --out one").exits(0);
    program.run("run formula.json --until 1 --every 0.5 -q --no-charts --out two").exits(0);
    let table = |out: &str| program.read(&format!("{out}/free/taylor-1e-9/trajectory.csv"));
    assert_eq!(table("one"), table("two"));
    let scene = text.replacen("\"phi\": 1.5707963267948966", "\"phi\": \"pi/tow\"", 1);
    program.write("formula.json", &scene);
    program.run("check formula.json").exits(3).says(&["unknown name tow", "^^^", "hint:"]);
    // A parameter of the scene is set and varied by its name, and moves all that is made of it.
    let scene = text.replace("\"length\": 0.6", "\"length\": \"l\"").replacen(
        '{',
        "{\"parameters\": {\"l\": 0.6},",
        1,
    );
    program.write("formula.json", &scene);
    program.run("run formula.json --set l=3/5 --until 1 --every 0.5 -q --no-charts --out three").exits(0);
    assert_eq!(table("one"), table("three"));
    program.run("sweep formula.json --vary l=0.5..0.7:3 --until 1 -q --no-charts --out swept").exits(0);
}

#[test]
fn a_horizon_out_of_range_is_told_in_a_line() {
    let ran =
        Program::with_scenes(&["free"]).run("run free.json --until 1e300").exits(2).says(&["1e300 is not"]);
    assert!(ran.stderr.lines().all(|line| line.len() < 120), "{ran:?}");
}

#[test]
fn the_record_has_the_horizon_that_was_run() {
    let program = Program::with_scenes(&["free"]);
    program.run("run free.json --until 0.5 --every 0.25 -q --no-charts").exits(0);
    let found = record(&program, "output/free/taylor-1e-9/run.json");
    assert_eq!(
        (&found["resolved_scene"]["until"], &found["resolved_scene"]["every"]),
        (&0.5.into(), &0.25.into())
    );
    // What it holds is a scene that runs again to the same bits.
    program.write("again.json", &found["resolved_scene"].to_string());
    program.run("run again.json -q --no-charts --out again").exits(0);
    assert_eq!(
        program.read("again/free/taylor-1e-9/trajectory.csv"),
        program.read("output/free/taylor-1e-9/trajectory.csv")
    );
    program.run("sweep free.json --vary bar1.phi=1..2:2 --until 0.5 -q --no-charts").exits(0);
    let sweep = record(&program, "output/free/sweep-start.bar1.phi-taylor-1e-9/sweep.json");
    assert_eq!(sweep["resolved_scene"]["until"], 0.5);
}

#[test]
fn one_is_one() {
    let program = Program::with_scenes(&["free"]);
    let ran =
        program.run("sweep free.json --vary bar1.phi=1..1:1 --until 1 --no-charts --threads 1").exits(0);
    let ran = ran.shows(&["1 value\n", "1 point,", "on 1 thread,", "0 of 1 point,"]);
    assert!(!ran.stdout.contains(" 1 points") && !ran.stdout.contains(" 1 values"), "{ran:?}");
}

#[test]
fn several_stabilizations_have_a_folder_each() {
    for (scene, folders) in [
        ("free", ["taylor-1e-9-none", "taylor-1e-9-projection"]),
        ("motor", ["taylor-1e-9-none", "taylor-1e-9-projection"]),
    ] {
        let program = Program::with_scenes(&[scene]);
        program.run(&format!("run {scene}.json --until 0.5 --method taylor --stabilize none,projection --out new -q --no-charts")).exits(0);
        for folder in folders {
            assert_eq!(
                record(&program, &format!("new/{scene}/{folder}/run.json"))["result"]["final"]["t"],
                0.5
            );
        }
    }
}

#[test]
fn a_length_that_moves_no_point_is_told() {
    let program = Program::with_scenes(&["four_bar_motor", "free"]);
    let stays = ["note: bars.coupler.length does not move", "hinges.B.between[0].point = [0.9, 0]"];
    program
        .run("sweep four_bar_motor.json --vary bars.coupler.length=0.8..1:3 --until 0.1 --no-charts")
        .exits(0)
        .says(&stays);
    let found =
        record(&program, "output/four_bar_motor/sweep-bars.coupler.length-taylor-1e-9-projection/sweep.json");
    assert!(found["result"]["notes"].to_string().contains("hinges.B"), "{found:#}");
    program.run("inspect four_bar_motor.json --set coupler.length=0.8").exits(0).says(&stays);
    // A point at the new end, or a bar without points beside its origin, leaves nothing to say.
    let quiet = program.run("inspect four_bar_motor.json --set coupler.length=0.9").exits(0);
    assert!(!quiet.stderr.contains("does not move"), "{quiet:?}");
    let quiet = program.run("sweep free.json --vary bar2.length=0.5..0.7:2 --until 0.1 --no-charts").exits(0);
    assert!(!quiet.stderr.contains("does not move"), "{quiet:?}");
}

#[test]
fn no_hint_speaks_of_the_library() {
    // Names of the library's items help nobody at a prompt.
    let source = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut folders = vec![source];
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).expect("a folder").flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                folders.push(path);
            } else {
                let text = std::fs::read_to_string(&path).expect("text");
                for line in text.lines().filter(|line| line.trim_start().starts_with("hint:")) {
                    assert!(
                        !line.contains("::holding") && !line.contains("stiff method"),
                        "{}: {line}",
                        path.display()
                    );
                }
            }
        }
    }
}

// Outputs.

#[test]
fn outputs_are_columns_of_runs_and_sweeps_and_moments() {
    let program = Program::with_scenes(&["crank_rocker", "latch"]);
    let run =
        program.run("run crank_rocker.json --json --no-charts --every 0.01 --output load=O.force*pen.y");
    let outputs = run.exits(0).object()["outputs"].clone();
    let peak = |name: &str| outputs[name]["max"]["value"].as_f64().expect("a number");
    assert!(peak("load") > 0.1 * peak("O") && peak("load") < 0.28 * peak("O"), "{outputs:#}");
    assert_eq!(outputs["load"]["unit"], "J");

    // A run of the sweep has the extremes of the run itself.
    program
        .run("sweep crank_rocker.json --vary speed=20..40:3 --every 0.01 --map max:O --out swept --quiet")
        .exits(0);
    let table = program.read("swept/crank_rocker/sweep-parameters.speed-taylor-1e-9-projection/sweep.csv");
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let column = header.iter().position(|name| *name == "max:O [N]").expect("the column");
    let swept: Vec<f64> = lines
        .map(|line| line.split(',').nth(column).and_then(|cell| cell.parse().ok()).expect("a number"))
        .collect();
    assert_eq!(swept.len(), 3);
    let alone = program
        .run("run crank_rocker.json --json --no-charts --set speed=30 --out alone --trust off")
        .exits(0)
        .object();
    assert_eq!(alone["outputs"]["O"]["max"]["value"].as_f64(), Some(swept[1]));
    program
        .run("sweep crank_rocker.json --vary speed=20..40:3 --map max:Q --out wrong")
        .exits(2)
        .says(&["max:Q", "max:O"]);

    // No two columns have one name, unless one is the other.
    for output in ["crank.phi=pen.y", "kinetic=pen.y", "t=pen.y", "motor.torque=2*motor.torque", "O.C=pen.y"]
    {
        let name = output.split('=').next().expect("a name");
        let refused = program.run(&format!("run crank_rocker.json --output {output} --out twice")).exits(2);
        refused.says(&[&format!("the name {name} is that of another column"), "rename"]);
    }
    program.run("check crank_rocker.json --output crank.phi").exits(0);

    // An output named as one of the scene's takes its place.
    let own =
        program.run("run crank_rocker.json --json --no-charts --output O=pen.y --out replaced --trust off");
    let outputs = own.exits(0).object()["outputs"].clone();
    assert_eq!(outputs["O"]["unit"], "m", "{outputs:#}");

    // What is asked for and does not exist is refused with what there is.
    program.run("run crank_rocker.json --output Q.force").exits(2).says(&["--output Q.force", "O.force"]);
}

#[test]
fn what_does_not_suit_a_method_on_the_way_stops_it_there() {
    let program = Program::with_scenes(&["latch"]);
    let stopped = program.run("run latch.json --method rattle2 --step 0.005 --no-charts -q").exits(4);
    stopped.says(&["rattle2 stopped at t = 0.748", "the natural form takes constant ones only"]);
}

#[test]
fn a_moment_is_that_of_the_run() {
    let program = Program::with_scenes(&["crank_rocker", "latch"]);
    let run =
        program.run("run crank_rocker.json --json --no-charts --until 0.3 --trust off").exits(0).object();
    let moment = program.run("inspect crank_rocker.json --json --at 0.3").exits(0).object();
    assert_eq!(moment["t"], 0.3);
    for name in ["O", "torque", "pen_speed"] {
        let (a, b) = (&run["outputs"][name]["final"], &moment["outputs"][name]["value"]);
        let (a, b) = (a.as_f64().expect("a number"), b.as_f64().expect("a number"));
        assert!((a - b).abs() < 1e-9 * b.abs(), "{name}: {a} {b}");
    }
    program.run("inspect crank_rocker.json --at 0.3").exits(0).shows(&["0.3 s", "torque"]);
    program.run("inspect crank_rocker.json --at -1").exits(2).says(&["--at"]);
    program.run("inspect crank_rocker.json --at lunch").exits(2).says(&["--at lunch", "event"]);
    // The release ends the motion: there is no later moment.
    let ended = program.read("latch.json").replace(r#""off": ["latch"]}"#, r#""action": "stop"}"#);
    with_input(&program, "inspect - --at release", &ended).exits(0).shows(&["2.5 s"]);
    with_input(&program, "inspect - --at 3", &ended).exits(2).says(&["--at 3", "release", "2.5 s"]);
}

#[test]
fn kinematics_leaves_a_table_charts_and_a_record() {
    let program = Program::with_scenes(&["crank_rocker", "free"]);
    let object = program.run("kinematics crank_rocker.json --positions 36 --json").exits(0).object();
    assert_eq!(object["positions"], 37);
    assert_eq!(object["drive"]["closes"], true);
    assert_eq!(object["assemblies"], 2);
    assert_eq!(object["dead_centres"].as_array().map(Vec::len), Some(4));
    let folder = "output/crank_rocker/kinematics-motor";
    let table = program.read(&format!("{folder}/kinematics.csv"));
    assert!(table.starts_with("motor [rad],t [s],crank.phi [rad],crank.omega [rad/s],crank.alpha [rad/s²],"));
    assert_eq!(table.lines().count(), 38);
    assert_eq!(record(&program, &format!("{folder}/kinematics.json"))["positions"], 37);
    program.run("kinematics crank_rocker.json --drive crank=-1..1 --chart-format svg --out s -q").exits(0);
    let chart = program.read("s/crank_rocker/kinematics-crank/kinematics.svg");
    assert!(
        chart.contains("N·m") && chart.contains("from −1 to 1 rad"),
        "signs and units as in other charts"
    );
    // What is there is not overwritten unasked.
    program.run("kinematics crank_rocker.json").exits(6).says(&["--force"]);
    let swung = program.run("kinematics crank_rocker.json --drive rocker=0..3 --no-charts").exits(0);
    swung.shows(&["limit", "in line at A", "rocker"]);
    program.run("kinematics free.json").exits(2).says(&["no motor", "--drive bar1"]);
    program.run("kinematics free.json --drive bar1").exits(3).says(&["leaves 1 degree", "hint: "]);
    program.run("kinematics crank_rocker.json --drive rocker=3..0").exits(2).says(&["--drive", "FROM"]);
}

#[test]
fn a_start_is_drawn_and_so_is_what_comes_closest() {
    let program = Program::with_scenes(&["four_bar_motor"]);
    program.run("check four_bar_motor.json --chart start.png").exits(0).says(&["drawn in start.png"]);
    program.run("check four_bar_motor.json --chart start.bmp").exits(2).says(&[
        "start.bmp",
        ".png, .svg or .pdf",
        "hint: ",
    ]);
    program
        .run("check four_bar_motor.json --set bars.coupler.length=0.9 --set hinges.C.between[0].point[0]=3 --chart open.png")
        .exits(3)
        .says(&["no start fits", "closest: \"start\": {\"coupler\"", "none of", "drawn in open.png"]);
    for name in ["start.png", "open.png"] {
        assert!(program.files().contains(&name.to_owned()), "{name}");
    }
}

#[test]
fn charts_come_in_the_formats_and_of_the_columns_and_window_asked_for() {
    let program = Program::with_scenes(&["slider_crank_driven", "motor", "hanging", "kepler", "cart_pole"]);
    program
        .run("run slider_crank_driven.json --chart-format svg,pdf --chart block.x,motor.torque --window 0.02..0.06 --gif --apng --out o -q")
        .exits(0);
    let files = program.files();
    let of = |ending: &str| files.iter().filter(|file| file.ends_with(ending)).count();
    // mechanism, angles, energy_drift, constraint_drift, torque_power, columns
    assert_eq!([".svg", ".pdf", ".png", ".gif", ".apng"].map(of), [6, 6, 0, 1, 1], "{files:?}");
    let read = |name: &str| {
        let file = files.iter().find(|file| file.ends_with(name)).expect("a chart");
        std::fs::read_to_string(program.path(file)).expect("text")
    };
    let columns = read("columns.svg");
    for words in ["block.x [m]", "motor.torque [N·m]", "0.02 s to 0.06 s of 0.1 s"] {
        assert!(columns.contains(words), "{words}");
    }
    for words in ["slider [m]", "at a constant angle: block", "crank [rad]"] {
        assert!(read("angles.svg").contains(words), "{words}");
    }
    // A second run leaves nothing of the first.
    program.run("run slider_crank_driven.json --no-charts --out o --force -q").exits(0);
    let left = program.files().into_iter().filter(|file| file.starts_with("o/") && !file.ends_with(".json"));
    assert_eq!(left.filter(|file| !file.ends_with(".csv")).count(), 0);
    // What is kept exactly has no chart of its drift.
    let ran = program.run("run motor.json --until 1 --out e").exits(0);
    assert!(ran.stdout.contains("motor: 0 rad and 0 rad/s at most"), "{}", ran.stdout);
    assert!(!program.files().iter().any(|file| file.starts_with("e/") && file.contains("constraint_drift")));
    // Nor what does not move; what moves without turning is drawn by its positions.
    program
        .run("run hanging.json --until 1 --out h -v")
        .exits(0)
        .says(&["no chart of angles: nothing moves"]);
    assert!(!program.files().iter().any(|file| file.starts_with("h/") && file.contains("angles")));
    for scene in ["kepler", "cart_pole"] {
        program.run(&format!("run {scene}.json --until 1 --chart-format svg --out p -q")).exits(0);
    }
    let chart = |scene: &str, name: &str| {
        let all = program.files();
        let is_it = |file: &&String| file.starts_with(&format!("p/{scene}/")) && file.ends_with(name);
        std::fs::read_to_string(program.path(all.iter().find(is_it).expect("a chart"))).expect("text")
    };
    for words in ["Positions of the bars", "position [m]", "planet.x", "at a constant angle: sun, planet"] {
        assert!(chart("kepler", "angles.svg").contains(words), "{words}");
    }
    let drift = chart("cart_pole", "constraint_drift.svg");
    assert!(drift.contains("kept exactly: slider.angle") && !drift.contains("[rad]"), "no empty panels");
    for (flags, words) in [
        ("--chart bar1.q", vec!["no column `bar1.q`", "did you mean `bar1."]),
        ("--chart-format bmp", vec!["bmp", "svg"]),
        ("--window 2..1", vec!["FROM..TO"]),
        ("--window 600..700", vec!["0 rows", "the run ends at 500 s"]),
        ("--window 1.001..1.002", vec!["rows of the trajectory", "--every 1e-5"]),
    ] {
        program.run(&format!("run motor.json {flags} --out f")).exits(2).says(&words);
    }
    assert!(!program.files().iter().any(|file| file.starts_with("f/")));
}

#[test]
fn parts_of_a_sweep_join_to_its_very_bytes() {
    const PLACE: &str = "free/sweep-start.bar1.phi-start.bar2.phi-taylor-1e-9";
    const SWEEP: &str = "sweep free.json --vary bar1.phi=-pi..pi:13 --vary bar2.phi=-pi..pi:11 --until 6 --output bar1.omega -q";
    let program = Program::with_scenes(&["free"]);
    program.run(&format!("{SWEEP} --out one")).exits(0);
    // More parts than fit evenly, on other numbers of threads, in any order.
    for (number, threads) in [(5, 1), (1, 2), (3, 3), (4, 1), (2, 2)] {
        program.run(&format!("{SWEEP} --out parts --threads {threads} --shard {number}/5")).exits(0);
    }
    let merged = program.run(&format!("merge parts/{PLACE} --json")).exits(0).object();
    assert_eq!((merged["points"].as_u64(), merged["done"].as_u64()), (Some(143), Some(143)));
    let bytes = |path: String| std::fs::read(program.path(&path)).expect(&path);
    let mut files = vec!["sweep.csv"];
    files.extend(cfg!(feature = "charts").then_some("map.png"));
    for file in files {
        assert!(bytes(format!("one/{PLACE}/{file}")) == bytes(format!("parts/{PLACE}/{file}")), "{file}");
    }
    let [mut one, mut parts] =
        ["one", "parts"].map(|out| record(&program, &format!("{out}/{PLACE}/sweep.json")));
    for record in [&mut one, &mut parts] {
        assert!(record["timings"]["wall_s"].is_number());
        record["timings"] = Value::Null;
    }
    assert_eq!(one.to_string(), parts.to_string());

    let shard = |number: u64| format!("parts/{PLACE}/shard-{number}-of-5");
    // Again only where it is wanted, into another folder, from parts named one by one.
    program.run(&format!("merge parts/{PLACE}")).exits(6).says(&["--force"]);
    let named: Vec<String> = (1..=5).map(shard).collect();
    program.run(&format!("merge {} --out again -q", named.join(" "))).exits(0).stays_silent();
    assert!(bytes("again/sweep.csv".into()) == bytes(format!("one/{PLACE}/sweep.csv")));
    program
        .run(&format!("merge {} {} {} --out few", named[0], named[3], named[2]))
        .exits(6)
        .says(&["parts 2, 5 of 5 missing", "--shard 2/5"]);
    program.run(&format!("merge {} --out few", named[0])).exits(6).says(&["parts 2, 3, 4, 5 of 5 missing"]);
    program.run("merge one --out few").exits(6).says(&["one holds no part of a sweep", "--shard"]);
    program.run("merge free.json --out few").exits(6).says(&["free.json is a file", "hint: "]);
    program.run("merge nowhere --out few").exits(6).says(&["nowhere is not there", "hint: "]);
    // All are found from the folder above that of the scene.
    program.run("merge parts --out above -q").exits(0);
    assert!(bytes("above/sweep.csv".into()) == bytes(format!("one/{PLACE}/sweep.csv")));
    // A part of another grid, of another number of parts, a copy, an altered table.
    program.run(&format!("{} --out other --shard 2/5", SWEEP.replace(":13", ":12"))).exits(0);
    let other = format!("other/{PLACE}/shard-2-of-5");
    program.run(&format!("merge {} {other} --out few", named[0])).exits(6).says(&["another sweep", "grid"]);
    program.run(&format!("{SWEEP} --out other --shard 2/4")).exits(0);
    let other = format!("other/{PLACE}/shard-2-of-4");
    program
        .run(&format!("merge {} {other} --out few", named[0]))
        .exits(6)
        .says(&["one of 4 parts instead of 5"]);
    program.run(&format!("{SWEEP} --out twin --shard 1/5")).exits(0);
    program
        .run(&format!("merge parts/{PLACE} twin/{PLACE} --out few"))
        .exits(6)
        .says(&["part 1/5 is there twice"]);
    let table = program.read(&format!("{}/sweep.csv", named[1]));
    program.write(&format!("{}/sweep.csv", named[1]), &table.replacen('7', "8", 1));
    program.run(&format!("merge parts/{PLACE} --out few")).exits(6).says(&["shard-2-of-5", "has changed"]);
    program.run(&format!("{SWEEP} --shard 6/5")).exits(2).says(&["I/N", "3/8"]);
    assert!(!program.path("few/sweep.csv").exists(), "nothing half is left");
}

#[test]
fn rows_of_points_that_cannot_be_run_have_their_words_in_the_right_columns() {
    let program = Program::with_scenes(&["free"]);
    for more in ["", " --trust auto", " --output bar1.omega"] {
        program
            .run(&format!("sweep free.json --vary bar1.length=-1..1:3 --until 1 --out o --force -q{more}"))
            .exits(0);
        let files = program.files();
        let file = files.iter().find(|file| file.ends_with("sweep.csv")).expect("a table");
        let mut table = csv::Reader::from_path(program.path(file)).expect("a table");
        let heads = table.headers().expect("a header").clone();
        let column = |name: &str| heads.iter().position(|head| head == name).expect(name);
        let (status, cause, bar) = (column("status"), column("cause"), column("flip_bar"));
        let rows: Vec<csv::StringRecord> = table.records().collect::<Result<_, _>>().expect("rows as wide");
        assert_eq!([&rows[0][status], &rows[1][status], &rows[2][status]], ["refused", "refused", "done"]);
        assert!(
            rows[0][cause].contains("bars[0].length") && rows[0][bar].is_empty() && rows[2][cause].is_empty()
        );
    }
}

#[test]
fn a_fit_leaves_a_record_and_charts_and_tells_what_is_wrong_with_its_data() {
    let program = Program::with_scenes(&["free"]);
    program.run("run free.json --until 1 --every 0.05 --no-charts --out runs").exits(0);
    let table = program.files().into_iter().find(|file| file.ends_with("trajectory.csv")).expect("a table");
    let rows = program.read(&table);
    let line = |row: &str| {
        let cells: Vec<&str> = row.split(',').collect();
        let number = |cell: &str| cell.parse::<f64>().ok();
        let (t, phi) = (number(cells[0])?, number(cells[1])?);
        Some(format!("{},{}\n", t * 1e3, phi.to_degrees()))
    };
    let measured: String = rows.lines().filter_map(line).collect();
    program.write("measured.csv", &format!("t [ms],bar1.phi [deg]\n{measured}"));
    let fit = "fit free.json --vary gravity[0] --set gravity[0]=9 --out fits --force --data";
    let found = program.run(&format!("{fit} measured.csv --json")).exits(0).object();
    let value = found["numbers"][0]["value"].as_f64().expect("a number");
    assert!((value - 9.81).abs() < 1e-6, "{found}");
    let files = program.files();
    for name in ["fit.json", "fit.csv", "fit.png", "residuals.png"] {
        assert!(files.iter().any(|file| file.ends_with(name)), "{name} {files:?}");
    }
    program.write("other.csv", "t [s],bar1.phi [m]\n0,1\n0.1,1\n");
    let words = ["other.csv: line 1, column bar1.phi", "`m` does not measure", "hint"];
    program.run(&format!("{fit} other.csv")).exits(3).says(&words);
    program.run(&format!("{fit} none.csv")).exits(6).says(&["none.csv", "cannot be read", "hint"]);
    assert_eq!(program.files().len(), files.len() + 1);
}

#[test]
fn modes_leave_a_record_and_charts() {
    let program = Program::with_scenes(&["free", "motor"]);
    let object = program.run("modes free.json --json --gif").exits(0).object();
    assert_eq!(object["degrees_of_freedom"], 2);
    let equilibria = object["equilibria"].as_array().expect("a list");
    assert_eq!(equilibria.len(), 4);
    assert_eq!(equilibria[0]["stability"], "stable");
    assert_eq!(equilibria[0]["modes"].as_array().map(Vec::len), Some(2));
    for name in ["modes.json", "mode1.png", "mode2.png", "mode1.gif", "mode2.gif"] {
        assert!(program.files().contains(&format!("output/free/modes/{name}")), "{name}");
    }
    program.run("modes free.json").exits(6).says(&["--force"]);
    program.run("modes free.json --force --no-charts").exits(0).shows(&["equilibrium", "period", "unstable"]);
    let driven = program.run("modes motor.json --starts 0 --json --gif").exits(0).object();
    assert_eq!(driven["period"], 1.0);
    assert_eq!(driven["periodic_motions"][0]["multipliers"].as_array().map(Vec::len), Some(2));
    for name in ["modes.json", "motion.png", "motion.gif", "multipliers.png"] {
        assert!(program.files().contains(&format!("output/motor/modes/{name}")), "{name}");
    }
    program.run("modes motor.json --period 0.7 --force").exits(3).says(&["no period", "motor", "hint: "]);
    program.run("modes motor.json --period -1").exits(2).says(&["above 0"]);
}

/// Every study keeps the results of an earlier one, unless it is told to overwrite them.
#[test]
fn no_study_overwrites_results_unasked() {
    let program = Program::with_scenes(&["free", "crank_rocker"]);
    program.write("d.csv", "t [s],bar1.phi [rad]\n0.1,1.5\n0.2,1.3\n0.3,0.9\n0.4,0.4\n");
    for (command, record) in [
        ("modes free.json --starts 0", "free/modes/modes.json"),
        ("kinematics crank_rocker.json --positions 4", "crank_rocker/kinematics-motor/kinematics.json"),
        ("sensitivity free.json --of bar2.phi --to gravity[0] --at 0.5", "free/sensitivity/sensitivity.json"),
        ("sensitivity free.json --lyapunov --at 0.5", "free/lyapunov/lyapunov.json"),
        ("fit free.json --data d.csv --vary bars.bar1.length", "free/fit/fit.json"),
        ("stress free.json --methods dp8", "stress/stress.json"),
        (
            "sweep free.json --vary bar1.phi=1..2:2 --until 0.1",
            "free/sweep-start.bar1.phi-taylor-1e-9/sweep.json",
        ),
    ] {
        program.run(&format!("{command} --no-charts -q")).exits(0);
        let before = program.read(&format!("output/{record}"));
        let changed = command.replace("--at 0.5", "--at 0.6").replace("--until 0.1", "--until 0.2");
        program
            .run(&format!("{changed} --no-charts -q"))
            .exits(6)
            .says(&["holds results already", "--force"]);
        assert_eq!(program.read(&format!("output/{record}")), before, "{command}");
        program.run(&format!("{changed} --no-charts -q --force")).exits(0);
    }
    program.run("kinematics crank_rocker.json --rate 0").exits(2).says(&["--rate", "other than 0"]);
}

/// Estimates in notes have no exponent where they are of everyday size, and no zeros that say nothing.
#[test]
fn numbers_in_messages_are_of_everyday_form() {
    let program = Program::with_scenes(&["kepler", "kite"]);
    let noted = program.run("check kepler.json --until 30").exits(0);
    let words = noted.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
    let growth = "grows at 1.7 /s at the start, about 20 steps";
    // It is no spring's, whose energy could be told.
    assert!(words.contains(growth) && !words.contains("energy in it"), "{words}");
    assert!(!words.contains("e0 ") && !words.contains("e1 "), "{words}");
    let short = program.run("check kepler.json --until 1e-6 --every 1e-8").exits(0);
    assert!(short.stdout.contains("1e-6 s, a row every 1e-8 s"), "{}", short.stdout);
    program.run("check kepler.json --rtol 0").exits(2).says(&["0 is not within 1e-19 to 0.1"]);
    program.run("check kepler.json --step 0").exits(2).says(&["0 is not a number of seconds"]);
    let limited = program.run("check kepler.json --until 30 --max-evaluations 5").exits(0);
    let words = limited.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("30 s take taylor about ") && words.contains("and 5 evaluations are"), "{words}");
    assert!(!words.contains("up to"), "{words}");
    let damped = "run kite.json --method dp8 --stabilize baumgarte --until 0.1 --no-charts --json";
    let notes = program.run(damped).exits(0).object()["notes"].to_string();
    let constant = notes.split("time constant is ").nth(1).and_then(|rest| rest.split(' ').next());
    let constant = constant.unwrap_or_else(|| panic!("{notes}"));
    assert!(constant.parse().is_ok_and(|number: f64| number > 0.0), "{notes}");
    assert!(!constant.contains("e-3") && !constant.contains("0e"), "{notes}");
}

/// A sweep whose points end by an event tells when they do.
#[cfg(feature = "charts")]
#[test]
fn a_sweep_tells_when_its_points_end() {
    let program = Program::with_scenes(&["free"]);
    let mut scene = record(&program, "free.json");
    let sweep = "sweep free.json --vary bar1.phi=0.1..1:5 --until 10 --map bar2.phi --html";
    for (when, told, drawn, caption) in [
        ("t - 1", "by t = 1 s", "bar2.phi at 1 s", "5 points, 1 s each"),
        ("t - 1 - b", "by the end of each run", "bar2.phi at the end of each run", "up to 10 s each"),
        ("t - 11", "by t = 10 s", "bar2.phi at 10 s", "5 points, 10 s each"),
    ] {
        scene["parameters"] = serde_json::json!({"b": 0.5});
        scene["events"] = serde_json::json!([{"name": "end", "when": when, "action": "stop"}]);
        program.write("free.json", &scene.to_string());
        let varied = if when.contains('b') { sweep.replace("bar1.phi=0.1", "b=0") } else { sweep.to_owned() };
        let ran = program.run(&format!("{varied} --chart-format svg --force --out swept")).exits(0);
        let words = ran.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains(told), "{words}");
        let files = program.files();
        let chart = files.iter().rev().find(|file| file.ends_with("profile.svg")).expect("a chart");
        let chart = program.read(chart);
        assert!(chart.contains(drawn) && chart.contains(caption), "{when}: {chart}");
        std::fs::remove_dir_all(program.path("swept")).expect("a folder");
    }
}

#[test]
fn an_uncertain_number_has_one_standard_deviation() {
    let program = Program::with_scenes(&["spring"]);
    let twice = "--uncertainty spring.stiffness=0.1 --uncertainty springs.spring.stiffness=0.2";
    let told = "--uncertainty names springs.spring.stiffness twice";
    program.run(&format!("sensitivity spring.json --of bar2.phi --at 0.1 {twice}")).exits(2).says(&[told]);
}

/// Too many rows are the fault of whoever asks for them: the scene or an option.
#[test]
fn too_many_rows_are_refused_where_they_are_asked_for() {
    let program = Program::with_scenes(&["free"]);
    let mut scene = record(&program, "free.json");
    scene["every"] = serde_json::json!(1e-9);
    program.write("fine.json", &scene.to_string());
    program.run("run fine.json --until 3").exits(3).says(&[
        "every: an output interval of 1e-9 s up to 3 s",
        "a longer every in the scene",
        "3e9 rows",
        "at most 1e9",
    ]);
    program.run("run free.json --until 3 --every 1e-9").exits(2).says(&["--every: 3e9 rows", "at most 1e9"]);
}

/// Lists of names are whole, or say how many more there are.
#[test]
fn lists_of_names_are_whole_or_say_how_many_are_left_out() {
    let program = Program::with_scenes(&["andrews", "free"]);
    program.run("check free.json --output 5*joule").exits(2).says(&["known are t, bar1.phi", "B.fy\n"]);
    program
        .run("sensitivity andrews.json --to gravity[0] --of kinetic")
        .exits(2)
        .says(&["AG.cos and 91 more"]);
    let mut scene = record(&program, "free.json");
    scene["torques"] = serde_json::json!([{"name": "d", "body": "bar1", "torque": "5 joule"}]);
    program.write("unit.json", &scene.to_string());
    program.run("check unit.json").exits(3).says(&["joule is no unit", "kN, J, kJ, W, kW, lbf; write"]);
}

/// Where growth is told neither as an exponent nor as a power, the reason is.
#[test]
fn growth_is_told_or_why_it_is_not() {
    let program = Program::with_scenes(&["iftomm_pendulum", "bang_bang", "free"]);
    for scene in ["iftomm_pendulum", "bang_bang", "free"] {
        let ran = program.run(&format!("run {scene}.json --no-charts --json --out {scene}")).exits(0);
        let trust = ran.object()["trust"].clone();
        let told = ["lyapunov", "growth_power", "growth_why"].map(|key| !trust[key].is_null());
        assert!(told.into_iter().any(|told| told), "{scene}: {trust:#}");
        assert!(!(told[2] && (told[0] || told[1])), "{scene}: {trust:#}");
    }
    program.run("run free.json --until 0.01 --no-charts --out short").exits(0).shows(&["too short to tell"]);
}

/// The times of the extremes of an output that does not change are those of rounding.
#[test]
fn outputs_that_do_not_change_are_said_to_be_constant() {
    let program = Program::with_scenes(&["free"]);
    let ran = program
        .run("run free.json --until 1 --no-charts --output three=3 --output moves=bar1.phi --out run")
        .exits(0);
    let row = |name: &str| {
        let row = ran.stdout.lines().find(|line| line.contains(name)).unwrap_or_else(|| panic!("{ran:#?}"));
        row.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(row("three")[2..6], ["3", "constant", "3", "constant"], "{ran:#?}");
    assert!(!row("moves").contains(&"constant".to_owned()), "{ran:#?}");
}

/// What cannot be is told in words of our own, with the place at fault.
#[test]
fn small_faults_are_told_with_their_place() {
    let program = Program::with_scenes(&["free", "motor"]);
    program.run("run free.json --show-digits 5").exits(2).says(&["--digits <D>", "--trusted-until <S>"]);
    for (command, allowed) in [
        ("modes free.json --starts -1", "from 0 to 1000000"),
        ("kinematics motor.json --positions -3", "from 1 to 10000000"),
        ("sweep free.json --vary bar1.phi=0..1:3 --threads -1", "from 1 to 1024"),
        ("stress free.json --max-evaluations -1", "from 1 to 1e18"),
        ("fit free.json --data x.csv --vary gravity[1] --segments -2", "from 1 to 10000"),
        ("run free.json --digits 30 --show-digits -1", "from 1 to 2000"),
    ] {
        let refused = program.run(command).exits(2).says(&["a whole number", allowed]);
        assert!(!refused.stderr.contains("tip:"), "{refused:#?}");
    }
    #[cfg(feature = "charts")]
    {
        let refused = program.run("check free.json --chart nowhere/c.png").exits(6);
        let refused = refused.says(&["cannot write nowhere/c.png", "no folder nowhere", "hint: "]);
        assert!(!refused.stderr.contains(".chart-"), "{refused:#?}");
    }
    let mut scene = record(&program, "free.json");
    scene.as_object_mut().expect("a scene").remove("hinges");
    program.write("loose.json", &scene.to_string());
    program.run("check loose.json").exits(3).says(&["origin", "or the hinge, weld or slider"]);
    program.write("ragged.csv", "t [s],bar1.phi [rad]\n0.1,0.2\n0.2\n");
    let ragged = program.run("fit free.json --data ragged.csv --vary gravity[1]");
    let ragged = ragged.says(&["line 3 has 1 cell, and the header has 2"]);
    assert!(!ragged.stderr.contains("record"), "{ragged:#?}");
}

/// Positions in which loops cannot be closed are counted.
#[test]
fn modes_say_what_became_of_the_positions_asked_for() {
    let program = Program::with_scenes(&["andrews"]);
    let found =
        program.run("modes andrews.json --starts 20 --no-charts --json --out modes").exits(0).object();
    let of = |key: &str| found["starts"][key].as_u64().unwrap_or_else(|| panic!("{found:#}"));
    assert_eq!(of("asked"), 20);
    assert!(of("unassembled") > 0 && of("unassembled") + of("repeated") <= 20, "{found:#}");
    let page = program.run("modes andrews.json --starts 20 --no-charts --out page").exits(0);
    page.shows(&["of 20 other positions asked for", "could not be assembled"]);
}
