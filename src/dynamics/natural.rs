//! The mechanism in natural coordinates: the unit vectors themselves, with a *constant* mass matrix.
//!
//! ```text
//! D z'' + Σ_k mu_k z_k + Σ_r lambda_r g_r = F(z)            [N m]   D = H + diag(I), Hermitian, constant
//! (|z_k|² - 1) / 2             = 0                          one row per body, gradient z_k
//! Im(conj(u) z_a)              = 0,  u = exp(i theta(t))    a motor from the ground, gradient i u
//! Im(conj(u) z_a conj(z_b))    = 0                          a motor between bodies, gradients i u z_b and -i conj(u) z_a
//! W = D⁻¹,   S_pq = Re(conj(g_p) W g_q),   S mu = Re(conj(g) W F) + convective terms,   z'' = W (F - g mu)
//! ```
//!
//! No sine, no cosine and no velocity term but those of the rows; gravity is a constant force, a force f at a point `Σ gamma_k z_k` acts on
//! z_k as `conj(gamma_k) f`.  On the constraints a motor's row has the slope of the angle row `q_a - q_b - theta`, so its multiplier is the
//! same: minus the torque.
//!
//! Unknowns: z (2n numbers), z' (2n) \[1/s\] and, where there are motors, p_t \[J\], the momentum conjugate to time: p_t' = -Σ lambda C_t.
//! Energy plus p_t is a first integral, so p_t starts at zero and the work done by the motors is -p_t, without a quadrature.  None of the
//! unknowns is an angle: whole turns are counted by the method as a vector passes the negative x axis.
//!
//! Source: J. García de Jalón, E. Bayo, *Kinematic and Dynamic Simulation of Multibody Systems* (1994), chapter 2, for natural coordinates.

use super::law::Law;
use super::row::Measure;
use super::{Form, Mechanism, Motion, State, Time, tree};
use crate::arithmetic::{Complex, DoubleDouble, Scalar};
use std::sync::Arc;

/// The largest number of bodies; every step costs a factorization of a full matrix with a row per body and motor.
pub const NATURAL_LIMIT: usize = 256;

/// Why a mechanism has no natural form.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NaturalError {
    /// Forces must not depend on velocities.
    #[error("spring `{0}` has a damper: the natural form is for forces that depend on positions only")]
    Damped(String),
    /// Impacts are not handled.
    #[error("wall `{0}`: the natural form has no impacts")]
    Wall(String),
    /// The constant mass matrix is singular.
    #[error("bar `{0}` has no inertia of its own: the constant mass matrix of the natural form is singular")]
    Singular(String),
    /// Too many bodies for full matrices.
    #[error("{0} bodies; the natural form takes at most {NATURAL_LIMIT}")]
    TooMany(usize),
}

/// A motor or lock as a row of the unit vectors.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive {
    /// Name of the row.
    pub name: String,
    /// The driven body a.
    pub body: usize,
    /// The body b its angle is measured from; `None`: from +x.
    pub base: Option<usize>,
    /// theta(t).
    pub law: Law,
}

impl Drive {
    /// `conj(u) z_a conj(z_b)`: 1 where the row is kept; C is its imaginary part.
    #[inline(always)]
    pub fn mismatch<T: Scalar>(&self, unit: Complex<T>, z: &[Complex<T>]) -> Complex<T> {
        let direct = unit.conj() * z[self.body];
        self.base.map_or(direct, |base| direct * z[base].conj())
    }

    /// Derivative of [`Drive::mismatch`] along `rate` at fixed u.
    #[inline(always)]
    pub fn slip<T: Scalar>(&self, unit: Complex<T>, z: &[Complex<T>], rate: &[Complex<T>]) -> Complex<T> {
        match self.base {
            None => unit.conj() * rate[self.body],
            Some(base) => unit.conj() * (rate[self.body] * z[base].conj() + z[self.body] * rate[base].conj()),
        }
    }

    /// Gradients of C on z_a and z_b; the second is zero where there is no b.
    #[inline(always)]
    pub fn gradient<T: Scalar>(&self, unit: Complex<T>, z: &[Complex<T>]) -> [Complex<T>; 2] {
        match self.base {
            None => [unit.left(), Complex::ZERO],
            Some(base) => [(unit * z[base]).left(), -(unit.conj() * z[self.body]).left()],
        }
    }

