//! Driven angles solved for: every body's angle is an independent coordinate, or known, or both.
//!
//! ```text
//! q = S u + s(t):   q_i = u_base(i) + Σ ± theta(t)
//! ```
//!
//! Motors connect angles like hinges connect points: within a group of bodies tied to one another one angle
//! is free, or none where the group is tied to the ground.

use super::compile::CompileError;
use super::constraint::{ConstraintEquation, RowMeasure};
use super::law::{Law, Phase};
use super::{Mechanism, Motion, State, Time};
use crate::arithmetic::{Complex, DoubleDouble, Real, Scalar, angle};

/// How one body's angle follows from the coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DependentAngle<C = f64> {
    /// The coordinate it moves with; `None`: driven from the ground.
    pub base: Option<usize>,
    /// Laws to be added, with their sign.
    pub laws: Vec<(f64, Law<C>)>,
}

impl DependentAngle {
    /// The known part s(t) of the angle: the sum of the laws, of which a single one keeps its own numbers to
    /// the last bit.
    #[inline]
    pub fn drive<T: Real>(&self, t: Time) -> Phase<T> {
        let sum =
            self.laws.iter().map(|(sign, law)| law.at::<T>(t).times(*sign)).reduce(|sum, phase| Phase {
                angle: angle::difference(sum.angle, -phase.angle),
                unit: sum.unit * phase.unit,
                rate: sum.rate + phase.rate,
                acceleration: sum.acceleration + phase.acceleration,
            });
        sum.unwrap_or(Phase { unit: Complex::new(T::ONE, T::ZERO), ..Phase::default() })
    }

    /// The unit vector of the body at coordinates `u` \[rad\].
    #[inline(always)]
    pub fn unit_vectors<T: Scalar>(&self, u: &[T], drive: &Phase<T>) -> Complex<T> {
        match self.base {
            Some(base) if self.laws.is_empty() => Complex::unit(u[base]),
            Some(base) => Complex::unit(u[base]) * drive.unit,
            None => drive.unit,
        }
    }

    /// The body's angle and unit vector at coordinates `u` \[rad\], s' and s''.
    #[inline(always)]
    pub fn place<T: Real>(&self, t: Time, u: &[T]) -> Phase<T> {
        match (self.base, &self.laws[..]) {
            (Some(base), []) => {
                Phase { angle: u[base], unit: Complex::unit(u[base]), rate: T::ZERO, acceleration: T::ZERO }
            }
            (None, [(sign, law)]) => law.at::<T>(t).times(*sign),
            _ => self.compose(t, u),
        }
    }

    /// Several angles, one upon another.
    fn compose<T: Real>(&self, t: Time, u: &[T]) -> Phase<T> {
        let drive = self.drive::<T>(t);
        let angle = self.base.map_or(drive.angle, |base| angle::difference(u[base], -drive.angle));
        Phase { angle, unit: self.unit_vectors(u, &drive), ..drive }
    }
}

/// All ties of a mechanism.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CoordinatePartition<C = f64> {
    /// Number of angles.
    pub angles: usize,
    /// One a body, then one a coordinate of an origin.
    pub bodies: Vec<DependentAngle<C>>,
    /// The body whose angle each independent coordinate is, or the coordinate of an origin.
    pub independent: Vec<usize>,
    /// How many rows it was made of, the first ones.
    given: usize,
}

impl<C> CoordinatePartition<C> {
    /// The same ties with other laws.
    pub(super) fn map<D>(&self, mut law: impl FnMut(&Law<C>) -> Law<D>) -> CoordinatePartition<D> {
        let body = |of: &DependentAngle<C>| DependentAngle {
            base: of.base,
            laws: of.laws.iter().map(|(sign, of)| (*sign, law(of))).collect(),
        };
        CoordinatePartition {
            angles: self.angles,
            bodies: self.bodies.iter().map(body).collect(),
            independent: self.independent.clone(),
            given: self.given,
        }
    }
}

