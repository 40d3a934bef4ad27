//! Fits to synthetic data with noise: numbers found within their own standard errors, over many data sets as
//! often as these say; a chaotic motion by multiple shooting.

use driftless::run::fit::{Data, Fit, FitError, FitRequest, fit};
use driftless::scene::Output;
use driftless::{MethodId, Simulation, Template};
use nalgebra::{Matrix3, Vector3};
use std::fmt::Write;

/// About normally distributed numbers, the same in every run.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

fn template(name: &str, set: &[&str]) -> Template {
    let set: Vec<_> = set.iter().map(|set| set.parse().expect("an override")).collect();
    Template::read(format!("examples/scenes/{name}.json").as_ref(), &set).expect("a shipped scene")
}

/// Angles of both bars with noise.
fn data(template: &Template, until: f64, every: f64, sigma: f64, seed: u64) -> Data {
    let scene = template.scene().expect("a scene");
    let mut noise = Noise(seed);
    let mut text = String::from("t [s],bar1.phi [rad],bar2.phi [rad],other\n");
    Simulation::new(&scene)
        .expect("a simulation")
        .method(MethodId::Taylor)
        .tolerance(1e-14, 1e-14)
        .until(until)
        .every(every)
        .run_with(|sample| {
            let [one, two] = [0, 1].map(|bar| sample.phi[bar] + sigma * noise.normal());
            writeln!(text, "{},{one},{two},1", sample.t).expect("a string");
            Ok(())
        })
        .expect("a run");
    Data::parse(&text, "data.csv").expect("a table")
}

