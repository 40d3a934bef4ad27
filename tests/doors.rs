//! Events and observers from outside the crate.

use super::common::shipped;
use driftless::dynamics::OdeSystem;
use driftless::run::{Action, Change, Direction, Event, EventRecord, Observer, Step};
use driftless::scene::{Given, Load, Lock, Output, Parameter, Place, Spring, TorsionSpring};
use driftless::stepping::composition::Composition;
use driftless::{
    Configuration, Custom, Integrator, Level, Limits, Mechanism, MethodId, Motion, Outcome, Plan, Problem,
    Request, Run, Running, Sample, Scalar, Scene, SceneBuilder, Simulation, Site, Stabilization, State,
    Statistics, StepError, Time, ground, on,
};
use std::ops::ControlFlow;
use std::sync::Arc;

/// An event function of time and configuration with a direction and what it does.
struct When<V, A>(&'static str, Direction, V, A);

impl<V, A> Event for When<V, A>
where
    V: Fn(&Configuration<f64>) -> f64 + Send + Sync,
    A: FnMut(&Motion) -> Action + Send + Sync,
{
    fn name(&self) -> &str {
        self.0
    }

    fn value(&self, at: &Configuration<f64>) -> f64 {
        self.2(at)
    }

    fn direction(&self) -> Direction {
        self.1
    }

    fn action(&mut self, _at: &Configuration<f64>, motion: &Motion) -> Action {
        self.3(motion)
    }
}

fn record(
    name: &'static str,
    direction: Direction,
    value: impl Fn(&Configuration<f64>) -> f64 + Send + Sync + 'static,
) -> Box<dyn Event> {
    Box::new(When(name, direction, value, |_: &Motion| Action::Record))
}

fn every_method() -> Vec<Request> {
    let adaptive = |method, rtol| Request {
        method: Some(method),
        rtol: Some(rtol),
        atol: Some(rtol),
        ..Request::default()
    };
    let fixed = |method| Request { method: Some(method), step: Some(0.01), ..Request::default() };
    vec![
        adaptive(MethodId::Dopri5, 1e-9),
        adaptive(MethodId::Dop853, 1e-11),
        adaptive(MethodId::Dp5, 1e-9),
        adaptive(MethodId::Dp8, 1e-12),
        adaptive(MethodId::Taylor, 1e-13),
        adaptive(MethodId::Radau(3), 1e-10),
        adaptive(MethodId::Radau(5), 1e-12),
        fixed(MethodId::Gauss(8)),
        fixed(MethodId::Rattle(Composition::KahanLi17)),
    ]
}

/// A body that hangs on nothing, at a height \[m\].
fn ball(height: f64, until: f64) -> Scene {
    SceneBuilder::new("ball")
        .gravity([0.0, -9.81])
        .body("ball", 2.0, [0.0, 0.0], 0.1, 0.1)
        .start("ball", 0.0, 0.0)
        .with("origin", vec![0.0, height])
        .with("velocity", vec![0.0, 0.0])
        .until(until, until)
        .build()
        .expect("a scene")
}

#[test]
fn a_bouncing_ball_meets_the_ground_when_its_closed_form_says() {
    let (height, restitution, gravity) = (1.0_f64, 0.8, 9.81);
    let first = (2.0 * height / gravity).sqrt();
    let times: Vec<f64> =
        (0..8).map(|k| (0..k).fold(first, |t, j| t + 2.0 * first * f64::powi(restitution, j + 1))).collect();
    for request in every_method() {
        let method = request.method.expect("a method");
        if !method.is_adaptive() {
            continue;
        }
        let simulation = Simulation::new(&ball(height, times[7] + 0.01)).expect("equations").options(request);
        let site = simulation.site("ball", [0.0, 0.0]).expect("a point");
        let bounce = move |motion: &Motion| {
            let mut after = motion.clone();
            after.omega[2] = after.omega[2].scale(-restitution);
            Action::Change(Change::default().to(after))
        };
        let event =
            When("ground", Direction::Falling, move |at: &Configuration<f64>| at.position(&site)[1], bounce);
        let outcome = simulation.event(event).run().expect("a run");
        assert_eq!(outcome.stop, None, "{method}");
        assert_eq!(outcome.event_count, 8, "{method}");
        for (found, expected) in outcome.events.iter().zip(&times) {
            assert!((found.t - expected).abs() < 3e-9, "{method}: {} {expected}", found.t);
        }
        let lost: f64 = (0..8)
            .map(|k| {
                2.0 * gravity * height * f64::powi(restitution, 2 * k) * (1.0 - restitution * restitution)
            })
            .sum();
        assert!(
            (outcome.event_energy + lost).abs() < 1e-7 * lost,
            "{method}: {} {lost}",
            outcome.event_energy
        );
        assert!(
            outcome.drift.energy.max < 1e-8,
            "{method}: the balance drifts by {:e}",
            outcome.drift.energy.max
        );
    }
}

/// A bar turned by a motor at 2 rad/s with another one on it: times at which it points somewhere are known.
fn turned() -> Scene {
    SceneBuilder::new("turned")
        .gravity([0.0, -9.81])
        .bar("crank", 0.4, 0.5)
        .bar("arm", 0.6, 0.5)
        .hinge("A", ground([0.0, 0.0]), on("crank", [0.0, 0.0]))
        .hinge("B", on("crank", [0.4, 0.0]), on("arm", [0.0, 0.0]))
        .motor("motor", "crank", 0.1, 2.0)
        .start("arm", 0.3, 1.0)
        .until(4.0, 0.5)
        .build()
        .expect("a scene")
}

#[test]
fn events_are_located_by_every_method_in_order_and_several_in_a_step() {
    let pi = std::f64::consts::PI;
    for request in every_method() {
        let method = request.method.expect("a method");
        let simulation = Simulation::new(&turned()).expect("equations").options(request);
        let tip = simulation.site("crank", [0.4, 0.0]).expect("a point");
        let tip_again = tip.clone();
        let events = vec![
            record("up", Direction::Rising, move |at| at.position(&tip)[1]),
            record("across", Direction::Either, move |at| at.position(&tip_again)[0]),
            // Two zeros a ten-thousandth of a second apart, and a touch that is none.
            record("twice", Direction::Either, |at| (at.time() - 1.2345) * (at.time() - 1.2345) - 2.5e-9),
            record("never", Direction::Either, |at| (at.time() - 2.5) * (at.time() - 2.5) + 1e-9),
            record("clock", Direction::Rising, |at| at.time() - 3.0),
        ];
        let outcome = events.into_iter().fold(simulation, Simulation::boxed_event).run().expect("a run");
        assert_eq!(outcome.stop, None, "{method}");
        let found = |name: &str| {
            outcome.events.iter().filter(|event| event.name == name).map(|event| event.t).collect::<Vec<_>>()
        };
        let near = |name: &str, expected: &[f64], bound: f64| {
            let found = found(name);
            assert_eq!(found.len(), expected.len(), "{method}, {name}: {found:?} {expected:?}");
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < bound, "{method}, {name}: {found} {expected}");
            }
        };
        near("up", &[(2.0 * pi - 0.1) / 2.0], 1e-10);
        near("across", &[(0.5 * pi - 0.1) / 2.0, (1.5 * pi - 0.1) / 2.0, (2.5 * pi - 0.1) / 2.0], 1e-10);
        near("twice", &[1.2345 - 5e-5, 1.2345 + 5e-5], 1e-9);
        near("never", &[], 0.0);
        near("clock", &[3.0], 1e-13);
        assert!(outcome.events.windows(2).all(|pair| pair[0].t <= pair[1].t), "{method}");
    }
}

