//! A few bodies without springs and motors, one lane a body.
//!
//! The equation of [`pair`](super::pair) for n bodies, with P_i = Σ_{j≠i} A_ij f_j' and dense A: per order four Cauchy products a body,
//! and M_0⁻¹ formed once a step.
//!
//! ```text
//! e_{k+1} = left(f_k)/(k+1),    g = Σ_{j=0..k} v_j e_{k+1-j}                   f_{k+1} without its newest term
//! r = e_k × W - Σ_{m=1..k} e_{k+1-m}·P_m - (k+1) e_0·(A g),    P_m = A m f_m
//! v_{k+1} = M_0⁻¹ r/(k+1),    f_{k+1} = g + v_{k+1} e_0
//! ```
//!
//! Scene constants enter as in `pair`: fractions of low orders in two terms, and the solutions of the first orders refined.

use super::direction;
use super::pace::{self, Pace, RECIPROCAL_REST};
use crate::arithmetic::DoubleDouble;
use crate::arithmetic::lanes::Lanes;
use crate::dynamics::{Mechanism, State, tree};

/// Largest order there is room for.
pub const MOST: usize = 24;
/// Largest number of bodies in `B` vectors of four lanes.
pub const fn room(blocks: usize) -> usize {
    4 * blocks
}

/// Four numbers a vector, `B` vectors.
type Row<const B: usize> = [[f64; 4]; B];

/// Constants of the mechanism; lanes beyond the last body are zero.
#[derive(Clone, Debug)]
pub struct Bodies<const B: usize> {
    count: usize,
    /// Column j of A: A_ij over i \[kg·m²\].
    coupling: Vec<Row<B>>,
    diagonal: Row<B>,
    /// W \[N·m\].
    weight: [Row<B>; 2],
    /// About the fastest rate of small oscillations \[rad/s\].
    rate: f64,
    /// M and its inverse at the step's start.
    mass: Vec<f64>,
    pivot: Vec<f64>,
    inverse: Vec<Row<B>>,
    columns: Vec<Row<B>>,
    scratch: Box<Scratch<B>>,
}

/// Coefficients of one step: cos, sin, v, and the two components of P; f of the order at hand.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Scratch<const B: usize> {
    c: [Row<B>; MOST + 1],
    s: [Row<B>; MOST + 1],
    v: [Row<B>; MOST + 1],
    px: [Row<B>; MOST + 1],
    py: [Row<B>; MOST + 1],
}

impl<const B: usize> Bodies<B> {
    /// The constants, where this form fits: up to 4 B bodies on their axes, neither springs nor rows.
    pub fn new(mechanism: &Mechanism) -> Option<Self> {
        let tree = &mechanism.tree;
        let n = tree.bodies;
        if n == 0 || n > room(B) || tree.off_axis || !mechanism.springs.is_empty() || !mechanism.rows.is_empty() {
            return None;
        }
        let mut coupling = vec![[[0.0; 4]; B]; n];
        let (mut diagonal, mut weight) = ([[0.0; 4]; B], [[[0.0; 4]; B]; 2]);
        for i in 0..n {
            diagonal[i / 4][i % 4] = tree.diagonal[i];
            weight[0][i / 4][i % 4] = tree.weight[i].re;
            weight[1][i / 4][i % 4] = tree.weight[i].im;
            for j in i + 1..n {
                coupling[j][i / 4][i % 4] = tree.coupling[i * n + j].re;
                coupling[i][j / 4][j % 4] = tree.coupling[i * n + j].re;
            }
        }
        // Stretched, the chain has the least inertia against bending: the trace of M⁻¹ W there is about the square of its fastest rate.
        let mut mass: Vec<f64> =
            (0..n * n).map(|at| if at / n == at % n { tree.diagonal[at / n] } else { coupling[at % n][at / n / 4][at / n % 4] }).collect();
        let mut pivot = vec![0.0; n];
        tree::factor::<f64, 0>(n, &mut mass, &mut pivot);
        let mut square = 0.0;
        for i in 0..n {
            let mut unit = vec![0.0; n];
            unit[i] = tree.weight[i].norm_squared().sqrt();
            tree::solve::<f64, 0>(n, &mass, &pivot, &mut unit);
            square += unit[i];
        }
        let zeros = [[[0.0; 4]; B]; MOST + 1];
        Some(Self {
            count: n,
            coupling,
            diagonal,
            weight,
            rate: square.sqrt(),
            mass,
            pivot,
            inverse: vec![[[0.0; 4]; B]; n],
            columns: vec![[[0.0; 4]; B]; n],
            scratch: Box::new(Scratch { c: zeros, s: zeros, v: zeros, px: zeros, py: zeros }),
        })
    }

    /// The longest step in which the terms left out still fall \[s\].
    pub fn longest(&self, order: usize) -> f64 {
        order as f64 / 3.0 / self.rate
    }
}

#[inline(always)]
fn load<L: Lanes, const B: usize>(row: &Row<B>) -> [L; B] {
    let mut lanes = [L::splat(0.0); B];
    for b in 0..B {
        lanes[b] = L::of(row[b]);
    }
    lanes
}

