//! The fuzz targets, which the tests of the crate run too.

#[path = "../../tests/common/audit.rs"]
mod audit;
#[path = "../../tests/common/formulas.rs"]
mod formulas;
#[path = "../../tests/common/random.rs"]
pub mod random;
#[path = "../../tests/common/targets.rs"]
pub mod targets;
