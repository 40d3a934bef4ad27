//! A spring without a damper in every lane: the recurrence of [`looped`](super::super::super::looped)'s own.
//!
//! ```text
//! q = |D|²,  s = q^(-1/2):  m q_0 s_m = Σ_{j=1..m} (j/2 - m) q_j s_{m-j},  F_m = k (L0 Σ s_j D_{m-j} - D_m)
//! ```

use super::{HIGHEST_ORDER, PAIR, Pair, ROOM, ZERO, put};
use crate::arithmetic::eight::Octet;
use crate::arithmetic::lanes::wide::EightLanes;
use crate::dynamics::force;
use crate::stepping::taylor::batch::{load, store};

/// A spring and its series: D, q with its powers' numbers, s.
#[derive(Clone, Debug)]
pub(super) struct LaneSpringSeries {
    root: Pair,
    terms: Vec<(usize, Pair)>,
    stiffness: Octet,
    free_length: Octet,
    has_free_length: bool,
    x: Vec<Octet>,
    y: Vec<Octet>,
    square: Vec<Octet>,
    weighted: Vec<Octet>,
    inverse: Vec<Octet>,
}

impl LaneSpringSeries {
    /// Room for a spring like this one.
    pub(super) fn new(spring: &force::CompiledSpring) -> Self {
        let room = || vec![ZERO; HIGHEST_ORDER + 1];
        Self {
            root: PAIR,
            terms: spring.span.terms.iter().map(|&(k, _)| (k, PAIR)).collect(),
            stiffness: ZERO,
            free_length: ZERO,
            has_free_length: spring.free_length != 0.0,
            x: room(),
            y: room(),
            square: room(),
            weighted: room(),
            inverse: room(),
        }
    }

    /// Puts the constants of a spring into a lane.
    pub(super) fn take_in(&mut self, lane: usize, spring: &force::CompiledSpring) {
        put(&mut self.root, lane, spring.span.root);
        let own = spring.span.terms.iter().map(|&(_, gamma)| gamma);
        self.terms.iter_mut().zip(own).for_each(|((_, gamma), own)| put(gamma, lane, own));
        (self.stiffness.0[lane], self.free_length.0[lane]) = (spring.stiffness, spring.free_length);
    }

    /// Adds power m of its force to f, x and then y.
    #[inline(always)]
    pub(super) fn pull<W: EightLanes>(&mut self, m: usize, [zx, zy]: [&[Octet]; 2], f: &mut [Octet]) {
        let n = f.len() / 3;
        let (mut dx, mut dy) = (W::ZERO, W::ZERO);
        if m == 0 {
            (dx, dy) = (load(&self.root[0]), load(&self.root[1]));
        }
        for (k, [re, im]) in &self.terms {
            let (re, im) = (load::<W>(re), load::<W>(im));
            let (x, y) = (load::<W>(&zx[k * ROOM + m]), load::<W>(&zy[k * ROOM + m]));
            dx = y.neg_mul_add(im, x.mul_add(re, dx));
            dy = x.mul_add(im, y.mul_add(re, dy));
        }
        let (mut px, mut py) = (W::ZERO, W::ZERO);
        if self.has_free_length {
            [px, py] = self.stretched::<W>(m, dx, dy);
        }
        let stiffness = load::<W>(&self.stiffness);
        let (px, py) = (px.sub(dx).mul(stiffness), py.sub(dy).mul(stiffness));
        for (k, [re, im]) in &self.terms {
            let (k, re, im) = (*k, load::<W>(re), load::<W>(im));
            let (fx, fy) = (load::<W>(&f[k]), load::<W>(&f[n + k]));
            let fx = py.mul_add(im, px.mul_add(re, fx));
            let fy = px.neg_mul_add(im, py.mul_add(re, fy));
            (f[k], f[n + k]) = (store(fx), store(fy));
        }
    }

    /// Power m of D at its free length.
    #[inline(always)]
    fn stretched<W: EightLanes>(&mut self, m: usize, dx: W, dy: W) -> [W; 2] {
        (self.x[m], self.y[m]) = (store(dx), store(dy));
        let square = product::<W>(&self.x, &self.x, 0, m).add(product::<W>(&self.y, &self.y, 0, m));
        self.square[m] = store(square);
        self.weighted[m] = store(square.mul(W::splat(m as f64)));
        let inverse = if m == 0 {
            W::ONE.div(square.sqrt())
        } else {
            let plain = product::<W>(&self.square, &self.inverse, 1, m);
            let weighted = product::<W>(&self.weighted, &self.inverse, 1, m);
            let sum = plain.neg_mul_add(W::splat(m as f64), weighted.mul(W::splat(0.5)));
            sum.div(load::<W>(&self.square[0]).mul(W::splat(m as f64)))
        };
        self.inverse[m] = store(inverse);
        let length = load::<W>(&self.free_length);
        [
            product::<W>(&self.x, &self.inverse, 0, m).mul(length),
            product::<W>(&self.y, &self.inverse, 0, m).mul(length),
        ]
    }
}

/// Σ_{j=first..m} a_j b_{m-j}, in two chains.
#[inline(always)]
fn product<W: EightLanes>(a: &[Octet], b: &[Octet], first: usize, m: usize) -> W {
    let (a, b) = (&a[..=m], &b[..=m]);
    let (mut even, mut odd) = (W::ZERO, W::ZERO);
    let mut j = first;
    while j < m {
        even = load::<W>(&a[j]).mul_add(load(&b[m - j]), even);
        odd = load::<W>(&a[j + 1]).mul_add(load(&b[m - j - 1]), odd);
        j += 2;
    }
    if j == m {
        even = load::<W>(&a[j]).mul_add(load(&b[m - j]), even);
    }
    even.add(odd)
}
