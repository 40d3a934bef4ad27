//! Places with dry friction that share one degree of freedom, of which fewer would hold it: closed forms.

use super::formulas::{adaptive, run, scene};
use super::friction::Dice;
use super::laws::rk4;
use driftless::dynamics::Mechanism;
use driftless::run::{MethodId, Outcome};

const G: f64 = 10.0;
/// Masses of the two blocks and of the rod between them \[kg\].
const MASS: [f64; 3] = [2.0, 3.0, 1.0];
/// Coefficients of the two rails, while they slide and while they stick.
const KINETIC: [f64; 2] = [0.2, 0.4];
const STATIC: [f64; 2] = [0.3, 0.6];

/// Two blocks on one line with a rod between them, each with friction, and a force on the first one.
fn blocks(force: &str, until: f64) -> String {
    let ([one, two, rod], [k1, k2], [s1, s2]) = (MASS, KINETIC, STATIC);
    let block = |name: &str, mass: f64| {
        format!(r#"{{"name": "{name}", "mass": {mass}, "centre": [0, 0], "inertia": 0.1, "length": 0.2}}"#)
    };
    let rail = |name: &str, body: &str, kinetic: f64, stiction: f64| {
        format!(
            r#"{{"name": "{name}", "point": {{"body": "{body}", "point": [0, 0]}}, "angle": "locked",
            "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}},
            "friction": {{"kinetic": {kinetic}, "static": {stiction}}}}}"#
        )
    };
    format!(
        r#"{{"name": "blocks", "gravity": [0, -{G}],
        "bars": [{}, {}, {{"name": "rod", "mass": {rod}, "centre": [0.5, 0], "inertia": 0.1, "length": 1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "one", "point": [0, 0]}}, {{"body": "rod", "point": [0, 0]}}]}},
            {{"name": "B", "between": [{{"body": "rod", "point": [1, 0]}}, {{"body": "two", "point": [0, 0]}}]}}],
        "sliders": [{}, {}],
        "forces": [{{"name": "F", "body": "one", "point": [0, 0], "force": ["{force}", 0]}}],
        "start": {{"one": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}}, "rod": {{"phi": 0, "omega": 0}},
            "two": {{"phi": 0, "omega": 0}}}},
        "until": {until}, "every": {until}}}"#,
        block("one", one),
        block("two", two),
        rail("first", "one", k1, s1),
        rail("second", "two", k2, s2),
    )
}

/// What both rails hold together, and what they take while they slide \[N\].
fn capacity(coefficients: [f64; 2]) -> f64 {
    let [one, two, rod] = MASS;
    G * (coefficients[0] * (one + 0.5 * rod) + coefficients[1] * (two + 0.5 * rod))
}

fn runs(text: &str) -> Vec<(String, Outcome)> {
    let scene = scene(text);
    [adaptive(MethodId::Taylor, 1e-14), adaptive(MethodId::Dp8, 1e-13), adaptive(MethodId::Radau(5), 1e-13)]
        .into_iter()
        .map(|request| {
            let outcome = run(&scene, &request);
            let name = request.method.expect("a method").to_string();
            assert!(outcome.stop.is_none(), "{name}: {:?}", outcome.stop);
            (name, outcome)
        })
        .collect()
}

/// Where the first block is.
fn travelled(outcome: &Outcome) -> f64 {
    *outcome.last.phi.get(3).expect("the way of the first block")
}

#[test]
fn two_rails_hold_what_they_can_hold_together_and_then_slide() {
    let (rate, until) = (10.0, 4.0);
    let (holds, takes, mass) = (capacity(STATIC), capacity(KINETIC), MASS.iter().sum::<f64>());
    let begin = holds / rate;
    assert!(begin < until && holds > 1.2 * G * STATIC[1] * (MASS[1] + 0.5), "neither holds alone");
    let by = until - begin;
    let way = (rate * begin - takes) * by * by / (2.0 * mass) + rate * by * by * by / (6.0 * mass);
    for sign in [1.0, -1.0] {
        for (name, outcome) in runs(&blocks(&format!("{}*t", sign * rate), until)) {
            let off = travelled(&outcome) - sign * way;
            println!("{name}: {:?}, off by {off:e} of {way}", outcome.frictions);
            assert!(off.abs() < 1e-9, "{name}: off by {off:e}");
        }
    }
}

