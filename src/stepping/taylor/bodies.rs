//! A few bodies without motors, one lane a body.
//!
//! The equation of [`pair`](super::pair) for n bodies, with dense A: per order four Cauchy products a body,
//! two orders in one pass.  M_0⁻¹ and its products with A are formed once a step, so that an order waits for
//! two sums over the bodies, one after the other:
//!
//! ```text
//! e_{k+1} = left(f_k)/(k+1),    g = Σ_{j=0..k} v_j e_{k+1-j}
//!     f_{k+1} without its newest term
//! r = (e_k × W - Σ_{m=1..k} e_{k+1-m}·P_m)/(k+1),    P_m = A m f_m
//! v_{k+1} = M_0⁻¹ r - C g_x - S g_y,    C = M_0⁻¹ c_0 A,  S = M_0⁻¹ s_0 A,    f_{k+1} = g + v_{k+1} e_0
//! ```
//!
//! What springs and dampers add to P is made in [`springs`](super::springs); without them there is no trace
//! of it in the code.
//!
//! Scene constants enter as in `pair`: fractions of low orders in two terms, and the solutions of the first
//! orders refined.
//!
//! Wins over the series of any mechanism (whole runs by `taylor`): 1.5 times on `spring` at 1e-9, 1.7 at
//! 1e-14.

mod start;
use self::start::begin;
use super::HIGHEST_ORDER;
use super::springs::Springs;
use super::step_size::{self, StepSize};
use super::terms::over;
use crate::arithmetic::lanes::Lanes;
use crate::arithmetic::lanes::row::{Row, at, load, room, store};
use crate::arithmetic::{Complex, DoubleDouble};
use crate::dynamics::{Mechanism, MotionPowers, State};

/// Constants of the mechanism, whose springs fill `S` vectors; lanes beyond the last body are zero.
#[derive(Clone, Debug)]
pub struct Bodies<const B: usize, const S: usize> {
    count: usize,
    /// Highest power of the rates, an even number.
    order: usize,
    step_size: StepSize,
    /// About the fastest rate of small oscillations without springs \[rad/s\], and the longest step wherever
    /// the springs are \[s\].
    rate: f64,
    longest: f64,
    /// Column j of A: A_ij over i, zero on the diagonal \[kg·m²\].
    coupling: Vec<Row<B>>,
    diagonal: Row<B>,
    /// W \[N·m\].
    weight: [Row<B>; 2],
    springs: Springs<B, S>,
    /// The energy scale times the unit of time \[J s\].
    energy: f64,
    /// Of the step's start, over the columns.
    columns: Vec<MatrixColumn<B>>,
    scratch: Box<BodiesScratch<B>>,
}

/// One column of each matrix at the step's start.
#[derive(Clone, Debug)]
struct MatrixColumn<const B: usize> {
    /// M_0 beside its diagonal.
    mass: Row<B>,
    /// M_0⁻¹, -C, -S.
    inverse: Row<B>,
    cos: Row<B>,
    sin: Row<B>,
}

/// Coefficients of one step.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct BodiesScratch<const B: usize> {
    /// c and s.
    e: [[Row<B>; 2]; HIGHEST_ORDER + 2],
    /// v and the two components of P.
    v: [[Row<B>; 3]; HIGHEST_ORDER + 1],
}

/// What the newest coefficients are made from.
#[derive(Clone, Copy)]
struct NewestTerms<L, const B: usize> {
    e: [[L; B]; 2],
    v: [L; B],
    weight: [[L; B]; 2],
    diagonal: [L; B],
}

/// g without v_0 e_{k+1}, and the products with P.
#[derive(Clone, Copy)]
struct BodySums<L, const B: usize> {
    g: [[L; B]; 2],
    load: [L; B],
}

