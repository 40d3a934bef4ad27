//! `driftless run`: integrate, and keep what came of it.

#[cfg(feature = "charts")]
mod pictures;
#[cfg(not(feature = "charts"))]
#[path = "simulate/pictureless.rs"]
mod pictures;

use self::pictures::{Pages, check, draw, overlay};
use super::failure::{Exit, Failure};
use super::flags::RunFlags;
use super::interrupt::{self, CheckpointTimer};
use super::output::{name_files, print, print_objects};
use super::progress::RunProgress;
use super::resume::{PendingWork, SavedWork};
use crate::arithmetic::shown::figure;
use crate::dynamics::Mechanism;
use crate::report;
use crate::run::async_writer::AsyncWriter;
use crate::run::files::{EVENTS, RECORD, TRAJECTORY};
use crate::run::table::Table;
use crate::run::trust::Level;
use crate::run::{
    Checkpoints, Folder, Outcome, Plan, Request, ResumeError, Run, RunError, Running, Sample, Stream,
    wall_clock,
};
use crate::scene::{Override, Scene, read_text};
use crate::stepping::Cause;
use std::sync::Arc;
use std::time::Instant;

/// Every file a run may leave; those of an earlier run in the same folder go with it.
const FILES: &[&str] = &[
    TRAJECTORY,
    RECORD,
    EVENTS,
    "mechanism.png",
    "angles.png",
    "energy_drift.png",
    "constraint_drift.png",
    "torque_power.png",
    "outputs.png",
    "columns.png",
    "mechanism.gif",
    "run.html",
];

/// A run that has ended.
struct Done {
    outcome: Outcome,
    folder: Folder,
    failure: Option<Failure>,
}

/// The overrides as they were typed, with all their digits; none where the command line does not show them.
pub(super) fn typed(arguments: &[String], set: &[Override]) -> Vec<String> {
    let mut found = Vec::new();
    let mut arguments = arguments.iter();
    while let Some(argument) = arguments.next() {
        match argument.strip_prefix("--set") {
            Some("") => found.extend(arguments.next().cloned()),
            Some(value) => found.extend(value.strip_prefix('=').map(str::to_owned)),
            None => {}
        }
    }
    let is_same = |(typed, set): (&String, &Override)| typed.parse::<Override>().as_ref() == Ok(set);
    if found.len() == set.len() && found.iter().zip(set).all(is_same) { found } else { Vec::new() }
}

/// What is run, and what was said on the command line.
struct SimulateTask<'a> {
    scene: &'a Scene,
    mechanism: &'a Arc<Mechanism>,
    flags: &'a RunFlags,
    /// The scene's text and the command line, for checkpoints.
    text: &'a str,
    arguments: &'a [String],
}

/// Runs a scene, once for each stabilization given.
///
/// # Errors
/// The scene, a plan, a folder, the method or a limit; files of what was reached are kept.
pub fn run(flags: &RunFlags, arguments: &[String]) -> Result<(), Failure> {
    interrupt::listen()?;
    #[cfg(feature = "digits")]
    if flags.digits.is_asked() {
        return super::digits::run(flags, arguments);
    }
    if flags.inputs && flags.trust == Level::Off {
        let text = "--inputs with --trust off: effects are told up to the horizon, which is not estimated \
            then\nhint: leave --trust out";
        return Err(Failure::new(Exit::Usage, text));
    }
    let text = read_text(&flags.scene.scene)?;
    let mut flags = flags.clone();
    flags.scene.read_tables(&text);
    let flags = &flags;
    let (scene, mechanism) = super::compile(&flags.scene, &text)?;
    check(&mechanism, flags)?;
    // All plans stand before the first run: a pairing that is refused costs nothing.
    let requests = flags.plan.requests();
    let mut plans: Vec<Plan> =
        requests.iter().map(|request| Plan::new(&scene, &mechanism, request)).collect::<Result<_, _>>()?;
    let notes = super::stays(&flags.scene, &text, &scene);
    plans.iter_mut().for_each(|plan| plan.notes.extend(notes.iter().cloned()));
    let folders = folders(&requests, &plans, &mechanism);
    let task = SimulateTask { scene: &scene, mechanism: &mechanism, flags, text: &text, arguments };
    let mut done = Vec::new();
    for (plan, folder) in plans.into_iter().zip(&folders) {
        done.push(task.run(plan, folder)?);
    }
    overlay(&scene, &mechanism, &done, flags)?;
    conclude(&scene, &mechanism, done, flags)
}

