//! Periodic motions and Floquet multipliers against closed forms, and against equations written out here.

use driftless::dynamics::Mechanism;
use driftless::run::modes::{ModesError, PeriodicMotion, PeriodicMotions, Stability, periodic};
use driftless::scene::{Scene, parse_scene, read_scene};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

fn example(name: &str) -> Scene {
    read_scene(format!("examples/scenes/{name}.json").as_ref(), &[]).expect("a shipped scene")
}

fn parsed(text: &str) -> Scene {
    parse_scene(text, "scene.json", &[]).unwrap_or_else(|error| panic!("{error}"))
}

fn found(scene: &Scene, starts: usize, period: Option<f64>) -> Result<PeriodicMotions, ModesError> {
    let mechanism = Arc::new(Mechanism::new(scene).expect("equations"));
    periodic(scene, &mechanism, starts, period)
}

/// A bar on the end of one that a motor turns at 5 rad/s, with a torsion spring between them.
fn arm(gravity: f64, stiffness: f64, damping: f64, phi: f64) -> Scene {
    let spring = format!(r#""stiffness": {stiffness}, "free_angle": 0, "damping": {damping}"#);
    arm_with(gravity, &spring, phi)
}

fn arm_with(gravity: f64, spring: &str, phi: f64) -> Scene {
    parsed(&format!(
        r#"{{"name": "arm", "gravity": [{gravity}, 0],
        "bars": [{{"name": "one", "mass": 1, "centre": [0.2, 0], "inertia": 0.02, "length": 0.4}},
                 {{"name": "two", "mass": 2, "centre": [0.3, 0], "inertia": 0.05, "length": 0.6}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "one", "point": [0, 0]}}]}},
                   {{"name": "B", "between": [{{"body": "one", "point": [0.4, 0]}}, {{"body": "two", "point": [0, 0]}}]}}],
        "motors": [{{"name": "motor", "body": "one", "law": {{"start": 0.3, "rate": 5}}}}],
        "torsion_springs": [{{"name": "T", "body": "two", "relative_to": "one", {spring}}}],
        "start": {{"two": {{"phi": {phi}, "omega": 5}}}}, "until": 1, "every": 1}}"#
    ))
}

const INERTIA: f64 = 0.05 + 2.0 * 0.09;
const LEVER: f64 = 2.0 * 0.3;

/// The difference of a multiplier and the nearest of the expected ones, real and imaginary parts.
fn off(one: &PeriodicMotion, expected: &[[f64; 2]]) -> f64 {
    assert_eq!(one.multipliers.len(), expected.len());
    let apart = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    expected
        .iter()
        .map(|want| one.multipliers.iter().map(|have| apart(want, have)).fold(f64::INFINITY, f64::min))
        .fold(0.0, f64::max)
}

#[test]
fn a_bar_on_a_turning_bar_has_the_multipliers_of_its_closed_form() {
    let period = TAU / 5.0;
    for (stiffness, damping, is_inward) in
        [(0.0, 0.0, false), (0.0, 0.0, true), (1.5, 0.3, false), (0.2, 12.0, false), (0.0, 0.7, true)]
    {
        let phi = if is_inward { 0.29 + PI } else { 0.4 };
        let found = found(&arm(0.0, stiffness, damping, phi), 0, None).expect("a search");
        assert!((found.period - period).abs() < 1e-14);
        let one = found.motions.iter().find(|one| one.from_start).expect("a motion from the start");
        // J s² + d s + k + m c l Ω² cos = 0, μ = exp(s T).
        let side = if is_inward { -1.0 } else { 1.0 };
        assert!(((one.phi[1] - one.phi[0]).cos() - side).abs() < 1e-12, "{one:?}");
        assert_eq!(one.turns, [1, 1]);
        let (b, c) = (damping / INERTIA, (stiffness + LEVER * 0.4 * 25.0 * side) / INERTIA);
        let square = b * b - 4.0 * c;
        let expected = if square < 0.0 {
            let (size, angle) = ((-b * period / 2.0).exp(), (-square).sqrt() * period / 2.0);
            [[size * angle.cos(), size * angle.sin()], [size * angle.cos(), -size * angle.sin()]]
        } else {
            [1.0, -1.0].map(|sign| [(0.5 * (-b + sign * square.sqrt()) * period).exp(), 0.0])
        };
        let largest = expected[0][0].hypot(expected[0][1]).max(1.0);
        assert!(off(one, &expected) < 1e-8 * largest, "{one:?} {expected:?}");
        let stability = match (side < 0.0, damping > 0.0) {
            (true, _) => Stability::Unstable,
            (false, true) => Stability::AsymptoticallyStable,
            (false, false) => Stability::Stable,
        };
        assert_eq!(one.stability, stability);
    }
}

