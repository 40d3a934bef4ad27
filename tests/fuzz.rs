//! The targets of `fuzz/` on inputs of a fixed seed, so that every change meets some; `FUZZ=1000000 cargo
//! test --test reports fuzz::` has more, and `SEED=2` others.
#![cfg(feature = "cli")]

use crate::extremes;
use crate::mechanisms;
use crate::program;
use crate::random;
use crate::relations;
use crate::targets;

use driftless::run::Request;
use driftless::run::trust::Level;
use program::Program;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use random::Draw;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};
use targets::{Ending, TARGETS};

/// Executions of each target where nobody says how many.
const USUAL: u32 = 3000;

/// Runs a target on its corpus, where that is at hand, and on strings of bytes.
fn run(name: &str) {
    let (_, target) = TARGETS.iter().find(|(own, _)| *own == name).expect("a target");
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(name);
    for file in std::fs::read_dir(corpus).into_iter().flatten().flatten() {
        target(&std::fs::read(file.path()).expect("an input"));
    }
    let cases = std::env::var("FUZZ").ok().and_then(|count| count.parse().ok()).unwrap_or(USUAL);
    let config = Config { cases, failure_persistence: None, max_shrink_iters: 500, ..Config::default() };
    let rng = match std::env::var("SEED").ok().and_then(|seed| seed.parse::<u64>().ok()) {
        Some(seed) => {
            let mut bytes = [0; 32];
            bytes[..8].copy_from_slice(&seed.to_le_bytes());
            TestRng::from_seed(RngAlgorithm::ChaCha, &bytes)
        }
        None => TestRng::deterministic_rng(RngAlgorithm::ChaCha),
    };
    let mut runner = TestRunner::new_with_rng(config, rng);
    let bytes = proptest::collection::vec(any::<u8>(), 0..400);
    runner
        .run(&bytes, |bytes| {
            target(&bytes);
            Ok(())
        })
        .unwrap_or_else(|failure| panic!("{name}: {failure}"));
}

/// Shipped scenes with bytes changed: strings of any bytes are seldom read beyond their first letter.
#[test]
fn no_text_makes_the_reader_panic() {
    let mut runner = TestRunner::new_with_rng(
        Config { cases: USUAL, failure_persistence: None, ..Config::default() },
        TestRng::deterministic_rng(RngAlgorithm::ChaCha),
    );
    let changes = proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6);
    runner
        .run(&(any::<prop::sample::Index>(), changes), |(scene, changes)| {
            let mut bytes = scene.get(&targets::SCENES).clone().into_bytes();
            for (place, byte) in changes {
                let place = place.index(bytes.len());
                bytes[place] = byte;
            }
            targets::scene_text(&bytes);
            Ok(())
        })
        .unwrap_or_else(|failure| panic!("{failure}"));
    run("scene_text");
}

#[test]
fn no_tree_makes_the_reader_panic() {
    run("scene_tree");
}

#[test]
fn no_checkpoint_makes_a_run_panic() {
    run("checkpoint");
}

#[test]
fn formulas_agree_with_themselves_in_every_arithmetic_and_method() {
    run("formula");
}

#[test]
fn no_command_line_makes_the_parser_panic() {
    run("command_line");
}

#[test]
fn no_physics_makes_a_wrong_success() {
    run("physics");
}

/// Evaluations allowed to a run of an extreme scene.
const MAX_EVALUATIONS: u64 = 20_000;

