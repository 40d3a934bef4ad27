//! Two bodies, one of them driven from the ground at a constant rate: the equations of
//! [`driven`](super::super::driven) with the lanes over trajectories.
//!
//! ```text
//! d (k+1) v_{k+1} = e_k × W - A w² Im u_k
//! (k+1) e_{k+1} = left(Σ v_j e_{k-j}),    (k+1) u_{k+1} = left(Σ v_j u_{k-j} - w u_k)
//! ```

use super::super::driven::DrivenKernel;
use super::super::terms::over;
use super::laws::{LaneLaws, reduced};
use super::{
    BatchMember, HIGHEST_ORDER, JUDGES, LaneClock, LaneKernel, added, flaw_of, load, moved, pair, store, unit,
};
use crate::arithmetic::angle;
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::wide::{EightLanes, Vectors};
use crate::dynamics::{Mechanism, State};
use crate::scene::Law;

/// Orders from which on what constants leave out is too small to matter.
const FINE: usize = 12;

/// Constants, states and coefficients of the trajectories in the lanes.
#[derive(Clone, Debug)]
pub(super) struct DrivenLanes {
    laws: LaneLaws,
    /// The body that is driven.
    driven: [usize; LANES],
    /// What an error of the unit vectors comes to in the work: a part, and a part times the free body's rate.
    share: [Octet; 2],
    /// A \[kg·m²\], W of the driven body \[N·m\].
    coupling: Octet,
    weight: [Octet; 2],
    /// (W × , - A w²) over d as a product with (cos e, sin e, Im u) \[1/s²\], in two terms.
    load: [[Octet; 3]; 2],
    /// Leading parts of angle, rate and work, and what they leave out.
    high: [Octet; 3],
    low: [Octet; 3],
    /// The free body's angle from the driven one's, in two terms, and both angles at the start of the step.
    between: [Octet; 2],
    before: [Octet; 2],
    /// What the driven body turns in the step \[rad\].
    swept: Octet,
    powers: [DrivenPower; HIGHEST_ORDER + 1],
}

/// Coefficients of one power: e, u and v.
#[derive(Clone, Copy, Debug)]
struct DrivenPower {
    c: Octet,
    s: Octet,
    x: Octet,
    y: Octet,
    v: Octet,
}

/// Σ_{j=1..k-1} v_j E_{k-j} and Σ_{j=1..k} v_j E_{k+1-j} of some components E.
macro_rules! older {
    ($powers:expr, $k:expr, $($part:ident),*) => {{
        let (powers, k) = ($powers, $k);
        // The sum, that of the next order, and the factor both share.
        $(let mut $part = (W::ZERO, W::ZERO, load::<W>(&powers[k].$part));)*
        for (early, late) in powers[1..k].iter().zip(powers[1..k].iter().rev()) {
            let v = load::<W>(&early.v);
            $(
                $part.1 = v.mul_add($part.2, $part.1);
                $part.2 = load(&late.$part);
                $part.0 = v.mul_add($part.2, $part.0);
            )*
        }
        let v = load::<W>(&powers[k].v);
        [[$($part.0),*], [$(v.mul_add($part.2, $part.1)),*]]
    }};
}

impl DrivenLanes {
    /// Order k: from the newest coefficients and what the others contribute to e and u, to the next ones.
    #[inline(always)]
    fn raise<W: EightLanes>(&mut self, k: usize, [c_older, s_older, x_older, y_older]: [W; 4]) {
        let (newest, start) = (self.powers[k], self.powers[0]);
        let (c, s, x, y) =
            (load::<W>(&newest.c), load::<W>(&newest.s), load::<W>(&newest.x), load::<W>(&newest.y));
        let [high, low] = &self.load;
        // Low parts join before the rounding.
        let rest = if k < FINE {
            c.mul_add(load(&low[0]), s.mul_add(load(&low[1]), y.mul(load(&low[2]))))
        } else {
            W::ZERO
        };
        let pull = y.mul_add(load(&high[2]), s.mul_add(load(&high[1]), c.mul_add(load(&high[0]), rest)));
        let v0 = load::<W>(&start.v);
        let slower = v0.sub(load(&self.laws.rate));
        let (mut c_sum, mut s_sum) = (v0.mul_add(c, c_older), v0.mul_add(s, s_older));
        let (mut x_sum, mut y_sum) = (slower.mul_add(x, x_older), slower.mul_add(y, y_older));
        if k > 0 {
            let v = load::<W>(&newest.v);
            (c_sum, s_sum) = (v.mul_add(load(&start.c), c_sum), v.mul_add(load(&start.s), s_sum));
            (x_sum, y_sum) = (v.mul_add(load(&start.x), x_sum), v.mul_add(load(&start.y), y_sum));
        }
        self.powers[k + 1] = DrivenPower {
            c: store(over(W::ZERO.sub(s_sum), k + 1)),
            s: store(over(c_sum, k + 1)),
            x: store(over(W::ZERO.sub(y_sum), k + 1)),
            y: store(over(x_sum, k + 1)),
            v: store(over(pull, k + 1)),
        };
    }
}

