//! What a run's record says, for people.

use crate::report::page::{counted, figure, magnitude, rough};
use crate::report::result::loss;
use crate::report::trust::how_near;
use crate::run::Sweep;
use crate::scene::Scene;
use serde_json::{Value, json};

/// Most marks on the axis of time.
const MARKS: usize = 2000;

/// Method and settings: `taylor, rtol 1e-9, elimination`.
pub(super) fn setting(record: &Value) -> String {
    let result = &record["result"];
    let settings = &result["settings"];
    let mut words = vec![text(&result["method"])];
    match (settings["step"].as_f64(), settings["rtol"].as_f64()) {
        (Some(step), _) => words.push(format!("step {} s", figure(step))),
        (None, Some(rtol)) => words.push(format!("tolerance {rtol:e}")),
        (None, None) => {}
    }
    let has_constraints = result["constraints"].as_object().is_some_and(|rows| !rows.is_empty());
    if let Some(how) = settings["stabilize"].as_str().filter(|_| has_constraints) {
        words.push(how.to_owned());
    }
    words.extend((settings["extended"] == json!(true)).then(|| "extended".to_owned()));
    words.join(", ")
}

/// The scene in a command line: the file, and what is changed and added, as typed; where that is not known, a
/// file of its name.
pub(super) fn given_scene(given: &Value, name: &str) -> String {
    let word = |text: &str| crate::run::files::quoted(text.as_ref());
    let file = given["scene"].as_str().filter(|file| *file != "-");
    let mut words = vec![file.map_or_else(|| word(&format!("{name}.json")), word)];
    for (key, option) in [("set", "--set"), ("output", "--output")] {
        let typed = given[key].as_array().into_iter().flatten().filter_map(Value::as_str);
        words.extend(typed.map(|typed| format!("{option} {}", word(typed))));
    }
    words.join(" ")
}

/// A command line that makes the run again.
pub(super) fn command(record: &Value, scene: &Scene) -> String {
    let settings = &record["result"]["settings"];
    let mut words = vec!["driftless run".to_owned(), given_scene(&record["given"], &scene.name)];
    words.push(format!("--method {}", text(&record["result"]["method"])));
    for (key, option) in
        [("step", "--step"), ("rtol", "--rtol"), ("atol", "--atol"), ("time_constant", "--time-constant")]
    {
        words.extend(settings[key].as_f64().map(|value| format!("{option} {}", shortest(value))));
    }
    words.extend(settings["stabilize"].as_str().map(|how| format!("--stabilize {how}")));
    words.extend((settings["extended"] == json!(true)).then(|| "--extended".to_owned()));
    words.push(format!("--until {} --every {}", shortest(scene.until), shortest(scene.every)));
    words.join(" ")
}

/// A command line that runs a point of a sweep; its values are to be added by `--set`.
pub(super) fn command_of_points(sweep: &Sweep, given: &Value) -> String {
    let (scene, plan) = (given_scene(given, &sweep.scene().name), sweep.plan());
    let mut words = vec![format!("driftless run {scene} --html --method {}", plan.method)];
    words.extend(plan.step.map(|step| format!("--step {}", shortest(step))));
    let tolerance = plan.tolerance.filter(|_| plan.step.is_none());
    words.extend(tolerance.map(|tolerance| format!("--rtol {}", shortest(tolerance.relative))));
    words.push(format!("--until {}", shortest(plan.until)));
    words.join(" ")
}

/// The shortest digits that read back.
fn shortest(value: f64) -> String {
    if value != 0.0 && !(1e-4..1e6).contains(&value.abs()) { format!("{value:e}") } else { value.to_string() }
}

