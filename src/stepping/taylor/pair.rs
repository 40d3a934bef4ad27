//! Two bodies without springs and motors, in four lanes: `[c1, s1, c2, s2]` and `[v1, v1, v2, v2]`.
//!
//! With v = phi', e = (cos phi, sin phi) and f = v e, the equation of body i reads, with A = A12, d_i the diagonal and W_i the weights,
//!
//! ```text
//! e' = left(f),    d_i v_i' + A e_i·f_j' = e_i × W_i
//! (k+1) e_{k+1} = left(f_k),   f_k = Σ v_j e_{k-j},   (k+1) M_0 v_{k+1} = e_k × W - A Σ_{m=1..k+1} m e_{k+1-m}·f_{j,m} without v_{k+1}
//! ```
//!
//! No second derivatives of sines and no angle differences; two Cauchy products share one operand.  M_0⁻¹ is formed once a step.  What the newest coefficient
//! v_k adds to each order is kept apart (*look-ahead*), so that two orders overlap:
//!
//! ```text
//! f_k = g_k + v_k e_0,    B = Σ_{j=1..k-1} v_j e_{k+1-j},    g_{k+1} = B + v_k e_1 + v_0 e_{k+1}
//! X = Σ_{m=1..k-1} m e_{k+1-m}·f_{j,m} + (k+1) e_0·B_j - (k v_0 - v_{j,0}) (s, -c)_0·g_{j,k}
//! (k+1) v_{k+1} = M_0⁻¹ (e_k × W - A X) + M_0⁻¹ T_k (v_2, v_1)_k,    T_k = ± A sin(phi_1 - phi_2) (k v_0 - (k+2) v_{j,0})
//! ```
//!
//! **A constant rounded once and used in every step is a drift**, since its error has the same sign for ever.  So the determinant takes its constant part in two
//! terms, the fractions of low orders are in two terms, and the first order's solution is refined.

use super::direction;
use super::pace::{self, Pace};
use super::terms::{LEFT, left_over, less_over, over, over_first, pair_sum};
use crate::arithmetic::lanes::Lanes;
use crate::arithmetic::sum::two_product;
use crate::dynamics::Mechanism;

/// Largest order there is room for.
pub const MOST: usize = 24;

/// Constants of the mechanism.
#[derive(Clone, Debug)]
pub struct Pair {
    /// e × W as a product with `[c, s, c, s]` \[N·m\].
    pub(super) weight: [f64; 4],
    /// A \[kg·m²\].
    pub(super) coupling: f64,
    /// d \[kg·m²\].
    pub(super) diagonal: [f64; 2],
    /// d_1 d_2, and what the double leaves out of it.
    pub(super) product: (f64, f64),
    /// Fastest rate of small oscillations, or a bound of it \[rad/s\].
    rate: f64,
}

/// Angles, rates and what they leave out, as `[phi1, v1, phi2, v2]`.
#[derive(Clone, Copy, Debug)]
pub struct Flow {
    /// Leading parts.
    pub high: [f64; 4],
    /// What they leave out.
    pub low: [f64; 4],
}

/// Coefficients of one step.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct Scratch {
    pub(super) e: [[f64; 4]; MOST + 1],
    pub(super) v: [[f64; 4]; MOST + 1],
    /// -A m (f_2, f_1)_m.
    pub(super) g: [[f64; 4]; MOST + 1],
}

impl Default for Scratch {
    fn default() -> Self {
        let zeros = [[0.0; 4]; MOST + 1];
        Self { e: zeros, v: zeros, g: zeros }
    }
}

impl Pair {
    /// The constants, where this form fits: two bodies, all hinges and centres of mass on the bars' axes, neither springs nor rows nor walls.
    pub fn new(mechanism: &Mechanism) -> Option<Self> {
        let tree = &mechanism.tree;
        if tree.bodies != 2 || tree.off_axis || !mechanism.springs.is_empty() || !mechanism.rows.is_empty() {
            return None;
        }
        let (d, a) = ([tree.diagonal[0], tree.diagonal[1]], tree.coupling[1].re);
        let [w1, w2] = [tree.weight[0], tree.weight[1]];
        let product = two_product(d[0], d[1]);
        let stiffness = d[1] * w1.norm_squared().sqrt() + d[0] * w2.norm_squared().sqrt();
        let rate = (stiffness / (product.0 - a * a)).sqrt();
        Some(Self { weight: [w1.im, -w1.re, w2.im, -w2.re], coupling: a, diagonal: d, product, rate })
    }

