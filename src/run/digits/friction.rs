//! Dry friction in many digits: which places stick, which slide, and which walls press.
//!
//! The modes are found by the algorithm of doubles ([`modes`](crate::dynamics::friction::modes)), which looks
//! at every combination; accelerations, forces and relative velocities of each are those of all digits, and
//! what is rounding in three quarters of the digits is zero.  Whether a place is held by the others, a matter
//! of geometry, is told in doubles.  A place that sticks is a row like any other, the last ones.

use super::bounces;
use super::coordinates::DigitsCoordinates;
use super::evidence::{InDigits, gradient, second};
use super::motion::{DigitsMotion, LongState};
use super::projection::DigitsProjection;
use super::resting;
use super::wall::{GapRate, distance, gap_rate};
use crate::arithmetic::digits::Digits;
use crate::arithmetic::{Real, Scalar};
use crate::dynamics::Time;
use crate::dynamics::compile::exact::Acting;
use crate::dynamics::contact::bounces::MotionRates;
use crate::dynamics::friction::evidence::Evidence;
use crate::dynamics::friction::modes::Modes;
use crate::dynamics::friction::paradox::{HINT, Paradox};
use crate::dynamics::friction::{self, FrictionMode, FrictionMoment, Normal, Transition};
use crate::dynamics::kernel::dot;
use crate::dynamics::series::Series;
use crate::run::event::KEPT;
use crate::stepping::{Cause, StepError};

/// Part of the digits in which velocities, accelerations and forces are told from rounding.
pub(super) const SURE: f64 = 0.75;
/// What places do, as transitions count it.
const WORDS: [&str; 3] = ["apart", "sticks", "slides"];

/// A place with friction began to stick or to slide, or came apart.
#[derive(Clone, Copy, Debug)]
pub struct Turn<const W: usize> {
    /// Its number.
    pub place: usize,
    /// Time \[s\].
    pub t: Digits<W>,
    /// What it does from then on, by its number among the words.
    does: usize,
}

impl<const W: usize> Turn<W> {
    /// What the place does from then on.
    pub fn word(&self) -> &'static str {
        WORDS[self.does]
    }

    /// What is saved of it.
    pub fn saved(&self) -> (usize, usize, Vec<u64>) {
        (self.place, self.does, self.t.to_words())
    }

    /// What was saved.
    pub fn from_words((place, does, t): &(usize, usize, Vec<u64>)) -> Option<Self> {
        let t = Digits::from_words(t)?;
        (*does < WORDS.len()).then_some(Self { place: *place, t, does: *does })
    }
}

/// A mode as it is saved: its kind, its sign, and where it sticks.
pub fn mode_to_words<const W: usize>(mode: &FrictionMode<Digits<W>>) -> (u8, f64, Vec<u64>) {
    match mode {
        FrictionMode::Open => (0, 0.0, Vec::new()),
        FrictionMode::Stick(at) => (1, 0.0, at.to_words()),
        FrictionMode::Slip(sign) => (2, *sign, Vec::new()),
        FrictionMode::Strained(sign) => (3, *sign, Vec::new()),
    }
}

/// What was saved.
pub fn mode_from_words<const W: usize>(
    (kind, sign, at): &(u8, f64, Vec<u64>),
) -> Option<FrictionMode<Digits<W>>> {
    match kind {
        0 => Some(FrictionMode::Open),
        1 => Digits::from_words(at).map(FrictionMode::Stick),
        2 => Some(FrictionMode::Slip(*sign)),
        3 => Some(FrictionMode::Strained(*sign)),
        _ => None,
    }
}

/// How long bounces last that are left out \[s\], and how the state changes, on the mean where they differ.
type Flight<const W: usize> = (Digits<W>, MotionRates<Digits<W>>);

/// What a motion between bounces that are left out has that one on the wall has not: normal forces of other
/// places, and their friction with them, are others.
pub(super) struct Flown<const W: usize> {
    /// Change of the rates of all coordinates.
    pub change: Vec<Digits<W>>,
    /// Work \[J\].
    pub work: Digits<W>,
    /// Energy lost in friction \[J\].
    pub lost: Digits<W>,
}

/// Walls that hold a point, and what places with friction do.
pub(super) type Decided<const W: usize> = (Vec<usize>, Vec<FrictionMode<Digits<W>>>);

/// How the state changes where a series begins.
pub(super) fn first_powers<const W: usize>(series: &Series<Digits<W>>) -> MotionRates<Digits<W>> {
    let n = series.elements();
    let first = |of: &[Digits<W>]| of.first().copied().unwrap_or(Digits::ZERO);
    let accelerations = series.omega[n..2 * n].to_vec();
    MotionRates { accelerations, power: first(&series.power), lost: first(series.lost()) }
}

