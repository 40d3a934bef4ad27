//! The mechanism of a scene whose numbers are known exactly: the same compilation, with constants of many
//! digits.

mod rows;

use super::parts;
use super::{Body, CompileError, Mechanism, dense_constants};
use crate::arithmetic::Complex;
use crate::dynamics::constraint::{ConstraintArguments, ConstraintEquation};
#[cfg(feature = "digits")]
use crate::dynamics::force::formula::FormulaEvent;
use crate::dynamics::force::formula::{DrivenPart, Formulas};
use crate::dynamics::force::{AppliedAction, CompiledSpring, Torsion, UserForce};
use crate::dynamics::forest::Forest;
use crate::dynamics::friction::{CompiledFriction, FrictionMode, frictions};
use crate::dynamics::kernel::dot;
use crate::dynamics::partition::CoordinatePartition;
use crate::dynamics::series::{FrictionTerms, Terms};
use crate::dynamics::tree::{self, Tree};
use crate::scene::{Decimal, Direction, Scene, SceneEvent};
use std::sync::Arc;

/// Constants of a mechanism in numbers of the kind `C`, and where it starts.
#[derive(Clone, Debug)]
pub struct ExactMechanism<C> {
    /// The mechanism in doubles, for all that is not a constant.
    pub structure: Arc<Mechanism>,
    /// Bodies in the order of the scene's bars.
    pub bodies: Vec<Body<C>>,
    /// How they hang.
    pub forest: Forest<C>,
    /// The hinge trees' matrices.
    pub tree: Tree<C>,
    /// The driven angles.
    pub partition: CoordinatePartition<C>,
    /// Springs and dampers that act.
    pub springs: Vec<CompiledSpring<C>>,
    /// Torsion springs and dampers that act.
    pub torsions: Vec<Torsion<C>>,
    /// Applied forces and torques that act.
    pub actions: Vec<AppliedAction<C>>,
    /// Forces by formulas that act.
    pub forces: Vec<UserForce<C>>,
    /// Events.
    pub events: Vec<ExactEvent>,
    /// Their functions, recorded as torques.
    pub functions: Vec<UserForce<C>>,
    /// The conditions that choose the branches of formulas, recorded as torques.
    pub conditions: Vec<UserForce<C>>,
    /// What acts.
    pub acting: Acting<C>,
    laws: Option<Arc<Formulas<C>>>,
    all: Arc<AllParts<C>>,
    /// Constraint equations.
    pub constraints: Vec<ConstraintEquation<C>>,
    /// Places with dry friction, in the order of the mechanism's.
    pub frictions: Vec<CompiledFriction<C>>,
    /// Gravity \[m/s²\].
    gravity: Complex<C>,
    /// The gap of each wall, and its restitution.
    pub walls: Vec<(ConstraintEquation<C>, C)>,
    /// Energy of gravity of the masses if they were at the ground points they hang from \[J\].
    ground_energy: C,
}

/// All springs, torsion springs, applied forces and torques, and constraint equations, whatever acts.
#[derive(Debug)]
struct AllParts<C> {
    springs: Vec<CompiledSpring<C>>,
    torsions: Vec<Torsion<C>>,
    actions: Vec<AppliedAction<C>>,
    constraints: Vec<ConstraintEquation<C>>,
}

/// What acts at a moment, and how.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Acting<C> {
    /// Parameters of formulas.
    pub parameters: Vec<C>,
    /// Which conditions of formulas are positive.
    pub modes: Vec<bool>,
    /// Parts that rest, by name.
    pub off: Vec<String>,
    /// How far motors, and locks without an angle, go on from what they said, row by row \[rad, m\].
    pub shifts: Vec<C>,
    /// Walls on which a point stays, in the order of their rows, which are the last but for those of what
    /// sticks.
    pub held: Vec<usize>,
    /// What places with dry friction do.
    pub sliding: Vec<FrictionMode<C>>,
}

/// An event.
#[derive(Clone, Debug)]
pub struct ExactEvent {
    /// Name.
    pub name: String,
    /// Which zeros of its function count.
    pub direction: Direction,
    /// True where the run ends there.
    pub stop: bool,
    /// True where it switches parts or sets parameters.
    pub changes: bool,
    /// What its function changes by in a unit of a coordinate or rate, at the start.
    pub magnitude: f64,
    /// Joints and locks that it closes.
    pub joints: Vec<String>,
}

