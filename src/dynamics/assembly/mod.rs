//! The start of a mechanism that is more than a tree of hinges on the ground: what the scene gives of it is
//! kept, the rest is found from the rows.
//!
//! ```text
//! all that is given fits:
//!     it stays to the last bit, and the shortest way from the guesses closes the rows
//! some of it does not fit:     of what is given, in the order of the bars,
//!     as much stays as the rows leave free; the rest is taken as a rough guess
//! everything is given:         all of it changes as little as may be
//! ```
//!
//! Positions first, then rates.  Nothing is guessed twice: what the rows leave open must be given, and where
//! other guesses lead to another start the scene has to say which.

mod change;
mod failure;
mod guess;
mod newton;
mod others;
mod rank;
mod rates;
mod slow;
pub(in crate::dynamics) mod svd;
mod watch;

use super::compile::CompileError;
use super::constraint::{ConstraintEquation, RowMeasure};
use super::forest::BodyOrigin;
use super::law::Law;
use super::partition::CoordinatePartition;
use super::{Mechanism, Motion};
use crate::arithmetic::{Complex, DoubleDouble, Scalar};
use crate::scene::{Given, Scene};
pub use change::StartChange;
pub use failure::Closest;
use newton::{AssemblyProblem, GivenNumber, Goal, KEPT, of_origin};
use svd::{RowMatrix, independent};

/// What counts as no change, relative to 1 rad (and rad/s), the size of the mechanism, or the value where
/// that is larger.
const SAME: f64 = 1e-12;
/// What is given may be off by this and still be taken as a rough guess \[rad, or sizes of the mechanism\].
const REACH: f64 = 1.0;
/// Beyond this the search begins elsewhere as well \[rad, or sizes of the mechanism\].
const ROUGH: f64 = 0.1;
/// How far off, as shares of half a turn or twice the size of the mechanism.
const SPREADS: [f64; 4] = [0.1, 0.2, 0.4, 1.0];
/// A start is the nearest where all others are farther from what is given by this factor.
const CLEARLY: f64 = 1.25;
/// Two starts that differ by less are the same \[rad, or sizes of the mechanism\].
const DISTINCT: f64 = 1e-4;
/// What is left of a measured row, once those before it are taken off, counts as zero below this.
const DEPENDENT: f64 = 1e-9;
/// Up to so many coordinates redundant rows are told from singular ones, and rounding is spread over all that
/// is given.
const DENSE: usize = 100;

/// How the start was found, and the degrees of freedom that are left.
#[derive(Clone, Debug, Default)]
pub struct Assembly {
    /// The start; `None` where the scene's own is taken as it is.
    pub start: Option<Motion>,
    /// What differs from what the scene gives.
    pub changes: Vec<StartChange>,
    /// Coordinates less the rank of the rows.
    pub degrees_of_freedom: usize,
    /// Rows that follow from those before them, at the start and near it.
    pub redundant: Vec<String>,
    /// Rows that follow from those before them at the start alone: a singular position.
    pub singular: Vec<String>,
    /// The least singular value of the rows' Jacobian at the start that is not zero over the largest, angles
    /// in rad and lengths in sizes of the mechanism; 1 without rows, and not a number where it was not
    /// formed.
    pub conditioning: f64,
}

impl PartialEq for Assembly {
    /// By bits where a number is none: a mechanism is equal to itself.
    fn eq(&self, other: &Self) -> bool {
        let rest = |it: &Self| (it.degrees_of_freedom, it.conditioning.to_bits());
        rest(self) == rest(other)
            && (&self.start, &self.changes) == (&other.start, &other.changes)
            && (&self.redundant, &self.singular) == (&other.redundant, &other.singular)
    }
}

/// A start that closes the rows.
struct ClosedStart {
    q: Vec<DoubleDouble>,
    /// The largest change of what is given, measured.
    change: f64,
    /// The root of the sum of their squares: by which starts are compared.
    distance: f64,
    /// The aims kept as given.
    held: Vec<bool>,
    /// True where neighbours close the rows as well, as none of what is given could be kept.
    is_of_family: bool,
}

