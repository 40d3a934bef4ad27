//! `driftless sweep`: integrate a grid of points, and keep a row of each.

use super::failure::{Exit, Failure};
use super::flags::SweepFlags;
use super::interrupt::{self, CheckpointTimer};
use super::output::{name_files, print, print_object};
use super::progress::SweepProgress;
use super::resume::{PendingWork, SavedWork};
use crate::report;
use crate::report::page::counted;
#[cfg(feature = "charts")]
use crate::report::sweep::{NoChart, SweepChart};
use crate::run::checkpoint::sealed;
use crate::run::files::{PART, SWEEP, SWEEP_RECORD};
use crate::run::{
    Checkpoints, Folder, Limits, PointObserver, Request, ResumeError, Stream, Sweep, SweepError, SweepPoint,
    SweepTable, Totals, sweep_on,
};
use crate::scene::{points_that_stay, read_text};
use serde::{Deserialize, Serialize};

/// Every file a sweep may leave; those of an earlier one in the same folder go with it.
pub const FILES: &[&str] = &[SWEEP, SWEEP_RECORD, PART, "map.png", "profile.png", "sweep.html"];
/// Longest name of a folder that is made of what is varied.
const LONGEST: usize = 120;

/// Runs a scene over a grid.
///
/// # Errors
/// The scene, what is varied, the plan or the folder; points that fail are rows of the table.
pub fn run(flags: &SweepFlags, arguments: &[String]) -> Result<(), Failure> {
    interrupt::listen()?;
    let text = read_text(&flags.scene.scene)?;
    let mut flags = flags.clone();
    flags.scene.read_tables(&text);
    let flags = &flags;
    let plan = prepared(flags, &text)?;
    for (axis, variable) in plan.grid().axes().iter().zip(plan.variables()) {
        flags.scene.remark(&format!(
            "vary {} from {} to {} {}, {}",
            variable.path,
            axis.from,
            axis.to,
            variable.unit,
            counted(axis.count, "value", "values")
        ));
    }
    flags.scene.remark(&format!(
        "{}; {}",
        report::setting(plan.plan()),
        plan.plan().why.as_deref().unwrap_or("as asked for")
    ));
    #[cfg(feature = "charts")]
    let curve = curve(&plan, flags)?;
    let whole = flags.out.join(&plan.scene().name).join(folder_name(&plan));
    let path = plan.shard().map_or(whole.clone(), |shard| whole.join(shard.folder()));
    let folder = Folder::open(&path, flags.force)?;
    let table =
        SweepTable::new(&plan, folder.begin(SWEEP)?).map_err(|error| folder.failed(SWEEP, error.into()))?;
    let writer = Writer {
        table,
        progress: SweepProgress::new(&plan.scene().name, 0, plan.count(), flags.scene.tell.quiet),
        checkpoint_timer: CheckpointTimer::new(flags.checkpoints.checkpoint_every),
        checkpoints: Checkpoints::none(&path),
        text: &text,
        tables: &flags.scene.tables,
        arguments,
        trouble: None,
        folder,
        #[cfg(feature = "charts")]
        curve,
    };
    finish(&plan, writer, Totals::default(), flags)
}

