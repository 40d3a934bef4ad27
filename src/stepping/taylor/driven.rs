//! Two bodies, one of them driven from the ground at a constant rate, in four lanes: one unknown angle and
//! one Cauchy product.
//!
//! Body 1 turns at w.  With e and v the unit vector and rate of body 2, W its weight, A = A12, and u = exp(i
//! (phi_2 - phi_1)), which is e as body 1 sees it, f_1'·e is w² Im u, and the rates need no product at all:
//!
//! ```text
//! d v' = e × W - A w² Im u,    e' = left(v e),    u' = left((v - w) u)
//! d (k+1) v_{k+1} = e_k × W - A w² Im u_k,    (k+1) E_{k+1} = left(Σ_j m_j E_{k-j})
//! ```
//!
//! with lanes E = `[e, u]` and m = `[v, v, v-w, v-w]`, where w counts for j = 0 only.  The motor's torque is
//! what changes the angular momentum beside gravity, so that its work over a step needs no product of series
//! either, only the integral of Im u:
//!
//! ```text
//! work = w A (Δ(Re u (w + v)) - w² ∫ Im u dt) - Δe_1·W_1,    e_1 = e conj(u)
//! ```
//!
//! Scene constants enter in two terms, as in [`pair`](super::pair).
//!
//! Wins over the series of any mechanism (whole runs by `taylor`): 3.1 times on `motor` at 1e-9, 3.9 at
//! 1e-14.

use super::HIGHEST_ORDER;
use super::direction;
use super::step_size::{self, StepSize};
use super::terms::{left_over, reciprocal};
use crate::arithmetic::lanes::Lanes;
use crate::arithmetic::{Complex, DoubleDouble, Scalar};
use crate::dynamics::constraint::{ConstraintEquation, RowMeasure};
use crate::dynamics::{Mechanism, State, Time};
use crate::scene::Law;

/// Constants of the mechanism.
#[derive(Clone, Debug)]
pub struct DrivenKernel {
    /// The body that is driven, and its law.
    pub(super) body: usize,
    pub(super) law: Law,
    /// A \[kg·m²\].
    pub(super) coupling: f64,
    /// W of the driven body \[N·m\].
    pub(super) weight: Complex<f64>,
    /// e × W - A w² Im u over d k as a product with E, in two terms.
    load: [[[f64; 4]; 2]; HIGHEST_ORDER + 1],
    /// Fastest rate: small oscillations, and the motor \[rad/s\].
    rate: f64,
    /// What an error of the unit vectors comes to in the work, over the energy scale and the unit of time: a
    /// part \[1/s\], and a part times the free body's rate.
    pub(super) share: [f64; 2],
}

/// Angle and rate of the free body and the motor's work, and what their leading parts leave out.
#[derive(Clone, Copy, Debug)]
pub struct DrivenFlow {
    /// Leading parts.
    pub high: [f64; 3],
    /// What they leave out.
    pub low: [f64; 3],
}

impl DrivenFlow {
    /// From the unknowns `[phi, v, work]`.
    #[inline(always)]
    pub fn of(state: &State) -> Self {
        let read = |unknowns: &[f64]| match *unknowns {
            [phi, v, work, ..] => [phi, v, work],
            _ => [f64::NAN; 3],
        };
        Self { high: read(&state.y), low: read(&state.low) }
    }

    /// Back into the state.
    #[inline(always)]
    pub fn write(&self, state: &mut State) {
        state.y[..3].copy_from_slice(&self.high);
        state.low[..3].copy_from_slice(&self.low);
    }
}

/// Coefficients of one step.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct DrivenScratch {
    /// E.
    e: [[f64; 4]; HIGHEST_ORDER + 1],
    /// v in every lane.
    v: [[f64; 4]; HIGHEST_ORDER + 1],
}

impl Default for DrivenScratch {
    fn default() -> Self {
        Self { e: [[0.0; 4]; HIGHEST_ORDER + 1], v: [[0.0; 4]; HIGHEST_ORDER + 1] }
    }
}

impl DrivenKernel {
    /// The driven body and its law, of two bodies on their axes, one driven from the ground, no springs.
    pub(super) fn pattern(mechanism: &Mechanism) -> Option<(usize, &Law)> {
        let tree = &mechanism.tree;
        let [ConstraintEquation { measure: RowMeasure::Angle { body, base: None }, law: Some(law), .. }] =
            &mechanism.constraints[..]
        else {
            return None;
        };
        let fits = tree.coordinates == 2 && !tree.off_axis && mechanism.is_plain();
        fits.then_some((*body, law))
    }

