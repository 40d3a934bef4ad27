//! A single direction of two bodies without loops, in four lanes: `[re, im, re, im]` of both bodies.
//!
//! ```text
//! Y = Σ_{j<m+2} dphi_j z_{m+2-j},   q = dR_m without what is new = C_m + h (m+1)(m+2) i Y of the other body
//! V = Σ_{l>0} conj(z_l) × dR_{m-l} - Σ_j dphi_j D_{m-j} + conj(z_0) × q + dd a_m
//! da_m = -M_0⁻¹ V,   dR_m = q + h i z_0 da_m of the other body
//! ```
//!
//! One vector has both components of both bodies, so that an order has three products where the code for
//! any number of directions has ten, and D stays in the two terms of its scalar product.
//!
//! Wins over that code 1.7 times on whole runs of `sensitivity` (`gentle` over 2000 s by one number).

use super::Tangent;
use crate::arithmetic::lanes::wide::Slots;
use crate::arithmetic::lanes::{Arithmetic, Lanes};
use crate::dynamics::series::varied::Number;
use crate::dynamics::series::{Series, Terms};

/// Powers there is room for.
const ROOM: usize = 28;

type Powers = [[f64; 4]; ROOM];

/// Powers of the motion and of its derivatives.
#[derive(Debug)]
pub struct SinglePair {
    /// z, and its conjugate.
    z: Powers,
    conjugate: Powers,
    /// Rates, R and D of the motion.
    omega: Powers,
    force: Powers,
    along: Powers,
    /// dphi, and dR with its components the other way round.
    angle: Powers,
    rest: Powers,
}

/// What all orders have in common.
struct SingleConstants<L> {
    /// H off its diagonal, and its derivative.
    coupling: L,
    coupling_slope: L,
    /// M_0⁻¹ on and off its diagonal.
    response: [L; 2],
    /// Derivatives of d and of the weights.
    diagonal: L,
    weight: L,
    /// conj(z_0) and i z_0.
    conjugate: L,
    left: L,
}

impl<L: Lanes> SingleConstants<L> {
    /// Accelerations, less their sign, from the two terms of what is left of each equation.
    #[inline(always)]
    fn answer(&self, terms: L) -> L {
        let left = terms.add(terms.swap_pairs());
        let [on, off] = self.response;
        left.mul_add(on, left.swap_halves().mul(off))
    }
}

/// Y and V of an order, as far as they are known.
#[derive(Clone, Copy)]
struct SingleSums<L> {
    turn: L,
    pull: L,
}

/// i times both vectors.
#[inline(always)]
fn left<L: Lanes>(x: L) -> L {
    x.swap_pairs().mul(L::of([-1.0, 1.0, -1.0, 1.0]))
}

impl SinglePair {
    /// Room for powers up to `order` of so many bodies and rows in so many slots, where they are such a pair.
    pub fn new(bodies: usize, rows: usize, slots: usize, order: usize) -> Option<Box<Self>> {
        let zeros = [[0.0; 4]; ROOM];
        let [z, conjugate, omega, force, along, angle, rest] = [zeros; 7];
        let is_such = (bodies, rows, slots) == (2, 0, 1) && order + 4 <= ROOM;
        is_such.then(|| Box::new(Self { z, conjugate, omega, force, along, angle, rest }))
    }

    /// Takes a power of z.
    #[inline(always)]
    fn push<L: Lanes>(&mut self, m: usize, z: L) {
        self.z[m] = z.array();
        self.conjugate[m] = z.mul(L::of([1.0, -1.0, 1.0, -1.0])).array();
    }

    /// R_m of the motion from the next power of z but one.
    #[inline(always)]
    fn find_force<L: Lanes>(&mut self, coupling: L, times: f64, m: usize) {
        self.force[m] = coupling.mul(L::of(self.z[m + 2]).mul(L::splat(times)).swap_halves()).array();
    }

