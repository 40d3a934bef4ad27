//! A few bodies with closed loops, in natural coordinates, one lane a body.
//!
//! ```text
//! z = Σ z_k h^k, multipliers mu_k of |z| = 1;  W, and the pins in it, constant: see `dynamics::natural`
//! f_m = F_m - Σ_{j<m} mu_j z_{m-j},    q_m = (m+1)(m+2)/2 Σ_{j=1..m+1} z_j·z_{m+2-j}
//! mu_m = S⁻¹ q_m + Uᵀ f_m,    (m+1)(m+2) z_{m+2} = P f_m - U q_m,
//!     V_j = W_·j z_j,  U = V S⁻¹,  P = W - U Vᵀ
//! ```
//!
//! Three Cauchy products a body and order, no sine beyond the first, and one stage of constant matrices
//! between one order and the next: the S of the step's start is inverted, not factored.  At the step's end
//! the linear rows and the lengths are put back at both levels, with W and the S of the new position; without
//! that the pins would drift by a digit or two.
//!
//! **Best order**: of the orders at hand that is summed which allows the longest step, each judged by its
//! last four coefficients.
//!
//! Wins over the series of any mechanism (whole runs by `taylor`): 3.0 times on `andrews` at 1e-9, 3.1 at
//! 1e-14, 1.8 on `kite`.

mod spring;

use self::spring::{LoopSpring, pull};
use super::HIGHEST_ORDER;
use super::expansion::{larger_size, minus_log2};
use crate::arithmetic::DoubleDouble;
use crate::arithmetic::lanes::Lanes;
use crate::arithmetic::lanes::row::{Row, at, load, room, store};
use crate::arithmetic::{Complex, sincos};
use crate::dynamics::force::action::Applied;
use crate::dynamics::looped::NEAR;
use crate::dynamics::natural::ReducedMatrices;
use crate::dynamics::natural::projection::LaneProjection;
use crate::dynamics::{Mechanism, State};
use std::f64::consts::TAU;

/// Powers an order is judged by.
const JUDGES: usize = 4;
/// The least order.
const LEAST: usize = 8;

/// Constants of the mechanism and coefficients of one step; lanes beyond the last body are zero.
#[derive(Clone, Debug)]
pub struct LoopedKernel<const B: usize> {
    count: usize,
    order: usize,
    log_tolerance: f64,
    /// log2 of the longest step, 2^30 units of time, and the unit of time \[s\].
    longest: f64,
    unit: f64,
    /// W, S and V, and the linear rows.
    projection: LaneProjection<B>,
    /// Gravity and constant forces, and the share of the latter \[N·m\].
    weight: [Row<B>; 2],
    applied: Vec<Complex<f64>>,
    /// Constant torque on each body \[N·m\].
    torque: Row<B>,
    springs: Vec<LoopSpring>,
    /// Highest power of z summed in the last step.
    summed: usize,
    /// z: powers 0…P+1.
    z: [[Row<B>; 2]; HIGHEST_ORDER + 2],
    /// mu: powers 0…P-1.
    mu: [Row<B>; HIGHEST_ORDER],
    /// U, its transpose G = Uᵀ, and P: x and y, column by column.
    spread: Vec<[Row<B>; 2]>,
    across: Vec<[Row<B>; 2]>,
    projected: Vec<[Row<B>; 4]>,
}

impl<const B: usize> LoopedKernel<B> {
    /// The constants of a mechanism with these matrices, where this form fits: up to 4 B bodies, constant
    /// forces, springs without dampers.
    pub fn new(
        mechanism: &Mechanism,
        reduced: &ReducedMatrices,
        tolerance: f64,
        order: usize,
    ) -> Option<Self> {
        let n = mechanism.bodies.len();
        let is_plain = !mechanism.is_winding()
            && mechanism.forces.is_empty()
            && !mechanism.is_damped()
            && mechanism.actions.iter().all(|action| action.law.is_none());
        if n > room(B) || !is_plain || order > HIGHEST_ORDER {
            return None;
        }
        let mut applied = vec![Complex::ZERO; n];
        let mut torque = [[0.0; 4]; B];
        for action in &mechanism.actions {
            match &action.kind {
                Applied::Force { point, force, follows: false } => {
                    point.spread(*force, |k, force| applied[k] += force)
                }
                Applied::Force { .. } => return None,
                Applied::Torque { torque: value, base } => {
                    torque[action.body / 4][action.body % 4] += value;
                    if let Some(base) = base {
                        torque[base / 4][base % 4] -= value;
                    }
                }
            }
        }
        let mut weight = [[[0.0; 4]; B]; 2];
        for (i, (&gravity, &applied)) in mechanism.tree.weight.iter().zip(&applied).enumerate() {
            (weight[0][i / 4][i % 4], weight[1][i / 4][i % 4]) =
                (gravity.re + applied.re, gravity.im + applied.im);
        }
        let zero = [[0.0; 4]; B];
        Some(Self {
            count: n,
            order,
            log_tolerance: libm::log2(tolerance),
            longest: 30.0 + libm::log2(mechanism.units.time),
            unit: mechanism.units.time,
            projection: LaneProjection::new(reduced),
            weight,
            applied,
            torque,
            springs: mechanism.springs.iter().map(LoopSpring::new).collect(),
            summed: 0,
            z: [[zero; 2]; HIGHEST_ORDER + 2],
            mu: [zero; HIGHEST_ORDER],
            spread: vec![[zero; 2]; n],
            across: vec![[zero; 2]; n],
            projected: vec![[zero; 4]; n],
        })
    }
}

