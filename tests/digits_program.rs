//! `run --digits` and `run --trusted-until`.

use crate::program::Program;

#[test]
fn a_run_in_many_digits_writes_them_all_or_as_many_as_asked_for() {
    let program = Program::with_scenes(&["free"]);
    let object = program.run("run free.json --digits 40 --until 0.5 --every 0.25 --json").exits(0).object();
    let phi = object["final"]["bodies"]["bar1"]["phi"].as_str().expect("a text").to_owned();
    assert!(phi.len() >= 40 && phi.starts_with("0.2096"), "{phi}");
    assert_eq!(object["settings"]["digits"], 40);
    let folder = "output/free/taylor-digits-40";
    let table = program.read(&format!("{folder}/trajectory.csv"));
    assert_eq!(table.lines().count(), 4, "{table}");
    assert!(table.lines().nth(1).expect("a row").contains(",1.5707963267948966,0.0,"), "{table}");
    program.run("run free.json --digits 40 --until 0.5 --every 0.25").exits(6).says(&["--force"]);
    program.run("run free.json --digits 40 --until 0.5 --every 0.25 --force --show-digits 7").exits(0);
    let short = program.read(&format!("{folder}/trajectory.csv"));
    let number = short.lines().last().expect("a row").split(',').nth(1).expect("a cell").to_owned();
    assert!(number.len() <= 9 && phi.starts_with(&number[..7]), "{number}");
    assert!(program.read(&format!("{folder}/run.json")).contains("trajectory_sha256"));
}

/// Numbers are read as in scenes, to all digits.
#[test]
fn half_of_pi_is_half_of_pi() {
    let program = Program::with_scenes(&["free"]);
    let run = "run free.json --digits 40 --until 0.5 --every 0.5 --json --set bar1.phi=";
    let phi = |half: &str, out: &str| {
        let object = program.run(&format!("{run}{half} --out {out}")).exits(0).object();
        object["final"]["bodies"]["bar1"]["phi"].clone()
    };
    let expected = phi("pi/2", "one");
    assert!(expected.is_string() && phi("1/2*pi", "two") == expected && phi("0.5pi", "three") == expected);
}

#[test]
fn a_horizon_is_proved_or_the_exit_code_says_so() {
    let program = Program::with_scenes(&["free"]);
    let ran = program.run("run free.json --trusted-until 1 --within 1e-6 --every 0.5").exits(0);
    let ran = ran.says(&["errors grow by", "digits at order"]).shows(&["trusted until", "both runs agree"]);
    assert!(ran.stdout.contains("bar2.phi"));
    let table = program.read("output/free/taylor-trusted/trajectory.csv");
    for line in table.lines().skip(1) {
        let agreement: f64 = line.split(',').next_back().and_then(|cell| cell.parse().ok()).expect("digits");
        assert!(agreement > 6.0, "{line}");
    }
    let other = program.run("run free.json --trusted-until 1 --digits 30").exits(2);
    assert!(other.stderr.contains("cannot be used with"));
}

/// For a tenth of a second in 200 a flywheel stands on a steep hill, so that errors grow by more than 60
/// digits between two looks at them: runs begin again, whatever they leave of their tables.
#[test]
fn a_proof_that_begins_again_is_written_as_any_other() {
    let program = Program::with_scenes(&[]);
    for (steepness, checkpoints, least) in [(963_333, "", 2), (653_333, " --checkpoint-every 0", 1)] {
        program.write(
            "hill.json",
            &format!(
                r#"{{"name": "hill", "gravity": [0, 0], "bars": [{{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1}}],
                "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
                "parameters": {{"steepness": "0 N*m"}},
                "torques": [{{"name": "hill", "body": "b", "torque": "steepness*sin(3*b.phi - 1)"}}],
                "events": [{{"name": "on", "when": "t - 195", "set": {{"steepness": "{steepness} N*m"}}}},
                    {{"name": "off", "when": "t - 195.1", "set": {{"steepness": "0 N*m"}}}}],
                "start": {{"b": {{"phi": "1/3", "omega": 0}}}}, "until": 200, "every": 5}}"#
            ),
        );
        let ran = program.run(&format!("run hill.json --trusted-until 200 --force{checkpoints}")).exits(0);
        assert!(ran.stderr.matches("begun again").count() >= least, "{}", ran.stderr);
        let folder = "output/hill/taylor-trusted";
        let table = program.read(&format!("{folder}/trajectory.csv"));
        assert_eq!(table.lines().count(), 42, "{table}");
        let hash = driftless::run::files::sha256(&table);
        assert!(program.read(&format!("{folder}/run.json")).contains(&hash));
        assert!(
            program.files().iter().all(|file| !file.contains("unfinished") && !file.contains("checkpoint"))
        );
    }
}

