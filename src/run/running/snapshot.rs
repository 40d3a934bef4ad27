//! What a run that pauses leaves, and a later one goes on from.

use super::super::contact::{ContactDriver, ContactDriverState};
use super::super::custom::Custom;
use super::super::drift::Limits;
use super::super::event::EventMark;
use super::super::plan::{MORE_IS_ALLOWED, Plan};
use super::super::sample::Sample;
use super::super::trust::{ErrorEstimator, SavedEstimator};
use super::{Outcome, Running};
use crate::dynamics::{Mechanism, Motion};
use crate::stepping::StepError;

/// All that the rest of a run depends on, beside its mechanism: what a checkpoint holds.
///
/// Some of its numbers may be infinite, or not numbers, where the error is estimated: a format that keeps
/// these is needed, as postcard.  JSON has none, and what `serde_json` writes of them is not read back.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Snapshot {
    pub(super) limits: Limits,
    pub(super) contact_state: ContactDriverState,
    pub(super) outcome: Outcome,
    pub(super) row: u64,
    pub(super) resting: Option<StepError>,
    /// The horizon on the way to which the station was reached \[s\].
    pub(super) horizon: f64,
    pub(super) error_estimator: Option<SavedEstimator>,
    /// That of its mechanism at the last output time.
    pub(super) fingerprint: u64,
    /// Its events from outside there.
    pub(super) events: Vec<EventMark>,
}

/// Why a run cannot go on from a snapshot.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ResumeError {
    /// It is one of another mechanism, or not sound.
    #[error("the snapshot does not fit the scene")]
    Misfit,
    /// It looked for other events from outside.
    #[error("the snapshot does not fit its events: {0}")]
    OtherEvents(String),
    /// The method cannot begin there.
    #[error("{0}")]
    Step(#[from] StepError),
}

/// The motion of a sample, as far as the sample has it; `None` before the first.
pub(super) fn moment(sample: &Sample) -> Option<Motion> {
    (!sample.phi.is_empty()).then(|| Motion::of_doubles(sample.t, [&sample.phi, &sample.omega]))
}

impl Running {
    /// All that the rest of the run depends on.
    pub fn snapshot(&self) -> Snapshot {
        let moment = moment(&self.outcome.last).unwrap_or_else(|| self.start.clone());
        let (fingerprint, events) = (self.compiled.fingerprint(&moment), self.marks(&moment));
        Snapshot {
            fingerprint,
            events,
            limits: self.limits,
            contact_state: self.contact_driver.contact_state(),
            outcome: self.outcome.clone(),
            row: self.row,
            resting: self.resting.clone(),
            horizon: self.outcome.plan.until,
            error_estimator: self.error_estimator.as_ref().map(ErrorEstimator::kept),
        }
    }
}

impl Snapshot {
    /// The plan as it is carried out.
    pub fn plan(&self) -> &Plan {
        &self.outcome.plan
    }

    /// The last output time reached \[s\].
    pub fn time(&self) -> f64 {
        self.outcome.last.t
    }

    /// Goes on by an integrator from outside, which snapshots in files do not hold.
    pub fn integrated_by(&mut self, integrator: Custom) {
        self.outcome.plan.integrator = Some(integrator);
    }

    /// Bounds the evaluations of the whole run anew, those made so far counted in.
    pub fn allow(&mut self, max_evaluations: u64) {
        let plan = &mut self.outcome.plan;
        plan.max_evaluations = max_evaluations;
        plan.notes.retain(|note| !note.ends_with(MORE_IS_ALLOWED));
        if let Some(error_estimator) = &mut self.error_estimator {
            error_estimator.allow();
        }
    }

    /// The same on the way to a later horizon \[s\]; false, and nothing changed, where that is not later or
    /// would write too many rows.
    ///
    /// What follows is what a run to that horizon would have come to, but for the slopes of its drift:
    /// monitors divide the horizon into intervals, and those seen before are taken over as they are.  A dense
    /// method that had already cut a step to fit the former horizon keeps that step.
    pub fn extend(&mut self, until: f64) -> bool {
        let is_possible = until > self.outcome.plan.until && self.outcome.plan.extend(until);
        if is_possible {
            self.outcome.drift.extend(until);
            if let Some(error_estimator) = &mut self.error_estimator {
                error_estimator.extend(until);
            }
        }
        is_possible
    }

    /// Whether its parts go together, and with a mechanism.
    pub(super) fn fits(&self, mechanism: &Mechanism, start: &Motion) -> bool {
        let Outcome { plan, last, drift, trace, holds, .. } = &self.outcome;
        let (n, bars, rows) = (mechanism.coordinates(), mechanism.bodies.len(), mechanism.constraints.len());
        let sizes = |sample: &Sample| {
            (sample.phi.len(), sample.omega.len(), sample.constraints.len(), sample.motors.len())
                == (n, n, rows, rows)
        };
        let whole =
            |sample: &Sample| sizes(sample) && (sample.centre.len(), sample.velocity.len()) == (bars, bars);
        plan.is_sound()
            && self.row <= plan.rows
            && self.horizon <= plan.until
            && ((self.row == 0 && last.phi.is_empty()) || whole(last))
            && trace.samples().all(sizes)
            && drift.fits(mechanism)
            && self.error_estimator.as_ref().is_none_or(SavedEstimator::is_sound)
            && ContactDriver::names_holds(&self.contact_state) <= holds.len()
            && start.phi.len() == n
            && mechanism.fingerprint(&moment(last).unwrap_or_else(|| start.clone())) == self.fingerprint
    }
}
