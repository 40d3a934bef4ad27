//! Gauss collocation: measured order, drift at the rounding level, reversal, restart, refusals.
//!
//! The long measurements are `cargo test --release --test physics -- gauss:: --ignored --nocapture`.

use crate::common;

use common::{Inertia, LENGTH, ONE_TURN, compile, double_pendulum, free, motor, spring};
use driftless::arithmetic::{DoubleDouble, Scalar};
use driftless::dynamics::canonical::Canonical;
use driftless::dynamics::kernel::Kernel;
use driftless::dynamics::{Form, Mechanism, Motion, OdeSystem, Points, State, Time};
use driftless::scene::{Hinge, Place, Scene, Sine, Start};
use driftless::stepping::gauss::Gauss;
use driftless::stepping::{Cause, Integrator, Reached, Seen, Statistics, StepError};

/// A small swing about hanging.
fn gentle() -> Scene {
    double_pendulum(Inertia::Full, [(0.2, 0.0), (-0.1, 0.0)])
}

/// Free bars under a spring without damper.
fn sprung() -> Scene {
    let mut scene = free();
    scene.springs.push(spring(0.0));
    scene
}

/// Eight bars, each hinged to the end of the one before, released slightly bent.
fn chain8() -> Scene {
    let mut scene = gentle();
    let bar = scene.bars[0].clone();
    scene.bars = (1..=8).map(|k| driftless::scene::Bar { name: format!("bar{k}"), ..bar.clone() }).collect();
    scene.hinges = (0..8)
        .map(|k| Hinge {
            name: format!("hinge{k}"),
            between: [
                Place { bar: (k > 0).then(|| k - 1), point: [if k > 0 { LENGTH } else { 0.0 }, 0.0] },
                Place { bar: Some(k), point: [0.0, 0.0] },
            ],
        })
        .collect();
    scene.start = (0..8).map(|k| Start { phi: 0.5 - 0.1 * k as f64, omega: 0.0 }).collect();
    scene
}

/// Case e, the bars' rates equal.
fn driven() -> Scene {
    motor(Inertia::Slender, ONE_TURN)
}

/// Case e with a sine on top of the turning.
fn driven_by_a_sine() -> Scene {
    let mut scene = driven();
    scene.motors[0].law.sines.push(Sine { amplitude: 0.3, frequency: 3.0, phase: 0.0 });
    scene.start[0].omega += 0.9;
    scene
}

type Free2 = Canonical<2, false>;
type Driven2 = Canonical<2, true>;

fn gauss(stages: usize, step: f64) -> Gauss {
    Gauss::new(stages, step).expect("sound settings")
}

/// Integrates on to `until`.
fn integrate<F: OdeSystem + ?Sized>(
    method: &mut Gauss,
    problem: &mut F,
    state: &mut State,
    until: f64,
) -> Result<Statistics, StepError> {
    let mut statistics = Statistics::default();
    let reached =
        method.advance(problem, state, Time::of(until), &mut statistics, &mut |_, _| Ok(Seen::Kept))?;
    assert_eq!(reached, Reached::Until);
    Ok(statistics)
}

/// Energy less the work of motors, in double-double.
struct Balance {
    kernel: Kernel<DoubleDouble>,
    motion: Motion,
}

impl Balance {
    fn new(mechanism: &Mechanism) -> Self {
        Self { kernel: Kernel::without_rows(mechanism), motion: Motion::default() }
    }

    fn at(&mut self, form: &mut impl Form, state: &State) -> DoubleDouble {
        form.read(state, &mut self.motion);
        form.mechanism().energy(&mut self.kernel, &self.motion.phi, &self.motion.omega).total()
            - self.motion.work
    }
}

