//! Exceptions: what the crate refuses, with the place and a hint; and interruption.
//!
//! Their module is the one that people import, by which pickles find them again.

use driftless::dynamics::CompileError;
use driftless::run::{RequestRefusal, RunError, SweepError};
use driftless::scene::SceneError;
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyKeyboardInterrupt};
use pyo3::prelude::*;

create_exception!(pydriftless, DriftlessError, PyException, "Something driftless refused or could not do.");
create_exception!(
    pydriftless,
    SceneRefused,
    DriftlessError,
    "A scene that is none: see line, column, path, hint."
);
create_exception!(
    pydriftless,
    RequestRefused,
    DriftlessError,
    "A request that makes no sense for the scene."
);
create_exception!(
    pydriftless,
    Interrupted,
    PyKeyboardInterrupt,
    "A run that was interrupted; `checkpoint` goes on with it."
);

pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("DriftlessError", py.get_type::<DriftlessError>())?;
    module.add("SceneRefused", py.get_type::<SceneRefused>())?;
    module.add("RequestRefused", py.get_type::<RequestRefused>())?;
    module.add("Interrupted", py.get_type::<Interrupted>())
}

/// The words of an error without its hint, and the hint.
fn parted(text: &str) -> (String, Option<String>) {
    match text.split_once("\nhint: ") {
        Some((message, hint)) => (message.to_owned(), Some(hint.to_owned())),
        None => (text.to_owned(), None),
    }
}

fn with_hint(py: Python<'_>, error: PyErr, hint: Option<String>) -> PyErr {
    match error.value(py).setattr("hint", hint) {
        Ok(()) => error,
        Err(other) => other,
    }
}

/// A request or a run refused, with its hint.
pub fn refused(py: Python<'_>, text: &str) -> PyErr {
    let (message, hint) = parted(text);
    with_hint(py, RequestRefused::new_err(message), hint)
}

/// A scene refused, with its place.
pub fn of_scene(py: Python<'_>, error: &SceneError) -> PyErr {
    let refusal = error.refusal();
    let told = SceneRefused::new_err(error.to_string());
    let value = told.value(py);
    let place = value
        .setattr("line", refusal.line)
        .and_then(|()| value.setattr("column", refusal.column))
        .and_then(|()| value.setattr("path", &refusal.path))
        .and_then(|()| value.setattr("value", refusal.value.clone()))
        .and_then(|()| value.setattr("allowed", &refusal.allowed))
        .and_then(|()| value.setattr("hint", &refusal.hint));
    place.map_or_else(|error| error, |()| told)
}

/// A scene without equations.
pub fn of_equations(py: Python<'_>, error: &CompileError) -> PyErr {
    let (message, hint) = parted(&error.to_string());
    let told = with_hint(py, SceneRefused::new_err(message), hint);
    let value = told.value(py);
    let nothing = ["line", "column", "path", "value", "allowed"];
    let place = nothing.iter().try_for_each(|name| value.setattr(*name, py.None()));
    place.map_or_else(|error| error, |()| told)
}

pub fn of_plan(py: Python<'_>, error: &RequestRefusal) -> PyErr {
    refused(py, &error.to_string())
}

pub fn of_run(py: Python<'_>, error: &RunError) -> PyErr {
    match error {
        RunError::Compile(error) => of_equations(py, error),
        error => refused(py, &error.to_string()),
    }
}

pub fn of_sweep(py: Python<'_>, error: &SweepError) -> PyErr {
    match error {
        SweepError::Scene(error) => of_scene(py, error),
        SweepError::Compile(error) => of_equations(py, error),
        error => refused(py, &error.to_string()),
    }
}
