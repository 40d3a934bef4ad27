//! What a run in many digits needs to go on, to the last bit.

use super::events::Happened;
use super::friction::{Turn, mode_from_words, mode_to_words};
use super::motion::LongState;
use super::resting::Hold;
use super::{LongRun, Precision, Runner};
use crate::arithmetic::digits::Digits;
use crate::dynamics::compile::exact::Acting;
use serde::{Deserialize, Serialize};

/// Where a run in many digits is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SavedDigits {
    precision: Precision,
    words: Vec<Vec<u64>>,
    steps: u64,
    impacts: u64,
    radius: Option<f64>,
    /// Events with the numbers of each, and the sides of zero their formulas are on.
    happened: Vec<(usize, Vec<Vec<u64>>)>,
    sides: Vec<i8>,
    due: Vec<(usize, bool)>,
    /// Parameters, branches and parts that rest.
    parameters: Vec<Vec<u64>>,
    modes: Vec<bool>,
    off: Vec<String>,
    shifts: Vec<Vec<u64>>,
    /// Walls that hold a point, and all holds.
    held: Vec<usize>,
    holds: Vec<(usize, Vec<Vec<u64>>)>,
    /// What places with friction do, whether that is known, and their transitions.
    sliding: Vec<(u8, f64, Vec<u64>)>,
    is_decided: bool,
    turns: Vec<(usize, usize, Vec<u64>)>,
}

impl SavedDigits {
    /// Digits and order of the run it is of.
    pub fn precision(&self) -> Precision {
        self.precision
    }
}

/// Numbers that were saved.
fn numbers_of<const W: usize>(words: &[Vec<u64>]) -> Option<Vec<Digits<W>>> {
    words.iter().map(|words| Digits::from_words(words)).collect()
}

/// Where a run is.
pub(super) fn save<const W: usize>(run: &Runner<W>) -> SavedDigits {
    let LongState { t, u, rate, work, jump_energy, lost, acting, .. } = run.motion.state();
    let LongState { steps, impacts, radius, holds, turns, is_decided, .. } = run.motion.state();
    let numbers = [t, work, jump_energy, lost].into_iter().chain(u).chain(rate);
    let words = numbers.map(Digits::to_words).collect();
    let happened = run.motion.watch.happened.iter().map(|Happened { event, t, phi, omega }| {
        (*event, std::iter::once(t).chain(phi).chain(omega).map(Digits::to_words).collect())
    });
    SavedDigits {
        precision: run.precision(),
        words,
        steps: *steps,
        impacts: *impacts,
        radius: *radius,
        happened: happened.collect(),
        sides: run.motion.watch.sides.clone(),
        due: run.motion.watch.due.clone(),
        parameters: acting.parameters.iter().map(Digits::to_words).collect(),
        modes: acting.modes.clone(),
        off: acting.off.clone(),
        shifts: acting.shifts.iter().map(Digits::to_words).collect(),
        held: acting.held.clone(),
        holds: holds.iter().map(Hold::to_words).collect(),
        sliding: acting.sliding.iter().map(mode_to_words).collect(),
        is_decided: *is_decided,
        turns: turns.iter().map(Turn::saved).collect(),
    }
}

/// Goes on from where another run of the same scene was; false where it cannot have been one.
pub(super) fn resume<const W: usize>(run: &mut Runner<W>, saved: &SavedDigits) -> bool {
    let Some((state, happened)) = state_of(run, saved) else { return false };
    let is_known = run.motion.resume(state);
    let watch = &mut run.motion.watch;
    (watch.happened, watch.sides, watch.due) = (happened, saved.sides.clone(), saved.due.clone());
    is_known
}

fn state_of<const W: usize>(
    run: &Runner<W>,
    saved: &SavedDigits,
) -> Option<(LongState<W>, Vec<Happened<W>>)> {
    let n = run.motion.mechanism.structure.coordinates();
    let happened = |(event, words): &(usize, Vec<Vec<u64>>)| {
        let numbers = numbers_of(words).filter(|numbers| numbers.len() == 1 + 2 * n)?;
        let (phi, omega) = numbers[1..].split_at(n);
        let is_known = *event < run.motion.mechanism.events.len();
        is_known.then(|| Happened { event: *event, t: numbers[0], phi: phi.to_vec(), omega: omega.to_vec() })
    };
    let happened = saved.happened.iter().map(happened).collect::<Option<_>>()?;
    let numbers = numbers_of(&saved.words)?;
    let (&[t, work, jump_energy, lost], rest) = numbers.split_first_chunk::<4>()?;
    if rest.len() % 2 != 0
        || saved.precision != run.precision()
        || saved.sides.len() != run.motion.watch.sides.len()
        || saved.due.iter().any(|due| due.0 >= saved.sides.len())
    {
        return None;
    }
    let turns: Vec<Turn<W>> = saved.turns.iter().map(Turn::from_words).collect::<Option<_>>()?;
    let places = run.motion.mechanism.frictions.len();
    if turns.iter().any(|turn| turn.place >= places) {
        return None;
    }
    // While points stay on walls there are more coordinates: whether they fit is known of what acts.
    let (u, rate) = rest.split_at(rest.len() / 2);
    let state = LongState {
        t,
        u: u.to_vec(),
        rate: rate.to_vec(),
        work,
        jump_energy,
        lost,
        steps: saved.steps,
        impacts: saved.impacts,
        radius: saved.radius,
        acting: Acting {
            parameters: numbers_of(&saved.parameters)?,
            modes: saved.modes.clone(),
            off: saved.off.clone(),
            shifts: numbers_of(&saved.shifts)?,
            held: saved.held.clone(),
            sliding: saved.sliding.iter().map(mode_from_words).collect::<Option<_>>()?,
        },
        holds: saved.holds.iter().map(Hold::from_words).collect::<Option<_>>()?,
        turns,
        is_decided: saved.is_decided,
    };
    Some((state, happened))
}
