//! How a run ended, or how it stands.

use super::super::contact::{ImpactRecord, PersistentContact};
use super::super::drift::Drift;
use super::super::event::EventRecord;
use super::super::extremes::Extremes;
use super::super::flip::Flip;
use super::super::friction::FrictionRecord;
use super::super::plan::{Plan, RequestRefusal};
use super::super::sample::Sample;
use super::super::trace::Trace;
use super::super::trust::Trust;
use crate::dynamics::{CompileError, Mechanism};
use crate::stepping::{Statistics, StepError};
use std::time::Duration;

/// How a run ended, or how it stands.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Outcome {
    /// The plan as carried out.
    pub plan: Plan,
    /// The last sample.
    pub last: Sample,
    /// Counts.
    pub statistics: Statistics,
    /// Drift.
    pub drift: Drift,
    /// Samples for charts.
    pub trace: Trace,
    /// The first impacts.
    pub impacts: Vec<ImpactRecord>,
    /// Number of impacts.
    pub impact_count: u64,
    /// Energy lost in them and where points came to rest \[J\].
    pub impact_loss: f64,
    /// The first times a point stayed on its wall.
    pub holds: Vec<PersistentContact>,
    /// Number of such times.
    pub persistent_contact_count: u64,
    /// Time spent so, summed over the points \[s\].
    pub persistent_contact_time: f64,
    /// Time spent between the first output time and the last, pauses and the reference solution left out;
    /// zero where nobody [times](crate::run::Run::timed) the run.
    pub wall: Duration,
    /// Time the reference solution took.
    pub trust_wall: Duration,
    /// How far it may be trusted, where that was asked for: see [`Run::trusted`](crate::run::Run::trusted).
    pub trust: Option<Trust>,
    /// The first time a bar turned over, where the run is one of an ensemble.
    pub flip: Option<Flip>,
    /// Events from outside that happened, the first hundred thousand.
    pub events: Vec<EventRecord>,
    /// Their number.
    pub event_count: u64,
    /// Energy that events have put into the mechanism \[J\].
    pub event_energy: f64,
    /// The first times a place with dry friction began to stick or to slide.
    pub frictions: Vec<FrictionRecord>,
    /// Their number.
    pub friction_count: u64,
    /// Extremes and means of the scene's outputs, in their order; empty before the run is finished.
    pub extremes: Vec<Extremes>,
    /// The event that ended it, or `observer`; a run ended so is no failure.
    pub ended_by: Option<String>,
    /// Why it ended before its horizon.
    pub stop: Option<StepError>,
}

impl Outcome {
    /// That of a run that has not gone anywhere yet.
    pub(crate) fn begun(mechanism: &Mechanism, plan: Plan) -> Self {
        Self {
            last: Sample::default(),
            statistics: Statistics::default(),
            drift: Drift::of_plan(mechanism, &plan),
            trace: Trace::default(),
            impacts: Vec::new(),
            impact_count: 0,
            impact_loss: 0.0,
            holds: Vec::new(),
            persistent_contact_count: 0,
            persistent_contact_time: 0.0,
            wall: Duration::ZERO,
            trust_wall: Duration::ZERO,
            trust: None,
            flip: None,
            events: Vec::new(),
            event_count: 0,
            event_energy: 0.0,
            frictions: Vec::new(),
            friction_count: 0,
            extremes: Vec::new(),
            ended_by: None,
            stop: None,
            plan,
        }
    }
}

/// What ends a run without an outcome.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The scene has no equations.
    #[error("{0}")]
    Compile(#[from] CompileError),
    /// The request makes no sense for the scene.
    #[error("{0}")]
    Refused(#[from] RequestRefusal),
    /// The method could not begin.
    #[error("{0}")]
    Step(#[from] StepError),
    /// An observer failed to write.
    #[error("{0}")]
    Observer(#[from] std::io::Error),
}
