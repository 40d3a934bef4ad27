//! Steps in which no argument of `exp`, `tanh` or a power changes much within the window in which these
//! functions change.
//!
//! Out of its window such a function is constant beside rounding, and neither the powers of a series nor the
//! stages of a step tell of what it does within: a pulse of any height is stepped over.  Its argument is
//! resolved by the dense output, where no pulse has been yet.  A step in which an argument, held to its
//! window, changes by more than its unit is therefore made again, up to where it has changed by that.

use super::StepLoop;
use crate::dynamics::{Form, Mechanism, Time};
use crate::run::observer::Inside;
use crate::scene::formula::active::WINDOW;
use crate::stepping::search::{Chebyshev, Curve, Interpolants, interpolated, root};
use crate::stepping::{Integrator, StepError};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Degrees of the interpolants of arguments, and what the last coefficients may be, in units of the
/// arguments, and over the least magnitude they can have.
const DEGREES: [usize; 3] = [8, 16, 32];
const RESOLVED: f64 = 0.02;
const CERTAIN: f64 = 1e-3;
/// Halvings of a step in which no interpolant resolves an argument, or it is no number somewhere, and parts
/// looked at in all.
const HALVINGS: u32 = 12;
const BORDERS: u32 = 4;
const PARTS: u32 = 4096;
/// Change of an argument in its units from which on a step is made again.
const MOST: f64 = 1.25;
/// Times a step is made again at most, and the share of it, and of time, that is not worth it.
const CUTS: u32 = 40;
const SHORT: f64 = 1e-9;
const INSTANT: f64 = 1e-13;
/// Share of a step's limit above which the next one is limited as well: methods halve what is left.
const LIMITED: f64 = 0.45;

/// How long steps may be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::run) struct StepLimit {
    /// What the last step went to at most, where that was nearer than the run's own aim.
    pub until: Option<Time>,
    /// The longest step to come \[s\], where the last one was limited.
    longest: Option<f64>,
}

/// What limits the steps of a mechanism.
pub(super) struct Limited {
    mechanism: Arc<Mechanism>,
    /// How long they may be.
    pub limit: StepLimit,
}

impl Limited {
    /// That of a mechanism; `None` where nothing does.
    pub fn of(mechanism: &Mechanism) -> Option<Self> {
        let mechanism = mechanism.has_active_arguments().then(|| Arc::new(mechanism.clone()))?;
        Some(Self { mechanism, limit: StepLimit::default() })
    }
}

/// Where in a step that begins so an argument has changed by its unit first, if it changes by [`MOST`] in it;
/// and how many units the fastest of those in their windows changes by at its end \[1/s\].  Windows and units
/// are so many times those of doubles.
pub(in crate::run) fn first_change(
    mechanism: &Mechanism,
    inside: &mut dyn Inside,
    times: f64,
) -> (Option<Time>, f64) {
    let (begin, end) = inside.span();
    let mut arguments = Arguments { mechanism, times, first: Vec::new(), rate: 0.0, parts: 0 };
    let changed = arguments.changed(inside, (begin, (end - begin).hi), 0);
    (changed, arguments.rate)
}

/// The arguments in a step.
struct Arguments<'a> {
    mechanism: &'a Mechanism,
    times: f64,
    /// Where the step begins, held to the window.
    first: Vec<f64>,
    /// Units that the fastest of those in their windows changes by at the end of the step \[1/s\].
    rate: f64,
    parts: u32,
}

impl Arguments<'_> {
    /// Where in a part of a step one has changed by its unit first, if it changes by [`MOST`] there.
    fn changed(&mut self, inside: &mut dyn Inside, (begin, span): (Time, f64), depth: u32) -> Option<Time> {
        self.parts += 1;
        let (mechanism, times) = (self.mechanism, self.times);
        let at = |share: f64, row: &mut Vec<f64>| {
            mechanism.append_active_arguments(inside.at(begin + share * span), row);
            row.iter_mut().for_each(|argument| *argument /= times);
        };
        let is_enough = |curve: &Chebyshev| {
            !curve.most().is_finite() || curve.tail() <= RESOLVED || curve.tail() <= CERTAIN * curve.least()
        };
        let Interpolants { curves, values, .. } = interpolated(&DEGREES, at, |_, curve, _| is_enough(curve));
        if depth == 0 {
            let first = |values: &Vec<f64>| values.last().map_or(0.0, |first| first.clamp(-WINDOW, WINDOW));
            self.first = values.iter().map(first).collect();
        }
        let is_open = |(curve, values): (&Chebyshev, &Vec<f64>)| match curve.most().is_finite() {
            true => depth < HALVINGS && !is_enough(curve),
            false => depth < BORDERS && values.iter().any(|value| value.is_finite()),
        };
        if self.parts < PARTS && curves.iter().zip(&values).any(is_open) {
            let half = 0.5 * span;
            return self
                .changed(inside, (begin, half), depth + 1)
                .or_else(|| self.changed(inside, (begin + half, half), depth + 1));
        }
        let (mut cut, mut rate) = (None, 0.0_f64);
        for (curve, first) in curves.iter().zip(&self.first) {
            if !curve.most().is_finite() || curve.least() > WINDOW {
                continue;
            }
            let [last, slope] = curve.at(1.0);
            if last.abs() < WINDOW {
                rate = rate.max(slope.abs() / span);
            }
            for side in [1.0, -1.0] {
                if (first + MOST * side).abs() >= WINDOW {
                    continue;
                }
                if let Some(end) = root(curve, first + MOST * side, 0.0, cut.unwrap_or(1.0)) {
                    cut = Some(root(curve, first + side, 0.0, end).unwrap_or(0.0));
                }
            }
        }
        self.rate = rate;
        cut.map(|share: f64| begin + share * span)
    }
}

impl<P: Form + Send + ?Sized, M: Integrator<P> + Send> StepLoop<P, M> {
    /// Makes a step, and not beyond `target`.
    pub(super) fn make_step(&mut self, target: Time) -> Result<Option<usize>, StepError> {
        let from = self.from.time;
        let Some(Limited { mechanism, limit }) = &self.limited else { return self.step_to(target) };
        let mut until = match limit.longest {
            Some(longest) if longest < (target - from).hi => from + longest,
            _ => target,
        };
        let (mechanism, steps) = (Arc::clone(mechanism), self.statistics.steps);
        let mut cuts = 0;
        loop {
            let event = self.step_to(until)?;
            let span = (self.state.time - from).hi;
            if span <= 0.0 {
                return Ok(event);
            }
            let (changed, rate) = first_change(&mechanism, self, 1.0);
            let least = (SHORT * span).max(INSTANT * from.hi.abs());
            match changed.filter(|time| cuts < CUTS && (*time - from).hi > least) {
                Some(time) => {
                    cuts += 1;
                    self.statistics.steps = steps;
                    self.statistics.rejected += 1;
                    self.state.clone_from(&self.from);
                    self.method.begin(&mut self.problem, &mut self.state, time)?;
                    until = time;
                }
                None => {
                    let is_limited = until < target && span > LIMITED * (until - from).hi;
                    let longest = (is_limited && rate > 0.0).then(|| 1.0 / rate);
                    if let Some(limited) = &mut self.limited {
                        limited.limit = StepLimit { until: (until < target).then_some(until), longest };
                    }
                    return Ok(event);
                }
            }
        }
    }

    fn step_to(&mut self, until: Time) -> Result<Option<usize>, StepError> {
        self.method.step(&mut self.problem, &mut self.state, until, &mut self.statistics)
    }
}
