//! Laws as formulas: against closed forms, and against integrations of equations of motion written here.

use super::formulas::{adaptive, rotor, run, scene};
use driftless::run::{MethodId, Outcome, Request};
use driftless::stepping::Cause;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Moment of inertia of [`rotor`] \[kg·m²\].
const INERTIA: f64 = 1.5;
/// How far a run by any of [`methods`] may be from the truth, and its energy balance from zero.
const CLOSE: f64 = 1e-10;
const DRIFT: f64 = 1e-9;

/// Every family of adaptive methods, at tolerances that leave errors and balance below [`CLOSE`] and [`DRIFT`].
fn methods() -> [Request; 7] {
    [
        adaptive(MethodId::Dopri5, 1e-14),
        adaptive(MethodId::Dp5, 1e-14),
        adaptive(MethodId::Dop853, 1e-14),
        adaptive(MethodId::Dp8, 1e-14),
        adaptive(MethodId::Radau(3), 1e-13),
        adaptive(MethodId::Radau(5), 1e-13),
        adaptive(MethodId::Taylor, 1e-15),
    ]
}

/// Runs by all methods and asserts that angle and rate of the first body end at these values.
fn ends_at(text: &str, angle: f64, rate: f64) {
    let scene = scene(text);
    for request in methods() {
        let outcome = run(&scene, &request);
        assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
        let errors = (outcome.last.phi[0] - angle, outcome.last.omega[0] - rate);
        assert!(errors.0.abs().max(errors.1.abs()) < CLOSE, "{:?}: {errors:?}", request.method);
        balanced(&outcome, &request);
    }
}

fn balanced(outcome: &Outcome, request: &Request) {
    let drift = outcome.drift.energy.max;
    assert!(drift < DRIFT, "{:?}: drift {drift:e}", request.method);
}