#[test]
fn a_force_to_and_fro_below_what_both_rails_hold_moves_nothing() {
    let most = 0.999 * capacity(STATIC);
    for (name, outcome) in runs(&blocks(&format!("{most}*sin(3*t)"), 10.0)) {
        println!("{name}: {} transitions", outcome.friction_count);
        assert!(travelled(&outcome).abs() < 1e-12, "{name}: {:e}", travelled(&outcome));
        assert!(outcome.friction_count <= 2, "{name}: {:?}", outcome.frictions);
    }
    // A little more, and both slide a little in every half period.
    for (name, outcome) in runs(&blocks(&format!("{}*sin(3*t)", 1.01 * capacity(STATIC)), 1.0)) {
        assert!(travelled(&outcome) > 1e-3, "{name}: {:e}", travelled(&outcome));
    }
}

#[test]
fn a_block_with_friction_rests_against_a_wall_until_it_is_pulled_off() {
    let (mass, [kinetic, stiction], push, rate, until) = (2.0, [0.4, 0.6], 30.0, 1.0_f64, 3.0);
    // Pushed against the wall by more than friction holds, then by less, then pulled.
    let begin = (-stiction * mass * G / push).acos() / rate;
    let (by, accelerated) = (until - begin, push / (mass * rate * rate));
    let way = accelerated * ((rate * until).cos() - (rate * begin).cos())
        + accelerated * rate * (rate * begin).sin() * by
        - kinetic * G * by * by / 2.0;
    // Set against it, and thrown against it.
    for start in [r#""origin": [0, 0], "velocity": [0, 0]"#, r#""origin": [0.5, 0], "velocity": [-2, 0]"#] {
        let text = format!(
            r#"{{"name": "block", "gravity": [0, -{G}],
            "bars": [{{"name": "block", "mass": {mass}, "centre": [0, 0], "inertia": 0.1, "length": 0.2}}],
            "sliders": [{{"name": "rail", "point": {{"body": "block", "point": [0, 0]}}, "angle": "locked",
                "rail": {{"body": "ground", "point": [0, 0], "direction": [1, 0]}},
                "friction": {{"kinetic": {kinetic}, "static": {stiction}}}}}],
            "walls": [{{"name": "wall", "body": "block", "point": [0, 0], "restitution": 0,
                "line": {{"through": [0, 0], "normal": [1, 0]}}}}],
            "forces": [{{"name": "F", "body": "block", "point": [0, 0], "force": ["-{push}*cos({rate}*t)", 0]}}],
            "start": {{"block": {{"phi": 0, "omega": 0, {start}}}}}, "until": {until}, "every": {until}}}"#
        );
        for (name, outcome) in runs(&text) {
            let off = outcome.last.phi[1] - way;
            println!("{name}: {:?}, off by {off:e} of {way}", outcome.frictions);
            assert!(off.abs() < 1e-9, "{name}: off by {off:e}");
        }
    }
}

/// A balanced wheel that a motor turns by a law, on a shaft with friction.
fn wheel(law: &str, until: f64) -> String {
    format!(
        r#"{{"name": "wheel", "gravity": [0, -{G}],
        "bars": [{{"name": "wheel", "mass": 2, "centre": [0, 0], "inertia": 0.3, "length": 0.4}}],
        "hinges": [{{"name": "shaft", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "wheel", "point": [0, 0]}}],
            "friction": {{"radius": 0.05, "kinetic": 0.2, "static": 0.3}}}}],
        "motors": [{{"name": "motor", "body": "wheel", "law": "{law}"}}],
        "start": {{}}, "until": {until}, "every": {until}}}"#
    )
}

#[test]
fn what_a_motor_holds_needs_no_friction_and_slides_as_soon_as_it_is_moved() {
    let torque = 0.2 * 0.05 * 2.0 * G;
    let dwells = [
        // At rest for a second.
        ("if(t < 1, 0, (t - 1)^4/2)", 2.0, 0.5),
        // At rest for a moment at every zero, where it does not turn back.
        ("0.3*sin(2*t)^3", 4.0, 1.5 + 0.3 * (1.0 - 8.0_f64.sin().powi(3))),
        // Never at rest.
        ("0.3*t", 2.0, 0.6),
        // Always.
        ("0.3", 2.0, 0.0),
    ];
    for (law, until, turned) in dwells {
        for (name, outcome) in runs(&wheel(law, until)) {
            let off = outcome.last.friction - torque * turned;
            println!("{law}, {name}: off by {off:e}, {:?}", outcome.frictions);
            assert!(off.abs() < 1e-9, "{law}, {name}: off by {off:e}");
        }
    }
}

