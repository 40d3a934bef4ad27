//! `driftless resume`: go on with a run or a sweep that was interrupted, whatever ended it.

use super::failure::{Exit, Failure};
use super::flags::{Command, Flags, ResumeFlags};
use super::output::message;
use super::{simulate, sweep};
use crate::run::files::{RECORD, SWEEP_RECORD, quoted};
use crate::run::{
    CheckpointError, Checkpoints, Folder, Loaded, Snapshot, StreamPosition, Totals, checkpoint,
};
use clap::Parser;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// What a checkpoint of the program holds.
#[derive(Serialize, Deserialize)]
pub struct SavedWork {
    /// The version that wrote it.
    pub version: String,
    /// The command line, and the text of the scene it names.
    pub arguments: Vec<String>,
    pub scene: String,
    /// The files of its tables.
    pub tables: Vec<(String, String)>,
    /// How far the table was written.
    pub cursor: StreamPosition,
    pub work: PendingWork,
}

/// What was under way.
#[derive(Serialize, Deserialize)]
pub enum PendingWork {
    /// A run.
    Run(Box<Snapshot>),
    /// A sweep: what its points seen so far amount to, and its chart so far.
    Sweep(Totals, Option<Vec<u8>>),
    /// A run in many digits, and the proof beside it.
    #[cfg(feature = "digits")]
    Digits(Box<super::digits::DigitsSnapshot>),
}

/// Levels of folders that are searched for interrupted runs.
const LEVELS: usize = 6;

/// Goes on with what the folder holds, or with the one interrupted run below it.
///
/// # Errors
/// There is nothing to go on with, somebody else does already, or what the run or sweep itself fails with.
pub fn run(flags: &ResumeFlags) -> Result<(), Failure> {
    let path = located(&flags.folder)?;
    if path != flags.folder && !flags.tell.quiet {
        message(&format!("going on with {}", path.display()));
    }
    // Locked before anything is read: nobody else goes on with it meanwhile.
    let folder = Folder::reopen(&path)?;
    let (checkpoints, loaded) = match Checkpoints::load::<SavedWork>(folder.path()) {
        Err(CheckpointError::Missing { .. }) => return Err(nothing(folder.path())),
        loaded => loaded?,
    };
    let Loaded { content: mut saved, instead_of } = loaded;
    if let Some(error) = instead_of {
        message(&format!("{error}; going on from the checkpoint before it"));
    }
    if saved.version != env!("CARGO_PKG_VERSION") {
        let (theirs, ours) = (&saved.version, env!("CARGO_PKG_VERSION"));
        message(&format!(
            "the run was begun by driftless {theirs}, this is {ours}: its end may differ in the last digits \
                from one run by either alone"
        ));
    }
    if let (Some(max_evaluations), PendingWork::Run(snapshot)) = (flags.max_evaluations, &mut saved.work) {
        snapshot.allow(max_evaluations);
    }
    let damaged = || {
        let hint = "begin again with the first command and --force";
        Failure::new(Exit::Io, format!("the command line in the checkpoint cannot be read\nhint: {hint}"))
    };
    let tables = std::mem::take(&mut saved.tables).into();
    match (Flags::try_parse_from(&saved.arguments).map_err(|_| damaged())?.command, &saved.work) {
        (Command::Run(mut run), PendingWork::Run(_)) => {
            (run.scene.tell, run.scene.tables) = (flags.tell.clone(), tables);
            run.checkpoints = flags.checkpoints.clone();
            simulate::resume(&run, saved, flags.until, folder, checkpoints)
        }
        #[cfg(feature = "digits")]
        (Command::Run(mut run), PendingWork::Digits(_)) => {
            if flags.until.is_some() || flags.max_evaluations.is_some() {
                let text = "--until and --max-evaluations: a run in many digits goes on as it was \
                    begun\nhint: leave them out";
                return Err(Failure::new(Exit::Usage, text));
            }
            (run.scene.tell, run.scene.tables) = (flags.tell.clone(), tables);
            run.checkpoints = flags.checkpoints.clone();
            super::digits::resume(&run, saved, folder, checkpoints)
        }
        (Command::Sweep(_), PendingWork::Sweep(..)) if flags.until.is_some() => Err(Failure::new(
            Exit::Usage,
            "--until: the points of a sweep have one horizon\nhint: a new sweep",
        )),
        (Command::Sweep(_), PendingWork::Sweep(..)) if flags.max_evaluations.is_some() => Err(Failure::new(
            Exit::Usage,
            "--max-evaluations: the points of a sweep have one limit\nhint: a new sweep",
        )),
        (Command::Sweep(mut sweep), PendingWork::Sweep(..)) => {
            (sweep.scene.tell, sweep.scene.tables) = (flags.tell.clone(), tables);
            sweep.checkpoints = flags.checkpoints.clone();
            sweep::resume(&sweep, saved, folder, checkpoints)
        }
        _ => Err(damaged()),
    }
}

/// The folder itself, or the one below it that holds an interrupted run.
fn located(folder: &Path) -> Result<PathBuf, Failure> {
    if !folder.is_dir() || checkpoint::is_in(folder) {
        return if folder.is_dir() { Ok(folder.to_owned()) } else { Err(nothing(folder)) };
    }
    let mut found = Vec::new();
    search(folder, LEVELS, &mut found);
    found.sort();
    // What is being written is not interrupted; where there is nothing else, whoever opens it says so.
    let is_idle: Vec<bool> = found.iter().map(|path| !Folder::is_busy(path)).collect();
    let idle: Vec<&PathBuf> =
        found.iter().zip(&is_idle).filter(|(_, is_idle)| **is_idle).map(|(path, _)| path).collect();
    match (&idle[..], found.first()) {
        ([only], _) => Ok((*only).clone()),
        ([], None) => Err(nothing(folder)),
        ([], Some(busy)) => Ok(busy.clone()),
        (several, _) => {
            let mut text = format!("{} holds {} interrupted runs; name one", folder.display(), several.len());
            several.iter().for_each(|path| text += &format!("\nhint: `driftless resume {}`", quoted(path)));
            Err(Failure::new(Exit::Io, text))
        }
    }
}

/// Why there is nothing to go on with in a folder.
fn nothing(folder: &Path) -> Failure {
    let text = if !folder.is_dir() {
        format!(
            "there is no folder {}\nhint: name the folder of a run, or one that holds it",
            folder.display()
        )
    } else if [RECORD, SWEEP_RECORD].iter().any(|name| folder.join(name).exists()) {
        format!("the run in {} is finished: there is nothing to resume", folder.display())
    } else {
        format!("{} holds no interrupted run, nor does a folder below it", folder.display())
    };
    Failure::new(Exit::Io, text)
}

/// Folders with a checkpoint below `folder`; links are not followed.
fn search(folder: &Path, levels: usize, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten().filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir())) {
        let path = entry.path();
        if checkpoint::is_in(&path) {
            found.push(path);
        } else if levels > 1 {
            search(&path, levels - 1, found);
        }
    }
}
