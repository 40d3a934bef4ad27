//! The motion as a power series in time, order by order, with the solve inside.
//!
//! ```text
//! z_k(t) = Σ z_k,m t^m, w_k(t) = Σ w_k,m t^m (not wrapped, t from the step's start), with z' = i w z:
//! known z_0…z_{m+1}, w_0…w_m:
//!   u_m  = (m+1) i Σ_{j=0..m} w_j z_{m+1-j}                    z'' without its newest term i a_m z_0
//!   R_m  = Σ_j H_kj u_j,m - F_k,m                              forces F: gravity (m = 0 only), springs, dampers
//!   M_0 a_m = -Σ_{l=0..m} Im(conj(z_l) R_{m-l})                one factorization of M_0 for all orders
//!   w_{m+1} = a_m/(m+1),  z_{m+2} = (u_m + i a_m z_0)/((m+1)(m+2)),  R_m += H i a_m z_0
//! ```
//!
//! Nothing but Cauchy products: four real ones a body, no sine beyond the first.  Driven angles enter with the known series of their laws: the coordinates are those of
//! [`elimination`](super::elimination), q = S u + s(t), and the solve is with Sᵀ M_0 S.  What the rows of driven bodies lack of balance is the motors'
//! torque, whose power is integrated with the rest.
//!
//! Source: Jorba & Zou, *A software package for the numerical integration of ODEs by means of high-order Taylor methods*, Experimental Mathematics 14 (2005), for the
//! products; the in-series solve with constant couplings is ours.

use super::force::Spring;
use super::ties::Tie;
use super::tree;
use super::{Mechanism, Time};
use crate::arithmetic::{Complex, Real, Scalar};

/// Power series of a motion about one time; nothing is allocated after [`Series::new`].
#[derive(Clone, Debug)]
pub struct Series<T> {
    /// Highest power P of the rates.
    order: usize,
    bodies: usize,
    /// z: powers 0…P+1, body by body ((P+2) × n).
    pub z: Vec<Complex<T>>,
    /// w: powers 0…P ((P+1) × n) \[rad/s^(m+1)\].
    pub omega: Vec<T>,
    /// Rate of the coordinates u' (powers 0…P) ((P+1) × f).
    pub rate: Vec<T>,
    /// Power of motors and dampers (powers 0…P-1) \[W/s^m\].
    pub power: Vec<T>,
    /// R (P × n) \[N·m/s^m\].
    rest: Vec<Complex<T>>,
    /// s' (powers 0…P) ((P+1) × n).
    drive: Vec<T>,
    /// Torque on each driven body (P × n).
    torque: Vec<T>,
    springs: Vec<SpringSeries<T>>,
    bend: Vec<Complex<T>>,
    load: Vec<T>,
    mass: Vec<T>,
    twist: Vec<T>,
    reduced: Vec<T>,
    pivot: Vec<T>,
    solution: Vec<T>,
}

/// Series of one spring.
#[derive(Clone, Debug)]
struct SpringSeries<T> {
    /// D = P_a - P_b (powers 0…P).
    span: Vec<Complex<T>>,
    /// |D|².
    square: Vec<T>,
    /// 1/|D|, where the free length asks for it.
    inverse_length: Vec<T>,
    /// 1/|D|², D·D' and their product, where there is a damper.
    inverse_square: Vec<T>,
    closing: Vec<T>,
    strain_rate: Vec<T>,
}

