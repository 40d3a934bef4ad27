//! Keyword arguments as a request.

use crate::errors::refused;
use driftless::Level;
use driftless::run::{Limits, Request};
use pyo3::exceptions::{PyOverflowError, PyTypeError};
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
        let named = |kind: &str| {
            let given = value.get_type().name().map_or_else(|_| "?".to_owned(), |name| name.to_string());
            PyTypeError::new_err(format!("{name} is {kind}, not of type {given}"))
        };
        let word = || value.extract::<String>().map_err(|_| named("a word"));
        let number = || {
            value.extract::<f64>().map_err(|error| {
                if error.is_instance_of::<PyOverflowError>(py) {
                    return refused(py, &format!("{name} is too large: a number is at most {:e}", f64::MAX));
                }
                named("a number")
            })
        };
        let limit = || match number()? {
            limit if limit >= 0.0 => Ok(limit),
            limit => Err(refused(py, &format!("{name} = {limit}: a limit is a number from 0 up"))),
        };
        let count = || match number()? {
            count if (1.0..=1e18).contains(&count) && count.fract() == 0.0 => Ok(count as u64),
            count => Err(refused(py, &format!("{name} = {count}: it is a whole number from 1 to 1e18"))),
        };
        match name.as_str() {
            "method" => request.method = Some(parsed(py, &name, &word()?)?),
            "stabilize" => request.stabilize = Some(parsed(py, &name, &word()?)?),
            "prefer" => request.prefer = Some(parsed(py, &name, &word()?)?),
            "trust" => *trust = parsed(py, &name, &word()?)?,
            "step" => request.step = Some(number()?),
            "rtol" => request.rtol = Some(number()?),
            "atol" => request.atol = Some(number()?),
            "until" => request.until = Some(number()?),
            "every" => request.every = Some(number()?),
            "time_constant" => request.time_constant = Some(number()?),
            "extended" => request.extended = value.extract().map_err(|_| named("True or False"))?,
            "max_evaluations" => request.max_evaluations = Some(count()?),
            "max_energy_drift" => limits.energy = Some(limit()?),
            "max_constraint_drift" => limits.constraint = Some(limit()?),
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
