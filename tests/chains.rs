//! The hinge trees body by body against the dense form.

mod common;
#[path = "common/trees.rs"]
mod trees;

use driftless::arithmetic::{Complex, DoubleDouble, Real, Scalar};
use driftless::dynamics::kernel::{Bias, Kernel};
use driftless::dynamics::recursive::rows::{Rows, Ways};
use driftless::dynamics::recursive::{Foot, Hung, Links, Recursive};
use driftless::dynamics::row::Posture;
use driftless::dynamics::{Mechanism, Time};
use driftless::scene::Scene;
use proptest::prelude::*;
use trees::{Dice, any_tree, tree};

fn hung(mechanism: &Mechanism) -> Vec<Hung> {
    mechanism
        .bodies
        .iter()
        .enumerate()
        .map(|(k, body)| {
            let joint = mechanism.joints.iter().find(|joint| joint.outer == k).expect("hung");
            Hung {
                foot: body.parent.map_or(Foot::Ground, |parent| Foot::On(parent, joint.point.gamma(parent))),
                centre: body.centre.gamma(k),
                mass: body.mass,
                inertia: body.inertia,
            }
        })
        .collect()
}

fn recursive<T: Real>(mechanism: &Mechanism, t: Time, phi: &[T], omega: &[T]) -> (Vec<T>, Vec<T>) {
    let n = mechanism.bodies.len();
    let links = Links::new(&hung(mechanism), mechanism.gravity);
    let mut trees = Recursive::<T>::new(&links);
    trees.face(&links, phi);
    trees.convect(&links, omega);
    let mut load = vec![T::ZERO; n];
    for spring in &mechanism.springs {
        spring.span.pull(spring.force(&trees.z, omega), &trees.z, &mut load);
    }
    trees.burden(&links, &load);
    trees.fold(&links);
    let posture = Posture { phi, z: &trees.z, omega };
    let mut here = Vec::new();
    let mut jacobians = Vec::new();
    for row in &mechanism.rows {
        let mut jacobian = vec![T::ZERO; n];
        here.push(row.differentiate(t, posture, &mut jacobian));
        jacobians.push(jacobian);
    }
    let support: Vec<Vec<usize>> = jacobians.iter().map(|j| (0..n).filter(|&k| j[k] != T::ZERO).collect()).collect();
    let ways = Ways::new(&links, &support);
    let mut rows = Rows::<T>::new(&ways);
    for (r, jacobian) in jacobians.iter_mut().enumerate() {
        rows.take(&ways, r, jacobian);
    }
    rows.couple(&ways, &trees);
    let mut multiplier = vec![T::ZERO; mechanism.rows.len()];
    rows.project(&ways, &trees, &mut multiplier);
    for (m, here) in multiplier.iter_mut().zip(&here) {
        *m += here.convective;
    }
    rows.solve(&ways, &mut multiplier);
    rows.resist(&ways, &mut trees, &multiplier);
    let mut alpha = vec![T::ZERO; n];
    trees.unfold(&links, &mut alpha);
    (alpha, multiplier)
}

fn compare(scene: &Scene, pins: usize, dice: &mut Dice) -> (f64, f64) {
    let mut scene = scene.clone();
    let short = |x: &mut f64| *x = (*x * 256.0).round() / 256.0;
    scene.gravity.iter_mut().for_each(short);
    for bar in &mut scene.bars {
        bar.centre.iter_mut().for_each(short);
        short(&mut bar.mass);
        short(&mut bar.inertia);
    }
    for place in scene.hinges.iter_mut().flat_map(|hinge| &mut hinge.between) {
        place.point.iter_mut().for_each(short);
    }
    for place in scene.springs.iter_mut().flat_map(|spring| &mut spring.between) {
        place.point.iter_mut().for_each(short);
    }
    let mut mechanism = Mechanism::new(&scene).expect("equations");
    let n = mechanism.bodies.len();
    for k in 0..pins {
        let (a, b) = (dice.pick(n), dice.pick(n));
        let [a, b] = [mechanism.bodies[a].ends[1].clone(), mechanism.bodies[b].ends[0].clone()];
        mechanism = mechanism.pinned(&format!("pin{k}"), &a, &b);
    }
    let phi: Vec<f64> = scene.start.iter().map(|s| s.phi).collect();
    let omega: Vec<f64> = scene.start.iter().map(|s| s.omega).collect();
    let t = Time::from(0.37);
    let of = |x: &[f64]| x.iter().map(|&x| DoubleDouble::of(x)).collect::<Vec<_>>();
    let mut exact = Kernel::<DoubleDouble>::new(n, mechanism.rows.len());
    exact.accelerate::<0>(&mechanism, t, &of(&phi), &of(&omega), Bias::default());
    let mut kernel = Kernel::<f64>::new(n, mechanism.rows.len());
    kernel.accelerate::<0>(&mechanism, t, &phi, &omega, Bias::default());
    let (alpha, _) = recursive(&mechanism, t, &phi, &omega);
    let (fine, _) = recursive(&mechanism, t, &of(&phi), &of(&omega));
    let scale = exact.load.iter().fold(1.0f64, |m, x| m.max(x.hi.abs()));
    let first = (0..n).map(|k| (alpha[k] - exact.load[k].hi).abs()).fold(0.0, f64::max) / scale;
    let dense = (0..n).map(|k| (kernel.load[k] - exact.load[k].hi).abs()).fold(0.0, f64::max) / scale;
    let second = (0..n).map(|k| (fine[k] - exact.load[k]).hi.abs()).fold(0.0, f64::max) / scale;
    println!("{n} {} {first:e} dense {dense:e} {second:e}", mechanism.rows.len());
    (first, second)
}

proptest! {
    #[test]
    fn small_trees((scene, seed) in any_tree(false)) {
        let (first, second) = compare(&scene, 0, &mut Dice::new(seed));
        prop_assert!(first < 1e-11 && second < 1e-25);
    }
    #[test]
    fn small_driven_trees((scene, seed) in any_tree(true)) {
        let (first, second) = compare(&scene, 0, &mut Dice::new(seed));
        prop_assert!(first < 1e-11 && second < 1e-25);
    }
}

#[test]
fn larger() {
    for n in [1, 2, 10, 30, 100] {
        for pins in 0..n.min(10) {
            compare(&tree(n, false, &mut Dice::new(n as u64)), pins, &mut Dice::new(pins as u64));
        }
    }
}
