//! Numbers at the bounds of what a scene takes.
//!
//! A search whose steps are refused beyond a bound ends beside it, where it is no minimum of the others:
//! along the bound it could still go.  The number is then put onto the bound and held there while the others
//! are looked for, and let go again where the sum of squares falls into the range (active set; J. Nocedal,
//! S. J. Wright, *Numerical Optimization* (2006), section 16.5).

use super::FittedColumn;
use super::problem::FitProblem;
use super::search::rounding;
use super::segment::Lost;

/// What a step of Gauss and Newton may take off the sum of squares at a minimum: of a sum of squares over
/// standard deviations a hundredth of a standard error, and of the sum itself.
const SETTLED: [f64; 2] = [1e-4, 1e-8];
/// Share of that step within which a bound is reached.
const NEAR: f64 = 1e-2;
/// Bounds that are looked for first.
const BOUNDS: [f64; 3] = [0.0, 1.0, -1.0];
/// What is beyond one of these, over the step.
const BEYOND: f64 = 1e-9;
/// Halvings of the distance to another bound.
const HALVINGS: usize = 60;

impl FitProblem<'_> {
    /// Looks for the minimum with this weight of continuity among the numbers that the scene takes, and tells
    /// how it ended.
    pub fn minimize(self, columns: &[FittedColumn], weight: f64) -> Result<(Self, &'static str), Lost> {
        let mut turns = 2 * self.held.len();
        let (mut problem, mut ended) = self.minimize_free(columns, weight)?;
        while turns > 0 && (problem.hold()? || problem.let_go()?) {
            (problem, ended) = problem.minimize_free(columns, weight)?;
            turns -= 1;
        }
        if problem.was_too_long && !problem.is_settled()? {
            return Err(problem.too_long().into());
        }
        Ok((problem, ended))
    }

    /// True where a step of Gauss and Newton takes next to nothing off the sum of squares.
    fn is_settled(&self) -> Result<bool, Lost> {
        let svd = self.decomposed()?;
        let residuals = &self.found.as_ref().map_err(Clone::clone)?.residuals;
        let u = svd.u.as_ref().ok_or("the Jacobian has no singular values")?;
        let settled = SETTLED[0].max(SETTLED[1] * residuals.norm_squared());
        Ok(u.tr_mul(residuals).norm_squared() <= settled)
    }

    /// True of a number the scene takes in place of that of an unknown.
    fn takes(&mut self, k: usize, x: f64) -> bool {
        let before = std::mem::replace(&mut self.x[k], x);
        let takes = self.study().is_ok();
        self.x[k] = before;
        takes
    }

    /// Holds the number that ended the search at its bound; false where there is none.
    fn hold(&mut self) -> Result<bool, Lost> {
        if !self.was_refused || self.is_settled()? {
            return Ok(false);
        }
        let svd = self.decomposed()?;
        let residuals = &self.found.as_ref().map_err(Clone::clone)?.residuals;
        let Ok(step) = svd.solve(residuals, rounding(&svd.singular_values)) else { return Ok(false) };
        let count = self.held.len();
        for (place, k) in self.free().into_iter().enumerate().filter(|(_, k)| *k < count) {
            let (from, to) = (self.x[k], self.x[k] - step[place]);
            if to == from || self.takes(k, to) || self.takes(k, from + NEAR * (to - from)) {
                continue;
            }
            self.x[k] = self.bound(k, from, to);
            self.held[k] = Some((to - from).signum());
            self.found = self.evaluate();
            self.found.as_ref().map_err(Clone::clone)?;
            return Ok(true);
        }
        Ok(false)
    }

    /// The last number that the scene takes on the way from one that it takes to one that it does not.
    fn bound(&mut self, k: usize, from: f64, to: f64) -> f64 {
        let (mut inside, mut outside) = (from, to);
        for bound in BOUNDS.map(|bound| bound / self.scale[k]) {
            let is_between = (bound - from) * (to - bound) >= 0.0;
            if is_between && self.takes(k, bound) && !self.takes(k, bound + BEYOND * (to - from)) {
                return bound;
            }
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside + outside);
            if self.takes(k, middle) { inside = middle } else { outside = middle }
        }
        inside
    }

    /// Lets a number go that the sum of squares would take off its bound; false where there is none.
    fn let_go(&mut self) -> Result<bool, Lost> {
        let found = self.found.as_ref().map_err(Clone::clone)?;
        let pulled = self.held.iter().enumerate().find(|(k, held)| {
            let column = found.jacobian.column(*k);
            let (slope, size) = (column.dot(&found.residuals), column.norm_squared());
            held.is_some_and(|beyond| slope * beyond > 0.0 && slope * slope > SETTLED[0] * size)
        });
        let Some((k, _)) = pulled else { return Ok(false) };
        self.held[k] = None;
        Ok(true)
    }
}