impl<const B: usize, const S: usize> Bodies<B, S> {
    /// The constants, where this form fits: up to 4 B bodies on their axes, as many springs as fill `S`
    /// vectors, no rows, and an even order.
    pub fn new(mechanism: &Mechanism, tolerance: f64, order: usize) -> Option<Self> {
        let tree = &mechanism.tree;
        let n = tree.coordinates;
        let is_sprung_only =
            !mechanism.is_winding() && mechanism.actions.is_empty() && mechanism.constraints.is_empty();
        if n == 0
            || n > room(B)
            || tree.off_axis
            || !is_sprung_only
            || order > HIGHEST_ORDER
            || order % 2 == 1
        {
            return None;
        }
        let springs = Springs::new(mechanism)?;
        let zero = [[0.0; 4]; B];
        let mut coupling = vec![zero; n];
        let (mut diagonal, mut weight) = (zero, [zero; 2]);
        for i in 0..n {
            diagonal[i / 4][i % 4] = tree.diagonal[i];
            weight[0][i / 4][i % 4] = tree.weight[i].re;
            weight[1][i / 4][i % 4] = tree.weight[i].im;
            for j in i + 1..n {
                coupling[j][i / 4][i % 4] = tree.coupling[i * n + j].re;
                coupling[i][j / 4][j % 4] = tree.coupling[i * n + j].re;
            }
        }
        let rate = tree.fastest_rate(&[]);
        // The stiffness of a law is known where a step begins.
        let longest =
            if springs.has_laws() { 0.0 } else { reach(order, tree.fastest_rate(&mechanism.springs)) };
        Some(Self {
            count: n,
            order,
            step_size: StepSize::new(tolerance, order, if S == 0 { longest } else { f64::INFINITY })
                .over(mechanism.units.time),
            rate,
            longest,
            coupling,
            diagonal,
            weight,
            springs,
            energy: mechanism.energy_scale * mechanism.units.time,
            columns: vec![MatrixColumn { mass: zero, inverse: zero, cos: zero, sin: zero }; n],
            scratch: Box::new(BodiesScratch {
                e: [[zero; 2]; HIGHEST_ORDER + 2],
                v: [[zero; 3]; HIGHEST_ORDER + 1],
            }),
        })
    }

    /// Writes the powers of the last step.
    pub fn powers(&self, powers: &mut MotionPowers) {
        let BodiesScratch { e, v } = &*self.scratch;
        let unit = |m: usize, k: usize| Complex::new(at(&e[m][0], k), at(&e[m][1], k));
        powers.take((self.count, self.order), |m, k| at(&v[m][0], k), unit);
    }
}

/// The longest step in which the terms left out of an oscillation of this rate \[rad/s\] still fall \[s\].
fn reach(order: usize, rate: f64) -> f64 {
    order as f64 / 3.0 / rate
}

/// Σ_j columns_j x_j.
#[inline(always)]
fn apply<'a, L: Lanes, const B: usize>(columns: impl Iterator<Item = &'a Row<B>>, x: &Row<B>) -> [L; B] {
    let mut sum = [L::splat(0.0); B];
    for (column, &factor) in columns.zip(x.as_flattened()) {
        let factor = L::splat(factor);
        for b in 0..B {
            sum[b] = L::of(column[b]).mul_add(factor, sum[b]);
        }
    }
    sum
}

/// The sums of order k, k even, and those of order k+1 as far as they are known before it: without the term
/// of v_{k+1} and e_1.
#[inline(always)]
fn sums<L: Lanes, const B: usize>(scratch: &BodiesScratch<B>, k: usize) -> [BodySums<L, B>; 2] {
    let zero = [L::splat(0.0); B];
    let mut sums = [BodySums { g: [zero; 2], load: zero }; 2];
    for b in 0..B {
        let nothing = L::splat(0.0);
        let mut chains = [[nothing; 4]; 2];
        // Each e serves order k+1, and order k one term later.
        let (mut c, mut s) = (L::of(scratch.e[k + 1][0][b]), L::of(scratch.e[k + 1][1][b]));
        // The newest e first, the newest v last.
        for (newer, older) in scratch.v[1..=k].iter().zip(scratch.e[1..=k].iter().rev()) {
            let (v, px, py) = (L::of(newer[0][b]), L::of(newer[1][b]), L::of(newer[2][b]));
            let [gx, gy, x, y] = chains[1];
            chains[1] = [v.mul_add(c, gx), v.mul_add(s, gy), px.mul_add(c, x), py.mul_add(s, y)];
            (c, s) = (L::of(older[0][b]), L::of(older[1][b]));
            let [gx, gy, x, y] = chains[0];
            chains[0] = [v.mul_add(c, gx), v.mul_add(s, gy), px.mul_add(c, x), py.mul_add(s, y)];
        }
        for (sums, [gx, gy, x, y]) in sums.iter_mut().zip(chains) {
            (sums.g[0][b], sums.g[1][b], sums.load[b]) = (gx, gy, x.add(y));
        }
    }
    sums
}

