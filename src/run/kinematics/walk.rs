//! One position after another: predicted from rates and accelerations, solved by projection.

mod approach;
mod fold;
mod singular;
mod step;

pub(super) use approach::LimitApproach;
pub(super) use singular::{SingularPosition, between};

use super::independence::{Independence, determinant, in_jacobian, size};
use super::transmission::Transmission;
use super::{FOUND, KinematicsError, Limit, Position};
use crate::arithmetic::Complex;
use crate::dynamics::kernel::{Bias, Kernel};
use crate::dynamics::output::{Moment, OutputScratch};
use crate::dynamics::{Mechanism, Motion, State, Time};
use crate::scene::Scene;
use crate::stabilization::projection::project;
use std::sync::Arc;

/// What a row may be off by, in its own size.
const KEPT: f64 = 1e-11;
/// Rates that grew by more than this make a fold of the end of a range.
const STEEP: f64 = 1e3;
/// Bodies within this of one line are in line at a dead centre \[rad\].
pub(super) const IN_LINE: f64 = 1e-4;
/// The same at a limit, which is come near to only.
const NEARLY_IN_LINE: f64 = 1e-2;
/// Branches of laws that are tried at a position.
const BRANCHES: usize = 4;

/// A position that was solved, from which others can be: nothing of the scratch space that solved it.
#[derive(Clone)]
pub(super) struct SolvedPosition {
    pub state: State,
    /// The largest rate there was up to it.
    usual: f64,
    /// See [`DriveWalk::orientation`].
    pub orientation: Option<f64>,
    /// The share of the weakest constraint.
    pub share: f64,
    /// All there is to know of it.
    pub position: Position,
}

/// A mechanism at a value of its drive.
#[derive(Clone)]
pub(super) struct DriveWalk {
    mechanism: Arc<Mechanism>,
    kernel: Kernel<f64>,
    /// For what is evaluated beside the state.
    beside: Kernel<f64>,
    state: State,
    alpha: Vec<f64>,
    /// The state before a step, and what the step predicts: coordinates, then rates.
    before: State,
    predicted: Vec<f64>,
    row: usize,
    /// The drive's value at t = 0, and its rate.
    law: [f64; 2],
    transmissions: Vec<Transmission>,
    /// The hinges between two bodies of two hinges each.
    lines: Vec<Transmission>,
    /// The largest rate there was, but beside limits.
    usual: f64,
    /// True at a position that was solved as one beside a limit.
    is_beside_limit: bool,
    /// Which coordinates G depends on.
    is_in_jacobian: Vec<bool>,
}

impl SolvedPosition {
    /// True where all of it is as at another position, whole turns apart.
    pub fn is_as(&self, other: &Self, mechanism: &Mechanism) -> bool {
        let (bodies, turn) = (mechanism.bodies.len(), std::f64::consts::TAU);
        (self.position.phi.iter().zip(&other.position.phi)).enumerate().all(|(k, (a, b))| {
            let apart = a - b;
            if k < bodies {
                (apart - turn * (apart / turn).round()).abs() < 1e-9
            } else {
                apart.abs() < 1e-9 * mechanism.units.length
            }
        })
    }
}

impl DriveWalk {
    /// The start of a scene.
    pub fn at_start(
        mechanism: &Arc<Mechanism>,
        scene: &Scene,
        row: usize,
        law: [f64; 2],
        [transmissions, lines]: [&[Transmission]; 2],
    ) -> Result<Self, KinematicsError> {
        let start = mechanism.start(scene);
        let (n, bodies) = (mechanism.coordinates(), mechanism.bodies.len());
        let mut unknowns: Vec<_> = start.phi.iter().chain(&start.omega).copied().collect();
        unknowns.resize(2 * n + 3, Time::default());
        let state = mechanism.state(Time::default(), &unknowns, &start.turns[..bodies]);
        let mut walk = Self {
            mechanism: Arc::clone(mechanism),
            kernel: Kernel::new(mechanism),
            beside: Kernel::new(mechanism),
            before: state.clone(),
            predicted: vec![0.0; 2 * n],
            state,
            alpha: vec![0.0; n],
            row,
            law,
            transmissions: transmissions.to_vec(),
            lines: lines.to_vec(),
            usual: 0.0,
            is_beside_limit: false,
            is_in_jacobian: vec![true; n],
        };
        walk.look_at_jacobian();
        walk.settle().map_err(|(row, left)| KinematicsError::Start { row, left })?;
        walk.usual = walk.usual_rate();
        Ok(walk)
    }

