//! A run that is stepped from outside, row by row.

use crate::errors::refused;
use crate::run::begun;
use crate::scene::Scene;
use driftless::run::Running;
use driftless::run::table::Shown;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Mutex, PoisonError};

/// An iterator over the rows of a run, integrated as they are asked for.
#[pyclass(frozen, module = "pydriftless._core")]
pub struct Stepper {
    shown: Shown,
    stepping: Mutex<Stepping>,
}

/// A run under way, or why it stopped where that has not been told yet.
enum Stepping {
    Running(Box<Running>),
    Over(Option<String>),
}

/// Begins a run that is stepped from outside.
#[pyfunction]
#[pyo3(signature = (scene, **options))]
pub fn stream(
    py: Python<'_>,
    scene: &Bound<'_, Scene>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Stepper> {
    let options = options.cloned().unwrap_or_else(|| PyDict::new(py));
    let running = begun(py, scene.get(), &options, Vec::new())?;
    Ok(Stepper {
        shown: Shown::new(&scene.get().mechanism),
        stepping: Mutex::new(Stepping::Running(Box::new(running))),
    })
}

#[pymethods]
impl Stepper {
    fn __iter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    /// The next row; a stop before the horizon is an error after the last one.
    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        let (row, stop) = py.detach(|| {
            let mut lock = self.stepping.lock().unwrap_or_else(PoisonError::into_inner);
            let running = match &mut *lock {
                Stepping::Running(running) => running,
                Stepping::Over(stop) => return (Vec::new(), stop.take()),
            };
            let row = std::cell::RefCell::new(Vec::new());
            let mut see = |sample: &driftless::Sample| {
                row.borrow_mut().clear();
                self.shown.append(sample, &mut row.borrow_mut());
                Ok(())
            };
            let gone = running.go(&mut see, &mut || !row.borrow().is_empty());
            let row = row.into_inner();
            if matches!(gone, Ok(false)) {
                return (row, None);
            }
            let Stepping::Running(running) = std::mem::replace(&mut *lock, Stepping::Over(None)) else {
                return (row, None);
            };
            let mut stop = running.finish().stop.map(|stop| stop.to_string());
            if !row.is_empty() {
                // The row comes first; the next call tells why there is no other.
                *lock = Stepping::Over(stop.take());
            }
            (row, stop)
        });
        py.check_signals()?;
        match stop {
            Some(stop) => Err(refused(py, &stop)),
            None => Ok((!row.is_empty()).then(|| PyArray1::from_vec(py, row))),
        }
    }
}
