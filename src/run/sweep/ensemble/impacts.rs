//! A trajectory that may come to a wall or to its end: the loop of a single run, with its impacts, its
//! lasting contacts and its events.

use super::{Watching, form_in_lanes, whole_turns};
use crate::arithmetic::{DoubleDouble, Scalar};
use crate::dynamics::{Motion, Time};
use crate::run::build::{Problem, build};
use crate::run::contact::ContactDriver;
use crate::run::observer::{Observer, ObserverAdapter, Step};
use crate::run::plan::Plan;
use crate::run::running::Outcome;
use crate::stepping::StepError;
use crate::stepping::taylor::batch::{BatchMember, Going, TakenStep};
use std::cell::RefCell;
use std::f64::consts::TAU;
use std::ops::ControlFlow;
use std::sync::Arc;

/// What takes it on.
pub(super) struct ThroughImpacts {
    contact_driver: ContactDriver,
    outcome: Outcome,
    form: Box<dyn Problem>,
    /// True where the driver's motion is the present one: before the first step, and while a contact lasts.
    goes_on: bool,
    /// Work that states in lanes do not tell of, up to when it left last, and from then on \[J\].
    work: [DoubleDouble; 2],
}

impl ThroughImpacts {
    /// For a trajectory that leaves for the first time: what touches a wall and moves into it is struck.
    pub(super) fn new(plan: &Plan, member: &BatchMember, watching: &mut Watching) -> Result<Self, StepError> {
        let mechanism = Arc::new(member.mechanism.clone());
        let mut form = form_in_lanes(Arc::clone(&mechanism));
        let (mut motion, mut plan) = (Motion::default(), plan.clone());
        form.read(&member.state, &mut motion);
        let driver = build(&mechanism, &mut plan, &motion)?;
        let mut outcome = Outcome::begun(&mechanism, plan);
        let mut contact_driver = ContactDriver::new(mechanism, driver);
        contact_driver.sampler.refer(Some(DoubleDouble::ZERO));
        contact_driver.events = watching.events.take();
        let met = contact_driver.meet(&mut outcome);
        watching.events = contact_driver.events.take();
        met?;
        Ok(Self { contact_driver, outcome, form, goes_on: true, work: [DoubleDouble::ZERO; 2] })
    }

    /// What impacts have changed of the energy less the work that states tell of \[J\].
    pub(super) fn energy(&self) -> DoubleDouble {
        self.contact_driver.sampler.reference().unwrap_or_default() + self.work[0] + self.work[1]
    }

    /// Takes a step, with all impacts before it, and more as long as a contact lasts; tells whether there is
    /// more to be seen.
    pub(super) fn go(
        &mut self,
        member: &mut BatchMember,
        until: Time,
        (watching, watch): (&mut Watching, &mut dyn FnMut(&TakenStep) -> Going),
    ) -> Result<Going, StepError> {
        let Self { contact_driver, outcome, form, goes_on, work } = self;
        let mut motion = Motion::default();
        if !*goes_on {
            form.read(&member.state, &mut motion);
            contact_driver.driver.jump(&motion);
            let [before, last] = *work;
            *work = [before + last, DoubleDouble::ZERO];
        }
        (contact_driver.extremes, contact_driver.events) = (watching.extremes.take(), watching.events.take());
        let before = contact_driver.statistics();
        let spent = member.statistics.evaluations.saturating_sub(before.evaluations);
        contact_driver.driver.allow(member.statistics.max_evaluations.saturating_sub(spent));
        contact_driver.pause_at_impacts(until);
        let mut shown = ShownSteps { watch };
        let mut adapter = ObserverAdapter { observer: &mut shown, has_enough: false };
        let gone = loop {
            let gone = contact_driver.go_watched(until, outcome, None, Some(&mut adapter), &mut || true);
            if gone != Ok(false) || contact_driver.holding().held.is_empty() {
                break gone;
            }
        };
        watching.has_ended = contact_driver.ended_by.take().is_some();
        let has_enough = adapter.has_enough || watching.has_ended;
        *goes_on = !contact_driver.holding().held.is_empty();
        (watching.extremes, watching.events) = (contact_driver.extremes.take(), contact_driver.events.take());
        if let Some(extremes) = &mut watching.extremes {
            extremes.hold(contact_driver.holding());
        }
        contact_driver.look(&mut motion);
        member.state = form.state(&motion);
        if !form.mechanism().has_work_integral() {
            work[1] = motion.work;
        }
        let now = contact_driver.statistics();
        member.statistics.steps += now.steps - before.steps;
        member.statistics.evaluations += now.evaluations - before.evaluations;
        gone.map(|_| if has_enough { Going::Enough } else { Going::On })
    }
}

/// Shows the steps of a run as those in lanes are shown.
struct ShownSteps<'a> {
    watch: &'a mut dyn FnMut(&TakenStep) -> Going,
}

impl Observer for ShownSteps<'_> {
    fn step(&mut self, step: &mut Step) -> ControlFlow<()> {
        let (begin, end) = (step.begin(), step.end());
        let [from, to] = [begin, end].map(|time| step.at(time).clone());
        let step = RefCell::new(step);
        let series = |body: usize, after: f64| {
            let [angle, rate] = angle_and_rate(step.borrow_mut().at(begin + after), &from, body);
            (angle, rate)
        };
        let ends = |body: usize| [&from, &to].map(|motion| angle_and_rate(motion, &from, body));
        let motion = |after: f64, motion: &mut Motion| motion.clone_from(step.borrow_mut().at(begin + after));
        match (self.watch)(&TakenStep::new(Time::from(begin), end - begin, &ends, &series, &motion)) {
            Going::Enough => ControlFlow::Break(()),
            Going::On => ControlFlow::Continue(()),
        }
    }
}

/// Angle of a body \[rad\], continued from that of a former motion in [-π, π], and its rate \[rad/s\].
fn angle_and_rate(motion: &Motion, from: &Motion, body: usize) -> [f64; 2] {
    let turns = (motion.turns[body] - from.turns[body]) as f64 - whole_turns(from.phi[body].hi);
    [motion.phi[body].hi + TAU * turns, motion.omega[body].hi]
}