/// Largest excursion of the balance over its scale, and the slope \[1/s\] of a straight line through it,
/// sampled every `every` steps.
fn drift<F: OdeSystem + Form>(
    form: &mut F,
    method: &mut Gauss,
    state: &mut State,
    until: f64,
    every: usize,
) -> (f64, f64) {
    let mut balance = Balance::new(form.mechanism());
    let scale = form.mechanism().energy_scale;
    let start = balance.at(form, state);
    let (mut samples, mut count) = (Vec::new(), 0);
    let mut watch = |form: &mut F, state: &mut State| {
        count += 1;
        if count % every == 0 {
            samples.push((state.time.hi, (balance.at(form, state) - start).hi / scale));
        }
        Ok(Seen::Kept)
    };
    method
        .advance(form, state, Time::of(until), &mut Statistics::default(), &mut watch)
        .expect("a finished integrate");
    (samples.iter().fold(0.0, |worst: f64, sample| worst.max(sample.1.abs())), slope(&samples))
}

/// Slope of the straight line fitted to points.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / n, y + point.1 / n));
    let (up, down) = points
        .iter()
        .fold((0.0, 0.0), |(up, down), p| (up + (p.0 - x) * (p.1 - y), down + (p.0 - x) * (p.0 - x)));
    up / down
}

/// Order from the errors at 1 s: slope of the mean log error over `starts` on log step, for the six finest
/// steps above rounding.
///
/// One start will not do: along a sequence of steps its error crosses zero here and there.
fn measured_order<F: OdeSystem + Form>(form: &mut F, starts: &[State], stages: usize) -> f64 {
    let end = |form: &mut F, start: &State, steps: u32, stages: usize| {
        let mut state = start.clone();
        integrate(&mut gauss(stages, 1.0 / f64::from(steps)), form, &mut state, 1.0).expect("an integration");
        state
    };
    let references: Vec<State> = starts.iter().map(|start| end(form, start, 512, 8)).collect();
    let mut points = Vec::new();
    for steps in (0..36).map(|k| (24.0 * 2f64.powf(f64::from(k) / 6.0)).round() as u32) {
        let error = starts.iter().zip(&references).fold(0.0, |sum, (start, reference)| {
            let state = end(form, start, steps, stages);
            let part =
                |i: usize| (state.unknown(i) - reference.unknown(i)).hi / reference.y[i].abs().max(1e-2);
            sum + (0..state.y.len()).map(|i| part(i) * part(i)).sum::<f64>().sqrt().ln() / starts.len() as f64
        });
        if error > 5e-14f64.ln() {
            points.push((-f64::from(steps).ln(), error));
        }
    }
    slope(&points[points.len() - 6..])
}

#[test]
fn the_error_falls_with_the_declared_order() {
    let starts = |form: &dyn Fn(&Scene) -> State, scene: &Scene| -> Vec<State> {
        let start = |k: i32| {
            let mut scene = scene.clone();
            scene.start[1].phi += 0.05 * f64::from(k);
            form(&scene)
        };
        (0..4).map(start).collect()
    };
    let swing = double_pendulum(Inertia::Full, [(1.0, 0.0), (0.2, 0.0)]);
    let (mut free, mut driven) = (Free2::new(compile(&swing)), Driven2::new(compile(&driven_by_a_sine())));
    let free_starts = starts(&|scene| start_of(&free, scene), &swing);
    let driven_starts = starts(&|scene| start_of(&driven, scene), &driven_by_a_sine());
    // Orders of 10 and more show their slope below the rounding of doubles only: in double-double, beside the
    // coefficients.
    for stages in 2..=4 {
        let nominal = f64::from(Integrator::<Free2>::order(&gauss(stages, 0.1)));
        for found in [
            measured_order(&mut free, &free_starts, stages),
            measured_order(&mut driven, &driven_starts, stages),
        ] {
            println!("s = {stages}: {found:.2}");
            assert!((found - nominal).abs() < 0.35, "s = {stages}: order {found:.2} is not {nominal}");
        }
    }
}

/// The state in which a scene starts.
fn start_of(form: &impl Form, scene: &Scene) -> State {
    form.state(&form.mechanism().start(scene))
}

