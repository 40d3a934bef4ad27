//! Sweeps of scenes whose events end points, with outputs and with walls beside bodies that float: points in
//! lanes against single runs and closed forms.

use crate::mechanisms::{Kind, scene as random_scene, scene_with};
use crate::sweep::points;
use crate::sweep_loops::by_taylor;
use crate::sweep_outputs::off;
use driftless::dynamics::elimination::Elimination;
use driftless::dynamics::{Form, Mechanism, Time};
use driftless::run::trust::Level;
use driftless::run::{Outcome, Request, Status, Sweep, SweepPoint, simulate};
use driftless::scene::Template;
use driftless::stepping::taylor::batch::{Batch, BatchMember, Going};
use driftless::stepping::{Cause, Tolerance};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The text of a shipped scene.
fn shipped(name: &str) -> String {
    std::fs::read_to_string(format!("examples/scenes/{name}.json")).expect("a file")
}

fn planned(template: &Template, vary: &str, request: &Request) -> Sweep {
    Sweep::new(template, vec![vary.parse().expect("a range")], request).expect("a sweep")
}

/// A scene with these parts instead of its own.
fn with(text: &str, parts: Value) -> Template {
    let mut text: Value = serde_json::from_str(text).expect("JSON");
    for (key, part) in parts.as_object().expect("parts") {
        text[key] = part.clone();
    }
    Template::new(text.to_string(), "changed".into(), &[])
}

/// The single run of a point, from which it differs by so much at most \[rad, rad/s over the fastest, m\].
fn alone(template: &Template, plan: &Sweep, point: &SweepPoint, request: &Request) -> (Outcome, f64) {
    let alone = template.filled(plan.variables(), &point.values).expect("a scene");
    let outcome = simulate(&alone, request, &mut |_| Ok(())).expect("a run");
    let fastest = outcome.last.omega.iter().fold(1.0, |most: f64, omega| most.max(omega.abs()));
    let angles = point.phi.iter().zip(&outcome.last.phi).map(|(a, b)| (a - b).abs());
    let rates = point.omega.iter().zip(&outcome.last.omega).map(|(a, b)| (a - b).abs() / fastest);
    let apart = angles.chain(rates).fold((point.t - outcome.last.t).abs(), f64::max);
    (outcome, apart)
}

/// Points that run one by one have the bits and the steps of the single run.
fn is_in_lanes(point: &SweepPoint, outcome: &Outcome) -> bool {
    (&point.phi, &point.omega, point.steps)
        != (&outcome.last.phi, &outcome.last.omega, outcome.statistics.steps)
}

/// Every kind of lanes, through singular positions and impacts, some of the points to the horizon.
#[test]
fn points_end_where_single_runs_do() {
    for (scene, when, vary, until, near) in [
        ("free", "bar2.cos + 0.2", "bar1.phi=0.5..1.5:11", 1.2, 1e-8),
        ("spring", "bar2.omega - 2", "bar1.phi=-3..3:11", 1.0, 1e-8),
        ("motor", "bar2.sin - 0.4", "bar2.omega=-3..3:11", 1.0, 1e-8),
        ("motor_sine", "bar2.sin - 0.4", "bar2.omega=-3..3:11", 1.0, 1e-8),
        ("branch", "plate.omega - 1.5", "plate.omega=-1..1:11", 1.0, 1e-8),
        ("duffing", "bar.omega - 0.1", "bar.omega=-1..1:11", 3.0, 1e-8),
        ("kite", "crank.phi - 9", "crank.omega=6..8:11", 1.5, 1e-6),
        ("andrews", "OF.phi - 1", "springs.spring.stiffness=4000..5000:11", 0.02, 1e-7),
        ("four_bar_motor", "t*coupler.omega - 0.3", "motors.motor.law.rate=5..7:11", 0.7, 1e-8),
        ("cart_pole", "pole.omega + 2", "pole.phi=0.3..1.4:11", 1.0, 1e-8),
        ("wall", "bar2.omega - 3", "bar1.phi=0.5..1.4:11", 1.2, 1e-7),
    ] {
        let events = json!([{"name": "seen", "when": "t - 0.01"},
            {"name": "enough", "when": when, "action": "stop"}]);
        let template = with(&shipped(scene), json!({"events": events, "outputs": []}));
        let request = Request { every: Some(0.4 * until), ..by_taylor(until, 1e-12) };
        let plan = planned(&template, vary, &request);
        assert!(!Batch::takes(plan.mechanism()) && !Batch::takes_alike(plan.mechanism()));
        let found = points(&plan, 1);
        let (mut ended, mut in_lanes) = (0, 0);
        for point in &found {
            let (outcome, apart) = alone(&template, &plan, point, &request);
            assert_eq!((&point.status, outcome.stop.as_ref()), (&Status::Done, None), "{scene}");
            assert!(apart < near, "{scene}: {apart:e}\n{point:?}\n{:?}", outcome.last);
            assert!(point.energy < 1e-9, "{scene}: {point:?}");
            ended += usize::from(outcome.ended_by.is_some());
            in_lanes += usize::from(is_in_lanes(point, &outcome));
            assert_eq!(outcome.ended_by.is_some(), point.t < until, "{scene}: {point:?}");
        }
        println!("{scene}: {ended} of 11 points ended, {in_lanes} in lanes");
        assert!(ended >= 2 && in_lanes >= 6, "{scene}: {ended} {in_lanes}");
        for point in found.iter().step_by(4) {
            assert_eq!(plan.point(point.index).as_ref(), Some(point), "{scene}");
        }
        assert_eq!(points(&plan, 2), found, "{scene}");
    }
}

