//! A point of the mechanism as a linear functional of its elements: `P = p0 + Σ gamma_k z_k + Σ ± zeta_f`.
//!
//! Elements are the bodies' unit vectors z_k and, of bodies that hang on nothing, the positions zeta = x + iy
//! of their translational coordinates.  Everything that acts at a point (hinge, spring, wall, motor) is built
//! from this list alone:
//!
//! ```text
//! P'  = Σ i gamma_k z_k w_k + Σ ± zeta_f'
//! P'' = Σ i gamma_k z_k a_k + Σ ± zeta_f'' + Pi,     Pi = -Σ gamma_k z_k w_k²
//! a force F at P has the generalized force Im(conj(z_k) conj(gamma_k) F) on body k, and ± F on zeta_f
//! ```

use crate::arithmetic::{Complex, Over, Real};

/// A point, or the difference of two points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Point<C = f64> {
    /// The constant part p0 \[m\].
    pub root: Complex<C>,
    /// Body and gamma_k \[m\], in rising order of the bodies.
    pub terms: Vec<(usize, Complex<C>)>,
    /// First coordinate of an origin that moves freely, and how often it counts: 1, or -1.
    pub shifts: Vec<(usize, f64)>,
}

impl<C: Real> Point<C> {
    /// A point of the ground.
    pub fn ground(at: [C; 2]) -> Self {
        Self { root: Complex::new(at[0], at[1]), ..Self::default() }
    }

    /// The origin whose coordinates are `x` and the one after it.
    pub fn floating(x: usize) -> Self {
        Self { shifts: vec![(x, 1.0)], ..Self::default() }
    }

    /// The point `offset` \[m, in the body's directions\] away on body `body`.
    pub fn along(&self, body: usize, offset: Complex<C>) -> Self {
        let mut point = self.clone();
        match point.terms.binary_search_by_key(&body, |term| term.0) {
            Ok(i) => point.terms[i].1 += offset,
            Err(i) => point.terms.insert(i, (body, offset)),
        }
        point.terms.retain(|term| term.1 != Complex::ZERO);
        point
    }

    /// The vector from `other` to this point.
    pub fn minus(&self, other: &Self) -> Self {
        let (mut mine, mut others) =
            (self.terms.iter().copied().peekable(), other.terms.iter().copied().peekable());
        let mut terms = Vec::with_capacity(self.terms.len() + other.terms.len());
        // Both lists rise; equal terms cancel exactly.
        while let Some(first) = mine.peek().into_iter().chain(others.peek()).map(|term| term.0).min() {
            let plus = mine.next_if(|term| term.0 == first).map_or(Complex::ZERO, |term| term.1);
            let minus = others.next_if(|term| term.0 == first).map_or(Complex::ZERO, |term| term.1);
            terms.push((first, plus - minus));
        }
        terms.retain(|term| term.1 != Complex::ZERO);
        let mut difference = Self { root: self.root - other.root, terms, shifts: self.shifts.clone() };
        for &(x, share) in &other.shifts {
            match difference.shifts.iter().position(|shift| shift.0 == x) {
                Some(same) => difference.shifts[same].1 -= share,
                None => difference.shifts.push((x, -share)),
            }
        }
        difference.shifts.retain(|shift| shift.1 != 0.0);
        difference
    }

    /// gamma of a body, zero where the point does not depend on it.
    pub fn gamma(&self, body: usize) -> Complex<C> {
        self.terms.binary_search_by_key(&body, |term| term.0).map_or(Complex::ZERO, |i| self.terms[i].1)
    }

    /// P \[m\] at the elements `z`.
    #[inline(always)]
    pub fn position<T: Over<C>>(&self, z: &[Complex<T>]) -> Complex<T> {
        self.sum(Complex::of(self.root), z)
    }

    /// P' \[m/s\].
    #[inline(always)]
    pub fn velocity<T: Over<C>>(&self, z: &[Complex<T>], omega: &[T]) -> Complex<T> {
        let turned = self
            .terms
            .iter()
            .fold(Complex::ZERO, |sum, &(k, gamma)| sum + z[k].turn(gamma).left().times(omega[k]));
        self.shifts
            .iter()
            .fold(turned, |sum, &(x, share)| sum + Complex::new(omega[x], omega[x + 1]).times(T::of(share)))
    }

