//! One evaluation of the equations at one moment: unit vectors, mass matrix, load, accelerations and
//! multipliers.
//!
//! ```text
//! a0 = M⁻¹ b;      rows:  X = M⁻¹ Gᵀ,  S = G X,  S lambda = G a0 + gamma,  a = a0 - X lambda
//! ```
//!
//! A scene without rows never enters the second line.  Mechanisms of many bodies are evaluated without these
//! matrices, by the passes of [`recursive`](super::recursive); what is found is the same.

mod constrained;
mod exact;

use super::constraint::{ConstraintArguments, Linearised};
use super::force::Vibration;
use super::rank::Metric;
use super::recursive::Evaluation;
use super::schur::Weakest;
use super::tree::{self, size};
use super::{Mechanism, Time};
use crate::arithmetic::{Complex, DoubleDouble, Real, Scalar};

/// What a stabilizer adds to the convective term of every row: `rate · C' + position · C`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bias {
    /// 2 alpha \[1/s\].
    pub rate: f64,
    /// beta² \[1/s²\].
    pub position: f64,
}

/// Coordinates up to which energies are measured by the couplings.
const COUPLED: usize = 48;

/// Scratch space of an evaluation for a mechanism of n coordinates and r rows; nothing is allocated after
/// [`Kernel::new`].
#[derive(Clone, Debug)]
pub struct Kernel<T> {
    /// Elements: unit vectors, and translational coordinates at the place of their x (n).
    pub z: Vec<Complex<T>>,
    /// M above and on the diagonal, then its factors (n × n) \[kg·m²\].
    pub mass: Vec<T>,
    /// Im p above the diagonal (n × n) \[kg·m²\].
    pub twist: Vec<T>,
    /// Reciprocal pivots (n).
    pub pivot: Vec<T>,
    /// Right side b, then accelerations (n) \[N·m, rad/s²\].
    pub load: Vec<T>,
    /// G (r × n).
    pub jacobian: Vec<T>,
    /// X = M⁻¹ Gᵀ, row by row (r × n).
    pub minv_jt: Vec<T>,
    /// S = G M⁻¹ Gᵀ above and on the diagonal, then its factors (r × r).
    pub schur: Vec<T>,
    /// Reciprocal pivots of S (r); zero for rows left out.
    pub schur_pivot: Vec<T>,
    /// What pivots of S are measured against (r).
    pub scale: Vec<f64>,
    /// What the rank of the rows is measured with.
    metric: Metric,
    /// The row nearest to being left out in the last evaluation.
    pub weakest: Weakest,
    /// The same in double-double, where doubles have too few digits for light members or long levers; made
    /// when first asked for.
    exact: Option<Box<Kernel<DoubleDouble>>>,
    /// True where the last evaluation was made there.
    is_exact: bool,
    /// The rows at this moment (r).
    pub rows: Vec<Linearised<T>>,
    /// Multipliers (r) \[N·m or N\].
    pub multiplier: Vec<T>,
    /// The part of each multiplier that the bias called for (r).
    pub correction: Vec<T>,
    /// tau of the places that slide \[N·m, N\] (f), and their rows D (f × n).
    pub friction: Vec<T>,
    /// See [`Kernel::friction`].
    pub friction_rows: Vec<T>,
    /// The determinant of the equations of friction: 1 without it; where it is not positive, no tau follows
    /// from the state continuously.
    pub regularity: f64,
    /// Power of forces that are laws of their own, of the last evaluation \[W\].
    pub law_power: T,
    /// What stands in place of the matrices where the mechanism is evaluated body by body; they are empty
    /// then.
    pub bodywise: Option<Box<Evaluation<T>>>,
    /// Stretches of springs \[m\], then of torsion springs \[rad\], where [`Kernel::measure`] has found them;
    /// empty otherwise.
    pub stretch: Vec<T>,
    /// Force and u of a vibration (n each), where there is one.
    pub vibration: [Vec<T>; 2],
    /// Translational coordinates of the bodies and their velocities, where energies are formed body by body.
    pub translations: [Vec<Complex<T>>; 2],
}

