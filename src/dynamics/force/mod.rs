//! Applied forces, one file a kind.

pub mod action;
pub mod spring;
pub mod torsion;
pub mod vibration;

pub use action::Action;
pub use spring::Spring;
pub use torsion::Torsion;
pub use vibration::Vibration;
