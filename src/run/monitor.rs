//! Looks at a run at times of its own: neither when they are nor what is seen depends on the output times.

use crate::dynamics::Motion;
use crate::stepping::Statistics;

/// Looks at a run while it goes.
///
/// Methods with dense output are read at the time asked for, all others at the end of the first step that
/// reaches it.
pub(super) trait Monitor {
    /// The time of the next look \[s\]; infinite where there is none.
    fn due(&self) -> f64;

    /// Takes the motion, and what it has cost so far; the next look is later.
    fn observe(&mut self, motion: &Motion, statistics: Statistics);

    /// Told how many impacts and lasting contacts there have been so far.
    fn count_events(&mut self, count: u64);

    /// Told that the run goes on as it cannot follow, and why.
    fn end(&mut self, why: &str);
}

/// The same monitor for a shorter time.
pub(super) fn lent<'a>(monitor: &'a mut Option<&mut dyn Monitor>) -> Option<&'a mut dyn Monitor> {
    match monitor {
        Some(monitor) => Some(&mut **monitor),
        None => None,
    }
}
