//! One position after another: predicted from rates and accelerations, solved by projection.

use super::transmission::Transmission;
use super::{FOUND, KinematicsError, Limit, Position};
use crate::arithmetic::Scalar;
use crate::dynamics::kernel::{Bias, Kernel};
use crate::dynamics::output::Moment;
use crate::dynamics::{Mechanism, State, Time};
use crate::scene::Scene;
use crate::stabilization::projection::project;
use nalgebra::DMatrix;
use std::sync::Arc;

/// What a row may be off by, in its own size.
const KEPT: f64 = 1e-11;
/// The solution may differ from what was predicted by this \[rad, units of length\], and by this share of the
/// way there: else it may be on another branch.
const APART: [f64; 2] = [0.02, 0.1];
/// Rates that grew by more than this make a fold of the end of a range.
const STEEP: f64 = 1e3;
/// Bodies within this of one line are in line at a dead centre \[rad\].
pub(super) const IN_LINE: f64 = 1e-4;
/// The same at a limit, which is come near to only.
const NEARLY_IN_LINE: f64 = 1e-2;
/// Up to so many coordinates the sign of det G is watched.
const WATCHED: usize = 40;

/// A mechanism at a value of its drive.
#[derive(Clone)]
pub(super) struct Walk {
    mechanism: Arc<Mechanism>,
    kernel: Kernel<f64>,
    state: State,
    alpha: Vec<f64>,
    row: usize,
    /// The drive's value at t = 0, and its rate.
    law: [f64; 2],
    transmissions: Vec<Transmission>,
    /// The hinges between two bodies of two hinges each.
    lines: Vec<Transmission>,
    /// The largest rate there was.
    usual: f64,
}

