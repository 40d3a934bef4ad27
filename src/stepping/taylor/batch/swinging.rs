//! Two bodies, one of them driven from the ground by any sum of sines and a parabola.
//!
//! With e_1 and w the unit vector and rate of the driven body, which are known, e and v those of the free
//! one, W its weight and A = A12:
//!
//! ```text
//! (k+1) e_1,k+1 = left(Σ w_j e_1,k-j),      B = e_1'',      q = B·left(e)
//! d (k+1) v_{k+1} = e_k × W - A q_k,        (k+1) e_{k+1} = left(Σ v_j e_{k-j})
//! work = D Δ(w²)/2 + A (Δ(v w e·e_1) - ∫ v q dt) - Δe_1·W_1      D, W_1: inertia, weight of the driven one
//! ```
//!
//! The work is what changes the angular momentum of the driven body beside gravity; the energy is not asked.

use super::super::driven::DrivenKernel;
use super::super::terms::over;
use super::laws::{LaneLaws, RATES};
use super::{
    BatchMember, HIGHEST_ORDER, JUDGES, LaneClock, LaneKernel, added, flaw_of, load, moved, store, unit,
};
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::wide::{EightLanes, Vectors};
use crate::arithmetic::{DoubleDouble, angle};
use crate::dynamics::{Mechanism, State};
use crate::scene::Law;

const ZERO: Octet = Octet([0.0; LANES]);

/// Constants, states and coefficients of the trajectories in the lanes.
#[derive(Clone, Debug)]
pub(in crate::stepping::taylor) struct SwingingLanes {
    laws: LaneLaws,
    /// The body that is driven.
    driven: [usize; LANES],
    /// What an error of the unit vectors comes to in the work: a part, and a part times the free body's rate.
    share: [Octet; 2],
    /// A and D \[kg·m²\], W_1 \[N·m\].
    coupling: Octet,
    inertia: Octet,
    weight: [Octet; 2],
    /// (W × , - A) over d as a product with (cos, sin, q) \[1/s², 1\], in two terms.
    load: [[Octet; 3]; 2],
    /// Leading parts of angle, rate and work, and what they leave out.
    high: [Octet; 3],
    low: [Octet; 3],
    /// The free body's angle at the start of the step.
    before: Octet,
    /// What angle and rate of the driven body grow by in the step.
    moved: [Octet; 2],
    given: [GivenPower; RATES],
    powers: [SwingingPower; HIGHEST_ORDER + 1],
}

/// One power of the driven body: the unit vector, and its second derivative.
#[derive(Clone, Copy, Debug)]
struct GivenPower {
    c: Octet,
    s: Octet,
    bx: Octet,
    by: Octet,
}

/// One power of the free body: the unit vector and the rate; q, and its product with the rate.
#[derive(Clone, Copy, Debug)]
struct SwingingPower {
    c: Octet,
    s: Octet,
    v: Octet,
    q: Octet,
    power: Octet,
}

impl SwingingLanes {
    /// Puts a lane's unknowns where a state is.
    #[inline(always)]
    pub(in crate::stepping::taylor) fn set_state(&mut self, lane: usize, state: &State) {
        let unknowns = state.y.iter().zip(&state.low).zip(self.high.iter_mut().zip(&mut self.low));
        for ((&y, &rest), (high, low)) in unknowns {
            (high.0[lane], low.0[lane]) = (y, rest);
        }
    }

    /// The driven body up to what order `order` of the free one asks for.
    #[inline(always)]
    fn drive<W: EightLanes>(&mut self, order: usize) {
        [self.given[0].c, self.given[0].s] = unit::<W>(&self.laws.angle[0], &self.laws.angle[1]);
        for k in 0..=order {
            let (mut c, mut s, mut other_c, mut other_s) = (W::ZERO, W::ZERO, W::ZERO, W::ZERO);
            let mut j = 0;
            while j < k {
                let (w, late) = (load::<W>(&self.laws.rates[j]), &self.given[k - j]);
                (c, s) = (w.mul_add(load(&late.c), c), w.mul_add(load(&late.s), s));
                let (w, late) = (load::<W>(&self.laws.rates[j + 1]), &self.given[k - j - 1]);
                other_c = w.mul_add(load(&late.c), other_c);
                other_s = w.mul_add(load(&late.s), other_s);
                j += 2;
            }
            if j == k {
                let (w, late) = (load::<W>(&self.laws.rates[j]), &self.given[0]);
                (c, s) = (w.mul_add(load(&late.c), c), w.mul_add(load(&late.s), s));
            }
            let next_c = over(W::ZERO.sub(s.add(other_s)), k + 1);
            let next_s = over(c.add(other_c), k + 1);
            (self.given[k + 1].c, self.given[k + 1].s) = (store(next_c), store(next_s));
            if k > 0 {
                let factor = W::splat((k * (k + 1)) as f64);
                (self.given[k - 1].bx, self.given[k - 1].by) =
                    (store(next_c.mul(factor)), store(next_s.mul(factor)));
            }
        }
    }

