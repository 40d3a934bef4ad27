//! Series as factors of Cauchy products, for numbers whose products are more than a plain loop.
//!
//! Powers are handed over as they are found; products are asked for by their total power.  Doubles and
//! double-doubles have nothing of this: the series of those are multiplied where they stand.

use super::coefficient::SeriesNumber;
use crate::arithmetic::{Complex, Real, Scalar};
use crate::dynamics::tree::Tree;
use std::fmt::Debug;
use std::ops::RangeInclusive;

/// A series of numbers of one kind in the form in which it is multiplied.
pub trait CauchyFactor<T>: Clone + Debug {
    /// What all series of a step have in common.
    type Scale: Clone + Debug + Default;
    /// What is known of an odd order's products before that order.
    type Ahead: Clone + Debug + Default;

    /// Room for powers up to `order`.
    fn new(order: usize) -> Self;

    /// Forgets all powers.
    fn restart(&mut self, scale: &Self::Scale);

    /// Takes the next power.
    fn push(&mut self, scale: &Self::Scale, power: T);

    /// `Σ_j a_j b_{total-j}` over the powers `of` the first.
    fn product(&self, other: &Self, scale: &Self::Scale, total: usize, of: RangeInclusive<usize>) -> T;

    /// The products of two series with one.
    #[inline]
    fn products(
        pair: [&Self; 2],
        other: &Self,
        scale: &Self::Scale,
        total: usize,
        of: RangeInclusive<usize>,
    ) -> [T; 2] {
        [pair[0].product(other, scale, total, of.clone()), pair[1].product(other, scale, total, of)]
    }

    /// The product of the first ones of two pairs, and `sign` times that of the second ones.
    fn sum_of_products(
        pairs: [[&Self; 2]; 2],
        sign: f64,
        scale: &Self::Scale,
        total: usize,
        of: RangeInclusive<usize>,
    ) -> T;

    /// Order `m` of z w: the products of total power m+1 of two series with one, but for power 0 of the pair.
    #[inline(always)]
    fn turned(
        pair: [&Self; 2],
        other: &Self,
        scale: &Self::Scale,
        m: usize,
        _ahead: &mut Self::Ahead,
    ) -> [T; 2] {
        Self::products(pair, other, scale, m + 1, 1..=m + 1)
    }

    /// Order `m` of z × R, likewise: that of total power m.
    #[inline(always)]
    fn crossed(
        [a, b]: [&Self; 2],
        [c, d]: [&Self; 2],
        scale: &Self::Scale,
        m: usize,
        _ahead: &mut Self::Ahead,
    ) -> T {
        Self::sum_of_products([[a, d], [b, c]], -1.0, scale, m, 1..=m)
    }

    /// False where the powers grow by more than products are made for.
    fn is_sound(&self) -> bool;
}

/// Of numbers that are multiplied where they stand: there is nothing to hand over.
impl<T: Real> CauchyFactor<T> for () {
    type Scale = ();
    type Ahead = ();

    fn new(_order: usize) -> Self {}

    fn restart(&mut self, _scale: &()) {}

    fn push(&mut self, _scale: &(), _power: T) {}

    fn product(&self, _other: &(), _scale: &(), _total: usize, _of: RangeInclusive<usize>) -> T {
        T::ZERO
    }

    fn sum_of_products(
        _pairs: [[&(); 2]; 2],
        _sign: f64,
        _scale: &(),
        _total: usize,
        _of: RangeInclusive<usize>,
    ) -> T {
        T::ZERO
    }

    fn is_sound(&self) -> bool {
        true
    }
}

/// Of numbers that are multiplied one by one.
impl<T: Real> CauchyFactor<T> for Vec<T> {
    type Scale = ();
    type Ahead = ();

    fn new(order: usize) -> Self {
        Self::with_capacity(order + 1)
    }

    fn restart(&mut self, _scale: &()) {
        self.clear();
    }

    fn push(&mut self, _scale: &(), power: T) {
        Self::push(self, power);
    }

    fn product(&self, other: &Self, _scale: &(), total: usize, of: RangeInclusive<usize>) -> T {
        of.fold(T::ZERO, |sum, j| sum + self[j] * other[total - j])
    }