impl<C: Real> CoordinatePartition<C> {
    /// Walks the given angles outwards from the ground and from the first body of every group left;
    /// translational coordinates are coordinates of their own.
    pub(super) fn new(
        bodies: usize,
        coordinates: usize,
        rows: &[ConstraintEquation<C>],
    ) -> Result<Self, CompileError> {
        let given: Vec<_> = (rows.iter())
            .filter_map(|row| match (&row.measure, &row.law) {
                (&RowMeasure::Angle { body, base }, Some(law)) => Some((row, body, base, law)),
                _ => None,
            })
            .collect();
        let mut at: Vec<Vec<usize>> = vec![Vec::new(); bodies + 1];
        let slot = |body: Option<usize>| body.map_or(0, |body| body + 1);
        for (g, &(_, body, base, _)) in given.iter().enumerate() {
            at[slot(base)].push(g);
            at[slot(Some(body))].push(g);
        }
        let mut partition: Vec<Option<DependentAngle<C>>> = vec![None; bodies];
        let mut used = vec![false; given.len()];
        let mut independent = Vec::new();
        for root in std::iter::once(None).chain((0..bodies).map(Some)) {
            if let Some(body) = root {
                if partition[body].is_some() {
                    continue;
                }
                partition[body] = Some(DependentAngle { base: Some(independent.len()), laws: Vec::new() });
                independent.push(body);
            }
            let mut front = vec![root];
            while let Some(near) = front.pop() {
                for &g in &at[slot(near)] {
                    let (row, body, base, law) = given[g];
                    if std::mem::replace(&mut used[g], true) {
                        continue;
                    }
                    let (far, sign) = if base == near { (Some(body), 1.0) } else { (base, -1.0) };
                    let Some(body) = far.filter(|&body| partition[body].is_none()) else {
                        return Err(CompileError::Redundant(row.name.clone()));
                    };
                    let mut dependent_angle =
                        near.and_then(|near| partition[near].clone()).unwrap_or_default();
                    dependent_angle.laws.push((sign, law.clone()));
                    partition[body] = Some(dependent_angle);
                    front.push(far);
                }
            }
        }
        let mut partition: Vec<DependentAngle<C>> =
            partition.into_iter().map(Option::unwrap_or_default).collect();
        for origin_point in bodies..coordinates {
            partition.push(DependentAngle { base: Some(independent.len()), laws: Vec::new() });
            independent.push(origin_point);
        }
        Ok(Self { angles: bodies, bodies: partition, independent, given: rows.len() })
    }

    /// Every angle and origin a coordinate of its own.
    pub fn free(mechanism: &Mechanism) -> Self {
        let n = mechanism.coordinates();
        let bodies = (0..n).map(|i| DependentAngle { base: Some(i), laws: Vec::new() }).collect();
        Self { angles: mechanism.bodies.len(), bodies, independent: (0..n).collect(), given: 0 }
    }

    /// The same with the laws that these rows have now.
    pub(super) fn renewed(&self, rows: &[ConstraintEquation<C>]) -> Result<Self, CompileError> {
        Self::new(self.angles, self.bodies.len(), &rows[..self.given])
    }

    /// How many of the independent coordinates are angles; they come first.
    pub fn turning(&self) -> usize {
        self.count() + self.angles - self.bodies.len()
    }

    /// Writes the translational coordinates, elements that follow from their coordinates alone.
    #[inline(always)]
    pub fn translations<T: Scalar>(&self, u: &[T], z: &mut [Complex<T>]) {
        for x in (self.angles..self.bodies.len()).step_by(2) {
            if let Some(base) = self.bodies[x].base {
                z[x] = Complex::new(u[base], u[base + 1]);
            }
        }
    }

    /// Number of independent coordinates.
    pub fn count(&self) -> usize {
        self.independent.len()
    }

    /// True where some angle is driven.
    pub fn driven(&self) -> bool {
        self.bodies.iter().any(|dependent_angle| !dependent_angle.laws.is_empty())
    }

    /// Adds S u' to `rate`: the rates \[rad/s\] of all bodies.
    #[inline(always)]
    pub fn spread<T: Scalar>(&self, u_rate: &[T], rate: &mut [T]) {
        for (rate, dependent_angle) in rate.iter_mut().zip(&self.bodies) {
            if let Some(base) = dependent_angle.base {
                *rate += u_rate[base];
            }
        }
    }