fn fitted(guess: &Template, data: &Data, vary: &[&str], segments: usize) -> Fit {
    let vary = vary.iter().map(|path| (*path).to_owned()).collect();
    let request = FitRequest { vary, segments, ..FitRequest::default() };
    fit(guess, data, &request, &mut || false).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn numbers_are_found_within_their_standard_errors() {
    let truth = [7.394_287_5, 0.4, 0.03];
    let vary = ["spring.stiffness", "spring.free_length", "spring.damping"];
    let known = template("spring", &["spring.damping=0.03"]);
    let guess =
        template("spring", &["spring.damping=0.01", "spring.stiffness=6.5", "spring.free_length=0.45"]);
    let mut sum = 0.0;
    let sets = 8;
    for seed in 0..sets {
        let data = data(&known, 2.0, 0.04, 2e-3, 17 + seed);
        let found = fitted(&guess, &data, &vary, 1);
        assert_eq!(found.ignored, ["other"]);
        // The noise is found with the numbers.
        for column in &found.columns {
            assert!((column.sigma / 2e-3 - 1.0).abs() < 0.35, "{}", column.sigma);
        }
        let off = nalgebra::DVector::from_fn(3, |k, _| found.numbers[k].value - truth[k]);
        let inverse = found.covariance.clone().try_inverse().expect("a covariance");
        sum += (off.transpose() * inverse * off)[(0, 0)];
        for (number, truth) in found.numbers.iter().zip(truth) {
            assert!((number.value - truth).abs() < 4.5 * number.error, "{number:?}");
        }
    }
    // Chi square with 24 degrees of freedom: between 8 and 50 in 999 of 1000 cases.
    println!("chi square {sum} of {}", 3 * sets);
    assert!((8.0..50.0).contains(&sum), "{sum}");
}

#[test]
fn a_chaotic_motion_is_fitted_by_multiple_shooting() {
    let known = template("free", &[]);
    let data = data(&known, 8.0, 0.02, 1e-3, 5);
    let guess = template("free", &["gravity[0]=9.6"]);
    let found = fitted(&guess, &data, &["gravity[0]"], 16);
    let number = &found.numbers[0];
    println!("{number:?}, gap {:e}, {}", found.gap, found.ended);
    assert!((number.value - 9.81).abs() < 4.0 * number.error && number.error < 1e-3, "{number:?}");
    assert!(found.gap < 1e-5, "{}", found.gap);
}

/// A cart on a level rail: its height is rounding in exact data, and tells nothing.
#[test]
fn columns_that_constraints_keep_do_not_outweigh_the_others() {
    let known = template("cart_pole", &[]);
    let mut text = String::from("t [s],cart.x [m],cart.y [m],cart.vy [m/s],pole.phi [rad]\n");
    let sampled = Simulation::new(&known.scene().expect("a scene")).expect("a simulation");
    sampled
        .method(MethodId::Taylor)
        .tolerance(1e-13, 1e-13)
        .until(2.0)
        .every(0.02)
        .run_with(|sample| {
            let (at, rate) = (sample.centre[0], sample.velocity[0]);
            writeln!(text, "{},{},{},{},{}", sample.t, at[0], at[1], rate[1], sample.phi[1])
                .expect("a string");
            Ok(())
        })
        .expect("a run");
    let data = Data::parse(&text, "data.csv").expect("a table");
    let found = fitted(&template("cart_pole", &["gravity[1]=-9.6"]), &data, &["gravity[1]"], 1);
    let number = &found.numbers[0];
    assert!((number.value + 9.81).abs() < 1e-7, "{} with {}", number.value, number.error);
}

#[test]
fn what_data_do_not_tell_is_refused() {
    let known = template("free", &[]);
    let data = data(&known, 1.0, 0.1, 1e-3, 3);
    let request = |vary: &str| FitRequest { vary: vec![vary.into()], ..FitRequest::default() };
    let told = |request: &FitRequest| {
        fit(&known, &data, request, &mut || false).map(|_| ()).expect_err("no fit").to_string()
    };
    assert!(told(&request("bars.bar9.density")).contains("bar9"));
    assert!(told(&FitRequest::default()).contains("--vary"));
    let columns = FitRequest { columns: vec!["bar3.phi".into()], ..request("gravity[0]") };
    assert!(told(&columns).contains("bar1.phi"), "{}", told(&columns));
    let other = FitRequest { columns: vec!["other".into()], ..request("gravity[0]") };
    assert!(told(&other).contains("other"), "{}", told(&other));
    let many = FitRequest { segments: 50, ..request("gravity[0]") };
    assert!(told(&many).contains("two rows"));
    let twice = Data::parse("t,bar1.phi,bar1.phi\n0,1,1\n0.1,1,1\n0.2,1,1\n", "twice.csv").expect("a table");
    let error = fit(&known, &twice, &request("gravity[0]"), &mut || false).map(|_| ()).expect_err("no fit");
    assert!(error.to_string().contains("twice.csv: has two columns bar1.phi"), "{error}");
    for (head, part) in [
        ("bar1.omega [deg]", "column bar1.omega: `deg` does not measure"),
        ("bar1.omega [degree/s]", "column bar1.omega: `degree` is no unit"),
        ("kinetic [mJ]", "for another one, as an energy, add an output by a formula"),
    ] {
        let other = Data::parse(&format!("t [s],{head}\n0,1\n0.1,1\n0.2,1\n"), "other.csv").expect("a table");
        let error =
            fit(&known, &other, &request("gravity[0]"), &mut || false).map(|_| ()).expect_err("no fit");
        let error = error.to_string();
        assert!(error.contains("other.csv: ") && error.contains(part), "{error}");
        assert!(head.starts_with("kinetic") || error.contains("line 1, column bar1.omega: "), "{error}");
    }
}

#[test]
fn the_same_measurements_in_other_units_give_the_same_fit() {
    let known = template("free", &[]);
    let data = data(&known, 1.0, 0.05, 1e-3, 7);
    let (_, angles) = &data.columns[0];
    let mut text = "t [ms],bar1.phi [deg],what [counts]\n".to_owned();
    for (t, angle) in data.times.iter().zip(angles) {
        let angle = angle.expect("a value").to_degrees();
        text += &format!("{},{angle},3\n", t * 1e3);
    }
    let scaled = Data::parse(&text, "scaled.csv").expect("a table");
    let request = |sigmas: &[f64]| FitRequest {
        vary: vec!["bars.bar1.density".into()],
        columns: vec!["bar1.phi".into()],
        sigmas: sigmas.iter().map(|sigma| ("bar1.phi".into(), *sigma)).collect(),
        ..FitRequest::default()
    };
    let fitted =
        |data: &Data, sigmas: &[f64]| fit(&known, data, &request(sigmas), &mut || false).expect("a fit");
    // So does what is said of the noise.
    let [one, other] = [fitted(&data, &[2e-3]), fitted(&scaled, &[2e-3_f64.to_degrees()])];
    assert!((one.chi_square - other.chi_square).abs() < 1e-6 * one.chi_square, "{one:?} {other:?}");
    assert!((one.numbers[0].error - other.numbers[0].error).abs() < 1e-6 * one.numbers[0].error);
    let [one, other] = [fitted(&data, &[]), fitted(&scaled, &[])];
    let apart = (one.numbers[0].value - other.numbers[0].value).abs();
    assert!(apart < 1e-6 * one.numbers[0].error, "{:?} {:?}", one.numbers, other.numbers);
}

/// Whenever it is paused: at the guess, in the search, in the states between parts.
#[test]
fn a_fit_that_is_paused_says_so() {
    let data = data(&template("free", &[]), 1.0, 0.1, 1e-3, 5);
    let guess = template("free", &["gravity[0]=9"]);
    for segments in [1, 2] {
        let request = FitRequest { vary: vec!["gravity[0]".into()], segments, ..FitRequest::default() };
        let mut looks = 0;
        fit(&guess, &data, &request, &mut || {
            looks += 1;
            false
        })
        .expect("a fit");
        for share in [0, looks / 10, looks / 2, looks - 2] {
            let mut left = share;
            let found = fit(&guess, &data, &request, &mut || {
                left -= 1;
                left < 0
            });
            assert!(matches!(found, Err(FitError::Interrupted)), "{segments}, {share} of {looks}: {found:?}");
        }
    }
}

/// A motor's motion is its own, whatever the bar weighs.
#[test]
fn a_number_that_does_nothing_to_the_data_is_refused() {
    let template = template("motor", &[]);
    let data = data(&template, 1.0, 0.05, 0.0, 1);
    let refusal = |path: &str| {
        let request = FitRequest { vary: vec![path.into()], ..FitRequest::default() };
        fit(&template, &data, &request, &mut || false).map(|_| ()).map_err(|error| error.to_string())
    };
    let error = refusal("bars.bar1.density").expect_err("no fit");
    assert!(error.contains("the data do not depend on bars.bar1.density"), "{error}");
    assert_eq!(refusal("bars.bar2.length"), Ok(()));
    // Nor does it carry the search away beside a number whose guess is not right yet.
    let vary = ["bars.bar1.density", "bars.bar2.length"].map(str::to_owned).to_vec();
    let guess = self::template("motor", &["bars.bar2.length=0.9"]);
    let error = fit(&guess, &data, &FitRequest { vary, ..FitRequest::default() }, &mut || false);
    let error = error.map(|_| ()).expect_err("no fit").to_string();
    assert!(error.contains("the data do not depend on bars.bar1.density"), "{error}");
}

/// What an event has switched, or set, is not told by the place where the next part begins.
#[test]
fn what_events_switch_or_set_is_refused_in_segments_and_fitted_whole() {
    for does in [r#""off": ["push"]"#, r#""set": {"k": 0}"#] {
        let text = std::fs::read_to_string("examples/scenes/free.json").expect("a shipped scene").replacen(
            '{',
            &format!(
                r#"{{"parameters": {{"k": 2}}, "torques": [{{"name": "push", "body": "bar1", "torque": "k"}}],
                "events": [{{"name": "e", "when": "t - 0.3", {does}}}],"#
            ),
            1,
        );
        let known = |set: &[&str]| {
            let set: Vec<_> = set.iter().map(|set| set.parse().expect("an override")).collect();
            Template::new(text.clone(), "scene.json".into(), &set)
        };
        let data = data(&known(&[]), 1.0, 0.02, 0.0, 1);
        let guess = known(&["parameters.k=2.1"]);
        let request = |segments| FitRequest { vary: vec!["k".into()], segments, ..FitRequest::default() };
        let refused = fit(&guess, &data, &request(2), &mut || false).map(|_| ()).expect_err("no fit");
        assert!(refused.to_string().contains("switched or set by events"), "{refused}");
        let found = fit(&guess, &data, &request(1), &mut || false).expect("a fit");
        assert!((found.numbers[0].value - 2.0).abs() < 1e-9, "{:?}", found.numbers);
    }
}

/// A bar of 0.5 kg·m² on a torsion spring and a damper.
const OSCILLATOR: &str = r#"{
    "name": "oscillator", "gravity": [0, 0], "parameters": {"k": 2.0, "c": 0.1, "a": 0.5, "w": 0.3},
    "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 0.5}],
    "hinges": [{"name": "O", "between": [{"body": "ground", "point": [0, 0]}, {"body": "b", "point": [0, 0]}]}],
    "torsion_springs": [{"name": "s", "body": "b", "stiffness": "k", "free_angle": 0, "damping": "c"}],
    "start": {"b": {"phi": "a", "omega": "w"}}, "until": 10, "every": 0.1
}"#;

