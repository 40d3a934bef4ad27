//! Case g: what the hinges carry over one turn of the motor, from the accelerations alone.
//!
//! `cargo run --example hinge_forces` prints a table and writes `output/hinge_forces.csv`.

use driftless::dynamics::kernel::{Bias, Kernel};
use driftless::dynamics::{Mechanism, Time};
use driftless::run::{Request, simulate};
use driftless::scene::read_scene;
use std::fmt::Write;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all("output")?;
    let scene = read_scene("examples/scenes/motor.json".as_ref(), &[])?;
    let mechanism = Mechanism::new(&scene)?;
    let mut kernel = Kernel::<f64>::new(&mechanism);
    let mut table = String::from("t [s],A.x [N],A.y [N],B.x [N],B.y [N]\n");
    simulate(
        &scene,
        &Request { until: Some(1.0), every: Some(0.05), ..Request::default() },
        &mut |sample| {
            kernel.accelerations(
                &mechanism,
                Time::from(sample.t),
                &sample.phi,
                &sample.omega,
                Bias::default(),
            );
            let forces = mechanism.hinge_forces(Time::from(sample.t), &kernel, &sample.phi, &sample.omega);
            let numbers: Vec<f64> = forces.iter().flat_map(|force| [force.re, force.im]).collect();
            println!(
                "{:4.2} s  A ({:8.4}, {:8.4}) N   B ({:8.4}, {:8.4}) N",
                sample.t, numbers[0], numbers[1], numbers[2], numbers[3]
            );
            let row: Vec<String> = std::iter::once(sample.t).chain(numbers).map(|x| x.to_string()).collect();
            writeln!(table, "{}", row.join(",")).map_err(std::io::Error::other)
        },
    )?;
    std::fs::write("output/hinge_forces.csv", table)?;
    Ok(())
}
