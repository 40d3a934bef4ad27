//! Dry friction by Coulomb's law in hinges, sliders and at walls.
//!
//! ```text
//! M a + Gᵀ lambda + Dᵀ tau = b,   G a = -gamma     D: rows of the relative displacements s
//! sliding   tau_j = sign(s_j') mu_j r_j N_j         N_j: |force of the joint|, |lambda| of a rail, pressure
//! sticking  D_j a = -gamma_j                        as long as |tau_j| <= mu0_j r_j N_j
//! ```
//!
//! N depends on the accelerations, and these on tau: all of it is one system.  Accelerations, multipliers and
//! with them the forces R of joints are affine in tau, `R_j = R_j0 + Σ R_jk tau_k`, so that what is left are
//! as many equations as there are places that slide, solved by Newton's method from `tau = 0`; of rails and
//! walls they are linear.  Sticking is a row like any other, with the multiplier tau_j.
//!
//! The friction of a hinge is a torque at the radius r; its D is the relative angle.  Where the Jacobian of
//! these equations loses its sign no tau follows from the state continuously: Painlevé's paradox, see
//! [`Kernel::regularity`].
//!
//! Source: F. Pfeiffer, C. Glocker, *Multibody Dynamics with Unilateral Contacts* (1996), chapters 5 and 6.

pub mod impact;
pub mod modes;
mod shared;
pub mod simultaneous;

pub use modes::{Moment, Paradox, Transition};

use super::compile::{CompileError, Joint};
use super::constraint::{self, ConstraintEquation, Measure, Posture};
use super::forest::Forest;
use super::impact::Contact;
use super::kernel::{Kernel, dot};
use super::law::Law;
use super::{Mechanism, Time, tree};
use crate::arithmetic::{Complex, Real};
use crate::scene::{FrictionPlace, Scene, Wall};

/// Newton steps at most; from a few on only rounding is left.
const ROUNDS: usize = 40;
/// Steps after the one that changes no double: for the digits and derivatives that other numbers have.
const MORE_ROUNDS: usize = 3;

/// A place with dry friction.
#[derive(Clone, Debug, PartialEq)]
pub struct Friction {
    /// Name of the hinge, slider or wall.
    pub name: String,
    /// Measures the relative displacement \[rad, m\]; its multiplier is tau \[N·m, N\].
    pub tangent: ConstraintEquation,
    /// Where the normal force comes from.
    pub normal: Normal,
    /// tau over N while it slides: mu r \[m\] of a hinge, else mu \[1\].
    pub kinetic: f64,
    /// The most of tau over N while it sticks.
    pub stiction: f64,
    /// True where Newton's law of impact holds at a wall, not Poisson's.
    pub is_newton: bool,
}

/// What presses the two surfaces on each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Normal {
    /// The force that a joint carries, by its number.
    Joint(usize),
    /// The force across a rail: the row of the slider.
    Rail,
    /// The pressure of a wall, by its number.
    Contact(usize),
}

/// What a place with friction does at the moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Mode {
    /// Nothing: its wall is not touched.
    #[default]
    Open,
    /// It sticks at this relative displacement \[rad, m\].
    Stick(f64),
    /// It slides: the sign of the relative velocity.
    Slip(f64),
    /// It rests since others hold it: other places, its own friction at the limit `mu0 N` against a velocity
    /// of this sign, or motors, its own friction zero, as is the sign.
    Strained(f64),
}

impl Mode {
    /// What it does in one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Open => "apart",
            Self::Stick(_) | Self::Strained(_) => "sticks",
            Self::Slip(_) => "slides",
        }
    }

    /// tau over N of what has its friction at the limit.
    fn coefficient(self, friction: &Friction) -> Option<f64> {
        match self {
            Self::Open | Self::Stick(_) => None,
            Self::Slip(sign) => Some(sign * friction.kinetic),
            Self::Strained(sign) => Some(sign * friction.stiction),
        }
    }
}