/// Power zero and one, and the matrices of the step; the least share of a pivot.
#[inline(always)]
fn begin<L: Lanes, const B: usize>(looped: &mut LoopedKernel<B>, state: &State) -> f64 {
    let n = looped.count;
    let (mut angle, mut rest, mut rate) = ([[0.0; 4]; B], [[0.0; 4]; B], [[0.0; 4]; B]);
    for i in 0..n {
        (angle[i / 4][i % 4], rest[i / 4][i % 4], rate[i / 4][i % 4]) =
            (state.y[i], state.low[i], state.y[n + i]);
    }
    for b in 0..B {
        let (s, c) = sincos::sin_cos(L::of(angle[b]), L::of(rest[b]));
        let mut live = [0.0; 4];
        for (lane, live) in live.iter_mut().enumerate() {
            *live = if 4 * b + lane < n { 1.0 } else { 0.0 };
        }
        let (s, c, w) = (s.mul(L::of(live)), c.mul(L::of(live)), L::of(rate[b]));
        (looped.z[0][0][b], looped.z[0][1][b]) = (c.array(), s.array());
        (looped.z[1][0][b], looped.z[1][1][b]) = (s.mul(w).neg().array(), c.mul(w).array());
    }
    let LoopedKernel { projection, z, spread, across, projected, .. } = looped;
    let least = projection.unit_vectors::<L>(&z[0]);
    let LaneProjection { columns, schur, minv_jt, .. } = projection;
    for j in 0..n {
        let mut sum = [[L::ZERO; B]; 2];
        for i in 0..n {
            let factor = L::splat(at(&schur[j], i));
            for b in 0..B {
                sum[0][b] = L::of(minv_jt[i][0][b]).mul_add(factor, sum[0][b]);
                sum[1][b] = L::of(minv_jt[i][1][b]).mul_add(factor, sum[1][b]);
            }
        }
        spread[j] = [store(sum[0]), store(sum[1])];
        for i in 0..n {
            across[i][0][j / 4][j % 4] = at(&spread[j][0], i);
            across[i][1][j / 4][j % 4] = at(&spread[j][1], i);
        }
    }
    for j in 0..n {
        let mut block = [[L::ZERO; B]; 4];
        for part in 0..4 {
            block[part] = load(&columns.blocks[j][part]);
        }
        for i in 0..n {
            let (x, y) = (L::splat(at(&minv_jt[i][0], j)), L::splat(at(&minv_jt[i][1], j)));
            for b in 0..B {
                let (ux, uy) = (L::of(spread[i][0][b]), L::of(spread[i][1][b]));
                block[0][b] = ux.neg_mul_add(x, block[0][b]);
                block[1][b] = ux.neg_mul_add(y, block[1][b]);
                block[2][b] = uy.neg_mul_add(x, block[2][b]);
                block[3][b] = uy.neg_mul_add(y, block[3][b]);
            }
        }
        for part in 0..4 {
            projected[j][part] = store(block[part]);
        }
    }
    least
}