    /// Takes the laws to their branches at the state; false where they are on them.
    fn follow(&mut self) -> Result<bool, (String, f64)> {
        if self.mechanism.laws.as_ref().is_none_or(|laws| laws.modes.is_empty()) {
            return Ok(false);
        }
        let mut motion = Motion::default();
        motion.follow(&self.state, self.alpha.len());
        let row = || (self.mechanism.constraints[self.row].name().into(), f64::NAN);
        let next = self.mechanism.on_branches_of(&motion).map_err(|_| row())?;
        if let Some(next) = next {
            if next.is_winding() && !self.state.is_winding {
                self.state.unwind();
            }
            self.kernel = Kernel::new(&next);
            self.beside = Kernel::new(&next);
            self.mechanism = Arc::new(next);
            self.look_at_jacobian();
            return Ok(true);
        }
        Ok(false)
    }

    /// Finds which coordinates the Jacobian of the mechanism depends on.
    fn look_at_jacobian(&mut self) {
        let phi = &self.state.y[..self.alpha.len()];
        self.is_in_jacobian = in_jacobian(&self.mechanism, &mut self.beside, phi);
    }

    /// At a state that was solved, where its branches were found.
    fn stand(&mut self) {
        let _ = self.follow();
        self.accelerate();
    }

    /// Accelerations and multipliers of the state.
    fn accelerate(&mut self) {
        let (mechanism, n) = (&*self.mechanism, self.alpha.len());
        let (phi, omega) = (&self.state.y[..n], &self.state.y[n..2 * n]);
        self.kernel.accelerations(mechanism, self.state.time, phi, omega, Bias::default());
        mechanism.share_multipliers(self.state.time, &mut self.kernel, phi, omega);
        self.alpha.copy_from_slice(&self.kernel.load);
        self.is_beside_limit = self.solve_beside_limit();
    }

    /// Solves the rows at both levels, then accelerations and multipliers.
    fn settle(&mut self) -> Result<(), (String, f64)> {
        for _ in 0..BRANCHES {
            project(&self.mechanism, &mut self.kernel, &mut self.state, KEPT)?;
            if !self.follow()? {
                break;
            }
        }
        // Projected again, rates answer for the positions found.
        self.accelerate();
        let mechanism = &*self.mechanism;
        if let Some(r) = (0..mechanism.constraints.len()).find(|&r| self.kernel.is_left_out(r)) {
            let violation = self.kernel.rows[r].position.abs();
            if violation > 1e-9 * mechanism.units.length || self.alpha.iter().any(|a| !a.is_finite()) {
                return Err((mechanism.constraints[r].name().into(), violation));
            }
        }
        if self.alpha.iter().chain(&self.state.y).all(|x| x.is_finite()) {
            Ok(())
        } else {
            Err((mechanism.constraints[self.row].name().into(), f64::NAN))
        }
    }

    /// The largest rate, positions in units of length.
    fn fastest(&self) -> f64 {
        (0..self.alpha.len()).map(|k| self.pace(k)).fold(0.0, f64::max)
    }

    /// The largest rate of what G depends on.
    fn fastest_of_jacobian(&self) -> f64 {
        let in_jacobian = (0..self.alpha.len()).filter(|&k| self.is_in_jacobian[k]);
        in_jacobian.map(|k| self.pace(k)).fold(0.0, f64::max)
    }

    /// The rate of the drive, in its unit.
    fn drive_rate(&self) -> f64 {
        let is_angle = self.mechanism.constraints[self.row].is_angle();
        self.law[1].abs() / if is_angle { 1.0 } else { self.mechanism.units.length }
    }

    /// The largest rate where it is as elsewhere; beside a limit the drive's.
    fn usual_rate(&self) -> f64 {
        if self.is_beside_limit { self.drive_rate() } else { self.fastest() }
    }

    /// The coordinate of the largest rate; none where there are no coordinates.
    fn fastest_coordinate(&self) -> Option<usize> {
        (0..self.alpha.len()).max_by(|&a, &b| self.pace(a).total_cmp(&self.pace(b)))
    }

    /// The magnitude of the rate of coordinate `k`, of positions in units of length.
    fn pace(&self, k: usize) -> f64 {
        (self.omega(k) / self.size(k)).abs()
    }

    fn size(&self, k: usize) -> f64 {
        size(&self.mechanism, k)
    }

