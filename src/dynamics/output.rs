//! The outputs of a scene, evaluated: formulas of the state and of what parts carry.

mod active;
mod branches;

use self::branches::OutputExpression;
use super::compile::CompileError;
use super::configuration::{Configuration, Values};
use super::constraint::{Aim, ConstraintArguments, ConstraintEquation, Site};
use super::forest::{Forest, turning_acceleration};
use super::indeterminate::JointForces;
use super::kernel::Kernel;
use super::{Mechanism, Time};
use crate::arithmetic::Complex;
use crate::scene::{BoundOutput, Component, Meaning, OutputNames, Quantity, Scene, Source};

/// An output.
#[derive(Clone, Debug, PartialEq)]
struct CompiledOutput {
    name: String,
    unit: String,
    expression: OutputExpression,
}

/// The outputs of a scene.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Outputs {
    list: Vec<CompiledOutput>,
    signals: Vec<OutputExpression>,
    parameters: Vec<f64>,
    /// True where joint forces are among them.
    needs_forces: bool,
    /// True where accelerations of points are.
    needs_accelerations: bool,
    /// True where any acceleration or joint force is.
    needs_equations: bool,
    /// Those that are made of such.
    follows_equations: Vec<bool>,
}

/// What the outputs of one moment share, and room for it.
#[derive(Clone, Debug, Default)]
pub(crate) struct OutputScratch {
    /// Accelerations of the centres of mass \[m/s²\].
    centres: Vec<Complex<f64>>,
    forces: Forces,
    needed: Vec<Complex<f64>>,
    signals: Vec<f64>,
    sources: Vec<f64>,
}

/// A moment of a motion: an evaluation of the equations there, with all multipliers.
pub(crate) struct Moment<'a> {
    /// The mechanism with the contacts that are held and the modes of friction.
    pub mechanism: &'a Mechanism,
    /// Time \[s\].
    pub time: Time,
    /// Coordinates \[rad, m\].
    pub phi: &'a [f64],
    /// The angles with their whole turns \[rad\].
    pub winding: &'a [f64],
    /// Rates \[rad/s, m/s\].
    pub omega: &'a [f64],
    /// After [`Kernel::accelerate`], or [`Kernel::place`] where no output [needs](Outputs::needs_equations)
    /// more.
    pub kernel: &'a Kernel<f64>,
}

/// Joint forces and multipliers at a moment.
#[derive(Clone, Debug, Default)]
struct Forces {
    joints: Vec<Complex<f64>>,
    multipliers: Vec<f64>,
    /// Friction and the force that presses, place by place; empty where there are none.
    frictions: Vec<[f64; 2]>,
}

