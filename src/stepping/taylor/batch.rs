//! Many trajectories at once, one a lane: ensembles of up to six free bodies, or four with springs, or of two
//! of which one is driven; and ensembles of mechanisms of one structure, any hinge tree, with closed loops
//! or without.
//!
//! Nothing ever crosses from lane to lane, so that a trajectory has the same bits whoever its neighbours are;
//! every lane has its own step, its own time, its own constants of the mechanism, and takes in the next
//! trajectory as soon as its last one has ended.

mod clearance;
mod clock;
mod driven;
mod formulas;
mod free;
mod interior;
mod laws;
mod looped;
mod passage;
mod series;
mod slots;
mod springs;
mod swinging;
mod trees;
mod vectors;

pub(super) use self::clock::LaneClock;
use self::clock::LaneStep;
use self::driven::DrivenLanes;
use self::free::FreeLanes;
use self::looped::LoopLanes;
pub use self::passage::TakenStep;
use self::passage::coordinates;
pub(crate) use self::passage::read;
use self::slots::LaneSlots;
pub(super) use self::swinging::{SwingingLanes, law_of as swinging_law};
use self::trees::TreeLanes;
use self::vectors::{added, flaw_of, load, moved, pair, store, unit};
use super::{ExpansionKernel, HIGHEST_ORDER, JUDGES, Taylor, stop};
use crate::arithmetic::eight::Octet;
use crate::arithmetic::lanes::wide::{EightLanes, Vectors, WideCode};
use crate::dynamics::looped::reduced;
use crate::dynamics::natural::ReducedMatrices;
use crate::dynamics::series::lanes::{OwnNumbers, are_equal};
use crate::dynamics::{Mechanism, State, Time};
use crate::stepping::{Cause, Statistics, StepError, Tolerance};
use std::sync::{Arc, OnceLock};

/// Largest number of bodies, and of those with springs.
const BODIES: usize = 6;
const SPRUNG: usize = 4;
/// Largest number of springs.
const SPRINGS: usize = 8;

/// One trajectory: its mechanism, its state in the form of
/// [`Elimination`](crate::dynamics::elimination::Elimination), or with loops of
/// [`Multiplier`](crate::dynamics::multiplier::Multiplier), and how it went.
#[derive(Clone, Debug)]
pub struct BatchMember<'a> {
    /// What is integrated.
    pub mechanism: &'a Mechanism,
    /// The start, and in the end the last state reached.
    pub state: State,
    /// Steps taken, and series allowed.
    pub statistics: Statistics,
    /// Why it stopped, if it did.
    pub stopped: Option<StepError>,
    /// True where it came to a step that lanes do not take, near a singular position or to a wall: it stands
    /// where that step begins, to be taken on by [`Taylor`](super::Taylor) with projection, or through the
    /// impact.
    pub has_left: bool,
    /// Its mechanism in natural coordinates and its numbers, once they have been asked for.
    reduced: OnceLock<Option<Arc<ReducedMatrices>>>,
    numbers: OnceLock<Arc<OwnNumbers>>,
}

impl<'a> BatchMember<'a> {
    /// A trajectory about to start.
    pub fn new(mechanism: &'a Mechanism, state: State) -> Self {
        let statistics = Statistics::default();
        let (reduced, numbers) = (OnceLock::new(), OnceLock::new());
        Self { mechanism, state, statistics, stopped: None, has_left: false, reduced, numbers }
    }

    /// The matrices of its mechanism in natural coordinates, without redundant rows, where there are any.
    fn reduced(&self) -> Option<&ReducedMatrices> {
        let find = || reduced(&self.mechanism.without_redundant_rows()).map(Arc::new);
        self.reduced.get_or_init(find).as_deref()
    }

    /// The numbers of its mechanism.
    fn numbers(&self) -> &OwnNumbers {
        self.numbers.get_or_init(|| Arc::new(OwnNumbers::of(self.mechanism)))
    }

    /// True where the other's mechanism differs from its own in numbers alone, if at all.
    fn is_alike(&self, other: &Self) -> bool {
        are_equal(self.mechanism, other.mechanism) || self.numbers().are_alike(other.numbers())
    }
}

/// Sees a step of the trajectory of a number.
pub type Watch<'a> = dyn FnMut(usize, &TakenStep) -> Going + 'a;

