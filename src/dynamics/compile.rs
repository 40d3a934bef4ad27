//! Scene to mechanism: the hinge trees, their constant matrices, the rows, and what the scene does not need
//! left out.

pub mod exact;
mod parts;

use super::Motion;
use super::assembly::{Assembly, Closest};
use super::configuration::{Configuration, Values};
use super::constraint::{self, ConstraintEquation, Measure, Site};
use super::force::formula::{Driven, Formulas};
use super::force::{Action, Spring, Torsion, UserForce, Vibration};
use super::forest::{BodyOrigin, Forest};
use super::friction::{Friction, Mode, frictions};
use super::impact::Contact;
use super::kernel::Kernel;
use super::output::Outputs;
use super::partition::CoordinatePartition;
use super::point::Point;
use super::quadratic::Quadratic;
use super::recursive::Recursion;
use super::tree::Tree;
use super::units::Units;
use crate::arithmetic::{Complex, Real};
use crate::scene::{Place, Scene};
pub(super) use parts::along_wall;
pub(super) use parts::travel_along;
use parts::{actions, follows, give_aims, given_angles, joints, kept_angles};
use std::sync::Arc;

/// The largest number of coordinates for which the matrices of the tree are made; they hold n² numbers.
pub const DENSE_LIMIT: usize = 2000;
/// Energy of a rigid spring's vibration over the mechanism's scale below which it has none.
const NO_ENERGY: f64 = 1e-12;
/// So many coordinates have code made for their number.
const UNROLLED: usize = 6;

/// A scene's equations: constants only, shared by every form and method.
#[derive(Clone, Debug, PartialEq)]
pub struct Mechanism {
    /// Bodies in the order of the scene's bars.
    pub bodies: Vec<Body>,
    /// How many of the last bodies are the rotors of integrals, which are shown as numbers only.
    pub integrals: usize,
    /// How they hang.
    pub forest: Forest,
    /// Hinges and welds in the order of the scene.
    pub joints: Vec<Joint>,
    /// The hinge trees' matrices.
    pub tree: Tree,
    /// Springs and dampers.
    pub springs: Vec<Spring>,
    /// Torsion springs and dampers.
    pub torsions: Vec<Torsion>,
    /// The fast vibration of the rigid spring, where it carries energy.
    pub vibration: Option<Vibration>,
    /// The slowest vibration of a rigid spring at the start, whether it carries energy or not \[rad/s\].
    pub rigid_rate: Option<f64>,
    /// Applied forces and torques.
    pub actions: Vec<Action>,
    /// Forces from outside the crate.
    pub forces: Vec<UserForce>,
    /// The scene's formulas, and where they are recorded with other parameters or on other branches: the
    /// first of `forces` are its laws, in their order.
    pub(crate) laws: Option<Laws>,
    /// What its runs write beside their own columns.
    pub(crate) outputs: Option<Arc<Outputs>>,
    /// Parts that do not act at the start or that events switch.
    pub(crate) switches: Switches,
    /// True where parts or branches that do not act at the moment do work: it is integrated all along.
    pub(crate) keeps_work: bool,
    /// The mechanism with the parts that do not act at the start, and their names; where there are any.
    pub(crate) whole: Option<(Arc<Mechanism>, Vec<String>)>,
    /// Constraint equations: given angles, then points that coincide or stay on lines, then one per contact
    /// that is held.
    pub constraints: Vec<ConstraintEquation>,
    /// How many motors give angles; their rows come first.
    pub motors: usize,
    /// Walls.
    pub contacts: Vec<Contact>,
    /// The contacts held, by number, in the order of their rows; none as compiled: see
    /// [`Mechanism::holding`].
    pub held: Vec<usize>,
    /// Places with dry friction.
    pub frictions: Vec<Friction>,
    /// What each of them does; all are open as compiled: see [`Mechanism::moving`].
    pub modes: Vec<Mode>,
    /// The driven angles solved for: coordinates left when the rows are eliminated.
    pub partition: CoordinatePartition,
    /// Gravity \[m/s²\].
    pub gravity: Complex<f64>,
    /// Energy of gravity of the masses if they were at the ground points they hang from \[J\].
    pub ground_energy: f64,
    /// What energies are divided by in reports \[J\]: see [`Mechanism::energy_scale`](super::energy).
    pub energy_scale: f64,
    /// What absolute tolerances and other thresholds are multiplied by.
    pub units: Units,
    /// How the start was found.
    pub assembly: Assembly,
    /// The constants of the recursive form, where that is the one evaluated.
    pub recursion: Option<Arc<Recursion>>,
}

/// What does not act at the start, or is switched by events, by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Switches {
    /// All of it.
    pub parts: Vec<String>,
    /// Motors, and locks without an angle: switched on, they go on from where they are.
    pub clutches: Vec<String>,
}

