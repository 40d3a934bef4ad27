//! Dry friction in many digits: which places stick, which slide, and which walls press.
//!
//! The modes are found by the algorithm of doubles ([`modes`](crate::dynamics::friction::modes)), which looks
//! at every combination; accelerations, forces and relative velocities of each are those of all digits, and
//! what is rounding in three quarters of the digits is zero.  Whether a place is held by the others, a matter
//! of geometry, is told in doubles.  A place that sticks is a row like any other, the last ones.

use super::keep::Keeper;
use super::motion::{LongState, Motion};
use super::posture::Posture;
use super::wall::{gap, gap_rate};
use crate::arithmetic::digits::Digits;
use crate::arithmetic::{Complex, Real, Scalar};
use crate::dynamics::compile::exact::{Acting, ExactMechanism};
use crate::dynamics::constraint::{ConstraintEquation, Measure};
use crate::dynamics::friction::modes::{Evidence, HINT, Told};
use crate::dynamics::friction::{self, Mode, Moment, Normal, Transition};
use crate::dynamics::kernel::dot;
use crate::dynamics::series::Series;
use crate::dynamics::{Coordinates, Time};
use crate::stepping::{Cause, StepError};

/// Part of the digits in which velocities, accelerations and forces are told from rounding.
pub(super) const SURE: f64 = 0.75;
/// Powers of the rates that accelerations are taken from.
const POWERS: usize = 2;
/// Transitions that are kept.
const KEPT: usize = 100_000;
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
    pub fn to_words(&self) -> (usize, usize, Vec<u64>) {
        (self.place, self.does, self.t.to_words())
    }

    /// What was saved.
    pub fn from_words((place, does, t): &(usize, usize, Vec<u64>)) -> Option<Self> {
        let t = Digits::from_words(t)?;
        (*does < WORDS.len()).then_some(Self { place: *place, t, does: *does })
    }
}

/// A mode as it is saved: its kind, its sign, and where it sticks.
pub fn mode_to_words<const W: usize>(mode: &Mode<Digits<W>>) -> (u8, f64, Vec<u64>) {
    match mode {
        Mode::Open => (0, 0.0, Vec::new()),
        Mode::Stick(at) => (1, 0.0, at.to_words()),
        Mode::Slip(sign) => (2, *sign, Vec::new()),
        Mode::Strained(sign) => (3, *sign, Vec::new()),
    }
}

/// What was saved.
pub fn mode_from_words<const W: usize>((kind, sign, at): &(u8, f64, Vec<u64>)) -> Option<Mode<Digits<W>>> {
    match kind {
        0 => Some(Mode::Open),
        1 => Digits::from_words(at).map(Mode::Stick),
        2 => Some(Mode::Slip(*sign)),
        3 => Some(Mode::Strained(*sign)),
        _ => None,
    }
}

/// What is known of a moment in many digits.
struct InDigits<'a, const W: usize> {
    motion: &'a Motion<W>,
    posture: Posture<W>,
    z: Vec<Complex<Digits<W>>>,
    /// Where each place sticks, if it does.
    anchors: Vec<Digits<W>>,
    /// log2 of the part of a number that is rounding.
    rounding: f64,
}

impl<'a, const W: usize> InDigits<'a, W> {
    fn of(motion: &'a Motion<W>) -> Self {
        let posture = motion.state_posture();
        let mechanism = &motion.mechanism;
        let z = mechanism.elements(&posture.phi);
        let anchor = |(friction, mode): (&friction::Friction<Digits<W>>, &Mode<Digits<W>>)| match mode {
            Mode::Stick(at) => *at,
            _ => friction.displacement(&posture.phi, &z),
        };
        let anchors = mechanism.frictions.iter().zip(&mechanism.acting.sliding).map(anchor).collect();
        Self { motion, posture, z, anchors, rounding: motion.precision.rounding(SURE) }
    }

    /// Modes with the displacements of what sticks in all digits.
    fn exact(&self, modes: &[Mode]) -> Vec<Mode<Digits<W>>> {
        let exact = |(mode, &at): (&Mode, &Digits<W>)| match *mode {
            Mode::Open => Mode::Open,
            Mode::Stick(_) => Mode::Stick(at),
            Mode::Slip(sign) => Mode::Slip(sign),
            Mode::Strained(sign) => Mode::Strained(sign),
        };
        modes.iter().zip(&self.anchors).map(exact).collect()
    }

    fn mechanism(&self, closed: &[usize], modes: &[Mode]) -> Option<ExactMechanism<Digits<W>>> {
        let (held, sliding) = (closed.to_vec(), self.exact(modes));
        self.motion.mechanism.with(Acting { held, sliding, ..self.motion.state.acting.clone() }).ok()
    }

