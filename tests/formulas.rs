//! Scenes with formulas: against closed forms and against the scene's own parts.

use driftless::Level;
use driftless::run::{Limits, MethodId, Outcome, Plan, Request, Run, integrate, simulate};
use driftless::scene::formula::Formula;
use driftless::scene::{Scene, parse_scene, read_scene};
use driftless::{Mechanism, Simulation};
use proptest::prelude::*;
use std::sync::Arc;

fn value(text: &str) -> f64 {
    Formula::parse(text).unwrap_or_else(|error| panic!("{text}: {error}")).value(&[])
}

pub fn scene(text: &str) -> Scene {
    parse_scene(text, "test", &[]).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(text: &str) -> String {
    parse_scene(text, "test", &[]).expect_err("no scene").to_string()
}

pub fn run(scene: &Scene, request: &Request) -> Outcome {
    let mechanism = Arc::new(Mechanism::new(scene).unwrap_or_else(|error| panic!("{}: {error}", scene.name)));
    let plan =
        Plan::new(scene, &mechanism, request).unwrap_or_else(|refusal| panic!("{}: {refusal}", scene.name));
    let start = mechanism.start(scene);
    let run = Run::new(mechanism, plan, Limits::default(), &start).expect("a run");
    integrate(run.trusted(Level::Auto, &start), &mut |_| Ok(())).expect("samples")
}

pub fn adaptive(method: MethodId, rtol: f64) -> Request {
    Request { method: Some(method), rtol: Some(rtol), atol: Some(rtol), ..Request::default() }
}

pub fn methods() -> Vec<Request> {
    vec![
        adaptive(MethodId::Dopri5, 1e-10),
        adaptive(MethodId::Dop853, 1e-11),
        adaptive(MethodId::Dp5, 1e-10),
        adaptive(MethodId::Dp8, 1e-12),
        adaptive(MethodId::Taylor, 1e-13),
        adaptive(MethodId::Radau(3), 1e-9),
        adaptive(MethodId::Radau(5), 1e-11),
    ]
}

/// A bar on its centre without gravity, of moment of inertia 1.5 kg·m², with more of a scene.
pub fn rotor(start: [f64; 2], until: f64, more: &str) -> String {
    format!(
        r#"{{"name": "rotor", "gravity": [0, 0], "bars": [{{"name": "bar", "mass": 1, "centre": [0, 0], "inertia": 1.5}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}}],
        "start": {{"bar": {{"phi": {}, "omega": {}}}}}, "until": {until}, "every": {until}, {more}}}"#,
        start[0], start[1]
    )
}

#[test]
fn operators_bind_as_in_mathematics() {
    for (text, expected) in [
        ("-2^2", -4.0),
        ("2^3^2", 512.0),
        ("2^-2", 0.25),
        ("1 - 2 - 3", -4.0),
        ("8/4/2", 1.0),
        ("2*-3", -6.0),
        ("(-2)^3", -8.0),
        ("(-2)^(4/2)", 4.0),
        ("1.5e2 + .5", 150.5),
        ("sqrt(16) + pow(2, 3)", 12.0),
        ("cos(pi)", -1.0),
        ("log(exp(2)) + tanh(0) + tan(0) + sin(0)", 2.0),
        ("5 mm", 0.005),
        ("180 deg - pi", 0.0),
        ("2 N*s/m + 1", 3.0),
        ("3 m/s^2*2", 6.0),
        ("60 rpm/(2*pi)", 1.0),
        ("abs(-3) + sign(-2) + min(1, 2) + max(1, 2)", 5.0),
        ("if(1 < 2, 10, 20) + if(1 > 2, 1, 2)", 12.0),
        ("if(1 >= 1, 3, 4) + if(1 <= 1, 10, 20)", 13.0),
        ("if(1 >= 2, 3, 4) + if(1 <= 2, 10, 20)", 14.0),
        ("if(2 >= 1, 3, 4) + if(2 <= 1, 10, 20)", 23.0),
        ("if(1 > 1, 3, 4) + if(1 < 1, 10, 20)", 24.0),
        // A number for a condition.
        ("if(0.1, 3, 4) + if(0, 10, 20) + if(-2, 100, 200)", 223.0),
        ("10 rad*s^-1", 10.0),
        ("3 mm^-2", 3e6),
        ("2 m/s^-1", 2.0),
        ("2 km*s^-1 + 1", 2001.0),
        ("10 kg*m^2*s^-2", 10.0),
        ("5 mm ^2 + 5 mm^ 2", 1e-5),
    ] {
        assert!((value(text) - expected).abs() < 1e-14 * expected.abs().max(1.0), "{text} = {}", value(text));
    }
    assert_eq!(Formula::parse("a*b.c - a").expect("a formula").value(&[3.0, 5.0]), 12.0);
}

/// In all quadrants, and switched where it jumps: nowhere, where the second argument is positive whatever the
/// names are.
#[test]
fn an_angle_is_that_of_the_standard_library_and_has_a_switch_where_it_can_jump() {
    let angle = Formula::parse("atan2(a, b)").expect("a formula");
    let sizes = [-3.0, -0.5, -1e-9, 0.0, 1e-9, 0.25, 2.0_f64];
    for (y, x) in sizes.iter().flat_map(|&y| sizes.map(|x| (y, x))) {
        let found = angle.value(&[y, x]);
        assert!((found - y.atan2(x)).abs() < 1e-15, "atan2({y}, {x}) = {found}");
    }
    let switches = |text: &str| Formula::parse(text).expect(text).conditions();
    for (text, expected) in [
        ("atan2(a, b)", 2),
        ("atan2(a, 2 + b)", 2),
        ("atan2(a, cos(b) - 1)", 2),
        ("atan2(a, -1)", 2),
        ("atan2(a, 2 - cos(b))", 0),
        ("atan2(a, 1 + sqrt(b) + c^2)", 0),
        ("atan2(a, 3)", 0),
        ("atan2(-1, -2)*a", 0),
    ] {
        assert_eq!(switches(text), expected, "{text}");
    }
}

