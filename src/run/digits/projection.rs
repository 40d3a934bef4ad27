//! The constraints of a motion in many digits: the start brought onto them, and every step put back.
//!
//! ```text
//! position:  q ← q - M⁻¹ Gᵀ S⁻¹ C,  S = G M⁻¹ Gᵀ,   until C is rounding;    rates:  w ← w - M⁻¹ Gᵀ S⁻¹ C'
//! start:     only coordinates the scene leaves open move; of those it gives,
//!     the last ones where that is not enough
//! ```

use super::precision::Precision;
use super::wall::travel_rate;
use crate::arithmetic::digits::Digits;
use crate::arithmetic::shown::about;
use crate::arithmetic::sum::larger;
use crate::arithmetic::{Real, Scalar};
use crate::dynamics::compile::exact::ExactMechanism;
use crate::dynamics::constraint::ConstraintArguments;
use crate::dynamics::kernel::dot;
use crate::dynamics::{schur, tree};
use crate::stepping::{Cause, StepError};

/// Newton iterations at most.
const MOST: usize = 24;
/// Share of a row below which an entry of the Jacobian is no pivot for the start.
const LEAST_PIVOT: f64 = 1e-6;

/// Room for the constraints.
#[derive(Clone, Debug)]
pub struct DigitsProjection<const W: usize> {
    rows: usize,
    jacobian: Vec<Digits<W>>,
    minv_jt: Vec<Digits<W>>,
    schur: Vec<Digits<W>>,
    pivot: Vec<Digits<W>>,
    mass: Vec<Digits<W>>,
    twist: Vec<Digits<W>>,
    mass_pivot: Vec<Digits<W>>,
    scale: Vec<f64>,
    /// log2 of what counts as rounding.
    rounding: f64,
    /// log2 of the share of an inverse mass that constraints leave, below which they leave nothing.
    no_freedom: f64,
}

impl<const W: usize> DigitsProjection<W> {
    /// For a mechanism.
    pub fn new(mechanism: &ExactMechanism<Digits<W>>, precision: Precision) -> Self {
        let (r, n) = (mechanism.constraints.len(), mechanism.structure.coordinates());
        let zeros = |size: usize| vec![Digits::ZERO; size];
        Self {
            rows: r,
            jacobian: zeros(r * n),
            minv_jt: zeros(r * n),
            schur: zeros(r * r),
            pivot: zeros(r),
            mass: zeros(n * n),
            twist: zeros(n * n),
            mass_pivot: zeros(n),
            scale: mechanism.structure.row_scales(),
            rounding: -64.0 * (precision.limbs - 1) as f64 + 24.0,
            no_freedom: precision.rounding(1.0),
        }
    }

    /// Brings the start onto the constraints.
    ///
    /// # Errors
    /// That is not possible near what is given.
    pub fn assemble(
        &mut self,
        mechanism: &ExactMechanism<Digits<W>>,
        [phi, omega]: [&mut Vec<Digits<W>>; 2],
        given: &[Vec<bool>; 2],
    ) -> Result<(), StepError> {
        for (level, given) in given.iter().enumerate() {
            let mut size = f64::INFINITY;
            for _ in 0..MOST {
                let residuals = self.residuals(mechanism, Digits::ZERO, phi, omega);
                let left: Vec<_> = residuals.iter().map(|residual| residual[level]).collect();
                let now = largest(&left);
                if now <= self.rounding || now >= size - 1.0 {
                    size = size.min(now);
                    break;
                }
                size = now;
                let correction = self.correction(left, given);
                let values = if level == 0 { &mut *phi } else { &mut *omega };
                for (value, correction) in values.iter_mut().zip(correction) {
                    *value -= correction;
                }
            }
            if size > 0.5 * self.rounding {
                let what = format!("the start is off its constraints by {}", about(libm::exp2(size)));
                let hint = "give fewer of its angles and rates, or such as fit";
                return Err(stop(0.0, what, hint));
            }
        }
        Ok(())
    }

