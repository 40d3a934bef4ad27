//! Springs and dampers beside the [`bodies`](super::bodies), one lane a spring.
//!
//! The force of a spring is its span D times a factor κ, and joins the P of the bodies one order later:
//!
//! ```text
//! D = p0 + Σ gamma_j e_j,    q = |D|²,    s = 1/|D|,    a = D·D'/q
//! κ = k (L0 s - 1) - c a,    F_m = Σ_{j=0..m} κ_j D_{m-j},    P_{m+1} += left(Σ conj(gamma) F_m)
//! h_m = (m/2) q_m,    q_0 a_m = h_{m+1} - Σ_{j=1..m} q_j a_{m-j},    (m+1) s_{m+1} = -Σ_{j=0..m} a_j s_{m-j}
//! power of the dampers = -Σ_{j=0..m} c a_j h_{m+1-j}
//! ```
//!
//! κ_0 = -k (L - L0)/L takes the stretch L - L0 from spans in double-double: the difference of two lengths,
//! rounded, times a stiff k would outweigh all other rounding.  A spring of free length zero without damper
//! has no use for its length, and lanes without a spring have none: their q is zero but for q_0 = 1.  A
//! spring whose law is a formula has its κ from [`law`].

mod law;

use self::law::LawSeries;
use super::HIGHEST_ORDER;
use super::terms::over;
use super::wide::Wide;
use crate::arithmetic::lanes::row::{Row, at, room, store};
use crate::arithmetic::lanes::{Code, Lanes};
use crate::dynamics::Mechanism;
use crate::dynamics::force::span::SpanLaw;
use crate::dynamics::force::{CompiledSpring, UserForce};
use crate::dynamics::point::Point;

/// Constants of the springs in `S` vectors, and their coefficients in the step; with `S = 0` nothing at all.
#[derive(Clone, Debug)]
pub struct Springs<const B: usize, const S: usize> {
    is_damped: bool,
    root: [Row<S>; 2],
    /// gamma over the bodies \[m\], lanes over springs.
    gamma: Vec<[Row<S>; 2]>,
    /// gamma over the springs, lanes over bodies.
    spread: Vec<[Row<B>; 2]>,
    stiffness: Row<S>,
    free_length: Row<S>,
    damping: Row<S>,
    /// One where the length matters, zero elsewhere.
    measured: Row<S>,
    /// What each spring adds at most to the square of the fastest rate \[rad²/s²\], those with laws of
    /// their own for a stiffness of one.
    most: Row<S>,
    /// Springs with laws of their own, in the lanes behind the built-in ones.
    laws: Vec<LawSeries>,
    does_work: bool,
    scratch: Box<SpringScratch<S>>,
}

/// Coefficients of one step.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct SpringScratch<const S: usize> {
    /// 1/q_0.
    inverse: Row<S>,
    /// D.
    x: [Row<S>; HIGHEST_ORDER + 2],
    y: [Row<S>; HIGHEST_ORDER + 2],
    /// q, h, a, s and κ.
    square: [Row<S>; HIGHEST_ORDER + 2],
    half: [Row<S>; HIGHEST_ORDER + 2],
    strain: [Row<S>; HIGHEST_ORDER + 2],
    reciprocal: [Row<S>; HIGHEST_ORDER + 2],
    factor: [Row<S>; HIGHEST_ORDER + 2],
    power: [f64; HIGHEST_ORDER + 1],
}

