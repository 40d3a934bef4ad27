//! `dopri5` and `dop853`: the Dormand–Prince methods of the crate `ode_solvers`, integrated in windows.
//!
//! The only file that knows the crate.  It owns its loop and keeps every row: a window, from where it began
//! to the time asked for, is integrated at once, and its steps are handed out one by one.  A state in the
//! middle of a window remembers where that began, so that it is integrated again where a run goes on. Its
//! ways, and what is done about them:
//!
//! - Dense output hands out times and states that do not belong together: `Sparse` rows are used, and only
//!   the last one counts.
//! - The twelfth stage of `Dop853` is given the time of the step's start instead of its end (0.6.2), which
//!   spoils the order where the equations depend on time: time rides along as an unknown, and the crate's own
//!   is ignored.
//! - 100 000 steps by default: the budget is ours.  A rate that is not finite comes back as a step-size
//!   underflow: it is looked for first.
//! - Fixed-size vectors are 3 to 4 times faster than dynamic ones: chosen here by length.
//! - What is between two rows is a shorter step from the first of them.
//! - Rows cannot be changed while a window lasts: no projection, no walls.  `dp5` and `dp8` are for those.
//! - A window may run into a pole of a law that the motion leaves before: its rows up to there are handed
//!   out, and only if nobody changes the motion in them does the run stop.
//!
//! The step the crate found is passed on to the next window through the state's memory.

mod rows;
mod window;

use self::rows::{WindowRows, begin};
pub use self::window::Window;
use super::{Cause, Integrator, Statistics, StepError, Tolerance, interruption};
use crate::dynamics::{OdeSystem, State, Time};
use nalgebra::{DVector, SVector};
use ode_solvers::dop_shared::{IntegrationError, OutputType, Stats, System};
use std::marker::PhantomData;

/// Dormand–Prince 5(4) of `ode_solvers`: everyday runs at 1e-3…1e-6.
pub type Dopri5 = Windows<Fifth>;

/// Dormand–Prince 8(5,3) of `ode_solvers`: everyday runs at 1e-6…1e-12.
pub type Dop853 = Windows<Eighth>;

/// A method of the crate.
#[derive(Clone, Debug)]
pub struct Windows<M> {
    /// Tolerance of a step.
    pub tolerance: Tolerance,
    rows: WindowRows,
    method: PhantomData<M>,
}

/// Most numbers among the rows of one call of the crate, which keeps them all: after so many a window is
/// begun anew.
const MOST_KEPT: usize = 1 << 22;
/// And at least so many rows.
const LEAST_KEPT: usize = 64;

impl<M> Windows<M> {
    /// The method at a tolerance.
    pub fn new(tolerance: Tolerance) -> Self {
        Self { tolerance, rows: WindowRows::default(), method: PhantomData }
    }
}

impl<const D: usize> System<f64, SVector<f64, D>> for Window<'_> {
    fn system(&self, _: f64, y: &SVector<f64, D>, rate: &mut SVector<f64, D>) {
        self.rate(y.as_slice(), rate.as_mut_slice());
    }

    fn solout(&mut self, _: f64, y: &SVector<f64, D>, _: &SVector<f64, D>) -> bool {
        self.is_full(y.as_slice())
    }
}

impl System<f64, DVector<f64>> for Window<'_> {
    fn system(&self, _: f64, y: &DVector<f64>, rate: &mut DVector<f64>) {
        self.rate(y.as_slice(), rate.as_mut_slice());
    }

    fn solout(&mut self, _: f64, y: &DVector<f64>, _: &DVector<f64>) -> bool {
        self.is_full(y.as_slice())
    }
}

/// A window's outcome in plain numbers: the rows' times, the rows, counts.
pub type Outcome = (Vec<f64>, Vec<f64>, Result<Stats, IntegrationError>);

/// `integrate!(Stepper, vector)` integrates one window.
macro_rules! integrate {
    ($stepper:path, $window:expr, $vector:expr, $span:expr, $settings:expr) => {{
        let (tolerance, controller, first, max_steps) = $settings;
        let (beta, fac_min, fac_max): (f64, f64, f64) = controller;
        let mut stepper = <$stepper>::from_param(
            $window,
            0.0,
            $span,
            $span,
            $vector,
            tolerance.relative,
            tolerance.absolute,
            0.9,
            beta,
            fac_min,
            fac_max,
            $span,
            first,
            max_steps,
            u32::MAX,
            OutputType::Sparse,
        );
        let outcome = stepper.integrate();
        let rows = stepper.y_out().iter().flat_map(|y| y.as_slice().iter().copied()).collect();
        (stepper.x_out().clone(), rows, outcome)
    }};
}

