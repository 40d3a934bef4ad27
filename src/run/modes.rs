//! Equilibria of a mechanism, their stability, and the modes of small vibrations about them.
//!
//! ```text
//! a(q, w) = accelerations with the constraints' multipliers       G(q) T = 0,   T'T = 1
//! equilibrium:   C(q) = 0,  T' a(q, 0) = 0                          by Newton's method along the constraints
//! linearized:    q = q0 + T y + O(y²),  y'' = T' A_q T y + T' A_w T y'
//! modes:         (s² - s T' A_w T - T' A_q T) y = 0                 damping ratio -Re s / |s|
//! ```
//!
//! A_q and A_w are exact (dual numbers).  To first order the curvature of the constraints has no part in it, as
//! a(q0, 0) = 0.  Source: L. Meirovitch, *Methods of Analytical Dynamics* (1970), sections 5.3 to 5.6.

use super::kinematics::left_out;
use crate::arithmetic::Scalar;
use crate::dynamics::jacobian::Jacobian;
use crate::dynamics::kernel::{Bias, Kernel};
use crate::dynamics::{Mechanism, State, Time};
use crate::scene::Scene;
use crate::stabilization::projection::{project, unit as row_unit};
use nalgebra::{Complex, DMatrix, DVector};
use serde::Serialize;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// What the constraints may be off by, in their own size.
const KEPT: f64 = 1e-11;
/// Most iterations of Newton's method from one start.
const ITERATIONS: usize = 200;
/// Starts beside the scene's that slide down before Newton's method.
const RELAXED: usize = 8;
/// Longest step \[rad, or units of length\].
const LONGEST: f64 = 0.5;
/// What is left of the accelerations over the largest there are counts as none.
const STILL: f64 = 1e-11;
/// Two equilibria that differ by less are the same \[rad, or units of length\].
const DISTINCT: f64 = 1e-6;
/// Real parts below this share of the largest eigenvalue are rounding.
const ROUNDING: f64 = 1e-7;
/// Singular values of the constraints' Jacobian below this share of the largest are zero.
const DEPENDENT: f64 = 1e-7;
/// Below this share ways of motion cross nearby: an equilibrium there is not found to better than its root.
const CROSSING: f64 = 1e-4;

/// What becomes of a small disturbance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stability {
    /// It dies away.
    AsymptoticallyStable,
    /// It neither grows nor dies away, as far as the linearization tells.
    Stable,
    /// It grows.
    Unstable,
    /// Ways of motion cross there, and no linearization holds.
    Undecided,
}

/// A mode of small vibrations.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mode {
    /// Real and imaginary part of the eigenvalue \[1/s\]; of a pair the one with positive imaginary part.
    pub eigenvalue: [f64; 2],
    /// Its magnitude \[rad/s\].
    pub frequency: f64,
    /// -Re/|·|: 0 undamped, 1 and more without vibration, negative where it grows.
    pub damping_ratio: f64,
    /// Real and imaginary parts of the coordinates' amplitudes \[rad, m\]; the largest, positions in units of
    /// length, is 1.
    pub shape: Vec<[f64; 2]>,
}

/// A place where a mechanism stays at rest.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Equilibrium {
    /// Angles in (-π, π] \[rad\], then translational coordinates \[m\].
    pub phi: Vec<f64>,
    /// Potential energy \[J\].
    pub potential: f64,
    /// What a small disturbance does.
    pub stability: Stability,
    /// Its modes, from the slowest.
    pub modes: Vec<Mode>,
    /// True where the scene's start slides down to it, or comes to it by Newton's method.
    pub from_start: bool,
    /// True where neighbours are equilibria too: coordinates that nothing brings back.
    pub is_family: bool,
}

/// The equilibria of a scene.
#[derive(Clone, Debug)]
pub struct Modes {
    /// The scene.
    pub scene: Scene,
    /// Its mechanism.
    pub mechanism: Arc<Mechanism>,
    /// Degrees of freedom.
    pub degrees_of_freedom: usize,
    /// The equilibria, from the lowest potential energy.
    pub equilibria: Vec<Equilibrium>,
    /// How many starts the search had, some of them twice, and how many ended at an equilibrium.
    pub starts: [usize; 2],
    /// What of the scene has no part in this.
    pub left_out: Vec<&'static str>,
}

