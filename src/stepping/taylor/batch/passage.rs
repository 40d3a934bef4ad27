//! What is shown of a step of a trajectory.

use crate::dynamics::{Mechanism, Motion, State, Time};

/// A step just taken, which can be looked at anywhere.
pub struct TakenStep<'a> {
    /// Time at its start.
    pub from: Time,
    /// Its length \[s\].
    pub step: f64,
    ends: &'a dyn Fn(usize) -> [[f64; 2]; 2],
    series: &'a dyn Fn(usize, f64) -> (f64, f64),
    motion: &'a dyn Fn(f64, &mut Motion),
}

impl<'a> TakenStep<'a> {
    /// A step from a time on, so long \[s\], with what [`TakenStep::ends`], [`TakenStep::at`] and
    /// [`TakenStep::motion`] tell of it.
    pub(crate) fn new(
        from: Time,
        step: f64,
        ends: &'a dyn Fn(usize) -> [[f64; 2]; 2],
        series: &'a dyn Fn(usize, f64) -> (f64, f64),
        motion: &'a dyn Fn(f64, &mut Motion),
    ) -> Self {
        Self { from, step, ends, series, motion }
    }

    /// Angle \[rad\] and rate \[rad/s\] of a body `after` \[s\] from the step's start, the angle continued
    /// from that at the start in [-π, π].
    pub fn at(&self, body: usize, after: f64) -> (f64, f64) {
        (self.series)(body, after)
    }

    /// The same at the start and at the end, as the integration has them: without a sum, and to rounding
    /// those of [`TakenStep::at`].
    pub fn ends(&self, body: usize) -> [[f64; 2]; 2] {
        (self.ends)(body)
    }

    /// Writes the motion of all coordinates `after` \[s\] from the step's start, without its work; at the end
    /// that which the integration has.
    pub fn motion(&self, after: f64, motion: &mut Motion) {
        (self.motion)(after, motion);
    }
}

/// How many coordinates a state of those in lanes has.
pub(super) fn coordinates(mechanism: &Mechanism) -> usize {
    if mechanism.has_multipliers() { mechanism.coordinates() } else { mechanism.partition.count() }
}

/// Reads angles and rates of all bodies from a state of those in lanes; tells how many coordinates the state
/// has.
pub(crate) fn read(mechanism: &Mechanism, state: &State, motion: &mut Motion) -> usize {
    let count = coordinates(mechanism);
    if mechanism.has_multipliers() {
        motion.follow(state, count);
    } else {
        mechanism.partition.read(state, motion);
    }
    count
}
