//! Runs side by side, from row to row: one, or two with other digits and orders that prove each other.

use super::{
    DigitsSource, LongError, LongEvent, LongHold, LongRun, LongTurn, SavedDigits, ShownRow, Wide, long_run,
};
use crate::arithmetic::Real;
use crate::arithmetic::sum::larger;
use crate::stepping::StepError;
use std::ops::RangeInclusive;
use std::time::{Duration, Instant};

/// Rows that are gathered before they are shown, at most.
const MOST: u64 = 64;
/// How long that may take.
const LONGEST: Duration = Duration::from_millis(400);

/// Runs that go from row to row together.
pub struct DigitsPair {
    runs: Vec<Box<dyn LongRun>>,
    next: u64,
    /// Rows gathered at a time.
    rows: u64,
    /// The runs as they were before the rows that are next.
    saved: Vec<SavedDigits>,
    /// Rows up to a stop.
    stopped: Vec<(ShownRow, Option<f64>)>,
}

/// How far runs have come.
#[derive(Clone, Debug)]
pub enum PairProgress {
    /// Rows, each of the run with the most digits, with the digits to which all agree.
    Rows(Vec<(ShownRow, Option<f64>)>),
    /// All rows are there.
    Over,
    /// A pause was asked for.
    Paused,
}

impl DigitsPair {
    /// Of a scene, with these precisions.
    ///
    /// # Errors
    /// As [`long_run`].
    pub fn new(source: &DigitsSource, precisions: &[super::Precision]) -> Result<Self, LongError> {
        let runs: Vec<_> =
            precisions.iter().map(|&precision| long_run(source, precision)).collect::<Result<_, _>>()?;
        let saved = runs.iter().map(|run| run.save()).collect();
        Ok(Self { runs, next: 0, rows: 1, saved, stopped: Vec::new() })
    }

    /// Goes on where others were, before the row `next`; false where they cannot have been runs of this
    /// scene.
    pub fn resume(&mut self, saved: &[SavedDigits], next: u64) -> bool {
        let is_sound = saved.len() == self.runs.len() && next <= self.last_row() + 1;
        // The row before tells again what had happened up to it, and whether that has ended the run.
        let goes_on = |(run, saved): (&mut Box<dyn LongRun>, &SavedDigits)| {
            let is_back =
                |run: &mut Box<dyn LongRun>| matches!(run.row(next - 1, &mut || false), Ok(Some(_)));
            run.resume(saved) && (next == 0 || is_back(run))
        };
        if !is_sound || !self.runs.iter_mut().zip(saved).all(goes_on) {
            return false;
        }
        (self.saved, self.next) = (saved.to_vec(), next);
        true
    }

    /// The runs before the next row, and its number.
    pub fn save(&self) -> (&[SavedDigits], u64) {
        (&self.saved, self.next)
    }

    /// The number of the last row.
    pub fn last_row(&self) -> u64 {
        self.runs.first().map_or(0, |run| run.last_row())
    }

    /// The events of the run with the most digits, with the digits to which all agree.
    pub fn events(&self) -> Vec<(LongEvent, Option<f64>)> {
        let mut found: Vec<Vec<LongEvent>> = self.runs.iter().map(|run| run.events()).collect();
        let best = found.pop().unwrap_or_default();
        let most = self.most();
        let with_agreement = |(i, event): (usize, LongEvent)| {
            let digits = |other: &Vec<LongEvent>| match other.get(i) {
                Some(other) if other.name == event.name => {
                    let numbers = |event: &LongEvent| -> Vec<Wide> {
                        std::iter::once(&event.t).chain(&event.phi).chain(&event.omega).copied().collect()
                    };
                    agreed(&numbers(other), &numbers(&event)).min(most)
                }
                _ => 0.0,
            };
            let least = found.iter().map(digits).reduce(f64::min);
            (event, least)
        };
        best.into_iter().enumerate().map(with_agreement).collect()
    }

    /// The times that points stayed on walls, of the run with the most digits, with the digits to which all
    /// agree.
    pub fn holds(&self) -> Vec<(LongHold, Option<f64>)> {
        let mut found: Vec<Vec<LongHold>> = self.runs.iter().map(|run| run.holds()).collect();
        let best = found.pop().unwrap_or_default();
        let most = self.most();
        let times = |hold: &LongHold| -> Vec<Wide> { std::iter::once(hold.t).chain(hold.until).collect() };
        let with_agreement = |hold: LongHold| {
            // More digits follow stays that become ever shorter further.
            let digits = |other: &Vec<LongHold>| {
                let is_alike = |other: &&LongHold| {
                    other.wall == hold.wall && other.until.is_some() == hold.until.is_some()
                };
                let alike = other.iter().filter(is_alike).map(|other| agreed(&times(other), &times(&hold)));
                alike.fold(0.0, f64::max).min(most)
            };
            let least = found.iter().map(digits).reduce(f64::min);
            (hold, least)
        };
        best.into_iter().map(with_agreement).collect()
    }

    /// The transitions of places with friction of the run with the most digits, with the digits to which all
    /// agree.
    pub fn turns(&self) -> Vec<(LongTurn, Option<f64>)> {
        let mut found: Vec<Vec<LongTurn>> = self.runs.iter().map(|run| run.turns()).collect();
        let best = found.pop().unwrap_or_default();
        let most = self.most();
        let with_agreement = |(i, turn): (usize, LongTurn)| {
            let digits = |other: &Vec<LongTurn>| match other.get(i) {
                Some(other) if other.name == turn.name && other.does == turn.does => {
                    agreed(&[other.t], &[turn.t]).min(most)
                }
                _ => 0.0,
            };
            let least = found.iter().map(digits).reduce(f64::min);
            (turn, least)
        };
        best.into_iter().enumerate().map(with_agreement).collect()
    }