/// Its angle and rate in closed form, for a damping of either sign.
fn oscillation([k, c, a, w]: [f64; 4], t: f64) -> [f64; 2] {
    let decay = c / (2.0 * 0.5);
    let rate = (k / 0.5 - decay * decay).sqrt();
    let (sin, cos) = (rate * t).sin_cos();
    let b = (w + decay * a) / rate;
    let shape = a * cos + b * sin;
    let growth = (-decay * t).exp();
    [growth * shape, growth * (rate * (b * cos - a * sin) - decay * shape)]
}

fn oscillator_fit(data: &Data, sigmas: &[(&str, f64)]) -> Fit {
    let template = Template::new(OSCILLATOR.into(), "oscillator.json".into(), &[]);
    let request = FitRequest {
        vary: ["k", "c", "a", "w"].map(str::to_owned).to_vec(),
        sigmas: sigmas.iter().map(|(name, sigma)| ((*name).to_owned(), *sigma)).collect(),
        ..FitRequest::default()
    };
    fit(&template, data, &request, &mut || false).unwrap_or_else(|error| panic!("{error}"))
}

/// The motion of a growing oscillation is told best by a damping below zero, which no scene has: the others are
/// those of the least squares of `a cos(r t) + b sin(r t)`, by steps of Gauss and Newton from the truth.
#[test]
fn a_number_whose_best_value_is_no_scene_is_held_at_its_bound() {
    let truth = [2.1, -0.01, 0.45, 0.35];
    let mut noise = Noise(5);
    let rows: Vec<[f64; 2]> = (1..=100)
        .map(|row| {
            let t = 0.1 * f64::from(row);
            [t, oscillation(truth, t)[0] + 0.003 * noise.normal()]
        })
        .collect();
    let mut best = Vector3::new((truth[0] / 0.5_f64).sqrt(), truth[2], truth[3] / 2.0);
    let left = |best: &Vector3<f64>, [t, y]: [f64; 2]| {
        let (sin, cos) = (best[0] * t).sin_cos();
        let slope = Vector3::new(t * (best[2] * cos - best[1] * sin), cos, sin);
        (best[1] * cos + best[2] * sin - y, slope)
    };
    for _ in 0..20 {
        let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for row in &rows {
            let (left, slope) = left(&best, *row);
            (matrix, right) = (matrix + slope * slope.transpose(), right + slope * left);
        }
        best -= matrix.try_inverse().expect("a minimum") * right;
    }
    let squares: f64 = rows.iter().map(|row| left(&best, *row).0.powi(2)).sum();
    let text: String = rows.iter().map(|[t, y]| format!("{t},{y}\n")).collect();
    let data = Data::parse(&format!("t [s],b.phi [rad]\n{text}"), "data.csv").expect("a table");
    let found = oscillator_fit(&data, &[("b.phi", 0.003)]);
    let [k, c, a, w] = &found.numbers[..] else { panic!("four numbers") };
    println!("k {} a {} w {} chi square {}", k.value, a.value, w.value, found.chi_square);
    assert!(c.is_at_bound && c.value == 0.0 && c.error.is_nan(), "{c:?}");
    assert!([k, a, w].iter().all(|number| !number.is_at_bound && number.error > 0.0));
    for (number, value) in [(k, 0.5 * best[0] * best[0]), (a, best[1]), (w, best[0] * best[2])] {
        assert!((number.value - value).abs() < 1e-4 * number.error, "{number:?} {value}");
    }
    assert!((found.chi_square - squares / 9e-6).abs() < 1e-6 * found.chi_square, "{}", found.chi_square);
    assert_eq!(found.degrees_of_freedom, 97);
    assert_eq!(found.covariance.column(1).amax(), 0.0);
}

