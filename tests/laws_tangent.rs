//! Branches of a law that touch to second order where they cross: the condition between them has a zero of order
//! three, about which its sign is rounding.

use super::formulas::{adaptive, rotor, run, scene};
use driftless::run::MethodId;

/// The smaller of two cubes, whose difference is a cube: as one `if`, whose condition has a simple zero.
#[test]
fn branches_that_touch_change_where_they_cross() {
    let acted = |torque: &str, omega: f64, until: f64| {
        scene(&rotor(
            [-0.8, omega],
            until,
            &format!(r#""torques": [{{"name": "T", "body": "bar", "torque": "{torque}"}}]"#),
        ))
    };
    let cubes = "min(tanh(1.7*bar.sin)^3, tanh(2.57*bar.sin)^3)";
    let chosen = "if(bar.sin < 0, tanh(2.57*bar.sin)^3, tanh(1.7*bar.sin)^3)";
    for (sign, omega) in [("-1*", 0.6), ("1*", 1.3), ("-2*", 0.9), ("-0.5*", 2.0)] {
        for until in [2.0, 7.0] {
            let [touching, simple] = [cubes, chosen].map(|law| acted(&format!("{sign}{law}"), omega, until));
            for method in [
                MethodId::Taylor,
                MethodId::Dp5,
                MethodId::Dp8,
                MethodId::Dop853,
                MethodId::Radau(3),
                MethodId::Radau(5),
            ] {
                let request = adaptive(method, 1e-11);
                let [found, expected] = [&touching, &simple].map(|scene| {
                    let outcome = run(scene, &request);
                    assert!(outcome.stop.is_none(), "{method} {sign} {until}: {:?}", outcome.stop);
                    [outcome.last.phi[0], outcome.last.omega[0]]
                });
                let off = (found[0] - expected[0]).abs().max((found[1] - expected[1]).abs());
                assert!(off < 1e-8, "{method} {sign} {until}: off by {off:e}");
            }
        }
    }
}
