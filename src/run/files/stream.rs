//! A table being written, and how far it was written.

use sha2::digest::common::hazmat::{SerializableState, SerializedState};
use sha2::{Digest, Sha256};
use std::cell::Cell;
use std::fs::{self, File};
use std::io::{self, Read, Seek, Write};
use std::path::PathBuf;

/// A table being written; dropped unfinished it leaves nothing behind, unless a checkpoint refers to it.
#[derive(Debug)]
pub struct Stream {
    pub(super) file: File,
    pub(super) path: PathBuf,
    pub(super) name: &'static str,
    pub(super) hash: Sha256,
    pub(super) bytes: u64,
    pub(super) lasts: Cell<bool>,
}

/// How far a table was written: so much of it counts.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StreamPosition {
    pub(super) bytes: u64,
    /// The state of its SHA-256 there.
    hash: Vec<u8>,
}

impl Stream {
    /// How far it is, once that much has reached the disk.
    ///
    /// # Errors
    /// The disk does not take it.
    pub fn cursor(&self) -> io::Result<StreamPosition> {
        self.file.sync_data()?;
        Ok(StreamPosition { bytes: self.bytes, hash: self.hash.serialize().to_vec() })
    }

    /// Outlives its writer from now on: a checkpoint refers to it.
    pub fn outlive(&self) {
        self.lasts.set(true);
    }
}

impl StreamPosition {
    pub(super) fn hash(&self) -> Option<Sha256> {
        let state = SerializedState::<Sha256>::try_from(self.hash.as_slice()).ok()?;
        Sha256::deserialize(&state).ok()
    }
}

impl Drop for Stream {
    fn drop(&mut self) {
        if !self.lasts.get() {
            // Where that fails, the next run sweeps it out.
            let _ = fs::remove_file(&self.path);
        }
    }
}

impl Write for Stream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.file.write(bytes)?;
        self.hash.update(&bytes[..count]);
        self.bytes += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// SHA-256 of the first bytes of a file.
pub(super) fn hashed(file: &mut File, bytes: u64) -> io::Result<sha2::digest::Output<Sha256>> {
    file.rewind()?;
    let (mut hash, mut left, mut buffer) = (Sha256::new(), bytes, vec![0; 1 << 16]);
    while left > 0 {
        let most = left.min(buffer.len() as u64) as usize;
        let count = file.read(&mut buffer[..most])?;
        if count == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        hash.update(&buffer[..count]);
        left -= count as u64;
    }
    Ok(hash.finalize())
}
