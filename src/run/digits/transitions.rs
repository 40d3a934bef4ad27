//! When places with dry friction begin to stick or to slide, in many digits: by Newton's iteration on series.
//!
//! ```text
//! slides   sign s'(t) = 0          the relative velocity passes zero
//! sticks   (mu0 N)² - tau² = 0     it breaks loose, to the side of tau
//! both     N(t) = 0                the force of a hinge or across a rail passes zero: its size has a corner
//! ```
//!
//! What begins near zero, as a velocity does where sliding begins, is followed on all scales of time (module
//! `touch`).  A place that motors hold at rest slides as soon as they move it.

use super::first_passage::{self, FirstPassage};
use super::friction::SURE;
use super::functions::LEAVES;
use super::motion::DigitsMotion;
use super::wall::{Ends, in_shares, refined};
use crate::arithmetic::digits::Digits;
use crate::arithmetic::{Complex, Real, Scalar};
use crate::dynamics::friction::{FrictionMode, Normal, Transition};
use crate::stepping::search::{Curve, PowerSeries};
use crate::stepping::{Cause, StepError};

/// What a place does at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ModeChange {
    /// The relative velocity of this place is zero.
    Arrives(usize),
    /// This place can stick no longer; the sign of the velocity it will have.
    Breaks(usize, f64),
    /// Motors move this place that they have held; the sign of its velocity.
    Moves(usize, f64),
    /// A normal force passes zero.
    Reverses,
}

/// The first of what places with friction do within a step of so many seconds, and the exact time up to it.
pub fn first<const W: usize>(
    motion: &DigitsMotion<W>,
    step: f64,
) -> Result<Option<(Ends, Digits<W>)>, StepError> {
    let mut found: Option<(ModeChange, Digits<W>)> = None;
    let mut comes = |change: ModeChange, time: Digits<W>| {
        if found.as_ref().is_none_or(|(_, first)| time < *first) {
            found = Some((change, time));
        }
    };
    let (mut slides, mut sticks) = (motion.series.slides(), motion.series.sticks());
    let mut row = motion.mechanism.structure.standing_rows() + motion.state().acting.held.len();
    for (place, mode) in motion.state().acting.sliding.iter().enumerate() {
        let friction = &motion.mechanism.frictions[place];
        match *mode {
            FrictionMode::Open => {}
            FrictionMode::Slip(sign) => {
                let Some(slides) = slides.next() else { continue };
                let powers: Vec<_> = slides.speed.iter().map(|speed| speed.scale(sign)).collect();
                if let Some(time) = passes(motion, &powers, motion.speed_unit(place), step) {
                    comes(ModeChange::Arrives(place), time);
                }
                if let Some(time) = reverses(motion, place, slides.normal, slides.size, step)? {
                    comes(ModeChange::Reverses, time);
                }
            }
            FrictionMode::Strained(strain) => {
                let Some(slides) = slides.next() else { continue };
                if let Some(sign) = moves(motion, slides.speed, motion.speed_unit(place), step)
                    && strain == 0.0
                {
                    comes(ModeChange::Moves(place, sign), Digits::ZERO);
                }
                // Where there is no friction its normal force does nothing, and steps do not heed its series.
                if strain != 0.0
                    && let Some(time) = reverses(motion, place, slides.normal, slides.size, step)?
                {
                    comes(ModeChange::Reverses, time);
                }
            }
            FrictionMode::Stick(_) => {
                let Some(normals) = sticks.next() else { continue };
                let order = motion.precision.order;
                let tau: Vec<_> = (0..order).map(|m| motion.series.multipliers(m)[row]).collect();
                row += 1;
                let (grip, unit) = grip(friction.stiction, friction.normal, normals, &tau, step);
                // Without a load what is left of one is rounding.
                let own = motion.friction_unit(place);
                let unit = unit.max(own * own * libm::exp2(motion.precision.rounding(SURE)));
                if let Some(time) = passes(motion, &grip, unit, step) {
                    comes(ModeChange::Breaks(place, side(motion, &tau, time, step)), time);
                }
            }
        }
    }
    Ok(found.map(|(change, time)| (Ends::Changes(change), time)))
}

/// When a function that is positive, or begins at zero, goes below zero; values are divided by `unit`.
fn passes<const W: usize>(
    motion: &DigitsMotion<W>,
    powers: &[Digits<W>],
    unit: f64,
    step: f64,
) -> Option<Digits<W>> {
    let least = motion.precision.rounding(SURE);
    let first = powers[0].log2() - libm::log2(unit);
    if powers[0] < Digits::ZERO && first > least {
        return Some(Digits::ZERO);
    }
    let is_open = powers[0] > Digits::ZERO && first > least;
    match first_passage::passage(powers, unit, step, least) {
        FirstPassage::Nothing => None,
        // Where it begins at zero, what is left of that is rounding.
        FirstPassage::At(near) => Some(refined(motion, if is_open { powers } else { &powers[1..] }, near)),
        FirstPassage::Sinks => Some(Digits::ZERO),
    }
}

