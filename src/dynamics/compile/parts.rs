//! The parts of a scene that become rows, joints and applied forces.

use super::{Body, Joint};
use crate::arithmetic::{Complex, Real};
use crate::dynamics::constraint::{self, ConstraintEquation, RowMeasure};
use crate::dynamics::force::action::Applied;
use crate::dynamics::force::formula::{DrivenPart, PlacedAim};
use crate::dynamics::force::{AppliedAction, CompiledSpring, Torsion};
use crate::dynamics::forest::Forest;
use crate::dynamics::impact::Contact;
use crate::dynamics::law::Law;
use crate::dynamics::point::Point;
use crate::dynamics::quadratic::Quadratic;
use crate::scene::{Coupled, Coupling, Place, Scene, Slider, Wall};

/// The contacts of a scene, one a wall.
pub(super) fn contacts(scene: &Scene, forest: &Forest) -> Vec<Contact> {
    let contact = |wall: &Wall| {
        let normal = Complex::new(wall.normal[0], wall.normal[1]);
        let (row, point) = along_wall(forest, wall, normal, wall.law.clone());
        Contact { point, on: wall.on, ..Contact::new(row, normal, wall.restitution) }
    };
    scene.walls.iter().map(contact).collect()
}

/// The bodies, counted from the points they hang on.
pub(super) fn bodies<C: Real>(scene: &Scene<C>, forest: &Forest<C>) -> Vec<Body<C>> {
    (scene.bars.iter().zip(&forest.hangs))
        .map(|(bar, hang)| Body {
            name: bar.name.clone(),
            mass: bar.mass,
            inertia: bar.inertia,
            centre: Complex::new(bar.centre[0], bar.centre[1]) - hang.own,
            ends: [-hang.own, Complex::new(bar.length, C::ZERO) - hang.own],
        })
        .collect()
}

