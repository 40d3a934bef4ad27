//! Points that stay on their walls in many digits: which do, what holds them, and when they are let go.
//!
//! ```text
//! of all points that touch and do not move along their normals, in all digits:
//! a_c >= 0,  f_c >= 0,  a_c f_c = 0      a = a0 + S f,  S = G M⁻¹ Gᵀ,  a0 = 2 g_2 of the gaps without holds
//! stays      v²/2a < δ L:  its rebound is lower than the digits carried, δ = 10^(-D-1.5) ((1-e)/2)²
//! since      t + 2 v/(a (1-e)), when infinitely many bounces would have ended
//! let go     f_c = -lambda_c(t) = 0, by Newton's iteration on the series of the multiplier
//! ```
//!
//! The laws are those of doubles (`dynamics::contact`, `run::contact`).  A point that stays is held by a
//! row, the gap of its wall, after all others; all coordinates are integrated then, and the motion goes back
//! to the independent ones when the last point is let go.  What is left of its normal velocity is taken off
//! it plastically and booked as that of impacts.  Bounces that are left out last `τ = 2 v/(a (1-e))`; what
//! they would change beyond the impulse taken is of the size `a τ²`, which δ keeps below the digits carried.

use super::super::contact::DRIVEN;
use super::coordinates::DigitsCoordinates;
use super::first_passage::{self, FirstPassage};
use super::friction::Flown;
use super::motion::{DigitsMotion, LongState};
use super::projection::DigitsProjection;
use super::simultaneous::{self, MOST};
use super::wall::{gap, gap_rate, refined};
use crate::arithmetic::digits::Digits;
use crate::arithmetic::{Real, Scalar};
use crate::dynamics::Coordinates;
use crate::dynamics::compile::exact::{Acting, ExactMechanism};
use crate::dynamics::friction::simultaneous::Shocks;
use crate::dynamics::friction::{CompiledFriction, FrictionMode, Normal, Transition};
use crate::dynamics::kernel::dot;
use crate::dynamics::series::Series;
use crate::run::event::KEPT;
use crate::stepping::search::TOUCH;
use crate::stepping::{Cause, StepError};

/// Part of the digits in which forces, and velocities along normals, are told from rounding: multipliers lose
/// some to the end of a step.
const SURE: f64 = 0.75;
/// log2 of how far above the last bit a rebound is told from rounding.
const ABOVE: f64 = 12.0;
/// Powers of the rates that accelerations of gaps are taken from.
const POWERS: usize = 2;

/// A time a point stayed on its wall.
#[derive(Clone, Debug)]
pub struct Hold<const W: usize> {
    /// The wall's number.
    pub wall: usize,
    /// Beginning \[s\]: where bounces died out, the time at which infinitely many of them have ended.
    pub since: Digits<W>,
    /// End \[s\]; `None`: it stays.
    pub until: Option<Digits<W>>,
}

impl<const W: usize> Hold<W> {
    /// What is saved of it: the wall, and its times.
    pub fn to_words(&self) -> (usize, Vec<Vec<u64>>) {
        let times = std::iter::once(&self.since).chain(&self.until);
        (self.wall, times.map(Digits::to_words).collect())
    }

    /// What was saved.
    pub fn from_words((wall, words): &(usize, Vec<Vec<u64>>)) -> Option<Self> {
        let times: Option<Vec<Digits<W>>> = words.iter().map(|words| Digits::from_words(words)).collect();
        match times?[..] {
            [since] => Some(Self { wall: *wall, since, until: None }),
            [since, until] => Some(Self { wall: *wall, since, until: Some(until) }),
            _ => None,
        }
    }
}

/// How a hold ends within a step.
pub enum Released<const W: usize> {
    /// It does not.
    Not,
    /// After so many seconds its force is zero.
    After(Digits<W>),
    /// From the first moment on the wall would have to pull.
    Pulled,
}

/// The mechanism without holds and without dry friction.
pub struct Unheld<const W: usize> {
    pub mechanism: ExactMechanism<Digits<W>>,
    pub projection: DigitsProjection<W>,
}

impl<const W: usize> Unheld<W> {
    /// That of a motion.
    pub fn of(motion: &DigitsMotion<W>) -> Result<Self, StepError> {
        Self::but(motion, Vec::new())
    }

