//! Springs that lose their length on the way: their force has no direction there, and a step can leap over
//! the place without a trace.
//!
//! A power series takes sqrt(|D|²) through zero to a negative length, and a fixed step does not see the jump
//! of the force at all; both come out on the other side with another energy, or nearly the same.  Where the
//! two ends of a spring with a free length can meet, every step is looked at, by the
//! [search](crate::stepping::search) for all events on its dense output, of the squared length
//!
//! ```text
//! g = |D|² - (1e-6 L0)²,     |g''| <= 2 |D'|² + 2 |D| |D''|
//! ```
//!
//! Mechanisms whose springs are too far from their places for that are integrated without.

use crate::arithmetic::Complex;
use crate::dynamics::force::Spring;
use crate::dynamics::{BodyAngles, Form, Mechanism, State, Time};
use crate::stepping::search::{Chebyshev, Crossing, Curve, Part, crossing, interpolated};
use crate::stepping::{Cause, Integrator, Statistics, StepError};

/// A length below this share of the free length is none.
const NONE: f64 = 1e-6;
/// Degrees of the interpolants of a span inside a step, and what the last coefficients may be of the free
/// length.
const DEGREES: [usize; 3] = [8, 16, 32];
const RESOLVED: f64 = 1e-9;

/// A method that stops where a spring loses its length.
pub(super) struct Shrinking<P: ?Sized> {
    method: Box<dyn Integrator<P> + Send>,
    /// Numbers of the springs that can.
    springs: Vec<usize>,
    before: BodyAngles,
    now: BodyAngles,
    from: State,
    /// True where `before` is not the state the next step begins from.
    is_stale: bool,
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
        pulls && (!spring.span.shifts.is_empty() || 2.0 * most <= all * (1.0 + 1e-9))
    };
    mechanism.springs.iter().enumerate().filter(|(_, spring)| can(spring)).map(|(number, _)| number).collect()
}

/// Ends that meet, and when.
#[derive(Clone, Copy)]
struct Approach {
    spring: usize,
    /// After the beginning of the step \[s\].
    after: f64,
}

impl<P: Form + ?Sized> Shrinking<P> {
    pub fn new(method: Box<dyn Integrator<P> + Send>, springs: Vec<usize>) -> Self {
        Self {
            method,
            springs,
            before: BodyAngles::default(),
            now: BodyAngles::default(),
            from: State::default(),
            is_stale: true,
            z: Vec::new(),
        }
    }
}

/// D and D' of a spring of a mechanism \[m, m/s\].
fn span(
    mechanism: &Mechanism,
    number: usize,
    at: &BodyAngles,
    z: &mut Vec<Complex<f64>>,
) -> [Complex<f64>; 2] {
    let (spring, bodies) = (&mechanism.springs[number], mechanism.bodies.len());
    z.clear();
    z.extend(at.phi[..bodies].iter().map(|&phi| Complex::unit(phi)));
    // The translational coordinates of bodies that hang on nothing are where the first of their coordinates
    // is.
    z.extend(
        (bodies..at.phi.len())
            .map(|x| Complex::new(at.phi[x], at.phi.get(x + 1).copied().unwrap_or_default())),
    );
    [spring.span.position(z), spring.span.velocity(z, &at.omega)]
}

/// |D|² less what counts as none, over the free length: D's components over it.
struct Length(Vec<Chebyshev>);

impl Curve for Length {
    fn at(&self, t: f64) -> [f64; 2] {
        let [x, y] = [self.0[0].at(t), self.0[1].at(t)];
        [x[0] * x[0] + y[0] * y[0] - NONE * NONE, 2.0 * (x[0] * x[1] + y[0] * y[1])]
    }

    fn about(&self, centre: f64, radius: f64) -> Part {
        let [x, y] = [self.0[0].about(centre, radius), self.0[1].about(centre, radius)];
        let [value, slope] = self.at(centre);
        let bend = libm::hypot(x.bend, y.bend);
        let speed = libm::hypot(x.slope, y.slope) + bend * radius;
        let length = libm::hypot(x.value, y.value) + speed * radius;
        Part {
            value,
            slope,
            bend: 2.0 * (speed * speed + length * bend),
            rounding: length * (x.rounding + y.rounding),
        }
    }
}

