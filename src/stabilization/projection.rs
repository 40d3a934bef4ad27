//! Projection: after every accepted step the state is put back onto the constraints, position first, then
//! velocity.
//!
//! ```text
//! position:  S dl = C,              q -= M⁻¹ Gᵀ dl      repeated until C stops falling
//! velocity:  S dm = G w + C_t,      w -= M⁻¹ Gᵀ dm     all at the new position and time
//! ```
//!
//! The energy put in is the stabilizer's.  Near singular positions, where constraints are left out of the
//! equations, it stands for what these would have done: where motors leave no freedom, that is their work.
//!
//! The shortest way in the metric of the mass matrix; small mechanisms with loops go it in natural
//! coordinates (module `natural`).  Source: E. Hairer, G. Wanner, *Solving Ordinary Differential Equations
//! II*, 2nd ed. (1996), section VII.2 (algorithm 2.1); E. Eich, SIAM J. Numer. Anal. 30 (1993).

mod natural;
mod rates;
mod sizes;

use self::natural::NaturalProjection;
use self::rates::project_rates;
use self::sizes::is_position_kept;
pub(crate) use self::sizes::unit;
pub(super) use self::sizes::{is_kept, size};
use crate::arithmetic::Complex;
use crate::arithmetic::sum::{larger, two_sum};
use crate::dynamics::kernel::Kernel;
use crate::dynamics::schur::NEAR;
use crate::dynamics::{Form, Mechanism, OdeSystem, State, Time, tree};
use crate::stepping::{Cause, Integrator, Statistics, StepError};

/// A method followed by projection after each of its steps; its problem must be in angles and rates, as
/// [`Multiplier`](crate::dynamics::multiplier::Multiplier) is.
#[derive(Clone, Debug)]
pub struct Projected<M> {
    inner: M,
    projector: Option<Projector>,
    /// Energy less work after the last step, and whether that ended near a singular position.
    balance: Option<f64>,
    near: bool,
    /// Where the last step began.
    from: State,
    /// Largest violation left that counts as converged, at both levels, in the units of the mechanism,
    /// relative to levers and speeds where these are larger; no less than the rounding of angles and places.
    pub tolerance: f64,
}

impl<M> Projected<M> {
    /// Projects after the steps of `inner`.
    pub fn new(inner: M) -> Self {
        Self { inner, projector: None, balance: None, near: false, from: State::default(), tolerance: 1e-13 }
    }
}

impl<M> Projected<M> {
    /// Projects the end of a step, or of part of it where it may be shortened; true where that moved it by
    /// more than rounding.
    fn project_back<P>(
        &mut self,
        problem: &mut P,
        state: &mut State,
        is_open: bool,
    ) -> Result<bool, StepError>
    where
        M: Integrator<P>,
        P: Form + ?Sized,
    {
        let Self { inner, projector: Some(projector), from, tolerance, .. } = self else { return Ok(false) };
        let name = inner.name();
        let mut projected = projector.project(problem.mechanism(), state, *tolerance);
        let is_far = projected.as_ref().is_ok_and(|landing| !landing.is_near);
        if is_open && !is_far && inner.shorten(problem, from, state) {
            projected = projector.project(problem.mechanism(), state, *tolerance);
        }
        let mechanism = problem.mechanism();
        let stop = |cause, state: &State, what, hint: &str| StepError {
            cause,
            method: name.into(),
            t: state.time.hi,
            step: 0.0,
            what,
            hint: hint.into(),
        };
        let landing = projected.map_err(|(row, left)| {
            let what = format!("projection leaves {left:.1e} of constraint {row}");
            stop(Cause::ProjectionFailed, state, what, hint(mechanism, &projector.kernel, name))
        })?;
        let was_near = std::mem::replace(&mut self.near, landing.is_near);
        let last = self.balance.replace(landing.balance);
        let lost = last.map_or(0.0, |last| (landing.balance - last).abs()) + landing.energy_change.abs();
        let lost = lost / mechanism.energy_scale;
        if (was_near || self.near) && (lost > LOST || lost.is_nan()) {
            let row = &mechanism.constraints[projector.kernel.weakest.row];
            let what = format!(
                "energy changed by {lost:.1e} of its scale where constraint {} becomes dependent: the motion \
                    left its branch",
                row.name()
            );
            let hint = if row.is_motor() { AT_LIMIT } else { past_singular(name) };
            return Err(stop(Cause::BranchLost, state, what, hint));
        }
        Ok(landing.has_moved)
    }
}