impl Outputs {
    /// Those of a scene; `None` where it has none.
    pub fn of(scene: &Scene, forest: &Forest) -> Result<Option<Self>, CompileError> {
        if scene.outputs.is_empty() {
            return Ok(None);
        }
        let names = OutputNames::of(scene);
        let unsound = |error| CompileError::Unsound(format!("outputs: {error}"));
        let place = |BoundOutput { mut formula, sources, .. }| {
            active::note(&mut formula, &sources);
            let site = |place| forest.site(&place);
            let placed = |source| match source {
                Source::State(meaning) => Source::State(Meaning::with_points(meaning, site)),
                Source::Carried(quantity) => Source::Carried(Quantity::with_points(quantity, site)),
            };
            OutputExpression::new(formula, sources.into_iter().map(placed).collect())
        };
        let mut signals = Vec::new();
        for signal in &scene.signals {
            signals.push(place(names.bind_signal(&signal.name, &signal.formula).map_err(unsound)?));
        }
        let mut list = Vec::new();
        for output in &scene.outputs {
            let bound = names.bind(output).map_err(unsound)?;
            let (name, unit) = (bound.name.clone(), bound.unit.clone());
            list.push(CompiledOutput { name, unit, expression: place(bound) });
        }
        let is_state = |source: &Source<Site>| {
            use Quantity::{Acceleration, AngularAcceleration, Gap, MovingGap, Tension, Torsion, Travel};
            let Source::Carried(quantity) = source else { return true };
            match quantity {
                // A rod pulls with its multiplier.
                Tension(name, _) => !scene.springs.iter().any(|spring| spring.rigid && spring.name == *name),
                AngularAcceleration(_)
                | Acceleration(..)
                | Travel(..)
                | Gap(..)
                | MovingGap(_)
                | Torsion(..) => true,
                _ => false,
            }
        };
        let is_acceleration =
            |source: &Source<Site>| matches!(source, Source::Carried(Quantity::Acceleration(..)));
        let named = list.iter().map(|output| &output.expression).chain(&signals);
        let sources = named.flat_map(|expression| &expression.sources);
        let is_turning =
            |source: &Source<Site>| matches!(source, Source::Carried(Quantity::AngularAcceleration(_)));
        let needs_forces = !sources.clone().all(is_state);
        let needs_accelerations = sources.clone().any(is_acceleration);
        let follows =
            |source: &Source<Site>| !is_state(source) || is_acceleration(source) || is_turning(source);
        let needs_equations = sources.clone().any(follows);
        let do_signals = signals.iter().flat_map(|signal| &signal.sources).any(follows);
        let is_signal = |source: &Source<Site>| matches!(source, Source::State(Meaning::Signal(_)));
        let follows_equations = list
            .iter()
            .map(|output| &output.expression.sources)
            .map(|sources| sources.iter().any(|one| follows(one) || do_signals && is_signal(one)))
            .collect();
        let parameters = scene.parameters.iter().map(|parameter| parameter.value).collect();
        Ok(Some(Self {
            list,
            signals,
            parameters,
            needs_forces,
            needs_accelerations,
            needs_equations,
            follows_equations,
        }))
    }

    /// False where places and rates are all that the outputs are made of.
    pub fn needs_equations(&self) -> bool {
        self.needs_equations
    }

    /// Which of them are made of accelerations or of forces in joints.
    pub fn follows_equations(&self) -> &[bool] {
        &self.follows_equations
    }

    /// Makes those that the state does not tell at a singular position not a number.
    pub fn withhold(&self, values: &mut [f64]) {
        let pairs = values.iter_mut().zip(&self.follows_equations);
        pairs.filter(|(_, follows)| **follows).for_each(|(value, _)| *value = f64::NAN);
    }

    /// Names and units, in order.
    pub fn heads(&self) -> impl Iterator<Item = (&str, &str)> {
        self.list.iter().map(|output| (output.name.as_str(), output.unit.as_str()))
    }

    /// Which of them have forces in them that redundant constraints leave open, by these joint forces.
    pub fn left_open(&self, mechanism: &Mechanism, found: &JointForces) -> Vec<bool> {
        let is_open = |source: &Source<Site>| match source {
            Source::State(_) => false,
            Source::Carried(quantity) => quantity.is_open(mechanism, found),
        };
        self.list.iter().map(|output| output.expression.sources.iter().any(is_open)).collect()
    }

    /// Appends what comes of their formulas at a moment, signals first, which is what these have.
    fn visit(
        &self,
        at: &Moment,
        scratch: &mut OutputScratch,
        values: &mut Vec<f64>,
        mut of: impl FnMut(&OutputExpression, &[f64]) -> f64,
    ) {
        let Moment { mechanism, time, omega, kernel, .. } = *at;
        let OutputScratch { centres, forces, needed, signals, sources } = scratch;
        if self.needs_forces || self.needs_accelerations {
            mechanism.write_centre_accelerations(&kernel.z, omega, &kernel.load, centres);
        }
        if self.needs_forces {
            forces.take(at, centres, needed);
        }
        let shared = MomentQuantities { centres, forces };
        let seen = Values { time: time.hi, phi: at.winding, z: &kernel.z, omega: at.omega };
        let configuration = Configuration::new(&seen);
        let parameters = mechanism.laws.as_ref().map_or(&self.parameters, |laws| &laws.parameters);
        signals.clear();
        let mut value = |expression: &OutputExpression, signals: &[f64]| {
            let source = |source: &Source<Site>| match source {
                Source::State(meaning) => meaning.value(&configuration, parameters, signals),
                Source::Carried(quantity) => quantity.value(at, &configuration, &shared),
            };
            if let [only] = &expression.sources[..]
                && expression.formula.is_name()
            {
                return source(only);
            }
            sources.clear();
            sources.extend(expression.sources.iter().map(source));
            // The zero of an absolute value has no sign: -0.0 + 0.0 is 0.0.
            of(expression, sources) + 0.0
        };
        for signal in &self.signals {
            signals.push(value(signal, signals));
        }
        values.extend(self.list.iter().map(|output| value(&output.expression, signals)));
    }
}

