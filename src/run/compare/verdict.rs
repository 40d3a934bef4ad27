//! What follows from the figures: what nothing beats, and what to choose.

use super::{Comparison, Entry};

/// Errors the advice is given for \[rad\].
pub const TARGETS: [f64; 4] = [1e-3, 1e-6, 1e-9, 1e-12];

/// A path that is off by more has nothing to do with the scene's \[rad\].
pub const LOST: f64 = 0.1;

/// Errors below which settings are not told apart: a few roundings of a turn, or of the energy scale.
pub const ROUNDING: f64 = 1e-15;

/// The numbers of the points that no other beats in both coordinates, from the least first one on; points
/// with a coordinate that is not finite are none.
///
/// Of several at one place the first counts.
pub fn front(points: &[[f64; 2]]) -> Vec<usize> {
    let mut order: Vec<usize> =
        (0..points.len()).filter(|&i| points[i].iter().all(|x| x.is_finite())).collect();
    order.sort_by(|&a, &b| points[a][0].total_cmp(&points[b][0]).then(points[a][1].total_cmp(&points[b][1])));
    let mut least = f64::INFINITY;
    order.retain(|&i| {
        let is_better = points[i][1] < least;
        least = least.min(points[i][1]);
        is_better
    });
    order
}

/// What to choose for an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Advice {
    /// The error wanted \[rad\].
    pub target: f64,
    /// The entry that reaches it in the least time, by number.
    pub entry: Option<usize>,
    /// The same among the other methods.
    pub next: Option<usize>,
    /// Where none reaches it: the entry with the least error.
    pub nearest: Option<usize>,
    /// True where the reference itself is not good enough to tell.
    pub is_blind: bool,
}

impl Comparison {
    /// Numbers of the entries that no other beats in both run time and error, fastest first; lost paths are
    /// none.
    pub fn front(&self) -> Vec<usize> {
        let floor = self.truth.accuracy.max(ROUNDING);
        let error =
            |entry: &Entry| entry.error().filter(|&error| error <= LOST).map(|error| error.max(floor));
        let point = |entry: &Entry| [entry.median().unwrap_or(f64::NAN), error(entry).unwrap_or(f64::NAN)];
        front(&self.entries.iter().map(point).collect::<Vec<_>>())
    }

    /// What to choose for each of the [`TARGETS`].
    pub fn advice(&self) -> [Advice; 4] {
        TARGETS.map(|target| self.advise(target))
    }

    fn advise(&self, target: f64) -> Advice {
        let is_blind = self.truth.accuracy > 0.3 * target || self.truth.until <= 0.0;
        // What is counted as having come to the end with a time and an error.
        let finished = || {
            let known = |(number, entry): (usize, &Entry)| Some((number, entry.median()?, entry.error()?));
            self.entries.iter().enumerate().filter_map(known)
        };
        let reached = || finished().filter(|(.., error)| *error <= target && !is_blind);
        let fastest = |found: &(usize, f64, f64), other: &(usize, f64, f64)| found.1.total_cmp(&other.1);
        let entry = reached().min_by(fastest).map(|found| found.0);
        let is_other = |found: &(usize, f64, f64)| {
            entry.is_some_and(|entry| self.entries[found.0].method != self.entries[entry].method)
        };
        let next = reached().filter(is_other).min_by(fastest).map(|found| found.0);
        let nearest = if entry.is_none() {
            finished().min_by(|a, b| a.2.total_cmp(&b.2)).map(|found| found.0)
        } else {
            None
        };
        Advice { target, entry, next, nearest, is_blind }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Fate, RunMeasurement, Truth};
    use super::*;
    use crate::dynamics::Mechanism;
    use crate::run::MethodId;
    use crate::scene::read_scene;

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let points = [
            [5.0, 0.0],
            [2.0, 1e-2],
            [1.0, 1e-3],
            [3.0, 1e-8],
            [3.0, 1e-9],
            [4.0, 1e-9],
            [0.5, f64::NAN],
            [f64::INFINITY, 0.0],
        ];
        assert_eq!(front(&points), [2, 4, 0]);
        assert!(front(&[]).is_empty());
    }

    /// A run of `method` with this error and run time \[s\].
    fn entry(method: MethodId, error: f64, seconds: f64) -> Entry {
        let found = RunMeasurement {
            error,
            rate_error: 0.0,
            errors: Vec::new(),
            energy: 0.0,
            constraint: None,
            statistics: Default::default(),
        };
        Entry {
            found: Some(found),
            blocks: vec![seconds, 0.9 * seconds, 3.0 * seconds],
            ..Entry::without(method, false, None, None, Fate::Done)
        }
    }

    fn compared(entries: Vec<Entry>, accuracy: f64) -> Comparison {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/scenes/free.json");
        let scene = read_scene(path.as_ref(), &[]).expect("a shipped scene");
        let truth =
            Truth { until: 1.0, accuracy, ..Truth::none(&Mechanism::new(&scene).expect("equations")) };
        Comparison { until: 1.0, truth, entries, notes: Vec::new(), is_whole: true, wall: Default::default() }
    }

    #[test]
    fn the_fastest_that_reaches_an_error_is_advised_and_nothing_that_did_not_end() {
        let mut stopped = entry(MethodId::Dop853, 1e-14, 0.01);
        stopped.fate = Fate::Late(0.5);
        let entries = vec![
            entry(MethodId::Dp8, 1e-4, 1.0),
            entry(MethodId::Taylor, 1e-7, 2.0),
            entry(MethodId::Taylor, 1e-8, 3.0),
            entry(MethodId::Gauss(8), 1e-10, 5.0),
            entry(MethodId::Dp5, 0.5, 0.1),
            stopped,
        ];
        let comparison = compared(entries, 1e-20);
        let advice = comparison.advice();
        let chosen = |k: usize| (advice[k].entry, advice[k].next, advice[k].nearest);
        assert_eq!(chosen(0), (Some(0), Some(1), None));
        assert_eq!(chosen(1), (Some(1), Some(3), None));
        assert_eq!(chosen(2), (Some(3), None, None));
        assert_eq!(chosen(3), (None, None, Some(3)), "no method reaches it");
        assert_eq!(comparison.front(), [0, 1, 2, 3], "a lost path is on no front");
        // A reference that is no better than the error wanted tells nothing.
        let blind = compared(comparison.entries, 1e-9).advice();
        assert_eq!([0, 1, 2, 3].map(|k| blind[k].is_blind), [false, false, true, true]);
        assert_eq!(blind[2].entry, None);
    }
}
