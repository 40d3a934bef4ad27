//! Checkpoints: what a run or a sweep needs to go on, in one file that is whole or refused.
//!
//! ```text
//! "driftless checkpoint\n"   21 bytes
//! format                     4 bytes, little-endian
//! length of the content      8 bytes, little-endian
//! content                    postcard: doubles as their eight bytes, so that what goes on is what stopped,
//!     bit for bit
//! SHA-256 of all before      32 bytes
//! ```
//!
//! A checkpoint is written beside its place, synchronized with the disk and renamed, and the one before it is
//! kept as `checkpoint.previous`: whenever the machine stops, one of the two is whole.

use super::files::{FileError, UNFINISHED, remove};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The last checkpoint.
pub const CHECKPOINT: &str = "checkpoint";
/// The one before it.
pub const PREVIOUS: &str = "checkpoint.previous";
/// What the first bytes are.
const MAGIC: &[u8] = b"driftless checkpoint\n";
/// The layout of the content; a program reads its own only.
pub const FORMAT: u32 = 25;
const HEAD: usize = MAGIC.len() + 4 + 8;
const DIGEST: usize = 32;

/// Why a checkpoint cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// There is none.
    #[error("{} holds no checkpoint", folder.display())]
    Missing {
        /// The folder.
        folder: PathBuf,
    },
    /// It cannot be opened.
    #[error("cannot read {}: {source}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// It is cut short, or bits of it have changed.
    #[error("{} is damaged: {why}", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        why: &'static str,
    },
    /// Another version of the program wrote it.
    #[error("{} is of format {found}, and this program reads format {FORMAT}\nhint: resume it with the \
        version of driftless that wrote it", file.display())]
    Format {
        /// The file.
        file: PathBuf,
        /// Its format.
        found: u32,
    },
}

/// What was read.
#[derive(Debug)]
pub struct Loaded<T> {
    /// The content.
    pub content: T,
    /// Why the last checkpoint could not be read, where this is the one before it.
    pub instead_of: Option<CheckpointError>,
}

/// The checkpoints of a folder.
#[derive(Debug)]
pub struct Checkpoints {
    folder: PathBuf,
    /// True where the last one is whole, and worth keeping when the next is written.
    has_last: bool,
    has_any: bool,
}

impl Checkpoints {
    /// Those of a folder in which there are none yet.
    pub fn none(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), has_last: false, has_any: false }
    }

    /// Reads the last one, or the one before it where that is missing or damaged.
    ///
    /// # Errors
    /// Neither can be read; a checkpoint of another format is refused even where the one before it could be.
    pub fn load<T: DeserializeOwned>(folder: &Path) -> Result<(Self, Loaded<T>), CheckpointError> {
        let loaded = match read(&folder.join(CHECKPOINT)) {
            Ok(content) => Loaded { content, instead_of: None },
            Err(format @ CheckpointError::Format { .. }) => return Err(format),
            Err(first) => match read(&folder.join(PREVIOUS)) {
                Ok(content) => Loaded { content, instead_of: Some(first) },
                Err(format @ CheckpointError::Format { .. }) => return Err(format),
                Err(second) if is_missing(&first) && is_missing(&second) => {
                    return Err(CheckpointError::Missing { folder: folder.to_owned() });
                }
                Err(second) => return Err(if is_missing(&first) { second } else { first }),
            },
        };
        Ok((Self { folder: folder.to_owned(), has_last: loaded.instead_of.is_none(), has_any: true }, loaded))
    }

    /// True where there is one to go on from.
    pub fn has_any(&self) -> bool {
        self.has_any
    }

    /// Writes one, and keeps the one before it.
    ///
    /// # Errors
    /// It cannot be written; those there were are untouched.
    pub fn save<T: Serialize>(&mut self, content: &T) -> Result<(), FileError> {
        let path = self.folder.join(CHECKPOINT);
        let failed = |source| FileError::File { file: path.clone(), source };
        let bytes = sealed(content).map_err(failed)?;
        let mut file = tempfile::Builder::new()
            .prefix(UNFINISHED)
            .suffix(CHECKPOINT)
            .tempfile_in(&self.folder)
            .map_err(failed)?;
        file.write_all(&bytes).and_then(|()| file.as_file().sync_all()).map_err(failed)?;
        if self.has_last {
            fs::rename(&path, self.folder.join(PREVIOUS)).map_err(failed)?;
        }
        file.persist(&path).map_err(|error| failed(error.error))?;
        (self.has_last, self.has_any) = (true, true);
        // The renames themselves; a system that cannot synchronize folders does so in its own time.
        let _ = File::open(&self.folder).and_then(|folder| folder.sync_all());
        Ok(())
    }

    /// Removes all of them: there is nothing left to resume.
    ///
    /// # Errors
    /// One cannot be removed.
    pub fn remove(&mut self) -> Result<(), FileError> {
        [PREVIOUS, CHECKPOINT].iter().try_for_each(|name| remove(self.folder.join(name)))?;
        (self.has_last, self.has_any) = (false, false);
        Ok(())
    }
}

