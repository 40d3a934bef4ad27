//! Two bodies as in [`pair`](super::pair), with the first orders in double-double.
//!
//! A step's terms fall like tolerance^(k/P), so that the rounding of a few low orders is all the drift there
//! is: with orders up to [`LEADING`], unit vectors, M_0⁻¹ and the sums in two parts, what is left is that of
//! terms a few thousand times smaller.  The recurrence is that of `bodies`, without look-ahead, and hands
//! over to the orders of `pair`:
//!
//! ```text
//! e_{k+1} = left(f_k)/(k+1),   g = Σ_{j=0..k} v_j e_{k+1-j}
//! (k+1) v_{k+1} = M_0⁻¹ (e_k × W - A Σ_{m=1..k} m e_{k+1-m}·f_{j,m} - A (k+1) e_0·g_j),
//!     f_{k+1} = g + v_{k+1} e_0
//! ```

use super::pair::{self, PairFlow, PairKernel, PairNewest, PairStart};
use super::step_size::{self, StepSize};
use super::terms::{LEFT, over_first, reciprocal};
use super::wide::{self, Wide};
use crate::arithmetic::lanes::Lanes;

/// Orders in double-double, an even number.
pub const LEADING: usize = 4;

/// Coefficients of one step.
#[derive(Clone, Debug, Default)]
pub struct ExtendedScratch {
    pair: pair::PairScratch,
    /// What the first v leave out.
    low: [[f64; 4]; LEADING + 1],
}

/// 1/k as `[sign/k, …]` in two parts.
#[inline(always)]
fn part<L: Lanes>(signs: [f64; 4], k: usize) -> Wide<L> {
    let (r, rest) = reciprocal(k);
    Wide::from(signs.map(|sign| sign * r), signs.map(|sign| sign * rest))
}

/// Expands to order P and takes one step of at most `left` \[s\]; returns the step wanted, and leaves `flow`
/// alone where it is useless.
#[inline(always)]
pub fn step<L: Lanes, const P: usize>(
    pair: &PairKernel,
    step_size: &StepSize,
    scratch: &mut ExtendedScratch,
    flow: &mut PairFlow,
    left: f64,
) -> (f64, f64) {
    let twice = |[_, a, _, b]: [f64; 4]| [a, a, b, b];
    let angles = |[a, _, b, _]: [f64; 4]| [a, a, b, b];
    let zero = Wide::of(L::splat(0.0));
    let mut e = [zero; LEADING + 1];
    let mut v = [zero; LEADING + 1];
    // -A m (f_2, f_1)_m.
    let mut g = [zero; LEADING + 1];
    e[0] = wide::unit(Wide::from(angles(flow.high), angles(flow.low)));
    v[0] = Wide::from(twice(flow.high), twice(flow.low));
    let [d1, d2] = pair.diagonal;
    let m = e[0].mul(e[0].swap_halves()).pair_sum().scale(L::splat(pair.coupling));
    let product = Wide::from([pair.product.0; 4], [pair.product.1; 4]);
    let reciprocal = product.with(m.minus(), m).formed().reciprocal();
    let inverse = [reciprocal.scale(L::of([d2, d2, d1, d1])), m.minus().mul(reciprocal)];
    let (weight, coupling) = (Wide::of(L::of(pair.weight)), L::splat(-pair.coupling));
    let (mut f, mut rest) = (v[0].mul(e[0]), zero);
    for k in 0..LEADING {
        e[k + 1] = f.swap_pairs().mul(part(LEFT, k + 1));
        // One factor after the other: their product would be a constant rounded once.
        let order = L::splat((k + 1) as f64);
        rest = zero;
        for j in 0..=k {
            rest = rest.with(v[j], e[k + 1 - j]);
        }
        rest = rest.formed();
        let mut x = rest.swap_halves().scale(coupling).scale(order).mul(e[0]).with(e[k], weight);
        for m in 1..=k {
            x = x.with(e[k + 1 - m], g[m]);
        }
        let load = x.formed().pair_sum();
        let solved = inverse[0].mul(load).with(inverse[1], load.swap_halves()).formed();
        v[k + 1] = solved.mul(part([1.0; 4], k + 1));
        f = rest.with(v[k + 1], e[0]).formed();
        g[k + 1] = f.swap_halves().scale(coupling).scale(order);
    }
    let plain = &mut scratch.pair;
    for k in 0..=LEADING {
        (plain.e[k], plain.v[k], plain.g[k]) = (e[k].hi.array(), v[k].hi.array(), g[k].hi.array());
        scratch.low[k] = v[k].lo.array();
    }
    let start = PairStart::new(pair, e[0].hi, v[0].hi, [inverse[0].hi, inverse[1].hi]);
    pair::expand::<L, P, LEADING>(
        &start,
        plain,
        PairNewest { v: v[LEADING].hi, e: e[LEADING].hi, g: rest.hi },
    );
    let wanted = pair::wanted::<L, P>(step_size, plain);
    if wanted.is_nan() {
        return (wanted, 0.0);
    }
    let h = step_size::taken(wanted, left);
    if h > 0.0 {
        go::<L, P>(scratch, flow, h);
    }
    (wanted, h)
}

/// Takes `flow` from the step's start on by `h` \[s\].
#[inline(always)]
pub fn go<L: Lanes, const P: usize>(scratch: &ExtendedScratch, flow: &mut PairFlow, h: f64) {
    // Powers beyond the leading ones by two Horner chains.
    let v = &scratch.pair.v;
    let square = L::splat(h * h);
    let mut chains = [L::splat(0.0); 2];
    for k in (LEADING + 1..=P).rev() {
        chains[k % 2] = chains[k % 2].mul_add(square, over_first(L::of(v[k]), k + 1));
    }
    let step = L::splat(h);
    let mut sum = Wide::of(chains[0].mul_add(step, chains[1]));
    for k in (1..=LEADING).rev() {
        let (r, rest) = reciprocal(k + 1);
        let factor = Wide::from([r, 1.0, r, 1.0], [rest, 0.0, rest, 0.0]);
        sum = Wide::from(v[k], scratch.low[k]).mul(factor).add(sum.scale(step));
    }
    let (high, low) = (flow.high, flow.low);
    let rates = Wide::from([high[1], 0.0, high[3], 0.0], [low[1], 0.0, low[3], 0.0]);
    let moved = sum.scale(L::of([h, 1.0, h, 1.0])).add(rates).scale(step);
    let new = Wide::from(high, low).add(moved);
    (flow.high, flow.low) = (new.hi.array(), new.lo.array());
}
