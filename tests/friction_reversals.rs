//! Forces in hinges with dry friction that pass exactly through zero in motion, against closed forms: friction
//! goes as their size, which has a corner there.

use super::formulas::{adaptive, run, scene};
use driftless::run::{MethodId, Outcome};

/// How far a run may be from the truth, and its balance from zero.
const CLOSE: f64 = 1e-10;
/// Mass and moment of inertia of the disc, mass of the carriage, coefficient and radius of friction.
const DISC: [f64; 2] = [0.8, 0.02];
const CARRIAGE: f64 = 1.2;
const FRICTION: [f64; 2] = [0.3, 0.05];

/// A disc in a hinge at its centre of mass on a carriage that slides along `way`, with this start beside its angle
/// and with further parts.
fn carried(gravity: f64, [way, start]: [&str; 2], omega: f64, until: f64, more: &str) -> String {
    let ([mass, inertia], [mu, radius]) = (DISC, FRICTION);
    format!(
        r#"{{"name": "carried", "gravity": [0, -{gravity}],
        "bars": [{{"name": "carriage", "mass": {CARRIAGE}, "centre": [0, 0], "inertia": 0.01, "length": 0.1}},
            {{"name": "disc", "mass": {mass}, "centre": [0, 0], "inertia": {inertia}, "length": 0.1}}],
        "hinges": [{{"name": "A", "between": [{{"body": "carriage", "point": [0, 0]}}, {{"body": "disc", "point": [0, 0]}}],
            "friction": {{"radius": {radius}, "kinetic": {mu}}}}}],
        "sliders": [{{"name": "guide", "point": {{"body": "carriage", "point": [0, 0]}},
            "rail": {{"body": "ground", "point": [0, 0], "direction": {way}}}, "angle": "locked"}}],
        {more}, "start": {{"carriage": {{"phi": 0, "omega": 0{start}}}, "disc": {{"phi": 0, "omega": {omega}}}}}, "until": {until}, "every": {until}}}"#
    )
}

fn runs(text: &str) -> Vec<(String, Outcome)> {
    let scene = scene(text);
    [
        adaptive(MethodId::Taylor, 1e-14),
        adaptive(MethodId::Taylor, 1e-16),
        adaptive(MethodId::Dp8, 1e-14),
        adaptive(MethodId::Radau(5), 1e-14),
    ]
    .into_iter()
    .map(|request| {
        let outcome = run(&scene, &request);
        let name = format!("{} at {:e}", request.method.expect("a method"), request.rtol.unwrap_or_default());
        assert!(outcome.stop.is_none(), "{name}: {:?}", outcome.stop);
        assert!(outcome.drift.energy.max < CLOSE, "{name}: {:e}", outcome.drift.energy.max);
        (name, outcome)
    })
    .collect()
}

/// Angle and rate of the disc under -c |n|, of which `integrals` are the first and second one and `zeros` the
/// zeros, in order.
fn slowed(c: f64, integrals: impl Fn(f64) -> [f64; 2], zeros: &[f64], omega: f64, until: f64) -> [f64; 2] {
    let (mut phi, mut omega, mut from) = (0.0, omega, 0.0);
    for to in zeros.iter().copied().chain([until]) {
        let ([first, second], [next, last]) = (integrals(from), integrals(to));
        let sign = (next - first).signum();
        phi += omega * (to - from) - c * sign * (last - second - first * (to - from));
        omega -= c * sign * (next - first);
        from = to;
    }
    [phi, omega]
}

fn assert_slowed(text: &str, [phi, omega]: [f64; 2], most_steps: u64) {
    for (name, outcome) in runs(text) {
        let off = [outcome.last.phi[1] - phi, outcome.last.omega[1] - omega];
        println!("{name}: {} steps, off by {off:?}", outcome.statistics.steps);
        assert!(off[0].abs().max(off[1].abs()) < CLOSE, "{name}: {off:?}");
        if name.starts_with("taylor") {
            assert!(outcome.statistics.steps < most_steps, "{name}: {} steps", outcome.statistics.steps);
        }
    }
}

/// Shaken along its weight by more than that: N = m (g - A w² sin w t), 19 times zero.
#[test]
fn a_disc_on_a_shaken_carriage_is_slowed_by_the_size_of_its_load() {
    let (g, amplitude, rate, until, start) = (9.81, 0.05, 20.0_f64, 3.0, 40.0);
    let ([mass, inertia], [mu, radius]) = (DISC, FRICTION);
    let first = (g / (amplitude * rate * rate)).asin();
    let mut zeros: Vec<f64> = (0..20)
        .flat_map(|k| {
            [first, std::f64::consts::PI - first].map(|at| at + std::f64::consts::TAU * f64::from(k))
        })
        .map(|phase| phase / rate)
        .filter(|&zero| zero < until)
        .collect();
    zeros.sort_by(f64::total_cmp);
    assert_eq!(zeros.len(), 20);
    let integrals = |t: f64| {
        [g * t + amplitude * rate * (rate * t).cos(), 0.5 * g * t * t + amplitude * (rate * t).sin()]
    };
    let expected = slowed(mu * radius * mass / inertia, integrals, &zeros, start, until);
    assert!(expected[1] > 1.0, "it never stops: {expected:?}");
    let shaker = r#""motors": [{"name": "shaker", "slider": "guide", "law": "0.05*sin(20*t)"}]"#;
    assert_slowed(&carried(g, ["[0, 1]", ""], start, until, shaker), expected, 200);
}