fn torque(law: &str) -> String {
    format!(r#""torques": [{{"name": "T", "body": "bar", "torque": "{law}"}}]"#)
}

fn potential(law: &str) -> String {
    format!(r#""potentials": [{{"name": "V", "energy": "{law}"}}]"#)
}

/// Jacobi's sn, cn and dn by the arithmetic-geometric mean, and the complete integral K (Abramowitz & Stegun 16.4).
fn jacobi(u: f64, m: f64) -> ([f64; 3], f64) {
    let mut rows = vec![(1.0, m.sqrt())];
    let mut b = (1.0 - m).sqrt();
    while rows.last().is_some_and(|row: &(f64, f64)| row.1 > 1e-17) && rows.len() < 12 {
        let a = rows[rows.len() - 1].0;
        rows.push((0.5 * (a + b), 0.5 * (a - b)));
        b = (a * b).sqrt();
    }
    let last = rows.len() - 1;
    let mut amplitude = f64::powi(2.0, i32::try_from(last).expect("few")) * rows[last].0 * u;
    for &(a, c) in rows[1..].iter().rev() {
        amplitude = 0.5 * (amplitude + (c / a * amplitude.sin()).asin());
    }
    let (sn, cn) = amplitude.sin_cos();
    ([sn, cn, (1.0 - m * sn * sn).sqrt()], FRAC_PI_2 / rows[last].0)
}

/// φ'' + α φ + β φ³ = 0 from rest at A: A cn(Ω t | β A²/2Ω²), Ω² = α + β A².
#[test]
fn the_duffing_oscillator_is_a_jacobi_cosine() {
    let (k, k3, start, until) = (2.0, 5.0, 0.9, 12.0);
    let rate = f64::sqrt((k + k3 * start * start) / INERTIA);
    let m = 0.5 * k3 * start * start / INERTIA / (rate * rate);
    let ([sn, cn, dn], quarter) = jacobi(rate * until, m);
    for law in [torque("-2*bar.phi - 5*bar.phi^3"), potential("1*bar.phi^2 + 5*bar.phi^4/4")] {
        ends_at(&rotor([start, 0.0], until, &law), start * cn, -start * rate * sn * dn);
    }
    let text = rotor(
        [start, 0.0],
        until,
        &format!(
            r#"{}, "events": [{{"name": "up", "when": "bar.phi", "direction": "rising"}}]"#,
            potential("1*bar.phi^2 + 5*bar.phi^4/4")
        ),
    );
    for request in methods() {
        let events = run(&scene(&text), &request).events;
        assert_eq!(events.len(), ((rate * until / quarter - 3.0) / 4.0).floor() as usize + 1);
        for (n, event) in events.iter().enumerate() {
            let expected = (4 * n + 3) as f64 * quarter / rate;
            assert!((event.t - expected).abs() < CLOSE, "{:?}: {} and {expected}", request.method, event.t);
        }
    }
}

/// With α < 0 and too little energy for the hill between the wells: A dn(Ω t | 2 + α/Ω²), Ω² = β A²/2.
#[test]
fn a_double_well_is_a_jacobi_delta() {
    let (k, k3, start, until) = (-2.0, 4.0, 0.9, 10.0);
    let square = 0.5 * k3 / INERTIA * start * start;
    let (rate, m) = (f64::sqrt(square), 2.0 + k / INERTIA / square);
    let ([sn, cn, dn], _) = jacobi(rate * until, m);
    ends_at(
        &rotor([start, 0.0], until, &potential("-1*bar.phi^2 + 1*bar.phi^4")),
        start * dn,
        -start * rate * m * sn * cn,
    );
}

/// J ω' = -c ω|ω|, then the same under a constant torque: a tangent up to the turn, a hyperbolic one from there.
#[test]
fn quadratic_drag_is_a_logarithm() {
    let (c, until, omega) = (0.8, 5.0, 7.0);
    let slower = 1.0 + c * omega * until / INERTIA;
    ends_at(
        &rotor([0.0, omega], until, &torque("-0.8*bar.omega*abs(bar.omega)")),
        INERTIA / c * slower.ln(),
        omega / slower,
    );
    let weight = 3.0_f64;
    let terminal = (weight / c).sqrt();
    let turn = INERTIA * terminal / weight * (omega / terminal).atan();
    let fall = weight * (until - turn) / (INERTIA * terminal);
    let top = 0.5 * INERTIA / c * (omega / terminal).powi(2).ln_1p();
    ends_at(
        &rotor([0.0, omega], until, &torque("-3 - 0.8*bar.omega*abs(bar.omega)")),
        top - INERTIA / c * fall.cosh().ln(),
        -terminal * fall.tanh(),
    );
}

/// A free bar falls onto a spring that only pushes: parabolas and sines in turn.
/// Where a law is no number its series has no powers: the method stops there, at a state of numbers.
#[test]
fn a_series_without_powers_ends_the_motion_at_its_last_state() {
    let law = "-1*sign(bar.phi)*sqrt(bar.phi)";
    let scene = scene(&rotor([0.01, 0.0], 1.0, &torque(law)));
    let outcome = run(&scene, &adaptive(MethodId::Taylor, 1e-9));
    let stop = outcome.stop.expect("a stop");
    // φ'' = -sqrt(φ)/I from φ0 at rest: t = ∫ dφ / sqrt(4/3 (φ0^1.5 - φ^1.5)/I) = sqrt(3 I/4) φ0^(1/4) B.
    let beta = (0..200_000).map(|i| (f64::from(i) + 0.5) / 200_000.0).map(|s: f64| {
        // u = 1 - s²: the integrand 2 s / sqrt(1 - u^1.5) has no corner there.
        2.0 * s / (1.0 - (1.0 - s * s).powf(1.5)).sqrt() / 200_000.0
    });
    let expected = (0.75 * INERTIA).sqrt() * 0.01_f64.powf(0.25) * beta.sum::<f64>();
    assert!((stop.t - expected).abs() < 1e-5, "{} {expected}", stop.t);
    assert!(outcome.last.phi[0].abs() < 1e-6 && outcome.last.omega[0].is_finite(), "{:?}", outcome.last);
}

#[test]
fn a_bar_bounces_on_a_spring_that_only_pushes() {
    let (mass, k, height, until) = (0.5_f64, 300.0_f64, 0.4_f64, 4.0_f64);
    let (weight, rate) = (mass * 9.81, (k / mass).sqrt());
    let (fall, speed) = ((2.0 * height / 9.81).sqrt(), (2.0 * 9.81 * height).sqrt());
    let rest = weight / k;
    let radius = rest.hypot(speed / rate);
    let ahead = (speed / rate).atan2(rest);
    let contact = (TAU - 2.0 * ahead) / rate;
    let phase = (until + fall) % (2.0 * fall + contact);
    let expected = if phase < 2.0 * fall {
        speed * phase - 0.5 * 9.81 * phase * phase
    } else {
        -rest + radius * (rate * (phase - 2.0 * fall) + ahead).cos()
    };
    for law in ["max(0, -k*heel.y)", "if(heel.y < 0, -k*heel.y, 0)", "k*(abs(heel.y) - heel.y)/2"] {
        let text = format!(
            r#"{{"name": "ball", "gravity": [0, -9.81], "parameters": {{"k": {k}}},
            "bars": [{{"name": "bar", "mass": {mass}, "centre": [0, 0], "inertia": 0.01, "length": 0.1}}],
            "points": [{{"name": "heel", "body": "bar", "point": [0, 0]}}],
            "forces": [{{"name": "pad", "body": "bar", "point": [0, 0], "force": [0, "{law}"]}}],
            "start": {{"bar": {{"phi": 0.3, "omega": 1, "origin": [0, {height}], "velocity": [0.2, 0]}}}},
            "until": {until}, "every": {until}}}"#
        );
        for request in methods() {
            let outcome = run(&scene(&text), &request);
            assert!(outcome.stop.is_none(), "{law} {:?}: {:?}", request.method, outcome.stop);
            let [x, y] = outcome.last.centre[0];
            assert!((x - 0.2 * until).abs() < 1e-10, "{:?}: {x}", request.method);
            assert!((y - expected).abs() < CLOSE, "{law} {:?}: {y} and {expected}", request.method);
            assert!((outcome.last.phi[0] - 0.3 - until).abs() < 1e-10, "{:?}", request.method);
            balanced(&outcome, &request);
        }
    }
}

