//! Integrates a scene as the playground does, without a browser: `native SCENE SECONDS` prints the time it
//! took in milliseconds.

use driftless_playground::Playground;
use std::time::Instant;

fn main() -> Result<(), String> {
    let [scene, seconds] = [1, 2].map(|place| std::env::args().nth(place).unwrap_or_default());
    let text = std::fs::read_to_string(&scene).map_err(|error| format!("{scene}: {error}"))?;
    let seconds: u32 = seconds.parse().map_err(|_| "native SCENE SECONDS".to_owned())?;
    let (mut playground, _) = Playground::new(&text)?;
    let begin = Instant::now();
    playground.advance(64 * seconds)?;
    println!("{:.1} ms for {} s", 1e3 * begin.elapsed().as_secs_f64(), playground.time());
    Ok(())
}
