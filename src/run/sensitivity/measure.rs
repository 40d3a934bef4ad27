//! What is derived: outputs at a time, extremes over the run, times of flips, events and impacts.

use super::super::event::SwitchFunction;
use super::neighbours::Neighbour;
use super::variation::{Variation, plain};
use crate::dynamics::kernel::{Bias, Kernel};
use crate::dynamics::output::{Moment, OutputScratch, Outputs};
use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::saltation::{Delta, Side, event_value, late_at_zero};
use crate::scene::Output;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

/// A quantity of a run that is derived by numbers of its scene.
///
/// ```
/// use driftless::Measure;
/// let measure: Measure = "max:motor.torque".parse().expect("an extreme of an output");
/// assert_eq!((measure.to_string(), "flip".parse()), ("max:motor.torque".to_owned(), Ok(Measure::Flip)));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum Measure {
    /// An output at the time asked for: the name of one of the scene's, or a formula.
    Output(Output),
    /// The largest value of an output over the run.
    Max(Output),
    /// Its least value.
    Min(Output),
    /// The first time a bar turns over \[s\].
    Flip,
    /// The first time of an event of the scene \[s\].
    Event(String),
    /// The first impact at a wall \[s\].
    Impact(String),
}

impl FromStr for Measure {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let text = text.trim();
        Ok(match text.split_once(':') {
            Some(("max", rest)) => Self::Max(Output::parse(rest)),
            Some(("min", rest)) => Self::Min(Output::parse(rest)),
            Some(("event", rest)) => Self::Event(rest.trim().to_owned()),
            Some(("impact", rest)) => Self::Impact(rest.trim().to_owned()),
            _ if text == "flip" => Self::Flip,
            _ => Self::Output(Output::parse(text)),
        })
    }
}

impl fmt::Display for Measure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Output(output) => f.write_str(&output.name),
            Self::Max(output) => write!(f, "max:{}", output.name),
            Self::Min(output) => write!(f, "min:{}", output.name),
            Self::Flip => f.write_str("flip"),
            Self::Event(name) => write!(f, "event:{name}"),
            Self::Impact(name) => write!(f, "impact:{name}"),
        }
    }
}

impl Measure {
    /// The output it is of.
    pub fn output(&self) -> Option<&Output> {
        match self {
            Self::Output(output) | Self::Max(output) | Self::Min(output) => Some(output),
            _ => None,
        }
    }
}

/// Values of all outputs at a moment with their derivatives along every column.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::run) struct Derived {
    pub values: Vec<f64>,
    /// Output by output, then column by column.
    pub slopes: Vec<Vec<f64>>,
    /// Rates of change along the motion itself.
    pub rates: Vec<f64>,
}

/// Time before and after a moment, in the mechanism's unit, at which branches beside it are taken.
const BESIDE: f64 = 1e-6;

/// Shows the outputs of a mechanism a state; whole turns of a motion are added to the angles.
fn shown<R: Default>(
    mechanism: &Mechanism,
    kernel: &mut Kernel<f64>,
    motion: &Motion,
    (t, phi, omega): (Time, &[f64], &[f64]),
    what: impl FnOnce(&Outputs, &Moment) -> R,
) -> R {
    let Some(outputs) = &mechanism.outputs else { return R::default() };
    if outputs.needs_equations() {
        kernel.accelerations(mechanism, t, phi, omega, Bias::default());
    } else {
        kernel.place(mechanism, phi);
    }
    let turned = |k: usize| motion.unwrapped(k) - motion.phi[k].hi;
    let winding: Vec<f64> = (0..phi.len()).map(|k| phi[k] + turned(k)).collect();
    what(outputs, &Moment { mechanism, time: t, phi, winding: &winding, omega, kernel })
}

/// Outputs of a mechanism at a state, on these branches of their formulas; on those that hold there if none
/// are given.
pub(super) fn outputs_at(
    mechanism: &Mechanism,
    kernel: &mut Kernel<f64>,
    motion: &Motion,
    at: (Time, &[f64], &[f64]),
    branches: &[bool],
) -> Vec<f64> {
    shown(mechanism, kernel, motion, at, |outputs, moment| {
        let mut values = Vec::new();
        outputs.evaluate(moment, &mut OutputScratch::default(), branches, &mut values);
        values
    })
}

/// All outputs beside a variation at a motion.
pub(in crate::run) fn outputs(variation: &mut Variation, motion: &Motion) -> Derived {
    outputs_on(variation, motion, &[])
}