/// A rate of 2 rad/s looked for from 20 rad/s on: the sum of squares has a minimum beside every multiple of
/// 2π over the length of the data, where the residuals are about as large as the data.
#[test]
fn a_minimum_that_leaves_more_than_the_noise_is_doubtful() {
    let mut noise = Noise(11);
    let rows: String = (1..=100)
        .map(|row| {
            let t = 0.1 * f64::from(row);
            format!("{t},{}\n", oscillation([2.0, 0.0, 0.5, 0.0], t)[0] + 0.01 * noise.normal())
        })
        .collect();
    let data = Data::parse(&format!("t [s],b.phi [rad]\n{rows}"), "data.csv").expect("a table");
    let doubts = |stiffness: f64, sigma: &[f64]| {
        let set = [format!("parameters.k={stiffness}"), "parameters.c=0".into(), "parameters.w=0".into()];
        let set: Vec<_> = set.iter().map(|set| set.parse().expect("an override")).collect();
        let guess = Template::new(OSCILLATOR.into(), "oscillator.json".into(), &set);
        let sigmas = sigma.iter().map(|sigma| ("b.phi".to_owned(), *sigma)).collect();
        let request = FitRequest { vary: vec!["k".into()], sigmas, ..FitRequest::default() };
        fit(&guess, &data, &request, &mut || false).expect("a minimum").doubts
    };
    for sigma in [&[0.01][..], &[]] {
        let far = doubts(200.0, sigma).expect("doubts");
        assert!(far.contains("residuals of b.phi") && far.contains("--segments"), "{far}");
        assert_eq!(doubts(2.2, sigma), None);
    }
    // A noise that was told too small by three.
    assert!(doubts(2.2, &[0.01 / 3.0]).is_some_and(|doubts| doubts.contains("times its sigma")));
}