fn crossings(every: f64, pause_every: Option<u64>) -> (Outcome, Vec<EventRecord>) {
    let mut scene = turned();
    scene.every = every;
    let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
    let tip = mechanism.site("arm", [0.6, 0.0]).expect("a point");
    let events = move || -> Vec<Box<dyn Event>> {
        let tip = tip.clone();
        let kick = |motion: &Motion| {
            let mut after = motion.clone();
            after.omega[1] = after.omega[1].scale(0.9);
            Action::Change(Change::default().to(after))
        };
        vec![Box::new(When(
            "level",
            Direction::Either,
            move |at: &Configuration<f64>| at.position(&tip)[1] - 0.2,
            kick,
        ))]
    };
    let request = Request { method: Some(MethodId::Dp8), ..Request::default() };
    let plan = Plan::new(&scene, &mechanism, &request).expect("a plan");
    let start = mechanism.start(&scene);
    let run = Run::new(Arc::clone(&mechanism), plan, Limits::default(), &start).expect("a run");
    let mut running = Running::new(run.with_events(events()));
    let mut asked = 0;
    loop {
        let mut pause = || {
            asked += 1;
            pause_every.is_some_and(|every| asked % every == 0)
        };
        if running.go(&mut |_| Ok(()), &mut pause).expect("samples") {
            break;
        }
        running = Running::resume(Arc::clone(&mechanism), &start, running.snapshot())
            .expect("the same")
            .with_events(events())
            .expect("the same");
    }
    let outcome = running.finish();
    let events = outcome.events.clone();
    (outcome, events)
}

#[test]
fn neither_output_times_nor_pauses_change_events_or_what_they_do() {
    let (outcome, events) = crossings(0.5, None);
    assert!(events.len() >= 4 && outcome.stop.is_none(), "{events:?} {:?}", outcome.stop);
    for (every, pause) in [(0.01, None), (4.0, None), (0.5, Some(1)), (0.01, Some(7))] {
        let (other, found) = crossings(every, pause);
        assert_eq!(
            (&events, &outcome.last.phi, &outcome.last.omega),
            (&found, &other.last.phi, &other.last.omega),
            "{every} {pause:?}"
        );
        assert_eq!(outcome.statistics, other.statistics);
    }
}

#[test]
fn a_spring_that_is_switched_off_leaves_the_motion_it_made_and_takes_its_energy() {
    let scene = driftless::read_scene("examples/scenes/spring.json".as_ref(), &[]).expect("a scene");
    let name = scene.springs[0].name.clone();
    let off = |t: f64| {
        let name = name.clone();
        let action = move |_: &Motion| Action::Change(Change::default().switch(&name, false));
        When("off", Direction::Rising, move |at: &Configuration<f64>| at.time() - t, action)
    };
    let taylor = Request {
        method: Some(MethodId::Taylor),
        rtol: Some(1e-14),
        until: Some(2.0),
        every: Some(0.5),
        ..Request::default()
    };
    let outcome = Simulation::new(&scene)
        .expect("equations")
        .options(taylor.clone())
        .event(off(0.7))
        .run()
        .expect("a run");
    // By hand: to 0.7 s with the spring, and from there without.
    let first = Request { until: Some(0.7), every: Some(0.7), ..taylor.clone() };
    let before = Simulation::new(&scene).expect("equations").options(first).run().expect("a run");
    let mut without = scene.clone();
    without.springs.clear();
    for (start, (phi, omega)) in without.start.iter_mut().zip(before.last.phi.iter().zip(&before.last.omega))
    {
        (start.phi, start.omega) = (*phi, *omega);
    }
    let rest = Request { until: Some(1.3), every: Some(1.3), ..taylor };
    let after = Simulation::new(&without).expect("equations").options(rest).run().expect("a run");
    for (a, b) in
        outcome.last.phi.iter().chain(&outcome.last.omega).zip(after.last.phi.iter().chain(&after.last.omega))
    {
        assert!((a - b).abs() < 1e-11, "{a} {b}");
    }
    let lost = after.last.kinetic + after.last.potential - before.last.kinetic - before.last.potential;
    assert!((outcome.event_energy - lost).abs() < 1e-11, "{} {lost}", outcome.event_energy);
    assert!(outcome.drift.energy.max < 1e-12, "{:e}", outcome.drift.energy.max);
}

