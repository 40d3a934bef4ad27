//! Bodies with closed loops, in natural coordinates, all lanes of mechanisms with one structure.
//!
//! The recurrence and the way back of [`looped`](super::super::looped), with the lanes over trajectories; the
//! matrices of the step's start stand between an order and the next, of which P is the square of a vector
//! where there is one degree of freedom:
//!
//! ```text
//! f_m = F_m - Σ_{j<m} mu_j z_{m-j},    q_m = (m+1)(m+2)/2 Σ_{j=1..m+1} z_j·z_{m+2-j}
//! (m+1)(m+2) z_{m+2} = P f_m - U q_m,   mu_m = Uᵀ f_m + S⁻¹ q_m,   V_j = W_·j z_j,  U = V S⁻¹,  P = W - U Vᵀ
//! ```
//!
//! A trajectory leaves the lanes where a step begins or ends near a singular position, as it leaves that
//! kernel.

// Iterators and closures are left out of the loops over vectors: they are not compiled into code for these.

mod matrices;
mod spring;
mod turn;

use self::matrices::Matrices;
use self::spring::LaneSpringSeries;
use super::{BatchMember, HIGHEST_ORDER, JUDGES, LaneClock, LaneKernel, added, flaw_of, load, store, unit};
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::wide::{EightLanes, Vectors};
use crate::arithmetic::{Complex, angle};
use crate::dynamics::force::action::Applied;
use crate::dynamics::natural::ReducedMatrices;
use crate::dynamics::series::lanes::are_equal;
use crate::dynamics::{self, Mechanism, State};
use std::f64::consts::TAU;

const ZERO: Octet = Octet([0.0; LANES]);
/// Powers of z there is room for, body by body.
const ROOM: usize = HIGHEST_ORDER + 2;

/// x and y of a vector in every lane.
type Pair = [Octet; 2];
const PAIR: Pair = [ZERO; 2];

/// Puts a vector into a lane.
fn put(pair: &mut Pair, lane: usize, vector: Complex<f64>) {
    (pair[0].0[lane], pair[1].0[lane]) = (vector.re, vector.im);
}

/// The mechanism, states and coefficients of the trajectories in the lanes.
#[derive(Debug)]
pub(super) struct LoopLanes {
    count: usize,
    /// What the lanes hold to begin with, and which hold other constants.
    like: Mechanism,
    has_others: [bool; LANES],
    /// Where the mechanisms of the trajectories in the lanes are, to tell one from another.
    present: [Option<usize>; LANES],
    matrices: Matrices,
    /// Gravity and constant forces on every element, the share of the latter, and constant torques \[N·m\].
    weight: Vec<Pair>,
    applied: Vec<Pair>,
    torque: Vec<Octet>,
    springs: Vec<LaneSpringSeries>,
    /// Leading parts of angles, rates and work (2n + 1), what they leave out, and both where the step began.
    high: Vec<Octet>,
    low: Vec<Octet>,
    before: [Vec<Octet>; 2],
    taken: Octet,
    /// Powers of z, x and y (each n × [`ROOM`]), and of mu.
    x: Vec<Octet>,
    y: Vec<Octet>,
    mu: Vec<Octet>,
    /// f and q of an order, and what comes of them (3n).
    right: Vec<Octet>,
    found: Vec<Octet>,
    /// Unit vectors and their rates at the step's end, x and y (4n), and the turns up to there \[rad\].
    end: Vec<Octet>,
    is_going: [bool; LANES],
    is_leaving: [bool; LANES],
}

/// True for what [`looped`](super::super::looped) takes, but for what only the matrices tell.
fn fits(mechanism: &Mechanism) -> bool {
    let is_constant = |action: &dynamics::force::AppliedAction| {
        action.law.is_none() && !matches!(action.kind, Applied::Force { follows: true, .. })
    };
    super::trees::fits(mechanism)
        && mechanism.has_closed_loops()
        && mechanism.forces.is_empty()
        && mechanism.contacts.is_empty()
        && !mechanism.is_winding()
        && !mechanism.is_damped()
        && mechanism.actions.iter().all(is_constant)
}