/// A parameter that an event sets to 1 exactly: from 1 s on the torque gives the rotor 1 rad/s each second.
#[test]
fn a_flag_that_an_event_sets_is_equal_to_what_it_is_set_to() {
    let flagged = scene(
        r#"{"name": "flag", "gravity": [0, 0], "parameters": {"mode": 0},
            "bars": [{"name": "bar", "mass": 1, "centre": [0, 0], "inertia": 0.2, "length": 0.5}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
            "torques": [{"name": "T", "body": "bar", "torque": "if(mode >= 1, 0.2, 0)"}],
            "events": [{"name": "e", "when": "t - 1", "set": {"mode": 1}}],
            "start": {"bar": {"phi": 0, "omega": 0}}, "until": 2, "every": 1}"#,
    );
    for method in [MethodId::Taylor, MethodId::Dp8] {
        let rate = run(&flagged, &adaptive(method, 1e-10)).last.omega[0];
        assert!((rate - 1.0).abs() < 1e-9, "{method}: {rate}");
    }
}

#[test]
fn refusals_of_formulas_point_at_the_place() {
    let message = |text: &str| Formula::parse(text).expect_err("no formula").to_string();
    assert_eq!(
        message("2*sinn(x)"),
        "column 3: unknown function sinn\n  | 2*sinn(x)\n  |   ^^^^\n  hint: did you mean sin?"
    );
    for (text, begins) in [
        ("", "column 1: the formula ends too early"),
        ("1 +", "column 4: the formula ends too early"),
        ("(1 + 2", "column 1: this parenthesis is never closed"),
        ("1)", "column 2: this parenthesis closes nothing"),
        ("30 dge", "column 4: dge is no unit"),
        ("2 m^2^2", "column 4: the power of a unit"),
        ("2 m^(2)", "column 4: the power of a unit"),
        ("2 m^0.5", "column 4: the power of a unit"),
        ("2 m*s^12", "column 6: the power of a unit"),
        ("x y", "column 3: an operator is missing here"),
        ("a < b", "column 3: a comparison outside of `if`"),
        ("atan2(1)", "column 1: atan2 takes 2 arguments, not 1"),
        ("sin(1, 2)", "column 1: sin takes 1 argument, not 2"),
        ("1e999", "column 1: this number is too large"),
        ("ä + 1", "column 1: a number, a name or ( is missing here"),
        ("x..y", "column 1: a part of this name is empty"),
        (&"(".repeat(500), "column 65: nested too deeply"),
        (&"1+".repeat(5000), "column 1: the formula is too long"),
    ] {
        assert!(message(text).starts_with(begins), "{text}: {}", message(text));
    }
}