/// The parts of a linkage but what drives it.
#[derive(Default)]
struct LinkageParts {
    bars: Vec<String>,
    hinges: Vec<String>,
    slider: String,
    starts: Vec<String>,
}

impl LinkageParts {
    fn bar(&mut self, dice: &mut Dice, name: &str, length: f64) {
        self.bars.push(dice.bar(name, length));
    }

    /// A hinge between two points, mostly with friction.
    fn hinge(&mut self, dice: &mut Dice, name: &str, one: (&str, [f64; 2]), other: (&str, [f64; 2])) {
        let mut friction = String::new();
        if dice.is(0.7) {
            let kinetic = dice.within(0.05, 0.3);
            let stiction = kinetic * if dice.is(0.5) { 1.0 } else { dice.within(1.0, 1.5) };
            let radius = dice.within(0.01, 0.04);
            friction = format!(
                r#", "friction": {{"radius": {radius}, "kinetic": {kinetic}, "static": {stiction}}}"#
            );
        }
        self.hinges.push(format!(
            r#"{{"name": "{name}", "between": [{{"body": "{}", "point": {:?}}}, {{"body": "{}", "point": {:?}}}]{friction}}}"#,
            one.0, one.1, other.0, other.1
        ));
    }

    /// A point of a bar on a rail of another one or of the ground.
    fn slide(&mut self, bar: &str, at: f64, rail: &str) {
        self.slider = format!(
            r#""sliders": [{{"name": "S", "point": {{"body": "{bar}", "point": [{at}, 0]}},
                "rail": {{"body": "{rail}", "point": [0, 0], "direction": [1, 0]}}, "friction": {{"kinetic": 0.15, "static": 0.2}}}}],"#
        );
    }

    fn start(&mut self, bar: &str, phi: f64) {
        self.starts.push(format!(r#""{bar}": {{"phi": {phi}}}"#));
    }

    /// The end of the crank slides in a rocker.
    fn slotted_rocker(&mut self, dice: &mut Dice, crank: f64, pin: [f64; 2], base: f64) {
        self.bar(dice, "b", 1.4);
        self.hinge(dice, "B", ("ground", [base, 0.0]), ("b", [0.0; 2]));
        self.slide("a", crank, "b");
        self.start("b", pin[1].atan2(pin[0] - base));
    }

    /// The end of the rod slides along the ground.
    fn slider_crank(&mut self, dice: &mut Dice, crank: f64, pin: [f64; 2], rod: f64) {
        self.bar(dice, "b", rod);
        self.hinge(dice, "B", ("a", [crank, 0.0]), ("b", [0.0; 2]));
        self.slide("b", rod, "ground");
        self.start("b", (-pin[1] / rod).asin());
    }

    /// A rocker as long as the rod: the joint is above the middle between the pins.
    fn four_bar(&mut self, dice: &mut Dice, crank: f64, pin: [f64; 2], [rod, base]: [f64; 2]) {
        let to = [base - pin[0], -pin[1]];
        let apart = to[0].hypot(to[1]);
        let height = (rod * rod - 0.25 * apart * apart).sqrt();
        let joint =
            [pin[0] + 0.5 * to[0] - height * to[1] / apart, pin[1] + 0.5 * to[1] + height * to[0] / apart];
        self.bar(dice, "b", rod);
        self.bar(dice, "c", rod);
        self.hinge(dice, "B", ("a", [crank, 0.0]), ("b", [0.0; 2]));
        self.hinge(dice, "C", ("ground", [base, 0.0]), ("c", [0.0; 2]));
        self.hinge(dice, "D", ("b", [rod, 0.0]), ("c", [rod, 0.0]));
        self.start("b", (joint[1] - pin[1]).atan2(joint[0] - pin[0]));
        self.start("c", joint[1].atan2(joint[0] - base));
    }
}

/// A crank with a slotted rocker, a slider-crank or a four-bar, with friction in most joints, springs, torques and
/// motors, some of which rest for a while, and a stop for the crank.
pub fn linkage(seed: u64) -> String {
    let mut dice = Dice(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) + 7);
    let (crank, rod, base) = (dice.within(0.15, 0.3), dice.within(0.7, 1.0), dice.within(0.6, 0.9));
    let phi = dice.within(-3.0, 3.0);
    let pin = [crank * phi.cos(), crank * phi.sin()];
    let mut parts = LinkageParts::default();
    parts.bar(&mut dice, "a", crank);
    parts.hinge(&mut dice, "A", ("ground", [0.0; 2]), ("a", [0.0; 2]));
    match dice.next() {
        kind if kind < 0.4 => parts.slotted_rocker(&mut dice, crank, pin, base),
        kind if kind < 0.7 => parts.slider_crank(&mut dice, crank, pin, rod),
        _ => parts.four_bar(&mut dice, crank, pin, [rod, base]),
    }
    let LinkageParts { bars, hinges, slider, mut starts } = parts;
    let mut more = String::new();
    if dice.is(0.25) {
        let law = match dice.next() {
            kind if kind < 0.4 => format!("{phi} + {}*t", dice.within(-4.0, 4.0)),
            kind if kind < 0.7 => format!("{phi} + 0.5*sin(3*t)"),
            _ => format!("{phi} + if(t < 0.5, 0, (t - 0.5)^4/1.5)"),
        };
        more += &format!(r#""motors": [{{"name": "m", "body": "a", "law": "{law}"}}],"#);
    } else {
        let omega = if dice.is(0.3) { 0.0 } else { dice.within(-6.0, 6.0) };
        starts.push(format!(r#""a": {{"phi": {phi}, "omega": {omega}}}"#));
    }
    if dice.is(0.5) {
        more += &format!(
            r#""torsion_springs": [{{"name": "k", "body": "b", "stiffness": {}, "free_angle": 0, "damping": 0.05}}],"#,
            dice.within(0.0, 4.0)
        );
    }
    if dice.is(0.5) {
        more += &format!(
            r#""torques": [{{"name": "T", "body": "a", "torque": "{}*sin(2*t)"}}],"#,
            dice.within(0.0, 2.0)
        );
    }
    // A crank that a motor drives into it would have no way on.
    if !more.contains("motors") && dice.is(0.5) {
        let side = dice.within(-3.0, 3.0);
        let (normal, clear) = ([side.cos(), side.sin()], dice.within(0.0, 0.2));
        let through = [pin[0] - clear * normal[0], pin[1] - clear * normal[1]];
        let restitution = if dice.is(0.6) { 0.0 } else { dice.within(0.0, 0.6) };
        more += &format!(
            r#""walls": [{{"name": "W", "body": "a", "point": [{crank}, 0], "restitution": {restitution},
            "line": {{"through": {through:?}, "normal": {normal:?}}}}}],"#
        );
    }
    format!(
        r#"{{"name": "linkage", "gravity": [0, {}], "bars": [{}], "hinges": [{}], {slider} {more}
        "start": {{{}}}, "until": 2, "every": 0.5}}"#,
        if dice.is(0.5) { -9.81 } else { -2.0 },
        bars.join(", "),
        hinges.join(", "),
        starts.join(", ")
    )
}