/// Random scenes with numbers far out, by every method, with an effort of `MAX_EVALUATIONS` evaluations: each
/// ends with exit code 0, 3, 4 or 5, every success stands up to an independent audit of its first row, its
/// energy and its joints, and the program says the same of a part of them; a part is swept, with a look-out
/// for bars that turn over, and a part has its error estimated.  `.ci/extremes N SEED` has more; scenes that
/// fail go to the folder that `FOUND` names.
#[test]
fn random_extreme_scenes_end_as_promised() {
    let number =
        |name: &str, usual: u64| std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(usual);
    let (count, seed) = (number("EXTREMES", 600), number("SEED", 1));
    let program = Program::new();
    let mut seen = Seen::default();
    for index in 0..count {
        let own = seed.wrapping_mul(0x1_0000_0001).wrapping_add(index);
        let bytes = bytes_of(own);
        let mut draw = Draw::new(&bytes);
        let text = if index % 2 == 0 { random::scene(&mut draw) } else { in_extreme_units(own, &mut draw) };
        let Some(ending) = seen.run(index, &text, &draw) else { continue };
        if index % 100 < 2 {
            seen.shown += 1;
            program.write("random.json", &text);
            let until = serde_json::from_str::<serde_json::Value>(&text).expect("JSON")["until"]
                .as_f64()
                .expect("a horizon");
            let options = options(&random::request(&mut draw, until, MAX_EVALUATIONS));
            let ran = program.run(&format!("run random.json --force --quiet --no-charts {options}"));
            let code = match ending {
                Ending::Done => 0,
                Ending::Refused => 3,
                Ending::Stopped(_) => 4,
                Ending::Drifted => 5,
            };
            // A pairing of options that is refused whatever the scene has a code of its own.
            assert!(
                ran.code == code || (ending == Ending::Refused && ran.code == 2),
                "scene {index} of seed {seed}: {ending:?}, {ran:?}, {text}"
            );
        }
    }
    seen.tell(count);
    let Seen { failures, endings, .. } = seen;
    assert!(
        failures.is_empty(),
        "{} failures, of which\n{}",
        failures.len(),
        failures[..failures.len().min(5)].join("\n")
    );
    assert!(
        count < 100
            || [Ending::Done, Ending::Refused]
                .iter()
                .all(|ending| endings.get(ending).is_some_and(|&some| some > count / 20))
    );
}

/// A scene that is consistent, in units far from the usual ones.
fn in_extreme_units(seed: u64, draw: &mut Draw) -> String {
    let made = mechanisms::scene(seed);
    let units = [0, 1, 2].map(|_| *draw.one(&[1e-9, 1e-6, 1e-3, 1.0, 1.0, 1.0, 1e3, 1e6, 1e9]));
    match extremes::parsed(&made.text) {
        Some(scene) => relations::scaled(&scene, units).scene.to_input().to_string(),
        None => made.text,
    }
}

/// What came of all scenes.
#[derive(Default)]
struct Seen {
    endings: BTreeMap<Ending, u64>,
    /// Scenes of each kind, and how many of them ran to their end.
    kinds: BTreeMap<&'static str, [u64; 2]>,
    swept: [u64; 4],
    /// Runs whose error was asked for, and for which it was given.
    trusted: [u64; 2],
    slowest: (Duration, u64),
    shown: u64,
    failures: Vec<String>,
}

impl Seen {
    /// A scene through a run, and at times a sweep and an estimate; nothing where one of them panics.
    fn run(&mut self, index: u64, text: &str, draw: &Draw) -> Option<Ending> {
        let begin = Instant::now();
        let ending =
            self.caught(index, text, "run", || targets::simulate(text, &mut draw.clone(), MAX_EVALUATIONS))?;
        *self.endings.entry(ending).or_default() += 1;
        if let Some(scene) = extremes::parsed(text) {
            for kind in extremes::kinds(&scene) {
                let counts = self.kinds.entry(kind).or_default();
                *counts = [counts[0] + 1, counts[1] + u64::from(ending == Ending::Done)];
            }
            if matches!(index % 12, 2 | 3 | 5) && ending != Ending::Refused {
                let swept = self.caught(index, text, "sweep", || {
                    extremes::sweep_of(text, &scene, &mut draw.clone(), MAX_EVALUATIONS / 4)
                })?;
                let of_all = [swept.points, swept.done, swept.flipped, swept.compared];
                self.swept.iter_mut().zip(of_all).for_each(|(sum, own)| *sum += own);
            }
            if matches!(index % 12, 6 | 7 | 9) && ending != Ending::Refused {
                let request = random::request(&mut draw.clone(), scene.until, MAX_EVALUATIONS);
                // What it costs is bounded by the run's work.
                let level = if index % 4 == 3 { Level::Full } else { Level::Auto };
                let given =
                    self.caught(index, text, "trust", || extremes::trust_of(&scene, &request, level))?;
                self.trusted = [
                    self.trusted[0] + u64::from(given.is_some()),
                    self.trusted[1] + u64::from(given == Some(true)),
                ];
            }
        }
        self.slowest = self.slowest.max((begin.elapsed(), index));
        Some(ending)
    }