/// Formulas of a scene with the parameters and on the branches they are recorded with.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Laws {
    /// The formulas.
    pub formulas: Arc<Formulas>,
    /// Values of the parameters.
    pub parameters: Vec<f64>,
    /// Which conditions are positive.
    pub modes: Vec<bool>,
}

/// A body of the mechanism.
#[derive(Clone, Debug, PartialEq)]
pub struct Body<C = f64> {
    /// Name in the scene.
    pub name: String,
    /// Mass \[kg\].
    pub mass: C,
    /// Moment of inertia about the centre of mass \[kg·m²\].
    pub inertia: C,
    /// Centre of mass, counted from the body's origin, in its frame \[m\].
    pub centre: Complex<C>,
    /// Both ends of the bar, likewise, for drawings \[m\].
    pub ends: [Complex<C>; 2],
}

/// A hinge or weld.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint<C = f64> {
    /// Name in the scene.
    pub name: String,
    /// Where it is: a body and a point counted from its origin, in its frame, or a point of the ground \[m\].
    pub at: (Option<usize>, Complex<C>),
    /// The body that hangs on it; `None` where it closes a loop.
    pub outer: Option<usize>,
    /// The first of the two rows that close the loop.
    pub row: Option<usize>,
    /// The scene's first and second body at this hinge; `None` for the ground.
    pub between: [Option<usize>; 2],
}

/// Why a scene has no equations.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CompileError {
    /// Motors and locks give the same angle twice.
    #[error("`{0}` gives an angle that the other motors and locks give already")]
    Redundant(String),
    /// Too many rows that act on one another.
    #[error(
        "{0} constraint rows that act on one another through the bodies they hang on; at most about {DENSE_LIMIT} are taken"
    )]
    TooMany(usize),
    /// The mass matrix is singular: some body has no inertia about its hinge.
    #[error(
        "the mass matrix is singular at the start: bar `{0}` and what hangs on it have no inertia about its hinge"
    )]
    Massless(String),
    /// No start closes the rows, or none near what is given.
    #[error(
        "no start fits: constraint `{row}` is off by {left:.3e} {unit} at the nearest\n{closest}\nhint: check lengths and places, and whether what `start` gives can be reached; `driftless check SCENE --chart FILE` draws the closest"
    )]
    Impossible {
        /// The row that is off most.
        row: String,
        /// By how much.
        left: f64,
        /// `rad` or `m`.
        unit: &'static str,
        /// What comes closest.
        closest: Box<Closest>,
    },
    /// No rates keep the rows at the start.
    #[error(
        "no rates fit the start: constraint `{row}` slips by {left:.3e} {unit}\nhint: check motors against locks, and whether the start is a dead centre for the motor"
    )]
    ImpossibleRates {
        /// The row that slips most.
        row: String,
        /// By how much.
        left: f64,
        /// `rad/s` or `m/s`.
        unit: &'static str,
    },
    /// Coordinates, or rates, that neither the rows nor the scene give: as many as have to be added.
    #[error("the start leaves {} open: no constraint gives {}\nhint: add {} to the scene", quoted(.0), them(.0), them(.0))]
    Undetermined(Vec<String>),
    /// More than one start fits what is given.
    #[error(
        "the start is ambiguous: `{what}` may be {one:.6} or {other:.6} {unit}, and {count} configurations are found that fit\nhint: {advice}"
    )]
    Ambiguous {
        /// Where the scene could say which.
        what: String,
        /// One value.
        one: f64,
        /// Another.
        other: f64,
        /// `rad` or `m`.
        unit: &'static str,
        /// Configurations that were found.
        count: usize,
        /// What to give, so that the first of them is told from all others.
        advice: String,
    },
    /// A spring with a free length starts without a direction.
    #[error(
        "spring `{0}` starts with length 0 and has a free length\nhint: its force has no direction there; start elsewhere, move an end, or set free_length to 0"
    )]
    SpringWithoutLength(String),
    /// A rigid spring that vibrates is not the only constraint.
    #[error(
        "rigid spring `{spring}` starts with {energy:.3e} J of vibration, and its mean force is known only where no other constraint, wall or damper is\nhint: start it at its free length and without a rate along it, or leave its `model` out"
    )]
    NotAlone {
        /// The spring.
        spring: String,
        /// Its energy \[J\].
        energy: f64,
    },
    /// The scene was put together by hand and makes no sense.
    #[error("the scene makes no sense: {0}")]
    Unsound(String),
    /// A potential depends on time or rates.
    #[error("the potential of force `{0}` depends on time or rates\nhint: leave what does to `Force::apply`")]
    NoPotential(String),
    /// A force acts on a body the mechanism does not have.
    #[error("force `{0}` is one of another mechanism: it names a body that is not there")]
    ForeignForce(String),
    /// No bar has the name asked for.
    #[error("no bar is called `{0}`")]
    NoSuchBar(String),
    /// A point starts behind its wall.
    #[error(
        "wall `{wall}` has its point {gap:.3e} m behind it at the start\nhint: start elsewhere, move the wall, or turn its normal"
    )]
    BehindWall {
        /// The wall.
        wall: String,
        /// How far \[m\].
        gap: f64,
    },
}

