//! What the fast vibration of a very stiff spring does to the slow motion, where the spring is taken for a
//! rod.
//!
//! ```text
//! g = |D| - L,  G = dg/dq,  s = G M⁻¹ Gᵀ:      omega = sqrt(k s),   J = E_fast / omega stays as it is
//! V = J omega,   -dV/dq_i = -J sqrt(k / s) (u·dG/dq_i - uᵀ dM/dq_i u / 2),   u = M⁻¹ Gᵀ
//! E_fast = k g0²/2 + g0'²/(2 s0) at the start as the scene gives it
//! ```
//!
//! The energy of a fast vibration over its frequency is an adiabatic invariant, and what is left for the slow
//! motion is a potential.  The error falls as 1/omega.  Source: F. A. Bornemann, C. Schütte, "Homogenization
//! of Hamiltonian systems with a strong constraining potential", Physica D 102 (1997) 57–77.

use crate::arithmetic::{Complex, Scalar};
use crate::dynamics::Mechanism;
use crate::dynamics::kernel::dot;
use crate::dynamics::point::Point;
use crate::dynamics::tree::{self, Tree, size};

/// The fast vibration along a rigid spring of the compiled mechanism.
#[derive(Clone, Debug, PartialEq)]
pub struct Vibration {
    /// The spring's name in the scene.
    pub name: String,
    /// The span D = P_a - P_b.
    pub span: Point,
    /// k \[N/m\].
    pub stiffness: f64,
    /// J \[J·s\].
    pub action: f64,
    /// Energy at the start \[J\].
    pub energy: f64,
    /// omega at the start \[rad/s\].
    pub frequency: f64,
}

/// G, u, s and the unit vector along the span.
struct SpanTerms<T> {
    along: Complex<T>,
    length: T,
    inertia: T,
}

impl Vibration {
    /// Writes G to `slope` and M⁻¹ Gᵀ to `minv_jt`, from the factors of M.
    #[inline]
    fn find<T: Scalar, const N: usize>(
        &self,
        z: &[Complex<T>],
        (mass, pivot): (&[T], &[T]),
        slope: &mut [T],
        minv_jt: &mut [T],
    ) -> SpanTerms<T> {
        let span = self.span.position(z);
        let length = span.norm_squared().sqrt();
        let along = span.times(T::ONE / length);
        slope.fill(T::ZERO);
        self.span.pull(along, z, slope);
        minv_jt.copy_from_slice(slope);
        tree::solve::<T, N>(size::<N>(minv_jt.len()), mass, pivot, minv_jt);
        SpanTerms { along, length, inertia: dot(slope, minv_jt) }
    }

    /// Writes the generalized forces \[N·m, N\] to `force`; `factors` are those of M, `twist` is the one
    /// beside it, `minv_jt` takes u.
    #[inline]
    pub fn push<T: Scalar, const N: usize>(
        &self,
        tree: &Tree,
        z: &[Complex<T>],
        factors: (&[T], &[T]),
        twist: &[T],
        [force, minv_jt]: [&mut [T]; 2],
    ) {
        let SpanTerms { along, length, inertia } = self.find::<T, N>(z, factors, force, minv_jt);
        // dT/dq at the rates u, with the opposite sign, and the change of G along u.
        force.fill(T::ZERO);
        tree.velocity_terms::<T, N>(minv_jt, twist, force);
        for force in force.iter_mut() {
            *force = -*force;
        }
        let rate = self.span.velocity(z, minv_jt);
        let turning = (rate - along.times(along.dot(rate))).times(T::ONE / length);
        self.span.pull(turning, z, force);
        for &(k, gamma) in &self.span.terms {
            force[k] -= along.dot(z[k].turn(gamma)) * minv_jt[k];
        }
        let factor = (T::of(self.stiffness) / inertia).sqrt().scale(-self.action);
        for force in force {
            *force = *force * factor;
        }
    }

