//! What programs hand in from outside the crate: what does not fit is refused, and named.

use crate::doors::Rk4;
use crate::many_digits::{shipped, source};
use driftless::arithmetic::Scalar;
use driftless::dynamics::OdeSystem;
use driftless::run::digits::{Precision, long_run};
use driftless::run::{Action, Change, Direction, Event, ResumeError};
use driftless::stepping::Cause;
use driftless::{
    Configuration, Custom, Force, Integrator, Loads, MethodId, Motion, Request, Running, Scene, Simulation,
    Site, Snapshot, State, Statistics, StepError, Time,
};
use std::sync::Arc;

/// Drag on a point, by a factor, with a name.
struct Drag(&'static str, Site, f64);

impl Force for Drag {
    fn name(&self) -> &str {
        self.0
    }

    fn apply<S: Scalar>(&self, at: &Configuration<S>, loads: &mut Loads<S>) {
        let [vx, vy] = at.velocity(&self.1);
        loads.force(&self.1, [vx.scale(-self.2), vy.scale(-self.2)]);
    }
}

/// An event function with a name, which is recorded.
struct Passes<V>(&'static str, V);

impl<V: Fn(&Configuration<f64>) -> f64 + Send + Sync> Event for Passes<V> {
    fn name(&self) -> &str {
        self.0
    }

    fn value(&self, at: &Configuration<f64>) -> f64 {
        self.1(at)
    }

    fn direction(&self) -> Direction {
        Direction::Rising
    }

    fn action(&mut self, _at: &Configuration<f64>, _motion: &Motion) -> Action {
        Action::Record
    }
}

fn scene(name: &str) -> Scene {
    driftless::read_scene(format!("examples/scenes/{name}.json").as_ref(), &[]).expect("a scene")
}

fn with_drag(scene: &Scene, name: &'static str, bar: &str, factor: f64) -> Simulation {
    let simulation = Simulation::new(scene).expect("equations").until(2.0).every(0.5);
    let site = simulation.site(bar, [0.6, 0.0]).expect("a bar");
    simulation.force(&Drag(name, site, factor)).expect("a force")
}

#[test]
fn many_digits_refuse_forces_that_are_no_parts_of_the_scene() {
    let mut source = source(&shipped("free"), &[], "1", "1/2");
    assert!(long_run(&source, Precision::new(30, false)).is_ok());
    source.mechanism = Arc::clone(with_drag(&source.scene, "drag", "bar2", 0.1).mechanism());
    let refused = long_run(&source, Precision::new(30, false)).err().expect("a refusal");
    assert!(refused.to_string().contains("force drag in many digits"), "{refused}");
}

#[test]
fn a_force_that_shares_a_name_is_refused() {
    for (scene, bar, name) in [
        ("latch", "bar", "latch"),
        ("spring", "bar2", "spring"),
        ("motor", "bar2", "motor"),
        ("free", "bar2", "B"),
    ] {
        let scene = self::scene(scene);
        let simulation = Simulation::new(&scene).expect("equations");
        let site = simulation.site(bar, [0.6, 0.0]).expect("a bar");
        let refused = simulation.force(&Drag(name, site, 0.1)).err().expect("a refusal");
        assert!(refused.to_string().contains(&format!("force `{name}` has the name of")), "{refused}");
    }
    let simulation = with_drag(&scene("free"), "drag", "bar2", 0.1);
    let site = simulation.site("bar1", [0.6, 0.0]).expect("a bar");
    let refused = simulation.force(&Drag("drag", site, 0.1)).err().expect("a refusal");
    assert!(refused.to_string().contains("another force"), "{refused}");
}

fn paused(simulation: Simulation, after: u64) -> Snapshot {
    let mut running = Running::new(simulation.prepare().expect("a run"));
    let mut asked = 0;
    let is_over = running.go(&mut |_| Ok(()), &mut || {
        asked += 1;
        asked == after
    });
    assert!(!is_over.expect("samples"));
    running.snapshot()
}

#[test]
fn a_run_goes_on_with_its_own_mechanism_alone() {
    let mut scene = scene("free");
    // Drag shows where points move.
    scene.start[1].omega = 1.0;
    let dragged = |factor: f64| with_drag(&scene, "drag", "bar2", factor).method(MethodId::Taylor);
    let resumed = |simulation: &Simulation, after: u64| {
        let snapshot = paused(dragged(0.1), after);
        Running::resume(Arc::clone(simulation.mechanism()), &simulation.start(), snapshot)
    };
    let whole = dragged(0.1).run().expect("a run");
    let mut heavier = scene.clone();
    heavier.bars[1].mass *= 1.0 + 1e-14;
    for after in [1, 9] {
        let mut same = resumed(&dragged(0.1), after).expect("the same");
        assert!(same.go(&mut |_| Ok(()), &mut || false).expect("samples"));
        assert_eq!(same.finish().last, whole.last);
        let none = Simulation::new(&scene).expect("equations");
        for other in [none, dragged(0.2), with_drag(&heavier, "drag", "bar2", 0.1)] {
            assert_eq!(resumed(&other, after).err(), Some(ResumeError::Misfit), "after {after}");
        }
    }
}

#[test]
fn a_run_goes_on_with_its_own_events_alone() {
    let scene = scene("free");
    let simulation = || Simulation::new(&scene).expect("equations").until(2.0).every(0.5);
    let event = |name: &'static str, height: f64| {
        let tip = simulation().site("bar2", [0.6, 0.0]).expect("a bar");
        Passes(name, move |at: &Configuration<f64>| at.position(&tip)[1] - height)
    };
    let whole = simulation().event(event("level", -0.4)).run().expect("a run");
    assert!(whole.event_count > 0);
    let resumed = || {
        let snapshot = paused(simulation().event(event("level", -0.4)), 9);
        Running::resume(Arc::clone(simulation().mechanism()), &simulation().start(), snapshot)
            .expect("it fits")
    };
    let mut same = resumed().with_events(vec![Box::new(event("level", -0.4))]).expect("the same");
    assert!(same.go(&mut |_| Ok(()), &mut || false).expect("samples"));
    assert_eq!(same.finish().events, whole.events);
    let mut without = resumed();
    assert!(without.go(&mut |_| Ok(()), &mut || false).expect("samples"));
    let stop = without.finish().stop.expect("a stop");
    assert!(
        stop.to_string().contains("event `level` is from outside the scene, and not given again"),
        "{stop}"
    );
    for other in [vec![], vec![event("x", -0.4)], vec![event("level", 0.1)]] {
        let other = other.into_iter().map(|event| Box::new(event) as Box<dyn Event>).collect();
        let refused = resumed().with_events(other).err().expect("a refusal");
        assert!(matches!(refused, ResumeError::OtherEvents(_)), "{refused}");
    }
    // A run without any takes none.
    let snapshot = paused(simulation(), 9);
    let plain = Running::resume(Arc::clone(simulation().mechanism()), &simulation().start(), snapshot);
    assert!(plain.expect("it fits").with_events(vec![Box::new(event("level", -0.4))]).is_err());
}

#[test]
fn an_event_function_that_is_not_a_number_stops_the_run_by_its_name() {
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Dopri5] {
        let root = Passes("root", |at: &Configuration<f64>| (0.7 - at.time()).sqrt() - 0.1);
        let simulation = Simulation::new(&scene("free")).expect("equations").until(2.0).every(0.5);
        let outcome = simulation.method(method).event(root).run().expect("a run");
        let stop = outcome.stop.expect("a stop");
        assert_eq!(stop.cause, Cause::NotFinite, "{stop}");
        assert!(stop.what.contains("event `root` is not a number"), "{stop}");
        assert!((0.5..=2.0).contains(&outcome.last.t), "{method}: {}", outcome.last.t);
    }
}

