//! Random chains with friction, corners of laws, events that switch parts or set numbers, and curved walls.

use crate::mechanisms::Dice;
use std::fmt::Write as _;

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
pub fn scene(seed: u64) -> (String, &'static str) {
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
pub fn scene_of_numbers(seed: u64) -> (String, &'static str) {
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