impl<const W: usize> DigitsMotion<W> {
    /// True where there is dry friction.
    pub(super) fn has_friction(&self) -> bool {
        !self.mechanism.frictions.is_empty()
    }

    /// The mechanism's own relative velocity of a place \[rad/s, m/s\].
    pub(super) fn speed_unit(&self, place: usize) -> f64 {
        self.mechanism.structure.speed_unit(place)
    }

    /// The mechanism's own force of friction of a place \[N·m, N\]: far below it there is none.
    pub(super) fn friction_unit(&self, place: usize) -> f64 {
        let structure = &self.mechanism.structure;
        structure.energy_scale / structure.displacement_unit(place)
    }

    /// What is told in doubles of a moment.
    fn seen_in_doubles<R>(
        &self,
        t: Digits<W>,
        coordinates: &DigitsCoordinates<W>,
        tell: impl FnOnce(FrictionMoment) -> R,
    ) -> R {
        let in_doubles = |x: &[Digits<W>]| -> Vec<f64> { x.iter().map(|x| x.value()).collect() };
        let (phi, omega) = (in_doubles(&coordinates.phi), in_doubles(&coordinates.omega));
        let z = self.mechanism.structure.elements(&phi);
        tell(FrictionMoment { t: Time::from(t.value()), phi: &phi, z: &z, omega: &omega })
    }

    /// True where motors and locks hold a place, whose velocity friction has no part in.
    pub(super) fn is_driven(&self, place: usize) -> bool {
        let structure = &self.mechanism.structure;
        self.seen_in_doubles(self.state.t, &self.state_coordinates(), |at| structure.is_driven(at, place))
    }

    /// The walls that hold a point and the modes of all places from the present moment on; of walls those
    /// that would hold one without friction, and all that touch and do not move along their normals.
    pub(super) fn decide(
        &self,
        contacts: [&[usize]; 2],
        transition: Transition,
    ) -> Result<Decided<W>, StepError> {
        let (evidence, structure) = (InDigits::of(self), &self.mechanism.structure);
        let before: Vec<FrictionMode> =
            self.state.acting.sliding.iter().map(FrictionMode::in_doubles).collect();
        let found = self.modes_by(&evidence, &before, contacts, transition);
        let (walls, modes) = found.map_err(|paradox| {
            let places: Vec<&str> =
                structure.frictions.iter().map(|friction| friction.name.as_str()).collect();
            self.stop(Cause::Friction, 0.0, &paradox.message(&places.join(", ")), HINT)
        })?;
        let modes = evidence.exact(&modes);
        Ok((walls, modes))
    }

    /// The same at a moment of which this is known.
    pub(super) fn modes_by(
        &self,
        evidence: &InDigits<W>,
        before: &[FrictionMode],
        contacts: [&[usize]; 2],
        transition: Transition,
    ) -> Result<Modes, Paradox> {
        self.seen_in_doubles(evidence.t, &evidence.coordinates, |at| {
            self.mechanism.structure.modes_by(evidence, at, before, contacts, transition)
        })
    }

    /// Decides anew what sticks and what slides, and which walls hold a point: those that do so, or others
    /// that touch.
    pub(super) fn settle_modes(&mut self, transition: Transition) -> Result<(), StepError> {
        let held = self.state.acting.held.clone();
        // Without friction at walls it is known which are pressed.
        let at_wall =
            |friction: &friction::CompiledFriction<_>| matches!(friction.normal, Normal::Contact(_));
        let touching =
            if self.mechanism.frictions.iter().any(at_wall) { self.touching() } else { held.clone() };
        self.settle_modes_at(&held, &touching, transition)
    }

    /// Walls that touch a point which does not move along its normal.
    fn touching(&self) -> Vec<usize> {
        let structure = &self.mechanism.structure;
        let touches = |&wall: &usize| {
            let (row, contact) = (&self.mechanism.walls[wall].0, &structure.contacts[wall]);
            let gap = gap_rate(self, wall);
            self.state.acting.held.contains(&wall)
                || !self.is_off(row)
                    && !contact.is_dead(dot(&gap.gradient, &gap.gradient).value())
                    && self.stands_at(wall, distance(self, row))
        };
        (0..self.mechanism.walls.len()).filter(touches).collect()
    }