/// True for mechanisms of this kind.
pub(super) fn fits(mechanism: &Mechanism) -> bool {
    DrivenKernel::of(mechanism).is_some() && mechanism.contacts.is_empty()
}

impl LaneKernel for DrivenLanes {
    fn new(_: &BatchMember, _order: usize, _vectors: Vectors) -> Self {
        let zero = Octet::splat(0.0);
        Self {
            laws: LaneLaws::new(),
            driven: [0; LANES],
            share: [zero; 2],
            coupling: zero,
            weight: [zero; 2],
            load: [[zero; 3]; 2],
            high: [zero; 3],
            low: [zero; 3],
            between: [zero; 2],
            before: [zero; 2],
            swept: zero,
            powers: [DrivenPower { c: zero, s: zero, x: zero, y: zero, v: zero }; HIGHEST_ORDER + 1],
        }
    }

    fn fits(member: &BatchMember, _: &BatchMember) -> bool {
        fits(member.mechanism)
    }

    fn take_in(&mut self, lane: usize, member: &BatchMember, order: usize) -> f64 {
        let Some(driven) = DrivenKernel::new(member.mechanism) else { return 0.0 };
        self.driven[lane] = driven.body;
        (self.share[0].0[lane], self.share[1].0[lane]) = (driven.share[0], driven.share[1]);
        self.coupling.0[lane] = driven.coupling;
        (self.weight[0].0[lane], self.weight[1].0[lane]) = (driven.weight.re, driven.weight.im);
        for (terms, load) in self.load.iter_mut().zip(driven.loads()) {
            for (term, load) in terms.iter_mut().zip(load) {
                term.0[lane] = load;
            }
        }
        for i in 0..3 {
            self.high[i].0[lane] = member.state.y[i];
            self.low[i].0[lane] = member.state.low[i];
        }
        self.laws.take_in(lane, &driven.law);
        driven.longest(order)
    }

    /// At rest, without a motor.
    fn set_idle(&mut self, lane: usize) {
        self.high.iter_mut().chain(&mut self.low).for_each(|number| number.0[lane] = 0.0);
        self.laws.take_in(lane, &Law::default());
    }

    #[inline(always)]
    fn begin<W: EightLanes>(&mut self, clock: &LaneClock) {
        self.laws.begin::<W>(clock);
        self.before = [self.high[0], self.laws.angle[0]];
        let (phi, turned) = (pair::<W>([&self.high[0], &self.low[0]]), pair(self.laws.angle.each_ref()));
        let between = reduced(phi.add(turned.minus()));
        self.between = [store(between.hi), store(between.lo)];
    }

