//! `taylor`: the power series of the motion, with adaptive step.
//!
//! Order 20 to 30, adaptive, explicit; keeps nothing by itself, but errs so little that energy stays near rounding.  To choose for the most accurate path, and for
//! speed below about 1e-8.  It asks for a mechanism in the coordinates of [`Elimination`](crate::dynamics::elimination::Elimination), without walls; in double-double
//! it makes references of 1e-25 and better.
//!
//! ```text
//! u(t+h) = u + Σ w_m h^(m+1)/(m+1),    w(t+h) = Σ w_m h^m,    m = 0…P
//! h = tolerance^(1/(P+1)) min over the last five powers k of |w_k|^(-1/k)
//! ```
//!
//! **Trap**: released from rest a symmetric scene has only every fourth power, and a step from the last one or two is far too long; five powers
//! in a row cannot all vanish by symmetry.  Only the increments are rounded: they are added to a (high, low) state, whose low part turns the unit vectors at the next start.
//!
//! Source: À. Jorba, M. Zou, *A software package for the numerical integration of ODEs by means of high-order Taylor methods*, Experimental Mathematics 14 (2005), section 3.2,
//! for steps from the last powers; their two are five here.

mod bodies;
pub mod crowd;
mod direction;
mod driven;
mod extended;
mod fast;
mod pace;
mod pair;
mod terms;
mod wide;

pub use self::crowd::Crowd;
use self::fast::Fast;
use super::{Cause, Method, Reached, Seen, StepError, Tally, Tolerance, Watch};
use crate::arithmetic::{DoubleDouble, Real};
use crate::dynamics::series::{Series, integral, tail};
use crate::dynamics::{Field, Form, Mechanism, State, Time};

/// Powers the step is taken from.
const JUDGES: usize = 5;

/// Which code expands the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kernel {
    /// Lanes where they fit the mechanism and the order, the series for everything else.
    #[default]
    Fastest,
    /// As `Fastest`, but without instructions special to the processor: slowly to the same bits.
    Portable,
    /// [`Series`], which takes every mechanism and every number.
    Series,
}

/// The method on numbers of type `T`: `f64`, or `DoubleDouble` for references.
#[derive(Clone, Debug)]
pub struct Taylor<T> {
    /// First term left out of a rate \[rad/s\] in a step; those of the angles are smaller by the step over the order.
    pub tolerance: f64,
    /// Highest power of the rates.
    pub order: usize,
    /// Most steps in one call of [`Method::advance`].
    pub max_steps: u64,
    /// Which code expands the motion.
    pub kernel: Kernel,
    /// Carries the first powers in double-double: what is rounded are later ones only, which weigh less than a thousandth.  Of use with tolerances
    /// below 1e-18; no effect on double-double itself.
    pub extended: bool,
    fast: Option<Fast>,
    series: Option<Series<T>>,
    u: Vec<T>,
    rest: Vec<T>,
    rate: Vec<T>,
}

impl<T: Real> Taylor<T> {
    /// The method with this tolerance \[rad/s\] and order, at least 8.
    pub fn with_order(tolerance: f64, order: usize) -> Self {
        let order = order.max(2 * JUDGES);
        Self {
            tolerance,
            order,
            max_steps: 10_000_000,
            kernel: Kernel::default(),
            extended: false,
            fast: None,
            series: None,
            u: Vec::new(),
            rest: Vec::new(),
            rate: Vec::new(),
        }
    }
}

impl Taylor<f64> {
    /// The method at a tolerance, with the order that serves it: 16 from 1e-8 up, 20 from 1e-15 up, 24 below.
    pub fn new(tolerance: Tolerance) -> Self {
        let tolerance = tolerance.relative.min(tolerance.absolute);
        let order = match tolerance {
            t if t >= 1e-8 => 16,
            t if t >= 1e-15 => 20,
            _ => 24,
        };
        Self::with_order(tolerance, order)
    }
}

