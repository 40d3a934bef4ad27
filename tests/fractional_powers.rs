//! Laws whose fractional powers begin and end at zero, where they have no series: closed forms by Euler's
//! beta function.

use super::formulas::{adaptive, rotor, run, scene};
use driftless::run::MethodId;

/// Mass \[kg\], velocity towards the ground \[m/s\], height above it \[m\], and stiffness \[N/m^p\].
const MASS: f64 = 2.0;
const SPEED: f64 = 1.4;
const HEIGHT: f64 = 0.1;
const STIFFNESS: f64 = 1e4;
/// Gravity \[m/s²\], where there is some.
const GRAVITY: f64 = 9.81;

/// ∫ ds / sqrt(1 - s^(p+1)) from 0 to 1: B(1/(p+1), 1/2) / (p + 1).
fn share(p: f64) -> f64 {
    let n = 1.0 / (p + 1.0);
    n * libm::tgamma(n) * libm::tgamma(0.5) / libm::tgamma(n + 0.5)
}

/// How long a contact by Hertz lasts, with any power p of the depth: 2 z/v times [`share`], at the depth z where
/// k z^(p+1)/(p+1) = m v²/2.
fn contact(p: f64) -> f64 {
    let deepest = ((p + 1.0) * MASS * SPEED * SPEED / (2.0 * STIFFNESS)).powf(1.0 / (p + 1.0));
    2.0 * deepest / SPEED * share(p)
}

/// The same under gravity, met at this speed: dt = dz/v, v² = speed² + 2 g z - 2 k z^(p+1)/((p+1) m), by Simpson's
/// rule over z = deepest (1 - s²).
fn contact_under_gravity(p: f64, speed: f64) -> f64 {
    let square =
        |z: f64| speed * speed + 2.0 * GRAVITY * z - 2.0 * STIFFNESS * z.powf(p + 1.0) / ((p + 1.0) * MASS);
    let (mut deepest, mut above) = (0.0, 1.0);
    for _ in 0..100 {
        let middle = 0.5 * (deepest + above);
        *(if square(middle) > 0.0 { &mut deepest } else { &mut above }) = middle;
    }
    let slope = STIFFNESS * deepest.powf(p) / MASS - GRAVITY;
    let part = |s: f64| match s {
        0.0 => 2.0 * deepest / (2.0 * slope * deepest).sqrt(),
        s => 2.0 * deepest * s / square(deepest * (1.0 - s * s)).sqrt(),
    };
    let panels = 2000;
    let h = 1.0 / f64::from(panels);
    let weight = |i: i32| if i == 0 || i == panels { 1.0 } else { 2.0 + 2.0 * f64::from(i % 2) };
    2.0 * (0..=panels).map(|i| weight(i) * part(h * f64::from(i))).sum::<f64>() * h / 3.0
}

/// A ball that flies at the ground and is pushed back there by this force.
fn ball(force: &str, until: f64) -> String {
    format!(
        r#"{{"name": "ball", "gravity": [0, 0], "parameters": {{"k": {STIFFNESS}, "p": 1.5}},
        "bars": [{{"name": "ball", "mass": {MASS}, "centre": [0, 0], "inertia": 0.1, "length": 0.1}}],
        "points": [{{"name": "P", "body": "ball", "point": [0, 0]}}],
        "forces": [{{"name": "F", "body": "ball", "point": [0, 0], "force": [0, "{force}"]}}],
        "start": {{"ball": {{"phi": 0, "omega": 0, "origin": [0, {HEIGHT}], "velocity": [0, -{SPEED}]}}}},
        "until": {until}, "every": {until}}}"#
    )
}

/// Methods, their tolerances, and how far off they may be.
const METHODS: [(MethodId, f64, f64); 5] = [
    (MethodId::Taylor, 1e-12, 1e-11),
    (MethodId::Dp8, 1e-12, 1e-9),
    (MethodId::Dp5, 1e-11, 1e-8),
    (MethodId::Radau(5), 1e-12, 1e-10),
    (MethodId::Dop853, 1e-12, 1e-9),
];

#[test]
fn contacts_by_hertz_last_as_long_as_their_closed_form() {
    for p in [1.5, 1.2, 2.5] {
        let forces = [
            format!("k*max(0, -P.y)^{p}"),
            format!("k*pow(max(0, -P.y), {p})"),
            format!("if(P.y < 0, k*(-P.y)^{p}, 0)"),
            format!("if(P.y >= 0, 0, k*(0 - P.y)^{p})"),
        ];
        let until = 2.0 * HEIGHT / SPEED + contact(p);
        for force in forces {
            for (method, tolerance, close) in METHODS {
                let outcome = run(&scene(&ball(&force, until)), &adaptive(method, tolerance));
                assert!(outcome.stop.is_none(), "{method} {force}: {:?}", outcome.stop);
                let last = &outcome.last;
                let off = [last.phi[2] - HEIGHT, last.omega[2] - SPEED];
                let off = off[0].abs().max(off[1].abs());
                assert!(off < close, "{method} {force}: off by {off:e}");
            }
        }
    }
}

/// An exponent may be a parameter above zero, and a sum or product of such ones.
#[test]
fn exponents_may_be_parameters() {
    let until = 2.0 * HEIGHT / SPEED + contact(1.5);
    for force in ["1 N*(k*max(0, -P.y/(1 m))^p)", "1 N*if(P.y < 0, k*(-P.y/(1 m))^((p + 2*p)/3), 0)"] {
        for (method, tolerance, close) in METHODS {
            let outcome = run(&scene(&ball(force, until)), &adaptive(method, tolerance));
            assert!(outcome.stop.is_none(), "{method} {force}: {:?}", outcome.stop);
            let last = &outcome.last;
            let off = (last.phi[2] - HEIGHT).abs().max((last.omega[2] - SPEED).abs());
            assert!(off < close, "{method} {force}: off by {off:e}");
        }
    }
}