#[test]
fn an_event_of_another_mechanism_is_refused() {
    let foreign = Simulation::new(&scene("branch")).expect("equations");
    let last = scene("branch").bars.last().expect("a bar").name.clone();
    let site = foreign.site(&last, [0.1, 0.0]).expect("a bar");
    let free = || Simulation::new(&scene("free")).expect("equations").until(1.0);
    let of_place = Passes("place", move |at: &Configuration<f64>| at.position(&site)[1]);
    let of_angle = Passes("angle", |at: &Configuration<f64>| at.angle(2));
    for refused in [free().event(of_place).run().err(), free().event(of_angle).run().err()] {
        let refused = refused.expect("a refusal").to_string();
        assert!(refused.contains("one of another mechanism"), "{refused}");
    }
    let of_rate: Box<dyn Event> = Box::new(Passes("rate", |at: &Configuration<f64>| at.rate(9)));
    let run = free().prepare().expect("a run").with_events(vec![of_rate]);
    let mut running = Running::new(run);
    assert!(running.go(&mut |_| Ok(()), &mut || false).expect("samples"));
    assert!(running.finish().stop.expect("a stop").what.contains("event `rate` is one of another mechanism"));
}

/// An event may ask for a body that is not there later than at the start, where it is looked at first, or in its
/// action: the run stops by its name.
#[test]
fn an_event_that_asks_later_for_a_body_that_is_not_there_stops_the_run_by_its_name() {
    struct Late;
    impl Event for Late {
        fn name(&self) -> &str {
            "acts"
        }

        fn value(&self, at: &Configuration<f64>) -> f64 {
            at.time() - 0.35
        }

        fn action(&mut self, at: &Configuration<f64>, _motion: &Motion) -> Action {
            if at.angle(9) > 0.0 { Action::Stop } else { Action::Record }
        }
    }
    let later = |at: &Configuration<f64>| if at.time() < 0.3 { -1.0 } else { at.rate(2).max(1.0) };
    for method in [MethodId::Taylor, MethodId::Dp8] {
        let free = || Simulation::new(&scene("free")).expect("equations").until(1.0).method(method);
        let asked = free().event(Passes("asks", later)).run().expect("a run");
        let acted = free().event(Late).run().expect("a run");
        for (outcome, told) in
            [(asked, "event `asks` is not a number"), (acted, "the action of event `acts`")]
        {
            let stop = outcome.stop.expect("a stop");
            assert_eq!(stop.cause, Cause::NotFinite, "{stop}");
            assert!(stop.what.contains(told), "{told}: {stop}");
            assert!((0.2..1.0).contains(&outcome.last.t), "{method}: {}", outcome.last.t);
        }
    }
}