impl<T: Real> Series<T> {
    /// Room for series of a mechanism up to this power of the rates, at least 2.
    pub fn new(mechanism: &Mechanism, order: usize) -> Self {
        let (n, f) = (mechanism.bodies.len(), mechanism.ties.count());
        let zeros = |count: usize| vec![T::ZERO; count];
        let spring = |spring: &Spring| SpringSeries {
            span: vec![Complex::ZERO; order + 1],
            square: zeros(order + 1),
            inverse_length: zeros(if spring.free_length == 0.0 { 0 } else { order + 1 }),
            inverse_square: zeros(if spring.damping == 0.0 { 0 } else { order + 1 }),
            closing: zeros(if spring.damping == 0.0 { 0 } else { order + 1 }),
            strain_rate: zeros(if spring.damping == 0.0 { 0 } else { order + 1 }),
        };
        Self {
            order,
            bodies: n,
            z: vec![Complex::ZERO; (order + 2) * n],
            omega: zeros((order + 1) * n),
            rate: zeros((order + 1) * f),
            power: zeros(order),
            rest: vec![Complex::ZERO; order * n],
            drive: zeros((order + 1) * n),
            torque: zeros(order * n),
            springs: mechanism.springs.iter().map(spring).collect(),
            bend: vec![Complex::ZERO; n],
            load: zeros(n),
            mass: zeros(n * n),
            twist: zeros(n * n),
            reduced: zeros(f * f),
            pivot: zeros(f.max(n)),
            solution: zeros(f),
        }
    }

    /// Highest power of the rates.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Expands the motion through coordinates `u` \[rad\] (leading part and rest) and rates `u_rate` \[rad/s\] at time `t`.
    pub fn expand(&mut self, mechanism: &Mechanism, t: Time, u: &[T], u_rest: &[T], u_rate: &[T]) {
        let n = self.bodies;
        let f = u.len();
        self.begin(mechanism, t, u, u_rest, u_rate);
        mechanism.tree.couple::<T, 0>(&self.z[..n], &mut self.mass, &mut self.twist);
        mechanism.ties.reduce(&self.mass, &mut self.reduced);
        tree::factor::<T, 0>(f, &mut self.reduced, &mut self.pivot);
        // The first power of z needs only rates.
        for i in 0..n {
            self.z[n + i] = self.z[i].left().times(self.omega[i]);
        }
        for m in 0..self.order {
            self.bend(m);
            self.balance(mechanism, m);
            self.solve(mechanism, m);
        }
    }

    /// Power zero, and the laws' series.
    fn begin(&mut self, mechanism: &Mechanism, t: Time, u: &[T], u_rest: &[T], u_rate: &[T]) {
        self.rate[..u.len()].copy_from_slice(u_rate);
        for (i, tie) in mechanism.ties.bodies.iter().enumerate() {
            let mut z = Complex::new(T::ONE, T::ZERO);
            self.omega[i] = T::ZERO;
            if let Some(base) = tie.base {
                let unit = Complex::unit(u[base]);
                // What the leading part leaves out of the angle turns the vector by a first-order rotation.
                z = unit + unit.left().times(u_rest[base]);
                self.omega[i] = u_rate[base];
            }
            if !tie.laws.is_empty() {
                z = z * self.drive_series(tie, i, t);
                self.omega[i] += self.drive[i];
            }
            self.z[i] = z;
        }
    }

    /// Series of a tie's s' into `drive`; returns its unit vector at the start.
    fn drive_series(&mut self, tie: &Tie, body: usize, t: Time) -> Complex<T> {
        let n = self.bodies;
        for m in 0..=self.order {
            self.drive[m * n + body] = T::ZERO;
        }
        let mut unit = Complex::new(T::ONE, T::ZERO);
        for (sign, law) in &tie.laws {
            let phase = law.at::<T>(t);
            unit = unit * if *sign > 0.0 { phase.unit } else { phase.unit.conj() };
            self.drive[body] += phase.rate.scale(*sign);
            self.drive[n + body] += T::of(law.acceleration).scale(*sign);
            for sine in &law.sines {
                let argument = t.scale(sine.frequency) + sine.phase;
                let (sin, cos) = T::split(argument.reduced().0).0.sin_cos();
                // The m-th derivative of A f cos is A f^(m+1) cos, -sin, -cos, sin; power 0 is in the phase's rate already.
                let mut factor = T::of(sine.amplitude).scale(*sign * sine.frequency);
                for m in 1..=self.order {
                    factor = factor.scale(sine.frequency) / T::of(m as f64);
                    let turned = match m % 4 {
                        0 => cos,
                        1 => -sin,
                        2 => -cos,
                        _ => sin,
                    };
                    self.drive[m * n + body] += turned * factor;
                }
            }
        }
        unit
    }