/// Goes on with a sweep.
///
/// # Errors
/// As [`run`], or a checkpoint that does not fit.
pub fn resume(
    flags: &SweepFlags,
    saved: SavedWork,
    folder: Folder,
    checkpoints: Checkpoints,
) -> Result<(), Failure> {
    interrupt::listen()?;
    let SavedWork { arguments, scene: text, cursor, work, .. } = saved;
    let PendingWork::Sweep(seen, drawn) = work else { return Err(ResumeError::Misfit.into()) };
    let plan = prepared(flags, &text)?;
    if seen.points() > plan.count() {
        return Err(ResumeError::Misfit.into());
    }
    flags.scene.remark(&format!("{}; from point {} on", report::setting(plan.plan()), seen.points()));
    #[cfg(feature = "charts")]
    let curve = match drawn.map(|bytes| postcard::from_bytes::<SweepChart>(&bytes)) {
        Some(Ok(curve)) if curve.fits(&plan, seen.points()) => Some(curve),
        None => None,
        Some(_) => return Err(ResumeError::Misfit.into()),
    };
    #[cfg(not(feature = "charts"))]
    drop(drawn);
    let writer = Writer {
        table: SweepTable::going_on(&plan, folder.take_up(SWEEP, &cursor)?),
        progress: SweepProgress::new(&plan.scene().name, seen.points(), plan.count(), flags.scene.tell.quiet),
        checkpoint_timer: CheckpointTimer::new(flags.checkpoints.checkpoint_every),
        checkpoints,
        text: &text,
        tables: &flags.scene.tables,
        arguments: &arguments,
        trouble: None,
        folder,
        #[cfg(feature = "charts")]
        curve,
    };
    finish(&plan, writer, seen, flags)
}

/// Takes a sweep to its end; before its first point there is a checkpoint.
fn finish(plan: &Sweep, mut writer: Writer, seen: Totals, flags: &SweepFlags) -> Result<(), Failure> {
    if flags.checkpoints.checkpoint_every > 0.0 && !writer.checkpoints.has_any() {
        writer.save(&seen)?;
    }
    let totals = sweep_on(plan, flags.threads.map_or(0, usize::from), seen, &mut writer);
    writer.progress.finish();
    let totals = totals.map_err(|error| match (writer.trouble.take(), error) {
        (Some(trouble), _) => trouble,
        (None, SweepError::Observer(error)) => Failure::from(writer.folder.failed(SWEEP, error)),
        (None, error) => error.into(),
    });
    let (has_checkpoint, path) = (writer.checkpoints.has_any(), writer.folder.path().to_owned());
    totals.and_then(|totals| publish(plan, writer, totals, flags)).map_err(|failure| {
        let is_left = has_checkpoint && failure.exit != Exit::Interrupted;
        if is_left { failure.with_checkpoint(&path) } else { failure }
    })
}

/// What joins a part of a sweep to the others.
#[derive(Serialize, Deserialize)]
pub struct SweepPart {
    /// The version that ran it.
    pub version: String,
    /// The command line, and the text of the scene it names.
    pub arguments: Vec<String>,
    pub scene: String,
    /// The files of its tables.
    pub tables: Vec<(String, String)>,
    pub table_sha256: String,
    pub totals: Totals,
    /// The chart of its points.
    pub drawn: Option<Vec<u8>>,
}

/// A whole sweep, or a part of one, but for its table and record.
pub struct Swept<'a> {
    pub plan: &'a Sweep,
    pub totals: Totals,
    #[cfg(feature = "charts")]
    pub curve: Option<SweepChart>,
}

/// Gives the table its name and publishes the rest; of a part, what joins it to the others.
fn publish(plan: &Sweep, writer: Writer, totals: Totals, flags: &SweepFlags) -> Result<(), Failure> {
    let drawn = writer.drawn()?;
    let Writer { table, mut folder, mut checkpoints, text, arguments, .. } = writer;
    let stream = table.finish().map_err(|error| folder.failed(SWEEP, error))?;
    if flags.force {
        // Nothing of an older sweep may stand beside the new table.
        folder.clear(&FILES[1..])?;
    }
    let hash = folder.keep(stream)?;
    if plan.shard().is_some() {
        let part = SweepPart {
            version: env!("CARGO_PKG_VERSION").into(),
            arguments: arguments.to_vec(),
            scene: text.to_owned(),
            tables: flags.scene.tables.to_vec(),
            table_sha256: hash.clone(),
            totals: totals.clone(),
            drawn,
        };
        let bytes = sealed(&part).map_err(|error| folder.failed(PART, error))?;
        folder.write(PART, &bytes)?;
    }
    let swept = Swept {
        plan,
        totals,
        #[cfg(feature = "charts")]
        curve: writer.curve,
    };
    swept.publish(&mut folder, &hash, flags)?;
    checkpoints.remove()?;
    tell(plan, &swept.totals, &folder, flags)
}