    /// The same where points stay on the walls that hold them: dry friction in hinges and sliders takes no
    /// part in impulses.
    pub fn but_held(motion: &DigitsMotion<W>) -> Result<Self, StepError> {
        Self::but(motion, motion.state().acting.held.clone())
    }

    fn but(motion: &DigitsMotion<W>, held: Vec<usize>) -> Result<Self, StepError> {
        let LongState { acting, .. } = motion.state();
        if acting.held == held && acting.sliding.iter().all(|mode| *mode == FrictionMode::Open) {
            return Ok(Self { mechanism: motion.mechanism.clone(), projection: motion.projection.clone() });
        }
        let sliding = vec![FrictionMode::Open; acting.sliding.len()];
        let acting = Acting { held, sliding, ..acting.clone() };
        let mechanism = motion.mechanism.with(acting);
        let mechanism = mechanism.map_err(|error| motion.cannot_go_on(&error, "look at that formula"))?;
        let projection = DigitsProjection::new(&mechanism, motion.precision);
        Ok(Self { mechanism, projection })
    }
}

/// log2 of the part of a force, or of a velocity, that is rounding.
fn sure<const W: usize>(motion: &DigitsMotion<W>) -> f64 {
    motion.precision.rounding(SURE)
}

/// log2 of the height, over the length of its contact, that a point has to rebound to.
pub(super) fn least<const W: usize>(motion: &DigitsMotion<W>, wall: usize) -> f64 {
    let lost = 1.0 - motion.mechanism.walls[wall].1.value();
    let sums = if lost > 0.0 { 2.0 * libm::log2(0.5 * lost) } else { f64::NEG_INFINITY };
    (motion.precision.tolerance() + sums).max(ABOVE - motion.precision.bits as f64)
}

/// What a point does in a step that begins near its wall, from the powers of its gap.
pub fn passage<const W: usize>(
    motion: &DigitsMotion<W>,
    wall: usize,
    powers: &[Digits<W>],
    step: f64,
) -> FirstPassage<W> {
    let (length, least) = (motion.mechanism.structure.contacts[wall].length, least(motion, wall));
    let found = first_passage::passage(powers, length, step, least);
    let FirstPassage::At(near) = found else { return found };
    let is_open = powers[0] > Digits::ZERO && powers[0].log2() - libm::log2(length) > least;
    // Where it begins on its wall, what is left of the gap is rounding.
    FirstPassage::At(refined(motion, if is_open { powers } else { &powers[1..] }, near))
}

/// True where a point comes from its wall, or goes there, so slowly that it stays: by the powers of its gap.
fn is_slow<const W: usize>(motion: &DigitsMotion<W>, wall: usize, powers: &[Digits<W>]) -> bool {
    let length = libm::log2(motion.mechanism.structure.contacts[wall].length);
    let still = sure(motion) + length - libm::log2(motion.mechanism.structure.units.time);
    let falls = 0.5 * (least(motion, wall) + length + 3.0 + powers[2].log2());
    powers[1].log2() <= still.max(falls)
}

/// True where a point that touches its wall goes into it, and not so slowly that it stays.
pub fn is_struck<const W: usize>(motion: &DigitsMotion<W>, wall: usize, powers: &[Digits<W>]) -> bool {
    powers[1] < Digits::ZERO && !is_slow(motion, wall, powers)
}

/// The first row of walls.
fn standing<const W: usize>(motion: &DigitsMotion<W>) -> usize {
    motion.mechanism.structure.standing_rows()
}

/// When the force of the wall at this place among those that hold a point passes zero.
pub fn pressure_ends<const W: usize>(motion: &DigitsMotion<W>, place: usize, step: f64) -> Released<W> {
    let (row, order) = (standing(motion) + place, motion.precision.order);
    let wall = motion.state().acting.held[place];
    let powers: Vec<Digits<W>> = (0..order).map(|m| -motion.series.multipliers(m)[row]).collect();
    let (unit, least) = (motion.mechanism.structure.contacts[wall].force, sure(motion));
    if powers[0] < Digits::ZERO && powers[0].log2() - libm::log2(unit) > least {
        return Released::Pulled;
    }
    match first_passage::passage(&powers, unit, step, least) {
        FirstPassage::Nothing => Released::Not,
        FirstPassage::At(near) => Released::After(refined(motion, &powers, near)),
        FirstPassage::Sinks => Released::After(Digits::ZERO),
    }
}

