//! `driftless run --digits` and `--trusted-until`: runs in many digits, and their proof.

use super::failure::{Exit, Failure};
use super::flags::RunFlags;
use super::interrupt::{self, CheckpointTimer};
use super::output::{message, name_files, print, print_object};
use super::progress::RunProgress;
use super::resume::{PendingWork, SavedWork};
use crate::dynamics::Mechanism;
use crate::report::digits::{self as report, DigitsTable};
use crate::run::digits::{
    DigitsPair, DigitsSource, Forecast, LongError, PairProgress, Precision, SavedDigits, ShownRow, exceeded,
    forecast, planned,
};
use crate::run::files::{EVENTS, RECORD, TRAJECTORY};
use crate::run::{Checkpoints, Folder, RequestRefusal, Stream};
use crate::scene::read_text;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::Instant;

/// The trajectory under way.
type TableFile = DigitsTable<Stream>;

/// Files of such a run.
const FILES: &[&str] = &[TRAJECTORY, RECORD, EVENTS];
/// Attempts at a proof; each takes the growth that the one before has met.
const ATTEMPTS: u32 = 6;

/// What a checkpoint holds of a run in many digits.
#[derive(Clone, Serialize, Deserialize)]
pub struct DigitsSnapshot {
    runs: Vec<SavedDigits>,
    next: u64,
    summary: report::Summary,
    attempt: u32,
    forecast: Option<[f64; 2]>,
}

/// A run under way.
struct DigitsTask<'a> {
    flags: &'a RunFlags,
    source: DigitsSource,
    text: &'a str,
    arguments: &'a [String],
    /// How near runs must be; `None` where only one is made.
    within: Option<f64>,
    /// Growth and mean step measured before.
    measured: Option<[f64; 2]>,
    attempt: u32,
}

/// Runs a scene in many digits.
///
/// # Errors
/// The scene is not carried in many digits, files, or a proof that falls short.
pub fn run(flags: &RunFlags, arguments: &[String]) -> Result<(), Failure> {
    refuse_others(flags)?;
    let text = read_text(&flags.scene.scene)?;
    let mut flags = flags.clone();
    flags.scene.read_tables(&text);
    let mut task = DigitsTask::new(&flags, &text, arguments)?;
    if !task.source.scene.outputs.is_empty() && !flags.scene.tell.quiet {
        super::output::message(
            "note: outputs are not written in many digits, whose table has the coordinates alone",
        );
    }
    let precisions = task.first()?;
    let path = flags.out.join(&task.source.scene.name).join(folder_name(&precisions, task.within));
    let pair = DigitsPair::new(&task.source, &precisions)?;
    let folder = Folder::open(&path, flags.force)?;
    let table = task.begin(&folder, &precisions)?;
    task.finish(pair, table, report::Summary::default(), folder, Checkpoints::none(&path))
}

/// Goes on with such a run.
///
/// # Errors
/// As [`run`], or a checkpoint that does not fit.
pub fn resume(
    flags: &RunFlags,
    saved: SavedWork,
    folder: Folder,
    checkpoints: Checkpoints,
) -> Result<(), Failure> {
    interrupt::listen()?;
    let SavedWork { arguments, scene: text, cursor, work, .. } = saved;
    let misfit = || Failure::from(crate::run::ResumeError::Misfit);
    let PendingWork::Digits(snapshot) = work else { return Err(misfit()) };
    let mut task = DigitsTask::new(flags, &text, &arguments)?;
    (task.attempt, task.measured) = (snapshot.attempt, snapshot.forecast);
    let precisions: Vec<Precision> = snapshot.runs.iter().map(SavedDigits::precision).collect();
    let mut pair = DigitsPair::new(&task.source, &precisions)?;
    if !pair.resume(&snapshot.runs, snapshot.next) {
        return Err(misfit());
    }
    let stream = folder.take_up(TRAJECTORY, &cursor)?;
    let table = DigitsTable::going_on(task.layout(&precisions), stream);
    task.finish(pair, table, snapshot.summary, folder, checkpoints)
}

