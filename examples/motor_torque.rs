//! What the motor has to give: torque and power while it turns the first bar once a second.
//!
//! `cargo run --example motor_torque` writes `output/motor_torque.png` and `output/motor_mechanism.png`.

use driftless::dynamics::Mechanism;
use driftless::report::charts::{Chart, draw};
use driftless::run::{Request, simulate};
use driftless::scene::read_scene;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all("output")?;
    let scene = read_scene("examples/scenes/motor.json".as_ref(), &[])?;
    let request = Request { until: Some(6.0), every: Some(0.01), ..Request::default() };
    let mut peak = [0.0, 0.0];
    let outcome = simulate(&scene, &request, &mut |sample| {
        if sample.motors[0][0].abs() > f64::abs(peak[1]) {
            peak = [sample.t, sample.motors[0][0]];
        }
        Ok(())
    })?;
    println!("largest torque {:.3} N m at {:.2} s; work done {:.4} J", peak[1], peak[0], outcome.last.work);
    let mechanism = Mechanism::new(&scene)?;
    draw(Chart::TorquePower, &scene, &mechanism, &outcome)?.write("output/motor_torque.png".as_ref())?;
    draw(Chart::Mechanism, &scene, &mechanism, &outcome)?.write("output/motor_mechanism.png".as_ref())?;
    Ok(())
}
