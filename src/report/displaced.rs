//! Starts of a sweep that are not as varied.

use super::page::{counted, rough};
use crate::run::{Sweep, Totals};

/// A value that is varied, and at the start of points another one.
pub(super) struct Displaced<'a> {
    path: &'a str,
    unit: &'static str,
    /// The points, and how many there are in all.
    points: [u64; 2],
    /// By how much at most.
    most: f64,
}

/// What of what is varied is another at the start of points.
pub(super) fn displaced<'a>(sweep: &'a Sweep, totals: &Totals) -> Vec<Displaced<'a>> {
    let both = sweep.variables().iter().zip(&totals.displaced);
    both.filter(|(_, (points, _))| *points > 0)
        .map(|(variable, &(points, most))| Displaced {
            path: &variable.path,
            unit: variable.unit,
            points: [points, totals.points()],
            most,
        })
        .collect()
}

/// The notes of its plan, and these.
pub(super) fn notes(sweep: &Sweep, totals: &Totals) -> Vec<String> {
    let displaced = displaced(sweep, totals);
    sweep.plan().notes.iter().cloned().chain(displaced.iter().map(ToString::to_string)).collect()
}

#[cfg(feature = "charts")]
impl Displaced<'_> {
    /// For the caption of a chart.
    pub fn briefly(&self) -> String {
        format!("{} is up to {} {} off at the start", self.path, rough(self.most), self.unit)
    }
}

impl std::fmt::Display for Displaced<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (Self { path, unit, most, .. }, [points, of]) = (self, self.points);
        write!(
            f,
            "{path} is not as varied at the start of {points} of {}, but up to {} {unit} off: the \
             constraints do not close with all start values given, and each changes as little as may be; \
             where some are left out, the first bodies keep theirs",
            counted(of, "point", "points"),
            rough(*most)
        )
    }
}
