//! Runs a target on mutations of its corpus: seeded, on stable, without coverage; inputs of which something
//! new comes are kept for further mutation.
//!   drive TARGET EXECUTIONS [SEED]  until there are so many in all, of any seed; what was done before
//!   counts, however it ended drive TARGET FILE  one input
//! Findings go to `fuzz/artifacts/TARGET`, counts to `fuzz/artifacts/TARGET.count`; with KEEP=1 small inputs
//! that were new go to `fuzz/corpus/TARGET`.

use driftless_fuzz::targets::{SCENES, TARGETS};
use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Inputs kept for mutation at most, and their length.
const KEPT: usize = 4096;
const LONGEST: usize = 8192;
/// Executions between two times the counts are written.
const OFTEN: u64 = 10_000;
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

/// Bytes enough to draw anything from.
fn drawn(random: &mut Random) -> Vec<u8> {
    (0..40).flat_map(|_| random.next().to_le_bytes()).collect()
}

fn keep(folder: &Path, input: &[u8]) -> PathBuf {
    std::fs::create_dir_all(folder).expect("a folder");
    let name = input.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    let path = folder.join(format!("{name:016x}"));
    std::fs::write(&path, input).expect("written");
    path
}

/// What was done of a target, by this and all former drives.
#[derive(Clone, Copy, Default)]
struct Count {
    executions: u64,
    findings: u64,
    seconds: f64,
}

impl Count {
    fn read(file: &Path) -> Self {
        let text = std::fs::read_to_string(file).unwrap_or_default();
        let mut words = text.split_whitespace();
        let mut number = || words.next().and_then(|word| word.parse::<f64>().ok()).unwrap_or(0.0);
        Self { executions: number() as u64, findings: number() as u64, seconds: number() }
    }

    fn write(self, file: &Path) {
        std::fs::write(file, format!("{} {} {:.0}\n", self.executions, self.findings, self.seconds)).expect("written");
    }
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
    let (executions, seed) = (number(2, 100_000), number(3, 1));
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (corpus, artifacts) = (here.join("corpus").join(name), here.join("artifacts").join(name));
    std::fs::create_dir_all(&artifacts).expect("a folder");
    let file = artifacts.with_extension("count");
    let former = Count::read(&file);
    // What goes on goes elsewhere.
    let mut random = Random(seed ^ former.executions.wrapping_mul(0xd134_2543_de82_ef95));
    let is_kept = std::env::var_os("KEEP").is_some();
    let mut inputs: Vec<Vec<u8>> = vec![Vec::new()];
    if let Ok(files) = std::fs::read_dir(&corpus) {
        inputs.extend(files.flatten().map(|file| std::fs::read(file.path()).expect("an input")));
    }
    // Bytes that choices are drawn from may be any; a text is one of somebody's.
    let is_text = name == "scene_text";
    if is_text {
        inputs.extend(SCENES.iter().map(|text| text.clone().into_bytes()));
    } else {
        inputs.extend((0..64).map(|_| drawn(&mut random)));
    }
    // What is found is told below, and once.
    std::panic::set_hook(Box::new(|_| {}));
    let (mut kinds, mut findings, mut messages) = (HashSet::new(), former.findings, HashSet::new());
    let (begin, mut slowest) = (Instant::now(), Duration::ZERO);
    let tell = |done: u64, kinds: usize, findings: u64, slowest: Duration| {
        let count = Count { executions: former.executions + done, findings, seconds: former.seconds + begin.elapsed().as_secs_f64() };
        count.write(&file);
        if done.is_multiple_of(50 * OFTEN) || count.executions >= executions {
            let Count { executions, seconds, .. } = count;
            println!("{name}: {executions} executions in all, {kinds} kinds, {findings} findings, {seconds:.0} s, slowest {slowest:?}");
        }
    };
    for execution in 0..executions.saturating_sub(former.executions) {
        let is_new = !is_text && random.below(4) == 0;
        let mut input = if is_new { drawn(&mut random) } else { inputs[random.below(inputs.len())].clone() };
        if execution as usize >= inputs.len() && !is_new {
            let other = random.below(inputs.len());
            mutate(&mut input, &inputs[other], &mut random);
        }
        let once = || {
            let begin = Instant::now();
            (catch_unwind(AssertUnwindSafe(|| target(&input))), begin.elapsed())
        };
        let (came, mut took) = once();
        if took > LONG {
            // A busy machine makes anything take long, but not each time.
            took = (0..5).fold(took, |least, _| least.min(once().1));
        }
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
        if (execution + 1).is_multiple_of(OFTEN) {
            tell(execution + 1, kinds.len(), findings, slowest);
        }
    }
    tell(executions.saturating_sub(former.executions), kinds.len(), findings, slowest);
    std::process::exit(i32::from(findings > 0));
}