impl Walk {
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
        let mut state = State::new(&unknowns, bodies);
        state.turns.clone_from(&start.turns);
        let mut walk = Self {
            mechanism: Arc::clone(mechanism),
            kernel: Kernel::new(mechanism),
            state,
            alpha: vec![0.0; n],
            row,
            law,
            transmissions: transmissions.to_vec(),
            lines: lines.to_vec(),
            usual: 0.0,
        };
        walk.settle().map_err(|(row, left)| KinematicsError::Start { row, left })?;
        walk.usual = walk.fastest();
        Ok(walk)
    }

    /// Solves the rows at both levels, then accelerations and multipliers.
    fn settle(&mut self) -> Result<(), (String, f64)> {
        let (mechanism, n) = (&*self.mechanism, self.alpha.len());
        project(mechanism, &mut self.kernel, &mut self.state, KEPT)?;
        // Projected again, rates answer for the positions found.
        let (phi, omega) = (&self.state.y[..n], &self.state.y[n..2 * n]);
        self.kernel.accelerate::<0>(mechanism, self.state.time, phi, omega, Bias::default());
        mechanism.spread_multipliers(&mut self.kernel);
        self.alpha.copy_from_slice(&self.kernel.load);
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
        (0..self.alpha.len()).map(|k| (self.omega(k) / self.size(k)).abs()).fold(0.0, f64::max)
    }

    fn size(&self, k: usize) -> f64 {
        if k < self.mechanism.bodies.len() { 1.0 } else { self.mechanism.units.length }
    }

    /// Coordinate `k` with its turns.
    fn coordinate(&self, k: usize) -> f64 {
        let turns = self.state.turns.get(k).map_or(0.0, |&turns| turns as f64);
        self.state.unknown(k).hi + std::f64::consts::TAU * turns
    }

    /// The step from here to another time, if the solution there is on this branch for certain.
    fn stepped(&self, t: f64) -> Option<Self> {
        let (n, h) = (self.alpha.len(), t - self.state.time.hi);
        let mut there = self.clone();
        there.state.time = Time::of(t);
        for k in 0..n {
            let (omega, alpha) = (self.state.y[n + k], self.alpha[k]);
            there.state.y[k] += h * (omega + 0.5 * h * alpha);
            there.state.y[n + k] += h * alpha;
        }
        there.state.low.fill(0.0);
        let predicted: Vec<f64> = (0..n).map(|k| there.coordinate(k)).collect();
        there.settle().ok()?;
        let (mut apart, mut way) = (0.0_f64, 0.0_f64);
        for (k, predicted) in predicted.iter().enumerate() {
            apart = apart.max((there.coordinate(k) - predicted).abs() / self.size(k));
            way = way.max((there.coordinate(k) - self.coordinate(k)).abs() / self.size(k));
        }
        (apart <= APART[0] && apart <= APART[1] * way + 1e-12).then_some(there)
    }

    /// Goes to a time, in smaller steps where it must.
    ///
    /// # Errors
    /// The end of the range; this then stands as near to it as it came.
    pub fn go(&mut self, to: f64) -> Result<(), Limit> {
        let mut step = to - self.state.time.hi;
        let smallest = FOUND * step.abs().max(to.abs());
        let mut ends = Vec::new();
        while self.state.time.hi != to {
            let left = to - self.state.time.hi;
            let next = if step.abs() >= left.abs() { to } else { self.state.time.hi + step };
            match self.stepped(next) {
                Some(there) => {
                    ends.extend(self.end());
                    *self = there;
                    step *= 2.0;
                }
                None if step.abs() <= smallest => return Err(self.limit(&ends)),
                None => step = 0.5 * (next - self.state.time.hi),
            }
        }
        self.usual = self.usual.max(self.fastest());
        Ok(())
    }

    /// How far off a fold is and when it comes, as the fastest coordinate q foretells it: t(q) is a parabola
    /// there, dt/dq = 1/q' and d²t/dq² = -q''/q'³, with its vertex at t + q'/(2 q'').  Nothing where a row is
    /// left out, and accelerations with it.
    fn end(&self) -> Option<[f64; 2]> {
        if (0..self.mechanism.constraints.len()).any(|r| self.kernel.is_left_out(r)) {
            return None;
        }
        let pace = |k: &usize| (self.omega(*k) / self.size(*k)).abs();
        let k = (0..self.alpha.len()).max_by(|a, b| pace(a).total_cmp(&pace(b)))?;
        let away = 0.5 * self.omega(k) / self.alpha[k];
        away.is_finite().then_some([away, self.state.time.hi + away])
    }

    /// The limit ahead: of two foretold ends that are wrong in proportion to the power 3/2 of the distance, the
    /// value at none.
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

    /// Where a function passes zero between here and another position.
    pub fn root(&self, other: &Self, of: impl Fn(&Self) -> f64) -> Option<Self> {
        let (mut below, mut above) = (self.clone(), other.clone());
        let (mut low, mut high) = (of(&below), of(&above));
        if high == 0.0 {
            return Some(above);
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
            let mut middle = below.clone();
            middle.go(a + share * (b - a)).ok()?;
            let value = of(&middle);
            if value == 0.0 {
                return Some(middle);
            }
            if value * low > 0.0 {
                (below, low, high) = (middle, value, if side > 0 { 0.5 * high } else { high });
                side = side.max(0) + 1;
            } else {
                (above, high, low) = (middle, value, if side < 0 { 0.5 * low } else { low });
                side = side.min(0) - 1;
            }
        }
        Some(below)
    }

    /// The drive's value.
    pub fn drive(&self) -> f64 {
        self.law[0] + self.law[1] * self.state.time.hi
    }

    /// Rate of a coordinate \[rad/s or m/s\].
    pub fn omega(&self, k: usize) -> f64 {
        self.state.y[self.alpha.len() + k]
    }

    /// True where all of it is as at another position, whole turns apart.
    pub fn is_as(&self, other: &Self) -> bool {
        (0..self.alpha.len()).all(|k| {
            let apart = self.coordinate(k) - other.coordinate(k);
            let turns = std::f64::consts::TAU;
            let apart =
                if k < self.mechanism.bodies.len() { apart - turns * (apart / turns).round() } else { apart };
            apart.abs() < 1e-9 * self.size(k)
        })
    }

    /// The sign of det G, as a number; none where G is not square.
    pub fn orientation(&self) -> Option<f64> {
        let n = self.alpha.len();
        let mechanism = &*self.mechanism;
        if mechanism.constraints.len() != n || n > WATCHED {
            return None;
        }
        let mut matrix = DMatrix::<f64>::zeros(n, n);
        for r in 0..n {
            self.kernel.fold_gradient(r, (), |(), k, g| matrix[(r, k)] = g * self.size(k));
        }
        Some(matrix.lu().determinant())
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
        let mut values = Vec::new();
        if let Some(outputs) = &self.mechanism.outputs {
            let n = self.alpha.len();
            let winding: Vec<f64> = (0..n).map(|k| self.coordinate(k)).collect();
            let moment = Moment {
                mechanism: &self.mechanism,
                time: self.state.time,
                phi: &self.state.y[..n],
                winding: &winding,
                omega: &self.state.y[n..2 * n],
                kernel: &self.kernel,
            };
            outputs.evaluate(&moment, &mut values);
        }
        values
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

/// The least value of a function over positions and between them, and the drive's value there.
pub(super) fn least(walks: &[Walk], of: &dyn Fn(&Walk) -> f64) -> Option<[f64; 2]> {
    let values: Vec<f64> = walks.iter().map(of).collect();
    let best = (0..values.len())
        .filter(|&k| values[k].is_finite())
        .min_by(|&a, &b| values[a].total_cmp(&values[b]))?;
    let mut found = [values[best], walks[best].drive()];
    let (from, to) = (&walks[best.saturating_sub(1)], &walks[(best + 1).min(walks.len() - 1)]);
    let (mut a, mut b) = (from.state.time.hi, to.state.time.hi);
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let at = |t: f64| {
        let mut walk = from.clone();
        walk.go(t).ok().map(|()| (of(&walk), walk.drive()))
    };
    let (mut left, mut right) = (b - golden * (b - a), a + golden * (b - a));
    let (Some(mut low), Some(mut high)) = (at(left), at(right)) else { return Some(found) };
    for _ in 0..40 {
        if low.0 < high.0 {
            (b, right, high) = (right, left, low);
            left = b - golden * (b - a);
            let Some(next) = at(left) else { break };
            low = next;
        } else {
            (a, left, low) = (left, right, high);
            right = a + golden * (b - a);
            let Some(next) = at(right) else { break };
            high = next;
        }
        for (value, drive) in [low, high] {
            if value < found[0] {
                found = [value, drive];
            }
        }
    }
    Some(found)
}
