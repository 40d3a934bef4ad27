//! The free double pendulum, released from horizontal: its angles over ten seconds.
//!
//! `cargo run --example trajectory` writes `output/free_angles.png`.

use driftless::dynamics::Mechanism;
use driftless::report::charts::{Chart, draw};
use driftless::run::{MethodId, Request, simulate};
use driftless::scene::read_scene;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all("output")?;
    let scene = read_scene("examples/scenes/free.json".as_ref(), &[])?;
    let request = Request { method: Some(MethodId::Dop853), rtol: Some(1e-10), ..Request::default() };
    let outcome = simulate(&scene, &request, &mut |_| Ok(()))?;
    println!("{} steps, {} evaluations", outcome.statistics.steps, outcome.statistics.evaluations);
    println!("energy drifted by {:.1e} of its scale", outcome.drift.energy.max);
    draw(Chart::Angles, &scene, &Mechanism::new(&scene)?, &outcome)?
        .write("output/free_angles.png".as_ref())?;
    Ok(())
}
