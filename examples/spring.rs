//! The pendulum on its spring: the path of the free end, and the mechanism in motion.
//!
//! `cargo run --example spring` writes `output/spring_mechanism.png` and `output/spring.gif`.

use driftless::chart::motion_gif;
use driftless::dynamics::Mechanism;
use driftless::report::charts::{Chart, draw, motion};
use driftless::run::{MethodId, Request, simulate};
use driftless::scene::read_scene;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all("output")?;
    let overrides = ["start.bar1.phi=2.6".parse()?, "start.bar2.phi=3.0".parse()?];
    let scene = read_scene("examples/scenes/spring.json".as_ref(), &overrides)?;
    let request = Request { method: Some(MethodId::Gauss(8)), every: Some(0.01), ..Request::default() };
    let outcome = simulate(&scene, &request, &mut |_| Ok(()))?;
    println!("energy drifted by {:.1e} of its scale", outcome.drift.energy.max);
    let mechanism = Mechanism::new(&scene)?;
    draw(Chart::Mechanism, &scene, &mechanism, &outcome)?.write("output/spring_mechanism.png".as_ref())?;
    motion_gif(&motion(&scene, &mechanism, &outcome))?.write("output/spring.gif".as_ref())?;
    Ok(())
}
