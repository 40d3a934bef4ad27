//! Positions and rates that satisfy the rows: damped Gauss–Newton steps, each the shortest there is, finished
//! in double-double.
//!
//! ```text
//! position:  G dq = -C,             q += dq, halved until C shrinks
//! rates:     G dw = -(G w + C_t),   once
//! ```
//!
//! Coordinates that are held are left out of dq.  Angles are measured in radians and lengths in the size of
//! the mechanism, rows in their largest lever. Source: P. Deuflhard, *Newton Methods for Nonlinear Problems*
//! (2004), section 4.4.

use super::svd::{RowMatrix, dot};
use crate::arithmetic::{Complex, DoubleDouble, Real, Scalar};
use crate::dynamics::constraint::{ConstraintArguments, Linearised, RowMeasure};
use crate::dynamics::forest::BodyOrigin;
use crate::dynamics::{Mechanism, Time};

/// Singular values below this share of the largest move nothing.
const NOISE: f64 = 1e-9;
/// Share of the rates that are given below which what is left of them is rounding.
const GONE: f64 = 1e-25;
/// The longest step \[rad, or sizes of the mechanism\].
const LONGEST: f64 = 0.5;
/// After so many iterations coordinates on which the rows depend linearly go as far as they must.
const SHORT: usize = 60;
/// So many iterations are given to make the violations smaller.
const SLOW: usize = 4;
/// A row that is left by this is kept \[rad, or levers\].
pub const KEPT: f64 = 1e-13;

/// What the start is to be found from.
#[derive(Clone, Debug)]
pub struct AssemblyProblem<'a> {
    pub mechanism: &'a Mechanism,
    /// False for rows that keep an angle the start itself is to give.
    pub active: Vec<bool>,
    /// Size of the mechanism \[m\].
    pub size: f64,
    /// What each coordinate is measured in: 1 rad, or the size.
    pub unit: Vec<f64>,
    /// What each row is measured in: 1 rad, or its largest lever \[m\].
    pub lever: Vec<f64>,
    /// What is given.
    pub aims: Vec<GivenNumber>,
}

/// A number that the scene gives of the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenNumber {
    /// The bar.
    pub bar: usize,
    pub goal: Goal,
    /// The value \[rad or m\], or its rate.
    pub given: f64,
}

/// What an [`GivenNumber`] is of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// A coordinate.
    Coordinate(usize),
    /// The origin of a bar that hangs on another of a free group, along x or y.
    Origin(Complex<f64>),
}