/// Why a scene has no equilibria to look for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModesError {
    /// Motors or forces change with time.
    #[error(
        "`{0}` moves with time: there is no equilibrium\nhint: give it a constant law, or `driftless run` the scene"
    )]
    Moving(String),
    /// Forces change with time.
    #[error(
        "forces of the scene change with time: there is no equilibrium\nhint: leave them out, or `driftless run` the scene"
    )]
    Forced,
    /// Integrals of controllers are unknowns of their own.
    #[error(
        "the scene has integrals, whose equilibria are not looked for\nhint: leave the integral part of the controller out"
    )]
    Integrals,
    /// Nothing can move.
    #[error("the constraints leave no freedom: nothing can vibrate")]
    Rigid,
}

/// Looks for equilibria from the start of a scene and from `starts` other positions of a fixed set.
///
/// # Errors
/// The scene has none by its nature.
pub fn modes(scene: &Scene, mechanism: &Arc<Mechanism>, starts: usize) -> Result<Modes, ModesError> {
    if mechanism.integrals().next().is_some() {
        return Err(ModesError::Integrals);
    }
    for row in &mechanism.constraints {
        if let Some(law) = &row.law {
            let rates = [0.0, 0.37, 1.9].map(|t| law.rates::<f64>(Time::of(t)).0);
            if rates.iter().any(|rate| *rate != 0.0) {
                return Err(ModesError::Moving(row.name().to_owned()));
            }
        }
    }
    let start = mechanism.start(scene);
    let mut search = Search::new(mechanism);
    let first: Vec<f64> = start.phi.iter().map(|phi| phi.hi).collect();
    if search.depends_on_time(&first) {
        return Err(ModesError::Forced);
    }
    let freedom = search.tangent(&first).ncols();
    if freedom == 0 {
        return Err(ModesError::Rigid);
    }
    let others = mechanism.other_assemblies(scene, starts);
    let mut equilibria: Vec<Equilibrium> = Vec::new();
    let mut count = [0, 0];
    // Stable ones are few among many: some starts slide down first, the scene's before all.
    let slid = search.relaxed(&first).unwrap_or_else(|| first.clone());
    let others_slid: Vec<Vec<f64>> =
        others.iter().take(RELAXED).filter_map(|phi| search.relaxed(phi)).collect();
    for (k, phi) in [&slid, &first].into_iter().chain(&others_slid).chain(&others).enumerate() {
        count[0] += 1;
        let Some(phi) = search.settle(phi) else { continue };
        count[1] += 1;
        if equilibria.iter().any(|known| search.is_same(&known.phi, &phi)) {
            continue;
        }
        let found = search.linearize(phi, k < 2 && equilibria.is_empty(), freedom);
        // Of a family one is enough.
        if !found.is_family || equilibria.iter().all(|known| !known.is_of_family(&found)) {
            equilibria.push(found);
        }
    }
    equilibria.sort_by(|a, b| a.potential.total_cmp(&b.potential));
    Ok(Modes {
        scene: scene.clone(),
        mechanism: Arc::clone(mechanism),
        degrees_of_freedom: freedom,
        equilibria,
        starts: count,
        left_out: left_out(scene),
    })
}

impl Equilibrium {
    /// True where another one has the same energy and the same eigenvalues.
    fn is_of_family(&self, other: &Self) -> bool {
        let near = |a: f64, b: f64, scale: f64| (a - b).abs() <= 1e-6 * scale;
        let largest = self.modes.iter().map(|mode| mode.frequency).fold(f64::MIN_POSITIVE, f64::max);
        let scale = self.potential.abs().max(other.potential.abs()).max(1e-12);
        near(self.potential, other.potential, scale)
            && self.modes.len() == other.modes.len()
            && (self.modes.iter().zip(&other.modes)).all(|(a, b)| near(a.frequency, b.frequency, largest))
    }
}

impl Modes {
    /// Coordinates at a phase \[rad\] of a mode's vibration about an equilibrium, of an amplitude of `share`: rad
    /// of the largest angle, or sizes of the mechanism where a position is largest.
    pub fn displaced(&self, equilibrium: &Equilibrium, mode: &Mode, phase: f64, share: f64) -> Vec<f64> {
        let mut search = Search::new(&self.mechanism);
        let bodies = self.mechanism.bodies.len();
        let size = |shape: &[f64; 2]| shape[0].hypot(shape[1]);
        let largest = |shape: &[[f64; 2]]| shape.iter().map(size).fold(0.0, f64::max);
        let (turns, shifts) = mode.shape.split_at(bodies);
        let length = self.mechanism.size_of_parts();
        let amplitude = share / largest(turns).max(largest(shifts) / length).max(f64::MIN_POSITIVE);
        let (sin, cos) = phase.sin_cos();
        let moved: Vec<f64> = (equilibrium.phi.iter().zip(&mode.shape))
            .map(|(phi, [re, im])| phi + amplitude * (re * cos - im * sin))
            .collect();
        search.projected(&moved).unwrap_or(moved)
    }
}

