//! `driftless modes`: equilibria and their modes, or periodic motions and their multipliers.

use super::failure::{Exit, Failure};
use super::flags::ModesFlags;
use super::load;
use super::study::{StudyFiles, StudyFolder};
use crate::report::{modes as at_rest, periodic as in_motion};
use crate::run::files::MODES_RECORD;
use crate::run::modes::{Modes, ModesError, PeriodicMotions, modes, periodic};

/// Every file it may leave.
const FILES: &[&str] = &[
    MODES_RECORD,
    "mode1.png",
    "mode2.png",
    "mode3.png",
    "mode4.png",
    "mode1.gif",
    "mode2.gif",
    "mode3.gif",
    "mode4.gif",
    "motion.png",
    "motion.gif",
    "multipliers.png",
];

/// What was found.
enum ModesResult {
    Rest(Modes),
    Motion(PeriodicMotions),
}

impl From<ModesError> for Failure {
    fn from(error: ModesError) -> Self {
        Self::new(Exit::Scene, error.to_string())
    }
}

/// Looks for the equilibria of a scene, or for its periodic motions where something drives it.
///
/// # Errors
/// The scene, or files.
pub fn run(flags: &ModesFlags) -> Result<(), Failure> {
    let (scene, mechanism) = load(&flags.scene)?;
    let folder = StudyFolder::new(&flags.folder, &flags.scene.tell, &scene.name, "modes")?;
    #[cfg(feature = "charts")]
    let folder = folder.with_motions(&flags.motion);
    let starts = flags.starts as usize;
    let resting = if flags.period.is_none() { Some(modes(&scene, &mechanism, starts)) } else { None };
    let found = match resting {
        Some(Ok(found)) => ModesResult::Rest(found),
        Some(Err(error)) if !matches!(error, ModesError::Moving(_) | ModesError::Forced) => {
            return Err(error.into());
        }
        _ => ModesResult::Motion(periodic(&scene, &mechanism, starts, flags.period)?),
    };
    let (object, text) = match &found {
        ModesResult::Rest(found) => (at_rest::object(found), at_rest::text(found)),
        ModesResult::Motion(found) => (in_motion::object(found), in_motion::text(found)),
    };
    #[cfg(feature = "charts")]
    let (pictures, motions) = flags.folder.charts.drawn(|| match &found {
        ModesResult::Rest(found) => at_rest::charts(found),
        ModesResult::Motion(found) => in_motion::charts(found),
    })?;
    let study = StudyFiles {
        record: MODES_RECORD,
        object,
        text,
        #[cfg(feature = "charts")]
        pictures,
        #[cfg(feature = "charts")]
        motions,
        ..StudyFiles::default()
    };
    folder.publish(study, FILES)
}