#[test]
fn laws_of_relative_angles_count_turns_between_the_bodies_alone() {
    let linear = found(&arm(0.0, 1.5, 0.3, 0.4), 0, None).expect("a search");
    for spring in
        [r#""torque": "1.5*angle + 0.3*rate""#, r#""potential": "0.75*angle^2", "torque": "0.3*rate""#]
    {
        let law = found(&arm_with(0.0, spring, 0.4), 0, None).expect("a search");
        let multipliers = |of: &PeriodicMotions| of.motions[0].multipliers.clone();
        assert!(off(&linear.motions[0], &multipliers(&law)) < 1e-9, "{spring}");
        assert_eq!(law.motions[0].turns, [1, 1]);
    }
    // One to the ground holds the bar back.
    let spring = r#""torque": "1.5*(angle - two.phi)""#;
    let error = found(&arm_with(0.0, spring, 0.4), 0, None).expect_err("turns felt");
    assert!(matches!(error, ModesError::NotPeriodic { .. }), "{error}");
}

/// A state of angle and rate after a time with the derivative by its start: the classical method of Runge and
/// Kutta on x' = w, w' = f(t, x, w) and its variational equations.
fn flown(
    acceleration: &dyn Fn(f64, f64, f64) -> [f64; 3],
    start: [f64; 2],
    period: f64,
) -> ([f64; 2], [[f64; 2]; 2]) {
    let steps = 40_000;
    let h = period / f64::from(steps);
    let slope = |t: f64, y: [f64; 6]| {
        let [a, by_x, by_w] = acceleration(t, y[0], y[1]);
        [y[1], a, y[4], y[5], by_x * y[2] + by_w * y[4], by_x * y[3] + by_w * y[5]]
    };
    let along = |y: [f64; 6], k: [f64; 6], h: f64| std::array::from_fn(|i| y[i] + h * k[i]);
    let mut y = [start[0], start[1], 1.0, 0.0, 0.0, 1.0];
    for n in 0..steps {
        let t = f64::from(n) * h;
        let k1 = slope(t, y);
        let k2 = slope(t + h / 2.0, along(y, k1, h / 2.0));
        let k3 = slope(t + h / 2.0, along(y, k2, h / 2.0));
        let k4 = slope(t + h, along(y, k3, h));
        y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
    }
    ([y[0], y[1]], [[y[2], y[3]], [y[4], y[5]]])
}

/// Every motion found closes in equations written out here, with the same multipliers; how many there were.
fn closes(found: &PeriodicMotions, body: usize, acceleration: &dyn Fn(f64, f64, f64) -> [f64; 3]) -> usize {
    for one in &found.motions {
        let start = [one.phi[body], one.omega[body]];
        let (end, [[a, b], [c, d]]) = flown(acceleration, start, found.period);
        let largest = [a, b, c, d].iter().fold(1.0, |most: f64, x| most.max(x.abs()));
        let turns = ((end[0] - start[0]) / TAU).round();
        assert!((end[0] - start[0] - TAU * turns).abs() < 1e-9 * largest, "{one:?} {end:?}");
        assert!((end[1] - start[1]).abs() < 1e-8 * largest, "{one:?} {end:?}");
        let (trace, det) = (a + d, a * d - b * c);
        let square = trace * trace / 4.0 - det;
        let expected = if square < 0.0 {
            [1.0, -1.0].map(|sign| [trace / 2.0, sign * (-square).sqrt()])
        } else {
            [1.0, -1.0].map(|sign| [trace / 2.0 + sign * square.sqrt(), 0.0])
        };
        // Near a double root only half the digits are left.
        let within = (1e-8 * largest / square.abs().sqrt()).max(1e-8) * largest;
        assert!(off(one, &expected) < within, "{one:?} {expected:?}");
    }
    found.motions.len()
}

#[test]
fn an_arm_under_gravity_closes_in_equations_of_its_own() {
    let found = found(&arm(9.81, 0.0, 0.0, 0.4), 48, None).expect("a search");
    let acceleration = |t: f64, x: f64, _: f64| {
        let crank = 0.3 + 5.0 * t;
        let pull = LEVER * 0.4 * 25.0;
        [
            -(pull * (x - crank).sin() + LEVER * 9.81 * x.sin()) / INERTIA,
            -(pull * (x - crank).cos() + LEVER * 9.81 * x.cos()) / INERTIA,
            0.0,
        ]
    };
    let count = closes(&found, 1, &acceleration);
    println!("{count} motions");
    assert!(count >= 2);
}

#[test]
fn a_driven_oscillator_closes_in_equations_of_its_own() {
    let found = found(&example("duffing"), 48, Some(TAU / 1.2)).expect("a search");
    let acceleration =
        |t: f64, x: f64, w: f64| [x - x * x * x - 0.2 * w + 0.3 * (1.2 * t).cos(), 1.0 - 3.0 * x * x, -0.2];
    let count = closes(&found, 0, &acceleration);
    assert_eq!(count, 2);
    // x(t) -> -x(t + T/2) makes one of the other.
    let [one, other] = [0, 1].map(|k| &found.motions[k]);
    let half = &found.course(one, 2).expect("a course")[1];
    assert!((half[0][0] + other.phi[0]).abs() < 1e-8 && (half[1][0] + other.omega[0]).abs() < 1e-8);
    for one in &found.motions {
        // Liouville: the product of the multipliers is what damping leaves.
        let product: f64 = one.multipliers.iter().map(|[re, im]| re.hypot(*im)).product();
        assert!((product - (-0.2 * found.period).exp()).abs() < 1e-7, "{one:?}");
    }
}

#[test]
fn multipliers_of_a_loop_with_a_bar_hung_on_it_come_in_reciprocal_pairs() {
    let mut text = std::fs::read_to_string("examples/scenes/four_bar_motor.json").expect("a scene");
    let [bars, hinges] =
        ["\"bars\": [", "\"hinges\": ["].map(|key| text.find(key).expect("a list") + key.len());
    text.insert_str(
        hinges,
        r#"{"name": "P", "between": [{"body": "coupler", "point": [0.1, 0.05]}, {"body": "swing", "point": [0, 0]}]},"#,
    );
    text.insert_str(
        bars,
        r#"{"name": "swing", "mass": 0.3, "centre": [0.05, 0], "inertia": 0.0004, "length": 0.1},"#,
    );
    let start = text.find("\"start\": {").expect("a start") + "\"start\": {".len();
    text.insert_str(start, r#""swing": {"phi": -1.3, "omega": 0},"#);
    let found = found(&parsed(&text), 32, None).expect("a search");
    assert_eq!(found.degrees_of_freedom, 1);
    println!("{} motions of {} starts", found.motions.len(), found.starts[0]);
    assert!(!found.motions.is_empty());
    for one in &found.motions {
        let [[a, b], [c, d]] = [one.multipliers[0], one.multipliers[1]];
        let product = [a * c - b * d, a * d + b * c];
        assert!((product[0] - 1.0).abs() < 1e-6 && product[1].abs() < 1e-6, "{one:?}");
        // Where it is at the end of a run of three periods that shares only the equations.
        let course = found.course(one, 8).expect("a course");
        assert_eq!(course.len(), 8);
        assert_eq!(course[0][0], one.phi);
    }
}

#[test]
fn what_has_no_period_says_why() {
    let of = |name: &str, period: Option<f64>| found(&example(name), 0, period);
    assert!(matches!(of("motor_sine", None), Err(ModesError::PeriodUnknown(_))));
    assert!(matches!(of("motor_sine", Some(1.0)), Err(ModesError::NotPeriodic { .. })));
    assert!(matches!(of("duffing", None), Err(ModesError::PeriodUnknown(_))));
    assert!(matches!(of("duffing", Some(5.0)), Err(ModesError::NotPeriodic { .. })));
    assert!(matches!(of("stick_slip", None), Err(ModesError::Friction)));
    assert!(matches!(of("pid", Some(1.0)), Err(ModesError::Integrals)));
    let Err(ModesError::Driven(period)) = of("crank_rocker", None) else { panic!("it is driven") };
    assert!((period - 0.2).abs() < 1e-12);
    // A motor that swings twice while another turns once: the longer period is that of both.
    let mut both = arm(9.81, 0.0, 0.0, 0.4);
    both.motors[0].law.sines = vec![driftless::scene::Sine { amplitude: 0.1, frequency: 7.5, phase: 0.4 }];
    let period = found(&both, 0, None).expect("a search").period;
    assert!((period - 4.0 * PI / 5.0).abs() < 1e-12, "{period}");
    // A force that swings while the motor stands or turns counts as well.
    for (rate, shared) in [(0.0, 0.8 * PI), (5.0, 0.8 * PI), (3.0, 4.0 * PI)] {
        let mut pulled = arm(9.81, 1.0, 0.5, 0.4);
        pulled.motors[0].law.rate = rate;
        pulled.torques = parsed(
            r#"{"name": "pull", "gravity": [0, -9.81],
            "bars": [{"name": "one", "mass": 1, "centre": [0.2, 0], "inertia": 0.02, "length": 0.4},
                     {"name": "two", "mass": 2, "centre": [0.3, 0], "inertia": 0.05, "length": 0.6}],
            "start": {"one": {"phi": 0, "omega": 0}, "two": {"phi": 0, "omega": 0}},
            "torques": [{"name": "pull", "body": "two", "torque": 0.3,
                         "law": {"start": 0.1, "sines": [{"amplitude": 1, "frequency": 2.5}]}}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "one", "point": [0, 0]}]},
                       {"name": "B", "between": [{"body": "one", "point": [0.4, 0]}, {"body": "two", "point": [0, 0]}]}],
            "until": 1, "every": 1}"#,
        )
        .torques;
        let period = found(&pulled, 0, None).expect("a search").period;
        assert!((period - shared).abs() < 1e-12, "{rate}: {period}");
    }
}