impl<M, P> Integrator<P> for Projected<M>
where
    M: Integrator<P>,
    P: OdeSystem + Form + ?Sized,
{
    fn name(&self) -> &'static str {
        self.inner.name()
    }

    fn order(&self) -> u32 {
        self.inner.order()
    }

    fn begin(&mut self, problem: &mut P, state: &mut State, until: Time) -> Result<(), StepError> {
        // What changes between steps is not a step's.
        self.balance = None;
        self.projector.get_or_insert_with(|| Projector::new(problem));
        self.inner.begin(problem, state, until)
    }

    /// A step of the inner method, put back onto the constraints.
    fn step(
        &mut self,
        problem: &mut P,
        state: &mut State,
        until: Time,
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError> {
        self.from.clone_from(state);
        let event = self.inner.step(problem, state, until, statistics)?;
        if self.project_back(problem, state, event.is_none() && state.time < until)? {
            self.inner.changed(state);
        }
        Ok(event)
    }

    fn is_at(&self, state: &State, until: Time) -> bool {
        self.inner.is_at(state, until)
    }

    fn changed(&mut self, state: &mut State) {
        self.inner.changed(state);
    }

    fn save(&self, state: &mut State) {
        self.inner.save(state);
    }

    fn is_dense(&self) -> bool {
        self.inner.is_dense()
    }

    /// What impacts change of the energy is not a step's.
    fn reset(&mut self, state: &mut State) {
        self.balance = None;
        self.inner.reset(state);
    }

    /// The balance after the last step, if any, and what there is to know of its end; then what the inner
    /// method knows.
    fn internal_state(&self) -> Vec<f64> {
        let own = [f64::from(self.balance.is_some()), self.balance.unwrap_or_default(), f64::from(self.near)];
        own.into_iter().chain(self.inner.internal_state()).collect()
    }

    fn restore_internal_state(&mut self, known: &[f64]) -> bool {
        let Some((&[has_balance, balance, near], rest)) = known.split_first_chunk() else { return false };
        self.balance = (has_balance != 0.0).then_some(balance);
        self.near = near != 0.0;
        self.inner.restore_internal_state(rest)
    }

    /// Inside a step the constraints are kept as well as at its end; where they cannot be, the state is the
    /// step's own.
    fn interpolate(&mut self, problem: &mut P, from: &State, time: Time, inside: &mut State) {
        self.inner.interpolate(problem, from, time, inside);
        if let Some(projector) = &mut self.projector {
            // The violation left is on record in the constraints' drift.
            let _ = projector.project(problem.mechanism(), inside, self.tolerance);
        }
    }

    /// Without projection.
    fn interpolate_roughly(&mut self, problem: &mut P, from: &State, time: Time, inside: &mut State) {
        self.inner.interpolate_roughly(problem, from, time, inside);
    }

    fn land(&mut self, problem: &mut P, from: &State, time: Time, inside: &mut State) -> bool {
        let is_made = self.inner.land(problem, from, time, inside);
        if let Some(projector) = self.projector.as_mut().filter(|_| is_made) {
            let _ = projector.project(problem.mechanism(), inside, self.tolerance);
        }
        is_made
    }
}

/// What to try where constraints cannot be met.
fn hint(mechanism: &Mechanism, kernel: &Kernel<f64>, method: &str) -> &'static str {
    if kernel.weakest.share < NEAR {
        past_singular(method)
    } else if mechanism.constraints.iter().filter(|row| row.is_motor()).count() > 1 {
        "tighten the tolerance, or check that no motors work against each other"
    } else {
        "tighten the tolerance, and look for masses or lengths far out of proportion"
    }
}

