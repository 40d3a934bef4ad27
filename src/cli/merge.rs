//! `driftless merge`: the parts of a sweep become the sweep.

use super::failure::{Exit, Failure};
use super::flags::{Command, Flags, MergeFlags, SweepFlags};
use super::output::message;
use super::sweep::{SweepPart, Swept, prepared, tell};
use crate::report;
#[cfg(feature = "charts")]
use crate::report::sweep::SweepChart;
use crate::run::files::{PART, SWEEP, quoted};
use crate::run::{CheckpointError, FileError, Folder, Shard, Stream, Sweep, Totals, checkpoint};
use clap::Parser;
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

/// Missing parts that are named; of more their number is told.
const NAMED: usize = 12;

/// A part that was read.
struct ReadPart {
    folder: PathBuf,
    shard: Shard,
    part: SweepPart,
    flags: Box<SweepFlags>,
}

/// Joins parts.
///
/// # Errors
/// A part is missing, damaged, there twice, or of another scene, plan or version; or files.
pub fn run(flags: &MergeFlags) -> Result<(), Failure> {
    let mut found = Vec::new();
    for folder in part_folders(&flags.folders)? {
        found.push(read(folder)?);
    }
    found.sort_by_key(|found| found.shard.number());
    let [first, ..] = &found[..] else { return Err(refused("there are no parts".into())) };
    let mut sweep_flags = first.flags.clone();
    sweep_flags.shard = None;
    sweep_flags.force = flags.force;
    sweep_flags.scene.tell = flags.tell.clone();
    let plan = prepared(&sweep_flags, &first.part.scene)?;
    agree(&found, &plan)?;
    complete(&found, flags)?;
    let parent = |found: &ReadPart| found.folder.parent().map(Path::to_owned);
    let out = match &flags.out {
        Some(out) => out.clone(),
        None => parent(first)
            .filter(|above| found.iter().all(|f| parent(f).as_ref() == Some(above)))
            .ok_or_else(|| {
                refused(
                    "the parts lie in several folders\nhint: --out names the folder of the whole sweep"
                        .into(),
                )
            })?,
    };
    let mut folder = Folder::open(&out, flags.force)?;
    let stream = joined(&found, &folder)?;
    if flags.force {
        folder.clear(super::sweep::FILES)?;
    }
    let hash = folder.keep(stream)?;
    let mut totals = Totals::default();
    found.iter().for_each(|found| totals.join(&found.part.totals));
    let swept = Swept {
        plan: &plan,
        totals,
        #[cfg(feature = "charts")]
        curve: curve(&found)?,
    };
    swept.publish(&mut folder, &hash, &sweep_flags)?;
    tell(&plan, &swept.totals, &folder, &sweep_flags)
}

fn refused(text: String) -> Failure {
    Failure::new(Exit::Io, text)
}

/// The folders given that are parts, and the parts in the others, or in the folders below those.
fn part_folders(given: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut folders = Vec::new();
    for folder in given {
        if is_part(folder) {
            folders.push(folder.clone());
            continue;
        }
        let failed = |source| FileError::Folder { folder: folder.clone(), source };
        let before = folders.len();
        if !folder.exists() {
            return Err(refused(format!(
                "{} is not there\nhint: name the folders of parts, or one that holds them",
                folder.display()
            )));
        }
        if !folder.is_dir() {
            return Err(refused(format!(
                "{} is a file\nhint: name the folder of a part, or one that holds parts",
                folder.display()
            )));
        }
        let mut inside = inside(folder).map_err(failed)?;
        // Further down, in a folder of scenes whose folders hold those of sweeps.
        for _ in 0..2 {
            if !inside.iter().any(|path| is_part(path)) {
                inside = inside.iter().filter_map(|path| self::inside(path).ok()).flatten().collect();
            }
        }
        folders.extend(inside.into_iter().filter(|path| is_part(path)));
        if folders.len() == before {
            return Err(refused(format!(
                "{} holds no part of a sweep\nhint: `driftless sweep … --shard I/N` runs one",
                folder.display()
            )));
        }
    }
    // The same folder may have been named twice.
    folders.sort();
    folders.dedup();
    Ok(folders)
}

/// What is in a folder.
fn inside(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect()
}

/// Whether a folder is one of a part, finished or not.
fn is_part(folder: &Path) -> bool {
    let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    folder.is_dir()
        && (folder.join(PART).exists() || (name.starts_with("shard-") && checkpoint::is_in(folder)))
}

fn read(folder: PathBuf) -> Result<ReadPart, Failure> {
    let file = folder.join(PART);
    if !file.exists() {
        let text = format!(
            "{} holds a part that is not finished\nhint: `driftless resume {}` goes on with it",
            folder.display(),
            quoted(&folder)
        );
        return Err(refused(text));
    }
    let bytes = fs::read(&file).map_err(|source| FileError::File { file: file.clone(), source })?;
    let part: SweepPart = checkpoint::opened(&bytes, &file)?;
    let damaged = || CheckpointError::Damaged { file: file.clone(), why: "its command line cannot be read" };
    match Flags::try_parse_from(&part.arguments).map_err(|_| damaged())?.command {
        Command::Sweep(mut flags) => {
            let shard = flags.shard.ok_or_else(damaged)?;
            flags.scene.tables = part.tables.clone().into();
            Ok(ReadPart { folder, shard, part, flags })
        }
        _ => Err(damaged().into()),
    }
}