/// When the normal force of a hinge or rail passes zero.
fn reverses<const W: usize>(
    motion: &DigitsMotion<W>,
    place: usize,
    normal: Normal,
    size: &[Digits<W>],
    step: f64,
) -> Result<Option<Digits<W>>, StepError> {
    if matches!(normal, Normal::Contact(_)) {
        return Ok(None);
    }
    let unit = weight(size, step);
    if unit == 0.0 || !unit.is_finite() {
        return Ok(None);
    }
    let time = passes(motion, size, unit, step);
    if time.is_some_and(|time| time <= Digits::ZERO) {
        let name = &motion.mechanism.frictions[place].name;
        let what = format!("the force that presses {name} is zero, and its direction is not known");
        let hint = "begin a little earlier or later, or leave the friction out there";
        return Err(motion.stop(Cause::Friction, 0.0, &what, hint));
    }
    Ok(time)
}

/// The sign of the force by which a place breaks loose; where there is none, as without a load, that of a
/// moment later.
fn side<const W: usize>(motion: &DigitsMotion<W>, tau: &[Digits<W>], time: Digits<W>, step: f64) -> f64 {
    let limbs = motion.precision.limbs;
    let at = |sum: Digits<W>, power: &Digits<W>| (sum * time).shortened(limbs) + *power;
    let force = tau.iter().rev().fold(Digits::ZERO, at);
    let unit = weight(tau, step).max(f64::MIN_POSITIVE);
    let is_there = force.log2() - libm::log2(unit) > motion.precision.rounding(SURE);
    let later = || {
        PowerSeries { powers: &in_shares(tau, 1.0 / unit, step), end: 1.0 }.at(time.value() / step + LEAVES)
            [0]
    };
    let is_negative = if is_there { force < Digits::ZERO } else { later() < 0.0 };
    if is_negative { -1.0 } else { 1.0 }
}

/// The sign of a velocity that begins at zero, where it leaves it within a step.
fn moves<const W: usize>(motion: &DigitsMotion<W>, speed: &[Digits<W>], unit: f64, step: f64) -> Option<f64> {
    let shares = in_shares(speed, 1.0 / unit, step);
    let most = shares.iter().fold(0.0_f64, |most, share| most.max(share.abs()));
    let value = PowerSeries { powers: &shares, end: 1.0 }.at(LEAVES)[0];
    (libm::log2(most) > motion.precision.rounding(SURE)).then(|| if value < 0.0 { -1.0 } else { 1.0 })
}

/// The largest term of a series in a step.
fn weight<const W: usize>(powers: &[Digits<W>], step: f64) -> f64 {
    in_shares(powers, 1.0, step).iter().fold(0.0, |most, share| share.abs().max(most))
}

/// Powers of (mu0 N)² - tau², and the size of its terms in a step.
fn grip<const W: usize>(
    stiction: Digits<W>,
    normal: Normal,
    normals: &[Complex<Digits<W>>],
    tau: &[Digits<W>],
    step: f64,
) -> (Vec<Digits<W>>, f64) {
    let order = tau.len().min(normals.len());
    let square = |part: &dyn Fn(usize) -> Digits<W>| -> Vec<Digits<W>> {
        let power = |m: usize| (0..=m).fold(Digits::ZERO, |sum, l| sum + part(l) * part(m - l));
        (0..order).map(power).collect()
    };
    let mut most = square(&|m| normals[m].re * stiction);
    if matches!(normal, Normal::Joint(_)) {
        let across = square(&|m| normals[m].im * stiction);
        most.iter_mut().zip(across).for_each(|(most, across)| *most += across);
    }
    let held = square(&|m| tau[m]);
    let unit = weight(&most, step).max(weight(&held, step)).max(f64::MIN_POSITIVE);
    (most.into_iter().zip(held).map(|(most, held)| most - held).collect(), unit)
}

impl<const W: usize> DigitsMotion<W> {
    /// Lets it take effect what a place with friction does.
    pub(super) fn change_mode(&mut self, change: ModeChange) -> Result<(), StepError> {
        let held = self.state().acting.held.clone();
        let alone = |motion: &Self, place: usize, mode: FrictionMode<Digits<W>>| {
            let mut modes = motion.state().acting.sliding.clone();
            modes[place] = mode;
            modes
        };
        match change {
            // How it goes on is told by the series of its velocity.
            ModeChange::Arrives(place) if self.is_driven(place) => {
                let modes = alone(self, place, FrictionMode::Strained(0.0));
                self.hold(held, modes, &[], None)
            }
            ModeChange::Arrives(place) => {
                let before = self.state().acting.sliding.clone();
                self.settle_modes(Transition { arrived: Some(place), breaks: None })?;
                // Friction of bounces that are left out may have carried a place beyond rest.
                let is_changed = self.state().acting.held != held || self.state().acting.sliding != before;
                if is_changed { Ok(()) } else { self.settle_modes(Transition::default()) }
            }
            ModeChange::Breaks(place, sign) => {
                self.settle_modes(Transition { arrived: None, breaks: Some((place, sign)) })
            }
            ModeChange::Moves(place, sign) => {
                let modes = alone(self, place, FrictionMode::Slip(sign));
                self.hold(held, modes, &[], None)
            }
            ModeChange::Reverses => Ok(()),
        }
    }
}