/// Names in backticks, with commas and an `and`.
pub(super) fn quoted(names: &[String]) -> String {
    let all: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    match all.split_last() {
        Some((last, before)) if !before.is_empty() => format!("{} and {last}", before.join(", ")),
        _ => all.join(""),
    }
}

fn them(names: &[String]) -> &'static str {
    if names.len() == 1 { "it" } else { "them" }
}

impl Mechanism {
    /// Compiles a scene.
    ///
    /// # Errors
    /// What the reader of scenes refuses too (doubled motors), a singular mass matrix, or too many rows that
    /// act on one another.
    pub fn new(scene: &Scene) -> Result<Self, CompileError> {
        Self::with_forces(scene, Vec::new())
    }

    /// Compiles a scene with forces from outside.
    ///
    /// # Errors
    /// Those of [`Mechanism::new`], and forces on bodies that are not there.
    pub fn with_forces(scene: &Scene, forces: Vec<UserForce>) -> Result<Self, CompileError> {
        let unassembled = Self::unassembled(scene, forces)?;
        let mut acting = unassembled.clone();
        if acting.release(|name| scene.is_inactive(name)) {
            acting.partition =
                CoordinatePartition::new(acting.bodies.len(), acting.coordinates(), &acting.constraints)?;
        }
        let mut kept = kept_angles(scene);
        kept.retain(|&row| acting.constraints[row].is_angle());
        let mut mechanism = acting.assembled(scene, &kept)?;
        mechanism.vibrates(scene)?;
        mechanism.choose_form();
        if let Some(recursion) = mechanism
            .recursion
            .as_ref()
            .filter(|recursion| recursion.ways.entries() > DENSE_LIMIT * DENSE_LIMIT)
        {
            return Err(CompileError::TooMany(recursion.ways.rows()));
        }
        mechanism.check_mass(scene)?;
        let start = mechanism.start(scene);
        if let Some(laws) = mechanism.laws.clone() {
            let modes = mechanism.seen(&start, |at| laws.formulas.modes(at, &laws.parameters));
            mechanism = mechanism.on_branch(laws.parameters, modes)?;
        }
        mechanism.energy_scale = mechanism.scale_of_energy(&start);
        mechanism.scale_contacts(&start);
        mechanism.units = Units::new(&mechanism, scene, &start);
        if scene.inactive.is_empty() {
            return Ok(mechanism);
        }
        let unknown =
            |part| CompileError::Unsound(format!("inactive: no part that can be switched is `{part}`"));
        mechanism.put_back(&unassembled);
        let mut acting = mechanism.without(&scene.inactive).map_err(unknown)?;
        acting.whole = Some((Arc::new(mechanism), scene.inactive.clone()));
        Ok(acting)
    }
    /// A scene's bodies and joints without a start: all that drawing it in a given position takes.
    pub(crate) fn unassembled(scene: &Scene, forces: Vec<UserForce>) -> Result<Self, CompileError> {
        if let Some(fault) = scene.fault() {
            return Err(CompileError::Unsound(fault));
        }
        if let Some(foreign) = forces.iter().find(|force| force.last_body() >= Some(scene.bars.len())) {
            return Err(CompileError::ForeignForce(foreign.name.clone()));
        }
        let forest = Forest::new(scene);
        let n = forest.coordinates;
        let bodies = parts::bodies(scene, &forest);
        let gravity = Complex::new(scene.gravity[0], scene.gravity[1]);
        let mut forces = forces;
        let laws = match Formulas::of(scene, &forest)? {
            None => None,
            Some(formulas) => {
                let (parameters, modes) =
                    (formulas.parameters.clone(), vec![false; formulas.conditions.len()]);
                forces.splice(0..0, formulas.record(&parameters, &modes)?);
                Some(Laws { formulas: Arc::new(formulas), parameters, modes })
            }
        };
        let keeps_work = laws.as_ref().is_some_and(|laws| laws.formulas.applies());
        let mut rows = given_angles(scene);
        let partition = CoordinatePartition::new(bodies.len(), n, &rows)?;
        let joints = joints(scene, &forest, &mut rows);
        let frictions = frictions(scene, &forest, &joints);
        rows.extend(parts::guides(scene, &forest));
        rows.extend(scene.couplings.iter().map(|coupling| follows(&forest, coupling, scene)));
        rows.extend(parts::rods(scene, &forest));
        let springs = parts::springs(scene, &forest);
        let torsions = parts::torsions(scene);
        let contacts: Vec<Contact> = (scene.walls.iter())
            .map(|wall| {
                let normal = Complex::new(wall.normal[0], wall.normal[1]);
                let (row, point) = along_wall(&forest, wall, normal, wall.law.clone());
                Contact { point, on: wall.on, ..Contact::new(row, normal, wall.restitution) }
            })
            .collect();
        let roots = forest.roots();
        let ground_energy =
            bodies.iter().zip(&roots).fold(0.0, |sum, (body, &root)| sum - body.mass * gravity.dot(root));
        if let Some(Laws { formulas, parameters, modes }) = &laws {
            give_aims(&mut rows, formulas.aims(parameters, modes)?);
        }
        Ok(Self {
            ground_energy,
            tree: constants(&bodies, &forest, gravity),
            actions: actions(scene, &forest),
            forces,
            laws,
            switches: Switches::of(scene),
            outputs: Outputs::of(scene, &forest)?.map(Arc::new),
            keeps_work: keeps_work
                || !frictions.is_empty()
                || contacts.iter().any(|contact| contact.row.law.is_some()),
            whole: None,
            integrals: scene.bars.len() - scene.own_bars(),
            bodies,
            forest,
            joints,
            springs,
            torsions,
            vibration: None,
            rigid_rate: None,
            constraints: rows,
            motors: scene.motors.len(),
            contacts,
            held: Vec::new(),
            modes: vec![Mode::Open; frictions.len()],
            frictions,
            partition,
            gravity,
            energy_scale: 1.0,
            units: Units::default(),
            assembly: Assembly::default(),
            recursion: None,
        })
    }