#[inline(always)]
fn store<L: Lanes, const B: usize>(row: &mut Row<B>, lanes: [L; B]) {
    for b in 0..B {
        row[b] = lanes[b].array();
    }
}

/// Σ_j columns_j x_j + start.
#[inline(always)]
fn apply<L: Lanes, const B: usize>(columns: &[Row<B>], x: &Row<B>, start: [L; B]) -> [L; B] {
    let (mut even, mut odd) = (start, [L::splat(0.0); B]);
    for (j, column) in columns.iter().enumerate() {
        let factor = L::splat(x[j / 4][j % 4]);
        let sums = if j % 2 == 0 { &mut even } else { &mut odd };
        for b in 0..B {
            sums[b] = L::of(column[b]).mul_add(factor, sums[b]);
        }
    }
    for b in 0..B {
        even[b] = even[b].add(odd[b]);
    }
    even
}

/// One step of at most `left` \[s\]; returns the step wanted and the step taken.
#[inline(always)]
pub fn step<L: Lanes, const P: usize, const B: usize>(bodies: &mut Bodies<B>, pace: &Pace, state: &mut State, left: f64) -> (f64, f64) {
    let n = bodies.count;
    begin::<L, B>(bodies, state);
    let zero = [L::splat(0.0); B];
    let Bodies { coupling, diagonal, weight, inverse, columns, scratch, .. } = bodies;
    let (c0, s0, v0): ([L; B], [L; B], [L; B]) = (load(&scratch.c[0]), load(&scratch.s[0]), load(&scratch.v[0]));
    let (wx, wy): ([L; B], [L; B]) = (load(&weight[0]), load(&weight[1]));
    let (mut fx, mut fy) = (zero, zero);
    for b in 0..B {
        (fx[b], fy[b]) = (v0[b].mul(c0[b]), v0[b].mul(s0[b]));
    }
    for k in 0..P {
        let r = L::splat(1.0 / (k + 1) as f64);
        let rest = L::splat(RECIPROCAL_REST.get(k + 1).copied().unwrap_or(0.0));
        let (mut c, mut s) = (zero, zero);
        for b in 0..B {
            s[b] = fx[b].mul_add(r, fx[b].mul(rest));
            c[b] = L::splat(0.0).sub(fy[b].mul_add(r, fy[b].mul(rest)));
        }
        store(&mut scratch.c[k + 1], c);
        store(&mut scratch.s[k + 1], s);
        // The newest coefficients last.
        let (mut gx, mut gy, mut load_x, mut load_y) = (zero, zero, zero, zero);
        for j in 1..=k {
            for b in 0..B {
                let (c, s) = (L::of(scratch.c[k + 1 - j][b]), L::of(scratch.s[k + 1 - j][b]));
                let v = L::of(scratch.v[j][b]);
                (gx[b], gy[b]) = (v.mul_add(c, gx[b]), v.mul_add(s, gy[b]));
                load_x[b] = c.mul_add(L::of(scratch.px[j][b]), load_x[b]);
                load_y[b] = s.mul_add(L::of(scratch.py[j][b]), load_y[b]);
            }
        }
        let (mut ax, mut ay): (Row<B>, Row<B>) = ([[0.0; 4]; B], [[0.0; 4]; B]);
        for b in 0..B {
            (gx[b], gy[b]) = (v0[b].mul_add(c[b], gx[b]), v0[b].mul_add(s[b], gy[b]));
            (ax[b], ay[b]) = (gx[b].array(), gy[b].array());
        }
        let (ax, ay) = (apply::<L, B>(coupling, &ax, zero), apply::<L, B>(coupling, &ay, zero));
        let mut torque = zero;
        let order = L::splat((k + 1) as f64);
        for b in 0..B {
            let (c, s) = (L::of(scratch.c[k][b]), L::of(scratch.s[k][b]));
            let weights = s.neg_mul_add(wx[b], c.mul(wy[b]));
            let inner = c0[b].mul_add(ax[b], s0[b].mul(ay[b]));
            torque[b] = order.neg_mul_add(inner, weights.sub(load_x[b].add(load_y[b])));
        }
        let mut right: Row<B> = [[0.0; 4]; B];
        store(&mut right, torque);
        let mut x = apply::<L, B>(inverse, &right, zero);
        if k < 2 {
            // x is rounded, not merely computed: one step of the residual.
            let mut found: Row<B> = [[0.0; 4]; B];
            store(&mut found, x);
            let product = apply::<L, B>(columns, &found, zero);
            for b in 0..B {
                torque[b] = L::of(diagonal[b]).neg_mul_add(x[b], torque[b]).sub(product[b]);
            }
            store(&mut right, torque);
            x = apply::<L, B>(inverse, &right, x);
        }
        let mut newest: [Row<B>; 2] = [[[0.0; 4]; B]; 2];
        for b in 0..B {
            let v = x[b].mul_add(r, x[b].mul(rest));
            scratch.v[k + 1][b] = v.array();
            (fx[b], fy[b]) = (v.mul_add(c0[b], gx[b]), v.mul_add(s0[b], gy[b]));
            newest[0][b] = fx[b].mul(order).array();
            newest[1][b] = fy[b].mul(order).array();
        }
        store(&mut scratch.px[k + 1], apply::<L, B>(coupling, &newest[0], zero));
        store(&mut scratch.py[k + 1], apply::<L, B>(coupling, &newest[1], zero));
    }
    let mut sizes = [0.0; super::JUDGES];
    for (i, size) in sizes.iter_mut().enumerate() {
        let row = &scratch.v[P - i];
        let mut largest = L::splat(0.0);
        for &lanes in row {
            largest = L::of(lanes).abs().max(largest);
        }
        *size = largest.array().into_iter().fold(0.0, |a, b| if a > b { a } else { b });
    }
    if !scratch.v[P].iter().flatten().all(|v| v.is_finite()) {
        return (f64::NAN, 0.0);
    }
    let wanted = pace.step::<P>(&sizes);
    let h = pace::taken(wanted, left);
    if h > 0.0 {
        finish::<L, P, B>(scratch, state, n, h);
    }
    (wanted, h)
}

