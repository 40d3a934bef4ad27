//! The mechanism in natural coordinates: the unit vectors and translational coordinates themselves, with a
//! *constant* mass matrix.
//!
//! ```text
//! D z'' + Σ_k mu_k z_k + Σ_r lambda_r g_r = F(z)            [N m, N]   D = H + diag(I), Hermitian, constant
//! (|z_k|² - 1) / 2             = 0
//!     one row per body, gradient z_k; none for an origin
//! c + Σ g_k·z_k                = 0                          pins, lines of the ground, locked angles: linear
//! C(z, t)                      = 0
//!     slots, travels, motors, locked relative angles: module `guide`;
//!                                                           gears and cams: module `coupling`
//! W = D⁻¹ less the linear rows (module `reduced`),   S_pq = g_p·W g_q,   S mu = g·W F + convective terms,
//!     z'' = W (F - g mu)
//! ```
//!
//! No sine, no cosine and no velocity term but those of the rows; gravity is a constant force, a force f at a
//! point `Σ gamma_k z_k` acts on z_k as `conj(gamma_k) f`, a torque tau as `tau i z_k`.  Linear rows are
//! removed once per scene: a closed loop never enters the inner loop.  On the constraints every row has the
//! slope of its [`ConstraintEquation`] in angles, so its multiplier is the same.  Rows that depend on others
//! get the multiplier zero.
//!
//! Unknowns: z (2n numbers), z' (2n) \[1/s\] and, where there are motors or applied forces, p_t \[J\], the
//! momentum conjugate to time: p_t' = -Σ lambda C_t. Energy plus p_t, less what the constant forces have
//! done, is a first integral: p_t starts at zero and the work is known without a quadrature. None of the
//! unknowns is an angle: whole turns are counted by the method as a vector passes the negative x axis.
//!
//! Source: J. García de Jalón, E. Bayo, *Kinematic and Dynamic Simulation of Multibody Systems* (1994),
//! chapter 2, for natural coordinates.

pub mod columns;
pub mod coupling;
mod guide;
pub mod projection;
mod reduced;

use coupling::GuideCoupling;
pub use guide::{Demand, Guide};
pub use reduced::{Block, LinearRow, ReducedMatrices, times};

use super::constraint::{ConstraintArguments, ConstraintEquation, RowMeasure};
use super::force::action::Applied;
use super::law::Law;
use super::quadratic::Quadratic;
use super::{Form, Mechanism, Motion, State, Time};
use crate::arithmetic::{Complex, DoubleDouble, Scalar};
use std::sync::Arc;

/// The largest number of bodies; every step costs a factorization of a full matrix with a row per body and
/// guide.
pub const NATURAL_LIMIT: usize = 256;

/// Why a mechanism has no natural form.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NaturalError {
    /// Forces must not depend on velocities.
    #[error("spring `{0}` has a damper: the natural form is for forces that depend on positions only")]
    Damped(String),
    /// Angles are not among the unknowns.
    #[error("torsion spring `{0}`: the natural form has no angles to measure it by")]
    Torsion(String),
    /// Applied forces must be constant.
    #[error(
        "force or torque `{0}` follows a bar or a law of time: the natural form takes constant ones only"
    )]
    Applied(String),
    /// Formulas and forces from outside must be potentials.
    #[error(
        "force or torque `{0}` is not given by a potential of directions and positions: beside these the \
            natural form takes constant ones only"
    )]
    WithoutPotential(String),
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

/// A constant torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstantTorque {
    /// The body.
    pub body: usize,
    /// The body that takes the opposite.
    pub base: Option<usize>,
    /// \[N·m\].
    pub torque: f64,
}

/// Constants of the natural form.
#[derive(Clone, Debug)]
pub struct Natural {
    mechanism: Arc<Mechanism>,
    reduced: ReducedMatrices,
    guides: Vec<Guide>,
    couplings: Vec<GuideCoupling>,
    /// Gravity and constant forces on every element (n) \[N·m, N\].
    weight: Vec<Complex<f64>>,
    /// The share of the latter.
    applied: Vec<Complex<f64>>,
    torques: Vec<ConstantTorque>,
}