#[test]
fn what_an_event_must_not_do_is_refused_with_its_name() {
    let stopped = |request: Request, change: fn(&Motion) -> Change| {
        let action = move |motion: &Motion| Action::Change(change(motion));
        let event = When("kick", Direction::Rising, |at: &Configuration<f64>| at.time() - 1.0, action);
        let outcome = Simulation::new(&turned())
            .expect("equations")
            .options(request)
            .event(event)
            .run()
            .expect("a run");
        outcome.stop.expect("a stop")
    };
    let by = |method| Request { method: Some(method), ..Request::default() };
    let faster = |motion: &Motion| {
        let mut after = motion.clone();
        after.omega[0] = after.omega[0] + after.omega[0];
        Change::default().to(after)
    };
    let stop = stopped(Request { step: Some(0.01), ..by(MethodId::Gauss(4)) }, faster);
    assert!(stop.what.contains("kick") && stop.what.contains("leaves constraint motor"), "{stop}");
    let stop = stopped(by(MethodId::Dp8), faster);
    assert!(stop.what.contains("leaves constraint motor"), "{stop}");
    let stop = stopped(by(MethodId::Dp8), |_| Change::default().switch("motor", false));
    assert!(stop.what.contains("switches `motor`"), "{stop}");
}

#[test]
fn a_run_that_an_event_ends_is_no_failure_and_ends_there() {
    for request in every_method() {
        let method = request.method.expect("a method");
        let event = When(
            "enough",
            Direction::Rising,
            |at: &Configuration<f64>| at.angle(0) - 4.0,
            |_: &Motion| Action::Stop,
        );
        let outcome = Simulation::new(&turned())
            .expect("equations")
            .options(request)
            .event(event)
            .run()
            .expect("a run");
        assert_eq!((outcome.stop, outcome.ended_by.as_deref()), (None, Some("enough")), "{method}");
        assert!(
            (outcome.last.t - 1.95).abs() < 1e-9 && (outcome.last.phi[0] - 4.0).abs() < 1e-9,
            "{method}: {}",
            outcome.last.t
        );
    }
}

/// Counts, and has enough after so many.
struct Counter {
    steps: u64,
    samples: u64,
    most_samples: u64,
    last: f64,
    tip: Site,
}

impl Observer for Counter {
    fn step(&mut self, step: &mut Step) -> ControlFlow<()> {
        assert_eq!(step.begin(), self.last);
        let middle = 0.5 * (step.begin() + step.end());
        // The motor's angle is known at every time.
        let phi = step.at(middle).unwrapped(0);
        assert!((phi - 0.1 - 2.0 * middle).abs() < 1e-9, "{phi} at {middle}");
        (self.last, self.steps) = (step.end(), self.steps + 1);
        ControlFlow::Continue(())
    }

