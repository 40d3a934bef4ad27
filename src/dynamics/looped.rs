//! Small mechanisms with closed loops in (q, w), their accelerations found in natural coordinates.
//!
//! ```text
//! z = exp(i q),   S mu = z·W F + w²,   a_k = (i z_k)·(W F)_k - Σ_j T_kj mu_j        S, T: `natural::columns`
//! ```
//!
//! Pins, lines of the ground and locked angles are linear in z and part of the constant W: what is left is
//! one row a body, and no velocity term but w². Half the cost of [`Multiplier`] with its factors of M and of
//! the rows' S, whose unknowns and account of work it shares.
//!
//! Written once over [`Lanes`] and compiled twice, to the same bits.

use super::constraint::ConstraintArguments;
use super::energy::moment;
use super::force::action::Applied;
use super::multiplier::Multiplier;
use super::natural::columns::{self, LaneColumns};
use super::natural::{ReducedMatrices, sorted_rows};
use super::stiffness::Stiffness;
use super::{BodyAngles, Coordinates, Form, Mechanism, Motion, OdeSystem, State, Time};
use crate::arithmetic::lanes::row::{Row, load, store};
use crate::arithmetic::lanes::{self, Code, Lanes};
use crate::arithmetic::{Complex, sincos};
use std::sync::Arc;

/// Largest number of bodies; beyond, the form in angles is cheaper.
pub const MOST: usize = 16;

/// Share of a pivot of S below which the angle form takes over.
pub const NEAR: f64 = 1e-2;

/// Part of a product with W that may cancel.
const WORST: f64 = 1e4;

/// Equations in angles and rates, solved in natural coordinates.
#[derive(Clone, Debug)]
pub struct Looped {
    mechanism: Arc<Mechanism>,
    reduced: ReducedMatrices,
    /// What all else is asked of.
    angles: Multiplier<0, true>,
    room: SizedScratch,
    is_portable: bool,
}

/// Up to four, eight or sixteen bodies.
#[derive(Clone, Debug)]
enum SizedScratch {
    Few(Box<LoopedScratch<1>>),
    Several(Box<LoopedScratch<2>>),
    Many(Box<LoopedScratch<4>>),
}

/// Constants and scratch space.
#[derive(Clone, Debug)]
struct LoopedScratch<const B: usize> {
    columns: LaneColumns<B>,
    schur: Vec<Row<B>>,
    across: Vec<Row<B>>,
    z: Vec<Complex<f64>>,
    force: Vec<Complex<f64>>,
    alpha: Row<B>,
    /// The least share of a pivot.
    least: f64,
}

/// The matrices of a mechanism this form fits: hinged bodies only, with rows other than angles, all of them
/// linear with constant coefficients.
pub fn reduced(mechanism: &Mechanism) -> Option<ReducedMatrices> {
    let n = mechanism.bodies.len();
    let is_small = mechanism.coordinates() == n && n <= MOST && mechanism.tree.is_dense();
    if !is_small
        || !mechanism.has_closed_loops()
        || !mechanism.contacts.is_empty()
        || mechanism.vibration.is_some()
        || !mechanism.frictions.is_empty()
        || mechanism.has_released()
        || mechanism.has_aims()
    {
        return None;
    }
    let (linear, guides) = sorted_rows(mechanism);
    if !guides.is_empty() {
        return None;
    }
    let reduced = ReducedMatrices::new(mechanism, linear).ok()?;
    // Light members that carry heavy ones: W has entries that cancel everywhere, M in angles only where these
    // are in line.
    let is_sound =
        reduced.free.iter().zip(&mechanism.tree.diagonal).all(|(free, diagonal)| free * diagonal < WORST);
    is_sound.then_some(reduced)
}

impl Looped {
    /// The form of a mechanism, where it fits.
    pub fn new(mechanism: Arc<Mechanism>) -> Option<Self> {
        let reduced = reduced(&mechanism)?;
        let room = match mechanism.bodies.len() {
            0..=4 => SizedScratch::Few(Box::new(LoopedScratch::new(&reduced))),
            5..=8 => SizedScratch::Several(Box::new(LoopedScratch::new(&reduced))),
            _ => SizedScratch::Many(Box::new(LoopedScratch::new(&reduced))),
        };
        Some(Self {
            angles: Multiplier::new(Arc::clone(&mechanism)),
            mechanism,
            reduced,
            room,
            is_portable: false,
        })
    }