    /// Writes Sᵀ x.
    #[inline(always)]
    pub fn gather<T: Scalar>(&self, x: &[T], gathered: &mut [T]) {
        for entry in gathered.iter_mut() {
            *entry = T::ZERO;
        }
        for (&x, dependent_angle) in x.iter().zip(&self.bodies) {
            if let Some(base) = dependent_angle.base {
                gathered[base] += x;
            }
        }
    }

    /// Writes Sᵀ M S on and above the diagonal from M on and above its own.
    #[inline(always)]
    pub fn reduce<T: Scalar>(&self, mass: &[T], reduced: &mut [T]) {
        let (n, f) = (self.bodies.len(), self.count());
        reduced.fill(T::ZERO);
        for i in 0..n {
            let Some(a) = self.bodies[i].base else { continue };
            reduced[a * f + a] += mass[i * n + i];
            for j in i + 1..n {
                let Some(b) = self.bodies[j].base else { continue };
                let entry = &mut reduced[a.min(b) * f + a.max(b)];
                *entry += mass[i * n + j];
                if a == b {
                    *entry += mass[i * n + j];
                }
            }
        }
    }

    /// Rates u' \[rad/s\] of the coordinates in a motion.
    pub(super) fn coordinate_rates(&self, motion: &Motion) -> Vec<DoubleDouble> {
        self.independent.iter().map(|&body| motion.omega[body]).collect()
    }
}

impl CoordinatePartition {
    /// True where no driven angle accelerates.
    pub fn is_steady(&self) -> bool {
        self.bodies.iter().flat_map(|dependent_angle| &dependent_angle.laws).all(|(_, law)| law.is_steady())
    }

    /// Whole turns taken off each angle among the coordinates.
    pub(super) fn turns(&self, motion: &Motion) -> Vec<i64> {
        self.independent.iter().take(self.turning()).map(|&body| motion.turns[body]).collect()
    }

    /// Angles, turns and rates of all bodies, of a state of coordinates and their rates.
    pub(crate) fn read(&self, state: &State, motion: &mut Motion) {
        self.read_angles(state, motion);
        for (omega, dependent_angle) in motion.omega.iter_mut().zip(&self.bodies) {
            if let Some(base) = dependent_angle.base {
                *omega += state.unknown(self.count() + base);
            }
        }
    }

    /// Angles and turns of all bodies, and the driven share of their rates, in double-double.
    pub(super) fn read_angles(&self, state: &State, motion: &mut Motion) {
        motion.resize(self.bodies.len());
        motion.time = state.time;
        for (k, dependent_angle) in self.bodies.iter().enumerate() {
            (motion.phi[k], motion.omega[k], motion.turns[k]) = dependent_angle.read(state, k < self.angles);
        }
    }
}

impl DependentAngle {
    /// The body's angle, the driven share of its rate, and its turns.
    fn read(&self, state: &State, is_angle: bool) -> (DoubleDouble, DoubleDouble, i64) {
        let turns = |base: usize| if is_angle { state.turns[base] } else { 0 };
        let (base, turns) =
            self.base.map_or((DoubleDouble::ZERO, 0), |base| (state.unknown(base), turns(base)));
        match (self.base, &self.laws[..]) {
            (Some(_), []) => (base, DoubleDouble::ZERO, turns),
            (None, [(sign, law)]) => {
                let (angle, rate, turns) = law.winding(state.time);
                (angle.scale(*sign), rate.scale(*sign), (turns * sign) as i64)
            }
            _ => {
                let (mut angle, mut rate, mut winding) = (base, DoubleDouble::ZERO, base);
                for (sign, law) in &self.laws {
                    let (part, part_rate, _) = law.winding(state.time);
                    angle = angle::difference(angle, -part.scale(*sign));
                    rate += part_rate.scale(*sign);
                    winding += law.angle(state.time).scale(*sign);
                }
                let whole = ((winding.hi - angle::unwrapped(angle, 0)) / std::f64::consts::TAU).round();
                (angle, rate, turns.saturating_add(whole as i64))
            }
        }
    }
}
