//! The tangent flow through switches of laws and parts and through the transitions of dry friction, against
//! closed forms and against runs from neighbouring starts.
//!
//! `COUNT=300 cargo test --test reports -- growth_events:: --nocapture` compares more random scenes; `SEED` is
//! the first.

use crate::common::{compile, shipped};
use crate::growth::{Tally, compared, most_off, number, request, text, trust};
use crate::switched::{scene, scene_of_numbers};
use driftless::run::Plan;
use driftless::run::trust::flow;
use driftless::scene::Scene;

/// A block of speed v slows down by mu g and stops for good: it comes v²/(2 mu g) far, so that dx = dx0 + v
/// dv0/(mu g) from then on, and dv = 0.
#[test]
fn a_blocks_differences_are_kept_where_it_sticks() {
    let scene = text(
        r#"{"name": "block", "gravity": [0, -10], "until": 1, "every": 0.1,
        "bars": [{"name": "block", "mass": 2, "centre": [0, 0], "inertia": 1, "length": 1}],
        "sliders": [{"name": "rail", "point": {"body": "block", "point": [0, 0]}, "friction": {"kinetic": 0.2},
                     "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "angle": "locked"}],
        "start": {"block": {"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [1.2, 0]}}}"#,
    );
    let (speed, slowing) = (1.2, 2.0);
    let mechanism = compile(&scene);
    let plan = Plan::new(&scene, &mechanism, &request(1.0, 1.0)).expect("a plan");
    let found = flow(&mechanism, &plan, &mechanism.start(&scene), &[0.3, 1.0]).expect("a flow");
    assert_eq!((found.lost, found.moments[0].columns.len()), (None, 2));
    for (k, begin) in found.moments[0].columns.iter().enumerate() {
        let [sliding, stuck] = [1, 2].map(|m| &found.moments[m].columns[k]);
        let (x, v) = (begin[1], begin[4]);
        assert!((sliding[1] - (x + 0.3 * v)).abs() < 1e-6 && (sliding[4] - v).abs() < 1e-6, "{sliding:?}");
        let far = x + speed / slowing * v;
        assert!((stuck[1] - far).abs() < 1e-6 && stuck[4].abs() < 1e-9, "{stuck:?} {far}");
    }
}

/// A rotor under a torque of constant size towards the middle: from rest at phi > 0 it comes there at t1 with
/// -w1, w1² = 2 a phi, a t1 = w1, and is slowed down by a from then on.
#[test]
fn a_rotors_differences_go_through_the_corner_of_its_law() {
    let scene = shipped("bang_bang", &[]);
    let (a, phi, t) = (2.0 / 1.5, 0.5_f64, 1.2);
    let mechanism = compile(&scene);
    let plan = Plan::new(&scene, &mechanism, &request(t, t)).expect("a plan");
    let found = flow(&mechanism, &plan, &mechanism.start(&scene), &[t]).expect("a flow");
    let w1 = (2.0 * a * phi).sqrt();
    assert!(w1 / a < t && t < 3.0 * w1 / a, "past the first corner only");
    assert_eq!(found.lost, None);
    for (begin, end) in found.moments[0].columns.iter().zip(&found.moments[1].columns) {
        let (dphi, dw) = (begin[0], begin[1]);
        // t1 = (w + sqrt(w² + 2 a phi))/a, w1 = sqrt(w² + 2 a phi); phi(t) = -w1 (t - t1) + a (t - t1)²/2.
        let dw1 = a * dphi / w1;
        let dt1 = (dw + dw1) / a;
        let late = t - w1 / a;
        let angle = -dw1 * late + w1 * dt1 - a * late * dt1;
        let rate = -dw1 - a * dt1;
        assert!((end[0] - angle).abs() < 1e-6 && (end[1] - rate).abs() < 1e-6, "{end:?} {angle} {rate}");
    }
}

/// Random scenes: within a factor of three in 95 %, and never a hundred off.
#[test]
fn growth_through_events_is_that_of_runs_from_neighbouring_starts() {
    let (count, first) = (number("COUNT", 12), number("SEED", 0));
    let mut tally = Tally::default();
    for seed in first..first + count {
        let (made, kind) = scene(seed);
        tally.take(seed, kind, compared(&text(&made), 4.0, 6));
    }
    tally.judge(count, 2);
}

/// The same of events that set numbers, and of motors with aims.
#[test]
fn growth_through_numbers_that_are_set_is_that_of_runs_from_neighbouring_starts() {
    let (count, first) = (number("COUNT", 12), number("SEED", 0));
    let mut tally = Tally::default();
    for seed in first..first + count {
        let (made, kind) = scene_of_numbers(seed);
        if std::env::var("SHOW").is_ok() {
            println!("{made}");
        }
        tally.take(seed, kind, compared(&text(&made), 4.0, 6));
    }
    tally.judge(count, 2);
}

/// A free rotor is pushed from the angle a on, by a torque that grows from the moment it comes there: phi = a +
/// w s + c s³/(6 I), s = t - t1, t1 = (a - phi0)/w.
#[test]
fn a_rotors_differences_go_on_with_the_moment_that_an_event_has_set() {
    let scene = text(
        r#"{"name": "timed", "gravity": [0, 0], "until": 2, "every": 0.5,
        "bars": [{"name": "rotor", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "rotor", "point": [0, 0]}]}],
        "parameters": {"on": 0, "from": 0},
        "torques": [{"name": "push", "body": "rotor", "torque": "1.2*on*(t - from)"}],
        "events": [{"name": "there", "when": "rotor.phi - 0.9", "set": {"on": 1, "from": "t"}}],
        "start": {"rotor": {"phi": 0.1, "omega": 1.6}}}"#,
    );
    let (a, phi, w, c, inertia) = (0.9, 0.1, 1.6, 1.2, 0.5);
    let mechanism = compile(&scene);
    let plan = Plan::new(&scene, &mechanism, &request(2.0, 2.0)).expect("a plan");
    let found = flow(&mechanism, &plan, &mechanism.start(&scene), &[2.0]).expect("a flow");
    assert_eq!(found.lost, None);
    let since = 2.0 - (a - phi) / w;
    for (begin, end) in found.moments[0].columns.iter().zip(&found.moments[1].columns) {
        let (dphi, dw) = (begin[0], begin[1]);
        let later = -dphi / w - (a - phi) / (w * w) * dw;
        let angle = dw * since - (w + 0.5 * c / inertia * since * since) * later;
        let rate = dw - c / inertia * since * later;
        assert!((end[0] - angle).abs() < 1e-6 && (end[1] - rate).abs() < 1e-6, "{end:?} {angle} {rate}");
    }
}

/// Two balls that reach the floor at the same moment, and know nothing of each other: each goes on as alone.  A
/// box that lands flat does not: which of its corners is first decides what follows.
#[test]
fn differences_go_through_two_walls_at_once_where_their_order_does_not_matter() {
    let ball = |name: &str| {
        format!(r#"{{"name": "{name}", "mass": 2, "centre": [0, 0], "inertia": 1, "length": 1}}"#)
    };
    let wall = |number: u32, body: &str, x: f64| {
        format!(
            r#"{{"name": "floor{number}", "body": "{body}", "point": [{x}, 0], "line": {{"through": [0, 0], "normal": [0, 1]}}, "restitution": 0.7}}"#
        )
    };
    let made = |bars: String, walls: String, starts: &str| {
        text(&format!(
            r#"{{"name": "balls", "gravity": [0, -10], "until": 0.6, "every": 0.1, "bars": [{bars}], "walls": [{walls}], "start": {{{starts}}}}}"#
        ))
    };
    let start = |name: &str, x: f64| {
        format!(r#""{name}": {{"phi": 0, "omega": 0, "origin": [{x}, 0.8], "velocity": [0.3, -1]}}"#)
    };
    let followed = |scene: &Scene| {
        let mechanism = compile(scene);
        let plan = Plan::new(scene, &mechanism, &request(0.6, 0.6)).expect("a plan");
        flow(&mechanism, &plan, &mechanism.start(scene), &[0.6]).expect("a flow")
    };
    let [one, two] = ["one", "two"];
    let together = followed(&made(
        [ball(one), ball(two)].join(", "),
        [wall(1, one, 0.0), wall(2, two, 0.0)].join(", "),
        &[start(one, 0.0), start(two, 3.0)].join(", "),
    ));
    assert_eq!(together.lost, None);
    let (g, e, y, v, t) = (10.0, 0.7, 0.8, -1.0_f64, 0.6);
    let v1 = (v * v + 2.0 * g * y).sqrt();
    let t1 = (v + v1) / g;
    let n = together.moments[0].motion.phi.len();
    for (begin, end) in together.moments[0].columns.iter().zip(&together.moments[1].columns) {
        for k in [3, 5] {
            let (dy, dv) = (begin[k], begin[n + k]);
            let dv1 = (v * dv + g * dy) / v1;
            let dt1 = (dv + dv1) / g;
            let height = e * dv1 * (t - t1) - e * v1 * dt1 + g * (t - t1) * dt1;
            let speed = e * dv1 + g * dt1;
            assert!(
                (end[k] - height).abs() < 1e-7 && (end[n + k] - speed).abs() < 1e-6,
                "{k}: {begin:?} {end:?} {height} {speed}"
            );
        }
    }
    let flat =
        followed(&made(ball(one), [wall(1, one, -0.5), wall(2, one, 0.5)].join(", "), &start(one, 0.0)));
    assert!(flat.lost.as_ref().is_some_and(|why| why.contains("met first decides")), "{:?}", flat.lost);
}

/// The shipped scenes with friction, corners and switches.
#[test]
fn growth_is_right_on_shipped_scenes_with_events() {
    for (name, until) in [
        ("friction_pendulum", 5.0),
        ("stick_slip", 12.0),
        ("one_sided_spring", 5.0),
        ("bang_bang", 5.0),
        ("trebuchet", 2.0),
        ("latch", 5.0),
    ] {
        let found = compared(&shipped(name, &[]), until, 5).expect("a flow");
        let most = most_off(&found);
        println!("{name}: {} points, {most:.4}, {} steps, {:?}", found.ratios.len(), found.steps, found.lost);
        assert!(most < 1.2 && !found.ratios.is_empty(), "{name}: {most}");
    }
}

/// Two bars that lie still until an event pulls at them: differences go on with the pull, as in a scene that is
/// pulled from the start.
#[test]
fn a_motion_that_begins_at_rest_grows_as_one_that_begins_with_its_event() {
    let scene = |pull: &str, event: &str, until: f64| {
        text(&format!(
            r#"{{"name": "pulled", "gravity": [0, 0], "until": {until}, "every": 0.5, "bars": [
            {{"name": "b", "mass": 1, "centre": [0.5, 0], "inertia": 0.08, "length": 1}},
            {{"name": "c", "mass": 2, "centre": [0.35, 0], "inertia": 0.08, "length": 0.7}}], "hinges": [
            {{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}]}},
            {{"name": "B", "between": [{{"body": "b", "point": [1, 0]}}, {{"body": "c", "point": [0, 0]}}]}}],
            "parameters": {{"k": {pull}}}, "forces": [{{"name": "F", "body": "c", "point": [0.7, 0], "force": [0, "k"]}}],
            "events": [{event}],
            "start": {{"b": {{"phi": 0.5, "omega": 0}}, "c": {{"phi": 1, "omega": 0}}}}}}"#
        ))
    };
    let late = trust(&scene("0", r#"{"name": "pull", "when": "t - 1", "set": {"k": -10}}"#, 3.0), 3.0);
    let early = trust(&scene("-10", "", 2.0), 2.0);
    assert_eq!((&late.no_growth, &early.no_growth), (&None, &None));
    let [late, early] = [late, early].map(|trust| trust.input_error.expect("a figure"));
    assert!(late < 5.0 * early && early < 5.0 * late, "{late:e} and {early:e}");
}