impl<T: Scalar> Kernel<T> {
    /// Scratch space with all matrices, whatever the mechanism's own form is; it must have
    /// [couplings](tree::Tree::is_dense).
    pub fn dense(mechanism: &Mechanism) -> Self {
        let size = if mechanism.vibration.is_some() { mechanism.coordinates() } else { 0 };
        let vibration = std::array::from_fn(|_| vec![T::ZERO; size]);
        Self {
            vibration,
            ..Self::sized(mechanism.coordinates(), mechanism.row_scales(), mechanism.rank_metric(), true)
        }
    }

    /// The same for a mechanism whose rows nobody asks about.
    pub fn dense_without_rows(mechanism: &Mechanism) -> Self {
        Self::sized(mechanism.coordinates(), Vec::new(), Metric::default(), true)
    }

    /// Scratch space for energies.
    pub fn without_rows(mechanism: &Mechanism) -> Self {
        // They are rounded, and what Gauss methods keep is the energy with these very numbers.
        let is_dense = mechanism.tree.is_dense()
            && (mechanism.recursion.is_none() || mechanism.coordinates() <= COUPLED);
        let mut kernel = Self::sized(mechanism.coordinates(), Vec::new(), Metric::default(), is_dense);
        if !is_dense {
            kernel.translations = std::array::from_fn(|_| vec![Complex::ZERO; mechanism.bodies.len()]);
        }
        kernel
    }

    fn sized(n: usize, scale: Vec<f64>, metric: Metric, is_dense: bool) -> Self {
        let rows = scale.len();
        let matrix = |size: usize| vec![T::ZERO; if is_dense { size } else { 0 }];
        let idle = Linearised { position: T::ZERO, drive: T::ZERO, convective: T::ZERO };
        Self {
            z: vec![Complex::ZERO; n],
            mass: matrix(n * n),
            twist: matrix(n * n),
            pivot: vec![T::ZERO; n],
            load: vec![T::ZERO; n],
            jacobian: matrix(rows * n),
            minv_jt: matrix(rows * n),
            schur: matrix(rows * rows),
            schur_pivot: matrix(rows),
            scale,
            metric,
            weakest: Weakest::NONE,
            exact: None,
            is_exact: false,
            rows: vec![idle; rows],
            multiplier: vec![T::ZERO; rows],
            correction: vec![T::ZERO; rows],
            friction: Vec::new(),
            friction_rows: Vec::new(),
            regularity: 1.0,
            law_power: T::ZERO,
            bodywise: None,
            stretch: Vec::new(),
            vibration: Default::default(),
            translations: Default::default(),
        }
    }

    /// Unit vectors of these angles, and translational coordinates.
    #[inline(always)]
    pub fn unit_vectors<const N: usize>(&mut self, mechanism: &Mechanism, phi: &[T]) {
        mechanism.tree.unit_vectors::<T, N>(phi, &mut self.z);
    }
}

impl<T: Real> Kernel<T> {
    /// Scratch space for a mechanism and its rows, in the form the mechanism is evaluated in.
    pub fn new(mechanism: &Mechanism) -> Self {
        let Some(recursion) = &mechanism.recursion else { return Self::dense(mechanism) };
        let mut kernel =
            Self::sized(mechanism.coordinates(), mechanism.row_scales(), mechanism.rank_metric(), false);
        kernel.bodywise = Some(Box::new(Evaluation::new(recursion, &kernel.scale, kernel.metric.clone())));
        kernel.translations = std::array::from_fn(|_| vec![Complex::ZERO; mechanism.bodies.len()]);
        kernel
    }

    /// The elements of [`Kernel::accelerate`], and nothing else of it.
    pub fn place(&mut self, mechanism: &Mechanism, phi: &[T]) {
        match &self.bodywise {
            Some(bodywise) => bodywise.unit_vectors(phi, &mut self.z),
            None => self.unit_vectors::<0>(mechanism, phi),
        }
    }