    /// True where the point of a wall is on it and moves with it, not at the top of a rebound that is to be
    /// followed.
    fn stands_at(&self, wall: usize, gap: Digits<W>) -> bool {
        let length = libm::log2(self.mechanism.structure.contacts[wall].length);
        let is_low = gap < Digits::ZERO || gap.log2() - length <= resting::least(self, wall) - 1.0;
        is_low && self.follows(wall, gap)
    }

    /// The same with walls that would hold a point without friction, and those that touch.
    pub(super) fn settle_modes_at(
        &mut self,
        staying: &[usize],
        touching: &[usize],
        transition: Transition,
    ) -> Result<(), StepError> {
        let (walls, modes) = self.decide([staying, touching], transition)?;
        self.state.is_decided = true;
        let flights: Vec<_> = walls.iter().map(|&wall| self.flight(wall, &walls, &modes)).collect();
        let last = |flight: &Option<Flight<W>>| flight.as_ref().map_or(Digits::ZERO, |(last, _)| *last);
        let since: Vec<_> = flights.iter().map(|flight| self.state.t + last(flight)).collect();
        let flown = self.flown(flights.iter().flatten(), &walls, &modes);
        self.hold(walls, modes, &since, flown)
    }

    /// How much longer a point would go on bouncing on its wall while these walls hold points and places are
    /// in these modes \[s\], and how it would fly.
    fn flight(&self, wall: usize, walls: &[usize], modes: &[FrictionMode<Digits<W>>]) -> Option<Flight<W>> {
        let (speed, restitution) = (gap_rate(self, wall).rate, self.mechanism.walls[wall].1);
        if self.state.acting.held.contains(&wall) || speed <= Digits::ZERO || restitution >= Digits::ONE {
            return None;
        }
        // Those that bounce as well do not press.
        let evidence = InDigits::of(self);
        let still = speed.log2() + 0.5 * evidence.rounding;
        let presses = |&other: &usize| {
            other != wall
                && (self.state.acting.held.contains(&other) || gap_rate(self, other).rate.log2() < still)
        };
        let others: Vec<usize> = walls.iter().copied().filter(presses).collect();
        let flies = |normal| matches!(normal, Normal::Contact(contact) if !others.contains(&contact));
        let mode = |(friction, mode): (&friction::CompiledFriction<Digits<W>>, &FrictionMode<Digits<W>>)| {
            if flies(friction.normal) { FrictionMode::Open } else { mode.in_doubles() }
        };
        let modes: Vec<FrictionMode> = self.mechanism.frictions.iter().zip(modes).map(mode).collect();
        if let Some(bounced) = bounces::all(self, wall, &others, &modes) {
            return Some((bounced.last, bounced.mean(&evidence.coordinates.omega)));
        }
        let mechanism = evidence.mechanism(&others, &modes)?;
        let series = evidence.series(&mechanism);
        let inward = -second(&series, self.state.t, &mechanism.walls[wall].0);
        let last = speed.scale(2.0) / (inward * (Digits::ONE - restitution));
        // Others at their limits may not share the load without it.
        let is_motion = inward > Digits::ZERO && evidence.hold_so(&others, &modes);
        is_motion.then(|| (last, first_powers(&series)))
    }

