//! `driftless kinematics`: a mechanism moved through the range of its drive.

use super::failure::{Exit, Failure};
use super::flags::KinematicsFlags;
use super::load;
use super::study::{StudyFiles, StudyFolder};
use crate::report::kinematics as report;
use crate::run::files::{KINEMATICS, KINEMATICS_RECORD};
use crate::run::kinematics::{KinematicDrive, KinematicsError, kinematics};

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
    let drive = KinematicDrive { rate: flags.rate, ..flags.drive.clone().unwrap_or_default() };
    let found = kinematics(&scene, &drive, flags.positions as usize)?;
    let name = format!("kinematics-{}", found.drive);
    let folder = StudyFolder::new(&flags.folder, &flags.scene.tell, &scene.name, &name)?;
    let study = StudyFiles {
        files: vec![(KINEMATICS, report::table(&found))],
        record: KINEMATICS_RECORD,
        object: report::object(&found),
        text: report::text(&found),
        #[cfg(feature = "charts")]
        pictures: flags.folder.charts.drawn(|| report::charts(&found))?,
        ..StudyFiles::default()
    };
    folder.publish(study, FILES)
}