/// Goes on with a run, to a later horizon where one is given \[s\].
///
/// # Errors
/// As [`run`], or a checkpoint that does not fit.
pub fn resume(
    flags: &RunFlags,
    saved: SavedWork,
    until: Option<f64>,
    folder: Folder,
    checkpoints: Checkpoints,
) -> Result<(), Failure> {
    interrupt::listen()?;
    let SavedWork { arguments, scene: text, cursor, work, .. } = saved;
    let PendingWork::Run(mut snapshot) = work else { return Err(ResumeError::Misfit.into()) };
    let (scene, mechanism) = super::compile(&flags.scene, &text)?;
    if let Some(until) = until
        && !snapshot.extend(until)
    {
        let step = snapshot
            .plan()
            .step
            .map_or(String::new(), |step| format!(", by a whole number of steps of {step} s"));
        let text = format!(
            "--until: {until} s cannot be the horizon of this run\nhint: one beyond {} s{step}",
            snapshot.plan().until
        );
        return Err(Failure::new(Exit::Usage, text));
    }
    flags.scene.remark(&format!(
        "{}; from t = {} s on",
        report::setting(snapshot.plan()),
        figure(snapshot.time())
    ));
    let running =
        Running::resume(Arc::clone(&mechanism), &mechanism.start(&scene), *snapshot)?.timed(wall_clock);
    let table = Table::going_on(&mechanism, folder.take_up(TRAJECTORY, &cursor)?);
    let task =
        SimulateTask { scene: &scene, mechanism: &mechanism, flags, text: &text, arguments: &arguments };
    let done = vec![task.finish(running, AsyncWriter::new(table), Pages::default(), folder, checkpoints)?];
    conclude(&scene, &mechanism, done, flags)
}

/// A folder for each plan: its usual one, with the stabilization asked for where several of one command would
/// share it, as they do where there is nothing to stabilize.
fn folders(requests: &[Request], plans: &[Plan], mechanism: &Mechanism) -> Vec<String> {
    let usual: Vec<String> = plans.iter().map(|plan| plan.folder(mechanism)).collect();
    let is_shared = |name: &String| usual.iter().filter(|other| *other == name).count() > 1;
    let name = |(request, usual): (&Request, &String)| match request.stabilize {
        Some(asked) if is_shared(usual) => format!("{usual}-{asked}"),
        _ => usual.clone(),
    };
    requests.iter().zip(&usual).map(name).collect()
}

/// Says what came of it all.
fn conclude(scene: &Scene, mechanism: &Mechanism, done: Vec<Done>, flags: &RunFlags) -> Result<(), Failure> {
    tell(scene, mechanism, &done, flags)?;
    done.into_iter().find_map(|done| done.failure).map_or(Ok(()), |failure| Err(failure.told()))
}