impl Forces {
    /// Takes those of a moment; `needed` is room for what bodies need.
    fn take(&mut self, at: &Moment, centres: &[Complex<f64>], needed: &mut Vec<Complex<f64>>) {
        let Moment { mechanism, time, phi, omega, kernel, .. } = *at;
        if mechanism.leaves_forces_open() {
            let found = mechanism.joint_forces(time, kernel, phi, omega);
            (self.joints, self.multipliers) = (found.hinges, found.multipliers);
        } else {
            needed.clear();
            needed.extend_from_slice(centres);
            mechanism.write_hinge_forces(time, kernel, phi, omega, needed, &mut self.joints);
            self.multipliers.clone_from(&kernel.multiplier);
        }
        if !mechanism.frictions.is_empty() {
            self.frictions = kernel.friction_forces(mechanism, time, phi, omega);
        }
    }
}

/// What quantities of a moment are read from.
struct MomentQuantities<'a> {
    centres: &'a [Complex<f64>],
    forces: &'a Forces,
}

impl Component {
    fn of(self, vector: Complex<f64>) -> f64 {
        match self {
            Self::X => vector.re,
            Self::Y => vector.im,
            Self::Magnitude => vector.norm_squared().sqrt(),
        }
    }
}

impl Quantity<Site> {
    /// True where it is a force that redundant constraints leave open, or that was not examined.
    fn is_open(&self, mechanism: &Mechanism, found: &JointForces) -> bool {
        let row = |name: &str| {
            let is_open = |(row, known): (&ConstraintEquation, &Option<bool>)| {
                row.name == *name && *known != Some(true)
            };
            mechanism.constraints.iter().zip(&found.row_is_determinate).any(is_open)
        };
        match self {
            Self::Joint(name, _) => {
                let joint = mechanism.joints.iter().position(|joint| joint.name == *name);
                joint.is_some_and(|joint| found.hinge_is_determinate[joint] != Some(true))
            }
            Self::Multiplier(name) | Self::Power(name) | Self::Push(name, _) | Self::Tension(name, _) => {
                row(name)
            }
            Self::Wall(_) | Self::Friction(_) => true,
            _ => false,
        }
    }

