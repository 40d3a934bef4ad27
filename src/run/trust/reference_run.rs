//! A reference solution under way: the series, and the tangent flow along it.

use super::budget::Prices;
use super::finer::{is_alike, is_rounded, own_error};
use super::measured::TrustMeasurement;
use super::tangent::{Path, TangentFlow};
use crate::arithmetic::shown::figure;
use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::build::build;
use crate::run::contact::{ContactDriver, ContactDriverState, JumpLog};
use crate::run::methods::MethodId;
use crate::run::plan::Plan;
use crate::run::running::Outcome;
use crate::stepping::{Statistics, StepError};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Steps that are taken for granted where the reference solution has to end one at every look.
const STEPS: f64 = 256.0;

/// A reference solution under way.
pub(super) struct ReferenceRun {
    contact_driver: ContactDriver,
    pub outcome: Outcome,
    pub motion: Motion,
    pub tangent: Option<TangentFlow>,
    /// Why there is no tangent flow.
    pub no_growth: Option<String>,
    /// True where its own rounding counts: the run is as near it.
    pub is_rounded: bool,
    /// The time at which the series began \[s\].
    begun: f64,
    last: Statistics,
}

/// All that the rest of it depends on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct SavedReferenceRun {
    contact_state: ContactDriverState,
    outcome: Outcome,
    path: Option<Path>,
    begun: f64,
    last: Statistics,
}

impl SavedReferenceRun {
    /// On the way to a later horizon \[s\].
    pub(super) fn extend(&mut self, until: f64) {
        (self.outcome.plan.until, self.outcome.plan.every) = (until, until);
    }

    /// Whether its parts go together.
    pub(super) fn is_sound(&self) -> bool {
        let Outcome { plan, holds, .. } = &self.outcome;
        plan.is_sound() && ContactDriver::names_holds(&self.contact_state) <= holds.len()
    }
}

/// What a reference solution may cost, and what it has cost.
pub(super) struct WorkBudget<'a> {
    pub prices: &'a Prices,
    pub spent: &'a mut f64,
    pub limit: f64,
    /// Of what was spent, that of the tangent flow.
    pub flow: &'a mut f64,
}

fn contact_driver(
    mechanism: &Arc<Mechanism>,
    series: &mut Plan,
    start: &Motion,
) -> Result<(ContactDriver, Outcome), String> {
    let driver = build(mechanism, series, start).map_err(|stop| stop.what)?;
    let mut outcome = Outcome::begun(mechanism, series.clone());
    let mut contact_driver = ContactDriver::new(Arc::clone(mechanism), driver).ends_bounces_sooner();
    contact_driver.meet(&mut outcome).map_err(|stop| stop.what)?;
    Ok((contact_driver, outcome))
}

impl ReferenceRun {
    /// One at the start of a run.
    ///
    /// # Errors
    /// Why there can be none.
    pub(super) fn new(mechanism: &Arc<Mechanism>, series: &mut Plan, start: &Motion) -> Result<Self, String> {
        let (mut contact_driver, outcome) = contact_driver(mechanism, series, start)?;
        let motion = contact_driver.motion();
        let (tangent, no_growth) = match TangentFlow::new(contact_driver.holding(), &motion, series.until) {
            Ok(tangent) => (Some(tangent), None),
            Err(why) => (None, Some(why)),
        };
        contact_driver.jumps = tangent.is_some().then(JumpLog::with_switches);
        let (is_rounded, begun) = (is_rounded(series), start.time.hi);
        Ok(Self {
            contact_driver,
            outcome,
            motion: start.clone(),
            tangent,
            no_growth,
            is_rounded,
            begun,
            last: Statistics::default(),
        })
    }

    /// Goes on by another series from where it is.
    ///
    /// # Errors
    /// Why it cannot.
    pub(super) fn change(&mut self, series: Plan) -> Result<(), String> {
        self.outcome.plan = series;
        self.contact_driver.go_on_by(&mut self.outcome.plan, &self.motion).map_err(|stop| stop.what)?;
        (self.is_rounded, self.begun, self.last) =
            (is_rounded(self.plan()), self.motion.time.hi, Statistics::default());
        Ok(())
    }

    pub(super) fn kept(&self) -> SavedReferenceRun {
        SavedReferenceRun {
            contact_state: self.contact_driver.contact_state(),
            outcome: self.outcome.clone(),
            path: self.tangent.as_ref().map(|tangent| tangent.path().clone()),
            begun: self.begun,
            last: self.last,
        }
    }

