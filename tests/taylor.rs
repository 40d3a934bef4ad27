//! The power series of the motion: against Dormand–Prince, against itself in double-double, at symmetric
//! releases.

use crate::common;

use common::{ONE_TURN, compile, shipped};
use driftless::arithmetic::{Complex, DoubleDouble};
use driftless::dynamics::constraint::ConstraintArguments;
use driftless::dynamics::elimination::Elimination;
use driftless::dynamics::kernel::Kernel as Energies;
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::{Form, Mechanism, Motion, State, Time};
use driftless::run::{Limits, MethodId, Outcome, Plan, Problem, Request, Run, Sample, integrate};
use driftless::scene::{Bar, Hinge, Place, Scene, Sine, Spring, Start};
use driftless::stabilization::Projected;
use driftless::stepping::taylor::ExpansionKernel;
use driftless::stepping::taylor::batch::{Batch, BatchMember, Going};
use driftless::stepping::{Dp8, Integrator, Reached, Seen, Statistics, Taylor, Tolerance};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

pub fn end(scene: &Scene, mut method: impl Integrator<dyn Problem>, until: f64) -> Motion {
    let mechanism = compile(scene);
    let mut problem = Elimination::<0>::new(mechanism.clone());
    let mut state = problem.state(&mechanism.start(scene));
    let mut statistics = Default::default();
    method
        .advance(&mut problem, &mut state, Time::from(until), &mut statistics, &mut |_, _| Ok(Seen::Kept))
        .expect("an end");
    let mut motion = Motion::default();
    problem.read(&state, &mut motion);
    motion
}

pub fn distance(a: &Motion, b: &Motion) -> f64 {
    let parts = |m: &Motion| (0..m.phi.len()).flat_map(|k| [m.phi[k], m.omega[k]]).collect::<Vec<_>>();
    let angles = parts(a).into_iter().zip(parts(b)).map(|(a, b)| (a - b).hi.abs()).fold(0.0, f64::max);
    angles.max((a.work - b.work).hi.abs())
}

#[test]
fn the_series_agrees_with_dormand_prince() {
    let damped = ["springs.spring.damping=0.3"];
    let cases: [(&str, &[&str], f64); 7] = [
        ("free", &[], 3.0),
        ("gentle", &[], 5.0),
        ("spring", &[], 3.0),
        ("spring", &damped, 3.0),
        ("motor", &[], 3.0),
        ("motor_sine", &[], 3.0),
        ("branch", &[], 1.0),
    ];
    for (name, overrides, until) in cases {
        let scene = shipped(name, overrides);
        let series = end(&scene, Taylor::new(Tolerance { relative: 1e-16, absolute: 1e-16 }), until);
        let explicit = end(&scene, Dp8::new(Tolerance { relative: 1e-14, absolute: 1e-14 }), until);
        let apart = distance(&series, &explicit);
        assert!(apart < 1e-10, "{name}: {apart:e}");
    }
}

#[test]
fn double_double_agrees_with_itself_at_another_order() {
    for name in ["free", "motor_sine", "spring"] {
        let scene = shipped(name, &[]);
        let reference = end(&scene, Taylor::reference(), 2.0);
        let other = end(&scene, Taylor::<DoubleDouble>::with_order(1e-33, 36), 2.0);
        let plain = end(&scene, Taylor::new(Tolerance { relative: 1e-17, absolute: 1e-17 }), 2.0);
        assert!(distance(&reference, &other) < 1e-26, "{name}: {:e}", distance(&reference, &other));
        assert!(distance(&reference, &plain) < 1e-12, "{name}: {:e}", distance(&reference, &plain));
    }
}

/// The method at a tolerance and order on one kind of code.
pub fn on(kernel: ExpansionKernel, tolerance: f64, order: usize) -> Taylor<f64> {
    let mut method = Taylor::with_order(tolerance, order);
    method.kernel = kernel;
    method
}

/// The method with its first orders in double-double.
fn extended(kernel: ExpansionKernel, tolerance: f64) -> Taylor<f64> {
    let mut method = on(kernel, tolerance, 24);
    method.extended = true;
    method
}

/// Scenes whose first orders have a kernel in double-double.
fn extended_scenes() -> Vec<(&'static str, Scene)> {
    fast_scenes()
        .into_iter()
        .filter(|(name, _)| ["free", "gentle", "spinning", "sideways", "single"].contains(name))
        .collect()
}

