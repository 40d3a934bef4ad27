//! The search for the minimum, and what it says of the numbers.

use super::FittedColumn;
use super::problem::{Evaluated, FitProblem, HINT};
use super::segment::Lost;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn, SVD};

/// Relative tolerance of the search, and evaluations for each unknown.
const TOLERANCE: f64 = 1e-11;
const PATIENCE: usize = 40;
/// Residual in place of one that cannot be computed, at least, and over all at the beginning: the step is
/// taken back.
const FAR: f64 = 1e9;
const FARTHER: f64 = 10.0;
/// Trials in all that may take nearly as many steps as one is allowed, or too many.
const LONG: usize = 8;
/// What a change of a number by its own size does to the columns, over the data, below which it does nothing.
const NOTHING: f64 = 1e-11;
/// The same of one column, over its largest value: the rounding of its derivatives.
const ROUNDING: f64 = 1e-13;
/// Share of a number, over the largest one, in a change of several that does nothing, from which it is named.
const PARTNER: f64 = 0.01;

/// Singular values up to this one are rounding, of the derivatives too.
pub(super) fn rounding(values: &DVector<f64>) -> f64 {
    NOTHING * values.amax()
}

impl FitProblem<'_> {
    /// The unknowns that no bound holds.
    pub(super) fn free(&self) -> Vec<usize> {
        (0..self.x.len()).filter(|&k| self.held.get(k).copied().flatten().is_none()).collect()
    }

    /// The singular value decomposition of the Jacobian by the free unknowns.
    pub(super) fn decomposed(&self) -> Result<SVD<f64, Dyn, Dyn>, Lost> {
        let found = self.found.as_ref().map_err(Clone::clone)?;
        Ok(found.jacobian.select_columns(&self.free()).svd(true, true))
    }

    /// Looks for the minimum with this weight of continuity in the free unknowns, and tells how it ended.
    pub(super) fn minimize_free(
        mut self,
        columns: &[FittedColumn],
        weight: f64,
    ) -> Result<(Self, &'static str), Lost> {
        self.take(columns);
        (self.weight, self.was_refused, self.was_too_long) = (weight, false, false);
        self.found = self.evaluate();
        match &self.found {
            Err(Lost::Interrupted) => return Err(Lost::Interrupted),
            Err(why) => return Err(format!("the motion from the guess has no derivatives: {why}").into()),
            Ok(found) => {
                self.far = FAR.max(FARTHER * found.residuals.norm());
                self.acting(columns, &found.jacobian)?;
            }
        }
        let search = LevenbergMarquardt::new().with_tol(TOLERANCE).with_patience(PATIENCE);
        let (mut problem, report) = search.minimize(self);
        let ended = if report.termination.was_successful() { "converged" } else { "not converged" };
        problem.found.as_ref().map_err(Clone::clone)?;
        problem.rebase()?;
        Ok((problem, ended))
    }

    /// Takes what is rounding of a column's derivatives by the numbers for zero: of a column that stays as it
    /// is, and is as exact, that would count as much as the others.
    pub(super) fn leave_out_rounding(&self, jacobian: &mut DMatrix<f64>, owners: &[Option<usize>]) {
        let largest =
            |column: &[Option<f64>]| column.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
        let least: Vec<f64> = self
            .measured
            .iter()
            .zip(&self.sigma)
            .map(|(own, sigma)| ROUNDING * largest(own) / sigma)
            .collect();
        for (mut row, owner) in jacobian.row_iter_mut().zip(owners) {
            let Some(column) = *owner else { continue };
            for entry in
                row.iter_mut().take(self.variables.len()).filter(|entry| entry.abs() <= least[column])
            {
                *entry = 0.0;
            }
        }
    }

    /// Refuses a number that does nothing to the columns: no step of it is too large for the search.
    fn acting(&self, columns: &[FittedColumn], jacobian: &DMatrix<f64>) -> Result<(), Lost> {
        let most = |column: &FittedColumn| {
            column.measured.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs())) / column.sigma
        };
        let size = columns.iter().map(most).fold(0.0, f64::max);
        let is_free = |k: &usize| self.held[*k].is_none();
        let mut idle =
            (0..self.variables.len()).filter(is_free).filter(|&k| jacobian.column(k).amax() < NOTHING * size);
        let error = |k: usize| {
            let path = &self.variables[k].path;
            Err(Lost::from(match self.ran_to(k) {
                Some(ran) => format!("{ran}, where the data do not depend on it\n{HINT}"),
                None => format!("the data do not depend on {path}"),
            }))
        };
        idle.next().map_or(Ok(()), error)
    }

    /// What each column tells of the unknowns: UᵀU of its rows, J = U S Vᵀ, whose trace is the sum of their
    /// leverages.
    pub fn told(&self, columns: usize) -> Result<Vec<DMatrix<f64>>, Lost> {
        let (svd, found) = (self.decomposed()?, self.found.as_ref().map_err(Clone::clone)?);
        let (values, least) = (&svd.singular_values, rounding(&svd.singular_values));
        let known: Vec<usize> = (0..values.len()).filter(|&k| values[k] > least).collect();
        let mut told = vec![DMatrix::zeros(known.len(), known.len()); columns];
        for (row, owner) in svd.u.iter().flat_map(|u| u.row_iter()).zip(&found.owners) {
            let Some(column) = *owner else { continue };
            let row = DVector::from_iterator(known.len(), known.iter().map(|&k| row[k]));
            told[column].ger(1.0, &row, &row, 1.0);
        }
        Ok(told)
    }

    /// Why numbers are not told that change together, in these shares, without changing the columns.
    fn untold(&self, shares: &[f64]) -> String {
        let largest = (0..shares.len()).max_by(|&a, &b| shares[a].total_cmp(&shares[b])).unwrap_or_default();
        let path = &self.variables[largest].path;
        let others: Vec<&str> = (0..shares.len())
            .filter(|&k| k != largest && shares[k] > PARTNER * shares[largest])
            .map(|k| self.variables[k].path.as_str())
            .collect();
        let what = match others.is_empty() {
            true => format!("the data do not depend on {path}"),
            false => format!("the data do not tell {path} apart from {}", others.join(", ")),
        };
        match self.ran_to(largest) {
            Some(ran) => format!("{ran}, where {what}\n{HINT}"),
            None => what,
        }
    }

    /// The covariance of the numbers at the minimum; those at a bound have none.
    pub fn covariance(&mut self, columns: &[FittedColumn]) -> Result<DMatrix<f64>, Lost> {
        self.take(columns);
        let jacobian = self.evaluate()?.jacobian;
        let count = self.variables.len();
        self.acting(columns, &jacobian)?;
        let free = self.free();
        let svd = jacobian.select_columns(&free).svd(false, true);
        let (values, right) = (svd.singular_values, svd.v_t.ok_or("the Jacobian has no singular values")?);
        let least = rounding(&values);
        let places: Vec<Option<usize>> = (0..count).map(|k| free.iter().position(|f| *f == k)).collect();
        if let Some(k) = values.iter().position(|value| *value <= least) {
            let shares = (0..count).map(|number| places[number].map_or(0.0, |place| right[(k, place)].abs()));
            return Err(self.untold(&shares.collect::<Vec<_>>()).into());
        }
        Ok(DMatrix::from_fn(count, count, |i, j| {
            let (Some(a), Some(b)) = (places[i], places[j]) else { return 0.0 };
            let sum =
                (0..values.len()).map(|k| right[(k, a)] * right[(k, b)] / values[k].powi(2)).sum::<f64>();
            sum * self.scale[i] * self.scale[j]
        }))
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for FitProblem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        for k in self.free() {
            self.x[k] = x[k];
        }
        let size = self.found.as_ref().map_or(0, |found| found.residuals.len());
        self.is_long = false;
        let found = self.evaluate();
        self.long_trials += usize::from(self.is_long);
        if self.is_long && self.long_trials >= LONG && !matches!(found, Err(Lost::Interrupted)) {
            self.found = Err(self.too_long().into());
            return;
        }
        // What cannot be computed is far away: the step is taken back.
        self.found = match found {
            Ok(_) | Err(Lost::Interrupted) => found,
            Err(why) => {
                self.was_refused = true;
                self.was_too_long |= matches!(why, Lost::TooLong(_));
                let (residuals, gap) = (DVector::from_element(size, self.far), f64::NAN);
                let jacobian = DMatrix::zeros(size, x.len());
                Ok(Evaluated { residuals, jacobian, owners: Vec::new(), model: Vec::new(), gap })
            }
        };
    }

    fn params(&self) -> DVector<f64> {
        self.x.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        self.found.as_ref().ok().map(|found| found.residuals.clone())
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let mut jacobian = self.found.as_ref().ok()?.jacobian.clone();
        for (k, _) in self.held.iter().enumerate().filter(|(_, held)| held.is_some()) {
            jacobian.column_mut(k).fill(0.0);
        }
        Some(jacobian)
    }
}
