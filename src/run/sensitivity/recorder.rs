//! Values and derivatives of outputs, and derivatives of times, at the times that are asked for.

use super::measure::{Derived, Measure, event_slopes, flip_slopes, outputs};
use super::{Look, Query, SensitivityError, Variation, refused};
use crate::dynamics::Motion;

/// Most rows over time.
const MOST_ROWS: f64 = 1e6;

/// Times of rows from 0 on.
pub(super) fn times(until: f64, every: Option<f64>) -> Result<Vec<f64>, SensitivityError> {
    let Some(every) = every else { return Ok(Vec::new()) };
    let rows = (until / every).ceil();
    if !(every > 0.0 && rows <= MOST_ROWS) {
        let hint = format!("an interval above zero that makes at most {MOST_ROWS:e} rows");
        return Err(refused(format!("the interval {every:e} s makes {rows:e} rows"), &hint));
    }
    Ok((0..=rows as u64).map(|k| (k as f64 * every).min(until)).collect())
}

/// What was seen at one time.
pub(super) struct RecordedTime {
    pub t: f64,
    /// Before what happens at that time.
    pub derived: Derived,
    /// The same after it, where anything happens.
    pub after: Option<Derived>,
    /// How that time moves, where the columns were taken through it.
    pub moves: Option<Vec<f64>>,
    /// Derivatives of times, by the number of their measure.
    pub times: Vec<(usize, Vec<f64>)>,
}

/// Sees a run at the times asked for.
pub(super) struct SensitivityRecorder<'a> {
    /// The times \[s\], rising.
    pub times: Vec<f64>,
    /// How many are over.
    pub next: usize,
    pub asked: &'a [Query],
    pub seen: Vec<RecordedTime>,
}

impl Look for SensitivityRecorder<'_> {
    fn next(&self) -> Option<f64> {
        self.times.get(self.next).copied()
    }

    fn at(&mut self, variation: &mut Variation, motion: &Motion, time: f64) {
        self.next += 1;
        let mut times = Vec::new();
        for (k, asked) in self.asked.iter().enumerate().filter(|(_, asked)| asked.t == Ok(time)) {
            match asked.measure {
                Measure::Flip => times.push((k, flip_slopes(variation, motion, asked.number))),
                Measure::Event(_) => {
                    times.extend(event_slopes(variation, motion, asked.number).map(|slopes| (k, slopes)));
                }
                Measure::Max(_) | Measure::Min(_) => {
                    let ended_by = asked.ended_by.and_then(|event| event_slopes(variation, motion, event));
                    times.extend(ended_by.map(|slopes| (k, slopes)));
                }
                _ => {}
            }
        }
        self.seen.push(RecordedTime {
            t: time,
            derived: outputs(variation, motion),
            after: None,
            moves: None,
            times,
        });
    }

    fn crossed(&mut self, variation: &mut Variation, motion: &Motion, time: f64) {
        let Some(seen) = self.seen.last_mut().filter(|seen| seen.t == time) else { return };
        let moment = variation.moment.as_ref().filter(|(at, _)| at.hi == time);
        seen.moves = moment.map(|(_, late)| late.clone());
        seen.after = Some(outputs(variation, motion));
    }
}

impl RecordedTime {
    /// What a row at that time shows: what comes after an event, as rows of a run do.
    pub fn shown(&self) -> &Derived {
        self.after.as_ref().unwrap_or(&self.derived)
    }
}