/// The wall that would have to pull its point most, of impulses by row; beside one of 2^`most` smaller ones
/// are rounding.
pub fn pulled<const W: usize>(motion: &DigitsMotion<W>, impulses: &[Digits<W>], most: f64) -> Option<usize> {
    let held = motion.state().acting.held.iter().zip(&impulses[standing(motion)..]);
    let pulled = held.filter(|(_, pull)| **pull > Digits::ZERO && pull.log2() - most > sure(motion));
    pulled.max_by(|a, b| a.1.log2().total_cmp(&b.1.log2())).map(|(&wall, _)| wall)
}

/// The points that touch and do not move along their normals.
struct Touching<const W: usize> {
    walls: Vec<usize>,
    /// Rates of their gaps \[m/s\].
    rates: Vec<Digits<W>>,
    /// Forces \[N\] and accelerations \[m/s²\], for impulses and velocities.
    problem: Shocks<Digits<W>>,
    /// log2 of the part of a number that is rounding.
    rounding: f64,
}

impl<const W: usize> Touching<W> {
    /// Those of a motion, `wall` among them.
    fn at(motion: &DigitsMotion<W>, wall: usize) -> Result<Self, StepError> {
        let Unheld { mechanism, mut projection } = Unheld::of(motion)?;
        let LongState { t, acting, .. } = motion.state();
        let DigitsCoordinates { phi, omega, .. } = motion.state_coordinates();
        let mut series = Series::of_terms(&mechanism.terms(), Coordinates::All, POWERS);
        series.expand_terms(&mechanism.terms(), *t, &phi, &vec![Digits::ZERO; phi.len()], &omega);
        let (mut walls, mut rates, mut accelerations) = (Vec::new(), Vec::new(), Vec::new());
        let (mut gradients, mut responses) = (Vec::new(), Vec::new());
        for (other, (row, _)) in mechanism.walls.iter().enumerate() {
            let contact = &mechanism.structure.contacts[other];
            let powers = gap(&series, *t, row);
            let touches = || {
                let gap = powers[0].log2() - libm::log2(contact.length);
                let is_behind = powers[0] < Digits::ZERO && gap <= libm::log2(TOUCH);
                is_behind || gap <= least(motion, other) + 1.0
            };
            let is_known = other == wall || acting.held.contains(&other);
            if motion.is_off(row) || !(is_known || touches() && is_slow(motion, other, &powers)) {
                continue;
            }
            let gradient = gap_rate(motion, other).gradient;
            if contact.is_dead(dot(&gradient, &gradient).value()) {
                if other == wall {
                    let what = format!("a point stays on wall {} at a dead centre", row.name);
                    let hint = "there the wall has no hold on it: end the run before";
                    return Err(motion.stop(Cause::RestingContact, 0.0, &what, hint));
                }
                continue;
            }
            walls.push(other);
            rates.push(powers[1]);
            accelerations.push(powers[2].scale(2.0));
            responses.push(projection.response(&mechanism, *t, [&phi, &omega], &gradient).0);
            gradients.push(gradient);
        }
        let rounding = sure(motion);
        let problem = simultaneous::forces([&gradients, &responses], &accelerations, rounding);
        Ok(Self { walls, rates, problem, rounding })
    }

    /// The forces of all walls \[N\]; `None` where there are none that keep the points out of them.
    fn forces(&self) -> Option<Vec<Digits<W>>> {
        (self.walls.len() <= MOST).then(|| self.problem.compression()).flatten()
    }

    /// How much longer a point would go on bouncing on its wall while those of `set` stay \[s\].
    fn bounces_last(&self, wall: usize, set: &[usize], restitution: Digits<W>) -> Digits<W> {
        let Some(place) = self.walls.iter().position(|&other| other == wall) else { return Digits::ZERO };
        let speed = self.rates[place];
        if speed <= Digits::ZERO || restitution >= Digits::ONE {
            return Digits::ZERO;
        }
        // Those that bounce as well do not press.
        let still = speed.log2() + 0.5 * self.rounding;
        let is_other = |&other: &usize| {
            other != place && set.contains(&self.walls[other]) && self.rates[other].log2() < still
        };
        let others: Vec<usize> = (0..self.walls.len()).filter(is_other).collect();
        let inward = self.problem.pressed(&others);
        let inward = inward.map(|forces| -self.problem.after(&self.problem.velocity, &forces)[place]);
        match inward {
            Some(inward) if inward > Digits::ZERO => {
                speed.scale(2.0) / (inward * (Digits::ONE - restitution))
            }
            _ => Digits::ZERO,
        }
    }
}

