//! Bounces that are left out of a motion in many digits, where they are not alike: each is followed, see
//! [`bounces`](crate::dynamics::contact::bounces).

use super::coordinates::DigitsCoordinates;
use super::evidence::{InDigits, gradient, second};
use super::friction::first_powers;
use super::friction_impact;
use super::motion::DigitsMotion;
use super::wall::gap_rate_at;
use crate::arithmetic::Scalar;
use crate::arithmetic::digits::Digits;
use crate::dynamics::contact::bounces::{self, Bounced, Bouncing, Course, FlightMoment};
use crate::dynamics::friction::{CompiledFriction, FrictionMode, Transition};
use crate::dynamics::kernel::dot;

/// Part of the digits in which velocities are told from rounding: those of bounces that are left out have few
/// more than half of them.
const SURE: f64 = 0.95;
/// log2 of the part of a rebound down to which bounces are followed.
const FOLLOWED: f64 = -14.0;
/// log2 of the part of an impulse from which on others take part in an impact.
const LEAST_PART: f64 = -30.0;

/// A motion of which a point bounces on its wall, others held.
struct DigitsFlight<'a, const W: usize> {
    motion: &'a DigitsMotion<W>,
    wall: usize,
    others: &'a [usize],
}

/// All bounces of a point at a wall from now on, others held and places expected in these modes; `None` where
/// they are alike.
pub(super) fn all<const W: usize>(
    motion: &DigitsMotion<W>,
    wall: usize,
    others: &[usize],
    modes: &[FrictionMode],
) -> Option<Bounced<Digits<W>>> {
    let DigitsCoordinates { phi, omega, .. } = motion.state_coordinates();
    let start = FlightMoment { late: Digits::ZERO, phi, omega };
    let restitution = motion.mechanism.walls[wall].1;
    bounces::all(&DigitsFlight { motion, wall, others }, start, modes, restitution, libm::exp2(FOLLOWED))
}

impl<'a, const W: usize> DigitsFlight<'a, W> {
    /// All coordinates at a moment.
    fn coordinates(&self, at: &FlightMoment<Digits<W>>) -> DigitsCoordinates<W> {
        let (phi, omega) = (at.phi.clone(), at.omega.clone());
        DigitsCoordinates { phi, omega, work: [Digits::ZERO; 2], lost: Digits::ZERO }
    }

    /// What is known of a moment.
    fn evidence(&self, at: &FlightMoment<Digits<W>>) -> InDigits<'a, W> {
        let t = self.motion.state().t + at.late;
        InDigits::at(self.motion, t, self.coordinates(at), self.motion.precision.rounding(SURE))
    }
}

impl<const W: usize> Bouncing<Digits<W>> for DigitsFlight<'_, W> {
    fn rebound(&self, at: &FlightMoment<Digits<W>>) -> Digits<W> {
        gap_rate_at(self.motion, self.wall, self.motion.state().t + at.late, &self.coordinates(at)).rate
    }

    fn modes(
        &self,
        at: &FlightMoment<Digits<W>>,
        before: &[FrictionMode],
        transition: Transition,
    ) -> Option<Vec<FrictionMode>> {
        let evidence = self.evidence(at);
        let (walls, modes) =
            self.motion.modes_by(&evidence, before, [self.others, self.others], transition).ok()?;
        (walls == self.others).then_some(modes)
    }

    fn course(&self, at: &FlightMoment<Digits<W>>, modes: &[FrictionMode]) -> Option<Course<Digits<W>>> {
        let (evidence, t) = (self.evidence(at), self.motion.state().t + at.late);
        let mechanism = evidence.mechanism(self.others, modes)?;
        let series = evidence.series(&mechanism);
        let z = mechanism.elements(&at.phi);
        let sliding = |friction: &CompiledFriction<Digits<W>>| {
            let along = gradient(&friction.tangent, &z);
            [dot(&along, &at.omega), second(&series, t, &friction.tangent)]
        };
        let rates = first_powers(&series);
        let is_finite = rates.accelerations.iter().all(|a| a.is_finite());
        is_finite.then(|| Course {
            rates,
            inward: -second(&series, t, &mechanism.walls[self.wall].0),
            sliding: mechanism.frictions.iter().map(sliding).collect(),
        })
    }

    fn strike(&self, at: &FlightMoment<Digits<W>>) -> Option<(Vec<Digits<W>>, Digits<W>)> {
        let (t, coordinates) = (self.motion.state().t + at.late, self.coordinates(at));
        let gap = gap_rate_at(self.motion, self.wall, t, &coordinates);
        let (jump, pulls) =
            friction_impact::jump_at(self.motion, (t, &coordinates), self.others, self.wall, &gap).ok()?;
        let structure = &self.motion.mechanism.structure;
        // What is pulled would be let go, and what rubs takes part.
        let takes_part = |(&other, pull): (&usize, &Digits<W>)| {
            pull.log2() > LEAST_PART && (*pull > Digits::ZERO || structure.friction_at(other).is_some())
        };
        let mut others = self.others.iter().zip(&pulls[structure.standing_rows()..]);
        let jump = jump.filter(|_| !others.any(takes_part))?;
        let after = at.omega.iter().zip(&jump.change).map(|(&omega, &change)| omega + change);
        Some((after.collect(), jump.work))
    }
}