    /// The same without instructions special to the processor: slowly to the same bits.
    pub fn portable(mut self) -> Self {
        self.is_portable = true;
        self
    }
}

impl<const B: usize> LoopedScratch<B> {
    fn new(reduced: &ReducedMatrices) -> Self {
        let n = reduced.free.len();
        Self {
            columns: LaneColumns::new(reduced),
            schur: vec![[[0.0; 4]; B]; n],
            across: vec![[[0.0; 4]; B]; n],
            z: vec![Complex::ZERO; n],
            force: vec![Complex::ZERO; n],
            alpha: [[0.0; 4]; B],
            least: f64::INFINITY,
        }
    }

    /// Accelerations and unit vectors, by the processor's vectors where it has them; `None` near a singular
    /// position.
    fn run(
        &mut self,
        mechanism: &Mechanism,
        t: Time,
        phi: &[f64],
        omega: &[f64],
        is_portable: bool,
    ) -> Option<(&[f64], &[Complex<f64>])> {
        lanes::run(Accelerations { bench: self, mechanism, t, phi, omega }, is_portable);
        (self.least >= NEAR).then(|| (&self.alpha.as_flattened()[..phi.len()], &self.z[..]))
    }
}

struct Accelerations<'a, const B: usize> {
    bench: &'a mut LoopedScratch<B>,
    mechanism: &'a Mechanism,
    t: Time,
    phi: &'a [f64],
    omega: &'a [f64],
}

impl<const B: usize> Code for Accelerations<'_, B> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        accelerate::<L, B>(self.bench, self.mechanism, self.t, self.phi, self.omega);
    }
}

/// Accelerations \[rad/s²\] into `alpha`.
#[inline(always)]
fn accelerate<L: Lanes, const B: usize>(
    bench: &mut LoopedScratch<B>,
    mechanism: &Mechanism,
    t: Time,
    phi: &[f64],
    omega: &[f64],
) {
    let n = phi.len();
    let (mut angles, mut rates) = ([[0.0; 4]; B], [[0.0; 4]; B]);
    angles.as_flattened_mut()[..n].copy_from_slice(phi);
    rates.as_flattened_mut()[..n].copy_from_slice(&omega[..n]);
    let (mut c, mut s) = ([L::ZERO; B], [L::ZERO; B]);
    for b in 0..B {
        (s[b], c[b]) = sincos::sin_cos(L::of(angles[b]), L::ZERO);
    }
    let (cos, sin) = (store(c), store(s));
    let LoopedScratch { columns, schur, across, z, force, alpha, least } = bench;
    for (z, (&c, &s)) in z.iter_mut().zip(cos.as_flattened().iter().zip(sin.as_flattened())) {
        *z = Complex::new(c, s);
    }
    forces(mechanism, t, phi, omega, z, force);
    let mut free = [[L::ZERO; B]; 2];
    for j in 0..n {
        let block = &columns.blocks[j];
        let [x, y] = columns::turned::<L, B>(block, z[j].re, z[j].im);
        let (fx, fy) = (L::splat(force[j].re), L::splat(force[j].im));
        for b in 0..B {
            schur[j][b] = c[b].mul_add(x[b], s[b].mul(y[b])).array();
            across[j][b] = s[b].neg_mul_add(x[b], c[b].mul(y[b])).array();
            free[0][b] = L::of(block[0][b]).mul_add(fx, L::of(block[1][b]).mul_add(fy, free[0][b]));
            free[1][b] = L::of(block[2][b]).mul_add(fx, L::of(block[3][b]).mul_add(fy, free[1][b]));
        }
    }
    let (mut right, mut turning) = ([[0.0; 4]; B], [L::ZERO; B]);
    for b in 0..B {
        let rate = L::of(rates[b]);
        right[b] = c[b].mul_add(free[0][b], s[b].mul_add(free[1][b], rate.mul(rate))).array();
        turning[b] = s[b].neg_mul_add(free[0][b], c[b].mul(free[1][b]));
    }
    *least = columns::solve::<L, B>(&mut schur[..n], &columns.scale, &mut right);
    for (across, &mu) in across.iter().zip(right.as_flattened()) {
        let mu = L::splat(mu);
        let across: [L; B] = load(across);
        for b in 0..B {
            turning[b] = across[b].neg_mul_add(mu, turning[b]);
        }
    }
    *alpha = store(turning);
}

