//! Values and derivatives of outputs, and derivatives of times, at the times that are asked for.

use super::extreme::ExtremeTurn;
use super::measure::{Derived, Measure, event_slopes, flip_slopes, impact_slopes, outputs, outputs_beside};
use super::variation::plain;
use super::{Look, Query, SensitivityError, Variation, refused};
use crate::dynamics::Motion;
use crate::dynamics::kernel::{Bias, Kernel};

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

/// Difference of an output between both sides of a moment, over its size, that is no jump; and what the side
/// that has an extreme may be off it, over the jump.
const NO_JUMP: f64 = 1e-6;
const OFF: f64 = 1e-3;

/// Derivative of a time \[s per unit of the number\], over that time, that is rounding.
const STILL: f64 = 1e-9;

/// What is said of a zero that is no simple one.
const UNKNOWN: &str =
    " at its zero, which it touches or passes as a higher power: how that time moves is not known";

/// Share of the weakest constraint below which forces are those of a singular position.
const BESIDE: f64 = 1e-6;

/// What was seen at one time.
pub(super) struct RecordedTime {
    pub t: f64,
    /// Before what happens at that time.
    pub derived: Derived,
    /// The same after it, where anything happens.
    pub after: Option<Derived>,
    /// On the branches that hold just before that time and just after it, where an extreme is taken then.
    pub sides: Option<[Derived; 2]>,
    /// How that time moves, where the columns were taken through it or an impact is about to happen.
    pub moves: Option<Vec<f64>>,
    /// Derivatives of times, by the number of their measure.
    pub times: Vec<(usize, Vec<f64>)>,
    /// How outputs turn at their extremes, by the number of the measure.
    pub turns: Vec<(usize, ExtremeTurn)>,
    /// True at a singular position, and so near to one that differences of forces are rounding.
    pub is_singular: bool,
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
        let is_extreme = self.asked.iter().any(|asked| asked.is_extreme() && asked.t == Ok(time));
        let sides = is_extreme.then(|| [-1.0, 1.0].map(|sense| outputs_beside(variation, motion, sense)));
        self.seen.push(RecordedTime {
            t: time,
            derived: outputs(variation, motion),
            after: None,
            sides,
            moves: impact_slopes(variation, motion),
            times,
            turns,
            is_singular: self.asks_for_forces(variation, time) && is_singular(variation, motion),
        });
    }

    fn crossed(&mut self, variation: &mut Variation, motion: &Motion, time: f64) {
        let Some(seen) = self.seen.last_mut().filter(|seen| seen.t == time) else { return };
        let moment = variation.moment.as_ref().filter(|(at, _)| at.hi == time);
        seen.moves = moment.map(|(_, late)| late.clone());
        seen.after = Some(outputs(variation, motion));
        if let Some([_, after]) = &mut seen.sides {
            *after = outputs_beside(variation, motion, 1.0);
        }
    }
}

impl SensitivityRecorder<'_> {
    /// True where an extreme of forces or accelerations is asked for at a time.
    fn asks_for_forces(&self, variation: &Variation, time: f64) -> bool {
        let outputs = variation.mechanism.outputs.as_ref();
        let follows = outputs.map_or(&[][..], |outputs| outputs.follows_equations());
        let is_force = |asked: &Query| asked.output.is_some_and(|output| follows.get(output) == Some(&true));
        self.asked.iter().any(|asked| asked.is_extreme() && asked.t == Ok(time) && is_force(asked))
    }
}

/// True of a motion at a singular position, or beside it.
fn is_singular(variation: &Variation, motion: &Motion) -> bool {
    let (t, phi, omega) = plain(motion);
    let mut kernel = Kernel::new(&variation.mechanism);
    kernel.accelerations(&variation.mechanism, t, &phi, &omega, Bias::default());
    variation.mechanism.standing_share(&kernel) < BESIDE
}

impl RecordedTime {
    /// What a row at that time shows: what comes after an event, as rows of a run do.
    pub fn shown(&self) -> &Derived {
        self.after.as_ref().unwrap_or(&self.derived)
    }

