//! `driftless modes`: equilibria and their modes, or periodic motions and their multipliers.

use super::failure::{Exit, Failure};
use super::flags::ModesFlags;
use super::load;
use super::output::{name_files, print, print_object};
use crate::report::result::files;
use crate::report::{modes as at_rest, periodic as in_motion};
use crate::run::Folder;
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
enum Found {
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
    let starts = flags.starts as usize;
    let resting = if flags.period.is_none() { Some(modes(&scene, &mechanism, starts)) } else { None };
    let found = match resting {
        Some(Ok(found)) => Found::Rest(found),
        Some(Err(error)) if !matches!(error, ModesError::Moving(_) | ModesError::Forced) => {
            return Err(error.into());
        }
        _ => Found::Motion(periodic(&scene, &mechanism, starts, flags.period)?),
    };
    let mut folder = Folder::open(&flags.out.join(&scene.name).join("modes"), flags.force)?;
    if flags.force {
        folder.clear(FILES)?;
    }
    #[cfg(feature = "charts")]
    if !flags.charts.no_charts {
        let (pictures, motions) = match &found {
            Found::Rest(found) => at_rest::charts(found)?,
            Found::Motion(found) => in_motion::charts(found)?,
        };
        for (name, picture) in pictures {
            flags.charts.keep(&mut folder, name, &picture, &flags.scene.tell)?;
        }
        for (name, motion) in motions {
            flags.motion.keep(&mut folder, name, &motion, &flags.scene.tell)?;
        }
    }
    let (mut object, text) = match &found {
        Found::Rest(found) => (at_rest::object(found), at_rest::text(found)),
        Found::Motion(found) => (in_motion::object(found), in_motion::text(found)),
    };
    folder.write(MODES_RECORD, format!("{object:#}\n").as_bytes())?;
    name_files(&mut object, &folder);
    if flags.scene.tell.json {
        return print_object(&object);
    }
    if flags.scene.tell.quiet {
        return Ok(());
    }
    print(&(text + &files(folder.path(), folder.names())))
}
