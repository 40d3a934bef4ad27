//! The lanes, what they do, and which trajectories are in them.

use super::clock::{LaneClock, LaneStep};
use super::interior::{InLane, Interior};
use super::{Batch, BatchMember, BatchObserver, Going, LaneKernel, TakenStep};
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::wide::EightLanes;
use crate::dynamics::{Motion, State, Time};
use crate::stepping::taylor::approach::Approach;
use crate::stepping::taylor::step_size;
use crate::stepping::taylor::stop;
use crate::stepping::{Cause, Statistics, StepError, without_length};
use std::cell::RefCell;

/// Lanes, and which trajectories are in them.
pub(super) struct LaneSlots<T> {
    /// Indices of the trajectories.
    members: [Option<usize>; LANES],
    pub(super) clock: LaneClock,
    pub(super) kernel: Box<T>,
    /// True where events may end the motion.
    has_stops: [bool; LANES],
    /// Springs whose ends can meet, and those that have no length now.
    approaches: [Approach; LANES],
    without_length: [Option<String>; LANES],
    /// True where one is in the step, which is not taken: the trajectory leaves.
    is_leaving: [bool; LANES],
    /// Lanes whose step cannot be taken.
    is_failing: [bool; LANES],
    /// Room for motions inside a step.
    inside: RefCell<Interior>,
}

