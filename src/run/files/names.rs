//! Names of the files that commands leave.

/// The trajectory.
pub const TRAJECTORY: &str = "trajectory.csv";
/// Settings and results.
pub const RECORD: &str = "run.json";
/// The events of a run.
pub const EVENTS: &str = "events.csv";
/// The points of a sweep.
pub const SWEEP: &str = "sweep.csv";
/// Settings and totals of a sweep.
pub const SWEEP_RECORD: &str = "sweep.json";
/// What joins a part of a sweep to the others.
pub const PART: &str = "part";
/// The settings of a comparison, a row each.
pub const COMPARISON: &str = "compare.csv";
/// Settings, figures and advice of a comparison.
pub const COMPARISON_RECORD: &str = "compare.json";
/// The positions of a mechanism moved through the range of its drive.
pub const KINEMATICS: &str = "kinematics.csv";
/// Limits, extremes and all else of it.
pub const KINEMATICS_RECORD: &str = "kinematics.json";
/// The equilibria of a scene and their modes.
pub const MODES_RECORD: &str = "modes.json";
/// Derivatives over time.
pub const SENSITIVITY: &str = "sensitivity.csv";
/// Derivatives of outputs and measures.
pub const SENSITIVITY_RECORD: &str = "sensitivity.json";
/// Lyapunov exponents over time.
pub const SPECTRUM: &str = "lyapunov.csv";
/// The Lyapunov spectrum.
pub const SPECTRUM_RECORD: &str = "lyapunov.json";
/// Measurements beside the fitted motion.
pub const FIT: &str = "fit.csv";
/// Fitted numbers and their errors.
pub const FIT_RECORD: &str = "fit.json";
/// Stiff and extreme scenes by every method, a row each.
pub const STRESS: &str = "stress.csv";
/// What became of them.
pub const STRESS_RECORD: &str = "stress.json";
/// The files by which a folder that holds results is known.
pub(super) const RESULTS: [&str; 17] = [
    TRAJECTORY,
    RECORD,
    SWEEP,
    SWEEP_RECORD,
    COMPARISON,
    COMPARISON_RECORD,
    KINEMATICS,
    KINEMATICS_RECORD,
    MODES_RECORD,
    SENSITIVITY,
    SENSITIVITY_RECORD,
    SPECTRUM,
    SPECTRUM_RECORD,
    FIT,
    FIT_RECORD,
    STRESS,
    STRESS_RECORD,
];