/// J φ'' = -k φ - F sign(φ'): every half swing loses 2F/k, until the spring is weaker than the friction at a turn.
#[test]
fn a_swing_with_dry_friction_sticks_where_its_spring_is_too_weak() {
    let k = 6.0_f64;
    let half = PI / (k / INERTIA).sqrt();
    let text = rotor([1.0, 0.0], 30.0, &torque("-6*bar.phi - 0.9*sign(bar.omega)"));
    for request in methods() {
        let outcome = run(&scene(&text), &request);
        let stop = outcome.stop.as_ref().expect("sticking");
        assert_eq!(stop.cause.word(), "sliding", "{:?}: {stop:?}", request.method);
        // 1, -0.7, 0.4, -0.1.
        assert!((stop.t - 3.0 * half).abs() < 1e-9, "{:?}: {} and {}", request.method, stop.t, 3.0 * half);
        balanced(&outcome, &request);
    }
    let text = rotor([1.0, 0.0], 2.5 * half, &torque("-6*bar.phi - 0.9*sign(bar.omega)"));
    ends_at(&text, 0.15, -0.25 * (k / INERTIA).sqrt());
}

/// Relative motion of two bodies with G (m₁ + m₂) = 1.5 from their least distance of 1: Kepler's equation.
#[test]
fn two_free_bodies_move_by_keplers_equation() {
    let (speed, until) = (1.6_f64, 21.0);
    let sum = 1.5_f64;
    let eccentricity = speed * speed / sum - 1.0;
    let axis = 1.0 / (1.0 - eccentricity);
    let mean = until * (sum / axis.powi(3)).sqrt();
    let mut anomaly = mean;
    for _ in 0..60 {
        anomaly -= (anomaly - eccentricity * anomaly.sin() - mean) / (1.0 - eccentricity * anomaly.cos());
    }
    let expected = [
        axis * (anomaly.cos() - eccentricity),
        axis * (1.0 - eccentricity * eccentricity).sqrt() * anomaly.sin(),
    ];
    let text = format!(
        r#"{{"name": "kepler", "gravity": [0, 0], "parameters": {{"G": 1, "m1": 1, "m2": 0.5}},
        "bars": [{{"name": "sun", "mass": "m1", "centre": [0, 0], "inertia": 0.01, "length": 0.1}},
                 {{"name": "planet", "mass": "m2", "centre": [0, 0], "inertia": 0.01, "length": 0.1}}],
        "points": [{{"name": "a", "body": "sun", "point": [0, 0]}}, {{"name": "b", "body": "planet", "point": [0, 0]}}],
        "signals": {{"distance": "sqrt((b.x - a.x)^2 + (b.y - a.y)^2)"}},
        "potentials": [{{"name": "gravitation", "energy": "-G*m1*m2/distance"}}],
        "events": [{{"name": "near", "when": "(b.x - a.x)*(b.vx - a.vx) + (b.y - a.y)*(b.vy - a.vy)", "direction": "rising"}}],
        "start": {{"sun": {{"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]}},
                  "planet": {{"phi": 0, "omega": 0, "origin": [1, 0], "velocity": [0, {speed}]}}}},
        "until": {until}, "every": {until}}}"#
    );
    let period = TAU * (axis.powi(3) / sum).sqrt();
    for request in methods() {
        let outcome = run(&scene(&text), &request);
        assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
        let last = &outcome.last;
        let apart = [0, 1].map(|i| last.centre[1][i] - last.centre[0][i]);
        let rate = [0, 1].map(|i| last.velocity[1][i] - last.velocity[0][i]);
        let error = (apart[0] - expected[0]).abs().max((apart[1] - expected[1]).abs());
        assert!(error < 1e-9, "{:?}: {apart:?} and {expected:?}", request.method);
        let momentum = apart[0] * rate[1] - apart[1] * rate[0];
        assert!((momentum - speed).abs() < CLOSE, "{:?}: {momentum}", request.method);
        // The centre of mass moves uniformly.
        let middle = (last.centre[0][1] + 0.5 * last.centre[1][1]) / sum;
        assert!((middle - 0.5 * speed / sum * until).abs() < CLOSE, "{:?}: {middle}", request.method);
        balanced(&outcome, &request);
        let times = outcome.events.iter().map(|event| event.t).filter(|&t| t > 0.5 * period);
        let times: Vec<f64> = times.collect();
        assert_eq!(times.len(), (until / period).floor() as usize, "{:?}: {times:?}", request.method);
        for (n, t) in times.iter().enumerate() {
            assert!((t - (n + 1) as f64 * period).abs() < 1e-9, "{:?}: {t} and {period}", request.method);
        }
    }
}

