//! Case f: the end of the second bar meets a wall at once, with three restitutions.
//!
//! `cargo run --example wall` prints impulse and loss of the first impact and writes `output/wall.png`.

use driftless::dynamics::Mechanism;
use driftless::report::charts::{Chart, draw};
use driftless::run::{Request, simulate};
use driftless::scene::read_scene;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all("output")?;
    for restitution in [0.0, 0.5, 1.0] {
        let set = format!("walls.wall.restitution={restitution}").parse()?;
        let scene = read_scene("examples/scenes/wall.json".as_ref(), &[set])?;
        let outcome = simulate(&scene, &Request { until: Some(3.0), ..Request::default() }, &mut |_| Ok(()))?;
        let first = &outcome.impacts[0];
        println!(
            "e = {restitution}: impulse {:.6} N s, {:.6} J lost at once; {} impacts in {} s; energy balance kept to {:.1e}",
            first.impulse, first.energy_lost, outcome.impact_count, outcome.last.t, outcome.drift.energy.max
        );
        if restitution == 0.5 {
            draw(Chart::Mechanism, &scene, &Mechanism::new(&scene)?, &outcome)?
                .write("output/wall.png".as_ref())?;
        }
    }
    Ok(())
}
