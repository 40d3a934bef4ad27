//! Radau IIA collocation: `radau5` with three stages and `radau9` with five, of order 2s - 1.
//!
//! Implicit, adaptive, stiffly accurate and L-stable: fast modes that are damped cost it nothing once they
//! have died away, and its steps follow the slow motion. To choose for dampers and damped stiff springs.
//! Modes that grow it would damp as well, so that steps are short enough for them (`step_size.rs`).
//! *Not* for stiff springs that swing: it eats their energy wherever its steps are longer than their periods,
//! and where they are not the explicit methods are cheaper.  It asks for a field with a
//! [Jacobian](OdeSystem::jacobian).
//!
//! ```text
//! z_i = h Σ_j a_ij f(t + c_j h, y + z_j),      y1 = y + z_s
//! simplified Newton:   (1 - h mu_k J) dw_k = l_k (h A F - Z),      dz = Σ r_k dw_k     1 real mode
//! err = h mu_0 (1 - h mu_0 J)^-1 (f(y) + Σ e_i z_i / h)
//!     a formula of order s; filtered once more after a rejection
//! ```
//!
//! Starting values are those of the last step's polynomial, which is also the solution inside a step.  The
//! Jacobian is kept while the iteration contracts by a thousand, its factors while the step would grow by
//! less than a fifth; the step follows from the last two errors (K. Gustafsson, ACM TOMS 20 (1994)). All of
//! that is in the state's memory, the Jacobian by the point it was taken at.
//!
//! Source: E. Hairer, G. Wanner, *Solving Ordinary Differential Equations II*, 2nd ed. (1996), section IV.8;
//! the same, *Stiff differential equations solved by Radau methods*, J. Comput. Appl. Math. 111 (1999).

mod dense;
mod newton;
mod step_size;
mod tableau;

use self::newton::NewtonEnd;
use self::tableau::RadauTableau;
use super::event::{Met, SearchScratch, Stride};
use super::linear::LuFactors;
use super::{Cause, Integrator, Statistics, StepError, Tolerance, scales};
use crate::arithmetic::sum::{fast_two_sum, two_sum};
use crate::arithmetic::{Complex, DoubleDouble, Scalar};
use crate::dynamics::{OdeSystem, State, Time};

/// Safety factor of the step.
const SAFE: f64 = 0.9;
/// Bounds of the ratio of a step to the next one.
const QUOTIENT: [f64; 2] = [1.0 / 8.0, 5.0];
/// Contraction up to which the Jacobian is kept.
const KEPT: f64 = 1e-3;
/// Growth of the step up to which the factors are kept, and the step with them.
const SAME: f64 = 1.2;
/// Steps that came out not finite in a row after which it stops.
const MOST_CUTS: u32 = 10;

/// A Radau IIA method with its step control and scratch space.
#[derive(Clone, Debug)]
pub struct Radau {
    /// Tolerance of a step.
    pub tolerance: Tolerance,
    tableau: RadauTableau,
    work: RadauScratch,
    control: Control,
    /// True where the step is the first, or the last attempt was rejected.
    is_hard: bool,
}

/// Scratch space of d unknowns and s stages.
#[derive(Clone, Debug, Default)]
struct RadauScratch {
    /// J (d × d), and where it was taken.
    jacobian: Vec<f64>,
    place: (Time, Vec<f64>),
    /// The longest step in which it resolves what grows \[s\], once it was asked for.
    longest: Option<f64>,
    /// Factors of 1 - h mu J, one a mode, for the step `factored`; zero where there are none.
    real: LuFactors<f64>,
    pairs: Vec<LuFactors<Complex<f64>>>,
    factored: f64,
    /// Stages less y, their changes, their rates (s × d).
    z: Vec<f64>,
    change: Vec<f64>,
    rates: Vec<f64>,
    /// Stages of the last accepted step less its start (s × d), and its length \[s\].
    last: Vec<f64>,
    length: f64,
    /// f(y), for the state of the step (d).
    start: Vec<f64>,
    /// (d each)
    units: Vec<f64>,
    scale: Vec<f64>,
    stage: Vec<f64>,
    low: Vec<f64>,
    mode: Vec<f64>,
    wide: Vec<Complex<f64>>,
    error: Vec<f64>,
    next: Vec<f64>,
    next_low: Vec<f64>,
    next_rate: Vec<f64>,
    /// Weights of the polynomial (s).
    weights: Vec<f64>,
    search: SearchScratch,
}

