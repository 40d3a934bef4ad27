//! Steps of fixed-step methods, and how fast a scene moves at most.

use super::{Request, RequestRefusal, is_whole, usage};
use crate::arithmetic::shown::order;
use crate::dynamics::Mechanism;
use crate::dynamics::kernel::Kernel;
use crate::run::methods::MethodId;
use crate::scene::Scene;

/// The step, and the output interval brought onto the steps.
pub(super) fn fixed_step(
    method: MethodId,
    request: &Request,
    rate: f64,
    until: f64,
    every: &mut f64,
    notes: &mut Vec<String>,
) -> Result<f64, RequestRefusal> {
    let Some(asked) = request.step else {
        let share = match method {
            MethodId::Gauss(stages) => 0.015 * stages as f64,
            MethodId::Rattle(composition) => 0.01 * f64::from(composition.order()),
            _ => 0.01,
        };
        let intervals = (until / *every).round().max(1.0);
        let whole = (until / *every - intervals).abs() <= 1e-9 * intervals;
        if !whole {
            *every = until / (until / *every).ceil();
            notes.push(format!(
                "the output interval is {every} s, so that the fixed steps end on the horizon"
            ));
        }
        // Halves of the output interval are exact, so that its multiples are met to the last bit.
        let halvings = libm::log2(*every * rate / share).round().max(0.0);
        return Ok(*every / libm::exp2(halvings));
    };
    if asked > until * (1.0 + 1e-9) {
        return Err(usage(
            "--step",
            format!("{asked} s is longer than the horizon, {until} s"),
            "a shorter step",
        ));
    }
    let step = if is_whole(until, asked) { asked } else { until / (until / asked).ceil() };
    if step != asked {
        notes.push(format!(
            "the step is {step} s instead of {asked} s, so that whole steps end on the horizon"
        ));
    }
    let stride = (*every / step).round().max(1.0);
    if (stride * step - *every).abs() > 1e-9 * *every {
        notes.push(format!("the output interval is {} s instead of {every} s: whole steps", stride * step));
    }
    *every = stride * step;
    Ok(step)
}

/// An upper estimate of the fastest rate of the scene \[rad/s\]: what the energy at the start allows the
/// lightest part, gravity, springs and motors.
pub(super) fn fastest_rate(scene: &Scene, mechanism: &Mechanism) -> f64 {
    let start = mechanism.start(scene);
    let [phi, omega] = start.rounded();
    let mut kernel = Kernel::<f64>::new(mechanism);
    let energy = mechanism.energy(&mut kernel, &phi, &omega);
    kernel.factor::<0>(mechanism, &omega);
    // The mobility of an origin along its way counts as that of a turn at the unit of length.
    let unit = |k: usize| if k < mechanism.bodies.len() { 1.0 } else { mechanism.units.length };
    let lightest = kernel
        .pivot
        .iter()
        .enumerate()
        // The rotors of integrals take no energy from the others.
        .filter(|(k, _)| !(mechanism.own_bodies().len()..mechanism.bodies.len()).contains(k))
        .fold(0.0, |most: f64, (k, &pivot)| most.max(pivot / (unit(k) * unit(k))));
    let gravity: f64 = mechanism.tree.weight[..mechanism.bodies.len()]
        .iter()
        .map(|weight| weight.norm_squared().sqrt())
        .sum();
    let available = (energy.total() - mechanism.ground_energy + gravity).max(0.0);
    let springs: f64 = mechanism
        .springs
        .iter()
        .map(|spring| {
            spring.stiffness * spring.span.terms.iter().map(|term| term.1.norm_squared()).sum::<f64>()
        })
        .sum();
    let drives: f64 = scene
        .motors
        .iter()
        .map(|motor| {
            motor.law.rate.abs()
                + motor.law.profile.as_ref().map_or(0.0, |profile| profile.peaks()[0])
                + motor
                    .law
                    .sines
                    .iter()
                    .map(|sine| sine.frequency.abs() * (1.0 + sine.amplitude.abs()))
                    .sum::<f64>()
        })
        .sum();
    let spinning = omega.iter().fold(0.0, |most: f64, omega| most.max(omega.abs()));
    (((2.0 * available + gravity + springs) * lightest).sqrt()).max(spinning).max(1e-3 / mechanism.units.time)
        + drives
}

/// What rods instead of stiff springs may do to an angle \[rad\], about: a vibration acts by its mean up to
/// the first order of slow over fast, a stretch that does not vibrate is of the second.  What grows in the
/// motion grows with it.
pub(super) fn model_error(mechanism: &Mechanism, rate: f64, notes: &mut Vec<String>) -> Option<f64> {
    let share = rate / mechanism.rigid_rate?;
    let error = if mechanism.vibration.is_some() { 2.0 * share } else { share * share };
    notes.push(format!(
        "rigid springs are a model: angles may be off by about {} rad, whatever the tolerance, and more \
            where errors grow",
        order(error)
    ));
    Some(error)
}
