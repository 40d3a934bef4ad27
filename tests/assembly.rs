//! The start of scenes with loops, sliders and free bodies: kept where given, found where not, refused where impossible or ambiguous.

mod common;

use common::shipped as scene;
use driftless::dynamics::Mechanism;
use driftless::scene::Scene;

fn compiled(scene: &Scene) -> Mechanism {
    Mechanism::new(scene).unwrap_or_else(|error| panic!("{}: {error}", scene.name))
}

#[test]
fn every_shipped_scene_is_assembled() {
    for name in [
        "andrews",
        "four_bars",
        "kite",
        "slider_crank_driven",
        "slider_crank_torque",
        "slider_crank_equal",
        "cart_pole",
        "four_bar_motor",
        "quick_return",
        "iftomm_pendulum",
    ] {
        let scene = scene(name, &[]);
        let mechanism = compiled(&scene);
        let a = &mechanism.assembly;
        println!(
            "{name}: dof {} rows {} redundant {:?} singular {:?} cond {:e}",
            a.degrees_of_freedom,
            mechanism.rows.len(),
            a.redundant,
            a.singular,
            a.conditioning
        );
        for change in &a.changes {
            println!("   {change}");
        }
        let start = mechanism.start(&scene);
        for (k, body) in mechanism.bodies.iter().enumerate() {
            println!("   {} {} {}", body.name, start.unwrapped(k), start.omega[k].hi);
        }
    }
}