    /// omega \[rad/s\] at the elements `z`, where M above and on the diagonal is `mass`.
    pub fn frequency<T: Scalar>(&self, z: &[Complex<T>], mass: &[T]) -> T {
        self.frequency_and_inertia(z, mass).0
    }

    fn frequency_and_inertia<T: Scalar>(&self, z: &[Complex<T>], mass: &[T]) -> (T, T) {
        let (n, mut mass) = (z.len(), mass.to_vec());
        let [mut pivot, mut slope, mut minv_jt] = std::array::from_fn(|_| vec![T::ZERO; n]);
        tree::factor::<T, 0>(n, &mut mass, &mut pivot);
        let inertia = self.find::<T, 0>(z, (&mass, &pivot), &mut slope, &mut minv_jt).inertia;
        (inertia.scale(self.stiffness).sqrt(), inertia)
    }

    /// The potential V \[J\] at the elements `z`, where M above and on the diagonal is `mass`.
    pub fn potential<T: Scalar>(&self, z: &[Complex<T>], mass: &[T]) -> T {
        self.frequency(z, mass).scale(self.action)
    }

    /// The vibration with the energy that a start off the free length \[m\] gives it.
    pub(in crate::dynamics) fn started(
        mut self,
        mechanism: &Mechanism,
        free_length: f64,
        z: &[Complex<f64>],
        omega: &[f64],
    ) -> Self {
        let n = mechanism.coordinates();
        let (mut mass, mut twist) = (vec![0.0; n * n], vec![0.0; n * n]);
        mechanism.tree.mass_matrix::<f64, 0>(z, &mut mass, &mut twist);
        let (frequency, inertia) = self.frequency_and_inertia(z, &mass);
        let span = self.span.position(z);
        let length = span.norm_squared().sqrt();
        let (off, rate) = (length - free_length, span.dot(self.span.velocity(z, omega)) / length);
        self.energy = 0.5 * self.stiffness * off * off + 0.5 * rate * rate / inertia;
        (self.frequency, self.action) = (frequency, self.energy / frequency);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vibration() -> Vibration {
        let span =
            Point::ground([0.3, 0.1]).along(0, Complex::new(0.4, 0.0)).along(1, Complex::new(0.2, 0.1));
        Vibration { name: "s".into(), span, stiffness: 7e6, action: 0.03, energy: 0.0, frequency: 0.0 }
    }

    #[test]
    fn the_force_is_minus_the_gradient_of_the_potential() {
        let coupling = vec![Complex::ZERO, Complex::new(0.02, 0.005), Complex::ZERO, Complex::ZERO];
        let (diagonal, weight) = (vec![0.05, 0.03], vec![Complex::ZERO; 2]);
        let tree = Tree { coordinates: 2, angles: 2, coupling, diagonal, weight, off_axis: true };
        let potential = |phi: [f64; 2]| {
            let z = phi.map(Complex::unit);
            let (mut mass, mut twist) = ([0.0; 4], [0.0; 4]);
            tree.mass_matrix::<f64, 0>(&z, &mut mass, &mut twist);
            vibration().potential(&z, &mass)
        };
        let phi = [0.7, -1.9];
        let (z, mut mass, mut twist, mut pivot) = (phi.map(Complex::unit), [0.0; 4], [0.0; 4], [0.0; 2]);
        tree.mass_matrix::<f64, 0>(&z, &mut mass, &mut twist);
        tree::factor::<f64, 0>(2, &mut mass, &mut pivot);
        let (mut force, mut minv_jt) = ([0.0; 2], [0.0; 2]);
        vibration().push::<f64, 0>(&tree, &z, (&mass, &pivot), &twist, [&mut force, &mut minv_jt]);
        let h = 1e-5;
        for k in 0..2 {
            let at = |by: f64| potential(std::array::from_fn(|i| phi[i] + if i == k { by } else { 0.0 }));
            let slope = (at(h) - at(-h)) / (2.0 * h);
            assert!((force[k] + slope).abs() < 1e-7 * slope.abs(), "{k}: {} {slope}", force[k]);
        }
    }
}
