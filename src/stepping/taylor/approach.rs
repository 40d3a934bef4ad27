//! Springs whose ends nearly meet inside a step.
//!
//! Where the span D of a spring goes past zero at a distance d, its length has singularities in complex time
//! of strength d²: a series about a moment before them shows nothing of a near miss, and continues the
//! length through zero to negative ones.  A step therefore ends before a length falls below a tenth of what
//! it is at the beginning: from there on the powers tell of the singularity.

use super::Taylor;
use crate::arithmetic::Complex;
use crate::dynamics::force::meeting::{MeetingSpan, can_meet};
use crate::dynamics::series::Coefficient;
use crate::dynamics::{BodyAngles, Form, Mechanism, OdeSystem, State};
use crate::stepping::finest;

/// Share of a length at the beginning of a step that is left at least.
const LEFT: f64 = 0.1;
/// Chords a path is looked at by.
const CHORDS: usize = 16;

/// The springs of a mechanism whose ends can meet.
#[derive(Clone, Debug, Default)]
pub(super) struct Approach {
    spans: Vec<MeetingSpan>,
    bodies: usize,
    /// Motions at the beginning of a step and later in it.
    start: BodyAngles,
    there: BodyAngles,
    z: Vec<Complex<f64>>,
    /// Where the step begins.
    from: State,
}

impl Approach {
    /// Takes the springs of a mechanism.
    pub fn take_in(&mut self, mechanism: &Mechanism) {
        self.spans = MeetingSpan::all(mechanism);
        self.bodies = mechanism.bodies.len();
    }

    /// True without such springs.
    pub fn is_empty(&self) -> bool {
        self.spans.is_empty()
    }

    /// Notes where a step begins.
    pub fn begin(&mut self, state: &State) {
        if !self.is_empty() {
            self.from.clone_from(state);
        }
    }

    /// A spring that has no length where the step last looked at begins.
    pub fn without_length(&mut self) -> Option<&str> {
        let Self { spans, bodies, start, z, .. } = self;
        let lost = spans.iter().find(|span| size(span.ends(*bodies, start, z)[0]) < span.none)?;
        Some(&lost.name)
    }

    /// Of a step as much, but not below `least`, as no length falls too far in; `at` writes the motion so
    /// many seconds from its beginning.
    pub fn shortened(&mut self, mut h: f64, least: f64, mut at: impl FnMut(f64, &mut BodyAngles)) -> f64 {
        let Self { spans, bodies, start, there, z, .. } = self;
        at(0.0, start);
        at(h, there);
        for span in &*spans {
            let begin = span.ends(*bodies, start, z);
            if size(begin[0]) <= span.least || !can_meet(begin, span.ends(*bodies, there, z), h) {
                continue;
            }
            let allowed = LEFT * size(begin[0]);
            let mut falls = |h: f64| {
                let mut last = begin[0];
                (1..=CHORDS).any(|chord| {
                    at(h * (chord as f64 / CHORDS as f64), there);
                    let [next, _] = span.ends(*bodies, there, z);
                    nearest(std::mem::replace(&mut last, next), next) < allowed
                })
            };
            let whole = h;
            while h > least && falls(h) {
                h = (0.5 * h).max(least);
            }
            if h < whole {
                at(h, there);
            }
        }
        h
    }
}

impl<T: Coefficient> Taylor<T> {
    /// Of the step `h` \[s\] as much as no spring nearly loses its length in; where the step is already
    /// made, the state goes back with it.
    pub(super) fn before_meeting<P: OdeSystem + Form + ?Sized>(
        &mut self,
        problem: &mut P,
        state: &mut State,
        h: f64,
    ) -> f64 {
        let (mut approach, mut inside) =
            (std::mem::take(&mut self.approach), std::mem::take(&mut self.inside));
        let from = std::mem::take(&mut approach.from);
        let least = finest(&from, problem.time_unit()).min(h);
        let shorter = approach.shortened(h, least, |after, angles| {
            self.sum(&from, from.time + after, &mut inside);
            problem.body_angles(&inside, angles);
        });
        if shorter < h && !self.by_series {
            self.sum(&from, from.time + shorter, state);
            state.time = from.time;
        }
        approach.from = from;
        (self.approach, self.inside) = (approach, inside);
        shorter
    }
}

fn size(x: Complex<f64>) -> f64 {
    x.norm_squared().sqrt()
}

/// The distance of the origin from the chord between two points.
fn nearest(a: Complex<f64>, b: Complex<f64>) -> f64 {
    let chord = b - a;
    let square = chord.norm_squared();
    let share = if square > 0.0 { (-a.dot(chord) / square).clamp(0.0, 1.0) } else { 0.0 };
    size(Complex::new(a.re + share * chord.re, a.im + share * chord.im))
}
