//! Events inside a step: found on the interpolated solution, then landed on by steps that end there.
//!
//! The step is repeated to end on the event, so that the state there has the accuracy of a step and not of its interpolation.

use super::Tally;
use crate::dynamics::{Field, State};

/// Interior samples a step is searched for events with.
pub(super) const SAMPLES: usize = 8;
/// Steps an event is landed on with, at most.
const LANDINGS: usize = 6;

/// A step just made from a state, as the search sees it.
pub(super) trait Stride<F: Field + ?Sized> {
    /// Writes the unknowns at a share of the step of `h`.
    fn inside(&self, state: &State, h: f64, share: f64, y: &mut [f64]);

    /// Makes the step anew, `h` long; false where it cannot be made.
    fn repeat(&mut self, field: &mut F, state: &State, h: f64, tally: &mut Tally) -> bool;

    /// The unknowns at its end, and their rates.
    fn end(&self) -> (&[f64], &[f64]);
}

/// What a step holds.
pub(super) enum Found {
    Nothing,
    /// Event number and share of the step.
    At(usize, f64),
    /// The point does not leave the wall at all.
    Inside,
}

/// Scratch space of the search.
#[derive(Clone, Debug, Default)]
pub(super) struct Search {
    gaps: Vec<f64>,
    samples: Vec<f64>,
    point: Vec<f64>,
}

impl Search {
    /// Room for so many event functions of d unknowns.
    pub fn resize(&mut self, events: usize, dimension: usize) {
        self.gaps.resize(events, 0.0);
        self.samples.resize(events, 0.0);
        self.point.resize(dimension, 0.0);
    }

    /// The first event inside the step just made, as a share of it, or what forbids the step.
    pub fn first<F: Field + ?Sized>(&mut self, field: &mut F, step: &impl Stride<F>, state: &State, h: f64) -> Found {
        field.gaps(state.time, &state.y, &mut self.gaps);
        for sample in 1..=SAMPLES {
            let (low, high) = ((sample - 1) as f64 / SAMPLES as f64, sample as f64 / SAMPLES as f64);
            self.gaps_at(field, step, state, h, high);
            let mut first: Option<(usize, f64)> = None;
            for event in 0..self.gaps.len() {
                let (before, after) = (self.gaps[event], self.samples[event]);
                if after > 0.0 || after.is_nan() {
                    continue;
                }
                // Leaving a wall the gap starts at zero within rounding; it must open before it can close.
                if before <= 1e-12 {
                    // A point at the bound that is on its way out is not going through.
                    if after < -1e-12 && after < before {
                        return Found::Inside;
                    }
                    continue;
                }
                let theta = self.root(field, step, state, h, event, low, high);
                if first.is_none_or(|(_, earliest)| theta < earliest) {
                    first = Some((event, theta));
                }
                // The search wrote over the samples.
                self.gaps_at(field, step, state, h, high);
            }
            if let Some((event, theta)) = first {
                return Found::At(event, theta);
            }
            std::mem::swap(&mut self.gaps, &mut self.samples);
        }
        Found::Nothing
    }

    /// Event functions of the interpolated solution at a share of the step, into `samples`.
    fn gaps_at<F: Field + ?Sized>(&mut self, field: &mut F, step: &impl Stride<F>, state: &State, h: f64, theta: f64) {
        step.inside(state, h, theta, &mut self.point);
        field.gaps(state.time + theta * h, &self.point, &mut self.samples);
    }

    /// The zero of an event function on the interpolated solution between two shares of the step (bisection, then the last bits).
    #[expect(clippy::too_many_arguments)]
    fn root<F: Field + ?Sized>(
        &mut self,
        field: &mut F,
        step: &impl Stride<F>,
        state: &State,
        h: f64,
        event: usize,
        low: f64,
        high: f64,
    ) -> f64 {
        let (mut low, mut high) = (low, high);
        while high - low > 4.0 * f64::EPSILON {
            let middle = 0.5 * (low + high);
            self.gaps_at(field, step, state, h, middle);
            if self.samples[event] > 0.0 { low = middle } else { high = middle }
        }
        high
    }

    /// Repeats the step so that it ends where the event function is zero to rounding; returns its length, `None` where it cannot be made.
    pub fn land<F: Field + ?Sized>(
        &mut self,
        field: &mut F,
        step: &mut impl Stride<F>,
        state: &State,
        h: f64,
        event: usize,
        tally: &mut Tally,
    ) -> Option<f64> {
        let mut best = h;
        let (mut before, mut gap_before) = (0.0, f64::NAN);
        for attempt in 1..=LANDINGS {
            if !step.repeat(field, state, best, tally) {
                return None;
            }
            field.gaps(state.time + best, step.end().0, &mut self.samples);
            let gap = self.samples[event];
            // The last attempt stands: the step must be the one that was made.
            if gap.abs() <= 1e-15 || attempt == LANDINGS {
                break;
            }
            // A secant once there are two points; the closing speed from the first step until then.
            let slope = if gap_before.is_nan() {
                self.closing_speed(field, step, state, best, event)
            } else {
                (gap - gap_before) / (best - before)
            };
            (before, gap_before) = (best, gap);
            let moved = best - gap / slope;
            if !(moved.is_finite() && (moved - h).abs() < 0.1 * h) || moved == best {
                break;
            }
            best = moved;
        }
        Some(best)
    }

    /// Rate of an event function \[m/s\] at the end of the step just made.
    fn closing_speed<F: Field + ?Sized>(&mut self, field: &mut F, step: &impl Stride<F>, state: &State, h: f64, event: usize) -> f64 {
        let at_end = self.samples[event];
        let dt = 1e-7 * h;
        let (end, rate) = step.end();
        for ((point, end), rate) in self.point.iter_mut().zip(end).zip(rate) {
            *point = end - dt * rate;
        }
        field.gaps(state.time + (h - dt), &self.point, &mut self.gaps);
        (at_end - self.gaps[event]) / dt
    }
}
