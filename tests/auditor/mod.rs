//! An independent simulator of scenes, and the comparison of motions with it.
//!
//! It shares no physics with `src`: bodies have three coordinates each, every joint is an equation with its
//! own multiplier, scenes are read from plain JSON, and all arithmetic is in a double-double of its own.  It
//! is written to be read beside a textbook, not for speed.
//!
//! | file | holds |
//! | --- | --- |
//! | [`double_double`] | numbers of 106 bits |
//! | [`linear`] | constrained linear systems by elimination |
//! | [`reader`] | scenes from JSON |
//! | [`model`] | constraints, forces, accelerations, energies |
//! | [`start`] | complete starts, and projection onto the constraints |
//! | [`motion`] | the integrator: Gragg's midpoint rule, extrapolated |
//! | [`walls`] | impacts and persistent contact |
//! | [`verdict`] | the program's motion against the auditor's |
//! | [`coverage`] | which kinds met which methods |

mod coverage;
pub mod double_double;
pub mod linear;
#[path = "../common/mechanisms/mod.rs"]
pub mod mechanisms;
pub mod model;
pub mod motion;
pub mod pairs;
pub mod reader;
pub mod record;
pub mod start;
pub mod verdict;
pub mod walls;

#[cfg(test)]
mod closed_forms;
