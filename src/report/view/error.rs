//! Why there is no page.

use super::MOST_RUNS;
use crate::run::table_reader::TableError;
use std::path::PathBuf;

/// Why a run cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// There is no run.
    #[error("{} holds no run\nhint: `driftless run SCENE` makes one; a folder of runs, or a run's own, is \
        shown", folder.display())]
    None {
        /// The folder.
        folder: PathBuf,
    },
    /// There are runs of several scenes.
    #[error("{} holds the runs of {} scenes\nhint: name the folder of one: {}", folder.display(),
        scenes.len(), listed(scenes))]
    Several {
        /// The folder.
        folder: PathBuf,
        /// Those of the scenes.
        scenes: Vec<PathBuf>,
    },
    /// The run is in many digits.
    #[error("{} holds a run in many digits, which has no page\nhint: without --digits and --trusted-until a \
        run has one", folder.display())]
    Digits {
        /// The folder.
        folder: PathBuf,
    },
    /// The record cannot be read.
    #[error("{}: {why}\nhint: only `driftless run` writes records; run the scene again", file.display())]
    Record {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        why: String,
    },
    /// The trajectory is not one of the scene in the record.
    #[error("{}: column {column}: `{found}` stands where `{expected}` belongs\nhint: run.json beside it is \
        of another run", file.display())]
    Column {
        /// The file.
        file: PathBuf,
        /// Its number, from 1 on.
        column: usize,
        /// Its name there.
        found: String,
        /// The name it should have.
        expected: String,
    },
    /// The trajectory cannot be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// No row lies in the window asked for.
    #[error("--from {} --to {}: no row of {} lies in it\nhint: the run goes from 0 to {until} s", window[0],
        window[1], file.display())]
    Window {
        /// The file.
        file: PathBuf,
        /// What was asked for \[s\].
        window: [f64; 2],
        /// The end of the run \[s\].
        until: f64,
    },
    /// A run of the page stopped at once, or was refused.
    #[error("{what}: {why}")]
    Run {
        /// Which.
        what: String,
        /// Why.
        why: String,
    },
    /// More points than a page can hold.
    #[error(
        "--html: {count} points are more than a page can hold ({most})\nhint: a coarser grid, or the picture \
            alone, without --html"
    )]
    Points {
        /// How many there are.
        count: u64,
        /// How many there may be.
        most: u64,
    },
    /// Too many runs.
    #[error("{found} runs: a page shows {MOST_RUNS} at most\nhint: name those that are to be compared")]
    Many {
        /// How many there are.
        found: usize,
    },
}

/// Some folders, as a list.
fn listed(folders: &[PathBuf]) -> String {
    const MOST: usize = 8;
    let names: Vec<String> = folders.iter().take(MOST).map(|folder| folder.display().to_string()).collect();
    names.join(", ") + if folders.len() > MOST { ", …" } else { "" }
}