impl LaneKernel for LoopLanes {
    fn new(first: &BatchMember, _order: usize, _vectors: Vectors) -> Self {
        let (like, reduced) = (first.mechanism, first.reduced());
        let n = like.bodies.len();
        let room = |size: usize| vec![ZERO; size];
        let mut kernel = Self {
            count: n,
            like: like.clone(),
            has_others: [false; LANES],
            present: [None; LANES],
            matrices: Matrices::new(reduced, n, like.assembly.degrees_of_freedom == 1),
            weight: vec![PAIR; n],
            applied: vec![PAIR; n],
            torque: room(n),
            springs: like.springs.iter().map(LaneSpringSeries::new).collect(),
            high: room(2 * n + 1),
            low: room(2 * n + 1),
            before: [room(2 * n + 1), room(2 * n + 1)],
            taken: ZERO,
            x: room(n * ROOM),
            y: room(n * ROOM),
            mu: room(n * ROOM),
            right: room(3 * n),
            found: room(3 * n),
            end: room(5 * n),
            is_going: [false; LANES],
            is_leaving: [false; LANES],
        };
        (0..LANES).for_each(|lane| kernel.put(lane, like, reduced));
        kernel
    }

    fn fits(member: &BatchMember, like: &BatchMember) -> bool {
        let (one, other) = (member.mechanism, like.mechanism);
        if std::ptr::eq(one, other) {
            return fits(one) && like.reduced().is_some();
        }
        let rows = |of: &BatchMember| -> Option<Vec<usize>> {
            of.reduced().map(|reduced| reduced.rows.iter().map(|row| row.row).collect())
        };
        let is_alike = || {
            are_equal(one, other)
                || member.is_alike(like) && rows(member).is_some_and(|own| rows(like) == Some(own))
        };
        fits(one) && one.assembly.degrees_of_freedom == other.assembly.degrees_of_freedom && is_alike()
    }

    fn take_in(&mut self, lane: usize, member: &BatchMember, _order: usize) -> f64 {
        self.set_idle(lane);
        let place = std::ptr::from_ref(member.mechanism).addr();
        if self.present[lane].replace(place) != Some(place) {
            let is_other = !are_equal(member.mechanism, &self.like);
            if std::mem::replace(&mut self.has_others[lane], is_other) || is_other {
                self.put(lane, member.mechanism, member.reduced());
            }
        }
        for (numbers, unknowns) in [(&mut self.high, &member.state.y), (&mut self.low, &member.state.low)] {
            for (number, unknown) in numbers.iter_mut().zip(unknowns) {
                number.0[lane] = *unknown;
            }
        }
        libm::exp2(30.0) * member.mechanism.units.time
    }

    /// At rest.
    fn set_idle(&mut self, lane: usize) {
        self.high.iter_mut().chain(&mut self.low).for_each(|number| number.0[lane] = 0.0);
    }

    #[inline(always)]
    fn begin<W: EightLanes>(&mut self, clock: &LaneClock) {
        self.before[0].copy_from_slice(&self.high);
        self.before[1].copy_from_slice(&self.low);
        let n = self.count;
        for i in 0..n {
            let at = i * ROOM;
            let [c, s] = unit::<W>(&self.high[i], &self.low[i]);
            let w = load::<W>(&self.high[n + i]);
            (self.x[at], self.y[at]) = (c, s);
            self.x[at + 1] = store(W::ZERO.sub(load::<W>(&s).mul(w)));
            self.y[at + 1] = store(load::<W>(&c).mul(w));
            (self.end[i], self.end[n + i]) = (c, s);
        }
        let [x, y] = self.end[..2 * n].split_at(n).into();
        let weakest = self.matrices.face::<W>(x, y);
        self.matrices.combine::<W>();
        for (lane, is_there) in clock.is_going.into_iter().enumerate() {
            self.is_going[lane] = is_there && matrices::is_regular(&weakest, lane);
            self.is_leaving[lane] = is_there && !self.is_going[lane];
        }
    }

