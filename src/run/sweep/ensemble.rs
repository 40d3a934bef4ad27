//! Trajectories in lanes, and alone where these do not take them.
//!
//! With closed loops a trajectory [leaves](BatchMember::has_left) the lanes near a singular position. It goes
//! on by `taylor` with projection, as a single run would from there, until it is past, and comes back.

use crate::dynamics::kernel::Kernel;
use crate::dynamics::schur::NEAR;
use crate::dynamics::{State, Time};
use crate::run::build::{Problem, tangent_form};
use crate::stabilization::Projected;
use crate::stepping::taylor::batch::{Batch, BatchMember, Going, Passage};
use crate::stepping::{Integrator, StepError, Taylor};
use std::cell::RefCell;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Sees a step of a trajectory, and may end it.
type Watch<'a> = dyn FnMut(usize, &Passage) -> Going + 'a;

/// Integrates all trajectories to `until`, as [`Batch::integrate`] does.
pub(super) fn integrate(batch: &Batch, members: &mut [BatchMember], until: Time, watch: &mut Watch) {
    batch.integrate(members, until, watch);
    let mut alone: Vec<(usize, Option<Box<Alone>>)> = Vec::new();
    alone.extend((0..members.len()).filter(|&k| members[k].has_left).map(|k| (k, None)));
    while !alone.is_empty() {
        alone.retain_mut(|(number, code)| {
            let member = &mut members[*number];
            let code = code.get_or_insert_with(|| Box::new(Alone::new(batch, member)));
            match code.go_past(member, until, &mut |passage| watch(*number, passage)) {
                Ok(goes_on) => goes_on && member.state.time < until,
                Err(stop) => {
                    member.stopped = Some(stop);
                    false
                }
            }
        });
        let mut back: Vec<BatchMember> = alone.iter().map(|(number, _)| members[*number].clone()).collect();
        batch.integrate(&mut back, until, &mut |k, passage| watch(alone[k].0, passage));
        for (member, (number, _)) in back.into_iter().zip(&alone) {
            members[*number] = member;
        }
        alone.retain(|(number, _)| members[*number].has_left);
    }
}

/// What takes one trajectory on.
struct Alone {
    problem: RefCell<Box<dyn Problem>>,
    method: RefCell<Projected<Taylor<f64>>>,
    kernel: Kernel<f64>,
}

impl Alone {
    fn new(batch: &Batch, member: &BatchMember) -> Self {
        let mechanism = Arc::new(member.mechanism.clone());
        Self {
            kernel: Kernel::new(&mechanism),
            problem: RefCell::new(tangent_form(&mechanism)),
            method: RefCell::new(Projected::new(batch.alone())),
        }
    }

    /// Takes steps until the constraints are independent of one another again, at least one; false where
    /// enough was seen.
    fn go_past(
        &mut self,
        member: &mut BatchMember,
        until: Time,
        watch: &mut dyn FnMut(&Passage) -> Going,
    ) -> Result<bool, StepError> {
        let Self { problem, method, kernel } = self;
        let n = member.mechanism.coordinates();
        member.has_left = false;
        method.get_mut().begin(&mut **problem.get_mut(), &mut member.state, until)?;
        loop {
            let from = member.state.clone();
            let BatchMember { mechanism, state, statistics, .. } = &mut *member;
            method.get_mut().step(&mut **problem.get_mut(), state, until, statistics)?;
            let inside = |after: f64| {
                let mut inside = State::default();
                let (mut problem, mut method) = (problem.borrow_mut(), method.borrow_mut());
                method.interpolate_roughly(&mut **problem, &from, from.time + after, &mut inside);
                inside
            };
            let series = |body: usize, after: f64| angle_and_rate(&inside(after), &from, n, body);
            let start = |body: usize| angle_and_rate(&from, &from, n, body);
            let ends =
                |body: usize| [start(body), angle_and_rate(state, &from, n, body)].map(<[f64; 2]>::from);
            let passage = Passage::new(from.time, (state.time - from.time).hi, &ends, &series);
            if watch(&passage) == Going::Enough {
                return Ok(false);
            }
            let (phi, omega) = (&state.y[..n], &state.y[n..2 * n]);
            let share = kernel.independence_at(mechanism, state.time, phi, omega);
            if state.time >= until || share >= NEAR {
                return Ok(true);
            }
        }
    }
}

/// Angle of a body \[rad\], continued from that of a former state in [-π, π], and its rate \[rad/s\].
fn angle_and_rate(state: &State, from: &State, n: usize, body: usize) -> (f64, f64) {
    let reduced = |angle: f64| if angle.abs() <= PI { 0.0 } else { (angle / TAU).round() };
    let turns = (state.turns[body] - from.turns[body]) as f64 - reduced(from.y[body]);
    (state.y[body] + TAU * turns, state.y[n + body])
}