    /// What flights change while bounces last, beside what is so where these walls hold their points at once.
    fn flown<'a>(
        &self,
        flights: impl Iterator<Item = &'a Flight<W>>,
        walls: &[usize],
        modes: &[FrictionMode<Digits<W>>],
    ) -> Option<Flown<W>> {
        let mut flights = flights.peekable();
        flights.peek()?;
        let evidence = InDigits::of(self);
        let modes: Vec<FrictionMode> = modes.iter().map(FrictionMode::in_doubles).collect();
        let held = evidence.series(&evidence.mechanism(walls, &modes)?);
        let held = first_powers(&held);
        let change = vec![Digits::ZERO; held.accelerations.len()];
        let nothing = Flown { change, work: Digits::ZERO, lost: Digits::ZERO };
        Some(flights.fold(nothing, |mut flown, (last, flight)| {
            let accelerations = flight.accelerations.iter().zip(&held.accelerations);
            let changes = flown.change.iter_mut().zip(accelerations);
            changes.for_each(|(change, (&flies, &is_held))| *change += (flies - is_held) * *last);
            flown.work += (flight.power - held.power) * *last;
            flown.lost += (flight.lost - held.lost) * *last;
            flown
        }))
    }

    /// Takes the velocities along their normals off points that come to rest on walls along which they slide,
    /// by impulses with their friction; returns the work of walls that move \[J\].
    pub(super) fn press(&mut self) -> Result<Digits<W>, StepError> {
        let LongState { t, acting, .. } = self.state.clone();
        let sliding: Vec<(usize, usize)> = (self.mechanism.frictions.iter().zip(&acting.sliding).enumerate())
            .filter_map(|(place, (friction, mode))| match (friction.normal, mode) {
                (Normal::Contact(wall), FrictionMode::Slip(_) | FrictionMode::Strained(_)) => {
                    Some((place, wall))
                }
                _ => None,
            })
            .collect();
        let is_rubbed = |wall: &usize| sliding.iter().any(|(_, other)| other == wall);
        let held = acting.held.iter().copied().filter(|wall| !is_rubbed(wall)).collect();
        let kept = |mode: &FrictionMode<Digits<W>>| match mode {
            FrictionMode::Stick(at) => FrictionMode::Stick(*at),
            _ => FrictionMode::Open,
        };
        let modes = acting.sliding.iter().map(kept).collect();
        let rest = self.mechanism.with(Acting { held, sliding: modes, ..acting.clone() });
        let rest = rest.map_err(|error| self.cannot_go_on(&error, "look at that formula"))?;
        let mut projection = DigitsProjection::new(&rest, self.precision);
        let DigitsCoordinates { phi, mut omega, .. } = self.state_coordinates();
        let (mut work, _) = projection.close(&rest, t, &phi, &mut omega);
        let z = self.mechanism.elements(&phi);
        // Points that what sticks holds along their normals have nothing to be taken off.
        let mut is_free = |gap: &GapRate<W>| {
            let (response, _) = projection.response(&rest, t, [&phi, &omega], &gap.gradient);
            !response.iter().all(Digits::is_zero)
        };
        let (places, gaps): (Vec<usize>, Vec<_>) = (sliding.iter())
            .map(|&(place, wall)| (place, gap_rate(self, wall)))
            .filter(|(_, gap)| is_free(gap))
            .unzip();
        let pushes = places.iter().zip(&gaps).map(|(&place, gap)| {
            let friction = &self.mechanism.frictions[place];
            let coefficient = acting.sliding[place].coefficient(friction).unwrap_or(Digits::ZERO);
            let along = gradient(&friction.tangent, &z);
            gap.gradient.iter().zip(along).map(|(&g, along)| g - coefficient * along).collect::<Vec<_>>()
        });
        let responses: Vec<Vec<Digits<W>>> =
            pushes.map(|push| projection.response(&rest, t, [&phi, &omega], &push).0).collect();
        let entry = |gap: &GapRate<W>| {
            responses.iter().map(|response| dot(&gap.gradient, response)).collect::<Vec<_>>()
        };
        let mut matrix: Vec<_> = gaps.iter().flat_map(entry).collect();
        let mut impulses: Vec<_> = gaps.iter().map(|gap| gap.travel - dot(&gap.gradient, &omega)).collect();
        friction::solve(&mut matrix, &mut impulses);
        for ((response, &impulse), gap) in responses.iter().zip(&impulses).zip(&gaps) {
            omega.iter_mut().zip(response).for_each(|(omega, &change)| *omega += change * impulse);
            work += gap.travel * impulse;
        }
        // All coordinates are integrated where a point is held.
        self.state.rate = omega;
        Ok(work)
    }

    /// Lists what places begin to do that were in these modes; at walls that are held from these times on,
    /// then.
    pub(super) fn tell_turns(&mut self, before: &[FrictionMode<Digits<W>>], begin: &[(usize, Digits<W>)]) {
        let LongState { t: now, acting, turns, .. } = &mut self.state;
        let does =
            |mode: &FrictionMode<Digits<W>>| WORDS.iter().position(|word| *word == mode.word()).unwrap_or(0);
        for (place, (mode, before)) in acting.sliding.iter().zip(before).enumerate() {
            if does(mode) == does(before) {
                continue;
            }
            let normal = self.mechanism.frictions[place].normal;
            let at_wall = begin.iter().find(|(wall, _)| normal == Normal::Contact(*wall));
            let t = at_wall.map_or(*now, |(_, since)| *since);
            let last = turns.iter().rposition(|turn| turn.place == place);
            // What changes twice at one moment has done so once, or not at all.
            if let Some(last) = last.filter(|&last| turns[last].t >= *now) {
                turns.remove(last);
                let known = turns.iter().rfind(|turn| turn.place == place).map_or(0, |turn| turn.does);
                if known == does(mode) {
                    continue;
                }
            }
            if turns.len() < KEPT {
                turns.push(Turn { place, t, does: does(mode) });
            }
        }
    }
}