/// e_{k+1} from f_k.
#[inline(always)]
fn turn<L: Lanes, const B: usize>(scratch: &mut BodiesScratch<B>, k: usize, f: [[L; B]; 2]) -> [[L; B]; 2] {
    let mut e = f;
    for b in 0..B {
        (e[0][b], e[1][b]) = (L::splat(0.0).sub(over(f[1][b], k + 1)), over(f[0][b], k + 1));
    }
    scratch.e[k + 1] = [store(e[0]), store(e[1])];
    e
}

/// Order k: v_{k+1}, P_{k+1} and f_{k+1} from the sums, e_{k+1}, and what springs add to P_{k+1}.
#[inline(always)]
fn order<L: Lanes, const B: usize>(
    (coupling, columns): (&[Row<B>], &[MatrixColumn<B>]),
    start: &NewestTerms<L, B>,
    scratch: &mut BodiesScratch<B>,
    k: usize,
    sums: BodySums<L, B>,
    (e, pull): ([[L; B]; 2], Option<[[L; B]; 2]>),
) -> [[L; B]; 2] {
    let BodySums { mut g, load: mut r } = sums;
    let [c, s]: [[L; B]; 2] = [load(&scratch.e[k][0]), load(&scratch.e[k][1])];
    for b in 0..B {
        (g[0][b], g[1][b]) = (start.v[b].mul_add(e[0][b], g[0][b]), start.v[b].mul_add(e[1][b], g[1][b]));
        r[b] =
            s[b].neg_mul_add(start.weight[0][b], c[b].mul_add(start.weight[1][b], L::splat(0.0).sub(r[b])));
    }
    let (mut px, mut py) = ([L::splat(0.0); B], [L::splat(0.0); B]);
    if let Some(pull) = pull {
        for b in 0..B {
            r[b] = start.e[0][b].neg_mul_add(pull[0][b], start.e[1][b].neg_mul_add(pull[1][b], r[b]));
        }
        [px, py] = pull;
    }
    let v = if k < 2 { refined((coupling, columns), start, k, r, g) } else { solved(columns, k, r, g) };
    let mut f = g;
    for b in 0..B {
        (f[0][b], f[1][b]) = (v[b].mul_add(start.e[0][b], g[0][b]), v[b].mul_add(start.e[1][b], g[1][b]));
    }
    let rate = L::splat((k + 1) as f64);
    let mut scaled = f;
    for b in 0..B {
        (scaled[0][b], scaled[1][b]) = (f[0][b].mul(rate), f[1][b].mul(rate));
    }
    let (fx, fy) = (store(scaled[0]), store(scaled[1]));
    for ((column, &x), &y) in coupling.iter().zip(fx.as_flattened()).zip(fy.as_flattened()) {
        let (x, y) = (L::splat(x), L::splat(y));
        for b in 0..B {
            let column = L::of(column[b]);
            (px[b], py[b]) = (column.mul_add(x, px[b]), column.mul_add(y, py[b]));
        }
    }
    scratch.v[k + 1] = [store(v), store(px), store(py)];
    f
}

