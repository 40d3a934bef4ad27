//! Derivatives of the powers of hinge trees and their loops, on the powers of the motion.
//!
//! ```text
//! z = exp(i phi):  dz = i dphi z,   Y_m = Σ_j dphi_j z_{m-j},   dz''_m = (m+1)(m+2) i Y_{m+2}
//! R = Σ_j H_kj z_j'' - F + g lambda:
//!   dR_m = Σ_j (H_kj dz_j''_m + dH_kj z_j''_m) - dF_m + dg lambda_m + g dlambda_m
//! Im(conj(z) R) + d_k a = 0,   D_m = Σ_l Re(conj(z_l) R_{m-l}):
//!   Σ_l Im(conj(z_l) dR_{m-l}) - Σ_j dphi_j D_{m-j} + dd_k a_m + d_k da_m = 0
//! Re(conj(g) z'') = 0:   Re(conj(g) dz''_m) + Re(conj(dg) z''_m) = 0
//! ```
//!
//! The motion is expanded first, in plain doubles, or its powers are those of its own step; what is left for
//! the derivatives are five products with known numbers where a recurrence on
//! [numbers with derivatives](super::slots) has eight, and four of numbers.  Two orders are summed at once,
//! so that a coefficient is loaded for both.  A pair of bodies has code of its own where it is worth it, and
//! by a [single] direction.  Everything new of an order is found at once, by one matrix of
//! M_0 and the constraints.  Mechanisms with anything else in them are expanded on such numbers.

mod known;
mod pair;
mod products;
mod single;
mod tree;
mod values;

use self::known::{RowGradient, TangentConstants};
use self::products::{TangentSums, minus_product};
use self::single::SinglePair;
use super::columns::{Begin, MotionPowers};
use super::varied::Number;
use super::{Series, Terms, zeros};
use crate::arithmetic::Complex;
use crate::arithmetic::lanes::wide::Slots;
use crate::dynamics::Coordinates;
use crate::dynamics::partition::DependentAngle;
use crate::dynamics::schur::Weakest;
use crate::dynamics::tree as hinge_tree;

/// Powers that are summed at once, and room for zeros before the first and after the last.
const BLOCK: usize = 8;

/// Derivatives of the powers of a motion.
#[derive(Debug)]
pub struct Tangent<S> {
    values: Series<f64>,
    begin: [Vec<f64>; 3],
    known: TangentConstants<S>,
    bodies: usize,
    rows: usize,
    /// Room for so many powers of each body.
    room: usize,
    /// M_0, its factors, and the matrix of an order, over bodies and rows.
    mass: Vec<f64>,
    pivot: Vec<f64>,
    response: Vec<f64>,
    /// The matrix of an order of a tree: of what is left, and of both components of z'' so far.
    whole_response: Vec<f64>,
    /// z and D from the last power to the first, with zeros at both ends, body by body.
    z: [Vec<f64>; 2],
    along: Vec<f64>,
    /// z'' and R, body by body, and the loads of an order of the motion.
    curve: [Vec<f64>; 2],
    force: [Vec<f64>; 2],
    load: Vec<f64>,
    /// Derivatives of angles, rates and R, body by body; of R first what the constants do to it.
    angle: Vec<S>,
    rate: Vec<S>,
    rest: [Vec<S>; 2],
    /// Sums of the next order on their way.
    ahead: Vec<TangentSums<S>>,
    /// All of these of a pair by a single direction.
    single: Option<Box<SinglePair>>,
    /// Of one order: what is left of the equations, the derivatives of z'' so far, and what is new.
    left: Vec<S>,
    bend: [Vec<S>; 2],
    new: Vec<S>,
    /// What is left and z'', one after the other.
    input: Vec<S>,
    /// 1/m, and (m+1)(m+2).
    fractions: Vec<f64>,
    times: Vec<f64>,
}

