//! The adaptive driver shared by our own Dormand–Prince pairs: stages, step control, events.
//!
//! ```text
//! k_i = f(t + c_i h, y + h Σ_j a_ij k_j),    y⁺ = y + h Σ b_i k_i,
//!     err = |h Σ e_i k_i| / (atol + rtol |y|)
//! h⁺ = h · clamp(0.9 err^(-1/p), 1/3, 6)
//! ```
//!
//! Steps are as long as the tolerance allows, and output times are read off the pair's interpolation; the
//! step proposed before one that was cut short is kept.  The update is compensated: what rounding drops from
//! y is carried in the state's low part.  Events are bracketed on the interpolated solution and the step is
//! then repeated to end on the event, so the state there has the accuracy of a step.
//!
//! Source: E. Hairer, S. P. Nørsett, G. Wanner, *Solving Ordinary Differential Equations I*, 2nd ed. (1993),
//! sections II.4-II.6.

#[cfg(test)]
pub(super) mod checks;
mod dense;
mod stages;
use self::dense::{highest, nest};
use self::stages::{combine, sum_up};
use super::event::{Met, SearchScratch, Stride};
use super::{Cause, Integrator, Statistics, StepError};
use crate::arithmetic::sum::{fast_two_sum, two_sum};
use crate::arithmetic::{DoubleDouble, Scalar};
use crate::dynamics::{OdeSystem, State, Time};
use std::marker::PhantomData;

/// The nonzero entries of a row of coefficients: index and value.
pub type Row = &'static [(usize, f64)];

/// The coefficients of an embedded pair with interpolation.
pub trait EmbeddedPair {
    /// Name in reports.
    const NAME: &'static str;
    /// Order p of the solution that is carried on.
    const ORDER: u32;
    /// Stages of a step, the rate at the new state not counted.
    const STAGES: usize;
    /// Further stages of the interpolation.
    const EXTRA: usize;
    /// Highest power of the interpolation.
    const DEGREE: usize;
    /// a_ij of stages 2…
    const A: &'static [Row];
    /// c_i.
    const C: &'static [f64];
    /// b_i.
    const B: Row;

    /// Squared error over squared tolerance, averaged over the components; `k` holds the stages row by row
    /// and the rate at the new state last.
    fn error(h: f64, k: &[f64], scale: &[f64]) -> f64;

    /// Writes the extra stages by calling `rate(c, a)`, where the stage is `y + h Σ a k` at `t + c h`; the
    /// rate at the new state is stage number `STAGES`, the extra ones follow.
    fn extra_stages(rate: &mut dyn FnMut(usize, f64, Row));

    /// Coefficients of the interpolation, of an unknown that changes by `change`: at the share s of the step
    /// it is y + s (c_1 + (1-s) (c_2 + s (c_3 + …))).
    fn interpolate(h: f64, change: f64, k: &dyn Fn(usize) -> f64) -> [f64; NESTED];
}

/// Coefficients of an interpolation at most; those there are none of are zero.
pub const NESTED: usize = 7;

/// Relative and absolute tolerance of one step.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Tolerance {
    /// Relative to the size of each unknown.
    pub relative: f64,
    /// Absolute: in rad for angles, in the mechanism's own units of length, time and energy for all else
    /// (see [`Units`](crate::dynamics::Units): m, s and J where it is of human size).
    pub absolute: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self { relative: 1e-9, absolute: 1e-9 }
    }
}

/// An embedded pair with step control.
#[derive(Clone, Debug)]
pub struct Explicit<P> {
    /// Tolerance of a step.
    pub tolerance: Tolerance,
    k: Vec<f64>,
    stage: Vec<f64>,
    scale: Vec<f64>,
    units: Vec<f64>,
    next: Vec<f64>,
    next_low: Vec<f64>,
    search: SearchScratch,
    /// The step proposed \[s\], where there is one, and where the rate at the state is.
    wanted: Option<f64>,
    rate: Rate,
    /// Length of the last step \[s\], and whether the stages of its interpolation are there.
    length: f64,
    has_extra: bool,
    /// Coefficients of that interpolation, for each unknown, where it was asked for.
    nested: Vec<[f64; NESTED]>,
    /// The largest value of what its last coefficient is that of.
    highest: f64,
    /// What makes shorter steps where the interpolation is too coarse.
    shorter: Option<Box<Self>>,
    pair: PhantomData<P>,
}