impl AssemblyProblem<'_> {
    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.unit.len()
    }

    /// Elements at these coordinates.
    pub fn unit_vectors<T: Real>(&self, q: &[DoubleDouble]) -> (Vec<T>, Vec<Complex<T>>) {
        let angles = self.mechanism.bodies.len();
        // A gear counts whole turns.
        let is_whole = self.mechanism.has_aims();
        let phi: Vec<T> = q
            .iter()
            .enumerate()
            .map(|(k, &q)| T::split(if k < angles && !is_whole { q.reduced().0 } else { q }).0)
            .collect();
        let mut z = vec![Complex::ZERO; self.coordinates()];
        self.mechanism.tree.unit_vectors::<T, 0>(&phi, &mut z);
        (phi, z)
    }

    /// Shows the rows at t = 0 with their gradients, one after another; returns the elements.
    pub fn visit<T: Real>(
        &self,
        q: &[DoubleDouble],
        omega: &[T],
        mut see: impl FnMut(usize, Linearised<T>, &[T]),
    ) -> Vec<Complex<T>> {
        let (phi, z) = self.unit_vectors::<T>(q);
        let mut gradient = vec![T::ZERO; self.coordinates()];
        for (i, row) in self.mechanism.constraints.iter().enumerate() {
            gradient.fill(T::ZERO);
            let here = row.linearise(
                Time::default(),
                ConstraintArguments { phi: &phi, z: &z, omega },
                &mut gradient,
            );
            see(i, here, &gradient);
        }
        z
    }

    /// Coordinates that no held aim takes.
    pub fn columns(&self, held: &[bool]) -> Vec<usize> {
        let taken =
            |k: usize| self.aims.iter().zip(held).any(|(aim, &held)| held && aim.goal == Goal::Coordinate(k));
        (0..self.coordinates()).filter(|&k| !taken(k)).collect()
    }

    /// Every row's Jacobian in all coordinates, measured; rows that are not among `rows` come out zero.
    pub fn jacobian(&self, q: &[DoubleDouble], rows: &[bool]) -> RowMatrix {
        let n = self.coordinates();
        let mut matrix = RowMatrix::zero(self.mechanism.constraints.len(), n);
        self.visit::<f64>(q, &vec![0.0; n], |i, _, gradient| {
            if rows[i] {
                self.measure(gradient, self.lever[i], matrix.row_mut(i));
            }
        });
        matrix
    }

    fn measure(&self, gradient: &[f64], lever: f64, row: &mut [f64]) {
        for ((entry, g), unit) in row.iter_mut().zip(gradient).zip(&self.unit) {
            *entry = g * unit / lever;
        }
    }

    /// Value of an aim \[rad or m\], and its gradient, measured.
    pub fn aim<T: Real>(&self, aim: &GivenNumber, q: &[DoubleDouble], z: &[Complex<T>]) -> (T, Vec<f64>) {
        let n = self.coordinates();
        let mut row = vec![0.0; n];
        match aim.goal {
            Goal::Coordinate(k) => {
                row[k] = 1.0;
                (T::split(q[k]).0, row)
            }
            Goal::Origin(axis) => {
                let point = self.mechanism.end(aim.bar, 0).point;
                let mut gradient = vec![0.0; n];
                for &(k, gamma) in &point.terms {
                    let lever = z[k].turn(gamma).left();
                    gradient[k] = lever.re.value() * axis.re + lever.im.value() * axis.im;
                }
                for &(x, share) in &point.shifts {
                    (gradient[x], gradient[x + 1]) = (share * axis.re, share * axis.im);
                }
                self.measure(&gradient, self.size, &mut row);
                (Complex::of(axis).dot(point.position(z)), row)
            }
        }
    }

    /// Rate of an aim \[rad/s or m/s\].
    pub fn aim_rate(
        &self,
        aim: &GivenNumber,
        z: &[Complex<DoubleDouble>],
        omega: &[DoubleDouble],
    ) -> DoubleDouble {
        match aim.goal {
            Goal::Coordinate(k) => omega[k],
            Goal::Origin(axis) => {
                Complex::of(axis).dot(self.mechanism.end(aim.bar, 0).point.velocity(z, omega))
            }
        }
    }

    /// Measured violations of the rows that count and of held origins, and their Jacobian in the free
    /// columns.
    fn equations<T: Real>(
        &self,
        q: &[DoubleDouble],
        rows: &[bool],
        held: &[bool],
        columns: &[usize],
    ) -> (Vec<f64>, RowMatrix) {
        let n = self.coordinates();
        let (mut left, mut matrix) =
            (Vec::new(), RowMatrix { rows: 0, columns: columns.len(), entries: Vec::new() });
        let (mut plain, mut full) = (vec![0.0; n], vec![0.0; n]);
        let z = self.visit::<T>(q, &vec![T::ZERO; n], |i, here, gradient| {
            if rows[i] {
                left.push(here.position.value() / self.lever[i]);
                plain.iter_mut().zip(gradient).for_each(|(plain, g)| *plain = g.value());
                self.measure(&plain, self.lever[i], &mut full);
                matrix.push(&full, columns);
            }
        });
        for (aim, _) in
            self.aims.iter().zip(held).filter(|(aim, held)| **held && matches!(aim.goal, Goal::Origin(_)))
        {
            let (value, gradient) = self.aim(aim, q, &z);
            left.push((value - T::of(aim.given)).value() / self.size);
            matrix.push(&gradient, columns);
        }
        (left, matrix)
    }

    /// Brings the rows to zero as far as it goes, and returns what is left, measured.
    pub fn position(&self, q: &mut Vec<DoubleDouble>, rows: &[bool], held: &[bool]) -> f64 {
        self.descend(q, rows, held, 0.0)
    }

    /// The same, given up where [`SLOW`] iterations do not make the sum of squares smaller by a factor: on
    /// the way to a minimum that is not zero, where steps are many and lead nowhere.
    pub fn descend(&self, q: &mut Vec<DoubleDouble>, rows: &[bool], held: &[bool], factor: f64) -> f64 {
        let columns = self.columns(held);
        let (mut left, mut matrix) = self.equations::<f64>(q, rows, held, &columns);
        let mut before = [f64::INFINITY; SLOW];
        for iteration in 0..100 {
            if largest(&left) < 1e-15 || columns.is_empty() {
                break;
            }
            let sum = squares(&left);
            if std::mem::replace(&mut before[iteration % SLOW], sum) < factor * sum {
                break;
            }
            let mut step = matrix.solver(NOISE).solve(&left);
            let mut longest = largest(&step);
            step.iter_mut().zip(&columns).for_each(|(step, &k)| *step *= self.unit[k]);
            if longest > LONGEST && iteration >= SHORT {
                let far = self.equations::<f64>(&moved(q, &step, &columns, 1.0), rows, held, &columns).1;
                let turned = (0..columns.len()).filter(|&c| !matrix.has_same_column(&far, c));
                longest = turned.fold(0.0, |most, c| most.max((step[c] / self.unit[columns[c]]).abs()));
            }
            let mut share = if longest > LONGEST { LONGEST / longest } else { 1.0 };
            let mut better = None;
            for _ in 0..12 {
                let trial = moved(q, &step, &columns, share);
                let there = self.equations::<f64>(&trial, rows, held, &columns);
                if squares(&there.0) < squares(&left) * (1.0 - 1e-4 * share) {
                    better = Some((trial, there));
                    break;
                }
                share *= 0.5;
            }
            let Some((trial, there)) = better else { break };
            *q = trial;
            (left, matrix) = there;
        }
        largest(&left)
    }

    /// Slides along the rows to the start that is nearest to `target`, `q - target = -Gᵀ mu`: the steps to
    /// the rows are short, but not their sum.
    pub fn nearest(&self, q: &mut Vec<DoubleDouble>, target: &[DoubleDouble]) {
        let none = vec![false; self.aims.len()];
        let columns = self.columns(&none);
        let mut trial = q.clone();
        let mut before = f64::INFINITY;
        for _ in 0..50 {
            let (left, matrix) = self.equations::<f64>(&trial, &self.active, &none, &columns);
            let away: Vec<f64> = (target.iter().zip(&trial))
                .zip(&self.unit)
                .map(|((&target, &q), unit)| (target - q).hi / unit)
                .collect();
            let sum: Vec<f64> =
                left.iter().enumerate().map(|(i, left)| left + dot(matrix.row(i), &away)).collect();
            let mut step = matrix.solver(NOISE).solve(&sum);
            step.iter_mut().zip(&self.unit).for_each(|(step, unit)| *step *= unit);
            let next = moved(target, &step, &columns, 1.0);
            let moves: Vec<f64> = (next.iter().zip(&trial))
                .zip(&self.unit)
                .map(|((&next, &q), unit)| (next - q).hi / unit)
                .collect();
            let change = largest(&moves);
            if change.is_nan() || change > before {
                break;
            }
            (trial, before) = (next, change);
            if change < 1e-14 {
                break;
            }
        }
        if before < 1e-8 && self.finish(&mut trial, &self.active, &none) < KEPT {
            *q = trial;
        }
    }

    /// Closes what a plain double leaves; returns what is left then, measured.
    pub fn finish(&self, q: &mut Vec<DoubleDouble>, rows: &[bool], held: &[bool]) -> f64 {
        let columns = self.columns(held);
        let (mut left, mut matrix) = self.equations::<DoubleDouble>(q, rows, held, &columns);
        for _ in 0..6 {
            if largest(&left) < 1e-30 || columns.is_empty() {
                break;
            }
            let mut step = matrix.solver(NOISE).solve(&left);
            step.iter_mut().zip(&columns).for_each(|(step, &k)| *step *= self.unit[k]);
            let trial = moved(q, &step, &columns, 1.0);
            let there = self.equations::<DoubleDouble>(&trial, rows, held, &columns);
            if squares(&there.0) >= squares(&left) {
                break;
            }
            *q = trial;
            (left, matrix) = there;
        }
        largest(&left)
    }

    /// The row that is off most: its number and by how much \[rad or m\].
    pub fn worst(&self, q: &[DoubleDouble]) -> (usize, f64) {
        let mut worst = (0, 0.0, -1.0);
        self.visit::<f64>(q, &vec![0.0; self.coordinates()], |i, here, _| {
            let (off, measured) = (here.position.abs(), here.position.abs() / self.lever[i]);
            if self.active[i] && measured > worst.2 {
                worst = (i, off, measured);
            }
        });
        (worst.0, worst.1)
    }

    /// Changes the rates that are not held, as little as may be, so that all rows keep; returns what is left,
    /// measured, relative to the rates.
    pub fn rates(
        &self,
        q: &[DoubleDouble],
        omega: &mut [DoubleDouble],
        aims: &[GivenNumber],
        held: &[bool],
    ) -> f64 {
        let columns = AssemblyProblem { aims: aims.to_vec(), ..self.clone() }.columns(held);
        let rates = |omega: &[DoubleDouble]| {
            omega
                .iter()
                .zip(&self.unit)
                .fold(0.0, |most: f64, (omega, unit)| most.max((omega.hi / unit).abs()))
        };
        let guessed = rates(omega);
        let mut matrix = RowMatrix { rows: 0, columns: columns.len(), entries: Vec::new() };
        let mut full = vec![0.0; self.coordinates()];
        let z = self.visit::<f64>(q, &vec![0.0; self.coordinates()], |i, _, gradient| {
            self.measure(gradient, self.lever[i], &mut full);
            matrix.push(&full, &columns);
        });
        let origins = || {
            aims.iter()
                .zip(held)
                .filter(|(aim, held)| **held && matches!(aim.goal, Goal::Origin(_)))
                .map(|(aim, _)| aim)
        };
        origins().for_each(|aim| matrix.push(&self.aim(aim, q, &z).1, &columns));
        let solver = matrix.solver(NOISE);
        let left = |omega: &[DoubleDouble]| {
            let mut left: Vec<f64> =
                self.slips(q, omega).iter().zip(&self.lever).map(|(slip, lever)| slip / lever).collect();
            let z = self.unit_vectors::<DoubleDouble>(q).1;
            left.extend(
                origins()
                    .map(|aim| (self.aim_rate(aim, &z, omega) - DoubleDouble::of(aim.given)).hi / self.size),
            );
            left
        };
        let mut now = left(omega);
        for _ in 0..6 {
            let step = solver.solve(&now);
            let mut trial = omega.to_vec();
            for (step, &k) in step.iter().zip(&columns) {
                trial[k] -= DoubleDouble::of(step * self.unit[k]);
            }
            let there = left(&trial);
            if squares(&there) >= squares(&now) {
                break;
            }
            omega.copy_from_slice(&trial);
            now = there;
        }
        // Of rates that constraints leave no room for, nothing but rounding is left.
        if rates(omega) <= GONE * guessed {
            let resting = vec![DoubleDouble::ZERO; omega.len()];
            let there = left(&resting);
            if squares(&there) <= squares(&now) {
                omega.copy_from_slice(&resting);
                now = there;
            }
        }
        let (left, fastest) = (largest(&now), guessed.max(rates(omega)));
        if left > 0.0 { left / fastest } else { left }
    }

    /// C' = G w + C_t of every row \[rad/s or m/s\].
    pub fn slips(&self, q: &[DoubleDouble], omega: &[DoubleDouble]) -> Vec<f64> {
        let mut slips = Vec::with_capacity(self.mechanism.constraints.len());
        self.visit::<DoubleDouble>(q, omega, |_, here, gradient| {
            slips.push(gradient.iter().zip(omega).fold(here.drive, |sum, (&g, &w)| sum + g * w).hi);
        });
        slips
    }
}

