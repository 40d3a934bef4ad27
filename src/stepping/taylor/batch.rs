//! Many trajectories at once, one a lane: ensembles of up to four free bodies.
//!
//! The equation of `bodies` with the lanes over trajectories instead of bodies.  Nothing ever crosses from
//! lane to lane, so that a trajectory has the same bits whoever its neighbours are; every lane has its own
//! step, its own time, its own constants of the mechanism, and takes in the next trajectory as soon as its
//! last one has ended.

mod series;
use self::series::{expand, finish};
use super::step_size::{self, StepSize};
use super::{JUDGES, Kernel, stop};
use crate::arithmetic::angle;
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::wide::{EightLanes, Vectors, WideCode};
use crate::dynamics::{Mechanism, State, Time};
use crate::stepping::{Cause, Statistics, StepError, Tolerance};

/// Largest order there is room for.
const MOST: usize = 24;
/// Largest number of bodies.
const BODIES: usize = 4;

/// One trajectory: its mechanism, its state in the form of
/// [`Elimination`](crate::dynamics::elimination::Elimination), and how it went.
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
}

impl<'a> BatchMember<'a> {
    /// A trajectory about to start.
    pub fn new(mechanism: &'a Mechanism, state: State) -> Self {
        Self { mechanism, state, statistics: Statistics::default(), stopped: None }
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

/// A step just taken, which can be looked at anywhere.
pub struct Passage<'a> {
    /// Time at its start.
    pub from: Time,
    /// Its length \[s\].
    pub step: f64,
    /// Whole turns of each body's angle at its end less those at its start: how often it passed ±π,
    /// counter-clockwise counted positive.
    pub turned: [i64; BODIES],
    series: &'a dyn Fn(usize, f64) -> (f64, f64),
}

impl Passage<'_> {
    /// Angle \[rad\] and rate \[rad/s\] of a body `after` \[s\] from the step's start, the angle continued
    /// from that at the start in [-π, π].
    pub fn at(&self, body: usize, after: f64) -> (f64, f64) {
        (self.series)(body, after)
    }
}

/// Integrates many trajectories of free mechanisms.
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
        Self { order: order.clamp(2 * JUDGES, MOST), ..self }
    }

    /// The same by another kernel: `Portable` does without the processor's lanes.
    pub fn with_kernel(self, kernel: Kernel) -> Self {
        Self { is_portable: kernel != Kernel::Fastest, ..self }
    }

    /// True for what it can integrate: one to four bodies with hinges and centres of mass on their axes,
    /// neither springs nor motors nor walls.
    pub fn takes(mechanism: &Mechanism) -> bool {
        let tree = &mechanism.tree;
        (1..=BODIES).contains(&tree.coordinates)
            && !tree.off_axis
            && mechanism.is_plain()
            && mechanism.constraints.is_empty()
            && mechanism.contacts.is_empty()
    }

    /// Integrates all trajectories to `until`; `watch` is shown every step with the trajectory's index and
    /// may end that one.
    ///
    /// All mechanisms must be such as [`Batch::takes`], of the same number of bodies; any other is stopped as
    /// unsuited.  The result of each does not depend on the others.
    pub fn integrate(
        &self,
        members: &mut [BatchMember],
        until: Time,
        watch: &mut dyn FnMut(usize, &Passage) -> Going,
    ) {
        let Some(bodies) = members.first().map(|first| first.mechanism.tree.coordinates) else { return };
        let vectors = if self.is_portable { Vectors::Portable } else { Vectors::default() };
        match bodies {
            1 => vectors.run(Integration::<1> { batch: self, members, until, watch }),
            2 => vectors.run(Integration::<2> { batch: self, members, until, watch }),
            3 => vectors.run(Integration::<3> { batch: self, members, until, watch }),
            _ => vectors.run(Integration::<4> { batch: self, members, until, watch }),
        }
    }
}

struct Integration<'a, 'b, const N: usize> {
    batch: &'a Batch,
    members: &'a mut [BatchMember<'b>],
    until: Time,
    watch: &'a mut dyn FnMut(usize, &Passage) -> Going,
}

impl<const N: usize> WideCode for Integration<'_, '_, N> {
    type Output = ();

    #[inline(always)]
    fn run<W: EightLanes>(self) {
        integrate::<W, N>(self.batch, self.members, self.until, self.watch);
    }
}

