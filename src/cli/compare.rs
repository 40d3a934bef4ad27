//! `driftless compare`: every method that fits, at all its settings, against a reference and against the
//! clock.

use super::failure::{Exit, Failure};
use super::flags::CompareFlags;
use super::interrupt;
use super::output::{name_files, print, print_object};
use super::progress::CompareProgress;
use crate::dynamics::Mechanism;
use crate::report;
use crate::run::compare::{Asked, Comparison, compare};
use crate::run::files::{COMPARISON, COMPARISON_RECORD, quoted};
use crate::run::{Folder, MethodId};
use crate::scene::Scene;
use std::time::{Duration, Instant};

/// Blocks of repeated runs of each setting.
const BLOCKS: usize = 9;

/// Compares methods on a scene.
///
/// # Errors
/// The scene, the request or the folder; where it was interrupted what there is has been written.
pub fn run(flags: &CompareFlags) -> Result<(), Failure> {
    interrupt::listen()?;
    let (scene, mechanism) = super::load(&flags.scene)?;
    let budget = Duration::try_from_secs_f64(flags.budget).ok().filter(|budget| !budget.is_zero());
    let budget =
        budget.ok_or_else(|| Failure::new(Exit::Usage, "--budget: not a time above 0\nhint: --budget 60"))?;
    let asked = Asked {
        methods: flags.methods.clone(),
        stabilize: flags.stabilize.clone(),
        until: flags.until,
        budget,
        blocks: BLOCKS,
    };
    asked.horizon(&scene, &mechanism)?;
    let mut folder = Folder::open(&flags.folder.out.join(&scene.name).join("compare"), flags.folder.force)?;
    let mut progress = CompareProgress::new(&scene.name, flags.scene.tell.quiet);
    let begin = Instant::now();
    let comparison = compare(
        &scene,
        &mechanism,
        &asked,
        &|| begin.elapsed(),
        &mut |stage| progress.see(stage),
        &interrupt::is_asked,
    );
    progress.finish();
    let comparison = comparison?;
    keep(&scene, &mechanism, &comparison, &mut folder, flags).inspect_err(|_| folder.take_back())?;
    tell(&scene, &mechanism, &comparison, &folder, flags)?;
    if comparison.is_whole {
        return Ok(());
    }
    let message =
        format!("interrupted; what was measured, {}, is in {}", count(&comparison), quoted(folder.path()));
    Err(Failure::new(Exit::Interrupted, message).told())
}

/// `12 settings of 5 methods`.
fn count(comparison: &Comparison) -> String {
    let mut methods: Vec<MethodId> = comparison.entries.iter().map(|entry| entry.method).collect();
    methods.dedup();
    methods.sort_by_key(|method| method.info().name);
    methods.dedup();
    format!("{} settings of {} methods", comparison.entries.len(), methods.len())
}

/// Writes table and charts, and the record last.
fn keep(
    scene: &Scene,
    mechanism: &Mechanism,
    comparison: &Comparison,
    folder: &mut Folder,
    flags: &CompareFlags,
) -> Result<(), Failure> {
    if flags.folder.force {
        folder.clear(FILES)?;
    }
    folder.write(COMPARISON, report::compare::csv(comparison).as_bytes())?;
    #[cfg(feature = "charts")]
    if !flags.folder.charts.no_charts {
        for chart in report::compare::CompareChart::ALL {
            let picture = report::compare::draw(chart, scene, mechanism, comparison)?;
            flags.folder.charts.keep(folder, chart.name(), &picture, &flags.scene.tell)?;
        }
    }
    #[cfg(feature = "charts")]
    if flags.html {
        let page = report::view::compared(scene, mechanism, comparison, &flags.scene.given());
        super::view::keep(folder, "compare.html", &page, &flags.scene.tell)?;
    }
    let record = format!("{:#}\n", report::compare::object(scene, mechanism, comparison));
    Ok(folder.write(COMPARISON_RECORD, record.as_bytes())?)
}

/// Every file a comparison may leave.
const FILES: &[&str] = &[
    COMPARISON,
    COMPARISON_RECORD,
    "error_against_run_time.png",
    "energy_drift_against_run_time.png",
    "error_against_evaluations.png",
    "compare.html",
];

/// Prints the results.
fn tell(
    scene: &Scene,
    mechanism: &Mechanism,
    comparison: &Comparison,
    folder: &Folder,
    flags: &CompareFlags,
) -> Result<(), Failure> {
    if flags.scene.tell.json {
        let mut object = report::compare::object(scene, mechanism, comparison);
        name_files(&mut object, folder);
        return print_object(&object);
    }
    if flags.scene.tell.quiet {
        return Ok(());
    }
    print(
        &(report::compare::text(scene, mechanism, comparison)
            + &report::result::files(folder.path(), folder.names())),
    )
}