    /// Changes of coordinates that take residuals away: elimination with the coordinates that are not given
    /// as pivots first, then the given ones, the last first.
    fn correction(&self, mut left: Vec<Digits<W>>, given: &[bool]) -> Vec<Digits<W>> {
        let n = given.len();
        let mut matrix = self.jacobian.clone();
        let mut free: Vec<usize> = (0..self.rows).collect();
        let mut change = vec![Digits::ZERO; n];
        let mut pivots = Vec::new();
        let order = (0..n).rev().filter(|&k| !given[k]).chain((0..n).rev().filter(|&k| given[k]));
        for column in order {
            let size = |r: usize| matrix[r * n + column].log2();
            let Some(&row) = free.iter().max_by(|&&a, &&b| size(a).total_cmp(&size(b))) else { break };
            let entries = &self.jacobian[row * n..(row + 1) * n];
            let least = libm::log2(LEAST_PIVOT) + entries.iter().map(Digits::log2).fold(f64::MIN, f64::max);
            if size(row) < least || size(row) == f64::NEG_INFINITY {
                continue;
            }
            free.retain(|&other| other != row);
            let pivot = matrix[row * n + column];
            for other in (0..self.rows).filter(|&other| other != row) {
                let share = matrix[other * n + column] / pivot;
                if share.is_zero() {
                    continue;
                }
                for k in 0..n {
                    let part = share * matrix[row * n + k];
                    matrix[other * n + k] -= part;
                }
                let part = share * left[row];
                left[other] -= part;
            }
            pivots.push((row, column));
        }
        for (row, column) in pivots {
            change[column] = left[row] / matrix[row * n + column];
        }
        change
    }

    /// Residuals and their rates; leaves the Jacobian.
    pub(super) fn residuals(
        &mut self,
        mechanism: &ExactMechanism<Digits<W>>,
        t: Digits<W>,
        phi: &[Digits<W>],
        omega: &[Digits<W>],
    ) -> Vec<[Digits<W>; 2]> {
        self.jacobian.fill(Digits::ZERO);
        mechanism.residuals(t, phi, omega, &mut self.jacobian)
    }

    /// Sizes of all residuals \[rad, m\] and of their rates.
    pub fn left(
        &mut self,
        mechanism: &ExactMechanism<Digits<W>>,
        t: Digits<W>,
        phi: &[Digits<W>],
        omega: &[Digits<W>],
    ) -> Vec<[f64; 2]> {
        let residuals = self.residuals(mechanism, t, phi, omega);
        residuals.into_iter().map(|levels| levels.map(|residual| libm::exp2(residual.log2()))).collect()
    }

    /// Puts positions and rates back onto the constraints.
    ///
    /// # Errors
    /// They are too far off.
    pub fn project(
        &mut self,
        mechanism: &ExactMechanism<Digits<W>>,
        t: Digits<W>,
        phi: &mut [Digits<W>],
        omega: &mut [Digits<W>],
    ) -> Result<(), StepError> {
        let mut size = f64::INFINITY;
        for _ in 0..MOST {
            let residuals = self.residuals(mechanism, t, phi, omega);
            let mut left: Vec<_> = residuals.iter().map(|residual| residual[0]).collect();
            let now = largest(&left);
            if now.is_nan() {
                break;
            }
            if now <= self.rounding || now >= size - 1.0 {
                let mut rates: Vec<_> = residuals.iter().map(|residual| residual[1]).collect();
                self.factor(mechanism, phi);
                self.take_off(&mut rates, omega);
                return Ok(());
            }
            size = now;
            self.factor(mechanism, phi);
            self.take_off(&mut left, phi);
        }
        let what = "the constraints cannot be met at the end of a step".to_owned();
        Err(stop(t.value(), what, "more digits carry nearer to a singular position"))
    }

    /// The factors of M and of S, where the Jacobian stands.
    pub(super) fn factor(&mut self, mechanism: &ExactMechanism<Digits<W>>, phi: &[Digits<W>]) {
        self.factor_mass(mechanism, phi);
        let n = phi.len();
        self.minv_jt.copy_from_slice(&self.jacobian);
        for row in self.minv_jt.chunks_exact_mut(n) {
            tree::solve::<Digits<W>, 0>(n, &self.mass, &self.mass_pivot, row);
        }
        schur::product(self.rows, &self.jacobian, &self.minv_jt, &mut self.schur);
        schur::factor::<Digits<W>, 0>(self.rows, &mut self.schur, &mut self.pivot, &self.scale);
    }