/// The classical Runge–Kutta method.
pub fn rk4<const N: usize>(
    mut y: [f64; N],
    until: f64,
    count: u32,
    f: impl Fn(f64, &[f64; N]) -> [f64; N],
) -> [f64; N] {
    let h = until / f64::from(count);
    for i in 0..count {
        let t = f64::from(i) * h;
        let moved = |k: &[f64; N], by: f64| -> [f64; N] { std::array::from_fn(|j| y[j] + by * k[j]) };
        let a = f(t, &y);
        let b = f(t + 0.5 * h, &moved(&a, 0.5 * h));
        let c = f(t + 0.5 * h, &moved(&b, 0.5 * h));
        let d = f(t + h, &moved(&c, h));
        y = std::array::from_fn(|j| y[j] + h / 6.0 * (a[j] + 2.0 * (b[j] + c[j]) + d[j]));
    }
    y
}

/// The same to 1e-11, as twice the steps show.
fn reference<const N: usize>(
    start: [f64; N],
    until: f64,
    f: impl Fn(f64, &[f64; N]) -> [f64; N],
) -> [f64; N] {
    let [coarse, fine] = [30_000, 60_000].map(|count| rk4(start, until, count, &f));
    for (coarse, fine) in coarse.iter().zip(fine) {
        assert!((coarse - fine).abs() / 15.0 < 1e-11, "{coarse} and {fine}");
    }
    fine
}

