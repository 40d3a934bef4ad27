//! Applied forces, one file a kind.

pub mod spring;

pub use spring::Spring;
