//! The way in for programs: a scene, what acts on it from outside, and how it is to be integrated.

use crate::Error;
use crate::dynamics::constraint::Site;
use crate::dynamics::force::{Force, UserForce};
use crate::dynamics::{CompileError, Mechanism, Motion};
use crate::run::event::foreign_event;
use crate::run::trajectory::{Recorder, Trajectory};
use crate::run::trust::Level;
use crate::run::{
    Custom, Event, Limits, MethodId, Observer, Outcome, Plan, Request, RequestRefusal, Run, Running, Sample,
    Stabilization, integrate,
};
use crate::scene::Scene;
use std::sync::Arc;

/// A scene about to be integrated.
///
/// What is not said is decided as by the program: the method by the scene and the horizon, the tolerance by
/// the method, the stabilization by the constraints.
///
/// ```
/// use driftless::{Configuration, Force, Loads, MethodId, Scalar, Simulation, Site, read_scene};
///
/// /// Drag against the square of the speed of a point.
/// struct Drag {
///     at: Site,
///     factor: f64,
/// }
///
/// impl Force for Drag {
///     fn name(&self) -> &str {
///         "drag"
///     }
///
///     fn apply<S: Scalar>(&self, at: &Configuration<S>, loads: &mut Loads<S>) {
///         let [vx, vy] = at.velocity(&self.at);
///         let speed = (vx * vx + vy * vy + S::of(1e-12)).sqrt().scale(-self.factor);
///         loads.force(&self.at, [vx * speed, vy * speed]);
///     }
/// }
///
/// # fn main() -> Result<(), driftless::Error> {
/// let scene = read_scene("examples/scenes/free.json".as_ref(), &[])?;
/// let simulation = Simulation::new(&scene)?;
/// let drag = Drag { at: simulation.site("bar2", [0.6, 0.0])?, factor: 0.02 };
/// let outcome = simulation.force(&drag)?.until(3.0).method(MethodId::Taylor).tolerance(1e-14, 1e-14).run()?;
/// // The energy that the drag has taken is accounted for to the last digits.
/// assert!(outcome.last.work < -0.01 && outcome.drift.energy.max < 1e-12);
/// # Ok(())
/// # }
/// ```
pub struct Simulation {
    scene: Scene,
    mechanism: Arc<Mechanism>,
    forces: Vec<UserForce>,
    request: Request,
    limits: Limits,
    level: Level,
    events: Vec<Box<dyn Event>>,
    integrator: Option<Custom>,
}

impl Simulation {
    /// Of a scene, as it says.
    ///
    /// # Errors
    /// A scene without equations of motion, or one put together by hand that makes no sense.
    pub fn new(scene: &Scene) -> Result<Self, Error> {
        Ok(Self {
            scene: scene.clone(),
            mechanism: Arc::new(Mechanism::new(scene)?),
            forces: Vec::new(),
            request: Request::default(),
            limits: Limits::default(),
            level: Level::Off,
            events: Vec::new(),
            integrator: None,
        })
    }

    /// The equations of motion, with all forces added so far.
    pub fn mechanism(&self) -> &Arc<Mechanism> {
        &self.mechanism
    }

    /// The motion at t = 0.
    pub fn start(&self) -> Motion {
        self.mechanism.start(&self.scene)
    }

    /// Number of the bar of this name.
    ///
    /// # Errors
    /// No bar has this name.
    pub fn body(&self, bar: &str) -> Result<usize, Error> {
        Ok(self.mechanism.body(bar)?)
    }

    /// The point `[x, y]` \[m\] of a bar, in its frame, or of `ground`.
    ///
    /// # Errors
    /// No bar has this name.
    pub fn site(&self, bar: &str, point: [f64; 2]) -> Result<Site, Error> {
        Ok(self.mechanism.site(bar, point)?)
    }

    /// Adds a force.
    ///
    /// # Errors
    /// A potential that depends on time or rates, a body that is not there, or a name that another force or a
    /// part of the scene has.
    pub fn force(mut self, force: &impl Force) -> Result<Self, Error> {
        self.forces.push(UserForce::record(force)?);
        self.mechanism = Arc::new(Mechanism::of_sound(&self.scene, self.forces.clone())?);
        Ok(self)
    }

    /// Looks for an event.
    #[must_use]
    pub fn event(self, event: impl Event + 'static) -> Self {
        self.boxed_event(Box::new(event))
    }

    /// The same for one of many kinds.
    #[must_use]
    pub fn boxed_event(mut self, event: Box<dyn Event>) -> Self {
        self.events.push(event);
        self
    }

    /// Horizon \[s\].
    #[must_use]
    pub fn until(mut self, until: f64) -> Self {
        self.request.until = Some(until);
        self
    }

    /// Output interval \[s\].
    #[must_use]
    pub fn every(mut self, every: f64) -> Self {
        self.request.every = Some(every);
        self
    }

    /// Method.
    #[must_use]
    pub fn method(mut self, method: MethodId) -> Self {
        self.request.method = Some(method);
        self
    }