/// Two bars by Lagrange's equations in their angles, with a controller at each hinge.
#[test]
fn a_controlled_double_pendulum_moves_by_lagranges_equations() {
    let (m, c, inertia, length, g) = ([0.7, 0.4], [0.25, 0.2], [0.02, 0.01], 0.5, 9.81);
    let until = 3.0;
    let by_hand = |t: f64, y: &[f64; 4]| {
        let [a, b, da, db] = *y;
        let aim = 0.5 * (2.0 * t).sin();
        let first = -12.0 * (a - aim) - 1.5 * da;
        let second = -6.0 * (b - a - 0.4) - 0.8 * (db - da);
        let coupling = m[1] * length * c[1];
        let (m11, m12) = (inertia[0] + m[0] * c[0] * c[0] + m[1] * length * length, coupling * (a - b).cos());
        let m22 = inertia[1] + m[1] * c[1] * c[1];
        let centrifugal = coupling * (a - b).sin();
        let q1 = first - second - centrifugal * db * db - g * (m[0] * c[0] + m[1] * length) * a.cos();
        let q2 = second + centrifugal * da * da - g * m[1] * c[1] * b.cos();
        let det = m11 * m22 - m12 * m12;
        [da, db, (m22 * q1 - m12 * q2) / det, (m11 * q2 - m12 * q1) / det]
    };
    let start = [-1.0, -0.4, 0.5, -2.0];
    let expected = reference(start, until, by_hand);
    let text = format!(
        r#"{{"name": "PD", "gravity": [0, -9.81], "signals": {{"aim": "0.5*sin(2*t)",
            "shoulder": "-12*(a.phi - aim) - 1.5*a.omega", "elbow": "-6*(b.phi - a.phi - 0.4) - 0.8*(b.omega - a.omega)"}},
        "bars": [{{"name": "a", "mass": 0.7, "centre": [0.25, 0], "inertia": 0.02, "length": 0.5}},
                 {{"name": "b", "mass": 0.4, "centre": [0.2, 0], "inertia": 0.01, "length": 0.4}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a", "point": [0, 0]}}]}},
                   {{"name": "B", "between": [{{"body": "a", "point": [0.5, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
        "torques": [{{"name": "S", "body": "a", "torque": "shoulder - elbow"}},
                    {{"name": "E", "body": "b", "torque": "elbow"}}],
        "start": {{"a": {{"phi": -1, "omega": 0.5}}, "b": {{"phi": -0.4, "omega": -2}}}},
        "until": {until}, "every": {until}}}"#
    );
    for request in methods() {
        let outcome = run(&scene(&text), &request);
        assert!(outcome.stop.is_none(), "{:?}: {:?}", request.method, outcome.stop);
        let last = &outcome.last;
        let found = [last.phi[0], last.phi[1], last.omega[0], last.omega[1]];
        for (a, b) in found.iter().zip(&expected) {
            assert!((a - b).abs() < CLOSE, "{:?}: {found:?} and {expected:?}", request.method);
        }
        balanced(&outcome, &request);
    }
}

/// J φ'' = μ (1 - (φ/φ₀)²) φ' - m g c sin φ, hanging.
#[test]
fn a_van_der_pol_torque_feeds_a_pendulum() {
    let until = 12.0;
    let expected = reference([0.2, 0.0], until, |_, y| {
        let damping = 0.6 * (1.0 - (y[0] / 0.4).powi(2)) * y[1];
        [y[1], (damping - 0.5 * 9.81 * 0.3 * y[0].sin()) / (0.2 + 0.5 * 0.3 * 0.3)]
    });
    let text = format!(
        r#"{{"name": "fed", "gravity": [9.81, 0],
        "bars": [{{"name": "bar", "mass": 0.5, "centre": [0.3, 0], "inertia": 0.2, "length": 0.6}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}}],
        {}, "start": {{"bar": {{"phi": 0.2, "omega": 0}}}}, "until": {until}, "every": {until}}}"#,
        torque("0.6*(1 - (bar.phi/0.4)^2)*bar.omega")
    );
    ends_at(&text, expected[0], expected[1]);
}

/// A driven oscillator once a period of its drive: its own motion dies away from the steady one.
#[test]
fn a_section_of_a_driven_oscillator_tends_to_its_steady_motion() {
    let (k, c, drive, w) = (4.0, 0.3, 2.0, 1.7);
    let (stiff, damped) = (k - INERTIA * w * w, c * w);
    let size = stiff * stiff + damped * damped;
    // Steady motion: (s cos ωt + d sin ωt) F / (s² + d²).
    let (cosine, sine) = (drive * stiff / size, drive * damped / size);
    let decay = 0.5 * c / INERTIA;
    let own = (k / INERTIA - decay * decay).sqrt();
    let (p, q) = (-cosine, (-w * sine - decay * cosine) / own);
    let at = |t: f64| cosine + (-decay * t).exp() * (p * (own * t).cos() + q * (own * t).sin());
    let text = rotor(
        [0.0, 0.0],
        40.0,
        &format!(
            r#""parameters": {{"w": {w}}}, {}, "events": [{{"name": "section", "when": "sin(w*t)", "direction": "rising"}}]"#,
            torque("-4*bar.phi - 0.3*bar.omega + 2*cos(w*t)")
        ),
    );
    for request in methods() {
        let outcome = run(&scene(&text), &request);
        let events: Vec<_> = outcome.events.iter().filter(|event| event.t > 1.0).collect();
        assert_eq!(events.len(), (40.0 * w / TAU).floor() as usize, "{:?}", request.method);
        for (n, event) in events.iter().enumerate() {
            let t = (n + 1) as f64 * TAU / w;
            assert!((event.t - t).abs() < 1e-9, "{:?}: {} and {t}", request.method, event.t);
            assert!((event.phi[0] - at(t)).abs() < CLOSE, "{:?}: at {t}", request.method);
        }
        balanced(&outcome, &request);
    }
}

/// J φ'' = -k φ - F sign φ: arcs of cosines about -F/k and F/k.
fn kinked(start: f64, k: f64, kink: f64, t: f64) -> f64 {
    let (rate, shift) = ((k / INERTIA).sqrt(), kink / k);
    let quarter = (shift / (start + shift)).acos() / rate;
    let phase = (t / quarter) % 4.0;
    let (side, from_top) = if phase < 1.0 {
        (1.0, phase)
    } else if phase < 3.0 {
        (-1.0, (phase - 2.0).abs())
    } else {
        (1.0, 4.0 - phase)
    };
    side * ((start + shift) * (rate * quarter * from_top).cos() - shift)
}

/// Slope of the least-squares line through the logarithms.
fn slope(points: &[[f64; 2]]) -> f64 {
    let n = points.len() as f64;
    let mean = [0, 1].map(|i| points.iter().map(|p| p[i].ln()).sum::<f64>() / n);
    let both: f64 = points.iter().map(|p| (p[0].ln() - mean[0]) * (p[1].ln() - mean[1])).sum();
    both / points.iter().map(|p| (p[0].ln() - mean[0]).powi(2)).sum::<f64>()
}

/// An oscillator of 12 rad/s whose equilibrium jumps whenever a slow one passes zero, with its motion at the end.
pub fn clocked(until: f64) -> (String, [f64; 2]) {
    let text = format!(
        r#"{{"name": "clocked", "gravity": [0, 0],
        "bars": [{{"name": "bar", "mass": 1, "centre": [0, 0], "inertia": 1.5}},
                 {{"name": "clock", "mass": 1, "centre": [0, 0], "inertia": 1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "bar", "point": [0, 0]}}]}},
                   {{"name": "B", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "clock", "point": [0, 0]}}]}}],
        "torques": [{{"name": "T", "body": "bar", "torque": "-216*bar.phi - 60*sign(clock.phi)"}},
                    {{"name": "C", "body": "clock", "torque": "-1*clock.phi"}}],
        "start": {{"bar": {{"phi": 0.3, "omega": 0}}, "clock": {{"phi": 1, "omega": 0}}}},
        "until": {until}, "every": {until}}}"#
    );
    let (mut phi, mut rate, mut t, mut side) = (0.3, 0.0, 0.0, 1.0);
    for end in [0.5 * PI, 1.5 * PI, 2.5 * PI, until] {
        let (sine, cosine) = f64::sin_cos(12.0 * (end - t));
        let middle = -side * 60.0 / 216.0;
        (phi, rate) = (middle + (phi - middle) * cosine + rate * sine, rate * cosine - (phi - middle) * sine);
        (t, side) = (end, -side);
    }
    (text, [phi, rate])
}