/// Where increments rounded to doubles ended the iteration, this climbed or fell by 2e-21 a second, by how
/// the constants happened to be rounded.
#[test]
fn a_gentle_swing_does_not_drift() {
    for step in [1.0 / 64.0, 1.0 / 32.0] {
        let mut form = Free2::new(compile(&gentle()));
        let mut state = start_of(&form, &gentle());
        let (worst, slope) = drift(&mut form, &mut gauss(8, step), &mut state, 500.0, 8);
        println!("gentle: {worst:.1e}, {slope:.1e} /s");
        assert!(worst < 1e-21 && slope.abs() < 1e-24);
    }
}

/// With a long step each sweep contracts little, and stages that have not settled drift linearly.  What is
/// left swings with the motion: the method's own error.
#[test]
fn a_long_step_does_not_drift_either() {
    let mut form = Free2::new(compile(&gentle()));
    let mut state = start_of(&form, &gentle());
    let (worst, slope) = drift(&mut form, &mut gauss(8, 1.0 / 16.0), &mut state, 2000.0, 8);
    println!("gentle: {worst:.1e}, {slope:.1e} /s");
    assert!(worst < 1e-16 && slope.abs() < 1e-22);
}

#[test]
fn a_wild_swing_does_not_drift_either() {
    let mut form = Free2::new(compile(&free()));
    let mut state = start_of(&form, &free());
    let (worst, slope) = drift(&mut form, &mut gauss(8, 1.0 / 128.0), &mut state, 500.0, 8);
    println!("free: {worst:.1e}, {slope:.1e} /s");
    assert!(worst < 3e-16 && slope.abs() < 5e-19);
}

#[test]
fn energy_less_work_does_not_drift_under_a_motor() {
    for scene in [driven(), driven_by_a_sine()] {
        let mut form = Driven2::new(compile(&scene));
        let mut state = start_of(&form, &scene);
        let (worst, slope) = drift(&mut form, &mut gauss(8, 1.0 / 128.0), &mut state, 100.0, 4);
        println!("motor: {worst:.1e}, {slope:.1e} /s");
        assert!(worst < 1e-16 && slope.abs() < 5e-19);
    }
}

#[test]
fn springs_and_long_chains_keep_their_energy() {
    let mut form = Free2::new(compile(&sprung()));
    let mut state = start_of(&form, &sprung());
    let (worst, _) = drift(&mut form, &mut gauss(8, 1.0 / 128.0), &mut state, 100.0, 4);
    println!("spring: {worst:.1e}");
    assert!(worst < 1e-16);

    let mut form = Canonical::<0, false>::new(compile(&chain8()));
    let mut state = start_of(&form, &chain8());
    let (worst, _) = drift(&mut form, &mut gauss(8, 1.0 / 256.0), &mut state, 10.0, 4);
    println!("chain8: {worst:.1e}");
    assert!(worst < 1e-17);
}

#[test]
fn a_reversed_march_returns_to_the_start() {
    let mut form = Free2::new(compile(&free()));
    let start = start_of(&form, &free());
    let (mut state, mut method) = (start.clone(), gauss(8, 1.0 / 128.0));
    integrate(&mut method, &mut form, &mut state, 4.0).expect("there");
    assert!((state.y[0] - start.y[0]).abs() > 0.1);
    integrate(&mut method, &mut form, &mut state, 0.0).expect("and back");
    assert_eq!(state.time, start.time);
    for i in 0..4 {
        let rest = (state.unknown(i) - start.unknown(i)).hi;
        println!("back at {rest:.1e}");
        assert!(rest.abs() < 1e-13);
    }
}

#[test]
fn a_restart_goes_on_bit_for_bit() {
    let mut form = Driven2::new(compile(&driven_by_a_sine()));
    let start = start_of(&form, &driven_by_a_sine());
    let mut through = start.clone();
    integrate(&mut gauss(6, 1.0 / 128.0), &mut form, &mut through, 4.0).expect("one integration");
    let mut parted = start.clone();
    integrate(&mut gauss(6, 1.0 / 128.0), &mut form, &mut parted, 1.25).expect("first part");
    let mut parted = parted.clone();
    integrate(&mut gauss(6, 1.0 / 128.0), &mut form, &mut parted, 4.0).expect("second part");
    assert_eq!(through, parted);
}

