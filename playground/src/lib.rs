//! The core behind a few plain functions over shared memory: what the script of the playground calls.
//!
//! Text goes in through [`room`] and comes out through [`text`]; numbers come out through [`numbers`].  There
//! is one scene at a time.

use driftless::report::geometry::geometry;
use driftless::run::Sampler;
use driftless::{Limits, Mechanism, Plan, Request, Run, Running, Sample, Scene, parse_scene};
use serde_json::json;
use std::cell::{Cell, RefCell};
use std::sync::Arc;

/// The time up to which a scene is integrated while somebody looks \[s\].
const HORIZON: f64 = 3600.0;
/// Output interval, that of a screen \[s\].
const EVERY: f64 = 1.0 / 64.0;

/// A scene that moves.
pub struct Playground {
    mechanism: Arc<Mechanism>,
    /// None once it is over.
    running: Option<Running>,
    sample: Sample,
}

impl Playground {
    /// Reads a scene.
    ///
    /// # Errors
    /// The message of the reader, of the compiler or of the plan.
    pub fn new(text: &str) -> Result<(Self, Scene), String> {
        let scene = parse_scene(text, "scene", &[]).map_err(|error| error.to_string())?;
        let mechanism = Arc::new(Mechanism::new(&scene).map_err(|error| error.to_string())?);
        let request = Request { until: Some(HORIZON), every: Some(EVERY), ..Request::default() };
        let plan = Plan::new(&scene, &mechanism, &request).map_err(|error| error.to_string())?;
        let start = mechanism.start(&scene);
        let run = Run::new(Arc::clone(&mechanism), plan, Limits::default(), &start)
            .map_err(|error| error.to_string())?;
        let sample = Sampler::new(Arc::clone(&mechanism)).take(&start).clone();
        Ok((Self { mechanism, running: Some(Running::new(run)), sample }, scene))
    }

    /// Integrates on for so many output times; false where the run is over.
    ///
    /// # Errors
    /// Why it stopped.
    pub fn advance(&mut self, rows: u32) -> Result<bool, String> {
        let Some(running) = &mut self.running else { return Ok(false) };
        let (seen, sample) = (Cell::new(0), &mut self.sample);
        let mut observer = |next: &Sample| {
            sample.clone_from(next);
            seen.set(seen.get() + 1);
            Ok(())
        };
        let is_over =
            running.go(&mut observer, &mut || seen.get() >= rows).map_err(|error| error.to_string())?;
        if !is_over {
            return Ok(true);
        }
        match self.running.take().and_then(|running| running.finish().stop) {
            Some(stop) => Err(stop.to_string()),
            None => Ok(false),
        }
    }

    /// The plan it is integrated by.
    fn plan(&self) -> Option<&Plan> {
        self.running.as_ref().map(Running::plan)
    }

    /// The time reached \[s\].
    pub fn time(&self) -> f64 {
        self.sample.t
    }

    /// Time, energy drift, the largest residual, then angle and centre of each body.
    fn row(&self, numbers: &mut Vec<f64>) {
        numbers.clear();
        let residual = self.sample.constraints.iter().map(|[c, _]| c.abs()).fold(0.0, f64::max);
        numbers.extend([self.sample.t, self.sample.imbalance, residual]);
        for k in 0..self.mechanism.own_bodies().len() {
            numbers.push(self.sample.phi[k]);
            numbers.extend(self.sample.centre[k]);
        }
    }
}

/// What is shared with the script.
#[derive(Default)]
struct Shared {
    text: Vec<u8>,
    numbers: Vec<f64>,
    playground: Option<Playground>,
}

thread_local! {
    static SHARED: RefCell<Shared> = RefCell::default();
}

fn with<T>(act: impl FnOnce(&mut Shared) -> T) -> T {
    SHARED.with_borrow_mut(act)
}

/// Room for so many bytes of text to come.
#[unsafe(no_mangle)]
pub extern "C" fn room(length: usize) -> *mut u8 {
    with(|shared| {
        shared.text = vec![0; length];
        shared.text.as_mut_ptr()
    })
}

/// Reads the scene in the room: 1, and the text is what the page has to know of it; 0, and it is the message.
#[unsafe(no_mangle)]
pub extern "C" fn open() -> u32 {
    with(|shared| {
        let given = String::from_utf8_lossy(&shared.text).into_owned();
        match Playground::new(&given) {
            Ok((playground, scene)) => {
                let told = json!({
                    "scene": scene.name,
                    "description": scene.description,
                    "geometry": geometry(&scene, &playground.mechanism),
                    "method": playground.plan().map(|plan| plan.method.to_string()),
                    "why": playground.plan().and_then(|plan| plan.why.clone()),
                    "notes": playground.plan().map(|plan| plan.notes.clone()),
                });
                shared.text = told.to_string().into_bytes();
                playground.row(&mut shared.numbers);
                shared.playground = Some(playground);
                1
            }
            Err(message) => {
                shared.text = message.into_bytes();
                0
            }
        }
    })
}

/// Integrates on for so many output times: 1, 2 where the run is over, or 0 where there is a message.
#[unsafe(no_mangle)]
pub extern "C" fn advance(rows: u32) -> u32 {
    with(|shared| {
        let Some(playground) = &mut shared.playground else { return 0 };
        match playground.advance(rows) {
            Ok(goes_on) => {
                playground.row(&mut shared.numbers);
                if goes_on { 1 } else { 2 }
            }
            Err(message) => {
                shared.text = message.into_bytes();
                shared.playground = None;
                0
            }
        }
    })
}

/// The JSON Schema of scenes becomes the text.
#[unsafe(no_mangle)]
pub extern "C" fn schema() {
    with(|shared| shared.text = driftless::scene::schema().to_string().into_bytes());
}

/// Where the text begins.
#[unsafe(no_mangle)]
pub extern "C" fn text() -> *const u8 {
    with(|shared| shared.text.as_ptr())
}

/// How many bytes it has.
#[unsafe(no_mangle)]
pub extern "C" fn text_length() -> usize {
    with(|shared| shared.text.len())
}

/// Where the numbers begin: time \[s\], energy drift, largest residual, then angle \[rad\] and centre \[m\] of
/// each body.
#[unsafe(no_mangle)]
pub extern "C" fn numbers() -> *const f64 {
    with(|shared| shared.numbers.as_ptr())
}

/// How many there are.
#[unsafe(no_mangle)]
pub extern "C" fn numbers_length() -> usize {
    with(|shared| shared.numbers.len())
}
