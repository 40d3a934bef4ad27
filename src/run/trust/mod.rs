//! How far a run may be trusted: its error estimated while it goes, and the time from which its path is no
//! longer that of its start.
//!
//! Beside the run goes a *reference solution*: the same mechanism from the same bits by
//! [`taylor`](crate::stepping::taylor) at 1e-14 or a hundredth of the run's tolerance, or in double-double
//! where the run is near rounding (module `finer`).  Both are looked at at times of the reference solution's
//! own, which depend neither on output times nor on rests:
//!
//! ```text
//! E(t) = max over the looks up to t of sqrt(d² + R²)
//!     d  largest difference of an angle [rad], or of a position over the longest bar
//!     R  the reference solution's own rounding where it is in doubles, carried along by the tangent flow
//! ```
//!
//! d is exact whatever the motion does, R matters near rounding only.  The *error estimate* is 1.2 E, the
//! *horizon* the first time E passes [`HORIZON`], and beyond [`LOST`] nothing is measured any more.  The
//! tangent flow tells besides how small differences grow, exponentially or as a power of time (module
//! `growth`), and what the last digit of the inputs as doubles comes to, about; what every number comes to by
//! the digits it is written with, runs of neighbouring scenes tell (module [`inputs`]).
//!
//! What the reference solution may cost is counted in work, not in seconds: the same run has the same figures
//! on every machine ([`budget`]).  Where it is used up, a regular motion's error is carried on by the power
//! law it followed so far, and said to be *extrapolated*; not where the reference solution stopped by itself.
//!
//! Source of the constants of R: fitted on random starts of double pendulums with springs and motors against
//! references in double-double; the table of `tests/trust.rs` is their test.

pub mod budget;
mod distance;
mod error_estimator;
mod finer;
mod flow;
mod growth;
pub mod inputs;
mod measured;
mod reference_run;
pub mod tangent;
mod torques;

pub use distance::DistanceMetric;
pub(super) use error_estimator::{ErrorEstimator, SavedEstimator};
pub use flow::{Flow, FlowState, flow};
pub(super) use growth::{TOO_SHORT, cannot_be_chaotic};
pub use inputs::{Input, Inputs};
use measured::LAST_DIGIT;
pub(super) use measured::crossing;
pub use tangent::TangentFlow;
pub(super) use tangent::{Ground, eliminate};

use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::fmt;
use std::str::FromStr;

/// The error \[rad\] whose first time is the horizon.
pub const HORIZON: f64 = 1e-3;
/// The error \[rad\] beyond which the run and its reference solution are two motions.
pub const LOST: f64 = 0.1;
/// What is said to be used up where the reference solution of [`Level::Full`] was cut short.
const CUT: &str = "the work limit of the reference solution";
/// What is printed is so many times E, and at least the rounding of an angle \[rad\].
pub(super) const CAUTION: f64 = 1.2;
pub(super) const LEAST: f64 = 2e-15;

/// How much may be spent on trust.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// Nothing.
    Off,
    /// At most [`budget::SHARE`] of the run's work.
    #[default]
    Auto,
    /// With a reference solution in double-double, up to [`budget::FULL_SHARE`] times the run's work and no
    /// more evaluations than it is allowed.
    Full,
}

impl Level {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Off, Self::Auto, Self::Full];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Auto => "auto",
            Self::Full => "full",
        }
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Level {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|level| level.name() == name)
            .ok_or_else(|| format!("no level `{name}`; there are off, auto, full"))
    }
}

/// Where an error estimate comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum How {
    /// From a reference solution up to its time.
    ReferenceSolution,
    /// Carried on by a power law from the time the reference solution ended \[s\].
    Extrapolated(f64),
    /// There is none for this time.
    #[default]
    None,
}

impl How {
    /// One word, as in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::ReferenceSolution => "companion",
            Self::Extrapolated(_) => "extrapolated",
            Self::None => "none",
        }
    }
}

