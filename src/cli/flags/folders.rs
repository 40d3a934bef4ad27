//! The flags of commands that take folders of results.

use super::values::number;
use super::*;

/// `driftless resume`.
#[derive(Debug, Args)]
pub struct ResumeFlags {
    /// The folder of the run or sweep, or one above it that holds no other interrupted one
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// A later horizon in seconds, for a run
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true)]
    pub until: Option<f64>,
    /// Evaluations allowed in the whole run, those made so far counted in [default: as the run was begun]
    #[arg(long, alias = "effort", value_name = "N", value_parser = count, allow_hyphen_values = true)]
    pub max_evaluations: Option<u64>,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub checkpoints: CheckpointFlags,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub tell: TellFlags,
}

/// `driftless merge`.
#[derive(Debug, Args)]
pub struct MergeFlags {
    /// Folders of parts, or one that holds them all
    #[arg(value_name = "DIR", required = true)]
    pub folders: Vec<PathBuf>,
    /// Folder of the whole sweep [default: the one above the parts]
    #[arg(long, value_name = "DIR", help_heading = "Files")]
    pub out: Option<PathBuf>,
    /// Overwrite the sweep that is in the folder
    #[arg(long, help_heading = "Files")]
    pub force: bool,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub tell: TellFlags,
}

/// `driftless view`.
#[cfg(feature = "charts")]
#[derive(Debug, Args)]
pub struct ViewFlags {
    /// Folders of runs, or folders that hold some; the first is shown in full, the others beside it
    #[arg(value_name = "DIR", required = true)]
    pub folders: Vec<PathBuf>,
    /// Keep every row from this time on, in seconds, where a run is longer than a page can hold [default: the
    /// start]
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true)]
    pub from: Option<f64>,
    /// Keep every row up to this time, in seconds
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true)]
    pub to: Option<f64>,
    /// Lay the reference solution of the first run beside it, integrated anew as exactly as can be
    #[arg(long)]
    pub reference: bool,
    /// Folder of the page [default: the run's, or the one above several]
    #[arg(long, value_name = "DIR", help_heading = "Files")]
    pub out: Option<PathBuf>,
    #[allow(missing_docs)]
    #[command(flatten)]
    pub tell: TellFlags,
}