/// The friction of a scene; without those whose coefficients are zero.
pub(super) fn frictions(scene: &Scene, forest: &Forest, joints: &[Joint]) -> Vec<Friction> {
    let of = |friction: &crate::scene::Friction| {
        let (tangent, normal, lever, is_newton) = match friction.at {
            FrictionPlace::Hinge { hinge, radius } => {
                let Joint { name, between, .. } = &joints[hinge];
                let [inner, outer] = *between;
                let (body, base) = if let Some(outer) = outer { (outer, inner) } else { (inner?, None) };
                let tangent = constraint::angle_equation(name, body, base, Law::constant(0.0));
                (tangent, Normal::Joint(hinge), radius, false)
            }
            FrictionPlace::Slider(slider) => {
                let slider = &scene.sliders[slider];
                let tangent = super::compile::travel_along(forest, slider);
                (tangent, Normal::Rail, 1.0, false)
            }
            FrictionPlace::Wall { wall: number, is_newton } => {
                let wall = &scene.walls[number];
                let along = -Complex::new(wall.normal[0], wall.normal[1]).left();
                let tangent = match wall.on {
                    // Counted from the origin.
                    None => super::compile::along_wall(
                        forest,
                        &Wall { through: [0.0; 2], ..wall.clone() },
                        along,
                        None,
                    ),
                    Some(_) => super::compile::along_wall(forest, wall, along, None),
                };
                let tangent = tangent.0;
                (tangent, Normal::Contact(number), 1.0, is_newton)
            }
        };
        let (kinetic, stiction) = (friction.kinetic * lever, friction.stiction * lever);
        Some(Friction { name: tangent.name.clone(), tangent, normal, kinetic, stiction, is_newton })
    };
    scene.frictions.iter().filter(|friction| friction.stiction > 0.0).filter_map(of).collect()
}

/// Refuses friction at walls whose lines move with the points that meet them: curves, along which it does not
/// act.
pub(super) fn check_lines(frictions: &[Friction], contacts: &[Contact]) -> Result<(), CompileError> {
    let is_curve = |contact: &&Contact| {
        let terms = contact.point.terms.iter().map(|term| term.0);
        let own: Vec<usize> =
            terms.chain(contact.point.shifts.iter().flat_map(|shift| [shift.0, shift.0 + 1])).collect();
        contact.row.aim.as_ref().is_some_and(|aim| aim.coordinates().any(|k| own.contains(&k)))
    };
    let contact = |friction: &Friction| match friction.normal {
        Normal::Contact(number) => contacts.get(number),
        _ => None,
    };
    match frictions.iter().filter_map(contact).find(is_curve) {
        Some(contact) => Err(CompileError::FrictionOnCurve(contact.row.name.clone())),
        None => Ok(()),
    }
}

impl Friction {
    /// The relative displacement \[rad, m\] at these coordinates.
    pub fn displacement(&self, phi: &[f64], z: &[Complex<f64>]) -> f64 {
        match &self.tangent.measure {
            Measure::Angle { body, base } => phi[*body] - base.map_or(0.0, |base| phi[base]),
            Measure::Place(place) => place.value(z),
        }
    }

    /// The row that keeps it at a displacement \[rad, m\].
    fn stuck(&self, at: f64) -> ConstraintEquation {
        let mut row = self.tangent.clone();
        row.name.push_str(".friction");
        match &mut row.measure {
            Measure::Angle { .. } => row.law = Some(Law::constant(at)),
            Measure::Place(place) => place.constant -= at,
        }
        row
    }

    /// What it hangs on, in words.
    pub fn kind(&self) -> &'static str {
        match self.normal {
            Normal::Joint(_) => "hinge",
            Normal::Rail => "slider",
            Normal::Contact(_) => "wall",
        }
    }
}

impl Mechanism {
    /// The friction at a wall, by its number.
    pub fn friction_at(&self, contact: usize) -> Option<&Friction> {
        self.frictions.iter().find(|friction| friction.normal == Normal::Contact(contact))
    }

    /// The mechanism with these contacts held and its places with friction in these modes.
    pub fn moving(&self, contacts: &[usize], modes: &[Mode]) -> Self {
        let mut mechanism = self.clone();
        mechanism.constraints.truncate(self.standing_rows());
        mechanism.constraints.extend(contacts.iter().map(|&contact| self.contacts[contact].row.clone()));
        let stuck = self.frictions.iter().zip(modes).filter_map(|(friction, mode)| match mode {
            Mode::Stick(at) => Some(friction.stuck(*at)),
            _ => None,
        });
        mechanism.constraints.extend(stuck);
        mechanism.held = contacts.to_vec();
        mechanism.modes = modes.to_vec();
        mechanism.choose_form();
        mechanism
    }

    /// How many places stick: their rows are the last.
    pub fn sticking(&self) -> usize {
        self.modes.iter().filter(|mode| matches!(mode, Mode::Stick(_))).count()
    }

    /// The places that slide, or rest with their friction at its limit, with tau over N.
    pub fn sliding(&self) -> impl Iterator<Item = (&Friction, f64)> {
        let all = self.frictions.iter().zip(&self.modes);
        all.filter_map(|(friction, mode)| Some((friction, mode.coefficient(friction)?)))
    }

    /// The row whose multiplier is the normal force of a place, where it is one.
    fn normal_row(&self, friction: &Friction) -> Option<usize> {
        match friction.normal {
            Normal::Joint(_) => None,
            Normal::Rail => self.constraints[..self.standing_rows()]
                .iter()
                .position(|row| row.name == friction.name && row.law.is_none() && !row.is_angle()),
            Normal::Contact(contact) => {
                let place = self.held.iter().position(|&held| held == contact)?;
                Some(self.standing_rows() + place)
            }
        }
    }

