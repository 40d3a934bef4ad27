//! A run that is stepped from outside, row by row.

use crate::beside::{LOOK, go_beside, is_windowed};
use crate::errors::refused;
use crate::run::begun;
use crate::scene::Scene;
use driftless::run::Running;
use driftless::run::table::Shown;
use driftless::stepping::interruption;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

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

    /// The next row; a stop before the horizon is an error after the last one.  After Ctrl-C the run can be
    /// asked for its next row again.
    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        let is_windowed =
            py.detach(|| matches!(&*self.lock(), Stepping::Running(running) if is_windowed(running)));
        let (row, stop) = loop {
            let (signal, (row, stop, is_paused)) = if is_windowed {
                go_beside(py, || self.go(&mut interruption::is_asked))
            } else {
                let (begin, mut asked) = (Instant::now(), 0_u32);
                let gone = py.detach(|| {
                    self.go(&mut || {
                        asked += 1;
                        // A look at the clock costs more than a short step.
                        asked.is_multiple_of(16) && begin.elapsed() >= LOOK
                    })
                });
                (py.check_signals().err(), gone)
            };
            match signal {
                Some(error) if is_paused => return Err(error),
                _ if !is_paused => break (row, stop),
                _ => {}
            }
        };
        match stop {
            Some(stop) => Err(refused(py, &stop)),
            None => Ok((!row.is_empty()).then(|| PyArray1::from_vec(py, row))),
        }
    }
}

impl Stepper {
    fn lock(&self) -> MutexGuard<'_, Stepping> {
        self.stepping.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Goes on to the next row, or until it is to pause: the row, why there is none, and whether it paused
    /// before.
    fn go(&self, is_due: &mut dyn FnMut() -> bool) -> (Vec<f64>, Option<String>, bool) {
        let mut lock = self.lock();
        let running = match &mut *lock {
            Stepping::Running(running) => running,
            Stepping::Over(stop) => return (Vec::new(), stop.take(), false),
        };
        let row = std::cell::RefCell::new(Vec::new());
        let mut see = |sample: &driftless::Sample| {
            row.borrow_mut().clear();
            self.shown.append(sample, &mut row.borrow_mut());
            Ok(())
        };
        let gone = running.go(&mut see, &mut || !row.borrow().is_empty() || is_due());
        let row = row.into_inner();
        if matches!(gone, Ok(false)) {
            let is_paused = row.is_empty();
            return (row, None, is_paused);
        }
        let Stepping::Running(running) = std::mem::replace(&mut *lock, Stepping::Over(None)) else {
            return (row, None, false);
        };
        let mut stop = running.finish().stop.map(|stop| stop.to_string());
        if !row.is_empty() {
            // The row comes first; the next call tells why there is no other.
            *lock = Stepping::Over(stop.take());
        }
        (row, stop, false)
    }
}