    /// Order m of the motion, m > 0: the next power of its rates, that of z after it, and R_m.
    #[inline(always)]
    fn extend<L: Lanes>(&mut self, constants: &SingleConstants<L>, times: f64, m: usize) {
        let (mut turn, mut j) = (L::ZERO, 0);
        while j <= m {
            turn = L::of(self.omega[j]).mul_add(L::of(self.z[m + 1 - j]), turn);
            j += 1;
        }
        let next = L::splat(1.0 / (m + 2) as f64);
        self.push(m + 2, left(turn).mul(next));
        self.find_force(constants.coupling, times, m);
        let (mut load, mut i) = (L::ZERO, 0);
        while i <= m {
            load = L::of(self.force[i]).swap_pairs().mul_add(L::of(self.conjugate[m - i]), load);
            i += 1;
        }
        let rate = constants.answer(load).mul(L::splat(-1.0 / (m + 1) as f64));
        self.omega[m + 1] = rate.array();
        self.push(m + 2, left(turn).add(constants.left.mul(rate)).mul(next));
        self.find_force(constants.coupling, times, m);
    }

    /// D_m.
    #[inline(always)]
    fn find_along<L: Lanes>(&mut self, m: usize) {
        let (mut even, mut odd, mut l) = (L::ZERO, L::ZERO, 0);
        while l < m {
            even = L::of(self.z[l]).mul_add(L::of(self.force[m - l]), even);
            odd = L::of(self.z[l + 1]).mul_add(L::of(self.force[m - l - 1]), odd);
            l += 2;
        }
        if l == m {
            even = L::of(self.z[m]).mul_add(L::of(self.force[0]), even);
        }
        self.along[m] = even.add(odd).array();
    }

    /// The sums of order m, and those of the next one without what order m brings.
    #[inline(always)]
    fn two_orders<L: Lanes>(&self, m: usize) -> [SingleSums<L>; 2] {
        let (mut this, mut next) = ([L::ZERO; 3], [L::ZERO; 3]);
        let (mut z, mut conjugate) = (L::of(self.z[m + 3]), L::of(self.conjugate[m + 1]));
        let (mut along, mut j) = (L::of(self.along[m + 1]), 0);
        while j < m {
            let (angle, rest) = (L::of(self.angle[j]), L::of(self.rest[j]));
            next[0] = angle.mul_add(z, next[0]);
            next[1] = rest.mul_add(conjugate, next[1]);
            next[2] = angle.neg_mul_add(along, next[2]);
            z = L::of(self.z[m + 2 - j]);
            (conjugate, along) = (L::of(self.conjugate[m - j]), L::of(self.along[m - j]));
            this[0] = angle.mul_add(z, this[0]);
            this[1] = rest.mul_add(conjugate, this[1]);
            this[2] = angle.neg_mul_add(along, this[2]);
            j += 1;
        }
        let (angle, newer) = (L::of(self.angle[m]), L::of(self.angle[m + 1]));
        let (first, second, last) = (L::of(self.z[1]), L::of(self.z[2]), L::of(self.along[0]));
        this[0] = newer.mul_add(first, angle.mul_add(second, this[0]));
        this[2] = angle.neg_mul_add(last, this[2]);
        next[0] = newer.mul_add(second, angle.mul_add(z, next[0]));
        next[2] = newer.neg_mul_add(last, angle.neg_mul_add(along, next[2]));
        [this, next].map(|[turn, cross, pull]| SingleSums { turn, pull: cross.add(pull) })
    }

    /// Adds what order m brings to the sums of the next one.
    #[inline(always)]
    fn completed<L: Lanes>(&self, sums: SingleSums<L>, m: usize) -> SingleSums<L> {
        SingleSums {
            turn: L::of(self.angle[m + 2]).mul_add(L::of(self.z[1]), sums.turn),
            pull: L::of(self.rest[m]).mul_add(L::of(self.conjugate[1]), sums.pull),
        }
    }

    /// Takes powers of the motion up to `first`, as they are known, and finds those after it.
    #[inline(always)]
    fn take_motion<L: Lanes>(
        &mut self,
        (values, constants, times): (&Series<f64>, &SingleConstants<L>, &[f64]),
        weight: [f64; 4],
        [first, order]: [usize; 2],
    ) {
        let mut m = 0;
        while m < first + 2 {
            let (z, other) = (values.z[2 * m], values.z[2 * m + 1]);
            self.push(m, L::of([z.re, z.im, other.re, other.im]));
            if m <= first {
                let (rate, other) = (values.omega[2 * m], values.omega[2 * m + 1]);
                self.omega[m] = [rate, rate, other, other];
            }
            m += 1;
        }
        m = 0;
        while m < first {
            self.find_force(constants.coupling, times[m], m);
            m += 1;
        }
        self.force[0] = L::of(self.force[0]).sub(L::of(weight)).array();
        while m < order {
            self.extend(constants, times[m], m);
            m += 1;
        }
        m = 0;
        while m < order {
            self.find_along::<L>(m);
            m += 1;
        }
    }