/// The magnitude of what is never below zero has no corner: nothing is driven back to it.
#[test]
fn magnitudes_of_what_is_above_zero_are_itself() {
    let last = |law: &str| {
        let torque = format!(r#""torques": [{{"name": "T", "body": "bar", "torque": "1 N*m*({law})"}}]"#);
        let outcome = run(&scene(&rotor([0.5, 1.0], 3.0, &torque)), &adaptive(MethodId::Taylor, 1e-9));
        assert!(outcome.stop.is_none(), "{law}: {:?}", outcome.stop);
        (outcome.last.phi.clone(), outcome.last.omega.clone())
    };
    let plain = last("-max(0, bar.omega*(1 s))^2.13 - bar.phi");
    assert_eq!(last("-abs(max(0, bar.omega*(1 s))^2.13) - bar.phi"), plain);
}

/// x'' = -sign(x) |x|^p swings with the period 4 A/v times [`share`], A = ((p + 1) v²/2)^(1/(p+1)).
#[test]
fn powers_of_magnitudes_swing_with_the_period_of_their_closed_form() {
    for p in [0.5, 1.5, 2.5] {
        let (speed, inertia) = (1.3, 1.5);
        let amplitude = f64::powf(0.5 * (p + 1.0) * inertia * speed * speed, 1.0 / (p + 1.0));
        let period = 4.0 * amplitude / speed * share(p);
        let law = format!("1 N*m*(-sign(bar.phi))*abs(bar.phi)^{p}");
        let law = if p == 0.5 { law.replace("abs(bar.phi)^0.5", "sqrt(abs(bar.phi))") } else { law };
        let text = rotor(
            [0.0, speed],
            period,
            &format!(r#""torques": [{{"name": "T", "body": "bar", "torque": "{law}"}}]"#),
        );
        for (method, tolerance, close) in METHODS {
            // The slope of a root is infinite at zero, and Newton's method has none there.
            if p < 1.0 && method == MethodId::Radau(5) {
                continue;
            }
            let outcome = run(&scene(&text), &adaptive(method, tolerance));
            assert!(outcome.stop.is_none(), "{method} {p}: {:?}", outcome.stop);
            let off = outcome.last.phi[0].abs().max((outcome.last.omega[0] - speed).abs());
            assert!(off < 10.0 * close, "{method} {p}: off by {off:e}");
        }
    }
}

/// Of a square there is a magnitude as well: it touches zero, and its power is that of the magnitude alone.
#[test]
fn powers_of_magnitudes_of_squares_pass_zero() {
    let last = |law: &str| {
        let torque = format!(
            r#""torques": [{{"name": "T", "body": "bar", "torque": "1 N*m*(-sign(bar.phi))*{law}"}}]"#
        );
        let outcome = run(&scene(&rotor([0.0, 1.3], 4.0, &torque)), &adaptive(MethodId::Taylor, 1e-12));
        assert!(outcome.stop.is_none(), "{law}: {:?}", outcome.stop);
        outcome.last.phi[0]
    };
    let [square, plain] = [last("abs(bar.phi^2)^0.75"), last("abs(bar.phi)^1.5")];
    assert!((square - plain).abs() < 1e-10, "{square} for {plain}");
}

/// Powers of what may be below zero are no numbers there: the run ends where the base passes zero.
#[test]
fn powers_of_negative_numbers_are_refused_as_before() {
    let outcome = run(&scene(&ball("-0.001*k*P.y^1.5", 0.3)), &adaptive(MethodId::Taylor, 1e-12));
    let stop = outcome.stop.expect("a stop");
    assert!(stop.t < HEIGHT / SPEED * 1.5, "{stop}");
}

#[cfg(feature = "digits")]
#[test]
fn a_contact_by_hertz_lasts_as_long_in_many_digits() {
    use super::many_digits::{begun, fixed, near, number, source};
    let until = 2.0 * HEIGHT / SPEED + contact(1.5);
    for force in ["k*max(0, -P.y)^1.5", "if(P.y < 0, k*(-P.y)^1.5, 0)"] {
        let source = source(&ball(force, until), &[], &until.to_string(), &until.to_string());
        let mut run = begun(&source, 24);
        let row = run.row(run.last_row(), &mut || false).expect("a row").expect("no pause");
        // The end is a double.
        near(&number(row.bodies[0][3]), &fixed("0.1"), 14);
        near(&number(row.bodies[0][5]), &fixed("1.4"), 14);
        assert!(row.drift.abs() < 1e-20, "{:e}", row.drift);
    }
}

/// Under gravity the base of the power is rounding where a contact begins, beside its rate.
#[cfg(feature = "digits")]
#[test]
fn a_contact_by_hertz_under_gravity_lasts_as_long_in_many_digits() {
    use super::many_digits::{fixed, last, near, number, source};
    let speed = (SPEED * SPEED + 2.0 * GRAVITY * HEIGHT).sqrt();
    let until = 2.0 * (speed - SPEED) / GRAVITY + contact_under_gravity(1.5, speed);
    for force in ["k*max(0, -P.y)^1.5", "1 N*(k*max(0, -P.y/(1 m))^p)"] {
        let gravity = format!("gravity[1]=-{GRAVITY}");
        let source = source(&ball(force, until), &[&gravity], &until.to_string(), &until.to_string());
        for digits in [24, 45] {
            let row = last(&source, digits);
            near(&number(row.bodies[0][3]), &fixed("0.1"), 10);
            near(&number(row.bodies[0][5]), &fixed("1.4"), 10);
            assert!(row.drift.abs() < 1e-20, "{:e}", row.drift);
        }
    }
}
