//! Which places stick, which slide and which walls press, at a moment where that may change.
//!
//! ```text
//! s_j' != 0:   slides as it does
//! s_j' = 0:    sticks,  |tau_j| <= mu0_j N_j,  or slides,  sign(s_j'') = sign(tau_j),  |tau_j| = mu_j N_j
//!              or rests since others that stick hold it,  s_j'' = 0,  |tau_j| = mu0_j N_j
//! wall:        open,  a_n >= 0,  or closed,  N >= 0
//! ```
//!
//! The complementarity problem of all places at once, solved by looking at every combination: their number is
//! that of the places that touch and do not slide, which is small, and nothing else tells a problem without a
//! solution, or with several, from one whose solution was not found.  Among combinations that fit, those that
//! stick most come first: with a static coefficient above the kinetic one a place at rest stays so.
//! Places that share a degree of freedom may also be at their limits, see `friction/shared.rs`.
//!
//! Source: D. Stewart, *Rigid-body dynamics with friction and impact*, SIAM Review 42 (2000); of the paradox
//! F. Génot, B. Brogliato, *New results on Painlevé paradoxes*, Eur. J. Mech. A 18 (1999).

use super::super::constraint::Posture;
use super::super::kernel::{Bias, Kernel, dot};
use super::super::{Mechanism, Motion, Time};
use super::{Mode, Normal};
use crate::arithmetic::Complex;

/// Velocity over the sum of the magnitudes of its parts, and over the mechanism's own, up to which a place
/// does not slide.
const NO_SPEED: f64 = 1e-12;
/// Share of a force, or of an acceleration, that rounding makes.
const ROUNDING: f64 = 1e-9;
/// Difference of accelerations over the largest of them that the search for the moment leaves, where a wall
/// ceases to press.
const ALIKE: f64 = 1e-6;
/// Combinations that are looked at.
const MOST: usize = 20_000;

/// What is known of the moment beside its motion.
#[derive(Clone, Copy, Debug, Default)]
pub struct Transition {
    /// The place whose velocity has just become zero.
    pub arrived: Option<usize>,
    /// The place that cannot stick any more, and the sign of the velocity it will have.
    pub breaks: Option<(usize, f64)>,
}

/// Why there is no way on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Paradox {
    /// No combination fits: Painlevé's inconsistent case.
    Inconsistent,
    /// The point may stay on its walls as well as leave one of them: Painlevé's indeterminate case.
    Indeterminate,
    /// Too many places touch without sliding.
    TooMany(usize),
}

/// Contacts that are held, and the modes of all places.
pub type Modes = (Vec<usize>, Vec<Mode>);

/// A moment: coordinates \[rad, m\], elements and rates \[rad/s, m/s\].
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// Time.
    pub t: Time,
    /// Coordinates.
    pub phi: &'a [f64],
    /// Elements.
    pub z: &'a [Complex<f64>],
    /// Rates.
    pub omega: &'a [f64],
}

/// What is known of all places: their velocities, where they are pushed, and which one has just come to rest.
#[derive(Clone, Copy)]
struct Known<'a> {
    rates: &'a [f64],
    pushed: &'a [Option<f64>],
    arrived: Option<usize>,
}

impl Mechanism {
    /// The modes at a moment, of a mechanism that is in those of `before`; `staying` are the contacts that
    /// would be held without friction, `touching` all that touch and do not move along their normals.
    ///
    /// # Errors
    /// There is none, or more than one.
    pub fn modes_at(
        &self,
        at: Moment,
        before: &[Mode],
        [staying, touching]: [&[usize]; 2],
        transition: Transition,
    ) -> Result<Modes, Paradox> {
        let rates = self.sliding_rates(at);
        let pushed = self.pushed(at, before, staying, transition);
        let mut found: Option<(Modes, Vec<f64>)> = None;
        let mut looked_at = 0;
        for closed in subsets(staying, touching) {
            let rates = self.rates_beside(at, &closed, &rates);
            let mut options = self.options(at, before, &rates, &closed, (&pushed, transition));
            let resting = options.iter().filter(|of| of.len() > 1).count();
            let count = |options: &[Vec<Mode>]| {
                options.iter().map(Vec::len).try_fold(1_usize, |all, of| all.checked_mul(of))
            };
            self.spare_driven(at, &pushed, &mut options);
            let simple = options.clone();
            self.strain(at, &closed, &pushed, &mut options);
            if count(&options).is_none_or(|count| looked_at + count > MOST) {
                options = simple;
            }
            let count = count(&options);
            looked_at += count.unwrap_or(MOST);
            if looked_at > MOST {
                return Err(Paradox::TooMany(resting));
            }
            let known = Known { rates: &rates, pushed: &pushed, arrived: transition.arrived };
            let fit = combinations(&options).into_iter().find_map(|modes| {
                let load = self.fits(at, &closed, &modes, touching, known)?;
                Some(((closed.clone(), modes), load))
            });
            found = match (fit, found) {
                (Some(fit), Some(known)) if !are_alike(&fit.1, &known.1) => {
                    return Err(Paradox::Indeterminate);
                }
                // Where a wall just ceases to press, the motion is the same with it and without.
                (Some(fit), Some(known)) if fit.0.0.len() < known.0.0.len() => Some(fit),
                (fit, known) => known.or(fit),
            };
            // Without friction at walls the contacts that are pressed are known.
            let at_walls = |normal| matches!(normal, Normal::Contact(_));
            if found.is_some() && !self.frictions.iter().any(|friction| at_walls(friction.normal)) {
                break;
            }
        }
        found.map(|(modes, _)| modes).ok_or(Paradox::Inconsistent)
    }