    fn sample(&mut self, sample: &Sample) -> ControlFlow<()> {
        assert!(self.tip.body.is_some() && sample.t >= 0.0);
        self.samples += 1;
        if self.samples == self.most_samples { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[test]
fn an_observer_sees_every_step_and_sample_and_may_end_the_run() {
    for request in every_method() {
        let method = request.method.expect("a method");
        for most_samples in [4, u64::MAX] {
            let simulation = Simulation::new(&turned()).expect("equations").options(request.clone());
            let tip = simulation.site("arm", [0.6, 0.0]).expect("a point");
            let mut counter = Counter { steps: 0, samples: 0, most_samples, last: 0.0, tip };
            let outcome = simulation.run_observed(&mut counter).expect("a run");
            if most_samples == 4 {
                assert_eq!(
                    (counter.samples, outcome.last.t, outcome.ended_by.as_deref()),
                    (4, 1.5, Some("observer")),
                    "{method}"
                );
            } else {
                assert_eq!((counter.samples, outcome.ended_by), (9, None), "{method}");
                let windows = matches!(method, MethodId::Dopri5 | MethodId::Dop853);
                assert!(
                    windows || counter.steps == outcome.statistics.steps,
                    "{method}: {} {}",
                    counter.steps,
                    outcome.statistics.steps
                );
            }
        }
    }
}

#[test]
fn runs_may_go_to_other_threads() {
    fn is_send<T: Send>() {}
    is_send::<Run>();
    is_send::<Running>();
    is_send::<Outcome>();
    is_send::<Simulation>();
    let scene = turned();
    let simulation = Simulation::new(&scene).expect("equations").trust(Level::Auto).until(1.0);
    let elsewhere = std::thread::spawn(move || simulation.run().expect("a run").last.phi);
    let here = Simulation::new(&scene)
        .expect("equations")
        .trust(Level::Auto)
        .until(1.0)
        .run()
        .expect("a run")
        .last
        .phi;
    assert_eq!(elsewhere.join().expect("a result"), here);
}

/// The classical method of Runge (1895) and Kutta (1901): four stages, order 4.
pub struct Rk4 {
    step: f64,
    stages: [Vec<f64>; 5],
}

impl Rk4 {
    pub fn boxed(step: f64) -> Box<dyn Integrator<dyn Problem> + Send> {
        Box::new(Self { step, stages: Default::default() })
    }
}

impl<P: OdeSystem + ?Sized> Integrator<P> for Rk4 {
    fn name(&self) -> &'static str {
        "rk4"
    }

    fn order(&self) -> u32 {
        4
    }

    fn begin(&mut self, problem: &mut P, state: &mut State, _until: Time) -> Result<(), StepError> {
        assert_eq!(problem.dimension(), state.y.len());
        self.stages.iter_mut().for_each(|stage| stage.resize(state.y.len(), 0.0));
        Ok(())
    }

    fn step(
        &mut self,
        problem: &mut P,
        state: &mut State,
        until: Time,
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError> {
        let left = (until - state.time).hi;
        let h = if left < 1.5 * self.step { left } else { self.step };
        let (start, [k1, k2, k3, k4, y]) = (state.y.clone(), &mut self.stages);
        let moved = |y: &mut Vec<f64>, k: &[f64], h: f64| {
            y.iter_mut().zip(&start).zip(k).for_each(|((y, start), k)| *y = start + h * k)
        };
        problem.rhs(state.time, &start, k1);
        moved(y, k1, 0.5 * h);
        problem.rhs(state.time + 0.5 * h, y, k2);
        moved(y, k2, 0.5 * h);
        problem.rhs(state.time + 0.5 * h, y, k3);
        moved(y, k3, h);
        problem.rhs(state.time + h, y, k4);
        for i in 0..start.len() {
            state.y[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
        state.time = if h == left { until } else { state.time + h };
        state.wrap();
        (statistics.steps, statistics.evaluations) = (statistics.steps + 1, statistics.evaluations + 4);
        Ok(None)
    }
}

#[test]
fn an_integrator_from_outside_is_driven_like_the_others() {
    for name in ["free", "spring", "motor", "four_bars"] {
        let scene =
            driftless::read_scene(format!("examples/scenes/{name}.json").as_ref(), &[]).expect("a scene");
        let simulation = || Simulation::new(&scene).expect("equations").until(0.5).every(0.1);
        let exact = simulation().method(MethodId::Taylor).tolerance(1e-14, 1e-14).run().expect("a run");
        let run = |step: f64| {
            let custom = Custom::new("rk4", move || Rk4::boxed(step));
            simulation().integrator(custom).trust(Level::Auto).run().expect("a run")
        };
        let error = |outcome: &Outcome| {
            assert_eq!(outcome.stop, None, "{name}");
            outcome
                .last
                .phi
                .iter()
                .zip(&exact.last.phi)
                .fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()))
        };
        let (coarse, fine) = (run(2e-3), run(1e-3));
        let order = (error(&coarse) / error(&fine)).log2();
        assert!((order - 4.0).abs() < 0.35, "{name}: order {order}");
        // Drift, estimate and counts come with it.
        assert!(fine.drift.energy.max > 0.0 && fine.drift.energy.max < coarse.drift.energy.max, "{name}");
        let estimate = coarse.trust.as_ref().and_then(|trust| trust.error_estimate).expect("an estimate");
        assert!(
            estimate > error(&coarse) / 3.0 && estimate < 10.0 * error(&coarse),
            "{name}: {estimate:e} for {:e}",
            error(&coarse)
        );
        assert_eq!(
            (coarse.statistics.steps, coarse.statistics.evaluations, coarse.plan.method.to_string()),
            (250, 1000, "custom".into()),
            "{name}"
        );
    }
}

/// Walls are met where a method locates them, and one from outside that does not is told what it has to do.
#[test]
fn an_integrator_from_outside_has_to_locate_impacts() {
    let scene = driftless::read_scene("examples/scenes/wall.json".as_ref(), &[]).expect("a scene");
    let simulation = Simulation::new(&scene).expect("equations");
    let stop = simulation.integrator(Custom::new("rk4", || Rk4::boxed(1e-3))).run().expect("a run").stop;
    let stop = stop.expect("the ground is passed");
    assert_eq!(stop.cause, driftless::stepping::Cause::WallPassed);
    assert!(stop.hint.contains("integrator from outside") && stop.hint.contains("`step`"), "{}", stop.hint);
}

/// The same, which takes whole steps only and calls the last one before an output time its end.
struct Early(Rk4);

impl<P: OdeSystem + ?Sized> Integrator<P> for Early {
    fn name(&self) -> &'static str {
        "early"
    }

    fn order(&self) -> u32 {
        4
    }

    fn begin(&mut self, problem: &mut P, state: &mut State, until: Time) -> Result<(), StepError> {
        self.0.begin(problem, state, until)
    }

    fn step(
        &mut self,
        problem: &mut P,
        state: &mut State,
        _until: Time,
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError> {
        let end = state.time + self.0.step;
        self.0.step(problem, state, end, statistics)
    }

    fn is_at(&self, state: &State, until: Time) -> bool {
        (until - state.time).hi < self.0.step
    }
}

#[test]
fn a_method_that_ends_beside_its_output_times_is_stopped() {
    let scene = driftless::read_scene("examples/scenes/free.json".as_ref(), &[]).expect("a scene");
    for (step, misses) in [(3e-3, true), (1.0 / 512.0, false)] {
        let custom = Custom::new("early", move || {
            let rk4 = Rk4 { step, stages: Default::default() };
            Box::new(Early(rk4)) as Box<dyn Integrator<dyn Problem> + Send>
        });
        let simulation = Simulation::new(&scene).expect("equations").until(0.5).every(0.125);
        let outcome = simulation.integrator(custom).run().expect("a run");
        match outcome.stop {
            Some(stop) if misses => {
                assert_eq!((stop.cause, stop.t), (driftless::stepping::Cause::Unsuited, outcome.last.t))
            }
            stop => assert!(stop.is_none() && !misses, "step {step}: {stop:?}"),
        }
    }
}

#[test]
fn a_run_by_an_integrator_from_outside_goes_on_to_the_same_bits() {
    let scene = driftless::read_scene("examples/scenes/spring.json".as_ref(), &[]).expect("a scene");
    let custom = || Custom::new("rk4", || Rk4::boxed(1e-3));
    let simulation =
        || Simulation::new(&scene).expect("equations").until(0.5).every(0.1).integrator(custom());
    let whole = simulation().run().expect("a run");
    let (mechanism, start) = (Arc::clone(simulation().mechanism()), simulation().start());
    let mut running = Running::new(simulation().prepare().expect("a run"));
    let mut asked = 0;
    let is_over = running.go(&mut |_| Ok(()), &mut || {
        asked += 1;
        asked == 123
    });
    assert!(!is_over.expect("samples"));
    // As a file would hold it: without the integrator.
    let text = serde_json::to_string(&running.snapshot()).expect("text");
    let kept = || serde_json::from_str::<driftless::Snapshot>(&text).expect("a snapshot");
    let refused = Running::resume(Arc::clone(&mechanism), &start, kept()).err().expect("a refusal");
    assert!(refused.to_string().contains("from outside the crate"), "{refused}");
    let mut snapshot = kept();
    snapshot.integrated_by(custom());
    let mut rest = Running::resume(mechanism, &start, snapshot).expect("the same");
    assert!(rest.go(&mut |_| Ok(()), &mut || false).expect("samples"));
    let rest = rest.finish();
    assert_eq!((rest.last, rest.statistics), (whole.last, whole.statistics));
}

#[test]
fn a_trajectory_is_the_motion_at_every_time_by_every_method() {
    let exact = |t: f64| {
        let simulation = Simulation::new(&turned())
            .expect("equations")
            .until(t)
            .every(t)
            .method(MethodId::Taylor)
            .tolerance(1e-15, 1e-15);
        let last = simulation.run().expect("a run").last;
        (last.phi, last.omega)
    };
    let times = [0.013, 0.5, 0.777_7, 1.234_5, 1.999];
    let expected = times.map(exact);
    for request in every_method() {
        let method = request.method.expect("a method");
        let request = Request { until: Some(2.0), ..request };
        let trajectory =
            Simulation::new(&turned()).expect("equations").options(request).trajectory().expect("a run");
        for (t, (phi, omega)) in times.iter().zip(&expected) {
            let (found, rates) = trajectory.at(*t).expect("within the run");
            let off = found
                .iter()
                .zip(phi)
                .chain(rates.iter().zip(omega))
                .fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            assert!(off < 1e-7, "{method} at {t}: {off:e}");
        }
        assert!(trajectory.at(-0.1).is_none() && trajectory.at(2.1).is_none(), "{method}");
        assert!(trajectory.times().count() as u64 >= 1, "{method}");
    }
}

/// The end of each step, and the motion a third of the way through the one after it.
struct Thirds(Vec<(f64, Vec<f64>)>);

impl Observer for Thirds {
    fn step(&mut self, step: &mut Step) -> ControlFlow<()> {
        let t = step.begin() + (step.end() - step.begin()) / 3.0;
        let motion = step.at(t).clone();
        let angles = (0..motion.phi.len())
            .map(|k| motion.unwrapped(k))
            .chain(motion.omega.iter().map(|omega| omega.hi));
        self.0.push((t, angles.collect()));
        ControlFlow::Continue(())
    }
}

#[test]
fn every_method_gives_the_motion_inside_its_steps_as_well_as_at_their_ends() {
    let scene = driftless::read_scene("examples/scenes/four_bars.json".as_ref(), &[]).expect("a scene");
    let simulation = || Simulation::new(&scene).expect("equations").until(0.5).every(0.25);
    let fixed =
        |method: MethodId| simulation().method(method).step(1.0 / 64.0).stabilize(Stabilization::Projection);
    let tolerant = |method: MethodId| simulation().method(method).tolerance(1e-11, 1e-11);
    for (name, simulation, bound) in [
        ("gauss8", fixed(MethodId::Gauss(4)), 1e-10),
        ("rattle8", fixed(MethodId::Rattle(Composition::KahanLi17)), 1e-8),
        ("dopri5", tolerant(MethodId::Dopri5), 1e-8),
        ("dop853", tolerant(MethodId::Dop853), 1e-8),
    ] {
        let mut thirds = Thirds(Vec::new());
        simulation.run_observed(&mut thirds).expect("a run");
        assert!(thirds.0.len() > 8, "{name}: {} steps", thirds.0.len());
        for (t, values) in thirds.0.iter().step_by(thirds.0.len() / 8) {
            let exact = Simulation::new(&scene)
                .expect("equations")
                .until(*t)
                .every(*t)
                .method(MethodId::Taylor)
                .tolerance(1e-14, 1e-14);
            let last = exact.run().expect("a run").last;
            let off = values
                .iter()
                .zip(last.phi.iter().chain(&last.omega))
                .fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            assert!(off < bound, "{name}: {off:e} at {t} s");
        }
    }
}

#[test]
fn a_pause_between_two_output_times_of_a_window_changes_no_bit() {
    let scene = driftless::read_scene("examples/scenes/free.json".as_ref(), &[]).expect("a scene");
    for method in [MethodId::Dopri5, MethodId::Dop853] {
        let simulation = || {
            Simulation::new(&scene)
                .expect("equations")
                .until(20.0)
                .every(10.0)
                .method(method)
                .tolerance(1e-9, 1e-9)
        };
        let whole = simulation().run().expect("a run");
        for after in [1, 7, 100] {
            let (mechanism, start) = (Arc::clone(simulation().mechanism()), simulation().start());
            let mut running = Running::new(simulation().prepare().expect("a run"));
            let mut asked = 0;
            let is_over = running.go(&mut |_| Ok(()), &mut || {
                asked += 1;
                asked == after
            });
            assert!(!is_over.expect("samples"), "{method}");
            let text = serde_json::to_string(&running.snapshot()).expect("text");
            let mut rest =
                Running::resume(mechanism, &start, serde_json::from_str(&text).expect("a snapshot"))
                    .expect("the same");
            assert!(rest.go(&mut |_| Ok(()), &mut || false).expect("samples"));
            let rest = rest.finish();
            assert_eq!(
                (rest.last, rest.statistics),
                (whole.last.clone(), whole.statistics),
                "{method} after {after} steps"
            );
        }
    }
}

#[test]
fn a_spring_that_loses_its_length_inside_a_step_is_found_by_every_method() {
    // A ball that falls 1 m onto the other end of its spring, whose pull is nothing beside its weight: after
    // sqrt(2/g).
    let text = r#"{"name": "through", "gravity": [0, -9.81], "bars": [{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.1}],
        "springs": [{"name": "thread", "between": [{"body": "ground", "point": [0, 0]}, {"body": "ball", "point": [0, 0]}], "stiffness": 1e-9, "free_length": 0.3, "damping": 0}],
        "start": {"ball": {"phi": 0, "omega": 0, "origin": [0, 1], "velocity": [0, 0]}}, "until": 0.6, "every": 0.6}"#;
    let scene = driftless::parse_scene(text, "through", &[]).expect("a scene");
    let time = (2.0_f64 / 9.81).sqrt();
    let simulation = || Simulation::new(&scene).expect("equations");
    for (name, simulation) in [
        ("taylor", simulation().method(MethodId::Taylor)),
        ("dp8", simulation().method(MethodId::Dp8)),
        ("dopri5", simulation().method(MethodId::Dopri5)),
        ("dop853", simulation().method(MethodId::Dop853)),
        ("gauss8", simulation().method(MethodId::Gauss(4)).step(0.02)),
        ("rattle4", simulation().method(MethodId::Rattle(Composition::Suzuki5)).step(0.02)),
    ] {
        let stop = simulation.run().expect("a run").stop.unwrap_or_else(|| panic!("{name}: it went through"));
        assert_eq!(stop.cause.word(), "spring_without_length", "{name}: {stop}");
        assert!((stop.t - time).abs() < 1e-6, "{name}: {} for {time}", stop.t);
    }
}

/// A ball dropped from 1 m.
fn dropped_ball(gravity: f64) -> Simulation {
    let scene = SceneBuilder::new("ball")
        .gravity([0.0, -gravity])
        .body("b", 1.0, [0.0, 0.0], 0.1, 0.1)
        .start("b", 0.0, 0.0)
        .with("origin", vec![0.0, 1.0])
        .with("velocity", vec![0.3, 0.0])
        .until(6.0, 0.5)
        .build()
        .expect("a scene");
    Simulation::new(&scene).expect("equations")
}

/// Its event at the ground, which changes its rate by a factor.
fn bounce(factor: f64, direction: Direction) -> Box<dyn Event> {
    let site = dropped_ball(9.81).site("b", [0.0, 0.0]).expect("a body");
    Box::new(When(
        "ground",
        direction,
        move |at: &Configuration<f64>| at.position(&site)[1],
        move |motion: &Motion| {
            let mut next = motion.clone();
            next.omega[2] = next.omega[2].scale(factor);
            Action::Change(Change::default().to(next))
        },
    ))
}

fn dropped(factor: f64, direction: Direction, request: Request) -> Outcome {
    dropped_ball(9.81).options(request).boxed_event(bounce(factor, direction)).run().expect("a run")
}

/// Bounces end at t1 (1 + e)/(1 - e), t1 = sqrt(2 h/g): a run that cannot tell them apart any more stops there, and
/// does not fall through the ground.
#[test]
fn events_that_accumulate_stop_the_run() {
    for (request, direction) in
        every_method().into_iter().zip([Direction::Either, Direction::Falling].into_iter().cycle())
    {
        let method = request.method;
        if matches!(method, Some(MethodId::Rattle(_))) {
            continue;
        }
        for restitution in [0.5_f64, 0.8] {
            let found = dropped(-restitution, direction, request.clone());
            let end = (2.0_f64 / 9.81).sqrt() * (1.0 + restitution) / (1.0 - restitution);
            let stop = found.stop.as_ref().map(ToString::to_string).unwrap_or_default();
            assert!(stop.contains("`ground` comes true again"), "{method:?} {restitution}: {stop}");
            assert!((found.last.t - end).abs() < 1e-5, "{method:?}: {} for {end}", found.last.t);
            assert!(found.last.phi[2].abs() < 1e-9, "{method:?}: {:?}", found.last.phi);
            // Each rate is the one before times e, down to where a bounce is shorter than times can tell.
            assert!(found.event_count > 15, "{method:?}: {}", found.event_count);
        }
    }
    // What is only slowed down goes on through the ground, which happens once.
    let through =
        dropped(0.5, Direction::Either, Request { method: Some(MethodId::Taylor), ..Request::default() });
    let impact = (2.0_f64 / 9.81).sqrt();
    let rest = 6.0 - impact;
    let expected = -0.5 * 9.81 * impact * rest - 0.5 * 9.81 * rest * rest;
    assert_eq!((through.event_count, through.stop.is_none()), (1, true));
    assert!((through.last.phi[2] - expected).abs() < 1e-10, "{:?}", through.last.phi);
}

/// However slowly the ball is thrown back, it does not fall through the ground.
#[test]
fn a_return_that_is_too_soon_is_told_at_any_rate() {
    for request in every_method() {
        let method = request.method;
        if matches!(method, Some(MethodId::Rattle(_))) {
            continue;
        }
        for power in 3..13 {
            let bounce = bounce(-(10.0_f64.powi(-power)), Direction::Either);
            let found = dropped_ball(8.0).options(request.clone()).boxed_event(bounce).run().expect("a run");
            let stop = found.stop.as_ref().map(ToString::to_string).unwrap_or_default();
            assert!(stop.contains("`ground` comes true again"), "{method:?} 1e-{power}: {stop}");
            // One more bounce, of 2 v/g, where it can be told.
            assert!((found.last.t - 0.5).abs() < 1.1 * 10.0_f64.powi(-power) + 1e-7, "{method:?}: {stop}");
        }
    }
}

/// To which side an event leaves zero is remembered where the run pauses at it: a ball that falls 1 m in half a
/// second, and is thrown back so slowly that it cannot be seen to leave the ground.
#[test]
fn an_event_that_comes_true_again_too_soon_does_so_across_a_pause() {
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Gauss(4)] {
        let request = Request { method: Some(method), ..Request::default() };
        let simulation = || dropped_ball(8.0).options(request.clone());
        let bounce = || bounce(-1e-11, Direction::Either);
        let whole = simulation().boxed_event(bounce()).run().expect("a run");
        let stop = whole.stop.as_ref().map(ToString::to_string).unwrap_or_default();
        assert!(stop.contains("`ground` comes true again"), "{method:?}: {stop}");
        let mut running = Running::new(simulation().boxed_event(bounce()).prepare().expect("a run"));
        while !running.go(&mut |_| Ok(()), &mut || true).expect("samples") {
            let bytes = postcard::to_stdvec(&running.snapshot()).expect("bytes");
            let (snapshot, ball) = (postcard::from_bytes(&bytes).expect("a snapshot"), simulation());
            running = Running::resume(Arc::clone(ball.mechanism()), &ball.start(), snapshot)
                .and_then(|running| running.with_events(vec![bounce()]))
                .expect("it fits");
        }
        let pieces = running.finish();
        assert_eq!((pieces.last, pieces.stop), (whole.last, whole.stop), "{method:?}");
        assert_eq!(pieces.events, whole.events, "{method:?}");
    }
}

/// Asks every step for the motion at a time.
struct Asks(f64, u32);

impl Observer for Asks {
    fn step(&mut self, step: &mut Step) -> ControlFlow<()> {
        let (begin, t) = (step.begin(), step.at(self.0).time.hi);
        let nearest = if self.0.is_nan() { begin } else { self.0.clamp(begin, step.end()) };
        assert_eq!(t, nearest);
        self.1 += 1;
        ControlFlow::Continue(())
    }
}

#[test]
fn a_step_asked_for_the_motion_at_no_time_gives_its_beginning() {
    for request in every_method() {
        for time in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let (mut asks, method) = (Asks(time, 0), request.method);
            let simulation = Simulation::new(&dangling()).expect("equations").options(request.clone());
            let found = simulation.until(0.2).every(0.1).run_observed(&mut asks).expect("a run");
            assert!(found.stop.is_none() && asks.1 > 0, "{method:?}");
        }
    }
}

