//! The command line: one table that is parser, help and completions.

#[cfg(feature = "digits")]
mod digits;
mod folders;
mod study;
mod values;

#[cfg(feature = "digits")]
pub use self::digits::DigitsFlags;
pub use folders::*;
pub use study::*;
#[cfg(feature = "charts")]
use values::window;
use values::{count, levels, limit, methods, number, preferences, stabilizations, wait};

#[cfg(feature = "charts")]
use super::charts::{ChartFlags, MotionFlags};
use super::failure::{Exit, Failure};
use super::output::{message, print};
use crate::run::kinematics::KinematicDrive;
use crate::run::stress::MAX_EVALUATIONS;
use crate::run::trust::Level;
use crate::run::{Limits, MethodId, Prefer, Request, Shard, Stabilization, Vary};
use crate::scene::{Override, TableFiles, Template, source_name, table_files};
use clap::error::ErrorKind;
use clap::{Args, Parser, Subcommand};
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

const EXIT_CODES: &str = "\
Exit codes: 0 done, 1 other failure, 2 usage, 3 scene refused, 4 integration stopped,
            5 a drift limit exceeded, 6 files, 130 interrupted after a checkpoint";

/// Simulates planar mechanisms over long horizons, and tells how far they drift.
#[derive(Debug, Parser)]
#[command(name = "driftless", version, max_term_width = 100, after_help = EXIT_CODES)]
pub struct Flags {
    #[allow(missing_docs)]
    #[command(subcommand)]
    pub command: Command,
    /// The command line they were read from.
    #[arg(skip)]
    pub arguments: Vec<String>,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Validate a scene and say what is active, what is left out, and which method would run it
    Check(CheckFlags),
    /// Show accelerations, multipliers, motors, hinge forces and energy at the start or a later time
    Inspect(InspectFlags),
    /// Run a scene and write its trajectory, record and charts
    Run(Box<RunFlags>),
    /// Run a scene over a grid of starts and parameters, one row of a table a point
    Sweep(Box<SweepFlags>),
    /// Move a mechanism through the range of its drive: positions, loads, limits, without integrating
    Kinematics(KinematicsFlags),
    /// Find equilibria with modes, or periodic motions with Floquet multipliers, and their stability
    Modes(ModesFlags),
    /// Derive outputs, extremes and times by numbers of the scene; bands of uncertainty; Lyapunov exponents
    Sensitivity(SensitivityFlags),
    /// Fit numbers of a scene to measured data, with their standard errors
    Fit(FitFlags),
    /// Run a scene with every method at all its settings: error, drift and run time, and what to choose
    Compare(Box<CompareFlags>),
    /// Go on with an interrupted run or sweep: byte for byte the files of one without interruption
    Resume(ResumeFlags),
    /// Join the parts of a sweep: the same table, chart and record as of one process, byte for byte
    Merge(MergeFlags),
    /// Make a page of finished runs: the mechanism plays, charts beside it, several runs over one another
    #[cfg(feature = "charts")]
    View(ViewFlags),
    /// Run stiff and extreme scenes by every method: each ends right, refused or stopped, and none wrong
    Stress(StressFlags),
    /// List the methods
    Methods {
        /// Print one JSON object
        #[arg(long)]
        json: bool,
    },
    /// Print the JSON Schema of scenes
    Schema,
    /// Print a script that completes commands and options in a shell
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

/// Which scene, and how to talk about it.
#[derive(Clone, Debug, Args)]
pub struct SceneFlags {
    /// Scene file (JSON), - for standard input; `driftless schema` describes it
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Set a value of the scene, as in walls.wall.restitution=0.5, bar1.phi=pi/2 or start.bar1.omega=-1/3;
    /// repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub set: Vec<Override>,
    /// Output beside those of the scene, as A.force, motor.torque, tip.x or work=motor.power/2; repeatable
    #[arg(long, value_name = "[NAME=]FORMULA", allow_hyphen_values = true)]
    pub output: Vec<String>,
    /// Refuse a scene of which something given for the start must change to fit its constraints
    #[arg(long)]
    pub strict: bool,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub tell: TellFlags,
    /// Files of the scene's tables that were read before.
    #[arg(skip)]
    pub tables: TableFiles,
}

/// How to run it.
#[derive(Clone, Debug, Default, PartialEq, Args)]
#[command(next_help_heading = "Integration")]
pub struct PlanFlags {
    /// Method; left out, one that suits the scene
    #[arg(long, value_parser = methods())]
    pub method: Option<MethodId>,
    /// Step of a fixed-step method in seconds, as 0.01 or 1/64
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true)]
    pub step: Option<f64>,
    /// Relative tolerance of an adaptive method [default: 1e-9; over a minute and more 1e-15 for taylor and
    /// less over 100 s, 1e-13 for dp8 and dop853]
    #[arg(long, value_name = "TOL", value_parser = number, allow_hyphen_values = true)]
    pub rtol: Option<f64>,
    /// Absolute tolerance of an adaptive method: in rad, and in the mechanism's own units of length, time and
    /// energy, which are m, s and J where it is of human size and powers of 1024 times these elsewhere
    /// [default: as --rtol]
    #[arg(long, value_name = "TOL", value_parser = number, allow_hyphen_values = true)]
    pub atol: Option<f64>,
    /// Horizon in seconds [default: the scene's]
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true)]
    pub until: Option<f64>,
    /// Output interval in seconds [default: the scene's]
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true)]
    pub every: Option<f64>,
    /// How motors' angles are kept; `run` and `check` take several, joined by commas, one after another
    /// [default: elimination, or projection with rattle]
    #[arg(long, value_name = "HOW", value_parser = stabilizations(), value_delimiter = ',')]
    pub stabilize: Vec<Stabilization>,
    /// Time constant of Baumgarte's term in seconds [default: five mean steps]
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true)]
    pub time_constant: Option<f64>,
    /// Carry the first orders of taylor's series in double-double: rounding in energy a thousandth of a plain
    /// run's, at tolerances down to 1e-25, and at 1e-20 without --rtol
    #[arg(long)]
    pub extended: bool,
    /// Evaluations of the equations allowed in a run; one that needs more stops with exit code 4 [default:
    /// 1e8, and 1e7 a simulated second, at most 1e10; at most 1e9 expansions of taylor's series]
    #[arg(long, alias = "effort", value_name = "N", value_parser = count, allow_hyphen_values = true)]
    pub max_evaluations: Option<u64>,
    /// What a method is chosen for where none is named [default: neither, the least time for the accuracy]
    #[arg(long, value_name = "WHAT", value_parser = preferences(), conflicts_with = "method")]
    pub prefer: Option<Prefer>,
}

