//! The parts of a scene that become rows, joints and applied forces.

use super::Joint;
use crate::arithmetic::Complex;
use crate::dynamics::constraint::{self, Aim, ConstraintEquation, Measure};
use crate::dynamics::force::Action;
use crate::dynamics::force::action::Kind;
use crate::dynamics::forest::Forest;
use crate::dynamics::law::Law;
use crate::dynamics::point::Point;
use crate::dynamics::quadratic::Quadratic;
use crate::scene::{Coupled, Coupling, Place, Scene, Slider, Wall};
use std::sync::Arc;

/// Motors, locks, and the angles that welds and locked sliders keep; those not given are what they are at the
/// start.
pub(super) fn given_angles(scene: &Scene) -> Vec<ConstraintEquation> {
    let motors = scene.motors.iter().map(|motor| {
        constraint::angle_equation(&motor.name, motor.bar, motor.relative_to, motor.law.clone())
    });
    let phi = |bar: Option<usize>| bar.map_or(0.0, |bar| scene.start[bar].phi);
    let keep = |name: &str, a: Option<usize>, b: Option<usize>, angle: Option<f64>| {
        let (body, base) = if let Some(a) = a { (a, b) } else { (b?, None) };
        let angle = angle.unwrap_or_else(|| phi(Some(body)) - phi(base));
        Some(constraint::angle_equation(name, body, base, Law::constant(angle)))
    };
    let locks =
        scene.locks.iter().filter_map(|lock| keep(&lock.name, Some(lock.bar), lock.relative_to, lock.angle));
    let welds = (scene.welds.iter()).filter_map(|weld| {
        keep(&format!("{}.angle", weld.name), weld.between[1].bar, weld.between[0].bar, None)
    });
    let sliders = (scene.sliders.iter().filter(|slider| slider.locked)).filter_map(|slider| {
        keep(&format!("{}.angle", slider.name), slider.point.bar, slider.rail.place.bar, None)
    });
    motors.chain(locks).chain(welds).chain(sliders).collect()
}

/// The rows of [`given_angles`] whose angle is that of the start.
pub(super) fn kept_angles(scene: &Scene) -> Vec<usize> {
    let locks = scene.locks.iter().map(|lock| lock.angle.is_none());
    let others = scene.welds.len() + scene.sliders.iter().filter(|slider| slider.locked).count();
    let kept = locks.chain(std::iter::repeat_n(true, others));
    (scene.motors.len()..).zip(kept).filter(|(_, kept)| *kept).map(|(row, _)| row).collect()
}

/// Hinges and welds; those that close a loop add their rows.
pub(super) fn joints(scene: &Scene, forest: &Forest, rows: &mut Vec<ConstraintEquation>) -> Vec<Joint> {
    let named = scene.hinges.iter().map(|hinge| (&hinge.name, &hinge.between));
    let welded = scene.welds.iter().map(|weld| (&weld.name, &weld.between));
    let mut joints = Vec::with_capacity(forest.outer.len());
    for ((name, between), &outer) in named.chain(welded).zip(&forest.outer) {
        let inner = match outer {
            Some(outer) if between[0].bar == Some(outer) => &between[1],
            _ => &between[0],
        };
        let point = Complex::new(inner.point[0], inner.point[1]);
        let at = (inner.bar, inner.bar.map_or(point, |bar| point - forest.hangs[bar].own));
        let row = outer.is_none().then_some(rows.len());
        if outer.is_none() {
            rows.extend(constraint::pin_equations(
                name,
                &forest.site(&between[0]),
                &forest.site(&between[1]),
                scene.bars.len(),
            ));
        }
        joints.push(Joint { name: name.clone(), at, outer, row, between: [between[0].bar, between[1].bar] });
    }
    joints
}

/// The row that keeps a slider on its rail.
pub(super) fn slide(forest: &Forest, slider: &Slider) -> ConstraintEquation {
    on_rail(forest, &slider.name, slider, rail(slider).left(), None)
}