/// What the next step depends on beside the unknowns, the last polynomial and the Jacobian.
#[derive(Clone, Copy, Debug, Default)]
struct Control {
    /// The step proposed \[s\].
    wanted: f64,
    /// The last accepted step \[s\], zero before the first, and its error.
    accepted: f64,
    error: f64,
    /// theta/(1 - theta) of the last iteration.
    contraction: f64,
    /// One where the Jacobian may be kept.
    keeps: f64,
}

impl Control {
    /// Proposes the next step after an accepted one of `h` \[s\] with its error, the quotient that asks for,
    /// and the contraction of its iteration.
    fn accept(&mut self, h: f64, error: f64, exponent: f64, mut quotient: f64, theta: f64, is_hard: bool) {
        if self.accepted > 0.0 {
            let predicted = (self.accepted / h) * libm::pow(error * error / self.error, exponent) / SAFE;
            quotient = quotient.max(predicted.clamp(QUOTIENT[0], QUOTIENT[1]));
        }
        let grown = if is_hard && self.accepted > 0.0 { (h / quotient).min(h) } else { h / quotient };
        (self.accepted, self.error) = (h, error.max(1e-2));
        self.keeps = f64::from(theta <= KEPT);
        let same = theta <= KEPT && (1.0..=SAME).contains(&(grown / h));
        let proposed = if same { h } else { grown };
        // A step cut short says nothing against the longer one proposed before it.
        self.wanted = if h < self.wanted { proposed.max(self.wanted) } else { proposed };
    }
}

/// Numbers of [`Control`] and of the time of the Jacobian.
const CONTROLS: usize = 7;

impl Radau {
    /// The method of three or five stages; `None` for any other number.
    pub fn new(stages: usize, tolerance: Tolerance) -> Option<Self> {
        Some(Self {
            tolerance,
            tableau: RadauTableau::new(stages)?,
            work: RadauScratch::default(),
            control: Control::default(),
            is_hard: true,
        })
    }

