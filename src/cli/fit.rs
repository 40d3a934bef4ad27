//! `driftless fit`: numbers of a scene from measured data.

use super::failure::{Exit, Failure};
use super::flags::FitFlags;
use super::output::{name_files, print, print_object};
use super::{interrupt, load_template};
use crate::report::fit as report;
use crate::report::result::files;
use crate::run::Folder;
use crate::run::fit::{Data, FitError, FitRequest, fit};

const RECORD: &str = "fit.json";
const TABLE: &str = "fit.csv";
/// Every file it may leave.
const FILES: &[&str] = &[RECORD, TABLE, "fit.png", "residuals.png"];

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
    let found = fit(&template, &data, &request, &mut interrupt::is_asked)?;
    let mut folder = Folder::open(&flags.out.join(&found.scene.name).join("fit"), flags.force)?;
    if flags.force {
        folder.clear(FILES)?;
    }
    let mut object = report::object(&found);
    folder.write(RECORD, format!("{object:#}\n").as_bytes())?;
    folder.write(TABLE, report::table(&found).as_bytes())?;
    #[cfg(feature = "charts")]
    if !flags.charts.no_charts {
        for (name, picture) in report::charts(&found)? {
            flags.charts.keep(&mut folder, name, &picture, &flags.scene.tell)?;
        }
    }
    name_files(&mut object, &folder);
    if flags.scene.tell.json {
        return print_object(&object);
    }
    if flags.scene.tell.quiet {
        return Ok(());
    }
    print(&(report::text(&found) + &files(folder.path(), folder.names())))
}
