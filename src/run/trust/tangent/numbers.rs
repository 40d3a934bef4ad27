//! Parameters that events set: neighbouring motions, which are elsewhere at an event, may be given other
//! values there, and go on with these.
//!
//! ```text
//! w_m' = (w_m)_q dq + (w_m)_w dw + (w_m)_p dp      powers m of the rates; the last part from series at p ± e
//! ```
//!
//! A column has the differences of all parameters that events set behind its rates.

use super::beside::{self, ColumnsBeside};
use super::{Path, TangentFlow};
use crate::dynamics::{Coordinates, Mechanism, State};
use crate::run::saltation::{DistanceLevel, Levels, Weighted};
use std::sync::Arc;

/// Difference of a parameter over its size.
const DIFFERENCE: f64 = 1e-4;
/// Why there is no flow.
const NO_LAWS: &str = "laws cannot go on with neighbouring values";

/// A mechanism with a parameter above and below its value, and half the difference.
fn on_both_sides(mechanism: &Mechanism, number: usize) -> Option<(f64, [Arc<Mechanism>; 2])> {
    let known = &mechanism.laws.as_ref()?.parameters;
    let value = known[number];
    let half = DIFFERENCE * if value == 0.0 { 1.0 } else { value.abs() };
    let side = |sign: f64| {
        let mut parameters = known.clone();
        parameters[number] = value + sign * half;
        mechanism.with_parameters(parameters).ok().map(Arc::new)
    };
    Some((half, [side(1.0)?, side(-1.0)?]))
}

/// These with their weights, where a column has a parameter so far from its value.
fn weighted(change: f64, half: f64, sides: [&Arc<Mechanism>; 2]) -> [Weighted; 2] {
    let weight = change / (2.0 * half);
    [(weight, Arc::clone(sides[0])), (-weight, Arc::clone(sides[1]))]
}

/// The one distance at which estimates have neighbours, where there are any.
fn level(list: Vec<Weighted>) -> Levels {
    if list.is_empty() { Levels::new() } else { vec![DistanceLevel { far: 1.0 / DIFFERENCE, list }] }
}

/// What a parameter does to the powers of the rates.
pub(super) struct ParameterPowers {
    /// Its place among those that events set.
    place: usize,
    /// The mechanism at neighbouring values on both sides, and half the difference between these.
    sides: [(Arc<Mechanism>, Box<dyn ColumnsBeside>); 2],
    half: f64,
    powers: Vec<f64>,
}

impl ParameterPowers {
    fn new(
        mechanism: &Mechanism,
        coordinates: Coordinates,
        order: usize,
        [place, number]: [usize; 2],
    ) -> Option<Self> {
        let (half, sides) = on_both_sides(mechanism, number)?;
        let [ahead, behind] = sides.map(|mechanism| {
            let (_, series) = beside::room(&mechanism, coordinates, order, 1).pop()?;
            Some((mechanism, series))
        });
        Some(Self { place, sides: [ahead?, behind?], half, powers: Vec::new() })
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
pub(super) struct ParameterEffects<'a> {
    parameters: &'a [ParameterPowers],
    columns: Vec<&'a [f64]>,
}

impl<'a> ParameterEffects<'a> {
    /// Of these parameters, at a state.
    pub(super) fn at(parameters: &'a mut [ParameterPowers], path: &'a Path, unknowns: usize) -> Self {
        parameters.iter_mut().for_each(|parameter| parameter.expand(&path.state));
        let columns = path.columns.iter().chain(&path.inputs).map(|column| &column[unknowns..]).collect();
        Self { parameters, columns }
    }

    /// Adds it to the series of so many columns from `first` on.
    pub(super) fn add(&self, first: usize, count: usize, series: &mut dyn ColumnsBeside) {
        for parameter in self.parameters {
            let own = &self.columns[first..first + count];
            let shares: Vec<f64> = own.iter().map(|column| column[parameter.place]).collect();
            series.add(&parameter.powers, &shares);
        }
    }
}

impl TangentFlow {
    /// The mechanisms with the parameters of a column whose parameters are so far from their values.
    pub(super) fn neighbours(&self, given: &[f64]) -> Levels {
        let acting = self.parameters.iter().filter(|parameter| given[parameter.place] != 0.0);
        let of = |parameter: &ParameterPowers| {
            let [ahead, behind] = &parameter.sides;
            weighted(given[parameter.place], parameter.half, [&ahead.0, &behind.0])
        };
        level(acting.flat_map(of).collect())
    }

    /// The same beside another mechanism.
    ///
    /// # Errors
    /// There are no laws with such values.
    pub(super) fn neighbours_at(&self, mechanism: &Mechanism, given: &[f64]) -> Result<Levels, String> {
        let mut found = Vec::new();
        for (&number, &change) in self.set.iter().zip(given).filter(|(_, change)| **change != 0.0) {
            let (half, sides) = on_both_sides(mechanism, number).ok_or(NO_LAWS)?;
            found.extend(weighted(change, half, sides.each_ref()));
        }
        Ok(level(found))
    }

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
                ParameterPowers::new(&self.mechanism, self.coordinates, self.path.order, [place, number]);
            self.parameters.push(parameter.ok_or(NO_LAWS)?);
        }
        Ok(())
    }
}
