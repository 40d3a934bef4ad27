//! Mechanisms with closed loops and sliders in lanes: against double-double one by one, on their constraints
//! after every step, and independent of who integrates beside whom.

use crate::common;

use common::{compile, shipped};
use driftless::arithmetic::{Complex, DoubleDouble};
use driftless::dynamics::constraint::{Measure, Posture};
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::{Form, Mechanism, State, Time};
use driftless::stepping::taylor::Kernel;
use driftless::stepping::taylor::batch::{Batch, BatchMember, Going, Passage};
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

/// Eleven starts of a scene.
fn starts((scene, varied, from, by, _): (&str, &str, f64, f64, f64)) -> Vec<(Arc<Mechanism>, State)> {
    let at = |i: usize| {
        let scene = shipped(scene, &[&format!("{varied}={}", from + by * i as f64)]);
        let mechanism = compile(&scene);
        let state = Multiplier::<0, true>::new(Arc::clone(&mechanism)).state(&mechanism.start(&scene));
        (mechanism, state)
    };
    (0..11).map(at).collect()
}

fn members(all: &[(Arc<Mechanism>, State)]) -> Vec<BatchMember<'_>> {
    all.iter().map(|(mechanism, state)| BatchMember::new(mechanism, state.clone())).collect()
}

fn at(tolerance: f64) -> Batch {
    Batch::new(Tolerance { relative: tolerance, absolute: tolerance })
}

fn ends(batch: &Batch, mut members: Vec<BatchMember>, until: Time) -> Vec<State> {
    batch.integrate(&mut members, until, &mut |_, _| Going::On);
    for member in &members {
        assert!(member.stopped.is_none() && !member.has_left && member.statistics.steps > 3, "{member:?}");
    }
    members.into_iter().map(|member| member.state).collect()
}

#[test]
fn loops_of_one_mechanism_agree_with_double_double_whoever_is_beside_them() {
    for scene in SCENES {
        let (all, until) = (starts(scene), Time::from(scene.4));
        assert!(Batch::takes_alike(&all[0].0) && !Batch::takes(&all[0].0));
        let exact = |(mechanism, state): &(Arc<Mechanism>, State)| {
            let (mut exact, mut statistics) = (state.clone(), Default::default());
            let mut problem = Multiplier::<0, true>::new(Arc::clone(mechanism));
            Taylor::reference()
                .advance(&mut problem, &mut exact, until, &mut statistics, &mut |_, _| Ok(Seen::Kept))
                .expect("an end");
            exact
        };
        let exact: Vec<State> = all.iter().map(exact).collect();
        for order in [16, 20, 24] {
            let batch = at(1e-17).with_order(order);
            let found = ends(&batch, members(&all), until);
            let mut backwards = members(&all);
            backwards.reverse();
            let mut backwards = ends(&batch, backwards, until);
            backwards.reverse();
            assert_eq!(backwards, found);
            assert_eq!(ends(&batch, members(&all[4..5]), until)[0], found[4]);
            assert_eq!(ends(&batch.clone().with_kernel(Kernel::Portable), members(&all), until), found);
            for (i, ((mechanism, _), (exact, found))) in all.iter().zip(exact.iter().zip(&found)).enumerate()
            {
                assert_eq!((found.time, &found.turns), (exact.time, &exact.turns));
                let n = mechanism.bodies.len();
                let fastest = exact.y[n..2 * n].iter().fold(1.0, |most: f64, rate| most.max(rate.abs()));
                // Angles, rates and work.
                for k in 0..=2 * n {
                    let energy = mechanism.energy_scale.max(exact.y[2 * n].abs());
                    let scale = [1.0, fastest, energy][(k / n).min(2)];
                    let error = (found.unknown(k) - exact.unknown(k)).hi.abs() / scale;
                    assert!(error < 1e-12, "{} {i}, order {order}, unknown {k}: {error:e}", scene.0);
                }
            }
        }
    }
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
            Measure::Angle { .. } => 1.0,
            Measure::Place(place) => {
                let all =
                    place.linear.iter().map(|term| term.1).chain(place.bilinear.iter().map(|term| term.2));
                all.fold(0.0, |most: f64, g| most.max(g.norm_squared().sqrt()))
            }
        };
        let mut jacobian = vec![DoubleDouble::default(); n];
        let here = row.linearise(t, Posture { phi: &phi, z: &z, omega: &omega }, &mut jacobian);
        let slip = jacobian.iter().zip(&omega).fold(here.drive, |sum, (&g, &w)| sum + g * w);
        [position.max(here.position.hi.abs() / lever), rate.max(slip.hi.abs() / (lever * fastest))]
    })
}

/// Whatever the tolerance: it is the projection that keeps them.
#[test]
fn every_step_ends_on_the_constraints() {
    for scene in SCENES {
        let all = starts(scene);
        for tolerance in [1e-4, 1e-9, 1e-15] {
            let mut steps = 0;
            at(tolerance).integrate(&mut members(&all), Time::from(scene.4), &mut |k, passage| {
                let t = passage.from + passage.step;
                let [position, rate] = violation(&all[k].0, t, &|body| passage.ends(body)[1]);
                assert!(position < 2e-15 && rate < 4e-15, "{}: {position:e} {rate:e}", scene.0);
                steps += 1;
                Going::On
            });
            assert!(steps >= 22, "{} at {tolerance:e}: {steps}", scene.0);
        }
    }
}

/// At a loose tolerance steps end far from the constraints, some farther than others.
#[test]
fn neighbours_do_not_matter_however_far_a_step_ends_from_the_constraints() {
    for scene in SCENES {
        let (all, until) = (starts(scene), Time::from(scene.4));
        let integrated = |batch: &Batch, few: &[(Arc<Mechanism>, State)]| -> Vec<State> {
            let mut members = members(few);
            batch.integrate(&mut members, until, &mut |_, _| Going::On);
            members.into_iter().map(|member| member.state).collect()
        };
        let together = integrated(&at(1e-3), &all);
        assert_eq!(integrated(&at(1e-3).with_kernel(Kernel::Portable), &all), together);
        for i in 0..all.len() {
            assert_eq!(integrated(&at(1e-3), &all[i..=i])[0], together[i], "{} {i}", scene.0);
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
    let mut see = |k: usize, passage: &Passage| {
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
    let all = starts(("kite", "start.crank.omega", 7.0, 0.11, 0.0));
    let until = Time::from(2.0);
    let integrated = |few: &[(Arc<Mechanism>, State)]| {
        let mut members = members(few);
        at(1e-12).integrate(&mut members, until, &mut |_, _| Going::On);
        members.into_iter().map(|member| (member.has_left, member.stopped.is_none(), member.state)).collect()
    };
    let together: Vec<(bool, bool, State)> = integrated(&all);
    for (i, (has_left, is_sound, state)) in together.iter().enumerate() {
        assert!(has_left & is_sound && state.time < until && state.time.hi > 0.05, "{i}: {state:?}");
        let [position, rate] = violation(&all[i].0, state.time, &|body| [state.y[body], state.y[3 + body]]);
        assert!(position < 2e-15 && rate < 4e-15, "{i}: {position:e} {rate:e}");
        assert_eq!(integrated(&all[i..=i])[0].2, *state);
    }
}

/// Hinges that an event closes or releases are followed one by one.
#[test]
fn what_lanes_do_not_take_is_told_beforehand() {
    for scene in ["trebuchet", "latch"] {
        assert!(!Batch::takes_alike(&compile(&shipped(scene, &[]))), "{scene}");
    }
}