impl<T: LaneKernel> LaneSlots<T> {
    /// Empty lanes.
    pub(super) fn new(kernel: T, batch: &Batch, until: Time) -> Self {
        Self {
            members: [None; LANES],
            clock: LaneClock::new(batch.tolerance, batch.order, until),
            kernel: Box::new(kernel),
            has_stops: [false; LANES],
            approaches: Default::default(),
            without_length: Default::default(),
            is_leaving: [false; LANES],
            is_failing: [false; LANES],
            inside: RefCell::default(),
        }
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
            if self.members[lane].is_none() {
                match next(fits, members, waiting, until) {
                    Some(index) => self.take_in(lane, batch, index, &members[index]),
                    None => self.kernel.set_idle(lane),
                }
            }
        }
    }

    /// Puts a trajectory into a lane.
    fn take_in(&mut self, lane: usize, batch: &Batch, index: usize, member: &BatchMember) {
        self.members[lane] = Some(index);
        let longest = self.kernel.take_in(lane, member, batch.order);
        self.clock.start(lane, member.state.time, member.mechanism.units.time, longest);
        self.has_stops[lane] = member.mechanism.has_stops();
        self.approaches[lane].take_in(member.mechanism);
        self.without_length[lane] = None;
    }

    /// Frees a lane.
    fn release(&mut self, lane: usize) {
        self.members[lane] = None;
        self.clock.stop(lane);
    }

    /// True where no lane has a trajectory.
    pub(super) fn is_idle(&self) -> bool {
        self.members.iter().all(Option::is_none)
    }

    /// Chooses the steps that the series just expanded allow.
    #[inline(always)]
    pub(super) fn choose_steps<W: EightLanes>(&mut self, order: usize, tolerance: f64) {
        let Self { clock, kernel, .. } = self;
        clock.want::<W>(order, &kernel.sizes::<W>(order), kernel.flaw::<W>(order));
        for lane in 0..LANES {
            clock.taken.0[lane] = 0.0;
            if kernel.is_leaving(lane) {
                clock.wanted.0[lane] = f64::NAN;
            }
            if !clock.wanted.0[lane].is_nan() {
                clock.wanted.0[lane] = kernel.allowed(&clock.step(lane), order, tolerance);
                clock.taken.0[lane] = step_size::taken(clock.wanted.0[lane], clock.left.0[lane]);
            }
        }
    }

    /// Shows the steps about to be taken where events may end a motion, and takes none with one in it.
    pub(super) fn look_ahead(
        &mut self,
        order: usize,
        members: &[BatchMember],
        observer: &mut dyn BatchObserver,
    ) {
        self.shorten_approaches(order, members);
        let Self { clock, kernel, inside, .. } = self;
        for lane in 0..LANES {
            self.is_leaving[lane] = false;
            let (from, step) = (clock.at(lane), clock.taken.0[lane]);
            let Some(index) = self.members[lane].filter(|_| self.has_stops[lane] && step > 0.0) else {
                continue;
            };
            let member = &members[index];
            let series = |body: usize, after: f64| kernel.at(order, lane, body, after);
            let ends = |body: usize| [0.0, step].map(|after| series(body, after).into());
            inside.borrow_mut().forget();
            let motion = |after: f64, motion: &mut Motion| {
                inside.borrow_mut().look::<T>(kernel, member, InLane { order, lane, from }, after, motion);
            };
            self.is_leaving[lane] =
                observer.ahead(index, &TakenStep::new(from, step, &ends, &series, &motion));
            if self.is_leaving[lane] {
                clock.taken.0[lane] = 0.0;
            }
        }
    }

    /// Shortens the steps in which the ends of a spring come near each other, and finds those that meet.
    fn shorten_approaches(&mut self, order: usize, members: &[BatchMember]) {
        let Self { clock, kernel, inside, approaches, without_length, .. } = self;
        for lane in 0..LANES {
            let (from, step, approach) = (clock.at(lane), clock.taken.0[lane], &mut approaches[lane]);
            let Some(index) = self.members[lane].filter(|_| !approach.is_empty() && step > 0.0) else {
                continue;
            };
            let (member, inside) = (&members[index], inside.get_mut());
            inside.forget();
            let mut motion = Motion::default();
            let least = finest(from, clock.step(lane).unit).min(step);
            clock.taken.0[lane] = approach.shortened(step, least, |after, angles| {
                inside.look::<T>(kernel, member, InLane { order, lane, from }, after, &mut motion);
                angles.take(&motion);
            });
            without_length[lane] = approach.without_length().map(str::to_owned);
        }
    }

    /// Writes the states of lanes whose steps cannot be taken, before these make others of them.
    pub(super) fn keep_last(&mut self, members: &mut [BatchMember]) {
        for lane in 0..LANES {
            let Some(index) = self.members[lane] else { continue };
            let member = &mut members[index];
            self.is_failing[lane] = self.failure(lane, &member.statistics).is_err();
            if self.is_failing[lane] {
                self.kernel.write_state(lane, &mut member.state);
            }
        }
    }

    /// Records the steps just taken, which end at these times, and frees the lanes of trajectories that have
    /// ended.
    pub(super) fn arrive(
        &mut self,
        order: usize,
        members: &mut [BatchMember],
        ends: &[Octet; 2],
        until: Time,
        observer: &mut dyn BatchObserver,
    ) {
        for lane in 0..LANES {
            let Some(index) = self.members[lane] else { continue };
            let (member, from) = (&mut members[index], self.clock.at(lane));
            if self.is_leaving[lane] || self.kernel.is_leaving(lane) {
                (member.has_left, member.state.time) = (true, from);
                self.kernel.write_state(lane, &mut member.state);
                continue;
            }
            if self.is_failing[lane]
                && let Err(stop) = self.failure(lane, &member.statistics)
            {
                (member.stopped, member.state.time) = (Some(stop), from);
                self.release(lane);
                continue;
            }
            let step = self.clock.taken.0[lane];
            let is_last = step == self.clock.left.0[lane];
            let time = if is_last { until } else { Time { hi: ends[0].0[lane], lo: ends[1].0[lane] } };
            self.clock.set(lane, time);
            member.statistics.steps += 1;
            member.statistics.evaluations += 1;
            let series = |body: usize, after: f64| self.kernel.at(order, lane, body, after);
            let ends = |body: usize| self.kernel.ends(lane, body);
            self.inside.get_mut().forget();
            let motion = |after: f64, motion: &mut Motion| {
                let mut inside = self.inside.borrow_mut();
                if after >= step {
                    inside.end::<T>(&self.kernel, member, lane, time, motion);
                } else {
                    inside.look::<T>(&self.kernel, member, InLane { order, lane, from }, after, motion);
                }
            };
            let passage = TakenStep::new(from, step, &ends, &series, &motion);
            let is_over = observer.step(index, &passage) == Going::Enough || time >= until;
            self.kernel.wrap(lane, &mut member.state.turns);
            if is_over {
                self.kernel.write_state(lane, &mut member.state);
                member.state.time = time;
                self.release(lane);
            }
        }
    }

    /// Why the step a lane has just expanded cannot be taken, where it cannot.
    fn failure(&self, lane: usize, statistics: &Statistics) -> Result<(), StepError> {
        let LaneStep { time, unit, wanted, .. } = self.clock.step(lane);
        let taken = self.clock.taken.0[lane];
        let hint = "look for a position without inertia";
        let stop =
            |cause, what: &str| stop(cause, &State { time, ..State::default() }, taken, what.into(), hint);
        if let Some(name) = &self.without_length[lane] {
            Err(without_length(name, "taylor", time.hi, taken))
        } else if wanted.is_nan() {
            Err(stop(Cause::NotFinite, "the series is not finite"))
        } else if wanted < finest(time, unit) {
            Err(stop(Cause::StepTooSmall, "the series converges in ever smaller circles"))
        } else {
            statistics.check("taylor", time.hi, taken)
        }
    }

    /// Has those taken on that have left, and takes in again those that come back.
    pub(super) fn bring_back(
        &mut self,
        batch: &Batch,
        members: &mut [BatchMember],
        until: Time,
        observer: &mut dyn BatchObserver,
    ) {
        for lane in 0..LANES {
            let Some(index) = self.members[lane].filter(|&index| members[index].has_left) else { continue };
            let member = &mut members[index];
            self.release(lane);
            if observer.alone(index, member) == Going::On && member.state.time < until {
                self.take_in(lane, batch, index, member);
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

/// Steps \[s\] below this are lost in the resolution of time.
fn finest(time: Time, unit: f64) -> f64 {
    1e-14 * time.hi.abs().max(1e-3 * unit)
}
