//! The folder of a run: files appear in it whole or not at all.
//!
//! A file is written beside its place under a hidden name and renamed when it is complete; whoever looks into
//! the folder, at any moment, finds whole files.  `run.json` is written last: where it stands, the run beside
//! it is complete.
//!
//! A folder is locked as long as somebody writes into it.  Its table, `.unfinished-trajectory.csv`, outlives
//! its writer where a checkpoint says how much of it counts ([`checkpoint`]).

mod names;
mod stream;

pub use names::*;
pub use stream::{Stream, StreamPosition};

use self::stream::hashed;
use super::checkpoint;
use sha2::{Digest, Sha256};
use std::borrow::Cow;
use std::cell::Cell;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// How names of unfinished files begin.
pub(super) const UNFINISHED: &str = ".unfinished-";

/// Why a file of a run is not there.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The folder holds results already.
    #[error("{} holds results already\nhint: --force overwrites it, --out names another folder",
        folder.display())]
    Occupied {
        /// The folder.
        folder: PathBuf,
    },
    /// The folder holds a run that can go on.
    #[error("{} holds an interrupted run\nhint: `driftless resume {}` goes on with it, --force begins anew",
        folder.display(), quoted(folder))]
    Interrupted {
        /// The folder.
        folder: PathBuf,
    },
    /// Somebody else is writing into the folder.
    #[error("another run is writing into {}\nhint: wait for it, or name another folder with --out",
        folder.display())]
    Busy {
        /// The folder.
        folder: PathBuf,
    },
    /// A table is not the one a checkpoint speaks of.
    #[error("{} is not what the checkpoint beside it speaks of: {why}", file.display())]
    Altered {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        why: &'static str,
    },
    /// The folder cannot be made.
    #[error("cannot make the folder {}: {source}\nhint: --out names another folder", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {source}\nhint: is the disk full, or the folder closed to you?",
        file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// The folder of one run.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    written: Vec<Cow<'static, str>>,
    /// Holds the lock; `None` where the file system knows no locks.
    _lock: Option<File>,
}

/// Tables up to this length \[bytes\] are read again where they are taken up; it takes less than a second.
const READ_AGAIN: u64 = 1 << 28;

impl Folder {
    /// Opens the folder for a new run, made where it does not exist, and locks it; what a run that can no
    /// longer go on left unfinished is swept out.
    ///
    /// # Errors
    /// A run is in it, finished or interrupted, and `overwrite` is false; another process is writing into it;
    /// or it cannot be made.
    pub fn open(path: &Path, overwrite: bool) -> Result<Self, FileError> {
        let folder = || path.to_owned();
        fs::create_dir_all(path).map_err(|source| FileError::Folder { folder: folder(), source })?;
        let lock = lock(path)?;
        if !overwrite {
            Self::refuse_results(path)?;
        }
        // Without their table the checkpoints are of no use.
        checkpoint::Checkpoints::none(path).remove()?;
        sweep_out(path, &[])?;
        Ok(Self { path: folder(), written: Vec::new(), _lock: lock })
    }

    /// Refuses a folder, which need not exist, that holds results or an interrupted run.
    ///
    /// # Errors
    /// It does.
    pub fn refuse_results(path: &Path) -> Result<(), FileError> {
        if checkpoint::is_in(path) {
            return Err(FileError::Interrupted { folder: path.to_owned() });
        }
        if RESULTS.iter().any(|name| path.join(name).exists()) {
            return Err(FileError::Occupied { folder: path.to_owned() });
        }
        Ok(())
    }

    /// Opens the folder of an interrupted run, and locks it; its tables stay, whatever else it was writing is
    /// swept out.
    ///
    /// # Errors
    /// Somebody is writing into it, or it is closed.
    pub fn reopen(path: &Path) -> Result<Self, FileError> {
        let lock = lock(path)?;
        sweep_out(path, &[TRAJECTORY, SWEEP])?;
        Ok(Self { path: path.to_owned(), written: Vec::new(), _lock: lock })
    }

