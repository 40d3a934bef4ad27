//! `driftless modes`: equilibria, their stability and modes.

use super::failure::{Exit, Failure};
use super::flags::ModesFlags;
use super::load;
use super::output::{name_files, print, print_object};
use crate::report::modes as report;
use crate::report::result::files;
use crate::run::Folder;
use crate::run::files::MODES_RECORD;
use crate::run::modes::{ModesError, modes};

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
];

impl From<ModesError> for Failure {
    fn from(error: ModesError) -> Self {
        Self::new(Exit::Scene, error.to_string())
    }
}

/// Looks for the equilibria of a scene.
///
/// # Errors
/// The scene, or files.
pub fn run(flags: &ModesFlags) -> Result<(), Failure> {
    let (scene, mechanism) = load(&flags.scene)?;
    let found = modes(&scene, &mechanism, flags.starts as usize)?;
    let mut folder = Folder::open(&flags.out.join(&scene.name).join("modes"), flags.force)?;
    if flags.force {
        folder.clear(FILES)?;
    }
    #[cfg(feature = "charts")]
    if !flags.no_charts {
        for (name, content) in report::charts(&found, flags.gif)? {
            folder.write(name, &content)?;
        }
    }
    let mut object = report::object(&found);
    folder.write(MODES_RECORD, format!("{object:#}\n").as_bytes())?;
    name_files(&mut object, &folder);
    if flags.scene.tell.json {
        return print_object(&object);
    }
    if flags.scene.tell.quiet {
        return Ok(());
    }
    print(&(report::text(&found) + &files(folder.path(), folder.names())))
}
