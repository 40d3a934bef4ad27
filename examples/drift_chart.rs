//! Energy over a long run by five methods: what climbs, and what does not.
//!
//! `cargo run --release --example drift_chart` marches the free double pendulum for 1000 s (give another horizon as the first argument) and
//! writes `output/energy_drift.png`.

use driftless::chart::{DriftSeries, EnergyDrift, FILE_RESOLUTION, energy_drift};
use driftless::run::{MethodId, Request, simulate};
use driftless::scene::read_scene;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let until = std::env::args().nth(1).map_or(Ok(1000.0), |until| until.parse::<f64>())?;
    let scene = read_scene("examples/scenes/free.json".as_ref(), &[])?;
    let step = |name: &str, step| {
        Ok::<_, String>((Request { method: Some(name.parse::<MethodId>()?), step: Some(step), ..Request::default() }, "1/128 s"))
    };
    let adaptive =
        |name: &str| Ok::<_, String>((Request { method: Some(name.parse()?), rtol: Some(1e-10), ..Request::default() }, "10^{−10}"));
    let runs = [
        adaptive("dopri5")?,
        adaptive("dop853")?,
        step("rattle4", 1.0 / 128.0)?,
        step("gauss8", 1.0 / 128.0)?,
        step("gauss16", 1.0 / 128.0)?,
    ];
    let mut series = Vec::new();
    for (request, setting) in runs {
        let request = Request { until: Some(until), every: Some(1.0 / 16.0), ..request };
        let outcome = simulate(&scene, &request, &mut |_| Ok(()))?;
        let energy = &outcome.drift.energy;
        println!("{:8} largest {:.1e}, slope {:+.1e} per s", outcome.plan.method, energy.max, energy.slope());
        let (time, error) = energy.record.iter().map(|&[t, error]| (t, error)).unzip();
        let method = outcome.plan.method.to_string();
        series.push(DriftSeries { name: format!("{method}, {setting}"), method, time, error });
    }
    let chart = EnergyDrift {
        title: "Energy drift: symplectic methods do not climb".into(),
        caption: vec!["scene free, released from π/2".into(), "largest |Δ*E*| so far over 2*mgl*, evaluated in double-double".into()],
        quantity: "energy".into(),
        series,
        log_time: true,
    };
    energy_drift(&chart, FILE_RESOLUTION)?.write("output/energy_drift.png".as_ref())?;
    Ok(())
}
