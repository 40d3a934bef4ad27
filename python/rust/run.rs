//! Runs: integrated without the global lock, looked at now and then for Ctrl-C.

use crate::beside::{LOOK, go_beside, is_windowed};
use crate::errors::{Interrupted, of_plan, of_run, refused};
use crate::event::{Failed, Raised, events};
use crate::request::asked;
use crate::scene::Scene;
use driftless::report::charts::{Chart, draw, motion};
use driftless::report::result::record;
use driftless::run::checkpoint::{opened, sealed};
use driftless::run::table::Shown;
use driftless::run::{
    Event, Limits, Observer, Plan, Recorder, Run, Running, Sample, Snapshot, Step, wall_clock,
};
use driftless::stepping::interruption;
use driftless::{Level, Outcome, Trajectory, chart};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Arc, PoisonError};
use std::time::Instant;

/// A run that has ended, as the crate has it.
#[pyclass(frozen, module = "pydriftless._core")]
pub struct Raw {
    scene: Py<Scene>,
    outcome: Outcome,
    rows: Py<PyArray2<f64>>,
    trajectory: Option<Trajectory>,
}

/// What an interrupted run goes on from.
#[derive(Serialize, Deserialize)]
struct Saved {
    version: String,
    scene: (String, String, Vec<String>, Vec<String>),
    snapshot: Box<Snapshot>,
    numbers: Vec<f64>,
}

/// Gathers rows, and calls back.
struct Watch<'a> {
    shown: Shown,
    numbers: Vec<f64>,
    recorder: Option<Recorder>,
    callback: Option<&'a Py<PyAny>>,
    /// Where it is enough \[s\].
    end: f64,
    failed: Option<PyErr>,
    /// Where Ctrl-C in the callback is noted.
    raised: Failed,
}

/// An event as Python describes it: name, function, direction, whether it ends the run.
type Described = (String, Py<PyAny>, i8, bool);

impl Observer for Watch<'_> {
    fn wants_steps(&self) -> bool {
        self.recorder.is_some()
    }

    fn step(&mut self, step: &mut Step) -> ControlFlow<()> {
        self.recorder.as_mut().map_or(ControlFlow::Continue(()), |recorder| recorder.step(step))
    }

    fn sample(&mut self, sample: &Sample) -> ControlFlow<()> {
        let before = self.numbers.len();
        self.shown.append(sample, &mut self.numbers);
        if sample.t >= self.end {
            return ControlFlow::Break(());
        }
        let Some(callback) = self.callback else { return ControlFlow::Continue(()) };
        let row = &self.numbers[before..];
        let told = Python::attach(|py| {
            let answer = callback.bind(py).call1((sample.t, PyArray1::from_slice(py, row)))?;
            // Only False ends it, numpy's as well.
            let kind = answer.get_type().name()?;
            PyResult::Ok(!(kind == "bool" || kind == "bool_") || answer.is_truthy()?)
        });
        match told {
            Ok(true) => ControlFlow::Continue(()),
            Ok(false) => ControlFlow::Break(()),
            Err(error) if Python::attach(|py| error.is_instance_of::<PyKeyboardInterrupt>(py)) => {
                // Its row is there: the run pauses at its next look, and can be gone on with.
                self.raised.lock().unwrap_or_else(PoisonError::into_inner).interrupt = Some(error);
                ControlFlow::Continue(())
            }
            Err(error) => {
                self.failed = Some(error);
                ControlFlow::Break(())
            }
        }
    }
}

