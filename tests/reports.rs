//! Estimates, comparisons, sweeps, stress, and the program with its files and charts.
//!
//! One program for many files: what they share is compiled once.

#[path = "common/audit.rs"]
#[allow(dead_code)]
mod audit;
mod common;
#[path = "common/extremes.rs"]
#[allow(dead_code)]
mod extremes;
#[path = "common/formulas.rs"]
mod formulas;
#[path = "common/mechanisms/mod.rs"]
mod mechanisms;
#[path = "common/program.rs"]
#[allow(dead_code)]
mod program;
#[path = "common/random.rs"]
#[allow(dead_code)]
mod random;
#[path = "common/relations.rs"]
mod relations;
#[path = "common/switched.rs"]
mod switched;
#[path = "common/targets.rs"]
#[allow(dead_code)]
mod targets;

mod charts;
mod choices;
mod command_line;
mod compare;
#[cfg(feature = "digits")]
mod digits_program;
mod estimates;
mod fuzz;
mod growth;
mod growth_events;
mod inputs;
mod joint_forces;
mod messages;
mod resume;
mod stress;
mod sweep;
mod sweep_couplings;
mod sweep_events;
mod sweep_loops;
mod sweep_outputs;
mod sweep_walls;
mod trust;
#[cfg(feature = "charts")]
mod view;
#[path = "program.rs"]
mod whole_program;
