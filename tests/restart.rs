//! Restart is bit for bit: a state cloned in the middle goes on as the run it was taken from.

use crate::common;

use common::{go, shipped};
use driftless::arithmetic::DoubleDouble;
use driftless::dynamics::canonical::Canonical;
use driftless::dynamics::elimination::Elimination;
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::{Form, Motion, State, Time};
use driftless::run::{MethodId, Problem, Request, Stabilization};
use driftless::stabilization::{Baumgarte, Projected};
use driftless::stepping::gauss::Gauss;
use driftless::stepping::{Dop853, Dopri5, Dp5, Dp8, Integrator, Seen, Statistics, Taylor, Tolerance};
use std::sync::Arc;

const TOLERANCE: Tolerance = Tolerance { relative: 1e-9, absolute: 1e-9 };
/// Output interval \[s\]; a power of two, so that it is a whole number of fixed steps.
const EVERY: f64 = 0.0625;

/// Forty intervals in one go, and in two halves by another method object and another form from a clone of the
/// state.
fn check<F: Problem + 'static, M: Integrator<dyn Problem>>(
    form: &dyn Fn() -> F,
    method: &dyn Fn() -> M,
    start: &Motion,
) {
    let (mut whole_form, mut whole_method) = (form(), method());
    let mut whole = whole_form.state(start);
    go(&mut whole_method, &mut whole_form, &mut whole, EVERY, 1..=20);
    let middle: State = whole.clone();
    go(&mut whole_method, &mut whole_form, &mut whole, EVERY, 21..=40);
    for _ in 0..2 {
        let mut rest = middle.clone();
        go(&mut method(), &mut form(), &mut rest, EVERY, 21..=40);
        // `State` compares time, unknowns, low parts, turns and memory; equal doubles and equal signs of zero
        // are equal bits here.
        assert_eq!(rest, whole, "{}", whole_method.name());
        assert!(rest.y.iter().zip(&whole.y).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}

#[test]
fn a_free_scene_goes_on_bit_for_bit() {
    let (mechanism, start) = common::started("free");
    let form = || Multiplier::<2, false>::new(Arc::clone(&mechanism));
    check(&form, &|| Dopri5::new(TOLERANCE), &start);
    check(&form, &|| Dop853::new(TOLERANCE), &start);
    check(&form, &|| Dp5::new(TOLERANCE), &start);
    check(&form, &|| Dp8::new(TOLERANCE), &start);
    check(&form, &|| Taylor::new(TOLERANCE), &start);
    check(
        &|| Canonical::<2, false>::new(Arc::clone(&mechanism)),
        &|| Gauss::new(8, 1.0 / 128.0).expect("a method"),
        &start,
    );
}

#[test]
fn a_driven_scene_goes_on_bit_for_bit_under_every_stabilization() {
    let (mechanism, mut start) = common::started("motor_sine");
    start.omega[0] = start.omega[0] + 1e-6;
    let plain = || Multiplier::<2, true>::new(Arc::clone(&mechanism));
    check(&plain, &|| Dop853::new(TOLERANCE), &start);
    check(&plain, &|| Projected::new(Dp8::new(TOLERANCE)), &start);
    check(&plain, &|| Projected::new(Dp5::new(TOLERANCE)), &start);
    check(&plain, &|| Projected::new(Taylor::new(TOLERANCE)), &start);
    check(&plain, &|| Taylor::new(TOLERANCE), &start);
    check(&|| Baumgarte::new(plain(), 0.1), &|| Dp8::new(TOLERANCE), &start);
    check(&|| Baumgarte::new(plain(), 0.1), &|| Dopri5::new(TOLERANCE), &start);
    check(&|| Elimination::<2>::new(Arc::clone(&mechanism)), &|| Dp8::new(TOLERANCE), &start);
    check(
        &|| Canonical::<2, true>::new(Arc::clone(&mechanism)),
        &|| Gauss::new(8, 1.0 / 128.0).expect("a method"),
        &start,
    );
}

#[test]
fn the_same_run_twice_gives_the_same_bits() {
    for (name, method, stabilize) in [
        ("free", MethodId::Dop853, Stabilization::None),
        ("spring", MethodId::Gauss(8), Stabilization::None),
        ("motor_sine", MethodId::Dp8, Stabilization::Projection),
        ("motor", MethodId::Dopri5, Stabilization::Baumgarte),
        ("wall", MethodId::Dp8, Stabilization::None),
        ("wall", MethodId::Taylor, Stabilization::None),
        ("motor_sine", MethodId::Taylor, Stabilization::Projection),
    ] {
        let request = Request {
            method: Some(method),
            stabilize: Some(stabilize),
            until: Some(0.5),
            every: Some(0.0625),
            ..Request::default()
        };
        let [first, second] = [(); 2].map(|()| common::run(&shipped(name, &[]), &request));
        assert_eq!(
            (&first.last, &first.statistics, &first.impacts),
            (&second.last, &second.statistics, &second.impacts),
            "{name}"
        );
        assert_eq!(first.drift, second.drift, "{name}");
    }
}

/// With all rates turned round a free scene runs back to its start; so does the adaptive method, to its
/// tolerance and what chaos makes of it in 4 s (Lyapunov exponent 1.55 per s: a factor of 500, twice).
#[test]
fn a_run_with_its_rates_turned_round_comes_back() {
    let (mechanism, start) = common::started("free");
    let mut form = Multiplier::<2, false>::new(Arc::clone(&mechanism));
    let mut method = Dp8::new(Tolerance { relative: 1e-13, absolute: 1e-13 });
    let mut state = form.state(&start);
    go(&mut method, &mut form, &mut state, 2.0, 1..=1);
    for i in 2..4 {
        (state.y[i], state.low[i]) = (-state.y[i], -state.low[i]);
    }
    (state.time, state.memory) = (Time::default(), Vec::new());
    go(&mut method, &mut form, &mut state, 2.0, 1..=1);
    let mut back = Motion::default();
    form.read(&state, &mut back);
    for k in 0..2 {
        let apart = (back.unwrapped(k) - start.unwrapped(k)).abs().max(back.omega[k].hi.abs());
        assert!(apart < 1e-9, "{apart:e}");
    }
}

/// Our Dormand–Prince methods integrate forwards; a time that lies behind is refused, never passed over in
/// silence.
#[test]
fn a_time_that_lies_behind_is_refused() {
    let (mechanism, start) = common::started("free");
    let mut form = Multiplier::<2, false>::new(Arc::clone(&mechanism));
    let methods: [Box<dyn Integrator<dyn Problem>>; 4] = [
        Box::new(Dp5::new(TOLERANCE)),
        Box::new(Dp8::new(TOLERANCE)),
        Box::new(Dopri5::new(TOLERANCE)),
        Box::new(Dop853::new(TOLERANCE)),
    ];
    for mut method in methods {
        let mut state = form.state(&start);
        state.time = DoubleDouble::from(1.0);
        let stop = method.advance(
            &mut form,
            &mut state,
            Time::from(0.5),
            &mut Statistics::default(),
            &mut |_, _| Ok(Seen::Kept),
        );
        let stop = stop.expect_err("a refusal");
        assert_eq!((stop.cause, stop.t), (driftless::stepping::Cause::Unsuited, 1.0), "{stop}");
    }
}
