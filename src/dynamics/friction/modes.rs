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
//! solution, or with several, from one whose solution was not found.  Among combinations that fit, those come
//! first in which most places that stuck before do so still, and then those that stick most: with a static
//! coefficient above the kinetic one a place at rest stays so, and does not slide with less than its limit.
//! Places that share a degree of freedom may also be at their limits, see `friction/shared.rs`.
//!
//! The combinations are the same for all numbers; what is told of one by its equations, and what counts as
//! rounding there, is [`Evidence`].
//!
//! Source: D. Stewart, *Rigid-body dynamics with friction and impact*, SIAM Review 42 (2000); of the paradox
//! F. Génot, B. Brogliato, *New results on Painlevé paradoxes*, Eur. J. Mech. A 18 (1999).

use super::super::contact::REST_HEIGHT;
use super::super::{Mechanism, Motion, Time};
use super::combinations::{combinations, subsets};
use super::evidence::{Evidence, InDoubles, NO_SPEED};
use super::paradox::REGULAR;
use super::{FrictionMode, Normal, Paradox};
use crate::arithmetic::Complex;

/// Difference of accelerations over the largest of them that the search for the moment leaves, where a wall
/// ceases to press.
const ALIKE: f64 = 1e-6;
/// Accelerations over the mechanism's own that are rounding: of what rests there is nothing else.
const NONE: f64 = 1e-9;
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

/// Contacts that are held, and the modes of all places.
pub type Modes = (Vec<usize>, Vec<FrictionMode>);

/// A moment: coordinates \[rad, m\], elements and rates \[rad/s, m/s\].
#[derive(Clone, Copy, Debug)]
pub struct FrictionMoment<'a> {
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
struct PlaceRates<'a> {
    rates: &'a [f64],
    pushed: &'a [Option<f64>],
    arrived: Option<usize>,
}

/// Modes that fit.
type Fit = (Modes, FittingMotion);

/// A motion that fits modes.
struct FittingMotion {
    /// Accelerations of all coordinates.
    load: Vec<f64>,
    /// True where a closed contact does not press.
    ceases: bool,
    /// True where all rest, and forces hardly follow from those at limits: there are other ways to share
    /// the load.
    is_loose: bool,
}

impl Mechanism {
    /// The modes at a moment, of a mechanism that is in those of `before`; `staying` are the contacts that
    /// would be held without friction, `touching` all that touch and do not move along their normals.
    ///
    /// # Errors
    /// There is none, or more than one.
    pub fn modes_at(
        &self,
        at: FrictionMoment,
        before: &[FrictionMode],
        contacts: [&[usize]; 2],
        transition: Transition,
    ) -> Result<Modes, Paradox> {
        self.modes_by(&InDoubles { mechanism: self, at }, at, before, contacts, transition)
    }

    /// The same by the evidence that other numbers give.
    ///
    /// # Errors
    /// There is none, or more than one.
    pub fn modes_by(
        &self,
        evidence: &dyn Evidence,
        at: FrictionMoment,
        before: &[FrictionMode],
        contacts: [&[usize]; 2],
        transition: Transition,
    ) -> Result<Modes, Paradox> {
        let [found, doubtful] = self.fitting(evidence, at, before, contacts, transition)?;
        let found = match (found, transition.breaks) {
            // What gives way moves nothing that rests where supports can share the load in another way.
            (None, Some(_)) => {
                let [found, _] = self.fitting(evidence, at, before, contacts, Transition::default())?;
                found.filter(|fit| lasts(evidence, fit, contacts[1]))
            }
            (found, _) => found,
        };
        found.or(doubtful).map(|(modes, _)| modes).ok_or(Paradox::Inconsistent)
    }