    /// Order m from its sums: the next power of the rates' derivatives.
    #[inline(always)]
    fn advance<L: Lanes>(
        &mut self,
        constants: &SingleConstants<L>,
        sums: SingleSums<L>,
        (m, times, fractions): (usize, &[f64], &[f64]),
    ) -> [f64; 2] {
        let times = L::splat(times[m]);
        let curve = L::of(self.z[m + 2]).mul(times).swap_halves();
        let mut rest = curve.mul(constants.coupling_slope);
        if m == 0 {
            rest = rest.sub(constants.weight);
        }
        rest = left(sums.turn.mul(times)).swap_halves().mul_add(constants.coupling, rest);
        let acceleration = L::of(self.omega[m + 1]).mul(L::splat((m + 1) as f64));
        let mut pull = rest.swap_pairs().mul_add(constants.conjugate, sums.pull);
        pull = acceleration.mul_add(constants.diagonal, pull);
        let new = constants.answer(pull);
        let next = new.mul(L::splat(-fractions[m + 1]));
        self.angle[m + 2] = next.mul(L::splat(fractions[m + 2])).array();
        rest = new.mul(constants.left).swap_halves().neg_mul_add(constants.coupling, rest);
        self.rest[m] = rest.swap_pairs().array();
        let [own, _, other, _] = next.array();
        [own, other]
    }
}

impl<S: Slots> Tangent<S> {
    /// The constants of a pair.
    #[inline(always)]
    fn constants(&self) -> SingleConstants<S::Half> {
        let (known, [z, other]) = (&self.known, [self.values.z[0], self.values.z[1]]);
        let slope = if let [entry, _] = known.varied.entries[..] { entry.slope.array()[0] } else { 0.0 };
        let [a, b, c, d] = [self.response[0], self.response[1], self.response[2], self.response[3]];
        let [first, second] = [0, 1].map(|k| known.weight[k].map(|part| part.array()[0]));
        let diagonal = [known.diagonal[0].array()[0], known.diagonal[1].array()[0]];
        SingleConstants {
            coupling: Arithmetic::splat(known.matrix[1]),
            coupling_slope: Arithmetic::splat(slope),
            response: [Lanes::of([a, a, d, d]), Lanes::of([b, b, c, c])],
            diagonal: Lanes::of([diagonal[0], 0.0, diagonal[1], 0.0]),
            weight: Lanes::of([first[0], first[1], second[0], second[1]]),
            conjugate: Lanes::of([z.re, -z.im, other.re, -other.im]),
            left: Lanes::of([-z.im, z.re, -other.im, other.re]),
        }
    }

    /// Expands the derivatives of a pair by a single direction, about a motion whose powers are known up to
    /// `first`.
    #[inline(always)]
    pub(super) fn expand_single(
        &mut self,
        pair: &mut SinglePair,
        terms: &Terms<Number>,
        (u, rate): (&[Number], &[Number]),
        first: usize,
    ) {
        let (constants, order, room) = (self.constants(), self.order(), self.room);
        let Self { values, times, fractions, rate: found, .. } = self;
        let [own, other] = [terms.structure.tree.weight[0], terms.structure.tree.weight[1]];
        let weight = [own.re, own.im, other.re, other.im];
        pair.take_motion((values, &constants, times), weight, [first, order]);
        for (to, from) in [(0, u), (1, rate)] {
            let [own, other] = [from[0].slope[0], from[1].slope[0]];
            pair.angle[to] = [own, own, other, other];
        }
        let (found, other) = found.split_at_mut(room);
        (found[0], other[0]) = (S::splat(rate[0].slope[0]), S::splat(rate[1].slope[0]));
        let mut m = 0;
        while m < order {
            let [this, mut next] = pair.two_orders::<S::Half>(m);
            let new = pair.advance(&constants, this, (m, times, fractions));
            m += 1;
            (found[m], other[m]) = (S::splat(new[0]), S::splat(new[1]));
            if m < order {
                next = pair.completed(next, m - 1);
                let new = pair.advance(&constants, next, (m, times, fractions));
                m += 1;
                (found[m], other[m]) = (S::splat(new[0]), S::splat(new[1]));
            }
        }
    }
}