    #[inline(always)]
    fn expand<W: EightLanes>(&mut self, order: usize) {
        for m in 0..order {
            self.forces::<W>(m);
            self.known::<W>(m);
            self.matrices.times::<W>(&self.right, &mut self.found);
            let n = self.count;
            let scale = W::splat(1.0 / ((m + 1) * (m + 2)) as f64);
            for i in 0..n {
                let at = i * ROOM + m + 2;
                self.x[at] = store(load::<W>(&self.found[i]).mul(scale));
                self.y[at] = store(load::<W>(&self.found[n + i]).mul(scale));
                self.mu[i * ROOM + m] = self.found[2 * n + i];
            }
        }
    }

    fn is_leaving(&self, lane: usize) -> bool {
        self.is_leaving[lane]
    }

    #[inline(always)]
    fn sizes<W: EightLanes>(&self, order: usize) -> [Octet; JUDGES] {
        let mut sizes = [ZERO; JUDGES];
        let mut back = 0;
        while back < JUDGES {
            let k = order - back + 1;
            let mut most = W::ZERO;
            for i in 0..self.count {
                most = load::<W>(&self.x[i * ROOM + k]).larger(most);
                most = load::<W>(&self.y[i * ROOM + k]).larger(most);
            }
            sizes[back] = store(most.mul(W::splat(k as f64)));
            back += 1;
        }
        sizes
    }

    #[inline(always)]
    fn flaw<W: EightLanes>(&self, order: usize) -> W {
        let mut flaw = W::ZERO;
        for i in 0..self.count {
            let last = i * ROOM + order + 1;
            flaw = flaw.add(flaw_of(&self.x[last])).add(flaw_of(&self.y[last]));
        }
        flaw
    }

    #[inline(always)]
    fn finish<W: EightLanes>(&mut self, order: usize, taken: &Octet) {
        let (n, h) = (self.count, load::<W>(taken));
        self.taken = *taken;
        for i in 0..n {
            let x = &self.x[i * ROOM..(i + 1) * ROOM];
            let y = &self.y[i * ROOM..(i + 1) * ROOM];
            let [[x, y], [dx, dy]] = sums::<W>(x, y, order, h);
            (self.end[i], self.end[n + i]) = (store(x), store(y));
            (self.end[2 * n + i], self.end[3 * n + i]) = (store(dx), store(dy));
        }
        for lane in 0..LANES {
            self.is_going[lane] &= taken.0[lane] > 0.0;
        }
        let (z, rest) = self.end.split_at_mut(2 * n);
        let is_landed = self.matrices.land::<W>(z, &mut rest[..2 * n], &self.is_going);
        self.turns::<W>(order, h);
        let longest = self.advance::<W>(h);
        for lane in 0..LANES {
            let is_whole = is_landed[lane] && longest.0[lane] <= turn::MOST;
            self.is_leaving[lane] |= self.is_going[lane] && !is_whole;
            if !(self.is_going[lane] && is_whole) {
                self.keep(lane);
            }
        }
    }

    fn ends(&self, lane: usize, body: usize) -> [[f64; 2]; 2] {
        let (start, n) = (self.start(lane, body), self.count);
        let moved = self.high[body].0[lane] - self.before[0][body].0[lane];
        [[start, self.before[0][n + body].0[lane]], [start + moved, self.high[n + body].0[lane]]]
    }

