//! The auditor against closed forms and published references: what it says is to be believed before it
//! judges.

use super::double_double::Dd;
use super::reader::{Joint, Measure, Scene};
use super::record::{Look, Record};
use super::start::start;
use serde_json::{Value, json};

/// The auditor's motion of a scene.
fn record(scene: &Value) -> Record {
    let scene = Scene::read(&scene.to_string());
    let rows = (scene.until / scene.every).round() as usize;
    let times: Vec<f64> =
        (0..=rows).map(|row| if row == rows { scene.until } else { scene.every * row as f64 }).collect();
    let start = start(scene, None).expect("a start");
    assert!(start.is_complete && start.correction[0] < 1e-11, "{:?}", start.correction);
    Record::new(start, &times, 1_000_000).expect("a motion")
}

/// A scene with these lists beside bars and start.
fn scene(gravity: [f64; 2], bars: Value, start: Value, until: f64, every: f64, others: Value) -> Value {
    let mut scene = json!({"name": "closed", "gravity": gravity, "bars": bars, "start": start, "until": until, "every": every});
    for (key, value) in others.as_object().expect("an object") {
        scene[key] = value.clone();
    }
    scene
}

fn near(what: &str, found: Dd, expected: f64) {
    let bound = 3e-14 * expected.abs().max(1.0);
    assert!((found.hi - expected).abs() < bound, "{what}: {} is not {expected}", found.hi);
}

fn decimal(value: &Value) -> f64 {
    value.as_str().expect("digits").parse().expect("a number")
}

/// The multiplier of the equation of that name.
fn multiplier(record: &Record, look: &Look, name: &str) -> Dd {
    look.multipliers[record.model.scene.joints.iter().position(|joint| joint.name == name).expect("a joint")]
}

fn hinged(name: &str, at: Value) -> Value {
    json!({"name": "O", "between": [{"body": "ground", "point": at}, {"body": name, "point": [0, 0]}]})
}

/// The published pendulum A01 of IFToMM, to sixteen digits over four periods.
#[test]
fn a_pendulum_swings_as_elliptic_functions_do() {
    let data: Value = serde_json::from_str(include_str!("../data/iftomm_a01_pendulum.json")).expect("JSON");
    let bars = json!([{"name": "b", "mass": 1, "centre": [1, 0], "inertia": 0}]);
    let hinges = json!([hinged("b", json!([0, 0]))]);
    let start = json!({"b": {"phi": std::f64::consts::PI, "omega": 0}});
    let record = record(&scene([0.0, -9.81], bars, start, 10.0, 1.0, json!({"hinges": hinges})));
    for sample in data["reference"]["samples"].as_array().expect("samples") {
        let t = decimal(&sample["t"]);
        let Some(look) = record.looks.iter().find(|look| look.state.t.hi == t) else { continue };
        for (i, key) in ["x", "y"].iter().enumerate() {
            near(key, look.state.q[i], decimal(&sample[key]));
            near(key, look.state.v[i], decimal(&sample[format!("v{key}")]));
        }
    }
}

/// Published slider-crank under a torque, through its dead centres.
#[test]
fn a_slider_crank_runs_as_published() {
    let data: Value =
        serde_json::from_str(include_str!("../data/slider_crank_rigid_torque.json")).expect("JSON");
    let mut crank: Value =
        serde_json::from_str(include_str!("../../examples/scenes/slider_crank_torque.json")).expect("JSON");
    (crank["until"], crank["every"]) = (json!(2), json!(0.25));
    (crank["start"]["rod"]["omega"], crank["start"]["block"]["omega"]) = (json!(0), json!(0));
    let record = record(&crank);
    for (look, sample) in record.looks.iter().zip(data["reference"]["samples"].as_array().expect("samples")) {
        near("crank", look.state.q[2], decimal(&sample["crank_angle"]));
        near("rod", look.state.q[5], decimal(&sample["rod_angle"]));
        near("block", look.state.q[6], decimal(&sample["slider_x"]));
        near("crank's rate", look.state.v[2], decimal(&sample["crank_rate"]));
        near("block's rate", look.state.v[6], decimal(&sample["slider_velocity"]));
    }
}

