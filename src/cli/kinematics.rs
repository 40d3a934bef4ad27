//! `driftless kinematics`: a mechanism moved through the range of its drive.

use super::failure::{Exit, Failure};
use super::flags::KinematicsFlags;
use super::load;
use super::output::{name_files, print, print_object};
use crate::report::kinematics as report;
use crate::report::result::files;
use crate::run::Folder;
use crate::run::files::{KINEMATICS, KINEMATICS_RECORD};
use crate::run::kinematics::{Drive, KinematicsError, kinematics};

/// Every file it may leave.
const FILES: &[&str] = &[KINEMATICS, KINEMATICS_RECORD, "mechanism.png", "kinematics.png"];

impl From<KinematicsError> for Failure {
    fn from(error: KinematicsError) -> Self {
        let exit = match error {
            KinematicsError::Unknown { .. } | KinematicsError::NoDrive(_) | KinematicsError::NoRange(_) => {
                Exit::Usage
            }
            _ => Exit::Scene,
        };
        Self::new(exit, error.to_string())
    }
}

/// Moves a scene through the range of its drive.
///
/// # Errors
/// The scene, its drive, or files.
pub fn run(flags: &KinematicsFlags) -> Result<(), Failure> {
    let (scene, _) = load(&flags.scene)?;
    let drive = Drive { rate: flags.rate, ..flags.drive.clone().unwrap_or_default() };
    let found = kinematics(&scene, &drive, flags.positions as usize)?;
    let path = flags.out.join(&scene.name).join(format!("kinematics-{}", found.drive));
    let mut folder = Folder::open(&path, flags.force)?;
    if flags.force {
        folder.clear(FILES)?;
    }
    folder.write(KINEMATICS, &report::table(&found))?;
    #[cfg(feature = "charts")]
    if !flags.charts.no_charts {
        for (name, picture) in report::charts(&found)? {
            flags.charts.keep(&mut folder, name, &picture, &flags.scene.tell)?;
        }
    }
    let mut object = report::object(&found);
    folder.write(KINEMATICS_RECORD, format!("{object:#}\n").as_bytes())?;
    name_files(&mut object, &folder);
    if flags.scene.tell.json {
        return print_object(&object);
    }
    if flags.scene.tell.quiet {
        Ok(())
    } else {
        print(&(report::text(&found) + &files(folder.path(), folder.names())))
    }
}