/// Positions and rates of all coordinates at the start, and which of the angles and rates the scene gives.
#[derive(Clone, Debug)]
pub struct ExactStart<C> {
    /// Angles \[rad\] of any number of turns, then positions of origins \[m\].
    pub phi: Vec<C>,
    /// Rates \[rad/s, m/s\].
    pub omega: Vec<C>,
    /// Angles, and rates, that are as the scene gives them.
    pub given: [Vec<bool>; 2],
}

impl<C: Decimal> ExactMechanism<C> {
    /// The mechanism of a scene, which is `structure` in doubles.
    ///
    /// # Errors
    /// What of it is not carried in many digits.
    pub fn new(scene: &Scene<C>, structure: &Arc<Mechanism>) -> Result<Self, String> {
        if !structure.tree.is_dense() {
            return Err("a mechanism of so many bodies is not carried in many digits".into());
        }
        let forest = Forest::new(scene);
        let bodies = parts::bodies(scene, &forest);
        let gravity = Complex::new(scene.gravity[0], scene.gravity[1]);
        let mut constraints = parts::given_angles(scene);
        if structure.has_closed_loops() {
            // Angles kept from the start are those of the start that was found.
            for row in parts::kept_angles(scene) {
                let law = structure.constraints[row].law.as_ref();
                if let (Some(law), Some(kept)) = (law, &mut constraints[row].law) {
                    kept.start = kept.start.moved_to(law.start);
                }
            }
        }
        let partition = CoordinatePartition::new(bodies.len(), forest.coordinates, &constraints)
            .map_err(|error| error.to_string())?;
        let frictions = frictions(scene, &forest, &parts::joints(scene, &forest, &mut constraints));
        constraints.extend(parts::guides(scene, &forest));
        constraints.extend(scene.couplings.iter().map(|coupling| parts::follows(&forest, coupling, scene)));
        let laws = Formulas::of(scene, &forest).map_err(|error| error.to_string())?.map(Arc::new);
        let acting = Acting {
            parameters: laws.as_ref().map_or_else(Vec::new, |laws| laws.parameters.clone()),
            modes: {
                let known = structure.laws.as_ref().map_or(&[][..], |laws| &laws.modes);
                let count = laws.as_ref().map_or(0, |laws| laws.conditions.len());
                known.iter().copied().chain(std::iter::repeat(false)).take(count).collect()
            },
            off: structure.resting().to_vec(),
            shifts: vec![C::ZERO; constraints.len()],
            held: Vec::new(),
            sliding: vec![FrictionMode::Open; frictions.len()],
        };
        let event = |event: &SceneEvent| ExactEvent {
            name: event.name.clone(),
            direction: event.direction,
            stop: event.stop,
            changes: event.changes(),
            magnitude: 0.0,
            joints: event.on.iter().filter(|part| structure.is_joint(part)).cloned().collect(),
        };
        let all = AllParts {
            springs: parts::springs(scene, &forest),
            torsions: parts::torsions(scene),
            actions: parts::actions(scene, &forest),
            constraints,
        };
        let ground_energy = (bodies.iter().zip(&forest.roots()))
            .fold(C::ZERO, |sum, (body, &root)| sum - body.mass * gravity.dot(root));
        let mechanism = Self {
            structure: Arc::clone(structure),
            tree: dense_constants(&bodies, &forest, gravity),
            partition,
            springs: Vec::new(),
            torsions: Vec::new(),
            actions: Vec::new(),
            forces: Vec::new(),
            events: scene.events.iter().map(event).collect(),
            functions: Vec::new(),
            conditions: Vec::new(),
            acting: Acting::default(),
            laws,
            all: Arc::new(all),
            walls: (scene.walls.iter())
                .map(|wall| {
                    let normal = Complex::new(wall.normal[0], wall.normal[1]);
                    (parts::along_wall(&forest, wall, normal, wall.law.clone()).0, wall.restitution)
                })
                .collect(),
            constraints: Vec::new(),
            frictions,
            gravity,
            ground_energy,
            bodies,
            forest,
        };
        mechanism.with(acting).map_err(|error| error.to_string())
    }