    /// The longest step in which the terms left out still fall: a third of the order in the time of the fastest oscillation \[s\].
    pub fn longest(&self, order: usize) -> f64 {
        order as f64 / 3.0 / self.rate
    }
}

/// What every order needs of the step's start.
#[derive(Clone, Copy)]
pub struct Start<L> {
    weight: L,
    /// -A.
    coupling: L,
    /// -A e_0 and -A (e_2, e_1)_0.
    e0: L,
    far: L,
    e1: L,
    v0: L,
    /// left(e_0).
    left: L,
    /// v_0 (s, -c)_0 and the same with the other body's rate.
    own: L,
    other: L,
    /// M_0⁻¹ on and off its diagonal.
    inverse: [L; 2],
    /// M_0⁻¹ T_k/(k+1) = `even - odd/(k+1)`, on and off the diagonal.
    even: [L; 2],
    odd: [L; 2],
}

impl<L: Lanes> Start<L> {
    /// From e_0, v_0 and M_0⁻¹ on and off its diagonal.
    #[inline(always)]
    pub fn new(pair: &Pair, e0: L, v0: L, inverse: [L; 2]) -> Self {
        let left = e0.swap_pairs().mul(L::of(LEFT));
        let (across, far) = (v0.swap_halves(), e0.swap_halves());
        // sin(phi_i - phi_j) with each body's sign.
        let sine = pair_sum(e0.mul(far.swap_pairs().mul(L::of(LEFT))));
        let twist = L::splat(pair.coupling).mul(sine);
        let (even, odd) = (twist.mul(v0.sub(across)), twist.mul(v0.add(across)));
        let sideways = L::splat(0.0).sub(left);
        let coupling = L::splat(-pair.coupling);
        Self {
            weight: L::of(pair.weight),
            coupling,
            e0: coupling.mul(e0),
            far: coupling.mul(far),
            e1: v0.mul(left),
            v0,
            left,
            own: v0.mul(sideways),
            other: across.mul(sideways),
            inverse,
            even: [inverse[0].mul(even), inverse[1].mul(even.swap_halves())],
            odd: [inverse[0].mul(odd), inverse[1].mul(odd.swap_halves())],
        }
    }
}

/// The newest coefficients: v_k, and e_k, g_k.
#[derive(Clone, Copy)]
pub struct Newest<L> {
    /// v_k.
    pub v: L,
    /// e_k.
    pub e: L,
    /// g_k.
    pub g: L,
}

/// B and X so far.
#[derive(Clone, Copy)]
struct Sums<L> {
    b: L,
    x: L,
}

/// What orders K and K+1 need of the coefficients before v_K: both at once, so that each is loaded for two products.
///
/// The terms with j = 1 and the last j are left out: they come last, since they are the newest.
#[inline(always)]
fn older<L: Lanes, const K: usize>(scratch: &Scratch) -> [Sums<L>; 2] {
    // From the middle outwards in two chains.
    let zero = Sums { b: L::splat(0.0), x: L::splat(0.0) };
    let mut sums = [[zero; 2]; 2];
    let middle = K / 2;
    for step in 0..middle {
        for (chain, j) in [middle - step, middle + 1 + step].into_iter().enumerate() {
            let (v, g) = (L::of(scratch.v[j]), L::of(scratch.g[j]));
            for (ahead, sums) in sums.iter_mut().enumerate() {
                if j >= 2 && j + 2 <= K + ahead {
                    let e = L::of(scratch.e[K + 1 + ahead - j]);
                    sums[chain] = Sums { b: v.mul_add(e, sums[chain].b), x: g.mul_add(e, sums[chain].x) };
                }
            }
        }
    }
    [total(sums[0]), total(sums[1])]
}

#[inline(always)]
fn total<L: Lanes>(chains: [Sums<L>; 2]) -> Sums<L> {
    Sums { b: chains[0].b.add(chains[1].b), x: chains[0].x.add(chains[1].x) }
}

