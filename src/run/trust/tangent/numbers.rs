//! Parameters that events set: neighbouring motions, which are elsewhere at an event, may be given other
//! values there, and go on with these.
//!
//! ```text
//! dp⁺ = dP(dt, dq, dw, dp)                    P  what an event sets, dt later
//! w_m' = (w_m)_q dq + (w_m)_w dw + (w_m)_p dp      powers m of the rates; the last part from series at p ± e
//! ```
//!
//! A column has the differences of all parameters that events set behind its rates.

use super::beside::{self, Beside};
use super::impact::Side;
use super::{Path, Tangent};
use crate::dynamics::{Coordinates, Mechanism, Motion, State};
use crate::run::contact::Switch;
use crate::run::event::SwitchFunction;

/// Difference of a parameter over its size.
const DIFFERENCE: f64 = 1e-4;

/// The parameters that events of a mechanism set, by number.
pub(super) fn set_by_events(mechanism: &Mechanism) -> Vec<usize> {
    let events = mechanism.laws.iter().flat_map(|laws| &laws.formulas.events);
    let mut set: Vec<usize> = events.flat_map(|event| event.parameters()).collect();
    set.sort_unstable();
    set.dedup();
    set
}

/// Parameters that are so far from their values, those that events set.
pub(super) fn moved(parameters: &[f64], set: &[usize], given: &[f64]) -> Vec<f64> {
    let mut moved = parameters.to_vec();
    set.iter().zip(given).for_each(|(&number, change)| moved[number] += change);
    moved
}

/// What an event, at a motion and so much later \[s\], sets otherwise along a column.
pub(super) fn set_at(
    mechanism: &Mechanism,
    set: &[usize],
    (switch, motion): (&Switch, &Motion),
    (here, late): (&Side, f64),
    column: &mut [f64],
) -> Result<(), String> {
    let sets = |event: usize| {
        let events = mechanism.laws.as_ref().map(|laws| &laws.formulas.events);
        events.is_some_and(|events| events[event].parameters().next().is_some())
    };
    let number = match switch.at {
        SwitchFunction::Event(number) if sets(number) => number,
        _ if switch.keeps_parameters => return Ok(()),
        _ => return Err("an event from outside sets parameters, which is not followed".into()),
    };
    let value = |motion: &Motion, given: &[f64]| {
        let laws = mechanism.laws.as_ref()?;
        let parameters = moved(&laws.parameters, set, given);
        let after = mechanism.seen(motion, |at| laws.formulas.set_by(number, at, &parameters));
        Some(set.iter().map(|&number| after[number]).collect())
    };
    let slopes =
        here.slope(motion, column, late, &value).ok_or("what an event sets is not known to the scene")?;
    let drives = mechanism.laws.as_ref().is_some_and(|laws| laws.formulas.drives());
    if drives && slopes.iter().any(|slope| *slope != 0.0) {
        return Err(
            "an event sets a parameter beside formulas of motors or walls, which neighbouring motions set otherwise"
                .into(),
        );
    }
    column[2 * here.phi.len()..].copy_from_slice(&slopes);
    Ok(())
}

/// What a parameter does to the powers of the rates.
pub(super) struct Parameter {
    /// Its place among those that events set.
    place: usize,
    /// The mechanism at neighbouring values on both sides, and half the difference between these.
    sides: [(Mechanism, Box<dyn Beside>); 2],
    half: f64,
    powers: Vec<f64>,
}

impl Parameter {
    fn new(
        mechanism: &Mechanism,
        coordinates: Coordinates,
        order: usize,
        [place, number]: [usize; 2],
    ) -> Option<Self> {
        let known = &mechanism.laws.as_ref()?.parameters;
        let value = known[number];
        let half = DIFFERENCE * if value == 0.0 { 1.0 } else { value.abs() };
        let side = |sign: f64| {
            let mut parameters = known.clone();
            parameters[number] = value + sign * half;
            let mechanism = mechanism.with_parameters(parameters).ok()?;
            let (_, series) = beside::room(&mechanism, coordinates, order, 1).pop()?;
            Some((mechanism, series))
        };
        Some(Self { place, sides: [side(1.0)?, side(-1.0)?], half, powers: Vec::new() })
    }

    /// Expands the motion from a state.
    fn expand(&mut self, state: &State) {
        let [ahead, behind] = self.sides.each_mut().map(|(mechanism, series)| {
            series.expand(mechanism, state, &[]);
            series.powers()
        });
        self.powers.clear();
        self.powers
            .extend(ahead.iter().zip(behind).map(|(ahead, behind)| (ahead - behind) / (2.0 * self.half)));
    }
}

/// What parameters do at a state, for columns in their order.
pub(super) struct Push<'a> {
    parameters: &'a [Parameter],
    columns: Vec<&'a [f64]>,
}

impl<'a> Push<'a> {
    /// Of these parameters, at a state.
    pub(super) fn at(parameters: &'a mut [Parameter], path: &'a Path, unknowns: usize) -> Self {
        parameters.iter_mut().for_each(|parameter| parameter.expand(&path.state));
        let columns = path.columns.iter().chain(&path.inputs).map(|column| &column[unknowns..]).collect();
        Self { parameters, columns }
    }

    /// Adds it to the series of so many columns from `first` on.
    pub(super) fn add(&self, first: usize, count: usize, series: &mut dyn Beside) {
        for parameter in self.parameters {
            let own = &self.columns[first..first + count];
            let shares: Vec<f64> = own.iter().map(|column| column[parameter.place]).collect();
            series.add(&parameter.powers, &shares);
        }
    }
}

impl Tangent {
    /// Takes up the parameters in which neighbours differ.
    ///
    /// # Errors
    /// Why neighbours cannot go on with other values.
    pub(super) fn take_parameters(&mut self) -> Result<(), String> {
        let unknowns = 2 * self.weights.len();
        self.parameters.clear();
        for (place, &number) in self.set.iter().enumerate() {
            let mut columns = self.path.columns.iter().chain(&self.path.inputs);
            if columns.all(|column| column[unknowns + place] == 0.0) {
                continue;
            }
            let parameter =
                Parameter::new(&self.mechanism, self.coordinates, self.path.order, [place, number]);
            self.parameters.push(parameter.ok_or("laws cannot go on with neighbouring values")?);
        }
        Ok(())
    }
}