/// The same on the branches of their formulas that hold just before the motion, for a `sense` of -1, or just
/// after it, for 1: a formula may jump where a law does.
pub(super) fn outputs_beside(variation: &mut Variation, motion: &Motion, sense: f64) -> Derived {
    let mechanism = &variation.mechanism;
    let Side { acceleration, .. } = Side::new(mechanism, motion);
    let (t, phi, omega) = plain(&motion.later(sense * BESIDE * mechanism.units.time, &acceleration));
    let at = (t, &phi[..], &omega[..]);
    let branches = shown(mechanism, &mut Kernel::new(mechanism), motion, at, |outputs, moment| {
        outputs.branches(moment, &mut OutputScratch::default(), &[])
    });
    outputs_on(variation, motion, &branches)
}

fn outputs_on(variation: &mut Variation, motion: &Motion, branches: &[bool]) -> Derived {
    let mechanism = &variation.mechanism;
    if mechanism.outputs.is_none() {
        return Derived::default();
    }
    let side = Side::new(mechanism, motion);
    let at = (motion.time, &side.phi[..], &side.omega[..]);
    let mut kernel = Kernel::new(mechanism);
    let values = outputs_at(mechanism, &mut kernel, motion, at, branches);
    let mut along = |column: &[f64], late: f64| {
        let mut beside = |moved: &Motion| {
            let (t, phi, omega) = plain(moved);
            Some(outputs_at(mechanism, &mut kernel, motion, (t, &phi, &omega), branches))
        };
        side.slope(column, late, f64::INFINITY, &mut beside).unwrap_or_default()
    };
    let rates = along(&side.ahead(), 1.0);
    let mut slopes = vec![Vec::new(); values.len()];
    for (column, neighbours) in variation.columns.iter().zip(&mut variation.neighbours) {
        let mut sums = along(column, 0.0);
        let of = |neighbour: &mut Neighbour| {
            outputs_at(&neighbour.mechanism, &mut neighbour.kernel, motion, at, branches)
        };
        if let Some(moved) = neighbours.as_mut().and_then(|neighbours| neighbours.derivative(of)) {
            sums.iter_mut().zip(moved).for_each(|(sum, moved)| *sum += moved);
        }
        slopes.iter_mut().zip(sums).for_each(|(slopes, sum)| slopes.push(sum));
    }
    Derived { values, slopes, rates }
}

/// How the time moves at which body `bar` turns over.
pub(super) fn flip_slopes(variation: &Variation, motion: &Motion, bar: usize) -> Vec<f64> {
    variation.columns.iter().map(|column| -column[bar] / motion.omega[bar].hi).collect()
}

/// Share of the time of a run within which an impact happens just then.
const AT_ONCE: f64 = 1e-12;

/// How the time of an impact moves that is about to happen at a motion, if one is.
pub(super) fn impact_slopes(variation: &Variation, motion: &Motion) -> Option<Vec<f64>> {
    let (mechanism, side) = (&variation.mechanism, Side::resting(&variation.mechanism, motion));
    let z = mechanism.elements(&side.phi);
    let mut gradient = vec![0.0; side.phi.len()];
    let mut rate = 0.0;
    let contact = (0..mechanism.contacts.len()).find(|&k| {
        let contact = &mechanism.contacts[k];
        if contact.is_off || mechanism.held.contains(&k) {
            return false;
        }
        gradient.fill(0.0);
        rate = side.gap_rate(mechanism, k, &mut gradient);
        let gap = contact.distance(motion.time, &side.phi, &z);
        rate < 0.0 && gap.abs() <= -rate * AT_ONCE * motion.time.hi
    })?;
    let late = |(column, neighbours): (&Vec<f64>, &Option<super::Neighbours>)| {
        let neighbours = neighbours.as_ref().map_or_else(Vec::new, super::Neighbours::weighted);
        let delta = Delta { entries: &mut column.clone(), neighbours };
        side.late(mechanism, contact, (&gradient, rate), &delta)
    };
    Some(variation.columns.iter().zip(&variation.neighbours).map(late).collect())
}

/// How the time of an event of the scene moves.
pub(super) fn event_slopes(variation: &Variation, motion: &Motion, event: usize) -> Option<Vec<f64>> {
    let side = Side::new(&variation.mechanism, motion);
    let mut entries = variation.columns.clone();
    let column = |(entries, neighbours): (_, &Option<super::Neighbours>)| {
        let neighbours = neighbours.as_ref().map_or_else(Vec::new, super::Neighbours::weighted);
        Delta { entries, neighbours }
    };
    let entries = entries.iter_mut().map(Vec::as_mut_slice);
    let columns: Vec<Delta> = entries.zip(&variation.neighbours).map(column).collect();
    let value = |mechanism: &Arc<Mechanism>, motion: &Motion| {
        Some(vec![event_value(mechanism, SwitchFunction::Event(event), motion)?])
    };
    late_at_zero(&variation.mechanism, &side, &columns, &value).ok()
}