    /// Modes that fit: those that still do so a moment later, and those that do not.
    fn fitting(
        &self,
        evidence: &dyn Evidence,
        at: FrictionMoment,
        before: &[FrictionMode],
        [staying, touching]: [&[usize]; 2],
        transition: Transition,
    ) -> Result<[Option<Fit>; 2], Paradox> {
        let rates = evidence.rates();
        let pushed = self.pushed(at, before, staying, transition);
        let (mut found, mut doubtful): (Option<Fit>, Option<Fit>) = (None, None);
        let mut looked_at = 0;
        for closed in subsets(staying, touching) {
            let rates = self.rates_beside(evidence, at, &closed, &rates);
            let mut options = self.options(at, before, &rates, &closed, (&pushed, transition));
            let resting = options.iter().filter(|of| of.len() > 1).count();
            let count = |options: &[Vec<FrictionMode>]| {
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
            let known = PlaceRates { rates: &rates, pushed: &pushed, arrived: transition.arrived };
            let mut fits = combinations(&options, before).into_iter().filter_map(|modes| {
                let motion = self.fits(evidence, at, &closed, &modes, touching, known)?;
                Some(((closed.clone(), modes), motion))
            });
            let fit = fits.next();
            // Where one gives way, or has given way to no motion, others at their limits leave more than one
            // way to share the load, with walls or without: one that still does so a moment later is taken.
            let lasts = |fit: &Fit| lasts(evidence, fit, touching);
            let Transition { arrived, breaks } = transition;
            let is_at_limits = |fit: &Fit| arrived.is_some() || breaks.is_some() || fit.1.ceases;
            let doubts = |fit: &Fit| fit.1.is_loose || is_at_limits(fit) && !lasts(fit);
            let is_in_doubt = fit.as_ref().is_some_and(doubts);
            let word = |modes: (&FrictionMode, &FrictionMode)| modes.0.word() == modes.1.word();
            let is_alike = |other: &Fit| fit.iter().all(|fit| fit.0.1.iter().zip(&other.0.1).all(word));
            let lasting = if is_in_doubt {
                fits.find(|other| is_alike(other) && !other.1.is_loose && lasts(other))
            } else {
                None
            };
            let fit = match (lasting, fit) {
                (None, Some(fit)) if is_in_doubt => {
                    doubtful.get_or_insert(fit);
                    None
                }
                (lasting, fit) => lasting.or(fit),
            };
            found = match (fit, found) {
                (Some(fit), Some(known)) if !self.are_alike(&fit.1.load, &known.1.load) => {
                    // What a wall holds that just ceases to press ends there.
                    match (fit.1.ceases, known.1.ceases) {
                        (false, true) => Some(fit),
                        (true, false) => Some(known),
                        _ => return Err(Paradox::Indeterminate),
                    }
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
        Ok([found, doubtful])
    }

    /// The mechanism in the modes of its start, contacts held that stay; `None` where nothing holds it and it
    /// has no friction, or no modes fit.
    pub fn moving_at_start(&self, start: &Motion) -> Option<Self> {
        if self.frictions.is_empty() && self.contacts.is_empty() {
            return None;
        }
        let [phi, omega] = start.rounded();
        let z = self.elements(&phi);
        let is_still = |contact: &usize| {
            let contact = &self.contacts[*contact];
            let speed = contact.gap_rate(start.time, &phi, &z, &omega);
            contact.touches(start.time, &phi, &z) && speed.abs() <= NO_SPEED * contact.step_size(&omega)
        };
        let touching: Vec<usize> = (0..self.contacts.len()).filter(is_still).collect();
        let staying = self.staying(&touching, start.time, [&phi, &omega], REST_HEIGHT)?;
        if self.frictions.is_empty() {
            return (!staying.is_empty()).then(|| self.holding(&staying));
        }
        let at = FrictionMoment { t: start.time, phi: &phi, z: &z, omega: &omega };
        let (contacts, modes) =
            self.modes_at(at, &self.modes, [&staying, &touching], Transition::default()).ok()?;
        Some(self.moving(&contacts, &modes))
    }

    /// The modes each place may be in with these contacts closed, those that stick first.
    fn options(
        &self,
        at: FrictionMoment,
        before: &[FrictionMode],
        rates: &[f64],
        closed: &[usize],
        (pushed, Transition { arrived, .. }): (&[Option<f64>], Transition),
    ) -> Vec<Vec<FrictionMode>> {
        let of = |(number, friction): (usize, &super::CompiledFriction)| {
            if let Normal::Contact(contact) = friction.normal
                && !closed.contains(&contact)
            {
                return vec![FrictionMode::Open];
            }
            if let Normal::Joint(joint) = friction.normal
                && self.joints[joint].outer.is_none()
                && self.joints[joint].row.is_none()
            {
                return vec![FrictionMode::Open];
            }
            if let Some(sign) = pushed[number] {
                return vec![FrictionMode::Slip(sign)];
            }
            let rate = if arrived == Some(number) { 0.0 } else { rates[number] };
            if rate != 0.0 {
                return vec![FrictionMode::Slip(rate.signum())];
            }
            let stick = match before.get(number) {
                Some(FrictionMode::Stick(anchor)) => *anchor,
                _ => friction.displacement(at.phi, at.z),
            };
            vec![FrictionMode::Stick(stick), FrictionMode::Slip(1.0), FrictionMode::Slip(-1.0)]
        };
        self.frictions.iter().enumerate().map(of).collect()
    }

    /// The motion in these modes, where it and the forces are such as the modes claim.
    fn fits(
        &self,
        evidence: &dyn Evidence,
        at: FrictionMoment,
        closed: &[usize],
        modes: &[FrictionMode],
        touching: &[usize],
        PlaceRates { rates, pushed, arrived }: PlaceRates,
    ) -> Option<FittingMotion> {
        let told = evidence.told(closed, modes, touching)?;
        // At walls the pressure has a sign, which tells; the force of joints and rails may have either.
        let at_walls = self.frictions.iter().zip(modes).all(|(friction, mode)| {
            matches!(friction.normal, Normal::Contact(_))
                || matches!(mode, FrictionMode::Open | FrictionMode::Stick(_))
        });
        if !at_walls && told.regularity <= 0.0 || !told.hold(closed, modes, touching) {
            return None;
        }
        let is_held = |place: usize| self.room_beside(at, closed, modes, place).is_held(place);
        let is_still = |place: usize, is_driven| evidence.is_still(place, closed, modes, is_driven);
        let fit = modes.iter().enumerate().all(|(number, mode)| match mode {
            FrictionMode::Open => true,
            // Where the travel of a moving linkage turns back, the linkage moves it on, and no force of
            // friction holds it.
            FrictionMode::Stick(_) => !is_held(number) || is_still(number, false),
            FrictionMode::Slip(sign) => {
                let slides = rates[number] != 0.0 && arrived != Some(number);
                // What breaks begins with what the coefficients leave, which may be nothing.
                let is_pushed = pushed[number].is_some() && !is_held(number);
                slides || is_pushed || sign * f64::from(told.speeding[number]) > 0.0
            }
            FrictionMode::Strained(strain) => is_held(number) && is_still(number, *strain == 0.0),
        });
        let slides = |mode: &FrictionMode| matches!(mode, FrictionMode::Slip(_));
        let is_loose = told.regularity.abs() < REGULAR && !modes.iter().any(slides);
        fit.then(|| FittingMotion { ceases: told.pressures.contains(&0), is_loose, load: told.load })
    }

    /// Whether two motions have the same accelerations.
    fn are_alike(&self, one: &[f64], other: &[f64]) -> bool {
        let size = one.iter().chain(other).fold(0.0, |size: f64, x| size.max(x.abs()));
        let own = |k: usize| self.units.coordinate(k, self.bodies.len()) / self.units.time.powi(2);
        let mut apart = one.iter().zip(other).map(|(a, b)| (a - b).abs()).enumerate();
        apart.all(|(k, apart)| apart <= (ALIKE * size).max(NONE * own(k)))
    }
}

/// Whether modes that fit still do so a moment later.
fn lasts(evidence: &dyn Evidence, ((closed, modes), motion): &Fit, touching: &[usize]) -> bool {
    evidence.lasts(closed, modes, touching, &motion.load)
}
