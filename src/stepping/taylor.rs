//! `taylor`: the power series of the motion, with adaptive step.
//!
//! Order 16 to 30, adaptive, explicit; keeps nothing by itself, but errs so little that energy stays near
//! rounding.  To choose for the most accurate path, and for speed below about 1e-8.  It asks for a form in
//! angles and rates: [`Elimination`](crate::dynamics::elimination::Elimination), or
//! [`Multiplier`](crate::dynamics::multiplier::Multiplier), whose rows are solved for with every order.  In
//! double-double it makes references of 1e-25 and better.
//!
//! ```text
//! u(t+h) = u + Σ w_m h^(m+1)/(m+1),    w(t+h) = Σ w_m h^m,    m = 0…P
//! h = tolerance^(1/(P+1)) min over the last five powers k of |w_k|^(-1/k)
//! ```
//!
//! **Trap**: released from rest a symmetric scene has only every fourth power, and a step from the last one
//! or two is far too long; five powers in a row cannot all vanish by symmetry.  Only the increments are
//! rounded: they are added to a (high, low) state, whose low part turns the unit vectors at the next start.
//!
//! Small mechanisms with loops are expanded in unit vectors (module `looped`) and put back onto all rows at
//! the end of every step; near singular positions the series of any mechanism takes over (module `singular`).
//!
//! The series is the dense output: [`Integrator::interpolate`] sums it at any time in the step, so that steps
//! need not end on output times.  It is the event finder, too: gaps of walls are polynomials of the step
//! (module `search`), and the state is brought onto their first zero. With [`Taylor::extended`] the first
//! powers are found in double-double, and the later ones go on from them.
//!
//! Source: À. Jorba, M. Zou, *A software package for the numerical integration of ODEs by means of high-order
//! Taylor methods*, Experimental Mathematics 14 (2005), section 3.2, for steps from the last powers; their
//! two are five here.

mod approach;
pub mod batch;
mod bodies;
mod confirm;
mod direction;
mod driven;
mod expansion;
mod extended;
mod fast;
mod looped;
mod pair;
mod singular;
mod springs;
mod step_size;
mod swinging;
mod terms;
mod walls;
mod wide;

use self::approach::Approach;
pub use self::batch::Batch;
use self::expansion::Expansion;
use self::fast::Fast;
use self::singular::SingularPassage;
use self::walls::{trace, walls_known};
use super::event::FirstEvent;
use super::search::{self, PowerSeries};
use super::{Cause, Integrator, Statistics, StepError, Tolerance};
use crate::arithmetic::DoubleDouble;
use crate::dynamics;
use crate::dynamics::series::Coefficient;
use crate::dynamics::{Coordinates, Form, Mechanism, MotionPowers, OdeSystem, State, Time};

/// Highest order of the code that has room of a fixed size.
const HIGHEST_ORDER: usize = 24;
/// Powers the step is taken from.
const JUDGES: usize = 5;
/// Powers of the rates beyond the first that `extended` carries in double-double.
const LEADING: usize = 6;
/// States an event is landed on with, at most.
const LANDINGS: usize = 6;

/// Which code expands the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExpansionKernel {
    /// Lanes where they fit the mechanism and the order, the series for everything else.
    #[default]
    Fastest,
    /// As `Fastest`, but without instructions special to the processor: slowly to the same bits.
    Portable,
    /// [`Series`](crate::dynamics::series::Series), which takes every mechanism and every number.
    Series,
}

/// The method on numbers of type `T`: `f64`, or `DoubleDouble` for references.
#[derive(Clone, Debug)]
pub struct Taylor<T: Coefficient> {
    /// First term left out of a rate in a step, in the units of the mechanism (rad/s where it is of human
    /// size: see [`Units`](crate::dynamics::Units)); those of the angles are smaller by the step over the
    /// order.
    pub tolerance: f64,
    /// Highest power of the rates.
    pub order: usize,
    /// Which code expands the motion.
    pub kernel: ExpansionKernel,
    /// Carries the first powers in double-double: what is rounded are later ones only, which weigh less than
    /// a thousandth.  Of use with tolerances below 1e-18; no effect on double-double itself.
    pub extended: bool,
    fast: Option<Fast>,
    expansion: Option<Expansion<T>>,
    /// True where the last step was made by the expansion.
    by_series: bool,
    /// What passages through singular positions are looked for with.
    singular_passage: Option<SingularPassage<T>>,
    powers: Vec<f64>,
    gaps: Vec<f64>,
    inside: State,
    approach: Approach,
}