/// Andrews' squeezing mechanism at 0.03 s.
#[test]
fn seven_bodies_squeeze_as_published() {
    let data: Value = serde_json::from_str(include_str!("../data/andrews_squeezer.json")).expect("JSON");
    let mut andrews: Value =
        serde_json::from_str(include_str!("../../examples/scenes/andrews.json")).expect("JSON");
    andrews["every"] = json!(0.03);
    let record = record(&andrews);
    let end = &record.looks[1];
    // The reference's angles are partly relative; the crank's, and two rates, are absolute.
    let [angles, rates] = ["angles", "velocities"].map(|key| &data["reference_high_precision"][key]);
    near("beta", end.state.q[2], decimal(&angles["beta"]));
    near("beta'", end.state.v[2].scale(1e-3), 1e-3 * decimal(&rates["beta"]));
    near("gamma'", end.state.v[8].scale(1e-3), 1e-3 * decimal(&rates["gamma"]));
    near("beta + theta", end.state.q[5] - Dd::PI, decimal(&angles["beta"]) + decimal(&angles["theta"]));
}

/// A body thrown off its centre: a parabola, and a steady turn about the centre.
#[test]
fn a_free_body_flies_a_parabola() {
    let bars = json!([{"name": "b", "mass": 2, "centre": [0.3, -0.2], "inertia": 0.7}]);
    let start = json!({"b": {"phi": 0.4, "omega": 3, "origin": [1, 2], "velocity": [-1, 4]}});
    let record = record(&scene([0.5, -9.0], bars, start, 2.0, 0.5, json!({})));
    let ((s, c), t) = (0.4f64.sin_cos(), 2.0);
    let arm = [0.3 * c + 0.2 * s, 0.3 * s - 0.2 * c];
    let end = &record.looks[4];
    near("x", end.state.q[0], 1.0 + arm[0] + (-1.0 - 3.0 * arm[1]) * t + 0.25 * t * t);
    near("y", end.state.q[1], 2.0 + arm[1] + (4.0 + 3.0 * arm[0]) * t - 4.5 * t * t);
    near("phi", end.state.q[2], 0.4 + 3.0 * t);
}

/// A ball let fall from 1 m with e = 1/2: instants, impulses, losses, and the instant it comes to rest.
#[test]
fn a_ball_bounces_and_comes_to_rest() {
    let bars = json!([{"name": "b", "mass": 2, "centre": [0, 0], "inertia": 0.1, "length": 0.5}]);
    let start = json!({"b": {"phi": 0, "omega": 0, "origin": [0, 1], "velocity": [0.3, 0]}});
    let line = json!({"through": [5, 0], "normal": [0, 2]});
    let walls = json!([{"name": "floor", "body": "b", "point": [0, 0], "line": line, "restitution": 0.5}]);
    let record = record(&scene([0.0, -9.81], bars, start, 2.0, 0.25, json!({"walls": walls})));
    let fall = (2.0f64 / 9.81).sqrt();
    let mut t = fall;
    let mut speed = 9.81 * fall;
    for impact in &record.impacts[..12] {
        assert!((impact.t - t).abs() < 1e-14 && (impact.approach + speed).abs() < 1e-13, "{impact:?} {t}");
        assert!(
            (impact.impulse - 3.0 * speed).abs() < 1e-13
                && (impact.energy_lost - 0.75 * speed * speed).abs() < 1e-12
        );
        speed *= 0.5;
        t += 2.0 * speed / 9.81;
    }
    let [stay] = &record.stays[..] else { panic!("{:?}", record.stays) };
    assert!((stay.t - 3.0 * fall).abs() < 1e-5 && stay.until.is_none() && record.doubt.is_none());
    let end = record.looks.last().expect("an end");
    near("x", end.state.q[0], 0.6);
    near("y", end.state.q[1], 0.0);
}