/// Power m of the applied forces, from z_m.
#[inline(always)]
fn forces<L: Lanes, const B: usize>(looped: &mut LoopedKernel<B>, m: usize) -> [[L; B]; 2] {
    let LoopedKernel { z, weight, torque, springs, .. } = looped;
    let mut force = [[L::ZERO; B]; 2];
    for b in 0..B {
        let torque = L::of(torque[b]);
        force[0][b] = L::of(z[m][1][b]).mul(torque).neg();
        force[1][b] = L::of(z[m][0][b]).mul(torque);
        if m == 0 {
            (force[0][b], force[1][b]) =
                (force[0][b].add(L::of(weight[0][b])), force[1][b].add(L::of(weight[1][b])));
        }
    }
    if springs.is_empty() {
        return force;
    }
    let mut pulled = [store(force[0]), store(force[1])];
    for spring in springs.iter_mut() {
        let mut d = if m == 0 { spring.span.root } else { Complex::ZERO };
        for &(k, gamma) in &spring.span.terms {
            d += Complex::new(at(&z[m][0], k), at(&z[m][1], k)).turn(gamma);
        }
        let pull = pull::<L>(spring, m, d);
        for &(k, gamma) in &spring.span.terms {
            let force = pull.turn(gamma.conj());
            pulled[0][k / 4][k % 4] += force.re;
            pulled[1][k / 4][k % 4] += force.im;
        }
    }
    [load(&pulled[0]), load(&pulled[1])]
}

/// mu_m and z_{m+2}.
#[inline(always)]
fn order<L: Lanes, const B: usize>(looped: &mut LoopedKernel<B>, m: usize) {
    let mut f = forces::<L, B>(looped, m);
    let LoopedKernel {
        count,
        z,
        mu,
        projection: LaneProjection { schur, .. },
        spread,
        across,
        projected,
        ..
    } = looped;
    let n = *count;
    let mut q = [L::ZERO; B];
    for b in 0..B {
        let (mut fx, mut fy) = (f[0][b], f[1][b]);
        // The newest multiplier last.
        for (mu, z) in mu[..m].iter().zip(z[1..=m].iter().rev()) {
            let mu = L::of(mu[b]);
            (fx, fy) = (mu.neg_mul_add(L::of(z[0][b]), fx), mu.neg_mul_add(L::of(z[1][b]), fy));
        }
        (f[0][b], f[1][b]) = (fx, fy);
        let mut sum = [L::ZERO; 2];
        for j in (1..=m.div_ceil(2)).rev() {
            let (old, new) = (&z[j], &z[m + 2 - j]);
            sum[0] = L::of(old[0][b]).mul_add(L::of(new[0][b]), sum[0]);
            sum[1] = L::of(old[1][b]).mul_add(L::of(new[1][b]), sum[1]);
        }
        let mut whole = sum[0].add(sum[1]);
        if m.is_multiple_of(2) {
            let middle = &z[m / 2 + 1];
            let (x, y) = (L::of(middle[0][b]), L::of(middle[1][b]));
            whole = x.mul_add(x, y.mul(y)).mul_add(L::splat(0.5), whole);
        }
        q[b] = whole.mul(L::splat(((m + 1) * (m + 2)) as f64));
    }
    let (fx, fy, qs) = (store(f[0]), store(f[1]), store(q));
    let (mut multiplier, mut turned) = ([[L::ZERO; B]; 2], [[L::ZERO; B]; 4]);
    for j in 0..n {
        let (x, y, q) = (L::splat(at(&fx, j)), L::splat(at(&fy, j)), L::splat(at(&qs, j)));
        for b in 0..B {
            multiplier[0][b] = L::of(across[j][0][b]).mul_add(x, multiplier[0][b]);
            multiplier[1][b] =
                L::of(across[j][1][b]).mul_add(y, L::of(schur[j][b]).mul_add(q, multiplier[1][b]));
            turned[0][b] = L::of(projected[j][0][b]).mul_add(x, turned[0][b]);
            turned[1][b] =
                L::of(projected[j][1][b]).mul_add(y, L::of(spread[j][0][b]).neg_mul_add(q, turned[1][b]));
            turned[2][b] = L::of(projected[j][2][b]).mul_add(x, turned[2][b]);
            turned[3][b] =
                L::of(projected[j][3][b]).mul_add(y, L::of(spread[j][1][b]).neg_mul_add(q, turned[3][b]));
        }
    }
    let scale = L::splat(1.0 / ((m + 1) * (m + 2)) as f64);
    for b in 0..B {
        mu[m][b] = multiplier[0][b].add(multiplier[1][b]).array();
        z[m + 2][0][b] = turned[0][b].add(turned[1][b]).mul(scale).array();
        z[m + 2][1][b] = turned[2][b].add(turned[3][b]).mul(scale).array();
    }
}

/// One step of at most `left` \[s\]; the step wanted and the step taken, or `None` near a singular position.
#[inline(always)]
pub fn step<L: Lanes, const B: usize>(
    looped: &mut LoopedKernel<B>,
    state: &mut State,
    left: f64,
) -> Option<(f64, f64)> {
    let least = begin::<L, B>(looped, state);
    if least < NEAR {
        return None;
    }
    for m in 0..looped.order {
        order::<L, B>(looped, m);
    }
    let (wanted, summed) = step_size::<L, B>(looped);
    looped.summed = summed;
    if wanted.is_nan() {
        return Some((f64::NAN, 0.0));
    }
    let h = super::step_size::taken(wanted, left);
    if h > 0.0 {
        go::<L, B>(looped, state, h);
    }
    Some((wanted, h))
}