/// Order K: from v_K, e_K, g_K to the next ones; writes e_{K+1}, v_{K+1} and -A K (f_2, f_1)_K.
#[inline(always)]
fn order<L: Lanes, const K: usize>(s: &Start<L>, scratch: &mut Scratch, older: Sums<L>, newest: Newest<L>) -> Newest<L> {
    let Sums { mut b, mut x } = older;
    let Newest { v, e, g } = newest;
    if K >= 3 {
        let second = L::of(scratch.e[2]);
        b = L::of(scratch.v[K - 1]).mul_add(second, b);
        x = L::of(scratch.g[K - 1]).mul_add(second, x);
    }
    x = e.mul_add(s.weight, x);
    if K >= 2 {
        b = e.mul_add(L::of(scratch.v[1]), b);
        x = e.mul_add(L::of(scratch.g[1]), x);
    }
    let far = g.swap_halves().mul(s.coupling);
    x = s.own.mul_add(L::splat(K as f64), L::splat(0.0).sub(s.other)).neg_mul_add(far, x);
    if K >= 2 {
        x = s.e0.mul(L::splat((K + 1) as f64)).mul_add(b.swap_halves(), x);
    }
    let d = over(pair_sum(x), K + 1);
    let (on, off) = (less_over(s.even[0], s.odd[0], K + 1), less_over(s.even[1], s.odd[1], K + 1));
    let solved = s.inverse[1].mul_add(d.swap_halves(), s.inverse[0].mul(d));
    // From here on everything waits for v_K.
    let swapped = v.swap_halves();
    let next = on.mul_add(swapped, off.mul_add(v, solved));
    let e_next = over(s.left, K + 1).mul_add(v, left_over(g, K + 1));
    scratch.g[K] = swapped.mul_add(s.far, far).mul(L::splat(K as f64)).array();
    scratch.e[K + 1] = e_next.array();
    scratch.v[K + 1] = next.array();
    Newest { v: next, e: e_next, g: s.v0.mul_add(e_next, v.mul_add(s.e1, b)) }
}

/// Orders FROM to P-1 in pairs, both even.
macro_rules! orders {
    ($start:expr, $scratch:expr, $newest:ident; $($k:literal $next:literal),*) => {
        $(if $k >= FROM && $k < P {
            let [first, second] = older::<L, $k>($scratch);
            $newest = order::<L, $k>($start, $scratch, first, $newest);
            $newest = order::<L, $next>($start, $scratch, second, $newest);
        })*
    };
}

/// Orders FROM to P-1 from the newest coefficients, those of order FROM.
#[inline(always)]
pub fn expand<L: Lanes, const P: usize, const FROM: usize>(start: &Start<L>, scratch: &mut Scratch, mut newest: Newest<L>) {
    orders!(start, scratch, newest; 2 3, 4 5, 6 7, 8 9, 10 11, 12 13, 14 15, 16 17, 18 19, 20 21, 22 23);
    let _ = newest;
}

/// The step the last coefficients want \[s\]; not a number where one of them is not.
#[inline(always)]
pub fn wanted<L: Lanes, const P: usize>(pace: &Pace, scratch: &Scratch) -> f64 {
    let v = L::of(scratch.v[P]).abs();
    // Not a number in any order reaches the last one.
    if !v.add(v.swap_halves()).array()[0].is_finite() {
        return f64::NAN;
    }
    let mut largest = [0.0; super::JUDGES];
    for (i, largest) in largest.iter_mut().enumerate() {
        let size = L::of(scratch.v[P - i]).abs();
        *largest = size.max(size.swap_halves()).array()[0];
    }
    pace.step::<P>(&largest)
}