    /// The mechanism with its laws recorded anew, with these parameters and on these branches.
    ///
    /// # Errors
    /// A potential that depends on time or rates on this branch.
    pub(crate) fn on_branch(&self, parameters: Vec<f64>, modes: Vec<bool>) -> Result<Self, CompileError> {
        let mut mechanism = self.clone();
        if let Some(laws) = &mut mechanism.laws
            && (&laws.parameters, &laws.modes) != (&parameters, &modes)
        {
            let recorded = laws.formulas.record(&parameters, &modes)?;
            mechanism.forces.splice(..recorded.len(), recorded);
            for (Driven { name, is_wall }, profile) in laws.formulas.profiles(&parameters, &modes) {
                let row = match is_wall {
                    true => {
                        mechanism.contacts.iter_mut().map(|wall| &mut wall.row).find(|row| row.name == *name)
                    }
                    false => mechanism.constraints.iter_mut().find(|row| row.name == *name),
                };
                if let Some(law) = row.and_then(|row| row.law.as_mut()) {
                    law.profile = Some(profile);
                }
            }
            give_aims(&mut mechanism.constraints, laws.formulas.aims(&parameters, &modes)?);
            (laws.parameters, laws.modes) = (parameters, modes);
            if laws.formulas.drives() {
                mechanism.partition = mechanism.partition.renewed(&mechanism.constraints)?;
            }
        }
        Ok(mechanism)
    }

    /// Calls `then` with the configuration of a motion.
    pub(crate) fn seen<R>(&self, motion: &Motion, then: impl FnOnce(&Configuration<f64>) -> R) -> R {
        let phi: Vec<f64> = motion.phi.iter().map(|phi| phi.hi).collect();
        let omega: Vec<f64> = motion.omega.iter().map(|omega| omega.hi).collect();
        let z = self.elements(&phi);
        let phi: Vec<f64> = (0..phi.len()).map(|k| motion.unwrapped(k)).collect();
        then(&Configuration::new(&Values { time: motion.time.hi, phi: &phi, z: &z, omega: &omega }))
    }

    /// Finds the vibration of a rigid spring that the start gives energy to, and takes it out of the start:
    /// what is left moves along the rod.
    fn vibrates(&mut self, scene: &Scene) -> Result<(), CompileError> {
        let rigid = || scene.springs.iter().filter(|spring| spring.rigid);
        if rigid().next().is_none() || !self.tree.is_dense() {
            return Ok(());
        }
        let given = self.start_with_vibration(scene);
        let phi: Vec<f64> = given.phi.iter().map(|phi| phi.hi).collect();
        let omega: Vec<f64> = given.omega.iter().map(|omega| omega.hi).collect();
        let mut z = vec![Complex::ZERO; phi.len()];
        self.tree.unit_vectors::<f64, 0>(&phi, &mut z);
        let scale = self.scale_of_energy(&self.start(scene));
        let started: Vec<Vibration> = rigid()
            .map(|spring| {
                let span =
                    self.forest.point(&spring.between[0]).minus(&self.forest.point(&spring.between[1]));
                Vibration {
                    name: spring.name.clone(),
                    span,
                    stiffness: spring.stiffness,
                    action: 0.0,
                    energy: 0.0,
                    frequency: 0.0,
                }
                .started(self, spring.free_length, &z, &omega)
            })
            .collect();
        self.rigid_rate = started.iter().map(|vibration| vibration.frequency).reduce(f64::min);
        // What rounding puts into a spring is nothing; not a number counts as energy.
        let most =
            started.into_iter().reduce(|most, other| if other.energy > most.energy { other } else { most });
        let Some(vibration) = most.filter(|most| most.energy.is_nan() || most.energy > NO_ENERGY * scale)
        else {
            return Ok(());
        };
        let is_alone = self.constraints.len() <= 1 && self.contacts.is_empty() && self.frictions.is_empty();
        if !is_alone || self.is_damped() {
            return Err(CompileError::NotAlone { spring: vibration.name, energy: vibration.energy });
        }
        self.settle_vibration(scene, given);
        self.vibration = Some(vibration);
        Ok(())
    }