#[test]
fn starts_from_which_small_differences_explode_within_a_period_are_left() {
    // Sixty turns of the motor of a double pendulum that is chaotic: no difference is a derivative.
    let scene = example("motor");
    let found = found(&scene, 3, Some(60.0)).expect("a search");
    println!("{} of {} starts left", found.unstable, found.starts[0]);
    assert!(found.unstable > 0 && found.unstable + found.starts[1] <= found.starts[0]);
}

/// w' + 2 w + 4 x = sin 2πt from its start at zero, where all forces vanish but for rounding; beside events that
/// switch a torque on or end the run, which have no part in it: x = Im(e^(2πit)/(4 - 4π² + 4πi)).
#[test]
fn a_forced_oscillator_has_the_motion_of_its_closed_form_whatever_events_do() {
    let scene = |phi: f64, events: &str| {
        parsed(&format!(
            r#"{{"name": "forced", "gravity": [0, 0],
            "bars": [{{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 1}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
            "torsion_springs": [{{"name": "spring", "body": "b", "stiffness": 4, "free_angle": 0, "damping": 2}}],
            "torques": [{{"name": "push", "body": "b", "torque": 10}},
                {{"name": "drive", "body": "b", "torque": 1,
                  "law": {{"start": 0, "sines": [{{"amplitude": 1, "frequency": "2*pi"}}]}}}}],
            "inactive": ["push"], {events}
            "start": {{"b": {{"phi": {phi}, "omega": 0}}}}, "until": 20, "every": 1}}"#
        ))
    };
    let (real, imaginary) = (4.0 - TAU * TAU, 2.0 * TAU);
    let square = real * real + imaginary * imaginary;
    let expected = [-imaginary / square, TAU * real / square];
    for (phi, events) in [
        (0.0, ""),
        (0.3, r#""events": [{"name": "on", "when": "t - 0.37", "on": ["push"]}],"#),
        (0.3, r#""events": [{"name": "end", "when": "t - 0.37", "action": "stop"}],"#),
    ] {
        let found = found(&scene(phi, events), 4, Some(1.0)).expect("a search");
        assert_eq!(found.motions.len(), 1, "{events}");
        let motion = &found.motions[0];
        let off = (motion.phi[0] - expected[0]).abs().max((motion.omega[0] - expected[1]).abs());
        assert!(off < 1e-9, "{events}: {motion:?}");
        assert_eq!(found.left_out.contains(&"events"), !events.is_empty());
    }
}

/// A body that a law holds to half the square of another's angle, so that neighbours' rates differ with the
/// angle: (1 + 3 x²) x'' + 3 x x'² = 6 sin 3t - 2.2 x - 0.02 x', beside the equation of small differences.
#[test]
fn motions_held_to_one_another_by_a_curve_have_the_multipliers_of_their_equation() {
    let scene = parsed(
        r#"{"name": "curve", "gravity": [0, 0],
        "bars": [{"name": "a", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 1},
                 {"name": "b", "mass": 1, "centre": [0, 0], "inertia": 3, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
                   {"name": "B", "between": [{"body": "ground", "point": [2, 0]}, {"body": "b", "point": [0, 0]}]}],
        "motors": [{"name": "G", "body": "b", "law": "0.5*a.phi^2"}],
        "torsion_springs": [{"name": "T", "body": "a", "stiffness": 2.2, "free_angle": 0, "damping": 0.02}],
        "torques": [{"name": "drive", "body": "a", "torque": 6, "law": {"start": 0, "sines": [{"amplitude": 1, "frequency": 3}]}}],
        "start": {"a": {"phi": 0.3, "omega": 0}}, "until": 10, "every": 0.1}"#,
    );
    // Angle, rate, and small differences of both from two starts.
    let rates = |t: f64, y: [f64; 6]| {
        let [x, w, ..] = y;
        let mass = 1.0 + 3.0 * x * x;
        let a = (6.0 * libm::sin(3.0 * t) - 2.2 * x - 0.02 * w - 3.0 * x * w * w) / mass;
        let by_x = (-2.2 - 3.0 * w * w - 6.0 * x * a) / mass;
        let by_w = (-0.02 - 6.0 * x * w) / mass;
        let of = |dx: f64, dw: f64| [dw, by_x * dx + by_w * dw];
        let ([p, q], [r, s]) = (of(y[2], y[3]), of(y[4], y[5]));
        [w, a, p, q, r, s]
    };
    let found = found(&scene, 6, None).expect("a search");
    assert!(!found.motions.is_empty());
    for one in &found.motions {
        let (steps, mut y) = (4000, [one.phi[0], one.omega[0], 1.0, 0.0, 0.0, 1.0]);
        let h = found.period / f64::from(steps);
        for k in 0..steps {
            let t = h * f64::from(k);
            let moved = |by: [f64; 6], h: f64| std::array::from_fn(|i| y[i] + h * by[i]);
            let k1 = rates(t, y);
            let k2 = rates(t + 0.5 * h, moved(k1, 0.5 * h));
            let k3 = rates(t + 0.5 * h, moved(k2, 0.5 * h));
            let k4 = rates(t + h, moved(k3, h));
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        }
        assert!((y[0] - one.phi[0]).abs().max((y[1] - one.omega[0]).abs()) < 1e-8, "{one:?}");
        let (mean, determinant) = (0.5 * (y[2] + y[5]), y[2] * y[5] - y[3] * y[4]);
        let square = mean * mean - determinant;
        let root = square.abs().sqrt();
        let expected = match square > 0.0 {
            true => [[mean + root, 0.0], [mean - root, 0.0]],
            false => [[mean, root], [mean, -root]],
        };
        let off = off(one, &expected);
        println!("{:?}: {off:.1e} off", one.multipliers);
        assert!(off < 1e-6, "{expected:?} {one:?}");
    }
    assert!(found.motions.iter().any(|one| one.stability == Stability::Unstable));
}

/// A bar that hangs at the corner of a spring to one side, beside one that a motor turns: disturbances to either
/// side have other frequencies, and so has the motion no multipliers.  A corner elsewhere changes nothing.
#[test]
fn a_motion_on_a_corner_has_no_multipliers() {
    let with = |law: &str| {
        let scene = parsed(&format!(
            r#"{{"name": "hanging", "gravity": [10, 0],
            "bars": [{{"name": "one", "mass": 1, "centre": [0.2, 0], "inertia": 0.02, "length": 0.4}},
                     {{"name": "two", "mass": 2, "centre": [0.3, 0], "inertia": 0.05, "length": 0.6}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [2, 0]}}, {{"body": "one", "point": [0, 0]}}]}},
                       {{"name": "B", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "two", "point": [0, 0]}}]}}],
            "motors": [{{"name": "motor", "body": "one", "law": {{"start": 0.3, "rate": 5}}}}],
            "torsion_springs": [{{"name": "T", "body": "two", "torque": "{law}"}}],
            "start": {{"two": {{"phi": 0, "omega": 0}}}}, "until": 1, "every": 1}}"#
        ));
        let motions = found(&scene, 0, None).expect("a search").motions;
        motions.into_iter().find(|one| one.from_start).unwrap_or_else(|| panic!("{law}: no motion"))
    };
    for law in
        ["if(angle < 0, 0, 1.5*angle)", "max(0, 1.5*angle)", "0.3*abs(angle)", "2*max(0, angle) + 1*angle"]
    {
        let one = with(law);
        println!("{law}: {one:?}");
        assert!(one.is_on_corner && one.multipliers.is_empty(), "{law}: {one:?}");
        assert_eq!(one.stability, Stability::Undecided, "{law}");
    }
    // J s² + k + m g l = 0 on the branch it stays on.
    let rate = ((1.5 + LEVER * 10.0) / INERTIA).sqrt() * TAU / 5.0;
    let expected = [[rate.cos(), rate.sin()], [rate.cos(), -rate.sin()]];
    for law in ["1.5*min(angle, 0.5)", "if(angle < -0.2, 0, 1.5*angle)", "1.5*angle"] {
        let one = with(law);
        println!("{law}: {one:?}");
        assert!(!one.is_on_corner && off(&one, &expected) < 1e-8, "{law}: {one:?}");
    }
}

