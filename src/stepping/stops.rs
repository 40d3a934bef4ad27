//! Stops that several methods share.

use super::{Cause, StepError};
use crate::dynamics::State;

/// The stop of a step \[s\] at a time at which the ends of a spring meet.
pub(crate) fn without_length(spring: &str, method: &str, t: f64, step: f64) -> StepError {
    StepError {
        cause: Cause::SpringWithoutLength,
        method: method.into(),
        t,
        step,
        what: format!("spring `{spring}` has no length there, and its force no direction"),
        hint: "move an end or the start, or set free_length to 0 if the ends are meant to meet".into(),
    }
}

/// The stop of a step \[s\] in which a point came to rest on its wall.
pub(super) fn at_rest(method: &str, state: &State, step: f64) -> StepError {
    StepError {
        cause: Cause::RestingContact,
        method: method.into(),
        t: state.time.hi,
        step,
        what: "a point has come to rest on a wall".into(),
        hint:
            "raise the restitution of the wall, or change what presses the point against it; a wall must not \
               move on to where the point cannot go"
                .into(),
    }
}
