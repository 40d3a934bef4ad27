//! Sweeps: many runs of one scene over a grid of starts and parameters.
//!
//! Every point is a run of its own, with the same result whichever thread integrates it and whoever its
//! neighbours are, so that what comes out does not depend on the number of threads.  Points are handed out in
//! chunks, of which a bounded number is under way; results are shown in the order of the grid, and memory
//! does not grow with it.  A point that cannot be run, or stops, says so in its own result and ends nothing
//! else.
//!
//! ```
//! use driftless::run::{Request, Sweep, Vary, sweep};
//! use driftless::scene::Template;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let template = Template::read("examples/scenes/free.json".as_ref(), &[])?;
//! let vary: Vec<Vary> = vec!["bar1.phi=1..3:5".parse()?, "bar2.phi=-pi..pi:4".parse()?];
//! let plan = Sweep::new(&template, vary, &Request { until: Some(2.0), ..Request::default() })?;
//! let mut flips = Vec::new();
//! let totals = sweep(&plan, 2, &mut |point: &driftless::run::SweepPoint| {
//!     flips.extend(point.flip);
//!     Ok(())
//! })?;
//! assert_eq!((totals.done, totals.flipped), (20, flips.len() as u64));
//! # Ok(())
//! # }
//! ```

mod ensemble;
mod execute;
mod grid;
mod judge;
mod lane;
mod point;
mod shard;
#[cfg(feature = "files")]
pub mod table;
#[cfg(feature = "threads")]
mod threads;
mod totals;
mod watching;

pub use execute::{PointObserver, sweep, sweep_on};
pub use grid::{Grid, Vary, VaryError};
pub use judge::PointTrust;
pub use point::{Status, SweepPoint};
pub use shard::Shard;
pub use totals::Totals;

use super::drift::Limits;
use super::methods::{MethodId, Stabilization};
use super::plan::{MAX_ROWS, Plan, Request, RequestRefusal};
use super::trust::Level;
use crate::arithmetic::eight::LANES;
use crate::dynamics::{CompileError, Mechanism};
use crate::scene::{Scene, SceneError, Template, Variable};
use crate::stepping::taylor::batch::Batch;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Times at which drift is looked at where no output interval was asked for.
const LOOKS: f64 = 8.0;
/// Most points of a chunk.
const CHUNK: u64 = 64;

/// Judges the values of a point.
type Judge = dyn Fn(&[f64]) -> bool + Send + Sync;

/// A sweep about to begin.
pub struct Sweep {
    template: Template,
    scene: Scene,
    mechanism: Arc<Mechanism>,
    request: Request,
    /// True where the method was chosen here.
    is_chosen: bool,
    plan: Plan,
    grid: Grid,
    variables: Vec<Variable>,
    limits: Limits,
    skips: Option<Box<Judge>>,
    ends_at_flips: bool,
    is_strict: bool,
    trust: Level,
    shard: Option<Shard>,
    /// The points asked for, where these are not all of the grid or part.
    within: Option<Range<u64>>,
    stop: Option<Arc<AtomicBool>>,
    /// True where only starts are varied in which nothing else has a say: all points share one mechanism.
    shares: bool,
    /// True where points of one structure are integrated beside each other: fewer with numbers of their own
    /// are faster one by one.
    is_many: bool,
}