impl Taylor<DoubleDouble> {
    /// References: order 30, so far below rounding in double-double that only this is left.
    pub fn reference() -> Self {
        Self::with_order(1e-36, 30)
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
        self.choose(problem.mechanism());
        let mut taken = 0;
        loop {
            let left = until - state.time;
            if left.hi <= 0.0 {
                return Ok(Reached::Until);
            }
            taken += 1;
            if taken > self.max_steps {
                let what = format!("more than {} steps before t = {} s", self.max_steps, until.hi);
                return Err(stop(Cause::TooManySteps, state, 0.0, what, "loosen the tolerance"));
            }
            tally.evaluations += 1;
            let (wanted, h) = match &mut self.fast {
                Some(fast) => fast.step(state, left.hi),
                None => self.series_step(problem, state, left),
            };
            let hint = "look for a spring of length zero or a position without inertia";
            if wanted.is_nan() {
                let lost = self.lost(problem);
                return Err(stop(Cause::NotFinite, state, 0.0, format!("the series of {lost} is not finite"), hint));
            }
            if wanted < 1e-14 * state.time.hi.abs().max(1e-3) {
                return Err(stop(Cause::StepTooSmall, state, wanted, "the series converges in ever smaller circles".into(), hint));
            }
            state.time = if h == left.hi { until } else { state.time + h };
            state.wrap();
            tally.steps += 1;
            if watch(problem, state)? == Seen::Enough {
                return Ok(Reached::Pause);
            }
        }
    }

    fn is_dense(&self) -> bool {
        true
    }

    fn within(&mut self, problem: &mut P, from: &State, time: Time, inside: &mut State) {
        inside.clone_from(from);
        let h = time - from.time;
        match &self.fast {
            Some(fast) => fast.go(inside, h.hi),
            None => self.go(problem.angles(), inside, h),
        }
        inside.time = time;
        inside.wrap();
    }
}

fn stop(cause: Cause, state: &State, step: f64, what: String, hint: &str) -> StepError {
    StepError { cause, method: "taylor".into(), t: state.time.hi, step, what, hint: hint.into() }
}

impl<T: Real> Taylor<T> {
    /// Keeps the fast kernel at hand, makes the one that fits, or leaves it to the series.
    fn choose(&mut self, mechanism: &Mechanism) {
        let is_portable = self.kernel == Kernel::Portable;
        let (tolerance, order, extended) = (self.tolerance, self.order, self.extended);
        if !T::IS_PLAIN || self.kernel == Kernel::Series {
            self.fast = None;
        } else if !self.fast.as_ref().is_some_and(|fast| fast.is_for(mechanism, tolerance, order, is_portable, extended)) {
            self.fast = Fast::new(mechanism, tolerance, order, is_portable, extended);
        }
    }

    /// One step by the series of any mechanism, of at most `left` \[s\]: the step wanted and the step taken.
    fn series_step<P: Field + Form + ?Sized>(&mut self, problem: &P, state: &mut State, left: Time) -> (f64, f64) {
        let f = problem.angles();
        for vector in [&mut self.u, &mut self.rest, &mut self.rate] {
            vector.resize(f, T::ZERO);
        }
        let order = self.order;
        self.series.take_if(|series| series.order() != order);
        let series = self.series.get_or_insert_with(|| Series::new(problem.mechanism(), order));
        for i in 0..f {
            (self.u[i], self.rest[i]) = T::split(state.unknown(i));
            self.rate[i] = T::split(state.unknown(f + i)).0;
        }
        series.expand(problem.mechanism(), state.time, &self.u, &self.rest, &self.rate);
        let wanted = step(series, f, self.tolerance);
        if wanted.is_nan() {
            return (wanted, 0.0);
        }
        let h = pace::taken(wanted, left.hi);
        self.go(f, state, if h == left.hi { left } else { DoubleDouble::from(h) });
        (wanted, h)
    }

    /// Takes a state of `f` coordinates from where the series was expanded on by `h` \[s\].
    fn go(&self, f: usize, state: &mut State, h: Time) {
        let Some(series) = &self.series else { return };
        let step = T::split(h).0;
        let mut add = |i: usize, increment: T| {
            let sum = state.unknown(i) + increment.double_double();
            (state.y[i], state.low[i]) = (sum.hi, sum.lo);
        };
        for i in 0..f {
            add(i, integral(&series.rate, i, f, step));
            add(f + i, tail(&series.rate, i, f, 1, step));
        }
        add(2 * f, integral(&series.power, 0, 1, step));
    }

    /// The unknown whose series is not finite, as far as it is known.
    fn lost<P: Field + ?Sized>(&self, problem: &P) -> String {
        let f = problem.angles();
        let rates = self.series.as_ref().map_or(&[][..], |series| &series.rate);
        let lost = rates.iter().position(|rate| !rate.value().is_finite()).map_or(0, |at| at % f.max(1));
        problem.label(f + lost)
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
        if largest > 0.0 {
            step = step.min(libm::pow(largest, -1.0 / k as f64));
        }
    }
    step * libm::pow(tolerance, 1.0 / (series.order() + 1) as f64)
}
