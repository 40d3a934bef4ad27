//! Springs and dampers between the bodies in the lanes: the recurrences of
//! [`springs`](super::super::springs) with the lanes over trajectories.

use super::super::terms::over;
use super::super::wide::Wide;
use super::free::FreePower;
use super::{HIGHEST_ORDER, added, load, moved, pair, store};
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::wide::EightLanes;
use crate::arithmetic::sincos;
use crate::dynamics::{Mechanism, State};

const ZERO: Octet = Octet([0.0; LANES]);

/// The springs of all lanes, as many in each, and the work of their dampers.
#[derive(Clone, Debug)]
pub(super) struct LaneSprings<const N: usize> {
    all: Vec<LaneSpring<N>>,
    /// True where any of them has been damped.
    is_damped: bool,
    /// Cosine and sine of the bodies' angles, and what these leave out.
    units: [[Octet; 4]; N],
    /// The dampers' power \[W/s^m\], and their work \[J\] in two terms.
    power: [Octet; HIGHEST_ORDER + 1],
    work: [Octet; 2],
    /// The energy scale times the unit of time \[J s\].
    energy: Octet,
}

/// One spring of each lane.
#[derive(Clone, Debug)]
struct LaneSpring<const N: usize> {
    root: [Octet; 2],
    /// gamma over the bodies \[m\].
    gamma: [[Octet; 2]; N],
    stiffness: Octet,
    free_length: Octet,
    damping: Octet,
    /// One where the length matters, zero elsewhere.
    measured: Octet,
    /// 1/q_0.
    inverse: Octet,
    powers: [SpringPower; HIGHEST_ORDER + 1],
}

/// One power of D, q, h, a, s and κ.
#[derive(Clone, Copy, Debug)]
struct SpringPower {
    x: Octet,
    y: Octet,
    square: Octet,
    half: Octet,
    strain: Octet,
    reciprocal: Octet,
    factor: Octet,
}

/// Σ a_j b_{total-j} and Σ a_j c_{total-j} over j from `first` to before `end`, in two chains each.
macro_rules! products {
    ($powers:expr, $first:expr, $end:expr, $total:expr, $a:ident, $b:ident, $c:ident) => {{
        let (powers, end, total) = (&$powers, $end, $total);
        let (mut b, mut c, mut other_b, mut other_c) = (W::ZERO, W::ZERO, W::ZERO, W::ZERO);
        let mut j = $first;
        while j + 1 < end {
            let (a, late) = (load::<W>(&powers[j].$a), &powers[total - j]);
            (b, c) = (a.mul_add(load(&late.$b), b), a.mul_add(load(&late.$c), c));
            let (a, late) = (load::<W>(&powers[j + 1].$a), &powers[total - j - 1]);
            (other_b, other_c) = (a.mul_add(load(&late.$b), other_b), a.mul_add(load(&late.$c), other_c));
            j += 2;
        }
        if j < end {
            let (a, late) = (load::<W>(&powers[j].$a), &powers[total - j]);
            (b, c) = (a.mul_add(load(&late.$b), b), a.mul_add(load(&late.$c), c));
        }
        (b.add(other_b), c.add(other_c))
    }};
}

impl<const N: usize> LaneSprings<N> {
    /// Room for so many springs in each lane.
    pub fn new(count: usize) -> Self {
        let power = SpringPower {
            x: ZERO,
            y: ZERO,
            square: ZERO,
            half: ZERO,
            strain: ZERO,
            reciprocal: ZERO,
            factor: ZERO,
        };
        let spring = LaneSpring {
            root: [ZERO; 2],
            gamma: [[ZERO; 2]; N],
            stiffness: ZERO,
            free_length: ZERO,
            damping: ZERO,
            measured: ZERO,
            inverse: ZERO,
            powers: [power; HIGHEST_ORDER + 1],
        };
        Self {
            all: vec![spring; count],
            is_damped: false,
            units: [[ZERO; 4]; N],
            power: [ZERO; HIGHEST_ORDER + 1],
            work: [ZERO; 2],
            energy: Octet([1.0; LANES]),
        }
    }