/// The end of a rod meets a wall: impulse (1 + e) v / (1/m + r²/I), r the lever about the centre; and a
/// hinged bar against a stop.
#[test]
fn a_rod_turns_by_an_impact() {
    let bars = json!([{"name": "b", "mass": 2, "centre": [0.5, 0], "inertia": 0.3}]);
    let start = json!({"b": {"phi": -0.6, "omega": 0, "origin": [0, 1.5], "velocity": [0, -2]}});
    let line = json!({"through": [0, 0], "normal": [0, 1]});
    let walls = json!([{"name": "floor", "body": "b", "point": [1, 0], "line": line, "restitution": 0.25}]);
    let record = record(&scene([0.0, 0.0], bars, start, 1.0, 1.0, json!({"walls": walls})));
    let lever = 0.5 * 0.6f64.cos();
    let impulse = 1.25 * 2.0 / (0.5 + lever * lever / 0.3);
    let [impact] = &record.impacts[..] else { panic!("{:?}", record.impacts) };
    assert!(
        (impact.t - (1.5 - 0.6f64.sin()) / 2.0).abs() < 1e-15 && (impact.impulse - impulse).abs() < 1e-14,
        "{impact:?}"
    );
    let end = record.looks.last().expect("an end");
    near("omega", end.state.v[2], impulse * lever / 0.3);
    near("vy", end.state.v[1], -2.0 + impulse / 2.0);
    // A bar on a hinge: impulse (1 + e) ω I / r; the hinge's own impulse leaves no trace in the rates.
    let bars = json!([{"name": "b", "mass": 2, "centre": [0.5, 0], "inertia": 0.3}]);
    let line = json!({"through": [0, 1], "normal": [0, -1]});
    let walls = json!([{"name": "stop", "body": "b", "point": [1, 0], "line": line, "restitution": 0.25}]);
    let joints = json!({"walls": walls, "hinges": [hinged("b", json!([0, 0.5]))]});
    let record =
        self::record(&scene([0.0, 0.0], bars, json!({"b": {"phi": 0, "omega": 2}}), 1.0, 1.0, joints));
    let angle = 0.5f64.asin();
    assert!(
        (record.impacts[0].impulse - 1.25 * 2.0 * 0.8 / angle.cos()).abs() < 1e-14,
        "{:?}",
        record.impacts
    );
    near("omega", record.looks[1].state.v[2], -0.5);
    near("phi", record.looks[1].state.q[2], angle - 0.5 * (1.0 - angle / 2.0));
}

/// x = e^(-γt) (A cos ωt + B sin ωt) of a block on a rail; the rail carries its weight and, off its line, its
/// moment.
#[test]
fn a_damped_block_swings_on_its_spring() {
    let bars = json!([{"name": "b", "mass": 2, "centre": [0, 0], "inertia": 0.1, "length": 1}]);
    let rail = json!({"body": "ground", "point": [0, 0], "direction": [1, 0]});
    let sliders =
        json!([{"name": "s", "point": {"body": "b", "point": [0, 0]}, "rail": rail, "angle": "locked"}]);
    let ends = json!([{"body": "b", "point": [0, 0]}, {"body": "ground", "point": [-3, 0]}]);
    let springs = json!([{"name": "k", "between": ends, "stiffness": 50, "free_length": 3, "damping": 2}]);
    let start = json!({"b": {"phi": 0, "omega": 0, "origin": [0.5, 0], "velocity": [1, 0]}});
    let record =
        record(&scene([0.0, -9.81], bars, start, 3.0, 0.5, json!({"sliders": sliders, "springs": springs})));
    let (gamma, rate): (f64, f64) = (0.5, (25.0f64 - 0.25).sqrt());
    for look in &record.looks {
        let t = look.state.t.hi;
        let x = (-gamma * t).exp() * (0.5 * (rate * t).cos() + (1.0 + gamma * 0.5) / rate * (rate * t).sin());
        near("x", look.state.q[0], x);
        near("rail", multiplier(&record, look, "s"), 2.0 * 9.81);
        near("moment", multiplier(&record, look, "s.angle"), 0.0);
    }
    // What the damper took: energy at the start less energy now.
    let end = record.looks.last().expect("an end");
    near(
        "work",
        end.state.work,
        (end.energy[0] + end.energy[1] - record.looks[0].energy[0] - record.looks[0].energy[1]).hi,
    );
    assert!(end.state.work.hi < -1.0);
}

