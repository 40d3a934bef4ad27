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
use driftless::scene::Scene;
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

/// A chain of bars from the ground, as text.
struct Chain {
    bars: Vec<String>,
    hinges: Vec<String>,
    starts: Vec<String>,
    lengths: Vec<f64>,
}

impl Chain {
    fn new(dice: &mut Dice, count: usize, has_friction: bool) -> Self {
        let mut chain =
            Self { bars: Vec::new(), hinges: Vec::new(), starts: Vec::new(), lengths: Vec::new() };
        for k in 0..count {
            let (length, mass) = (dice.within(0.3, 0.9), dice.within(0.2, 2.0));
            chain.bars.push(format!(
                r#"{{"name": "b{k}", "mass": {mass}, "length": {length}, "centre": [{}, 0], "inertia": {}}}"#,
                0.5 * length,
                mass * length * length / 12.0
            ));
            let before = match k {
                0 => r#"{"body": "ground", "point": [0, 0]}"#.to_owned(),
                _ => format!(r#"{{"body": "b{}", "point": [{}, 0]}}"#, k - 1, chain.lengths[k - 1]),
            };
            let mut friction = String::new();
            if has_friction && (k == 0 || dice.chance(0.6)) {
                let kinetic = dice.within(0.1, 0.5);
                let most = if dice.chance(0.5) { kinetic } else { kinetic * dice.within(1.0, 1.6) };
                let radius = dice.within(0.01, 0.06);
                let _ = write!(
                    friction,
                    r#", "friction": {{"radius": {radius}, "kinetic": {kinetic}, "static": {most}}}"#
                );
            }
            chain.hinges.push(format!(
                r#"{{"name": "h{k}", "between": [{before}, {{"body": "b{k}", "point": [0, 0]}}]{friction}}}"#
            ));
            chain.starts.push(format!(
                r#""b{k}": {{"phi": {}, "omega": {}}}"#,
                dice.within(-2.5, 2.5),
                dice.within(-3.0, 3.0)
            ));
            chain.lengths.push(length);
        }
        chain
    }

    /// A scene with this beside the chain.
    fn with(&self, extra: &str) -> String {
        format!(
            r#"{{"name": "random", "gravity": [0, -9.81], "bars": [{}], "hinges": [{}], {extra}
            "start": {{{}}}, "until": 4, "every": 0.5}}"#,
            self.bars.join(", "),
            self.hinges.join(", "),
            self.starts.join(", ")
        )
    }
}

/// A scene with places that stick and slide, corners of laws, or parts that events switch.
fn scene(seed: u64) -> (String, &'static str) {
    let mut dice = Dice::new(seed ^ 0x5a17_a710);
    let count = 1 + dice.pick(3);
    let kind = dice.one(&["friction", "friction", "buffer", "sign", "event"]);
    let chain = Chain::new(&mut dice, count, kind == "friction");
    let last = count - 1;
    let tip = chain.lengths[last];
    let (k, c) = (dice.size(30.0, 600.0), dice.within(0.0, 2.0));
    let at = dice.within(-0.3, 0.3);
    let extra = match kind {
        "buffer" => format!(
            r#""points": [{{"name": "tip", "body": "b{last}", "point": [{tip}, 0]}}],
            "forces": [{{"name": "buffer", "body": "b{last}", "point": [{tip}, 0],
                "force": ["if({at} - tip.x > 0, {k}*({at} - tip.x) - {c}*tip.vx, 0)", 0]}}],"#
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
    (chain.with(&extra), kind)
}

/// A scene whose events set parameters, to the same values for neighbours or to others, or whose motors aim at
/// where the mechanism is.
fn scene_of_numbers(seed: u64) -> (String, &'static str) {
    let mut dice = Dice::new(seed ^ 0x5e70_f5e7);
    let count = 1 + dice.pick(2);
    let kind = dice.one(&["constant", "caught", "timed", "counted", "gear", "cam", "wall"]);
    let mut chain = Chain::new(&mut dice, count, false);
    let last = count - 1;
    let (k, c) = (dice.size(1.0, 40.0), dice.within(0.5, 3.0));
    let at = dice.within(-0.3, 0.3);
    let spring = |torque: &str| {
        format!(r#""torsion_springs": [{{"name": "s", "body": "b{last}", "torque": "{torque}"}}],"#)
    };
    let gear = |law: &str| {
        format!(
            r#""motors": [{{"name": "m", "body": "wheel", "law": "{law}"}}], {}"#,
            spring(&format!("{k}*angle"))
        )
    };
    let extra = match kind {
        "constant" => format!(
            r#""parameters": {{"k": {k}}}, {}
            "events": [{{"name": "soft", "when": "b0.phi - {at}", "direction": "falling", "set": {{"k": "k/2"}}}},
                       {{"name": "hard", "when": "b0.phi - {at}", "direction": "rising", "set": {{"k": "{k}"}}}}],"#,
            spring("k*angle")
        ),
        "caught" => format!(
            r#""parameters": {{"p": 0}}, {}
            "events": [{{"name": "passes", "when": "b0.phi - {at}", "direction": "rising", "set": {{"p": "0.4*b{last}.phi + 0.1*b0.omega"}}}}],"#,
            spring(&format!("{k}*(angle - p)"))
        ),
        "timed" => format!(
            r#""parameters": {{"from": 0}}, {}
            "torques": [{{"name": "wave", "body": "b0", "torque": "{c}*sin(4*(t - from))"}}],
            "events": [{{"name": "passes", "when": "b0.phi - {at}", "set": {{"from": "t"}}}}],"#,
            spring(&format!("{k}*angle"))
        ),
        // The next event is at a place that the last one has set.
        "counted" => format!(
            r#""parameters": {{"p": 0, "next": {at}}}, {}
            "events": [{{"name": "turn", "when": "b0.omega", "direction": "rising", "set": {{"next": "0.5*b0.phi"}}}},
                       {{"name": "passes", "when": "b0.phi - next", "direction": "rising", "set": {{"p": "0.2*b{last}.omega"}}}}],"#,
            spring(&format!("{k}*(angle - p)"))
        ),
        // A curved wall, which the other parts move as well.
        "wall" => format!(
            r#""walls": [{{"name": "w", "body": "b{last}", "point": [{}, 0], "restitution": {},
                "line": {{"through": [{}, 0], "normal": [1, 0]}}, "law": "0.1*sin(2*b0.phi) + 0.05*b{last}.cos + 0.05*sin({c}*t)"}}],"#,
            chain.lengths[last],
            dice.within(0.5, 1.0),
            -0.4 * chain.lengths.iter().sum::<f64>()
        ),
        _ => {
            chain.bars.push(
                r#"{"name": "wheel", "mass": 1.5, "length": 0.2, "centre": [0.04, 0], "inertia": 0.02}"#
                    .into(),
            );
            chain.hinges.push(
                r#"{"name": "axle", "between": [{"body": "ground", "point": [2, 0]}, {"body": "wheel", "point": [0, 0]}]}"#
                    .into(),
            );
            gear(&match kind {
                "gear" => format!("{c}*b{last}.phi"),
                _ => format!("0.3*sin({c}*b{last}.phi) + 0.2*b0.cos + 0.1*sin(2*t)"),
            })
        }
    };
    (chain.with(&extra), kind)
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

/// The same of events that set numbers, and of motors with aims.
#[test]
fn growth_through_numbers_that_are_set_is_that_of_runs_from_neighbouring_starts() {
    let (count, first) = (number("COUNT", 25), number("SEED", 0));
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
