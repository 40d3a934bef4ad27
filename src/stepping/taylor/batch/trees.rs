//! Hinge trees with springs, torsion springs, forces, formulas and motors, and mechanisms with closed loops,
//! sliders, gears and cams, all lanes of mechanisms with one structure: the series of
//! [`dynamics`](crate::dynamics::series) on numbers with a lane for each trajectory.
//!
//! Constraint equations are kept by multipliers, and by a projection after every step.  A trajectory leaves
//! the lanes where a step begins or ends near a singular position, does not end on its rows, or may come to a
//! wall: from where that step began it has to go on alone.

use super::super::terms::over;
use super::clearance::{self, Clearance, StepFrom};
use super::formulas::{Begun, LONGEST, StepJudge};
use super::{BatchMember, JUDGES, LaneClock, LaneKernel, LaneStep, added, flaw_of, load, moved, store};
use crate::arithmetic::angle;
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::wide::{EightLanes, Vectors};
use crate::dynamics::law::Law;
use crate::dynamics::series::lanes::{SeriesInLanes, StepEnds, in_lanes};
use crate::dynamics::{Mechanism, State, Time};
use std::f64::consts::TAU;

/// Largest number of bodies: beyond, dense matrices are not the form to compute in.
const BODIES: usize = 12;
const ZERO: Octet = Octet([0.0; LANES]);

/// The mechanism, states and coefficients of the trajectories in the lanes.
#[derive(Debug)]
pub(super) struct TreeLanes {
    mechanism: Mechanism,
    series: Box<dyn SeriesInLanes>,
    order: usize,
    /// Number of coordinates f, of which the first ones are angles.
    coordinates: usize,
    angles: usize,
    /// One over the unit of length \[1/m\], for the others.
    per_length: Octet,
    /// The energy scale times the unit of time \[J s\].
    energy: Octet,
    /// One over the unit of time: what rates count as at least \[rad/s\].
    slowest: Octet,
    /// Leading parts of angles, rates and work (2f + 1), and what they leave out.
    high: Vec<Octet>,
    low: Vec<Octet>,
    /// Angles at the start of the step (f), and the step \[s\].
    before: Vec<Octet>,
    taken: Octet,
    times: [Time; LANES],
    /// Which lanes hold a trajectory that stays, and which hold one that leaves.
    is_going: [bool; LANES],
    is_leaving: [bool; LANES],
    /// Where the rows are kept by multipliers: unknowns where the step began, those of all lanes that do not
    /// land.
    kept: Option<[Vec<Octet>; 2]>,
    /// What steps are judged by where nothing bounds them.
    judge: Option<StepJudge>,
    clearance: Clearance,
    /// Where the mechanisms of the trajectories in the lanes are, to tell one from another.
    present: [Option<usize>; LANES],
}

/// True for hinge trees whose motors are all eliminated, with a motion left, and for mechanisms with loops,
/// sliders, gears or cams.
///
/// Not for bodies on their axes under gravity and springs alone: more of them than have lanes of their own
/// are faster one by one.
pub(super) fn fits(mechanism: &Mechanism) -> bool {
    (1..=BODIES).contains(&mechanism.bodies.len())
        && mechanism.tree.is_dense()
        && mechanism.contacts.iter().all(clearance::takes)
        && mechanism.frictions.is_empty()
        && mechanism.vibration.is_none()
        && (is_tree(mechanism) || is_looped(mechanism))
}

/// True where there are no rows to be kept.
fn is_tree(mechanism: &Mechanism) -> bool {
    !super::free::fits(mechanism) && mechanism.partition.count() > 0 && !mechanism.has_multipliers()
}

fn is_looped(mechanism: &Mechanism) -> bool {
    mechanism.has_multipliers()
        && !mechanism.has_released()
        && !mechanism.constraints.iter().any(|row| mechanism.may_be_off(&row.name))
}

/// True where nothing tells beforehand how fast a motion may change: with formulas, and bodies that float.
fn is_unbounded(mechanism: &Mechanism) -> bool {
    !mechanism.forces.is_empty()
        || mechanism.has_aims()
        || mechanism.coordinates() != mechanism.bodies.len()
        || laws(mechanism).any(|law| law.profile.is_some())
}

