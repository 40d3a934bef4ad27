//! The same bits on every machine: the ends of shipped scenes by every kind of method, as hashes.
//!
//! A change of the arithmetic changes them; then the new ones are printed, and belong here with a word in the
//! changelog.  They are the same with and without the processor's vectors, which is what is compared here; in
//! a release build, whose program `.ci/bits release` takes; and in debug builds, with `target-cpu=native`,
//! and on other processors, where `.ci/bits` runs this.

mod common;
#[cfg(feature = "cli")]
#[path = "common/program.rs"]
#[allow(dead_code)]
mod program;

use common::{run, shipped};
use driftless::arithmetic::lanes::{self, Code, Lanes};
use driftless::run::{Request, Stabilization};
use driftless::scene::Scene;

type End = (&'static str, &'static str, f64, Option<Stabilization>, f64, u64);

/// Scene, method, step or tolerance, stabilization, seconds, and the hash of the end.
const ENDS: &[End] = &[
    ("free", "dopri5", 1e-7, None, 3.0, 0x274a_470f_eafd_a9eb),
    ("free", "dop853", 1e-9, None, 3.0, 0xd2a5_b8b4_7dd8_13da),
    ("free", "dp8", 1e-9, None, 3.0, 0x6c4d_deb9_af11_3e66),
    ("free", "taylor", 1e-12, None, 10.0, 0x16cb_04dc_7f78_7f28),
    ("gentle", "gauss16", 1.0 / 64.0, None, 10.0, 0x2ba1_94cf_d351_9971),
    ("spring", "dp5", 1e-8, None, 3.0, 0x02bf_b842_c6b0_6ce8),
    ("spring", "taylor", 1e-10, None, 3.0, 0x5796_59f8_8c05_61b2),
    ("motor", "taylor", 1e-9, Some(Stabilization::Elimination), 10.0, 0x8bf9_1a8f_c0a4_274e),
    ("motor_sine", "dp8", 1e-9, Some(Stabilization::Projection), 3.0, 0xe8af_d435_6067_9c10),
    ("motor_sine", "gauss8", 1.0 / 128.0, None, 3.0, 0x8e71_b050_e99a_ef9a),
    ("motor_sine", "rattle6", 1.0 / 128.0, None, 3.0, 0xbe9d_d5cb_c8a0_b5f9),
    ("wall", "dp8", 1e-10, None, 3.0, 0x4488_b69b_79f6_6328),
    ("chain8", "dp8", 1e-8, None, 1.0, 0x695e_3319_5b27_e5f2),
    ("branch", "taylor", 1e-10, None, 3.0, 0xbae9_ee99_71b5_7629),
    ("andrews", "taylor", 1e-10, None, 0.03, 0x797c_b012_266b_31dd),
    ("andrews", "dp8", 1e-9, None, 0.03, 0x58df_f5b6_13da_4c77),
    ("four_bars", "taylor", 1e-10, None, 5.0, 0x13b0_6b2e_c9c0_28dd),
    ("cart_pole", "gauss16", 1.0 / 64.0, None, 3.0, 0x68fd_f759_0216_66d1),
    ("quick_return", "rattle4", 1.0 / 2048.0, None, 1.0, 0x0aa5_bece_66cf_3919),
    ("kite", "dp8", 1e-9, None, 1.0, 0xd3ec_18b1_b364_6223),
];

/// FNV-1a over the bytes of doubles.
fn hash(numbers: impl Iterator<Item = f64>) -> u64 {
    numbers
        .flat_map(f64::to_le_bytes)
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// Which code is entered.
struct Entered;

impl Code for Entered {
    type Output = &'static str;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        std::any::type_name::<L>()
    }
}

/// The first time with the processor's vectors, where it has them, the second time in portable code.
#[test]
fn ends_have_the_bits_they_always_had() {
    let is_portable = || lanes::run(Entered, false).ends_with("Portable");
    assert_eq!(is_portable(), lanes::hardware().is_none());
    ends();
    lanes::disable(true);
    assert!(is_portable() && lanes::hardware().is_none());
    ends();
    lanes::disable(false);
}

fn ends() {
    let mut changed = Vec::new();
    for &(name, method, setting, stabilize, until, expected) in ENDS {
        let scene = Scene { until, every: until / 4.0, ..shipped(name, &[]) };
        let method = method.parse().expect("a method");
        let mut request = Request { method: Some(method), stabilize, ..Request::default() };
        if method.is_adaptive() {
            request.rtol = Some(setting)
        } else {
            request.step = Some(setting)
        }
        let outcome = run(&scene, &request);
        assert_eq!(outcome.stop, None, "{name}, {method}");
        let last = &outcome.last;
        let found = hash(last.phi.iter().chain(&last.omega).chain([&last.work, &last.imbalance]).copied());
        if found != expected {
            changed.push(format!("    {name}, {method}: 0x{found:016x}"));
        }
    }
    assert!(changed.is_empty(), "changed:\n{}", changed.join("\n"));
}

/// What the program writes: `.ci/bits release` compares the same trajectories of a release build.
#[cfg(feature = "cli")]
#[test]
fn trajectories_have_the_bytes_they_always_had() {
    let lines = include_str!("data/trajectories.sha256")
        .lines()
        .map(|line| line.split_once(' ').expect("a hash and a run"));
    let mut changed = Vec::new();
    for (hash, line) in lines {
        let (name, _) = line.split_once(".json").expect("a scene");
        let program = program::Program::with_scenes(&[name]);
        program.run(&format!("run {line} --out out --quiet --no-charts --trust off")).exits(0);
        let files = program.files();
        let record = files.iter().find(|file| file.ends_with("run.json")).expect("a record");
        let record: serde_json::Value = serde_json::from_str(&program.read(record)).expect("JSON");
        if record["hashes"]["trajectory_sha256"] != hash {
            changed.push(format!("{} {line}", record["hashes"]["trajectory_sha256"]));
        }
    }
    assert!(changed.is_empty(), "changed:\n{}", changed.join("\n"));
}