/// Power zero, and M_0⁻¹.
#[inline(always)]
fn begin<L: Lanes, const B: usize>(bodies: &mut Bodies<B>, state: &State) {
    let n = bodies.count;
    let scratch = &mut bodies.scratch;
    let mut pairs = [[0.0; 2]; 8];
    for first in (0..n).step_by(2) {
        let second = (first + 1).min(n - 1);
        let (a, b) = (state.y[first], state.y[second]);
        let (a_low, b_low) = (state.low[first], state.low[second]);
        let [ca, sa, cb, sb] = direction::unit(L::of([a, a, b, b]), L::of([a_low, a_low, b_low, b_low])).array();
        pairs[first] = [ca, sa];
        pairs[second] = [cb, sb];
    }
    for (i, [c, s]) in pairs.into_iter().enumerate().take(n) {
        scratch.c[0][i / 4][i % 4] = c;
        scratch.s[0][i / 4][i % 4] = s;
        scratch.v[0][i / 4][i % 4] = state.y[n + i];
    }
    let mass = &mut bodies.mass;
    for j in 0..n {
        for b in 0..B {
            let cosine = L::of(scratch.c[0][b]).mul_add(L::splat(pairs[j][0]), L::of(scratch.s[0][b]).mul(L::splat(pairs[j][1])));
            bodies.columns[j][b] = L::of(bodies.coupling[j][b]).mul(cosine).array();
        }
        for i in 0..j {
            mass[i * n + j] = bodies.columns[j][i / 4][i % 4];
        }
        mass[j * n + j] = bodies.diagonal[j / 4][j % 4];
    }
    tree::factor::<f64, 0>(n, mass, &mut bodies.pivot);
    let mut unit = [0.0; 8];
    for j in 0..n {
        unit.fill(0.0);
        unit[j] = 1.0;
        tree::solve::<f64, 0>(n, mass, &bodies.pivot, &mut unit[..n]);
        for (i, &entry) in unit.iter().enumerate().take(n) {
            bodies.inverse[j][i / 4][i % 4] = entry;
        }
    }
}

/// Takes the state from the step's start on by `h` \[s\].
#[inline(always)]
pub fn go<L: Lanes, const P: usize, const B: usize>(bodies: &Bodies<B>, state: &mut State, h: f64) {
    finish::<L, P, B>(&bodies.scratch, state, bodies.count, h);
}

/// The new state.
#[inline(always)]
fn finish<L: Lanes, const P: usize, const B: usize>(scratch: &Scratch<B>, state: &mut State, n: usize, h: f64) {
    let (step, square) = (L::splat(h), L::splat(h * h));
    for b in 0..B {
        let (mut angles, mut rates) = ([L::splat(0.0); 2], [L::splat(0.0); 2]);
        let mut k = P;
        while k > 0 {
            let v = L::of(scratch.v[k][b]);
            let r = L::splat(1.0 / (k + 1) as f64);
            let term = if k + 1 < RECIPROCAL_REST.len() { v.mul_add(r, v.mul(L::splat(RECIPROCAL_REST[k + 1]))) } else { v.mul(r) };
            angles[k % 2] = angles[k % 2].mul_add(square, term);
            rates[k % 2] = rates[k % 2].mul_add(square, v);
            k -= 1;
        }
        let angle = angles[0].mul_add(step, angles[1]).mul_add(step, L::of(scratch.v[0][b])).mul(step).array();
        let rate = rates[0].mul_add(step, rates[1]).mul(step).array();
        for lane in 0..4 {
            let i = 4 * b + lane;
            if i < n {
                for (at, increment) in [(i, angle[lane] + h * state.low[n + i]), (n + i, rate[lane])] {
                    let sum = DoubleDouble::sum(state.y[at], state.low[at]) + increment;
                    (state.y[at], state.low[at]) = (sum.hi, sum.lo);
                }
            }
        }
    }
}