    /// M, its twist and the whole load b (velocity terms, gravity, springs, dampers, applied forces) at the
    /// elements in `z`.
    #[inline(always)]
    pub fn assemble<const N: usize>(&mut self, mechanism: &Mechanism, t: Time, phi: &[T], omega: &[T]) {
        mechanism.tree.mass_matrix::<T, N>(&self.z, &mut self.mass, &mut self.twist);
        mechanism.tree.velocity_and_gravity_forces::<T, N>(&self.z, omega, &self.twist, &mut self.load);
        let at = ConstraintArguments { phi, z: &self.z, omega };
        self.law_power = mechanism.add_applied_forces(t, at, &self.stretch, &mut self.load);
    }

    /// M and its twist at the elements in `z`, where there are such matrices.
    #[inline(always)]
    pub fn mass_matrix<const N: usize>(&mut self, mechanism: &Mechanism) {
        if N > 0 || self.bodywise.is_none() {
            mechanism.tree.mass_matrix::<T, N>(&self.z, &mut self.mass, &mut self.twist);
        }
    }

    /// The factors of M at the elements in `z`, after [`Kernel::mass_matrix`].
    #[inline(always)]
    pub fn factor<const N: usize>(&mut self, mechanism: &Mechanism, omega: &[T]) {
        if N == 0
            && let Some(bodywise) = &mut self.bodywise
        {
            bodywise.factor(&self.z, omega);
            bodywise.pivots(&mut self.pivot);
            return;
        }
        tree::factor::<T, N>(size::<N>(mechanism.tree.coordinates), &mut self.mass, &mut self.pivot);
    }

    /// Accelerations \[rad/s²\] without any row, into `load`.
    #[inline(always)]
    pub fn accelerate_free<const N: usize>(
        &mut self,
        mechanism: &Mechanism,
        t: Time,
        phi: &[T],
        omega: &[T],
    ) {
        let n = size::<N>(mechanism.tree.coordinates);
        if N == 0
            && let Some(bodywise) = &mut self.bodywise
        {
            bodywise.unit_vectors(phi, &mut self.z);
            self.law_power = bodywise.inward_pass(
                mechanism,
                t,
                ConstraintArguments { phi, z: &self.z, omega },
                &self.stretch,
                &mut self.load,
            );
            bodywise.outward_pass(&mut self.load);
            return;
        }
        self.unit_vectors::<N>(mechanism, phi);
        self.assemble::<N>(mechanism, t, phi, omega);
        tree::factor::<T, N>(n, &mut self.mass, &mut self.pivot);
        tree::solve::<T, N>(n, &self.mass, &self.pivot, &mut self.load);
    }

    /// Accelerations \[rad/s²\] into `load`, multipliers into `multiplier`.
    #[inline(always)]
    pub fn accelerate<const N: usize>(
        &mut self,
        mechanism: &Mechanism,
        t: Time,
        phi: &[T],
        omega: &[T],
        bias: Bias,
    ) {
        if N == 0 && self.bodywise.is_some() {
            self.accelerate_bodywise(mechanism, t, phi, omega, bias);
        } else {
            self.accelerate_free::<N>(mechanism, t, phi, omega);
            match mechanism.constraints.len() {
                1 => self.constrain::<N, 1>(mechanism, t, phi, omega, bias),
                2 => self.constrain::<N, 2>(mechanism, t, phi, omega, bias),
                _ => self.constrain::<N, 0>(mechanism, t, phi, omega, bias),
            }
            if !mechanism.frictions.is_empty() {
                self.slide(mechanism, t, phi, omega);
            }
        }
        self.is_exact = self.is_delicate(mechanism);
        if self.is_exact {
            self.accelerate_exactly(mechanism, t, phi, omega, bias);
        }
    }

    /// [`Kernel::accelerate`] where there are no matrices.
    fn accelerate_bodywise(&mut self, mechanism: &Mechanism, t: Time, phi: &[T], omega: &[T], bias: Bias) {
        let Some(bodywise) = &mut self.bodywise else { return };
        bodywise.unit_vectors(phi, &mut self.z);
        let at = ConstraintArguments { phi, z: &self.z, omega };
        self.law_power = bodywise.inward_pass(mechanism, t, at, &self.stretch, &mut self.load);
        if !mechanism.constraints.is_empty() {
            let found = (&mut self.rows[..], &mut self.multiplier[..], &mut self.correction[..]);
            self.weakest = bodywise.constrain(mechanism, t, at, bias, found);
        }
        bodywise.outward_pass(&mut self.load);
    }

