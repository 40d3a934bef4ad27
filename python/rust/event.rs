//! Events written in Python: slow, but located as all others are.

use driftless::run::{Action, Direction, Event};
use driftless::{Configuration, Mechanism, Motion, Site};
use pyo3::exceptions::{PyKeyError, PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// The configuration an event function is asked about.
#[pyclass(frozen, module = "pydriftless._core")]
pub struct Moment {
    names: Arc<Vec<String>>,
    #[pyo3(get)]
    t: f64,
    bodies: Vec<Body>,
}

struct Body {
    angle: f64,
    rate: f64,
    direction: [f64; 2],
    origin: [f64; 2],
    velocity: [f64; 2],
}

impl Moment {
    fn body(&self, name: &str) -> PyResult<&Body> {
        let found = self.names.iter().position(|known| known == name);
        let unknown =
            || PyKeyError::new_err(format!("there is no body {name:?}; there are {}", self.names.join(", ")));
        found.map(|k| &self.bodies[k]).ok_or_else(unknown)
    }

    fn arm(body: &Body, [x, y]: [f64; 2]) -> [f64; 2] {
        let [cos, sin] = body.direction;
        [cos * x - sin * y, sin * x + cos * y]
    }
}

#[pymethods]
impl Moment {
    /// Angle of a body from +x, with its whole turns \[rad\].
    fn phi(&self, body: &str) -> PyResult<f64> {
        Ok(self.body(body)?.angle)
    }

    /// Its rate \[rad/s\].
    fn omega(&self, body: &str) -> PyResult<f64> {
        Ok(self.body(body)?.rate)
    }

    /// Cosine of its angle.
    fn cos(&self, body: &str) -> PyResult<f64> {
        Ok(self.body(body)?.direction[0])
    }

    /// Sine of its angle.
    fn sin(&self, body: &str) -> PyResult<f64> {
        Ok(self.body(body)?.direction[1])
    }

    /// Where a point of a body is, given in its own axes from its origin \[m\].
    #[pyo3(signature = (body, point=[0.0, 0.0]))]
    fn position(&self, body: &str, point: [f64; 2]) -> PyResult<(f64, f64)> {
        let body = self.body(body)?;
        let [x, y] = Self::arm(body, point);
        Ok((body.origin[0] + x, body.origin[1] + y))
    }

    /// Its velocity \[m/s\].
    #[pyo3(signature = (body, point=[0.0, 0.0]))]
    fn velocity(&self, body: &str, point: [f64; 2]) -> PyResult<(f64, f64)> {
        let body = self.body(body)?;
        let [x, y] = Self::arm(body, point);
        Ok((body.velocity[0] - body.rate * y, body.velocity[1] + body.rate * x))
    }
}

/// What Python functions that a run asks have raised.
#[derive(Default)]
pub struct Raised {
    /// What an event function failed with.
    pub error: Option<PyErr>,
    /// Ctrl-C in an event function or a callback, after which the run is as without it.
    pub interrupt: Option<PyErr>,
}

/// The same, as event functions and their run share it.
pub type Failed = Arc<Mutex<Raised>>;

struct PyEvent {
    name: String,
    function: Py<PyAny>,
    direction: Direction,
    stops: bool,
    names: Arc<Vec<String>>,
    sites: Vec<Site>,
    failed: Failed,
}

impl Event for PyEvent {
    fn name(&self) -> &str {
        &self.name
    }

    fn value(&self, at: &Configuration<f64>) -> f64 {
        let body = |(k, site): (usize, &Site)| Body {
            angle: at.angle(k),
            rate: at.rate(k),
            direction: at.direction(k),
            origin: at.position(site),
            velocity: at.velocity(site),
        };
        let moment = Moment {
            names: Arc::clone(&self.names),
            t: at.time(),
            bodies: self.sites.iter().enumerate().map(body).collect(),
        };
        let value = Python::attach(|py| {
            let moment = Py::new(py, moment)?;
            let call = || self.function.bind(py).call1((&moment,))?.extract::<f64>();
            let value = match call() {
                // Ctrl-C while it computed: it is asked once more, so that the run can be gone on with.
                Err(error) if error.is_instance_of::<PyKeyboardInterrupt>(py) => {
                    self.failed.lock().unwrap_or_else(PoisonError::into_inner).interrupt = Some(error);
                    call()?
                }
                other => other?,
            };
            if value.is_nan() {
                let (name, t) = (&self.name, at.time());
                return Err(PyValueError::new_err(format!("the event {name} is not a number at t = {t} s")));
            }
            Ok(value)
        });
        value.unwrap_or_else(|error| {
            // The run ends at its next look.
            self.failed.lock().unwrap_or_else(PoisonError::into_inner).error.get_or_insert(error);
            1.0
        })
    }

    fn direction(&self) -> Direction {
        self.direction
    }

    fn action(&mut self, _: &Configuration<f64>, _: &Motion) -> Action {
        if self.stops { Action::Stop } else { Action::Record }
    }
}

/// Events from what Python says of them: name, function, direction (-1, 0, 1), whether they end the run.
pub fn events(
    given: Vec<(String, Py<PyAny>, i8, bool)>,
    mechanism: &Mechanism,
    failed: &Failed,
) -> Vec<Box<dyn Event>> {
    let names: Arc<Vec<String>> = Arc::new(mechanism.bodies.iter().map(|body| body.name.clone()).collect());
    let sites: Vec<Site> = names.iter().filter_map(|name| mechanism.site(name, [0.0, 0.0]).ok()).collect();
    let event = |(name, function, direction, stops)| {
        let direction = match direction {
            0 => Direction::Either,
            1.. => Direction::Rising,
            _ => Direction::Falling,
        };
        let (names, sites, failed) = (Arc::clone(&names), sites.clone(), Arc::clone(failed));
        Box::new(PyEvent { name, function, direction, stops, names, sites, failed }) as Box<dyn Event>
    };
    given.into_iter().map(event).collect()
}
