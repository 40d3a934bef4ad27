//! A bar that sticks in its hinge beside a wall that presses it, until the load takes it away: break-away times
//! in closed form, and the motion after them by an equation written here.

use super::formulas::{adaptive, run, scene};
use super::laws::rk4;
use driftless::run::{MethodId, Outcome, Request};
use driftless::stepping::Cause;
use std::f64::consts::TAU;

/// Mass \[kg\], distance of its centre \[m\], and moment of inertia about the hinge \[kg·m²\].
const MASS: f64 = 1.0;
const CENTRE: f64 = 0.25;
const INERTIA: f64 = 0.03 + MASS * CENTRE * CENTRE;

/// A bar on a hinge with friction, a plastic wall where its angle is `wall`, and a torque a + b sin(w t + p).
#[derive(Clone, Copy)]
struct Bar {
    gravity: [f64; 2],
    torque: [f64; 4],
    radius: f64,
    coefficient: f64,
    wall: f64,
    start: f64,
}

impl Bar {
    fn text(&self, until: f64) -> String {
        let ([gx, gy], [a, b, w, p]) = (self.gravity, self.torque);
        let (sin, cos) = self.wall.sin_cos();
        format!(
            r#"{{"name": "bar", "gravity": [{gx}, {gy}],
            "bars": [{{"name": "bar", "mass": {MASS}, "centre": [{CENTRE}, 0], "inertia": 0.03, "length": 0.5}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}],
                "friction": {{"radius": {}, "kinetic": {}}}}}],
            "walls": [{{"name": "W", "body": "bar", "point": [0.5, 0], "restitution": 0,
                "line": {{"through": [{}, {}], "normal": [{}, {cos}]}}}}],
            "torques": [{{"name": "Q", "body": "bar", "torque": "1*({a} + {b}*sin({w}*t + {p}))"}}],
            "start": {{"bar": {{"phi": {}, "omega": 0}}}}, "until": {until}, "every": {until}}}"#,
            self.radius,
            self.coefficient,
            0.5 * cos,
            0.5 * sin,
            -sin,
            self.start,
        )
    }

    /// The torque of weight and load about the hinge \[N·m\].
    fn load(&self, t: f64, phi: f64) -> f64 {
        let ([gx, gy], [a, b, w, p]) = (self.gravity, self.torque);
        a + b * (w * t + p).sin() + MASS * CENTRE * (phi.cos() * gy - phi.sin() * gx)
    }

    /// The first time from `from` on at which the load on the resting bar passes the limit of friction.
    fn breaks_away(&self, from: f64) -> f64 {
        let ([gx, gy], [a, b, w, p]) = (self.gravity, self.torque);
        let limit = self.coefficient * self.radius * MASS * gx.hypot(gy);
        let weight = self.load(0.0, self.wall) - a - b * p.sin();
        let rises = ((limit - weight - a) / b).asin() - p;
        (0..).map(|turns| (rises + TAU * f64::from(turns)) / w).find(|t| *t > from).expect("a time")
    }

    /// Angle, rate, and the energy lost in friction, a time after the break-away at `begin` while it slides up.
    fn slid(&self, begin: f64, until: f64) -> [f64; 3] {
        let [gx, gy] = self.gravity;
        let equation = |t: f64, y: &[f64; 3]| {
            let [phi, omega, _] = *y;
            let (sin, cos) = phi.sin_cos();
            let (mut acceleration, mut friction) = (0.0, 0.0);
            for _ in 0..60 {
                let ax = -CENTRE * (sin * acceleration + cos * omega * omega) - gx;
                let ay = CENTRE * (cos * acceleration - sin * omega * omega) - gy;
                friction = self.coefficient * self.radius * MASS * ax.hypot(ay);
                acceleration = (self.load(begin + t, phi) - friction) / INERTIA;
            }
            [omega, acceleration, friction * omega]
        };
        rk4([self.wall, 0.0, 0.0], until - begin, 20_000, equation)
    }
}

