//! What people are told where something goes wrong or is out of the ordinary.
#![cfg(feature = "cli")]

use crate::program;

use program::Program;
use serde_json::{Value, json};

/// A shipped scene with other parts, in a folder of its own.
fn changed(name: &str, change: impl FnOnce(&mut Value)) -> Program {
    let program = Program::with_scenes(&[name]);
    let mut scene: Value = serde_json::from_str(&program.read(&format!("{name}.json"))).expect("JSON");
    change(&mut scene);
    program.write("scene.json", &scene.to_string());
    program
}

/// The double pendulum with a torque by a formula.
fn with_torque(torque: &str) -> Program {
    changed("free", |scene| {
        scene["torques"] = json!([{"name": "T", "body": "bar1", "torque": torque}]);
    })
}

/// The double pendulum with a motor by a formula.
fn with_motor(law: &str) -> Program {
    changed("free", |scene| {
        scene["motors"] = json!([{"name": "M", "body": "bar1", "law": law}]);
        scene["start"] = json!({"bar1": {"phi": 0, "omega": 0}, "bar2": {"phi": 0, "omega": 0}});
    })
}

#[test]
fn a_formula_that_breaks_down_is_named() {
    for torque in ["0.1*sqrt(bar1.phi-1.5707)", "0.01/(t-2)"] {
        for method in ["taylor", "dp8", "radau9", "dop853"] {
            let program = with_torque(torque);
            let stopped = program.run(&format!("run scene.json -q --no-charts --method {method}")).exits(4);
            assert!(stopped.stderr.contains("the formula of `T` has no finite value here"), "{stopped:#?}");
            assert!(!stopped.stderr.contains("length zero"), "{stopped:#?}");
        }
    }
}

#[test]
fn times_in_messages_are_rounded() {
    let stopped = with_torque("0.01/(t-2)").run("run scene.json --no-charts -q").exits(4);
    assert!(stopped.stderr.contains("stopped at t = 2 s (step "), "{stopped:#?}");
}

#[test]
fn a_law_that_jumps_is_no_event() {
    let stopped = with_motor("if(t<1,0,1)").run("run scene.json --no-charts -q").exits(4);
    let stopped =
        stopped.says(&["a formula of `M` changes its branch here", "violated by 1 rad and 0 rad/s"]);
    assert!(!stopped.stderr.contains("event `M`"), "{stopped:#?}");
}

#[test]
fn a_motor_is_not_driven_by_its_own_angle() {
    for law in ["bar1.phi", "1*bar1.phi", "2*bar1.phi - bar1.phi"] {
        with_motor(law).run("check scene.json").exits(3).says(&["scene.json:1:", "the law of motor `M`"]);
    }
    // A gear drives by another body.
    with_motor("2*bar2.phi").run("check scene.json").exits(0);
}

#[test]
fn many_bodies_are_left_to_the_record() {
    let bars: Vec<Value> = (0..30)
        .map(|k| {
            json!({"name": format!("b{k}"), "length": 0.1, "width": 0.01, "thickness": 0.003, "density": 670})
        })
        .collect();
    let hinge = |k: usize| {
        let before = match k {
            0 => json!({"body": "ground", "point": [0, 0]}),
            k => json!({"body": format!("b{}", k - 1), "point": [0.1, 0]}),
        };
        let after = json!({"body": format!("b{k}"), "point": [0, 0]});
        json!({"name": format!("H{k}"), "between": [before, after]})
    };
    let program = changed("free", |scene| {
        scene["bars"] = json!(bars);
        scene["hinges"] = (0..30).map(hinge).collect();
        let start = (0..30).map(|k| (format!("b{k}"), json!({"phi": 0.1, "omega": 0})));
        scene["start"] = Value::Object(start.collect());
        scene["until"] = json!(0.02);
    });
    let shown = program.run("run scene.json --no-charts --trust off").exits(0);
    let shown = shown.shows(&["6 more bodies in run.json", "  b23 "]);
    assert!(!shown.stdout.contains("  b24 "), "{shown:#?}");
}

#[test]
fn settings_that_stop_for_one_cause_are_one_line() {
    let program = with_torque("0.01/(t-2)");
    let shown = program.run("compare scene.json --no-charts --until 3 --budget 4 --methods dp5,dp8");
    let shown = shown.exits(0).shows(&[" other setting"]);
    assert!(shown.stdout.matches("stopped (").count() <= 4, "{shown:#?}");
}

