//! Rounding that is not searched for extremes.

use super::*;
use crate::dynamics::Mechanism;
use crate::scene::parse_scene;

/// A motion that depends on time so, and how often it was looked at.
struct Looked(Motion, fn(&mut Motion, f64), usize);

impl Inside for Looked {
    fn span(&self) -> (Time, Time) {
        (Time::from(0.0), Time::from(1.0))
    }

    fn at(&mut self, time: Time) -> &Motion {
        self.0.time = time;
        self.1(&mut self.0, time.hi);
        self.2 += 1;
        &self.0
    }

    fn roughly_at(&mut self, time: Time) -> &Motion {
        self.at(time)
    }
}

/// What the outputs come to in four steps of a motion, and how often it was looked at.
fn looked(text: &str, moves: fn(&mut Motion, f64)) -> (Vec<Extremes>, usize) {
    let scene = parse_scene(text, "scene", &[]).expect("a scene");
    let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
    let mut detector = ExtremesDetector::new(&mechanism).expect("an output");
    let mut inside = Looked(mechanism.start(&scene), moves, 0);
    for _ in 0..4 {
        detector.step(&mut inside);
    }
    (detector.extremes(), inside.2)
}

const BAR: &str = r#"{"name": "bar", "gravity": [0, 0], "outputs": {"one": "b.sin", "two": "b.omega"},
    "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 1}],
    "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b",
     "point": [0, 0]}]}],
    "start": {"b": {"phi": 0, "omega": 0}}, "until": 1, "every": 1}"#;

/// Noise far above rounding, of which every one of the 64 short parts of a step has as much: with a search
/// in each 4000 looks a step and more.  A corner of another output is found beside it.
#[test]
fn an_irregular_output_is_not_looked_into() {
    let moves = |motion: &mut Motion, t: f64| {
        let noise = (1e4 * libm::sin(1e9 * t)).fract();
        motion.phi[0] = DoubleDouble::from(0.3 + 0.1 * noise);
        motion.omega[0] = DoubleDouble::from(1.0 + (t - 0.3).abs());
    };
    let (found, looks) = looked(BAR, moves);
    assert!(looks < 6000, "{looks} looks");
    let [noise, corner] = &found[..] else { panic!("{found:?}") };
    assert!(noise.max[0] <= libm::sin(0.4) && noise.max[0] > libm::sin(0.39), "{noise:?}");
    assert!((noise.mean - libm::sin(0.3)).abs() < 0.02, "{noise:?}");
    assert!((corner.min[0] - 1.0).abs() < 1e-12 && (corner.min[1] - 0.3).abs() < 1e-9, "{corner:?}");
}

/// No interpolant resolves it, nor halves of the step, of which there were 64 with 33 points each.
#[test]
fn rounding_of_an_output_is_not_looked_into() {
    let moves = |motion: &mut Motion, t: f64| {
        motion.phi[0] = DoubleDouble::from(1e-17 * libm::sin(1e6 * t));
    };
    let (found, looks) = looked(BAR, moves);
    let found = &found[0];
    assert!(looks < 100, "{looks} looks");
    assert!(found.max[0] <= 1e-17 && found.min[0] >= -1e-17 && found.rms <= 1e-17, "{found:?}");
}

/// A body that must not turn is pushed beside its centre: what is left of its acceleration is rounding of
/// forces, which is nothing at the start but for gravity, and no coordinate changes it.
#[test]
fn rounding_of_forces_that_cancel_is_not_looked_into() {
    let text = r#"{"name": "held", "gravity": [0, -9.81], "outputs": {"one": "c.alpha"},
        "bars": [{"name": "c", "mass": 1.77, "centre": [0, 0], "inertia": 0.1, "length": 0.3},
         {"name": "b", "mass": 1.42, "centre": [0.2875, -0.0439], "inertia": 0.0465, "length": 0.56}],
        "hinges": [{"name": "H", "between": [{"body": "c", "point": [0, 0]}, {"body": "b",
         "point": [0, 0]}]}],
        "sliders": [{"name": "S", "point": {"body": "c", "point": [0, 0]}, "angle": "locked",
         "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0.1788]}}],
        "springs": [{"name": "K", "between": [{"body": "ground", "point": [0, 1]}, {"body": "c",
         "point": [0.05, 0.3]}], "stiffness": 30, "free_length": 0.2}],
        "start": {"c": {"phi": 0.4, "omega": 0, "origin": [0, 0], "velocity": [0, 0]},
         "b": {"phi": -0.3163, "omega": 0.3634}}, "until": 1, "every": 1}"#;
    let moves = |motion: &mut Motion, t: f64| {
        motion.phi[1] = DoubleDouble::from(-0.3163 + 0.3634 * t);
        (motion.phi[2], motion.phi[3]) = (DoubleDouble::from(0.2 * t), DoubleDouble::from(0.03576 * t));
    };
    let (found, looks) = looked(text, moves);
    let found = &found[0];
    assert!(looks < 1000, "{looks} looks");
    assert!(found.peak()[0].abs() < 1e-12 && found.max[0] > 0.0, "{found:?}");
}