/// Where the rate at the state is among the stages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rate {
    Unknown,
    /// In the first place, for the step to come.
    First,
    /// After the stages of the step just made.
    Last,
}

/// Steps in a row that come out not finite before the method stops.
const MOST_CUTS: u32 = 10;

impl<P: EmbeddedPair> Explicit<P> {
    /// The method at a tolerance.
    pub fn new(tolerance: Tolerance) -> Self {
        Self {
            tolerance,
            k: Vec::new(),
            stage: Vec::new(),
            scale: Vec::new(),
            units: Vec::new(),
            next: Vec::new(),
            next_low: Vec::new(),
            search: SearchScratch::default(),
            wanted: None,
            rate: Rate::Unknown,
            length: 0.0,
            has_extra: false,
            nested: Vec::new(),
            highest: highest::<P>(),
            shorter: None,
            pair: PhantomData,
        }
    }

    fn resize(&mut self, n: usize) {
        self.k.resize((P::STAGES + 1 + P::EXTRA) * n, 0.0);
        for vector in [&mut self.stage, &mut self.scale, &mut self.next, &mut self.next_low] {
            vector.resize(n, 0.0);
        }
    }

    /// Stages 2… and the new state of a step of `h` from `state`; stage 1 is in place.
    fn attempt<F: OdeSystem + ?Sized>(
        &mut self,
        field: &mut F,
        state: &State,
        h: f64,
        statistics: &mut Statistics,
    ) {
        let n = state.y.len();
        self.has_extra = false;
        self.nested.clear();
        for (i, row) in P::A.iter().enumerate() {
            combine(&state.y, h, row, &self.k, &mut self.stage);
            let (_, rest) = self.k.split_at_mut((i + 1) * n);
            field.rhs(state.time + P::C[i + 1] * h, &self.stage, &mut rest[..n]);
        }
        statistics.evaluations += P::A.len() as u64;
        sum_up(P::B, &self.k, &mut self.stage);
        for i in 0..n {
            let change = self.stage[i] * h;
            let (sum, rest) = two_sum(state.y[i], change);
            (self.next[i], self.next_low[i]) = fast_two_sum(sum, rest + state.low[i]);
            let size = state.y[i].abs().max(self.next[i].abs());
            self.scale[i] = self.tolerance.absolute * self.units[i] + self.tolerance.relative * size;
        }
        let (_, rest) = self.k.split_at_mut(P::STAGES * n);
        field.rhs(state.time + h, &self.next, &mut rest[..n]);
        statistics.evaluations += 1;
    }

    /// A first step from the size of the rate and its change (Hairer, Nørsett, Wanner, page 169).
    fn first_step<F: OdeSystem + ?Sized>(
        &mut self,
        field: &mut F,
        state: &State,
        span: f64,
        statistics: &mut Statistics,
    ) -> f64 {
        let n = state.y.len();
        super::scales(self.tolerance, &state.y, &self.units, &mut self.scale);
        // What nothing is known of begins with a millionth of the unit of time.
        let unit = field.time_unit();
        let short = 1e-6 * unit;
        let norm = |x: &dyn Fn(usize) -> f64, scale: &[f64]| {
            ((0..n).map(|i| (x(i) / scale[i]).powi(2)).sum::<f64>() / n as f64).sqrt()
        };
        let (d0, d1) = (norm(&|i| state.y[i], &self.scale), norm(&|i| self.k[i], &self.scale));
        let guess = if d0 < 1e-5 || d1 * unit < 1e-5 { short } else { 0.01 * d0 / d1 };
        let guess = guess.min(span);
        for i in 0..n {
            self.stage[i] = state.y[i] + guess * self.k[i];
        }
        let (first, rest) = self.k.split_at_mut(n);
        field.rhs(state.time + guess, &self.stage, &mut rest[..n]);
        statistics.evaluations += 1;
        let d2 = norm(&|i| rest[i] - first[i], &self.scale) / guess;
        let steepest = (d1 * unit).max(d2 * unit * unit);
        let second = if steepest <= 1e-15 {
            (1e-3 * guess).max(short)
        } else {
            unit * libm::pow(0.01 / steepest, 1.0 / f64::from(P::ORDER))
        };
        let first = (100.0 * guess).min(second).min(span);
        if first.is_finite() { first } else { span.min(short) }
    }

