//! Accelerations body by body against the dense form.

mod common;
#[path = "common/trees.rs"]
mod trees;

use driftless::arithmetic::{Complex, DoubleDouble, Scalar};
use driftless::dynamics::Mechanism;
use driftless::dynamics::kernel::Kernel;
use driftless::dynamics::recursive::{Hung, Links, Recursive};
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
                parent: body.parent,
                hinge: body.parent.map_or(Complex::ZERO, |parent| joint.point.gamma(parent)),
                centre: body.centre.gamma(k),
                mass: body.mass,
                inertia: body.inertia,
            }
        })
        .collect()
}

fn compare(scene: &Scene) -> (f64, f64) {
    let mut scene = scene.clone();
    scene.springs.clear();
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
    let mechanism = Mechanism::new(&scene).expect("equations");
    let n = mechanism.bodies.len();
    let links = Links::new(&hung(&mechanism), mechanism.gravity).expect("a tree");
    let phi: Vec<f64> = scene.start.iter().map(|s| s.phi).collect();
    let omega: Vec<f64> = scene.start.iter().map(|s| s.omega).collect();
    let mut kernel = Kernel::<f64>::new(n, 0);
    kernel.accelerate_free::<0>(&mechanism, &phi, &omega);
    let mut recursive = Recursive::<f64>::new(&links);
    let mut alpha = vec![0.0; n];
    recursive.accelerate(&links, &phi, &omega, &mut alpha);
    let of = |x: &[f64]| x.iter().map(|&x| DoubleDouble::of(x)).collect::<Vec<_>>();
    let mut exact = Kernel::<DoubleDouble>::new(n, 0);
    exact.accelerate_free::<0>(&mechanism, &of(&phi), &of(&omega));
    let mut both = Recursive::<DoubleDouble>::new(&links);
    let mut fine = vec![DoubleDouble::ZERO; n];
    both.accelerate(&links, &of(&phi), &of(&omega), &mut fine);
    let scale = exact.load.iter().fold(1.0f64, |m, x| m.max(x.hi.abs()));
    let first = (0..n).map(|k| (alpha[k] - exact.load[k].hi).abs()).fold(0.0, f64::max) / scale;
    let dense = (0..n).map(|k| (kernel.load[k] - exact.load[k].hi).abs()).fold(0.0, f64::max) / scale;
    let second = (0..n).map(|k| (fine[k] - exact.load[k]).hi.abs()).fold(0.0, f64::max) / scale;
    println!("{n} {first:e} dense {dense:e} {second:e}");
    (first, second)
}

proptest! {
    #[test]
    fn small_trees((scene, _) in any_tree(false)) {
        let (first, second) = compare(&scene);
        prop_assert!(first < 1e-11 && second < 1e-25);
    }
}

#[test]
fn larger() {
    for n in [1, 2, 10, 30, 100] {
        compare(&tree(n, false, &mut Dice::new(n as u64)));
    }
}