    /// Both bodies; a stands for the second where there is no b.
    #[inline(always)]
    pub fn bodies(&self) -> [usize; 2] {
        [self.body, self.base.unwrap_or(self.body)]
    }
}

/// How far a state is from its constraints.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Defect {
    /// Largest of the |z_k|² - 1 and of the motors' C \[rad\].
    pub position: f64,
    /// Largest rate of these \[1/s\].
    pub velocity: f64,
}

/// Constants of the natural form.
#[derive(Clone, Debug)]
pub struct Natural {
    mechanism: Arc<Mechanism>,
    /// W (n × n), Hermitian to the last bit \[1/(kg·m²)\].
    inverse: Vec<Complex<f64>>,
    drives: Vec<Drive>,
}

impl Natural {
    /// The natural form of a mechanism.
    ///
    /// # Errors
    /// Dampers, walls, bodies without inertia, or too many bodies.
    pub fn new(mechanism: Arc<Mechanism>) -> Result<Self, NaturalError> {
        let n = mechanism.bodies.len();
        if n > NATURAL_LIMIT {
            return Err(NaturalError::TooMany(n));
        }
        if let Some(spring) = mechanism.springs.iter().find(|spring| spring.damping != 0.0) {
            return Err(NaturalError::Damped(spring.name.clone()));
        }
        if let Some(contact) = mechanism.contacts.first() {
            return Err(NaturalError::Wall(contact.row.name.clone()));
        }
        let mut drives = Vec::new();
        for row in &mechanism.rows {
            match (&row.measure, &row.law) {
                (&Measure::Angle { body, base }, Some(law)) => {
                    drives.push(Drive { name: row.name.clone(), body, base, law: law.clone() });
                }
                _ => return Err(NaturalError::Wall(row.name.clone())),
            }
        }
        let inverse = invert(&mechanism).map_err(|body| NaturalError::Singular(mechanism.bodies[body].name.clone()))?;
        Ok(Self { mechanism, inverse, drives })
    }

    /// W row by row (n × n) \[1/(kg·m²)\]: the inverse of the mass matrix, formed in double-double and rounded once, Hermitian to the last
    /// bit.  A rounded W is the exact inverse of some mass matrix 1e-16 away, so it shifts energies by 1e-16 of themselves but makes none.
    pub fn inverse(&self) -> &[Complex<f64>] {
        &self.inverse
    }

    /// The motors.
    pub fn drives(&self) -> &[Drive] {
        &self.drives
    }

    /// Number of rows: one a body, then one a motor.
    pub fn rows(&self) -> usize {
        self.mechanism.bodies.len() + self.drives.len()
    }

    /// What a row keeps, for messages.
    pub fn row_name(&self, row: usize) -> String {
        let n = self.mechanism.bodies.len();
        if row < n { format!("unit length of {}", self.mechanism.bodies[row].name) } else { self.drives[row - n].name.clone() }
    }

    /// Writes the applied force \[N·m\] on every unit vector: gravity and springs.
    #[inline(always)]
    pub fn force<T: Scalar>(&self, z: &[Complex<T>], force: &mut [Complex<T>]) {
        for (force, &weight) in force.iter_mut().zip(&self.mechanism.tree.weight) {
            *force = Complex::of(weight);
        }
        for spring in &self.mechanism.springs {
            let pull = spring.elastic(z);
            spring.span.spread(pull, |k, pull| force[k] += pull);
        }
    }