    /// The first powers of the motion in these modes.
    fn series(&self, mechanism: &ExactMechanism<Digits<W>>) -> Series<Digits<W>> {
        let Posture { phi, omega, .. } = &self.posture;
        let mut series = Series::of_terms(&mechanism.terms(), Coordinates::All, POWERS);
        series.resolve_reversals(self.rounding);
        let zeros = vec![Digits::ZERO; phi.len()];
        series.expand_terms(&mechanism.terms(), self.motion.state.t, phi, &zeros, omega);
        series
    }

    /// The relative velocity of a place at these rates, zero where it is rounding.
    fn rate(&self, place: usize, omega: &[Digits<W>]) -> f64 {
        let gradient = gradient(&self.motion.mechanism.frictions[place].tangent, &self.z);
        let rate = dot(&gradient, omega);
        let parts = gradient.iter().zip(omega).fold(Digits::ZERO, |sum, (&g, &w)| sum + (g * w).abs());
        let unit = self.motion.speed_unit(place);
        match sign(rate, parts.log2().max(libm::log2(unit)) + self.rounding) {
            0 => 0.0,
            side => f64::from(side) * rate.value().abs().max(f64::MIN_POSITIVE),
        }
    }

    /// The sign of the acceleration of what a row measures, where `unit` is the mechanism's own.
    fn speeding(&self, series: &Series<Digits<W>>, row: &ConstraintEquation<Digits<W>>, unit: f64) -> i8 {
        let n = self.z.len();
        let acceleration = second(series, self.motion.state.t, row);
        let along = gradient(row, &self.z);
        let accelerations = &series.omega[n..2 * n];
        let parts = along.iter().zip(accelerations).fold(Digits::ZERO, |sum, (&g, &a)| sum + (g * a).abs());
        let left = acceleration - dot(&along, accelerations);
        sign(acceleration, (parts + left.abs()).log2().max(libm::log2(unit)) + self.rounding)
    }
}

/// The second derivative of what a row measures.
fn second<const W: usize>(
    series: &Series<Digits<W>>,
    t: Digits<W>,
    row: &ConstraintEquation<Digits<W>>,
) -> Digits<W> {
    let n = series.elements();
    match row.measure {
        Measure::Place(_) => gap(series, t, row)[2].scale(2.0),
        Measure::Angle { body, base } => {
            base.map_or(series.omega[n + body], |base| series.omega[n + body] - series.omega[n + base])
        }
    }
}

/// The sign of a number, zero where its log2 is not above this.
fn sign<const W: usize>(x: Digits<W>, least: f64) -> i8 {
    let size = x.log2();
    match size > least {
        true if x < Digits::ZERO => -1,
        true => 1,
        false => 0,
    }
}

/// The gradient of what a row measures, by all coordinates.
pub(super) fn gradient<const W: usize>(
    row: &ConstraintEquation<Digits<W>>,
    z: &[Complex<Digits<W>>],
) -> Vec<Digits<W>> {
    let mut gradient = vec![Digits::ZERO; z.len()];
    match &row.measure {
        Measure::Place(place) => place.slopes(z, |k, slope| gradient[k] += slope),
        Measure::Angle { body, base } => {
            gradient[*body] += Digits::ONE;
            base.iter().for_each(|&base| gradient[base] -= Digits::ONE);
        }
    }
    gradient
}

