#![deny(unsafe_code)]
#![warn(missing_docs)]
//! Long-horizon integration of planar mechanisms with constraint stabilization.
//!
//! A *scene* (bars, hinges, springs, motors, walls) is compiled into equations of motion; a method integrates
//! them; drift of energy and constraints is watched on the way and reported with the result.
//!
//! ```
//! use driftless::{MethodId, Simulation, read_scene};
//!
//! # fn main() -> Result<(), driftless::Error> {
//! let scene = read_scene("examples/scenes/motor.json".as_ref(), &[])?;
//! let run = Simulation::new(&scene)?.method(MethodId::Taylor).tolerance(1e-15, 1e-15).until(5.0).every(0.5);
//! let outcome = run.run_with(|sample| {
//!     let (t, phi, torque) = (sample.t, sample.phi[1], sample.motors[0][0]);
//!     println!("{t:4.1} s: second bar at {phi:7.3} rad, torque {torque:6.3} N m");
//!     Ok(())
//! })?;
//! // The energy balance is kept to thirteen digits, and the motor's angle to the last.
//! assert!(outcome.drift.energy.max < 1e-13);
//! assert_eq!(outcome.drift.constraints[0].1[0].max, 0.0);
//! # Ok(())
//! # }
//! ```
//!
//! # Where to begin
//!
//! | for | see |
//! | --- | --- |
//! | a scene | [`read_scene`], [`SceneBuilder`], [`Scene`] |
//! | a run | [`Simulation`], [`Outcome`], [`Trajectory`]; step by step [`Run`], [`Running`], [`Snapshot`] |
//! | something of your own | [`Force`], [`Event`], [`Observer`], [`Integrator`] |
//! | many runs | [`Sweep`], [`compare`] |
//! | derivatives of a run, chaos | [`sensitivity`](fn@sensitivity), [`lyapunov`], `run::fit` |
//! | what went wrong | [`Error`] |
//!
//! # The rooms, in reading order
//!
//! Each uses only those before it.  What stands on a room's page is for users; its modules are for those who
//! work on the crate, and may change.
//!
//! | module | holds |
//! | --- | --- |
//! | [`arithmetic`] | the scalar trait, double-double, lanes, sine and cosine, exact sums, wrapped angles |
//! | [`scene`] | scenes as plain data, read strictly from JSON |
//! | [`dynamics`] | **the equation of motion**: begin here; its first page has the table of symbols |
//! | [`stepping`] | the methods, one a file |
//! | [`stabilization`] | Baumgarte and projection |
//! | [`run`] | from a scene to a result: plan, loop, samples, drift |
//! | `chart` | pictures of plain data (feature `charts`) |
//! | `html` | pages of plain data (feature `charts`) |
//! | [`report`] | results as text, JSON and pictures |
//! | `cli` | the program's commands (feature `cli`) |
//!
//! # Features
//!
//! `cli`, `charts`, `threads` (sweeps on several of them), `fit` and `digits` are on by default;
//! `default-features = false` leaves the core.  [`source_problem`] has the problem everything began with,
//! its published numbers and its errata.
//!
//! Units are SI throughout, angles in radians, absolute, from +x, counter-clockwise.

pub mod arithmetic;
#[cfg(feature = "charts")]
pub mod chart;
#[cfg(feature = "cli")]
pub mod cli;
pub mod dynamics;
mod error;
#[cfg(feature = "charts")]
pub mod html;
pub mod report;
pub mod run;
pub mod scene;
mod simulation;
pub mod stabilization;
pub mod stepping;

pub use arithmetic::{DoubleDouble, Scalar};
pub use dynamics::constraint::Site;
pub use dynamics::force::{Force, Loads, UserForce};
pub use dynamics::{Configuration, Mechanism, Motion, OdeSystem, State, Time};
pub use error::Error;
pub use run::trust::Level;
pub use run::{
    Action, Change, Custom, Direction, Drift, Event, EventRecord, Limits, Measure, MethodId, Observer,
    Outcome, Plan, Problem, Regime, Request, Run, Running, Sample, Sensitivity, SensitivityRequest, Snapshot,
    Spectrum, Stabilization, Step, Sweep, Trajectory, Trust, compare, lyapunov, reference, sensitivity,
};
pub use scene::{Scene, SceneBuilder, Template, ground, on, parse_scene, read_scene};
pub use simulation::Simulation;
pub use stepping::{Integrator, Statistics, StepError};

#[doc = include_str!("../docs/source-problem.md")]
pub mod source_problem {}

// The examples of the README and of the chapter on the library are compiled and run as documentation tests.
#[cfg(doctest)]
mod documentation {
    #[doc = include_str!("../README.md")]
    mod readme {}

    #[doc = include_str!("../docs/library.md")]
    mod library {}
}
