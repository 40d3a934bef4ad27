//! Stiff springs: what an error of 1e-6 costs on a spring that swings, and what stiffness costs on one that
//! is damped.
//!
//! `cargo bench --no-default-features --bench stiff`: methods in turns in one process; microseconds per
//! simulated second (minimum and median), the error of angles at t = 1 s against `taylor` at 1e-14, and the
//! ratio to the first line, `dop853` of the crate `ode_solvers`, round by round.

use driftless::dynamics::Mechanism;
use driftless::run::{Limits, MethodId, Outcome, Plan, Request, Run, integrate};
use driftless::scene::{Scene, read_scene};
use std::path::Path;
use std::sync::Arc;

const ROUNDS: usize = 15;

/// The pendulum on its spring with another stiffness \[times the source's\] and damping \[N·s/m\], from where
/// the spring has its free length.
fn sprung(factor: f64, damping: f64, stretch: f64) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/spring.json");
    let mut scene = read_scene(&folder, &[]).expect("a valid scene");
    (scene.springs[0].stiffness, scene.springs[0].damping) = (7.394_287_5 * factor, damping);
    (scene.start[0].phi, scene.start[1].phi) =
        (1.955_193_101_290_539_7 + stretch, std::f64::consts::FRAC_PI_2);
    (scene.until, scene.every) = (1.0, 1.0);
    scene
}

fn run(scene: &Scene, mechanism: &Arc<Mechanism>, method: MethodId, setting: f64) -> Outcome {
    let setting = if method.is_adaptive() { (Some(setting), None) } else { (None, Some(setting)) };
    let request = Request { method: Some(method), rtol: setting.0, step: setting.1, ..Request::default() };
    let plan = Plan::new(scene, mechanism, &request).expect("a plan");
    let run = Run::new(Arc::clone(mechanism), plan, Limits::default(), &mechanism.start(scene))
        .expect("a beginning");
    integrate(run, &mut |_| Ok(())).expect("an end")
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn compare(title: &str, scene: &Scene, candidates: &[(MethodId, f64)]) {
    let mechanism = Arc::new(Mechanism::new(scene).expect("equations"));
    let reference = run(scene, &mechanism, MethodId::Taylor, 1e-14).last;
    let mut times = vec![Vec::new(); candidates.len()];
    let mut ends = Vec::new();
    for round in 0..ROUNDS {
        for (times, &(method, setting)) in times.iter_mut().zip(candidates) {
            let outcome = run(scene, &mechanism, method, setting);
            times.push(outcome.wall.as_secs_f64() * 1e6);
            if round == 0 {
                ends.push(outcome);
            }
        }
    }
    println!("{title}\n  method  setting     steps  evaluations    min µs  median µs  ratio    error");
    for ((&(method, setting), own), outcome) in candidates.iter().zip(&times).zip(&ends) {
        let error = outcome
            .last
            .phi
            .iter()
            .zip(&reference.phi)
            .fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
        let least = own.iter().copied().fold(f64::INFINITY, f64::min);
        let ratio = median(own.iter().zip(&times[0]).map(|(own, first)| own / first).collect());
        let (steps, evaluations) = (outcome.statistics.steps, outcome.statistics.evaluations);
        println!(
            "  {method:8} {setting:8.1e} {steps:7} {evaluations:12} {least:9.0} {:10.0} {ratio:6.2} {error:8.1e}",
            median(own.clone())
        );
        if let Some(stop) = &outcome.stop {
            println!("    {stop}");
        }
    }
}

fn main() {
    let swinging = [
        (MethodId::Dop853, 1e-6),
        (MethodId::Dop853, 1e-5),
        (MethodId::Dop853, 1e-8),
        (MethodId::Dp8, 1e-6),
        (MethodId::Taylor, 1e-4),
        (MethodId::Taylor, 1e-5),
        (MethodId::Taylor, 1e-6),
        (MethodId::Taylor, 1e-9),
        (MethodId::Gauss(8), 1.0 / 4096.0),
        (MethodId::Radau(5), 1e-6),
    ];
    compare(
        "1e6 times the stiffness, swinging, from rest at its free length",
        &sprung(1e6, 0.0, 0.0),
        &swinging,
    );
    compare("the same, 1e-3 rad off", &sprung(1e6, 0.0, 1e-3), &swinging);
    for power in [3, 6, 9, 12] {
        let factor = 10_f64.powi(power);
        let damped = [(MethodId::Radau(3), 1e-6), (MethodId::Radau(5), 1e-6), (MethodId::Radau(5), 1e-9)];
        compare(
            &format!("1e{power} times the stiffness, damped"),
            &sprung(factor, 0.6675 * factor.sqrt(), 0.0),
            &damped,
        );
    }
}
