//! `taylor`: the power series of the motion, with adaptive step.
//!
//! Order 20 to 30, adaptive, explicit; keeps nothing by itself, but errs so little that energy stays near rounding.  To choose for the most accurate path, and for
//! speed below about 1e-8.  It asks for a mechanism in the coordinates of [`Elimination`](crate::dynamics::elimination::Elimination), without walls; in double-double
//! it makes references of 1e-25 and better.
//!
//! ```text
//! u(t+h) = u + Σ w_m h^(m+1)/(m+1),    w(t+h) = Σ w_m h^m,    m = 0…P
//! h = min over the last five powers k of (tolerance / |w_k/(k+1)|)^(1/(k+1))
//! ```
//!
//! **Trap**: released from rest a symmetric scene has only every fourth power, and a step from the last one or two is far too long; five powers
//! in a row cannot all vanish by symmetry.  Only the increments are rounded: they are added to a (high, low) state, whose low part turns the unit vectors at the next start.
//!
//! Source: À. Jorba, M. Zou, *A software package for the numerical integration of ODEs by means of high-order Taylor methods*, Experimental Mathematics 14 (2005), section 3.2,
//! for steps from the last powers; their two are five here.

use super::{Cause, Method, Reached, Seen, StepError, Tally, Tolerance, Watch};
use crate::arithmetic::{DoubleDouble, Real};
use crate::dynamics::series::{Series, integral, tail};
use crate::dynamics::{Field, Form, State, Time};

/// Powers the step is taken from.
const JUDGES: usize = 5;

/// The method on numbers of type `T`: `f64`, or `DoubleDouble` for references.
#[derive(Clone, Debug)]
pub struct Taylor<T> {
    /// Largest term left out of an angle \[rad\] in a step; rates follow.
    pub tolerance: f64,
    /// Highest power of the rates.
    pub order: usize,
    /// Most steps in one call of [`Method::advance`].
    pub max_steps: u64,
    series: Option<Series<T>>,
    u: Vec<T>,
    rest: Vec<T>,
    rate: Vec<T>,
}

impl<T: Real> Taylor<T> {
    /// The method with this tolerance \[rad\] and order, at least 8.
    pub fn with_order(tolerance: f64, order: usize) -> Self {
        let order = order.max(2 * JUDGES);
        Self { tolerance, order, max_steps: 10_000_000, series: None, u: Vec::new(), rest: Vec::new(), rate: Vec::new() }
    }
}

impl Taylor<f64> {
    /// The method at a tolerance, with the order that serves it: 16 from 1e-6 up, 20 from 1e-9 up, 24 below.
    pub fn new(tolerance: Tolerance) -> Self {
        let tolerance = tolerance.relative.min(tolerance.absolute);
        let order = match tolerance {
            t if t >= 1e-6 => 16,
            t if t >= 1e-9 => 20,
            _ => 24,
        };
        Self::with_order(tolerance, order)
    }
}

impl Taylor<DoubleDouble> {
    /// References: order 30, so far below rounding in double-double that only this is left.
    pub fn reference() -> Self {
        Self::with_order(1e-32, 30)
    }
}

impl<T: Real, P: Field + Form + ?Sized> Method<P> for Taylor<T> {
    fn name(&self) -> &'static str {
        "taylor"
    }

    fn order(&self) -> u32 {
        self.order as u32
    }

    fn advance(
        &mut self,
        problem: &mut P,
        state: &mut State,
        until: Time,
        tally: &mut Tally,
        watch: &mut Watch<P>,
    ) -> Result<Reached, StepError> {
        let f = problem.angles();
        for vector in [&mut self.u, &mut self.rest, &mut self.rate] {
            vector.resize(f, T::ZERO);
        }
        let mut taken = 0;
        loop {
            let left = (until - state.time).hi;
            if left <= 0.0 {
                return Ok(Reached::Until);
            }
            let stop = |cause, step, what: String, hint: &str| StepError {
                cause,
                method: "taylor".into(),
                t: state.time.hi,
                step,
                what,
                hint: hint.into(),
            };
            taken += 1;
            if taken > self.max_steps {
                let what = format!("more than {} steps before t = {} s", self.max_steps, until.hi);
                return Err(stop(Cause::TooManySteps, 0.0, what, "loosen the tolerance"));
            }
            let series = self.series.get_or_insert_with(|| Series::new(problem.mechanism(), self.order));
            for i in 0..f {
                (self.u[i], self.rest[i]) = T::split(state.unknown(i));
                self.rate[i] = T::split(state.unknown(f + i)).0;
            }
            series.expand(problem.mechanism(), state.time, &self.u, &self.rest, &self.rate);
            tally.evaluations += 1;
            let wanted = step(series, f, self.tolerance);
            if wanted.is_nan() {
                let lost = series.rate.iter().position(|rate| !rate.value().is_finite()).map_or(0, |at| at % f.max(1));
                let what = format!("the series of {} is not finite", problem.label(f + lost));
                return Err(stop(Cause::NotFinite, 0.0, what, "look for a spring of length zero or a position without inertia"));
            }
            if wanted < 1e-14 * state.time.hi.abs().max(1e-3) {
                let what = "the series converges in ever smaller circles".into();
                return Err(stop(Cause::StepTooSmall, wanted, what, "look for a spring of length zero or a position without inertia"));
            }
            let whole = wanted >= left;
            let h = if whole {
                left
            } else if wanted > 0.5 * left {
                0.5 * left
            } else {
                wanted
            };
            let exact = if whole { until - state.time } else { DoubleDouble::from(h) };
            let step = T::split(exact).0;
            let mut add = |i: usize, increment: T| {
                let sum = state.unknown(i) + increment.double_double();
                (state.y[i], state.low[i]) = (sum.hi, sum.lo);
            };
            for i in 0..f {
                add(i, integral(&series.rate, i, f, step));
                add(f + i, tail(&series.rate, i, f, 1, step));
            }
            add(2 * f, integral(&series.power, 0, 1, step));
            state.time = if whole { until } else { state.time + exact };
            state.wrap();
            tally.steps += 1;
            if watch(problem, state)? == Seen::Changed {
                state.memory.clear();
            }
        }
    }
}

/// The step at which the last powers fall below the tolerance \[s\]; infinite where they all vanish, not a number where one is.
fn step<T: Real>(series: &Series<T>, coordinates: usize, tolerance: f64) -> f64 {
    let mut step = f64::INFINITY;
    for k in series.order() + 1 - JUDGES..=series.order() {
        let rates = &series.rate[k * coordinates..(k + 1) * coordinates];
        let largest = rates.iter().fold(0.0, |largest: f64, rate| {
            let size = rate.value().abs();
            if size.is_nan() || largest.is_nan() { f64::NAN } else { largest.max(size) }
        });
        if largest.is_nan() {
            return f64::NAN;
        }
        let power = (k + 1) as f64;
        if largest > 0.0 {
            step = step.min(libm::pow(tolerance * power / largest, 1.0 / power));
        }
    }
    step
}
