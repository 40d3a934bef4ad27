//! The flags of commands that derive and fit.

#[cfg(feature = "charts")]
use super::ChartFlags;
use super::{SceneFlags, positive};
use crate::run::Measure;
use clap::Args;
use std::path::PathBuf;

/// `driftless sensitivity`.
#[derive(Debug, Args)]
pub struct SensitivityFlags {
    #[allow(missing_docs)]
    #[command(flatten)]
    pub scene: SceneFlags,
    /// What to derive, joined by commas: outputs as bar2.phi or tip.x, max:motor.torque, min:OUTPUT, flip (first
    /// time a bar turns over), event:NAME, impact:WALL (first times)
    #[arg(long, value_name = "MEASURES", value_delimiter = ',', allow_hyphen_values = true)]
    pub of: Vec<Measure>,
    /// By which numbers of the scene, joined by commas, as gravity[0],bar1.phi,spring.stiffness
    #[arg(long, value_name = "PATHS", value_delimiter = ',')]
    pub to: Vec<String>,
    /// Time of the outputs and end of the run in seconds [default: the scene's]
    #[arg(long, value_name = "S", value_parser = positive, allow_hyphen_values = true)]
    pub at: Option<f64>,
    /// Write and draw the derivatives over time
    #[arg(long)]
    pub over_time: bool,
    /// Interval of these rows in seconds [default: a two hundredth of the run]
    #[arg(long, value_name = "S", value_parser = positive, allow_hyphen_values = true)]
    pub every: Option<f64>,
    /// A number with its standard deviation, for bands of uncertainty over time; repeatable
    #[arg(long, value_name = "PATH=SIGMA", value_parser = named_size, allow_hyphen_values = true)]
    pub uncertainty: Vec<(String, f64)>,
    /// Find all Lyapunov exponents of the motion instead, and tell whether it is chaotic or regular
    #[arg(long, conflicts_with_all = ["of", "to", "over_time", "every", "uncertainty"])]
    pub lyapunov: bool,
    /// Tolerance of the motion [default: 1e-14]
    #[arg(long, value_name = "TOL", value_parser = positive, allow_hyphen_values = true)]
    pub rtol: Option<f64>,
    /// Folder under which `SCENE/sensitivity` or `SCENE/lyapunov` is made
    #[arg(long, value_name = "DIR", default_value = "output", help_heading = "Files")]
    pub out: PathBuf,
    /// Overwrite what is in the folder
    #[arg(long, help_heading = "Files")]
    pub force: bool,
    #[allow(missing_docs)]
    #[cfg(feature = "charts")]
    #[command(flatten)]
    pub charts: ChartFlags,
}

/// `driftless fit`.
#[derive(Debug, Args)]
pub struct FitFlags {
    #[allow(missing_docs)]
    #[command(flatten)]
    pub scene: SceneFlags,
    /// Table of measurements (CSV): a column `t [s]`, others named as in trajectory.csv, as `bar1.phi [rad]`
    #[arg(long, value_name = "FILE")]
    pub data: PathBuf,
    /// Numbers of the scene to find, joined by commas; the search begins at their values in the scene
    #[arg(long, value_name = "PATHS", value_delimiter = ',', required = true)]
    pub vary: Vec<String>,
    /// Columns that count, joined by commas [default: all that mean something in the scene]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub columns: Vec<String>,
    /// Standard deviation of a column's noise, in its unit; repeatable [default: found from the residuals]
    #[arg(long, value_name = "COLUMN=SIGMA", value_parser = named_size, allow_hyphen_values = true)]
    pub sigma: Vec<(String, f64)>,
    /// Parts of the data for multiple shooting, short against the growth of small differences of a chaotic motion
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub segments: u32,
    /// Tolerance of the motion [default: 1e-14]
    #[arg(long, value_name = "TOL", value_parser = positive, allow_hyphen_values = true)]
    pub rtol: Option<f64>,
    /// Folder under which `SCENE/fit` is made
    #[arg(long, value_name = "DIR", default_value = "output", help_heading = "Files")]
    pub out: PathBuf,
    /// Overwrite what is in the folder
    #[arg(long, help_heading = "Files")]
    pub force: bool,
    #[allow(missing_docs)]
    #[cfg(feature = "charts")]
    #[command(flatten)]
    pub charts: ChartFlags,
}

/// A name and a number above zero, as `gravity[0]=0.01`.
fn named_size(text: &str) -> Result<(String, f64), String> {
    let read = text.split_once('=').and_then(|(name, size)| Some((name.trim(), positive(size).ok()?)));
    let (name, size) =
        read.ok_or_else(|| "must be NAME=SIZE with a size above 0, as gravity[0]=0.01".to_owned())?;
    Ok((name.to_owned(), size))
}
