//! The lanes, what they do, and which trajectories are in them.

use super::interior::{InLane, Interior};
use super::{Batch, BatchMember, BatchObserver, Going, JUDGES, Passage, Team};
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::wide::EightLanes;
use crate::dynamics::{Motion, State, Time};
use crate::stepping::taylor::step_size::{self, StepSize};
use crate::stepping::taylor::stop;
use crate::stepping::{Cause, Statistics, StepError};
use std::cell::RefCell;

/// What a lane is doing.
#[derive(Clone, Debug)]
pub(super) struct LaneSlot {
    /// Index of its trajectory.
    pub(super) member: Option<usize>,
    pub(super) step_size: StepSize,
    pub(super) time: Time,
    /// The mechanism's unit of time \[s\].
    pub(super) unit: f64,
    /// What is left to go, the last step wanted and the one taken \[s\].
    pub(super) left: f64,
    pub(super) wanted: f64,
    pub(super) taken: f64,
    /// True where events may end the motion.
    has_stops: bool,
    /// True where one is in the step, which is not taken: the trajectory leaves.
    is_leaving: bool,
}

impl LaneSlot {
    /// Why the step just expanded cannot be taken, where it cannot.
    fn failure(&self, statistics: &Statistics) -> Result<(), StepError> {
        let hint = "look for a position without inertia";
        let stop = |cause, what: &str| {
            stop(cause, &State { time: self.time, ..State::default() }, self.taken, what.into(), hint)
        };
        if self.wanted.is_nan() {
            Err(stop(Cause::NotFinite, "the series is not finite"))
        } else if self.wanted < 1e-14 * self.time.hi.abs().max(1e-3 * self.unit) {
            Err(stop(Cause::StepTooSmall, "the series converges in ever smaller circles"))
        } else {
            statistics.check("taylor", self.time.hi, self.taken)
        }
    }
}

/// Lanes, and what they do.
pub(super) struct LaneSlots<T> {
    pub(super) slots: [LaneSlot; LANES],
    pub(super) team: Box<T>,
    /// Room for motions inside a step.
    inside: RefCell<Interior>,
}

impl<T: Team> LaneSlots<T> {
    /// Empty lanes.
    pub(super) fn new(team: T, order: usize, until: Time) -> Self {
        let empty = || LaneSlot {
            member: None,
            step_size: StepSize::new(1.0, order, 0.0),
            time: until,
            unit: 1.0,
            left: 0.0,
            wanted: 0.0,
            taken: 0.0,
            has_stops: false,
            is_leaving: false,
        };
        let inside = RefCell::default();
        Self { slots: std::array::from_fn(|_| empty()), team: Box::new(team), inside }
    }

    /// Puts trajectories that wait into the free lanes.
    pub(super) fn fill(
        &mut self,
        batch: &Batch,
        fits: &[bool],
        members: &[BatchMember],
        waiting: &mut usize,
        until: Time,
    ) {
        for lane in 0..LANES {
            if self.slots[lane].member.is_none() {
                let next = next(fits, members, waiting, until);
                self.slots[lane].member = next;
                match next {
                    Some(index) => self.take_in(lane, batch, &members[index]),
                    None => self.team.park(lane),
                }
            }
            let slot = &mut self.slots[lane];
            slot.left = if slot.member.is_some() { (until - slot.time).hi } else { 0.0 };
        }
    }

    /// Puts a trajectory into a lane.
    fn take_in(&mut self, lane: usize, batch: &Batch, member: &BatchMember) {
        let (longest, unit) = (self.team.take_in(lane, member, batch.order), member.mechanism.units.time);
        let slot = &mut self.slots[lane];
        slot.step_size = StepSize::new(batch.tolerance, batch.order, longest).over(unit);
        (slot.time, slot.unit) = (member.state.time, unit);
        slot.has_stops = member.mechanism.has_stops();
    }

    /// True where no lane has a trajectory.
    pub(super) fn is_idle(&self) -> bool {
        self.slots.iter().all(|slot| slot.member.is_none())
    }

    /// The steps \[s\] that the series just expanded allow.
    #[inline(always)]
    pub(super) fn choose_steps<W: EightLanes>(&mut self, order: usize, tolerance: f64) -> Octet {
        let (sizes, mut taken) = (self.team.sizes::<W>(order), Octet::splat(0.0));
        for (lane, (slot, taken)) in self.slots.iter_mut().zip(&mut taken.0).enumerate() {
            (slot.wanted, slot.taken) = (f64::NAN, 0.0);
            if self.team.is_finite(lane, order) && !self.team.is_leaving(lane) {
                let mut own = [0.0; JUDGES];
                for back in 0..JUDGES {
                    own[back] = sizes[back].0[lane];
                }
                slot.wanted = slot.step_size.step_of(order, &own);
                slot.wanted = self.team.allowed(lane, slot, order, tolerance);
                slot.taken = step_size::taken(slot.wanted, slot.left);
            }
            *taken = slot.taken;
        }
        taken
    }