impl<const W: usize> Evidence for InDigits<'_, W> {
    fn rates(&self) -> Vec<f64> {
        (0..self.anchors.len()).map(|place| self.rate(place, &self.posture.omega)).collect()
    }

    fn told(&self, closed: &[usize], modes: &[Mode], touching: &[usize]) -> Option<Told> {
        let mechanism = self.mechanism(closed, modes)?;
        let series = self.series(&mechanism);
        let (n, rows) = (self.z.len(), series.multipliers(0));
        let load = &series.omega[n..2 * n];
        if !load.iter().chain(rows).all(|x| x.is_finite()) {
            return None;
        }
        let structure = &mechanism.structure;
        let standing = structure.standing_rows();
        let pressure = |(&contact, &force): (&usize, &Digits<W>)| {
            sign(-force, libm::log2(structure.contacts[contact].force) + self.rounding)
        };
        let most = rows.iter().map(Digits::log2).fold(f64::NEG_INFINITY, f64::max);
        let mut stuck = rows[standing + closed.len()..].iter().zip(series.sticks());
        let grip = |(friction, mode): (&friction::Friction<Digits<W>>, &Mode)| match mode {
            Mode::Stick(_) => stuck.next().map_or(0, |(tau, normal)| {
                let pressing = friction::size(friction.normal, normal[0]).0;
                let size = pressing.log2().max(most) + friction.stiction.log2();
                sign(friction.stiction * pressing - tau.abs(), size + self.rounding)
            }),
            _ => 0,
        };
        let time = structure.units.time;
        let gap = |&contact: &usize| {
            let unit = structure.contacts[contact].length / (time * time);
            self.speeding(&series, &mechanism.walls[contact].0, unit)
        };
        let speeding = |(place, friction): (usize, &friction::Friction<Digits<W>>)| {
            self.speeding(&series, &friction.tangent, self.motion.speed_unit(place) / time)
        };
        Some(Told {
            regularity: series.regularity(),
            pressures: closed.iter().zip(&rows[standing..]).map(pressure).collect(),
            leaving: touching.iter().map(gap).collect(),
            grips: mechanism.frictions.iter().zip(modes).map(grip).collect(),
            speeding: mechanism.frictions.iter().enumerate().map(speeding).collect(),
            load: load.iter().map(|x| x.value()).collect(),
        })
    }

    fn is_still(&self, place: usize, closed: &[usize], modes: &[Mode], _is_driven: bool) -> bool {
        let mut modes = modes.to_vec();
        modes[place] = Mode::Open;
        self.told(closed, &modes, &[]).is_some_and(|told| told.speeding[place] == 0)
    }

    fn stands(&self, place: usize, closed: &[usize]) -> bool {
        let Some(mechanism) = self.mechanism(closed, &vec![Mode::Open; self.anchors.len()]) else {
            return false;
        };
        let Posture { phi, mut omega, .. } = self.posture.clone();
        let mut keeper = Keeper::new(&mechanism, self.motion.precision);
        keeper.close(&mechanism, self.motion.state.t, &phi, &mut omega);
        self.rate(place, &omega) == 0.0
    }
}

/// Walls that hold a point, and what places with friction do.
pub(super) type Decided<const W: usize> = (Vec<usize>, Vec<Mode<Digits<W>>>);

impl<const W: usize> Motion<W> {
    /// True where there is dry friction.
    pub(super) fn has_friction(&self) -> bool {
        !self.mechanism.frictions.is_empty()
    }

    /// The mechanism's own relative velocity of a place \[rad/s, m/s\].
    pub(super) fn speed_unit(&self, place: usize) -> f64 {
        let structure = &self.mechanism.structure;
        structure.displacement_unit(place) / structure.units.time
    }

    /// What is told in doubles of the present moment.
    fn seen_in_doubles<R>(&self, posture: &Posture<W>, tell: impl FnOnce(Moment) -> R) -> R {
        let in_doubles = |x: &[Digits<W>]| -> Vec<f64> { x.iter().map(|x| x.value()).collect() };
        let (phi, omega) = (in_doubles(&posture.phi), in_doubles(&posture.omega));
        let z = self.mechanism.structure.elements(&phi);
        tell(Moment { t: Time::from(self.state.t.value()), phi: &phi, z: &z, omega: &omega })
    }

    /// True where motors and locks hold a place, whose velocity friction has no part in.
    pub(super) fn is_driven(&self, place: usize) -> bool {
        let structure = &self.mechanism.structure;
        self.seen_in_doubles(&self.state_posture(), |at| structure.is_driven(at, place))
    }

    /// The walls that hold a point and the modes of all places from the present moment on; of walls those that
    /// would hold one without friction, and all that touch and do not move along their normals.
    pub(super) fn decide(
        &self,
        contacts: [&[usize]; 2],
        transition: Transition,
    ) -> Result<Decided<W>, StepError> {
        let (evidence, structure) = (InDigits::of(self), &self.mechanism.structure);
        let before: Vec<Mode> = self.state.acting.sliding.iter().map(Mode::in_doubles).collect();
        let found = self.seen_in_doubles(&evidence.posture, |at| {
            structure.modes_by(&evidence, at, &before, contacts, transition)
        });
        let (walls, modes) = found.map_err(|paradox| {
            let places: Vec<&str> =
                structure.frictions.iter().map(|friction| friction.name.as_str()).collect();
            self.stop(Cause::Friction, 0.0, &paradox.message(&places.join(", ")), HINT)
        })?;
        let modes = evidence.exact(&modes);
        Ok((walls, modes))
    }