/// A second sweep tells how far off the ends are, and changes none.
#[test]
fn points_that_events_end_are_judged_in_lanes() {
    let events = json!([{"name": "enough", "when": "bar2.cos + 0.2", "action": "stop"}]);
    let template = with(&shipped("free"), json!({"events": events}));
    let plan = |level| planned(&template, "bar1.phi=0.5..1.5:9", &by_taylor(1.2, 1e-7)).trusted(level);
    let bare = points(&plan(Level::Off), 1);
    assert!(bare.iter().any(|point| point.t < 1.2));
    for (mut point, bare) in points(&plan(Level::Auto), 1).into_iter().zip(bare) {
        let trust = point.trust.take().expect("asked for");
        assert!(trust.error.is_some_and(|error| error < 1e-4) && trust.horizon.is_none(), "{trust:?}");
        assert_eq!(point, bare);
    }
}

/// Lanes by themselves look for no events.
#[test]
fn lanes_alone_refuse_what_an_event_ends() {
    let events = json!([{"name": "enough", "when": "bar2.cos", "action": "stop"}]);
    let template = with(&shipped("free"), json!({"events": events}));
    let scene = template.scene().expect("a scene");
    let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
    let state = Elimination::<0>::new(Arc::clone(&mechanism)).state(&mechanism.start(&scene));
    let mut members = [BatchMember::new(&mechanism, state)];
    let batch = Batch::new(Tolerance { relative: 1e-9, absolute: 1e-9 });
    batch.integrate(&mut members, Time::from(1.0), &mut |_, _| Going::On);
    let stopped = members[0].stopped.as_ref().map(|stop| stop.cause);
    assert_eq!((stopped, members[0].state.time), (Some(Cause::Unsuited), Time::from(0.0)));
}

/// A plate that is thrown and bounces on a floor below its centre of mass; its spin has no say.
#[test]
fn what_floats_bounces_as_in_the_closed_form() {
    let text = r#"{"name": "ball", "gravity": [0, -10],
        "bars": [{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 0.1, "length": 1}],
        "walls": [{"name": "floor", "body": "ball", "point": [0, 0], "restitution": 0.8,
            "line": {"through": [0, 0], "normal": [0, 1]}}],
        "outputs": ["ball.y", "floor.gap"],
        "start": {"ball": {"phi": 0, "omega": 3, "origin": [0, 1], "velocity": [0.5, 2]}},
        "until": 3, "every": 3}"#;
    let template = Template::new(text.into(), "ball".into(), &[]);
    let plan = planned(&template, "start.ball.velocity[1]=-1..4:12", &by_taylor(3.0, 1e-12));
    assert!(Batch::takes_alike(plan.mechanism()));
    for point in points(&plan, 1) {
        let (mut y, mut vy, mut left, mut most): (f64, f64, f64, f64) = (1.0, point.values[0], 3.0, 1.0);
        loop {
            let way = (vy + (vy * vy + 20.0 * y).sqrt()) / 10.0;
            most = most.max(if vy > 0.0 && vy < 10.0 * left { y + vy * vy / 20.0 } else { y });
            if way > left {
                break;
            }
            (y, vy, left) = (0.0, 0.8 * (10.0 * way - vy), left - way);
        }
        let exact = [0.5 * 3.0, y + vy * left - 5.0 * left * left];
        for (found, exact) in point.phi[1..].iter().zip(exact) {
            assert!((found - exact).abs() < 1e-11, "{point:?}: {exact}");
        }
        assert!((point.omega[2] - (vy - 10.0 * left)).abs() < 1e-11, "{point:?}");
        let [height, gap] = [point.extremes[0], point.extremes[1]];
        assert!(height[0].abs() < 1e-12 && (height[1] - most).abs() < 1e-12, "{point:?}: {most}");
        assert!(gap.iter().zip(height).all(|(a, b)| (a - b).abs() < 1e-12), "{point:?}");
    }
}

