//! Bounces that die out beside dry friction which turns with them, in a joint along which the point bounces or at its
//! wall within an impact: against closed forms, and runs that follow them to other heights.

use super::breaking_away::done;
use super::formulas::adaptive;
#[cfg(feature = "digits")]
use super::many_digits::{begun, fixed, near, number, one, over, root, source, times};
#[cfg(feature = "digits")]
use driftless::arithmetic::Real;
#[cfg(feature = "digits")]
use driftless::run::digits::{LongHold, ShownRow};
use driftless::run::{MethodId, Request};
#[cfg(feature = "digits")]
use num_bigint::BigInt;

/// Methods at tight tolerances.
fn requests() -> [Request; 4] {
    [(MethodId::Taylor, 1e-13), (MethodId::Dp5, 1e-11), (MethodId::Dp8, 1e-12), (MethodId::Radau(5), 1e-11)]
        .map(|(method, tolerance)| adaptive(method, tolerance))
}

/// A block of 1 kg that slides 0.5 m down a rough rail, of slope 4/3, and bounces on a wall at its end; with a bar that
/// hangs on it, and friction in its hinge, where that is said.
fn on_a_rail(mu: &str, [normal, e, wall]: [&str; 3], bar: &str) -> String {
    let (body, hinge, start) = match bar {
        "" => ("", "", ""),
        bar => (
            r#", {"name": "bar", "mass": 0.8, "centre": [0.3, 0], "inertia": 0.04, "length": 0.6}"#,
            r#"{"name": "h", "between": [{"body": "block", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}],
                "friction": {"radius": 0.05, "kinetic": 0.4}}"#,
            bar,
        ),
    };
    format!(
        r#"{{"name": "rail", "gravity": [0, -10],
        "bars": [{{"name": "block", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 0.2}}{body}], "hinges": [{hinge}],
        "sliders": [{{"name": "s", "point": {{"body": "block", "point": [0, 0]}}, "angle": "locked",
            "rail": {{"body": "ground", "point": [0, 0], "direction": [3, 4]}}, "friction": {{"kinetic": {mu}}}}}],
        "walls": [{{"name": "w", "body": "block", "point": [0, 0], "restitution": {e}, {wall}
            "line": {{"through": [0, 0], "normal": {normal}}}}}],
        "start": {{"block": {{"phi": 0, "omega": 0, "origin": [0.3, 0.4], "velocity": [0, 0]}}{start}}},
        "until": 1.5, "every": 1.5}}"#
    )
}

