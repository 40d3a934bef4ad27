//! A run: the loop around a method, and what watches it.
//!
//! [`plan`] decides, [`mod@march`] builds the marcher and goes from one output time to the next, [`contact`] through impacts and contacts that
//! last, [`sample`] reads off what there is to
//! know at each, [`drift`] and [`trace`] keep bounded records of it, [`table`] writes it down,
//! [`files`] keeps whole files only.

pub mod contact;
pub mod drift;
#[cfg(feature = "files")]
pub mod files;
pub mod march;
pub mod methods;
pub mod plan;
pub mod sample;
#[cfg(feature = "files")]
pub mod table;
pub mod trace;

pub use contact::{Hold, Strike};
pub use drift::{Drift, Limits};
#[cfg(feature = "files")]
pub use files::{FileError, Folder, Stream};
pub use march::{Outcome, Run, RunError, march, simulate};
pub use methods::{METHODS, MethodId, MethodInfo, Stabilization};
pub use plan::{Plan, Refusal, Request};
pub use sample::{Sample, Sampler};
pub use trace::Trace;
