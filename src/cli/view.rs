//! `driftless view`: finished runs as a page.

use super::failure::{Exit, Failure};
use super::flags::{TellFlags, ViewFlags};
use super::output::{message, name_files, print, print_object};
use crate::html::Document;
use crate::report::result::files;
use crate::report::view::{self, MOST_RUNS, ViewError, Viewed};
use crate::run::Folder;
use serde_json::json;
use std::cmp::Ordering;
use std::path::{Path, PathBuf};

/// The page of one run, in its folder.
pub(super) const PAGE: &str = "run.html";
/// The page of several, beside their folders.
pub(super) const PAGE_OF_SEVERAL: &str = "runs.html";

impl From<ViewError> for Failure {
    fn from(error: ViewError) -> Self {
        let exit = match error {
            ViewError::Window { .. } | ViewError::Many { .. } | ViewError::Points { .. } => Exit::Usage,
            ViewError::Run { .. } => Exit::Stopped,
            _ => Exit::Io,
        };
        Self::new(exit, error.to_string())
    }
}

/// Writes the page of runs.
///
/// # Errors
/// A folder holds none, or files.
pub fn run(flags: &ViewFlags) -> Result<(), Failure> {
    let mut folders: Vec<PathBuf> = Vec::new();
    for given in &flags.folders {
        let (left_out, shown): (Vec<_>, Vec<_>) =
            view::runs_in(given)?.into_iter().partition(|folder| view::is_in_digits(folder));
        if let (Some(folder), true) = (left_out.first(), shown.is_empty()) {
            return Err(ViewError::Digits { folder: folder.clone() }.into());
        }
        if !flags.tell.quiet {
            left_out.iter().for_each(|run| {
                message(&format!("note: {} is left out: it is in many digits", run.display()))
            });
        }
        for folder in shown {
            if !folders.contains(&folder) {
                folders.push(folder);
            }
        }
    }
    let count = folders.len() + usize::from(flags.reference);
    if count > MOST_RUNS {
        return Err(ViewError::Many { found: count }.into());
    }
    let window = flags.from.is_some() || flags.to.is_some();
    let window = window.then(|| [flags.from.unwrap_or(0.0), flags.to.unwrap_or(f64::INFINITY)]);
    if let Some([from, to]) = window.filter(|[from, to]| from.partial_cmp(to) != Some(Ordering::Less)) {
        let text = format!(
            "--from {from} --to {to}: nothing lies between\nhint: --from comes before --to, in seconds"
        );
        return Err(Failure::new(Exit::Usage, text));
    }
    let home = match (&flags.out, &folders[..]) {
        (Some(out), _) => out.clone(),
        (None, [only]) => only.clone(),
        (None, several) => above(several)?,
    };
    let mut folder = Folder::shared(&home)?;
    let mut runs =
        folders.iter().map(|run| Viewed::read(run, window, None)).collect::<Result<Vec<_>, _>>()?;
    if flags.reference {
        runs.push(runs[0].reference(window)?);
    }
    write(&mut folder, &runs, &flags.tell)?;
    if flags.tell.json {
        let mut object =
            json!({"runs": folders.iter().map(|folder| folder.display().to_string()).collect::<Vec<_>>()});
        name_files(&mut object, &folder);
        return print_object(&object);
    }
    if flags.tell.quiet { Ok(()) } else { print(&files(folder.path(), folder.names())) }
}

/// Writes the page of these runs, `run.html` or, of several, `runs.html`.
///
/// # Errors
/// Files.
pub(super) fn write(folder: &mut Folder, runs: &[Viewed], tell: &TellFlags) -> Result<(), Failure> {
    let name = if runs.len() > 1 { PAGE_OF_SEVERAL } else { PAGE };
    keep(folder, name, &view::page(runs), tell)
}

/// Writes a page.
///
/// # Errors
/// Files.
pub(super) fn keep(
    folder: &mut Folder,
    name: &'static str,
    page: &Document,
    tell: &TellFlags,
) -> Result<(), Failure> {
    let html = page.html().map_err(|error| folder.failed(name, error))?;
    folder.write(name, &html)?;
    tell.remark(&format!("wrote {}", folder.path().join(name).display()));
    Ok(())
}

/// The folder above all of these.
fn above(folders: &[PathBuf]) -> Result<PathBuf, Failure> {
    let parents: Vec<Option<&Path>> = folders.iter().map(|folder| folder.parent()).collect();
    match parents[..] {
        [Some(first), ..] if parents.iter().all(|parent| *parent == Some(first)) => Ok(first.to_owned()),
        _ => Err(Failure::new(
            Exit::Usage,
            "the runs lie in several folders\nhint: --out names the folder of the page",
        )),
    }
}
