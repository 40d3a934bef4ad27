//! The folder of a run: files appear in it whole or not at all.
//!
//! A file is written beside its place under a hidden name and renamed when it is complete; whoever looks into the folder, at any
//! moment, finds whole files.  `run.json` is written last: where it stands, the run beside it is complete.

use sha2::{Digest, Sha256};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// The trajectory.
pub const TRAJECTORY: &str = "trajectory.csv";
/// Settings and results.
pub const RECORD: &str = "run.json";
/// The points of a sweep.
pub const SWEEP: &str = "sweep.csv";
/// Settings and totals of a sweep.
pub const SWEEP_RECORD: &str = "sweep.json";
/// How names of unfinished files begin.
const UNFINISHED: &str = ".unfinished-";

/// Why a file of a run is not there.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The folder holds a run already.
    #[error("{} holds a run already\nhint: --force overwrites it, --out names another folder", folder.display())]
    Occupied {
        /// The folder.
        folder: PathBuf,
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
    #[error("cannot write {}: {source}\nhint: is the disk full, or the folder closed to you?", file.display())]
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
    written: Vec<&'static str>,
}

/// A file being written; dropped unfinished it leaves nothing behind.
#[derive(Debug)]
pub struct Stream {
    file: NamedTempFile,
    name: &'static str,
    hash: Sha256,
}

impl Folder {
    /// Opens the folder, made where it does not exist; overwriting sweeps out what an interrupted run left unfinished.
    ///
    /// # Errors
    /// A run is in it and `overwrite` is false, or it cannot be made.
    pub fn open(path: &Path, overwrite: bool) -> Result<Self, FileError> {
        if !overwrite && [TRAJECTORY, RECORD, SWEEP, SWEEP_RECORD].iter().any(|name| path.join(name).exists()) {
            return Err(FileError::Occupied { folder: path.to_owned() });
        }
        fs::create_dir_all(path).map_err(|source| FileError::Folder { folder: path.to_owned(), source })?;
        if overwrite {
            let entries = fs::read_dir(path).map_err(|source| FileError::Folder { folder: path.to_owned(), source })?;
            for entry in entries.flatten().filter(|entry| entry.file_name().to_string_lossy().starts_with(UNFINISHED)) {
                remove(entry.path())?;
            }
        }
        Ok(Self { path: path.to_owned(), written: Vec::new() })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Names of the files written, in the order of their completion.
    pub fn names(&self) -> &[&'static str] {
        &self.written
    }

    /// Their paths.
    pub fn files(&self) -> Vec<PathBuf> {
        self.written.iter().map(|name| self.path.join(name)).collect()
    }

    /// Begins a file.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn begin(&self, name: &'static str) -> Result<Stream, FileError> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(UNFINISHED).suffix(name);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // Temporary files are private; a result is as readable as the user's other files.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let file = builder.tempfile_in(&self.path).map_err(|source| self.failed(name, source))?;
        Ok(Stream { file, name, hash: Sha256::new() })
    }

    /// Gives a finished file its name, in place of an older one; returns the SHA-256 of its content.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn keep(&mut self, stream: Stream) -> Result<String, FileError> {
        let Stream { file, name, hash } = stream;
        file.persist(self.path.join(name)).map_err(|error| self.failed(name, error.error))?;
        self.written.push(name);
        Ok(hexadecimal(hash))
    }

    /// Writes a file at once.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn write(&mut self, name: &'static str, content: &[u8]) -> Result<(), FileError> {
        let mut stream = self.begin(name)?;
        stream.file.write_all(content).map_err(|source| self.failed(name, source))?;
        self.keep(stream).map(drop)
    }

    /// Removes what an earlier run left under these names.
    ///
    /// # Errors
    /// A file cannot be removed.
    pub fn clear(&self, names: &[&str]) -> Result<(), FileError> {
        names.iter().filter(|name| !self.written.contains(name)).try_for_each(|name| remove(self.path.join(name)))
    }

    /// An error about a file of this folder.
    pub fn failed(&self, name: &str, source: io::Error) -> FileError {
        FileError::File { file: self.path.join(name), source }
    }
}

impl Write for Stream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.file.write(bytes)?;
        self.hash.update(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Removes a file that may not be there.
fn remove(path: PathBuf) -> Result<(), FileError> {
    match fs::remove_file(&path) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => Err(FileError::File { file: path, source }),
        _ => Ok(()),
    }
}

/// SHA-256 of a text, in hexadecimal digits.
pub fn sha256(text: &str) -> String {
    hexadecimal(Sha256::new_with_prefix(text.as_bytes()))
}

fn hexadecimal(hash: Sha256) -> String {
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).expect("a folder").flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
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
        assert!(matches!(Folder::open(folder.path(), false), Err(FileError::Occupied { .. })));
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