/// Writes the force \[N·m\] on every unit vector; torques act across it.
#[inline(always)]
fn forces(
    mechanism: &Mechanism,
    t: Time,
    phi: &[f64],
    omega: &[f64],
    z: &[Complex<f64>],
    force: &mut [Complex<f64>],
) {
    force.copy_from_slice(&mechanism.tree.weight);
    for spring in &mechanism.springs {
        spring.span.spread(spring.force(z, omega), |k, pull| force[k] += pull);
    }
    for torsion in &mechanism.torsions {
        let torque = torsion.torque(phi, omega);
        force[torsion.body] += z[torsion.body].left().times(torque);
        if let Some(base) = torsion.base {
            force[base] -= z[base].left().times(torque);
        }
    }
    for action in &mechanism.actions {
        let factor = action.factor(t);
        match &action.kind {
            Applied::Force { point, .. } => point.spread(action.force(factor, z), |k, pull| force[k] += pull),
            Applied::Torque { torque, base } => {
                force[action.body] += z[action.body].left().times(torque * factor);
                if let Some(base) = base {
                    force[*base] -= z[*base].left().times(torque * factor);
                }
            }
        }
    }
    for user in &mechanism.forces {
        user.spread(moment(t), ConstraintArguments { phi, z, omega }, |k, pull| force[k] += pull);
    }
}

impl OdeSystem for Looped {
    fn dimension(&self) -> usize {
        self.angles.dimension()
    }

    fn angles(&self) -> usize {
        self.angles.angles()
    }

    fn rhs(&mut self, t: Time, y: &[f64], rate: &mut [f64]) {
        let mechanism = &*self.mechanism;
        let n = mechanism.bodies.len();
        let (phi, omega) = (&y[..n], &y[n..2 * n]);
        let found = match &mut self.room {
            SizedScratch::Few(bench) => bench.run(mechanism, t, phi, omega, self.is_portable),
            SizedScratch::Several(bench) => bench.run(mechanism, t, phi, omega, self.is_portable),
            SizedScratch::Many(bench) => bench.run(mechanism, t, phi, omega, self.is_portable),
        };
        // Which rows to leave out near a singular position, and when, is the angle form's to say.
        let Some((alpha, z)) = found else { return self.angles.rhs(t, y, rate) };
        rate[n..2 * n].copy_from_slice(alpha);
        rate[..n].copy_from_slice(omega);
        // Rows that never move do no work.
        (rate[2 * n], rate[2 * n + 1]) =
            (mechanism.force_power(t, ConstraintArguments { phi, z, omega }), 0.0);
    }

    fn fine_rate(&mut self, t: Time, y: &[f64], low: &[f64], rate: &mut [f64]) {
        if self.mechanism.springs.is_empty() {
            self.rhs(t, y, rate)
        } else {
            self.angles.fine_rate(t, y, low, rate)
        }
    }

    fn jacobian(&mut self, t: Time, y: &[f64], jacobian: &mut [f64]) -> bool {
        self.angles.jacobian(t, y, jacobian)
    }

    fn may_grow_by_rates(&self) -> bool {
        self.angles.may_grow_by_rates()
    }

    fn stiffness(&mut self, t: Time, y: &[f64]) -> Option<Stiffness> {
        self.angles.stiffness(t, y)
    }

    fn label(&self, i: usize) -> String {
        self.angles.label(i)
    }

    fn unit(&self, i: usize) -> f64 {
        self.angles.unit(i)
    }

    fn time_unit(&self) -> f64 {
        self.mechanism.units.time
    }
}

impl Form for Looped {
    fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::All
    }

    fn reduced(&self) -> Option<&ReducedMatrices> {
        Some(&self.reduced)
    }

    fn state(&self, motion: &Motion) -> State {
        self.angles.state(motion)
    }

    fn read(&mut self, state: &State, motion: &mut Motion) {
        self.angles.read(state, motion);
    }

    fn body_angles(&mut self, state: &State, body_angles: &mut BodyAngles) {
        self.angles.body_angles(state, body_angles);
    }
}
