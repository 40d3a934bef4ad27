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
//! The motion is expanded first, in plain doubles; what is left for the derivatives are five products with
//! known numbers where a recurrence on [numbers with derivatives](super::slots) has eight, and four of
//! numbers.  Everything new of an order is found at once, by one matrix of M_0 and the constraints.  Mechanisms
//! with anything else in them are expanded on such numbers.

mod known;
mod pair;

use self::known::{Gradient, Known};
use super::columns::Begin;
use super::varied::Number;
use super::{Series, Terms, zeros};
use crate::arithmetic::Complex;
use crate::arithmetic::lanes::wide::Slots;
use crate::dynamics::Coordinates;
use crate::dynamics::partition::DependentAngle;
use crate::dynamics::schur::Weakest;
use crate::dynamics::tree;

/// Derivatives of the powers of a motion.
#[derive(Debug)]
pub struct Tangent<S> {
    values: Series<f64>,
    begin: [Vec<f64>; 3],
    known: Known<S>,
    bodies: usize,
    rows: usize,
    /// Room for so many powers of each body.
    room: usize,
    /// M_0, its factors, and the matrix of an order, over bodies and rows.
    mass: Vec<f64>,
    pivot: Vec<f64>,
    response: Vec<f64>,
    /// z and D from the last power to the first, body by body.
    z: [Vec<f64>; 2],
    along: Vec<f64>,
    /// Derivatives of angles, rates and R, body by body.
    angle: Vec<S>,
    rate: Vec<S>,
    rest: [Vec<S>; 2],
    /// Of one order: z'' and its derivatives so far, what is left of the equations, and what is new.
    curve: Vec<Complex<f64>>,
    bend: [Vec<S>; 2],
    left: Vec<S>,
    new: Vec<S>,
    /// 1/m.
    fractions: Vec<f64>,
}

