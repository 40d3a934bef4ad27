//! Walls that move by laws of time, are carried by bodies, and are switched: against closed forms.

use super::formulas::{adaptive, run, scene};
use driftless::Simulation;
use driftless::run::{MethodId, Outcome, Request};
use driftless::scene::{Scene, parse_scene};

const G: f64 = 9.81;

fn methods() -> [Request; 5] {
    [
        adaptive(MethodId::Dp5, 1e-11),
        adaptive(MethodId::Dp8, 1e-12),
        adaptive(MethodId::Taylor, 1e-13),
        adaptive(MethodId::Radau(3), 1e-10),
        adaptive(MethodId::Radau(5), 1e-12),
    ]
}

fn near(found: f64, expected: f64, most: f64, what: &str) {
    assert!((found - expected).abs() < most, "{what}: {found} and not {expected}");
}

/// A ball of 1 kg over a floor with this law, at a height and velocity.
fn ball(law: &str, restitution: f64, [y, v]: [f64; 2], until: f64, more: &str) -> Scene {
    scene(&format!(
        r#"{{"name": "ball", "gravity": [0, -{G}],
        "bars": [{{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.1}}],
        "walls": [{{"name": "table", "body": "ball", "point": [0, 0], "restitution": {restitution},
            "line": {{"through": [0, 0], "normal": [0, 1]}}, "law": {law}}}],
        "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [0.4, {y}], "velocity": [0, {v}]}}}},
        "until": {until}, "every": {until}{more}}}"#
    ))
}

fn finished(scene: &Scene, request: &Request) -> Outcome {
    let outcome = run(scene, request);
    assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
    outcome
}

/// Times, relative velocities and velocities afterwards of impacts on a table at `place(t)`, [place, rate], by
/// parabolas and bisection.
fn impacts(place: impl Fn(f64) -> [f64; 2], e: f64, [mut y, mut v]: [f64; 2], count: usize) -> Vec<[f64; 3]> {
    let (mut t, mut found) = (0.0, Vec::new());
    for _ in 0..count {
        let height = |s: f64| y + s * (v - 0.5 * G * s) - place(t + s)[0];
        let mut end = 1e-4;
        while height(end) > 0.0 {
            end += 1e-4;
        }
        let (mut low, mut high) = (end - 1e-4, end);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if height(middle) > 0.0 { low = middle } else { high = middle }
        }
        let [there, rate] = place(t + high);
        let approach = v - G * high - rate;
        (t, y, v) = (t + high, there, rate - e * approach);
        found.push([t, approach, v]);
    }
    found
}

/// A ball that bounces on a table: times, approaches, losses and the last parabola.
fn bounces(law: &str, place: impl Fn(f64) -> [f64; 2], e: f64, until: f64, more: &str) {
    let start = [0.3, 0.0];
    let expected: Vec<[f64; 3]> =
        impacts(&place, e, start, 40).into_iter().filter(|it| it[0] < until).collect();
    assert!(expected.len() > 2 && expected.len() < 40, "{}", expected.len());
    for request in methods() {
        let outcome = finished(&ball(law, e, start, until, more), &request);
        assert_eq!(outcome.impacts.len(), expected.len(), "{:?}", request.method);
        for (impact, [t, approach, _]) in outcome.impacts.iter().zip(&expected) {
            near(impact.t, *t, 1e-8, "time of an impact");
            near(impact.approach, *approach, 1e-7, "approach");
            near(impact.impulse, -(1.0 + e) * approach, 1e-7, "impulse");
            near(impact.energy_lost, 0.5 * (1.0 - e * e) * approach * approach, 1e-7, "energy lost");
        }
        let [t, _, v] = expected[expected.len() - 1];
        let rest = until - t;
        near(outcome.last.phi[2], place(t)[0] + rest * (v - 0.5 * G * rest), 1e-7, "height");
        near(outcome.last.omega[2], v - G * rest, 1e-7, "velocity");
        assert!(outcome.drift.energy.max < 1e-8, "{:?}: {:e}", request.method, outcome.drift.energy.max);
    }
}