    /// z'' \[1/s²\] and the multipliers \[N·m\] (one a body, then one a motor) at unit vectors `z` with rates `rate` \[1/s\].
    pub fn accelerations(&self, t: Time, z: &[Complex<f64>], rate: &[Complex<f64>]) -> (Vec<Complex<f64>>, Vec<f64>) {
        let (n, rows) = (z.len(), self.rows());
        let mut acceleration = vec![Complex::ZERO; n];
        self.force(z, &mut acceleration);
        let mut gradients = vec![vec![Complex::ZERO; n]; rows];
        let mut multiplier = vec![0.0; rows];
        for k in 0..n {
            gradients[k][k] = z[k];
            multiplier[k] = rate[k].norm_squared();
        }
        for (r, drive) in self.drives.iter().enumerate() {
            let phase = drive.law.at::<f64>(t);
            let [on_body, on_base] = drive.gradient(phase.unit, z);
            let [a, b] = drive.bodies();
            gradients[n + r][a] += on_body;
            gradients[n + r][b] += on_base;
            // u' = i theta' u and u'' = (i theta'' - theta'²) u, conjugated.
            let first = Complex::new(0.0, -phase.rate);
            let second = Complex::new(-phase.rate * phase.rate, -phase.acceleration);
            let cross = drive.base.map_or(Complex::ZERO, |base| phase.unit.conj() * rate[a] * rate[base].conj());
            let moving = (first * drive.slip(phase.unit, z, rate) + cross).times(2.0);
            multiplier[n + r] = (moving + second * drive.mismatch(phase.unit, z)).im;
        }
        let free = self.spread(&acceleration);
        let lifted: Vec<Vec<Complex<f64>>> = gradients.iter().map(|gradient| self.spread(gradient)).collect();
        let mut schur = vec![0.0; rows * rows];
        for p in 0..rows {
            for q in p..rows {
                schur[p * rows + q] = dot(&gradients[p], &lifted[q]);
            }
            multiplier[p] += dot(&gradients[p], &free);
        }
        let mut pivot = vec![0.0; rows];
        tree::factor::<f64, 0>(rows, &mut schur, &mut pivot);
        tree::solve::<f64, 0>(rows, &schur, &pivot, &mut multiplier);
        for k in 0..n {
            acceleration[k] = (0..rows).fold(free[k], |sum, p| sum - lifted[p][k].times(multiplier[p]));
        }
        (acceleration, multiplier)
    }

    /// How far a state is from its constraints, in double-double.
    pub fn defect(&self, state: &State) -> Defect {
        let (z, rate) = self.vectors(state);
        let mut defect = Defect::default();
        let mut see = |position: DoubleDouble, velocity: DoubleDouble| {
            // Unlike `max`, this does not lose a not-a-number.
            let larger = |a: f64, b: f64| if a > b || a.is_nan() { a } else { b };
            defect.position = larger(position.hi.abs(), defect.position);
            defect.velocity = larger(velocity.hi.abs(), defect.velocity);
        };
        for (z, rate) in z.iter().zip(&rate) {
            see(z.norm_squared() + -1.0, z.dot(*rate).ldexp(2.0));
        }
        for drive in &self.drives {
            let phase = drive.law.at::<DoubleDouble>(state.time);
            let mismatch = drive.mismatch(phase.unit, &z);
            see(mismatch.im, drive.slip(phase.unit, &z, &rate).im - phase.rate * mismatch.re);
        }
        defect
    }

    /// z and z' of a state.
    fn vectors(&self, state: &State) -> (Vec<Complex<DoubleDouble>>, Vec<Complex<DoubleDouble>>) {
        let n = self.mechanism.bodies.len();
        let vector = |k: usize| Complex::new(state.unknown(2 * k), state.unknown(2 * k + 1));
        ((0..n).map(vector).collect(), (n..2 * n).map(vector).collect())
    }

    /// W x.
    fn spread(&self, x: &[Complex<f64>]) -> Vec<Complex<f64>> {
        self.inverse.chunks(x.len()).map(|row| row.iter().zip(x).fold(Complex::ZERO, |sum, (&w, &x)| sum + w * x)).collect()
    }
}

impl Form for Natural {
    fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    fn state(&self, motion: &Motion) -> State {
        let z: Vec<Complex<DoubleDouble>> = motion.phi.iter().map(|&phi| Complex::unit(phi)).collect();
        let rate = z.iter().zip(&motion.omega).map(|(z, &omega)| z.left().times(omega));
        let mut unknowns: Vec<DoubleDouble> = z.iter().copied().chain(rate).flat_map(|x| [x.re, x.im]).collect();
        if !self.drives.is_empty() {
            unknowns.push(-motion.work);
        }
        let mut state = State::new(&unknowns, 0);
        state.time = motion.time;
        // An angle within rounding of ±π may come back with the other sign.
        let turn = |(k, &z): (usize, &Complex<DoubleDouble>)| {
            motion.turns[k] + ((motion.phi[k] - angle(z)).hi / std::f64::consts::TAU).round() as i64
        };
        state.turns = z.iter().enumerate().map(turn).collect();
        state
    }