/// Scratch space of a search.
struct Search<'a> {
    mechanism: &'a Mechanism,
    kernel: Kernel<f64>,
    jacobian: Jacobian,
    /// Units of the coordinates \[rad, m\].
    unit: Vec<f64>,
    /// The least singular value of the rows that is not zero over the largest, where the last tangent was
    /// taken.
    conditioning: f64,
}

impl<'a> Search<'a> {
    fn new(mechanism: &'a Mechanism) -> Self {
        let bodies = mechanism.bodies.len();
        let unit = |k: usize| if k < bodies { 1.0 } else { mechanism.units.length };
        Self {
            mechanism,
            kernel: Kernel::new(mechanism),
            jacobian: Jacobian::new(mechanism),
            unit: (0..mechanism.coordinates()).map(unit).collect(),
            conditioning: 1.0,
        }
    }

    /// Accelerations at rest at a time, measured in the coordinates' units.
    fn pull(&mut self, phi: &[f64], t: f64) -> DVector<f64> {
        let still = vec![0.0; phi.len()];
        self.kernel.accelerate::<0>(self.mechanism, Time::of(t), phi, &still, Bias::default());
        DVector::from_iterator(phi.len(), self.kernel.load.iter().zip(&self.unit).map(|(a, unit)| a / unit))
    }

    fn depends_on_time(&mut self, phi: &[f64]) -> bool {
        let now = self.pull(phi, 0.0);
        [0.37, 1.9].iter().any(|&t| {
            let then = self.pull(phi, t);
            (&then - &now).amax() > 1e-9 * now.amax().max(then.amax())
        })
    }

    /// Directions that the constraints leave, orthonormal, one a column.
    fn tangent(&mut self, phi: &[f64]) -> DMatrix<f64> {
        let n = phi.len();
        let rows = self.mechanism.constraints.len();
        self.pull(phi, 0.0);
        let mut jacobian = DMatrix::<f64>::zeros(rows.max(n), n);
        for r in 0..rows {
            // Not by its own length: a row that vanishes leaves a direction more.
            let (unit, size) = (&self.unit, row_unit(self.mechanism, r));
            self.kernel.fold_gradient(r, (), |(), k, g| jacobian[(r, k)] = g * unit[k] / size);
        }
        let svd = jacobian.svd(false, true);
        let (values, right) = (svd.singular_values, svd.v_t.unwrap_or_else(|| DMatrix::identity(n, n)));
        // All rows may vanish at once: then their levers are what is small against.
        let largest = values.amax().max(self.mechanism.size_of_parts() / self.mechanism.units.length);
        let free: Vec<usize> = (0..n).filter(|&k| values[k] <= DEPENDENT * largest).collect();
        let held = values.iter().copied().filter(|&value| value > DEPENDENT * largest);
        self.conditioning = held.fold(largest, f64::min) / largest;
        DMatrix::from_fn(n, free.len(), |i, j| right[(free[j], i)])
    }

    /// Coordinates on the constraints next to these.
    fn projected(&mut self, phi: &[f64]) -> Option<Vec<f64>> {
        let n = phi.len();
        if self.mechanism.constraints.is_empty() {
            return Some(phi.to_vec());
        }
        let mut unknowns: Vec<Time> = phi.iter().map(|&phi| Time::of(phi)).collect();
        unknowns.resize(2 * n + 3, Time::default());
        let mut state = State::new(&unknowns, self.mechanism.bodies.len());
        project(self.mechanism, &mut self.kernel, &mut state, KEPT).ok()?;
        let of = |k: usize| state.unknown(k).hi + state.turns.get(k).map_or(0.0, |&turns| TAU * turns as f64);
        Some((0..n).map(of).collect())
    }

    /// T' A_q T and T' A_w T.
    fn linear(&mut self, phi: &[f64], tangent: &DMatrix<f64>) -> [DMatrix<f64>; 2] {
        let n = phi.len();
        let still = vec![0.0; n];
        self.jacobian.evaluate(self.mechanism, Time::default(), phi, &still, Bias::default());
        [0, n].map(|first| {
            let unit = &self.unit;
            let all = DMatrix::from_fn(n, n, |i, j| {
                self.jacobian.acceleration[2 * n * i + first + j] * unit[j] / unit[i]
            });
            tangent.transpose() * all * tangent
        })
    }

