//! One cell of the matrix: a scene by a method at settings that are refined until its end is confirmed.

use super::{Case, Expected, StressCell};
use crate::arithmetic::sum::larger;
use crate::dynamics::Mechanism;
use crate::run::methods::MethodId;
use crate::run::plan::{Plan, Request};
use crate::run::running::{Outcome, Run, integrate};
use crate::run::trust::{DistanceMetric, How, Level};
use crate::run::{Limits, Sample};
use crate::scene::Scene;
use crate::stepping::{Cause, StepError, Tolerance};
use std::sync::Arc;

/// How often a setting is refined.
const REFINEMENTS: u32 = 3;
/// By how much, of a tolerance and of a step.
const FINER: (f64, f64) = (1e-2, 0.5);
/// Steps of the power series up to which an end is looked for in double-double.
pub(super) const EXPANSIONS: u64 = 20_000;
/// Share of the tolerance below which a run's own estimate is enough.
const SURE: f64 = 1e-3;
/// The error of the finer of two runs over their difference, at most: methods of higher order leave less,
/// steps across a corner of the force as much.
const MARGIN: f64 = 3.0;
/// Least tolerance of a refinement.
const LEAST: f64 = 1e-13;

/// A cell under way.
pub(super) struct Trial<'a> {
    pub(super) case: &'a Case,
    pub(super) scene: &'a Scene,
    pub(super) mechanism: &'a Arc<Mechanism>,
    pub(super) method: MethodId,
    pub(super) max_evaluations: u64,
}

/// Coordinates and rates at the end of a run, as [`DistanceMetric`] measures them.
#[derive(Clone, Debug)]
pub(super) struct TrialEnd {
    /// When it ended \[s\].
    pub(super) t: f64,
    pub(super) coordinates: Vec<f64>,
    pub(super) rates: Vec<f64>,
}

impl TrialEnd {
    pub(super) fn of(sample: &Sample, metric: &DistanceMetric) -> Self {
        let measured = |values: &[f64]| metric.measured(values.iter().copied()).collect();
        Self { t: sample.t, coordinates: measured(&sample.phi), rates: measured(&sample.omega) }
    }

    /// What is known of it, of the last bodies' angles alone where no more is expected.
    fn known(self, bodies: usize, expected: &Expected) -> Self {
        let Expected::End { angles, rates } = expected else { return self };
        let last = |values: &[f64], count: usize| values[bodies - count..bodies].to_vec();
        let [coordinates, rates] = [last(&self.coordinates, angles.len()), last(&self.rates, rates.len())];
        Self { coordinates, rates, ..self }
    }

    /// The largest difference; rates count over 1 rad/s or themselves, and not at all where `other` has none,
    /// and times by what the fastest coordinate changes by between them.
    pub(super) fn apart(&self, other: &Self) -> f64 {
        let fastest = other.rates.iter().fold(1.0, |most, rate| larger(most, rate.abs()));
        let late = fastest * (self.t - other.t).abs();
        let coordinates = self.coordinates.iter().zip(&other.coordinates).map(|(a, b)| (a - b).abs());
        let rates = self.rates.iter().zip(&other.rates).map(|(a, b)| (a - b).abs() / b.abs().max(1.0));
        coordinates.chain(rates).fold(late, larger)
    }
}