impl Mechanism {
    /// The mechanism with its start; `kept` are the rows whose angles are those of the start.
    pub(super) fn assembled(mut self, scene: &Scene, kept: &[usize]) -> Result<Self, CompileError> {
        // What an event closes or releases is kept by rows, and hangs on nothing by itself.
        let is_switched = scene.hinges.iter().any(|hinge| scene.is_switched(&hinge.name));
        if scene.has_whole_start() && !is_switched {
            self.assembly = Assembly {
                degrees_of_freedom: self.partition.count(),
                conditioning: if self.constraints.is_empty() { 1.0 } else { f64::NAN },
                ..Assembly::default()
            };
            // Where such a wall is, the reader of scenes does not know.
            if self.contacts.iter().any(|contact| contact.row.aim.is_some()) {
                self.check_start(scene)?;
            }
            return Ok(self);
        }
        let given = |bar: usize| scene.given.get(bar).copied().unwrap_or(Given::ANGLE_AND_RATE);
        let problem = AssemblyProblem::new(&self, scene, kept, &given);
        let (found, aims) = (problem.find(scene)?, &problem.aims);
        let mut changes = problem.changes(&found.q, aims);
        let mut angles = Vec::new();
        for &row in kept {
            if let RowMeasure::Angle { body, base } = self.constraints[row].measure.clone() {
                let between = found.q[body] - base.map_or(DoubleDouble::ZERO, |base| found.q[base]);
                angles.push((row, between.hi));
            }
        }
        let mut assembly = problem.rank(&found.q);
        let omega =
            problem.find_rates(scene, &given, &found.q, !assembly.singular.is_empty(), &mut changes)?;
        let mut start = Motion::default();
        for (k, &q) in found.q.iter().enumerate() {
            let (phi, turns) =
                if self.is_winding() || k >= self.bodies.len() { (q, 0.0) } else { q.reduced() };
            start.phi.push(phi);
            start.turns.push(turns as i64);
        }
        start.omega = omega;
        assembly.start = Some(start);
        assembly.changes = changes;
        for (row, angle) in angles {
            self.constraints[row].law = Some(Law::constant(angle));
        }
        self.partition = CoordinatePartition::new(self.bodies.len(), self.coordinates(), &self.constraints)?;
        self.assembly = assembly;
        self.check_start(scene)?;
        Ok(self)
    }

    /// Springs need a direction, and points must be before their walls; the reader of scenes sees to it where
    /// it knows the start.
    fn check_start(&self, scene: &Scene) -> Result<(), CompileError> {
        let (start, size) = (self.start(scene), self.size_of_parts());
        let mut z = vec![Complex::ZERO; self.coordinates()];
        self.tree.unit_vectors::<DoubleDouble, 0>(&start.phi, &mut z);
        for spring in self.springs.iter().filter(|spring| spring.needs_length()) {
            let span = spring.span.position(&z);
            if span.norm_squared().hi.sqrt() <= SAME * size {
                return Err(CompileError::SpringWithoutLength(spring.name.clone()));
            }
        }
        let [phi, _] = start.rounded();
        let plain: Vec<Complex<f64>> = z.iter().map(|z| Complex::new(z.re.hi, z.im.hi)).collect();
        for contact in self.contacts.iter().filter(|contact| !scene.is_inactive(&contact.row.name)) {
            let travel = contact.travel(start.time, &phi, &plain).unwrap_or(0.0);
            let gap = (contact.row.gap(&z) - DoubleDouble::from(travel)).hi;
            if gap < -SAME * size {
                return Err(CompileError::BehindWall { wall: contact.row.name.clone(), gap: -gap });
            }
        }
        Ok(())
    }

    /// The size of the mechanism \[m\]: its longest body or lever; 1 m where it has none.
    pub(crate) fn size_of_parts(&self) -> f64 {
        let length = |x: &Complex<f64>| x.norm_squared().sqrt();
        let bodies = self.bodies.iter().flat_map(|body| body.ends.iter().chain([&body.centre]).map(length));
        let levers = self
            .constraints
            .iter()
            .map(|row| if row.is_angle() { 0.0 } else { newton::lever(&row.measure, 0.0) });
        let size = bodies.chain(levers).fold(0.0, f64::max);
        if size > 0.0 { size } else { 1.0 }
    }
}