/// A crank turned at 3 rad/s in a yoke: x = r cos ωt, torque m r² ω² sin ωt cos ωt; the slot's rail moves
/// with the yoke.
#[test]
fn a_scotch_yoke_goes_as_the_cosine() {
    let bars = json!([
        {"name": "crank", "mass": 1, "centre": [0, 0], "inertia": 0.1, "length": 0.4},
        {"name": "yoke", "mass": 5, "centre": [0, 0], "inertia": 1, "length": 1}
    ]);
    let rail = json!({"body": "ground", "point": [0, 0], "direction": [1, 0]});
    let slot = json!({"body": "yoke", "point": [0, 0], "direction": [0, 1]});
    let others = json!({
        "hinges": [hinged("crank", json!([0, 0]))],
        "sliders": [
            {"name": "guide", "point": {"body": "yoke", "point": [0, 0]}, "rail": rail, "angle": "locked"},
            {"name": "slot", "point": {"body": "crank", "point": [0.4, 0]}, "rail": slot}
        ],
        "motors": [{"name": "motor", "body": "crank", "law": {"start": 0.3, "rate": 3}}]
    });
    let start = json!({"crank": {"phi": 0.3, "omega": 3}, "yoke": {"phi": 0, "omega": 0, "origin": [0.4 * 0.3f64.cos(), 0], "velocity": [-1.2 * 0.3f64.sin(), 0]}});
    let record = record(&scene([0.0, 0.0], bars, start, 2.0, 0.25, others));
    for look in &record.looks {
        let (s, c) = (0.3 + 3.0 * look.state.t.hi).sin_cos();
        near("x", look.state.q[3], 0.4 * c);
        near("torque", multiplier(&record, look, "motor"), 5.0 * 0.16 * 9.0 * s * c);
        near("work", look.state.work, 2.5 * 0.16 * 9.0 * (s * s - 0.3f64.sin().powi(2)));
    }
}

/// A bead on a rail that turns at ω: r = r0 cosh ωt, pressed against the rail by 2 m ω r'.
#[test]
fn a_bead_leaves_a_turning_rail() {
    let bars = json!([
        {"name": "rail", "mass": 1, "centre": [0.2, 0.1], "inertia": 0.3},
        {"name": "bead", "mass": 0.5, "centre": [0, 0], "inertia": 0.01, "length": 0.1}
    ]);
    let rail = json!({"body": "rail", "point": [0, 0], "direction": [0, -1]});
    let others = json!({
        "hinges": [hinged("rail", json!([0, 0]))],
        "sliders": [{"name": "s", "point": {"body": "bead", "point": [0, 0]}, "rail": rail, "angle": "locked"}],
        "motors": [{"name": "motor", "body": "rail", "law": {"start": 0, "rate": 2}}]
    });
    let start = json!({"rail": {"phi": 0, "omega": 2}, "bead": {"phi": 0, "omega": 2, "origin": [0, -0.5], "velocity": [1, 0]}});
    let record = record(&scene([0.0, 0.0], bars, start, 1.5, 0.5, others));
    for look in &record.looks {
        let t = look.state.t.hi;
        let (r, speed) = (0.5 * (2.0 * t).cosh(), (2.0 * t).sinh());
        near("r", look.state.q[3] * look.state.q[3] + look.state.q[4] * look.state.q[4], r * r);
        // The rail's left is the side it turns to.
        near("press", multiplier(&record, look, "s"), 0.5 * 2.0 * 2.0 * speed);
        near("torque", multiplier(&record, look, "motor"), 0.5 * 2.0 * 2.0 * speed * r);
    }
}

