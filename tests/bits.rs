//! The same bits on every machine: the ends of shipped scenes by every kind of method, as hashes.
//!
//! A change of the arithmetic changes them; then the new ones are printed, and belong here with a word in the changelog.

mod common;

use common::{run, shipped};
use driftless::run::{Request, Stabilization};
use driftless::scene::Scene;

type End = (&'static str, &'static str, f64, Option<Stabilization>, f64, u64);

/// Scene, method, step or tolerance, stabilization, seconds, and the hash of the end.
const ENDS: &[End] = &[
    ("free", "dopri5", 1e-7, None, 3.0, 0),
    ("free", "dop853", 1e-9, None, 3.0, 0),
    ("free", "dp8", 1e-9, None, 3.0, 0),
    ("free", "taylor", 1e-12, None, 10.0, 0),
    ("gentle", "gauss16", 1.0 / 64.0, None, 10.0, 0),
    ("spring", "dp5", 1e-8, None, 3.0, 0),
    ("spring", "taylor", 1e-10, None, 3.0, 0),
    ("motor", "taylor", 1e-9, Some(Stabilization::Elimination), 10.0, 0),
    ("motor_sine", "dp8", 1e-9, Some(Stabilization::Projection), 3.0, 0),
    ("motor_sine", "gauss8", 1.0 / 128.0, None, 3.0, 0),
    ("motor_sine", "rattle6", 1.0 / 128.0, None, 3.0, 0),
    ("wall", "dp8", 1e-10, None, 3.0, 0),
    ("chain8", "dp8", 1e-8, None, 1.0, 0),
    ("branch", "taylor", 1e-10, None, 3.0, 0),
    ("andrews", "taylor", 1e-10, None, 0.03, 0),
    ("andrews", "dp8", 1e-9, None, 0.03, 0),
    ("four_bars", "taylor", 1e-10, None, 5.0, 0),
    ("cart_pole", "gauss16", 1.0 / 64.0, None, 3.0, 0),
    ("quick_return", "rattle4", 1.0 / 2048.0, None, 1.0, 0),
    ("kite", "dp8", 1e-9, None, 1.0, 0),
];

/// FNV-1a over the bytes of doubles.
fn hash(numbers: impl Iterator<Item = f64>) -> u64 {
    numbers.flat_map(f64::to_le_bytes).fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[test]
fn ends_have_the_bits_they_always_had() {
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
