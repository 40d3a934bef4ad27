//! Where everything is at the start, where that can be told from angles alone, and what must not begin there.

use super::{Hanging, HungBar, SAME};
use crate::arithmetic::shown::about;
use crate::scene::error::SceneError;
use crate::scene::read::At;
use crate::scene::{Place, Scene, Spring, Start, Wall};

/// Where everything is at t = 0.
pub(super) struct BarPositions {
    /// Origin \[m\], cos and sin of the angle, and the sum of the lengths that lead there \[m\], of each bar.
    bars: Vec<([f64; 2], [f64; 2], f64)>,
}

impl Hanging {
    /// Where everything is at `start`.
    pub fn configuration(&self, start: &[Start]) -> BarPositions {
        let bars =
            start.iter().map(|start| ([0.0; 2], [libm::cos(start.phi), libm::sin(start.phi)], 0.0)).collect();
        let mut configuration = BarPositions { bars };
        for HungBar { bar, from, own } in &self.order {
            let (hinge, way) = configuration.at(*from);
            let [c, s] = configuration.bars[*bar].1;
            let origin = [hinge[0] - (c * own[0] - s * own[1]), hinge[1] - (s * own[0] + c * own[1])];
            configuration.bars[*bar] = (origin, [c, s], way + own[0].abs() + own[1].abs());
        }
        configuration
    }
}

impl BarPositions {
    /// Position \[m\] of a place, and the sum of the lengths that lead there \[m\], which scales its rounding
    /// error.
    fn at(&self, place: Place) -> ([f64; 2], f64) {
        let [x, y] = place.point;
        let size = x.abs() + y.abs();
        let Some(bar) = place.bar else { return (place.point, size) };
        let ([x0, y0], [c, s], way) = self.bars[bar];
        ([x0 + c * x - s * y, y0 + s * x + c * y], way + size)
    }
}

/// Refuses a spring without a direction.
pub(super) fn springs(
    configuration: &BarPositions,
    springs: &[Spring],
    places: &[At],
) -> Result<(), SceneError> {
    for (Spring { name, between: [a, b], free_length, damping, .. }, at) in springs.iter().zip(places) {
        let ((from, way_from), (to, way_to)) = (configuration.at(*a), configuration.at(*b));
        let length = libm::hypot(to[0] - from[0], to[1] - from[1]);
        if (*free_length > 0.0 || *damping > 0.0) && length <= SAME * (way_from + way_to) {
            let (part, hint) = match *free_length > 0.0 {
                true => (format!("free length {free_length} m"), "set free_length to 0"),
                false => (format!("damping {damping} N s/m"), "set damping to 0"),
            };
            let problem = format!("(spring `{name}`) starts with length 0 and has the {part}");
            let hint = format!("its force has no direction there; start elsewhere, move an end, or {hint}");
            return Err(at.refuse(&problem, "such a spring must start with a positive length", &hint));
        }
    }
    Ok(())
}

/// Refuses a wall whose point starts behind it.
pub(super) fn walls(configuration: &BarPositions, scene: &Scene, places: &[At]) -> Result<(), SceneError> {
    for (wall, at) in scene.walls.iter().zip(places) {
        let Wall { name, bar, point, on, through, normal, law, aim, .. } = wall;
        // What a formula of places comes to is known when the scene is compiled.
        if scene.is_inactive(name) || aim.is_some() {
            continue;
        }
        let (position, way) = configuration.at(Place { bar: Some(*bar), point: *point });
        let (origin, way_there) = configuration.at(Place { bar: *on, point: *through });
        let [c, s] = on.map_or([1.0, 0.0], |bar| configuration.bars[bar].1);
        let turned = [c * normal[0] - s * normal[1], s * normal[0] + c * normal[1]];
        let travel = law.as_ref().map_or(0.0, |law| law.at_start().phi);
        let gap = (position[0] - origin[0]) * turned[0] + (position[1] - origin[1]) * turned[1] - travel;
        if gap < -SAME * (way + way_there + travel.abs()) {
            let problem = format!("(wall `{name}`) has its point {} m behind it at the start", about(-gap));
            let hint = format!(
                "start elsewhere, move the wall, or turn its normal to [{}, {}]",
                -normal[0], -normal[1]
            );
            return Err(at.refuse(
                &problem,
                "the point must start on the side the normal shows, or on the wall",
                &hint,
            ));
        }
    }
    Ok(())
}