impl<T: Coefficient> Taylor<T> {
    /// The method with this tolerance \[rad/s\] and order, at least 10.
    pub fn with_order(tolerance: f64, order: usize) -> Self {
        let order = order.max(2 * JUDGES);
        Self {
            tolerance,
            order,
            kernel: ExpansionKernel::default(),
            extended: false,
            fast: None,
            expansion: None,
            by_series: true,
            singular_passage: None,
            powers: Vec::new(),
            gaps: Vec::new(),
            inside: State::default(),
            approach: Approach::default(),
        }
    }
}

impl Taylor<f64> {
    /// The method at a tolerance, with the order that serves it: 16 from 1e-7 up, 20 from 1e-15 up, 24 below.
    pub fn new(tolerance: Tolerance) -> Self {
        let tolerance = tolerance.relative.min(tolerance.absolute);
        let order = match tolerance {
            t if t >= 1e-7 => 16,
            t if t >= 1e-15 => 20,
            _ => 24,
        };
        Self::with_order(tolerance, order)
    }

    /// True where free motions of the mechanism are expanded in lanes, or their first orders in double-double
    /// where `extended`.
    pub fn has_lanes(mechanism: &Mechanism, extended: bool) -> bool {
        mechanism.contacts.is_empty() && Fast::new(mechanism, 1.0, 24, false, extended).is_some()
    }
}

impl Taylor<DoubleDouble> {
    /// References: order 30, so far below rounding in double-double that only this is left.
    pub fn reference() -> Self {
        Self::with_order(1e-36, 30)
    }
}

impl<T: Coefficient, P: OdeSystem + Form + ?Sized> Integrator<P> for Taylor<T> {
    fn name(&self) -> &'static str {
        "taylor"
    }

    fn order(&self) -> u32 {
        self.order as u32
    }

    fn begin(&mut self, problem: &mut P, state: &mut State, until: Time) -> Result<(), StepError> {
        super::refuse_the_past("taylor", state, until, problem.time_unit())?;
        self.choose(problem, state)?;
        self.approach.take_in(problem.mechanism());
        state.memory.clear();
        Ok(())
    }

    fn step(
        &mut self,
        problem: &mut P,
        state: &mut State,
        until: Time,
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError> {
        let left = until - state.time;
        statistics.check("taylor", state.time.hi, 0.0)?;
        statistics.evaluations += 1;
        self.approach.begin(state);
        let quick = self.fast.as_mut().and_then(|fast| fast.step(state, left.hi));
        self.by_series = quick.is_none();
        let (wanted, mut h) = quick.unwrap_or_else(|| self.expand(problem, state, left.hi));
        let hint = super::NOT_FINITE;
        if wanted.is_nan() {
            let lost = problem.label(problem.angles() + self.expansion.as_ref().map_or(0, Expansion::lost));
            return Err(stop(
                Cause::NotFinite,
                state,
                0.0,
                format!("the series of {lost} is not finite"),
                hint,
            ));
        }
        if wanted < super::finest(state, problem.time_unit()) {
            if self.by_series
                && self.expansion.as_ref().is_some_and(|expansion| singular::is_near(problem, expansion))
            {
                let what = "the constraints are dependent here, and no way through the singular position is \
                    confirmed"
                    .into();
                return Err(stop(Cause::BranchLost, state, wanted, what, singular::HINT));
            }
            return Err(stop(
                Cause::StepTooSmall,
                state,
                wanted,
                "the series converges in ever smaller circles".into(),
                hint,
            ));
        }
        if !self.approach.is_empty() {
            h = self.before_meeting(problem, state, h);
        }
        let mut event = None;
        if self.by_series {
            if problem.mechanism().needs_confirmation() {
                // What takes less than the resolution of time is passed by it.
                let least = super::finest(state, problem.time_unit()).min(h);
                h = self.confirmed(problem, state, h).max(least);
            }
            if problem.events() > 0 {
                (h, event) = self.meet(problem, state, h)?;
            }
            if let Some(expansion) = &self.expansion {
                expansion.go(state, if h == left.hi { left } else { DoubleDouble::from(h) });
            }
        }
        state.time = if h == left.hi { until } else { state.time + h };
        if !T::IS_PLAIN
            && let Some(passage) = &mut self.singular_passage
            && self.expansion.as_ref().is_some_and(|expansion| singular::is_near(problem, expansion))
        {
            passage.put_back(problem.mechanism(), state);
        }
        state.wrap();
        statistics.steps += 1;
        Ok(event)
    }

    fn is_dense(&self) -> bool {
        true
    }

    fn interpolate(&mut self, _: &mut P, from: &State, time: Time, inside: &mut State) {
        self.sum(from, time, inside);
    }

    fn shorten(&mut self, problem: &mut P, from: &State, state: &mut State) -> bool {
        let Some(mut passage) = self.singular_passage(problem) else { return false };
        let mut inside = |time: Time, inside: &mut State| self.sum(from, time, inside);
        let shorter = passage.before(problem.mechanism(), from, state.time, &mut inside);
        if let Some(time) = shorter {
            inside(time, state);
        }
        self.singular_passage = Some(passage);
        shorter.is_some()
    }

    fn powers(&self, powers: &mut MotionPowers) -> bool {
        !self.by_series && self.fast.as_ref().is_some_and(|fast| fast.powers(powers))
    }
}