    fn read(&mut self, state: &State, motion: &mut Motion) {
        let n = self.mechanism.bodies.len();
        motion.resize(n);
        motion.time = state.time;
        motion.turns.copy_from_slice(&state.turns);
        for k in 0..n {
            let vector = |k: usize| Complex::new(state.unknown(2 * k), state.unknown(2 * k + 1));
            let (z, rate) = (vector(k), vector(n + k));
            motion.phi[k] = angle(z);
            motion.omega[k] = z.cross(rate);
        }
        motion.work = if self.drives.is_empty() { DoubleDouble::ZERO } else { -state.unknown(4 * n) };
    }
}

/// True where the angle of `z` counts as not negative; what tells the two sides of the negative x axis apart.
#[inline(always)]
pub fn upper(z: Complex<DoubleDouble>) -> bool {
    z.im.hi >= 0.0
}

/// Angle of a unit vector \[rad\], in [-π, π] and of the sign that [`upper`] tells; to about 1e-31 rad.
fn angle(z: Complex<DoubleDouble>) -> DoubleDouble {
    // -0 becomes +0, so that the angle on the negative x axis is +π.
    let near = DoubleDouble::of(libm::atan2(z.im.hi + 0.0, z.re.hi));
    // The rest is about 1e-16, so its sine is the rest itself.
    near + Complex::unit(near).cross(z)
}

/// Real part of Σ conj(a_k) b_k.
fn dot(a: &[Complex<f64>], b: &[Complex<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

/// W = D⁻¹ from D = L P Lᴴ in double-double, rounded once; the error is the body whose pivot vanishes.
fn invert(mechanism: &Mechanism) -> Result<Vec<Complex<f64>>, usize> {
    let n = mechanism.bodies.len();
    let at = |i: usize, j: usize| i * n + j;
    // Below the diagonal D is the conjugate of what the tree stores above it.
    let mut lower: Vec<Complex<DoubleDouble>> = vec![Complex::ZERO; n * n];
    let mut pivot = vec![DoubleDouble::ZERO; n];
    for j in 0..n {
        for i in j..n {
            let mut entry = match i == j {
                true => Complex::of(Complex::new(mechanism.tree.diagonal[i], 0.0)),
                false => Complex::of(mechanism.tree.coupling[at(j, i)].conj()),
            };
            for k in 0..j {
                entry -= (lower[at(i, k)] * lower[at(j, k)].conj()).times(pivot[k]);
            }
            if i == j {
                pivot[j] = entry.re;
                if pivot[j].hi <= 1e-13 * mechanism.tree.diagonal[j] {
                    return Err(j);
                }
                lower[at(j, j)] = Complex::new(DoubleDouble::ONE, DoubleDouble::ZERO);
            } else {
                lower[at(i, j)] = entry.times(DoubleDouble::ONE / pivot[j]);
            }
        }
    }
    let mut inverse = vec![Complex::ZERO; n * n];
    let mut column = vec![Complex::<DoubleDouble>::ZERO; n];
    for j in 0..n {
        column.fill(Complex::ZERO);
        column[j].re = DoubleDouble::ONE;
        for i in j..n {
            for k in j..i {
                let part = lower[at(i, k)] * column[k];
                column[i] -= part;
            }
        }
        for i in (j..n).rev() {
            column[i] = column[i].times(DoubleDouble::ONE / pivot[i]);
            for k in i + 1..n {
                let part = lower[at(k, i)].conj() * column[k];
                column[i] -= part;
            }
        }
        inverse[at(j, j)] = Complex::new(column[j].re.hi, 0.0);
        for i in j + 1..n {
            inverse[at(i, j)] = Complex::new(column[i].re.hi, column[i].im.hi);
            inverse[at(j, i)] = inverse[at(i, j)].conj();
        }
    }
    Ok(inverse)
}