    /// Where all digits are the same, there are no more than the runs have.
    fn most(&self) -> f64 {
        self.runs.iter().map(|run| run.precision().digits as f64).fold(f64::INFINITY, f64::min)
    }

    /// The runs.
    pub fn runs(&self) -> &[Box<dyn LongRun>] {
        &self.runs
    }

    /// Rows that all runs have up to the stop which [`DigitsPair::go`] has told of, that of their last states
    /// among them.
    pub fn up_to_stop(&mut self) -> Vec<(ShownRow, Option<f64>)> {
        std::mem::take(&mut self.stopped)
    }

    /// The next rows, each run on a thread of its own.
    ///
    /// # Errors
    /// A run stops; see [`DigitsPair::up_to_stop`].
    pub fn go(&mut self, pause: &(dyn Fn() -> bool + Sync)) -> Result<PairProgress, StepError> {
        let first = self.next;
        if first > self.last_row() {
            return Ok(PairProgress::Over);
        }
        let last = self.last_row().min(first + self.rows - 1);
        let begin = Instant::now();
        let gather = |run: &mut Box<dyn LongRun>| Gathered::from(&mut **run, first..=last, pause);
        let found: Vec<_> = match &mut self.runs[..] {
            [only] => vec![gather(only)],
            runs => std::thread::scope(|scope| {
                let threads: Vec<_> = runs.iter_mut().map(|run| scope.spawn(|| gather(run))).collect();
                threads.into_iter().filter_map(|thread| thread.join().ok()).collect()
            }),
        };
        if let Some(stop) = found.iter().find_map(|gathered| gathered.stop.clone()) {
            let mut rows: Vec<Vec<ShownRow>> = found.into_iter().map(|gathered| gathered.rows).collect();
            let common = rows.iter().map(Vec::len).min().unwrap_or(0);
            rows.iter_mut().for_each(|rows| rows.truncate(common));
            self.stopped = self.with_agreement(rows);
            return Err(stop);
        }
        if !found.iter().all(|gathered| gathered.is_through) {
            // Runs that have come to rows of which others are not through do them again; those on their way
            // to the first one go on from there.
            let mut saved = std::mem::take(&mut self.saved);
            for ((run, saved), gathered) in self.runs.iter().zip(&mut saved).zip(&found) {
                if gathered.rows.is_empty() {
                    *saved = run.save();
                }
            }
            self.resume(&saved, first);
            return Ok(PairProgress::Paused);
        }
        let found: Vec<Vec<ShownRow>> = found.into_iter().map(|gathered| gathered.rows).collect();
        self.saved = self.runs.iter().map(|run| run.save()).collect();
        self.next = self.last_row().min(last) + 1;
        let spent = begin.elapsed();
        self.rows = if spent < LONGEST / 4 {
            2 * self.rows
        } else if spent > LONGEST {
            self.rows / 2
        } else {
            self.rows
        };
        self.rows = self.rows.clamp(1, MOST);
        Ok(PairProgress::Rows(self.with_agreement(found)))
    }

    /// The rows of the run with the most digits, with the digits to which all agree.
    fn with_agreement(&self, mut found: Vec<Vec<ShownRow>>) -> Vec<(ShownRow, Option<f64>)> {
        let best = found.pop().unwrap_or_default();
        let most = self.most();
        let with_agreement = |(i, row): (usize, ShownRow)| {
            let least =
                |other: &Vec<ShownRow>| other.get(i).map_or(0.0, |other| agreement(other, &row).min(most));
            let least = found.iter().map(least).reduce(f64::min);
            (row, least)
        };
        best.into_iter().enumerate().map(with_agreement).collect()
    }
}

/// What one run has gathered.
struct Gathered {
    rows: Vec<ShownRow>,
    /// False where it paused or stopped.
    is_through: bool,
    stop: Option<StepError>,
}

impl Gathered {
    /// These rows of a run, up to a pause or a stop; of a stop the row of the state before it is the last
    /// one.
    fn from(run: &mut dyn LongRun, numbers: RangeInclusive<u64>, pause: &(dyn Fn() -> bool + Sync)) -> Self {
        let (mut rows, mut stop) = (Vec::new(), None);
        for number in numbers {
            // An event may end the run on the way.
            if number > run.last_row() {
                break;
            }
            match run.row(number, &mut || pause()) {
                Ok(Some(row)) => rows.push(row),
                Ok(None) => return Self { rows, is_through: false, stop },
                Err(error) => {
                    rows.extend(run.stopped());
                    stop = Some(error);
                    break;
                }
            }
        }
        Self { rows, is_through: stop.is_none(), stop }
    }
}

/// Decimal digits to which two rows agree, in angles, rates, positions and velocities: counted from the point
/// where these are below one.
fn agreement(a: &ShownRow, b: &ShownRow) -> f64 {
    agreed(a.bodies.as_flattened(), b.bodies.as_flattened())
}

/// Decimal digits to which numbers agree.
fn agreed(a: &[Wide], b: &[Wide]) -> f64 {
    let apart = a.iter().zip(b).map(|(&a, &b)| (a - b).log2() - b.abs().log2().max(0.0));
    -apart.fold(f64::NEG_INFINITY, larger) / std::f64::consts::LOG2_10
}