/// `driftless check`.
#[derive(Debug, Args)]
pub struct CheckFlags {
    #[allow(missing_docs)]
    #[command(flatten)]
    pub scene: SceneFlags,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub plan: PlanFlags,
    /// Draw the start as a PNG, SVG or PDF file, or the closest configuration where what is given fits none
    #[cfg(feature = "charts")]
    #[arg(long, value_name = "FILE", help_heading = "Files")]
    pub chart: Option<PathBuf>,
}

const SIGNS: &str = "\
Signs, in the directions of the ground, torques counter-clockwise:
  hinge, weld   force of the first body of `between` on the second, also where
                the ground is second
  slider        force across the rail on the body of its `point`
  motor, lock   torque on its `body`; of a motor on a slider, force along the
                rail on the body of the slider's `point`
  NAME.angle    torque of a weld on the second body, of a locked slider on the
                body of its `point`; on the other body where that is the ground
  power         what the motor feeds in
A force or torque is minus the multiplier of its constraint; `on` and `from`
name both bodies.  Where constraints are redundant, forces that rigid bodies
leave open are named as indeterminate; those shown are the ones of least norm.";

/// `driftless inspect`.
#[derive(Debug, Args)]
#[command(after_help = SIGNS)]
pub struct InspectFlags {
    #[allow(missing_docs)]
    #[command(flatten)]
    pub scene: SceneFlags,
    /// Time in seconds, or the name of an event of the scene, which is then run up to there [default: the
    /// start]
    #[arg(long, value_name = "S|EVENT", allow_hyphen_values = true)]
    pub at: Option<String>,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub plan: PlanFlags,
}