impl Natural {
    /// The natural form of a mechanism.
    ///
    /// # Errors
    /// Dampers, torsion springs, applied forces that are not constant, walls, bodies without inertia, or too
    /// many bodies.
    pub fn new(mechanism: Arc<Mechanism>) -> Result<Self, NaturalError> {
        let n = mechanism.bodies.len();
        if n > NATURAL_LIMIT || !mechanism.tree.is_dense() {
            return Err(NaturalError::TooMany(n));
        }
        if let Some(spring) = mechanism.springs.iter().find(|spring| spring.damping != 0.0) {
            return Err(NaturalError::Damped(spring.name.clone()));
        }
        if let Some(torsion) = mechanism.torsions.first() {
            return Err(NaturalError::Torsion(torsion.name.clone()));
        }
        if let Some(contact) = mechanism.contacts.first() {
            return Err(NaturalError::Wall(contact.row.name.clone()));
        }
        if let Some(force) = mechanism.forces.iter().find(|force| !force.is_potential_of_place()) {
            return Err(NaturalError::WithoutPotential(force.name.clone()));
        }
        let mut applied = vec![Complex::ZERO; mechanism.coordinates()];
        let mut torques = Vec::new();
        for action in &mechanism.actions {
            match &action.kind {
                Applied::Force { point, force, follows: false } if action.law.is_none() => {
                    point.spread(*force, |k, force| applied[k] += force);
                }
                Applied::Torque { torque, base } if action.law.is_none() => {
                    torques.push(ConstantTorque { body: action.body, base: *base, torque: *torque });
                }
                _ => return Err(NaturalError::Applied(action.name.clone())),
            }
        }
        let (linear, guides) = sorted_rows(&mechanism);
        let couplings = coupling::couplings(&mechanism, guides.iter().map(|guide| guide.row));
        let name = |body: usize| mechanism.bodies.get(body).map_or(String::new(), |body| body.name.clone());
        let reduced =
            ReducedMatrices::new(&mechanism, linear).map_err(|body| NaturalError::Singular(name(body)))?;
        let weight =
            mechanism.tree.weight.iter().zip(&applied).map(|(&weight, &applied)| weight + applied).collect();
        Ok(Self { mechanism, reduced, guides, couplings, weight, applied, torques })
    }

    /// W and what belongs to it.
    #[inline(always)]
    pub fn reduced(&self) -> &ReducedMatrices {
        &self.reduced
    }

    /// The rows that stay in the loop, beside one a body.
    #[inline(always)]
    pub fn guides(&self) -> &[Guide] {
        &self.guides
    }

    /// Those of them that a formula of time and place is taken off.
    #[inline(always)]
    pub fn couplings(&self) -> &[GuideCoupling] {
        &self.couplings
    }

    /// Number of elements n: bodies, and two for every origin that moves freely, of which the second is not
    /// used.
    pub fn elements(&self) -> usize {
        self.mechanism.coordinates()
    }

    /// Number of rows in the loop: one a body, then one a guide.
    pub fn rows(&self) -> usize {
        self.mechanism.bodies.len() + self.guides.len()
    }

    /// What a row in the loop keeps, for messages.
    pub fn row_name(&self, row: usize) -> String {
        let n = self.mechanism.bodies.len();
        if row < n {
            format!("unit length of {}", self.mechanism.bodies[row].name)
        } else {
            self.guides[row - n].name.clone()
        }
    }

    /// What an element is, for messages.
    pub fn element_name(&self, element: usize) -> String {
        match self.mechanism.bodies.get(element) {
            Some(body) => body.name.clone(),
            None => self.mechanism.coordinate_name(element),
        }
    }

    /// True where p_t is among the unknowns.
    pub fn has_work_integral(&self) -> bool {
        !self.guides.is_empty() || !self.mechanism.actions.is_empty()
    }

    /// Writes the applied force \[N·m, N\] on every element: gravity, constant forces and torques, springs.
    #[inline(always)]
    pub fn force<T: Scalar>(&self, z: &[Complex<T>], force: &mut [Complex<T>]) {
        for (force, &weight) in force.iter_mut().zip(&self.weight) {
            *force = Complex::of(weight);
        }
        for spring in &self.mechanism.springs {
            let pull = spring.elastic(z);
            spring.span.spread(pull, |k, pull| force[k] += pull);
        }
        for user in &self.mechanism.forces {
            user.spread(T::ZERO, ConstraintArguments { phi: &[], z, omega: &[] }, |k, pull| force[k] += pull);
        }
        for &ConstantTorque { body, base, torque } in &self.torques {
            force[body] += z[body].left().times(T::of(torque));
            if let Some(base) = base {
                force[base] -= z[base].left().times(T::of(torque));
            }
        }
    }

    /// Writes what pivots of S are measured against, row by row in the loop: Σ |g_k|² (D⁻¹)_kk.
    pub fn scales(&self, scales: &mut Vec<f64>) {
        let free = &self.reduced.free;
        scales.clear();
        scales.extend_from_slice(&free[..self.mechanism.bodies.len()]);
        scales.extend(self.guides.iter().map(|guide| guide.measure.scale(|k| free[k])));
        let guides = &mut scales[self.mechanism.bodies.len()..];
        for coupling in &self.couplings {
            guides[coupling.guide] += coupling.angles().iter().map(|&k| free[k]).sum::<f64>();
        }
    }

