//! The flags of commands that study a scene by more than a run.

use super::values::{
    count, limit, methods, number, positions, positive, rate, segments, stabilizations, starts, threads, wait,
};
use super::*;
use crate::run::Measure;

/// `driftless sweep`.
#[derive(Clone, Debug, Args)]
pub struct SweepFlags {
    #[allow(missing_docs)]
    #[command(flatten)]
    pub scene: SceneFlags,
    /// Vary a value, as in bar1.phi=-pi..pi:64 or springs.spring.stiffness=1..10:4; several make a grid, of
    /// which the first varies slowest
    #[arg(
        long,
        value_name = "NAME=FROM..TO:COUNT",
        required = true,
        allow_hyphen_values = true,
        help_heading = "Points"
    )]
    pub vary: Vec<Vary>,
    /// End each point when a bar first turns over (its angle passes an odd multiple of pi)
    #[arg(long, help_heading = "Points")]
    pub to_flip: bool,
    /// Threads [default: all processors]; the table is the same whatever their number
    #[arg(long, value_name = "N", value_parser = threads, allow_hyphen_values = true,
        help_heading = "Points")]
    pub threads: Option<u16>,
    /// Run part I of N alone, into a folder shard-I-of-N of the sweep's own; `driftless merge` joins them
    #[arg(long, value_name = "I/N", value_parser = clap::value_parser!(Shard), help_heading = "Points")]
    pub shard: Option<Shard>,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub plan: PlanFlags,
    /// Estimate the error of every point and the time up to which it can be trusted, in two more columns:
    /// off, auto (in lanes a second sweep at a hundredth of the tolerance: about 2.2 times the work), full
    /// (as single runs)
    #[arg(long, value_name = "HOW", value_parser = levels(), default_value = Level::Off.name(),
        help_heading = "Trust")]
    pub trust: Level,
    /// Stop a point where its energy is off by more than this share of its scale [default: what the tolerance
    /// explains, 0.01 at most]
    #[arg(long, value_name = "SHARE", value_parser = limit, allow_hyphen_values = true,
        help_heading = "Limits")]
    pub max_energy_drift: Option<f64>,
    /// Stop a point where a constraint is off by more, in rad or m, or that per second [default: 0.01 rad, or
    /// sizes of the mechanism, in position]
    #[arg(long, value_name = "SIZE", value_parser = limit, allow_hyphen_values = true,
        help_heading = "Limits")]
    pub max_constraint_drift: Option<f64>,
    /// Folder under which `SCENE/sweep-NAMES-METHOD-SETTING` is made
    #[arg(long, value_name = "DIR", default_value = "output", help_heading = "Files")]
    pub out: PathBuf,
    /// Overwrite the sweep that is in the folder
    #[arg(long, help_heading = "Files")]
    pub force: bool,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub checkpoints: CheckpointFlags,
    #[allow(missing_docs)]
    #[cfg(feature = "charts")]
    #[command(flatten)]
    pub charts: ChartFlags,
    /// Write a page, `sweep.html`: a click on the chart shows the motion of that point, or of the nearest of
    /// some that are kept
    #[cfg(feature = "charts")]
    #[arg(long, conflicts_with = "shard", help_heading = "Files")]
    pub html: bool,
    /// Column of the table to draw over one or two varied values [default: flip_time]
    #[cfg(feature = "charts")]
    #[arg(long, value_name = "COLUMN", conflicts_with = "no_charts", help_heading = "Files")]
    pub map: Option<String>,
}

/// `driftless stress`.
#[derive(Debug, Args)]
pub struct StressFlags {
    /// Scenes [default: the shipped set, whose ends are known]
    #[arg(value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
    /// Methods, joined by commas [default: all]
    #[arg(long, value_name = "METHODS", value_parser = methods(), value_delimiter = ',')]
    pub methods: Vec<MethodId>,
    /// Evaluations allowed for each scene and method
    #[arg(long, alias = "effort", value_name = "N", default_value_t = MAX_EVALUATIONS,
        value_parser = count, allow_hyphen_values = true)]
    pub max_evaluations: u64,
    /// What the end of a scene given may be off, in rad
    #[arg(long, value_name = "RAD", default_value_t = 1e-4, value_parser = limit, allow_hyphen_values = true,
        requires = "scenes")]
    pub tolerance: f64,
    /// Threads [default: all processors]; the cells are the same whatever their number
    #[arg(long, value_name = "N", value_parser = threads, allow_hyphen_values = true)]
    pub threads: Option<u16>,
    /// Folder under which `stress` is made
    #[arg(long, help_heading = "Files", value_name = "DIR", default_value = "output")]
    pub out: PathBuf,
    /// Overwrite what is in the folder
    #[arg(long, help_heading = "Files")]
    pub force: bool,
    #[allow(missing_docs)]
    #[cfg(feature = "charts")]
    #[command(flatten)]
    pub charts: ChartFlags,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub tell: TellFlags,
}

