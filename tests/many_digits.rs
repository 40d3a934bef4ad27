//! Runs in many digits against published digits, closed forms in integer arithmetic, and runs in doubles.

use crate::common;
use driftless::arithmetic::{Real, Scalar};
use driftless::dynamics::Mechanism;
use driftless::run::Request;
use driftless::run::digits::{
    DigitsPair, DigitsSource, LongRun, PairProgress, Precision, ShownRow, Wide, forecast, long_run,
};
use driftless::scene::{Override, Template};
use num_bigint::BigInt;
use std::sync::Arc;

/// Decimals that fixed-point numbers of the checks carry.
const PLACES: u32 = 90;

pub fn source(text: &str, set: &[&str], until: &str, every: &str) -> DigitsSource {
    let overrides: Vec<Override> = set.iter().map(|set| set.parse().expect("an override")).collect();
    let template = Template::new(text.to_owned(), "test".to_owned(), &overrides);
    let scene = template.scene().expect("a scene");
    let mechanism = Arc::new(Mechanism::new(&scene).expect("a mechanism"));
    DigitsSource {
        template,
        typed: set.iter().map(|&set| set.to_owned()).collect(),
        until: Some(until.to_owned()),
        every: Some(every.to_owned()),
        scene,
        mechanism,
    }
}

pub fn shipped(name: &str) -> String {
    let path = format!("{}/examples/scenes/{name}.json", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).expect("a shipped scene")
}

pub fn begun(source: &DigitsSource, digits: usize) -> Box<dyn LongRun> {
    let has_loops = source.mechanism.has_closed_loops();
    long_run(source, Precision::new(digits, has_loops)).expect("a run")
}

fn rows(source: &DigitsSource, digits: usize) -> Vec<ShownRow> {
    let mut run = begun(source, digits);
    (0..=run.last_row()).map(|k| run.row(k, &mut || false).expect("a row").expect("no pause")).collect()
}

/// A whole run; one that goes on from any of its rows comes to the same bits.
pub fn resumed(source: &DigitsSource) -> Box<dyn LongRun> {
    let mut whole = begun(source, 30);
    let mut saved = vec![whole.save()];
    let rows: Vec<ShownRow> = (0..=whole.last_row())
        .map(|number| {
            let row = whole.row(number, &mut || false).expect("a row").expect("there");
            saved.push(whole.save());
            row
        })
        .collect();
    for (from, saved) in saved.iter().enumerate() {
        let mut other = begun(source, 30);
        assert!(other.resume(saved));
        for (number, expected) in (0..).zip(&rows).skip(from) {
            let found = other.row(number, &mut || false).expect("a row").expect("there");
            assert_eq!(format!("{found:?}"), format!("{expected:?}"));
        }
        assert_eq!(format!("{:?}", other.save()), format!("{:?}", whole.save()));
    }
    whole
}

/// Two runs with the digits forecast for agreement to 1e-15, which agree so far at every row.
pub fn proved(source: &DigitsSource) -> DigitsPair {
    let forecast = forecast(source, 1e-15, false, &mut || false).expect("no error").expect("a forecast");
    let mut pair = DigitsPair::new(source, &[forecast.run, forecast.companion]).expect("two runs");
    let mut least = f64::INFINITY;
    while let PairProgress::Rows(rows) = pair.go(&|| false).expect("no stop") {
        for (_, agreement) in rows {
            least = least.min(agreement.expect("two runs"));
        }
    }
    assert!(least > 15.0, "{least} of {forecast:?}");
    pair
}

pub fn last(source: &DigitsSource, digits: usize) -> ShownRow {
    rows(source, digits).pop().expect("a row")
}

/// Of every body at the end of a run: angle and rate, place and velocity, as doubles.
pub fn bodies_at_end(text: &str, until: &str, digits: usize) -> Vec<[f64; 6]> {
    let row = last(&source(text, &[], until, until), digits);
    row.bodies.iter().map(|body| body.map(|value| value.value())).collect()
}

pub fn one() -> BigInt {
    BigInt::from(10).pow(PLACES)
}

