//! What the digits of a scene's numbers come to, against runs from neighbouring scenes by another method, and
//! against closed forms.
//!
//! `COUNT=300 cargo test --test reports -- inputs:: --nocapture` compares more random scenes; `SEED` is the
//! first, `EACH` how many numbers of each.

use crate::common;
use crate::mechanisms;
#[cfg(feature = "cli")]
use crate::program;

use common::compile;
use driftless::dynamics::{Mechanism, Motion};
use driftless::run::trust::{DistanceMetric, Inputs, Level};
use driftless::run::{Limits, MethodId, Plan, Request, Run, Running, integrate};
use driftless::scene::{Scene, Template, Variable, WrittenNumber};
use std::sync::Arc;

const MAX_EVALUATIONS: u64 = 300_000;
const LOOKS: u32 = 64;

fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

fn template(text: &str) -> Template {
    Template::new(text.to_owned(), "scene.json".to_owned(), &[])
}

fn effects(template: &Template, numbers: &[WrittenNumber], until: f64) -> Inputs {
    Inputs::of(template, numbers, until, MAX_EVALUATIONS, None, &mut || false)
}

/// The motions of a scene at equally spaced times, by a method.
fn motions(scene: &Scene, method: MethodId, rtol: f64, until: f64) -> Result<Vec<Motion>, String> {
    let mechanism = Arc::new(Mechanism::new(scene).map_err(|error| error.to_string())?);
    let request = Request {
        method: Some(method),
        rtol: Some(rtol),
        until: Some(until),
        every: Some(until / f64::from(LOOKS)),
        max_evaluations: Some(10 * MAX_EVALUATIONS),
        ..Request::default()
    };
    let plan = Plan::new(scene, &mechanism, &request).map_err(|refusal| refusal.to_string())?;
    let start = mechanism.start(scene);
    let run =
        Run::new(Arc::clone(&mechanism), plan, Limits::default(), &start).map_err(|stop| stop.to_string())?;
    let mut running = Running::new(run);
    let mut found: Vec<Motion> = Vec::new();
    loop {
        let mut rows = 0;
        let mut seen = |_: &driftless::run::Sample| {
            rows += 1;
            Ok(())
        };
        let is_over = running.go(&mut seen, &mut || true).map_err(|error| error.to_string())?;
        if rows > 0 {
            found.push(running.motion().clone());
        }
        if is_over {
            break;
        }
    }
    running.finish().stop.map_or(Ok(found), |stop| Err(stop.to_string()))
}

fn apart(ruler: &DistanceMetric, one: &[Motion], other: &[Motion]) -> f64 {
    assert_eq!(one.len(), other.len());
    one.iter().zip(other).map(|(one, other)| ruler.apart(one, other)).fold(0.0, f64::max)
}

/// The scene with a number changed.
fn changed(template: &Template, number: &WrittenNumber, value: f64) -> Option<Scene> {
    template.filled(&[Variable { path: number.path.clone(), unit: number.unit, start: None }], &[value]).ok()
}

/// What one number came to.
enum Judged {
    /// The effect told over that seen.
    Ratio(f64),
    /// Too little to be seen, as told.
    Small,
    /// Why it is not told, or not seen.
    Unknown(String),
}