    /// Goes on from what was kept, which was reached on the way to `horizon`; `None` where it cannot be of
    /// this mechanism.
    pub(super) fn resume(
        mechanism: &Arc<Mechanism>,
        start: &Motion,
        kept: SavedReferenceRun,
        horizon: Time,
    ) -> Result<Option<Self>, StepError> {
        let SavedReferenceRun { contact_state, outcome, path, begun, last } = kept;
        let resumed =
            ContactDriver::resume(Arc::clone(mechanism), &outcome.plan, start, contact_state, horizon)?;
        let Some(mut contact_driver) = resumed.map(ContactDriver::ends_bounces_sooner) else {
            return Ok(None);
        };
        let tangent = match path {
            None => None,
            Some(path) => match TangentFlow::resume(contact_driver.holding(), path) {
                None => return Ok(None),
                tangent => tangent,
            },
        };
        contact_driver.jumps = tangent.is_some().then(JumpLog::with_switches);
        let is_rounded = is_rounded(&outcome.plan);
        let motion = contact_driver.motion();
        Ok(Some(Self { contact_driver, outcome, motion, tangent, no_growth: None, is_rounded, begun, last }))
    }

    /// Ends the tangent flow.
    pub(super) fn end_flow(&mut self) -> Option<TangentFlow> {
        self.contact_driver.jumps = None;
        self.tangent.take()
    }

    /// Its plan.
    pub(super) fn plan(&self) -> &Plan {
        &self.outcome.plan
    }

    /// Expansions of its series so far.
    pub(super) fn expansions(&self) -> u64 {
        self.contact_driver.statistics().evaluations
    }

    /// Impacts and lasting contacts so far.
    pub(super) fn events(&self) -> u64 {
        self.outcome.impact_count + self.outcome.persistent_contact_count
    }

    /// What its motion at `t` \[s\] may be off by itself \[rad\], where that may be as much as the run is.
    pub(super) fn own_error(&self, t: f64, run: &Plan, measured: &TrustMeasurement) -> f64 {
        let time = t - self.begun;
        let least = own_error(self.plan()) * time / self.contact_driver.holding().units.time;
        match &self.tangent {
            Some(tangent) if self.is_rounded => tangent.rounding().hypot(least),
            // A series like that of the run comes to in its time what the run had come to before.
            None if self.begun > 0.0 && is_alike(self.plan(), run) => {
                least.max(measured.error_at(self.begun) * (time / self.begun).powi(2))
            }
            _ => least,
        }
    }

    /// The mean length of its steps \[s\], of those up to `t` \[s\]; where they end at every look it has no
    /// say in when these are.
    pub(super) fn mean_step(&self, t: f64) -> f64 {
        if self.plan().method != MethodId::Taylor {
            return self.plan().until / STEPS;
        }
        (t - self.begun) / self.last.steps.max(1) as f64
    }

    /// To a time, with the motion there in `motion`, or to where the budget is used up; what it cost is added
    /// to what was spent.
    ///
    /// # Errors
    /// Why the reference solution stopped, or `None` where the budget was used up.
    pub(super) fn go(&mut self, until: Time, budget: &mut WorkBudget) -> Result<(), Option<String>> {
        while let Some(next) = self.tangent.as_ref().map(TangentFlow::next).filter(|&next| next <= until.hi) {
            // After an event that came in a long step of the flow its steps may be so short that they end
            // before the step in which the motion is known.
            let is_behind =
                next < self.motion.time.hi && next < self.contact_driver.step_begin().hi.max(self.begun);
            if !is_behind {
                self.integrate(Time::from(next), budget)?;
            }
            let steps = if self.is_rounded { self.last.steps } else { 0 };
            if let Some(tangent) = &mut self.tangent {
                match is_behind {
                    true => tangent.go_alone(),
                    false => tangent.take(&self.motion, steps),
                }
                let cost = tangent.evaluations() as f64 * budget.prices.evaluation;
                (*budget.spent, *budget.flow) = (*budget.spent + cost, *budget.flow + cost);
            }
        }
        self.integrate(until, budget)
    }

    /// The same without the tangent flow.
    fn integrate(&mut self, until: Time, budget: &mut WorkBudget) -> Result<(), Option<String>> {
        let each = budget.prices.series[0];
        let mut left = ((budget.limit - *budget.spent) / each) as u64;
        let mut is_spent = || {
            left = left.saturating_sub(1);
            left == 0
        };
        let arrived = loop {
            let arrived = self.contact_driver.go(until, &mut self.outcome, &mut is_spent);
            let arrived = arrived.map_err(|stop| {
                Some(format!("the reference solution stopped at t = {} s: {}", figure(stop.t), stop.what))
            })?;
            // Where an event ends the run, the reference solution may have come to it before.
            if self.contact_driver.ended_by.take().is_none() {
                break arrived;
            }
        };
        let is_paid = arrived && *budget.spent <= budget.limit;
        // Where another series goes on, this is where it begins.
        self.contact_driver.look(&mut self.motion);
        if let (Some(tangent), Some(jumps)) = (&mut self.tangent, &self.contact_driver.jumps) {
            tangent.jump(&jumps.take());
        }
        let statistics = self.contact_driver.statistics();
        *budget.spent += (statistics.evaluations - self.last.evaluations) as f64 * each + budget.prices.look;
        self.last = statistics;
        if is_paid { Ok(()) } else { Err(None) }
    }
}
