//! One or two bodies without springs and motors, in four lanes: `[c1, s1, c2, s2]` and `[v1, v1, v2, v2]`.
//!
//! With v = phi', e = (cos phi, sin phi) and f = v e, the equation of body i reads, with A = A12, d_i the
//! diagonal and W_i the weights,
//!
//! ```text
//! e' = left(f),    d_i v_i' + A e_i·f_j' = e_i × W_i
//! (k+1) e_{k+1} = left(f_k),   f_k = Σ v_j e_{k-j},
//!     (k+1) M_0 v_{k+1} = e_k × W - A Σ_{m=1..k+1} m e_{k+1-m}·f_{j,m} without v_{k+1}
//! ```
//!
//! No second derivatives of sines and no angle differences; two Cauchy products share one operand.  M_0⁻¹ is
//! formed once a step.  What the newest coefficient v_k adds to each order is kept apart (*look-ahead*), so
//! that two orders overlap:
//!
//! ```text
//! f_k = g_k + v_k e_0,    B = Σ_{j=1..k-1} v_j e_{k+1-j},    g_{k+1} = B + v_k e_1 + v_0 e_{k+1}
//! X = Σ_{m=1..k-1} m e_{k+1-m}·f_{j,m} + (k+1) e_0·B_j - (k v_0 - v_{j,0}) (s, -c)_0·g_{j,k}
//! (k+1) v_{k+1} = M_0⁻¹ (e_k × W - A X) + M_0⁻¹ T_k (v_2, v_1)_k,
//!     T_k = ± A sin(phi_1 - phi_2) (k v_0 - (k+2) v_{j,0})
//! ```
//!
//! **A constant rounded once and used in every step is a drift**, since its error has the same sign for ever.
//! So the determinant takes its constant part in two terms, the fractions of low orders are in two terms, and
//! the first order's solution is refined.
//!
//! Wins over the series of any mechanism (whole runs by `taylor`, start of the program included): 1.6 times
//! on `free` at 1e-9 and 1.7 at 1e-14, 1.4 and 1.7 on `gentle`.

use super::HIGHEST_ORDER;
use super::direction;
use super::step_size::{self, StepSize};
use super::terms::{LEFT, add_to, left_over, less_over, over, over_first, pair_sum};
use crate::arithmetic::Complex;
use crate::arithmetic::lanes::Lanes;
use crate::arithmetic::sum::two_product;
use crate::dynamics::{Mechanism, MotionPowers, State};

/// Constants of the mechanism.
#[derive(Clone, Debug)]
pub struct PairKernel {
    is_single: bool,
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
pub struct PairFlow {
    /// Leading parts.
    pub high: [f64; 4],
    /// What they leave out.
    pub low: [f64; 4],
}

impl PairFlow {
    /// From the unknowns `[phi1, phi2, v1, v2]`, or `[phi1, v1]`.
    #[inline(always)]
    pub fn of(pair: &PairKernel, state: &State) -> Self {
        let read = |unknowns: &[f64]| match *unknowns {
            [phi, v, ..] if pair.is_single => [phi, v, 0.0, 0.0],
            [phi1, phi2, v1, v2, ..] => [phi1, v1, phi2, v2],
            _ => [f64::NAN; 4],
        };
        Self { high: read(&state.y), low: read(&state.low) }
    }

    /// Back into the state.
    #[inline(always)]
    pub fn write(&self, pair: &PairKernel, state: &mut State) {
        for (unknowns, [phi1, v1, phi2, v2]) in [(&mut state.y, self.high), (&mut state.low, self.low)] {
            if pair.is_single {
                unknowns[..2].copy_from_slice(&[phi1, v1]);
            } else {
                unknowns[..4].copy_from_slice(&[phi1, phi2, v1, v2]);
            }
        }
    }
}

/// Coefficients of one step.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct PairScratch {
    pub(super) e: [[f64; 4]; HIGHEST_ORDER + 1],
    pub(super) v: [[f64; 4]; HIGHEST_ORDER + 1],
    /// -A m (f_2, f_1)_m.
    pub(super) g: [[f64; 4]; HIGHEST_ORDER + 1],
}

impl Default for PairScratch {
    fn default() -> Self {
        let zeros = [[0.0; 4]; HIGHEST_ORDER + 1];
        Self { e: zeros, v: zeros, g: zeros }
    }
}

impl PairKernel {
    /// The constants, where this form fits: one or two bodies, all hinges and centres of mass on the bars'
    /// axes, neither springs nor rows nor walls.
    ///
    /// One body has a second one beside it that feels nothing and stays where it is.
    pub fn new(mechanism: &Mechanism) -> Option<Self> {
        let tree = &mechanism.tree;
        if !(1..=2).contains(&tree.coordinates)
            || tree.off_axis
            || !mechanism.is_plain()
            || !mechanism.constraints.is_empty()
        {
            return None;
        }
        let is_single = tree.coordinates == 1;
        let second = if is_single {
            (1.0, 0.0, Complex::ZERO)
        } else {
            (tree.diagonal[1], tree.coupling[1].re, tree.weight[1])
        };
        let (d, w) = ([tree.diagonal[0], second.0], [tree.weight[0], second.2]);
        let a = second.1;
        let product = two_product(d[0], d[1]);
        let stiffness = d[1] * w[0].norm_squared().sqrt() + d[0] * w[1].norm_squared().sqrt();
        let rate = (stiffness / (product.0 - a * a)).sqrt();
        let weight = [w[0].im, -w[0].re, w[1].im, -w[1].re];
        Some(Self { is_single, weight, coupling: a, diagonal: d, product, rate })
    }