    /// The stages an interpolation of the step just made asks for beside its own, where they are not known.
    fn evaluate_extra_stages<F: OdeSystem + ?Sized>(
        &mut self,
        field: &mut F,
        state: &State,
        h: f64,
        statistics: &mut Statistics,
    ) {
        if std::mem::replace(&mut self.has_extra, true) {
            return;
        }
        let n = state.y.len();
        let (k, stage) = (&mut self.k, &mut self.stage);
        P::extra_stages(&mut |number, c, row| {
            combine(&state.y, h, row, k, stage);
            field.rhs(state.time + c * h, stage, &mut k[number * n..(number + 1) * n]);
            statistics.evaluations += 1;
        });
    }

    /// Writes the interpolation of the step just made, whose stages beside those of the step are evaluated
    /// the first time; returns what it may be off, over the tolerance.
    fn interpolate_last<F: OdeSystem + ?Sized>(
        &mut self,
        field: &mut F,
        from: &State,
        time: Time,
        inside: &mut State,
    ) -> f64 {
        let n = from.y.len();
        self.evaluate_extra_stages(field, from, self.length, &mut Statistics::default());
        if self.nested.is_empty() {
            for i in 0..n {
                self.nested.push(self.nested_powers(from, self.length, i));
            }
        }
        inside.clone_from(from);
        inside.memory.clear();
        inside.time = time;
        let share = (time - from.time).hi / self.length;
        let (most, mut off) = (self.highest * <Self as Stride<F>>::off(share), 0.0_f64);
        for (i, nested) in self.nested.iter().enumerate() {
            let change = share * nest(&nested[..P::DEGREE], share);
            (inside.y[i], inside.low[i]) = two_sum(from.y[i], change + from.low[i]);
            off = off.max(most * nested[P::DEGREE - 1].abs() / self.scale[i]);
        }
        off
    }

    /// Writes the end of a step of `h` from the beginning of the last one, where that is within the
    /// tolerance: for where the interpolation is not, as in long steps on the way out of an unstable
    /// equilibrium.
    fn step_inside<F: OdeSystem + ?Sized>(
        &mut self,
        field: &mut F,
        from: &State,
        h: f64,
        inside: &mut State,
    ) {
        let n = from.y.len();
        let mut shorter = self.shorter.take().unwrap_or_else(|| Box::new(Self::new(self.tolerance)));
        shorter.resize(n);
        shorter.units.clone_from(&self.units);
        shorter.k[..n].copy_from_slice(&self.k[..n]);
        shorter.attempt(field, from, h, &mut Statistics::default());
        // Near a singular position a step that ends in it may be far worse than one that leads past it.
        if P::error(h, &shorter.k, &shorter.scale) <= 1.0 {
            inside.y.copy_from_slice(&shorter.next);
            inside.low.copy_from_slice(&shorter.next_low);
        }
        self.shorter = Some(shorter);
    }

    /// The component that asks most of the step, or the first that is not finite.
    fn culprit<F: OdeSystem + ?Sized>(&self, field: &F, n: usize) -> String {
        let last = &self.k[P::STAGES * n..(P::STAGES + 1) * n];
        let worst = (0..n).find(|&i| !(self.next[i].is_finite() && last[i].is_finite())).or_else(|| {
            (0..n)
                .max_by(|&a, &b| (last[a] / self.scale[a]).abs().total_cmp(&(last[b] / self.scale[b]).abs()))
        });
        worst.map_or_else(String::new, |i| field.label(i))
    }

    fn stop(cause: Cause, state: &State, step: f64, what: String, hint: &str) -> StepError {
        StepError { cause, method: P::NAME.into(), t: state.time.hi, step, what, hint: hint.into() }
    }
}