/// A brake holds the bar from 0.5 s to 1 s: the rows at these very times are those of the braked bar.
#[test]
fn a_row_at_the_time_of_an_event_is_fitted_by_what_comes_after_it() {
    let braked = OSCILLATOR.replacen(
        '{',
        r#"{"locks": [{"name": "brake", "body": "b"}], "inactive": ["brake"],
            "events": [{"name": "stop", "when": "t - 0.5", "on": ["brake"]},
                {"name": "go", "when": "t - 1", "off": ["brake"]}],"#,
        1,
    );
    let truth = [2.1, 0.12, 0.5, 0.3];
    let held = oscillation(truth, 0.5)[0];
    let mut text = String::from("t [s],b.phi [rad],b.omega [rad/s]\n");
    for row in 1..=40 {
        let t = f64::from(row) / 20.0;
        let [phi, omega] = match t {
            t if t < 0.5 => oscillation(truth, t),
            t if t < 1.0 => [held, 0.0],
            t => oscillation([truth[0], truth[1], held, 0.0], t - 1.0),
        };
        writeln!(text, "{t},{phi},{omega}").expect("a string");
    }
    let template = Template::new(braked, "braked.json".into(), &[]);
    let request = FitRequest {
        vary: ["k", "c"].map(str::to_owned).to_vec(),
        sigmas: ["b.phi", "b.omega"].map(|name| (name.to_owned(), 0.01)).to_vec(),
        ..FitRequest::default()
    };
    let data = Data::parse(&text, "data.csv").expect("a table");
    let found = fit(&template, &data, &request, &mut || false).unwrap_or_else(|error| panic!("{error}"));
    for (number, truth) in found.numbers.iter().zip(truth) {
        assert!((number.value - truth).abs() < 1e-7, "{number:?}");
    }
    assert!(found.chi_square < 1e-10, "{}", found.chi_square);
}

/// A short column of exact angles beside a long one of inexact rates: the weights are those of the minimum, and
/// the errors those of the numbers, which the short column tells.
#[test]
fn the_noise_of_columns_of_unlike_length_is_what_the_fit_was_weighted_with() {
    let truth = [2.1, 0.12, 0.45, 0.35];
    let (sets, mut squares) = (20, 0.0);
    for set in 0..sets {
        let mut noise = Noise(91 + set);
        let mut text = String::from("t [s],b.phi [rad],b.omega [rad/s]\n");
        for row in 1..=300 {
            let t = f64::from(row) / 30.0;
            let [phi, omega] = oscillation(truth, t);
            let phi = if row % 30 == 0 { format!("{}", phi + 1e-3 * noise.normal()) } else { String::new() };
            writeln!(text, "{t},{phi},{}", omega + 0.3 * noise.normal()).expect("a string");
        }
        let data = Data::parse(&text, "data.csv").expect("a table");
        let found = oscillator_fit(&data, &[]);
        assert_eq!(found.ended, format!("converged after {} runs", found.runs));
        // That it ends where these weights are given does not take all of the sets.
        if set < 5 {
            let [phi, omega] = [0, 1].map(|k| found.columns[k].sigma);
            let again = oscillator_fit(&data, &[("b.phi", phi), ("b.omega", omega)]);
            for (number, again) in found.numbers.iter().zip(&again.numbers) {
                assert!((number.value - again.value).abs() < 1e-2 * number.error, "{number:?} {again:?}");
            }
        }
        squares += found
            .numbers
            .iter()
            .zip(truth)
            .fold(0.0, |sum, (number, truth)| sum + ((number.value - truth) / number.error).powi(2));
    }
    // With six degrees of freedom the mean of t² is 1.5; an error that counts all rows has 2.5.
    let mean = squares / (4 * sets) as f64;
    println!("mean square of what numbers are off, over their errors: {mean}");
    assert!((0.6..2.0).contains(&mean), "{mean}");
}