/// M_0⁻¹ r/(k+1) - C g_x - S g_y.
#[inline(always)]
fn solved<L: Lanes, const B: usize>(
    columns: &[MatrixColumn<B>],
    k: usize,
    mut r: [L; B],
    g: [[L; B]; 2],
) -> [L; B] {
    for b in 0..B {
        r[b] = over(r[b], k + 1);
    }
    let (r, gx, gy) = (store(r), store(g[0]), store(g[1]));
    let zero = [L::splat(0.0); B];
    let (mut direct, mut swung) = (zero, [zero; 2]);
    for (((column, &r), &x), &y) in
        columns.iter().zip(r.as_flattened()).zip(gx.as_flattened()).zip(gy.as_flattened())
    {
        let (r, x, y) = (L::splat(r), L::splat(x), L::splat(y));
        for b in 0..B {
            direct[b] = L::of(column.inverse[b]).mul_add(r, direct[b]);
            swung[0][b] = L::of(column.cos[b]).mul_add(x, swung[0][b]);
            swung[1][b] = L::of(column.sin[b]).mul_add(y, swung[1][b]);
        }
    }
    for b in 0..B {
        direct[b] = direct[b].add(swung[0][b].add(swung[1][b]));
    }
    direct
}

/// The same for the first orders, rounded, not merely computed: one step of the residual.
#[inline(always)]
fn refined<L: Lanes, const B: usize>(
    (coupling, columns): (&[Row<B>], &[MatrixColumn<B>]),
    start: &NewestTerms<L, B>,
    k: usize,
    mut r: [L; B],
    g: [[L; B]; 2],
) -> [L; B] {
    let (ax, ay): ([L; B], [L; B]) =
        (apply(coupling.iter(), &store(g[0])), apply(coupling.iter(), &store(g[1])));
    for b in 0..B {
        let inner = start.e[0][b].mul_add(ax[b], start.e[1][b].mul(ay[b]));
        r[b] = L::splat((k + 1) as f64).neg_mul_add(inner, r[b]);
    }
    let mut x = apply::<L, B>(columns.iter().map(|column| &column.inverse), &store(r));
    let product = apply::<L, B>(columns.iter().map(|column| &column.mass), &store(x));
    for b in 0..B {
        r[b] = start.diagonal[b].neg_mul_add(x[b], r[b]).sub(product[b]);
    }
    let rest = apply::<L, B>(columns.iter().map(|column| &column.inverse), &store(r));
    for b in 0..B {
        x[b] = over(x[b].add(rest[b]), k + 1);
    }
    x
}