/// Judges what is told of a number by runs with it changed to both sides by what should make 1e-5 rad.
fn judged(
    template: &Template,
    number: &WrittenNumber,
    told: &driftless::run::trust::Input,
    base: &[Motion],
    until: f64,
    noise: f64,
) -> Judged {
    let Some(effect) = told.effect else { return Judged::Unknown(told.why.clone().unwrap_or_default()) };
    let slope = effect / number.uncertainty;
    let mut h = (1e-5 / slope).min(1e-3 * number.value.abs());
    let scene = template.scene().expect("a scene");
    let ruler = DistanceMetric::new(&compile(&scene));
    let of = |h: f64| {
        let scene = changed(template, number, number.value + h).ok_or("refused")?;
        motions(&scene, MethodId::Dp8, 1e-13, until)
    };
    let mut beside = [of(-h), of(h)];
    // Where a wall is touched or a spring just rigid enough, little may be changed.
    for _ in 0..2 {
        if beside.iter().any(Result::is_err) {
            h *= 1e-2;
            beside = [of(-h), of(h)];
        }
    }
    let [low, high] = match beside {
        [Ok(low), Ok(high)] => [low, high],
        [Err(why), _] | [_, Err(why)] => return Judged::Unknown(format!("not seen: {why}")),
    };
    let seen = apart(&ruler, &low, &high);
    let sides = [&low, &high].map(|side| apart(&ruler, side, base));
    let expected = 2.0 * h * slope;
    if std::env::var("SHOW").is_ok() {
        println!(
            "  {told:?}: by {h:e} on both sides {expected:e} expected, {seen:e} seen, {sides:?}, noise {noise:e}"
        );
    }
    if seen.max(if told.is_upper_bound { 0.0 } else { expected }) < 100.0 * noise {
        return Judged::Small;
    }
    if !(0.5..2.0).contains(&(sides[0] / sides[1])) {
        return Judged::Unknown("not seen: no proportion".into());
    }
    Judged::Ratio(expected / seen)
}

/// Scenes of all kinds: within a factor of three in 95 %, and never a hundred off.
#[test]
fn effects_are_those_of_runs_with_a_number_changed() {
    let (count, seed, each) = (number("COUNT", 60), number("SEED", 0), number("EACH", 3));
    let (mut all, mut within, mut small, mut unknown, mut worst) = (0_u32, 0_u32, 0_u32, 0_u32, Vec::new());
    let (mut scenes, mut without, mut unseen) = (0, 0, 0);
    for seed in seed..seed + count {
        let made = mechanisms::scene(seed);
        let until = 6.0 * made.scales.time;
        let template = template(&made.text);
        let mut dice = mechanisms::Dice::new(seed + 1000);
        let mut numbers = template.written_numbers(&[]).expect("a scene");
        while numbers.len() as u64 > each {
            numbers.swap_remove(dice.within(0.0, numbers.len() as f64) as usize % numbers.len());
        }
        let found = effects(&template, &numbers, until);
        let scene = template.scene().expect("a scene");
        let base = motions(&scene, MethodId::Dp8, 1e-13, found.at);
        let (Some(_), Ok(base)) = (found.total.filter(|_| found.at == until), base) else {
            without += 1;
            println!(
                "{seed}: none: {:?} {:?}",
                found.why,
                found.numbers.first().and_then(|number| number.why.clone())
            );
            continue;
        };
        let ruler = DistanceMetric::new(&compile(&scene));
        let Ok(other) = motions(&scene, MethodId::Dp8, 3e-13, until) else { continue };
        let noise = apart(&ruler, &base, &other).max(1e-14);
        scenes += 1;
        for told in &found.numbers {
            let number = numbers.iter().find(|number| number.path == told.path).expect("asked for");
            match judged(&template, number, told, &base, until, noise) {
                Judged::Small => small += 1,
                Judged::Unknown(why) if why.starts_with("not seen") => {
                    unseen += 1;
                    println!("{seed}: {}: {why}", told.path);
                }
                Judged::Unknown(why) => {
                    unknown += 1;
                    println!("{seed}: {}: {why}", told.path);
                }
                Judged::Ratio(ratio) => {
                    all += 1;
                    let off = ratio.max(1.0 / ratio);
                    within += u32::from(off < 3.0);
                    println!("{seed}: {} = {}: {ratio:.4} {:?}", told.path, told.value, made.kinds);
                    if off.is_nan() || off >= 100.0 {
                        worst.push((seed, told.path.clone()));
                    }
                }
            }
        }
    }
    println!(
        "{within} of {all} within 3, {small} too small to be seen, {unknown} not told, {unseen} not seen, \
         {scenes} scenes, {without} without, far off: {worst:?}"
    );
    assert!(
        f64::from(within) >= 0.95 * f64::from(all) && worst.is_empty(),
        "{within} of {all}, far off: {worst:?}"
    );
    assert!(u64::from(all) >= count && scenes * 2 > count, "{all} numbers of {scenes} scenes");
    assert!(f64::from(unknown) < 0.15 * f64::from(all + small + unknown), "{unknown} not told");
}