/// Whether all parts are of one sweep.
fn agree(found: &[ReadPart], plan: &Sweep) -> Result<(), Failure> {
    let first = &found[0];
    let differs = |other: &ReadPart, what: &str| {
        let (ours, theirs) = (first.folder.display(), other.folder.display());
        Err(refused(format!("{theirs} is part of another sweep than {ours}: {what}")))
    };
    let signature = |plan: &Sweep, flags: &SweepFlags| {
        let record = report::sweep::record(plan, &Totals::default(), "");
        let SweepFlags { to_flip, max_energy_drift, max_constraint_drift, .. } = flags;
        format!("{record} {to_flip} {max_energy_drift:?} {max_constraint_drift:?} {}", flags.scene.strict)
    };
    let whole = signature(plan, &first.flags);
    for other in &found[1..] {
        let (ours, theirs) = (&first.part.version, &other.part.version);
        if ours != theirs {
            return differs(other, &format!("it was run by driftless {theirs} instead of {ours}"));
        }
        if first.shard.of() != other.shard.of() {
            return differs(
                other,
                &format!("it is one of {} parts instead of {}", other.shard.of(), first.shard.of()),
            );
        }
        if first.part.scene != other.part.scene {
            return differs(other, "the text of its scene is another");
        }
        if first.part.tables != other.part.tables {
            return differs(other, "the files of its tables are others");
        }
        let mut flags = other.flags.clone();
        flags.shard = None;
        flags.scene.tell.quiet = true;
        if signature(&prepared(&flags, &other.part.scene)?, &flags) != whole {
            return differs(other, "its scene, grid or settings are others");
        }
    }
    Ok(())
}

/// Whether every part is there once.
fn complete(found: &[ReadPart], flags: &MergeFlags) -> Result<(), Failure> {
    if let Some(pair) = found.windows(2).find(|pair| pair[0].shard == pair[1].shard) {
        let [one, other] = [&pair[0], &pair[1]].map(|found| found.folder.display());
        return Err(refused(format!("part {} is there twice: {one} and {other}", pair[0].shard)));
    }
    let of = found[0].shard.of();
    let missing: Vec<u64> =
        (1..=of).filter(|number| found.binary_search_by_key(number, |f| f.shard.number()).is_err()).collect();
    let Some(first) = missing.first() else { return Ok(()) };
    let names: Vec<String> = missing.iter().take(NAMED).map(u64::to_string).collect();
    let more = match missing.len() {
        count if count > NAMED => format!(" and {} more", count - NAMED),
        _ => String::new(),
    };
    let said = if missing.len() == 1 { "part" } else { "parts" };
    let text = format!("{said} {}{more} of {of} missing", names.join(", "));
    if !flags.tell.quiet {
        message(&format!("note: {} of {of} parts found", found.len()));
    }
    Err(refused(format!("{text}\nhint: the same command with --shard {first}/{of} runs one")))
}

/// The rows of all parts under one header.
fn joined(found: &[ReadPart], folder: &Folder) -> Result<Stream, Failure> {
    let mut stream = folder.begin(SWEEP)?;
    let mut header = Vec::new();
    for found in found {
        let path = found.folder.join(SWEEP);
        let failed = |source| FileError::File { file: path.clone(), source };
        let mut table = BufReader::new(File::open(&path).map_err(failed)?);
        let mut hash = Sha256::new();
        let mut line = Vec::new();
        table.read_until(b'\n', &mut line).map_err(failed)?;
        hash.update(&line);
        if header.is_empty() {
            stream.write_all(&line).map_err(|error| folder.failed(SWEEP, error))?;
            header = line;
        } else if header != line {
            return Err(refused(format!(
                "{}: its columns are others than those of the first part",
                path.display()
            )));
        }
        loop {
            let bytes = table.fill_buf().map_err(failed)?;
            if bytes.is_empty() {
                break;
            }
            hash.update(bytes);
            stream.write_all(bytes).map_err(|error| folder.failed(SWEEP, error))?;
            let count = bytes.len();
            table.consume(count);
        }
        if crate::run::files::hexadecimal(hash) != found.part.table_sha256 {
            return Err(failed(io::Error::other("its content has changed since it was written")).into());
        }
    }
    Ok(stream)
}

/// The chart of all points, where every part has its own.
#[cfg(feature = "charts")]
fn curve(found: &[ReadPart]) -> Result<Option<SweepChart>, Failure> {
    let mut whole: Option<SweepChart> = None;
    for ReadPart { folder, part, .. } in found {
        let Some(bytes) = &part.drawn else { return Ok(None) };
        let damaged =
            |_| CheckpointError::Damaged { file: folder.join(PART), why: "its chart cannot be read" };
        let curve: SweepChart = postcard::from_bytes(bytes).map_err(damaged)?;
        match &mut whole {
            Some(whole) => whole.join(&curve),
            None => whole = Some(curve),
        }
    }
    Ok(whole)
}