/// Pushed to and fro without weight, along no axis: N = m F / (M + m).
#[test]
fn a_disc_on_a_carriage_pushed_to_and_fro_is_slowed_by_the_size_of_the_push() {
    let (rate, until, start) = (4.0, 5.0, 40.0);
    let ([mass, inertia], [mu, radius]) = (DISC, FRICTION);
    let share = 25.0 * mass / (mass + CARRIAGE);
    let zeros: Vec<f64> = (0..20)
        .map(|k| (0.5 + f64::from(k)) * std::f64::consts::PI / rate)
        .filter(|&zero| zero < until)
        .collect();
    let integrals = |t: f64| [share * (rate * t).sin() / rate, -share * (rate * t).cos() / (rate * rate)];
    let expected = slowed(mu * radius / inertia, integrals, &zeros, start, until);
    assert!(expected[1] > 1.0, "it never stops: {expected:?}");
    let push = r#""forces": [{"name": "F", "body": "carriage", "point": [0, 0], "force": ["15*cos(4*t)", "20*cos(4*t)"]}]"#;
    let free = r#", "origin": [0, 0], "velocity": [0, 0]"#;
    assert_slowed(&carried(0.0, ["[3, 4]", free], start, until, push), expected, 120);
}

/// With a little weight aside the force turns round beside zero, however near: the corner becomes round as that of
/// a cone, and between what is told from zero and what is not there is no gap.
#[test]
fn forces_that_pass_beside_zero_are_taken_however_near() {
    let shaker = r#""motors": [{"name": "shaker", "slider": "guide", "law": "0.05*sin(20*t)"}]"#;
    for aside in [1e-3, 1e-6, 1e-8, 3e-10, 1e-12] {
        let text = carried(9.81, ["[0, 1]", ""], 40.0, 0.7, shaker);
        let scene = scene(&text.replace(r#""gravity": [0,"#, &format!(r#""gravity": [{aside},"#)));
        let [by_series, by_values] = [MethodId::Taylor, MethodId::Dp8].map(|method| {
            let outcome = run(&scene, &adaptive(method, 1e-14));
            assert!(outcome.stop.is_none(), "{aside:e}: {:?}", outcome.stop);
            [outcome.last.phi[1], outcome.last.omega[1]]
        });
        let off = [0, 1].map(|i| (by_series[i] - by_values[i]).abs());
        assert!(off[0].max(off[1]) < 2.0 * CLOSE, "{aside:e}: {off:?}");
    }
}

/// A crank that turns a slotted rocker, the only friction that of its pin in the slot: at every dead centre of the
/// travel the pin turns back while the linkage moves on, and no friction could hold it there.  With the crank's
/// angle q, the distance r of the pin from the rocker's pivot and the rocker's angle p(q):
///
/// ```text
/// N = J_r p'' / r,   J_c q'' + J_r p'' dp/dq + mu |N| |dr/dq| sign(q') = 0,   p'' = p_q q'' + p_qq q'²
/// ```
#[test]
fn a_pin_whose_travel_turns_back_does_not_stick_while_the_linkage_moves_on() {
    let ([a, d], [crank, rocker], mu) = ([0.2, 0.5], [0.2, 0.1], 0.2);
    let (start, omega, turns) = (0.3_f64, 9.0, 3.0);
    let acceleration = |q: f64, square: f64| {
        let distance = (a * a + d * d - 2.0 * a * d * q.cos()).sqrt();
        let (p, p_q) = (a * a - a * d * q.cos(), a * d * q.sin());
        let (square_r, square_r_q) = (distance * distance, 2.0 * a * d * q.sin());
        let (slope, bend) = (p / square_r, (p_q * square_r - p * square_r_q) / (square_r * square_r));
        let friction = mu * (a * d * q.sin() / distance).abs() / distance;
        // The sign of p'' that fits itself.
        let with = |sign: f64| {
            let lever = rocker * (slope + sign * friction);
            let q_2 = -lever * bend * square / (crank + lever * slope);
            (q_2, slope * q_2 + bend * square)
        };
        let (q_2, p_2) = with(1.0);
        if p_2 >= 0.0 { q_2 } else { with(-1.0).0 }
    };
    // d(q'²)/dq and dt/dq by the classical Runge-Kutta method, between the dead centres.
    let (mut q, mut square, mut t) = (start, omega * omega, 0.0);
    let end = start + turns * std::f64::consts::TAU;
    let centres = (1..=6).map(|k| f64::from(k) * std::f64::consts::PI);
    for to in centres.chain([end]) {
        let steps = 100_000;
        let h = (to - q) / f64::from(steps);
        let from = q;
        for k in 0..steps {
            let at = from + f64::from(k) * h;
            let rate = |q: f64, square: f64| [2.0 * acceleration(q, square), 1.0 / square.sqrt()];
            let k1 = rate(at, square);
            let k2 = rate(at + 0.5 * h, square + 0.5 * h * k1[0]);
            let k3 = rate(at + 0.5 * h, square + 0.5 * h * k2[0]);
            let k4 = rate(at + h, square + h * k3[0]);
            square += h / 6.0 * (k1[0] + 2.0 * k2[0] + 2.0 * k3[0] + k4[0]);
            t += h / 6.0 * (k1[1] + 2.0 * k2[1] + 2.0 * k3[1] + k4[1]);
        }
        q = to;
    }
    let angle = (a * start.sin()).atan2(a * start.cos() - d);
    let text = format!(
        r#"{{"name": "slot", "gravity": [0, 0],
        "bars": [{{"name": "crank", "mass": 1, "centre": [0, 0], "inertia": {crank}, "length": 0.2}},
            {{"name": "rocker", "mass": 2, "centre": [0, 0], "inertia": {rocker}, "length": 0.8}}],
        "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "crank", "point": [0, 0]}}]}},
            {{"name": "B", "between": [{{"body": "ground", "point": [{d}, 0]}}, {{"body": "rocker", "point": [0, 0]}}]}}],
        "sliders": [{{"name": "pin", "point": {{"body": "crank", "point": [{a}, 0]}},
            "rail": {{"body": "rocker", "point": [0, 0], "direction": [1, 0]}}, "friction": {{"kinetic": {mu}}}}}],
        "start": {{"crank": {{"phi": {start}, "omega": {omega}}}, "rocker": {{"phi": {angle}}}}}, "until": {t}, "every": {t}}}"#
    );
    for (name, outcome) in runs(&text) {
        let off = [outcome.last.phi[0] - end, outcome.last.omega[0] - square.sqrt()];
        println!("{name}: {} steps, off by {off:?}, rate {}", outcome.statistics.steps, square.sqrt());
        assert!(off[0].abs().max(off[1].abs()) < 1e-8, "{name}: {off:?}");
    }
}