    /// Decides anew what sticks and what slides, and which of these walls hold a point.
    pub(super) fn rub(&mut self, walls: &[usize], transition: Transition) -> Result<(), StepError> {
        self.rub_at(walls, walls, transition)
    }

    /// The same where other walls are touched as well.
    pub(super) fn rub_at(
        &mut self,
        staying: &[usize],
        touching: &[usize],
        transition: Transition,
    ) -> Result<(), StepError> {
        let (walls, modes) = self.decide([staying, touching], transition)?;
        self.state.is_decided = true;
        let since: Vec<Digits<W>> =
            walls.iter().map(|&wall| self.state.t + self.bounces_last(wall, &walls, &modes)).collect();
        self.hold(walls, modes, &since)
    }

    /// How much longer a point would go on bouncing on its wall while these walls hold points and places are in
    /// these modes \[s\].
    fn bounces_last(&self, wall: usize, walls: &[usize], modes: &[Mode<Digits<W>>]) -> Digits<W> {
        let (speed, restitution) = (gap_rate(self, wall).rate, self.mechanism.walls[wall].1);
        if self.state.acting.held.contains(&wall) || speed <= Digits::ZERO || restitution >= Digits::ONE {
            return Digits::ZERO;
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
        let mode = |(friction, mode): (&friction::Friction<Digits<W>>, &Mode<Digits<W>>)| {
            if flies(friction.normal) { Mode::Open } else { mode.in_doubles() }
        };
        let modes: Vec<Mode> = self.mechanism.frictions.iter().zip(modes).map(mode).collect();
        let Some(mechanism) = evidence.mechanism(&others, &modes) else { return Digits::ZERO };
        let series = evidence.series(&mechanism);
        let inward = -second(&series, self.state.t, &mechanism.walls[wall].0);
        match inward > Digits::ZERO {
            true => speed.scale(2.0) / (inward * (Digits::ONE - restitution)),
            false => Digits::ZERO,
        }
    }

    /// Takes the velocities along their normals off points that come to rest on walls along which they slide,
    /// by impulses with their friction; returns the work of walls that move \[J\].
    pub(super) fn press(&mut self) -> Result<Digits<W>, StepError> {
        let LongState { t, acting, .. } = self.state.clone();
        let sliding: Vec<(usize, usize)> = (self.mechanism.frictions.iter().zip(&acting.sliding).enumerate())
            .filter_map(|(place, (friction, mode))| match (friction.normal, mode) {
                (Normal::Contact(wall), Mode::Slip(_) | Mode::Strained(_)) => Some((place, wall)),
                _ => None,
            })
            .collect();
        let is_rubbed = |wall: &usize| sliding.iter().any(|(_, other)| other == wall);
        let held = acting.held.iter().copied().filter(|wall| !is_rubbed(wall)).collect();
        let kept = |mode: &Mode<Digits<W>>| match mode {
            Mode::Stick(at) => Mode::Stick(*at),
            _ => Mode::Open,
        };
        let modes = acting.sliding.iter().map(kept).collect();
        let rest = self.mechanism.with(Acting { held, sliding: modes, ..acting.clone() });
        let rest = rest.map_err(|error| self.cannot_go_on(&error, "look at that formula"))?;
        let mut keeper = Keeper::new(&rest, self.precision);
        let Posture { phi, mut omega, .. } = self.state_posture();
        let (mut work, _) = keeper.close(&rest, t, &phi, &mut omega);
        let z = self.mechanism.elements(&phi);
        let gaps: Vec<_> = sliding.iter().map(|&(_, wall)| gap_rate(self, wall)).collect();
        let pushes = sliding.iter().zip(&gaps).map(|(&(place, _), gap)| {
            let friction = &self.mechanism.frictions[place];
            let coefficient = acting.sliding[place].coefficient(friction).unwrap_or(Digits::ZERO);
            let along = gradient(&friction.tangent, &z);
            gap.gradient.iter().zip(along).map(|(&g, along)| g - coefficient * along).collect::<Vec<_>>()
        });
        let responses: Vec<Vec<Digits<W>>> =
            pushes.map(|push| keeper.response(&rest, t, [&phi, &omega], &push).0).collect();
        let entry = |gap: &super::wall::GapRate<W>| {
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

    /// Lists what places begin to do that were in these modes; at walls that are held from these times on, then.
    pub(super) fn tell_turns(&mut self, before: &[Mode<Digits<W>>], begin: &[(usize, Digits<W>)]) {
        let LongState { t: now, acting, turns, .. } = &mut self.state;
        let does = |mode: &Mode<Digits<W>>| WORDS.iter().position(|word| *word == mode.word()).unwrap_or(0);
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
