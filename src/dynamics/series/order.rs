//! One order of the recurrence: the factored matrices, the right sides, and the solution with what it
//! completes.

use super::action;
use super::factors::{BodyFactors, Coupled};
use super::polynomial::{UNROLLED, convolve, width};
use super::{PowersAt, Series, SeriesNumber, Terms};
use crate::arithmetic::Complex;
use crate::arithmetic::lanes::wide::SlotTask;
use crate::dynamics::schur;
use crate::dynamics::tree::{self, Tree, size};
use std::ops::Range;

/// A part of an order that is compiled by itself.
enum OrderPart<'a, 'b, T: SeriesNumber> {
    Factors { series: &'a mut Series<T>, terms: &'a Terms<'b, T::Constant> },
    Forces { series: &'a mut Series<T>, terms: &'a Terms<'b, T::Constant>, m: usize },
    Rows { series: &'a mut Series<T>, m: usize },
}

impl<T: SeriesNumber> SlotTask for OrderPart<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn perform(self) {
        match self {
            Self::Factors { series, terms } => series.factor_rows(terms),
            Self::Forces { series, terms, m } => series.other_forces(terms, m),
            Self::Rows { series, m } => series.solve_rows(m),
        }
    }
}

impl<T: SeriesNumber> Series<T> {
    /// Where R_m is, of `n` elements; where series are factors of products, their powers before are there.
    #[inline(always)]
    pub(super) fn row(m: usize, n: usize) -> Range<usize> {
        let m = if T::HAS_CONSTANTS { 0 } else { m };
        m * n..(m + 1) * n
    }

    /// The factors of M_0, and those of the rows.
    #[inline(always)]
    pub(super) fn factor<const N: usize>(&mut self, terms: &Terms<T::Constant>) {
        let n = size::<N>(self.elements);
        if N == 0
            && let Some(bodywise) = &mut self.bodywise
        {
            bodywise.factor(&self.z[..n], &self.omega[..n]);
            self.rows.prepare_bodywise(&mut bodywise.evaluation, &self.z[..n]);
            return;
        }
        self.factor_mass::<N>(terms);
        if T::HAS_INVERSE {
            self.invert();
        }
        if !self.rows.is_empty() {
            T::perform(OrderPart::Factors { series: self, terms });
        }
    }

    /// The factors of M_0, where there are matrices.
    #[inline(always)]
    pub(super) fn factor_mass<const N: usize>(&mut self, terms: &Terms<T::Constant>) {
        let (n, f) = (size::<N>(self.elements), self.partition.count());
        terms.tree.mass_matrix::<T, N>(&self.z[..n], &mut self.mass, &mut self.twist);
        if self.is_tied {
            self.partition.reduce(&self.mass, &mut self.reduced);
            tree::factor::<T, 0>(f, &mut self.reduced, &mut self.pivot);
        } else {
            self.reduced.copy_from_slice(&self.mass);
            tree::factor::<T, N>(n, &mut self.reduced, &mut self.pivot);
        }
    }

    /// The inverse of the factored matrix: an order then waits for one sum, not for passes there and back.
    #[inline(always)]
    fn invert(&mut self) {
        let f = self.partition.count();
        self.inverse.fill(T::ZERO);
        for (c, column) in self.inverse.chunks_exact_mut(f.max(1)).enumerate() {
            column[c] = T::ONE;
            tree::solve::<T, 0>(f, &self.reduced, &self.pivot, column);
        }
    }

    /// The product of the inverse, which is symmetric, with the solution so far: its right side.
    #[inline(always)]
    fn by_inverse<const N: usize>(&mut self) {
        let f = if self.is_tied { self.partition.count() } else { size::<N>(self.elements) };
        let (right, solution) = (&mut self.right[..f], &mut self.solution[..f]);
        right.copy_from_slice(solution);
        rows_times(&self.inverse[..f * f], right, solution);
    }

    /// The factors of the rows.
    #[inline(always)]
    fn factor_rows(&mut self, terms: &Terms<T::Constant>) {
        let (n, f) = (self.elements, self.partition.count());
        if T::HAS_BORDER {
            self.rows.factor(&self.z[..n], &self.reduced, &self.pivot);
            return self.rows.border_inverse(&self.inverse[..f * f]);
        }
        self.rows.prepare(&self.partition, &self.z[..n], &self.reduced, &self.pivot);
        let diagonal = &terms.structure.tree.diagonal;
        let diagonal = self.partition.independent.iter().map(|&body| diagonal[body]);
        self.rows.mark(schur::is_deep(&self.pivot[..f], diagonal));
    }

    /// Multipliers of order m, and the accelerations with them.
    #[inline(always)]
    fn solve_rows(&mut self, m: usize) {
        let n = self.elements;
        if T::HAS_BORDER {
            self.rows.solve_bordered(m, &self.z, &self.bend, &mut self.solution);
        } else {
            self.rows.solve(m, &self.z, &self.bend, &mut self.solution);
        }
        self.rows.push(m, &self.z[..n], &mut self.rest[Self::row(m, n)]);
    }

    /// f_{m+1} into `turned` and u_m into `bend`; the driven part of a_m, where there is one, is in it.
    #[inline(always)]
    pub(super) fn bend<const N: usize>(&mut self, m: usize) {
        let (n, angles) = (size::<N>(self.elements), size::<N>(self.angles));
        let (omega, z) = (&self.omega[..(m + 1) * n], &self.z[n..(m + 2) * n]);
        let (turned, bend) = (&mut self.turned[..n], &mut self.bend[..n]);
        let factor = T::of((m + 1) as f64);
        bend[angles..].fill(Complex::ZERO);
        if T::HAS_CONSTANTS {
            let BodyFactors { scale, z, omega, ahead, .. } = &mut self.factors;
            for i in 0..angles {
                let sum = z[i].turned(&omega[i], scale, m, &mut ahead[i]);
                let left = sum.left();
                let times = |x: T| x.scale((m + 1) as f64);
                (turned[i], bend[i]) = (sum, Complex::new(times(left.re), times(left.im)));
            }
            return;
        }
        let mut first = 0;
        while first < angles {
            let sums = convolve::<N, _, _, _>(n, first, omega, z, |w, z| z.times(w));
            for i in 0..width::<N>() {
                turned[first + i] = sums[i];
                bend[first + i] = sums[i].left().times(factor);
            }
            first += width::<N>();
        }
    }

    /// R_m, and the load -Σ Im(conj(z) R) of this order into `load`.
    #[inline(always)]
    pub(super) fn balance<const N: usize>(&mut self, terms: &Terms<T::Constant>, m: usize) {
        let (n, angles) = (size::<N>(self.elements), size::<N>(self.angles));
        self.load[..n].fill(T::ZERO);
        if self.is_tied {
            // The known part of a_m: s'' of this order.
            for i in 0..angles {
                let given = self.drive[(m + 1) * n + i] * T::of((m + 1) as f64);
                self.load[i] = -given.by(terms.tree.diagonal[i]);
                self.bend[i] += self.z[i].left().times(given);
            }
        }
        self.gravity_forces(terms, m);
        mass_terms::<T, N>(terms.tree, &self.factors, &self.bend, &mut self.rest[Self::row(m, n)]);
        self.force(terms, m);
        let (before, rest) = self.rest.split_at_mut(Self::row(m, n).start);
        let rest = &mut rest[..n];
        let (z, load) = (&self.z[..(m + 1) * n], &mut self.load[..n]);
        for x in (angles..n).step_by(2) {
            load[x] -= rest[x].re;
            load[x + 1] -= rest[x].im;
        }
        if T::HAS_CONSTANTS {
            // Of l = 0 only, R is not complete yet.
            let BodyFactors { scale, z: factors, rest: known, ahead, .. } = &mut self.factors;
            for k in 0..angles {
                let sum = factors[k].crossed(&known[k], scale, m, &mut ahead[k]);
                load[k] -= sum + z[k].cross(rest[k]);
            }
            return;
        }
        let mut first = 0;
        while first < angles {
            // Of l = 0 only, R is not complete yet.
            let sums: [T; UNROLLED] =
                convolve::<N, _, _, _>(n, first, &z[n..], before, |z, rest| z.cross(rest));
            for i in 0..width::<N>() {
                let k = first + i;
                load[k] -= sums[i] + z[k].cross(rest[k]);
            }
            first += width::<N>();
        }
    }

    /// Gravity in R_m, and nothing else.
    #[inline(always)]
    pub(super) fn gravity_forces(&mut self, terms: &Terms<T::Constant>, m: usize) {
        for (rest, &weight) in self.rest[Self::row(m, self.elements)].iter_mut().zip(&terms.tree.weight) {
            *rest = if m == 0 { -Complex::of(weight) } else { Complex::ZERO };
        }
    }

    /// Adds what all other forces leave in R_m, and torques to the load.
    #[inline(always)]
    pub(super) fn force(&mut self, terms: &Terms<T::Constant>, m: usize) {
        let n = self.elements;
        let rest = &mut self.rest[Self::row(m, n)];
        let mut on_bodies = self.friction.as_mut().map(|friction| &mut friction.applied[..]);
        if let Some(on_bodies) = &mut on_bodies {
            on_bodies.fill(Complex::ZERO);
        }
        for (spring, series) in terms.springs.iter().zip(&mut self.springs) {
            let force = series.force(spring, m, &self.z, n, &self.factors.scale);
            spring.span.take_off(force, rest);
            if let Some(on_bodies) = &mut on_bodies {
                let ends = spring.bodies.iter().zip([force, -force]);
                ends.for_each(|(body, force)| body.iter().for_each(|&body| on_bodies[body] += force));
            }
        }
        T::perform(OrderPart::Forces { series: self, terms, m });
    }

    /// All but springs.
    #[inline(always)]
    fn other_forces(&mut self, terms: &Terms<T::Constant>, m: usize) {
        let n = self.elements;
        let rest = &mut self.rest[Self::row(m, n)];
        let mut on_bodies = self.friction.as_mut().map(|friction| &mut friction.applied[..]);
        if !terms.torsions.is_empty() || !self.actions.is_empty() || !self.forces.is_empty() {
            let applied = &mut self.applied[m * n..(m + 1) * n];
            applied.fill(T::ZERO);
            for torsion in terms.torsions {
                torsion.pull(action::twist(torsion, m, &self.phi, &self.omega, n), applied);
            }
            for (action, series) in terms.actions.iter().zip(&mut self.actions) {
                series.act(action, m, &self.z, n, (rest, applied), &self.factors.scale);
                if let Some(on_bodies) = &mut on_bodies {
                    on_bodies[action.body] += series.force(m);
                }
            }
            let at = PowersAt { time: self.time, phi: &self.phi, z: &self.z, omega: &self.omega, n };
            for (force, series) in terms.forces.iter().zip(&mut self.forces) {
                series.act(force, m, at, (&mut *rest, &mut *applied), &self.factors.scale);
                if let Some(on_bodies) = &mut on_bodies {
                    series.forces(force, m, |body, force| on_bodies[body] += force);
                }
            }
            for (load, &applied) in self.load.iter_mut().zip(applied.iter()) {
                *load += applied;
            }
        }
        self.rows.geometric_terms(m, &self.z, n, rest);
        if m > 0 {
            let at = PowersAt { time: self.time, phi: &self.phi, z: &self.z, omega: &self.omega, n };
            self.rows.advance_aims(m, at, &self.factors.scale, &mut self.load);
        }
        if let Some(friction) = &self.friction {
            friction.geometric_terms(m, &self.z, n, rest);
        }
    }

    /// a_m from the loads, the newest powers of w and z, and R_m completed.
    #[inline(always)]
    pub(super) fn solve<const N: usize>(&mut self, terms: &Terms<T::Constant>, m: usize) {
        let (n, f) = (size::<N>(self.elements), self.partition.count());
        let angles = size::<N>(self.angles);
        if self.is_tied {
            self.partition.gather(&self.load, &mut self.solution);
        } else {
            self.solution[..n].copy_from_slice(&self.load[..n]);
        }
        let is_bordered = T::HAS_BORDER && !self.rows.is_empty();
        if is_bordered {
            // The loads are half of a right side.
        } else if T::HAS_INVERSE {
            self.by_inverse::<N>();
        } else if self.is_tied {
            tree::solve::<T, 0>(f, &self.reduced, &self.pivot, &mut self.solution);
        } else {
            tree::solve::<T, N>(n, &self.reduced, &self.pivot, &mut self.solution);
        }
        if !self.rows.is_empty() {
            T::perform(OrderPart::Rows { series: self, m });
        }
        let rest = &mut self.rest[Self::row(m, n)];
        if let Some(&limbs) = self.limbs.get(m + 1) {
            self.solution.iter_mut().for_each(|x| *x = x.kept(limbs));
            self.turned.iter_mut().for_each(|x| *x = Complex::new(x.re.kept(limbs), x.im.kept(limbs)));
        }
        for c in 0..f {
            self.rate[(m + 1) * f + c] = self.fractions.over(self.solution[c], m + 1);
        }
        let (known, newest) = self.z.split_at_mut((m + 2) * n);
        let (z, newest) = (&known[..n], &mut newest[..n]);
        let omega = &mut self.omega[(m + 1) * n..(m + 2) * n];
        if self.is_tied {
            for (i, dependent_angle) in self.partition.bodies.iter().enumerate() {
                let (solved, rate) = dependent_angle
                    .base
                    .map_or((T::ZERO, T::ZERO), |base| (self.solution[base], self.rate[(m + 1) * f + base]));
                omega[i] = rate + self.drive[(m + 1) * n + i];
                self.bend[i] =
                    if i < angles { z[i].left().times(solved) } else { Complex::new(solved, T::ZERO) };
            }
            for x in (angles..n).step_by(2) {
                self.bend[x].im = self.bend[x + 1].re;
            }
        } else {
            omega.copy_from_slice(&self.rate[(m + 1) * n..(m + 2) * n]);
            for i in 0..angles {
                self.bend[i] = z[i].left().times(self.solution[i]);
            }
            for x in (angles..n).step_by(2) {
                self.bend[x] = Complex::new(self.solution[x], self.solution[x + 1]);
            }
        }
        for x in (angles..n).step_by(2) {
            newest[x] = self.fractions.vector_over(Complex::new(omega[x], omega[x + 1]), m + 2);
        }
        for i in 0..angles {
            newest[i] = self.fractions.vector_over((self.turned[i] + z[i].times(omega[i])).left(), m + 2);
        }
        mass_terms::<T, N>(terms.tree, &self.factors, &self.bend, rest);
    }

    /// Takes what order m has come to into the factors of products.
    #[inline(always)]
    pub(super) fn push_factors(&mut self, m: usize) {
        let n = self.elements;
        let newest = &self.z[(m + 2) * n..(m + 3) * n];
        let omega = &self.omega[(m + 1) * n..(m + 2) * n];
        self.factors.push(newest, omega, &self.rest[..n]);
    }
}

/// The product of a square matrix and a vector of at least one number: four sums at a time, none of which
/// waits for another.
#[inline(always)]
pub(super) fn rows_times<T: SeriesNumber>(matrix: &[T], x: &[T], product: &mut [T]) {
    let n = x.len();
    let product = &mut product[..n];
    let mut c = 0;
    while c + 4 <= n {
        let (a, b) = (&matrix[c * n..(c + 1) * n], &matrix[(c + 1) * n..(c + 2) * n]);
        let (d, e) = (&matrix[(c + 2) * n..(c + 3) * n], &matrix[(c + 3) * n..(c + 4) * n]);
        let (mut p, mut q, mut r, mut s) = (x[0] * a[0], x[0] * b[0], x[0] * d[0], x[0] * e[0]);
        for j in 1..n {
            p = p.with_product(x[j], a[j], true);
            q = q.with_product(x[j], b[j], true);
            r = r.with_product(x[j], d[j], true);
            s = s.with_product(x[j], e[j], true);
        }
        (product[c], product[c + 1], product[c + 2], product[c + 3]) = (p, q, r, s);
        c += 4;
    }
    while c < n {
        let row = &matrix[c * n..(c + 1) * n];
        let mut sum = x[0] * row[0];
        for j in 1..n {
            sum = sum.with_product(x[j], row[j], true);
        }
        product[c] = sum;
        c += 1;
    }
}

/// Adds H x to `rest`, without the diagonal.
#[inline(always)]
fn mass_terms<T: SeriesNumber, const N: usize>(
    tree: &Tree<T::Constant>,
    factors: &BodyFactors<T>,
    x: &[Complex<T>],
    rest: &mut [Complex<T>],
) {
    if T::HAS_ROWS {
        return mass_rows(&factors.coupled, tree.off_axis, x, rest);
    }
    let (n, rows) = (size::<N>(tree.coordinates), &factors.coupling);
    if T::HAS_COUPLINGS && !rows.is_empty() {
        for (rest, row) in rest.iter_mut().zip(rows) {
            let mut sum = *rest;
            for &(j, constant, is_varied) in row {
                sum.re = sum.re.with_product(x[j].re, constant, is_varied);
                sum.im = sum.im.with_product(x[j].im, constant, is_varied);
            }
            *rest = sum;
        }
        return;
    }
    let (coupling, x, rest) = (&tree.coupling[..n * n], &x[..n], &mut rest[..n]);
    for i in 0..n {
        for j in i + 1..n {
            let h = coupling[i * n + j];
            if tree.off_axis {
                rest[i] += x[j].turn(h);
                rest[j] += x[i].turn(h.conj());
            } else {
                rest[i] += Complex::new(x[j].re.by(h.re), x[j].im.by(h.re));
                rest[j] += Complex::new(x[i].re.by(h.re), x[i].im.by(h.re));
            }
        }
    }
}

/// The same row by row, whose sums stay in registers.
#[inline(always)]
fn mass_rows<T: SeriesNumber>(
    coupled: &[Coupled<T::Constant>],
    off_axis: bool,
    x: &[Complex<T>],
    rest: &mut [Complex<T>],
) {
    for (rest, row) in rest.iter_mut().zip(coupled) {
        let mut sum = *rest;
        for &(j, h) in row {
            let x = x[j];
            sum.re = sum.re.with_constant(x.re, h.re);
            sum.im = sum.im.with_constant(x.im, h.re);
            if off_axis {
                sum.re = sum.re.less_constant(x.im, h.im);
                sum.im = sum.im.with_constant(x.re, h.im);
            }
        }
        *rest = sum;
    }
}
