//! Mechanics and integration, by the library alone.
//!
//! One program for many files: what they share is compiled once.

#[path = "common/andrews.rs"]
mod andrews;
#[path = "common/bernoulli.rs"]
mod bernoulli;
mod common;
#[path = "common/mechanisms/mod.rs"]
mod mechanisms;
#[path = "common/random.rs"]
#[allow(dead_code)]
mod random;
#[path = "common/relations.rs"]
mod relations;
#[path = "common/scaled.rs"]
#[allow(dead_code)]
mod scaled;
#[path = "common/switched.rs"]
mod switched;
#[path = "common/trees.rs"]
mod trees;

mod assembly;
mod batch;
mod batch_couplings;
mod batch_loops;
mod benchmarks;
mod bounces_beside_friction;
mod branches_of_motion;
mod breaking_away;
mod chains;
mod contact;
mod convergence;
mod couplings;
mod defect;
mod dense;
mod doors;
mod drift;
mod events;
mod extremes;
mod falling_rod;
#[cfg(feature = "fit")]
mod fit;
mod forces;
mod forces_at_points;
mod formulas;
#[cfg(feature = "digits")]
mod formulas_in_digits;
mod fractional_powers;
mod friction;
mod friction_impacts;
mod friction_reversals;
mod friction_shared;
#[cfg(feature = "digits")]
mod from_outside;
mod gauss;
mod identities;
mod impact;
mod jump_events;
mod kinematics;
mod latches;
mod laws;
mod laws_tangent;
mod linkage_scenes;
mod linkages;
mod looped;
#[cfg(feature = "digits")]
mod many_digits;
#[cfg(feature = "digits")]
mod many_digits_corners;
#[cfg(feature = "digits")]
mod many_digits_couplings;
#[cfg(feature = "digits")]
mod many_digits_events;
#[cfg(feature = "digits")]
mod many_digits_friction;
#[cfg(feature = "digits")]
mod many_digits_impacts;
#[cfg(feature = "digits")]
mod many_digits_resting;
#[cfg(feature = "digits")]
mod many_digits_switched;
#[cfg(feature = "digits")]
mod many_digits_walls;
mod many_turns;
mod metamorphic;
mod modes;
mod moving_walls;
mod natural;
mod natural_solve;
mod outputs;
mod periodic;
mod profiles;
mod published;
mod radau;
#[path = "mechanisms.rs"]
mod random_mechanisms;
mod rattle;
mod rattle_couplings;
mod release;
mod restart;
mod rigid;
mod rough_corners;
mod rough_supports;
mod scaling;
mod scenes;
mod sensitivity;
mod sensitivity_crossings;
mod singular;
mod spring_laws;
mod stabilization;
mod state_walls;
mod stiff;
mod switched_orders;
mod tables;
mod taylor;
mod turns;
mod walls;
mod windows;
mod work;