    /// The longest step in which the terms left out still fall: a third of the order in the time of the
    /// fastest oscillation \[s\].
    pub fn longest(&self, order: usize) -> f64 {
        order as f64 / 3.0 / self.rate
    }

    /// Writes the powers of a step of some order.
    pub fn powers(&self, scratch: &PairScratch, order: usize, powers: &mut MotionPowers) {
        let n = if self.is_single { 1 } else { 2 };
        let unit = |m: usize, k: usize| Complex::new(scratch.e[m][2 * k], scratch.e[m][2 * k + 1]);
        powers.take((n, order), |m, k| scratch.v[m][2 * k], unit);
    }
}

/// What every order needs of the step's start.
#[derive(Clone, Copy)]
pub struct PairStart<L> {
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

impl<L: Lanes> PairStart<L> {
    /// From e_0, v_0 and M_0⁻¹ on and off its diagonal.
    #[inline(always)]
    pub fn new(pair: &PairKernel, e0: L, v0: L, inverse: [L; 2]) -> Self {
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
pub struct PairNewest<L> {
    /// v_k.
    pub v: L,
    /// e_k.
    pub e: L,
    /// g_k.
    pub g: L,
}

/// B and X so far.
#[derive(Clone, Copy)]
struct PairSums<L> {
    b: L,
    x: L,
}

/// What orders k and k+1 need of the coefficients before v_k: both at once, so that each is loaded for two
/// products.
///
/// The terms with j = 1 and the last j are left out: they come last, since they are the newest.
#[inline(always)]
fn older<L: Lanes>(scratch: &PairScratch, k: usize) -> [PairSums<L>; 2] {
    // From the middle outwards in two chains.
    let zero = PairSums { b: L::splat(0.0), x: L::splat(0.0) };
    let mut sums = [[zero; 2]; 2];
    let middle = k / 2;
    for step in 0..middle {
        for (chain, j) in [middle - step, middle + 1 + step].into_iter().enumerate() {
            let (v, g) = (L::of(scratch.v[j]), L::of(scratch.g[j]));
            for (ahead, sums) in sums.iter_mut().enumerate() {
                if j >= 2 && j + 2 <= k + ahead {
                    let e = L::of(scratch.e[k + 1 + ahead - j]);
                    sums[chain] = PairSums { b: v.mul_add(e, sums[chain].b), x: g.mul_add(e, sums[chain].x) };
                }
            }
        }
    }
    [total(sums[0]), total(sums[1])]
}

#[inline(always)]
fn total<L: Lanes>(chains: [PairSums<L>; 2]) -> PairSums<L> {
    PairSums { b: chains[0].b.add(chains[1].b), x: chains[0].x.add(chains[1].x) }
}

/// Order k: from v_k, e_k, g_k to the next ones; writes e_{k+1}, v_{k+1} and -A k (f_2, f_1)_k.
#[inline(always)]
fn order<L: Lanes>(
    s: &PairStart<L>,
    scratch: &mut PairScratch,
    older: PairSums<L>,
    newest: PairNewest<L>,
    k: usize,
) -> PairNewest<L> {
    let PairSums { mut b, mut x } = older;
    let PairNewest { v, e, g } = newest;
    if k >= 3 {
        let second = L::of(scratch.e[2]);
        b = L::of(scratch.v[k - 1]).mul_add(second, b);
        x = L::of(scratch.g[k - 1]).mul_add(second, x);
    }
    x = e.mul_add(s.weight, x);
    if k >= 2 {
        b = e.mul_add(L::of(scratch.v[1]), b);
        x = e.mul_add(L::of(scratch.g[1]), x);
    }
    let far = g.swap_halves().mul(s.coupling);
    x = s.own.mul_add(L::splat(k as f64), L::splat(0.0).sub(s.other)).neg_mul_add(far, x);
    if k >= 2 {
        x = s.e0.mul(L::splat((k + 1) as f64)).mul_add(b.swap_halves(), x);
    }
    let d = over(pair_sum(x), k + 1);
    let (on, off) = (less_over(s.even[0], s.odd[0], k + 1), less_over(s.even[1], s.odd[1], k + 1));
    let solved = s.inverse[1].mul_add(d.swap_halves(), s.inverse[0].mul(d));
    // From here on everything waits for v_k.
    let swapped = v.swap_halves();
    let next = on.mul_add(swapped, off.mul_add(v, solved));
    let e_next = over(s.left, k + 1).mul_add(v, left_over(g, k + 1));
    scratch.g[k] = swapped.mul_add(s.far, far).mul(L::splat(k as f64)).array();
    scratch.e[k + 1] = e_next.array();
    scratch.v[k + 1] = next.array();
    PairNewest { v: next, e: e_next, g: s.v0.mul_add(e_next, v.mul_add(s.e1, b)) }
}

/// Two orders, the first of them even.
#[inline(always)]
fn two_orders<L: Lanes>(
    start: &PairStart<L>,
    scratch: &mut PairScratch,
    newest: PairNewest<L>,
    k: usize,
) -> PairNewest<L> {
    let [first, second] = older(scratch, k);
    let newest = order(start, scratch, first, newest, k);
    order(start, scratch, second, newest, k + 1)
}

/// Orders FROM to P-1 from the newest coefficients, those of order FROM; both even.
#[inline(always)]
pub fn expand<L: Lanes, const P: usize, const FROM: usize>(
    start: &PairStart<L>,
    scratch: &mut PairScratch,
    mut newest: PairNewest<L>,
) {
    if !L::UNROLLED {
        for k in (FROM..P).step_by(2) {
            newest = two_orders(start, scratch, newest, k);
        }
        return;
    }
    macro_rules! unrolled {
        ($($k:literal),*) => {
            $(if $k >= FROM && $k < P {
                newest = two_orders(start, scratch, newest, $k);
            })*
        };
    }
    unrolled!(2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22);
    let _ = newest;
}

/// The step the last coefficients want \[s\]; not a number where one of them is not.
#[inline(always)]
pub fn wanted<L: Lanes, const P: usize>(step_size: &StepSize, scratch: &PairScratch) -> f64 {
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
    step_size.step::<P>(&largest)
}

/// Expands to order P and takes one step of at most `left` \[s\]; returns the step wanted, and leaves `flow`
/// alone where it is useless.
#[inline(always)]
pub fn step<L: Lanes, const P: usize>(
    pair: &PairKernel,
    step_size: &StepSize,
    scratch: &mut PairScratch,
    flow: &mut PairFlow,
    left: f64,
) -> (f64, f64) {
    let [phi1, v1, phi2, v2] = flow.high;
    let e0 = direction::unit(
        L::of([phi1, phi1, phi2, phi2]),
        L::of([flow.low[0], flow.low[0], flow.low[2], flow.low[2]]),
    );
    let v0 = L::of([v1, v1, v2, v2]);
    let coupling = L::splat(pair.coupling);
    // M_0, whose cos(phi1 - phi2) is in all lanes.
    let m = pair_sum(e0.mul(e0.swap_halves())).mul(coupling);
    let [d1, d2] = pair.diagonal;
    let determinant = L::splat(pair.product.0).sub(m.mul_add(m, L::splat(-pair.product.1)));
    let reciprocal = L::of([1.0 / determinant.array()[0]; 4]);
    let inverse = [L::of([d2, d2, d1, d1]).mul(reciprocal), L::splat(0.0).sub(m).mul(reciprocal)];
    let start = PairStart::new(pair, e0, v0, inverse);
    let e1 = start.e1;
    let g1 = v0.mul(e1);
    let load = pair_sum(coupling.neg_mul_add(e0.mul(g1.swap_halves()), start.weight.mul(e0)));
    let mut first = inverse[1].mul_add(load.swap_halves(), inverse[0].mul(load));
    // The first order's solution is rounded, not merely computed: one step with the residual, whose sums and
    // products are exact up to the last.
    let (diagonal, crossed) = (L::of([d1, d1, d2, d2]), first.swap_halves());
    let (on, off) = (diagonal.mul(first), m.mul(crossed));
    let dropped =
        diagonal.mul_add(first, L::splat(0.0).sub(on)).add(m.mul_add(crossed, L::splat(0.0).sub(off)));
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
    let newest =
        order(&start, scratch, PairSums { b: zero, x: zero }, PairNewest { v: first, e: e1, g: g1 }, 1);
    expand::<L, P, 2>(&start, scratch, newest);
    let wanted = wanted::<L, P>(step_size, scratch);
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
pub fn go<L: Lanes, const P: usize>(scratch: &PairScratch, flow: &mut PairFlow, h: f64) {
    let (high, low) = (L::of(flow.high), L::of(flow.low));
    let rates = L::of([flow.high[1], 0.0, flow.high[3], 0.0]);
    let (increment, rest) = increment::<L, P>(scratch, rates, low, h);
    let [high, low] = add_to([high, low], increment, rest);
    (flow.high, flow.low) = (high.array(), low.array());
}

/// Increments `[phi1, v1, phi2, v2]` over `h` \[s\]: even and odd powers in two Horner chains; and what the
/// rates' low parts move the angles by.
#[inline(always)]
fn increment<L: Lanes, const P: usize>(scratch: &PairScratch, rates: L, low: L, h: f64) -> (L, L) {
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
