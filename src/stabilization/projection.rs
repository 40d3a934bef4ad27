//! Projection: after every accepted step the state is put back onto the constraints, position first, then velocity.
//!
//! ```text
//! position:  S dl = C,              q -= M⁻¹ Gᵀ dl      repeated until C stops falling
//! velocity:  S dm = G w + C_t,      w -= M⁻¹ Gᵀ dm      with G, S and C_t at the new position and the new time
//! ```
//!
//! The shortest way in the metric of the mass matrix.  Source: E. Hairer, G. Wanner, *Solving Ordinary Differential Equations II*, 2nd ed. (1996), section VII.2
//! (algorithm 2.1); E. Eich, SIAM J. Numer. Anal. 30 (1993).

use crate::arithmetic::sum::two_sum;
use crate::dynamics::kernel::Kernel;
use crate::dynamics::{Field, Form, Mechanism, State, Time, tree};
use crate::stepping::{Cause, Method, Reached, Seen, StepError, Tally, Watch};

/// A method followed by projection after each of its steps; its problem must be in angles and rates, as
/// [`Multiplier`](crate::dynamics::multiplier::Multiplier) is.
#[derive(Clone, Debug)]
pub struct Projected<M> {
    inner: M,
    kernel: Option<Kernel<f64>>,
    /// Largest violation left that counts as converged, at both levels \[rad, rad/s or m, m/s\], relative to levers and
    /// speeds where these are larger.
    pub tolerance: f64,
}

impl<M> Projected<M> {
    /// Projects after the steps of `inner`.
    pub fn new(inner: M) -> Self {
        Self { inner, kernel: None, tolerance: 1e-13 }
    }
}

impl<M, P> Method<P> for Projected<M>
where
    M: Method<P>,
    P: Field + Form + ?Sized,
{
    fn name(&self) -> &'static str {
        self.inner.name()
    }

    fn order(&self) -> u32 {
        self.inner.order()
    }

    fn advance(
        &mut self,
        problem: &mut P,
        state: &mut State,
        until: Time,
        tally: &mut Tally,
        watch: &mut Watch<P>,
    ) -> Result<Reached, StepError> {
        let (name, tolerance) = (self.inner.name(), self.tolerance);
        let mechanism = problem.mechanism();
        let kernel = self.kernel.get_or_insert_with(|| Kernel::new(mechanism.bodies.len(), mechanism.rows.len()));
        self.inner.advance(problem, state, until, tally, &mut |problem, state| {
            let moved = project(problem.mechanism(), kernel, state, tolerance).map_err(|(row, left)| StepError {
                cause: Cause::ProjectionFailed,
                method: name.into(),
                t: state.time.hi,
                step: 0.0,
                what: format!("projection leaves {left:.1e} of constraint {row}"),
                hint: "tighten the tolerance, or check that no motors work against each other".into(),
            })?;
            Ok(match (watch(problem, state)?, moved) {
                (Seen::Enough, _) => Seen::Enough,
                (Seen::Kept, false) => Seen::Kept,
                _ => Seen::Changed,
            })
        })
    }

    fn is_dense(&self) -> bool {
        self.inner.is_dense()
    }

    /// Inside a step the constraints are kept as well as at its end; where they cannot be, the state is the step's own.
    fn within(&mut self, problem: &mut P, from: &State, time: Time, inside: &mut State) {
        self.inner.within(problem, from, time, inside);
        if let Some(kernel) = &mut self.kernel {
            // The violation left is on record in the constraints' drift.
            let _ = project(problem.mechanism(), kernel, inside, self.tolerance);
        }
    }
}

