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
//! [`Kernel::regularity`](super::kernel::Kernel::regularity).
//!
//! Source: F. Pfeiffer, C. Glocker, *Multibody Dynamics with Unilateral Contacts* (1996), chapters 5 and 6.

mod combinations;
mod evaluation;
pub mod evidence;
pub mod impact;
pub mod modes;
pub mod paradox;
mod shared;
pub mod simultaneous;

pub use modes::{FrictionMoment, Transition};
pub use paradox::Paradox;

use self::paradox::JAMMED;
use super::Mechanism;
use super::compile::{CompileError, Joint};
use super::constraint::{self, ConstraintEquation, RowMeasure};
use super::forest::Forest;
use super::impact::Contact;
use super::law::Law;
use crate::arithmetic::{Complex, Over, Real};
use crate::scene::{FrictionPlace, Scene, Wall};

/// Newton steps at most; from a few on only rounding is left.
const ROUNDS: usize = 40;
/// Steps after the one that changes no double: for the digits and derivatives that other numbers have.
const MORE_ROUNDS: usize = 3;
/// The same of many digits: each step doubles them.
const MOST_ROUNDS: usize = 9;

/// What is left of the equations of friction after all steps, over their forces, where they have no solution.
const UNSETTLED: f64 = 1e-3;
/// Share of the largest of all forces that rounding leaves of one that passes zero.
const ROUNDED: f64 = 1e-9;
/// What is returned in place of a determinant where no forces of friction fit a motion.
const NO_FORCES: f64 = -1.0;

/// A place with dry friction.
#[derive(Clone, Debug, PartialEq)]
pub struct CompiledFriction<C = f64> {
    /// Name of the hinge, slider or wall.
    pub name: String,
    /// Measures the relative displacement \[rad, m\]; its multiplier is tau \[N·m, N\].
    pub tangent: ConstraintEquation<C>,
    /// Where the normal force comes from.
    pub normal: Normal,
    /// tau over N while it slides: mu r \[m\] of a hinge, else mu \[1\].
    pub kinetic: C,
    /// The most of tau over N while it sticks.
    pub stiction: C,
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
pub enum FrictionMode<C = f64> {
    /// Nothing: its wall is not touched.
    #[default]
    Open,
    /// It sticks at this relative displacement \[rad, m\].
    Stick(C),
    /// It slides: the sign of the relative velocity.
    Slip(f64),
    /// It rests since others hold it: other places, its own friction at the limit `mu0 N` against a velocity
    /// of this sign, or motors, its own friction zero, as is the sign.
    Strained(f64),
}

impl<C: Copy> FrictionMode<C> {
    /// The same with its displacement as a double.
    pub fn in_doubles(&self) -> FrictionMode
    where
        C: Real,
    {
        match *self {
            Self::Open => FrictionMode::Open,
            Self::Stick(at) => FrictionMode::Stick(at.value()),
            Self::Slip(sign) => FrictionMode::Slip(sign),
            Self::Strained(sign) => FrictionMode::Strained(sign),
        }
    }

    /// What it does in one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Open => "apart",
            Self::Stick(_) | Self::Strained(_) => "sticks",
            Self::Slip(_) => "slides",
        }
    }

    /// tau over N of what has its friction at the limit.
    pub fn coefficient<F: Real>(self, friction: &CompiledFriction<F>) -> Option<F> {
        match self {
            Self::Open | Self::Stick(_) => None,
            Self::Slip(sign) => Some(friction.kinetic.scale(sign)),
            Self::Strained(sign) => Some(friction.stiction.scale(sign)),
        }
    }
}

/// The friction of a scene; without those whose coefficients are zero.
pub(super) fn frictions<C: Real>(
    scene: &Scene<C>,
    forest: &Forest<C>,
    joints: &[Joint<C>],
) -> Vec<CompiledFriction<C>> {
    let of = |friction: &crate::scene::Friction<C>| {
        let (tangent, normal, lever, is_newton) = match friction.at {
            FrictionPlace::Hinge { hinge, radius } => {
                let Joint { name, between, .. } = &joints[hinge];
                let [inner, outer] = *between;
                let (body, base) = if let Some(outer) = outer { (outer, inner) } else { (inner?, None) };
                let tangent = constraint::angle_equation(name, body, base, Law::default());
                (tangent, Normal::Joint(hinge), radius, false)
            }
            FrictionPlace::Slider(slider) => {
                let slider = &scene.sliders[slider];
                let tangent = super::compile::travel_along(forest, slider);
                (tangent, Normal::Rail, C::ONE, false)
            }
            FrictionPlace::Wall { wall: number, is_newton } => {
                let wall = &scene.walls[number];
                let along = -Complex::new(wall.normal[0], wall.normal[1]).left();
                let tangent = match wall.on {
                    // Counted from the origin.
                    None => super::compile::along_wall(
                        forest,
                        &Wall { through: [C::ZERO; 2], ..wall.clone() },
                        along,
                        None,
                    ),
                    Some(_) => super::compile::along_wall(forest, wall, along, None),
                };
                let tangent = tangent.0;
                (tangent, Normal::Contact(number), C::ONE, is_newton)
            }
        };
        let (kinetic, stiction) = (friction.kinetic * lever, friction.stiction * lever);
        Some(CompiledFriction { name: tangent.name.clone(), tangent, normal, kinetic, stiction, is_newton })
    };
    scene.frictions.iter().filter(|friction| friction.stiction > C::ZERO).filter_map(of).collect()
}