/// How fast neighbouring motions part.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lyapunov {
    /// Largest exponent, as a mean over the time looked at \[1/s\].
    pub exponent: f64,
    /// Its standard error, from blocks of that time \[1/s\].
    pub uncertainty: f64,
    /// The time looked at \[s\].
    pub until: f64,
}

impl Lyapunov {
    /// The time in which errors grow tenfold \[s\].
    pub fn tenfold(&self) -> f64 {
        std::f64::consts::LN_10 / self.exponent
    }
}

/// How far a run may be trusted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Trust {
    /// Where the estimate comes from.
    pub how: How,
    /// The largest error of an angle \[rad\], or of a position over the longest bar, up to `at`, as
    /// estimated.
    pub error_estimate: Option<f64>,
    /// The largest error of a rate up to `at` \[rad/s\], or of a velocity over the longest bar \[1/s\].
    pub rate_error: Option<f64>,
    /// The largest error of a motor's torque up to `at` \[N·m\], or of its force \[N\].
    pub torque_error: Option<f64>,
    /// True where the reference solution is hardly finer than the run, so that the error is at most what is
    /// estimated.
    pub is_upper_bound: bool,
    /// The end of the run, or the horizon where that comes first \[s\].
    pub at: f64,
    /// The first time the error passes [`HORIZON`] \[s\].
    pub horizon: Option<f64>,
    /// The first look at which it is beyond [`LOST`] \[s\].
    pub lost: Option<f64>,
    /// For chaotic motions.
    pub lyapunov: Option<Lyapunov>,
    /// Of regular motions: the power of time with which small differences grow.
    #[serde(default)]
    pub growth_power: Option<f64>,
    /// Why nothing is known of the growth of small differences, or not from some time on.
    #[serde(default)]
    pub no_growth: Option<String>,
    /// Why it is told neither as an exponent nor as a power where it was followed.
    #[serde(default)]
    pub unclear_growth: Option<String>,
    /// What changes of the scene's numbers by about a last digit of a double come to at `at` \[rad\], or,
    /// with `inputs`, of their last digits as written; no error of the method.
    pub input_error: Option<f64>,
    /// What the digits of every number of the scene come to, where that was asked for (module [`inputs`]).
    pub inputs: Option<Inputs>,
    /// What the model is off by whatever the method does, where springs are taken for rods \[rad\]; the
    /// estimate is no smaller.
    pub model_error: Option<f64>,
    /// The reference solution, in words.
    pub error_estimator: Option<String>,
    /// What it shares with the run, so that it cannot tell where that is wrong, in words.
    pub shared: Vec<String>,
    /// How far it went beside the run \[s\].
    pub covered: f64,
    /// Why it went no further, where it did not.
    pub why: Option<String>,
    /// Times \[s\] and estimates \[rad\] up to there, thinned out.
    pub record: Vec<[f64; 2]>,
    /// Work of the reference solution, of that the tangent flow's, and the work of the run beside it, as
    /// counted by the prices of [`budget`] \[ns\].
    #[serde(default)]
    pub work: [f64; 3],
}

impl Trust {
    /// The same of a model with an error of its own \[rad\], which the reference solution shares, and which
    /// grows as that of the scene's numbers.
    pub(in crate::run) fn with_model(mut self, error: Option<f64>) -> Self {
        self.model_error = error;
        if let (Some(estimate), Some(model)) = (&mut self.error_estimate, error) {
            let growth = self.input_error.map_or(1.0, |error| (error / LAST_DIGIT).max(1.0));
            *estimate = estimate.max((model * growth).min(TAU));
        }
        self
    }

    /// True where the model alone may be off by more than [`HORIZON`] at the end.
    pub fn is_beyond_model(&self) -> bool {
        self.model_error.is_some() && self.horizon.is_none() && self.error_estimate > Some(HORIZON)
    }

    /// Why the reference solution was cut short, where all was to be spent on it.
    pub fn cut(&self) -> Option<&str> {
        self.why.as_deref().filter(|why| why.starts_with(CUT))
    }

    /// True where the end of the run lies beyond its horizon: the angles there are those of a typical motion
    /// at most.
    pub fn is_past(&self) -> bool {
        self.horizon.is_some()
    }
}
