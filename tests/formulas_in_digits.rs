//! Formulas of time and state in many digits, against closed forms in integer arithmetic of another crate.

use crate::many_digits::{
    begun, cosine, fixed, last, mean, near, number, one, pi, root, source, text, times,
};
use num_bigint::BigInt;

/// A rotor of moment of inertia 0.7 kg m² and what acts on it.
fn rotor(parts: &str, phi: &str, omega: &str) -> String {
    format!(
        r#"{{"name": "rotor", "gravity": [0, 0],
 "bars": [{{"name": "rotor", "mass": 0.3, "centre": [0, 0], "inertia": 0.7, "length": 1}}],
 "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "rotor", "point": [0, 0]}}]}}],
 {parts},
 "start": {{"rotor": {{"phi": {phi}, "omega": {omega}}}}}, "until": 3, "every": 3}}"#
    )
}

fn exponential(x: &BigInt) -> BigInt {
    let (mut term, mut sum) = (one(), one());
    for k in 1..400_u32 {
        term = times(&term, x) / k;
        sum += &term;
    }
    sum
}

fn inverse(x: &BigInt) -> BigInt {
    one() * one() / x
}

/// 0.1 + 0.5 cos(2 t), as a potential, as a torque, by parameters, and by the integral of the rate: 0.1, 1.4, 2.8
/// and 0.7 are no doubles.
#[test]
fn a_linear_oscillator_by_formulas_follows_its_cosine_to_eighty_digits() {
    let coil = |law: &str| format!(r#""torsion_springs": [{{"name": "coil", "body": "rotor", {law}}}]"#);
    let cases = [
        coil(r#""potential": "1.4*(angle - 0.1)^2""#),
        coil(r#""torque": "2.8*angle - 280 mN*m""#),
        format!(
            r#""parameters": {{"k": "14/5", "rest": "18*pi/(180*pi)"}}, {}"#,
            coil(r#""potential": "k*(angle - rest)^2/2""#)
        ),
        r#""integrals": {"moved": "rotor.omega"},
           "torques": [{"name": "coil", "body": "rotor", "torque": "-2.8*(moved + 0.5)"}]"#
            .to_owned(),
    ];
    let expected = fixed("0.1") + cosine(&fixed("6")) / 2;
    for parts in &cases {
        let row = last(&source(&rotor(parts, "0.6", "0"), &[], "3", "1"), 84);
        near(&number(row.bodies[0][0]), &expected, 80);
        assert!(row.drift.abs() < 1e-78, "{:e}", row.drift);
    }
}

/// x'' = -x³: x = A cn(A t, 1/√2), whose period is 2π √2/(A agm(√2, 1)).
#[test]
fn a_cubic_spring_returns_after_its_lemniscatic_period() {
    let coil = r#""torsion_springs": [{"name": "coil", "body": "rotor", "potential": "0.175*angle^4"}]"#;
    let diagonal = root(&(one() * 2));
    let period = times(
        &times(&(pi() * 2), &diagonal),
        &inverse(&times(&fixed("0.9"), &mean(diagonal.clone(), one()))),
    );
    let period = text(&period);
    let row = last(&source(&rotor(coil, "0.9", "0"), &[], &period, &period), 70);
    near(&number(row.bodies[0][0]), &fixed("0.9"), 66);
    near(&number(row.bodies[0][1]), &BigInt::ZERO, 64);
}

/// 0.7 w' = 0.2 - 0.05 w²: w = 2 tanh(t/7), phi = 14 ln cosh(t/7).
#[test]
fn a_rotor_with_drag_of_the_square_of_its_rate_follows_its_tangent() {
    let torque = r#""parameters": {"c": 0.05},
        "torques": [{"name": "drag", "body": "rotor", "torque": "0.2 - c*rotor.omega^2"}]"#;
    let row = last(&source(&rotor(torque, "0", "0"), &[], "5", "1"), 64);
    let (up, down) = (exponential(&(fixed("5") / 7)), exponential(&(fixed("-5") / 7)));
    let (sinh, cosh) = ((&up - &down) / 2, (&up + &down) / 2);
    near(&number(row.bodies[0][1]), &times(&(sinh * 2), &inverse(&cosh)), 60);
    near(&exponential(&(number(row.bodies[0][0]) / 14)), &cosh, 60);
    assert!(row.drift.abs() < 1e-59, "{:e}", row.drift);
}

/// The energy of a potential that is flat to 87 digits where the rotor starts: 0.35 (w² - 1) = -0.1 afterwards.
#[test]
fn what_is_flat_where_a_step_begins_is_seen_inside_it() {
    let hill = r#""potentials": [{"name": "hill", "energy": "0.05*tanh(100*(rotor.phi - 1))"}]"#;
    let row = last(&source(&rotor(hill, "0", "1"), &[], "3", "3"), 34);
    near(&number(row.bodies[0][1]), &root(&(one() - fixed("0.2") / 7 * 10)), 30);
}

/// A blow of 10 ms in a flight of 5 s: 0.7 (w - 1) = ∫ exp(-((t - 2.3)/0.01)²) dt.
#[test]
fn a_narrow_pulse_is_not_stepped_over() {
    let blow = r#""torques": [{"name": "blow", "body": "rotor", "torque": "1*exp(-((t - 2.3)/0.01)^2)"}]"#;
    let row = last(&source(&rotor(blow, "0", "1"), &[], "5", "5"), 34);
    near(&number(row.bodies[0][1]), &(one() + root(&pi()) / 70), 30);
}

/// Every function, in a law of time and in one of the state: 30 digits more make no difference, the balance of
/// energy, whose work is the motor's, is kept, and doubles agree.
#[test]
fn every_smooth_function_is_carried_in_laws_and_motors() {
    let scene = r#"{"name": "all", "gravity": [0, -9.81],
     "bars": [{"name": "a", "mass": 0.3, "centre": [0.3, 0], "inertia": 0.01, "length": 0.6},
              {"name": "b", "mass": 0.2, "centre": [0.2, 0], "inertia": 0.003, "length": 0.4}],
     "hinges": [
       {"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
       {"name": "B", "between": [{"body": "a", "point": [0.6, 0]}, {"body": "b", "point": [0, 0]}]}],
     "points": [{"name": "tip", "body": "b", "point": [0.4, 0]}],
     "signals": {"pull": "0.1*exp(-1*b.omega^2/30) + 0.2*log(2 + 1*tip.x^2)"},
     "springs": [{"name": "string", "between": [{"body": "ground", "point": [0.5, 0.3]}, {"body": "b", "point": [0.4, 0]}],
                  "tension": "3*pow(length, 1.3) + 0.1*rate"}],
     "forces": [{"name": "wind", "body": "b", "point": [0.4, 0], "frame": "body",
                 "force": ["pull*tanh(1*tip.vx)", "0.1*tan(0.3*b.sin) + 0.05*sin(3 rad/s*t)"]}],
     "torques": [{"name": "twist", "body": "b", "relative_to": "a", "torque": "0.03*atan2(tip.y - 2, tip.x)/sqrt(1 + 1*t^2)"},
                 {"name": "beat", "body": "b", "torque": 0.02, "law": "cos(7*t)^2"}],
     "motors": [{"name": "motor", "body": "a", "law": "30 deg + 0.3*tanh(2*t) + 0.1*exp(-1*t)*sin(3*t)"}],
     "start": {"b": {"phi": 0.4, "omega": 0}}, "until": 0.6, "every": 0.3}"#;
    let source = source(scene, &[], "0.6", "0.3");
    let (few, many) = (last(&source, 30), last(&source, 60));
    for (few, many) in few.bodies.iter().zip(&many.bodies) {
        few.iter().zip(many).for_each(|(&few, &many)| near(&number(few), &number(many), 27));
    }
    assert!(many.drift.abs() < 1e-54, "{:e}", many.drift);
    let request = driftless::run::Request {
        until: Some(0.6),
        every: Some(0.6),
        rtol: Some(1e-14),
        ..driftless::run::Request::default()
    };
    let plain = crate::common::run(&source.scene, &request);
    for k in 0..2 {
        near(&number(many.bodies[k][0]), &fixed(&format!("{:.15}", plain.last.phi[k])), 11);
    }
}

/// A root of a rate stops where the rate passes zero, after 2 (1 - ln 2) s of w' = -1 - √w from 1, and says so.
#[test]
fn a_root_of_a_rate_says_what_to_do_at_its_zero() {
    let flow = r#""torques": [{"name": "flow", "body": "rotor",
        "torque": "-0.7 - 0.7*sign(rotor.omega)*sqrt(abs(rotor.omega))"}]"#;
    let stop =
        begun(&source(&rotor(flow, "0", "1"), &[], "1", "1"), 20).row(1, &mut || false).expect_err("a stop");
    assert!(stop.hint.contains("in doubles"), "{stop:?}");
    assert!((stop.t - 2.0 * (1.0 - 2f64.ln())).abs() < 1e-12, "{stop:?}");
}