    #[inline(always)]
    fn expand<W: EightLanes>(&mut self, order: usize) {
        let ([c, s], [x, y]) =
            (unit::<W>(&self.high[0], &self.low[0]), unit::<W>(&self.between[0], &self.between[1]));
        self.powers[0] = DrivenPower { c, s, x, y, v: self.high[1] };
        // Two orders at a time share what they load; the first of all has nothing behind it.
        let mut k = 0;
        while k < order {
            let mut sums = [[W::ZERO; 4]; 2];
            if k > 0 && W::VECTORS == 1 {
                // Eight sums keep the multipliers busy.
                sums = older!(&self.powers, k, c, s, x, y);
            } else if k > 0 {
                let ([e, next_e], [u, next_u]) =
                    (older!(&self.powers, k, c, s), older!(&self.powers, k, x, y));
                sums = [[e[0], e[1], u[0], u[1]], [next_e[0], next_e[1], next_u[0], next_u[1]]];
            }
            self.raise(k, sums[0]);
            if k + 1 < order {
                self.raise(k + 1, sums[1]);
            }
            k += 2;
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
            let power = &self.powers[order - back];
            let most = load::<W>(&power.c).larger(load::<W>(&power.s).larger(W::ZERO));
            let most = load::<W>(&power.x).larger(load::<W>(&power.y).larger(most));
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
        // Even and odd powers apart: Re e, Im e, Re u, Im u, rate; and the means of rate and Im u.
        let (mut c, mut s, mut x, mut y) = ([zero; 2], [zero; 2], [zero; 2], [zero; 2]);
        let (mut rate, mut angle, mut swept) = ([zero; 2], [zero; 2], [zero; 2]);
        macro_rules! add {
            ($parity:literal, $k:expr) => {
                let power = &self.powers[$k];
                let (y_here, v) = (load::<W>(&power.y), load::<W>(&power.v));
                c[$parity] = c[$parity].mul_add(square, load(&power.c));
                s[$parity] = s[$parity].mul_add(square, load(&power.s));
                x[$parity] = x[$parity].mul_add(square, load(&power.x));
                y[$parity] = y[$parity].mul_add(square, y_here);
                rate[$parity] = rate[$parity].mul_add(square, v);
                angle[$parity] = angle[$parity].mul_add(square, over(v, $k + 1));
                swept[$parity] = swept[$parity].mul_add(square, over(y_here, $k + 1));
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
        let (c_moved, s_moved, x_moved, y_moved) = (moved(c, h), moved(s, h), moved(x, h), moved(y, h));
        let (rate, angle, swept) = (moved(rate, h), moved(angle, h), moved(swept, h));
        let start = &self.powers[0];
        let (c, s, x, y) =
            (load::<W>(&start.c), load::<W>(&start.s), load::<W>(&start.x), load::<W>(&start.y));
        let (w, v) = (load::<W>(&self.laws.rate), load::<W>(&start.v));
        let (angle, swept) = (h.mul(v.add(angle)), h.mul(y.add(swept)));
        // What the driven body has turned: e_1 = e conj(u).
        let (c_new, s_new) = (c.add(c_moved), s.add(s_moved));
        let turned = [
            c_moved.mul_add(x, s_moved.mul(y)).add(c_new.mul_add(x_moved, s_new.mul(y_moved))),
            c_moved.neg_mul_add(y, s_moved.mul(x)).add(c_new.neg_mul_add(y_moved, s_new.mul(x_moved))),
        ];
        let pull = x_moved.mul(w.add(v).add(rate)).add(x.mul(rate)).sub(w.mul(w.mul(swept)));
        let weights = turned[0].mul(load(&self.weight[0])).add(turned[1].mul(load(&self.weight[1])));
        let work = w.mul(load::<W>(&self.coupling).mul(pull)).sub(weights);
        self.swept = store(w.mul(h));
        let drifted = load::<W>(&self.low[1]).mul(h);
        (self.high[0], self.low[0]) = added([&self.high[0], &self.low[0]], angle, drifted);
        (self.high[1], self.low[1]) = added([&self.high[1], &self.low[1]], rate, zero);
        (self.high[2], self.low[2]) = added([&self.high[2], &self.low[2]], work, zero);
    }

    #[inline]
    fn ends(&self, lane: usize, body: usize) -> [[f64; 2]; 2] {
        if body == self.driven[lane] {
            let (start, rate) = (self.before[1].0[lane], self.laws.rate.0[lane]);
            return [[start, rate], [start + self.swept.0[lane], rate]];
        }
        let start = [self.before[0].0[lane], self.powers[0].v.0[lane]];
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
        if body == self.driven[lane] {
            let rate = self.laws.rate.0[lane];
            return (self.before[1].0[lane] + rate * after, rate);
        }
        let (mut angle, mut rate) = (0.0, 0.0);
        for k in (0..=order).rev() {
            let v = self.powers[k].v.0[lane];
            rate = rate * after + v;
            angle = angle * after + v / (k + 1) as f64;
        }
        (self.before[0].0[lane] + angle * after, rate)
    }

    fn start_of(&self, lane: usize, _: usize) -> Option<f64> {
        Some(self.before[0].0[lane])
    }

    fn power_of(&self, lane: usize, _: usize, k: usize) -> f64 {
        self.powers[k].v.0[lane]
    }
}
