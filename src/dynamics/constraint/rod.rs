//! Two points at a fixed distance: a rod without mass.
//!
//! ```text
//! C = (|D|² - L²) / 2L,  D = P_a - P_b,   G_k = Re(conj(D) i gamma_k z_k) / L,   C_t = 0,
//!     gamma = (Re(conj(D) Pi_D) + |D'|²) / L
//! ```
//!
//! Near the distance kept C is what the distance is off.  The force on the first point is -lambda D/L, on the
//! second lambda D/L.

use super::{ConstraintEquation, ConstraintForce, ForceDirection, RowMeasure, Site};
use crate::arithmetic::Real;
use crate::dynamics::quadratic::Quadratic;

/// Keeps `a` at the distance `length` \[m\] from `b`, in a mechanism of so many angles.
pub fn rod_equation<C: Real>(
    name: &str,
    a: &Site<C>,
    b: &Site<C>,
    length: C,
    angles: usize,
) -> ConstraintEquation<C> {
    let span = a.point.minus(&b.point);
    let mut place = Quadratic::square(&span, C::of(0.5) / length, angles);
    place.constant -= C::of(0.5) * length;
    ConstraintEquation {
        name: name.into(),
        measure: RowMeasure::Place(place),
        law: None,
        push: Some(ConstraintForce { on: a.body, from: b.body, way: ForceDirection::Span(span, length) }),
        aim: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::constraint::tests::{assert_derivatives, configuration, crank, free, rod};

    #[test]
    fn its_derivatives_are_those_of_its_position() {
        for (a, b) in [(crank(), rod()), (rod(), free()), (free(), Site::ground([0.1, 0.2]))] {
            assert_derivatives(&rod_equation("rod", &a, &b, 0.7, 2));
        }
    }

    #[test]
    fn it_measures_the_distance() {
        let (a, b) = (rod(), free());
        let (_, z, _) = configuration(0.3);
        let distance = a.point.minus(&b.point).position(&z).norm_squared().hi.sqrt();
        assert!(rod_equation("rod", &a, &b, distance, 2).gap(&z).hi.abs() < 1e-15);
        assert!((rod_equation("rod", &a, &b, distance - 1e-6, 2).gap(&z).hi - 1e-6).abs() < 1e-11);
    }
}