impl<const W: usize> DigitsMotion<W> {
    /// Finds which of the points that touch stay, where one of them, at `wall`, is pressed or pulled
    /// otherwise than before.
    pub(super) fn rest(&mut self, wall: usize) -> Result<(), StepError> {
        let touching = Touching::at(self, wall)?;
        let Some(forces) = touching.forces() else {
            let name = |&wall: &usize| self.mechanism.structure.contacts[wall].row.name();
            let names = touching.walls.iter().map(name).collect::<Vec<_>>().join(", ");
            let what = format!("a point rests on wall {names} and the constraints leave it no freedom");
            return Err(self.stop(Cause::RestingContact, 0.0, &what, DRIVEN));
        };
        let least = sure(self);
        let is_pressed = |&(&wall, &force): &(&usize, &Digits<W>)| {
            let unit = libm::log2(self.mechanism.structure.contacts[wall].force);
            force > Digits::ZERO && force.log2() - unit > least
        };
        let pressed = touching.walls.iter().zip(&forces).filter(is_pressed);
        let mut set: Vec<usize> = pressed.map(|(&wall, _)| wall).collect();
        let held = &self.state().acting.held;
        if self.has_friction() {
            return self.rest_with_friction(wall, &set, &touching.walls);
        }
        if set == *held {
            // Its force and its acceleration are zero to rounding: what comes after decides.
            match held.contains(&wall) {
                true => set.retain(|&other| other != wall),
                false => set.push(wall),
            }
            set.sort_unstable();
        }
        let since: Vec<Digits<W>> = (set.iter())
            .map(|&wall| self.state().t + touching.bounces_last(wall, &set, self.mechanism.walls[wall].1))
            .collect();
        self.hold(set, Vec::new(), &since, None)
    }

    /// The same where there is friction: `set` would stay without it, `touching` touch.
    fn rest_with_friction(
        &mut self,
        wall: usize,
        set: &[usize],
        touching: &[usize],
    ) -> Result<(), StepError> {
        let before = self.state.acting.clone();
        self.settle_modes_at(set, touching, Transition::default())?;
        let is_same =
            |(now, before): (&FrictionMode<Digits<W>>, &FrictionMode<Digits<W>>)| now.word() == before.word();
        let Acting { held, sliding, .. } = &self.state.acting;
        if *held != before.held || !sliding.iter().zip(&before.sliding).all(is_same) {
            return Ok(());
        }
        // Its force and its acceleration are zero to rounding: what comes after decides.
        let mut set = held.clone();
        match held.contains(&wall) {
            true => set.retain(|&other| other != wall),
            false => set.push(wall),
        }
        set.sort_unstable();
        self.settle_modes_at(&set, &set, Transition::default())
    }

    /// Goes on with these points held, those of them that are not yet from these times on, and places with
    /// friction in these modes.
    pub(super) fn hold(
        &mut self,
        set: Vec<usize>,
        sliding: Vec<FrictionMode<Digits<W>>>,
        since: &[Digits<W>],
        flown: Option<Flown<W>>,
    ) -> Result<(), StepError> {
        let before = self.energy();
        let t = self.state.t;
        let is_new = |wall: &usize| !self.state.acting.held.contains(wall);
        let new: Vec<Hold<W>> = (set.iter().zip(since))
            .filter(|(wall, _)| is_new(wall))
            .map(|(&wall, &since)| Hold { wall, since, until: None })
            .collect();
        let goes = |hold: &Hold<W>| hold.until.is_none() && !set.contains(&hold.wall);
        // What ends before its bounces would have ended has not begun.
        self.state.holds.retain(|hold| !(goes(hold) && t <= hold.since));
        self.state.holds.iter_mut().filter(|hold| goes(hold)).for_each(|hold| hold.until = Some(t));
        let had = self.state.acting.sliding.clone();
        let sticks =
            |modes: &[FrictionMode<Digits<W>>], place: usize| matches!(modes[place], FrictionMode::Stick(_));
        let is_new_row = |place: usize| sticks(&sliding, place) && !sticks(&had, place);
        let begin: Vec<(usize, Digits<W>)> = new.iter().map(|hold| (hold.wall, hold.since)).collect();
        let has_new = !new.is_empty() || (0..sliding.len()).any(is_new_row);
        let is_pressed = new.iter().any(|hold| self.slides_at(hold.wall, &sliding));
        let room = KEPT.saturating_sub(self.state.holds.len());
        self.state.holds.extend(new.into_iter().take(room));
        let acting = Acting { held: set, sliding, ..self.state.acting.clone() };
        self.exchange(&acting).map_err(|error| self.cannot_go_on(&error, "look at that formula"))?;
        self.state.acting = acting;
        // The next series is another one.
        self.state.radius = None;
        self.tell_turns(&had, &begin);
        if has_new {
            let mut flown_work = Digits::ZERO;
            if let Some(Flown { change, work, lost }) = flown {
                self.state.rate.iter_mut().zip(change).for_each(|(rate, change)| *rate += change);
                self.state.lost += lost;
                flown_work = work;
            }
            let pressed = if is_pressed { self.press()? } else { Digits::ZERO };
            let LongState { t, u, rate, .. } = &mut self.state;
            let (work, _) = self.projection.close(&self.mechanism, *t, u, rate);
            self.settle()?;
            let work = work + pressed + flown_work;
            self.state.work += work;
            self.state.jump_energy += self.energy() - before - work;
        }
        Ok(())
    }