    fn sum_of_products(
        [[a, b], [c, d]]: [[&Self; 2]; 2],
        sign: f64,
        scale: &(),
        total: usize,
        of: RangeInclusive<usize>,
    ) -> T {
        a.product(b, scale, total, of.clone()) + c.product(d, scale, total, of).scale(sign)
    }

    fn is_sound(&self) -> bool {
        true
    }
}

/// A number whose series are factors of Cauchy products.
pub trait Factored: Real {
    /// A series of them as such a factor.
    type Factor: CauchyFactor<Self>;
}

/// What is known of an odd order's products before that order.
type Ahead<T> = <<T as Factored>::Factor as CauchyFactor<T>>::Ahead;

/// What all series of a step have in common.
pub type Scale<T> = <<T as Factored>::Factor as CauchyFactor<T>>::Scale;

/// A series of vectors as a factor.
#[derive(Clone, Debug)]
pub struct VectorFactor<T: SeriesNumber> {
    re: T::Factor,
    im: T::Factor,
}

impl<T: SeriesNumber> VectorFactor<T> {
    /// Room for powers up to `order`.
    pub fn new(order: usize) -> Self {
        Self { re: T::Factor::new(order), im: T::Factor::new(order) }
    }

    /// Forgets all powers.
    #[inline]
    pub fn restart(&mut self, scale: &Scale<T>) {
        self.re.restart(scale);
        self.im.restart(scale);
    }

    /// Takes the next power.
    #[inline(always)]
    pub fn push(&mut self, scale: &Scale<T>, power: Complex<T>) {
        self.re.push(scale, power.re);
        self.im.push(scale, power.im);
    }

    /// The product with a series of numbers.
    #[inline(always)]
    pub fn times(
        &self,
        other: &T::Factor,
        scale: &Scale<T>,
        total: usize,
        of: RangeInclusive<usize>,
    ) -> Complex<T> {
        let [re, im] = T::Factor::products([&self.re, &self.im], other, scale, total, of);
        Complex::new(re, im)
    }

    /// [`CauchyFactor::turned`] by a series of numbers.
    #[inline(always)]
    pub fn turned(&self, other: &T::Factor, scale: &Scale<T>, m: usize, ahead: &mut Ahead<T>) -> Complex<T> {
        let [re, im] = T::Factor::turned([&self.re, &self.im], other, scale, m, ahead);
        Complex::new(re, im)
    }

    /// [`CauchyFactor::crossed`] with a series of vectors.
    #[inline(always)]
    pub fn crossed(&self, other: &Self, scale: &Scale<T>, m: usize, ahead: &mut Ahead<T>) -> T {
        T::Factor::crossed([&self.re, &self.im], [&other.re, &other.im], scale, m, ahead)
    }

    /// The dot product with a series of vectors.
    #[inline(always)]
    pub fn dot(&self, other: &Self, scale: &Scale<T>, total: usize, of: RangeInclusive<usize>) -> T {
        let pairs = [[&self.re, &other.re], [&self.im, &other.im]];
        T::Factor::sum_of_products(pairs, 1.0, scale, total, of)
    }

    /// The cross product with a series of vectors.
    #[inline(always)]
    pub fn cross(&self, other: &Self, scale: &Scale<T>, total: usize, of: RangeInclusive<usize>) -> T {
        let pairs = [[&self.re, &other.im], [&self.im, &other.re]];
        T::Factor::sum_of_products(pairs, -1.0, scale, total, of)
    }

    /// False where the powers grow by more than products are made for.
    pub fn is_sound(&self) -> bool {
        self.re.is_sound() && self.im.is_sound()
    }
}

/// A row of H without its diagonal: columns and entries.
pub(super) type Coupled<C> = Vec<(usize, Complex<C>)>;

