//! Two bodies, one of them driven from the ground at a constant rate, in four lanes: one unknown angle and one Cauchy product.
//!
//! Body 1 turns at w, so that f_1' = w² left(e_1) is known, and with e, v, f = v e of body 2, weights W and A = A12,
//!
//! ```text
//! (k+1) e_{k+1} = left(f_k),    d_2 (k+1) v_{k+1} = Σ_j e_{k-j}·R_j,    f_k = Σ_j v_j e_{k-j}
//! R_j = -A w² w^j/j! i^j left(e_1) + [W_y, -W_x] (j = 0 only)
//! ```
//!
//! with lanes `[v, v, R_x, R_y]_j` times `[c, s, c, s]_{k-j}`.  The motor's torque is what changes the angular momentum p beside gravity, so that its work over
//! a step needs no product of series, only the integral of e:
//!
//! ```text
//! p = d_1 w + d_2 v + A e_1·e (w + v),    work = w Δp - Δe_1·W_1 - w (∫ e dt) × W_2
//! ```
//!
//! Scene constants enter in two terms, as in [`pair`](super::pair).

use super::direction;
use super::pace::{self, Pace, RECIPROCAL_REST};
use crate::arithmetic::lanes::Lanes;
use crate::arithmetic::{Complex, DoubleDouble, Scalar};
use crate::dynamics::row::Row;
use crate::dynamics::{Mechanism, Time};
use crate::scene::Law;

/// Largest order there is room for.
pub const MOST: usize = 24;

/// Constants of the mechanism.
#[derive(Clone, Debug)]
pub struct Driven {
    law: Law,
    /// A, and d of the free body \[kg·m²\].
    coupling: f64,
    diagonal: f64,
    /// W of the driven and of the free body \[N·m\].
    weight: [Complex<f64>; 2],
    /// -A w² w^j/j! in lanes 2 and 3, in two terms.
    drive: [[[f64; 4]; 2]; MOST + 1],
    /// 1/(d_2 k) in lanes 0 and 1, in two terms.
    inverse: [[[f64; 4]; 2]; MOST + 1],
    /// Fastest rate: small oscillations, and the motor \[rad/s\].
    rate: f64,
}

/// Angle and rate of the free body and the motor's work, and what their leading parts leave out.
#[derive(Clone, Copy, Debug)]
pub struct Flow {
    /// Leading parts.
    pub high: [f64; 3],
    /// What they leave out.
    pub low: [f64; 3],
}

/// Coefficients of one step.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct Scratch {
    /// `[c, s, c, s]`.
    e: [[f64; 4]; MOST + 2],
    /// `[v, v, R_x, R_y]`.
    m: [[f64; 4]; MOST + 1],
    /// e_1 at the step's start.
    given: [f64; 2],
}

impl Default for Scratch {
    fn default() -> Self {
        Self { e: [[0.0; 4]; MOST + 2], m: [[0.0; 4]; MOST + 1], given: [0.0; 2] }
    }
}

impl Driven {
    /// The constants, where this form fits: two bodies on their axes, one driven from the ground by a law without acceleration and sines, no springs.
    pub fn new(mechanism: &Mechanism) -> Option<Self> {
        let tree = &mechanism.tree;
        let [Row::Angle(row)] = &mechanism.rows[..] else { return None };
        let is_steady = row.law.acceleration == 0.0 && row.law.sines.is_empty();
        if tree.bodies != 2 || tree.off_axis || !mechanism.springs.is_empty() || row.base.is_some() || !is_steady {
            return None;
        }
        let (driven, free) = (row.body, 1 - row.body);
        let (a, d, w) = (tree.coupling[1].re, tree.diagonal[free], row.law.rate);
        let two = |value: DoubleDouble, lanes: [f64; 4]| [lanes.map(|lane| lane * value.hi), lanes.map(|lane| lane * value.lo)];
        let mut drive = [[[0.0; 4]; 2]; MOST + 1];
        let mut inverse = [[[0.0; 4]; 2]; MOST + 1];
        let mut factor = DoubleDouble::product(w, w).scale(-a);
        for j in 0..=MOST {
            drive[j] = two(factor, [0.0, 0.0, 1.0, 1.0]);
            factor = factor.scale(w) / DoubleDouble::of((j + 1) as f64);
            if j > 0 {
                inverse[j] = two(DoubleDouble::ONE / DoubleDouble::product(d, j as f64), [1.0, 1.0, 0.0, 0.0]);
            }
        }
        let weight = [tree.weight[driven], tree.weight[free]];
        let stiffness = weight[1].norm_squared().sqrt() + a.abs() * w * w;
        let rate = (stiffness / d).sqrt().max(w.abs());
        Some(Self { law: row.law.clone(), coupling: a, diagonal: d, weight, drive, inverse, rate })
    }