/// The force across a piston's rail passes zero while the crank slides in its hinge: that other forces are large
/// beside it is no paradox, and series go on as the equations of the other methods do.
#[test]
fn a_piston_whose_rail_is_pressed_from_the_other_side_goes_on_beside_a_rough_hinge() {
    for torque in [11.0, 12.0, 14.0] {
        let text = format!(
            r#"{{"name": "piston", "gravity": [9.8125, 0],
            "bars": [{{"name": "b0", "mass": 2.4755859375, "centre": [0.072265625, 0], "inertia": 0.02685546875,
                    "length": 0.2890625}},
                {{"name": "b1", "mass": 1.31640625, "centre": [0.60205078125, 0], "inertia": 0.17333984375,
                    "length": 1.2041015625}},
                {{"name": "b2", "length": 0.25, "width": 0.0625, "thickness": 0.03125, "density": 512.0}}],
            "hinges": [{{"name": "h0", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "b0", "point": [0, 0]}}],
                    "friction": {{"radius": 0.0444, "kinetic": 0.5}}}},
                {{"name": "h1", "between": [{{"body": "b0", "point": [0.2890625, 0]}}, {{"body": "b1", "point": [0, 0]}}]}},
                {{"name": "h2", "between": [{{"body": "b1", "point": [1.2041015625, 0]}}, {{"body": "b2", "point": [0, 0]}}]}}],
            "sliders": [{{"name": "s0", "point": {{"body": "b2", "point": [0, 0]}}, "angle": "locked",
                "rail": {{"body": "ground", "point": [0, 0.029296875], "direction": [1, 0]}},
                "friction": {{"kinetic": 0.0859375}}}}],
            "start": {{"b0": {{"phi": 1.048828125, "omega": 1.5927734375}}, "b1": {{"phi": -0.1845703125}},
                "b2": {{"phi": 0}}}},
            "torques": [{{"name": "q", "body": "b0", "torque": {torque}}}], "until": 1, "every": 0.0625}}"#
        );
        let scene = scene(&text);
        let [series, steps] =
            [(MethodId::Taylor, 1e-10), (MethodId::Dp8, 1e-11)].map(|(method, tolerance)| {
                let outcome = run(&scene, &adaptive(method, tolerance));
                assert!(outcome.stop.is_none(), "{torque} by {method}: {:?}", outcome.stop);
                outcome.last
            });
        let apart = [series.phi[0] - steps.phi[0], series.friction - steps.friction];
        assert!(apart.iter().all(|apart| apart.abs() < 1e-8), "{torque}: {apart:?}");
    }
}