    /// P'' at zero angular acceleration \[m/s²\].
    #[inline(always)]
    pub fn convective<T: Over<C>>(&self, z: &[Complex<T>], omega: &[T]) -> Complex<T> {
        self.terms
            .iter()
            .fold(Complex::ZERO, |sum, &(k, gamma)| sum - z[k].turn(gamma).times(omega[k] * omega[k]))
    }

    /// P'' \[m/s²\].
    pub fn acceleration<T: Over<C>>(&self, z: &[Complex<T>], omega: &[T], alpha: &[T]) -> Complex<T> {
        self.velocity(z, alpha) + self.convective(z, omega)
    }

    /// The force \[N·m, N\] on each element, of a force \[N\] that acts here.
    #[inline(always)]
    pub fn spread<T: Over<C>>(&self, force: Complex<T>, mut each: impl FnMut(usize, Complex<T>)) {
        for &(k, gamma) in &self.terms {
            each(k, force.turn(gamma.conj()));
        }
        for &(x, share) in &self.shifts {
            each(x, force.times(T::of(share)));
        }
    }

    /// Takes the force \[N·m, N\] on each element, of a force \[N\] that acts here, off what is in `rest`.
    #[inline(always)]
    pub fn take_off<T: Over<C>>(&self, force: Complex<T>, rest: &mut [Complex<T>]) {
        for &(k, gamma) in &self.terms {
            rest[k] -= force.turn(gamma.conj());
        }
        for &(x, share) in &self.shifts {
            rest[x] -= force.times(T::of(share));
        }
    }

    /// P without its constant part, of one power of a series of the elements.
    #[inline(always)]
    pub fn turned<T: Over<C>>(&self, z: &[Complex<T>]) -> Complex<T> {
        self.sum(Complex::ZERO, z)
    }

    #[inline(always)]
    fn sum<T: Over<C>>(&self, start: Complex<T>, z: &[Complex<T>]) -> Complex<T> {
        let mut sum = start;
        for &(k, gamma) in &self.terms {
            sum += z[k].turn(gamma);
        }
        for &(x, share) in &self.shifts {
            sum += z[x].times(T::of(share));
        }
        sum
    }

    /// Adds the generalized forces \[N m\] of a force \[N\] that acts here.
    #[inline(always)]
    pub fn pull<T: Over<C>>(&self, force: Complex<T>, z: &[Complex<T>], load: &mut [T]) {
        for &(k, gamma) in &self.terms {
            load[k] += z[k].turn(gamma).cross(force);
        }
        for &(x, share) in &self.shifts {
            load[x] += force.re.scale(share);
            load[x + 1] += force.im.scale(share);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_the_derivatives_of_the_position() {
        let point =
            Point::ground([0.3, -0.2]).along(0, Complex::new(0.6, 0.1)).along(2, Complex::new(0.2, -0.4));
        let (phi, omega, alpha) = ([0.4, 9.0, -1.1], [1.5, 9.0, -0.7], [0.3, 9.0, 2.0]);
        let at = |t: f64| -> Vec<Complex<f64>> {
            (0..3).map(|k| Complex::unit(phi[k] + omega[k] * t + alpha[k] * t * t / 2.0)).collect()
        };
        let h = 1e-4;
        let (before, now, after) =
            (point.position(&at(-h)), point.position(&at(0.0)), point.position(&at(h)));
        let first = (after - before).times(0.5 / h) - point.velocity(&at(0.0), &omega);
        let second =
            (after + before - now - now).times(1.0 / (h * h)) - point.acceleration(&at(0.0), &omega, &alpha);
        assert!(first.norm_squared().sqrt() < 1e-7 && second.norm_squared().sqrt() < 1e-6);
    }

    #[test]
    fn a_force_does_the_work_its_generalized_force_does() {
        let point =
            Point::ground([0.0, 0.0]).along(0, Complex::new(0.6, 0.1)).along(1, Complex::new(0.2, -0.4));
        let (z, omega) = ([Complex::unit(0.4), Complex::unit(-1.0)], [1.5, -0.7]);
        let force = Complex::new(2.0, -3.0);
        let mut load = [0.0; 2];
        point.pull(force, &z, &mut load);
        let power = load[0] * omega[0] + load[1] * omega[1];
        assert!((power - force.dot(point.velocity(&z, &omega))).abs() < 1e-15);
    }
}