impl<'a> AssemblyProblem<'a> {
    fn new(mechanism: &'a Mechanism, scene: &Scene, kept: &[usize], given: &dyn Fn(usize) -> Given) -> Self {
        let (size, angles) = (mechanism.size_of_parts(), mechanism.bodies.len());
        let unit: Vec<f64> =
            (0..mechanism.coordinates()).map(|k| if k < angles { 1.0 } else { size }).collect();
        let lever = |row: &ConstraintEquation| {
            let slopes = row.aim.iter().flat_map(|aim| aim.slope_sizes(size));
            slopes.fold(newton::lever(&row.measure, size), |most, (k, slope)| most.max(slope * unit[k]))
        };
        let lever = mechanism.constraints.iter().map(lever).collect();
        let mut aims = Vec::new();
        for (bar, start) in scene.start.iter().enumerate() {
            if given(bar).phi {
                aims.push(GivenNumber { bar, goal: Goal::Coordinate(bar), given: start.phi });
            }
            if let Some(origin) = given(bar).origin {
                aims.extend(of_origin(mechanism, bar, origin));
            }
        }
        let is_known = |measure: &RowMeasure| match measure {
            RowMeasure::Angle { body, base } => given(*body).phi && base.is_none_or(|base| given(base).phi),
            RowMeasure::Place(_) => true,
        };
        let active = mechanism
            .constraints
            .iter()
            .enumerate()
            .map(|(i, row)| !kept.contains(&i) || is_known(&row.measure))
            .collect();
        AssemblyProblem { mechanism, active, size, unit, lever, aims }
    }

    /// Coordinates that nothing gives.
    fn missing(&self) -> Vec<usize> {
        self.columns(&vec![true; self.aims.len()])
    }

    /// Positions that close the rows.
    fn find(&self, scene: &Scene) -> Result<ClosedStart, CompileError> {
        let guess = self.guess(scene);
        let missing = self.missing();
        let first = self.attempt(&guess, &missing);
        if let (Ok(found), false) = (&first, missing.is_empty()) {
            self.check_open(&found.q, &self.active, &self.held(found), &missing, "phi")?;
        }
        let others = if missing.is_empty() { 0 } else { self.guesses() };
        let mut tried: Vec<Result<ClosedStart, Vec<DoubleDouble>>> = vec![first];
        tried.extend((1..=others).map(|k| self.attempt(&self.other_guess(&guess, &missing, k), &missing)));
        if !tried.iter().flatten().any(|found| found.change <= ROUGH) {
            // What is given may lead nowhere, or not to what is next to it: from elsewhere.
            let every: Vec<usize> = (0..guess.len()).collect();
            let begin = |k: usize| {
                let mut other = self.other_guess(&guess, &every, k);
                let share = SPREADS[k % SPREADS.len()];
                other.iter_mut().zip(&guess).for_each(|(q, guess)| *q = *guess + (*q - *guess).scale(share));
                other
            };
            // Of a family of positions the one next to the guesses is among those before.
            let is_single =
                |one: &Result<ClosedStart, _>| !one.as_ref().is_ok_and(|found| found.is_of_family);
            let more = (1..=self.guesses()).map(|k| self.near(begin(k), &guess, &missing));
            tried.extend(more.filter(is_single));
        }
        let count = [tried.len(), tried.iter().flatten().count()];
        let (mut all, mut open) = (Vec::new(), Vec::new());
        for one in tried {
            match one {
                Ok(found) => all.push(found),
                Err(q) => open.push(q),
            }
        }
        if all.is_empty() {
            return Err(self.impossible(open, count));
        }
        let nearest = (1..all.len()).fold(0, |best, k| {
            if all[k].distance < all[best].distance * (1.0 - 1e-6) - SAME { k } else { best }
        });
        let mut best = all.swap_remove(nearest);
        if best.change > REACH {
            return Err(self.far(&guess, &best, count));
        }
        if !missing.is_empty() {
            self.check_open(&best.q, &self.active, &self.held(&best), &missing, "phi")?;
        }
        // Where all is given, the nearest is what is meant.
        if !missing.is_empty() {
            let single = all.iter().filter(|other| !other.is_of_family);
            let rivals = single.filter(|other| other.distance <= (CLEARLY * best.distance).max(DISTINCT));
            self.check_alone(&best, rivals.collect())?;
        }
        // Gears and cams tell whole turns apart.
        let geared = self.mechanism.constraints.iter().filter(|row| row.aim.is_some());
        let geared: Vec<usize> = geared.flat_map(|row| row.coordinates()).collect();
        let turns_freely = |k: &&usize| **k < self.mechanism.bodies.len() && !geared.contains(k);
        for &k in missing.iter().filter(turns_freely) {
            // The turn next to the guess.
            let turns = ((best.q[k] - guess[k]).hi / std::f64::consts::TAU).round();
            best.q[k] -= DoubleDouble::TAU.scale(turns);
        }
        Ok(best)
    }

    /// The aims kept as given.
    fn held(&self, found: &ClosedStart) -> Vec<GivenNumber> {
        self.aims.iter().zip(&found.held).filter(|(_, held)| **held).map(|(aim, _)| *aim).collect()
    }