    /// u_m into `bend`; the driven part of a_m, where there is one, is in it.
    fn bend(&mut self, m: usize) {
        let n = self.bodies;
        for i in 0..n {
            let mut sum = Complex::ZERO;
            for j in 0..=m {
                sum += self.z[(m + 1 - j) * n + i].times(self.omega[j * n + i]);
            }
            self.bend[i] = sum.left().times(T::of((m + 1) as f64));
        }
    }

    /// R_m, and the load -Σ Im(conj(z) R) of this order into `load`.
    fn balance(&mut self, mechanism: &Mechanism, m: usize) {
        let n = self.bodies;
        // The known part of a_m: s'' of this order.
        for i in 0..n {
            let given = self.drive[(m + 1) * n + i] * T::of((m + 1) as f64);
            self.load[i] = -given.scale(mechanism.tree.diagonal[i]);
            self.bend[i] += self.z[i].left().times(given);
        }
        let rest = &mut self.rest[m * n..(m + 1) * n];
        for (rest, &weight) in rest.iter_mut().zip(&mechanism.tree.weight) {
            *rest = if m == 0 { -Complex::of(weight) } else { Complex::ZERO };
        }
        for i in 0..n {
            for j in i + 1..n {
                let h = mechanism.tree.coupling[i * n + j];
                rest[i] += self.bend[j].turn(h);
                rest[j] += self.bend[i].turn(h.conj());
            }
        }
        for (spring, series) in mechanism.springs.iter().zip(&mut self.springs) {
            let force = series.force(spring, m, &self.z, n);
            for &(k, gamma) in &spring.span.terms {
                rest[k] -= force.turn(gamma.conj());
            }
        }
        for i in 0..n {
            let mut sum = T::ZERO;
            for l in 0..=m {
                sum += self.z[l * n + i].cross(self.rest[(m - l) * n + i]);
            }
            self.load[i] -= sum;
        }
    }

    /// a_m from the loads, the newest powers of w and z, and R_m completed.
    fn solve(&mut self, mechanism: &Mechanism, m: usize) {
        let (n, f) = (self.bodies, self.solution.len());
        mechanism.ties.gather(&self.load, &mut self.solution);
        tree::solve::<T, 0>(f, &self.reduced, &self.pivot, &mut self.solution);
        let next = T::ONE / T::of((m + 1) as f64);
        let after = T::ONE / T::of(((m + 1) * (m + 2)) as f64);
        for c in 0..f {
            self.rate[(m + 1) * f + c] = self.solution[c] * next;
        }
        for (i, tie) in mechanism.ties.bodies.iter().enumerate() {
            let solved = tie.base.map_or(T::ZERO, |base| self.solution[base]);
            let turned = self.z[i].left().times(solved);
            self.omega[(m + 1) * n + i] = solved * next + self.drive[(m + 1) * n + i];
            self.z[(m + 2) * n + i] = (self.bend[i] + turned).times(after);
            self.bend[i] = turned;
        }
        let rest = &mut self.rest[m * n..(m + 1) * n];
        for i in 0..n {
            for j in i + 1..n {
                let h = mechanism.tree.coupling[i * n + j];
                rest[i] += self.bend[j].turn(h);
                rest[j] += self.bend[i].turn(h.conj());
            }
        }
        self.account(mechanism, m);
    }

    /// Torques of the driven bodies and the power of motors and dampers at this order.
    fn account(&mut self, mechanism: &Mechanism, m: usize) {
        let n = self.bodies;
        let mut power = T::ZERO;
        if mechanism.ties.driven() {
            for (i, _) in mechanism.ties.bodies.iter().enumerate().filter(|(_, tie)| !tie.laws.is_empty()) {
                let mut torque = (self.omega[(m + 1) * n + i] * T::of((m + 1) as f64)).scale(mechanism.tree.diagonal[i]);
                for l in 0..=m {
                    torque += self.z[l * n + i].cross(self.rest[(m - l) * n + i]);
                }
                self.torque[m * n + i] = torque;
                for l in 0..=m {
                    power += self.torque[l * n + i] * self.drive[(m - l) * n + i];
                }
            }
        }
        for (spring, series) in mechanism.springs.iter().zip(&self.springs).filter(|(spring, _)| spring.damping != 0.0) {
            let mut lost = T::ZERO;
            for l in 0..=m {
                lost += series.strain_rate[l] * series.closing[m - l];
            }
            power -= lost.scale(spring.damping);
        }
        self.power[m] = power;
    }
}

