//! Applied forces, one file a kind.

pub mod action;
pub(crate) mod formula;
mod law;
pub(crate) mod meeting;
mod recorder;
pub(crate) mod span;
pub mod spring;
pub mod torsion;
pub mod user;
pub mod vibration;

pub use action::AppliedAction;
pub use spring::CompiledSpring;
pub use torsion::Torsion;
pub use user::{Force, Loads, UserForce};
pub use vibration::Vibration;