/// Without `--inputs` an order of magnitude is told: what relative changes of all forces and of the start by
/// 2.5 half units in the last place come to.
#[test]
fn the_order_of_magnitude_is_that_of_all_numbers() {
    let (count, seed) = (number("COUNT", 60).min(100), number("SEED", 0));
    let mut ratios = Vec::new();
    for seed in seed..seed + count {
        let made = mechanisms::scene(seed);
        let until = 6.0 * made.scales.time;
        let template = template(&made.text);
        let scene = template.scene().expect("a scene");
        let mechanism = compile(&scene);
        let request = Request {
            until: Some(until),
            every: Some(until),
            max_evaluations: Some(MAX_EVALUATIONS),
            ..Request::default()
        };
        let Ok(plan) = Plan::new(&scene, &mechanism, &request) else { continue };
        let start = mechanism.start(&scene);
        let Ok(run) = Run::new(mechanism, plan, Limits::default(), &start) else { continue };
        let trust = integrate(run.trusted(Level::Auto, &start), &mut |_| Ok(()))
            .expect("no observer fails")
            .trust
            .expect("asked for");
        let Some(told) = trust.input_error else { continue };
        let mut numbers = template.written_numbers(&[]).expect("a scene");
        for number in &mut numbers {
            number.uncertainty = 2.5 * 1.1e-16 * number.value.abs();
        }
        let found = effects(&template, &numbers, trust.at);
        if let Some(total) = found
            .total
            .filter(|&total| found.at == trust.at && 2 * found.unknown() < numbers.len() && total > 0.0)
        {
            println!("{seed}: {:.3} {:?}", told / total, made.kinds);
            ratios.push(told / total);
        }
    }
    ratios.sort_by(f64::total_cmp);
    let share = |most: f64| {
        ratios.iter().filter(|ratio| (1.0 / most..most).contains(*ratio)).count() as f64 / ratios.len() as f64
    };
    let [low, middle, high] = [0.05, 0.5, 0.95].map(|part| ratios[(part * ratios.len() as f64) as usize]);
    println!(
        "{} runs: {low:.2} {middle:.2} {high:.2}; within 3 {:.2}, 10 {:.2}, 100 {:.2}",
        ratios.len(),
        share(3.0),
        share(10.0),
        share(100.0)
    );
    assert!(ratios.len() as u64 * 3 > count && share(100.0) > 0.9, "{ratios:?}");
}

/// The effect told of a number, which must be one side of 1e-3 right.
#[track_caller]
fn assert_effect(found: &Inputs, path: &str, expected: f64) {
    let input =
        found.numbers.iter().find(|input| input.path == path).unwrap_or_else(|| panic!("{path}: {found:?}"));
    let effect = input.effect.unwrap_or_else(|| panic!("{input:?}"));
    assert!((effect / expected - 1.0).abs() < 1e-3, "{path}: {effect:e}, not {expected:e}");
}

fn all_effects(text: &str, until: f64) -> Inputs {
    let template = template(text);
    effects(&template, &template.written_numbers(&[]).expect("a scene"), until)
}

/// The largest of a function at the times that are looked at, the start among them.
fn largest(until: f64, f: impl Fn(f64) -> f64) -> f64 {
    (0..=LOOKS).map(|k| f(until * f64::from(k) / f64::from(LOOKS)).abs()).fold(0.0, f64::max)
}

