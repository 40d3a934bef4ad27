//! Trajectories in lanes, and alone where these do not take them.
//!
//! A trajectory [leaves](BatchMember::has_left) the lanes near a singular position, where it may come to a
//! wall, and where an event may end it.  It goes on by `taylor` as a single run would from there, with
//! projection, through the impact or to the event, until it is past, and comes back.

mod impacts;
mod singular;

use self::impacts::ThroughImpacts;
use self::singular::PastSingular;
use super::watching::Watching;
use crate::arithmetic::DoubleDouble;
use crate::arithmetic::angle::whole_turns;
use crate::dynamics::elimination::Elimination;
use crate::dynamics::multiplier::Multiplier;
use crate::dynamics::{Mechanism, Time};
use crate::run::build::Problem;
use crate::run::extremes::Extremes;
use crate::run::plan::Plan;
use crate::stepping::StepError;
use crate::stepping::taylor::batch::{Batch, BatchMember, BatchObserver, Going, TakenStep, Watch};
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
    watching: Vec<Watching>,
}

impl Ensemble {
    /// For trajectories watched by these, by a method in lanes that has the tolerance of a plan.
    pub(super) fn new(batch: Batch, plan: &Plan, watching: Vec<Watching>) -> Self {
        let mut alone = Vec::new();
        alone.resize_with(watching.len(), || None);
        Self { batch, plan: plan.clone(), alone, watching }
    }

    /// Integrates trajectories, those from number `first` on, to `until`, as [`Batch::integrate`] does.
    pub(super) fn integrate(
        &mut self,
        first: usize,
        members: &mut [BatchMember],
        until: Time,
        watch: &mut Watch,
    ) {
        let Self { batch, plan, alone, watching } = self;
        let (alone, watching) = (&mut alone[first..], &mut watching[first..]);
        batch.integrate_with(
            members,
            until,
            &mut WatchedLanes { batch, plan, until, alone, watching, watch },
        );
    }

    /// True where an event has ended a trajectory.
    pub(super) fn has_ended(&self, number: usize) -> bool {
        self.watching[number].has_ended
    }

    /// What the outputs of a trajectory came to.
    pub(super) fn extremes(&self, number: usize) -> Vec<[f64; 4]> {
        self.watching[number].extremes().iter().map(Extremes::figures).collect()
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
        self.watching.swap_remove(number);
    }
}

/// What is asked of trajectories under way.
struct WatchedLanes<'a, 'b> {
    batch: &'a Batch,
    plan: &'a Plan,
    until: Time,
    alone: &'a mut [Option<Alone>],
    watching: &'a mut [Watching],
    watch: &'a mut Watch<'b>,
}

impl BatchObserver for WatchedLanes<'_, '_> {
    fn ahead(&mut self, number: usize, step: &TakenStep) -> bool {
        self.watching[number].ahead(step)
    }

    fn step(&mut self, number: usize, step: &TakenStep) -> Going {
        self.watching[number].step(step);
        (self.watch)(number, step)
    }

    fn resume(&mut self, number: usize, member: &mut BatchMember) -> Going {
        match &self.alone[number] {
            Some(Alone::PastSingular(alone)) if alone.is_inside() => self.alone(number, member),
            _ => Going::On,
        }
    }

    fn alone(&mut self, number: usize, member: &mut BatchMember) -> Going {
        let Self { batch, plan, until, alone, watching, watch } = self;
        let watching = &mut watching[number];
        watching.go_back();
        let watch = &mut |passage: &TakenStep| watch(number, passage);
        let way = (*batch, *plan, *until);
        take_on(&mut alone[number], way, member, (watching, watch)).unwrap_or_else(|stop| {
            member.stopped = Some(stop);
            Going::Enough
        })
    }
}

fn take_on(
    alone: &mut Option<Alone>,
    (batch, plan, until): (&Batch, &Plan, Time),
    member: &mut BatchMember,
    (watching, watch): (&mut Watching, &mut dyn FnMut(&TakenStep) -> Going),
) -> Result<Going, StepError> {
    let alone = match alone {
        Some(alone) => alone,
        None => alone.insert(match member.mechanism.contacts.is_empty() && watching.events.is_none() {
            true => Alone::PastSingular(Box::new(PastSingular::new(batch, member, plan.time(plan.rows)))),
            false => Alone::ThroughImpacts(Box::new(ThroughImpacts::new(plan, member, watching)?)),
        }),
    };
    member.has_left = false;
    match alone {
        Alone::PastSingular(alone) => alone.go(member, until, &mut |passage| {
            watching.step(passage);
            watch(passage)
        }),
        Alone::ThroughImpacts(alone) => alone.go(member, until, (watching, watch)),
    }
}

/// The form whose states those in lanes are.
pub(super) fn form_in_lanes(mechanism: Arc<Mechanism>) -> Box<dyn Problem> {
    match mechanism.has_multipliers() {
        true => Box::new(Multiplier::<0, true>::new(mechanism)),
        false => Box::new(Elimination::<0>::new(mechanism)),
    }
}