    /// True where somebody is writing into a folder.
    pub fn is_busy(path: &Path) -> bool {
        matches!(lock(path), Err(FileError::Busy { .. }))
    }

    /// Opens a folder to put whole files into, beside whatever is there and whoever else does.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn shared(path: &Path) -> Result<Self, FileError> {
        fs::create_dir_all(path).map_err(|source| FileError::Folder { folder: path.to_owned(), source })?;
        Ok(Self { path: path.to_owned(), written: Vec::new(), _lock: None })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Names of the files written, in the order of their completion.
    pub fn names(&self) -> &[Cow<'static, str>] {
        &self.written
    }

    /// Their paths.
    pub fn files(&self) -> Vec<PathBuf> {
        self.written.iter().map(|name| self.path.join(&**name)).collect()
    }

    /// Begins a table.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn begin(&self, name: &'static str) -> Result<Stream, FileError> {
        let path = self.unfinished(name);
        let file = File::create(&path).map_err(|source| self.failed(name, source))?;
        Ok(Stream { file, path, name, hash: Sha256::new(), bytes: 0, lasts: Cell::new(false) })
    }

    /// Takes up a table at a cursor; what was written beyond it is cut off.
    ///
    /// # Errors
    /// It cannot be opened, or is not the one the cursor was in.
    pub fn take_up(&self, name: &'static str, cursor: &StreamPosition) -> Result<Stream, FileError> {
        let path = self.unfinished(name);
        // A run that was over may have fallen between giving the table its name and writing its record.
        let place = if path.exists() { path.clone() } else { self.path.join(name) };
        let failed = |source| FileError::File { file: place.clone(), source };
        let altered = |why| FileError::Altered { file: place.clone(), why };
        let mut file = match OpenOptions::new().read(true).write(true).open(&place) {
            Ok(file) => file,
            Err(source) if source.kind() == io::ErrorKind::NotFound => return Err(altered("it is gone")),
            Err(source) => return Err(failed(source)),
        };
        if file.metadata().map_err(failed)?.len() < cursor.bytes {
            return Err(altered("it is shorter"));
        }
        let hash = cursor.hash().ok_or_else(|| altered("the hash kept of it is none"))?;
        if cursor.bytes <= READ_AGAIN
            && hashed(&mut file, cursor.bytes).map_err(failed)? != hash.clone().finalize()
        {
            return Err(altered("its content has changed"));
        }
        if place != path {
            fs::rename(&place, &path).map_err(failed)?;
        }
        file.set_len(cursor.bytes).and_then(|()| file.seek(SeekFrom::Start(cursor.bytes))).map_err(failed)?;
        Ok(Stream { file, path, name, hash, bytes: cursor.bytes, lasts: Cell::new(true) })
    }

    fn unfinished(&self, name: &str) -> PathBuf {
        self.path.join(format!("{UNFINISHED}{name}"))
    }

    /// Gives a finished table its name, in place of an older one; returns the SHA-256 of its content.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn keep(&mut self, mut stream: Stream) -> Result<String, FileError> {
        let name = stream.name;
        let failed = |source| self.failed(name, source);
        if stream.lasts.get() {
            // Its checkpoints are removed soon.
            stream.file.sync_all().map_err(failed)?;
        }
        fs::rename(&stream.path, self.path.join(name)).map_err(failed)?;
        self.written.push(name.into());
        Ok(hexadecimal(std::mem::take(&mut stream.hash)))
    }

    /// Writes a file at once.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn write(&mut self, name: impl Into<Cow<'static, str>>, content: &[u8]) -> Result<(), FileError> {
        let name = name.into();
        let mut builder = tempfile::Builder::new();
        builder.prefix(UNFINISHED).suffix(&*name);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // Temporary files are private; a result is as readable as the user's other files.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let failed = |source| self.failed(&name, source);
        let mut file: NamedTempFile = builder.tempfile_in(&self.path).map_err(failed)?;
        // The file itself: errors of the temporary one tell its name.
        file.as_file_mut().write_all(content).map_err(failed)?;
        file.persist(self.path.join(&*name)).map_err(|error| failed(error.error))?;
        self.written.push(name);
        Ok(())
    }

    /// Removes what was written, of results that cannot be written whole.
    pub fn take_back(&mut self) {
        for name in std::mem::take(&mut self.written) {
            // The failure that is being told weighs more than one in this.
            let _ = remove(self.path.join(&*name));
        }
    }

    /// Removes what an earlier run left under these names, charts in all their formats.
    ///
    /// # Errors
    /// A file cannot be removed.
    pub fn clear(&self, names: &[&str]) -> Result<(), FileError> {
        let others = |name: &str| match name.rsplit_once('.') {
            Some((stem, "png")) => vec![format!("{stem}.svg"), format!("{stem}.pdf")],
            Some((stem, "gif")) => vec![format!("{stem}.apng")],
            _ => Vec::new(),
        };
        names
            .iter()
            .flat_map(|name| others(name).into_iter().chain([(*name).to_owned()]))
            .filter(|name| !self.written.iter().any(|written| written == name))
            .try_for_each(|name| remove(self.path.join(name)))
    }

    /// An error about a file of this folder.
    pub fn failed(&self, name: &str, source: io::Error) -> FileError {
        FileError::File { file: self.path.join(name), source }
    }
}