    /// Order k of the free body.
    #[inline(always)]
    fn raise<W: EightLanes>(&mut self, k: usize) {
        let (newest, start) = (self.powers[k], self.powers[0]);
        // What the newest and the first coefficients contribute comes last.
        let (mut x, mut y, mut pull, mut power) = (W::ZERO, W::ZERO, W::ZERO, W::ZERO);
        let middle = 1..k.max(1);
        let early = self.powers[middle.clone()].iter().zip(&self.given[middle.clone()]);
        for ((early, given), late) in early.zip(self.powers[middle].iter().rev()) {
            let (v, c, s) = (load::<W>(&early.v), load::<W>(&late.c), load::<W>(&late.s));
            (x, y) = (v.mul_add(c, x), v.mul_add(s, y));
            pull = load::<W>(&given.by).mul_add(c, load::<W>(&given.bx).neg_mul_add(s, pull));
            power = v.mul_add(load(&late.q), power);
        }
        let (c, s, v0) = (load::<W>(&newest.c), load::<W>(&newest.s), load::<W>(&start.v));
        let given = &self.given[0];
        pull = load::<W>(&given.by).mul_add(c, load::<W>(&given.bx).neg_mul_add(s, pull));
        (x, y) = (v0.mul_add(c, x), v0.mul_add(s, y));
        if k > 0 {
            let (v, first_c, first_s) = (load::<W>(&newest.v), load::<W>(&start.c), load::<W>(&start.s));
            let given = &self.given[k];
            pull = load::<W>(&given.by).mul_add(first_c, load::<W>(&given.bx).neg_mul_add(first_s, pull));
            (x, y) = (v.mul_add(first_c, x), v.mul_add(first_s, y));
            power = v.mul_add(load(&start.q), power);
        }
        power = v0.mul_add(pull, power);
        (self.powers[k].q, self.powers[k].power) = (store(pull), store(power));
        let [high, low] = &self.load;
        let rest = c.mul_add(load(&low[0]), s.mul_add(load(&low[1]), pull.mul(load(&low[2]))));
        let bend = pull.mul_add(load(&high[2]), s.mul_add(load(&high[1]), c.mul_add(load(&high[0]), rest)));
        let next = &mut self.powers[k + 1];
        next.v = store(over(bend, k + 1));
        (next.c, next.s) = (store(over(W::ZERO.sub(y), k + 1)), store(over(x, k + 1)));
    }
}

/// The law of a mechanism of this kind.
pub(in crate::stepping::taylor) fn law_of(mechanism: &Mechanism) -> Option<&Law> {
    let fits = |law: &&Law| law.profile.is_none() && !law.is_steady() && mechanism.contacts.is_empty();
    DrivenKernel::pattern(mechanism).map(|(_, law)| law).filter(fits)
}

/// True for mechanisms of this kind.
pub(super) fn fits(mechanism: &Mechanism) -> bool {
    law_of(mechanism).is_some()
}

impl LaneKernel for SwingingLanes {
    fn new(_: &BatchMember, _order: usize, _vectors: Vectors) -> Self {
        Self {
            laws: LaneLaws::new(),
            driven: [0; LANES],
            share: [ZERO; 2],
            coupling: ZERO,
            inertia: ZERO,
            weight: [ZERO; 2],
            load: [[ZERO; 3]; 2],
            high: [ZERO; 3],
            low: [ZERO; 3],
            before: ZERO,
            moved: [ZERO; 2],
            given: [GivenPower { c: ZERO, s: ZERO, bx: ZERO, by: ZERO }; RATES],
            powers: [SwingingPower { c: ZERO, s: ZERO, v: ZERO, q: ZERO, power: ZERO }; HIGHEST_ORDER + 1],
        }
    }

    fn fits(member: &BatchMember, _: &BatchMember) -> bool {
        fits(member.mechanism)
    }