/// A decimal text in fixed point.
pub fn fixed(text: &str) -> BigInt {
    let (mantissa, power) =
        text.split_once('e').map_or((text, 0), |(m, e)| (m, e.parse::<i32>().expect("a power")));
    let (whole, decimals) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits: BigInt = format!("{whole}{decimals}").parse().expect("digits");
    let shift = PLACES as i32 + power - decimals.len() as i32;
    let ten = BigInt::from(10);
    if shift >= 0 { digits * ten.pow(shift as u32) } else { digits / ten.pow(-shift as u32) }
}

pub fn number(wide: Wide) -> BigInt {
    fixed(&format!("{wide:?}"))
}

pub fn text(fixed: &BigInt) -> String {
    let digits = format!("{:0>1$}", fixed.magnitude(), PLACES as usize + 1);
    let (whole, decimals) = digits.split_at(digits.len() - PLACES as usize);
    format!("{}{whole}.{decimals}", if *fixed < BigInt::ZERO { "-" } else { "" })
}

pub fn times(a: &BigInt, b: &BigInt) -> BigInt {
    a * b / one()
}

pub fn over(a: &BigInt, b: &BigInt) -> BigInt {
    a * one() / b
}

pub fn root(x: &BigInt) -> BigInt {
    (x * one()).sqrt()
}

pub fn square(x: &BigInt) -> BigInt {
    times(x, x)
}

pub fn cosine(x: &BigInt) -> BigInt {
    let (mut term, mut sum) = (one(), one());
    for k in 1..400_u32 {
        term = -times(&times(&term, x), x) / (2 * k * (2 * k - 1));
        sum += &term;
    }
    sum
}

/// π by J. Machin.
pub fn pi() -> BigInt {
    let arctan = |k: u32| {
        let (mut power, mut sum) = (one() / k, BigInt::ZERO);
        for i in 0..160_u32 {
            let term = &power / (2 * i + 1);
            sum = if i % 2 == 0 { sum + term } else { sum - term };
            power /= k * k;
        }
        sum
    };
    arctan(5) * 16 - arctan(239) * 4
}

/// The arithmetic-geometric mean.
pub fn mean(mut a: BigInt, mut b: BigInt) -> BigInt {
    for _ in 0..12 {
        (a, b) = ((&a + &b) / 2, (&a * &b).sqrt());
    }
    a
}

#[track_caller]
pub fn near(found: &BigInt, expected: &BigInt, digits: u32) {
    let off = found - expected;
    let allowed = BigInt::from(10).pow(PLACES - digits);
    assert!(off.magnitude() < allowed.magnitude(), "{} instead of {}", text(found), text(expected));
}

/// Public values: an integration with another program at 36 digits, the scene's numbers as written.
#[test]
fn the_free_double_pendulum_has_its_published_digits_at_ten_seconds() {
    let source = source(&shipped("free"), &[], "10", "10");
    let row = last(&source, 45);
    near(&number(row.bodies[0][0]), &fixed("-0.413361718286129851525375037386713"), 32);
    near(&number(row.bodies[1][0]), &fixed("-8.901595676581359612122081616128794"), 32);
    assert!(row.drift.abs() < 1e-44, "{:e}", row.drift);
}

const ROTOR: &str = r#"{"name": "rotor", "gravity": [0, 0],
 "bars": [{"name": "rotor", "mass": 0.3, "centre": [0, 0], "inertia": 0.7, "length": 1}],
 "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "rotor", "point": [0, 0]}]}],
 "torsion_springs": [{"name": "coil", "body": "rotor", "stiffness": 2.8, "free_angle": 0.1}],
 "start": {"rotor": {"phi": 0.6, "omega": 0}}, "until": 3, "every": 3}"#;

