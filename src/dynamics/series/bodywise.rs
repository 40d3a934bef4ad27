//! What a series of many bodies has in place of matrices, and its Cauchy products.
//!
//! Both products of an order are sums of products component by component: w_j z_{k-j} with (w, w) for w, and
//! z_l × R_{m-l} with R turned to the right, as (R_y, -R_x), whose two sums are added up at the end.  So
//! neighbouring bodies are neighbouring lanes, whatever their number.

use super::{Series, SeriesNumber, Terms};
use crate::arithmetic::lanes::{self, Code, Lanes};
use crate::arithmetic::{Complex, Real};
use crate::dynamics::Mechanism;
use crate::dynamics::recursive::Evaluation;
use crate::dynamics::recursive::load::{InwardRequest, Passes};

/// Elements that are worked on at once.
const BLOCK: usize = 8;

/// The trees, their rows, and the factors of the products.
#[derive(Clone, Debug)]
pub struct Bodywise<T> {
    /// M_0 and S.
    pub evaluation: Evaluation<T>,
    /// M_0⁻¹ and H.
    passes: Passes<T>,
    /// (w, w): powers 0…P ((P+1) × n).
    spread: Vec<Complex<T>>,
    /// R, turned to the right: powers 0…P-1 (P × n).
    across: Vec<Complex<T>>,
    /// Scratch space (n).
    sums: Vec<Complex<T>>,
}

impl<T: Real> Bodywise<T> {
    /// Room up to power `order`, where the mechanism is evaluated body by body.
    pub fn new(mechanism: &Mechanism, order: usize) -> Option<Self> {
        let n = mechanism.coordinates();
        let recursion = mechanism.recursion.as_ref()?;
        Some(Self {
            evaluation: Evaluation::new(recursion, &mechanism.row_scales(), mechanism.rank_metric()),
            passes: Passes::new(&recursion.links),
            spread: vec![Complex::ZERO; (order + 1) * n],
            across: vec![Complex::ZERO; order * n],
            sums: vec![Complex::ZERO; n],
        })
    }

    /// The factors of M_0 at the elements `z`.
    pub fn factor(&mut self, z: &[Complex<T>], omega: &[T]) {
        self.evaluation.factor(z, omega);
        self.evaluation.brace(&mut self.passes);
    }

    /// Takes the rates and the R that are known.
    pub fn begin(&mut self, omega: &[T], rest: &[Complex<T>]) {
        spread(&mut self.spread, omega);
        turn(&mut self.across, rest);
    }
}

impl<T: SeriesNumber> Series<T> {
    /// One order: R_m, a_m, the newest powers of w and z.
    #[inline(always)]
    pub(super) fn advance_bodywise(&mut self, terms: &Terms<T::Constant>, m: usize) {
        let (n, angles) = (self.elements, self.angles);
        let factor = T::of((m + 1) as f64);
        self.load.fill(T::ZERO);
        self.gravity_forces(terms, m);
        self.force(terms, m);
        let Some(bodywise) = &mut self.bodywise else { return };
        let Bodywise { evaluation, passes, spread, across, sums } = &mut **bodywise;
        let (turned, bend) = (&mut self.turned[..n], &mut self.bend[..n]);
        T::products(n, &spread[..(m + 1) * n], &self.z[n..(m + 2) * n], &mut turned[..angles]);
        bend[angles..].fill(Complex::ZERO);
        for (bend, &sum) in bend.iter_mut().zip(turned.iter()).take(angles) {
            *bend = sum.left().times(factor);
        }
        // Of l = 0 only, R is not complete yet.
        T::products(n, &self.z[n..(m + 1) * n], &across[..m * n], &mut sums[..angles]);
        for (load, sum) in self.load.iter_mut().zip(&sums[..angles]) {
            *load -= sum.re + sum.im;
        }
        let rest = &mut self.rest[m * n..(m + 1) * n];
        evaluation
            .inward_loads(passes, InwardRequest { z: &self.z[..n], known: bend, rest, load: &self.load });
        if !self.rows.is_empty() {
            evaluation.settle(self.rows.known(m, &self.z, bend));
            self.rows.push(m, &self.z[..n], rest);
        }
        let solution = &mut self.solution[..n];
        evaluation.unfold_order(passes, solution);
        let (known, newest) = self.z.split_at_mut((m + 2) * n);
        let (z, newest) = (&known[..n], &mut newest[..n]);
        let omega = &mut self.omega[(m + 1) * n..(m + 2) * n];
        for i in 0..n {
            omega[i] = self.fractions.over(solution[i], m + 1);
        }
        self.rate[(m + 1) * n..(m + 2) * n].copy_from_slice(omega);
        for i in 0..angles {
            bend[i] += z[i].left().times(solution[i]);
            newest[i] = self.fractions.vector_over((turned[i] + z[i].times(omega[i])).left(), m + 2);
        }
        for x in (angles..n).step_by(2) {
            bend[x] = Complex::new(solution[x], solution[x + 1]);
            newest[x] = self.fractions.vector_over(Complex::new(omega[x], omega[x + 1]), m + 2);
        }
        evaluation.close(passes, bend, rest);
        turn(&mut across[m * n..], rest);
        self::spread(&mut spread[(m + 1) * n..], omega);
    }
}