fn stop(cause: Cause, state: &State, step: f64, what: String, hint: &str) -> StepError {
    StepError { cause, method: "taylor".into(), t: state.time.hi, step, what, hint: hint.into() }
}

impl<T: Coefficient> Taylor<T> {
    /// Keeps the code at hand that fits, makes it, or leaves it to the series.
    fn choose<P: OdeSystem + Form + ?Sized>(&mut self, problem: &P, state: &State) -> Result<(), StepError> {
        let (mechanism, coordinates) = (problem.mechanism(), problem.coordinates());
        if coordinates == Coordinates::Other {
            let hint =
                "integrate the mechanism in angles and rates, by multipliers or with the motors eliminated";
            return Err(stop(
                Cause::Unsuited,
                state,
                0.0,
                "the unknowns are not those a series is expanded in".into(),
                hint,
            ));
        }
        let is_portable = self.kernel == ExpansionKernel::Portable;
        let has_friction = !mechanism.frictions.is_empty();
        let (tolerance, order, extended) = (self.tolerance, self.order, self.extended && !has_friction);
        let is_plain = T::IS_PLAIN && self.kernel != ExpansionKernel::Series && !has_friction;
        // The lanes know neither walls nor rows that are not eliminated.
        let is_simple = mechanism.contacts.is_empty()
            && (mechanism.constraints.is_empty() || coordinates == Coordinates::Independent);
        let is_looped = mechanism.has_closed_loops() && coordinates == Coordinates::All && !extended;
        if !is_plain || !(is_simple || is_looped) {
            self.fast = None;
        } else if !self
            .fast
            .as_ref()
            .is_some_and(|fast| fast.is_for(mechanism, tolerance, order, is_portable, extended))
        {
            self.fast = match is_looped {
                true => {
                    let of = |reduced: &_| Fast::of_looped(mechanism, reduced, tolerance, order, is_portable);
                    match problem.reduced() {
                        Some(reduced) => of(reduced),
                        None => dynamics::looped::reduced(mechanism).as_ref().and_then(of),
                    }
                }
                false => Fast::new(mechanism, tolerance, order, is_portable, extended),
            };
        }
        if self.fast.is_some() && !is_looped {
            self.expansion = None;
        } else if !self
            .expansion
            .as_ref()
            .is_some_and(|expansion| expansion.is_for(mechanism, coordinates, order, extended))
        {
            self.expansion = Some(Expansion::new(mechanism, coordinates, order, extended));
            self.singular_passage = None;
        }
        Ok(())
    }