    /// The same where the law has neither acceleration nor sines: this form fits.
    pub(super) fn of(mechanism: &Mechanism) -> Option<(usize, &Law)> {
        Self::pattern(mechanism).filter(|(_, law)| law.is_steady())
    }

    /// The constants, where this form fits.
    pub fn new(mechanism: &Mechanism) -> Option<Self> {
        let (tree, (driven, law)) = (&mechanism.tree, Self::of(mechanism)?);
        let free = 1 - driven;
        let (a, d, w) = (tree.coupling[1].re, tree.diagonal[free], law.rate);
        let pull = tree.weight[free];
        let lanes = [
            DoubleDouble::of(pull.im),
            DoubleDouble::of(-pull.re),
            DoubleDouble::ZERO,
            DoubleDouble::product(w, w).scale(-a),
        ];
        let mut load = [[[0.0; 4]; 2]; HIGHEST_ORDER + 1];
        for (k, load) in load.iter_mut().enumerate().skip(1) {
            let lanes = lanes.map(|lane| lane / DoubleDouble::product(d, k as f64));
            *load = [lanes.map(|lane| lane.hi), lanes.map(|lane| lane.lo)];
        }
        let stiffness = pull.norm_squared().sqrt() + a.abs() * w * w;
        let rate = (stiffness / d).sqrt().max(w.abs());
        let (swing, weight) = ((w * a).abs() / mechanism.energy_scale, tree.weight[driven]);
        let share = [swing * w.abs() + weight.norm_squared().sqrt() / mechanism.energy_scale, swing]
            .map(|share| share / mechanism.units.time);
        Some(Self { body: driven, law: law.clone(), coupling: a, weight, load, rate, share })
    }

    /// What cos e, sin e and Im u are multiplied with for the acceleration \[1/s²\], in two terms.
    pub(super) fn loads(&self) -> [[f64; 3]; 2] {
        self.load[1].map(|[sine, cosine, _, pull]| [sine, cosine, pull])
    }

    /// The longest step in which the terms left out still fall \[s\].
    pub fn longest(&self, order: usize) -> f64 {
        order as f64 / 8.0 / self.rate
    }
}

/// What orders k and k+1 need of the coefficients up to E_k and v_k: both at once, so that each v is loaded
/// for two products.
#[inline(always)]
fn older<L: Lanes>(scratch: &DrivenScratch, k: usize) -> [L; 2] {
    // From the middle outwards in two chains, the newest coefficients last.
    let mut sums = [[L::splat(0.0); 2]; 2];
    let middle = k / 2;
    for step in 0..=middle {
        for (chain, j) in [middle - step, middle + 1 + step].into_iter().enumerate() {
            for (ahead, sums) in sums.iter_mut().enumerate() {
                if j > 0 && j < k + ahead {
                    sums[chain] = L::of(scratch.v[j]).mul_add(L::of(scratch.e[k + ahead - j]), sums[chain]);
                }
            }
        }
    }
    [sums[0][0].add(sums[0][1]), sums[1][0].add(sums[1][1])]
}

/// E_k, and v_k in every lane (m_0 where k = 0).
#[derive(Clone, Copy)]
struct DrivenNewest<L> {
    e: L,
    v: L,
}

/// Order k: from the newest coefficients to the next ones, which are also written.
#[inline(always)]
fn order<L: Lanes>(
    driven: &DrivenKernel,
    start: DrivenNewest<L>,
    scratch: &mut DrivenScratch,
    older: L,
    newest: DrivenNewest<L>,
    k: usize,
) -> DrivenNewest<L> {
    let [load, load_rest] = driven.load[k + 1];
    // Low parts join before the rounding; in high orders they are too small to matter.
    let loads = if k < 12 {
        newest.e.mul_add(L::of(load), newest.e.mul(L::of(load_rest)))
    } else {
        newest.e.mul(L::of(load))
    };
    let pairs = loads.add(loads.swap_pairs());
    let v = pairs.add(pairs.swap_halves());
    let sum = start.v.mul_add(newest.e, older);
    let sum = if k > 0 { newest.v.mul_add(start.e, sum) } else { sum };
    let e = left_over(sum, k + 1);
    scratch.e[k + 1] = e.array();
    scratch.v[k + 1] = v.array();
    DrivenNewest { e, v }
}

