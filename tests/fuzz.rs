//! The targets of `fuzz/` on inputs of a fixed seed, so that every change meets some; `FUZZ=1000000 cargo test --test fuzz` has more.
#![cfg(feature = "cli")]

#[path = "common/audit.rs"]
mod audit;
#[path = "common/program.rs"]
#[allow(dead_code)]
mod program;
#[path = "common/random.rs"]
mod random;
#[path = "common/targets.rs"]
mod targets;

use driftless::run::Request;
use program::Program;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use random::Draw;
use std::collections::BTreeMap;
use std::path::Path;
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
    let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha));
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
fn no_command_line_makes_the_parser_panic() {
    run("command_line");
}

#[test]
fn no_physics_makes_a_wrong_success() {
    run("physics");
}

/// Random scenes with numbers far out, by every method, with an effort of `EFFORT` evaluations: each ends with exit code 0, 3, 4 or 5, every success stands up to
/// an independent audit of its energy and its joints, and the program says the same of a part of them.  `.ci/extremes N SEED` has more.
#[test]
fn random_extreme_scenes_end_as_promised() {
    const EFFORT: u64 = 20_000;
    let number = |name: &str, usual: u64| std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(usual);
    let (count, seed) = (number("EXTREMES", 600), number("SEED", 1));
    let program = Program::new();
    let mut endings: BTreeMap<Ending, u64> = BTreeMap::new();
    let (mut shown, mut failures) = (0, Vec::new());
    for index in 0..count {
        let bytes = bytes_of(seed.wrapping_mul(0x1_0000_0001).wrapping_add(index));
        let mut draw = Draw::new(&bytes);
        let text = random::scene(&mut draw);
        let simulated = std::panic::catch_unwind(|| {
            let mut draw = draw.clone();
            targets::simulate(&text, &mut draw, EFFORT)
        });
        let Ok(ending) = simulated else {
            failures.push(format!("scene {index} of seed {seed}: {text}"));
            continue;
        };
        *endings.entry(ending).or_default() += 1;
        if index % 100 == 0 {
            shown += 1;
            program.write("random.json", &text);
            let until = serde_json::from_str::<serde_json::Value>(&text).expect("JSON")["until"].as_f64().expect("a horizon");
            let options = options(&random::request(&mut draw, until, EFFORT));
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
    println!("{count} random scenes, {shown} of them by the program too: {endings:?}");
    assert!(failures.is_empty(), "{} failures, of which\n{}", failures.len(), failures[..failures.len().min(5)].join("\n"));
    assert!(count < 100 || [Ending::Done, Ending::Refused].iter().all(|ending| endings.get(ending).is_some_and(|&some| some > count / 20)));
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
    say("effort", request.effort.map(|effort| effort.to_string()));
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