#[test]
fn a_ball_bounces_on_a_table_that_oscillates() {
    let sine = |t: f64| [0.01 * (40.0 * t).sin(), 0.4 * (40.0 * t).cos()];
    bounces(r#""10 mm*sin(40*t)""#, sine, 0.7, 3.0, "");
    bounces(r#"{"start": 0, "sines": [{"amplitude": 0.01, "frequency": 40}]}"#, sine, 0.4, 3.0, "");
}

#[test]
fn a_ball_bounces_on_a_table_that_moves_by_any_formula() {
    let place = |t: f64| {
        let (s, c) = (12.0 * t).sin_cos();
        let tanh = (2.0 * s).tanh();
        [0.03 * tanh, 0.03 * (1.0 - tanh * tanh) * 24.0 * c]
    };
    bounces(r#""a*tanh(2*sin(12*t))""#, place, 0.9, 1.2, r#", "parameters": {"a": "30 mm"}"#);
    // A corner of the law, where its rate jumps.
    let ramp = |t: f64| if t > 0.9 { [0.2 * (t - 0.9), 0.2] } else { [0.0, 0.0] };
    bounces(r#""0.2*max(t - 0.9, 0)""#, ramp, 0.9, 2.0, "");
}

#[test]
fn a_ball_rides_on_a_table_until_that_falls_faster() {
    // It leaves where a w² sin(w t) = g, after the work m (g y + u²/2) of the table, and lands again.
    let (a, w) = (0.02, 30.0_f64);
    let leaves = (G / (a * w * w)).asin() / w;
    let (y, v) = (a * (w * leaves).sin(), a * w * (w * leaves).cos());
    let flight = |t: f64| y + (t - leaves) * (v - 0.5 * G * (t - leaves));
    let (mut low, mut high) = (leaves + 1e-3, leaves + 0.3);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if flight(middle) > a * (w * middle).sin() { low = middle } else { high = middle }
    }
    for request in methods() {
        let riding = finished(
            &ball(r#""a*sin(30*t)""#, 0.0, [0.0, a * w], leaves, r#", "parameters": {"a": 0.02}"#),
            &request,
        );
        near(riding.last.work, G * y + 0.5 * (v * v - (a * w).powi(2)), 1e-8, "work of the table");
        let mut scene = ball(r#""a*sin(30*t)""#, 0.0, [0.0, a * w], 0.2, r#", "parameters": {"a": 0.02}"#);
        scene.every = 0.01;
        let outcome = finished(&scene, &request);
        near(outcome.holds[0].until.expect("it leaves"), leaves, 1e-7, "time it leaves at");
        near(outcome.impacts[0].t, high, 1e-7, "time it lands at");
        let approach = v - G * (high - leaves) - a * w * (w * high).cos();
        near(outcome.impacts[0].energy_lost, 0.5 * approach * approach, 1e-7, "energy lost");
        assert!(outcome.drift.energy.max < 1e-8, "{:?}: {:e}", request.method, outcome.drift.energy.max);
    }
}

/// A ball at rest that the table is switched on below at 1e5 s, where a plain double tells the time to 7e-12 s
/// and the velocity of the table with it to 3e-8 m/s.
#[test]
fn a_table_that_shakes_for_ever_meets_a_ball_at_its_own_place_and_velocity() {
    let (a, w, y, e, on) = (0.01, 600.0_f64, 0.005, 0.5, 1e5);
    let switched = format!(
        r#", "inactive": ["table"], "events": [{{"name": "switch", "when": "t - {on}", "on": ["table"]}}]"#
    );
    let law = format!(r#"{{"start": 0, "sines": [{{"amplitude": {a}, "frequency": {w}}}]}}"#);
    let text = serde_json::to_string(&ball(&law, e, [y, 0.0], on + 0.012, &switched).to_input());
    let still = scene(&text.expect("JSON").replace("-9.81", "0"));
    // a sin(w t) = y, going up, after a whole number of turns.
    let rises = (y / a).asin();
    let turns = ((w * on - rises) / std::f64::consts::TAU).ceil();
    let (t, approach) = ((rises + turns * std::f64::consts::TAU) / w, -a * w * rises.cos());
    for request in methods() {
        let outcome = finished(&still, &request);
        near(outcome.impacts[0].t, t, 1e-10, "time of the impact");
        near(outcome.impacts[0].approach, approach, 1e-8, "approach");
        near(outcome.impacts[0].energy_lost, 0.5 * (1.0 - e * e) * approach * approach, 1e-7, "energy lost");
        near(outcome.last.omega[2], -(1.0 + e) * approach, 1e-8, "velocity");
    }
}

/// A ball on a line through the origin that a driven bar carries, and one that hangs on nothing.
const TURNING: &str = r#"{"name": "turning", "gravity": [0, -9.81],
    "bars": [{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.1},
        {"name": "table", "mass": 2, "centre": [0, 0], "inertia": 0.5, "length": 1}],
    "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "table", "point": [0, 0]}]}],
    "motors": [{"name": "drive", "body": "table", "law": {"start": 0, "rate": 1.5}}],
    "walls": [{"name": "top", "body": "ball", "point": [0, 0], "restitution": 0,
        "line": {"body": "table", "through": [0.3, 0], "normal": [0, 1]}}],
    "start": {"ball": {"phi": 0, "omega": 0, "origin": [0.5, 0], "velocity": [0, 0.75]}}, "until": 0.5, "every": 0.5}"#;

#[test]
fn a_ball_slides_along_a_line_that_turns() {
    // r'' = w² r - g sin(w t):  r = A e^(wt) + B e^(-wt) + g sin(wt)/(2 w²)
    let w = 1.5_f64;
    let at = |t: f64| {
        let rate = -G / (2.0 * w);
        let (a, b) = (0.5 * (0.5 + rate / w), 0.5 * (0.5 - rate / w));
        let (sin, cos) = (w * t).sin_cos();
        let r = a * (w * t).exp() + b * (-w * t).exp() + G * sin / (2.0 * w * w);
        (r, w * (a * (w * t).exp() - b * (-w * t).exp()) + G * cos / (2.0 * w))
    };
    let ((r, rate), (sin, cos)) = (at(0.5), (w * 0.5).sin_cos());
    for request in methods() {
        let outcome = finished(&scene(TURNING), &request);
        assert_eq!(outcome.holds.len(), 1, "{:?}", outcome.holds);
        near(outcome.last.phi[2], r * cos, 2e-8, "x");
        near(outcome.last.phi[3], r * sin, 2e-8, "y");
        near(outcome.last.omega[2], rate * cos - r * w * sin, 1e-7, "x'");
        let gained = 0.5 * (rate * rate + r * r * w * w - 0.25 * w * w) + G * r * sin;
        near(outcome.last.work, gained, 1e-7, "work of the motor");
        assert!(outcome.drift.energy.max < 1e-8, "{:?}: {:e}", request.method, outcome.drift.energy.max);
    }
}

#[test]
fn two_bodies_meet_as_in_the_textbook() {
    // Masses 1 and 3 along y, e = 0.5, in a line through both centres; the wall of the plate turns with it.
    for turned in [0.0_f64, 0.7] {
        let (s, c) = turned.sin_cos();
        let text = format!(
            r#"{{"name": "two", "gravity": [0, 0],
            "bars": [{{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.1}},
                {{"name": "plate", "mass": 3, "centre": [0, 0], "inertia": 0.5, "length": 1}}],
            "walls": [{{"name": "top", "body": "ball", "point": [0, 0], "restitution": 0.5,
                "line": {{"body": "plate", "through": [0, 0.2], "normal": [0, 1]}}}}],
            "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [{}, {}], "velocity": [{}, {}]}},
                "plate": {{"phi": {turned}, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}}}},
            "until": 1, "every": 1}}"#,
            -s,
            c,
            2.0 * s,
            -2.0 * c
        );
        for request in methods() {
            let outcome = finished(&scene(&text), &request);
            near(outcome.impacts[0].t, 0.4, 1e-9, "time");
            near(outcome.impacts[0].energy_lost, 0.5 * 0.75 * 0.75 * 4.0, 1e-9, "energy lost");
            // v = (m1 u + m2 (0 - e u)) / (m1 + m2), and momentum.
            let ball = -2.0 * (1.0 - 3.0 * 0.5) / 4.0;
            let plate = (-2.0 - ball) / 3.0;
            let last = &outcome.last;
            for (found, expected) in last.omega[2..].iter().zip([-ball * s, ball * c, -plate * s, plate * c])
            {
                near(*found, expected, 1e-9, "velocity");
            }
            assert!(outcome.drift.energy.max < 1e-10);
        }
    }
}

#[test]
fn a_trapdoor_opens_and_a_net_is_put_up() {
    let text = r#"{"name": "trap", "gravity": [0, -9.81], "inactive": ["net"],
        "bars": [{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.1}],
        "walls": [{"name": "door", "body": "ball", "point": [0, 0], "restitution": 0, "line": {"through": [0, 0], "normal": [0, 1]}},
            {"name": "net", "body": "ball", "point": [0, 0], "restitution": 0.5, "line": {"through": [0, -1], "normal": [0, 1]}}],
        "points": [{"name": "p", "body": "ball", "point": [0, 0]}],
        "events": [{"name": "opens", "when": "t - 0.25", "off": ["door"]}, {"name": "up", "when": "p.y + HEIGHT", "on": ["net"]}],
        "start": {"ball": {"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}}, "until": 1, "every": 1}"#;
    let falls = (2.0 / G).sqrt();
    for request in methods() {
        let outcome = finished(&scene(&text.replace("HEIGHT", "0.5")), &request);
        near(outcome.holds[0].until.expect("it opens"), 0.25, 1e-9, "time it opens at");
        near(outcome.impacts[0].t, 0.25 + falls, 1e-8, "time it lands at");
        let rest = 0.75 - falls;
        near(outcome.last.phi[2], -1.0 + rest * (0.5 * G * falls - 0.5 * G * rest), 1e-7, "height");
        assert!(outcome.drift.energy.max < 1e-8);
        let late = run(&scene(&text.replace("HEIGHT", "1.2")), &request);
        let stop = late.stop.expect("it is behind the net");
        assert!(stop.what.contains("wall net") && stop.what.contains("2.000e-1 m"), "{stop}");
    }
}

#[test]
fn moving_walls_are_written_as_they_were_read_and_refused_with_their_place() {
    for text in [
        TURNING.to_owned(),
        TURNING.replace(r#""restitution": 0,"#, r#""restitution": 0, "law": "tanh(1*t)/50","#),
    ] {
        let first = scene(&text);
        let again = scene(&serde_json::to_string(&first.to_input()).expect("JSON"));
        assert_eq!(again.walls, first.walls);
    }
    let refused = |from: &str, to: &str| {
        parse_scene(&TURNING.replace(from, to), "test", &[]).expect_err("no scene").to_string()
    };
    let said = refused(r#""line": {"body": "table""#, r#""line": {"body": "ball""#);
    assert!(said.contains("walls[0].line.body") && said.contains("another bar"), "{said}");
    let said = refused(r#""restitution": 0,"#, r#""restitution": 0, "law": "2 s","#);
    assert!(said.contains("walls[0].law") && said.contains("not m"), "{said}");
    let behind = TURNING.replace(r#""restitution": 0,"#, r#""restitution": 0, "law": "0.1*cos(1*t)","#);
    let error = Simulation::new(&scene(&behind)).err().expect("no start").to_string();
    assert!(error.contains("wall `top`") && error.contains("0.1 m behind"), "{error}");
}

/// An arm lies on its stop, which leaves it no freedom and cannot pull, and is hit from below.
#[test]
fn a_wall_that_rises_takes_an_arm_off_its_stop() {
    let lift = scene(
        r#"{"name": "lift", "gravity": [0, -10], "until": 0.3, "every": 0.3,
        "bars": [{"name": "arm", "mass": 1.2, "centre": [0.5, 0], "inertia": 0.1, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "arm", "point": [0, 0]}]}],
        "walls": [
            {"name": "stop", "body": "arm", "point": [1, 0], "restitution": 0, "line": {"through": [0, 0], "normal": [0, 1]}},
            {"name": "lifter", "body": "arm", "point": [0.5, 0], "restitution": 0.5, "line": {"through": [0, -0.25], "normal": [0, 1]},
                "law": {"start": 0, "rate": 1}}],
        "start": {"arm": {"phi": 0, "omega": 0}}}"#,
    );
    for request in methods() {
        let outcome = finished(&lift, &request);
        assert_eq!(outcome.impacts.len(), 1, "{:?}: {:?}", request.method, outcome.impacts);
        near(outcome.impacts[0].t, 0.25, 1e-10, "impact");
        near(outcome.holds[0].until.expect("an end"), 0.25, 1e-10, "end of the hold");
        // 1.5 m/s at 0.5 m, with an inertia of 0.4 kg m² about the hinge.
        near(outcome.last.kinetic + outcome.last.potential, 1.8, 1e-9, "energy");
        assert!(outcome.last.phi[0] > 0.1, "{:?}", outcome.last.phi);
    }
}

/// Where its force passes zero a point leaves a wall with the third power of time: for a while it is nearer than
/// the dense output of a long step is right, which is no impact, however coarse the method.
#[test]
fn a_point_that_leaves_a_turning_wall_slowly_is_let_go_once() {
    let scene = scene(
        r#"{"name": "leaving", "gravity": [0, -9.81],
        "bars": [{"name": "b", "mass": 1.4039, "centre": [0.1475, -0.003], "inertia": 0.00838, "length": 0.2486},
                 {"name": "d", "mass": 0.1937, "centre": [0, 0], "inertia": 0.0015, "length": 0.1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}]}],
        "motors": [{"name": "m", "body": "b", "law": {"start": 0.9079, "rate": 5.4079}}],
        "springs": [{"name": "s", "between": [{"body": "b", "point": [0.05, 0.3]}, {"body": "d", "point": [0.1718, -0.25]}],
                     "potential": "3.7816*(length-0.3)^2/2"}],
        "walls": [{"name": "w", "body": "d", "point": [0.0107, -0.05], "restitution": 0, "friction": {"kinetic": 0.2909},
                   "line": {"body": "b", "through": [0, 0.05], "normal": [0, 1]}}],
        "start": {"d": {"phi": 0.0423, "omega": 1.066, "origin": [-0.1205587709721936, 0.25182548072360383],
                        "velocity": [-0.2431, -0.8663]}},
        "until": 0.8, "every": 0.1}"#,
    );
    let exact = finished(&scene, &adaptive(MethodId::Taylor, 1e-13));
    let times = |outcome: &Outcome| outcome.frictions.iter().map(|one| one.t).collect::<Vec<_>>();
    assert_eq!((exact.impact_count, exact.frictions.len()), (2, 4));
    for method in [MethodId::Radau(3), MethodId::Dp5, MethodId::Dp8, MethodId::Radau(5)] {
        for tolerance in [1e-4, 1e-5, 1e-6, 1e-8] {
            let found = finished(&scene, &adaptive(method, tolerance));
            assert_eq!((found.impact_count, found.frictions.len()), (2, 4), "{method:?} {tolerance}");
            for (one, exact) in times(&found).iter().zip(times(&exact)) {
                assert!((one - exact).abs() < 50.0 * tolerance, "{method:?} {tolerance}: {one} {exact}");
            }
        }
    }
}

/// A table that shakes thousands of times within a step of the ball's flight is met at the first moment at
/// which it reaches the ball, by a step's dense output that is looked at in every period.
#[test]
fn a_table_that_shakes_fast_is_met_in_its_first_period_that_reaches_the_ball() {
    let (mut faster, height) = (0, 0.03);
    for (k, w) in [900.0, 3915.3, 7000.0, 21_000.0, 40_298.0].into_iter().enumerate() {
        for amplitude in [2.49e-3, 7.5e-3] {
            let phase = 0.7 + 1.1 * k as f64;
            let gap = |t: f64| height - 0.5 * G * t * t - amplitude * (w * t + phase).sin();
            let step = 0.01 / w;
            let mut to = step;
            while gap(to) > 0.0 {
                to += step;
            }
            let mut from = to - step;
            for _ in 0..60 {
                let middle = 0.5 * (from + to);
                if gap(middle) > 0.0 { from = middle } else { to = middle }
            }
            let law = format!(r#""{amplitude:?}*sin({w:?}*t/(1 s) + {phase:?})*(1 m)""#);
            let scene = ball(&law, 0.5, [height, 0.0], to * (1.0 + 1e-4), "");
            for (method, tolerance) in [
                (MethodId::Dp5, 1e-7),
                (MethodId::Dp8, 1e-9),
                (MethodId::Radau(5), 1e-9),
                (MethodId::Taylor, 1e-9),
            ] {
                let outcome = finished(&scene, &adaptive(method, tolerance));
                let first = outcome.impacts.first().unwrap_or_else(|| panic!("{method} at {w} rad/s: none"));
                near(first.t, to, 1e-11, &format!("{method} at {w} rad/s"));
                faster += 1;
            }
        }
    }
    println!("{faster} first impacts at tables that shake fast");
}