/// Names of forces are such as those of parts, and no part, body or ground has them.
#[test]
fn a_force_without_a_name_of_its_own_is_refused() {
    for (name, told) in
        [("bar1", "has the name"), ("ground", "has the name"), ("", "has no name"), ("q\n", "has no name")]
    {
        let simulation = Simulation::new(&scene("free")).expect("equations");
        let at = simulation.site("bar2", [0.6, 0.0]).expect("a bar");
        let refused = simulation.force(&Drag(name, at, 0.02)).err().expect(name).to_string();
        assert!(refused.contains(told), "{name:?}: {refused}");
    }
}

/// Collocation with another number of stages than there is says so, with a step and without.
#[test]
fn a_method_that_is_not_there_is_refused_by_its_own_name() {
    let unknown = [MethodId::Gauss(0), MethodId::Gauss(1), MethodId::Gauss(9), MethodId::Radau(4)];
    for method in unknown {
        for step in [None, Some(0.01)] {
            let request = Request { method: Some(method), step, ..Request::default() };
            let simulation = Simulation::new(&scene("free")).expect("equations").options(request);
            let refused = simulation.until(1.0).run().expect_err("a refusal").to_string();
            assert!(refused.contains(&format!("{method:?}")) && refused.contains("Gauss(8)"), "{refused}");
        }
    }
}

/// Makes steps of no length.
struct Stuck;

impl<P: OdeSystem + ?Sized> Integrator<P> for Stuck {
    fn name(&self) -> &'static str {
        "stuck"
    }

    fn order(&self) -> u32 {
        1
    }

    fn begin(&mut self, _: &mut P, _: &mut State, _: Time) -> Result<(), StepError> {
        Ok(())
    }

    fn step(
        &mut self,
        _: &mut P,
        _: &mut State,
        _: Time,
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError> {
        statistics.steps += 1;
        Ok(None)
    }
}

