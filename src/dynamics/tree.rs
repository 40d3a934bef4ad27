//! The hinge trees in absolute angles and, of those that hang on nothing, the positions of their
//! translational coordinates: mass matrix, velocity terms, gravity.
//!
//! ```text
//! p_ij = conj(z_i) H_ij z_j = A cos(q_j-q_i) - B sin(q_j-q_i) + i (A sin(q_j-q_i) + B cos(q_j-q_i))
//! M_ij = Re p_ij, M_ii = d_i;        b_i += w_j² Im p_ij,  b_j -= w_i² Im p_ij   for i < j
//! origin f, coordinates x and y:  p_if = conj(z_i) H_if,  M_ix = Im p_if, M_iy = Re p_if, M_xx = M_yy = d_f;
//!     b_x + i b_y += w_i² conj(p_if)
//! ```
//!
//! Loops run over `N` bodies where `N > 0`, so that small sizes are unrolled, and over the number at hand
//! where `N = 0`.

use super::force::CompiledSpring;
use crate::arithmetic::{Complex, Over, Scalar};

/// `N`, or the number at hand where `N` is 0.
#[inline(always)]
pub fn size<const N: usize>(n: usize) -> usize {
    if N == 0 { n } else { N }
}

/// Constants of the tree, formed once per scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Tree<C = f64> {
    /// Number of coordinates n: the bodies' angles, then two for every origin that moves freely.
    pub coordinates: usize,
    /// Number of bodies.
    pub angles: usize,
    /// H above the diagonal, row by row (n × n) \[kg·m²; kg·m for an origin, in the column of its x\]; empty
    /// for very large trees.
    pub coupling: Vec<Complex<C>>,
    /// Diagonal d_i = H_ii + I_i \[kg·m²; kg for an origin\].
    pub diagonal: Vec<C>,
    /// Force of gravity on z_i: conj(Σ_m m_m gamma_mi) g \[N·m; N for an origin, at its x\].
    pub weight: Vec<Complex<C>>,
    /// False where every hinge and centre of mass lies on its body's axis: B = 0, and its products are left
    /// out.
    pub off_axis: bool,
}

impl<C: Scalar> Tree<C> {
    /// True where H is there; very large trees go without it.
    pub fn is_dense(&self) -> bool {
        self.coupling.len() == self.coordinates * self.coordinates
    }
}

impl Tree {
    /// About the fastest rate of small oscillations under gravity and springs between hanging bodies
    /// \[rad/s\], for hinges on the bodies' axes.
    ///
    /// Stretched, the chain has the least inertia against bending: the trace of M⁻¹ W there is about the
    /// square of its fastest rate, and that of M⁻¹ K at most k (Σ |gamma_i| (M⁻¹)_ii^(1/2))² for each spring.
    pub fn fastest_rate(&self, springs: &[CompiledSpring]) -> f64 {
        let mobility = self.mobility();
        let gravity: f64 = self.weight[..self.angles]
            .iter()
            .zip(&mobility)
            .map(|(weight, mobility)| weight.norm_squared().sqrt() * mobility)
            .sum();
        let moved = |spring: &CompiledSpring| {
            spring
                .span
                .terms
                .iter()
                .map(|&(i, gamma)| (gamma.norm_squared() * mobility[i]).sqrt())
                .sum::<f64>()
        };
        let pulled: f64 = springs.iter().map(|spring| spring.stiffness * moved(spring).powi(2)).sum();
        (gravity + pulled).sqrt()
    }

    /// The diagonal of M⁻¹ of the stretched chain \[1/(kg·m²)\].
    pub fn mobility(&self) -> Vec<f64> {
        let n = self.coordinates;
        let mut mass: Vec<f64> = self.coupling.iter().map(|h| h.re).collect();
        for i in 0..n {
            mass[i * n + i] = self.diagonal[i];
        }
        let mut pivot = vec![0.0; n];
        factor::<f64, 0>(n, &mut mass, &mut pivot);
        let mobility = |i: usize| {
            let mut unit = vec![0.0; n];
            unit[i] = 1.0;
            solve::<f64, 0>(n, &mass, &pivot, &mut unit);
            unit[i]
        };
        (0..n).map(mobility).collect()
    }
}

