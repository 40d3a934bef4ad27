//! Scene to mechanism: the hinge trees, their constant matrices, the rows, and what the scene does not need
//! left out.

mod constants;
mod error;
pub mod exact;
mod parts;
mod properties;
mod switched;
mod turns;

use super::assembly::Assembly;
use super::constraint::{self, ConstraintEquation, Site};
use super::fingerprint::CompiledScene;
use super::force::formula::{DrivenPart, Formulas};
use super::force::{AppliedAction, CompiledSpring, Torsion, UserForce, Vibration};
use super::forest::Forest;
use super::friction::{CompiledFriction, FrictionMode, check_lines, frictions};
use super::impact::Contact;
use super::output::Outputs;
use super::partition::CoordinatePartition;
use super::recursive::Recursion;
use super::tree::Tree;
use super::units::Units;
use crate::arithmetic::Complex;
use crate::scene::{Place, Scene};
use constants::constants;
pub(super) use constants::dense_constants;
pub use error::CompileError;
pub(crate) use error::quoted;
pub(super) use parts::along_wall;
pub(crate) use parts::travel_along;
use parts::{actions, follows, give_aims, given_angles, joints, kept_angles};
use std::sync::Arc;
pub(crate) use turns::WholeTurns;

/// The largest number of coordinates for which the matrices of the tree are made; they hold n² numbers.
pub const DENSE_LIMIT: usize = 2000;
/// Energy of a rigid spring's vibration over the mechanism's scale below which it has none.
const NO_ENERGY: f64 = 1e-12;
/// So many coordinates have code made for their number.
const UNROLLED: usize = 6;

/// A scene's equations: constants only, shared by every form and method.
#[derive(Clone, Debug, PartialEq)]
pub struct Mechanism {
    /// The scene, which tells it from others.
    pub(crate) origin: CompiledScene,
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
    pub springs: Vec<CompiledSpring>,
    /// Torsion springs and dampers.
    pub torsions: Vec<Torsion>,
    /// The fast vibration of the rigid spring, where it carries energy.
    pub vibration: Option<Vibration>,
    /// The rigid spring of the slowest vibration at the start, whether that carries energy or not, and its
    /// rate \[rad/s\].
    pub slowest_rod: Option<(String, f64)>,
    /// Applied forces and torques.
    pub actions: Vec<AppliedAction>,
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
    /// True where whole turns matter to such: none are taken off all along.
    pub(crate) keeps_turns: bool,
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
    pub frictions: Vec<CompiledFriction>,
    /// What each of them does; all are open as compiled: see [`Mechanism::moving`].
    pub modes: Vec<FrictionMode>,
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
    /// Those of [`Mechanism::new`], forces on bodies that are not there, and forces that share a name with
    /// one another or with a part of the scene.
    pub fn with_forces(scene: &Scene, forces: Vec<UserForce>) -> Result<Self, CompileError> {
        scene.fault().map_or_else(|| Self::of_sound(scene, forces), |fault| Err(CompileError::Unsound(fault)))
    }

    /// The same of a scene that was judged before, as one that was read.
    pub(crate) fn of_sound(scene: &Scene, forces: Vec<UserForce>) -> Result<Self, CompileError> {
        let unassembled = Self::unassembled(scene, forces)?;
        unassembled.check_names()?;
        let mut acting = unassembled.clone();
        if acting.release(|name| scene.is_inactive(name)) {
            acting.partition =
                CoordinatePartition::new(acting.bodies.len(), acting.coordinates(), &acting.constraints)?;
        }
        let mut kept = kept_angles(scene);
        kept.retain(|&row| acting.constraints[row].is_angle());
        let mut mechanism = acting.assembled_on_branches(scene, &kept)?;
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
        if let Some(next) = mechanism.on_branches_after(&start, true)? {
            mechanism = next;
        }
        mechanism.check_forces(scene, &start)?;
        mechanism.check_aims(&start)?;
        mechanism.energy_scale = mechanism.scale_of_energy(&start);
        mechanism.scale_contacts(&start);
        mechanism.units = Units::new(&mechanism, scene, &start);
        if scene.inactive.is_empty() {
            return Ok(mechanism);
        }
        mechanism.put_back(&unassembled);
        mechanism.acting(&scene.inactive)
    }

