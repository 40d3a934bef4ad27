//! What is fuzzed: each target takes a string of bytes, does with it what the program would, and panics where
//! a promise is broken.

use super::audit::audit;
use super::formulas;
use super::random::{self, Draw};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, FromArgMatches, Parser};
use driftless::cli::Flags;
use driftless::cli::flags::Command;
use driftless::dynamics::Mechanism;
use driftless::report;
use driftless::run::checkpoint::{opened, sealed};
use driftless::run::table::Table;
use driftless::run::{Limits, MethodId, Plan, Request, Run, Running, Sample, Snapshot, Vary};
use driftless::scene::formula::Formula;
use driftless::scene::{Override, Refusal, Scene, parse_scene};
use driftless::stepping::Cause;
use serde_json::{Value, json};
use std::cell::RefCell;
use std::path::Path;
use std::sync::{Arc, LazyLock};

/// A target by its name; it returns what kind of thing came of its input, so that a driver without coverage
/// can tell new kinds from old.
pub type Target = fn(&[u8]) -> u64;

/// All of them.
pub const TARGETS: [(&str, Target); 6] = [
    ("formula", formula),
    ("scene_text", scene_text),
    ("scene_tree", scene_tree),
    ("checkpoint", checkpoint),
    ("command_line", command_line),
    ("physics", physics),
];

/// The shipped scenes.
pub static SCENES: LazyLock<Vec<String>> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(if cfg!(test) {
        "examples/scenes"
    } else {
        "../examples/scenes"
    });
    let mut files: Vec<_> =
        std::fs::read_dir(folder).expect("scenes").flatten().map(|entry| entry.path()).collect();
    files.sort();
    files.iter().map(|file| std::fs::read_to_string(file).expect("a scene")).collect()
});

/// Bodies beyond which a scene that was read is not compiled: each execution is to be short.
const FEW: usize = 12;