/// phi = f(t sqrt(g/l)): a change of g is d phi = t phi'/2 dg/g, one of l the opposite, and none of the mass.
/// The motion is by Runge-Kutta here.
#[test]
fn a_pendulums_phase_follows_its_length_and_gravity() {
    let text = r#"{"name": "pendulum", "gravity": [0, -9.81], "until": 20, "every": 0.1,
        "bars": [{"name": "rod", "mass": 2.0, "centre": [0.80, 0], "inertia": 0, "length": 1}],
        "hinges": [{"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "rod", "point": [0, 0]}]}],
        "start": {"rod": {"phi": -0.40, "omega": 0}}}"#;
    let (until, steps) = (20.0, 64_000_u32);
    let h = until / f64::from(steps);
    let force = |phi: f64| -9.81 / 0.8 * phi.cos();
    let (mut phi, mut omega, mut most) = (-0.4, 0.0, 0.0_f64);
    for k in 1..=steps {
        let (a1, b1) = (omega, force(phi));
        let (a2, b2) = (omega + 0.5 * h * b1, force(phi + 0.5 * h * a1));
        let (a3, b3) = (omega + 0.5 * h * b2, force(phi + 0.5 * h * a2));
        let (a4, b4) = (omega + h * b3, force(phi + h * a3));
        phi += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        omega += h / 6.0 * (b1 + 2.0 * b2 + 2.0 * b3 + b4);
        if k % (steps / LOOKS) == 0 {
            most = most.max(0.5 * f64::from(k) * h * omega.abs());
        }
    }
    let found = all_effects(text, until);
    assert_effect(&found, "gravity[1]", most * 0.005 / 9.81);
    assert_effect(&found, "bars.rod.centre[0]", most * 0.005 / 0.8);
    let mass = found.numbers.iter().find(|input| input.path == "bars.rod.mass").expect("a number");
    assert!(mass.effect.is_some_and(|effect| effect < 1e-9), "{mass:?}");
    assert_eq!(found.unknown(), 0, "{found:?}");
}

/// x = x0 cos(w t), w² = k/m: of the stiffness dx = x0 t w/2 sin(w t) dk/k, growing as the time, of the mass
/// as much.
#[test]
fn an_oscillators_phase_follows_its_stiffness() {
    let text = r#"{"name": "oscillator", "gravity": [0, 0], "until": 50, "every": 0.5,
        "bars": [{"name": "block", "mass": 2.00, "centre": [0, 0], "inertia": 1, "length": 1}],
        "sliders": [{"name": "rail", "point": {"body": "block", "point": [0, 0]},
                     "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "angle": "locked"}],
        "springs": [{"name": "spring", "between": [{"body": "ground", "point": [0, 0]}, {"body": "block", "point": [0, 0]}],
                     "stiffness": 18.0, "free_length": 0, "damping": 0}],
        "start": {"block": {"phi": 0, "omega": 0, "origin": [0.3, 0]}}}"#;
    for until in [10.0, 50.0] {
        let found = all_effects(text, until);
        let phase = largest(until, |t| 0.3 * 1.5 * t * (3.0 * t).sin());
        assert_effect(&found, "springs.spring.stiffness", phase * 0.05 / 18.0);
        assert_effect(&found, "bars.block.mass", phase * 0.005 / 2.0);
        assert_effect(&found, "start.block.origin[0]", 0.05);
        let squares: f64 =
            found.numbers.iter().filter_map(|input| input.effect).map(|effect| effect * effect).sum();
        assert_eq!(found.total, Some(squares.sqrt()));
    }
}

/// A ball that falls from y onto a wall at w and rebounds: v1² = v0² + 2 g (y - w), t1 = (v0 + v1)/g, then w +
/// e v1 (t - t1) - g (t - t1)²/2.
#[test]
fn a_bouncing_ball_feels_its_wall_and_its_restitution() {
    let text = r#"{"name": "ball", "gravity": [0, -10.0], "until": 0.6, "every": 0.1,
        "bars": [{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 1, "length": 1}],
        "walls": [{"name": "floor", "body": "ball", "point": [0, 0], "line": {"through": [0, 0.10], "normal": [0, 1]},
                   "restitution": 0.70}],
        "start": {"ball": {"phi": 0, "omega": 0.5, "origin": [0, 0.90], "velocity": [0.3, -1.0]}}}"#;
    let until = 0.6;
    let height = |t: f64, [w, e, y, v, g]: [f64; 5]| {
        let v1 = (v * v + 2.0 * g * (y - w)).sqrt();
        let t1 = (v + v1) / g;
        let s = t - t1;
        if s < 0.0 { y + v * t - 0.5 * g * t * t } else { w + e * v1 * s - 0.5 * g * s * s }
    };
    let at = [0.1, 0.7, 0.9, -1.0, 10.0];
    let found = all_effects(text, until);
    let numbers = [
        ("walls.floor.line.through[1]", 0.005),
        ("walls.floor.restitution", 0.005),
        ("start.ball.origin[1]", 0.005),
        ("start.ball.velocity[1]", 0.05),
        ("gravity[1]", 0.05),
    ];
    for (k, (path, half)) in numbers.into_iter().enumerate() {
        let beside = |t: f64, h: f64| {
            let mut beside = at;
            beside[k] += h;
            height(t, beside)
        };
        assert_effect(&found, path, half * largest(until, |t| (beside(t, 1e-6) - beside(t, -1e-6)) / 2e-6));
    }
}

/// A restitution of 1 can be changed to one side only.
#[test]
fn what_can_be_changed_to_one_side_only_is_told_all_the_same() {
    let text = r#"{"name": "ball", "gravity": [0, -10.0], "until": 0.6, "every": 0.1,
        "bars": [{"name": "ball", "mass": 2, "centre": [0, 0], "inertia": 1, "length": 1}],
        "walls": [{"name": "floor", "body": "ball", "point": [0, 0], "line": {"through": [0, 0], "normal": [0, 1]},
                   "restitution": 1.00}],
        "start": {"ball": {"phi": 0, "omega": 0.5, "origin": [0, 0.80]}}}"#;
    let t1 = 0.4;
    let rebound = largest(0.6, |t| if t < t1 { 0.0 } else { 4.0 * (t - t1) });
    assert_effect(&all_effects(text, 0.6), "walls.floor.restitution", 0.005 * rebound);
}