    /// A scene's bodies and joints without a start: all that drawing it in a given position takes.
    pub(crate) fn unassembled(scene: &Scene, forces: Vec<UserForce>) -> Result<Self, CompileError> {
        if let Some(broken) = scene.broken_reference() {
            return Err(CompileError::Unsound(broken));
        }
        if let Some(foreign) = forces.iter().find(|force| force.last_body() >= Some(scene.own_bars())) {
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
        let keeps_work = (laws.iter().map(|laws| &laws.formulas))
            .any(|formulas| formulas.applies() || formulas.may_move_walls());
        let keeps_turns = laws.as_ref().is_some_and(|laws| laws.formulas.may_count_turns());
        let mut rows = given_angles(scene);
        let partition = CoordinatePartition::new(bodies.len(), n, &rows)?;
        let joints = joints(scene, &forest, &mut rows);
        let frictions = frictions(scene, &forest, &joints);
        rows.extend(parts::guides(scene, &forest));
        rows.extend(scene.couplings.iter().map(|coupling| follows(&forest, coupling, scene)));
        rows.extend(parts::rods(scene, &forest));
        let springs = parts::springs(scene, &forest);
        let torsions = parts::torsions(scene);
        let mut contacts = parts::contacts(scene, &forest);
        let roots = forest.roots();
        let ground_energy =
            bodies.iter().zip(&roots).fold(0.0, |sum, (body, &root)| sum - body.mass * gravity.dot(root));
        if let Some(Laws { formulas, parameters, modes }) = &laws {
            give_aims(&mut rows, &mut contacts, formulas.aims(parameters, modes)?);
            check_lines(&frictions, &contacts)?;
        }
        Ok(Self {
            origin: CompiledScene(Arc::new(scene.clone())),
            ground_energy,
            tree: constants(&bodies, &forest, gravity),
            actions: actions(scene, &forest),
            forces,
            laws,
            switches: Switches::of(scene),
            outputs: Outputs::of(scene, &forest)?.map(Arc::new),
            keeps_work: keeps_work
                || !frictions.is_empty()
                || contacts.iter().any(|contact| contact.row.moves_by_time()),
            keeps_turns,
            whole: None,
            integrals: scene.bars.len() - scene.own_bars(),
            bodies,
            forest,
            joints,
            springs,
            torsions,
            vibration: None,
            slowest_rod: None,
            constraints: rows,
            motors: scene.motors.len(),
            contacts,
            held: Vec::new(),
            modes: vec![FrictionMode::Open; frictions.len()],
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
            for (DrivenPart { name, is_wall }, profile) in laws.formulas.profiles(&parameters, &modes) {
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
            let aims = laws.formulas.aims(&parameters, &modes)?;
            give_aims(&mut mechanism.constraints, &mut mechanism.contacts, aims);
            check_lines(&mechanism.frictions, &mechanism.contacts)?;
            (laws.parameters, laws.modes) = (parameters, modes);
            if laws.formulas.drives() {
                mechanism.partition = mechanism.partition.renewed(&mechanism.constraints)?;
            }
        }
        Ok(mechanism)
    }

    /// Finds the vibration of a rigid spring that the start gives energy to, and takes it out of the start:
    /// what is left moves along the rod.
    fn vibrates(&mut self, scene: &Scene) -> Result<(), CompileError> {
        let rigid = || scene.springs.iter().filter(|spring| spring.rigid);
        if rigid().next().is_none() || !self.tree.is_dense() {
            return Ok(());
        }
        let given = self.start_with_vibration(scene);
        let [phi, omega] = given.rounded();
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
        let rods = started.iter().map(|vibration| (vibration.name.clone(), vibration.frequency));
        self.slowest_rod = rods.reduce(|least, other| if other.1 < least.1 { other } else { least });
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

    /// Elements and translational coordinates of all bodies at these coordinates.
    pub(crate) fn pose(&self, phi: &[f64]) -> (Vec<Complex<f64>>, Vec<Complex<f64>>) {
        let z = self.elements(phi);
        let mut translations = vec![Complex::ZERO; self.bodies.len()];
        self.forest.translations(&z, &mut translations);
        (z, translations)
    }

    /// Centres of mass of all bodies \[m\] and their velocities \[m/s\] at these coordinates and rates.
    pub(crate) fn centres(&self, phi: &[f64], omega: &[f64]) -> Vec<[[f64; 2]; 2]> {
        let mut origins = [(); 2].map(|()| vec![Complex::ZERO; self.bodies.len()]);
        let mut centres = Vec::with_capacity(self.bodies.len());
        let at = (&self.elements(phi)[..], omega);
        self.forest.each_centre(&self.bodies, at, &mut origins, |_, centre, velocity| {
            centres.push([centre, velocity].map(|vector| [vector.re, vector.im]));
        });
        centres
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
}