fn dangling() -> Scene {
    SceneBuilder::new("dangling")
        .gravity([0.0, -9.81])
        .bar("a", 0.6, 0.5)
        .bar("b", 0.5, 0.4)
        .hinge("A", ground([0.0, 0.0]), on("a", [0.0, 0.0]))
        .hinge("B", on("a", [0.6, 0.0]), on("b", [0.0, 0.0]))
        .spring("s", on("b", [0.5, 0.0]), ground([1.0, 0.0]), 8.0, 0.5)
        .start("a", 0.3, 0.0)
        .start("b", -0.3, 1.0)
        .until(0.5, 0.25)
        .build()
        .expect("a scene")
}

/// What a file is refused for is refused of a scene whose fields were changed, by the path of the field.
#[test]
fn scenes_changed_by_hand_are_refused_as_files_are() {
    type Change = fn(&mut Scene);
    let cases: [(&str, Change); 16] = [
        ("bars[0]", |scene| scene.bars[0].length = -1.0),
        ("start[1]", |scene| scene.start[1].phi = 1e300),
        ("bars[1].name", |scene| scene.bars[1].name = "a".into()),
        ("bars[0].name", |scene| scene.bars[0].name = String::new()),
        ("bars[0].name", |scene| scene.bars[0].name = "ground".into()),
        ("bars[1].name", |scene| scene.bars[1].name = "b.phi".into()),
        ("springs[1].name", |scene| scene.springs.push(scene.springs[0].clone())),
        ("hinges[1].name", |scene| scene.hinges[1].name = "A".into()),
        ("name", |scene| scene.name = "../x".into()),
        ("name", |scene| scene.name = "-x".into()),
        ("until", |scene| scene.until = f64::NAN),
        ("until", |scene| scene.until = 0.0),
        ("until", |scene| scene.until = -1.0),
        ("until", |scene| scene.every = f64::INFINITY),
        ("until", |scene| scene.every = 0.0),
        ("bars[0]", |scene| scene.bars[0].mass = 0.0),
    ];
    assert!(dangling().fault().is_none());
    for (path, change) in cases {
        let mut scene = dangling();
        change(&mut scene);
        let told = Simulation::new(&scene).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(told.contains(path), "{path}: {told}");
    }
}