#[test]
fn an_integrator_that_does_not_move_the_time_on_stops() {
    let simulation = Simulation::new(&scene("free")).expect("equations").until(1.0);
    let outcome = simulation.integrator(Custom::new("stuck", || Box::new(Stuck))).run().expect("a run");
    let stop = outcome.stop.expect("a stop");
    assert!(stop.method == "stuck" && stop.what.contains("has not moved the time on"), "{stop}");
}

#[test]
fn an_integrator_from_outside_takes_neither_a_method_nor_a_step_beside_it() {
    let custom = || Custom::new("rk4", || Rk4::boxed(1e-3));
    let simulation = || Simulation::new(&scene("free")).expect("equations").until(0.1).integrator(custom());
    for (asked, named) in [
        (simulation().method(MethodId::Gauss(4)), "method gauss8"),
        (simulation().step(0.5), "a step of 0.5 s"),
    ] {
        let refused = asked.run().expect_err("a refusal").to_string();
        assert!(refused.contains(&format!("{named} with `Simulation::integrator`")), "{refused}");
    }
    assert_eq!(simulation().run().expect("a run").stop, None);
}

#[test]
fn the_ground_is_a_body_for_sites() {
    let simulation = Simulation::new(&scene("free")).expect("equations");
    assert_eq!(simulation.site("ground", [0.3, -0.2]).expect("the ground"), Site::ground([0.3, -0.2]));
}

/// Two bars on hinges, with more parts.
fn two_bars(more: &str) -> Scene {
    let text = format!(
        r#"{{"name": "two", "gravity": [0, -9.81],
        "bars": [{{"name": "b0", "mass": 1, "centre": [0.25, 0.01], "inertia": 0.03, "length": 0.5}},
            {{"name": "b1", "mass": 1.3, "centre": [0.25, 0], "inertia": 0.03, "length": 0.5}}],
        "hinges": [
            {{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b0", "point": [0, 0]}}]}},
            {{"name": "B", "between": [{{"body": "b0", "point": [0.5, 0]}}, {{"body": "b1", "point": [0, 0]}}]}}],
        "start": {{"b0": {{"phi": -0.4, "omega": 0.5}}, "b1": {{"phi": 0.3, "omega": 1}}}},
        "until": 2, "every": 0.5 {more}}}"#
    );
    driftless::parse_scene(&text, "two.json", &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// A wall below the second bar's end.
fn floor(restitution: f64, height: f64, more: &str) -> String {
    format!(
        r#", "walls": [{{"name": "W", "body": "b1", "point": [0.5, 0], "restitution": {restitution},
        "line": {{"through": [0, {height}], "normal": [0.1, 1]}} {more}}}]"#
    )
}

/// A torque by a law of time, 3 sin(w t).
struct Shaken(f64);

impl Force for Shaken {
    fn name(&self) -> &str {
        "shaken"
    }

    fn apply<S: Scalar>(&self, at: &Configuration<S>, loads: &mut Loads<S>) {
        loads.torque(1, at.time().scale(self.0).sin_cos().0.scale(3.0));
    }
}

