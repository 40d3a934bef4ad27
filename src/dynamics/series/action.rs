//! The series of applied forces and torques, and of torsion springs.
//!
//! ```text
//! s(t) = Σ s_m t^m:   F_m = f s_m,  or  Σ_j f z_j s_{m-j} where it turns with its body;
//!     power_m = Σ_j F_j · P'_{m-j},  P'_m = (m+1) P_{m+1}
//! theta_0 = q_a - q_b,  theta_m = w_{m-1}/m:   torque_m = -k theta_m - c w_m
//! ```

use super::coefficient::SeriesNumber;
use super::factors::{CauchyFactor, Scale, VectorFactor};
use super::polynomial::{copy, copy_vectors, product, zeros};
use crate::arithmetic::Complex;
use crate::dynamics::force::action::Applied;
use crate::dynamics::force::{AppliedAction, Torsion};

/// Series of one applied force or torque, powers 0 to P.
#[derive(Clone, Debug)]
pub struct ActionSeries<T: SeriesNumber> {
    /// s.
    factor: Vec<T>,
    /// F and P' of a force.
    force: Vec<Complex<T>>,
    velocity: Vec<Complex<T>>,
    /// Rate of the body a torque acts on, less that of its base.
    rate: Vec<T>,
    /// The same as factors, where series are multiplied so.
    factors: Option<Box<ActionFactors<T>>>,
}

#[derive(Clone, Debug)]
struct ActionFactors<T: SeriesNumber> {
    turned: VectorFactor<T>,
    factor: T::Factor,
    force: VectorFactor<T>,
    velocity: VectorFactor<T>,
    rate: T::Factor,
}

impl<T: SeriesNumber> ActionFactors<T> {
    fn new(order: usize) -> Self {
        let (vectors, numbers) = (|| VectorFactor::new(order), || T::Factor::new(order));
        Self { turned: vectors(), factor: numbers(), force: vectors(), velocity: vectors(), rate: numbers() }
    }

    fn restart(&mut self, scale: &Scale<T>) {
        let vectors = [&mut self.turned, &mut self.force, &mut self.velocity];
        vectors.into_iter().for_each(|factor| factor.restart(scale));
        [&mut self.factor, &mut self.rate].into_iter().for_each(|factor| factor.restart(scale));
    }

    fn are_sound(&self) -> bool {
        let vectors = [&self.turned, &self.force, &self.velocity];
        let numbers = [&self.factor, &self.rate];
        vectors.into_iter().all(VectorFactor::is_sound) && numbers.into_iter().all(CauchyFactor::is_sound)
    }
}

impl<T: SeriesNumber> ActionSeries<T> {
    /// Room for powers up to `order`.
    pub fn new(action: &AppliedAction<T::Constant>, order: usize) -> Self {
        let is_force = matches!(action.kind, Applied::Force { .. });
        let vectors = || vec![Complex::ZERO; if is_force { order + 1 } else { 0 }];
        Self {
            factor: zeros(order + 1),
            force: vectors(),
            velocity: vectors(),
            rate: zeros(if is_force { 0 } else { order + 1 }),
            factors: T::HAS_CONSTANTS.then(|| Box::new(ActionFactors::new(order))),
        }
    }

    /// False where powers grow by more than products are made for.
    pub fn is_sound(&self) -> bool {
        self.factors.as_ref().is_none_or(|factors| factors.are_sound())
    }

    /// Power m of the force, zero of a torque \[N/s^m\].
    pub fn force(&self, m: usize) -> Complex<T> {
        self.force.get(m).copied().unwrap_or_default()
    }

    /// The law's series about time `t`.
    pub fn begin(&mut self, action: &AppliedAction<T::Constant>, t: T::Time) {
        self.factor.fill(T::ZERO);
        if let Some(law) = &action.law {
            T::add_law(law, 1.0, t, &mut self.factor, 0, 1);
            for m in (1..self.factor.len()).rev() {
                self.factor[m] = self.factor[m - 1] / T::of(m as f64);
            }
        }
        self.factor[0] = action.law.as_ref().map_or(T::ONE, |law| T::law_value(law, t));
    }