    fn id(&self) -> &'static str {
        if self.tableau.stages() == 3 { "radau5" } else { "radau9" }
    }

    fn stop(&self, cause: Cause, state: &State, step: f64, what: String, hint: &str) -> StepError {
        StepError { cause, method: self.id().into(), t: state.time.hi, step, what, hint: hint.into() }
    }

    /// Takes back what the state carries; false where it carries nothing of the kind, or a proposed step
    /// alone.
    fn recall(&mut self, state: &State, control: &mut Control) -> bool {
        let (d, s) = (state.y.len(), self.tableau.stages());
        if let [wanted] = state.memory[..] {
            control.wanted = wanted;
        }
        let (Some((numbers, rest)), true) =
            (state.memory.split_first_chunk::<CONTROLS>(), state.memory.len() == CONTROLS + (s + 1) * d)
        else {
            return false;
        };
        let &[wanted, accepted, error, contraction, keeps, hi, lo] = numbers;
        *control = Control { wanted, accepted, error, contraction, keeps };
        let (place, last) = rest.split_at(d);
        self.work.last.copy_from_slice(last);
        let time = Time { hi, lo };
        if self.work.place != (time, place.to_vec()) {
            self.work.place = (time, place.to_vec());
            self.work.jacobian.clear();
        }
        true
    }

    fn remember(&self, state: &mut State, control: &Control) {
        let &Control { wanted, accepted, error, contraction, keeps } = control;
        let (Time { hi, lo }, place) = &self.work.place;
        state.memory.clear();
        state.memory.extend([wanted, accepted, error, contraction, keeps, *hi, *lo]);
        state.memory.extend_from_slice(place);
        state.memory.extend_from_slice(&self.work.last);
    }

    /// The new state, and the error over the tolerance; filtered once more where the step is a hard one, just
    /// rejected or the first.
    fn estimate<F: OdeSystem + ?Sized>(
        &mut self,
        field: &mut F,
        state: &State,
        h: f64,
        is_hard: bool,
        statistics: &mut Statistics,
    ) -> f64 {
        let Self { tableau, work, .. } = self;
        let (s, d) = (tableau.stages(), state.y.len());
        let fade = h * tableau.real.value;
        for k in 0..d {
            work.mode[k] = (0..s).fold(0.0, |sum, i| sum + tableau.estimate[i] * work.z[i * d + k]) / h;
            work.error[k] = work.start[k] + work.mode[k];
        }
        let norm = |error: &mut [f64], work: &RadauScratch| {
            work.real.solve(error);
            let mut sum = 0.0;
            for (error, scale) in error.iter_mut().zip(&work.scale) {
                *error *= fade;
                sum += (*error / scale) * (*error / scale);
            }
            (sum / d as f64).sqrt()
        };
        let mut error = std::mem::take(&mut work.error);
        let mut size = norm(&mut error, work);
        if is_hard && size >= 1.0 {
            for k in 0..d {
                let (sum, rest) = two_sum(state.y[k], error[k]);
                (work.stage[k], work.low[k]) = fast_two_sum(sum, rest + state.low[k]);
            }
            field.fine_rate(state.time, &work.stage, &work.low, &mut error);
            statistics.evaluations += 1;
            for k in 0..d {
                error[k] += work.mode[k];
            }
            size = norm(&mut error, work);
        }
        work.error = error;
        self.close(state);
        size
    }

    /// Moves the state to the end of an accepted step of `h` \[s\].
    fn finish_step(&mut self, state: &mut State, h: f64, time: Time) {
        self.work.last.copy_from_slice(&self.work.z);
        self.work.length = h;
        state.y.copy_from_slice(&self.work.next);
        state.low.copy_from_slice(&self.work.next_low);
        state.time = time;
        state.wrap();
    }

    /// Writes the new state.
    fn close(&mut self, state: &State) {
        let d = state.y.len();
        let end = self.work.z.len() - d;
        for k in 0..d {
            let (sum, rest) = two_sum(state.y[k], self.work.z[end + k]);
            (self.work.next[k], self.work.next_low[k]) = fast_two_sum(sum, rest + state.low[k]);
        }
    }

    /// The component that asks most of the step, or the derivatives that are to solve for it.
    fn culprit<F: OdeSystem + ?Sized>(&self, field: &F) -> String {
        let RadauScratch { error, scale, jacobian, .. } = &self.work;
        if jacobian.iter().any(|slope| !slope.is_finite()) {
            return "a derivative of the accelerations".into();
        }
        let share = |k: usize| (error[k] / scale[k]).abs();
        let most = (0..scale.len()).max_by(|&a, &b| share(a).total_cmp(&share(b)));
        most.map_or_else(String::new, |k| field.label(k))
    }

    fn resize(&mut self, d: usize) {
        let s = self.tableau.stages();
        let work = &mut self.work;
        for stages in [&mut work.z, &mut work.change, &mut work.rates, &mut work.last] {
            stages.resize(s * d, 0.0);
        }
        for vector in [
            &mut work.start,
            &mut work.scale,
            &mut work.stage,
            &mut work.low,
            &mut work.mode,
            &mut work.error,
            &mut work.next,
            &mut work.next_low,
            &mut work.next_rate,
        ] {
            vector.resize(d, 0.0);
        }
        work.wide.resize(d, Complex::ZERO);
        work.weights.resize(s, 0.0);
    }
}