/// The same where the constraint that becomes dependent is a motor's.
const AT_LIMIT: &str = "this position is singular: the motor may be at the end of what the mechanism can \
    reach (`driftless kinematics` tells its limits where motors drive all of it), or try another tolerance";

/// What to try where a singular position has not been passed.
fn past_singular(method: &str) -> &'static str {
    if method == "taylor" {
        "this position is singular: try another tolerance, --method dp8, or a start that goes elsewhere"
    } else {
        "this position is singular: try --method taylor, or another tolerance"
    }
}

/// Turns up to this \[rad\] need no new sines, and no new factors of M and S, which change by as little.
const SMALL: f64 = 1e-8;
/// Changes up to this, relative to the rates where they are above one, are rounding: what is known of the
/// rates at the state stays true.
const ROUNDING: f64 = 1e-14;

/// Change of energy less work, or of energy by projection, in a step near a singular position, over the
/// energy scale: more is another branch.
const LOST: f64 = 1e-3;

/// Projects the states of one form: in natural coordinates where it is solved in these, else in angles.
#[derive(Clone, Debug)]
struct Projector {
    kernel: Kernel<f64>,
    natural: Option<NaturalProjection>,
}

impl Projector {
    fn new<P: Form + ?Sized>(problem: &P) -> Self {
        let mechanism = problem.mechanism();
        let natural =
            problem.reduced().map(|reduced| NaturalProjection::new(reduced, 1.0 / mechanism.units.time));
        Self { kernel: Kernel::new(mechanism), natural }
    }

    fn project(
        &mut self,
        mechanism: &Mechanism,
        state: &mut State,
        tolerance: f64,
    ) -> Result<Corrected, (String, f64)> {
        match self.project_naturally(mechanism, state) {
            Some(landing) => Ok(landing),
            None => project(mechanism, &mut self.kernel, state, tolerance),
        }
    }

    /// `None`, and nothing done, where there are no natural coordinates or the position is nearly singular.
    fn project_naturally(&mut self, mechanism: &Mechanism, state: &mut State) -> Option<Corrected> {
        let Self { kernel, natural: Some(natural) } = self else { return None };
        let n = mechanism.coordinates();
        natural.unit_vectors(state, &mut kernel.z);
        let energy = |kernel: &mut Kernel<f64>, state: &State| {
            mechanism.energy_facing::<f64, 0>(kernel, &state.y[..n], &state.y[n..2 * n]).total()
        };
        let energy_before = energy(kernel, state);
        let balance = energy_before - state.y[2 * n] - state.y[2 * n + 1];
        let [turn, change] = natural.land(state, &mut kernel.z)?;
        let mut energy_change = 0.0;
        if turn + change > 0.0 {
            state.wrap();
            energy_change = energy(kernel, state) - energy_before;
            state.y[2 * n + 1] += energy_change;
        }
        let fastest = state.y[n..2 * n]
            .iter()
            .fold(1.0 / mechanism.units.time, |most: f64, omega| most.max(omega.abs()));
        Some(Corrected {
            has_moved: turn.max(change / fastest) > ROUNDING,
            balance,
            energy_change,
            is_near: false,
        })
    }
}

/// What a projection found and did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corrected {
    /// True where something moved by more than rounding.
    pub has_moved: bool,
    /// Energy less work and less what stabilizers put in \[J\]; the projection leaves it as it is.
    pub balance: f64,
    /// Energy the projection put in \[J\].
    pub energy_change: f64,
    /// True near a singular position.
    pub is_near: bool,
}

/// Projects coordinates and rates of a state onto all rows.
///
/// # Errors
/// Name of the worst row and its violation where it cannot be brought below `tolerance`.
pub fn project(
    mechanism: &Mechanism,
    kernel: &mut Kernel<f64>,
    state: &mut State,
    tolerance: f64,
) -> Result<Corrected, (String, f64)> {
    match mechanism.size() {
        1 => project_sized::<1>(mechanism, kernel, state, tolerance),
        2 => project_sized::<2>(mechanism, kernel, state, tolerance),
        3 => project_sized::<3>(mechanism, kernel, state, tolerance),
        _ => project_sized::<0>(mechanism, kernel, state, tolerance),
    }
}

