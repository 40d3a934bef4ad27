//! Springs that lose their length on the way: their force has no direction there, and a step can leap over the place without a trace.
//!
//! A power series takes sqrt(|D|²) through zero to a negative length, and a fixed step does not see the jump of the force at all; both come out on the other
//! side with another energy, or nearly the same.  Where the two ends of a spring with a free length can meet, every step is looked at: by the motion inside it
//! where the method knows that, else by the cubic through its ends.  Mechanisms whose springs are too far from their places for that are marched without.

use crate::arithmetic::Complex;
use crate::dynamics::force::Spring;
use crate::dynamics::{Form, Glance, Mechanism, State, Time};
use crate::stepping::{Cause, Method, Reached, Seen, StepError, Tally, Watch};

/// A length below this share of the free length is none.
const NONE: f64 = 1e-6;
/// Approaches to less than this share of the shorter length at the step's ends are looked at.
const NEAR: f64 = 0.5;
/// Parts of a step in which an approach is looked for, and halvings by which it is found.
const PARTS: usize = 16;
const HALVINGS: usize = 50;

/// A method that stops where a spring loses its length.
pub(super) struct Shrinking<P: ?Sized> {
    method: Box<dyn Method<P>>,
    /// Numbers of the springs that can.
    springs: Vec<usize>,
    before: Glance,
    now: Glance,
    from: State,
    z: Vec<Complex<f64>>,
}

/// The springs of a mechanism whose ends can meet.
pub(super) fn shrinking(mechanism: &Mechanism) -> Vec<usize> {
    let can = |spring: &Spring| {
        let parts = std::iter::once(&spring.span.root).chain(spring.span.terms.iter().map(|term| &term.1));
        let lengths: Vec<f64> = parts.map(|part| part.norm_squared().sqrt()).collect();
        let (all, most) = (lengths.iter().sum::<f64>(), lengths.iter().copied().fold(0.0, f64::max));
        let pulls = spring.free_length > 0.0 && (spring.stiffness > 0.0 || spring.damping > 0.0);
        // Rounding must not open a gap that is none.
        pulls && spring.span.shifts.is_empty() && 2.0 * most <= all * (1.0 + 1e-9)
    };
    mechanism.springs.iter().enumerate().filter(|(_, spring)| can(spring)).map(|(number, _)| number).collect()
}

/// The nearest the ends come to one another, and when.
#[derive(Clone, Copy)]
struct Approach {
    spring: usize,
    length: f64,
    /// After the beginning of the step \[s\].
    after: f64,
}

impl<P: Form + ?Sized> Shrinking<P> {
    pub fn new(method: Box<dyn Method<P>>, springs: Vec<usize>) -> Self {
        Self { method, springs, before: Glance::default(), now: Glance::default(), from: State::default(), z: Vec::new() }
    }
}

/// D and D' of a spring \[m, m/s\].
fn span(spring: &Spring, at: &Glance, z: &mut Vec<Complex<f64>>) -> [Complex<f64>; 2] {
    z.clear();
    z.extend(at.phi.iter().map(|&phi| Complex::unit(phi)));
    [spring.span.position(z), spring.span.velocity(z, &at.omega)]
}

/// The cubic through D and D' at both ends of a step, `share` of the way.
fn cubic([from, from_rate]: [Complex<f64>; 2], [to, to_rate]: [Complex<f64>; 2], time: f64, share: f64) -> Complex<f64> {
    let rest = 1.0 - share;
    let ends = from.times(rest * rest * (1.0 + 2.0 * share)) + to.times(share * share * (3.0 - 2.0 * share));
    ends + (from_rate.times(rest) - to_rate.times(share)).times(share * rest * time)
}

/// The approach inside a step as its ends tell, where there is one near enough to be looked at, and what it may be off \[m\].
fn suspected(number: usize, a: [Complex<f64>; 2], b: [Complex<f64>; 2], time: f64) -> Option<(Approach, f64)> {
    let size = |x: Complex<f64>| x.norm_squared().sqrt();
    if !(a[0].dot(a[1]) < 0.0 && b[0].dot(b[1]) > 0.0) {
        return None;
    }
    let at = |share: f64| size(cubic(a, b, time, share));
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let [left, right] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
        if at(left) < at(right) { high = right } else { low = left }
    }
    let (share, length) = (0.5 * (low + high), at(0.5 * (low + high)));
    // The fourth derivative is about the speed times the third power of the rate at which the velocity turns.
    let speed = size(a[1]).max(size(b[1]));
    let off = time * speed * (size(b[1] - a[1]) / speed).powi(3) / 384.0;
    let is_near = length < NEAR * size(a[0]).min(size(b[0])) + off;
    is_near.then_some((Approach { spring: number, length, after: share * time }, off))
}

