//! One motor scene, its start 1e-6 rad/s off, under four stabilizations: what each leaves of the constraint,
//! and what it does to the energy.
//!
//! `cargo run --release --example stabilizations` integrates 100 s (give another horizon as the first
//! argument) and writes `output/constraint_drift.png`.

use driftless::arithmetic::DoubleDouble;
use driftless::chart::{ConstraintDrift, DriftSeries, FILE_RESOLUTION, ResidualPanel, constraint_drift};
use driftless::dynamics::Mechanism;
use driftless::run::{Limits, MethodId, Outcome, Plan, Request, Run, Stabilization, integrate};
use driftless::scene::read_scene;
use std::sync::Arc;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all("output")?;
    let until = std::env::args().nth(1).map_or(Ok(100.0), |until| until.parse::<f64>())?;
    let scene = read_scene("examples/scenes/motor_sine.json".as_ref(), &[])?;
    let mechanism = Arc::new(Mechanism::new(&scene)?);
    // From a consistent start even the plain run keeps so simple a row to rounding, and would prove nothing.
    let mut start = mechanism.start(&scene);
    start.omega[0] += DoubleDouble::from(1e-6);
    let mut outcomes = Vec::new();
    println!("{:12} {:>10} {:>10} {:>10} {:>14}", "", "|C| rad", "slope /s", "|C'| rad/s", "stabilizer J");
    for stabilize in Stabilization::ALL {
        let request = Request {
            method: Some(MethodId::Dp8),
            stabilize: Some(stabilize),
            until: Some(until),
            ..Request::default()
        };
        let plan = Plan::new(&scene, &mechanism, &request)?;
        let outcome =
            integrate(Run::new(mechanism.clone(), plan, Limits::default(), &start)?, &mut |_| Ok(()))?;
        let [position, velocity] = &outcome.drift.constraints[0].1;
        let figures = [position.max, position.slope(), velocity.max];
        println!(
            "{stabilize:12} {:10.1e} {:10.1e} {:10.1e} {:14.1e}",
            figures[0], figures[1], figures[2], outcome.drift.stabilizer
        );
        outcomes.push(outcome);
    }
    let chart = ConstraintDrift {
        title: "Constraint drift under four stabilizations".into(),
        caption: vec!["scene motor\\_sine, start 10^{−6} rad/s off".into(), "dp8, 10^{−9}".into()],
        panels: vec![
            panel(0, "residual |*C*| [rad]", &outcomes),
            panel(1, "its rate |*C′*| [rad/s]", &outcomes),
        ],
        log_time: true,
    };
    constraint_drift(&chart, FILE_RESOLUTION)?.write("output/constraint_drift.png".as_ref())?;
    Ok(())
}

/// Violation of the motor's row at one level, one line a stabilization.
fn panel(level: usize, name: &str, outcomes: &[Outcome]) -> ResidualPanel {
    let series = outcomes.iter().map(|outcome| {
        let samples = outcome.trace.whole.iter().filter(|sample| sample.t > 0.0);
        let (time, error) = samples.map(|sample| (sample.t, sample.constraints[0][level])).unzip();
        let name = outcome.plan.stabilization.to_string();
        DriftSeries { method: name.clone(), name, time, error }
    });
    ResidualPanel { name: name.into(), series: series.collect() }
}