/// The lock of a folder, released when the file is closed, whatever ends its holder.
fn lock(folder: &Path) -> Result<Option<File>, FileError> {
    // Elsewhere than on Unix a folder cannot be opened; a file in it is locked instead.
    let file = if cfg!(unix) { File::open(folder) } else { File::create(folder.join(".lock")) };
    let Ok(file) = file else { return Ok(None) };
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Err(FileError::Busy { folder: folder.to_owned() }),
        Err(TryLockError::Error(_)) => Ok(None),
    }
}

/// Removes what was never finished, but the tables of these names.
fn sweep_out(folder: &Path, but: &[&str]) -> Result<(), FileError> {
    let entries =
        fs::read_dir(folder).map_err(|source| FileError::Folder { folder: folder.to_owned(), source })?;
    for entry in entries.flatten() {
        let name = entry.file_name();
        if name.to_string_lossy().strip_prefix(UNFINISHED).is_some_and(|name| !but.contains(&name)) {
            remove(entry.path())?;
        }
    }
    Ok(())
}

/// A path as a shell takes it.
pub fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "/._-+=:,@%".contains(letter);
    if !text.is_empty() && text.chars().all(is_plain) {
        text
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

/// Removes a file that may not be there.
pub(super) fn remove(path: PathBuf) -> Result<(), FileError> {
    match fs::remove_file(&path) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => {
            Err(FileError::File { file: path, source })
        }
        _ => Ok(()),
    }
}

/// SHA-256 of a text, in hexadecimal digits.
pub fn sha256(text: &str) -> String {
    hexadecimal(Sha256::new_with_prefix(text.as_bytes()))
}

