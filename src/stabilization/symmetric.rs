//! Symmetric projection: Gauss methods on scenes with closed loops, sliders and other rows that cannot be
//! eliminated.
//!
//! ```text
//! start = y0 + D(y0) mu,     end = Gauss(start),     y1 = end + D(y1) mu,     C(y1) = 0, C'(y1) = 0
//! D mu: q += M⁻¹ Gᵀ mu_q,  w += M⁻¹ Gᵀ mu_w
//! ```
//!
//! The same mu at both ends, so that the step run backwards is its own inverse: a reversible mechanism keeps
//! its energy over long times, which one projection at the end of each step would spoil.  What starts off the
//! constraints by mu arrives off them by mu, so that a step that is off by nu beyond it wants mu + (nu -
//! mu)/2; the last step's mu is the first guess.
//!
//! Source: E. Hairer, *Symmetric projection methods for differential equations on manifolds*, BIT 40 (2000);
//! E. Hairer, C. Lubich, G. Wanner, *Geometric Numerical Integration*, 2nd ed. (2006), section V.4.1.

use super::projection::{self, is_kept};
use crate::arithmetic::sum::larger;
use crate::dynamics::kernel::Kernel;
use crate::dynamics::schur::DROPPED;
use crate::dynamics::{Form, Mechanism, OdeSystem, State, Time};
use crate::stepping::gauss::Gauss;
use crate::stepping::{Cause, Integrator, Seen, Statistics, StepError};

/// Gauss steps per step before it is given up; an ordinary one takes three or four.
const ROUNDS: usize = 60;
/// Sweeps onto the constraints.
const SWEEPS: usize = 60;
/// Rounds in which nothing is gained before no more is expected.
const STALLED: usize = 3;
/// Largest violation, relative to levers and speeds, and largest change by the multipliers' mismatch,
/// relative to turns and speeds, that count as converged.
const TOLERANCE: f64 = 1e-12;

/// A Gauss method with symmetric projection; its problem must be in coordinates and rates, as
/// [`Multiplier`](crate::dynamics::multiplier::Multiplier) is.
#[derive(Clone, Debug)]
pub struct SymmetricGauss {
    inner: Gauss,
    kernel: Option<Kernel<f64>>,
    /// The step's start and end before they are shifted.
    trial: State,
    best: State,
    /// mu_q and mu_w (2 r).
    mu: Vec<f64>,
    /// What the end asks for (2 r).
    nu: Vec<f64>,
    /// Makes shorter steps, once one is asked for.
    spare: Option<Box<SymmetricGauss>>,
}

impl SymmetricGauss {
    /// Projects the steps of a Gauss method.
    pub fn new(inner: Gauss) -> Self {
        Self {
            inner,
            kernel: None,
            trial: State::default(),
            best: State::default(),
            mu: Vec::new(),
            nu: Vec::new(),
            spare: None,
        }
    }

    /// One step of `h` \[s\], between states shifted alike.
    fn shifted<P: OdeSystem + Form + ?Sized>(
        &mut self,
        problem: &mut P,
        state: &mut State,
        h: f64,
        statistics: &mut Statistics,
    ) -> Result<(), StepError> {
        let Self { inner, kernel: Some(kernel), trial, best, mu, nu, .. } = self else { return Ok(()) };
        let (r, until) = (problem.mechanism().constraints.len(), state.time + h);
        let own = state.memory.len().saturating_sub(2 * r);
        mu.clear();
        mu.extend_from_slice(&state.memory[own..]);
        mu.resize(2 * r, 0.0);
        let (name, t) = (Integrator::<P>::name(inner), state.time.hi);
        let stop = |what: String| StepError {
            cause: Cause::ProjectionFailed,
            method: name.into(),
            t,
            step: h,
            what,
            hint: "halve the step".into(),
        };
        let (mut last, mut stalled, mut is_closed) = (f64::INFINITY, 0, false);
        let mut one = Statistics::default();
        for _ in 0..ROUNDS {
            trial.clone_from(state);
            trial.memory.truncate(own);
            unit_vectors(problem.mechanism(), kernel, trial);
            shift(problem.mechanism(), kernel, trial, mu);
            inner.advance(problem, trial, until, &mut one, &mut |_, _| Ok(Seen::Kept))?;
            statistics.evaluations += std::mem::take(&mut one.evaluations);
            nu.clone_from(mu);
            land(problem.mechanism(), kernel, trial, best, nu)
                .map_err(|(row, left)| stop(format!("projection leaves {left:.1e} of constraint {row}")))?;
            let mismatch = mismatch(problem.mechanism(), kernel, best, mu, nu);
            for (mu, nu) in mu.iter_mut().zip(nu.iter()) {
                *mu += 0.5 * (nu - *mu);
            }
            // Rounds contract by about the step, near singular positions more slowly: what no longer falls is
            // rounding, which grows there with the inverse of the distance, as in the projection itself.
            if mismatch == 0.0 || mismatch >= 0.5 * last || mismatch.is_nan() {
                let near = kernel.weakest.share.clamp(DROPPED, 1.0).sqrt();
                is_closed = mismatch <= TOLERANCE / near;
                stalled += usize::from(mismatch.is_nan() || mismatch >= 0.95 * last);
            }
            last = mismatch;
            if is_closed || stalled == STALLED {
                break;
            }
        }
        if !is_closed {
            return Err(stop(format!(
                "the shifts of both ends differ by {last:.1e} of the motion and do not come closer"
            )));
        }
        state.clone_from(best);
        state.wrap();
        state.memory.extend_from_slice(mu);
        statistics.steps += 1;
        Ok(())
    }
}

