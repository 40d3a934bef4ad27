//! What the points of a sweep add up to.

use super::{Status, SweepPoint};
use std::time::Duration;

/// Ends are the same up to so much of their time: an event's time is known to rounding only.
const SAME_END: f64 = 1e-9;

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
    /// For each value that is varied the points that start with another one, as the constraints do not let
    /// it be as varied, and by how much at most; empty where none does.
    pub displaced: Vec<(u64, f64)>,
    /// Steps of all of them.
    pub steps: u64,
    /// Largest energy drift among those done, over the energy scale, and the point's number.
    pub energy: (f64, u64),
    /// Largest violation of a constraint among those done, at position \[rad or m\] and velocity level,
    /// whichever point.
    pub constraint: [f64; 2],
    /// Earliest and latest end of those done \[s\], where there are any.
    pub ends: Option<[f64; 2]>,
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

    /// The time at which all of those done ended \[s\]; none where they ended at different ones.
    pub fn end(&self) -> Option<f64> {
        self.ends.filter(|[first, last]| last - first <= SAME_END * last.abs()).map(|[_, last]| last)
    }

    fn ended(&mut self, next: Option<[f64; 2]>) {
        self.ends = match (self.ends, next) {
            (Some([first, last]), Some(next)) => Some([first.min(next[0]), last.max(next[1])]),
            (ends, next) => ends.or(next),
        };
    }

    fn displaced(&mut self, next: impl Iterator<Item = (u64, f64)>) {
        for (k, (points, most)) in next.enumerate().filter(|(_, (points, _))| *points > 0) {
            self.displaced.resize(self.displaced.len().max(k + 1), (0, 0.0));
            self.displaced[k].0 += points;
            self.displaced[k].1 = self.displaced[k].1.max(most);
        }
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
        self.displaced(next.displaced.iter().copied());
        self.steps += next.steps;
        if next.energy.0 > self.energy.0 {
            self.energy = next.energy;
        }
        for (most, level) in self.constraint.iter_mut().zip(next.constraint) {
            *most = most.max(level);
        }
        self.ended(next.ends);
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
        self.displaced(point.displaced.iter().map(|by| (u64::from(*by != 0.0), by.abs())));
        self.steps += point.steps;
        if point.status == Status::Done {
            self.ended(Some([point.t; 2]));
            if point.energy > self.energy.0 {
                self.energy = (point.energy, point.index);
            }
            for (most, level) in self.constraint.iter_mut().zip(point.constraint.unwrap_or_default()) {
                *most = most.max(level);
            }
        }
    }
}