/// The series of a mechanism's bodies as factors: none of numbers that are multiplied where they stand.
#[derive(Clone, Debug)]
pub struct BodyFactors<T: SeriesNumber> {
    pub(super) scale: Scale<T>,
    /// z, w, R, s' and torques of the bodies.
    pub(super) z: Vec<VectorFactor<T>>,
    pub(super) omega: Vec<T::Factor>,
    pub(super) rest: Vec<VectorFactor<T>>,
    pub(super) drive: Vec<T::Factor>,
    pub(super) torque: Vec<T::Factor>,
    /// What is known of the next order, body by body.
    pub(super) ahead: Vec<Ahead<T>>,
    /// H beside the diagonal, row by row, where it is real: column, entry, and true where that has
    /// derivatives; empty for numbers whose couplings are looked up in the tree.
    pub(super) coupling: Vec<Vec<(usize, T, bool)>>,
    /// H beside the diagonal, row by row, of numbers that sum products with it so: column and entry.
    pub(super) coupled: Vec<Coupled<T::Constant>>,
}

impl<T: SeriesNumber> BodyFactors<T> {
    /// Room for so many bodies, up to power `order` of the rates.
    pub fn new(bodies: usize, is_tied: bool, order: usize) -> Self {
        let bodies = if T::HAS_CONSTANTS { bodies } else { 0 };
        let numbers = |count: usize| vec![T::Factor::new(order + 1); count];
        let vectors = || vec![VectorFactor::new(order + 1); bodies];
        let driven = if is_tied { bodies } else { 0 };
        Self {
            scale: Scale::<T>::default(),
            z: vectors(),
            omega: numbers(bodies),
            rest: vectors(),
            drive: numbers(driven),
            torque: numbers(driven),
            ahead: vec![Ahead::<T>::default(); bodies],
            coupling: Vec::new(),
            coupled: Vec::new(),
        }
    }

    /// Takes the couplings of a tree.
    pub fn couple(&mut self, tree: &Tree<T::Constant>) {
        let n = tree.coordinates;
        if T::HAS_ROWS {
            let entry = |i: usize, j: usize| {
                let h = tree.coupling[i.min(j) * n + i.max(j)];
                let is_there = i != j && h != Complex::ZERO;
                is_there.then(|| (j, if j > i { h } else { h.conj() }))
            };
            self.coupled = (0..n).map(|i| (0..n).filter_map(|j| entry(i, j)).collect()).collect();
        }
        if !T::HAS_COUPLINGS || tree.off_axis || !tree.is_dense() {
            return;
        }
        let entry = |i: usize, j: usize| {
            let constant = tree.coupling[i.min(j) * n + i.max(j)].re;
            let is_there = i != j && constant != T::Constant::ZERO;
            is_there.then(|| (j, T::constant(constant), constant != T::Constant::of(constant.value())))
        };
        self.coupling = (0..n).map(|i| (0..n).filter_map(|j| entry(i, j)).collect()).collect();
    }

    /// Power zero of the rates, powers zero and one of the unit vectors, of `n` elements each, and all powers
    /// of s'.
    #[inline(always)]
    pub fn begin(&mut self, n: usize, z: &[Complex<T>], omega: &[T], drive: &[T]) {
        let scale = &self.scale;
        for (i, factor) in self.z.iter_mut().enumerate() {
            factor.restart(scale);
            factor.push(scale, z[i]);
            factor.push(scale, z[n + i]);
        }
        for (factor, &omega) in self.omega.iter_mut().zip(omega) {
            factor.restart(scale);
            factor.push(scale, omega);
        }
        self.rest.iter_mut().for_each(|factor| factor.restart(scale));
        self.torque.iter_mut().for_each(|factor| factor.restart(scale));
        for (i, factor) in self.drive.iter_mut().enumerate() {
            factor.restart(scale);
            drive[i..].iter().step_by(n).for_each(|&power| factor.push(scale, power));
        }
    }

    /// The next powers of unit vectors, rates and R.
    #[inline(always)]
    pub fn push(&mut self, z: &[Complex<T>], omega: &[T], rest: &[Complex<T>]) {
        let scale = &self.scale;
        for i in 0..self.z.len() {
            self.z[i].push(scale, z[i]);
            self.omega[i].push(scale, omega[i]);
            self.rest[i].push(scale, rest[i]);
        }
    }

    /// False where the powers of a series grow by more than products are made for.
    pub fn are_sound(&self) -> bool {
        let mut vectors = self.z.iter().chain(&self.rest);
        let mut numbers = self.omega.iter().chain(&self.drive).chain(&self.torque);
        vectors.all(VectorFactor::is_sound) && numbers.all(CauchyFactor::is_sound)
    }
}