    fn wrap(&mut self, lane: usize, turns: &mut [i64]) {
        for (c, turns) in turns.iter_mut().enumerate().take(self.count) {
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
        let power = |k: usize| {
            let at = body * ROOM + k;
            Complex::new(self.x[at].0[lane], self.y[at].0[lane])
        };
        let vector = |h: f64| (0..order + 2).rev().fold(Complex::ZERO, |sum, k| sum.times(h) + power(k));
        let (from, between, to) = (power(0), vector(0.5 * after), vector(after));
        let turned = |a: Complex<f64>, b: Complex<f64>| libm::atan2(a.cross(b), a.dot(b));
        let velocity =
            (1..order + 2).rev().fold(Complex::ZERO, |sum, k| sum.times(after) + power(k).times(k as f64));
        let rate = to.cross(velocity) / to.norm_squared();
        (self.start(lane, body) + turned(from, between) + turned(between, to), rate)
    }
}

impl LoopLanes {
    /// Puts the constants of a mechanism into a lane.
    fn put(&mut self, lane: usize, mechanism: &Mechanism, reduced: Option<&ReducedMatrices>) {
        let n = self.count;
        let (mut applied, mut torque) = (vec![Complex::ZERO; n], vec![0.0; n]);
        for action in &mechanism.actions {
            match &action.kind {
                Applied::Force { point, force, .. } => point.spread(*force, |k, force| applied[k] += force),
                Applied::Torque { torque: value, base } => {
                    torque[action.body] += value;
                    if let Some(base) = base {
                        torque[*base] -= value;
                    }
                }
            }
        }
        for i in 0..n {
            put(&mut self.weight[i], lane, mechanism.tree.weight[i] + applied[i]);
            put(&mut self.applied[i], lane, applied[i]);
            self.torque[i].0[lane] = torque[i];
        }
        self.springs.iter_mut().zip(&mechanism.springs).for_each(|(spring, own)| spring.take_in(lane, own));
        if let Some(reduced) = reduced {
            self.matrices.take_in(lane, reduced);
        }
    }

    /// The angle of a body where the step began, less whole turns \[rad\].
    fn start(&self, lane: usize, body: usize) -> f64 {
        let angle = self.before[0][body].0[lane];
        angle - TAU * angle::whole_turns(angle)
    }

    /// Power m of the applied forces, into f.
    #[inline(always)]
    fn forces<W: EightLanes>(&mut self, m: usize) {
        let n = self.count;
        for i in 0..n {
            let at = i * ROOM + m;
            let torque = load::<W>(&self.torque[i]);
            let mut fx = W::ZERO.sub(load::<W>(&self.y[at]).mul(torque));
            let mut fy = load::<W>(&self.x[at]).mul(torque);
            if m == 0 {
                fx = fx.add(load(&self.weight[i][0]));
                fy = fy.add(load(&self.weight[i][1]));
            }
            (self.right[i], self.right[n + i]) = (store(fx), store(fy));
        }
        for spring in &mut self.springs {
            spring.pull::<W>(m, [&self.x, &self.y], &mut self.right);
        }
    }

    /// What is known of order m: the multipliers so far in f, and q.
    #[inline(always)]
    fn known<W: EightLanes>(&mut self, m: usize) {
        let n = self.count;
        for i in 0..n {
            let x = &self.x[i * ROOM..i * ROOM + m + 2];
            let y = &self.y[i * ROOM..i * ROOM + m + 2];
            let mu = &self.mu[i * ROOM..i * ROOM + m];
            let (mut fx, mut fy) = (load::<W>(&self.right[i]), load::<W>(&self.right[n + i]));
            // The newest multiplier last.
            for j in 0..m {
                let mu = load::<W>(&mu[j]);
                fx = mu.neg_mul_add(load(&x[m - j]), fx);
                fy = mu.neg_mul_add(load(&y[m - j]), fy);
            }
            (self.right[i], self.right[n + i]) = (store(fx), store(fy));
            let (mut along, mut across) = (W::ZERO, W::ZERO);
            let mut j = m.div_ceil(2);
            while j > 0 {
                along = load::<W>(&x[j]).mul_add(load(&x[m + 2 - j]), along);
                across = load::<W>(&y[j]).mul_add(load(&y[m + 2 - j]), across);
                j -= 1;
            }
            let mut whole = along.add(across);
            if m.is_multiple_of(2) {
                let (x, y) = (load::<W>(&x[m / 2 + 1]), load::<W>(&y[m / 2 + 1]));
                whole = x.mul_add(x, y.mul(y)).mul_add(W::splat(0.5), whole);
            }
            self.right[2 * n + i] = store(whole.mul(W::splat(((m + 1) * (m + 2)) as f64)));
        }
    }

