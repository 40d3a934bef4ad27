//! A point on a line of the ground with unit normal n: a wall while it holds or pushes, a slider, its travel
//! where n lies along the line.
//!
//! ```text
//! C = Re(conj(n) P) - s(t),   G_k = Re(conj(n) i gamma_k z_k),   C_t = -s',   gamma = Re(conj(n) Pi) - s''
//! ```
//!
//! C is positive on the side the normal points to.  The force on the point is -lambda n.

use super::{ConstraintEquation, ConstraintForce, ForceDirection, RowMeasure, Site};
use crate::arithmetic::{Complex, Real};
use crate::dynamics::law::Law;
use crate::dynamics::quadratic::Quadratic;

/// Keeps a point at the distance `offset` \[m\] from the origin along the unit vector `normal`, and the law's
/// travel \[m\] further.
pub fn line_equation<C: Real>(
    name: &str,
    site: &Site<C>,
    normal: Complex<C>,
    offset: C,
    law: Option<Law<C>>,
    angles: usize,
) -> ConstraintEquation<C> {
    let mut place = Quadratic::along(&site.point, normal, angles);
    place.constant -= offset;
    ConstraintEquation {
        name: name.into(),
        measure: RowMeasure::Place(place),
        law,
        push: Some(ConstraintForce { on: site.body, from: None, way: ForceDirection::Ground(normal) }),
        aim: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::constraint::tests::{assert_derivatives, free, law, rod};

    #[test]
    fn its_derivatives_are_those_of_its_position() {
        let normal = Complex::new(0.6, 0.8);
        assert_derivatives(&line_equation("wall", &rod(), normal, 0.3, None, 2));
        assert_derivatives(&line_equation("travel", &free(), normal, 0.3, Some(law()), 2));
    }
}