/// Constants, states and coefficients of the trajectories in the lanes.
#[derive(Clone, Debug)]
struct Team<const N: usize> {
    slots: [LaneSlot; LANES],
    /// A \[kg·m²\], zero on the diagonal.
    coupling: [[Octet; N]; N],
    diagonal: [Octet; N],
    /// W \[N·m\].
    weight: [[Octet; 2]; N],
    /// M_0⁻¹.
    inverse: [[Octet; N]; N],
    /// Leading parts of angles and rates, and what they leave out.
    high: [[Octet; N]; 2],
    low: [[Octet; N]; 2],
    /// Angles at the start of the step.
    before: [Octet; N],
    powers: [Power<N>; MOST + 1],
}

/// Coefficients of one power: cos, sin, v, and the two components of P.
#[derive(Clone, Copy, Debug)]
struct Power<const N: usize> {
    c: [Octet; N],
    s: [Octet; N],
    v: [Octet; N],
    px: [Octet; N],
    py: [Octet; N],
}

/// What a lane is doing.
#[derive(Clone, Debug)]
struct LaneSlot {
    /// Index of its trajectory.
    member: Option<usize>,
    step_size: StepSize,
    time: Time,
    /// The mechanism's unit of time \[s\].
    unit: f64,
    /// What is left to go, the last step wanted and the one taken \[s\].
    left: f64,
    wanted: f64,
    taken: f64,
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

impl<const N: usize> Team<N> {
    /// Empty lanes.
    fn new(order: usize, until: Time) -> Self {
        let zero = [Octet::splat(0.0); N];
        let power = Power { c: zero, s: zero, v: zero, px: zero, py: zero };
        let empty = || LaneSlot {
            member: None,
            step_size: StepSize::new(1.0, order, 0.0),
            time: until,
            unit: 1.0,
            left: 0.0,
            wanted: 0.0,
            taken: 0.0,
        };
        Self {
            slots: std::array::from_fn(|_| empty()),
            coupling: [zero; N],
            diagonal: [Octet::splat(1.0); N],
            weight: [[Octet::splat(0.0); 2]; N],
            inverse: [zero; N],
            high: [zero; 2],
            low: [zero; 2],
            before: zero,
            powers: [power; MOST + 1],
        }
    }

    /// Puts trajectories that wait into the free lanes.
    fn fill(&mut self, batch: &Batch, members: &mut [BatchMember], waiting: &mut usize, until: Time) {
        for lane in 0..LANES {
            if self.slots[lane].member.is_none() {
                let next = next::<N>(members, waiting, until);
                self.slots[lane].member = next;
                match next {
                    Some(index) => self.slot(lane, batch, &members[index]),
                    None => self.park(lane),
                }
            }
            let slot = &mut self.slots[lane];
            slot.left = if slot.member.is_some() { (until - slot.time).hi } else { 0.0 };
        }
        self.before = self.high[0];
    }

    /// True where no lane has a trajectory.
    fn is_idle(&self) -> bool {
        self.slots.iter().all(|slot| slot.member.is_none())
    }

    /// The steps \[s\] that the series just expanded allow.
    fn choose_steps(&mut self, order: usize) -> Octet {
        let mut taken = Octet::splat(0.0);
        for (lane, (slot, taken)) in self.slots.iter_mut().zip(&mut taken.0).enumerate() {
            let coefficient = |k: usize, i: usize| self.powers[k].v[i].0[lane];
            let mut sizes = [0.0; JUDGES];
            for (back, size) in sizes.iter_mut().enumerate() {
                *size = (0..N).fold(0.0, |largest: f64, i| largest.max(coefficient(order - back, i).abs()));
            }
            let finite = (0..N).all(|i| coefficient(order, i).is_finite());
            slot.wanted = if finite { slot.step_size.step_of(order, &sizes) } else { f64::NAN };
            slot.taken = if finite { step_size::taken(slot.wanted, slot.left) } else { 0.0 };
            *taken = slot.taken;
        }
        taken
    }