/// Pieces are tied together where constraints move with time, and where they are curved: the numbers and their
/// standard errors are those of the data in one piece.
#[test]
fn pieces_of_a_motion_on_constraints_give_the_fit_of_the_whole() {
    let driven = r#"{"name": "driven", "gravity": [0, -9.81],
        "bars": [{"name": "a", "mass": 1, "centre": [0.1, 0], "inertia": 0.01, "length": 0.2},
                 {"name": "b", "mass": 1, "centre": [0.3, 0], "inertia": 0.04, "length": 0.6}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
                   {"name": "B", "between": [{"body": "a", "point": [0.2, 0]}, {"body": "b", "point": [0, 0]}]}],
        "motors": [{"name": "M", "body": "a", "law": {"start": 0, "rate": 2.5}}],
        "torsion_springs": [{"name": "T", "body": "b", "stiffness": 2.2, "free_angle": 0, "damping": 0.05}],
        "start": {"b": {"phi": -1, "omega": 0}}, "until": 4, "every": 0.05}"#;
    let curved = r#"{"name": "curved", "gravity": [0, 0],
        "bars": [{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 1, "length": 1},
                 {"name": "a", "mass": 1, "centre": [0, 0], "inertia": 3, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
                   {"name": "B", "between": [{"body": "ground", "point": [2, 0]}, {"body": "b", "point": [0, 0]}]}],
        "motors": [{"name": "G", "body": "a", "law": "0.5*b.phi^2"}],
        "torsion_springs": [{"name": "T", "body": "b", "stiffness": 4, "free_angle": 0, "damping": 0.2}],
        "torques": [{"name": "M", "body": "b", "torque": 3, "law": {"start": 0, "sines": [{"amplitude": 1, "frequency": 3}]}}],
        "start": {"b": {"phi": 0.8, "omega": 1.5}}, "until": 6, "every": 0.05}"#;
    for (text, third) in [(driven, "M.rate"), (curved, "M.torque")] {
        let template = Template::new(text.into(), "scene.json".into(), &[]);
        let (mut noise, mut table) = (Noise(11), String::from("t [s],b.phi [rad]\n"));
        let scene = template.scene().expect("a scene");
        let b = usize::from(scene.bars[1].name == "b");
        Simulation::new(&scene)
            .expect("a simulation")
            .method(MethodId::Taylor)
            .tolerance(1e-13, 1e-13)
            .run_with(|sample| {
                writeln!(table, "{},{}", sample.t, sample.phi[b] + 0.03 * noise.normal()).expect("a string");
                Ok(())
            })
            .expect("a run");
        let data = Data::parse(&table, "data.csv").expect("a table");
        let of = |segments: usize| {
            let request = FitRequest {
                vary: ["T.stiffness", "T.damping", third].map(str::to_owned).to_vec(),
                sigmas: vec![("b.phi".to_owned(), 0.03)],
                segments,
                ..FitRequest::default()
            };
            fit(&template, &data, &request, &mut || false).unwrap_or_else(|error| panic!("{error}"))
        };
        let whole = of(1);
        for segments in [2, 5] {
            let found = of(segments);
            for (one, whole) in found.numbers.iter().zip(&whole.numbers) {
                println!(
                    "{} {segments}: {} {}, whole {} {}",
                    scene.name, one.value, one.error, whole.value, whole.error
                );
                assert!((one.value - whole.value).abs() < 1e-3 * whole.error, "{segments} {one:?} {whole:?}");
                assert!((one.error / whole.error - 1.0).abs() < 1e-3, "{segments} {one:?} {whole:?}");
            }
        }
    }
}

