//! Trajectories in lanes, and alone where these do not take them.
//!
//! A trajectory [leaves](BatchMember::has_left) the lanes near a singular position, and where it may come to a
//! wall.  It goes on by `taylor` as a single run would from there, with projection or through the impact,
//! until it is past, and comes back.

mod impacts;
mod singular;

use self::impacts::ThroughImpacts;
use self::singular::PastSingular;
use crate::arithmetic::DoubleDouble;
use crate::dynamics::elimination::Elimination;
use crate::dynamics::multiplier::Multiplier;
use crate::dynamics::{Mechanism, Time};
use crate::run::build::Problem;
use crate::run::plan::Plan;
use crate::stepping::StepError;
use crate::stepping::taylor::batch::{Batch, BatchMember, Going, Passage, Watch};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// What takes one trajectory on.
enum Alone {
    PastSingular(Box<PastSingular>),
    ThroughImpacts(Box<ThroughImpacts>),
}

/// The method of some trajectories, and what takes those on that have left the lanes.
pub(super) struct Ensemble {
    batch: Batch,
    plan: Plan,
    alone: Vec<Option<Alone>>,
}

impl Ensemble {
    /// For so many trajectories, by a method in lanes that has the tolerance of a plan.
    pub(super) fn new(batch: Batch, plan: &Plan, count: usize) -> Self {
        let mut alone = Vec::new();
        alone.resize_with(count, || None);
        Self { batch, plan: plan.clone(), alone }
    }

    /// Integrates trajectories, those from number `first` on, to `until`, as [`Batch::integrate`] does.
    pub(super) fn integrate(
        &mut self,
        first: usize,
        members: &mut [BatchMember],
        until: Time,
        watch: &mut Watch,
    ) {
        let Self { batch, plan, alone } = self;
        batch.integrate_with(members, until, watch, &mut |number, member, watch| {
            let watch = &mut |passage: &Passage| watch(number, passage);
            take_on(&mut alone[first + number], batch, plan, member, until, watch).unwrap_or_else(|stop| {
                member.stopped = Some(stop);
                Going::Enough
            })
        });
    }

    /// What impacts have changed so far of a trajectory's energy less the work its state tells of \[J\].
    pub(super) fn energy_of_impacts(&self, number: usize) -> DoubleDouble {
        match &self.alone[number] {
            Some(Alone::ThroughImpacts(alone)) => alone.energy(),
            _ => DoubleDouble::default(),
        }
    }

    /// Forgets a trajectory, whose number the last one gets.
    pub(super) fn swap_remove(&mut self, number: usize) {
        self.alone.swap_remove(number);
    }
}

fn take_on(
    alone: &mut Option<Alone>,
    batch: &Batch,
    plan: &Plan,
    member: &mut BatchMember,
    until: Time,
    watch: &mut dyn FnMut(&Passage) -> Going,
) -> Result<Going, StepError> {
    let alone = match alone {
        Some(alone) => alone,
        None => alone.insert(match member.mechanism.contacts.is_empty() {
            true => Alone::PastSingular(Box::new(PastSingular::new(batch, member))),
            false => Alone::ThroughImpacts(Box::new(ThroughImpacts::new(plan, member)?)),
        }),
    };
    member.has_left = false;
    match alone {
        Alone::PastSingular(alone) => alone.go(member, until, watch),
        Alone::ThroughImpacts(alone) => alone.go(member, until, watch),
    }
}

/// The form whose states those in lanes are.
pub(super) fn form_in_lanes(mechanism: Arc<Mechanism>) -> Box<dyn Problem> {
    match mechanism.has_multipliers() {
        true => Box::new(Multiplier::<0, true>::new(mechanism)),
        false => Box::new(Elimination::<0>::new(mechanism)),
    }
}

/// Whole turns that are to be taken off an angle \[rad\] for it to be in [-π, π].
fn whole_turns(angle: f64) -> f64 {
    if angle.abs() <= PI { 0.0 } else { (angle / TAU).round() }
}