/// Expands to order P and takes one step of at most `left` \[s\]; returns the step wanted, and leaves `flow` alone where it is useless.
#[inline(always)]
pub fn step<L: Lanes, const P: usize>(pair: &Pair, pace: &Pace, scratch: &mut Scratch, flow: &mut Flow, left: f64) -> (f64, f64) {
    let [phi1, v1, phi2, v2] = flow.high;
    let e0 = direction::unit(L::of([phi1, phi1, phi2, phi2]), L::of([flow.low[0], flow.low[0], flow.low[2], flow.low[2]]));
    let v0 = L::of([v1, v1, v2, v2]);
    let coupling = L::splat(pair.coupling);
    // M_0, whose cos(phi1 - phi2) is in all lanes.
    let m = pair_sum(e0.mul(e0.swap_halves())).mul(coupling);
    let [d1, d2] = pair.diagonal;
    let determinant = L::splat(pair.product.0).sub(m.mul_add(m, L::splat(-pair.product.1)));
    let reciprocal = L::of([1.0 / determinant.array()[0]; 4]);
    let inverse = [L::of([d2, d2, d1, d1]).mul(reciprocal), L::splat(0.0).sub(m).mul(reciprocal)];
    let start = Start::new(pair, e0, v0, inverse);
    let e1 = start.e1;
    let g1 = v0.mul(e1);
    let load = pair_sum(coupling.neg_mul_add(e0.mul(g1.swap_halves()), start.weight.mul(e0)));
    let mut first = inverse[1].mul_add(load.swap_halves(), inverse[0].mul(load));
    // The first order's solution is rounded, not merely computed: one step with the residual, whose sums and products are exact up to the last.
    let (diagonal, crossed) = (L::of([d1, d1, d2, d2]), first.swap_halves());
    let (on, off) = (diagonal.mul(first), m.mul(crossed));
    let dropped = diagonal.mul_add(first, L::splat(0.0).sub(on)).add(m.mul_add(crossed, L::splat(0.0).sub(off)));
    let rest = load.sub(on);
    let back = rest.sub(load);
    let lost = load.sub(rest.sub(back)).sub(on.add(back));
    let residual = rest.sub(off).add(lost.sub(dropped));
    first = first.add(inverse[1].mul_add(residual.swap_halves(), inverse[0].mul(residual)));
    scratch.e[0] = e0.array();
    scratch.e[1] = e1.array();
    scratch.v[0] = v0.array();
    scratch.v[1] = first.array();
    let zero = L::splat(0.0);
    let newest = order::<L, 1>(&start, scratch, Sums { b: zero, x: zero }, Newest { v: first, e: e1, g: g1 });
    expand::<L, P, 2>(&start, scratch, newest);
    let wanted = wanted::<L, P>(pace, scratch);
    if wanted.is_nan() {
        return (wanted, 0.0);
    }
    let h = pace::taken(wanted, left);
    if h > 0.0 {
        go::<L, P>(scratch, flow, h);
    }
    (wanted, h)
}

/// Takes `flow` from the step's start on by `h` \[s\].
#[inline(always)]
pub fn go<L: Lanes, const P: usize>(scratch: &Scratch, flow: &mut Flow, h: f64) {
    let (high, low) = (L::of(flow.high), L::of(flow.low));
    let rates = L::of([flow.high[1], 0.0, flow.high[3], 0.0]);
    let (increment, rest) = increment::<L, P>(scratch, rates, low, h);
    // Two-sum, then the low parts, then a quick two-sum.
    let sum = high.add(increment);
    let second = sum.sub(high);
    let error = high.sub(sum.sub(second)).add(increment.sub(second)).add(low.add(rest));
    let total = sum.add(error);
    flow.high = total.array();
    flow.low = error.sub(total.sub(sum)).array();
}

/// Increments `[phi1, v1, phi2, v2]` over `h` \[s\]: even and odd powers in two Horner chains; and what the rates' low parts move the angles by.
#[inline(always)]
fn increment<L: Lanes, const P: usize>(scratch: &Scratch, rates: L, low: L, h: f64) -> (L, L) {
    let square = L::splat(h * h);
    let mut chains = [L::splat(0.0); 2];
    let mut k = P;
    while k > 0 {
        chains[k % 2] = chains[k % 2].mul_add(square, over_first(L::of(scratch.v[k]), k + 1));
        k -= 1;
    }
    // Powers 1, 3, … are in chain 1 with h⁰ before them, 2, 4, … in chain 0 with h.
    let sum = chains[0].mul_add(L::splat(h), chains[1]);
    let moved = L::of([h, 1.0, h, 1.0]).mul_add(sum, rates);
    (moved.mul(L::splat(h)), low.swap_pairs().mul(L::of([h, 0.0, h, 0.0])))
}
