//! Two bodies, one of them driven from the ground at a constant rate, in four lanes: one unknown angle and one Cauchy product.
//!
//! Body 1 turns at w.  With e and v the unit vector and rate of body 2, W its weight, A = A12, and u = exp(i (phi_2 - phi_1)), which is e as body 1 sees
//! it, f_1'·e is w² Im u, and the rates need no product at all:
//!
//! ```text
//! d v' = e × W - A w² Im u,    e' = left(v e),    u' = left((v - w) u)
//! d (k+1) v_{k+1} = e_k × W - A w² Im u_k,    (k+1) E_{k+1} = left(Σ_j m_j E_{k-j})
//! ```
//!
//! with lanes E = `[e, u]` and m = `[v, v, v-w, v-w]`, where w counts for j = 0 only.  The motor's torque is what changes the angular momentum beside gravity,
//! so that its work over a step needs no product of series either, only the integral of Im u:
//!
//! ```text
//! work = w A (Δ(Re u (w + v)) - w² ∫ Im u dt) - Δe_1·W_1,    e_1 = e conj(u)
//! ```
//!
//! Scene constants enter in two terms, as in [`pair`](super::pair).

use super::direction;
use super::pace::{self, Pace, RECIPROCAL_REST};
use super::terms::left_over;
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
    /// A \[kg·m²\].
    coupling: f64,
    /// W of the driven body \[N·m\].
    weight: Complex<f64>,
    /// e × W - A w² Im u over d k as a product with E, in two terms.
    load: [[[f64; 4]; 2]; MOST + 1],
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
    /// E.
    e: [[f64; 4]; MOST + 1],
    /// v in every lane.
    v: [[f64; 4]; MOST + 1],
}

impl Default for Scratch {
    fn default() -> Self {
        Self { e: [[0.0; 4]; MOST + 1], v: [[0.0; 4]; MOST + 1] }
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
        let pull = tree.weight[free];
        let lanes = [DoubleDouble::of(pull.im), DoubleDouble::of(-pull.re), DoubleDouble::ZERO, DoubleDouble::product(w, w).scale(-a)];
        let mut load = [[[0.0; 4]; 2]; MOST + 1];
        for (k, load) in load.iter_mut().enumerate().skip(1) {
            let lanes = lanes.map(|lane| lane / DoubleDouble::product(d, k as f64));
            *load = [lanes.map(|lane| lane.hi), lanes.map(|lane| lane.lo)];
        }
        let stiffness = pull.norm_squared().sqrt() + a.abs() * w * w;
        let rate = (stiffness / d).sqrt().max(w.abs());
        Some(Self { law: row.law.clone(), coupling: a, weight: tree.weight[driven], load, rate })
    }

    /// The longest step in which the terms left out still fall \[s\].
    pub fn longest(&self, order: usize) -> f64 {
        order as f64 / 8.0 / self.rate
    }
}

/// What orders K and K+1 need of the coefficients up to E_K and v_K: both at once, so that each v is loaded for two products.
#[inline(always)]
fn older<L: Lanes, const K: usize>(scratch: &Scratch) -> [L; 2] {
    // From the middle outwards in two chains, the newest coefficients last.
    let mut sums = [[L::splat(0.0); 2]; 2];
    let middle = K / 2;
    for step in 0..=middle {
        for (chain, j) in [middle - step, middle + 1 + step].into_iter().enumerate() {
            for (ahead, sums) in sums.iter_mut().enumerate() {
                if j > 0 && j < K + ahead {
                    sums[chain] = L::of(scratch.v[j]).mul_add(L::of(scratch.e[K + ahead - j]), sums[chain]);
                }
            }
        }
    }
    sums.map(|[below, above]| below.add(above))
}

/// E_K, and v_K in every lane (m_0 where K = 0).
#[derive(Clone, Copy)]
struct Newest<L> {
    e: L,
    v: L,
}

/// Order K: from the newest coefficients to the next ones, which are also written.
#[inline(always)]
fn order<L: Lanes, const K: usize>(driven: &Driven, start: Newest<L>, scratch: &mut Scratch, older: L, newest: Newest<L>) -> Newest<L> {
    let [load, load_rest] = driven.load[K + 1];
    // Low parts join before the rounding; in high orders they are too small to matter.
    let loads = if K < 12 { newest.e.mul_add(L::of(load), newest.e.mul(L::of(load_rest))) } else { newest.e.mul(L::of(load)) };
    let pairs = loads.add(loads.swap_pairs());
    let v = pairs.add(pairs.swap_halves());
    let sum = start.v.mul_add(newest.e, older);
    let sum = if K > 0 { newest.v.mul_add(start.e, sum) } else { sum };
    let e = left_over(sum, K + 1);
    scratch.e[K + 1] = e.array();
    scratch.v[K + 1] = v.array();
    Newest { e, v }
}