#[test]
fn a_changed_state_is_not_predicted_from_its_past() {
    let mut form = Free2::new(compile(&free()));
    let mut state = start_of(&form, &free());
    let mut method = gauss(8, 1.0 / 128.0);
    let mut jolt = |_: &mut Free2, state: &mut State| {
        assert!(!state.memory.is_empty());
        state.y[2] += 1e-3;
        Ok(Seen::Changed)
    };
    method
        .advance(&mut form, &mut state, Time::of(1.0 / 128.0), &mut Statistics::default(), &mut jolt)
        .expect("a jolt");
    assert!(state.memory.is_empty());

    // A memory of another step, another method or nonsense is not used either.
    let mut clean = state.clone();
    integrate(&mut method, &mut form, &mut clean, 1.0).expect("an integration");
    for memory in [vec![1.0 / 64.0; 33], vec![f64::NAN; 33], vec![1.0 / 128.0; 4], vec![1.0 / 128.0; 25]] {
        let mut other = State { memory, ..state.clone() };
        integrate(&mut method, &mut form, &mut other, 1.0).expect("an integration");
        assert_eq!(other, clean);
    }
}

#[test]
fn a_step_far_too_long_is_refused_with_its_time_and_the_unknown_at_fault() {
    let mut form = Free2::new(compile(&free()));
    for step in [0.125, 0.5, 4.0] {
        let mut state = start_of(&form, &free());
        let stop =
            integrate(&mut gauss(8, step), &mut form, &mut state, 40.0).expect_err("no step for this scene");
        assert!(matches!(stop.cause, Cause::NotConverged | Cause::NotFinite), "{stop}");
        assert!(stop.what.contains("bar1") || stop.what.contains("bar2"), "{stop}");
        assert!(
            stop.t == state.time.hi && state.y.iter().all(|y| y.is_finite()),
            "the last accepted state stays"
        );
        assert!(stop.hint.contains("halve"), "{stop}");
    }
}

#[test]
fn a_state_that_is_not_a_number_is_refused() {
    let mut form = Free2::new(compile(&free()));
    let mut state = start_of(&form, &free());
    state.y[1] = f64::NAN;
    let stop = integrate(&mut gauss(4, 0.01), &mut form, &mut state, 1.0).expect_err("not a number");
    assert_eq!(stop.cause, Cause::NotFinite);
    assert_eq!(stop.t, 0.0);
}

#[test]
fn a_mechanism_at_rest_is_left_alone() {
    // Gravity along the bars: the torques cancel to rounding only, which no sweep can bring down.
    let angle: f64 = 0.3;
    let mut scene = double_pendulum(Inertia::Full, [(angle, 0.0), (angle, 0.0)]);
    scene.gravity = [9.81 * angle.cos(), 9.81 * angle.sin()];
    let mut form = Free2::new(compile(&scene));
    let mut state = start_of(&form, &scene);
    integrate(&mut gauss(8, 1.0 / 64.0), &mut form, &mut state, 20.0).expect("rest");
    assert!((state.y[0] - angle).abs() < 1e-14 && (state.y[1] - angle).abs() < 1e-14);

    let hanging = double_pendulum(Inertia::Full, [(0.0, 0.0), (0.0, 0.0)]);
    let mut form = Free2::new(compile(&hanging));
    let mut state = start_of(&form, &hanging);
    let statistics = integrate(&mut gauss(8, 1.0 / 64.0), &mut form, &mut state, 1.0).expect("rest");
    assert_eq!(state.y, [0.0; 4]);
    assert_eq!(
        (statistics.steps, statistics.evaluations),
        (64, 64 * 16),
        "nothing moves: one sweep a step, and one exact evaluation"
    );
}

