//! What went wrong, for people on stderr, for scripts as exit code and, with `--json`, as `{"error": …}` on
//! stdout.

use super::output::print_object;
use crate::arithmetic::shown::{about, figure};
use crate::dynamics::CompileError;
use crate::dynamics::assembly::StartChange;
use crate::run::files::quoted;
use crate::run::{CheckpointError, FileError, RequestRefusal, ResumeError, RunError, SweepError};
use crate::scene::SceneError;
use crate::stepping::{Cause, StepError};
use serde_json::{Value, json};
use std::path::Path;
use std::process::ExitCode;

/// Exit codes; 0 is success.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// None of the below.
    Other = 1,
    /// The command line makes no sense, whatever the scene.
    Usage = 2,
    /// The scene is invalid, or does not go with what was asked of it.
    Scene = 3,
    /// The integration stopped before its horizon.
    Stopped = 4,
    /// A drift limit was exceeded, stated or not.
    Drift = 5,
    /// A file could not be read or written.
    Io = 6,
    /// Ctrl-C or SIGTERM came; a checkpoint has been written.
    Interrupted = 130,
}

impl Exit {
    /// One word, in the JSON object of an error.
    pub fn kind(self) -> &'static str {
        match self {
            Self::Other => "other",
            Self::Usage => "usage",
            Self::Scene => "scene",
            Self::Stopped => "stopped",
            Self::Drift => "drift",
            Self::Io => "io",
            Self::Interrupted => "interrupted",
        }
    }
}

/// Why a command was not done.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// The exit code.
    pub exit: Exit,
    /// What to say.
    pub message: String,
    /// What else scripts may want to know.
    details: Value,
    /// True where stdout has its object already, or cannot take one.
    told: bool,
}

impl Failure {
    /// A failure with nothing but a message.
    pub fn new(exit: Exit, message: impl Into<String>) -> Self {
        Self { exit, message: message.into(), details: Value::Null, told: false }
    }

    /// A run or sweep that was asked to end, at a place it calls `reached`; its checkpoint is in `folder`.
    pub(super) fn interrupted(reached: &str, folder: &Path) -> Self {
        let resume = format!("driftless resume {}", quoted(folder));
        let message =
            format!("interrupted at {reached}; everything up to there is kept\nhint: `{resume}` goes on");
        let details = json!({"folder": folder.display().to_string(), "resume": resume});
        Self { details, ..Self::new(Exit::Interrupted, message) }
    }

    /// The same with a hint at the checkpoint that is left.
    pub(super) fn with_checkpoint(mut self, folder: &Path) -> Self {
        self.message +=
            &format!("\nhint: `driftless resume {}` goes on from the last checkpoint", quoted(folder));
        self
    }

    /// A start that is not as given, where `--strict` asks for that.
    pub(super) fn changed(changes: &[StartChange]) -> Self {
        let list: Vec<String> = changes.iter().map(StartChange::to_string).collect();
        let message = format!(
            "--strict: {}\nhint: give the values used, or leave out what the constraints tell",
            list.join("; ")
        );
        Self { details: json!({ "changes": changes }), ..Self::new(Exit::Scene, message) }
    }

    /// The same, where stdout needs no object of it.
    pub(super) fn told(mut self) -> Self {
        self.told = true;
        self
    }

    /// `{"kind", "exit_code", "message", "details"}`.
    pub fn object(&self) -> Value {
        json!({"kind": self.exit.kind(), "exit_code": self.exit as u8, "message": self.message,
            "details": self.details})
    }

    /// Says it and chooses the exit code.
    pub fn tell(&self, json: bool) -> ExitCode {
        if json && !self.told {
            // The failure that is being told weighs more than one in telling it.
            let _ = print_object(&json!({ "error": self.object() }));
        }
        let word = if self.exit == Exit::Interrupted { "" } else { "error: " };
        super::output::message(&format!("{word}{}", self.message));
        ExitCode::from(self.exit as u8)
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        let exit = if error.is_io() { Exit::Io } else { Exit::Scene };
        Self { details: json!(error.refusal()), ..Self::new(exit, error.to_string()) }
    }
}

impl From<CompileError> for Failure {
    fn from(error: CompileError) -> Self {
        Self::new(Exit::Scene, error.to_string())
    }
}

impl From<RequestRefusal> for Failure {
    fn from(refusal: RequestRefusal) -> Self {
        let exit = if refusal.is_usage { Exit::Usage } else { Exit::Scene };
        let details =
            json!({"what": refusal.what, "reason": refusal.reason, "alternative": refusal.alternative});
        Self { details, ..Self::new(exit, refusal.to_string()) }
    }
}

impl From<StepError> for Failure {
    fn from(error: StepError) -> Self {
        let exit = match error.cause {
            Cause::DriftLimit => Exit::Drift,
            // What shows itself on the way has not kept the run from beginning.
            Cause::Unsuited if error.t <= 0.0 => Exit::Scene,
            _ => Exit::Stopped,
        };
        let StepError { method, t, step, what, hint, .. } = &error;
        let step = if *step > 0.0 { format!(" (step {} s)", about(*step)) } else { String::new() };
        let message = format!("{method} stopped at t = {} s{step}: {what}\nhint: {hint}", figure(*t));
        Self { details: json!(error), ..Self::new(exit, message) }
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Self {
        Self::new(Exit::Io, error.to_string())
    }
}

impl From<CheckpointError> for Failure {
    fn from(error: CheckpointError) -> Self {
        let exit = if matches!(error, CheckpointError::Format { .. }) { Exit::Scene } else { Exit::Io };
        let hint = match error {
            CheckpointError::Damaged { .. } => "\nhint: begin again with the first command and --force",
            _ => "",
        };
        Self::new(exit, format!("{error}{hint}"))
    }
}

impl From<ResumeError> for Failure {
    fn from(error: ResumeError) -> Self {
        match error {
            ResumeError::Misfit | ResumeError::OtherEvents(_) => Self::new(Exit::Scene, error.to_string()),
            ResumeError::Step(stop) => stop.into(),
        }
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Compile(error) => error.into(),
            RunError::Refused(refusal) => refusal.into(),
            RunError::Step(error) => error.into(),
            RunError::Observer(error) => Self::new(Exit::Io, error.to_string()),
        }
    }
}

impl From<SweepError> for Failure {
    fn from(error: SweepError) -> Self {
        match error {
            SweepError::Scene(error) => error.into(),
            SweepError::Compile(error) => error.into(),
            SweepError::Refused(refusal) => refusal.into(),
            SweepError::Threads(error) => {
                Self::new(Exit::Other, format!("cannot start the threads: {error}\nhint: --threads 1"))
            }
            SweepError::Observer(error) => Self::new(Exit::Io, error.to_string()),
        }
    }
}

#[cfg(feature = "charts")]
impl From<crate::chart::ChartError> for Failure {
    fn from(error: crate::chart::ChartError) -> Self {
        use crate::chart::ChartError;
        let exit = match error {
            ChartError::Folder { .. } | ChartError::Write { .. } => Exit::Io,
            ChartError::Format { .. } => Exit::Usage,
            _ => Exit::Other,
        };
        Self::new(exit, error.to_string())
    }
}