    /// Records the steps just taken, and frees the lanes of trajectories that have ended.
    fn arrive(
        &mut self,
        order: usize,
        members: &mut [BatchMember],
        until: Time,
        watch: &mut dyn FnMut(usize, &Passage) -> Going,
    ) {
        for lane in 0..LANES {
            let slot = &mut self.slots[lane];
            let Some(index) = slot.member else { continue };
            let member = &mut members[index];
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
            let mut turned = [0; BODIES];
            for i in 0..N {
                turned[i] = angle::wrap(&mut self.high[0][i].0[lane], &mut self.low[0][i].0[lane]);
                member.state.turns[i] += turned[i];
            }
            let series = |body: usize, after: f64| self.at(order, lane, body, after);
            let passage = Passage { from, step, turned, series: &series };
            if member.stopped.is_some() || watch(index, &passage) == Going::Enough || time >= until {
                self.leave(lane, &mut member.state);
                member.state.time = time;
                self.slots[lane].member = None;
            }
        }
    }

    /// Puts a trajectory into a lane.
    fn slot(&mut self, lane: usize, batch: &Batch, member: &BatchMember) {
        let (tree, unit) = (&member.mechanism.tree, member.mechanism.units.time);
        let longest = batch.order as f64 / 3.0 / tree.fastest_rate(&[]);
        let slot = &mut self.slots[lane];
        slot.step_size = StepSize::new(batch.tolerance, batch.order, longest).over(unit);
        (slot.time, slot.unit) = (member.state.time, unit);
        for i in 0..N {
            self.diagonal[i].0[lane] = tree.diagonal[i];
            self.weight[i][0].0[lane] = tree.weight[i].re;
            self.weight[i][1].0[lane] = tree.weight[i].im;
            for j in i + 1..N {
                self.coupling[i][j].0[lane] = tree.coupling[i * N + j].re;
                self.coupling[j][i].0[lane] = tree.coupling[i * N + j].re;
            }
            for part in 0..2 {
                self.high[part][i].0[lane] = member.state.y[part * N + i];
                self.low[part][i].0[lane] = member.state.low[part * N + i];
            }
        }
    }

    /// Keeps an empty lane busy with something harmless: bodies hanging at rest.
    fn park(&mut self, lane: usize) {
        for part in [&mut self.high, &mut self.low] {
            for numbers in part.iter_mut().flatten() {
                numbers.0[lane] = 0.0;
            }
        }
    }

    /// Writes a lane's unknowns into a state.
    fn leave(&self, lane: usize, state: &mut State) {
        for part in 0..2 {
            for i in 0..N {
                state.y[part * N + i] = self.high[part][i].0[lane];
                state.low[part * N + i] = self.low[part][i].0[lane];
            }
        }
    }

    /// Angle and rate of a body `after` \[s\] from the start of the step last expanded.
    fn at(&self, order: usize, lane: usize, body: usize, after: f64) -> (f64, f64) {
        let start = self.before[body].0[lane];
        if after == 0.0 {
            return (start, self.powers[0].v[body].0[lane]);
        }
        let (mut angle, mut rate) = (0.0, 0.0);
        for k in (0..=order).rev() {
            let v = self.powers[k].v[body].0[lane];
            rate = rate * after + v;
            angle = angle * after + v / (k + 1) as f64;
        }
        (start + angle * after, rate)
    }
}

#[inline(always)]
fn integrate<W: EightLanes, const N: usize>(
    batch: &Batch,
    members: &mut [BatchMember],
    until: Time,
    watch: &mut dyn FnMut(usize, &Passage) -> Going,
) {
    let mut team = Box::new(Team::<N>::new(batch.order, until));
    let mut waiting = 0;
    loop {
        team.fill(batch, members, &mut waiting, until);
        if team.is_idle() {
            return;
        }
        expand::<W, N>(&mut team, batch.order);
        let taken = team.choose_steps(batch.order);
        finish::<W, N>(&mut team, batch.order, &taken);
        team.arrive(batch.order, members, until, watch);
    }
}

/// The next trajectory that has a way to go; those that do not fit are stopped.
fn next<const N: usize>(members: &mut [BatchMember], waiting: &mut usize, until: Time) -> Option<usize> {
    while *waiting < members.len() {
        let index = *waiting;
        *waiting += 1;
        let member = &mut members[index];
        if !Batch::takes(member.mechanism) || member.mechanism.tree.coordinates != N {
            let what = "the batch takes free mechanisms of one size".into();
            member.stopped =
                Some(stop(Cause::Unsuited, &member.state, 0.0, what, "integrate it by `taylor`"));
        } else if member.state.time < until {
            return Some(index);
        }
    }
    None
}

#[cfg(test)]
mod tests;
