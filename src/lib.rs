#![forbid(unsafe_code)]
#![warn(missing_docs)]
//! Long-horizon integration of planar mechanisms with constraint stabilization.

pub mod arithmetic;
#[cfg(feature = "charts")]
pub mod chart;
#[cfg(feature = "cli")]
pub mod cli;
pub mod dynamics;
pub mod report;
pub mod run;
pub mod scene;
pub mod stabilization;
pub mod stepping;