/// Options that mean nothing here.
fn refuse_others(flags: &RunFlags) -> Result<(), Failure> {
    use crate::run::MethodId;
    let plan = &flags.plan;
    let refused = [
        (
            "--method",
            plan.method.is_some_and(|method| method != MethodId::Taylor),
            "only taylor carries many digits",
        ),
        ("--step", plan.step.is_some(), "steps follow from the digits"),
        ("--rtol and --atol", plan.rtol.is_some() || plan.atol.is_some(), "the digits are the tolerance"),
        ("--stabilize", !plan.stabilize.is_empty(), "constraints are always projected in full"),
        ("--extended", plan.extended, "it is for runs in doubles"),
        ("--inputs", flags.inputs, "numbers are taken exactly as written"),
        ("--output", !flags.scene.output.is_empty(), "the table has the coordinates alone"),
        ("--max-evaluations", plan.max_evaluations.is_some(), "Ctrl-C ends a run with a checkpoint"),
    ];
    match refused.iter().find(|(_, is_there, _)| *is_there) {
        Some((what, _, why)) => {
            let text = format!("{what} with --digits or --trusted-until: {why}\nhint: leave it out");
            Err(Failure::new(Exit::Usage, text))
        }
        None => Ok(()),
    }
}

fn folder_name(precisions: &[Precision], within: Option<f64>) -> String {
    match (precisions.first(), within) {
        (Some(precision), None) => format!("taylor-digits-{}", precision.digits),
        _ => "taylor-trusted".to_owned(),
    }
}

impl<'a> DigitsTask<'a> {
    fn new(flags: &'a RunFlags, text: &'a str, arguments: &'a [String]) -> Result<Self, Failure> {
        let (scene, mechanism) = super::compile(&flags.scene, text)?;
        let typed = super::simulate::typed(arguments, &flags.scene.set);
        let template = flags.scene.template(text);
        let until = match flags.digits.trusted_until {
            Some(until) => Some(shortest("--trusted-until", until)?),
            None => flags.plan.until.map(|until| shortest("--until", until)).transpose()?,
        };
        let every = flags.plan.every.map(|every| shortest("--every", every)).transpose()?;
        let source = DigitsSource { template, typed, until, every, scene, mechanism };
        let within = flags.digits.trusted_until.map(|_| flags.digits.within.unwrap_or(1e-3));
        Ok(Self { flags, source, text, arguments, within, measured: None, attempt: 0 })
    }

    fn mechanism(&self) -> &Arc<Mechanism> {
        &self.source.mechanism
    }

    /// The digits to begin with, told before the run begins.
    fn first(&mut self) -> Result<Vec<Precision>, Failure> {
        let has_loops = self.mechanism().has_closed_loops();
        let Some(within) = self.within else {
            let precision = Precision::new(
                self.flags.digits.digits.unwrap_or(*crate::run::digits::DIGITS.start()),
                has_loops,
            );
            return Ok(vec![precision]);
        };
        let found = forecast(&self.source, within, has_loops, &mut interrupt::is_asked)?;
        let found = found.ok_or_else(|| {
            let text = "interrupted while the growth of errors was measured; there is nothing to be kept yet";
            Failure::new(Exit::Interrupted, text)
        })?;
        self.measured = Some([found.growth, found.mean]);
        self.tell(&found);
        Ok(vec![found.run, found.companion])
    }

    /// Says what is to come.
    fn tell(&self, forecast: &Forecast) {
        if !self.flags.scene.tell.quiet {
            message(&report::forecast(forecast, self.flags.digits.trusted_until.unwrap_or_default()));
        }
    }

    fn layout(&self, precisions: &[Precision]) -> report::RowLayout {
        let carried = precisions.first().map_or(0, |precision| precision.digits);
        report::RowLayout::new(
            self.mechanism(),
            self.flags.digits.show_digits.map(usize::from),
            carried,
            self.within.is_some(),
        )
    }

    fn begin(&self, folder: &Folder, precisions: &[Precision]) -> Result<TableFile, Failure> {
        let stream = folder.begin(TRAJECTORY)?;
        DigitsTable::new(self.layout(precisions), stream)
            .map_err(|error| folder.failed(TRAJECTORY, error).into())
    }