/// Effects do not depend on what the run wrote, and where a motion is not known to its end, they go as far as
/// it is.
#[test]
fn effects_end_where_rounding_rules() {
    let template = Template::read("examples/scenes/free.json".as_ref(), &[]).expect("a shipped scene");
    let numbers = template.written_numbers(&[]).expect("a scene");
    let found = effects(&template, &numbers[..2], 60.0);
    assert!(found.at > 8.0 && found.at < 40.0 && found.why.is_some(), "{found:?}");
    let none = effects(&template, &numbers, 0.0);
    assert!(none.why.is_some() && none.numbers.is_empty() && none.total.is_none());
    let stopped = Inputs::of(&template, &numbers, 1.0, MAX_EVALUATIONS, None, &mut || true);
    assert!(stopped.total.is_none() && stopped.why.is_some_and(|why| why.contains("interrupted")));
}

#[cfg(feature = "cli")]
mod command {
    use super::program::Program;
    use serde_json::Value;
    use std::process::{Command, Stdio};
    use std::time::Duration;

    #[test]
    fn a_run_tells_what_every_number_comes_to() {
        let program = Program::with_scenes(&["free", "four_bar_motor"]);
        let ran = program
            .run("run free.json --until 3 --no-charts --inputs --set bar1.length=0.6000 --json")
            .exits(0);
        let inputs = &ran.object()["trust"]["inputs"];
        let numbers = inputs["numbers"].as_array().expect("a list");
        let of = |path: &str| {
            numbers
                .iter()
                .find(|number| number["path"] == path)
                .unwrap_or_else(|| panic!("{path}: {numbers:?}"))
        };
        assert_eq!(of("bars.bar1.length")["uncertainty"], 5e-5);
        assert_eq!(of("gravity[0]")["uncertainty"], 0.005);
        assert!(
            numbers.iter().all(|number| number["value"] != 0.0 && number["path"] != "until"),
            "{numbers:?}"
        );
        let effects: Vec<f64> =
            numbers.iter().map(|number| number["effect_rad"].as_f64().expect("a figure")).collect();
        assert!(effects.is_sorted_by(|a, b| a >= b), "{effects:?}");
        let total = effects.iter().map(|effect| effect * effect).sum::<f64>().sqrt();
        assert!((inputs["total_rad"].as_f64().expect("a total") / total - 1.0).abs() < 1e-12);
        assert_eq!(
            (&inputs["at_s"], &ran.object()["trust"]["input_error"]),
            (&Value::from(3.0), &inputs["total_rad"])
        );
        let kept: Value =
            serde_json::from_str(&program.read("output/free/taylor-1e-9/run.json")).expect("JSON");
        assert_eq!(&kept["result"]["trust"]["inputs"], inputs);
        let text = program
            .run("run free.json --until 3 --no-charts --inputs --force")
            .exits(0)
            .shows(&["last digits as written", "runs, "]);
        let places = ["gravity[0]", "start.bar1.phi"].map(|path| text.stdout.find(path).expect(path));
        assert!(
            places[0] < places[1] && text.stdout.lines().all(|line| line.chars().count() <= 80),
            "{}",
            text.stdout
        );
        // All is driven: no growth, but numbers have effects.
        let driven =
            program.run("run four_bar_motor.json --until 1 --no-charts --inputs --json").exits(0).object();
        assert!(driven["trust"]["inputs"]["total_rad"].as_f64().is_some_and(|total| total > 0.0), "{driven}");
        let usual = program.run("run free.json --until 3 --no-charts --force --json").exits(0).object();
        assert!(usual["trust"]["inputs"].is_null());
    }

