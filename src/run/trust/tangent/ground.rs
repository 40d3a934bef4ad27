//! Columns of the tangent flow kept tangent to the constraints, at both levels.
//!
//! ```text
//! positions:  S x = G dq,                  dq -= M⁻¹ Gᵀ x
//! rates:      S y = G dw + (G w + C_t)'dq,  dw -= M⁻¹ Gᵀ y           (…)'dq: along dq, on dual numbers
//! ```
//!
//! The least change in the metric of the mass matrix, as in [`projection`](crate::stabilization::projection),
//! whose derivative this is on the constraints.

use crate::arithmetic::{Complex, Dual, Scalar};
use crate::dynamics::constraint::ConstraintArguments;
use crate::dynamics::kernel::{Kernel, dot};
use crate::dynamics::{Mechanism, State};

type Number = Dual<1>;

/// What columns are put back with.
pub struct Ground {
    kernel: Kernel<f64>,
    phi: Vec<Number>,
    omega: Vec<Number>,
    z: Vec<Complex<Number>>,
    gradient: Vec<Number>,
    /// Rows that took hold where the motion was, as neighbours do where they are: motors and locks that
    /// engaged.
    pub engaged: Vec<usize>,
}

impl Ground {
    /// For all coordinates of a mechanism.
    pub fn new(mechanism: &Mechanism) -> Self {
        let n = mechanism.coordinates();
        let room = || vec![Number::ZERO; n];
        Self {
            kernel: Kernel::new(mechanism),
            phi: room(),
            omega: room(),
            z: vec![Complex::ZERO; n],
            gradient: room(),
            engaged: Vec::new(),
        }
    }

    /// Takes a state on the constraints, and tells how many of them are independent there.
    pub fn stand(&mut self, mechanism: &Mechanism, state: &State) -> usize {
        let n = mechanism.coordinates();
        self.kernel.linearise_at::<0>(mechanism, state.time, &state.y[..n], &state.y[n..2 * n]);
        (0..mechanism.constraints.len()).filter(|&r| !self.kernel.is_left_out(r)).count()
    }

    /// Makes columns tangent at the state taken last.
    pub fn keep<'a>(
        &mut self,
        mechanism: &Mechanism,
        state: &State,
        columns: impl Iterator<Item = &'a mut Vec<f64>>,
    ) {
        for column in columns {
            self.keep_moved(mechanism, state, column, [&[], &[]]);
        }
    }

    /// The same for one column beside which the constraints themselves are others: C and C' change by these,
    /// none where they are left out.
    pub fn keep_moved(
        &mut self,
        mechanism: &Mechanism,
        state: &State,
        column: &mut [f64],
        [positions, rates]: [&[f64]; 2],
    ) {
        let n = mechanism.coordinates();
        // What sticks does so where neighbours are, too.
        let sticking = mechanism.constraints.len() - mechanism.sticking();
        for r in 0..mechanism.constraints.len() {
            let moved = positions.get(r).copied().unwrap_or(0.0);
            let left = self.kernel.fold_gradient(r, 0.0, |sum, k, g| sum + g * column[k]) + moved;
            self.kernel.multiplier[r] = if r >= sticking || self.engaged.contains(&r) { 0.0 } else { left };
        }
        self.shift(&mut column[..n]);
        self.rates(mechanism, state, column);
        self.kernel.multiplier.iter_mut().zip(rates).for_each(|(rate, moved)| *rate += moved);
        self.shift(&mut column[n..2 * n]);
    }

    /// Takes M⁻¹ Gᵀ S⁻¹ of what is left of every row at the state taken last off one half of a column.
    pub fn take_off(&mut self, left: impl Iterator<Item = f64>, half: &mut [f64]) {
        self.kernel.multiplier.iter_mut().zip(left).for_each(|(multiplier, left)| *multiplier = left);
        self.shift(half);
    }

    /// Takes off a half of a column what is not tangent to the constraints.
    pub fn flatten(&mut self, mechanism: &Mechanism, half: &mut [f64]) {
        for r in 0..mechanism.constraints.len() {
            self.kernel.multiplier[r] = self.kernel.fold_gradient(r, 0.0, |sum, k, g| sum + g * half[k]);
        }
        self.shift(half);
    }

    /// How fast the rows part along a column, as multipliers.
    fn rates(&mut self, mechanism: &Mechanism, state: &State, column: &[f64]) {
        let n = mechanism.coordinates();
        for k in 0..n {
            self.phi[k] = Number::new(state.y[k], [column[k]]);
            self.omega[k] = Number::new(state.y[n + k], [column[n + k]]);
        }
        mechanism.tree.unit_vectors::<Number, 0>(&self.phi, &mut self.z);
        let at = ConstraintArguments { phi: &self.phi, z: &self.z, omega: &self.omega };
        for (row, multiplier) in mechanism.constraints.iter().zip(&mut self.kernel.multiplier) {
            self.gradient.fill(Number::ZERO);
            let here = row.linearise(state.time, at, &mut self.gradient);
            *multiplier = (dot(&self.gradient, &self.omega) + here.drive).slope[0];
        }
    }

    /// Takes M⁻¹ Gᵀ S⁻¹ of the multipliers off one half of a column.
    fn shift(&mut self, half: &mut [f64]) {
        self.kernel.solve_rows();
        self.kernel.multiplier_accelerations();
        for (entry, &change) in half.iter_mut().zip(&self.kernel.load) {
            *entry -= change;
        }
    }
}