#[test]
fn what_refuses_a_scene_says_how_to_mend_it() {
    let with = |key: &str, value: Value| changed("free", |scene| scene[key] = value);
    let event = |event: Value| with("events", json!([event]));
    let refused = event(json!({"name": "E", "when": "bar1.phi", "set": {"k": 2}})).run("check scene.json");
    refused.exits(3).says(&["hint: the scene has none"]);
    let refused = with("parameters", json!({"k": "sqrt(-1)"})).run("check scene.json").exits(3);
    refused.says(&["parameters.k has no value", "roots and logarithms"]);
    let noted = event(json!({"name": "E", "when": "3"})).run("check scene.json").exits(0);
    noted.says(&["note: event `E` never happens"]);
    let program = Program::with_scenes(&["free"]);
    program.write("scene.json", &(program.read("free.json") + "\n{}"));
    program.run("check scene.json").exits(3).says(&["the scene ends before it"]);
    program.write("scene.json", "{\"name\": \"a\u{0}b\"}");
    program.run("check scene.json").exits(3).says(&["scene.json:1:", "\\u and four hexadecimal digits"]);
    let refused = program.run("sweep free.json --vary name=1..2:3");
    assert!(!refused.stderr.contains("it must be a name"), "{refused:#?}");
}

#[test]
fn help_is_a_command_too() {
    let program = Program::new();
    program.run("help").exits(0).shows(&["Usage: driftless", "sweep"]);
    program.run("help run").exits(0).shows(&["--max-energy-drift"]);
}

#[cfg(feature = "charts")]
#[test]
fn runs_of_several_scenes_are_told_apart() {
    let program = Program::with_scenes(&["free", "motor"]);
    for scene in ["free", "motor"] {
        program.run(&format!("run {scene}.json --no-charts -q --until 1 --method dp8 --rtol 1e-9")).exits(0);
    }
    program.run("view output/free output/motor --out page -q").exits(0);
    let page = program.read("page/runs.html");
    assert!(page.contains("<title>free/dp8-1e-9, motor/dp8-1e-9"), "{:.2000}", page);
    let view = program.run("view output/free --from 50 --to 60").exits(2);
    view.says(&["--from 50 --to 60", "the run goes from 0 to 1 s"]);
}

#[cfg(feature = "charts")]
#[test]
fn a_window_is_told_as_far_as_the_run_goes() {
    let program = Program::with_scenes(&["free"]);
    program.run("run free.json -q --until 3 --window 2..200 --chart-format svg --out o").exits(0);
    let files = program.files();
    let chart = files.iter().find(|file| file.ends_with("angles.svg")).expect("a chart");
    let chart = program.read(chart);
    assert!(chart.contains("2 s to 3 s of 3 s") && !chart.contains("200 s"));
}

#[test]
fn parameters_that_are_no_names_with_numbers_are_refused() {
    for value in [json!(5), json!("x"), json!(null), json!(true), json!([1, 2])] {
        let program = changed("free", |scene| scene["parameters"] = value.clone());
        let words = format!("parameters = {value}: must be {{name: number");
        program.run("check scene.json").exits(3).says(&["scene.json:1:", &words, "hint: for example"]);
    }
}

/// An event that moves its own time on by a nanosecond happens again a nanosecond later.
#[test]
fn an_event_that_brings_itself_about_is_named_as_the_cause() {
    let program = changed("free", |scene| {
        scene["parameters"] = json!({"k": 0.5});
        scene["events"] = json!([{"name": "again", "when": "t-k", "set": {"k": "k+1e-9"}}]);
    });
    let stopped = program.run("run scene.json --until 1 -q --no-charts --method dp5").exits(4);
    stopped.says(&["more than 10000 events, the last of them `again`", "hint: look for an event"]);
}

#[test]
fn lists_that_are_too_long_are_told_how_long_they_may_be() {
    let all: serde_json::Map<String, Value> = (0..1001).map(|k| (format!("p{k}"), json!("1"))).collect();
    for key in ["parameters", "signals", "outputs"] {
        let program = changed("free", |scene| scene[key] = json!(all));
        let words = format!("{key} has 1001 entries: must be at most 1000");
        program.run("check scene.json").exits(3).says(&[&words, "hint: "]);
    }
}

#[test]
fn a_lock_of_what_a_motor_drives_is_refused_with_a_hint() {
    let program = changed("motor", |scene| {
        let body = scene["motors"][0]["body"].clone();
        scene["locks"] = json!([{"name": "L", "body": body}]);
    });
    program.run("check scene.json").exits(3).says(&["`L` gives an angle", "hint: leave out one of"]);
}

#[test]
fn a_study_that_ends_early_has_its_error_in_its_object() {
    let program = Program::with_scenes(&["free"]);
    let command = "sensitivity free.json --of flip --to gravity[0] --at 0.1 --json --no-charts";
    let object = program.run(command).exits(4).object();
    assert_eq!((&object["error"]["kind"], &object["error"]["exit_code"]), (&json!("stopped"), &json!(4)));
    assert!(object["error"]["message"].as_str().is_some_and(|text| text.contains("flip")), "{object:#}");
    assert!(object["files"].is_array(), "what it printed before: {object:#}");
}