#[inline]
fn spread<T: Real>(spread: &mut [Complex<T>], omega: &[T]) {
    for (spread, &omega) in spread.iter_mut().zip(omega) {
        *spread = Complex::new(omega, omega);
    }
}

#[inline]
fn turn<T: Real>(across: &mut [Complex<T>], rest: &[Complex<T>]) {
    for (across, rest) in across.iter_mut().zip(rest) {
        *across = Complex::new(rest.im, -rest.re);
    }
}

/// [`SeriesNumber::products`](super::SeriesNumber::products) of any number.
#[inline]
pub fn products<T: Real>(n: usize, a: &[Complex<T>], b: &[Complex<T>], sums: &mut [Complex<T>]) {
    for (k, sum) in sums.iter_mut().enumerate() {
        let (a, b) = (a[k.min(a.len())..].iter().step_by(n), b[k.min(b.len())..].iter().step_by(n).rev());
        *sum = a
            .zip(b)
            .fold(Complex::ZERO, |sum, (a, b)| Complex::new(sum.re + a.re * b.re, sum.im + a.im * b.im));
    }
}

/// The same of plain doubles, in lanes.
#[inline]
pub fn products_in_lanes(n: usize, a: &[Complex<f64>], b: &[Complex<f64>], sums: &mut [Complex<f64>]) {
    lanes::run(Products { n, a, b, sums }, false);
}

struct Products<'a> {
    n: usize,
    a: &'a [Complex<f64>],
    b: &'a [Complex<f64>],
    sums: &'a mut [Complex<f64>],
}

impl Code for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { n, a, b, sums } = self;
        let count = sums.len();
        let mut first = 0;
        if count >= BLOCK {
            while first < count {
                // The last block begins earlier and does some elements again, to the same bits.
                first = first.min(count - BLOCK);
                block::<L>(n, first, a, b, &mut sums[first..first + BLOCK]);
                first += BLOCK;
            }
            return;
        }
        for k in 0..count {
            let mut sum = L::ZERO;
            for (a, b) in a.chunks_exact(n).zip(b.chunks_exact(n).rev()) {
                sum = L::of([a[k].re, a[k].im, 0.0, 0.0]).mul_add(L::of([b[k].re, b[k].im, 0.0, 0.0]), sum);
            }
            let [re, im, ..] = sum.array();
            sums[k] = Complex::new(re, im);
        }
    }
}

/// The elements of one block.
#[inline(always)]
fn block<L: Lanes>(
    n: usize,
    first: usize,
    a: &[Complex<f64>],
    b: &[Complex<f64>],
    sums: &mut [Complex<f64>],
) {
    let mut sum = [L::ZERO; BLOCK / 2];
    for (a, b) in a.chunks_exact(n).zip(b.chunks_exact(n).rev()) {
        let (a, b) = (&a[first..first + BLOCK], &b[first..first + BLOCK]);
        for v in 0..BLOCK / 2 {
            sum[v] = pair::<L>(&a[2 * v..2 * v + 2]).mul_add(pair(&b[2 * v..2 * v + 2]), sum[v]);
        }
    }
    for v in 0..BLOCK / 2 {
        let [a, b, c, d] = sum[v].array();
        (sums[2 * v], sums[2 * v + 1]) = (Complex::new(a, b), Complex::new(c, d));
    }
}

/// Two elements as one vector.
#[inline(always)]
fn pair<L: Lanes>(two: &[Complex<f64>]) -> L {
    L::of([two[0].re, two[0].im, two[1].re, two[1].im])
}