impl<T: Real> SpringSeries<T> {
    /// Force on the spring's first end at power m, from powers up to m+1 of z.
    fn force(&mut self, spring: &Spring, m: usize, z: &[Complex<T>], n: usize) -> Complex<T> {
        let root = if m == 0 { Complex::of(spring.span.root) } else { Complex::ZERO };
        self.span[m] = spring.span.terms.iter().fold(root, |sum, &(k, gamma)| sum + z[m * n + k].turn(gamma));
        if spring.free_length == 0.0 && spring.damping == 0.0 {
            return -self.span[m].times(T::of(spring.stiffness));
        }
        self.square[m] = product(m, |l| self.span[l].dot(self.span[m - l]));
        let mut force = -self.span[m].times(T::of(spring.stiffness));
        if spring.free_length != 0.0 {
            // s = q^(-1/2):  m q_0 s_m = Σ_{j=1..m} (-j/2 - (m-j)) q_j s_{m-j}.
            self.inverse_length[m] = if m == 0 {
                T::ONE / self.square[0].sqrt()
            } else {
                let sum =
                    (1..=m).fold(T::ZERO, |sum, j| sum + (self.square[j] * self.inverse_length[m - j]).scale(0.5 * j as f64 - m as f64));
                sum / self.square[0].scale(m as f64)
            };
            let scale = spring.stiffness * spring.free_length;
            for l in 0..=m {
                force += self.span[l].times(self.inverse_length[m - l].scale(scale));
            }
        }
        if spring.damping != 0.0 {
            self.inverse_square[m] = if m == 0 {
                T::ONE / self.square[0]
            } else {
                -(1..=m).fold(T::ZERO, |sum, j| sum + self.square[j] * self.inverse_square[m - j]) / self.square[0]
            };
            // D·D' = q'/2, and D' at power m is (m+1) D_{m+1}.
            let ahead = spring.span.terms.iter().fold(Complex::ZERO, |sum, &(k, gamma)| sum + z[(m + 1) * n + k].turn(gamma));
            self.closing[m] = product(m, |l| {
                let rate = if m - l == m { ahead } else { self.span[m - l + 1] };
                self.span[l].dot(rate).scale((m - l + 1) as f64)
            });
            self.strain_rate[m] = product(m, |l| self.closing[l] * self.inverse_square[m - l]);
            for l in 0..=m {
                force -= self.span[l].times(self.strain_rate[m - l].scale(spring.damping));
            }
        }
        force
    }
}

/// Σ_{l=0..m} term(l).
fn product<T: Scalar>(m: usize, term: impl Fn(usize) -> T) -> T {
    (0..=m).fold(T::ZERO, |sum, l| sum + term(l))
}

/// A series `a_0 + a_1 h + …` of stride `stride` from `first`, without its first `skip` powers: Σ_{m>=skip} a_m h^m.
pub fn tail<T: Real>(series: &[T], first: usize, stride: usize, skip: usize, h: T) -> T {
    let count = (series.len() - first).div_ceil(stride);
    let mut sum = T::ZERO;
    for m in (skip..count).rev() {
        sum = sum * h + series[first + m * stride];
    }
    (0..skip).fold(sum, |sum, _| sum * h)
}

/// Σ a_m h^(m+1)/(m+1): the integral of a series.
pub fn integral<T: Real>(series: &[T], first: usize, stride: usize, h: T) -> T {
    let count = (series.len() - first).div_ceil(stride);
    let mut sum = T::ZERO;
    for m in (0..count).rev() {
        sum = sum * h + series[first + m * stride] / T::of((m + 1) as f64);
    }
    sum * h
}