    /// The longest step in which the terms left out still fall, and the motor turns less than half a turn \[s\].
    pub fn longest(&self, order: usize) -> f64 {
        order as f64 / 8.0 / self.rate
    }
}

/// Orders 0 to P-1.
macro_rules! orders {
    ($p:ident, $driven:expr, $known:expr, $scratch:expr; $($k:literal)*) => {
        $(if $k < $p {
            order::<L, $k>($driven, $known, $scratch);
        })*
    };
}

/// Order K: e_{K+1} and v_{K+1}.
#[inline(always)]
fn order<L: Lanes, const K: usize>(driven: &Driven, directions: &[L; 4], scratch: &mut Scratch) {
    // From the middle outwards, the newest coefficients last.
    let mut sums = [L::splat(0.0); 2];
    let middle = K / 2;
    for step in 0..=middle {
        let j = middle - step;
        sums[0] = L::of(scratch.m[j]).mul_add(L::of(scratch.e[K - j]), sums[0]);
        let j = middle + 1 + step;
        if j <= K {
            sums[1] = L::of(scratch.m[j]).mul_add(L::of(scratch.e[K - j]), sums[1]);
        }
    }
    let sum = sums[0].add(sums[1]);
    let crossed = sum.first_half().swap_pairs();
    let r = 1.0 / (K + 1) as f64;
    let factor = L::of([-r, r, -r, r]);
    let e = if K + 1 < RECIPROCAL_REST.len() && RECIPROCAL_REST[K + 1] != 0.0 {
        let r = RECIPROCAL_REST[K + 1];
        crossed.mul_add(factor, crossed.mul(L::of([-r, r, -r, r])))
    } else {
        crossed.mul(factor)
    };
    scratch.e[K + 1] = e.array();
    let load = sum.add(sum.swap_pairs()).swap_halves();
    let [drive, drive_rest] = driven.drive[K + 1];
    let direction = directions[(K + 1) % 4];
    let [inverse, inverse_rest] = driven.inverse[K + 1];
    // The lanes of both are apart, so that each low part joins before its own rounding.
    let known = if K < 12 {
        let low = load.mul_add(L::of(inverse_rest), direction.mul(L::of(drive_rest)));
        direction.mul_add(L::of(drive), low)
    } else {
        direction.mul(L::of(drive))
    };
    scratch.m[K + 1] = load.mul_add(L::of(inverse), known).array();
}

/// Expands to order P and takes one step of at most `left` \[s\] from time `t`; returns the step wanted, and leaves `flow` alone where it is useless.
#[inline(always)]
pub fn step<L: Lanes, const P: usize>(
    driven: &Driven,
    pace: &Pace,
    scratch: &mut Scratch,
    flow: &mut Flow,
    t: Time,
    left: f64,
) -> (f64, f64) {
    let w = driven.law.rate;
    let (phase, _) = (DoubleDouble::of(driven.law.start) + t.scale(w)).reduced();
    let [phi, v, _] = flow.high;
    let both = direction::unit(L::of([phase.hi, phase.hi, phi, phi]), L::of([phase.lo, phase.lo, flow.low[0], flow.low[0]]));
    let halves = both.swap_halves();
    let [c1, s1, ..] = both.array();
    scratch.given = [c1, s1];
    // i^j left(e_1) in lanes 2 and 3.
    let directions = [[-s1, c1], [-c1, -s1], [s1, -c1], [c1, s1]].map(|[x, y]| L::of([0.0, 0.0, x, y]));
    let [drive, drive_rest] = driven.drive[0];
    let [_, free] = driven.weight;
    let first = L::of([v, v, free.im, -free.re]);
    let first = directions[0].mul_add(L::of(drive), directions[0].mul(L::of(drive_rest))).add(first);
    scratch.e[0] = halves.first_half().array();
    scratch.m[0] = first.array();
    orders!(P, driven, &directions, scratch; 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23);
    if !scratch.m[P][0].is_finite() {
        return (f64::NAN, 0.0);
    }
    let mut largest = [0.0; super::JUDGES];
    for (i, largest) in largest.iter_mut().enumerate() {
        *largest = scratch.m[P - i][0].abs();
    }
    let wanted = pace.step::<P>(&largest);
    let h = pace::taken(wanted, left);
    if h > 0.0 {
        go::<L, P>(driven, scratch, flow, h);
    }
    (wanted, h)
}

