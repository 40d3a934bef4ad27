//! Driven angles solved for: every body's angle is an independent coordinate, or known, or both.
//!
//! ```text
//! q = S u + s(t):   q_i = u_base(i) + Σ ± theta(t)
//! ```
//!
//! Motors connect angles like hinges connect points: within a group of bodies tied to one another one angle is free, or none
//! where the group is tied to the ground.

use super::compile::CompileError;
use super::law::{Law, Phase};
use super::{Motion, State, Time};
use crate::arithmetic::{Complex, DoubleDouble, Real, Scalar, angle};
use crate::scene::Scene;

/// How one body's angle follows from the coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tie {
    /// The coordinate it moves with; `None`: driven from the ground.
    pub base: Option<usize>,
    /// Laws to be added, with their sign.
    pub laws: Vec<(f64, Law)>,
}

impl Tie {
    /// The known part s(t) of the angle: the sum of the laws, of which a single one keeps its own numbers to the last bit.
    #[inline]
    pub fn drive<T: Real>(&self, t: Time) -> Phase<T> {
        let sum = self.laws.iter().map(|(sign, law)| law.at::<T>(t).times(*sign)).reduce(|sum, phase| Phase {
            angle: angle::difference(sum.angle, -phase.angle),
            unit: sum.unit * phase.unit,
            rate: sum.rate + phase.rate,
            acceleration: sum.acceleration + phase.acceleration,
        });
        sum.unwrap_or(Phase { unit: Complex::new(T::ONE, T::ZERO), ..Phase::default() })
    }

    /// The unit vector of the body at coordinates `u` \[rad\].
    #[inline(always)]
    pub fn face<T: Scalar>(&self, u: &[T], drive: &Phase<T>) -> Complex<T> {
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
            (Some(base), []) => Phase { angle: u[base], unit: Complex::unit(u[base]), rate: T::ZERO, acceleration: T::ZERO },
            (None, [(sign, law)]) => law.at::<T>(t).times(*sign),
            _ => self.compose(t, u),
        }
    }

    /// Several angles, one upon another.
    fn compose<T: Real>(&self, t: Time, u: &[T]) -> Phase<T> {
        let drive = self.drive::<T>(t);
        let angle = self.base.map_or(drive.angle, |base| angle::difference(u[base], -drive.angle));
        Phase { angle, unit: self.face(u, &drive), ..drive }
    }
}

/// All ties of a mechanism.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ties {
    /// One a body.
    pub bodies: Vec<Tie>,
    /// The body whose angle each independent coordinate is.
    pub independent: Vec<usize>,
}

impl Ties {
    /// Walks the motors outwards from the ground and from the first body of every group left.
    pub(super) fn new(scene: &Scene) -> Result<Self, CompileError> {
        let n = scene.bars.len();
        let mut ties: Vec<Option<Tie>> = vec![None; n];
        let mut used = vec![false; scene.motors.len()];
        let mut independent = Vec::new();
        for root in std::iter::once(None).chain((0..n).map(Some)) {
            if let Some(body) = root {
                if ties[body].is_some() {
                    continue;
                }
                ties[body] = Some(Tie { base: Some(independent.len()), laws: Vec::new() });
                independent.push(body);
            }
            let mut front = vec![root];
            while let Some(near) = front.pop() {
                for (m, motor) in scene.motors.iter().enumerate() {
                    let (far, sign) = if motor.relative_to == near {
                        (Some(motor.bar), 1.0)
                    } else if Some(motor.bar) == near {
                        (motor.relative_to, -1.0)
                    } else {
                        continue;
                    };
                    if std::mem::replace(&mut used[m], true) {
                        continue;
                    }
                    let Some(body) = far.filter(|&body| ties[body].is_none()) else {
                        return Err(CompileError::Redundant(motor.name.clone()));
                    };
                    let mut tie = near.and_then(|near| ties[near].clone()).unwrap_or_default();
                    tie.laws.push((sign, motor.law.clone()));
                    ties[body] = Some(tie);
                    front.push(far);
                }
            }
        }
        Ok(Self { bodies: ties.into_iter().map(Option::unwrap_or_default).collect(), independent })
    }

    /// Every angle a coordinate of its own.
    pub fn free(bodies: usize) -> Self {
        Self { bodies: (0..bodies).map(|i| Tie { base: Some(i), laws: Vec::new() }).collect(), independent: (0..bodies).collect() }
    }

    /// Number of independent coordinates.
    pub fn count(&self) -> usize {
        self.independent.len()
    }

    /// True where some angle is driven.
    pub fn driven(&self) -> bool {
        self.bodies.iter().any(|tie| !tie.laws.is_empty())
    }

    /// True where no driven angle accelerates.
    pub fn is_steady(&self) -> bool {
        self.bodies.iter().flat_map(|tie| &tie.laws).all(|(_, law)| law.is_steady())
    }

    /// Angles \[rad\], unit vectors, s' \[rad/s\] and s'' \[rad/s²\] of all bodies at coordinates `u` \[rad\].
    #[inline]
    pub fn expand<T: Real>(&self, t: Time, u: &[T], phi: &mut [T], z: &mut [Complex<T>], rate: &mut [T], acceleration: &mut [T]) {
        for (i, tie) in self.bodies.iter().enumerate() {
            let placed = tie.place(t, u);
            (phi[i], z[i], rate[i], acceleration[i]) = (placed.angle, placed.unit, placed.rate, placed.acceleration);
        }
    }

    /// Adds S u' to `rate`: the rates \[rad/s\] of all bodies.
    #[inline(always)]
    pub fn spread<T: Scalar>(&self, u_rate: &[T], rate: &mut [T]) {
        for (rate, tie) in rate.iter_mut().zip(&self.bodies) {
            if let Some(base) = tie.base {
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
        for (&x, tie) in x.iter().zip(&self.bodies) {
            if let Some(base) = tie.base {
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

    /// A state whose first unknowns are the coordinates of a motion.
    pub(super) fn state(&self, motion: &Motion, unknowns: &[DoubleDouble]) -> State {
        let mut state = State::new(unknowns, self.count());
        state.time = motion.time;
        for (turns, &body) in state.turns.iter_mut().zip(&self.independent) {
            *turns += motion.turns[body];
        }
        state
    }

    /// Angles and turns of all bodies, and the driven share of their rates, in double-double.
    pub(super) fn read_angles(&self, state: &State, motion: &mut Motion) {
        motion.resize(self.bodies.len());
        motion.time = state.time;
        for (k, tie) in self.bodies.iter().enumerate() {
            (motion.phi[k], motion.omega[k], motion.turns[k]) = tie.read(state);
        }
    }
}

impl Tie {
    /// The body's angle, the driven share of its rate, and its turns.
    fn read(&self, state: &State) -> (DoubleDouble, DoubleDouble, i64) {
        let (base, turns) = self.base.map_or((DoubleDouble::ZERO, 0), |base| (state.unknown(base), state.turns[base]));
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
                (angle, rate, turns + whole as i64)
            }
        }
    }
}
