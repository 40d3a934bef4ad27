//! Springs that lose their length on the way: their force has no direction there, and a step can leap over
//! the place without a trace.
//!
//! A power series takes sqrt(|D|²) through zero to a negative length, and a fixed step does not see the jump
//! of the force at all; both come out on the other side with another energy, or nearly the same.  Where the
//! two ends of a spring that pulls there can meet, the driver shows every step to a [`SpringGuard`]: the
//! [search](crate::stepping::search) for all events looks on its dense output for zeros of the squared length
//!
//! ```text
//! g = (|D| / L_0)² - 1,     |g''| <= (2 |D'|² + 2 |D| |D''|) / L_0²
//! ```
//!
//! where L_0 is 1e-6 of the free length, or for a law by a formula 1e-7 of the lengths its span is made of.
//!
//! Mechanisms whose springs are too far from their places for that are integrated without.

use crate::arithmetic::Complex;
use crate::dynamics::force::meeting::{MeetingSpan, can_meet};
use crate::dynamics::{BodyAngles, Mechanism};
use crate::stepping::search::{Chebyshev, Crossing, Curve, IntervalBounds, crossing, interpolated};
use crate::stepping::{StepError, without_length};

/// Degrees of the interpolants of a span inside a step, and what the last coefficients may be of a length
/// that counts as none.
const DEGREES: [usize; 3] = [8, 16, 32];
const RESOLVED: f64 = 1e-3;

/// Watches the springs that can lose their length.
#[derive(Default)]
pub(super) struct SpringGuard {
    springs: Vec<MeetingSpan>,
    /// Number of bodies of the mechanism.
    bodies: usize,
    /// The beginning of the step to come.
    pub before: BodyAngles,
    /// The end of the step made.
    pub now: BodyAngles,
    z: Vec<Complex<f64>>,
}

/// A spring whose ends meet.
pub(super) struct WithoutLength {
    name: String,
    /// After the beginning of the step \[s\].
    after: f64,
}

/// The square of |D| over what counts as none, less 1: D's components over that.
struct Length(Vec<Chebyshev>);

impl Curve for Length {
    fn at(&self, t: f64) -> [f64; 2] {
        let [x, y] = [self.0[0].at(t), self.0[1].at(t)];
        [x[0] * x[0] + y[0] * y[0] - 1.0, 2.0 * (x[0] * x[1] + y[0] * y[1])]
    }

    fn about(&self, centre: f64, radius: f64) -> IntervalBounds {
        let [x, y] = [self.0[0].about(centre, radius), self.0[1].about(centre, radius)];
        let [value, slope] = self.at(centre);
        let bend = libm::hypot(x.bend, y.bend);
        let speed = libm::hypot(x.slope, y.slope) + bend * radius;
        let length = libm::hypot(x.value, y.value) + speed * radius;
        IntervalBounds {
            value,
            slope,
            bend: 2.0 * (speed * speed + length * bend),
            rounding: length * (x.rounding + y.rounding),
        }
    }
}

impl SpringGuard {
    /// One for the springs of a mechanism; `None` where none of them can lose its length.
    pub fn new(mechanism: &Mechanism) -> Option<Self> {
        let mut springs = MeetingSpan::all(mechanism);
        springs.retain(|spring| spring.none > 0.0);
        (!springs.is_empty()).then(|| Self { springs, bodies: mechanism.bodies.len(), ..Self::default() })
    }

    /// Where in the step made, of `span` \[s\], a spring first loses its length; `at` looks so many seconds
    /// after its beginning.
    pub fn step(&mut self, span: f64, at: &mut dyn FnMut(f64) -> BodyAngles) -> Option<WithoutLength> {
        let Self { springs, bodies, before, now, z } = self;
        let mut first: Option<(f64, &MeetingSpan)> = None;
        for spring in &*springs {
            let [a, b] = [&*before, &*now].map(|at| spring.ends(*bodies, at, z));
            let found = if can_meet(a, b, span) { searched(spring, *bodies, span, at, z) } else { None };
            let found = found.map(|after| (after, spring));
            first = [first, found].into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
        }
        std::mem::swap(before, now);
        first.map(|(after, spring)| WithoutLength { name: spring.name.clone(), after })
    }
}

/// How long after the beginning of a step a spring loses its length, by the motion inside it \[s\].
fn searched(
    spring: &MeetingSpan,
    bodies: usize,
    span: f64,
    at: &mut dyn FnMut(f64) -> BodyAngles,
    z: &mut Vec<Complex<f64>>,
) -> Option<f64> {
    let ends_at = |share: f64, row: &mut Vec<f64>| {
        let [here, _] = spring.ends(bodies, &at(share * span), z);
        row.extend([here.re / spring.none, here.im / spring.none]);
    };
    let length = Length(interpolated(&DEGREES, ends_at, |_, part, _| part.tail() < RESOLVED).curves);
    match crossing(&length, 1.0) {
        Crossing::At(share) => Some(share * span),
        Crossing::Inside(_) => Some(0.0),
        Crossing::Nothing => None,
    }
}

impl WithoutLength {
    /// The stop of a method whose step of `span` \[s\] began at `t` \[s\].
    pub fn stop(&self, method: &str, t: f64, span: f64) -> StepError {
        without_length(&self.name, method, t + self.after, span)
    }
}