    /// A position moved along the constraints.
    fn moved(&self, phi: &[f64], tangent: &DMatrix<f64>, y: &DVector<f64>) -> Vec<f64> {
        (tangent * y).iter().zip(phi).zip(&self.unit).map(|((y, phi), unit)| phi + y * unit).collect()
    }

    /// Where a position slides to along its accelerations, as long as its potential energy falls.
    fn relaxed(&mut self, phi: &[f64]) -> Option<Vec<f64>> {
        let mut phi = self.projected(phi)?;
        let (mut here, mut length) = (self.potential(&phi), LONGEST);
        for _ in 0..ITERATIONS {
            let tangent = self.tangent(&phi);
            let mut y = tangent.transpose() * self.pull(&phi, 0.0);
            let pull = y.amax();
            if pull == 0.0 {
                break;
            }
            y *= length / pull;
            let there = self.moved(&phi, &tangent, &y);
            match self.projected(&there).map(|there| (self.potential(&there), there)) {
                Some((potential, there)) if potential < here => {
                    (phi, here, length) = (there, potential, 1.5 * length)
                }
                _ => length *= 0.3,
            }
            if length < 1e-4 {
                break;
            }
        }
        Some(phi)
    }

    /// The equilibrium that is reached from a position, if one is.
    fn settle(&mut self, phi: &[f64]) -> Option<Vec<f64>> {
        let mut phi = self.projected(phi)?;
        let mut tangent = self.tangent(&phi);
        let mut left = tangent.transpose() * self.pull(&phi, 0.0);
        let mut damping = 0.0;
        for _ in 0..ITERATIONS {
            let [slope, _] = self.linear(&phi, &tangent);
            let scale = slope.amax();
            if left.amax() <= STILL * scale.max(f64::MIN_POSITIVE) {
                // Once more: Newton's method squares what is left.
                let last = slope.lu().solve(&-&left).map(|y| self.moved(&phi, &tangent, &y));
                return last.and_then(|there| self.projected(&there)).or(Some(phi));
            }
            // Levenberg and Marquardt: Newton's step, shortened where it does not help.
            let squares = slope.transpose() * &slope;
            let mut step = None;
            for _ in 0..12 {
                let shifted = &squares
                    + DMatrix::identity(squares.nrows(), squares.nrows()) * (damping * scale * scale);
                let Some(mut y) = shifted.lu().solve(&(slope.transpose() * -&left)) else {
                    damping = f64::max(10.0 * damping, 1e-6);
                    continue;
                };
                let longest = y.amax();
                if longest > LONGEST {
                    y *= LONGEST / longest;
                }
                let moved = self.moved(&phi, &tangent, &y);
                if let Some(there) = self.projected(&moved) {
                    let frame = self.tangent(&there);
                    if frame.ncols() == tangent.ncols() {
                        let rest = frame.transpose() * self.pull(&there, 0.0);
                        if rest.norm() < left.norm() {
                            step = Some((there, frame, rest));
                            break;
                        }
                    }
                }
                damping = f64::max(10.0 * damping, 1e-6);
            }
            let Some(taken) = step else {
                return (left.amax() <= 100.0 * STILL * scale).then_some(phi);
            };
            (phi, tangent, left) = taken;
            damping = if damping < 1e-9 { 0.0 } else { 0.1 * damping };
        }
        None
    }

    /// True where two positions are the same but for whole turns.
    fn is_same(&self, a: &[f64], b: &[f64]) -> bool {
        let bodies = self.mechanism.bodies.len();
        a.iter().zip(b).zip(&self.unit).enumerate().all(|(k, ((a, b), unit))| {
            let apart = (a - b) / unit;
            let apart = if k < bodies { apart - TAU * (apart / TAU).round() } else { apart };
            apart.abs() < DISTINCT
        })
    }

