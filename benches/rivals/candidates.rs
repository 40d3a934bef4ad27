//! What is compared.

use crate::by_hand::TwoBars;
use crate::problem::Problem;
use driftless::dynamics::elimination::Elimination;
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::{Form, Motion, State, Time};
use driftless::stepping::taylor::batch::{Batch, BatchMember, Going};
use driftless::stepping::{Dop853, Integrator, Seen, Taylor, Tolerance};
use std::sync::Arc;

/// All ends of a problem at a tolerance.
type Runner<'a> = Box<dyn FnMut(f64) -> Vec<Motion> + 'a>;

pub struct Candidate<'a> {
    pub name: String,
    pub run: Runner<'a>,
}

fn both(tolerance: f64) -> Tolerance {
    Tolerance { relative: tolerance, absolute: tolerance }
}

/// Everything that fits a problem.
pub fn all(problem: &Problem) -> Vec<Candidate<'_>> {
    let mut all: Vec<Candidate> =
        [None, Some(16), Some(20), Some(24)].into_iter().map(|order| taylor(problem, order)).collect();
    if Batch::takes(&problem.mechanism) {
        all.extend([16, 20, 24].map(|order| batch(problem, order)));
    }
    if problem.mechanism.bodies.len() == 2 {
        all.push(dop853(problem));
        if problem.mechanism.constraints.is_empty() && problem.mechanism.springs.is_empty() {
            let hand = TwoBars::of(&problem.mechanism);
            let each = move |integrate: fn(&TwoBars, &Motion, f64, f64) -> Motion| -> Runner {
                Box::new(move |tolerance| {
                    problem
                        .starts
                        .iter()
                        .map(|start| integrate(&hand, start, problem.until, tolerance))
                        .collect()
                })
            };
            all.push(Candidate {
                name: "ode_solvers Dop853, by hand".into(),
                run: each(TwoBars::ode_solvers),
            });
            all.push(Candidate { name: "differential-equations rkv988e".into(), run: each(TwoBars::verner) });
        }
    }
    all
}

/// One trajectory after the other, of an order or of the order the tolerance asks for.
pub fn taylor(problem: &Problem, order: Option<usize>) -> Candidate<'_> {
    let mut form = Elimination::<0>::new(Arc::clone(&problem.mechanism));
    let starts = problem.states();
    let mut method = Taylor::new(both(1e-9));
    let run = move |tolerance: f64| {
        let order = order.unwrap_or_else(|| Taylor::new(both(tolerance)).order);
        if (order, tolerance) != (method.order, method.tolerance) {
            method = Taylor::with_order(tolerance, order);
        }
        ends(&mut form, &starts, |form, state| {
            let mut statistics = Default::default();
            method
                .advance(form, state, Time::from(problem.until), &mut statistics, &mut |_, _| Ok(Seen::Kept))
                .is_ok()
        })
    };
    let name = order.map_or("taylor".into(), |order| format!("taylor, order {order}"));
    Candidate { name, run: Box::new(run) }
}

/// All trajectories at once.
pub fn batch(problem: &Problem, order: usize) -> Candidate<'_> {
    let mut form = Elimination::<0>::new(Arc::clone(&problem.mechanism));
    let starts = problem.states();
    let run = move |tolerance: f64| {
        let mut members: Vec<BatchMember> =
            starts.iter().map(|start| BatchMember::new(&problem.mechanism, start.clone())).collect();
        Batch::new(both(tolerance)).with_order(order).integrate(
            &mut members,
            Time::from(problem.until),
            &mut |_, _| Going::On,
        );
        let states: Vec<State> = members.into_iter().map(|member| member.state).collect();
        ends(&mut form, &states, |_, _| true)
    };
    Candidate { name: format!("taylor, order {order}, in lanes"), run: Box::new(run) }
}

/// `dop853` as the program runs it, one window to the end.
fn dop853(problem: &Problem) -> Candidate<'_> {
    let (mut multiplier, mut elimination) = (
        Multiplier::<2, false>::new(Arc::clone(&problem.mechanism)),
        Elimination::<2>::new(Arc::clone(&problem.mechanism)),
    );
    let run = move |tolerance: f64| {
        let mut method = Dop853::new(both(tolerance));
        let (until, mut statistics) = (Time::from(problem.until), Default::default());
        if problem.mechanism.constraints.is_empty() {
            let starts: Vec<State> = problem.starts.iter().map(|start| multiplier.state(start)).collect();
            ends(&mut multiplier, &starts, |form, state| {
                method.advance(form, state, until, &mut statistics, &mut |_, _| Ok(Seen::Kept)).is_ok()
            })
        } else {
            let starts = problem.states();
            ends(&mut elimination, &starts, |form, state| {
                method.advance(form, state, until, &mut statistics, &mut |_, _| Ok(Seen::Kept)).is_ok()
            })
        }
    };
    Candidate { name: "dop853".into(), run: Box::new(run) }
}

/// The motions at the ends of the integrations.
fn ends<F: Form>(
    form: &mut F,
    starts: &[State],
    mut integrate: impl FnMut(&mut F, &mut State) -> bool,
) -> Vec<Motion> {
    starts
        .iter()
        .map(|start| {
            let mut state = start.clone();
            assert!(integrate(form, &mut state), "an integration stopped");
            let mut motion = Motion::default();
            form.read(&state, &mut motion);
            motion
        })
        .collect()
}