/// Two orders, the first of them even.
#[inline(always)]
fn two_orders<L: Lanes>(
    driven: &DrivenKernel,
    start: DrivenNewest<L>,
    scratch: &mut DrivenScratch,
    newest: DrivenNewest<L>,
    k: usize,
) -> DrivenNewest<L> {
    let [first, second] = older(scratch, k);
    let newest = order(driven, start, scratch, first, newest, k);
    order(driven, start, scratch, second, newest, k + 1)
}

/// Orders 0 to P-1, for even P; all coefficients are in the scratch then.
#[inline(always)]
fn expand<L: Lanes, const P: usize>(
    driven: &DrivenKernel,
    start: DrivenNewest<L>,
    scratch: &mut DrivenScratch,
) {
    let mut newest = start;
    if !L::UNROLLED {
        for k in (0..P).step_by(2) {
            newest = two_orders(driven, start, scratch, newest, k);
        }
        return;
    }
    macro_rules! unrolled {
        ($($k:literal),*) => {
            $(if $k < P {
                newest = two_orders(driven, start, scratch, newest, $k);
            })*
        };
    }
    unrolled!(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22);
    let _ = newest;
}

/// Expands to order P and takes one step of at most `left` \[s\] from time `t`; returns the step wanted, and
/// leaves `flow` alone where it is useless.
#[inline(always)]
pub fn step<L: Lanes, const P: usize>(
    driven: &DrivenKernel,
    step_size: &StepSize,
    scratch: &mut DrivenScratch,
    flow: &mut DrivenFlow,
    t: Time,
    left: f64,
) -> (f64, f64) {
    let w = driven.law.rate;
    let [phi, v, _] = flow.high;
    let (psi, _) =
        (DoubleDouble::sum(phi, flow.low[0]) - DoubleDouble::of(driven.law.start) - t.scale(w)).reduced();
    let e =
        direction::unit(L::of([phi, phi, psi.hi, psi.hi]), L::of([flow.low[0], flow.low[0], psi.lo, psi.lo]));
    let start = DrivenNewest { e, v: L::of([v, v, v - w, v - w]) };
    scratch.e[0] = e.array();
    expand::<L, P>(driven, start, scratch);
    if !scratch.v[P][0].is_finite() {
        return (f64::NAN, 0.0);
    }
    let mut largest = [0.0; super::JUDGES];
    // The work is made of the unit vectors, whose powers may fall more slowly than those of the rate.
    let share = L::splat(driven.share[0] + driven.share[1] * v.abs());
    for (i, largest) in largest.iter_mut().enumerate() {
        let vectors = L::of(scratch.e[P - i]).abs().mul(share);
        let both = vectors.max(L::of(scratch.v[P - i]).abs()).array();
        *largest = both.into_iter().fold(0.0, |most, size| if size > most { size } else { most });
    }
    let wanted = step_size.step::<P>(&largest);
    let h = step_size::taken(wanted, left);
    if h > 0.0 {
        go::<L, P>(driven, scratch, flow, h);
    }
    (wanted, h)
}

/// Takes `flow` from the step's start on by `h` \[s\].
#[inline(always)]
pub fn go<L: Lanes, const P: usize>(
    driven: &DrivenKernel,
    scratch: &DrivenScratch,
    flow: &mut DrivenFlow,
    h: f64,
) {
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
    // Every factor here is exact or differs from step to step, so that no rounding acts for ever with one
    // sign.
    let pull = x_moved * (w + v + rate) + x * rate - w * (w * swept);
    let work = w * (driven.coupling * pull) - (turned[0] * driven.weight.re + turned[1] * driven.weight.im);
    for (i, increment) in [angle + h * flow.low[1], rate, work].into_iter().enumerate() {
        let sum = DoubleDouble::sum(flow.high[i], flow.low[i]) + increment;
        (flow.high[i], flow.low[i]) = (sum.hi, sum.lo);
    }
}

/// Increments over `h` \[s\]: of E; and `[mean of v less v_0, increment of v, –, mean of E's last lane less
/// its start]`.
#[inline(always)]
fn increments<L: Lanes, const P: usize>(scratch: &DrivenScratch, h: f64) -> ([f64; 4], [f64; 4]) {
    let square = L::splat(h * h);
    let mut chains = [[L::splat(0.0); 2]; 2];
    let mut k = P;
    while k > 0 {
        let (e, v) = (L::of(scratch.e[k]), L::of(scratch.v[k]));
        let (r, rest) = reciprocal(k + 1);
        let mut second = e.mul(L::of([0.0, 0.0, 0.0, r]));
        if rest != 0.0 {
            second = v.mul_add(L::of([rest, 0.0, 0.0, 0.0]), second);
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