#[test]
fn a_remaining_time_that_is_no_whole_step_ends_in_a_shorter_one() {
    let mut form = Free2::new(compile(&gentle()));
    let mut state = start_of(&form, &gentle());
    let statistics = integrate(&mut gauss(8, 0.01), &mut form, &mut state, 1.005).expect("an integration");
    assert_eq!(statistics.steps, 101);
    assert!((state.time - Time::of(1.005)).hi.abs() < 1e-16);
    let mut fine = start_of(&form, &gentle());
    integrate(&mut gauss(8, 0.005), &mut form, &mut fine, 1.005).expect("an integration");
    assert!((0..4).all(|i| (state.unknown(i) - fine.unknown(i)).hi.abs() < 1e-14));
    // A decimal time whose doubles are a rounding off whole steps takes none.
    let mut state = start_of(&form, &gentle());
    assert_eq!(
        integrate(&mut gauss(8, 0.01), &mut form, &mut state, 100.0 * 0.07).expect("an integration").steps,
        700
    );
    assert_eq!(integrate(&mut gauss(8, 0.01), &mut form, &mut state, 7.0).expect("an integration").steps, 0);
}

/// A pendulum whose momentum is counted in units of 1/`unit`.
struct Scaled {
    unit: f64,
}

impl OdeSystem for Scaled {
    fn dimension(&self) -> usize {
        2
    }

    fn angles(&self) -> usize {
        0
    }

    fn rhs(&mut self, _t: Time, y: &[f64], rate: &mut [f64]) {
        rate[0] = y[1] / self.unit;
        rate[1] = -self.unit * libm::sin(y[0]);
    }

    fn label(&self, i: usize) -> String {
        ["angle", "momentum"][i].into()
    }
}

#[test]
fn the_unit_of_an_unknown_does_not_matter() {
    let march_in = |unit: f64| {
        let mut state = State::new(&[DoubleDouble::of(1.0), DoubleDouble::of(0.5 * unit)], 0);
        let statistics =
            integrate(&mut gauss(8, 0.125), &mut Scaled { unit }, &mut state, 50.0).expect("an integration");
        (state.unknown(0), state.unknown(1).ldexp(1.0 / unit), statistics)
    };
    let plain = march_in(1.0);
    for unit in [2f64.powi(-40), 2f64.powi(60)] {
        assert_eq!(march_in(unit), plain);
    }
}

#[test]
fn a_stiff_spring_converges_or_is_refused() {
    for factor in [1e2, 1e3, 1e4, 1e5, 1e6, 1e8] {
        let mut scene = gentle();
        scene.springs.push(spring(0.0));
        scene.springs[0].stiffness *= factor;
        let mut form = Free2::new(compile(&scene));
        let mut state = start_of(&form, &scene);
        match integrate(&mut gauss(8, 1.0 / 128.0), &mut form, &mut state, 1.0) {
            Ok(statistics) => {
                println!(
                    "spring x {factor:e}: {:.1} sweeps a step",
                    statistics.evaluations as f64 / statistics.steps as f64 / 8.0
                )
            }
            Err(stop) => {
                println!("spring x {factor:e}: {stop}");
                assert!(factor >= 1e3, "{stop}");
                assert!(matches!(stop.cause, Cause::NotConverged | Cause::NotFinite), "{stop}");
            }
        }
    }
}

/// Two bars under a motor of which the outer one carries a damped spring: drives, springs and dampers at
/// once.
fn everything() -> Scene {
    let mut scene = driven_by_a_sine();
    scene.springs.push(spring(0.05));
    scene
}

#[test]
fn hardware_and_portable_lanes_march_to_the_same_bits() {
    fn both<const N: usize, const WORK: bool>(scene: &Scene, stages: usize) {
        let mechanism = compile(scene);
        let march_in = |portable: bool| {
            let mut form = Canonical::<N, WORK>::with_lanes(mechanism.clone(), portable);
            let mut state = start_of(&form, scene);
            let method = gauss(stages, 1.0 / 128.0);
            let statistics =
                integrate(&mut if portable { method.portable() } else { method }, &mut form, &mut state, 1.0)
                    .expect("an integration");
            (state, statistics)
        };
        assert_eq!(march_in(false), march_in(true), "{}, s = {stages}", scene.name);
    }
    for stages in 2..=8 {
        both::<2, false>(&free(), stages);
    }
    both::<2, false>(&sprung(), 8);
    both::<2, true>(&driven(), 8);
    both::<2, true>(&everything(), 7);
    both::<0, true>(&everything(), 8);
    both::<0, false>(&chain8(), 8);
}