impl<S: Slots> Tangent<S> {
    /// Room for the powers of terms, where these are of this kind.
    pub fn new(terms: &Terms<Number>, coordinates: Coordinates, order: usize) -> Option<Self> {
        let known = Known::of(terms)?;
        let values = Series::<f64>::of_terms(&terms.structure.terms(), coordinates, order);
        let (n, r) = (terms.tree.coordinates, terms.constraints.len());
        let is_own = |(k, body): (usize, &DependentAngle)| body.base == Some(k) && body.laws.is_empty();
        let is_plain = values.coordinates() == n && values.partition.bodies.iter().enumerate().all(is_own);
        if !is_plain || (r > 0 && values.bodywise.is_some()) {
            return None;
        }
        let (room, size) = (order + 3, n + r);
        let slots = |count: usize| vec![S::ZERO; count];
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
            z: [zeros(n * room), zeros(n * room)],
            along: zeros(n * room),
            angle: slots(n * room),
            rate: slots(n * room),
            rest: [slots(n * room), slots(n * room)],
            curve: vec![Complex::ZERO; n],
            bend: [slots(n), slots(n)],
            left: slots(size),
            new: slots(size),
            fractions: (0..room).map(|m| 1.0 / m.max(1) as f64).collect(),
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

    /// Expands the motion, but for that of a pair.
    pub fn expand_values(&mut self, terms: &Terms<Number>, (t, u, rest, rate): Begin) {
        let is_pair = self.is_pair();
        let [own_u, own_rest, own_rate] = &mut self.begin;
        for c in 0..self.bodies {
            (own_u[c], own_rest[c], own_rate[c]) = (u[c].value, rest[c].value, rate[c].value);
        }
        let plain = terms.structure.terms();
        if !is_pair {
            self.values.expand_terms(&plain, t, own_u, own_rest, own_rate);
        }
    }

    /// Expands the derivatives.
    #[inline(always)]
    pub fn expand(&mut self, terms: &Terms<Number>, (t, u, _, rate): Begin) {
        if self.is_pair() {
            let [own_u, own_rest, own_rate] = &mut self.begin;
            self.values.begin(t, own_u, own_rest, own_rate);
            self.values.orders_here::<2>(&terms.structure.terms(), 0);
        }
        self.turn_over();
        self.find_along();
        self.find_response(terms);
        for k in 0..self.bodies {
            let (first, rate) = (k * self.room, S::of(&rate[k].slope));
            self.angle[first] = S::of(&u[k].slope);
            self.angle[first + 1] = rate;
            self.rate[first] = rate;
        }
        if self.is_pair() {
            for m in 0..self.order() {
                self.advance_pair(m);
            }
            return;
        }
        for m in 0..self.order() {
            for k in 0..self.bodies {
                let products = self.products(k, m);
                (self.bend[0][k], self.bend[1][k], self.left[k]) = products;
                self.curve[k] = self.curve(k, m);
            }
            self.balance(m);
            self.solve();
            self.push(m);
        }
    }

    /// The powers of z, from the last to the first.
    #[inline(always)]
    fn turn_over(&mut self) {
        let (n, room, powers) = (self.bodies, self.room, self.order() + 2);
        let [re, im] = &mut self.z;
        for (m, z) in self.values.z[..powers * n].chunks_exact(n).enumerate() {
            for (k, z) in z.iter().enumerate() {
                (re[(k + 1) * room - 1 - m], im[(k + 1) * room - 1 - m]) = (z.re, z.im);
            }
        }
    }

    /// D, from the last power to the first.
    #[inline(always)]
    fn find_along(&mut self) {
        let (n, room, order) = (self.bodies, self.room, self.order());
        for k in 0..n {
            let (re, im) = (&self.z[0][k * room..(k + 1) * room], &self.z[1][k * room..(k + 1) * room]);
            let along = &mut self.along[k * room..(k + 1) * room];
            along.fill(0.0);
            for l in 0..order {
                let rest = self.values.rest[l * n + k];
                // Power m = p + l is at room - 1 - m, power p of z at room - 1 - p.
                let count = order - l;
                let (re, im) = (&re[room - count..], &im[room - count..]);
                let along = &mut along[room - order..room - l];
                for ((along, re), im) in along.iter_mut().zip(re).zip(im) {
                    *along += re * rest.re + im * rest.im;
                }
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
        tree::factor::<f64, 0>(n, &mut self.mass, &mut self.pivot);
        self.response.fill(0.0);
        for (c, row) in self.response.chunks_exact_mut(size).enumerate().take(n) {
            row[c] = 1.0;
            tree::solve::<f64, 0>(n, &self.mass, &self.pivot, &mut row[..n]);
        }
        if self.rows > 0 {
            self.values.rows.border(&mut self.response);
        }
    }

    /// z'' of order m.
    #[inline(always)]
    fn curve(&self, k: usize, m: usize) -> Complex<f64> {
        let (place, times) = ((k + 1) * self.room - 3 - m, ((m + 1) * (m + 2)) as f64);
        Complex::new(self.z[0][place] * times, self.z[1][place] * times)
    }

    /// Derivatives of z'' of order m without those of the new accelerations, and what products of powers that
    /// are known leave of the equation of a body.
    #[inline(always)]
    fn products(&self, k: usize, m: usize) -> (S, S, S) {
        let (room, times) = (self.room, ((m + 1) * (m + 2)) as f64);
        let (first, last) = (k * room, (k + 1) * room);
        let (re, im) = (&self.z[0][first..last], &self.z[1][first..last]);
        // Powers m+2, m+1, … of z, powers m, m-1, … of it, and those of D.
        let start = room - 3 - m;
        let (high_re, high_im) = (&re[start..][..m + 2], &im[start..][..m + 2]);
        let (low_re, low_im) = (&re[start + 2..][..m], &im[start + 2..][..m]);
        let along = &self.along[first..last][start + 2..][..m + 1];
        let angle = &self.angle[first..][..m + 2];
        let (rest_re, rest_im) = (&self.rest[0][first..][..m], &self.rest[1][first..][..m]);
        let (mut turn_re, mut turn_im) = (S::ZERO, S::ZERO);
        let (mut pull, mut cross_re, mut cross_im) = (S::ZERO, S::ZERO, S::ZERO);
        let mut j = 0;
        while j < m {
            turn_re = angle[j].mul_add(S::splat(high_re[j]), turn_re);
            turn_im = angle[j].mul_add(S::splat(high_im[j]), turn_im);
            pull = angle[j].mul_add(S::splat(along[j]), pull);
            cross_re = rest_im[j].mul_add(S::splat(low_re[j]), cross_re);
            cross_im = rest_re[j].mul_add(S::splat(low_im[j]), cross_im);
            j += 1;
        }
        pull = angle[m].mul_add(S::splat(along[m]), pull);
        turn_re = angle[m].mul_add(S::splat(high_re[m]), turn_re);
        turn_im = angle[m].mul_add(S::splat(high_im[m]), turn_im);
        turn_re = angle[m + 1].mul_add(S::splat(high_re[m + 1]), turn_re);
        turn_im = angle[m + 1].mul_add(S::splat(high_im[m + 1]), turn_im);
        let (bend_re, bend_im) = (turn_im.mul(S::splat(-times)), turn_re.mul(S::splat(times)));
        (bend_re, bend_im, cross_re.sub(cross_im).sub(pull))
    }

    /// R without what is new, and what is left of the equations.
    #[inline(always)]
    fn balance(&mut self, m: usize) {
        let (n, room) = (self.bodies, self.room);
        let [rest_re, rest_im] = &mut self.rest;
        for k in 0..n {
            let [re, im] = if m == 0 { self.known.weight[k] } else { [S::ZERO; 2] };
            rest_re[k * room + m] = S::ZERO.sub(re);
            rest_im[k * room + m] = S::ZERO.sub(im);
        }
        self.left[n..].fill(S::ZERO);
        self.known.varied.add_varied(&self.curve, &mut self.rest, room, m);
        let [rest_re, rest_im] = &mut self.rest;
        let multipliers = self.values.multipliers(m);
        for &Gradient { row, body, value, slope: [re, im] } in &self.known.gradient {
            let (place, z) = (body * room + m, self.curve[body]);
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
            let acceleration = self.values.omega[(m + 1) * n + k] * (m + 1) as f64;
            self.left[k] = self.known.diagonal[k].mul_add(S::splat(acceleration), left);
        }
    }

    /// New accelerations and multipliers.
    #[inline(always)]
    fn solve(&mut self) {
        let size = self.left.len();
        let (left, new) = (&self.left[..size], &mut self.new[..size]);
        for (row, response) in self.response.chunks_exact(size).enumerate() {
            let mut sum = S::ZERO;
            let mut c = 0;
            while c < size {
                sum = left[c].neg_mul_add(S::splat(response[c]), sum);
                c += 1;
            }
            new[row] = sum;
        }
    }

    /// The next powers of angles and rates, and R completed.
    #[inline(always)]
    fn push(&mut self, m: usize) {
        let (n, room) = (self.bodies, self.room);
        let [bend_re, bend_im] = &mut self.bend;
        for k in 0..n {
            let (z, new, first) = (self.values.z[k], self.new[k], k * room);
            let rate = new.mul(S::splat(self.fractions[m + 1]));
            self.rate[first + m + 1] = rate;
            self.angle[first + m + 2] = rate.mul(S::splat(self.fractions[m + 2]));
            bend_re[k] = new.mul(S::splat(-z.im));
            bend_im[k] = new.mul(S::splat(z.re));
        }
        self.known.coupling.add(&self.bend, &mut self.rest, room, m);
        let [rest_re, rest_im] = &mut self.rest;
        for &Gradient { row, body, value, .. } in &self.known.gradient {
            let (place, multiplier) = (body * room + m, self.new[n + row]);
            rest_re[place] = multiplier.mul_add(S::splat(value.re), rest_re[place]);
            rest_im[place] = multiplier.mul_add(S::splat(value.im), rest_im[place]);
        }
    }
}

#[cfg(test)]
mod tests;