    /// The springs of a lane.
    pub fn take_in(&mut self, lane: usize, mechanism: &Mechanism, state: &State) {
        self.energy.0[lane] = mechanism.energy_scale * mechanism.units.time;
        if let (Some(work), Some(low)) = (state.y.get(2 * N), state.low.get(2 * N)) {
            (self.work[0].0[lane], self.work[1].0[lane]) = (*work, *low);
        }
        for (own, spring) in self.all.iter_mut().zip(&mechanism.springs) {
            (own.root[0].0[lane], own.root[1].0[lane]) = (spring.span.root.re, spring.span.root.im);
            for (body, own) in own.gamma.iter_mut().enumerate() {
                let gamma = spring.span.gamma(body);
                (own[0].0[lane], own[1].0[lane]) = (gamma.re, gamma.im);
            }
            (own.stiffness.0[lane], own.free_length.0[lane]) = (spring.stiffness, spring.free_length);
            own.damping.0[lane] = spring.damping;
            own.measured.0[lane] = f64::from(u8::from(spring.needs_length()));
            self.is_damped |= spring.damping != 0.0;
        }
    }

    /// Writes the work of a lane into a state that has it.
    pub fn write_state(&self, lane: usize, state: &mut State) {
        if let (Some(work), Some(low)) = (state.y.get_mut(2 * N), state.low.get_mut(2 * N)) {
            (*work, *low) = (self.work[0].0[lane], self.work[1].0[lane]);
        }
    }

    /// No springs in a lane.
    pub fn set_idle(&mut self, lane: usize) {
        for spring in &mut self.all {
            for number in [&mut spring.stiffness, &mut spring.damping, &mut spring.measured] {
                number.0[lane] = 0.0;
            }
        }
    }

    /// Power zero, and the unit vectors of the bodies.
    #[inline(always)]
    pub fn begin<W: EightLanes>(&mut self, [high, low]: [&[Octet; N]; 2], motion: &mut FreePower<N>) {
        for i in 0..N {
            let angle = [load::<W>(&high[i]), load::<W>(&low[i])];
            let ([sin, sin_low], [cos, cos_low]) = sincos::sin_cos_pair(angle);
            self.units[i] = [store(cos), store(sin), store(cos_low), store(sin_low)];
            (motion.c[i], motion.s[i]) = (self.units[i][0], self.units[i][1]);
        }
        for spring in &mut self.all {
            let mut x = Wide::of(load::<W>(&spring.root[0]));
            let mut y = Wide::of(load::<W>(&spring.root[1]));
            for i in 0..N {
                let unit = &self.units[i];
                let (c, s) = (pair::<W>([&unit[0], &unit[2]]), pair([&unit[1], &unit[3]]));
                let (re, im) = (load::<W>(&spring.gamma[i][0]), load::<W>(&spring.gamma[i][1]));
                x = x.add(c.scale(re)).add(s.scale(im).minus());
                y = y.add(s.scale(re)).add(c.scale(im));
            }
            let free = load::<W>(&spring.free_length);
            let (stiffness, measured) = (load::<W>(&spring.stiffness), load::<W>(&spring.measured));
            let rest = W::ONE.sub(measured);
            let square = x.mul(x).add(y.mul(y));
            // The stretch is the difference of two lengths: it is taken before anything is rounded.
            let surplus = square.add(Wide::of(free).mul(Wide::of(free)).minus()).hi;
            let size = square.hi.mul_add(measured, rest);
            let length = size.sqrt();
            let relative = surplus.div(length.add(free).mul(length));
            let power = &mut spring.powers[0];
            (power.x, power.y, power.square) = (store(x.hi), store(y.hi), store(size));
            spring.inverse = store(W::ONE.div(size));
            power.reciprocal = store(W::ONE.div(length));
            power.factor = store(W::ZERO.sub(stiffness).mul(relative.mul_add(measured, rest)));
        }
    }

    /// What the forces of power m add to power m+1 of P, from that power of the bodies' unit vectors.
    #[inline(always)]
    pub fn pull<W: EightLanes>(&mut self, m: usize, motion: &FreePower<N>) -> [[W; N]; 2] {
        let (mut px, mut py) = ([W::ZERO; N], [W::ZERO; N]);
        let mut power = W::ZERO;
        for spring in &mut self.all {
            spring.raise::<W>(m + 1, motion, self.is_damped);
            let powers = &spring.powers;
            let (newest, start) = (load::<W>(&powers[m].factor), load::<W>(&powers[0].factor));
            let (fx, fy) = products!(spring.powers, 1, m, m, factor, x, y);
            let (mut fx, mut fy) =
                (start.mul_add(load(&powers[m].x), fx), start.mul_add(load(&powers[m].y), fy));
            if m > 0 {
                (fx, fy) = (newest.mul_add(load(&powers[0].x), fx), newest.mul_add(load(&powers[0].y), fy));
            }
            for i in 0..N {
                let (re, im) = (load::<W>(&spring.gamma[i][0]), load::<W>(&spring.gamma[i][1]));
                px[i] = re.neg_mul_add(fy, im.mul_add(fx, px[i]));
                py[i] = re.mul_add(fx, im.mul_add(fy, py[i]));
            }
            if self.is_damped {
                let (lost, _) = products!(spring.powers, 0, m + 1, m + 1, strain, half, half);
                power = load::<W>(&spring.damping).neg_mul_add(lost, power);
            }
        }
        self.power[m] = store(power);
        [px, py]
    }

