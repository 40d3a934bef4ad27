//! The tangent flow through switches of laws and parts and through the transitions of dry friction, against
//! closed forms and against runs from neighbouring starts.
//!
//! `COUNT=300 cargo test --test reports -- growth_events:: --nocapture` compares more random scenes; `SEED` is
//! the first.

use crate::common::{compile, shipped};
use crate::growth::{Tally, compared, most_off, number, request, text};
use crate::mechanisms::Dice;
use driftless::run::Plan;
use driftless::run::trust::flow;
use std::fmt::Write as _;

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

/// A scene with places that stick and slide, corners of laws, or parts that events switch.
fn scene(seed: u64) -> (String, &'static str) {
    let mut dice = Dice::new(seed ^ 0x5a17_a710);
    let count = 1 + dice.pick(3);
    let kind = dice.one(&["friction", "friction", "buffer", "sign", "event"]);
    let (mut bars, mut hinges, mut starts) = (Vec::new(), Vec::new(), Vec::new());
    let mut lengths = Vec::new();
    for k in 0..count {
        let (length, mass) = (dice.within(0.3, 0.9), dice.within(0.2, 2.0));
        bars.push(format!(
            r#"{{"name": "b{k}", "mass": {mass}, "length": {length}, "centre": [{}, 0], "inertia": {}}}"#,
            0.5 * length,
            mass * length * length / 12.0
        ));
        let before = match k {
            0 => r#"{"body": "ground", "point": [0, 0]}"#.to_owned(),
            _ => format!(r#"{{"body": "b{}", "point": [{}, 0]}}"#, k - 1, lengths[k - 1]),
        };
        let mut friction = String::new();
        if kind == "friction" && (k == 0 || dice.chance(0.6)) {
            let kinetic = dice.within(0.1, 0.5);
            let most = if dice.chance(0.5) { kinetic } else { kinetic * dice.within(1.0, 1.6) };
            let radius = dice.within(0.01, 0.06);
            let _ = write!(
                friction,
                r#", "friction": {{"radius": {radius}, "kinetic": {kinetic}, "static": {most}}}"#
            );
        }
        hinges.push(format!(
            r#"{{"name": "h{k}", "between": [{before}, {{"body": "b{k}", "point": [0, 0]}}]{friction}}}"#
        ));
        starts.push(format!(
            r#""b{k}": {{"phi": {}, "omega": {}}}"#,
            dice.within(-2.5, 2.5),
            dice.within(-3.0, 3.0)
        ));
        lengths.push(length);
    }
    let last = count - 1;
    let (k, c) = (dice.size(30.0, 600.0), dice.within(0.0, 2.0));
    let at = dice.within(-0.3, 0.3);
    let extra = match kind {
        "buffer" => format!(
            r#""points": [{{"name": "tip", "body": "b{last}", "point": [{}, 0]}}],
            "forces": [{{"name": "buffer", "body": "b{last}", "point": [{}, 0],
                "force": ["if({at} - tip.x > 0, {k}*({at} - tip.x) - {c}*tip.vx, 0)", 0]}}],"#,
            lengths[last], lengths[last]
        ),
        "sign" => {
            format!(r#""torques": [{{"name": "m", "body": "b0", "torque": "-{c}*sign(b0.phi - {at})"}}],"#)
        }
        "event" => format!(
            r#""torsion_springs": [{{"name": "s", "body": "b{last}", "stiffness": {}, "free_angle": {at}}}],
            "events": [{{"name": "off", "when": "b0.phi - {at}", "direction": "falling", "off": ["s"]}},
                       {{"name": "on", "when": "b0.phi - {at}", "direction": "rising", "on": ["s"]}}],"#,
            0.1 * k
        ),
        _ => String::new(),
    };
    (
        format!(
            r#"{{"name": "random", "gravity": [0, -9.81], "bars": [{}], "hinges": [{}], {extra}
            "start": {{{}}}, "until": 4, "every": 0.5}}"#,
            bars.join(", "),
            hinges.join(", "),
            starts.join(", ")
        ),
        kind,
    )
}

/// Random scenes: within a factor of three in 95 %, and never a hundred off.
#[test]
fn growth_through_events_is_that_of_runs_from_neighbouring_starts() {
    let (count, first) = (number("COUNT", 25), number("SEED", 0));
    let mut tally = Tally::default();
    for seed in first..first + count {
        let (made, kind) = scene(seed);
        tally.take(seed, kind, compared(&text(&made), 4.0, 6));
    }
    tally.judge(count, 2);
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
    ] {
        let found = compared(&shipped(name, &[]), until, 5).expect("a flow");
        let most = most_off(&found);
        println!("{name}: {} points, {most:.4}, {} steps, {:?}", found.ratios.len(), found.steps, found.lost);
        assert!(most < 1.2 && !found.ratios.is_empty(), "{name}: {most}");
    }
}
