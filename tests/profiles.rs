//! Motors whose laws are formulas of time that are no sums of sines: against an independent integration of
//! the bar that hangs on them, and tables from files.

use crate::formulas::{adaptive, methods, run, scene};
use driftless::run::{MethodId, Request, Stabilization, simulate};
use driftless::scene::{parse_scene, read_scene};
use driftless::stepping::Cause;
use driftless::stepping::composition::Composition;

/// A driven bar of 0.5 m that carries a swinging one, and the same on a driven cart.
fn carried(law: &str, more: &str, on_cart: bool) -> String {
    let (base, motor) = match on_cart {
        false => (
            r#"{"name": "O", "between": [{"body": "ground", "point": [0, 0]}, {"body": "base", "point": [0, 0]}]}"#,
            r#""hinges""#,
        ),
        true => (
            "",
            r#""sliders": [{"name": "rail", "point": {"body": "base", "point": [0, 0]}, "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "angle": "locked"}], "hinges""#,
        ),
    };
    let driven = if on_cart { r#""slider": "rail""# } else { r#""body": "base""# };
    let point = if on_cart { "[0, 0]" } else { "[0.5, 0]" };
    let comma = if on_cart { "" } else { "," };
    let start = if on_cart { r#""base": {"phi": 0, "omega": 0}, "# } else { "" };
    format!(
        r#"{{"name": "carried", "gravity": [0, -9.81], {more}
        "bars": [{{"name": "base", "length": 0.5, "mass": 1, "centre": [0.25, 0], "inertia": 0.02}},
                 {{"name": "bar", "length": 0.4, "mass": 0.5, "centre": [0.2, 0], "inertia": 0.0066}}],
        {motor}: [{base}{comma} {{"name": "A", "between": [{{"body": "base", "point": {point}}}, {{"body": "bar", "point": [0, 0]}}]}}],
        "motors": [{{"name": "M", {driven}, "law": "{law}"}}],
        "start": {{{start}"bar": {{"phi": -1, "omega": 0.3}}}}, "until": 3, "every": 0.25}}"#
    )
}

/// A law with its first and second derivative.
type Given = dyn Fn(f64) -> [f64; 3];

/// Angle and rate of the bar at 3 s by the classical Runge–Kutta method, whose steps end at the corners.
fn swung(law: &Given, on_cart: bool) -> [f64; 2] {
    let rate = |t: f64, [phi, omega]: [f64; 2]| {
        let [theta, speed, acceleration] = law(t);
        let (s, c) = theta.sin_cos();
        let pivot = match on_cart {
            true => [acceleration, 0.0],
            false => {
                [0.5 * (-s * acceleration - c * speed * speed), 0.5 * (c * acceleration - s * speed * speed)]
            }
        };
        let (s, c) = phi.sin_cos();
        let torque = 0.5 * 0.2 * (s * pivot[0] - c * (pivot[1] + 9.81));
        [omega, torque / (0.0066 + 0.5 * 0.04)]
    };
    let (h, mut state) = (1.0 / 8192.0, [-1.0, 0.3]);
    for step in 0..3 * 8192 {
        // A little inside the step, so that both ends are on its own branch.
        let (t, inside) = (f64::from(step) * h, 1e-12);
        let along = |by: f64, slope: [f64; 2]| [state[0] + by * slope[0], state[1] + by * slope[1]];
        let a = rate(t + inside, state);
        let b = rate(t + h / 2.0, along(h / 2.0, a));
        let c = rate(t + h / 2.0, along(h / 2.0, b));
        let d = rate(t + h - inside, along(h, c));
        let sum = |i: usize| state[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]);
        state = [sum(0), sum(1)];
    }
    state
}

fn smooth(t: f64) -> [f64; 3] {
    let (u, e) = ((2.0 * (t - 1.0)).tanh(), (-t).exp());
    let slope = 1.0 - u * u;
    [0.6 * u * e, 0.6 * e * (2.0 * slope - u), 0.6 * e * (-8.0 * u * slope - 4.0 * slope + u)]
}

fn corner(t: f64) -> [f64; 3] {
    let s = t - 1.0;
    if t < 1.0 {
        [t.powi(3) / 6.0, t * t / 2.0, t]
    } else {
        [1.0 / 6.0 + s / 2.0 + s * s / 2.0, 0.5 + s, 1.0]
    }
}

fn ramp(t: f64) -> [f64; 3] {
    let x = (t / 2.0).min(1.0);
    let moving = if t < 2.0 { 1.0 } else { 0.0 };
    [x * x * (3.0 - 2.0 * x), moving * 3.0 * x * (1.0 - x), moving * 1.5 * (1.0 - 2.0 * x)]
}