/// It is pressed, held by friction for some milliseconds, and goes.
const PRESSED: Bar = Bar {
    gravity: [0.0, -10.0],
    torque: [-3.0, 6.0, 4.0, 4.0],
    radius: 0.05,
    coefficient: 0.3,
    wall: -std::f64::consts::FRAC_PI_2,
    start: -std::f64::consts::FRAC_PI_2,
};
/// It falls on its wall twice before.
const FALLS: Bar = Bar {
    gravity: [-1.14, -9.81],
    torque: [-0.05, 1.36, 3.91, 2.19],
    radius: 0.075,
    coefficient: 0.196,
    wall: -2.12,
    start: -1.82,
};

pub fn done(text: &str, request: &Request) -> Outcome {
    let outcome = run(&scene(text), request);
    assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
    outcome
}

#[test]
fn a_bar_breaks_away_from_its_wall_when_the_load_passes_the_limit() {
    let t = PRESSED.breaks_away(0.0);
    assert!((t - 0.708_975_105_069).abs() < 1e-12);
    let methods = [MethodId::Taylor, MethodId::Dp8, MethodId::Dp5, MethodId::Radau(5)];
    for (method, tolerance) in methods.into_iter().flat_map(|method| [(method, 1e-9), (method, 1e-12)]) {
        let outcome = done(&PRESSED.text(1.3), &adaptive(method, tolerance));
        let slides = outcome.frictions.iter().find(|record| record.mode == "slides").expect("a break-away");
        assert!((slides.t - t).abs() < 1e-8, "{method} {tolerance}: {} for {t}", slides.t);
        let [phi, omega, lost] = PRESSED.slid(t, 1.3);
        let last = &outcome.last;
        let off = [last.phi[0] - phi, last.omega[0] - omega, outcome.last.friction - lost];
        assert!(off.iter().all(|off| off.abs() < 1e4 * tolerance), "{method} {tolerance}: {off:?}");
    }
}

/// Where both coefficients are one, it begins without an acceleration, and rounding may begin it backwards.
#[test]
fn what_breaks_away_without_an_acceleration_does_not_stick_again_at_once() {
    let until = 2.9;
    let t = FALLS.breaks_away(2.2);
    let [phi, omega, _] = FALLS.slid(t, until);
    for (method, tolerance) in [
        (MethodId::Dp8, 1e-9),
        (MethodId::Dp8, 1e-11),
        (MethodId::Taylor, 1e-11),
        (MethodId::Radau(5), 1e-11),
    ] {
        let outcome = done(&FALLS.text(until), &adaptive(method, tolerance));
        let last = outcome.frictions.last().expect("a break-away");
        assert!(last.mode == "slides" && (last.t - t).abs() < 1e-9, "{method}: {last:?} for {t}");
        let off = [outcome.last.phi[0] - phi, outcome.last.omega[0] - omega];
        assert!(off.iter().all(|off| off.abs() < 1e4 * tolerance), "{method} {tolerance}: {off:?}");
    }
}

/// With equal coefficients the velocity of what breaks loose grows with the square of time: a coarse method has it
/// against its sense at first, which is no return to rest.
#[test]
fn what_breaks_loose_with_nothing_to_spare_slides_by_coarse_methods_too() {
    for (torque, rate, friction) in
        [(4.947, 8.306, 0.116), (4.407, 3.726, 0.254), (4.722, 2.092, 0.149), (3.195, 4.11, 0.273)]
    {
        let text = format!(
            r#"{{"name": "rocker", "gravity": [0, -9.81],
            "bars": [{{"name": "a", "mass": 1, "centre": [0.3, 0.2], "inertia": 0.1, "length": 0.5}}],
            "walls": [{{"name": "W", "body": "a", "point": [0, 0], "restitution": 0,
                "line": {{"through": [0, 0], "normal": [0, 1]}}, "friction": {{"kinetic": {friction}}}}}],
            "torsion_springs": [{{"name": "T", "body": "a", "stiffness": 400, "free_angle": 0, "damping": 0.2}}],
            "torques": [{{"name": "Q", "body": "a", "torque": "{torque}*sin({rate}*t)"}}],
            "start": {{"a": {{"phi": 0.02, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}}}},
            "until": 2, "every": 0.1}}"#
        );
        let [fine, coarse] = [(MethodId::Taylor, 1e-12), (MethodId::Radau(3), 1e-6)]
            .map(|(method, tolerance)| done(&text, &adaptive(method, tolerance)));
        let off = coarse.last.phi.iter().zip(&fine.last.phi).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 2e-4, "{torque}: {off:e}");
        let [count, usual] = [&coarse, &fine].map(|outcome| outcome.friction_count);
        assert!(count <= 2 * usual + 4, "{torque}: {count} transitions for {usual}");
    }
}