/// FNV-1a over what a message says, its numbers and names left out.
fn kind(message: &str) -> u64 {
    let words = message.split(|letter: char| !letter.is_ascii_lowercase()).filter(|word| word.len() > 2);
    words
        .flat_map(str::bytes)
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// What kind of a refusal a scene's is; what the text says itself is left out, or every other text would be
/// of a kind of its own.
fn kind_of(refusal: &Refusal) -> u64 {
    let depth = refusal.path.bytes().filter(|&byte| byte == b'.' || byte == b'[').count() as u64;
    let words = refusal.problem.split(['`', '"', '=']).next().unwrap_or_default();
    kind(words) ^ kind(&refusal.allowed).rotate_left(1) ^ depth
}

/// A text becomes a scene or a refusal that names its place; a scene comes back from its own text as it was.
fn judge(text: &str) -> u64 {
    let scene = match parse_scene(text, "fuzzed.json", &[]) {
        Ok(scene) => scene,
        Err(error) => {
            assert!(!error.is_io() && error.to_string().starts_with("fuzzed.json"), "{error}");
            return kind_of(error.refusal());
        }
    };
    // What a folder is named after leads nowhere else.
    assert!(!scene.name.is_empty() && !scene.name.contains(['/', '\\', '.', ':', '\0']), "{}", scene.name);
    let again = parse_scene(&scene.to_input().to_string(), "again.json", &[]);
    assert_eq!(again.as_ref().ok(), Some(&scene), "{again:?}");
    if scene.bars.len() > FEW {
        return 1;
    }
    match Mechanism::new(&scene) {
        Ok(mechanism) => {
            let plan = Plan::new(&scene, &mechanism, &Request::default());
            plan.map_or_else(|refusal| kind(&refusal.to_string()), |plan| kind(&plan.why.unwrap_or_default()))
        }
        Err(error) => kind(&error.to_string()),
    }
}

/// Any bytes as the text of a scene.
pub fn scene_text(bytes: &[u8]) -> u64 {
    std::str::from_utf8(bytes).map_or_else(|_| judge(&String::from_utf8_lossy(bytes)), judge)
}

/// A shipped scene of which some values, keys and elements were changed.
pub fn scene_tree(bytes: &[u8]) -> u64 {
    static TREES: LazyLock<Vec<Value>> = LazyLock::new(|| {
        SCENES.iter().map(|text| serde_json::from_str(text).expect("a shipped scene")).collect()
    });
    let mut draw = Draw::new(bytes);
    let mut tree = draw.one(&TREES).clone();
    for _ in 0..1 + draw.below(4) {
        change(&mut tree, &mut draw);
    }
    judge(&tree.to_string())
}

const WORDS: &[&str] = &[
    "ground",
    "bar1",
    "bar2",
    "A",
    "slider",
    "",
    "..",
    "../up",
    "full",
    "locked",
    "body",
    "con",
    "ä",
    "a/b",
    "bar1\u{0}",
];
const NUMBERS: &[f64] = &[
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    1e-300,
    1e300,
    1e-30,
    1e30,
    -1e30,
    1e-9,
    1e9,
    8.796093e12,
    std::f64::consts::PI,
    4503599627370497.0,
    5e-324,
];

/// Goes down the tree and changes something there.
fn change(node: &mut Value, draw: &mut Draw) {
    let deeper = draw.chance(85);
    match node {
        Value::Object(members) if deeper && !members.is_empty() => {
            let at = draw.below(members.len());
            let key = members.keys().nth(at).cloned().unwrap_or_default();
            match draw.below(12) {
                0 => {
                    members.shift_remove(&key);
                }
                1 => {
                    let value = members[&key].clone();
                    members.insert((*draw.one(WORDS)).into(), value);
                }
                _ => change(&mut members[&key], draw),
            }
        }
        Value::Array(items) if deeper && !items.is_empty() => {
            let at = draw.below(items.len());
            match draw.below(8) {
                0 => {
                    items.remove(at);
                }
                1 => {
                    let copy = items[at].clone();
                    items.insert(at, copy);
                }
                2 => {
                    let other = draw.below(items.len());
                    items.swap(at, other);
                }
                _ => change(&mut items[at], draw),
            }
        }
        other => {
            *other = match draw.below(8) {
                0 => Value::Null,
                1 => json!(*draw.one(WORDS)),
                2 => json!([*draw.one(NUMBERS), *draw.one(NUMBERS)]),
                3 => json!(draw.byte()),
                4 => json!(f64::from_bits(draw.word())),
                5 => other.as_f64().map_or(json!(true), |value| json!(-value)),
                6 => other
                    .as_f64()
                    .map_or(json!({}), |value| json!(value * 10f64.powi(i32::from(draw.byte()) - 128))),
                _ => json!(*draw.one(NUMBERS)),
            }
        }
    }
}

/// A scene, its equations, and a checkpoint of a run of it.
type Sound = (Scene, Arc<Mechanism>, Vec<u8>);

/// Sound checkpoints of runs by methods of every kind.
static CHECKPOINTS: LazyLock<Vec<Sound>> = LazyLock::new(|| {
    let methods = ["dp8", "taylor", "dp5", "rattle6", "gauss8", "dop853", "taylor"];
    let of = |(name, method): (&str, &str)| {
        let text = SCENES
            .iter()
            .find(|text| text.contains(&format!("\"name\": \"{name}\"")))
            .expect("a shipped scene");
        let scene = parse_scene(text, name, &[]).expect("a scene");
        let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
        let method = method.parse::<MethodId>().expect("a method");
        let request =
            Request { method: Some(method), until: Some(1.0), every: Some(0.125), ..Request::default() };
        let plan = Plan::new(&scene, &mechanism, &request).expect("a plan");
        let run = Run::new(Arc::clone(&mechanism), plan, Limits::default(), &mechanism.start(&scene))
            .expect("a run");
        let mut running = Running::new(run);
        let mut calls = 0;
        let is_over = running.go(&mut |_| Ok(()), &mut || {
            calls += 1;
            calls == 7
        });
        assert!(!is_over.expect("nobody fails"));
        let bytes = sealed(&running.snapshot()).expect("bytes");
        (scene, mechanism, bytes)
    };
    let names = ["free", "spring", "wall", "motor_sine", "gentle", "chain8", "four_bars"];
    names.into_iter().zip(methods).map(of).collect()
});

/// A sound checkpoint with some bytes changed, with its checksum wrong or made right: it is refused, or the
/// run goes on.
pub fn checkpoint(bytes: &[u8]) -> u64 {
    const DIGEST: usize = 32;
    const HEAD: usize = 33;
    let mut draw = Draw::new(bytes);
    let (scene, mechanism, sound) = draw.one(&CHECKPOINTS);
    let mut changed = sound.clone();
    let is_sealed_again = draw.chance(90);
    match draw.below(16) {
        0 => changed.truncate(draw.below(sound.len() + 1)),
        1 => changed.extend_from_slice(&bytes[..bytes.len().min(16)]),
        _ => {}
    }
    for _ in 0..1 + draw.below(4) {
        // Most of it are samples for charts: the beginning, where plan and state are, is changed as often as
        // all the rest.
        let reach = if draw.chance(60) { changed.len().min(600) } else { changed.len() };
        let place = draw.below(reach.max(1));
        let byte = if draw.chance(20) { *draw.one(&[0, 1, 0x7f, 0x80, 0xff]) } else { draw.byte() };
        if let Some(there) = changed.get_mut(place) {
            *there = byte;
        }
    }
    if is_sealed_again && changed.len() >= HEAD + DIGEST {
        use sha2::Digest;
        let body = changed.len() - DIGEST;
        changed[..HEAD - 8].copy_from_slice(&sound[..HEAD - 8]);
        changed[HEAD - 8..HEAD].copy_from_slice(&((body - HEAD) as u64).to_le_bytes());
        let digest = sha2::Sha256::digest(&changed[..body]);
        changed[body..].copy_from_slice(&digest);
    }
    let mut snapshot: Snapshot = match opened(&changed, Path::new("checkpoint")) {
        Ok(snapshot) => snapshot,
        Err(error) => return kind(&error.to_string()),
    };
    // Mostly a few steps, at times many.
    let (max_evaluations, most) =
        *draw.one(&[(150, 2), (150, 2), (150, 2), (150, 2), (150, 2), (150, 2), (500, 4), (2000, 10)]);
    snapshot.allow(max_evaluations);
    match Running::resume(Arc::clone(mechanism), &mechanism.start(scene), snapshot) {
        Err(error) => kind(&error.to_string()),
        Ok(mut running) => {
            let mut calls = 0;
            let is_over = running.go(&mut |_| Ok(()), &mut || {
                calls += 1;
                calls >= most
            });
            if !is_over.expect("nobody fails") {
                return 2;
            }
            running.finish().stop.map_or(3, |stop| kind(&stop.what))
        }
    }
}

const COMMANDS: &[&str] = &[
    "run",
    "run",
    "run",
    "check",
    "sweep",
    "inspect",
    "compare",
    "stress",
    "resume",
    "methods",
    "schema",
    "completions",
];
/// Options with values that suit them; none where they take none.
const OPTIONS: &[(&str, &str)] = &[
    ("--method", "dp8"),
    ("--method", "gauss16"),
    ("--method", "taylor"),
    ("--methods", "dp8,taylor"),
    ("--step", "1/64"),
    ("--rtol", "1e-9"),
    ("--atol", "1e-12"),
    ("--until", "100"),
    ("--every", "0.25"),
    ("--stabilize", "none,projection"),
    ("--stabilize", "baumgarte"),
    ("--time-constant", "0.01"),
    ("--extended", ""),
    ("--max-evaluations", "1e5"),
    ("--prefer", "path"),
    ("--set", "bars[0].length=1"),
    ("--set", "walls.wall.restitution=0.5"),
    ("--set", "gravity=[0,-9.81]"),
    ("--strict", ""),
    ("--json", ""),
    ("-q", ""),
    ("-v", ""),
    ("--vary", "bar1.phi=-pi..pi:64"),
    ("--vary", "bars[0].length=1..2:3"),
    ("--to-flip", ""),
    ("--threads", "2"),
    ("--map", "flip_time"),
    ("--trust", "full"),
    ("--budget", "5"),
    ("--tolerance", "1e-3"),
    ("--max-energy-drift", "1e-6"),
    ("--max-constraint-drift", "1e-6"),
    ("--out", "results"),
    ("--force", ""),
    ("--checkpoint-every", "0"),
    ("--no-charts", ""),
    ("--gif", ""),
    ("--help", ""),
    ("--version", ""),
];
const VALUES: &[&str] = &[
    "1/64",
    "1e-9",
    "-1",
    "nan",
    "inf",
    "0",
    "1/0",
    "1e308",
    "18446744073709551616",
    "bash",
    "--",
    "=",
    "",
    "free.json",
    "none",
    "pi",
    "..",
    "x=1..2:0",
];

/// A scene that options are tried on.
struct Tried {
    text: String,
    scene: Scene,
    mechanism: Mechanism,
}

static FREE: LazyLock<Tried> = LazyLock::new(|| {
    let text =
        SCENES.iter().find(|text| text.contains("\"name\": \"free\"")).expect("a shipped scene").clone();
    let scene = parse_scene(&text, "free", &[]).expect("a scene");
    let mechanism = Mechanism::new(&scene).expect("equations");
    Tried { text, scene, mechanism }
});

/// The parser of the program, made once: that takes longer than to parse a line.
fn flags(words: &[String]) -> Result<Flags, clap::Error> {
    thread_local! {
        static PARSER: RefCell<clap::Command> = RefCell::new(Flags::command());
    }
    let matches = PARSER.with_borrow_mut(|parser| parser.try_get_matches_from_mut(words))?;
    Flags::from_arg_matches(&matches)
}

/// What kind of an error a command line's is, and the option it is about; one nobody knows counts as any
/// other.
fn kinds(error: &clap::Error) -> u64 {
    let said = error.to_string();
    assert!(!said.is_empty());
    let option = match error.get(ContextKind::InvalidArg) {
        Some(ContextValue::String(option)) if error.kind() != ErrorKind::UnknownArgument => kind(option),
        _ => 0,
    };
    kind(&error.kind().to_string()) ^ option.rotate_left(1)
}

/// Words of a command line, known ones and others: flags, or a message; and the texts of options by
/// themselves.
pub fn command_line(bytes: &[u8]) -> u64 {
    let mut draw = Draw::new(bytes);
    let is_compared = draw.chance(5);
    let mut words = vec!["driftless".to_owned()];
    if draw.chance(90) {
        words.push((*draw.one(COMMANDS)).to_owned());
    }
    if draw.chance(80) {
        words.push("free.json".to_owned());
    }
    for _ in 0..draw.below(8) {
        let (option, value) = *draw.one(OPTIONS);
        match draw.below(16) {
            0 => {
                let length = draw.below(12);
                let letters: Vec<u8> = (0..length).map(|_| draw.byte()).collect();
                words.push(String::from_utf8_lossy(&letters).into_owned());
            }
            1 => words.push((*draw.one(VALUES)).to_owned()),
            2 => words.extend([option.to_owned(), (*draw.one(VALUES)).to_owned()]),
            3 => words.push(format!("{option}={value}")),
            _ => words.extend([option, value].into_iter().filter(|word| !word.is_empty()).map(str::to_owned)),
        }
    }
    let rest = String::from_utf8_lossy(draw.rest()).into_owned();
    let mut sets = Vec::new();
    for word in words.iter().chain([&rest]) {
        if let Ok(vary) = word.parse::<Vary>() {
            assert!(
                vary.count > 0 && (0..vary.count.min(5)).all(|index| vary.value(index).is_finite()),
                "{vary:?}"
            );
        }
        sets.extend(word.parse::<Override>());
    }
    if !sets.is_empty() {
        // What is set anywhere is judged as what the file says.
        let _ = parse_scene(&FREE.text, "fuzzed.json", &sets);
    }
    let read = flags(&words);
    if is_compared {
        // As the program does, which makes its parser anew.
        let said = |read: &Result<Flags, clap::Error>| {
            read.as_ref().map_or_else(clap::Error::to_string, |flags| format!("{flags:?}"))
        };
        assert_eq!(said(&read), said(&Flags::try_parse_from(&words)));
    }
    match read {
        Ok(flags) => {
            let requests = match &flags.command {
                Command::Run(run) => run.plan.requests(),
                Command::Check(check) => check.plan.requests(),
                Command::Sweep(sweep) => sweep.plan.requests(),
                _ => Vec::new(),
            };
            let mut kinds = 4;
            for request in requests {
                match Plan::new(&FREE.scene, &FREE.mechanism, &request) {
                    Ok(plan) => assert!(
                        plan.until > 0.0 && plan.every > 0.0 && plan.rows > 0 && plan.max_evaluations > 0,
                        "{plan:?}"
                    ),
                    Err(refusal) => kinds ^= kind(&refusal.reason),
                }
            }
            kinds
        }
        Err(error) => kinds(&error),
    }
}

/// How a random scene ended, by exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Ending {
    /// 0, and its result stands up to the audit.
    Done,
    /// 3: no such scene, or no such run.
    Refused,
    /// 4: it stopped on the way, and why.
    Stopped(&'static str),
    /// 5: a stated bound was exceeded.
    Drifted,
}

/// A random scene through all that `driftless run` does with one, but files.
///
/// # Panics
/// Where a success does not stand up to the audit, or a report holds a number that is not finite.
pub fn simulate(text: &str, draw: &mut Draw, max_evaluations: u64) -> Ending {
    let Ok(scene) = parse_scene(text, "random.json", &[]) else { return Ending::Refused };
    let Ok(mechanism) = Mechanism::new(&scene) else { return Ending::Refused };
    let mechanism = Arc::new(mechanism);
    let request = random::request(draw, scene.until, max_evaluations);
    let Ok(plan) = Plan::new(&scene, &mechanism, &request) else { return Ending::Refused };
    let run = match Run::new(Arc::clone(&mechanism), plan, Limits::default(), &mechanism.start(&scene)) {
        Ok(run) => run,
        Err(stop) => return stopped(stop.cause),
    };
    let mut table = Table::new(&mechanism, Vec::new()).expect("room");
    let mut samples: Vec<Sample> = Vec::new();
    let outcome = driftless::run::integrate(run, &mut |sample| {
        samples.push(sample.clone());
        table.write(sample)
    });
    let outcome = outcome.expect("nobody fails");
    let rows = table.finish().expect("room");
    let report = || {
        report::result::text(&scene, &mechanism, &outcome);
        report::result::object(&scene, &mechanism, &outcome)
    };
    match &outcome.stop {
        Some(stop) => {
            assert!(!stop.what.is_empty() && !stop.hint.is_empty() && stop.t.is_finite(), "{stop}");
            // What is told of a run that stopped comes of the same code as what is told of one that did not.
            if draw.chance(25) {
                report();
            }
            stopped(stop.cause)
        }
        None => {
            let (rows, report) = (String::from_utf8(rows).expect("text"), report());
            assert!(
                !rows.contains("NaN") && !rows.contains("inf"),
                "the table holds what is no number: {request:?}"
            );
            assert!(all_finite(&report), "the report holds what is no number: {request:?} {report}");
            if let Err(fault) = audit(&scene, &mechanism, &samples, &outcome) {
                panic!("wrong success: {fault}; {request:?}");
            }
            Ending::Done
        }
    }
}

fn stopped(cause: Cause) -> Ending {
    if cause == Cause::DriftLimit { Ending::Drifted } else { Ending::Stopped(cause.word()) }
}

/// False where a number of a report came out as none: JSON has no other word for it than `null`.
fn all_finite(report: &Value) -> bool {
    let numbers = |value: &Value, names: &[&str]| names.iter().all(|name| value[*name].is_number());
    let bodies = report["final"]["bodies"].as_object().expect("bodies");
    numbers(report, &["until", "steps", "evaluations", "rejected", "wall_s"])
        && numbers(&report["energy"], &["max_relative", "scale", "slope", "trend", "trend_error"])
        && bodies.values().all(|body| numbers(body, &["phi", "omega", "x", "y", "vx", "vy"]))
        && report["constraints"]
            .as_object()
            .expect("rows")
            .values()
            .all(|row| numbers(row, &["position_max", "velocity_max", "position_slope", "velocity_slope"]))
}

/// A random scene and a random request, mostly with very little effort.
pub fn physics(bytes: &[u8]) -> u64 {
    let mut draw = Draw::new(bytes);
    let max_evaluations = *draw.one(&[80, 80, 80, 80, 80, 80, 80, 80, 80, 80, 80, 80, 300, 300, 300, 2000]);
    let text = random::scene(&mut draw);
    match simulate(&text, &mut draw, max_evaluations) {
        Ending::Done => 5,
        Ending::Refused => 6,
        Ending::Stopped(cause) => kind(cause),
        Ending::Drifted => 7,
    }
}

/// A text as a formula, and a random formula as value, derivative, force or potential in random scenes by three
/// methods.
pub fn formula(bytes: &[u8]) -> u64 {
    let mut draw = Draw::new(bytes);
    let (depth, corners, potential) = (draw.below(4), draw.chance(40), draw.chance(30));
    let text = formulas::expression(&mut draw, depth, corners, potential);
    formulas::is_consistent(&text);
    let moved = u64::from(formulas::moves_alike(&text, potential, &mut draw));
    let noise = String::from_utf8_lossy(draw.rest()).into_owned();
    let told = match Formula::parse(&noise) {
        Ok(formula) => {
            let count = formula.names().count();
            let _ = (formula.value(&vec![0.5; count]), formula.dimension(&vec![None; count]));
            let _ = formula.law(&vec![None; count]);
            2
        }
        Err(error) => kind(&error.to_string()),
    };
    told.wrapping_add(moved)
}
