//! The motion of runs against an independent simulator; see `tests/auditor/mod.rs`.  `.ci/audit PAIRS SEED`
//! compares more pairs.

#[path = "auditor/mod.rs"]
mod auditor;

use auditor::pairs::{Summary, pairs};
use auditor::reader::{Scene, unjudged};
use auditor::record::Record;
use auditor::start::start;
use auditor::verdict::{Verdict, compare, run};
use driftless::run::{METHODS, Request};
use serde_json::{Value, json};

/// A scene with another horizon and so many rows.
fn shortened(text: &str, most: f64, rows: f64) -> String {
    let mut scene: Value = serde_json::from_str(text).expect("JSON");
    let until = scene["until"].as_f64().expect("a number").min(most);
    (scene["until"], scene["every"]) = (json!(until), json!(until / rows));
    scene.to_string()
}

/// Scenes of a folder, by every method.
#[test]
#[ignore = "by hand: AUDIT_FOLDER=… cargo test --test auditor folder -- --ignored --nocapture"]
fn folder() {
    let folder = std::env::var("AUDIT_FOLDER").unwrap_or_else(|_| "examples/scenes".into());
    let most = std::env::var("AUDIT_UNTIL").ok().and_then(|text| text.parse().ok()).unwrap_or(2.0);
    let only = std::env::var("AUDIT_METHOD").ok();
    let mut paths: Vec<_> =
        std::fs::read_dir(&folder).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    for path in paths.iter().filter(|path| path.extension().is_some_and(|kind| kind == "json")) {
        let text = shortened(&std::fs::read_to_string(path).expect("a scene"), most, 8.0);
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let begin = std::time::Instant::now();
        let beyond = unjudged(&serde_json::from_str(&text).expect("JSON"));
        if !beyond.is_empty() {
            println!("{name}: not judged for {}", beyond.join(", "));
            continue;
        }
        let record = record_of(&text);
        let record = match record {
            Ok(record) => record,
            Err(lost) => {
                println!("{name}: {lost}");
                continue;
            }
        };
        println!(
            "{name}: {} evaluations, {:.1?}, growth {:.1e}, doubt {:?}, impacts {}",
            record.evaluations,
            begin.elapsed(),
            record.growth.last().expect("one"),
            record.doubt,
            record.impacts.len()
        );
        for method in METHODS {
            if only.as_ref().is_some_and(|only| only != method.name) {
                continue;
            }
            let request =
                Request { method: Some(method.id), max_evaluations: Some(2_000_000), ..Request::default() };
            let ran = match run(&text, &request) {
                Ok(ran) => ran,
                Err(why) => {
                    let why: String = why.chars().take(60).collect();
                    println!("    {:8} refused: {why}", method.name);
                    continue;
                }
            };
            match compare(&record, &ran) {
                Verdict::Differs(found) => {
                    println!(
                        "    {:8} DIFFERS {} times, est {:?}",
                        method.name,
                        found.len(),
                        ran.outcome.trust.as_ref().and_then(|t| t.error_estimate)
                    );
                    found.iter().take(4).for_each(|difference| println!("             {difference}"));
                }
                other => println!("    {:8} {other:?}", method.name),
            }
        }
    }
}

/// Every example is judged, or what of it is not is named.
#[test]
fn what_the_auditor_does_not_judge_has_a_name() {
    let mut judged = Vec::new();
    let mut beyond = Vec::new();
    for entry in std::fs::read_dir("examples/scenes").expect("a folder").flatten() {
        let text = std::fs::read_to_string(entry.path()).expect("a scene");
        let json: Value = serde_json::from_str(&text).expect("JSON");
        let name = json["name"].as_str().expect("a name").to_owned();
        match unjudged(&json) {
            found if found.is_empty() => {
                Scene::read(&text);
                judged.push(name);
            }
            found => beyond.extend(found.into_iter().map(|key| format!("{name}: {key}"))),
        }
    }
    beyond.sort();
    println!("judged: {}\nnot judged:\n{}", judged.len(), beyond.join("\n"));
    for expected in [
        "sliding_ball: walls.floor.friction",
        "duffing: torsion_springs.coil.potential",
        "pid: integrals",
        "friction_pendulum: hinges.A.friction",
    ] {
        assert!(beyond.iter().any(|found| found == expected), "{expected} in {beyond:#?}");
    }
    assert!(judged.len() >= 15, "{judged:?}");
}

/// Random scenes by random methods: `PAIRS` and `SEED` say how many and which.
#[test]
fn motions_agree_with_the_auditor() {
    let number =
        |name: &str, usual: u64| std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(usual);
    let seed = number("SEED", 1);
    let summary = Summary::of(pairs(number("PAIRS", 300) as usize, seed));
    println!("{}", summary.text());
    // The document's table is what comes after this line of it.
    if let Ok(path) = std::env::var("AUDIT_TABLE") {
        const MARK: &str = "<!-- What follows is written by .ci/audit. -->\n";
        let before = std::fs::read_to_string(&path).expect("the document");
        let head = before.split(MARK).next().expect("a head");
        std::fs::write(&path, format!("{head}{MARK}\n{}", summary.tables(seed))).expect("room");
    }
    if let Ok(folder) = std::env::var("AUDIT_OUT") {
        std::fs::create_dir_all(&folder).expect("a folder");
        let others = summary.reported.values().chain(summary.unclear.values()).map(|(_, seed)| seed);
        for seed in summary.differing.iter().map(|(seed, ..)| seed).chain(others) {
            std::fs::write(format!("{folder}/{seed}.json"), auditor::mechanisms::scene(*seed).text)
                .expect("room");
        }
    }
    assert!(summary.differing.is_empty(), "{} pairs differ", summary.differing.len());
}

/// The auditor's motion at the times of a scene's rows.
fn record_of(text: &str) -> Result<Record, String> {
    let scene = Scene::read(text);
    let rows = (scene.until / scene.every).round();
    let times: Vec<f64> = (0..=rows as usize)
        .map(|row| if row as f64 == rows { scene.until } else { scene.every * row as f64 })
        .collect();
    let start = match start(scene.clone(), None) {
        Ok(start) => start,
        Err(_) => {
            let first = run(text, &Request { until: Some(scene.until * 1e-6), ..Request::default() })?;
            start(scene, Some(&guess(&first.samples[0]))).map_err(|lost| lost.0)?
        }
    };
    if start.correction[0].is_nan() || start.correction[0] >= 1e-9 {
        return Err(format!("start off by {:?}", start.correction));
    }
    Record::new(start, &times, 400_000).map_err(|lost| lost.0)
}

/// The program's first row as a start to complete.
fn guess(sample: &driftless::run::Sample) -> auditor::model::State {
    let of = |numbers: Vec<f64>| numbers.into_iter().map(auditor::double_double::Dd::from).collect();
    let bodies = || 0..sample.centre.len();
    auditor::model::State {
        q: of(bodies().flat_map(|k| [sample.centre[k][0], sample.centre[k][1], sample.phi[k]]).collect()),
        v: of(bodies()
            .flat_map(|k| [sample.velocity[k][0], sample.velocity[k][1], sample.omega[k]])
            .collect()),
        ..Default::default()
    }
}