/// Names of motors, locks, sliders and rigid springs are those of their constraints, of which there are no two.
#[test]
fn no_two_constraints_have_one_name() {
    let guided = || {
        SceneBuilder::new("guided")
            .bar("a", 0.6, 0.5)
            .slider("S", on("a", [0.0, 0.0]), ground([0.0, 0.0]), [1.0, 0.0])
            .motor("m", "a", 0.0, 1.0)
            .until(1.0, 0.1)
    };
    let scene = guided().build().expect("a scene");
    let changes: [fn(&mut Scene); 2] =
        [|scene| scene.motors[0].name = "S".into(), |scene| scene.sliders[0].name = "m".into()];
    for change in changes {
        let mut scene = scene.clone();
        change(&mut scene);
        let told = Simulation::new(&scene).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(told.contains("motors[0].name"), "{told}");
    }
    let law = serde_json::json!({"start": 0.0, "rate": 0.3});
    for part in ["motors", "locks"] {
        let part_named = match part {
            "motors" => serde_json::json!({"name": "S", "slider": "S", "law": law}),
            _ => serde_json::json!({"name": "m", "body": "a", "angle": 0.0}),
        };
        let refused = guided().part(part, part_named).build().expect_err("a name that is taken").to_string();
        assert!(refused.contains("the name of another constraint"), "{refused}");
    }
}

