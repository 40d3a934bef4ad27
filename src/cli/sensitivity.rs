//! `driftless sensitivity`: derivatives of outputs and measures by numbers of the scene, or the Lyapunov
//! spectrum.

use super::failure::{Exit, Failure};
use super::flags::SensitivityFlags;
use super::output::{name_files, print, print_object};
use super::{interrupt, load_template};
use crate::report::result::files;
use crate::report::sensitivity as report;
use crate::run::Folder;
use crate::run::sensitivity::{SensitivityError, SensitivityRequest, lyapunov, sensitivity};
use serde_json::Value;

const RECORD: &str = "sensitivity.json";
const TABLE: &str = "sensitivity.csv";
const SPECTRUM_RECORD: &str = "lyapunov.json";
const SPECTRUM_TABLE: &str = "lyapunov.csv";
/// Every file it may leave.
const FILES: [&[&str]; 2] = [
    &[RECORD, TABLE, "sensitivity.png", "sensitivity_time.png", "uncertainty.png"],
    &[SPECTRUM_RECORD, SPECTRUM_TABLE, "lyapunov.png"],
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

/// What is written and told.
struct Told {
    files: Vec<(&'static str, String)>,
    object: Value,
    text: String,
    #[cfg(feature = "charts")]
    charts: report::Charts,
    failure: Option<Failure>,
}

/// Derives measures of a run by numbers of its scene.
///
/// # Errors
/// The scene, names in it, the run, or files.
pub fn run(flags: &SensitivityFlags) -> Result<(), Failure> {
    interrupt::listen()?;
    let (told, folder) = match flags.lyapunov {
        true => (spectrum(flags)?, "lyapunov"),
        false => (derivatives(flags)?, "sensitivity"),
    };
    let name = told.object["scene"].as_str().unwrap_or("scene").to_owned();
    let mut folder = Folder::open(&flags.out.join(name).join(folder), flags.force)?;
    if flags.force {
        folder.clear(FILES[usize::from(flags.lyapunov)])?;
    }
    for (name, content) in &told.files {
        folder.write(*name, content.as_bytes())?;
    }
    #[cfg(feature = "charts")]
    if !flags.charts.no_charts {
        for (name, picture) in &told.charts {
            flags.charts.keep(&mut folder, name, picture, &flags.scene.tell)?;
        }
    }
    let mut object = told.object;
    name_files(&mut object, &folder);
    if flags.scene.tell.json {
        print_object(&object)?;
    } else if !flags.scene.tell.quiet {
        print(&(told.text + &files(folder.path(), folder.names())))?;
    }
    told.failure.map_or(Ok(()), |failure| Err(if flags.scene.tell.json { failure.told() } else { failure }))
}

fn derivatives(flags: &SensitivityFlags) -> Result<Told, Failure> {
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
    let template = load_template(&flags.scene)?;
    let mut deviations: Vec<(String, f64)> = Vec::new();
    let mut to = Vec::new();
    for name in &flags.to {
        to.push(template.variable(name)?.path);
    }
    for (name, sigma) in &flags.uncertainty {
        let path = template.variable(name)?.path;
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
    let found = sensitivity(&template, &request, &mut interrupt::is_asked)?;
    let sigma =
        |path: &str| deviations.iter().filter(|(known, _)| known == path).map(|(_, sigma)| *sigma).sum();
    let sigmas: Vec<f64> = match deviations.is_empty() {
        true => Vec::new(),
        false => found.inputs.iter().map(|input| sigma(&input.path)).collect(),
    };
    let object = report::object(&found, &sigmas);
    let mut files = vec![(RECORD, format!("{object:#}\n"))];
    if !found.rows.is_empty() {
        files.push((TABLE, report::table(&found, &sigmas)));
    }
    let failure = found.measures.iter().find_map(|measured| {
        let why = measured.why.as_ref()?;
        Some(Failure::new(Exit::Stopped, format!("no derivatives of {}: {why}", measured.name)))
    });
    Ok(Told {
        files,
        text: report::text(&found, &sigmas),
        #[cfg(feature = "charts")]
        charts: if flags.charts.no_charts { Vec::new() } else { report::charts(&found, &sigmas)? },
        object,
        failure,
    })
}

fn spectrum(flags: &SensitivityFlags) -> Result<Told, Failure> {
    let template = load_template(&flags.scene)?;
    let found = lyapunov(&template, flags.at, flags.rtol, &mut interrupt::is_asked)?;
    let object = report::spectrum_object(&found);
    let files =
        vec![(SPECTRUM_RECORD, format!("{object:#}\n")), (SPECTRUM_TABLE, report::spectrum_table(&found))];
    let failure = found.lost.as_ref().map(|lost| Failure::new(Exit::Stopped, lost.clone()));
    Ok(Told {
        files,
        text: report::spectrum_text(&found),
        #[cfg(feature = "charts")]
        charts: if flags.charts.no_charts { Vec::new() } else { report::spectrum_charts(&found)? },
        object,
        failure,
    })
}