/// The oscillator with an output of its own, and one of the same name of `--output` in its place.
#[test]
fn columns_are_fitted_to_outputs_that_are_added() {
    let own = OSCILLATOR.replacen('{', r#"{"outputs": {"q": "b.phi"},"#, 1);
    let truth = [2.1, 0.12, 0.5, 0.3];
    let mut text = String::from("t [s],q,b.phi [rad]\n");
    for row in 1..=40 {
        let t = f64::from(row) / 20.0;
        let phi = oscillation(truth, t)[0];
        writeln!(text, "{t},{},{phi}", 1.5 * phi).expect("a string");
    }
    let data = Data::parse(&text, "data.csv").expect("a table");
    for scene in [&own, OSCILLATOR] {
        let template = Template::new(scene.to_owned(), "oscillator.json".into(), &[]);
        let template = template.with_outputs(vec![Output::parse("q=1.5*b.phi")]);
        for columns in [&["q"][..], &["q", "b.phi"]] {
            let request = FitRequest {
                vary: ["k", "c"].map(str::to_owned).to_vec(),
                columns: columns.iter().map(|name| (*name).to_owned()).collect(),
                sigmas: columns.iter().map(|name| ((*name).to_owned(), 0.01)).collect(),
                ..FitRequest::default()
            };
            let found =
                fit(&template, &data, &request, &mut || false).unwrap_or_else(|error| panic!("{error}"));
            for (number, truth) in found.numbers.iter().zip(truth) {
                assert!((number.value - truth).abs() < 1e-7, "{columns:?} {number:?}");
            }
            assert!(found.chi_square < 1e-10, "{columns:?} {}", found.chi_square);
        }
    }
}

/// One row of angle and rate for one number: a single residual, which any ratio of their noises explains.  Two rows
/// of one column tell its noise, and so do a few rows of both; not what a column has of its own number alone.
#[test]
fn noise_that_the_data_do_not_tell_is_named() {
    let ended = |text: &str, vary: &[&str], sigmas: &[(&str, f64)]| {
        let template = Template::new(OSCILLATOR.into(), "oscillator.json".into(), &[]);
        let request = FitRequest {
            vary: vary.iter().map(|name| (*name).to_owned()).collect(),
            sigmas: sigmas.iter().map(|(name, sigma)| ((*name).to_owned(), *sigma)).collect(),
            ..FitRequest::default()
        };
        let data = Data::parse(text, "data.csv").expect("a table");
        let found = fit(&template, &data, &request, &mut || false).unwrap_or_else(|error| panic!("{error}"));
        (found.ended, found.columns)
    };
    let one = "t [s],b.phi [rad],b.omega [rad/s]\n1,-0.13,-1.0\n";
    let told = ended(one, &["a"], &[]).0;
    assert!(told.contains("the noise of b.phi, b.omega is not told: --sigma b.phi="), "{told}");
    assert!(!ended(one, &["a"], &[("b.phi", 0.1), ("b.omega", 0.1)]).0.contains("not told"));
    let two = "t [s],b.phi [rad]\n0.5,0.31\n1,-0.13\n";
    assert!(!ended(two, &["a"], &[]).0.contains("not told"));
    let three = "t [s],b.phi [rad],b.omega [rad/s]\n0.5,0.31,\n1,-0.13,-1.0\n";
    assert!(ended(three, &["a"], &[]).0.contains("not told"));
    let few = "t [s],b.phi [rad],b.omega [rad/s]\n0.3,0.5,-0.3\n0.5,0.31,-0.8\n1,-0.13,-1.0\n1.5,-0.4,-0.2\n";
    let (told, _) = ended(few, &["a"], &[]);
    assert!(!told.contains("not told"), "{told}");
    // A column without values has no noise, found or not.
    let (_, columns) = ended("t [s],b.phi [rad],b.omega [rad/s]\n0.5,0.31,\n1,-0.13,\n", &["a"], &[]);
    assert!(columns[1].sigma.is_nan() && columns[0].sigma > 0.0, "{columns:?}");
}

/// A disc on two springs: its period tells the sum of their stiffnesses alone, wherever the search ends.
#[test]
fn numbers_of_which_only_the_sum_is_told_are_named_together() {
    let text = r#"{"name": "disc", "gravity": [0, 0],
        "bars": [{"name": "a", "mass": 0.7, "centre": [0, 0], "inertia": 0.02, "length": 0.6}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]}],
        "torsion_springs": [{"name": "s", "body": "a", "stiffness": 2, "free_angle": 0},
            {"name": "r", "body": "a", "stiffness": 1, "free_angle": 0}],
        "start": {"a": {"phi": 1, "omega": 0}}, "until": 6, "every": 0.05}"#;
    let rows: Vec<String> = (1..9).map(|k| format!("0.{k},{}\n", (f64::from(k) * 1.1).cos())).collect();
    let data = Data::parse(&format!("t [s],a.phi [rad]\n{}", rows.concat()), "data.csv").expect("a table");
    let template = Template::new(text.into(), "disc.json".into(), &[]);
    let vary = ["s.stiffness", "r.stiffness", "start.a.phi"].map(str::to_owned).to_vec();
    let request = FitRequest { vary, ..FitRequest::default() };
    let error = fit(&template, &data, &request, &mut || false).map(|_| ()).expect_err("no fit").to_string();
    println!("{error}");
    let [one, other] = ["s", "r"].map(|name| format!("torsion_springs.{name}.stiffness"));
    let told = [[&one, &other], [&other, &one]]
        .map(|[a, b]| format!("where the data do not tell {a} apart from {b}\n"));
    assert!(
        told.iter().any(|told| error.contains(told)) && error.contains("the search ran from "),
        "{error}"
    );
}

