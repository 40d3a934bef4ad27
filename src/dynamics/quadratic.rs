//! A quadratic function of the mechanism's elements, with everything a constraint equation asks of it.
//!
//! ```text
//! Q = c + Σ g_k·e_k + Σ Re(conj(e_j) h_jk e_k)
//!     e: unit vectors z_k, and translational coordinates zeta that move freely
//! gradient on e_k:  g_k + Σ_j conj(h_jk) e_j + Σ_j h_kj e_j                 dQ = Σ gradient_k·de_k
//! Q' = Σ gradient_k·e_k',   Q'' = Σ gradient_k·e_k'' + 2 Σ Re(conj(e_j') h_jk e_k')
//! e' = i z w, e'' = i z a - z w² of a unit vector;  e' = zeta', e'' = zeta'' of an origin
//! ```
//!
//! Points on lines of the ground are linear, points on lines of other bodies bilinear; nothing planar needs
//! more.

use super::constraint::{ConstraintArguments, Linearised};
use super::point::Point;
use crate::arithmetic::{Complex, Over, Real};

/// A quadratic function of unit vectors and translational coordinates \[m\].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Quadratic<C = f64> {
    /// Number of angles: elements from this one on are translational coordinates.
    pub angles: usize,
    /// c \[m\].
    pub constant: C,
    /// Element and g_k \[m; 1 for an origin\].
    pub linear: Vec<(usize, Complex<C>)>,
    /// Elements j and k, and h_jk.
    pub bilinear: Vec<(usize, usize, Complex<C>)>,
}

impl<C: Real> Quadratic<C> {
    /// Re(conj(n) P): how far a point is along a direction of the ground.
    pub fn along(point: &Point<C>, direction: Complex<C>, angles: usize) -> Self {
        let turning = point.terms.iter().map(|&(k, gamma)| (k, gamma.conj() * direction));
        let carried = point.shifts.iter().map(|&(x, share)| (x, direction.times(C::of(share))));
        Self {
            angles,
            constant: direction.dot(point.root),
            linear: turning.chain(carried).collect(),
            bilinear: Vec::new(),
        }
    }

    /// Re(conj(d z_b) D): how far a vector reaches along a direction d of body b.
    pub fn along_body(span: &Point<C>, body: usize, direction: Complex<C>, angles: usize) -> Self {
        let turned = direction.conj();
        let mut found = Self { angles, linear: vec![(body, turned * span.root)], ..Self::default() };
        for &(k, gamma) in &span.terms {
            // |z_b| = 1.
            match k == body {
                true => found.constant += (turned * gamma).re,
                false => found.bilinear.push((body, k, turned * gamma)),
            }
        }
        found.bilinear.extend(span.shifts.iter().map(|&(x, share)| (body, x, turned.times(C::of(share)))));
        found.linear.retain(|term| term.1 != Complex::ZERO);
        found
    }

    /// share |D|² of a vector.
    pub fn square(span: &Point<C>, share: C, angles: usize) -> Self {
        let carried = span.shifts.iter().map(|&(x, times)| (x, Complex::new(C::of(times), C::ZERO)));
        let terms: Vec<_> = span.terms.iter().copied().chain(carried).collect();
        let mut found = Self { angles, constant: share * span.root.norm_squared(), ..Self::default() };
        for (place, &(j, gamma)) in terms.iter().enumerate() {
            found.linear.push((j, (gamma.conj() * span.root).times(C::of(2.0) * share)));
            // |z_j| = 1.
            match j < angles {
                true => found.constant += share * gamma.norm_squared(),
                false => found.bilinear.push((j, j, Complex::new(share * gamma.norm_squared(), C::ZERO))),
            }
            let others = terms[place + 1..].iter();
            found
                .bilinear
                .extend(others.map(|&(k, other)| (j, k, (gamma.conj() * other).times(C::of(2.0) * share))));
        }
        found.linear.retain(|term| term.1 != Complex::ZERO);
        found
    }