    /// z and z' of a state.
    fn vectors(&self, state: &State) -> (Vec<Complex<DoubleDouble>>, Vec<Complex<DoubleDouble>>) {
        let n = self.elements();
        let vector = |k: usize| Complex::new(state.unknown(2 * k), state.unknown(2 * k + 1));
        ((0..n).map(vector).collect(), (n..2 * n).map(vector).collect())
    }

    /// What constant forces and torques have done since all elements and angles were zero \[J\].
    fn done(&self, z: &[Complex<DoubleDouble>], motion: &Motion) -> DoubleDouble {
        let forces = self
            .applied
            .iter()
            .zip(z)
            .fold(DoubleDouble::ZERO, |sum, (&force, &z)| sum + Complex::of(force).dot(z));
        let whole = |k: usize| motion.phi[k] + DoubleDouble::TAU.scale(motion.turns[k] as f64);
        self.torques.iter().fold(forces, |sum, &ConstantTorque { body, base, torque }| {
            let angle = base.map_or(whole(body), |base| whole(body) - whole(base));
            sum + angle.scale(torque)
        })
    }
}

/// The rows of a mechanism that are linear with constant coefficients, and all others.
pub fn sorted_rows(mechanism: &Mechanism) -> (Vec<LinearRow>, Vec<Guide>) {
    let (mut linear, mut guides) = (Vec::new(), Vec::new());
    for (number, row) in mechanism.constraints.iter().enumerate() {
        match linear_place(row, mechanism.bodies.len()) {
            Some(place) => linear.push(LinearRow { row: number, place }),
            None => guides.push(Guide::new(number, row)),
        }
    }
    (linear, guides)
}

/// A row as a linear one with constant coefficients, where it is one.
fn linear_place(row: &ConstraintEquation, angles: usize) -> Option<Quadratic> {
    if row.aim.is_some() {
        return None;
    }
    let is_constant = row.law.as_ref().is_none_or(Law::is_constant);
    match (&row.measure, &row.law) {
        (&RowMeasure::Angle { body, base: None }, Some(law)) if is_constant => {
            let unit = law.at::<f64>(Time::default()).unit;
            Some(Quadratic { angles, linear: vec![(body, unit.left())], ..Quadratic::default() })
        }
        (RowMeasure::Place(place), law) if is_constant && place.bilinear.is_empty() => {
            let constant = place.constant - law.as_ref().map_or(0.0, |law| law.start);
            Some(Quadratic { constant, ..place.clone() })
        }
        _ => None,
    }
}

impl Form for Natural {
    fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    fn state(&self, motion: &Motion) -> State {
        let (n, bodies) = (self.elements(), self.mechanism.bodies.len());
        let mut z = vec![Complex::<DoubleDouble>::ZERO; n];
        let mut rate = z.clone();
        for k in 0..bodies {
            z[k] = Complex::unit(motion.phi[k]);
            rate[k] = z[k].left().times(motion.omega[k]);
        }
        for x in (bodies..n).step_by(2) {
            z[x] = Complex::new(motion.phi[x], motion.phi[x + 1]);
            rate[x] = Complex::new(motion.omega[x], motion.omega[x + 1]);
        }
        let mut unknowns: Vec<DoubleDouble> = z.iter().chain(&rate).flat_map(|x| [x.re, x.im]).collect();
        if self.has_work_integral() {
            unknowns.push(self.done(&z, motion) - motion.work);
        }
        let mut state = State::new(&unknowns, 0);
        state.time = motion.time;
        // An angle within rounding of ±π may come back with the other sign.
        let turn = |(k, &z): (usize, &Complex<DoubleDouble>)| {
            motion.turns[k]
                .saturating_add(((motion.phi[k] - angle(z)).hi / std::f64::consts::TAU).round() as i64)
        };
        state.turns = z.iter().take(bodies).enumerate().map(turn).collect();
        state
    }

    fn read(&mut self, state: &State, motion: &mut Motion) {
        let (n, bodies) = (self.elements(), self.mechanism.bodies.len());
        motion.resize(n);
        motion.time = state.time;
        motion.turns[..bodies].copy_from_slice(&state.turns);
        let (z, rate) = self.vectors(state);
        for k in 0..bodies {
            motion.phi[k] = angle(z[k]);
            motion.omega[k] = z[k].cross(rate[k]);
        }
        if self.mechanism.is_winding() {
            for (phi, turns) in motion.phi.iter_mut().zip(&mut motion.turns[..bodies]) {
                *phi += DoubleDouble::TAU.scale(std::mem::take(turns) as f64);
            }
        }
        for x in (bodies..n).step_by(2) {
            (motion.phi[x], motion.phi[x + 1]) = (z[x].re, z[x].im);
            (motion.omega[x], motion.omega[x + 1]) = (rate[x].re, rate[x].im);
        }
        motion.work = if self.has_work_integral() {
            self.done(&z, motion) - state.unknown(4 * n)
        } else {
            DoubleDouble::ZERO
        };
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