/// Picks a fixed-size vector by length.
macro_rules! by_length {
    ($stepper:path, $window:expr, $y:expr, $span:expr, $settings:expr; $($d:literal)*) => {
        match $y.len() {
            $($d => integrate!($stepper, $window, SVector::<f64, $d>::from_column_slice($y), $span,
                $settings),)*
            _ => integrate!($stepper, $window, DVector::from_column_slice($y), $span, $settings),
        }
    };
}

/// A stepper of the crate, and what it evaluates in every attempt at a step, and again in every accepted one;
/// it does not count a rejection before the first acceptance.
pub struct Stepper {
    name: &'static str,
    attempt: u64,
    accepted: u64,
}

impl Stepper {
    /// Why it stops at `t` \[s\].
    fn stop(&self, cause: Cause, t: f64, step: f64, what: String, hint: &str) -> StepError {
        StepError { cause, method: self.name.into(), t, step, what, hint: hint.into() }
    }

    /// Looks for a rate that is not finite, which the crate would take for a step that is too small.
    fn check_rate<F: OdeSystem + ?Sized>(
        &self,
        field: &mut F,
        state: &State,
        statistics: &mut Statistics,
    ) -> Result<(), StepError> {
        let mut rate = vec![0.0; state.y.len()];
        field.rhs(state.time, &state.y, &mut rate);
        statistics.evaluations += 1;
        let Some(i) = rate.iter().position(|rate| !rate.is_finite()) else { return Ok(()) };
        let what = format!("the rate of {} is not finite", field.label(i));
        Err(self.stop(Cause::NotFinite, state.time.hi, 0.0, what, super::NOT_FINITE))
    }

    /// Counts what a call of the crate evaluated that made so many steps, the length of the first one found
    /// by itself or not; where it failed at a time \[s\] that `reached` gives, why.
    fn count(
        &self,
        outcome: Result<Stats, IntegrationError>,
        finds_first: bool,
        made: usize,
        reached: impl Fn(f64) -> f64,
        statistics: &mut Statistics,
    ) -> Option<StepError> {
        match outcome {
            Ok(stats) => {
                statistics.evaluations += u64::from(stats.num_eval);
                let begun = if finds_first { 3 } else { 1 };
                let accepted = u64::from(stats.accepted_steps);
                let attempts = (u64::from(stats.num_eval) - begun - self.accepted * accepted) / self.attempt;
                statistics.rejected += attempts - accepted;
                None
            }
            Err(IntegrationError::MaxNumStepReached { x, .. }) => {
                statistics.evaluations = statistics.max_evaluations;
                Some(statistics.exhausted(self.name, reached(x), 0.0))
            }
            Err(IntegrationError::StepSizeUnderflow { x } | IntegrationError::StiffnessDetected { x }) => {
                // What the crate does not tell: at least its accepted steps were evaluated.
                statistics.evaluations += (self.attempt + self.accepted) * made as u64;
                let what = "the step fell below the resolution of time, or a rate became not finite".into();
                let hint = "loosen the tolerance, or take --method taylor or radau9";
                Some(self.stop(Cause::StepTooSmall, reached(x), 0.0, what, hint))
            }
        }
    }
}

/// What integrates one window: it, the unknowns, its length \[s\], the first step \[s\], and most steps.
type Integrate<'a> = dyn FnMut(Window, &[f64], f64, f64, u32) -> Outcome + 'a;

/// The next step of a window, or the first of a new one; nothing where that was interrupted.
fn step<F: OdeSystem + ?Sized>(
    rows: &mut WindowRows,
    stepper: &Stepper,
    integrate: &mut Integrate,
    field: &mut F,
    state: &mut State,
    until: Time,
    statistics: &mut Statistics,
) -> Result<Option<usize>, StepError> {
    if !rows.has_more(until) {
        if rows.after.is_empty() {
            // It may have been interrupted while it was integrated again.
            begin(rows, stepper, integrate, field, state, until)?;
        }
        if let Some(failure) = rows.failure.clone().filter(|_| rows.until == until) {
            return Err(failure);
        }
        if WindowRows::recall(state, until).is_none() {
            rows.clear();
            part(rows, stepper, integrate, field, state, until, statistics)?;
        }
        if !rows.has_more(until) {
            return Ok(None);
        }
    }
    rows.last += 1;
    rows.hand_out(state);
    statistics.steps += 1;
    Ok(None)
}