/// Blocks alone: their friction, normal, restitution, wall, and the ratio of rebound and approach along the rail, by
/// numerator and denominator.  A wall that the block slides along as well, n = 0.8 and t = 0.6 of its way, with Poisson's
/// law has e (n - mu t)/(n + mu t).
const BLOCKS: [(&str, [&str; 3], [&str; 2]); 6] = [
    ("0.5", ["[3, 4]", "0.5", ""], ["0.5", "1"]),
    ("0.9", ["[3, 4]", "0.85", ""], ["0.85", "1"]),
    ("0.3", ["[0, 1]", "0.5", ""], ["0.5", "1"]),
    ("0.3", ["[0, 1]", "0.5", r#""friction": {"kinetic": 0.3},"#], ["0.31", "0.98"]),
    ("0", ["[0, 1]", "0.8", r#""friction": {"kinetic": 0.5},"#], ["0.4", "1.1"]),
    ("0.3", ["[0, 1]", "0.5", r#""friction": {"kinetic": 0.3, "impact": "newton"},"#], ["0.5", "1"]),
];

/// Down the rail it goes with b = 8 - 6 mu, up with a = 8 + 6 mu: bounces have the ratio q = k sqrt(b/a) and last
/// k v (1/a + 1/sqrt(a b)) / (1 - q), v = sqrt(b).
#[test]
fn a_block_bounces_to_rest_along_a_rough_rail() {
    for (mu, wall, ratio) in BLOCKS {
        let [mu_, up, down] = [mu, ratio[0], ratio[1]].map(|text| text.parse::<f64>().expect("a number"));
        let (a, b, k) = (8.0 + 6.0 * mu_, 8.0 - 6.0 * mu_, up / down);
        let (q, v) = (k * (b / a).sqrt(), b.sqrt());
        let rests = 1.0 / v + k * v * (1.0 / a + 1.0 / (a * b).sqrt()) / (1.0 - q);
        // On the first way, and on both ways of every bounce.
        let lost = 6.0 * mu_ * (0.5 + k * k * b / a / (1.0 - q * q));
        for request in requests() {
            let outcome = done(&on_a_rail(mu, wall, ""), &request);
            let [hold] = &outcome.holds[..] else { panic!("{:?}", outcome.holds) };
            assert!((hold.t - rests).abs() < 1e-11, "{mu} {wall:?} {request:?}: {} for {rests}", hold.t);
            assert!((outcome.last.friction - lost).abs() < 1e-11, "{}: {lost}", outcome.last.friction);
            assert!(outcome.last.phi[1..].iter().all(|x| x.abs() < 1e-12), "{:?}", outcome.last.phi);
        }
        #[cfg(feature = "digits")]
        rests_in_digits(mu, wall, ratio);
    }
}

/// The same in many digits.
#[cfg(feature = "digits")]
fn rests_in_digits(mu: &str, wall: [&str; 3], ratio: [&str; 2]) {
    let [mu_, up, down] = [mu, ratio[0], ratio[1]].map(fixed);
    let (a, b, k) = (fixed("8") + &mu_ * 6, fixed("8") - &mu_ * 6, over(&up, &down));
    let (q, v) = (times(&k, &root(&over(&b, &a))), root(&b));
    let way = over(&one(), &a) + over(&one(), &root(&times(&a, &b)));
    let rests = over(&one(), &v) + over(&times(&times(&k, &v), &way), &(one() - &q));
    let height = over(&over(&times(&times(&k, &k), &b), &a), &(one() - times(&q, &q)));
    let lost = times(&(&mu_ * 6), &(fixed("0.5") + height));
    for digits in [22, 40] {
        let (row, holds) = followed(&on_a_rail(mu, wall, ""), digits);
        assert_eq!(holds.len(), 1, "{mu} {wall:?}");
        near(&number(holds[0].t), &rests, digits as u32 - 2);
        near(&number(row.friction.expect("friction")), &lost, digits as u32 - 2);
        near(&number(row.bodies[0][3]), &BigInt::from(0), digits as u32 - 2);
    }
}

/// The last row of a run in many digits, and its holds.
#[cfg(feature = "digits")]
fn followed(text: &str, digits: usize) -> (ShownRow, Vec<LongHold>) {
    let mut run = begun(&source(text, &[], "1.5", "1.5"), digits);
    let row = run.row(run.last_row(), &mut || false).unwrap_or_else(|stop| panic!("{stop}\n{text}"));
    (row.expect("no pause"), run.holds())
}

/// With a bar on the block nothing of it is constant: bounces that are followed to 1e-11, 1e-24 and 1e-38 of the size
/// of the mechanism leave out parts of other sizes.
#[cfg(feature = "digits")]
#[test]
fn a_block_with_a_bar_on_it_comes_to_rest_wherever_its_bounces_are_left() {
    let walls = [
        ["[3, 4]", "0.5", ""],
        ["[0, 1]", "0.5", r#""friction": {"kinetic": 0.3},"#],
        ["[0, 1]", "0.7", r#""friction": {"kinetic": 0.3, "impact": "newton"},"#],
        ["[3, 4]", "0.6", r#""friction": {"kinetic": 0.2},"#],
    ];
    let bars = [r#", "bar": {"phi": 0.5, "omega": 2}"#, r#", "bar": {"phi": -2.1, "omega": -1.3}"#];
    for (wall, bar) in walls.into_iter().flat_map(|wall| bars.map(|bar| (wall, bar))) {
        let text = on_a_rail("0.3", wall, bar);
        let [(short, held), (long, expected)] = [22, 36].map(|digits| followed(&text, digits));
        assert_eq!([held.len(), expected.len()], [1, 1], "{wall:?}");
        near(&number(held[0].t), &number(expected[0].t), 19);
        let states = short.bodies.iter().flatten().zip(long.bodies.iter().flatten());
        states.for_each(|(&short, &long)| near(&number(short), &number(long), 19));
        for request in [(MethodId::Taylor, 1e-13), (MethodId::Dp8, 1e-13)] {
            let outcome = done(&text, &adaptive(request.0, request.1));
            assert!((outcome.holds[0].t - expected[0].t.value()).abs() < 2e-11, "{wall:?} {request:?}");
            let states = [&outcome.last.phi[..2], &outcome.last.omega[..2]].concat();
            for (k, found) in states.iter().enumerate() {
                let exact = long.bodies[k % 2][k / 2].value();
                assert!((found - exact).abs() < 1e-9, "{wall:?} {request:?}: {found} for {exact}");
            }
        }
    }
}