    /// Decides in which form the equations are evaluated, body by body or by the matrices of the tree, by
    /// what they cost with these rows.
    pub(super) fn choose_form(&mut self) {
        let is_dense = self.tree.is_dense();
        let recursion = (!is_dense || self.coordinates() > UNROLLED && self.frictions.is_empty())
            .then(|| Recursion::new(&self.bodies, &self.forest, &self.constraints, self.gravity))
            .filter(|recursion| !is_dense || recursion.pays() && self.vibration.is_none())
            .filter(|_| !self.has_released() && !self.has_aims());
        self.recursion = recursion.map(Arc::new);
    }

    /// The mechanism with its equations evaluated body by body, whatever that costs.
    pub fn body_by_body(&self) -> Self {
        let recursion = Recursion::new(&self.bodies, &self.forest, &self.constraints, self.gravity);
        Self { recursion: Some(Arc::new(recursion)), ..self.clone() }
    }

    /// The mechanism with its equations evaluated in matrices; `None` where it is too large.
    pub fn by_matrices(&self) -> Option<Self> {
        self.tree.is_dense().then(|| Self { recursion: None, ..self.clone() })
    }

    /// Number of coordinates: the bodies' angles, and two for every origin that moves freely.
    pub fn coordinates(&self) -> usize {
        self.tree.coordinates
    }

    /// The number of bodies where angles are all there is and matrices are used, as code made for a size asks
    /// for; else 0, any number.
    pub fn size(&self) -> usize {
        if self.coordinates() == self.bodies.len() && self.recursion.is_none() {
            self.bodies.len()
        } else {
            0
        }
    }

    /// Centre of mass of a body as a point.
    pub fn centre(&self, body: usize) -> Point {
        self.forest.walk(body, self.bodies[body].centre)
    }

    /// The first or second end of a bar.
    pub fn end(&self, body: usize, end: usize) -> Site {
        Site { body: Some(body), point: self.forest.walk(body, self.bodies[body].ends[end]) }
    }

    /// What coordinate `k` is: `phi of bar1`, `x of cart`.
    pub fn coordinate_name(&self, k: usize) -> String {
        let name = |body: usize| &self.bodies[body].name;
        match k.checked_sub(self.bodies.len()) {
            None => format!("phi of {}", name(k)),
            Some(rest) => {
                let origin_point =
                    |hang: &super::forest::Hang| hang.origin_point == BodyOrigin::Free(k - rest % 2);
                let body = self.forest.hangs.iter().position(origin_point).unwrap_or(0);
                format!("{} of {}", if rest % 2 == 0 { "x" } else { "y" }, name(body))
            }
        }
    }

    /// The same for its rate.
    pub fn rate_name(&self, k: usize) -> String {
        let name = self.coordinate_name(k);
        match name.strip_prefix("phi") {
            Some(rest) => format!("omega{rest}"),
            None => format!("v{name}"),
        }
    }

    /// The mechanism without some of its springs, torsion springs, applied forces, torques, motors, locks and
    /// walls, and with some of its hinges released, by name; these must be closed by rows.
    ///
    /// # Errors
    /// A name that none of them has.
    pub fn without(&self, parts: &[String]) -> Result<Self, String> {
        let names = (self.springs.iter().map(|part| &part.name))
            .chain(self.torsions.iter().map(|part| &part.name))
            .chain(self.actions.iter().map(|part| &part.name))
            .chain(self.forces.iter().map(|part| &part.name))
            .chain(self.joints.iter().filter(|joint| joint.outer.is_none()).map(|joint| &joint.name))
            .chain(self.contacts.iter().map(|contact| &contact.row.name))
            .chain(self.switched_angles().map(|r| &self.constraints[r].name));
        let names: Vec<&String> = names.collect();
        if let Some(unknown) = parts.iter().find(|part| !names.contains(part)) {
            return Err(unknown.clone());
        }
        let mut mechanism = self.clone();
        mechanism.keeps_work |= self.is_worked_on();
        mechanism.springs.retain(|part| !parts.contains(&part.name));
        mechanism.torsions.retain(|part| !parts.contains(&part.name));
        mechanism.actions.retain(|part| !parts.contains(&part.name));
        mechanism.forces.retain(|part| !parts.contains(&part.name));
        for contact in &mut mechanism.contacts {
            contact.is_off |= parts.contains(&contact.row.name);
        }
        mechanism.release(|name| parts.contains(name));
        Ok(mechanism)
    }