/// 0.1 + 0.5 cos(2 t): none of these numbers but 0.5 is a double.
#[test]
fn an_oscillator_follows_its_cosine_to_eighty_digits() {
    let row = last(&source(ROTOR, &[], "3", "1"), 84);
    let expected = fixed("0.1") + cosine(&fixed("6")) / 2;
    near(&number(row.bodies[0][0]), &expected, 80);
    // One number typed otherwise: 2.8 = 14/5 exactly, and 7/10.
    let typed = ["rotor.phi=3/5", "coil.stiffness=14/5", "bars.rotor.inertia=7/10"];
    let again = last(&source(ROTOR, &typed, "3", "1"), 84);
    near(&number(again.bodies[0][0]), &expected, 80);
}

/// T = 2π sqrt(l/g) / agm(1, cos(phi0/2)) for a pendulum of length l: after it everything is as at the start.
#[test]
fn a_pendulum_returns_after_its_elliptic_period() {
    let pendulum = r#"{"name": "pendulum", "gravity": [9.81, 0],
     "bars": [{"name": "bar", "mass": 0.37, "centre": [0.7, 0], "inertia": 0, "length": 1}],
     "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bar", "point": [0, 0]}]}],
     "start": {"bar": {"phi": 2.2, "omega": 0}}, "until": 3, "every": 3}"#;
    let root = (fixed("0.7") * one() * one() / fixed("9.81")).sqrt();
    let period = times(&(pi() * 2), &root) * one() / mean(one(), cosine(&fixed("1.1")));
    let period = text(&period);
    let row = last(&source(pendulum, &[], &period, &period), 70);
    near(&number(row.bodies[0][0]), &fixed("2.2"), 66);
    near(&number(row.bodies[0][1]), &BigInt::ZERO, 64);
}

/// A ball dropped from 1 m onto a floor with e = 1/2: t_1 = sqrt(2 h/g), and 2 e^k t_1 between impacts.
#[test]
fn a_ball_bounces_as_its_parabolas() {
    let ball = r#"{"name": "ball", "gravity": [0, -9.81],
     "bars": [{"name": "ball", "mass": 0.3, "centre": [0, 0], "inertia": 0.01, "length": 0.1}],
     "walls": [{"name": "floor", "body": "ball", "point": [0, 0], "line": {"through": [0, 0.1], "normal": [0, 1]}, "restitution": 0.5}],
     "start": {"ball": {"phi": 0.3, "omega": 1.1, "origin": [0.2, 1.1], "velocity": [0.3, 0]}}, "until": 1, "every": 1}"#;
    let mut run = begun(&source(ball, &[], "1.2", "0.3"), 60);
    let rows: Vec<ShownRow> =
        (0..=run.last_row()).map(|k| run.row(k, &mut || false).expect("a row").expect("there")).collect();
    // 0.4515… + 0.4515… + 0.2257…: between the third and the fourth impact.
    assert_eq!(run.counts()[1], 3);
    let g = fixed("9.81");
    let first: BigInt = (fixed("2") * one() * one() / &g).sqrt();
    let third: BigInt = &first + &first + &first / 2;
    let speed = times(&g, &first) / 8;
    let after = fixed("1.2") - third;
    let height = times(&speed, &after) - times(&g, &times(&after, &after)) / 2;
    let row = rows.last().expect("a row");
    near(&number(row.bodies[0][3]), &(height + fixed("0.1")), 56);
    near(&number(row.bodies[0][2]), &fixed("0.56"), 56);
    near(&number(row.bodies[0][0]), &fixed("1.62"), 56);
    assert!(row.drift.abs() < 1e-56, "{:e}", row.drift);
}

/// The parallelograms move as one pendulum, whose energy is (11/4 + 3 I) w²/2 + 7 g y, with I as written.
#[test]
fn four_bars_pass_their_singular_positions_on_the_right_branch() {
    let rows = rows(&source(&shipped("four_bars"), &[], "3", "0.25"), 25);
    let is_below = |row: &ShownRow| row.bodies[0][3] < Wide::ZERO;
    let crossed = rows.windows(2).filter(|pair| is_below(&pair[0]) != is_below(&pair[1])).count();
    let mut energy: Option<BigInt> = None;
    for row in &rows {
        assert!(row.residual[0] < 1e-35 && row.drift.abs() < 1e-24, "{row:?}");
        for k in [3, 4] {
            near(&number(row.bodies[k][0]), &BigInt::ZERO, 22);
        }
        let (omega, [_, _, _, y, ..]) = (number(row.bodies[0][1]), row.bodies[0]);
        let inertia = fixed("2.75") + fixed("0.08333333333333333") * 3;
        let now = times(&inertia, &times(&omega, &omega)) / 2 + times(&fixed("9.81"), &(number(y) * 7));
        near(&now, energy.get_or_insert_with(|| now.clone()), 22);
    }
    assert!(crossed >= 3, "{crossed}");
}