    /// An integrator from outside the crate, by what makes it, in place of a method and its step.
    #[must_use]
    pub fn integrator(mut self, integrator: Custom) -> Self {
        self.integrator = Some(integrator);
        self
    }

    /// Relative and absolute tolerance of an adaptive method.
    #[must_use]
    pub fn tolerance(mut self, relative: f64, absolute: f64) -> Self {
        (self.request.rtol, self.request.atol) = (Some(relative), Some(absolute));
        self
    }

    /// Step of a fixed-step method \[s\].
    #[must_use]
    pub fn step(mut self, step: f64) -> Self {
        self.request.step = Some(step);
        self
    }

    /// How constraints are kept.
    #[must_use]
    pub fn stabilize(mut self, stabilization: Stabilization) -> Self {
        self.request.stabilize = Some(stabilization);
        self
    }

    /// Everything that may be asked for, in place of what was asked for before.
    #[must_use]
    pub fn options(mut self, request: Request) -> Self {
        self.request = request;
        self
    }

    /// Stops where the drift of energy or of a constraint exceeds these.
    #[must_use]
    pub fn limits(mut self, limits: Limits) -> Self {
        self.limits = limits;
        self
    }

    /// Estimates the error beside the run: see [`Outcome::trust`].
    #[must_use]
    pub fn trust(mut self, level: Level) -> Self {
        self.level = level;
        self
    }

    /// The run as it would be carried out.
    ///
    /// # Errors
    /// A request that makes no sense for the scene, an event of another mechanism or with the name of one of
    /// the scene, or a method that cannot begin there.
    pub fn prepare(self) -> Result<Run, Error> {
        if self.integrator.is_some() {
            check_integrator(&self.request)?;
        }
        // An adaptive method stands for what is not known of the integrator.
        let stand_in = Request {
            method: if self.integrator.is_some() { Some(MethodId::Dp8) } else { self.request.method },
            ..self.request
        };
        let mut plan = Plan::new(&self.scene, &self.mechanism, &stand_in).map_err(|mut refusal| {
            if let Some(integrator) = &self.integrator
                && let Some(rest) = refusal.what.strip_prefix("dp8 ")
            {
                refusal.what = format!("{} {rest}", integrator.name());
            }
            refusal
        })?;
        if let Some(integrator) = self.integrator {
            plan = plan.integrated_by(integrator);
        }
        let start = self.mechanism.start(&self.scene);
        if let Some(event) = foreign_event(&self.mechanism, &start, &self.events) {
            return Err(CompileError::ForeignEvent(event.into()).into());
        }
        let is_taken = |name: &str| self.scene.events.iter().any(|event| event.name == name);
        if let Some(event) = self.events.iter().map(|event| event.name()).find(|name| is_taken(name)) {
            return Err(CompileError::EventNameTaken(event.into()).into());
        }
        let run = Run::new(Arc::clone(&self.mechanism), plan, self.limits, &start)?;
        Ok(run.trusted(self.level, &start).with_events(self.events))
    }

    /// Integrates to the horizon.
    ///
    /// # Errors
    /// Whatever keeps it from beginning; a stop on the way is part of the [`Outcome`].
    pub fn run(self) -> Result<Outcome, Error> {
        self.run_with(|_| Ok(()))
    }

    /// The same for an [`Observer`], which sees steps and samples and may end the run.
    ///
    /// # Errors
    /// Those of [`run`](Self::run).
    pub fn run_observed(self, observer: &mut dyn Observer) -> Result<Outcome, Error> {
        let mut running = Running::new(self.prepare()?);
        running.go_observed(observer, &mut || false);
        Ok(running.finish())
    }

    /// The same, with the motion at every time.
    ///
    /// # Errors
    /// Those of [`run`](Self::run).
    pub fn trajectory(self) -> Result<Trajectory, Error> {
        let mut recorder = Recorder::default();
        let outcome = self.run_observed(&mut recorder)?;
        Ok(recorder.into_trajectory(outcome))
    }

    /// The same, showing every sample.
    ///
    /// # Errors
    /// Those of [`run`](Self::run), and what the observer failed with.
    pub fn run_with(
        self,
        mut observer: impl FnMut(&Sample) -> std::io::Result<()>,
    ) -> Result<Outcome, Error> {
        Ok(integrate(self.prepare()?, &mut observer)?)
    }
}

/// An integrator from outside is the method, and has a step of its own.
fn check_integrator(request: &Request) -> Result<(), RequestRefusal> {
    let (what, reason) = match (request.method, request.step) {
        (Some(method), _) => (format!("method {method}"), "it would replace the one from outside"),
        (_, Some(step)) => (format!("a step of {step} s"), "the integrator from outside has its own"),
        _ => return Ok(()),
    };
    Err(RequestRefusal {
        what: format!("{what} with `Simulation::integrator`"),
        reason: reason.into(),
        alternative: "leave one of the two out".into(),
        is_usage: true,
    })
}