#[test]
fn what_makes_no_sense_is_refused_and_leaves_no_files() {
    let program = Program::with_scenes(&["free"]);
    program.write(
        "rigid.json",
        r#"{"name": "rigid", "gravity": [0, -9.81], "bars": [{"name": "bob", "mass": 1, "centre": [0, 0], "inertia": 0.1}],
        "springs": [{"name": "rope", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bob", "point": [0, 0]}],
            "stiffness": 1e7, "free_length": 1, "model": "rigid"}],
        "start": {"bob": {"phi": 0, "omega": 0, "origin": [1, 0], "velocity": [0, 0]}}, "until": 1, "every": 1}"#,
    );
    for (arguments, code, word) in [
        ("free.json --digits 19", 2, "20 to 2000"),
        ("free.json --digits 2001", 2, "20 to 2000"),
        ("free.json --digits 30 --method dp8", 2, "--method"),
        ("free.json --digits 30 --rtol 1e-9", 2, "--rtol"),
        ("free.json --digits 30 --until -1", 2, "-1 s is no time"),
        ("free.json --digits 30 --every 0", 2, "0 s is no time"),
        ("free.json --trusted-until 0", 2, "is no time"),
        ("free.json --trusted-until 1 --within 0", 2, "above 0"),
        ("free.json --within 1e-3", 2, "--trusted-until"),
        ("rigid.json --digits 30", 3, "a rigid spring"),
    ] {
        program.run(&format!("run {arguments}")).exits(code).says(&[word]);
    }
    assert!(program.files().iter().all(|file| !file.contains("trajectory") && !file.contains("unfinished")));
}

/// What dry friction takes is a column of the table, and stands in the record with the transitions.
#[test]
fn dry_friction_is_written_in_many_digits() {
    let program = Program::with_scenes(&["stick_slip"]);
    let ran = program.run("run stick_slip.json --trusted-until 3 --every 1 --json").exits(0);
    let object = ran.object();
    let friction = &object["friction"];
    assert_eq!(friction["transitions"], friction["first"].as_array().expect("a list").len());
    assert_eq!(
        (&friction["first"][0]["t"], &friction["first"][0]["mode"]),
        (&"0.0".into(), &"sticks".into())
    );
    // The shaft turns until 0.7 · 1.962 N m are 3 N m/rad.
    assert_eq!(
        (&friction["first"][1]["t"], &friction["first"][1]["mode"]),
        (&"0.9156".into(), &"slides".into())
    );
    assert!(friction["first"][1]["agreement_digits"].as_f64().expect("a number") > 3.0);
    let table = program.read("output/stick_slip/taylor-trusted/trajectory.csv");
    let column = |line: &str| line.split(',').rev().nth(1).expect("a cell").to_owned();
    let cells: Vec<String> = table.lines().map(column).collect();
    assert_eq!(cells[0], "friction [J]");
    assert_eq!(cells.last().map(String::as_str), friction["energy_lost_j"].as_str());
}

