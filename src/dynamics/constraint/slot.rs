//! A point on a line of a moving body b, with unit normal nu = n z_b, n in the body's frame: a slot, or the
//! travel along it where n lies along the line.
//!
//! ```text
//! C = Re(conj(nu) D) - s(t),  D = P - P_b on the line
//! G_k = Re(conj(nu) i gamma_k z_k),  plus Re(conj(i nu) D) at k = b
//! C_t = -s',   gamma = Re(conj(nu) Pi_D) + 2 w_b Re(conj(i nu) D') - w_b² Re(conj(nu) D) - s''
//! ```
//!
//! As a function of the elements it is bilinear.  The force on the point is -lambda nu, on the body lambda nu
//! at the same place.

use super::{ConstraintEquation, ConstraintForce, ForceDirection, RowMeasure, Site};
use crate::arithmetic::{Complex, Real};
use crate::dynamics::law::Law;
use crate::dynamics::quadratic::Quadratic;

/// Keeps a point at a distance, the law's or none, from the point `origin_point` of body `rail` along the
/// unit vector `normal` of that body's frame.
pub fn slot_equation<C: Real>(
    name: &str,
    site: &Site<C>,
    rail: usize,
    origin_point: &Site<C>,
    normal: Complex<C>,
    law: Option<Law<C>>,
    angles: usize,
) -> ConstraintEquation<C> {
    ConstraintEquation {
        name: name.into(),
        measure: RowMeasure::Place(Quadratic::along_body(
            &site.point.minus(&origin_point.point),
            rail,
            normal,
            angles,
        )),
        law,
        push: Some(ConstraintForce {
            on: site.body,
            from: Some(rail),
            way: ForceDirection::Body(rail, normal),
        }),
        aim: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::Scalar;
    use crate::dynamics::constraint::ConstraintArguments;
    use crate::dynamics::constraint::tests::{assert_derivatives, configuration, crank, free, law, rod};

    #[test]
    fn its_derivatives_are_those_of_its_position() {
        let normal = Complex::new(-0.6, 0.8);
        assert_derivatives(&slot_equation("slot", &rod(), 0, &crank(), normal, None, 2));
        assert_derivatives(&slot_equation("travel", &free(), 1, &rod(), normal, Some(law()), 2));
    }

    #[test]
    fn its_convective_term_is_that_of_the_turning_line() {
        let (normal, point, origin_point) = (Complex::new(-0.6, 0.8), rod(), crank());
        let row = slot_equation("slot", &point, 0, &origin_point, normal, None, 2);
        let (phi, z, omega) = configuration(0.3);
        let mut jacobian = vec![Default::default(); 4];
        let here = row.linearise(
            Default::default(),
            ConstraintArguments { phi: &phi, z: &z, omega: &omega },
            &mut jacobian,
        );
        let (nu, span) = (z[0].turn(normal), point.point.minus(&origin_point.point));
        let turned = omega[0] * nu.left().dot(span.velocity(&z, &omega));
        let expected = nu.dot(span.convective(&z, &omega)) + turned.scale(2.0)
            - omega[0] * omega[0] * nu.dot(span.position(&z));
        assert!((here.convective - expected).hi.abs() < 1e-15);
    }
}