impl Trial<'_> {
    /// Runs it until its end is confirmed, or is not to be had.
    pub(super) fn run(&self, cell: &mut StressCell) -> Result<(), String> {
        let mut before: Option<TrialEnd> = None;
        for refinement in 0..=REFINEMENTS {
            let request = self.request(refinement, cell)?;
            let plan =
                Plan::new(self.scene, self.mechanism, &request).map_err(|refusal| refusal.to_string())?;
            cell.setting = Some(setting(&plan));
            let start = self.mechanism.start(self.scene);
            cell.runs += 1;
            let outcome = match Run::new(Arc::clone(self.mechanism), plan, Limits::default(), &start) {
                Ok(run) => integrate(run.trusted(Level::Auto, &start), &mut |_| Ok(()))
                    .map_err(|error| error.to_string())?,
                Err(stop) => {
                    cell.stop = Some(stop);
                    return Ok(());
                }
            };
            cell.evaluations += outcome.statistics.evaluations;
            cell.energy = Some(outcome.drift.energy.max);
            cell.stop = outcome.stop.clone();
            if let Some(stop) = &outcome.stop {
                // A finer setting may mend what is no matter of effort.
                if matches!(
                    stop.cause,
                    Cause::NotConverged | Cause::ProjectionFailed | Cause::DriftLimit | Cause::BranchLost
                ) && self.is_left(cell)
                {
                    before = None;
                    continue;
                }
                return Ok(());
            }
            let end = self.end(&outcome);
            self.score(&outcome, &end, cell);
            // What a run knows it knows the better the smoother its motion is: where that is not far below
            // what is asked for, a finer run decides too.
            let at = if outcome.ended_by.is_some() { end.t } else { self.scene.until };
            let known =
                outcome.trust.as_ref().filter(|trust| trust.how == How::ReferenceSolution && trust.at >= at);
            let fastest = end.rates.iter().fold(1.0, |most, rate| larger(most, rate.abs()));
            let known = known.and_then(|trust| {
                let rates = if end.rates.is_empty() { 0.0 } else { trust.rate_error? / fastest };
                Some(larger(trust.error_estimate?, rates))
            });
            let finer = before.as_ref().map(|before| MARGIN * end.apart(before));
            cell.estimate = match (known, finer) {
                (Some(known), None) if known > SURE * self.case.tolerance => None,
                (Some(known), finer) => Some(finer.map_or(known, |finer| finer.max(known))),
                (None, finer) => finer,
            };
            let is_no_matter_of_ends = matches!(self.case.expected, Expected::Energy | Expected::Stop(_));
            if is_no_matter_of_ends || cell.estimate.is_some_and(|estimate| estimate <= self.case.tolerance) {
                return Ok(());
            }
            before = Some(end);
            if !self.is_left(cell) {
                break;
            }
        }
        if cell.stop.is_none() {
            cell.stop = Some(self.unconfirmed(cell));
        }
        Ok(())
    }

    /// True while there is effort for another run.
    fn is_left(&self, cell: &StressCell) -> bool {
        cell.evaluations < self.max_evaluations
    }

    /// The request of a refinement.
    fn request(&self, refinement: u32, cell: &StressCell) -> Result<Request, String> {
        let horizon = self.scene.until;
        let max_evaluations = Some(self.max_evaluations.saturating_sub(cell.evaluations).max(1));
        let request = Request {
            method: Some(self.method),
            every: Some(horizon / 100.0),
            max_evaluations,
            ..Request::default()
        };
        if self.method.is_adaptive() {
            let tolerance = (Tolerance::default().relative * FINER.0.powi(refinement as i32)).max(LEAST);
            return Ok(Request { rtol: Some(tolerance), ..request });
        }
        let usual = Plan::new(self.scene, self.mechanism, &request).map_err(|refusal| refusal.to_string())?;
        let step = usual.step.map(|step| step * FINER.1.powi(refinement as i32));
        Ok(Request { step, ..request })
    }

    fn end(&self, outcome: &Outcome) -> TrialEnd {
        let end = TrialEnd::of(&outcome.last, &DistanceMetric::new(self.mechanism));
        end.known(outcome.last.centre.len(), &self.case.expected)
    }

    /// What the end is off, where that is known.
    fn score(&self, outcome: &Outcome, end: &TrialEnd, cell: &mut StressCell) {
        let known = |t: f64, coordinates: &[f64], rates: &[f64]| {
            end.apart(&TrialEnd { t, coordinates: coordinates.to_vec(), rates: rates.to_vec() })
        };
        cell.error = match &self.case.expected {
            Expected::End { angles, rates } => Some(known(self.scene.until, angles, rates)),
            Expected::Motion { t, coordinates, rates } => Some(known(*t, coordinates, rates)),
            Expected::Energy | Expected::Stop(_) => Some(outcome.drift.energy.max),
            Expected::Refusal | Expected::Unknown => None,
        };
    }

    /// The stop of a run whose end nothing confirms.
    fn unconfirmed(&self, cell: &StressCell) -> StepError {
        let off = cell.estimate.map_or("unknown".to_owned(), |estimate| format!("about {estimate:.1e}"));
        StepError {
            cause: Cause::DriftLimit,
            method: cell.method.to_owned(),
            t: self.scene.until,
            step: 0.0,
            what: format!("the error of the end is {off}, and {:.0e} was asked for", self.case.tolerance),
            hint: "allow more with --max-evaluations, or take a method of higher order".into(),
        }
    }
}

/// A setting in words of the command line.
fn setting(plan: &Plan) -> String {
    match (plan.step, plan.tolerance) {
        (Some(step), _) => format!("--step {step:e}"),
        (None, tolerance) => format!("--rtol {:e}", tolerance.unwrap_or_default().relative),
    }
}
