//! When does a double pendulum released at rest first turn one of its bars over?  A map over both starting
//! angles.
//!
//! `cargo run --release --example flip_times -- [STARTS [SECONDS]]` takes STARTS × STARTS of them (128; the
//! picture in the README has 512) and writes `output/flip_times.png`.

use driftless::chart::{Cell, FILE_RESOLUTION, Map, MapAxis, map};
use driftless::run::{Request, Status, Sweep, SweepPoint, Vary, sweep};
use driftless::scene::Template;
use std::f64::consts::PI;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all("output")?;
    let number = |place: usize, default: f64| {
        std::env::args().nth(place).map_or(Ok(default), |text| text.parse::<f64>())
    };
    let (starts, until) = (number(1, 128.0)?, number(2, 30.0)?);
    // Starts in the middles of cells that fill the square.
    let edge = PI * (1.0 - 1.0 / starts);
    let vary = |bar: &str| Vary { name: format!("{bar}.phi"), from: -edge, to: edge, count: starts as u64 };
    let template = Template::read("examples/scenes/free.json".as_ref(), &[])?;
    let request = Request { until: Some(until), every: Some(until), rtol: Some(1e-9), ..Request::default() };
    // V = -m g l (3 cos phi1 + cos phi2)/2: of the configurations with a bar upright the lowest has the first
    // hanging and the second up, V = -m g l.
    let is_too_low = |phi: &[f64]| 3.0 * phi[0].cos() + phi[1].cos() > 2.0;
    let plan = Sweep::new(&template, vec![vary("bar1"), vary("bar2")], &request)?
        .ending_at_flips()
        .without(is_too_low);
    let mut cells = Vec::new();
    let totals = sweep(&plan, 0, &mut |point: &SweepPoint| {
        cells.push(match (&point.status, point.flip) {
            (Status::Skipped, _) => Cell::Excluded,
            (_, Some(flip)) => Cell::Value(flip.t),
            (Status::Done, None) => Cell::Never,
            _ => Cell::Failed,
        });
        Ok(())
    })?;
    println!(
        "{} starts: {} turn over within {until} s, {} have too little energy",
        plan.grid().count(),
        totals.flipped,
        totals.skipped
    );
    println!("{} steps in {:.1} s on {} threads", totals.steps, totals.wall.as_secs_f64(), totals.threads);
    let axis = |name: &str| MapAxis {
        name: format!("{name} at the start [rad]"),
        from: -edge,
        to: edge,
        count: starts as usize,
        log: false,
    };
    let chart = Map {
        title: "Time until a bar of the double pendulum first turns over".into(),
        caption: vec![
            "scene free, released at rest".into(),
            format!("{starts} × {starts} starts"),
            "taylor, tolerance 1e-9".into(),
        ],
        x: axis("*φ*_{1}"),
        y: axis("*φ*_{2}"),
        cells,
        value: "flip time [s]".into(),
        log: true,
        dark_high: true,
        range: Some([0.2, until]),
        words: [format!("not within {until} s"), "too little energy".into(), "stopped".into()],
    };
    map(&chart, FILE_RESOLUTION)?.write("output/flip_times.png".as_ref())?;
    Ok(())
}