/// What does not act at the moment counts as well: all that is written in the scene, and every operation of a
/// force.
#[test]
fn a_snapshot_of_another_mechanism_is_refused_whatever_acts_at_the_moment() {
    let event = |more: &str| format!(r#", "events": [{{"name": "e", {more}}}]"#);
    let set = |k: f64| {
        let events = event(&format!(r#""when": "b0.phi + 1", "set": {{"k": {k}}}"#));
        format!(
            r#", "parameters": {{"k": 1}}, "torques": [{{"name": "q", "body": "b0", "torque": "k"}}] {events}"#
        )
    };
    let spring = |k: f64| {
        format!(
            r#", "springs": [{{"name": "S", "tension": "if(length > 0.75, {k}*(length - 0.75), 0)",
            "between": [{{"body": "b1", "point": [0.5, 0]}}, {{"body": "ground", "point": [0.6, 0.2]}}]}}]"#
        )
    };
    let table = |y: f64| {
        format!(
            r#", "tables": {{"g": [[0, 0], [0.5, 0], [1, {y}], [2, 0]]}},
            "torques": [{{"name": "q", "body": "b0", "torque": "if(t < 1, 0, g(t))"}}]"#
        )
    };
    let integral = |k: f64| format!(r#", "integrals": {{"i": "{k}*max(0, t - 1)"}}"#);
    let motor = |k: f64| {
        format!(r#", "motors": [{{"name": "M", "body": "b0", "law": "-0.4 + 0.5*t + {k}*max(0, t - 1)^3"}}]"#)
    };
    let friction = |k: f64| floor(0.3, -0.5, &format!(r#", "friction": {{"kinetic": {k}}}"#));
    let pairs = [
        ("restitution", [floor(0.5, -0.5, ""), floor(0.9, -0.5, "")]),
        ("place of a wall", [floor(0.5, -0.5, ""), floor(0.5, -0.6, "")]),
        ("friction", [friction(0.2), friction(0.6)]),
        ("event", [event(r#""when": "b0.phi + 1""#), event(r#""when": "b0.phi + 0.9""#)]),
        ("set", [set(2.0), set(5.0)]),
        ("one-sided spring", [spring(30.0), spring(60.0)]),
        ("later points", [table(2.0), table(4.0)]),
        ("integral", [integral(1.0), integral(3.0)]),
        ("later law", [motor(1.0), motor(2.0)]),
    ];
    let resumed = |snapshot: &Snapshot, other: &Simulation| {
        Running::resume(Arc::clone(other.mechanism()), &other.start(), snapshot.clone()).err()
    };
    let begun = |scene: &Scene| {
        Simulation::new(scene).expect("equations").method(MethodId::Dp8).tolerance(1e-9, 1e-9)
    };
    for (what, texts) in pairs {
        let [one, other] = texts.map(|text| two_bars(&text));
        let snapshot = paused(begun(&one), 1);
        assert_eq!(resumed(&snapshot, &begun(&one)), None, "{what}");
        assert_eq!(resumed(&snapshot, &begun(&other)), Some(ResumeError::Misfit), "{what}");
    }
    // Both are zero at t = 0.
    let shaken = |w: f64| begun(&two_bars("")).force(&Shaken(w)).expect("a force");
    let snapshot = paused(shaken(5.0), 1);
    assert_eq!(resumed(&snapshot, &shaken(5.0)), None);
    assert_eq!(resumed(&snapshot, &shaken(9.0)), Some(ResumeError::Misfit));
    // How long it goes on and what it is called are no part of it.
    let mut renamed = two_bars("");
    (renamed.name, renamed.until) = ("other".into(), 3.0);
    let snapshot = paused(begun(&two_bars("")), 1);
    assert_eq!(resumed(&snapshot, &begun(&renamed)), None);
}

#[test]
fn an_integral_is_no_body() {
    let scene = two_bars(r#", "integrals": {"int": "b0.phi"}"#);
    let simulation = || Simulation::new(&scene).expect("equations").until(0.5).every(0.5);
    let refused = [
        simulation().body("int").expect_err("a refusal"),
        simulation().site("int", [0.0; 2]).expect_err("a refusal"),
    ];
    for refused in refused {
        assert!(refused.to_string().contains("no bar is called `int`"), "{refused}");
    }
    // Nor is it one for forces and events that go by number; its name is taken all the same.
    struct Twist(&'static str, usize);
    impl Force for Twist {
        fn name(&self) -> &str {
            self.0
        }
        fn apply<S: Scalar>(&self, _: &Configuration<S>, loads: &mut Loads<S>) {
            loads.torque(self.1, S::of(1.0));
        }
    }
    let refused = simulation().force(&Twist("twist", 2)).err().expect("a refusal");
    assert!(refused.to_string().contains("names a body that is not there"), "{refused}");
    let refused = simulation().force(&Twist("int", 1)).err().expect("a refusal");
    assert!(refused.to_string().contains("has the name of"), "{refused}");
    assert!(simulation().force(&Twist("twist", 1)).is_ok());
    let refused = simulation().event(Passes("e", |at: &Configuration<f64>| at.angle(2))).run().err();
    assert!(refused.expect("a refusal").to_string().contains("names a body that is not there"));
}

/// An event at a time, and what it does.
struct Acts<A>(&'static str, f64, A);

impl<A: FnMut(&Motion) -> Change + Send + Sync> Event for Acts<A> {
    fn name(&self) -> &str {
        self.0
    }

    fn value(&self, at: &Configuration<f64>) -> f64 {
        at.time() - self.1
    }

    fn action(&mut self, _at: &Configuration<f64>, motion: &Motion) -> Action {
        Action::Change(self.2(motion))
    }
}

#[test]
fn a_part_that_cannot_be_switched_is_refused_on_and_off() {
    let scene = two_bars(&floor(0.5, -5.0, ""));
    for on in [true, false] {
        let stop = |part: &'static str| {
            let switch = move |_: &Motion| Change::default().switch(part, on);
            let simulation = Simulation::new(&scene).expect("equations").until(0.5).every(0.5);
            simulation.event(Acts("x", 0.25, switch)).run().expect("a run").stop.map(|stop| stop.to_string())
        };
        for part in ["nothing", "A", "b0"] {
            let stop = stop(part).expect("a stop");
            assert!(stop.contains(&format!("event `x` switches `{part}`")), "{stop}");
        }
        assert_eq!(stop("W"), None, "{on}");
    }
}

#[test]
fn a_motion_moved_behind_a_wall_is_told_as_that_of_its_event() {
    let scene = two_bars(&floor(0.5, -0.5, ""));
    // The height over the wall by its formula.
    let depth = |phi: [f64; 2]| {
        let tip = phi.map(|phi| [0.5 * phi.cos(), 0.5 * phi.sin()]);
        -((tip[0][0] + tip[1][0]) * 0.1 + tip[0][1] + tip[1][1] + 0.5) / 1.01_f64.sqrt()
    };
    for method in [MethodId::Dp8, MethodId::Taylor] {
        let turned = |motion: &Motion| {
            let mut after = motion.clone();
            after.phi.iter_mut().zip([-0.9, -0.9]).for_each(|(phi, to)| *phi = to.into());
            after.turns.iter_mut().for_each(|turns| *turns = Default::default());
            Change::default().to(after)
        };
        let simulation = Simulation::new(&scene).expect("equations").method(method);
        let outcome = simulation.event(Acts("k", 0.02, turned)).run().expect("a run");
        let stop = outcome.stop.expect("a stop");
        let told = format!("event `k` puts the point of wall W {:.4} m behind it", depth([-0.9; 2]));
        assert!(stop.cause == Cause::Unsuited && stop.to_string().contains(&told), "{told}: {stop}");
    }
}

#[test]
fn an_integrator_is_refused_by_its_own_name_and_an_event_by_that_of_another() {
    let loop_of_bars = scene("crank_rocker");
    let custom = Custom::new("rk4", || Rk4::boxed(1e-3));
    let simulation = Simulation::new(&loop_of_bars).expect("equations").integrator(custom);
    let refused = simulation.stabilize(driftless::run::Stabilization::Elimination).run().err();
    let refused = refused.expect("a refusal").to_string();
    assert!(refused.contains("rk4 with --stabilize elimination") && !refused.contains("dp8"), "{refused}");
    let scene = two_bars(r#", "events": [{"name": "turns", "when": "b0.omega"}]"#);
    let simulation = || Simulation::new(&scene).expect("equations").until(0.5).every(0.5);
    let event = |name| Passes(name, |at: &Configuration<f64>| at.time() - 0.25);
    let refused = simulation().event(event("turns")).run().expect_err("a refusal");
    assert!(refused.to_string().contains("event `turns` has the name of an event of the scene"), "{refused}");
    assert!(simulation().event(event("passes")).run().is_ok());
}