    fn value(&self, at: &Moment, seen: &Configuration<f64>, shared: &MomentQuantities) -> f64 {
        let Moment { mechanism, time, phi, omega, kernel, .. } = *at;
        let (z, alpha, forces) = (&kernel.z, &kernel.load, shared.forces);
        let row = |is_it: &dyn Fn(&ConstraintEquation) -> bool| {
            let number = mechanism.constraints[..mechanism.standing_rows()].iter().position(is_it)?;
            Some((&mechanism.constraints[number], forces.multipliers[number]))
        };
        let given = |name: &str| row(&|row| row.name == name && row.moves());
        match self {
            Self::AngularAcceleration(body) => alpha[*body],
            Self::Acceleration(body, [x, y], component) => {
                let centre = shared.centres[*body];
                let arm = z[*body].turn(Complex::new(*x, *y));
                component.of(centre + turning_acceleration(arm, omega[*body], alpha[*body]))
            }
            Self::Joint(name, component) => {
                let joint = mechanism.joints.iter().position(|joint| joint.name == *name);
                joint.map_or(0.0, |joint| component.of(forces.joints[joint]))
            }
            Self::Multiplier(name) => given(name).map_or(0.0, |(_, multiplier)| -multiplier),
            Self::Power(name) => given(name).map_or(0.0, |(row, multiplier)| {
                let drive = |aim: &Aim| aim.drive(time, ConstraintArguments { phi: at.winding, z, omega });
                let rate = match (&row.law, &row.aim) {
                    (Some(law), _) => law.rates::<f64>(time).0,
                    (None, aim) => aim.as_deref().map_or(0.0, drive),
                };
                -multiplier * rate
            }),
            Self::Push(name, component) => {
                let found = row(&|row| row.name == *name && row.law.is_none() && !row.is_angle());
                found.map_or(0.0, |(row, multiplier)| {
                    let push = row.push.as_ref().map(|push| push.direction(z).times(-multiplier));
                    push.map_or(0.0, |push| component.of(push))
                })
            }
            Self::Tension(name, ends) => tension(at, seen, name, ends, row),
            Self::Torsion(name, bar) => {
                if let Some(torsion) = mechanism.torsions.iter().find(|torsion| torsion.name == *name) {
                    return torsion.torque(at.winding, omega);
                }
                let mut load = vec![0.0; omega.len()];
                if let Some(law) = mechanism.forces.iter().find(|force| force.name == *name) {
                    law.pull(time.hi, ConstraintArguments { phi: at.winding, z, omega }, &mut load);
                }
                load[*bar]
            }
            Self::Travel([point, origin], body, direction, is_rate) => {
                let direction = Complex::new(direction[0], direction[1]);
                let along = body.map_or(direction, |body| z[body].turn(direction));
                let apart = |[a, b]: [[f64; 2]; 2]| Complex::new(a[0] - b[0], a[1] - b[1]);
                let span = apart([seen.position(point), seen.position(origin)]);
                if !is_rate {
                    return along.dot(span);
                }
                let turning = body.map_or(0.0, |body| omega[body] * along.left().dot(span));
                along.dot(apart([seen.velocity(point), seen.velocity(origin)])) + turning
            }
            Self::Gap(point, through, normal) => {
                let [x, y] = seen.position(point);
                normal[0] * (x - through[0]) + normal[1] * (y - through[1])
            }
            Self::MovingGap(name) => {
                let wall = mechanism.contacts.iter().find(|contact| contact.row.name == *name);
                wall.map_or(f64::NAN, |contact| contact.distance(time, phi, &kernel.z))
            }
            Self::Wall(name) => {
                let wall = mechanism.contacts.iter().position(|contact| contact.row.name == *name);
                let place = wall.and_then(|wall| mechanism.held.iter().position(|&held| held == wall));
                let row = place.map(|place| mechanism.standing_rows() + place);
                row.map_or(0.0, |row| -forces.multipliers[row])
            }
            Self::Friction(name) => {
                let place = mechanism.frictions.iter().position(|friction| friction.name == *name);
                place.map_or(0.0, |place| -forces.frictions[place][0])
            }
        }
    }
}

/// What a spring pulls its ends together with: its own force, that of its law, or that of its rod.
fn tension<'a>(
    at: &Moment<'a>,
    seen: &Configuration<f64>,
    name: &str,
    ends: &[Site; 2],
    row: impl Fn(&dyn Fn(&ConstraintEquation) -> bool) -> Option<(&'a ConstraintEquation, f64)>,
) -> f64 {
    let Moment { mechanism, time, omega, kernel, .. } = *at;
    let [from, to] = ends.each_ref().map(|end| seen.position(end));
    let span = Complex::new(to[0] - from[0], to[1] - from[1]);
    let length = span.norm_squared().sqrt();
    let along = |force: Complex<f64>| if length > 0.0 { force.dot(span) / length } else { 0.0 };
    if let Some(spring) = mechanism.springs.iter().find(|spring| spring.name == name) {
        return along(spring.force(&kernel.z, omega));
    }
    if let Some(law) = mechanism.forces.iter().find(|force| force.name == name) {
        let configuration = ConstraintArguments { phi: at.winding, z: &kernel.z, omega };
        let mut pulls = [Complex::ZERO; 2];
        law.forces(time.hi, configuration, |body, force| {
            if let Some(end) = ends.iter().position(|end| end.body == Some(body)) {
                pulls[end] += force;
            }
        });
        return if ends[0].body.is_some() { along(pulls[0]) } else { -along(pulls[1]) };
    }
    let rod = row(&|row| row.name == name && row.law.is_none() && !row.is_angle());
    rod.map_or(0.0, |(row, multiplier)| {
        let force =
            row.push.as_ref().map_or(Complex::ZERO, |push| push.direction(&kernel.z).times(-multiplier));
        along(force)
    })
}
