//! A run: the loop around a method, and what watches it.
//!
//! [`plan`] decides, with [`choice`] of the method; a [`driver`] of form and method makes the steps;
//! [`contact`] takes it through impacts and contacts that last; [`running`] goes from one output time to the
//! next and can pause; [`sample`] reads off what there is to know at each; [`trust`] estimates the error
//! beside it, [`mod@reference`] is what it is measured against; [`drift`] and [`trace`] keep bounded records
//! of it; [`table`] writes it down, [`files`] keeps whole files only, and [`checkpoint`] what a run needs to
//! go on after whatever ended it.  [`mod@sweep`] runs a grid of starts and parameters and looks for bars that
//! turn over ([`flip`]); [`mod@compare`] runs all methods at all settings, and times them; [`mod@stress`]
//! runs stiff and extreme scenes by every method.

mod allowance;
#[doc(hidden)]
#[cfg(feature = "files")]
pub mod async_writer;
mod build;
mod change;
#[doc(hidden)]
#[cfg(feature = "files")]
pub mod checkpoint;
#[doc(hidden)]
pub mod choice;
#[doc(hidden)]
pub mod clock;
#[doc(hidden)]
mod closing;
#[doc(hidden)]
pub mod compare;
#[doc(hidden)]
pub mod contact;
#[doc(hidden)]
pub mod custom;
#[cfg(feature = "digits")]
pub mod digits;
#[doc(hidden)]
pub mod drift;
#[doc(hidden)]
pub mod driver;
#[doc(hidden)]
pub mod event;
#[doc(hidden)]
pub mod extremes;
#[doc(hidden)]
pub mod fast;
#[doc(hidden)]
#[cfg(feature = "files")]
pub mod files;
#[cfg(feature = "fit")]
pub mod fit;
#[doc(hidden)]
pub mod flip;
#[doc(hidden)]
pub mod friction;
mod halvings;
mod impact_monitor;
pub mod kinematics;
pub mod methods;
pub mod modes;
mod monitor;
#[doc(hidden)]
pub mod observer;
#[doc(hidden)]
pub mod plan;
#[doc(hidden)]
pub mod reference;
mod rounding;
#[doc(hidden)]
pub mod running;
mod saltation;
#[doc(hidden)]
pub mod sample;
#[doc(hidden)]
pub mod sensitivity;
mod spring_guard;
#[doc(hidden)]
pub mod stress;
#[doc(hidden)]
pub mod sweep;
#[doc(hidden)]
#[cfg(feature = "files")]
pub mod table;
#[cfg(feature = "files")]
pub mod table_reader;
#[doc(hidden)]
pub mod trace;
pub(crate) mod trajectory;
#[doc(hidden)]
pub mod trust;
mod turns;
mod wall_guard;

pub use build::Problem;
#[cfg(feature = "files")]
pub use checkpoint::{CheckpointError, Checkpoints, Loaded};
pub use choice::Prefer;
pub use clock::{Clock, wall_clock};
pub use compare::{Asked, Comparison, compare};
pub use contact::{ImpactRecord, PersistentContact};
pub use custom::Custom;
pub use drift::{Drift, Limits};
pub use driver::Pause;
pub use event::{Action, Change, Direction, Event, EventRecord};
pub use extremes::Extremes;
pub use fast::FastMode;
#[cfg(feature = "files")]
pub use files::{FileError, Folder, Stream, StreamPosition};
pub use flip::Flip;
pub use friction::FrictionRecord;
pub use kinematics::{Kinematics, kinematics};
pub use methods::{METHODS, MethodId, MethodInfo, Stabilization};
pub use modes::{Modes, modes};
pub use observer::{Observer, Step};
pub use plan::{Plan, Request, RequestRefusal};
pub use reference::{Reference, reference};
pub use running::{Outcome, ResumeError, Run, RunError, Running, Snapshot, integrate, simulate};
pub use sample::{Sample, Sampler};
pub use sensitivity::{
    Measure, Regime, Sensitivity, SensitivityError, SensitivityRequest, Spectrum, lyapunov, sensitivity,
};
#[cfg(feature = "files")]
pub use sweep::table::SweepTable;
pub use sweep::{
    Grid, PointObserver, Shard, Status, Sweep, SweepError, SweepPoint, Totals, Vary, VaryError, sweep,
    sweep_on,
};
pub use trace::Trace;
pub use trajectory::Recorder;
pub use trajectory::Trajectory;
pub use trust::Trust;