/// Switches cost no order: error over steps has the method's own slope, error over tolerance slope 1.
#[test]
fn switches_cost_no_order() {
    let (clocked, expected) = clocked(9.7);
    let clocked = scene(&clocked);
    let kinked_scene = scene(&rotor([0.7, 0.0], 9.7, &torque("-2*bar.phi - 0.9*sign(bar.phi)")));
    let kinked_end = kinked(0.7, 2.0, 0.9, 9.7);
    for (method, order, powers) in [
        (MethodId::Dopri5, Some(5.0), 8..=12),
        (MethodId::Dp5, Some(5.0), 8..=12),
        (MethodId::Dop853, Some(8.0), 8..=12),
        (MethodId::Dp8, Some(8.0), 8..=12),
        (MethodId::Radau(3), Some(5.0), 5..=12),
        (MethodId::Radau(5), Some(9.0), 5..=12),
        // Its order goes with the tolerance; below 1e-9 the error is round-off.
        (MethodId::Taylor, None, 4..=9),
    ] {
        let (mut by_steps, mut by_tolerance, mut by_state) = (Vec::new(), Vec::new(), Vec::new());
        for power in powers {
            let tolerance = 10f64.powi(-power);
            let outcome = run(&clocked, &adaptive(method, tolerance));
            let errors = [outcome.last.phi[0] - expected[0], outcome.last.omega[0] / 12.0 - expected[1]];
            let error = errors[0].hypot(errors[1]);
            // Below, what is left is round-off.
            if error > 3e-13 {
                by_steps.push([outcome.statistics.steps as f64, error]);
            }
            by_tolerance.push([tolerance, error]);
            let last = run(&kinked_scene, &adaptive(method, tolerance)).last.phi[0];
            by_state.push([tolerance, (last - kinked_end).abs()]);
        }
        let found = [-slope(&by_steps), slope(&by_tolerance), slope(&by_state)];
        println!("{by_steps:?}");
        println!("{method:?}: order {:.2}, by tolerance {:.2} and {:.2}", found[0], found[1], found[2]);
        if let Some(order) = order {
            assert!((found[0] - order).abs() < 0.35, "{method:?}: order {}", found[0]);
        }
        if method == MethodId::Taylor {
            assert!(found[1] > 0.65, "by tolerance {}", found[1]);
            assert!(by_state.iter().all(|point| point[1] < 1e-10), "{by_state:?}");
        } else {
            for slope in &found[1..] {
                assert!((slope - 1.0).abs() < 0.35, "{method:?}: by tolerance {slope}");
            }
        }
    }
    // Without landing, by steps that know of no switch.
    let errors: Vec<[f64; 2]> = [300, 451, 677, 1013, 1523, 2281, 3433, 5147]
        .map(|count| {
            let last =
                rk4([0.7, 0.0], 9.7, count, |_, y| [y[1], (-2.0 * y[0] - 0.9 * y[0].signum()) / INERTIA]);
            [f64::from(count), (last[0] - kinked_end).abs()]
        })
        .to_vec();
    println!("not landed: order {:.2}", -slope(&errors));
    assert!(-slope(&errors) < 2.5, "{errors:?}");
}

