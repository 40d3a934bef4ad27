//! Events inside a step: found on its dense output by [`search`](super::search), then landed on by steps that
//! end there.
//!
//! The step is repeated to end on the event, so that the state there has the accuracy of a step and not of
//! its interpolation.  Where the dense output comes so near to zero that it does not know the side, the step
//! is repeated to end at the minimum, and what is looked at then has the accuracy of a step, too.

mod opaque;

use super::search::{
    Crossing, Curve, IntervalBounds, ROUNDING, TOUCH, crossing, doubtful, root, shift, value,
};
use super::{Statistics, finest};
use crate::dynamics::{Along, OdeSystem, State};
use std::cell::RefCell;

/// Steps an event is landed on with, at most.
const LANDINGS: usize = 12;
/// A value that is zero where a step ends on it.
const ZERO: f64 = 1e-15;
/// Times a step is repeated to end at a minimum.
const ROUNDS: usize = 4;
/// Room for a dense output's powers.
const WIDEST: usize = 10;

/// The dense output of a step: its unknowns as polynomials of the share of the step.
#[derive(Clone, Debug, Default)]
pub(super) struct Dense {
    /// Powers 0, 1, …, unknown by unknown.
    pub powers: Vec<f64>,
    /// Number of powers of each.
    pub width: usize,
    /// How much each may be off at most within the step.
    pub off: Vec<f64>,
}

impl Dense {
    /// Room for the first `count` unknowns of a state, and their values as constant powers.
    pub fn begin(&mut self, count: usize, width: usize, state: &State) {
        self.width = width;
        self.powers.resize(count * width, 0.0);
        self.off.resize(count, 0.0);
        for (powers, (y, low)) in self.powers.chunks_exact_mut(width).zip(state.y.iter().zip(&state.low)) {
            powers[0] = y + low;
        }
    }

    /// Each unknown's powers, and what they may be off.
    pub fn each(&mut self) -> impl Iterator<Item = (&mut [f64], &mut f64)> {
        self.powers.chunks_exact_mut(self.width).zip(&mut self.off)
    }

    /// Unknowns, and their derivatives by the share.
    fn at(&self, share: f64, y: &mut [f64], slope: &mut [f64]) {
        for (powers, (y, slope)) in self.powers.chunks_exact(self.width).zip(y.iter_mut().zip(slope)) {
            [*y, *slope] = value(powers, share);
        }
    }

    /// Bounds of their first and second derivatives near a share of the step.
    fn bounds(&self, centre: f64, radius: f64, first: &mut [f64], second: &mut [f64]) {
        let mut room = [0.0; WIDEST];
        let local = &mut room[..self.width];
        for (powers, (first, second)) in
            self.powers.chunks_exact(self.width).zip(first.iter_mut().zip(second))
        {
            local.copy_from_slice(powers);
            shift(local, centre);
            (*first, *second) = (0.0, 0.0);
            for (m, a) in local.iter().enumerate().rev() {
                if m > 0 {
                    *first = *first * radius + m as f64 * a.abs();
                }
                if m > 1 {
                    *second = *second * radius + (m * (m - 1)) as f64 * a.abs();
                }
            }
        }
    }
}

/// A step just made from a state, as the search sees it.
pub(super) trait Stride<F: OdeSystem + ?Sized> {
    /// Writes the dense output of as many unknowns as the field's event functions ask for.
    fn dense(&mut self, field: &mut F, state: &State, h: f64, dense: &mut Dense, statistics: &mut Statistics);

    /// Bound of what it is off at a share of the step, over that of the whole step.
    fn off(share: f64) -> f64;

    /// Makes the step anew, `h` long; false where it cannot be made.
    fn repeat(&mut self, field: &mut F, state: &State, h: f64, statistics: &mut Statistics) -> bool;

    /// The unknowns at its end, and their rates.
    fn end(&self) -> (&[f64], &[f64]);

    /// Scratch space of the search.
    fn search(&mut self) -> &mut SearchScratch;

    /// Looks for events in the step just made, where there are any to look for.
    fn meet(&mut self, field: &mut F, state: &State, h: f64, statistics: &mut Statistics) -> Met
    where
        Self: Sized,
    {
        if field.events() == 0 {
            return Met::Whole;
        }
        let mut search = std::mem::take(self.search());
        let met = search.meet(field, self, state, h, statistics);
        *self.search() = search;
        met
    }
}

/// What a step holds first, as shares of it, or after so long \[s\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum FirstEvent {
    Nothing,
    /// Event number, and where it is.
    At(usize, f64),
    /// A minimum of which the dense output does not know the side.
    Near(f64),
    /// A point leaves its wall through the wall.
    Inside(f64),
}

