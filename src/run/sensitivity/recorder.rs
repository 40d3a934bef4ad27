//! Values and derivatives of outputs, and derivatives of times, at the times that are asked for.

use super::extreme::ExtremeTurn;
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
    /// How outputs turn at their extremes, by the number of the measure.
    pub turns: Vec<(usize, ExtremeTurn)>,
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
        let (mut times, mut turns) = (Vec::new(), Vec::new());
        for (k, asked) in self.asked.iter().enumerate().filter(|(_, asked)| asked.t == Ok(time)) {
            match asked.measure {
                Measure::Flip => times.push((k, flip_slopes(variation, motion, asked.number))),
                Measure::Event(_) => {
                    times.extend(event_slopes(variation, motion, asked.number).map(|slopes| (k, slopes)));
                }
                Measure::Max(_) | Measure::Min(_) => {
                    let ended_by = asked.ended_by.and_then(|event| event_slopes(variation, motion, event));
                    times.extend(ended_by.map(|slopes| (k, slopes)));
                    let output = asked.output.filter(|_| !asked.is_end);
                    turns.extend(output.map(|output| (k, ExtremeTurn::of(variation, motion, output))));
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
            turns,
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

/// When a measure was taken, its value and derivatives; or why not, empty where the run ended before.
pub(super) fn taken(
    number: usize,
    asked: &Query,
    seen: &[RecordedTime],
    variation: &Variation,
) -> Result<(f64, f64, Vec<f64>), String> {
    if let Measure::Impact(wall) = &asked.measure {
        let first = variation.impacts.iter().find(|impact| impact.wall == *wall);
        let first = first.ok_or("there is no impact")?;
        return Ok((first.t, first.t, first.slopes.clone()));
    }
    let t = asked.t.clone()?;
    let at = seen.iter().find(|seen| seen.t == t).ok_or("")?;
    let Some(output) = asked.output else {
        // An event that a jump of the rates makes happen comes when that does.
        let jumped = variation
            .jumped
            .iter()
            .find(|(jumped, _)| *jumped == t && matches!(asked.measure, Measure::Event(_)));
        if let Some((_, slopes)) = jumped {
            return Ok((t, t, slopes.clone()));
        }
        let slopes = at.times.iter().find(|(measure, _)| *measure == number);
        let slopes = slopes.ok_or("the event function only touches zero")?.1.clone();
        return Ok((t, t, slopes));
    };
    let is_extreme = matches!(asked.measure, Measure::Max(_) | Measure::Min(_));
    let off = |side: &Derived| (side.values[output] - asked.value).abs();
    let (Derived { values, slopes, rates }, late) = match (&at.after, &at.moves) {
        // A jump or a corner moves in time: on the side that has the extreme.
        (Some(after), Some(late)) if is_extreme => {
            (if off(after) < off(&at.derived) { after } else { &at.derived }, Some(late))
        }
        _ if asked.ended_by.is_some() => {
            // So does the end, with the event.
            let late = at.times.iter().find(|(measure, _)| *measure == number);
            let late = late.ok_or("the function of the event that ends the run only touches zero")?;
            (&at.derived, Some(&late.1))
        }
        _ if is_extreme => (&at.derived, None),
        _ => (at.shown(), None),
    };
    let (value, rate, mut slopes) = (values[output], rates[output], slopes[output].clone());
    if is_extreme && late.is_none() && !asked.is_end && t != 0.0 {
        let turn = at.turns.iter().find(|(measure, _)| *measure == number);
        let turned = turn.is_some_and(|(_, turn)| turn.correct(rate, asked.range, &mut slopes));
        if !turned {
            return Err(format!("the extreme at {t} s is a corner of the curve, at an impact or an event"));
        }
    }
    slopes.iter_mut().zip(late.into_iter().flatten()).for_each(|(slope, late)| *slope += rate * late);
    Ok((t, value, slopes))
}