/// A slider-crank at its wall, with friction at the crank pin and on the rail.
const CRANK: &str = r#"{"name": "crank", "gravity": [-0.95, -9.81],
        "bars": [{"name": "crank", "mass": 1, "centre": [0.1, 0], "inertia": 0.02, "length": 0.2},
            {"name": "rod", "mass": 0.5, "centre": [0.25, 0], "inertia": 0.01, "length": 0.5}],
        "hinges": [{"name": "O", "between": [{"body": "ground", "point": [0, 0]}, {"body": "crank", "point": [0, 0]}]},
            {"name": "P", "between": [{"body": "crank", "point": [0.2, 0]}, {"body": "rod", "point": [0, 0]}],
             "friction": {"radius": 0.02, "kinetic": 0.08, "static": 0.104}}],
        "sliders": [{"name": "S", "point": {"body": "rod", "point": [0.5, 0]},
            "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]},
            "friction": {"kinetic": 0.131, "static": 0.1703}}],
        "walls": [{"name": "W", "body": "rod", "point": [0.5, 0], "restitution": 0,
            "line": {"through": [0.66, 0], "normal": [-1, 0]}}],
        "torques": [{"name": "Q", "body": "crank", "torque": "1*(0.09 + 1.18*sin(4.65*t + 1.43))"}],
        "torsion_springs": [{"name": "T", "body": "rod", "relative_to": "crank", "stiffness": 1.45,
            "free_angle": -0.72}],
        "start": {"crank": {"phi": 1.77, "omega": 0}, "rod": {"phi": -0.3}}, "until": 4, "every": 4}"#;

/// Its crank's angle with the tip at the wall, 0.66 m from the hinge: the law of cosines.
fn crank_at_wall() -> f64 {
    f64::acos((0.66 * 0.66 + 0.04 - 0.25) / (2.0 * 0.66 * 0.2))
}

/// Either sticks and both are at their limits when the wall takes over the load, which returns with every period;
/// none of them moves again.
#[test]
fn supports_at_their_limits_hand_the_load_to_the_wall() {
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Radau(5)] {
        let outcome = done(CRANK, &adaptive(method, 1e-11));
        assert!((outcome.last.phi[0] - crank_at_wall()).abs() < 1e-12, "{method}");
        assert!(outcome.last.omega.iter().all(|omega| omega.abs() < 1e-12), "{method}");
        assert!(outcome.frictions.iter().all(|record| record.t < 1.0), "{method}: {:?}", outcome.frictions);
    }
}

#[cfg(feature = "digits")]
#[test]
fn supports_at_their_limits_hand_the_load_to_the_wall_in_many_digits() {
    use super::many_digits::{last, source};
    use driftless::arithmetic::Real;
    for digits in [20, 27] {
        let row = last(&source(CRANK, &[], "4", "4"), digits);
        let phi = row.bodies[0][0].value();
        assert!((phi - crank_at_wall()).abs() < 1e-12, "{digits}: {phi}");
    }
}