    /// Expands the motion by the series of any mechanism: the step wanted, and of it what `left` \[s\] leave.
    fn expand<P: OdeSystem + Form + ?Sized>(&mut self, problem: &P, state: &State, left: f64) -> (f64, f64) {
        let Some(expansion) = &mut self.expansion else { return (f64::NAN, 0.0) };
        expansion.expand(problem.mechanism(), state);
        // What a wall sees of the motion are the unit vectors.
        let mut wanted = expansion.wanted(self.tolerance, problem.events() > 0);
        let known = walls_known(problem.mechanism(), state.time, expansion.series());
        // A step that is not a number stays one.
        wanted = if known < wanted { known } else { wanted };
        wanted = expansion.until_reversal(wanted);
        if !problem.mechanism().constraints.is_empty() && singular::is_near(problem, expansion) {
            let passage = self.singular_passage.get_or_insert_with(|| {
                SingularPassage::new(problem.mechanism(), problem.coordinates(), expansion)
            });
            if let Some(through) = passage.length(problem, expansion, state, wanted, self.tolerance) {
                let whole = through.min(left);
                expansion.sum_to_smallest(whole);
                if passage.is_confirmed(problem, expansion, state, whole, self.tolerance) {
                    // Half of it would end at the singular position.
                    return (through, whole);
                }
                expansion.sum_all();
            }
        }
        (wanted, if wanted.is_nan() { 0.0 } else { step_size::taken(wanted, left) })
    }

    /// Writes the state at a time in the last step, which began at `from`.
    fn sum(&mut self, from: &State, time: Time, inside: &mut State) {
        inside.clone_from(from);
        let h = time - from.time;
        match (&mut self.fast, &self.expansion) {
            (Some(fast), _) if !self.by_series => fast.go(inside, h.hi),
            (_, Some(expansion)) => expansion.go(inside, h),
            _ => {}
        }
        inside.time = time;
        inside.wrap();
    }

    /// What passages are looked for with, taken out.
    fn singular_passage<P: Form + ?Sized>(&mut self, problem: &P) -> Option<SingularPassage<T>> {
        let Self { singular_passage, expansion, .. } = self;
        let new = |expansion| SingularPassage::new(problem.mechanism(), problem.coordinates(), expansion);
        singular_passage.take().or_else(|| expansion.as_ref().map(new))
    }

    /// Of the step `h` \[s\] what comes before its first event, and which event that is.
    fn meet<P: OdeSystem + Form + ?Sized>(
        &mut self,
        problem: &mut P,
        state: &State,
        h: f64,
    ) -> Result<(f64, Option<usize>), StepError> {
        let Self { expansion: Some(expansion), powers, .. } = self else { return Ok((h, None)) };
        let mut found = FirstEvent::Nothing;
        for contact in 0..problem.events() {
            trace(problem, expansion, state.time, contact, powers);
            let curve = PowerSeries { powers, end: found.end(h) };
            found = found.or_earlier(contact, &curve, h);
        }
        match found {
            FirstEvent::At(event, t) => Ok((self.land(problem, state, event, t, h), Some(event))),
            FirstEvent::Inside(t) if t <= super::finest(state, problem.time_unit()) => {
                Err(super::at_rest("taylor", state, h))
            }
            found => Ok((found.end(h), None)),
        }
    }

    /// The moment of an event near `t` \[s\], at which the event function of the *state* is zero to rounding.
    fn land<P: OdeSystem + Form + ?Sized>(
        &mut self,
        problem: &mut P,
        state: &State,
        event: usize,
        t: f64,
        h: f64,
    ) -> f64 {
        let Self { expansion: Some(expansion), powers, gaps, inside, .. } = self else { return t };
        trace(problem, expansion, state.time, event, powers);
        gaps.resize(problem.events(), 0.0);
        let mut best = t;
        for _ in 0..LANDINGS {
            inside.clone_from(state);
            expansion.go(inside, DoubleDouble::from(best));
            problem.gaps(state.time + best, &inside.y, gaps);
            let (gap, [_, slope]) = (gaps[event], search::value(powers, best));
            let moved = best - gap / slope;
            if gap.abs() <= 1e-15 || !((moved - t).abs() < 0.1 * h && moved > 0.0 && moved <= h) {
                break;
            }
            best = moved;
        }
        best
    }
}
