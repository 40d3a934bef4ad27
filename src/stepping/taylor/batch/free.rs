//! Up to six free bodies, four with springs: the equation of `bodies` with the lanes over trajectories
//! instead of bodies.

use super::series::{expand, finish};
use super::springs::LaneSprings;
use super::{BatchMember, HIGHEST_ORDER, JUDGES, LaneClock, LaneKernel, SPRINGS, flaw_of, load, store};
use crate::arithmetic::angle;
use crate::arithmetic::eight::Octet;
use crate::arithmetic::lanes::wide::{EightLanes, Vectors};
use crate::dynamics::{Mechanism, State};

/// Constants, states and coefficients of the trajectories in the lanes.
#[derive(Clone, Debug)]
pub(super) struct FreeLanes<const N: usize, const SPRUNG: bool> {
    /// A \[kg·m²\], zero on the diagonal.
    pub coupling: [[Octet; N]; N],
    pub diagonal: [Octet; N],
    /// W \[N·m\].
    pub weight: [[Octet; 2]; N],
    /// M_0⁻¹.
    pub inverse: [[Octet; N]; N],
    /// Leading parts of angles and rates, and what they leave out.
    pub high: [[Octet; N]; 2],
    pub low: [[Octet; N]; 2],
    /// Angles at the start of the step.
    before: [Octet; N],
    pub powers: [FreePower<N>; HIGHEST_ORDER + 1],
    pub springs: LaneSprings<N>,
}

/// Coefficients of one power: cos, sin, v, and the two components of P.
#[derive(Clone, Copy, Debug)]
pub(super) struct FreePower<const N: usize> {
    pub c: [Octet; N],
    pub s: [Octet; N],
    pub v: [Octet; N],
    pub px: [Octet; N],
    pub py: [Octet; N],
}

/// True for bodies that nothing but gravity and springs acts on, however many.
pub(super) fn fits(mechanism: &Mechanism) -> bool {
    !mechanism.tree.off_axis
        && mechanism.coordinates() == mechanism.bodies.len()
        && !mechanism.is_winding()
        && mechanism.actions.is_empty()
        && mechanism.forces.is_empty()
        && mechanism.constraints.is_empty()
        && mechanism.contacts.is_empty()
}

impl<const N: usize, const SPRUNG: bool> LaneKernel for FreeLanes<N, SPRUNG> {
    fn new(like: &BatchMember, _order: usize, _vectors: Vectors) -> Self {
        let zero = [Octet::splat(0.0); N];
        let power = FreePower { c: zero, s: zero, v: zero, px: zero, py: zero };
        Self {
            coupling: [zero; N],
            diagonal: [Octet::splat(1.0); N],
            weight: [[Octet::splat(0.0); 2]; N],
            inverse: [zero; N],
            high: [zero; 2],
            low: [zero; 2],
            before: zero,
            powers: [power; HIGHEST_ORDER + 1],
            springs: LaneSprings::new(like.mechanism.springs.len()),
        }
    }

    fn fits(member: &BatchMember, like: &BatchMember) -> bool {
        let (mechanism, like) = (member.mechanism, like.mechanism);
        mechanism.tree.coordinates == N
            && SPRUNG != mechanism.springs.is_empty()
            && mechanism.springs.len() <= SPRINGS
            && mechanism.springs.len() == like.springs.len()
            && fits(mechanism)
    }

    fn take_in(&mut self, lane: usize, member: &BatchMember, order: usize) -> f64 {
        let tree = &member.mechanism.tree;
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
        if SPRUNG {
            self.springs.take_in(lane, member.mechanism, &member.state);
        }
        order as f64 / 3.0 / tree.fastest_rate(&member.mechanism.springs)
    }

    /// Bodies hanging at rest.
    fn set_idle(&mut self, lane: usize) {
        for part in [&mut self.high, &mut self.low] {
            for numbers in part.iter_mut().flatten() {
                numbers.0[lane] = 0.0;
            }
        }
        self.springs.set_idle(lane);
    }

    #[inline(always)]
    fn begin<W: EightLanes>(&mut self, _: &LaneClock) {
        self.before = self.high[0];
    }

    #[inline(always)]
    fn expand<W: EightLanes>(&mut self, order: usize) {
        expand::<W, N, SPRUNG>(self, order);
    }

    #[inline(always)]
    fn sizes<W: EightLanes>(&self, order: usize) -> [Octet; JUDGES] {
        let mut sizes = [Octet::splat(0.0); JUDGES];
        let mut back = 0;
        while back < JUDGES {
            let power = &self.powers[order - back];
            let mut most = W::ZERO;
            for i in 0..N {
                most = load::<W>(&power.v[i]).larger(most);
            }
            if SPRUNG {
                most = self.springs.judged::<W>(order - back).larger(most);
            }
            sizes[back] = store(most);
            back += 1;
        }
        sizes
    }

    #[inline(always)]
    fn flaw<W: EightLanes>(&self, order: usize) -> W {
        let mut flaw = W::ZERO;
        for v in &self.powers[order].v {
            flaw = flaw.add(flaw_of(v));
        }
        flaw
    }

    #[inline(always)]
    fn finish<W: EightLanes>(&mut self, order: usize, taken: &Octet) {
        finish::<W, N, SPRUNG>(self, order, taken);
    }

    #[inline]
    fn ends(&self, lane: usize, body: usize) -> [[f64; 2]; 2] {
        let start = [self.before[body].0[lane], self.powers[0].v[body].0[lane]];
        [start, [self.high[0][body].0[lane], self.high[1][body].0[lane]]]
    }

    #[inline]
    fn wrap(&mut self, lane: usize, turns: &mut [i64]) {
        for i in 0..N {
            turns[i] += angle::wrap(&mut self.high[0][i].0[lane], &mut self.low[0][i].0[lane]);
        }
    }

    fn write_state(&self, lane: usize, state: &mut State) {
        for part in 0..2 {
            for i in 0..N {
                state.y[part * N + i] = self.high[part][i].0[lane];
                state.low[part * N + i] = self.low[part][i].0[lane];
            }
        }
        if SPRUNG {
            self.springs.write_state(lane, state);
        }
    }

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

    fn start_of(&self, lane: usize, coordinate: usize) -> Option<f64> {
        Some(self.before[coordinate].0[lane])
    }

    fn power_of(&self, lane: usize, coordinate: usize, k: usize) -> f64 {
        self.powers[k].v[coordinate].0[lane]
    }
}