    /// What comes of it, unless it panics, which is a failure.
    fn caught<T>(&mut self, index: u64, text: &str, what: &str, work: impl FnOnce() -> T) -> Option<T> {
        if let Some(folder) = std::env::var_os("FOUND") {
            // What never comes back is found here.
            std::fs::write(Path::new(&folder).join("current.json"), format!("{index} {what} {text}\n"))
                .expect("a folder");
        }
        match catch_unwind(AssertUnwindSafe(work)) {
            Ok(found) => Some(found),
            Err(panic) => {
                let said = panic
                    .downcast_ref::<String>()
                    .cloned()
                    .or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()));
                let said = said.unwrap_or_default();
                if let Some(folder) = std::env::var_os("FOUND") {
                    let scene: serde_json::Value = serde_json::from_str(text).expect("JSON");
                    let found = serde_json::json!({"command": what, "what": said, "scene": scene});
                    std::fs::write(
                        Path::new(&folder).join(format!("{what}-{index}.json")),
                        format!("{found:#}\n"),
                    )
                    .expect("a folder");
                }
                self.failures.push(format!("{what} of scene {index}: {said}\n  {text}"));
                None
            }
        }
    }

    fn tell(&self, count: u64) {
        let Self { endings, kinds, swept, trusted, slowest, shown, .. } = self;
        println!("{count} random scenes, {shown} of them by the program too: {endings:?}");
        println!(
            "{} points swept, {} done, {} with a bar that turns over, {} compared with the rows of a run",
            swept[0], swept[1], swept[2], swept[3]
        );
        println!(
            "{} runs with an estimate asked for, {} with one given; slowest scene {slowest:?}",
            trusted[0], trusted[1]
        );
        for (kind, [met, done]) in kinds {
            println!("  {kind:28} {met:6} scenes, {done:6} ran to their end");
        }
    }
}

/// Bytes of a seed (SplitMix64).
fn bytes_of(seed: u64) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0xd134_2543_de82_ef95);
    let mut word = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = state;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    (0..64).flat_map(|_| word().to_le_bytes()).collect()
}

/// A request as options of the program.
fn options(request: &Request) -> String {
    let mut options = String::new();
    let mut say = |name: &str, value: Option<String>| {
        if let Some(value) = value {
            options += &format!("--{name} {value} ");
        }
    };
    say("method", request.method.map(|method| method.to_string()));
    say("step", request.step.map(|value| format!("{value:e}")));
    say("rtol", request.rtol.map(|value| format!("{value:e}")));
    say("atol", request.atol.map(|value| format!("{value:e}")));
    say("time-constant", request.time_constant.map(|value| format!("{value:e}")));
    say("stabilize", request.stabilize.map(|how| how.to_string()));
    say("effort", request.max_evaluations.map(|max_evaluations| max_evaluations.to_string()));
    if request.extended {
        options += "--extended ";
    }
    options
}

/// What a scene calls itself names a folder, and none but one below that of the output.
#[test]
fn no_name_leads_out_of_the_output_folder() {
    let program = Program::with_scenes(&["hanging"]);
    let shipped = program.read("hanging.json");
    for name in ["..", ".", "../up", "a/b", "/tmp/up", "C:", "a\\\\b", "", "con\\u0000", "~", "\\u202e"] {
        program.write("named.json", &shipped.replacen("\"hanging\"", &format!("\"{name}\""), 1));
        let ran = program.run("run named.json --out results --quiet --no-charts");
        assert_eq!(ran.code, 3, "{name}: {ran:?}");
        assert!(!program.path("results").exists() && !program.path("up").exists(), "{name}");
    }
}