/// Two discs on a torsion spring, with a torque by a law between them; whole turns count.
#[test]
fn two_discs_swing_against_each_other() {
    let disc = |name: &str, inertia: f64| json!({"name": name, "mass": 1, "centre": [0, 0], "inertia": inertia, "length": 1});
    let bars = json!([disc("a", 0.5), disc("b", 0.25)]);
    let placed =
        |phi: f64, omega: f64| json!({"phi": phi, "omega": omega, "origin": [0, 0], "velocity": [0, 0]});
    let turns = 4.0 * std::f64::consts::PI;
    let coils = json!([{"name": "k", "body": "b", "relative_to": "a", "stiffness": 3, "free_angle": turns}]);
    let law = json!({"start": 0.5, "rate": 0.25, "sines": [{"amplitude": 2, "frequency": 5, "phase": 0.7}]});
    let torques = json!([{"name": "m", "body": "b", "relative_to": "a", "torque": 2, "law": law}]);
    let record = record(&scene(
        [0.0, 0.0],
        bars,
        json!({"a": placed(0.0, 1.0), "b": placed(0.0, 1.0)}),
        2.0,
        0.5,
        json!({"torsion_springs": coils, "torques": torques}),
    ));
    // With u the angle between them: u'' = 6 (torque(t) - 3 (u - turns)), a forced oscillator of rate √18.
    let rate = 18f64.sqrt();
    let forced =
        |t: f64| turns + 6.0 * 2.0 * ((0.5 + 0.25 * t) / 18.0 + 2.0 * (5.0 * t + 0.7).sin() / (18.0 - 25.0));
    let forced_rate = 12.0 * (0.25 / 18.0 + 10.0 * 0.7f64.cos() / (18.0 - 25.0));
    for look in &record.looks {
        let t = look.state.t.hi;
        let u = forced(t) - forced(0.0) * (rate * t).cos() - forced_rate / rate * (rate * t).sin();
        near("angle", look.state.q[5] - look.state.q[2], u);
        near("sum", look.state.q[2].scale(2.0) + look.state.q[5], 3.0 * t);
    }
}

/// A force that turns with a body which a motor turns steadily: x'' = F cos ωt / m, y'' = F sin ωt / m.
#[test]
fn a_force_turns_with_its_body() {
    let bars = json!([{"name": "b", "mass": 2, "centre": [0.3, 0.1], "inertia": 0.2}]);
    let others = json!({
        "forces": [{"name": "f", "body": "b", "point": [0.3, 0.1], "force": [4, 0], "frame": "body"}],
        "motors": [{"name": "motor", "body": "b", "law": {"start": 0, "rate": 2, "acceleration": 0}}]
    });
    let start = json!({"b": {"phi": 0, "omega": 2, "origin": [-0.3, -0.1], "velocity": [0.2, -0.6]}});
    let record = record(&scene([0.0, 0.0], bars, start, 2.0, 1.0, others));
    for look in &record.looks {
        let t = look.state.t.hi;
        near("x", look.state.q[0], 0.5 * (1.0 - (2.0 * t).cos()));
        near("y", look.state.q[1], t - 0.5 * (2.0 * t).sin());
        near("motor", multiplier(&record, look, "motor"), 0.0);
    }
}

