//! Windows of `dopri5` and `dop853` that run into a pole of a law's old branch, behind the switch the motion
//! meets first.

use super::formulas::{adaptive, rotor, run, scene};
use driftless::run::MethodId;

/// 1.5 omega' = -3/(omega + d) while it turns forward, whose pole is at -d; a torque of -1 from then on.
#[test]
fn a_window_that_runs_into_a_pole_behind_a_switch_is_cut_at_the_switch() {
    let (until, start) = (5.0, 2.0);
    for d in [0.05_f64, 5e-4] {
        let whole: f64 = start + d;
        let turn = (whole * whole - d * d) / 4.0;
        let top = (whole.powi(3) - d.powi(3)) / 6.0 - d * turn;
        let omega = -(until - turn) / 1.5;
        let phi = top + 0.5 * omega * (until - turn);
        let law = format!("if(bar.omega > 0, -3/(bar.omega + {d}), -1)");
        let text = rotor(
            [0.0, start],
            until,
            &format!(r#""torques": [{{"name": "T", "body": "bar", "torque": "{law}"}}]"#),
        );
        // Rows far apart, so that one window holds it all.
        let scene = scene(&text);
        for method in [MethodId::Dopri5, MethodId::Dop853] {
            for tolerance in [1e-6, 1e-9, 1e-12] {
                let outcome = run(&scene, &adaptive(method, tolerance));
                assert!(outcome.stop.is_none(), "{method} {tolerance:e}: {:?}", outcome.stop);
                let off = (outcome.last.phi[0] - phi).abs().max((outcome.last.omega[0] - omega).abs());
                let evaluations = outcome.statistics.evaluations;
                println!("{method} {tolerance:e}: off by {off:e}, {evaluations} evaluations");
                assert!(off < 100.0 * tolerance.max(1e-12), "{method} {tolerance:e}: {off:e}");
                assert!(evaluations < 60_000, "{method} {tolerance:e}: {evaluations} evaluations");
            }
        }
    }
}

/// Without a switch before it the pole is reached, at t = (2.05² - 0) / 4, and named.
#[test]
fn a_pole_that_is_really_reached_stops_the_run_there() {
    let text = rotor(
        [0.0, 2.0],
        5.0,
        r#""torques": [{"name": "T", "body": "bar", "torque": "-3/(bar.omega + 0.05)"}]"#,
    );
    let scene = scene(&text);
    for method in [MethodId::Dopri5, MethodId::Dop853] {
        let request = driftless::run::Request { max_evaluations: Some(200_000), ..adaptive(method, 1e-9) };
        let stop = run(&scene, &request).stop.expect("a pole");
        assert!((stop.t - 2.05 * 2.05 / 4.0).abs() < 1e-6, "{stop}");
    }
}
