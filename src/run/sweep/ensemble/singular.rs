//! A trajectory near a singular position.
//!
//! Steps end there where the method ends them, at no output time: one that lies inside a step is read from
//! its series, as single runs read it, and the trajectory goes on from the step's own end.

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
    /// The end of all, at which steps do end.
    horizon: Time,
    /// Both ends of the last step, where the trajectory stands inside it.
    step: Option<[State; 2]>,
}

impl PastSingular {
    pub(super) fn new(batch: &Batch, member: &BatchMember, horizon: Time) -> Self {
        let mechanism = Arc::new(member.mechanism.clone());
        Self {
            kernel: Kernel::new(&mechanism),
            problem: RefCell::new(tangent_form(&mechanism)),
            method: RefCell::new(Projected::new(batch.alone())),
            horizon,
            step: None,
        }
    }

    /// True where the trajectory stands inside a step.
    pub(super) fn is_inside(&self) -> bool {
        self.step.is_some()
    }

    /// Goes on to `until`, or until the constraints are independent of one another again after a step, at
    /// least one; tells whether there is more to be seen.
    pub(super) fn go(
        &mut self,
        member: &mut BatchMember,
        until: Time,
        watch: &mut dyn FnMut(&TakenStep) -> Going,
    ) -> Result<Going, StepError> {
        let Self { problem, method, kernel, horizon, step } = self;
        let n = member.mechanism.coordinates();
        let room = RefCell::new(State::default());
        if step.is_none() {
            method.get_mut().begin(&mut **problem.get_mut(), &mut member.state, *horizon)?;
        }
        loop {
            let BatchMember { mechanism, state, statistics, .. } = &mut *member;
            let [from, to] = match step.take() {
                Some(ends) => ends,
                None => {
                    let mut to = state.clone();
                    method.get_mut().step(&mut **problem.get_mut(), &mut to, *horizon, statistics)?;
                    [state.clone(), to]
                }
            };
            let begin = state.clone();
            let is_whole = to.time <= until;
            if is_whole {
                state.clone_from(&to);
            } else {
                method.get_mut().interpolate(&mut **problem.get_mut(), &from, until, state);
            }
            let inside = |after: f64| {
                let mut inside = State::default();
                let (mut problem, mut method) = (problem.borrow_mut(), method.borrow_mut());
                method.interpolate_roughly(&mut **problem, &from, begin.time + after, &mut inside);
                inside
            };
            let series = |body: usize, after: f64| angle_and_rate(&inside(after), &begin, n, body);
            let ends = |body: usize| {
                [&begin, &*state].map(|state| <[f64; 2]>::from(angle_and_rate(state, &begin, n, body)))
            };
            let span = (state.time - begin.time).hi;
            let motion = |after: f64, motion: &mut Motion| {
                if after >= span {
                    read(mechanism, state, motion);
                    return;
                }
                let (mut problem, mut method) = (problem.borrow_mut(), method.borrow_mut());
                let inside = &mut *room.borrow_mut();
                method.interpolate(&mut **problem, &from, begin.time + after, inside);
                read(mechanism, inside, motion);
            };
            let going = watch(&TakenStep::new(begin.time, span, &ends, &series, &motion));
            *step = (!is_whole).then_some([from, to]);
            if going == Going::Enough || state.time >= until {
                return Ok(going);
            }
            let (phi, omega) = (&state.y[..n], &state.y[n..2 * n]);
            if kernel.independence_at(mechanism, state.time, phi, omega).share() >= NEAR {
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