/// The same scenes in doubles, and with 15 digits more.
#[test]
fn every_kind_of_scene_agrees_with_doubles_and_with_more_digits() {
    for name in [
        "spring",
        "motor",
        "motor_sine",
        "chain8",
        "branch",
        "wall",
        "slider_crank_driven",
        "guided",
        "kite",
        "duffing",
        "van_der_pol",
        "drag",
        "kepler",
        "parameters",
    ] {
        let source = source(&shipped(name), &[], "0.2", "0.2");
        let (few, many) = (last(&source, 25), last(&source, 40));
        let request = Request { until: Some(0.2), every: Some(0.2), rtol: Some(1e-14), ..Request::default() };
        let plain = common::run(&common::shipped(name, &[]), &request);
        for (k, (few, many)) in few.bodies.iter().zip(&many.bodies).enumerate() {
            for (&few, &many) in few.iter().zip(many) {
                let size = number(many).magnitude().clone().max(one().magnitude().clone());
                let off = (number(few) - number(many)) * one() / BigInt::from(size);
                near(&off, &BigInt::ZERO, 22);
            }
            let plain = fixed(&format!("{:.15}", plain.last.phi[k]));
            near(&number(many[0]), &plain, 9);
        }
    }
}

#[test]
fn a_run_goes_on_to_the_last_bit() {
    for name in ["spring", "wall"] {
        let source = source(&shipped(name), &[], "0.6", "0.1");
        let whole = rows(&source, 30);
        let mut paused = begun(&source, 30);
        let mut steps = 0;
        assert!(
            paused
                .row(3, &mut || {
                    steps += 1;
                    steps == 2
                })
                .expect("no stop")
                .is_none()
        );
        let saved = paused.save();
        let mut other = begun(&source, 30);
        assert!(other.resume(&saved) && !begun(&source, 31).resume(&saved));
        for (number, expected) in (4..).zip(&whole[4..]) {
            let found = other.row(number, &mut || false).expect("a row").expect("there");
            assert_eq!(format!("{found:?}"), format!("{expected:?}"), "{name}");
        }
    }
}

/// It ends with the step in which it is paused.
#[test]
fn a_forecast_is_paused() {
    let mut steps = 0;
    let found = forecast(&source(&shipped("free"), &[], "10", "1"), 1e-20, false, &mut || {
        steps += 1;
        steps == 3
    });
    assert!(found.expect("no error").is_none() && steps == 3, "{steps}");
}

/// The growth is about 10^4 in 10 s, and the proof holds whatever the threads do.
#[test]
fn the_digits_a_horizon_takes_are_forecast_and_proved() {
    let source = source(&shipped("free"), &[], "10", "1");
    let forecast = forecast(&source, 1e-20, false, &mut || false).expect("no error").expect("a forecast");
    assert!((2.5..9.0).contains(&forecast.growth), "{forecast:?}");
    assert!((24..40).contains(&forecast.run.digits) && forecast.companion.digits == forecast.run.digits + 10);
    let mut pair = DigitsPair::new(&source, &[forecast.run, forecast.companion]).expect("two runs");
    let mut least = f64::INFINITY;
    while let PairProgress::Rows(rows) = pair.go(&|| false).expect("no stop") {
        for (_, agreement) in rows {
            least = least.min(agreement.expect("two runs"));
        }
    }
    assert!(least > 20.0, "{least}");
}