impl<C: Scalar> Tree<C> {
    /// Writes M above and on the diagonal and Im p above it, both row by row (n × n) \[kg·m²\].
    #[inline(always)]
    pub fn mass_matrix<T: Over<C>, const N: usize>(&self, z: &[Complex<T>], mass: &mut [T], twist: &mut [T]) {
        let (n, angles) = (size::<N>(self.coordinates), size::<N>(self.angles));
        let (z, coupling, diagonal) = (&z[..n], &self.coupling[..n * n], &self.diagonal[..n]);
        let (mass, twist) = (&mut mass[..n * n], &mut twist[..n * n]);
        for i in 0..angles {
            mass[i * n + i] = T::constant(diagonal[i]);
            for j in i + 1..angles {
                let h = coupling[i * n + j];
                let (cos, sin) = (z[i].dot(z[j]), z[i].cross(z[j]));
                mass[i * n + j] = cos.by(h.re);
                twist[i * n + j] = sin.by(h.re);
                if self.off_axis {
                    mass[i * n + j] -= sin.by(h.im);
                    twist[i * n + j] += cos.by(h.im);
                }
            }
        }
        if N == 0 {
            self.translational_mass_terms(z, mass, twist);
        }
    }

    /// The entries of translational coordinates; the twist holds conj(p) in the columns of x and y.
    #[inline(always)]
    fn translational_mass_terms<T: Over<C>>(&self, z: &[Complex<T>], mass: &mut [T], twist: &mut [T]) {
        let (n, angles) = (self.coordinates, self.angles);
        for x in (angles..n).step_by(2) {
            for i in 0..angles {
                let p = z[i].conj().turn(self.coupling[i * n + x]);
                (mass[i * n + x], mass[i * n + x + 1]) = (p.im, p.re);
                (twist[i * n + x], twist[i * n + x + 1]) = (p.re, -p.im);
            }
            for i in angles..n {
                (mass[i * n + x], mass[i * n + x + 1]) = (T::ZERO, T::ZERO);
            }
            (mass[x * n + x], mass[(x + 1) * n + x + 1]) =
                (T::constant(self.diagonal[x]), T::constant(self.diagonal[x]));
        }
    }

    /// Writes the velocity terms and gravity \[N·m\].
    #[inline(always)]
    pub fn velocity_and_gravity_forces<T: Over<C>, const N: usize>(
        &self,
        z: &[Complex<T>],
        omega: &[T],
        twist: &[T],
        load: &mut [T],
    ) {
        let (n, angles) = (size::<N>(self.coordinates), size::<N>(self.angles));
        self.gravity_forces::<T, N>(z, load);
        let (omega, twist, load) = (&omega[..n], &twist[..n * n], &mut load[..n]);
        for i in 0..angles {
            for j in i + 1..angles {
                load[i] += twist[i * n + j] * (omega[j] * omega[j]);
                load[j] -= twist[i * n + j] * (omega[i] * omega[i]);
            }
            for x in angles..n {
                load[x] += twist[i * n + x] * (omega[i] * omega[i]);
            }
        }
    }

    /// Writes d(T - V)/dq \[N·m\] without springs, at fixed rates: the force of the canonical form.
    #[inline(always)]
    pub fn lagrangian_forces<T: Over<C>, const N: usize>(
        &self,
        z: &[Complex<T>],
        omega: &[T],
        twist: &[T],
        force: &mut [T],
    ) {
        self.gravity_forces::<T, N>(z, force);
        self.velocity_terms::<T, N>(omega, twist, force);
    }

    /// Adds dT/dq \[N·m\] at fixed rates.
    #[inline(always)]
    pub fn velocity_terms<T: Over<C>, const N: usize>(&self, omega: &[T], twist: &[T], force: &mut [T]) {
        let (n, angles) = (size::<N>(self.coordinates), size::<N>(self.angles));
        let (omega, twist, force) = (&omega[..n], &twist[..n * n], &mut force[..n]);
        for i in 0..angles {
            for j in i + 1..angles {
                let velocity_terms = twist[i * n + j] * (omega[i] * omega[j]);
                force[i] += velocity_terms;
                force[j] -= velocity_terms;
            }
            for x in angles..n {
                force[i] -= twist[i * n + x] * (omega[i] * omega[x]);
            }
        }
    }

    /// Writes the generalized forces of gravity \[N·m\].
    #[inline(always)]
    fn gravity_forces<T: Over<C>, const N: usize>(&self, z: &[Complex<T>], force: &mut [T]) {
        let (n, angles) = (size::<N>(self.coordinates), size::<N>(self.angles));
        let (z, weight, force) = (&z[..n], &self.weight[..n], &mut force[..n]);
        for i in 0..angles {
            force[i] = z[i].cross(Complex::of(weight[i]));
        }
        for x in (angles..n).step_by(2) {
            (force[x], force[x + 1]) = (T::constant(weight[x].re), T::constant(weight[x].im));
        }
    }