impl<const B: usize, const S: usize> Springs<B, S> {
    /// The constants, where this form fits: springs in `S` vectors between points of bodies that hang on the
    /// ground.
    pub fn new(mechanism: &Mechanism) -> Option<Self> {
        let (n, springs) = (mechanism.bodies.len(), &mechanism.springs);
        let laws: Option<Vec<&SpanLaw>> = mechanism.forces.iter().map(in_lanes).collect();
        let laws = laws?;
        let spans: Vec<&Point> =
            springs.iter().map(|spring| &spring.span).chain(laws.iter().map(|law| &law.span)).collect();
        if spans.len() > room(S) || (S > 0 && spans.is_empty()) || mechanism.coordinates() != n {
            return None;
        }
        let is_damped = springs.iter().any(|spring| spring.damping != 0.0);
        let row = |of: &dyn Fn(usize) -> f64| {
            let mut row = [[0.0; 4]; S];
            for i in 0..springs.len() {
                row[i / 4][i % 4] = of(i);
            }
            row
        };
        let of_all = |of: &dyn Fn(&Point) -> f64| {
            let mut row = [[0.0; 4]; S];
            for (i, span) in spans.iter().enumerate() {
                row[i / 4][i % 4] = of(span);
            }
            row
        };
        let gamma = |body: usize| [of_all(&|span| span.gamma(body).re), of_all(&|span| span.gamma(body).im)];
        let mut spread = vec![[[[0.0; 4]; B]; 2]; spans.len()];
        for (spread, span) in spread.iter_mut().zip(&spans) {
            for &(body, gamma) in &span.terms {
                (spread[0][body / 4][body % 4], spread[1][body / 4][body % 4]) = (gamma.re, gamma.im);
            }
        }
        let zero = [[0.0; 4]; S];
        let rate = |springs: &[CompiledSpring]| mechanism.tree.fastest_rate(springs);
        let mut measured = row(&|i| if springs[i].needs_length() { 1.0 } else { 0.0 });
        let mut most = row(&|i| rate(&springs[i..=i]).powi(2) - rate(&[]).powi(2));
        for (i, law) in laws.iter().enumerate().map(|(i, law)| (springs.len() + i, law)) {
            measured[i / 4][i % 4] = 1.0;
            most[i / 4][i % 4] = rate(&[of_stiffness_one(&law.span)]).powi(2) - rate(&[]).powi(2);
        }
        let laws: Vec<LawSeries> = laws.into_iter().map(LawSeries::new).collect();
        Some(Self {
            is_damped,
            root: [of_all(&|span| span.root.re), of_all(&|span| span.root.im)],
            gamma: (0..n).map(gamma).collect(),
            spread,
            stiffness: row(&|i| springs[i].stiffness),
            free_length: row(&|i| springs[i].free_length),
            damping: row(&|i| springs[i].damping),
            measured,
            most,
            does_work: is_damped || laws.iter().any(LawSeries::does_work),
            laws,
            scratch: Box::new(SpringScratch {
                inverse: zero,
                x: [zero; HIGHEST_ORDER + 2],
                y: [zero; HIGHEST_ORDER + 2],
                square: [zero; HIGHEST_ORDER + 2],
                half: [zero; HIGHEST_ORDER + 2],
                strain: [zero; HIGHEST_ORDER + 2],
                reciprocal: [zero; HIGHEST_ORDER + 2],
                factor: [zero; HIGHEST_ORDER + 2],
                power: [0.0; HIGHEST_ORDER + 1],
            }),
        })
    }

    /// True where some have laws of their own.
    pub fn has_laws(&self) -> bool {
        !self.laws.is_empty()
    }

    /// Powers below `order` of the power of dampers and laws \[W/s^m\]; none where these do no work.
    #[inline(always)]
    pub fn power(&self, order: usize) -> &[f64] {
        if self.does_work { &self.scratch.power[..order] } else { &[] }
    }

    /// Power zero, from cos and sin of the bodies' angles and what these leave out.
    #[inline(always)]
    pub fn begin<L: Lanes>(&mut self, units: &[[f64; 4]]) {
        let Self { root, gamma, stiffness, free_length, measured, scratch, spread, laws, .. } = self;
        for v in 0..S {
            let (mut x, mut y) = (Wide::of(L::of(root[0][v])), Wide::of(L::of(root[1][v])));
            for (&[c, s, c_low, s_low], gamma) in units.iter().zip(gamma.iter()) {
                let (c, s) = (Wide::from([c; 4], [c_low; 4]), Wide::from([s; 4], [s_low; 4]));
                let (re, im) = (L::of(gamma[0][v]), L::of(gamma[1][v]));
                (x, y) = (x.add(c.scale(re)).add(s.scale(im).minus()), y.add(s.scale(re)).add(c.scale(im)));
            }
            let (free, measured) = (L::of(free_length[v]), L::of(measured[v]));
            let rest = L::ONE.sub(measured);
            let square = x.mul(x).add(y.mul(y));
            let surplus = square.add(Wide::of(free).mul(Wide::of(free)).minus()).hi;
            let size = square.hi.mul_add(measured, rest);
            let length = size.sqrt();
            let relative = surplus.div(length.add(free).mul(length));
            (scratch.x[0][v], scratch.y[0][v]) = (x.hi.array(), y.hi.array());
            scratch.square[0][v] = size.array();
            scratch.inverse[v] = L::ONE.div(size).array();
            scratch.reciprocal[0][v] = L::ONE.div(length).array();
            scratch.factor[0][v] =
                L::ZERO.sub(L::of(stiffness[v])).mul(relative.mul_add(measured, rest)).array();
        }
        let first = spread.len() - laws.len();
        for (i, law) in laws.iter_mut().enumerate() {
            law.begin(at(&scratch.square[0], first + i).sqrt(), at(&scratch.reciprocal[0], first + i));
        }
    }