/// A point that slides down a slope under its own weight leaves nothing to guess: it stays, and is let go
/// where a force lifts it.
#[test]
fn a_point_stays_until_it_is_lifted() {
    let bars = json!([{"name": "b", "mass": 2, "centre": [0, 0], "inertia": 0.1, "length": 1}]);
    let line = json!({"through": [0, 0], "normal": [0, 1]});
    let walls = json!([{"name": "floor", "body": "b", "point": [0, 0], "line": line, "restitution": 0}]);
    let law = json!({"start": 0, "rate": 1});
    let forces = json!([{"name": "lift", "body": "b", "point": [0, 0], "force": [1, 40], "law": law}]);
    let start = json!({"b": {"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}});
    let record =
        record(&scene([0.0, -10.0], bars, start, 1.0, 0.25, json!({"walls": walls, "forces": forces})));
    let [stay] = &record.stays[..] else { panic!("{:?}", record.stays) };
    // 40 t = 20 at half a second; then y'' = 20 (t - 1/2).
    assert!((stay.until.expect("an end") - 0.5).abs() < 1e-12);
    near("y", record.looks[4].state.q[1], 20.0 * 0.125 / 6.0);
    near("x", record.looks[4].state.q[0], 0.5 / 6.0);
}

/// Every equation's row, rate and bend against differences of its own value along a motion.
#[test]
fn rows_are_derivatives() {
    let bars = json!([
        {"name": "a", "mass": 1, "centre": [0.2, 0.1], "inertia": 0.3},
        {"name": "b", "mass": 0.5, "centre": [0.1, -0.3], "inertia": 0.01}
    ]);
    let others = json!({
        "hinges": [{"name": "h", "between": [{"body": "a", "point": [0.7, 0.2]}, {"body": "b", "point": [-0.1, 0.3]}]}],
        "sliders": [
            {"name": "s", "point": {"body": "b", "point": [0.3, 0.1]}, "rail": {"body": "a", "point": [0.3, -0.2], "direction": [1, 2]}},
            {"name": "g", "point": {"body": "ground", "point": [0.3, 0.1]}, "rail": {"body": "b", "point": [0.3, -0.2], "direction": [-1, 2]}}
        ],
        "motors": [{"name": "m", "slider": "s", "law": {"start": 0.1, "rate": 0.2, "acceleration": 3, "sines": [{"amplitude": 1, "frequency": 2, "phase": 0.3}]}}]
    });
    let scene = Scene::read(&scene([0.0, 0.0], bars, json!({}), 1.0, 1.0, others).to_string());
    let model = super::model::Model::new(scene);
    let (q, v, a) = (
        [0.3, -0.4, 1.1, 0.7, 0.2, -2.0],
        [1.0, -2.0, 0.7, 0.3, 0.9, -1.5],
        [0.4, 0.2, -0.9, 1.3, -0.7, 0.6],
    );
    let of = |f: &dyn Fn(usize) -> f64| (0..6).map(|i| Dd::from(f(i))).collect::<Vec<_>>();
    let at = |t: f64| {
        let exact = |i: usize, p: [f64; 3]| {
            Dd::from(p[0]) + Dd::from(p[1]).scale(t) + Dd::from(p[2]).scale(t).scale(0.5 * t + i as f64 * 0.0)
        };
        let state = super::model::State {
            t: Dd::from(t),
            q: (0..6).map(|i| exact(i, [q[i], v[i], a[i]])).collect(),
            v: of(&|i| v[i] + a[i] * t),
            work: Dd::ZERO,
        };
        model.equations(&state)
    };
    let h = 2f64.powi(-26);
    let (before, now, after) = (at(-h), at(0.0), at(h));
    for (r, joint) in model.scene.joints.iter().enumerate() {
        let (minus, here, plus) = (&before[r], &now[r], &after[r]);
        let rate = (plus.off - minus.off).scale(0.5 / h);
        let second = (plus.off - here.off - here.off + minus.off).scale(1.0 / (h * h));
        let along = here.row.iter().fold(here.bend, |sum, &(k, g)| sum + g.scale(a[k]));
        let Joint { name, measure, .. } = joint;
        assert!(!matches!(measure, Measure::Angle { .. }));
        assert!(
            (rate - here.rate).hi.abs() < 1e-13 && (second - along).hi.abs() < 1e-12,
            "{name}: {rate:?} {:?}, {second:?} {along:?}",
            here.rate
        );
    }
}
