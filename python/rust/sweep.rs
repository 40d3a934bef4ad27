//! Sweeps: a row of numbers a point.

use crate::errors::{of_sweep, refused};
use crate::request::asked;
use crate::scene::Scene;
use driftless::Level;
use driftless::run::sweep::table::{SweepLayout, columns, numbers};
use driftless::run::{PointObserver, Shard, Status, Sweep, SweepPoint, Totals, Vary, sweep_on};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::io;

/// What a sweep of a scene came to: names of the columns, the numbers, of each point the bar that turned over
/// first (-1: none) and its status (0 done, 1 stopped, 2 refused, 3 skipped), causes by point, the report,
/// the names of the bars, and the number of the first point.
type Swept<'py> = (
    Vec<String>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<u8>>,
    Vec<(u64, String)>,
    String,
    Vec<String>,
    u64,
);

/// Gathers points, tells how far it is, and looks for Ctrl-C.
struct Gather {
    layout: SweepLayout,
    first: Option<u64>,
    numbers: Vec<f64>,
    flips: Vec<i32>,
    status: Vec<u8>,
    causes: Vec<(u64, String)>,
    progress: Option<Py<PyAny>>,
    failed: Option<PyErr>,
}

impl PointObserver for Gather {
    fn see(&mut self, point: &SweepPoint) -> io::Result<()> {
        self.first.get_or_insert(point.index);
        self.numbers.extend(numbers(point, self.layout));
        self.flips.push(point.flip.map_or(-1, |flip| flip.bar as i32));
        let (status, cause) = match &point.status {
            Status::Done => (0, None),
            Status::Stopped(cause) => (1, Some(cause.to_string())),
            Status::Refused(cause) => (2, Some(cause.to_string())),
            Status::Skipped => (3, None),
        };
        self.status.push(status);
        self.causes.extend(cause.map(|cause| (point.index, cause)));
        Ok(())
    }

    fn finished(&mut self, points: u64, _: &Totals) -> io::Result<()> {
        let told = Python::attach(|py| {
            py.check_signals()?;
            self.progress.as_ref().map_or(Ok(()), |progress| progress.call1(py, (points,)).map(drop))
        });
        told.map_err(|error| {
            self.failed = Some(error);
            io::ErrorKind::Interrupted.into()
        })
    }
}

/// Integrates a grid or list of points, or one part of it.
#[pyfunction]
#[pyo3(signature = (scene, vary, points, to_flip, threads, shard, progress, **options))]
#[allow(clippy::too_many_arguments, reason = "keywords of one Python function")]
pub fn sweep<'py>(
    py: Python<'py>,
    scene: &Bound<'py, Scene>,
    vary: Vec<(String, f64, f64, u64)>,
    points: Option<(Vec<String>, PyReadonlyArray2<'py, f64>)>,
    to_flip: bool,
    threads: usize,
    shard: Option<(u64, u64)>,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Swept<'py>> {
    let options = options.cloned().unwrap_or_else(|| PyDict::new(py));
    let asked = asked(py, &options, Level::Off)?;
    let shard = match shard {
        Some((number, of)) => Some(
            Shard::new(number, of)
                .ok_or_else(|| refused(py, &format!("there is no part {number} of {of}")))?,
        ),
        None => None,
    };
    let template = &scene.get().template;
    let plan = match points {
        Some((names, points)) => {
            let values = points.as_array().iter().copied().collect();
            Sweep::listed(template, &names, values, &asked.request)
        }
        None => {
            let vary = vary.into_iter().map(|(name, from, to, count)| Vary { name, from, to, count });
            Sweep::new(template, vary.collect(), &asked.request)
        }
    };
    let plan = plan
        .map_err(|error| of_sweep(py, &error))?
        .with_limits(asked.limits)
        .trusted(asked.trust)
        .sharded(shard);
    let plan = if to_flip { plan.ending_at_flips() } else { plan };
    let mut gather = Gather {
        layout: SweepLayout::of(&plan),
        first: None,
        numbers: Vec::new(),
        flips: Vec::new(),
        status: Vec::new(),
        causes: Vec::new(),
        progress,
        failed: None,
    };
    let swept = py.detach(|| sweep_on(&plan, threads, Totals::default(), &mut gather));
    if let Some(error) = gather.failed {
        return Err(error);
    }
    let totals = swept.map_err(|error| of_sweep(py, &error))?;
    let report = driftless::report::sweep::object(&plan, &totals).to_string();
    let mut columns = columns(&plan);
    // The bar that turned over, status and cause are words.
    columns.truncate(columns.len() - 3);
    let count = gather.status.len();
    let bars = plan.mechanism().own_bodies().iter().map(|body| body.name.clone()).collect();
    Ok((
        columns.clone(),
        PyArray1::from_vec(py, gather.numbers).reshape([count, columns.len()])?,
        PyArray1::from_vec(py, gather.flips),
        PyArray1::from_vec(py, gather.status),
        gather.causes,
        report,
        bars,
        gather.first.unwrap_or(0),
    ))
}
