//! `driftless sensitivity`: derivatives of outputs and measures by numbers of the scene, or the Lyapunov
//! spectrum.

use super::failure::{Exit, Failure};
use super::flags::SensitivityFlags;
use super::study::{StudyFiles, StudyFolder};
use super::{interrupt, load_template};
use crate::report::sensitivity as report;
use crate::run::files::{SENSITIVITY, SENSITIVITY_RECORD, SPECTRUM, SPECTRUM_RECORD};
use crate::run::sensitivity::{SensitivityError, SensitivityRequest, lyapunov, sensitivity};
use crate::scene::Template;

/// Every file it may leave.
const FILES: [&[&str]; 2] = [
    &[SENSITIVITY_RECORD, SENSITIVITY, "sensitivity.png", "sensitivity_time.png", "uncertainty.png"],
    &[SPECTRUM_RECORD, SPECTRUM, "lyapunov.png"],
];
/// Rows over time where nobody says.
const ROWS: f64 = 200.0;

impl From<SensitivityError> for Failure {
    fn from(error: SensitivityError) -> Self {
        let exit = match &error {
            SensitivityError::Asked { .. } => Exit::Usage,
            SensitivityError::Stopped(why) if why == "interrupted" => Exit::Interrupted,
            SensitivityError::Stopped(_) => Exit::Stopped,
            _ => Exit::Scene,
        };
        Self::new(exit, error.to_string())
    }
}

/// Derives measures of a run by numbers of its scene.
///
/// # Errors
/// The scene, names in it, the run, or files.
pub fn run(flags: &SensitivityFlags) -> Result<(), Failure> {
    interrupt::listen()?;
    let name = if flags.lyapunov { "lyapunov" } else { "sensitivity" };
    let template = load_template(&flags.scene)?;
    let folder = StudyFolder::new(&flags.folder, &flags.scene.tell, &template.scene()?.name, name)?;
    let study = if flags.lyapunov { spectrum(&template, flags)? } else { derivatives(&template, flags)? };
    folder.publish(study, FILES[usize::from(flags.lyapunov)])
}

fn derivatives(template: &Template, flags: &SensitivityFlags) -> Result<StudyFiles, Failure> {
    let usage = |text: &str| Failure::new(Exit::Usage, text);
    if flags.of.is_empty() {
        return Err(usage(
            "nothing to derive\nhint: name outputs and measures, as --of bar2.phi,max:motor.torque,flip",
        ));
    }
    if flags.to.is_empty() && flags.uncertainty.is_empty() {
        return Err(usage(
            "no number to derive by\nhint: name numbers of the scene, as --to gravity[0],bar1.phi",
        ));
    }
    let mut deviations: Vec<(String, f64)> = Vec::new();
    let mut to = Vec::new();
    for name in &flags.to {
        to.push(template.variable(name)?.path);
    }
    for (name, sigma) in &flags.uncertainty {
        let path = template.variable(name)?.path;
        if deviations.iter().any(|(known, _)| *known == path) {
            let text = format!("--uncertainty names {path} twice\nhint: name each number once");
            return Err(Failure::new(Exit::Usage, text));
        }
        deviations.push((path.clone(), *sigma));
        to.push(path);
    }
    let mut seen = std::collections::HashSet::new();
    to.retain(|path| seen.insert(path.clone()));
    let until = flags.at.unwrap_or(template.scene()?.until);
    let is_over_time = flags.over_time || flags.every.is_some() || !deviations.is_empty();
    let request = SensitivityRequest {
        of: flags.of.clone(),
        to,
        at: flags.at,
        every: is_over_time.then(|| flags.every.unwrap_or(until / ROWS)),
        tolerance: flags.rtol,
    };
    let found = sensitivity(template, &request, &mut interrupt::is_asked)?;
    let sigma = |path: &str| {
        let known = deviations.iter().find(|(known, _)| known == path);
        known.map_or(0.0, |(_, sigma)| *sigma)
    };
    let sigmas: Vec<f64> = match deviations.is_empty() {
        true => Vec::new(),
        false => found.inputs.iter().map(|input| sigma(&input.path)).collect(),
    };
    let failure = found.measures.iter().find_map(|measured| {
        let why = measured.why.as_ref()?;
        Some(Failure::new(Exit::Stopped, format!("no derivatives of {}: {why}", measured.name)))
    });
    let files = match found.rows.is_empty() {
        true => Vec::new(),
        false => vec![(SENSITIVITY, report::table(&found, &sigmas).into_bytes())],
    };
    Ok(StudyFiles {
        files,
        record: SENSITIVITY_RECORD,
        object: report::object(&found, &sigmas),
        text: report::text(&found, &sigmas),
        #[cfg(feature = "charts")]
        pictures: flags.folder.charts.drawn(|| report::charts(&found, &sigmas))?,
        failure,
        ..StudyFiles::default()
    })
}

fn spectrum(template: &Template, flags: &SensitivityFlags) -> Result<StudyFiles, Failure> {
    let found = lyapunov(template, flags.at, flags.rtol, &mut interrupt::is_asked)?;
    let failure = found.lost.as_ref().map(|lost| Failure::new(Exit::Stopped, lost.clone()));
    Ok(StudyFiles {
        files: vec![(SPECTRUM, report::spectrum_table(&found).into_bytes())],
        record: SPECTRUM_RECORD,
        object: report::spectrum_object(&found),
        text: report::spectrum_text(&found),
        #[cfg(feature = "charts")]
        pictures: flags.folder.charts.drawn(|| report::spectrum_charts(&found))?,
        failure,
        ..StudyFiles::default()
    })
}