    /// The coordinates it depends on; some may come up more than once.
    pub fn coordinates(&self) -> Vec<usize> {
        let elements =
            self.linear.iter().map(|term| term.0).chain(self.bilinear.iter().flat_map(|&(j, k, _)| [j, k]));
        elements.flat_map(|k| std::iter::once(k).chain((k >= self.angles).then_some(k + 1))).collect()
    }

    /// Q at the elements `z`.
    #[inline]
    pub fn value<T: Over<C>>(&self, z: &[Complex<T>]) -> T {
        let linear = self
            .linear
            .iter()
            .fold(T::constant(self.constant), |sum, &(k, g)| sum + Complex::of(g).dot(z[k]));
        self.bilinear.iter().fold(linear, |sum, &(j, k, h)| sum + z[j].dot(z[k].turn(h)))
    }

    /// Gradients, element by element; an element may come up more than once.
    #[inline(always)]
    pub fn gradients<T: Over<C>>(&self, z: &[Complex<T>], mut each: impl FnMut(usize, Complex<T>)) {
        for &(k, g) in &self.linear {
            each(k, Complex::of(g));
        }
        for &(j, k, h) in &self.bilinear {
            each(k, z[j].turn(h.conj()));
            each(j, z[k].turn(h));
        }
    }

    /// Parts of dQ/dq, coordinate by coordinate; a coordinate may come up more than once.
    #[inline(always)]
    pub fn slopes<T: Over<C>>(&self, z: &[Complex<T>], mut each: impl FnMut(usize, T)) {
        self.gradients(z, |k, gradient| {
            if k < self.angles {
                each(k, gradient.dot(z[k].left()));
            } else {
                each(k, gradient.re);
                each(k + 1, gradient.im);
            }
        });
    }

    /// Power m >= 1 of Q, from the powers of `n` elements.
    pub fn power<T: Over<C>>(&self, m: usize, z: &[Complex<T>], n: usize) -> T {
        let linear = self.linear.iter().fold(T::ZERO, |sum, &(k, g)| sum + Complex::of(g).dot(z[m * n + k]));
        let product = |j: usize, k: usize, h: Complex<C>| {
            (0..m + 1).fold(T::ZERO, |sum, l| sum + z[l * n + j].dot(z[(m - l) * n + k].turn(h)))
        };
        self.bilinear.iter().fold(linear, |sum, &(j, k, h)| sum + product(j, k, h))
    }

    /// Q'' at zero acceleration.
    #[inline]
    pub fn convective<T: Over<C>>(&self, z: &[Complex<T>], omega: &[T]) -> T {
        let mut sum = T::ZERO;
        self.gradients(z, |k, gradient| {
            if k < self.angles {
                sum -= gradient.dot(z[k]) * (omega[k] * omega[k]);
            }
        });
        let rate = |k: usize| {
            if k < self.angles { z[k].left().times(omega[k]) } else { Complex::new(omega[k], omega[k + 1]) }
        };
        self.bilinear.iter().fold(sum, |sum, &(j, k, h)| sum + rate(j).dot(rate(k).turn(h)).scale(2.0))
    }

    /// What a row with C = Q - s(t) is at this configuration, without s; adds its Jacobian to `jacobian`.
    #[inline]
    pub fn linearise<T: Real + Over<C>>(
        &self,
        at: ConstraintArguments<T>,
        jacobian: &mut [T],
    ) -> Linearised<T> {
        Linearised { position: self.value(at.z), ..self.differentiate(at, jacobian) }
    }

    /// The same without Q itself.
    #[inline]
    pub fn differentiate<T: Real + Over<C>>(
        &self,
        at: ConstraintArguments<T>,
        jacobian: &mut [T],
    ) -> Linearised<T> {
        self.slopes(at.z, |k, slope| jacobian[k] += slope);
        Linearised { position: T::ZERO, drive: T::ZERO, convective: self.convective(at.z, at.omega) }
    }
}