impl Swept<'_> {
    /// Draws, and writes the record.
    ///
    /// # Errors
    /// The chart, or the folder.
    pub fn publish(
        &self,
        folder: &mut Folder,
        table_sha256: &str,
        _flags: &SweepFlags,
    ) -> Result<(), Failure> {
        #[cfg(feature = "charts")]
        if let (Some(curve), None) = (&self.curve, self.plan.shard()) {
            if !_flags.charts.no_charts {
                draw(self, curve, folder, _flags)?;
            }
            if _flags.html {
                let page = report::view::swept(self.plan, curve, &self.totals, &_flags.scene.given());
                super::view::keep(folder, "sweep.html", &page, &_flags.scene.tell)?;
            }
        }
        let text = format!("{:#}\n", report::sweep::record(self.plan, &self.totals, table_sha256));
        Ok(folder.write(SWEEP_RECORD, text.as_bytes())?)
    }
}

/// The sweep asked for.
///
/// # Errors
/// The scene, or what is varied.
pub fn prepared(flags: &SweepFlags, text: &str) -> Result<Sweep, Failure> {
    let requests = flags.plan.requests();
    let [request]: &[Request; 1] = requests.as_slice().try_into().map_err(|_| {
        Failure::new(
            Exit::Usage,
            "--stabilize: a sweep keeps its constraints in one way\nhint: name one, or sweep several times",
        )
    })?;
    let template = flags.scene.template(text);
    let outputs = super::with_outputs(template.scene()?, &flags.scene.output)?.outputs;
    let template = template.with_outputs(outputs);
    let limits = Limits { energy: flags.max_energy_drift, constraint: flags.max_constraint_drift };
    let plan = Sweep::new(&template, flags.vary.clone(), request)?
        .with_limits(limits)
        .trusted(flags.trust)
        .sharded(flags.shard);
    super::settle(&flags.scene, plan.mechanism())?;
    let notes: Vec<String> = (plan.variables().iter().zip(plan.grid().axes()))
        .filter_map(|(variable, axis)| {
            points_that_stay(plan.scene(), &variable.path, (axis.count == 1).then_some(axis.from))
        })
        .collect();
    if !flags.scene.tell.quiet {
        notes.iter().for_each(|note| super::output::message(&format!("note: {note}")));
    }
    let plan = notes.into_iter().fold(plan, Sweep::noted);
    let plan = if flags.scene.strict { plan.strictly() } else { plan };
    Ok(if flags.to_flip { plan.ending_at_flips() } else { plan })
}

/// `sweep-start.bar1.phi-taylor-1e-9`.
fn folder_name(plan: &Sweep) -> String {
    let names: Vec<String> =
        plan.variables().iter().map(|variable| variable.path.replace(['[', ']'], "_")).collect();
    let mut names = names.join("-");
    names.truncate(LONGEST);
    format!("sweep-{names}-{}", plan.plan().folder(plan.mechanism()))
}

/// Writes points as they come, and a checkpoint now and then.
struct Writer<'a> {
    table: SweepTable<Stream>,
    progress: SweepProgress,
    checkpoint_timer: CheckpointTimer,
    checkpoints: Checkpoints,
    folder: Folder,
    /// The scene's text and the command line, for checkpoints.
    text: &'a str,
    tables: &'a [(String, String)],
    arguments: &'a [String],
    /// What ended the sweep, where it was no point.
    trouble: Option<Failure>,
    #[cfg(feature = "charts")]
    curve: Option<SweepChart>,
}