/// A bar on a hinge, J = 0.12 kg m^2, with a torque.
fn turned_by(torque: &str) -> Scene {
    parsed(&format!(
        r#"{{"name": "turned", "gravity": [0, 0],
        "bars": [{{"name": "b", "mass": 1, "centre": [0.3, 0], "inertia": 0.03, "length": 0.6}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
        "torques": [{{"name": "t", "body": "b", "torque": "{torque}"}}],
        "start": {{"b": {{"phi": 0, "omega": 0}}}}, "until": 20, "every": 0.1}}"#
    ))
}

/// Mathieu's equation x'' + (25 + 125/6 cos 9.6 t) x = 0, driven at nearly twice its frequency: rest is unstable,
/// with r + 1/r the trace of the two solutions after a period.  Times that are no period are refused, although
/// nothing acts where the bar starts.
#[test]
fn a_stiffness_that_varies_has_the_multipliers_of_mathieus_equation() {
    let scene = turned_by("-(3 + 2.5*cos(9.6*t))*b.sin");
    let period = TAU / 9.6;
    let slope = |t: f64, [x, v]: [f64; 2]| [v, -(25.0 + 125.0 / 6.0 * (9.6 * t).cos()) * x];
    let steps = 4000;
    let h = period / f64::from(steps);
    let end = |begin: [f64; 2]| {
        (0..steps).fold(begin, |y, k| {
            let at = |share: f64, a: [f64; 2]| {
                slope((f64::from(k) + share) * h, [y[0] + share * h * a[0], y[1] + share * h * a[1]])
            };
            let a = at(0.0, [0.0; 2]);
            let b = at(0.5, a);
            let c = at(0.5, b);
            let d = at(1.0, c);
            [0, 1].map(|i| y[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]))
        })
    };
    let trace = end([1.0, 0.0])[0] + end([0.0, 1.0])[1];
    let root = (trace * trace / 4.0 - 1.0).sqrt();
    let expected = [[trace / 2.0 + root, 0.0], [trace / 2.0 - root, 0.0]];
    let found = found(&scene, 0, Some(period)).expect("a search");
    let rest = found.motions.iter().find(|one| one.from_start).expect("rest");
    println!("{rest:?}, expected {expected:?}");
    assert!(rest.stability == Stability::Unstable && off(rest, &expected) < 1e-8, "{rest:?}");
    assert_eq!(found.at_rest, None);
    for period in [0.8, 0.5, 0.9 * period] {
        let refused = self::found(&scene, 0, Some(period));
        assert!(matches!(refused, Err(ModesError::NotPeriodic { .. })), "{period}: {refused:?}");
    }
}