/// `driftless run`.
#[derive(Clone, Debug, Args)]
pub struct RunFlags {
    #[allow(missing_docs)]
    #[command(flatten)]
    pub scene: SceneFlags,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub plan: PlanFlags,
    /// Estimate the error of the result and the time up to which it can be trusted: off, auto (30 % of the
    /// run's work without its output, and what takes about 20 to 50 ms), full (thirty times that work, and
    /// what takes about 5 s, but no more evaluations than --max-evaluations); work is counted, not timed
    #[arg(long, value_name = "HOW", value_parser = levels(), default_value = Level::Auto.name(),
        help_heading = "Trust")]
    pub trust: Level,
    #[allow(missing_docs)]
    #[cfg(feature = "digits")]
    #[command(flatten)]
    pub digits: DigitsFlags,
    /// Tell what the last digit of every number comes to, as it is written in the scene or in --set (0.25 is
    /// uncertain by 0.005, 670 by 0.5; 0, pi/2 and defaults are exact), in a table: usually two to four runs
    /// for each number
    #[arg(long, help_heading = "Trust")]
    pub inputs: bool,
    /// Stop with exit code 5 where the energy is off by more than this share of its scale [default: what the
    /// tolerance explains, 0.01 of the largest energy there has been at most]
    #[arg(long, value_name = "SHARE", value_parser = limit, allow_hyphen_values = true,
        help_heading = "Limits")]
    pub max_energy_drift: Option<f64>,
    /// Stop with exit code 5 where a constraint is off by more, in rad or m, or that per second [default:
    /// 0.01 rad, or sizes of the mechanism, in position]
    #[arg(long, value_name = "SIZE", value_parser = limit, allow_hyphen_values = true,
        help_heading = "Limits")]
    pub max_constraint_drift: Option<f64>,
    /// Folder under which `SCENE/METHOD-SETTING` is made
    #[arg(long, value_name = "DIR", default_value = "output", help_heading = "Files")]
    pub out: PathBuf,
    /// Overwrite the run that is in the folder
    #[arg(long, help_heading = "Files")]
    pub force: bool,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub checkpoints: CheckpointFlags,
    #[allow(missing_docs)]
    #[cfg(feature = "charts")]
    #[command(flatten)]
    pub charts: ChartFlags,
    #[allow(missing_docs)]
    #[cfg(feature = "charts")]
    #[command(flatten)]
    pub motion: MotionFlags,
    /// Write a page that plays the motion beside its charts, `run.html`; of several stabilizations one more
    /// of all, `runs.html`
    #[cfg(feature = "charts")]
    #[arg(long, help_heading = "Files")]
    pub html: bool,
    /// Draw these columns of the trajectory, joined by commas, as in bar1.x,bar2.omega; an output is drawn
    /// without
    #[cfg(feature = "charts")]
    #[arg(
        long,
        value_name = "COLUMNS",
        value_delimiter = ',',
        conflicts_with = "no_charts",
        help_heading = "Files"
    )]
    pub chart: Vec<String>,
    /// Show this part of the run in charts, animations and pages, in seconds; charts of drift show all of it
    /// [default: of charts all of it or as much as can be told apart, of animations the beginning]
    #[cfg(feature = "charts")]
    #[arg(long, value_name = "FROM..TO", value_parser = window, allow_hyphen_values = true,
        help_heading = "Files")]
    pub window: Option<[f64; 2]>,
}

/// How often checkpoints are written.
#[derive(Clone, Debug, Args)]
pub struct CheckpointFlags {
    /// Seconds of computing between two checkpoints, from which `driftless resume` goes on, after a first one
    /// at the start; 0: none but at Ctrl-C and SIGTERM
    #[arg(
        long,
        value_name = "S",
        value_parser = wait,
        default_value = "60",
        allow_hyphen_values = true,
        help_heading = "Files"
    )]
    pub checkpoint_every: f64,
}

/// What is told, and how.
#[derive(Clone, Debug, Args)]
pub struct TellFlags {
    /// Print exactly one JSON object on stdout
    #[arg(long)]
    pub json: bool,
    /// Print errors only: no progress, no messages, no summary
    #[arg(short, long)]
    pub quiet: bool,
    /// Say on stderr what is being done
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,
}