    /// Takes power m of the force off the elements' balance, and adds that of a torque to `load`.
    #[inline(always)]
    pub fn act(
        &mut self,
        action: &AppliedAction<T::Constant>,
        m: usize,
        z: &[Complex<T>],
        n: usize,
        (rest, load): (&mut [Complex<T>], &mut [T]),
        scale: &Scale<T>,
    ) {
        if let Some(factors) = &mut self.factors {
            if m == 0 {
                factors.restart(scale);
            }
            factors.factor.push(scale, self.factor[m]);
        }
        match &action.kind {
            Applied::Force { point, force, follows } => {
                self.force[m] = if let (true, Some(factors)) = (*follows, &mut self.factors) {
                    factors.turned.push(scale, z[m * n + action.body].turn(*force));
                    factors.turned.times(&factors.factor, scale, m, 0..=m)
                } else if *follows {
                    let turned = z[action.body..].iter().step_by(n).zip(self.factor[..=m].iter().rev());
                    turned.fold(Complex::ZERO, |sum, (z, &factor)| sum + z.turn(*force).times(factor))
                } else {
                    Complex::of(*force).times(self.factor[m])
                };
                self.velocity[m] = point.turned(&z[(m + 1) * n..(m + 2) * n]).times(T::of((m + 1) as f64));
                point.take_off(self.force[m], rest);
            }
            Applied::Torque { torque, base } => {
                let torque = self.factor[m].by(*torque);
                load[action.body] += torque;
                if let Some(base) = base {
                    load[*base] -= torque;
                }
            }
        }
    }

    /// Power m of its power \[W/s^m\], from power m of all rates.
    #[inline(always)]
    pub fn power(
        &mut self,
        action: &AppliedAction<T::Constant>,
        m: usize,
        omega: &[T],
        scale: &Scale<T>,
    ) -> T {
        match &action.kind {
            Applied::Force { .. } => match &mut self.factors {
                Some(factors) => {
                    factors.force.push(scale, self.force[m]);
                    factors.velocity.push(scale, self.velocity[m]);
                    factors.force.dot(&factors.velocity, scale, m, 0..=m)
                }
                None => product(&self.force[..=m], &self.velocity[..=m], |a, b| a.dot(b)),
            },
            Applied::Torque { torque, base } => {
                self.rate[m] = base.map_or(omega[action.body], |base| omega[action.body] - omega[base]);
                let power = match &mut self.factors {
                    Some(factors) => {
                        factors.rate.push(scale, self.rate[m]);
                        factors.factor.product(&factors.rate, scale, m, 0..=m)
                    }
                    None => product(&self.factor[..=m], &self.rate[..=m], |a, b| a * b),
                };
                power.by(*torque)
            }
        }
    }

    /// The first powers from another series.
    pub fn take<U: SeriesNumber>(&mut self, other: &ActionSeries<U>) {
        copy_vectors(&mut self.force, &other.force);
        copy_vectors(&mut self.velocity, &other.velocity);
        copy(&mut self.rate, &other.rate);
    }
}

/// Power m of the torque of a torsion spring on its body \[N·m/s^m\], from the angles at the start and the
/// series of the rates.
#[inline(always)]
pub fn twist<T: SeriesNumber>(
    torsion: &Torsion<T::Constant>,
    m: usize,
    phi: &[T],
    omega: &[T],
    n: usize,
) -> T {
    let rate = |m: usize| torsion.between(&omega[m * n..(m + 1) * n]);
    let elastic =
        if m == 0 { torsion.elastic(phi) } else { -(rate(m - 1) / T::of(m as f64)).by(torsion.stiffness) };
    elastic - rate(m).by(torsion.damping)
}

/// Power m of the power of its damper \[W/s^m\].
#[inline(always)]
pub fn loss<T: SeriesNumber>(torsion: &Torsion<T::Constant>, m: usize, omega: &[T], n: usize) -> T {
    let mut sum = T::ZERO;
    let mut j = 0;
    while j <= m {
        let rate = torsion.between(&omega[j * n..(j + 1) * n]);
        let other = torsion.between(&omega[(m - j) * n..(m - j + 1) * n]);
        sum -= (rate * other).by(torsion.damping);
        j += 1;
    }
    sum
}