/// What acts with rates only, what begins later, and a pulse between the times that are looked at: no motion
/// closes with them.
#[test]
fn drives_that_do_not_repeat_themselves_have_no_period() {
    for torque in [
        "-(0.2 + 2*sin(9.6*t))*b.omega",
        "1*if(t < 5, 1, 0)",
        "max(0 s, t - 5)*1 N*m/s",
        "1*exp(-1*t)",
        "0.5*sin(9.6*t) + 0.5*sin(7.3*t)",
    ] {
        for period in [0.3, 0.8, 1.0] {
            let refused = found(&turned_by(torque), 0, Some(period));
            assert!(matches!(refused, Err(ModesError::NotPeriodic { .. })), "{torque}: {refused:?}");
        }
    }
    let pulse = turned_by(
        "0.5*sin(2*pi*t/(0.35 s)) - 3*b.sin - 0.1*b.omega + if(t < 0.47, 0, 1)*if(t < 0.475, 5, 0)",
    );
    assert_eq!(found(&pulse, 0, Some(0.35)).expect("a search").motions.len(), 0);
}

/// A body on a vertical rail over a table that oscillates at 20 rad/s.  One impact a period: the product of the
/// multipliers is e^2.  Other periods are refused, and so is a drive beside that has none with the table.
#[test]
fn moving_walls_are_drives() {
    let table = |law: &str, more: &str| {
        parsed(&format!(
            r#"{{"name": "table", "gravity": [0, -9.81],
            "bars": [{{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.01, "length": 0.1}}],
            "sliders": [{{"name": "r", "point": {{"body": "b", "point": [0, 0]}}, "angle": "locked",
                "rail": {{"body": "ground", "point": [0, 0], "direction": [0, 1]}}}}],
            "walls": [{{"name": "w", "body": "b", "point": [0, 0], "restitution": 0.8, "law": {law},
                "line": {{"through": [0, 0], "normal": [0, 1]}}}}], {more}
            "start": {{"b": {{"phi": 0, "omega": 0, "origin": [0, 0.0435], "velocity": [0, -1.2745]}}}},
            "until": 60, "every": 0.1}}"#
        ))
    };
    let sines = r#"{"start": 0, "sines": [{"amplitude": 0.01, "frequency": 20}]}"#;
    let one = found(&table(sines, ""), 0, Some(TAU / 20.0)).expect("a search");
    let motion = one.motions.first().expect("a motion");
    let [[a, b], [c, d]] = motion.multipliers[..] else { panic!("{motion:?}") };
    assert!((a * c - b * d - 0.64).abs() < 1e-7, "{motion:?}");
    // With no period given it is that of the wall; there is no equilibrium.
    let scene = table(sines, "");
    assert_eq!(found(&scene, 0, None).map(|found| found.period), Ok(TAU / 20.0));
    let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
    let resting = driftless::run::modes::modes(&scene, &mechanism, 0);
    assert_eq!(resting.err(), Some(ModesError::Moving("w".into())));
    for law in [sines, r#""0.01*sin(20*t)""#, r#""max(0.01*sin(20*t), -1)""#] {
        for period in [0.25, 0.2, 0.4, 0.5, 0.0123] {
            let refused = found(&table(law, ""), 0, Some(period));
            assert!(matches!(refused, Err(ModesError::NotPeriodic { .. })), "{law}: {period}: {refused:?}");
        }
    }
    let force = r#""forces": [{"name": "f", "body": "b", "point": [0, 0], "force": [0, 10],
        "law": {"start": 0, "sines": [{"amplitude": 1, "frequency": 7.3}]}}],"#;
    let refused = found(&table(sines, force), 0, None);
    assert!(matches!(refused, Err(ModesError::PeriodUnknown(_))), "{refused:?}");
    let refused = found(&table(sines, force), 0, Some(TAU / 7.3));
    assert!(matches!(refused, Err(ModesError::NotPeriodic { .. })), "{refused:?}");
    // With half the frequency they have.
    let force = force.replace("7.3", "10");
    let shared = found(&table(sines, &force), 0, None).expect("a search");
    assert!((shared.period - TAU / 10.0).abs() < 1e-12);
}