/// Projects angles and rates of a state onto all rows; true where something moved.
///
/// # Errors
/// Name of the worst row and its violation where it cannot be brought below `tolerance`.
pub fn project(mechanism: &Mechanism, kernel: &mut Kernel<f64>, state: &mut State, tolerance: f64) -> Result<bool, (String, f64)> {
    let n = mechanism.bodies.len();
    let rows = mechanism.rows.len();
    let energy_before = energy(mechanism, kernel, state);
    let (mut last, mut moved) = (f64::INFINITY, false);
    loop {
        linearise(mechanism, kernel, state);
        let worst = (0..rows).map(|r| kernel.rows[r].position.abs()).fold(0.0, largest);
        // At rounding, or no longer falling: another sweep would only move it about.
        if worst <= 1e-16 || worst >= 0.5 * last || worst.is_nan() {
            break;
        }
        last = worst;
        for r in 0..rows {
            kernel.multiplier[r] = kernel.rows[r].position;
        }
        tree::solve::<f64, 0>(rows, &kernel.schur, &kernel.schur_pivot, &mut kernel.multiplier);
        shift(kernel, state, 0, n);
        moved = true;
    }
    let lever = |kernel: &Kernel<f64>, r: usize| kernel.jacobian[r * n..(r + 1) * n].iter().fold(1.0, |sum: f64, g| sum.max(g.abs()));
    check(mechanism, kernel, tolerance, |kernel, r| (kernel.rows[r].position, lever(kernel, r)))?;
    let rate = |kernel: &Kernel<f64>, state: &State, r: usize| kernel.row_rate(r, &state.y[n..2 * n]);
    // A row's rate is a sum of G_k w_k, and no smaller than their rounding.
    let pace = |kernel: &Kernel<f64>, state: &State, r: usize| {
        let terms = kernel.jacobian[r * n..(r + 1) * n].iter().zip(&state.y[n..2 * n]);
        terms.fold(kernel.rows[r].drive.abs().max(1.0), |most, (g, w)| most.max((g * w).abs()))
    };
    let mut fast = 0.0;
    for r in 0..rows {
        kernel.multiplier[r] = rate(kernel, state, r);
        fast = largest(fast, kernel.multiplier[r].abs() / pace(kernel, state, r));
    }
    if fast > 2.0 * f64::EPSILON || fast.is_nan() {
        tree::solve::<f64, 0>(rows, &kernel.schur, &kernel.schur_pivot, &mut kernel.multiplier);
        shift(kernel, state, n, n);
        moved = true;
        check(mechanism, kernel, tolerance, |kernel, r| (rate(kernel, state, r), pace(kernel, state, r)))?;
    }
    if moved {
        state.wrap();
        state.y[2 * n + 1] += energy(mechanism, kernel, state) - energy_before;
    }
    Ok(moved)
}

/// Rows and their factors at a state.
fn linearise(mechanism: &Mechanism, kernel: &mut Kernel<f64>, state: &State) {
    let n = mechanism.bodies.len();
    let (phi, omega) = (&state.y[..n], &state.y[n..2 * n]);
    kernel.face::<0>(phi);
    mechanism.tree.couple::<f64, 0>(&kernel.z, &mut kernel.mass, &mut kernel.twist);
    tree::factor::<f64, 0>(n, &mut kernel.mass, &mut kernel.pivot);
    kernel.linearise::<0>(mechanism, state.time, phi, omega);
}

/// Subtracts M⁻¹ Gᵀ times the multipliers from the unknowns `from`….
fn shift(kernel: &Kernel<f64>, state: &mut State, from: usize, n: usize) {
    for (r, multiplier) in kernel.multiplier.iter().enumerate() {
        for k in 0..n {
            let change = state.low[from + k] - kernel.lifted[r * n + k] * multiplier;
            (state.y[from + k], state.low[from + k]) = two_sum(state.y[from + k], change);
        }
    }
}

/// The worst row must be below tolerance, each measured against its own size.
fn check(
    mechanism: &Mechanism,
    kernel: &Kernel<f64>,
    tolerance: f64,
    violation: impl Fn(&Kernel<f64>, usize) -> (f64, f64),
) -> Result<(), (String, f64)> {
    for (r, row) in mechanism.rows.iter().enumerate() {
        let (violation, size) = violation(kernel, r);
        let small = violation.abs() <= tolerance * size;
        if !small {
            return Err((row.name().into(), violation.abs()));
        }
    }
    Ok(())
}

fn energy(mechanism: &Mechanism, kernel: &mut Kernel<f64>, state: &State) -> f64 {
    let n = mechanism.bodies.len();
    mechanism.energy(kernel, &state.y[..n], &state.y[n..2 * n]).total()
}

/// The larger of two, and not a number if either is.
fn largest(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}