/// The canonical form one point at a time, as any field without lanes.
struct OneByOne<F>(F);

impl<F: OdeSystem> OdeSystem for OneByOne<F> {
    fn dimension(&self) -> usize {
        self.0.dimension()
    }

    fn angles(&self) -> usize {
        self.0.angles()
    }

    fn rhs(&mut self, t: Time, y: &[f64], rate: &mut [f64]) {
        self.0.rhs(t, y, rate);
    }

    fn label(&self, i: usize) -> String {
        self.0.label(i)
    }
}

#[test]
fn lanes_evaluate_what_a_single_point_does() {
    fn check<const N: usize, const WORK: bool>(scene: &Scene) {
        let mut form = Canonical::<N, WORK>::new(compile(scene));
        let d = form.dimension();
        let mut points = Points { used: [true; 8], ..Points::default() };
        points.resize(d);
        for lane in 0..8 {
            points.time[lane] = Time::of(0.3 * lane as f64);
            for k in 0..d {
                points.y[k].0[lane] = (0.7 * k as f64 - 0.4 * lane as f64).sin();
                points.low[k].0[lane] = 1e-17 * points.y[k].0[lane];
            }
        }
        let (mut lanes, mut exact, mut single) = (points.clone(), points.clone(), points);
        form.rates(&mut lanes);
        form.exact_rates(&mut exact);
        single.each(|t, y, rate| form.rhs(t, y, rate));
        for k in 0..d {
            for lane in 0..8 {
                let (plain, pair, alone) =
                    (lanes.rate[k].0[lane], exact.rate[k].0[lane], single.rate[k].0[lane]);
                let scale = single.rate.iter().fold(1.0, |scale: f64, rate| scale.max(rate.0[lane].abs()));
                assert!(
                    (plain - alone).abs() < 2e-14 * scale && (pair - alone).abs() < 2e-14 * scale,
                    "{}: {k} in lane {lane}",
                    scene.name
                );
            }
        }
    }
    check::<2, false>(&free());
    check::<2, false>(&sprung());
    check::<2, true>(&driven());
    check::<2, true>(&everything());
    check::<0, false>(&chain8());
}

#[test]
fn a_field_without_lanes_marches_all_the_same() {
    let mut form = Free2::new(compile(&free()));
    let start = start_of(&form, &free());
    let (mut lanes, mut single) = (start.clone(), start);
    integrate(&mut gauss(8, 1.0 / 128.0), &mut form, &mut lanes, 1.0).expect("an integration");
    integrate(&mut gauss(8, 1.0 / 128.0), &mut OneByOne(form), &mut single, 1.0).expect("an integration");
    assert!((0..4).all(|i| (lanes.unknown(i) - single.unknown(i)).hi.abs() < 1e-13));
}

#[test]
fn names_and_settings() {
    for (stages, name) in
        (2..).zip(["gauss4", "gauss6", "gauss8", "gauss10", "gauss12", "gauss14", "gauss16"])
    {
        let method = Gauss::new(stages, -0.5).expect("a known number of stages");
        assert_eq!((Integrator::<Free2>::name(&method), method.stages(), method.step()), (name, stages, 0.5));
    }
    assert!(Gauss::new(1, 0.1).is_none() && Gauss::new(9, 0.1).is_none());
    assert!(
        Gauss::new(4, 0.0).is_none()
            && Gauss::new(4, f64::NAN).is_none()
            && Gauss::new(4, f64::INFINITY).is_none()
    );
}