    /// Coordinate `k` with its turns.
    fn coordinate(&self, k: usize) -> f64 {
        coordinate(&self.state, k)
    }

    /// What another walk can go on from.
    pub fn solved(&self) -> SolvedPosition {
        let (orientation, position) = (self.orientation(), self.position());
        let (share, usual) = (self.share(), self.usual);
        SolvedPosition { state: self.state.clone(), usual, orientation, share, position }
    }

    /// Back to a position.
    pub(super) fn restore(&mut self, there: &SolvedPosition) {
        self.state.clone_from(&there.state);
        self.usual = there.usual;
        self.stand();
    }

    /// Goes to a time, in smaller steps where it must.
    ///
    /// # Errors
    /// The end of the range; this then stands as near to it as it came.
    pub fn go(&mut self, to: f64) -> Result<(), Limit> {
        let mut step = to - self.state.time.hi;
        let smallest = FOUND * step.abs().max(to.abs());
        let mut ends = Vec::new();
        let mut here = self.independence();
        while self.state.time.hi != to {
            let reach = self.reach(here.as_ref());
            let left = to - self.state.time.hi;
            step = step.clamp(-reach, reach);
            let next = if step.abs() >= left.abs() { to } else { self.state.time.hi + step };
            let end = self.end();
            if let Ok(there) = self.step(next, here.as_ref()) {
                ends.extend(end);
                here = there;
                step *= 2.0;
            } else if step.abs() <= smallest {
                return Err(self.limit(&ends));
            } else {
                step = 0.5 * (next - self.state.time.hi);
            }
        }
        self.usual = self.usual.max(self.usual_rate());
        Ok(())
    }

    /// How far off a fold is and when it comes, as the fastest coordinate q foretells it: t(q) is a parabola
    /// there, dt/dq = 1/q' and d²t/dq² = -q''/q'³, with its vertex at t + q'/(2 q'').  Nothing where a row is
    /// left out, and accelerations with it.
    fn end(&self) -> Option<[f64; 2]> {
        let is_known = || !(0..self.mechanism.constraints.len()).any(|r| self.kernel.is_left_out(r));
        if !self.is_beside_limit && !is_known() {
            return None;
        }
        let k = self.fastest_coordinate()?;
        let away = 0.5 * self.omega(k) / self.alpha[k];
        away.is_finite().then_some([away, self.state.time.hi + away])
    }

    /// The limit ahead: of two foretold ends that are wrong in proportion to the power 3/2 of the distance,
    /// the value at none.
    fn limit(&self, ends: &[[f64; 2]]) -> Limit {
        let is_fold = self.fastest() > STEEP * self.usual;
        let mut t = self.state.time.hi;
        if let (true, Some(&[away, end])) = (is_fold, ends.last()) {
            t = end;
            if let Some([before, other]) = ends.iter().rev().find(|one| one[0].abs() > 4.0 * away.abs()) {
                let ratio = (before / away).abs().powf(1.5);
                t = (ratio * end - other) / (ratio - 1.0);
            }
        }
        Limit { drive: self.law[0] + self.law[1] * t, in_line: self.in_line(NEARLY_IN_LINE), is_fold }
    }

    /// Where a function passes zero between two positions; this then stands there.
    pub fn root(&mut self, [from, to]: [&SolvedPosition; 2], of: impl Fn(&Self) -> f64) -> Option<Position> {
        let (mut below, mut above) = (from.clone(), to.clone());
        let value = |walk: &mut Self, at: &SolvedPosition| {
            walk.restore(at);
            of(walk)
        };
        let (mut low, mut high) = (value(self, &below), value(self, &above));
        if high == 0.0 {
            return Some(above.position);
        }
        let mut side = 0;
        for _ in 0..120 {
            let [a, b] = [below.state.time.hi, above.state.time.hi];
            if (b - a).abs() <= FOUND * a.abs().max(b.abs()) {
                break;
            }
            // The Illinois method, and bisection where it stays on one side.
            let share = low / (low - high);
            let share = if !(-2..=2).contains(&side) || !share.is_finite() {
                0.5
            } else {
                share.clamp(1e-9, 1.0 - 1e-9)
            };
            self.restore(&below);
            // Beside a crossing there may be no way to there; what is known of the place stays.
            if self.go(a + share * (b - a)).is_err() {
                break;
            }
            let value = of(self);
            if value == 0.0 {
                return Some(self.position());
            }
            let middle = self.solved();
            if value * low > 0.0 {
                (below, low, high) = (middle, value, if side > 0 { 0.5 * high } else { high });
                side = side.max(0) + 1;
            } else {
                (above, high, low) = (middle, value, if side < 0 { 0.5 * low } else { low });
                side = side.min(0) - 1;
            }
        }
        self.restore(&below);
        Some(below.position)
    }