/// Orders 0 to P-1 in pairs, for even P; all coefficients are in the scratch then.
macro_rules! orders {
    ($p:ident, $driven:expr, $start:expr, $scratch:expr; $($k:literal $next:literal),*) => {
        let newest = $start;
        $(let newest = if $k < $p {
            let [first, second] = older::<L, $k>($scratch);
            let newest = order::<L, $k>($driven, $start, $scratch, first, newest);
            order::<L, $next>($driven, $start, $scratch, second, newest)
        } else {
            newest
        };)*
        let _ = newest;
    };
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
    let [phi, v, _] = flow.high;
    let (psi, _) = (DoubleDouble::sum(phi, flow.low[0]) - DoubleDouble::of(driven.law.start) - t.scale(w)).reduced();
    let e = direction::unit(L::of([phi, phi, psi.hi, psi.hi]), L::of([flow.low[0], flow.low[0], psi.lo, psi.lo]));
    let start = Newest { e, v: L::of([v, v, v - w, v - w]) };
    scratch.e[0] = e.array();
    orders!(P, driven, start, scratch; 0 1, 2 3, 4 5, 6 7, 8 9, 10 11, 12 13, 14 15, 16 17, 18 19, 20 21, 22 23);
    if !scratch.v[P][0].is_finite() {
        return (f64::NAN, 0.0);
    }
    let mut largest = [0.0; super::JUDGES];
    for (i, largest) in largest.iter_mut().enumerate() {
        *largest = scratch.v[P - i][0].abs();
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
    let [c, s, x, y] = scratch.e[0];
    let ([c_moved, s_moved, x_moved, y_moved], [angle, rate, _, swept]) = increments::<L, P>(scratch, h);
    let (angle, swept) = (h * (v + angle), h * (y + swept));
    // What the driven body has turned: e_1 = e conj(u).
    let (c_new, s_new) = (c + c_moved, s + s_moved);
    let turned = [
        (c_moved * x + s_moved * y) + (c_new * x_moved + s_new * y_moved),
        (s_moved * x - c_moved * y) + (s_new * x_moved - c_new * y_moved),
    ];
    // Every factor here is exact or differs from step to step, so that no rounding acts for ever with one sign.
    let pull = x_moved * (w + v + rate) + x * rate - w * (w * swept);
    let work = w * (driven.coupling * pull) - (turned[0] * driven.weight.re + turned[1] * driven.weight.im);
    for (i, increment) in [angle + h * flow.low[1], rate, work].into_iter().enumerate() {
        let sum = DoubleDouble::sum(flow.high[i], flow.low[i]) + increment;
        (flow.high[i], flow.low[i]) = (sum.hi, sum.lo);
    }
}

/// Increments over `h` \[s\]: of E; and `[mean of v less v_0, increment of v, –, mean of E's last lane less its start]`.
#[inline(always)]
fn increments<L: Lanes, const P: usize>(scratch: &Scratch, h: f64) -> ([f64; 4], [f64; 4]) {
    let square = L::splat(h * h);
    let mut chains = [[L::splat(0.0); 2]; 2];
    let mut k = P;
    while k > 0 {
        let (e, v) = (L::of(scratch.e[k]), L::of(scratch.v[k]));
        let r = 1.0 / (k + 1) as f64;
        let mut second = e.mul(L::of([0.0, 0.0, 0.0, r]));
        if k + 1 < RECIPROCAL_REST.len() && RECIPROCAL_REST[k + 1] != 0.0 {
            second = v.mul_add(L::of([RECIPROCAL_REST[k + 1], 0.0, 0.0, 0.0]), second);
        }
        let second = v.mul_add(L::of([r, 1.0, 0.0, 0.0]), second);
        let chain = &mut chains[k % 2];
        *chain = [chain[0].mul_add(square, e), chain[1].mul_add(square, second)];
        k -= 1;
    }
    let h = L::splat(h);
    let [moved, second] = [0, 1].map(|i| chains[0][i].mul_add(h, chains[1][i]).mul(h));
    (moved.array(), second.array())
}