#[test]
fn what_is_not_carried_is_refused_by_name() {
    let text = r#"{"name": "rigid", "gravity": [0, -9.81], "bars": [{"name": "bob", "mass": 1, "centre": [0, 0], "inertia": 0.1}],
        "springs": [{"name": "rope", "between": [{"body": "ground", "point": [0, 0]}, {"body": "bob", "point": [0, 0]}],
            "stiffness": 1e7, "free_length": 1, "model": "rigid"}],
        "start": {"bob": {"phi": 0, "omega": 0, "origin": [1, 0], "velocity": [0, 0]}}, "until": 1, "every": 1}"#;
    let source = source(text, &[], "1", "1");
    let error = long_run(&source, Precision::new(30, false)).err().expect("refused").to_string();
    assert!(error.contains("rigid") && error.contains("many digits"), "{error}");
}

/// Without weight a linkage moves alike whatever its size: of metres, and of micrometres.
#[test]
fn linkages_of_any_size_are_put_together() {
    let at_size = |power: i32| {
        let bar = |name: &str, length: f64| {
            let (half, inertia) = (length / 2.0, length * length / 12.0);
            format!(
                r#"{{"name": "{name}", "mass": 1, "centre": [{half}e{power}, 0], "inertia": {inertia}e{}, "length": {length}e{power}}}"#,
                2 * power
            )
        };
        let hinge = |name: &str, [a, b]: [(&str, f64); 2]| {
            let place =
                |(body, x): (&str, f64)| format!(r#"{{"body": "{body}", "point": [{x}e{power}, 0]}}"#);
            format!(r#"{{"name": "{name}", "between": [{}, {}]}}"#, place(a), place(b))
        };
        let text = format!(
            r#"{{"name": "linkage", "gravity": [0, 0], "bars": [{}, {}, {}], "hinges": [{}, {}, {}, {}],
            "start": {{"p": {{"phi": 1, "omega": 5}}, "q": {{"phi": 0.65}}, "r": {{"phi": 1.58}}}}, "until": 1, "every": 1}}"#,
            bar("p", 0.2),
            bar("q", 0.55),
            bar("r", 0.5),
            hinge("A", [("ground", 0.0), ("p", 0.0)]),
            hinge("B", [("p", 0.2), ("q", 0.0)]),
            hinge("C", [("ground", 0.55), ("r", 0.0)]),
            hinge("D", [("q", 0.55), ("r", 0.5)])
        );
        last(&source(&text, &[], "0.1", "0.1"), 40)
    };
    let [large, small] = [0, -6].map(at_size);
    for (large, small) in large.bodies.iter().zip(&small.bodies) {
        for what in [0, 1] {
            // What is rounded in the scene is spread over all angles in doubles.
            near(&number(large[what]), &number(small[what]), 13);
        }
    }
}

/// A block whose place and velocity as given are off its rail starts where assembly puts it, as in doubles and
/// as the notes say.
#[test]
fn a_block_starts_where_its_rail_puts_it() {
    let text = r#"{"name": "block", "gravity": [0, -10],
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 0.2}],
        "sliders": [{"name": "s", "point": {"body": "b", "point": [0, 0]}, "angle": "locked",
            "rail": {"body": "ground", "point": [0, 0], "direction": [3, 4]}}],
        "start": {"b": {"phi": 0, "omega": 0, "origin": [0, 0.3], "velocity": [1, 0]}}, "until": 0.5, "every": 0.5}"#;
    let begun = rows(&source(text, &[], "0.5", "0.5"), 22)[0].bodies[0].map(|value| value.value());
    for (value, expected) in begun[2..].iter().zip([0.144, 0.192, 0.36, 0.48]) {
        assert!((value - expected).abs() < 1e-14, "{begun:?}");
    }
    // Down the rail at 8 m/s^2.
    let [.., x, y, _, _] = bodies_at_end(text, "0.5", 22)[0];
    let travel = 0.24 + 0.6 * 0.5 - 4.0 * 0.25;
    assert!((x - 0.6 * travel).abs() < 1e-14 && (y - 0.8 * travel).abs() < 1e-14, "{x} {y}");
}