    /// The force \[N\] that presses a place, as a vector where it is that of a joint, of an evaluation with
    /// these multipliers and joint forces.
    pub(super) fn normal_force<T: Real>(
        &self,
        friction: &Friction,
        multiplier: &[T],
        carried: &[Complex<T>],
    ) -> Complex<T> {
        match friction.normal {
            Normal::Joint(joint) => carried[joint],
            _ => Complex::new(self.normal_row(friction).map_or(T::ZERO, |row| multiplier[row]), T::ZERO),
        }
    }
}

/// The size of a normal force, and the direction in which it grows; a wall's pressure has a sign.
pub(super) fn size<T: Real>(normal: Normal, force: Complex<T>) -> (T, Complex<T>) {
    if let Normal::Contact(_) = normal {
        return (-force.re, Complex::new(-T::ONE, T::ZERO));
    }
    let size = if force.im == T::ZERO { force.re.abs() } else { (force.dot(force)).sqrt() };
    if size == T::ZERO {
        return (T::ZERO, Complex::ZERO);
    }
    (size, Complex::new(force.re / size, force.im / size))
}

/// What one unit of tau does.
struct Response<T> {
    acceleration: Vec<T>,
    multiplier: Vec<T>,
    normal: Vec<Complex<T>>,
}

/// Finds tau of places with these coefficients c, `tau_j = c_j N_j`, whose normal forces are `start`
/// without it and change by `response(j, k)` with that of place k, from the tau given; returns the
/// determinant of the equations.
pub(super) fn forces<T: Real>(
    sliding: &[(Normal, T)],
    start: &[Complex<T>],
    response: impl Fn(usize, usize) -> Complex<T>,
    tau: &mut [T],
) -> f64 {
    let (mut left, mut last) = (MORE_ROUNDS, f64::INFINITY);
    let mut regularity = T::ONE.value();
    for _ in 0..ROUNDS {
        // F_j = tau_j - c_j N_j(tau), and its Jacobian.
        let f = sliding.len();
        let (mut matrix, mut change) = (vec![T::ZERO; f * f], vec![T::ZERO; f]);
        for (j, &(normal, coefficient)) in sliding.iter().enumerate() {
            let mut force = start[j];
            for (k, &tau) in tau.iter().enumerate() {
                force += response(j, k).times(tau);
            }
            let (size, along) = size(normal, force);
            change[j] = coefficient * size - tau[j];
            for k in 0..f {
                matrix[j * f + k] = -coefficient * along.dot(response(j, k));
            }
            matrix[j * f + j] += T::ONE;
        }
        regularity = solve(&mut matrix, &mut change);
        let mut moved = 0.0_f64;
        for (tau, &change) in tau.iter_mut().zip(&change) {
            *tau += change;
            moved = moved.max(change.value().abs() / tau.value().abs().max(f64::MIN_POSITIVE));
        }
        // Below a few units in the last place it only goes to and fro.
        if moved <= 1e-14 || (moved >= last && moved < 1e-12) {
            left -= 1;
            if T::IS_PLAIN || left == 0 {
                break;
            }
        }
        last = moved;
    }
    regularity
}

impl<T: Real> Kernel<T> {
    /// Adds the friction of what slides to accelerations and multipliers without it.
    #[cold]
    pub(super) fn slide(&mut self, mechanism: &Mechanism, t: Time, phi: &[T], omega: &[T]) {
        let n = phi.len();
        let sliding: Vec<(&Friction, f64)> = mechanism.sliding().collect();
        self.friction.clear();
        self.friction.resize(sliding.len(), T::ZERO);
        self.friction_rows.clear();
        self.friction_rows.resize(sliding.len() * n, T::ZERO);
        self.regularity = T::ONE.value();
        if sliding.is_empty() {
            return;
        }
        let at = Posture { phi, z: &self.z, omega };
        for ((friction, _), row) in sliding.iter().zip(self.friction_rows.chunks_exact_mut(n)) {
            friction.tangent.differentiate(t, at, row);
        }
        let needed = mechanism.needed_forces(t, &self.z, phi, omega, &self.load);
        let carried = mechanism.transmitted(&self.z, &self.multiplier, needed);
        let start: Vec<Complex<T>> = (sliding.iter())
            .map(|(friction, _)| mechanism.normal_force(friction, &self.multiplier, &carried))
            .collect();
        let responses: Vec<Response<T>> =
            (0..sliding.len()).map(|j| self.response(mechanism, &sliding, j)).collect();
        let places: Vec<(Normal, T)> =
            (sliding.iter()).map(|&(friction, coefficient)| (friction.normal, T::of(coefficient))).collect();
        self.regularity = forces(&places, &start, |j, k| responses[k].normal[j], &mut self.friction);
        for (response, &tau) in responses.iter().zip(&self.friction) {
            for (load, &change) in self.load.iter_mut().zip(&response.acceleration) {
                *load += change * tau;
            }
            for (multiplier, &change) in self.multiplier.iter_mut().zip(&response.multiplier) {
                *multiplier += change * tau;
            }
        }
    }