/// What no scene can be is refused whatever field says it: bodies that are not there, what acts on a body
/// from itself, numbers that no file may have, names twice, and integrals whose formula is not what is
/// integrated.
#[test]
fn no_field_of_a_scene_changed_by_hand_is_taken_unseen() {
    type Change = fn(&mut Scene);
    fn torque(scene: &mut Scene, bar: usize, relative_to: Option<usize>) {
        scene.laws[0].load = Load::Torque { bar, relative_to, torque: "kp*error".into() };
    }
    fn parameter(scene: &mut Scene, name: &str, value: f64) {
        scene.parameters.push(Parameter { name: name.into(), value });
    }
    fn spring(scene: &mut Scene, bar: Option<usize>) {
        let between = [Place { bar, point: [0.0; 2] }, Place { bar, point: [0.1, 0.0] }];
        let numbers = Spring { stiffness: 1.0, free_length: 0.0, damping: 0.1, ..scene.springs[0].clone() };
        scene.springs[0] = Spring { between, ..numbers };
    }
    fn coil(scene: &mut Scene, relative_to: Option<usize>, free_angle: f64) {
        let (name, stiffness, damping) = ("coil".into(), 1.0, 0.1);
        let coil = TorsionSpring { name, bar: 0, relative_to, stiffness, free_angle, damping };
        scene.torsion_springs.push(coil);
    }
    fn lock(scene: &mut Scene, angle: f64) {
        scene.locks.push(Lock { name: "lock".into(), bar: 0, relative_to: None, angle: Some(angle) });
    }
    fn given(scene: &mut Scene, origin: [f64; 2]) {
        scene.given = vec![Given { origin: Some(origin), ..Given::ANGLE_AND_RATE }];
    }
    fn output(scene: &mut Scene) {
        scene.outputs.push(Output { name: "o".into(), formula: "t".into() });
    }
    let cases: [(&str, &str, Change); 29] = [
        ("trebuchet", "points[0]: bar number 99", |scene| scene.points[0].place.bar = Some(99)),
        ("trebuchet", "points[0].point[0] is not finite", |scene| scene.points[0].place.point[0] = f64::NAN),
        ("pid", "laws[0]: bar number 99", |scene| torque(scene, 99, None)),
        ("pid", "laws[0]: bar number 99", |scene| torque(scene, 0, Some(99))),
        ("pid", "torques[0].relative_to", |scene| torque(scene, 0, Some(0))),
        ("pid", "integrals[0].bar = 99", |scene| scene.integrals[0].bar = 99),
        ("pid", "integrals", |scene| scene.integrals[0].formula = "100*t".into()),
        ("pid", "integrals", |scene| scene.integrals[0].formula = "((".into()),
        ("pid", "integrals", |scene| scene.bars[1].mass *= 2.0),
        ("pid", "tables.gust[1]", |scene| scene.tables[0].points.reverse()),
        ("pid", "tables.gust has 0 points", |scene| scene.tables[0].points.clear()),
        ("pid", "tables.gust has 1 point", |scene| scene.tables[0].points.truncate(1)),
        ("pid", "tables.gust[0]", |scene| scene.tables[0].points[0][1] = f64::NAN),
        ("pid", "parameters.t has a meaning", |scene| parameter(scene, "t", 1.0)),
        ("pid", "parameters: `kp` is there twice", |scene| parameter(scene, "kp", 2.0)),
        ("pid", "parameters.x", |scene| parameter(scene, "x", f64::NAN)),
        ("spring", "springs[0].between joins `bar1`", |scene| spring(scene, Some(0))),
        ("spring", "springs[0].between joins the ground", |scene| spring(scene, None)),
        ("free", "torsion_springs[0].free_angle = 1e+300", |scene| coil(scene, None, 1e300)),
        ("free", "torsion_springs[0].relative_to", |scene| coil(scene, Some(0), 0.0)),
        ("free", "locks[0].angle is not finite", |scene| lock(scene, f64::NAN)),
        ("free", "locks[0].angle = 1e+300", |scene| lock(scene, 1e300)),
        ("free", "bars[0].mass = 1e+300", |scene| scene.bars[0].mass = 1e300),
        ("free", "given[0]", |scene| given(scene, [f64::NAN, 0.0])),
        ("free", "every = 20", |scene| scene.every = 2.0 * scene.until),
        ("free", "until = 1e+300", |scene| (scene.until, scene.every) = (1e300, 1e299)),
        ("free", "outputs: `o` is there twice", |scene| (output(scene), output(scene)).0),
        ("wall", "walls[0].line.body", |scene| scene.walls[0].on = Some(scene.walls[0].bar)),
        ("wall", "walls[0].restitution", |scene| scene.walls[0].restitution = f64::NAN),
    ];
    for (name, told, change) in cases {
        let mut scene = shipped(name, &[]);
        assert_eq!(scene.fault(), None, "{name}");
        change(&mut scene);
        let refused = Simulation::new(&scene).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(refused.contains(told), "{name}, {told}: {refused}");
    }
}

/// A clone of a sample is the sample, also near singular positions, which linkages of equal bars pass; and the
/// last sample of the outcome is the one that was seen last.
#[test]
fn a_clone_of_a_sample_is_the_sample() {
    for (name, is_near) in [("four_bars", true), ("free", false)] {
        let (mut singular, mut last) = (0, Sample::default());
        let outcome = Simulation::new(&shipped(name, &["until=3"]))
            .expect("equations")
            .run_with(|sample| {
                assert_eq!(&sample.clone(), sample);
                singular +=
                    usize::from(sample.singular.is_some_and(|smallest| (0.0..0.1).contains(&smallest)));
                last = sample.clone();
                Ok(())
            })
            .expect("a run");
        assert_eq!((outcome.stop, singular > 0), (None, is_near), "{name}");
        assert_eq!(outcome.last, last, "{name}");
    }
}