/// The largest lever of a row \[m\], translational coordinates counted with the size of the mechanism; 1 rad
/// for an angle.
pub fn lever(measure: &RowMeasure, size: f64) -> f64 {
    let RowMeasure::Place(place) = measure else { return 1.0 };
    let length =
        |k: usize, g: &Complex<f64>| g.norm_squared().sqrt() * if k < place.angles { 1.0 } else { size };
    let linear = place.linear.iter().map(|(k, g)| length(*k, g));
    let bilinear = place.bilinear.iter().map(|(_, k, h)| length(*k, h));
    let most = linear.chain(bilinear).fold(0.0, f64::max);
    if most > 0.0 { most } else { size }
}

impl RowMatrix {
    fn push(&mut self, full: &[f64], columns: &[usize]) {
        self.entries.extend(columns.iter().map(|&k| full[k]));
        self.rows += 1;
    }
}

fn moved(q: &[DoubleDouble], step: &[f64], columns: &[usize], share: f64) -> Vec<DoubleDouble> {
    let mut moved = q.to_vec();
    for (step, &k) in step.iter().zip(columns) {
        moved[k] -= DoubleDouble::of(step * share);
    }
    moved
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most: f64, value| most.max(value.abs()))
}

fn squares(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}

/// The aims at the origin of a bar, or at its velocity.
pub(super) fn of_origin(mechanism: &Mechanism, bar: usize, [x, y]: [f64; 2]) -> [GivenNumber; 2] {
    match mechanism.forest.hangs[bar].origin_point {
        BodyOrigin::Free(k) => {
            [(k, x), (k + 1, y)].map(|(k, given)| GivenNumber { bar, goal: Goal::Coordinate(k), given })
        }
        _ => [(Complex::new(1.0, 0.0), x), (Complex::new(0.0, 1.0), y)].map(|(axis, given)| GivenNumber {
            bar,
            goal: Goal::Origin(axis),
            given,
        }),
    }
}