    /// Elements at these coordinates: unit vectors, and translational coordinates at the place of their x.
    #[inline(always)]
    pub fn unit_vectors<T: Over<C>, const N: usize>(&self, phi: &[T], z: &mut [Complex<T>]) {
        let (n, angles) = (size::<N>(self.coordinates), size::<N>(self.angles));
        let (z, phi) = (&mut z[..n], &phi[..n]);
        for k in 0..angles {
            z[k] = Complex::unit(phi[k]);
        }
        for x in (angles..n).step_by(2) {
            (z[x], z[x + 1]) = (Complex::new(phi[x], phi[x + 1]), Complex::ZERO);
        }
    }

    /// Potential energy of gravity \[J\], less the constant of the ground points.
    #[inline(always)]
    pub fn gravity_energy<T: Over<C>>(&self, z: &[Complex<T>]) -> T {
        z.iter().zip(&self.weight).fold(T::ZERO, |sum, (z, &weight)| sum - z.dot(Complex::of(weight)))
    }
}

/// M = L D Lᵀ with unit upper L, eliminated from the last body (the leaves) to the first, in place above the
/// diagonal.
///
/// Writes the reciprocal pivots; they come out non-finite or negative where M is not positive definite.
#[inline(always)]
pub fn factor<T: Scalar, const N: usize>(bodies: usize, mass: &mut [T], pivot: &mut [T]) {
    let n = size::<N>(bodies);
    let (mass, pivot) = (&mut mass[..n * n], &mut pivot[..n]);
    for k in (0..n).rev() {
        pivot[k] = T::ONE / mass[k * n + k];
        eliminate(n, mass, k, pivot[k]);
    }
}

/// The same of any symmetric matrix, `reciprocal` telling the reciprocal of a row's pivot, or zero where the
/// row is left out.  Not for vectors: where it is not inlined it calls each of their operations.
#[inline(always)]
pub fn factor_by<T: Scalar, const N: usize>(
    rows: usize,
    matrix: &mut [T],
    pivot: &mut [T],
    mut reciprocal: impl FnMut(usize, T) -> T,
) {
    let n = size::<N>(rows);
    let (matrix, pivot) = (&mut matrix[..n * n], &mut pivot[..n]);
    for k in (0..n).rev() {
        pivot[k] = reciprocal(k, matrix[k * n + k]);
        eliminate(n, matrix, k, pivot[k]);
    }
}

/// Takes row `k` out of those before it.
#[inline(always)]
fn eliminate<T: Scalar>(n: usize, matrix: &mut [T], k: usize, reciprocal: T) {
    for i in 0..k {
        let l = matrix[i * n + k] * reciprocal;
        for j in 0..=i {
            let full = matrix[j * n + k];
            matrix[j * n + i] -= l * full;
        }
    }
}

/// Solves M x = load in place with the factors of [`factor`].
#[inline(always)]
pub fn solve<T: Scalar, const N: usize>(bodies: usize, mass: &[T], pivot: &[T], load: &mut [T]) {
    let n = size::<N>(bodies);
    let (mass, pivot, load) = (&mass[..n * n], &pivot[..n], &mut load[..n]);
    for k in (1..n).rev() {
        let part = load[k] * pivot[k];
        for i in 0..k {
            load[i] -= mass[i * n + k] * part;
        }
    }
    for k in 0..n {
        let mut sum = load[k];
        for i in 0..k {
            sum -= mass[i * n + k] * load[i];
        }
        load[k] = sum * pivot[k];
    }
}

/// Writes M v from the part of M on and above the diagonal (before [`factor`]).
#[inline(always)]
pub fn multiply<T: Scalar, const N: usize>(bodies: usize, mass: &[T], v: &[T], product: &mut [T]) {
    let n = size::<N>(bodies);
    let (mass, v, product) = (&mass[..n * n], &v[..n], &mut product[..n]);
    for i in 0..n {
        product[i] = mass[i * n + i] * v[i];
    }
    for i in 0..n {
        for j in i + 1..n {
            product[i] += mass[i * n + j] * v[j];
            product[j] += mass[i * n + j] * v[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factors_solve_what_the_product_makes() {
        let mass = [4.0, 1.0, -0.5, 0.0, 3.0, 0.25, 0.0, 0.0, 2.0];
        let x = [1.0, -2.0, 0.5];
        let mut load = [0.0; 3];
        multiply::<f64, 3>(3, &mass, &x, &mut load);
        let (mut factors, mut pivot) = (mass, [0.0; 3]);
        factor::<f64, 3>(3, &mut factors, &mut pivot);
        let mut again = load;
        solve::<f64, 3>(3, &factors, &pivot, &mut again);
        for k in 0..3 {
            assert!((again[k] - x[k]).abs() < 1e-15);
        }
        // The size known at run time gives the same bits.
        let (mut factors, mut pivot) = (mass, [0.0; 3]);
        factor::<f64, 0>(3, &mut factors, &mut pivot);
        solve::<f64, 0>(3, &factors, &pivot, &mut load);
        assert_eq!(load, again);
    }
}