/// Rows and directions at a state.
fn unit_vectors(mechanism: &Mechanism, kernel: &mut Kernel<f64>, state: &State) {
    let n = mechanism.coordinates();
    kernel.linearise_at::<0>(mechanism, state.time, &state.y[..n], &state.y[n..2 * n]);
}

/// The largest entry of D (mu - nu), with the directions of the state faced last: of coordinates over their
/// units, or over their sizes where these are larger, of rates over the units of rates or the fastest.
fn mismatch(mechanism: &Mechanism, kernel: &mut Kernel<f64>, state: &State, mu: &[f64], nu: &[f64]) -> f64 {
    let (n, r) = (kernel.z.len(), kernel.rows.len());
    let size = |k: usize| projection::size(mechanism, k);
    let fastest =
        (0..n).fold(1.0 / mechanism.units.time, |most, k| (state.y[n + k] / size(k)).abs().max(most));
    let mut most = 0.0_f64;
    for level in [0, r] {
        kernel
            .multiplier
            .iter_mut()
            .zip(&mu[level..])
            .zip(&nu[level..])
            .for_each(|((change, mu), nu)| *change = mu - nu);
        kernel.multiplier_accelerations();
        for (k, change) in kernel.load.iter().enumerate() {
            let whole = if level == 0 { size(k).max(state.y[k].abs()) } else { size(k) * fastest };
            most = larger(change.abs() / whole, most);
        }
    }
    most
}

/// y + D mu, with the directions of the state faced last.
fn shift(mechanism: &Mechanism, kernel: &mut Kernel<f64>, state: &mut State, mu: &[f64]) {
    let (n, r) = (kernel.z.len(), kernel.rows.len());
    for (from, mu) in [(0, &mu[..r]), (n, &mu[r..])] {
        kernel.multiplier.copy_from_slice(mu);
        projection::shift(mechanism, kernel, state, from, 1.0);
    }
}

/// Finds nu such that `end` + D nu, written to `landed`, keeps all rows, with D taken there; starts from the
/// nu given.
fn land(
    mechanism: &Mechanism,
    kernel: &mut Kernel<f64>,
    end: &State,
    landed: &mut State,
    nu: &mut [f64],
) -> Result<(), (String, f64)> {
    let (n, r) = (mechanism.coordinates(), mechanism.constraints.len());
    landed.clone_from(end);
    unit_vectors(mechanism, kernel, landed);
    let (mut last, mut stalled) = (f64::INFINITY, 0);
    for _ in 0..SWEEPS {
        landed.clone_from(end);
        shift(mechanism, kernel, landed, nu);
        unit_vectors(mechanism, kernel, landed);
        let mut worst = 0.0_f64;
        for level in [0, r] {
            for row in 0..r {
                let left = if level == 0 {
                    kernel.rows[row].position
                } else {
                    kernel.row_rate(row, &landed.y[n..2 * n])
                };
                kernel.multiplier[row] = left;
                let left = left.abs() / projection::unit(mechanism, row)
                    * if level == 0 { 1.0 } else { mechanism.units.time };
                worst = larger(left, worst);
            }
            kernel.solve_rows();
            if worst > 1e-16 && (worst < 0.5 * last || worst > TOLERANCE) {
                for row in 0..r {
                    nu[level + row] -= kernel.multiplier[row];
                }
            }
        }
        stalled += usize::from(worst >= 0.95 * last);
        // Sweeps contract slowly where a step ends far from where it began; below the tolerance what no
        // longer falls is rounding.
        if worst <= 1e-16
            || (worst >= 0.5 * last && worst <= TOLERANCE)
            || stalled == STALLED
            || worst.is_nan()
        {
            break;
        }
        last = worst;
    }
    is_kept(mechanism, kernel, landed, TOLERANCE)
}

impl<P: OdeSystem + Form + ?Sized> Integrator<P> for SymmetricGauss {
    fn name(&self) -> &'static str {
        Integrator::<P>::name(&self.inner)
    }

    fn order(&self) -> u32 {
        Integrator::<P>::order(&self.inner)
    }

    fn begin(&mut self, problem: &mut P, _state: &mut State, _until: Time) -> Result<(), StepError> {
        if self.kernel.is_none() {
            self.kernel = Some(Kernel::new(problem.mechanism()));
        }
        Ok(())
    }

    /// A whole step, or a shorter one that ends at `until`; see [`Gauss`].  The state's memory is that of the
    /// Gauss method, then mu.
    fn step(
        &mut self,
        problem: &mut P,
        state: &mut State,
        until: Time,
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError> {
        let h = self.inner.next(state, until);
        statistics.check(Integrator::<P>::name(self), state.time.hi, h)?;
        self.shifted(problem, state, h, statistics)?;
        Ok(None)
    }

    fn is_at(&self, state: &State, until: Time) -> bool {
        self.inner.next(state, until) == 0.0
    }

    fn changed(&mut self, state: &mut State) {
        state.memory.clear();
    }

    /// By a shorter step, as long as it takes: see [`Gauss`].
    fn interpolate(&mut self, problem: &mut P, from: &State, time: Time, inside: &mut State) {
        inside.clone_from(from);
        inside.memory.clear();
        let spare = self.spare.get_or_insert_with(|| Box::new(Self::new(self.inner.another())));
        spare.kernel.get_or_insert_with(|| Kernel::new(problem.mechanism()));
        // Where that fails, the state is the beginning of the step.
        let _ = spare.shifted(problem, inside, (time - from.time).hi, &mut Statistics::default());
    }

    /// By the collocation polynomial, from a beginning that is not shifted.
    fn interpolate_coarsely(&mut self, from: &State, time: Time, inside: &mut State) -> bool {
        Integrator::<P>::interpolate_coarsely(&mut self.inner, from, time, inside)
    }
}