    /// About the square of the fastest rate the springs cause where the step begins \[rad²/s²\], from cos and
    /// sin of the bodies' angles and M⁻¹ times a vector: k J·M⁻¹ J for the pull along the spring, J_b =
    /// (gamma_b e_b) × D/L, and at most |κ_0| |gamma|² M⁻¹ for its turning.
    pub fn rate_squared(&self, e: &[Row<B>; 2], solve: impl Fn(&Row<B>) -> Row<B>) -> f64 {
        let Self { stiffness, measured, most, scratch, spread, laws, .. } = self;
        let first = spread.len() - laws.len();
        let of_spring = |(i, gamma): (usize, &[Row<B>; 2])| {
            let [stiffness, measured, most] = [stiffness, measured, most].map(|row| at(row, i));
            let [x, y, reciprocal, factor] =
                [&scratch.x, &scratch.y, &scratch.reciprocal, &scratch.factor].map(|rows| at(&rows[0], i));
            let mut lever = [[0.0; 4]; B];
            for (b, lever) in lever.as_flattened_mut().iter_mut().enumerate() {
                let [c, s, re, im] = [&e[0], &e[1], &gamma[0], &gamma[1]].map(|row| at(row, b));
                *lever = ((re * c - im * s) * y - (re * s + im * c) * x) * reciprocal;
            }
            let moved = solve(&lever);
            let along: f64 = lever
                .as_flattened()
                .iter()
                .zip(moved.as_flattened())
                .map(|(lever, moved)| lever * moved)
                .sum();
            let (stiffness, slack) = match i.checked_sub(first) {
                Some(law) => (laws[law].stiffness(), factor.abs()),
                None => (stiffness, if stiffness > 0.0 { factor.abs() / stiffness } else { 0.0 }),
            };
            measured * stiffness * along + slack * most
        };
        self.spread.iter().enumerate().map(of_spring).sum()
    }

    /// Power m >= 1 of the spans, q and s, and power m-1 of a, from that power of the bodies' unit vectors.
    #[inline(always)]
    fn raise<L: Lanes>(&mut self, m: usize, e: &[Row<B>; 2]) {
        let Self { gamma, stiffness, free_length, damping, measured, scratch, .. } = self;
        let (mut x, mut y) = ([L::ZERO; S], [L::ZERO; S]);
        for ((gamma, &c), &s) in gamma.iter().zip(e[0].as_flattened()).zip(e[1].as_flattened()) {
            let (c, s) = (L::splat(c), L::splat(s));
            for v in 0..S {
                let (re, im) = (L::of(gamma[0][v]), L::of(gamma[1][v]));
                x[v] = s.neg_mul_add(im, c.mul_add(re, x[v]));
                y[v] = c.mul_add(im, s.mul_add(re, y[v]));
            }
        }
        (scratch.x[m], scratch.y[m]) = (store(x), store(y));
        let within = half_square::<L, S>(&scratch.x[1..m], &scratch.y[1..m]);
        let [without, falling] =
            products::<L, S>(&scratch.strain[..m - 1], &scratch.square[1..m], &scratch.reciprocal[1..m]);
        for v in 0..S {
            let (along, across) = (L::of(scratch.x[0][v]), L::of(scratch.y[0][v]));
            let half_sum = along.mul_add(x[v], across.mul_add(y[v], within[v])).mul(L::of(measured[v]));
            let square = half_sum.add(half_sum);
            let half = half_sum.mul(L::splat(m as f64));
            let strain = half.sub(without[v]).mul(L::of(scratch.inverse[v]));
            let reciprocal =
                over(L::ZERO.sub(strain.mul_add(L::of(scratch.reciprocal[0][v]), falling[v])), m);
            (scratch.square[m][v], scratch.half[m][v]) = (square.array(), half.array());
            (scratch.strain[m - 1][v], scratch.reciprocal[m][v]) = (strain.array(), reciprocal.array());
            // One factor after the other: their product would be a constant rounded once.
            scratch.factor[m][v] = L::of(stiffness[v]).mul(L::of(free_length[v]).mul(reciprocal)).array();
            if self.is_damped {
                let elastic = L::of(scratch.factor[m - 1][v]);
                scratch.factor[m - 1][v] = strain.neg_mul_add(L::of(damping[v]), elastic).array();
            }
        }
        if !self.laws.is_empty() {
            L::apart(SpringLawFactors(self, m));
        }
    }

