//! `driftless sweep`: march a grid of points, and keep a row of each.

use super::failure::{Exit, Failure};
use super::flags::SweepFlags;
use super::output::{print, print_object};
use super::progress::Points;
use crate::report;
#[cfg(feature = "charts")]
use crate::report::sweep::{Curve, NoChart};
use crate::run::files::{SWEEP, SWEEP_RECORD};
use crate::run::{Folder, Limits, Observer, Point, Request, Stream, Sweep, SweepError, SweepTable, Totals, sweep};
use crate::scene::Template;
use serde_json::json;

/// Every file a sweep may leave; those of an earlier one in the same folder go with it.
const FILES: &[&str] = &[SWEEP, SWEEP_RECORD, "map.png", "profile.png"];
/// Longest name of a folder that is made of what is varied.
const LONGEST: usize = 120;

/// Runs a scene over a grid.
///
/// # Errors
/// The scene, what is varied, the plan or the folder; points that fail are rows of the table.
pub fn run(flags: &SweepFlags) -> Result<(), Failure> {
    let plan = prepared(flags)?;
    for (axis, variable) in plan.grid().axes().iter().zip(plan.variables()) {
        flags.scene.remark(&format!("vary {} from {} to {} {}, {} values", variable.path, axis.from, axis.to, variable.unit, axis.count));
    }
    flags.scene.remark(&format!("{}; {}", report::setting(plan.plan()), plan.plan().why.as_deref().unwrap_or("as asked for")));
    #[cfg(feature = "charts")]
    let curve = curve(&plan, flags)?;
    let mut folder = Folder::open(&flags.out.join(&plan.scene().name).join(folder_name(&plan)), flags.force)?;
    let mut writer = Writer {
        table: SweepTable::new(&plan, folder.begin(SWEEP)?).map_err(|error| folder.failed(SWEEP, error.into()))?,
        progress: Points::new(&plan.scene().name, plan.grid().count(), flags.scene.quiet),
        #[cfg(feature = "charts")]
        curve,
    };
    let totals = sweep(&plan, flags.threads.map_or(0, usize::from), &mut writer);
    writer.progress.finish();
    let totals = totals.map_err(|error| match error {
        SweepError::Observer(error) => Failure::from(folder.failed(SWEEP, error)),
        error => error.into(),
    })?;
    let stream = writer.table.finish().map_err(|error| folder.failed(SWEEP, error))?;
    if flags.force {
        // Nothing of an older sweep may stand beside the new table.
        folder.clear(&FILES[1..])?;
    }
    let hash = folder.keep(stream)?;
    #[cfg(feature = "charts")]
    if let Some(curve) = &writer.curve {
        draw(&plan, curve, &mut folder, flags)?;
    }
    let text = format!("{:#}\n", report::sweep::record(&plan, &totals, &hash));
    folder.write(SWEEP_RECORD, text.as_bytes())?;
    tell(&plan, &totals, &folder, flags)
}

/// The sweep asked for.
fn prepared(flags: &SweepFlags) -> Result<Sweep, Failure> {
    let requests = flags.plan.requests();
    let [request]: &[Request; 1] = requests.as_slice().try_into().map_err(|_| {
        Failure::new(Exit::Usage, "--stabilize: a sweep keeps its constraints in one way\nhint: name one, or sweep several times")
    })?;
    let template = Template::read(&flags.scene.scene, &flags.scene.set)?;
    let limits = Limits { energy: flags.max_energy_drift, constraint: flags.max_constraint_drift };
    let plan = Sweep::new(&template, flags.vary.clone(), request)?.with_limits(limits);
    super::settle(&flags.scene, plan.mechanism())?;
    let plan = if flags.scene.strict { plan.strictly() } else { plan };
    Ok(if flags.to_flip { plan.ending_at_flips() } else { plan })
}

/// `sweep-start.bar1.phi-taylor-1e-9`.
fn folder_name(plan: &Sweep) -> String {
    let names: Vec<String> = plan.variables().iter().map(|variable| variable.path.replace(['[', ']'], "_")).collect();
    let mut names = names.join("-");
    names.truncate(LONGEST);
    format!("sweep-{names}-{}", plan.plan().folder(plan.mechanism()))
}

/// Writes points as they come.
struct Writer {
    table: SweepTable<Stream>,
    progress: Points,
    #[cfg(feature = "charts")]
    curve: Option<Curve>,
}

impl Observer for Writer {
    fn see(&mut self, point: &Point) -> std::io::Result<()> {
        #[cfg(feature = "charts")]
        if let Some(curve) = &mut self.curve {
            curve.see(point);
        }
        Ok(self.table.write(point)?)
    }

    fn finished(&mut self, points: u64) -> std::io::Result<()> {
        self.progress.see(points);
        Ok(())
    }
}

/// The chart, where there can be one; a column that was asked for must be there.
#[cfg(feature = "charts")]
fn curve(plan: &Sweep, flags: &SweepFlags) -> Result<Option<Curve>, Failure> {
    if flags.no_charts {
        return Ok(None);
    }
    match Curve::new(plan, flags.map.as_deref()) {
        Ok(curve) => Ok(Some(curve)),
        Err(reason) if flags.map.is_some() => Err(Failure::new(Exit::Usage, format!("--map: {reason}"))),
        Err(reason) => {
            flags.scene.remark(&format!("no chart: {reason}"));
            Ok(None)
        }
    }
}

#[cfg(feature = "charts")]
fn draw(plan: &Sweep, curve: &Curve, folder: &mut Folder, flags: &SweepFlags) -> Result<(), Failure> {
    let name = if plan.grid().axes().len() == 2 { "map.png" } else { "profile.png" };
    match curve.draw(plan)? {
        Ok(content) => {
            folder.write(name, &content)?;
            flags.scene.remark(&format!("drew {}", folder.path().join(name).display()));
        }
        Err(reason @ NoChart::Nothing(_)) if !flags.scene.quiet => super::output::message(&format!("no chart: {reason}")),
        Err(_) => {}
    }
    Ok(())
}

/// Prints the totals.
fn tell(plan: &Sweep, totals: &Totals, folder: &Folder, flags: &SweepFlags) -> Result<(), Failure> {
    if flags.scene.json {
        let mut object = report::sweep::object(plan, totals);
        object["folder"] = json!(folder.path().display().to_string());
        object["files"] = json!(folder.files().iter().map(|file| file.display().to_string()).collect::<Vec<_>>());
        return print_object(&object);
    }
    if flags.scene.quiet {
        return Ok(());
    }
    print(&(report::sweep::text(plan, totals) + &report::result::files(folder.path(), folder.names())))
}