    /// The mechanism in the modes of its start, contacts held that stay; `None` where it has no friction, or
    /// no modes fit.
    pub fn moving_at_start(&self, start: &Motion) -> Option<Self> {
        if self.frictions.is_empty() {
            return None;
        }
        let phi: Vec<f64> = start.phi.iter().map(|phi| phi.hi).collect();
        let omega: Vec<f64> = start.omega.iter().map(|omega| omega.hi).collect();
        let z = self.elements(&phi);
        let is_still = |contact: &usize| {
            let contact = &self.contacts[*contact];
            let speed = contact.gap_rate(start.time, &phi, &z, &omega);
            contact.touches(start.time, &phi, &z) && speed.abs() <= NO_SPEED * contact.step_size(&omega)
        };
        let touching: Vec<usize> = (0..self.contacts.len()).filter(is_still).collect();
        let staying = self.staying(&touching, start.time, &phi, &omega)?;
        let at = Moment { t: start.time, phi: &phi, z: &z, omega: &omega };
        let (contacts, modes) =
            self.modes_at(at, &self.modes, [&staying, &touching], Transition::default()).ok()?;
        Some(self.moving(&contacts, &modes))
    }

    /// The relative velocity \[rad/s, m/s\] of every place, zero where it is rounding.
    fn sliding_rates(&self, at: Moment) -> Vec<f64> {
        let mut row = vec![0.0; at.phi.len()];
        let posture = Posture { phi: at.phi, z: at.z, omega: at.omega };
        (self.frictions.iter().enumerate())
            .map(|(number, friction)| {
                row.fill(0.0);
                let here = friction.tangent.differentiate(at.t, posture, &mut row);
                let rate = dot(&row, at.omega) + here.drive;
                let parts: f64 = row.iter().zip(at.omega).map(|(d, omega)| (d * omega).abs()).sum();
                let size = parts.max(self.displacement_unit(number) / self.units.time);
                if rate.abs() <= NO_SPEED * size { 0.0 } else { rate }
            })
            .collect()
    }

    /// The modes each place may be in with these contacts closed, those that stick first.
    fn options(
        &self,
        at: Moment,
        before: &[Mode],
        rates: &[f64],
        closed: &[usize],
        (pushed, Transition { arrived, .. }): (&[Option<f64>], Transition),
    ) -> Vec<Vec<Mode>> {
        let of = |(number, friction): (usize, &super::Friction)| {
            if let Normal::Contact(contact) = friction.normal
                && !closed.contains(&contact)
            {
                return vec![Mode::Open];
            }
            if let Normal::Joint(joint) = friction.normal
                && self.joints[joint].outer.is_none()
                && self.joints[joint].row.is_none()
            {
                return vec![Mode::Open];
            }
            if let Some(sign) = pushed[number] {
                return vec![Mode::Slip(sign)];
            }
            let rate = if arrived == Some(number) { 0.0 } else { rates[number] };
            if rate != 0.0 {
                return vec![Mode::Slip(rate.signum())];
            }
            let stick = match before.get(number) {
                Some(Mode::Stick(anchor)) => *anchor,
                _ => friction.displacement(at.phi, at.z),
            };
            vec![Mode::Stick(stick), Mode::Slip(1.0), Mode::Slip(-1.0)]
        };
        self.frictions.iter().enumerate().map(of).collect()
    }