    /// The mechanism where other parts act, or in another way.
    ///
    /// # Errors
    /// A formula cannot be recorded so.
    pub fn with(&self, acting: Acting<C>) -> Result<Self, CompileError> {
        let mut next = self.clone();
        let acts = |name: &String| !acting.off.contains(name);
        if acting.off != self.structure.resting() {
            let whole = self.structure.with_all_parts();
            let whole = if whole.held.is_empty() { whole.clone() } else { whole.holding(&[]) };
            next.structure = Arc::new(whole.acting(&acting.off)?);
        }
        let sliding: Vec<FrictionMode> = acting.sliding.iter().map(FrictionMode::in_doubles).collect();
        if acting.held != next.structure.held || sliding != next.structure.modes {
            next.structure = Arc::new(next.structure.moving(&acting.held, &sliding));
        }
        let AllParts { springs, torsions, actions, constraints } = &*self.all;
        next.springs = springs.iter().filter(|spring| acts(&spring.name)).cloned().collect();
        next.torsions = torsions.iter().filter(|torsion| acts(&torsion.name)).cloned().collect();
        next.actions = actions.iter().filter(|action| acts(&action.name)).cloned().collect();
        next.constraints.clone_from(constraints);
        for (row, &shift) in next.constraints.iter_mut().zip(&acting.shifts) {
            if let Some(law) = &mut row.law {
                law.start += shift;
            }
        }
        if let Some(laws) = &self.laws {
            let Acting { parameters, modes, .. } = &acting;
            next.forces = laws.record(parameters, modes)?;
            next.forces.retain(|force| acts(&force.name));
            next.functions = laws.record_events(parameters, modes)?;
            next.functions.truncate(next.events.len());
            next.conditions = laws.record_conditions(parameters, modes)?;
            for (DrivenPart { name, is_wall }, profile) in laws.profiles(parameters, modes) {
                let mut walls = next.walls.iter_mut().map(|(row, _)| row);
                let row = match is_wall {
                    true => walls.find(|row| row.name == *name),
                    false => next.constraints.iter_mut().find(|row| row.name == *name),
                };
                if let Some(law) = row.and_then(|row| row.law.as_mut()) {
                    law.profile = Some(profile);
                }
            }
            let aims = laws.aims(parameters, modes)?;
            parts::give(&mut next.constraints, next.walls.iter_mut().map(|wall| &mut wall.0), aims);
            next.partition = next.partition.renewed(&next.constraints)?;
        }
        let whole = next.structure.with_all_parts();
        for (r, row) in next.constraints.iter_mut().enumerate() {
            if next.structure.constraints[r].is_released(&whole.constraints[r]) {
                row.release(next.bodies.len());
            }
        }
        next.constraints.extend(acting.held.iter().map(|&wall| next.walls[wall].0.clone()));
        let stuck = next.frictions.iter().zip(&acting.sliding).filter_map(|(friction, mode)| match *mode {
            FrictionMode::Stick(at) => Some(friction.stuck(at)),
            _ => None,
        });
        next.constraints.extend(stuck);
        next.acting = acting;
        Ok(next)
    }

