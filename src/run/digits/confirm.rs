//! Whether a step of the series agrees with the equations inside it.
//!
//! Laws with exponentials, hyperbolic tangents, quotients, roots or angles may be flat to the last digit
//! where a step begins and change within it, as `tanh(100*x)` does: the powers that would say so are not
//! among those carried.  At a few times inside the step the motion is therefore expanded anew to its first
//! powers, and their acceleration compared with that of the series; the step is shortened until they agree.
//! What rises and is flat again between these times is seen where it is made of exponentials and hyperbolic
//! tangents: steps end before their arguments have changed much (`run::driver::limit`).

use super::coordinates::DigitsCoordinates;
use super::motion::DigitsMotion;
use crate::arithmetic::digits::Digits;
use crate::arithmetic::{Real, Scalar};
use crate::dynamics::compile::exact::ExactMechanism;
use crate::dynamics::series::Series;
use crate::dynamics::{Coordinates, Motion, Time};
use crate::run::driver::limit::first_change;
use crate::run::observer::Inside;
use std::f64::consts::LN_2;

/// Times inside a step, in shares of it that are no multiples of one another.
const SHARES: [f64; 4] = [0.234375, 0.515625, 0.796875, 1.0];
/// Powers of the rates that are expanded there: the fewest there can be.
const POWERS: usize = 2;
/// log2 of the part of a step's tolerance that the accelerations may be off by, over the step and its order.
const ALLOWED: f64 = 6.0;
/// Shortenings at most, each by a third, beside one for every bit of the tolerance: so many lead up to a jump
/// of an angle.
const MOST: usize = 60;
/// What the exponential of minus this is beside rounding, in doubles: where a step into its window ends.
const ENTERED: f64 = 35.0;
/// The least share of a step to which arguments shorten it.
const LEAST: f64 = 1e-9;

/// A series of few powers.
#[derive(Clone)]
pub struct Probe<const W: usize>(Series<Digits<W>>);

impl<const W: usize> Probe<W> {
    /// Of a mechanism with laws that need it.
    pub fn of(mechanism: &ExactMechanism<Digits<W>>, coordinates: Coordinates) -> Option<Self> {
        let is_needed = mechanism.forces.iter().any(|force| force.needs_confirmation);
        is_needed.then(|| Self(Series::of_terms(&mechanism.terms(), coordinates, POWERS)))
    }
}

/// The motion in doubles inside a step that is next.
struct RoundedStep<'a, const W: usize> {
    motion: &'a DigitsMotion<W>,
    step: f64,
    shown: Motion,
}

impl<const W: usize> Inside for RoundedStep<'_, W> {
    fn span(&self) -> (Time, Time) {
        (Time::from(0.0), Time::from(self.step))
    }

    fn at(&mut self, time: Time) -> &Motion {
        let t = self.motion.state.t + Digits::of(time.hi);
        let DigitsCoordinates { phi, omega, .. } = self.motion.at(t);
        let rounded = |all: Vec<Digits<W>>| all.iter().map(|x| Time::from(x.value())).collect::<Vec<_>>();
        self.shown.time = Time::from(t.value());
        (self.shown.phi, self.shown.omega) = (rounded(phi), rounded(omega));
        self.shown.turns = vec![0; self.shown.phi.len()];
        &self.shown
    }

    fn roughly_at(&mut self, time: Time) -> &Motion {
        self.at(time)
    }
}

/// Of a step of so many seconds what comes before an argument of an exponential has changed much.
fn limited<const W: usize>(motion: &DigitsMotion<W>, step: f64) -> f64 {
    let structure = &motion.mechanism.structure;
    if !structure.has_active_arguments() || !step.is_finite() {
        return step;
    }
    let times = (LN_2 * motion.precision.bits as f64 / ENTERED).max(1.0);
    let mut inside = RoundedStep { motion, step, shown: Motion::default() };
    let (changed, _) = first_change(structure, &mut inside, times);
    changed.map_or(step, |time| time.hi).max(LEAST * step)
}

/// Of a step of so many seconds as much as the equations confirm.
pub fn confirmed<const W: usize>(motion: &mut DigitsMotion<W>, step: f64) -> f64 {
    let mut step = limited(motion, step);
    let Some(mut probe) = motion.probe.take() else { return step };
    for _ in 0..MOST + (-motion.precision.tolerance()).max(0.0) as usize {
        if !step.is_finite() || SHARES.iter().all(|share| agrees(motion, &mut probe, step, share * step)) {
            break;
        }
        step *= 0.65625;
    }
    motion.probe = Some(probe);
    step
}

/// True where the acceleration of the series at a time after the state's is that of the equations there.
fn agrees<const W: usize>(motion: &DigitsMotion<W>, probe: &mut Probe<W>, step: f64, after: f64) -> bool {
    let h = Digits::of(after);
    let there = motion.state_at(motion.state.t + h);
    let f = there.u.len();
    let zeros = vec![Digits::ZERO; f];
    probe.0.expand_terms(&motion.mechanism.terms(), there.t, &there.u, &zeros, &there.rate);
    let order = motion.precision.order;
    let largest = |rates: &[Digits<W>]| {
        rates.iter().map(Digits::log2).fold(0.0, |most: f64, size| if size > most { size } else { most })
    };
    let first = largest(&motion.series.rate[..f]);
    let allowed = motion.precision.tolerance() + first + libm::log2(order as f64 / step) + ALLOWED;
    (0..f).all(|c| {
        let powers = motion.series.rate[c..].iter().step_by(f).enumerate().skip(1);
        // A sum has the limbs of its shorter term: high powers are kept to few.
        let full = |x: Digits<W>| x.shortened(motion.precision.limbs);
        let slope =
            powers.rev().fold(Digits::ZERO, |sum, (m, &power)| full(sum * h) + full(power).scale(m as f64));
        let off = (probe.0.rate[f + c] - slope).log2();
        // Where the equations have no finite answer the step is not judged.
        off.is_nan() || off <= allowed
    })
}