    /// True where a joint was released, so that rows constrain nothing.
    pub fn has_released(&self) -> bool {
        self.constraints.iter().any(|row| row.coordinates().is_empty())
    }

    /// Names of the rows in force that follow from others.
    pub fn redundant(&self) -> Vec<&str> {
        let in_force = self.constraints.iter().filter(|row| !row.coordinates().is_empty());
        in_force
            .map(|row| row.name.as_str())
            .filter(|name| self.assembly.redundant.iter().any(|of| of == name))
            .collect()
    }

    /// True where motors have aims that depend on the mechanism.
    pub fn has_aims(&self) -> bool {
        self.constraints.iter().any(|row| row.aim.is_some())
    }

    /// Releases motors, locks, and joints that are closed by rows: the rows stay in their places, and constrain
    /// nothing any more.  False where there are none.
    fn release(&mut self, is_released: impl Fn(&String) -> bool) -> bool {
        let motors: Vec<usize> =
            self.switched_angles().filter(|&r| is_released(&self.constraints[r].name)).collect();
        let joints = self.joints.iter_mut().filter(|joint| is_released(&joint.name));
        let pins = joints.filter_map(|joint| joint.row.take()).flat_map(|row| [row, row + 1]);
        let rows: Vec<usize> = motors.into_iter().chain(pins).collect();
        for &r in &rows {
            let angles = self.bodies.len();
            let row = &mut self.constraints[r];
            row.measure = Measure::Place(Quadratic { angles, ..Quadratic::default() });
            (row.law, row.push, row.aim) = (None, None, None);
            // As those that depend on others, they say nothing of the position.
            self.assembly.redundant.push(row.name.clone());
            self.recursion = None;
        }
        !rows.is_empty()
    }

    /// Puts back what was released, as `before` has it.
    fn put_back(&mut self, before: &Self) {
        for (row, before) in self.constraints.iter_mut().zip(&before.constraints) {
            if row.coordinates().is_empty() && !before.coordinates().is_empty() {
                self.assembly.redundant.retain(|name| *name != row.name);
                row.clone_from(before);
            }
        }
        for (joint, before) in self.joints.iter_mut().zip(&before.joints) {
            joint.row = before.row;
        }
    }

    /// The rows of motors and locks that events switch; those of others may be eliminated.
    fn switched_angles(&self) -> impl Iterator<Item = usize> {
        let is_switched = |r: &usize| {
            (self.is_motor(*r) || self.constraints[*r].is_angle())
                && self.may_be_off(&self.constraints[*r].name)
        };
        (0..self.constraints.len()).filter(is_switched)
    }

    /// True where the part of that name does not act at the start, or events switch it.
    pub fn may_be_off(&self, name: &str) -> bool {
        self.switches.parts.iter().any(|part| part == name)
    }

    /// The mechanism with motors and locks, by row number, going on so much further than they said \[rad, m\].
    pub(crate) fn shifted(&self, shifts: &[(usize, f64)]) -> Self {
        let mut mechanism = self.clone();
        for &(row, by) in shifts {
            if let Some(law) = mechanism.constraints.get_mut(row).and_then(|row| row.law.as_mut()) {
                law.start += by;
            }
        }
        mechanism
    }

    /// The mechanism with all its parts, whatever acts at the start.
    pub(crate) fn with_all_parts(&self) -> &Self {
        self.whole.as_ref().map_or(self, |(whole, _)| whole)
    }

    /// Elements and translational coordinates of all bodies at these coordinates.
    pub(crate) fn pose(&self, phi: &[f64]) -> (Vec<Complex<f64>>, Vec<Complex<f64>>) {
        let z = self.elements(phi);
        let mut translations = vec![Complex::ZERO; self.bodies.len()];
        self.forest.translations(&z, &mut translations);
        (z, translations)
    }

    /// Where a place of the scene is, from these \[m\].
    pub(crate) fn place(
        &self,
        place: &Place,
        z: &[Complex<f64>],
        translations: &[Complex<f64>],
    ) -> Complex<f64> {
        let at = Complex::new(place.point[0], place.point[1]);
        place.bar.map_or(at, |bar| translations[bar] + (self.bodies[bar].ends[0] + at) * z[bar])
    }

    /// The mechanism with two of its points pinned to one another by two more rows: a closed loop.
    ///
    /// The loop must be closed at the start, and not be one that the rows there are close already.
    pub fn pinned(&self, name: &str, a: &Site, b: &Site) -> Self {
        let mut mechanism = self.clone();
        let before_contacts = mechanism.standing_rows();
        mechanism.constraints.splice(
            before_contacts..before_contacts,
            constraint::pin_equations(name, a, b, self.bodies.len()),
        );
        mechanism.choose_form();
        mechanism
    }

