//! Mechanisms with closed loops and sliders in lanes: against double-double one by one, on their constraints
//! after every step, and independent of who integrates beside whom.

use crate::common;

use common::{compile, shipped};
use driftless::arithmetic::{Complex, DoubleDouble};
use driftless::dynamics::constraint::{ConstraintArguments, RowMeasure};
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::{Form, Mechanism, State, Time};
use driftless::run::Problem;
use driftless::scene::{Scene, parse_scene};
use driftless::stepping::taylor::ExpansionKernel;
use driftless::stepping::taylor::batch::{Batch, BatchMember, Going, TakenStep};
use driftless::stepping::{Integrator, Seen, Taylor, Tolerance};
use std::sync::Arc;

/// Scenes, what is varied of their starts, from where on and by how much, and up to when \[s\] they stay away
/// from singular positions.
const SCENES: [(&str, &str, f64, f64, f64); 6] = [
    ("andrews", "start.OF.omega", -50.0, 11.0, 0.01),
    ("kite", "start.crank.omega", 7.0, 0.11, 0.1),
    ("slider_crank_torque", "start.crank.omega", -1.0, 0.3, 0.6),
    ("guided", "start.bar1.omega", -3.6, 0.07, 0.3),
    ("four_bar_motor", "start.coupler.phi", 0.43, 0.0, 0.7),
    ("quick_return", "start.link.phi", 3.21, 0.0, 0.7),
];

