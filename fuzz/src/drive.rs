//! Runs a target on mutations of its corpus: seeded, on stable, without coverage; inputs of which something new comes are kept for further mutation.
//!   drive TARGET EXECUTIONS [SEED]
//! Findings go to `fuzz/artifacts/TARGET`; with KEEP=1 small inputs that were new go to `fuzz/corpus/TARGET`.

use driftless_fuzz::targets::{SCENES, TARGETS};
use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Inputs kept for mutation at most, and their length.
const KEPT: usize = 4096;
const LONGEST: usize = 8192;
/// An execution longer than this is a finding.
const LONG: Duration = Duration::from_secs(5);

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

const TOKENS: &[&[u8]] = &[
    b"\"name\"",
    b"\"bars\"",
    b"\"body\"",
    b"\"ground\"",
    b"1e308",
    b"-0.0",
    b"1e-30",
    b"null",
    b"[]",
    b"{}",
    b"[[[[",
    b"\\u0000",
    b"\"start\"",
    b"{\"",
    b"\"}",
    b",",
    b":",
    b"\xff",
    b"\xef\xbb\xbf",
    b"=",
    b"..",
    b"pi",
];

/// Some changes of an input; another one gives pieces.
fn mutate(input: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    for _ in 0..1 + random.below(5) {
        let at = random.below(input.len() + 1);
        match random.below(10) {
            0..3 => {
                if let Some(byte) = input.get_mut(at) {
                    *byte = random.next() as u8;
                }
            }
            3 => {
                if let Some(byte) = input.get_mut(at) {
                    *byte ^= 1 << random.below(8);
                }
            }
            4 => input.insert(at, random.next() as u8),
            5 => {
                let end = (at + 1 + random.below(8)).min(input.len());
                input.drain(at.min(end)..end);
            }
            6 => {
                let token = TOKENS[random.below(TOKENS.len())];
                input.splice(at..at, token.iter().copied());
            }
            7 => {
                let from = random.below(other.len() + 1);
                let piece = &other[from..(from + random.below(64)).min(other.len())];
                input.splice(at..at, piece.iter().copied());
            }
            8 => {
                let piece: Vec<u8> = (0..random.below(64)).map(|_| random.next() as u8).collect();
                input.splice(at..at, piece);
            }
            _ => {
                let from = random.below(other.len() + 1);
                input.truncate(at);
                input.extend_from_slice(&other[from..]);
            }
        }
    }
    input.truncate(LONGEST);
}

fn keep(folder: &Path, input: &[u8]) -> PathBuf {
    std::fs::create_dir_all(folder).expect("a folder");
    let name = input.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    let path = folder.join(format!("{name:016x}"));
    std::fs::write(&path, input).expect("written");
    path
}

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let (name, target) =
        *TARGETS.iter().find(|(name, _)| words.get(1).is_some_and(|word| word == name)).expect("drive TARGET EXECUTIONS [SEED]");
    if let Some(path) = words.get(2).map(Path::new).filter(|path| path.is_file()) {
        println!("{:016x}", target(&std::fs::read(path).expect("an input")));
        return;
    }
    let number = |place: usize, usual: u64| words.get(place).map_or(usual, |word| word.parse().expect("a number"));
    let (executions, mut random) = (number(2, 100_000), Random(number(3, 1)));
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (corpus, artifacts) = (here.join("corpus").join(name), here.join("artifacts").join(name));
    let is_kept = std::env::var_os("KEEP").is_some();
    let mut inputs: Vec<Vec<u8>> = vec![Vec::new()];
    if let Ok(files) = std::fs::read_dir(&corpus) {
        inputs.extend(files.flatten().map(|file| std::fs::read(file.path()).expect("an input")));
    }
    if name == "scene_text" {
        inputs.extend(SCENES.iter().map(|text| text.clone().into_bytes()));
    } else {
        inputs.extend((0..64).map(|_| (0..300).map(|_| random.next() as u8).collect()));
    }
    // What is found is told below, and once.
    std::panic::set_hook(Box::new(|_| {}));
    let (mut kinds, mut findings, mut messages) = (HashSet::new(), 0_u64, HashSet::new());
    let (begin, mut slowest) = (Instant::now(), Duration::ZERO);
    for execution in 0..executions {
        let mut input = inputs[random.below(inputs.len())].clone();
        if execution as usize >= inputs.len() {
            let other = random.below(inputs.len());
            mutate(&mut input, &inputs[other].clone(), &mut random);
        }
        let one = Instant::now();
        let came = catch_unwind(AssertUnwindSafe(|| target(&input)));
        let took = one.elapsed();
        slowest = slowest.max(took);
        let message = match &came {
            Err(panic) => Some(
                panic
                    .downcast_ref::<String>()
                    .cloned()
                    .or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()))
                    .unwrap_or_default(),
            ),
            Ok(_) if took > LONG => Some(format!("took {took:?}")),
            Ok(_) => None,
        };
        if let Some(message) = message {
            findings += 1;
            let short: String = message.chars().filter(|letter| !letter.is_ascii_digit()).take(60).collect();
            if messages.insert(short) {
                let path = keep(&artifacts, &input);
                println!("{name}: {}: {}", path.display(), message.chars().take(600).collect::<String>());
            }
        } else if let Ok(kind) = came
            && kinds.insert(kind)
        {
            if is_kept && input.len() <= 1024 {
                keep(&corpus, &input);
            }
            if inputs.len() < KEPT {
                inputs.push(input);
            }
        }
        if execution % 1_000_000 == 999_999 {
            println!(
                "{name}: {} executions, {} kinds, {findings} findings, {:.0} s",
                execution + 1,
                kinds.len(),
                begin.elapsed().as_secs_f64()
            );
        }
    }
    println!(
        "{name}: {executions} executions, {} kinds, {findings} findings, {:.0} s, slowest {slowest:?}",
        kinds.len(),
        begin.elapsed().as_secs_f64()
    );
    std::process::exit(i32::from(findings > 0));
}