/// One call of the crate: to `until`, or to where its rows are as many as may be kept, or all evaluations are
/// used up.  Where it is interrupted there are no rows, and nothing is counted.
fn part<F: OdeSystem + ?Sized>(
    kept: &mut WindowRows,
    stepper: &Stepper,
    integrate: &mut Integrate,
    field: &mut F,
    state: &State,
    until: Time,
    statistics: &mut Statistics,
) -> Result<(), StepError> {
    let (n, name) = (state.y.len(), stepper.name);
    let span = (until - state.time).hi;
    statistics.check(name, state.time.hi, state.memory.first().copied().unwrap_or(0.0))?;
    let (before, allowed) = (*statistics, statistics.max_evaluations.saturating_sub(statistics.evaluations));
    stepper.check_rate(field, state, statistics)?;
    let (mut unit, time_unit) = (Vec::new(), field.time_unit());
    super::units(field, n, &mut unit);
    let mut y: Vec<f64> = state.y.iter().zip(&unit).map(|(y, unit)| y / unit).collect();
    y.push(0.0);
    let first = state.memory.first().map_or(0.0, |&h| h.min(span)) / time_unit;
    let most = statistics
        .max_evaluations
        .saturating_sub(statistics.evaluations)
        .div_ceil(stepper.attempt)
        .min(u64::from(u32::MAX)) as u32;
    let most_rows = (MOST_KEPT / (n + 2)).max(LEAST_KEPT);
    let (mut times, mut rows, outcome) = {
        let mut rates = |t: Time, y: &[f64], rate: &mut [f64]| field.rhs(t, y, rate);
        let window = Window::new(&mut rates, state.time, (&unit, time_unit), most_rows, kept.finishes);
        integrate(window, &y, span / time_unit, first, most)
    };
    let reached_time = |x: f64| state.time.hi + x * time_unit;
    kept.failure = None;
    if !kept.finishes && interruption::is_asked() {
        *statistics = before;
        kept.clear();
        return Ok(());
    }
    let made = times.len().saturating_sub(1);
    kept.failure = stepper.count(outcome, first == 0.0, made, reached_time, statistics);
    let finite = rows.chunks(n + 1).take_while(|row| row.iter().all(|y| y.is_finite())).count();
    if let Some(row) = rows.chunks(n + 1).nth(finite) {
        let lost = row.iter().take(n).position(|y| !y.is_finite()).unwrap_or(0);
        let (what, t) = (format!("{} is not finite", field.label(lost)), reached_time(times[finite]));
        let not_finite = || stepper.stop(Cause::NotFinite, t, 0.0, what, "tighten the tolerance");
        kept.failure = kept.failure.take().or_else(|| Some(not_finite()));
        times.truncate(finite);
        rows.truncate(finite * (n + 1));
    }
    let times: Vec<f64> = times.iter().map(|t| t * time_unit).collect();
    if times.len() < 2 || rows.len() != times.len() * (n + 1) {
        if let Some(failure) = kept.failure.take() {
            return Err(failure);
        }
        let what = "the crate made no step".into();
        let hint = "take --method taylor or dp8";
        return Err(stepper.stop(Cause::StepTooSmall, state.time.hi, span, what, hint));
    }
    // A maximum of evaluations ends it as one of rows does: the next part stops, or goes on with more.
    kept.failure = kept.failure.take().filter(|failure| failure.cause != Cause::EffortExhausted);
    let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let next = match steps[..] {
        // One step was enough, or would have been: the second, cut to fit, was still the longer.
        [_] => span.max(first * time_unit),
        [one, two] if two > one => span,
        _ => steps.iter().copied().fold(0.0, f64::max),
    };
    kept.start.clone_from(state);
    kept.start.low.fill(0.0);
    kept.start.memory.resize(1, 0.0);
    (kept.until, kept.after, kept.y, kept.unit) = (until, times, rows, unit);
    (kept.last, kept.next, kept.allowed) = (0, next, allowed as f64);
    Ok(())
}