/// The spline that is level at both ends and goes through points of a cubic that is level there is the cubic.
fn table() -> String {
    let points = [0.0, 0.5, 1.25, 2.0].map(|t: f64| format!("[{t}, {}]", ramp(t)[0])).join(", ");
    format!(r#""tables": {{"ramp": [{points}]}},"#)
}

fn assert_swung(text: &str, law: &Given, on_cart: bool, request: &Request, bound: f64) {
    let outcome = run(&scene(text), request);
    let name = format!("{:?} {:?} {text}", request.method, request.stabilize);
    assert!(outcome.stop.is_none(), "{name}: {:?}", outcome.stop);
    let expected = swung(law, on_cart);
    let error = [outcome.last.phi[1] - expected[0], outcome.last.omega[1] - expected[1]];
    assert!(error.iter().all(|error| error.abs() < bound), "{name}: {error:?}");
    assert!(outcome.drift.energy.max < 100.0 * bound, "{name}: {:e}", outcome.drift.energy.max);
}

#[test]
fn bars_on_motors_of_any_law_move_as_an_independent_integration_says() {
    let cases: [(&str, String, &Given); 3] = [
        ("0.6*tanh(2*(t - onset))*exp(-t/onset)", r#""parameters": {"onset": "1 s"},"#.into(), &smooth),
        ("if(t < 1, t^3/6, 1/6 + (t - 1)/2 + (t - 1)^2/2)", String::new(), &corner),
        ("ramp(t)", table(), &ramp),
    ];
    for (law, more, given) in cases {
        for on_cart in [false, true] {
            let text = carried(law, &more, on_cart);
            for request in methods() {
                assert_swung(&text, given, on_cart, &request, 2e-8);
            }
            for stabilize in [Stabilization::Projection, Stabilization::Baumgarte] {
                let request = Request { stabilize: Some(stabilize), ..adaptive(MethodId::Dp8, 1e-12) };
                assert_swung(&text, given, on_cart, &request, 1e-8);
            }
        }
    }
    for method in [MethodId::Gauss(8), MethodId::Rattle(Composition::KahanLi17)] {
        let text = carried("0.6*tanh(2*(t - 1))*exp(-t/(1 s))", "", false);
        let request = Request { method: Some(method), step: Some(1.0 / 256.0), ..Request::default() };
        assert_swung(&text, &smooth, false, &request, 1e-8);
    }
}

/// The same law by a sum of sines with its exact phase, and as a product that hides it.
#[test]
fn a_formula_and_a_sum_of_sines_move_alike_over_a_long_time() {
    let far = |law: &str| {
        let text = carried(law, "", false)
            .replace("\"until\": 3, \"every\": 0.25", "\"until\": 300, \"every\": 100");
        let request =
            Request { stabilize: Some(Stabilization::Elimination), ..adaptive(MethodId::Taylor, 1e-15) };
        run(&scene(&text.replace("-9.81", "0")), &request).last.phi
    };
    let [plain, hidden] = [far("2*t + 0.2*sin(3*t)"), far("exp(0*t)*(2*t + 0.2*sin(3*t))")];
    for (plain, hidden) in plain.iter().zip(&hidden) {
        assert!((plain - hidden).abs() < 1e-10, "{plain} {hidden}");
    }
}

#[test]
fn a_law_that_jumps_is_refused_where_it_does() {
    let text = carried("if(t < 1, 0, 0.1)", "", false);
    let outcome = run(&scene(&text), &adaptive(MethodId::Dp8, 1e-10));
    let stop = outcome.stop.expect("a stop");
    assert_eq!((stop.cause, stop.t), (Cause::Unsuited, 1.0), "{stop}");
    assert!(stop.what.contains("leaves constraint M violated by "), "{stop}");
}

#[test]
fn scenes_with_such_laws_are_written_as_they_were_read() {
    for (law, more) in
        [("0.6*tanh(2*(t - onset))", r#""parameters": {"onset": 1},"#.to_owned()), ("ramp(t)", table())]
    {
        let first = scene(&carried(law, &more, false));
        let again = parse_scene(&first.to_input().to_string(), "again", &[]).expect("a scene");
        assert_eq!(first, again);
    }
    let refusal =
        |law: &str| parse_scene(&carried(law, "", false), "test", &[]).expect_err("no scene").to_string();
    for (law, part) in [
        ("sqrt(t/(1 s))", "must have a finite value, rate and acceleration at t = 0"),
        ("tanh(rod.phi)", "unknown name rod.phi"),
        ("tanh(t/(1 s))*2 m", "m, not rad"),
    ] {
        let refusal = refusal(law);
        assert!(refusal.contains(part), "{law}: {refusal}");
    }
}

#[test]
fn tables_come_from_files_beside_the_scene() {
    let folder = std::env::temp_dir().join(format!("driftless-tables-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).expect("a file");
    let rows = |separator: &str| {
        let row = |t: &f64| format!("{t}{separator}{}\n", ramp(*t)[0]);
        [0.0, 0.5, 1.25, 2.0].iter().map(row).collect::<String>()
    };
    let inline = scene(&carried("ramp(t)", &table(), false));
    let wide: String = rows(",").lines().map(|line| format!("7,{line},x\n")).collect();
    for (name, text, said) in [
        ("plain.csv", rows(","), r#""plain.csv""#),
        ("blank.txt", format!("# seconds, radians\n\n{}", rows("  ")), r#""blank.txt""#),
        ("header.csv", format!("\u{feff}\"t\";\"phi\"\r\n{}", rows(";")), r#""header.csv""#),
        ("wide.csv", format!("no,t,phi,note\n{wide}"), r#"{"file": "wide.csv", "x": "t", "y": "phi"}"#),
        // A million points are longer than 16 MiB.
        ("long.csv", format!("#{}\n{}", " ".repeat(17 << 20), rows(",")), r#""long.csv""#),
    ] {
        write(name, &text);
        let more = format!(r#""tables": {{"ramp": {said}}},"#);
        write("scene.json", &carried("ramp(t)", &more, false));
        let read = read_scene(&folder.join("scene.json"), &[]).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(read, inline, "{name}");
    }
    for (text, said, part) in [
        ("0,0\n1,x\n", r#""bad.csv""#, "line 2, which is no pair of numbers"),
        ("0,0\n2,1\n1,2\n", r#""bad.csv""#, "line 3, whose x is not above the one before"),
        ("0,0,0\n", r#""bad.csv""#, "line 1, which has 3 columns"),
        ("a,b\n0,0\n1,1\n", r#"{"file": "bad.csv", "x": "a", "y": "c"}"#, "has no column c"),
        ("0,0\n", r#""bad.csv""#, "has 1 point in "),
        ("0,0\n", r#""none.csv""#, "cannot be read from"),
        ("0,0\n", r#"{"file": "bad.csv"}"#, "must be {name:"),
    ] {
        write("bad.csv", text);
        let more = format!(r#""tables": {{"ramp": {said}}},"#);
        write("scene.json", &carried("ramp(t)", &more, false));
        let error = read_scene(&folder.join("scene.json"), &[]).expect_err("no scene").to_string();
        assert!(error.contains(part) && error.contains("tables.ramp"), "{said}: {error}");
    }
    // What is too long is refused, not cut.
    let long = std::fs::File::create(folder.join("bad.csv")).expect("a file");
    long.set_len((256 << 20) + 1).expect("room");
    write("scene.json", &carried("ramp(t)", r#""tables": {"ramp": "bad.csv"},"#, false));
    let error = read_scene(&folder.join("scene.json"), &[]).expect_err("no scene").to_string();
    assert!(error.contains("bad.csv, which is longer than 256 MiB"), "{error}");
    std::fs::remove_dir_all(&folder).expect("removed");
}

/// A corner at the very start: the first row has what comes after it, as rows at corners later on.
#[test]
fn the_first_row_is_on_the_side_of_a_corner_that_the_motion_goes_to() {
    let turning = |motor: &str, torque: &str, start: &str, output: &str| {
        format!(
            r#"{{"name": "turning", "gravity": [0, 0],
            "bars": [{{"name": "b", "mass": 1, "centre": [0, 0], "inertia": 0.5, "length": 1}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b", "point": [0, 0]}}]}}],
            {motor} {torque} "start": {{{start}}}, "outputs": {{"seen": "{output}"}}, "until": 1, "every": 0.25}}"#
        )
    };
    let motor = |law: &str| format!(r#""motors": [{{"name": "M", "body": "b", "law": "{law}"}}],"#);
    let torque = |law: &str| format!(r#""torques": [{{"name": "T", "body": "b", "torque": "{law}"}}],"#);
    let moving = |omega: f64| format!(r#""b": {{"phi": 0, "omega": {omega}}}"#);
    let at_rest = moving(0.0);
    for (text, first) in [
        (turning(&motor("max(t/(1 s), 0)^2"), "", "", "M.torque"), 1.0),
        (turning(&motor("3*max(t/(1 s), 0)"), "", "", "b.omega"), 3.0),
        (turning("", &torque("if(t > 0, 3, 1)"), &at_rest, "b.alpha"), 6.0),
        (turning("", &torque("if(t < 0, 3, 1)"), &at_rest, "b.alpha"), 2.0),
        (turning("", &torque("if(b.phi > 0, 3, 1)"), &moving(1.0), "b.alpha"), 6.0),
        (turning("", &torque("if(b.phi > 0, 3, 1)"), &moving(-1.0), "b.alpha"), 2.0),
        // At rest, by its accelerations.
        (turning("", &torque("if(b.phi > 0, 3, 1)"), &at_rest, "b.alpha"), 6.0),
        (turning("", &torque("if(b.omega > 0, 3, 1)"), &at_rest, "b.alpha"), 6.0),
        (turning("", &torque("if(b.phi > 0, -3, -1)"), &at_rest, "b.alpha"), -2.0),
    ] {
        for method in [MethodId::Taylor, MethodId::Dp8] {
            let mut seen = Vec::new();
            let scene = scene(&text);
            let outcome = simulate(&scene, &adaptive(method, 1e-11), &mut |sample| {
                seen.push(sample.outputs[0]);
                Ok(())
            })
            .expect("a plan");
            assert!(outcome.stop.is_none(), "{:?}", outcome.stop);
            assert!((seen[0] - first).abs() < 1e-12, "{text}: {seen:?}");
        }
    }
}
