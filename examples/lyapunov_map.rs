//! Where is a bar that hangs on a motor-driven bar chaotic?  A map of the largest Lyapunov exponent over the
//! motor's rate and the amplitude of the sine on top of it.
//!
//! `cargo run --release --example lyapunov_map -- [POINTS [SECONDS]]` takes POINTS × POINTS motors (24) for
//! SECONDS each (60) and writes `output/lyapunov_map.png`.

use driftless::chart::{Cell, FILE_RESOLUTION, Map, MapAxis, map};
use driftless::run::lyapunov;
use driftless::scene::Template;
use std::thread;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all("output")?;
    let number = |place: usize, default: f64| {
        std::env::args().nth(place).map_or(Ok(default), |text| text.parse::<f64>())
    };
    let (points, until) = (number(1, 24.0)?.max(2.0) as usize, number(2, 60.0)?);
    let template = Template::read("examples/scenes/motor_sine.json".as_ref(), &[])?;
    let variables =
        [template.variable("motor.rate")?, template.variable("motors.motor.law.sines[0].amplitude")?];
    let axis =
        |name: &str, from: f64, to: f64| MapAxis { name: name.into(), from, to, count: points, log: false };
    let axes = [axis("rate of the motor [rad/s]", 2.0, 10.0), axis("amplitude of the sine [rad]", 0.0, 1.0)];
    let value = |axis: &MapAxis, i: usize| axis.from + (axis.to - axis.from) * i as f64 / (points - 1) as f64;
    let exponent = |cell: usize| {
        let values = [value(&axes[0], cell / points), value(&axes[1], cell % points)];
        let spectrum =
            lyapunov(&template.with_values(&variables, &values), Some(until), Some(1e-9), &mut || false);
        spectrum.ok().and_then(|found| found.exponents.first().copied())
    };
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let mut exponents = vec![None; points * points];
    thread::scope(|scope| {
        let share = exponents.len().div_ceil(threads);
        for (part, found) in exponents.chunks_mut(share).enumerate() {
            let exponent = &exponent;
            scope.spawn(move || {
                for (i, found) in found.iter_mut().enumerate() {
                    *found = exponent(part * share + i);
                }
            });
        }
    });
    let chaotic = exponents.iter().flatten().filter(|&&exponent| exponent > 0.3).count();
    println!("{} motors: {chaotic} with an exponent above 0.3 per second", exponents.len());
    let [x, y] = axes;
    let chart = Map {
        title: "Largest Lyapunov exponent of the driven double pendulum".into(),
        caption: vec![
            "scene motor_sine".into(),
            format!("{points} × {points} motors"),
            format!("{until} s each"),
        ],
        x,
        y,
        cells: exponents.iter().map(|found| found.map_or(Cell::Failed, Cell::Value)).collect(),
        value: "exponent [1/s]".into(),
        log: false,
        dark_high: true,
        range: None,
        words: ["none".into(), "left out".into(), "stopped".into()],
    };
    map(&chart, FILE_RESOLUTION)?.write("output/lyapunov_map.png".as_ref())?;
    Ok(())
}
