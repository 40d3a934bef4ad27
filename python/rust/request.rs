//! Keyword arguments as a request.

use crate::errors::refused;
use driftless::Level;
use driftless::run::{Limits, Request};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// What was asked for beside the method's settings.
pub struct Asked {
    pub request: Request,
    pub limits: Limits,
    pub trust: Level,
}

/// Reads keyword arguments; `trust` is what is spent where nothing is said.
pub fn asked(py: Python<'_>, options: &Bound<'_, PyDict>, trust: Level) -> PyResult<Asked> {
    let mut asked = Asked { request: Request::default(), limits: Limits::default(), trust };
    let Asked { request, limits, trust } = &mut asked;
    for (name, value) in options {
        let name: String = name.extract()?;
        if value.is_none() {
            continue;
        }
        let word = || -> PyResult<String> { value.extract() };
        match name.as_str() {
            "method" => request.method = Some(parsed(py, &name, &word()?)?),
            "stabilize" => request.stabilize = Some(parsed(py, &name, &word()?)?),
            "prefer" => request.prefer = Some(parsed(py, &name, &word()?)?),
            "trust" => *trust = parsed(py, &name, &word()?)?,
            "step" => request.step = Some(value.extract()?),
            "rtol" => request.rtol = Some(value.extract()?),
            "atol" => request.atol = Some(value.extract()?),
            "until" => request.until = Some(value.extract()?),
            "every" => request.every = Some(value.extract()?),
            "time_constant" => request.time_constant = Some(value.extract()?),
            "extended" => request.extended = value.extract()?,
            "max_evaluations" => request.max_evaluations = Some(value.extract::<f64>()? as u64),
            "max_energy_drift" => limits.energy = Some(value.extract()?),
            "max_constraint_drift" => limits.constraint = Some(value.extract()?),
            _ => return Err(PyTypeError::new_err(format!("there is no option `{name}`"))),
        }
    }
    Ok(asked)
}

fn parsed<T: std::str::FromStr>(py: Python<'_>, name: &str, word: &str) -> PyResult<T>
where
    T::Err: std::fmt::Display,
{
    word.parse().map_err(|error: T::Err| refused(py, &format!("{name} = {word:?}: {error}")))
}