/// The row that gives a slider's travel.
pub(super) fn travel(forest: &Forest, name: &str, slider: &Slider, law: Law) -> ConstraintEquation {
    on_rail(forest, name, slider, rail(slider), Some(law))
}

/// The row of the travel of a slider without a law.
pub(in crate::dynamics) fn travel_along(forest: &Forest, slider: &Slider) -> ConstraintEquation {
    on_rail(forest, &slider.name, slider, rail(slider), None)
}

/// The row of a motor whose aim depends on the mechanism, without its aim.
pub(super) fn follows(
    forest: &Forest,
    Coupling { name, coupled, .. }: &Coupling,
    scene: &Scene,
) -> ConstraintEquation {
    match *coupled {
        Coupled::Travel(slider) => {
            on_rail(forest, name, &scene.sliders[slider], rail(&scene.sliders[slider]), None)
        }
        Coupled::Angle { .. } => {
            let nothing = Quadratic { angles: forest.hangs.len(), ..Quadratic::default() };
            ConstraintEquation {
                name: name.clone(),
                measure: Measure::Place(nothing),
                law: None,
                push: None,
                aim: None,
            }
        }
    }
}

/// Gives rows their aims, by name; rows that were released have none.
pub(super) fn give_aims(rows: &mut [ConstraintEquation], aims: Vec<(&str, Arc<Aim>)>) {
    for (name, aim) in aims {
        if let Some(row) = rows.iter_mut().find(|row| row.name == name && !row.is_angle()) {
            row.aim = Some(aim);
        }
    }
}

/// The row of how far a point is from the line of its wall along a direction in the frame of what carries it,
/// and the point as seen from there.
pub(in crate::dynamics) fn along_wall(
    forest: &Forest,
    wall: &Wall,
    direction: Complex<f64>,
    law: Option<Law>,
) -> (ConstraintEquation, Point) {
    let site = forest.site(&Place { bar: Some(wall.bar), point: wall.point });
    let (name, angles) = (&wall.name, forest.hangs.len());
    match wall.on {
        None => {
            let offset = direction.dot(Complex::new(wall.through[0], wall.through[1]));
            let row = constraint::line_equation(name, &site, direction, offset, law, angles);
            (row, site.point)
        }
        Some(bar) => {
            let through = forest.site(&Place { bar: Some(bar), point: wall.through });
            let row = constraint::slot_equation(name, &site, bar, &through, direction, law, angles);
            (row, site.point.minus(&through.point))
        }
    }
}

fn rail(slider: &Slider) -> Complex<f64> {
    Complex::new(slider.rail.direction[0], slider.rail.direction[1])
}

fn on_rail(
    forest: &Forest,
    name: &str,
    slider: &Slider,
    direction: Complex<f64>,
    law: Option<Law>,
) -> ConstraintEquation {
    let (site, origin_point, angles) =
        (forest.site(&slider.point), forest.site(&slider.rail.place), forest.hangs.len());
    match slider.rail.place.bar {
        Some(body) => constraint::slot_equation(name, &site, body, &origin_point, direction, law, angles),
        None => constraint::line_equation(
            name,
            &site,
            direction,
            direction.dot(origin_point.point.root),
            law,
            angles,
        ),
    }
}

/// Applied forces and torques.
pub(super) fn actions(scene: &Scene, forest: &Forest) -> Vec<Action> {
    let forces = scene.forces.iter().map(|force| Action {
        name: force.name.clone(),
        body: force.bar,
        kind: Kind::Force {
            point: forest.point(&Place { bar: Some(force.bar), point: force.point }),
            force: Complex::new(force.force[0], force.force[1]),
            follows: force.follows,
        },
        law: force.law.clone(),
    });
    let torques = scene.torques.iter().map(|torque| Action {
        name: torque.name.clone(),
        body: torque.bar,
        kind: Kind::Torque { torque: torque.torque, base: torque.relative_to },
        law: torque.law.clone(),
    });
    forces.chain(torques).collect()
}