/// What trajectories in lanes are shown to, each by its number, and what takes those on that leave.
pub(crate) trait BatchObserver {
    /// Shown a step that a trajectory is about to make, as its series have it, where events may end the
    /// motion; true where it is not to be made in a lane.
    fn ahead(&mut self, number: usize, step: &TakenStep) -> bool;

    /// Shown a step that was made.
    fn step(&mut self, number: usize, step: &TakenStep) -> Going;

    /// Takes on a trajectory that stands inside a step it made alone, before the lanes do.
    fn resume(&mut self, _number: usize, _member: &mut BatchMember) -> Going {
        Going::On
    }

    /// Takes on a trajectory that has left from where it stands, and is shown as many steps as that takes.
    fn alone(&mut self, number: usize, member: &mut BatchMember) -> Going;
}

/// A function that sees steps; what leaves stays where it is.
struct StepsAlone<'a, 'b>(&'a mut Watch<'b>);

impl BatchObserver for StepsAlone<'_, '_> {
    fn ahead(&mut self, _: usize, _: &TakenStep) -> bool {
        false
    }

    fn step(&mut self, number: usize, step: &TakenStep) -> Going {
        (self.0)(number, step)
    }

    fn alone(&mut self, _: usize, _: &mut BatchMember) -> Going {
        Going::Enough
    }
}

/// Whether a trajectory goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Going {
    /// To the end.
    On,
    /// Enough was seen.
    Enough,
}

/// Integrates many trajectories of hinge trees.
///
/// Source of the method: see [`Taylor`](super::Taylor), whose tolerance and orders these are.
#[derive(Clone, Debug)]
pub struct Batch {
    tolerance: f64,
    order: usize,
    is_portable: bool,
}

impl Batch {
    /// The method at a tolerance, of order 20, or 24 below 1e-15.
    pub fn new(tolerance: Tolerance) -> Self {
        let tolerance = tolerance.relative.min(tolerance.absolute);
        Self { tolerance, order: if tolerance >= 1e-15 { 20 } else { 24 }, is_portable: false }
    }

    /// The same with another order, from 10 to 24.
    pub fn with_order(self, order: usize) -> Self {
        Self { order: order.clamp(2 * JUDGES, HIGHEST_ORDER), ..self }
    }

    /// The same by another kernel: `Portable` does without the processor's lanes.
    pub fn with_kernel(self, kernel: ExpansionKernel) -> Self {
        Self { is_portable: kernel != ExpansionKernel::Fastest, ..self }
    }

    /// The method for one trajectory alone, at the same tolerance.
    pub(crate) fn alone(&self) -> Taylor<f64> {
        Taylor::new(Tolerance { relative: self.tolerance, absolute: self.tolerance })
    }

    /// True for what it can integrate: one to six bodies with hinges and centres of mass on their axes under
    /// gravity, or up to four with at most eight springs and dampers that are no formulas, neither motors nor
    /// walls; or two bodies without springs, one of them driven from the ground by a law that is no formula.
    /// No event ends the motion.
    pub fn takes(mechanism: &Mechanism) -> bool {
        !mechanism.has_stops() && Self::takes_with_stops(mechanism)
    }

    /// The same with events that end the motion, which [`BatchObserver::ahead`] looks for.
    pub(crate) fn takes_with_stops(mechanism: &Mechanism) -> bool {
        let springs = mechanism.springs.len();
        let most = if springs == 0 { BODIES } else { SPRUNG };
        let is_of_few = (1..=most).contains(&mechanism.tree.coordinates) && springs <= SPRINGS;
        goes_on(mechanism)
            && (is_of_few && free::fits(mechanism) || driven::fits(mechanism) || swinging::fits(mechanism))
    }

    /// True for what it can integrate as well, those trajectories beside each other whose mechanisms are
    /// equal or differ in nothing but their numbers, have the same ones zero and the same redundant
    /// constraints, and equal numbers in laws of motors by formulas: trees of up to 12 bodies, hinged off
    /// their axes or floating, torsion springs, applied forces, motors on angles, springs beside them, walls,
    /// all by smooth formulas or without, and no friction; and the same with closed loops, sliders, gears and
    /// cams, their states in the form of [`Multiplier`](crate::dynamics::multiplier::Multiplier).
    pub fn takes_alike(mechanism: &Mechanism) -> bool {
        !mechanism.has_stops() && Self::takes_alike_with_stops(mechanism)
    }

    /// The same with events that end the motion, which [`BatchObserver::ahead`] looks for.
    pub(crate) fn takes_alike_with_stops(mechanism: &Mechanism) -> bool {
        goes_on(mechanism) && trees::fits(mechanism)
    }

