//! What is drawn of runs: their charts, animations and pages.

use super::{Done, SimulateTask};
use crate::cli::failure::{Exit, Failure};
use crate::cli::flags::RunFlags;
use crate::dynamics::Mechanism;
use crate::report;
use crate::report::charts::RowColumns;
use crate::report::view::{Gathering, Viewed};
use crate::run::{Folder, Outcome, Plan};
use crate::scene::Scene;

/// The page of a run, where one is wanted; its rows are seen as they come, but for those of a run that goes
/// on, which are read again at its end.
#[derive(Default)]
pub(super) struct Pages {
    gathered: Option<Gathering>,
}

impl Pages {
    pub fn see(&mut self, row: &[f64]) {
        if let Some(gathered) = &mut self.gathered {
            gathered.push(row);
        }
    }

    pub fn write(self, task: &SimulateTask<'_>, folder: &mut Folder) -> Result<(), Failure> {
        let flags = task.flags;
        if !flags.html {
            return Ok(());
        }
        let run = Viewed::read(folder.path(), flags.window, self.gathered)?;
        crate::cli::view::write(folder, &[run], &flags.scene.tell)
    }
}

impl SimulateTask<'_> {
    /// The window charts show; it has to hold rows.
    pub(super) fn window(&self, plan: &Plan) -> Result<Option<[f64; 2]>, Failure> {
        let Some([from, to]) = self.flags.window else { return Ok(None) };
        let rows = ((to.min(plan.until) / plan.every).floor() - (from / plan.every).ceil() + 1.0).max(0.0);
        if rows >= 2.0 {
            return Ok(Some([from, to]));
        }
        let hint = if from >= plan.until {
            format!("the run ends at {} s", plan.until)
        } else {
            format!("--every {} gives it 100 rows", report::page::rough((to - from) / 100.0))
        };
        let text = format!("--window {from}..{to}: {rows} rows of the trajectory lie in it\nhint: {hint}");
        Err(Failure::new(Exit::Usage, text))
    }

    /// The page of a run that begins.
    pub(super) fn page(&self, plan: &Plan) -> Pages {
        let gathering = || Gathering::new(self.mechanism, plan.until, plan.every, self.flags.window);
        Pages { gathered: self.flags.html.then(gathering) }
    }
}

/// Refuses columns to be drawn that do not exist.
pub(super) fn check(mechanism: &Mechanism, flags: &RunFlags) -> Result<(), Failure> {
    columns(mechanism, flags).map(drop)
}

/// The columns to be drawn.
fn columns(mechanism: &Mechanism, flags: &RunFlags) -> Result<RowColumns, Failure> {
    RowColumns::find(mechanism, &flags.chart)
        .map_err(|error| Failure::new(Exit::Usage, format!("--chart: {error}")))
}

/// Draws what is wanted of one run.
pub(super) fn draw(
    scene: &Scene,
    mechanism: &Mechanism,
    outcome: &Outcome,
    folder: &mut Folder,
    flags: &RunFlags,
) -> Result<(), Failure> {
    let tell = &flags.scene.tell;
    if !flags.charts.no_charts {
        let wanted = report::charts::wanted(mechanism, outcome);
        if !wanted.contains(&report::charts::Chart::Angles) {
            tell.remark("no chart of angles: nothing moves");
        }
        for chart in wanted {
            let picture = report::charts::draw(chart, scene, mechanism, outcome)?;
            flags.charts.keep(folder, chart.name(), &picture, tell)?;
        }
        if !flags.chart.is_empty() {
            let chosen = columns(mechanism, flags)?;
            let picture = report::charts::columns(scene, mechanism, outcome, &chosen)?;
            flags.charts.keep(folder, "columns", &picture, tell)?;
        }
    }
    if flags.motion.has_any() {
        let motion = report::charts::motion(scene, mechanism, outcome);
        flags.motion.keep(folder, "mechanism", &motion, tell)?;
    }
    Ok(())
}

/// Several runs in one page, and their constraint drift in one chart, beside their folders.
pub(super) fn overlay(
    scene: &Scene,
    mechanism: &Mechanism,
    done: &[Done],
    flags: &RunFlags,
) -> Result<(), Failure> {
    if flags.html && done.len() > 1 {
        let read = |done: &Done| Viewed::read(done.folder.path(), flags.window, None);
        let runs = done.iter().map(read).collect::<Result<Vec<_>, _>>()?;
        let mut folder = Folder::shared(&flags.out.join(&scene.name))?;
        crate::cli::view::write(&mut folder, &runs, &flags.scene.tell)?;
    }
    let outcomes: Vec<&Outcome> = done.iter().map(|done| &done.outcome).collect();
    if done.len() < 2 || flags.charts.no_charts || !report::charts::drifts(&outcomes) {
        return Ok(());
    }
    let picture = report::charts::overlay(scene, mechanism, &outcomes)?;
    let mut folder = Folder::shared(&flags.out.join(&scene.name))?;
    flags.charts.keep(&mut folder, "constraint_drift", &picture, &flags.scene.tell)
}