    /// The bodies of the scene itself: the rotors of integrals come after them.
    pub fn own_bodies(&self) -> &[Body] {
        &self.bodies[..self.bodies.len() - self.integrals]
    }

    /// The hinges and welds of the scene itself.
    pub fn own_joints(&self) -> impl Iterator<Item = &Joint> {
        let own = self.own_bodies().len();
        self.joints.iter().filter(move |joint| joint.outer.is_none_or(|body| body < own))
    }

    /// Names of the scene's integrals, and the coordinates whose rates they are.
    pub fn integrals(&self) -> impl Iterator<Item = (&str, usize)> {
        let own = self.own_bodies().len();
        self.bodies.iter().enumerate().skip(own).map(|(k, rotor)| (rotor.name.as_str(), k))
    }

    /// Names of the scene's events.
    pub fn event_names(&self) -> Vec<&str> {
        let events = self.laws.as_ref().map_or(&[][..], |laws| &laws.formulas.events);
        events.iter().map(|event| event.name.as_str()).collect()
    }

    /// True where a law may be flat to the last digit at one place and not at another.
    pub fn may_be_flat(&self) -> bool {
        let is_flat_aim =
            |row: &ConstraintEquation| row.aim.as_ref().is_some_and(|aim| aim.tape.may_be_flat());
        self.forces.iter().any(|force| force.may_be_flat) || self.constraints.iter().any(is_flat_aim)
    }

    /// True where laws have corners, places stick and slide or events change what acts, so that steps end
    /// where a switch is.
    pub fn is_switched(&self) -> bool {
        !self.frictions.is_empty() || self.laws.as_ref().is_some_and(|laws| laws.formulas.switches())
    }

    /// True where power series are chosen and serve as references: not with the mean force of a vibration,
    /// which has none, nor with dry friction and aims that depend on the mechanism, which `taylor` takes
    /// where it is asked for; and it takes the matrices of the tree.
    pub fn has_series(&self) -> bool {
        self.vibration.is_none() && self.frictions.is_empty() && !self.has_aims() && self.tree.is_dense()
    }

    /// True where the scene has a damper, or a force from outside that depends on rates.
    pub fn is_damped(&self) -> bool {
        self.forces.iter().any(UserForce::depends_on_rates)
            || !self.frictions.is_empty()
            || self.springs.iter().any(|spring| spring.damping != 0.0)
            || self.torsions.iter().any(|torsion| torsion.damping != 0.0)
    }

    /// True where anything but gravity and rows acts.
    pub fn is_forced(&self) -> bool {
        !(self.springs.is_empty()
            && self.torsions.is_empty()
            && self.actions.is_empty()
            && self.forces.is_empty())
    }

    /// True where forces do work that no energy stands for: dampers, applied forces and torques.
    pub fn is_worked_on(&self) -> bool {
        self.keeps_work
            || self.is_damped()
            || !self.actions.is_empty()
            || self.forces.iter().any(UserForce::does_work)
    }

    /// True where motors, dampers or applied forces do work, so that a form must integrate it.
    pub fn has_work_integral(&self) -> bool {
        !self.constraints.is_empty() || self.is_worked_on()
    }

    /// True where only gravity and rows act on bodies that hang on the ground.
    pub fn is_plain(&self) -> bool {
        self.coordinates() == self.bodies.len() && !self.is_forced()
    }

    /// True where whole turns matter, so that angles are not wrapped.
    pub fn is_winding(&self) -> bool {
        let turns = |row: &ConstraintEquation| row.aim.as_ref().is_some_and(|aim| aim.counts_turns);
        !self.torsions.is_empty()
            || self.forces.iter().any(UserForce::counts_turns)
            || self.constraints.iter().any(turns)
    }

    /// True where row number `row` is that of a motor, on an angle or on a slider; not where it locks an
    /// angle.
    pub fn is_motor(&self, row: usize) -> bool {
        let of = &self.constraints[row];
        row < self.motors || (of.law.is_some() || of.aim.is_some()) && !of.is_angle()
    }