/// The laws of motors and applied forces.
fn laws(mechanism: &Mechanism) -> impl Iterator<Item = &Law> {
    let motors = mechanism.partition.bodies.iter().flat_map(|angle| angle.laws.iter().map(|(_, law)| law));
    let travels = mechanism.constraints.iter().filter(|row| !row.is_angle());
    let actions = mechanism.actions.iter().filter_map(|action| action.law.as_ref());
    motors.chain(travels.filter_map(|row| row.law.as_ref())).chain(actions)
}

/// About the fastest rate of a mechanism from a time on \[rad/s\].
fn fastest_rate(mechanism: &Mechanism, t: f64) -> f64 {
    let mobility = mechanism.tree.mobility();
    let torsions = mechanism.torsions.iter().map(|torsion| {
        let mobility = mobility[torsion.body] + torsion.base.map_or(0.0, |base| mobility[base]);
        2.0 * mobility * (torsion.stiffness + 2.0 * mobility * torsion.damping.powi(2))
    });
    let motors = laws(mechanism).map(|law| {
        let [fastest, bend] = law.bounds(t);
        let frequency = law.sines.iter().fold(0.0, |most: f64, sine| most.max(sine.frequency.abs()));
        fastest * fastest + bend + frequency * frequency
    });
    let squares = torsions.chain(motors).fold(0.0, |sum, square| sum + square);
    (mechanism.tree.fastest_rate(&mechanism.springs).powi(2) + squares).sqrt()
}

impl TreeLanes {
    /// The coordinate that a body's angle is, where it is not driven.
    fn coordinate(&self, body: usize) -> Option<usize> {
        if self.kept.is_some() {
            return Some(body);
        }
        let dependent_angle = &self.mechanism.partition.bodies[body];
        dependent_angle.base.filter(|_| dependent_angle.laws.is_empty())
    }

    /// The angle of a body where the step began, less whole turns \[rad\].
    fn start(&self, lane: usize, body: usize) -> f64 {
        let Some(base) = self.coordinate(body) else { return self.series.angle_of(body, lane) };
        let angle = self.before[base].0[lane];
        angle - TAU * angle::whole_turns(angle)
    }

    /// Brings the ends of the steps back onto the rows; lanes that take no step, or do not get there, stay
    /// where it began.
    fn land(&mut self) {
        if self.kept.is_none() {
            return;
        }
        let mut times = self.times;
        for lane in 0..LANES {
            times[lane] = times[lane] + self.taken.0[lane];
            self.is_going[lane] &= self.taken.0[lane] > 0.0;
        }
        self.keep(&self.is_going.map(|is_going| !is_going));
        let landing = StepEnds {
            high: &mut self.high,
            low: &mut self.low,
            is_going: self.is_going,
            unit: self.slowest,
            per_length: self.per_length,
        };
        let is_landed = self.series.land(&self.mechanism, times, landing);
        for lane in 0..LANES {
            self.is_leaving[lane] |= self.is_going[lane] && !is_landed[lane];
        }
        self.keep(&is_landed.map(|is_landed| !is_landed));
    }

    /// Puts some lanes back to where the step began.
    fn keep(&mut self, is_kept: &[bool; LANES]) {
        let Some([high, low]) = &self.kept else { return };
        for lane in (0..LANES).filter(|&lane| is_kept[lane]) {
            let unknowns = self.high.iter_mut().zip(high).chain(self.low.iter_mut().zip(low));
            unknowns.for_each(|(unknown, kept)| unknown.0[lane] = kept.0[lane]);
        }
    }
}

impl LaneKernel for TreeLanes {
    fn new(first: &BatchMember, order: usize, vectors: Vectors) -> Self {
        let like = &*first.mechanism.without_redundant_rows();
        let is_kept = like.has_multipliers();
        let f = if is_kept { like.coordinates() } else { like.partition.count() };
        Self {
            series: in_lanes(like, first.numbers(), order, vectors),
            mechanism: like.clone(),
            order,
            coordinates: f,
            angles: if is_kept { like.bodies.len() } else { like.partition.turning() },
            per_length: Octet::splat(1.0),
            energy: Octet::splat(1.0),
            slowest: Octet::splat(1.0),
            high: vec![ZERO; 2 * f + 1],
            low: vec![ZERO; 2 * f + 1],
            before: vec![ZERO; f],
            taken: ZERO,
            times: [Time::default(); LANES],
            is_going: [false; LANES],
            is_leaving: [false; LANES],
            kept: is_kept.then(|| [vec![ZERO; 2 * f + 1], vec![ZERO; 2 * f + 1]]),
            judge: is_unbounded(like).then(StepJudge::default),
            clearance: Clearance::default(),
            present: [None; LANES],
        }
    }