/// True where a folder holds a checkpoint, sound or not.
pub fn is_in(folder: &Path) -> bool {
    [CHECKPOINT, PREVIOUS].iter().any(|name| folder.join(name).exists())
}

fn is_missing(error: &CheckpointError) -> bool {
    matches!(error, CheckpointError::Unreadable { source, .. } if source.kind() == io::ErrorKind::NotFound)
}

fn read<T: DeserializeOwned>(file: &Path) -> Result<T, CheckpointError> {
    let bytes =
        fs::read(file).map_err(|source| CheckpointError::Unreadable { file: file.to_owned(), source })?;
    opened(&bytes, file)
}

/// The content in its envelope.
///
/// # Errors
/// It cannot be written as bytes.
pub fn sealed<T: Serialize>(content: &T) -> io::Result<Vec<u8>> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(FORMAT.to_le_bytes());
    bytes.extend([0; 8]);
    let mut bytes = postcard::to_extend(content, bytes).map_err(io::Error::other)?;
    let length = (bytes.len() - HEAD) as u64;
    bytes[HEAD - 8..HEAD].copy_from_slice(&length.to_le_bytes());
    let digest = Sha256::digest(&bytes);
    bytes.extend_from_slice(&digest);
    Ok(bytes)
}

/// The content out of its envelope; `file` is what messages call it.
///
/// # Errors
/// The bytes are not those of a whole checkpoint of this format.
pub fn opened<T: DeserializeOwned>(bytes: &[u8], file: &Path) -> Result<T, CheckpointError> {
    let damaged = |why| CheckpointError::Damaged { file: file.to_owned(), why };
    let rest = bytes.strip_prefix(MAGIC).ok_or_else(|| damaged("it does not begin as a checkpoint does"))?;
    let (format, rest) = rest.split_first_chunk::<4>().ok_or_else(|| damaged("it is cut short"))?;
    let (length, rest) = rest.split_first_chunk::<8>().ok_or_else(|| damaged("it is cut short"))?;
    let found = u32::from_le_bytes(*format);
    if found != FORMAT {
        // Whatever another format's content looks like, its envelope is this one: a flipped bit is not
        // another version.
        let (body, digest) = bytes.split_at(bytes.len() - DIGEST.min(bytes.len()));
        return Err(if Sha256::digest(body)[..] == *digest {
            CheckpointError::Format { file: file.to_owned(), found }
        } else {
            damaged("its checksum is wrong")
        });
    }
    if u64::from_le_bytes(*length).checked_add(DIGEST as u64) != Some(rest.len() as u64) {
        return Err(damaged("its length is wrong"));
    }
    let (body, digest) = bytes.split_at(bytes.len() - DIGEST);
    if Sha256::digest(body)[..] != *digest {
        return Err(damaged("its checksum is wrong"));
    }
    let content = &body[HEAD..];
    match postcard::take_from_bytes(content) {
        Ok((content, [])) => Ok(content),
        _ => Err(damaged("its content cannot be read")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type Content = (Vec<f64>, String, Option<u64>);

    fn content(number: u64) -> Content {
        (vec![0.1, -0.0, f64::NAN, f64::INFINITY], "a bar".into(), Some(number))
    }

    fn number(folder: &Path) -> Result<(Option<u64>, bool), CheckpointError> {
        Checkpoints::load::<Content>(folder)
            .map(|(_, loaded)| (loaded.content.2, loaded.instead_of.is_some()))
    }

    #[test]
    fn the_last_is_read_and_the_one_before_it_where_that_is_damaged_or_gone() {
        let folder = tempfile::tempdir().expect("a folder");
        assert!(matches!(number(folder.path()), Err(CheckpointError::Missing { .. })));
        let mut checkpoints = Checkpoints::none(folder.path());
        for k in 0..3 {
            checkpoints.save(&content(k)).expect("written");
        }
        let [last, previous] = [CHECKPOINT, PREVIOUS].map(|name| folder.path().join(name));
        assert_eq!(number(folder.path()).expect("whole"), (Some(2), false));
        let bytes = fs::read(&last).expect("there");
        for bad in [&bytes[..bytes.len() - 1], &bytes[..10], &[], &[&bytes[..], b"x"].concat()] {
            fs::write(&last, bad).expect("written");
            assert_eq!(number(folder.path()).expect("the one before"), (Some(1), true));
        }
        // The next one does not push the good one out with the damaged one.
        let (mut checkpoints, _) = Checkpoints::load::<Content>(folder.path()).expect("the one before");
        checkpoints.save(&content(3)).expect("written");
        assert_eq!(number(folder.path()).expect("whole"), (Some(3), false));
        fs::remove_file(&last).expect("removed");
        assert_eq!(number(folder.path()).expect("the one before"), (Some(1), true));
        fs::write(&previous, "nonsense").expect("written");
        assert!(matches!(number(folder.path()), Err(CheckpointError::Damaged { .. })));
        checkpoints.remove().expect("removed");
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 0);
    }

    #[test]
    fn every_flipped_bit_is_noticed() {
        let bytes = sealed(&content(7)).expect("bytes");
        for bit in 0..8 * bytes.len() {
            let mut bad = bytes.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            assert!(
                matches!(opened::<Content>(&bad, Path::new("x")), Err(CheckpointError::Damaged { .. })),
                "bit {bit}"
            );
        }
    }

    #[test]
    fn other_formats_are_refused_as_such() {
        for found in [FORMAT - 1, FORMAT + 1] {
            let mut bytes = sealed(&content(7)).expect("bytes");
            bytes.truncate(bytes.len() - DIGEST);
            bytes[MAGIC.len()..MAGIC.len() + 4].copy_from_slice(&found.to_le_bytes());
            let digest = Sha256::digest(&bytes);
            bytes.extend_from_slice(&digest);
            let folder = tempfile::tempdir().expect("a folder");
            fs::write(folder.path().join(CHECKPOINT), bytes).expect("written");
            fs::write(folder.path().join(PREVIOUS), sealed(&content(6)).expect("bytes")).expect("written");
            let error = number(folder.path()).expect_err("refused").to_string();
            assert!(error.contains(&format!("format {found}")) && error.contains("the version"), "{error}");
        }
    }

    proptest! {
        #[test]
        fn no_bytes_make_the_reader_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            // As they are, and as the content of a sound envelope.
            let _ = opened::<Content>(&bytes, Path::new("x"));
            let mut sound = [MAGIC, &FORMAT.to_le_bytes(), &(bytes.len() as u64).to_le_bytes(),
                &bytes].concat();
            let digest = Sha256::digest(&sound);
            sound.extend_from_slice(&digest);
            let _ = opened::<Content>(&sound, Path::new("x"));
            let _ = opened::<super::super::Snapshot>(&sound, Path::new("x"));
        }
    }

    #[test]
    fn a_checkpoint_that_cannot_be_written_leaves_the_last_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut checkpoints = Checkpoints::none(folder.path());
        checkpoints.save(&content(1)).expect("written");
        let gone = folder.path().join("gone");
        fs::create_dir(&gone).expect("made");
        let mut elsewhere = Checkpoints::none(&gone);
        fs::remove_dir(&gone).expect("removed");
        assert!(matches!(elsewhere.save(&content(2)), Err(FileError::File { .. })));
        assert_eq!(number(folder.path()).expect("whole"), (Some(1), false));
    }
}