#[test]
fn a_boxed_field_gives_the_same_bits() {
    let mut form = Free2::new(compile(&free()));
    let start = start_of(&form, &free());
    let (mut plain, mut boxed) = (start.clone(), start);
    integrate(&mut gauss(8, 1.0 / 128.0), &mut form, &mut plain, 1.0).expect("an integration");
    let mut field: Box<dyn OdeSystem> = Box::new(form);
    integrate(&mut gauss(8, 1.0 / 128.0), &mut *field, &mut boxed, 1.0).expect("an integration");
    assert_eq!(plain, boxed);
}

/// Two point masses of 1 kg on rods of 1 m, g = 9.8 m/s²: the double pendulum of Hairer, McLachlan,
/// Razakarivony (2008).
fn point_masses() -> Scene {
    let mut scene = double_pendulum(Inertia::Slender, [(1.1, 0.0), (0.0, 0.0)]);
    scene.gravity = [9.8, 0.0];
    for bar in &mut scene.bars {
        (bar.length, bar.mass, bar.centre, bar.inertia) = (1.0, 1.0, [1.0, 0.0], 0.0);
    }
    scene.hinges[1].between[0].point = [1.0, 0.0];
    scene
}

/// How energy errors grow over an ensemble.
struct Walk {
    rms: f64,
    /// The mean over its standard error.
    bias: f64,
    /// Of the rms as a power of time, and its standard error from the scatter over eight parts of the
    /// ensemble.
    exponent: (f64, f64),
}