/// [`project`] for `N` bodies (any number where `N` is 0).
fn project_sized<const N: usize>(
    mechanism: &Mechanism,
    kernel: &mut Kernel<f64>,
    state: &mut State,
    tolerance: f64,
) -> Result<Corrected, (String, f64)> {
    let n = tree::size::<N>(mechanism.coordinates());
    let rows = mechanism.constraints.len();
    kernel.unit_vectors::<N>(mechanism, &state.y[..n]);
    let energy_before = mechanism.energy_facing::<f64, N>(kernel, &state.y[..n], &state.y[n..2 * n]).total();
    kernel.factor::<N>(mechanism, &state.y[n..2 * n]);
    kernel.linearise::<N>(mechanism, state.time, &state.y[..n], &state.y[n..2 * n]);
    let (mut last, mut moved, mut far) = (f64::INFINITY, false, 0.0);
    loop {
        // Rows left out have their say once they are back.
        let in_force = (0..rows).filter(|&r| !kernel.is_left_out(r));
        let worst = in_force.map(|r| kernel.rows[r].position.abs() / unit(mechanism, r)).fold(0.0, larger);
        // At rounding, or no longer falling: another iteration would only move it about.
        if worst <= 1e-16 || worst >= 0.5 * last || worst.is_nan() {
            break;
        }
        last = worst;
        for r in 0..rows {
            kernel.multiplier[r] = kernel.rows[r].position;
        }
        kernel.solve_rows();
        let turn = shift(mechanism, kernel, state, 0, -1.0);
        (moved, far) = (true, larger(far, turn));
        let (phi, omega) = (&state.y[..n], &state.y[n..2 * n]);
        if turn <= SMALL {
            let angles = tree::size::<N>(mechanism.bodies.len());
            for (z, &turn) in kernel.z[..angles].iter_mut().zip(&kernel.load) {
                *z = *z - z.left().times(turn) - z.times(0.5 * turn * turn);
            }
            for x in (angles..n).step_by(2) {
                kernel.z[x] = Complex::new(phi[x], phi[x + 1]);
            }
            kernel.rows_at(mechanism, state.time, phi, omega);
        } else {
            kernel.linearise_at::<N>(mechanism, state.time, phi, omega);
        }
    }
    is_position_kept(mechanism, kernel, state, tolerance)?;
    if let Some(change) = project_rates::<N>(mechanism, kernel, state, tolerance)? {
        (moved, far) = (true, larger(far, change));
    }
    let balance = energy_before - state.y[2 * n] - state.y[2 * n + 1];
    let mut energy_change = 0.0;
    if moved {
        state.wrap();
        energy_change = mechanism.energy_facing::<f64, N>(kernel, &state.y[..n], &state.y[n..2 * n]).total()
            - energy_before;
        let is_driven = rows == n + mechanism.assembly.redundant.len();
        let account = if is_driven && kernel.weakest.is_near { 2 * n } else { 2 * n + 1 };
        state.y[account] += energy_change;
    }
    Ok(Corrected { has_moved: far > ROUNDING, balance, energy_change, is_near: kernel.weakest.is_near })
}

/// Adds M⁻¹ Gᵀ times what is in `multiplier`, with a sign, to the unknowns `from`…, and leaves it in `load`;
/// returns its largest entry, those of positions over the unit of length.
pub(super) fn shift(
    mechanism: &Mechanism,
    kernel: &mut Kernel<f64>,
    state: &mut State,
    from: usize,
    sign: f64,
) -> f64 {
    kernel.multiplier_accelerations();
    let mut largest_change = 0.0;
    for (k, &change) in kernel.load.iter().enumerate() {
        (state.y[from + k], state.low[from + k]) =
            two_sum(state.y[from + k], state.low[from + k] + sign * change);
        largest_change = larger(largest_change, change.abs() / size(mechanism, k));
    }
    largest_change
}