    /// Shows the steps about to be taken where events may end a motion, and takes none with one in it.
    pub(super) fn look_ahead(
        &mut self,
        order: usize,
        members: &[BatchMember],
        taken: &mut Octet,
        observer: &mut dyn BatchObserver,
    ) {
        let Self { slots, team, inside } = self;
        for (lane, (slot, taken)) in slots.iter_mut().zip(&mut taken.0).enumerate() {
            slot.is_leaving = false;
            let Some(index) = slot.member.filter(|_| slot.has_stops && slot.taken > 0.0) else { continue };
            let member = &members[index];
            let (from, step) = (slot.time, slot.taken);
            let series = |body: usize, after: f64| team.at(order, lane, body, after);
            let ends = |body: usize| [0.0, step].map(|after| series(body, after).into());
            inside.borrow_mut().forget();
            let motion = |after: f64, motion: &mut Motion| {
                inside.borrow_mut().look::<T>(team, member, InLane { order, lane, from }, after, motion);
            };
            slot.is_leaving = observer.ahead(index, &Passage::new(from, step, &ends, &series, &motion));
            if slot.is_leaving {
                (slot.taken, *taken) = (0.0, 0.0);
            }
        }
    }

    /// Records the steps just taken, and frees the lanes of trajectories that have ended.
    pub(super) fn arrive(
        &mut self,
        order: usize,
        members: &mut [BatchMember],
        until: Time,
        observer: &mut dyn BatchObserver,
    ) {
        for lane in 0..LANES {
            let slot = &mut self.slots[lane];
            let Some(index) = slot.member else { continue };
            let member = &mut members[index];
            if slot.is_leaving || self.team.is_leaving(lane) {
                (member.has_left, member.state.time) = (true, slot.time);
                self.team.leave(lane, &mut member.state);
                continue;
            }
            let (from, step) = (slot.time, slot.taken);
            match slot.failure(&member.statistics) {
                Err(stop) => member.stopped = Some(stop),
                Ok(()) => {
                    slot.time = if step == slot.left { until } else { from + step };
                    member.statistics.steps += 1;
                    member.statistics.evaluations += 1;
                }
            }
            let time = slot.time;
            let series = |body: usize, after: f64| self.team.at(order, lane, body, after);
            let ends = |body: usize| self.team.ends(lane, body);
            self.inside.get_mut().forget();
            let motion = |after: f64, motion: &mut Motion| {
                let mut inside = self.inside.borrow_mut();
                if after >= step {
                    inside.end::<T>(&self.team, member, lane, time, motion);
                } else {
                    inside.look::<T>(&self.team, member, InLane { order, lane, from }, after, motion);
                }
            };
            let passage = Passage::new(from, step, &ends, &series, &motion);
            let is_over =
                member.stopped.is_some() || observer.step(index, &passage) == Going::Enough || time >= until;
            self.team.wrap(lane, &mut member.state.turns);
            if is_over {
                self.team.leave(lane, &mut member.state);
                member.state.time = time;
                self.slots[lane].member = None;
            }
        }
    }
}

impl<T: Team> LaneSlots<T> {
    /// Has those taken on that have left, and takes in again those that come back.
    pub(super) fn bring_back(
        &mut self,
        batch: &Batch,
        members: &mut [BatchMember],
        until: Time,
        observer: &mut dyn BatchObserver,
    ) {
        for lane in 0..LANES {
            let Some(index) = self.slots[lane].member else { continue };
            let member = &mut members[index];
            if !member.has_left {
                continue;
            }
            self.slots[lane].member = None;
            if observer.alone(index, member) == Going::On && member.state.time < until {
                self.slots[lane].member = Some(index);
                self.take_in(lane, batch, member);
            }
        }
    }
}

/// The next trajectory of this kind that has a way to go.
fn next(fits: &[bool], members: &[BatchMember], waiting: &mut usize, until: Time) -> Option<usize> {
    while *waiting < members.len() {
        let (index, member) = (*waiting, &members[*waiting]);
        *waiting += 1;
        if fits[index] && member.state.time < until {
            return Some(index);
        }
    }
    None
}
