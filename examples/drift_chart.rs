//! Energy over a long run by six methods: which climb, and which stay where they are.
//!
//! `cargo run --release --example drift_chart` integrates the free double pendulum for 1000 s (give another
//! horizon as the first argument) and writes `output/energy_drift.png`.

use driftless::chart::{DriftSeries, EnergyDrift, FILE_RESOLUTION, energy_drift};
use driftless::run::{Request, simulate};
use driftless::scene::read_scene;

/// Integrator, fixed step \[s\] or tolerance, and its words in the chart.
const RUNS: [(&str, Setting, &str); 6] = [
    ("dopri5", Setting::Tolerance(1e-10), "10^{−10}"),
    ("dop853", Setting::Tolerance(1e-10), "10^{−10}"),
    ("rattle6", Setting::Step(1.0 / 256.0), "1/256 s"),
    ("gauss8", Setting::Step(1.0 / 128.0), "1/128 s"),
    ("gauss16", Setting::Step(1.0 / 128.0), "1/128 s"),
    ("taylor", Setting::Tolerance(1e-15), "10^{−15}"),
];

enum Setting {
    Step(f64),
    Tolerance(f64),
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all("output")?;
    let until = std::env::args().nth(1).map_or(Ok(1000.0), |until| until.parse::<f64>())?;
    let scene = read_scene("examples/scenes/free.json".as_ref(), &[])?;
    let mut series = Vec::new();
    for (method, setting, words) in RUNS {
        let request = Request {
            method: Some(method.parse()?),
            until: Some(until),
            every: Some(1.0 / 16.0),
            ..Request::default()
        };
        let request = match setting {
            Setting::Step(step) => Request { step: Some(step), ..request },
            Setting::Tolerance(rtol) => Request { rtol: Some(rtol), ..request },
        };
        let energy = simulate(&scene, &request, &mut |_| Ok(()))?.drift.energy;
        println!("{method:8} largest {:.1e}, slope {:+.1e} per s", energy.max, energy.slope());
        let (time, error) = energy.record.iter().map(|&[t, error]| (t, error)).unzip();
        series.push(DriftSeries { method: method.into(), name: format!("{method}, {words}"), time, error });
    }
    let chart = EnergyDrift {
        title: format!("Energy drift over {until} s: gauss16 stays below rounding"),
        caption: vec![
            "scene free, released from π/2".into(),
            "largest |Δ*E*| so far over 2*mgl*, evaluated in double-double".into(),
        ],
        quantity: "energy".into(),
        series,
        log_time: true,
    };
    energy_drift(&chart, FILE_RESOLUTION)?.write("output/energy_drift.png".as_ref())?;
    Ok(())
}