    /// Takes a run to its end, and begins again with more digits where a proof falls short.
    fn finish(
        mut self,
        mut pair: DigitsPair,
        mut table: TableFile,
        mut summary: report::Summary,
        mut folder: Folder,
        mut checkpoints: Checkpoints,
    ) -> Result<(), Failure> {
        let begin = Instant::now();
        loop {
            let ended = self.integrate(&mut pair, &mut table, &mut summary, &folder, &mut checkpoints);
            let short = ended.map_err(|failure| {
                let is_left = checkpoints.has_any() && failure.exit != Exit::Interrupted;
                if is_left { failure.with_checkpoint(folder.path()) } else { failure }
            })?;
            if !short || self.attempt + 1 >= ATTEMPTS {
                break;
            }
            self.attempt += 1;
            let precisions = self.again(&pair, &summary)?;
            // The table begins anew, where the old one was: its rows get as many digits as the others.
            drop(table);
            table = self.begin(&folder, &precisions)?;
            summary = report::Summary::default();
            pair = DigitsPair::new(&self.source, &precisions)?;
            if checkpoints.has_any() {
                // The one there is speaks of the old table.
                self.save(&pair, &mut table, &summary, &folder, &mut checkpoints)?;
            }
        }
        summary.wall_s = begin.elapsed().as_secs_f64();
        self.publish(&pair, table, summary, &mut folder, checkpoints)
    }

    /// The digits of the next attempt, from the growth this one has met.
    fn again(&mut self, pair: &DigitsPair, summary: &report::Summary) -> Result<Vec<Precision>, Failure> {
        let (Some(within), Some([growth, mean])) = (self.within, self.measured) else {
            return Ok(Vec::new());
        };
        let runs = pair.runs();
        let digits = runs.first().map_or(0, |run| run.precision().digits) as f64;
        let reached = summary.t.max(1e-300);
        let until = runs.first().map_or(reached, |run| run.last_time());
        let lost = (digits - summary.agreement.unwrap_or(0.0)).max(0.0) * (until / reached).clamp(1.0, 10.0);
        let growth = lost.max(1.15 * growth + 4.0);
        self.measured = Some([growth, mean]);
        let has_loops = self.mechanism().has_closed_loops();
        let found = planned(&self.source, growth, within, has_loops, mean)?;
        if !self.flags.scene.tell.quiet {
            message(&format!(
                "the runs part at t = {reached:.6} s: begun again from the start with more digits, since no \
                    later state is known well enough"
            ));
        }
        self.tell(&found);
        Ok(vec![found.run, found.companion])
    }

    /// True where the runs part before the horizon.
    fn integrate(
        &self,
        pair: &mut DigitsPair,
        table: &mut TableFile,
        summary: &mut report::Summary,
        folder: &Folder,
        checkpoints: &mut Checkpoints,
    ) -> Result<bool, Failure> {
        let every = self.flags.checkpoints.checkpoint_every;
        if every > 0.0 && !checkpoints.has_any() {
            self.save(pair, table, summary, folder, checkpoints)?;
        }
        let mut timer = CheckpointTimer::new(every);
        let until = pair.runs().first().map_or(0.0, |run| run.last_time());
        let mut progress = RunProgress::new(&self.source.scene.name, until, self.flags.scene.tell.quiet);
        let ended = self.rows(pair, table, summary, |pair, table, summary| {
            progress.see(summary.t);
            if !timer.wants() {
                return Ok(());
            }
            self.save(pair, table, summary, folder, checkpoints)?;
            timer.written();
            if interrupt::is_asked() {
                let at = format!("t = {:.6} s of {until} s", summary.t);
                return Err(Failure::interrupted(&at, folder.path()));
            }
            Ok(())
        });
        progress.finish();
        ended.map_err(|error| match error {
            EarlyEnd::Failure(failure) => failure,
            EarlyEnd::Table(error) => folder.failed(TRAJECTORY, error).into(),
        })
    }

    /// From row to row; `between` is called after every few of them.
    fn rows(
        &self,
        pair: &mut DigitsPair,
        table: &mut TableFile,
        summary: &mut report::Summary,
        mut between: impl FnMut(&DigitsPair, &mut TableFile, &report::Summary) -> Result<(), Failure>,
    ) -> Result<bool, EarlyEnd> {
        loop {
            let (rows, stop) = match pair.go(&interrupt::is_asked) {
                Ok(PairProgress::Over) => return Ok(false),
                Ok(PairProgress::Paused) => (Vec::new(), None),
                Ok(PairProgress::Rows(rows)) => (rows, None),
                Err(stop) => (pair.up_to_stop(), Some(stop)),
            };
            for (row, agreement) in rows {
                if self.is_short(&row, agreement, summary) {
                    return Ok(true);
                }
                table.write(&row, agreement).map_err(EarlyEnd::Table)?;
                summary.take(&row, agreement);
                // At the last state a stop of the run itself comes first.
                let is_last = stop.as_ref().is_some_and(|stop| row.time() >= stop.t);
                let limits = self.flags.limits();
                let exceeded = exceeded(&row, self.mechanism(), &limits, summary.largest);
                if let Some(exceeded) = exceeded.filter(|_| !is_last) {
                    summary.stop = Some(exceeded);
                    return Ok(false);
                }
            }
            if let Some(stop) = stop {
                summary.stop = Some(stop);
                return Ok(false);
            }
            between(pair, table, summary).map_err(EarlyEnd::Failure)?;
        }
    }