    fn fits(member: &BatchMember, like: &BatchMember) -> bool {
        let (own, other) = (member.mechanism, like.mechanism);
        let is_same = std::ptr::eq(own, other);
        fits(own) && (is_same || fits(other) && is_tree(own) == is_tree(other) && member.is_alike(like))
    }

    fn take_in(&mut self, lane: usize, member: &BatchMember, order: usize) -> f64 {
        self.set_idle(lane);
        let place = std::ptr::from_ref(member.mechanism).addr();
        if self.present[lane].replace(place) != Some(place) {
            self.series.take_in(lane, member.numbers());
            if let Some(judge) = &mut self.judge {
                judge.take_in(lane, member.mechanism);
            }
            self.clearance.take_in(lane, member.mechanism);
        }
        for (numbers, unknowns) in [(&mut self.high, &member.state.y), (&mut self.low, &member.state.low)] {
            for (number, unknown) in numbers.iter_mut().zip(unknowns) {
                number.0[lane] = *unknown;
            }
        }
        self.per_length.0[lane] = 1.0 / member.mechanism.units.length;
        self.energy.0[lane] = member.mechanism.energy_scale * member.mechanism.units.time;
        self.slowest.0[lane] = 1.0 / member.mechanism.units.time;
        if self.judge.is_some() {
            return LONGEST * member.mechanism.units.time;
        }
        let tied = if self.mechanism.partition.driven() { 8.0 } else { 3.0 };
        order as f64 / tied / fastest_rate(member.mechanism, member.state.time.hi)
    }

    /// At rest.
    fn set_idle(&mut self, lane: usize) {
        self.high.iter_mut().chain(&mut self.low).for_each(|number| number.0[lane] = 0.0);
    }

    fn begin<W: EightLanes>(&mut self, clock: &LaneClock) {
        self.before.copy_from_slice(&self.high[..self.coordinates]);
        self.times = std::array::from_fn(|lane| clock.at(lane));
        self.is_going = clock.is_going;
        if let Some([high, low]) = &mut self.kept {
            high.copy_from_slice(&self.high);
            low.copy_from_slice(&self.low);
        }
    }

    fn expand<W: EightLanes>(&mut self, _order: usize) {
        let f = self.coordinates;
        let (angles, rates) = self.high[..2 * f].split_at(f);
        self.series.expand(&self.mechanism, self.times, [angles, &self.low[..f], rates]);
        for lane in 0..LANES {
            self.is_leaving[lane] = self.is_going[lane] && !self.series.is_regular(lane);
            self.is_going[lane] &= !self.is_leaving[lane];
        }
    }

    fn is_leaving(&self, lane: usize) -> bool {
        self.is_leaving[lane]
    }

    #[inline(always)]
    fn sizes<W: EightLanes>(&self, order: usize) -> [Octet; JUDGES] {
        let (f, rates, power) = (self.coordinates, self.series.rates(), self.series.power());
        let energy = load::<W>(&self.energy);
        let mut sizes = [ZERO; JUDGES];
        let mut back = 0;
        while back < JUDGES {
            let k = order - back;
            // The work over the energy scale counts as the rates do.
            let mut most = load::<W>(&power[k - 1]).div(energy.mul(W::splat(k as f64))).larger(W::ZERO);
            for c in 0..self.angles {
                most = load::<W>(&rates[k * f + c]).larger(most);
            }
            for c in self.angles..f {
                most = load::<W>(&rates[k * f + c]).mul(load(&self.per_length)).larger(most);
            }
            sizes[back] = store(most);
            back += 1;
        }
        sizes
    }

    #[inline(always)]
    fn flaw<W: EightLanes>(&self, order: usize) -> W {
        let (f, mut flaw) = (self.coordinates, W::ZERO);
        for rate in &self.series.rates()[order * f..(order + 1) * f] {
            flaw = flaw.add(flaw_of(rate));
        }
        flaw
    }

    fn allowed(&mut self, step: &LaneStep, order: usize, tolerance: f64) -> f64 {
        let LaneStep { lane, time, left, mut wanted, .. } = *step;
        if let Some(judge) = &mut self.judge {
            let begun = Begun {
                high: &self.high,
                rates: self.series.rates(),
                coordinates: self.coordinates,
                angles: self.angles,
                per_length: self.per_length.0[lane],
            };
            wanted = judge.allowed(begun, step, order, tolerance);
        }
        if self.mechanism.contacts.is_empty() {
            return wanted;
        }
        let length = wanted.min(left);
        let step = StepFrom { lane, time, order, length };
        match self.clearance.of(&self.mechanism, &*self.series, step) {
            Some(clear) if clear < length => clear,
            Some(_) => wanted,
            None => {
                (self.is_leaving[lane], self.is_going[lane]) = (true, false);
                0.0
            }
        }
    }

