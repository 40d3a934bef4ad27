//! Local coordinates of a mechanism's motions: along the directions that the constraints leave.
//!
//! ```text
//! (q, w) beside (q0, w0):   Tᵀ (q - q0) = y,   Tᵀ (w - w0) = v,   both on the constraints
//! ```
//!
//! T: directions that the constraints leave at q0, orthonormal in the units of the coordinates.

use super::{DEPENDENT, DISTINCT, KEPT};
use crate::arithmetic::Scalar;
use crate::dynamics::compile::WholeTurns;
use crate::dynamics::kernel::{Bias, Kernel};
use crate::dynamics::{Mechanism, Motion, Time};
use crate::stabilization::projection::{project, unit as row_unit};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Projections at most, and how near its local coordinates a position is to come by them.
const ROUNDS: usize = 8;
const CLOSE: f64 = 1e-15;

/// Scratch space for positions on the constraints.
pub(in crate::run) struct Local<'a> {
    pub(super) mechanism: &'a Mechanism,
    pub(super) kernel: Kernel<f64>,
    /// The time of the constraints.
    pub(in crate::run) time: Time,
    /// Units of the coordinates \[rad, m\].
    pub(in crate::run) unit: Vec<f64>,
    /// Whole turns that nothing feels.
    pub(super) turns: WholeTurns,
    /// The least singular value of the rows that is not zero over the largest, where the last tangent was
    /// taken.
    pub(super) conditioning: f64,
}

impl<'a> Local<'a> {
    pub(in crate::run) fn new(mechanism: &'a Mechanism) -> Self {
        let bodies = mechanism.bodies.len();
        let unit = |k: usize| if k < bodies { 1.0 } else { mechanism.units.length };
        Self {
            mechanism,
            kernel: Kernel::new(mechanism),
            time: Time::default(),
            unit: (0..mechanism.coordinates()).map(unit).collect(),
            turns: WholeTurns::of(mechanism),
            conditioning: 1.0,
        }
    }

    /// Accelerations at rest at a time, measured in the coordinates' units.
    pub(in crate::run) fn pull(&mut self, phi: &[f64], t: f64) -> DVector<f64> {
        self.pull_moving([phi, &vec![0.0; phi.len()]], Time::of(t))
    }

    /// The same at these coordinates and rates.
    pub(super) fn pull_moving(&mut self, [phi, omega]: [&[f64]; 2], t: Time) -> DVector<f64> {
        self.kernel.accelerations(self.mechanism, t, phi, omega, Bias::default());
        DVector::from_iterator(phi.len(), self.kernel.load.iter().zip(&self.unit).map(|(a, unit)| a / unit))
    }

    /// Directions that the constraints leave, orthonormal, one a column.
    pub(in crate::run) fn tangent(&mut self, phi: &[f64]) -> DMatrix<f64> {
        let n = phi.len();
        let rows = self.mechanism.constraints.len();
        self.pull(phi, self.time.hi);
        let mut jacobian = DMatrix::<f64>::zeros(rows.max(n), n);
        for r in 0..rows {
            // Not by its own length: a row that vanishes leaves a direction more.
            let (unit, size) = (&self.unit, row_unit(self.mechanism, r));
            self.kernel.fold_gradient(r, (), |(), k, g| jacobian[(r, k)] = g * unit[k] / size);
        }
        let svd = jacobian.svd(false, true);
        let (values, right) = (svd.singular_values, svd.v_t.unwrap_or_else(|| DMatrix::identity(n, n)));
        // All rows may vanish at once: then their levers are what is small against.
        let largest = values.amax().max(self.mechanism.size_of_parts() / self.mechanism.units.length);
        let free: Vec<usize> = (0..n).filter(|&k| values[k] <= DEPENDENT * largest).collect();
        let held = values.iter().copied().filter(|&value| value > DEPENDENT * largest);
        self.conditioning = held.fold(largest, f64::min) / largest;
        DMatrix::from_fn(n, free.len(), |i, j| right[(free[j], i)])
    }