    /// True where an output has other derivatives before that time than after it, and the numbers move it.
    fn is_split(&self, output: usize) -> bool {
        let late = self.moves.as_ref().filter(|late| late.iter().any(|late| late.abs() > STILL * self.t));
        let (Some(late), before) = (late, &self.derived) else { return false };
        // The impact is about to happen: nothing is known of what comes after it.
        let Some(after) = &self.after else { return true };
        let differ = |a: f64, b: f64, size: f64| (a - b).abs() > NO_JUMP * (a.abs().max(b.abs()) + size);
        let rate = before.rates[output].abs().max(after.rates[output].abs());
        let mut slopes = before.slopes[output].iter().zip(&after.slopes[output]).zip(late);
        differ(before.values[output], after.values[output], rate * self.t)
            || slopes.any(|((before, after), late)| differ(*before, *after, rate * late.abs()))
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
        let first = first.ok_or(if variation.lost.is_some() { "" } else { "there is no impact" })?;
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
        let slopes = slopes.ok_or(format!("the event function has a rate of zero{UNKNOWN}"))?.1.clone();
        return Ok((t, t, slopes));
    };
    if asked.is_extreme() {
        return extreme(number, asked, t, at).map(|(value, slopes)| (t, value, slopes));
    }
    if at.is_split(output) {
        return Err(format!(
            "{t} s is the time of an impact or an event that the numbers move: it has one derivative before \
             and another one after it"
        ));
    }
    let Derived { values, slopes, .. } = at.shown();
    Ok((t, values[output], slopes[output].clone()))
}

/// An extreme at a time, on the side of a jump that has it, and its derivatives; or why there are none.
fn extreme(number: usize, asked: &Query, t: f64, at: &RecordedTime) -> Result<(f64, Vec<f64>), String> {
    let (Some(output), Some([before, after])) = (asked.output, &at.sides) else {
        return Err(format!("the run does not come to the extreme at {t} s"));
    };
    let value = |side: &Derived| side.values[output];
    let off = |side: &Derived| (value(side) - asked.value).abs();
    let nearer = |one, other| if off(other) < off(one) { other } else { one };
    let jump = [before, after]
        .into_iter()
        .fold(0.0, |most: f64, side| most.max((value(side) - value(&at.derived)).abs()));
    let has_jump = jump > NO_JUMP * asked.range[0].abs().max(asked.range[1].abs());
    if at.is_singular {
        return Err(format!(
            "the extreme at {t} s is at a singular position, where the state does not tell it"
        ));
    }
    let corner = || {
        format!(
            "the extreme at {t} s is none of a smooth curve: it is at a corner, an impact or an event, or \
             where the output is constant but for rounding"
        )
    };
    let (side, late) = match &at.moves {
        // A jump or a corner moves in time.
        Some(late) if at.after.is_some() => (nearer(before, after), Some(late)),
        _ if asked.ended_by.is_some() => {
            // So does the end, with the event.
            let late = at.times.iter().find(|(measure, _)| *measure == number);
            let unknown =
                || format!("the rate of the function of the event that ends the run is zero{UNKNOWN}");
            (before, Some(&late.ok_or_else(unknown)?.1))
        }
        _ if asked.is_end => (before, None),
        _ if t == 0.0 => (nearer(&at.derived, after), None),
        _ if has_jump => return Err(corner()),
        _ => (&at.derived, None),
    };
    if has_jump && off(side) > OFF * jump {
        return Err(format!(
            "on neither side of the jump at {t} s is it {:e}, the extreme that a run finds there",
            asked.value
        ));
    }
    let (rate, mut slopes) = (side.rates[output], side.slopes[output].clone());
    if late.is_none() && !asked.is_end && t != 0.0 {
        let turn = at.turns.iter().find(|(measure, _)| *measure == number);
        let turned = turn.is_some_and(|(_, turn)| turn.correct(rate, asked.range, &mut slopes));
        if !turned {
            return Err(corner());
        }
    }
    slopes.iter_mut().zip(late.into_iter().flatten()).for_each(|(slope, late)| *slope += rate * late);
    Ok((value(side), slopes))
}