#[test]
fn random_linkages_with_friction_in_their_joints_agree_between_methods() {
    let count: u64 = std::env::var("FRICTION").ok().and_then(|count| count.parse().ok()).unwrap_or(40);
    let [mut compared, mut transitions, mut resting, mut stopped] = [0_u64; 4];
    for seed in 0..count {
        let text = linkage(seed);
        let scene = scene(&text);
        let energy = Mechanism::new(&scene).expect("equations").energy_scale;
        let methods = [MethodId::Taylor, MethodId::Dp8, MethodId::Radau(5)];
        let [one, other, third] = methods.map(|method| run(&scene, &adaptive(method, 1e-11)));
        for outcome in [&one, &other, &third] {
            let method = outcome.plan.method;
            assert!(outcome.stop.is_none(), "seed {seed}, {method}: {:?}\n{text}", outcome.stop);
            // Energies are of the order of a joule, and zero where one starts at rest without weight.
            let balance = outcome.drift.energy.max * energy;
            assert!(balance < 1e-7, "seed {seed}, {method}: {balance:e} J\n{text}");
            let apart = one.last.phi.iter().zip(&outcome.last.phi).map(|(a, b)| (a - b).abs());
            let apart = apart.fold(0.0, f64::max);
            assert!(apart < 1e-6, "seed {seed}, {method}: {apart:e} apart\n{text}");
        }
        compared += 1;
        transitions += one.friction_count;
        stopped += u64::from(one.impact_count > 0);
        resting += u64::from(one.last.omega.iter().all(|omega| omega.abs() < 1e-9));
    }
    println!(
        "{compared} compared: {transitions} transitions, {resting} at rest at the end, {stopped} met a wall"
    );
    assert!(compared == count && transitions > count && resting > 0 && stopped > count / 8);
}

