//! A run at its walls, saved and gone on with.

use super::{ContactDriver, Held, in_modes};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::friction::FrictionMode;
use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::build::build;
use crate::run::driver::DriverState;
use crate::run::event::EventMemory;
use crate::run::extremes::{ExtremesDetector, ExtremesMemory};
use crate::run::methods::Stabilization;
use crate::run::plan::Plan;
use crate::stepping::StepError;
use std::sync::Arc;

/// Where a course is: all that what follows depends on.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(in crate::run) struct ContactDriverState {
    place: DriverState,
    /// Energy less work at the start, shifted by impacts \[J\].
    reference: Option<DoubleDouble>,
    /// True where the last row was at a singular position.
    was_singular: bool,
    /// Contacts held, in the order of their rows.
    contacts: Vec<usize>,
    /// Modes of the places with friction.
    modes: Vec<FrictionMode>,
    held: Vec<Held>,
    holds_in_row: usize,
    events_in_row: usize,
    is_between: bool,
    stabilizer: f64,
    /// Parts that do not act at the moment.
    off: Vec<String>,
    /// How much further motors and locks go on than the scene says, by row \[rad, m\].
    shifts: Vec<(usize, f64)>,
    /// Parameters of the scene's laws, and the branches they are on.
    laws: Option<(Vec<f64>, Vec<bool>)>,
    /// What the detector of events remembers, where there is one.
    events: Option<EventMemory>,
    /// What is known of the extremes of outputs, where there are any.
    extremes: Option<ExtremesMemory>,
}

impl ContactDriver {
    /// Where it is, to go on from.
    pub(in crate::run) fn contact_state(&self) -> ContactDriverState {
        ContactDriverState {
            place: self.driver.place(),
            reference: self.sampler.reference(),
            was_singular: self.sampler.was_singular,
            contacts: self.mechanism.held.clone(),
            modes: self.mechanism.modes.clone(),
            held: self.held.clone(),
            holds_in_row: self.holds_in_row,
            events_in_row: self.events_in_row,
            is_between: self.is_between,
            stabilizer: self.stabilizer,
            off: self.off.clone(),
            shifts: self.shifts.clone(),
            laws: self.whole.laws.as_ref().map(|laws| (laws.parameters.clone(), laws.modes.clone())),
            events: self
                .events
                .as_ref()
                .map(|events| events.memory.clone())
                .or_else(|| self.remembered.clone()),
            extremes: self.extremes.as_ref().map(|extremes| extremes.memory.clone()),
        }
    }

    /// How many holds must be kept by name for a station to be consistent.
    pub(in crate::run) fn names_holds(contact_state: &ContactDriverState) -> usize {
        contact_state.held.iter().filter_map(|held| held.kept).map(|kept| kept + 1).max().unwrap_or(0)
    }

    /// A course that goes on from a station, which was reached on the way to `horizon`; `None` where it
    /// cannot be one of this mechanism and plan.
    pub(in crate::run) fn resume(
        mechanism: Arc<Mechanism>,
        plan: &Plan,
        start: &Motion,
        contact_state: ContactDriverState,
        horizon: Time,
    ) -> Result<Option<Self>, StepError> {
        let ContactDriverState {
            place,
            reference,
            was_singular,
            contacts,
            modes,
            held,
            holds_in_row,
            events_in_row,
            is_between,
            stabilizer,
            off,
            shifts,
            laws,
            events,
            extremes,
        } = contact_state;
        let Some(whole) = whole_again(mechanism, &shifts, laws) else { return Ok(None) };
        let Ok(mechanism) = whole.without(&off).map(Arc::new) else { return Ok(None) };
        let known = |contact: usize| contact < mechanism.contacts.len();
        let once = contacts.iter().enumerate().all(|(i, contact)| !contacts[..i].contains(contact));
        let fits = modes.len() == mechanism.frictions.len();
        if !once || !fits || !contacts.iter().copied().chain(held.iter().map(|held| held.contact)).all(known)
        {
            return Ok(None);
        }
        let mut plan = plan.clone();
        let holding = in_modes(&mechanism, &contacts, &modes);
        if holding.constraints.len() > mechanism.constraints.len() {
            plan.stabilization = Stabilization::Projection;
        }
        let mut contact_driver = Self::new(Arc::clone(&mechanism), build(&holding, &mut plan, start)?);
        if !contact_driver.driver.resume(place, horizon)? {
            return Ok(None);
        }
        contact_driver.driver.allow(plan.max_evaluations);
        if !Arc::ptr_eq(&holding, &mechanism) {
            contact_driver.sampler.hold(Arc::clone(&holding));
            contact_driver.mechanism = holding;
        }
        contact_driver.sampler.refer(reference);
        contact_driver.sampler.was_singular = was_singular;
        let acting = Arc::clone(&contact_driver.mechanism);
        if let Some(events) = &mut contact_driver.events {
            events.watch_friction(&acting);
        }
        if let (Some(detector), Some(memory)) = (&mut contact_driver.events, &events) {
            detector.exchange(Arc::clone(&whole));
            detector.restore(memory.clone());
        }
        let mut looking =
            extremes.is_some().then(|| ExtremesDetector::new(&contact_driver.mechanism)).flatten();
        let fits = match (&mut looking, extremes) {
            (Some(looking), Some(memory)) => looking.restore(memory),
            (_, memory) => memory.is_none(),
        };
        if !fits {
            return Ok(None);
        }
        Ok(Some(Self {
            whole,
            off,
            shifts,
            extremes: looking,
            remembered: events,
            held,
            holds_in_row,
            events_in_row,
            is_between,
            stabilizer,
            ..contact_driver
        }))
    }
}

/// The mechanism with all its parts, its motors and locks so much further on, by these parameters of its
/// laws on these branches; `None` where it has other laws.
fn whole_again(
    mechanism: Arc<Mechanism>,
    shifts: &[(usize, f64)],
    laws: Option<(Vec<f64>, Vec<bool>)>,
) -> Option<Arc<Mechanism>> {
    let mut whole = mechanism.whole.clone().map_or(mechanism, |(whole, _)| whole);
    if !shifts.is_empty() {
        whole = Arc::new(whole.shifted(shifts));
    }
    let Some((parameters, modes)) = laws else { return Some(whole) };
    let sizes = whole.laws.as_ref().map(|laws| (laws.parameters.len(), laws.modes.len()));
    if sizes != Some((parameters.len(), modes.len())) {
        return None;
    }
    whole.on_branch(parameters, modes).ok().map(Arc::new)
}