/// One step of at most `left` \[s\]; returns the step wanted and the step taken.
#[inline(always)]
pub fn step<L: Lanes, const B: usize, const S: usize>(
    bodies: &mut Bodies<B, S>,
    state: &mut State,
    left: f64,
) -> (f64, f64) {
    begin::<L, B, S>(bodies, state);
    let Bodies {
        order: last,
        step_size,
        rate,
        longest,
        coupling,
        diagonal,
        weight,
        columns,
        springs,
        energy,
        scratch,
        ..
    } = bodies;
    let last = *last;
    let start: NewestTerms<L, B> = NewestTerms {
        e: [load(&scratch.e[0][0]), load(&scratch.e[0][1])],
        v: load(&scratch.v[0][0]),
        weight: [load(&weight[0]), load(&weight[1])],
        diagonal: load(diagonal),
    };
    let mut f = start.e;
    for b in 0..B {
        (f[0][b], f[1][b]) = (start.v[b].mul(start.e[0][b]), start.v[b].mul(start.e[1][b]));
    }
    for k in (0..last).step_by(2) {
        let e = turn(scratch, k, f);
        let pull = springs.pull(k, &scratch.e[k + 1]);
        let [first, mut second] = sums::<L, B>(scratch, k);
        f = order((coupling, columns), &start, scratch, k, first, (e, pull));
        let e = turn(scratch, k + 1, f);
        let pull = springs.pull(k + 1, &scratch.e[k + 2]);
        for b in 0..B {
            let [v, px, py] = &scratch.v[k + 1];
            let (v, px, py) = (L::of(v[b]), L::of(px[b]), L::of(py[b]));
            let (c, s) = (L::of(scratch.e[1][0][b]), L::of(scratch.e[1][1][b]));
            (second.g[0][b], second.g[1][b]) = (v.mul_add(c, second.g[0][b]), v.mul_add(s, second.g[1][b]));
            second.load[b] = px.mul_add(c, py.mul_add(s, second.load[b]));
        }
        f = order((coupling, columns), &start, scratch, k + 1, second, (e, pull));
    }
    let mut sizes = [0.0; super::JUDGES];
    for (i, size) in sizes.iter_mut().enumerate() {
        let mut largest = L::splat(0.0);
        for &lanes in &scratch.v[last - i][0] {
            largest = L::of(lanes).abs().max(largest);
        }
        *size = largest.array().into_iter().fold(0.0, |a, b| if a > b { a } else { b });
    }
    if !scratch.v[last][0].iter().flatten().all(|v| v.is_finite()) {
        return (f64::NAN, 0.0);
    }
    if let Some(power) = springs.power(last).last_chunk::<{ super::JUDGES }>() {
        // The dampers' work over the energy scale counts as the rates do.
        for (i, (size, power)) in sizes.iter_mut().zip(power.iter().rev()).enumerate() {
            *size = size.max((power / ((last - i) as f64 * *energy)).abs());
        }
    }
    let mut wanted = step_size.step_of(last, &sizes);
    if S > 0 && wanted > *longest {
        let solve = |x: &Row<B>| store(apply::<L, B>(columns.iter().map(|column| &column.inverse), x));
        wanted = wanted.min(reach(last, (*rate * *rate + springs.rate_squared(&scratch.e[0], solve)).sqrt()));
    }
    let h = step_size::taken(wanted, left);
    if h > 0.0 {
        go::<L, B, S>(bodies, state, h);
    }
    (wanted, h)
}

/// Takes the state from the step's start on by `h` \[s\].
#[inline(always)]
pub fn go<L: Lanes, const B: usize, const S: usize>(bodies: &Bodies<B, S>, state: &mut State, h: f64) {
    let (scratch, n) = (&bodies.scratch, bodies.count);
    let (step, square) = (L::splat(h), L::splat(h * h));
    let zero = [L::ZERO; B];
    // Even and odd powers by themselves.
    let (mut angles, mut rates) = ([zero; 2], [zero; 2]);
    for k in (2..=bodies.order).rev().step_by(2) {
        for (parity, k) in [(0, k), (1, k - 1)] {
            for b in 0..B {
                let v = L::of(scratch.v[k][0][b]);
                angles[parity][b] = angles[parity][b].mul_add(square, over(v, k + 1));
                rates[parity][b] = rates[parity][b].mul_add(square, v);
            }
        }
    }
    for b in 0..B {
        let angle = angles[0][b]
            .mul_add(step, angles[1][b])
            .mul_add(step, L::of(scratch.v[0][0][b]))
            .mul(step)
            .array();
        let rate = rates[0][b].mul_add(step, rates[1][b]).mul(step).array();
        for lane in 0..4 {
            let i = 4 * b + lane;
            if i < n {
                for (at, increment) in [(i, angle[lane] + h * state.low[n + i]), (n + i, rate[lane])] {
                    add(state, at, increment);
                }
            }
        }
    }
    let power = bodies.springs.power(bodies.order);
    if !power.is_empty() {
        let work =
            power.iter().enumerate().rev().fold(0.0, |sum, (m, &power)| sum * h + power / (m + 1) as f64);
        add(state, 2 * n, work * h);
    }
}

#[inline(always)]
fn add(state: &mut State, at: usize, increment: f64) {
    let sum = DoubleDouble::sum(state.y[at], state.low[at]) + increment;
    (state.y[at], state.low[at]) = (sum.hi, sum.lo);
}