impl FirstEvent {
    /// Where it is; the end of the `whole` where it is nothing.
    pub fn end(self, whole: f64) -> f64 {
        match self {
            Self::Nothing => whole,
            Self::At(_, end) | Self::Near(end) | Self::Inside(end) => end,
        }
    }

    /// What comes first: that which was found, or what an event function known to rounding has to say.
    pub fn or_earlier(self, event: usize, curve: &impl Curve, whole: f64) -> Self {
        match crossing(curve, self.end(whole)) {
            Crossing::At(at) => Self::At(event, at),
            Crossing::Inside(at) => Self::Inside(at),
            Crossing::Nothing => self,
        }
    }
}

/// What became of a step that was searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Met {
    /// Nothing is in its way.
    Whole,
    /// It was made anew, to end after so long \[s\].
    Short(f64),
    /// It was made anew, to end with this event.
    Event(f64, usize),
    /// It could not be made anew.
    Failed,
    /// A point is where it can only go through its wall.
    AtRest,
}

/// What became of a step that was to end on an event.
enum EndingStep {
    /// It could not be made.
    Failed,
    /// It ends with the event, after so long \[s\].
    At(f64),
    /// It is as long as was asked for, and the function is positive there and grows.
    Opens,
}

/// Scratch space of the search.
#[derive(Clone, Debug, Default)]
pub(super) struct SearchScratch {
    dense: Dense,
    room: RefCell<[Vec<f64>; 2]>,
    gaps: Vec<f64>,
    opaque: Vec<usize>,
}

/// An event function on the dense output of a step.
struct Gap<'a, F: ?Sized> {
    field: &'a F,
    event: usize,
    dense: &'a Dense,
    state: &'a State,
    h: f64,
    room: &'a RefCell<[Vec<f64>; 2]>,
}

impl<F: OdeSystem + ?Sized> Gap<'_, F> {
    fn along(&self, t: f64) -> [f64; 3] {
        let [y, slope] = &mut *self.room.borrow_mut();
        self.dense.at(t, y, slope);
        let along = Along { time: self.state.time + t * self.h, step_size: self.h, y, slope };
        self.field.gap(self.event, along).unwrap_or([f64::NAN; 3])
    }
}

impl<F: OdeSystem + ?Sized> Curve for Gap<'_, F> {
    fn at(&self, t: f64) -> [f64; 2] {
        let [value, slope, _] = self.along(t);
        [value, slope]
    }

    fn about(&self, centre: f64, radius: f64) -> IntervalBounds {
        let [value, slope, size] = self.along(centre);
        let [first, second] = &mut *self.room.borrow_mut();
        self.dense.bounds(centre, radius, first, second);
        let time = self.state.time.hi.abs() + self.h;
        let bend = self.field.gap_bend(self.event, time, self.h, first, second);
        IntervalBounds { value, slope, bend, rounding: ROUNDING * size }
    }
}

impl SearchScratch {
    /// Looks through the step just made, and makes it anew to end on the first event in it, or where more is
    /// to be seen.
    pub fn meet<F: OdeSystem + ?Sized, S: Stride<F>>(
        &mut self,
        field: &mut F,
        step: &mut S,
        state: &State,
        whole: f64,
        statistics: &mut Statistics,
    ) -> Met {
        let mut h = whole;
        for round in 0..=ROUNDS {
            let found = self.first(field, step, state, h, round < ROUNDS, statistics);
            let shorter = found.end(1.0) * h;
            match found {
                FirstEvent::Nothing => break,
                FirstEvent::At(event, _) => match self.land(field, step, state, shorter, event, statistics) {
                    EndingStep::Failed => return Met::Failed,
                    EndingStep::At(h) => return Met::Event(h, event),
                    EndingStep::Opens => h = shorter,
                },
                FirstEvent::Inside(_) if shorter <= finest(state, field.time_unit()) => {
                    return Met::AtRest;
                }
                FirstEvent::Inside(_) | FirstEvent::Near(_) => {
                    if !step.repeat(field, state, shorter, statistics) {
                        return Met::Failed;
                    }
                    h = shorter;
                    if matches!(found, FirstEvent::Inside(_)) {
                        break;
                    }
                }
            }
        }
        if h == whole { Met::Whole } else { Met::Short(h) }
    }