    /// The drive's value.
    pub fn drive(&self) -> f64 {
        self.law[0] + self.law[1] * self.state.time.hi
    }

    /// Rate of a coordinate \[rad/s or m/s\].
    pub fn omega(&self, k: usize) -> f64 {
        self.state.y[self.alpha.len() + k]
    }

    /// Rates of all coordinates \[rad/s or m/s\].
    pub fn rates(&self) -> &[f64] {
        let n = self.alpha.len();
        &self.state.y[n..2 * n]
    }

    /// Unit vectors of the bodies, and what floats.
    pub fn unit_vectors(&self) -> &[Complex<f64>] {
        &self.kernel.z
    }

    /// The sign of det G, as a number; none where G is not square.
    pub fn orientation(&self) -> Option<f64> {
        let is_square = self.mechanism.constraints.len() == self.alpha.len();
        if is_square { determinant(&self.mechanism, &self.kernel) } else { None }
    }

    /// det G and its rate.
    fn independence(&mut self) -> Option<Independence> {
        let (n, fastest) = (self.alpha.len(), self.fastest_of_jacobian());
        let (mechanism, kernel, time) = (&*self.mechanism, &mut self.beside, self.state.time);
        let value = determinant(mechanism, &self.kernel)?;
        let (phi, omega) = self.state.y[..2 * n].split_at(n);
        Independence::new(value, fastest, |ahead| {
            let there: Vec<f64> = phi.iter().zip(omega).map(|(phi, omega)| phi + ahead * omega).collect();
            kernel.place(mechanism, &there);
            kernel.rows_at(mechanism, time, &there, omega);
            determinant(mechanism, kernel)
        })
    }

    /// Hinges at which two bodies are in line.
    pub fn in_line(&self, within: f64) -> Vec<String> {
        let at = |one: &&Transmission| one.angle(&self.kernel.z) < within;
        self.lines.iter().filter(at).map(|one| one.at.clone()).collect()
    }

    /// The drive's torque or force.
    fn force(&self) -> f64 {
        -self.kernel.multiplier[self.row]
    }

    fn outputs(&self) -> Vec<f64> {
        let n = self.alpha.len();
        let winding: Vec<f64> = (0..n).map(|k| self.coordinate(k)).collect();
        let (phi, omega) = self.state.y[..2 * n].split_at(n);
        let (mechanism, time, kernel) = (&*self.mechanism, self.state.time, &self.kernel);
        outputs_at(&Moment { mechanism, time, phi, winding: &winding, omega, kernel })
    }

    /// Drive's force, outputs, transmission angles: one of these.
    pub fn column(&self, column: usize) -> f64 {
        let outputs = self.mechanism.outputs.as_ref().map_or(0, |outputs| outputs.heads().count());
        match column {
            0 => self.force(),
            k if k <= outputs => self.outputs()[k - 1],
            k => self.transmissions[k - 1 - outputs].angle(&self.kernel.z),
        }
    }

    /// All there is to know.
    pub fn position(&self) -> Position {
        let n = self.alpha.len();
        Position {
            drive: self.drive(),
            t: self.state.time.hi,
            phi: (0..n).map(|k| self.coordinate(k)).collect(),
            omega: self.state.y[n..2 * n].to_vec(),
            alpha: self.alpha.clone(),
            force: self.force(),
            transmission: self.transmissions.iter().map(|one| one.angle(&self.kernel.z)).collect(),
            outputs: self.outputs(),
        }
    }
}

/// Coordinate `k` of a state with its turns.
fn coordinate(state: &State, k: usize) -> f64 {
    let turns = state.turns.get(k).map_or(0.0, |&turns| turns as f64);
    state.unknown(k).hi + std::f64::consts::TAU * turns
}

/// The values of a mechanism's outputs.
fn outputs_at(moment: &Moment) -> Vec<f64> {
    let mut values = Vec::new();
    if let Some(outputs) = &moment.mechanism.outputs {
        outputs.evaluate(moment, &mut OutputScratch::default(), &[], &mut values);
    }
    values
}
