//! Walls with sliders, bodies that hang on nothing, and loops: impacts, rest, sliding and release against
//! closed forms.

use crate::common;

use common::compile;
use driftless::run::{Limits, MethodId, Outcome, Plan, Request, Run, Sample, integrate};
use driftless::scene::{Scene, parse_scene};
use serde_json::{Value, json};

const G: f64 = 9.81;
/// Every method that takes walls.
const METHODS: [MethodId; 5] =
    [MethodId::Dp5, MethodId::Dp8, MethodId::Taylor, MethodId::Radau(3), MethodId::Radau(5)];

fn read(scene: &Value) -> Scene {
    let mut scene = scene.clone();
    (scene["name"], scene["until"], scene["every"]) = (json!("walls"), json!(1), json!(1));
    parse_scene(&scene.to_string(), "walls", &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// A run to its end, and its samples.
fn seen(scene: &Value, method: MethodId, until: f64, every: f64, rtol: f64) -> (Outcome, Vec<Sample>) {
    let request = Request {
        method: Some(method),
        until: Some(until),
        every: Some(every),
        rtol: Some(rtol),
        ..Request::default()
    };
    let scene = read(scene);
    let mechanism = compile(&scene);
    let plan = Plan::new(&scene, &mechanism, &request).expect("a sensible pairing");
    let start = mechanism.start(&scene);
    let mut samples = Vec::new();
    let run = Run::new(mechanism, plan, Limits::default(), &start).expect("a beginning");
    let outcome = integrate(run, &mut |sample| {
        samples.push(sample.clone());
        Ok(())
    });
    (outcome.expect("no observer fails"), samples)
}

fn through(scene: &Value, method: MethodId, until: f64, every: f64) -> (Outcome, Vec<Sample>) {
    let (outcome, samples) = seen(scene, method, until, every, 1e-11);
    assert_eq!(outcome.stop, None, "{method}");
    (outcome, samples)
}

fn close(found: f64, expected: f64, most: f64, what: &str) {
    assert!((found - expected).abs() <= most, "{what}: {found} instead of {expected}");
}

/// A ball at `at` with velocity `v` over a floor at y = 0.
fn ball(at: [f64; 2], v: [f64; 2], restitution: f64) -> Value {
    json!({
        "gravity": [0, -G],
        "bars": [{"name": "ball", "mass": 1, "centre": [0, 0], "inertia": 0.1}],
        "walls": [{"name": "floor", "body": "ball", "point": [0, 0], "line": {"through": [0, 0], "normal": [0, 1]}, "restitution": restitution}],
        "start": {"ball": {"phi": 0.3, "omega": 2.0, "origin": at, "velocity": v}},
    })
}

/// Height and velocity of that ball at `t`, dropped from rest.
fn bouncing(height: f64, e: f64, t: f64) -> (f64, f64) {
    let first = (2.0 * height / G).sqrt();
    if t <= first {
        return (height - 0.5 * G * t * t, -G * t);
    }
    let (mut begin, mut speed) = (first, e * G * first);
    while speed > 1e-9 {
        let flight = 2.0 * speed / G;
        if t <= begin + flight {
            let s = t - begin;
            return (speed * s - 0.5 * G * s * s, speed - G * s);
        }
        (begin, speed) = (begin + flight, speed * e);
    }
    (0.0, 0.0)
}

#[test]
fn a_ball_bounces_to_rest_as_in_the_textbook() {
    for method in METHODS {
        for (height, e) in [(10.0, 0.5), (0.5, 0.5), (0.5, 0.0), (2.0, 0.8)] {
            let first = f64::sqrt(2.0 * height / G);
            let rest = first * (1.0 + e) / (1.0 - e);
            let (outcome, samples) =
                through(&ball([3.0, height], [0.7, 0.0], e), method, 1.3 * rest, 0.013 * rest);
            assert_eq!((samples[0].phi[2], samples[0].omega[2]), (height, 0.0));
            for sample in &samples {
                let (y, v) = bouncing(height, e, sample.t);
                close(sample.phi[2], y, 1e-8 * height, "height");
                close(sample.omega[2], v, 1e-6 * first * G, "velocity");
                // Nothing acts along the floor, and nothing turns the ball.
                close(sample.phi[1], 3.0 + 0.7 * sample.t, 1e-9, "way");
                close(sample.phi[0], 0.3 + 2.0 * sample.t, 1e-9, "angle");
            }
            let mut t = first;
            for (k, strike) in outcome.impacts.iter().enumerate().take(10) {
                let speed = G * first * e.powi(k as i32);
                close(strike.t, t, 1e-9 * rest, "time of impact");
                close(strike.approach, -speed, 1e-8 * speed, "approach");
                close(strike.impulse, (1.0 + e) * speed, 1e-8 * speed, "impulse");
                close(strike.energy_lost, 0.5 * (1.0 - e * e) * speed * speed, 1e-8 * speed * speed, "loss");
                t += 2.0 * e.powi(k as i32 + 1) * first;
            }
            assert_eq!(
                (outcome.persistent_contact_count, outcome.holds[0].until),
                (1, None),
                "{method} e = {e}"
            );
            close(outcome.holds[0].t, rest, 1e-9 * rest, "rest");
            close(outcome.impact_loss, G * height, 1e-8 * G * height, "all of the height");
        }
    }
}

/// A cart on a rail along x, with stops.
fn cart(x: f64, v: f64, stops: &[(&str, f64, f64)], e: f64) -> Value {
    let walls: Vec<Value> = (stops.iter())
        .map(|(name, at, normal)| {
            json!({"name": name, "body": "cart", "point": [0, 0], "line": {"through": [at, 0], "normal": [normal, 0]}, "restitution": e})
        })
        .collect();
    json!({
        "gravity": [0, -G],
        "bars": [{"name": "cart", "mass": 2, "centre": [0, 0], "inertia": 0.01, "length": 0.1}],
        "sliders": [{"name": "rail", "point": {"body": "cart", "point": [0, 0]},
            "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "angle": "locked"}],
        "walls": walls,
        "start": {"cart": {"phi": 0, "origin": [x, 0], "velocity": [v, 0]}},
    })
}

#[test]
fn a_cart_meets_its_stops_where_they_are() {
    for method in METHODS {
        let (outcome, samples) = through(&cart(0.0, 1.0, &[("stop", 1.0, -1.0)], 0.5), method, 2.0, 0.1);
        assert_eq!((samples[0].phi[1], outcome.impact_count), (0.0, 1));
        // A gap of 1e-12 of its distance counts as none.
        close(outcome.impacts[0].t, 1.0, 2e-12, "time");
        close(outcome.last.phi[1], 0.5, 4e-12, "place");
        let (outcome, _) =
            through(&cart(2.0, 1.0, &[("right", 3.0, -1.0), ("left", -0.5, 1.0)], 0.5), method, 20.0, 0.1);
        // Right at 1 s, left 3.5 m further at half the speed, right again at a quarter.
        let times: Vec<f64> = outcome.impacts.iter().map(|strike| strike.t).collect();
        assert_eq!(times.len(), 2);
        close(times[0], 1.0, 1e-11, "right");
        close(times[1], 8.0, 1e-10, "left");
        close(outcome.last.phi[1], -0.5 + 0.25 * 12.0, 1e-10, "place");
        // Elastic stops, two hundred times.
        let (outcome, _) =
            through(&cart(0.25, 1.0, &[("right", 1.0, -1.0), ("left", 0.0, 1.0)], 1.0), method, 200.0, 1.0);
        assert_eq!(outcome.impact_count, 200);
        close(outcome.last.phi[1], 0.25, 1e-9, "place");
    }
}

#[test]
fn a_rod_dropped_on_one_end_turns() {
    let (m, half, phi, speed, e) = (0.5, 0.4, 0.6f64, 3.0, 0.7);
    let inertia = m * (2.0 * half) * (2.0 * half) / 12.0;
    for method in METHODS {
        let end = |x: f64, name: &str| json!({"name": name, "body": "rod", "point": [x, 0], "line": {"through": [0, 0], "normal": [0, 1]}, "restitution": e});
        // The lower end a distance 0.3 above the floor, no gravity.
        let scene = json!({
            "bars": [{"name": "rod", "mass": m, "centre": [0, 0], "inertia": inertia, "length": half}],
            "gravity": [0, 0],
            "walls": [end(-half, "low"), end(half, "high")],
            "start": {"rod": {"phi": phi, "omega": 0, "origin": [0, half * phi.sin() + 0.3], "velocity": [0.2, -speed]}},
        });
        let (outcome, _) = through(&scene, method, 0.12, 0.01);
        let strike = &outcome.impacts[0];
        let arm = half * phi.cos();
        let impulse = (1.0 + e) * speed / (1.0 / m + arm * arm / inertia);
        close(strike.t, 0.1, 1e-12, "time");
        close(strike.impulse, impulse, 1e-9, "impulse");
        assert_eq!((strike.wall.as_str(), outcome.impact_count), ("low", 1));
        close(outcome.last.omega[0], -arm * impulse / inertia, 1e-9, "rate");
        close(outcome.last.omega[1], 0.2, 1e-12, "along the floor");
        close(outcome.last.omega[2], -speed + impulse / m, 1e-9, "upwards");
        close(outcome.last.phi[2], half * phi.sin() + 0.02 * (-speed + impulse / m), 1e-9, "height");
    }
}

/// A cart that carries a pendulum, against a stop: the pendulum takes part by what its hinge cannot shed.
#[test]
fn a_cart_with_a_pendulum_meets_a_stop() {
    let (big, m, r, inertia, e) = (2.0, 0.7, 0.5, 0.03, 0.4);
    for method in METHODS {
        let mut scene = cart(0.0, 0.0, &[("stop", 0.1, -1.0)], e);
        scene["bars"] = json!([
            {"name": "cart", "mass": big, "centre": [0, 0], "inertia": 0.01, "length": 0.1},
            {"name": "pole", "mass": m, "centre": [r, 0], "inertia": inertia, "length": 1.0}]);
        scene["hinges"] = json!([{"name": "H", "between": [{"body": "cart", "point": [0, 0]}, {"body": "pole", "point": [0, 0]}]}]);
        scene["start"] = json!({"cart": {"phi": 0, "origin": [0, 0], "velocity": [0.5, 0]}, "pole": {"phi": -1.0, "omega": 1.5}});
        let (outcome, _) = through(&scene, method, 0.6, 0.1);
        let strike = &outcome.impacts[0];
        // Cut at the impact, the run ends with the angle it has there.
        let (at_impact, _) = through(&scene, method, strike.t, strike.t);
        let mass = big + m - (m * r * at_impact.last.phi[1].sin()).powi(2) / (inertia + m * r * r);
        close(strike.impulse, -(1.0 + e) * strike.approach * mass, 1e-9, "impulse");
        close(strike.energy_lost, 0.5 * (1.0 - e * e) * mass * strike.approach.powi(2), 1e-10, "loss");
        assert!(outcome.drift.energy.max < 1e-8);
    }
}

/// A crank, a rod and a block that meets a stop: what moves with the block weighs J dphi²/dx², by hand.
#[test]
fn the_block_of_a_slider_crank_meets_a_stop() {
    let (r, l, block, e) = (0.3, 0.8, 1.5, 0.5);
    let (crank_inertia, rod_mass, rod_inertia) = (0.05, 0.6, 0.04);
    let stop = 0.95;
    for (method, rtol) in METHODS.map(|method| (method, 1e-11)).into_iter().chain([(MethodId::Dp5, 1e-6)]) {
        let scene = json!({
            "gravity": [0, 0],
            "bars": [
                {"name": "crank", "mass": 1, "centre": [0, 0], "inertia": crank_inertia, "length": r},
                {"name": "rod", "mass": rod_mass, "centre": [l / 2.0, 0], "inertia": rod_inertia, "length": l},
                {"name": "block", "mass": block, "centre": [0, 0], "inertia": 0.01, "length": 0.1}],
            "hinges": [
                {"name": "O", "between": [{"body": "ground", "point": [0, 0]}, {"body": "crank", "point": [0, 0]}]},
                {"name": "A", "between": [{"body": "crank", "point": [r, 0]}, {"body": "rod", "point": [0, 0]}]},
                {"name": "B", "between": [{"body": "rod", "point": [l, 0]}, {"body": "block", "point": [0, 0]}]}],
            "sliders": [{"name": "S", "point": {"body": "block", "point": [0, 0]},
                "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "angle": "locked"}],
            "walls": [{"name": "stop", "body": "block", "point": [0, 0], "line": {"through": [stop, 0], "normal": [-1, 0]}, "restitution": e}],
            "start": {"crank": {"phi": 1.9, "omega": -2.0}, "rod": {"phi": -(r * 1.9f64.sin() / l).asin()}, "block": {"phi": 0}},
        });
        // The crank angle at which the block is at the stop.
        let cos = (r * r + stop * stop - l * l) / (2.0 * r * stop);
        let phi = cos.acos();
        let psi = -(r * phi.sin() / l).asin();
        let d_psi = -r * phi.cos() / (l * psi.cos());
        let dx = -r * phi.sin() - l * psi.sin() * d_psi;
        let centre =
            [-r * phi.sin() - 0.5 * l * psi.sin() * d_psi, r * phi.cos() + 0.5 * l * psi.cos() * d_psi];
        let inertia = crank_inertia
            + rod_mass * (centre[0].powi(2) + centre[1].powi(2))
            + rod_inertia * d_psi * d_psi
            + block * dx * dx;
        let mass = inertia / (dx * dx);
        let (outcome, _) = seen(&scene, method, 2.0, 0.01, rtol);
        assert_eq!(outcome.stop, None, "{method}");
        let strike = &outcome.impacts[0];
        let most = f64::max(1e-9, 100.0 * rtol);
        close(strike.impulse, -(1.0 + e) * mass * strike.approach, most, "impulse");
        close(strike.energy_lost, 0.5 * (1.0 - e * e) * mass * strike.approach.powi(2), most, "loss");
        // No force but the stop's: the kinetic energy before is that of the start.
        let at_start = |phi: f64| {
            let psi = -(r * phi.sin() / l).asin();
            let d_psi = -r * phi.cos() / (l * psi.cos());
            let dx = -r * phi.sin() - l * psi.sin() * d_psi;
            let centre =
                [-r * phi.sin() - 0.5 * l * psi.sin() * d_psi, r * phi.cos() + 0.5 * l * psi.cos() * d_psi];
            crank_inertia
                + rod_mass * (centre[0].powi(2) + centre[1].powi(2))
                + rod_inertia * d_psi * d_psi
                + block * dx * dx
        };
        let energy = 0.5 * at_start(1.9) * 4.0;
        close(0.5 * mass * strike.approach.powi(2), energy, most, "energy before");
    }
}

/// A ladder: both ends on rails at right angles, one of which ends in a stop.
#[test]
fn a_ladder_between_two_rails_meets_a_stop() {
    let (m, half, e) = (1.2, 0.5, 0.6);
    let inertia = 0.1;
    for method in METHODS {
        let slide = |name: &str, x: f64, direction: [f64; 2]| json!({"name": name, "point": {"body": "rod", "point": [x, 0]}, "rail": {"body": "ground", "point": [0, 0], "direction": direction}});
        let scene = json!({
            "gravity": [0, -G],
            "bars": [{"name": "rod", "mass": m, "centre": [0, 0], "inertia": inertia, "length": half}],
            "sliders": [slide("along", -half, [1.0, 0.0]), slide("up", half, [0.0, 1.0])],
            "walls": [{"name": "stop", "body": "rod", "point": [-half, 0], "line": {"through": [-0.8, 0], "normal": [1, 0]}, "restitution": e}],
            // The origin at x = -cos phi, the head at y = sin phi.
            "start": {"rod": {"phi": 1.2, "omega": -0.5}},
        });
        let (outcome, samples) = through(&scene, method, 0.6, 0.01);
        let strike = &outcome.impacts[0];
        // About the corner the rod swings as a pendulum of inertia I + m half²: the centre is always half
        // away from it.
        let whole = inertia + m * half * half;
        let phi = 0.8f64.acos();
        let rate = -(0.25 + 2.0 * m * G * half * (1.2f64.sin() - phi.sin()) / whole).sqrt();
        close(strike.approach, phi.sin() * rate, 1e-9, "approach");
        close(strike.impulse, (1.0 + e) * whole * -rate / phi.sin(), 1e-9, "impulse");
        close(strike.energy_lost, 0.5 * (1.0 - e * e) * whole * rate * rate, 1e-9, "loss");
        assert!(samples.iter().all(|sample| sample.phi[0].cos() < 0.8 + 1e-9));
    }
}

/// A platform on three parallel cranks of equal length: one closes the loop, the third says nothing new.
#[test]
fn a_platform_on_redundant_cranks_meets_a_wall() {
    let (r, platform, crank, e) = (0.5, 2.0, 0.1, 0.5);
    for method in METHODS {
        let bar =
            |name: &str| json!({"name": name, "mass": 1, "centre": [0, 0], "inertia": crank, "length": r});
        let origin_point = |k: usize| json!({"name": format!("O{k}"), "between": [{"body": "ground", "point": [k, 0]}, {"body": format!("c{k}"), "point": [0, 0]}]});
        let head = |k: usize| json!({"name": format!("P{k}"), "between": [{"body": format!("c{k}"), "point": [r, 0]}, {"body": "platform", "point": [k, 0]}]});
        let scene = json!({
            "gravity": [0, 0],
            "bars": [bar("c0"), bar("c1"), bar("c2"), {"name": "platform", "mass": platform, "centre": [1, 0], "inertia": 0.3, "length": 2}],
            "hinges": [origin_point(0), origin_point(1), origin_point(2), head(0), head(1), head(2)],
            "walls": [{"name": "wall", "body": "platform", "point": [2, 0], "line": {"through": [2.4, 0], "normal": [-1, 0]}, "restitution": e}],
            "start": {"c0": {"phi": 1.5, "omega": -1.0}, "c1": {"phi": 1.5}, "c2": {"phi": 1.5}, "platform": {"phi": 0}},
        });
        let (outcome, _) = through(&scene, method, 2.0, 0.1);
        let strike = &outcome.impacts[0];
        // r cos phi = 0.4; every crank turns alike, and the platform moves on a circle.
        let (sin, whole) = ((1.0f64 - 0.64).sqrt(), 3.0 * crank + platform * r * r);
        close(strike.t, 1.5 - 0.8f64.acos(), 1e-10, "time");
        close(strike.approach, -r * sin, 1e-10, "approach");
        close(strike.impulse, (1.0 + e) * whole / (r * sin), 1e-9, "impulse");
        close(outcome.last.omega[0], e, 1e-9, "rate of the first crank");
        close(outcome.last.omega[2], e, 1e-9, "rate of the third crank");
    }
}

/// A point that slides down an inclined wall, and one that a growing force lifts.
#[test]
fn held_points_slide_and_are_lifted() {
    for method in METHODS {
        let angle = 0.4f64;
        let mut scene = ball([0.0, 0.0], [0.0, 0.0], 0.0);
        scene["walls"][0]["line"]["normal"] = json!([-angle.sin(), angle.cos()]);
        let (outcome, samples) = through(&scene, method, 3.0, 0.1);
        assert_eq!(
            (outcome.impact_count, outcome.persistent_contact_count, outcome.holds[0].until),
            (0, 1, None)
        );
        for sample in &samples {
            let way = 0.5 * G * angle.sin() * sample.t * sample.t;
            close(sample.phi[1], -way * angle.cos(), 1e-9, "x");
            close(sample.phi[2], -way * angle.sin(), 1e-9, "y");
        }
        let mut scene = ball([0.0, 0.0], [0.3, 0.0], 0.0);
        scene["forces"] = json!([{"name": "lift", "body": "ball", "point": [0, 0], "force": [0, G], "law": {"start": 0, "rate": 0.5}}]);
        let (outcome, samples) = through(&scene, method, 3.0, 0.1);
        // m g t/2 carries it from 2 s on; then y'' = g (t/2 - 1).
        close(outcome.holds[0].until.expect("a release"), 2.0, 1e-9, "release");
        for sample in &samples {
            let s = (sample.t - 2.0).max(0.0);
            close(sample.phi[2], G * s.powi(3) / 12.0, 1e-8, "height");
            close(sample.phi[1], 0.3 * sample.t, 1e-9, "way");
        }
    }
}

/// In a corner: held at the floor while it meets the wall, and held by both in the end.
#[test]
fn a_ball_slides_into_a_corner() {
    for method in METHODS {
        let mut scene = ball([1.0, 0.0], [-1.0, 0.0], 0.0);
        let wall = json!({"name": "wall", "body": "ball", "point": [0, 0], "line": {"through": [0, 0], "normal": [1, 0]}, "restitution": 0.5});
        scene["walls"].as_array_mut().expect("walls").push(wall);
        scene["gravity"] = json!([-1.0, -G]);
        let (outcome, samples) = through(&scene, method, 8.0, 0.05);
        // Reaches the wall after 1 = t + t²/2; then bounces under 1 m/s² to rest.
        let first = 3f64.sqrt() - 1.0;
        close(outcome.impacts[0].t, first, 1e-10, "time");
        let speed = 1.0 + first;
        let rest = first + 2.0 * 0.5 * speed / 0.5;
        assert!(samples.iter().all(|sample| sample.phi[2].abs() < 1e-12 && sample.phi[1] > -1e-9));
        let corner = outcome.holds.iter().find(|hold| hold.wall == "wall").expect("held in the corner");
        close(corner.t, rest, 1e-3, "rest");
        assert!(outcome.last.omega[1].abs() < 1e-12 && corner.until.is_none());
    }
}

/// A motor on a slider pushes the point it drives into a wall: no motion does both.
#[test]
fn a_slider_motor_that_pushes_into_a_wall_is_a_typed_stop() {
    for method in METHODS {
        let mut scene = cart(0.0, 0.0, &[("stop", 1.0, -1.0)], 0.5);
        scene["motors"] = json!([{"name": "push", "slider": "rail", "law": {"start": 0, "rate": 0.5}}]);
        scene["start"] = json!({"cart": {"phi": 0}});
        let (outcome, _) = seen(&scene, method, 4.0, 0.1, 1e-10);
        let stop = outcome.stop.expect("a stop");
        close(stop.t, 2.0, 1e-9, "time");
        assert!(stop.what.contains("stop") && stop.hint.contains("motor"), "{stop}");
    }
}

/// Masses, lengths and times in other units: the same motion in those units.
#[test]
fn units_do_not_matter() {
    let scaled = |m: f64, l: f64, t: f64| {
        let (v, g, i) = (l / t, G * l / (t * t), m * l * l);
        let wall = |name: &str, body: &str, point: [f64; 2], through: [f64; 2], normal: [f64; 2]| json!({"name": name, "body": body, "point": point.map(|x| x * l), "line": {"through": through.map(|x| x * l), "normal": normal}, "restitution": 0.5});
        // A ball that bounces to rest, a cart that carries a pole between two stops, and a bar on a hinge
        // that falls on a wall.
        json!({
            "gravity": [0, -g],
            "bars": [
                {"name": "ball", "mass": m, "centre": [0, 0], "inertia": 0.1 * i},
                {"name": "cart", "mass": 2.0 * m, "centre": [0, 0], "inertia": 0.01 * i, "length": 0.1 * l},
                {"name": "pole", "mass": 0.5 * m, "centre": [0.5 * l, 0], "inertia": 0.05 * i, "length": l},
                {"name": "bar", "mass": m, "centre": [0.5 * l, 0], "inertia": i / 12.0, "length": l}],
            "hinges": [
                {"name": "H", "between": [{"body": "cart", "point": [0, 0]}, {"body": "pole", "point": [0, 0]}]},
                {"name": "O", "between": [{"body": "ground", "point": [5.0 * l, 0]}, {"body": "bar", "point": [0, 0]}]}],
            "sliders": [{"name": "rail", "point": {"body": "cart", "point": [0, 0]},
                "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "angle": "locked"}],
            "walls": [
                wall("floor", "ball", [0.0, 0.0], [0.0, 0.0], [0.0, 1.0]),
                wall("right", "cart", [0.05, 0.0], [0.5, 0.0], [-1.0, 0.0]),
                wall("left", "cart", [-0.05, 0.0], [-0.5, 0.0], [1.0, 0.0]),
                wall("table", "bar", [1.0, 0.0], [0.0, -0.5], [0.0, 1.0])],
            "start": {
                "ball": {"phi": 0, "omega": 1.0 / t, "origin": [0, 0.5 * l], "velocity": [0.3 * v, 0]},
                "cart": {"phi": 0, "origin": [0, 0], "velocity": [v, 0]},
                "pole": {"phi": -1.3, "omega": 0},
                "bar": {"phi": 0.5, "omega": 0}},
        })
    };
    for method in [MethodId::Dp8, MethodId::Taylor, MethodId::Radau(3)] {
        let request = |t: f64, scene: &Value| through(scene, method, 2.0 * t, 0.05 * t);
        let (reference, plain) = request(1.0, &scaled(1.0, 1.0, 1.0));
        assert!(
            reference.impact_count > 20 && reference.persistent_contact_count >= 2,
            "{} {}",
            reference.impact_count,
            reference.persistent_contact_count
        );
        for (mass, length, time) in [-9i32, -6, -3, 3, 6]
            .into_iter()
            .flat_map(|k| [(k, 0, 0), (0, k, 0), (0, 0, k)])
            .chain([(9, 0, 0), (-9, -9, -6), (9, 6, 3)])
        {
            let [m, l, t] = [mass, length, time].map(|k| 10f64.powi(k));
            if time < -6 {
                continue;
            }
            let what = format!("{method}: masses 1e{mass}, lengths 1e{length}, times 1e{time}");
            let (outcome, samples) = request(t, &scaled(m, l, t));
            assert_eq!(outcome.persistent_contact_count, reference.persistent_contact_count, "{what}");
            for (sample, plain) in samples.iter().zip(&plain) {
                let unit = |k: usize| if k < 4 { 1.0 } else { l };
                for k in 0..sample.phi.len() {
                    close(
                        sample.phi[k] / unit(k),
                        plain.phi[k],
                        1e-7,
                        &format!("{what}: coordinate {k} at {} s", plain.t),
                    );
                }
            }
            for (strike, plain) in outcome.impacts.iter().zip(&reference.impacts).take(10) {
                assert_eq!(strike.wall, plain.wall, "{what}");
                close(strike.t / t, plain.t, 1e-8, &what);
                close(strike.impulse / (m * l / t), plain.impulse, 1e-6 * plain.impulse, &what);
            }
        }
    }
}