/// A random scene with outputs, and in every other one an event that ends it on the way; how long it is
/// looked at \[s\], and what kinds of parts it has.
fn random(seed: u64) -> Option<(Template, f64, Vec<Kind>)> {
    let made = match seed % 5 {
        4 => scene_with(seed, &[Kind::FloatingBody, Kind::Wall]),
        _ => random_scene(seed),
    };
    let name = |part: &Value| part["name"].as_str().map(str::to_owned);
    let text: Value = serde_json::from_str(&made.text).expect("JSON");
    let body = name(&text["bars"][0])?;
    let mut outputs = vec![format!("{body}.x"), format!("{body}.alpha"), format!("{body}.omega^2 + 1")];
    for (list, quantity) in [("hinges", "force"), ("springs", "force"), ("motors", "power"), ("walls", "gap")]
    {
        outputs.extend(name(&text[list][0]).map(|part| format!("{part}.{quantity}")));
    }
    let plain = Template::new(made.text.clone(), format!("seed {seed}"), &[]);
    let mechanism = Mechanism::new(&plain.scene().expect("a scene")).expect("equations");
    if !Batch::takes(&mechanism) && !Batch::takes_alike(&mechanism) {
        return None;
    }
    let time = made.scales.time;
    let mut parts = json!({"outputs": outputs});
    if seed.is_multiple_of(2) {
        let outcome = simulate(&plain.scene().ok()?, &by_taylor(0.6 * time, 1e-9), &mut |_| Ok(())).ok()?;
        let when = format!("{body}.phi - {}", outcome.last.phi[0]);
        parts["events"] = json!([{"name": "enough", "when": when, "action": "stop"}]);
    }
    Some((with(&made.text, parts), time, made.kinds.into_iter().collect()))
}

#[test]
fn random_scenes_with_outputs_and_ends_agree_with_single_runs() {
    let (mut seen, mut scenes, mut compared, mut ended, mut impacts) = (BTreeMap::new(), 0, 0, 0, 0);
    let (mut worst, mut whole) = ((0.0, 0), 0);
    let seeds = std::env::var("SEEDS").map_or(44, |seeds| seeds.parse().expect("a number"));
    for seed in 0..seeds {
        let Some((template, time, kinds)) = random(seed) else { continue };
        let request = Request { every: Some(0.7 * time), ..by_taylor(time, 1e-12) };
        let plan = planned(&template, "gravity[0]=0.1..0.9:9", &request);
        let (mut is_compared, mut in_lanes) = (false, false);
        for point in points(&plan, 1).iter().step_by(4) {
            let (outcome, apart) = alone(&template, &plan, point, &request);
            assert_eq!(point.status == Status::Done, outcome.stop.is_none(), "{seed}: {point:?} {outcome:?}");
            if point.status != Status::Done {
                continue;
            }
            in_lanes |= is_in_lanes(point, &outcome);
            let apart = apart.max(off(point, &outcome));
            assert!(apart < 1e-6, "{seed}: {apart:e}\n{point:?}\n{:?} {:?}", outcome.last, outcome.extremes);
            (compared, is_compared) = (compared + 1, true);
            ended += usize::from(outcome.ended_by.is_some());
            impacts += outcome.impact_count;
            worst = if apart > worst.0 { (apart, seed) } else { worst };
        }
        if is_compared {
            // What rests on its walls from the start on goes alone all the way.
            (scenes, whole) = (scenes + 1, whole + usize::from(!in_lanes));
            let floats = kinds.contains(&Kind::FloatingBody) || kinds.contains(&Kind::FloatingGroup);
            let has_walls = !plan.mechanism().contacts.is_empty();
            *seen.entry(format!("floats {floats} walls {has_walls}")).or_insert(0) += 1;
            kinds.into_iter().for_each(|kind| *seen.entry(format!("{kind:?}")).or_insert(0) += 1);
        }
    }
    println!(
        "{compared} points of {scenes} scenes, {whole} alone, {ended} points ended, {impacts} impacts, \
         at most {:.1e} apart ({}): {seen:?}",
        worst.0, worst.1
    );
    assert!(
        10 * whole < scenes && scenes > 20 && ended > 10 && impacts > 5 && seen.len() > 25,
        "{scenes} {ended} {impacts}"
    );
    assert!(seen.contains_key("floats true walls true"), "{seen:?}");
}