    /// Coordinates on the constraints next to these.
    pub(in crate::run) fn projected(&mut self, phi: &[f64]) -> Option<Vec<f64>> {
        let [phi, _] = self.projected_moving(&[phi.to_vec(), vec![0.0; phi.len()]])?;
        Some(phi)
    }

    /// Coordinates and rates on the constraints next to these.
    pub(in crate::run) fn projected_moving(&mut self, [phi, omega]: &[Vec<f64>; 2]) -> Option<[Vec<f64>; 2]> {
        let n = phi.len();
        if self.mechanism.constraints.is_empty() {
            return Some([phi.clone(), omega.clone()]);
        }
        let mut unknowns: Vec<Time> = phi.iter().chain(omega).map(|&x| Time::of(x)).collect();
        unknowns.resize(2 * n + 3, Time::default());
        let turns = vec![0; self.mechanism.bodies.len()];
        let mut state = self.mechanism.state(self.time, &unknowns, &turns);
        project(self.mechanism, &mut self.kernel, &mut state, KEPT).ok()?;
        let turned = |k: usize| state.turns.get(k).map_or(0.0, |&turns| TAU * turns as f64);
        let phi = (0..n).map(|k| state.unknown(k).hi + turned(k)).collect();
        Some([phi, (n..2 * n).map(|k| state.unknown(k).hi).collect()])
    }

    /// The state on the constraints with these local coordinates about another, of which `tangent` has the
    /// directions; `None` where there is none near it.
    pub(in crate::run) fn beside(
        &mut self,
        [phi, omega]: &[Vec<f64>; 2],
        tangent: &DMatrix<f64>,
        [y, v]: [&DVector<f64>; 2],
    ) -> Option<[Vec<f64>; 2]> {
        let mut state = [self.moved(phi, tangent, y), self.moved(omega, tangent, v)];
        for _ in 0..ROUNDS {
            state = self.projected_moving(&state)?;
            let off = y - self.along(tangent, phi, &state[0]);
            if off.amax() <= CLOSE * (1.0 + y.amax()) {
                break;
            }
            state[0] = self.moved(&state[0], tangent, &off);
        }
        let own = self.tangent(&state[0]);
        if own.ncols() != tangent.ncols() {
            return None;
        }
        let off = v - self.along(tangent, omega, &state[1]);
        let by = (tangent.transpose() * &own).lu().solve(&off)?;
        state[1] = self.moved(&state[1], &own, &by);
        Some(state)
    }

    /// What the difference of two positions, or rates, has along the directions of `tangent`.
    fn along(&self, tangent: &DMatrix<f64>, from: &[f64], to: &[f64]) -> DVector<f64> {
        let apart = from.iter().zip(to).zip(&self.unit).map(|((from, to), unit)| (to - from) / unit);
        tangent.transpose() * DVector::from_iterator(from.len(), apart)
    }

    /// A position moved along the constraints.
    pub(in crate::run) fn moved(&self, phi: &[f64], tangent: &DMatrix<f64>, y: &DVector<f64>) -> Vec<f64> {
        (tangent * y).iter().zip(phi).zip(&self.unit).map(|((y, phi), unit)| phi + y * unit).collect()
    }

    /// True where two positions are the same but for whole turns that nothing feels.
    pub(in crate::run) fn is_same(&self, a: &[f64], b: &[f64]) -> bool {
        let mut apart: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
        self.turns.take_off(&mut apart);
        apart.iter().zip(&self.unit).all(|(apart, unit)| (apart / unit).abs() < DISTINCT)
    }
}

/// A position at rest at a time.
pub(super) fn at_rest(phi: &[f64], t: f64) -> Motion {
    moving(&[phi.to_vec(), vec![0.0; phi.len()]], t)
}

/// Coordinates and rates at a time.
pub(super) fn moving([phi, omega]: &[Vec<f64>; 2], t: f64) -> Motion {
    Motion::of_doubles(t, [phi, omega])
}
