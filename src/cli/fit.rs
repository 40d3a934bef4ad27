//! `driftless fit`: numbers of a scene from measured data.

use super::failure::{Exit, Failure};
use super::flags::FitFlags;
use super::study::{StudyFiles, StudyFolder};
use super::{interrupt, load_template};
use crate::report::fit as report;
use crate::run::files::{FIT, FIT_RECORD};
use crate::run::fit::{Data, FitError, FitRequest, fit};

/// Every file it may leave.
const FILES: &[&str] = &[FIT_RECORD, FIT, "fit.png", "residuals.png"];

impl From<FitError> for Failure {
    fn from(error: FitError) -> Self {
        let exit = match error {
            FitError::Sensitivity(error) => return error.into(),
            FitError::Asked(_) => Exit::Usage,
            FitError::Unreadable { .. } => Exit::Io,
            FitError::Data(_) => Exit::Scene,
            FitError::Failed(_) => Exit::Stopped,
            FitError::Interrupted => Exit::Interrupted,
        };
        Self::new(exit, error.to_string())
    }
}

/// Fits numbers of a scene to data.
///
/// # Errors
/// The scene, the data, names in them, the search, or files.
pub fn run(flags: &FitFlags) -> Result<(), Failure> {
    interrupt::listen()?;
    let data = Data::read(&flags.data)?;
    let template = load_template(&flags.scene)?;
    let request = FitRequest {
        vary: flags.vary.clone(),
        columns: flags.columns.clone(),
        sigmas: flags.sigma.clone(),
        segments: flags.segments as usize,
        tolerance: flags.rtol,
    };
    let scene = template.scene()?.name;
    let folder = StudyFolder::new(&flags.folder, &flags.scene.tell, &scene, "fit")?;
    let found = fit(&template, &data, &request, &mut interrupt::is_asked)?;
    let study = StudyFiles {
        files: vec![(FIT, report::table(&found).into_bytes())],
        record: FIT_RECORD,
        object: report::object(&found),
        text: report::text(&found),
        #[cfg(feature = "charts")]
        pictures: flags.folder.charts.drawn(|| report::charts(&found))?,
        ..StudyFiles::default()
    };
    folder.publish(study, FILES)
}
