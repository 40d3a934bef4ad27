//! Keeping the constraints: one door each.
//!
//! [`baumgarte`] wraps the equations, [`projection`] and, for Gauss methods, [`symmetric`] wrap the method,
//! and elimination is a form of the mechanism ([`Elimination`](crate::dynamics::elimination::Elimination)).
//! No stepper knows of any of them.

#[doc(hidden)]
pub mod baumgarte;
#[doc(hidden)]
pub mod projection;
#[doc(hidden)]
pub mod symmetric;

pub use baumgarte::Baumgarte;
pub use projection::Projected;
pub use symmetric::SymmetricGauss;
