//! What is shown of a step of a trajectory.

use crate::dynamics::Time;

/// A step just taken, which can be looked at anywhere.
pub struct Passage<'a> {
    /// Time at its start.
    pub from: Time,
    /// Its length \[s\].
    pub step: f64,
    ends: &'a dyn Fn(usize) -> [[f64; 2]; 2],
    series: &'a dyn Fn(usize, f64) -> (f64, f64),
}

impl<'a> Passage<'a> {
    /// A step from a time on, so long \[s\], with what [`Passage::ends`] and [`Passage::at`] tell of it.
    pub(crate) fn new(
        from: Time,
        step: f64,
        ends: &'a dyn Fn(usize) -> [[f64; 2]; 2],
        series: &'a dyn Fn(usize, f64) -> (f64, f64),
    ) -> Self {
        Self { from, step, ends, series }
    }

    /// Angle \[rad\] and rate \[rad/s\] of a body `after` \[s\] from the step's start, the angle continued
    /// from that at the start in [-π, π].
    pub fn at(&self, body: usize, after: f64) -> (f64, f64) {
        (self.series)(body, after)
    }

    /// The same at the start and at the end, as the integration has them: without a sum, and to rounding
    /// those of [`Passage::at`].
    pub fn ends(&self, body: usize) -> [[f64; 2]; 2] {
        (self.ends)(body)
    }
}
