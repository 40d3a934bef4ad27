//! `driftless resume`: go on with a run or a sweep that was interrupted, whatever ended it.

use super::failure::{Exit, Failure};
use super::flags::{Command, Flags, ResumeFlags};
use super::output::message;
use super::{simulate, sweep};
use crate::run::files::{RECORD, SWEEP_RECORD, quoted};
use crate::run::{CheckpointError, Checkpoints, Cursor, Folder, Loaded, Snapshot, Totals, checkpoint};
use clap::Parser;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// What a checkpoint of the program holds.
#[derive(Serialize, Deserialize)]
pub struct Saved {
    /// The version that wrote it.
    pub version: String,
    /// The command line, and the text of the scene it names.
    pub arguments: Vec<String>,
    pub scene: String,
    /// How far the table was written.
    pub cursor: Cursor,
    pub work: Work,
}

/// What was under way.
#[derive(Serialize, Deserialize)]
pub enum Work {
    /// A run.
    Run(Box<Snapshot>),
    /// A sweep: what its points seen so far amount to, and its chart so far.
    Sweep(Totals, Option<Vec<u8>>),
}

/// Levels of folders that are searched for interrupted runs to hint at.
const LEVELS: usize = 3;
/// Most of them that are named.
const NAMED: usize = 5;

/// Goes on with what the folder holds.
///
/// # Errors
/// There is nothing to go on with, somebody else does already, or what the run or sweep itself fails with.
pub fn run(flags: &ResumeFlags) -> Result<(), Failure> {
    // Locked before anything is read: nobody else goes on with it meanwhile.
    let folder = if flags.folder.is_dir() { Folder::reopen(&flags.folder)? } else { return Err(nothing(&flags.folder)) };
    let (checkpoints, loaded) = match Checkpoints::load::<Saved>(folder.path()) {
        Err(CheckpointError::Missing { .. }) => return Err(nothing(folder.path())),
        loaded => loaded?,
    };
    let Loaded { content: saved, instead_of } = loaded;
    if let Some(error) = instead_of {
        message(&format!("{error}; going on from the checkpoint before it"));
    }
    if saved.version != env!("CARGO_PKG_VERSION") {
        let (theirs, ours) = (&saved.version, env!("CARGO_PKG_VERSION"));
        message(&format!(
            "the run was begun by driftless {theirs}, this is {ours}: its end may differ in the last digits from one run by either alone"
        ));
    }
    let damaged = || Failure::new(Exit::Io, "the command line in the checkpoint cannot be read");
    match (Flags::try_parse_from(&saved.arguments).map_err(|_| damaged())?.command, &saved.work) {
        (Command::Run(mut run), Work::Run(_)) => {
            run.scene.tell = flags.tell.clone();
            run.checkpoints = flags.checkpoints.clone();
            simulate::resume(&run, saved, flags.until, folder, checkpoints)
        }
        (Command::Sweep(_), Work::Sweep(..)) if flags.until.is_some() => {
            Err(Failure::new(Exit::Usage, "--until: the points of a sweep have one horizon\nhint: a new sweep"))
        }
        (Command::Sweep(mut sweep), Work::Sweep(..)) => {
            sweep.scene.tell = flags.tell.clone();
            sweep.checkpoints = flags.checkpoints.clone();
            sweep::resume(&sweep, saved, folder, checkpoints)
        }
        _ => Err(damaged()),
    }
}

/// Why there is nothing to go on with in a folder, and where there is.
fn nothing(folder: &Path) -> Failure {
    if !folder.is_dir() {
        return Failure::new(Exit::Io, format!("there is no folder {}", folder.display()));
    }
    if [RECORD, SWEEP_RECORD].iter().any(|name| folder.join(name).exists()) {
        return Failure::new(Exit::Io, format!("the run in {} is finished: there is nothing to resume", folder.display()));
    }
    let mut found = Vec::new();
    search(folder, LEVELS, &mut found);
    found.sort();
    let mut text = format!("{} holds no interrupted run", folder.display());
    for path in found.iter().take(NAMED) {
        text += &format!("\nhint: `driftless resume {}`", quoted(path));
    }
    if found.len() > NAMED {
        text += &format!("\nand {} more", found.len() - NAMED);
    }
    Failure::new(Exit::Io, text)
}

fn search(folder: &Path, levels: usize, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()) {
        if checkpoint::is_in(&path) {
            found.push(path);
        } else if levels > 1 {
            search(&path, levels - 1, found);
        }
    }
}