    /// Integrates all trajectories to `until`; `watch` is shown every step with the trajectory's index and
    /// may end that one.
    ///
    /// Mechanisms of neither [these](Batch::takes) nor [those](Batch::takes_alike) kinds are stopped as
    /// unsuited; those with loops may [leave](BatchMember::has_left) on the way.  The result of each does not
    /// depend on the others.
    pub fn integrate(&self, members: &mut [BatchMember], until: Time, watch: &mut Watch) {
        let mut is_done = vec![false; members.len()];
        for (member, is_done) in members.iter_mut().zip(&mut is_done) {
            if member.mechanism.has_stops() {
                (member.stopped, *is_done) = (Some(unsuited(member)), true);
            }
        }
        self.integrate_rest(members, until, &mut StepsAlone(watch), is_done);
    }

    /// The same with an observer that looks for events and takes those on that leave: where it says so, they
    /// come back.
    pub(crate) fn integrate_with(
        &self,
        members: &mut [BatchMember],
        until: Time,
        observer: &mut dyn BatchObserver,
    ) {
        let resumed = members.iter_mut().enumerate();
        let is_done =
            resumed.map(|(number, member)| observer.resume(number, member) == Going::Enough).collect();
        self.integrate_rest(members, until, observer, is_done);
    }

    fn integrate_rest(
        &self,
        members: &mut [BatchMember],
        until: Time,
        observer: &mut dyn BatchObserver,
        mut is_done: Vec<bool>,
    ) {
        members.iter_mut().for_each(|member| member.has_left = false);
        while let Some(next) = is_done.iter().position(|is_done| !is_done) {
            let like = members[next].mechanism;
            macro_rules! try_kernels {
                ($($kernel:ty),*) => {$(
                    if goes_on(like) && <$kernel>::fits(&members[next], &members[next]) {
                        let fits = |one: &BatchMember| {
                            let is_same = std::ptr::eq(one.mechanism, like);
                            is_same || goes_on(one.mechanism) && <$kernel>::fits(one, &members[next])
                        };
                        let fits: Vec<bool> =
                            members.iter().zip(&is_done).map(|(one,
                                is_done)| !is_done && fits(one)).collect();
                        is_done.iter_mut().zip(&fits).for_each(|(is_done, &fits)| *is_done |= fits);
                        self.integrate_those::<$kernel>(next, &fits, members, until, observer);
                        continue;
                    }
                )*};
            }
            try_kernels!(FreeLanes<1, false>, FreeLanes<2, false>, FreeLanes<3, false>, FreeLanes<4, false>);
            try_kernels!(FreeLanes<5, false>, FreeLanes<6, false>);
            try_kernels!(FreeLanes<1, true>, FreeLanes<2, true>, FreeLanes<3, true>, FreeLanes<4, true>);
            try_kernels!(DrivenLanes, SwingingLanes, LoopLanes, TreeLanes);
            members[next].stopped = Some(unsuited(&members[next]));
            is_done[next] = true;
        }
    }

    /// Integrates those that fit beside one of them.
    fn integrate_those<T: LaneKernel>(
        &self,
        like: usize,
        fits: &[bool],
        members: &mut [BatchMember],
        until: Time,
        observer: &mut dyn BatchObserver,
    ) {
        let vectors = if self.is_portable { Vectors::Portable } else { Vectors::default() };
        let lanes = LaneSlots::new(T::new(&members[like], self.order, vectors), self, until);
        vectors.run(Integration::<T> { lanes, fits, batch: self, members, until, observer });
    }
}

/// True where no event changes what acts, and nothing has branches.
fn goes_on(mechanism: &Mechanism) -> bool {
    !mechanism.is_switched()
}

/// Why a trajectory is not in lanes.
fn unsuited(member: &BatchMember) -> StepError {
    let what = "lanes take hinge trees and loops without friction and events that act".into();
    stop(Cause::Unsuited, &member.state, 0.0, what, "integrate it by `taylor`")
}

/// The trajectories in the lanes, all of one kind of mechanism: their constants, their states, their series.
pub(super) trait LaneKernel {
    /// Empty lanes for trajectories that fit beside this one, for series up to an order.
    fn new(like: &BatchMember, order: usize, vectors: Vectors) -> Self;