    /// The accelerations in these modes, where they and the forces are such as the modes claim.
    fn fits(
        &self,
        at: Moment,
        closed: &[usize],
        modes: &[Mode],
        touching: &[usize],
        Known { rates, pushed, arrived }: Known,
    ) -> Option<Vec<f64>> {
        let mechanism = self.moving(closed, modes);
        let mut kernel = Kernel::<f64>::new(&mechanism);
        kernel.accelerate::<0>(&mechanism, at.t, at.phi, at.omega, Bias::default());
        if !kernel.load.iter().chain(&kernel.multiplier).all(|x| x.is_finite()) {
            return None;
        }
        // At walls the pressure has a sign, which tells; the force of joints and rails may have either.
        let at_walls = mechanism.sliding().all(|(friction, _)| matches!(friction.normal, Normal::Contact(_)));
        if !at_walls && kernel.regularity <= 0.0 {
            return None;
        }
        let forces = kernel.friction_forces(&mechanism, at.t, at.phi, at.omega);
        let pressures = closed.iter().zip(&kernel.multiplier[mechanism.standing_rows()..]);
        let pressures: Vec<f64> =
            (pressures).map(|(&contact, &multiplier)| self.contacts[contact].pressure(multiplier)).collect();
        if pressures.iter().any(|&pressure| pressure < -ROUNDING) {
            return None;
        }
        let posture = Posture { phi: at.phi, z: at.z, omega: at.omega };
        let mut row = vec![0.0; at.phi.len()];
        let mut acceleration = |of: &super::ConstraintEquation| {
            row.fill(0.0);
            let here = of.differentiate(at.t, posture, &mut row);
            let parts = row.iter().zip(&kernel.load).map(|(g, a)| (g * a).abs()).sum::<f64>();
            (dot(&row, &kernel.load) + here.convective, parts + here.convective.abs())
        };
        let leaves = |contact: &usize| {
            let (apart, size) = acceleration(&self.contacts[*contact].row);
            closed.contains(contact) || apart >= -ROUNDING * size
        };
        if !touching.iter().all(leaves) {
            return None;
        }
        let beside = |number: usize| self.room_beside(at, closed, modes, number);
        let fit = (self.frictions.iter().zip(modes).zip(forces).enumerate()).all(
            |(number, ((friction, mode), [tau, pressing]))| match mode {
                Mode::Open => true,
                Mode::Stick(_) => {
                    let rounding =
                        f64::EPSILON * kernel.multiplier.iter().fold(pressing, |most, x| most.max(x.abs()));
                    let is_enough = tau.abs()
                        <= friction.stiction * pressing * (1.0 + ROUNDING) + friction.stiction * rounding;
                    // Where the travel of a moving linkage turns back, the linkage moves it on, and no
                    // force of friction holds it.
                    let is_moved_on = || {
                        let room = beside(number);
                        room.is_held(number) && !room.is_still(number, false)
                    };
                    is_enough && !is_moved_on()
                }
                Mode::Slip(sign) => {
                    let slides = rates[number] != 0.0 && arrived != Some(number);
                    // What breaks begins with what the coefficients leave, which may be nothing.
                    let is_pushed = pushed[number].is_some() && !beside(number).is_held(number);
                    let (speeding, size) = acceleration(&friction.tangent);
                    slides || is_pushed || sign * speeding > ROUNDING * size
                }
                Mode::Strained(strain) => {
                    let room = beside(number);
                    room.is_held(number) && room.is_still(number, *strain == 0.0)
                }
            },
        );
        fit.then_some(kernel.load)
    }
}

/// Whether two motions have the same accelerations.
fn are_alike(one: &[f64], other: &[f64]) -> bool {
    let size = one.iter().chain(other).fold(0.0, |size: f64, x| size.max(x.abs()));
    one.iter().zip(other).all(|(a, b)| (a - b).abs() <= ALIKE * size)
}

/// The sets of contacts that may be closed: first those that stay without friction.
fn subsets(staying: &[usize], touching: &[usize]) -> Vec<Vec<usize>> {
    let mut all = vec![staying.to_vec()];
    // More than a few would be too many.
    let few = &touching[..touching.len().min(6)];
    for bits in (0..1_usize << few.len()).rev() {
        let set: Vec<usize> =
            few.iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1).map(|(_, &contact)| contact).collect();
        if !all.contains(&set) {
            all.push(set);
        }
    }
    all
}

/// Every combination of one mode a place, by the number of places that do not take their first one.
fn combinations(options: &[Vec<Mode>]) -> Vec<Vec<Mode>> {
    let mut all: Vec<(usize, Vec<Mode>)> = vec![(0, Vec::new())];
    for of in options {
        all = all
            .iter()
            .flat_map(|(later, modes)| {
                of.iter().enumerate().map(move |(i, &mode)| {
                    let mut modes = modes.clone();
                    modes.push(mode);
                    (later + usize::from(i > 0), modes)
                })
            })
            .collect();
    }
    all.sort_by_key(|(later, _)| *later);
    all.into_iter().map(|(_, modes)| modes).collect()
}
