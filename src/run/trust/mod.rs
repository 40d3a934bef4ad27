//! How far a run may be trusted.

mod distance;

pub use distance::Ruler;