/// The longest step any order allows \[s\], and the power of z that order ends with; not a number where a
/// coefficient is not.
#[inline(always)]
fn step_size<L: Lanes, const B: usize>(looped: &LoopedKernel<B>) -> (f64, usize) {
    let mut roots = [f64::INFINITY; JUDGES];
    let (mut best, mut chosen) = (f64::NEG_INFINITY, looped.order + 1);
    for k in LEAST - JUDGES..=looped.order {
        let mut most = L::ZERO;
        for b in 0..B {
            most = L::of(looped.z[k + 1][0][b]).abs().max(most);
            most = L::of(looped.z[k + 1][1][b]).abs().max(most);
        }
        let size = most.array().into_iter().fold(0.0, |a, b| if a > b { a } else { b }) * (k + 1) as f64;
        roots[k % JUDGES] = minus_log2(size * looped.unit) / k as f64;
        let least = roots.iter().fold(f64::INFINITY, |a, &b| if a < b { a } else { b });
        let allowed = least + looped.log_tolerance / (k + 1) as f64;
        if k >= LEAST && allowed > best {
            (best, chosen) = (allowed, k + 1);
        }
    }
    let last = &looped.z[looped.order + 1];
    let is_finite = last.iter().flatten().flatten().fold(0.0, |most, &z| larger_size(most, z)).is_finite();
    if is_finite { (libm::exp2(best.min(looped.longest)), chosen) } else { (f64::NAN, chosen) }
}

/// Σ z_k h^k without power zero, and the rates.
#[inline(always)]
fn sum<L: Lanes, const B: usize>(looped: &LoopedKernel<B>, h: f64) -> [[[L; B]; 2]; 2] {
    let step = L::splat(h);
    let mut sums = [[[L::ZERO; B]; 2]; 2];
    for b in 0..B {
        for axis in 0..2 {
            let (mut place, mut rate) = (L::ZERO, L::ZERO);
            let mut k = looped.summed;
            while k > 0 {
                let z = L::of(looped.z[k][axis][b]);
                place = place.mul_add(step, z);
                rate = rate.mul_add(step, z.mul(L::splat(k as f64)));
                k -= 1;
            }
            (sums[0][axis][b], sums[1][axis][b]) = (place.mul(step), rate);
        }
    }
    sums
}

/// Takes the state from the step's start on by `h` \[s\], onto all rows.
#[inline(always)]
pub fn go<L: Lanes, const B: usize>(looped: &mut LoopedKernel<B>, state: &mut State, h: f64) {
    let [place, rate] = sum::<L, B>(looped, h);
    let mut z = [store(place[0]), store(place[1])];
    let mut v = [store(rate[0]), store(rate[1])];
    let start = looped.z[0];
    for b in 0..B {
        for axis in 0..2 {
            z[axis][b] = L::of(start[axis][b]).add(L::of(z[axis][b])).array();
        }
    }
    // V and S⁻¹ of the step's start have served: the next step makes its own.
    looped.projection.project_back::<L>(&mut z);
    looped.projection.project_rates_back::<L>(&z, &mut v);
    let half = sum::<L, B>(looped, 0.5 * h)[0];
    let half = [store(half[0]), store(half[1])];
    let n = looped.count;
    let mut work = 0.0;
    for i in 0..n {
        let vector = |z: &[Row<B>; 2]| Complex::new(at(&z[0], i), at(&z[1], i));
        let (from, to) = (vector(&start), vector(&z));
        let between = from + vector(&half);
        let mut turn = libm::atan2(from.cross(to), from.dot(to));
        if from.dot(between) <= 0.0 || between.dot(to) <= 0.0 {
            // More than half a turn may have been made.
            let halves = libm::atan2(from.cross(between), from.dot(between))
                + libm::atan2(between.cross(to), between.dot(to));
            turn += TAU * libm::round((halves - turn) / TAU);
        }
        work += turn * at(&looped.torque, i) + looped.applied[i].dot(to - from);
        let angle = DoubleDouble::sum(state.y[i], state.low[i]) + turn;
        (state.y[i], state.low[i]) = (angle.hi, angle.lo);
        (state.y[n + i], state.low[n + i]) = (to.cross(vector(&v)), 0.0);
    }
    let work = DoubleDouble::sum(state.y[2 * n], state.low[2 * n]) + work;
    (state.y[2 * n], state.low[2 * n]) = (work.hi, work.lo);
}