    /// The terms of its equations.
    pub fn terms(&self) -> Terms<'_, C> {
        Terms {
            structure: &self.structure,
            tree: &self.tree,
            partition: &self.partition,
            springs: &self.springs,
            torsions: &self.torsions,
            actions: &self.actions,
            forces: &self.forces,
            constraints: &self.constraints,
            friction: (!self.frictions.is_empty()).then_some(FrictionTerms {
                places: &self.frictions,
                bodies: &self.bodies,
                forest: &self.forest,
                gravity: self.gravity,
            }),
        }
    }

    /// Elements at these coordinates.
    pub fn elements(&self, phi: &[C]) -> Vec<Complex<C>>
    where
        C: crate::arithmetic::Over<C>,
    {
        let mut z = vec![Complex::ZERO; phi.len()];
        self.tree.unit_vectors::<C, 0>(phi, &mut z);
        z
    }

    /// Kinetic and potential energy \[J\].
    pub fn energy(&self, phi: &[C], omega: &[C], z: &[Complex<C>]) -> [C; 2]
    where
        C: crate::arithmetic::Over<C>,
    {
        let n = phi.len();
        let (mut mass, mut twist) = (vec![C::ZERO; n * n], vec![C::ZERO; n * n]);
        let mut momentum = vec![C::ZERO; n];
        self.tree.mass_matrix::<C, 0>(z, &mut mass, &mut twist);
        tree::multiply::<C, 0>(n, &mass, omega, &mut momentum);
        let gravity = self.tree.gravity_energy(z) + self.ground_energy;
        let springs = self.springs.iter().fold(gravity, |sum, spring| sum + spring.energy(z));
        let elastic = self.torsions.iter().fold(springs, |sum, torsion| sum + torsion.energy(phi));
        let at = ConstraintArguments { phi, z, omega: &[] };
        let potential = self.forces.iter().fold(elastic, |sum, force| sum + force.energy(C::ZERO, at));
        [dot(omega, &momentum).scale(0.5), potential]
    }

    /// Centres of mass \[m\] and their velocities \[m/s\].
    pub fn centres(&self, z: &[Complex<C>], omega: &[C]) -> Vec<[Complex<C>; 2]>
    where
        C: crate::arithmetic::Over<C>,
    {
        let mut origins = [(); 2].map(|()| vec![Complex::ZERO; self.bodies.len()]);
        let mut centres = Vec::with_capacity(self.bodies.len());
        self.forest.each_centre(&self.bodies, (z, omega), &mut origins, |_, centre, velocity| {
            centres.push([centre, velocity]);
        });
        centres
    }

    /// The start as the scene gives it, with what was found in doubles for the rest.
    pub fn start(&self, scene: &Scene<C>, plain: &Scene) -> ExactStart<C>
    where
        C: crate::arithmetic::Over<C>,
    {
        let (n, bars) = (self.structure.coordinates(), self.bodies.len());
        let found = self.structure.start(plain);
        let changed = |k: usize| {
            (found.unwrapped(k) - plain.start[k].phi).abs() > 1e-12 * found.phi[k].hi.abs().max(1.0)
        };
        let whole = |k: usize| {
            let turns = C::of(found.turns.get(k).copied().unwrap_or(0) as f64);
            C::split(found.phi[k]).0 + C::ONE.atan2(C::ZERO).scale(4.0) * turns
        };
        let mut start = ExactStart {
            phi: (0..n).map(whole).collect(),
            omega: (0..n).map(|k| C::split(found.omega[k]).0).collect(),
            given: [vec![false; n], vec![false; n]],
        };
        for k in 0..bars {
            if scene.given[k].phi && !changed(k) {
                (start.phi[k], start.given[0][k]) = (scene.start[k].phi, true);
            }
            let rate = (found.omega[k].hi - plain.start[k].omega).abs();
            if scene.given[k].omega && rate <= 1e-12 * found.omega[k].hi.abs().max(1.0) {
                (start.omega[k], start.given[1][k]) = (scene.start[k].omega, true);
            }
        }
        self.put_origins(scene, &mut start);
        start
    }

    /// Positions and velocities of origins that move freely, from those given for some bar of each group.
    fn put_origins(&self, scene: &Scene<C>, start: &mut ExactStart<C>)
    where
        C: crate::arithmetic::Over<C>,
    {
        let (n, bars) = (start.phi.len(), self.bodies.len());
        let (length, time) = (self.structure.units.length, self.structure.units.time);
        for x in (bars..n).step_by(2) {
            let end = |k: usize| self.forest.walk(k, self.bodies[k].ends[0]);
            let group: Vec<usize> =
                (0..bars).filter(|&k| end(k).shifts.first().is_some_and(|shift| shift.0 == x)).collect();
            if let Some((k, at)) = group.iter().find_map(|&k| Some((k, scene.given[k].origin?))) {
                let mut z = self.elements(&start.phi);
                z[x] = Complex::ZERO;
                let reach = end(k).position(&z);
                put(&mut start.phi, &mut start.given[0], x, [at[0] - reach.re, at[1] - reach.im], length);
            }
            if let Some((k, rate)) = group.iter().find_map(|&k| Some((k, scene.given[k].velocity?))) {
                let z = self.elements(&start.phi);
                let mut omega = start.omega.clone();
                omega[x..x + 2].fill(C::ZERO);
                let turning = end(k).velocity(&z, &omega);
                let rates = [rate[0] - turning.re, rate[1] - turning.im];
                put(&mut start.omega, &mut start.given[1], x, rates, length / time);
            }
        }
    }
}

/// Puts in what is given of a pair of coordinates where assembly in doubles has left it, in this unit; what
/// it has changed stays as it found it.
fn put<C: crate::arithmetic::Real>(
    found: &mut [C],
    is_given: &mut [bool],
    x: usize,
    given: [C; 2],
    unit: f64,
) {
    for (k, given) in (x..).zip(given) {
        let double = found[k].value();
        if (given.value() - double).abs() <= 1e-12 * double.abs().max(unit) {
            (found[k], is_given[k]) = (given, true);
        }
    }
}