impl<S: Slots> Tangent<S> {
    /// Room for the powers of terms, where these are of this kind.
    pub fn new(terms: &Terms<Number>, coordinates: Coordinates, order: usize) -> Option<Self> {
        let known = TangentConstants::of(terms)?;
        let values = Series::<f64>::of_terms(&terms.structure.terms(), coordinates, order);
        let (n, r) = (terms.tree.coordinates, terms.constraints.len());
        let is_own = |(k, body): (usize, &DependentAngle)| body.base == Some(k) && body.laws.is_empty();
        let is_plain = values.coordinates() == n && values.partition.bodies.iter().enumerate().all(is_own);
        if !is_plain || (r > 0 && values.bodywise.is_some()) {
            return None;
        }
        // Blocks of four powers may end beyond the last.
        let (room, size) = (order + 4, n + r);
        let slots = |count: usize| vec![S::ZERO; count];
        let series = || zeros(n * room);
        let padded = || zeros(n * (room + 2 * BLOCK));
        let is_dense = r == 0 && known.coupling.is_dense();
        Some(Self {
            values,
            begin: [zeros(n), zeros(n), zeros(n)],
            known,
            bodies: n,
            rows: r,
            room,
            mass: zeros(n * n),
            pivot: zeros(n),
            response: zeros(size * size),
            whole_response: zeros(if is_dense { 3 * n * n } else { 0 }),
            z: [padded(), padded()],
            along: padded(),
            curve: [series(), series()],
            force: [series(), series()],
            load: zeros(n),
            angle: slots(n * room),
            rate: slots(n * room),
            rest: [slots(n * room), slots(n * room)],
            ahead: vec![TangentSums::ZERO; n],
            single: SinglePair::new(n, r, S::COUNT, order),
            left: slots(size),
            bend: [slots(n), slots(n)],
            new: slots(size),
            input: slots(if is_dense { 3 * n } else { 0 }),
            fractions: (0..room).map(|m| 1.0 / m.max(1) as f64).collect(),
            times: (0..room).map(|m| ((m + 1) * (m + 2)) as f64).collect(),
        })
    }

    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.bodies
    }

    /// Highest power of the rates.
    pub fn order(&self) -> usize {
        self.values.order()
    }

    /// Expands up to another power from here on.
    pub fn expand_up_to(&mut self, order: usize) {
        self.values.expand_up_to(order);
    }

    /// The row nearest to being left out at the start.
    pub fn weakest(&self) -> Weakest {
        self.values.weakest()
    }

    /// Power `m` of a rate.
    pub fn value(&self, m: usize, coordinate: usize) -> f64 {
        self.values.rate[m * self.bodies + coordinate]
    }

    /// Its derivatives.
    #[inline(always)]
    pub fn slope(&self, m: usize, coordinate: usize) -> S {
        self.rate[coordinate * self.room + m]
    }

    /// True of two bodies without loops, which have code of their own where it is worth it.
    #[inline(always)]
    fn is_pair(&self) -> bool {
        S::UNROLLED && (self.bodies, self.rows) == (2, 0)
    }

    /// Expands the derivatives.
    #[inline(always)]
    pub fn expand(&mut self, terms: &Terms<Number>, (t, u, _, rate): Begin, known: Option<&MotionPowers>) {
        if self.is_pair() && self.fitting(known).is_none() {
            let [own_u, own_rest, own_rate] = &mut self.begin;
            self.values.begin(t, own_u, own_rest, own_rate);
            self.values.orders_here::<2>(&terms.structure.terms(), 0);
        }
        let order = self.order();
        let first = self.fitting(known).map_or(order, |known| known.order.min(order));
        if let Some(mut pair) = self.single.take() {
            self.find_response(terms);
            self.expand_single(&mut pair, terms, (u, rate), first);
            self.single = Some(pair);
            return;
        }
        self.turn_over(first);
        self.find_force(terms, first);
        self.find_response(terms);
        for m in first..order {
            self.extend(m);
        }
        self.find_along();
        self.begin_rest();
        for k in 0..self.bodies {
            let (first, rate) = (k * self.room, S::of(&rate[k].slope));
            self.angle[first] = S::of(&u[k].slope);
            self.angle[first + 1] = rate;
            self.rate[first] = rate;
        }
        if S::COUNT > 1 && self.is_pair() {
            for m in 0..self.order() {
                self.advance_pair(m);
            }
            return;
        }
        let is_tree = !self.whole_response.is_empty();
        if is_tree {
            self.find_whole_response();
        }
        for m in 0..self.order() {
            if is_tree {
                self.advance_tree(m);
                continue;
            }
            for k in 0..self.bodies {
                (self.bend[0][k], self.bend[1][k], self.left[k]) = self.products(k, m);
            }
            self.balance(m);
            minus_product(&self.response, &self.left, &mut self.new);
            self.push(m);
        }
    }

    /// Where power 0 of z and D of a body is; the next ones come before it.
    #[inline(always)]
    fn place(&self, k: usize) -> usize {
        (k + 1) * (self.room + 2 * BLOCK) - BLOCK - 1
    }

    /// D, from the last power to the first.
    #[inline(always)]
    fn find_along(&mut self) {
        let (n, room, order) = (self.bodies, self.room, self.order());
        for k in 0..n {
            let own = k * room..k * room + order;
            let (force_re, force_im) = (&self.force[0][own.clone()], &self.force[1][own]);
            let last = self.place(k);
            let mut high = BLOCK;
            while high - BLOCK < order {
                // D_m of powers below `high`: z_{m-l} is l places behind z_m, and zeros are behind z_0.
                let first = last + 1 - high;
                let (mut sum, mut other) = ([0.0; BLOCK], [0.0; BLOCK]);
                for l in 0..high.min(order) {
                    let re = &self.z[0][first + l..first + l + BLOCK];
                    let im = &self.z[1][first + l..first + l + BLOCK];
                    for i in 0..BLOCK {
                        sum[i] += re[i] * force_re[l];
                        other[i] += im[i] * force_im[l];
                    }
                }
                let along = &mut self.along[first..first + BLOCK];
                for i in 0..BLOCK {
                    along[i] = sum[i] + other[i];
                }
                high += BLOCK;
            }
        }
    }

    /// The matrix that tells accelerations and multipliers, less their sign, from what is left of the
    /// equations.
    #[inline(always)]
    fn find_response(&mut self, terms: &Terms<Number>) {
        let (n, size) = (self.bodies, self.bodies + self.rows);
        let tree = &terms.structure.tree;
        tree.mass_matrix::<f64, 0>(&self.values.z[..n], &mut self.mass, &mut self.response[..n * n]);
        hinge_tree::factor::<f64, 0>(n, &mut self.mass, &mut self.pivot);
        self.response.fill(0.0);
        for (c, row) in self.response.chunks_exact_mut(size).enumerate().take(n) {
            row[c] = 1.0;
            hinge_tree::solve::<f64, 0>(n, &self.mass, &self.pivot, &mut row[..n]);
        }
        if self.rows > 0 {
            self.values.rows.border(&mut self.response);
        }
    }

    /// What the derivatives of the constants alone do to R.
    #[inline(always)]
    fn begin_rest(&mut self) {
        let (n, room, order) = (self.bodies, self.room, self.order());
        let [rest_re, rest_im] = &mut self.rest;
        for k in 0..n {
            let own = k * room..(k + 1) * room;
            let (re, im) = (&mut rest_re[own.clone()], &mut rest_im[own]);
            self.known.varied.products(k, &self.curve, room, order, (&mut *re, &mut *im));
            let [weight_re, weight_im] = self.known.weight[k];
            (re[0], im[0]) = (re[0].sub(weight_re), im[0].sub(weight_im));
        }
    }

    /// An acceleration of order m.
    #[inline(always)]
    fn acceleration(&self, k: usize, m: usize) -> f64 {
        self.values.omega[(m + 1) * self.bodies + k] * (m + 1) as f64
    }

    /// R without what is new, and what is left of the equations.
    #[inline(always)]
    fn balance(&mut self, m: usize) {
        let (n, room) = (self.bodies, self.room);
        self.left[n..].fill(S::ZERO);
        let [rest_re, rest_im] = &mut self.rest;
        let multipliers = if self.rows > 0 { self.values.multipliers(m) } else { &[] };
        for &RowGradient { row, body, value, slope: [re, im] } in &self.known.gradient {
            let place = body * room + m;
            let z = Complex::new(self.curve[0][place], self.curve[1][place]);
            let multiplier = S::splat(multipliers[row]);
            rest_re[place] = re.mul_add(multiplier, rest_re[place]);
            rest_im[place] = im.mul_add(multiplier, rest_im[place]);
            let mut left = self.bend[0][body].mul_add(S::splat(value.re), self.left[n + row]);
            left = self.bend[1][body].mul_add(S::splat(value.im), left);
            left = re.mul_add(S::splat(z.re), left);
            self.left[n + row] = im.mul_add(S::splat(z.im), left);
        }
        self.known.coupling.add(&self.bend, &mut self.rest, room, m);
        let [rest_re, rest_im] = &self.rest;
        for k in 0..n {
            let (z, place) = (self.values.z[k], k * room + m);
            let mut left = rest_im[place].mul_add(S::splat(z.re), self.left[k]);
            left = rest_re[place].neg_mul_add(S::splat(z.im), left);
            self.left[k] = self.known.diagonal[k].mul_add(S::splat(self.acceleration(k, m)), left);
        }
    }

    /// The next powers of an angle and its rate.
    #[inline(always)]
    fn push_rate(&mut self, k: usize, m: usize, new: S) {
        let first = k * self.room;
        let rate = new.mul(S::splat(self.fractions[m + 1]));
        self.rate[first + m + 1] = rate;
        self.angle[first + m + 2] = rate.mul(S::splat(self.fractions[m + 2]));
    }

    /// The next powers of angles and rates, and R completed.
    #[inline(always)]
    fn push(&mut self, m: usize) {
        let (n, room) = (self.bodies, self.room);
        for k in 0..n {
            let (z, new) = (self.values.z[k], self.new[k]);
            self.push_rate(k, m, new);
            self.bend[0][k] = new.mul(S::splat(-z.im));
            self.bend[1][k] = new.mul(S::splat(z.re));
        }
        self.known.coupling.add(&self.bend, &mut self.rest, room, m);
        let [rest_re, rest_im] = &mut self.rest;
        for &RowGradient { row, body, value, .. } in &self.known.gradient {
            let (place, multiplier) = (body * room + m, self.new[n + row]);
            rest_re[place] = multiplier.mul_add(S::splat(value.re), rest_re[place]);
            rest_im[place] = multiplier.mul_add(S::splat(value.im), rest_im[place]);
        }
    }
}

/// Adds a multiple of a series to another.
#[inline(always)]
fn add_product(sum: &mut [f64], series: &[f64], factor: f64) {
    for (sum, power) in sum.iter_mut().zip(series) {
        *sum += power * factor;
    }
}

#[cfg(test)]
mod tests;