/// Friction by a radius times a coefficient, beside a column that stays as it is and is known to the last digit: its
/// derivatives are rounding, and tell nothing.
#[test]
fn a_column_that_stays_as_it_is_tells_nothing() {
    let bar = |name: &str| {
        format!(r#"{{"name": "{name}", "mass": 1, "centre": [0.5, 0], "inertia": 0.1, "length": 1}}"#)
    };
    let text = format!(
        r#"{{"name": "two", "gravity": [0, -9.81], "bars": [{}, {}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}],
                "friction": {{"radius": 0.05, "kinetic": 0.3}}}},
            {{"name": "B", "between": [{{"body": "ground", "point": [3, 0]}}, {{"body": "c", "point": [0, 0]}}]}}],
        "locks": [{{"name": "l", "body": "c"}}],
        "start": {{"b": {{"phi": -0.5, "omega": 0.3}}, "c": {{"phi": 0.3, "omega": 0}}}}, "until": 3, "every": 0.05}}"#,
        bar("b"),
        bar("c"),
    );
    let template = |set: &[&str]| {
        let set: Vec<_> = set.iter().map(|set| set.parse().expect("an override")).collect();
        Template::new(text.clone(), "two.json".into(), &set)
    };
    let scene = template(&[]).scene().expect("a scene");
    let mut rows = String::from("t [s],b.phi [rad],c.x [m]\n");
    let outcome = Simulation::new(&scene).expect("a simulation").run_with(|sample| {
        writeln!(rows, "{:?},{:?},{:?}", sample.t, sample.phi[0], sample.centre[1][0]).expect("a string");
        Ok(())
    });
    outcome.expect("a run");
    let data = Data::parse(&rows, "data.csv").expect("a table");
    let off = ["hinges.A.friction.radius=0.0507", "hinges.A.friction.kinetic=0.296"];
    let vary = ["hinges.A.friction.radius", "hinges.A.friction.kinetic"].map(str::to_owned).to_vec();
    let request = FitRequest { vary, ..FitRequest::default() };
    let error = fit(&template(&off), &data, &request, &mut || false).map(|_| ()).expect_err("no fit");
    assert!(error.to_string().contains("do not tell"), "{error}");
}

/// An angle that stays where no motion from the start is: ever stiffer springs and dampers fit it better.
#[test]
fn a_search_that_runs_away_says_where_to() {
    let text = r#"{"name": "pendulum", "gravity": [0, -9.81],
        "bars": [{"name": "a", "mass": 0.7, "centre": [0.3, 0], "inertia": 0.02, "length": 0.6}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]}],
        "torsion_springs": [{"name": "s", "body": "a", "stiffness": 2, "free_angle": 0, "damping": 0.05}],
        "start": {"a": {"phi": -0.7, "omega": 1.2}}, "until": 6, "every": 0.05}"#;
    let data = Data::parse("t [s],a.phi [rad]\n1,1\n2,1\n3,1\n", "data.csv").expect("a table");
    let template = Template::new(text.into(), "pendulum.json".into(), &[]);
    let vary = ["s.stiffness", "s.damping"].map(str::to_owned).to_vec();
    let request = FitRequest { vary, ..FitRequest::default() };
    let error = fit(&template, &data, &request, &mut || false).map(|_| ()).expect_err("no fit").to_string();
    println!("{error}");
    assert!(error.contains("the search ran from ") && error.contains("hint: "), "{error}");
}

/// What is no number to be found is refused like a name that is none.
#[test]
fn numbers_are_named_once_and_are_such_that_the_motion_depends_on() {
    let data = data(&template("free", &[]), 1.0, 0.1, 1e-3, 3);
    for (vary, told) in [
        (&["gravity[0]", "gravity[0]"][..], "--vary names gravity[0] twice"),
        (&["bars.bar1.length", "bar1.length"], "--vary names bars.bar1.length twice"),
        (&["gravity[0]", "until"], "--vary until: no motion depends on it"),
    ] {
        let request = FitRequest {
            vary: vary.iter().map(|name| (*name).to_owned()).collect(),
            ..FitRequest::default()
        };
        let error = fit(&template("free", &[]), &data, &request, &mut || false).map(|_| ()).expect_err(told);
        assert!(error.to_string().contains(told), "{error}");
        assert!(matches!(error, FitError::Sensitivity(_)), "{error:?}");
    }
}