impl<F: OdeSystem + ?Sized> Integrator<F> for Radau {
    fn name(&self) -> &'static str {
        self.id()
    }

    fn order(&self) -> u32 {
        2 * self.tableau.stages() as u32 - 1
    }

    fn begin(&mut self, field: &mut F, state: &mut State, until: Time) -> Result<(), StepError> {
        let d = state.y.len();
        super::refuse_the_past(self.id(), state, until, field.time_unit())?;
        self.resize(d);
        super::units(field, d, &mut self.work.units);
        let mut control = Control { wanted: 0.0, accepted: 0.0, error: 1.0, contraction: 1.0, keeps: 0.0 };
        self.is_hard = !self.recall(state, &mut control);
        self.control = control;
        Ok(())
    }

    fn step(
        &mut self,
        field: &mut F,
        state: &mut State,
        until: Time,
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError> {
        let left = (until - state.time).hi;
        field.fine_rate(state.time, &state.y, &state.low, &mut self.work.start);
        statistics.evaluations += 1;
        scales(self.tolerance, &state.y, &self.work.units, &mut self.work.scale);
        let (mut control, mut cuts) = (self.control, 0);
        if control.wanted == 0.0 {
            control.wanted = self.first_step(state, left, 1e-6 * field.time_unit());
        }
        loop {
            let (h, whole) = super::reach(control.wanted, left);
            statistics.check(self.id(), state.time.hi, h)?;
            let is_finest = h < super::finest(state, field.time_unit()) && !whole;
            if cuts > MOST_CUTS || is_finest {
                return Err(self.too_short(field, state, h, cuts > 0));
            }
            if !self.linearise(field, state, h, control.keeps == 0.0, statistics) {
                let what = "this form of the equations has no Jacobian".into();
                return Err(self.stop(Cause::Unsuited, state, h, what, "use dp8"));
            }
            if let Some(shorter) = self.shortened_by_growth(field.may_grow_by_rates(), h) {
                control.wanted = shorter;
                continue;
            }
            self.predict(h, control.accepted, false);
            // A work integral follows the motion and not the reverse: two iterations make it exact, and their
            // contraction says nothing of the first one of stages that no polynomial predicts.
            if control.accepted == 0.0 {
                control.contraction = 1.0;
            }
            let solved = self.solve(field, state, h, &mut control.contraction, statistics);
            let (theta, sweeps) = match solved {
                NewtonEnd::Converged(theta, sweeps) => (theta, sweeps),
                NewtonEnd::Slow(factor) => {
                    statistics.rejected += 1;
                    (self.is_hard, control.wanted, control.keeps) = (true, h * factor, 0.0);
                    continue;
                }
                NewtonEnd::NotFinite => (f64::NAN, 0),
            };
            let error = if sweeps > 0 {
                self.estimate(field, state, h, self.is_hard, statistics).max(1e-10)
            } else {
                f64::NAN
            };
            if !error.is_finite() {
                cuts += 1;
                statistics.rejected += 1;
                (self.is_hard, control.wanted, control.keeps) = (true, 0.1 * h, 0.0);
                continue;
            }
            cuts = 0;
            let (exponent, quotient) = self.quotient(error, sweeps);
            if error >= 1.0 {
                statistics.rejected += 1;
                let is_first = control.accepted == 0.0;
                (self.is_hard, control.wanted, control.keeps) =
                    (true, if is_first { 0.1 * h } else { h / quotient }, 0.0);
                continue;
            }
            let (h, event, lands) = match self.meet(field, state, h, statistics) {
                Met::Whole => (h, None, whole),
                Met::Short(short) => (short, None, false),
                Met::Event(short, event) => (short, Some(event), false),
                Met::Failed if h > super::finest(state, field.time_unit()) => {
                    statistics.rejected += 1;
                    (self.is_hard, control.wanted) = (true, h / 8.0);
                    continue;
                }
                Met::Failed | Met::AtRest => return Err(super::at_rest(self.id(), state, h)),
            };
            control.accept(h, error, exponent, quotient, theta, self.is_hard);
            self.is_hard = false;
            self.control = control;
            let end = if lands { until } else { state.time + DoubleDouble::of(h) };
            self.finish_step(state, h, end);
            self.remember(state, &control);
            statistics.steps += 1;
            return Ok(event);
        }
    }

    fn is_dense(&self) -> bool {
        true
    }

    /// By the polynomial through the stages, to the order of the stages.
    fn interpolate(&mut self, _problem: &mut F, from: &State, time: Time, inside: &mut State) {
        let (s, d) = (self.tableau.stages(), from.y.len());
        inside.clone_from(from);
        inside.memory.clear();
        inside.time = time;
        let share = (time - from.time).hi / self.work.length;
        let mut weights = [0.0; 5];
        self.tableau.lagrange(share, &mut weights[..s]);
        for k in 0..d {
            let change = (0..s).fold(0.0, |sum, j| sum + weights[j] * self.work.last[j * d + k]);
            (inside.y[k], inside.low[k]) = two_sum(from.y[k], change + from.low[k]);
        }
        inside.wrap();
    }

    /// By a step of its own: the polynomial has the order of the stages, the end of a step nearly twice that.
    fn land(&mut self, field: &mut F, from: &State, time: Time, inside: &mut State) -> bool {
        let mut spare = self.clone();
        if !spare.repeat(field, from, (time - from.time).hi, &mut Statistics::default()) {
            return false;
        }
        inside.clone_from(from);
        inside.memory.clear();
        inside.time = time;
        inside.y.copy_from_slice(&spare.work.next);
        inside.low.copy_from_slice(&spare.work.next_low);
        inside.wrap();
        true
    }

    /// Keeps the step proposed, which comes first.
    fn reset(&mut self, state: &mut State) {
        state.memory.truncate(1);
    }
}

#[cfg(test)]
mod tests;