    /// From a guess to a start that closes the rows; else how far it came.
    fn attempt(&self, guess: &[DoubleDouble], missing: &[usize]) -> Result<ClosedStart, Vec<DoubleDouble>> {
        let (all, none) = (vec![true; self.aims.len()], vec![false; self.aims.len()]);
        let mut q = guess.to_vec();
        if self.closes(&mut q, &all) {
            // Where more is given than needed and fits to rounding, rounding is spread over all of it.
            if self.finish(&mut q, &self.active, &all) > 1e-20 && q.len() <= DENSE {
                self.finish(&mut q, &self.active, &none);
            }
            return Ok(ClosedStart { q, change: 0.0, distance: 0.0, held: all, is_of_family: false });
        }
        self.near(q, guess, missing)
    }

    /// From a position to a start that closes the rows and is as near to a guess as may be.
    fn near(
        &self,
        mut q: Vec<DoubleDouble>,
        guess: &[DoubleDouble],
        missing: &[usize],
    ) -> Result<ClosedStart, Vec<DoubleDouble>> {
        let none = vec![false; self.aims.len()];
        if !self.closes(&mut q, &none) {
            return Err(q);
        }
        let (mut held, mut is_of_family) = (none, false);
        if missing.is_empty() {
            self.to_turns_of(&mut q, guess);
            self.nearest(&mut q, guess);
        } else {
            let kept = self.kept(&self.aims, &q, &self.active);
            let mut trial = q.clone();
            for (aim, _) in self.aims.iter().zip(&kept).filter(|(_, kept)| **kept) {
                if let Goal::Coordinate(k) = aim.goal {
                    trial[k] = DoubleDouble::of(aim.given);
                }
            }
            if self.closes(&mut trial, &kept) {
                (q, held) = (trial, kept);
            } else {
                is_of_family = kept.contains(&true);
            }
            self.to_turns_of(&mut q, guess);
        }
        let measured = self.measured(&q).zip(&self.aims);
        let off: Vec<f64> = measured.map(|(used, aim)| self.share(aim, used - aim.given).abs()).collect();
        let distance = off.iter().fold(0.0, |sum, off| sum + off * off).sqrt();
        Ok(ClosedStart { q, change: off.into_iter().fold(0.0, f64::max), distance, held, is_of_family })
    }

    /// Closes the rows as far as double-double goes, with these aims held.
    fn closes(&self, q: &mut Vec<DoubleDouble>, held: &[bool]) -> bool {
        let left = self.position(q, &self.active, held);
        left < KEPT.sqrt() && (q.len() > DENSE && left < KEPT || self.finish(q, &self.active, held) < KEPT)
    }

    /// Of the aims as many as the rows leave free, from the first on.
    fn kept(&self, aims: &[GivenNumber], q: &[DoubleDouble], rows: &[bool]) -> Vec<bool> {
        let mut matrix = self.jacobian(q, rows);
        self.add_aims(&mut matrix, aims, q);
        independent(&matrix, DEPENDENT).split_off(self.mechanism.constraints.len())
    }

    fn add_aims(&self, matrix: &mut RowMatrix, aims: &[GivenNumber], q: &[DoubleDouble]) {
        let z = self.unit_vectors::<f64>(q).1;
        for aim in aims {
            matrix.entries.extend(self.aim(aim, q, &z).1);
            matrix.rows += 1;
        }
    }

    /// The value of every aim \[rad or m\].
    fn measured(&self, q: &[DoubleDouble]) -> impl Iterator<Item = f64> {
        let z = self.unit_vectors::<DoubleDouble>(q).1;
        self.aims.iter().map(|aim| self.aim(aim, q, &z).0.hi).collect::<Vec<f64>>().into_iter()
    }

    /// A change of an aim, measured.
    fn share(&self, aim: &GivenNumber, change: f64) -> f64 {
        change / if aim.goal == Goal::Coordinate(aim.bar) { 1.0 } else { self.size }
    }

    /// Where a scene gives a coordinate or, where `what` is `omega`, its rate: `start.bar1.phi`.
    fn place(&self, k: usize, what: &str) -> String {
        let (bodies, hangs) = (&self.mechanism.bodies, &self.mechanism.forest.hangs);
        if let Some(body) = bodies.get(k) {
            return format!("start.{}.{what}", body.name);
        }
        let x = k - (k - bodies.len()) % 2;
        let root = hangs.iter().position(|hang| hang.origin_point == BodyOrigin::Free(x)).unwrap_or(0);
        format!("start.{}.{}", bodies[root].name, if what == "phi" { "origin" } else { "velocity" })
    }
}