/// `driftless kinematics`.
#[derive(Debug, Args)]
pub struct KinematicsFlags {
    #[allow(missing_docs)]
    #[command(flatten)]
    pub scene: SceneFlags,
    /// What is driven, and from where to where in rad or m: a motor, a body or a slider, as crank,
    /// crank=0..2pi or slider=-0.1..0.1 [default: the first motor, one turn from the start]
    #[arg(long, value_name = "NAME[=FROM..TO]", value_parser = clap::value_parser!(KinematicDrive),
        allow_hyphen_values = true)]
    pub drive: Option<KinematicDrive>,
    /// Rate of the drive in rad/s or m/s [default: that of the motor at the start, 1 elsewhere]
    #[arg(long, value_name = "RATE", value_parser = rate, allow_hyphen_values = true)]
    pub rate: Option<f64>,
    /// Positions at equal distances over the range; one more stands at its end
    #[arg(long, value_name = "N", default_value_t = 360,
        value_parser = positions, allow_hyphen_values = true)]
    pub positions: u32,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub folder: FolderFlags,
}

/// `driftless modes`.
#[derive(Debug, Args)]
pub struct ModesFlags {
    #[allow(missing_docs)]
    #[command(flatten)]
    pub scene: SceneFlags,
    /// Positions from which equilibria or periodic motions are looked for, beside the scene's start
    #[arg(long, value_name = "N", default_value_t = 64,
        value_parser = starts, allow_hyphen_values = true)]
    pub starts: u32,
    /// Look for motions of this period in seconds; by default that of motors at a constant rate and of sines
    #[arg(long, value_name = "S", value_parser = positive, allow_hyphen_values = true)]
    pub period: Option<f64>,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub folder: FolderFlags,
    #[allow(missing_docs)]
    #[cfg(feature = "charts")]
    #[command(flatten)]
    pub motion: MotionFlags,
}

/// `driftless compare`.
#[derive(Debug, Args)]
pub struct CompareFlags {
    #[allow(missing_docs)]
    #[command(flatten)]
    pub scene: SceneFlags,
    /// Methods, joined by commas [default: all]
    #[arg(long, value_name = "METHODS", value_parser = methods(), value_delimiter = ',',
        help_heading = "Comparison")]
    pub methods: Vec<MethodId>,
    /// How constraints are kept; several, joined by commas, are compared with one another [default: each
    /// method's usual way]
    #[arg(long, value_name = "HOW", value_parser = stabilizations(), value_delimiter = ',',
        help_heading = "Comparison")]
    pub stabilize: Vec<Stabilization>,
    /// Horizon in seconds [default: the scene's, or what there is time for]
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true,
        help_heading = "Comparison")]
    pub until: Option<f64>,
    /// Seconds to spend: for the reference, for one run of each setting, and for repetitions that make their
    /// times sure
    #[arg(long, value_name = "S", value_parser = wait, default_value = "90", allow_hyphen_values = true,
        help_heading = "Comparison")]
    pub budget: f64,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub folder: FolderFlags,
    /// Write a page, `compare.html`: points of the charts tell their settings
    #[cfg(feature = "charts")]
    #[arg(long, help_heading = "Files")]
    pub html: bool,
}

/// `driftless sensitivity`.
#[derive(Debug, Args)]
pub struct SensitivityFlags {
    #[allow(missing_docs)]
    #[command(flatten)]
    pub scene: SceneFlags,
    /// What to derive, joined by commas: outputs as bar2.phi or tip.x, max:motor.torque, min:OUTPUT, flip
    /// (first time a bar turns over), event:NAME, impact:WALL (first times)
    #[arg(long, value_name = "MEASURES", value_delimiter = ',', allow_hyphen_values = true)]
    pub of: Vec<Measure>,
    /// By which numbers of the scene, joined by commas, as bar1.phi,spring.stiffness
    #[arg(long, value_name = "PATHS", value_delimiter = ',')]
    pub to: Vec<String>,
    /// Time of the outputs and end of the run in seconds [default: the scene's]
    #[arg(long, value_name = "S", value_parser = positive, allow_hyphen_values = true)]
    pub at: Option<f64>,
    /// Write and draw the derivatives over time
    #[arg(long)]
    pub over_time: bool,
    /// Interval of these rows in seconds [default: 1/200 of the run]
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
    #[allow(missing_docs)]
    #[command(flatten)]
    pub folder: FolderFlags,
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
    /// Standard deviation of a column's noise, in the unit of its header; repeatable [default: found from the
    /// residuals]
    #[arg(long, value_name = "COLUMN=SIGMA", value_parser = named_size, allow_hyphen_values = true)]
    pub sigma: Vec<(String, f64)>,
    /// Parts of the data for multiple shooting, short against the growth of small differences of a chaotic
    /// motion
    #[arg(long, value_name = "N", default_value_t = 1,
        value_parser = segments, allow_hyphen_values = true)]
    pub segments: u32,
    /// Tolerance of the motion [default: 1e-14]
    #[arg(long, value_name = "TOL", value_parser = positive, allow_hyphen_values = true)]
    pub rtol: Option<f64>,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub folder: FolderFlags,
}

/// Where a study of a scene leaves its results.
#[derive(Clone, Debug, Args)]
pub struct FolderFlags {
    /// Folder for the results, in a folder of the scene's name and one of the study's
    #[arg(long, value_name = "DIR", default_value = "output", help_heading = "Files")]
    pub out: PathBuf,
    /// Overwrite the results that are in the folder
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