    /// True where a point slides along a wall with friction in these modes.
    fn slides_at(&self, wall: usize, modes: &[FrictionMode<Digits<W>>]) -> bool {
        let slides = |(friction, mode): (&CompiledFriction<Digits<W>>, &FrictionMode<Digits<W>>)| {
            friction.normal == Normal::Contact(wall)
                && matches!(mode, FrictionMode::Slip(_) | FrictionMode::Strained(_))
        };
        self.mechanism.frictions.iter().zip(modes).any(slides)
    }

    /// Decides anew what places with friction do, where something else has changed.
    pub(super) fn settle_modes_again(&mut self) -> Result<(), StepError> {
        if !self.has_friction() || !self.state.is_decided {
            return Ok(());
        }
        self.settle_modes(Transition::default())
    }

    /// Lets the points of these walls go.
    pub(super) fn let_go(&mut self, walls: &[usize]) -> Result<(), StepError> {
        let held = self.state.acting.held.iter().copied();
        let set: Vec<usize> = held.filter(|wall| !walls.contains(wall)).collect();
        match set == self.state.acting.held {
            true => Ok(()),
            false if self.has_friction() => self.settle_modes_at(&set, &set, Transition::default()),
            false => self.hold(set, Vec::new(), &[], None),
        }
    }

    /// Lets the points of these walls go while impulses act, after which it is decided what places with
    /// friction do.
    pub(super) fn release(&mut self, walls: &[usize]) -> Result<(), StepError> {
        let LongState { acting, .. } = &self.state;
        let set: Vec<usize> = acting.held.iter().copied().filter(|wall| !walls.contains(wall)).collect();
        if set == acting.held {
            return Ok(());
        }
        let mode = |(friction, mode): (&CompiledFriction<Digits<W>>, &FrictionMode<Digits<W>>)| match friction
            .normal
        {
            Normal::Contact(wall) if walls.contains(&wall) => FrictionMode::Open,
            _ => *mode,
        };
        let sliding = self.mechanism.frictions.iter().zip(&acting.sliding).map(mode).collect();
        self.hold(set, sliding, &[], None)
    }

    /// Lets those points go that leave their walls.
    pub(super) fn let_leaving_go(&mut self) -> Result<(), StepError> {
        let leaving = self.state.acting.held.iter().copied().filter(|&wall| self.leaves(wall));
        let leaving: Vec<usize> = leaving.collect();
        self.let_go(&leaving)
    }

    /// True where the point of a wall moves away from it.
    fn leaves(&self, wall: usize) -> bool {
        let structure = &self.mechanism.structure;
        let unit = libm::log2(structure.contacts[wall].length) - libm::log2(structure.units.time);
        let rate = gap_rate(self, wall).rate;
        rate > Digits::ZERO && rate.log2() - unit > sure(self)
    }

    /// True where the point of a wall is on it and moves with it.
    pub(super) fn follows(&self, wall: usize, gap: Digits<W>) -> bool {
        let structure = &self.mechanism.structure;
        let length = libm::log2(structure.contacts[wall].length);
        let rate = gap_rate(self, wall).rate.log2() - length + libm::log2(structure.units.time);
        gap.log2() - length <= sure(self) && rate <= sure(self)
    }
}
