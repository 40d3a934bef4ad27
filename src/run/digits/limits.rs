//! Limits on the drift of a run in many digits, those of all runs.

use super::ShownRow;
use crate::dynamics::Mechanism;
use crate::run::Limits;
use crate::run::drift::{ENERGY_MOST, kind, units};
use crate::stepping::{Cause, StepError};

/// The stop where a row exceeds a limit; `largest` is the largest energy or work up to it \[J\].
///
/// Where no limit on the energy is stated it is that of runs whose tolerance explains nothing: digits that
/// singular positions cost are no fault.
pub fn exceeded(row: &ShownRow, mechanism: &Mechanism, limits: &Limits, largest: f64) -> Option<StepError> {
    let off = row.drift.abs();
    let share = off * (mechanism.energy_scale / largest.max(mechanism.energy_scale));
    let units = units(mechanism);
    let rows = mechanism.constraints.iter().zip(&row.residuals).zip(&units);
    let constraints = rows.map(|((equation, &left), &unit)| (equation.name(), left, unit));
    let what = limits.exceeded((kind(mechanism), [share, off], ENERGY_MOST), constraints).err()?;
    Some(StepError {
        cause: Cause::DriftLimit,
        method: "taylor".into(),
        t: row.time(),
        step: 0.0,
        what,
        hint: "carry more digits, or state another limit with --max-energy-drift or --max-constraint-drift"
            .into(),
    })
}
