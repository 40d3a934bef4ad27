//! Stages by Newton's method, where iterations contract slowly or not at all.
//!
//! ```text
//! R_j = h b_j f(Y_j) - L_j,      (1 - h A⊗J) dK = R/(h b),      L_j += h b_j dK_j
//!     J at the middle of the step, once a step
//! A = Σ mu_k r_k l_k,  l_k r_k = 1:    dK = Σ r_k (1 - h mu_k J)^-1 l_k R/(h b)
//!     pairs of complex modes share their factors
//! ```
//!
//! The residual is that of the iterations, at the end in pairs of doubles, so that what is solved for is the
//! same to the last bit but one; the update takes the last correction along, because a rest of the residual
//! would act on fast modes h rho times.
//!
//! Source: E. Hairer, G. Wanner, *Solving Ordinary Differential Equations II*, 2nd ed. (1996), section IV.8
//! (the transformation of the linear systems); M. Antoñana, J. Makazaga, A. Murua, *Efficient implementation
//! of symplectic implicit Runge–Kutta schemes with simplified Newton iterations*, Numer. Algorithms 78
//! (2018).

use super::tableau::{GaussTableau, lane};
use crate::arithmetic::Complex;
use crate::arithmetic::eight::Octet;
use crate::stepping::linear::{LuFactors, MatrixEntry};
use nalgebra::{DMatrix, linalg::Schur};

/// A mode of A; of a pair of complex ones that above the real axis.
#[derive(Clone, Debug)]
struct GaussMode {
    value: Complex<f64>,
    right: Vec<Complex<f64>>,
    left: Vec<Complex<f64>>,
    /// What its real part counts: two for one of a pair.
    weight: f64,
}

/// What Newton's method needs beside the scratch space of the iterations; made when the first step asks for
/// it.
#[derive(Clone, Debug)]
pub(super) struct Newton {
    modes: Vec<GaussMode>,
    /// The collocation polynomial of one step carried on over the next, from increments to increments (s ×
    /// s).
    forecast: Vec<f64>,
    /// J (d × d).
    pub jacobian: Vec<f64>,
    factors: Vec<LuFactors<Complex<f64>>>,
    wide: Vec<Complex<f64>>,
    /// R, stage by stage, then the corrections of L (s × d).
    pub correction: Vec<f64>,
}

/// The largest |mu|: iterations contract by about h rho times that.
pub(super) fn largest_mode(tableau: &GaussTableau) -> f64 {
    values(tableau).iter().fold(0.0, |most: f64, value| most.max(value.norm_squared().sqrt()))
}

/// The eigenvalues of A on and above the real axis.
fn values(tableau: &GaussTableau) -> Vec<Complex<f64>> {
    let s = tableau.nodes.len();
    let a = DMatrix::from_fn(s, s, |i, j| tableau.entry(i, j));
    let values = Schur::try_new(a, f64::EPSILON, 1000).map(|schur| schur.complex_eigenvalues());
    let values = values.iter().flat_map(|values| values.iter());
    values.map(|value| Complex::new(value.re, value.im)).filter(|value| value.im > -1e-9).collect()
}

impl Newton {
    pub fn new(tableau: &GaussTableau) -> Self {
        let s = tableau.nodes.len();
        let a: Vec<f64> = (0..s * s).map(|at| tableau.entry(at / s, at % s)).collect();
        let transposed: Vec<f64> = (0..s * s).map(|at| a[at % s * s + at / s]).collect();
        let modes = values(tableau).into_iter().map(|value| {
            // A little off, so that the matrix is not singular; inverse iteration gains as many digits a
            // round.
            let off = value.times(1.0 + 1e-7);
            let vector = |matrix: &[f64]| {
                let mut factors = LuFactors::default();
                factors.of_shifted(off.reciprocal(), matrix, s);
                let mut x = vec![Complex::new(1.0, 0.5); s];
                for _ in 0..4 {
                    factors.solve(&mut x);
                    let size = x.iter().map(|x| x.norm_squared()).sum::<f64>().sqrt();
                    x.iter_mut().for_each(|x| *x = x.times(1.0 / size));
                }
                x
            };
            let (right, mut left) = (vector(&a), vector(&transposed));
            let one = right.iter().zip(&left).fold(Complex::ZERO, |sum: Complex<f64>, (&r, &l)| sum + r * l);
            left.iter_mut().for_each(|l| *l = *l * one.reciprocal());
            GaussMode { value, right, left, weight: if value.im > 1e-9 { 2.0 } else { 1.0 } }
        });
        let modes: Vec<GaussMode> = modes.collect();
        Self {
            factors: vec![LuFactors::default(); modes.len()],
            modes,
            forecast: (0..s * s).map(|at| tableau.carried(at / s, at % s)).collect(),
            jacobian: Vec::new(),
            wide: Vec::new(),
            correction: Vec::new(),
        }
    }