/// Motors, locks, and the angles that welds and locked sliders keep; those not given are what they are at the
/// start.
pub(super) fn given_angles<C: Real>(scene: &Scene<C>) -> Vec<ConstraintEquation<C>> {
    let motors = scene.motors.iter().map(|motor| {
        constraint::angle_equation(&motor.name, motor.bar, motor.relative_to, motor.law.clone())
    });
    let phi = |bar: Option<usize>| bar.map_or(C::ZERO, |bar| scene.start[bar].phi);
    let keep = |name: &str, a: Option<usize>, b: Option<usize>, angle: Option<C>| {
        let (body, base) = if let Some(a) = a { (a, b) } else { (b?, None) };
        let angle = angle.unwrap_or_else(|| phi(Some(body)) - phi(base));
        Some(constraint::angle_equation(name, body, base, Law { start: angle, ..Law::default() }))
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
pub(super) fn kept_angles<C>(scene: &Scene<C>) -> Vec<usize> {
    let locks = scene.locks.iter().map(|lock| lock.angle.is_none());
    let others = scene.welds.len() + scene.sliders.iter().filter(|slider| slider.locked).count();
    let kept = locks.chain(std::iter::repeat_n(true, others));
    (scene.motors.len()..).zip(kept).filter(|(_, kept)| *kept).map(|(row, _)| row).collect()
}

/// Hinges and welds; those that close a loop add their rows.
pub(super) fn joints<C: Real>(
    scene: &Scene<C>,
    forest: &Forest<C>,
    rows: &mut Vec<ConstraintEquation<C>>,
) -> Vec<Joint<C>> {
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
pub(super) fn slide<C: Real>(forest: &Forest<C>, slider: &Slider<C>) -> ConstraintEquation<C> {
    on_rail(forest, &slider.name, slider, rail(slider).left(), None)
}

/// The row that gives a slider's travel.
pub(super) fn travel<C: Real>(
    forest: &Forest<C>,
    name: &str,
    slider: &Slider<C>,
    law: Law<C>,
) -> ConstraintEquation<C> {
    on_rail(forest, name, slider, rail(slider), Some(law))
}

/// The row of the travel of a slider without a law.
pub(crate) fn travel_along<C: Real>(forest: &Forest<C>, slider: &Slider<C>) -> ConstraintEquation<C> {
    on_rail(forest, &slider.name, slider, rail(slider), None)
}

/// The row of a motor whose aim depends on the mechanism, without its aim.
pub(super) fn follows<C: Real>(
    forest: &Forest<C>,
    Coupling { name, coupled, .. }: &Coupling,
    scene: &Scene<C>,
) -> ConstraintEquation<C> {
    match *coupled {
        Coupled::Travel(slider) => {
            on_rail(forest, name, &scene.sliders[slider], rail(&scene.sliders[slider]), None)
        }
        Coupled::Angle { .. } => {
            let nothing = Quadratic { angles: forest.hangs.len(), ..Quadratic::default() };
            ConstraintEquation {
                name: name.clone(),
                measure: RowMeasure::Place(nothing),
                law: None,
                push: None,
                aim: None,
            }
        }
    }
}

/// Gives rows and walls their aims, by name; rows that were released have none.
pub(super) fn give_aims(
    rows: &mut [ConstraintEquation],
    contacts: &mut [Contact],
    aims: Vec<PlacedAim<'_, f64>>,
) {
    give(rows, contacts.iter_mut().map(|wall| &mut wall.row), aims);
}

/// The same where the rows of walls are by themselves.
pub(super) fn give<'a, C: Real + 'a>(
    rows: &mut [ConstraintEquation<C>],
    walls: impl Iterator<Item = &'a mut ConstraintEquation<C>>,
    aims: Vec<PlacedAim<'_, C>>,
) {
    let mut walls: Vec<_> = walls.collect();
    for (DrivenPart { name, is_wall }, aim) in aims {
        let row = match is_wall {
            true => walls.iter_mut().map(|row| &mut **row).find(|row| row.name == *name),
            false => rows.iter_mut().find(|row| row.name == *name && !row.is_angle()),
        };
        if let Some(row) = row {
            row.aim = Some(aim);
        }
    }
}

/// The row of how far a point is from the line of its wall along a direction in the frame of what carries it,
/// and the point as seen from there.
pub(in crate::dynamics) fn along_wall<C: Real>(
    forest: &Forest<C>,
    wall: &Wall<C>,
    direction: Complex<C>,
    law: Option<Law<C>>,
) -> (ConstraintEquation<C>, Point<C>) {
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

fn rail<C: Real>(slider: &Slider<C>) -> Complex<C> {
    Complex::new(slider.rail.direction[0], slider.rail.direction[1])
}

fn on_rail<C: Real>(
    forest: &Forest<C>,
    name: &str,
    slider: &Slider<C>,
    direction: Complex<C>,
    law: Option<Law<C>>,
) -> ConstraintEquation<C> {
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

/// The rows of sliders, then those of motors on sliders.
pub(super) fn guides<C: Real>(scene: &Scene<C>, forest: &Forest<C>) -> Vec<ConstraintEquation<C>> {
    let slides = scene.sliders.iter().map(|slider| slide(forest, slider));
    let drives = scene.drives.iter();
    let travels =
        drives.map(|drive| travel(forest, &drive.name, &scene.sliders[drive.slider], drive.law.clone()));
    slides.chain(travels).collect()
}

/// The rows of rigid springs.
pub(super) fn rods<C: Real>(scene: &Scene<C>, forest: &Forest<C>) -> Vec<ConstraintEquation<C>> {
    let rod = |spring: &crate::scene::Spring<C>| {
        let [a, b] = spring.between.each_ref().map(|place| forest.site(place));
        constraint::rod_equation(&spring.name, &a, &b, spring.free_length, scene.bars.len())
    };
    scene.springs.iter().filter(|spring| spring.rigid).map(rod).collect()
}

/// Springs that are elastic.
pub(super) fn springs<C: Real>(scene: &Scene<C>, forest: &Forest<C>) -> Vec<CompiledSpring<C>> {
    (scene.springs.iter().filter(|spring| !spring.rigid))
        .map(|spring| CompiledSpring {
            name: spring.name.clone(),
            bodies: [spring.between[0].bar, spring.between[1].bar],
            span: forest.point(&spring.between[0]).minus(&forest.point(&spring.between[1])),
            stiffness: spring.stiffness,
            free_length: spring.free_length,
            damping: spring.damping,
        })
        .collect()
}

/// Torsion springs.
pub(super) fn torsions<C: Real>(scene: &Scene<C>) -> Vec<Torsion<C>> {
    (scene.torsion_springs.iter())
        .map(|torsion| Torsion {
            name: torsion.name.clone(),
            body: torsion.bar,
            base: torsion.relative_to,
            stiffness: torsion.stiffness,
            free_angle: torsion.free_angle,
            damping: torsion.damping,
        })
        .collect()
}

/// Applied forces and torques.
pub(super) fn actions<C: Real>(scene: &Scene<C>, forest: &Forest<C>) -> Vec<AppliedAction<C>> {
    let forces = scene.forces.iter().map(|force| AppliedAction {
        name: force.name.clone(),
        body: force.bar,
        kind: Applied::Force {
            point: forest.point(&Place { bar: Some(force.bar), point: force.point }),
            force: Complex::new(force.force[0], force.force[1]),
            follows: force.follows,
        },
        law: force.law.clone(),
    });
    let torques = scene.torques.iter().map(|torque| AppliedAction {
        name: torque.name.clone(),
        body: torque.bar,
        kind: Applied::Torque { torque: torque.torque, base: torque.relative_to },
        law: torque.law.clone(),
    });
    forces.chain(torques).collect()
}
