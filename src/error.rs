//! One error for programs that use the crate.

use crate::dynamics::CompileError;
#[cfg(feature = "files")]
use crate::run::{CheckpointError, FileError};
use crate::run::{RequestRefusal, ResumeError, RunError, SweepError};
use crate::scene::SceneError;
use crate::stepping::StepError;

/// Whatever keeps a scene from being read, compiled, planned or integrated.
///
/// Each of them says what is wrong, where, and mostly what to do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The scene cannot be read, or is refused.
    #[error("{0}")]
    Scene(#[from] SceneError),
    /// The scene has no equations of motion.
    #[error("{0}")]
    Equations(#[from] CompileError),
    /// What was asked for makes no sense for the scene.
    #[error("{0}")]
    Refused(#[from] RequestRefusal),
    /// The method could not begin.
    #[error("{0}")]
    Step(#[from] StepError),
    /// A run cannot go on from a snapshot.
    #[error("{0}")]
    Resume(#[from] ResumeError),
    /// A sweep cannot be run.
    #[error("{0}")]
    Sweep(#[from] SweepError),
    /// An observer failed to write.
    #[error("{0}")]
    Observer(#[from] std::io::Error),
    /// A checkpoint cannot be read or written.
    #[cfg(feature = "files")]
    #[error("{0}")]
    Checkpoint(#[from] CheckpointError),
    /// A file cannot be read or written.
    #[cfg(feature = "files")]
    #[error("{0}")]
    File(#[from] FileError),
}

impl From<RunError> for Error {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Compile(error) => Self::Equations(error),
            RunError::Refused(error) => Self::Refused(error),
            RunError::Step(error) => Self::Step(error),
            RunError::Observer(error) => Self::Observer(error),
        }
    }
}