    /// The first that is to be seen inside the step just made; minima that may be on either side of zero
    /// where these are `asked` for.
    fn first<F: OdeSystem + ?Sized, S: Stride<F>>(
        &mut self,
        field: &mut F,
        step: &mut S,
        state: &State,
        h: f64,
        asked: bool,
        statistics: &mut Statistics,
    ) -> FirstEvent {
        step.dense(field, state, h, &mut self.dense, statistics);
        let count = self.dense.off.len();
        for room in self.room.get_mut() {
            room.resize(count, 0.0);
        }
        let Self { dense, room, opaque, .. } = self;
        let (mut found, time) = (FirstEvent::Nothing, state.time.hi.abs() + h);
        let none = vec![0.0; count];
        // Of its beginning the side is known, whatever rounding makes of a slope there.
        let begin = finest(state, field.time_unit()) / h;
        opaque.clear();
        for event in 0..field.events() {
            let off = field.gap_bend(event, time, 0.0, &none, &dense.off);
            if !off.is_finite() {
                opaque.push(event);
                continue;
            }
            let gap = Gap { field: &*field, event, dense, state, h, room };
            found = earlier(found, event, &gap, off * f64::from(asked), S::off, begin);
        }
        if self.opaque.is_empty() { found } else { self.opaquely(field, state, h, found) }
    }

    /// Repeats the step so that it ends where the event function is zero to rounding.  Where the function
    /// opens at the end of the step first made, the passage lies before, or is one of the longer step's dense
    /// output alone: that step is left, whose own dense output knows more.
    fn land<F: OdeSystem + ?Sized, S: Stride<F>>(
        &mut self,
        field: &mut F,
        step: &mut S,
        state: &State,
        h: f64,
        event: usize,
        statistics: &mut Statistics,
    ) -> EndingStep {
        self.gaps.resize(field.events(), 0.0);
        let (mut best, mut low, mut high) = (h, 0.0, 1.1 * h);
        let (mut before, mut gap_before) = (0.0, f64::NAN);
        for attempt in 1..=LANDINGS {
            if !step.repeat(field, state, best, statistics) {
                return EndingStep::Failed;
            }
            let (y, slope) = step.end();
            let known = field.gap(event, Along { time: state.time + best, step_size: 1.0, y, slope });
            let gap = match known {
                Some([gap, ..]) => gap,
                None => {
                    field.gaps(state.time + best, y, &mut self.gaps);
                    self.gaps[event]
                }
            };
            // The last attempt stands: the step must be the one that was made.
            if gap.abs() <= ZERO || attempt == LANDINGS {
                break;
            }
            let slope = match known {
                Some([_, slope, _]) => slope,
                // A secant once there are two points; the closing speed from the first step until then.
                None if gap_before.is_nan() => self.closing_speed(field, step, state, best, event, gap),
                None => (gap - gap_before) / (best - before),
            };
            if attempt == 1 && gap > 0.0 && slope > 0.0 {
                return EndingStep::Opens;
            }
            (before, gap_before) = (best, gap);
            // Where it opens again the passage lies behind.
            *(if gap > 0.0 && (known.is_none() || slope < 0.0) { &mut low } else { &mut high }) = best;
            let newton = best - gap / slope;
            let moved = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            // Where Newton's method stays at an end of the bracket, time has no moment between.
            if (newton - best).abs().min((moved - best).abs()) <= f64::EPSILON * best {
                break;
            }
            best = moved;
        }
        EndingStep::At(best)
    }

    /// Rate of an event function at the end of the step just made.
    fn closing_speed<F: OdeSystem + ?Sized>(
        &mut self,
        field: &mut F,
        step: &impl Stride<F>,
        state: &State,
        h: f64,
        event: usize,
        at_end: f64,
    ) -> f64 {
        let dt = 1e-7 * h;
        let (end, rate) = step.end();
        let point: Vec<f64> = end.iter().zip(rate).map(|(end, rate)| end - dt * rate).collect();
        field.gaps(state.time + (h - dt), &point, &mut self.gaps);
        (at_end - self.gaps[event]) / dt
    }
}

/// What comes first: that which was found, or what this event function, off by `zone` at most, has to say;
/// minima up to `begin` are none.
fn earlier(
    found: FirstEvent,
    event: usize,
    curve: &impl Curve,
    zone: f64,
    off: impl Fn(f64) -> f64,
    begin: f64,
) -> FirstEvent {
    let end = found.end(1.0);
    // Below, it is known as well as zero is.
    if zone < 0.1 * TOUCH {
        return found.or_earlier(event, curve, 1.0);
    }
    // Most steps end here.
    if curve.at(0.0)[0] > zone && root(curve, zone, 0.0, end).is_none() {
        return found;
    }
    let crosses = found.or_earlier(event, curve, 1.0);
    let passes = match crosses {
        FirstEvent::At(by, share) if by == event => Some(share),
        _ => None,
    };
    match (crosses, doubtful(curve, zone, |share| zone * off(share), [begin, end], passes)) {
        (FirstEvent::Inside(share), Some(near)) if near < share => FirstEvent::Near(near),
        (FirstEvent::Inside(_), _) | (_, None) => crosses,
        (_, Some(near)) => FirstEvent::Near(near),
    }
}

#[cfg(test)]
mod tests;