    /// True for a trajectory of a mechanism of this kind that can be beside another one of this kind.
    fn fits(member: &BatchMember, like: &BatchMember) -> bool;

    /// Puts a trajectory into a lane; returns the longest step of an order in which the terms left out still
    /// fall \[s\].
    fn take_in(&mut self, lane: usize, member: &BatchMember, order: usize) -> f64;

    /// Keeps an empty lane busy with something harmless.
    fn set_idle(&mut self, lane: usize);

    /// Begins a step, from when the lanes are.
    fn begin<W: EightLanes>(&mut self, clock: &LaneClock);

    /// Expands all lanes to an order.
    fn expand<W: EightLanes>(&mut self, order: usize);

    /// The largest coefficients of every lane, of this order and those before it.
    fn sizes<W: EightLanes>(&self, order: usize) -> [Octet; JUDGES];

    /// Zero where a lane's coefficients of this order are finite, elsewhere not a number.
    fn flaw<W: EightLanes>(&self, order: usize) -> W;

    /// True where a lane's trajectory is better left to other code from where the present step begins: asked
    /// after its expansion, and again after its end.
    fn is_leaving(&self, _lane: usize) -> bool {
        false
    }

    /// Of the step a lane wants as much as its series carries \[s\].
    fn allowed(&mut self, step: &LaneStep, _order: usize, _tolerance: f64) -> f64 {
        step.wanted
    }

    /// Every lane's state at the end of its step \[s\].
    fn finish<W: EightLanes>(&mut self, order: usize, taken: &Octet);

    /// Angle \[rad\], continued from that at the start in [-π, π], and rate \[rad/s\] of a body at both ends
    /// of the step just finished.
    fn ends(&self, lane: usize, body: usize) -> [[f64; 2]; 2];

    /// Brings a lane's angles back into [-π, π], and counts the turns.
    fn wrap(&mut self, lane: usize, turns: &mut [i64]);

    /// Writes a lane's unknowns into a state.
    fn write_state(&self, lane: usize, state: &mut State);

    /// Angle \[rad\], continued from that at the start in [-π, π], and rate \[rad/s\] of a body `after` \[s\]
    /// from the start of the step last expanded.
    fn at(&self, order: usize, lane: usize, body: usize, after: f64) -> (f64, f64);

    /// A coordinate where the step last expanded begins \[rad, m\], where its rate is a polynomial there.
    fn start_of(&self, _lane: usize, _coordinate: usize) -> Option<f64> {
        None
    }

    /// Power `k` of that rate.
    fn power_of(&self, _lane: usize, _coordinate: usize, _k: usize) -> f64 {
        0.0
    }

    /// Writes coordinates and rates \[rad, m, rad/s, m/s\] of a mechanism's state `after` \[s\] from the
    /// start of that step, where they are no polynomials.
    fn inside(&self, order: usize, lane: usize, after: f64, mechanism: &Mechanism, state: &mut State) {
        let count = coordinates(mechanism);
        for c in 0..count {
            let body = if mechanism.has_multipliers() { c } else { mechanism.partition.independent[c] };
            (state.y[c], state.y[count + c]) = self.at(order, lane, body, after);
        }
    }
}

struct Integration<'a, 'b, T> {
    lanes: LaneSlots<T>,
    /// Which of the members these are.
    fits: &'a [bool],
    batch: &'a Batch,
    members: &'a mut [BatchMember<'b>],
    until: Time,
    observer: &'a mut dyn BatchObserver,
}

impl<T: LaneKernel> WideCode for Integration<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn run<W: EightLanes>(mut self) {
        let (order, mut waiting) = (self.batch.order, 0);
        loop {
            self.lanes.fill(self.batch, self.fits, self.members, &mut waiting, self.until);
            if self.lanes.is_idle() {
                return;
            }
            self.lanes.clock.look::<W>();
            self.lanes.kernel.begin::<W>(&self.lanes.clock);
            self.lanes.kernel.expand::<W>(order);
            self.lanes.choose_steps::<W>(order, self.batch.tolerance);
            self.lanes.look_ahead(order, self.members, self.observer);
            self.lanes.keep_last(self.members);
            self.lanes.kernel.finish::<W>(order, &self.lanes.clock.taken);
            let ends = self.lanes.clock.ends::<W>();
            self.lanes.arrive(order, self.members, &ends, self.until, self.observer);
            self.lanes.bring_back(self.batch, self.members, self.until, self.observer);
        }
    }
}

#[cfg(test)]
mod tests;