impl SimulateTask<'_> {
    /// Runs one plan in a folder of its own.
    fn run(&self, plan: Plan, folder: &str) -> Result<Done, Failure> {
        let Self { scene, mechanism, flags, .. } = *self;
        let start = mechanism.start(scene);
        let run = Run::new(Arc::clone(mechanism), plan, flags.limits(), &start)?.trusted(flags.trust, &start);
        let plan = run.plan();
        let window = self.window(plan)?;
        flags.scene.remark(&format!(
            "{}; {}",
            report::setting(plan),
            plan.why.as_deref().unwrap_or("as asked for")
        ));
        for note in &plan.notes {
            flags.scene.remark(note);
        }
        let path = flags.out.join(&scene.name).join(folder);
        let folder = Folder::open(&path, flags.force)?;
        let page = self.page(plan);
        let table = Table::new(mechanism, folder.begin(TRAJECTORY)?)
            .map_err(|error| folder.failed(TRAJECTORY, error.into()))?;
        self.finish(
            Running::new(run.timed(wall_clock)).windowed(window),
            AsyncWriter::new(table),
            page,
            folder,
            Checkpoints::none(&path),
        )
    }

    /// Takes a run to its end.
    fn finish(
        &self,
        mut running: Running,
        mut writer: AsyncWriter<Stream>,
        mut page: Pages,
        mut folder: Folder,
        mut checkpoints: Checkpoints,
    ) -> Result<Done, Failure> {
        let integrated = self.integrate(&mut running, &mut writer, &mut page, &folder, &mut checkpoints);
        let done = integrated.and_then(|()| {
            let outcome = self.publish(self.with_inputs(running.finish())?, writer, &mut folder)?;
            page.write(self, &mut folder)?;
            Ok(outcome)
        });
        let outcome = done.map_err(|failure| {
            let is_left = checkpoints.has_any() && failure.exit != Exit::Interrupted;
            if is_left { failure.with_checkpoint(folder.path()) } else { failure }
        })?;
        // A run that has used up its evaluations goes on where `resume` allows more.
        if outcome.stop.as_ref().is_none_or(|stop| stop.cause != Cause::EffortExhausted) {
            checkpoints.remove()?;
        }
        let failure = outcome.stop.clone().map(Failure::from);
        Ok(Done { outcome, folder, failure })
    }

    /// Integrates, writes the trajectory as it comes, and a checkpoint before the first step and now and
    /// then.
    fn integrate(
        &self,
        running: &mut Running,
        writer: &mut AsyncWriter<Stream>,
        page: &mut Pages,
        folder: &Folder,
        checkpoints: &mut Checkpoints,
    ) -> Result<(), Failure> {
        let every = self.flags.checkpoints.checkpoint_every;
        if every > 0.0 && !checkpoints.has_any() {
            self.save(running, writer, folder, checkpoints)?;
        }
        let mut checkpoint_timer = CheckpointTimer::new(every);
        let mut progress =
            RunProgress::new(&self.scene.name, running.plan().until, self.flags.scene.tell.quiet);
        loop {
            let mut observer = |sample: &Sample| {
                page.see(writer.write(sample)?);
                progress.see(sample.t);
                Ok(())
            };
            let is_over = running.go(&mut observer, &mut || checkpoint_timer.wants());
            let is_over = is_over.map_err(|error| match error {
                RunError::Observer(error) => Failure::from(folder.failed(TRAJECTORY, error)),
                error => error.into(),
            });
            match is_over {
                Ok(false) => {}
                ended => {
                    progress.finish();
                    return ended.map(drop);
                }
            }
            self.save(running, writer, folder, checkpoints).inspect_err(|_| progress.finish())?;
            checkpoint_timer.written();
            if interrupt::is_asked() {
                progress.finish();
                return Err(Failure::interrupted(
                    &format!("t = {} s of {} s", figure(running.reached()), figure(running.plan().until)),
                    folder.path(),
                ));
            }
        }
    }

    fn save(
        &self,
        running: &Running,
        writer: &mut AsyncWriter<Stream>,
        folder: &Folder,
        checkpoints: &mut Checkpoints,
    ) -> Result<(), Failure> {
        let failed = |error| folder.failed(TRAJECTORY, error);
        let stream = writer.table().and_then(Table::written).map_err(failed)?;
        checkpoints.save(&SavedWork {
            version: env!("CARGO_PKG_VERSION").into(),
            arguments: self.arguments.to_vec(),
            scene: self.text.to_owned(),
            tables: self.flags.scene.tables.to_vec(),
            cursor: stream.cursor().map_err(failed)?,
            work: PendingWork::Run(Box::new(running.snapshot())),
        })?;
        stream.outlive();
        Ok(())
    }

    /// Adds what the digits of the scene's numbers come to, where that is asked for.
    fn with_inputs(&self, mut outcome: Outcome) -> Result<Outcome, Failure> {
        let flags = &self.flags.scene;
        if let Some(trust) = outcome.trust.take_if(|_| self.flags.inputs) {
            let template = flags.template(self.text);
            flags.remark("running neighbouring scenes, for what the digits of the numbers come to");
            let begin = Instant::now();
            let found = trust.with_inputs(
                &template,
                &typed(self.arguments, &flags.set),
                &outcome.plan,
                &mut interrupt::is_asked,
            )?;
            outcome.trust_wall += begin.elapsed();
            outcome.trust = Some(found);
        }
        Ok(outcome)
    }

    /// Gives the trajectory its name, draws, and writes the record.
    fn publish(
        &self,
        outcome: Outcome,
        writer: AsyncWriter<Stream>,
        folder: &mut Folder,
    ) -> Result<Outcome, Failure> {
        let Self { scene, mechanism, flags, .. } = *self;
        let stream = writer.finish().map_err(|error| folder.failed(TRAJECTORY, error))?;
        if flags.force {
            // Nothing of an older run may stand beside the new trajectory.
            folder.clear(&FILES[1..])?;
        }
        let hash = folder.keep(stream)?;
        flags.scene.remark(&format!("wrote {}", folder.path().join(TRAJECTORY).display()));
        if report::events::has_any(mechanism) {
            folder.write(EVENTS, report::events::table(mechanism, &outcome).as_bytes())?;
        }
        draw(scene, mechanism, &outcome, folder, flags)?;
        let mut record = report::result::record(scene, mechanism, &outcome, &hash);
        record["given"] = flags.scene.given();
        let text = format!("{record:#}\n");
        folder.write(RECORD, text.as_bytes())?;
        Ok(outcome)
    }
}

/// Prints the results.
fn tell(scene: &Scene, mechanism: &Mechanism, done: &[Done], flags: &RunFlags) -> Result<(), Failure> {
    if flags.scene.tell.json {
        let object = |Done { outcome, folder, failure }: &Done| {
            let mut object = report::result::object(scene, mechanism, outcome);
            name_files(&mut object, folder);
            if let Some(failure) = failure {
                object["error"] = failure.object();
            }
            object
        };
        return print_objects(done.iter().map(object).collect());
    }
    if flags.scene.tell.quiet {
        return Ok(());
    }
    let page = |Done { outcome, folder, .. }: &Done| {
        report::result::text(scene, mechanism, outcome)
            + &report::result::files(folder.path(), folder.names())
    };
    print(&done.iter().map(page).collect::<Vec<_>>().join("\n"))
}