    /// What a unit of tau at the j-th place that slides does to accelerations, multipliers and normal forces.
    fn response(&self, mechanism: &Mechanism, sliding: &[(&Friction, f64)], j: usize) -> Response<T> {
        let (n, rows) = (self.z.len(), mechanism.constraints.len());
        let mut acceleration: Vec<T> = self.friction_rows[j * n..(j + 1) * n].iter().map(|&d| -d).collect();
        tree::solve::<T, 0>(n, &self.mass, &self.pivot, &mut acceleration);
        let mut multiplier: Vec<T> =
            (0..rows).map(|r| dot(&self.jacobian[r * n..(r + 1) * n], &acceleration)).collect();
        tree::solve::<T, 0>(rows, &self.schur, &self.schur_pivot, &mut multiplier);
        for (r, &multiplier) in multiplier.iter().enumerate() {
            for k in 0..n {
                acceleration[k] -= self.minv_jt[r * n + k] * multiplier;
            }
        }
        let mut needed = mechanism.inertia_forces(&self.z, &acceleration);
        sliding[j].0.tangent.add_force(&self.z, T::ONE, &mut needed);
        let carried = mechanism.transmitted(&self.z, &multiplier, needed);
        let normal = (sliding.iter())
            .map(|(friction, _)| mechanism.normal_force(friction, &multiplier, &carried))
            .collect();
        Response { acceleration, multiplier, normal }
    }

    /// The forces of friction \[N·m, N\], as multipliers of the relative displacements, and the sizes of the
    /// normal forces \[N\] of all places; zeros for those that are open.  After
    /// [`accelerate`](Kernel::accelerate).
    pub fn friction_forces(&self, mechanism: &Mechanism, t: Time, phi: &[T], omega: &[T]) -> Vec<[T; 2]> {
        let mut needed = mechanism.needed_forces(t, &self.z, phi, omega, &self.load);
        for ((friction, _), &tau) in mechanism.sliding().zip(&self.friction) {
            friction.tangent.add_force(&self.z, tau, &mut needed);
        }
        let carried = mechanism.transmitted(&self.z, &self.multiplier, needed);
        let mut slid = self.friction.iter();
        let mut stuck = self.multiplier[mechanism.constraints.len() - mechanism.sticking()..].iter();
        (mechanism.frictions.iter().zip(&mechanism.modes))
            .map(|(friction, mode)| {
                let tau = match mode {
                    Mode::Open => return [T::ZERO; 2],
                    Mode::Stick(_) => stuck.next(),
                    Mode::Slip(_) | Mode::Strained(_) => slid.next(),
                };
                let force = mechanism.normal_force(friction, &self.multiplier, &carried);
                [tau.copied().unwrap_or(T::ZERO), size(friction.normal, force).0]
            })
            .collect()
    }

    /// Power that friction takes \[W\], after an evaluation.
    #[inline(always)]
    pub fn friction_power(&self, omega: &[T]) -> T {
        let n = omega.len();
        self.friction
            .iter()
            .enumerate()
            .fold(T::ZERO, |sum, (j, &tau)| sum + tau * dot(&self.friction_rows[j * n..(j + 1) * n], omega))
    }
}

/// Solves a small system in place by elimination with exchange of rows, and returns its determinant.
pub(super) fn solve<T: Real>(matrix: &mut [T], x: &mut [T]) -> f64 {
    let d = x.len();
    let mut determinant = 1.0;
    for k in 0..d {
        let size = |i: usize| matrix[i * d + k].value().abs();
        let best = (k..d).max_by(|&a, &b| size(a).total_cmp(&size(b))).unwrap_or(k);
        if best != k {
            (0..d).for_each(|j| matrix.swap(k * d + j, best * d + j));
            x.swap(k, best);
            determinant = -determinant;
        }
        let pivot = matrix[k * d + k];
        determinant *= pivot.value();
        for i in k + 1..d {
            let share = matrix[i * d + k] / pivot;
            for j in k..d {
                let above = matrix[k * d + j];
                matrix[i * d + j] -= share * above;
            }
            let above = x[k];
            x[i] -= share * above;
        }
    }
    for k in (0..d).rev() {
        let mut sum = x[k];
        for j in k + 1..d {
            sum -= matrix[k * d + j] * x[j];
        }
        x[k] = sum / matrix[k * d + k];
    }
    determinant
}