/// Takes `flow` from the step's start on by `h` \[s\].
#[inline(always)]
pub fn go<L: Lanes, const P: usize>(driven: &Driven, scratch: &Scratch, flow: &mut Flow, h: f64) {
    let (w, v) = (driven.law.rate, flow.high[1]);
    let ([c, s, ..], [c1, s1]) = (scratch.e[0], scratch.given);
    let [angle, rate] = rates::<P>(scratch, h);
    let (turned, swept) = directions_moved::<L, P>(scratch, h);
    // What the driven body has turned.
    let [c_turn, s_turn, ..] = direction::unit(L::splat(w * h), L::splat(w.mul_add(h, -(w * h)))).array();
    let moved = [c1 * (c_turn - 1.0) - s1 * s_turn, s1 * (c_turn - 1.0) + c1 * s_turn];
    let across = c1 * c + s1 * s;
    let change = (c1 * turned[0] + s1 * turned[1]) + (moved[0] * (c + turned[0]) + moved[1] * (s + turned[1]));
    let momentum = driven.diagonal * rate + driven.coupling * (change * (w + v + rate) + across * rate);
    let [own, free] = driven.weight;
    let gravity = moved[0] * own.re + moved[1] * own.im + w * (swept[0] * free.im - swept[1] * free.re);
    let increments = [angle + h * flow.low[1], rate, w * momentum - gravity];
    for (i, increment) in increments.into_iter().enumerate() {
        let sum = DoubleDouble::sum(flow.high[i], flow.low[i]) + increment;
        (flow.high[i], flow.low[i]) = (sum.hi, sum.lo);
    }
}

/// Increments of the angle and of the rate.
#[inline(always)]
fn rates<const P: usize>(scratch: &Scratch, h: f64) -> [f64; 2] {
    let square = h * h;
    let mut chains = [[0_f64; 2]; 2];
    let mut k = P;
    while k > 0 {
        let v = scratch.m[k][0];
        let r = 1.0 / (k + 1) as f64;
        let term = if k + 1 < RECIPROCAL_REST.len() { v.mul_add(r, v * RECIPROCAL_REST[k + 1]) } else { v * r };
        let chain = &mut chains[k % 2];
        *chain = [chain[0].mul_add(square, term), chain[1].mul_add(square, v)];
        k -= 1;
    }
    let sum = [0, 1].map(|i| chains[0][i].mul_add(h, chains[1][i]));
    [h * h.mul_add(sum[0], scratch.m[0][0]), h * sum[1]]
}

/// Increment of e, and its integral \[s\].
#[inline(always)]
fn directions_moved<L: Lanes, const P: usize>(scratch: &Scratch, h: f64) -> ([f64; 2], [f64; 2]) {
    let square = L::splat(h * h);
    let mut chains = [L::splat(0.0); 2];
    let mut k = P;
    while k > 0 {
        let r = 1.0 / (k + 1) as f64;
        chains[k % 2] = chains[k % 2].mul_add(square, L::of(scratch.e[k]).mul(L::of([1.0, 1.0, r, r])));
        k -= 1;
    }
    let sum = chains[0].mul_add(L::splat(h), chains[1]).mul(L::splat(h));
    let [x, y, x_mean, y_mean] = sum.array();
    let [c, s, ..] = scratch.e[0];
    ([x, y], [h * (c + x_mean), h * (s + y_mean)])
}
