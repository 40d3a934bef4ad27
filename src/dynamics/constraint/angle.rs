//! A given angle, absolute or relative: a motor, or a lock where the law is a constant.
//!
//! ```text
//! C = q_a - q_b - theta(t),   G_a = 1, G_b = -1,   C_t = -theta',   gamma = -theta''
//! ```
//!
//! C is taken modulo whole turns.  The multiplier is minus the torque on body a; the motor's power is torque
//! · theta'.

use super::{ConstraintEquation, RowMeasure};
use crate::dynamics::law::Law;

/// Keeps the angle of `body`, measured from `base` or from +x, at a law of time.
pub fn angle_equation<C>(name: &str, body: usize, base: Option<usize>, law: Law<C>) -> ConstraintEquation<C> {
    ConstraintEquation {
        name: name.into(),
        measure: RowMeasure::Angle { body, base },
        law: Some(law),
        push: None,
        aim: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::constraint::tests::{assert_derivatives, law};

    #[test]
    fn its_derivatives_are_those_of_its_position() {
        assert_derivatives(&angle_equation("absolute", 0, None, law()));
        assert_derivatives(&angle_equation("relative", 1, Some(0), law()));
    }
}