/// Prints rms, mean and its standard error over perturbed starts of the energy error over `scale` at doubling
/// times; returns what they are at the last.
fn ensemble(
    title: &str,
    scene: &Scene,
    scale: f64,
    method: &Gauss,
    until: f64,
    runs: usize,
    prepare: &dyn Fn(&mut State, f64),
) -> Walk {
    const PARTS: usize = 8;
    let mut form = Free2::new(compile(scene));
    let marks: Vec<f64> = (0..7).rev().map(|k| until / 2f64.powi(k)).collect();
    let mut errors = vec![Vec::new(); marks.len()];
    let (mut statistics, clock) = (Statistics::default(), std::time::Instant::now());
    for run in 0..runs {
        let mut state = start_of(&form, scene);
        prepare(&mut state, run as f64);
        let mut balance = Balance::new(form.mechanism());
        let start = balance.at(&mut form, &state);
        let mut method = method.clone();
        for (mark, errors) in marks.iter().zip(&mut errors) {
            let part = integrate(&mut method, &mut form, &mut state, *mark).expect("an integration");
            (statistics.steps, statistics.evaluations) =
                (statistics.steps + part.steps, statistics.evaluations + part.evaluations);
            errors.push((balance.at(&mut form, &state) - start).hi / scale);
        }
    }
    let mean_of = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let scatter_of = |values: &[f64]| {
        let (n, mean) = (values.len() as f64, mean_of(values));
        (values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (n - 1.0) / n).sqrt()
    };
    let rms_of =
        |values: &[f64]| (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt();
    // Over every so many runs, from one of the first on.
    let exponent = |from: usize, every: usize| {
        let rms =
            |errors: &Vec<f64>| rms_of(&errors.iter().copied().skip(from).step_by(every).collect::<Vec<_>>());
        slope(
            &marks
                .iter()
                .zip(&errors)
                .map(|(mark, errors)| (mark.ln(), rms(errors).ln()))
                .collect::<Vec<_>>(),
        )
    };
    let parts: Vec<f64> = (0..PARTS).map(|part| exponent(part, PARTS)).collect();
    let mut walk = Walk { rms: 0.0, bias: 0.0, exponent: (exponent(0, 1), scatter_of(&parts)) };
    for (mark, errors) in marks.iter().zip(&errors) {
        let (rms, mean, scatter) = (rms_of(errors), mean_of(errors), scatter_of(errors));
        println!("{title} {mark:7} s: rms {rms:.2e}, mean {mean:+.1e} ± {scatter:.1e}");
        (walk.rms, walk.bias) = (rms, mean / scatter);
    }
    let (evaluations, time) = (
        statistics.evaluations as f64 / statistics.steps as f64,
        clock.elapsed().as_secs_f64() * 1e6 / statistics.steps as f64,
    );
    let (power, error) = walk.exponent;
    println!(
        "{title}: rms grows as t^({power:.3} ± {error:.3}); {evaluations:.1} evaluations and {time:.2} µs a step"
    );
    walk
}

/// 30 starts of 64 s: plain doubles walk at random, pairs stay where the method's own error is.
#[test]
fn a_small_ensemble_tells_pairs_from_doubles() {
    let rms = |method: &dyn Fn() -> Gauss| {
        let mut form = Free2::new(compile(&point_masses()));
        let errors = (0..30).map(|k| {
            let mut state = start_of(&form, &point_masses());
            perturb(&mut state, f64::from(k));
            let mut balance = Balance::new(form.mechanism());
            let start = balance.at(&mut form, &state);
            integrate(&mut method(), &mut form, &mut state, 64.0).expect("an integration");
            ((balance.at(&mut form, &state) - start).hi / 14.4).powi(2)
        });
        (errors.sum::<f64>() / 30.0).sqrt()
    };
    let (exact, plain) = (rms(&|| gauss(8, 1.0 / 64.0)), rms(&|| gauss(8, 1.0 / 64.0).plain()));
    println!("{exact:.2e}, plain {plain:.2e}");
    assert!(exact < 1e-19 && plain < 5e-16 && plain > 1000.0 * exact);
}

/// The start of the papers, and others a little off.
fn perturb(state: &mut State, k: f64) {
    (state.y[0], state.y[2], state.y[3]) = (1.1 + 1e-6 * k, 0.0, 2.7746);
}

#[test]
#[ignore = "minutes; prints figures"]
fn ensembles_follow_the_square_root_law() {
    let walks_at_random = |walk: &Walk| {
        let (power, error) = walk.exponent;
        walk.bias.abs() < 3.0 && (power - 0.5).abs() < 0.05 + 2.0 * error
    };
    // Energy at the start, about -14.4 J, as in the papers.
    let points = |title: &str, method: &Gauss, runs: usize| {
        ensemble(title, &point_masses(), 14.4, method, 4096.0, runs, &perturb)
    };
    let walk = points("point masses, plain", &gauss(8, 1.0 / 64.0).plain(), 100);
    assert!(walk.rms < 1.8e-15 && walk.bias.abs() < 2.0 && (walk.exponent.0 - 0.5).abs() < 0.05);
    // In pairs rounding shows below the method's own error, with shorter steps.
    assert!(points("point masses", &gauss(8, 1.0 / 64.0), 16).rms < 5e-18);
    let walk = points("point masses, 1/128", &gauss(8, 1.0 / 128.0), 32);
    assert!(walk.rms < 1e-19 && walks_at_random(&walk));
    let scale = compile(&free()).energy_scale;
    let walk = ensemble("free, 1/512", &free(), scale, &gauss(8, 1.0 / 512.0), 4096.0, 16, &|state, k| {
        state.y[0] += 1e-3 * k;
        state.y[1] -= 7e-4 * k;
    });
    assert!(walk.rms < 1e-19 && walks_at_random(&walk));
    let scale = compile(&gentle()).energy_scale;
    let walk = ensemble("gentle, 1/32", &gentle(), scale, &gauss(8, 1.0 / 32.0), 16_384.0, 8, &|state, k| {
        state.y[0] += 1e-3 * k
    });
    assert!(walk.rms < 1e-20);
    // E - W of the motor over single runs.
    for (name, scene) in [("motor", driven()), ("motor with a sine", driven_by_a_sine())] {
        let mut form = Driven2::new(compile(&scene));
        let mut state = start_of(&form, &scene);
        let (worst, slope) = drift(&mut form, &mut gauss(8, 1.0 / 128.0), &mut state, 4096.0, 64);
        println!("{name}: {worst:.1e} in 4096 s, {slope:.1e} /s");
        assert!(worst < 1e-15);
    }
}