impl<P: EmbeddedPair, F: OdeSystem + ?Sized> Integrator<F> for Explicit<P> {
    fn name(&self) -> &'static str {
        P::NAME
    }

    fn order(&self) -> u32 {
        P::ORDER
    }

    /// Keeps the step proposed.
    fn reset(&mut self, state: &mut State) {
        state.memory.truncate(1);
    }

    fn begin(&mut self, field: &mut F, state: &mut State, until: Time) -> Result<(), StepError> {
        let n = state.y.len();
        super::refuse_the_past(P::NAME, state, until, field.time_unit())?;
        self.resize(n);
        super::units(field, n, &mut self.units);
        // The step proposed last; where the last step was not cut short also the rate.
        self.wanted = state.memory.first().copied();
        self.rate = Rate::Unknown;
        if state.memory.len() == 1 + n {
            self.k[..n].copy_from_slice(&state.memory[1..]);
            self.rate = Rate::First;
        }
        Ok(())
    }

    fn step(
        &mut self,
        field: &mut F,
        state: &mut State,
        until: Time,
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError> {
        let n = state.y.len();
        let left = (until - state.time).hi;
        match std::mem::replace(&mut self.rate, Rate::First) {
            Rate::First => {}
            Rate::Last => self.k.copy_within(P::STAGES * n..(P::STAGES + 1) * n, 0),
            Rate::Unknown => {
                field.rhs(state.time, &state.y, &mut self.k[..n]);
                statistics.evaluations += 1;
            }
        }
        let mut wanted = match self.wanted {
            Some(h) => h,
            None => self.first_step(field, state, left, statistics),
        };
        let (mut cuts, mut is_rejected) = (0, false);
        loop {
            let (h, whole) = super::reach(wanted, left);
            statistics.check(P::NAME, state.time.hi, h)?;
            self.attempt(field, state, h, statistics);
            let error = self.error(field, state, h, statistics);
            if !error.is_finite() {
                cuts += 1;
                statistics.rejected += 1;
                if cuts > MOST_CUTS || h < super::finest(state, field.time_unit()) {
                    let what = format!("{} is not finite", self.culprit(field, n));
                    let hint = super::NOT_FINITE;
                    return Err(Self::stop(Cause::NotFinite, state, h, what, hint));
                }
                (wanted, is_rejected) = (0.1 * h, true);
                continue;
            }
            cuts = 0;
            let factor = (0.9 * libm::pow(error, -1.0 / f64::from(P::ORDER))).clamp(1.0 / 3.0, 6.0);
            if error > 1.0 {
                statistics.rejected += 1;
                (wanted, is_rejected) = (h * factor.min(0.9), true);
                if wanted < super::finest(state, field.time_unit()) {
                    let what = format!("{} asks for ever smaller steps", self.culprit(field, n));
                    return Err(Self::stop(
                        Cause::StepTooSmall,
                        state,
                        h,
                        what,
                        "loosen the tolerance, or take --method taylor or radau9",
                    ));
                }
                continue;
            }
            let (h, event, lands) = match self.meet(field, state, h, statistics) {
                Met::Whole => (h, None, whole),
                Met::Short(short) => (short, None, false),
                Met::Event(short, event) => (short, Some(event), false),
                Met::Failed | Met::AtRest => return Err(super::at_rest(P::NAME, state, h)),
            };
            let grown = h * if is_rejected { factor.min(1.0) } else { factor };
            // A step cut short says nothing against the longer one proposed before it.
            let wanted = if h < wanted { grown.max(wanted) } else { grown };
            state.y.copy_from_slice(&self.next);
            state.low.copy_from_slice(&self.next_low);
            state.time = if lands { until } else { state.time + DoubleDouble::of(h) };
            state.wrap();
            state.memory.clear();
            state.memory.push(wanted);
            (self.wanted, self.length, self.rate) = (Some(wanted), h, Rate::Last);
            statistics.steps += 1;
            return Ok(event);
        }
    }

    fn changed(&mut self, _state: &mut State) {
        self.rate = Rate::Unknown;
    }

    fn save(&self, state: &mut State) {
        let n = state.y.len();
        let at = match self.rate {
            Rate::Unknown => return,
            Rate::First => 0,
            Rate::Last => P::STAGES * n,
        };
        state.memory.truncate(1);
        if !state.memory.is_empty() {
            state.memory.extend_from_slice(&self.k[at..at + n]);
        }
    }

    fn is_dense(&self) -> bool {
        true
    }

    /// By the pair's own interpolation, or a shorter step where that is too coarse.
    fn interpolate(&mut self, field: &mut F, from: &State, time: Time, inside: &mut State) {
        let off = self.interpolate_last(field, from, time, inside);
        if off > 1.0 {
            self.step_inside(field, from, (time - from.time).hi, inside);
        }
        inside.wrap();
    }

    /// By the pair's own interpolation alone.
    fn interpolate_roughly(&mut self, field: &mut F, from: &State, time: Time, inside: &mut State) {
        self.interpolate_last(field, from, time, inside);
        inside.wrap();
    }
}
