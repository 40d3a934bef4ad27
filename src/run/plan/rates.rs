//! Steps of fixed-step methods, how fast a scene moves at most, and what its events set in vain.

use super::{Request, RequestRefusal, is_whole, usage};
use crate::arithmetic::shown::{order, plain};
use crate::dynamics::Mechanism;
use crate::dynamics::kernel::Kernel;
use crate::run::methods::MethodId;
use crate::scene::{Law, Scene};

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
                "the output interval is {} s, so that the fixed steps end on the horizon",
                plain(*every)
            ));
        }
        // Halves of the output interval are exact, so that its multiples are met to the last bit.
        let halvings = libm::log2(*every * rate / share).round().max(0.0);
        return Ok(*every / libm::exp2(halvings));
    };
    if asked > until * (1.0 + 1e-9) {
        return Err(usage(
            "--step",
            format!("{} s is longer than the horizon, {} s", plain(asked), plain(until)),
            "a shorter step",
        ));
    }
    let step = if is_whole(until, asked) { asked } else { until / (until / asked).ceil() };
    if step != asked {
        notes.push(format!(
            "the step is {} s instead of {} s, so that whole steps end on the horizon",
            plain(step),
            plain(asked)
        ));
    }
    let stride = (*every / step).round().max(1.0);
    if (stride * step - *every).abs() > 1e-9 * *every {
        notes.push(format!(
            "the output interval is {} s instead of {} s: whole steps",
            plain(stride * step),
            plain(*every)
        ));
    }
    *every = stride * step;
    Ok(step)
}

/// An upper estimate of the fastest rate of the scene \[rad/s\]: what the energy at the start allows the
/// lightest part, gravity, springs and motors.
pub(super) fn fastest_rate(scene: &Scene, mechanism: &Mechanism) -> f64 {
    rate(scene, mechanism, [mechanism.units.length, 0.0], |_| true)
}

/// The same of what the rods of a scene (its rigid springs) hold, where there are any: floating bodies may
/// fall about them.
pub(super) fn rate_about_rods(scene: &Scene, mechanism: &Mechanism) -> Option<f64> {
    let rods = || scene.springs.iter().filter(|spring| spring.rigid);
    let shortest = rods().map(|rod| rod.free_length).reduce(f64::min)?;
    let total = rods().map(|rod| rod.free_length).sum();
    let held: Vec<usize> = rods()
        .map(|rod| mechanism.forest.point(&rod.between[0]).minus(&mechanism.forest.point(&rod.between[1])))
        .flat_map(|span| {
            let turned = span.terms.into_iter().map(|(k, _)| k);
            turned.chain(span.shifts.into_iter().flat_map(|(x, _)| [x, x + 1])).collect::<Vec<_>>()
        })
        .collect();
    Some(rate(scene, mechanism, [shortest, total], |k| held.contains(&k)))
}

/// That of the coordinates which `counts` tells. An origin moves along its way as a turn would at a length
/// \[m\]; heights of floating bodies have no zero, and they fall by twice the other length \[m\].
fn rate(
    scene: &Scene,
    mechanism: &Mechanism,
    [length, rods]: [f64; 2],
    counts: impl Fn(usize) -> bool,
) -> f64 {
    let start = mechanism.start(scene);
    let [phi, omega] = start.rounded();
    let angles = mechanism.bodies.len();
    let mut kernel = Kernel::<f64>::new(mechanism);
    let energy = mechanism.energy(&mut kernel, &phi, &omega);
    let weights = &mechanism.tree.weight;
    let height: f64 = (angles..weights.len()).map(|k| kernel.z[k].dot(weights[k])).sum();
    kernel.factor::<0>(mechanism, &omega);
    let unit = |k: usize| if k < angles { 1.0 } else { length };
    let weight = |k: usize| weights[k].norm_squared().sqrt();
    let [turning, floating]: [f64; 2] =
        [0..angles.min(weights.len()), angles..weights.len()].map(|all| all.map(weight).sum());
    let gravity = turning + floating * rods;
    let available =
        (energy.total() + height - mechanism.ground_energy + turning + 2.0 * floating * rods).max(0.0);
    // The rotors of integrals take no energy from the others.
    let is_rotor = |k: &usize| (mechanism.own_bodies().len()..angles).contains(k);
    let mobilities = (0..kernel.pivot.len()).filter(|k| !is_rotor(k) && counts(*k));
    let (lightest, swings) = mobilities.fold((0.0, 0.0), |(lightest, swings): (f64, f64), k| {
        let mobility = kernel.pivot[k] / (unit(k) * unit(k));
        let swing = if k < angles || k >= weights.len() { 0.0 } else { weight(k) * length * mobility };
        (lightest.max(mobility), swings.max(swing))
    });
    let springs: f64 = mechanism
        .springs
        .iter()
        .map(|spring| {
            let arms = spring.span.terms.iter().map(|(_, arm)| arm.norm_squared());
            let shifts = spring.span.shifts.iter().map(|(x, times)| times * times * unit(*x) * unit(*x));
            spring.stiffness * arms.chain(shifts).sum::<f64>()
        })
        .sum();
    let fastest = ((2.0 * available + gravity + springs) * lightest).max(swings).sqrt();
    let spinning = omega.iter().fold(0.0, |most: f64, omega| most.max(omega.abs()));
    fastest.max(spinning).max(1e-3 / mechanism.units.time) + drives(scene)
}

/// What the laws of motors add to a rate \[rad/s\].
fn drives(scene: &Scene) -> f64 {
    let of = |law: &Law| {
        let sines = law.sines.iter().map(|sine| sine.frequency.abs() * (1.0 + sine.amplitude.abs()));
        law.rate.abs() + law.profile.as_ref().map_or(0.0, |profile| profile.peaks()[0]) + sines.sum::<f64>()
    };
    scene.motors.iter().map(|motor| of(&motor.law)).sum()
}

/// What rods instead of stiff springs may do to an angle \[rad\], about: a vibration acts by its mean up to
/// the first order of slow over fast, a stretch that does not vibrate is of the second.  What grows in the
/// motion grows with it.
pub(super) fn model_error(mechanism: &Mechanism, rate: Option<f64>, notes: &mut Vec<String>) -> Option<f64> {
    let share = rate? / mechanism.slowest_rod.as_ref()?.1;
    let error = if mechanism.vibration.is_some() { 2.0 * share } else { share * share };
    notes.push(format!(
        "rigid springs are a model: angles may be off by about {} rad, whatever the tolerance, and more \
            where errors grow",
        order(error)
    ));
    Some(error)
}

/// What there is to say of parameters that events set, though nothing of the motion is made of them.
pub(super) fn set_in_vain(scene: &Scene, mechanism: &Mechanism) -> Option<String> {
    let formulas = &mechanism.laws.as_ref()?.formulas;
    let name = |number: usize| scene.parameters.get(number).map(|parameter| parameter.name.as_str());
    let names: Vec<&str> = formulas.set_in_vain().filter_map(name).collect();
    let is_made = if names.len() == 1 { "it" } else { "them" };
    (!names.is_empty()).then(|| {
        format!(
            "events set {}, but no law, signal or event is made of {is_made}: numbers of the scene keep what \
                they are at the start",
            names.join(", ")
        )
    })
}