/// Labelled entries; an empty label continues the entry above.
pub(super) fn summary(record: &Value) -> Vec<[String; 2]> {
    let result = &record["result"];
    let mut entries: Vec<[String; 2]> = Vec::new();
    let mut entry = |label: &str, text: String| entries.push([label.to_owned(), text]);
    let number = |value: &Value| value.as_f64();
    entry("method", setting(record));
    if let Some(why) = result["why"].as_str() {
        entry("", why.to_owned());
    }
    let count = |key: &str| result[key].as_u64().unwrap_or(0);
    // Runs integrated for a page are not timed.
    let wall = number(&record["timings"]["wall_s"]).filter(|&wall| wall > 0.0);
    let wall = wall.map_or(String::new(), |wall| format!(", {wall:.3} s"));
    entry(
        "cost",
        format!(
            "{}, {}, {} rejected{wall}",
            counted(count("steps"), "step", "steps"),
            counted(count("evaluations"), "evaluation", "evaluations"),
            count("rejected")
        ),
    );
    if let Some(stop) = result["stop"].as_object() {
        let t = stop.get("t").and_then(number).map_or(String::new(), |t| format!("at t = {} s: ", figure(t)));
        entry("stopped", t + &stop.get("what").map(text).unwrap_or_default());
    }
    let trust = &result["trust"];
    let beside =
        trust["companion"].as_str().map_or(String::new(), |name| format!(", estimated beside {name}"));
    match (number(&trust["horizon_s"]), number(&trust["error_estimate"])) {
        (Some(horizon), _) => {
            let tolerance = number(&trust["tolerance"]).unwrap_or(1e-3);
            entry(
                "trust",
                format!("trusted until {} s (to {tolerance:e} rad{beside}); pale beyond", rough(horizon)),
            );
        }
        (None, Some(error)) => {
            let how = how_near(trust["is_upper_bound"].as_bool().unwrap_or_default());
            entry("trust", format!("angles accurate to {how} {} rad{beside}", magnitude(error)));
        }
        (None, None) => {
            let why = trust["why"].as_str().unwrap_or("none was asked for");
            entry("trust", format!("no estimate of the error: {why}"));
        }
    }
    let energy = &result["energy"];
    if let (Some(most), Some(scale)) = (number(&energy["max_relative"]), number(&energy["scale"])) {
        let slope = number(&energy["slope"])
            .map_or(String::new(), |slope| format!(", slope {} /s", magnitude(slope)));
        entry("energy drift", format!("{} of {} J at most{slope}", magnitude(most), figure(scale)));
    }
    for (name, row) in result["constraints"].as_object().into_iter().flatten() {
        let most = |key: &str| number(&row[key]).map_or_else(|| "?".to_owned(), magnitude);
        let unit = text(&row["unit"]);
        entry(
            "constraint",
            format!("{name}: {} {unit} and {} {unit}/s at most", most("position_max"), most("velocity_max")),
        );
    }
    let scale = number(&result["energy"]["scale"]).unwrap_or(0.0);
    let many = |key: &str, what: &str| {
        let count = result[key]["count"].as_u64().filter(|&count| count > 0)?;
        let lost = number(&result[key]["energy_lost_j"])
            .map_or(String::new(), |lost| format!(", {} J lost in them", loss(lost, scale)));
        Some((what.to_owned(), format!("{count}{lost}")))
    };
    for (key, what) in [("impacts", "impacts"), ("holds", "stays on walls"), ("events", "events")] {
        if let Some((label, text)) = many(key, what) {
            entry(&label, text);
        }
    }
    let made = [&record["versions"]["driftless"], &record["versions"]["target"]].map(text);
    entry("made by", format!("driftless {}", made.join(", ")));
    if let Some(hash) = record["hashes"]["trajectory_sha256"].as_str().filter(|hash| !hash.is_empty()) {
        entry("trajectory", format!("SHA-256 {hash}"));
    }
    entries
}

/// Times at which something happened, with what it was.
pub(super) fn marks(record: &Value) -> Vec<Value> {
    let result = &record["result"];
    let of = |key: &str, name: &str| -> Vec<Value> {
        let all = result[key]["first"].as_array().map_or(&[][..], Vec::as_slice);
        all.iter().map(|one| json!({"t": one["t"], "name": text(&one[name]), "kind": key})).collect()
    };
    let mut marks = [of("impacts", "wall"), of("events", "name")].concat();
    marks.retain(|mark| mark["t"].is_f64());
    marks.truncate(MARKS);
    marks
}

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}