impl<P: Form + ?Sized> Shrinking<P> {
    /// The nearest approach of a spring in the last step, by the motion inside it.
    fn searched(&mut self, problem: &mut P, number: usize, time: f64) -> Option<Approach> {
        let Self { method, from, before, z, .. } = self;
        let mut inside = from.clone();
        let mut at = |seconds: f64| {
            method.within(problem, from, from.time + seconds, &mut inside);
            problem.glance(&inside, before);
            span(&problem.mechanism().springs[number], before, z)
        };
        let closing = |[span, rate]: [Complex<f64>; 2]| span.dot(rate) < 0.0;
        let mut nearest: Option<Approach> = None;
        let mut was_closing = closing(at(0.0));
        for part in 1..=PARTS {
            let [mut low, mut high] = [part - 1, part].map(|part| part as f64 / PARTS as f64 * time);
            let is_closing = closing(at(high));
            if was_closing && !is_closing {
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (low + high);
                    if closing(at(middle)) { low = middle } else { high = middle }
                }
                let length = at(low)[0].norm_squared().sqrt();
                if nearest.is_none_or(|nearest| length < nearest.length) {
                    nearest = Some(Approach { spring: number, length, after: low });
                }
            }
            was_closing = is_closing;
        }
        nearest
    }

    fn stop(&self, problem: &P, approach: Approach, time: f64) -> StepError {
        let spring = &problem.mechanism().springs[approach.spring];
        let t = self.from.time.hi + approach.after;
        StepError {
            cause: Cause::SpringWithoutLength,
            method: self.method.name().to_owned(),
            t,
            step: time,
            what: format!("spring `{}` has no length there, and its force no direction", spring.name),
            hint: "move an end or the start, or set free_length to 0 if the ends are meant to meet".into(),
        }
    }
}

impl<P: Form + ?Sized> Method<P> for Shrinking<P> {
    fn name(&self) -> &'static str {
        self.method.name()
    }

    fn order(&self) -> u32 {
        self.method.order()
    }

    fn advance(
        &mut self,
        problem: &mut P,
        state: &mut State,
        until: Time,
        tally: &mut Tally,
        watch: &mut Watch<P>,
    ) -> Result<Reached, StepError> {
        loop {
            problem.glance(state, &mut self.before);
            self.from.clone_from(state);
            let mut found: Option<(Approach, f64)> = None;
            let mut is_enough = false;
            let Self { method, springs, before, now, from, z, .. } = self;
            let reached = method.advance(problem, state, until, tally, &mut |problem, state| {
                problem.glance(state, now);
                let time = (state.time - from.time).hi;
                found = springs.iter().find_map(|&number| {
                    let spring = &problem.mechanism().springs[number];
                    suspected(number, span(spring, before, z), span(spring, now, z), time)
                });
                let seen = watch(problem, state)?;
                is_enough = seen.is_enough();
                if found.is_none() {
                    if seen.is_changed() {
                        problem.glance(state, before);
                    } else {
                        std::mem::swap(before, now);
                    }
                    from.clone_from(state);
                    return Ok(seen);
                }
                Ok(if seen.is_changed() { Seen::ChangedEnough } else { Seen::Enough })
            })?;
            let Some((approach, off)) = found else { return Ok(reached) };
            let time = (state.time - self.from.time).hi;
            let (approach, off) = match self.method.is_dense() {
                true => (self.searched(problem, approach.spring, time), 0.0),
                false => (Some(approach), off),
            };
            if let Some(approach) = approach.filter(|approach| {
                let free = problem.mechanism().springs[approach.spring].free_length;
                approach.length <= NONE * free + off
            }) {
                let stop = self.stop(problem, approach, time);
                state.clone_from(&self.from);
                return Err(stop);
            }
            if is_enough || reached != Reached::Pause {
                return Ok(reached);
            }
            // It paused for the look at the spring alone, and may have arrived.
            if state.time >= until {
                return Ok(Reached::Until);
            }
        }
    }

    fn is_dense(&self) -> bool {
        self.method.is_dense()
    }

    fn within(&mut self, problem: &mut P, from: &State, time: Time, inside: &mut State) {
        self.method.within(problem, from, time, inside);
    }

    fn arrive(&self, state: &mut State) {
        self.method.arrive(state);
    }

    fn knows(&self) -> Vec<f64> {
        self.method.knows()
    }

    fn learn(&mut self, known: &[f64]) -> bool {
        self.method.learn(known)
    }
}