/// 0.5 w' + 20 w + 0.5 x = sin 3t: multipliers of exp(-39.975 T) and exp(-0.025 T).  The first one is far below what
/// the differences leave, and no digits of its growth are told.
#[test]
fn multipliers_of_rounding_have_no_growth() {
    let scene = parsed(
        r#"{"name": "overdamped", "gravity": [0, 0],
            "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 0.6}],
            "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}]}],
            "torsion_springs": [{"name": "s", "body": "b", "stiffness": 0.5, "free_angle": 0, "damping": 20}],
            "torques": [{"name": "t", "body": "b", "torque": 1,
                         "law": {"start": 0, "sines": [{"amplitude": 1, "frequency": 3}]}}],
            "start": {"b": {"phi": 0, "omega": 0}}, "until": 20, "every": 0.1}"#,
    );
    let found = found(&scene, 0, None).expect("a search");
    let one = &found.motions[0];
    let slow = 20.0 - (400.0_f64 - 1.0).sqrt();
    let [largest, least] = [0, 1].map(|k| one.multipliers[k][0].hypot(one.multipliers[k][1]));
    assert!((largest - (-slow * TAU / 3.0).exp()).abs() < 1e-9, "{one:?}");
    assert!(least < one.multiplier_rounding && one.multiplier_rounding < 1e-8, "{one:?}");
    let page = driftless::report::periodic::text(&found);
    println!("{page}");
    // Upper bounds of its magnitude and of its growth.
    let bounds = page.split("< ").skip(1).map(|rest| rest.split_whitespace().next().expect("a number"));
    let bounds: Vec<f64> = bounds.map(|bound| bound.parse().expect("a number")).collect();
    assert!(matches!(bounds[..], [1e-9..1e-8, -10.0..-9.0]), "{page}");
    assert!(page.contains("-0.0250156"), "{page}");
}
