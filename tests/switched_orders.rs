//! The order of fixed-step methods through switches: the step that a switch cuts short and the one that ends on the
//! grid again are steps of their own.

use super::formulas::{adaptive, run, scene};
use super::laws::clocked;
use driftless::run::{MethodId, Request};
use driftless::scene::Scene;

/// A pendulum whose tip feels a potential with a kink at a height: a force that jumps.
fn kinked() -> Scene {
    let text = r#"{"name": "orders", "gravity": [0, -9.81],
        "bars": [{"name": "bar", "mass": 1, "length": 1, "centre": [0.5, 0], "inertia": 0.1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
        "points": [{"name": "p", "body": "bar", "point": [1, 0]}],
        "potentials": [{"name": "field", "energy": "2*abs(p.y + 0.4)"}],
        "start": {"bar": {"phi": 0.3, "omega": 1}}, "until": 3, "every": 3}"#;
    scene(text)
}

/// Slope of log error by log steps of a method with so many steps in a second.
fn order(scene: &Scene, exact: [f64; 2], unit: f64, method: MethodId, steps: &[u32]) -> f64 {
    let points: Vec<[f64; 2]> = (steps.iter())
        .map(|&steps| {
            let step = Some(1.0 / f64::from(steps));
            let outcome = run(scene, &Request { method: Some(method), step, ..Request::default() });
            assert!(outcome.stop.is_none(), "{:?}", outcome.stop);
            let [phi, omega] = [outcome.last.phi[0] - exact[0], (outcome.last.omega[0] - exact[1]) / unit];
            [f64::from(steps).ln(), phi.hypot(omega).ln()]
        })
        .collect();
    assert!(points.iter().all(|point| point[1] > f64::ln(1e-13)), "{method}: rounding in {points:?}");
    let mean = |i: usize| points.iter().map(|point| point[i]).sum::<f64>() / points.len() as f64;
    let [x, y] = [mean(0), mean(1)];
    let both: f64 = points.iter().map(|point| (point[0] - x) * (point[1] - y)).sum();
    -both / points.iter().map(|point| (point[0] - x).powi(2)).sum::<f64>()
}

#[test]
fn fixed_steps_keep_their_order_through_switches() {
    let (text, [phi, rate]) = clocked(9.5);
    let (clocked, by_clock) = (scene(&text), [phi, 12.0 * rate]);
    let exact = run(&kinked(), &adaptive(MethodId::Taylor, 1e-16)).last;
    let by_place = [exact.phi[0], exact.omega[0]];
    for (name, nominal, steps) in [
        ("gauss4", 4.0, &[96, 128, 160, 192, 256][..]),
        ("gauss6", 6.0, &[48, 64, 80, 96, 128]),
        ("gauss8", 8.0, &[32, 40, 48, 64, 80]),
        ("gauss10", 10.0, &[16, 20, 24, 28, 32]),
        ("gauss12", 12.0, &[8, 9, 10, 12, 14]),
        ("gauss14", 14.0, &[5, 6, 7, 8, 9]),
        ("gauss16", 16.0, &[4, 5, 6]),
        ("rattle2", 2.0, &[64, 96, 128, 192, 256]),
        ("rattle4", 4.0, &[32, 48, 64, 96, 128]),
        ("rattle6", 6.0, &[32, 40, 52, 64, 80]),
        ("rattle8", 8.0, &[16, 20, 24, 32, 40]),
    ] {
        let method = name.parse::<MethodId>().expect("a method");
        let found = match method {
            MethodId::Gauss(_) => order(&clocked, by_clock, 12.0, method, steps),
            _ => order(&kinked(), by_place, 1.0, method, steps),
        };
        println!("{name}: {found:.2} of {nominal}");
        assert!((found - nominal).abs() < 0.35, "{name}: order {found}");
    }
}