/// True where the ends of a spring may meet in a step, if they are at most twice as fast on the way as at its
/// ends.
fn can_meet(a: [Complex<f64>; 2], b: [Complex<f64>; 2], time: f64) -> bool {
    let size = |x: Complex<f64>| x.norm_squared().sqrt();
    let reach = time * (size(a[1]).max(size(b[1])) + size(b[1] - a[1]));
    let nearest = size(a[0]).min(size(b[0]));
    nearest <= reach || reach.is_nan()
}

impl<P: Form + ?Sized> Shrinking<P> {
    /// Where a spring first loses its length in a step of `time` \[s\] between the two states looked at.
    fn lost(&mut self, problem: &mut P, time: f64) -> Option<Approach> {
        let mut first: Option<Approach> = None;
        for place in 0..self.springs.len() {
            let number = self.springs[place];
            let [a, b] =
                [&self.before, &self.now].map(|at| span(problem.mechanism(), number, at, &mut self.z));
            let found = if can_meet(a, b, time) { self.searched(problem, number, time) } else { None };
            first = [first, found].into_iter().flatten().min_by(|a, b| a.after.total_cmp(&b.after));
        }
        first
    }

    /// Where a spring loses its length in the last step, by the motion inside it.
    fn searched(&mut self, problem: &mut P, number: usize, time: f64) -> Option<Approach> {
        let Self { method, from, z, .. } = self;
        let (mut inside, mut at) = (from.clone(), BodyAngles::default());
        let free = problem.mechanism().springs[number].free_length;
        let span_at = |share: f64, row: &mut Vec<f64>| {
            method.interpolate(problem, from, from.time + share * time, &mut inside);
            problem.body_angles(&inside, &mut at);
            let [here, _] = span(problem.mechanism(), number, &at, z);
            row.extend([here.re / free, here.im / free]);
        };
        let length = Length(interpolated(&DEGREES, span_at, |part| part.tail() < RESOLVED).curves);
        match crossing(&length, 1.0) {
            Crossing::At(share) => Some(Approach { spring: number, after: share * time }),
            Crossing::Inside(_) => Some(Approach { spring: number, after: 0.0 }),
            Crossing::Nothing => None,
        }
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

impl<P: Form + ?Sized> Integrator<P> for Shrinking<P> {
    fn name(&self) -> &'static str {
        self.method.name()
    }

    fn order(&self) -> u32 {
        self.method.order()
    }

    fn begin(&mut self, problem: &mut P, state: &mut State, until: Time) -> Result<(), StepError> {
        self.is_stale = true;
        self.method.begin(problem, state, until)
    }

    /// A step of the inner method, looked at.
    fn step(
        &mut self,
        problem: &mut P,
        state: &mut State,
        until: Time,
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError> {
        if std::mem::take(&mut self.is_stale) {
            problem.body_angles(state, &mut self.before);
        }
        self.from.clone_from(state);
        let event = self.method.step(problem, state, until, statistics)?;
        problem.body_angles(state, &mut self.now);
        let time = (state.time - self.from.time).hi;
        if let Some(first) = self.lost(problem, time) {
            let stop = self.stop(problem, first, time);
            state.clone_from(&self.from);
            return Err(stop);
        }
        std::mem::swap(&mut self.before, &mut self.now);
        Ok(event)
    }

    fn is_at(&self, state: &State, until: Time) -> bool {
        self.method.is_at(state, until)
    }

    fn changed(&mut self, state: &mut State) {
        self.is_stale = true;
        self.method.changed(state);
    }

    fn save(&self, state: &mut State) {
        self.method.save(state);
    }

    fn is_dense(&self) -> bool {
        self.method.is_dense()
    }

    fn interpolate(&mut self, problem: &mut P, from: &State, time: Time, inside: &mut State) {
        self.method.interpolate(problem, from, time, inside);
    }

    fn reset(&mut self, state: &mut State) {
        self.method.reset(state);
    }

    fn internal_state(&self) -> Vec<f64> {
        self.method.internal_state()
    }

    fn restore_internal_state(&mut self, known: &[f64]) -> bool {
        self.method.restore_internal_state(known)
    }
}