    /// The unit of what rows measure: `rad`, `m`, or `rad or m` where some measure angles and some lengths;
    /// none without rows.
    pub fn unit_of_rows(&self) -> Option<&'static str> {
        let [angles, lengths] =
            [true, false].map(|kind| self.constraints.iter().any(|row| row.is_angle() == kind));
        match (angles, lengths) {
            (true, true) => Some("rad or m"),
            (true, false) => Some("rad"),
            (false, true) => Some("m"),
            (false, false) => None,
        }
    }

    /// True where a row is left when the given angles are eliminated: loops, sliders, contacts that are held.
    pub fn has_closed_loops(&self) -> bool {
        self.constraints.iter().any(|row| !row.is_angle())
    }

    /// True where rows cannot all be eliminated: those of loops and sliders, and given angles whose whole
    /// turns matter.
    pub fn has_multipliers(&self) -> bool {
        self.has_closed_loops()
            || (self.is_winding() && self.partition.driven())
            || self.constraints.iter().any(|row| self.may_be_off(&row.name))
    }

    /// The mass matrix at the start must be positive definite.
    fn check_mass(&self, scene: &Scene) -> Result<(), CompileError> {
        let start = self.start(scene);
        let phi: Vec<f64> = start.phi.iter().map(|phi| phi.hi).collect();
        let mut kernel = Kernel::<f64>::new(self);
        kernel.unit_vectors::<0>(self, &phi);
        kernel.mass_matrix::<0>(self);
        kernel.factor::<0>(self, &vec![0.0; phi.len()]);
        let singular = |&k: &usize| {
            // Not a number counts as singular.
            let sound = 1.0 / (kernel.pivot[k] * self.tree.diagonal[k]) > 1e-13;
            !sound
        };
        match (0..self.bodies.len()).find(singular) {
            Some(k) => Err(CompileError::Massless(self.bodies[k].name.clone())),
            None => Ok(()),
        }
    }
}

impl Switches {
    fn of(scene: &Scene) -> Self {
        let switched = scene.events.iter().flat_map(|event| event.off.iter().chain(&event.on));
        let mut parts: Vec<String> = scene.inactive.iter().chain(switched).cloned().collect();
        parts.sort_unstable();
        parts.dedup();
        let clutches = (scene.motors.iter().map(|motor| &motor.name))
            .chain(scene.drives.iter().map(|drive| &drive.name))
            .chain(scene.locks.iter().filter(|lock| lock.angle.is_none()).map(|lock| &lock.name));
        Self { clutches: clutches.filter(|name| parts.contains(name)).cloned().collect(), parts }
    }
}

/// H, d and the weights.
fn constants(bodies: &[Body], forest: &Forest, gravity: Complex<f64>) -> Tree {
    if forest.coordinates > DENSE_LIMIT {
        return long_constants(bodies, forest, gravity);
    }
    dense_constants(bodies, forest, gravity)
}

/// The same with H.
pub(super) fn dense_constants<C: Real>(
    bodies: &[Body<C>],
    forest: &Forest<C>,
    gravity: Complex<C>,
) -> Tree<C> {
    let n = forest.coordinates;
    let mut coupling = vec![Complex::ZERO; n * n];
    let mut diagonal: Vec<C> = bodies.iter().map(|body| body.inertia).collect();
    diagonal.resize(n, C::ZERO);
    let mut weight = vec![Complex::ZERO; n];
    for (k, body) in bodies.iter().enumerate() {
        let centre = forest.walk(k, body.centre);
        let carried = centre.shifts.iter().map(|&(x, share)| (x, Complex::new(C::of(share), C::ZERO)));
        let terms: Vec<_> = centre.terms.iter().copied().chain(carried).collect();
        for (place, &(i, gamma)) in terms.iter().enumerate() {
            diagonal[i] += body.mass * gamma.norm_squared();
            weight[i] += (gamma.conj() * gravity).times(body.mass);
            for &(j, other) in &terms[place + 1..] {
                coupling[i * n + j] += (gamma.conj() * other).times(body.mass);
            }
        }
    }
    let off_axis = coupling.iter().any(|h| h.im != C::ZERO);
    Tree { coordinates: n, angles: bodies.len(), coupling, diagonal, weight, off_axis }
}

/// d and the weights, from what hangs on each body; no H.
fn long_constants(bodies: &[Body], forest: &Forest, gravity: Complex<f64>) -> Tree {
    let n = forest.coordinates;
    let (mut diagonal, mut weight) = (vec![0.0; n], vec![Complex::ZERO; n]);
    // Mass of each body and of all that hangs on it.
    let mut carried: Vec<f64> = bodies.iter().map(|body| body.mass).collect();
    let mut off_axis = false;
    for &k in forest.order.iter().rev() {
        let Body { mass, inertia, centre, .. } = bodies[k];
        diagonal[k] += inertia + mass * centre.norm_squared();
        weight[k] += (centre.conj() * gravity).times(mass);
        off_axis |= centre.im != 0.0;
        match forest.hangs[k].origin_point {
            BodyOrigin::Ground(_) => {}
            BodyOrigin::On(parent, hinge) => {
                diagonal[parent] += carried[k] * hinge.norm_squared();
                weight[parent] += (hinge.conj() * gravity).times(carried[k]);
                carried[parent] += carried[k];
                off_axis |= hinge.im != 0.0;
            }
            BodyOrigin::Free(x) => (diagonal[x], weight[x]) = (carried[k], gravity.times(carried[k])),
        }
    }
    Tree { coordinates: n, angles: bodies.len(), coupling: Vec::new(), diagonal, weight, off_axis }
}