pub(crate) fn hexadecimal(hash: Sha256) -> String {
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .expect("a folder")
            .flatten()
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_appears_when_it_is_kept_and_never_else() {
        let place = tempfile::tempdir().expect("a folder");
        let mut folder = Folder::open(&place.path().join("a/b"), false).expect("made");
        let mut stream = folder.begin(TRAJECTORY).expect("begun");
        stream.write_all(b"abc").expect("written");
        assert!(!folder.path().join(TRAJECTORY).exists());
        drop(folder.begin(RECORD).expect("begun"));
        let hash = folder.keep(stream).expect("kept");
        assert_eq!(hash, sha256("abc"));
        // FIPS 180-2, appendix B.1.
        assert_eq!(hash, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
        assert_eq!(names(folder.path()), [TRAJECTORY]);
        let path = folder.path().to_owned();
        assert!(matches!(Folder::open(&path, false), Err(FileError::Busy { .. })));
        drop(folder);
        assert!(matches!(Folder::open(&path, false), Err(FileError::Occupied { .. })));
    }

    #[test]
    fn a_table_is_taken_up_where_it_was_and_nowhere_else() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = Folder::open(place.path(), false).expect("made");
        let mut stream = folder.begin(TRAJECTORY).expect("begun");
        stream.write_all(b"one").expect("written");
        let cursor = stream.cursor().expect("synchronized");
        stream.outlive();
        stream.write_all(b"too much").expect("written");
        drop((stream, folder));
        fs::write(place.path().join(".unfinished-Xcheckpoint"), "half").expect("written");
        let mut folder = Folder::reopen(place.path()).expect("there");
        assert_eq!(names(place.path()), [".unfinished-trajectory.csv"]);
        let path = place.path().join(".unfinished-trajectory.csv");
        for (bad, why) in [(&b"on"[..], "shorter"), (b"two too much", "changed")] {
            let good = fs::read(&path).expect("there");
            fs::write(&path, bad).expect("written");
            let error = folder.take_up(TRAJECTORY, &cursor).expect_err("refused").to_string();
            assert!(error.contains(why), "{error}");
            assert_eq!(fs::read(&path).expect("there"), bad);
            fs::write(&path, good).expect("written");
        }
        let mut stream = folder.take_up(TRAJECTORY, &cursor).expect("the same");
        stream.write_all(b", two").expect("written");
        assert_eq!(folder.keep(stream).expect("kept"), sha256("one, two"));
        // From under its name too; and what is not it stays where it is.
        drop(folder.take_up(TRAJECTORY, &cursor).expect("the same"));
        assert_eq!(fs::read(&path).expect("there"), b"one");
        fs::rename(&path, place.path().join(TRAJECTORY)).expect("renamed");
        fs::write(place.path().join(TRAJECTORY), "another").expect("written");
        assert!(folder.take_up(TRAJECTORY, &cursor).is_err() && place.path().join(TRAJECTORY).exists());
        fs::remove_file(place.path().join(TRAJECTORY)).expect("removed");
        assert!(folder.take_up(TRAJECTORY, &cursor).expect_err("gone").to_string().contains("gone"));
    }

    #[test]
    fn an_interrupted_run_is_not_overwritten_unasked() {
        let place = tempfile::tempdir().expect("a folder");
        fs::write(place.path().join("checkpoint.previous"), "x").expect("written");
        let error = Folder::open(place.path(), false).expect_err("refused").to_string();
        assert!(error.contains("driftless resume") && error.contains("--force"), "{error}");
        assert!(Folder::open(place.path(), true).is_ok() && names(place.path()).is_empty());
    }

    #[test]
    fn results_that_cannot_be_written_whole_are_taken_back() {
        let place = tempfile::tempdir().expect("a folder");
        let mut folder = Folder::open(place.path(), false).expect("opened");
        folder.write("mode1.png", b"x").expect("written");
        folder.take_back();
        assert!(names(place.path()).is_empty() && folder.names().is_empty());
    }

    #[test]
    fn paths_are_quoted_for_a_shell_where_they_need_it() {
        assert_eq!(quoted(Path::new("output/free/gauss16-0.01s")), "output/free/gauss16-0.01s");
        assert_eq!(quoted(Path::new("my runs/bob's")), r"'my runs/bob'\''s'");
    }

    #[test]
    fn clearing_removes_the_old_and_the_unfinished_and_nothing_else() {
        let place = tempfile::tempdir().expect("a folder");
        for name in ["old.png", "notes.txt", ".unfinished-x-trajectory.csv", RECORD] {
            fs::write(place.path().join(name), "x").expect("written");
        }
        let mut folder = Folder::open(place.path(), true).expect("opened");
        assert_eq!(names(place.path()), ["notes.txt", "old.png", RECORD]);
        folder.write(RECORD, b"{}").expect("written");
        folder.clear(&["old.png", "never.png", RECORD]).expect("cleared");
        assert_eq!(names(place.path()), ["notes.txt", RECORD]);
    }
}