    #[test]
    fn effects_need_a_horizon() {
        let program = Program::with_scenes(&["free"]);
        program.run("run free.json --until 3 --inputs --trust off").exits(2).says(&["--inputs", "--trust"]);
        assert_eq!(program.files(), ["free.json"]);
    }

    #[test]
    fn a_resumed_run_has_the_same_table() {
        let run = "run free.json --method taylor --rtol 1e-9 --until 2e4 --every 1 --no-charts --checkpoint-every 0.01 --inputs --set gravity[0]=9.810";
        let folder = "output/free/taylor-1e-9";
        let table = |program: &Program| {
            let kept: Value =
                serde_json::from_str(&program.read(&format!("{folder}/run.json"))).expect("JSON");
            kept["result"]["trust"].clone()
        };
        let whole = Program::with_scenes(&["free"]);
        whole.run(&format!("{run} -q")).exits(0);
        let program = Program::with_scenes(&["free"]);
        let mut child =
            program.command(run).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program");
        while !program.path(&format!("{folder}/checkpoint.previous")).exists() {
            assert_eq!(child.try_wait().expect("a child"), None, "it ended before its checkpoint");
            std::thread::sleep(Duration::from_millis(2));
        }
        assert!(
            Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("kill").success()
        );
        assert_eq!(child.wait().expect("it ends").code(), Some(130));
        program.run(&format!("resume {folder} -q")).exits(0);
        assert!(table(&program)["inputs"]["numbers"].as_array().is_some_and(|numbers| numbers.len() > 5));
        assert_eq!(table(&program), table(&whole));
    }
}

#[test]
fn numbers_with_units_are_as_uncertain_as_the_same_numbers_without() {
    let scene = |[mass, inertia, length, angle, rate, gravity]: [&str; 6]| {
        template(&format!(
            r#"{{"name": "u", "gravity": [0, {gravity}], "parameters": {{"l": {length}, "a": {angle}}},
            "bars": [{{"name": "b", "mass": {mass}, "centre": ["l/2", 0], "inertia": {inertia}, "length": "l"}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}},
                {{"body": "b", "point": [0, 0]}}]}}],
            "start": {{"b": {{"phi": "a", "omega": {rate}}}}}, "until": "1 s", "every": "100 ms"}}"#
        ))
    };
    let quoted =
        [r#""1200 g""#, r#""0500 kg*cm^2""#, r#""60 cm""#, r#""0.5 rad""#, r#""2.0 Hz""#, r#""-9.8 m/s^2""#];
    let templates = [scene(quoted), scene(["1.200", "0.0500", "0.60", "0.5", "2.0", "-9.8"])];
    let [with, without] = templates.each_ref().map(|text| text.written_numbers(&[]).expect("a scene"));
    assert_eq!(with.len(), 6, "{with:?}");
    for (one, other) in with.iter().zip(&without) {
        assert_eq!(one.path, other.path);
        let differs = |a: f64, b: f64| (a - b).abs() > 1e-14 * b.abs();
        assert!(!differs(one.value, other.value), "{one:?} {other:?}");
        assert!(!differs(one.uncertainty, other.uncertainty), "{one:?} {other:?}");
    }
    let [with, without] =
        [0, 1].map(|k| effects(&templates[k], &[with.clone(), without.clone()][k][..], 0.5));
    let [one, other] = [&with, &without].map(|inputs| inputs.total.expect("effects"));
    assert!(with.unknown() == 0 && (one / other - 1.0).abs() < 1e-6, "{one} {other}");
}