    /// How far every body has turned in the step, by way of its middle.
    #[inline(always)]
    fn turns<W: EightLanes>(&mut self, order: usize, h: W) {
        let n = self.count;
        for i in 0..n {
            let x = &self.x[i * ROOM..(i + 1) * ROOM];
            let y = &self.y[i * ROOM..(i + 1) * ROOM];
            let middle = place::<W>(x, y, order, h.mul(W::splat(0.5)));
            let (from, to) = ([load::<W>(&x[0]), load(&y[0])], [load(&self.end[i]), load(&self.end[n + i])]);
            let first = turn::between::<W>(from, middle);
            self.end[4 * n + i] = store(first.add(turn::between::<W>(middle, to)));
        }
    }

    /// Angles, rates and work at the step's end; tells the longest turn, by the rates at both ends too
    /// \[rad\].
    #[inline(always)]
    fn advance<W: EightLanes>(&mut self, h: W) -> Octet {
        let (n, mut work, mut longest) = (self.count, W::ZERO, W::ZERO);
        for i in 0..n {
            let turn = load::<W>(&self.end[4 * n + i]);
            (self.high[i], self.low[i]) = added([&self.high[i], &self.low[i]], turn, W::ZERO);
            let (x, y) = (load::<W>(&self.end[i]), load::<W>(&self.end[n + i]));
            let (dx, dy) = (load::<W>(&self.end[2 * n + i]), load::<W>(&self.end[3 * n + i]));
            let rate = y.neg_mul_add(dx, x.mul(dy));
            longest = turn.larger(rate.mul(h).larger(load::<W>(&self.high[n + i]).mul(h).larger(longest)));
            (self.high[n + i], self.low[n + i]) = (store(rate), ZERO);
            let at = i * ROOM;
            let moved = [x.sub(load(&self.x[at])), y.sub(load(&self.y[at]))];
            let along = moved[0].mul_add(load(&self.applied[i][0]), work);
            let across = moved[1].mul_add(load(&self.applied[i][1]), along);
            work = turn.mul_add(load(&self.torque[i]), across);
        }
        (self.high[2 * n], self.low[2 * n]) = added([&self.high[2 * n], &self.low[2 * n]], work, W::ZERO);
        store(longest)
    }

    /// Puts a lane back to where the step began.
    fn keep(&mut self, lane: usize) {
        let [high, low] = &self.before;
        let unknowns = self.high.iter_mut().zip(high).chain(self.low.iter_mut().zip(low));
        unknowns.for_each(|(unknown, kept)| unknown.0[lane] = kept.0[lane]);
    }
}

/// z and z' after `h` \[s\].
#[inline(always)]
fn sums<W: EightLanes>(x: &[Octet], y: &[Octet], order: usize, h: W) -> [[W; 2]; 2] {
    let (mut px, mut py, mut dx, mut dy) = (W::ZERO, W::ZERO, W::ZERO, W::ZERO);
    let mut k = order + 1;
    while k > 0 {
        let (x, y, factor) = (load::<W>(&x[k]), load::<W>(&y[k]), W::splat(k as f64));
        (px, py) = (px.mul_add(h, x), py.mul_add(h, y));
        (dx, dy) = (dx.mul_add(h, x.mul(factor)), dy.mul_add(h, y.mul(factor)));
        k -= 1;
    }
    [[px.mul_add(h, load(&x[0])), py.mul_add(h, load(&y[0]))], [dx, dy]]
}

/// z after `h` \[s\].
#[inline(always)]
fn place<W: EightLanes>(x: &[Octet], y: &[Octet], order: usize, h: W) -> [W; 2] {
    let (mut px, mut py) = (load::<W>(&x[order + 1]), load::<W>(&y[order + 1]));
    let mut k = order + 1;
    while k > 0 {
        k -= 1;
        (px, py) = (px.mul_add(h, load(&x[k])), py.mul_add(h, load(&y[k])));
    }
    [px, py]
}