/// The root of a square with a little added nearly has a corner where it turns: the powers of a step that
/// begins well before it do not tell of it.
#[test]
fn drag_by_nearly_a_speed_slows_down_on_both_ways() {
    let text = r#"{"name": "drag", "gravity": [0, -9.81],
        "bars": [{"name": "bar", "mass": 2, "centre": [0.4, 0], "inertia": 0.3, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
        "points": [{"name": "p", "body": "bar", "point": [0.9, 0]}],
        "signals": {"speed": "sqrt((1*p.vx)^2 + (1*p.vy)^2 + 1e-12)"},
        "forces": [{"name": "drag", "body": "bar", "point": [0.9, 0], "force": ["-0.4*speed*p.vx", "-0.4*speed*p.vy"]}],
        "start": {"bar": {"phi": 0.3, "omega": 0.7}}, "until": 3, "every": 1}"#;
    let by_hand = |_: f64, y: &[f64; 2]| {
        let speed = (0.81 * y[1] * y[1] + 1e-12).sqrt();
        [y[1], (-2.0 * 9.81 * 0.4 * y[0].cos() - 0.4 * 0.81 * speed * y[1]) / (0.3 + 2.0 * 0.16)]
    };
    let [phi, omega] = rk4([0.3, 0.7], 3.0, 100_000, by_hand);
    for (tolerance, close) in [(1e-9, 1e-6), (1e-13, 1e-9)] {
        for method in [MethodId::Taylor, MethodId::Dp8] {
            let outcome = run(&scene(text), &adaptive(method, tolerance));
            let off = [outcome.last.phi[0] - phi, outcome.last.omega[0] - omega];
            println!("{method:?} {tolerance:e}: {off:?}");
            assert!(off[0].abs().max(off[1].abs()) < close, "{method:?} {tolerance:e}: {off:?}");
        }
    }
}

/// Where an angle jumps from π to -π the torque of a spring that follows it changes sign.
#[test]
fn a_torque_by_an_angle_jumps_where_it_is_cut() {
    let spring =
        r#""torques": [{"name": "spring", "body": "bar", "torque": "-2*atan2(sin(bar.phi), cos(bar.phi))"}]"#;
    let text = rotor([0.0, 5.0], 7.0, spring);
    // A quarter of an oscillation cut off at π, backwards from there on, and so on with every turn.
    let rate = (2.0 / INERTIA).sqrt();
    let half = (PI * rate / 5.0).asin() / rate;
    let (turns, left) = ((7.0 / (2.0 * half)).floor(), 7.0 % (2.0 * half));
    let inside = |t: f64| [5.0 / rate * (rate * t).sin(), 5.0 * (rate * t).cos()];
    let [phi, omega] = if left < half {
        inside(left)
    } else {
        let [phi, omega] = inside(2.0 * half - left);
        [TAU - phi, omega]
    };
    for method in [MethodId::Taylor, MethodId::Dp8] {
        let outcome = run(&scene(&text), &adaptive(method, 1e-12));
        let off = [outcome.last.phi[0] - phi - TAU * turns, outcome.last.omega[0] - omega];
        println!("{method:?}: {off:?} {:?}", outcome.statistics);
        assert!(off[0].abs().max(off[1].abs()) < 1e-10, "{method:?}: {off:?}");
    }
}

/// A torque that the jump of an angle drives back onto itself from either side holds the motion there.
#[test]
fn a_torque_that_an_angle_drives_back_onto_its_jump_is_said_to_slide() {
    let text = rotor([0.0, 1.0], 2.0, &torque("-1*atan2(bar.omega, -1)"));
    // I ω' = -(π - arctan ω): the time to ω = 0 is ∫ I dω / (π - arctan ω).
    let count = 100_000;
    let pieces = (0..count).map(|i| (f64::from(i) + 0.5) / f64::from(count));
    let time = pieces.map(|omega| INERTIA / (PI - omega.atan()) / f64::from(count)).sum::<f64>();
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Radau(5), MethodId::Dopri5] {
        let outcome = run(&scene(&text), &adaptive(method, 1e-11));
        let stop = outcome.stop.expect("a stop");
        println!("{method:?}: {stop:?}");
        assert_eq!(stop.cause, Cause::Sliding, "{method:?}: {stop:?}");
        assert!((stop.t - time).abs() < 1e-8, "{method:?}: {} {time}", stop.t);
        assert!(outcome.statistics.steps < 500, "{method:?}: {:?}", outcome.statistics);
    }
}