/// Scenes the fast kernels take.
fn fast_scenes() -> Vec<(&'static str, Scene)> {
    let mut sideways = shipped("free", &[]);
    sideways.gravity = [3.0, -9.0];
    let mut second = shipped("motor", &[]);
    second.motors[0].bar = 1;
    let mut backwards = shipped("motor", &[]);
    backwards.motors[0].law.rate = -4.0;
    backwards.start[0].omega = -4.0;
    backwards.gravity = [3.0, -9.0];
    let mut swung = second.clone();
    swung.gravity = [3.0, -9.0];
    swung.motors[0].law.sines = vec![
        Sine { amplitude: 0.4, frequency: 3.0, phase: 0.5 },
        Sine { amplitude: -0.2, frequency: 7.0, phase: -1.0 },
    ];
    let mut three = shipped("chain8", &[]);
    let (mut single, mut six) = (three.clone(), three.clone());
    for (scene, count) in [(&mut single, 1), (&mut three, 3), (&mut six, 6)] {
        scene.bars.truncate(count);
        scene.hinges.truncate(count);
        scene.start.truncate(count);
    }
    let mut damped = shipped("spring", &["springs.spring.damping=0.3"]);
    damped.springs[0].stiffness *= 4.0;
    // From the ground to every bar, between bars, across, and one without length that lets its ends meet.
    let mut sprung = six.clone();
    for (name, ends, stiffness, free_length, damping) in [
        ("down", [(None, [0.3, 0.1]), (Some(0), [0.2, 0.05])], 3.0, 0.2, 0.0),
        ("along", [(Some(0), [0.3, 0.0]), (Some(1), [0.3, -0.1])], 2.0, 0.5, 0.1),
        ("meeting", [(None, [0.0, 0.0]), (Some(0), [0.0, 0.0])], 5.0, 0.0, 0.0),
        ("dashpot", [(None, [-0.5, 1.0]), (Some(0), [0.3, 0.0])], 0.0, 0.0, 0.2),
    ] {
        let between = ends.map(|(bar, point)| Place { bar, point });
        sprung.springs.push(Spring {
            name: name.into(),
            between,
            stiffness,
            free_length,
            damping,
            ..shipped("spring", &[]).springs.remove(0)
        });
    }
    let mut hung = sprung.clone();
    hung.bars.truncate(1);
    hung.hinges.truncate(1);
    hung.start.truncate(1);
    hung.springs.retain(|spring| ["down", "meeting"].contains(&spring.name.as_str()));
    let names = ["free", "gentle", "spinning", "motor", "motor_sine", "chain8", "spring"];
    let others = [
        ("swung", swung),
        ("sideways", sideways),
        ("second", second),
        ("backwards", backwards),
        ("single", single),
        ("three", three),
        ("six", six),
        ("damped", damped),
        ("sprung", sprung),
        ("hung", hung),
    ];
    names.map(|name| (name, shipped(name, &[]))).into_iter().chain(others).collect()
}

#[test]
fn fast_kernels_agree_with_the_series_and_with_double_double() {
    for (name, scene) in fast_scenes() {
        let exact = end(&scene, Taylor::reference(), 2.0);
        for order in [16, 20, 24] {
            let series = end(&scene, on(ExpansionKernel::Series, 1e-17, order), 2.0);
            let fast = end(&scene, on(ExpansionKernel::Fastest, 1e-17, order), 2.0);
            assert_ne!(series, fast, "{name}: the fast kernel was not entered");
            let (apart, error) = (distance(&series, &fast), distance(&exact, &fast));
            assert!(apart < 2e-13 && error < 1e-13, "{name}, order {order}: {apart:e}, {error:e}");
        }
    }
}

#[test]
fn the_error_falls_with_the_tolerance() {
    for (name, scene) in fast_scenes() {
        let exact = end(&scene, Taylor::reference(), 3.0);
        let error =
            |tolerance| distance(&exact, &end(&scene, on(ExpansionKernel::Fastest, tolerance, 20), 3.0));
        let errors = [error(1e-6), error(1e-9), error(1e-12)];
        assert!(
            errors[0] > 1e-9 && errors[0] < 1e-3 && errors[1] < 1e-5 && errors[2] < 1e-9,
            "{name}: {errors:?}"
        );
    }
}

#[test]
fn portable_lanes_and_hardware_have_the_same_bits() {
    for (name, scene) in fast_scenes() {
        for order in [16, 20, 24] {
            let (fast, portable) = (
                end(&scene, on(ExpansionKernel::Fastest, 1e-13, order), 2.0),
                end(&scene, on(ExpansionKernel::Portable, 1e-13, order), 2.0),
            );
            assert_eq!(fast, portable, "{name}, order {order}");
        }
    }
}