    /// Adds what the mean force of a vibration does to the free accelerations.
    fn vibrate<const N: usize>(&mut self, mechanism: &Mechanism, vibration: &Vibration) {
        let [force, minv_jt] = &mut self.vibration;
        vibration.push::<T, N>(
            &mechanism.tree,
            &self.z,
            (&self.mass, &self.pivot),
            &self.twist,
            [force, minv_jt],
        );
        tree::solve::<T, N>(size::<N>(mechanism.tree.coordinates), &self.mass, &self.pivot, force);
        for (load, &more) in self.load.iter_mut().zip(force.iter()) {
            *load += more;
        }
    }

    /// Power of motors, dampers and applied forces, and power of the bias's share of the multipliers \[W\];
    /// after [`Kernel::accelerate`].
    #[inline(always)]
    pub fn powers(&self, mechanism: &Mechanism, t: Time, phi: &[T], omega: &[T]) -> (T, T) {
        let (mut work, mut stabilizer) = (T::ZERO, T::ZERO);
        for (r, row) in mechanism.constraints.iter().enumerate() {
            // What stands still, and what moves both its points alike, does no work.
            if !row.is_motor() {
                continue;
            }
            let speed = self.row_speed(r, omega);
            work -= (self.multiplier[r] - self.correction[r]) * speed;
            stabilizer -= self.correction[r] * speed;
        }
        if !self.friction.is_empty() {
            work -= self.friction_power(omega);
        }
        let at = ConstraintArguments { phi, z: &self.z, omega };
        (work + mechanism.force_power_beside(t, at, self.law_power), stabilizer)
    }
}

impl Kernel<f64> {
    /// [`Kernel::accelerate`] for any number of bodies, compiled once: what is inlined elsewhere is large.
    pub fn accelerations(&mut self, mechanism: &Mechanism, t: Time, phi: &[f64], omega: &[f64], bias: Bias) {
        self.accelerate::<0>(mechanism, t, phi, omega, bias);
    }

    /// The stretches of all springs for the evaluations that follow, at angles and translational coordinates
    /// given with what they leave out \[rad, m\].
    ///
    /// The force of a stiff spring is the difference of two lengths times k: in doubles it is rounded to
    /// 1e-16 k L, which is more than all other forces together from k = 1e16 m g / L on, and makes implicit
    /// methods with long steps pay from 1e8 m g / L.  In double-double nothing of that is left.
    pub fn measure(&mut self, mechanism: &Mechanism, phi: &[f64], low: &[f64]) {
        self.stretch.clear();
        for spring in &mechanism.springs {
            let span = &spring.span;
            let turning = span
                .terms
                .iter()
                .map(|&(k, gamma)| Complex::unit(DoubleDouble::sum(phi[k], low[k])).turn(gamma));
            let carried = span.shifts.iter().map(|&(x, share)| {
                Complex::new(DoubleDouble::sum(phi[x], low[x]), DoubleDouble::sum(phi[x + 1], low[x + 1]))
                    .times(DoubleDouble::of(share))
            });
            let end = turning.chain(carried).fold(Complex::of(span.root), |sum, part| sum + part);
            self.stretch.push(spring.stretch(end).hi);
        }
        for torsion in &mechanism.torsions {
            let whole = |k: usize| DoubleDouble::sum(phi[k], low[k]);
            let twist = torsion.base.map_or(whole(torsion.body), |base| whole(torsion.body) - whole(base));
            self.stretch.push((twist - DoubleDouble::of(torsion.free_angle)).hi);
        }
    }
}

/// Σ a_k b_k in rising order.
#[inline(always)]
pub fn dot<T: Scalar>(a: &[T], b: &[T]) -> T {
    a.iter().zip(b).fold(T::ZERO, |sum, (&a, &b)| sum + a * b)
}