/// The state at `time` \[s\], by a step of its own from the row before it; where that fails, that row.
fn shorter<F: OdeSystem + ?Sized>(
    stepper: &Stepper,
    integrate: &mut Integrate,
    field: &mut F,
    from: &State,
    time: Time,
    inside: &mut State,
) {
    inside.clone_from(from);
    inside.memory.clear();
    inside.memory.push((time - from.time).hi);
    let mut rows = WindowRows { finishes: true, ..WindowRows::default() };
    let outcome = part(&mut rows, stepper, integrate, field, inside, time, &mut Statistics::default());
    if outcome.is_ok() && rows.failure.is_none() && !rows.after.is_empty() {
        rows.last = rows.after.len() - 1;
        rows.hand_out(inside);
    }
}

/// Which method of the crate.
pub trait Method {
    /// Its numbers.
    #[doc(hidden)]
    const STEPPER: Stepper;
    /// Its order.
    const ORDER: u32;

    /// The crate's method as it is called.
    #[doc(hidden)]
    fn integrate(
        tolerance: Tolerance,
        window: Window,
        y: &[f64],
        span: f64,
        first: f64,
        most: u32,
    ) -> Outcome;
}

/// 5(4).
#[derive(Clone, Copy, Debug)]
pub struct Fifth;

/// 8(5,3).
#[derive(Clone, Copy, Debug)]
pub struct Eighth;

impl Method for Fifth {
    const STEPPER: Stepper = Stepper { name: "dopri5", attempt: 6, accepted: 0 };
    const ORDER: u32 = 5;

    fn integrate(
        tolerance: Tolerance,
        window: Window,
        y: &[f64],
        span: f64,
        first: f64,
        most: u32,
    ) -> Outcome {
        let settings = (tolerance, (0.04, 0.2, 10.0), first, most);
        by_length!(ode_solvers::Dopri5<f64, _, _>, window, y, span, settings; 2 3 4 5 6 7 8 9 10 11 12 13)
    }
}

impl Method for Eighth {
    const STEPPER: Stepper = Stepper { name: "dop853", attempt: 11, accepted: 1 };
    const ORDER: u32 = 8;

    fn integrate(
        tolerance: Tolerance,
        window: Window,
        y: &[f64],
        span: f64,
        first: f64,
        most: u32,
    ) -> Outcome {
        let settings = (tolerance, (0.0, 1.0 / 3.0, 6.0), first, most);
        by_length!(ode_solvers::Dop853<f64, _, _>, window, y, span, settings; 2 3 4 5 6 7 8 9 10 11 12 13)
    }
}

impl<M: Method, F: OdeSystem + ?Sized> Integrator<F> for Windows<M> {
    fn name(&self) -> &'static str {
        M::STEPPER.name
    }

    fn order(&self) -> u32 {
        M::ORDER
    }

    fn begin(&mut self, field: &mut F, state: &mut State, until: Time) -> Result<(), StepError> {
        let mut integrate = called::<M>(self.tolerance);
        begin(&mut self.rows, &M::STEPPER, &mut integrate, field, state, until)
    }

    fn step(
        &mut self,
        field: &mut F,
        state: &mut State,
        until: Time,
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError> {
        let mut integrate = called::<M>(self.tolerance);
        step(&mut self.rows, &M::STEPPER, &mut integrate, field, state, until, statistics)
    }

    fn changed(&mut self, state: &mut State) {
        state.memory.truncate(1);
        self.rows.clear();
    }

    /// What it remembers beyond a window is the step found.
    fn reset(&mut self, state: &mut State) {
        state.memory.truncate(1);
        self.rows.clear();
    }

    fn interpolate(&mut self, field: &mut F, from: &State, time: Time, inside: &mut State) {
        let mut integrate = called::<M>(self.tolerance);
        shorter(&M::STEPPER, &mut integrate, field, from, time, inside);
    }
}

/// A method of the crate at a tolerance.
fn called<M: Method>(tolerance: Tolerance) -> impl FnMut(Window, &[f64], f64, f64, u32) -> Outcome {
    move |window: Window, y: &[f64], span: f64, first: f64, most: u32| {
        M::integrate(tolerance, window, y, span, first, most)
    }
}