    #[inline(always)]
    fn finish<W: EightLanes>(&mut self, order: usize, taken: &Octet) {
        let (f, h) = (self.coordinates, load::<W>(taken));
        let (rates, power, square) = (self.series.rates(), self.series.power(), h.mul(h));
        self.taken = *taken;
        for c in 0..f {
            // Even and odd powers apart.
            let (mut angle, mut rate) = ([W::ZERO; 2], [W::ZERO; 2]);
            let mut k = order;
            while k > 0 {
                let v = load::<W>(&rates[k * f + c]);
                if k.is_multiple_of(2) {
                    (angle[0], rate[0]) =
                        (angle[0].mul_add(square, over(v, k + 1)), rate[0].mul_add(square, v));
                } else {
                    (angle[1], rate[1]) =
                        (angle[1].mul_add(square, over(v, k + 1)), rate[1].mul_add(square, v));
                }
                k -= 1;
            }
            let angle = h.mul(load::<W>(&rates[c]).add(moved(angle, h)));
            let drifted = load::<W>(&self.low[f + c]).mul(h);
            (self.high[c], self.low[c]) = added([&self.high[c], &self.low[c]], angle, drifted);
            (self.high[f + c], self.low[f + c]) =
                added([&self.high[f + c], &self.low[f + c]], moved(rate, h), W::ZERO);
        }
        let mut work = [W::ZERO; 2];
        let mut k = order;
        while k > 0 {
            let part = over(load::<W>(&power[k - 1]), k);
            if k.is_multiple_of(2) {
                work[0] = work[0].mul_add(square, part);
            } else {
                work[1] = work[1].mul_add(square, part);
            }
            k -= 1;
        }
        (self.high[2 * f], self.low[2 * f]) =
            added([&self.high[2 * f], &self.low[2 * f]], moved(work, h), W::ZERO);
        self.land();
    }

    fn ends(&self, lane: usize, body: usize) -> [[f64; 2]; 2] {
        let (start, f) = (self.start(lane, body), self.coordinates);
        if let Some(base) = self.coordinate(body) {
            let moved = self.high[base].0[lane] - self.before[base].0[lane];
            let rate = self.series.rates()[base].0[lane];
            return [[start, rate], [start + moved, self.high[f + base].0[lane]]];
        }
        let (end, rate) = self.at(self.order, lane, body, self.taken.0[lane]);
        [[start, self.series.rate_of(0, body, lane)], [end, rate]]
    }

    fn wrap(&mut self, lane: usize, turns: &mut [i64]) {
        if self.mechanism.is_winding() {
            return;
        }
        for (c, turns) in turns.iter_mut().enumerate().take(self.coordinates) {
            *turns += angle::wrap(&mut self.high[c].0[lane], &mut self.low[c].0[lane]);
        }
    }

    fn write_state(&self, lane: usize, state: &mut State) {
        for (unknowns, numbers) in [(&mut state.y, &self.high), (&mut state.low, &self.low)] {
            for (unknown, number) in unknowns.iter_mut().zip(numbers) {
                *unknown = number.0[lane];
            }
        }
    }

    fn at(&self, order: usize, lane: usize, body: usize, after: f64) -> (f64, f64) {
        let (mut angle, mut rate) = (0.0, 0.0);
        let (f, coordinate) = (self.coordinates, self.coordinate(body));
        for k in (0..=order).rev() {
            let of = |c: usize| self.series.rates()[k * f + c].0[lane];
            let v = coordinate.map_or_else(|| self.series.rate_of(k, body, lane), of);
            rate = rate * after + v;
            angle = angle * after + v / (k + 1) as f64;
        }
        (self.start(lane, body) + angle * after, rate)
    }

    fn start_of(&self, lane: usize, coordinate: usize) -> Option<f64> {
        Some(self.before[coordinate].0[lane])
    }

    fn power_of(&self, lane: usize, coordinate: usize, k: usize) -> f64 {
        self.series.rates()[k * self.coordinates + coordinate].0[lane]
    }
}