/// Refuses friction at walls whose lines move with the points that meet them: curves, along which it does not
/// act.
pub(super) fn check_lines(frictions: &[CompiledFriction], contacts: &[Contact]) -> Result<(), CompileError> {
    let is_curve = |contact: &&Contact| {
        let terms = contact.point.terms.iter().map(|term| term.0);
        let own: Vec<usize> =
            terms.chain(contact.point.shifts.iter().flat_map(|shift| [shift.0, shift.0 + 1])).collect();
        contact.row.aim.as_ref().is_some_and(|aim| aim.coordinates().any(|k| own.contains(&k)))
    };
    let contact = |friction: &CompiledFriction| match friction.normal {
        Normal::Contact(number) => contacts.get(number),
        _ => None,
    };
    match frictions.iter().filter_map(contact).find(is_curve) {
        Some(contact) => Err(CompileError::FrictionOnCurve(contact.row.name.clone())),
        None => Ok(()),
    }
}

impl<C: Real> CompiledFriction<C> {
    /// The relative displacement \[rad, m\] at these coordinates.
    pub fn displacement<T: Over<C>>(&self, phi: &[T], z: &[Complex<T>]) -> T {
        self.tangent.measure.value(phi, z)
    }

    /// The row that keeps it at a displacement \[rad, m\].
    pub(super) fn stuck(&self, at: C) -> ConstraintEquation<C> {
        let mut row = self.tangent.clone();
        row.name.push_str(".friction");
        match &mut row.measure {
            RowMeasure::Angle { .. } => row.law = Some(Law { start: at, ..Law::default() }),
            RowMeasure::Place(place) => place.constant -= at,
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
    pub fn friction_at(&self, contact: usize) -> Option<&CompiledFriction> {
        self.frictions.iter().find(|friction| friction.normal == Normal::Contact(contact))
    }

    /// The mechanism with these contacts held and its places with friction in these modes.
    pub fn moving(&self, contacts: &[usize], modes: &[FrictionMode]) -> Self {
        let mut mechanism = self.clone();
        mechanism.constraints.truncate(self.standing_rows());
        mechanism.constraints.extend(contacts.iter().map(|&contact| self.contacts[contact].row.clone()));
        let stuck = self.frictions.iter().zip(modes).filter_map(|(friction, mode)| match mode {
            FrictionMode::Stick(at) => Some(friction.stuck(*at)),
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
        self.modes.iter().filter(|mode| matches!(mode, FrictionMode::Stick(_))).count()
    }

    /// The places that slide, or rest with their friction at its limit, with tau over N.
    pub fn sliding(&self) -> impl Iterator<Item = (&CompiledFriction, f64)> {
        let all = self.frictions.iter().zip(&self.modes);
        all.filter_map(|(friction, mode)| Some((friction, mode.coefficient(friction)?)))
    }

    /// The row whose multiplier is the normal force of a place, where it is one.
    fn normal_row<C>(&self, friction: &CompiledFriction<C>) -> Option<usize> {
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
    pub(super) fn normal_force<T: Real, C>(
        &self,
        friction: &CompiledFriction<C>,
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
pub fn size<T: Real>(normal: Normal, force: Complex<T>) -> (T, Complex<T>) {
    if let Normal::Contact(_) = normal {
        return (-force.re, Complex::new(-T::ONE, T::ZERO));
    }
    let size = if force.im == T::ZERO { force.re.abs() } else { (force.dot(force)).sqrt() };
    if size == T::ZERO {
        return (T::ZERO, Complex::ZERO);
    }
    (size, Complex::new(force.re / size, force.im / size))
}

/// Finds tau of places with these coefficients c, `tau_j = c_j N_j`, whose normal forces are `start`
/// without it and change by `response(j, k)` with that of place k, from the tau given; returns the
/// determinant of the equations, and [`NO_FORCES`] where they have no solution near.
pub(super) fn forces<T: Real>(
    sliding: &[(Normal, T)],
    start: &[Complex<T>],
    response: impl Fn(usize, usize) -> Complex<T>,
    tau: &mut [T],
) -> f64 {
    let more = if T::HAS_CONSTANTS { MOST_ROUNDS } else { MORE_ROUNDS };
    let (mut left, mut last) = (more, f64::INFINITY);
    let mut regularity = T::ONE.value();
    for round in 1..=ROUNDS {
        // F_j = tau_j - c_j N_j(tau), and its Jacobian.
        let f = sliding.len();
        let (mut matrix, mut change) = (vec![T::ZERO; f * f], vec![T::ZERO; f]);
        // Steps that do not end go to and fro between the signs of a force, none of which it has.
        let mut goes_on = false;
        for (j, &(normal, coefficient)) in sliding.iter().enumerate() {
            let mut force = start[j];
            for (k, &tau) in tau.iter().enumerate() {
                force += response(j, k).times(tau);
            }
            let (size, along) = size(normal, force);
            change[j] = coefficient * size - tau[j];
            if round == ROUNDS {
                let parts = (coefficient * size).value().abs() + tau[j].value().abs();
                let rounding = || ROUNDED * coefficient.value().abs() * largest(start, &response, tau);
                let (left, settled) = (change[j].value().abs(), UNSETTLED * parts);
                goes_on |= left > settled && left > settled + rounding();
            }
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
        let is_linear = || sliding.iter().all(|(normal, _)| matches!(normal, Normal::Contact(_)));
        if goes_on && regularity.abs() > JAMMED && !is_linear() {
            return NO_FORCES;
        }
    }
    regularity
}

/// The largest of the forces \[N\] that normal forces are sums of.
fn largest<T: Real>(start: &[Complex<T>], response: &impl Fn(usize, usize) -> Complex<T>, tau: &[T]) -> f64 {
    let size = |force: Complex<T>| libm::hypot(force.re.value(), force.im.value());
    let by_tau = |j: usize| tau.iter().enumerate().map(move |(k, &tau)| size(response(j, k).times(tau)));
    let all = start.iter().map(|&force| size(force)).chain((0..start.len()).flat_map(by_tau));
    all.fold(0.0, f64::max)
}

/// Solves a small system in place by elimination with exchange of rows, and returns its determinant.
pub fn solve<T: Real>(matrix: &mut [T], x: &mut [T]) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn found(
        sliding: &[(Normal, f64)],
        start: &[Complex<f64>],
        response: &[Complex<f64>],
    ) -> (f64, Vec<f64>) {
        let (f, mut tau) = (start.len(), vec![0.0; start.len()]);
        let regularity = forces(sliding, start, |j, k| response[j * f + k], &mut tau);
        (regularity, tau)
    }

    /// A hinge alone, and beside a rail whose force is zero under the hinge's friction: the same friction.
    #[test]
    fn a_force_that_passes_zero_beside_another_is_no_paradox() {
        for k in 0..200 {
            let [a, b, c, d] = [1.0, 2.0, 3.0, 4.0].map(|factor| libm::sin(factor * f64::from(k) + factor));
            let hinge = (Normal::Joint(0), 0.0222);
            let (start, own) = (Complex::new(900.0 * a, 300.0 * b), Complex::new(c, d));
            let (alone, tau) = found(&[hinge], &[start], &[own]);
            assert!(alone > 0.5);
            let rail = [(0.5 + 0.1 * c) * tau[0], 0.5 + 0.1 * c, 0.05 + 0.02 * d];
            let [zero, by_hinge, by_rail] = rail.map(|x| Complex::new(x, 0.0));
            let response = [own, Complex::new(d, a), by_hinge, by_rail];
            let (regularity, both) =
                found(&[hinge, (Normal::Rail, -0.0859)], &[start, Complex::new(-zero.re, 0.0)], &response);
            assert!(regularity > 0.5, "{k}: {regularity}");
            assert!(
                (both[0] - tau[0]).abs() < 1e-14 * tau[0] && both[1].abs() < 1e-14 * tau[0],
                "{k}: {both:?}"
            );
        }
        // tau = |1 + 2 tau| has no solution where tau is positive, and none where it is not.
        let [start, response] = [1.0, 2.0].map(|x| Complex::new(x, 0.0));
        assert!(found(&[(Normal::Rail, 1.0)], &[start], &[response]).0 < 0.0);
    }
}