/// Integrates a scene to its horizon.
#[pyfunction]
#[pyo3(signature = (scene, callback, dense, described, **options))]
pub fn run(
    py: Python<'_>,
    scene: Py<Scene>,
    callback: Option<Py<PyAny>>,
    dense: bool,
    described: Vec<Described>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Raw> {
    let options = options.cloned().unwrap_or_else(|| PyDict::new(py));
    let failed = Failed::default();
    let events = events(described, &scene.get().mechanism, &failed);
    let running = begun(py, scene.get(), &options, events)?;
    carry(py, scene, running, Vec::new(), callback.as_ref(), dense.then_some(f64::INFINITY), &failed)
}

/// Plans a run and begins it.
pub fn begun(
    py: Python<'_>,
    scene: &Scene,
    options: &Bound<'_, PyDict>,
    events: Vec<Box<dyn Event>>,
) -> PyResult<Running> {
    let asked = asked(py, options, Level::Auto)?;
    let mechanism = &scene.mechanism;
    let begun = py.detach(|| {
        let plan = Plan::new(&scene.scene, mechanism, &asked.request).map_err(Refused::Plan)?;
        let start = mechanism.start(&scene.scene);
        let run = Run::new(Arc::clone(mechanism), plan, asked.limits, &start)
            .map_err(|e| Refused::Run(e.into()))?;
        Ok(Running::new(run.trusted(asked.trust, &start).with_events(events).timed(wall_clock)))
    });
    begun.map_err(|error| match error {
        Refused::Plan(error) => of_plan(py, &error),
        Refused::Run(error) => of_run(py, &error),
    })
}

enum Refused {
    Plan(driftless::run::RequestRefusal),
    Run(driftless::run::RunError),
}

/// Goes on with an interrupted run.
#[pyfunction]
#[pyo3(signature = (checkpoint, callback=None, described=Vec::new()))]
pub fn resume(
    py: Python<'_>,
    checkpoint: &[u8],
    callback: Option<Py<PyAny>>,
    described: Vec<Described>,
) -> PyResult<Raw> {
    let failed = |error: String| refused(py, &error);
    let saved: Saved =
        opened(checkpoint, Path::new("the checkpoint")).map_err(|error| failed(error.to_string()))?;
    if saved.version != env!("CARGO_PKG_VERSION") {
        return Err(failed(format!("the checkpoint was written by pydriftless {}", saved.version)));
    }
    let (text, source, set, outputs) = saved.scene;
    let scene = Scene::new(py, text, source, set, outputs)?;
    let (mechanism, start) = (Arc::clone(&scene.mechanism), scene.mechanism.start(&scene.scene));
    let running = Running::resume(mechanism, &start, *saved.snapshot)
        .map_err(|error| failed(error.to_string()))?
        .timed(wall_clock);
    let failure = Failed::default();
    let running = if described.is_empty() {
        running
    } else {
        let events = events(described, &scene.mechanism, &failure);
        running.with_events(events).map_err(|error| failed(error.to_string()))?
    };
    carry(py, Py::new(py, scene)?, running, saved.numbers, callback.as_ref(), None, &failure)
}

/// Takes a run to its end; where its motion is kept, at most to a time.
fn carry(
    py: Python<'_>,
    scene: Py<Scene>,
    mut running: Running,
    numbers: Vec<f64>,
    callback: Option<&Py<PyAny>>,
    dense: Option<f64>,
    failed: &Failed,
) -> PyResult<Raw> {
    let shown = Shown::new(&scene.get().mechanism);
    let (recorder, end) = (dense.map(|_| Recorder::default()), dense.unwrap_or(f64::INFINITY));
    let raised = Failed::clone(failed);
    let mut watch = Watch { shown, numbers, recorder, callback, end, failed: None, raised };
    let is_windowed = is_windowed(&running);
    loop {
        let looked = if is_windowed {
            let is_due = &mut || interruption::is_asked() || has_failed(failed);
            match go_beside(py, || running.go_observed(&mut watch, is_due)) {
                (Some(error), false) => Err(error),
                (_, is_over) => Ok(is_over),
            }
        } else {
            let is_over = py.detach(|| {
                let (mut begin, mut asked) = (Instant::now(), 0_u32);
                running.go_observed(&mut watch, &mut || {
                    asked += 1;
                    // A look at the clock costs more than a short step.
                    let is_due = asked.is_multiple_of(16) && (begin.elapsed() >= LOOK || has_failed(failed));
                    if is_due {
                        begin = Instant::now();
                    }
                    is_due
                })
            });
            if is_over { Ok(true) } else { py.check_signals().map(|()| false) }
        };
        let Raised { error, interrupt } =
            std::mem::take(&mut *failed.lock().unwrap_or_else(PoisonError::into_inner));
        if let Some(error) = watch.failed.take().or(error) {
            return Err(error);
        }
        match interrupt.map_or(looked, Err) {
            Ok(true) => break,
            Ok(false) => {}
            Err(error) => return Err(interrupted(py, &scene, &running, watch.numbers, error)),
        }
    }
    let Watch { numbers, recorder, .. } = watch;
    let outcome = running.finish();
    let width = scene.get().columns().len();
    let rows = PyArray1::from_vec(py, numbers);
    let rows = rows.reshape([rows.len()? / width, width])?.unbind();
    let (outcome, trajectory) = match recorder {
        Some(recorder) => {
            let trajectory = recorder.into_trajectory(outcome);
            (trajectory.outcome.clone(), Some(trajectory))
        }
        None => (outcome, None),
    };
    Ok(Raw { scene, outcome, rows, trajectory })
}

fn has_failed(failed: &Failed) -> bool {
    let raised = failed.lock().unwrap_or_else(PoisonError::into_inner);
    raised.error.is_some() || raised.interrupt.is_some()
}

/// The interruption with what the run goes on from.
fn interrupted(
    py: Python<'_>,
    scene: &Py<Scene>,
    running: &Running,
    numbers: Vec<f64>,
    error: PyErr,
) -> PyErr {
    let saved = Saved {
        version: env!("CARGO_PKG_VERSION").into(),
        scene: scene.get().parts(),
        snapshot: Box::new(running.snapshot()),
        numbers,
    };
    let Ok(bytes) = sealed(&saved) else { return error };
    let told = Interrupted::new_err(format!(
        "interrupted at t = {} s of {} s",
        running.time(),
        running.plan().until
    ));
    match told.value(py).setattr("checkpoint", PyBytes::new(py, &bytes)) {
        Ok(()) => told,
        Err(other) => other,
    }
}

impl Raw {
    /// Numbers of the coordinates of bodies: those after them that carry integrals are neither angles nor
    /// positions.
    fn kept(&self) -> Vec<usize> {
        let mechanism = &self.scene.get().mechanism;
        (0..mechanism.coordinates()).filter(|&k| !mechanism.is_integral(k)).collect()
    }
}

#[pymethods]
impl Raw {
    /// The rows of the trajectory: one block, in the order of its columns.
    #[getter]
    fn rows(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
        self.rows.clone_ref(py)
    }

    #[getter]
    fn scene(&self, py: Python<'_>) -> Py<Scene> {
        self.scene.clone_ref(py)
    }

    /// Why it stopped before its horizon.
    #[getter]
    fn stop(&self) -> Option<String> {
        self.outcome.stop.as_ref().map(ToString::to_string)
    }

    /// What ended it at will: an event, or `observer`.
    #[getter]
    fn ended_by(&self) -> Option<String> {
        self.outcome.ended_by.clone()
    }

    /// Where it ended \[s\].
    #[getter]
    fn end(&self) -> f64 {
        self.outcome.last.t
    }

    /// The same run by the same plan once more, with the motion between its rows.
    fn again(&self, py: Python<'_>, described: Vec<Described>) -> PyResult<Raw> {
        let mechanism = &self.scene.get().mechanism;
        let failed = Failed::default();
        let events = events(described, mechanism, &failed);
        let start = mechanism.start(&self.scene.get().scene);
        // It was within its limits up to its end.
        let limits = Limits { energy: Some(f64::INFINITY), constraint: Some(f64::INFINITY) };
        let run = Run::new(Arc::clone(mechanism), self.outcome.plan.clone(), limits, &start);
        let run = run.map_err(|error| of_run(py, &error.into()))?;
        let running = Running::new(run.with_events(events).timed(wall_clock));
        carry(py, self.scene.clone_ref(py), running, Vec::new(), None, Some(self.outcome.last.t), &failed)
    }

    /// What `run.json` holds, but for the table's hash.
    fn report(&self) -> String {
        let scene = self.scene.get();
        record(&scene.scene, &scene.mechanism, &self.outcome, "").to_string()
    }

    /// Angles and positions, then rates, at times within the run: a row each.
    fn at<'py>(&self, py: Python<'py>, times: PyReadonlyArray1<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let Some(trajectory) = &self.trajectory else {
            return Err(PyValueError::new_err("the run was made without dense=True"));
        };
        let (mut numbers, kept) = (Vec::new(), self.kept());
        let times = times.as_array();
        for &t in times {
            let Some((phi, omega)) = trajectory.at(t) else {
                let end = self.outcome.last.t;
                return Err(PyValueError::new_err(format!(
                    "t = {t} s lies outside of the run, 0 to {end} s"
                )));
            };
            numbers.extend(kept.iter().map(|&k| phi[k]).chain(kept.iter().map(|&k| omega[k])));
        }
        let width = numbers.len() / times.len().max(1);
        PyArray1::from_vec(py, numbers).reshape([times.len(), width])
    }

    /// Events in their order.
    fn events<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let (names, kept) = (self.coordinates(), self.kept());
        let dict = |record: &driftless::EventRecord| {
            let dict = PyDict::new(py);
            dict.set_item("name", &record.name)?;
            dict.set_item("t", record.t)?;
            for (key, values) in [("phi", &record.phi), ("omega", &record.omega)] {
                let of = PyDict::new(py);
                for (name, &k) in names.iter().zip(&kept) {
                    of.set_item(name, values[k])?;
                }
                dict.set_item(key, of)?;
            }
            PyResult::Ok(dict)
        };
        self.outcome.events.iter().map(dict).collect()
    }

    /// Names of what [`Raw::at`] tells angles or positions of: `phi of bar` is `bar`, `x of ball` is `ball.x`.
    fn coordinates(&self) -> Vec<String> {
        let mechanism = &self.scene.get().mechanism;
        let name = |k| {
            let name = mechanism.coordinate_name(k);
            match name.split_once(" of ") {
                Some(("phi", body)) => body.to_owned(),
                Some((kind, body)) => format!("{body}.{kind}"),
                None => name,
            }
        };
        self.kept().into_iter().map(name).collect()
    }

    /// Names of the charts the run has.
    fn charts(&self) -> Vec<&'static str> {
        let scene = self.scene.get();
        let wanted = driftless::report::charts::wanted(&scene.mechanism, &self.outcome);
        wanted.into_iter().map(Chart::name).collect()
    }

    /// A chart as a file: `png`, `svg` or `pdf`; the motion as `gif` or `apng`.
    fn chart<'py>(&self, py: Python<'py>, name: &str, format: &str) -> PyResult<Bound<'py, PyBytes>> {
        let scene = self.scene.get();
        let failed = |error: chart::ChartError| refused(py, &error.to_string());
        let bytes = match format {
            "gif" | "apng" if name == Chart::Mechanism.name() => {
                let motion = motion(&scene.scene, &scene.mechanism, &self.outcome);
                let animation =
                    if format == "gif" { chart::motion_gif(&motion) } else { chart::motion_apng(&motion) };
                animation.map_err(failed)?.bytes
            }
            _ => {
                let chart = Chart::ALL.into_iter().find(|chart| chart.name() == name);
                let kind = chart::Format::ALL.into_iter().find(|kind| kind.extension() == format);
                let (Some(chart), Some(kind)) = (chart, kind) else {
                    let there = self.charts().join(", ");
                    let kinds: Vec<_> = chart::Format::ALL.into_iter().map(|kind| kind.extension()).collect();
                    return Err(PyValueError::new_err(format!(
                        "there is no chart `{name}` as `{format}`; there are {there}, as {}, and the mechanism \
                        in motion as gif or apng",
                        kinds.join(", ")
                    )));
                };
                let drawn = draw(chart, &scene.scene, &scene.mechanism, &self.outcome);
                drawn.and_then(|picture| picture.bytes(kind)).map_err(failed)?
            }
        };
        Ok(PyBytes::new(py, &bytes))
    }
}