/// Events have a table of their own, with the digits to which both runs agree.
#[test]
fn events_are_written_with_their_agreement() {
    let program = Program::with_scenes(&["free"]);
    let text = program.read("free.json").trim_end().strip_suffix('}').expect("an object").to_owned()
        + r#", "events": [{"name": "level", "when": "bar1.sin"}, {"name": "enough", "when": "t - 1.25", "action": "stop"}]}"#;
    program.write("events.json", &text);
    let ran = program.run("run events.json --trusted-until 2 --every 0.5 --json").exits(0);
    let object = ran.object();
    assert_eq!(object["events"]["ended_by"], "enough");
    assert_eq!(object["final"]["t"], 1.25);
    let count = object["events"]["count"].as_u64().expect("a number") as usize;
    let table = program.read("output/free/taylor-trusted/events.csv");
    assert_eq!(table.lines().count(), count + 1, "{table}");
    assert!(table.starts_with("event,t [s],bar1.phi [rad],"), "{table}");
    for line in table.lines().skip(1) {
        let agreement: f64 = line.split(',').next_back().and_then(|cell| cell.parse().ok()).expect("digits");
        assert!(agreement > 3.0, "{line}");
    }
    program.run("run events.json --digits 30 --until 1 --every 0.5").exits(0).shows(&["level: at t = "]);
}

/// A ball that falls on a floor without restitution stays there: when is in the report, with the agreement of both
/// runs.
#[test]
fn a_point_that_stays_on_its_wall_is_reported() {
    let program = Program::with_scenes(&[]);
    let text = r#"{"name": "ball", "gravity": [0, -10], "bars": [{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 1}],
        "walls": [{"name": "floor", "body": "ball", "point": [0, 0], "restitution": 0, "line": {"through": [0, 0], "normal": [0, 1]}}],
        "start": {"ball": {"phi": 0, "omega": 0, "origin": [0, 1], "velocity": [0, 0]}}, "until": 1, "every": 0.1}"#;
    program.write("ball.json", text);
    program.run("run ball.json --digits 30").exits(0).shows(&["1 impact, 1 stay on"]);
    let object = program.run("run ball.json --trusted-until 1 --json").exits(0).object();
    let hold = &object["holds"]["first"][0];
    assert_eq!((&hold["wall"], &hold["until"]), (&"floor".into(), &serde_json::Value::Null));
    assert!(hold["t"].as_str().is_some_and(|t| t.starts_with("0.44721359549995793")), "{hold}");
    assert!(hold["agreement_digits"].as_f64().is_some_and(|digits| digits > 19.0), "{hold}");
}

/// What is found out on the way stops the run there: the scene itself is not refused.
#[test]
fn a_point_that_is_squeezed_by_a_motor_stops_the_run() {
    let program = Program::with_scenes(&[]);
    let text = r#"{"name": "arm", "gravity": [0, -10], "bars": [{"name": "arm", "mass": 2, "centre": [0.5, 0], "inertia": 1, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "arm", "point": [0, 0]}]}],
        "motors": [{"name": "drive", "body": "arm", "law": {"start": 0.5, "rate": -1}}],
        "walls": [{"name": "floor", "body": "arm", "point": [1, 0], "restitution": 0, "line": {"through": [0, 0], "normal": [0, 1]}}],
        "start": {}, "until": 1, "every": 0.1}"#;
    program.write("arm.json", text);
    let ran = program.run("run arm.json --digits 30").exits(4).says(&["t = 0.5", "no way back"]);
    assert!(!ran.stderr.contains("resume"), "{}", ran.stderr);
    ran.shows(&["stopped", "t = 0.5 s"]);
    // Everything is kept, as by a run in doubles, and there is nothing that would stop again.
    let folder = "output/arm/taylor-digits-30";
    let table = program.read(&format!("{folder}/trajectory.csv"));
    assert_eq!(table.lines().count(), 7, "{table}");
    assert!(table.lines().last().is_some_and(|line| line.starts_with("0.5,")), "{table}");
    let record: serde_json::Value =
        serde_json::from_str(&program.read(&format!("{folder}/run.json"))).expect("an object");
    let found = record["result"]["stop"].clone();
    let plain = program.run("run arm.json --method taylor --trust off --no-charts --json").exits(4);
    let mut plain = plain.object()["stop"].clone();
    assert!(plain["t"].as_f64().is_some_and(|t| (t - 0.5).abs() < 1e-12), "{plain}");
    plain["t"] = serde_json::json!(0.5);
    assert_eq!(found, plain);
    let files = program.files();
    let left: Vec<_> = files.iter().filter(|file| file.starts_with(folder)).collect();
    assert_eq!(left, [&format!("{folder}/run.json"), &format!("{folder}/trajectory.csv")]);
    program.run("resume output").exits(6).says(&["no interrupted run"]);
    let object = program.run("run arm.json --digits 30 --force --json").exits(4).object();
    assert_eq!((&object["stop"], &object["error"]["details"]), (&found, &found));
    // Between two rows the last state has a row of its own.
    program.run("run arm.json --digits 30 --every 0.2 --out other").exits(4);
    let table = program.read("other/arm/taylor-digits-30/trajectory.csv");
    let times: Vec<&str> = table.lines().skip(1).filter_map(|line| line.split(',').next()).collect();
    assert_eq!(times, ["0.0", "0.2", "0.4", "0.5"]);
}

