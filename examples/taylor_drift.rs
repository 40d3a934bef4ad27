//! Energy drift of the Taylor method on `free`: mean, its standard error, and root mean square over starts a
//! little apart.
//!
//! `cargo run --release --example taylor_drift -- [SECONDS [STARTS [TOLERANCE]]] [extended]`; energies in
//! double-double, divided by the scene's energy scale.

use driftless::arithmetic::DoubleDouble;
use driftless::dynamics::elimination::Elimination;
use driftless::dynamics::kernel::Kernel;
use driftless::dynamics::{Mechanism, Motion, Time};
use driftless::run::Problem;
use driftless::scene::read_scene;
use driftless::stepping::{Integrator, Seen, Taylor};
use std::sync::Arc;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (settings, numbers): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|word| word == "extended");
    let numbers: Vec<f64> = numbers.iter().map(|word| word.parse()).collect::<Result<_, _>>()?;
    let extended = !settings.is_empty();
    let until = numbers.first().copied().unwrap_or(1e4);
    let starts = numbers.get(1).map_or(16, |&count| count as usize);
    let tolerance = numbers.get(2).copied().unwrap_or(if extended { 1e-21 } else { 1e-19 });
    let times: Vec<f64> = (0..)
        .map(|i| 10f64.powf(3.0 + 0.5 * f64::from(i)))
        .take_while(|&t| t < 0.99 * until)
        .chain([until])
        .collect();
    let mut errors = vec![Vec::new(); times.len()];
    let begin = Instant::now();
    for start in 0..starts {
        let mut scene = read_scene("examples/scenes/free.json".as_ref(), &[])?;
        scene.start[1].phi += 1e-3 * start as f64;
        let mechanism = Arc::new(Mechanism::new(&scene)?);
        let problem: &mut dyn Problem = &mut Elimination::<0>::new(Arc::clone(&mechanism));
        let mut state = problem.state(&mechanism.start(&scene));
        let mut method = Taylor::<f64>::with_order(tolerance, 24);
        method.extended = extended;
        let mut kernel = Kernel::<DoubleDouble>::without_rows(&mechanism);
        let mut energy = |problem: &mut dyn Problem, state: &_| {
            let mut motion = Motion::default();
            problem.read(state, &mut motion);
            mechanism.energy(&mut kernel, &motion.phi, &motion.omega).total()
        };
        let first = energy(problem, &state);
        for (&time, errors) in times.iter().zip(&mut errors) {
            method.advance(problem, &mut state, Time::from(time), &mut Default::default(), &mut |_, _| {
                Ok(Seen::Kept)
            })?;
            errors.push((energy(problem, &state) - first).hi / mechanism.energy_scale);
        }
    }
    let spent = begin.elapsed().as_secs_f64();
    println!("{:>9} {:>10} {:>10} {:>10}", "t [s]", "mean", "its error", "rms");
    for (time, errors) in times.iter().zip(&errors) {
        let count = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / count;
        let square = errors.iter().map(|error| error * error).sum::<f64>() / count;
        let deviation = ((square - mean * mean).max(0.0) * count / (count - 1.0).max(1.0)).sqrt();
        println!("{time:9.0} {mean:10.2e} {:10.2e} {:10.2e}", deviation / count.sqrt(), square.sqrt());
    }
    println!("{:.1} us per simulated second", spent * 1e6 / (until * starts as f64));
    Ok(())
}
