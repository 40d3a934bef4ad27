//! What the points of a sweep add up to.

use super::{Status, SweepPoint};
use std::time::Duration;

/// What a sweep amounted to, or the points of it seen so far.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Totals {
    /// Points that reached the horizon, or the flip they were to end with.
    pub done: u64,
    /// Points that stopped before.
    pub stopped: u64,
    /// Points that could not begin.
    pub refused: u64,
    /// Points left out.
    pub skipped: u64,
    /// Points in which a bar turned over.
    pub flipped: u64,
    /// Points done whose error was estimated, and those of them that are in doubt: see
    /// [`PointTrust::is_doubtful`](super::PointTrust::is_doubtful).
    pub judged: u64,
    /// See `judged`.
    pub doubtful: u64,
    /// Steps of all of them.
    pub steps: u64,
    /// Largest energy drift among those done, over the energy scale, and the point's number.
    pub energy: (f64, u64),
    /// Largest violation of a constraint among those done, at position \[rad or m\] and velocity level,
    /// whichever point.
    pub constraint: [f64; 2],
    /// Threads used.
    pub threads: usize,
    /// Time spent, interruptions left out.
    pub wall: Duration,
}

impl Totals {
    /// Points seen.
    pub fn points(&self) -> u64 {
        [self.done, self.stopped, self.refused, self.skipped].into_iter().fold(0, u64::saturating_add)
    }

    /// With those of the points that follow; times add up, and of threads the most counts.
    pub fn join(&mut self, next: &Self) {
        self.done += next.done;
        self.stopped += next.stopped;
        self.refused += next.refused;
        self.skipped += next.skipped;
        self.flipped += next.flipped;
        self.judged += next.judged;
        self.doubtful += next.doubtful;
        self.steps += next.steps;
        if next.energy.0 > self.energy.0 {
            self.energy = next.energy;
        }
        for (most, level) in self.constraint.iter_mut().zip(next.constraint) {
            *most = most.max(level);
        }
        self.threads = self.threads.max(next.threads);
        self.wall += next.wall;
    }

    pub(super) fn take(&mut self, point: &SweepPoint) {
        match point.status {
            Status::Done => self.done += 1,
            Status::Stopped(_) => self.stopped += 1,
            Status::Refused(_) => self.refused += 1,
            Status::Skipped => self.skipped += 1,
        }
        self.flipped += u64::from(point.flip.is_some());
        if let (Status::Done, Some(trust)) = (&point.status, &point.trust) {
            self.judged += u64::from(trust.error.is_some());
            self.doubtful += u64::from(trust.is_doubtful());
        }
        self.steps += point.steps;
        if point.status == Status::Done {
            if point.energy > self.energy.0 {
                self.energy = (point.energy, point.index);
            }
            for (most, level) in self.constraint.iter_mut().zip(point.constraint.unwrap_or_default()) {
                *most = most.max(level);
            }
        }
    }
}