/// Motors with sines have one code in lanes and alone.
#[test]
fn a_motor_with_sines_has_the_same_bits_alone_and_in_lanes() {
    let mut count = 0;
    for (name, scene) in fast_scenes().into_iter().filter(|(name, _)| ["motor_sine", "swung"].contains(name))
    {
        for order in [16, 20, 24] {
            let mechanism = compile(&scene);
            let mut problem = Elimination::<0>::new(mechanism.clone());
            let mut member = [BatchMember::new(&mechanism, problem.state(&mechanism.start(&scene)))];
            let batch = Batch::new(Tolerance { relative: 1e-12, absolute: 1e-12 }).with_order(order);
            batch.integrate(&mut member, Time::from(20.0), &mut |_, _| Going::On);
            let mut motion = Motion::default();
            problem.read(&member[0].state, &mut motion);
            assert_eq!(
                end(&scene, on(ExpansionKernel::Fastest, 1e-12, order), 20.0),
                motion,
                "{name}, order {order}"
            );
            count += 1;
        }
    }
    assert_eq!(count, 6);
}

#[test]
fn orders_in_double_double_leave_only_what_later_ones_round() {
    for (name, scene) in extended_scenes() {
        let exact = end(&scene, Taylor::reference(), 2.0);
        let plain = distance(&exact, &end(&scene, on(ExpansionKernel::Fastest, 1e-22, 24), 2.0));
        let found = end(&scene, extended(ExpansionKernel::Fastest, 1e-22), 2.0);
        let error = distance(&exact, &found);
        assert!(error < 1e-17 && error < plain / 30.0, "{name}: {error:e}, plain {plain:e}");
        assert_eq!(found, end(&scene, extended(ExpansionKernel::Portable, 1e-22), 2.0), "{name}: lanes");
    }
}

#[test]
fn orders_in_double_double_keep_energy_a_thousand_times_closer() {
    let scene = shipped("free", &[]);
    let mechanism = compile(&scene);
    let mut kernel = Energies::<DoubleDouble>::without_rows(&mechanism);
    let mut energy = |motion: &Motion| mechanism.energy(&mut kernel, &motion.phi, &motion.omega).total();
    let before = energy(&mechanism.start(&scene));
    let after = energy(&end(&scene, extended(ExpansionKernel::Fastest, 1e-20), 1000.0));
    let drift = (after - before).hi.abs() / mechanism.energy_scale;
    assert!(drift < 1e-17, "{drift:e}");
}

#[test]
fn a_symmetric_release_takes_no_step_too_long() {
    // From rest only every fourth coefficient of the rates is not zero; the first step alone must keep its
    // accuracy.
    let scene = shipped("free", &[]);
    let mechanism = compile(&scene);
    for kernel in [ExpansionKernel::Fastest, ExpansionKernel::Series] {
        for order in [16, 20, 24] {
            let problem: &mut dyn Problem = &mut Elimination::<0>::new(mechanism.clone());
            let mut state = problem.state(&mechanism.start(&scene));
            let mut times = Vec::new();
            let mut watch = |_: &mut (dyn Problem + 'static), state: &mut State| {
                times.push(state.time);
                Ok(Seen::Kept)
            };
            on(kernel, 1e-12, order)
                .advance(problem, &mut state, Time::from(1.0), &mut Statistics::default(), &mut watch)
                .expect("an end");
            let after_one = end(&scene, on(kernel, 1e-12, order), times[0].hi);
            let exact = end(&scene, Taylor::reference(), times[0].hi);
            assert!(
                times[0].hi > 0.01 && distance(&after_one, &exact) < 1e-11,
                "{:e}",
                distance(&after_one, &exact)
            );
        }
    }
}

#[test]
fn hanging_at_rest_stays_to_the_last_bit() {
    let scene = shipped("hanging", &[]);
    let scene = Scene { springs: vec![], ..scene };
    let start = compile(&scene).start(&scene);
    let last = end(&scene, on(ExpansionKernel::Fastest, 1e-12, 20), 1e6);
    assert_eq!((last.phi, last.omega), (start.phi, start.omega));
}