/// Three numbers of a scene, from where on and by how much they are varied.
type Varied = [(&'static str, f64, f64); 3];

/// Scenes, what is varied of their numbers, and up to when \[s\].
const NUMBERS: [(&str, Varied, f64); 6] = [
    (
        "andrews",
        [
            ("springs.spring.stiffness", 4000.0, 100.0),
            ("bars.BED.mass", 0.02, 1e-3),
            ("torques.torque.torque", 0.03, 1e-3),
        ],
        0.01,
    ),
    (
        "kite",
        [
            ("hinges.A.between[0].point[0]", 0.99, 0.004),
            ("bars.coupler.mass", 0.8, 0.05),
            ("gravity[1]", -9.9, 0.1),
        ],
        0.08,
    ),
    (
        "slider_crank_torque",
        [
            ("hinges.A.between[0].point[0]", 0.45, 0.01),
            ("bars.rod.inertia", 0.3, 0.01),
            ("torques.torque.torque", 8.0, 0.5),
        ],
        0.6,
    ),
    (
        "guided",
        [
            ("hinges.B.between[0].point[0]", 0.57, 0.005),
            ("bars.bar2.density", 600.0, 20.0),
            ("gravity[0]", 9.0, 0.1),
        ],
        0.25,
    ),
    (
        "four_bar_motor",
        [
            ("motors.motor.law.rate", 6.0, 0.1),
            ("hinges.B.between[0].point[0]", 0.89, 0.002),
            ("bars.rocker.density", 2500.0, 50.0),
        ],
        0.7,
    ),
    (
        "quick_return",
        [
            ("motors.motor.law.rate", 6.0, 0.1),
            ("hinges.C.between[0].point[0]", 0.19, 0.002),
            ("sliders.guide.rail.point[1]", 0.195, 0.001),
        ],
        0.7,
    ),
];

/// Eleven of them, all with numbers of their own.
fn variants((scene, varied, _): &(&str, Varied, f64)) -> Vec<(Arc<Mechanism>, State)> {
    let at = |i: usize| {
        let sets = varied.map(|(path, from, by)| format!("{path}={}", from + by * i as f64));
        started(&shipped(scene, &sets.each_ref().map(String::as_str)))
    };
    (0..11).map(at).collect()
}

pub fn started(scene: &Scene) -> (Arc<Mechanism>, State) {
    let mechanism = compile(scene);
    let state = Multiplier::<0, true>::new(Arc::clone(&mechanism)).state(&mechanism.start(scene));
    (mechanism, state)
}

/// Eleven starts of a scene.
fn starts((scene, varied, from, by, _): (&str, &str, f64, f64, f64)) -> Vec<(Arc<Mechanism>, State)> {
    let at = |i: usize| started(&shipped(scene, &[&format!("{varied}={}", from + by * i as f64)]));
    (0..11).map(at).collect()
}

pub fn members(all: &[(Arc<Mechanism>, State)]) -> Vec<BatchMember<'_>> {
    all.iter().map(|(mechanism, state)| BatchMember::new(mechanism, state.clone())).collect()
}

pub fn at(tolerance: f64) -> Batch {
    Batch::new(Tolerance { relative: tolerance, absolute: tolerance })
}

fn ends(batch: &Batch, mut members: Vec<BatchMember>, until: Time) -> Vec<State> {
    batch.integrate(&mut members, until, &mut |_, _| Going::On);
    for member in &members {
        assert!(member.stopped.is_none() && !member.has_left && member.statistics.steps > 3, "{member:?}");
    }
    members.into_iter().map(|member| member.state).collect()
}

/// Integrates all against double-double, in order and backwards, one alone, and without the processor's
/// vectors.
pub fn agree_with_double_double(scene: &str, all: &[(Arc<Mechanism>, State)], until: f64) {
    let until = Time::from(until);
    let exact = |(mechanism, state): &(Arc<Mechanism>, State)| {
        let (mut exact, mut statistics) = (state.clone(), Default::default());
        let problem: &mut dyn Problem = &mut Multiplier::<0, true>::new(Arc::clone(mechanism));
        Taylor::reference()
            .advance(problem, &mut exact, until, &mut statistics, &mut |_, _| Ok(Seen::Kept))
            .expect("an end");
        exact
    };
    let exact: Vec<State> = all.iter().map(exact).collect();
    for order in [16, 20, 24] {
        let batch = at(1e-17).with_order(order);
        let found = ends(&batch, members(all), until);
        let mut backwards = members(all);
        backwards.reverse();
        let mut backwards = ends(&batch, backwards, until);
        backwards.reverse();
        assert_eq!(backwards, found);
        assert_eq!(ends(&batch, members(&all[4..5]), until)[0], found[4]);
        assert_eq!(ends(&batch.clone().with_kernel(ExpansionKernel::Portable), members(all), until), found);
        for (i, ((mechanism, _), (exact, found))) in all.iter().zip(exact.iter().zip(&found)).enumerate() {
            assert_eq!((found.time, &found.turns), (exact.time, &exact.turns));
            let n = mechanism.coordinates();
            let fastest = exact.y[n..2 * n].iter().fold(1.0, |most: f64, rate| most.max(rate.abs()));
            // Angles and places, rates and work.
            for k in 0..=2 * n {
                let energy = mechanism.energy_scale.max(exact.y[2 * n].abs());
                let scale = [1.0, fastest, energy][(k / n).min(2)];
                let error = (found.unknown(k) - exact.unknown(k)).hi.abs() / scale;
                assert!(error < 1e-12, "{scene} {i}, order {order}, unknown {k}: {error:e}");
            }
        }
    }
}

#[test]
fn loops_of_one_mechanism_agree_with_double_double_whoever_is_beside_them() {
    for scene in SCENES {
        let all = starts(scene);
        assert!(Batch::takes_alike(&all[0].0) && !Batch::takes(&all[0].0));
        agree_with_double_double(scene.0, &all, scene.4);
    }
}

/// The same loops with other lengths, masses, springs, torques and motors for every trajectory, and those of
/// two scenes in one batch.
#[test]
fn loops_with_numbers_of_their_own_agree_with_double_double_whoever_is_beside_them() {
    for scene in &NUMBERS {
        let all = variants(scene);
        assert!(all.iter().all(|(mechanism, _)| Batch::takes_alike(mechanism)));
        agree_with_double_double(scene.0, &all, scene.2);
    }
    let mixed = [variants(&NUMBERS[1]), starts(SCENES[1]), variants(&NUMBERS[4])].concat();
    let integrated = |few: &[(Arc<Mechanism>, State)]| -> Vec<State> {
        let mut members = members(few);
        at(1e-9).integrate(&mut members, Time::from(0.08), &mut |_, _| Going::On);
        members.into_iter().map(|member| member.state).collect()
    };
    for (i, found) in integrated(&mixed).iter().enumerate() {
        assert_eq!((integrated(&mixed[i..=i])[0].clone(), found.time.hi), (found.clone(), 0.08), "{i}");
    }
}

/// A motor on the first bar and a torsion spring between both, which counts turns: the motor's angle is kept
/// by a multiplier.
#[test]
fn motors_beside_torsion_springs_agree_with_double_double() {
    let at = |i: usize| {
        let mut text: serde_json::Value =
            serde_json::from_str(include_str!("../examples/scenes/motor.json")).expect("JSON");
        text["torsion_springs"] = serde_json::json!([{"name": "t", "body": "bar2", "relative_to": "bar1",
            "stiffness": 0.2 + 0.02 * i as f64, "free_angle": 0.3, "damping": 0.01}]);
        text["motors"][0]["law"]["rate"] = serde_json::json!(3.0 + 0.2 * i as f64);
        started(&parse_scene(&text.to_string(), "wound", &[]).expect("a scene"))
    };
    let all: Vec<_> = (0..11).map(at).collect();
    assert!(all.iter().all(|(mechanism, _)| mechanism.has_multipliers() && !mechanism.has_closed_loops()));
    assert!(all.iter().all(|(mechanism, _)| Batch::takes_alike(mechanism)));
    agree_with_double_double("motor and torsion spring", &all, 1.0);
}

/// The largest violation of a constraint at both levels, over its longest lever and that at the fastest rate.
fn violation(mechanism: &Mechanism, t: Time, ends: &dyn Fn(usize) -> [f64; 2]) -> [f64; 2] {
    let n = mechanism.bodies.len();
    let phi: Vec<_> = (0..n).map(|k| DoubleDouble::from(ends(k)[0]).reduced().0).collect();
    let omega: Vec<_> = (0..n).map(|k| DoubleDouble::from(ends(k)[1])).collect();
    let z: Vec<_> = phi.iter().map(|&phi| Complex::unit(phi)).collect();
    let fastest = omega.iter().fold(1.0, |most: f64, rate| most.max(rate.hi.abs()));
    mechanism.constraints.iter().fold([0.0, 0.0], |[position, rate], row| {
        let lever = match &row.measure {
            RowMeasure::Angle { .. } => 1.0,
            RowMeasure::Place(place) => {
                let all =
                    place.linear.iter().map(|term| term.1).chain(place.bilinear.iter().map(|term| term.2));
                all.fold(0.0, |most: f64, g| most.max(g.norm_squared().sqrt()))
            }
        };
        let mut jacobian = vec![DoubleDouble::default(); n];
        let here = row.linearise(t, ConstraintArguments { phi: &phi, z: &z, omega: &omega }, &mut jacobian);
        let slip = jacobian.iter().zip(&omega).fold(here.drive, |sum, (&g, &w)| sum + g * w);
        [position.max(here.position.hi.abs() / lever), rate.max(slip.hi.abs() / (lever * fastest))]
    })
}

/// Whatever the tolerance: it is the projection that keeps them.
#[test]
fn every_step_ends_on_the_constraints() {
    for scene in SCENES {
        let all = starts(scene);
        end_on_the_constraints(scene.0, &all, scene.4);
    }
    for scene in &NUMBERS {
        end_on_the_constraints(scene.0, &variants(scene), scene.2);
    }
}

fn end_on_the_constraints(scene: &str, all: &[(Arc<Mechanism>, State)], until: f64) {
    for tolerance in [1e-4, 1e-9, 1e-15] {
        let mut steps = 0;
        at(tolerance).integrate(&mut members(all), Time::from(until), &mut |k, passage| {
            let t = passage.from + passage.step;
            let [position, rate] = violation(&all[k].0, t, &|body| passage.ends(body)[1]);
            assert!(position < 2e-15 && rate < 4e-15, "{scene}: {position:e} {rate:e}");
            steps += 1;
            Going::On
        });
        assert!(steps >= 22, "{scene} at {tolerance:e}: {steps}");
    }
}

/// At a loose tolerance steps end far from the constraints, some farther than others.
#[test]
fn neighbours_do_not_matter_however_far_a_step_ends_from_the_constraints() {
    let of_one = SCENES.map(|scene| (scene.0, starts(scene), scene.4));
    let of_many = NUMBERS.each_ref().map(|scene| (scene.0, variants(scene), scene.2));
    for (scene, all, until) in of_one.into_iter().chain(of_many) {
        let until = Time::from(until);
        let integrated = |batch: &Batch, few: &[(Arc<Mechanism>, State)]| -> Vec<State> {
            let mut members = members(few);
            batch.integrate(&mut members, until, &mut |_, _| Going::On);
            members.into_iter().map(|member| member.state).collect()
        };
        let together = integrated(&at(1e-3), &all);
        assert_eq!(integrated(&at(1e-3).with_kernel(ExpansionKernel::Portable), &all), together);
        for i in 0..all.len() {
            assert_eq!(integrated(&at(1e-3), &all[i..=i])[0], together[i], "{scene} {i}");
        }
    }
}

/// What trigonometry and mechanics say of the kite where its crank has an angle and a rate: the angles of
/// coupler and rocker, their rates, and the energy \[J\].
fn kite([crank, rate]: [f64; 2]) -> ([f64; 2], [f64; 2], f64) {
    let (x, y) = (crank.cos(), crank.sin());
    // From the crank's end to the ground pivot at (2, 0), and the triangle with sides 1 and 2 over that.
    let (dx, dy) = (2.0 - x, -y);
    let square = dx * dx + dy * dy;
    let inner = ((square + 1.0 - 4.0) / (2.0 * square.sqrt())).acos();
    let coupler = dy.atan2(dx) + inner;
    let (end_x, end_y) = (x + coupler.cos(), y + coupler.sin());
    let rocker = end_y.atan2(end_x - 2.0);
    // The ends of coupler and rocker have one velocity.
    let sine = (rocker - coupler).sin();
    let coupler_rate = rate * (crank - rocker).sin() / sine;
    let rocker_rate = 0.5 * rate * (crank - coupler).sin() / sine;
    let g = 9.81;
    let middle =
        [-y * rate - 0.5 * coupler.sin() * coupler_rate, x * rate + 0.5 * coupler.cos() * coupler_rate];
    let turning = rate * rate * (1.0 / 3.0)
        + coupler_rate * coupler_rate / 12.0
        + rocker_rate * rocker_rate * 8.0 / 3.0;
    let kinetic = 0.5 * (turning + middle[0] * middle[0] + middle[1] * middle[1]);
    let potential = g * (0.5 * y + y + 0.5 * coupler.sin() + 2.0 * rocker.sin());
    ([coupler, rocker], [coupler_rate, rocker_rate], kinetic + potential)
}

#[test]
fn a_four_bar_is_where_trigonometry_has_it_with_the_energy_it_began_with() {
    let scene = SCENES[1];
    let all = starts(scene);
    let mut energy = [None; 11];
    let mut see = |k: usize, passage: &TakenStep| {
        let ends = [0, 1, 2].map(|body| passage.ends(body)[1]);
        let (angles, rates, total) = kite(ends[0]);
        for body in [1, 2] {
            let off = (ends[body][0] - angles[body - 1]) / std::f64::consts::TAU;
            assert!((off - off.round()).abs() < 2e-15, "{k}: {ends:?} {angles:?}");
            assert!(
                (ends[body][1] - rates[body - 1]).abs() < 1e-13 * ends[0][1].abs(),
                "{k}: {ends:?} {rates:?}"
            );
        }
        let first = *energy[k].get_or_insert(total);
        assert!((total - first).abs() < 2e-13 * first, "{k}: {total} {first}");
        Going::On
    };
    at(1e-14).integrate(&mut members(&all), Time::from(scene.4), &mut see);
    assert!(energy.iter().all(Option::is_some));
}

/// The kite folds into a line; nothing of a step near there is made in lanes, and nobody beside is disturbed.
#[test]
fn a_trajectory_leaves_the_lanes_before_a_singular_position() {
    let heavier =
        [("bars.coupler.mass", 0.5, 0.1), ("bars.rocker.inertia", 0.5, 0.03), ("gravity[1]", -9.9, 0.1)];
    let until = Time::from(2.0);
    let integrated = |few: &[(Arc<Mechanism>, State)]| {
        let mut members = members(few);
        at(1e-12).integrate(&mut members, until, &mut |_, _| Going::On);
        members.into_iter().map(|member| (member.has_left, member.stopped.is_none(), member.state)).collect()
    };
    let of_one = starts(("kite", "start.crank.omega", 7.0, 0.11, 0.0));
    for all in [of_one, variants(&("kite", heavier, 0.0))] {
        let together: Vec<(bool, bool, State)> = integrated(&all);
        for (i, (has_left, is_sound, state)) in together.iter().enumerate() {
            assert!(has_left & is_sound && state.time < until && state.time.hi > 0.05, "{i}: {state:?}");
            let ends = |body: usize| [state.y[body], state.y[3 + body]];
            let [position, rate] = violation(&all[i].0, state.time, &ends);
            assert!(position < 2e-15 && rate < 4e-15, "{i}: {position:e} {rate:e}");
            assert_eq!(integrated(&all[i..=i])[0].2, *state);
        }
    }
}

/// Hinges that an event closes or releases are followed one by one.
#[test]
fn what_lanes_do_not_take_is_told_beforehand() {
    for scene in ["trebuchet", "latch"] {
        assert!(!Batch::takes_alike(&compile(&shipped(scene, &[]))), "{scene}");
    }
}