    /// Power m-1 of κ of the springs with laws of their own.
    #[inline(always)]
    fn follow_laws<L: Lanes>(&mut self, m: usize) {
        let Self { scratch, spread, laws, .. } = self;
        let first = spread.len() - laws.len();
        for (i, law) in (first..).zip(laws.iter_mut()) {
            let (strain, reciprocal) = (at(&scratch.strain[m - 1], i), at(&scratch.reciprocal[m], i));
            scratch.factor[m - 1][i / 4][i % 4] = law.factor::<L>(m - 1, strain, reciprocal);
        }
    }

    /// Adds power m of what laws do to the power.
    #[inline(always)]
    fn add_work<L: Lanes>(&mut self, m: usize) {
        let Self { scratch, laws, is_damped, .. } = self;
        let dampers = if *is_damped { scratch.power[m] } else { 0.0 };
        scratch.power[m] = laws.iter().fold(dampers, |sum, law| sum + law.power::<L>(m));
    }

    /// What the forces of power m add to power m+1 of P, from that power of the bodies' unit vectors; `None`
    /// without springs.
    #[inline(always)]
    pub fn pull<L: Lanes>(&mut self, m: usize, e: &[Row<B>; 2]) -> Option<[[L; B]; 2]> {
        if S == 0 {
            return None;
        }
        self.raise::<L>(m + 1, e);
        Some(self.share(m))
    }

    /// What the forces of power m add to power m+1 of P, after [`Springs::raise`] of that one.
    #[inline(always)]
    fn share<L: Lanes>(&mut self, m: usize) -> [[L; B]; 2] {
        let Self { spread, damping, scratch, .. } = self;
        let [fx, fy] = products::<L, S>(&scratch.factor[..=m], &scratch.x[..=m], &scratch.y[..=m]).map(store);
        let (mut px, mut py) = ([L::ZERO; B], [L::ZERO; B]);
        for ((gamma, &x), &y) in spread.iter().zip(fx.as_flattened()).zip(fy.as_flattened()) {
            let (x, y) = (L::splat(x), L::splat(y));
            for b in 0..B {
                let (re, im) = (L::of(gamma[0][b]), L::of(gamma[1][b]));
                px[b] = re.neg_mul_add(y, im.mul_add(x, px[b]));
                py[b] = re.mul_add(x, im.mul_add(y, py[b]));
            }
        }
        if self.is_damped {
            let mut lost = [L::ZERO; S];
            for (strain, half) in scratch.strain[..=m].iter().zip(scratch.half[1..=m + 1].iter().rev()) {
                for v in 0..S {
                    lost[v] = L::of(strain[v]).mul_add(L::of(half[v]), lost[v]);
                }
            }
            let lost = store(lost);
            let each = damping.as_flattened().iter().zip(lost.as_flattened());
            scratch.power[m] = each.fold(0.0, |sum, (&damping, &lost)| sum - damping * lost);
        }
        if !self.laws.is_empty() {
            L::apart(SpringWork(self, m));
        }
        [px, py]
    }
}