    /// Increments from those of the last step, or from one rate for all stages where there is none.
    pub fn predict(&self, last: &[f64], s: usize, rate: &[f64], span: &Octet, increment: &mut [Octet]) {
        for (k, increment) in increment.iter_mut().enumerate() {
            for i in 0..s {
                let at = lane(i, s);
                increment.0[at] = match last.get(k * s..(k + 1) * s) {
                    Some(last) => (0..s).fold(0.0, |sum, j| sum + self.forecast[i * s + j] * last[j]),
                    None => span.0[at] * rate[k],
                };
            }
        }
    }

    /// The factors of 1 - h mu J, one a mode.
    pub fn factor(&mut self, h: f64, d: usize) {
        for (factors, mode) in self.factors.iter_mut().zip(&self.modes) {
            factors.of_shifted(mode.value.times(h), &self.jacobian, d);
        }
        self.wide.resize(d, Complex::ZERO);
    }

    /// The residual in `correction` becomes the correction of L.
    pub fn solve(&mut self, span: &Octet, s: usize, d: usize) {
        let spans: Vec<f64> = (0..s).map(|i| span.0[lane(i, s)]).collect();
        for (i, residual) in self.correction.chunks_exact_mut(d).enumerate() {
            residual.iter_mut().for_each(|entry| *entry /= spans[i]);
        }
        let mut solved = vec![0.0; s * d];
        for (factors, mode) in self.factors.iter().zip(&self.modes) {
            for k in 0..d {
                self.wide[k] = mode
                    .left
                    .iter()
                    .enumerate()
                    .fold(Complex::ZERO, |sum, (i, l)| sum + l.times(self.correction[i * d + k]));
            }
            factors.solve(&mut self.wide);
            for (i, right) in mode.right.iter().enumerate() {
                for k in 0..d {
                    solved[i * d + k] +=
                        mode.weight * spans[i] * (right.re * self.wide[k].re - right.im * self.wide[k].im);
                }
            }
        }
        self.correction = solved;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_modes_make_up_the_matrix() {
        for s in 2..=8 {
            let tableau = GaussTableau::new(s);
            let newton = Newton::new(&tableau);
            assert_eq!(newton.modes.len(), s.div_ceil(2));
            for i in 0..s {
                for j in 0..s {
                    let entry: f64 = newton
                        .modes
                        .iter()
                        .map(|mode| mode.weight * (mode.value * mode.right[i] * mode.left[j]).re)
                        .sum();
                    // The vectors of eight stages are far from orthogonal; for an iteration that corrects
                    // itself this is plenty.
                    let off = (entry - tableau.entry(i, j)).abs();
                    assert!(off < 1e-8, "{i}, {j} of s = {s}: {off:e}");
                }
            }
            // |mu| of the implicit midpoint's neighbours: 0.289 for s = 2 (1/√12), falling with s.
            let largest = largest_mode(&tableau);
            assert!(largest < 0.2887 && largest > 0.05, "s = {s}: {largest}");
        }
        assert!((largest_mode(&GaussTableau::new(2)) - 1.0 / 12.0_f64.sqrt()).abs() < 1e-12);
    }
}