impl Writer<'_> {
    /// The chart so far, as bytes.
    fn drawn(&self) -> Result<Option<Vec<u8>>, Failure> {
        #[cfg(feature = "charts")]
        let drawn = self.curve.as_ref().map(postcard::to_stdvec).transpose();
        #[cfg(not(feature = "charts"))]
        let drawn = Ok::<_, postcard::Error>(None);
        drawn.map_err(|error| self.folder.failed(SWEEP, std::io::Error::other(error)).into())
    }

    fn save(&mut self, seen: &Totals) -> Result<(), Failure> {
        let failed = |error| self.folder.failed(SWEEP, error);
        let drawn = self.drawn()?;
        let stream = self.table.written().map_err(failed)?;
        self.checkpoints.save(&SavedWork {
            version: env!("CARGO_PKG_VERSION").into(),
            arguments: self.arguments.to_vec(),
            scene: self.text.to_owned(),
            tables: self.tables.to_vec(),
            cursor: stream.cursor().map_err(failed)?,
            work: PendingWork::Sweep(seen.clone(), drawn),
        })?;
        stream.outlive();
        Ok(())
    }
}

impl PointObserver for Writer<'_> {
    fn see(&mut self, point: &SweepPoint) -> std::io::Result<()> {
        #[cfg(feature = "charts")]
        if let Some(curve) = &mut self.curve {
            curve.see(point);
        }
        Ok(self.table.write(point)?)
    }

    fn finished(&mut self, points: u64, seen: &Totals) -> std::io::Result<()> {
        self.progress.see(points);
        if self.checkpoint_timer.wants() {
            let saved = self.save(seen);
            self.checkpoint_timer.written();
            self.trouble = saved.err();
            if self.trouble.is_none() && interrupt::is_asked() {
                self.trouble = Some(Failure::interrupted(
                    &format!("point {} of the grid", seen.points()),
                    self.folder.path(),
                ));
            }
        }
        if self.trouble.is_some() { Err(std::io::ErrorKind::Interrupted.into()) } else { Ok(()) }
    }
}

/// The chart, where there can be one; a column that was asked for must be there.
#[cfg(feature = "charts")]
fn curve(plan: &Sweep, flags: &SweepFlags) -> Result<Option<SweepChart>, Failure> {
    if flags.charts.no_charts && !flags.html {
        return Ok(None);
    }
    if flags.html {
        report::view::holds(plan)?;
    }
    match SweepChart::new(plan, flags.map.as_deref()) {
        Ok(curve) => Ok(Some(curve)),
        Err(reason) if flags.html && flags.map.is_none() => {
            Err(Failure::new(Exit::Usage, format!("--html: {reason}")))
        }
        Err(reason) if flags.map.is_some() => Err(Failure::new(Exit::Usage, format!("--map: {reason}"))),
        Err(reason) => {
            flags.scene.remark(&format!("no chart: {reason}"));
            Ok(None)
        }
    }
}

#[cfg(feature = "charts")]
fn draw(
    swept: &Swept<'_>,
    curve: &SweepChart,
    folder: &mut Folder,
    flags: &SweepFlags,
) -> Result<(), Failure> {
    let name = if swept.plan.grid().axes().len() == 2 { "map" } else { "profile" };
    match curve.draw(swept.plan, &swept.totals)? {
        Ok(picture) => flags.charts.keep(folder, name, &picture, &flags.scene.tell)?,
        Err(reason @ NoChart::Nothing(_)) if !flags.scene.tell.quiet => {
            super::output::message(&format!("no chart: {reason}"))
        }
        Err(_) => {}
    }
    Ok(())
}

/// Prints the totals.
///
/// # Errors
/// Nobody reads them.
pub fn tell(plan: &Sweep, totals: &Totals, folder: &Folder, flags: &SweepFlags) -> Result<(), Failure> {
    if flags.scene.tell.json {
        let mut object = report::sweep::object(plan, totals);
        name_files(&mut object, folder);
        return print_object(&object);
    }
    if flags.scene.tell.quiet {
        return Ok(());
    }
    print(&(report::sweep::text(plan, totals) + &report::result::files(folder.path(), folder.names())))
}
