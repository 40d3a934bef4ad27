//! A rod that falls on a rough floor: its lower end stands still, slides, and stands still again.
//!
//! ```text
//! end at rest:   omega² = omega0² - 3 g (sin phi - sin phi0),   alpha = -(3/2) g cos phi                (length 1 m)
//! F = (-alpha sin phi - omega² cos phi)/2,   N = g + (alpha cos phi - omega² sin phi)/2                (mass 1 kg)
//! ```
//!
//! Source: E. J. Routh, *Dynamics of a System of Rigid Bodies* (1905); W. Stronge, *Impact Mechanics* (2000),
//! for the end that stands still, slips and comes to rest.

use super::friction::{integrated, near, rod, runs, sliding_rod};
use driftless::run::Outcome;

const G: f64 = 9.81;

/// F and N of a rod whose end is at rest.
fn standing(phi: f64, omega_squared: f64) -> [f64; 2] {
    let ((sin, cos), alpha) = (phi.sin_cos(), -1.5 * G * phi.cos());
    [0.5 * (-alpha * sin - omega_squared * cos), G + 0.5 * (alpha * cos - omega_squared * sin)]
}

/// (x'', phi'') of a rod whose end slides, which way `s` says.
fn sliding(phi: f64, omega: f64, s: f64, mu: f64) -> [f64; 2] {
    let [x, alpha, n] = sliding_rod(phi, omega, s, mu);
    assert!(n > 0.0);
    [x, alpha]
}

/// Asserts what its end does, when that changes, and where it is then: x, phi and their rates.
fn assert_falls(outcome: &Outcome, modes: [&str; 2], changes: f64, end: [f64; 4]) {
    let found: Vec<_> = outcome.frictions.iter().map(|change| change.mode.as_str()).collect();
    assert_eq!(found, modes, "{:?}", outcome.frictions);
    near(outcome.frictions[1].t, changes, "it changes");
    near(outcome.last.phi[0], end[1], "phi");
    near(outcome.last.phi[1], end[0], "x");
    near(outcome.last.omega[0], end[3], "omega");
    near(outcome.last.omega[1], end[2], "slides");
}

/// The zero of a falling or rising function between two places.
fn zero(f: impl Fn(f64) -> f64, [mut low, mut high]: [f64; 2]) -> f64 {
    let sign = f(low).signum();
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if f(middle).signum() == sign { low = middle } else { high = middle }
    }
    high
}

#[test]
fn the_end_of_a_falling_rod_stands_still_until_friction_does_not_hold_it() {
    let (start, omega): (f64, f64) = (1.3, -0.4);
    let squared = |phi: f64| omega * omega - 3.0 * G * (phi.sin() - start.sin());
    // A little friction is overcome by the push backwards, much of it by the pull forwards later.
    for (mu, way) in [(0.3, -1.0), (0.9, 1.0)] {
        let held = |phi: f64| {
            let [f, n] = standing(phi, squared(phi));
            mu * n - f.abs()
        };
        let mut below = start;
        while held(below) > 0.0 {
            below -= 1e-3;
        }
        let slips = zero(held, [below + 1e-3, below]);
        let [f, n] = standing(slips, squared(slips));
        assert!((f.abs() - mu * n).abs() < 1e-12 && -f.signum() == way, "{f} {n}");
        // The time to there by Gauss's rule in parts, as the rate has no zero.
        let nodes = [(-(0.6_f64.sqrt()), 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.6_f64.sqrt(), 5.0 / 9.0)];
        let part = (start - slips) / 400.0;
        let time: f64 = (0..400)
            .flat_map(|i| nodes.map(|(x, w)| (start - part * (f64::from(i) + 0.5 + 0.5 * x), w)))
            .map(|(phi, w)| 0.5 * part * w / squared(phi).sqrt())
            .sum();
        let after = 0.02;
        let y =
            integrated([0.0, slips, 0.0, -squared(slips).sqrt()], after, |y| sliding(y[1], y[3], way, mu));
        for outcome in runs(&rod(start, omega, 0.0, mu, time + after)) {
            assert_falls(&outcome, ["sticks", "slides"], time, y);
        }
    }
}

#[test]
fn an_end_that_slides_to_a_stop_stands_still_and_the_rod_turns_about_it() {
    let (mu, start) = (0.6, [0.0, 1.9, 0.5, 0.2]);
    let rate = |y: [f64; 4]| sliding(y[1], y[3], 1.0, mu);
    let stops = zero(|time| integrated(start, time, rate)[2], [1e-3, 0.3]);
    let stood = integrated(start, stops, rate);
    let [f, n] = standing(stood[1], stood[3] * stood[3]);
    assert!(f.abs() < mu * n, "{f} {n}");
    let after = 0.1;
    let mut end = stood;
    end[2] = 0.0;
    let end = integrated(end, after, |y| [0.0, -1.5 * G * y[1].cos()]);
    let kept = stood[3] * stood[3] - 3.0 * G * (end[1].sin() - stood[1].sin());
    assert!((end[3] * end[3] - kept).abs() < 1e-11);
    for outcome in runs(&rod(start[1], start[3], start[2], mu, stops + after)) {
        assert_falls(&outcome, ["slides", "sticks"], stops, end);
    }
}