    /// Stability and modes of an equilibrium.
    fn linearize(&mut self, phi: Vec<f64>, from_start: bool, freedom: usize) -> Equilibrium {
        let tangent = self.tangent(&phi);
        let f = tangent.ncols();
        let is_singular = f != freedom || self.conditioning < CROSSING;
        let [stiffness, damping] = self.linear(&phi, &tangent);
        let mut system = DMatrix::<f64>::zeros(2 * f, 2 * f);
        system.view_mut((0, f), (f, f)).fill_with_identity();
        system.view_mut((f, 0), (f, f)).copy_from(&stiffness);
        system.view_mut((f, f), (f, f)).copy_from(&damping);
        let values = eigenvalues(&stiffness, &damping, system);
        let largest = values.iter().map(|value| value.norm()).fold(0.0, f64::max);
        let is_family = values.iter().any(|value| value.norm() <= ROUNDING.sqrt() * 1e-2 * largest);
        let growth = values.iter().map(|value| value.re).fold(f64::NEG_INFINITY, f64::max);
        let stability = if is_singular {
            Stability::Undecided
        } else if growth > ROUNDING * largest {
            Stability::Unstable
        } else if growth < -ROUNDING * largest {
            Stability::AsymptoticallyStable
        } else {
            Stability::Stable
        };
        let mut listed: Vec<Complex<f64>> =
            values.into_iter().filter(|value| value.im >= -1e-3 * ROUNDING * largest).collect();
        listed.sort_by(|a, b| a.norm().total_cmp(&b.norm()).then(a.re.total_cmp(&b.re)));
        let modes = listed.into_iter().map(|value| {
            let frequency = value.norm();
            Mode {
                eigenvalue: [value.re, value.im],
                frequency,
                damping_ratio: if frequency > 0.0 { -value.re / frequency } else { 0.0 },
                shape: self.shape(value, &stiffness, &damping, &tangent),
            }
        });
        let modes = if is_singular { Vec::new() } else { modes.collect() };
        let wrapped = |(k, phi): (usize, &f64)| {
            if k >= self.mechanism.bodies.len() {
                return *phi;
            }
            let angle = phi - TAU * (phi / TAU).round();
            // Upside down is π, on whichever side rounding has it.
            if angle < -PI + 1e-9 { angle + TAU } else { angle }
        };
        let potential = self.potential(&phi);
        Equilibrium {
            potential,
            phi: phi.iter().enumerate().map(wrapped).collect(),
            stability,
            modes,
            from_start,
            is_family: is_family && !is_singular,
        }
    }

    fn potential(&mut self, phi: &[f64]) -> f64 {
        self.kernel.unit_vectors::<0>(self.mechanism, phi);
        self.mechanism.energy_facing::<f64, 0>(&mut self.kernel, phi, &vec![0.0; phi.len()]).potential
    }

    /// The shape of a mode in the coordinates.
    fn shape(
        &self,
        value: Complex<f64>,
        stiffness: &DMatrix<f64>,
        damping: &DMatrix<f64>,
        tangent: &DMatrix<f64>,
    ) -> Vec<[f64; 2]> {
        let f = stiffness.nrows();
        let matrix = DMatrix::from_fn(f, f, |i, j| {
            let own = if i == j { value * value } else { Complex::new(0.0, 0.0) };
            own - value * damping[(i, j)] - stiffness[(i, j)]
        });
        let svd = matrix.svd(false, true);
        let least = (0..f).min_by(|&a, &b| svd.singular_values[a].total_cmp(&svd.singular_values[b]));
        let (Some(least), Some(right)) = (least, svd.v_t) else { return Vec::new() };
        let y = DVector::from_fn(f, |i, _| right[(least, i)].conj());
        let q = tangent.map(|x| Complex::new(x, 0.0)) * y;
        let largest =
            q.iter().copied().max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or(Complex::new(1.0, 0.0));
        q.iter()
            .zip(&self.unit)
            .map(|(q, unit)| {
                let share = q / largest * *unit;
                [share.re, share.im]
            })
            .collect()
    }
}

/// Eigenvalues of the linearized motion.  Without damping they are the square roots of those of the stiffness,
/// which then have all digits of a problem half the size.
fn eigenvalues(stiffness: &DMatrix<f64>, damping: &DMatrix<f64>, system: DMatrix<f64>) -> Vec<Complex<f64>> {
    if damping.amax() == 0.0 {
        let squares = stiffness.clone().complex_eigenvalues();
        let root = |square: &Complex<f64>| {
            // Real where rounding made a pair of two that are equal.
            let real = square.im.abs() <= 1e-9 * square.norm();
            let root = if real { Complex::new(square.re, 0.0).sqrt() } else { square.sqrt() };
            [root, -root]
        };
        return squares.iter().flat_map(root).collect();
    }
    system.complex_eigenvalues().iter().copied().collect()
}