#[test]
fn one_parameter_moves_a_bar_and_its_hinge() {
    let with = |parameters: &str, length: &str| {
        format!(
            r#"{{"name": "two", "gravity": [9.81, 0], {parameters}
            "bars": [{{"name": "a", "length": {length}, "width": 0.05, "thickness": 0.003, "density": 670}},
                     {{"name": "b", "length": {length}, "width": 0.05, "thickness": 0.003, "density": 670}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}},
                       {{"name": "B", "between": [{{"body": "a", "point": [{length}, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
            "start": {{"a": {{"phi": 1, "omega": 0}}, "b": {{"phi": 1, "omega": 0}}}}, "until": 1, "every": 1}}"#
        )
    };
    let text = with(r#""parameters": {"l": 0.6, "twice": "2*l"},"#, r#""l""#);
    assert_eq!(scene(&text), Scene { parameters: scene(&text).parameters, ..scene(&with("", "0.6")) });
    for set in ["l=0.75", "parameters.l=0.75", "l=3/4"] {
        let moved = parse_scene(&text, "test", &[set.parse().expect("an override")]).expect("a scene");
        assert_eq!((moved.bars[1].length, moved.hinges[1].between[0].point), (0.75, [0.75, 0.0]), "{set}");
        assert_eq!(moved.parameters[1].value, 1.5);
    }
    // What is written out reads back to the same.
    let again = parse_scene(&scene(&text).to_input().to_string(), "again", &[]).expect("a scene");
    assert_eq!(again, scene(&text));
}

#[test]
fn refusals_in_scenes_name_the_place() {
    let base = |parameters: &str, torque: &str| {
        rotor(
            [1.0, 0.0],
            1.0,
            &format!(
                r#""parameters": {{{parameters}}}, "torques": [{{"name": "T", "body": "bar", "torque": {torque}}}]"#
            ),
        )
    };
    for (parameters, torque, says) in [
        (r#""k": "2*q""#, "1", "unknown name q"),
        (r#""a": "b", "b": "a""#, "1", "is made of itself: a of b of a"),
        (r#""t": 1"#, "1", "has a meaning of its own"),
        (r#""k": 1"#, r#""-k*bar.phy""#, "did you mean bar.phi?"),
        (r#""k": "2 mm""#, r#""k""#, "is m, not N·m"),
        (r#""k": 1"#, r#""-k*bar.phi + 2 m""#, "is m, not N·m"),
        (r#""k": 1"#, r#""sin(2 s)""#, "takes a pure number, not s"),
        (r#""k": 1"#, r#""t + 2 m""#, "puts s and m together"),
        (r#""k": 1"#, r#""(""#, "ends too early"),
    ] {
        let message = refused(&base(parameters, torque));
        assert!(message.contains(says) && message.contains('^'), "{message}");
    }
    let with = |more: &str| refused(&rotor([1.0, 0.0], 1.0, more));
    let law = with(r#""torques": [{"name": "T", "body": "bar", "torque": "-bar.phi", "law": {"start": 1}}]"#);
    assert!(law.contains("stands beside a formula"), "{law}");
    let potential = with(r#""potentials": [{"name": "V", "energy": "0.5*bar.omega^2"}]"#);
    assert!(potential.contains("depends on bar.omega"), "{potential}");
    let through = with(r#""signals": {"s": "t^2"}, "potentials": [{"name": "V", "energy": "2*s"}]"#);
    assert!(through.contains("depends on s, which depends on t"), "{through}");
    let part = with(r#""events": [{"name": "E", "when": "bar.phi", "off": ["sprnig"]}]"#);
    assert!(part.contains("events[0].off[0]"), "{part}");
    let twice = with(
        r#""torques": [{"name": "T", "body": "bar", "torque": 1}, {"name": "U", "body": "bar", "torque": 1}],
        "events": [{"name": "E", "when": "bar.phi", "on": ["T"], "off": ["U", "T"]}]"#,
    );
    assert!(twice.contains("events[0].off[1] = \"T\"") && twice.contains("does not switch on"), "{twice}");
}

/// An event would switch all of that name without a word.
#[test]
fn a_name_of_several_parts_cannot_be_switched() {
    let with = |more: &str| {
        rotor(
            [1.0, 0.0],
            1.0,
            &format!(
                r#""torques": [{{"name": "s", "body": "bar", "torque": 1}}, {{"name": "u", "body": "bar", "torque": 1}}],
                "torsion_springs": [{{"name": "s", "body": "bar", "stiffness": 6, "free_angle": 1}}], {more}"#
            ),
        )
    };
    let event = |what: &str| format!(r#""events": [{{"name": "E", "when": "bar.phi", {what}}}]"#);
    for (more, place) in [
        (event(r#""off": ["u", "s"]"#), "events[0].off[1]"),
        (event(r#""on": ["s"]"#), "events[0].on[0]"),
        (r#""inactive": ["s"]"#.to_owned(), "inactive[0]"),
    ] {
        let message = refused(&with(&more));
        let says =
            format!("{place} = \"s\" is the name of a torsion spring and a torque: must be the name of one");
        assert!(message.contains(&says) && message.contains("hint: rename"), "{message}");
    }
    scene(&with(&event(r#""off": ["u"]"#)));
}

/// What an event sets is judged as what stands in its place, as far as that is known where it is read.
#[test]
fn values_that_events_set_fit_their_parameters() {
    let with = |k: &str, set: &str| {
        rotor(
            [1.0, 0.0],
            1.0,
            &format!(
                r#""parameters": {{"k": {k}}}, "torques": [{{"name": "T", "body": "bar", "torque": "k"}}],
                "events": [{{"name": "E", "when": "bar.phi", "set": {{"k": {set}}}}}]"#
            ),
        )
    };
    for (k, set, says) in [
        (r#""3 N*m""#, r#""2 m""#, ".set.k = \"2 m\": is m: must be of the unit of the parameter k, J"),
        ("3", "1e40", "comes to 1e40: must be a number from -1e30 to 1e30"),
        ("3", r#""1/0""#, "is infinite: must be a number"),
        ("3", r#""1e29*k^4""#, "comes to 8.1e30: must be a number"),
        ("3", r#""sqrt(-k)""#, "has no value: must be a number"),
    ] {
        let message = refused(&with(k, set));
        assert!(message.contains(says) && message.contains("hint: "), "{message}");
    }
    for (k, set) in [(r#""3 N*m""#, "2"), (r#""3 N*m""#, r#""0.5*k""#), ("3", r#""1/bar.omega""#)] {
        let scene = scene(&with(k, set));
        let mechanism = Mechanism::new(&scene).expect("a mechanism");
        assert_eq!(Plan::new(&scene, &mechanism, &Request::default()).expect("a plan").notes, [""; 0]);
    }
    let vain = with("3", "2").replace(r#""torque": "k""#, r#""torque": 1"#);
    let vain = scene(&vain);
    let mechanism = Mechanism::new(&vain).expect("a mechanism");
    let notes = Plan::new(&vain, &mechanism, &Request::default()).expect("a plan").notes;
    assert!(matches!(&notes[..], [note] if note.starts_with("events set k, but no law")), "{notes:?}");
}

/// Hints say what was meant.
#[test]
fn slips_in_formulas_are_told_by_what_was_meant() {
    let with = |torque: &str, more: &str| {
        refused(&rotor(
            [1.0, 0.0],
            1.0,
            &format!(
                r#""tables": {{"g": [[0, 0], [1, 1], [2, 3]]}}, {more}
                "torques": [{{"name": "T", "body": "bar", "torque": "{torque}"}}]"#
            ),
        ))
    };
    for (torque, more, problem, hint) in [
        ("3*g", "", "g is a table", "hint: write g(…)"),
        ("bar.phi*PI", "", "unknown name PI", "hint: did you mean pi?"),
        ("3 bar.phi", "", "bar.phi is no unit", "hint: write products with *, as in 2*bar.phi"),
        ("bar.omega**2", "", "is missing here", "hint: powers are written with ^"),
        ("t + 1 m/s^2", "", "puts s and m/s² together", "hint: "),
        ("a", r#""signals": {"a": "2*b", "b": "t"},"#, "b is a signal that comes later", "write b first"),
        ("a", r#""signals": {"a": "2*a"},"#, "a is made of itself", "hint: a signal is made of those before"),
        ("k", r#""parameters": {"k": "2*q"},"#, "unknown name q", "hint: there is no other parameter"),
        ("k", r#""parameters": {"k": "2*bar.phi"},"#, "unknown name bar.phi", "state is a signal"),
        ("1", r#""parameters": {"pi": 3},"#, "has a meaning of its own", "hint: pi is the number 3.14159…"),
        ("1", r#""parameters": {"sin": 3},"#, "has a meaning of its own", "hint: sin is a function"),
    ] {
        let message = with(torque, more);
        assert!(message.contains(problem) && message.contains(hint), "{torque} {more}: {message}");
    }
    let rate = rotor([1.0, 0.0], 1.0, r#""signals": {}"#);
    let rate = refused(&rate.replace(r#""omega": 0"#, r#""omega": "3 rad""#));
    assert!(rate.contains("hint: write 3 rad/s"), "{rate}");
    let nine = parse_scene(
        &rotor([1.0, 0.0], 1.0, r#""signals": {}"#),
        "test",
        &["bar9.phi=1".parse().expect("an override")],
    );
    let nine = nine.expect_err("no such bar").to_string();
    assert!(nine.contains("bar9.phi does not exist") && nine.contains("did you mean `bar`?"), "{nine}");
}

#[test]
fn a_spring_as_a_formula_is_the_scenes_own_in_every_method() {
    let mut own = read_scene("examples/scenes/spring.json".as_ref(), &[]).expect("a scene");
    (own.until, own.every) = (1.0, 1.0);
    let mut input = own.to_input();
    let spring = &input["springs"][0];
    let (k, free) = (&spring["stiffness"], &spring["free_length"]);
    let between = spring["between"].clone();
    let texts =
        [("potential", format!("{k}*(length - {free})^2/2")), ("tension", format!("{k}*(length - {free})"))];
    let reference = run(&own, &adaptive(MethodId::Taylor, 1e-14));
    for (key, text) in texts {
        input["springs"] = serde_json::json!([{"name": "spring", "between": between, key: text}]);
        let other = scene(&input.to_string());
        let fixed =
            Request { method: Some(MethodId::Gauss(8)), step: Some(1.0 / 512.0), ..Request::default() };
        for request in methods().iter().chain([&fixed]) {
            let outcome = run(&other, request);
            assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
            for (a, b) in reference.last.phi.iter().zip(&outcome.last.phi) {
                assert!((a - b).abs() < 3e-8, "{key} by {:?}: {a} and {b}", request.method);
            }
            assert!(outcome.drift.energy.max < 1e-8, "{:?}: {:e}", request.method, outcome.drift.energy.max);
        }
    }
}

/// A torque of constant size towards the middle: parabolas, a quarter of a period √(2 φ₀ J/k).
#[test]
fn a_switching_torque_moves_along_parabolas() {
    let (phi, k, inertia, until) = (0.7_f64, 2.0, 1.5, 20.0);
    let quarter = (2.0 * phi * inertia / k).sqrt();
    let phase = (until / quarter) % 4.0;
    let (whole, rest) = (phase.floor(), phase.fract());
    let side = if whole == 0.0 || whole == 3.0 { 1.0 } else { -1.0 };
    let from_turn = if whole == 0.0 || whole == 2.0 { rest } else { 1.0 - rest };
    let expected = side * phi * (1.0 - from_turn * from_turn);
    let text = rotor(
        [phi, 0.0],
        until,
        r#""parameters": {"k": 2}, "torques": [{"name": "bang", "body": "bar", "torque": "-k*sign(bar.phi)"}]"#,
    );
    for request in methods() {
        let outcome = run(&scene(&text), &request);
        assert!(outcome.stop.is_none(), "{:?}", outcome.stop);
        let error = (outcome.last.phi[0] - expected).abs();
        assert!(error < 1e-9, "{:?}: {error:e}", request.method);
        let trust = outcome.trust.expect("an estimate");
        assert!(trust.error_estimate.is_some_and(|estimate| estimate < 1e-8), "{:?}", request.method);
    }
    // A fixed step is cut short at a switch, and the next one ends on the grid again.
    for method in [MethodId::Gauss(2), MethodId::Gauss(8)] {
        let fixed = Request { method: Some(method), step: Some(1.0 / 64.0), ..Request::default() };
        let outcome = run(&scene(&text), &fixed);
        assert!(outcome.stop.is_none(), "{:?}", outcome.stop);
        assert!((outcome.last.phi[0] - expected).abs() < 1e-9, "{method}: {}", outcome.last.phi[0]);
    }
}

/// Dry friction as a formula sticks, and sticking slides along its corner: refused by name, at the time where it
/// sticks.  Without a spring: ω = ω₀ - bt/J until J ω₀/b.
#[test]
fn sliding_along_a_corner_is_named() {
    let text = rotor(
        [0.0, 2.0],
        10.0,
        r#""torques": [{"name": "dry", "body": "bar", "torque": "-0.5*sign(bar.omega)"}]"#,
    );
    for request in methods() {
        let stop = run(&scene(&text), &request).stop.expect("a stop");
        assert_eq!(stop.cause.word(), "sliding", "{stop:?}");
        assert!((stop.t - 6.0).abs() < 1e-9 && stop.what.contains("dry"), "{stop:?}");
    }
}

/// An impact turns the rate round without passing zero: dry friction of constant size brakes before and after.
#[test]
fn a_switch_that_an_impact_jumps_across_is_seen() {
    let text = rotor(
        [0.0, 2.0],
        2.0,
        r#""torques": [{"name": "dry", "body": "bar", "torque": "-0.3*sign(bar.omega)"}],
        "walls": [{"name": "w", "body": "bar", "point": [0.5, 0], "line": {"through": [0, 0.25], "normal": [0, -1]}, "restitution": 0.5}]"#,
    );
    let (wall, braking) = (std::f64::consts::FRAC_PI_6, 0.2);
    let speed = (4.0 - 2.0 * braking * wall).sqrt();
    let after = 2.0 - (2.0 - speed) / braking;
    let expected = wall - 0.5 * speed * after + 0.5 * braking * after * after;
    for request in methods() {
        if matches!(request.method, Some(MethodId::Dopri5 | MethodId::Dop853)) {
            continue;
        }
        let outcome = run(&scene(&text), &request);
        assert!(
            outcome.stop.is_none() && outcome.impact_count == 1,
            "{:?}: {:?}",
            request.method,
            outcome.stop
        );
        let error = (outcome.last.phi[0] - expected).abs();
        assert!(error < 1e-8, "{:?}: {} and {expected}", request.method, outcome.last.phi[0]);
        assert!(outcome.drift.energy.max < 1e-8, "{:?}: {:e}", request.method, outcome.drift.energy.max);
    }
}

/// Events: a spring ceases to act when the rotor passes zero, then it turns at a constant rate √(k/J) φ₀.
#[test]
fn events_switch_parts_and_set_parameters() {
    let text = rotor(
        [0.5, 0.0],
        10.0,
        r#""parameters": {"k": 6}, "torsion_springs": [{"name": "coil", "body": "bar", "potential": "k*angle^2/2"}],
        "events": [{"name": "middle", "when": "bar.phi", "off": ["coil"]},
                   {"name": "turn", "when": "bar.phi + pi", "action": "stop"}]"#,
    );
    let rate = (6.0_f64 / 1.5).sqrt();
    let release = std::f64::consts::FRAC_PI_2 / rate;
    let end = release + std::f64::consts::PI / (0.5 * rate);
    for request in methods() {
        let outcome = run(&scene(&text), &request);
        assert_eq!(outcome.ended_by.as_deref(), Some("turn"), "{:?} {:?}", request.method, outcome.stop);
        let times: Vec<f64> = outcome.events.iter().map(|event| event.t).collect();
        assert!((times[0] - release).abs() < 1e-8 && (times[1] - end).abs() < 1e-7, "{times:?}");
        assert!(outcome.drift.energy.max < 1e-8);
    }
    // The stiffness is a quarter from the first passage on: the second half of the swing takes twice as long.
    let text = rotor(
        [0.5, 0.0],
        3.0 * release,
        r#""parameters": {"k": 6}, "torsion_springs": [{"name": "coil", "body": "bar", "torque": "k*angle"}],
        "events": [{"name": "middle", "when": "bar.phi", "direction": "falling", "set": {"k": "k/4"}}]"#,
    );
    for request in methods() {
        let outcome = run(&scene(&text), &request);
        assert!((outcome.last.phi[0] + 1.0).abs() < 1e-7, "{:?}: {}", request.method, outcome.last.phi[0]);
    }
    // A part that is inactive at first: free until the event, then a swing about it.
    let text = rotor(
        [0.0, 1.0],
        1.0 + std::f64::consts::FRAC_PI_2 / 2.0,
        r#""torsion_springs": [{"name": "latch", "body": "bar", "stiffness": 6, "free_angle": 1}], "inactive": ["latch"],
        "events": [{"name": "there", "when": "bar.phi - 1", "on": ["latch"]}]"#,
    );
    for request in methods() {
        let outcome = run(&scene(&text), &request);
        assert!((outcome.last.phi[0] - 1.5).abs() < 1e-8, "{:?}: {}", request.method, outcome.last.phi[0]);
    }
}

/// Pauses and samples change no bit where laws switch.
#[test]
fn switching_runs_end_in_the_same_bits_however_sampled_and_resumed() {
    let text = rotor(
        [0.7, 0.1],
        8.0,
        r#""parameters": {"k": 2}, "signals": {"lag": "bar.phi + 0.1*bar.omega"},
        "torques": [{"name": "bang", "body": "bar", "torque": "-k*sign(lag) - 0.1*abs(bar.phi)"}],
        "events": [{"name": "soft", "when": "t - 3", "set": {"k": "k/2"}}]"#,
    );
    for request in [
        adaptive(MethodId::Taylor, 1e-12),
        adaptive(MethodId::Dp8, 1e-11),
        adaptive(MethodId::Radau(5), 1e-10),
    ] {
        let whole = run(&scene(&text), &request);
        assert!(whole.stop.is_none(), "{:?}", whole.stop);
        let fine = Scene { every: 0.01, ..scene(&text) };
        assert_eq!(whole.last.phi, run(&fine, &request).last.phi, "{:?}", request.method);
        let mechanism = Arc::new(Mechanism::new(&fine).expect("equations"));
        let start = mechanism.start(&fine);
        let plan = Plan::new(&fine, &mechanism, &request).expect("a plan");
        let run = Run::new(Arc::clone(&mechanism), plan, Limits::default(), &start).expect("a run");
        let mut running = driftless::run::Running::new(run);
        let mut count = 0;
        loop {
            let mut pauses = || {
                count += 1;
                count % 7 == 0
            };
            if running.go(&mut |_: &driftless::Sample| Ok(()), &mut pauses).expect("samples") {
                break;
            }
            let snapshot = serde_json::to_string(&running.snapshot()).expect("JSON");
            let snapshot = serde_json::from_str(&snapshot).expect("a snapshot");
            running =
                driftless::run::Running::resume(Arc::clone(&mechanism), &start, snapshot).expect("resumed");
        }
        assert_eq!(running.finish().last.phi, whole.last.phi, "{:?}", request.method);
    }
}

#[test]
fn a_simulation_takes_scenes_with_formulas() {
    let text = rotor(
        [0.3, 0.0],
        1.0,
        r#""torques": [{"name": "PD", "body": "bar", "torque": "-4*bar.phi - 0.5*bar.omega"}]"#,
    );
    let outcome = Simulation::new(&scene(&text)).expect("equations").run().expect("a run");
    // J φ'' + c φ' + k φ = 0.
    let (decay, rate): (f64, f64) = (0.5 / 3.0, (4.0_f64 / 1.5 - (0.5_f64 / 3.0).powi(2)).sqrt());
    let expected = 0.3 * (-decay).exp() * (rate.cos() + decay / rate * rate.sin());
    assert!((outcome.last.phi[0] - expected).abs() < 1e-8);
}

/// A PID controller: J e‴ + 9 e″ + 16.5 e′ + 9 e = 0 has the roots -1, -2 and -3.
#[test]
fn an_integral_is_a_further_unknown_in_every_method() {
    let text = rotor(
        [1.5, 0.0],
        2.0,
        r#""parameters": {"aim": 0.5}, "integrals": {"sum": "aim - bar.phi"},
        "torques": [{"name": "PID", "body": "bar", "torque": "16.5*(aim - bar.phi) + 9*sum - 9*bar.omega"}]"#,
    );
    let expected = |t: f64| -2.5 * (-t).exp() + 8.0 * (-2.0 * t).exp() - 4.5 * (-3.0 * t).exp();
    let gauss = Request { method: Some(MethodId::Gauss(8)), step: Some(1.0 / 64.0), ..Request::default() };
    for request in methods().iter().chain([&gauss]) {
        let outcome = run(&scene(&text), request);
        let error = (outcome.last.phi[0] - 0.5 - expected(2.0)).abs();
        assert!(error < 1e-9, "{:?}: {error:e}", request.method);
        assert!(outcome.drift.energy.max < 1e-8, "{:?}: {:e}", request.method, outcome.drift.energy.max);
    }
    let again = parse_scene(&scene(&text).to_input().to_string(), "again", &[]).expect("a scene");
    assert_eq!(again, scene(&text));
}

/// How large an integral is makes no step of a mechanism with a wall shorter: no wall sees it.
#[test]
fn steps_beside_a_wall_do_not_depend_on_the_size_of_an_integral() {
    let steps = |size: &str| {
        let text = format!(
            r#"{{"name": "bar", "gravity": [0, -9.81], "parameters": {{"size": {size}}}, "integrals": {{"I": "size*cos(b.phi)"}},
            "bars": [{{"name": "b", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
            "walls": [{{"name": "W", "body": "b", "point": [1, 0], "restitution": 0.5, "line": {{"through": [0, -2], "normal": [0, 1]}}}}],
            "start": {{"b": {{"phi": 0.5, "omega": 0}}}}, "until": 2, "every": 2}}"#
        );
        run(&scene(&text), &adaptive(MethodId::Taylor, 1e-10)).statistics.steps
    };
    let [small, large] = ["0.01", "1e5"].map(steps);
    println!("{small} and {large} steps");
    assert!(large < 3 * small, "{small} and {large} steps");
}

/// What carries an integral has no energy of its own to speak of, however large the integral is.
#[test]
fn an_integral_is_no_energy() {
    let text = r#"{"name": "bar", "gravity": [0, -9.81], "integrals": {"I": "1e6*b.sin"},
        "bars": [{"name": "b", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}]}],
        "start": {"b": {"phi": 0.5, "omega": 0}}, "until": 2, "every": 0.25}"#;
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Gauss(8)] {
        let request = Request { method: Some(method), ..Request::default() };
        let outcome = simulate(&scene(text), &request, &mut |sample| {
            let expected = 0.5 * (0.1 + 0.25) * sample.omega[0].powi(2);
            assert!(
                (sample.kinetic - expected).abs() < 1e-14 * (1.0 + expected),
                "{method}: {}",
                sample.kinetic
            );
            assert!(sample.work.abs() < 1e-14, "{method}: {}", sample.work);
            Ok(())
        });
        assert!(outcome.expect("a run").stop.is_none(), "{method}");
    }
}

#[test]
fn a_motors_law_may_be_a_formula_of_time() {
    let motor = |law: &str| {
        let more =
            format!(r#""parameters": {{"w": 3}}, "motors": [{{"name": "M", "body": "bar", "law": {law}}}]"#);
        rotor([0.0, 0.0], 1.0, &more).replace(r#""start": {"bar": {"phi": 0, "omega": 0}}, "#, "")
    };
    let sines = r#"{"start": 0.5, "rate": 2, "acceleration": -1, "sines": [{"amplitude": 0.2, "frequency": 3, "phase": 0}]}"#;
    assert_eq!(scene(&motor(r#""0.5 + 2*t - t^2/2 + 0.2*sin(w*t)""#)), scene(&motor(sines)));
    // Any other formula is one too.
    assert!(scene(&motor(r#""exp(2*t)""#)).motors[0].law.profile.is_some());
    let refusal = refused(&motor(r#""2 m*t""#));
    assert!(refusal.contains("not rad"), "{refusal}");
}

/// A torque by a table of x² (3 - 2x) up to 1, constant beyond: every piece is a polynomial, every knot a step's end.
#[test]
fn a_table_of_time_acts_as_its_spline() {
    let points = [0.0, 0.3, 0.7, 1.0].map(|x: f64| format!("[{x}, {}]", x * x * (3.0 - 2.0 * x))).join(", ");
    let text = rotor(
        [0.0, 0.0],
        2.0,
        &format!(
            r#""tables": {{"ramp": [{points}]}}, "torques": [{{"name": "T", "body": "bar", "torque": "ramp(t)"}}]"#
        ),
    );
    for request in methods() {
        let outcome = run(&scene(&text), &request);
        assert!(
            (outcome.last.phi[0] - (0.15 / 1.5 + 1.0 / 3.0 + 0.5 / 1.5)).abs() < 1e-9,
            "{:?}",
            request.method
        );
        assert!((outcome.last.omega[0] - 1.5 / 1.5).abs() < 1e-9, "{:?}", request.method);
    }
    assert_eq!(
        parse_scene(&scene(&text).to_input().to_string(), "again", &[]).expect("a scene"),
        scene(&text)
    );
    let wrong = refused(&text.replace("[0.3, ", "[0.8, "));
    assert!(wrong.contains("tables.ramp[2]") && wrong.contains("sort the points"), "{wrong}");
}

/// Laws that come to numbers, or to a parabola, are formulas where an event sets what they are made of: a torque of
/// 1.5 N·m and then of 4.5, and a motor at (t - 1)² that goes on at 3 (t - 1)².
#[test]
fn an_event_sets_a_parameter_of_every_law() {
    let event = r#""events": [{"name": "e", "when": "t - 1", "set": {"k": 3}}], "parameters": {"k": 1}"#;
    let torque = format!(r#"{event}, "torques": [{{"name": "T", "body": "bar", "torque": "k*(1.5 N*m)"}}]"#);
    let motor =
        format!(r#"{event}, "motors": [{{"name": "M", "body": "bar", "law": "k*(t - 1 s)^2*(1 s^-2)"}}]"#);
    for request in methods() {
        let outcome = run(&scene(&rotor([0.0, 0.0], 2.0, &torque)), &request);
        assert!((outcome.last.omega[0] - 4.0).abs() < 1e-9, "{:?}: {:?}", request.method, outcome.last);
        let text = rotor([1.0, -2.0], 2.0, &motor);
        let text = text.replace(r#""start": {"bar": {"phi": 1, "omega": -2}}, "#, "");
        let outcome = run(&scene(&text), &request);
        assert!(outcome.stop.is_none(), "{:?}", outcome.stop);
        let last = [outcome.last.phi[0], outcome.last.omega[0]];
        assert!((last[0] - 3.0).abs() + (last[1] - 6.0).abs() < 1e-9, "{:?}: {last:?}", request.method);
    }
    let factor =
        format!(r#"{event}, "torques": [{{"name": "T", "body": "bar", "torque": 1, "law": "k*t/(1 s)"}}]"#);
    let refused = refused(&rotor([0.0, 0.0], 2.0, &factor));
    assert!(refused.contains("torques[0].law") && refused.contains("which an event sets"), "{refused}");
}

/// A function that is zero as a run begins has not passed it there, whichever way it goes on.
#[test]
fn a_function_at_zero_at_the_start_makes_no_event_there() {
    for (phi, omega) in [(0.3, 1.0), (0.3, -1.0), (0.7, 1.0), (0.7, -1.0), (0.0, 1.0)] {
        let events = format!(
            r#""events": [{{"name": "e", "when": "bar.phi - {phi}"}}, {{"name": "t", "when": "sin(pi*t)"}}]"#
        );
        let text = rotor([phi, omega], 1.5, &events);
        for request in methods() {
            let outcome = run(&scene(&text), &request);
            let names: Vec<_> = outcome.events.iter().map(|event| (event.name.as_str(), event.t)).collect();
            assert!(
                matches!(names[..], [("t", t)] if (t - 1.0).abs() < 1e-9),
                "{:?} from {phi} at {omega}: {names:?}",
                request.method
            );
        }
    }
}

proptest! {
    #[test]
    fn no_text_makes_the_parser_panic(text in ".{0,200}", bytes in "[-+*/^()., a-z0-9<>=]{0,200}") {
        for text in [&text, &bytes] {
            match Formula::parse(text) {
                Ok(formula) => drop(formula.value(&vec![0.5; formula.names().count()])),
                Err(error) => drop(error.to_string()),
            }
        }
    }
}

/// The integral from 0 to t of `exp(-((s - at)/width)^2)`, and the integral of that.
fn pulse([at, width]: [f64; 2], t: f64) -> [f64; 2] {
    let primitive = |x: f64| {
        let root = std::f64::consts::PI.sqrt();
        [0.5 * root * libm::erf(x), 0.5 * (x * root * libm::erf(x) + (-x * x).exp())]
    };
    let ([first, second], [from, from_second]) = (primitive((t - at) / width), primitive(-at / width));
    [width * (first - from), width * width * (second - from_second) - width * t * from]
}

/// Blows of 30 ms to 1 ms, which no power at a step's beginning and no stage of a long step tells of.
#[test]
fn narrow_pulses_are_not_stepped_over() {
    let pulses = [[2.3, 0.03], [4.711, 0.003], [7.0931, 0.001]];
    let text =
        |name: &str| pulses.map(|[at, width]| format!("30*exp(-(({name} - {at})/{width})^2)")).join(" + ");
    let torque = |law: &str| format!(r#""torques": [{{"name": "k", "body": "bar", "torque": "{law}"}}]"#);
    let [speed, angle] = pulses
        .map(|of| pulse(of, 10.0))
        .iter()
        .fold([1.0, 10.0], |sum, [v, x]| [sum[0] + 20.0 * v, sum[1] + 20.0 * x]);
    let in_time = scene(&rotor([0.0, 1.0], 10.0, &torque(&text("t"))));
    // By the angle: energy.
    let energy = pulses.map(|[_, width]| 40.0 * width * std::f64::consts::PI.sqrt());
    let by_angle = scene(&rotor([0.0, 1.0], 10.0, &torque(&text("bar.phi"))));
    for request in &methods()[2..] {
        let last = run(&in_time, request).last;
        assert!((last.omega[0] - speed).abs() < 1e-7, "{:?}: {} {speed}", request.method, last.omega[0]);
        assert!((last.phi[0] - angle).abs() < 1e-6, "{:?}: {} {angle}", request.method, last.phi[0]);
        let (last, all) = (run(&by_angle, request).last, energy.iter().sum::<f64>());
        let expected = (1.0 + all).sqrt();
        assert!(
            (last.omega[0] - expected).abs() < 1e-7,
            "{:?}: {} {expected}",
            request.method,
            last.omega[0]
        );
    }
}

/// ∫ exp(50 (cos 2πt - 1)) over a period, by the trapezoidal rule, which is exact for it.
#[test]
fn pulses_of_a_period_and_between_tangents_are_not_stepped_over() {
    let more = r#""torques": [{"name": "k", "body": "bar", "torque": "15*exp(50*(cos(2*pi*t)-1))"}],
        "integrals": {"I": "tanh((t-2.3)/(0.01 s)) - tanh((t-2.4)/(0.01 s))"}"#;
    let scene = scene(&rotor([0.0, 1.0], 5.0, more));
    let count = 1000;
    let value =
        |k: i32| (50.0 * ((std::f64::consts::TAU * f64::from(k) / f64::from(count)).cos() - 1.0)).exp();
    let speed = 1.0 + 5.0 * 10.0 * (0..count).map(value).sum::<f64>() / f64::from(count);
    for request in &methods()[2..] {
        let last = run(&scene, request).last;
        assert!((last.omega[0] - speed).abs() < 1e-6, "{:?}: {} {speed}", request.method, last.omega[0]);
        let area = last.omega.last().copied().unwrap_or_default();
        assert!((area - 0.2).abs() < 1e-6, "{:?}: {area}", request.method);
    }
}

/// Events and outputs on a free rotor, and a wall that hits a ball at rest.
#[test]
fn narrow_events_outputs_and_blows_of_walls_are_found() {
    let more = r#""events": [{"name": "t", "when": "exp(-((t-2.3)/(0.001 s))^2) - 0.5"},
        {"name": "phi", "when": "exp(-((bar.phi-3.1)/0.001)^2) - 0.5"}],
        "outputs": {"o": "2*exp(-((bar.phi-4.3)/0.001)^2)"}"#;
    let rotor = scene(&rotor([0.0, 1.0], 5.0, more));
    let wall = scene(
        r#"{"name": "wall", "gravity": [0, 0],
        "bars": [{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.1}],
        "walls": [{"name": "hammer", "body": "ball", "point": [0, 0], "restitution": 0.5,
            "line": {"through": [0, 0], "normal": [0, 1]}, "law": "0.5*exp(-((t-2.3)/(0.03 s))^2)"}],
        "start": {"ball": {"phi": 0, "omega": 0, "origin": [0, 0.2], "velocity": [0, 0]}},
        "until": 5, "every": 5}"#,
    );
    let half = 0.001 * std::f64::consts::LN_2.sqrt();
    // It is hit at x widths before the middle, where the wall is 0.2 m high, and leaves at 1.5 of its speed.
    let x = 2.5_f64.ln().sqrt();
    let (hit, speed) = (2.3 - 0.03 * x, 1.5 * 0.2 * 2.0 * x / 0.03);
    for request in &methods()[2..] {
        let outcome = run(&rotor, request);
        for (name, at) in [("t", 2.3), ("phi", 3.1)] {
            let found: Vec<f64> =
                outcome.events.iter().filter(|one| one.name == name).map(|one| one.t).collect();
            assert_eq!(found.len(), 2, "{:?}: {name} at {found:?}", request.method);
            assert!((found[0] - at + half).abs().max((found[1] - at - half).abs()) < 1e-9, "{found:?}");
        }
        let output = &outcome.extremes[0];
        assert!((output.max[0] - 2.0).abs() < 1e-9 && (output.max[1] - 4.3).abs() < 1e-6, "{output:?}");
        let mean = 2e-3 * std::f64::consts::PI.sqrt() / 5.0;
        assert!((output.mean - mean).abs() < 1e-9, "{} {mean}", output.mean);
        let outcome = run(&wall, request);
        assert_eq!(outcome.impact_count, 1, "{:?}", request.method);
        let (y, expected) = (outcome.last.centre[0][1], 0.2 + speed * (5.0 - hit));
        assert!((y - expected).abs() < 1e-6, "{:?}: {y} {expected}", request.method);
    }
}
