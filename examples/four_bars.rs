//! N four-bars side by side (IFToMM benchmark A02): N + 1 uprights and N couplers of 1 m and 1 kg, which pass
//! twice a turn through positions in which all of them lie in line.
//!
//! `cargo run --release --example four_bars -- [N]` prints the scene (N = 2 is
//! `examples/scenes/four_bars.json`).

use driftless::scene::{Bar, Hinge, Place, Scene, Start};
use std::f64::consts::FRAC_PI_2;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let n: usize = std::env::args().nth(1).map_or(Ok(2), |count| count.parse())?;
    println!("{}", serde_json::to_string_pretty(&scene(n).to_input())?);
    Ok(())
}

/// The scene of N four-bars.
pub fn scene(n: usize) -> Scene {
    let bar = |name: String| Bar { name, length: 1.0, mass: 1.0, centre: [0.5, 0.0], inertia: 1.0 / 12.0 };
    let root = |bar| Place { bar: Some(bar), point: [0.0, 0.0] };
    let tip = |bar| Place { bar: Some(bar), point: [1.0, 0.0] };
    // The uprights are bars 0 to N, the couplers follow.
    let coupler = |i: usize| n + 1 + i;
    let translations = (0..=n).map(|i| {
        let ground = Place { bar: None, point: [i as f64, 0.0] };
        Hinge { name: format!("A{i}"), between: [ground, root(i)] }
    });
    let tops = (0..n).flat_map(|i| {
        let left = Hinge { name: format!("B{i}"), between: [tip(i), root(coupler(i))] };
        let right = Hinge { name: format!("D{i}"), between: [tip(coupler(i)), tip(i + 1)] };
        [left, right]
    });
    Scene {
        name: format!("four_bars_{n}"),
        description: format!(
            "{n} four-bars side by side pass through positions in which all links lie in line (IFToMM benchmark A02)."
        ),
        gravity: [0.0, -9.81],
        bars: (0..=n).map(|i| bar(format!("U{i}"))).chain((0..n).map(|i| bar(format!("C{i}")))).collect(),
        hinges: translations.chain(tops).collect(),
        start: (0..=n)
            .map(|_| Start { phi: FRAC_PI_2, omega: -1.0 })
            .chain((0..n).map(|_| Start { phi: 0.0, omega: 0.0 }))
            .collect(),
        until: 10.0,
        every: 0.01,
        ..Scene::default()
    }
}