/// Mass \[kg\], place of the centre \[m\], moment of inertia about the hinge \[kg·m²\] and radius of the hinge
/// \[m\] of [`lifted`].
const LEVER: [f64; 4] = [2.0, 0.5, 0.2 + 2.0 * 0.25, 0.05];
const FIELD: [f64; 2] = [9.81, -2.0];

/// A bar whose end lies on a wall with friction and whose hinge has some, under a torque that grows with time.
fn lifted(kinetic: f64, stiction: f64, until: f64) -> String {
    let ([mass, centre, inertia, radius], [gx, gy]) = (LEVER, FIELD);
    let own = inertia - mass * centre * centre;
    format!(
        r#"{{"name": "lifted", "gravity": [{gx}, {gy}],
        "bars": [{{"name": "bar", "mass": {mass}, "centre": [{centre}, 0], "inertia": {own}, "length": 1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}],
            "friction": {{"radius": {radius}, "kinetic": {kinetic}, "static": {stiction}}}}}],
        "walls": [{{"name": "W", "body": "bar", "point": [1, 0], "restitution": 0, "friction": {{"kinetic": 0.3}},
            "line": {{"through": [0, 0], "normal": [0, 1]}}}}],
        "torques": [{{"name": "T", "body": "bar", "torque": "1*t"}}],
        "start": {{"bar": {{"phi": 0, "omega": 0}}}}, "until": {until}, "every": {until}}}"#
    )
}

/// The angular acceleration while the hinge slips forward: the force that presses it depends on it.
fn slipping(t: f64, phi: f64, omega: f64, kinetic: f64) -> f64 {
    let ([mass, centre, inertia, radius], [gx, gy], (s, c)) = (LEVER, FIELD, phi.sin_cos());
    let weight = mass * centre * (c * gy - s * gx);
    let mut acceleration = 0.0;
    for _ in 0..60 {
        let x = -centre * (s * acceleration + omega * omega * c) - gx;
        let y = centre * (c * acceleration - omega * omega * s) - gy;
        acceleration = (t + weight - kinetic * radius * mass * x.hypot(y)) / inertia;
    }
    acceleration
}

/// What holds the end down ceases to press, the hinge takes the rest up to what it holds, and then lets go: one
/// motion, not the one with the wall as well.
#[test]
fn a_bar_leaves_its_wall_where_the_friction_of_its_hinge_breaks() {
    let until = 3.5;
    for (kinetic, stiction) in [(0.2, 0.3), (0.2, 0.2)] {
        let [mass, centre, _, radius] = LEVER;
        let pressing = mass * FIELD[0].hypot(FIELD[1]);
        let begin = -mass * centre * FIELD[1] + stiction * radius * pressing;
        let by_hand = |after: f64, y: &[f64; 2]| [y[1], slipping(begin + after, y[0], y[1], kinetic)];
        let [phi, omega] = rk4([0.0, 0.0], until - begin, 20_000, by_hand);
        assert!(phi > 0.05 && omega > 0.01, "{phi} {omega}");
        for (name, outcome) in runs(&lifted(kinetic, stiction, until)) {
            let off = [outcome.last.phi[0] - phi, outcome.last.omega[0] - omega];
            println!("{name}, {stiction}: off by {off:?}");
            assert!(off.iter().all(|off| off.abs() < 1e-9), "{name}: {off:?} of {phi} {omega}");
        }
    }
}