    fn take_in(&mut self, lane: usize, member: &BatchMember, order: usize) -> f64 {
        let (mechanism, state) = (member.mechanism, &member.state);
        let (Some((driven, law)), tree) = (DrivenKernel::pattern(mechanism), &mechanism.tree) else {
            return 0.0;
        };
        let (free, [fastest, bend]) = (1 - driven, law.bounds(state.time.hi));
        let (a, d, pull, weight) =
            (tree.coupling[1].re, tree.diagonal[free], tree.weight[free], tree.weight[driven]);
        self.driven[lane] = driven;
        self.laws.take_in(lane, law);
        let swing = (fastest * a).abs() / mechanism.energy_scale;
        let share = [swing * fastest + weight.norm_squared().sqrt() / mechanism.energy_scale, swing];
        for (own, share) in self.share.iter_mut().zip(share) {
            own.0[lane] = share / mechanism.units.time;
        }
        (self.coupling.0[lane], self.inertia.0[lane]) = (a, tree.diagonal[driven]);
        (self.weight[0].0[lane], self.weight[1].0[lane]) = (weight.re, weight.im);
        for (i, number) in [pull.im, -pull.re, -a].into_iter().enumerate() {
            let term = DoubleDouble::from(number) / DoubleDouble::from(d);
            (self.load[0][i].0[lane], self.load[1][i].0[lane]) = (term.hi, term.lo);
        }
        self.set_state(lane, state);
        let stiffness = pull.norm_squared().sqrt() + a.abs() * (fastest * fastest + bend);
        let frequency = law.sines.iter().fold(fastest, |most, sine| most.max(sine.frequency.abs()));
        order as f64 / 8.0 / (stiffness / d).sqrt().max(frequency)
    }

    /// At rest, without a motor.
    fn set_idle(&mut self, lane: usize) {
        self.high.iter_mut().chain(&mut self.low).for_each(|number| number.0[lane] = 0.0);
        self.laws.take_in(lane, &Law::default());
    }

    #[inline(always)]
    fn begin<W: EightLanes>(&mut self, clock: &LaneClock) {
        self.before = self.high[0];
        self.laws.begin::<W>(clock);
        self.laws.expand::<W>();
    }

    #[inline(always)]
    fn expand<W: EightLanes>(&mut self, order: usize) {
        self.drive::<W>(order);
        let [c, s] = unit::<W>(&self.high[0], &self.low[0]);
        self.powers[0] = SwingingPower { c, s, v: self.high[1], q: ZERO, power: ZERO };
        for k in 0..order {
            self.raise::<W>(k);
        }
    }

    #[inline(always)]
    fn sizes<W: EightLanes>(&self, order: usize) -> [Octet; JUDGES] {
        // The work is made of the unit vectors, whose powers may fall more slowly than those of the rate.
        let steady = load::<W>(&self.share[0]);
        let swing = load::<W>(&self.powers[0].v).larger(W::ZERO).mul(load(&self.share[1]));
        let share = steady.add(swing);
        let mut sizes = [Octet::splat(0.0); JUDGES];
        let mut back = 0;
        while back < JUDGES {
            let (power, given) = (&self.powers[order - back], &self.given[order - back]);
            let most = load::<W>(&power.c).larger(load::<W>(&power.s).larger(W::ZERO));
            let most = load::<W>(&given.c).larger(load::<W>(&given.s).larger(most));
            sizes[back] = store(load::<W>(&power.v).larger(share.mul(most)));
            back += 1;
        }
        sizes
    }

    #[inline(always)]
    fn flaw<W: EightLanes>(&self, order: usize) -> W {
        flaw_of(&self.powers[order].v)
    }