    fn factor_mass(&mut self, mechanism: &ExactMechanism<Digits<W>>, phi: &[Digits<W>]) {
        let z = mechanism.elements(phi);
        mechanism.tree.mass_matrix::<Digits<W>, 0>(&z, &mut self.mass, &mut self.twist);
        tree::factor::<Digits<W>, 0>(phi.len(), &mut self.mass, &mut self.mass_pivot);
    }

    /// x - M⁻¹ Gᵀ S⁻¹ left.
    fn take_off(&self, left: &mut [Digits<W>], x: &mut [Digits<W>]) {
        let n = x.len();
        tree::solve::<Digits<W>, 0>(self.rows, &self.schur, &self.pivot, left);
        for (multiplier, minv_jt) in left.iter().zip(self.minv_jt.chunks_exact(n)) {
            for (x, &entry) in x.iter_mut().zip(minv_jt) {
                *x -= entry * *multiplier;
            }
        }
    }

    /// Lets rows take hold at a position: changes the rates to the nearest in kinetic energy that all of
    /// them allow, and returns the work of motors \[J\] and the impulses sigma.
    ///
    /// ```text
    /// M (w⁺ - w⁻) + Gᵀ sigma = 0,   G w⁺ = s'(t)         work = -sigma · s'
    /// ```
    pub(super) fn close(
        &mut self,
        mechanism: &ExactMechanism<Digits<W>>,
        t: Digits<W>,
        phi: &[Digits<W>],
        omega: &mut [Digits<W>],
    ) -> (Digits<W>, Vec<Digits<W>>) {
        let residuals = self.residuals(mechanism, t, phi, omega);
        self.factor(mechanism, phi);
        let mut impulses: Vec<_> = residuals.iter().map(|residual| residual[1]).collect();
        self.take_off(&mut impulses, omega);
        let z = mechanism.elements(phi);
        let at = ConstraintArguments { phi, z: &z, omega };
        let driven = mechanism.constraints.iter().zip(&impulses);
        let work =
            driven.fold(Digits::ZERO, |work, (row, &impulse)| work - impulse * travel_rate(row, t, at));
        (work, impulses)
    }

    /// The change of the rates by an impulse of one along `gradient`, the constraints kept, and the impulses
    /// sigma of these; all at a position.  Where the constraints leave no freedom along `gradient`, what is
    /// left of the change is rounding, and zero is returned:
    ///
    /// ```text
    /// aᵀ M a <= 10^(-D) gᵀ M⁻¹ g,   a = M⁻¹ (g - Gᵀ sigma)
    /// ```
    pub(super) fn response(
        &mut self,
        mechanism: &ExactMechanism<Digits<W>>,
        t: Digits<W>,
        [phi, omega]: [&[Digits<W>]; 2],
        gradient: &[Digits<W>],
    ) -> (Vec<Digits<W>>, Vec<Digits<W>>) {
        self.residuals(mechanism, t, phi, omega);
        self.factor(mechanism, phi);
        let n = phi.len();
        let mut response = gradient.to_vec();
        tree::solve::<Digits<W>, 0>(n, &self.mass, &self.mass_pivot, &mut response);
        let without = dot(gradient, &response);
        let mut along: Vec<_> = self
            .jacobian
            .chunks_exact(n)
            .map(|row| row.iter().zip(&response).fold(Digits::ZERO, |sum, (&a, &b)| sum + a * b))
            .collect();
        self.take_off(&mut along, &mut response);
        let [left, _] = mechanism.energy(phi, &response, &mechanism.elements(phi));
        if left.scale(2.0).log2() - without.log2() <= self.no_freedom {
            response.fill(Digits::ZERO);
        }
        (response, along)
    }
}

/// log2 of the largest of numbers; NaN where one of them is.
pub(super) fn largest<const W: usize>(numbers: &[Digits<W>]) -> f64 {
    let sizes = numbers.iter().map(Digits::log2);
    sizes.fold(f64::NEG_INFINITY, larger)
}

fn stop(t: f64, what: String, hint: &str) -> StepError {
    StepError { cause: Cause::BranchLost, method: "taylor".into(), t, step: 0.0, what, hint: hint.into() }
}