/// A motor presses a rough tip ever harder on its wall: no spring and no missing inertia.
#[test]
fn surfaces_that_jam_are_told_from_other_steps_that_shrink() {
    let text = r#"{"name": "jam", "gravity": [0.39, -9.81],
        "bars": [{"name": "a", "mass": 1, "centre": [0.15, 0], "inertia": 0.02, "length": 0.3},
            {"name": "b", "mass": 0.7, "centre": [0.2, 0], "inertia": 0.02, "length": 0.4}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
            {"name": "B", "between": [{"body": "a", "point": [0.3, 0]}, {"body": "b", "point": [0, 0]}],
             "friction": {"radius": 0.02, "kinetic": 0.425, "static": 0.5525}}],
        "walls": [{"name": "W", "body": "b", "point": [0.4, 0], "restitution": 0,
            "line": {"through": [-0.19, -0.614], "normal": [-0.819, -0.574]},
            "friction": {"kinetic": 0.245, "static": 0.392}}],
        "motors": [{"name": "M", "body": "a", "law": {"start": -1.73, "rate": -4.71}}],
        "start": {"b": {"phi": -2.07, "omega": -0.37}}, "until": 2, "every": 0.5}"#;
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Radau(5)] {
        let outcome = run(&scene(text), &adaptive(method, 1e-9));
        let stop = outcome.stop.expect("a stop");
        assert!(stop.cause == Cause::Friction && stop.what.contains("jam"), "{method}: {stop:?}");
    }
}

/// A slider-crank with a rough crank pin, driven towards its singular position, jams 5 ms before it.
#[test]
fn surfaces_that_jam_beside_a_singular_position_are_not_gone_through() {
    let text = r#"{"name": "jam", "gravity": [0, 0],
        "bars": [{"name": "crank", "mass": 1.669, "centre": [0.3116, 0], "inertia": 0.02322, "length": 0.5},
            {"name": "rod", "mass": 0.392, "centre": [0.2267, 0], "inertia": 0.0142, "length": 0.5},
            {"name": "block", "mass": 0.5, "centre": [0, 0], "inertia": 0.01, "length": 0.1}],
        "hinges": [{"name": "O", "between": [{"body": "ground", "point": [0, 0]}, {"body": "crank", "point": [0, 0]}]},
            {"name": "A", "between": [{"body": "crank", "point": [0.5, 0]}, {"body": "rod", "point": [0, 0]}],
             "friction": {"radius": 0.05, "kinetic": 0.2}},
            {"name": "B", "between": [{"body": "rod", "point": [0.5, 0]}, {"body": "block", "point": [0, 0]}]}],
        "sliders": [{"name": "S", "point": {"body": "block", "point": [0, 0]}, "angle": "locked",
            "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}}],
        "motors": [{"name": "M", "body": "crank", "law": {"start": 0.3, "rate": 4.0}}],
        "start": {"crank": {"phi": 0.3}, "rod": {"phi": -0.3}, "block": {"phi": 0}}, "until": 0.7, "every": 0.7}"#;
    // About the block the moment of the upright force F at the pin is F (l cos(phi) - mu r), which is given: F grows
    // beyond all bounds where the bracket is zero.
    let t = (libm::acos(0.2 * 0.05 / 0.5) - 0.3) / 4.0;
    for (method, tolerance) in [
        (MethodId::Taylor, 1e-9),
        (MethodId::Taylor, 1e-12),
        (MethodId::Dp8, 1e-9),
        (MethodId::Radau(5), 1e-9),
    ] {
        let outcome = run(&scene(text), &adaptive(method, tolerance));
        let stop = outcome.stop.unwrap_or_else(|| panic!("{method} {tolerance:e}: no stop"));
        assert!(stop.cause == Cause::Friction && stop.what.contains("jam"), "{method}: {stop:?}");
        assert!((stop.t - t).abs() < 1e-5, "{method} {tolerance:e}: {} for {t}", stop.t);
    }
}

#[cfg(feature = "digits")]
#[test]
fn a_bar_breaks_away_in_many_digits_at_the_same_time_whatever_their_number() {
    use super::many_digits::{begun, source};
    use driftless::arithmetic::Real;
    for (bar, from, until) in [(PRESSED, 0.0, "1.3"), (FALLS, 2.2, "2.9")] {
        let t = bar.breaks_away(from);
        for digits in [20, 30, 40] {
            let mut run = begun(&source(&bar.text(2.9), &[], until, until), digits);
            let _ = run.row(run.last_row(), &mut || false).expect("a row").expect("no pause");
            let turns = run.turns();
            let slides = turns.iter().rfind(|turn| turn.does == "slides").expect("a break-away");
            assert!((slides.t.value() - t).abs() < 1e-12, "{digits}: {} for {t}", slides.t.value());
        }
    }
}