    #[inline(always)]
    fn finish<W: EightLanes>(&mut self, order: usize, taken: &Octet) {
        let h = load::<W>(taken);
        let (square, zero) = (h.mul(h), W::ZERO);
        // Even and odd powers apart: unit vectors and rates of both, means of the rates and of the power.
        let (mut c, mut s, mut first_c, mut first_s) = ([zero; 2], [zero; 2], [zero; 2], [zero; 2]);
        let (mut rate, mut faster, mut angle, mut swept) = ([zero; 2], [zero; 2], [zero; 2], [zero; 2]);
        let mut farther = [zero; 2];
        macro_rules! add {
            ($parity:literal, $k:expr) => {
                let (power, given) = (&self.powers[$k], &self.given[$k]);
                let v = load::<W>(&power.v);
                c[$parity] = c[$parity].mul_add(square, load(&power.c));
                s[$parity] = s[$parity].mul_add(square, load(&power.s));
                first_c[$parity] = first_c[$parity].mul_add(square, load(&given.c));
                first_s[$parity] = first_s[$parity].mul_add(square, load(&given.s));
                rate[$parity] = rate[$parity].mul_add(square, v);
                let w = load::<W>(&self.laws.rates[$k]);
                faster[$parity] = faster[$parity].mul_add(square, w);
                farther[$parity] = farther[$parity].mul_add(square, over(w, $k + 1));
                angle[$parity] = angle[$parity].mul_add(square, over(v, $k + 1));
                let before = load::<W>(&self.powers[$k - 1].power);
                swept[$parity] = swept[$parity].mul_add(square, over(before, $k));
            };
        }
        let mut k = order;
        if k % 2 == 1 {
            add!(1, k);
            k -= 1;
        }
        while k > 0 {
            add!(0, k);
            add!(1, k - 1);
            k -= 2;
        }
        let (c_moved, s_moved) = (moved(c, h), moved(s, h));
        let (first_c_moved, first_s_moved) = (moved(first_c, h), moved(first_s, h));
        let (rate, faster) = (moved(rate, h), moved(faster, h));
        let (angle, swept) = (moved(angle, h), moved(swept, h));
        let (start, given) = (&self.powers[0], &self.given[0]);
        let (c, s, v) = (load::<W>(&start.c), load::<W>(&start.s), load::<W>(&start.v));
        let (first_c, first_s, w) =
            (load::<W>(&given.c), load::<W>(&given.s), load::<W>(&self.laws.rates[0]));
        self.moved = [store(h.mul(w.add(moved(farther, h)))), store(faster)];
        let w_new = w.add(faster);
        let (c_new, s_new) = (c.add(c_moved), s.add(s_moved));
        let turned = c_moved
            .mul_add(first_c, s_moved.mul(first_s))
            .add(c_new.mul_add(first_c_moved, s_new.mul(first_s_moved)));
        let between = c.mul_add(first_c, s.mul(first_s)).add(turned);
        let quicker = rate.mul_add(w_new, v.mul(faster));
        let momentum = quicker.mul_add(between, v.mul(w).mul(turned)).sub(swept);
        let weights = first_c_moved.mul(load(&self.weight[0])).add(first_s_moved.mul(load(&self.weight[1])));
        let own = load::<W>(&self.inertia).mul(faster.mul(w.add(w_new))).mul(W::splat(0.5));
        let work = own.add(load::<W>(&self.coupling).mul(momentum)).sub(weights);
        let angle = h.mul(v.add(angle));
        let drifted = load::<W>(&self.low[1]).mul(h);
        (self.high[0], self.low[0]) = added([&self.high[0], &self.low[0]], angle, drifted);
        (self.high[1], self.low[1]) = added([&self.high[1], &self.low[1]], rate, zero);
        (self.high[2], self.low[2]) = added([&self.high[2], &self.low[2]], work, zero);
    }

    #[inline]
    fn ends(&self, lane: usize, body: usize) -> [[f64; 2]; 2] {
        if body == self.driven[lane] {
            let start = [self.laws.angle[0].0[lane], self.laws.rates[0].0[lane]];
            return [start, [start[0] + self.moved[0].0[lane], start[1] + self.moved[1].0[lane]]];
        }
        let start = [self.before.0[lane], self.powers[0].v.0[lane]];
        [start, [self.high[0].0[lane], self.high[1].0[lane]]]
    }

    #[inline]
    fn wrap(&mut self, lane: usize, turns: &mut [i64]) {
        if let Some(turns) = turns.first_mut() {
            *turns += angle::wrap(&mut self.high[0].0[lane], &mut self.low[0].0[lane]);
        }
    }

    fn write_state(&self, lane: usize, state: &mut State) {
        for i in 0..3 {
            (state.y[i], state.low[i]) = (self.high[i].0[lane], self.low[i].0[lane]);
        }
    }

    fn at(&self, order: usize, lane: usize, body: usize, after: f64) -> (f64, f64) {
        let is_driven = body == self.driven[lane];
        let start = if is_driven { &self.laws.angle[0] } else { &self.before };
        let (mut angle, mut rate) = (0.0, 0.0);
        for k in (0..=order).rev() {
            let v = if is_driven { self.laws.rates[k].0[lane] } else { self.powers[k].v.0[lane] };
            rate = rate * after + v;
            angle = angle * after + v / (k + 1) as f64;
        }
        (start.0[lane] + angle * after, rate)
    }

    fn start_of(&self, lane: usize, _: usize) -> Option<f64> {
        Some(self.before.0[lane])
    }

    fn power_of(&self, lane: usize, _: usize, k: usize) -> f64 {
        self.powers[k].v.0[lane]
    }
}
