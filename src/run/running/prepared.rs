//! A run before its first step.

use crate::dynamics::{Mechanism, Motion};
use crate::run::build::build;
use crate::run::clock::{Clock, still};
use crate::run::drift::Limits;
use crate::run::driver::Driver;
use crate::run::event::Event;
use crate::run::plan::Plan;
use crate::run::trust::{ErrorEstimator, Level};
use crate::run::turns::Turns;
use crate::stepping::StepError;
use std::sync::Arc;

/// A run about to begin.
pub struct Run {
    pub(super) mechanism: Arc<Mechanism>,
    pub(super) plan: Plan,
    pub(super) limits: Limits,
    pub(super) driver: Box<dyn Driver>,
    pub(super) turns: Turns,
    /// For runs of an ensemble, which look for bars that turn over and keep no samples: whether they end with
    /// the first.
    pub(super) ensemble: Option<bool>,
    pub(super) error_estimator: Option<ErrorEstimator>,
    pub(super) events: Vec<Box<dyn Event>>,
    pub(super) clock: Clock,
    pub(super) begun: Motion,
}

impl Run {
    /// Prepares a run from a motion.
    ///
    /// # Errors
    /// A method that cannot begin there.
    pub fn new(
        mechanism: Arc<Mechanism>,
        mut plan: Plan,
        limits: Limits,
        start: &Motion,
    ) -> Result<Self, StepError> {
        let mut driver = build(&mechanism, &mut plan, start)?;
        driver.allow(plan.max_evaluations);
        let turns = Turns::new(&mechanism, &plan, start);
        Ok(Self {
            mechanism,
            plan,
            limits,
            driver,
            turns,
            ensemble: None,
            error_estimator: None,
            events: Vec::new(),
            clock: still,
            begun: start.clone(),
        })
    }

    /// The same, accompanied by an estimate of its error; `start` is the motion it begins with.
    ///
    /// Nothing of the run itself changes by it, to the last bit.
    #[must_use]
    pub fn trusted(self, level: Level, start: &Motion) -> Self {
        let error_estimator =
            (level != Level::Off).then(|| ErrorEstimator::new(&self.mechanism, &self.plan, start, level));
        Self { error_estimator, ..self }
    }

    /// The same, timed by a clock: see [`Outcome::wall`](super::Outcome::wall).
    #[must_use]
    pub fn timed(self, clock: Clock) -> Self {
        Self { clock, ..self }
    }

    /// The same with events; where one changes the run, the estimate of its error ends.
    #[must_use]
    pub fn with_events(self, events: Vec<Box<dyn Event>>) -> Self {
        Self { events, ..self }
    }

    /// The same as one of many: looks for the first bar that turns over, and without samples for charts.
    pub(in crate::run) fn of_ensemble(self, ends_at_flip: bool) -> Self {
        Self { ensemble: Some(ends_at_flip), ..self }
    }

    /// The plan as it will be carried out.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }
}