impl Flags {
    /// True where stdout is to hold one JSON object.
    pub fn is_json(&self) -> bool {
        match &self.command {
            Command::Check(flags) => flags.scene.tell.json,
            Command::Inspect(flags) => flags.scene.tell.json,
            Command::Kinematics(flags) => flags.scene.tell.json,
            Command::Modes(flags) => flags.scene.tell.json,
            Command::Sensitivity(flags) => flags.scene.tell.json,
            Command::Fit(flags) => flags.scene.tell.json,
            Command::Run(flags) => flags.scene.tell.json,
            Command::Sweep(flags) => flags.scene.tell.json,
            Command::Compare(flags) => flags.scene.tell.json,
            Command::Resume(flags) => flags.tell.json,
            Command::Merge(flags) => flags.tell.json,
            #[cfg(feature = "charts")]
            Command::View(flags) => flags.tell.json,
            Command::Stress(flags) => flags.tell.json,
            Command::Methods { json } => *json,
            Command::Schema | Command::Completions { .. } => false,
        }
    }
}

impl SceneFlags {
    /// Says something on stderr where that is wanted.
    pub(super) fn remark(&self, text: &str) {
        self.tell.remark(text);
    }

    /// The scene of this text.
    pub(super) fn template(&self, text: &str) -> Template {
        Template::new(text.to_owned(), source_name(&self.scene), &self.set).with_tables(self.tables.clone())
    }

    /// Reads the files of its tables, for as often as the scene is read and for checkpoints.
    pub(super) fn read_tables(&mut self, text: &str) {
        self.tables = table_files(text, &source_name(&self.scene), &self.set);
    }

    /// The entry `given` of `run.json`: the file, and what is changed and added, as typed.
    #[cfg(feature = "files")]
    pub(super) fn given(&self) -> serde_json::Value {
        let set: Vec<String> = self.set.iter().map(ToString::to_string).collect();
        serde_json::json!({"scene": self.scene.to_string_lossy(), "set": set, "output": self.output})
    }
}

impl TellFlags {
    /// Says something on stderr where that is wanted.
    pub(super) fn remark(&self, text: &str) {
        if self.verbose {
            message(text);
        }
    }
}

impl PlanFlags {
    /// What is asked of the plans: one for each stabilization given, or a single one.
    pub fn requests(&self) -> Vec<Request> {
        if self.stabilize.is_empty() {
            return vec![self.request(None)];
        }
        let given =
            self.stabilize.iter().enumerate().filter(|(i, kind)| !self.stabilize[..*i].contains(kind));
        given.map(|(_, &kind)| self.request(Some(kind))).collect()
    }

    fn request(&self, stabilize: Option<Stabilization>) -> Request {
        Request {
            method: self.method,
            step: self.step,
            rtol: self.rtol,
            atol: self.atol,
            until: self.until,
            every: self.every,
            stabilize,
            time_constant: self.time_constant,
            extended: self.extended,
            max_evaluations: self.max_evaluations,
            prefer: self.prefer,
        }
    }
}

impl RunFlags {
    /// The stated limits.
    pub fn limits(&self) -> Limits {
        Limits { energy: self.max_energy_drift, constraint: self.max_constraint_drift }
    }
}

/// Parses the command line, of which the first argument is the program's name.
///
/// # Errors
/// The exit code, where help was asked for (0) or the line makes no sense (2); what there is to say has been
/// said.
pub fn parse(arguments: impl IntoIterator<Item = OsString>) -> Result<Flags, ExitCode> {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let words = arguments.iter().map(|argument| argument.to_string_lossy().into_owned()).collect();
    Flags::try_parse_from(&arguments).map(|flags| Flags { arguments: words, ..flags }).map_err(|error| {
        if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
            return match print(&error.render().to_string()) {
                Ok(()) => ExitCode::SUCCESS,
                Err(failure) => failure.tell(false),
            };
        }
        let text = error.render().to_string();
        let text = text.trim_end();
        let is_help = error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
        if is_help && !arguments.iter().any(|argument| argument == "--json") {
            eprintln!("{text}");
            return ExitCode::from(Exit::Usage as u8);
        }
        let failure = Failure::new(Exit::Usage, text.strip_prefix("error: ").unwrap_or(text));
        failure.tell(arguments.iter().any(|argument| argument == "--json"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_table_is_sound() {
        Flags::command().debug_assert();
    }
}