/// Why a sweep cannot begin, or did not come to its end.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// The scene as it stands is none, or has no such value.
    #[error("{0}")]
    Scene(#[from] SceneError),
    /// The scene has no equations.
    #[error("{0}")]
    Compile(#[from] CompileError),
    /// The request makes no sense, whatever the point.
    #[error("{0}")]
    Refused(#[from] RequestRefusal),
    /// The threads could not be started.
    #[error("{0}")]
    Threads(String),
    /// An observer failed to write, or wanted no more.
    #[error("{0}")]
    Observer(#[from] std::io::Error),
}

impl Sweep {
    /// Prepares a sweep over the grid of `vary`, the first of which varies slowest.
    ///
    /// Without a method of its own a request gets `taylor` where points can be integrated several at a time,
    /// else the one a single run would get; a point that it does not suit gets its own.  Without an output
    /// interval, drift is looked at eight times on the way.
    ///
    /// # Errors
    /// A scene that is none as it stands, a value it does not have, a request that makes no sense for it, or
    /// more than 1e9 points.
    pub fn new(template: &Template, vary: Vec<Vary>, request: &Request) -> Result<Self, SweepError> {
        let names: Vec<String> = vary.iter().map(|vary| vary.name.clone()).collect();
        Self::over(template, &names, request, |variables| grid(vary, variables))
    }

    /// The same over a list of points: for each all values of `names`, one point after the other.
    ///
    /// # Errors
    /// As [`Sweep::new`], or a list that is empty, holds numbers that are not finite, or not as many for each
    /// point.
    pub fn listed(
        template: &Template,
        names: &[String],
        values: Vec<f64>,
        request: &Request,
    ) -> Result<Self, SweepError> {
        Self::over(template, names, request, |variables| {
            let refused = |reason: &str| RequestRefusal {
                is_usage: true,
                what: "a list of points".into(),
                reason: reason.into(),
                alternative: "a finite number of each value for every point".into(),
            };
            distinct(variables)?;
            if values.iter().any(|value| !value.is_finite()) {
                return Err(refused("a value is not finite"));
            }
            let grid = Grid::listed(names.to_vec(), values);
            let grid = grid.ok_or_else(|| refused("it does not hold as many values for each point"))?;
            if grid.count() == 0 { Err(refused("it has no points")) } else { Ok(grid) }
        })
    }

    fn over(
        template: &Template,
        names: &[String],
        request: &Request,
        grid: impl FnOnce(&[Variable]) -> Result<Grid, RequestRefusal>,
    ) -> Result<Self, SweepError> {
        let scene = template.scene()?;
        let mechanism = Arc::new(Mechanism::new(&scene)?);
        let variables = names.iter().map(|name| template.variable(name)).collect::<Result<Vec<_>, _>>()?;
        unrequested(&variables, request)?;
        let grid = grid(&variables)?;
        let is_chosen = request.method.is_none();
        let mut request = request.clone();
        let in_lanes = request.method.is_none()
            && request.step.is_none()
            && !request.extended
            && request.stabilize.is_none_or(|kind| kind == Stabilization::Elimination)
            && Batch::takes_with_stops(&mechanism);
        let mut plan = Plan::new(&scene, &mechanism, &timed(&request, &scene))?;
        // Stiff scenes stay with the implicit method that was chosen.
        if in_lanes && !matches!(plan.method, MethodId::Radau(_)) {
            request.method = Some(MethodId::Taylor);
            plan = Plan::new(&scene, &mechanism, &timed(&request, &scene))?;
            let bodies = match (mechanism.springs.is_empty(), mechanism.constraints.is_empty()) {
                (true, true) => "free bodies",
                (false, _) => "bodies with springs",
                (true, false) => "bodies with one motor",
            };
            plan.why = Some(format!("taylor: {bodies} are integrated several at a time"));
        }
        // What one point gets unasked, all get that it suits.
        request.method = Some(plan.method);
        let shares = variables.iter().all(|variable| variable.start.is_some());
        let is_start = |variable: &Variable| variable.path.starts_with("start.");
        let is_many = variables.iter().all(is_start) || grid.count() >= LANES as u64;
        let template = template.clone();
        let limits = Limits::default();
        Ok(Self {
            template,
            scene,
            mechanism,
            request,
            is_chosen,
            plan,
            grid,
            variables,
            limits,
            skips: None,
            ends_at_flips: false,
            is_strict: false,
            trust: Level::Off,
            shard: None,
            within: None,
            stop: None,
            shares,
            is_many,
        })
    }

    /// The same with limits; a point that exceeds one stops.
    pub fn with_limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// The same without the points whose values `skips` is true of.
    pub fn without(self, skips: impl Fn(&[f64]) -> bool + Send + Sync + 'static) -> Self {
        Self { skips: Some(Box::new(skips)), ..self }
    }

    /// The same, where a point is refused of which something given for the start must change to fit its
    /// constraints.
    pub fn strictly(self) -> Self {
        Self { is_strict: true, ..self }
    }

    /// The same with an estimate of the error of every point: in lanes by a second sweep at a hundredth of
    /// the tolerance, compared at the output times, else (and with [`Level::Full`] always) as single runs
    /// have it.  No point changes by it.
    pub fn trusted(self, trust: Level) -> Self {
        Self { trust, ..self }
    }

    /// One of several parts of it; the points keep their numbers and values.
    pub fn sharded(self, shard: Option<Shard>) -> Self {
        Self { shard, ..self }
    }

    /// The same for some of its points alone, which keep their numbers, values and results; those that are
    /// not among them, or not of its part, are left out.
    ///
    /// Points are integrated several at a time where they can be, whatever the range: ranges of a few dozen
    /// points and more lose nothing by it.
    pub fn within(self, range: Range<u64>) -> Self {
        Self { within: Some(range), ..self }
    }

    /// The same with a flag that ends it, and any other sweep that is given it, within a step of every point
    /// under way: [`sweep`] then fails with [`Interrupted`](std::io::ErrorKind::Interrupted).
    pub fn stopped_by(self, flag: Arc<AtomicBool>) -> Self {
        Self { stop: Some(flag), ..self }
    }

    /// The part of it that this is.
    pub fn shard(&self) -> Option<Shard> {
        self.shard
    }

    /// The points to be run: all of the grid, or those of a part.
    pub fn range(&self) -> Range<u64> {
        let count = self.grid.count();
        let part = self.shard.map_or(0..count, |shard| shard.range(count));
        let Some(within) = &self.within else { return part };
        let start = within.start.clamp(part.start, part.end);
        start..within.end.clamp(start, part.end)
    }

    /// # Errors
    /// The flag is set.
    fn check_stop(&self) -> std::io::Result<()> {
        if self.is_stopped() { Err(std::io::ErrorKind::Interrupted.into()) } else { Ok(()) }
    }

    fn is_stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    /// How many points that are.
    pub fn count(&self) -> u64 {
        let range = self.range();
        range.end - range.start
    }

    /// How much is spent on trust.
    pub fn trust(&self) -> Level {
        self.trust
    }

    /// The same with points that end when a bar turns over, at the end of that step or at the next output
    /// time.
    pub fn ending_at_flips(self) -> Self {
        Self { ends_at_flips: true, ..self }
    }

    /// Whether points end when a bar turns over.
    pub fn ends_at_flips(&self) -> bool {
        self.ends_at_flips
    }

    /// The same with a note among those of its plan.
    #[must_use]
    pub fn noted(mut self, note: String) -> Self {
        self.plan.notes.push(note);
        self
    }

    /// The scene whose values are varied.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Its equations, as the scene stands.
    pub fn mechanism(&self) -> &Arc<Mechanism> {
        &self.mechanism
    }

    /// The plan of the scene as it stands; points differ from it only where what is varied decides.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The points.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// What is varied, slowest first.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// True where a mechanism of the points can be in lanes, whose steps no formula limits.
    fn has_lanes_for(&self, mechanism: &Mechanism) -> bool {
        !mechanism.has_active_arguments()
            && (Batch::takes_with_stops(mechanism)
                || self.is_many && Batch::takes_alike_with_stops(mechanism))
    }

    /// Points integrated as one task: enough to fill lanes, few enough to spread over the threads.
    fn chunk(&self, threads: usize) -> u64 {
        let (count, threads) = (self.count(), threads as u64);
        let lanes = if self.plan.method == MethodId::Taylor && self.has_lanes_for(&self.mechanism) {
            LANES as u64
        } else {
            1
        };
        (count / (16 * threads)).max(lanes.min(count.div_ceil(threads))).clamp(1, CHUNK)
    }
}

fn grid(vary: Vec<Vary>, variables: &[Variable]) -> Result<Grid, RequestRefusal> {
    let refused = |what: String, reason: String, alternative: &str| RequestRefusal {
        is_usage: true,
        what,
        reason,
        alternative: alternative.into(),
    };
    if vary.is_empty() {
        return Err(refused("a sweep".into(), "nothing is varied".into(), "--vary bar1.phi=-pi..pi:64"));
    }
    distinct(variables)?;
    let counts = vary.iter().map(|vary| vary.count.to_string()).collect::<Vec<_>>().join(" × ");
    Grid::new(vary).filter(|grid| grid.count() as f64 <= MAX_ROWS).ok_or_else(|| {
        refused(
            "--vary".into(),
            format!("{counts} points are more than the {MAX_ROWS:.0e} a sweep may have"),
            "smaller counts, or several sweeps",
        )
    })
}

/// Whether nothing is varied twice.
fn distinct(variables: &[Variable]) -> Result<(), RequestRefusal> {
    let twice = variables
        .iter()
        .enumerate()
        .find(|(k, variable)| variables[..*k].iter().any(|before| before.path == variable.path));
    twice.map_or(Ok(()), |(_, variable)| {
        Err(RequestRefusal {
            is_usage: true,
            what: format!("--vary {}", variable.path),
            reason: "it is varied twice".into(),
            alternative: "leave one of the two out".into(),
        })
    })
}

/// Whether nothing is varied that the request has a value of.
fn unrequested(variables: &[Variable], request: &Request) -> Result<(), RequestRefusal> {
    let requested = [("until", request.until), ("every", request.every)];
    let is_varied = |path: &str| variables.iter().any(|variable| variable.path == path);
    let twice =
        requested.into_iter().find_map(|(path, value)| value.filter(|_| is_varied(path)).map(|v| (path, v)));
    twice.map_or(Ok(()), |(path, value)| {
        Err(RequestRefusal {
            is_usage: true,
            what: format!("--vary {path}"),
            reason: format!("it is varied, and {path} = {value} s is asked for as well"),
            alternative: "leave one of the two out".into(),
        })
    })
}

/// The request with an output interval.
fn timed(request: &Request, scene: &Scene) -> Request {
    let every = request.every.unwrap_or(request.until.unwrap_or(scene.until) / LOOKS);
    Request { every: Some(every), ..request.clone() }
}
