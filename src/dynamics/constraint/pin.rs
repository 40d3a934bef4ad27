//! Two points that coincide: a hinge that closes a loop, as two rows, one along each axis.
//!
//! ```text
//! C = Re(conj(n) D),  D = P_a - P_b,   G_k = Re(conj(n) i gamma_k z_k),   C_t = 0,
//!     gamma = Re(conj(n) Pi_D),   n = 1, i
//! ```
//!
//! The force on the first point is -lambda n, on the second lambda n.

use super::{ConstraintEquation, ConstraintForce, ForceDirection, RowMeasure, Site};
use crate::arithmetic::{Complex, Real};
use crate::dynamics::quadratic::Quadratic;

/// Both rows that keep `a` on `b`, in a mechanism of so many angles.
pub fn pin_equations<C: Real>(
    name: &str,
    a: &Site<C>,
    b: &Site<C>,
    angles: usize,
) -> [ConstraintEquation<C>; 2] {
    let span = a.point.minus(&b.point);
    [("x", Complex::new(C::ONE, C::ZERO)), ("y", Complex::new(C::ZERO, C::ONE))].map(|(letter, axis)| {
        ConstraintEquation {
            name: format!("{name}.{letter}"),
            measure: RowMeasure::Place(Quadratic::along(&span, axis, angles)),
            law: None,
            push: Some(ConstraintForce { on: a.body, from: b.body, way: ForceDirection::Ground(axis) }),
            aim: None,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::constraint::tests::{assert_derivatives, crank, free, rod};

    #[test]
    fn its_derivatives_are_those_of_its_position() {
        for (a, b) in [(crank(), rod()), (rod(), free()), (free(), Site::ground([0.1, 0.2]))] {
            pin_equations("pin", &a, &b, 2).iter().for_each(assert_derivatives);
        }
    }
}