/// The direction of a point's velocity jumps from π to -π where it crosses the axis below zero; where its other
/// part passes zero nothing does, whatever the accelerations on the branches are.
#[test]
fn a_force_by_the_direction_of_a_velocity_jumps_at_half_a_turn_alone() {
    // Two equal rotors whose rates (a, b) turn about zero: a' = -b + 0.1 angle, b' = a.
    let text = r#"{"name": "two", "gravity": [0, 0],
        "bars": [{"name": "a", "mass": 1, "centre": [0, 0], "inertia": 1}, {"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
            {"name": "B", "between": [{"body": "ground", "point": [1, 0]}, {"body": "b", "point": [0, 0]}]}],
        "torques": [{"name": "T", "body": "a", "torque": "-1*b.omega + 0.1*atan2(b.omega, a.omega)"},
            {"name": "U", "body": "b", "torque": "1*a.omega"}],
        "start": {"a": {"phi": 0, "omega": 1}, "b": {"phi": 0, "omega": 0.1}}, "until": 9, "every": 9}"#;
    // In polar coordinates r and s of (a, b): r' = 0.1 s cos s, s' = 1 - 0.1 s sin(s)/r.
    let by_hand = |_: f64, y: &[f64; 2]| {
        let pull = 0.1 * y[1];
        [pull * y[1].cos(), 1.0 - pull * y[1].sin() / y[0]]
    };
    let (mut state, mut t, mut turns) = ([1.01_f64.sqrt(), 0.1_f64.atan2(1.0)], 0.0, 0);
    // Up to the jump at s = π, then on from -π, by steps that end there by Newton's iteration.
    while t < 9.0 {
        let mut h = 1e-4_f64.min(9.0 - t);
        let mut next = rk4(state, h, 1, by_hand);
        if next[1] > PI {
            for _ in 0..8 {
                h += (PI - next[1]) / by_hand(0.0, &next)[1];
                next = rk4(state, h, 1, by_hand);
            }
            (next[1], turns) = (next[1] - TAU, turns + 1);
        }
        (state, t) = (next, t + h);
    }
    assert_eq!(turns, 1);
    let expected = [state[0] * state[1].cos(), state[0] * state[1].sin()];
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Radau(5)] {
        let outcome = run(&scene(text), &adaptive(method, 1e-12));
        let off = [outcome.last.omega[0] - expected[0], outcome.last.omega[1] - expected[1]];
        println!("{method:?}: {off:?}, {:?} {:?}", outcome.stop, outcome.statistics);
        assert!(outcome.stop.is_none() && off[0].abs().max(off[1].abs()) < 1e-10, "{method:?}: {off:?}");
    }
}
