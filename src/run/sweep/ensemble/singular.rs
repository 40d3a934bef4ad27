//! A trajectory near a singular position.

use super::whole_turns;
use crate::dynamics::kernel::Kernel;
use crate::dynamics::schur::NEAR;
use crate::dynamics::{Motion, State, Time};
use crate::run::build::{Problem, tangent_form};
use crate::stabilization::Projected;
use crate::stepping::taylor::batch::{Batch, BatchMember, Going, TakenStep, read};
use crate::stepping::{Integrator, StepError, Taylor};
use std::cell::RefCell;
use std::f64::consts::TAU;
use std::sync::Arc;

/// What takes it past.
pub(super) struct PastSingular {
    problem: RefCell<Box<dyn Problem>>,
    method: RefCell<Projected<Taylor<f64>>>,
    kernel: Kernel<f64>,
}

impl PastSingular {
    pub(super) fn new(batch: &Batch, member: &BatchMember) -> Self {
        let mechanism = Arc::new(member.mechanism.clone());
        Self {
            kernel: Kernel::new(&mechanism),
            problem: RefCell::new(tangent_form(&mechanism)),
            method: RefCell::new(Projected::new(batch.alone())),
        }
    }

    /// Takes steps until the constraints are independent of one another again, at least one; tells whether
    /// there is more to be seen.
    pub(super) fn go(
        &mut self,
        member: &mut BatchMember,
        until: Time,
        watch: &mut dyn FnMut(&TakenStep) -> Going,
    ) -> Result<Going, StepError> {
        let Self { problem, method, kernel } = self;
        let n = member.mechanism.coordinates();
        let room = RefCell::new(State::default());
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
            let span = (state.time - from.time).hi;
            let motion = |after: f64, motion: &mut Motion| {
                if after >= span {
                    read(mechanism, state, motion);
                    return;
                }
                let (mut problem, mut method) = (problem.borrow_mut(), method.borrow_mut());
                let inside = &mut *room.borrow_mut();
                method.interpolate(&mut **problem, &from, from.time + after, inside);
                read(mechanism, inside, motion);
            };
            let passage = TakenStep::new(from.time, span, &ends, &series, &motion);
            if watch(&passage) == Going::Enough {
                return Ok(Going::Enough);
            }
            let (phi, omega) = (&state.y[..n], &state.y[n..2 * n]);
            let share = kernel.independence_at(mechanism, state.time, phi, omega).share();
            if state.time >= until || share >= NEAR {
                return Ok(Going::On);
            }
        }
    }
}

/// Angle of a body \[rad\], continued from that of a former state in [-π, π], and its rate \[rad/s\].
fn angle_and_rate(state: &State, from: &State, n: usize, body: usize) -> (f64, f64) {
    let turns = (state.turns[body] - from.turns[body]) as f64 - whole_turns(from.y[body]);
    (state.y[body] + TAU * turns, state.y[n + body])
}