#[test]
fn a_run_continued_from_a_stored_state_has_the_same_bits() {
    for (name, scene) in fast_scenes() {
        let mechanism = compile(&scene);
        let mut problem = Elimination::<0>::new(mechanism.clone());
        let integrate = |problem: &mut (dyn Problem + 'static),
                         state: &mut State,
                         method: &mut Taylor<f64>,
                         until: f64| {
            method
                .advance(problem, state, Time::from(until), &mut Statistics::default(), &mut |_, _| {
                    Ok(Seen::Kept)
                })
                .expect("an end");
        };
        let mut method = on(ExpansionKernel::Fastest, 1e-15, 20);
        let mut whole = problem.state(&mechanism.start(&scene));
        integrate(&mut problem, &mut whole, &mut method, 3.0);
        let mut stored = whole.clone();
        integrate(&mut problem, &mut whole, &mut method, 7.0);
        integrate(
            &mut Elimination::<0>::new(mechanism.clone()),
            &mut stored,
            &mut on(ExpansionKernel::Fastest, 1e-15, 20),
            7.0,
        );
        assert_eq!(whole, stored, "{name}");
    }
}

#[test]
fn energy_stays_at_rounding_for_a_thousand_seconds() {
    for name in ["free", "gentle", "motor", "motor_sine"] {
        let scene = shipped(name, &[]);
        let mechanism = compile(&scene);
        let mut kernel = Energies::<DoubleDouble>::without_rows(&mechanism);
        let mut balance = |motion: &Motion| {
            (mechanism.energy(&mut kernel, &motion.phi, &motion.omega).total() - motion.work).hi
        };
        let before = balance(&mechanism.start(&scene));
        let after = balance(&end(&scene, on(ExpansionKernel::Fastest, 1e-19, 24), 1000.0));
        let drift = (after - before).abs() / mechanism.energy_scale;
        assert!(drift < 5e-14, "{name}: {drift:e}");
    }
}

#[test]
fn numbers_out_of_range_are_a_typed_stop() {
    let scene = shipped("free", &["start.bar1.omega=1e30"]);
    let mechanism = compile(&scene);
    let problem: &mut dyn Problem = &mut Elimination::<0>::new(mechanism.clone());
    let mut state = problem.state(&mechanism.start(&scene));
    let stop = on(ExpansionKernel::Fastest, 1e-12, 20).advance(
        problem,
        &mut state,
        Time::from(1.0),
        &mut Statistics::default(),
        &mut |_, _| Ok(Seen::Kept),
    );
    assert!(stop.is_err());
}

/// A run by the program's own loop with rows every `every` \[s\], and its samples.
fn rows(scene: &Scene, every: f64, until: f64) -> (Outcome, Vec<Sample>) {
    let mechanism = compile(scene);
    let request = Request {
        method: Some(MethodId::Taylor),
        rtol: Some(1e-15),
        until: Some(until),
        every: Some(every),
        ..Request::default()
    };
    let plan = Plan::new(scene, &mechanism, &request).expect("a sensible pairing");
    let start = mechanism.start(scene);
    let mut samples = Vec::new();
    let run = Run::new(mechanism, plan, Limits::default(), &start).expect("a beginning");
    let outcome = integrate(run, &mut |sample| {
        samples.push(sample.clone());
        Ok(())
    });
    (outcome.expect("no observer fails"), samples)
}

#[test]
fn the_end_has_the_same_bits_whatever_the_output_interval() {
    let mut scenes = fast_scenes();
    scenes.extend(["spring", "motor_sine", "branch"].map(|name| (name, shipped(name, &[]))));
    for (name, scene) in scenes {
        let [fine, odd, coarse] = [0.001, 0.037, 2.0].map(|every| rows(&scene, every, 2.0).0);
        for other in [odd, coarse] {
            assert_eq!((&fine.last, fine.statistics), (&other.last, other.statistics), "{name}");
        }
    }
}

#[test]
fn rows_inside_a_step_are_as_exact_as_its_end() {
    let mut scenes = fast_scenes();
    scenes.extend(["motor_sine"].map(|name| (name, shipped(name, &[]))));
    for (name, scene) in scenes {
        let (outcome, samples) = rows(&scene, 0.01, 1.0);
        assert!(outcome.statistics.steps < 90, "{name}: steps are cut at the rows");
        for sample in samples.iter().skip(1).step_by(31) {
            let exact = end(&scene, Taylor::reference(), sample.t);
            for k in 0..sample.phi.len() {
                let apart = (exact.unwrapped(k) - sample.phi[k])
                    .abs()
                    .max((exact.omega[k].hi - sample.omega[k]).abs());
                assert!(apart < 1e-12, "{name} at {} s: {apart:e}", sample.t);
            }
            assert!((exact.work.hi - sample.work).abs() < 1e-12, "{name}");
        }
        // Between the steps' ends the balance is that of the polynomial, not of a rounded state.
        assert!(outcome.drift.energy.max < 5e-15, "{name}: {:e}", outcome.drift.energy.max);
    }
}

/// A four-bar of uniform slender bars under gravity along +x: crank and coupler from the origin, rocker from
/// (0, 0.9), not yet pinned to the coupler.
struct FourBar {
    length: [f64; 3],
    mass: [f64; 3],
}

impl FourBar {
    const GROUND: [f64; 2] = [0.0, 0.9];

    /// Angles of all bars at a crank angle, and their rates at crank rate one, from the triangle of coupler
    /// and rocker.
    fn configuration(&self, q: f64) -> ([f64; 3], [f64; 3]) {
        let [a, b, c] = self.length;
        let elbow = [a * q.cos(), a * q.sin()];
        let gap = [Self::GROUND[0] - elbow[0], Self::GROUND[1] - elbow[1]];
        let distance = gap[0].hypot(gap[1]);
        let coupler =
            gap[1].atan2(gap[0]) - ((b * b + distance * distance - c * c) / (2.0 * b * distance)).acos();
        let tip = [elbow[0] + b * coupler.cos(), elbow[1] + b * coupler.sin()];
        let rocker = (tip[1] - Self::GROUND[1]).atan2(tip[0] - Self::GROUND[0]);
        let across = (rocker - coupler).sin();
        (
            [q, coupler, rocker],
            [1.0, -a * (rocker - q).sin() / (b * across), -a * (coupler - q).sin() / (c * across)],
        )
    }

    /// Energy at crank rate one, half the effective inertia, and potential energy.
    fn energies(&self, q: f64) -> (f64, f64) {
        let (phi, rate) = self.configuration(q);
        let arm = |k: usize, share: f64| {
            [share * self.length[k] * phi[k].cos(), share * self.length[k] * phi[k].sin()]
        };
        let turned = |[x, y]: [f64; 2], w: f64| [-y * w, x * w];
        let add = |[x, y]: [f64; 2], [u, v]: [f64; 2]| [x + u, y + v];
        let centre = [arm(0, 0.5), add(arm(0, 1.0), arm(1, 0.5)), add(Self::GROUND, arm(2, 0.5))];
        let speed = [
            turned(arm(0, 0.5), rate[0]),
            add(turned(arm(0, 1.0), rate[0]), turned(arm(1, 0.5), rate[1])),
            turned(arm(2, 0.5), rate[2]),
        ];
        let mut sums = (0.0, 0.0);
        for k in 0..3 {
            let inertia = self.mass[k] * self.length[k] * self.length[k] / 12.0;
            sums.0 += 0.5 * self.mass[k] * (speed[k][0].powi(2) + speed[k][1].powi(2))
                + 0.5 * inertia * rate[k] * rate[k];
            sums.1 -= self.mass[k] * 9.81 * centre[k][0];
        }
        sums
    }

    /// Time from one crank angle to another: the integral of sqrt(T_1/(E - V)) by Gauss's rule of three
    /// points on many pieces.
    fn time(&self, from: f64, to: f64, energy: f64) -> f64 {
        let pieces = 4000;
        let width = (to - from) / f64::from(pieces);
        let slowness = |q: f64| {
            let (kinetic, potential) = self.energies(q);
            (kinetic / (energy - potential)).sqrt()
        };
        let offset = 0.5 * 0.6_f64.sqrt() * width;
        let piece = |i: i32| {
            let middle = from + (f64::from(i) + 0.5) * width;
            width
                * (5.0 * slowness(middle - offset) + 8.0 * slowness(middle) + 5.0 * slowness(middle + offset))
                / 18.0
        };
        (0..pieces).map(piece).sum()
    }

    /// The mechanism with its loop closed, and its motion at a crank angle and rate.
    fn mechanism(&self, q: f64, rate: f64) -> (Arc<Mechanism>, Motion) {
        let mut scene = common::pendulum(0.0, 0.0);
        scene.gravity = [9.81, 0.0];
        let (phi, rates) = self.configuration(q);
        scene.bars.clear();
        scene.hinges.clear();
        scene.start.clear();
        let origin_point = [(None, [0.0, 0.0]), (Some(0), [self.length[0], 0.0]), (None, Self::GROUND)];
        for k in 0..3 {
            let (length, mass) = (self.length[k], self.mass[k]);
            let inertia = mass * length * length / 12.0;
            scene.bars.push(Bar {
                name: format!("bar{k}"),
                length,
                mass,
                centre: [0.5 * length, 0.0],
                inertia,
            });
            let between = [
                Place { bar: origin_point[k].0, point: origin_point[k].1 },
                Place { bar: Some(k), point: [0.0, 0.0] },
            ];
            scene.hinges.push(Hinge { name: format!("hinge{k}"), between });
            scene.start.push(Start { phi: phi[k], omega: rate * rates[k] });
        }
        let tree = Mechanism::new(&scene).expect("a valid scene");
        let [coupler, rocker] = [1, 2].map(|k| tree.end(k, 1));
        let start = tree.start(&scene);
        (Arc::new(tree.pinned("loop", &coupler, &rocker)), start)
    }
}

const FOUR_BAR: FourBar = FourBar { length: [0.3, 1.0, 0.8], mass: [0.5, 1.2, 0.9] };

/// Integrates a mechanism by multipliers.
fn bordered(
    mechanism: &Arc<Mechanism>,
    start: &Motion,
    mut method: impl Integrator<dyn Problem>,
    until: f64,
) -> Motion {
    let mut form = Multiplier::<0, true>::new(Arc::clone(mechanism));
    let mut state = form.state(start);
    method
        .advance(&mut form, &mut state, Time::from(until), &mut Statistics::default(), &mut |_, _| {
            Ok(Seen::Kept)
        })
        .expect("an end");
    let mut motion = Motion::default();
    form.read(&state, &mut motion);
    motion
}

/// Largest distance of the pinned points \[m\], and of their velocities \[m/s\].
fn opening(mechanism: &Mechanism, motion: &Motion) -> [f64; 2] {
    let z: Vec<_> = motion.phi.iter().map(|&phi| Complex::unit(phi)).collect();
    let mut worst = [0.0_f64; 2];
    for row in &mechanism.constraints {
        let mut jacobian = vec![DoubleDouble::default(); z.len()];
        let here = row.linearise(
            motion.time,
            ConstraintArguments { phi: &motion.phi, z: &z, omega: &motion.omega },
            &mut jacobian,
        );
        let rate = jacobian.iter().zip(&motion.omega).fold(here.drive, |sum, (&g, &w)| sum + g * w);
        worst = [worst[0].max(here.position.hi.abs()), worst[1].max(rate.hi.abs())];
    }
    worst
}

#[test]
fn a_closed_loop_keeps_time_with_its_one_degree_of_freedom() {
    let rate = 12.0;
    let (mechanism, start) = FOUR_BAR.mechanism(0.4, rate);
    let (kinetic, potential) = FOUR_BAR.energies(0.4);
    let energy = kinetic * rate * rate + potential;
    let until = 2.0;
    for tolerance in [1e-13, 1e-16] {
        let mut method = Projected::new(Taylor::<f64>::with_order(tolerance, 24));
        method.tolerance = 1e-13;
        let last = bordered(&mechanism, &start, method, until);
        // About two turns of the crank, by quadrature.
        let crank = last.unwrapped(0);
        assert!(crank > 9.0, "{crank}");
        let time = FOUR_BAR.time(0.4, crank, energy);
        assert!((time - until).abs() < 2e-12, "{:e} s off", time - until);
        let (phi, rates) = FOUR_BAR.configuration(crank);
        for k in 0..3 {
            assert!(
                (Complex::unit(phi[k]) - Complex::unit(last.phi[k].hi)).norm_squared().sqrt() < 1e-13,
                "bar {k}"
            );
            assert!((rates[k] * last.omega[0].hi - last.omega[k].hi).abs() < 1e-12, "bar {k}");
        }
        let [position, velocity] = opening(&mechanism, &last);
        assert!(position < 1e-15 && velocity < 1e-14, "{position:e} m, {velocity:e} m/s");
    }
}

#[test]
fn a_closed_loop_in_double_double_is_the_limit_of_plain_ones() {
    let (mechanism, start) = FOUR_BAR.mechanism(0.4, 12.0);
    let reference = bordered(&mechanism, &start, Taylor::reference(), 0.5);
    let other = bordered(&mechanism, &start, Taylor::<DoubleDouble>::with_order(1e-33, 36), 0.5);
    assert!(distance(&reference, &other) < 1e-26, "{:e}", distance(&reference, &other));
    let error = |tolerance| {
        distance(&reference, &bordered(&mechanism, &start, Taylor::<f64>::with_order(tolerance, 20), 0.5))
    };
    let errors = [error(1e-6), error(1e-9), error(1e-12), error(1e-17)];
    assert!(
        errors[0] > 1e-9 && errors[0] < 1e-3 && errors[1] < 1e-6 && errors[2] < 1e-9 && errors[3] < 1e-13,
        "{errors:?}"
    );
}

#[test]
fn motors_by_multipliers_move_as_eliminated_ones() {
    let mut relative = shipped("motor_sine", &[]);
    relative.motors[0].relative_to = Some(0);
    relative.motors[0].bar = 1;
    relative.start[1] =
        Start { phi: relative.start[0].phi + FRAC_PI_2, omega: relative.start[0].omega + ONE_TURN + 1.0 };
    for (name, scene) in
        [("motor", shipped("motor", &[])), ("motor_sine", shipped("motor_sine", &[])), ("relative", relative)]
    {
        let mechanism = compile(&scene);
        let start = mechanism.start(&scene);
        let eliminated = end(&scene, on(ExpansionKernel::Series, 1e-17, 24), 1.0);
        let held = bordered(&mechanism, &start, on(ExpansionKernel::Fastest, 1e-17, 24), 1.0);
        let projected =
            bordered(&mechanism, &start, Projected::new(on(ExpansionKernel::Fastest, 1e-17, 24)), 1.0);
        assert!(distance(&eliminated, &held) < 1e-12, "{name}: {:e}", distance(&eliminated, &held));
        assert!(distance(&eliminated, &projected) < 1e-12, "{name}: {:e}", distance(&eliminated, &projected));
        let exact = bordered(&mechanism, &start, Taylor::reference(), 1.0);
        assert!(distance(&end(&scene, Taylor::reference(), 1.0), &exact) < 1e-26, "{name}");
    }
}

#[test]
fn extended_orders_leave_less_than_a_plain_double() {
    let damped = ["springs.spring.damping=0.3"];
    let cases: [(&str, &[&str]); 6] = [
        ("free", &[]),
        ("gentle", &[]),
        ("spring", &[]),
        ("spring", &damped),
        ("motor_sine", &[]),
        ("branch", &[]),
    ];
    for (name, overrides) in cases {
        let scene = shipped(name, overrides);
        let exact = end(&scene, Taylor::reference(), 1.0);
        let error = distance(&exact, &end(&scene, extended(ExpansionKernel::Series, 1e-22), 1.0));
        assert!(error < 1e-17, "{name}: {error:e}");
    }
    let (mechanism, start) = FOUR_BAR.mechanism(0.4, 12.0);
    let exact = bordered(&mechanism, &start, Taylor::reference(), 0.5);
    let error =
        distance(&exact, &bordered(&mechanism, &start, extended(ExpansionKernel::Series, 1e-22), 0.5));
    assert!(error < 1e-17, "{error:e}");
}

#[test]
fn extended_energy_stays_far_below_a_plain_run() {
    let scene = shipped("free", &[]);
    let mechanism = compile(&scene);
    let mut kernel = Energies::<DoubleDouble>::without_rows(&mechanism);
    let mut energy = |motion: &Motion| mechanism.energy(&mut kernel, &motion.phi, &motion.omega).total();
    let before = energy(&mechanism.start(&scene));
    let after = energy(&end(&scene, extended(ExpansionKernel::Series, 1e-21), 100.0));
    let drift = (after - before).hi.abs() / mechanism.energy_scale;
    assert!(drift < 1e-17, "{drift:e}");
}

#[test]
fn symmetric_releases_and_equilibria_take_finite_steps() {
    let at = |phi: f64, omega: f64| {
        let mut scene = shipped("free", &[]);
        scene.start.iter_mut().for_each(|start| (start.phi, start.omega) = (phi, omega));
        scene
    };
    let mut weightless = at(0.3, 0.0);
    weightless.gravity = [0.0; 2];
    let mut spring = shipped("hanging", &[]);
    spring.start.iter_mut().for_each(|start| start.omega = 1e-200);
    let cases = [
        ("horizontal", at(FRAC_PI_2, 0.0)),
        ("upright", at(PI, 0.0)),
        ("hanging", at(0.0, 0.0)),
        ("nearly hanging", at(0.0, 1e-300)),
        ("nearly upright", at(PI, 1e-100)),
        ("weightless", weightless),
        ("on its spring", spring),
    ];
    for (name, scene) in cases {
        let mechanism = compile(&scene);
        let start = mechanism.start(&scene);
        for kernel in [ExpansionKernel::Fastest, ExpansionKernel::Series] {
            for order in [16, 20, 24] {
                let last = end(&scene, on(kernel, 1e-13, order), 3.0);
                let exact = end(&scene, Taylor::<DoubleDouble>::with_order(1e-30, 30), 3.0);
                // Upright, what a double leaves out of π grows a thousandfold a second.
                let apart = distance(&last, &exact);
                assert!(apart < 1e-8, "{name}, {kernel:?} of order {order}: {apart:e}");
                if name == "hanging" || name == "weightless" {
                    assert_eq!((&last.phi, &last.omega), (&start.phi, &start.omega), "{name}");
                }
                let fastest = last.omega.iter().fold(0.0, |most: f64, omega| most.max(omega.hi.abs()));
                assert!(
                    !name.starts_with("nearly hanging") || fastest < 1e-299,
                    "{name}, {kernel:?} of order {order}: {fastest:e}"
                );
            }
        }
    }
}

#[test]
fn a_march_goes_on_bit_for_bit_from_where_its_last_step_began() {
    let mut scenes = fast_scenes();
    scenes.extend(["motor_sine"].map(|name| (name, shipped(name, &[]))));
    for (name, scene) in scenes {
        let mechanism = compile(&scene);
        let (row, horizon) = (Time::from(1.0), Time::from(3.0));
        // To the first step that passes the row, and the row.
        let pass = |form: &mut (dyn Problem + 'static), method: &mut Taylor<f64>, state: &mut State| {
            let mut from = state.clone();
            let mut watch = |_: &mut (dyn Problem + 'static), state: &mut State| {
                if state.time >= row {
                    return Ok(Seen::Enough);
                }
                from.clone_from(state);
                Ok(Seen::Kept)
            };
            let reached = method.advance(form, state, horizon, &mut Statistics::default(), &mut watch);
            assert_eq!(reached, Ok(Reached::Pause), "{name}");
            let mut inside = State::default();
            method.interpolate(form, &from, row, &mut inside);
            (from, inside)
        };
        let finish = |form: &mut (dyn Problem + 'static), method: &mut Taylor<f64>, state: &mut State| {
            method
                .advance(form, state, horizon, &mut Statistics::default(), &mut |_, _| Ok(Seen::Kept))
                .expect("an end");
        };
        let mut form = Elimination::<0>::new(mechanism.clone());
        let mut method = on(ExpansionKernel::Fastest, 1e-15, 20);
        let mut whole = form.state(&mechanism.start(&scene));
        let (from, inside) = pass(&mut form, &mut method, &mut whole);
        assert!(from.time < row && inside.time == row && whole.time > row);
        finish(&mut form, &mut method, &mut whole);
        let (mut form, mut method, mut again) =
            (Elimination::<0>::new(mechanism.clone()), on(ExpansionKernel::Fastest, 1e-15, 20), from);
        assert_eq!(pass(&mut form, &mut method, &mut again).1, inside, "{name}");
        finish(&mut form, &mut method, &mut again);
        assert_eq!(again, whole, "{name}");
    }
}

#[test]
fn extended_orders_are_asked_for_by_name_and_of_taylor_only() {
    let scene = shipped("gentle", &[]);
    let mechanism = compile(&scene);
    let request = Request { extended: true, until: Some(20.0), ..Request::default() };
    let plan = Plan::new(&scene, &mechanism, &request).expect("a sensible request");
    assert_eq!(
        (plan.method, plan.extended, plan.tolerance.map(|t| t.relative)),
        (MethodId::Taylor, true, Some(1e-20))
    );
    assert_eq!(plan.folder(&mechanism), "taylor-1e-20-extended");
    let outcome = common::run(&scene, &request);
    assert!(outcome.stop.is_none() && outcome.drift.energy.max < 1e-17, "{:e}", outcome.drift.energy.max);
    for (method, rtol, what) in
        [(MethodId::Dp8, None, "--extended"), (MethodId::Taylor, Some(1e-26), "--rtol")]
    {
        let refusal =
            Plan::new(&scene, &mechanism, &Request { method: Some(method), rtol, ..request.clone() })
                .expect_err("a refusal");
        assert!(refusal.is_usage && refusal.what == what, "{refusal}");
    }
    assert!(
        Plan::new(&scene, &mechanism, &Request { rtol: Some(1e-20), extended: false, ..request }).is_err()
    );
}