    /// True where a row is not known as well as asked for.
    fn is_short(&self, row: &ShownRow, agreement: Option<f64>, summary: &mut report::Summary) -> bool {
        let (Some(within), Some(agreement)) = (self.within, agreement) else { return false };
        let is_short = agreement.is_nan() || agreement < -libm::log10(within);
        if is_short {
            summary.parts(row, agreement);
        }
        is_short
    }

    fn save(
        &self,
        pair: &DigitsPair,
        table: &mut TableFile,
        summary: &report::Summary,
        folder: &Folder,
        checkpoints: &mut Checkpoints,
    ) -> Result<(), Failure> {
        let failed = |error| folder.failed(TRAJECTORY, error);
        let (runs, next) = pair.save();
        let snapshot = DigitsSnapshot {
            runs: runs.to_vec(),
            next,
            summary: summary.clone(),
            attempt: self.attempt,
            forecast: self.measured,
        };
        let stream = table.written().map_err(failed)?;
        checkpoints.save(&SavedWork {
            version: env!("CARGO_PKG_VERSION").into(),
            arguments: self.arguments.to_vec(),
            scene: self.text.to_owned(),
            tables: self.flags.scene.tables.to_vec(),
            cursor: stream.cursor().map_err(failed)?,
            work: PendingWork::Digits(Box::new(snapshot)),
        })?;
        stream.outlive();
        Ok(())
    }

    /// Names the table, writes the record, and says what came of it.
    fn publish(
        &self,
        pair: &DigitsPair,
        table: TableFile,
        summary: report::Summary,
        folder: &mut Folder,
        mut checkpoints: Checkpoints,
    ) -> Result<(), Failure> {
        let layout = table.layout().clone();
        let stream = table.finish().map_err(|error| folder.failed(TRAJECTORY, error))?;
        if self.flags.force {
            folder.clear(&FILES[1..])?;
        }
        let hash = folder.keep(stream)?;
        let events = pair.events();
        let shown = report::DigitsReport {
            source: &self.source,
            pair,
            layout: &layout,
            summary: &summary,
            within: self.within,
            events: &events,
        };
        if crate::report::events::has_any(self.mechanism()) {
            folder.write(EVENTS, report::events(&shown).as_bytes())?;
        }
        folder.write(RECORD, format!("{:#}\n", report::record(&shown, &hash)).as_bytes())?;
        checkpoints.remove()?;
        let parted = summary.parted.map(|t| {
            let text = format!(
                "the path is known up to t = {:.6} s, not up to {} s: the runs part at t = {t:.6} s\nhint: \
                    --within a larger distance, or an earlier time",
                summary.t,
                self.flags.digits.trusted_until.unwrap_or_default()
            );
            Failure::new(Exit::Stopped, text)
        });
        let failure = summary.stop.clone().map(Failure::from).or(parted);
        if self.flags.scene.tell.json {
            let mut object = report::object(&shown);
            name_files(&mut object, folder);
            if let Some(failure) = &failure {
                object["error"] = failure.object();
            }
            print_object(&object)?;
        } else if !self.flags.scene.tell.quiet {
            print(&(report::text(&shown) + &crate::report::result::files(folder.path(), folder.names())))?;
        }
        failure.map_or(Ok(()), |failure| Err(failure.told()))
    }
}

/// Why a run ended early.
enum EarlyEnd {
    Failure(Failure),
    Table(std::io::Error),
}

/// A number of seconds of the command line as its shortest decimal.
fn shortest(option: &str, value: f64) -> Result<String, Failure> {
    if value.is_finite() && value > 0.0 {
        return Ok(format!("{value:?}"));
    }
    let text = format!("{option}: {value} s is no time\nhint: a number of seconds above 0");
    Err(Failure::new(Exit::Usage, text))
}

impl From<LongError> for Failure {
    fn from(error: LongError) -> Self {
        match error {
            LongError::Scene(error) => error.into(),
            LongError::Refused(refusal) => RequestRefusal::into(refusal),
            LongError::Step(stop) => stop.into(),
        }
    }
}