/// Laws are followed by themselves: in the loop over orders they cost springs without them 5 % of a step.
struct SpringLawFactors<'a, const B: usize, const S: usize>(&'a mut Springs<B, S>, usize);

impl<const B: usize, const S: usize> Code for SpringLawFactors<'_, B, S> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.0.follow_laws::<L>(self.1);
    }
}

/// What they do to the power, likewise.
struct SpringWork<'a, const B: usize, const S: usize>(&'a mut Springs<B, S>, usize);

impl<const B: usize, const S: usize> Code for SpringWork<'_, B, S> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.0.add_work::<L>(self.1);
    }
}

/// The law of a force, where it fits: a spring's over its length and rate.
fn in_lanes(force: &UserForce) -> Option<&SpanLaw> {
    force.span.as_deref().filter(|law| !law.depends_on_time() && !force.needs_confirmation)
}

/// A spring of 1 N/m along a span.
fn of_stiffness_one(span: &Point) -> CompiledSpring {
    let name = String::new();
    CompiledSpring {
        name,
        bodies: [None; 2],
        span: span.clone(),
        stiffness: 1.0,
        free_length: 0.0,
        damping: 0.0,
    }
}

/// Σ a_j b_{last-j} and Σ a_j c_{last-j}, from the middle outwards in two chains each, so that the newest
/// coefficients come last and nothing waits for them.
#[inline(always)]
fn products<L: Lanes, const S: usize>(a: &[Row<S>], b: &[Row<S>], c: &[Row<S>]) -> [[L; S]; 2] {
    let mut inner = [[L::ZERO; S]; 2];
    let mut outer = inner;
    let (a_low, a_high) = a.split_at(a.len() / 2);
    let [(b_low, b_high), (c_low, c_high)] = [b, c].map(|rows| rows.split_at(rows.len() - a.len() / 2));
    let lows = a_low.iter().rev().zip(b_high).zip(c_high);
    let mut highs = a_high.iter().zip(b_low.iter().rev()).zip(c_low.iter().rev());
    let add = |sums: &mut [[L; S]; 2], ((a, b), c): ((&Row<S>, &Row<S>), &Row<S>)| {
        for v in 0..S {
            let factor = L::of(a[v]);
            sums[0][v] = factor.mul_add(L::of(b[v]), sums[0][v]);
            sums[1][v] = factor.mul_add(L::of(c[v]), sums[1][v]);
        }
    };
    for (low, high) in lows.zip(highs.by_ref()) {
        add(&mut inner, low);
        add(&mut outer, high);
    }
    if let Some(last) = highs.next() {
        add(&mut outer, last);
    }
    for (inner, outer) in inner.iter_mut().zip(&outer) {
        for v in 0..S {
            inner[v] = inner[v].add(outer[v]);
        }
    }
    inner
}

/// Half of Σ a_j a_{last-j} + b_j b_{last-j}, likewise.
#[inline(always)]
fn half_square<'a, L: Lanes, const S: usize>(a: &'a [Row<S>], b: &'a [Row<S>]) -> [L; S] {
    let (middle, above) = (a.len() / 2, a.len().div_ceil(2));
    let mut sums = [[L::ZERO; S]; 2];
    for (sum, rows) in sums.iter_mut().zip([a, b]) {
        for (v, sum) in sum.iter_mut().enumerate().filter(|_| above > middle) {
            let central = L::of(rows[middle][v]);
            *sum = central.mul(central).mul(L::splat(0.5));
        }
    }
    let pairs = |rows: &'a [Row<S>]| rows[..middle].iter().rev().zip(&rows[above..]);
    for ((a_low, a_high), (b_low, b_high)) in pairs(a).zip(pairs(b)) {
        for v in 0..S {
            sums[0][v] = L::of(a_low[v]).mul_add(L::of(a_high[v]), sums[0][v]);
            sums[1][v] = L::of(b_low[v]).mul_add(L::of(b_high[v]), sums[1][v]);
        }
    }
    let [mut sum, other] = sums;
    for v in 0..S {
        sum[v] = sum[v].add(other[v]);
    }
    sum
}