/// What stops while the growth of errors is measured has not begun.
#[test]
fn a_forecast_that_stops_says_why_and_leaves_no_files() {
    let program = Program::with_scenes(&[]);
    // A wall is switched on that the ball has fallen through by a metre.
    let text = r#"{"name": "ball", "gravity": [0, -10], "bars": [{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 1}],
        "walls": [{"name": "floor", "body": "ball", "point": [0, 0], "restitution": 0, "line": {"through": [0, 0], "normal": [0, 1]}}],
        "inactive": ["floor"], "events": [{"name": "late", "when": "t - 0.5", "on": ["floor"]}],
        "start": {"ball": {"phi": 0, "omega": 0, "origin": [0, 0.25], "velocity": [0, 0]}}, "until": 1, "every": 0.3}"#;
    program.write("ball.json", text);
    program
        .run("run ball.json --trusted-until 1")
        .exits(4)
        .says(&["t = 0.5", "behind which its point is by 1"]);
    assert_eq!(program.files(), ["ball.json"]);
    // One run alone has rows up to there: two at their times, and that of the last state.
    let object = program.run("run ball.json --digits 30 --json").exits(4).object();
    assert_eq!((&object["stop"]["t"], &object["final"]["t"]), (&0.5.into(), &0.5.into()));
    assert_eq!((&object["rows"], &object["stop"]["cause"]), (&3.into(), &"unsuited".into()));
}

/// Drift limits are those of all runs, with the same words.
#[test]
fn drift_limits_hold_in_many_digits() {
    let program = Program::with_scenes(&["free", "four_bars"]);
    for (run, words) in [
        ("free.json --max-energy-drift 1e-60", ["energy is off by", "of the scale, the limit is 1e-60"]),
        ("four_bars.json --max-constraint-drift 1e-200", ["is violated by", "level, the limit is 1e-200"]),
    ] {
        let run = format!("run {run} --digits 25 --until 0.5 --every 0.25");
        let ran = program.run(&format!("{run} --json")).exits(5).says(&words);
        let object = ran.says(&["or state another limit with --max-energy-drift"]).object();
        assert_eq!(
            (&object["stop"]["cause"], &object["error"]["exit_code"]),
            (&"drift_limit".into(), &5.into())
        );
        program.run("resume output").exits(6);
        let (run, _) = run.split_once(" --max").expect("a limit");
        program.run(&format!("{run} --digits 25 --until 0.5 --every 0.25 --force")).exits(0);
    }
}

/// A body passes over a hill so narrow that its steps do not see it: on its top the energy is off by that of the hill,
/// and no such run is a success unless that is allowed.
#[test]
fn a_broken_balance_is_no_success_in_many_digits() {
    let program = Program::with_scenes(&[]);
    let text = r#"{"name": "hill", "gravity": [0, 0], "bars": [{"name": "rotor", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "rotor", "point": [0, 0]}]}],
        "potentials": [{"name": "hill", "energy": "1/(1 + ((rotor.phi - 5)/0.01)^40)"}],
        "start": {"rotor": {"phi": 0, "omega": 1}}, "until": 10, "every": 5}"#;
    program.write("hill.json", text);
    program.run("run hill.json --digits 30").exits(5).says(&["energy is off by", "the limit is 1e-2"]);
    program.run("run hill.json --digits 30 --max-energy-drift 10 --force").exits(0);
}