    /// Power k of the dampers' work over the energy scale, which counts as the rates do.
    #[inline(always)]
    pub fn judged<W: EightLanes>(&self, k: usize) -> W {
        load::<W>(&self.power[k - 1]).div(W::splat(k as f64).mul(load(&self.energy)))
    }

    /// Adds the dampers' work in the step.
    #[inline(always)]
    pub fn finish<W: EightLanes>(&mut self, order: usize, h: W) {
        if !self.is_damped {
            return;
        }
        let (square, mut sums) = (h.mul(h), [W::ZERO; 2]);
        let mut k = order;
        while k > 0 {
            let power = over(load::<W>(&self.power[k - 1]), k);
            if k.is_multiple_of(2) {
                sums[0] = sums[0].mul_add(square, power);
            } else {
                sums[1] = sums[1].mul_add(square, power);
            }
            k -= 1;
        }
        let [high, low] = &self.work;
        (self.work[0], self.work[1]) = added([high, low], moved(sums, h), W::ZERO);
    }
}

impl<const N: usize> LaneSpring<N> {
    /// Power m >= 1 of the span, q and s, and power m-1 of a, from that power of the bodies' unit vectors.
    #[inline(always)]
    fn raise<W: EightLanes>(&mut self, m: usize, motion: &FreePower<N>, is_damped: bool) {
        let (mut x, mut y) = (W::ZERO, W::ZERO);
        for i in 0..N {
            let (c, s) = (load::<W>(&motion.c[i]), load::<W>(&motion.s[i]));
            let (re, im) = (load::<W>(&self.gamma[i][0]), load::<W>(&self.gamma[i][1]));
            x = s.neg_mul_add(im, c.mul_add(re, x));
            y = c.mul_add(im, s.mul_add(re, y));
        }
        // Half of the products of what is older.
        let (mut along, mut across) = (W::ZERO, W::ZERO);
        let mut j = 1;
        while 2 * j < m {
            let (early, late) = (&self.powers[j], &self.powers[m - j]);
            along = load::<W>(&early.x).mul_add(load(&late.x), along);
            across = load::<W>(&early.y).mul_add(load(&late.y), across);
            j += 1;
        }
        if 2 * j == m {
            let (x, y, half) = (load::<W>(&self.powers[j].x), load::<W>(&self.powers[j].y), W::splat(0.5));
            (along, across) = (x.mul(half).mul_add(x, along), y.mul(half).mul_add(y, across));
        }
        let (without, falling) = products!(self.powers, 0, m - 1, m - 1, strain, square, reciprocal);
        let start = self.powers[0];
        let half_sum = load::<W>(&start.x).mul_add(x, along).add(load::<W>(&start.y).mul_add(y, across));
        let half_sum = half_sum.mul(load(&self.measured));
        let half = half_sum.mul(W::splat(m as f64));
        let strain = half.sub(without).mul(load(&self.inverse));
        let fall = strain.mul_add(load(&start.reciprocal), falling);
        let reciprocal = over(W::ZERO.sub(fall), m);
        // One factor after the other: their product would be a constant rounded once.
        let factor = load::<W>(&self.stiffness).mul(load::<W>(&self.free_length).mul(reciprocal));
        let newest = &mut self.powers[m];
        (newest.x, newest.y, newest.square) = (store(x), store(y), store(half_sum.add(half_sum)));
        (newest.half, newest.reciprocal) = (store(half), store(reciprocal));
        newest.factor = store(factor);
        let before = &mut self.powers[m - 1];
        before.strain = store(strain);
        if is_damped {
            before.factor = store(strain.neg_mul_add(load(&self.damping), load(&before.factor)));
        }
    }
}
